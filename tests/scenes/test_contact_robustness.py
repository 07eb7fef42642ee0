"""Small scenes of contact that go wrong easily, in every formulation: coincident nodes, corners,
ends of surfaces, bodies that move by several elements in a step, surfaces all around."""

import dataclasses
import math

import numpy as np
import plain_scenes
import pytest
from plain_scenes import AUTO, BOTH, SCENES, Outcome, below
from scene_tools import EPSILON, Deck, number, run_one_sided

MORTAR = {"formulation": "MORTAR"}
CHOICES = {
    "node": {"formulation": "NODE TO SURFACE"},
    "node, smooth": {"formulation": "NODE TO SURFACE", "smoothing": "HERMITE"},
    "segment": {"formulation": "SEGMENT", "multiplier": "STANDARD"},
    "segment, dual": {"formulation": "SEGMENT", "multiplier": "DUAL"},
    "edge": {**MORTAR, "normal": "EDGE", "multiplier": "STANDARD"},
    "edge, dual": {**MORTAR, "normal": "EDGE", "multiplier": "DUAL"},
    "nodal": {**MORTAR, "normal": "NODAL", "multiplier": "STANDARD"},
    "nodal, dual": {**MORTAR, "normal": "NODAL", "multiplier": "DUAL"},
    "points": {**MORTAR, "integration": "ELEMENTS", "points": 3},
    "smooth": {**MORTAR, "smoothing": "HERMITE", "normal": "EDGE"},
}
INITIATIONS = ["PERSISTENT", "ADMISSIBLE", "VELOCITY UPDATE"]
every_choice = pytest.mark.parametrize("choice", CHOICES)

PARAMETERS = """
initiation = PERSISTENT
tolerance = 1e-12
multiplier = DUAL
normal = NODAL
integration = SEGMENTS
points = 3
smoothing = NONE
"""
REQUESTS = """
*CONTACT INITIATION, TYPE=<initiation>
*NEWTON, TOLERANCE=<tolerance>
*MORTAR, INTEGRATION=<integration>, POINTS=<points>, MULTIPLIER=<multiplier>, NORMAL=<normal>
*SURFACE SMOOTHING, TYPE=<smoothing>
*NODE FILE
U, RF
*EL FILE
S
*CONTACT FILE
CDIS, CSTR, CF
*END STEP
"""


# ---- scenes of blocks ---------------------------------------------------------------------------


@dataclasses.dataclass
class Block:
    """A grid of n x m elements; its sides are B, R, T and L, all of them A."""

    node: np.ndarray               # (n + 1, m + 1) labels
    element: list                  # (node, node, node, node)
    side: dict                     # elements' numbers in `element` (from 0) and faces


