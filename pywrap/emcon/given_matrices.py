"""Matrices and other results of functions of Python, in the forms that the library takes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .csr import Csr
from .errors import InputError, check
from .memory import matrix_bytes

Array = NDArray[np.float64]


def fitting(values: ArrayLike, what: str, shape: tuple[int, ...]) -> Array:
    """What a given function has returned, as an array of the shape that is needed."""
    if values is None:
        raise InputError(f"{what} is None")
    if np.ma.is_masked(values):
        raise InputError(f"{what} has masked entries")
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise InputError(f"{what}: no array can be made of it: {error}") from error
    if array.dtype.kind not in "fiu":
        raise InputError(f"{what} is of dtype {array.dtype}, not real numbers")
    if array.shape != shape:
        raise InputError(f"{what} has the shape {array.shape}, not {shape}")
    return array


_DIRECTIONS = {2: "two", 3: "three"}
_ALL = {2: "both", 3: "all three"}


def give_masses(handle: int, masses: list[Csr]) -> None:
    """Give the sum of masses between nodes to the library model `handle`."""
    if not masses:
        return
    n = masses[0].shape[0]
    keys, place = np.unique(np.concatenate([keys_of(mass) for mass in masses]), return_inverse=True)
    data = np.bincount(place, np.concatenate([mass.data for mass in masses]),
                       len(keys)).astype(float)
    total = masses[0] if len(masses) == 1 else _sorted_csr(n, keys//n, keys % n, data)
    check(handle, _core.emcon_give_mass(handle, matrix_bytes(total)))


def given_mass(matrix: Any, n_node: int, n_dim: int) -> Csr:
    """A mass matrix (n, n) between nodes, or of d dimensions (d n, d n), in all of them the same.

    Raises `InputError` for one that couples the directions, or differs between them.
    """
    shape = tuple(matrix.shape if is_sparse(matrix) else np.shape(matrix))
    n = n_dim*n_node
    if shape not in ((n_node, n_node), (n, n)):
        raise InputError(f"the mass has the shape {shape}; it is between {n_node} nodes, "
                         f"{(n_node, n_node)}, or their freedoms, {(n, n)}")
    mass = as_csr(matrix, shape[0], "the mass")
    check_csr(mass, "the mass")
    if shape[0] == n_node:
        return mass
    row, column = np.divmod(keys_of(mass), n)
    along = [(row % n_dim == a) & (column % n_dim == a) for a in range(n_dim)]
    least = np.finfo(float).eps*np.abs(mass.data).max(initial=0.0)
    if not np.all(np.abs(mass.data[~np.any(along, axis=0)]) <= least):
        raise InputError(f"the mass couples the {_DIRECTIONS[n_dim]} directions; one of nodes is "
                         "needed")
    first, *others = [_sorted_csr(n_node, row[part]//n_dim, column[part]//n_dim, mass.data[part])
                      for part in along]
    for other in others:
        if (not np.array_equal(keys_of(first), keys_of(other))
                or np.any(np.abs(first.data - other.data) > 8*least)):
            raise InputError(f"the mass is not the same in {_ALL[n_dim]} directions; one of nodes "
                             "is needed")
    return first


def is_sparse(matrix: Any) -> bool:
    return isinstance(matrix, Csr) or hasattr(matrix, "tocsr")


def as_csr(matrix: Any, n: int, what: str, n_column: int | None = None) -> Csr:
    """A matrix (n, n_column) of scipy, as a `Csr`, or as an array, with sorted columns; None: n."""
    m = n if n_column is None else n_column
    if not is_sparse(matrix):
        dense = fitting(matrix, what, (n, m))
        return Csr((n, m), np.arange(0, n*m + 1, m, dtype=np.int32),
                   np.tile(np.arange(m, dtype=np.int32), n), np.ravel(dense).astype(float))
    if tuple(matrix.shape) != (n, m):
        raise InputError(f"{what} has the shape {matrix.shape}, not {(n, m)}")
    if not isinstance(matrix, Csr):
        matrix = matrix.tocsr()
        if not matrix.has_canonical_format:
            matrix = matrix.copy()
            matrix.sum_duplicates()
    return Csr((n, m), np.asarray(matrix.indptr, dtype=np.int32),
               np.asarray(matrix.indices, dtype=np.int32),
               fitting(matrix.data, what, np.shape(matrix.indices)).astype(float, copy=False))


def check_csr(matrix: Csr, what: str) -> None:
    """The rows of `matrix` are what a `Csr` promises."""
    (n, n_column), start, column = matrix.shape, matrix.indptr, matrix.indices
    if (start.shape != (n + 1,) or start[0] != 0 or start[-1] != len(column)
            or np.any(np.diff(start) < 0)):
        raise InputError(f"{what}: indptr does not run from 0 to the number of its entries, "
                         f"{len(column)}, in {n} rows")
    if len(column) and (column.min() < 0 or column.max() >= n_column
                        or np.any(np.diff(keys_of(matrix)) <= 0)):
        raise InputError(f"{what}: indices are not columns 0 to {n_column - 1} that ascend in each row")


def keys_of(matrix: Csr) -> NDArray[np.int64]:
    """Row times width plus column of each entry, ascending."""
    return matrix.rows.astype(np.int64)*matrix.shape[1] + matrix.indices


def _sorted_csr(n: int, row: NDArray[np.int64], column: NDArray[np.int64], data: Array) -> Csr:
    """The matrix of entries that ascend by rows and columns."""
    start = np.searchsorted(row, np.arange(n + 1)).astype(np.int32)
    return Csr((n, n), start, column.astype(np.int32), data)


def symmetric_pattern(n: int, row: NDArray[np.int64], column: NDArray[np.int64]) -> Csr:
    """The pattern (n, n) of entries and their mirror images, in any order; no values."""
    keys = np.unique(np.concatenate((row*n + column, column*n + row)))
    return _sorted_csr(n, keys//n, keys % n, np.zeros(len(keys)))
