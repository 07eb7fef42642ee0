"""Deck of the patch test of ties: a square of pieces with unlike meshes under uniform stress.

    python3 make_tied_patch.py --output tied_patch.inp
    python3 make_tied_patch.py --interface THREE --load DISPLACEMENT --output three.inp
    python3 make_tied_patch.py --interface INCLINED --dynamic --output inclined.inp
"""

from __future__ import annotations

import argparse

from deckwriter import arguments, comment, heading, number, set_lines, write_deck
from tied_parts import FACE, Body, arc, join_quarters, line, quarters

SIZE = 2.0
YOUNG, POISSON, DENSITY = 1000.0, 0.3, 0.01
RISE = 0.25                    # of the curved interface
TEE = 0.9                      # where the upper pieces of THREE are parted

#: Displacement gradient of the uniform state, for NLGEOM; a hundredth of it without.
GRADIENT = {
    "DISPLACEMENT": ((0.06, 0.05), (-0.02, -0.08)),
    "TRACTION": ((-0.04, 0.0), (0.0, -0.09)),
    "ROLLERS": ((-0.04, 0.0), (0.0, -0.09)),
}

INTERFACE = {
    "STRAIGHT": "one straight interface",
    "INCLINED": "one inclined interface",
    "CURVED": "one interface along an arc",
    "THREE": "a straight interface below and one upright upon it: three pieces meet\nin one point, "
             "which is no node of the lower one",
    "FOUR": "four inclined interfaces that meet in one point",
}

LOAD = {
    "DISPLACEMENT": "All outer nodes are displaced linearly in the position.",
    "TRACTION": "Pressure {x:.6g} on the upright sides and {y:.6g} on the level ones; two corners "
                "held.",
    "ROLLERS": "Pressure {x:.6g} on the right and {y:.6g} on the top; rollers on the left and "
               "below.",
}


def two_pieces(kind: str) -> Body:
    h = 0.5*SIZE
    tilt = 0.2*SIZE if kind == "INCLINED" else 0.0
    left, right = (0.0, h - tilt), (SIZE, h + tilt)
    middle = arc(left, right, RISE if kind == "CURVED" else 0.0)
    body = Body()
    body.add("LOWER", (4, 3), line((0.0, 0.0), (SIZE, 0.0)), line((SIZE, 0.0), right), middle,
             line((0.0, 0.0), left))
    body.add("UPPER", (7, 4), middle, line(right, (SIZE, SIZE)), line((0.0, SIZE), (SIZE, SIZE)),
             line(left, (0.0, SIZE)))
    body.join("UPPER", "SOUTH", "LOWER", "NORTH")
    return body


def three_pieces() -> Body:
    h = 0.5*SIZE
    foot, head = (TEE, h), (TEE, SIZE)
    body = Body()
    body.add("LOWER", (5, 3), line((0.0, 0.0), (SIZE, 0.0)), line((SIZE, 0.0), (SIZE, h)),
             line((0.0, h), (SIZE, h)), line((0.0, 0.0), (0.0, h)))
    body.add("LEFT", (4, 4), line((0.0, h), foot), line(foot, head), line((0.0, SIZE), head),
             line((0.0, h), (0.0, SIZE)))
    body.add("RIGHT", (3, 5), line(foot, (SIZE, h)), line((SIZE, h), (SIZE, SIZE)),
             line(head, (SIZE, SIZE)), line(foot, head))
    body.join("LEFT", "SOUTH", "LOWER", "NORTH")
    body.join("RIGHT", "SOUTH", "LOWER", "NORTH")
    body.join("LEFT", "EAST", "RIGHT", "WEST")
    return body


def four_pieces() -> Body:
    body = quarters((0.0, 0.0), (SIZE, SIZE), (0.45*SIZE, 0.56*SIZE), 0.0,
                    {"SW": (4, 3), "SE": (5, 4), "NE": (3, 5), "NW": (6, 4)})
    join_quarters(body, ("SW", "SE", "NE", "NW"))
    return body


def body_of(interface: str) -> Body:
    if interface == "THREE":
        return three_pieces()
    return four_pieces() if interface == "FOUR" else two_pieces(interface)