class Scene:
    """Blocks, pairs of their sides, and the text of a deck."""

    def __init__(self):
        self.x, self.cards, self.block, self.pair = [], [], {}, []

    def add(self, name, corner, size, cells, turn=0.0, velocity=(0, 0), stiffness=100.0):
        n, m = cells
        first = len(self.x) + 1
        node = first + np.arange((n + 1)*(m + 1)).reshape(n + 1, m + 1)
        middle = np.array(corner) + 0.5*np.array(size)
        rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
        for i in range(n + 1):
            for j in range(m + 1):
                p = np.array(corner) + np.array(size)*[i/n, j/m]
                self.x.append(middle + rotation @ (p - middle) if turn else p)
        element = [(node[i, j], node[i + 1, j], node[i + 1, j + 1], node[i, j + 1])
                   for i in range(n) for j in range(m)]
        side = {
            "B": [(i*m, "S1") for i in range(n)],
            "R": [((n - 1)*m + j, "S2") for j in range(m)],
            "T": [(i*m + m - 1, "S3") for i in range(n)],
            "L": [(j, "S4") for j in range(m)],
        }
        side["A"] = [face for faces in side.values() for face in faces]
        first_element = sum(len(block.element) for block in self.block.values()) + 1
        self.block[name] = Block(node, element, side)
        self.cards += [f"*ELEMENT, TYPE=CPE4, ELSET={name}"]
        self.cards += [f"{first_element + k}, " + ", ".join(map(str, nodes))
                       for k, nodes in enumerate(element)]
        for key, faces in side.items():
            self.cards += [f"*SURFACE, NAME={name}_{key}"]
            self.cards += [f"{first_element + k}, {face}" for k, face in faces]
        for key, nodes in (("B", node[:, 0]), ("T", node[:, -1])):
            self.cards += [f"*NSET, NSET={name}_{key}", *map(str, nodes)]
        self.cards += [f"*MATERIAL, NAME={name}", "*HYPERELASTIC, COUPLED NEO HOOKE",
                       f"{number(stiffness)}, 0.3", "*DENSITY", "1.",
                       f"*SOLID SECTION, ELSET={name}, MATERIAL={name}", "1."]
        if any(velocity):
            self.cards += ["*INITIAL CONDITIONS, TYPE=VELOCITY"]
            self.cards += [f"{k}, {a + 1}, {number(v)}" for k in node.flat
                           for a, v in enumerate(velocity) if v]
        return self

    def deck(self, step, h, t_end):
        nodes = [f"{k}, {number(x)}, {number(y)}" for k, (x, y) in enumerate(self.x, start=1)]
        pairs = [f"*CONTACT PAIR, INTERACTION=SMOOTH, TYPE=<formulation>\n{slave}, {master}"
                 for slave, master in self.pair]
        return Deck("\n".join([
            "*HEADING", "blocks", "*PARAMETER", "formulation = MORTAR", PARAMETERS.strip(),
            "*NODE", *nodes, *self.cards, "*SURFACE INTERACTION, NAME=SMOOTH", *pairs,
            "*STEP, NLGEOM", step[0], f"{number(h)}, {number(t_end)}", *step[1:], REQUESTS.strip(),
        ]), "blocks")

    def dynamic(self, h, t_end, *cards):
        return self.deck(["*DYNAMIC, DIRECT", *cards], h, t_end)

    def static(self, h, *cards):
        return self.deck(["*STATIC, DIRECT", *cards], h, 1.0)


def two_blocks(lower, upper, side=("B", "T"), swap=False, **more):
    """`lower` and `upper`: corner, size, cells. The upper one is slave, unless swapped."""
    scene = Scene().add("LOW", *lower, stiffness=more.get("stiffness", 100.0))
    scene.add("UP", *upper, **more)
    pair = (f"UP_{side[0]}", f"LOW_{side[1]}")
    scene.pair = [pair[::-1] if swap else pair]
    return scene


# ---- what must hold -----------------------------------------------------------------------------


def depths(scene, run):
    """Largest depth of a node of one block in another, per longest edge of the two, by frame."""
    fields = run.fields()
    edge = {name: np.array([(nodes[f], nodes[(f + 1) % 4])
                            for k, face in block.side["A"]
                            for nodes, f in [(block.element[k], int(face[1]) - 1)]]) - 1
            for name, block in scene.block.items()}
    q = fields.x + fields["displacement"]
    longest = {name: np.linalg.norm(np.diff(q[:, pairs], axis=2)[:, :, 0], axis=2).max(axis=1)
               for name, pairs in edge.items()}
    found = np.zeros(len(q))
    for here in edge:
        for there in edge:
            if here != there:
                depth = depth_inside(q[:, np.unique(edge[here])], q[:, edge[there]])
                found = np.maximum(found, depth/np.maximum(longest[here], longest[there]))
    return found


def depth_inside(points, edge):
    """Largest distance from outlines `edge` (m, n, 2, 2) of the `points` (m, k, 2) inside them: (m)."""
    p, a, e = points[:, :, None], edge[:, None, :, 0], edge[:, None, :, 1]
    b, d = p - a, e - a
    crosses = (a[..., 1] > p[..., 1]) != (e[..., 1] > p[..., 1])
    rise = np.where(crosses, d[..., 1], 1.0)
    inside = (crosses & (b[..., 0] < b[..., 1]*d[..., 0]/rise)).sum(axis=2) % 2 == 1
    share = np.clip((b*d).sum(axis=3)/(d*d).sum(axis=3), 0, 1)
    away = np.linalg.norm(b - share[..., None]*d, axis=3).min(axis=2)
    return np.where(inside, away, 0.0).max(axis=1)


