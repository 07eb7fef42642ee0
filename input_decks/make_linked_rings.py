"""Deck of two linked elastic rings, one of which is pulled off the other, in three dimensions.

    python3 make_linked_rings.py --output linked_rings.inp
"""

from __future__ import annotations

import math

from balls import CORNERS
from deckwriter import Part, Point, arguments, comment, heading, number, write_deck

RADIUS, THICK, AROUND, ACROSS = 1.0, 0.25, 32, 2
SPEED = 3.0

HEADING = """
Two elastic rings, linked as in a chain: one flies off, pulls the other along, and both stretch.

Tori of radius 1 and of radius 0.25 in section, {around} C3D8 around and {across} x {across} across each;
E = 400, nu = 0.3, density 1. Both float; the upper one starts at the velocity (0.3, 0, 3).
Units: any consistent set (length L, mass M, time T; stress M/(L T^2)).

What to look at: how the rings pull each other into ovals, let go at 0.6, and catch each other again
while both turn.

Expected: total energy constant to 1e-11 of it, linear and angular momenta to 1e-11 of the largest.

Made by make_linked_rings.py. Change a parameter for one run: --set h=0.0025
"""

PARAMETERS = """
*PARAMETER
h = 0.005
t_end = 1
frame = 0.02
"""

MODEL = """
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, COUPLED NEO HOOKE
400., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=UPPER, MATERIAL=RUBBER
*SOLID SECTION, ELSET=LOWER, MATERIAL=RUBBER
*SURFACE, NAME=OUTER_UPPER
UPPER,
*SURFACE, NAME=OUTER_LOWER
LOWER,
*SURFACE INTERACTION, NAME=SMOOTH
*CONTACT PAIR, INTERACTION=SMOOTH
OUTER_UPPER, OUTER_LOWER
*INITIAL CONDITIONS, TYPE=VELOCITY
UPPER, 1, 0.3
UPPER, 3, {speed}
*TIME POINTS, NAME=FRAMES, GENERATE
0., <t_end>, <frame>
"""

STEP = """
*STEP, NLGEOM, INC=1000000
*DYNAMIC, DIRECT
<h>, <t_end>
*NODE FILE, TIME POINTS=FRAMES
U, V
*EL FILE, TIME POINTS=FRAMES
S, ENER
*END STEP
"""


def disc(s: float, t: float) -> tuple[float, float]:
    """A point of the square [-1, 1]^2 in the disc of radius 1; inside it stays near the square."""
    most, length = max(abs(s), abs(t)), math.hypot(s, t)
    if most == 0.0:
        return 0.0, 0.0
    round_part = most**2
    factor = (1.0 - round_part)*0.7 + round_part*most/length
    return factor*s, factor*t


def place(around: float, s: float, t: float) -> Point:
    """Of a torus about z: the angle `around`, and a point of the square in the section."""
    out, up = disc(s, t)
    arm = RADIUS + THICK*out
    return arm*math.cos(around), arm*math.sin(around), THICK*up


def torus(name: str, turn: str, first: tuple[int, int]) -> Part:
    """The lower ring lies in the plane x, z; the upper one in y, z, a radius above it and in its hole."""
    part = Part(name)
    label: dict[tuple[int, int, int], int] = {}
    for i in range(AROUND):
        for j in range(ACROSS + 1):
            for k in range(ACROSS + 1):
                x, y, z = place(2.0*math.pi*(i + 0.25)/AROUND, 2.0*j/ACROSS - 1.0, 2.0*k/ACROSS - 1.0)
                label[i, j, k] = first[0] + len(label)
                part.node[label[i, j, k]] = (x, -z, y) if turn == "xz" else (z, x, y + RADIUS)
    for i in range(AROUND):
        for j in range(ACROSS):
            for k in range(ACROSS):
                part.element[first[1] + len(part.element)] = tuple(
                    label[(i + c) % AROUND, j + b, k + a] for a, b, c in CORNERS)
    return part


def main() -> None:
    parser = arguments(__doc__)
    options = parser.parse_args()
    lower = torus("LOWER", "xz", (1, 1))
    upper = torus("UPPER", "yz", (max(lower.node) + 1, max(lower.element) + 1))
    lines = heading(HEADING.format(around=AROUND, across=ACROSS)) + ["**"]
    lines += PARAMETERS.strip().splitlines()
    for part in (lower, upper):
        lines += part.node_lines() + part.element_lines()
    lines += MODEL.format(speed=number(SPEED)).strip().splitlines() + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
