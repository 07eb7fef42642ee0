"""Rows of contact in space: the scenes of the plane drawn out, and what only space has."""

import dataclasses
import functools

import numpy as np
from plain_scenes import AUTO, Scene, below

from . import bodies, impacts
from .common import Row, momentum_error, with_facets, with_velocities
from .drawn import SpaceScene


def in_space(make):
    """A function that makes a deck of the plane, in space."""
    return with_velocities(functools.partial(make, make=SpaceScene))


def shifted(offset):
    """A ball falls on a block, both so many of their sizes from the origin."""
    at = offset*np.array([1.0, -1.0, 1.0])
    scene = Scene(0.01, 0.5)
    scene.ball("BALL", tuple(at + (0.1, 0.04, 0.51)), 0.5, (3, 2), velocity=(0.1, 0.05, -1.0))
    scene.block("BLOCK", tuple(at + (-1.0, -1.0, -0.5)), (2, 2, 0.5), (6, 6, 2), stiffness=1000.0)
    return scene.hold("BLOCK", below(at[2] - 0.499)).deck(AUTO)


def crossing(angle):
    """Two free bars, edge over edge, that cross at so many radians; one falls on the other."""
    d, c, s = 0.5**0.5, np.cos(angle), np.sin(angle)

    def roof(sign, height):
        def place(x):
            along, a, b = (x - (1.0, 0.5, 0.5)).T
            y = np.stack([along, d*(a - b), d*(a + b) + height], axis=1)
            return y if sign < 0 else y @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        return place

    scene = Scene(0.01, 0.4)
    scene.block("UPPER", (0, 0, 0), (2, 1, 1), (4, 2, 2), kind="C3D8", shape=roof(1, d + 0.01),
                velocity=(0, 0, -1))
    return scene.block("LOWER", (0, 0, 0), (2, 1, 1), (4, 2, 2), kind="C3D8",
                       shape=roof(-1, -d - 0.01)).deck(AUTO)


def on_a_corner(angle):
    """A cube stands on its corner, but for so many radians, and falls on a block."""
    down = np.array([1.0, 1.0, 1.0])/3**0.5
    axis = np.cross(down, (0, 0, 1.0))
    axis /= np.linalg.norm(axis)
    turn = np.arccos(down[2]) - angle
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    turn = np.eye(3) + np.sin(turn)*k + (1 - np.cos(turn))*k @ k

    def place(x):
        y = (x - 0.5) @ turn.T
        return y - (0, 0, y[:, 2].min() - 0.01)

    scene = Scene(0.01, 0.4)
    scene.block("CUBE", (0, 0, 0), (1, 1, 1), (3, 3, 3), shape=place, velocity=(0, 0, -1))
    scene.block("BLOCK", (-1, -1, -0.5), (2, 2, 0.5), (4, 4, 1))
    return scene.hold("BLOCK", below(-0.5)).deck(AUTO)


def slanted(angle):
    """A cube that is turned by so many radians about an edge falls on a block as it would flat."""
    c, s = np.cos(angle), np.sin(angle)

    def place(x):
        y = (x - 0.5) @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T
        return y - (0, 0, y[:, 2].min() - 0.01)

    scene = Scene(0.01, 0.4)
    scene.block("CUBE", (0, 0, 0), (1, 1, 1), (3, 3, 3), shape=place, velocity=(0, 0, -1))
    scene.block("BLOCK", (-1, -1, -0.5), (2, 2, 0.5), (5, 5, 1))
    return scene.hold("BLOCK", below(-0.5)).deck(AUTO)


def driven(stiffness):
    """As `impacts.dropped`, of a modulus so many times that of rho v^2 of the impact."""
    scene = SpaceScene(0.01, 0.3)
    scene.disc("BALL", (0.1, 0.51), 0.5, (4, 2), velocity=(0.1, -1), stiffness=stiffness)
    scene.block("BLOCK", (-1, -0.5), (2, 0.5), (6, 2), stiffness=stiffness)
    return scene.hold("BLOCK", below(-0.5)).deck(AUTO)


