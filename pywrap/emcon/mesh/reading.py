"""Meshes from files: Abaqus input files, and through meshio Gmsh and what else it reads."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .abaqus import read_abaqus
from .checks import Array, MeshError, kind_of
from .kinds import CELLS, SIDES
from .mesh import Mesh
from .repair import add_lines, check_plane, fresh_name, turn_clockwise, warn

_Index = NDArray[np.int64]



@dataclass
class _Raw:
    """What a file gives: points (n, 3), and cells by block with the groups that they are in."""

    points: Array
    kind: list[str] = field(default_factory=list)             #: per block, meshio's name
    nodes: list[_Index] = field(default_factory=list)         #: per block (m, k), rows of points
    groups: dict[str, list[_Index]] = field(default_factory=dict)   #: per block, rows of it
    point_sets: dict[str, _Index] = field(default_factory=dict)


def read(path: str | os.PathLike[str]) -> Mesh:
    """The mesh in a file of Gmsh (.msh), Abaqus (.inp), or another format of meshio.

    A mesh with tetrahedra or hexahedra is one of three dimensions, any other one of the plane.
    Groups become sets and surfaces under their names, in capitals, with `_` for blanks:

    - a physical group (Gmsh) or set of elements an element set and the set of its nodes;
    - one of line elements, in space of triangles and quadrilaterals, a surface, of the element
      faces that they lie on, and the set of its nodes; only that set where one lies between two
      elements or on none;
    - one of points, in space of lines too, a node set.

    A group of Gmsh without a name is called POINT_7, CURVE_7, REGION_7 or VOLUME_7, by its number.
    Nodes that belong to no element are left out, elements that are clockwise or mirror images are
    turned, each with a `MeshWarning`. An Abaqus file is read here, without meshio, with its labels,
    `*NSET`, `*ELSET` and `*SURFACE`; all elements in the plane become CPE3, CPE4, CPE6 and CPE8,
    whatever kind they had, and those in space C3D4, C3D8, C3D10 and C3D20 unless EMCON has theirs;
    `Mesh.retype` changes that. Labels of other formats are 1, 2, ... in the order of the file.

    Raises `ImportError` if meshio is needed and not there; `MeshError` for a mesh of the plane that
    is not in one, for elements of other kinds, without area or volume or folded, and for a file
    that cannot be understood; `OSError` for one that cannot be read.
    """
    path = Path(path)
    with path.open("rb") as file:
        first = file.read(64).lstrip()
        end = file.seek(0, os.SEEK_END)
        file.seek(max(end - 64, 0))
        last = file.read().strip().splitlines()[-1:]
    if path.suffix.lower() == ".inp":
        return read_abaqus(path)
    if path.suffix.lower() == ".msh":
        _check_gmsh(path, first)
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


def _check_gmsh(path: Path, first: bytes) -> None:
    """Does a file begin as a mesh of Gmsh that is read here does?"""
    advice = "Gmsh writes 4.1 or 2.2 with Mesh.MshFileVersion, or --format msh41"
    if first.startswith(b"$NOD"):
        raise MeshError(f"{path} is of the format 1 of Gmsh, which is not read; {advice}")
    version = re.match(rb"\$MeshFormat\s+(\S+)", first)
    if first.startswith(b"$") and not (version and version[1] in (b"4", b"4.0")):
        return
    if version:
        raise MeshError(f"{path} is of the format 4.0 of Gmsh, which is not read; {advice}")
    raise MeshError(f"{path} is no mesh of Gmsh: it does not begin with $MeshFormat")


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
        known = CELLS.get(raw.kind[-1])
        count = kind_of(known).n_node if known else nodes.shape[-1]
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
        dim = _dimension(raw.kind[block])
        for tag in np.unique(tags):
            if tag <= 0:
                continue
            name = names.get((dim, int(tag)), f"{_GROUPS[dim]}_{tag}")
            rows = raw.groups.setdefault(name, [np.empty(0, dtype=np.int64)]*len(raw.kind))
            rows[block] = np.flatnonzero(np.asarray(tags) == tag)


_GROUPS = ("POINT", "CURVE", "REGION", "VOLUME")


def _dimension(kind: str) -> int:
    """Of a cell of meshio."""
    if kind in CELLS:
        return kind_of(CELLS[kind]).n_dim
    return 0 if kind == "vertex" else 1


def _build(source: str, raw: _Raw) -> Mesh:
    _check_kinds(source, raw.kind)
    there = [k for k, kind in enumerate(raw.kind) if kind in CELLS and len(raw.nodes[k])]
    if not there:
        raise MeshError(f"{source} has no triangles, quadrilaterals, tetrahedra or hexahedra")
    n_dim = max(_dimension(raw.kind[k]) for k in there)
    plane = [k for k in there if _dimension(raw.kind[k]) == n_dim]
    used = np.unique(np.concatenate([raw.nodes[k].ravel() for k in plane]))
    if n_dim == 2:
        check_plane(source, raw.points[used])
    elif not np.isfinite(raw.points[used]).all():
        raise MeshError(f"{source}: a coordinate is not finite")
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
        elements.setdefault(CELLS[raw.kind[k]], []).append(label[raw.nodes[k]])
        labels.setdefault(CELLS[raw.kind[k]], []).append(of_block[k])
        first += len(raw.nodes[k])
    joined = {kind: np.concatenate(blocks) for kind, blocks in elements.items()}
    numbers = {kind: np.concatenate(blocks) for kind, blocks in labels.items()}
    x = raw.points[used, :n_dim]
    turn_clockwise(source, x, np.arange(1, len(used) + 1), joined, numbers)
    mesh = Mesh(x, joined, element_labels=numbers)
    for name, rows in raw.point_sets.items():
        _add_nodes(mesh, source, name, label[rows])
    for name, blocks in raw.groups.items():
        _add_group(mesh, source, name, raw, blocks, label, of_block)
    return mesh


def _check_kinds(source: str, kinds: Iterable[str]) -> None:
    for kind in kinds:
        if kind in CELLS or kind in SIDES or kind == "vertex":
            continue
        hint = ""
        if kind.startswith(("triangle", "quad", "line", "tetra", "hexahedron")):
            hint = ("; of second order it has those with nodes on their edges alone (in Gmsh "
                    "Mesh.SecondOrderIncomplete = 1)")
        raise MeshError(f"{source}: EMCON has no elements of the kind {kind}{hint}")


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
        elif raw.kind[k] in SIDES and _dimension(raw.kind[k]) == mesh.n_dim - 1:
            n = SIDES[raw.kind[k]][1]
            corners = np.zeros((len(rows), 2 if mesh.n_dim == 2 else 4), dtype=np.int64)
            corners[:, :n] = label[raw.nodes[k][rows]][:, :n]
            lines.append(corners)
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
