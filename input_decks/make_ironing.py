"""Deck of ironing: a die is pressed into a block and drawn along it, without friction.

    python3 make_ironing.py --output ironing.inp
    python3 make_ironing.py --block 96x12 --die 24x6 --output ironing_fine.inp
"""

from __future__ import annotations

import math

from deckwriter import (Part, Point, add_grid, arguments, box, cells_argument, comment, heading,
                        set_lines, surface_lines, write_deck)
from scenery import CONTACT_CARDS, contact_parameters

RADIUS, HALF_ANGLE, THICK = 2.0, math.pi/3.0, 1.5     # of the die
LONG, HIGH = 20.0, 4.0         # of the block
BLOCK_CORNER, BLOCK_SIZE = (-4.0, -HIGH), (LONG, HIGH)
DEPTH, PATH = 1.0, 11.0

HEADING = f"""
Ironing: a curved die is pressed {DEPTH:g} into a block and drawn {PATH:g} along it, no friction.

After the usual test of sliding contact, static, without friction. Block {LONG:g} x {HIGH:g},
E = 68.96e7; die of radius {RADIUS:g} over 120 degrees, {THICK:g} thick, E = 68.96e8;
nu = 0.32, compressible neo-Hookean, plane strain. The block is held below, the back of the die
is guided: down by {DEPTH:g} in the time 0 to 1, right by {PATH:g} from 1 to {PATH + 1:g}.
The die is the slave.
Units: any consistent set (force F, length L; stress F/L^2, thickness 1 L).

What to look at: the reaction of the die while it is drawn, 1 < t < {PATH + 1:g}. Nothing changes
along the path but the position of the die between the nodes of the block (and the distance to
its ends): each ripple is the mesh, one period per element of the block, which is
{LONG:g}/CELLS long.
The horizontal reaction consists of this ripple only.

EXPECTED

Made by make_ironing.py. Change a parameter for one run: --set formulation="NODE TO SURFACE"
"""

EXPECTED = """
Expected: vertical reaction 7.45e8 at t = 1 and 7.6e8 on the mean over 4 < t < 9, both within
          1 percent over the formulations. Ripple over 4 < t < 9, peak to peak without the
          parabola through it, as a fraction of the mean vertical reaction:
                                          vertical  horizontal
          MORTAR, DUAL                     0.0062     0.0121
          MORTAR, STANDARD                 0.0025     0.0110
          MORTAR, DUAL, HERMITE            0.0049     0.0033
          MORTAR, STANDARD, HERMITE        0.0052     0.0060
          NODE TO SURFACE, HERMITE         0.0052     0.0014
          NODE TO SURFACE, roles swapped   0.0029     0.0171
          Roles are swapped by --set slave=BLOCK_TOP --set master=DIE_FACE. With the die as the
          slave NODE TO SURFACE must cut increments, as nodes fall into the dents between
          elements of the block: 16 times with the nodes of both sides held, 20 with SIDES=ONE.
Overlap: 0.01 of an edge at most, because mortar closes gaps in the mean; bad from 0.02 on.
          With NODE TO SURFACE there is none.
"""

PARAMETERS = f"""
*PARAMETER
h_press = 0.05
h = 0.05
path = {PATH:g}
depth = {DEPTH:g}
slave = DIE_FACE
master = BLOCK_TOP
method = NULL SPACE
{contact_parameters().strip()}
"""

MATERIAL = """
*MATERIAL, NAME=SOFT
*HYPERELASTIC, COUPLED NEO HOOKE
68.96e7, 0.32
*MATERIAL, NAME=HARD
*HYPERELASTIC, COUPLED NEO HOOKE
68.96e8, 0.32
*SOLID SECTION, ELSET=BLOCK, MATERIAL=SOFT
1.
*SOLID SECTION, ELSET=DIE, MATERIAL=HARD
1.
*SURFACE INTERACTION, NAME=FRICTIONLESS
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=<formulation>, SIDES=<sides>
<slave>, <master>
*BOUNDARY
BASE, 1, 2
HEAD, 1, 2
"""

STEP_PRESS = f"""
*STEP, NLGEOM, INC=1000000
*STATIC, DIRECT
<h_press>, 1.
*CONSTRAINT METHOD, TYPE=<method>
{CONTACT_CARDS.strip()}
*BOUNDARY
HEAD, 2, 2, -<depth>
*NODE FILE, FREQUENCY=5
U, RF
*EL FILE, FREQUENCY=5
S, ENER
*CONTACT FILE, FREQUENCY=5
CDIS, CSTR, CF
*NODE PRINT, NSET=HEAD, TOTALS=ONLY
RF
*CONTACT PRINT, TOTALS=ONLY
CF
*END STEP
"""

STEP_DRAW = """
*STEP, NLGEOM, INC=1000000
*STATIC, DIRECT
<h>, <path>
*BOUNDARY
HEAD, 1, 1, <path>
*END STEP
"""


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--block", type=cells_argument, default=(64, 8), metavar="64x8",
                        help="elements along and up the block")
    parser.add_argument("--die", type=cells_argument, default=(18, 4), metavar="18x4",
                        help="elements along the face of the die and up")
    options = parser.parse_args()

    def die_place(i: int, j: int) -> Point:
        angle = HALF_ANGLE*(2.0*i/options.die[0] - 1.0)
        y = 2.0*RADIUS*math.sin(0.5*angle)**2
        return RADIUS*math.sin(angle), y + (THICK - y)*j/options.die[1]

    block, die = Part("BLOCK"), Part("DIE")
    block_grid = add_grid(block, options.block, box(BLOCK_CORNER, BLOCK_SIZE, options.block))
    die_grid = add_grid(die, options.die, die_place,
                        first=(len(block.node) + 1, len(block.element) + 1))

    text = HEADING.replace("CELLS", str(options.block[0])).replace("EXPECTED\n", EXPECTED.lstrip())
    lines = heading(text) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Block, column by column from the left, each from the bottom up")
    lines += block.node_lines() + block.element_lines()
    lines += comment("Die, likewise") + die.node_lines() + die.element_lines()
    lines += comment("Sets and surfaces")
    lines += set_lines("NSET", "BASE", [column[0] for column in block_grid.node])
    lines += set_lines("NSET", "HEAD", [column[-1] for column in die_grid.node])
    lines += surface_lines("BLOCK_TOP", "S3", [column[-1] for column in block_grid.element])
    lines += surface_lines("DIE_FACE", "S1", [column[0] for column in die_grid.element])
    lines += comment("Materials, contact, supports") + MATERIAL.strip().splitlines()
    lines += comment("Step 1: press") + STEP_PRESS.strip().splitlines()
    lines += comment("Step 2: draw") + STEP_DRAW.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
