"""Deck of a casing with a loose battery that falls on a corner, in three dimensions.

    python3 make_dropped_casing.py --output dropped_casing.inp
"""

from __future__ import annotations

import math
from itertools import pairwise, product

from balls import CORNERS
from deckwriter import Part, Point, arguments, comment, heading, number, write_deck

#: Of the casing: outer edges and wall [mm], cells along each edge between the walls.
OUTER, WALL, CELLS = (72.0, 40.0, 16.0), 2.0, (10, 6, 2)
#: Of the battery: edges [mm], cells along each.
BATTERY, BATTERY_CELLS = (66.0, 34.0, 11.0), (8, 4, 2)
#: Turned by so much about x, then about y [degrees]; speed of a fall from 1 m [mm/s]; mu.
TURN, SPEED, FRICTION = (25.0, 35.0), 4429.0, 0.3

HEADING = """
A casing with a loose battery falls on a corner from a height of 1 m, in three dimensions.

The casing, {outer} mm, has walls of {wall} mm, one C3D8I across; E = 2400 MPa, nu = 0.38, 1.1 g/cm3. The
battery, {battery} mm of C3D8, has 1 mm of play to all sides but one; E = 1000 MPa, nu = 0.3, 2.2 g/cm3. The floor,
TYPE=PLANE, is rigid; mu = {friction} everywhere. It arrives at {speed} mm/s, a corner first.
Units: mm, t, s, N, MPa, mJ.

What to look at: the corner is pressed in, and the casing rebounds, turning; the battery hits one wall after
another, and bends the large ones outwards.

Expected: energy plus friction losses constant to 1e-11; the momentum along the floor changes by
          at most {friction} of the change of that normal to the floor.

Made by make_dropped_casing.py. Change a parameter for one run: --set h=1e-5
"""

PARAMETERS = """
*PARAMETER
h = 2e-5
t_end = 3e-3
frame = 5e-5
"""

MODEL = """
*MATERIAL, NAME=POLYMER
*ELASTIC
2400., 0.38
*DENSITY
1.1e-9
*MATERIAL, NAME=CELL
*ELASTIC
1000., 0.3
*DENSITY
2.2e-9
*SOLID SECTION, ELSET=CASING, MATERIAL=POLYMER
*SOLID SECTION, ELSET=BATTERY, MATERIAL=CELL
*SURFACE, NAME=SHELL
CASING,
*SURFACE, NAME=CAN
BATTERY,
*NODE, NSET=FLOOR_NODE
{floor}, 0., 0., 0.
*SURFACE, NAME=FLOOR, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*RIGID BODY, ANALYTICAL SURFACE=FLOOR, REF NODE={floor}
*SURFACE INTERACTION, NAME=RUBS
*FRICTION
{friction}
*CONTACT PAIR, INTERACTION=RUBS
SHELL, FLOOR
CAN, SHELL
*BOUNDARY
{floor}, ENCASTRE
*INITIAL CONDITIONS, TYPE=VELOCITY
CASING, 3, -{speed}
BATTERY, 3, -{speed}
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
*CONTACT FILE, TIME POINTS=FRAMES
CDIS, CSTR, CF
*END STEP
"""


def turned(at: Point) -> Point:
    """By the angles of `TURN`."""
    about_x, about_y = map(math.radians, TURN)
    x, y, z = at
    y, z = math.cos(about_x)*y - math.sin(about_x)*z, math.sin(about_x)*y + math.cos(about_x)*z
    return math.cos(about_y)*x + math.sin(about_y)*z, y, math.cos(about_y)*z - math.sin(about_y)*x


def add_box(part: Part, places: list[list[float]], hollow: bool, first: tuple[int, int]) -> None:
    """Bricks between places along x, y and z: all of them, or the outermost layer."""
    last = [len(along) - 2 for along in places]
    kept = [cell for cell in product(*(range(n + 1) for n in last))
            if not hollow or any(at in (0, n) for at, n in zip(cell, last, strict=True))]
    label: dict[tuple[int, int, int], int] = {}
    for i, j, k in kept:
        nodes = [(i + a, j + b, k + c) for a, b, c in CORNERS]
        for node in nodes:
            label.setdefault(node, first[0] + len(label))
        part.element[first[1] + len(part.element)] = tuple(label[node] for node in nodes)
    for node, number_of in label.items():
        part.node[number_of] = turned(tuple(along[at] for along, at in zip(places, node, strict=True)))


def even(begin: float, end: float, cells: int) -> list[float]:
    """Places from `begin` to `end`."""
    return [begin + (end - begin)*k/cells for k in range(cells + 1)]


def main() -> None:
    options = arguments(__doc__).parse_args()
    casing, battery = Part("CASING"), Part("BATTERY")
    add_box(casing, [[0.0, *even(WALL, size - WALL, cells), size] for size, cells in zip(OUTER, CELLS, strict=True)],
            True, (1, 1))
    # It lies where a hand has shaken it: half of the play on each side, none below.
    begin = [0.5*(out - size) for out, size in zip(OUTER, BATTERY, strict=True)]
    add_box(battery, [even(at, at + size, cells) for at, size, cells
                      in zip(begin, BATTERY, BATTERY_CELLS, strict=True)],
            False, (max(casing.node) + 1, max(casing.element) + 1))
    lowest = min(z for _, _, z in casing.node.values()) - 0.1
    for part in (casing, battery):
        part.node = {k: tuple(round(c, 6) for c in (x, y, z - lowest)) for k, (x, y, z) in part.node.items()}
    lines = heading(HEADING.format(
        outer=" x ".join(map("{:g}".format, OUTER)), wall=f"{WALL:g}", friction=FRICTION, speed=number(SPEED),
        battery=" x ".join(map("{:g}".format, BATTERY)))) + ["**"]
    lines += PARAMETERS.strip().splitlines()
    for part in (casing, battery):
        lines += part.node_lines() + [line.replace("TYPE=C3D8,", "TYPE=C3D8I,") if part is casing else line
                                      for line in part.element_lines()]
    lines += comment("Materials, floor, contact")
    lines += MODEL.strip().format(floor=max(battery.node) + 1, friction=FRICTION,
                                  speed=number(SPEED)).splitlines()
    lines += comment("The run") + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
