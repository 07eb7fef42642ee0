"""Two elastic blocks collide and rub in space: a finite element code in numpy that takes contact from EMCON.

The code has hexahedra of St. Venant and Kirchhoff's law, conserving steps and a dense solver. Its
forces over a step are a discrete gradient: the stress of the mean of the strains at both ends, on
the deformation gradient in the middle. Lines that contact adds are marked by `emcon`.

    python interface_solid.py
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from emcon.interface import Interface, outer_faces

Floats = NDArray[np.float64]
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])


def block(n: tuple[int, int, int], low: Floats, size: Floats, first: int = 0) -> tuple[Floats, NDArray[np.int64]]:
    """Nodes of a block of n cells from its corner `low`, and the cells, of nodes from `first` on."""
    place = np.array(list(product(*(range(k + 1) for k in n))))
    number = {tuple(p): first + k for k, p in enumerate(place)}
    cells = [[number[tuple(p)] for p in cell + CORNERS] for cell in product(*map(range, n))]
    return low + place/n*size, np.array(cells)


class Solid:
    """Elastic hexahedra with 2 x 2 x 2 points; `lame` constants, density."""

    def __init__(self, x: Floats, cells: NDArray[np.int64], lame: tuple[float, float], density: float) -> None:
        self.x, self.cells, self.lame = x, cells, lame
        self.dof = (3*cells[:, :, None] + np.arange(3)).reshape(len(cells), -1)
        slope, volume, shape = [], [], []
        for p in product(0.5 + np.array([-1, 1])/12**0.5, repeat=3):
            part = np.where(CORNERS, p, 1 - np.array(p))
            dn = np.stack([np.delete(part, a, 1).prod(1)*(2*CORNERS[:, a] - 1) for a in range(3)], 1)
            jacobian = np.einsum("ia,eib->eab", dn, x[cells])
            slope.append(np.einsum("eba,ia->eib", np.linalg.inv(jacobian), dn))
            volume.append(np.linalg.det(jacobian)/8)
            shape.append(part.prod(1))
        self.slope, self.volume = np.stack(slope, 1), np.stack(volume, 1)     # (cell, point, ...)
        mass, n = np.zeros((len(x), len(x))), np.array(shape)
        np.add.at(mass, (cells[:, :, None], cells[:, None, :]), density*np.einsum("ep,pi,pj->eij", self.volume, n, n))
        self.mass = np.kron(mass, np.eye(3))

    def gradient(self, u: Floats) -> Floats:
        return np.einsum("eia,epib->epab", u[self.cells], self.slope)

    def stress(self, strain: Floats) -> Floats:
        lam, mu = self.lame
        return lam*np.einsum("epaa,bc->epbc", strain, np.eye(3)) + 2*mu*strain

    def energy(self, u: Floats) -> float:
        e = strain(self.gradient(u))
        return 0.5*float(np.einsum("epab,epab,ep->", e, self.stress(e), self.volume))

    def elements(self, u0: Floats, du: Floats) -> tuple[Floats, Floats]:
        """Forces of each cell over the step, and their derivative by du."""
        d0, d1 = self.gradient(u0), self.gradient(u0 + du)
        s = self.stress(0.5*(strain(d0) + strain(d1)))
        g, w, one, (lam, mu) = self.slope, self.volume[:, :, None, None], np.eye(3), self.lame
        middle, end = one + 0.5*(d0 + d1), one + d1
        force = (w*g @ (middle @ s).swapaxes(-1, -2)).sum(1).reshape(self.dof.shape)
        by_middle, by_end = (g @ f.swapaxes(-1, -2) for f in (middle, end))
        both = np.einsum("epia,epjb->eiajb", w*by_middle, by_end)
        k = 0.5*lam*both + 0.5*mu*both.transpose(0, 3, 2, 1, 4)
        k += 0.5*mu*np.einsum("epab,epij->eiajb", w*(middle @ end.swapaxes(-1, -2)), g @ g.swapaxes(-1, -2))
        k += 0.5*np.einsum("epij,ab->eiajb", w*(g @ s @ g.swapaxes(-1, -2)), one)
        return force, k.reshape(len(k), 24, 24)

    def respond(self, u0: Floats, du: Floats) -> tuple[Floats, Floats]:
        """The sums of these over all cells."""
        of_cells, tangents = self.elements(u0, du)
        force, tangent = np.zeros(self.x.size), np.zeros((self.x.size, self.x.size))
        np.add.at(force, self.dof, of_cells)
        np.add.at(tangent, (self.dof[:, :, None], self.dof[:, None, :]), tangents)
        return force, tangent


def strain(d: Floats) -> Floats:
    """Of displacement gradients."""
    return 0.5*(d + d.swapaxes(-1, -2) + d.swapaxes(-1, -2) @ d)


class Host:
    """Where a collision stands: displacements, velocities, what contact knows."""

    solve = None            # the linear solver: numpy's

    def __init__(self, solid: Solid, face: Interface) -> None:
        self.solid, self.face = solid, face
        self.u, self.v = np.zeros(solid.x.shape), np.zeros(solid.x.shape)
        self.active = np.zeros(face.n_contact, bool)                             # emcon
        #: What friction and damping have taken; contacts that were open, stuck and slid, over all steps.
        self.lost, self.n_status = 0.0, np.zeros(3, int)

    def energy(self) -> float:
        """Of motion and strain, and what contact has taken."""
        v = self.v.ravel()
        return 0.5*v @ self.solid.mass @ v + self.solid.energy(self.u) + self.lost

    def respond(self, h: float, du: Floats) -> tuple[Floats, Floats]:
        """Residual of a step without contact, and its derivative."""
        force, tangent = self.solid.respond(self.u, du)
        return force + self.solid.mass @ (2/h*(du/h - self.v)).ravel(), tangent + 2/h**2*self.solid.mass

    def step(self, h: float) -> None:
        newton = self.face.newton(self.u, lambda du: self.respond(h, du), solve=self.solve)     # emcon
        du, _, self.active = self.face.solve_step(                               # emcon
            self.u, h*self.v, self.active, newton, stop=0.5*h*self.v, h=h, together=True)
        slips, (_, damped) = self.face.slips(), self.face.law_forces()           # emcon
        self.lost += slips.loss + damped
        self.n_status += np.bincount(slips.status, minlength=3)
        self.u, self.v = self.u + du, 2/h*du - self.v


def collision(kind: str = "node to segment", friction: float = 0.3, itself: bool = False, **more: Any) -> Host:
    """A block that flies askew at a plate, which is held below; as two surfaces or as one of both bodies."""
    below, lower = block((3, 3, 1), np.array([-1.5, -1.5, -0.5]), np.array([3.0, 3.0, 0.5]))
    above, upper = block((2, 2, 1), np.array([-0.7, -0.6, 0.03]), np.array([1.2, 1.0, 0.6]), len(below))
    (c, s), x = (np.cos(0.4), np.sin(0.4)), np.concatenate([below, above])
    x[len(below):] = x[len(below):] @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T
    face, cells = Interface(x), np.concatenate([lower, upper])                   # emcon, to prepare
    (skin,) = outer_faces(cells)
    if itself:
        slave = master = face.add_faces("skin", skin)
    else:
        slave, master = (face.add_faces(name, skin[np.isclose(x[skin, 2], z).all(1)])
                         for name, z in (("sole", 0.03), ("plate", 0.0)))
    face.add_pair(slave, master, kind, friction=friction, **more)
    face.prepare(np.isclose(x[:, 2], -0.5)[:, None] & np.ones(3, bool))
    host = Host(Solid(x, cells, (600.0, 400.0), 1.0), face)
    host.v[len(below):] = [1.0, 0.4, -1.0]
    return host


if __name__ == "__main__":
    for name in ("node to segment", "mortar"):
        bodies = collision(name)
        start, drift = bodies.energy(), 0.0
        for _ in range(20):
            bodies.step(0.01)
            drift = max(drift, abs(bodies.energy() - start)/start)
        print(f"{name:16} energy and losses {drift:.0e}, friction took {bodies.lost/start:.3f} of it; contacts "
              f"that slid {bodies.n_status[2]}, stuck {bodies.n_status[1]}")
