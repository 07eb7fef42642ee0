"""What the engine computes for a step, asked for without making it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .arguments import flag_array, positive, real_array
from .csr import Csr
from .errors import AnalysisError, InputError
from .handle import Handle
from .memory import copied, csr, matrix, structure, whole

_NO_REALS = np.empty(0)
_NO_FLAGS = np.empty(0, dtype=np.int32)


class Evaluation:
    """What a step of size h from the state of a stepper to displacements u1 computes.

    The step is not made. The object is valid until the model changes, or until the next evaluation
    or report of constraints, also by the short forms of the stepper; then it raises `InputError`.
    """

    def __init__(self, stepper: Queries, with_tangent: bool, *arguments: Any) -> None:
        self._handle = stepper._handle
        self._n_node, self._n_unknown = stepper.n_node, stepper.n_unknown
        self._has_null_space = False
        self._handle.n_reports += 1
        self._handle.change(_evaluate, int(with_tangent), *arguments)
        self._n_changes = self._handle.n_changes

    def _call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        if self._handle.address and self._n_changes != self._handle.n_changes:
            raise InputError("this evaluation is stale: since it was made the model was changed, "
                             "or another evaluation or report of constraints was made")
        return self._handle.call(function, *arguments)

    def residual(self, *, contact: bool = True) -> NDArray[np.float64]:
        """Inertia plus internal forces minus loads, (n_node, n_dim) [M L/T^2].

        With `contact` minus contact forces, too. At prescribed freedoms it is the reaction.
        """
        return self._call(lambda a: _core.emcon_residual(
            a, int(contact), self._n_node, 0, no_unknown=1)[:2])

    def unknown_residual(self, *, contact: bool = True) -> NDArray[np.float64]:
        """The same on the unknowns, (n_unknown,): T^T r with the `links` T. 0 solves the step."""
        return self._call(lambda a: _core.emcon_residual(
            a, int(contact), 0, self._n_unknown, no_nodal=1)[::2])

    def tangent(self, *, contact: bool = True) -> Csr:
        """Derivative of the residual with respect to the unknowns at the end, for given multipliers.

        (n_unknown, n_unknown) [M/T^2]. With `contact` it contains the second derivatives of the gaps
        times the multipliers. Needs an evaluation ``with_tangent``.
        """
        return self._call(_matrices, _core.emcon_tangent, int(contact))

    def null_space(self) -> tuple[Csr, Csr]:
        """P and DF, each (n_dim n_node, independent unknowns), for the constraints that act.

        P^T G^T = 0 and C DF = 0 for their discrete gradients G and their gradients C at the end.
        Ties, equations and prescribed freedoms are eliminated. Raises `AnalysisError` if some
        constraints depend on others.
        """
        return self._call(_null_space)

    def multipliers(self) -> NDArray[np.float64]:
        """Contact forces that balance the residual without them, (n_constraint,) [M L/T^2].

        They balance it in the dependent unknowns of `null_space`; 0 for constraints that do not
        act.
        """
        if not self._has_null_space:
            self._call(_null_space)
            self._has_null_space = True
        return self._call(_multipliers)


@dataclass(frozen=True, eq=False)
class ConstraintReport:
    """The n contact constraints between two configurations that have a surface near.

    Gaps are > 0 where open, and ``dgap = discrete_gradient @ (u1 - u0).ravel()`` to round-off.
    """

    id: NDArray[np.int32]            #: (n) index into `lam`, `active`, `contact()`
    pair: NDArray[np.int32]          #: (n) from 0, in the order of the deck
    node: NDArray[np.int32]          #: (n) row of the slave node in arrays of nodes
    gap0: NDArray[np.float64]        #: (n) at the start [L]
    gap1: NDArray[np.float64]        #: (n) at the end
    dgap: NDArray[np.float64]        #: (n) the difference, to relative accuracy
    size: NDArray[np.float64]        #: (n) length of an edge [L]
    discrete_gradient: Csr           #: (n, n_dim n_node) G
    jacobian: Csr                    #: (n, n_dim n_node) C: gradient of gap1 by the end
    _handle: Handle = field(repr=False)
    _n_reports: int = field(repr=False)
    _n_node: int = field(repr=False)
    _n_dim: int = field(repr=False)

    def curvature_times(self, factor: ArrayLike, direction: ArrayLike) -> NDArray[np.float64]:
        """Sum over the constraints of factor times (dG/du1) times direction, (n_node, n_dim).

        `factor` (n,), for instance multipliers; `direction` (n_node, n_dim). Only for the last report
        or evaluation of a stepper; earlier ones raise `InputError`.
        """
        factor = real_array(factor, "the factor", self.id.shape)
        direction = real_array(direction, "the direction", (self._n_node, self._n_dim))
        if self._handle.address and self._n_reports != self._handle.n_reports:
            raise InputError("this report is stale: constraints were asked for again, "
                             "or a step was evaluated")
        return self._handle.call(_core.emcon_curvature_times, factor, direction)


class Queries:
    """Queries of a stepper. They change neither the state nor any bit of later steps."""

    _handle: Handle
    n_node: int
    n_dim: int
    n_constraint: int
    n_body: int

    @property
    def n_unknown(self) -> int:
        raise NotImplementedError

    @property
    def positions(self) -> NDArray[np.float64]:
        raise NotImplementedError

    def guess(self, h: float) -> NDArray[np.float64]:
        """Displacements with which the iteration of a step of size h begins, (n_node, n_dim) [L]."""
        return self._handle.call(_core.emcon_guess, positive(h, "h"), self.n_node)

    def evaluate(self, u1: ArrayLike, h: float, *, lam: ArrayLike | None = None,
                 active: ArrayLike | None = None, with_tangent: bool = True) -> Evaluation:
        """Evaluate the step of size h [T] from the present state to `u1` (n_node, n_dim) [L].

        `lam` [M L/T^2] and `active`, both (n_constraint,), are those of the state if not given.
        Constraints that have no surface near do not act. Dependent nodes of ties and equations
        follow the others. Raises `AnalysisError` where `u1` inverts an element.
        """
        u1 = real_array(u1, "u1", (self.n_node, self.n_dim))
        h = positive(h, "h")
        lam, active = contact_arguments(lam, active, self.n_constraint)
        return Evaluation(self, with_tangent, h, u1, lam, active)

    def residual(self, u1: ArrayLike, h: float, *, lam: ArrayLike | None = None,
                 active: ArrayLike | None = None, contact: bool = True) -> NDArray[np.float64]:
        """Residual at the nodes, (n_node, n_dim): see `evaluate` for the arguments."""
        evaluation = self.evaluate(u1, h, lam=lam, active=active, with_tangent=False)
        return evaluation.residual(contact=contact)

    def tangent(self, u1: ArrayLike, h: float, *, lam: ArrayLike | None = None,
                active: ArrayLike | None = None, contact: bool = True) -> Csr:
        """Tangent on the unknowns: see `evaluate` for the arguments."""
        return self.evaluate(u1, h, lam=lam, active=active).tangent(contact=contact)

    def null_space(self, u1: ArrayLike, h: float, *, lam: ArrayLike | None = None,
                   active: ArrayLike | None = None) -> tuple[Csr, Csr]:
        """P and DF: see `evaluate` for the arguments."""
        evaluation = self.evaluate(u1, h, lam=lam, active=active, with_tangent=False)
        return evaluation.null_space()

    @property
    def mass(self) -> Csr:
        """The consistent mass between nodes, the same in all directions, (n_node, n_node) [M]."""
        return self._handle.call(_matrices, _core.emcon_mass)

    @property
    def links(self) -> Csr:
        """T, (n_dim n_node, n_unknown): displacements are T times unknowns, up to prescribed motion.

        Row n_dim i + a is direction a of node i, both from 0. That of a prescribed freedom is empty,
        that of a dependent one has the weights of those that it follows.
        """
        return self._handle.call(_matrices, _core.emcon_links)

    @property
    def unknowns(self) -> NDArray[np.int32]:
        """Number of the unknown of each degree of freedom, (n_node, n_dim), from 0.

        -1: prescribed, dependent, or without an element."""
        return self._handle.call(_core.emcon_unknowns, self.n_node)

    def constraint(self, q0: ArrayLike | None = None, q1: ArrayLike | None = None, *,
                   u0: ArrayLike | None = None, u1: ArrayLike | None = None,
                   keeps_gap: bool = False) -> ConstraintReport:
        """Contact between positions `q0` and `q1`, or displacements `u0` and `u1`, (n_node, n_dim) [L].

        The library works with displacements. Positions are rounded to about 1e-16 of X, and gaps have
        that error then: give displacements if it matters. With `keeps_gap` each constraint keeps the
        gap of the start, as persistent contact does: gaps are counted from there, and integrated gaps
        have other gradients.
        """
        if (q0 is None) != (q1 is None) or (u0 is None) != (u1 is None) \
                or (q0 is None) == (u0 is None):
            raise InputError("give either q0 and q1 or u0 and u1")
        shape = (self.n_node, self.n_dim)
        if q0 is not None:
            x = self.positions
            u0, u1 = real_array(q0, "q0", shape) - x, real_array(q1, "q1", shape) - x
        u0, u1 = real_array(u0, "u0", shape), real_array(u1, "u1", shape)
        self._handle.n_reports += 1
        report = self._handle.change(_constraints, u0, u1, int(bool(keeps_gap)))
        return ConstraintReport(*report, self._handle, self._handle.n_reports, self.n_node,
                                self.n_dim)

    def body_momenta(self) -> NDArray[np.float64]:
        """px, py [M L/T] and lz about the origin [M L^2/T] of each body, (n_body, 3).

        In space px, py, pz, lx, ly, lz, (n_body, 6).
        """
        return self._handle.call(_core.emcon_get_momenta, self.n_body)


def contact_arguments(lam: ArrayLike | None, active: ArrayLike | None,
                      n: int) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Multipliers and active flags for the library; without entries where not given."""
    return (_NO_REALS if lam is None else real_array(lam, "lam", (n,)),
            _NO_FLAGS if active is None else flag_array(active, "active", (n,)))


