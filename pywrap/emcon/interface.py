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

`solve_step` calls `begin_step`, `select`, `newton` and `update_active` in turn; a host with a loop
of its own calls these. In space nodes are (n_node, 3), and surfaces are faces: `add_faces`.
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
    #: A set came back that had been tried before: try a smaller step.
    CYCLING = _core.EMCON_STEP_CYCLING
    #: Nodes moved out of the faces that the search had found: try a smaller step.
    TOO_FAR = _core.EMCON_STEP_TOO_FAR
    #: A contact would begin at a gap above `gap_tolerance`: try a smaller step.
    STANDS_OFF = _core.EMCON_STEP_STANDS_OFF


@dataclass(frozen=True)
class Gaps:
    """Gaps of all possible contacts at both ends of a step, (n_contact,) each.

    `start`, `end`: gaps, > 0 open [L], weighted means for mortar contact; undefined where `is_near`
    is False, because no surface is within reach. `is_over`: not past the end of the surface.
    `edge`: length of an edge, to which tolerances relate [L].
    """

    is_near: Flags
    is_over: Flags
    start: Floats
    end: Floats
    edge: Floats


@dataclass(frozen=True)
class Constraints:
    """The n selected rows of contacts over a step; row k keeps a gap at `target[k]`.

    f is the difference of gap and target times the share of the surface that is covered: `start`
    and `end` are f at both ends of the step, `change` is g du, `defect` is what has to become 0.
    The force on the nodes is `lam @ g`, the linearised defect `c @ d(du)`. In statics `start` is
    `end`.

    With friction, contacts that stick have further rows, one for each slip, after those of all
    gaps: there f is the target minus the slip, and `lam` the friction. For contacts that slide, the
    row of the gap in `g` contains the friction.
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
    surface; friction times slip is the energy that the step dissipates, >= 0.
    """

    status: Ints        #: (n_contact,)
    slip: Floats        #: (n_contact, n_dim - 1) [L]
    friction: Floats    #: (n_contact, n_dim - 1), against the slip [M L/T^2]

    @property
    def loss(self) -> float:
        """The energy dissipated by friction in the step [M L^2/T^2]."""
        return float((self.friction*self.slip).sum())


