"""Outer faces of cells: closed around the body, seen from outside, and taken by an interface as they are."""

from __future__ import annotations

import re

import numpy as np
import pytest

from emcon.interface import InputError, Interface, outer_faces
from emcon.mesh import block, disc

SIZE = np.array([2.0, 3.0, 1.5])


@pytest.mark.parametrize("kind", ["C3D4", "C3D8", "C3D10", "C3D20"])
def test_faces_in_space_close_around_the_body(kind: str) -> None:
    mesh = block([1.0, -2.0, 0.5], SIZE, (2, 3, 2), kind=kind)
    x, cells = mesh.nodes, mesh.rows(mesh.elements[kind])
    (faces,) = outer_faces(cells)
    n = {"C3D4": 3, "C3D8": 4, "C3D10": 3, "C3D20": 4}[kind]
    assert len(faces) == len(mesh.boundary())
    corner = x[faces[:, :n]]
    area = sum(0.5*np.cross(corner[:, k] - corner[:, 0], corner[:, (k + 1) % n] - corner[:, 0]) for k in range(n))
    np.testing.assert_allclose(area.sum(0), 0.0, rtol=0, atol=1e-14)
    np.testing.assert_allclose(np.abs(area).sum(0), 2*SIZE.prod()/SIZE, rtol=1e-14)
    assert (area*corner.mean(1)).sum()/3 == pytest.approx(SIZE.prod(), rel=1e-13)
    for k in range(faces.shape[1] - n):         # behind the corners: between each and the next
        np.testing.assert_allclose(x[faces[:, n + k]], 0.5*(corner[:, k] + corner[:, (k + 1) % n]), rtol=0, atol=1e-14)
    assert Interface(x).add_faces("skin", faces) == 0


@pytest.mark.parametrize("kind", ["CPE3", "CPE4", "CPE6", "CPE8"])
def test_edges_of_the_plane_have_the_body_to_the_left(kind: str) -> None:
    mesh = disc((0.3, -0.2), 1.5, kind=kind)
    x, cells = mesh.nodes, mesh.rows(mesh.elements[kind])
    (edges,) = outer_faces(cells, n_dim=2)
    assert len(edges) == len(mesh.boundary())*(1 if kind in ("CPE3", "CPE4") else 2)
    a, b = x[edges].swapaxes(0, 1)
    enclosed = 0.5*(a[:, 0]*b[:, 1] - a[:, 1]*b[:, 0]).sum()
    on_circle = np.hypot(*(a - [0.3, -0.2]).T)
    assert on_circle.min() > 0.9*1.5 and 0.9*np.pi*1.5**2 < enclosed < np.pi*1.5**2
    assert set(edges[:, 0]) == set(edges[:, 1])
    assert Interface(x).add_surface("rim", edges) == 0


def test_kinds_of_cells_share_faces_and_bad_cells_are_told() -> None:
    """A triangle on a quadrilateral: the edge between them is not outside."""
    sides = outer_faces([[0, 1, 2, 3]], [[3, 2, 4]], n_dim=2)
    assert [side.tolist() for side in sides] == [[[0, 1], [1, 2], [3, 0]], [[2, 4], [4, 3]]]
    assert outer_faces() == ()
    with pytest.raises(InputError, match=re.escape("m one of 4, 8, 10, 20, not int64 (1, 3)")):
        outer_faces([[0, 1, 2]])
    with pytest.raises(InputError, match="n_dim is 1, not 2 or 3"):
        outer_faces([[0, 1, 2]], n_dim=1)
