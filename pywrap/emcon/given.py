"""What Python gives to a model: laws, potentials, the solid of a host code.

The library calls them through function pointers of C, in the thread that called the `Stepper`. An
exception cannot pass through it: it is kept, the call of the library fails, and the exception is
raised again where the `Stepper` was called. Arrays that a function gets are copies of its own.
"""

from __future__ import annotations

import ctypes
import signal
import threading
from collections.abc import Callable
from functools import cached_property
from typing import Any, Protocol
from weakref import WeakMethod

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .csr import Csr
from .errors import InputError, check
from .given_matrices import as_csr, check_csr, fitting, is_sparse, keys_of, symmetric_pattern
from .memory import matrix_bytes, structure
from .memory import reals as _view

Array = NDArray[np.float64]

#: (n, m) points -> energies (n,), gradients (n, m), second derivatives (n, m, m).
PointFunction = Callable[[Array], tuple[ArrayLike, ArrayLike, ArrayLike]]

_OK, _OUTSIDE, _FAILED = 0, 1, 2

_INT, _POINTER = ctypes.c_int, ctypes.c_void_p
_POINT = ctypes.CFUNCTYPE(_INT, _POINTER, _INT, _INT, _POINTER, _INT, _POINTER, _POINTER,
                          _POINTER)
_FORCE = ctypes.CFUNCTYPE(_INT, _POINTER, _INT, _POINTER, _POINTER, _INT, _POINTER, _POINTER,
                          _POINTER, _POINTER)


class Outside(Exception):
    """Raise this in a law or potential for a state without energy, as of an inverted element.

    The step is then repeated in smaller parts, as far as the deck allows.
    """


class Solid(Protocol):
    """A solid, or any other forces between nodes, of a host code."""

    def respond(self, u0: Array, du: Array,
                wants_tangent: bool) -> tuple[ArrayLike, float, Any]:
        """Forces of the step from displacements `u0` by `du`, both (n, d) [L], d dimensions.

        Returns forces (n, d) [M L/T^2], the energy at the end, and the derivative of the forces by
        u0 + du, (d n, d n), freedom a of node i being d i + a: a sparse matrix of scipy, a `Csr`,
        or an array; None is allowed if `wants_tangent` is false. The pattern of the tangent at rest
        must contain all later entries, unless the solid has an attribute `pattern`, a matrix with
        all of them. Energy is conserved if force . du = E(u0 + du) - E(u0). For du = 0 the forces are
        the gradient of E, and the tangent is half the second derivative of E, as in a step.
        """
        ...


def _check_three(result: Any, name: str, what: str) -> None:
    """A given function has returned three things."""
    if not isinstance(result, (tuple, list)):
        raise InputError(f"{name}: its function is to return {what}, not "
                         f"{type(result).__name__}")
    if len(result) != 3:
        raise InputError(f"{name}: its function is to return {what}, three things, not "
                         f"{len(result)}")


class _Given:
    """A function behind a pointer. It must live as long as the models that were given it."""

    kind: Any = None           #: of the pointer

    def __init__(self, name: str) -> None:
        self.name = name
        #: What the function has raised in the call of the library that is under way.
        self.exception: BaseException | None = None
        # a weak one: what is given goes when its model goes, without the garbage collector
        call: Callable[[], Any] = WeakMethod(self._call)
        self.pointer = self.kind(lambda *arguments: call()(*arguments))

    def give(self, handle: int) -> None:
        """Give the function to the library model `handle`, which was read and not yet built."""
        raise NotImplementedError

    def _call(self, *arguments: Any, **none: Any) -> int:
        """What the library calls."""
        raise NotImplementedError

    @property
    def address(self) -> int:
        # ctypes.cast would make the pointer keep itself
        return int(_POINTER.from_buffer(self.pointer).value or 0)

    def guarded(self, deed: Callable[[], None]) -> int:
        """The status of a deed; its exception is kept."""
        try:
            deed()
        except Outside:
            return _OUTSIDE
        except BaseException as exception:  # noqa: BLE001  it is raised again at the border
            self.exception = exception
            return _FAILED
        return _OK


