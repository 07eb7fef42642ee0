"""Deck of the contact patch test: two blocks with non-matching meshes under uniform pressure.

    python3 make_contact_patch.py --output contact_patch.inp
    python3 make_contact_patch.py --slope 0.3 --lateral EQUAL --output inclined.inp
    python3 make_contact_patch.py --overhang 0.7 --lateral HELD --slave LOWER --output partly.inp
"""

from __future__ import annotations

import argparse
import math

from deckwriter import (Grid, Part, Point, add_grid, arguments, cells_argument, comment, heading,
                        number, set_lines, surface_lines, write_deck)
from scenery import CONTACT_CARDS, contact_parameters

YOUNG, POISSON, PRESSURE = 1000.0, 0.4, 10.0
WIDTH, HEIGHT = 2.0, 1.0       # of each block


def stretches(lateral: str) -> tuple[float, float, float]:
    """Stretch along x and y, and the pressure on the sides, of the uniform state.

    Newton's method for the Cauchy stresses -q and -p of the compressible neo-Hookean law.
    """
    mu = 0.5*YOUNG/(1.0 + POISSON)
    lam = YOUNG*POISSON/((1.0 + POISSON)*(1.0 - 2.0*POISSON))

    def stress(a: float, b: float) -> tuple[float, float]:
        volume = lam*math.log(a*b)
        return (mu*(a*a - 1.0) + volume)/(a*b), (mu*(b*b - 1.0) + volume)/(a*b)

    a, b, q = 1.0, 1.0, PRESSURE if lateral == "EQUAL" else 0.0
    for _ in range(30):
        xx, yy = stress(a, b)
        j_xa, j_xb = 2.0*mu/b + lam/(a*a*b) - xx/a, lam/(a*b*b) - xx/b
        j_ya, j_yb = lam/(a*a*b) - yy/a, 2.0*mu/a + lam/(a*b*b) - yy/b
        r_x, r_y = -q - xx, -PRESSURE - yy
        if lateral == "HELD":
            b += r_y/j_yb
            continue
        det = j_xa*j_yb - j_xb*j_ya
        a, b = a + (r_x*j_yb - j_xb*r_y)/det, b + (j_xa*r_y - r_x*j_ya)/det
    return a, b, -stress(a, b)[0] if lateral == "HELD" else q


def heading_text(options: argparse.Namespace) -> str:
    a, b, q = stretches(options.lateral)
    slave, master = (("upper", "lower") if options.slave == "UPPER" else ("lower", "upper"))
    lower, upper = ("{} x {}".format(*cells) for cells in (options.lower, options.upper))
    shape = "flat"
    if options.slope != 0.0:
        shape = f"flat, inclined by a slope of {options.slope:g}"
    if options.overhang > 0.0:
        shape += (f"; the lower block is longer by {options.overhang:g},\n"
                  f"with the pressure {PRESSURE:g} applied to what is not covered")
    return f"""
Contact patch test: two blocks with non-matching meshes, uniform pressure {PRESSURE:g}, static.

After Taylor and Papadopoulos 1991. Two blocks {WIDTH:g} x {HEIGHT:g}, one upon the other,
E = {YOUNG:g}, nu = {POISSON:g}, compressible neo-Hookean, plane strain; lower {lower}, upper
{upper} elements, the {slave} one is the slave, the {master} one the master.
The interface is {shape}.
Pressure {PRESSURE:g} on the top, {q:.17g} on the sides; rollers below. The pressure follows
the edges, so the exact state is homogeneous and lies in the space of the elements.
Units: any consistent set (force F, length L; stress F/L^2, thickness 1 L).

Without contact the upper block is free to fall, so a first step closes the contact by a small
prescribed displacement, and the second replaces that by the pressure.

What to look at: contact pressure and stress at the end. MORTAR with SEGMENTS transmits the uniform
pressure exactly; NODE TO SURFACE does not, however fine the mesh (except where it matches).

Expected at the end, to round-off: contact pressure {PRESSURE:g} at every covered slave node;
          stress yy = {-PRESSURE:g}, xx = {-q + 0.0:.12g}, xy = 0 everywhere; stretches
          {a:.15g} along x, {b:.15g} along y.

Made by make_contact_patch.py. Change a parameter for one run:
--set formulation="NODE TO SURFACE"
"""


def parameters(lateral: float) -> str:
    return f"""
*PARAMETER
pressure = {number(PRESSURE)}
lateral = {number(lateral)}
approach = -1e-4
method = NULL SPACE
tolerance = 1e-13
{contact_parameters().strip()}
"""


MATERIAL = f"""
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, COUPLED NEO HOOKE
{number(YOUNG)}, {number(POISSON)}
*SOLID SECTION, ELSET=LOWER, MATERIAL=RUBBER
1.
*SOLID SECTION, ELSET=UPPER, MATERIAL=RUBBER
1.
*SURFACE INTERACTION, NAME=FRICTIONLESS
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=<formulation>, SIDES=<sides>
"""

SETTINGS = f"""
*CONSTRAINT METHOD, TYPE=<method>
*NEWTON, TOLERANCE=<tolerance>
{CONTACT_CARDS.strip()}
"""

OUTPUT = """
*NODE FILE
U, RF
*EL FILE
S, ENER
*CONTACT FILE
CDIS, CSTR, CF
*END STEP
"""

