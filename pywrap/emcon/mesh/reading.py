"""Meshes from files: Abaqus input files, and through meshio Gmsh and what else it reads."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .abaqus import read_abaqus
from .checks import KINDS, Array, MeshError
from .mesh import Mesh
from .repair import add_lines, check_plane, fresh_name, turn_clockwise, warn

_Index = NDArray[np.int64]

_PLANE = {"triangle": "CPE3", "quad": "CPE4"}
_SOLID = ("tetra", "hexahedron", "wedge", "pyramid")


@dataclass
class _Raw:
    """What a file gives: points (n, 3), and cells by block with the groups that they are in."""

    points: Array
    kind: list[str] = field(default_factory=list)             #: per block, meshio's name
    nodes: list[_Index] = field(default_factory=list)         #: per block (m, k), rows of points
    groups: dict[str, list[_Index]] = field(default_factory=dict)   #: per block, rows of it
    point_sets: dict[str, _Index] = field(default_factory=dict)


def read(path: str | os.PathLike[str]) -> Mesh:
    """The plane mesh in a file of Gmsh (.msh), Abaqus (.inp), or another format of meshio.

    Groups become sets and surfaces under their names, in capitals, with `_` for blanks:

    - a physical group (Gmsh) or set of triangles and quadrilaterals an element set and the set of
      its nodes;
    - one of line elements a surface, of the element faces that the lines lie on, and the set of
      its nodes; only that set where a line lies between two elements or on none;
    - one of points a node set.

    A group of Gmsh without a name is called CURVE_7 or REGION_7, by its number. Nodes that belong
    to no element are left out, clockwise elements are turned, each with a `MeshWarning`. An Abaqus
    file is read here, without meshio, with its labels, `*NSET`, `*ELSET` and `*SURFACE`; all
    elements become CPE3 and CPE4, whatever plane kind they had. Labels of other formats are 1, 2,
    ... in the order of the file.

    Raises `ImportError` if meshio is needed and not there; `MeshError` for a mesh that is not
    plane, for elements of higher order or of other kinds, without area or folded, and for a file
    that cannot be understood; `OSError` for one that cannot be read.
    """
    path = Path(path)
    with path.open("rb") as file:
        end = file.seek(0, os.SEEK_END)
        file.seek(max(end - 64, 0))
        last = file.read().strip().splitlines()[-1:]
    if path.suffix.lower() == ".inp":
        return read_abaqus(path)
    if path.suffix.lower() == ".msh" and not (last and last[0].startswith(b"$End")):
        raise MeshError(f"{path} was cut off: it does not end with $End...")
    try:
        import meshio
    except ImportError:
        raise ImportError(f"reading {path} needs the package meshio: pip install meshio, or "
                          "pip install 'emcon[mesh]'") from None
    try:
        found = meshio.read(path)
    except (Exception, SystemExit) as problem:   # meshio ends the interpreter at some files
        raise MeshError(f"{path}: meshio cannot read it ({_reason(problem)})") from None
    if not len(found.points):
        raise MeshError(f"{path} has no nodes")
    return _build(str(path), _raw(str(path), found))


def _reason(problem: BaseException) -> str:
    if isinstance(problem, SystemExit):
        return "it gave up"
    return " ".join(str(problem).split()) or type(problem).__name__


def _raw(source: str, found: Any) -> _Raw:
    points = np.asarray(found.points, dtype=np.float64)
    if points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    raw = _Raw(points)
    for cells in found.cells:
        raw.kind.append(str(cells.type))
        nodes = np.asarray(cells.data, dtype=np.int64)
        count = KINDS.get(_PLANE.get(raw.kind[-1], ""), nodes.shape[-1])
        if nodes.ndim != 2 or nodes.shape[1] != count or (
                nodes.size and not 0 <= nodes.min() <= nodes.max() < len(points)):
            raise MeshError(f"{source}: the elements of the kind {cells.type} are broken")
        raw.nodes.append(nodes)
    for name, blocks in found.cell_sets.items():
        if not name.startswith("gmsh:"):
            raw.groups[name] = [np.asarray([] if rows is None else rows, dtype=np.int64)
                                for rows in blocks]
    for name, rows in found.point_sets.items():
        raw.point_sets[name] = np.asarray(rows, dtype=np.int64)
    if not raw.groups:
        _add_physical(raw, found)
    return raw


def _add_physical(raw: _Raw, found: Any) -> None:
    """Groups of Gmsh by number, for versions of its format in which meshio gives no sets."""
    names = {(int(d), int(tag)): name for name, (tag, d) in found.field_data.items()}
    for block, tags in enumerate(found.cell_data.get("gmsh:physical", [])):
        dim = {"vertex": 0, "line": 1}.get(raw.kind[block], 2)
        for tag in np.unique(tags):
            if tag <= 0:
                continue
            name = names.get((dim, int(tag)), f"{('POINT', 'CURVE', 'REGION')[dim]}_{tag}")
            rows = raw.groups.setdefault(name, [np.empty(0, dtype=np.int64)]*len(raw.kind))
            rows[block] = np.flatnonzero(np.asarray(tags) == tag)


def _build(source: str, raw: _Raw) -> Mesh:
    _check_kinds(source, raw.kind)
    plane = [k for k, kind in enumerate(raw.kind) if kind in _PLANE and len(raw.nodes[k])]
    if not plane:
        raise MeshError(f"{source} has no triangles and no quadrilaterals")
    used = np.unique(np.concatenate([raw.nodes[k].ravel() for k in plane]))
    check_plane(source, raw.points[used])
    label = np.zeros(len(raw.points), dtype=np.int64)
    label[used] = np.arange(1, len(used) + 1)
    if len(used) < len(raw.points):
        warn(f"{source}: {len(raw.points) - len(used)} nodes belong to no element; left out")
    elements: dict[str, list[_Index]] = {}
    labels: dict[str, list[_Index]] = {}
    of_block: dict[int, _Index] = {}
    first = 1
    for k in plane:
        of_block[k] = np.arange(first, first + len(raw.nodes[k]))
        elements.setdefault(_PLANE[raw.kind[k]], []).append(label[raw.nodes[k]])
        labels.setdefault(_PLANE[raw.kind[k]], []).append(of_block[k])
        first += len(raw.nodes[k])
    joined = {kind: np.concatenate(blocks) for kind, blocks in elements.items()}
    numbers = {kind: np.concatenate(blocks) for kind, blocks in labels.items()}
    x = raw.points[used, :2]
    turn_clockwise(source, x, np.arange(1, len(used) + 1), joined, numbers)
    mesh = Mesh(x, joined, element_labels=numbers)
    for name, rows in raw.point_sets.items():
        _add_nodes(mesh, source, name, label[rows])
    for name, blocks in raw.groups.items():
        _add_group(mesh, source, name, raw, blocks, label, of_block)
    return mesh


def _check_kinds(source: str, kinds: Iterable[str]) -> None:
    for kind in kinds:
        if kind in _PLANE or kind in ("line", "vertex"):
            continue
        if kind.rstrip("0123456789") in _SOLID:
            raise MeshError(f"{source} is three-dimensional: it has elements of the kind {kind}; "
                            "EMCON takes plane meshes")
        if kind.startswith(("triangle", "quad", "line")):
            raise MeshError(f"{source} has elements of higher order, of the kind {kind}; EMCON "
                            "takes linear ones: mesh it with order 1")
        raise MeshError(f"{source}: EMCON has no elements of the kind {kind}")


def _add_group(mesh: Mesh, source: str, name: str, raw: _Raw, blocks: list[_Index],
               label: _Index, of_block: Mapping[int, _Index]) -> None:
    """The sets and the surface of one group; it may hold cells of several kinds."""
    elements, lines, nodes = [], [], []
    for k, rows in enumerate(blocks[:len(raw.kind)]):
        if not len(rows):
            continue
        nodes.append(label[raw.nodes[k][rows]].ravel())
        if k in of_block:
            elements.append(of_block[k][rows])
        elif raw.kind[k] == "line":
            lines.append(label[raw.nodes[k][rows]])
    if not nodes:
        return
    if elements:
        mesh.add_element_set(fresh_name(mesh.element_sets, source, name),
                             np.concatenate(elements))
    if lines:
        add_lines(mesh, source, name, np.concatenate(lines))
    _add_nodes(mesh, source, name, np.concatenate(nodes))


def _add_nodes(mesh: Mesh, source: str, name: str, labels: _Index) -> None:
    labels = np.unique(labels[labels > 0])
    if len(labels):
        mesh.add_node_set(fresh_name(mesh.node_sets, source, name), labels)
