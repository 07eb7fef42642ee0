"""Shape functions of the cells of result files, and points to integrate over them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import product

import numpy as np

from ..results import Array

#: Corners of the cells in their own coordinates, by dimension and whether they are simplices.
_SIMPLEX = {n: [(0.0,)*n, *(tuple(row) for row in np.eye(n).tolist())] for n in (2, 3)}
_SQUARE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
_CUBE = [(*corner, end) for end in (-1.0, 1.0) for corner in _SQUARE]
#: Between which corners the nodes of quadratic cells lie, as VTK counts them.
_TRIANGLE_EDGES = [(0, 1), (1, 2), (2, 0)]
_TETRAHEDRON_EDGES = [*_TRIANGLE_EDGES, (0, 3), (1, 3), (2, 3)]
_SQUARE_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0)]
_CUBE_EDGES = [*_SQUARE_EDGES, (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
#: Of each type of VTK its corners and the edges with a node in the middle.
_CELLS: dict[int, tuple[Sequence[tuple[float, ...]], Sequence[tuple[int, int]]]] = {
    5: (_SIMPLEX[2], ()), 22: (_SIMPLEX[2], _TRIANGLE_EDGES),
    9: (_SQUARE, ()), 23: (_SQUARE, _SQUARE_EDGES),
    10: (_SIMPLEX[3], ()), 24: (_SIMPLEX[3], _TETRAHEDRON_EDGES),
    12: (_CUBE, ()), 25: (_CUBE, _CUBE_EDGES)}
#: Points along each axis: squares of quadratic functions over straight cells are exact.
_N_POINT = 4


@lru_cache
def points(kind: int) -> tuple[tuple[float, Array, Array], ...]:
    """Weight, values (n_node) and slopes (n_node, n_dim) of the shape functions at each point of a
    cell of the type `kind` of VTK."""
    corner, edges = _CELLS[kind]
    nodes = np.array([*corner, *(0.5*(np.array(corner[i]) + corner[j]) for i, j in edges)])
    n_dim = nodes.shape[1]
    power = _powers(n_dim, len(corner) == n_dim + 1, 2 if edges else 1)
    weights = np.linalg.inv(_monomials(nodes, power))
    found = []
    for weight, place in _places(n_dim, len(corner) == n_dim + 1):
        slopes = np.stack([_monomials(place[None], power, axis)[0] @ weights
                           for axis in range(n_dim)], axis=1)
        found.append((weight, _monomials(place[None], power)[0] @ weights, slopes))
    return tuple(found)


def _powers(n_dim: int, is_simplex: bool, degree: int) -> list[tuple[int, ...]]:
    """Exponents of the monomials: of squares and cubes those of the elements with nodes at edges
    alone, in which powers above the first add up to no more than the degree."""
    every = product(range(degree + 1), repeat=n_dim)
    if is_simplex:
        return [p for p in every if sum(p) <= degree]
    return [p for p in every if sum(a for a in p if a > 1) <= degree]


def _monomials(places: Array, power: Sequence[tuple[int, ...]], axis: int | None = None) -> Array:
    """Values (n_place, n_monomial), or derivatives along an axis."""
    exponent = np.array(power)
    factor = np.ones(len(exponent))
    if axis is not None:
        factor = exponent[:, axis].astype(float)
        exponent = exponent.copy()
        exponent[:, axis] = np.maximum(exponent[:, axis] - 1, 0)
    value: Array = factor*(places[:, None, :]**exponent).prod(axis=2)
    return value


def _places(n_dim: int, is_simplex: bool) -> list[tuple[float, Array]]:
    """Points of Gauss and their weights; of a simplex those of a square or cube that is folded into it."""
    gauss, weight = np.polynomial.legendre.leggauss(_N_POINT)
    found = []
    for rows in product(range(_N_POINT), repeat=n_dim):
        place, share = gauss[list(rows)], float(weight[list(rows)].prod())
        if is_simplex:
            left = 1.0
            place, share = 0.5*(1.0 + place), share/2**n_dim
            for axis in range(n_dim):
                place[axis] *= left
                share *= left
                left -= place[axis]
        found.append((share, place))
    return found