def _counts(address: int) -> tuple[int, int]:
    """All constraints, and those of ties and equations, which stand before contact."""
    _, sizes = _core.emcon_get_sizes(address)
    counts = structure("emcon_sizes", sizes)
    return counts["n_constraint"], counts["n_constraint"] - counts["n_contact"]


def of_all(address: int, lam: NDArray[np.float64], active: NDArray[np.int32]
           ) -> tuple[int, int, NDArray[np.float64], NDArray[np.int32]]:
    """The status, the number of all constraints, and `contact_arguments` for all of them.

    Ties and equations keep what they have.
    """
    n, before = _counts(address)
    if not before or not (lam.size or active.size):
        return 0, n, lam, active
    status, old, acted = _core.emcon_get_multipliers(address, n)
    return (status, n, np.concatenate((old[:before], lam)) if lam.size else lam,
            np.concatenate((acted[:before], active)) if active.size else active)


def _evaluate(address: int, with_tangent: int, h: float, u1: NDArray[np.float64],
              lam: NDArray[np.float64], active: NDArray[np.int32]) -> int:
    status, n, lam, active = of_all(address, lam, active)
    return status or int(_core.emcon_evaluate(address, h, u1, with_tangent, n, lam, active))


def _multipliers(address: int) -> tuple[int, NDArray[np.float64]]:
    """Those of contact."""
    n, before = _counts(address)
    _, sizes = _core.emcon_get_sizes(address)
    nothing = np.empty((0, structure("emcon_sizes", sizes)["n_dim"]))
    status, lam = _core.emcon_multipliers(address, 0, nothing, n)
    return status, lam[before:]


