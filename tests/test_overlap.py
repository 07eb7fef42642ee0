"""The independent judge of overlaps, on figures whose overlaps are known."""

import math
import pathlib
import sys

import numpy as np
import pytest
from overlap import Bodies, BodiesInSpace, overlap_of_triangles, turns
from scene_tools import EPSILON

sys.path.insert(0, str(pathlib.Path(__file__).parent/"scenes"))

from space_mesh import KINDS, TETRAHEDRA, Block  # noqa: E402


def square(corner=(0.0, 0.0), size=(1.0, 1.0), cells=(2, 2), turn=0.0):
    """Nodes and cells of a rectangle, turned about its middle."""
    n, m = cells
    x = np.array([(size[0]*i/n, size[1]*j/m) for i in range(n + 1) for j in range(m + 1)])
    middle = np.array(size)/2
    turned = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    label = np.arange((n + 1)*(m + 1)).reshape(n + 1, m + 1)
    cell = [(label[i, j], label[i + 1, j], label[i + 1, j + 1], label[i, j + 1])
            for i in range(n) for j in range(m)]
    return (x - middle) @ turned.T + middle + corner, cell


def together(*parts):
    """One mesh of several bodies: positions and `Bodies`."""
    cells, first = [], 0
    for x, cell in parts:
        cells += [np.array(nodes) + first for nodes in cell]
        first += len(x)
    return np.vstack([x for x, _ in parts]), Bodies(cells)


def test_outlines_are_found_from_cells():
    x, bodies = together(square(cells=(3, 2)), square((5, 0), cells=(1, 1)))
    assert bodies.n == 2
    assert [len(bodies.edges(k)) for k in range(2)] == [10, 4]
    # The inside is to the left: the area by the outline is positive, and right.
    for k, area in ((0, 1.0), (1, 1.0)):
        a, b = x[bodies.edges(k).T]
        assert np.isclose((a[:, 0]*b[:, 1] - a[:, 1]*b[:, 0]).sum()/2, area)


@pytest.mark.parametrize("turn", [0.0, 0.3, math.pi/4])
@pytest.mark.parametrize("depth", [0.2, 1e-3, 1e-9])
def test_depth_of_a_flat_in_a_flat(turn, depth):
    """Two squares with a common side line, one into the other by `depth`, all turned."""
    low, up = square(size=(3.0, 1.0), cells=(3, 1)), square((1.1, 1.0 - depth), (0.8, 1.0))
    c, s = math.cos(turn), math.sin(turn)
    x, bodies = together(low, up)
    found = bodies.overlap(x @ np.array([[c, s], [-s, c]]))
    assert set(found.bodies) == {0, 1}
    assert abs(found.depth - depth) <= 16*EPSILON
    assert abs(found.by_edge - depth/0.4) <= 64*EPSILON      # behind the edges of the upper one


def test_touching_is_no_overlap():
    x, bodies = together(square(), square((0.0, 1.0), cells=(3, 2)), square((1.0, 1.0)))
    assert bodies.overlap(x).depth <= EPSILON


@pytest.mark.parametrize("gap", [1e-12, 0.1])
def test_apart_is_no_overlap(gap):
    x, bodies = together(square(), square((0.3, 1.0 + gap)), square((1.3 + gap, 0.0)))
    assert not bodies.overlap(x).bodies


def test_corner_in_a_flat():
    """The tip of a turned square, 0.05 below the line: deeper than all its neighbours."""
    tip = square((0.2, 1.0 - 0.05 + (math.sqrt(2) - 1)/2), turn=math.pi/4)
    x, bodies = together(square(cells=(4, 1)), tip)
    found = bodies.overlap(x)
    assert found.depth == pytest.approx(0.05, rel=1e-12)
    assert found.by_edge == pytest.approx(0.2, rel=1e-12)
    assert found.place[0] == pytest.approx(0.7)


@pytest.mark.parametrize("cells", [1, 2, 3])
def test_crossing_without_a_node_inside(cells):
    """Two strips as a cross: no node of either is in the other, nor is a centre."""
    x, bodies = together(square((0.0, 0.45), (1.0, 0.1), (cells, 1)),
                         square((0.37, 0.0), (0.1, 1.0), (1, cells)))
    # Behind the long side in the middle of where the strips cross.
    assert bodies.overlap(x).depth == pytest.approx(0.05)


