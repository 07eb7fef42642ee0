"""Deck of two elastic balls that slide down a bowl and meet, in three dimensions.

    python3 make_ball_in_bowl.py --output ball_in_bowl.inp
"""

from __future__ import annotations

import math

from balls import OUTER_FACE, add_ball
from deckwriter import Part, arguments, comment, heading, set_lines, write_deck

#: Radii of the bowl and of the balls; how far up the balls start [degrees], and their gap to it.
BOWL, BALL = 2.0, 0.4
START = (60.0, -35.0)
GAP = 0.01
#: Cells of the cube inside a ball, and layers around it.
CELLS = (3, 2)

HEADING = """
Two elastic balls slide down a bowl, meet, and go up again, in three dimensions, no friction.

The bowl is a rigid sphere of radius 2, TYPE=SPHERE with the balls inside, and fixed. Balls of radius
0.4 of C3D8, E = 500, nu = 0.3, density 1, start from rest 60 degrees up on one side and 35 on the
other, and 0.5 aside, 0.01 above the bowl; gravity 1.
Units: any consistent set (length L, mass M, time T; stress M/(L T^2)).

What to look at: without friction the balls slide and do not roll; after the collision they take other paths.

Expected: the total energy constant to 1e-11; the angular momentum about the vertical axis through
          the centre of the bowl 0, as no force has a moment about it, to 1e-11.
Overlap: 0.0082 of an edge at most, where edges of round surfaces cross between nodes; bad from 0.02 on.

Made by make_ball_in_bowl.py. Change a parameter for one run: --set h=0.01
"""

PARAMETERS = """
*PARAMETER
h = 0.02
t_end = 6
frame = 0.1
"""

MODEL = """
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, COUPLED NEO HOOKE
500., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=ONE, MATERIAL=RUBBER
*SOLID SECTION, ELSET=TWO, MATERIAL=RUBBER
*SURFACE, NAME=SKIN_ONE
OUTER_1, {face}
*SURFACE, NAME=SKIN_TWO
OUTER_2, {face}
*NODE
{pilot}, 0., 0., 0.
*SURFACE, NAME=BOWL, TYPE=SPHERE
0., 0., 0., {bowl}, INSIDE
*RIGID BODY, ANALYTICAL SURFACE=BOWL, REF NODE={pilot}
*SURFACE INTERACTION, NAME=SMOOTH
*CONTACT PAIR, INTERACTION=SMOOTH
SKIN_ONE, BOWL
SKIN_TWO, BOWL
SKIN_ONE, SKIN_TWO
*BOUNDARY
{pilot}, ENCASTRE
*TIME POINTS, NAME=FRAMES, GENERATE
0., <t_end>, <frame>
"""

STEP = """
*STEP, NLGEOM, INC=1000000
*DYNAMIC, DIRECT
<h>, <t_end>
*DLOAD
ONE, GRAV, 1., 0., 0., -1.
TWO, GRAV, 1., 0., 0., -1.
*NODE FILE, TIME POINTS=FRAMES
U, V
*EL FILE, TIME POINTS=FRAMES
S, ENER
*CONTACT FILE, TIME POINTS=FRAMES
CDIS, CSTR, CF
*END STEP
"""


def main() -> None:
    options = arguments(__doc__).parse_args()
    parts = [Part("ONE"), Part("TWO")]
    first, skins = (1, 1), []
    for part, degrees, aside in zip(parts, START, (0.5, 0.0)):
        out, angle = BOWL - BALL - GAP, math.radians(degrees)
        arm = math.sqrt(out**2 - aside**2)
        centre = (arm*math.sin(angle), aside, -arm*math.cos(angle))
        skins.append(add_ball(part, BALL, centre, CELLS, first))
        first = (max(part.node) + 1, max(part.element) + 1)

    lines = heading(HEADING) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("The balls")
    for part in parts:
        lines += part.node_lines() + part.element_lines()
    for k, elements in enumerate(skins, start=1):
        lines += set_lines("ELSET", f"OUTER_{k}", elements)
    lines += comment("Material, bowl, contact") + MODEL.strip().format(
        face=OUTER_FACE, pilot=first[0], bowl=BOWL).splitlines()
    lines += comment("The run") + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
