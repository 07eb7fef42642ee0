"""Fields over time, `NAME.vtkhdf`: read frame by frame, when asked for."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from .hdf5 import Array, ResultError, guarded, open_file, read


#: Cells of VTK files with a node in the middle of each side: of six and of eight nodes.
QUADRATIC = (22, 23)
#: Those that are solids: tetrahedra and hexahedra, linear and quadratic.
SOLIDS = (10, 12, 24, 25)
#: Cells of VTK files that are lines of profiles, which stand behind the elements.
LINE = 3


class VtkCells(NamedTuple):
    """All cells of a file, the lines of profiles too, in the order of nodes that VTK has."""

    connectivity: NDArray[np.int64]      #: node numbers from 0 on, cell after cell
    offsets: NDArray[np.int64]           #: (n_cell + 1) where in `connectivity` a cell begins
    types: NDArray[np.int64]             #: (n_cell) as VTK counts


def frame_range(frames: tuple[int, int] | None, count: int) -> range:
    """The frames from the first to the last of `frames`, all by default, of a file that has `count`.

    Raises `ResultError` for one that is not there and for a last one before the first.
    """
    if frames is None:
        return range(count)
    for frame in frames:
        if not -count <= frame < count:
            raise ResultError(f"there is no frame {frame}; the file has {count}, from 0 on")
    first, last = (frame % count for frame in frames)
    if first > last:
        raise ResultError(f"frames go from one to a later one, not from {frames[0]} to {frames[1]}")
    return range(first, last + 1)


class FieldFile:
    """Fields over time of one run (NAME.vtkhdf), read when asked for.

    Attributes: `times` (n_frame) [T], `points` (n_node, 3) reference positions [L], `cells` list
    of node numbers (0-based) per element, `types` of these as VTK counts, `profiles` (n_line, 2)
    ends of the lines of surfaces without elements, `point_fields` and `cell_fields` names. Frames
    are counted from 0; -1 is the last. `file[name]` is a field at all frames, a `FieldSeries`; one
    of cells has the elements alone.

    Raises `ResultError` for a file that is missing, foreign or damaged, for a field that it does
    not have, and for fields asked for after `close`.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self._file = open_file(self.path)
        try:
            with guarded(self.path, "the mesh"):
                self._read_mesh()
        except BaseException:
            self._file.close()
            raise

    def _read_mesh(self) -> None:
        root = self._file.get("VTKHDF")
        kind = root.attrs.get("Type", b"") if isinstance(root, h5py.Group) else b""
        kind = kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)
        if kind.strip() != "UnstructuredGrid" or "Steps" not in root:
            raise ResultError(f"{self.path} is not an EMCON field file: no unstructured grid "
                              "over time in it")
        self._group = root
        steps = root["Steps"]
        n_frame = int(steps.attrs.get("NSteps", 0))
        self.times: Array = read(steps, "Values")[:n_frame]
        self.points: Array = read(root, "Points")
        connectivity = read(root, "Connectivity").astype(np.int64)
        offsets = read(root, "Offsets").astype(np.int64)
        n_node = len(self.points)
        if (self.points.ndim != 2 or len(offsets) < 2 or offsets[-1] != len(connectivity)
                or (np.diff(offsets) <= 0).any() or not len(connectivity)
                or connectivity.min() < 0 or connectivity.max() >= n_node):
            raise ResultError(f"{self.path}: the mesh in it is broken")
        self.types: NDArray[np.int64] = read(root, "Types").astype(np.int64)
        self.vtk_cells = VtkCells(connectivity, offsets, self.types)
        cells = np.split(connectivity, offsets[1:-1])
        self._n_row = len(cells)
        n_element = self._n_row - int((self.types == LINE).sum())
        if (self.types[:n_element] == LINE).any():
            raise ResultError(f"{self.path}: the mesh in it is broken")
        self.profiles: NDArray[np.int64] = np.array(cells[n_element:], dtype=np.int64).reshape(
            -1, 2)
        self.types = self.types[:n_element]
        self.cells: list[NDArray[np.int64]] = [
            _outline(cell, kind) for cell, kind in zip(cells[:n_element], self.types)]
        self.point_fields = self._names("PointData")
        self.cell_fields = self._names("CellData")
        if not len(self.times):
            raise ResultError(f"{self.path} has no frame; the run ended before its first")

    @property
    def n_dim(self) -> int:
        """How many coordinates of `points` count: 3 where there are solids, else 2."""
        return 3 if np.isin(self.types, SOLIDS).any() else 2

    def _names(self, group: str) -> tuple[str, ...]:
        return tuple(self._group[group]) if group in self._group else ()

    def _root(self) -> h5py.Group:
        if not self._file:
            raise ResultError(f"{self.path} is closed")
        return self._group

    def point(self, name: str, frame: int) -> Array:
        """Point field `name` at `frame`: (n_node) or (n_node, n_comp)."""
        return self._series("PointData", name)[frame]

    def cell(self, name: str, frame: int) -> Array:
        """Cell field `name` at `frame`: (n_element) or (n_element, n_comp)."""
        return self._series("CellData", name)[frame]

    def vtk_rows(self, group: str, name: str, frame: int) -> Array:
        """Field `name` of `PointData` or `CellData` at `frame`, of all points or `vtk_cells`."""
        return self._series(group, name).all_rows(frame)

    def __getitem__(self, name: str) -> FieldSeries:
        """A point or cell field at all frames; nothing is read yet."""
        if name in self.cell_fields and name not in self.point_fields:
            return self._series("CellData", name)
        if name not in self.point_fields:
            raise ResultError(f"{self.path} has no field {name}; it has "
                              f"{', '.join((*self.point_fields, *self.cell_fields)) or 'none'}")
        return self._series("PointData", name)

    def keys(self) -> tuple[str, ...]:
        """The names of all fields, each once."""
        return tuple(dict.fromkeys((*self.point_fields, *self.cell_fields)))

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __contains__(self, name: object) -> bool:
        return name in self.keys()

    def __len__(self) -> int:
        return len(self.keys())

    def items(self) -> Iterator[tuple[str, FieldSeries]]:
        """Names and fields; nothing is read yet."""
        return ((name, self[name]) for name in self)

    def values(self) -> Iterator[FieldSeries]:
        """All fields; nothing is read yet."""
        return (self[name] for name in self)

    def __repr__(self) -> str:
        if not self._file:
            return f"FieldFile({str(self.path)!r}), closed"
        return (f"FieldFile({str(self.path)!r}): {len(self.times)} frames, t = {self.times[0]:g} "
                f"to {self.times[-1]:g}, {', '.join(self)}")

    def _series(self, group: str, name: str) -> FieldSeries:
        names = self.point_fields if group == "PointData" else self.cell_fields
        if name not in names:
            raise ResultError(f"{self.path} has no field {name}; it has "
                              f"{', '.join(names) or 'none'}")
        return FieldSeries(self, group, name)

    def at(self, name: str, time: float) -> Array:
        """The field `name` at the frame nearest to `time` [T]; see `FieldSeries.at`."""
        return self[name].at(time)

    def nearest_frame(self, time: float) -> int:
        """The frame whose time is nearest to `time` [T]."""
        return int(np.argmin(np.abs(self.times - time)))

    def frame_at(self, time: float) -> int:
        """The frame nearest to `time` [T]; raises `ResultError` outside the run.

        The ends may be missed by half of the longest time between frames.
        """
        slack = 0.5*float(np.max(np.diff(self.times), initial=0.0))
        if not self.times[0] - slack <= time <= self.times[-1] + slack:
            raise ResultError(f"no frame near time {time:g}; {self.path} runs from "
                              f"{self.times[0]:g} to {self.times[-1]:g}")
        return self.nearest_frame(time)

    def bodies(self) -> NDArray[np.int64]:
        """Body number per node (n_node): nodes that elements connect have the same; -1: none."""
        body = np.full(len(self.points), -1, dtype=np.int64)
        used = np.concatenate(self.cells)
        body[used] = used
        sizes = {len(c) for c in self.cells}
        groups = [np.array([c for c in self.cells if len(c) == size]) for size in sizes]
        while True:
            before = body.copy()
            for group in groups:
                lowest = np.repeat(body[group].min(axis=1)[:, None], group.shape[1], axis=1)
                np.minimum.at(body, group, lowest)
            body[used] = body[body[used]]
            if np.array_equal(body, before):
                break
        numbers = {root: k for k, root in enumerate(np.unique(body[used]))}
        return np.array([numbers.get(root, -1) for root in body], dtype=np.int64)

    def refresh(self) -> int:
        """Look again at a file that a run is writing; returns the number of frames."""
        self._root()
        fresh = open_file(self.path)
        self._file.close()
        self._file = fresh
        with guarded(self.path, "the mesh"):
            self._read_mesh()
        return len(self.times)

    def close(self) -> None:
        """Close the file; harmless if it is closed. What was read stays valid."""
        self._file.close()

    def __enter__(self) -> FieldFile:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()


