"""Helpers of the tests of tied bodies: decks of the generators, errors against exact solutions."""

import sys

import numpy as np
import scene_tools
from scene_tools import DECKS

sys.path.insert(0, str(DECKS))

import make_tied_cantilever  # noqa: E402
import make_tied_smooth  # noqa: E402

SMOOTH = make_tied_smooth.EXACT
BEAM = make_tied_cantilever.EXACT

#: Gauss points and weights on [-1, 1], exact up to degree 9: errors are no polynomials.
GAUSS = np.polynomial.legendre.leggauss(5)
CORNER = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


def made(scene, folder, *options):
    """A deck of a generator with other options than those of the deck in the tree."""
    return scene_tools.made(f"tied_{scene}", folder, *options)


def error_norms(fields, exact):
    """Errors of four-node linear elastic elements: (displacement in L2, stress in energy).

    `exact` has `displacement(x, y)`, `stress(x, y)`, `young` and `poisson`. Both relative to the
    norms of the solution itself.
    """
    cell = np.array([c for c in fields.cells])
    x, u = fields.x[cell], fields["displacement"][-1][cell]
    stiffness, compliance = hooke(exact.young, exact.poisson)
    total = np.zeros((2, 2))                   # (displacement, energy) of (error, solution)
    for r, wr in zip(*GAUSS, strict=True):
        for s, ws in zip(*GAUSS, strict=True):
            shape, slope = shape_functions(r, s)
            jacobian = np.einsum("ak,eai->eki", slope, x)
            size = wr*ws*np.linalg.det(jacobian)
            gradient = np.linalg.solve(jacobian, np.einsum("ak,eai->eki", slope, u))
            strain = np.stack([gradient[:, 0, 0], gradient[:, 1, 1],
                               gradient[:, 0, 1] + gradient[:, 1, 0]], axis=1)
            point = np.einsum("a,eai->ei", shape, x).T
            place = np.stack(exact.displacement(*point), axis=1)
            wanted = np.stack(exact.stress(*point), axis=1) @ compliance
            for row, (du, de) in enumerate(
                ((np.einsum("a,eai->ei", shape, u) - place, strain - wanted), (place, wanted))
            ):
                total[0, row] += (size*(du**2).sum(axis=1)).sum()
                total[1, row] += (size*np.einsum("ei,ij,ej->e", de, stiffness, de)).sum()
    return np.sqrt(total[:, 0]/total[:, 1])


def shape_functions(r, s):
    """Of the four-node element: values (4,), derivatives in r and s (4, 2)."""
    p, q = 1 + CORNER[:, 0]*r, 1 + CORNER[:, 1]*s
    return p*q/4, np.stack([CORNER[:, 0]*q/4, CORNER[:, 1]*p/4], axis=1)


def hooke(young, poisson):
    """Stiffness and compliance in plane strain, for xx, yy and the engineering shear strain."""
    factor = young/((1 + poisson)*(1 - 2*poisson))
    stiffness = factor*np.array([[1 - poisson, poisson, 0], [poisson, 1 - poisson, 0],
                                 [0, 0, 0.5 - poisson]])
    return stiffness, np.linalg.inv(stiffness)


def residuals(exact, x, y, step=1e-4):
    """How far a field is from equilibrium and from Hooke's law, by central differences."""
    def slope(function, axis):
        dx, dy = ((step, 0.0), (0.0, step))[axis]
        forward, back = function(x + dx, y + dy), function(x - dx, y - dy)
        return [(a - b)/(2*step) for a, b in zip(forward, back, strict=True)]

    sx, sy = slope(exact.stress, 0), slope(exact.stress, 1)
    ux, uy = slope(exact.displacement, 0), slope(exact.displacement, 1)
    stress = hooke(exact.young, exact.poisson)[0] @ [ux[0], uy[1], ux[1] + uy[0]]
    return [sx[0] + sy[2], sx[2] + sy[1], *(stress - exact.stress(x, y))]
