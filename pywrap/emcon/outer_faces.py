"""The outer faces of cells, as surfaces of `emcon.interface`."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError
from .mesh.kinds import Shape, shape_of

Ints = NDArray[np.int64]

_KINDS = {2: {3: "CPE3", 4: "CPE4", 6: "CPE6", 8: "CPE8"}, 3: {4: "C3D4", 8: "C3D8", 10: "C3D10", 20: "C3D20"}}


def outer_faces(*cells: ArrayLike, n_dim: int = 3) -> tuple[Ints, ...]:
    """The faces that belong to one cell only, for `Interface.add_faces`.

    `cells`: nodes of cells, (k, m) integers, one array for each kind: in space (`n_dim` 3)
    tetrahedra of 4 or 10 nodes, hexahedra of 8 or 20; in the plane triangles of 3 or 6,
    quadrilaterals of 4 or 8. Nodes are numbered as VTK, Abaqus and Gmsh's linear cells have them,
    corners first. Returns one array of faces for each array of cells, (k, m) integers, outside
    counter-clockwise; in the plane edges, (k, 2), the body to the left, two for each side with a
    node in its middle. Raises `InputError` for cells of other kinds.
    """
    kinds = _KINDS.get(n_dim)
    if kinds is None:
        raise InputError(f"n_dim is {n_dim!r}, not 2 or 3")
    parts, corners = [], []
    for array in map(np.asarray, cells):
        if array.ndim != 2 or array.shape[1] not in kinds or array.dtype.kind not in "iu":
            raise InputError(f"cells are to be integers (k, m), m one of {', '.join(map(str, kinds))}, "
                             f"not {array.dtype} {array.shape}")
        shape = shape_of(kinds[array.shape[1]])
        assert shape is not None
        sides = [_outward(shape, face) for face in range(len(shape.faces))]
        parts.append(array[:, sides])
        ends = np.sort(parts[-1][..., :len(shape.faces[0])], axis=-1).reshape(-1, len(shape.faces[0]))
        # A column more makes triangles and quadrilaterals comparable.
        corners.append(np.pad(ends, ((0, 0), (0, 4 - ends.shape[1])), constant_values=-1))
    if not parts:
        return ()
    _, which, count = np.unique(np.concatenate(corners), axis=0, return_inverse=True, return_counts=True)
    is_outer = np.split(count[which.ravel()] == 1, np.cumsum([len(own) for own in corners])[:-1])
    return tuple(_as_edges(part.reshape(-1, part.shape[2])[mask], n_dim)
                 for part, mask in zip(parts, is_outer, strict=True))


def _outward(shape: Shape, face: int) -> list[int]:
    """Nodes of a face, counter-clockwise as seen from outside: corners, then those between."""
    corner = list(shape.faces[face])
    if shape.n_dim == 3:
        corner.reverse()
    if shape.n_node == shape.n_corner:
        return corner
    place = {frozenset(ends): shape.n_corner + k for k, ends in enumerate(shape.edges)}
    following = corner[1:] + corner[:1] if shape.n_dim == 3 else corner[1:]
    return corner + [place[frozenset(pair)] for pair in zip(corner, following)]


def _as_edges(faces: Ints, n_dim: int) -> Ints:
    """Sides of the plane with a node in the middle as two edges."""
    if n_dim == 3 or faces.shape[1] == 2:
        return faces
    return faces[:, [0, 2, 2, 1]].reshape(-1, 2)
