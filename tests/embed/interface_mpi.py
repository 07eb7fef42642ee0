"""The blocks of `interface_solid` by several processes of MPI: cells and unknowns have owners, surfaces none.

Each process has the whole interface, and asks it with the displacements of all surface nodes: contacts, their
sets and their multipliers are the same everywhere. It computes the cells that it owns, and of the equations and
of the rows of contact the columns of its own unknowns. What is exchanged is put together in the order of cells
and unknowns: the bits do not depend on how many processes there are. Lines that MPI adds are marked by `mpi`.

    mpirun -n 3 python interface_mpi.py KIND FRICTION N_STEP
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np
from interface_solid import Floats, Host, Solid, collision
from mpi4py import MPI

WORLD = MPI.COMM_WORLD


class Spread(Solid):
    """Hexahedra of which each process computes its own."""

    def __init__(self, solid: Solid) -> None:
        vars(self).update(vars(solid))
        self.own = np.array_split(np.arange(len(self.cells)), WORLD.size)[WORLD.rank]    # mpi

    def elements(self, u0: Floats, du: Floats) -> tuple[Floats, Floats]:
        found = []
        for k in self.own:                      # one by one: no sum depends on how many there are
            part = Solid.__new__(Solid)
            vars(part).update(vars(self))
            part.cells, part.dof, part.slope, part.volume = (
                array[k:k + 1] for array in (self.cells, self.dof, self.slope, self.volume))
            found.append(part.elements(u0, du))
        every = [pair for of_one in WORLD.allgather(found) for pair in of_one]           # mpi
        return tuple(np.concatenate(parts) for parts in zip(*every, strict=True))


class SpreadHost(Host):
    """The host, whose unknowns have owners."""

    def __init__(self, host: Host) -> None:
        vars(self).update(vars(host))
        self.solid = Spread(host.solid)
        self.own = np.array_split(self.free, WORLD.size)[WORLD.rank]                     # mpi

    def newton(self, h: float) -> Callable[[Floats, int], tuple[Floats, Floats]]:
        return lambda du, n: self.solve(h, du, np.zeros(n))

    def solve(self, h: float, du: Floats, lam: Floats) -> tuple[Floats, Floats]:
        own, free, last = self.own, self.free, np.inf
        for _ in range(40):
            force, tangent = self.solid.respond(self.u, du)
            rows = self.face.evaluate(self.u, du)
            # A product of some rows may round otherwise than that of all.
            residual = (self.solid.mass @ (2/h*(du/h - self.v)).ravel() + force)[own]
            tangent = tangent[own] + 2/h**2*self.solid.mass[own] - self.face.curvature(lam).toarray()[own]
            g, c = rows.g.toarray()[:, own].T, rows.c.toarray()[:, own].T
            equations = np.concatenate(WORLD.allgather(                                  # mpi
                np.column_stack([tangent[:, free], g, residual, c])))
            n = len(free)
            solved = np.linalg.solve(equations[:, :n], equations[:, n:n + len(lam) + 1])
            by_lam, alone, c = solved[:, :-1], solved[:, -1], equations[:, n + len(lam) + 1:].T
            if len(lam):
                lam = self.face.solve_contacts(c @ by_lam, rows.defect - c @ alone)
            motion = by_lam @ lam - alone
            du.ravel()[free] += motion
            size = np.abs(motion).max()
            if size <= 1e-15 or last <= size < 1e-11:
                return du, lam
            last = size
        raise ArithmeticError(f"Newton's method still moves by {size:g}")


if __name__ == "__main__":
    kind, friction, n_step = sys.argv[1], float(sys.argv[2]), int(sys.argv[3])
    bodies = SpreadHost(collision(kind, friction))
    start = bodies.energy()
    for _ in range(n_step):
        bodies.step(0.01)
    state = np.concatenate([bodies.u.ravel(), bodies.v.ravel(), [bodies.lost, bodies.energy()/start - 1]])
    if len(set(WORLD.allgather(state.tobytes()))) > 1:
        raise ArithmeticError("processes differ")
    if WORLD.rank == 0:
        print(*map(float.hex, state.tolist()), sep="\n")
