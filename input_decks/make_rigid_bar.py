"""Deck of a rigid bar that hits a rigid wall, the metal bar of ANSYS' technology showcase.

    python3 make_rigid_bar.py --output rigid_bar.inp
"""

from __future__ import annotations

from deckwriter import (Part, add_grid, arguments, box, comment, heading, number, surface_lines,
                        write_deck)
from scenery import CONTACT_CARDS, contact_parameters

LENGTH, GAP = 0.0324, 1.0e-3
DENSITY, SPEED, ENERGY = 8930.0, 227.0, 239.61
AREA = 2.0*ENERGY/(DENSITY*LENGTH*SPEED**2)      # of the meshed cylinder of radius 3.2 mm
SIDE = AREA**0.5

HEADING = f"""
Rigid bar on a rigid wall: {SPEED:g} m/s, {ENERGY:g} J.

Source: ANSYS technology showcase, metal bar impact, rigid impact: length {LENGTH:g} m, density
{DENSITY:g} kg/m^3; the area of the square section follows from the energy. Neither body deforms,
so contact alone decides with what velocity the bar comes back.
Units: m, kg, s, N, J.

What to look at: energy and velocity after the impact.

Expected: the bar comes back with {SPEED:g} m/s (RESTITUTION=1), total energy {ENERGY:g} J.

Made by make_rigid_bar.py. Change a parameter for one run: --set restitution=0.5
"""

PARAMETERS = f"""
*PARAMETER
h = 1.0e-6
t_end = 1.0e-5
frame = 1.0e-6
method = NULL SPACE
initiation = PERSISTENT
restitution = 1
{contact_parameters("NODE TO SURFACE", points=3).strip()}
"""

MODEL = f"""
*MATERIAL, NAME=METAL
*DENSITY
{number(DENSITY)}
*SOLID SECTION, ELSET=BAR, MATERIAL=METAL
{number(SIDE)}
*NODE, NSET=CENTRE
9998, 0., {number(GAP + 0.5*LENGTH)}
*RIGID BODY, ELSET=BAR, REF NODE=9998
*SURFACE, TYPE=SEGMENTS, NAME=WALL
START, -0.1, 0.
LINE, 0.1, 0.
*NODE, NSET=HOLD
9999, 0., 0.
*RIGID BODY, ANALYTICAL SURFACE=WALL, REF NODE=9999
*SURFACE INTERACTION, NAME=FRICTIONLESS, RESTITUTION=<restitution>
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=<formulation>, SIDES=<sides>
LOWER_END, WALL
*BOUNDARY
HOLD, 1, 2
HOLD, 6
*INITIAL CONDITIONS, TYPE=VELOCITY
CENTRE, 2, {number(-SPEED)}
*TIME POINTS, NAME=FRAMES, GENERATE
0., <t_end>, <frame>
"""

STEP = f"""
*STEP, NLGEOM, INC=1000000
*DYNAMIC, DIRECT
<h>, <t_end>
*CONSTRAINT METHOD, TYPE=<method>
*CONTACT INITIATION, TYPE=<initiation>
{CONTACT_CARDS.strip()}
*NODE PRINT, NSET=CENTRE
U, V
*NODE FILE, TIME POINTS=FRAMES
U, V
*CONTACT PRINT, TOTALS=ONLY
CF
*END STEP
"""


def main() -> None:
    options = arguments(__doc__).parse_args()
    cells = (1, 4)
    bar = Part("BAR")
    grid = add_grid(bar, cells, box((-0.5*SIDE, GAP), (SIDE, LENGTH), cells))

    lines = heading(HEADING) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Bar, for its mass and its lower end") + bar.node_lines() + bar.element_lines()
    lines += comment("Surface") + surface_lines("LOWER_END", "S1", [grid.element[0][0]])
    lines += comment("Bodies, contact, velocity") + MODEL.strip().splitlines()
    lines += comment("The run") + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
