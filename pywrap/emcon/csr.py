"""Sparse matrices by rows, as the library hands them over."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError


@dataclass(frozen=True, eq=False)
class Csr:
    """Row i holds `data[k]` in the columns `indices[k]`, ascending, indptr[i] <= k < indptr[i + 1].

    All numbers from 0. ``matrix @ x`` and ``x @ matrix`` multiply with vectors, or with the
    columns or rows of an array; `to_scipy` gives what can do more.
    """

    shape: tuple[int, int]
    indptr: NDArray[np.int32]        #: (n_row + 1)
    indices: NDArray[np.int32]       #: (n_entry)
    data: NDArray[np.float64]        #: (n_entry)

    #: numpy leaves `array @ matrix` to the matrix.
    __array_ufunc__ = None

    @property
    def nnz(self) -> int:
        """Number of entries."""
        return len(self.data)

    @cached_property
    def rows(self) -> NDArray[np.intp]:
        """Row of each entry, (n_entry)."""
        return np.repeat(np.arange(self.shape[0]), np.diff(self.indptr))

    def toarray(self) -> NDArray[np.float64]:
        """The matrix with its zeros, (n_row, n_col)."""
        full = np.zeros(self.shape)
        full[self.rows, self.indices] = self.data
        return full

    def to_scipy(self) -> Any:
        """`scipy.sparse.csr_array` with the same arrays. Raises `ImportError` without scipy."""
        from scipy.sparse import csr_array
        return csr_array((self.data, self.indices, self.indptr), shape=self.shape)

    @property
    def T(self) -> Csr:  # noqa: N802 - as numpy calls it
        """The transposed matrix, a copy."""
        order = np.lexsort((self.rows, self.indices))
        count = np.bincount(self.indices, minlength=self.shape[1])
        start = np.concatenate(([0], np.cumsum(count))).astype(np.int32)
        return Csr(self.shape[::-1], start, self.rows[order].astype(np.int32), self.data[order])

    def __matmul__(self, x: ArrayLike) -> NDArray[np.float64]:
        return _product(self.rows, self.indices, self.data, self.shape[0], self.shape[1],
                        np.asarray(x))

    def __rmatmul__(self, x: ArrayLike) -> NDArray[np.float64]:
        return _product(self.indices, self.rows, self.data, self.shape[1], self.shape[0],
                        np.asarray(x).T).T


def _product(rows: NDArray[Any], columns: NDArray[Any], data: NDArray[np.float64], n_row: int,
             n_col: int, x: NDArray[Any]) -> NDArray[np.float64]:
    if x.dtype.kind not in "fiub" or x.ndim not in (1, 2) or x.shape[0] != n_col:
        raise InputError(f"a matrix with {n_col} columns cannot be multiplied with an array "
                         f"{x.shape} of {x.dtype}")
    products = [np.bincount(rows, data*column[columns], minlength=n_row).astype(np.float64)
                for column in np.atleast_2d(x.T)]
    if x.ndim == 1:
        return products[0]
    return np.stack(products, axis=1) if products else np.zeros((n_row, 0))
