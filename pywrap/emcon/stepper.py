"""The stepper: open a deck, step through it, read and set the state. Needs the extension."""

from __future__ import annotations

import html
import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .arguments import labels, number, path_bytes, positive, real_array
from .conditions import Conditions
from .csr import Csr
from .errors import AnalysisError, InputError, MissingFile
from .handle import Handle
from .memory import structure, text
from .meshes import Meshes
from .queries import ConstraintReport, Evaluation, Queries, contact_arguments, of_all
from .source import Source

if TYPE_CHECKING:
    from .results import Results

__all__ = ["AnalysisError", "ConstraintReport", "Csr", "Evaluation", "Increment", "InputError",
           "PairTotal", "Snapshot", "Stepper"]

#: Times that differ by less than this part are the same: sums of many steps are rounded.
_SAME_TIME = 64*np.finfo(float).eps
#: Momenta, by the number of dimensions.
_MOMENTA = {2: ("px", "py", "lz"), 3: ("px", "py", "pz", "lx", "ly", "lz")}


@dataclass(frozen=True)
class Increment:
    """One increment: its size h and the time at its end [T], and counts.

    `newton`: iterations over all cuts and active sets; `active`: active contacts. `penetration`:
    deepest overlap of bodies at the end, in edge lengths, from positions alone.
    """

    h: float
    time: float
    newton: int
    cuts: int
    active: int
    penetration: float


@dataclass(frozen=True)
class PairTotal:
    """Force, moment and size of a contact pair.

    `slave` and `master` are force [M L/T^2] and moment about the origin on that side, in the plane
    fx, fy, m, in space fx, fy, fz, mx, my, mz; they are opposite to each other up to round-off.
    `length` is the length of the slave surface in contact [L], in space its area [L^2]; `active` is
    the number of active contacts. `friction_loss` is the energy dissipated by friction since the
    start [M L^2/T^2]. A pair that stops nodes of both sides counts as two: the first has all of its
    loss, the second 0.
    """

    slave: NDArray[np.float64]
    master: NDArray[np.float64]
    length: float
    active: int
    friction_loss: float = 0.0


class Friction(NamedTuple):
    """Friction of all contacts, 0 without `*FRICTION`: CSHEAR and CSLIP of the deck."""

    shear: NDArray[np.float64]     #: (n_constraint, n_dim - 1) traction against slip [M/(L T^2)]
    status: NDArray[np.int32]      #: (n_constraint,) 1: sticks, 2: slides
    slip: NDArray[np.float64]      #: (n_constraint, n_dim - 1) since the start [L]
    path: NDArray[np.float64]      #: (n_constraint,) length of the path [L]


class Snapshot:
    """A saved state, made by `Stepper.save` for `Stepper.restore`."""

    def __init__(self, address: int) -> None:
        self._address = address

    def __repr__(self) -> str:
        return "a state of Stepper.save, for Stepper.restore"

    def __reduce__(self) -> NoReturn:
        raise TypeError("a saved state cannot be copied or sent to another process; use "
                        "write_restart")

    def __del__(self) -> None:
        if hasattr(self, "_address"):
            _core.emcon_free_snapshot(self._address)


