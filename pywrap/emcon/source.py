"""What the library reads: the text of a deck, where its lines come from, what is given with it."""

from __future__ import annotations

import os
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from . import _core
from .cards import Block, Cards, Numbering, caller
from .deck_text import number
from .errors import InputError
from .given import GivenLaw, GivenPotential, GivenSolid, PointFunction, Solid, node_shape
from .given_matrices import give_masses, given_mass
from .handle import Handle

_LARGEST_TEXT = 2**31 - 1


class Source(Cards):
    """Cards of a whole deck, and functions that are given with it. A `Stepper` reads it."""

    def __init__(self) -> None:
        super().__init__(Numbering("node", rows=True), Numbering("element", rows=True))
        self._place = caller()
        self._steps: list[Cards] = []
        self._overrides: dict[str, str] = {}
        self._lenient = False
        # given from outside, by `_give`
        self._laws: dict[str, PointFunction] = {}
        self._potentials: list[tuple[PointFunction, str | NDArray[np.int64] | None]] = []
        self._hosts: list[tuple[Solid, Any]] = []

    @classmethod
    def from_deck(cls, path: str | os.PathLike[str], *, lenient: bool = False,
                  **parameters: object) -> Self:
        """The model of the deck at `path`; parameters of the deck as keywords.

        The deck is read when a `Stepper` is made. With `lenient` output that is not
        supported is left out.
        Further steps may be added by calls. Raises `InputError` for a parameter that is no number
        and no line of text.
        """
        model = cls._labelled()
        model._lenient = lenient
        for name, value in parameters.items():
            model._overrides[name] = parameter_text(name, value)
        return model.include(path)

    @classmethod
    def _labelled(cls) -> Self:
        model = cls()
        model._nodes.rows = model._elements.rows = False
        return model

    def include(self, path: str | os.PathLike[str]) -> Self:
        """`*INCLUDE`: the cards of a file, relative to the working directory."""
        name = os.fsdecode(path)
        if not name.strip() or any(ord(c) < 32 or ord(c) == 127 for c in name):
            raise InputError(f"{name!r} is not the name of a deck")
        # quotes keep blanks and commas at the ends
        self._blocks.append(Block(f'*INCLUDE, INPUT="{name}"\n', *caller(),
                                  f'*INCLUDE, INPUT="{os.path.abspath(name)}"\n'))
        return self

    def build(self, handle: Handle) -> None:
        """Read the model into a handle, and build it.

        Raises `InputError`, and what given functions raise.
        """
        self.read(handle)
        handle.call(_core.emcon_build)

    def read(self, handle: Handle) -> None:
        """`build` without the building, for a state that is loaded instead."""
        blocks = self._all_blocks()
        text = "".join(block.text for block in blocks).encode(errors="surrogateescape")
        if len(text) > _LARGEST_TEXT:
            raise InputError("the text of the model is larger than 2 GB; use include")
        files = {file: i for i, file in enumerate(
            dict.fromkeys([self._place[0], *(block.file for block in blocks)]), 1)}
        places = np.array([(block.text.count("\n"), files[block.file], block.line, 0)
                           for block in blocks] or [(0, 1, self._place[1], 0)], dtype=np.int32)
        names = "\n".join(file.replace("\n", "?") for file in files)
        overrides = "\n".join(f"{name}={value}" for name, value in self._overrides.items())
        if b"\0" in text:
            raise InputError("a card of the model holds a character 0, which no deck has")
        handle.open(_core.emcon_read_passages, text, places, os.fsencode(names),
                    overrides.encode(), int(self._lenient))
        handle.given = self._give(handle.address)

    def _give(self, handle: int) -> list[Any]:
        """Hand over what is given from outside; returns what has to live with the model."""
        given: list[Any] = [GivenLaw(material, law) for material, law in self._laws.items()]
        given += [GivenPotential(f"potential {k}", function, nodes)
                  for k, (function, nodes) in enumerate(self._potentials, 1)]
        if self._hosts:
            shape = node_shape(handle)
            given += [GivenSolid(f"solid {k}", solid, *shape)
                      for k, (solid, _) in enumerate(self._hosts, 1)]
            give_masses(handle, [given_mass(mass, *shape) for _, mass in self._hosts
                                 if mass is not None])
        for item in given:
            item.give(handle)
        return given

    def _all_blocks(self) -> list[Block]:
        blocks = list(self._blocks)
        for step in self._steps:
            first = step._blocks[0]
            blocks += [*step._blocks, Block("*END STEP\n", first.file, first.line)]
        return blocks


def parameter_text(name: str, value: object) -> str:
    """The value of a parameter as text."""
    text = (value.strip() if isinstance(value, str)
            else str(int(value)) if isinstance(value, (int, np.integer)) else "")
    if isinstance(value, (float, np.floating)):
        text = number(float(value)) if np.isfinite(value) else ""
    if not text or not text.isprintable() or not name.isidentifier() or not name.isascii():
        raise InputError(f"parameter {name!r} = {value!r} cannot stand in a deck: a name is one "
                         "word, a value a finite number or one line of text")
    return text