@pytest.mark.parametrize("shift", [0.0, 1e-9, -1e-9])
def test_corners_that_have_slid_past_each_other(shift):
    """The corners lie on each other's side: no node is inside by more than `shift`."""
    low, up = square(size=(1.0, 1.0), cells=(1, 1)), square((shift, 1.0), cells=(1, 1))
    x, bodies = together(low, up)
    x[4 + 2] -= [0.0, 0.2]                       # the right lower corner of the upper one
    # A triangle of sides 1 and 0.2 between the lines; its middle is 0.1 below the upper line.
    assert bodies.overlap(x).depth == pytest.approx(0.1, abs=1e-8)


def test_a_body_in_the_place_of_its_twin():
    """All nodes lie on the other's nodes: seen by the centres of cells."""
    x, bodies = together(square(), square())
    assert bodies.overlap(x).depth == pytest.approx(0.25)


def test_a_body_wholly_inside():
    x, bodies = together(square(size=(4.0, 4.0)), square((1.2, 1.5), (0.5, 0.5), (1, 1)))
    found = bodies.overlap(x)
    assert found.bodies == (1, 0) and found.depth == pytest.approx(1.7)


def bent(opening, n=12):
    """A strip 0.2 thick, bent to a pin whose ends are `opening` apart, or overlap below 0."""
    angle = np.linspace(0.0, math.pi, n + 1)[:, None]
    side = np.hstack([np.sin(angle), -np.cos(angle)])       # from (0, -1) to (0, 1)
    inner = np.vstack([[(-2.0, -opening/2), (-1.0, -0.3)], 0.6*side, [(-1.0, 0.3),
                                                                      (-2.0, opening/2)]])
    outer = np.vstack([[(-2.0, -opening/2 - 0.2), (-1.0, -0.5)], 0.8*side, [(-1.0, 0.5),
                                                                          (-2.0, opening/2 + 0.2)]])
    m = len(inner)
    return np.vstack([inner, outer]), [(m + k, m + k + 1, k + 1, k) for k in range(m - 1)]


@pytest.mark.parametrize("opening", [0.3, 1e-6])
def test_a_bent_strip_is_no_overlap(opening):
    x, bodies = together(bent(opening))
    assert bodies.n == 1
    assert not bodies.overlap(x).bodies


@pytest.mark.parametrize("depth", [0.1, 1e-3])
def test_a_body_inside_itself(depth):
    x, bodies = together(bent(-depth))
    found = bodies.overlap(x)
    assert found.bodies == (0, 0)
    # The legs lean towards each other, by 0.3 + depth/2 over a length of 1; their ends lie over
    # each other, so that the deepest point is in the middle of what an end has inside.
    assert found.depth == pytest.approx(0.5*depth/math.hypot(1.0, 0.3 + depth/2), rel=1e-9)
    assert not bodies.overlap(x, alone=[(0, 0)]).bodies


def test_a_body_that_was_crossed_between_frames():
    """Before and behind a thin plate: no frame overlaps, the way does."""
    x, bodies = together(square(size=(1.0, 0.05), cells=(8, 1)),
                         square((0.4, 0.3), (0.2, 0.2), (1, 1)))
    after = x.copy()
    after[-4:] -= [0.0, 0.7]
    assert not bodies.overlap(x).bodies and not bodies.overlap(after).bodies
    found = bodies.worst(np.array([x, after]), [0.0, 1.0])
    assert found.depth >= 0.05/4
    assert 0.3/0.7 < found.time < 0.55/0.7


def test_bodies_that_fly_together_meet_nothing():
    x, bodies = together(square(), square((0.0, 1.001)))
    found = bodies.worst(np.array([x, x + [3.0, 40.0]]), [0.0, 1.0])
    assert not found.bodies


def test_lines_and_points_have_no_outline():
    """A square, a spring at its corner and a mass in it: the square alone is a body."""
    x = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [-1.0, 0.0], [0.5, 0.5]])
    bodies = Bodies([[0, 1, 2, 3], [0, 4], [5]])
    assert bodies.n == 1 and not bodies.overlap(x).depth > 0


