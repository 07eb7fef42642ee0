"""Contact and ties for a host code that has its own solids. Needs the compiled extension.

The host gives nodes, surfaces, pairs and ties once; in each step it gives displacements and gets
gaps, discrete gradients, their derivatives and the next active set. Elements, time stepping and
solver are the host's:

    from emcon.interface import Interface

    with Interface(nodes) as face:                          # (n_node, n_dim) [L]
        lower = face.add_surface("lower", lower_edges)      # (k, 2), the body to the left
        upper = face.add_surface("upper", upper_edges)
        face.add_pair(upper, lower, "mortar")
        face.prepare(held)

        def newton(du, n):                                  # for the n rows that are selected
            ...                                             # Newton's method on face.evaluate
            return du, lam

        du, lam, active = face.solve_step(u0, du, was_active, newton)

`solve_step` calls `begin_step`, `select`, `newton` and `update_active` in turn; a host whose loop
is another one does so itself. In space nodes are (n_node, 3), and surfaces are faces: `add_faces`.
`tests/embed/interface_springs.py` is a complete host. Numbers count from 0; freedom a of node i is
n_dim i + a; the plane has thickness 1. Units are any consistent set, [L] [M] [T]. Wrong arguments
and calls out of order raise `InputError`; the interface stays usable.
"""

from __future__ import annotations

import enum
import functools
import operator
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .arguments import flag_array, number, real_array
from .csr import Csr
from .errors import _KINDS, AnalysisError, InputError
from .given_matrices import as_csr, check_csr
from .host_newton import HostNewton, Respond, Solve
from .memory import copied, csr, made, matrix, matrix_bytes, structure, structures, text, whole
from .options import host_choices
from .outer_faces import outer_faces

__all__ = ["Constraints", "Csr", "Gaps", "InputError", "Interface", "NullSpace", "Outcome", "Slips",
           "outer_faces"]

_Args = ParamSpec("_Args")
_R = TypeVar("_R")

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Ints = NDArray[np.int32]


class Outcome(enum.Enum):
    """How the search for the active set ended."""

    DONE = _core.EMCON_STEP_DONE
    #: The sets repeat: try a smaller step.
    CYCLING = _core.EMCON_STEP_CYCLING
    #: The motion leaves what contact was chosen for: try a smaller step.
    TOO_FAR = _core.EMCON_STEP_TOO_FAR
    #: A contact would begin farther away than `gap_tolerance`: try a smaller step.
    STANDS_OFF = _core.EMCON_STEP_STANDS_OFF


@dataclass(frozen=True)
class Gaps:
    """Gaps of all possible contacts at both ends of a step, (n_contact,) each.

    `start`, `end`: gaps, > 0 open [L], of mortar contact weighted means; meaningless where
    `is_near` is False: no surface is within reach. `is_over`: not past the end of the surface.
    `edge`: length of an edge, to which tolerances relate [L].
    """

    is_near: Flags
    is_over: Flags
    start: Floats
    end: Floats
    edge: Floats


@dataclass(frozen=True)
class Constraints:
    """The n selected contacts over a step; contact k holds its gap at `target[k]`.

    f is the difference of gap and target times the part of the surface that is covered: `start`
    and `end` are f at the ends of the step, `change` is g du to relative accuracy, `defect` is what
    has to become 0. The force on the nodes is `lam @ g`, the linearised defect `c @ d(du)`. In
    statics the start is the end.

    With friction a contact that sticks has rows of its slips, too, behind those of all gaps: there
    f is the target less the slip, and `lam` the friction. One that slides has none: its friction is
    in its row of `g`.
    """

    contact: Ints       #: (n,) numbers of contacts, ascending
    target: Floats      #: (n,) [L]
    start: Floats       #: (n,) [L]
    end: Floats         #: (n,) [L]
    change: Floats      #: (n,) [L]
    defect: Floats      #: (n,) [L]
    edge: Floats        #: (n,) length of an edge, to which defects relate [L]
    g: Csr              #: (n, n_dim n_node) discrete gradients
    c: Csr              #: (n, n_dim n_node) gradients at the end, same pattern
    slip: Ints          #: (n,) 0: a row of a gap; else of which slip, from 1

    @property
    def n(self) -> int:
        """How many rows the selected contacts have."""
        return len(self.contact)


