"""Rows of solids in three dimensions."""

import numpy as np
from scene_tools import Deck, number
from space_mesh import Block

from .bodies import fall_error, strain_error
from .common import Row, energy_error

LAW = "*ELASTIC\n100., 0.3\n"


def cube(after, cells=(1, 1, 1), law=LAW, density=1.0, **more):
    return Deck("*HEADING\nsolid\n" + Block("C3D8", cells, **more).deck(law, after, density))


def stretched(excess):
    """One element pulled along x to 1 + excess, all nodes driven: as in the plane."""
    block = Block("C3D8", (1, 1, 1))
    lines = "".join(f"{k}, 1, 3\n" for k in block.on(0, 0))
    lines += "".join(f"{k}, 1, 1, {number(excess)}\n{k}, 2, 3\n" for k in block.on(0, 1))
    return cube(f"*STEP, NLGEOM\n*STATIC\n0.25, 1.\n*BOUNDARY\n{lines}*EL FILE\nS, ENER\n"
                "*NODE FILE\nU\n*END STEP\n")


def falling(value):
    """One element in free fall: rho L^2/(E h^2), and offset / size."""
    scale, offset = value
    size = 0.7
    h = (size**2/(100*scale))**0.5
    gravity = 0.1/h**2
    return cube(f"*STEP, NLGEOM\n*DYNAMIC, DIRECT\n{h!r}, {10*h!r}\n"
                f"*DLOAD\nALL, GRAV, {gravity!r}, 0., -1., 0.\n*NODE FILE\nU, V\n*END STEP\n",
                size=(size, size, size), place=lambda x: x + offset*np.array([1, -1, 1]))


def spinning(angle):
    """A block that turns about a diagonal by so many radians in each increment, and vibrates."""
    axis = np.ones(3)/3**0.5
    block = Block("C3D8", (2, 1, 1), size=(2, 1, 1))
    speed = np.cross(angle/0.1*axis, block.x - block.x.mean(0))
    lines = "".join(f"{k}, {i + 1}, {number(v[i])}\n" for k, v in enumerate(speed, 1)
                    for i in range(3))
    return cube(f"*INITIAL CONDITIONS, TYPE=VELOCITY\n{lines}*STEP, NLGEOM, INC=1000\n"
                "*DYNAMIC, DIRECT\n0.1, 10.\n*NODE FILE\nU, V\n*END STEP\n", (2, 1, 1),
                f"*HYPERELASTIC, COUPLED NEO HOOKE\n{1e4*angle**2!r}, 0.3\n", size=(2, 1, 1))


def spin_error(run, _):
    history = run.history
    spin = np.array([history[name] for name in ("lx", "ly", "lz")])
    return max(energy_error(run), np.abs(spin - spin[:, :1]).max()/np.linalg.norm(spin[:, 0]))


ROWS = [
    Row("space_strain", "in three dimensions: strain of an element, driven: 1e-12 to 9",
        (1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 4.0, 9.0), stretched, strain_error,
        "energy and stress, relative", bar=1e-8, reach=8),
    Row("space_scale", "rho L^2/(E h^2) of an element of space in free fall",
        tuple((10.0**k, 0.0) for k in (0, 4, 8, 12, 16, 20, -4, -8, -12, -16, -20)), falling,
        fall_error, "position after ten increments", bar=1e-8, reach=8, short=(0, 5, 7, -2),
        why="as in the plane"),
    Row("space_offset", "offset / size of it", tuple((1.0, 10.0**k) for k in (0, 3, 6, 9, 12)),
        falling, fall_error, "position after ten increments", bar=1e-8, reach=5),
    Row("space_rotation", "radians that a block of space turns by in an increment",
        (0.1, 0.5, 1.0, 2.0, 3.0, 6.0), spinning, spin_error, "energy, angular momentum", reach=6),
]
