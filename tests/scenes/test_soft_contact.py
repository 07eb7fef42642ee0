"""`*CONSTRAINT METHOD, TYPE=PENALTY` and `AUGMENTED LAGRANGE`: contact that gives way."""

import math
import re

import numpy as np
import pytest
from plain_scenes import BOTH, ONE, SCENES, UNGUARDED, Scene, below
from scene_tools import DECKS, attempt, coarse_ring, run_deck
from test_contact_output import data_sets, restart
from test_explicit import EVERY, LINEAR, bar, block, critical_step, stiffness_and_mass
from test_statics import E, FORCE, FORMULATIONS, NU, ACCURACY, displacement, tower

METHOD = "*CONSTRAINT METHOD, TYPE=<method>"
PENALTY, AUGMENTED = "PENALTY", "AUGMENTED LAGRANGE"


def soft(deck, options):
    """`deck` with options of its constraint method; the method is its parameter still."""
    deck.replace(METHOD, f"{METHOD}, {options}")
    return deck


def balance(history):
    """Largest error of the energy, and the most that contact has made or taken, by the largest."""
    scale = (history["kinetic"] + history["strain"]).max()
    total = history["total"] - history["contact_work"]
    return np.abs(total - total[0]).max()/scale, np.abs(history["contact_work"]).max()/scale


# ---- one mass on a spring -----------------------------------------------------------------------

MASS, SPEED, STIFFNESS, GAP = 2.0, 0.25, 200.0, 0.03
OMEGA = math.sqrt(STIFFNESS/MASS)
REBOUND = GAP/SPEED + math.pi/OMEGA              # when it is back at a gap of 0


def falling(h, t_end):
    """A rigid square of side 1 falls flat onto a fixed one."""
    scene = Scene(h, t_end)
    scene.block("A", (0.0, GAP), (1.0, 1.0), (2, 2), density=MASS, velocity=(0.0, -SPEED))
    scene.block("B", (-0.5, -1.0), (2.0, 1.0), (2, 1)).hold("B", lambda x, y: True)
    scene.side("FOOT", "A", lambda x, y: y < GAP + 1e-9)
    scene.side("HEAD", "B", lambda x, y: y > -1e-9)
    scene.pairs = [("FOOT", "HEAD")]
    deck = scene.deck(UNGUARDED)
    deck.replace("*SURFACE INTERACTION", f"*NODE\n900, 0.5, {0.5 + GAP}\n*RIGID BODY, ELSET=A, "
                 f"REF NODE=900\n*INITIAL CONDITIONS, TYPE=ROTATING VELOCITY\n900, 0., 0., {-SPEED}\n"
                 f"0.5, {0.5 + GAP}\n*BOUNDARY\n900, 1\n900, 6\n*SURFACE INTERACTION")
    return soft(deck, f"STIFFNESS={STIFFNESS}")


def place(history):
    """Momentum of the square, and where it is, by the momentum: exact for the scheme."""
    v = history["py"]/MASS
    way = np.concatenate([[0.0], np.cumsum(0.5*(v[1:] + v[:-1])*np.diff(history["time"]))])
    return v, GAP + way


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
def test_a_mass_on_the_spring_of_a_penalty(formulation, tmp_path):
    """It rebounds as fast as it came, after half a period: of second order in h."""
    t_end, late = REBOUND + 0.3, []
    for h in (0.02, 0.01, 0.005):
        run = run_deck(falling(h, t_end), tmp_path/str(h), method=PENALTY, formulation=formulation)
        history = run.history
        error, made = balance(history)
        assert max(error, made) < 1e-12
        v, gap = place(history)
        assert v[-1] == pytest.approx(SPEED, rel=1e-12)
        late.append(abs(gap[-1] - SPEED*(t_end - REBOUND)))
        # The most that is stored, and the deepest place, between two times.
        depth = SPEED/OMEGA
        assert -gap.min() == pytest.approx(depth, rel=(OMEGA*h)**2)
        assert history["contact_energy"].max() == pytest.approx(0.5*STIFFNESS*gap.min()**2,
                                                                rel=1e-11)
    # Entering and leaving fall into steps at places of their own: the mean order of two halvings.
    assert math.log2(late[0]/late[2])/2 > 1.5, late


