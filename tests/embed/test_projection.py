"""Pictures of bodies of three dimensions: which faces are outside, and which one covers which."""

import sys

import numpy as np
import pytest
from matplotlib.path import Path as Polygon
from scene_tools import DECKS, ROOT, run_deck

sys.path += [str(ROOT/"pywrap"), str(ROOT/"tests"/"scenes")]

from emcon import FieldFile  # noqa: E402
from emcon.projection import basis, far_first, outer_faces, project  # noqa: E402
from emcon.scene import read_scene  # noqa: E402
from space_mesh import KINDS, QUADRATIC, TETRAHEDRA, Block  # noqa: E402


@pytest.mark.parametrize("kind", KINDS)
def test_outer_faces_close_the_block(kind):
    """As many as the surface has, each a flat polygon; together they have its area."""
    block = Block(kind, (3, 2, 2), size=(3, 2, 2))
    faces, cell = outer_faces([np.array(nodes) - 1 for nodes in block.element])
    squares = 2*(3*2 + 3*2 + 2*2)
    assert len(faces) == squares*(2 if kind in TETRAHEDRA else 1)
    assert {len(face) for face in faces} == {(3 if kind in TETRAHEDRA else 4)
                                             * (2 if kind in QUADRATIC else 1)}
    area = 0.0
    for face, number in zip(faces, cell):
        corner = block.x[face]
        assert set(face) <= set(np.array(block.element[number]) - 1)
        normal = 0.5*np.cross(corner - corner[0], np.roll(corner, -1, 0) - corner[0]).sum(axis=0)
        area += np.linalg.norm(normal)
        # outwards
        assert normal @ (corner.mean(axis=0) - block.x[np.array(block.element[number]) - 1].mean(
            axis=0)) > 0
    assert area == pytest.approx(squares)


def test_what_is_near_is_drawn_last():
    """Of a cube the three faces that the eye sees cover the three others."""
    block = Block("C3D8", (1, 1, 1))
    faces, _ = outer_faces([np.array(block.element[0]) - 1])
    places = project(block.x)
    outward = [np.cross(block.x[f[1]] - block.x[f[0]], block.x[f[2]] - block.x[f[1]])
               for f in faces]
    seen = [normal @ basis()[2] > 0 for normal in outward]
    assert sum(seen) == 3
    assert [seen[k] for k in far_first(faces, *places)] == [False]*3 + [True]*3


@pytest.mark.parametrize("kind", KINDS)
def test_a_body_in_a_body_is_covered(kind):
    """Of a fine block in a coarse one nothing is seen: over each point of its faces an outer face is drawn last."""
    outer = Block(kind, (1, 2, 1), size=(4, 4, 4))
    inner = Block(kind, (4, 3, 4), size=(3.8, 3.8, 3.8), place=lambda x: x + 0.1)
    n = len(outer.x)
    x = np.concatenate([outer.x, inner.x])
    cells = [np.array(nodes) - 1 for nodes in outer.element] + [np.array(nodes) - 1 + n for nodes in inner.element]
    faces, _ = outer_faces(cells)
    seen, near = project(x)
    order = far_first(faces, seen, near)
    assert sorted(order) == list(range(len(faces)))
    place = np.argsort(order)
    is_outer = np.array([face.max() < n for face in faces])
    for number in np.flatnonzero(~is_outer):
        corner = seen[faces[number]]
        for point in (corner.mean(axis=0), *(0.9*corner + 0.1*corner.mean(axis=0))):
            over = [k for k, face in enumerate(faces) if Polygon(seen[face]).contains_point(point)]
            assert is_outer[max(over, key=lambda k: place[k])]


def test_projection_is_a_rotation():
    assert basis() @ basis().T == pytest.approx(np.eye(3), abs=1e-15)
    assert np.linalg.det(basis()) == pytest.approx(1.0)
    up = project(np.array([[0.0, 0.0, 1.0]]))[0][0]
    assert up[0] == 0.0 and up[1] > 0.0


def test_scene_of_a_run(tmp_path):
    """The colours stay with their faces, in whatever order these are drawn."""
    run = run_deck(DECKS/"tumbling_block.inp", tmp_path, t_end=0.4)
    with FieldFile(run.file(".vtkhdf")) as file:
        scene = read_scene(file, [0, 2])
        stress = file["von_mises"][2] if "von_mises" in file.point_fields else None
    assert len(scene.polygons(1)) == len(scene.colours(1)) == 2*(5*3 + 3*2 + 5*2)
    order = scene.order[1]
    for polygon, value, k in zip(scene.polygons(1), scene.colours(1), order):
        assert (polygon == scene.position[1][scene.cells[k]]).all()
        assert value == scene.values[1][k]
    assert stress is None or np.nanmax(scene.values[1]) <= np.nanmax(stress)
