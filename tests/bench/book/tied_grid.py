"""Decks of a square of m x m tied pieces, held on its left side and pulled at a corner."""

import dataclasses
import sys

from scene_tools import DECKS

sys.path.insert(0, str(DECKS))

from deckwriter import number, set_lines  # noqa: E402
from tied_parts import Body, line  # noqa: E402

LAWS = {"linear": "*ELASTIC", "hyperelastic": "*HYPERELASTIC, COUPLED NEO HOOKE"}


@dataclasses.dataclass(frozen=True)
class Grid:
    """A square in `m` x `m` pieces, cells of a piece `coarse` or `fine` squared in turn.

    The finer side of an interface is the slave. One piece: a mesh without ties.
    """

    m: int
    coarse: int
    fine: int
    side: float = 1.0

    def body(self):
        body = Body()
        at = [self.side*k/self.m for k in range(self.m + 1)]
        for p in range(self.m):
            for q in range(self.m):
                n = self.cells(p, q)
                sw, se = (at[p], at[q]), (at[p + 1], at[q])
                nw, ne = (at[p], at[q + 1]), (at[p + 1], at[q + 1])
                body.add(f"P{p}_{q}", (n, n), line(sw, se), line(se, ne), line(nw, ne),
                         line(sw, nw))
        for p in range(self.m):
            for q in range(self.m):
                if p + 1 < self.m:
                    self.join(body, (p, q), "EAST", (p + 1, q), "WEST")
                if q + 1 < self.m:
                    self.join(body, (p, q), "NORTH", (p, q + 1), "SOUTH")
        return body

    def cells(self, p, q):
        return self.fine if (p + q)%2 else self.coarse

    def join(self, body, one, side, other, other_side):
        pair = [(f"P{p}_{q}", s, self.cells(p, q)) for (p, q), s in
                ((one, side), (other, other_side))]
        master, slave = sorted(pair, key=lambda entry: entry[2])
        body.join(*slave[:2], *master[:2])

    def lines(self, law, step):
        """A deck with the parameters of PARAMETERS; `step` is what follows the materials."""
        body = self.body()
        left = [text for q in range(self.m)
                for text in set_lines("NSET", "LEFT", body.piece[f"P0_{q}"].nodes("WEST"))]
        corner = body.piece[f"P{self.m - 1}_{self.m - 1}"].nodes("NORTH")[-1]
        return [
            "*HEADING", "Tied pieces", *PARAMETERS, *body.mesh_lines(), *body.tie_lines(),
            *left, *set_lines("NSET", "CORNER", [corner]),
            "*MATERIAL, NAME=SOLID", LAWS[law], "<young>, 0.3", "*DENSITY", "<density>",
            *body.section_lines("SOLID"), *step,
        ]  # fmt: skip

    def write(self, path, law, step):
        path.write_text("\n".join(self.lines(law, step)) + "\n")
        return path


PARAMETERS = [
    "*PARAMETER", "h = 0.01", "t_end = 0.01", f"young = {number(100)}", f"density = {number(1)}",
    "load = 0.01", "multiplier = DUAL", "method = NULL SPACE",
]  # fmt: skip

HELD_AND_PULLED = [
    "*CONSTRAINT METHOD, TYPE=<method>", "*BOUNDARY", "LEFT, 1, 2", "*CLOAD", "CORNER, 2, <load>",
    "*NODE FILE, FREQUENCY=1000000", "U", "*END STEP",
]  # fmt: skip

#: A linear static step, and motion at large deformation from rest.
STATIC = ["*STEP", "*STATIC", "1., 1.", *HELD_AND_PULLED]
DYNAMIC = ["*STEP, NLGEOM", "*DYNAMIC, DIRECT", "<h>, <t_end>", *HELD_AND_PULLED]
