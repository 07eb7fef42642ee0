"""Finer meshes: each element in four, sets and surfaces kept."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .checks import Labels, MeshError, kind_of
from .mesh import Mesh


def refine(mesh: Mesh, times: int = 1, *, above: int = 0) -> Mesh:
    """`mesh` with each element cut in four, `times` times.

    times   how often, 0 for elements in space and quadratic ones; the edges become 2**times times as short
    above   labels of new nodes are larger than this, and than those of `mesh`

    Old nodes keep their labels, and an element set holds all parts of its elements. A new node, in
    the middle of an edge or of a quadrilateral, belongs to a node set if all nodes that it is the
    mean of do. A face of a surface becomes two. New nodes lie on the straight edges of `mesh`: a
    curved boundary stays the polygon that it was, also where its nodes lie on a curve.
    """
    wrong = [kind for kind in mesh.elements
             if kind_of(kind).n_dim != 2 or kind_of(kind).n_node > kind_of(kind).n_corner]
    if wrong and times > 0:
        raise MeshError(f"linear elements in the plane are cut in four, none of {wrong[0]}")
    if times < 0:
        raise MeshError(f"a mesh is refined 0 times or more, not {times}")
    for _ in range(times):
        mesh = _refined(mesh, above)
    return mesh


def _refined(mesh: Mesh, above: int) -> Mesh:
    parents, new = _new_nodes(mesh, above)
    rows = mesh.rows(parents)
    labels = np.concatenate([mesh.node_labels, new])
    nodes = np.concatenate([mesh.nodes, mesh.nodes[rows].mean(axis=1)])
    elements: dict[str, Labels] = {}
    numbers: dict[str, Labels] = {}
    top = max(int(label.max()) for label in mesh.element_labels.values())
    parts: dict[int, Labels] = {}
    for kind, corners in mesh.elements.items():
        elements[kind] = _parts(kind, corners, parents, new)
        old = mesh.element_labels[kind]
        fresh = top + 1 + np.arange(3*len(old)).reshape(-1, 3)
        top += fresh.size
        of_old = np.column_stack([old, fresh])
        numbers[kind] = of_old.ravel()
        parts.update(zip(old.tolist(), of_old))
    return Mesh(
        nodes, elements, node_labels=labels, element_labels=numbers,
        node_sets={name: np.concatenate([members, new[np.isin(parents, members).all(axis=1)]])
                   for name, members in mesh.node_sets.items()},
        element_sets={name: np.concatenate([parts[e] for e in members.tolist()])
                      if len(members) else members
                      for name, members in mesh.element_sets.items()},
        surfaces={name: _faces(mesh, faces, parts) for name, faces in mesh.surfaces.items()})


def _new_nodes(mesh: Mesh, above: int) -> tuple[Labels, Labels]:
    """The four old nodes that each new one is the mean of, (n, 4), and its label, (n).

    The middle of an edge has both ends twice; columns ascend.
    """
    means = []
    for kind, corners in mesh.elements.items():
        ends = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2)
        means.append(np.repeat(ends, 2, axis=1))
        if kind_of(kind).n_corner == 4:
            means.append(corners)
    parents: Labels = np.unique(np.sort(np.concatenate(means), axis=1), axis=0)
    first = max(int(mesh.node_labels.max()), above) + 1
    return parents, np.arange(first, first + len(parents))


def _parts(kind: str, corners: Labels, parents: Labels, new: Labels) -> Labels:
    """Nodes of the four parts of each element, (4 n_element, n_corner).

    Part i holds corner i at its own corner i, so that faces keep their numbers; a triangle has its
    inner one last.
    """
    n = kind_of(kind).n_corner
    middle = _label(np.repeat(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2), 2, axis=2),
                    parents, new)
    parts = np.empty((len(corners), 4, n), dtype=np.int64)
    if n == 4:
        parts[:] = _label(corners, parents, new)[:, None, None]
    else:
        parts[:, 3] = middle
    for i in range(n):
        parts[:, i, i] = corners[:, i]
        parts[:, i, (i + 1) % n] = middle[:, i]
        parts[:, i, (i - 1) % n] = middle[:, i - 1]
    return parts.reshape(-1, n)


def _label(means: Labels, parents: Labels, new: Labels) -> Labels:
    """Labels of the new nodes that are the means of (..., 4) old ones."""
    wanted = np.sort(means.reshape(-1, 4), axis=1)
    _, inverse = np.unique(np.concatenate([parents, wanted]), axis=0, return_inverse=True)
    found: Labels = new[inverse.ravel()[len(parents):]].reshape(means.shape[:-1])
    return found


def _faces(mesh: Mesh, faces: Labels, parts: dict[int, Labels]) -> NDArray[np.int64]:
    """Face i of an element is face i of its parts i and i + 1."""
    count = mesh.faces_of(faces[:, 0])
    rows = [(int(parts[e][k]), face) for (e, face), n in zip(faces.tolist(), count.tolist())
            for k in (face - 1, face % n)]
    return np.array(rows, dtype=np.int64).reshape(-1, 2)
