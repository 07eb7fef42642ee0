"""Deck of an elastic bar that bounces under gravity (Doyen, Ern, Piperno 2011).

    python3 make_bouncing_bar.py --output bouncing_bar.inp
"""

from __future__ import annotations

from deckwriter import (Part, add_grid, arguments, box, comment, heading, set_lines,
                        surface_lines, write_deck)
from scenery import CONTACT_CARDS, contact_parameters

LENGTH, WIDTH, HEIGHT = 10.0, 1.0, 5.0

HEADING = """
Elastic bar dropped on a rigid floor: length 10, dropped from 5 under gravity 10.

Source: Doyen, Ern, Piperno 2011; L = 10, E = 900, rho = 1, g = 10, section 1, wave speed c = 30.
A one-dimensional problem as plane strain with nu = 0, linear elastic. The floor is one element
with all its nodes held.
Units: any consistent set (length L, mass M, time T; stress M/(L T^2), thickness 1 L).

What to look at: height of the lower end and contact force over time; the energy over a period.

Expected: the lower end meets the floor at t = 1 with velocity -10, rests there until 1 + 2/3,
          flies (and vibrates) until 3 + 2/3, rests until 4 + 1/3, and is back at height 5 with
          no vibration at t = 5 + 1/3; then all over again.
          Contact force from rho c v = 300 at first touch, growing with gravity to 500, impulse
          266.7; with initiation=PERSISTENT it jumps up and down around these values.
          Total energy (kinetic + strain - work of gravity) is 0 at the start.

Made by make_bouncing_bar.py. Change a parameter for one run: --set h=0.0025
with mortar contact: --set formulation=MORTAR; with another scheme: --set scheme=MIDPOINT
"""

PARAMETERS = f"""
*PARAMETER
h = 0.005
t_end = 5.5
frame = 0.05
method = NULL SPACE
initiation = AUTO
scheme = ENERGY MOMENTUM
{contact_parameters("NODE TO SURFACE", points=3).strip()}
"""

MODEL = """
*MATERIAL, NAME=ROD
*ELASTIC
900., 0.
*DENSITY
1.
*SOLID SECTION, ELSET=BAR, MATERIAL=ROD
1.
*SOLID SECTION, ELSET=FLOOR, MATERIAL=ROD
1.
*SURFACE INTERACTION, NAME=FRICTIONLESS
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=<formulation>, SIDES=<sides>
BAR_END, FLOOR_TOP
*BOUNDARY
FLOOR, 1, 2
*TIME POINTS, NAME=FRAMES, GENERATE
0., <t_end>, <frame>
"""

STEP = f"""
*STEP, INC=1000000
*DYNAMIC, DIRECT
<h>, <t_end>
*TIME INTEGRATION, SCHEME=<scheme>
*CONSTRAINT METHOD, TYPE=<method>
*CONTACT INITIATION, TYPE=<initiation>
{CONTACT_CARDS.strip()}
*DLOAD
BAR, GRAV, 10., 0., -1., 0.
*NODE FILE, TIME POINTS=FRAMES
U, V, RF
*EL FILE, TIME POINTS=FRAMES
S, ENER
*CONTACT FILE, TIME POINTS=FRAMES
CDIS, CSTR, CF
*CONTACT PRINT, TOTALS=ONLY
CF
*END STEP
"""


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--elements", type=int, default=50, metavar="N",
                        help="elements along the bar (default 50)")
    options = parser.parse_args()
    if options.elements < 1:
        parser.error("--elements: at least 1")
    cells = (1, options.elements)

    bar, floor = Part("BAR"), Part("FLOOR")
    bar_grid = add_grid(bar, cells, box((0.0, HEIGHT), (WIDTH, LENGTH), cells))
    floor_grid = add_grid(floor, (1, 1), box((-1.0, -1.0), (3.0, 1.0), (1, 1)),
                          first=(len(bar.node) + 1, len(bar.element) + 1))

    lines = heading(HEADING) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment(f"Bar: {options.elements} elements from the lower end up, left side first")
    lines += bar.node_lines() + bar.element_lines()
    lines += comment("Floor") + floor.node_lines() + floor.element_lines()
    lines += comment("Surfaces and sets")
    lines += surface_lines("BAR_END", "S1", [bar_grid.element[0][0]])
    lines += surface_lines("FLOOR_TOP", "S3", [floor_grid.element[0][0]])
    lines += set_lines("NSET", "LOWER_END", [column[0] for column in bar_grid.node])
    lines += comment("Material, contact, supports") + MODEL.strip().splitlines()
    lines += comment("The run") + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
