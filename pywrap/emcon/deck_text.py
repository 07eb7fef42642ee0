"""Text of input decks: numbers, tables, sets, names, files."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

_PER_LINE = 16
_CHUNK = 512
_WORD = re.compile(r"[A-Za-z_][A-Za-z0-9 _.:+/$#&@^~|()\[\]{}-]*", re.ASCII)
_PARAMETER = re.compile(r"<[A-Za-z_][A-Za-z0-9_]*>", re.ASCII)
_LONGEST_NAME = 80


def number(value: float) -> str:
    """Shortest text that reads back as the same double: `0.1`, `1e-05`, `3.`"""
    text = repr(float(value) + 0.0)           # -0.0 becomes 0.0
    return text[:-1] if text.endswith(".0") else text


def table(*columns: NDArray[Any]) -> str:
    """Lines of the rows of two or more columns (n,), numbers as `number` writes them; n > 0.

    Whole numbers are not negative.
    """
    if all(column.dtype.kind in "iu" for column in columns):
        return _whole_table(np.column_stack(columns))
    parts = []
    for k in range(0, len(columns[0]), _CHUNK):
        lists = [(c + 0.0 if c.dtype.kind == "f" else c).tolist()
                 for c in (column[k:k + _CHUNK] for column in columns)]
        parts.append(repr(list(zip(*lists)))[2:-2].replace("), (", "\n") + "\n")
    return "".join(parts).replace(".0, ", "., ").replace(".0\n", ".\n")


def element_table(labels: NDArray[Any], nodes: NDArray[Any]) -> str:
    """Lines of elements: labels (m,), nodes (m, k); long ones go on in a second line."""
    if nodes.shape[1] < _PER_LINE:
        return table(labels, *nodes.T)
    first = table(labels, *nodes[:, :_PER_LINE - 1].T).splitlines()
    rest = table(*nodes[:, _PER_LINE - 1:].T).splitlines()
    return "".join(f"{a},\n{b}\n" for a, b in zip(first, rest, strict=True))


def _whole_table(values: NDArray[Any]) -> str:
    """The same for whole numbers (n, k), digit by digit for all of them at once."""
    n, k = values.shape
    rest = values.astype(np.uint32)
    width = len(str(int(rest.max())))
    text = np.empty((n, k, width + 2), dtype=np.uint8)
    text[:, :, -2:] = np.frombuffer(b", ", dtype=np.uint8)
    text[:, -1, -2:] = np.frombuffer(b"\n ", dtype=np.uint8)
    shown = np.ones(text.shape, dtype=bool)
    shown[:, -1, -1] = False
    for place in range(width - 1, -1, -1):
        if place < width - 1:
            shown[:, :, place] = rest > 0
        tens = rest//np.uint32(10)
        text[:, :, place] = rest - tens*np.uint32(10) + np.uint32(48)
        rest = tens
    return text[shown].tobytes().decode("ascii")


def set_text(kind: str, name: str, labels: Iterable[int]) -> str:
    """`*NSET` or `*ELSET` (`kind`); labels in even steps are written with GENERATE."""
    items = [int(label) for label in labels]
    steps = {b - a for a, b in pairwise(items)}
    if len(items) > 2 and len(steps) == 1 and min(steps) > 0:
        return f"*{kind}, {kind}={name}, GENERATE\n{items[0]}, {items[-1]}, {steps.pop()}\n"
    rows = [items[k:k + _PER_LINE] for k in range(0, len(items), _PER_LINE)]
    return f"*{kind}, {kind}={name}\n" + "".join(f"{str(row)[1:-1]}\n" for row in rows)


def field(value: object, what: str) -> str:
    """A number, a name or a choice as an entry of a card; `<name>` stands for a parameter.

    Raises `ValueError` for what would be read as anything else: numbers that are not finite, text
    with commas, line ends, quotes.
    """
    if isinstance(value, str):
        text = value.strip()
        if not (_PARAMETER.fullmatch(text) or _WORD.fullmatch(text)):
            raise ValueError(f"{what}: {value!r} cannot stand in a deck: a name is of letters, "
                             "digits and _ . : + - and begins with a letter; <name> stands for a "
                             "parameter")
        if len(text.replace(" ", "")) > _LONGEST_NAME:
            raise ValueError(f"{what}: {value[:20]!r}... has {len(text)} characters; names have "
                             f"up to {_LONGEST_NAME}")
        return text
    if isinstance(value, (int, np.integer)) and not isinstance(value, (bool, np.bool_)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        if not math.isfinite(value):
            raise ValueError(f"{what} is not finite: {value}")
        return number(float(value))
    raise ValueError(f"{what} is a number or a text, not {value!r}")


def write_text(path: str | os.PathLike[str], text: str) -> Path:
    """Write `text` with line feeds on every system."""
    path = Path(path)
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(text)
    return path
