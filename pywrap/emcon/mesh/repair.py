"""What meshes from files need before they are meshes here: turned elements, names, surfaces."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from .checks import Array, Labels, MeshError, MeshWarning, corner_fault, kind_of, usable_name
from .mesh import Mesh

#: A mesh is plane if its points leave a plane z = const by less than this, over its extent.
_FLATNESS = 1e-9


def warn(text: str) -> None:
    """A `MeshWarning`."""
    warnings.warn(text, MeshWarning, stacklevel=4)


def check_plane(source: str, x: Array) -> None:
    """Raise `MeshError` unless the points x (n, 3) [L] are finite and in a plane z = const."""
    if not np.isfinite(x).all():
        raise MeshError(f"{source}: a coordinate is not finite")
    low, high = x.min(axis=0), x.max(axis=0)
    if high[2] - low[2] > _FLATNESS*(high - low).max():
        raise MeshError(f"{source} is three-dimensional: z goes from {low[2]:g} to {high[2]:g}; "
                        "EMCON takes meshes in a plane z = const")


def turn_clockwise(source: str, x: Array, node_labels: Labels, elements: dict[str, Labels],
                   labels: Mapping[str, Labels]) -> set[int]:
    """Turn clockwise elements, first corner kept, in place; returns their labels, with a warning.

    In space those numbered as their mirror images.

    x            (n, 2) or (n, 3) positions [L]
    node_labels  (n,) ascending
    elements     by kind, (m, k) node labels
    labels       by kind, (m,) element labels
    """
    turned: set[int] = set()
    for kind, nodes in elements.items():
        shape = kind_of(kind)
        wrong = corner_fault(x[np.searchsorted(node_labels, nodes[:, :shape.n_corner])]) == 2
        nodes[wrong] = nodes[wrong][:, shape.mirrored]
        turned |= set(labels[kind][wrong].tolist())
    if turned:
        how = "clockwise" if x.shape[1] == 2 else "as their mirror images"
        warn(f"{source}: {len(turned)} elements are numbered {how}, among them {min(turned)}; "
             "turned")
    return turned


def add_lines(mesh: Mesh, source: str, name: str, ends: Labels) -> None:
    """Add the surface of the element faces on which lines (k, 2), node labels, lie.

    In space faces (k, 4) lie on them, the last corner 0 where there are three.
    """
    faces, corners = mesh.all_faces()
    both = np.sort(np.concatenate([corners, ends]), axis=1)
    number = np.unique(both, axis=0, return_inverse=True)[1].ravel()
    key, wanted = number[:len(corners)], number[len(corners):]
    order = np.argsort(key, kind="stable")
    low, high = (np.searchsorted(key, wanted, side, sorter=order)
                 for side in ("left", "right"))
    if (high - low == 1).all():
        mesh.add_surface(fresh_name(mesh.surfaces, source, name), faces[order[low]])
        return
    why = "between two elements" if (high - low > 1).any() else "on no side of an element"
    what = "line" if mesh.n_dim == 2 else "face"
    warn(f"{source}: a {what} of {name} lies {why}; there is no surface of that name, only the set "
         "of its nodes")


def fresh_name(taken: Mapping[str, Any], source: str, name: str) -> str:
    """`name` as a deck can hold it; raises `MeshError` if another group has got it already."""
    usable = usable_name(name)
    if usable in taken:
        raise MeshError(f"{source}: two groups would have the name {usable}; one is {name!r}")
    return usable
