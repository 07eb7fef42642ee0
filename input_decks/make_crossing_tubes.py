"""Deck of a rubber tube that falls across another one, in three dimensions.

    python3 make_crossing_tubes.py --output crossing_tubes.inp
"""

from __future__ import annotations

import math
from itertools import product

from balls import CORNERS, OUTER_FACE
from deckwriter import Part, arguments, comment, heading, number, set_lines, write_deck

#: Outer and inner radius, length, cells around, across the wall and along.
OUTER, INNER, LENGTH = 0.5, 0.36, 3.0
CELLS = (20, 2, 10)
GAP, SPEED = 0.03, 1.5
#: The upper tube is turned by that from crossing at a right angle.
TURN = math.radians(20.0)

HEADING = """
A rubber tube falls across another one that is held at its ends: both flatten, and it bounces off.

Tubes of radii 0.5 and 0.36, 3 long, of C3D8H, neo-Hooke with a shear modulus of 160 and a bulk modulus of
1600, density 1; they cross at 70 degrees. The upper one falls with a speed of 1.5; no friction.
Units: any consistent set (length L, mass M, time T; stress M/(L T^2)).

What to look at: the walls flatten where they meet, and the lower tube bends as a whole.

Expected: total energy constant to 1e-11 of it; nothing turns the upper tube but the slopes of the
          lower one, so that it flies off almost without spin.

Made by make_crossing_tubes.py. Change a parameter for one run: --set h=0.005
"""

PARAMETERS = """
*PARAMETER
h = 0.01
t_end = 1.2
frame = 0.03
"""

MODEL = """
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, NEO HOOKE
80., 0.00125
*DENSITY
1.
*SOLID SECTION, ELSET=LOWER, MATERIAL=RUBBER
*SOLID SECTION, ELSET=UPPER, MATERIAL=RUBBER
*SURFACE, NAME=BELOW, TYPE=ELEMENT
LOWER_SKIN, {face}
*SURFACE, NAME=ABOVE, TYPE=ELEMENT
UPPER_SKIN, {face}
*SURFACE INTERACTION, NAME=SMOOTH
*CONTACT PAIR, INTERACTION=SMOOTH
ABOVE, BELOW
*BOUNDARY
ENDS, 1, 3
*INITIAL CONDITIONS, TYPE=VELOCITY
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


def tube(name: str, first: int, height: float, turn: float) -> tuple[Part, list[int], list[int]]:
    """A tube whose axis is x turned about z; its elements at the outside, the nodes at its ends."""
    around, across, along = CELLS
    part, skin, ends = Part(name), [], []

    def label(i: int, j: int, k: int) -> int:
        return first + i % around + around*(k + (across + 1)*j)

    for i, k, j in product(range(around), range(across + 1), range(along + 1)):
        angle, radius = 2.0*math.pi*i/around, INNER + (OUTER - INNER)*k/across
        x, y = LENGTH*(j/along - 0.5), radius*math.cos(angle)
        part.node[label(i, j, k)] = (x*math.cos(turn) - y*math.sin(turn),
                                     x*math.sin(turn) + y*math.cos(turn),
                                     height + radius*math.sin(angle))
        if j in (0, along):
            ends.append(label(i, j, k))
    for m, (j, i, k) in enumerate(product(range(along), range(around), range(across)), start=first):
        part.element[m] = tuple(label(i + a, j + b, k + c) for a, b, c in CORNERS)
        if k == across - 1:
            skin.append(m)
    return part, skin, sorted(ends)


def main() -> None:
    options = arguments(__doc__).parse_args()
    lower, below, ends = tube("LOWER", 1, 0.0, 0.0)
    upper, above, _ = tube("UPPER", max(lower.node) + 1, 2.0*OUTER + GAP, 0.5*math.pi - TURN)

    lines = heading(HEADING) + ["**"] + PARAMETERS.strip().splitlines() + comment("Tubes")
    for part in (lower, upper):
        lines += part.node_lines() + [line.replace("TYPE=C3D8", "TYPE=C3D8H")
                                      for line in part.element_lines()]
    lines += set_lines("ELSET", "LOWER_SKIN", below) + set_lines("ELSET", "UPPER_SKIN", above)
    lines += set_lines("NSET", "ENDS", ends)
    lines += comment("Material, contact, supports") + MODEL.strip().format(
        face=OUTER_FACE, speed=number(-SPEED)).splitlines()
    lines += comment("The run") + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
