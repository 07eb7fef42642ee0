"""Deck of an elastic ball that bounces obliquely on an elastic plate, in three dimensions.

    python3 make_bouncing_ball.py --output bouncing_ball.inp
"""

from __future__ import annotations

from balls import OUTER_FACE, add_ball
from deckwriter import Part, add_bricks, arguments, comment, heading, number, set_lines, write_deck

RADIUS, GAP = 0.5, 0.04
SIZE, CELLS = (3.0, 2.0, 0.3), (15, 10, 2)
BALL = (4, 3)
VELOCITY = (1.5, 0.3, -2.0)
START = (-0.8, -0.15)

HEADING = """
An elastic ball hits an elastic plate obliquely and bounces off, in three dimensions, no friction.

Ball of radius 0.5 of C3D8, E = 400, nu = 0.3, density 1; plate 3 x 2 x 0.3, E = 2000, nu = 0.3,
density 1, held at its two short sides. The ball starts {gap:g} above it with the velocity (1.5, 0.3, -2).
Units: any consistent set (length L, mass M, time T; stress M/(L T^2)).

What to look at: contact pressure and force on the plate in ParaView; the ball leaves more slowly
than it came, because the plate keeps vibrating.

Expected: total energy constant to 1e-11 of it; there is no friction, so that the momenta of the
          ball along the plate change only where the bent plate is inclined.

Made by make_bouncing_ball.py. Change a parameter for one run: --set h=0.0025
"""

PARAMETERS = """
*PARAMETER
h = 0.005
t_end = 0.5
frame = 0.02
"""

MODEL = """
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, COUPLED NEO HOOKE
400., 0.3
*DENSITY
1.
*MATERIAL, NAME=HARDER
*HYPERELASTIC, COUPLED NEO HOOKE
2000., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=BALL, MATERIAL=RUBBER
*SOLID SECTION, ELSET=PLATE, MATERIAL=HARDER
*SURFACE, NAME=ROUND, TYPE=ELEMENT
RIM, {face}
*SURFACE, NAME=UPPER, TYPE=ELEMENT
TOP, S2
*SURFACE INTERACTION, NAME=SMOOTH
*CONTACT PAIR, INTERACTION=SMOOTH
ROUND, UPPER
*BOUNDARY
SIDES, 1, 3
*INITIAL CONDITIONS, TYPE=VELOCITY
BALL, 1, {vx}
BALL, 2, {vy}
BALL, 3, {vz}
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
    ball, box, plate = Part("BALL"), Part("PLATE"), Part("PLATE")
    rim = add_ball(ball, RADIUS, (*START, RADIUS + GAP), BALL)
    add_bricks(box, CELLS, SIZE)
    node, element = max(ball.node), max(ball.element)
    plate.node = {node + k: (x, y, z - 0.5*SIZE[2]) for k, (x, y, z) in box.node.items()}
    plate.element = {element + k: tuple(node + a for a in nodes)
                     for k, nodes in box.element.items()}
    most = 0.5*SIZE[0]*(1.0 - 1e-9)
    top = [k for k, nodes in plate.element.items() if plate.node[nodes[4]][2] > -0.1*SIZE[2]]

    lines = heading(HEADING.format(gap=GAP)) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Ball and plate")
    for part in (ball, plate):
        lines += part.node_lines() + part.element_lines()
    lines += set_lines("ELSET", "RIM", rim) + set_lines("ELSET", "TOP", top)
    lines += set_lines("NSET", "SIDES", (k for k, x in plate.node.items() if abs(x[0]) > most))
    vx, vy, vz = map(number, VELOCITY)
    lines += comment("Materials, contact, supports") + MODEL.strip().format(
        face=OUTER_FACE, vx=vx, vy=vy, vz=vz).splitlines()
    lines += comment("The run") + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
