"""Text of input decks: numbers, sets, and a deck made of a mesh and of cards."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from itertools import pairwise
from pathlib import Path
from textwrap import dedent
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .mesh import Mesh

_PER_LINE = 16


def number(value: float) -> str:
    """Shortest text that reads back as the same double: `0.1`, `1e-05`, `3.`"""
    text = repr(float(value) + 0.0)           # -0.0 becomes 0.0
    return text[:-1] if text.endswith(".0") else text


def set_lines(kind: str, name: str, labels: Iterable[int]) -> list[str]:
    """`*NSET` or `*ELSET` (`kind`); labels in even steps are written with GENERATE."""
    items = [int(label) for label in labels]
    steps = {b - a for a, b in pairwise(items)}
    if len(items) > 2 and len(steps) == 1 and min(steps) > 0:
        return [f"*{kind}, {kind}={name}, GENERATE", f"{items[0]}, {items[-1]}, {steps.pop()}"]
    rows = [items[k:k + _PER_LINE] for k in range(0, len(items), _PER_LINE)]
    return [f"*{kind}, {kind}={name}"] + [", ".join(map(str, row)) for row in rows]


class Deck:
    """An input deck: a heading, parameters, a mesh, and cards as text.

    mesh        its nodes, elements, sets and surfaces
    heading     the first line goes to `*HEADING`, the others are comments
    parameters  for `*PARAMETER`: numbers, or text as it stands in a deck (`60./n`, `NULL SPACE`)

    `emcon run --set` and `Stepper(deck, name=value)` change parameters for one run. Raises
    `ValueError` for a parameter that a deck cannot hold.
    """

    def __init__(self, mesh: Mesh, heading: str = "",
                 parameters: Mapping[str, float | str] | None = None) -> None:
        self.mesh = mesh
        self.heading = heading
        self.parameters = dict(parameters or {})
        self._cards: list[str] = []
        for name, value in self.parameters.items():
            if not name.isidentifier() or "\n" in str(value) or not str(value).strip():
                raise ValueError(f"parameter {name!r} = {value!r} cannot stand in a deck: a name "
                                 "is one word, a value one line")

    def add(self, cards: str) -> Deck:
        """Append cards; common indentation and empty lines go. Returns the deck itself.

        The text is not checked here: `emcon check` does that. Raises `ValueError` where it does
        not begin with a card or a comment.
        """
        lines = [line.rstrip() for line in dedent(cards).splitlines() if line.strip()]
        if lines and not lines[0].lstrip().startswith("*"):
            raise ValueError(f"cards begin with a keyword line, *KEYWORD, not with {lines[0]!r}")
        self._cards += lines
        return self

    def lines(self) -> list[str]:
        """The deck, line by line without line ends: heading, parameters, mesh, cards."""
        lines = []
        first, *rest = self.heading.strip().splitlines() or [""]
        if first:
            lines += ["*HEADING", first] + [f"** {line}".rstrip() for line in rest]
        if self.parameters:
            lines.append("*PARAMETER")
            lines += [f"{name} = {value if isinstance(value, str) else number(value)}"
                      for name, value in self.parameters.items()]
        return lines + self.mesh.lines() + self._cards

    def __str__(self) -> str:
        return "\n".join(self.lines()) + "\n"

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the deck to a file; returns its path. Raises `OSError` where that fails."""
        return write_text(path, str(self))


def write_text(path: str | os.PathLike[str], text: str) -> Path:
    """Write `text` with line feeds on every system."""
    path = Path(path)
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(text)
    return path
