"""Deck of a ring in free flight: it spins, translates and vibrates, nothing touches it.

    python3 make_spinning_ring.py --output spinning_ring.inp
"""

from __future__ import annotations

import math

from deckwriter import (Part, Point, add_grid, arguments, cells_argument, comment, heading, number,
                        write_deck)

R_INNER, R_OUTER = 8.0, 10.0
CENTRE = (3.0, 1.0)
DENSITY = 0.01
VELOCITY = (2.0, 1.0)      # of the centre of mass
SPIN = 1.0                 # angular velocity, counter-clockwise
STRETCH = 0.4              # rate of stretch along x, of shortening along y


def position(k: int, j: int, cells: tuple[int, int]) -> Point:
    """Point on radial line `k`, `j` elements inside the rim."""
    angle = 2.0*math.pi*k/cells[0]
    r = R_OUTER - (R_OUTER - R_INNER)*j/cells[1]
    return CENTRE[0] + r*math.cos(angle), CENTRE[1] + r*math.sin(angle)


def velocity(x: float, y: float) -> Point:
    """Translation, spin and stretch: linear in the position, so the mesh carries it exactly."""
    dx, dy = x - CENTRE[0], y - CENTRE[1]
    return VELOCITY[0] - SPIN*dy + STRETCH*dx, VELOCITY[1] + SPIN*dx - STRETCH*dy


def expected(n_around: int) -> dict[str, float]:
    """Mass, momenta and kinetic energy of the polygonal ring with that velocity."""
    side = 2.0*math.pi/n_around
    mass = DENSITY*0.5*n_around*math.sin(side)*(R_OUTER**2 - R_INNER**2)
    # polar moment of a regular polygon of circumradius R about its centre: n/24 R^4 (...)
    polar = (DENSITY*n_around/24.0*math.sin(side)*(4.0 + 2.0*math.cos(side))
             *(R_OUTER**4 - R_INNER**4))
    px, py = mass*VELOCITY[0], mass*VELOCITY[1]
    return {"mass": mass, "px": px, "py": py,
            "lz": CENTRE[0]*py - CENTRE[1]*px + SPIN*polar,
            "kinetic": 0.5*mass*(VELOCITY[0]**2 + VELOCITY[1]**2)
            + 0.5*(SPIN**2 + STRETCH**2)*polar}


def heading_text(n_around: int) -> str:
    want = expected(n_around)
    return f"""
Free flight of a ring that spins, translates and vibrates; plane strain, no load, no contact.

Ring radii {R_INNER:g} and {R_OUTER:g}, E = 100, nu = 0.1, compressible neo-Hookean. The initial
velocity is linear in the position: translation ({VELOCITY[0]:g}, {VELOCITY[1]:g}), spin {SPIN:g},
stretch rate {STRETCH:g} along x and -{STRETCH:g} along y.
Units: any consistent set (length L, mass M, time T; stress M/(L T^2), thickness 1 L).

What to look at: kinetic and strain energy exchange while the ring ovalises; total energy, px, py
and lz (about the origin) stay as they are at the start, for every h.

Expected: total energy {want['kinetic']:.12g} (all kinetic at the start); mass {want['mass']:.12g};
          px = {want['px']:.12g}, py = {want['py']:.12g}, lz = {want['lz']:.12g};
          each constant to 1e-12 relative over 1000 increments.

Made by make_spinning_ring.py. Change a parameter for one run: --set h=0.05
"""


PARAMETERS = """
*PARAMETER
h = 0.01
t_end = 10.
frame = 0.1
tolerance = 1e-10
"""

MATERIAL = f"""
*MATERIAL, NAME=SOFT
*HYPERELASTIC, COUPLED NEO HOOKE
100., 0.1
*DENSITY
{number(DENSITY)}
*SOLID SECTION, ELSET=RING, MATERIAL=SOFT
1.
"""

STEP = """
*TIME POINTS, NAME=FRAMES, GENERATE
0., <t_end>, <frame>
*STEP, NLGEOM, INC=1000000
*DYNAMIC, DIRECT
<h>, <t_end>
*NEWTON, TOLERANCE=<tolerance>
*NODE FILE, TIME POINTS=FRAMES
U, V
*EL FILE, TIME POINTS=FRAMES
S, ENER
*END STEP
"""


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--ring", type=cells_argument, default=(48, 3), metavar="48x3",
                        help="elements around and through the ring")
    options = parser.parse_args()
    if options.ring[0] < 3:
        parser.error("--ring: a ring needs at least 3 elements around")

    ring = Part("RING")
    add_grid(ring, options.ring, lambda k, j: position(k, j, options.ring), closed=True)

    lines = heading(heading_text(options.ring[0])) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Ring: {} x {} elements, each radial line from the rim "
                     "inwards".format(*options.ring))
    lines += ring.node_lines() + ring.element_lines()
    lines += comment("Material") + MATERIAL.strip().splitlines()
    lines += comment("Start: node, direction, velocity")
    lines += ["*INITIAL CONDITIONS, TYPE=VELOCITY"]
    for label, (x, y) in ring.node.items():
        vx, vy = velocity(x, y)
        lines += [f"{label}, 1, {number(vx)}", f"{label}, 2, {number(vy)}"]
    lines += comment("The run") + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
