"""Parts that several scenes of contact share: discs, motions, moments, cards of the formulation.

Beside `deckwriter.py`, for the generators `make_*.py` of this folder; plain Python.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from deckwriter import Grid, Part, Point, add_grid, number

#: What the step says about contact; the parameters are those of `contact_parameters`.
CONTACT_CARDS = """
*MORTAR, INTEGRATION=<integration>, POINTS=<points>, MULTIPLIER=<multiplier>, NORMAL=<normal>
*SURFACE SMOOTHING, TYPE=<smoothing>
"""

#: The step of bodies without supports: dynamics, fields for pictures, totals of the contact.
FREE_STEP = f"""
*STEP, NLGEOM, INC=1000000
*DYNAMIC, DIRECT
<h>, <t_end>
*CONSTRAINT METHOD, TYPE=<method>
*CONTACT INITIATION, TYPE=<initiation>
*NEWTON, TOLERANCE=<tolerance>
{CONTACT_CARDS.strip()}
*NODE FILE, TIME POINTS=FRAMES
U, V
*EL FILE, TIME POINTS=FRAMES
S, ENER
*CONTACT FILE, TIME POINTS=FRAMES
CDIS, CSTR, CF
*CONTACT PRINT, TOTALS=ONLY
CF
*END STEP
"""


def contact_parameters(formulation: str = "MORTAR", sides: str = "AUTO", points: int = 4) -> str:
    """Lines of `*PARAMETER` that choose the formulation of contact; see docs/deck.md."""
    return f"""
formulation = {formulation}
sides = {sides}
multiplier = DUAL
normal = NODAL
integration = SEGMENTS
points = {points}
smoothing = NONE
"""


@dataclass
class Motion:
    """A velocity linear in the position: translation, spin and stretch about a centre."""

    centre: Point
    velocity: Point = (0.0, 0.0)
    spin: float = 0.0              # angular velocity, counter-clockwise
    stretch: float = 0.0           # rate along x, and of shortening along y

    def at(self, x: float, y: float) -> Point:
        dx, dy = x - self.centre[0], y - self.centre[1]
        return (self.velocity[0] - self.spin*dy + self.stretch*dx,
                self.velocity[1] + self.spin*dx - self.stretch*dy)


def velocity_lines(part: Part, field: Callable[[float, float], Point]) -> list[str]:
    """`*INITIAL CONDITIONS` for each node of the part; zeros are left out."""
    lines = ["*INITIAL CONDITIONS, TYPE=VELOCITY"]
    for label, (x, y) in part.node.items():
        for axis, value in enumerate(field(x, y), start=1):
            if value != 0.0:
                lines.append(f"{label}, {axis}, {number(value)}")
    return lines


@dataclass
class Momenta:
    """Mass, momenta (lz about the origin) and kinetic energy."""

    mass: float = 0.0
    px: float = 0.0
    py: float = 0.0
    lz: float = 0.0
    kinetic: float = 0.0

    def __add__(self, other: Momenta) -> Momenta:
        return Momenta(self.mass + other.mass, self.px + other.px, self.py + other.py,
                       self.lz + other.lz, self.kinetic + other.kinetic)


def momenta(part: Part, density: float, field: Callable[[float, float], Point]) -> Momenta:
    """Of a part whose nodal velocities are those of `field`, as four-node elements carry them.

    Velocity and position are bilinear over an element, so 3 x 3 points are exact.
    """
    point = ((-math.sqrt(0.6), 5.0/9.0), (0.0, 8.0/9.0), (math.sqrt(0.6), 5.0/9.0))
    total = Momenta()
    for nodes in part.element.values():
        x = [part.node[label] for label in nodes]
        v = [field(*p) for p in x]
        for r, wr in point:
            for s, ws in point:
                n = ((1 - r)*(1 - s)/4, (1 + r)*(1 - s)/4, (1 + r)*(1 + s)/4, (1 - r)*(1 + s)/4)
                dr = ((s - 1)/4, (1 - s)/4, (1 + s)/4, (-1 - s)/4)
                ds = ((r - 1)/4, (-1 - r)/4, (1 + r)/4, (1 - r)/4)
                det = (_sum(dr, x, 0)*_sum(ds, x, 1) - _sum(dr, x, 1)*_sum(ds, x, 0))
                m = density*det*wr*ws
                px, py = _sum(n, x, 0), _sum(n, x, 1)
                vx, vy = _sum(n, v, 0), _sum(n, v, 1)
                total += Momenta(m, m*vx, m*vy, m*(px*vy - py*vx), 0.5*m*(vx*vx + vy*vy))
    return total


def _sum(weights: Iterable[float], points: Iterable[Point], axis: int) -> float:
    return math.fsum(w*p[axis] for w, p in zip(weights, points, strict=True))


def momenta_text(total: Momenta) -> str:
    """Figures of a heading."""
    return (f"mass {total.mass:.12g}; total energy {total.kinetic:.12g}, all kinetic;\n"
            f"          px = {total.px:.12g}, py = {total.py:.12g}, lz = {total.lz:.12g}")


def add_disc(part: Part, centre: Point, radius: float, cells: tuple[int, int],
             first: tuple[int, int] = (1, 1), turn: float = 0.0) -> Grid:
    """Add a disc of four-node elements: a square of n x n cells inside, 4n x m around it.

    cells     n, m
    turn      angle by which the mesh is turned
    Returns the outer grid; its rim is face S1, counter-clockwise.
    """
    n, m = cells
    half = 0.45*radius

    def square(i: int, j: int) -> Point:
        """Point of the square: bulged, so that the corners of the elements stay open."""
        s, t = 2.0*i/n - 1.0, 2.0*j/n - 1.0
        return (half*s*(1.0 + 0.28*(1.0 - t*t)), half*t*(1.0 + 0.28*(1.0 - s*s)))

    def border(k: int) -> tuple[int, int]:
        """Grid point of the square at place k of its border, from the lower left corner on."""
        side, i = divmod(k % (4*n), n)
        return ((i, 0), (n, i), (n - i, n), (0, n - i))[side]

    def place(x: float, y: float) -> Point:
        c, s = math.cos(turn), math.sin(turn)
        return centre[0] + c*x - s*y, centre[1] + s*x + c*y

    def around(k: int, j: int) -> Point:
        angle = math.pi*(2*k - 3*n)/(4*n)          # -135 degrees at the lower left corner
        inner, share = square(*border(k)), j/m
        return place((1.0 - share)*radius*math.cos(angle) + share*inner[0],
                     (1.0 - share)*radius*math.sin(angle) + share*inner[1])

    grid = add_grid(part, (4*n, m), around, first=first, closed=True)
    label = {border(k): grid.node[k][m] for k in range(4*n)}
    next_node, next_element = first[0] + 4*n*(m + 1), first[1] + 4*n*m
    for i in range(1, n):
        for j in range(1, n):
            label[i, j] = next_node
            part.node[next_node] = place(*square(i, j))
            next_node += 1
    for i in range(n):
        for j in range(n):
            part.element[next_element] = (label[i, j], label[i + 1, j],
                                          label[i + 1, j + 1], label[i, j + 1])
            next_element += 1
    return grid
