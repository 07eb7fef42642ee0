"""Structures, matrices and texts in the memory of the library, as Python sees and copies them."""

from __future__ import annotations

import ctypes
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from .csr import Csr

_TYPES: dict[str, np.dtype[Any]] = {}
for _name, _parts in json.loads(_core.STRUCTURES).items():
    _TYPES[_name] = np.dtype([(part, _TYPES.get(kind, kind)) for part, kind in _parts], align=True)


class _Memory:
    """An array of the library, as numpy finds it: no copy, and no type made for each size."""

    def __init__(self, address: int, kind: str, shape: tuple[int, ...]) -> None:
        self.__array_interface__ = {"version": 3, "typestr": kind, "data": (address, False),
                                    "shape": shape}


_REAL, _WHOLE = np.dtype(np.float64).str, np.dtype(np.int32).str


def reals(address: int, *shape: int) -> NDArray[np.float64]:
    """The array of the library at `address`; not to be used after its model has changed."""
    return np.asarray(_Memory(address, _REAL, shape))


def copied(address: int, n: int, kind: str = _REAL) -> NDArray[Any]:
    """A copy of the `n` numbers at `address`, which may be 0 where there are none."""
    if n == 0:
        return np.empty(0, kind)
    return np.array(_Memory(int(address), kind, (n,)))


def whole(address: int, n: int) -> NDArray[np.int32]:
    """The same of whole numbers."""
    return copied(address, n, _WHOLE)


def text(address: int) -> str:
    """The text at `address`."""
    return ctypes.string_at(address).decode("utf-8", "replace").rstrip()


def structures(name: str, data: NDArray[np.int8]) -> NDArray[Any]:
    """The bytes of structures of the header as an array with their components."""
    return data.view(_TYPES[name])


def structure(name: str, data: NDArray[np.int8]) -> dict[str, Any]:
    """The components of one, as numbers of Python; those of a structure in it as it stands."""
    kind = _TYPES[name]
    return dict(zip(kind.names or (), structures(name, data)[0].item()))


def made(name: str, *values: Any) -> NDArray[np.int8]:
    """The bytes of a structure with these components, in their order."""
    return np.array([values], _TYPES[name]).view(np.int8)


def csr(parts: Any) -> Csr:
    """A copy of the matrix whose emcon_csr has these components, in their order."""
    n_row, n_column, start, column, value = parts
    indptr = whole(start, n_row + 1) if start else np.zeros(n_row + 1, np.int32)
    n = int(indptr[-1])
    return Csr((n_row, n_column), indptr, whole(column, n), copied(value, n))


def matrix(data: NDArray[np.int8]) -> Csr:
    """The same of the bytes of an emcon_csr."""
    return csr(structure("emcon_csr", data).values())


def matrix_bytes(matrix: Csr) -> NDArray[np.int8]:
    """An emcon_csr of a matrix with whole numbers of 32 bits, which has to outlive it."""
    return made("emcon_csr", *matrix.shape, *(part.ctypes.data for part in (
        matrix.indptr, matrix.indices, matrix.data)))
