"""Deck of a smooth exact solution on a square of tied pieces, for orders of convergence.

    python3 make_tied_smooth.py --output tied_smooth.inp
    python3 make_tied_smooth.py --interface CURVED --ratio 10 --level 8 --output fine.inp
"""

from __future__ import annotations

import argparse

from deckwriter import arguments, comment, heading, number, write_deck
from tied_exact import Smooth
from tied_parts import FACE, Body, arc, join_quarters, line, quarters

EXACT = Smooth(young=100.0, poisson=0.3)
RISE = 0.1                     # of a curved interface

INTERFACE = {
    "NONE": "one piece",
    "STRAIGHT": "two pieces with a straight interface",
    "CURVED": "two pieces with an interface along an arc",
    "FOUR": "2 x 2 pieces that meet in one point",
    "FOUR CURVED": "2 x 2 pieces with curved interfaces that meet in one point",
}


def body_of(options: argparse.Namespace) -> Body:
    """The coarse pieces have `level` cells along a half of the square, the fine ones more."""
    coarse = options.level
    fine = round(options.ratio*coarse)
    square = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    sw, se, ne, nw = square
    if options.interface == "NONE":
        body = Body()
        body.add("WHOLE", (2*coarse, 2*coarse), line(sw, se), line(se, ne), line(nw, ne),
                 line(sw, nw))
        return body
    if options.interface.startswith("FOUR"):
        rise = 0.5*RISE if options.interface == "FOUR CURVED" else 0.0
        body = quarters(sw, (1.0, 1.0), (0.45, 0.55), rise,
                        {name: (n, n) for name, n in (("SW", coarse), ("SE", fine), ("NE", coarse),
                                                      ("NW", fine))})
        join_quarters(body, ("SE", "SE", "NW", "NW") if options.slave == "FINE"
                      else ("SW", "NE", "NE", "SW"))
        return body
    west, east = (0.0, 0.5), (1.0, 0.5)
    middle = arc(west, east, RISE if options.interface == "CURVED" else 0.0)
    body = Body()
    body.add("LOWER", (2*coarse, coarse), line(sw, se), line(se, east), middle, line(sw, west))
    body.add("UPPER", (2*fine, fine), middle, line(east, ne), line(nw, ne), line(west, nw))
    if options.slave == "FINE":
        body.join("UPPER", "SOUTH", "LOWER", "NORTH")
    else:
        body.join("LOWER", "NORTH", "UPPER", "SOUTH")
    return body


def heading_text(options: argparse.Namespace, body: Body) -> str:
    material = f"E = {EXACT.young:g}, nu = {EXACT.poisson:g}, linear elastic"
    return f"""
A smooth exact solution on a square of tied pieces with unlike meshes, static, plane strain.

The square of side 1 is {INTERFACE[options.interface]};
meshes {body.counts()}: elements along the two sides of an interface
in the ratio 1 : {options.ratio:g}, the {options.slave.lower()} side is the slave. {material}.
The displacement of all outer nodes is that of the solution, which needs no body force: complex
potentials phi = exp((1 + 2i) z) and psi = exp((-2 + 1.5i) z), their series up to degree 12.
Units: any consistent set (force F, length L; stress F/L^2, thickness 1 L).

What to look at: with smaller elements the error of the displacement falls with their square,
that of the stress with their size, as on a mesh that matches; it does not gather at interfaces.

Expected: orders 2 (displacement, mean square) and 1 (energy) in the size of the elements.

Made by make_tied_smooth.py. Change a parameter for one run: --set multiplier=STANDARD
"""


PARAMETERS = """
*PARAMETER
multiplier = DUAL
method = NULL SPACE
tolerance = 1e-12
"""

MATERIAL = f"""
*MATERIAL, NAME=SOLID
*ELASTIC
{number(EXACT.young)}, {number(EXACT.poisson)}
"""

STEP = """
*STEP
*STATIC
1., 1.
*CONSTRAINT METHOD, TYPE=<method>
*NEWTON, TOLERANCE=<tolerance>
*BOUNDARY
"""

OUTPUT = """
*NODE FILE
U
*EL FILE
S
*END STEP
"""


def boundary_lines(body: Body) -> list[str]:
    """All nodes on the sides of the square."""
    place, lines = body.places(), []
    sides = [(name, side) for name, piece in body.piece.items() for side in FACE
             if any(all(place[k][axis] == value for k in piece.nodes(side))
                    for axis in (0, 1) for value in (0.0, 1.0))]
    for label in body.outer_nodes(sides):
        lines += [f"{label}, {k}, {k}, {number(u)}"
                  for k, u in enumerate(EXACT.displacement(*place[label]), start=1)]
    return lines


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--interface", choices=INTERFACE, default="FOUR CURVED")
    parser.add_argument("--ratio", type=float, default=1.5, metavar="R",
                        help="elements of the fine side per element of the coarse side")
    parser.add_argument("--level", type=int, default=4, metavar="N",
                        help="elements of the coarse side along half of the square")
    parser.add_argument("--slave", choices=("FINE", "COARSE"), default="FINE")
    options = parser.parse_args()
    if options.level < 1 or options.ratio < 1.0:
        parser.error("--level and --ratio are at least 1")
    body = body_of(options)

    lines = heading(heading_text(options, body)) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Pieces, each column by column from the left and from the bottom up")
    lines += body.mesh_lines() + comment("Ties") + body.tie_lines()
    lines += comment("Material") + MATERIAL.strip().splitlines() + body.section_lines("SOLID")
    lines += comment("The step: the exact displacement all around") + STEP.strip().splitlines()
    lines += boundary_lines(body) + OUTPUT.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
