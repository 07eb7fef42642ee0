"""Files of triangles (STL), as text and binary."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
from space_mesh import CUBE_FACES, TETRAHEDRON_FACES, Block


def outline(block: Block) -> np.ndarray:
    """(n, 3, 3) corners of the outer faces of a convex block, seen from outside; four corners make two triangles."""
    found = []
    faces = TETRAHEDRON_FACES if block.kind == "C3D4" else CUBE_FACES
    for e, f in block.outer_faces():
        x = block.x[[block.element[e - 1][c] - 1 for c in faces[f - 1]]]
        found += [x[[0, k, k + 1]] for k in range(1, len(x) - 1)]
    corner, middle = np.array(found), block.x.mean(0)
    inward = np.einsum("fa,fa->f", np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), corner[:, 0] - middle) < 0
    corner[inward] = corner[inward][:, ::-1]
    return corner


def text(corner: np.ndarray) -> str:
    """A text file; the normals say nothing."""
    lines = ["solid a box of triangles"]
    for facet in corner.tolist():
        lines += ["  facet normal 0 0 0", "    outer loop"]
        lines += ["      vertex " + " ".join(map(repr, x)) for x in facet]
        lines += ["    endloop", "  endfacet"]
    return "\n".join([*lines, "endsolid a box of triangles\n"])


def binary(corner: np.ndarray) -> bytes:
    head = b"solid, as some programs write it here, too".ljust(80) + struct.pack("<I", len(corner))
    return head + b"".join(struct.pack("<12fH", *(0.0,)*3, *facet.ravel(), 0) for facet in corner)


def write(path: Path, corner: np.ndarray, is_binary: bool = False) -> None:
    if is_binary:
        path.write_bytes(binary(corner))
    else:
        path.write_text(text(corner))
