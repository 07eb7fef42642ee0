"""Pictures of bodies of three dimensions: which faces are outside, and which one covers which."""

import sys

import numpy as np
import pytest
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
    _, near = project(block.x)
    outward = [np.cross(block.x[f[1]] - block.x[f[0]], block.x[f[2]] - block.x[f[1]])
               for f in faces]
    seen = [normal @ basis()[2] > 0 for normal in outward]
    assert sum(seen) == 3
    assert [seen[k] for k in far_first(faces, near)] == [False]*3 + [True]*3


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
