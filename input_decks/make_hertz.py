"""Deck of two cylinders pressed together: half-width and pressure of Hertz.

    python3 make_hertz.py --output hertz.inp
    python3 make_hertz.py --level 16 --output hertz_16.inp

The level is the number of elements over the half-width of the contact.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable

from deckwriter import (Grid, Part, Point, add_grid, arguments, comment, heading, number,
                        set_lines, surface_lines, write_deck)
from scenery import CONTACT_CARDS, contact_parameters

RADIUS, YOUNG, POISSON = 8.0, 200.0, 0.3
FORCE = 10.0                   # per length, by a pressure on the flat side
HALF_ANGLE = 0.25*math.pi      # of the arc; beyond it the half disc is cut off by a chord
MODULUS = 0.5*YOUNG/(1.0 - POISSON**2)        # of the pair of bodies
HALF_WIDTH = math.sqrt(4.0*FORCE*0.5*RADIUS/(math.pi*MODULUS))
PEAK = 2.0*FORCE/(math.pi*HALF_WIDTH)
GROWTH = 1.25                  # ratio of neighbouring elements away from the contact
MASTER_RATIO = 1.3             # size of the elements of the lower cylinder to those of the upper

HEADING = f"""
Hertz contact: two elastic cylinders pressed together, static, plane strain, no friction.

Half cylinders of radius {RADIUS:g}, flat sides up and down, E = {YOUNG:g}, nu = {POISSON:g}, linear
elastic; beyond 45 degrees from the contact the arc is cut off by a chord. The lower
flat is held, the upper bears a pressure of {FORCE/(2*RADIUS):g}, a force of {FORCE:g} per length.
The meshes are graded towards the contact: LEVEL elements over the half-width in the
upper cylinder, which is the slave, and 1/{MASTER_RATIO:g} of that in the lower one.
Units: any consistent set (force F, length L; stress F/L^2, thickness 1 L).

Without contact the upper cylinder is free to fall, so a first step closes the contact by a small
prescribed displacement, and the second replaces that by the pressure.

What to look at: the contact pressure over x is half an ellipse.

Expected at the end (Hertz, bodies large against the contact): half-width
          sqrt(4 F R'/(pi E')) = {HALF_WIDTH:.6f}, peak pressure 2 F/(pi a) = {PEAK:.6f},
          with R' = {RADIUS/2:g} and E' = {MODULUS:.6g}; these bodies are finite, which no
          refinement removes.
          Sum of the contact forces {FORCE:g}.
          With 6 elements over the half-width: peak within 0.2 percent, half-width (from the
          second moment of the force, a^2/4) within 0.4 percent. That is
          per length of the reference mesh, as linear theory has it: per deformed length,
          as the result file has it, the pressure is larger by the strain of 2 percent.
Overlap: 0.0034 of an edge at most, because mortar closes gaps in the mean; bad from 0.02 on.
          With NODE TO SURFACE there is none.

