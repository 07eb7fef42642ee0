"""Two results of the same model: the largest differences of fields and series."""

from __future__ import annotations

import math
import os
from collections.abc import Collection, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .results import Array, FieldFile, HistoryFile, ResultError, ResultPaths, locate, read_history

#: Times are the same if they differ by less than this fraction of the longer run: rounding of
#: sums of up to a million increments.
SAME_TIME = 1e-9
#: Reference positions are the same if they differ by less than this, over the extent of the mesh.
SAME_PLACE = 1e-9

#: Columns of the history that say how the state was reached, not what it is.
_EFFORT = ("increment", "h", "newton", "cuts", "penetration", "cpu", "time")
#: Columns that are measured by one scale, the largest of them.
_FAMILIES = (("kinetic", "strain", "external_work", "contact_work", "stabilization",
              "restitution_loss", "scheme_loss", "damping_loss", "friction_loss",
              "contact_damping_loss", "contact_energy", "total"),
             ("px", "py"))
_NO_SERIES = ("RUN",)


@dataclass(frozen=True)
class Difference:
    """The largest difference of one quantity over the common times."""

    group: str          #: fields, history, or the set of a series
    name: str
    largest: float      #: max |a - b|, units of the quantity; inf if only one of them is NaN
    scale: float        #: max of |a| and |b|; of energies, and of px and py, over all of them
    time: float         #: at which it is largest [T]
    place: str          #: where it is: row of the node or element, from 0; label in a set

    @property
    def relative(self) -> float:
        """The difference over the scale; 0 where both are 0."""
        if self.largest == 0.0:
            return 0.0
        return self.largest/self.scale if self.scale > 0.0 else math.inf


@dataclass(frozen=True, repr=False)
class Comparison:
    """Two runs side by side."""

    one: str
    other: str
    differences: tuple[Difference, ...]
    notes: tuple[str, ...]      #: what could not be compared

    def __repr__(self) -> str:
        return (f"Comparison({self.one!r}, {self.other!r}): {len(self.differences)} quantities, "
                f"largest relative difference {self.largest:.2e}")

    @property
    def largest(self) -> float:
        """The largest relative difference."""
        return max((d.relative for d in self.differences), default=0.0)

    def exceeding(self, tolerance: float) -> tuple[Difference, ...]:
        """The quantities whose relative difference is above `tolerance`."""
        return tuple(d for d in self.differences if not d.relative <= tolerance)

    def table(self, tolerance: float | None = None) -> str:
        """The differences as lines of text; those above `tolerance` are marked."""
        over = set() if tolerance is None else {id(d) for d in self.exceeding(tolerance)}
        lines = [f"{self.one} and {self.other}", "",
                 f"  {'':<32}{'difference':>12}{'relative':>12}{'at t':>12}  place"]
        group = ""
        for d in self.differences:
            if d.group != group:
                lines.append(f"  {d.group}")
            group = d.group
            lines.append(f"    {d.name:<30}{d.largest:>12.3g}{d.relative:>12.2e}{d.time:>12.6g}"
                         f"  {d.place}{'   *' if id(d) in over else ''}")
        lines += [f"  {note}" for note in self.notes]
        if tolerance is not None:
            lines += ["", f"  {len(over)} of {len(self.differences)} above the tolerance "
                          f"{tolerance:g}{' (*)' if over else ''}"]
        return "\n".join(lines)

    def __str__(self) -> str:
        return self.table()


def compare(one: str | os.PathLike[str], other: str | os.PathLike[str], *,
            only: Collection[str] = ()) -> Comparison:
    """Largest differences of two runs of one model, at their common times.

    one, other  base names of the runs, or any one of their files
    only        names of fields, columns of the history and series to compare; default all

    Times and counts of the effort are left out. Differences are relative to the largest value of
    the quantity in both runs; of energies, of px and py, to the largest of them. NaN equals NaN
    (a node without gap). Raises `ResultError` for results that are missing or broken, and where
    there is nothing to compare: no common time, no common quantity.
    """
    paths = locate(one), locate(other)
    notes: list[str] = []
    found = [*_history(paths, notes), *_series(paths, notes), *_fields(paths, notes)]
    chosen = tuple(d for d in found if not only or d.name in only)
    absent = [name for name in only if name not in {d.name for d in found}]
    if absent:
        raise ResultError(f"there is no {absent[0]} to compare; there are "
                          f"{', '.join(dict.fromkeys(d.name for d in found)) or 'none'}")
    if not chosen:
        raise ResultError(f"nothing to compare in {paths[0].base} and {paths[1].base}"
                          f"{': ' + '; '.join(notes) if notes else ''}")
    return Comparison(str(paths[0].base), str(paths[1].base), chosen, tuple(notes))


