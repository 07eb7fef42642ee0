"""Kinds of elements: corners, nodes between them, faces, and how a mirror image is numbered."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

_Index = NDArray[np.int64]

#: Corners of the faces S1, S2, ... and ends of the edges that have nodes in quadratic elements,
#: by dimensions and corners.
_FACES = {
    (2, 3): ((0, 1), (1, 2), (2, 0)),
    (2, 4): ((0, 1), (1, 2), (2, 3), (3, 0)),
    (3, 4): ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    (3, 8): ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
}
_EDGES = {
    (2, 3): _FACES[2, 3], (2, 4): _FACES[2, 4],
    (3, 4): ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    (3, 8): ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5),
             (2, 6), (3, 7)),
}
#: Corners of the mirror image: the first one stays.
_MIRROR = {(2, 3): (0, 2, 1), (2, 4): (0, 3, 2, 1), (3, 4): (0, 2, 1, 3),
           (3, 8): (0, 3, 2, 1, 4, 7, 6, 5)}
_KIND = re.compile(r"C(PE|PS|AX)(3|4|6|8)[RHI]?|C3D(4|8|10|20)[RHI]?")
#: What meshio calls the cells, and the kind that they become.
CELLS = {"triangle": "CPE3", "quad": "CPE4", "triangle6": "CPE6", "quad8": "CPE8",
         "tetra": "C3D4", "hexahedron": "C3D8", "tetra10": "C3D10", "hexahedron20": "C3D20"}
#: Dimensions and corners of cells that may be sides of elements.
SIDES = {"line": (1, 2), "line3": (1, 2), "triangle": (2, 3), "triangle6": (2, 3), "quad": (2, 4),
         "quad8": (2, 4)}


@dataclass(frozen=True)
class Shape:
    """What elements of a kind look like; nodes and faces are counted from 0."""

    n_dim: int
    n_corner: int
    n_node: int
    faces: tuple[tuple[int, ...], ...]         #: corners of each
    edges: tuple[tuple[int, int], ...]         #: ends of those with a node, in its order

    def face_nodes(self, face: int) -> list[int]:
        """All nodes of a face, the corners first."""
        corners = self.faces[face]
        return [*corners, *(self.n_corner + k for k, ends in enumerate(self.edges)
                            if set(ends) <= set(corners) and self.n_node > self.n_corner)]

    @property
    def mirrored(self) -> list[int]:
        """The nodes in the order of a mirror image."""
        corner = _MIRROR[self.n_dim, self.n_corner]
        if self.n_node == self.n_corner:
            return list(corner)
        place = {frozenset(ends): k for k, ends in enumerate(self.edges)}
        return [*corner, *(self.n_corner + place[frozenset((corner[a], corner[b]))]
                           for a, b in self.edges)]

    @property
    def mirrored_faces(self) -> list[int]:
        """Where each face goes."""
        corner = _MIRROR[self.n_dim, self.n_corner]
        place = {frozenset(corner[c] for c in face): k for k, face in enumerate(self.faces)}
        return [place[frozenset(face)] for face in self.faces]


@lru_cache(maxsize=None)
def shape_of(kind: str) -> Shape | None:
    """The shape of a kind, None for what is none."""
    match = _KIND.fullmatch(kind)
    if not match:
        return None
    n_dim, n = (2, int(match[2])) if match[2] else (3, int(match[3]))
    n_corner = {6: 3, 8: 4}.get(n, n) if n_dim == 2 else {10: 4, 20: 8}.get(n, n)
    return Shape(n_dim, n_corner, n, _FACES[n_dim, n_corner], _EDGES[n_dim, n_corner])


def middles(kind: str, nodes: _Index) -> _Index:
    """Ends (m, k, 2) of the edges of linear elements (m, n) that a quadratic `kind` puts nodes on."""
    shape = shape_of(kind)
    assert shape is not None
    return nodes[:, np.array(shape.edges)]
