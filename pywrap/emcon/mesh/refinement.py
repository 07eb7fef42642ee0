"""Finer meshes: each element in four, in space in eight, sets and surfaces kept."""

from __future__ import annotations

from functools import lru_cache
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from .checks import Labels, MeshError, kind_of
from .mesh import Mesh

#: Corners of a hexahedron, and in the plane of a quadrilateral, as steps along the axes.
_CUBE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
#: What is left of a simplex inside, by its corners: nodes in the middles of edges, of positive size.
#: The shape of those of tetrahedra repeats itself when they are cut again.
_INNER = {2: (((0, 1), (1, 2), (2, 0)),),
          3: (((0, 1), (0, 2), (0, 3), (1, 3)), ((0, 1), (1, 2), (0, 2), (1, 3)),
              ((0, 2), (2, 3), (0, 3), (1, 3)), ((0, 2), (1, 2), (2, 3), (1, 3)))}
#: A part of an element: each of its nodes is the mean of so many corners.
_Part = tuple[tuple[int, ...], ...]


def refine(mesh: Mesh, times: int = 1, *, above: int = 0) -> Mesh:
    """`mesh` with each element cut in four, in space in eight, `times` times.

    times   how often, 0 for quadratic elements; the edges become 2**times times as short
    above   labels of new nodes are larger than this, and than those of `mesh`

    Old nodes keep their labels, and an element set holds all parts of its elements. A new node, in
    the middle of an edge, a face or a hexahedron, belongs to a node set if all nodes that it is the
    mean of do. A face of a surface becomes two, in space four. New nodes lie on the straight edges of
    `mesh`: a curved boundary stays the polygon that it was, also where its nodes lie on a curve.
    """
    wrong = [kind for kind in mesh.elements if kind_of(kind).n_node > kind_of(kind).n_corner]
    if wrong and times > 0:
        raise MeshError(f"linear elements are cut in parts, none of {wrong[0]}")
    if times < 0:
        raise MeshError(f"a mesh is refined 0 times or more, not {times}")
    for _ in range(times):
        mesh = _refined(mesh, above)
    return mesh


@lru_cache
def parts_of(n_dim: int, n_corner: int) -> tuple[_Part, ...]:
    """The parts of an element. Part i holds corner i at its own corner i, so that faces keep their
    numbers there; the inner ones of a simplex are the last."""
    corners = range(n_corner)
    if n_corner == n_dim + 1:
        return (*(tuple((i,) if k == i else (i, k) for k in corners) for i in corners),
                *_INNER[n_dim])

    def between(i: int, k: int) -> tuple[int, ...]:
        """The corners that half way between two of them is the middle of."""
        return tuple(j for j in corners if all(
            _CUBE[j][d] in (_CUBE[i][d], _CUBE[k][d]) for d in range(n_dim)))

    return tuple(tuple(between(i, k) for k in corners) for i in corners)


@lru_cache
def faces_of(kind: str) -> tuple[tuple[tuple[int, int], ...], ...]:
    """Of each face the parts and their faces that it is cut in, in the order of its corners."""
    shape = kind_of(kind)
    parts = parts_of(shape.n_dim, shape.n_corner)
    found = []
    for face in shape.faces:
        order = [*face, *range(shape.n_corner, len(parts))]
        found.append(tuple((p, f) for p in order for f, own in enumerate(shape.faces)
                           if set(chain(*(parts[p][k] for k in own))) <= set(face)))
    return tuple(found)


def _refined(mesh: Mesh, above: int) -> Mesh:
    parents, new = _new_nodes(mesh, above)
    rows = mesh.rows(parents)
    labels = np.concatenate([mesh.node_labels, new])
    nodes = np.concatenate([mesh.nodes, mesh.nodes[rows].mean(axis=1)])
    elements: dict[str, Labels] = {}
    numbers: dict[str, Labels] = {}
    top = max(int(label.max()) for label in mesh.element_labels.values())
    parts: dict[int, Labels] = {}
    faces: dict[int, tuple[tuple[tuple[int, int], ...], ...]] = {}
    for kind, corners in mesh.elements.items():
        cut = _parts(kind, corners, parents, new)
        elements[kind] = cut.reshape(-1, corners.shape[1])
        old = mesh.element_labels[kind]
        fresh = top + 1 + np.arange((cut.shape[1] - 1)*len(old)).reshape(len(old), -1)
        top += fresh.size
        of_old = np.column_stack([old, fresh])
        numbers[kind] = of_old.ravel()
        parts.update(zip(old.tolist(), of_old))
        faces.update(dict.fromkeys(old.tolist(), faces_of(kind)))
    return Mesh(
        nodes, elements, node_labels=labels, element_labels=numbers,
        node_sets={name: np.concatenate([members, new[np.isin(parents, members).all(axis=1)]])
                   for name, members in mesh.node_sets.items()},
        element_sets={name: np.concatenate([parts[e] for e in members.tolist()])
                      if len(members) else members
                      for name, members in mesh.element_sets.items()},
        surfaces={name: _faces(surface, parts, faces) for name, surface in mesh.surfaces.items()})


def _width(mesh: Mesh) -> int:
    """How many nodes a new one is the mean of at most; of fewer each is taken several times."""
    return 2**mesh.nodes.shape[1]


def _new_nodes(mesh: Mesh, above: int) -> tuple[Labels, Labels]:
    """The old nodes that each new one is the mean of, (n, width), and its label, (n)."""
    means = []
    for kind, corners in mesh.elements.items():
        shape = kind_of(kind)
        for mean in sorted({mean for part in parts_of(shape.n_dim, shape.n_corner)
                            for mean in part if len(mean) > 1}):
            means.append(np.repeat(corners[:, mean], _width(mesh)//len(mean), axis=1))
    parents: Labels = np.unique(np.sort(np.concatenate(means), axis=1), axis=0)
    first = max(int(mesh.node_labels.max()), above) + 1
    return parents, np.arange(first, first + len(parents))


def _parts(kind: str, corners: Labels, parents: Labels, new: Labels) -> Labels:
    """Nodes of the parts of each element, (n_element, n_part, n_corner)."""
    shape, width = kind_of(kind), parents.shape[1]
    parts = parts_of(shape.n_dim, shape.n_corner)
    found = np.empty((len(corners), len(parts), shape.n_corner), dtype=np.int64)
    for p, part in enumerate(parts):
        for k, mean in enumerate(part):
            found[:, p, k] = (corners[:, mean[0]] if len(mean) == 1 else _label(
                np.repeat(corners[:, mean], width//len(mean), axis=1), parents, new))
    return found


def _label(means: Labels, parents: Labels, new: Labels) -> Labels:
    """Labels of the new nodes that are the means of (n, width) old ones."""
    _, inverse = np.unique(np.concatenate([parents, np.sort(means, axis=1)]), axis=0,
                           return_inverse=True)
    found: Labels = new[inverse.ravel()[len(parents):]]
    return found


def _faces(surface: Labels, parts: dict[int, Labels],
           faces: dict[int, tuple[tuple[tuple[int, int], ...], ...]]) -> NDArray[np.int64]:
    """The faces of the parts that each face is cut in."""
    rows = [(int(parts[e][p]), f + 1) for e, face in surface.tolist() for p, f in faces[e][face - 1]]
    return np.array(rows, dtype=np.int64).reshape(-1, 2)