@dataclass(frozen=True)
class NullSpace:
    """P and DF, (n_dim n_node, n_unknown - n): P^T g^T = 0, c DF = 0, with ties and held freedoms.

    If `redundant` is not empty, these rows of the selection depend on others, and there are no
    matrices: leave them out by `Interface.drop`.
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

    `nodes`: reference positions, (n_node, 2), in space (n_node, 3) [L]; nodes that are on no
    surface may be left out. Returned arrays are copies. Any number of interfaces may exist at once,
    each used by one thread at a time: a call from a second thread raises `InputError`.
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
        """Free the interface. Closing twice is harmless; any other call then raises `InputError`."""
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

        `faces`: nodes of faces, (k, m) integers, one array for each kind of face: m is 3 or 4, with
        mid-side nodes 6 or 8; in the plane 2, edges. Corners come first, counter-clockwise as seen
        from outside the body, then mid-side nodes, beginning with that between the first two
        corners: `outer_faces` finds them for cells. Raises `InputError` as `add_surface`.
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
        `multiplier`: "standard" or "dual". `normal` of slave nodes: "edge" or "nodal". `smoothing`
        of the master surface: "none" or "hermite". Turns sharper than the angles, 0 to 180 degrees,
        are corners. A rigid obstacle is a master whose nodes are held. In space the formulation is
        "mortar" or "node to segment", which stops the nodes of the slave; a second pair with slave
        and master exchanged stops the others. `friction`: coefficient of Coulomb's law. `adjust`
        [L]: `prepare` moves slave nodes that are behind the master, or no farther from it than
        this, onto it, and returns the new positions. `damping`: pressure over velocity of approach
        [M/(L^2 T)]; or this, the gap beyond which there is no damping [L], and the part of that
        gap, 0 to 1, with the full damping. `tangent_fraction`: damping against slip over that
        against approach.
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
        """Tie two surfaces, whose meshes may differ; return the tie's number.

        `tolerance`: largest distance between them [L]; None: a tenth of an edge.
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

        `initiation`: "persistent" contact keeps the gap that it had at the start of its first step,
        which conserves energy; "admissible" closes it, which dissipates energy. `gap_tolerance`:
        largest gap at which a contact may begin, in edge lengths; 0: any. `is_last_try`: the host
        cannot repeat the step in smaller parts. `is_end`: statics, with gradients at the end of the
        step and closed gaps; set it before `prepare`, too.
        """
        kind = _choice("initiation", initiation)
        settings = made("emcon_contact_settings", kind, number(gap_tolerance, "gap_tolerance"),
                        bool(is_last_try), bool(is_end))
        self._call(_core.emcon_set_contact, settings)

    @_exclusive(False)
    def prepare(self, held: ArrayLike | None = None) -> Floats:
        """End the definition; after this, steps can begin. Returns positions, (n_node, n_dim) [L].

        `held`: degrees of freedom that the host prescribes, (n_node, n_dim) booleans; None: none.
        Slave nodes of ties are moved onto their masters: use the positions that are returned. After
        an error in a surface, pair or tie begin with a new interface.
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
        """Largest distance by which `prepare` has moved a slave node onto its master [L]."""
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
        Returns those of them that still have a surface near. `stop`, if pairs have friction: the
        motion with which all velocities end at 0, (n_node, n_dim) [L]: h/2 v0 if the velocity at
        the end is 2 du/h - v0. Nodes that stick then end with velocity 0 along the surface; with
        None that velocity is reversed, which dissipates nothing. `h` [T], if pairs have damping:
        the size of the step.
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

        `newton(du, n)` solves with the n selected rows, starting from the motion du; it returns the
        motion and the multipliers, optionally the `magnitude` of `update_active`. `together`: solve
        with all candidates (`select_candidates`). Other arguments are those of `begin_step`. Raises
        `AnalysisError` if no set completes the step: try a smaller step.
        """
        motion = np.array(self._field("du", du))
        active, outcome = self.begin_step(u0, motion, was_active, stop, h), None
        select = self.select_candidates if together else self.select
        while outcome is None:
            n = select(u0, motion, active)
            found = newton(motion, n)
            if not isinstance(found, (tuple, list)) or len(found) < 2:
                raise InputError("newton(du, n) is to return the motion and the multipliers, not "
                                 f"{type(found).__name__}")
            motion, lam, *sizes = found
            active, outcome = self.update_active(u0, motion, lam, active, *sizes)
        if outcome is not Outcome.DONE:
            raise AnalysisError(f"the step cannot be ended with these contacts: {outcome.name}")
        return motion, lam, active

    def newton(self, u0: ArrayLike, respond: Respond, free: ArrayLike | None = None,
               solve: Solve | None = None) -> Callable[[Floats, int], tuple[Floats, ...]]:
        """Newton's method for `solve_step`, of a residual and a tangent.

        `respond(du)` returns the residual of the step without contact, (n_node, n_dim), and its
        derivative with respect to du, an array or a sparse matrix of scipy; after `set_map` both
        are by the unknowns w. It may return a third result, the `magnitude` of `update_active`.
        `free`: numbers of the freedoms that are solved for; None: all that are neither held nor
        tied. `solve(matrix, right)`: your linear solver, matrix^-1 times the columns of `right`;
        None: LAPACK or SuperLU.

        Forces of damping are added. With `together=True` the equations are condensed to the rows of
        contact in each iterate, otherwise to the null space of the selected contacts, for which
        `free` and `set_map` cannot be used. It ends when the correction is round-off of the
        positions, or does not decrease any more. Raises `AnalysisError` if it does not converge, or
        if selected contacts depend on others.
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
        """In place of `select`: contacts each of which may be open, stick or slide; how many rows.

        All candidates have rows of their gaps and slips, and `solve_contacts` returns multipliers
        in each iterate of Newton's method. `update_active` adds candidates until none is missing,
        and releases those without force once the step is solved.
        """
        flags = self._flags("active", active)
        self._has_candidates = True
        return self._call(_core.emcon_select_candidates, *self._motion(u0, du), flags)

    @_exclusive()
    def solve_contacts(self, w: ArrayLike, free: ArrayLike) -> Floats:
        """The multipliers that satisfy the laws of contact and friction of all candidates, (n,).

        `w`: c K^-1 g^T, (n, n), with the host's tangent K; `free`: the defect minus c K^-1 times
        the residual without contact forces, (n,). Newton's step is then K^-1 (g^T lam - residual).
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
        """The next active set from a solved step: penetrating contacts are added, pulling ones released.

        `active`: the selected contacts; `lam`: their multipliers. `magnitude`, (n_node, n_dim):
        sums of |contributions| to the residual, to tell round-off from tension; None: the contact
        forces are used. Returns the next set and None, or the last set and the `Outcome`.
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
        """Damping forces at the nodes in the last evaluated step, and the energy they dissipate.

        Add the forces, (n_node, n_dim) [M L/T^2], to those of contact; their derivative is in
        `curvature`. The energy is >= 0.
        """
        force, taken = self._call(_core.emcon_law_forces, self.n_node)
        return force, taken

    @_exclusive()
    def areas(self, u1: ArrayLike) -> tuple[Floats, Floats]:
        """Areas on which the multipliers of the step to `u1` act, (n_contact,) [L^2], and lengths.

        The pressure of a contact is its multiplier over its area. The lengths, (n_contact,) [L],
        are those of the slave surface that belong to the contacts at the end, in space roots of
        areas.
        """
        area, length = self._call(_core.emcon_get_areas, self._field("u1", u1),
                                  self.n_contact + self._n_row)
        return area[self._n_row:], length[self._n_row:]

    @_exclusive()
    def overlap(self, u0: ArrayLike, du: ArrayLike) -> tuple[float, int | None]:
        """The deepest overlap of bodies in the step, in edge lengths, and the node that is inside.

        It is computed from positions alone: 0 and None if there is no overlap. Bodies are bounded
        by the surfaces of the pairs: if neither of two surfaces closes around its body, no overlap
        is found.
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

        `redundant`: their places in the selection, as `null_space` returns them.
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
        """The motion of the dependent unknowns that makes `defect`, (n,), 0; (n_node, n_dim) [L].

        After `null_space`. Newton's step is this plus DF times that of the independent ones.
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
