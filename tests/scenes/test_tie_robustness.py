"""Ties where they are easily got wrong: few edges, corners, junctions, supports, contact."""

import itertools
import sys

import numpy as np
import pytest
from scene_tools import DECKS, EPSILON, Deck, emcon, run_deck

sys.path.insert(0, str(DECKS))

from deckwriter import Part, add_grid, number  # noqa: E402
from tied_parts import FACE, Body, Piece, line  # noqa: E402

MULTIPLIERS = ["DUAL", "STANDARD"]
METHODS = ["NULL SPACE", "SADDLE POINT"]
ROUND_OFF = 1e-12
YOUNG, DENSITY = 100.0, 0.01
GRADIENT = np.array([[0.06, 0.05], [-0.02, -0.08]])

#: A multiple of what a sum over some hundred increments of some hundred terms rounds.
CONSERVED = 1e3*EPSILON


# ---- scenes -------------------------------------------------------------------------------------


class Scene(Body):
    """Rectangles with ties between their sides, or between surfaces of several sides."""

    def __init__(self, multiplier="DUAL"):
        super().__init__(multiplier=multiplier)
        self.lines = []

    def box(self, name, low, high, cells):
        (x0, y0), (x1, y1) = low, high
        self.add(name, cells, line((x0, y0), (x1, y0)), line((x1, y0), (x1, y1)),
                 line((x0, y1), (x1, y1)), line((x0, y0), (x0, y1)))

    def closed(self, name, cells, place):
        """A ring of cells."""
        part = Part(name)
        first = (1 + len(self.places()), 1 + sum(len(p.element) for p in self.parts()))
        self.piece[name] = Piece(part, add_grid(part, cells, place, first=first, closed=True))

    def faces(self, name, pairs):
        """A surface of faces (element, face) in this order."""
        self.lines += [f"*SURFACE, NAME={name}, TYPE=ELEMENT",
                       *(f"{element}, {face}" for element, face in pairs)]

    def sides(self, name, *sides):
        self.faces(name, [(e, FACE[side]) for piece, side in sides
                          for e in self.piece[piece].elements(side)])

    def tied(self, slave, master, options=""):
        self.lines += [f"*TIE, NAME={slave}_{master}, MULTIPLIER={self.multiplier}{options}",
                       f"{slave}, {master}"]

    def deck(self, *steps, model=(), method="NULL SPACE", law="*ELASTIC", nlgeom=True, name="deck"):
        """A deck of `steps`, each a list of lines; `model` stands before them."""
        lines = ["*HEADING", name, *self.mesh_lines(), *self.tie_lines(), *self.lines,
                 "*MATERIAL, NAME=SOLID", law, f"{number(YOUNG)}, 0.3", "*DENSITY",
                 number(DENSITY), *self.section_lines("SOLID"), *model]
        for step in steps:
            lines += ["*STEP, NLGEOM" if nlgeom else "*STEP", *step,
                      f"*CONSTRAINT METHOD, TYPE={method}", "*NEWTON, TOLERANCE=1e-12",
                      "*NODE FILE", "U, V, RF", "*EL FILE", "S, ENER", "*END STEP"]
        return Deck("\n".join(lines), name)


STATIC = ["*STATIC", "0.5, 1."]
FLIGHT = ["*DYNAMIC, DIRECT", "0.02, 1."]
NEO_HOOKE = "*HYPERELASTIC, COUPLED NEO HOOKE"


def clamp(nodes, *values):
    """`*BOUNDARY`: both directions, held or displaced."""
    ux, uy = values or (0.0, 0.0)
    return ["*BOUNDARY", *(f"{n}, {k}, {k}, {number(u)}" for n in nodes
                           for k, u in ((1, ux), (2, uy)))]


def linear(scene, nodes):
    """`*BOUNDARY`: displacements of the uniform state."""
    place = scene.places()
    lines = ["*BOUNDARY"]
    for n in nodes:
        lines += [f"{n}, {k}, {k}, {number(u)}" for k, u in enumerate(GRADIENT @ place[n], start=1)]
    return lines


def velocities(scene, function):
    lines = ["*INITIAL CONDITIONS, TYPE=VELOCITY"]
    for n, (x, y) in scene.places().items():
        lines += [f"{n}, {k}, {number(v)}" for k, v in enumerate(function(x, y), start=1)]
    return lines


def tumbling(x, y):
    return 2 - y + 0.4*x, 1 + x - 0.4*y


