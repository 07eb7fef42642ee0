"""Deck of a ring and a disc in free flight that spin, collide off-centre and part.

    python3 make_two_bodies.py --output two_bodies.inp
"""

from __future__ import annotations

import math

from deckwriter import (Grid, Part, Point, add_grid, arguments, cells_argument, comment, heading,
                        number, surface_lines, write_deck)
from scenery import (FREE_STEP, Motion, add_disc, contact_parameters, momenta, momenta_text,
                     velocity_lines)

R_INNER, R_OUTER, R_DISC = 3.0, 4.0, 5.0
DENSITY = 0.01
RING = Motion(centre=(-4.6, 1.5), velocity=(3.0, 0.2), spin=-0.6)
DISC = Motion(centre=(4.6, -0.5), velocity=(-1.0, -0.1), spin=0.4)


def ring_place(k: int, j: int, cells: tuple[int, int]) -> Point:
    """Point on radial line `k`, `j` elements inside the rim."""
    angle = 2.0*math.pi*k/cells[0]
    r = R_OUTER - (R_OUTER - R_INNER)*j/cells[1]
    return RING.centre[0] + r*math.cos(angle), RING.centre[1] + r*math.sin(angle)


def heading_text(ring: Part, disc: Part) -> str:
    one, other = momenta(ring, DENSITY, RING.at), momenta(disc, DENSITY, DISC.at)
    return f"""
Two free spinning bodies, a ring and a disc, collide off-centre and part; plane strain, no friction.

Ring of radii {R_INNER:g} and {R_OUTER:g}, E = 100, nu = 0.1, compressible neo-Hookean, velocity
({RING.velocity[0]:g}, {RING.velocity[1]:g}), spin {RING.spin:g};
disc of radius {R_DISC:g}, E = 200, nu = 0.3, St. Venant-Kirchhoff,
velocity ({DISC.velocity[0]:g}, {DISC.velocity[1]:g}), spin {DISC.spin:g}.
No supports, no loads. The ring is the slave.
Units: any consistent set (length L, mass M, time T; stress M/(L T^2), thickness 1 L).

What to look at: total energy, px, py and lz (about the origin) of both bodies together, which
stay as they are at the start, through contact and release, for every h.

Expected: {momenta_text(one + other)};
          each constant to 1e-11 relative. Before the collision the ring has mass {one.mass:.9g}
          and momentum ({one.px:.9g}, {one.py:.9g}), the disc mass
          {other.mass:.9g} and momentum ({other.px:.9g}, {other.py:.9g}).
          In contact from t = 0.12 to 0.85; after that the ring has px = -0.46 and py = 0.34,
          the disc px = 0.34 and py = -0.37, all +- 0.03 over h = 0.01 to 0.0025 and the
          formulations.
Overlap: 0.017 of an edge at most, because mortar closes gaps in the mean; bad from 0.02 on.
          With NODE TO SURFACE there is none.

Made by make_two_bodies.py. Change a parameter for one run: --set normal=EDGE
"""


PARAMETERS = f"""
*PARAMETER
h = 0.01
t_end = 3.
frame = 0.1
method = NULL SPACE
initiation = PERSISTENT
tolerance = 1e-12
{contact_parameters().strip()}
"""

MATERIAL = f"""
*MATERIAL, NAME=SOFT
*HYPERELASTIC, COUPLED NEO HOOKE
100., 0.1
*DENSITY
{number(DENSITY)}
*MATERIAL, NAME=FIRM
*ELASTIC
200., 0.3
*DENSITY
{number(DENSITY)}
*SOLID SECTION, ELSET=RING, MATERIAL=SOFT
1.
*SOLID SECTION, ELSET=DISC, MATERIAL=FIRM
1.
*SURFACE INTERACTION, NAME=FRICTIONLESS
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=<formulation>, SIDES=<sides>
RING_OUTER, DISC_RIM
*TIME POINTS, NAME=FRAMES, GENERATE
0., <t_end>, <frame>
"""


def rim(grid: Grid) -> list[int]:
    return [column[0] for column in grid.element]


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--ring", type=cells_argument, default=(56, 3), metavar="56x3",
                        help="elements around and through the ring")
    parser.add_argument("--disc", type=cells_argument, default=(8, 4), metavar="8x4",
                        help="elements along a quarter of the rim of the disc, through its mantle")
    options = parser.parse_args()
    if options.ring[0] < 3:
        parser.error("--ring: a ring needs at least 3 elements around")

    ring, disc = Part("RING"), Part("DISC")
    ring_grid = add_grid(ring, options.ring, lambda k, j: ring_place(k, j, options.ring),
                         closed=True)
    disc_grid = add_disc(disc, DISC.centre, R_DISC, options.disc, turn=0.2,
                         first=(len(ring.node) + 1, len(ring.element) + 1))

    lines = heading(heading_text(ring, disc)) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Ring: {} x {} elements, each radial line from the rim "
                     "inwards".format(*options.ring))
    lines += ring.node_lines() + ring.element_lines()
    lines += comment("Disc: mantle from the rim inwards, then the square in the middle")
    lines += disc.node_lines() + disc.element_lines()
    lines += comment("Surfaces") + surface_lines("RING_OUTER", "S1", rim(ring_grid))
    lines += surface_lines("DISC_RIM", "S1", rim(disc_grid))
    lines += comment("Materials, contact") + MATERIAL.strip().splitlines()
    lines += comment("Start: node, direction, velocity")
    lines += velocity_lines(ring, RING.at) + velocity_lines(disc, DISC.at)
    lines += comment("The run") + FREE_STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