class State:
    """The uniform state: u = H X, and the Cauchy stress of *ELASTIC."""

    def __init__(self, options: argparse.Namespace) -> None:
        scale = 0.01 if options.linear else 1.0
        (a, b), (c, d) = GRADIENT[options.load]
        self.gradient = ((scale*a, scale*b), (scale*c, scale*d))
        self.stress = self._linear() if options.linear else self._saint_venant()

    def displacement(self, x: float, y: float) -> tuple[float, float]:
        (a, b), (c, d) = self.gradient
        return a*x + b*y, c*x + d*y

    def _linear(self) -> tuple[float, float, float, float]:
        (a, b), (c, d) = self.gradient
        return _hooke(a, d, b + c)

    def _saint_venant(self) -> tuple[float, float, float, float]:
        """J sigma = F S F^T with S of Hooke's law in the Green-Lagrange strain."""
        (a, b), (c, d) = self.gradient
        xx, yy, zz, xy = _hooke(a + 0.5*(a*a + c*c), d + 0.5*(b*b + d*d), b + c + a*b + c*d)
        a, d = 1.0 + a, 1.0 + d
        volume = a*d - b*c
        return ((a*a*xx + 2.0*a*b*xy + b*b*yy)/volume, (c*c*xx + 2.0*c*d*xy + d*d*yy)/volume,
                zz/volume, (a*c*xx + (a*d + b*c)*xy + b*d*yy)/volume)


def _hooke(xx: float, yy: float, shear: float) -> tuple[float, float, float, float]:
    """Stress xx, yy, zz, xy in plane strain."""
    mu = 0.5*YOUNG/(1.0 + POISSON)
    lam = YOUNG*POISSON/((1.0 + POISSON)*(1.0 - 2.0*POISSON))
    volume = lam*(xx + yy)
    return 2.0*mu*xx + volume, 2.0*mu*yy + volume, volume, mu*shear


def heading_text(options: argparse.Namespace, body: Body, state: State) -> str:
    (a, b), (c, d) = state.gradient
    xx, yy, zz, xy = state.stress
    law = "linear elastic" if options.linear else "St. Venant-Kirchhoff (NLGEOM)"
    load = LOAD[options.load].format(x=-xx, y=-yy)
    way = "One static step."
    if options.dynamic:
        way = ("Dynamic: it moves at a uniform rate of strain." if options.load == "DISPLACEMENT"
               else "Dynamic: it starts in equilibrium, and stays.")
    return f"""
Patch test of ties: {len(body.piece)} pieces with unlike meshes, one uniform stress.

A square of side {SIZE:g} with {INTERFACE[options.interface]}.
Meshes {body.counts()}.
E = {YOUNG:g}, nu = {POISSON:g}, {law}, plane strain.
{load}
{way}
Units: any consistent set (force F, length L; stress F/L^2, thickness 1 L).

What to look at: the stress is the same everywhere, also beside the interfaces and in the
elements around a point where more than two pieces meet.

Expected at the end, to round-off: displacement gradient
          ux,x = {number(a)}, ux,y = {number(b)}, uy,x = {number(c)}, uy,y = {number(d)};
          stress xx = {number(xx)}, yy = {number(yy)},
          zz = {number(zz)}, xy = {number(xy)}

Made by make_tied_patch.py. Change a parameter for one run: --set multiplier=STANDARD
"""


def outer_sides(body: Body) -> list[tuple[str, str]]:
    """Pieces and those of their sides that belong to the square; they bear the same name there."""
    bound = {"SOUTH": (1, 0.0), "NORTH": (1, SIZE), "WEST": (0, 0.0), "EAST": (0, SIZE)}
    return [(name, side) for name, piece in body.piece.items() for side, (axis, value)
            in bound.items() if all(piece.part.node[k][axis] == value for k in piece.nodes(side))]


def load_lines(options: argparse.Namespace, body: Body, state: State) -> list[str]:
    """Cards inside the step."""
    if options.load == "DISPLACEMENT":
        place = body.places()
        lines = ["*BOUNDARY, AMPLITUDE=RAMP" if options.dynamic else "*BOUNDARY"]
        for label in body.outer_nodes(outer_sides(body)):
            lines += [f"{label}, {k}, {k}, {number(u)}"
                      for k, u in enumerate(state.displacement(*place[label]), start=1)]
        return lines
    lines = ["*DLOAD"]
    for name, side in outer_sides(body):
        pressure = -state.stress[0 if side in ("EAST", "WEST") else 1]
        if options.load == "TRACTION" or side in ("EAST", "NORTH"):
            lines += [f"{name}_{side}_EDGE, P{FACE[side][1]}, {number(pressure)}"]
    return lines