class GivenPoints(_Given):
    """An energy at points."""

    kind = _POINT

    def __init__(self, name: str, function: PointFunction) -> None:
        check_function(name, function)
        super().__init__(name)
        self.function = function

    def evaluate(self, points: ArrayLike) -> tuple[Array, Array, Array]:
        """Energies (n,), gradients (n, m) and second derivatives (n, m, m) at `points` (n, m).

        Raises `InputError` for results of wrong shape or type.
        """
        z = np.asarray(points, dtype=float)
        result = self.function(z)
        _check_three(result, self.name, "energies, gradients and second derivatives")
        n, m = z.shape
        return (fitting(result[0], f"{self.name}: the energy", (n,)),
                fitting(result[1], f"{self.name}: the gradient", (n, m)),
                fitting(result[2], f"{self.name}: the second derivative", (n, m, m)))

    def _call(self, user: int, n: int, m: int, z: int, wants_hessian: int, value: int,
              gradient: int, hessian: int) -> int:
        def deed() -> None:
            energy, first, second = self.evaluate(_view(z, n, m).copy())
            _view(gradient, n, m)[:] = first
            if wants_hessian:
                _view(hessian, n, m, m)[:] = second
            _view(value, n)[:] = energy
        return self.guarded(deed)


class GivenLaw(GivenPoints):
    """The strain energy of a material."""

    def __init__(self, material: str, law: PointFunction) -> None:
        super().__init__(f"the law of {material}", law)
        self.material = material

    def give(self, handle: int) -> None:
        check(handle, _core.emcon_give_law(handle, self.material.encode(), self.address, 0))


class GivenPotential(GivenPoints):
    """A potential of the positions of some nodes: labels (k,), a node set, or None for all."""

    def __init__(self, name: str, potential: PointFunction,
                 nodes: str | NDArray[np.int64] | None) -> None:
        super().__init__(name, potential)
        self.nodes = nodes

    def give(self, handle: int) -> None:
        check(handle, _core.emcon_give_potential(handle, self.name.encode(), self._indices(handle),
                                                 self.address, 0))

    def _indices(self, handle: int) -> NDArray[np.int64]:
        n = count_nodes(handle)
        name = self.nodes if isinstance(self.nodes, str) else ""
        if isinstance(self.nodes, str) and not name.strip():
            raise InputError(f"{self.name}: {name!r} is not the name of a node set")
        if self.nodes is None:
            return np.arange(n)
        if name:
            status, is_in = _core.emcon_find_nodes(handle, name.encode(), n)
            check(handle, status)
            return np.flatnonzero(is_in)
        status, label = _core.emcon_get_labels(handle, n)
        check(handle, status)
        order = np.argsort(label)
        place = np.minimum(np.searchsorted(label, self.nodes, sorter=order), n - 1)
        found = order[place]
        if np.any(label[found] != self.nodes):
            missing = np.asarray(self.nodes)[label[found] != self.nodes][0]
            raise InputError(f"{self.name}: there is no node {missing}")
        if len(np.unique(found)) < len(found):
            twice = np.sort(label[found])
            raise InputError(f"{self.name} names node {twice[:-1][np.diff(twice) == 0][0]} twice")
        return found