class FieldSeries:
    """One field at all frames, like an array (n_frame, n[, n_comp]) of which parts are read.

    The first index is the frame, a number or a slice; the others are those of an array: `f[-1]`,
    `f[::10]`, `f[:, 12]`, `f[5, :, 0]`. `numpy.asarray(f)` reads all. Raises `IndexError` for a
    frame that is not there.
    """

    def __init__(self, file: FieldFile, group: str, name: str) -> None:
        self._field_file = file
        self._place = (group, name)
        root = file._root()
        with guarded(file.path, f"field {name}"):
            components = tuple(root[group][name].shape[1:])
        self.name = name
        self.times = file.times                                  #: (n_frame) [T]
        n = len(file.points) if group == "PointData" else len(file.cells)
        self._n_row = n if group == "PointData" else file._n_row       # of a frame in the file
        self.shape: tuple[int, ...] = (len(self.times), n, *components)
        self.dtype = np.dtype(np.float64)

    @property
    def ndim(self) -> int:
        return len(self.shape)

    def __len__(self) -> int:
        return self.shape[0]

    def __iter__(self) -> Iterator[Array]:
        return (self[k] for k in range(len(self)))

    def __getitem__(self, key: Any) -> Array:
        first, *rest = key if isinstance(key, tuple) else (key,)
        if isinstance(first, slice):
            frames = range(*first.indices(len(self)))
            values = [self._frame(k, rest) for k in frames]
            return np.stack(values) if values else np.empty((0, *self.shape[1:]))[:, *rest]
        if not isinstance(first, (int, np.integer)):
            raise TypeError(f"{self.name}: a frame is a number or a slice, not {first!r}")
        frame = int(first)
        if not -len(self) <= frame < len(self):
            raise IndexError(f"{self.name} has {len(self)} frames; there is no frame {frame}")
        return self._frame(frame % len(self), rest)

    def at(self, time: float) -> Array:
        """The field at the frame nearest to `time` [T]: (n) or (n, n_comp).

        Raises `ResultError` for a time outside the run.
        """
        return self[self._field_file.frame_at(time)]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        if copy is False:
            raise ValueError(f"{self.name} is in a file: an array of it is a copy")
        return self[:].astype(dtype or self.dtype, copy=False)

    def __repr__(self) -> str:
        return f"FieldSeries({self.name!r}, shape={self.shape})"

    def all_rows(self, frame: int) -> Array:
        """One frame as it is in the file: fields of cells at the lines of profiles, too."""
        return self._read(frame, slice(0, self._n_row))

    def _frame(self, frame: int, rest: list[Any]) -> Array:
        """Part `rest` of one frame; of a single node only its row is read."""
        n = self.shape[1]
        row = rest[0] if rest and isinstance(rest[0], (int, np.integer)) else None
        if row is None:
            return np.asarray(self._read(frame, slice(0, n))[tuple(rest)])
        if not -n <= row < n:
            raise IndexError(f"{self.name} has {n} rows in a frame; there is no row {row}")
        only = int(row) % n
        return np.asarray(self._read(frame, slice(only, only + 1))[0][tuple(rest[1:])])

    def _read(self, frame: int, rows: slice) -> Array:
        """Some rows of one frame."""
        group, name = self._place
        root = self._field_file._root()
        path = self._field_file.path
        with guarded(path, f"field {name} at frame {frame}"):
            offsets = root["Steps"].get(f"{group}Offsets/{name}")
            data = root[group][name]
            # offsets may be missing: then each frame is written anew
            start = frame*self._n_row if offsets is None else -1
            if offsets is not None and frame < len(offsets):
                start = int(offsets[frame])
            if start < 0 or start + max(self.shape[1], rows.stop) > len(data):
                raise ResultError(f"{path}: field {name} ends before frame {frame}")
            values: Array = np.asarray(data[start + rows.start:start + rows.stop], dtype=np.float64)
        return values


def _outline(cell: NDArray[np.int64], kind: int) -> NDArray[np.int64]:
    """The nodes of a cell along its outline: quadratic ones have the middles behind the corners."""
    if kind not in QUADRATIC:
        return cell
    half = len(cell)//2
    return np.column_stack([cell[:half], cell[half:]]).ravel()
