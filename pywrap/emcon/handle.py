"""A library model held by Python: calls to it, one at a time, and their errors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NoReturn

from . import _core
from .errors import InputError, check, message
from .given import raise_kept, uninterrupted


class Handle:
    """A library model, none at first: to be read by `open`, freed by `close`.

    The library lets other threads run while it works, so a call while another one is under way
    raises `InputError` instead of meeting it in the same model.
    """

    def __init__(self) -> None:
        self.address = 0
        #: Counts what makes evaluations stale, and what replaces the report of constraints.
        self.n_changes = 0
        self.n_reports = 0
        self._is_busy = False
        #: Functions of Python that the model calls; they live as long as it does.
        self.given: list[Any] = []

    def open(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Make the model by `function(*arguments)`, which returns the status and its address."""
        status, self.address = function(*arguments)
        check(self.address, status)

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """`function(address, *arguments)` without its first result, the status.

        One result comes as it is, several as a tuple. Raises what the status stands for.
        """
        # No lock: Ctrl-C between taking one and the `try` would leave it taken. CPython looks for
        # signals and other threads at calls and loops only, and there is none in these lines.
        if self._is_busy:
            raise InputError("this stepper is in use by another thread, or by the call that a "
                             "function of yours was called from")
        try:
            self._is_busy = True
            if not self.address:
                raise InputError(message(0))
            found = (uninterrupted(function, self.address, *arguments) if self.given
                     else function(self.address, *arguments))
            values = found if isinstance(found, tuple) else (found,)
            raise_kept(self.given, values[0], self._text)
            check(self.address, values[0])
        finally:
            self._is_busy = False
            for item in self.given:
                item.exception = None
        return values[1] if len(values) == 2 else values[1:]

    def _text(self) -> str:
        """Of the last error."""
        return message(self.address)

    def change(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """The same for calls after which evaluations no longer belong to the model."""
        self.n_changes += 1
        return self.call(function, *arguments)

    def close(self) -> None:
        """Free the model; harmless when closed."""
        if self._is_busy:
            raise InputError("this stepper is in use by another thread: it cannot be closed")
        address, self.address = self.address, 0
        self.n_changes += 1
        if address:
            _core.emcon_close(address)
        self.given = []

    def __reduce__(self) -> NoReturn:
        raise TypeError("a stepper cannot be copied or sent to another process; use save, or "
                        "write_restart and from_restart")

    def __del__(self) -> None:
        if getattr(self, "address", 0):
            self.close()