def assert_sound(scene, run, initiation="PERSISTENT", deepest=0.5):
    """Energy and momenta of free bodies, action and reaction, and nothing inside anything else."""
    history, fields = run.history, run.fields()
    largest = history["kinetic"].max()
    change = history["total"] - history["total"][0]
    if initiation == "ADMISSIBLE":
        assert change.max() <= 1e-11*largest
    else:
        assert np.abs(change).max() <= 1e-11*largest
    # What momenta are measured against: mass times the speed and place that the energy allows.
    mass = run.series("BODIES", "MASS")[1][0].sum()
    scale = math.sqrt(2*largest*mass)
    reach = np.abs(fields.x + fields["displacement"]).max()
    for name, unit in (("px", scale), ("py", scale), ("lz", scale*reach)):
        assert np.abs(history[name] - history[name][0]).max() <= 1e-11*unit, name
    force = fields["contact_force"]
    # At a node that a pair and a guard hold in nearly one direction larger forces cancel.
    rounding = 1e-11 if run.verdict["guarded_increments"] else 256*EPSILON
    assert np.abs(force.sum(axis=1)).max() <= rounding*np.abs(force).max()
    assert depths(scene, run).max() <= deepest


def momentum_of(run, body):
    """px and py of a body over time."""
    return run.series("BODIES", "MOMENTUM")[1][:, body, :2]


# ---- nodes and edges that coincide --------------------------------------------------------------

LOWER = ((0, 0), (1, 1), (4, 2))
TOUCHING = {
    "matching": two_blocks(LOWER, ((0, 1), (1, 1), (4, 2)), velocity=(0, -1)),
    "every second node": two_blocks(LOWER, ((0, 1), (1, 1), (2, 2)), velocity=(0, -1)),
    "twice the nodes": two_blocks(LOWER, ((0, 1), (1, 1), (8, 2)), velocity=(0, -1)),
    "all around": two_blocks(LOWER, ((0, 1), (1, 1), (4, 2)), "AA", velocity=(0, -1)),
    "all around, half": two_blocks(LOWER, ((0, 1), (1, 1), (2, 2)), "AA", velocity=(0, -1)),
}


@pytest.mark.each_value
@every_choice
@pytest.mark.parametrize("name", TOUCHING)
def test_gap_zero_with_coincident_nodes(tmp_path, name, choice):
    """Pressed together from the start: the upper block is thrown back."""
    scene = TOUCHING[name]
    run = run_one_sided(scene.dynamic(0.02, 0.6), tmp_path, **CHOICES[choice])
    assert_sound(scene, run)
    assert run.history["active"].max() >= 1 and run.history["active"][-1] == 0
    # Bodies that part have exchanged more than half of the momentum; equal rigid ones all of it.
    low, up = momentum_of(run, 0)[-1, 1], momentum_of(run, 1)[-1, 1]
    assert low < up


@pytest.mark.each_value
@every_choice
@pytest.mark.parametrize("velocity", [(0.5, 0.0), (0.0, 1.0)])
def test_gap_zero_without_pressure(tmp_path, velocity, choice):
    """Bodies that slide along or leave each other feel nothing."""
    scene = two_blocks(LOWER, ((0, 1), (1, 1), (3, 2)), velocity=velocity)
    run = run_one_sided(scene.dynamic(0.02, 0.2), tmp_path, **CHOICES[choice])
    assert_sound(scene, run)
    assert (run.history["active"] == 0).all()
    assert np.abs(run.history["strain"]).max() <= 1e-24*run.history["kinetic"][0]


@every_choice
def test_two_passes_with_coincident_nodes(tmp_path, choice):
    scene = two_blocks(LOWER, ((0, 1.02), (1, 1), (4, 2)), "AA", velocity=(0, -1))
    scene.pair += [pair[::-1] for pair in scene.pair]
    run = run_one_sided(scene.dynamic(0.02, 0.6), tmp_path, **CHOICES[choice])
    assert_sound(scene, run)
    assert momentum_of(run, 0)[-1, 1] < -0.5


# ---- corners ------------------------------------------------------------------------------------

SQUARE = ((0, 0), (1, 1), (2, 2))
TIP = ((-0.5, -1.12), (1, 1), (2, 2))


def tips(shift):
    scene = Scene().add("LOW", *TIP, turn=math.pi/4)
    scene.add("UP", (-0.5 + shift, 0.35), (1, 1), (2, 2), turn=math.pi/4, velocity=(0, -1))
    scene.pair = [("UP_A", "LOW_A")]
    return scene


