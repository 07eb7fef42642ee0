"""Results of a run: the history `NAME.csv` or `NAME.h5`, and the fields over time `NAME.vtkhdf`.

    with Results("ring") as ring:
        u = ring.fields["displacement"]          # (n_frame, n_node, 3) [L], nothing read yet
        u[-1], u[:, 12], u.at(2.5)               # a frame, a node over time, the frame at a time
        ring.history["total"]                    # (n_row)
        ring.series("TIP", "U").values           # (n_time, n_node, 2), of *NODE PRINT

Files are described in docs/deck.md. A run that was killed leaves files that open: a history row
or a frame that was not finished is left out.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import h5py
import numpy as np
from numpy.typing import NDArray

from .fields import FieldFile, FieldSeries
from .hdf5 import Array, MissingResult, ResultError, opened, read
from .series import HistoryFile, Series

__all__ = ["Array", "Bodies", "FieldFile", "FieldSeries", "HistoryFile", "Pairs", "ResultError",
           "ResultPaths", "Results", "Series", "asked_losses", "cpu_seconds", "energy_drift",
           "locate", "read_bodies", "read_contact_force", "read_history", "read_pairs",
           "read_wall_seconds"]

#: Columns of the history that count; all others are real numbers.
COUNTS = ("increment", "active", "newton", "cuts")


def _is_count(name: str) -> bool:
    """Of the run, or the active constraints of a pair."""
    return name in COUNTS or re.fullmatch(r"pair\d+_active", name) is not None


#: What every history has.
NEEDED = ("increment", "time", "kinetic", "strain", "external_work", "total")
#: A total energy below this fraction of the largest single energy is taken for zero.
ZERO_ENERGY = 64.0*float(np.finfo(np.float64).eps)

_SUFFIXES = (".vtkhdf", ".h5", ".csv", ".log", ".png", ".pvd")


@dataclass(frozen=True)
class ResultPaths:
    """The files of one run: `base` plus a suffix each."""

    base: Path

    def _beside(self, suffix: str) -> Path:
        return self.base.with_name(self.base.name + suffix)

    @property
    def field(self) -> Path:
        return self._beside(".vtkhdf")

    @property
    def surfaces(self) -> Path:
        return self._beside(".surfaces.vtkhdf")

    @property
    def history(self) -> Path:
        return self._beside(".h5")

    @property
    def table(self) -> Path:
        return self._beside(".csv")

    @property
    def log(self) -> Path:
        return self._beside(".log")

    @property
    def restart(self) -> Path:
        return self._beside(".rst.h5")

    @property
    def picture(self) -> Path:
        return self._beside(".png")


def locate(result: str | os.PathLike[str]) -> ResultPaths:
    """The files of the run that `result` names: its base name or any one of its files."""
    path = Path(result)
    if path.name.endswith(".rst.h5"):
        raise ResultError(f"{path} is a restart file; give {str(path)[:-len('.rst.h5')]}")
    if path.suffix == ".inp":
        raise ResultError(f"{path} is a deck, not a result; run it first, then give "
                          f"{path.with_suffix('')}")
    base = path.with_suffix("") if path.suffix in _SUFFIXES else path
    paths = ResultPaths(base)
    if base.suffix == ".surfaces" and not (paths.table.is_file() or paths.history.is_file()):
        base = base.with_suffix("")             # faces of contact beside the fields of a run
        paths = ResultPaths(base)
    if base.name in ("", "..") or not any(
            p.is_file() for p in (paths.table, paths.history, paths.field)):
        hint = "; that is a folder, give FOLDER/NAME" if path.is_dir() else ""
        raise MissingResult(f"no result {base}: neither {paths.table.name} nor "
                            f"{paths.history.name} nor {paths.field.name} is there{hint}")
    return paths


# --- history -----------------------------------------------------------------------------------

def read_history(paths: ResultPaths) -> NDArray[np.void]:
    """History as a structured array (n_row), one row per increment, the first the initial state.

    Columns as in docs/deck.md: `time` [T], `kinetic` [M L^2/T^2], `px` [M L/T], ... Read from
    the table NAME.csv, or where that is missing from the group `history` of NAME.h5.
    """
    if paths.table.is_file():
        history, source = _read_table(paths.table), paths.table
    elif paths.history.is_file():
        history, source = _read_history_group(paths.history), paths.history
    else:
        raise ResultError(f"no history: neither {paths.table} nor {paths.history} is there")
    missing = [name for name in NEEDED if name not in (history.dtype.names or ())]
    if missing:
        raise ResultError(f"{source} is not an EMCON history: no column {', '.join(missing)}")
    if not len(history):
        raise ResultError(f"{source} has no rows; the run ended before its first")
    return history


def _history_array(columns: dict[str, Sequence[float] | Array]) -> NDArray[np.void]:
    """Structured array from columns of the same length."""
    kind = [(name, np.int64 if _is_count(name) else np.float64) for name in columns]
    rows = min((len(values) for values in columns.values()), default=0)
    history = np.empty(rows, dtype=kind)
    for name, values in columns.items():
        history[name] = np.asarray(values[:rows])
    return history


def _read_table(path: Path) -> NDArray[np.void]:
    """NAME.csv; an unfinished last line is left out."""
    try:
        text = path.read_text(encoding="ascii")
    except (OSError, UnicodeDecodeError) as problem:
        raise ResultError(f"cannot read {path}: {_reason(problem)}") from None
    finished = text[:text.rfind("\n") + 1].splitlines()
    names = [word.strip() for word in finished[0].split(",")] if finished else []
    if "increment" not in names or len(set(names)) != len(names):
        raise ResultError(f"{path} is not an EMCON history: its first line does not name the "
                          "columns increment,time,...")
    rows = np.empty((len(finished) - 1, len(names)))
    for i, line in enumerate(finished[1:]):
        words = line.split(",")
        try:
            rows[i] = [float(word) for word in words]
        except ValueError:
            fault = (f"{len(words)} values where {len(names)} are due"
                     if len(words) != len(names) else "a value is not a number")
            raise ResultError(f"{path}:{i + 2}: {fault}") from None
    counts = [k for k, name in enumerate(names) if _is_count(name)]
    if not np.isfinite(rows[:, counts]).all():
        raise ResultError(f"{path}: a count among {', '.join(COUNTS)} is not a whole number")
    return _history_array({name: rows[:, k] for k, name in enumerate(names)})


def _read_history_group(path: Path) -> NDArray[np.void]:
    """Group `history` of NAME.h5: one data set (n_row) per column."""
    with opened(path) as file:
        group = file.get("history")
        if not isinstance(group, h5py.Group):
            raise ResultError(f"{path} is not an EMCON history: it has no group /history")
        return _history_array({name: read(group, name) for name in group
                               if isinstance(group[name], h5py.Dataset)
                               and group[name].ndim == 1})


def cpu_seconds(history: NDArray[np.void]) -> float | None:
    """CPU time of the run [s]; the column `cpu` counts up, from 0 again after a restart."""
    if "cpu" not in (history.dtype.names or ()):
        return None
    cpu = history["cpu"]
    return float(cpu[:-1][cpu[1:] < cpu[:-1]].sum() + cpu[-1])


def asked_losses(history: NDArray[np.void]) -> Array:
    """Energy that friction, damping and restitution took so far (n_row) [M L^2/T^2]."""
    columns = history.dtype.names or ()
    taken: Array = np.zeros(len(history))
    for name in ("friction_loss", "damping_loss", "contact_damping_loss", "restitution_loss"):
        if name in columns:
            taken = taken + history[name]
    return taken


def energy_drift(history: NDArray[np.void]) -> tuple[Array, float]:
    """Drift |total - total0|/scale (n_row), and the scale [M L^2/T^2].

    What friction, damping and restitution took (`asked_losses`) is no drift: it counts as still
    there. The scale is |total0|; where that is zero (a static run, a start from rest) it is the
    largest single energy of the run.
    """
    total = history["total"] + asked_losses(history)
    largest = max(float(np.nanmax(np.abs(history[name]), initial=0.0))
                  for name in ("kinetic", "strain", "external_work"))
    scale = abs(float(total[0]))
    if not scale > ZERO_ENERGY*largest:
        scale = largest
    change = np.abs(total - total[0])
    return (change/scale if scale > 0.0 else change), scale


@dataclass(frozen=True, repr=False)
class Bodies:
    """Mass and momenta of each body, rows as in the history."""

    mass: Array     #: (n_body) [M], 0 of profiles and quasi-static bodies
    px: Array       #: (n_row, n_body) [M L/T]
    py: Array       #: (n_row, n_body) [M L/T]
    lz: Array       #: (n_row, n_body) about the origin [M L^2/T]
    pz: Array | None = None     #: in space; None in the plane
    lx: Array | None = None
    ly: Array | None = None

    def __repr__(self) -> str:
        return f"Bodies({len(self.mass)} bodies, {len(self.px)} rows, mass {self.mass.tolist()})"

    @property
    def momentum(self) -> Array:
        """Linear momenta (n_row, n_body, n_dim) [M L/T]."""
        return np.stack([p for p in (self.px, self.py, self.pz) if p is not None], axis=2)

    def main(self) -> int:
        """Index of the body with the largest momentum at any time: the one that is thrown."""
        return int(np.argmax(np.max(np.linalg.norm(self.momentum, axis=2), axis=0)))

    def velocity(self, body: int, row: int) -> tuple[float, ...]:
        """Velocity [L/T] of the centre of mass of `body` in history row `row`."""
        return tuple((self.momentum[row, body]/self.mass[body]).tolist())


def read_bodies(paths: ResultPaths) -> Bodies | None:
    """Masses and momenta of the bodies, /sets/BODIES in NAME.h5; None if they are not there."""
    if not paths.history.is_file():
        return None
    with opened(paths.history) as file:
        group = file.get("sets/BODIES")
        if not isinstance(group, h5py.Group):
            return None
        try:
            mass, momentum = read(group, "MASS"), read(group, "MOMENTUM")
        except ResultError:
            return None
    mass = mass.ravel()
    fits = (momentum.ndim == 3 and momentum.shape[1] == len(mass)
            and momentum.shape[2] in (3, 6) and len(momentum) > 0)
    if not (fits and (mass >= 0.0).all() and (mass > 0.0).any()):
        return None
    if momentum.shape[2] == 3:
        return Bodies(mass, momentum[..., 0], momentum[..., 1], momentum[..., 2])
    px, py, pz, lx, ly, lz = np.moveaxis(momentum, 2, 0)
    return Bodies(mass, px, py, lz, pz, lx, ly)


def read_contact_force(paths: ResultPaths) -> tuple[Array, Array] | None:
    """Times (n_time) [T] and resultant of the forces on the slave nodes (n_time, n_dim) [M L/T^2].

    From `*CONTACT PRINT` with CF: /sets/CONTACT/TOTAL_CF or CF in NAME.h5; None without either.
    """
    if not paths.history.is_file():
        return None
    with opened(paths.history) as file:
        group = file.get("sets/CONTACT")
        if not isinstance(group, h5py.Group):
            return None
        name = next((name for name in ("TOTAL_CF", "CF") if name in group), None)
        if name is None or f"{name}_time" not in group:
            return None
        times, force = read(group, f"{name}_time"), read(group, name)
    rows = min(len(times), len(force))
    if force.ndim != 3 or rows == 0:
        return None
    return times[:rows], force[:rows].sum(axis=1)


@dataclass(frozen=True, repr=False)
class Pairs:
    """What the contact pairs transmit over time; second index the pair, in the order of the deck.

    Forces and moments about the origin are those on the slave side; those on the master side,
    kept for checks, are opposite to round-off.
    """

    slave: tuple[str, ...]      #: names of the surfaces
    master: tuple[str, ...]
    time: Array                 #: (n_time) [T]
    force: Array                #: (n_time, n_pair, n_dim) [M L/T^2]
    moment: Array               #: (n_time, n_pair), in space (n_time, n_pair, 3) [M L^2/T^2]
    master_force: Array         #: as `force`
    master_moment: Array        #: as `moment`
    length: Array               #: (n_time, n_pair) of the slave surface in contact [L]; in space
                                #: its area [L^2]
    active: NDArray[np.int64]   #: (n_time, n_pair) constraints that act

    def __repr__(self) -> str:
        names = ", ".join(map(" on ".join, zip(self.slave, self.master, strict=True)))
        return f"Pairs({names}; {len(self.time)} times)"


def read_pairs(result: ResultPaths | str | os.PathLike[str]) -> Pairs | None:
    """Totals of the contact pairs, /sets/PAIRS in NAME.h5; None if they are not there.

    They are written by `*CONTACT PRINT` with CF and TOTALS=YES or ONLY.

    result   what `locate` returns, or what it takes: a base name or a file of the run
    """
    paths = result if isinstance(result, ResultPaths) else locate(result)
    if not paths.history.is_file():
        return None
    with opened(paths.history) as file:
        group = file.get("sets/PAIRS")
        if not isinstance(group, h5py.Group) or "CF" not in group:
            return None
        extent = "CONTACT_AREA" if "CONTACT_AREA" in group else "CONTACT_LENGTH"
        time, on_slave, on_master, length, active = (
            read(group, name) for name in ("CF_time", "CF", "CF_MASTER", extent, "CNUM"))
        slave, master = (tuple(str(name) for name in np.char.decode(group[side][()], "utf-8"))
                         for side in ("SLAVE", "MASTER"))
    rows = min(map(len, (time, on_slave, on_master, length, active)))
    n_pair = len(slave)
    n_dim = 2 if extent == "CONTACT_LENGTH" else 3
    if (any(side.shape[1:] != (n_pair, 3*n_dim - 3) for side in (on_slave, on_master))
            or length.shape[1:] != (n_pair,) or active.shape[1:] != (n_pair,)):
        raise ResultError(f"{paths.history}: the data sets of /sets/PAIRS do not fit each other")
    turns: int | slice = 2 if n_dim == 2 else slice(3, None)
    return Pairs(slave, master, time[:rows], on_slave[:rows, :, :n_dim],
                 on_slave[:rows, :, turns], on_master[:rows, :, :n_dim],
                 on_master[:rows, :, turns], length[:rows], active[:rows].astype(np.int64))


def read_wall_seconds(paths: ResultPaths) -> float | None:
    """Wall time of the run [s], /sets/RUN/WALL_SECONDS in NAME.h5; None if it is not there."""
    if not paths.history.is_file():
        return None
    with opened(paths.history) as file:
        group = file.get("sets/RUN")
        if not isinstance(group, h5py.Group) or "WALL_SECONDS" not in group:
            return None
        return float(read(group, "WALL_SECONDS").ravel()[-1])


def _reason(problem: Exception) -> str:
    if isinstance(problem, UnicodeDecodeError):
        return "it is not a text file"
    return (problem.strerror if isinstance(problem, OSError) else None) or str(problem)


# --- all of a run ------------------------------------------------------------------------------

class Results:
    """The files of one run, each opened when it is first asked for.

    result   base name of the run (`build/run/ring`) or any one of its files

    A context manager. Raises `ResultError` where the run, or what is asked for, is not there, and
    after `close`. What was read before stays valid.
    """

    def __init__(self, result: str | os.PathLike[str]) -> None:
        self.paths = locate(result)
        self._fields: FieldFile | None = None
        self._surfaces: FieldFile | None = None
        self._series: HistoryFile | None = None
        self._history: NDArray[np.void] | None = None
        self._is_closed = False

    def __repr__(self) -> str:
        paths = (self.paths.field, self.paths.history, self.paths.table, self.paths.log)
        state = "closed" if self._is_closed else ", ".join(
            path.name for path in paths if path.is_file())
        return f"Results({str(self.paths.base)!r}): {state}"

    def _check(self) -> None:
        if self._is_closed:
            raise ResultError(f"the results of {self.paths.base} are closed")

    @property
    def fields(self) -> FieldFile:
        """The fields over time: `fields["displacement"]`."""
        self._check()
        if self._fields is None:
            self._fields = FieldFile(self.paths.field)
        return self._fields

    @property
    def surfaces(self) -> FieldFile:
        """The faces of contact in space over time: `surfaces.cell("contact_pressure", -1)`.

        Its points are nodes of `fields`, numbered by `surfaces.point("node", 0)`; -1 are points of
        walls.
        """
        self._check()
        if self._surfaces is None:
            self._surfaces = FieldFile(self.paths.surfaces)
        return self._surfaces

    @property
    def history(self) -> NDArray[np.void]:
        """The history, (n_row) with a column per name: `history["total"]`; see `read_history`."""
        self._check()
        if self._history is None:
            self._history = read_history(self.paths)
        return self._history

    def series(self, name: str, variable: str) -> Series:
        """A printed quantity over time; see `HistoryFile.series`."""
        return self._history_file().series(name, variable)

    @property
    def sets(self) -> dict[str, tuple[str, ...]]:
        """Names of the printed quantities, per set."""
        return self._history_file().sets

    def _history_file(self) -> HistoryFile:
        self._check()
        if self._series is None:
            self._series = HistoryFile(self.paths.history)
        return self._series

    def close(self) -> None:
        """Close all files; harmless if they are closed."""
        self._is_closed = True
        for file in (self._fields, self._surfaces, self._series):
            if file is not None:
                file.close()

    def __enter__(self) -> Results:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()
