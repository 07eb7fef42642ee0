"""Deck of the ring scene in tied pieces: the ring in six, the foundation in three.

    python3 make_tied_ring.py --output tied_ring.inp

The scene is that of make_ring.py; meshes are unlike from piece to piece.
"""

from __future__ import annotations

import math

from deckwriter import (Point, arguments, comment, heading, set_lines, surface_lines, write_deck)
from make_ring import (BLOCK_CORNER, BLOCK_SIZE, CONTACT, DENSITY, GAP, MATERIALS, R_INNER,
                       R_OUTER, STEP, VELOCITY, parameter_lines)
from tied_parts import Body, Curve, line

#: Elements around and through each piece of the ring; the first stands on the lowest point.
RING_CELLS = ((12, 4), (8, 3), (11, 5), (9, 4), (14, 3), (10, 5))
#: Right ends of the blocks, and elements along and up each.
BLOCKS = ((-5.0, (16, 4)), (5.0, (12, 6)), (35.0, (32, 5)))


def on_circle(radius: float, angle: float) -> Point:
    """The lowest point of the rim lies at y = GAP."""
    return radius*math.cos(angle), GAP + R_OUTER + radius*math.sin(angle)


def circle(radius: float, k: int) -> Curve:
    """Way along piece k of the ring, counter-clockwise; its ends are those of the neighbours."""
    n = len(RING_CELLS)

    def place(s: float) -> Point:
        k_end = (k + round(s)) % n
        share = float(k_end) if s in (0.0, 1.0) else k + s
        return on_circle(radius, math.pi*((2.0*share - 1.0)/n - 0.5))

    return place


def ring() -> Body:
    body = Body(multiplier="<tie_multiplier>")
    n = len(RING_CELLS)
    for k, cells in enumerate(RING_CELLS):
        rim, inside = circle(R_OUTER, k), circle(R_INNER, k)
        body.add(f"RING{k + 1}", cells, rim, line(rim(1.0), inside(1.0)), inside,
                 line(rim(0.0), inside(0.0)))
    for k in range(n):
        here, there = f"RING{k + 1}", f"RING{(k + 1) % n + 1}"
        if RING_CELLS[k][1] > RING_CELLS[(k + 1) % n][1]:
            body.join(here, "EAST", there, "WEST")
        else:
            body.join(there, "WEST", here, "EAST")
    return body


def foundation(first: tuple[int, int]) -> Body:
    body = Body(first=first, multiplier="<tie_multiplier>")
    left, (bottom, top) = BLOCK_CORNER[0], (BLOCK_CORNER[1], BLOCK_CORNER[1] + BLOCK_SIZE[1])
    for k, (right, cells) in enumerate(BLOCKS):
        body.add(f"BLOCK{k + 1}", cells, line((left, bottom), (right, bottom)),
                 line((right, bottom), (right, top)), line((left, top), (right, top)),
                 line((left, bottom), (left, top)))
        left = right
    body.join("BLOCK2", "WEST", "BLOCK1", "EAST")
    body.join("BLOCK2", "EAST", "BLOCK3", "WEST")
    return body


def heading_text(wheel: Body, ground: Body) -> str:
    sector = 2.0*math.pi/len(RING_CELLS)
    area = sum(0.5*n*math.sin(sector/n)*(R_OUTER**2 - R_INNER**2) for n, _ in RING_CELLS)
    mass = DENSITY*area
    px, py = (mass*v for v in VELOCITY)
    energy = 0.5*mass*(VELOCITY[0]**2 + VELOCITY[1]**2)
    return f"""
Impact of an elastic ring on a stiff elastic foundation, both of tied pieces with unlike meshes.

The scene of ring.inp (make_ring.py): same bodies, materials, speeds, contact and time. The ring
is cut in six along radial lines, the foundation in three along upright ones; pieces of the ring
{wheel.counts()}, of the foundation
{ground.counts()} elements (ring.inp: 64 x 4 and 60 x 5). The contact surfaces
are those of the whole bodies: they run across the interfaces.
Units: any consistent set (length L, mass M, time T; stress M/(L T^2), thickness 1 L).

What to look at: the ring flattens, slides and rebounds like the one of one piece.
The total energy is held through contact and release.

Expected: total energy {energy:.6g} throughout; ring mass {mass:.6g};
          ring momentum ({px:.6g}, {py:.6g}) before contact;
          after release within 1 percent of that of ring.inp.

Made by make_tied_ring.py. Change a parameter for one run: emcon run tied_ring.inp --set h=0.005
with mortar contact: --set formulation=MORTAR
"""


def model_lines(wheel: Body, ground: Body) -> list[str]:
    """Sets and surfaces of the whole bodies. The rim of the ring is the south of its pieces."""
    lines = []
    for kind in ("NSET", "ELSET"):
        for name, body in (("RING", wheel), ("BLOCK", ground)):
            lines += [f"*{kind}, {kind}={name}", ", ".join(body.piece)]
    bottom = [label for piece in ground.piece.values() for label in piece.nodes("SOUTH")]
    top = [label for piece in ground.piece.values() for label in piece.elements("NORTH")]
    rim = [label for piece in wheel.piece.values() for label in piece.elements("SOUTH")]
    return (lines + set_lines("NSET", "BOTTOM", bottom) + surface_lines("BLOCK_TOP", "S3", top)
            + surface_lines("RING_OUTER", "S1", rim))


def main() -> None:
    options = arguments(__doc__).parse_args()
    wheel = ring()
    ground = foundation((max(wheel.places()) + 1,
                         1 + sum(len(part.element) for part in wheel.parts())))
    lines = heading(heading_text(wheel, ground)) + ["**"] + parameter_lines(points=4)
    lines += ["tie_multiplier = DUAL"]
    lines += comment("Ring: six pieces, radial line by radial line, counter-clockwise, each from "
                     "the rim inwards") + wheel.mesh_lines()
    lines += comment("Foundation: three pieces, column by column from the left, each from the "
                     "bottom up") + ground.mesh_lines()
    lines += comment("Sets and surfaces") + model_lines(wheel, ground)
    lines += comment("Ties") + wheel.tie_lines() + ground.tie_lines()
    for title, text in (("Materials", MATERIALS), ("Contact, supports, start", CONTACT),
                        ("The run", STEP)):
        lines += comment(title) + text.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
