"""Bodies of three dimensions on paper: their outer faces, seen from one side, the far ones first."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .fields import SOLIDS
from .results import Array

__all__ = ["SOLIDS", "far_first", "is_seen", "outer_faces", "project"]

#: Direction that the bodies are seen from [degrees]: around z from x, and up from there.
AZIMUTH, ELEVATION = -60.0, 25.0

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


def far_first(faces: Sequence[NDArray[np.int64]], near: Array) -> NDArray[np.int64]:
    """Numbers of the faces, the farthest first: what is drawn later covers what is behind."""
    return np.argsort([near[face].mean() for face in faces], kind="stable")


def is_seen(seen: Array, faces: Sequence[NDArray[np.int64]]) -> NDArray[np.bool_]:
    """Per face: its right-hand normal points to the eye; `seen` has places on paper (n, 2)."""
    corner = seen[np.asarray(faces)]
    one, other = corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1]
    return np.asarray(one[:, 0]*other[:, 1] - one[:, 1]*other[:, 0] > 0.0)
