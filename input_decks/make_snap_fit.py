"""Deck of an elastic hook that is pushed over a catch and snaps in, in three dimensions.

    python3 make_snap_fit.py --output snap_fit.inp
"""

from __future__ import annotations

import math
from itertools import product

from balls import CORNERS
from deckwriter import Part, arguments, comment, heading, number, set_lines, write_deck

#: Of the arm: length up to the rear face of the nose, thickness, width, and cells along each.
LENGTH, THICK, WIDTH = 0.85, 0.1, 0.25
ALONG, THROUGH, ACROSS = 12, 2, 2
#: Of nose and catch: places along x from the rear face on, and heights there.
NOSE = ((0.0, 0.08), (0.05, 0.08), (0.15, 0.01))
CATCH = ((0.0, 0.06), (0.05, 0.06), (0.15, -0.02))
#: The top of the catch below the arm, its foot, its width, and how far the hook starts from it.
CLEARANCE, FOOT, WIDE, AHEAD = 0.02, 0.2, 0.4, 0.02

HEADING = """
An elastic hook is pushed over a catch, snaps in, and cannot be pulled out, in three dimensions.

The arm is {length} long up to its nose, {thick} thick and {width} wide, of C3D8I; E = 10000, nu = 0.3, density 1,
damped. Its left end is guided along x: by {push} to the right until 3, back by 0.04 from 4 to 6. The
catch is clamped at its foot; no friction.
Units: any consistent set (length L, mass M, time T; stress M/(L T^2)).

What to look at: the arm bends by {lift} over the catch, vibrates on it, springs back behind it, and bears
with all of the rear face of its nose when it is pulled back.

Expected: the force along x that pushes it in, at most {force} by beam theory where it is pushed slowly, and a
          tenth more at this speed; the hook stays behind the catch.

Made by make_snap_fit.py. Change a parameter for one run: --set h=0.01
"""

PARAMETERS = """
*PARAMETER
h = 0.02
t_end = 6
frame = 0.05
"""

MODEL = """
*MATERIAL, NAME=POLYMER
*ELASTIC
10000., 0.3
*DAMPING, ALPHA=5., BETA=0.002
*DENSITY
1.
*SOLID SECTION, ELSET=HOOK, MATERIAL=POLYMER
*SOLID SECTION, ELSET=CATCH, MATERIAL=POLYMER
*SURFACE, NAME=SKIN
HOOK,
*SURFACE, NAME=LATCH
CATCH,
*SURFACE INTERACTION, NAME=SMOOTH
*CONTACT PAIR, INTERACTION=SMOOTH
SKIN, LATCH
*AMPLITUDE, NAME=PUSH
{way}
*BOUNDARY
FOOT, 1, 3
END, 2, 3
*TIME POINTS, NAME=FRAMES, GENERATE
0., <t_end>, <frame>
"""

STEP = """
*STEP, NLGEOM, INC=1000000
*DYNAMIC, DIRECT
<h>, <t_end>
*BOUNDARY, AMPLITUDE=PUSH
END, 1, 1, 1.
*NODE FILE, TIME POINTS=FRAMES
U, V, RF
*EL FILE, TIME POINTS=FRAMES
S, ENER
*CONTACT FILE, TIME POINTS=FRAMES
CDIS, CSTR, CF
*END STEP
"""


def smooth(begin: float, end: float, first: float, last: float) -> list[tuple[float, float]]:
    """Times and places of a way that begins and ends slowly, as a polyline."""
    turns = [math.pi*k/24 for k in range(25)]
    return [(begin + (end - begin)*turn/math.pi, first + (last - first)*0.5*(1.0 - math.cos(turn))) for turn in turns]


