"""Errors of the compiled library as exceptions, with its own text."""

from __future__ import annotations

from . import _core

_flat = _core.emcon_flat


class InputError(ValueError):
    """A deck or an argument is wrong; the text says what, where and what to do."""


class AnalysisError(ArithmeticError):
    """The analysis failed; the state is that of the last part that succeeded."""


_KINDS = {2: InputError, 3: AnalysisError, 4: OSError}


def check(handle: int, ierr: int) -> None:
    """Raise what the status `ierr` of a call with the model `handle` stands for; 0 is success."""
    if ierr:
        text = _flat.last_error(handle).decode("utf-8", "replace").rstrip()
        raise _KINDS.get(ierr, RuntimeError)(text)