CORNERS = {
    **{f"corner on corner, {shift:g}": two_blocks(SQUARE, ((1 + shift, 1.05), (1, 1), (2, 2)), "AA",
                                                  velocity=(-0.3, -1))
       for shift in (0.0, 1e-9, -1e-9, -1e-3, -1e-2, -0.1)},
    "corner on flat": two_blocks(((-1, -1), (2, 1), (4, 2)), ((-0.5, 0.3), (1, 1), (2, 2)), "AT",
                                 velocity=(0, -1), turn=math.pi/4),
}


@pytest.mark.each_value
@every_choice
@pytest.mark.parametrize("name", CORNERS)
def test_corners_meet(tmp_path, name, choice):
    scene = CORNERS[name]
    run = run_one_sided(scene.dynamic(0.02, 0.6), tmp_path, **CHOICES[choice])
    assert_sound(scene, run)
    assert run.history["active"].max() >= 1
    assert momentum_of(run, 0)[-1, 1] < 0


@pytest.mark.each_value
@pytest.mark.parametrize("choice", [name for name in CHOICES if name != "points"])
@pytest.mark.parametrize("shift", [0.0, 1e-3])
def test_tips_meet(tmp_path, shift, choice):
    """Tip on tip. Gauss points lie inside the edges: they may all look past a tip."""
    scene = tips(shift)
    run = run_one_sided(scene.dynamic(0.02, 0.6), tmp_path, **CHOICES[choice])
    assert_sound(scene, run)
    assert run.history["active"].max() >= 1
    assert momentum_of(run, 0)[-1, 1] < 0


def test_contact_that_may_open_or_close_needs_no_cut(tmp_path):
    """Tip on tip, where each of two sets asks for the other one: increments cannot be cut."""
    deck = tips(2e-3).dynamic(0.03, 0.6)
    deck.data("*DYNAMIC")[:] = ["0.03, 0.6, 0.03"]
    deck.replace("*CONTACT PAIR,", "*CONTACT PAIR, GUARD=NO,")
    run = run_one_sided(deck, tmp_path, initiation="ADMISSIBLE", **CHOICES["edge"])
    assert run.verdict["warnings"] == [] and run.history["time"][-1] == pytest.approx(0.6)
    assert (np.diff(run.history["total"]) <= 1e-15).all()


def test_persistent_contact_that_may_open_or_close(tmp_path):
    """So it may be also where the gaps of the start decide: that makes no energy."""
    done = Outcome(SCENES["coil"](), tmp_path, BOTH, formulation="NODE TO SURFACE")
    assert done.energy_error < 1e-10     # Newton's tolerance
    assert not any("may pull" in warning for warning in done.run.verdict["warnings"])


@pytest.mark.parametrize(("name", "coarser"), [("wedge", 2), ("slide off", 1), ("comb", 2)])
def test_persistent_contact_does_not_pull(tmp_path, name, coarser):
    """Scenes in which sets come back, where the union would pull: nothing pulls."""
    scene = SCENES[name]()
    scene.h *= coarser
    done = Outcome(scene, tmp_path, AUTO, formulation="MORTAR")
    assert done.has_ended
    pressure = done.fields["contact_pressure"]
    assert pressure.max() > 0 and pressure.min() >= 0


# ---- bodies that move by several elements in a step ---------------------------------------------

TARGET = ((-2, -1), (4, 1), (16, 4))


@pytest.mark.each_value
@pytest.mark.parametrize("initiation", INITIATIONS)
@every_choice
@pytest.mark.parametrize("gap", [0.3, 2.4])
def test_no_tunnelling(tmp_path, gap, choice, initiation):
    """By 5 elements per step, a quarter of the wave speed: increments are cut, none goes through.

    A block is found inside the other by less than an element: at this speed corners are squeezed.
    """
    scene = two_blocks(TARGET, ((-0.6, gap), (1, 1), (4, 4)), "AT", velocity=(0, -12.5),
                       stiffness=2000.0)
    run = run_one_sided(scene.dynamic(0.1, 0.5), tmp_path, initiation=initiation, **CHOICES[choice])
    assert_sound(scene, run, initiation, deepest=1.0)
    assert momentum_of(run, 0)[-1, 1] < 0


