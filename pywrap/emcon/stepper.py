"""The stepper: open a deck, step through it, read the state. Needs the compiled extension."""

from __future__ import annotations

import os
from dataclasses import dataclass
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from . import _core
from .errors import AnalysisError, InputError, check
from .model import Model

__all__ = ["AnalysisError", "Increment", "InputError", "PairTotal", "Stepper"]

_flat = _core.emcon_flat


@dataclass(frozen=True)
class Increment:
    """What one increment took: h and time in the deck's units, and counts."""

    h: float
    time: float
    newton: int
    cuts: int
    active: int


@dataclass(frozen=True)
class PairTotal:
    """What a contact pair transmits: sums over one side, and what is in contact.

    `slave` and `master` are fx, fy and the moment about the origin on that side, opposite to each
    other to round-off.
    """

    slave: NDArray[np.float64]
    master: NDArray[np.float64]
    length: float
    active: int


class Stepper:
    """A model at some point of its analysis; `model` is one, or the path of a deck.

    Parameters of the deck are given as keywords: ``Stepper("ring.inp", h=0.005)``. Arrays are
    copies, of shape (n_node, 2) where they belong to nodes. Any number of steppers live side by
    side; each may run in a thread of its own, but not in two at once. Raises `InputError` for a
    bad deck.
    """

    def __init__(self, model: str | os.PathLike[str] | Model, *, lenient: bool = False,
                 **parameters: object) -> None:
        if not isinstance(model, Model):
            model = Model.from_deck(model, lenient=lenient, **parameters)
        elif lenient or parameters:
            raise InputError("parameters are given to Model.from_deck, not to the Stepper of a "
                             "Model")
        self._handle = int(_flat.new_model())
        try:
            model.build(self._handle)
        except BaseException:
            self.close()
            raise
        sizes, ierr = _flat.model_size(self._handle)
        self._check(ierr)
        (self.n_node, self.n_element, self.n_constraint, self.n_body, self.n_unknown,
         self.n_step, self.n_pair) = (int(size) for size in sizes)

    def _check(self, ierr: int) -> None:
        check(self._handle, ierr)

    def close(self) -> None:
        """Free the model. Harmless when closed; any other call then raises `InputError`."""
        if self._handle:
            _flat.close_model(self._handle)
            self._handle = 0

    def __enter__(self) -> Stepper:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()

    def __del__(self) -> None:
        if getattr(self, "_handle", 0):
            self.close()

    def step(self) -> Increment:
        """Advance by one increment. Raises `AnalysisError` if it fails."""
        counts, times, ierr = _flat.advance(self._handle)
        self._check(ierr)
        return Increment(float(times[0]), float(times[1]), *(int(count) for count in counts))

    @property
    def is_done(self) -> bool:
        """True after the last increment of the last step."""
        done, ierr = _flat.is_done(self._handle)
        self._check(ierr)
        return bool(done)

    @property
    def positions(self) -> NDArray[np.float64]:
        """Reference positions X, (n_node, 2) [L]."""
        x, _, ierr = _flat.get_positions(self._handle, self.n_node)
        self._check(ierr)
        return x.T

    @property
    def labels(self) -> NDArray[np.int32]:
        """Node numbers of the deck, (n_node,)."""
        _, label, ierr = _flat.get_positions(self._handle, self.n_node)
        self._check(ierr)
        return label

    @property
    def u(self) -> NDArray[np.float64]:
        """Displacements, (n_node, 2) [L]."""
        return self._state()[0]

    @property
    def q(self) -> NDArray[np.float64]:
        """Present positions X + u, (n_node, 2) [L]."""
        return self.positions + self.u

    @property
    def v(self) -> NDArray[np.float64]:
        """Velocities, (n_node, 2) [L/T]."""
        return self._state()[1]

    def _state(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        u, v, ierr = _flat.get_state(self._handle, self.n_node)
        self._check(ierr)
        return u.T, v.T

    def contact(self) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.int32]]:
        """Multipliers (contact forces, 0 where open), active flags, slave node numbers.

        All of shape (n_constraint,).
        """
        lam, active, label, ierr = _flat.get_contact(self._handle, self.n_constraint)
        self._check(ierr)
        return lam, active.astype(bool), label

    def pairs(self) -> list[PairTotal]:
        """Totals of the last increment, one for each contact pair in the order of the deck."""
        total, active, ierr = _flat.get_pairs(self._handle, self.n_pair)
        self._check(ierr)
        return [PairTotal(row[:3].copy(), row[3:6].copy(), float(row[6]), int(n))
                for row, n in zip(total.T, active)]

    def energies(self) -> dict[str, float]:
        """Energies and works: kinetic, strain, external_work, contact_work, total."""
        names = ("kinetic", "strain", "external_work", "contact_work", "total")
        return dict(zip(names, map(float, self._ledger()[:5])))

    def momenta(self) -> dict[str, float]:
        """px, py [M L/T] and lz about the origin [M L^2/T]."""
        return dict(zip(("px", "py", "lz"), map(float, self._ledger()[5:])))

    def _ledger(self) -> NDArray[np.float64]:
        values, ierr = _flat.get_ledger(self._handle)
        self._check(ierr)
        return values