class GivenSolid(_Given):
    """The solid of a host, with the pattern of its tangent."""

    kind = _FORCE

    def __init__(self, name: str, solid: Solid, n_node: int, n_dim: int) -> None:
        check_solid(name, solid)
        super().__init__(name)
        self.solid = solid
        self.n_node, self.n_dim = n_node, n_dim
        self.pattern = self._first_pattern()
        #: Pattern of the last tangent that was not sorted like `pattern`, and its places there.
        self._foreign: tuple[NDArray[Any], NDArray[Any], NDArray[Any]] | None = None

    def give(self, handle: int) -> None:
        check(handle, _core.emcon_give_force(handle, self.name.encode(),
                                             matrix_bytes(self.pattern), self.address, 0))

    def _first_pattern(self) -> Csr:
        """Which freedoms depend on which: `solid.pattern`, or those of nodes that meet at rest.

        There a spring along an axis has no entries across it.
        """
        d = self.n_dim
        n = d*self.n_node
        matrix = getattr(self.solid, "pattern", None)
        if matrix is not None:
            pattern = as_csr(matrix, n, f"{self.name}: its pattern")
            check_csr(pattern, f"{self.name}: its pattern")
            return symmetric_pattern(n, *np.divmod(keys_of(pattern), n))
        rest = np.zeros((self.n_node, d))
        matrix = self.respond(rest, rest.copy(), True)[2]
        tangent = as_csr(matrix, n, f"{self.name}: the tangent")
        check_csr(tangent, f"{self.name}: the tangent")
        node = [part//d for part in np.divmod(keys_of(tangent), n)]
        row, column = (np.concatenate([d*node[k] + part[k] for part in np.ndindex(d, d)])
                       for k in (0, 1))
        return symmetric_pattern(n, row, column)

    def respond(self, u0: Array, du: Array, wants_tangent: bool) -> tuple[Array, Array, Any]:
        """What the solid returns, with forces and energy of the right shape."""
        result = self.solid.respond(u0, du, wants_tangent)
        _check_three(result, self.name, "forces, energy and tangent")
        return (fitting(result[0], f"{self.name}: the force", (self.n_node, self.n_dim)),
                fitting(result[1], f"{self.name}: the energy", ()), result[2])

    def _call(self, user: int, n: int, u0: int, du: int, wants_tangent: int, force: int,
              magnitude: int, energy: int, tangent: int) -> int:
        def deed() -> None:
            d = self.n_dim
            forces, last, matrix = self.respond(_view(u0, n, d).copy(), _view(du, n, d).copy(),
                                                bool(wants_tangent))
            _view(force, n, d)[:] = forces
            if wants_tangent:
                self._put(matrix, _view(tangent, len(self.pattern.indices)))
            _view(energy, 1)[0] = last
        return self.guarded(deed)

    def _put(self, matrix: Any, slots: Array) -> None:
        """Put the entries of a tangent into the slots of the pattern."""
        pattern, n, what = self.pattern, self.n_dim*self.n_node, f"{self.name}: the tangent"
        if not is_sparse(matrix):
            dense = fitting(matrix, what, (n, n))
            if len(slots) == n*n:
                slots.reshape(n, n)[:] = dense
                return
            row, column = np.nonzero(dense)
            self._find(row*n + column, n)
            slots[:] = dense[pattern.rows, pattern.indices]
            return
        csr = as_csr(matrix, n, what)
        if _same_pattern(csr, pattern.indptr, pattern.indices):
            slots[:] = csr.data
            return
        if self._foreign is None or not _same_pattern(csr, *self._foreign[:2]):
            check_csr(csr, what)
            place = self._find(keys_of(csr), n)
            self._foreign = csr.indptr.copy(), csr.indices.copy(), place
        slots[:] = 0.0
        slots[self._foreign[2]] = csr.data

    def _find(self, keys: NDArray[np.int64], n: int) -> NDArray[np.intp]:
        """Places of entries in the pattern."""
        place = np.searchsorted(self._slots, keys)
        known = self._slots[np.minimum(place, len(self._slots) - 1)] if len(self._slots) else keys
        missing = keys[(known != keys) | (place == len(self._slots))]
        if len(missing):
            row, column = divmod(int(missing[0]), n)
            raise InputError(f"{self.name}: the tangent has an entry ({row}, {column}) that is not "
                             "in its pattern, that of the nodes that meet at rest; give the solid "
                             "an attribute `pattern`, a matrix with all entries that may come")
        return place

    @cached_property
    def _slots(self) -> NDArray[np.int64]:
        return keys_of(self.pattern)


def check_function(name: str, function: Any) -> None:
    if not callable(function):
        raise InputError(f"{name}: a function is needed, not {function!r}")


def check_solid(name: str, solid: Any) -> None:
    if not callable(getattr(solid, "respond", None)):
        raise InputError(f"{name}: an object with a method respond(u0, du, wants_tangent) is "
                         f"needed, not {solid!r}")


def _same_pattern(matrix: Csr, start: NDArray[Any], column: NDArray[Any]) -> bool:
    return np.array_equal(matrix.indptr, start) and np.array_equal(matrix.indices, column)


def uninterrupted(function: Callable[..., Any], *arguments: Any) -> Any:
    """`function(*arguments)`; Ctrl-C takes effect after it, a second one at once.

    It would be raised where the library calls back, outside of any `try`, and be lost.
    """
    handler: Any = signal.getsignal(signal.SIGINT)
    if not callable(handler) or threading.current_thread() is not threading.main_thread():
        return function(*arguments)
    came: list[int] = []

    def keep(number: int, frame: Any) -> None:
        came.append(number)
        if len(came) > 1:
            handler(number, frame)

    try:
        signal.signal(signal.SIGINT, keep)
        return function(*arguments)
    finally:
        signal.signal(signal.SIGINT, handler)
        if came:
            handler(signal.SIGINT, None)


def raise_kept(given: list[Any], status: int, failure: Callable[[], str]) -> None:
    """Raise what a given function has raised in the call, with the library's text as a note."""
    raised = [(item.name, item.exception) for item in given if item.exception is not None]
    if not raised:
        return
    name, exception = raised[0]
    try:
        exception.add_note(f"{name}: {failure()}" if status else f"raised by {name}")
        raise exception
    finally:
        del raised, exception      # its traceback has this frame


def count_nodes(handle: int) -> int:
    """Nodes of the library model `handle`, which was read."""
    return node_shape(handle)[0]


def node_shape(handle: int) -> tuple[int, int]:
    """Nodes of the library model `handle`, which was read, and its dimensions."""
    status, sizes = _core.emcon_get_sizes(handle)
    check(handle, status)
    found = structure("emcon_sizes", sizes)
    return found["n_node"], found["n_dim"]
