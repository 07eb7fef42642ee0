"""What emcon.h declares: the one list of signatures, from which Fortran's and Python's are made.

The size of an array stands behind it in the header: `double *u /* n_node x 2 */`; `or NULL` says
that an input may be left out, `in and out` that it is changed in place.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field


class Argument:
    """An argument of C, or the value of a structure."""

    def __init__(self, text: str) -> None:
        match = re.fullmatch(r"(const )?(\w+)\s*(\**)\s*(\w+)(?:\s*\[(.*)\])?", text.strip(),
                             re.DOTALL)
        if not match:
            raise SystemExit(f"emcon.h: not understood: {text}")
        const, self.kind, stars, self.name, comment = match.groups()
        parts = [part.strip() for part in (comment or "").split(",")]
        self.is_in, self.level = bool(const), len(stars)
        self.or_null, self.in_out = "or NULL" in parts, "in and out" in parts
        sizes = [part for part in parts if part and part not in ("or NULL", "in and out")]
        self.extents = sizes[0].split(" x ") if sizes else []
        self.ctype = (const or "") + self.kind


@dataclass
class Function:
    """A function, or a type of functions."""

    result: str
    name: str
    arguments: list[Argument]


@dataclass
class Header:
    """What a header declares."""

    functions: list[Function] = field(default_factory=list)
    pointers: dict[str, Function] = field(default_factory=dict)           # to functions
    structures: dict[str, list[Argument]] = field(default_factory=dict)
    opaque: set[str] = field(default_factory=set)
    constants: list[str] = field(default_factory=list)

    def __init__(self, text: str) -> None:
        """Read a header. Of its comments those behind arguments stay, in brackets."""
        text = re.sub(r"/\*((?:(?!\*/).)*)\*/(?=\s*[,)])", r"[\1]", text, flags=re.DOTALL)
        text = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
        self.opaque = set(re.findall(r"typedef struct (\w+) \1;", text))
        self.constants = re.findall(r"\b(EMCON_\w+) = \d", text)
        self.structures = {
            name: [Argument(part) for line in body.split(";") if line.strip()
                   for part in components(line.strip())]
            for body, name in re.findall(r"typedef struct \w+ \{(.*?)\} (\w+);", text, re.DOTALL)}
        self.pointers = {name: Function(result, name, arguments(rest)) for result, name, rest in
                         re.findall(r"typedef (\w+) \(\*(\w+)\)\(([^;]*)\);", text)}
        self.functions = [Function(result.strip(), name, arguments(rest)) for result, name, rest in
                          re.findall(r"^((?:const )?\w+ \*?)(emcon_\w+)\(([^;]*)\);", text,
                                     re.MULTILINE)]


def components(line: str) -> list[str]:
    """`double px, py` as the two that it declares."""
    kind, rest = re.fullmatch(r"((?:const )?\w+)\s+(.*)", line, re.DOTALL).groups()
    return [f"{kind} {name.strip()}" for name in rest.split(",")]


def arguments(text: str) -> list[Argument]:
    """Arguments at the commas that stand in no comment."""
    return [Argument(part) for part in re.split(r",(?![^\[]*\])", text) if part.strip()]
