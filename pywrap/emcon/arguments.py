"""Arguments as the library wants them; what it cannot take is an `InputError` that says why."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError

#: What the library has for labels and numbers of things.
_MOST = np.iinfo(np.int32).max


def real_array(value: ArrayLike | None, name: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Finite reals of the given shape, in C order; no copy of what is so already."""
    array = _array(value, name)
    if array.dtype.kind not in "fiu":
        raise InputError(f"{name} is to hold real numbers, not {content(array)}")
    _check_shape(array, name, shape)
    array = np.ascontiguousarray(array, dtype=np.float64).reshape(shape)
    if not np.isfinite(array).all():
        place = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        where = f" at {place}" if place else ""
        raise InputError(f"{name} is not finite{where}: {array[place]}")
    return array


def flag_array(value: ArrayLike, name: str, shape: tuple[int, ...]) -> NDArray[np.int32]:
    """Flags, True or False, as 1 and 0."""
    array = _array(value, name)
    if array.dtype.kind != "b":
        raise InputError(f"{name} is to hold True and False, not {content(array)}")
    _check_shape(array, name, shape)
    return np.ascontiguousarray(array, dtype=np.int32)


def labels(value: ArrayLike, name: str) -> NDArray[np.int32]:
    """Whole numbers, one or a list of them, (n,)."""
    array = np.atleast_1d(_array(value, name))
    if array.dtype.kind not in "iu" and array.size or array.ndim > 1:
        raise InputError(f"{name} is to be a whole number or a list of such, not {value!r:.60}")
    if array.size and (array.min() < 0 or array.max() > _MOST):
        raise InputError(f"{name} is out of range: 0 to {_MOST}")
    return np.ascontiguousarray(array, dtype=np.int32)


def path_bytes(path: str | os.PathLike[str]) -> bytes:
    """The name of a file."""
    name = os.fsencode(path)
    if not name or b"\0" in name:
        raise InputError(f"{path!r} is not the name of a file")
    return name


def number(value: Any, name: str) -> float:
    """A finite real number."""
    return float(real_array(value, name, ()))


def positive(value: Any, name: str) -> float:
    """A finite real number > 0."""
    found = number(value, name)
    if not found > 0.0:
        raise InputError(f"{name} is to be > 0, not {found:g}")
    return found


def _array(value: ArrayLike | None, name: str) -> NDArray[Any]:
    if np.ma.is_masked(value):
        raise InputError(f"{name} has masked entries")
    try:
        return np.asarray(value)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} is no array: {error}") from error


def content(array: NDArray[Any]) -> str:
    """What an array holds, in words."""
    return "text" if array.dtype.kind in "SU" else str(array.dtype)


def _check_shape(array: NDArray[Any], name: str, shape: tuple[int, ...]) -> None:
    if array.shape != shape:
        raise InputError(f"{name} is to have the shape {shape}, not {array.shape}")
