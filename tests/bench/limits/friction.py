"""Rows of friction: coefficients, speeds of sliding."""

import numpy as np
from friction_scenes import NODES, G, block_on_floor

from .common import Row

#: Of the weight that pushes sideways: what sticks below it, slides above; a block of 2 by 1 tips at 2.
PUSH = 0.2
#: Increments until the block has stopped, its coefficient; what gravity makes it hop by in one, g h,
#: has of its energy (g h/v)^2 at most.
STOPS, RUBS = 20, 0.3
REST = 1/(RUBS*STOPS)**2


def pushed(coefficient):
    """A rigid block on a floor, for a second pushed sideways by a fifth of its weight."""
    return block_on_floor(0.01, 1.0, coefficient, push=PUSH*G, rigid=True)


def push_error(run, coefficient):
    """The way of its middle against (push - mu g) t^2/2, by what it is without friction."""
    u = run.fields()["displacement"][-1][:15, 0]
    exact = 0.5*max(0.0, PUSH - coefficient)*G
    return np.abs(u - exact).max()/(0.5*PUSH*G)


def thrown(speed):
    """A rigid block that is thrown along a floor and stops after twenty increments, of thirty."""
    h = speed/(RUBS*G)/STOPS
    return block_on_floor(h, 1.5*STOPS*h, RUBS, v0=speed, rigid=True)


def way_error(run, speed):
    """The way against v^2/(2 mu g), and what friction took against the kinetic energy."""
    u = run.fields()["displacement"][-1][:15, 0]
    took = run.history["friction_loss"][-1]/run.history["kinetic"][0]
    return max(np.abs(u/(speed**2/(2*RUBS*G)) - 1).max(), abs(took - 1))


ROWS = [
    Row("friction", "coefficient of friction of a block that is pushed by a fifth of its weight",
        (0.1, 1e-3, 1e-6, 1e-12, 0.3, 1.0, 1e3), pushed, push_error, "distance against the closed form",
        bar=1e-10, reach=7, short=(0, 3, -1), parameters=NODES,
        has_matrices=False),
    Row("sliding", "speed [size/s] of a block that slides to rest in 20 increments, on a floor under "
        "gravity of 10 [size/s^2]", (1.0, 1e-1, 1e-2, 1e-3, 1e-6), thrown, way_error,
        "distance, and energy dissipated by friction", bar=REST, reach=4, parameters=NODES,
        has_matrices=False,
        why="the fall in an increment, g h^2/2, must exceed the round-off of positions; otherwise "
            "no contact is found"),
]
