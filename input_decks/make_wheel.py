"""Deck of a wheel: a tyre of solid rubber is put on its rim, loaded, and driven until it slides.

    python3 make_wheel.py --output wheel.inp
"""

from __future__ import annotations

import math

from deckwriter import (Part, Point, add_grid, arguments, cells_argument, comment, heading, number,
                        surface_lines, write_deck)
from scenery import CONTACT_CARDS, contact_parameters

#: Radius of the rim, by how much the hole of the tyre is smaller, outer radius of the tyre [mm].
RIM, INTERFERENCE, OUTER = 100.0, 3.0, 150.0
#: Modulus of the rubber [MPa], its Poisson's ratio.
MODULUS, POISSON = 6.0, 0.49
#: Gap to the ground, way of the ground [mm], turn of the rim [rad].
GAP, WAY, TURN = 4.0, 9.0, 0.15
#: Coefficients of friction, on the rim and on the ground.
ON_RIM, ON_GROUND = 0.6, 0.4


def shrink_pressure() -> float:
    """Pressure between a rigid rim and a ring of linear elastic material in plane strain (Lame)."""
    a, b = RIM**2, OUTER**2
    return MODULUS*INTERFERENCE/RIM*(b - a)/((1.0 + POISSON)*((1.0 - 2.0*POISSON)*a + b))


HEADING = f"""
A wheel: a tyre of solid rubber on its rim, pressed on the ground and driven, static, plane strain.

The hole of the tyre is {INTERFERENCE:g} mm smaller than the rigid rim of radius {RIM:g} mm: step 1 shrinks it
on. In step 2 the ground comes up by {WAY:g} mm and meets the tyre. In step 3 the rim turns by {TURN:g} rad;
friction takes the tyre along, until it slides on the ground: coefficients {ON_RIM:g} on the rim and
{ON_GROUND:g} on the ground. Rubber: CPE4H, coupled neo-Hooke, E = {MODULUS:g} MPa, nu = {POISSON:g}.
Units: mm, N, MPa; forces per millimetre of width.

What to look at: contact_shear on the rim and on the ground, and how the tyre is wound up. The force along
the ground grows until all of the tread that touches slides, from t = 2.6 on. Above the axle the tyre has
left the rim by then: more interference keeps it there.

Expected: pressure on the rim after step 1 {shrink_pressure():.4f} (Lame, for small strains) within 4 percent;
          at the end the force along the ground is {ON_GROUND:g} times that across it, to round-off.

Made by make_wheel.py. Change a parameter for one run: --set turn=0.05
"""

PARAMETERS = f"""
*PARAMETER
way = {number(WAY)}
turn = {number(-TURN)}
h = 0.1
{contact_parameters("NODE TO SURFACE", "ONE").strip()}
"""

MODEL = f"""
*SURFACE, NAME=GROUND, TYPE=SEGMENTS
START, {number(-2.0*OUTER)}, {number(-OUTER - GAP)}
LINE, {number(2.0*OUTER)}, {number(-OUTER - GAP)}
*NODE
90001, 0., 0.
90002, 0., {number(-1.5*OUTER)}
*RIGID BODY, ELSET=RIM, REF NODE=90001
*RIGID BODY, ANALYTICAL SURFACE=GROUND, REF NODE=90002
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, COUPLED NEO HOOKE
{number(MODULUS)}, {number(POISSON)}
*SOLID SECTION, ELSET=TYRE, MATERIAL=RUBBER
1.
*MATERIAL, NAME=STEEL
*ELASTIC
210000., 0.3
*SOLID SECTION, ELSET=RIM, MATERIAL=STEEL
1.
*SURFACE INTERACTION, NAME=ON_RIM
*FRICTION
{number(ON_RIM)}
*SURFACE INTERACTION, NAME=ON_GROUND
*FRICTION
{number(ON_GROUND)}
*CONTACT PAIR, INTERACTION=ON_RIM, TYPE=<formulation>, SIDES=<sides>
HOLE, SEAT
*CONTACT PAIR, INTERACTION=ON_GROUND, TYPE=<formulation>, SIDES=<sides>
TREAD, GROUND
"""

OUTPUT = """
*NODE FILE, FREQUENCY=2
U, RF
*EL FILE, FREQUENCY=2
S, ENER
*CONTACT FILE, FREQUENCY=2
CDIS, CSTR, CF, CSHEAR
*CONTACT PRINT, TOTALS=ONLY
CF
*END STEP
"""


def step(*cards: str) -> list[str]:
    """A static step with cards of its own."""
    return ["*STEP, NLGEOM", "*STATIC, DIRECT", "<h>, 1.", *CONTACT_CARDS.strip().splitlines(), *cards,
            *OUTPUT.strip().splitlines()]


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--cells", type=cells_argument, default=(96, 5), metavar="96x5",
                        help="elements around and through the tyre")
    options = parser.parse_args()
    n_around, n_through = options.cells

    def place(k: int, j: int) -> Point:
        """On radial line k, j elements inside the tread; the first one points to the ground."""
        angle = 2.0*math.pi*k/n_around - 0.5*math.pi
        r = OUTER - (OUTER - RIM + INTERFERENCE)*j/n_through
        return r*math.cos(angle), r*math.sin(angle)

    def rim_place(k: int, j: int) -> Point:
        angle = 2.0*math.pi*k/n_around
        r = RIM - 0.1*RIM*j
        return r*math.cos(angle), r*math.sin(angle)

    tyre, rim = Part("TYRE"), Part("RIM")
    grid = add_grid(tyre, options.cells, place, closed=True)
    rim_grid = add_grid(rim, (n_around, 1), rim_place, closed=True, first=(len(tyre.node) + 1, len(tyre.element) + 1))
    lines = heading(HEADING) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("The tyre, radial line by radial line from the ground on, each from the tread inwards")
    lines += tyre.node_lines() + [line.replace("TYPE=CPE4,", "TYPE=CPE4H,") for line in tyre.element_lines()]
    lines += comment("The rim, a ring of rigid elements") + rim.node_lines() + rim.element_lines()
    lines += comment("Surfaces") + surface_lines("SEAT", "S1", [column[0] for column in rim_grid.element])
    lines += surface_lines("TREAD", "S1", [column[0] for column in grid.element])
    lines += surface_lines("HOLE", "S3", [column[-1] for column in grid.element])
    lines += comment("Rim, ground, material, contact") + MODEL.strip().splitlines()
    lines += comment("The tyre shrinks onto the rim")
    lines += step("*CONTACT INTERFERENCE, SHRINK", "*BOUNDARY", "90001, 1, 2", "90001, 6", "90002, 1, 2", "90002, 6")
    lines += comment("The ground comes up") + step("*BOUNDARY", "90002, 2, 2, <way>")
    lines += comment("The rim turns") + step("*BOUNDARY", "90001, 6, 6, <turn>")
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
