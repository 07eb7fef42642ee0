"""Deck of a block that tumbles about its middle axis in free flight, in three dimensions.

    python3 make_tumbling_block.py --output tumbling_block.inp
"""

from __future__ import annotations

from deckwriter import Part, add_bricks, arguments, comment, heading, number, write_deck

SIZE = (1.0, 0.6, 0.2)
CELLS = (5, 3, 2)
#: About the middle axis, y, and a little about the two others.
SPIN = (0.05, 2.0, 0.0)

HEADING = """
An elastic block in free flight turns about its middle axis, and turns over, again and again.

Block 1 x 0.6 x 0.2 of C3D8, E = 1e3, nu = 0.3, density 1. Rotation about the axis of the middle
moment of inertia is unstable: a spin of 2 about y with 0.05 about x does not stay where it is.
Units: any consistent set (length L, mass M, time T; stress M/(L T^2)).

What to look at: the y axis of the block turns over while the momenta stay: lx, ly, lz and total
in the history; in ParaView the field file shows it flying.

Expected: total energy and all six momenta constant; moments of inertia 0.004, 0.0104 and 0.0136
          (M L^2), so that by Euler's equations the y axis of a rigid block lies across the angular
          momentum at t = 4.077 and 12.231; of the elastic one within 0.3 % of these.

Made by make_tumbling_block.py. Change a parameter for one run: --set h=0.025
"""

PARAMETERS = """
*PARAMETER
h = 0.05
t_end = 20.
frame = 0.2
"""

MODEL = """
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, COUPLED NEO HOOKE
1000., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=BLOCK, MATERIAL=RUBBER
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


def main() -> None:
    options = arguments(__doc__).parse_args()
    block = Part("BLOCK")
    add_bricks(block, CELLS, SIZE)

    lines = heading(HEADING) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Block") + block.node_lines() + block.element_lines()
    lines += comment("Material") + MODEL.strip().splitlines()
    lines += comment("Velocity: the spin times the place")
    lines += ["*INITIAL CONDITIONS, TYPE=VELOCITY"]
    (a, b, c) = SPIN
    for label, (x, y, z) in block.node.items():
        for axis, value in enumerate((b*z - c*y, c*x - a*z, a*y - b*x), start=1):
            if value != 0.0:
                lines.append(f"{label}, {axis}, {number(value)}")
    lines += comment("The run") + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
