"""The stepper: open a deck, step through it, read and set the state. Needs the extension."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .arguments import number, path_bytes, positive, real_array
from .conditions import Conditions
from .csr import Csr
from .errors import AnalysisError, InputError
from .handle import Handle
from .model import Model
from .queries import ConstraintReport, Evaluation, Queries, contact_arguments

__all__ = ["AnalysisError", "ConstraintReport", "Csr", "Evaluation", "Increment", "InputError",
           "PairTotal", "Snapshot", "Stepper"]

_flat = _core.emcon_flat
_given = _core.emcon_flat_given
_state = _core.emcon_flat_state

#: Times that differ by less than this part are the same: sums of many steps are rounded.
_SAME_TIME = 64*np.finfo(float).eps


@dataclass(frozen=True)
class Increment:
    """What one increment took: h and time in the deck's units, and counts.

    `penetration` is the deepest that geometry found at its end, per edge: both ways, nodes and
    edges of all surfaces in contact.
    """

    h: float
    time: float
    newton: int
    cuts: int
    active: int
    penetration: float


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


class Snapshot:
    """A state to come back to, of `Stepper.save`; `Stepper.restore` does."""

    def __init__(self, address: int) -> None:
        self._address = address

    def __reduce__(self) -> NoReturn:
        raise TypeError("a saved state cannot be copied or sent to another process; use "
                        "write_restart")

    def __del__(self) -> None:
        if hasattr(self, "_address"):
            _state.free_state(self._address)


class Stepper(Queries, Conditions):
    """A model at some point of its analysis; `model` is one, or the path of a deck.

    Parameters of the deck are given as keywords: ``Stepper("ring.inp", h=0.005)``. Arrays are
    copies, of shape (n_node, 2) where they belong to nodes. Any number of steppers live side by
    side; each may run in a thread of its own, but not in two at once: that raises `InputError`,
    as do a bad deck, bad arguments, and any call after `close`.

    Ctrl-C takes effect between increments. One that is under way is finished first; the stepper
    is then at its end and can go on. Where functions of yours are called in it, a second Ctrl-C
    does not wait.
    """

    def __init__(self, model: str | os.PathLike[str] | Model, *, lenient: bool = False,
                 **parameters: object) -> None:
        if not isinstance(model, Model):
            model = Model.from_deck(model, lenient=lenient, **parameters)
        elif lenient or parameters:
            raise InputError("parameters are given to Model.from_deck, not to the Stepper of a "
                             "Model")
        self._begin(model.build)

    def _begin(self, build: Callable[[Handle], None]) -> None:
        """A library model, made by `build` in its handle."""
        self._handle = Handle()
        try:
            build(self._handle)
            sizes = self._handle.call(_flat.model_size)
        except BaseException:
            self.close()
            raise
        (self.n_node, self.n_element, self.n_constraint, self.n_body, _, self.n_step,
         self.n_pair) = (int(size) for size in sizes)

    @classmethod
    def from_restart(cls, path: str | os.PathLike[str], model: Model | None = None) -> Stepper:
        """The stepper that a restart file holds, of `write_restart` or of a run of the program.

        It goes on to the same bits. `model` is needed where laws, potentials or a host's solid were
        given to it: these are not in the file. Raises `OSError` for what is no such file.
        """
        name = path_bytes(path)

        def build(handle: Handle) -> None:
            if model is not None:
                model.read(handle)
            handle.call(_state.read_restart, name)

        stepper = cls.__new__(cls)
        stepper._begin(build)
        return stepper

    def write_restart(self, path: str | os.PathLike[str]) -> None:
        """Write the deck, the state, and what was changed of the conditions of the present step."""
        name = path_bytes(path)
        if os.path.exists(name) and not os.path.isfile(name):
            raise OSError(f"{os.fsdecode(name)} is no file that could be replaced")
        self._handle.call(_state.write_restart, name)

    def close(self) -> None:
        """Free the model. Harmless when closed; any other call then raises `InputError`."""
        self._handle.close()

    def __enter__(self) -> Stepper:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()

    # ---- steps ------------------------------------------------------------------------------

    def step(self, h: float | None = None) -> Increment:
        """Advance: by one increment of the deck, beginning its next step where one is at its end.

        With `h` [T] by that much, under the conditions of the present step of the deck, also
        beyond its end. Where a step fails it is made in parts. Raises `AnalysisError` if that does
        not help: with `h` the state is that before the call, else that of the last part.
        """
        if h is None:
            counts, values = self._handle.change(_state.advance)
        else:
            counts, values = self._handle.change(_state.step, positive(h, "h"))
        return Increment(float(values[0]), float(values[1]), *map(int, counts), float(values[2]))

    def next_step(self) -> None:
        """Begin the next step of the deck at the present time, wherever that is."""
        self._handle.change(_state.next_step)

    def run(self, until: float | None = None,
            callback: Callable[[Stepper, Increment], bool | None] | None = None) -> int:
        """Advance by increments of the deck to its end, or to the first that reaches time `until`.

        ``callback(stepper, increment)`` is called after each; where it returns True the run stops
        there, None and False go on. What it raises ends the run as well. Returns the number of
        increments made; the stepper can go on in any case.
        """
        if until is not None:
            until = number(until, "until")
        if callback is not None and not callable(callback):
            raise InputError(f"the callback is to be a function, not {callback!r}")
        n = 0
        while not self.is_done:
            if until is not None:
                time = self.time
                if time >= until - _SAME_TIME*abs(time):
                    break
            increment = self.step()
            n += 1
            if callback is None:
                continue
            answer = callback(self, increment)
            if answer is not None and not isinstance(answer, (bool, np.bool_)):
                raise InputError(f"the callback returned {answer!r}; True stops the run, None and "
                                 "False go on")
            if answer:
                break
        return n

    @property
    def is_done(self) -> bool:
        """True after the last increment of the last step."""
        return bool(self._handle.call(_state.is_done))

    @property
    def time(self) -> float:
        """Total time [T]."""
        return float(self._progress()[0])

    @property
    def deck_step(self) -> int:
        """The present step of the deck, from 1."""
        return int(self._progress()[1][0])

    @property
    def n_unknown(self) -> int:
        """Equations of the present step of the deck."""
        return int(self._progress()[1][2])

    def _progress(self) -> tuple[float, NDArray[np.int32]]:
        return self._handle.call(_state.get_progress)

    @property
    def notes(self) -> list[str]:
        """Warnings of the deck, and what was done before the first step: moved nodes and so on."""
        count = int(self._handle.call(_flat.count_notes))
        return [self._handle.call(_flat.get_note, i + 1).decode("utf-8", "replace").rstrip()
                for i in range(count)]

    def node_set(self, name: str) -> NDArray[np.intp]:
        """The rows of a node set in arrays of nodes, (k,). Raises `InputError` if there is none."""
        if not isinstance(name, str) or not name.strip():
            raise InputError(f"a node set has a name, not {name!r}")
        return np.flatnonzero(self._handle.call(_given.find_nodes, name.encode(), self.n_node)[1])

    # ---- state ------------------------------------------------------------------------------

    @property
    def positions(self) -> NDArray[np.float64]:
        """Reference positions X, (n_node, 2) [L]."""
        return self._handle.call(_flat.get_positions, self.n_node)[0].T

    @property
    def labels(self) -> NDArray[np.int32]:
        """Node numbers of the deck, (n_node,)."""
        return self._handle.call(_flat.get_positions, self.n_node)[1]

    @property
    def u(self) -> NDArray[np.float64]:
        """Displacements, (n_node, 2) [L]."""
        return self._handle.call(_state.get_field, 1, self.n_node).T

    @property
    def q(self) -> NDArray[np.float64]:
        """Present positions X + u, (n_node, 2) [L]."""
        return self.positions + self.u

    @property
    def v(self) -> NDArray[np.float64]:
        """Velocities, (n_node, 2) [L/T]."""
        return self._handle.call(_state.get_field, 2, self.n_node).T

    @property
    def lam(self) -> NDArray[np.float64]:
        """Multipliers (contact forces, 0 where open), (n_constraint,) [M L/T^2]."""
        return self.contact()[0]

    @property
    def active(self) -> NDArray[np.bool_]:
        """Which constraints acted in the last step, (n_constraint,)."""
        return self.contact()[1]

    def set_state(self, *, u: ArrayLike | None = None, v: ArrayLike | None = None,
                  lam: ArrayLike | None = None, active: ArrayLike | None = None,
                  time: float | None = None) -> None:
        """Put the given parts in place of the present ones; on an error nothing changes.

        Shapes as of the properties. Dependent nodes of ties and equations follow the others.
        Energies and momenta are measured anew, the works stand. With `u` contact forces and
        reactions are zero until the next step. `time` [T] is total, not before the start of the
        present step of the deck. Raises `InputError`, and `AnalysisError` where `u` inverts an
        element.
        """
        shape = (self.n_node, 2)
        none = np.empty((0, 2))
        lam, active = contact_arguments(lam, active, self.n_constraint)
        self._handle.change(_state.set_state, none.T if u is None else real_array(u, "u", shape).T,
                            none.T if v is None else real_array(v, "v", shape).T, lam, active,
                            0.0 if time is None else number(time, "time"), int(time is not None))

    def save(self) -> Snapshot:
        """Keep the present state. It is freed with the object that is returned."""
        return Snapshot(int(self._handle.call(_state.save_state)))

    def restore(self, snapshot: Snapshot) -> None:
        """Go back, or forward, to a state of this stepper, or of one of the same deck.

        What follows has the same bits. Loads and boundary values are those of now.
        """
        if not isinstance(snapshot, Snapshot):
            raise InputError(f"a state of save() is needed, not {type(snapshot).__name__}")
        self._handle.change(_state.restore_state, snapshot._address)

    # ---- what follows from the state --------------------------------------------------------

    def contact(self) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.int32]]:
        """Multipliers (contact forces, 0 where open), active flags, slave node numbers.

        All of shape (n_constraint,): of all pairs, then of their guards, whose nodes may come again.
        """
        lam, active, label = self._handle.call(_state.get_contact, self.n_constraint)
        return lam, active.astype(bool), label

    def pressures(self) -> NDArray[np.float64]:
        """Contact pressures, 0 where open, (n_constraint,) [M/(L T^2)]: CSTR of the deck.

        `contact` tells the slave nodes.
        """
        return self._handle.call(_state.get_contact_values, 1, self.n_constraint)

    def gaps(self) -> NDArray[np.float64]:
        """Gaps, > 0 open, NaN where no surface is near, (n_constraint,) [L]: CDIS of the deck."""
        return self._handle.call(_state.get_contact_values, 2, self.n_constraint)

    def pairs(self) -> list[PairTotal]:
        """Totals of the last increment, one for each contact pair in the order of the deck.

        A pair that holds both sides counts twice: behind it stands its reverse.
        """
        total, active = self._handle.call(_state.get_pairs, self.n_pair)
        return [PairTotal(row[:3].copy(), row[3:6].copy(), float(row[6]), int(n))
                for row, n in zip(total.T, active)]

    def verdict(self) -> dict[str, Any]:
        """The verdict on the increments that led to this state: `NAME.json` of a run of the deck.

        "verdict" is "good" or "bad", "reasons" say why; with them stand the penetration that
        geometry found, the stand-off, the largest residual accepted, the energy error, and
        "warnings". A state that is restored has the verdict it had.
        """
        length = int(self._handle.call(_state.ask_verdict))
        text = self._handle.call(_state.get_verdict, length)
        verdict: dict[str, Any] = json.loads(text.decode("utf-8", "replace"))
        return verdict

    @property
    def ledger(self) -> dict[str, float]:
        """`energies` and `momenta` together."""
        names = ("kinetic", "strain", "potential", "external_work", "contact_work",
                 "stabilization", "total", "px", "py", "lz")
        return dict(zip(names, map(float, self._handle.call(_state.get_ledger))))

    def energies(self) -> dict[str, float]:
        """Energies and works [M L^2/T^2]: kinetic, strain, potential, external_work, contact_work,
        stabilization, total.

        `potential` is that of given forces; total = kinetic + strain + potential - external_work.
        """
        return dict(list(self.ledger.items())[:7])

    def momenta(self) -> dict[str, float]:
        """px, py [M L/T] and lz about the origin [M L^2/T]; of each body: `body_momenta`."""
        return dict(list(self.ledger.items())[7:])
