"""Newton's method for a host whose contact is an `emcon.interface.Interface`.

`emcon_solve_step` of the library does not serve here: it solves with all candidates only, not in the
null space of one set of contacts after the other, and it takes no `magnitude` of a residual.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .csr import Csr
from .errors import AnalysisError, InputError

Floats = NDArray[np.float64]
#: Residual and tangent of a motion, and if the host has them the sizes of the residual's parts.
Respond = Callable[[Floats], tuple[Any, ...]]
#: matrix^-1 times the columns of an array.
Solve = Callable[[Any, Floats], Floats]

_EPSILON = float(np.finfo(float).eps)
_MOST_ITERATES = 40


class HostNewton:
    """The iterates of one step of the interface `face` from the displacements `u0`: see `Interface.newton`."""

    def __init__(self, face: Any, u0: Floats, respond: Respond, free: ArrayLike | None,
                 solve: Solve | None) -> None:
        self.face, self.u0, self.respond = face, u0, respond
        self.linear = solve or _solved
        self.free = None if free is None else np.asarray(free)

    def solve(self, du: Floats, n: int) -> tuple[Floats, ...]:
        """The motion, the n multipliers, and the sizes if there are any."""
        face = self.face
        correct = self._by_condensation() if face._has_candidates else self._by_null_space
        reach, lam, last = float(np.abs(face._x).max()), np.zeros(n), np.inf
        for _ in range(_MOST_ITERATES):
            residual, tangent, *sizes = self.respond(du)
            residual = np.array(residual, float).ravel()
            rows = face.evaluate(self.u0, du)
            damping = face.law_forces()[0].ravel()
            residual -= damping @ face._map if face._map else damping
            motion, lam = correct(rows, lam, residual, tangent)
            du = du + motion.reshape(du.shape)
            size = float(np.abs(motion).max(initial=0.0))
            if size <= 4*_EPSILON*reach or last <= size < 1e-10*reach:
                return du, lam, *sizes
            last = size
        raise AnalysisError(f"Newton's method does not converge: its last correction is {size:g}; "
                            "try a smaller step")

    # ---- all candidates: condensed to their rows -------------------------------------------------

    def _by_condensation(self) -> Callable[..., tuple[Floats, Floats]]:
        """A correction by the unknowns that there are: those of ties, else all w or some freedoms."""
        face, own, links = self.face, self.free, None
        if own is None:
            own = np.arange(face._map.shape[1]) if face._map else np.flatnonzero(~face._held)
            links = face.links() if face._n_tie and not face._map else None

        def correct(rows: Any, lam: Floats, residual: Floats, tangent: Any) -> tuple[Floats, Floats]:
            matrix = _less(tangent, face.curvature(lam))
            g, c, motion = rows.g.toarray(), rows.c.toarray(), np.zeros(len(residual))
            if links is None:
                matrix, g, c, right = matrix[own][:, own], g[:, own], c[:, own], residual[own]
            else:
                matrix, g, c, right = _between(links, matrix, links), g @ links, c @ links, residual @ links
            solved = self.linear(matrix, np.column_stack([g.T, right]))
            by_lam, alone = solved[:, :-1], solved[:, -1]
            if len(lam):
                lam = face.solve_contacts(c @ by_lam, rows.defect - c @ alone)
            if links is not None:
                return links @ (by_lam @ lam - alone), lam
            motion[own] = by_lam @ lam - alone
            return (face._map @ motion if face._map else motion), lam

        return correct

    # ---- a set of contacts that hold their gaps: in their null space -----------------------------

    def _by_null_space(self, rows: Any, lam: Floats, residual: Floats, tangent: Any
                       ) -> tuple[Floats, Floats]:
        """A motion of dependent unknowns that closes the defect, and one that no contact notices."""
        face = self.face
        if self.free is not None:
            raise InputError("free goes with solve_step(..., together=True); here the freedoms that "
                             "are held are those given to prepare")
        space = face.null_space()
        if len(space.redundant):
            raise AnalysisError(f"the contacts {rows.contact[space.redundant]} are redundant: "
                                "solve with together=True")
        lam = face.multipliers(residual.reshape(self.u0.shape))
        matrix = _less(tangent, face.curvature(lam))
        part = face.particular(rows.defect).ravel()
        right = (residual + matrix @ part) @ space.p
        along = self.linear(_between(space.p, matrix, space.df), -right[:, None])[:, 0]
        return part + space.df @ along, lam


# ---- arrays and sparse matrices ------------------------------------------------------------------

def _less(tangent: Any, second: Csr) -> Any:
    """The tangent without what contact adds to it, an array if it is one."""
    if isinstance(tangent, np.ndarray):
        return tangent - second.toarray()
    from scipy.sparse import csr_array
    return csr_array(tangent - second.to_scipy())


def _between(left: Csr, matrix: Any, right: Csr) -> Any:
    """The matrix seen by unknowns: left^T matrix right."""
    if isinstance(matrix, np.ndarray):
        return left.toarray().T @ matrix @ right.toarray()
    return left.to_scipy().T @ matrix @ right.to_scipy()


def _solved(matrix: Any, right: Floats) -> Floats:
    if isinstance(matrix, np.ndarray):
        return np.linalg.solve(matrix, right)
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu
    return splu(csc_array(matrix)).solve(right)
