"""How ill the matrices of a step are: the saddle point (6) against the null space (7).

Of the paper's equations, on the unknowns, with N the tangent, G and C the discrete gradients and
the gradients at the end of the contacts that act:

    (6)   [N -G^T; C 0],    (6) with multipliers in units of the largest diagonal entry of N,
    (7)   P^T N DF.

Condition numbers are those of the 1-norm, their inverses by Hager and Higham's estimate.
"""

import numpy as np
import scipy.sparse as sparse
from emcon import AnalysisError, Stepper
from scipy.sparse.linalg import LinearOperator, onenormest, splu

#: Increments until contact at most; without any the last one is taken.
MOST = 200


def condition(matrix):
    """Of a square sparse matrix, in the 1-norm; inf where it is singular."""
    matrix = sparse.csc_matrix(matrix)
    if matrix.shape[0] == 0:
        return 1.0
    try:
        factor = splu(matrix)
    except RuntimeError:
        return np.inf
    inverse = LinearOperator(matrix.shape, matvec=factor.solve,
                             rmatvec=lambda x: factor.solve(x, "T"))
    return float(abs(matrix).sum(axis=0).max()*onenormest(inverse))


def matrices(stepper, h):
    """N, G, C, P, DF on the unknowns, from the present state over a step of size h."""
    u1 = stepper.guess(h)
    try:
        evaluation = stepper.evaluate(u1, h)
    except AnalysisError:                            # the guess turns elements over
        u1 = stepper.u
        evaluation = stepper.evaluate(u1, h)
    tangent = evaluation.tangent().to_scipy()
    number = stepper.unknowns.ravel()
    freedom = np.empty(stepper.n_unknown, dtype=int)
    freedom[number[number >= 0]] = np.flatnonzero(number >= 0)
    spaces = [space.to_scipy().tocsr()[freedom] for space in evaluation.null_space()]
    links = stepper.links.to_scipy()
    report = stepper.constraint(u0=stepper.u, u1=u1)
    acts = np.flatnonzero(stepper.active[report.id])
    rows = [part.to_scipy().tocsr()[acts] @ links
            for part in (report.discrete_gradient, report.jacobian)]
    return (tangent, *rows, *spaces)


def conditions_of(stepper, h):
    """Condition numbers: of (6), of (6) with scaled multipliers, of (7)."""
    tangent, force, gap, p, df = matrices(stepper, h)
    unit = abs(tangent.diagonal()).max()
    return (condition(sparse.bmat([[tangent, -force.T], [gap, None]])),
            condition(sparse.bmat([[tangent, -unit*force.T], [unit*gap, None]])),
            condition(p.T @ tangent @ df))


def conditions(deck, parameters):
    """Of a deck, after the first increment that ends in contact; None where none can be made, or
    where nothing is unknown."""
    with Stepper(deck, **parameters) as stepper:
        try:
            for _ in range(MOST):
                h = stepper.step().h
                if stepper.active.any() or stepper.is_done:
                    break
            return conditions_of(stepper, h) if stepper.n_unknown > 0 else None
        except AnalysisError:
            return None
