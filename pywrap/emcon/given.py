"""What Python gives to a model: laws, potentials, the solid of a host code.

The library calls them through function pointers of C, whichever thread it works in. An exception
cannot pass through it: it is kept, the call of the library fails, and the exception is raised
again where the `Stepper` was called.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any, NoReturn, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .csr import Csr
from .errors import InputError, check

_flat = _core.emcon_flat_given

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
    """To be raised by what is given: there is no energy here, as in an inverted element.

    The step is tried again in smaller parts, as long as the deck allows it.
    """


class Solid(Protocol):
    """A solid, or any other forces between nodes, of a host code."""

    def respond(self, u0: Array, du: Array,
                wants_tangent: bool) -> tuple[ArrayLike, float, Any]:
        """Forces of the step from displacements `u0` by `du`, both (n, 2) and read-only [L].

        Returns forces (n, 2) [M L/T^2], the energy at the end, and the derivative of the forces by
        u0 + du, (2 n, 2 n), freedom a of node i being 2 i + a: a sparse matrix of scipy, a `Csr`,
        or an array; None will do if `wants_tangent` is false. Energy is kept if force . du =
        E(u0 + du) - E(u0). For du = 0 the forces are the gradient of E, and the tangent is that of
        a step too: half the second derivative of E.
        """
        ...


def _view(address: int, *shape: int) -> Array:
    """The array of the library at `address`, no copy."""
    count = int(np.prod(shape))
    return np.frombuffer((ctypes.c_double*count).from_address(address)).reshape(shape)


def _fitting(values: ArrayLike, what: str, shape: tuple[int, ...]) -> Array:
    """What a given function has returned, as an array of the shape that is needed."""
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise InputError(f"{what}: no array can be made of it: {error}") from error
    if array.dtype.kind not in "fiu":
        raise InputError(f"{what} is of dtype {array.dtype}, not real numbers")
    if array.shape != shape:
        raise InputError(f"{what} has the shape {array.shape}, not {shape}")
    return array


class _Given:
    """A function behind a pointer. It must live as long as the models that were given it."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.exception: BaseException | None = None
        self.pointer: Any = None

    def give(self, handle: int) -> None:
        """Give the function to the library model `handle`, which was read and not yet built."""
        raise NotImplementedError

    @property
    def address(self) -> int:
        return int(ctypes.cast(self.pointer, _POINTER).value or 0)

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

    def take_exception(self) -> BaseException | None:
        """The exception of the last call, once."""
        exception, self.exception = self.exception, None
        return exception


class GivenPoints(_Given):
    """An energy at points, of `variables` variables each."""

    def __init__(self, name: str, function: PointFunction, variables: int) -> None:
        if not callable(function):
            raise InputError(f"{name}: a function is needed, not {function!r}")
        super().__init__(name)
        self.function = function
        self.variables = variables
        self.pointer = _POINT(self._call)

    def evaluate(self, points: ArrayLike) -> tuple[Array, Array, Array]:
        """Energies (n,), gradients (n, m) and second derivatives (n, m, m) at `points` (n, m).

        Raises `InputError` for results of wrong shape or type.
        """
        z = np.asarray(points, dtype=float)
        result = self.function(z)
        if not isinstance(result, tuple) or len(result) != 3:
            raise InputError(f"{self.name}: the function is to return energies, gradients and "
                             f"second derivatives, not {type(result).__name__}")
        n, m = len(z), self.variables
        return (_fitting(result[0], f"{self.name}: the energy", (n,)),
                _fitting(result[1], f"{self.name}: the gradient", (n, m)),
                _fitting(result[2], f"{self.name}: the second derivative", (n, m, m)))

    def _call(self, user: int, n: int, m: int, z: int, wants_hessian: int, value: int,
              gradient: int, hessian: int) -> int:
        def deed() -> None:
            points = _view(z, n, m)
            points.flags.writeable = False
            energy, first, second = self.evaluate(points)
            _view(value, n)[:] = energy
            _view(gradient, n, m)[:] = first
            if wants_hessian:
                _view(hessian, n, m, m)[:] = second
        return self.guarded(deed)


class GivenLaw(GivenPoints):
    """The strain energy of a material."""

    def __init__(self, material: str, law: PointFunction) -> None:
        super().__init__(f"the law of {material}", law, 3)
        self.material = material

    def give(self, handle: int) -> None:
        check(handle, _flat.give_law(handle, self.material.encode(), self.address))