# ---- three dimensions ---------------------------------------------------------------------------


def blocks(kind, *parts):
    """One mesh of blocks, each (cells, size, where): positions and `BodiesInSpace`."""
    x, cells, first = [], [], 0
    for n, size, where in parts:
        block = Block(kind, n, size)
        x.append(block.x + where)
        cells += [np.array(nodes) - 1 + first for nodes in block.element]
        first += len(block.x)
    return np.vstack(x), BodiesInSpace(cells)


def ball(n, radius=1.0):
    """Points and triangles of a sphere: a cube of n cells to a side, blown up."""
    block = Block("C3D8", (n, n, n))
    x, bodies = blocks("C3D8", ((n, n, n), (2, 2, 2), (-1, -1, -1)))
    points, triangle, _ = bodies.triangles(x, 0)
    used = np.unique(triangle)
    points[used] *= radius/np.linalg.norm(points[used], axis=1)[:, None]
    assert len(block.x) == len(x)
    return points, triangle


def volume(x, triangle):
    a, b, c = (x[triangle[:, k]] for k in range(3))
    return (a*np.cross(b, c)).sum()/6


@pytest.mark.parametrize("kind", KINDS)
def test_outlines_in_space_enclose_their_volume(kind):
    x, bodies = blocks(kind, ((2, 1, 3), (2, 1, 1), (0, 0, 0)), ((1, 1, 1), (1, 1, 1), (5, 0, 0)))
    assert bodies.n == 2
    for k, size in enumerate((2.0, 1.0)):
        points, triangle, face = bodies.triangles(x, k)
        assert np.isclose(volume(points, triangle), size)
        n_face = (22, 6)[k]*(2 if kind in TETRAHEDRA else 1)
        assert len(np.unique(face)) == n_face
    p = np.array([[0.3, 0.4, 0.2], [5.5, 0.5, 0.5], [3.0, 0.5, 0.5]])
    points, triangle, _ = bodies.triangles(x, 0)
    assert np.allclose(turns(p, points[triangle]), [1, 0, 0])


@pytest.mark.each_value
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("depth", [0.2, 1e-3, 1e-9])
def test_depth_of_a_block_in_a_block(kind, depth):
    """Sides in one plane, turned about two axes."""
    x, bodies = blocks(kind, ((2, 2, 1), (2, 1, 1), (0, 0, 0)), ((1, 2, 1), (1, 1, 1), (0.5, 0, 1 - depth)))
    c, s = math.cos(0.4), math.sin(0.4)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    for place in (np.eye(3), turn):
        found = bodies.overlap(x @ place.T)
        assert set(found.bodies) == {0, 1}
        assert abs(found.depth - depth) <= 64*EPSILON


def test_spheres_overlap_by_what_they_should():
    """From below, and the better the finer they are."""
    for n, least in ((4, 0.06), (8, 0.09)):
        x, triangle = ball(n)
        found = overlap_of_triangles(x, triangle, x + [0, 0, 1.9], triangle)
        assert least < found <= 0.1 + 64*EPSILON
        assert overlap_of_triangles(x, triangle, x + [0, 0, 2.1], triangle) == 0


def test_bars_that_cross_have_no_node_inside():
    x, bodies = blocks("C3D8", ((1, 1, 1), (2, 0.2, 1), (-1, -0.1, 0)), ((1, 1, 1), (0.2, 2, 1), (-0.1, -1, -0.95)))
    assert abs(bodies.overlap(x).depth - 0.05) <= 16*EPSILON
    x[8:] -= [0, 0, 0.06]
    assert bodies.overlap(x).depth == 0


def test_a_ball_through_a_plate_is_seen_on_the_way():
    plate, bodies = blocks("C3D8", ((4, 4, 1), (2, 2, 0.1), (-1, -1, 0)), ((1, 1, 1), (0.2, 0.2, 0.2), (0, 0, 0.2)))
    after = plate.copy()
    after[50:] -= [0, 0, 0.6]
    found = bodies.worst(np.array([plate, after]), [0.0, 1.0])
    assert found.depth > 0.03 and 0 < found.time < 1
    assert "(0." in str(found) and str(found).count(",") == 3
