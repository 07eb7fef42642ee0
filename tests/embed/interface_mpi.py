"""The blocks of `interface_solid` by several processes of MPI: cells and unknowns have owners, surfaces none.

Each process has the whole interface, and asks it with the displacements of all surface nodes: contacts, their
sets and their multipliers are the same everywhere. It computes the cells that it owns, and gives the equations
of its own unknowns to the solver. What is exchanged is put together in the order of cells and unknowns: the bits
do not depend on how many processes there are. Lines that MPI adds are marked by `mpi`.

    mpirun -n 3 python interface_mpi.py FRICTION N_STEP KIND ...
"""

from __future__ import annotations

import sys

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
    """The host, whose equations have owners."""

    def __init__(self, host: Host) -> None:
        vars(self).update(vars(host))
        self.solid = Spread(host.solid)

    def solve(self, matrix: Floats, right: Floats) -> Floats:
        """The solver: equations come from their owners. A solver for MPI takes its own rows alone."""
        own = np.array_split(np.arange(len(matrix)), WORLD.size)[WORLD.rank]                # mpi
        equations = np.concatenate(WORLD.allgather(np.column_stack([matrix[own], right[own]])))
        return np.linalg.solve(equations[:, :len(matrix)], equations[:, len(matrix):])


if __name__ == "__main__":
    friction, n_step, *kinds = float(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:]
    for kind in kinds:
        bodies = SpreadHost(collision(kind, friction))
        start = bodies.energy()
        for _ in range(n_step):
            bodies.step(0.01)
        state = np.concatenate([bodies.u.ravel(), bodies.v.ravel(), [bodies.lost, bodies.energy()/start - 1]])
        if len(set(WORLD.allgather(state.tobytes()))) > 1:
            raise ArithmeticError("processes differ")
        if WORLD.rank == 0:
            print(*map(float.hex, state.tolist()))
