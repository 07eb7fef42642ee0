"""Fields over time for programs that cannot read `NAME.vtkhdf`: `NAME.pvd` and a `.vtu` per frame."""

from __future__ import annotations

import contextlib
import os
import sys
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from .fields import FieldFile, frame_range
from .results import ResultError, locate

#: The first lines of each file. Eight bytes for each number of bytes; the order of the machine.
_HEADER = ('<?xml version="1.0"?>\n<VTKFile type="{kind}" version="1.0" '
           f'byte_order="{sys.byteorder.capitalize()}Endian" header_type="UInt64" '
           'compressor="vtkZLibDataCompressor">\n')
#: Of zlib: fast; higher ones make files smaller by a few percent.
_LEVEL = 1


def export(result: str | os.PathLike[str], output: str | os.PathLike[str] | None = None, *,
           frames: tuple[int, int] | None = None, fields: Sequence[str] = ()) -> list[Path]:
    """Write the fields of a run as `.pvd` and `.vtu`, for ParaView before 5.12; returns the files
    to open.

    These are `NAME.pvd` and, of contact in three dimensions, `NAME.surfaces.pvd`. They list the
    files of their frames, which are in the folder `NAME.frames`. Points, cells and values are those
    of `NAME.vtkhdf` and `NAME.surfaces.vtkhdf`, bit for bit.

    result   base name of the run, or any one of its files
    output   the first file to write; default NAME.pvd
    frames   the first and the last of the field file that are written, from 0 on; -1 is the last
    fields   names of point and cell fields; default all

    Raises `ResultError` for a result without fields, for fields and frames that are not there and
    for an `output` that is no `.pvd`, `OSError` where a file cannot be written.
    """
    paths = locate(result)
    target = paths.base.with_name(paths.base.name + ".pvd") if output is None else Path(output)
    if target.suffix.lower() != ".pvd":
        raise ResultError(f"{target}: the file that lists the frames is to be named NAME.pvd")
    folder = target.with_suffix(".frames")
    with contextlib.ExitStack() as stack:
        files = {target: stack.enter_context(FieldFile(paths.field))}
        if paths.surfaces.is_file():
            files[target.with_suffix(".surfaces.pvd")] = stack.enter_context(
                FieldFile(paths.surfaces))
        known = dict.fromkeys(name for file in files.values() for name in file)
        for name in fields:
            if name not in known:
                raise ResultError(f"{paths.base} has no field {name}; it has {', '.join(known)}")
        for listing, kind in zip(files, ("fields", "surfaces")):
            file = files[listing]
            asked = frame_range(frames, len(file.times))
            chosen = [name for name in file if not fields or name in fields]
            written = _write_frames(file, folder, kind, asked, chosen)
            _write_listing(listing, {f"{folder.name}/{path.name}": file.times[frame]
                                     for frame, path in zip(asked, written)})
    return list(files)


def _write_frames(file: FieldFile, folder: Path, kind: str, frames: range,
                  fields: Sequence[str]) -> list[Path]:
    """A `.vtu` for each of the frames; those of an earlier call go."""
    folder.mkdir(exist_ok=True)
    for old in folder.glob(f"{kind}.*.vtu"):
        old.unlink()
    cells = file.vtk_cells
    points = [_array("Points", file.points)]
    mesh = [_array("connectivity", cells.connectivity), _array("offsets", cells.offsets[1:]),
            _array("types", cells.types.astype(np.uint8))]
    size = f'NumberOfPoints="{len(file.points)}" NumberOfCells="{len(cells.types)}"'
    written = []
    for frame in frames:
        values = {where: [_array(name, file.vtk_rows(where, name, frame)) for name in fields
                          if name in names]
                  for where, names in (("PointData", file.point_fields),
                                       ("CellData", file.cell_fields))}
        path = folder/f"{kind}.{frame:04d}.vtu"
        path.write_bytes(_grid(size, {**values, "Points": points, "Cells": mesh}))
        written.append(path)
    return written


def _write_listing(listing: Path, times: dict[str, np.float64]) -> None:
    """The file to open: the file of each frame and its time."""
    lines = [f'<DataSet timestep="{float(time)!r}" file={quoteattr(place)}/>\n'
             for place, time in times.items()]
    listing.write_text(_HEADER.format(kind="Collection") + "<Collection>\n" + "".join(lines)
                       + "</Collection>\n</VTKFile>\n", encoding="utf-8")


@dataclass(frozen=True)
class _Array:
    """An array as it stands in a file."""

    name: str
    kind: str                #: Float64, Int64, UInt8
    shape: str               #: the attribute of an array with components
    content: bytes           #: numbers of blocks and of bytes, and one compressed block


def _array(name: str, values: NDArray[Any]) -> _Array:
    kind = {"f": "Float", "i": "Int", "u": "UInt"}[values.dtype.kind]
    packed = zlib.compress(np.ascontiguousarray(values).tobytes(), _LEVEL)
    header = np.array([1, values.nbytes, 0, len(packed)], dtype=np.uint64).tobytes()
    return _Array(name, f"{kind}{8*values.itemsize}",
                  f'NumberOfComponents="{values.shape[1]}" ' if values.ndim > 1 else "",
                  header + packed)


def _grid(size: str, sections: dict[str, list[_Array]]) -> bytes:
    """A file of one frame: its text says where in the bytes behind it each array begins."""
    lines = [_HEADER.format(kind="UnstructuredGrid"), f"<UnstructuredGrid>\n<Piece {size}>\n"]
    place = 0
    for section, arrays in sections.items():
        lines.append(f"<{section}>\n")
        for array in arrays:
            lines.append(f'<DataArray type="{array.kind}" Name={quoteattr(array.name)} '
                         f'{array.shape}format="appended" offset="{place}"/>\n')
            place += len(array.content)
        lines.append(f"</{section}>\n")
    lines.append('</Piece>\n</UnstructuredGrid>\n<AppendedData encoding="raw">\n_')
    contents: Iterable[bytes] = (array.content for arrays in sections.values() for array in arrays)
    return b"".join(["".join(lines).encode(), *contents, b"\n</AppendedData>\n</VTKFile>\n"])
