"""Deck of the ring scene: an elastic ring thrown onto a stiff foundation.

    python3 make_ring.py --output ring.inp
    python3 make_ring.py --ring 128x8 --block 120x10 --output ring_fine.inp

Counts are elements around and through the ring, along and down the block.
"""

from __future__ import annotations

import math

from deckwriter import (Grid, Part, Point, add_grid, arguments, box, cells_argument, comment,
                        heading, number, set_lines, surface_lines, write_deck)
from scenery import CONTACT_CARDS, contact_parameters

R_INNER, R_OUTER = 8.0, 10.0
GAP = 0.1
BLOCK_CORNER, BLOCK_SIZE = (-25.0, -5.0), (60.0, 5.0)
DENSITY = 0.01
VELOCITY = (2.0, -3.0)


def unit_circle(k: int, n: int) -> Point:
    """(cos, sin) of -pi/2 + 2 pi k/n; mirror images in either axis get the same digits."""
    m = min(k % n, -k % n)                        # mirrored to the right half
    angle = math.pi*min(2*m, n - 2*m)/n           # mirrored to the lower quarter
    x = math.sin(angle) if 4*m != n else 1.0
    y = -math.cos(angle) if 4*m != n else 0.0
    return (x if k % n == m else -x), (y if 4*m < n else -y)


def ring_position(k: int, j: int, cells: tuple[int, int]) -> Point:
    """Point on radial line `k`, `j` elements inside the rim; the lowest one lies at y = GAP."""
    x, y = unit_circle(k, cells[0])
    r = R_OUTER - (R_OUTER - R_INNER)*j/cells[1]
    return r*x, GAP + (R_OUTER + r*y)


def heading_text(area: float) -> str:
    mass = DENSITY*area
    px, py = (mass*v for v in VELOCITY)
    energy = 0.5*mass*(VELOCITY[0]**2 + VELOCITY[1]**2)
    return f"""
Impact of an elastic ring on a stiff elastic foundation, plane strain, no friction, no gravity.

Source: Hesch & Betsch 2006, section 5 (E, nu, four-node elements). The paper leaves the rest
open; it is fixed here: radii {R_INNER:g} and {R_OUTER:g}, foundation 60 x 5, density, gap {GAP:g},
velocity ({VELOCITY[0]:g}, {VELOCITY[1]:g}), time.
Units: any consistent set (length L, mass M, time T; stress M/(L T^2), thickness 1 L).

What to look at: the ring flattens while it slides along the foundation, and rebounds.
The total energy is held through contact and release, and the rim has no mass of its own, which
makes contact forces smooth (initiation = AUTO takes MASSLESS here). The nodes
of the rim are enough (sides = ONE): no node of the flat top enters the finer rim, as the overlap check
shows. With both sides, nodes of the top also push the straight edges of the rim, and px changes more.

Expected: total energy {energy:.6g} throughout; ring mass {mass:.6g};
          ring momentum ({px:.6g}, {py:.6g}) before contact;
          after release px within 0.2 percent of that (the surface tilts a little), ring py
          between 2.53 and 2.78 (that spread is the discretisation error over h = 0.05..0.005
          and the treatments of first contact, on 64 x 4 and 60 x 5 elements).

Made by make_ring.py. Change a parameter for one run: emcon run ring.inp --set h=0.005
with mortar contact: --set formulation=MORTAR
"""


def parameter_lines(points: int) -> list[str]:
    """The parameters, with Gauss points of segment and mortar contact."""
    return f"""
*PARAMETER
h = 0.01
t_end = 8.
frame = 0.1
method = NULL SPACE
initiation = AUTO
tolerance = 1e-10
{contact_parameters("NODE TO SURFACE", "ONE", points).strip()}
""".strip().splitlines()


def model_lines(block: Grid, ring: Grid) -> list[str]:
    """Sets and surfaces. Radial lines start at the rim: it is face S1."""
    return (comment("Sets and surfaces")
            + set_lines("NSET", "BOTTOM", [column[0] for column in block.node])
            + surface_lines("BLOCK_TOP", "S3", [column[-1] for column in block.element])
            + surface_lines("RING_OUTER", "S1", [column[0] for column in ring.element]))


MATERIALS = f"""
*MATERIAL, NAME=SOFT
*HYPERELASTIC, COUPLED NEO HOOKE
100., 0.1
*DENSITY
{number(DENSITY)}
*MATERIAL, NAME=STIFF
*HYPERELASTIC, COUPLED NEO HOOKE
1e5, 0.1
*DENSITY
{number(DENSITY)}
*SOLID SECTION, ELSET=RING, MATERIAL=SOFT
1.
*SOLID SECTION, ELSET=BLOCK, MATERIAL=STIFF
1.
"""

CONTACT = f"""
*SURFACE INTERACTION, NAME=FRICTIONLESS
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=<formulation>, SIDES=<sides>
RING_OUTER, BLOCK_TOP
*BOUNDARY
BOTTOM, 1, 2
*INITIAL CONDITIONS, TYPE=VELOCITY
RING, 1, {number(VELOCITY[0])}
RING, 2, {number(VELOCITY[1])}
*TIME POINTS, NAME=FRAMES, GENERATE
0., <t_end>, <frame>
"""

STEP = f"""
*STEP, NLGEOM, INC=1000000
*DYNAMIC, DIRECT
<h>, <t_end>
*CONSTRAINT METHOD, TYPE=<method>
*CONTACT INITIATION, TYPE=<initiation>
*NEWTON, TOLERANCE=<tolerance>
{CONTACT_CARDS.strip()}
*NODE FILE, TIME POINTS=FRAMES
U, V, RF
*EL FILE, TIME POINTS=FRAMES
S, ENER
*CONTACT FILE, TIME POINTS=FRAMES
CDIS, CSTR, CF
*CONTACT PRINT, TOTALS=ONLY
CF
*RESTART, WRITE, FREQUENCY=50
*END STEP
"""


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--ring", type=cells_argument, default=(64, 4), metavar="64x4",
                        help="elements around and through the ring")
    parser.add_argument("--block", type=cells_argument, default=(60, 5), metavar="60x5",
                        help="elements along and down the block")
    options = parser.parse_args()
    n_around, n_through = options.ring
    if n_around < 3:
        parser.error("--ring: a ring needs at least 3 elements around")

    ring, block = Part("RING"), Part("BLOCK")
    ring_grid = add_grid(ring, options.ring, lambda k, j: ring_position(k, j, options.ring),
                         closed=True)
    block_grid = add_grid(block, options.block, box(BLOCK_CORNER, BLOCK_SIZE, options.block),
                          first=(len(ring.node) + 1, len(ring.element) + 1))
    area = 0.5*n_around*math.sin(2.0*math.pi/n_around)*(R_OUTER**2 - R_INNER**2)

    lines = heading(heading_text(area)) + ["**"] + parameter_lines(points=3)
    lines += comment(f"Ring: {n_around} x {n_through} elements, radial line by radial line from "
                     "the bottom,\ncounter-clockwise, each from the rim inwards")
    lines += ring.node_lines() + ring.element_lines()
    lines += comment("Foundation: {} x {} elements, column by column from the left, each from "
                     "the bottom up".format(*options.block))
    lines += block.node_lines() + block.element_lines()
    lines += model_lines(block_grid, ring_grid)
    for title, text in (("Materials", MATERIALS), ("Contact, supports, start", CONTACT),
                        ("The run", STEP)):
        lines += comment(title) + text.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
