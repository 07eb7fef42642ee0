"""Boxes of hexahedra and tetrahedra."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .checks import MeshError, kind_of, point_of
from .mesh import Mesh

_Index = NDArray[np.int64]

#: Corners of a hexahedron as steps along the axes.
_CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1),
                  (0, 1, 1)])
#: Six tetrahedra around the diagonal from corner 0 to corner 6, of positive volume.
_TETRAHEDRA = np.array([(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6),
                        (0, 5, 1, 6)])
#: Sides by axis and end.
_SIDES = {"LEFT": (0, 0), "RIGHT": (0, 1), "BOTTOM": (1, 0), "TOP": (1, 1), "BACK": (2, 0),
          "FRONT": (2, 1)}


def box(corner: ArrayLike, size: ArrayLike, cells: Sequence[int], name: str, kind: str) -> Mesh:
    """A box of elements of a kind in space; see `emcon.mesh.block`.

    Labels go along z first, then y, then x.
    """
    low, length = point_of(corner, "corner", 3), point_of(size, "size", 3)
    if not (length > 0.0).all():
        raise MeshError(f"size is three finite numbers, above 0, not {size!r}")
    n = np.asarray(cells)
    if n.shape != (3,) or n.dtype.kind not in "iu" or not (n >= 1).all():
        raise MeshError(f"cells are three whole numbers from 1 on, not {cells!r}")
    label = np.arange(1, np.prod(n + 1) + 1).reshape(n + 1)
    place = np.stack(np.meshgrid(*map(np.arange, n + 1), indexing="ij"), axis=-1).reshape(-1, 3)
    start = np.stack(np.meshgrid(*map(np.arange, n), indexing="ij"), axis=-1).reshape(-1, 3)
    at = start[:, None] + _CUBE
    cubes = label[at[..., 0], at[..., 1], at[..., 2]]
    shape = kind_of(kind)
    linear = f"C3D{shape.n_corner}"
    elements = cubes if shape.n_corner == 8 else cubes[:, _TETRAHEDRA].reshape(-1, 4)
    mesh = Mesh(low + length*(place/n), {linear: elements})
    mesh.add_node_set(name, mesh.node_labels)
    mesh.add_element_set(name, mesh.element_labels[linear])
    for side, (axis, end) in _SIDES.items():
        chosen = place[:, axis] == end*n[axis]
        mesh.add_node_set(f"{name}_{side}", mesh.node_labels[chosen])
        mesh.add_surface(f"{name}_{side}", _faces_on(mesh, chosen))
    if kind == linear:
        return mesh
    return mesh.retype({linear: kind})


def _faces_on(mesh: Mesh, chosen: NDArray[np.bool_]) -> _Index:
    """Faces all of whose corners are chosen nodes."""
    faces, corners = mesh.all_faces()
    known = np.where(corners > 0, corners, corners[:, :1])
    found: _Index = faces[chosen[mesh.rows(known)].all(axis=1)]
    return found
