"""Contact surfaces without mass: smooth forces, closed balances, bodies that stay in contact."""

import math
import sys

import numpy as np
import pytest
import scipy.linalg
from overlap import worst
from plain_scenes import AUTO, SCENES, Outcome, Scene, corners, crossing
from scene_tools import DECKS, ROOT, Deck, coarse_ring, run_deck

from emcon import Stepper

sys.path.insert(0, str(ROOT / "tests" / "bench"))
from book import forces  # noqa: E402
from trade_discs import roughness  # noqa: E402

MASSLESS = {"initiation": "MASSLESS"}
BACK = "contact nodes get their mass back"
NTS = {"formulation": "NODE TO SURFACE", "sides": "AUTO"}
MORTAR = {"formulation": "MORTAR", "sides": "ONE"}
EPS = np.finfo(float).eps
#: Coordinates of plain scenes are below 4, edges above 0.1: rounding of what is seen, by the edge.
ROUNDING = 64*EPS*4/0.1


def balances(history):
    """The largest change of the total energy, by the largest energy that there is."""
    total = history["total"]
    return np.abs(total - total[0]).max()/(history["kinetic"] + history["strain"]).max()


def switches(history):
    """How often contact as a whole begins or ends."""
    return int(np.abs(np.diff((history["active"] > 0).astype(int))).sum())


# ---- a bar on a floor, whose force is known -----------------------------------------------------


def bar(folder, initiation, choice, h):
    """History and contact force of the elastic bar, past its first contact from 1 to 1 + 2/3."""
    run = run_deck(DECKS/"bouncing_bar.inp", folder, h=h, t_end=1.9, frame=1,
                   initiation=initiation, **choice)
    time, force = run.series("CONTACT", "TOTAL_CF")
    return run.history, time, np.abs(force[:, 0, 1])


@pytest.mark.parametrize("choice", [NTS, MORTAR], ids=["nts", "mortar"])
def test_force_of_a_bar_is_that_of_the_wave(choice, tmp_path):
    """Courant number 0.38: 300 + 300 t in the closed form; held by nodes with mass it is a comb."""
    history, time, force = bar(tmp_path/"massless", "MASSLESS", choice, 0.0025)
    rests = (time > 1.15) & (time < 1.517)
    expected = 300 + 300*(time[rests] - 1)
    scatter = (force[rests] - expected).std()
    assert scatter < 0.01*400
    assert force[rests].max() < 1.2*400
    assert switches(history) == 2
    assert balances(history) < 1e-12
    assert history["stand_off"].max() < 1e-12
    assert history["penetration"].max() < 1e-12
    _, _, force = bar(tmp_path/"massive", "PERSISTENT", choice, 0.0025)
    assert (force[rests] - expected).std() > 20*scatter


# ---- discs on a rigid floor ---------------------------------------------------------------------


