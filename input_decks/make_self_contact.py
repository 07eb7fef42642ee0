"""Deck of a folding strip: a hairpin whose legs fly together and touch, one surface with itself.

    python3 make_self_contact.py --output self_contact.inp
"""

from __future__ import annotations

import math

from deckwriter import (Part, Point, add_grid, arguments, comment, heading, number, surface_lines,
                        write_deck)
from scenery import (FREE_STEP, Motion, contact_parameters, momenta, momenta_text,
                     velocity_lines)

LOWER_LEG, UPPER_LEG = 6.0, 5.4
RADIUS, THICK = 0.5, 0.4       # of the inside of the bend, of the strip
DENSITY = 0.01
CLOSING = 0.5                  # rate at which each leg turns towards the other
DRIFT = Motion(centre=(0.0, 0.0), velocity=(0.4, 0.3), spin=0.25)


def velocity(x: float, y: float) -> Point:
    """Translation and spin; the legs, x > 0, close like scissors."""
    vx, vy = DRIFT.at(x, y)
    return (vx, vy) if x <= 0.0 else (vx, vy - math.copysign(CLOSING*x, y))


def heading_text(strip: Part) -> str:
    vx, vy = DRIFT.velocity
    return f"""
A folding strip: the legs of a hairpin fly together, touch and part; self-contact, no friction.

A strip {THICK:g} thick, bent to a hairpin of inner radius {RADIUS:g} with legs
{LOWER_LEG:g} and {UPPER_LEG:g} long; E = 20, nu = 0.3, compressible neo-Hookean, plane strain.
It moves by ({vx:g}, {vy:g})
and spins by {DRIFT.spin:g}, and each leg closes by {CLOSING:g} times the distance from the bend. No
supports, no loads. The whole inside, from tip to tip, is one surface, in contact with itself: of
two edges that meet, the one that comes first along the surface is the slave.
Units: any consistent set (length L, mass M, time T; stress M/(L T^2), thickness 1 L).

What to look at: the legs meet near the tips, the contact spreads towards the bend and lets go;
the total energy, px, py and lz (about the origin) stay as they are at the start, for every h.

Expected: {momenta_text(momenta(strip, DENSITY, velocity))};
          each constant to 1e-11 relative. First contact at t = 0.19; it comes and goes until
          t = 0.6 to 1.2, which depends on h; the strain energy reaches 0.040 to 0.044.
Overlap: 0.0057 of an edge at most, because mortar closes gaps in the mean; bad from 0.02 on.
          With NODE TO SURFACE there is none.

Made by make_self_contact.py. Change a parameter for one run: --set h=0.005
"""


PARAMETERS = f"""
*PARAMETER
h = 0.01
t_end = 2.
frame = 0.05
method = NULL SPACE
initiation = PERSISTENT
tolerance = 1e-12
{contact_parameters().strip()}
"""

MATERIAL = f"""
*MATERIAL, NAME=SOFT
*HYPERELASTIC, COUPLED NEO HOOKE
20., 0.3
*DENSITY
{number(DENSITY)}
*SOLID SECTION, ELSET=STRIP, MATERIAL=SOFT
1.
*SURFACE INTERACTION, NAME=FRICTIONLESS
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=<formulation>, SIDES=<sides>
INSIDE, INSIDE
*TIME POINTS, NAME=FRAMES, GENERATE
0., <t_end>, <frame>
"""


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--leg", type=int, default=22, metavar="N", help="elements along a leg")
    parser.add_argument("--bend", type=int, default=10, metavar="N",
                        help="elements around the bend")
    parser.add_argument("--through", type=int, default=3, metavar="N",
                        help="elements through the thickness")
    options = parser.parse_args()
    if min(options.leg, options.bend, options.through) < 1:
        parser.error("--leg, --bend, --through: at least 1")
    n_leg, n_bend = options.leg, options.bend
    cells = (2*n_leg + n_bend, options.through)

    def place(i: int, j: int) -> Point:
        """Along the strip from the tip of the upper leg, from the inside outwards."""
        r = RADIUS + THICK*j/cells[1]
        if i < n_leg:
            return UPPER_LEG*(1.0 - i/n_leg), r
        if i > n_leg + n_bend:
            return LOWER_LEG*(i - n_leg - n_bend)/n_leg, -r
        angle = 0.5*math.pi + math.pi*(i - n_leg)/n_bend
        return (r*math.cos(angle) if 0 < i - n_leg < n_bend else 0.0), r*math.sin(angle)

    # The grid must be counter-clockwise: from the outside inwards.
    strip = Part("STRIP")
    grid = add_grid(strip, cells, lambda i, j: place(i, cells[1] - j))

    lines = heading(heading_text(strip)) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Strip, across from the outside inwards, from the tip of the upper leg on")
    lines += strip.node_lines() + strip.element_lines()
    lines += comment("Surface")
    lines += surface_lines("INSIDE", "S3", [column[-1] for column in grid.element])
    lines += comment("Material, contact") + MATERIAL.strip().splitlines()
    lines += comment("Start: node, direction, velocity") + velocity_lines(strip, velocity)
    lines += comment("The run") + FREE_STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
