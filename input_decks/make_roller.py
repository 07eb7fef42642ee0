"""Deck of a cylinder pressed on a block, NAFEMS benchmark R0094-1.

    python3 make_roller.py --output roller.inp
"""

from __future__ import annotations

import math

from deckwriter import Grid, Part, Point, add_grid, comment, heading, number, write_deck
from make_hertz import graded, half_cylinder, level_options, pressed_sets
from scenery import CONTACT_CARDS, contact_parameters

RADIUS, BLOCK = 50.0, 200.0
YOUNG_CYLINDER, YOUNG_BLOCK, POISSON = 210.0e3, 70.0e3, 0.3
FORCE = 35.0e3
MODULUS = 1.0/((1.0 - POISSON**2)*(1.0/YOUNG_CYLINDER + 1.0/YOUNG_BLOCK))
HALF_WIDTH = math.sqrt(4.0*FORCE*RADIUS/(math.pi*MODULUS))
PEAK = 2.0*FORCE/(math.pi*HALF_WIDTH)
#: Elements of the block are larger than those of the cylinder by this ratio.
MASTER_RATIO = 1.3

HEADING = f"""
Steel cylinder on an aluminium block, static, plane strain, no friction.

Source: NAFEMS R0094, benchmark 1. Cylinder of radius {RADIUS:g} mm, E = {YOUNG_CYLINDER:g} N/mm^2, on a
block of {BLOCK:g} x {BLOCK:g} mm, E = {YOUNG_BLOCK:g}; nu = {POISSON:g}; {FORCE:g} N/mm. The lower half of the
cylinder, its flat loaded by a pressure; beyond 45 degrees the arc is cut off by a chord.
LEVEL elements over the half-width in the cylinder, which is the slave.
Units: mm, N.

Without contact the cylinder is free to fall, so a first step closes the contact by a small
prescribed displacement, and the second replaces that by the pressure.

What to look at: the contact pressure over x is half an ellipse.

Expected at the end (Hertz, bodies large against the contact): half-width {HALF_WIDTH:.4f} mm,
          peak pressure {PEAK:.1f} N/mm^2; these bodies are finite.
          Sum of the contact forces {FORCE:g}.
          With 6 elements over the half-width, per length of the reference mesh: peak within 0.1
          percent with MORTAR and 3 with nodes, half-width within 1.5 and 3.

Made by make_roller.py. Change a parameter for one run: --set formulation=MORTAR
"""

PARAMETERS = f"""
*PARAMETER
pressure = {number(FORCE/(2.0*RADIUS))}
approach = -0.05
method = NULL SPACE
{contact_parameters("NODE TO SURFACE").strip()}
"""

MODEL = f"""
*MATERIAL, NAME=STEEL
*ELASTIC
{number(YOUNG_CYLINDER)}, {number(POISSON)}
*MATERIAL, NAME=ALUMINIUM
*ELASTIC
{number(YOUNG_BLOCK)}, {number(POISSON)}
*SOLID SECTION, ELSET=BLOCK, MATERIAL=ALUMINIUM
1.
*SOLID SECTION, ELSET=CYLINDER, MATERIAL=STEEL
1.
*SURFACE INTERACTION, NAME=FRICTIONLESS
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=<formulation>, SIDES=<sides>
ARC, TOP
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
*CONTACT PRINT, TOTALS=ONLY
CF
*END STEP
"""

STEPS = f"""
*STEP
*STATIC
1., 1.
{SETTINGS.strip()}
*BOUNDARY
BASE, 1, 2
AXIS, 1
HEAD, 2, 2, <approach>
{OUTPUT.strip()}
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


def add_block(part: Part, fine: float) -> Grid:
    """The block, graded from the middle of its top, which is at the origin."""
    right = graded(fine, 1.5*HALF_WIDTH, 0.5*BLOCK)
    x = [-place for place in reversed(right[1:])] + right
    depth = graded(fine, 0.5*HALF_WIDTH, BLOCK)

    def place(i: int, j: int) -> Point:
        return x[i], -depth[len(depth) - 1 - j]

    return add_grid(part, (len(x) - 1, len(depth) - 1), place)


def main() -> None:
    options = level_options(__doc__)
    fine = HALF_WIDTH/options.level

    block, cylinder = Part("BLOCK"), Part("CYLINDER")
    block_grid = add_block(block, MASTER_RATIO*fine)
    cylinder_grid = add_grid(cylinder, *half_cylinder(fine, RADIUS, HALF_WIDTH),
                             first=(len(block.node) + 1, len(block.element) + 1))

    lines = heading(HEADING.replace("LEVEL", str(options.level)))
    lines += ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Block, column by column from the left, each from the bottom up")
    lines += block.node_lines() + block.element_lines()
    lines += comment("Cylinder, likewise") + cylinder.node_lines() + cylinder.element_lines()
    lines += comment("Sets and surfaces")
    lines += pressed_sets(block_grid, cylinder_grid, "ARC", "TOP")
    lines += comment("Materials, contact") + MODEL.strip().splitlines()
    lines += comment("Close the contact, then the pressure in place of the displacement")
    lines += STEPS.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
