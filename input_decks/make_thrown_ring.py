"""Deck of an elastic ring that is thrown on a peg, in three dimensions.

    python3 make_thrown_ring.py --output thrown_ring.inp
"""

from __future__ import annotations

import math

from balls import OUTER_FACE
from deckwriter import Part, Point, arguments, comment, heading, set_lines, write_deck
from make_caught_ring import add_ring

#: Radius of the peg, whose top is a half ball at z = 0, and of the floor's top.
PEG, FLOOR = 0.35, -1.6
#: Where the middle of the ring starts, and how far it leans [degrees].
START, LEAN = (0.25, 0.1, 0.75), 20.0

HEADING = """
A ring is thrown on a peg, slides down along it and bounces off the floor; three dimensions, no friction.

The ring of C3D8, middle line of radius 1, tube of radius 0.22, E = 400, nu = 0.3, density 1, starts
leaning by 20 degrees and 0.27 beside the axis of a peg of radius 0.35 with a round top, with the
velocity (0.3, 0, -1), under gravity 1. The peg, TYPE=REVOLUTION, and the floor, TYPE=PLANE, are fixed.
Units: any consistent set (length L, mass M, time T; stress M/(L T^2)).

What to look at: where the ring meets the top of the peg it turns over and slides down the peg.

Expected: the total energy constant to 1e-11; the angular momentum about the axis of the peg, too,
          as no force has a moment about it.

Made by make_thrown_ring.py. Change a parameter for one run: --set h=0.01
"""

PARAMETERS = """
*PARAMETER
h = 0.02
t_end = 5
frame = 0.1
"""

MODEL = """
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, COUPLED NEO HOOKE
400., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=RING, MATERIAL=RUBBER
*SURFACE, NAME=SKIN
OUTER, {face}
*NODE
{pilot}, 0., 0., {floor}
*SURFACE, NAME=PEG, TYPE=REVOLUTION
0., 0., -{peg}, 0., 0., 1.
START, 0., {peg}
CIRCL, {peg}, 0., 0., 0.
LINE, {peg}, {floor}
*SURFACE, NAME=FLOOR, TYPE=PLANE
0., 0., {floor}, 0., 0., 1.
*RIGID BODY, ANALYTICAL SURFACE=PEG, REF NODE={pilot}
*NODE
{second}, 0., 0., {floor}
*RIGID BODY, ANALYTICAL SURFACE=FLOOR, REF NODE={second}
*SURFACE INTERACTION, NAME=SMOOTH
*CONTACT PAIR, INTERACTION=SMOOTH
SKIN, PEG
SKIN, FLOOR
*BOUNDARY
{pilot}, ENCASTRE
{second}, ENCASTRE
*INITIAL CONDITIONS, TYPE=VELOCITY
RING, 1, 0.3
RING, 3, -1.
*TIME POINTS, NAME=FRAMES, GENERATE
0., <t_end>, <frame>
"""

STEP = """
*STEP, NLGEOM, INC=1000000
*DYNAMIC, DIRECT
<h>, <t_end>
*DLOAD
RING, GRAV, 1., 0., 0., -1.
*NODE FILE, TIME POINTS=FRAMES
U, V
*EL FILE, TIME POINTS=FRAMES
S, ENER
*CONTACT FILE, TIME POINTS=FRAMES
CDIS, CSTR, CF
*END STEP
"""


def place(x: Point) -> Point:
    """The ring lies flat, is turned about y, and moved to its start."""
    c, s = math.cos(math.radians(LEAN)), math.sin(math.radians(LEAN))
    return (START[0] + c*x[0] + s*x[2], START[1] + x[1], START[2] - s*x[0] + c*x[2])


def main() -> None:
    options = arguments(__doc__).parse_args()
    ring = Part("RING")
    skin = add_ring(ring, place, (1, 1))
    pilot = max(ring.node) + 1

    lines = heading(HEADING) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("The ring") + ring.node_lines() + ring.element_lines()
    lines += set_lines("ELSET", "OUTER", skin)
    lines += comment("Material, peg, floor, contact") + MODEL.strip().format(
        face=OUTER_FACE, pilot=pilot, second=pilot + 1, peg=PEG, floor=FLOOR).splitlines()
    lines += comment("The run") + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