def push_force(lift: float) -> float:
    """Along x, of an arm that is clamped on the left and whose nose has its lowest edge on the catch."""
    bending = 1e4*WIDTH*THICK**3/12
    arm, eccentric = LENGTH + NOSE[1][0], 0.5*THICK + NOSE[1][1]
    slope = (NOSE[1][1] - NOSE[2][1])/(NOSE[2][0] - NOSE[1][0])
    up = 0.0
    for _ in range(20):
        along = slope*up
        turn = (0.5*up*arm**2 - along*eccentric*arm)/bending
        slope = math.tan(math.atan((NOSE[1][1] - NOSE[2][1])/(NOSE[2][0] - NOSE[1][0])) + turn)
        up = lift/(arm**3/3 - 0.5*slope*eccentric*arm**2)*bending
    return slope*up


def add_columns(part: Part, columns: list[tuple[float, list[float]]], width: float, across: int,
                first: tuple[int, int]) -> None:
    """Bricks between columns of nodes, each a place along x and heights, across the width."""
    label: dict[tuple[int, int, int], int] = {}
    for i, (x, heights) in enumerate(columns):
        for j, k in product(range(across + 1), range(len(heights))):
            place = (x, width*(j/across - 0.5), heights[k])
            label[i, j, k] = next((n for n, at in part.node.items() if at == place), first[0] + len(part.node))
            part.node[label[i, j, k]] = place
    for i, j in product(range(len(columns) - 1), range(across)):
        for k in range(len(columns[i][1]) - 1):
            part.element[first[1] + len(part.element)] = tuple(label[i + a, j + b, k + c] for a, b, c in CORNERS)


def hook(first: tuple[int, int]) -> Part:
    """The arm above z = 0, and the nose below its end."""
    part = Part("HOOK")
    up = [THICK*k/THROUGH for k in range(THROUGH + 1)]
    places = [LENGTH*i/ALONG for i in range(ALONG + 1)] + [LENGTH + x for x, _ in NOSE[1:]]
    add_columns(part, [(x, up) for x in places], WIDTH, ACROSS, first)
    add_columns(part, [(LENGTH + x, [-depth, 0.0]) for x, depth in NOSE], WIDTH, ACROSS, first)
    return part


def catch(first: tuple[int, int]) -> Part:
    """A block whose top rises from the side of the hook on, and falls off behind."""
    part = Part("CATCH")
    foot = -CLEARANCE - CATCH[0][1] - FOOT
    begin = LENGTH + NOSE[-1][0] + AHEAD
    columns = [(begin + CATCH[-1][0] - x, [foot, foot + 0.5*FOOT, foot + FOOT + height])
               for x, height in reversed(CATCH)]
    add_columns(part, columns, WIDE, 3, first)
    return part


def main() -> None:
    options = arguments(__doc__).parse_args()
    parts = [hook((1, 1))]
    parts.append(catch((max(parts[0].node) + 1, max(parts[0].element) + 1)))
    foot = min(z for _, _, z in parts[1].node.values())
    lift = NOSE[0][1] - CLEARANCE
    push = AHEAD + NOSE[-1][0] + CATCH[-1][0] + 0.02
    pull = push - 0.04
    lines = heading(HEADING.format(length=LENGTH, thick=THICK, width=WIDTH, push=number(round(push, 6)),
                                   lift=number(lift), force=f"{push_force(lift):.2g}")) + ["**"]
    lines += PARAMETERS.strip().splitlines()
    for part in parts:
        lines += part.node_lines() + part.element_lines()
    lines += set_lines("NSET", "END", [k for k, at in parts[0].node.items() if at[0] == 0.0])
    lines += set_lines("NSET", "FOOT", [k for k, at in parts[1].node.items() if at[2] == foot])
    lines += comment("Material, contact, motion")
    way = smooth(0.0, 3.0, 0.0, push) + smooth(4.0, 6.0, push, pull)
    lines += MODEL.strip().format(way="\n".join(
        f"{number(round(t, 6))}, {number(round(u, 6))}" for t, u in way)).splitlines()
    lines += comment("The run") + STEP.strip().splitlines()
    write_deck([line.replace("TYPE=C3D8,", "TYPE=C3D8I,") for line in lines], options.output)


if __name__ == "__main__":
    main()
