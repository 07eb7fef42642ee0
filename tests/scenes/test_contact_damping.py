"""`*CONTACT DAMPING`: what comes and goes near a surface, and slides along it, loses."""

import math

import contact_damping_scenes
import numpy as np
import pytest
from contact_damping_scenes import MASS, balance, block_over_floor, damped
from friction_scenes import NODES, make_rigid, rubbing
from plain_scenes import BOTH, ONE, Scene
from scene_tools import DECKS, Deck, coarse_ring, run_deck, run_one_sided
from test_contact_output import restart
from test_segments import with_profile

EPS = np.finfo(float).eps
KINDS = [{"formulation": "NODE TO SURFACE"}, {"formulation": "SEGMENT"},
         {"formulation": "MORTAR"}, {"formulation": "MORTAR", "integration": "ELEMENTS"},
         {"formulation": "NODE TO SURFACE", "smoothing": "HERMITE"}]


def obeys(run, overlaps=False):
    """Energy goes into damping alone, in no step out of it, and the books agree."""
    history = run.history
    assert balance(history) < 1e-12
    loss = history["contact_damping_loss"]
    assert (np.diff(loss) >= 0).all()
    pairs = [name for name in history.dtype.names if name.endswith("_contact_damping_loss")]
    assert np.allclose(sum(history[name] for name in pairs), loss, rtol=1e-13, atol=0)
    assert run.verdict["contact_damping_loss"] == pytest.approx(loss[-1], rel=1e-8)
    if overlaps:
        assert all(reason.startswith("bodies overlap") for reason in run.verdict["reasons"])
    else:
        assert run.verdict["verdict"] == "good"


def keeps_momenta(run):
    for name in ("px", "py", "lz"):
        change = np.abs(run.history[name] - run.history[name][0]).max()
        assert change < 1e-13*np.abs(run.history["lz"][0])


def height(run, start):
    return start + run.fields()["displacement"][:, :15, 1].mean(axis=1)


# ---- closed forms -------------------------------------------------------------------------------


def impulse(gap, mu, clearance, flat):
    """The integral of the coefficient from 0 to a gap above 0."""
    gap = np.minimum(gap, clearance)
    part = np.minimum(gap, flat*clearance)
    if flat < 1:
        falls = np.maximum(gap - flat*clearance, 0)
        part = part + falls - falls**2/(2*(1 - flat)*clearance)
    return mu*part


@pytest.mark.each_value
@pytest.mark.parametrize("flat", [1.0, 0.5, 0.0])
@pytest.mark.parametrize("h", [0.5, 0.08, 0.02])
@pytest.mark.parametrize("more", KINDS)
def test_a_rigid_block_loses_velocity_by_the_way(more, h, flat, tmp_path):
    """Through the clearance M v + A m(gap) stays, by the closed form of m, in every step of any size;
    the longest goes from above the clearance almost to the floor."""
    deck = damped(block_over_floor(h, 1.6, height=0.7, velocity=(0.0, -1.0)), 0.6, 0.5, flat)
    run = run_deck(deck, tmp_path, **more)
    obeys(run)
    falls = np.flatnonzero(run.history["active"] > 0)
    n = falls[0] if len(falls) else len(run.history)
    velocity, gap = run.history["py"][:n]/MASS, height(run, 0.7)[:n]
    assert n > 1 and gap[-1] < 0.5
    assert np.ptp(velocity + impulse(gap, 0.6, 0.5, flat)) < 64*EPS