def on_the_box(scene):
    """Nodes on the sides of the box around everything."""
    place = scene.places()
    x = np.array(list(place.values()))
    at_end = (x == x.min(axis=0)) | (x == x.max(axis=0))
    return [n for n, is_there in zip(place, at_end.any(axis=1), strict=True) if is_there]


def two_blocks(multiplier, lower, upper):
    scene = Scene(multiplier)
    scene.box("A", (0.0, 0.0), (2.0, 1.0), (lower, 3))
    scene.box("C", (0.0, 1.0), (2.0, 2.0), (upper, 2))
    scene.join("C", "SOUTH", "A", "NORTH")
    return scene


def square_in_frame(multiplier, inner, outer, swap):
    """A square in a square hole, all around in one tie."""
    scene = Scene(multiplier)
    n = 4*outer

    def place(i, j):
        side, k = divmod(-i % n, outer)
        t, h = -1 + 2*k/outer, 1 + j/3
        return [(t*h, -h), (h, t*h), (-t*h, h), (-h, -t*h)][side]

    scene.closed("FRAME", (n, 3), place)
    scene.box("SQUARE", (-1.0, -1.0), (1.0, 1.0), (inner, inner))
    scene.sides("OUTSIDE", *(("SQUARE", side) for side in ("NORTH", "WEST", "SOUTH", "EAST")))
    scene.faces("HOLE", [(column[0], "S1") for column in scene.piece["FRAME"].grid.element])
    scene.tied(*(("HOLE", "OUTSIDE") if swap else ("OUTSIDE", "HOLE")))
    return scene


def junction(multiplier, cells, kind):
    """Three blocks beside each other upon a long one, tied by three ties or by one."""
    scene = Scene(multiplier)
    scene.box("A", (0.0, 0.0), (3.0, 1.0), (cells[0], 2))
    for k, name in enumerate("XYZ"):
        scene.box(name, (float(k), 1.0), (k + 1.0, 2.0), (cells[k + 1], 2 + k))
    scene.join("Y", "WEST", "X", "EAST")
    scene.join("Z", "WEST", "Y", "EAST")
    if kind == "three ties":
        for name in "XYZ":
            scene.join(name, "SOUTH", "A", "NORTH")
        return scene
    scene.sides("A_TOP", ("A", "NORTH"))
    scene.sides("FEET", *((name, "SOUTH") for name in "XYZ"))
    scene.tied(*(("FEET", "A_TOP") if kind == "slave of three" else ("A_TOP", "FEET")))
    return scene


def leg(multiplier, above, below):
    """A leg under the middle of three tied blocks; its interface ends at two crosspoints."""
    scene = Scene(multiplier)
    scene.box("LEG", (1.0, 0.0), (2.0, 1.0), (below, 2))
    scene.box("X", (0.0, 1.0), (1.0, 2.0), (2, 3))
    scene.box("Y", (1.0, 1.0), (2.0, 2.0), (above, above))
    scene.box("Z", (2.0, 1.0), (3.0, 2.0), (2, 3))
    scene.join("X", "EAST", "Y", "WEST")
    scene.join("Z", "WEST", "Y", "EAST")
    scene.join("Y", "SOUTH", "LEG", "NORTH")
    return scene


# ---- judging ------------------------------------------------------------------------------------


def assert_uniform(run):
    fields = run.fields()
    wanted = fields.x @ GRADIENT.T
    scale = np.abs(wanted).max()
    np.testing.assert_allclose(fields["displacement"][-1], wanted, rtol=0, atol=ROUND_OFF*scale)
    stress = fields["cauchy_stress"][-1]
    scale = np.abs(stress).max()
    np.testing.assert_allclose(stress - stress[0], 0*stress, rtol=0, atol=ROUND_OFF*scale)


def assert_conserved(run):
    history = run.history
    for name in ("total", "px", "py", "lz"):
        assert np.abs(history[name]/history[name][0] - 1).max() <= CONSERVED, name


def both_methods(make, folder):
    """Runs by null space and by saddle point: the same displacements, to round-off."""
    runs = [run_deck(make(method), folder / method[:4]) for method in METHODS]
    u, v = (run.fields()["displacement"] for run in runs)
    np.testing.assert_allclose(u, v, rtol=0, atol=ROUND_OFF*np.abs(u).max())
    return runs


# ---- interfaces ---------------------------------------------------------------------------------


