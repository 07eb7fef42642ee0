"""Meshes cut in four: what is kept, against areas, lengths and what the builders make."""

from __future__ import annotations

import numpy as np
import pytest
from emcon.mesh import Mesh, MeshError, block, disc, refine


def areas(mesh: Mesh) -> float:
    total = 0.0
    for kind in mesh.elements:
        x = mesh.nodes[mesh.connectivity(kind)]
        after = np.roll(x, -1, axis=1)
        total += 0.5*float((x[..., 0]*after[..., 1] - x[..., 1]*after[..., 0]).sum())
    return total


def faces(mesh: Mesh, name: str) -> np.ndarray:
    """Ends of the faces of a surface, (k, 2, 2)."""
    all_faces, ends = mesh.all_faces()
    place = {tuple(face): k for k, face in enumerate(all_faces.tolist())}
    return mesh.nodes[mesh.rows(ends[[place[tuple(f)] for f in mesh.surfaces[name].tolist()]])]


def in_order(x: np.ndarray) -> np.ndarray:
    return x[np.lexsort(np.round(x, 9).T)]


def test_a_block_is_the_block_with_twice_the_cells() -> None:
    fine, built = refine(block(cells=(3, 2))), block(cells=(6, 4))
    assert np.allclose(in_order(fine.nodes), in_order(built.nodes), rtol=0, atol=1e-15)
    for name in built.surfaces:
        middle = [in_order(faces(mesh, name).mean(axis=1)) for mesh in (fine, built)]
        assert np.allclose(*middle, rtol=0, atol=1e-15), name
    for name in built.node_sets:
        nodes = [in_order(m.nodes[m.rows(m.node_sets[name])]) for m in (fine, built)]
        assert np.allclose(*nodes, rtol=0, atol=1e-15), name


@pytest.mark.parametrize("kind", ["C3D4", "C3D8"])
def test_a_box_is_cut_in_eights(kind: str) -> None:
    """Volumes, sides and their faces, nodes of sides: by places alone."""
    size = np.array([3.0, 2.0, 1.0])
    mesh = block((0, 0, 0), size, (2, 1, 1), kind=kind)
    fine, built = refine(mesh, 2), block((0, 0, 0), size, (8, 4, 4), kind=kind)
    assert np.allclose(in_order(fine.nodes), in_order(built.nodes), rtol=0, atol=4e-15)
    x = fine.nodes[fine.rows(fine.elements[kind])]
    edges = x[:, [1, 2, 3] if kind == "C3D4" else [1, 3, 4]] - x[:, :1]
    volume = np.linalg.det(edges)/(6 if kind == "C3D4" else 1)
    assert volume == pytest.approx(np.full(64*len(mesh.elements[kind]), 6.0/len(volume)), rel=1e-12)
    for side, (axis, end) in {"LEFT": (0, 0), "RIGHT": (0, 1), "BOTTOM": (1, 0), "TOP": (1, 1),
                              "BACK": (2, 0), "FRONT": (2, 1)}.items():
        named = fine.surfaces[f"BLOCK_{side}"]
        of, corners = fine.all_faces()
        row = {tuple(face): k for k, face in enumerate(of.tolist())}
        known = corners[[row[tuple(face)] for face in named.tolist()]]
        known = np.where(known > 0, known, known[:, :1])
        at = fine.nodes[fine.rows(known)]
        assert len(named) == 16*len(mesh.surfaces[f"BLOCK_{side}"])
        assert len(np.unique(named, axis=0)) == len(named)
        assert np.allclose(at[..., axis], end*size[axis], rtol=0, atol=1e-15)
        on = fine.nodes[fine.rows(fine.node_sets[f"BLOCK_{side}"])]
        assert len(on) == np.isclose(fine.nodes[:, axis], end*size[axis], rtol=0, atol=1e-9).sum()
        assert np.allclose(on[:, axis], end*size[axis], rtol=0, atol=1e-15)


def triangles() -> Mesh:
    """Two triangles and a square, a loose label in between, all of their sides a surface."""
    mesh = Mesh([[0, 0], [1, 0], [1, 1], [0, 1], [2, 0], [2, 1]],
                {"CPE3": [[10, 20, 30], [10, 30, 40]], "CPE4": [[20, 50, 60, 30]]},
                node_labels=[10, 20, 30, 40, 50, 60],
                element_labels={"CPE3": [5, 9], "CPE4": [7]},
                element_sets={"LEFT": [5, 9], "RIGHT": [7]}, node_sets={"ENDS": [10, 40]})
    mesh.add_surface("RIM", mesh.boundary())
    return mesh


@pytest.mark.parametrize("mesh", [triangles(), disc((0, 1), 1.0, (6, 3), "BALL")],
                         ids=["mixed", "disc"])
@pytest.mark.parametrize("times", [1, 2, 3])
def test_what_is_kept(mesh: Mesh, times: int) -> None:
    fine = refine(mesh, times)
    count = sum(map(len, mesh.elements.values()))
    assert sum(map(len, fine.elements.values())) == count*4**times
    assert areas(fine) == pytest.approx(areas(mesh), rel=1e-14)
    assert len(fine.boundary()) == len(mesh.boundary())*2**times
    # the old nodes are there, with their labels and to the last bit
    assert np.array_equal(fine.nodes[fine.rows(mesh.node_labels)], mesh.nodes)
    for name, members in mesh.element_sets.items():
        assert len(fine.element_sets[name]) == len(members)*4**times
    for name in mesh.surfaces:
        old, new = faces(mesh, name), faces(fine, name)
        free = {tuple(face) for face in fine.boundary().tolist()}
        assert {tuple(face) for face in fine.surfaces[name].tolist()} <= free
        along = [np.sort(np.linalg.norm(np.diff(f, axis=1), axis=2).ravel()) for f in (old, new)]
        assert np.allclose(np.repeat(along[0], 2**times)/2**times, along[1], rtol=1e-13)


def test_a_set_of_ends_gets_the_edge_between_them() -> None:
    fine = refine(triangles())
    assert len(fine.node_sets["ENDS"]) == 3
    assert in_order(fine.nodes[fine.rows(fine.node_sets["ENDS"])]).tolist() == [
        [0.0, 0.0], [0.0, 0.5], [0.0, 1.0]]


def test_labels_can_be_kept_free() -> None:
    mesh = block(cells=(2, 2))
    fine = refine(mesh, above=5000)
    assert set(fine.node_labels.tolist()) - set(mesh.node_labels.tolist()) == set(
        range(5001, 5001 + len(fine.nodes) - len(mesh.nodes)))


def test_not_at_all_and_less() -> None:
    mesh = block(cells=(2, 2))
    assert refine(mesh, 0) is mesh
    with pytest.raises(MeshError, match="0 times or more, not -1"):
        refine(mesh, -1)