class GivenPotential(GivenPoints):
    """A potential of the positions of some nodes: labels (k,), a node set, or None for all."""

    def __init__(self, name: str, potential: PointFunction,
                 nodes: str | NDArray[np.int64] | None) -> None:
        super().__init__(name, potential, 2)
        self.nodes = nodes

    def give(self, handle: int) -> None:
        check(handle, _flat.give_potential(handle, self.name.encode(), self._indices(handle),
                                           self.address))

    def _indices(self, handle: int) -> NDArray[np.int64]:
        n = _status_last(handle, _flat.count_nodes(handle))[0]
        name = self.nodes if isinstance(self.nodes, str) else ""
        label, is_in = _status_last(handle, _flat.find_nodes(handle, name.encode(), n))
        if self.nodes is None:
            return np.arange(n)
        if name:
            return np.flatnonzero(is_in)
        order = np.argsort(label)
        place = np.minimum(np.searchsorted(label, self.nodes, sorter=order), n - 1)
        found = order[place]
        if np.any(label[found] != self.nodes):
            missing = np.asarray(self.nodes)[label[found] != self.nodes][0]
            raise InputError(f"{self.name}: there is no node {missing}")
        return found


class GivenSolid(_Given):
    """The solid of a host, with the pattern of its tangent, and its mass."""

    def __init__(self, name: str, solid: Solid, mass: Any, n_node: int) -> None:
        if not callable(getattr(solid, "respond", None)):
            raise InputError(f"{name}: an object with a method respond(u0, du, wants_tangent) "
                             f"is needed, not {solid!r}")
        super().__init__(name)
        self.solid = solid
        self.n_node = n_node
        self.mass = None if mass is None else given_mass(mass, n_node)
        self.pattern = self._first_pattern()
        self.pointer = _FORCE(self._call)

    def give(self, handle: int) -> None:
        pattern = self.pattern
        check(handle, _flat.give_force(handle, self.name.encode(), pattern.indptr, pattern.indices,
                                       self.address))
        if self.mass is not None:
            check(handle, _flat.give_mass(handle, self.mass.indptr, self.mass.indices,
                                          self.mass.data))

    def _first_pattern(self) -> Csr:
        """Which freedoms depend on which: `solid.pattern`, or as in the tangent at rest."""
        matrix = getattr(self.solid, "pattern", None)
        if matrix is None:
            rest = np.zeros((self.n_node, 2))
            matrix = self.respond(rest, rest, True)[2]
        return _symmetric_pattern(_as_csr(matrix, 2*self.n_node, f"{self.name}: the tangent"))

    def respond(self, u0: Array, du: Array, wants_tangent: bool) -> tuple[Array, float, Any]:
        """What the solid returns, with forces and energy of the right shape."""
        result = self.solid.respond(u0, du, wants_tangent)
        if not isinstance(result, tuple) or len(result) != 3:
            raise InputError(f"{self.name}: respond is to return forces, energy and tangent, not "
                             f"{type(result).__name__}")
        energy = _fitting(result[1], f"{self.name}: the energy", ())
        return (_fitting(result[0], f"{self.name}: the force", (self.n_node, 2)), float(energy),
                result[2])

    def _call(self, user: int, n: int, u0: int, du: int, wants_tangent: int, force: int,
              magnitude: int, energy: int, tangent: int) -> int:
        def deed() -> None:
            start, motion = _view(u0, n, 2), _view(du, n, 2)
            start.flags.writeable = motion.flags.writeable = False
            forces, last, matrix = self.respond(start, motion, bool(wants_tangent))
            _view(force, n, 2)[:] = forces
            _view(energy, 1)[:] = last
            if wants_tangent:
                csr = _as_csr(matrix, 2*n, f"{self.name}: the tangent")
                _view(tangent, len(self.pattern.data))[:] = self._in_pattern(csr)
        return self.guarded(deed)

    def _in_pattern(self, matrix: Csr) -> Array:
        """The entries of `matrix` in the slots of the pattern."""
        pattern = self.pattern
        if (np.array_equal(matrix.indptr, pattern.indptr)
                and np.array_equal(matrix.indices, pattern.indices)):
            return matrix.data
        keys, slots = _keys(matrix), _keys(pattern)
        place = np.minimum(np.searchsorted(slots, keys), len(slots) - 1)
        if len(keys) and not np.array_equal(slots[place], keys):
            row, column = divmod(int(keys[slots[place] != keys][0]), matrix.shape[1])
            raise InputError(f"{self.name}: the tangent has an entry ({row}, {column}) that it did "
                             "not have at rest; give the solid an attribute `pattern` with all")
        data = np.zeros(len(slots))
        data[place] = matrix.data
        return data


def reraise(given: list[Any], failure: Exception) -> NoReturn:
    """Raise what a given function has raised in place of the library's `failure`, or that."""
    for item in given:
        exception = item.take_exception()
        if exception is not None:
            exception.add_note(f"{item.name}: {failure}")
            raise exception
    raise failure


def _status_last(handle: int, found: tuple[Any, ...]) -> tuple[Any, ...]:
    check(handle, found[-1])
    return found[:-1]