def test_a_rigid_block_falls_by_second_order(tmp_path):
    """With a constant coefficient the gap ends at 1/3 below the clearance for ever, as exp(-b t)
    does; with the mean of the way each halving of the increments leaves a quarter of the error."""
    error = []
    for h in (0.08, 0.04, 0.02):
        deck = damped(block_over_floor(h, 1.2, height=0.5, velocity=(0.0, -1.0)), 3.0, 0.5, 1.0)
        run = run_deck(deck, tmp_path/f"{h}", **NODES)
        obeys(run)
        time = run.history["time"]
        exact = 0.5 - (1 - np.exp(-3.0*time))/3.0
        error.append(np.abs(height(run, 0.5) - exact).max())
    assert error[0]/error[1] == pytest.approx(4, rel=0.05)
    assert error[1]/error[2] == pytest.approx(4, rel=0.05)


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("multiplier", ["DUAL", "STANDARD"])
def test_what_is_covered_while_gaps_close_is_damped(multiplier, way, tmp_path):
    """Half of a block is over a floor, that it comes onto by 1, or leaves, as it falls by 0.3 at 1:
    M v' = -mu (1 + way t) v. Taken until contact closes the gap: M (1 - v^2)/2, but for the last
    step, which is mu A h v^2/4 short at most as it ends on the floor, and for what the covered part
    changes by in a step: 3/2 of that, as gaps count by what is covered at its end."""
    h, mu = 0.02, 1.0
    deck = damped(block_over_floor(h, 0.4, height=0.3, velocity=(-way, -1.0), cells=(8, 4),
                                   floor=((-6, -1), (7, 1), (7, 1))), mu, 0.5, 1.0)
    deck.replace("*END STEP", "*BOUNDARY\n9000, 6, 6\n*END STEP")
    history = run_deck(deck, tmp_path, formulation="MORTAR", multiplier=multiplier,
                       initiation="ADMISSIBLE").history
    time = np.linspace(0, 0.4, 4001)
    v = np.exp(-mu/MASS*(time + way*time**2/2))
    k = np.searchsorted(np.concatenate([[0], np.cumsum((v[1:] + v[:-1])/2)*time[1]]), 0.3)
    covered, taken = 1 + way*time[k], MASS*(1 - v[k]**2)/2
    found = history["contact_damping_loss"][np.flatnonzero(history["active"] > 0)[0]]
    assert abs(found - taken) < mu*covered*h*v[k]**2/4 + 1.5*taken*h/min(1, covered)


@pytest.mark.parametrize("clearance", [None, 0.1])
@pytest.mark.parametrize("more", KINDS)
def test_a_rigid_block_slides_ever_slower(more, clearance, tmp_path):
    """By the rule of the middle of the step v1/v0 = (1 - b/2)/(1 + b/2), b = f A mu h/M, exactly;
    exp(-b) but for the third order."""
    h, b = 0.04, 0.5*0.6*0.04
    deck = damped(block_over_floor(h, 0.8, velocity=(1.0, 0.0), gravity=10.0), 0.6, clearance,
                  tangent=0.5)
    run = run_deck(deck, tmp_path, **more)
    obeys(run)
    velocity, n = run.history["px"]/MASS, np.arange(len(run.history))
    assert np.abs(velocity - ((1 - b/2)/(1 + b/2))**n).max() < 1e-13
    assert np.abs(velocity - np.exp(-b*n)).max() < b**3*n[-1]/12


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
def test_a_belt_takes_a_block_along(formulation, tmp_path):
    """A floor that is driven at 1: what the block lacks of that falls as above; the drive works."""
    h, b = 0.04, 0.5*0.6*0.04
    scene = Scene(h, 0.8, gravity=10.0)
    scene.block("BLOCK", (0, 0), (2, 1), (4, 2), stiffness=2e4)
    scene.block("FLOOR", (-2, -1), (8, 1), (7, 1), stiffness=2e4, velocity=(1.0, 0.0))
    scene.hold("FLOOR", lambda x, y: True, "2, 2")
    scene.hold("FLOOR", lambda x, y: True, "1, 1", 0.8)
    scene.side("BOTTOM", "BLOCK", lambda x, y: y < 1e-9)
    scene.side("TOP", "FLOOR", lambda x, y: y > -1e-9)
    scene.pairs = [("BOTTOM", "TOP")]
    make_rigid(scene, "BLOCK", (1, 0.5))
    run = run_deck(damped(scene.deck(ONE), 0.6, 0.1, tangent=0.5), tmp_path,
                   formulation=formulation)
    obeys(run)
    velocity, n = run.history["pair1_impulse_x"]/MASS, np.arange(len(run.history))
    assert np.abs(1 - velocity - ((1 - b/2)/(1 + b/2))**n).max() < 1e-12


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
def test_a_block_slides_ever_slower_on_a_profile(formulation, tmp_path):
    """A rigid surface of lines; three of them, so that nodes pass from one to the next."""
    h, b = 0.04, 0.5*0.6*0.04
    scene = Scene(h, 0.8, gravity=10.0)
    scene.block("BODY", (0, 0), (2, 1), (4, 2), stiffness=2e4, velocity=(2.0, 0))
    scene.side("BOTTOM", "BODY", lambda x, y: y < 1e-9)
    make_rigid(scene, "BODY", (1, 0.5), (2.0, 0.0))
    deck = with_profile(scene, "START, -3., 0.\nLINE, 0.7, 0.\nLINE, 2.2, 0.\nLINE, 6., 0.",
                        slave="BOTTOM")
    deck = damped(deck, 0.6, 0.1, tangent=0.5)
    run = run_deck(deck, tmp_path, formulation=formulation)
    obeys(run)
    velocity, n = run.history["px"]/MASS, np.arange(len(run.history))
    assert np.abs(velocity - 2.0*((1 - b/2)/(1 + b/2))**n).max() < 1e-12


