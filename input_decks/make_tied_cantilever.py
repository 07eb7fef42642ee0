"""Deck of a cantilever of three tied pieces, against the exact plane solution.

    python3 make_tied_cantilever.py --output tied_cantilever.inp
    python3 make_tied_cantilever.py --ratio 10 --level 8 --output fine.inp
"""

from __future__ import annotations

import argparse
import math

from deckwriter import arguments, comment, heading, number, set_lines, write_deck
from tied_exact import Beam
from tied_parts import Body, line

EXACT = Beam(length=9.0, depth=2.0, force=-1.0, young=1000.0, poisson=0.3)


def body_of(level: int, ratio: float) -> Body:
    """Three pieces of equal length; the one in the middle has the finer mesh."""
    fine, half = round(ratio*level), 0.5*EXACT.depth
    body = Body()
    for k, (name, across) in enumerate((("ROOT", level), ("MIDDLE", fine), ("TIP", level))):
        x = [k*EXACT.length/3.0, (k + 1)*EXACT.length/3.0]
        corner = [[(a, b) for b in (-half, half)] for a in x]
        body.add(name, (round(1.5*across), across), line(corner[0][0], corner[1][0]),
                 line(corner[1][0], corner[1][1]), line(corner[0][1], corner[1][1]),
                 line(corner[0][0], corner[0][1]))
    body.join("MIDDLE", "WEST", "ROOT", "EAST")
    body.join("MIDDLE", "EAST", "TIP", "WEST")
    return body


def heading_text(options: argparse.Namespace, body: Body) -> str:
    tip = EXACT.displacement(EXACT.length, 0.0)[1]
    size = f"Length {EXACT.length:g}, depth {EXACT.depth:g}"
    return f"""
Cantilever of three tied pieces under a shear load at its end, static, plane strain.

{size}, E = {EXACT.young:g}, nu = {EXACT.poisson:g}, linear elastic;
meshes {body.counts()}: elements on the two sides of an interface
in the ratio 1 : {options.ratio:g}, the finer side is the slave.
The end bears the force {EXACT.force:g} as the shear stress of the exact solution (Timoshenko and
Goodier), a parabola; the nodes of the wall are displaced as it says.
Units: any consistent set (force F, length L; stress F/L^2, thickness 1 L).

What to look at: stress runs through the interfaces without a mark; xx is linear over the depth,
xy a parabola.

Expected: middle of the tip of the exact solution uy = {tip:.12g};
          with smaller elements the error of the displacement falls with their square, that of
          the stress with their size; reaction at the wall: vertical {-EXACT.force:g}.

Made by make_tied_cantilever.py. Change a parameter for one run: --set multiplier=STANDARD
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
"""

OUTPUT = """
*NODE FILE
U, RF
*EL FILE
S, ENER
*END STEP
"""


def wall_lines(body: Body) -> list[str]:
    place, lines = body.places(), ["*BOUNDARY"]
    for label in body.piece["ROOT"].nodes("WEST"):
        lines += [f"{label}, {k}, {k}, {number(u)}"
                  for k, u in enumerate(EXACT.displacement(*place[label]), start=1)]
    return lines


def load_lines(body: Body) -> list[str]:
    """Nodal forces of the shear stress at the end; two points a side are exact for a cubic."""
    nodes, place = body.piece["TIP"].nodes("EAST"), body.places()
    force = dict.fromkeys(nodes, 0.0)
    for a, b in zip(nodes, nodes[1:], strict=False):
        x, y0, y1 = EXACT.length, place[a][1], place[b][1]
        for s in (0.5 - math.sqrt(1.0/12.0), 0.5 + math.sqrt(1.0/12.0)):
            shear = 0.5*(y1 - y0)*EXACT.stress(x, (1.0 - s)*y0 + s*y1)[2]
            force[a] += (1.0 - s)*shear
            force[b] += s*shear
    return ["*CLOAD"] + [f"{label}, 2, {number(value)}" for label, value in force.items()]


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--ratio", type=float, default=1.5, metavar="R",
                        help="elements of the fine side per element of the coarse side")
    parser.add_argument("--level", type=int, default=4, metavar="N",
                        help="elements over the depth of the coarse pieces")
    options = parser.parse_args()
    if options.level < 1 or options.ratio < 1.0:
        parser.error("--level and --ratio are at least 1")
    body = body_of(options.level, options.ratio)

    lines = heading(heading_text(options, body)) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Pieces, each column by column from the wall, each from the bottom up")
    lines += body.mesh_lines() + comment("Ties") + body.tie_lines()
    lines += comment("Sets, material") + set_lines("NSET", "WALL", body.piece["ROOT"].nodes("WEST"))
    lines += MATERIAL.strip().splitlines() + body.section_lines("SOLID")
    lines += comment("The step") + STEP.strip().splitlines()
    lines += wall_lines(body) + load_lines(body) + OUTPUT.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
