"""A plate pressed sideways on a rigid floor with friction, by nothing of the program: linear elastic
elements in numpy, condensed to the nodes at the floor, and the laws of contact and friction there.

Of the test SSNV128 of code_aster's (`friction_scenes.pressed_sideways`): elements of four nodes
are those of the scene, of eight nodes better ones.
"""

import numpy as np

SIDE, YOUNG, POISSON, MU = 0.04, 1.3e11, 0.2, 1.0
#: Pressure on the top, and on the side.
TOP, LEFT = 5e7, 15e7
#: Natural coordinates of corners and of nodes between them.
XI, ETA = np.array([[-1, 1, 1, -1, 0, 1, 0, -1], [-1, -1, 1, 1, -1, 0, 1, 0]])


def slopes(xi, eta, quadratic):
    """Derivatives of the shape functions by the natural coordinates (2, nodes)."""
    a, b = XI[:4], ETA[:4]
    if not quadratic:
        return 0.25*np.array([a*(1 + b*eta), b*(1 + a*xi)])
    corner = 0.25*np.array([a*(1 + b*eta)*(2*a*xi + b*eta), b*(1 + a*xi)*(a*xi + 2*b*eta)])
    middle = np.zeros((2, 4))
    b, a = ETA[[4, 6]], XI[[5, 7]]
    middle[:, [0, 2]] = -xi*(1 + b*eta), 0.5*b*(1 - xi*xi)
    middle[:, [1, 3]] = 0.5*a*(1 - eta*eta), -eta*(1 + a*xi)
    return np.hstack([corner, middle])


def element(edge, quadratic):
    """Stiffness of a square element in plane strain."""
    elastic = YOUNG/(1 + POISSON)/(1 - 2*POISSON)*np.array(
        [[1 - POISSON, POISSON, 0], [POISSON, 1 - POISSON, 0], [0, 0, 0.5 - POISSON]])
    points, weights = np.polynomial.legendre.leggauss(3 if quadratic else 2)
    n = 8 if quadratic else 4
    stiffness = np.zeros((2*n, 2*n))
    for xi, wx in zip(points, weights, strict=True):
        for eta, wy in zip(points, weights, strict=True):
            d = slopes(xi, eta, quadratic)*2/edge
            strain = np.zeros((3, 2*n))
            strain[0, 0::2], strain[1, 1::2], strain[2, 0::2], strain[2, 1::2] = d[0], d[1], d[1], d[0]
            stiffness += wx*wy*edge**2/4*strain.T @ elastic @ strain
    return stiffness


def assembled(n, quadratic):
    """Matrix and forces of the plate of n by n elements, and its nodes on the grid; -1: none."""
    by = 2 if quadratic else 1
    m = by*n
    there = np.ones((m + 1, m + 1), bool)
    if quadratic:
        there[1::2, 1::2] = False
    node = np.where(there, np.cumsum(there).reshape(there.shape) - 1, -1)
    matrix, force = np.zeros((2*there.sum(), 2*there.sum())), np.zeros((there.sum(), 2))
    one = element(SIDE/n, quadratic)
    for i in range(0, m, by):
        for j in range(0, m, by):
            mine = [node[i, j], node[i + by, j], node[i + by, j + by], node[i, j + by]]
            if quadratic:
                mine += [node[i + 1, j], node[i + 2, j + 1], node[i + 1, j + 2], node[i, j + 1]]
            at = np.stack([2*np.array(mine), 2*np.array(mine) + 1], 1).ravel()
            matrix[np.ix_(at, at)] += one
    share = np.array([1, 4, 1])/6 if quadratic else np.array([1, 1])/2
    for k in range(0, m, by):
        force[node[k:k + by + 1, m], 1] -= TOP*SIDE/n*share
        force[node[0, k:k + by + 1], 0] += LEFT*SIDE/n*share
    return matrix, force.ravel(), node


def laws(compliance, free):
    """Forces that meet the laws at k places: ways are `free` plus the compliance times forces, all
    gaps and then all slips. Newton's method with the trial states of all places at once."""
    k = len(free)//2
    stiffness = 1/np.diag(compliance).mean()
    state = np.where(free[:k] < 0, 1, 0)               # 0 open, 1 sticks, 2 and 3 slide
    for _ in range(60):
        rows, right = np.eye(2*k), np.zeros(2*k)
        closed, held = np.flatnonzero(state > 0), np.flatnonzero(state == 1)
        rows[closed], right[closed] = stiffness*compliance[closed], -stiffness*free[closed]
        rows[k + held], right[k + held] = stiffness*compliance[k + held], -stiffness*free[k + held]
        for sign, kind in ((1, 2), (-1, 3)):
            slides = np.flatnonzero(state == kind)
            rows[k + slides, slides] = sign*MU
        force = np.linalg.solve(rows, right)
        way = free + compliance @ force
        push, drag = (force - stiffness*way).reshape(2, k)
        most = MU*np.maximum(push, 0)
        new = np.select([push <= 0, drag > most, drag < -most], [0, 3, 2], 1)
        if (new == state).all():
            return force
        state = new
    raise RuntimeError("no solution")


def displacements(n, quadratic, places):
    """Displacements sideways of nodes at the floor [1e-6]."""
    matrix, force, node = assembled(n, quadratic)
    held = np.concatenate([2*node[-1][node[-1] >= 0], [2*node[-1, 0] + 1]])
    free = np.setdiff1d(np.arange(len(force)), held)
    floor = node[:-1, 0]
    watched = np.searchsorted(free, np.concatenate([2*floor + 1, 2*floor]))
    unit = np.zeros((len(free), len(watched) + 1))
    unit[watched, np.arange(len(watched))] = 1
    unit[:, -1] = force[free]
    answer = np.linalg.solve(matrix[np.ix_(free, free)], unit)
    pushes = laws(answer[watched, :-1], answer[watched, -1])
    moved = answer[watched] @ np.append(pushes, 1.0)
    x = np.linspace(0, SIDE, len(node))[:-1]
    return [moved[len(floor) + np.argmin(abs(x - place))]*1e6 for place in places]
