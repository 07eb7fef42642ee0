"""Two bodies of scikit-fem in space, with contact and friction of EMCON: static, and in steps that keep the energy.

scikit-fem meshes and assembles; EMCON's Newton's method condenses its sparse equations to the rows of contact.
In statics forces and gradients are those at the end of the step, else discrete gradients over it.
Lines that contact adds are marked by `emcon`.

    python scikit_fem_space.py
"""

from __future__ import annotations

from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray
from skfem.helpers import ddot, eye, grad, mul, transpose

from emcon.interface import Interface

Floats = NDArray[np.float64]


def green_strain(f: Floats) -> Floats:
    return 0.5*(mul(transpose(f), f) - eye(np.ones_like(f[0, 0]), 3))


def outer_faces(mesh: skfem.MeshHex) -> NDArray[np.int64]:
    """Corners of the faces of one cell only, counter-clockwise as seen from outside."""
    facets = mesh.boundary_facets()
    faces, x = mesh.facets[:, facets].T, mesh.p.T
    out = x[faces].mean(1) - x[mesh.t[:, mesh.f2t[0, facets]]].mean(0)
    normal = np.cross(x[faces[:, 2]] - x[faces[:, 0]], x[faces[:, 3]] - x[faces[:, 1]])
    return np.where(((normal*out).sum(1) < 0)[:, None], faces[:, ::-1], faces)


class Host:
    """A plate, held below, and a block above it, of St. Venant and Kirchhoff's law."""

    def __init__(self, kind: str, friction: float, is_static: bool, lame: tuple[float, float] = (600.0, 400.0)) -> None:
        plate = skfem.MeshHex.init_tensor(*(np.linspace(-1.5, 1.5, 4),)*2, np.array([-0.5, 0.0]))
        block = skfem.MeshHex.init_tensor(np.linspace(-0.7, 0.6, 3), np.linspace(-0.6, 0.5, 3), np.array([0.0, 0.6]))
        block = block.translated((0.0, 0.0, 0.0 if is_static else 0.03))
        self.mesh = skfem.MeshHex(np.hstack([plate.p, block.p]), np.hstack([plate.t, block.t + plate.p.shape[1]]))
        self.x, self.n_plate, self.lame, self.is_static = self.mesh.p.T, plate.p.shape[1], lame, is_static
        self.basis = skfem.Basis(self.mesh, skfem.ElementVector(skfem.ElementHex1()), intorder=3)
        self.mass = skfem.BilinearForm(lambda u, v, w: sum(u[a]*v[a] for a in range(3))).assemble(self.basis)
        self.held = np.isclose(self.x[:, 2], -0.5) | (is_static & np.isclose(self.x[:, 2], 0.6))
        self.u, self.v = np.zeros(self.x.shape), np.zeros(self.x.shape)
        faces, height = outer_faces(self.mesh), self.x[:, 2]
        self.face = Interface(self.x)                                                # emcon, to prepare
        self.face.configure(is_end=is_static, initiation="admissible" if is_static else "persistent")
        on = [faces[(faces < self.n_plate).all(1) & np.isclose(height[faces], 0.0).all(1)],
              faces[(faces >= self.n_plate).all(1) & (height[faces] < 0.1).all(1)]]
        master, slave = (self.face.add_faces(name, nodes) for name, nodes in zip(("plate", "sole"), on, strict=True))
        self.face.add_pair(slave, master, kind, friction=friction)
        self.face.prepare(self.held[:, None] & np.ones(3, bool))
        self.active, self.lost = np.zeros(self.face.n_contact, bool), 0.0

    def stress(self, strain: Floats) -> Floats:
        lam, mu = self.lame
        return lam*eye(strain[0, 0] + strain[1, 1] + strain[2, 2], 3) + 2*mu*strain

    def deformation(self, u: Floats) -> Floats:
        d = grad(self.basis.interpolate(u.ravel()))
        return d + eye(np.ones_like(d[0, 0]), 3)

    def energy(self) -> float:
        """Of strain and motion, and what friction took."""
        end = green_strain(self.deformation(self.u))
        strain = skfem.Functional(lambda w: 0.5*ddot(self.stress(end), end)).assemble(self.basis)
        return float(strain + 0.5*self.v.ravel() @ (self.mass @ self.v.ravel()) + self.lost)

    def respond(self, du: Floats) -> tuple[Floats, Any]:
        """Forces of the solid over the step, in statics at its end, and their derivative by du."""
        end = self.deformation(self.u + du)
        start = end if self.is_static else self.deformation(self.u)
        middle, share = 0.5*(start + end), 1.0 if self.is_static else 0.5
        stress = self.stress(0.5*(green_strain(start) + green_strain(end)))
        latest: list[Any] = [None, None]

        def change(u: Any, v: Any, w: Any) -> Floats:
            if u is not latest[0]:                       # all v are asked for one u in turn
                d = share*grad(u)
                strain = 0.5*(mul(transpose(d), end) + mul(transpose(end), d))
                latest[:] = u, mul(d, stress) + mul(middle, self.stress(strain))
            return ddot(latest[1], grad(v))

        force = skfem.LinearForm(lambda v, w: ddot(mul(middle, stress), grad(v))).assemble(self.basis)
        return force, skfem.BilinearForm(change).assemble(self.basis)

    def step(self, du: Floats, h: float = 1.0) -> None:
        """From the expected motion on, with what is prescribed in it."""

        def respond(du: Floats) -> tuple[Floats, Any]:
            residual, tangent = self.respond(du)
            if self.is_static:
                return residual, tangent
            return residual + self.mass @ (2/h*(du/h - self.v)).ravel(), tangent + 2/h**2*self.mass

        stop = None if self.is_static else 0.5*h*self.v
        newton = self.face.newton(self.u, respond)                                   # emcon
        du, self.lam, self.active = self.face.solve_step(self.u, du, self.active, newton, stop=stop, together=True)
        self.lost += self.face.slips().loss                                          # emcon
        self.u, self.v = self.u + du, self.v if self.is_static else 2/h*du - self.v


def drive(host: Host, along: float, down: float) -> None:
    """One static step by a motion of the top of the block."""
    top = host.held & (host.x[:, 2] > 0)
    host.step(np.where(top[:, None], [along, 0.0, -down], 0.0))


if __name__ == "__main__":
    for name in ("node to segment", "mortar"):
        thrown, pressed = Host(name, 0.3, False), Host(name, 0.3, True)
        thrown.v[thrown.n_plate:] = [1.0, 0.4, -1.0]
        energy = thrown.energy()
        for _ in range(12):
            thrown.step(0.01*thrown.v, 0.01)
        for k in range(6):
            drive(pressed, 0.0 if k < 2 else 0.02, 0.01 if k < 2 else 0.0)
        pull, _, push = pressed.respond(0.0*pressed.u)[0].reshape(-1, 3)[pressed.x[:, 2] == 0.6].sum(0)
        print(f"{name:16} thrown: energy and losses {abs(thrown.energy()/energy - 1):.0e}, friction took "
              f"{thrown.lost/energy:.3f} of it; pressed and dragged: pull by push {-pull/push:.3f}")
