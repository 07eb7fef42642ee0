"""Bodies that are cut into structured pieces of unlike meshes and tied together again.

Beside `deckwriter.py`, for the generators `make_tied_*.py` of this folder; plain Python.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

from deckwriter import Grid, Part, Point, add_grid, surface_lines

#: Point at the share s = 0..1 of its way.
Curve = Callable[[float], Point]

#: Sides of a piece, counter-clockwise, and the faces of its elements there.
FACE = {"SOUTH": "S1", "EAST": "S2", "NORTH": "S3", "WEST": "S4"}


def line(a: Point, b: Point) -> Curve:
    """Straight from a to b; the ends are those points to the last bit."""
    return lambda s: ((1.0 - s)*a[0] + s*b[0], (1.0 - s)*a[1] + s*b[1])


def arc(a: Point, b: Point, rise: float) -> Curve:
    """Arc of a circle from a to b; `rise` is its height over the chord, positive on its left."""
    if rise == 0.0:
        return line(a, b)
    chord = math.hypot(b[0] - a[0], b[1] - a[1])
    half = 2.0*math.atan(2.0*rise/chord)               # half of its angle, with the sign of rise
    radius = 0.5*chord/math.sin(half)
    along = ((b[0] - a[0])/chord, (b[1] - a[1])/chord)

    def point(s: float) -> Point:
        if s in (0.0, 1.0):
            return a if s == 0.0 else b
        angle = half*(2.0*s - 1.0)
        x = 0.5*chord + radius*math.sin(angle)
        y = radius*(math.cos(angle) - math.cos(half))
        return a[0] + x*along[0] - y*along[1], a[1] + x*along[1] + y*along[0]

    return point


@dataclass
class Piece:
    """One subdomain: i runs from WEST to EAST, j from SOUTH to NORTH."""

    part: Part
    grid: Grid

    def nodes(self, side: str) -> list[int]:
        """Labels along a side, with growing i or j."""
        return _side(self.grid.node, side)

    def elements(self, side: str) -> list[int]:
        return _side(self.grid.element, side)

    def surface(self, side: str) -> str:
        return f"{self.part.name}_{side}"


def _side(label: list[list[int]], side: str) -> list[int]:
    if side in ("EAST", "WEST"):
        return label[-1 if side == "EAST" else 0]
    return [column[-1 if side == "NORTH" else 0] for column in label]


@dataclass
class Body:
    """Pieces with labels from `first` on, one after the other, and the ties between their sides."""

    first: tuple[int, int] = (1, 1)                    # node, element
    multiplier: str = "<multiplier>"                   # of *TIE
    piece: dict[str, Piece] = field(default_factory=dict)
    tie: list[tuple[str, str, str, str]] = field(default_factory=list)

    def add(self, name: str, cells: tuple[int, int], south: Curve, east: Curve, north: Curve,
            west: Curve) -> None:
        """Fill four curves with a grid. South and north lead east, west and east lead north."""
        n_i, n_j = cells

        def place(i: int, j: int) -> Point:
            r, s = i/n_i, j/n_j
            if j in (0, n_j):
                return south(r) if j == 0 else north(r)
            if i in (0, n_i):
                return west(s) if i == 0 else east(s)
            return _inside(r, s, south, east, north, west)

        part = Part(name)
        before = self.piece.values()
        first = (self.first[0] + sum(len(piece.part.node) for piece in before),
                 self.first[1] + sum(len(piece.part.element) for piece in before))
        self.piece[name] = Piece(part, add_grid(part, cells, place, first=first))

    def join(self, slave: str, slave_side: str, master: str, master_side: str) -> None:
        """Tie a side of one piece to a side of another."""
        self.tie.append((slave, slave_side, master, master_side))

    def parts(self) -> Iterator[Part]:
        return (piece.part for piece in self.piece.values())

    def places(self) -> dict[int, Point]:
        return {label: x for part in self.parts() for label, x in part.node.items()}

    def outer_nodes(self, sides: Iterable[tuple[str, str]]) -> list[int]:
        """Labels on some sides (piece, side), each once, ascending."""
        return sorted({label for name, side in sides for label in self.piece[name].nodes(side)})

    def counts(self) -> str:
        """Text of the meshes: `4 x 3, 5 x 4`."""
        return ", ".join(f"{len(piece.grid.element)} x {len(piece.grid.element[0])}"
                         for piece in self.piece.values())

    def mesh_lines(self) -> list[str]:
        return [text for part in self.parts()
                for text in part.node_lines() + part.element_lines()]

    def tie_lines(self) -> list[str]:
        """Surfaces of the ties, each once, and `*TIE`."""
        lines, known, cards = [], set(), []
        for slave, slave_side, master, master_side in self.tie:
            names = []
            for name, side in ((slave, slave_side), (master, master_side)):
                piece = self.piece[name]
                names.append(piece.surface(side))
                if names[-1] not in known:
                    lines += surface_lines(names[-1], FACE[side], piece.elements(side))
                known.add(names[-1])
            cards += [f"*TIE, NAME={slave}_{master}, MULTIPLIER={self.multiplier}",
                      ", ".join(names)]
        return lines + cards

    def section_lines(self, material: str) -> list[str]:
        return [text for part in self.parts()
                for text in (f"*SOLID SECTION, ELSET={part.name}, MATERIAL={material}", "1.")]

    def slave_ends(self) -> set[int]:
        """First and last nodes of the slave sides."""
        ends: set[int] = set()
        for slave, side, _, _ in self.tie:
            nodes = self.piece[slave].nodes(side)
            ends |= {nodes[0], nodes[-1]}
        return ends


def _inside(r: float, s: float, south: Curve, east: Curve, north: Curve, west: Curve) -> Point:
    """Coons's patch."""
    corner = (south(0.0), south(1.0), north(0.0), north(1.0))
    weight = ((1.0 - r)*(1.0 - s), r*(1.0 - s), (1.0 - r)*s, r*s)
    a, b, c, d = south(r), north(r), west(s), east(s)
    x, y = ((1.0 - s)*a[k] + s*b[k] + (1.0 - r)*c[k] + r*d[k]
            - sum(w*p[k] for w, p in zip(weight, corner, strict=True)) for k in (0, 1))
    return x, y