def test_no_slip_is_damped_above_the_clearance(tmp_path):
    """What flies along the floor above it keeps its velocity, bit by bit of the loss."""
    deck = damped(block_over_floor(0.04, 0.4, height=0.2, velocity=(1.0, 0.0)), 0.6, 0.1,
                  tangent=0.5)
    run = run_deck(deck, tmp_path, **NODES)
    assert run.verdict["verdict"] == "good"
    assert (run.history["contact_damping_loss"] == 0).all()


@pytest.mark.parametrize("more", KINDS[:3])
def test_an_oscillator_on_a_penalty(more, tmp_path):
    """Let go where the floor bears nothing, a rigid block swings about the depth at which it is
    borne: M y'' + A mu y' + A k y = -M g, with the ratio mu/2 sqrt(A/(M k)) of critical damping. The
    middle of the step is late by (w h)^2/12 of the phase."""
    k, mu, g = 1000.0, 12.0, 10.0
    w, d = math.sqrt(k), mu/2
    wd = math.sqrt(w*w - d*d)
    error = []
    for h in (0.004, 0.002, 0.001):
        deck = damped(block_over_floor(h, 0.6, gravity=g), mu)
        deck.replace("*CONSTRAINT METHOD, TYPE=<method>",
                     f"*CONSTRAINT METHOD, TYPE=PENALTY, STIFFNESS={k!r}")
        run = run_deck(deck, tmp_path/f"{h}", **more)
        assert balance(run.history, MASS*g*g/k) < 1e-12
        assert (np.diff(run.history["contact_damping_loss"]) >= 0).all()
        t = run.history["time"]
        exact = -g/k*(1 - np.exp(-d*t)*(np.cos(wd*t) + d/wd*np.sin(wd*t)))
        error.append(np.abs(height(run, 0.0) - exact).max()/(g/k))
    assert error[1] < 0.3*error[0] and error[2] < 0.3*error[1]
    assert error[2] < (w*0.001)**2/12*w*0.6


# ---- the ring -----------------------------------------------------------------------------------


def ring(*damping):
    """On fewer elements than in the book."""
    return contact_damping_scenes.ring(*damping, scene=coarse_ring())


@pytest.mark.parametrize("more", [*KINDS, {"formulation": "NODE TO SURFACE", "sides": "BOTH"}])
def test_a_ring_keeps_momenta_and_pays_for_damping(more, tmp_path):
    runs = [run_deck(ring(0.5, 0.1, 0.3, 0.7), tmp_path/method, h=0.02, t_end=t_end, method=method,
                     **more) for method, t_end in (("NULL SPACE", 0.6), ("SADDLE POINT", 0.3))]
    for run in runs:
        obeys(run)
        keeps_momenta(run)
        assert run.history["cuts"].sum() == 0
        assert run.history["contact_damping_loss"][-1] > 0.1*run.history["kinetic"][0]
    whole, part = (run.history for run in runs)
    for name in ("kinetic", "contact_damping_loss", "strain"):
        assert np.allclose(whole[name][:len(part)], part[name], rtol=1e-9, atol=1e-11)


