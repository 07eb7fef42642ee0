"""HDF5 files of results: opening and reading, with errors for the user."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_TRUNCATED = re.compile(r"truncated file: eof = (\d+), .*stored_eof = (\d+)")


class ResultError(Exception):
    """A result that is missing, foreign, broken or closed; the text is for the user."""


class MissingResult(ResultError, FileNotFoundError):
    """A result that is not there."""


def open_file(path: Path) -> h5py.File:
    """Open for reading, without a lock: a run may still be writing."""
    if not path.is_file():
        raise ResultError(f"no file {path}")
    try:
        return h5py.File(path, "r", locking=False)
    except OSError as problem:
        cut = _TRUNCATED.search(str(problem))
        if cut:
            reason = (f"{cut[1]} of its {cut[2]} bytes are there; it was cut off, or a run is just "
                      "writing it")
        elif not path.stat().st_size:
            reason = "it is empty"
        else:
            reason = problem.strerror or "it is not an HDF5 file, or it is damaged"
        raise ResultError(f"cannot read {path}: {reason}") from None


@contextlib.contextmanager
def guarded(path: Path, what: str) -> Iterator[None]:
    """Turn what h5py raises at damaged files into a `ResultError`: cannot read `what`."""
    try:
        yield
    except (OSError, RuntimeError, KeyError, TypeError, ValueError, AttributeError, OverflowError,
            MemoryError) as problem:
        raise ResultError(f"{path}: cannot read {what}: the file is damaged, or a run is just "
                          f"writing it ({' '.join(str(problem).split())})") from None


@contextlib.contextmanager
def opened(path: Path) -> Iterator[h5py.File]:
    """The file for a `with` block, in which damage raises `ResultError`."""
    with open_file(path) as file, guarded(path, "the file"):
        yield file


def read(group: h5py.Group, name: str) -> Array:
    """A data set as an array of real numbers, of rank 1 at least."""
    with guarded(Path(group.file.filename), f"{group.name}/{name}"):
        data = group.get(name)
    if not isinstance(data, h5py.Dataset):
        raise ResultError(f"{group.file.filename} has no data set {group.name}/{name}")
    try:
        return np.atleast_1d(np.asarray(data[()], dtype=np.float64))
    except (OSError, TypeError, ValueError):
        raise ResultError(f"{group.file.filename}: cannot read {group.name}/{name}") from None
