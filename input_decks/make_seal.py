"""Deck of a seal: an O-ring of rubber that a lid presses into its groove.

    python3 make_seal.py --output seal.inp
"""

from __future__ import annotations

import math

from deckwriter import (Part, arguments, cells_argument, comment, heading, number, set_lines,
                        surface_lines, write_deck)
from scenery import CONTACT_CARDS, add_disc, contact_parameters

#: Diameter of the section [mm], the part of it by which the lid comes down, shear modulus [MPa].
DIAMETER, SQUEEZE, SHEAR = 4.0, 0.2, 1.0
#: Width of the groove [mm].
WIDTH = 4.6
#: A twentieth of the diameter: by so much the force of a linear elastic cylinder is compared.
SMALL = 0.05*DIAMETER


def line_force(way: float) -> float:
    """Force, of one millimetre, that brings plates on both sides of a cylinder nearer by `way`.

    way = F/(pi G) (ln(4 R/a) - 1/2), a^2 = F R/(pi G): K. L. Johnson, Contact Mechanics, section 5.6,
    for a Poisson's ratio of 1/2.
    """
    low, high = 0.0, 4.0*SHEAR*DIAMETER
    for _ in range(60):
        force = 0.5*(low + high)
        half_width = math.sqrt(0.5*DIAMETER*force/(math.pi*SHEAR))
        found = force/(math.pi*SHEAR)*(math.log(2.0*DIAMETER/half_width) - 0.5)
        low, high = (force, high) if found < way else (low, force)
    return low


HEADING = f"""
A seal: an O-ring of rubber is pressed into its groove, static, plane strain, no friction.

The section is a disc of {DIAMETER:g} mm, of CPE4H: neo-Hooke, shear modulus {SHEAR:g} MPa, nearly incompressible.
Groove and lid are rigid profiles; the groove is {WIDTH:g} mm wide. The lid comes down by
{100*SQUEEZE:g} percent of the diameter. Contact holds the ring; its inner nodes on the middle line move up and
down only.
Units: mm, N, MPa; forces per millimetre of the ring.

What to look at: the contact pressure, which is what seals: zero at the ends of the flat faces and
largest in their middle. Change the squeeze: --set squeeze=-1.2 lets the ring meet the walls.

Expected with --set squeeze={-SMALL:g} (Johnson, line contact of a linear elastic cylinder): force of the
          lid {line_force(SMALL):.4f}, within 5 percent with this mesh. Squeezed more, rubber is stiffer.

Made by make_seal.py. Change a parameter for one run: --set squeeze=-0.4
"""

PARAMETERS = f"""
*PARAMETER
squeeze = {number(-SQUEEZE*DIAMETER)}
h = 0.1
{contact_parameters().strip()}
"""


MODEL = f"""
*SURFACE, NAME=GROOVE, TYPE=SEGMENTS
START, {number(-0.5*WIDTH)}, {number(2.0*DIAMETER)}
LINE, {number(-0.5*WIDTH)}, 0.
LINE, {number(0.5*WIDTH)}, 0.
LINE, {number(0.5*WIDTH)}, {number(2.0*DIAMETER)}
*SURFACE, NAME=LID, TYPE=SEGMENTS
START, {number(0.49*WIDTH)}, {number(DIAMETER)}
LINE, {number(-0.49*WIDTH)}, {number(DIAMETER)}
*NODE
90001, 0., -1.
90002, 0., {number(DIAMETER + 1.0)}
*RIGID BODY, ANALYTICAL SURFACE=GROOVE, REF NODE=90001
*RIGID BODY, ANALYTICAL SURFACE=LID, REF NODE=90002
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, NEO HOOKE
{number(0.5*SHEAR)}, {number(1.0e-3/SHEAR)}
*SOLID SECTION, ELSET=RING, MATERIAL=RUBBER
1.
*SURFACE INTERACTION, NAME=LUBRICATED
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*CONTACT PAIR, INTERACTION=LUBRICATED, TYPE=<formulation>
RIM, GROOVE
RIM, LID
"""

STEP = f"""
*STEP, NLGEOM
*STATIC
<h>, 1.
{CONTACT_CARDS.strip()}
*BOUNDARY
90001, 1, 2
90001, 6
90002, 1
90002, 6
90002, 2, 2, <squeeze>
MIDDLE, 1
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


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--cells", type=cells_argument, default=(12, 8), metavar="12x8",
                        help="elements along a side of the square inside the disc, and around it")
    options = parser.parse_args()

    ring = Part("RING")
    grid = add_disc(ring, (0.0, 0.5*DIAMETER), 0.5*DIAMETER, options.cells)
    rim = {column[0] for column in grid.node}
    middle = [label for label, (x, _) in ring.node.items()
              if abs(x) < 1e-9*DIAMETER and label not in rim]
    lines = heading(HEADING) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("The section: a square, and what is around it") + ring.node_lines()
    lines += [line.replace("TYPE=CPE4,", "TYPE=CPE4H,") for line in ring.element_lines()]
    lines += comment("Sets and surfaces") + set_lines("NSET", "MIDDLE", middle)
    lines += surface_lines("RIM", "S1", [column[0] for column in grid.element])
    lines += comment("Groove, lid, material, contact") + MODEL.strip().splitlines()
    lines += comment("The lid comes down") + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