SCENES = {
    **{f"blocks {a}:{b}": lambda m, a=a, b=b: two_blocks(m, a, b)
       for a, b in ((1, 1), (1, 2), (2, 1), (3, 1), (1, 50), (50, 1))},
    **{f"frame {a}:{b}{', swapped'*swap}": lambda m, a=a, b=b, s=swap: square_in_frame(m, a, b, s)
       for (a, b), swap in itertools.product(((1, 1), (2, 1), (4, 5), (7, 2)), (False, True))},
    **{f"{kind} {cells}": lambda m, c=cells, k=kind: junction(m, c, k)
       for kind in ("three ties", "slave of three", "master of three")
       for cells in ((7, 2, 3, 4), (5, 1, 1, 1), (3, 2, 2, 2), (2, 5, 4, 3))},
}


@pytest.mark.each_value
@pytest.mark.parametrize("multiplier", MULTIPLIERS)
@pytest.mark.parametrize("scene", SCENES)
def test_uniform_stress(tmp_path, scene, multiplier):
    scene = SCENES[scene](multiplier)
    step = [*STATIC, *linear(scene, on_the_box(scene))]
    runs = both_methods(lambda method: scene.deck(step, method=method), tmp_path)
    for run in runs:
        assert_uniform(run)
        assert "constant stress" not in run.log


@pytest.mark.each_value
@pytest.mark.parametrize("multiplier", MULTIPLIERS)
@pytest.mark.parametrize("scene", SCENES)
def test_free_flight(tmp_path, scene, multiplier):
    scene = SCENES[scene](multiplier)
    deck = scene.deck(FLIGHT, model=velocities(scene, tumbling), law=NEO_HOOKE)
    assert_conserved(run_deck(deck, tmp_path))


@pytest.mark.parametrize("away", [1e3, 1e6])
def test_far_from_the_origin(tmp_path, away):
    scene = two_blocks("DUAL", 4, 5)
    for part in scene.parts():
        part.node.update({n: (x + away, y - away) for n, (x, y) in part.node.items()})
    model = velocities(scene, lambda x, y: tumbling(x - away, y + away))
    assert_conserved(run_deck(scene.deck(FLIGHT, model=model, law=NEO_HOOKE), tmp_path))


def test_faces_in_any_order(tmp_path):
    """The order in which the faces of a surface are given makes no difference."""
    history = []
    for order in ((0, 1, 2, 3, 4), (3, 0, 4, 2, 1)):
        scene = two_blocks("DUAL", 4, 5)
        scene.tie.clear()
        row = scene.piece["C"].elements("SOUTH")
        scene.faces("FOOT", [(row[k], "S1") for k in order])
        scene.sides("HEAD", ("A", "NORTH"))
        scene.tied("FOOT", "HEAD")
        deck = scene.deck(FLIGHT, model=velocities(scene, tumbling), law=NEO_HOOKE)
        history.append(run_deck(deck, tmp_path / str(order[0])).digits())
    assert history[0] == history[1]


# ---- ties are no hinges -------------------------------------------------------------------------


def bend_a_block(scene, held, loaded):
    force = 0.01
    return [*STATIC, *clamp(held), "*CLOAD", f"{loaded}, 1, {number(force)}"], force


def assert_stiff(run, force):
    """Deflections are those of an elastic block, and the reaction is the load."""
    fields = run.fields()
    assert np.abs(fields["displacement"][-1]).max() < 30*force/YOUNG
    reaction = fields["reaction_force"][-1].sum(axis=0)
    np.testing.assert_allclose(reaction, [-force, 0], rtol=0, atol=1e-9*force)


@pytest.mark.each_value
@pytest.mark.parametrize("multiplier", MULTIPLIERS)
@pytest.mark.parametrize("cells", [(1, 1), (3, 1), (2, 2), (1, 2), (4, 5)])
@pytest.mark.parametrize("held", ["edge", "both ends"])
def test_supported_ends_of_the_slave(tmp_path, held, cells, multiplier):
    """A slave surface of one or two edges with supported ends still holds a body upright."""
    scene = two_blocks(multiplier, *cells)
    foot = scene.piece["C"].nodes("SOUTH")
    nodes = scene.piece["C"].nodes("WEST") if held == "edge" else [foot[0], foot[-1]]
    step, force = bend_a_block(scene, nodes, scene.piece["A"].nodes("SOUTH")[0])
    for run in both_methods(lambda method: scene.deck(step, method=method), tmp_path):
        assert_stiff(run, force)


