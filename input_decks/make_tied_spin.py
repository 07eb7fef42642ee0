"""Deck of a square of four tied pieces in free flight: it spins, translates and vibrates.

    python3 make_tied_spin.py --output tied_spin.inp
"""

from __future__ import annotations

from deckwriter import arguments, comment, heading, number, write_deck
from scenery import Momenta, Motion, momenta, velocity_lines
from tied_parts import Body, join_quarters, quarters

SIDE = 4.0
CENTRE = (3.0, 1.0)
DENSITY = 0.01
MOTION = Motion(centre=CENTRE, velocity=(2.0, 1.0), spin=1.0, stretch=0.4)
CELLS = {"SW": (6, 5), "SE": (7, 8), "NE": (5, 6), "NW": (8, 7)}


def square() -> Body:
    """Four pieces with curved interfaces; each is slave of one neighbour, master of the other."""
    x, y = CENTRE
    body = quarters((x - 0.5*SIDE, y - 0.5*SIDE), (SIDE, SIDE), (x - 0.2, y + 0.3), 0.25, CELLS)
    join_quarters(body, ("SW", "SE", "NE", "NW"))
    return body


def heading_text(body: Body) -> str:
    total = sum((momenta(part, DENSITY, MOTION.at) for part in body.parts()), Momenta())
    return f"""
Free flight of a square of four tied pieces that spins, translates and vibrates; plane strain.

Side {SIDE:g}, E = 100, nu = 0.3, compressible neo-Hookean. Meshes {body.counts()}; the
interfaces are curved and meet in one point. The initial velocity is linear in the position:
translation ({MOTION.velocity[0]:g}, {MOTION.velocity[1]:g}), spin {MOTION.spin:g}, stretch rate \
{MOTION.stretch:g} along x and -{MOTION.stretch:g} along y.
Units: any consistent set (length L, mass M, time T; stress M/(L T^2), thickness 1 L).

What to look at: kinetic and strain energy exchange; total energy, px, py and lz (about the
origin) stay as they are at the start, for every h, though the pieces meet along arcs on which
their nodes do not match.

Expected: mass {total.mass:.3g}, total energy {total.kinetic:.3g}, px = {total.px:.3g},
          py = {total.py:.3g}, lz = {total.lz:.3g}, within 1 percent (slave nodes are moved onto
          the masters); each constant to 1e-11 relative over 1000 increments.

Made by make_tied_spin.py. Change a parameter for one run: --set multiplier=STANDARD
"""


PARAMETERS = """
*PARAMETER
h = 0.01
t_end = 10.
frame = 0.1
multiplier = DUAL
method = NULL SPACE
tolerance = 1e-12
"""

MATERIAL = f"""
*MATERIAL, NAME=SOFT
*HYPERELASTIC, COUPLED NEO HOOKE
100., 0.3
*DENSITY
{number(DENSITY)}
"""

STEP = """
*TIME POINTS, NAME=FRAMES, GENERATE
0., <t_end>, <frame>
*STEP, NLGEOM, INC=1000000
*DYNAMIC, DIRECT
<h>, <t_end>
*CONSTRAINT METHOD, TYPE=<method>
*NEWTON, TOLERANCE=<tolerance>
*NODE FILE, TIME POINTS=FRAMES
U, V
*EL FILE, TIME POINTS=FRAMES
S, ENER
*END STEP
"""


def main() -> None:
    options = arguments(__doc__).parse_args()
    body = square()
    lines = heading(heading_text(body)) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Pieces, each column by column from the left and from the bottom up")
    lines += body.mesh_lines()
    lines += comment("Ties") + body.tie_lines()
    lines += comment("Material") + MATERIAL.strip().splitlines() + body.section_lines("SOFT")
    lines += comment("Start: node, direction, velocity")
    for part in body.parts():
        lines += velocity_lines(part, MOTION.at)
    lines += comment("The run") + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