def set_up_lines(options: argparse.Namespace, body: Body) -> list[str]:
    """Sets, supports."""
    if options.load == "DISPLACEMENT":
        return []
    lines, held = [], []
    for name, side in outer_sides(body):
        edge = f"{name}_{side}_EDGE"
        if options.load == "ROLLERS" and side in ("WEST", "SOUTH"):
            lines += set_lines("NSET", edge, body.piece[name].nodes(side))
            held.append(f"{edge}, {1 if side == 'WEST' else 2}")
        else:
            lines += set_lines("ELSET", edge, body.piece[name].elements(side))
    if options.load == "TRACTION":
        corner = {x: label for label, x in body.places().items() if x[1] == 0.0}
        held = [f"{corner[0.0, 0.0]}, 1, 2", f"{corner[SIZE, 0.0]}, 2"]
    return [*lines, "*BOUNDARY", *held]


def start_lines(options: argparse.Namespace, body: Body, state: State) -> list[str]:
    """Dynamics: the velocity of the uniform rate of strain, or the strained state."""
    kind = "VELOCITY" if options.load == "DISPLACEMENT" else "DISPLACEMENT"
    lines = ["*AMPLITUDE, NAME=RAMP", "0., 0., 1., 1."] if kind == "VELOCITY" else []
    lines += [f"*INITIAL CONDITIONS, TYPE={kind}"]
    for label, x in body.places().items():
        lines += [f"{label}, {k}, {number(u)}"
                  for k, u in enumerate(state.displacement(*x), start=1)]
    return lines


PARAMETERS = """
*PARAMETER
multiplier = DUAL
method = NULL SPACE
tolerance = 1e-13
"""

MATERIAL = f"""
*MATERIAL, NAME=SOLID
*ELASTIC
{number(YOUNG)}, {number(POISSON)}
*DENSITY
{number(DENSITY)}
"""

OUTPUT = """
*NODE FILE
U, RF
*EL FILE
S, ENER
*END STEP
"""


def step_lines(options: argparse.Namespace) -> list[str]:
    procedure = ["*DYNAMIC, DIRECT", "0.1, 1."] if options.dynamic else ["*STATIC", "0.5, 1."]
    return ["*STEP" if options.linear else "*STEP, NLGEOM", *procedure,
            "*CONSTRAINT METHOD, TYPE=<method>", "*NEWTON, TOLERANCE=<tolerance>"]


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--interface", choices=INTERFACE, default="FOUR",
                        help="shape of the interfaces (default FOUR pieces)")
    parser.add_argument("--load", choices=LOAD, default="TRACTION",
                        help="how the uniform state is brought about (default TRACTION)")
    parser.add_argument("--swap", action="store_true", help="slaves for masters; not with THREE")
    parser.add_argument("--linear", action="store_true", help="without NLGEOM")
    parser.add_argument("--dynamic", action="store_true",
                        help="uniform rate of strain, or equilibrium that must stay")
    options = parser.parse_args()
    if options.swap and options.interface == "THREE":
        parser.error("--swap: the lower piece of THREE cannot be slave of two")
    body, state = body_of(options.interface), State(options)
    if options.swap:
        body.tie = [(master, its, slave, own) for slave, own, master, its in body.tie]

    lines = heading(heading_text(options, body, state)) + ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Pieces, each column by column from the left and from the bottom up")
    lines += body.mesh_lines()
    lines += comment("Ties") + body.tie_lines()
    lines += comment("Material") + MATERIAL.strip().splitlines() + body.section_lines("SOLID")
    if options.load != "DISPLACEMENT":
        lines += comment("Supports") + set_up_lines(options, body)
    if options.dynamic:
        lines += comment("Start") + start_lines(options, body, state)
    lines += comment("The step") + step_lines(options)
    lines += load_lines(options, body, state) + OUTPUT.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