@pytest.mark.each_value
@every_choice
@pytest.mark.parametrize("swap", [False, True])
def test_no_flight_through_a_body(tmp_path, swap, choice):
    """One step would carry the block from above to below the other."""
    scene = two_blocks(((-2, -1), (4, 1), (8, 2)), ((-0.6, 1), (1, 1), (4, 4)), "AA", swap,
                       velocity=(0, -10), stiffness=500.0)
    run = run_one_sided(scene.dynamic(0.5, 1.0), tmp_path, **CHOICES[choice])
    assert_sound(scene, run, deepest=1.0)
    assert momentum_of(run, 0)[-1, 1] < 0
    # By the first increment, cut or not, masses of 1 and 4 part, no faster than the block has come.
    parts = momentum_of(run, 1)[1:, 1] - momentum_of(run, 0)[1:, 1]/4
    assert (parts > 0).all() and (parts <= 10*(1 + EPSILON)).all()
    # It came with a momentum of -10, and is thrown back or stopped.
    assert (momentum_of(run, 1)[1:, 1] > -1).all()


# ---- several pairs ------------------------------------------------------------------------------


@pytest.mark.each_value
@every_choice
@pytest.mark.parametrize("cells", [(4, 4, 4), (4, 5, 3)])
@pytest.mark.parametrize("gap", [0.0, 0.03])
def test_sandwich(tmp_path, gap, cells, choice):
    """A plate between two blocks that fly together: by symmetry it keeps its momentum of 0."""
    scene = Scene().add("LOW", (0, 0), (1, 1), (cells[0], 2), velocity=(0, 1))
    scene.add("PLATE", (0, 1 + gap), (1, 0.5), (cells[1], 2))
    scene.add("UP", (0, 1.5 + 2*gap), (1, 1), (cells[2], 2), velocity=(0, -1))
    scene.pair = [("PLATE_B", "LOW_T"), ("PLATE_T", "UP_B")]
    run = run_one_sided(scene.dynamic(0.02, 0.5), tmp_path, **CHOICES[choice])
    assert_sound(scene, run)
    assert momentum_of(run, 0)[-1, 1] < 0 < momentum_of(run, 2)[-1, 1]


@every_choice
def test_one_node_in_two_pairs(tmp_path, choice):
    """A block flies into the corner of two others and comes back out of it."""
    scene = Scene().add("FLOOR", (0, -1), (3, 1), (6, 2)).add("WALL", (-1, 0), (1, 2), (2, 4))
    scene.add("BLOCK", (0.05, 0.05), (1, 1), (3, 3), velocity=(-1, -1))
    scene.pair = [("BLOCK_A", "FLOOR_A"), ("BLOCK_A", "WALL_A")]
    run = run_one_sided(scene.dynamic(0.02, 0.5), tmp_path, **CHOICES[choice])
    assert_sound(scene, run)
    assert (momentum_of(run, 2)[-1] > momentum_of(run, 2)[0]).all()


# ---- statics ------------------------------------------------------------------------------------

HELD = "*BOUNDARY\nLOW_B, 1, 2"


def pressed(side, cells=(8, 4), shift=0.0):
    return two_blocks(((0, -1), (2, 1), (cells[0], 2)), ((0.5 + shift, 0), (1, 0.5), (cells[1], 2)),
                      side, stiffness=1000.0)


@pytest.mark.parametrize("choice", [name for name in CHOICES if name[:4] not in ("node", "segm")])
def test_sides_that_do_not_touch_change_nothing(tmp_path, choice):
    """Beside a punch the block rises towards its vertical sides: these do not face each other."""
    force = []
    for side in ("BT", "AA"):
        scene = pressed(side)
        deck = scene.static(0.25, HELD, "UP_T, 1, 1", "UP_T, 2, 2, -0.1")
        run = run_one_sided(deck, tmp_path/side, **CHOICES[choice])
        force.append(run.fields()["contact_force"][-1])
    # To what Newton's method leaves, 1e-12 of the forces before they cancel.
    assert np.abs(force[0]).max() > 1
    np.testing.assert_allclose(force[1], force[0], rtol=0, atol=1e-9*np.abs(force[0]).max())


