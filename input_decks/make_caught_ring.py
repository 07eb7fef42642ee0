"""Deck of an elastic ring that falls and is caught by a linked one, in three dimensions.

    python3 make_caught_ring.py --output caught_ring.inp
"""

from __future__ import annotations

import math
from collections.abc import Callable

from balls import OUTER_FACE, Bricks
from deckwriter import Part, Point, arguments, comment, heading, set_lines, write_deck

#: Radius of the middle line of a ring and of its tube; cells across the core of the tube, around
#: this, and along the ring.
RADIUS, TUBE = 1.0, 0.22
CORE_CELLS, LAYERS, CELLS = 2, 1, 30
#: Half the width of the core over the radius of the tube.
CORE = 0.5
#: How far the inner sides of the rings are apart at the start.
GAP = 0.1

HEADING = """
A ring falls and is caught by another one, with which it is linked; three dimensions, no friction.

Two rings of C3D8, middle line of radius 1, tube of radius 0.22, E = 400, nu = 0.3, density 1. The
upper one stands in the plane y = 0 and is held at its top; the lower one is in the plane x = 0 and
falls along z with the velocity -1.5 and under gravity 1. Its tube is {gap:g} above the other one.
Units: any consistent set (length L, mass M, time T; stress M/(L T^2)).

What to look at: two tubes that cross touch in one place, bend each other, and part.

Expected: the total energy constant to 1e-12; the scene is its own mirror image in the planes x = 0
          and y = 0, so the lower ring gets no momentum along x and y and none about z: 1e-12.

Made by make_caught_ring.py. Change a parameter for one run: --set h=0.01
"""

PARAMETERS = """
*PARAMETER
h = 0.02
t_end = 1.6
frame = 0.04
"""

MODEL = """
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, COUPLED NEO HOOKE
400., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=UPPER, MATERIAL=RUBBER
*SOLID SECTION, ELSET=LOWER, MATERIAL=RUBBER
*SURFACE, NAME=HANGER, TYPE=ELEMENT
SKIN_1, {face}
*SURFACE, NAME=PENDANT, TYPE=ELEMENT
SKIN_2, {face}
*SURFACE INTERACTION, NAME=SMOOTH
*CONTACT PAIR, INTERACTION=SMOOTH
PENDANT, HANGER
*BOUNDARY
TOP, 1, 3
*INITIAL CONDITIONS, TYPE=VELOCITY
LOWER, 3, -1.5
*TIME POINTS, NAME=FRAMES, GENERATE
0., <t_end>, <frame>
"""

STEP = """
*STEP, NLGEOM, INC=1000000
*DYNAMIC, DIRECT
<h>, <t_end>
*DLOAD
UPPER, GRAV, 1., 0., 0., -1.
LOWER, GRAV, 1., 0., 0., -1.
*NODE FILE, TIME POINTS=FRAMES
U, V
*EL FILE, TIME POINTS=FRAMES
S, ENER
*END STEP
"""


def on_ring(x: float, y: float, turn: float) -> Point:
    """A point of the section, `x` outwards, at a part `turn` of the way along the ring."""
    angle, out = 2.0*math.pi*turn, RADIUS + TUBE*x
    return (out*math.cos(angle), out*math.sin(angle), TUBE*y)


def side(quarter: int) -> Callable[[float, float, float], Point]:
    """The block between a side of the core of the tube and the outside."""
    def where(turn: float, along: float, share: float) -> Point:
        angle = 0.25*math.pi*(2.0*along - 1.0)
        inner = (CORE, CORE*(2.0*along - 1.0))
        x, y = ((1.0 - share)*a + share*b
                for a, b in zip(inner, (math.cos(angle), math.sin(angle))))
        for _ in range(quarter):
            x, y = -y, x
        return on_ring(x, y, turn)
    return where


def add_ring(part: Part, place: Callable[[Point], Point], first: tuple[int, int]) -> list[int]:
    """Add a ring to `part`; returns the elements with a side, OUTER_FACE, on its outside."""
    bricks = Bricks(part, first, place)
    bricks.block((CORE_CELLS, CORE_CELLS, CELLS),
                 lambda a, b, turn: on_ring(CORE*(2.0*a - 1.0), CORE*(2.0*b - 1.0), turn))
    for quarter in range(4):
        bricks.block((CELLS, CORE_CELLS, LAYERS), side(quarter), outer=True)
    return bricks.outer


def main() -> None:
    options = arguments(__doc__).parse_args()
    upper, lower = Part("UPPER"), Part("LOWER")
    skin = [add_ring(upper, lambda x: (x[0], x[2], x[1]), (1, 1))]
    drop = 2.0*(RADIUS - TUBE) - GAP
    skin.append(add_ring(lower, lambda x: (x[2], x[1], x[0] - drop),
                         (max(upper.node) + 1, max(upper.element) + 1)))
    held = (k for k, x in upper.node.items() if x[2] > 0.95*RADIUS)

    lines = heading(HEADING.format(gap=GAP)) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("The rings")
    for part in (upper, lower):
        lines += part.node_lines() + part.element_lines()
    for k, elements in enumerate(skin, start=1):
        lines += set_lines("ELSET", f"SKIN_{k}", elements)
    lines += set_lines("NSET", "TOP", held)
    lines += comment("Material, contact, supports") + MODEL.strip().format(
        face=OUTER_FACE).splitlines()
    lines += comment("The run") + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
