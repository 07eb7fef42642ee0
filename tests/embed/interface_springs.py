"""Two lattices of springs collide: a host code of some numpy lines that takes contact from EMCON.

The host knows point masses and springs, and solves dense equations. What it has to bring for a step
of size h from displacements u0 to u0 + du is the residual

    r = M (2/h^2 du - 2/h v0) + f(u0, du),

whose spring forces f are a discrete gradient of their energy: f . du is the change of energy,
whatever du is. With the discrete gradients of the library for contact the sum of all energies stays
what it is, and so do momentum and angular momentum. Lines that contact adds are marked by `emcon`.

    python interface_springs.py
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from emcon.interface import Interface

Floats = NDArray[np.float64]


@dataclass
class Lattices:
    """Point masses, joined by springs: energy k L e^2/2 with the strain e = (l^2 - L^2)/(2 L^2)."""

    x: Floats = field(default_factory=lambda: np.zeros((0, 2)))     #: (n_node, 2) positions [L]
    v: Floats = field(default_factory=lambda: np.zeros((0, 2)))     #: (n_node, 2) velocities
    spring: list[tuple[int, int]] = field(default_factory=list)     #: nodes at the ends
    stiffness: float = 200.0                                        #: k
    mass: float = 1.0                                               #: of each node

    def __post_init__(self) -> None:
        self.u = np.zeros_like(self.x)

    def add(self, cells: tuple[int, int], low: tuple[float, float], size: tuple[float, float],
            velocity: tuple[float, float]) -> NDArray[np.int32]:
        """Add a rectangle of cells with both diagonals; return its nodes, (columns, rows)."""
        nx, ny = cells[0] + 1, cells[1] + 1
        node = len(self.x) + np.arange(nx*ny, dtype=np.int32).reshape(nx, ny)
        grid = np.stack(np.indices((nx, ny)), -1)/np.array(cells)
        self.x = np.vstack((self.x, (np.array(low) + grid*size).reshape(-1, 2)))
        self.v = np.vstack((self.v, np.tile(velocity, (nx*ny, 1))))
        self.u = np.zeros_like(self.x)
        for first, last in ((node[:-1], node[1:]), (node[:, :-1], node[:, 1:]),
                            (node[:-1, :-1], node[1:, 1:]), (node[1:, :-1], node[:-1, 1:])):
            self.spring += zip(first.ravel().tolist(), last.ravel().tolist())
        return node

    def strains(self, u: Floats) -> tuple[Floats, Floats, Floats]:
        """Strains of the springs, their present directions (n, 2), their lengths without load."""
        i, j = np.array(self.spring).T
        side, turn = self.x[j] - self.x[i], u[j] - u[i]
        square = (side**2).sum(1)
        return ((side + turn/2)*turn).sum(1)/square, side + turn, np.sqrt(square)

    def energy(self) -> float:
        """Of motion and of the springs."""
        strain, _, length = self.strains(self.u)
        return 0.5*self.mass*(self.v**2).sum() + 0.5*self.stiffness*(length*strain**2).sum()

    def momenta(self) -> Floats:
        """px, py, and the angular momentum about the origin."""
        (qx, qy), (vx, vy) = (self.x + self.u).T, self.v.T
        return self.mass*np.array([vx.sum(), vy.sum(), (qx*vy - qy*vx).sum()])

    def respond(self, h: float, du: Floats) -> tuple[Floats, Floats, Floats]:
        """Residual (2 n), its derivative by du, sizes of what the residual consists of (n, 2)."""
        i, j = np.array(self.spring).T
        strain0, way0, length = self.strains(self.u)
        strain1, way1, _ = self.strains(self.u + du)
        middle = (way0 + way1)/2
        pull = 0.5*self.stiffness/length*(strain0 + strain1)
        force = pull[:, None]*middle
        residual = self.mass*2/h*(du/h - self.v)
        magnitude = self.mass*2/h*(abs(du/h) + abs(self.v))
        for end, sign in ((i, -1.0), (j, 1.0)):
            np.add.at(residual, end, sign*force)
            np.add.at(magnitude, end, abs(force))
        block = (0.5*self.stiffness/length**3)[:, None, None]*middle[:, :, None]*way1[:, None, :]
        block += 0.5*pull[:, None, None]*np.eye(2)
        tangent = np.zeros(2*self.x.shape)
        for row, column, sign in ((i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)):
            for a in range(2):
                for b in range(2):
                    np.add.at(tangent, (row, a, column, b), sign*block[:, a, b])
        tangent = tangent.reshape(residual.size, residual.size)
        tangent[np.diag_indices_from(tangent)] += self.mass*2/h**2
        return residual.ravel(), tangent, magnitude


def advance(host: Lattices, face: Interface, h: float, active: NDArray[np.bool_]
            ) -> NDArray[np.bool_]:
    """One step of size h; `active` are the contacts that act, before and after."""
    du, _, active = face.solve_step(host.u, h*host.v, active,                # emcon, in the null space
                                    face.newton(host.u, lambda du: host.respond(h, du)))
    host.u = host.u + du
    host.v = 2/h*du - host.v
    return active


@dataclass
class Collision:
    """What came of it: largest relative change of energy and momenta, steps in contact, speeds."""

    drift: float
    momenta: Floats
    n_touch: int
    before: float
    after: float


def collide(formulation: str = "mortar", n_step: int = 150, h: float = 0.01) -> Collision:
    """Throw a lattice of 4 x 2 cells at one of 7 x 3, whose nodes do not meet its own."""
    host = Lattices()
    lower = host.add((7, 3), (-3.5, -3.0), (7.0, 3.0), (0.0, 0.25))
    upper = host.add((4, 2), (-2.2, 0.1), (4.0, 2.0), (0.3, -1.0))
    with Interface(host.x) as face:                                          # emcon, to prepare
        top, bottom = lower[::-1, -1], upper[:, 0]        # the body to the left of its edges
        master = face.add_surface("lower", np.stack((top[:-1], top[1:]), 1))
        slave = face.add_surface("upper", np.stack((bottom[:-1], bottom[1:]), 1))
        face.add_pair(slave, master, formulation)
        face.prepare()
        active = np.zeros(face.n_contact, bool)
        energy, momenta = host.energy(), host.momenta()
        before = host.v[upper, 1].mean()
        drift, wander, n_touch = 0.0, np.zeros(3), 0
        for _ in range(n_step):
            active = advance(host, face, h, active)
            drift = max(drift, abs(host.energy() - energy)/energy)
            wander = np.maximum(wander, abs(host.momenta() - momenta)/abs(momenta))
            n_touch += bool(active.any())
    return Collision(drift, wander, n_touch, before, host.v[upper, 1].mean())


if __name__ == "__main__":
    for name in ("node to segment", "segment", "mortar"):
        result = collide(name)
        print(f"{name:16} energy {result.drift:.1e}  momenta {result.momenta.max():.1e}  "
              f"steps in contact {result.n_touch:3}  speed {result.before:.2f} -> "
              f"{result.after:.2f}")
