"""Deck of two rings pressed into each other: shrink fit against Lame.

    python3 make_press_fit.py --output press_fit.inp
    python3 make_press_fit.py --hub 16x8 --sleeve 22x11 --output press_fit_unlike.inp
"""

from __future__ import annotations

import math
from collections.abc import Callable

from deckwriter import (Grid, Part, Point, add_grid, arguments, cells_argument, comment, heading,
                        number, set_lines, surface_lines, write_deck)
from scenery import CONTACT_CARDS, contact_parameters

BORE, JOINT, RIM = 1.0, 2.0, 3.0
YOUNG, POISSON = 1000.0, 0.3
INTERFERENCE = 1e-3            # of the radii
STIFFNESS = YOUNG/(1.0 - POISSON**2)
PRESSURE = (STIFFNESS*INTERFERENCE/JOINT*(JOINT**2 - BORE**2)*(RIM**2 - JOINT**2)
            / (2.0*JOINT**2*(RIM**2 - BORE**2)))
AT_BORE = -2.0*PRESSURE*BORE*JOINT**2/(STIFFNESS*(JOINT**2 - BORE**2))
AT_RIM = 2.0*PRESSURE*RIM*JOINT**2/(STIFFNESS*(RIM**2 - JOINT**2))

HEADING = f"""
Press fit: a hub that is too large in a sleeve, static, plane strain, no friction.

Quarters of two rings, radii {BORE:g} to {JOINT:g} and {JOINT:g} to {RIM:g}, E = {YOUNG:g}, nu = {POISSON:g}, linear
elastic, small displacements. The hub is larger by {INTERFERENCE:g} than the hole: the deck begins with
overlapping bodies, which CONTACT INTERFERENCE pushes apart. Symmetry on both axes.
Units: any consistent set (force F, length L; stress F/L^2, thickness 1 L).

What to look at: the same pressure all around; one step is enough, without a load.

Expected at the end (Lame): pressure {PRESSURE:.6f}; radial displacement {AT_BORE:.6e} at the bore and
          {AT_RIM:.6e} at the rim. Errors fall with the square of the element size, also where
          nodes do not meet nodes: gaps are then measured between the arcs through the nodes.

Made by make_press_fit.py. Change a parameter for one run: --set formulation=SEGMENT
"""

PARAMETERS = f"""
*PARAMETER
h = 0.5
method = NULL SPACE
{contact_parameters().strip()}
"""

MODEL = f"""
*MATERIAL, NAME=LINEAR
*ELASTIC
{number(YOUNG)}, {number(POISSON)}
*SOLID SECTION, ELSET=HUB, MATERIAL=LINEAR
1.
*SOLID SECTION, ELSET=SLEEVE, MATERIAL=LINEAR
1.
*SURFACE INTERACTION, NAME=FRICTIONLESS
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=<formulation>, SIDES=<sides>
SLEEVE_HOLE, HUB_SEAT
*BOUNDARY
UPRIGHT, 1
FLAT, 2
"""

STEP = f"""
*STEP
*STATIC
<h>, 1.
*CONTACT INTERFERENCE, SHRINK
*CONSTRAINT METHOD, TYPE=<method>
{CONTACT_CARDS.strip()}
*NODE FILE
U, RF
*EL FILE
S, ENER
*CONTACT FILE
CDIS, CSTR, CF
*CONTACT PRINT, TOTALS=YES
CDIS, CSTR, CF
*END STEP
"""


def quarter(radii: tuple[float, float], cells: tuple[int, int]) -> Callable[[int, int], Point]:
    """Places of a quarter ring: from the upright axis clockwise, and outwards."""
    inner, outer = radii

    def place(i: int, j: int) -> Point:
        angle, r = 0.5*math.pi*(1.0 - i/cells[0]), inner + (outer - inner)*j/cells[1]
        return (0.0 if i == 0 else r*math.cos(angle), 0.0 if i == cells[0] else r*math.sin(angle))

    return place


def end_nodes(grids: tuple[Grid, Grid], column: int) -> list[int]:
    return [label for grid in grids for label in grid.node[column]]


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--hub", type=cells_argument, default=(16, 8), metavar="16x8",
                        help="elements around and through the hub")
    parser.add_argument("--sleeve", type=cells_argument, default=(16, 8), metavar="16x8",
                        help="elements around and through the sleeve")
    options = parser.parse_args()

    hub, sleeve = Part("HUB"), Part("SLEEVE")
    inside = add_grid(hub, options.hub, quarter((BORE, JOINT + INTERFERENCE), options.hub))
    outside = add_grid(sleeve, options.sleeve, quarter((JOINT, RIM), options.sleeve),
                       first=(len(hub.node) + 1, len(hub.element) + 1))

    lines = heading(HEADING) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Hub, radial line by radial line from the upright axis, each outwards")
    lines += hub.node_lines() + hub.element_lines()
    lines += comment("Sleeve, likewise") + sleeve.node_lines() + sleeve.element_lines()
    lines += comment("Sets and surfaces")
    lines += set_lines("NSET", "UPRIGHT", end_nodes((inside, outside), 0))
    lines += set_lines("NSET", "FLAT", end_nodes((inside, outside), -1))
    lines += surface_lines("HUB_SEAT", "S3", [column[-1] for column in inside.element])
    lines += surface_lines("SLEEVE_HOLE", "S1", [column[0] for column in outside.element])
    lines += comment("Materials, contact, symmetry") + MODEL.strip().splitlines()
    lines += comment("The fit") + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
