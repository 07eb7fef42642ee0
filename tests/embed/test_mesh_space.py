"""Meshes of all kinds of elements: in space, and quadratic ones; made, changed and read."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT/"pywrap"), str(ROOT/"tests"/"scenes")]

from emcon.mesh import Mesh, MeshError, MeshWarning, block, disc, read, refine, ring  # noqa: E402
from emcon.mesh.kinds import shape_of  # noqa: E402
from emcon.model import Model  # noqa: E402
from space_mesh import (CUBE_EDGES, CUBE_FACES, TETRAHEDRON_EDGES,  # noqa: E402
                        TETRAHEDRON_FACES)

EPS = np.finfo(float).eps
SPACE = ["C3D4", "C3D8", "C3D10", "C3D20", "C3D20R"]
QUADRATIC = ["CPE6", "CPE8", "CPE8R", "CPS8"]
SIZE = np.array([2.0, 3.0, 1.5])
CORNER = np.array([1.0, -2.0, 0.5])


def box(kind: str) -> Mesh:
    return block(CORNER, SIZE, (2, 3, 1), kind=kind)


def mass(mesh: Mesh) -> float:
    """By the engine, of density 1."""
    model = Model.from_mesh(mesh)
    model.material("M", density=1.0, elastic=(1.0, 0.0)).section("M", "BLOCK")
    model.step("DYNAMIC", 0.1, 0.1, direct=True)
    with model.stepper() as stepper:
        assert stepper.n_node == len(mesh.nodes)
        return float((stepper.mass @ np.ones(stepper.n_node)).sum())


@pytest.mark.parametrize("kind", SPACE)
def test_boxes(kind: str) -> None:
    """Sides are where their names say, surfaces have their nodes, and the engine its volume."""
    mesh = box(kind)
    for side, (axis, end) in {"LEFT": (0, 0), "RIGHT": (0, 1), "BOTTOM": (1, 0), "TOP": (1, 1),
                              "BACK": (2, 0), "FRONT": (2, 1)}.items():
        place = CORNER[axis] + end*SIZE[axis]
        there = mesh.node_labels[np.abs(mesh.nodes[:, axis] - place) <= 8*EPS*np.abs(place)]
        assert np.array_equal(mesh.surface_nodes(f"BLOCK_{side}"), np.sort(there))
        assert np.array_equal(np.sort(mesh.node_sets[f"BLOCK_{side}"]), np.sort(there))
    together = np.concatenate(list(mesh.surfaces.values()))
    assert sorted(map(tuple, together.tolist())) == sorted(map(tuple, mesh.boundary().tolist()))
    top = mesh.boundary(lambda x, y, z: y > CORNER[1] + 0.99*SIZE[1])
    assert np.array_equal(top, mesh.surfaces["BLOCK_TOP"])
    assert mass(mesh) == pytest.approx(SIZE.prod(), rel=100*EPS)


@pytest.mark.parametrize(("kind", "edges", "faces"), [
    ("C3D10", TETRAHEDRON_EDGES, TETRAHEDRON_FACES), ("C3D20R", CUBE_EDGES, CUBE_FACES)])
def test_shapes_are_those_of_the_elements(kind: str, edges: list, faces: list) -> None:
    shape = shape_of(kind)
    assert shape is not None and list(shape.edges) == edges and list(shape.faces) == faces


@pytest.mark.parametrize("kind", [*SPACE, *QUADRATIC])
def test_mirror_images_and_turns_are_elements(kind: str) -> None:
    """The same surfaces, at the images of their places; twice is once more the same mesh."""
    mesh = box(kind) if kind in SPACE else block((1, 2), (3, 2), (2, 3), kind=kind)
    n = mesh.n_dim
    point, along = np.arange(1.0, n + 1), np.array([1.0, 2.0, -1.0])[:n]
    image = mesh.mirror(point, along)
    unit = along/np.linalg.norm(along)
    arm = mesh.nodes - point
    sign = 1 if n == 2 else -1
    assert np.allclose(image.nodes, point + sign*(2*np.outer(arm @ unit, unit) - arm))
    for name in mesh.surfaces:
        assert np.array_equal(image.surface_nodes(name), mesh.surface_nodes(name))
    again = image.mirror(point, along)
    assert np.allclose(again.nodes, mesh.nodes)
    assert np.array_equal(again.elements[kind], mesh.elements[kind])
    assert all(np.array_equal(again.surfaces[s], mesh.surfaces[s]) for s in mesh.surfaces)
    if n == 3:
        third = mesh.rotate(2*np.pi/3, axis=(1, 1, 1))
        assert np.allclose(third.nodes, mesh.nodes[:, [2, 0, 1]])
    far = mesh.move(*(10*np.ones(n))).rename({s: f"{s}_2" for s in (
        *mesh.node_sets, *{*mesh.element_sets, *mesh.surfaces} - set(mesh.node_sets))})
    assert len((mesh + far).nodes) == 2*len(mesh.nodes)


@pytest.mark.parametrize("kind", QUADRATIC)
def test_quadratic_shapes_in_the_plane(kind: str) -> None:
    for mesh in (block((0, 0), (2, 1), (3, 2), kind=kind), ring(cells=(12, 2), kind=kind),
                 disc(kind=kind)):
        assert list(mesh.elements) == [kind]
        for name in mesh.surfaces:
            assert np.array_equal(mesh.surface_nodes(name), np.sort(mesh.node_sets[name]))
    assert mass(block((0, 0), (2, 1), (3, 2), kind=kind)) == pytest.approx(2.0, rel=100*EPS)


def test_other_kinds() -> None:
    mesh = block(cells=(2, 1)).retype({"CPE4": "CPE4H"})
    assert list(mesh.elements) == ["CPE4H"] and mesh.surfaces
    for wrong, text in (({"CPE3": "CPE6"}, "no elements of CPE3"), ({"CPE4H": "CPE6"}, "shape"),
                        ({"CPE4H": "C3D8"}, "shape"), ({"CPE4H": "WARP"}, "no kind")):
        with pytest.raises(MeshError, match=text):
            mesh.retype(wrong)
    with pytest.raises(MeshError, match="linear"):
        refine(block(kind="CPE8"))
    with pytest.raises(MeshError, match="linear"):
        refine(block(kind="C3D20"))
    with pytest.raises(MeshError, match="in space"):
        ring(kind="C3D8")


@pytest.mark.parametrize(("order", "text"), [
    ((0, 2, 1, 3), "mirror image"), ((0, 1, 2, 2), "no volume")])
def test_tetrahedra_that_cannot_be(order: tuple[int, ...], text: str) -> None:
    x = np.vstack([np.zeros(3), np.eye(3)])
    with pytest.raises(MeshError, match=text):
        Mesh(x, {"C3D4": [np.array(order) + 1] if len(set(order)) == 4 else [[1, 2, 3, 3]],
                 "C3D10": np.empty((0, 10), int)})


def test_hexahedra_that_cannot_be() -> None:
    mesh = box("C3D8")
    one = mesh.nodes[mesh.connectivity("C3D8")[0]]
    order = np.arange(1, 9)
    with pytest.raises(MeshError, match="mirror image"):
        Mesh(one, {"C3D8": [order[[4, 5, 6, 7, 0, 1, 2, 3]]]})
    with pytest.raises(MeshError, match="folded"):
        Mesh(one, {"C3D8": [order[[0, 1, 2, 3, 5, 4, 6, 7]]]})


@pytest.mark.parametrize("kind", [*SPACE, *QUADRATIC])
def test_abaqus_files_come_back(kind: str, tmp_path: Path) -> None:
    mesh = box(kind) if kind in SPACE else block((1, 2), (3, 2), (2, 3), kind=kind)
    found = read(mesh.write(tmp_path/"a.inp"))
    become = kind if kind in SPACE else f"CPE{shape_of(kind).n_node}"
    assert np.array_equal(found.nodes, mesh.nodes)
    assert np.array_equal(found.elements[become], mesh.elements[kind])
    for name, faces in mesh.surfaces.items():
        assert np.array_equal(found.surfaces[name], faces)


def test_abaqus_elements_that_are_mirror_images(tmp_path: Path) -> None:
    """They are turned, and surfaces follow; shells on them are surfaces."""
    mesh = box("C3D20")
    image = (mesh.nodes*[1, 1, -1], mesh.elements["C3D20"])
    text = Mesh(mesh.nodes, mesh.elements, surfaces=mesh.surfaces).text()
    lines = text.replace("TYPE=C3D20", "TYPE=C3D20RH").splitlines()
    start = lines.index("*NODE") + 1
    for k, x in enumerate(image[0].tolist()):
        lines[start + k] = f"{k + 1}, {x[0]!r}, {x[1]!r}, {x[2]!r}"
    shell = mesh.elements["C3D20"][0][:4]
    lines += ["*ELEMENT, TYPE=S4, ELSET=SKIN", f"900, {', '.join(map(str, shell))}"]
    (tmp_path/"a.inp").write_text("\n".join(lines) + "\n")
    with pytest.warns(MeshWarning, match="mirror images"):
        found = read(tmp_path/"a.inp")
    for name in mesh.surfaces:
        assert np.array_equal(found.surface_nodes(name), mesh.surface_nodes(name))
    assert set(shell) < set(found.surface_nodes("SKIN").tolist())


@pytest.mark.parametrize(("kind", "cell", "side"), [
    ("C3D4", "tetra", "triangle"), ("C3D8", "hexahedron", "quad"),
    ("C3D10", "tetra10", "triangle6"), ("C3D20", "hexahedron20", "quad8")])
def test_files_of_meshio(kind: str, cell: str, side: str, tmp_path: Path) -> None:
    """Cells of a group are a set, those of its outline a surface."""
    meshio = pytest.importorskip("meshio")
    mesh = box(kind)
    shape = shape_of(kind)
    rows = mesh.connectivity(kind)
    at = {int(e): k for k, e in enumerate(mesh.element_labels[kind])}
    top = np.array([rows[at[e]][shape.face_nodes(f - 1)]
                    for e, f in mesh.surfaces["BLOCK_TOP"].tolist()])
    cells = [(cell, rows), (side, top)]
    tags = [np.full(len(rows), 1), np.full(len(top), 2)]
    meshio.Mesh(mesh.nodes, cells, cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
                field_data={"SOLID": np.array([1, 3]), "TOP": np.array([2, 2])}).write(
                    tmp_path/"a.msh", file_format="gmsh22", binary=False)
    found = read(tmp_path/"a.msh")
    assert np.array_equal(found.elements[kind], mesh.elements[kind])
    assert len(found.element_sets["SOLID"]) == len(rows)
    assert sorted(map(tuple, found.surfaces["TOP"].tolist())) == sorted(
        map(tuple, mesh.surfaces["BLOCK_TOP"].tolist()))
    done = subprocess.run([sys.executable, "-m", "emcon", "mesh", tmp_path/"a.msh",
                           tmp_path/"a.inp"], cwd=ROOT/"pywrap", capture_output=True, text=True)
    assert done.returncode == 0 and f"{kind} " in done.stdout and "TOP" in done.stdout
    assert np.array_equal(read(tmp_path/"a.inp").nodes, found.nodes)


def test_supports_hold_all_directions() -> None:
    """A support of a mesh in space holds three displacements where none are named."""
    model = Model.from_mesh(block(kind="C3D8"))
    deck = model.boundary("BLOCK_BACK").deck()
    assert [line for line in deck.splitlines() if line.startswith("BLOCK_BACK, ")] == [
        f"BLOCK_BACK, {dof}, {dof}, 0." for dof in (1, 2, 3)]