@pytest.mark.each_value
@pytest.mark.parametrize("more", [{"method": "PENALTY"}, {"method": "AUGMENTED LAGRANGE"},
                                  {"initiation": "ADMISSIBLE"}, {"initiation": "VELOCITY UPDATE"}])
@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "MORTAR"])
def test_a_ring_held_in_other_ways(formulation, more, tmp_path):
    run = run_deck(ring(0.5, 0.1, 0.3, 0.7), tmp_path, h=0.02, t_end=0.6, formulation=formulation,
                   **more)
    obeys(run)
    keeps_momenta(run)


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
def test_a_ring_that_rubs_and_is_damped(formulation, tmp_path):
    deck = rubbing(ring(0.5, 0.1, 0.3, 0.7), 0.3, "FRICTIONLESS")
    run = run_deck(deck, tmp_path, h=0.02, t_end=0.6, formulation=formulation)
    obeys(run)
    keeps_momenta(run)
    assert (np.diff(run.history["friction_loss"]) >= -1e-15*run.history["kinetic"].max()).all()
    assert run.history["friction_loss"][-1] > 0
    assert run.verdict["law_violation"] < 1e-9


@pytest.mark.parametrize("more", [{"sides": "BOTH", **NODES}, {"sides": "ONE", **NODES},
                                  {"formulation": "SEGMENT"}, {"formulation": "MORTAR"}])
def test_a_strip_damped_against_itself(more, tmp_path):
    deck = damped(Deck.read(DECKS / "self_contact.inp"), 0.5, 0.02, 0.5, 0.5, "FRICTIONLESS")
    run = run_one_sided(deck, tmp_path, t_end=0.6, **more)
    obeys(run, overlaps=more.get("sides") != "BOTH")
    keeps_momenta(run)
    assert run.history["contact_damping_loss"][-1] > 0.05*run.history["kinetic"][0]


@pytest.mark.parametrize("scheme", ["MIDPOINT", "ENERGY DECAYING"])
def test_other_schemes(scheme, tmp_path):
    """Momenta stay, damping takes in every step, as the scheme does or not."""
    deck = ring(0.5, 0.1, 0.3, 0.7)
    deck.insert(f"*TIME INTEGRATION, SCHEME={scheme}", before="*CONSTRAINT METHOD")
    run = run_deck(deck, tmp_path, h=0.02, t_end=0.6, **NODES)
    keeps_momenta(run)
    loss = run.history["contact_damping_loss"]
    assert (np.diff(loss) >= 0).all()
    assert loss[-1] > 0.01*run.history["kinetic"][0]


# ---- books --------------------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "MORTAR"])
def test_a_pair_transmits_what_damps(formulation, tmp_path):
    """Impulse of the pair and momentum of the body, with nothing but damping between them."""
    deck = damped(block_over_floor(0.02, 0.5, height=0.45, velocity=(0.3, -0.5)), 0.6, 0.5, 0.5, 0.8)
    run = run_deck(deck, tmp_path, formulation=formulation)
    obeys(run)
    history = run.history
    assert history["active"].max() == 0 and history["pair1_duration"][-1] == 0
    for axis, name in (("x", "px"), ("y", "py")):
        assert np.allclose(history[f"pair1_impulse_{axis}"], history[name] - history[name][0],
                           rtol=0, atol=64*EPS)
        assert abs(history[f"pair1_impulse_{axis}"][-1]) > 0.02
    force = run.fields()["contact_force"][-1, :15].sum(axis=0)
    assert np.allclose(force, [history["pair1_force_x"][-1], history["pair1_force_y"][-1]],
                       rtol=1e-12)


