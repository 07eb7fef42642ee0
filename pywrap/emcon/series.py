"""History of a run, `NAME.h5`: columns and printed quantities over time, read when asked for."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import h5py
import numpy as np
from numpy.typing import NDArray

from .hdf5 import Array, ResultError, guarded, open_file, read


@dataclass(frozen=True, repr=False)
class Series:
    """A printed quantity over time."""

    times: Array                            #: (n_time) [T]
    labels: NDArray[np.int64]               #: (n_member) of the nodes or elements of the set
    values: Array                           #: (n_time, n_member[, n_comp]), units of the quantity

    def __repr__(self) -> str:
        return f"Series(values of shape {self.values.shape}, {len(self.times)} times)"


class HistoryFile:
    """The history of one run (NAME.h5), read when asked for: `file["total"]` is (n_row).

    Attributes: `columns`, names of the columns; `sets`, for each set the names of its variables.
    An unfinished row is left out. Raises `ResultError` for a file that is missing, foreign or
    damaged, for a name that it does not have, and after `close`.
    """

    def __repr__(self) -> str:
        return f"HistoryFile({str(self.path)!r}): {len(self.columns)} columns, {len(self.sets)} sets"

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self._file = open_file(self.path)
        try:
            with guarded(self.path, "the history"):
                group = self._file.get("history")
                if not isinstance(group, h5py.Group):
                    raise ResultError(f"{path} is not an EMCON history: it has no group /history")
                self.columns = tuple(name for name in group if isinstance(group[name], h5py.Dataset)
                                     and group[name].ndim == 1)
                self._rows = min((len(group[name]) for name in self.columns), default=0)
                self.sets = _variables(self._file.get("sets"))
        except BaseException:
            self._file.close()
            raise

    def _root(self) -> h5py.File:
        if not self._file:
            raise ResultError(f"{self.path} is closed")
        return self._file

    def __len__(self) -> int:
        return self._rows

    def __getitem__(self, column: str) -> Array:
        """A column of the history: (n_row), units as in docs/deck.md."""
        root = self._root()
        if column not in self.columns:
            raise ResultError(f"{self.path} has no column {column}; it has "
                              f"{', '.join(self.columns)}")
        return read(root["history"], column)[:self._rows]

    def series(self, name: str, variable: str) -> Series:
        """The quantity `variable` of the set `name`: ("TIP", "U"), ("CONTACT", "TOTAL_CF"), ..."""
        root = self._root()
        name, variable = name.upper(), variable.upper()
        if variable not in self.sets.get(name, ()):
            known = [f"{a} {b}" for a, names in self.sets.items() for b in names]
            raise ResultError(f"{self.path} has no series {name} {variable}; it has "
                              f"{', '.join(known) or 'none'}")
        with guarded(self.path, f"the series {name} {variable}"):
            group = root[f"sets/{name}"]
            values, times = read(group, variable), read(group, f"{variable}_time")
            if f"{variable}_label" in group:
                labels = read(group, f"{variable}_label").astype(np.int64)
            else:
                labels = np.arange(1, values.shape[1] + 1 if values.ndim > 1 else 2)
        rows = min(len(times), len(values))
        return Series(times[:rows], labels, values[:rows])

    def close(self) -> None:
        """Close the file; harmless if it is closed."""
        self._file.close()

    def __enter__(self) -> HistoryFile:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()


def _variables(sets: object) -> dict[str, tuple[str, ...]]:
    """Names of the variables over time, per set."""
    if not isinstance(sets, h5py.Group):
        return {}
    return {name: tuple(v for v in group if f"{v}_time" in group)
            for name, group in sets.items() if isinstance(group, h5py.Group)}