def _null_space(address: int) -> tuple[Any, ...]:
    """The status, and P and DF."""
    status, p, df, n, _ = _core.emcon_null_space(address)
    if n and not status:
        raise AnalysisError("there is no null space: some of the constraints that act are "
                            "redundant")
    return (status,) if status else (0, (matrix(p), matrix(df)))


def _matrices(address: int, function: Callable[..., Any], *arguments: Any) -> tuple[Any, ...]:
    """The status and copies of the matrices that a function of the library makes."""
    status, *found = function(address, *arguments)
    if status:
        return (status,)
    copies = tuple(matrix(data) for data in found)
    return 0, copies[0] if len(copies) == 1 else copies


def _constraints(address: int, u0: NDArray[np.float64], u1: NDArray[np.float64],
                 keeps_gap: int) -> tuple[Any, ...]:
    """The status and the arrays of a report, in the order of `ConstraintReport`."""
    status, data = _core.emcon_constraints(address, u0, u1, keeps_gap)
    if status:
        return (status,)
    found = structure("emcon_constraint_report", data)
    n = found["n"]
    return (0, whole(found["id"], n) - np.int32(_counts(address)[1]), whole(found["pair"], n),
            whole(found["node"], n),
            *(copied(found[name], n) for name in ("gap0", "gap1", "dgap", "size")),
            csr(found["discrete_gradient"]), csr(found["end_gradient"]))
