"""Balls of bricks: whole ones, and quarters whose cells grow away from a contact at the lower pole.

Beside `deckwriter.py`, for the generators `make_*.py` of this folder; plain Python.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product

from deckwriter import Part, Point

Map = Callable[[float, float, float], Point]

#: Half width of the cube inside a ball of radius 1, and how far its sides are bulged: 1 is a ball.
CORE, BULGE = 0.45, 0.45
#: Corners of a brick in the order of C3D8; face S2 is the one of the greatest k.
CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
OUTER_FACE = "S2"


def ends(x: Point) -> tuple[Point, Point]:
    """Of the ray through a point of the surface of the cube [-1, 1]^3: on inner cube and ball."""
    warped = [math.tan(math.pi/4.0*a) for a in x]
    length = math.sqrt(sum(a*a for a in warped))
    outer = tuple(a/length for a in warped)
    return tuple(CORE*((1.0 - BULGE)*a + BULGE*1.3*b) for a, b in zip(x, outer)), outer


def shell(x: Point, share: float) -> Point:
    """`share` of the way from the inner cube to the ball of radius 1."""
    inner, outer = ends(x)
    return tuple((1.0 - share)*a + share*b for a, b in zip(inner, outer))


def core(x: float, y: float, z: float) -> Point:
    """A point of the inner cube; towards its sides more and more as these are bulged."""
    most = max(abs(x), abs(y), abs(z))
    if most == 0.0:
        return (0.0, 0.0, 0.0)
    bulged = ends((x/most, y/most, z/most))[0]
    return tuple((1.0 - most)*CORE*a + most*most*b for a, b in zip((x, y, z), bulged))


class Bricks:
    """Blocks of bricks in `part`; points of blocks that meet are one node."""

    def __init__(self, part: Part, first: tuple[int, int], place: Callable[[Point], Point]) -> None:
        self.part, self.place = part, place
        self.next_node, self.next_element = first
        self.label_at: dict[tuple[int, ...], int] = {}
        #: Elements with a side on the ball, OUTER_FACE.
        self.outer: list[int] = []

    def label(self, x: Point) -> int:
        """Of the node at a point of the ball of radius 1, whose round-off does not matter."""
        key = tuple(round(a*1e8) for a in x)
        if key not in self.label_at:
            self.label_at[key] = self.next_node
            self.part.node[self.next_node] = self.place(tuple(k and a for k, a in zip(key, x)))
            self.next_node += 1
        return self.label_at[key]

    def block(self, cells: tuple[int, int, int], where: Map, outer: bool = False) -> None:
        """Bricks of [0, 1]^3 as `where` maps it; `outer`: the last layer of k is on the ball."""
        if _volume([self.place(where(*(a/n for a, n in zip(c, cells)))) for c in CORNERS]) < 0.0:
            self.block((cells[1], cells[0], cells[2]), lambda a, b, c: where(b, a, c), outer)
            return
        for cell in product(*map(range, cells)):
            nodes = (self.label(where(*((a + b)/n for a, b, n in zip(cell, corner, cells))))
                     for corner in CORNERS)
            self.part.element[self.next_element] = tuple(nodes)
            if outer and cell[2] == cells[2] - 1:
                self.outer.append(self.next_element)
            self.next_element += 1


def _volume(x: list[Point]) -> float:
    """Of the edges at the first corner, which tells how a brick is turned."""
    a, b, c = (tuple(p - q for p, q in zip(x[k], x[0])) for k in (1, 3, 4))
    return (a[0]*(b[1]*c[2] - b[2]*c[1]) + a[1]*(b[2]*c[0] - b[0]*c[2])
            + a[2]*(b[0]*c[1] - b[1]*c[0]))


def _side(bricks: Bricks, axis: int, sign: int, least: tuple[int, int, int],
          cells: tuple[int, int, int], layers: int) -> None:
    """The block between a side of the inner cube and the ball."""
    one, two = (k for k in range(3) if k != axis)

    def where(a: float, b: float, share: float) -> Point:
        x = [0.0, 0.0, 0.0]
        x[axis] = float(sign)
        x[one] = least[one] + (1 - least[one])*a
        x[two] = least[two] + (1 - least[two])*b
        return shell(tuple(x), share)

    bricks.block((cells[one], cells[two], layers), where, outer=True)


def _cube(bricks: Bricks, least: tuple[int, int, int], cells: tuple[int, int, int]) -> None:
    bricks.block(cells, lambda *at: core(*(low + (1 - low)*a for low, a in zip(least, at))))


def add_ball(part: Part, radius: float, centre: Point, cells: tuple[int, int],
             first: tuple[int, int] = (1, 1)) -> list[int]:
    """Add a ball of eight-node elements; returns those with a side, OUTER_FACE, on its surface.

    cells     n, m: n^3 in the cube inside, m layers around it
    """
    bricks = Bricks(part, first, _placed(radius, centre, 1))
    least, each = (-1, -1, -1), (cells[0],)*3
    _cube(bricks, least, each)
    for axis, sign in product(range(3), (-1, 1)):
        _side(bricks, axis, sign, least, each, cells[1])
    return bricks.outer


def add_quarter(part: Part, radius: float, centre: Point, fine: float, cells: int,
                first: tuple[int, int] = (1, 1), up: int = 1) -> list[int]:
    """Add the quarter x >= 0, y >= 0 of a ball; returns the elements at its surface, as `add_ball`.

    fine      cells of one size reach that far along x and y from the lower pole
    cells     how many of them in each direction
    up        -1 turns the lower pole up
    """
    bricks = Bricks(part, first, _placed(radius, centre, up))
    least, each = (0, 0, -1), (cells, cells, max(cells - cells % 2, 2))
    _cube(bricks, least, each)
    for axis, sign in ((0, 1), (1, 1), (2, 1)):
        _side(bricks, axis, sign, least, each, cells)
    _graded(bricks, fine/radius, cells)
    return bricks.outer


def _graded(bricks: Bricks, fine: float, cells: int) -> None:
    """The block at the lower pole: a box of equal cells, and shells around it that grow outwards."""
    depth = 1.0 - math.hypot(*shell((0.0, 0.0, -1.0), 0.0))
    start = (fine/(math.pi/4.0), fine/depth)
    layers = max(1, round(math.log(1.0/start[0])/math.log(1.0 + 1.6/cells)))

    def reach(share: float) -> Point:
        """How far a shell reaches along the side and inwards."""
        return tuple(a**(1.0 - share) for a in start)

    def at(s: float, t: float, inwards: float) -> Point:
        return shell((s, t, -1.0), 1.0 - inwards)

    def beside(a: float, share: float, towards: float, flip: bool) -> Point:
        along, inwards = reach(share)
        s, t = (along, a*along)[::-1 if flip else 1]
        return at(s, t, (1.0 - towards)*inwards)

    def above(a: float, b: float, share: float) -> Point:
        along, inwards = reach(share)
        return at(a*along, b*along, inwards)

    bricks.block((cells,)*3, lambda a, b, c: at(a*start[0], b*start[0], (1.0 - c)*start[1]),
                 outer=True)
    for flip in (False, True):
        bricks.block((cells, layers, cells), lambda a, b, c, f=flip: beside(a, b, c, f),
                     outer=True)
    bricks.block((cells, cells, layers), above)


def _placed(radius: float, centre: Point, up: int) -> Callable[[Point], Point]:
    """`up` of -1 mirrors: the lower pole goes up."""
    return lambda x: tuple(c + radius*a for c, a in zip(centre, (x[0], x[1], up*x[2])))
