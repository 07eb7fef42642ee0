"""Deck of a row of rigid dominoes on a curve, in three dimensions.

    python3 make_dominoes.py --output dominoes.inp
"""

from __future__ import annotations

import math

from balls import CORNERS
from deckwriter import Part, arguments, heading, number, write_deck

COUNT, PITCH, RADIUS = 10, 0.5, 4.0
THICK, WIDE, HIGH = 0.2, 0.5, 1.0
#: Reference nodes of the dominoes count from here, that of the floor is the first.
REFERENCE = 9000

HEADING = """
Ten rigid dominoes fall over one after the other, and come to rest on each other.

Dominoes of 0.2 x 0.5 x 1 and density 1 stand 0.5 apart on a curve of radius 4, under gravity 10; the
first one is pushed over: it turns at 2 about its lower edge. Coulomb friction of 0.3 between all of
them and with the floor, restitution 0.5. Contact of nodes, sharp edges and faces, both sides.
Units: any consistent set (length L, mass M, time T; stress M/(L T^2)).

What to look at: how the push runs along the curve, and how the last one brings all others to rest.

Expected: all lie still at the end, kinetic energy below 1e-15 of the largest; friction dissipates energy
in each increment; total energy plus losses of friction and impacts constant to 1e-11.

Made by make_dominoes.py. Change a parameter for one run: --set t_end=1
"""

PARAMETERS = """
*PARAMETER
h = 0.01
t_end = 5
frame = 0.02
mu = 0.3
rest = 0.5
"""

MODEL = """
*MATERIAL, NAME=WOOD
*ELASTIC
1e4, 0.3
*DENSITY
1.
"""

STEP = """
*TIME POINTS, NAME=FRAMES, GENERATE
0., <t_end>, <frame>
*STEP, NLGEOM, INC=1000000
*DYNAMIC, DIRECT
<h>, <t_end>
*DLOAD
{loads}
*NEWTON, TOLERANCE=1e-12
*NODE FILE, TIME POINTS=FRAMES
U, V
*END STEP
"""


def turn(k: int) -> float:
    """Of domino `k`, from x towards y."""
    return (k - 0.5*(COUNT - 1))*PITCH/RADIUS


def place(k: int, along: float, across: float, up: float) -> tuple[float, float, float]:
    """From the middle of the foot of domino `k`."""
    c, s = math.cos(turn(k)), math.sin(turn(k))
    return RADIUS*s + c*along - s*across, RADIUS*(1.0 - c) + s*along + c*across, up


def domino(k: int) -> Part:
    part = Part(f"D{k + 1}")
    label = {}
    for i in (0, 1):
        for j in (0, 1):
            for n in (0, 1):
                label[i, j, n] = 8*k + 1 + len(label)
                part.node[label[i, j, n]] = place(k, THICK*(i - 0.5), WIDE*(j - 0.5), HIGH*n)
    part.element[k + 1] = tuple(label[corner] for corner in CORNERS)
    return part


def body(k: int) -> list[str]:
    """A section, a surface, and a rigid body about its middle."""
    name, middle = f"D{k + 1}", ", ".join(map(number, place(k, 0.0, 0.0, 0.5*HIGH)))
    return [f"*SOLID SECTION, ELSET={name}, MATERIAL=WOOD", f"*SURFACE, NAME=S{k + 1}", f"{name},",
            "*NODE", f"{REFERENCE + k + 1}, {middle}",
            f"*RIGID BODY, ELSET={name}, REF NODE={REFERENCE + k + 1}"]


def push(spin: float) -> list[str]:
    """The first one turns about its lower edge in front."""
    c, s = math.cos(turn(0)), math.sin(turn(0))
    ahead, down = 0.5*HIGH*spin, -0.5*THICK*spin
    values = [c*ahead, s*ahead, -down, -s*spin, c*spin]
    return ["*INITIAL CONDITIONS, TYPE=VELOCITY",
            *(f"{REFERENCE + 1}, {a}, {number(v)}" for a, v in enumerate(values, 1))]


def main() -> None:
    options = arguments(__doc__).parse_args()
    lines = heading(HEADING) + ["**"] + PARAMETERS.strip().splitlines()
    for k in range(COUNT):
        lines += domino(k).node_lines() + domino(k).element_lines()
    lines += MODEL.strip().splitlines()
    for k in range(COUNT):
        lines += body(k)
    lines += push(2.0)
    lines += ["*NODE", f"{REFERENCE}, 0., 0., -1.", "*SURFACE, NAME=FLOOR, TYPE=PLANE", "0., 0., 0., 0., 0., 1.",
              f"*RIGID BODY, ANALYTICAL SURFACE=FLOOR, REF NODE={REFERENCE}", "*BOUNDARY", f"{REFERENCE}, 1, 6",
              "*SURFACE INTERACTION, NAME=ROUGH, RESTITUTION=<rest>", "*FRICTION", "<mu>",
              "*CONTACT PAIR, INTERACTION=ROUGH"]
    lines += [f"S{k + 1}, S{k + 2}" for k in range(COUNT - 1)] + [f"S{k + 1}, FLOOR" for k in range(COUNT)]
    loads = "\n".join(f"D{k + 1}, GRAV, 10., 0., 0., -1." for k in range(COUNT))
    write_deck(lines + STEP.format(loads=loads).strip().splitlines(), options.output)


if __name__ == "__main__":
    main()
