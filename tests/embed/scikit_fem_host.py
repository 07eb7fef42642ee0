"""Two bodies of scikit-fem collide: its assembly supplies the solid, EMCON contact and the step.

What the library asks of a host is a `Solid` with one method: forces of a step, their energy, and
their derivative. Here scikit-fem integrates them, over elastic bodies of linear quadrilaterals with
the law of St. Venant and Kirchhoff. Which stress enters the forces is the host's choice:

    discrete gradient   (S(E0) + S(E1))/2: force . du is the change of energy, whatever du is
    midpoint            S(E) of the displacements in the middle: so to second order of h only

The library adds contact, whose discrete gradients do no work on their own, and solves the steps. So
the total energy stays what it is with the first, and drifts with the second.

    python scikit_fem_host.py
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray
from skfem.helpers import ddot, eye, grad, mul, transpose

from emcon.mesh import boundary_edges
from emcon.model import Model
from emcon.stepper import Stepper

Floats = NDArray[np.float64]


class ElasticSolid:
    """Elastic bodies in plane strain, of thickness 1. scikit-fem numbers freedoms as EMCON does."""

    def __init__(self, mesh: skfem.MeshQuad, young: float, nu: float, density: float,
                 is_conserving: bool) -> None:
        element = skfem.ElementQuad1()
        self.basis = skfem.Basis(mesh, skfem.ElementVector(element), intorder=2)
        self.lam = young*nu/((1 + nu)*(1 - 2*nu))
        self.mu = 0.5*young/(1 + nu)
        self.is_conserving = is_conserving
        #: (n_node, n_node), the same in both directions
        self.mass = skfem.BilinearForm(lambda u, v, w: density*u*v).assemble(
            self.basis.with_element(element))

    def stress(self, strain: Floats) -> Floats:
        """Second Piola-Kirchhoff stress."""
        return self.lam*eye(strain[0, 0] + strain[1, 1], 2) + 2*self.mu*strain

    def respond(self, u0: Floats, du: Floats,
                wants_tangent: bool) -> tuple[Floats, float, Any]:
        """Forces of the step from u0 by du, the energy at its end, the derivative of the forces."""
        f0, df = (grad(self.basis.interpolate(u.ravel())) for u in (u0, du))
        f0 = f0 + eye(np.ones_like(f0[0, 0]), 2)                    # deformation gradients
        f1, middle = f0 + df, f0 + 0.5*df
        end = green_strain(f1)
        if self.is_conserving:
            stress, varied = self.stress(0.5*(green_strain(f0) + end)), f1
        else:
            stress, varied = self.stress(green_strain(middle)), middle

        def density_of_energy(w: Any) -> Floats:
            return 0.5*ddot(self.stress(end), end)

        def power(v: Any, w: Any) -> Floats:
            return ddot(mul(middle, stress), grad(v))

        latest: list[Any] = [None, None]

        def power_change(u: Any, v: Any, w: Any) -> Floats:
            if u is not latest[0]:                                  # all v are asked for one u in turn
                d = 0.5*grad(u)                                     # of the middle
                change = 0.5*(mul(transpose(d), varied) + mul(transpose(varied), d))
                latest[:] = u, mul(d, stress) + mul(middle, self.stress(change))
            return ddot(latest[1], grad(v))

        energy = skfem.Functional(density_of_energy).assemble(self.basis)
        force = skfem.LinearForm(power).assemble(self.basis).reshape(-1, 2)
        tangent = skfem.BilinearForm(power_change).assemble(self.basis) if wants_tangent else None
        return force, energy, tangent


def green_strain(f: Floats) -> Floats:
    """Of a deformation gradient (2, 2, ...)."""
    return 0.5*(mul(transpose(f), f) - eye(np.ones_like(f[0, 0]), 2))


@dataclass
class Collision:
    """What came of it: largest relative change of energy, steps in contact, and every position."""

    drift: float
    momenta: float             #: largest change of any, by the largest at the start
    n_touch: int
    n_step: int
    q: Floats                  #: (n_step + 1, n_node, 2) [L]
    edges: NDArray[np.int64]   #: (k, 2) of the surfaces


def collide(is_conserving: bool, formulation: str, h: float, duration: float = 0.3) -> Collision:
    """Throw a spinning square at a beam that lies free, in steps of size h."""
    beam = skfem.MeshQuad.init_tensor(np.linspace(-1.5, 1.5, 10), np.linspace(-0.6, 0.0, 4))
    square = skfem.MeshQuad.init_tensor(np.linspace(-0.7, 0.1, 5), np.linspace(0.04, 0.84, 5))
    mesh = beam + square
    x = mesh.p.T
    is_square = x[:, 1] > 0.02
    solid = ElasticSolid(mesh, 200.0, 0.3, 1.0, is_conserving)

    model = Model.from_arrays(x)                    # nodes, no elements
    model.host(solid, solid.mass)
    edges = boundary_edges(x, mesh.t.T)             # the way round that EMCON wants them
    model.surface("SQUARE", edges=edges[is_square[edges[:, 0]]])
    model.surface("BEAM", edges=edges[~is_square[edges[:, 0]]])
    model.interaction("HARD").contact_pair("SQUARE", "BEAM", interaction="HARD", type=formulation)
    away = x[is_square] - x[is_square].mean(axis=0)
    speed = [0.3, -2.0] + 1.5*np.stack((-away[:, 1], away[:, 0]), axis=1)
    model.initial("VELOCITY", np.flatnonzero(is_square), (1, 2), speed)
    model.step("DYNAMIC", h, duration, direct=True, nlgeom=True)

    with Stepper(model) as stepper:
        before, energy = stepper.momenta(), stepper.energies()["total"]
        drift, wander, n_touch, q = 0.0, 0.0, 0, [stepper.q]
        size = max(abs(value) for value in before.values())
        while not stepper.is_done:
            n_touch += stepper.step().active > 0
            drift = max(drift, abs(stepper.energies()["total"] - energy)/energy)
            now = stepper.momenta()
            wander = max(wander, *(abs(now[name] - before[name])/size for name in now))
            q.append(stepper.q)
    return Collision(drift, wander, n_touch, len(q) - 1, np.array(q), edges)


if __name__ == "__main__":
    print("largest relative change of energy   discrete gradient   midpoint   steps in contact")
    for name in ("NODE TO SURFACE", "MORTAR"):
        for size in (0.02, 0.01, 0.005):
            kept, drifting = (collide(is_kept, name, size) for is_kept in (True, False))
            print(f"{name:16} h = {size:<5}           {kept.drift:14.1e} {drifting.drift:14.1e}"
                  f"   {kept.n_touch:10} of {kept.n_step}")
