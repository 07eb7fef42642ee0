"""An elastic block of FElupe lands on a plate and rubs over it, with contact and friction of EMCON.

FElupe has mesh, elements, material, mass and assembly; its unknowns are the only ones: the plate is four nodes
that only the interface knows. The material of a step is a discrete gradient of its energy, so that energy plus
what friction takes is constant. Lines that contact adds are marked by `emcon`.

    python felupe_host.py
"""

from __future__ import annotations

from typing import Any

import felupe as fem
import numpy as np
from numpy.typing import NDArray

from emcon.interface import Interface, outer_faces

Floats = NDArray[np.float64]
LAME = (60.0, 40.0)
PLATE = [[-2.0, -2.0, 0.0], [2.0, -2.0, 0.0], [2.0, 2.0, 0.0], [-2.0, 2.0, 0.0]]


def green_strain(f: Floats) -> Floats:
    """Of deformation gradients; points of quadrature and cells are the last two axes."""
    return 0.5*(np.einsum("ki...,kj...->ij...", f, f) - np.eye(3)[:, :, None, None])


def stress(strain: Floats) -> Floats:
    return LAME[0]*np.einsum("kk...,ij->ij...", strain, np.eye(3)) + 2*LAME[1]*strain


class Step:
    """St. Venant and Kirchhoff's material over a step that starts at the deformation gradients `start`."""

    x = [np.eye(3), np.zeros(0)]                     # shapes, for FElupe

    def __init__(self, start: Floats) -> None:
        self.start = start

    def state(self, end: Floats) -> tuple[Floats, Floats]:
        """Deformation in the middle, and the mean of the stresses of both ends."""
        return 0.5*(self.start + end), stress(0.5*(green_strain(self.start) + green_strain(end)))

    def gradient(self, x: list[Floats]) -> list[Floats]:
        middle, mean = self.state(x[0])
        return [np.einsum("ik...,kj...->ij...", middle, mean), x[-1]]

    def hessian(self, x: list[Floats]) -> list[Floats]:
        end, one = x[0], np.eye(3)
        middle, mean = self.state(end)
        turned = np.einsum("im...,km...->ik...", middle, end)
        return [0.5*(np.einsum("ik,jl...->ijkl...", one, mean) + LAME[0]*np.einsum("ij...,kl...->ijkl...", middle, end)
                     + LAME[1]*(np.einsum("ik...,jl->ijkl...", turned, one)
                                + np.einsum("il...,kj...->ijkl...", middle, end)))]


class Host:
    """The block; displacements and velocities are those of its nodes, (n, 3)."""

    def __init__(self, kind: str, friction: float) -> None:
        self.mesh = fem.Cube(a=(-0.7, -0.6, 0.03), b=(0.6, 0.5, 0.63), n=(3, 3, 2))
        self.region = fem.RegionHexahedron(self.mesh)
        self.field = fem.FieldContainer([fem.Field(self.region, dim=3)])
        self.solid = fem.SolidBody(Step(self.field.extract()[0]), self.field, density=1.0)
        self.mass = self.solid.assemble.mass()
        self.u, self.v = np.zeros(self.mesh.points.shape), np.zeros(self.mesh.points.shape)
        n = self.n = self.mesh.npoints
        (faces,) = outer_faces(self.mesh.cells)                               # emcon, to prepare
        self.face = Interface(np.concatenate([self.mesh.points, PLATE]))
        sole = self.face.add_faces("sole", faces[np.isclose(self.mesh.points[faces, 2], 0.03).all(1)])
        plate = self.face.add_faces("plate", [[n, n + 1, n + 2, n + 3]])
        self.face.add_pair(sole, plate, kind, friction=friction)
        self.face.prepare(np.arange(n + 4)[:, None] >= [n, n, n])
        self.face.set_map(self.face.links())          # unknowns are those of FElupe: the plate is held
        self.active, self.lost = np.zeros(self.face.n_contact, bool), 0.0

    def deform(self, u: Floats) -> Floats:
        self.field[0].values[:] = u
        return self.field.extract()[0]

    def energy(self) -> float:
        """Of strain and motion, and what friction took."""
        strain = green_strain(self.deform(self.u))
        density = 0.5*np.einsum("ij...,ij...->...", stress(strain), strain)
        return float((density*self.region.dV).sum() + 0.5*self.v.ravel() @ (self.mass @ self.v.ravel()) + self.lost)

    def step(self, h: float) -> None:
        self.solid.umat.start = self.deform(self.u).copy()

        def respond(du: Floats) -> tuple[Floats, Any]:
            """Residual of the step without contact, and its derivative."""
            self.deform(self.u + du[:self.n])
            force = self.solid.assemble.vector(self.field).toarray().ravel()
            tangent = self.solid.assemble.matrix(self.field)
            return force + self.mass @ (2/h*(du[:self.n]/h - self.v)).ravel(), tangent + 2/h**2*self.mass

        def whole(field: Floats) -> Floats:                                          # emcon
            return np.concatenate([field, np.zeros((4, 3))])

        u, du = whole(self.u), whole(h*self.v)
        du, _, self.active = self.face.solve_step(u, du, self.active, self.face.newton(u, respond), stop=0.5*du,
                                                  together=True)
        self.lost += self.face.slips().loss                                          # emcon
        du = du[:self.n]
        self.u, self.v = self.u + du, 2/h*du - self.v


def thrown(kind: str, friction: float) -> Host:
    host = Host(kind, friction)
    host.v += [1.0, 0.4, -1.0]
    return host


if __name__ == "__main__":
    for name in ("node to segment", "mortar"):
        host = thrown(name, 0.3)
        energy = host.energy()
        for _ in range(24):
            host.step(0.01)
        print(f"{name:16} energy and losses {abs(host.energy()/energy - 1):.0e}, friction took {host.lost/energy:.3f} of it")