@pytest.mark.each_value
@every_choice
@pytest.mark.parametrize("shift", [0.5 + 1e-3, 0.5 + 1e-5, 0.5 - 1e-5, 0.75 - 1e-3, 0.75 - 1e-5])
def test_nearly_coincident_nodes_and_ends(tmp_path, shift, choice):
    """Edges covered to 1e-3 and 1e-5, or but for as much; points that pass nodes: it converges."""
    deck = pressed("BT", shift=shift).static(0.25, HELD, "UP_T, 1, 1", "UP_T, 2, 2, -0.1")
    fields = run_one_sided(deck, tmp_path, **CHOICES[choice]).fields()
    force = fields["contact_force"][-1]
    assert np.abs(force.sum(axis=0)).max() <= 256*EPSILON*np.abs(force).max()
    # No multiplier stands out because its surface is small: no node carries more than what would
    # squeeze the punch, 0.5 high, without change of width, by all of the 0.1 (section 1, modulus
    # 1346, shortened to 0.8).
    assert 1 < np.abs(force).max() <= 1346*0.2/0.8
    pressure = fields["contact_pressure"][-1]
    assert pressure.min() >= -1e-9*pressure.max()


def test_what_goes_in_where_no_contact_acts_is_seen_in_a_smaller_increment(tmp_path):
    """A block falls on a column that is softer and lighter than it, and on a plank below: what is
    squeezed out between them goes by several edges in an increment."""
    scene = plain_scenes.Scene(0.02, 0.6, gravity=10.0)
    scene.block("BLOCK", (-0.4, 1.6), (1.0, 0.5), (5, 5), stiffness=300.0, velocity=(0.0, -0.3))
    scene.block("PLANK", (-0.3, 0.1), (0.5, 0.2), (2, 1), density=0.1, velocity=(-0.3, 0.0))
    scene.block("COLUMN", (-0.5, 0.3), (0.5, 1.0), (5, 5), stiffness=30.0, density=0.1,
                velocity=(0.3, 0.0))
    scene.block("FLOOR", (-2.0, -0.5), (4.0, 0.5), (13, 1))
    scene.hold("FLOOR", below(-0.5))
    # With the default tolerance the rounding of a processor decides whether hard increments gain more.
    done = Outcome(scene, tmp_path, AUTO, formulation="NODE TO SURFACE", tolerance=1e-13)
    assert "bodies would overlap where no contact acts" in done.run.log
    assert done.run.verdict["verdict"] == "good"
    # A few roundings of the largest coordinate, by the shortest edge.
    assert done.overlap.by_edge <= 64*EPSILON*2.0/0.05


@every_choice
def test_turned_as_a_whole(tmp_path, choice):
    """Touching blocks turned by 90 degrees in 9 steps: no stress, no force, no drift."""
    scene = two_blocks(LOWER, ((0, 1), (1, 1), (3, 2)))
    driven = [*scene.block["LOW"].node[:, 0], *scene.block["UP"].node[:, -1]]
    angle = np.linspace(0, 0.5*math.pi, 10)
    cards = []
    for k in driven:
        x, y = scene.x[k - 1]
        for axis, u in ((1, (np.cos(angle) - 1)*x - np.sin(angle)*y),
                        (2, np.sin(angle)*x + (np.cos(angle) - 1)*y)):
            table = ", ".join(f"{number(t/9)}, {number(v)}" for t, v in enumerate(u))
            cards += [(f"*AMPLITUDE, NAME=A{k}_{axis}\n{table}",
                       f"*BOUNDARY, AMPLITUDE=A{k}_{axis}\n{k}, {axis}, {axis}, 1.")]
    scene.cards += [amplitude for amplitude, _ in cards]
    run = run_one_sided(scene.static(1/9, *(boundary for _, boundary in cards)), tmp_path,
                   **CHOICES[choice])
    fields = run.fields()
    assert len(fields.time) == 10
    turned = fields.x @ np.array([[0, 1], [-1, 0]])
    # Displacements of size 2 round the strains of elements of size 1/4 by 2 eps/(1/4), some tens
    # of times over in the sums of an element and of its neighbours; the modulus is 100.
    rounding = 64*EPSILON*2/0.25
    np.testing.assert_allclose(fields.x + fields["displacement"][-1], turned, atol=rounding)
    assert np.abs(fields["cauchy_stress"]).max() <= 100*rounding
    assert np.abs(fields["contact_force"]).max() <= 100*rounding
