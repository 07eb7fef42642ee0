"""Cards of a deck that remember which line of Python made them."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from textwrap import dedent
from typing import Any, Literal, NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .deck_text import field, set_text, table
from .arguments import content
from .errors import InputError

_PACKAGE = os.path.dirname(os.path.abspath(__file__)) + os.sep
_LARGEST_LABEL = 2**31 - 1
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f\x7f\ud800-\udfff]")

#: A number, or `"<name>"`: the value of a parameter.
Number: TypeAlias = float | str
#: Nodes or elements: the name of a set, a number, or several of them.
Where: TypeAlias = str | int | Sequence[str | int] | NDArray[np.integer[Any]]
Dof: TypeAlias = Literal[1, 2, 3, 4, 5, 6] | tuple[Literal[1, 2, 3, 4, 5, 6], ...]
Numbers: TypeAlias = NDArray[np.int64]
_Cards = TypeVar("_Cards", bound="Cards")


class Block(NamedTuple):
    """Lines of a deck, each with its line end, that one call made."""

    text: str
    file: str
    line: int
    written: str = ""          # what stands in the place of `text` in a file


class Numbering:
    """Labels of the nodes, or of the elements, that a model was given as arrays.

    `rows`: callers count from 0 in the order given; else they name labels.
    """

    def __init__(self, what: str, rows: bool) -> None:
        self.what = what
        self.rows = rows
        self.count = 0
        self.n_dim = 2              # coordinates of nodes
        self._parts: list[Numbers] = []

    def extend(self, n: int, labels: ArrayLike | None) -> Numbers:
        """Labels (n,) of new members: those given, or the next ones from `count` + 1 on."""
        if labels is None and not self.rows:
            raise InputError(f"labels of new {self.what}s are to be given: the model has labels")
        new = (np.arange(self.count + 1, self.count + n + 1) if labels is None
               else whole(labels, f"labels of {self.what}s", (n,)))
        _refuse_outside(new, f"{self.what}s")
        self._parts.append(new)
        self.count += n
        return new

    def labels(self, numbers: ArrayLike, what: str,
               shape: tuple[int | None, ...] = (None,)) -> Numbers:
        """Labels of members, same shape. Raises `InputError` for rows that are not there."""
        wanted = whole(numbers, what, shape)
        if not self.rows:
            _refuse_outside(wanted, what)
            return wanted
        missing = (wanted < 0) | (wanted >= self.count)
        if missing.any():
            there = f"0 to {self.count - 1}" if self.count else "none"
            raise InputError(f"{what}: there is no {self.what} {wanted[missing].flat[0]}; rows of "
                             f"{self.what}s are {there}")
        if len(self._parts) > 1:
            self._parts = [np.concatenate(self._parts)]
        return self._parts[0][wanted] if self._parts else wanted


class Cards:
    """What may stand in a model and in a step, and how all cards are written.

    Methods return the object itself, so that calls can be chained. They raise `InputError` for
    arguments that cannot stand in a deck; what a deck cannot mean is told, with file and line of
    the call, when a stepper reads it.
    """

    def __init__(self, nodes: Numbering, elements: Numbering) -> None:
        self._blocks: list[Block] = []
        self._nodes, self._elements = nodes, elements

    # --- writing ---------------------------------------------------------------------------

    def _add(self, text: str) -> None:
        self._blocks.append(Block(text, *caller()))

    def _card(self: _Cards, keyword: str, options: Mapping[str, object] | None = None,
              rows: Iterable[Sequence[object]] = (), data: str = "") -> _Cards:
        self._add(card(keyword, options, rows, data))
        return self

    def _valued(self, keyword: str, where: Where, dof: Dof, value: Number | ArrayLike,
                options: Mapping[str, object], twice: bool = False) -> None:
        """Data lines `node, dof, value` (`twice`: `node, dof, dof, value`)."""
        what = f"*{keyword}"
        axes = np.atleast_1d(whole(dof, f"degree of freedom of {what}", (None,)*np.ndim(dof)))
        turns = (6,) if self._nodes.n_dim == 2 else (4, 5, 6)
        if axes.ndim != 1 or not np.isin(axes, (1, 2, 3, *turns)).all() or not len(axes):
            raise InputError(f"{what}: a degree of freedom is 1, 2 or 3, or {', '.join(map(str, turns))}, the "
                             f"rotation of the reference node of a rigid body, not {dof!r}")
        names = self._names(where, self._nodes, what)
        if isinstance(value, str):
            rows = [(name, *([axis]*(2 if twice else 1)), value) for name in names
                    for axis in axes.tolist()]
            self._card(keyword, options, rows)
            return
        values = real(value, f"value of {what}")
        shape = (len(names), len(axes))
        if values.ndim == 1 and len(values) == shape[0] and len(axes) == 1:
            values = values[:, None]
        if values.ndim > 2 or any(m not in (1, n) for m, n in zip(values.shape[::-1],
                                                                    shape[::-1])):
            raise InputError(f"value of {what} is one number, ({len(axes)},) or {shape} numbers, "
                             f"not an array of shape {values.shape}")
        flat = np.broadcast_to(values, shape).ravel()
        axis = np.tile(axes, len(names))
        if isinstance(names, np.ndarray):
            columns = [np.repeat(names, len(axes)), *([axis]*(2 if twice else 1)), flat]
            self._card(keyword, options, data=table(*columns))
        else:
            place = np.repeat(np.arange(len(names)), len(axes))
            self._card(keyword, options,
                       [(names[i], *([a]*(2 if twice else 1)), v)
                        for i, a, v in zip(place.tolist(), axis.tolist(), flat.tolist())])

    def _names(self, where: Where, numbering: Numbering, what: str) -> list[str | int] | Numbers:
        """Set names as they are, numbers as labels; at least one."""
        if isinstance(where, str):
            return [where]
        if isinstance(where, (list, tuple)) and any(isinstance(item, str) for item in where):
            return [item if isinstance(item, str)
                    else int(numbering.labels([item], what)[0]) for item in where]
        array = np.atleast_1d(array_of(where, what))
        if not array.size:
            raise InputError(f"{what}: no {numbering.what} is named")
        return numbering.labels(array, what)

    # --- cards of models and steps ---------------------------------------------------------

    def cards(self: _Cards, text: str) -> _Cards:
        """Add cards as text of docs/deck.md; common indentation and empty lines go.

        Raises `InputError` where it does not begin with a card or a comment.
        """
        lines = text_lines(dedent(text))
        if lines and not lines[0].lstrip().startswith("*"):
            raise InputError(f"cards begin with a keyword line, *KEYWORD, not with {lines[0]!r}")
        if lines:
            self._add("\n".join(lines) + "\n")
        return self

    def node_set(self: _Cards, name: str, nodes: Where) -> _Cards:
        """`*NSET`: a set of nodes (k,), or of nodes and sets; it adds to an earlier one."""
        return self._set("NSET", name, nodes, self._nodes)

    def nodes_of(self: _Cards, name: str, elements: str) -> _Cards:
        """`*NSET, ELSET=`: the node set `name` of all nodes of the element set `elements`."""
        return self._card("NSET", {"NSET": name, "ELSET": elements})

    def element_set(self: _Cards, name: str, elements: Where) -> _Cards:
        """`*ELSET`: a set of elements (k,), or of elements and sets; it adds to an earlier one."""
        return self._set("ELSET", name, elements, self._elements)

    def _set(self: _Cards, card: str, name: str, where: Where, numbering: Numbering) -> _Cards:
        name = field_of(name, f"name of a {numbering.what} set")
        if name.upper() == "ALL":
            raise InputError(f"the {numbering.what} set ALL holds all {numbering.what}s; choose "
                             "another name")
        names = self._names(where, numbering, f"{numbering.what} set {name}")
        if isinstance(names, np.ndarray):
            self._add(set_text(card, name, names))
            return self
        return self._card(card, {card: name}, [(item,) for item in names])

    def amplitude(self: _Cards, name: str, times: ArrayLike, values: ArrayLike, *,
                  time: Literal["STEP TIME", "TOTAL TIME"] = "STEP TIME",
                  definition: Literal["TABULAR", "SMOOTH STEP"] = "TABULAR") -> _Cards:
        """`*AMPLITUDE`: factors `values` (k,) at `times` (k,) [T], ascending.

        definition   between the times: TABULAR, lines; SMOOTH STEP, curves whose slope and
                     curvature are 0 at each of the times
        """
        t, a = real(times, "times of an amplitude"), real(values, "values of an amplitude")
        if t.ndim != 1 or t.shape != a.shape or not len(t):
            raise InputError("times and values of an amplitude are arrays (k,) of one length, not "
                             f"{t.shape} and {a.shape}")
        return self._card("AMPLITUDE", {"NAME": name, "DEFINITION": definition, "TIME": time},
                          data=table(t, a))

    def time_points(self: _Cards, name: str, times: ArrayLike | None = None, *,
                    generate: Sequence[Number] | None = None) -> _Cards:
        """`*TIME POINTS`: times (k,) [T] for output, ascending, from the start of the step.

        generate   instead of times: first, last, distance
        """
        if (times is None) == (generate is None):
            raise InputError("time points are given either by times or by generate")
        if generate is not None:
            if len(generate) != 3:
                raise InputError("generate is first, last, distance")
            return self._card("TIME POINTS", {"NAME": name, "GENERATE": True}, [generate])
        t = real(times, "time points")
        if t.ndim != 1 or not len(t):
            raise InputError(f"time points are an array (k,), not {t.shape}")
        return self._card("TIME POINTS", {"NAME": name}, [(value,) for value in t.tolist()])

    def boundary(self: _Cards, where: Where, dof: Dof | None = None,
                 value: Number | ArrayLike = 0.0, *, amplitude: str | None = None,
                 delay: Number | None = None, fixed: bool = False,
                 op: Literal["MOD", "NEW"] | None = None) -> _Cards:
        """`*BOUNDARY`: prescribe displacements [L]; before the first step as in it.

        dof        1, 2, 3 or some of them; of the reference node of a rigid body 6, in three
                   dimensions 4, 5 and 6 too: rotations, radians; default all displacements:
                   (1, 2), in three dimensions (1, 2, 3)
        value      one for all, (n_dof,), or (k, n_dof) for k nodes
        delay      time by which the amplitude is shifted [T]
        fixed      hold the degrees of freedom where the step finds them
        op         NEW: remove all supports of earlier steps
        """
        if dof is None:
            dof = (1, 2) if self._nodes.n_dim == 2 else (1, 2, 3)
        self._valued("BOUNDARY", where, dof, value,
                     {"OP": op, "AMPLITUDE": amplitude, "TIME DELAY": delay, "FIXED": fixed,
                      "TYPE": "DISPLACEMENT"},
                     twice=True)
        return self


def _refuse_outside(labels: Numbers, what: str) -> None:
    """Refuse labels that a deck cannot hold."""
    outside = labels[(labels < 1) | (labels > _LARGEST_LABEL)]
    if outside.size:
        raise InputError(f"{what}: labels are from 1 to {_LARGEST_LABEL}, not {outside[0]}")


def card(keyword: str, options: Mapping[str, object] | None = None,
         rows: Iterable[Sequence[object]] = (), data: str = "") -> str:
    """Text of a card: `*KEYWORD, OPTION=value`, then data lines.

    options   None and False leave one out, True gives its name alone
    rows      entries of data lines
    data      further data lines, with line ends
    """
    line = f"*{keyword}"
    for name, value in (options or {}).items():
        if value is not None and value is not False:
            line += f", {name}"
            line += "" if value is True else f"={entry(value, f'{name} of *{keyword}')}"
    body = "".join(", ".join([entry(value, f"*{keyword}") for value in row]) + "\n"
                   for row in rows)
    return f"{line}\n{body}{data}"


def caller() -> tuple[str, int]:
    """File and line of the innermost call from outside this package."""
    frame = sys._getframe(1)
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        frame = frame.f_back
    return frame.f_code.co_filename, frame.f_lineno


def text_lines(text: str) -> list[str]:
    """Lines that are not empty, without blanks at their ends and bytes that no text has."""
    lines = [line.rstrip() for line in text.splitlines() if line.strip()]
    for line in lines:
        if _CONTROL.search(line):
            raise InputError(f"not a text: {line[:60]!r}")
    return lines


def entry(value: object, what: str) -> str:
    """`deck_text.field` with `InputError`."""
    try:
        return field(value, what)
    except ValueError as fault:
        raise InputError(str(fault)) from None


def field_of(name: object, what: str) -> str:
    """A name or a label as an entry."""
    if isinstance(name, (str, int, np.integer)):
        return entry(name, what)
    raise InputError(f"{what} is a text, not {name!r}")


def array_of(values: ArrayLike | None, what: str) -> NDArray[Any]:
    """Any array; `InputError` for lists of unlike lengths, and for masked entries."""
    if np.ma.is_masked(values):
        raise InputError(f"{what} has masked entries")
    try:
        return np.asarray(values)
    except ValueError as fault:
        raise InputError(f"{what}: {fault}") from None


def whole(values: ArrayLike, what: str, shape: tuple[int | None, ...]) -> Numbers:
    """Whole numbers of the given shape; None stands for any length."""
    array = array_of(values, what)
    if array.ndim != len(shape) or any(n not in (None, m) for n, m in zip(shape, array.shape)):
        wanted = ", ".join("k" if n is None else str(n) for n in shape)
        raise InputError(f"{what}: an array of shape ({wanted}) is wanted, not {array.shape}")
    if array.dtype.kind not in "iu" and array.size:
        raise InputError(f"{what}: whole numbers are wanted, not {content(array)}")
    return array.astype(np.int64)


def real(values: ArrayLike | None, what: str) -> NDArray[np.float64]:
    """Finite real numbers, as doubles."""
    array = array_of(values, what)
    if array.dtype.kind not in "fiu":
        raise InputError(f"{what}: real numbers are wanted, not {content(array)}")
    array = array.astype(np.float64)
    if not np.isfinite(array).all():
        place = np.unravel_index(int(np.argmin(np.isfinite(array))), array.shape)
        raise InputError(f"{what} is not finite: {array[place]}"
                         + (f" at {tuple(map(int, place))}" if place else ""))
    return array