Made by make_hertz.py. Change a parameter for one run: --set formulation="NODE TO SURFACE"
"""

PARAMETERS = f"""
*PARAMETER
pressure = {number(FORCE/(2.0*RADIUS))}
approach = -0.02
method = NULL SPACE
{contact_parameters().strip()}
"""

MATERIAL = f"""
*MATERIAL, NAME=LINEAR
*ELASTIC
{number(YOUNG)}, {number(POISSON)}
*SOLID SECTION, ELSET=LOWER, MATERIAL=LINEAR
1.
*SOLID SECTION, ELSET=UPPER, MATERIAL=LINEAR
1.
*SURFACE INTERACTION, NAME=FRICTIONLESS
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=<formulation>, SIDES=<sides>
UPPER_ARC, LOWER_ARC
"""

SETTINGS = f"""
*CONSTRAINT METHOD, TYPE=<method>
{CONTACT_CARDS.strip()}
"""

OUTPUT = """
*NODE FILE
U, RF
*EL FILE
S, ENER
*CONTACT FILE
CDIS, CSTR, CF
*CONTACT PRINT, TOTALS=YES
CDIS, CSTR, CF
*END STEP
"""

STEP_CLOSE = f"""
*STEP
*STATIC
1., 1.
{SETTINGS.strip()}
*BOUNDARY
BASE, 1, 2
AXIS, 1
HEAD, 2, 2, <approach>
{OUTPUT.strip()}
"""

STEP_PRESS = f"""
*STEP
*STATIC
0.25, 1.
{SETTINGS.strip()}
*BOUNDARY, OP=NEW
BASE, 1, 2
AXIS, 1
*DLOAD
HEAD, P3, <pressure>
{OUTPUT.strip()}
"""


def graded(fine: float, even: float, end: float) -> list[float]:
    """0 to `end`: elements of size `fine` up to `even`, then each larger by about GROWTH."""
    n_even = max(1, math.ceil(even/fine))
    place = [fine*k for k in range(n_even + 1)]
    rest, n_rest = end - place[-1], 1
    while fine*(GROWTH**(n_rest + 1) - GROWTH)/(GROWTH - 1.0) < rest:
        n_rest += 1
    low, high = 1.0, GROWTH                    # the ratio that ends at `end` exactly
    for _ in range(60):
        ratio = 0.5*(low + high)
        reach = fine*math.fsum(ratio**k for k in range(1, n_rest + 1))
        low, high = (ratio, high) if reach < rest else (low, ratio)
    size = fine
    for _ in range(n_rest):
        size *= ratio
        place.append(place[-1] + size)
    return [*place[:-1], end]


def half_cylinder(fine: float, radius: float = RADIUS, half_width: float = HALF_WIDTH,
                  ) -> tuple[tuple[int, int], Callable[[int, int], Point]]:
    """Cells and positions of the upper cylinder: lowest point at the origin, i to the right."""
    arc = graded(fine, 1.5*half_width, radius*HALF_ANGLE)
    angle = [s/radius for s in arc]
    angle = [-a for a in reversed(angle[1:])] + angle
    height = [s/radius for s in graded(fine, 0.5*half_width, radius)]

    def place(i: int, j: int) -> Point:
        a, t = angle[i], height[j]
        x, y = radius*math.sin(a), 2.0*radius*math.sin(0.5*a)**2
        return (1.0 - t)*x + t*radius*a/HALF_ANGLE, (1.0 - t)*y + t*radius

    return (len(angle) - 1, len(height) - 1), place


def axis_nodes(grid: Grid, arc: int) -> list[int]:
    """Nodes on the axis of symmetry but the one of the arc, which is row `arc`."""
    middle = grid.node[len(grid.node)//2]
    return [label for label in middle if label != middle[arc]]


def pressed_sets(lower: Grid, upper: Grid, upper_arc: str, lower_arc: str) -> list[str]:
    """Sets and surfaces of a body whose last row meets the first row of one above it."""
    return (set_lines("NSET", "BASE", [column[0] for column in lower.node])
            + set_lines("NSET", "HEAD", [column[-1] for column in upper.node])
            + set_lines("NSET", "AXIS", axis_nodes(lower, -1))
            + set_lines("NSET", "AXIS", axis_nodes(upper, 0))
            + set_lines("ELSET", "HEAD", [column[-1] for column in upper.element])
            + surface_lines(upper_arc, "S1", [column[0] for column in upper.element])
            + surface_lines(lower_arc, "S3", [column[-1] for column in lower.element]))


def level_options(purpose: str | None) -> argparse.Namespace:
    """Those of the command line: where the deck goes, and how fine it is."""
    parser = arguments(purpose)
    parser.add_argument("--level", type=int, default=6, metavar="N",
                        help="elements over the half-width of the contact (default 6)")
    options = parser.parse_args()
    if options.level < 1:
        parser.error("--level: at least 1")
    return options


def main() -> None:
    options = level_options(__doc__)
    fine = HALF_WIDTH/options.level

    upper_cells, upper_place = half_cylinder(fine)
    lower_cells, mirrored = half_cylinder(MASTER_RATIO*fine)

    def lower_place(i: int, j: int) -> Point:
        x, y = mirrored(i, lower_cells[1] - j)
        return x, -y

    lower, upper = Part("LOWER"), Part("UPPER")
    lower_grid = add_grid(lower, lower_cells, lower_place)
    upper_grid = add_grid(upper, upper_cells, upper_place,
                          first=(len(lower.node) + 1, len(lower.element) + 1))

    lines = heading(HEADING.replace("LEVEL", str(options.level)))
    lines += ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Lower cylinder, column by column from the left, each from the bottom up")
    lines += lower.node_lines() + lower.element_lines()
    lines += comment("Upper cylinder, likewise") + upper.node_lines() + upper.element_lines()
    lines += comment("Sets and surfaces")
    lines += pressed_sets(lower_grid, upper_grid, "UPPER_ARC", "LOWER_ARC")
    lines += comment("Material, contact") + MATERIAL.strip().splitlines()
    lines += comment("Step 1: close the contact") + STEP_CLOSE.strip().splitlines()
    lines += comment("Step 2: the pressure in place of the displacement")
    lines += STEP_PRESS.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