def disc_on_floor(angle, shift, h, edges=24):
    """A disc is thrown at `angle` [degrees] on a rigid floor, whose mesh is shifted by that part of
    an edge: wherever its nodes are beside those of the disc."""
    scene = Scene(h, 0.9)
    way = math.radians(angle)
    scene.disc("DISC", (0.0, 0.51), 0.5, (edges//4, edges//8),
               velocity=(1.5*math.cos(way), -1.5*math.sin(way)))
    width = 4.0/(edges//2)
    scene.block("FLOOR", (-1.0 + shift*width, -0.3), (4.0, 0.3), (edges//2, 1))
    return scene.hold("FLOOR", lambda x, y: True)


@pytest.mark.each_value
@pytest.mark.parametrize("order", ["DISC", "FLOOR"])
@pytest.mark.parametrize("shift", [0.0, 0.02, 0.08, 0.16, 0.24])
@pytest.mark.parametrize("angle", [30, 60, 90])
def test_a_disc_on_a_shifted_floor(angle, shift, order, tmp_path):
    """The floor, which keeps its mass, does not hold: no node takes mass back, nothing goes in, and
    halving h more than halves what the force jumps by from increment to increment."""
    rough = []
    for h in (0.01, 0.005):
        scene = disc_on_floor(angle, shift, h)
        scene.pairs = [(order, "FLOOR" if order == "DISC" else "DISC")]
        run = run_deck(scene.deck(AUTO), tmp_path/str(h), **MASSLESS, formulation="NODE TO SURFACE")
        history = run.history
        assert run.verdict["verdict"] == "good" and BACK not in run.log
        assert "FLOOR keeps its mass, which DISC does not: its nodes are guarded" in run.log
        assert history["cuts"].sum() == 0 and balances(history) < 1e-12
        assert history["penetration"].max() == 0.0 and history["stand_off"].max() < ROUNDING
        rough.append(roughness(run))
    assert rough[1] < 0.5*rough[0]


@pytest.mark.parametrize(("cells", "aside"), [((3, 2), 0.0), ((3, 2), 0.13), ((6, 4), 0.0), ((6, 4), 0.13)])
def test_denser_nodes_that_keep_their_mass_are_held(cells, aside, tmp_path):
    """A block falls on a fixed ball, whose nodes stand between those of the block: guards would let
    them in."""
    scene = Scene(0.01, 0.5)
    scene.block("BLOCK", (-0.75 + aside, 0.52), (1.5, 0.8), cells, velocity=(0.0, -1.0))
    scene.disc("BALL", (0.0, 0.0), 0.5, (12, 4)).hold("BALL", lambda x, y: True)
    run = run_deck(scene.deck(AUTO), tmp_path, **MASSLESS, formulation="NODE TO SURFACE")
    assert run.verdict["verdict"] == "good" and "guarded, not held" not in run.log
    assert balances(run.history) < 1e-12 and run.history["penetration"].max() < ROUNDING


def test_guarded_nodes_may_go_in_as_far_as_guards_allow(tmp_path):
    """The ball's nodes stand as dense as the block's: they go in by less than a twentieth of an edge,
    and the verdict tells that guards held them."""
    scene = Scene(0.01, 0.5)
    scene.block("BLOCK", (-0.75, 0.52), (1.5, 0.8), (6, 4), velocity=(0.0, -1.0))
    scene.disc("BALL", (0.0, 0.0), 0.5, (3, 2)).hold("BALL", lambda x, y: True)
    run = run_deck(scene.deck(AUTO), tmp_path, **MASSLESS, formulation="NODE TO SURFACE")
    assert "guarded, not held" in run.log
    assert 1e-3 < worst(run.fields()).by_edge < 0.055
    assert run.verdict["verdict"] == "good" and run.verdict["guarded_increments"] > 0
    assert any("which guards allow" in text for text in run.verdict["warnings"])
    assert balances(run.history) < 1e-12


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
def test_half_a_block_is_half_of_the_whole(formulation, tmp_path):
    """A block falls flat on a rigid floor; of the half on a line of symmetry the node on the line
    has no mass either: the same motion."""
    runs = []
    for n, width in ((4, 1.0), (2, 0.5)):
        scene = Scene(0.01, 0.5)
        scene.block("BLOCK", (0.0, 0.02), (width, 1.0), (n, 4), velocity=(0.0, -1.0))
        scene.block("FLOOR", (-1.0, -0.2), (3.0, 0.2), (3, 1)).hold("FLOOR", lambda x, y: True)
        scene.side("FOOT", "BLOCK", lambda x, y: y < 0.03)
        scene.pairs = [("FOOT", "FLOOR")]
        if n == 2:
            scene.hold("BLOCK", lambda x, y: abs(x - 0.5) < 1e-9, "1, 1")
        run = run_deck(scene.deck(AUTO), tmp_path/str(n), **MASSLESS, formulation=formulation,
                       normal="EDGE")
        assert run.verdict["verdict"] == "good" and BACK not in run.log
        runs.append(run.fields())
    whole, half = runs
    place = {tuple(np.round(x, 9)): i for i, x in enumerate(whole.x)}
    same = [(place[tuple(np.round(x, 9))], i) for i, x in enumerate(half.x)
            if 0 <= x[0] <= 0.5 and x[1] > 0]
    assert len(same) == 15
    a, b = np.array(same).T
    off = np.abs(whole["displacement"][:, a] - half["displacement"][:, b]).max()
    # Newton's tolerance leaves round-off of some hundred increments.
    assert off < 1e-11 and np.abs(half["displacement"]).max() > 0.02


def test_a_bar_that_is_held_sideways(tmp_path):
    """Its end loses its mass all the same: at a Courant number of 0.05 the force is that of the
    closed form to 5 %, and contact begins and ends once."""
    deck = Deck.read(DECKS/"bouncing_bar.inp")
    card = next(k for k, (head, _) in enumerate(deck.card) if head.startswith("*STEP"))
    deck.card.insert(card, ("*BOUNDARY", ["BAR, 1, 1"]))
    run = run_deck(deck, tmp_path, h=0.00033, t_end=1.9, frame=1, **MASSLESS, **NTS)
    time, force = run.series("CONTACT", "TOTAL_CF")
    force = np.abs(force[:, 0, 1])
    rests = (time > 1.15) & (time < 1.517)
    assert (force[rests] - 300 - 300*(time[rests] - 1)).std() < 0.05*400
    assert switches(run.history) == 2 and balances(run.history) < 1e-12


@pytest.mark.parametrize("formulation", ["SEGMENT", "MORTAR"])
def test_the_side_that_can_lose_its_mass_is_the_slave(formulation, tmp_path):
    """Of means of gaps one side is the slave: that of them, however the deck names the two."""
    scene = disc_on_floor(60, 0.1, 0.01)
    scene.pairs = [("FLOOR", "DISC")]
    run = run_deck(scene.deck(AUTO), tmp_path, **MASSLESS, formulation=formulation)
    assert "contact DISC on FLOOR" in run.log and run.verdict["verdict"] == "good"
    assert BACK not in run.log and roughness(run) < 0.5


# ---- free bodies, and bodies that lie on others -------------------------------------------------


@pytest.mark.parametrize("h", [0.02, 0.01, 0.005])
def test_twins_whose_nodes_meet(h, tmp_path):
    """All nodes of two squares on each other: rows of both sides are nearly the same, and what the
    contacts took as they closed is given back along those that stand alone."""
    run = run_deck(SCENES["twin"]().deck(AUTO), tmp_path, h=h, **MASSLESS,
                   formulation="NODE TO SURFACE")
    assert run.verdict["verdict"] == "good" and balances(run.history) < 1e-11
    assert run.history["penetration"].max() < 1e-8



@pytest.mark.parametrize("name", ["two_bodies", "three_bodies", "self_contact"])
def test_balances_of_free_bodies(name, tmp_path):
    history = run_deck(DECKS/f"{name}.inp", tmp_path, h=0.01, frame=1, **MASSLESS, **NTS).history
    assert (history["active"] > 0).any()
    assert balances(history) < 1e-12
    scale = math.sqrt(2*history["kinetic"].max())
    for column in ("px", "py", "lz"):
        assert np.abs(history[column] - history[column][0]).max() < 1e-12*scale, column
    assert history["penetration"].max() < 1e-12
    assert history["stand_off"].max() < 1e-12


@pytest.mark.parametrize("name", ["bowl", "wedge"])
def test_what_lies_on_a_body_does_not_hop(name, tmp_path):
    run = run_deck(SCENES[name]().deck(AUTO), tmp_path, **MASSLESS,
                   formulation="NODE TO SURFACE")
    history = run.history
    first = np.argmax(history["active"] > 0)
    assert (history["active"][first:] > 0).all()
    assert switches(history) == 1
    assert balances(history) < 1e-12
    assert history["penetration"].max() < 1e-12


def test_an_elastic_disc_slides_in_a_ring(tmp_path):
    """A part of the fifty periods of the book: it presses on the ring all the way, and swings as a
    pendulum, but for its indentation."""
    deck = forces.elastic_in_ring(2000.0, 0.01, n_period=1.6)
    history = run_deck(deck, tmp_path, initiation="MASSLESS", formulation="NODE TO SURFACE",
                       smoothing="HERMITE").history
    history = history[history["time"] > 1]
    force = np.hypot(history["pair1_force_x"], history["pair1_force_y"])
    assert force.min() > 0.3*math.pi*forces.RADIUS**2*forces.GRAVITY
    total = history["total"]
    assert np.abs(total - total[0]).max() < 1e-12*history["kinetic"].max()
    period = forces.period(history["time"], history["px"])
    assert period == pytest.approx(forces.exact_period(), rel=3e-3)


def test_a_ring_in_mortar_contact(tmp_path):
    history = run_deck(coarse_ring(), tmp_path, h=0.02, t_end=2, frame=1, **MASSLESS,
                       **MORTAR).history
    assert (history["active"] > 0).any()
    assert balances(history) < 1e-12
    assert history["stand_off"].max() < 1e-12


# ---- where the mass goes ------------------------------------------------------------------------


def strip(layers, initiation="MASSLESS"):
    """A strip of length 10, height 1; the nodes on top are slaves of a small block above it."""
    scene = Scene(0.01, 0.01)
    scene.block("STRIP", (0, 0), (10, 1), (10*layers, layers))
    scene.block("BLOCK", (4, 1.5), (1, 1), (1, 1)).hold("BLOCK", lambda x, y: True)
    scene.side("TOP", "STRIP", lambda x, y: y > 1 - 1e-9)
    scene.side("BELOW", "BLOCK", lambda x, y: y < 1.5 + 1e-9)
    scene.pairs = [("TOP", "BELOW")]
    deck = scene.deck("ONE").text()
    return deck.replace("<initiation>", initiation).replace("<formulation>", "NODE TO SURFACE")


def opened(text, folder):
    path = folder/"strip.inp"
    path.write_text(text)
    return Stepper(path)


@pytest.mark.parametrize("layers", [2, 4])
def test_total_mass_stays_and_slave_nodes_have_none(layers, tmp_path):
    with opened(strip(layers), tmp_path) as stepper:
        mass, y = stepper.mass.toarray(), stepper.positions[:, 1]
        x = stepper.positions[:, 0]
    top = (np.abs(y - 1) < 1e-9) & (x < 10 + 1e-9)
    n = (10*layers + 1)*(layers + 1)
    assert top[:n].sum() == 10*layers + 1
    assert not mass[:n][top[:n]].any()
    assert abs(mass[:n, :n].sum() - 10) <= 100*EPS*10
    assert np.linalg.eigvalsh(mass[:n, :n][np.ix_(~top[:n], ~top[:n])]).min() > 0


def frequencies(text, folder, n_dof, count=6):
    """The first free frequencies of the first `n_dof` freedoms, squared; massless ones condensed."""
    with opened(text, folder) as stepper:
        mass = stepper.mass.toarray()
        h = 1e6                                                  # (16): 2/h^2 M + K/2
        tangent = stepper.tangent(np.zeros_like(stepper.positions), h).toarray()[:n_dof, :n_dof]
    m = np.kron(mass, np.eye(2))[:n_dof, :n_dof]
    stiffness = 2*(tangent - 2/h**2*m)
    has = np.diag(m) > 0
    k = stiffness[np.ix_(has, has)] - stiffness[np.ix_(has, ~has)] @ np.linalg.solve(
        stiffness[np.ix_(~has, ~has)], stiffness[np.ix_(~has, has)]) if (~has).any() else stiffness
    return scipy.linalg.eigh(k, m[np.ix_(has, has)], eigvals_only=True)[3:3 + count]


def test_frequencies_change_by_the_square_of_the_element_size(tmp_path):
    errors = []
    for layers in (2, 4):
        n_dof = 2*(10*layers + 1)*(layers + 1)
        massive, massless = (frequencies(strip(layers, kind), tmp_path, n_dof)
                             for kind in ("PERSISTENT", "MASSLESS"))
        errors.append(np.abs(np.sqrt(massless/massive) - 1).max())
    assert errors[1] < 0.02
    assert math.log2(errors[0]/errors[1]) > 1.0, errors


def test_elements_without_other_nodes_keep_their_mass(tmp_path):
    """A strip one element thick whose whole outline is slave: nothing would be left."""
    scene = Scene(0.01, 0.05)
    scene.block("STRIP", (0, 1.01), (4, 0.2), (20, 1), velocity=(0, -1))
    scene.block("FLOOR", (-1, 0), (6, 1), (6, 2)).hold("FLOOR", lambda x, y: y < 1e-9)
    scene.pairs = [("STRIP", "FLOOR")]
    runs = [run_deck(scene.deck("ONE"), tmp_path/kind, initiation=kind,
                     formulation="NODE TO SURFACE") for kind in ("MASSLESS", "PERSISTENT")]
    assert "without mass: 0 nodes; 42 slave nodes keep theirs" in runs[0].log
    assert "warning: the surface STRIP of a contact pair keeps its mass" in runs[0].errors
    assert (runs[0].history["kinetic"] == runs[1].history["kinetic"]).all()


def test_nodes_around_one_other_keep_their_mass(tmp_path):
    """A block of four elements would be its middle node, without inertia against turning."""
    spin, size = 2.0, 0.4
    scene = Scene(0.005, 0.2)
    scene.block("SMALL", (0.0, 0.62), (size, size), (2, 2), math.pi/4, stiffness=400.0,
                velocity=(0, -1), spin=spin)
    scene.block("LARGE", (-0.5, 0.0), (1.0, 0.5), (4, 4))
    done = Outcome(scene, tmp_path, "ALL", formulation="NODE TO SURFACE", initiation="MASSLESS")
    assert done.code == 0
    assert done.run.history["active"].max() >= 1
    momentum = done.run.series("BODIES", "MOMENTUM")[1]
    # About its own middle; bilinear elements have the moment of inertia of the square.
    own = momentum[0, 0, 2] - (size/2*momentum[0, 0, 1] - (0.62 + size/2)*momentum[0, 0, 0])
    assert own == pytest.approx(spin*size**4/6, rel=1e-12)
    change = np.abs(momentum.sum(1) - momentum[0].sum(0)).max()
    assert change <= 1e3*EPS*np.abs(momentum).max()


# ---- friction without mass -----------------------------------------------------------------------


def rubbing_blocks(h, deck_sides):
    """A spinning block is thrown on a free one, at an angle, with friction of 0.3."""
    scene = Scene(h, 0.8)
    scene.block("LOW", (0.0, 0.0), (1.0, 0.5), (8, 4), velocity=(0.5, 0.0), stiffness=1e3)
    scene.block("HIGH", (0.13, 0.51), (0.7, 0.5), (7, 4), velocity=(-1.0, -1.0), spin=0.5, stiffness=1e3)
    deck = scene.deck(deck_sides)
    deck.replace("*SURFACE INTERACTION, NAME=SMOOTH", "*SURFACE INTERACTION, NAME=SMOOTH\n*FRICTION\n0.3")
    return deck


def jumps(run):
    """Rms of second differences of the force along the surfaces, over the mean force."""
    _, momentum = run.series("BODIES", "MOMENTUM")
    force = np.diff(momentum[:, 1, 0])/np.diff(run.history["time"])
    return np.sqrt(np.mean(np.diff(force, 2)**2))/np.abs(force[np.abs(force) > 1e-9]).mean()


@pytest.mark.parametrize("choice", [
    NTS, pytest.param(MORTAR, marks=pytest.mark.long),
    pytest.param(MORTAR | {"formulation": "SEGMENT"}, marks=pytest.mark.long)], ids=["nodes", "mortar", "segments"])
def test_friction_on_nodes_without_mass(choice, tmp_path):
    """Energy and what friction takes, momenta and the law, as with mass; forces less than half as
    rough, and smoother with h, where those of nodes with mass are not."""
    choice = dict(choice)
    sides = choice.pop("sides")
    rough = []
    for h in (0.005, 0.0025):
        run = run_deck(rubbing_blocks(h, sides), tmp_path/str(h), **MASSLESS, **choice)
        history = run.history
        total = history["total"] + history["friction_loss"]
        assert np.abs(total - total[0]).max() < 1e-12*history["kinetic"].max()
        assert np.diff(history["friction_loss"]).min() >= -16*EPS*history["kinetic"].max()
        assert history["friction_loss"][-1] > 0.01*history["kinetic"][0]
        momentum = run.series("BODIES", "MOMENTUM")[1].sum(1)
        assert np.abs(momentum - momentum[0]).max() < 1e-12
        assert run.verdict["law_violation"] < 1e-10 and run.verdict["verdict"] == "good"
        assert BACK not in run.log and history["cuts"].sum() == 0
        rough.append(jumps(run))
    assert rough[1] < 0.7*rough[0]
    run = run_deck(rubbing_blocks(0.0025, sides), tmp_path/"massive", **choice)
    assert jumps(run) > 2*rough[1]


# ---- nodes that find no balance without their mass ----------------------------------------------


#: Squares of nine elements: of four the nodes around the middle one keep their mass.
FINER = {"corners": lambda: corners(cells=(3, 3)), "crossing": lambda: crossing(n=3),
         "crossing late": lambda: crossing(0.01, n=3)}


@pytest.mark.parametrize(("name", "choice"), [
    ("crossing", {"formulation": "MORTAR", "sides": "UNGUARDED"}),      # a guard would hold them
    pytest.param("pile", NTS, marks=pytest.mark.long), pytest.param("pile", NTS | {"h": 0.01}, marks=pytest.mark.long),
    pytest.param("pile", NTS | {"h": 0.0025}, marks=pytest.mark.long)],
    ids=["crossing", "pile", "pile h/2", "pile h/8"])
def test_soft_bodies_on_corners(name, choice, tmp_path):
    """A massless node slips off a corner at once; with its mass back it takes its time.

    Forces that z does not follow exactly give no energy back: in the pile they took 2e-8 of it. Gaps
    of other edges than before took 1e-5 of it at h/8, and a node that was in by 1e-6 of an edge as
    its contact opened was never held again.
    """
    scene = (SCENES | FINER)[name]()
    choice = dict(choice)
    run = run_deck(scene.deck(choice.pop("sides")), tmp_path, **MASSLESS, **choice)
    assert BACK in run.log
    assert run.history["time"][-1] == pytest.approx(scene.t_end)
    assert balances(run.history) < 1e-12
    assert run.verdict["verdict"] == "good" or name == "crossing"


@pytest.mark.each_value
@pytest.mark.parametrize("part", [1.0, 0.5])
@pytest.mark.parametrize("name", ["press", "wedge", "ledge"])
def test_bodies_that_move_over_corners_without_mass(name, part, tmp_path):
    """No node needs its mass, no increment is cut.

    In the press the free side of a plate that is driven and touches nothing moves without a force:
    that is solved as well as round-off has it. In the others nodes with mass keep a distance to
    nodes without, also as these are balanced.
    """
    scene = SCENES[name]()
    run = run_deck(scene.deck(AUTO), tmp_path, h=part*scene.h, **MASSLESS,
                   formulation="NODE TO SURFACE")
    assert BACK not in run.log
    assert run.history["cuts"].sum() == 0
    assert run.history["active"].max() > 0
    assert balances(run.history) < 1e-12


@pytest.mark.parametrize("h", [0.02, 0.01, 0.006])
def test_a_corner_slides_off_another_without_mass(h, tmp_path):
    run = run_deck(SCENES["slide off"]().deck("ONE"), tmp_path, h=h, **MASSLESS, formulation="MORTAR")
    assert BACK not in run.log
    assert run.history["active"].max() > 0
    assert balances(run.history) < 1e-12


@pytest.mark.parametrize(("name", "formulation", "sides"), [
    ("tower", "NODE TO SURFACE", "BOTH"), ("corners", "NODE TO SURFACE", "BOTH"),
    ("crossing late", "NODE TO SURFACE", "BOTH")])
def test_bodies_that_meet_by_corners_need_no_mass_there(name, formulation, sides, tmp_path):
    """Not where they meet corner on corner at 45 degrees, which rounding decides."""
    scene = (SCENES | FINER)[name]()
    run = run_deck(scene.deck(sides), tmp_path, **MASSLESS, formulation=formulation)
    assert run.history["active"].max() >= 1
    assert BACK not in run.log
    assert balances(run.history) < 1e-12


@pytest.mark.parametrize("h", [0.02, 0.01, 0.005])
def test_corners_that_pass_each_other_stay_outside(h, tmp_path):
    """Two that meet without mass follow from each other: neither may be left out as it closes."""
    scene = SCENES["slide off"]()
    run = run_deck(scene.deck(AUTO), tmp_path, h=h, **MASSLESS, formulation="NODE TO SURFACE")
    assert BACK not in run.log
    assert worst(run.fields(), scene.alone).by_edge <= ROUNDING
    assert balances(run.history) < 1e-12


def test_mass_comes_back_without_a_jump_of_the_momenta(tmp_path):
    """Two free bodies whose corners cross; bits hold through a restart behind the return."""
    deck = FINER["crossing"]().deck("UNGUARDED").text().replace("<initiation>", "MASSLESS").replace(
        "<formulation>", "MORTAR")
    (tmp_path/"deck.inp").write_text(deck)
    with Stepper(tmp_path/"deck.inp") as whole:
        first, mass = whole.ledger, whole.mass.toarray()
        while (whole.mass.toarray() == mass).all():
            before = whole.ledger
            whole.step()
        again = whole.mass.toarray()
        assert abs(again.sum() - mass.sum()) <= 100*EPS*mass.sum()
        x = whole.positions
        assert np.abs((again - mass) @ np.ones(len(x))).max() <= 100*EPS*mass.max()
        assert np.linalg.eigvalsh(again - mass).min() >= -100*EPS*mass.max()
        whole.write_restart(tmp_path/"half.rst.h5")
        with Stepper.from_restart(tmp_path/"half.rst.h5") as rest:
            assert (rest.mass.toarray() == again).all()
            for _ in range(5):
                whole.step()
                rest.step()
            assert (rest.u == whole.u).all() and (rest.v == whole.v).all()
        scale = math.sqrt(2*first["kinetic"]*mass.sum())
        assert abs(whole.ledger["total"] - before["total"]) < 1e-12*first["kinetic"]
        for name in ("px", "py", "lz"):
            assert abs(whole.ledger[name] - first[name]) < 1e-12*scale, name


# ---- decks --------------------------------------------------------------------------------------


def test_surfaces_are_massless_in_all_dynamic_steps_or_in_none(tmp_path):
    deck = Deck.read(DECKS/"two_bodies.inp").text()
    end = deck.rindex("*END STEP")
    more = ("*END STEP\n*STEP, NLGEOM\n*DYNAMIC, DIRECT\n<h>, <t_end>\n"
            "*CONTACT INITIATION, TYPE=ADMISSIBLE\n*END STEP\n")
    (tmp_path/"two.inp").write_text(deck[:end] + more)
    with pytest.raises(AssertionError, match="step 1 has .*MASSLESS, step 2 another one"):
        run_deck(tmp_path/"two.inp", tmp_path, **MASSLESS)


def test_restart_goes_on_with_the_same_bits(tmp_path):
    path = DECKS/"two_bodies.inp"
    text = Deck.read(path).text().replace("TYPE=<initiation>", "TYPE=MASSLESS").replace(
        "sides = AUTO", "sides = BOTH").replace("formulation = MORTAR",
                                                "formulation = NODE TO SURFACE")
    (tmp_path/"deck.inp").write_text(text)
    with Stepper(tmp_path/"deck.inp") as whole:
        for _ in range(30):
            whole.step()
        assert whole.active.any()
        whole.write_restart(tmp_path/"half.rst.h5")
        for _ in range(30):
            whole.step()
        with Stepper.from_restart(tmp_path/"half.rst.h5") as rest:
            for _ in range(30):
                rest.step()
            assert (rest.u == whole.u).all() and (rest.v == whole.v).all()
            assert rest.ledger == whole.ledger


def test_what_statics_has_laid_down_stays_at_rest(tmp_path):
    """A block under its weight on a floor, then the same as a dynamic step: nothing moves."""
    scene = Scene(0.01, 0.2, gravity=1.0)
    scene.block("BLOCK", (0, 0.02), (1, 1), (4, 4))
    scene.block("FLOOR", (-0.5, -1), (2, 1), (6, 3)).hold("FLOOR", lambda x, y: y < -1 + 1e-9)
    scene.hold("BLOCK", lambda x, y: abs(x - 0.5) < 1e-9 and y > 0.9, axes="1, 1")
    text = scene.deck("BOTH").text()
    first = text.index("*STEP")
    static = text[first:].replace("*DYNAMIC, DIRECT\n<h>, <t_end>", "*STATIC\n1., 1.")
    (tmp_path/"rest.inp").write_text(text[:first] + static + text[first:])
    history = run_deck(tmp_path/"rest.inp", tmp_path, initiation="MASSLESS",
                       formulation="NODE TO SURFACE").history
    moves = history["time"] > 1
    assert moves.sum() == 20 and (history["active"][moves] >= 5).all()
    assert history["kinetic"][moves].max() < 1e-20*history["strain"].max()


def test_a_tied_ring(tmp_path):
    history = run_deck(DECKS/"tied_ring.inp", tmp_path, h=0.02, t_end=1.5, frame=1, **MASSLESS,
                       **NTS).history
    assert (history["active"] > 0).any()
    assert balances(history) < 1e-12
    assert history["stand_off"].max() < 1e-12


# ---- pairs that ask for themselves --------------------------------------------------------------


def asking(name, pair, path, which=1):
    """A deck whose cards *CONTACT PAIR, up to `which`, say INITIATION=."""
    text = Deck.read(DECKS/f"{name}.inp").text()
    path.write_text(text.replace("*CONTACT PAIR, ", f"*CONTACT PAIR, INITIATION={pair}, ", which))
    return path


@pytest.mark.parametrize(("pair", "step", "same"), [
    ("MASSLESS", "PERSISTENT", "MASSLESS"), ("PERSISTENT", "MASSLESS", "PERSISTENT")])
def test_a_pair_asks_as_its_step_would(pair, step, same, tmp_path):
    choice = {"h": 0.02, "t_end": 1, "frame": 1, **NTS}
    asked = run_deck(asking("two_bodies", pair, tmp_path/"asked.inp"), tmp_path,
                     initiation=step, **choice)
    whole = run_deck(DECKS/"two_bodies.inp", tmp_path, initiation=same, **choice)
    assert (whole.history["active"] > 0).any()
    assert asked.digits() == whole.digits()


def test_pairs_with_and_without_mass(tmp_path):
    """The middle one of three bodies has massless nodes towards the left, the right one none."""
    path = asking("three_bodies", "MASSLESS", tmp_path/"mixed.inp")
    card = "*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=<formulation>, SIDES=<sides>\n"
    text = path.read_text().replace("RIGHT_RIM, MIDDLE_RIM", f"{card}RIGHT_RIM, MIDDLE_RIM")
    path.write_text(text)
    run = run_deck(path, tmp_path, h=0.02, t_end=1.5, frame=1, **{**NTS, "sides": "ONE"})
    with Stepper(path, sides="ONE", formulation="NODE TO SURFACE") as stepper:
        has_none = stepper.mass.toarray().diagonal() == 0
    assert has_none.sum() == len(range(134, 204, 3))         # edges of the middle rim
    assert run.history["pair1_duration"].max() > 0
    assert run.history["pair2_duration"].max() > 0
    assert balances(run.history) < 1e-12


@pytest.mark.parametrize(("pair", "step", "message"), [
    ("ADMISSIBLE", "PERSISTENT", "INITIATION=.ADMISSIBLE.*PERSISTENT, MASSLESS"),
    ("MASSLESS", "ADMISSIBLE", "it goes with .*PERSISTENT or MASSLESS, not with that of step 1")])
def test_what_a_pair_cannot_ask_for(pair, step, message, tmp_path):
    with pytest.raises(AssertionError, match=message):
        run_deck(asking("two_bodies", pair, tmp_path/"asked.inp"), tmp_path, initiation=step)
