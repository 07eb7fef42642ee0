"""What decks may say, as the library knows it: options that are one of a few words, and laws.

    OPTIONS["smoothing"]       # Option(word='NONE', code=1, ...), Option(word='HERMITE', ...)
    LAWS["yeoh"].constants     # ('C10', 'C20', 'C30', 'D1', 'D2', 'D3')

Needs the extension.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from . import _core

#: Room for the texts of a row.
_N_TEXT = 1024


@dataclass(frozen=True)
class Option:
    """A value of an option: its word in decks, its name in the C headers, what the log says.

    `models` are those that may have it, of "plane", "axial" and "space"; others use `instead`.
    """

    word: str
    code: int
    is_default: bool
    c_name: str
    text: str
    models: tuple[str, ...]
    instead: str


@dataclass(frozen=True)
class Law:
    """A row of the library's table of laws: what decks call it, and its constants."""

    name: str
    code: int
    keyword: str
    variant: str
    constants: tuple[str, ...]

    @property
    def family(self) -> str:
        """The name without its order: all orders of a law have it."""
        return self.name.rstrip("0123456789 ")

    @property
    def argument(self) -> str:
        """What `Model.material` calls it."""
        return (self.family if self.variant else self.keyword.lower()).replace(" ", "_").replace("-", "_")

    @property
    def order(self) -> int | None:
        """N of its card, if it has one."""
        digits = self.name[len(self.family):].strip()
        return int(digits) if digits else None

    @property
    def card(self) -> str:
        """The keyword with the parameter that chooses the law."""
        return f"{self.keyword}, {self.family.upper()}" if self.variant else self.keyword


def _rows(function: Callable[..., Any]) -> Iterator[tuple[list[int], list[str]]]:
    """Numbers and texts of all rows that a function of C gives one by one."""
    i = 0
    while True:
        status, *numbers, text = function(i, _N_TEXT)
        if status:
            return
        yield numbers, text.tobytes().split(b"\0")[0].decode().split("\n")
        i += 1


def _options() -> dict[str, tuple[Option, ...]]:
    found: dict[str, tuple[Option, ...]] = {}
    for (code, is_default), (kind, word, c_name, text, models, instead) in _rows(
            _core.emcon_get_option):
        row = Option(word, code, bool(is_default), c_name, text, tuple(models.split()), instead)
        found[kind] = (*found.get(kind, ()), row)
    return found


#: The options by their names, each with all values that it may have.
OPTIONS = _options()

#: Constitutive laws by name.
LAWS = {name: Law(name, code, keyword, variant, tuple(constants.split()))
        for (code,), (name, keyword, variant, constants) in _rows(_core.emcon_get_law)}


def words(kind: str) -> tuple[str, ...]:
    """The words of an option."""
    return tuple(row.word for row in OPTIONS[kind])


def host_choices(kind: str) -> dict[str, int]:
    """What a host may choose, those that C has a name for: codes by words, and by these names."""
    rows = [row for row in OPTIONS[kind] if row.c_name]
    codes = {row.word.lower(): row.code for row in rows}
    for row in rows:
        codes.setdefault(row.c_name.removeprefix("EMCON_").replace("_", " ").lower(), row.code)
    return codes
