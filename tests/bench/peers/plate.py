"""A ball that hits an elastic plate in three dimensions, as decks for EMCON and for CalculiX."""

import dataclasses
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3]/"input_decks"))

import balls  # noqa: E402
import deckwriter  # noqa: E402
from peers.calculix import labels, number  # noqa: E402

YOUNG, NU, DENSITY = 1000., 0.3, 1.
VELOCITY = (1.0, 0.4, -2.0)
RADIUS, GAP = 1.0, 0.005
#: The plate: lengths, and its top at z = 0; its bottom is held.
SIZE = (3.0, 3.0, 0.8)
#: Pressure per penetration for CalculiX: twice the modulus over a length of one. From five times
#: on its iterations end in "solution seems to diverge" with these increments.
PENALTY = 2*YOUNG
#: Cells of the inner cube, layers around it, cells of the plate: about 20,000 unknowns.
MESH = ((8, 6), (20, 20, 6))


@dataclasses.dataclass
class Scene:
    ball: deckwriter.Part
    plate: deckwriter.Part
    outer: list            # elements of the ball with a side on its surface
    top: list              # elements of the plate under its top
    bottom: list           # nodes

    @property
    def unknowns(self):
        return 3*(len(self.ball.node) + len(self.plate.node) - len(self.bottom))


def scene(mesh=MESH):
    """The ball above the plate, a little apart."""
    ball = deckwriter.Part("BALL")
    outer = balls.add_ball(ball, RADIUS, (0.0, 0.0, RADIUS + GAP), mesh[0])
    box = deckwriter.Part("PLATE")
    deckwriter.add_bricks(box, mesh[1], SIZE)
    a, b = max(ball.node), max(ball.element)
    plate = deckwriter.Part("PLATE")
    plate.node = {a + k: (x, y, z - 0.5*SIZE[2]) for k, (x, y, z) in box.node.items()}
    plate.element = {b + k: tuple(a + n for n in nodes) for k, nodes in box.element.items()}
    height = {k: x[2] for k, x in plate.node.items()}
    top = [k for k, nodes in plate.element.items() if all(height[n] > -1e-9 for n in nodes[4:])]
    return Scene(ball, plate, outer, top,
                 [k for k, z in height.items() if z < -SIZE[2] + 1e-9])


def deck(it, h, increments, peer=False):
    """Its text: hard contact of nodes, or the penalty of CalculiX (`peer`)."""
    lines = ["*HEADING", "A ball on a plate"]
    for part in (it.ball, it.plate):
        lines += [re.sub(r"[^, ]+\.[^, ]*", lambda x: number(x[0]), line) if peer else line
                  for line in part.node_lines()] + part.element_lines()
    lines += [*labels("*NSET, NSET=BOTTOM", it.bottom), *labels("*ELSET, ELSET=TOP", it.top),
              *labels("*ELSET, ELSET=OUTER", it.outer),
              "*SURFACE, NAME=MASTER, TYPE=ELEMENT", "TOP, S2",
              "*SURFACE, NAME=SLAVE, TYPE=ELEMENT", "OUTER, S2",
              "*MATERIAL, NAME=RUBBER", "*ELASTIC", f"{number(YOUNG)}, {number(NU)}",
              "*DENSITY", number(DENSITY),
              "*SOLID SECTION, ELSET=BALL, MATERIAL=RUBBER",
              "*SOLID SECTION, ELSET=PLATE, MATERIAL=RUBBER", "*SURFACE INTERACTION, NAME=CONTACT"]
    if peer:
        lines += ["*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", number(PENALTY)]
    lines += ["*CONTACT PAIR, INTERACTION=CONTACT, TYPE=NODE TO SURFACE", "SLAVE, MASTER",
              "*BOUNDARY", "BOTTOM, 1, 3", "*INITIAL CONDITIONS, TYPE=VELOCITY",
              *(f"BALL, {k}, {number(v)}" for k, v in enumerate(VELOCITY, start=1)),
              "*STEP, NLGEOM, INC=1000000", "*DYNAMIC, DIRECT", f"{h}, {number(h*increments)}"]
    lines += [f"*NODE FILE, FREQUENCY={increments}", "U"]
    return "\n".join([*lines, "*END STEP"]) + "\n"