# ---- energy and momenta -------------------------------------------------------------------------


def discs(sides, cells=(8, 3)):
    """Two discs that meet askew, touch from 0.17 to 0.5, and part."""
    scene = Scene(0.02, 0.6)
    scene.disc("A", (-0.6, 0.0), 0.5, cells, velocity=(1.0, 0.0), spin=0.5)
    scene.disc("B", (0.6, 0.3), 0.5, cells, velocity=(-0.5, 0.0), density=2.0)
    scene.pairs = [("A", "B")]
    return scene.deck(sides)


@pytest.mark.each_value
@pytest.mark.parametrize("factor", [0.1, 1, 10])
@pytest.mark.parametrize(("formulation", "sides"), [
    ("NODE TO SURFACE", ONE), ("NODE TO SURFACE", BOTH), ("SEGMENT", ONE)])
def test_a_penalty_keeps_energy_and_momenta(formulation, sides, factor, tmp_path):
    done, run = attempt(soft(discs(sides), f"FACTOR={factor}"), tmp_path, (),
                        {"method": PENALTY, "formulation": formulation})
    history = run.history
    assert history["active"].max() > 1 and history["active"][-1] == 0
    assert history["contact_energy"].max() > 1e-3*history["kinetic"][0]
    assert history["contact_energy"][-1] == 0
    assert max(balance(history)) < 1e-12
    scale = np.abs(history["lz"]).max() + np.abs(history["px"]).max()
    for name in ("px", "py", "lz"):
        assert np.abs(history[name] - history[name][0]).max() < 1e-12*scale, name
    if sides != BOTH:
        return
    # The nodes of both sides push: nothing goes in farther than they give way, which is told.
    is_deep = run.verdict["give"] > 0.1
    assert is_deep is (factor == 0.1)
    assert done.returncode == (3 if is_deep else 0)
    assert [text.startswith("contact penetrates by up to") for text in run.verdict["reasons"]] \
        == [True]*is_deep
    assert f"contact penetrates by up to {run.verdict['give']:.3g}"[:30] in run.log


@pytest.mark.each_value
@pytest.mark.parametrize(("cells", "h"), [((8, 3), 0.02), ((8, 3), 0.005), pytest.param((16, 6), 0.02, marks=pytest.mark.long)])
@pytest.mark.parametrize("smoothing", ["NONE", "HERMITE"])
@pytest.mark.parametrize("normal", ["NODAL", "EDGE"])
def test_a_penalty_goes_on_where_mortar_meets_other_edges(normal, smoothing, cells, h, tmp_path):
    """Gaps of coarse round bodies jump from step to step at one place, what is stored does not."""
    _, run = attempt(discs(ONE, cells), tmp_path, (), {
        "method": PENALTY, "formulation": "MORTAR", "smoothing": smoothing, "normal": normal,
        "h": h})
    history = run.history
    assert history["contact_energy"].max() > 1e-3*history["kinetic"][0]
    assert history["contact_energy"][-1] == 0
    assert max(balance(history)) < 1e-12
    scale = np.abs(history["lz"]).max() + np.abs(history["px"]).max()
    for name in ("px", "py", "lz"):
        assert np.abs(history[name] - history[name][0]).max() < 1e-12*scale, name
    assert run.verdict["verdict"] == "good"


@pytest.mark.each_value
@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
@pytest.mark.parametrize("name", ["pile", "wedge", "ledge", "coil", "tower", "crossing", "slide off",
                                  "slave floor", "twin"])
def test_a_penalty_loses_nothing(name, formulation, tmp_path):
    """Corners, ends of surfaces, thin bodies: nothing, to round-off."""
    scene = SCENES[name]()
    if name == "pile":
        scene.t_end = 0.34               # by when thirty nodes are in contact
    done, run = attempt(scene.deck(ONE), tmp_path, (), {"method": PENALTY, "formulation": formulation})
    assert run.history["contact_energy"].max() > 0
    error, made = balance(run.history)
    assert error < 1e-12 and made < 1e-12
    assert run.verdict["verdict"] == "bad" or done.returncode == 0


def factorisations(run):
    return int(re.search(r"(\d+) factorisations", run.log)[1])