@pytest.mark.each_value
@pytest.mark.parametrize("multiplier", MULTIPLIERS)
@pytest.mark.parametrize("cells", [(1, 1), (1, 3), (2, 2), (2, 3), (3, 2), (4, 4)])
def test_slave_between_crosspoints(tmp_path, cells, multiplier):
    """A slave surface of one or two edges between two crosspoints still holds a leg upright."""
    scene = leg(multiplier, *cells)
    held = [*scene.piece["X"].nodes("WEST"), *scene.piece["Z"].nodes("EAST")]
    step, force = bend_a_block(scene, held, scene.piece["LEG"].nodes("SOUTH")[0])
    for run in both_methods(lambda method: scene.deck(step, method=method), tmp_path):
        assert_stiff(run, force)


@pytest.mark.parametrize("multiplier", MULTIPLIERS)
def test_matching_blocks_of_one_element_are_one_body(tmp_path, multiplier):
    """Ties of single matching edges with a supported end: as if the nodes were shared."""
    tied = two_blocks(multiplier, 1, 1)
    west = [*tied.piece["A"].nodes("WEST"), *tied.piece["C"].nodes("WEST")]
    load = ["*CLOAD", f"{tied.piece['C'].nodes('EAST')[-1]}, 2, -0.01"]
    whole = Scene()
    whole.box("A", (0.0, 0.0), (2.0, 2.0), (1, 5))
    place = whole.places()
    # The rows of the tied blocks: three below, two above.
    for n, y in zip(whole.piece["A"].nodes("WEST") + whole.piece["A"].nodes("EAST"),
                    2*[0.0, 1/3, 2/3, 1.0, 1.5, 2.0], strict=True):
        whole.piece["A"].part.node[n] = (place[n][0], y)
    one = run_deck(tied.deck([*STATIC, *clamp(west), *load]), tmp_path / "tied").fields()
    load = ["*CLOAD", f"{whole.piece['A'].nodes('EAST')[-1]}, 2, -0.01"]
    step = [*STATIC, *clamp(whole.piece["A"].nodes("WEST")), *load]
    other = run_deck(whole.deck(step), tmp_path / "whole").fields()
    tip = [f["displacement"][-1][(f.x == [2, 2]).all(axis=1)][0] for f in (one, other)]
    np.testing.assert_allclose(tip[0], tip[1], rtol=1e-9)


# ---- supports and steps -------------------------------------------------------------------------


@pytest.mark.parametrize("cells", [(4, 5), (5, 4), (1, 1), (3, 1)])
def test_steps_with_changing_supports(tmp_path, cells):
    """Supports come and go at the end of the interface; unloaded, the bodies are as they were."""
    scene = two_blocks("DUAL", *cells)
    ground, top = scene.piece["A"].nodes("SOUTH"), scene.piece["C"].nodes("NORTH")
    end = scene.piece["C"].nodes("SOUTH")[0]
    new = clamp(ground)
    new[0] += ", OP=NEW"
    steps = [
        [*STATIC, *clamp(ground), *clamp(top, 0.0, 0.1)],
        [*STATIC, "*BOUNDARY, FIXED", f"{end}, 1, 2"],
        [*STATIC, *new, f"{end}, 1, 1, 0.02"],
        [*STATIC, *new],
    ]
    fields = run_deck(scene.deck(*steps), tmp_path).fields()
    assert np.abs(fields["displacement"]).max() >= 0.1
    np.testing.assert_allclose(fields["displacement"][-1], 0, rtol=0, atol=64*EPSILON*0.1)


@pytest.mark.parametrize("nlgeom", [False, True])
@pytest.mark.parametrize("cells", [None, (4, 5)], ids=["one body", "tied"])
def test_static_motion_through_zero(tmp_path, cells, nlgeom):
    """An amplitude that meets zero at the end of an increment leaves forces of round-off."""
    scene = two_blocks("DUAL", *(cells or (4, 5)))
    if cells is None:
        scene.tie.clear()
        del scene.piece["C"]
    moved = scene.piece["A"].nodes("NORTH")[:2] if cells is None \
        else scene.piece["C"].nodes("SOUTH")[:2]
    step = ["*STATIC", "0.05, 1.", *clamp(scene.piece["A"].nodes("SOUTH")[:2]),
            "*BOUNDARY, AMPLITUDE=WAVE", *clamp(moved, 0.1, 0.05)[1:]]
    model = ["*AMPLITUDE, NAME=WAVE", "0., 0., 0.3, 1., 0.6, -1., 1., 0.5"]
    run = run_deck(scene.deck(step, model=model, nlgeom=nlgeom), tmp_path)
    assert run.history["cuts"].sum() == 0