ENERGY = "energy, momenta, overlap beyond 1/50 of a face"
ROWS = [
    Row("space_origin", "in space: offset / size of a ball that falls on a block",
        (0.0, 1e3, 1e6, 1e9), with_velocities(shifted), with_facets, ENERGY, reach=4, short=(2,)),
    Row("space_units", "units of length, mass and time of a ball on a block", bodies.UNITS,
        functools.partial(bodies.in_units, make=SpaceScene),
        functools.partial(bodies.unit_error, make=SpaceScene), "energy; rebound", bar=1e-6, reach=12,
        short=()),
    Row("space_modulus", "modulus / (rho v^2) of a ball and the block that it falls on",
        (1e2, 1e4, 1e6, 1e9, 1e12, 1e1, 1.0, 1e-3, 1e-6, 1e-12), with_velocities(driven), with_facets,
        ENERGY, reach=5, short=(4,)),
    Row("space_aspect", "length / height of elements that a ball falls on",
        (1, 1e2, 1e3, 1e4, 1e5), in_space(bodies.flat_elements), with_facets, ENERGY, reach=5, short=(3,)),
    Row("space_stiffness", "stiffness of a block / that of the ball that falls on it",
        (1, 1e3, 1e6, 1e9, 1e12), in_space(impacts.stiffer), with_facets, ENERGY, reach=5, short=()),
    Row("space_mass", "mass and stiffness of a ball / those of the one that hits it",
        (1, 1e2, 1e4, 1e6, 1e9, 1e12), in_space(impacts.against_heavier), momentum_error, ENERGY, reach=6,
        short=(2,)),
    Row("space_density", "mass of a ball / that of one of the same stiffness that hits it",
        (1, 1e2, 1e4, 1e6, 1e9, 1e12), in_space(impacts.denser), momentum_error, ENERGY, reach=6, short=()),
    Row("space_increment", "h / time of a wave through an element; a ball meets a block in the fifth of ten increments",
        (1.0, 1e-2, 1e-4, 1e-6, 1e-8, 1e1, 1e2, 1e3), in_space(impacts.in_increments), with_facets, ENERGY,
        reach=8, short=(3,)),
    Row("space_speed", "speed of a ball / speed of waves", (1e-2, 1e-4, 1e-6, 0.1, 0.3, 1.0, 2.0),
        in_space(impacts.at_speed), with_facets, ENERGY, reach=6, short=()),
    Row("space_grazing", "angle at which a ball meets a floor [rad]", (1e-2, 1e-4, 1e-6, 1e-8),
        in_space(impacts.grazing), with_facets, ENERGY, reach=4, short=()),
    Row("space_gap", "gap from which a cube falls flat on a floor", (1e-2, 1e-6, 1e-12, 0.0),
        in_space(impacts.from_gap), with_facets, ENERGY, reach=4, short=(3,)),
    Row("space_sizes", "edges of the falling cube / edges of the floor",
        (1, 1/3, 1/10, 3, 10, 30), in_space(impacts.sizes), with_facets, ENERGY, reach=5, short=(3,),
        why="one element meets a thousand nodes at once, and in each increment another set of them acts"),
    Row("space_thin", "width of an element under a ball / width of its neighbours",
        (1e-1, 1e-3, 1e-6, 1e-9, 1e-12), in_space(impacts.thin_column), with_facets, ENERGY, reach=3,
        short=(), why="volumes are refused below 1e-10 of the cube of the longest edge"),
    Row("space_at_once", "nodes along each side of a slab that meets a floor in one increment",
        (4, 10, 20), in_space(impacts.at_once), with_facets, ENERGY, reach=3, short=()),
    Row("space_stack", "blocks of a stack that falls", (2, 5, 10), in_space(impacts.stack), with_facets,
        ENERGY, reach=3, short=()),
    Row("space_crossing", "angle at which the edges of two bars cross [rad]",
        (1.5, 0.3, 1e-1, 1e-2, 1e-3, 1e-6, 0.0), with_velocities(crossing), momentum_error, ENERGY, reach=7,
        short=(2, 6)),
    Row("space_corner", "angle by which a cube is off standing on its corner [rad]",
        (0.3, 1e-1, 1e-2, 1e-4, 1e-8, 0.0), with_velocities(on_a_corner), with_facets, ENERGY, reach=6,
        short=(5,)),
    Row("space_slant", "angle by which a cube is off falling flat [rad]",
        (0.3, 1e-1, 1e-2, 1e-4, 1e-8, 1e-12, 0.0), with_velocities(slanted), with_facets, ENERGY, reach=7,
        short=(4,)),
]
ROWS = [dataclasses.replace(row, parameters=impacts.NODES) for row in ROWS]