@pytest.mark.parametrize("formulation", [pytest.param("NODE TO SURFACE", marks=pytest.mark.long),
                                         pytest.param("SEGMENT", marks=pytest.mark.long), "MORTAR"])
def test_a_stiff_penalty_costs_what_exact_contact_does(formulation, tmp_path):
    """Its multipliers are unknowns on their way, so that no iterate is pushed by what its gaps
    happen to be. The step to exact contact is as large as that to a softer one: some three times (76
    for 25), and a half of one more."""
    flight = {"formulation": formulation, "t_end": 1.0}          # of which half is free
    exact = run_deck(discs(ONE), tmp_path/"exact", **flight)
    for factor in (1, 10, 100):
        _, run = attempt(soft(discs(ONE), f"FACTOR={factor}"), tmp_path/str(factor), (),
                         {"method": PENALTY, **flight})
        assert run.history["active"].max() > 1
        assert factorisations(run) < 3.5*factorisations(exact), factor


@pytest.mark.parametrize("smoothing", ["NONE", "HERMITE"])
def test_a_penalty_with_integrated_gaps_on_a_flat_surface(smoothing, tmp_path):
    """Which edges a gap is made of does not change there: energy as for nodes."""
    run = run_deck(coarse_ring(), tmp_path, h=0.02, t_end=1.5, method=PENALTY,
                   formulation="MORTAR", smoothing=smoothing)
    assert run.history["active"].max() > 2
    assert max(balance(run.history)) < 1e-12


@pytest.mark.parametrize("initiation", ["PERSISTENT", "ADMISSIBLE"])
def test_an_augmented_lagrangian_is_what_the_null_space_is(initiation, tmp_path):
    """Gaps are held to TOLERANCE, and so the motion; its loss of energy is in contact work."""
    runs = []
    for method, options in (("NULL SPACE", None), (AUGMENTED, "TOLERANCE=1e-4"),
                            (AUGMENTED, "TOLERANCE=1e-10")):
        deck = discs(ONE) if options is None else soft(discs(ONE), options)
        runs.append(run_deck(deck, tmp_path/str(options), method=method, initiation=initiation,
                             formulation="NODE TO SURFACE", t_end=0.26))
        assert runs[-1].history["active"][-1] >= 3 and runs[-1].history["cuts"].sum() == 0
    hard, *others = (run.fields()["displacement"][-1] for run in runs)
    rough, fine = (np.abs(u - hard).max()/np.abs(hard).max() for u in others)
    assert fine < 1e-7 < rough < 0.1
    for run, tolerance in zip(runs[1:], (1e-4, 1e-10)):
        assert balance(run.history)[0] < 1e-12
        assert 0 < run.verdict["give"] <= tolerance
        assert run.verdict["augmentations"] >= 2
    assert runs[2].verdict["augmentations"] > runs[1].verdict["augmentations"]


def test_nodes_of_both_sides_that_meet_are_pushed_back_too(tmp_path):
    """A node on a node, each held by the other's surface: one of the two pulls and is let go."""
    scene = Scene(0.01, 0.1)
    scene.disc("BALL", (0.0, 0.52), 0.5, (8, 4), velocity=(0.3, -1.0))
    scene.block("BLOCK", (-1.5, -0.8), (3.0, 0.8), (30, 8)).hold("BLOCK", below(-0.8))
    scene.pairs = [("BALL", "BLOCK")]
    hard, soft = (run_deck(scene.deck(BOTH), tmp_path/method.split()[0], method=method,
                           formulation="NODE TO SURFACE") for method in ("NULL SPACE", AUGMENTED))
    assert soft.history["time"][-1] == hard.history["time"][-1]
    assert hard.history["active"].max() > 1 and soft.history["cuts"].sum() == 0
    hard, soft = (run.fields()["displacement"][-1] for run in (hard, soft))
    assert np.abs(soft - hard).max() < 1e-7*np.abs(hard).max()


