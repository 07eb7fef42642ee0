"""Deck of a small block pressed into a larger one: static node-to-surface contact.

    python3 make_two_blocks_static.py --output two_blocks_static.inp
"""

from __future__ import annotations

from deckwriter import (Part, add_grid, arguments, box, cells_argument, comment, heading,
                        set_lines, surface_lines, write_deck)

HEADING = """
A small block pressed by a uniform pressure into a larger one, static, no friction.

Small block 2 x 1, large block 4 x 2, both E = 1000, nu = 0.3, compressible neo-Hookean, plane
strain. The meshes do not match; the small, finer block is the slave. The large block is held at
the bottom, the upper edge of the small one moves only vertically.
Units: any consistent set (force F, length L; stress F/L^2, thickness 1 L).

Without contact the small block is free to fall, so a first step closes the contact by a small
prescribed displacement, and the second replaces that by the pressure.

What to look at: the pressure rises towards the edges of the small block; its sum is known.

Expected at the end: sum of contact forces, and reaction at the bottom, 20 (pressure 10 on the
          width 2, which the guided upper edge keeps), to the tolerance of the iteration;
          horizontal reactions sum to 0; the result is symmetric about x = 0.

Made by make_two_blocks_static.py. Change a parameter for one run: --set pressure=20
"""

PARAMETERS = """
*PARAMETER
pressure = 10.
approach = -0.002
method = NULL SPACE
"""

MODEL = """
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, COUPLED NEO HOOKE
1000., 0.3
*SOLID SECTION, ELSET=SMALL, MATERIAL=RUBBER
1.
*SOLID SECTION, ELSET=LARGE, MATERIAL=RUBBER
1.
*SURFACE INTERACTION, NAME=FRICTIONLESS
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=NODE TO SURFACE
SMALL_FOOT, LARGE_TOP
"""

OUTPUT = """
*NODE FILE
U, RF
*EL FILE
S, ENER
*CONTACT FILE
CDIS, CSTR, CF
"""

STEP_CLOSE = f"""
*STEP, NLGEOM
*STATIC
1., 1.
*CONSTRAINT METHOD, TYPE=<method>
*BOUNDARY
BASE, 1, 2
HEAD, 1
HEAD, 2, 2, <approach>
{OUTPUT.strip()}
*END STEP
"""

STEP_PRESS = f"""
*STEP, NLGEOM
*STATIC
0.1, 1.
*CONSTRAINT METHOD, TYPE=<method>
*BOUNDARY, OP=NEW
BASE, 1, 2
HEAD, 1
*DLOAD
HEAD, P3, <pressure>
{OUTPUT.strip()}
*END STEP
"""


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--small", type=cells_argument, default=(14, 7), metavar="14x7",
                        help="elements along and up the small block")
    parser.add_argument("--large", type=cells_argument, default=(20, 10), metavar="20x10",
                        help="elements along and up the large block")
    options = parser.parse_args()

    large, small = Part("LARGE"), Part("SMALL")
    large_grid = add_grid(large, options.large, box((-2.0, -2.0), (4.0, 2.0), options.large))
    small_grid = add_grid(small, options.small, box((-1.0, 0.0), (2.0, 1.0), options.small),
                          first=(len(large.node) + 1, len(large.element) + 1))

    lines = heading(HEADING) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Large block, column by column from the left, each from the bottom up")
    lines += large.node_lines() + large.element_lines()
    lines += comment("Small block, likewise") + small.node_lines() + small.element_lines()
    lines += comment("Sets and surfaces")
    lines += set_lines("NSET", "BASE", [column[0] for column in large_grid.node])
    lines += set_lines("NSET", "HEAD", [column[-1] for column in small_grid.node])
    lines += set_lines("ELSET", "HEAD", [column[-1] for column in small_grid.element])
    lines += surface_lines("SMALL_FOOT", "S1", [column[0] for column in small_grid.element])
    lines += surface_lines("LARGE_TOP", "S3", [column[-1] for column in large_grid.element])
    lines += comment("Materials, contact") + MODEL.strip().splitlines()
    lines += comment("Step 1: close the contact") + STEP_CLOSE.strip().splitlines()
    lines += comment("Step 2: the pressure in place of the displacement")
    lines += STEP_PRESS.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
