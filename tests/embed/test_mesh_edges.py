"""The boundary of cells of another code: which edges, which way round; cells that are none."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]/"pywrap"))

from emcon.mesh import MeshError, block, boundary_edges, ring  # noqa: E402


def rows(mesh: Any) -> tuple[np.ndarray, np.ndarray]:
    """Positions, and corners as rows of them."""
    (kind,) = mesh.elements
    place = {label: i for i, label in enumerate(mesh.node_labels.tolist())}
    return mesh.nodes, np.vectorize(place.get)(mesh.elements[kind])


def enclosed(nodes: np.ndarray, edges: np.ndarray) -> float:
    """The area to the left of closed lines of edges."""
    first, last = nodes[edges[:, 0]], nodes[edges[:, 1]]
    return 0.5*float((first[:, 0]*last[:, 1] - first[:, 1]*last[:, 0]).sum())


def mixed(cells: np.ndarray) -> np.ndarray:
    """Every other cell the other way round, and begun at another corner."""
    cells = np.roll(cells, 1, axis=1)
    return np.where(np.arange(len(cells))[:, None] % 2, cells[:, ::-1], cells)


@pytest.mark.parametrize("turn", [lambda cells: cells, lambda cells: cells[:, ::-1], mixed])
@pytest.mark.parametrize("is_split", [False, True])
def test_body_is_to_the_left_whatever_the_cells_do(turn: Any, is_split: bool) -> None:
    nodes, cells = rows(block((0.0, 0.0), (3.0, 2.0), (3, 2)))
    if is_split:
        cells = np.vstack((cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]))
    edges = boundary_edges(nodes, turn(cells))
    assert edges.shape == (10, 2)
    assert abs(enclosed(nodes, edges) - 6.0) < 1e-14
    assert sorted(edges[:, 0]) == sorted(edges[:, 1])       # closed


def test_holes_are_gone_round_the_other_way() -> None:
    nodes, cells = rows(ring((0.0, 0.0), (1.0, 2.0), (40, 3)))
    edges = boundary_edges(nodes, mixed(cells))
    inner = np.hypot(*nodes[edges[:, 0]].T) < 1.5
    assert inner.sum() == (~inner).sum() == 40
    assert enclosed(nodes, edges[inner]) < 0.0 < enclosed(nodes, edges[~inner])


def test_bodies_that_touch_are_apart_unless_they_share_nodes() -> None:
    nodes = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [2, 0], [2, 1], [1, 0], [1, 1]], float)
    assert len(boundary_edges(nodes, [[0, 1, 2, 3], [6, 4, 5, 7]])) == 8
    assert len(boundary_edges(nodes, [[0, 1, 2, 3], [1, 4, 5, 2]])) == 6


def test_quadrilaterals_may_be_triangles() -> None:
    nodes = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    edges = boundary_edges(nodes, [[0, 1, 2, 2], [3, 2, 0, 0]])
    assert sorted(edges.tolist()) == [[0, 1], [1, 2], [2, 3], [3, 0]]
    assert enclosed(nodes, edges) == 1.0


def test_no_cells_have_no_boundary() -> None:
    assert boundary_edges(np.zeros((3, 2)), np.zeros((0, 4), int)).shape == (0, 2)


def test_far_from_the_origin_and_at_any_scale() -> None:
    nodes, cells = rows(block((0.0, 0.0), (3.0, 2.0), (3, 2)))
    expected = boundary_edges(nodes, cells).tolist()
    for scale, shift in ((1e-200, 0.0), (1e200, 0.0), (1.0, 1e8)):
        assert boundary_edges(nodes*scale + shift, mixed(cells)).shape == (10, 2)
        assert boundary_edges(nodes*scale + shift, cells).tolist() == expected


@pytest.mark.parametrize(("cells", "message"), [
    ([[0, 1, 2, 7]], "there is no node 7; rows of nodes are 0 to 4"),
    ([[0, 1, -1]], "there is no node -1"),
    ([[0.0, 1.0, 2.0]], "whole numbers, not float64"),
    ([0, 1, 2], r"an \(m, 3\) or \(m, 4\) array"),
    ([[0, 1]], r"not \(1, 2\)"),
    ([[0, 1, 2], [0, 1, 4]], r"cells\[1\] has no area"),
    ([[0, 1, 1]], r"cells\[0\] has no area"),
    ([[0, 1, 2], [1, 0, 3]], "two cells lie on the same side of the edge between the nodes 0 and "
                             "1"),
    ([[0, 1, 2], [0, 1, 2]], "same side"),
])
def test_cells_that_are_none_are_refused(cells: Any, message: str) -> None:
    nodes = [[0, 0], [1, 0], [1, 1], [0, 1], [2, 0]]
    with pytest.raises(MeshError, match=message):
        boundary_edges(nodes, cells)


def test_no_mesh_of_the_plane_and_of_space() -> None:
    with pytest.raises(MeshError, match="2 dimensions and one of 3"):
        block() + block((0.0,)*3, (1.0,)*3, (1,)*3, "CUBE", kind="C3D8")