@pytest.mark.parametrize("is_static", [False, True])
@pytest.mark.parametrize("upper, lower", [(4, 3), (3, 4), (2, 2)])
def test_blocks_on_blocks_are_pushed_back_by_the_default(upper, lower, is_static, tmp_path):
    """Rows of nodes of both sides say nearly the same: pushes grow stiffer until gaps close."""
    found = []
    for method in ("NULL SPACE", AUGMENTED):
        scene = Scene(0.01, 0.08)                    # three increments with contact
        scene.block("LOWER", (0.0, 0.0), (1.0, 1.0), (lower, lower)).hold("LOWER", below(0.0))
        scene.block("UPPER", (0.0, 1.0) if is_static else (0.2, 1.05), (1.0, 1.0), (upper, upper),
                    velocity=(0.3, -1.0))
        scene.pairs = [("UPPER", "LOWER")]
        if is_static:
            scene.hold("UPPER", lambda x, _: x == 0.0, "1, 1")
            scene.gravity = 10.0
        deck = scene.deck(BOTH)
        if is_static:
            deck.replace("*DYNAMIC, DIRECT", "*STATIC")
        run = run_deck(deck, tmp_path/method, method=method, formulation="NODE TO SURFACE")
        assert run.verdict["verdict"] == "good" and run.history["cuts"].sum() == 0
        found.append(run.fields()["displacement"][-1])
    hard, soft = found
    assert np.abs(soft - hard).max() < 1e-6*np.abs(hard).max()


@pytest.mark.parametrize("scheme", ["MIDPOINT", "TRAPEZOIDAL", "GENERALIZED ALPHA", "BDF2",
                                    "ENERGY DECAYING"])
def test_other_schemes_push_by_a_penalty_too(scheme, tmp_path):
    """Those that push at the end of a step make or take energy by it, and the column tells."""
    deck = discs(BOTH)
    deck.replace(METHOD, f"*TIME INTEGRATION, SCHEME={scheme}\n{METHOD}")
    _, run = attempt(deck, tmp_path, (), {"method": PENALTY, "formulation": "NODE TO SURFACE",
                                          "h": 0.01})
    made = balance(run.history)[1]
    for name in ("px", "py"):
        assert np.abs(run.history[name] - run.history[name][0]).max() < 1e-12
    assert (made < 1e-12) == (scheme in ("MIDPOINT", "ENERGY DECAYING"))
    assert made < 0.2


def test_what_gives_way_is_told_by_the_shorter_edge(tmp_path):
    """The judge counts by the edges of the bar; those of the floor are longer."""
    for factor, verdict in ((10, "good"), (0.1, "bad")):
        _, run = attempt(DECKS/"bouncing_bar.inp", tmp_path/str(factor), (), {
            "method": f"'PENALTY, FACTOR={factor}'", "t_end": 2.0, "frame": 2.0, "h": 0.0025,
            "formulation": "NODE TO SURFACE"})
        assert run.verdict["verdict"] == verdict, run.verdict["reasons"]
        # The foot of the bar is a single edge, half of which is each node's.
        assert 0.5 <= run.verdict["give"]/run.verdict["penetration"] <= 4


# ---- explicit steps -----------------------------------------------------------------------------


def explicit(deck):
    """`deck` by central differences."""
    deck.replace("*DYNAMIC, DIRECT", "*DYNAMIC, DIRECT, EXPLICIT")
    for card in ("*NEWTON", "*CONTACT INITIATION"):
        deck.remove(card)
    return deck


@pytest.mark.parametrize("share", [0.1, 0.5, 0.99])
@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
def test_a_mass_on_the_spring_by_central_differences(formulation, share, tmp_path):
    """Each place and velocity is that of the same formulas in Python, and so is what is stored."""
    h = share*2/OMEGA
    deck = explicit(falling(h, math.ceil((REBOUND + 0.1)/h)*h))
    run = run_deck(deck, tmp_path, method=PENALTY, formulation=formulation)
    history = run.history
    assert critical_step(run) == pytest.approx(2/OMEGA, rel=1e-5), "of six printed digits"

    def push(gap):
        return -STIFFNESS*min(gap, 0.0)

    gap, v, impulse = GAP, -SPEED, 0.0
    for row in history[1:]:
        way = h*v + 0.5*h*h/MASS*push(gap)
        both = 0.5*h*(push(gap) + push(gap + way))
        gap, v, impulse = gap + way, v + both/MASS, impulse + both
        assert row["py"] == pytest.approx(MASS*v, abs=1e-12*MASS*SPEED)
        assert row["contact_energy"] == pytest.approx(0.5*STIFFNESS*min(gap, 0.0)**2,
                                                      abs=1e-12*MASS*SPEED**2)
        assert row["pair1_impulse_y"] == pytest.approx(impulse, abs=1e-12*MASS*SPEED)
    assert impulse > MASS*SPEED, "it has turned back"
    assert run.verdict["verdict"] == "good"


