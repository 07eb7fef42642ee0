"""Meshes of simple shapes: grid, block, strip, ring, disc; their sides are sets and surfaces.

All have a `name`: that of the set of all nodes and of the set of all elements. A side SIDE gives
the surface NAME_SIDE and the node set NAME_SIDE, in the order along the side. `kind` is CPE4, or
CPE3: then each quadrilateral is cut in two along its shorter diagonal.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .checks import Array, MeshError, kind_of
from .boxes import box
from .mesh import Mesh

_Index = NDArray[np.int64]

#: Faces of the quadrilaterals of a grid at its sides: i lowest, i highest, j lowest, j highest.
_FACES = {"I0": 4, "I1": 2, "J0": 1, "J1": 3}
#: Half the side of the square inside a disc over the radius, and how far its sides bulge.
_SQUARE, _BULGE = 0.45, 0.28


def grid(points: ArrayLike, name: str = "GRID", *, sides: Mapping[str, str] | None = None,
         closed: bool = False, kind: str = "CPE4") -> Mesh:
    """Elements between the points of an array.

    points   (n_i + 1, n_j + 1, 2) [L]; j runs to the left of i. If closed, (n_i, n_j + 1, 2)
    sides    names of the sides `I0`, `I1` (first and last i), `J0`, `J1`; default those; a side
             that is not named has neither surface nor set
    closed   the last column of elements joins the first; there are no sides I0 and I1

    Labels go column by column, each along j. Raises `MeshError` for points that do not give
    elements.
    """
    x = np.asarray(points, dtype=np.float64)
    if x.ndim != 3 or x.shape[2] != 2 or x.shape[0] < (3 if closed else 2) or x.shape[1] < 2:
        raise MeshError("points are an array (n_i + 1, n_j + 1, 2) of at least 2 x 2 points, if "
                        f"closed 3 x 2, not {x.shape}")
    label = np.arange(1, x.shape[0]*x.shape[1] + 1).reshape(x.shape[:2])
    quads, first = _quads(label, closed)
    ends = ("J0", "J1") if closed else ("I0", "I1", "J0", "J1")
    names = {end: end for end in ends} if sides is None else sides
    wrong = set(names) - set(ends)
    if wrong:
        raise MeshError(f"the grid has sides {', '.join(ends)}, not {', '.join(sorted(wrong))}")
    rows = {"I0": first[0], "I1": first[-1], "J0": first[:, 0], "J1": first[:, -1]}
    nodes = {"I0": label[0], "I1": label[-1], "J0": label[:, 0], "J1": label[:, -1]}
    return _assemble(x.reshape(-1, 2), quads, name, kind,
                     {side: (rows[end], _FACES[end], nodes[end]) for end, side in names.items()})


def block(corner: ArrayLike | None = None, size: ArrayLike | None = None,
          cells: tuple[int, ...] | None = None, name: str = "BLOCK", *,
          kind: str = "CPE4") -> Mesh:
    """A rectangle; sides LEFT, RIGHT, BOTTOM, TOP. Of a C3D kind a box, which has BACK, FRONT too.

    corner   the one with the least coordinates (2,) or (3,) [L]; default the origin
    size     lengths along the axes [L], above 0; default 1
    cells    numbers of elements along the axes; default 1

    In space x runs from LEFT to RIGHT, y from BOTTOM to TOP, z from BACK to FRONT; tetrahedra are
    six to each box.
    """
    n_dim = kind_of(kind).n_dim
    corner = np.zeros(n_dim) if corner is None else corner
    size = np.ones(n_dim) if size is None else size
    cells = (1,)*n_dim if cells is None else cells
    if n_dim == 3:
        return box(corner, size, cells, name, kind)
    n = _counts(cells)
    low, length = _pair(corner, "corner"), _pair(size, "size", positive=True)
    x, y = (low[k] + length[k]*np.arange(n[k] + 1)/n[k] for k in (0, 1))
    return grid(np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1), name, kind=kind,
                sides={"I0": "LEFT", "I1": "RIGHT", "J0": "BOTTOM", "J1": "TOP"})


def strip(path: ArrayLike | Callable[[float], ArrayLike], thickness: float,
          cells: tuple[int, int] = (8, 1), name: str = "STRIP", *, kind: str = "CPE4") -> Mesh:
    """A band of even thickness along a line; sides START, END, LEFT, RIGHT of the way.

    path       the middle line: (k, 2) points [L] of a polyline, divided evenly by length, or a
               function s -> (x, y) [L], taken at even steps of s from 0 to 1
    thickness  [L], above 0, measured square to the line
    cells      numbers of elements along and across

    Raises `MeshError` where the line turns too sharply for the thickness.
    """
    n = _counts(cells)
    if not (np.isfinite(thickness) and thickness > 0.0):
        raise MeshError(f"the thickness is above 0, not {thickness}")
    share = np.arange(n[0] + 1)/n[0]
    middle = (np.array([np.asarray(path(float(s)), dtype=float) for s in share])
              if callable(path) else _along(np.asarray(path, dtype=float), share))
    if middle.shape != (n[0] + 1, 2) or not np.isfinite(middle).all():
        raise MeshError("the path gives pairs of finite numbers")
    chord = np.diff(middle, axis=0)
    length = np.hypot(chord[:, 0], chord[:, 1])
    if not (length > 0.0).all():
        raise MeshError("two points of the path coincide")
    normal = np.column_stack([-chord[:, 1], chord[:, 0]])/length[:, None]
    before, after = (np.concatenate(p) for p in ((normal[:1], normal), (normal, normal[-1:])))
    # between two chords the offset lies on both parallels to them
    cosine = 1.0 + (before*after).sum(axis=1)
    if not (cosine > np.sqrt(np.finfo(np.float64).eps)).all():
        raise MeshError("the path turns back on itself")
    offset = thickness*(np.arange(n[1] + 1)/n[1] - 0.5)
    points = middle[:, None] + offset[:, None]*((before + after)/cosine[:, None])[:, None]
    return grid(points, name, kind=kind,
                sides={"I0": "START", "I1": "END", "J0": "RIGHT", "J1": "LEFT"})


def ring(centre: ArrayLike = (0.0, 0.0), radii: tuple[float, float] = (0.5, 1.0),
         cells: tuple[int, int] = (32, 2), name: str = "RING", *, kind: str = "CPE4") -> Mesh:
    """A ring; sides OUTER, INNER.

    centre   (2,) [L]
    radii    inner, outer [L], above 0
    cells    numbers of elements around (at least 3) and through

    Labels go radial line by radial line from the lowest one, counter-clockwise, each from the rim
    inwards.
    """
    n = _counts(cells)
    inner, outer = _pair(radii, "radii", positive=True)
    if n[0] < 3 or not inner < outer:
        raise MeshError(f"a ring has at least 3 elements around and radii that grow, not {cells} "
                        f"and {radii}")
    radius = outer - (outer - inner)*np.arange(n[1] + 1)/n[1]
    points = _pair(centre, "centre") + radius[:, None]*_circle(n[0])[:, None]
    return grid(points, name, closed=True, kind=kind, sides={"J0": "OUTER", "J1": "INNER"})


def disc(centre: ArrayLike = (0.0, 0.0), radius: float = 1.0, cells: tuple[int, int] = (4, 3),
         name: str = "DISC", *, turn: float = 0.0, kind: str = "CPE4") -> Mesh:
    """A disc: n x n elements in the middle, 4n x m around them; side RIM.

    centre   (2,) [L]
    radius   [L], above 0
    cells    n, m
    turn     angle [rad] by which the mesh is turned; 0: a node of the rim lies at -135 degrees
    """
    n, m = _counts(cells)
    if not (np.isfinite(radius) and radius > 0.0 and np.isfinite(turn)):
        raise MeshError(f"the radius is above 0 and the turn finite, not {radius} and {turn}")
    s = 2.0*np.arange(n + 1)/n - 1.0
    s, t = np.meshgrid(s, s, indexing="ij")
    # bulged, so that the corners of the elements stay open
    square = _SQUARE*radius*np.stack([s*(1.0 + _BULGE*(1.0 - t*t)), t*(1.0 + _BULGE*(1.0 - s*s))],
                                     axis=-1)
    k = np.arange(n)
    zero, last = np.zeros(n, dtype=np.int64), np.full(n, n)
    i = np.concatenate([k, last, n - k, zero])            # border of the square from its lower
    j = np.concatenate([zero, k, last, n - k])            # left corner, counter-clockwise
    angle = np.pi*(2.0*np.arange(4*n) - 3.0*n)/(4.0*n)
    rim = radius*np.column_stack([np.cos(angle), np.sin(angle)])
    share = (np.arange(m + 1)/m)[:, None]
    around = (1.0 - share)*rim[:, None] + share*square[i, j][:, None]

    label = np.arange(1, 4*n*(m + 1) + 1).reshape(4*n, m + 1)
    inside = np.zeros((n + 1, n + 1), dtype=np.int64)
    inside[i, j] = label[:, -1]
    inside[1:n, 1:n] = label.size + 1 + np.arange((n - 1)**2).reshape(n - 1, n - 1)
    outer, first = _quads(label, closed=True)
    middle, _ = _quads(inside, closed=False)
    nodes = np.concatenate([around.reshape(-1, 2), square[1:n, 1:n].reshape(-1, 2)])
    mesh = _assemble(nodes, np.concatenate([outer, middle]), name, kind,
                     {"RIM": (first[:, 0], 1, label[:, 0])})
    mesh = mesh.rotate(turn) if turn else mesh
    return mesh.move(*_pair(centre, "centre"))


# --- parts -------------------------------------------------------------------------------------

def _quads(label: _Index, closed: bool) -> tuple[_Index, _Index]:
    """Quadrilaterals (m, 4) of an array of labels, and their rows by place (n_i, n_j)."""
    low = label if closed else label[:-1]
    high = np.roll(label, -1, axis=0) if closed else label[1:]
    quads = np.stack([low[:, :-1], high[:, :-1], high[:, 1:], low[:, 1:]], axis=-1)
    return quads.reshape(-1, 4), np.arange(quads.shape[0]*quads.shape[1]).reshape(quads.shape[:2])


def _assemble(nodes: Array, quads: _Index, name: str, kind: str,
              sides: Mapping[str, tuple[_Index, int, _Index]]) -> Mesh:
    """The mesh of quadrilaterals (m, 4); sides by name: rows of `quads`, face, node labels."""
    shape = kind_of(kind)
    if shape.n_dim == 3:
        raise MeshError(f"{kind!r} is a kind of elements in space; `block` makes boxes of it")
    linear = f"CPE{shape.n_corner}"
    if kind != linear:
        return _assemble(nodes, quads, name, linear, sides).retype({linear: kind})
    if kind == "CPE4":
        mesh = Mesh(nodes, {kind: quads})
        faces = {side: (rows + 1, np.full(len(rows), face)) for side, (rows, face, _)
                 in sides.items()}
    else:
        # a diagonal of a quadrilateral that is no element may give two that are
        Mesh(nodes, {"CPE4": quads})
        halves, holder = _halves(nodes, quads)
        mesh = Mesh(nodes, {kind: halves})
        faces = {side: tuple(holder[rows, face - 1].T) for side, (rows, face, _) in sides.items()}
    mesh.add_node_set(name, mesh.node_labels)
    mesh.add_element_set(name, mesh.element_labels[kind])
    for side, pair in faces.items():
        mesh.add_node_set(f"{name}_{side}", sides[side][2])
        mesh.add_surface(f"{name}_{side}", np.column_stack(pair))
    return mesh


def _halves(nodes: Array, quads: _Index) -> tuple[_Index, _Index]:
    """Triangles (2 m, 3) of quadrilaterals; and where each face went: (m, 4, 2) label, face."""
    x = nodes[quads - 1]
    across = x[:, 2:] - x[:, :2]
    # of equal ones the first, however the last bits fall
    length = np.hypot(across[..., 0], across[..., 1])
    first = length[:, 0] <= length[:, 1]*(1.0 + 1e-8)
    cut = np.where(first[:, None, None], [[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]])
    halves = np.take_along_axis(quads[:, None, :], cut, axis=2).reshape(-1, 3)
    # half (0 or 1) and face of the sides 1..4 of the quadrilateral
    place = np.where(first[:, None, None], [[0, 1], [0, 2], [1, 2], [1, 3]],
                     [[0, 1], [1, 1], [1, 2], [0, 3]])
    label = 2*np.arange(len(quads))[:, None] + 1 + place[..., 0]
    return halves, np.stack([label, place[..., 1]], axis=-1)


def _circle(n: int) -> Array:
    """(n, 2): cos, sin of -pi/2 + 2 pi k/n; mirror images in either axis get the same digits."""
    k = np.arange(n)
    m = np.minimum(k, n - k)                          # mirrored to the right half
    angle = np.pi*np.minimum(2*m, n - 2*m)/n          # mirrored to the lower quarter
    x = np.where(4*m != n, np.sin(angle), 1.0)
    y = np.where(4*m != n, -np.cos(angle), 0.0)
    return np.column_stack([np.where(k == m, x, -x), np.where(4*m < n, y, -y)])


def _along(points: Array, share: Array) -> Array:
    """Points of a polyline at shares (k) of its length."""
    if points.ndim != 2 or points.shape[1:] != (2,) or len(points) < 2:
        raise MeshError(f"a path is a function or at least 2 points (k, 2), not {points.shape}")
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    if not way[-1] > 0.0 or not np.isfinite(way[-1]):
        raise MeshError("the path has no length")
    return np.column_stack([np.interp(share*way[-1], way, points[:, k]) for k in (0, 1)])


def _counts(cells: Sequence[int]) -> tuple[int, int]:
    values = np.asarray(cells)
    if values.shape != (2,) or values.dtype.kind not in "iu" or not (values >= 1).all():
        raise MeshError(f"cells are two whole numbers from 1 on, not {cells!r}")
    return int(values[0]), int(values[1])


def _pair(value: ArrayLike, what: str, positive: bool = False) -> Array:
    pair = np.asarray(value, dtype=np.float64)
    if pair.shape != (2,) or not np.isfinite(pair).all() or (positive and not (pair > 0.0).all()):
        raise MeshError(f"{what} is a pair of finite numbers{', above 0' if positive else ''}, "
                        f"not {value!r}")
    return pair