STEP_CLOSE = f"""
*STEP, NLGEOM
*STATIC
1., 1.
{SETTINGS.strip()}
*BOUNDARY
BASE, 2
LOWER_CORNER, 1
UPPER_CORNER, 1
HEAD, 2, 2, <approach>
{OUTPUT.strip()}
"""

STEP_PRESS = f"""
*STEP, NLGEOM
*STATIC
0.25, 1.
{SETTINGS.strip()}
*BOUNDARY, OP=NEW
BASE, 2
LOWER_CORNER, 1
UPPER_CORNER, 1
*DLOAD
HEAD, P3, <pressure>
LEFT_SIDES, P4, <lateral>
RIGHT_SIDES, P2, <lateral>
"""


def uncovered_lines(grid: Grid, length: float) -> list[str]:
    """The pressure on what is not covered of the top of the lower block.

    Whole edges by pressure. The edge in which the upper block ends bears the nodal forces of the
    pressure on its uncovered part; nothing moves along x, so these are constant.
    """
    n = len(grid.element)
    size = length/n
    lines, forces = [], []
    for k, column in enumerate(grid.element):
        share = (WIDTH - k*size)/size          # covered part of the edge, from its left end
        if share < 1e-12:
            lines.append(f"{column[-1]}, P3, <pressure>")
        elif share < 1.0 - 1e-12:
            rest, right = (1.0 - share)*size, 0.5*(1.0 + share)
            forces = ["*CLOAD",
                      f"{grid.node[k][-1]}, 2, {number(-PRESSURE*rest*(1.0 - right))}",
                      f"{grid.node[k + 1][-1]}, 2, {number(-PRESSURE*rest*right)}"]
    return lines + forces


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--lower", type=cells_argument, default=(4, 2), metavar="4x2",
                        help="elements along and up the lower block")
    parser.add_argument("--upper", type=cells_argument, default=(7, 3), metavar="7x3",
                        help="elements along and up the upper block")
    parser.add_argument("--slave", choices=("UPPER", "LOWER"), default="UPPER",
                        help="the block that is the slave (default UPPER)")
    parser.add_argument("--slope", type=float, default=0.0, metavar="S",
                        help="rise of the interface along x (default 0); needs --lateral EQUAL")
    parser.add_argument("--overhang", type=float, default=0.0, metavar="D",
                        help="how much longer the lower block is; needs --lateral HELD")
    parser.add_argument("--lateral", choices=("FREE", "EQUAL", "HELD"), default="FREE",
                        help="sides without load, under the same pressure, or under the one that "
                             "keeps the width")
    options = parser.parse_args()
    if options.slope != 0.0 and options.lateral != "EQUAL":
        parser.error("--slope: the interface bears no shear; needs --lateral EQUAL")
    if options.overhang != 0.0 and options.lateral != "HELD":
        parser.error("--overhang: needs --lateral HELD")
    if abs(options.slope) > 0.5*HEIGHT or options.overhang < 0.0:
        parser.error("--slope is at most 0.5, --overhang at least 0")

    length = WIDTH + options.overhang
    lower_part, upper_part = Part("LOWER"), Part("UPPER")

    def interface(x: float) -> float:
        return HEIGHT + options.slope*(x - 0.5*WIDTH)

    def lower_place(i: int, j: int) -> Point:
        x = length*i/options.lower[0]
        return x, interface(x)*j/options.lower[1]

    def upper_place(i: int, j: int) -> Point:
        x, share = WIDTH*i/options.upper[0], j/options.upper[1]
        return x, (1.0 - share)*interface(x) + share*2.0*HEIGHT

    lower = add_grid(lower_part, options.lower, lower_place)
    upper = add_grid(upper_part, options.upper, upper_place,
                     first=(len(lower_part.node) + 1, len(lower_part.element) + 1))

    lines = heading(heading_text(options)) + ["**"]
    lines += parameters(stretches(options.lateral)[2]).strip().splitlines()
    lines += comment("Lower block, column by column from the left, each from the bottom up")
    lines += lower_part.node_lines() + lower_part.element_lines()
    lines += comment("Upper block, likewise") + upper_part.node_lines() + upper_part.element_lines()
    lines += comment("Sets and surfaces")
    lines += set_lines("NSET", "BASE", [column[0] for column in lower.node])
    lines += set_lines("NSET", "LOWER_CORNER", [lower.node[0][0]])
    lines += set_lines("NSET", "HEAD", [column[-1] for column in upper.node])
    lines += set_lines("NSET", "UPPER_CORNER", [upper.node[0][-1]])
    lines += set_lines("ELSET", "HEAD", [column[-1] for column in upper.element])
    lines += set_lines("ELSET", "LEFT_SIDES", lower.element[0] + upper.element[0])
    lines += set_lines("ELSET", "RIGHT_SIDES", lower.element[-1] + upper.element[-1])
    lines += surface_lines("UPPER_FOOT", "S1", [column[0] for column in upper.element])
    lines += surface_lines("LOWER_TOP", "S3", [column[-1] for column in lower.element])
    lines += comment("Material, contact") + MATERIAL.strip().splitlines()
    lines += ["UPPER_FOOT, LOWER_TOP" if options.slave == "UPPER" else "LOWER_TOP, UPPER_FOOT"]
    lines += comment("Step 1: close the contact") + STEP_CLOSE.strip().splitlines()
    lines += comment("Step 2: the pressure in place of the displacement")
    lines += STEP_PRESS.strip().splitlines()
    lines += uncovered_lines(lower, length) if options.overhang > 0.0 else []
    lines += OUTPUT.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
