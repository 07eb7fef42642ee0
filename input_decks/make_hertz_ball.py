"""Deck of an elastic ball that hits a rigid plane: Hertz's law of impact, a quarter of the ball.

    python3 make_hertz_ball.py --output hertz_ball.inp
    python3 make_hertz_ball.py --cells 8 --output fine.inp
"""

from __future__ import annotations

import math

from balls import CORNERS, OUTER_FACE, add_quarter
from deckwriter import Part, arguments, comment, heading, number, set_lines, write_deck

RADIUS, MODULUS, POISSON, DENSITY = 1.0, 1.0e4, 0.3, 1.0
STIFFNESS = MODULUS/(1.0 - POISSON**2)
MASS = 4.0/3.0*math.pi*RADIUS**3*DENSITY
#: The plane reaches that far from the axis, and is that thick.
PLANE = 1.0

HEADING = """
Hertz's law of impact: an elastic ball hits a rigid plane; a quarter of the ball is modelled.

Ball of radius 1, E = 1e4, nu = 0.3, mass 4.18879 (the density makes up for what the flat sides of
the elements cut off), {cells} equal cells of C3D8 over the radius of the largest contact, larger ones
around them. Planes of symmetry x = 0 and y = 0. The plane is one element with all nodes held.
Units: any consistent set (length L, mass M, time T; stress M/(L T^2)).

What to look at: the force of the contact in the history of the pair, the velocity before and after.

Expected at speed {speed:g} (Hertz; the whole ball, a quarter has a quarter of the force):
          contact time {time:.6g}, largest force {force:.6g}, radius of the contact {radius:.6g}, approach {depth:.6g},
          impulse twice the momentum before the impact, less what remains as vibration, below 2e-3.

Made by make_hertz_ball.py. Change a parameter for one run: --set h=0.0005
"""

MODEL = """
*MATERIAL, NAME=BALL
*HYPERELASTIC, COUPLED NEO HOOKE
{modulus}, {poisson}
*DENSITY
{density}
*SOLID SECTION, ELSET=BALL, MATERIAL=BALL
*SOLID SECTION, ELSET=PLANE, MATERIAL=BALL
*SURFACE, NAME=LOWER, TYPE=ELEMENT
RIM, {face}
*SURFACE, NAME=FLOOR, TYPE=ELEMENT
PLANE, S2
*SURFACE INTERACTION, NAME=SMOOTH
*CONTACT PAIR, INTERACTION=SMOOTH
LOWER, FLOOR
*BOUNDARY
X0, 1
Y0, 2
PLANE, 1, 3
*INITIAL CONDITIONS, TYPE=VELOCITY
BALL, 3, {velocity}
*TIME POINTS, NAME=FRAMES, GENERATE
0., <t_end>, <frame>
"""

STEP = """
*STEP, NLGEOM, INC=1000000
*DYNAMIC, DIRECT
<h>, <t_end>
*CONTACT INITIATION, TYPE=<initiation>
*NODE FILE, TIME POINTS=FRAMES
U, V
*EL FILE, TIME POINTS=FRAMES
S
*NODE PRINT, NSET=PLANE, TOTALS=ONLY
RF
*END STEP
"""


def law(speed: float) -> dict[str, float]:
    """Hertz: 1/2 m v^2 = 8/15 E* sqrt(R) d^(5/2)."""
    depth = (15.0/16.0*MASS*speed**2/(STIFFNESS*math.sqrt(RADIUS)))**0.4
    return {"speed": speed, "depth": depth, "radius": math.sqrt(RADIUS*depth),
            "force": 4.0/3.0*STIFFNESS*math.sqrt(RADIUS)*depth**1.5,
            "time": 2.943276*depth/speed}


def volume(part: Part) -> float:
    """Of the bricks of a part, by eight points each."""
    place, total = 1.0/math.sqrt(3.0), 0.0
    sign = ((-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1),
            (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1))
    for nodes in part.element.values():
        x = [part.node[k] for k in nodes]
        for r in sign:
            f = [[1.0 + s[k]*r[k]*place for k in range(3)] for s in sign]
            d = [[0.125*s[k]*f[a][(k + 1) % 3]*f[a][(k + 2) % 3] for k in range(3)]
                 for a, s in enumerate(sign)]
            (a, b, c) = ([sum(d[m][k]*x[m][i] for m in range(8)) for i in range(3)]
                         for k in range(3))
            total += (a[0]*(b[1]*c[2] - b[2]*c[1]) + a[1]*(b[2]*c[0] - b[0]*c[2])
                      + a[2]*(b[0]*c[1] - b[1]*c[0]))
    return total


def plane_part(first: tuple[int, int], reach: float) -> Part:
    """One brick with its top at z = 0, wider than the contact."""
    plane = Part("PLANE")
    for k, (i, j, m) in enumerate(CORNERS):
        plane.node[first[0] + k] = (reach*(2.5*i - 1.0), reach*(2.5*j - 1.0), reach*(m - 1.0))
    plane.element[first[1]] = tuple(range(first[0], first[0] + 8))
    return plane


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--speed", type=float, default=0.1)
    parser.add_argument("--cells", type=int, default=3, help="over the radius of the contact")
    parser.add_argument("--increments", type=int, default=200, help="in the time of contact")
    options = parser.parse_args()
    expected = law(options.speed)
    h = expected["time"]/options.increments
    gap = 5.5*h*options.speed
    ball = Part("BALL")
    rim = add_quarter(ball, RADIUS, (0.0, 0.0, RADIUS + gap), expected["radius"], options.cells)
    plane = plane_part((max(ball.node) + 1, max(ball.element) + 1), PLANE)
    density = DENSITY*MASS/(4.0*volume(ball))

    lines = heading(HEADING.format(cells=options.cells, **expected)) + ["**"]
    lines += ["*PARAMETER", f"h = {number(h)}", f"t_end = {number(h*(options.increments + 20))}",
              f"frame = {number(h*(options.increments + 20)/10)}", "initiation = AUTO"]
    lines += comment("Ball and plane")
    for part in (ball, plane):
        lines += part.node_lines() + part.element_lines()
    lines += set_lines("ELSET", "RIM", rim)
    for axis, name in enumerate(("X0", "Y0")):
        lines += set_lines("NSET", name, (k for k, x in ball.node.items() if x[axis] == 0.0))
    lines += comment("Material, contact, supports") + MODEL.strip().format(
        modulus=number(MODULUS), poisson=number(POISSON), density=number(density), face=OUTER_FACE,
        velocity=number(-options.speed)).splitlines()
    lines += comment("The run") + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