def test_the_critical_step_with_a_penalty_is_that_of_the_closed_contact(tmp_path):
    """The highest frequency of bar and springs by numpy; above it the deck is refused."""
    cells, size = (2, 6), (0.1, 1.0)
    stiffness, mass = stiffness_and_mass(cells, size, 0.0)
    for by_area in (1e3, 1e4, 1e6):
        closed = stiffness.copy()
        for node, area in enumerate((0.025, 0.05, 0.025)):
            for freedom in (2*node, 2*node + 1):
                closed[freedom, freedom] += by_area*area
        root = np.sqrt(mass)
        limit = 2/math.sqrt(np.linalg.eigvalsh(closed/np.outer(root, root)).max())
        deck = bar(cells, kind="NODE TO SURFACE, SIDES=ONE")
        deck.insert(f"*CONSTRAINT METHOD, TYPE=PENALTY, STIFFNESS={by_area}", before="*NODE PRINT")
        done, _ = attempt(deck, tmp_path/f"{by_area}above", (), {"h": 1.001*limit, "t_end": 1.0})
        assert done.returncode == 2
        told = re.search(r"is larger than the critical step (\S+) with closed contacts", done.stderr)
        assert float(told[1]) == pytest.approx(limit, rel=2e-5)
        run = run_deck(deck, tmp_path/f"{by_area}below", h=0.999*limit, t_end=0.6)
        history = run.history
        # The contact shakes the fastest vibration, whose energy may seem 1/(1 - 0.999^2) larger.
        assert (history["kinetic"] + history["strain"]).max() < 1e3*history["kinetic"][0]
        assert history["contact_energy"].max() > 0


def coarse_on_fine(by_area):
    """One element falls onto ten times finer ones, its corners onto nodes of theirs."""
    model = f"""*NODE
901, 0.1, 0.201
902, 0.9, 0.201
903, 0.9, 0.601
904, 0.1, 0.601
*NSET, NSET=UPPER
901, 902, 903, 904
*ELEMENT, TYPE=CPE4, ELSET=TOP
901, 901, 902, 903, 904
*SOLID SECTION, ELSET=TOP, MATERIAL=M, KINEMATICS=LINEAR
1.
*SURFACE, NAME=FOOT
901, S1
*SURFACE, NAME=HEAD
{chr(10).join(f"{e}, S3" for e in range(11, 21))}
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I, TYPE=NODE TO SURFACE, SIDES=ONE
FOOT, HEAD
*INITIAL CONDITIONS, TYPE=VELOCITY
UPPER, 2, -0.1
*BOUNDARY
{chr(10).join(f"{n}, 1, 2" for n in range(1, 12))}"""
    deck = block((10, 2), (1.0, 0.2), nu=0.0, model=model, step=EVERY, **LINEAR)
    deck.insert(f"*CONSTRAINT METHOD, TYPE=PENALTY, STIFFNESS={by_area}", before="*NODE PRINT")
    return deck


def test_contacts_that_stiffen_a_node_by_more_than_their_share_are_told(tmp_path):
    """The corner of a coarse element pushes one node of a fine surface with the pressure of half its
    side: the critical step is found anew when that closes, as numpy has it, and a run stops there."""
    by_area = 1e4
    lower = [2*n + a for n in range(11, 33) for a in (0, 1)]
    stiffness, mass = np.zeros((52, 52)), np.zeros(52)
    for freedom, kept, (k, m) in (
            (range(44), lower, stiffness_and_mass((10, 2), (1.0, 0.2), 0.0)),
            (range(44, 52), range(8), stiffness_and_mass((1, 1), (0.8, 0.4), 0.0))):
        stiffness[np.ix_(freedom, freedom)], mass[list(freedom)] = k[np.ix_(kept, kept)], m[kept]
    for slave, master in ((0, 12), (1, 20)):
        gap = np.zeros(52)
        gap[44 + 2*slave + 1], gap[2*master + 1] = 1.0, -1.0
        stiffness += 0.4*by_area*np.outer(gap, gap)
    root = np.sqrt(mass)
    limit = 2/math.sqrt(np.linalg.eigvalsh(stiffness/np.outer(root, root)).max())
    deck = coarse_on_fine(by_area)
    done, _ = attempt(deck, tmp_path/"above", (), {"h": 1.01*limit, "t_end": 0.03})
    assert done.returncode == 3
    told = re.search(r"is larger than the critical step (\S+) with closed contacts", done.stderr)
    assert float(told[1]) == pytest.approx(limit, rel=1e-4)
    run = run_deck(deck, tmp_path/"below", h=0.99*limit, t_end=0.03)
    assert run.history["contact_energy"].max() > 0


