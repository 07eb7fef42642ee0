"""Bodies of three dimensions on paper: their outer faces, seen from one side, the far ones first."""

from __future__ import annotations

import heapq
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .fields import SOLIDS
from .results import Array

__all__ = ["SOLIDS", "far_first", "is_seen", "outer_faces", "project"]

#: Direction that the bodies are seen from [degrees]: around z from x, and up from there.
AZIMUTH, ELEVATION = -60.0, 25.0

#: A plane whose normal makes a smaller cosine with the direction of view is seen from its edge; a
#: corner within this part of the size of a face is in its plane.
LEAST_VIEW, LEAST_DEPTH = 1e-3, 1e-3
#: Faces whose neighbours on paper are looked for at a time.
BATCH = 1000

#: Faces of a cell by its corners, as VTK counts them, of tetrahedra (4) and hexahedra (8).
_FACES = {4: ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
          8: ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))}
#: Corners of a cell by its nodes, and between which corners the others lie.
_CORNERS = {4: 4, 8: 8, 10: 4, 20: 8}
_MIDDLES = {10: ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
            20: ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5),
                 (2, 6), (3, 7))}


def outer_faces(cells: Sequence[NDArray[np.int64]]) -> tuple[list[NDArray[np.int64]],
                                                            NDArray[np.int64]]:
    """Faces that one cell alone has: nodes along the outline of each, and the cell of each."""
    found: dict[tuple[int, ...], tuple[NDArray[np.int64], int] | None] = {}
    for number, cell in enumerate(cells):
        middle = {frozenset(ends): _CORNERS[len(cell)] + k
                  for k, ends in enumerate(_MIDDLES.get(len(cell), ()))}
        for face in _FACES[_CORNERS[len(cell)]]:
            key = tuple(sorted(int(cell[k]) for k in face))
            if key in found:
                found[key] = None
                continue
            outline = []
            for k, following in zip(face, face[1:] + face[:1]):
                outline.append(k)
                if middle:
                    outline.append(middle[frozenset((k, following))])
            found[key] = cell[outline], number
    kept = [entry for entry in found.values() if entry is not None]
    return [outline for outline, _ in kept], np.array([number for _, number in kept])


def basis() -> Array:
    """Unit vectors to the right, up and to the eye, as rows (3, 3)."""
    a, e = np.radians([AZIMUTH, ELEVATION])
    return np.array([[-np.sin(a), np.cos(a), 0.0],
                     [-np.sin(e)*np.cos(a), -np.sin(e)*np.sin(a), np.cos(e)],
                     [np.cos(e)*np.cos(a), np.cos(e)*np.sin(a), np.sin(e)]])


def project(points: Array) -> tuple[Array, Array]:
    """Places on paper (n, 2) and how near they are (n) [L], of points (n, 3)."""
    seen = points @ basis().T
    return seen[:, :2], seen[:, 2]


def far_first(faces: Sequence[NDArray[np.int64]], seen: Array, near: Array) -> NDArray[np.int64]:
    """Numbers of the faces, the farthest first: what is drawn later covers what is behind.

    seen, near      places on paper (n, 2) and how near they are (n), of all points
    By the nearness of their middles, but for faces that meet on paper: there one that lies behind
    the plane of the other is drawn before it, however their middles lie. Where that goes in a
    circle middles decide.
    """
    if not len(faces):
        return np.zeros(0, dtype=np.int64)
    middle = np.array([near[face].mean() for face in faces])
    behind, before = _covers(faces, seen, near)
    after: list[list[int]] = [[] for _ in faces]
    waits = np.bincount(before, minlength=len(faces))
    for one, other in zip(behind.tolist(), before.tolist(), strict=True):
        after[one].append(other)
    ready = [(depth, k) for k, depth in enumerate(middle.tolist()) if not waits[k]]
    rest = iter(np.argsort(middle, kind="stable").tolist())
    heapq.heapify(ready)
    is_drawn = np.zeros(len(faces), dtype=bool)
    order: list[int] = []
    while len(order) < len(faces):
        k = heapq.heappop(ready)[1] if ready else next(rest)
        if is_drawn[k]:
            continue
        is_drawn[k] = True
        order.append(k)
        for other in after[k]:
            waits[other] -= 1
            if not waits[other] and not is_drawn[other]:
                heapq.heappush(ready, (middle[other], other))
    return np.array(order)


def _covers(faces: Sequence[NDArray[np.int64]], seen: Array,
            near: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of faces that may meet on paper, of which the first lies behind the plane of the second
    or the second in front of that of the first."""
    corner = np.array([face[[0, len(face)//_sides(face), 2*len(face)//_sides(face), -1]]
                       if _sides(face) == 3 else face[::len(face)//4] for face in faces])
    place = np.concatenate([seen[corner], near[corner][..., None]], axis=2)
    one, other = _meeting(place[..., :2].min(axis=1), place[..., :2].max(axis=1))
    normal = np.cross(place[:, 2] - place[:, 0], place[:, 3] - place[:, 1])
    size = np.linalg.norm(normal, axis=1)
    # Planes that stand on their edges say nothing; the others look at the eye.
    is_plane = np.abs(normal[:, 2]) > LEAST_VIEW*size
    normal *= np.sign(normal[:, 2:])
    middle = place.mean(axis=1)
    slack = LEAST_DEPTH*size**1.5

    def heights(of: NDArray[np.int64], over: NDArray[np.int64]) -> Array:
        heights: Array = np.einsum("nkd,nd->nk", place[of] - middle[over][:, None], normal[over])
        return heights

    pairs = []
    for a, b in ((one, other), (other, one)):
        is_behind = is_plane[b] & (heights(a, b) < slack[b][:, None]).all(axis=1)
        is_covered = is_plane[a] & (heights(b, a) > -slack[a][:, None]).all(axis=1)
        pairs.append((is_behind, is_covered))
    first = (pairs[0][0] | pairs[0][1]) & ~(pairs[1][0] | pairs[1][1])
    second = (pairs[1][0] | pairs[1][1]) & ~(pairs[0][0] | pairs[0][1])
    return (np.concatenate([one[first], other[second]]), np.concatenate([other[first], one[second]]))


def _sides(face: NDArray[np.int64]) -> int:
    return 3 if len(face) in {3, 6} else 4


def _meeting(low: Array, high: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of boxes on paper (n, 2) that overlap, each once."""
    order = np.argsort(low[:, 0], kind="stable")
    low, high = low[order], high[order]
    last = np.searchsorted(low[:, 0], high[:, 0])
    count = last - np.arange(len(low)) - 1
    one, other = [], []
    # Not all pairs at once: a wide picture of many faces would need much memory.
    for begin in range(0, len(low), BATCH):
        some = count[begin:begin + BATCH]
        a = np.repeat(np.arange(begin, begin + len(some)), some)
        b = a + 1 + np.arange(len(a)) - np.repeat(np.cumsum(some) - some, some)
        meets = (low[a, 1] < high[b, 1]) & (low[b, 1] < high[a, 1])
        one.append(a[meets])
        other.append(b[meets])
    return order[np.concatenate(one)], order[np.concatenate(other)]


def is_seen(seen: Array, faces: Sequence[NDArray[np.int64]]) -> NDArray[np.bool_]:
    """Per face: its right-hand normal points to the eye; `seen` has places on paper (n, 2)."""
    corner = seen[np.asarray(faces)]
    one, other = corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1]
    return np.asarray(one[:, 0]*other[:, 1] - one[:, 1]*other[:, 0] > 0.0)
