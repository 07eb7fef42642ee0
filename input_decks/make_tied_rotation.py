"""Deck of a square of four tied pieces that is turned by 90 degrees in nine steps.

    python3 make_tied_rotation.py --output tied_rotation.inp
"""

from __future__ import annotations

import math

from deckwriter import arguments, comment, heading, number, write_deck
from make_tied_spin import CENTRE, SIDE, square
from tied_parts import FACE, Body

N_STEP = 9


def heading_text(body: Body) -> str:
    return f"""
A square of four tied pieces is turned by 90 degrees in {N_STEP} static steps; plane strain.

Side {SIDE:g}, E = 100, nu = 0.3, compressible neo-Hookean. Meshes {body.counts()}; the
interfaces are curved and meet in one point. The outer nodes are turned about the origin to the
last bit; slave nodes at the ends of interfaces are left to the ties.
Units: any consistent set (force F, length L; stress F/L^2, thickness 1 L).

What to look at: there is no stress and no force, at any angle.

Expected: after step k all nodes turned by {90//N_STEP} k degrees; stress and reactions 0 to
          round-off.

Made by make_tied_rotation.py. Change a parameter for one run: --set multiplier=STANDARD
"""


PARAMETERS = """
*PARAMETER
multiplier = DUAL
method = NULL SPACE
tolerance = 1e-12
"""

MATERIAL = """
*MATERIAL, NAME=SOFT
*HYPERELASTIC, COUPLED NEO HOOKE
100., 0.3
"""

STEP = """
*STEP, NLGEOM
*STATIC
1., 1.
*CONSTRAINT METHOD, TYPE=<method>
*NEWTON, TOLERANCE=<tolerance>
*NODE FILE
U, RF
*EL FILE
S, ENER
*BOUNDARY
"""


def turned_nodes(body: Body) -> list[int]:
    """All outer nodes that are not ends of slave sides."""
    place = body.places()
    sides = [(name, side) for name, piece in body.piece.items() for side in FACE
             if any(all(place[k][axis] == value for k in piece.nodes(side)) for axis in (0, 1)
                    for value in (CENTRE[axis] - 0.5*SIDE, CENTRE[axis] + 0.5*SIDE))]
    return [label for label in body.outer_nodes(sides) if label not in body.slave_ends()]


def step_lines(body: Body, nodes: list[int], angle: float) -> list[str]:
    place, lines = body.places(), STEP.strip().splitlines()
    c, s = math.cos(angle) - 1.0, math.sin(angle)
    for label in nodes:
        x, y = place[label]
        lines += [f"{label}, 1, 1, {number(c*x - s*y)}", f"{label}, 2, 2, {number(s*x + c*y)}"]
    return [*lines, "*END STEP"]


def main() -> None:
    options = arguments(__doc__).parse_args()
    body = square()
    nodes = turned_nodes(body)
    lines = heading(heading_text(body)) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Pieces, each column by column from the left and from the bottom up")
    lines += body.mesh_lines()
    lines += comment("Ties") + body.tie_lines()
    lines += comment("Material") + MATERIAL.strip().splitlines() + body.section_lines("SOFT")
    for k in range(1, N_STEP + 1):
        lines += comment(f"Step {k}: {90*k//N_STEP} degrees")
        lines += step_lines(body, nodes, 0.5*math.pi*k/N_STEP)
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