@dataclass(frozen=True)
class Slips:
    """Status, slip and friction of all possible contacts in the step that was solved last.

    `status`: 0 open, 1 acts and does not slide, 2 slides. Slips and friction are vectors along the
    surface, (n_contact, n_dim - 1); friction times slip is what the step has lost, never below 0.
    """

    status: Ints        #: (n_contact,)
    slip: Floats        #: (n_contact, n_dim - 1) [L]
    friction: Floats    #: (n_contact, n_dim - 1), against the slip [M L/T^2]

    @property
    def loss(self) -> float:
        """The energy that friction has taken in the step."""
        return float((self.friction*self.slip).sum())


@dataclass(frozen=True)
class NullSpace:
    """P and DF, (n_dim n_node, n_unknown - n): P^T g^T = 0, c DF = 0, with ties and held freedoms.

    If `redundant` is not empty, these places of the selection follow from others, and there are no
    matrices: `Interface.drop` them.
    """

    p: Csr | None
    df: Csr | None
    redundant: Ints


def _exclusive(is_prepared: bool | None = True
               ) -> Callable[[Callable[_Args, _R]], Callable[_Args, _R]]:
    """For methods that call the library: one at a time, at the stage they need, None for any."""
    def decorate(method: Callable[_Args, _R]) -> Callable[_Args, _R]:
        @functools.wraps(method)
        def guarded(*arguments: Any, **more: Any) -> _R:
            self = arguments[0]
            # No lock: Ctrl-C between taking one and the `try` would leave it taken. CPython looks
            # for signals and other threads at calls and loops only.
            if self._is_busy:
                raise InputError("the interface is in use by another thread; give each its own")
            try:
                self._is_busy = True
                if not self._handle:
                    raise InputError("the interface is closed")
                if is_prepared and not self._is_prepared:
                    raise InputError("called before Interface.prepare")
                if is_prepared is False and self._is_prepared:
                    raise InputError("called after Interface.prepare; begin with a new Interface")
                return method(*arguments, **more)
            finally:
                self._is_busy = False
        return guarded
    return decorate


