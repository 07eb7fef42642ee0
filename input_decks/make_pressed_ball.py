"""Deck of an elastic ball pressed on its like, or on a rigid plane: Hertz in statics.

    python3 make_pressed_ball.py --output pressed_ball.inp
    python3 make_pressed_ball.py --plane --cells 6 --output pressed_plane.inp
    python3 make_pressed_ball.py --mortar --output pressed_mortar.inp
"""

from __future__ import annotations

from balls import OUTER_FACE, add_quarter
from deckwriter import Part, arguments, comment, heading, number, set_lines, write_deck
from make_hertz_ball import MODULUS, POISSON, RADIUS, STIFFNESS, plane_part

#: Radius of the contact, of a ball of radius 1; the gap at the start, as a part of the approach.
CONTACT, GAP = 0.05, 0.01

HEADING = """
Hertz in statics: an elastic ball is pressed on {what}, a quarter is modelled, linear elastic.

Balls of radius 1, E = 1e4, nu = 0.3, {cells} equal cells of C3D8 over the radius of the contact.
Planes of symmetry x = 0 and y = 0. The middle plane of the upper ball moves down.
Units: any consistent set (length L, force F; stress F/L^2).

Expected: (Hertz) for the force P that is found, radius of the contact (3 P R/(4 E*))^(1/3) and
          largest pressure 3 P/(2 pi a^2), with R = {radius:g} and E* = {stiffness:.6g}.

Made by make_pressed_ball.py. Change a parameter for one run: --set push=-0.001
"""

MODEL = """
*MATERIAL, NAME=BALL
*ELASTIC
{modulus}, {poisson}
*SOLID SECTION, ELSET=UPPER, MATERIAL=BALL
*SOLID SECTION, ELSET={lower}, MATERIAL=BALL
*SURFACE, NAME=ROUND, TYPE=ELEMENT
UPPER_RIM, {face}
*SURFACE, NAME=FLOOR, TYPE=ELEMENT
{floor}
*SURFACE INTERACTION, NAME=SMOOTH
*CONTACT PAIR, INTERACTION=SMOOTH{kind}
ROUND, FLOOR
*BOUNDARY
X0, 1
Y0, 2
"""

STEP = """
*STEP
*STATIC
0.25, 1.
*BOUNDARY
HIGH, 3, 3, <push>
*NODE FILE
U, RF
*EL FILE
S
*CONTACT FILE
{asked}
*END STEP
"""


def middle(part: Part, height: float) -> list[int]:
    """Nodes of the plane through the centre of a ball."""
    return [k for k, x in part.node.items() if abs(x[2] - height) < 1e-9*RADIUS]


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--plane", action="store_true", help="one ball, on a rigid plane")
    parser.add_argument("--mortar", action="store_true", help="contact in the mean, with pressures")
    parser.add_argument("--cells", type=int, default=3, help="over the radius of the contact")
    options = parser.parse_args()
    pair = not options.plane
    radius, stiffness = (RADIUS/2, STIFFNESS/2) if pair else (RADIUS, STIFFNESS)
    depth = CONTACT**2/radius
    gap = GAP*depth
    upper = Part("UPPER")
    rim = add_quarter(upper, RADIUS, (0.0, 0.0, RADIUS + gap), CONTACT, options.cells)
    first = max(upper.node) + 1, max(upper.element) + 1
    lines = heading(HEADING.format(
        what="another one" if pair else "a rigid plane", cells=options.cells,
        radius=radius, stiffness=stiffness)) + ["**", "*PARAMETER", f"push = {number(-depth - gap)}"]
    sets = set_lines("ELSET", "UPPER_RIM", rim) + set_lines(
        "NSET", "HIGH", middle(upper, RADIUS + gap))
    if pair:
        lower = Part("LOWER")
        other = add_quarter(lower, RADIUS, (0.0, 0.0, -RADIUS), 1.15*CONTACT, options.cells, first,
                            up=-1)
        floor, held = f"LOWER_RIM, {OUTER_FACE}", middle(lower, -RADIUS)
        sets += set_lines("ELSET", "LOWER_RIM", other)
        bodies = (upper, lower)
    else:
        lower = plane_part(first, RADIUS)
        floor, held, bodies = "PLANE, S2", list(lower.node), (upper,)
    for part in (upper, lower):
        lines += part.node_lines() + part.element_lines()
    sets += set_lines("NSET", "LOW", held)
    for axis, name in enumerate(("X0", "Y0")):
        sets += set_lines("NSET", name, (k for part in bodies for k, x in part.node.items()
                                         if x[axis] == 0.0))
    lines += sets + comment("Material, contact, supports") + MODEL.strip().format(
        modulus=number(MODULUS), poisson=number(POISSON), lower=lower.name, floor=floor,
        face=OUTER_FACE, kind=", TYPE=MORTAR" if options.mortar else "").splitlines()
    lines += ["LOW, 3" if pair else "LOW, 1, 3"]
    lines += comment("The run") + STEP.strip().format(
        asked="CF, CSTRESS" if options.mortar else "CF").splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