def test_fixed_where_an_earlier_step_left_it(tmp_path):
    """FIXED holds a displacement that the constraint agrees with: no contradiction."""
    scene = Scene()
    scene.box("A", (0.0, 0.0), (2.0, 1.0), (4, 3))
    ground, top = scene.piece["A"].nodes("SOUTH"), scene.piece["A"].nodes("NORTH")
    equation = ["*EQUATION", "2", f"{top[0]}, 2, 1., {top[1]}, 2, -1."]
    steps = [
        [*STATIC, *clamp(ground), *(f"{n}, 2, 2, 0.1" for n in top[:2])],
        [*STATIC, "*BOUNDARY, FIXED", f"{top[0]}, 2"],
    ]
    fields = run_deck(scene.deck(*steps, model=equation), tmp_path).fields()
    at = [(fields.x == scene.places()[n]).all(axis=1) for n in top[:2]]
    for where in at:
        assert fields["displacement"][-1][where, 1] == pytest.approx(0.1, rel=4*EPSILON)


def test_preload_and_release(tmp_path):
    """Statics, then motion: the energy stored is the energy of the flight."""
    scene = two_blocks("DUAL", 3, 1)
    ground = scene.piece["A"].nodes("SOUTH")
    steps = [
        [*STATIC, *clamp(ground), *clamp(scene.piece["C"].nodes("NORTH"), 0.1, 0.1)],
        [*FLIGHT, "*BOUNDARY, OP=NEW"],
    ]
    history = run_deck(scene.deck(*steps, law=NEO_HOOKE), tmp_path).history
    energy = (history["kinetic"] + history["strain"])[history["time"] >= 1]
    assert len(energy) == 51 and energy[0] > 0
    np.testing.assert_allclose(energy, energy[0], rtol=CONSERVED)


# ---- beside contact -----------------------------------------------------------------------------


@pytest.mark.each_value
@pytest.mark.parametrize("adjust", ["", ", ADJUST=0.03"])
@pytest.mark.parametrize("surfaces", ["SIDE, WALL", "WALL, SIDE"])
@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
def test_contact_across_a_joint(tmp_path, formulation, surfaces, adjust):
    """A block hits the side of two tied ones, where the slave nodes of the tie end."""
    scene = Scene()
    scene.box("A", (0.0, 0.0), (2.0, 1.0), (4, 3))
    scene.box("C", (0.0, 1.0), (2.0, 2.0), (5, 4))
    scene.box("D", (2.02, 0.3), (3.0, 1.7), (3, 5))
    scene.join("C", "SOUTH", "A", "NORTH")
    scene.sides("SIDE", ("A", "EAST"), ("C", "EAST"))
    scene.sides("WALL", ("D", "WEST"))
    model = [*velocities(scene, lambda x, y: (-1.0, 0.3) if x > 2.01 else (0.0, 0.0)),
             "*SURFACE INTERACTION, NAME=SMOOTH",
             f"*CONTACT PAIR, INTERACTION=SMOOTH, TYPE={formulation}{adjust}", surfaces]
    runs = both_methods(
        lambda method: scene.deck(FLIGHT, model=model, law=NEO_HOOKE, method=method), tmp_path
    )
    for run in runs:
        assert run.history["active"].max() > 0
        assert_conserved(run)


# ---- restart ------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", METHODS)
def test_restart_of_a_tied_run(tmp_path, method):
    """Taken up again from its last restart file, a run writes the same bits."""
    scene = junction("DUAL", (7, 2, 3, 4), "slave of three")
    deck = scene.deck([*FLIGHT, "*RESTART, WRITE, FREQUENCY=30"], method=method, law=NEO_HOOKE,
                      model=velocities(scene, tumbling))
    whole = run_deck(deck, tmp_path / "whole")
    part = run_deck(deck, tmp_path / "parts")
    done = emcon("restart", part.file(".rst.h5"), "--quiet")
    assert done.returncode == 0, done.stderr
    assert part.digits() == whole.digits()
