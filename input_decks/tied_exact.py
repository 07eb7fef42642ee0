"""Exact solutions of plane strain elasticity, for the generators `make_tied_*.py`; plain Python.

Written with arithmetic only, so that arrays go through as numbers do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Beam:
    """A cantilever under a parabolic shear load at its free end (Timoshenko's solution).

    The wall, x = 0, moves as the solution says; the load is upwards for force > 0.
    """

    length: float
    depth: float
    force: float
    young: float
    poisson: float

    def displacement(self, x, y):
        young, nu = self.young/(1.0 - self.poisson**2), self.poisson/(1.0 - self.poisson)
        l, d = self.length, self.depth
        factor = 2.0*self.force/(young*d**3)               # P/(6 E' I), I = d^3/12
        return (-factor*y*((6.0*l - 3.0*x)*x + (2.0 + nu)*(y*y - 0.25*d*d)),
                factor*(3.0*nu*y*y*(l - x) + (4.0 + 5.0*nu)*0.25*d*d*x + (3.0*l - x)*x*x))

    def stress(self, x, y):
        """xx, yy, xy."""
        factor = 12.0*self.force/self.depth**3             # P/I
        return (-factor*(self.length - x)*y, 0.0*x,
                0.5*factor*(0.25*self.depth**2 - y*y) + 0.0*x)


def _exponential(rate: complex) -> list[complex]:
    """Coefficients of exp(rate z) up to degree 12: a polynomial is as good a potential."""
    series = [1.0 + 0.0j]
    for k in range(1, 13):
        series.append(series[-1]*rate/k)
    return series


def _derivative(series: Sequence[complex]) -> list[complex]:
    return [k*c for k, c in enumerate(series)][1:]


def _value(series: Sequence[complex], z):
    """Horner's rule."""
    total = 0.0*z
    for c in reversed(series):
        total = total*z + c
    return total


@dataclass(frozen=True)
class Smooth:
    """A smooth field without body force, of the complex potentials phi and psi (Muskhelishvili).

        2 mu (ux + i uy) = (3 - 4 nu) phi - z conj(phi') - conj(psi)
        xx + yy = 4 Re phi',  yy - xx + 2 i xy = 2 (conj(z) phi'' + psi')
    """

    young: float
    poisson: float
    phi: tuple[complex, ...] = tuple(_exponential(1.0 + 2.0j))
    psi: tuple[complex, ...] = tuple(_exponential(-2.0 + 1.5j))

    def displacement(self, x, y):
        z = x + 1j*y
        slope = _value(_derivative(self.phi), z)
        u = ((3.0 - 4.0*self.poisson)*_value(self.phi, z) - z*slope.conjugate()
             - _value(self.psi, z).conjugate())*((1.0 + self.poisson)/self.young)
        return u.real, u.imag

    def stress(self, x, y):
        """xx, yy, xy."""
        z = x + 1j*y
        slope = _derivative(self.phi)
        half_sum = 2.0*_value(slope, z).real
        half = (z.conjugate()*_value(_derivative(slope), z)
                + _value(_derivative(self.psi), z))
        return half_sum - half.real, half_sum + half.real, half.imag
