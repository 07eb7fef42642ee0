"""A tie between faces of mixed kinds in space, for hosts in C, C++, Fortran and Python: the same links."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from embed_tools import HERE, build, run

from emcon.interface import Interface

X = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [4, 1, 0], [.5, .5, 0], [1, .5, 0], [.5, 1, 0], [2.5, 1.2, 0]], float)


def links() -> np.ndarray:
    with Interface(X) as face:
        lower = face.add_faces("below", [[0, 1, 2, 3]], [[1, 4, 2]])
        face.add_tie(face.add_faces("above", [[5, 7, 6], [6, 7, 8]]), lower)
        face.prepare()
        return face.links().toarray()


@pytest.mark.parametrize(("compiler", "options"), [
    ("cc", ("-std=c99",)), ("c++", ("-x", "c++", "-std=c++11")), ("gfortran", ("-std=f2008",))])
def test_links(compiler: str, options: tuple[str, ...], installed: dict[str, str], tmp_path: Path) -> None:
    source = HERE/("tie_in_space.f90" if compiler == "gfortran" else "tie_in_space.c")
    build(compiler, source, tmp_path/"tie", installed, *options)
    rows = [line.split() for line in run(tmp_path/"tie", env=installed).splitlines()]
    expected = links()
    found = np.zeros_like(expected)
    for i, k, value in (row for row in rows if len(row) == 3):
        found[int(i), int(k)] = float(value)
    np.testing.assert_array_equal(found, expected)
    moved = np.array([float(row[0]) for row in rows if len(row) == 1])
    # A constant gradient of the master is that of the slave: here the tie is flat.
    np.testing.assert_allclose(moved.reshape(-1, 3), np.roll(X, -1, axis=1)[5:] - 2*X[5:], rtol=0, atol=1e-14)


def test_links_of_a_flat_tie() -> None:
    """Slave nodes follow by weights that sum up to 1 and give their places back; others are unknowns."""
    matrix = links()
    assert matrix.shape == (27, 15)
    np.testing.assert_array_equal(matrix[:15], np.eye(15))
    np.testing.assert_allclose(matrix[15:] @ X[:5].ravel(), X[5:].ravel(), rtol=0, atol=1e-14)
    np.testing.assert_allclose(matrix[15:].sum(1), 1.0, rtol=0, atol=1e-14)
