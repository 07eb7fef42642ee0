"""Edges of a body's boundary, from cells of any code."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .checks import MeshError, positions


def boundary_edges(nodes: ArrayLike, cells: ArrayLike) -> NDArray[np.int64]:
    """The edges (k, 2) that one cell has alone, the body to the left on the way along them.

    nodes   (n, 2) positions [L]
    cells   (m, 3) or (m, 4) rows of `nodes`, the corners in order, either way round; four corners
            of which two neighbours are the same stand for a triangle

    Edges are in the order of the cells. Those of several bodies, and of holes, come together; the
    midpoints or the nodes tell them apart. Raises `MeshError` for cells without area, and for an
    edge of more than two cells, or of two that lie on the same side.
    """
    x = positions(nodes)
    corner = np.asarray(cells)
    if corner.ndim != 2 or corner.shape[1] not in (3, 4):
        raise MeshError(f"cells are an (m, 3) or (m, 4) array of nodes, not {corner.shape}")
    if not corner.size:
        return np.zeros((0, 2), dtype=np.int64)
    if corner.dtype.kind not in "iu":
        raise MeshError(f"cells are rows of nodes, whole numbers, not {corner.dtype}")
    if corner.min() < 0 or corner.max() >= len(x):
        wrong = corner.min() if corner.min() < 0 else corner.max()
        raise MeshError(f"cells: there is no node {wrong}; rows of nodes are 0 to {len(x) - 1}")
    corner = corner.astype(np.int64)
    corner = np.where(_is_clockwise(x, corner)[:, None], corner[:, ::-1], corner)
    edge = np.stack((corner, np.roll(corner, -1, axis=1)), axis=2).reshape(-1, 2)
    edge = edge[edge[:, 0] != edge[:, 1]]
    key, back = (edge[:, a]*len(x) + edge[:, 1 - a] for a in (0, 1))
    values, count = np.unique(key, return_counts=True)
    if (count > 1).any():
        ends = [int(end) for end in np.divmod(values[count > 1][0], len(x))]
        raise MeshError(f"two cells lie on the same side of the edge between the nodes {ends[0]} "
                        f"and {ends[1]}")
    return edge[~np.isin(key, back)]


def _is_clockwise(x: NDArray[np.float64], corner: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which way round cells are, (m,), from their areas."""
    side = x[corner] - x[corner[:, :1]]
    size = np.abs(side).max(axis=(1, 2))
    side = side/np.where(size > 0.0, size, 1.0)[:, None, None]
    along = np.roll(side, -1, axis=1)
    area = 0.5*(side[..., 0]*along[..., 1] - side[..., 1]*along[..., 0]).sum(axis=1)
    # corners are rounded by epsilon of their distance from the origin
    noise = 16*np.finfo(float).eps*np.abs(x[corner]).max(axis=(1, 2))
    flat = ~(np.abs(area)*size > noise)
    if flat.any():
        raise MeshError(f"cells[{int(np.argmax(flat))}] has no area")
    return area < 0.0