class Interface:
    """Surfaces of a host with their contacts and ties; the module's text shows the order of calls.

    `nodes`: reference positions, (n_node, 2), in space (n_node, 3) [L]; the host's nodes that no
    surface holds may be left out. Arrays that come back are copies. Any number of interfaces live
    side by side; each may be used from any thread, but not from two at once: that raises
    `InputError`.
    """

    def __init__(self, nodes: ArrayLike) -> None:
        self._handle = 0
        self._is_busy = False
        self._is_prepared = False
        try:
            self.n_node = len(nodes)  # type: ignore[arg-type]
        except TypeError:
            raise InputError(f"nodes is {nodes!r}, not an array (n_node, 2)") from None
        try:
            of_first = len(nodes[0])  # type: ignore[index,arg-type]
        except (TypeError, IndexError, KeyError):
            of_first = 2
        #: 2 in the plane, 3 in space
        self.n_dim = 3 if of_first == 3 else 2
        x = real_array(nodes, "nodes", (self.n_node, self.n_dim))
        if not self.n_node:
            raise InputError("there are no nodes")
        self.n_contact = 0      #: contacts possible, known after `prepare`
        self.n_unknown = 0      #: freedoms neither held nor tied to others, known after `prepare`
        self._n_surface = self._n_tie = 0
        self._held: Flags = np.zeros((0, 0), bool)
        self._map: Csr | None = None
        self._has_candidates = False
        self._n_row = 0         # rows of ties, which the library counts before contacts
        self._x = x
        self._handle = _core.emcon_new(x)[1]

    # ---- life ------------------------------------------------------------------------------------

    def close(self) -> None:
        """Free the interface. Harmless when closed; any other call then raises `InputError`."""
        if self._is_busy:
            raise InputError("the interface is in use by another thread: it cannot be closed")
        handle, self._handle = self._handle, 0
        _core.emcon_close(handle)

    def __enter__(self) -> Interface:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()

    def __del__(self) -> None:
        if getattr(self, "_handle", 0):
            self.close()

    def _call(self, routine: Callable[..., Any], *arguments: Any) -> Any:
        """The results of a routine but the status, which is first; raises what that means."""
        found = routine(self._handle, *arguments)
        results = found if isinstance(found, tuple) else (found,)
        if results[0]:
            said = text(_core.emcon_message(self._handle))
            raise _KINDS.get(results[0], RuntimeError)(said)
        return results[1] if len(results) == 2 else results[1:]

    # ---- to build it -----------------------------------------------------------------------------

    @_exclusive(False)
    def add_surface(self, name: str, edges: ArrayLike) -> int:
        """Add a surface of the plane and return its number.

        `edges`: first and last node of each edge, (k, 2) integers, the body to the left, so that
        the outward normal is the edge turned by -90 degrees; in any order, connected or in parts.
        Raises `InputError` for nodes that do not exist, edges without length, surfaces that branch.
        """
        if not isinstance(name, str) or "\0" in name:
            raise InputError(f"name is {name!r}, not a text")
        edge = _whole("edges", edges, 2, self.n_node)
        if edge.shape[1] != 2 or not len(edge):
            raise InputError(f"edges is to have the shape (k, 2), k > 0, not {edge.shape}")
        number = self._call(_core.emcon_add_surface, name.encode(), edge)
        self._n_surface = 1 + number
        return self._n_surface - 1

    @_exclusive(False)
    def add_faces(self, name: str, *faces: ArrayLike) -> int:
        """Add a surface of faces and return its number.

        `faces`: nodes of faces, (k, m) integers, one such array for each kind that the surface has:
        m is 3, 4, or with a node in the middle of each side 6, 8; in the plane 2, edges. Corners
        come first, counter-clockwise as seen from outside the body, then the nodes between a corner
        and the next: `outer_faces` finds them for cells. Raises `InputError` as `add_surface`.
        """
        if not isinstance(name, str) or "\0" in name:
            raise InputError(f"name is {name!r}, not a text")
        if not faces:
            raise InputError("there are no faces")
        known = {2: 3} if self.n_dim == 2 else {3: 5, 4: 9, 6: 22, 8: 23}
        kind, count, node = [], [], []
        for array in faces:
            own = _whole("faces", array, 2, self.n_node)
            if own.shape[1] not in known or not len(own):
                raise InputError(f"faces are to have the shape (k, m), k > 0, m one of "
                                 f"{', '.join(map(str, known))}, not {own.shape}")
            kind += [known[own.shape[1]]]*len(own)
            count += [own.shape[1]]*len(own)
            node.append(own.ravel())
        offset = np.cumsum(count, dtype=np.int32)
        number = self._call(_core.emcon_add_faces, name.encode(), np.array(kind, np.int32), offset,
                            np.concatenate(node))
        self._n_surface = 1 + number
        return self._n_surface - 1

    @_exclusive(False)
    def add_pair(self, slave: int, master: int, formulation: str = "mortar", *,
                 integration: str = "segments", n_point: int | None = None,
                 multiplier: str = "dual", normal: str = "nodal", smoothing: str = "none",
                 normal_angle: float = 60.0, smoothing_angle: float = 60.0,
                 friction: float = 0.0, adjust: float = 0.0,
                 damping: ArrayLike = 0.0, tangent_fraction: float = 0.0) -> None:
        """Add a contact pair of two surfaces by their numbers, or of one with itself.

        `formulation`: "node to segment", "segment", "mortar". `integration` of mortar contact:
        "segments" (exact) or "elements", with `n_point` Gauss points (1..10, 2..10 on segments).
        `multiplier`: "standard" or "dual". `normal` of slave nodes: "edge" or "nodal".
        `smoothing` of the master surface: "none" or "hermite". Turns sharper than the angles, 0 to
        180 degrees, are corners. Rigid obstacles are masters of held nodes. In space contact is
        "node to segment", of the nodes of the slave (a pair the other way round holds the others),
        or "mortar". `friction`: the coefficient of Coulomb's law. `adjust` [L]: `prepare` moves
        slave nodes no farther from the master than this, and those behind it, onto it; take over
        `positions`. `damping`: the pressure by the velocity of approach [M/(L^2 T)], or this,
        the clearance from which on there is none [L] and the part of that, 0 to 1, up to which it
        does not fall; `tangent_fraction`: the part of it against slip.
        """
        choice = [_choice("integration", integration),
                  0 if n_point is None else _number("n_point", n_point, 1, 10),
                  _choice("multiplier", multiplier), _choice("normal", normal),
                  _choice("smoothing", smoothing)]
        # 0 stands for the default in the library; the least angle above makes corners as well.
        angles = [number(normal_angle, "normal_angle") or np.nextafter(0.0, 1.0),
                  number(smoothing_angle, "smoothing_angle") or np.nextafter(0.0, 1.0)]
        sides = self._surfaces(slave, master)
        kind = _choice("formulation", formulation)
        options = made("emcon_pair_options", *choice, *angles, number(friction, "friction"),
                       number(adjust, "adjust"), *_damping(damping),
                       number(tangent_fraction, "tangent_fraction"))
        self._call(_core.emcon_add_pair, *sides, kind, options)

    @_exclusive(False)
    def add_tie(self, slave: int, master: int, *, multiplier: str = "dual",
                tolerance: float | None = None) -> int:
        """Tie two surfaces that meet, whatever their meshes; return the tie's number.

        `tolerance`: how far apart they may be [L]; None: a tenth of an edge.
        """
        reach = -1.0 if tolerance is None else number(tolerance, "tolerance")
        if tolerance is not None and reach < 0:
            raise InputError(f"tolerance is {tolerance}, which is negative")
        sides = self._surfaces(slave, master)
        kind = _choice("multiplier", multiplier)
        self._call(_core.emcon_add_tie, *sides, kind, reach)
        self._n_tie += 1
        return self._n_tie - 1

    def _surfaces(self, slave: int, master: int) -> tuple[int, int]:
        if not self._n_surface:
            raise InputError("there is no surface yet; call Interface.add_surface")
        return (_number("slave", slave, 0, self._n_surface - 1),
                _number("master", master, 0, self._n_surface - 1))

    @_exclusive(None)
    def configure(self, *, initiation: str = "persistent", gap_tolerance: float = 0.0,
                  is_last_try: bool = False, is_end: bool = False) -> None:
        """Set options, also between steps; options that are not named get their defaults again.

        `initiation`: "persistent" contact holds the gap that its first step began with, which keeps
        energy, "admissible" closes it. `gap_tolerance`: no contact begins with a larger gap per
        edge, 0 for any. `is_last_try`: the host cannot try the step in smaller parts. `is_end`:
        statics, gradients at the end of the step and closed gaps; set it before `prepare`, too.
        """
        kind = _choice("initiation", initiation)
        settings = made("emcon_contact_settings", kind, number(gap_tolerance, "gap_tolerance"),
                        bool(is_last_try), bool(is_end))
        self._call(_core.emcon_set_contact, settings)

    @_exclusive(False)
    def prepare(self, held: ArrayLike | None = None) -> Floats:
        """End the definition; after this, steps can begin. Returns positions, (n_node, n_dim) [L].

        `held`: freedoms that the host moves by itself, (n_node, n_dim) booleans; None: none. Slave
        nodes of ties are moved onto their masters: the host takes over the positions. After an
        error in what was given before, begin with a new interface.
        """
        if held is None:
            held = np.zeros((self.n_node, self.n_dim), bool)
        flags = flag_array(held, "held", (self.n_node, self.n_dim))
        self._held = flags.astype(bool)
        self._call(_core.emcon_hold, flags)
        self._call(_core.emcon_build)
        sizes = self._sizes()
        self.n_contact, self.n_unknown = sizes["n_contact"], sizes["n_unknown"]
        self._n_row = sizes["n_constraint"] - self.n_contact
        self._is_prepared = True
        return self._call(_core.emcon_get_positions, self.n_node)

    @property
    @_exclusive(None)
    def positions(self) -> Floats:
        """Reference positions, (n_node, n_dim) [L]; after `prepare` those that fulfil the ties."""
        return self._call(_core.emcon_get_positions, self.n_node)

    @property
    def largest_move(self) -> float:
        """How far `prepare` has moved a slave node onto its master at most [L]."""
        return float(np.linalg.norm(self.positions - self._x, axis=1).max())

    @property
    @_exclusive()
    def notes(self) -> list[str]:
        """Remarks on the ties, made by `prepare`."""
        lines = text(self._call(_core.emcon_get_notes))
        return [line.rstrip() for line in lines.split("\n")] if lines else []

    @property
    def slave_nodes(self) -> Ints:
        """The slave node of each possible contact, (n_contact,)."""
        return self._contacts()[0]

    @property
    def pair_of_contact(self) -> Ints:
        """The number of the pair of each possible contact, (n_contact,)."""
        return self._contacts()[1]

    @_exclusive()
    def _contacts(self) -> tuple[Ints, Ints]:
        _, _, label, pair = self._call(_core.emcon_get_contact, self.n_contact)
        return label - np.int32(1), pair

    # ---- ties and held freedoms ------------------------------------------------------------------

    @_exclusive()
    def tie_matrices(self, tie: int = 0) -> tuple[Csr, Csr]:
        """D and M of a tie, (n_row, n_node) [L]: D x = M x in each direction."""
        if not self._n_tie:
            raise InputError("there is no tie")
        found = self._call(_core.emcon_get_tie_matrices,
                           _number("tie", tie, 0, self._n_tie - 1))
        return matrix(found[0]), matrix(found[1])

    @_exclusive()
    def links(self) -> Csr:
        """T, (n_dim n_node, n_unknown), of u = T w: a residual becomes T^T r, a tangent T^T K T.

        Rows of held freedoms are empty.
        """
        return matrix(self._call(_core.emcon_links))

    def follow(self, field: ArrayLike) -> Floats:
        """A displacement or velocity, (n_node, n_dim), with tied nodes moved as the ties say."""
        return self._changed(_core.emcon_follow, field)

    def gather(self, field: ArrayLike) -> Floats:
        """Forces, (n_node, n_dim), those on tied nodes moved to the nodes that these depend on."""
        return self._changed(_core.emcon_gather, field)

    @_exclusive()
    def _changed(self, routine: Any, field: ArrayLike) -> Floats:
        return self._call(routine, self._field("field", field))

    @_exclusive()
    def set_map(self, map: Any) -> None:
        """From now on the unknowns are w of the host, with u = A w + a constant.

        `map`: A, (n_dim n_node, any), a sparse matrix of scipy, a `Csr` or an array, for points of
        faces of higher order, hanging nodes, rigid bodies or control points. Rows of gradients, and
        `curvature`, are by w: `lam @ g` is the force on the unknowns. Displacements and other
        fields stay those of the nodes; `null_space` is refused.
        """
        n = self.n_dim*self.n_node
        shape = tuple(map.shape) if hasattr(map, "shape") else np.shape(map)
        if len(shape) != 2 or not shape[1]:
            raise InputError(f"map has the shape {shape}, not ({n}, any)")
        own = as_csr(map, n, "map", shape[1])
        check_csr(own, "map")
        self._call(_core.emcon_set_map, matrix_bytes(own))
        self._map = own

    # ---- a step from the displacements u0 by du, (n_node, n_dim) each [L] ------------------------

    @_exclusive()
    def begin_step(self, u0: ArrayLike, du: ArrayLike, was_active: ArrayLike,
                   stop: ArrayLike | None = None, h: float | None = None) -> Flags:
        """Begin a step; `du` is the motion that you expect.

        `was_active`: contacts that acted at the end of the step before, (n_contact,) booleans.
        Returns those that still can. `stop`, where pairs have friction: the motion with which all
        velocities end at zero, (n_node, n_dim), h/2 v0 where the velocity at the end is
        2 du/h - v0: what sticks comes to rest. None: what sticks has its velocity along the surface
        turned round, which takes no energy. `h`, where pairs have damping: the size of the step
        [T].
        """
        was = self._flags("was_active", was_active)
        to_rest = None if stop is None else self._field("stop", stop)
        found = self._call(_core.emcon_begin_contact, *self._motion(u0, du), was)
        if to_rest is not None:
            self._call(_core.emcon_begin_friction, to_rest)
        if h is not None:
            self._call(_core.emcon_begin_damping, number(h, "h"))
        return self._contacts_of(found)

    def solve_step(self, u0: ArrayLike, du: ArrayLike, was_active: ArrayLike,
                   newton: Callable[[Floats, int], tuple[Floats, ...]], *,
                   stop: ArrayLike | None = None, h: float | None = None, together: bool = False
                   ) -> tuple[Floats, Floats, Flags]:
        """Solve a step with one set of contacts after the other: du, multipliers, active flags.

        `newton(du, n)` solves with the n rows that are selected, from the motion du on; it returns
        the motion and the multipliers, and sums of sizes of the residual for `update_active` if it
        has them. `together`: with all candidates (`select_candidates`). The rest is as in
        `begin_step`. Raises `AnalysisError` where no set ends the step: try a smaller one.
        """
        motion = np.array(self._field("du", du))
        active, outcome = self.begin_step(u0, motion, was_active, stop, h), None
        select = self.select_candidates if together else self.select
        while outcome is None:
            n = select(u0, motion, active)
            motion, lam, *sizes = newton(motion, n)
            active, outcome = self.update_active(u0, motion, lam, active, *sizes)
        if outcome is not Outcome.DONE:
            raise AnalysisError(f"the step cannot be ended with these contacts: {outcome.name}")
        return motion, lam, active

    def newton(self, u0: ArrayLike, respond: Respond, free: ArrayLike | None = None,
               solve: Solve | None = None) -> Callable[[Floats, int], tuple[Floats, ...]]:
        """Newton's method for `solve_step`, of a residual and a tangent.

        `respond(du)` gives the residual of the step without contact, a field, and its derivative by
        du, an array or a sparse matrix of scipy; after `set_map` both are by the unknowns w. It may
        give a third result, the `magnitude` of `update_active`. `free`: the numbers of the freedoms
        that are solved for; None: all that are neither held nor tied. `solve(matrix, right)`: your
        linear solver, matrix^-1 times the columns of `right`; None: LAPACK or SuperLU.

        What damping pushes is added. In each iterate the equations are condensed to the rows of
        contact with `together=True`, otherwise to the null space of the selected contacts, which
        takes neither `free` nor a map. It ends where the motion is round-off of the positions, or
        does not decrease any more. Raises `AnalysisError` where it does not converge, and where
        selected contacts follow from others.
        """
        return HostNewton(self, np.array(self._field("u0", u0)), respond, free, solve).solve

    @_exclusive()
    def gaps(self, u0: ArrayLike, du: ArrayLike) -> Gaps:
        """All gaps at both ends of the step."""
        data = self._call(_core.emcon_get_gaps, *self._motion(u0, du), self.n_contact + self._n_row)
        gaps = structures("emcon_gap", data)[self._n_row:]
        return Gaps(gaps["is_near"].astype(bool), gaps["is_over"].astype(bool),
                    *(gaps[part].copy() for part in ("gap0", "gap1", "size")))

    @_exclusive()
    def select(self, u0: ArrayLike, du: ArrayLike, active: ArrayLike) -> int:
        """Select the contacts `active`, (n_contact,) booleans; return how many rows they have."""
        flags = self._flags("active", active)
        self._has_candidates = False
        return self._call(_core.emcon_select, *self._motion(u0, du), flags)

    @_exclusive()
    def select_candidates(self, u0: ArrayLike, du: ArrayLike, active: ArrayLike) -> int:
        """In place of `select`: contacts of which any may act, stick or slide; how many rows.

        All candidates have rows of their gaps and slips, and `solve_contacts` gives multipliers in
        each iterate of Newton's method. `update_active` adds candidates until none is missing, and
        lets go those that do not push once the step is solved.
        """
        flags = self._flags("active", active)
        self._has_candidates = True
        return self._call(_core.emcon_select_candidates, *self._motion(u0, du), flags)

    @_exclusive()
    def solve_contacts(self, w: ArrayLike, free: ArrayLike) -> Floats:
        """The multipliers that obey the laws of all candidates, (n,).

        `w`: c K^-1 g^T, (n, n), with the host's tangent K; `free`: the defect less c K^-1 times the
        residual without contact forces, (n,). Newton's step is then K^-1 (g^T lam - residual).
        Raises `AnalysisError` where none are found.
        """
        n = self._n_selected()
        return self._call(_core.emcon_solve_contacts, real_array(w, "w", (n, n)),
                          real_array(free, "free", (n,)))

    @_exclusive()
    def pattern(self, u0: ArrayLike, du: ArrayLike) -> Csr:
        """Which degrees of freedom contact may couple in this step, known before it is solved.

        Values of 1, n_dim n_node each way, or by the unknowns of `set_map`, over all contacts that
        have a surface near, whether they act, stick or slide: `curvature`, and products of rows of
        one contact, have entries there only. `update_active` may look farther: ask again.
        """
        return matrix(self._call(_core.emcon_pattern, *self._motion(u0, du)))

    @_exclusive()
    def choose(self, u0: ArrayLike, du: ArrayLike, contact: ArrayLike, target: ArrayLike) -> None:
        """Select contacts by their numbers, (n,) ascending, with gaps to hold, (n,) [L].

        `update_active` does not go with these.
        """
        numbers = _whole("contact", contact, 1, self.n_contact)
        if (np.diff(numbers) <= 0).any():
            raise InputError("contact has numbers that do not ascend")
        gap = real_array(target, "target", (len(numbers),))
        self._call(_core.emcon_choose, *self._motion(u0, du), numbers + np.int32(self._n_row), gap)

    @_exclusive()
    def evaluate(self, u0: ArrayLike, du: ArrayLike) -> Constraints:
        """Values and gradients of the selected contacts."""
        n, number, _, _, *values, g, c, slip = structure("emcon_constraint_report", self._call(
            _core.emcon_evaluate_contact, *self._motion(u0, du))).values()
        return Constraints(whole(number, n) - np.int32(self._n_row),
                           *(copied(place, n) for place in values), csr(g), csr(c), whole(slip, n))

    @_exclusive()
    def curvature(self, lam: ArrayLike) -> Csr:
        """sum of lam[k] d g[k]/d u1, n_dim n_node each way; the step's tangent gets minus this.

        `lam`: multipliers of the selected contacts as last evaluated, (n,) [M L/T^2].
        """
        return matrix(self._call(_core.emcon_curvature, self._of_selected("lam", lam)))

    @_exclusive()
    def second_times(self, lam: ArrayLike, direction: ArrayLike) -> Floats:
        """`curvature(lam)` times a direction, (n_node, n_dim) like the result."""
        along = self._field("direction", direction)
        return self._call(_core.emcon_curvature_times, self._of_selected("lam", lam), along)

    @_exclusive()
    def update_active(self, u0: ArrayLike, du: ArrayLike, lam: ArrayLike, active: ArrayLike,
                      magnitude: ArrayLike | None = None) -> tuple[Flags, Outcome | None]:
        """The next active set from a solved step: with what would penetrate, without what pulls.

        `active`: what was selected; `lam`: its multipliers. `magnitude`, (n_node, n_dim): sums of
        the sizes of the contributions to the residual, which tell signs of round-off from tension;
        None: the contact forces. Returns the next set and None, or the last one and its `Outcome`.
        """
        u, d = self._motion(u0, du)
        flags = self._flags("active", active)
        sizes = (np.empty((0, self.n_dim)) if magnitude is None
                 else self._field("magnitude", magnitude))
        flags, is_done, outcome = self._call(_core.emcon_update_active, u, d,
                                             self._of_selected("lam", lam), sizes, flags)
        return self._contacts_of(flags), Outcome(outcome) if is_done else None

    @_exclusive()
    def slips(self) -> Slips:
        """Status, slip and friction of all contacts, by the multipliers of `update_active`."""
        status, slip, friction = self._call(_core.emcon_get_slips, self.n_contact + self._n_row)
        return Slips(status[self._n_row:], slip[self._n_row:], friction[self._n_row:])

    @_exclusive()
    def law_forces(self) -> tuple[Floats, float]:
        """Damping forces at the nodes in the last evaluated step, and the energy that they take.

        Forces, (n_node, n_dim), to be added to those of contact; their derivative is in
        `curvature`. The energy is >= 0.
        """
        force, taken = self._call(_core.emcon_law_forces, self.n_node)
        return force, taken

    @_exclusive()
    def areas(self, u1: ArrayLike) -> tuple[Floats, Floats]:
        """Areas that the multipliers of the step to `u1` act on, (n_contact,) [L^2], and lengths.

        The pressure of a contact is its multiplier over its area. The lengths, (n_contact,) [L],
        are those of slave surface that belong to the contacts at the end, in space roots of areas.
        """
        area, length = self._call(_core.emcon_get_areas, self._field("u1", u1),
                                  self.n_contact + self._n_row)
        return area[self._n_row:], length[self._n_row:]

    @_exclusive()
    def overlap(self, u0: ArrayLike, du: ArrayLike) -> tuple[float, int | None]:
        """The deepest overlap of bodies in the step, per edge, and the node that is behind.

        It is found by geometry alone, whatever contact says: 0 and None if there is none. Surfaces
        of pairs are their outlines: of two of which neither closes around its body, nothing is
        found.
        """
        depth, node = self._call(_core.emcon_overlap, *self._motion(u0, du))
        return depth, node if node >= 0 else None

    # ---- without multipliers ---------------------------------------------------------------------

    @_exclusive()
    def null_space(self) -> NullSpace:
        """P and DF for the constraints as last evaluated.

        Raises `AnalysisError` if there is no good choice of unknowns to eliminate: solve with the
        multipliers.
        """
        p, df, n, place = self._call(_core.emcon_null_space)
        redundant = whole(place, n)
        if n:
            return NullSpace(None, None, redundant)
        return NullSpace(matrix(p), matrix(df), redundant)

    @_exclusive()
    def drop(self, redundant: ArrayLike) -> Flags:
        """Leave selected contacts out for the rest of the step; return what is left, (n_contact,).

        `redundant`: their places in the selection, as `null_space` tells.
        """
        place = _whole("redundant", redundant, 1, self._n_selected())
        return self._contacts_of(self._call(_core.emcon_drop, place, self.n_contact + self._n_row))

    @_exclusive()
    def multipliers(self, residual: ArrayLike) -> Floats:
        """lam, (n,), after `null_space`, from the residual without contact forces, a field."""
        force = self._field("residual", residual)
        return self._call(_core.emcon_row_multipliers, self.n_node, force, self._n_selected())

    @_exclusive()
    def particular(self, defect: ArrayLike) -> Floats:
        """The motion of dependent unknowns alone that closes `defect`, (n,); (n_node, n_dim) [L].

        After `null_space`. Newton's step is this plus DF times that of the others.
        """
        return self._call(_core.emcon_particular, self._of_selected("defect", defect), self.n_node)

    # ---- helpers ---------------------------------------------------------------------------------

    def _field(self, name: str, values: ArrayLike) -> Floats:
        """As the library wants it, without a copy where that is possible."""
        return real_array(values, name, (self.n_node, self.n_dim))

    def _motion(self, u0: ArrayLike, du: ArrayLike) -> tuple[Floats, Floats]:
        return self._field("u0", u0), self._field("du", du)

    def _flags(self, name: str, values: ArrayLike) -> Ints:
        """One for each constraint: those of ties, which are eliminated, do not act."""
        flags = flag_array(values, name, (self.n_contact,))
        return np.concatenate((np.zeros(self._n_row, flags.dtype), flags))

    def _contacts_of(self, flags: Ints) -> Flags:
        return flags[self._n_row:].astype(bool)

    def _n_selected(self) -> int:
        return self._sizes()["n_selected"]

    def _sizes(self) -> dict[str, int]:
        return structure("emcon_sizes", self._call(_core.emcon_get_sizes))

    def _of_selected(self, name: str, values: ArrayLike) -> Floats:
        """One number for each selected contact."""
        return real_array(values, name, (self._n_selected(),))


