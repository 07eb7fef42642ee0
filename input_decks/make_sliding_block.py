"""Deck of a block that slides to rest: Coulomb friction, and the damping that goes with it.

    python3 make_sliding_block.py --output sliding_block.inp
"""

from __future__ import annotations

from deckwriter import (Part, add_grid, arguments, box, comment, heading, set_lines, surface_lines,
                        write_deck)

HEADING = """
An elastic block, thrown along a floor, slides to rest by Coulomb friction.

Block 2 x 1, E = 2e4, nu = 0.3, density 1, velocity 2, under gravity 10; the coefficient of
friction is 0.3, the floor is held. Kelvin-Voigt damping (BETA) keeps the block from fluttering by
itself, which an undamped elastic body does under Coulomb's law.
Units: any consistent set (length L, mass M, time T; stress M/(L T^2), thickness 1 L).

What to look at: the distance that the block slides; friction_loss beside kinetic in the history;
contact_status, 2 while a node slides and 1 once it sticks.

Expected: distance v^2/(2 mu g) = 0.666667, at rest after v/(mu g) = 0.666667; at the end friction has
          dissipated the kinetic energy of the start, 4, except for what damping did with the vibration.
          total + damping_loss + friction_loss is constant.

Made by make_sliding_block.py. Change a parameter for one run: --set mu=0.6
"""

PARAMETERS = """
*PARAMETER
h = 0.01
t_end = 0.8
frame = 0.02
mu = 0.3
beta = 0.002
method = NULL SPACE
"""

MODEL = """
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, COUPLED NEO HOOKE
20000., 0.3
*DENSITY
1.
*DAMPING, BETA=<beta>
*SOLID SECTION, ELSET=BLOCK, MATERIAL=RUBBER
1.
*SOLID SECTION, ELSET=FLOOR, MATERIAL=RUBBER
1.
*SURFACE INTERACTION, NAME=ROUGH
*FRICTION
<mu>
*CONTACT PAIR, INTERACTION=ROUGH, TYPE=NODE TO SURFACE, SIDES=ONE
FOOT, GROUND
*BOUNDARY
FLOOR, 1, 2
*INITIAL CONDITIONS, TYPE=VELOCITY
BLOCK, 1, 2.
*TIME POINTS, NAME=FRAMES, GENERATE
0., <t_end>, <frame>
"""

STEP = """
*STEP, NLGEOM, INC=1000000
*DYNAMIC, DIRECT
<h>, <t_end>
*DLOAD
BLOCK, GRAV, 10., 0., -1.
*CONSTRAINT METHOD, TYPE=<method>
*NODE FILE, TIME POINTS=FRAMES
U, V
*EL FILE, TIME POINTS=FRAMES
S, ENER
*CONTACT FILE, TIME POINTS=FRAMES
CDIS, CSTR, CF, CSHEAR, CSLIP
*CONTACT PRINT, TOTALS=ONLY
CF
*END STEP
"""


def main() -> None:
    options = arguments(__doc__).parse_args()
    block, floor = Part("BLOCK"), Part("FLOOR")
    block_grid = add_grid(block, (8, 4), box((0.0, 0.0), (2.0, 1.0), (8, 4)))
    floor_grid = add_grid(floor, (8, 1), box((-1.0, -0.5), (4.0, 0.5), (8, 1)),
                          first=(len(block.node) + 1, len(block.element) + 1))

    lines = heading(HEADING) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Block, column by column from the left, each from the bottom up")
    lines += block.node_lines() + block.element_lines()
    lines += comment("Floor, likewise") + floor.node_lines() + floor.element_lines()
    lines += comment("Surfaces")
    lines += surface_lines("FOOT", "S1", [column[0] for column in block_grid.element])
    lines += surface_lines("GROUND", "S3", [column[-1] for column in floor_grid.element])
    lines += set_lines("NSET", "MIDDLE", [block_grid.node[4][2]])
    lines += comment("Materials, friction, velocity") + MODEL.strip().splitlines()
    lines += comment("The run") + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