@pytest.mark.parametrize(("formulation", "sides"), [
    ("NODE TO SURFACE", ONE), pytest.param("NODE TO SURFACE", BOTH, marks=pytest.mark.long),
    pytest.param("SEGMENT", ONE, marks=pytest.mark.long)])
def test_explicit_penalties_keep_momenta(formulation, sides, tmp_path):
    """Momenta to round-off, energy but for what central differences are off by, of order 2, and for
    a part that is the same for any step: tops of vertices that face each other stand out by another
    part of an edge as discs turn, at most 0.13/4 of it by half the tangent of a vertex (14s)."""
    off, half_turn = [], math.pi/32
    for h in (0.002, 0.001, 0.0005):
        run = run_deck(explicit(discs(sides)), tmp_path/str(h), method=PENALTY,
                       formulation=formulation, h=h)
        history = run.history
        assert history["active"].max() > 1 and history["active"][-1] == 0
        assert history["contact_energy"].max() > 1e-3*history["kinetic"][0]
        assert history["contact_energy"][-1] == 0 and np.all(history["contact_work"] == 0)
        scale = np.abs(history["lz"]).max() + np.abs(history["px"]).max()
        for name in ("px", "py", "lz"):
            assert np.abs(history[name] - history[name][0]).max() < 1e-12*scale, name
        assert run.verdict["verdict"] == "good" and 0 < run.verdict["give"] < 0.1
        off.append(np.ptp(history["total"])/history["kinetic"][0])
    force = np.hypot(history["pair1_force_x"], history["pair1_force_y"]).max()
    top = 0.13/4*math.sin(half_turn)*math.tan(half_turn)     # edges of discs of radius 1/2
    assert off[2] < force*top/history["kinetic"][0]
    # Above first order: contact begins and ends anywhere in an increment.
    assert abs(off[2] - off[1]) < abs(off[1] - off[0])/2


# ---- statics ------------------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
@pytest.mark.parametrize("gap", [0.0, 0.1])
def test_a_uniform_pressure_gives_way_evenly(tmp_path, formulation, gap):
    """Patch test: the upper square goes in by pressure over stiffness, all else as without."""
    stiffness = 50.0*E
    text = tower([gap], formulation, step="*CONTACT FILE\nCDIS, CSTR")
    text = text.replace("*CLOAD", f"*CONSTRAINT METHOD, TYPE=PENALTY, STIFFNESS={stiffness}\n*CLOAD")
    (tmp_path/"deck.inp").write_text(text)
    run = run_deck(tmp_path/"deck.inp", tmp_path)
    shortening, give = 2*(1 - NU**2)*FORCE/E, FORCE/stiffness
    top = displacement(run, 1)[-1, :, 1]
    # The contact surface widens by about FORCE/E.
    assert np.allclose(top, -gap - shortening - give, rtol=0, atol=2*FORCE/E*give + ACCURACY*shortening)
    gaps = run.fields()["contact_gap"][-1]
    assert np.allclose(gaps[~np.isnan(gaps)], -give, rtol=4*FORCE/E, atol=0)