# ---- arguments -----------------------------------------------------------------------------------

def _whole(name: str, values: ArrayLike, n_axis: int, n: int) -> Ints:
    """Integers in 0..n-1, an array of `n_axis` axes."""
    array = np.asarray(values)
    if array.dtype.kind not in "iu" and array.size:
        raise InputError(f"{name} is to hold integers, not {array.dtype}")
    if array.ndim != n_axis:
        raise InputError(f"{name} is to have {n_axis} axes, not the shape {array.shape}")
    bad = np.argwhere((array < 0) | (array >= n))
    if len(bad):
        place = tuple(map(int, bad[0]))
        raise InputError(f"{name}{list(place)} is {array[place]}, not in 0..{n - 1}")
    return np.ascontiguousarray(array, np.int32)


def _damping(values: ArrayLike) -> list[float]:
    found = np.atleast_1d(np.asarray(values, float))
    if found.ndim != 1 or not 1 <= len(found) <= 3:
        raise InputError(f"damping is {values!r}, not one to three numbers")
    return [number(value, "damping") for value in found] + [0.0]*(3 - len(found))


def _number(name: str, value: int, least: int, most: int) -> int:
    try:
        found = operator.index(value)
    except TypeError:
        raise InputError(f"{name} is {value!r}, not an integer") from None
    if not least <= found <= most:
        raise InputError(f"{name} is {found}, not in {least}..{most}")
    return found


def _choice(name: str, value: str) -> int:
    choices = host_choices(name)
    if not isinstance(value, str) or value.lower() not in choices:
        raise InputError(f"{name} is {value!r}, not one of {', '.join(map(repr, choices))}")
    return choices[value.lower()]
