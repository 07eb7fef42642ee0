"""What every mesh is checked for: finite positions, labels, names, the shape of elements."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .kinds import Shape, shape_of

Array = NDArray[np.float64]
Labels = NDArray[np.int64]

LARGEST_LABEL = 2**31 - 1
#: Least cross product of the edges at a corner, for edges of length 1; that of the deck's reader.
LEAST_CORNER = 1e-10

_NAME = re.compile(r"[A-Z_][A-Z0-9_.:+-]{0,79}")


class MeshError(ValueError):
    """A mesh that cannot be: the text says what is wrong and where."""


class MeshWarning(UserWarning):
    """Something of a mesh was changed or left out."""


#: What the faults of `corner_fault` are, in the plane and in space.
FAULTS = {2: ("has no area", "is numbered clockwise",
              "is folded: the angle at a corner is 180 degrees or more"),
          3: ("has no volume", "is numbered as its mirror image",
              "is folded: the edges at a corner span no volume, or one of the other sign")}


def kind_of(kind: str) -> Shape:
    """The shape of a kind of elements; raises `MeshError` for what is none."""
    shape = shape_of(kind)
    if shape is None:
        raise MeshError(f"{kind!r} is no kind of element; known are CPE3, CPE4, CPE6, CPE8, C3D4, "
                        "C3D8, C3D10, C3D20, and those of the same shapes")
    return shape


def corner_fault(x: Array) -> NDArray[np.int64]:
    """Faults of elements from their corners x (m, k, d): 0 none, 1 no area, 2 clockwise, 3 folded.

    Products of the edges at the corners are judged as the reader of decks does; in three dimensions
    no volume, mirrored, folded.
    """
    largest = np.abs(x).max(axis=(1, 2), initial=0.0)
    x = x/np.where(largest > 0.0, np.exp2(np.floor(np.log2(np.maximum(largest, 1e-300)))),
                   1.0)[:, None, None]
    longest = np.ptp(x, axis=1).max(axis=1)
    x = x/np.where(longest > 0.0, longest, 1.0)[:, None, None]
    if x.shape[2] == 3:
        corner = _corner_volumes(x)
    else:
        edge = np.roll(x, -1, axis=1) - x
        before = np.roll(edge, 1, axis=1)
        corner = before[..., 0]*edge[..., 1] - before[..., 1]*edge[..., 0]
    return np.select([np.abs(corner.sum(axis=1)) <= LEAST_CORNER, (corner < 0.0).all(axis=1),
                      (corner <= LEAST_CORNER).any(axis=1)], [1, 2, 3], 0)


def _corner_volumes(x: Array) -> Array:
    """Products of the three edges at the corners of tetrahedra (m, 4, 3), hexahedra (m, 8, 3)."""
    if x.shape[1] == 4:
        corner, ends = [0], [(1, 2, 3)]
    else:
        corner = list(range(8))
        ends = [(k//4*4 + (k + 1) % 4, k//4*4 + (k + 3) % 4, (k + 4) % 8) for k in range(4)]
        ends += [(4 + (k + 3) % 4, 4 + (k + 1) % 4, k) for k in range(4)]
    volumes: Array = np.linalg.det(x[:, ends] - x[:, corner, None])
    return volumes


def usable_name(text: str) -> str:
    """`text` as a name of a set: capitals, other signs than letters, digits, `_.:+-` as `_`."""
    name = re.sub(r"[^A-Z0-9_.:+-]+", "_", text.strip().upper())[:80]
    return name if _NAME.fullmatch(name) else f"_{name}"[:80]


def checked_name(name: str) -> str:
    capital = name.upper()
    if not _NAME.fullmatch(capital):
        raise MeshError(f"{name!r} cannot be the name of a set or surface: up to 80 letters, "
                        "digits and _ . : + -, not beginning with a digit")
    return capital


def positions(nodes: ArrayLike) -> Array:
    array = np.array(nodes, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] not in (2, 3):
        raise MeshError(f"nodes are an (n, 2) or (n, 3) array of positions, not {array.shape}")
    if not np.isfinite(array).all():
        row = int(np.argmin(np.isfinite(array).all(axis=1)))
        raise MeshError(f"nodes[{row}] is not finite: {array[row]}")
    array.setflags(write=False)
    return array


def point_of(value: ArrayLike, what: str, n_dim: int = 2) -> Array:
    point = np.asarray(value, dtype=np.float64)
    if point.shape != (n_dim,) or not np.isfinite(point).all():
        raise MeshError(f"{what} is {'a pair' if n_dim == 2 else 'three'} of finite numbers, not "
                        f"{value!r}")
    return point


def label_array(values: ArrayLike, what: str, shape: tuple[int | None, ...]) -> Labels:
    """A read-only copy of whole numbers from 1 on, of the given shape."""
    array = np.asarray(values)
    if not array.size:
        array = array.reshape([n or 0 for n in shape]) if None in shape else array
        array = array.astype(np.int64)
    if not array.size and shape[0] is None and not what.startswith("elements"):
        raise MeshError(f"{what} has no members")
    fits = array.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, array.shape))
    if not fits:
        wanted = ", ".join("k" if n is None else str(n) for n in shape)
        raise MeshError(f"{what}: an array of shape ({wanted}) is wanted, not {array.shape}")
    if array.dtype.kind not in "iu":
        raise MeshError(f"{what}: labels are whole numbers, not {array.dtype}")
    if array.size and not (array.min() >= 1 and array.max() <= LARGEST_LABEL):
        raise MeshError(f"{what}: labels are from 1 to {LARGEST_LABEL}; there is "
                        f"{array.min() if array.min() < 1 else array.max()}")
    array = array.astype(np.int64)
    array.setflags(write=False)
    return array


def refuse_twice(labels: Labels, what: str) -> None:
    values, count = np.unique(labels, return_counts=True)
    if (count > 1).any():
        raise MeshError(f"{what} {values[count > 1][0]} is there twice")


def places(known: Labels, order: NDArray[np.int64], labels: ArrayLike,
          what: str) -> NDArray[np.int64]:
    """Places of `labels` in `known`; `order` sorts `known`."""
    wanted = np.asarray(labels, dtype=np.int64)
    place = np.searchsorted(known, wanted, sorter=order)
    found = order[np.minimum(place, len(known) - 1)]
    missing = known[found] != wanted
    if missing.any():
        raise MeshError(f"there is no {what} {wanted[missing].flat[0]}")
    return found