def test_a_surface_of_nodes_has_a_force_by_velocity(tmp_path):
    """Five nodes without area: each takes coefficient times velocity."""
    deck = block_over_floor(0.02, 0.4, height=0.45, velocity=(0.0, -0.5))
    deck.replace("*SURFACE INTERACTION, NAME=SMOOTH", "*SURFACE, NAME=NODES, TYPE=NODE\n"
                 "1\n4\n7\n10\n13\n*SURFACE INTERACTION, NAME=SMOOTH")
    deck.replace("BOTTOM, TOP", "NODES, TOP")
    run = run_deck(damped(deck, 0.2, 0.5, 1.0), tmp_path, **NODES)
    obeys(run)
    velocity, gap = run.history["py"]/MASS, height(run, 0.45)
    assert np.ptp(velocity + 5*0.2*gap/MASS) < 64*EPS


def test_both_sides_share_the_area(tmp_path):
    """Of two blocks with the same nodes, face to face, both sides do what one does."""
    way = []
    for sides in (ONE, BOTH):
        deck = block_over_floor(0.02, 0.4, height=0.45, velocity=(0.0, -0.5), sides=sides,
                                floor=((0, -1), (2, 1), (4, 1)))
        run = run_deck(damped(deck, 0.6, 0.5, 0.5), tmp_path/sides, **NODES)
        obeys(run)
        way.append(height(run, 0.45))
    assert np.abs(way[1] - way[0]).max() < 64*EPS


def test_static_steps_are_not_damped(tmp_path):
    """A static step before the dynamic one is that of a deck without the card."""
    deck = damped(block_over_floor(0.1, 0.2, gravity=10.0, rigid=False), 50.0, 0.1, 0.5, 0.5)
    deck.replace("*DYNAMIC, DIRECT", "*STATIC, DIRECT")
    deck.replace("*CONSTRAINT METHOD", "*CONTACT CONTROLS, STABILIZE\n*CONSTRAINT METHOD")
    run = run_deck(deck, tmp_path, **NODES)
    assert run.verdict["verdict"] == "good"
    assert (run.history["contact_damping_loss"] == 0).all()
    assert "damps nothing: there is no dynamic step" in run.log


def test_what_is_damped_keeps_its_mass(tmp_path):
    runs = [run_deck(ring(0.5, 0.1, 0.3, 0.7), tmp_path/word, **NODES, h=0.02, t_end=0.3,
                     initiation=word) for word in ("PERSISTENT", "MASSLESS")]
    assert "both surfaces keep theirs" in runs[1].log
    assert runs[0].digits() == runs[1].digits()


def test_the_log_and_the_report_say_it(tmp_path):
    run = run_deck(ring(0.5, 0.1, 0.25, 0.75), tmp_path, **NODES, h=0.02, t_end=0.3)
    assert ", damping 0.5 up to a clearance of 0.1, 0.75 of it against slip" in run.log
    assert "contact damping dissipated" in run.log


def test_a_restart_has_the_same_bits(tmp_path):
    deck = ring(0.5, 0.1, 0.3, 0.7)
    deck.replace("FREQUENCY=50", "FREQUENCY=13")
    (tmp_path/"again").mkdir()
    whole = run_deck(deck, tmp_path/"whole", **NODES, h=0.02, t_end=0.4)
    again = restart(whole, tmp_path/"again")
    loss = again.history["contact_damping_loss"]
    assert loss[-1] > loss[-7] > 0
    assert again.digits() == whole.digits()


def test_without_damping_nothing_of_it_runs(tmp_path):
    """A coefficient of 0 is none: the same bits, corrections and counters."""
    runs = []
    for card in ("", "\n*CONTACT DAMPING, TANGENT FRACTION=1.\n0., 0.1, 0.5"):
        deck = Deck.read(DECKS/"ring.inp")
        deck.replace("NAME=FRICTIONLESS", f"NAME=FRICTIONLESS{card}")
        runs.append(run_deck(deck, tmp_path/str(len(runs)), **NODES, h=0.02, t_end=0.4))
    assert runs[0].digits() == runs[1].digits()
    assert runs[0].verdict["counts"] == runs[1].verdict["counts"]