def common_times(a: Array, b: Array, same: float = SAME_TIME
                 ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows (k), (k) of the times that are in both `a` and `b` [T], both ascending.

    same      times this far apart, by the whole time, are one

    Of equal times (a step of no duration, a restart) the last one counts.
    """
    if not len(a) or not len(b):
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    slack = same*max(float(np.ptp(a)), float(np.ptp(b)))
    # the last row of b that is not later than a time of a
    row = np.searchsorted(b, a + slack, side="right") - 1
    is_common = (row >= 0) & (np.abs(b[np.maximum(row, 0)] - a) <= slack)
    is_common[:-1] &= np.diff(a) > slack
    return np.flatnonzero(is_common), row[is_common]


def _history(paths: tuple[ResultPaths, ResultPaths], notes: list[str]) -> Iterator[Difference]:
    if not all(p.table.is_file() or p.history.is_file() for p in paths):
        notes.append("not both have a history")
        return
    a, b = (read_history(p) for p in paths)
    rows = common_times(a["time"], b["time"])
    if not len(rows[0]):
        notes.append("the histories have no common time")
        return
    names = [n for n in a.dtype.names or () if n in (b.dtype.names or ()) and n not in _EFFORT]
    scales = {n: max(_largest(a[n][rows[0]]), _largest(b[n][rows[1]])) for n in names}
    for family in _FAMILIES:
        top = max((scales[n] for n in family if n in scales), default=0.0)
        scales.update({n: top for n in family if n in scales})
    for name in names:
        yield _difference("history", name, a["time"][rows[0]], a[name][rows[0]][:, None],
                          b[name][rows[1]][:, None], scales[name], [""])


def _series(paths: tuple[ResultPaths, ResultPaths], notes: list[str]) -> Iterator[Difference]:
    if not all(p.history.is_file() for p in paths):
        return
    with HistoryFile(paths[0].history) as one, HistoryFile(paths[1].history) as other:
        for name in one.sets:
            if name in _NO_SERIES:
                continue
            notes += [f"only {paths[1].base} has the series {name} {v}"
                      for v in other.sets.get(name, ()) if v not in one.sets[name]]
            for variable in one.sets[name]:
                if variable not in other.sets.get(name, ()):
                    notes.append(f"only {paths[0].base} has the series {name} {variable}")
                    continue
                a, b = one.series(name, variable), other.series(name, variable)
                rows = common_times(a.times, b.times)
                if a.values.shape[1:] != b.values.shape[1:] or not np.array_equal(a.labels,
                                                                                  b.labels):
                    notes.append(f"the series {name} {variable} are of different members")
                elif not len(rows[0]):
                    notes.append(f"the series {name} {variable} have no common time")
                else:
                    pair = a.values[rows[0]], b.values[rows[1]]
                    yield _difference(f"series {name}", variable, a.times[rows[0]], *pair,
                                      max(map(_largest, pair)), a.labels.tolist())


def _fields(paths: tuple[ResultPaths, ResultPaths], notes: list[str]) -> Iterator[Difference]:
    if not all(p.field.is_file() for p in paths):
        notes.append("not both have a field file")
        return
    with FieldFile(paths[0].field) as one, FieldFile(paths[1].field) as other:
        if not _same_mesh(one, other):
            notes.append("the meshes are not the same: fields are not compared")
            return
        rows = common_times(one.times, other.times)
        if not len(rows[0]):
            notes.append("the field files have no common time")
            return
        names = (*one.point_fields, *one.cell_fields)
        theirs = (*other.point_fields, *other.cell_fields)
        notes += [f"only {paths[0].base} has the field {n}" for n in names if n not in theirs]
        notes += [f"only {paths[1].base} has the field {n}" for n in theirs if n not in names]
        for name in names:
            if name in theirs:
                yield _field(one, other, name, rows)


def _field(one: FieldFile, other: FieldFile, name: str,
           rows: tuple[NDArray[np.int64], NDArray[np.int64]]) -> Difference:
    """One field, frame by frame: files may be larger than the memory."""
    a, b = one[name], other[name]
    if a.shape[1:] != b.shape[1:]:
        raise ResultError(f"the field {name} has shape {a.shape[1:]} in {one.path} and "
                          f"{b.shape[1:]} in {other.path}")
    what = "node" if name in one.point_fields else "element"
    places = [f"{what} row {k}" for k in range(a.shape[1])]
    worst: Difference | None = None
    scale = 0.0
    for i, j in zip(*rows):
        pair = a[int(i)][None], b[int(j)][None]
        scale = max(scale, *map(_largest, pair))
        here = _difference("fields", name, one.times[i:i + 1], *pair, scale, places)
        if worst is None or here.largest > worst.largest:
            worst = here
    assert worst is not None
    return Difference("fields", name, worst.largest, scale, worst.time, worst.place)


def _same_mesh(one: FieldFile, other: FieldFile) -> bool:
    if one.points.shape != other.points.shape or len(one.cells) != len(other.cells):
        return False
    if any(not np.array_equal(a, b) for a, b in zip(one.cells, other.cells)):
        return False
    size = float(np.ptp(one.points, axis=0).max())
    return bool(np.abs(one.points - other.points).max() <= SAME_PLACE*size)


def _largest(values: Array) -> float:
    values = np.abs(values)
    return float(np.max(values[np.isfinite(values)], initial=0.0))


def _difference(group: str, name: str, times: Array, a: Array, b: Array, scale: float,
                places: list[str] | list[int]) -> Difference:
    """Of values (n_time, n_member[, n_comp])."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    with np.errstate(invalid="ignore"):
        apart = np.where((a == b) | (np.isnan(a) & np.isnan(b)), 0.0, np.abs(a - b))
    apart = np.where(np.isnan(apart), np.inf, apart)
    if not apart.size:
        return Difference(group, name, 0.0, scale, float(times[0]), "")
    index = np.unravel_index(int(np.argmax(apart)), apart.shape)
    place = str(places[index[1]]) if len(index) > 1 else ""
    if len(index) > 2:
        place += f", component {index[2] + 1}"
    largest = float(apart[index])
    if largest == 0.0:
        place = ""
    return Difference(group, name, largest, scale, float(times[index[0]]), place)
