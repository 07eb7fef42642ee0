"""The model: what is to be analysed, as a deck says it. A `Stepper` analyses it."""

from __future__ import annotations

import os

from . import _core
from .errors import check

_flat = _core.emcon_flat


class Model:
    """A scene: mesh, materials, contact, steps. Made by `Model.from_deck`."""

    def __init__(self, deck: str | os.PathLike[str], overrides: str, lenient: bool) -> None:
        self._deck = os.fsencode(deck)
        self._overrides = overrides
        self._lenient = lenient

    @classmethod
    def from_deck(cls, path: str | os.PathLike[str], *, lenient: bool = False,
                  **parameters: object) -> Model:
        """The model of the deck at `path`; parameters of the deck as keywords.

        The deck is read when a `Stepper` is made. With `lenient` unknown keywords are passed over.
        """
        overrides = "\n".join(f"{name}={value}" for name, value in parameters.items())
        return cls(path, overrides, lenient)

    def build(self, handle: int) -> None:
        """Read the model into the new library model `handle`. Raises `InputError`."""
        check(handle, _flat.read_deck(handle, self._deck, self._overrides, int(self._lenient)))
        check(handle, _flat.build_model(handle))