def test_a_penalty_tends_to_the_exact_contact(tmp_path):
    """What is left falls as 1 over the stiffness; an augmented Lagrangian leaves TOLERANCE."""
    found = {}
    for name in ("NULL SPACE", "PENALTY, FACTOR=1", "PENALTY, FACTOR=100", AUGMENTED,
                 f"{AUGMENTED}, FACTOR=0.1"):
        text = tower([0.05], held="{name}_ONE, 1", turn=0.05, nlgeom=True, load=-30.0)
        text = text.replace("*CLOAD", f"*CONSTRAINT METHOD, TYPE={name}\n*CLOAD")
        folder = tmp_path/str(len(found))
        folder.mkdir()
        (folder/"deck.inp").write_text(text)
        found[name] = run_deck(folder/"deck.inp", folder).fields()["displacement"][-1]
    hard = found.pop("NULL SPACE")
    rough, fine, *held = (np.abs(u - hard).max() for u in found.values())
    assert rough/fine == pytest.approx(100, rel=0.1)
    assert max(held) < 1e-7


def test_edges_that_are_covered_in_part_close_alike(tmp_path):
    """A punch covers the edges at its sides in part: the stiffness is that of a force by a mean
    gap, which is the same over a part of an edge. The forces are those of exact contact."""
    found = {}
    for method in ("NULL SPACE", AUGMENTED):
        scene = Scene(0.5, 1.0)
        scene.block("BLOCK", (-1.0, -1.0), (2.0, 1.0), (8, 4)).hold("BLOCK", below(-1.0))
        scene.block("PUNCH", (-0.18, 0.0), (0.5, 0.4), (2, 2))
        scene.hold("PUNCH", lambda _, y: y > 0.39, "1, 1")
        scene.hold("PUNCH", lambda _, y: y > 0.39, "2, 2", -0.05)
        scene.pairs = [("BLOCK", "PUNCH")]
        deck = scene.deck(UNGUARDED)
        deck.replace("*DYNAMIC, DIRECT", "*STATIC")
        run = run_deck(deck, tmp_path/method, method=method, formulation="MORTAR")
        found[method] = run.fields()["contact_force"][-1]
        if method == AUGMENTED:
            assert run.verdict["augmentations"] < 15
    largest = np.abs(found["NULL SPACE"]).max()
    assert np.allclose(found[AUGMENTED], found["NULL SPACE"], rtol=0, atol=1e-6*largest)


# ---- bits ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(("method", "formulation", "is_explicit"), [
    (PENALTY, "NODE TO SURFACE", False), (PENALTY, "MORTAR", False),
    (AUGMENTED, "NODE TO SURFACE", False), (PENALTY, "NODE TO SURFACE", True)])
def test_restart_in_contact_gives_the_same_bits(tmp_path, method, formulation, is_explicit):
    deck = explicit(discs(BOTH)) if is_explicit else discs(ONE)
    deck.replace("*NODE FILE", "*RESTART, WRITE, FREQUENCY=8\n*NODE FILE")
    k = deck.find("*STEP")
    second = [(head, list(data)) for head, data in deck.card[k:]]
    deck.card[k + 1] = (deck.card[k + 1][0], ["<h>, 0.32"])
    second[second.index(("*RESTART, WRITE, FREQUENCY=8", []))] = (
        "*RESTART, WRITE, FREQUENCY=0", [])
    deck.card += second
    run = run_deck(deck, tmp_path/"whole", method=method, formulation=formulation,
                   **({"h": 0.001, "t_end": 0.1} if is_explicit else {}))
    history = run.history
    n = int(np.searchsorted(history["time"], 0.32 - 1e-9))
    assert history["active"][n] > 0
    (tmp_path/"copy").mkdir()
    copy = restart(run, tmp_path/"copy")
    assert f"resumed after increment {n}" in copy.log
    assert copy.digits() == run.digits()
    assert data_sets(copy.file(".h5")) == data_sets(run.file(".h5"))


def test_the_stiffness_is_told_and_follows_the_material(tmp_path):
    """By default it is that of the elements at the slave nodes, over their area: E by edge."""
    told = []
    for stiffness in (100.0, 400.0):
        deck = discs(ONE)
        deck.map_numbers("*HYPERELASTIC", lambda words, e=stiffness: [str(e), words[1]])
        run = run_deck(deck, tmp_path/str(stiffness), method=PENALTY)
        told.append(float(run.log.split("is soft, with a stiffness of ")[1].split(",")[0]))
    assert told[1] == pytest.approx(4*told[0], rel=1e-8)
    edge = math.pi/32
    assert 100/edge < told[0] < 20*100/edge