def given_mass(matrix: Any, n_node: int) -> Csr:
    """A mass matrix (n, n) between nodes, or (2 n, 2 n) that is the same in both directions.

    Raises `InputError` for one that couples the directions, or differs between them.
    """
    n = getattr(matrix, "shape", np.shape(matrix))[0]
    if n == n_node:
        return _as_csr(matrix, n_node, "the mass")
    full = _as_csr(matrix, 2*n_node, "the mass")
    row, column = np.divmod(_keys(full), 2*n_node)
    along, across = [(row % 2 == a) & (column % 2 == a) for a in (0, 1)]
    least = np.finfo(float).eps*np.abs(full.data).max(initial=0.0)
    if np.any(np.abs(full.data[~(along | across)]) > least):
        raise InputError("the mass couples the two directions; one of nodes is needed")
    halves = [_sorted_csr(n_node, row[part]//2, column[part]//2, full.data[part])
              for part in (along, across)]
    if (not np.array_equal(_keys(halves[0]), _keys(halves[1]))
            or np.any(np.abs(halves[0].data - halves[1].data) > 8*least)):
        raise InputError("the mass is not the same in both directions; one of nodes is needed")
    return halves[0]


def _as_csr(matrix: Any, n: int, what: str) -> Csr:
    """A matrix (n, n) of scipy, as a `Csr`, or as an array, with sorted columns."""
    if not isinstance(matrix, Csr) and not hasattr(matrix, "tocsr"):
        dense = _fitting(matrix, what, (n, n))
        return Csr((n, n), np.arange(0, n*n + 1, n, dtype=np.int32),
                   np.tile(np.arange(n, dtype=np.int32), n), np.ravel(dense).astype(float))
    if matrix.shape != (n, n):
        raise InputError(f"{what} has the shape {matrix.shape}, not {(n, n)}")
    if isinstance(matrix, Csr):
        return matrix
    matrix = matrix.tocsr()
    if not matrix.has_canonical_format:
        matrix = matrix.copy()
        matrix.sum_duplicates()
    return Csr((n, n), np.asarray(matrix.indptr, dtype=np.int32),
               np.asarray(matrix.indices, dtype=np.int32),
               _fitting(matrix.data, what, (len(matrix.indices),)).astype(float))


def _keys(matrix: Csr) -> NDArray[np.int64]:
    """Row times width plus column of each entry, ascending."""
    return matrix.rows.astype(np.int64)*matrix.shape[1] + matrix.indices


def _sorted_csr(n: int, row: NDArray[np.int64], column: NDArray[np.int64], data: Array) -> Csr:
    """The matrix of entries that ascend by rows and columns."""
    start = np.searchsorted(row, np.arange(n + 1)).astype(np.int32)
    return Csr((n, n), start, column.astype(np.int32), data)


def _symmetric_pattern(matrix: Csr) -> Csr:
    """The pattern with every entry's mirror image, and no values."""
    n = matrix.shape[0]
    row, column = np.divmod(_keys(matrix), n)
    keys = np.union1d(row*n + column, column*n + row)
    return _sorted_csr(n, keys//n, keys % n, np.zeros(len(keys)))


def check_derivatives(function: PointFunction, points: ArrayLike, scale: float = 1.0) -> None:
    """Compare the derivatives that `function` gives with differences of what it gives.

    points  (n, m), away from kinks
    scale   size of changes over which the function varies

    Raises `InputError` where a gradient is not that of the energy or a second derivative not that
    of the gradient, by more than differences of second order can tell.
    """
    z = np.asarray(points, dtype=float)
    given = GivenPoints("the function", function, z.shape[1])
    energy, gradient, hessian = given.evaluate(z)
    step = scale*np.finfo(float).eps**(1/3)
    for k in range(z.shape[1]):
        move = np.zeros(z.shape[1])
        move[k] = step
        coarse, fine = ([(after - before)/(2*t*step) for after, before in
                         zip(given.evaluate(z + t*move)[:2], given.evaluate(z - t*move)[:2])]
                        for t in (2.0, 1.0))
        for order, given_value, size in ((0, gradient[:, k], energy), (1, hessian[:, :, k],
                                                                      gradient)):
            noise = 16*np.finfo(float).eps*np.abs(size).max()/step
            doubt = np.abs(coarse[order] - fine[order]).max() + noise
            off = np.abs(fine[order] - given_value)
            if not np.all(off <= doubt):
                point = int(np.unravel_index(np.argmax(off), off.shape)[0])
                raise InputError(
                    f"the {('gradient', 'second derivative')[order]} by variable {k} at "
                    f"{z[point].tolist()} is not the derivative of the "
                    f"{('energy', 'gradient')[order]}: it is off by {off.max():.3g}, differences "
                    f"tell {doubt:.1g}")
