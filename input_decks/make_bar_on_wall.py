"""Deck of an elastic bar that hits a rigid wall, code_aster's test SDNV100.

    python3 make_bar_on_wall.py --output bar_on_wall.inp
"""

from __future__ import annotations

from deckwriter import (Part, add_grid, arguments, box, comment, heading, number, set_lines,
                        surface_lines, write_deck)
from scenery import CONTACT_CARDS, contact_parameters

LENGTH, SIDE, GAP = 0.2, 0.01, 0.002
YOUNG, DENSITY, SPEED = 2.0e11, 8000.0, 100.0
WAVE = 5000.0                                    # sqrt(YOUNG/DENSITY)

ENERGY = 0.5*DENSITY*LENGTH*SIDE*SIDE*SPEED**2

HEADING = f"""
Elastic bar on a rigid wall: length {LENGTH:g} m, side {2*SIDE:g} m, {SPEED:g} m/s, gap {GAP:g} m.

Source: code_aster, test SDNV100 (V5.03.100), a quarter of the section. E = {YOUNG:g} Pa,
nu = 0, density {DENSITY:g} kg/m^3, wave speed {WAVE:g} m/s, linear elastic, small strains.
Units: m, kg, s, N, J.

What to look at: energy, velocity of the bar after the impact, force over time.

Expected: the lower end is at the wall from {GAP/SPEED:g} s to {GAP/SPEED + 2*LENGTH/WAVE:g} s; the upper end has
          moved by {-SPEED*4e-5:g} m at 4e-05 s and is back at 0 at 1.2e-04 s; then the bar flies
          with {SPEED:g} m/s, unstrained.
          Total energy {ENERGY:g} J. Force at the wall {DENSITY*WAVE*SPEED*SIDE**2:g} N all the while.
          The mesh vibrates a little: the wave front is steeper than elements can carry.

Made by make_bar_on_wall.py. Change a parameter for one run: --set initiation=PERSISTENT
"""

PARAMETERS = f"""
*PARAMETER
h = 2.5e-7
t_end = 1.6e-4
frame = 5.0e-6
method = NULL SPACE
initiation = MASSLESS
{contact_parameters("NODE TO SURFACE", points=3).strip()}
"""

MODEL = f"""
*MATERIAL, NAME=STEEL
*ELASTIC
{number(YOUNG)}, 0.
*DENSITY
{number(DENSITY)}
*SOLID SECTION, ELSET=BAR, MATERIAL=STEEL
{number(SIDE)}
*SURFACE, TYPE=SEGMENTS, NAME=WALL
START, -0.1, 0.
LINE, 0.1, 0.
*NODE, NSET=HOLD
9999, 0., 0.
*RIGID BODY, ANALYTICAL SURFACE=WALL, REF NODE=9999
*SURFACE INTERACTION, NAME=FRICTIONLESS
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=<formulation>, SIDES=<sides>
LOWER_END, WALL
*BOUNDARY
HOLD, 1, 2
HOLD, 6
*INITIAL CONDITIONS, TYPE=VELOCITY
BAR, 2, {number(-SPEED)}
*TIME POINTS, NAME=FRAMES, GENERATE
0., <t_end>, <frame>
"""

STEP = f"""
*STEP, INC=1000000
*DYNAMIC, DIRECT
<h>, <t_end>
*CONSTRAINT METHOD, TYPE=<method>
*CONTACT INITIATION, TYPE=<initiation>
{CONTACT_CARDS.strip()}
*NODE PRINT, NSET=ENDS
U, V
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
    parser.add_argument("--elements", type=int, default=40, metavar="N",
                        help="elements along the bar (default 40)")
    options = parser.parse_args()
    if options.elements < 2:
        parser.error("--elements: at least 2")
    cells = (1, options.elements)

    bar = Part("BAR")
    grid = add_grid(bar, cells, box((0.0, GAP), (SIDE, LENGTH), cells))

    lines = heading(HEADING) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment(f"Bar: {options.elements} elements from the lower end up, left side first")
    lines += bar.node_lines() + bar.element_lines()
    lines += comment("Surface and sets")
    lines += surface_lines("LOWER_END", "S1", [grid.element[0][0]])
    lines += set_lines("NSET", "ENDS", [grid.node[0][0], grid.node[0][-1]])
    lines += comment("Material, wall, contact, velocity") + MODEL.strip().splitlines()
    lines += comment("The run") + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