def quarters(corner: Point, size: Point, cross: Point, rise: float,
             cells: dict[str, tuple[int, int]]) -> Body:
    """A rectangle in 2 x 2 pieces SW, SE, NE, NW that meet in `cross`; without ties.

    rise      of the four interfaces from the middles of the sides to the cross, turned alike
    cells     of the pieces, along x and y
    """
    x0, y0 = corner
    x1, y1 = x0 + size[0], y0 + size[1]
    xm, ym = x0 + 0.5*size[0], y0 + 0.5*size[1]
    sw, se, ne, nw = (x0, y0), (x1, y0), (x1, y1), (x0, y1)
    s, e, n, w = (xm, y0), (x1, ym), (xm, y1), (x0, ym)
    # Seen from the cross the four turn the same way.
    arm_s, arm_e = arc(s, cross, -rise), arc(cross, e, rise)
    arm_n, arm_w = arc(cross, n, rise), arc(w, cross, -rise)
    body = Body()
    body.add("SW", cells["SW"], line(sw, s), arm_s, arm_w, line(sw, w))
    body.add("SE", cells["SE"], line(s, se), line(se, e), arm_e, arm_s)
    body.add("NE", cells["NE"], arm_e, line(e, ne), line(n, ne), arm_n)
    body.add("NW", cells["NW"], arm_w, arm_n, line(nw, n), line(w, nw))
    return body


def join_quarters(body: Body, slaves: tuple[str, str, str, str]) -> None:
    """Ties of `quarters`; `slaves` are those of the interfaces south, east, north, west."""
    sides = ((("SW", "EAST"), ("SE", "WEST")), (("SE", "NORTH"), ("NE", "SOUTH")),
             (("NE", "WEST"), ("NW", "EAST")), (("NW", "SOUTH"), ("SW", "NORTH")))
    for slave, (one, other) in zip(slaves, sides, strict=True):
        if slave == one[0]:
            body.join(*one, *other)
        else:
            body.join(*other, *one)