class Stepper(Queries, Conditions, Meshes):
    """A model and the present state of its analysis; `model` is a `Model`, or the path of a deck.

    Parameters of the deck are given as keywords: ``Stepper("ring.inp", h=0.005)``. Arrays are
    copies; arrays of nodes have the shape (n_node, n_dim), `n_dim` 2 or 3. Any number of steppers
    may exist at once, each used by one thread at a time. A call from a second thread, a bad deck,
    bad arguments, and any call after `close` raise `InputError`.

    Ctrl-C takes effect at the end of the current increment, from which the stepper can continue. If
    functions of yours are called in an increment, a second Ctrl-C takes effect at once.
    """

    def __init__(self, model: str | os.PathLike[str] | Source, *, lenient: bool = False,
                 **parameters: object) -> None:
        if isinstance(model, Source):
            if lenient or parameters:
                raise InputError("parameters are given to Model.from_deck, not to the Stepper of "
                                 "a Model")
            self._begin(model.build)
            return
        try:
            self._begin(Source.from_deck(model, lenient=lenient, **parameters).build)
        except InputError:
            if os.path.exists(model):
                raise
            raise MissingFile(f"{model}: no such file, seen from {os.getcwd()}") from None

    def _begin(self, build: Callable[[Handle], None]) -> None:
        """A library model, made by `build` in its handle."""
        self._handle = Handle()
        self._base: str | None = None            # of the files of the last run with output=
        try:
            build(self._handle)
            sizes = self._sizes()
        except BaseException:
            self.close()
            raise
        self.n_node, self.n_element = sizes["n_node"], sizes["n_element"]
        self.n_constraint, self.n_pair = sizes["n_contact"], sizes["n_pair"]
        self.n_body, self.n_step = sizes["n_body"], sizes["n_step"]
        self.n_dim = sizes["n_dim"]

    @classmethod
    def from_restart(cls, path: str | os.PathLike[str], model: Source | None = None) -> Stepper:
        """A stepper from a restart file, of `write_restart` or of a run of the program.

        It continues with the same bits. `model` is needed if the file's model had laws, potentials
        or a host's solid: these are not in the file. Raises `OSError` if `path` is no restart file.
        """
        name = path_bytes(path)

        def build(handle: Handle) -> None:
            if model is None:
                handle.open(_core.emcon_load, name)
            else:
                model.read(handle)
                handle.call(_core.emcon_resume, name)

        stepper = cls.__new__(cls)
        stepper._begin(build)
        return stepper

    def write_restart(self, path: str | os.PathLike[str]) -> None:
        """Write deck, state and present conditions to a restart file. Raises `OSError`."""
        name = path_bytes(path)
        if os.path.exists(name) and not os.path.isfile(name):
            raise OSError(f"{os.fsdecode(name)} is no file that could be replaced")
        self._handle.call(_core.emcon_save, name)

    def close(self) -> None:
        """Free the model. Closing twice is harmless; any other call then raises `InputError`."""
        self._handle.close()

    def __enter__(self) -> Stepper:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()

    # ---- steps ------------------------------------------------------------------------------

    def set_threads(self, n: int) -> None:
        """Use `n` threads from now on; the default is `OMP_NUM_THREADS`, or 1.

        Results have the same bits for any number.
        """
        count = labels(n, "n")
        if count.size != 1:
            raise InputError(f"n is to be one number, not {n!r}")
        self._handle.call(_core.emcon_set_threads, int(count[0]))

    def step(self, h: float | None = None) -> Increment:
        """Make one increment of the deck, or one of size `h` [T]; begin the next step if one ends.

        With `h` the conditions are those of the present step of the deck, also beyond its end. An
        increment that fails is repeated in parts. Raises `AnalysisError` if these fail too: with
        `h` the state is that before the call, else that of the last part that succeeded.
        """
        if h is None:
            made = self._handle.change(_core.emcon_advance)
        else:
            made = self._handle.change(_core.emcon_step, positive(h, "h"))
        return Increment(*structure("emcon_increment", made).values())

    def next_step(self) -> None:
        """Begin the next step of the deck at the present time."""
        self._handle.change(_core.emcon_next_step)

    def run(self, until: float | None = None,
            callback: Callable[[Stepper, Increment], bool | None] | None = None, *,
            output: str | os.PathLike[str] | None = None, progress: bool = False) -> int:
        """Make increments of the deck to its end, or to the first that reaches time `until` [T].

        ``callback(stepper, increment)`` is called after each; if it returns True or raises an
        exception, the run ends there. `output`: base name of the files that a run of the program
        writes (docs/deck.md), for `Results`; if it is a folder, the name is `run` in it.
        `progress`: show the progress on standard error. Returns the number of increments made; the
        stepper can continue in any case. Raises `AnalysisError` as `step` does, `OSError` if a file
        cannot be written.
        """
        if until is not None:
            until = number(until, "until")
        if callback is not None and not callable(callback):
            raise InputError(f"the callback is to be a function, not {callback!r}")
        with self._recording(output):
            return self._run(until, callback, progress)

    def _run(self, until: float | None,
             callback: Callable[[Stepper, Increment], bool | None] | None, progress: bool) -> int:
        n = 0
        while not self.is_done:
            if until is not None:
                time = self.time
                if time >= until - _SAME_TIME*abs(time):
                    break
            increment = self.step()
            n += 1
            if progress:
                print(f"\r{self.fraction:4.0%}  time {increment.time:g}  increments {n}  "
                      f"contacts {increment.active} ", end="", file=sys.stderr, flush=True)
            if callback is None:
                continue
            answer = callback(self, increment)
            if answer is not None and not isinstance(answer, (bool, np.bool_)):
                raise InputError(f"the callback returned {answer!r}; True stops the run, None and "
                                 "False go on")
            if answer:
                break
        if progress:
            print(file=sys.stderr)
        return n

    @contextmanager
    def _recording(self, output: str | os.PathLike[str] | None) -> Iterator[None]:
        """Files for what is done within."""
        if output is None:
            yield
            return
        base = os.fsdecode(path_bytes(output))
        if os.path.isdir(base):
            base = os.path.join(base, "run")
        elif not os.path.isdir(os.path.dirname(base) or "."):
            raise FileNotFoundError(2, "no such folder", os.path.dirname(base))
        self._handle.call(_core.emcon_record, os.fsencode(base))
        self._base = os.path.abspath(base)
        try:
            yield
        finally:
            if self._handle.address:             # a callback may have closed the stepper
                self._handle.call(_core.emcon_end_record)

    def results(self) -> Results:
        """The `Results` of the last `run` with `output=`, also after `close`.

        Fields are read from the files when you access them; close the object, or use `with`.
        """
        if self._base is None:
            raise InputError("nothing was recorded: give output= to run")
        from .results import Results             # HDF5 takes long to load

        return Results(self._base)

    @property
    def fraction(self) -> float:
        """Fraction of the run of the deck that is done, 0 to 1."""
        return float(self._handle.call(_core.emcon_get_progress)[0])

    @property
    def t_end(self) -> float:
        """The time at which the last step of the deck ends [T]."""
        return float(self._handle.call(_core.emcon_get_progress)[1])

    @property
    def is_done(self) -> bool:
        """True after the last increment of the last step."""
        return bool(self._handle.call(lambda address: (0, _core.emcon_is_done(address))))

    @property
    def time(self) -> float:
        """Total time [T]."""
        return float(self._handle.call(_core.emcon_get_time))

    @property
    def deck_step(self) -> int:
        """The present step of the deck, from 1."""
        return self._sizes()["i_step"]

    @property
    def n_unknown(self) -> int:
        """Equations of the present step of the deck."""
        return self._sizes()["n_unknown"]

    def _sizes(self) -> dict[str, int]:
        return structure("emcon_sizes", self._handle.call(_core.emcon_get_sizes))

    @property
    def notes(self) -> list[str]:
        """Warnings about the deck, and changes before the first step, such as moved nodes."""
        lines: str = self._handle.call(_text, _core.emcon_get_notes)
        return [line.rstrip() for line in lines.split("\n")] if lines else []

    def report(self) -> dict[str, list[dict[str, Any]]]:
        """Description of the scene: `emcon check --json` without the cost.

        Lists of "bodies", "pairs", "ties", "parts" of the program in use, "sizes", "increments",
        "advice"; "text" of each entry is its line in the log. A notebook shows them as tables.
        """
        report: dict[str, list[dict[str, Any]]] = json.loads(
            self._handle.call(_text, _core.emcon_get_report))
        return report

    def __copy__(self) -> NoReturn:
        self._handle.__reduce__()

    def __repr__(self) -> str:
        if not self._handle.address:
            return "a closed Stepper"
        lines = [row["text"] for rows in self.report().values() for row in rows]
        return "\n".join([f"Stepper at time {self.time:g}", *lines])

    def _repr_html_(self) -> str:
        if not self._handle.address:
            return repr(self)
        parts = [f"<b>Stepper at time {self.time:g}</b>"]
        for kind, rows in self.report().items():
            cells = "".join(f"<tr><td>{html.escape(row['text'])}</td></tr>" for row in rows)
            parts.append(f"<table><tr><th>{kind}</th></tr>{cells}</table>")
        return "".join(parts)

    # ---- state ------------------------------------------------------------------------------

    @property
    def positions(self) -> NDArray[np.float64]:
        """Reference positions X, (n_node, n_dim) [L]."""
        return self._handle.call(_core.emcon_get_positions, self.n_node)

    @property
    def labels(self) -> NDArray[np.int32]:
        """Node numbers of the deck, (n_node,)."""
        return self._handle.call(_core.emcon_get_labels, self.n_node)

    @property
    def u(self) -> NDArray[np.float64]:
        """Displacements, (n_node, n_dim) [L]."""
        return self._handle.call(lambda a: _core.emcon_get_state(a, self.n_node, no_v=1)[:2])

    @property
    def q(self) -> NDArray[np.float64]:
        """Present positions X + u, (n_node, n_dim) [L]."""
        return self.positions + self.u

    @property
    def v(self) -> NDArray[np.float64]:
        """Velocities, (n_node, n_dim) [L/T]."""
        return self._handle.call(lambda a: _core.emcon_get_state(a, self.n_node, no_u=1)[::2])

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
        """Replace parts of the state; on an error nothing changes.

        Shapes are those of the properties. Dependent nodes of ties and equations follow the others.
        Energies and momenta are computed again; works, which are sums over time, stay. With `u`
        contact forces and reactions are zero until the next step. `time` [T] is total time, not
        before the start of the present step of the deck. Raises `InputError`, and `AnalysisError`
        if `u` inverts an element.
        """
        shape = (self.n_node, self.n_dim)
        none = np.empty((0, self.n_dim))
        u = none if u is None else real_array(u, "u", shape)
        v = none if v is None else real_array(v, "v", shape)
        lam, active = contact_arguments(lam, active, self.n_constraint)
        when = [] if time is None else [number(time, "time")]
        self._handle.change(_set_state, self.n_node, u, v, lam, active, when)

    def save(self) -> Snapshot:
        """Save the present state in memory, until the object that is returned is deleted."""
        return Snapshot(self._handle.call(_core.emcon_take_snapshot))

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a saved state of this stepper, or of another one of the same deck.

        What follows has the same bits. Loads and boundary values stay as they are now.
        """
        if not isinstance(snapshot, Snapshot):
            raise InputError(f"a state of save() is needed, not {type(snapshot).__name__}")
        if not snapshot._address:
            raise InputError("the state was freed")
        self._handle.change(_core.emcon_restore_snapshot, snapshot._address)

    # ---- what follows from the state --------------------------------------------------------

    def contact(self) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.int32]]:
        """Multipliers (contact forces, 0 where open), active flags, slave node numbers.

        All of shape (n_constraint,): contacts of all pairs, then guards; a node may have several.
        """
        lam, active, label, _ = self._handle.call(_core.emcon_get_contact, self.n_constraint)
        return lam, active.astype(bool), label

    def pressures(self) -> NDArray[np.float64]:
        """Contact pressures, 0 where open, (n_constraint,) [M/(L T^2)]: CSTR of the deck.

        In the order of `contact`, which has the slave nodes.
        """
        return self._handle.call(
            lambda a: _core.emcon_get_pressures(a, self.n_constraint, no_gap=1)[:2])

    def gaps(self) -> NDArray[np.float64]:
        """Gaps, > 0 open, NaN where no surface is near, (n_constraint,) [L]: CDIS of the deck."""
        return self._handle.call(
            lambda a: _core.emcon_get_pressures(a, self.n_constraint, no_pressure=1)[::2])

    def pairs(self) -> list[PairTotal]:
        """Totals of the last increment, one for each contact pair in the order of the deck.

        A pair that stops nodes of both sides counts as two, the second with sides exchanged.
        """
        total, active = self._handle.call(_core.emcon_get_pairs, self.n_pair)
        loss = self._handle.call(_core.emcon_get_pair_friction, self.n_pair)
        m = total.shape[1]//2
        return [PairTotal(row[:m].copy(), row[m:2*m].copy(), float(row[-1]), int(n), float(taken))
                for row, n, taken in zip(total, active, loss)]

    def friction(self) -> Friction:
        """Friction of each contact, in the order of `contact`; vectors along the surface."""
        return Friction(*self._handle.call(_core.emcon_get_friction, self.n_constraint))

    def verdict(self) -> dict[str, Any]:
        """The verdict on the increments that led to this state: `NAME.json` of a run of the deck.

        "verdict" is "good" or "bad", with "reasons"; further entries are the deepest overlap, the
        stand-off, the largest residual accepted, the energy error, and "warnings". A saved state
        contains its verdict.
        """
        verdict: dict[str, Any] = json.loads(self._handle.call(_text, _core.emcon_get_verdict))
        return verdict

    @property
    def ledger(self) -> dict[str, float]:
        """`energies` and `momenta` together."""
        names = ("kinetic", "strain", "potential", "external_work", "contact_work",
                 "stabilization", "restitution_loss", "scheme_loss", "damping_loss",
                 "friction_loss", "contact_damping_loss", "contact_energy", "total",
                 *_MOMENTA[self.n_dim])
        found = structure("emcon_ledger", self._handle.call(_core.emcon_get_ledger))
        return {name: found[name] for name in names}

    def energies(self) -> dict[str, float]:
        """Energies and works [M L^2/T^2]: kinetic, strain, potential, external_work, contact_work,
        stabilization, restitution_loss, scheme_loss, damping_loss, friction_loss,
        contact_damping_loss, contact_energy, total.

        `potential` is that of forces from outside; total = kinetic + strain + potential
        + contact_energy - external_work.
        """
        return dict(list(self.ledger.items())[:13])

    def momenta(self) -> dict[str, float]:
        """px, py [M L/T] and lz about the origin [M L^2/T]; of each body: `body_momenta`.

        In space px, py, pz, lx, ly, lz.
        """
        return {name: value for name, value in self.ledger.items()
                if name in ("px", "py", "pz", "lx", "ly", "lz")}


def _text(address: int, function: Callable[..., Any]) -> tuple[int, str]:
    """The text that a function of the library gives last, copied."""
    status, *_, place = function(address)
    return status, "" if status else text(place)


def _set_state(address: int, n_node: int, u: NDArray[np.float64], v: NDArray[np.float64],
               lam: NDArray[np.float64], active: NDArray[np.int32], time: list[float]) -> int:
    status, n, lam, active = of_all(address, lam, active)
    return status or int(_core.emcon_set_state(address, n_node, u, v, n, lam, active, time))
