"""Errors of the compiled library as exceptions, with its own text."""

from __future__ import annotations

import ctypes

from . import _core


class InputError(ValueError):
    """A deck or an argument is wrong; the text says what, where and what to do."""


class MissingFile(InputError, FileNotFoundError):
    """A deck that is not there."""


class AnalysisError(ArithmeticError):
    """The analysis failed; the state is that of the last part that succeeded."""


_KINDS = {2: InputError, 3: AnalysisError, 4: OSError}


def check(handle: int, ierr: int) -> None:
    """Raise what the status `ierr` of a call with the model `handle` stands for; 0 is success."""
    if ierr:
        raise _KINDS.get(ierr, RuntimeError)(message(handle))


def message(handle: int) -> str:
    """Text of the last failure of a model, all messages of a deck one per line."""
    if not handle:
        return "the model is closed"
    return ctypes.string_at(_core.emcon_message(handle)).decode("utf-8", "replace").rstrip()
