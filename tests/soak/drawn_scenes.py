"""Scenes of contact of every kind, drawn by a seed: what `scene_table.py` runs and judges.

`draw_case(seed)` is a `Case`: bodies that fly at each other or fall on a floor, in four of five
cases, or a body that is pressed by a punch or a plate in static steps. Half of them rub, a third
has rigid bodies, a third is in contact by mortar or segments. Half of the places are plain: sides
and nodes lie exactly on each other. No case is left out.
"""

import dataclasses
import math
import pathlib
import random
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "scenes"))

from plain_scenes import ALL, AUTO, Scene, below  # noqa: E402
from random_scenes import add_body, is_apart  # noqa: E402
from scene_tools import Deck, number  # noqa: E402

__all__ = ["Case", "DrawnScene", "draw_case"]

#: Labels of reference nodes, above those of all meshes.
FIRST_REFERENCE = 90001
FRICTIONS = (0.05, 0.2, 0.4, 0.8)


class DrawnScene(Scene):
    """A scene with friction, rigid bodies and static steps."""

    def __init__(self, *arguments, is_static=False, friction=0.0, **more):
        super().__init__(*arguments, **more)
        self.is_static, self.friction = is_static, friction
        self.stuff = {}                # body: Young's modulus and density
        self.reference = {}            # rigid body: label and place of its reference node
        self.start = {}                # rigid body: velocity and spin
        self.driven = {}               # rigid body: its motion in x and y until the end, or None

    def add(self, name, mesh, stiffness=100.0, density=1.0, velocity=(0, 0), spin=0.0,
            is_rigid=False, driven=None):
        """A body; a rigid one is free, or moves by `driven` until the end without turning."""
        at_rest = {} if is_rigid else {"velocity": velocity, "spin": spin}
        super().add(name, mesh, stiffness, density, **at_rest)
        self.stuff[name] = (stiffness, density)
        if is_rigid:
            label = FIRST_REFERENCE + len(self.reference)
            # Where it turns about is of no account: a corner of it.
            place = next(iter(self.part[name].node.values()))
            self.reference[name] = (label, place)
            self.start[name] = (velocity, spin)
            self.driven[name] = driven
        return self

    def _rigid_cards(self):
        lines = []
        for name, (label, place) in self.reference.items():
            (vx, vy), spin = self.start[name]
            lines += ["*NODE", f"{label}, {number(place[0])}, {number(place[1])}",
                      f"*RIGID BODY, ELSET={name}, REF NODE={label}"]
            if self.driven[name] is not None:
                lines += ["*BOUNDARY", f"{label}, 6", *(
                    f"{label}, {axis}" for axis in (1, 2) if not self.driven[name][axis - 1])]
            elif vx or vy or spin:
                # The velocity is that of the middle; the reference node goes around it.
                x, y = (sum(p[k] for p in self.part[name].node.values())
                        /len(self.part[name].node) for k in (0, 1))
                u = (vx - spin*(place[1] - y), vy + spin*(place[0] - x))
                lines += ["*INITIAL CONDITIONS, TYPE=VELOCITY", f"{label}, 1, {number(u[0])}",
                          f"{label}, 2, {number(u[1])}", f"{label}, 6, {number(spin)}"]
        return lines

    def deck(self, sides=AUTO, name="scene"):
        deck = super().deck(sides, name)
        rigid = self._rigid_cards()
        if rigid:
            deck.insert("\n".join(rigid), before="*AMPLITUDE")
        moved = [f"{self.reference[b][0]}, {axis}, {axis}, {number(way[axis - 1])}"
                 for b, way in self.driven.items() if way is not None
                 for axis in (1, 2) if way[axis - 1]]
        if moved:
            deck.insert("\n".join(["*BOUNDARY, AMPLITUDE=RAMP", *moved]),
                        before="*CONSTRAINT METHOD")
        if self.friction:
            at = deck.find("*SURFACE INTERACTION")
            deck.card[at + 1:at + 1] = Deck._cards(f"*FRICTION\n{number(self.friction)}")
            if sides == ALL:
                deck.insert("*CONTACT PROPERTY ASSIGNMENT\n, , SMOOTH", before="*AMPLITUDE")
        if self.is_static:
            deck.replace("*DYNAMIC, DIRECT", "*STATIC")
        deck.replace("*NODE FILE\nU", "*NODE FILE\nU, V, RF, RM")
        return deck


@dataclasses.dataclass
class Case:
    """A scene, and how it is to be run."""

    seed: int
    scene: DrawnScene
    sides: str                         # AUTO or ALL
    parameters: dict

    @property
    def kind(self):
        """One word for each thing that cases differ in."""
        scene = self.scene
        return {"formulation": "ALL" if self.sides == ALL else self.parameters["formulation"],
                "friction": scene.friction > 0, "rigid": bool(scene.reference),
                "static": scene.is_static}


def draw_case(seed):
    """The case of a seed, always the same."""
    chance = random.Random(f"case {seed}")
    # Sixths, halves, thirds and fifths go through all combinations.
    formulation, sides = [("NODE TO SURFACE", AUTO), ("MORTAR", AUTO), ("NODE TO SURFACE", ALL),
                          ("NODE TO SURFACE", AUTO), ("SEGMENT", AUTO),
                          ("NODE TO SURFACE", AUTO)][seed % 6]
    friction = chance.choice(FRICTIONS) if seed//6 % 2 else 0.0
    has_rigid = seed//12 % 3 == 0
    is_static = seed % 5 == 0
    if friction:
        sides = AUTO                   # properties of pairs cannot be assigned with friction
    draw = draw_static if is_static else draw_dynamic
    parameters = {"formulation": formulation}
    if formulation == "MORTAR" and chance.random() < 0.3:
        parameters["multiplier"] = "STANDARD"
    return Case(seed, draw(chance, friction, has_rigid), sides, parameters)


# ---- dynamic scenes -----------------------------------------------------------------------------


def draw_dynamic(chance, friction, has_rigid):
    """Two to four bodies fly at each other, or fall on a floor; apart at the start."""
    while True:
        plain = chance.random() < 0.5
        scene = DrawnScene(chance.choice([0.005, 0.01, 0.02, 0.03]), 0.0, friction=friction,
                           gravity=chance.choice([0.0, 0.0, 10.0]))
        scene.t_end = 30*scene.h
        n = chance.randint(2, 4)
        rigid = chance.randrange(n) if has_rigid else -1
        for k in range(n):
            add_body(scene, f"B{k}", chance, plain, **({"is_rigid": True} if k == rigid else {}))
        if chance.random() < 0.5:
            scene.block("FLOOR", (-2.0, -0.5), (4.0, 0.5), (chance.choice([8, 13, 20]), 1),
                        stiffness=chance.choice([100.0, 1000.0]))
            scene.hold("FLOOR", below(-0.5))
        if is_apart(scene):
            return scene


# ---- static scenes ------------------------------------------------------------------------------


def draw_static(chance, friction, has_rigid):
    """A punch is pressed into a block, or blocks between two plates."""
    scene = DrawnScene(0.1, 1.0, is_static=True, friction=friction)
    return chance.choice([indented, stacked])(scene, chance, has_rigid)


def top_of(scene, name):
    return max(y for _, y in scene.part[name].node.values())


def indented(scene, chance, has_rigid):
    """A punch, which may be inclined or round, goes into a block, and along it where it rubs."""
    width, height = chance.choice([1.0, 2.0]), chance.choice([0.5, 1.0])
    scene.block("BLOCK", (-width/2, -height), (width, height),
                (chance.randint(3, 9), chance.randint(2, 4)), stiffness=100.0)
    scene.hold("BLOCK", below(-height))
    deep = -chance.uniform(0.02, 0.12)*height
    along = chance.choice([0.0, 0.05, 0.2])*width if scene.friction else 0.0
    gap = chance.choice([0.0, 0.0, 0.01])
    x = chance.choice([0.0, round(chance.uniform(-0.4, 0.4), 1), chance.uniform(-0.4, 0.4)])*width
    more = {"stiffness": chance.choice([50.0, 100.0, 3000.0])}
    if has_rigid:
        more |= {"is_rigid": True, "driven": (along, deep)}
    shape = chance.choice(["flat", "inclined", "round"])
    size = chance.choice([0.3, 0.5, 0.8])
    if shape == "round":
        scene.disc("PUNCH", (x, gap + size/2), size/2, chance.choice([(2, 1), (4, 2)]), **more)
    else:
        turn = 0.0 if shape == "flat" else chance.choice([0.1, 0.3, math.pi/4])
        tall = size/2
        low = tall/2 - 0.5*(abs(size*math.sin(turn)) + tall*math.cos(turn))
        scene.block("PUNCH", (x - size/2, gap - low), (size, tall),
                    (chance.randint(1, 4), chance.randint(1, 2)), turn, **more)
    scene.pairs = [chance.choice([("PUNCH", "BLOCK"), ("BLOCK", "PUNCH")])]
    if not has_rigid:
        middle = sum(y for _, y in scene.part["PUNCH"].node.values())/len(scene.part["PUNCH"].node)

        def upper(_, y):
            return y > middle + 1e-9

        scene.hold("PUNCH", upper, "1, 1", along)
        scene.hold("PUNCH", upper, "2, 2", deep)
    return scene


def stacked(scene, chance, has_rigid):
    """One to three blocks on a floor, under a plate that comes down."""
    scene.block("FLOOR", (-1.5, -0.3), (3.0, 0.3), (chance.randint(4, 13), 1), stiffness=1000.0)
    scene.hold("FLOOR", below(-0.3))
    y, n = 0.0, chance.randint(1, 3)
    rigid = chance.randrange(n) if has_rigid else -1
    for k in range(n):
        tall = chance.choice([0.3, 0.5])
        x = chance.choice([0.0, 0.1, chance.uniform(-0.1, 0.1)])
        wide = chance.choice([0.6, 0.8, 1.0])
        scene.block(f"B{k}", (x - wide/2, y), (wide, tall), (chance.randint(1, 6),
                    chance.randint(1, 3)), stiffness=chance.choice([50.0, 100.0, 300.0]),
                    **({"is_rigid": True} if k == rigid else {}))
        y += tall
    plate = y
    scene.block("PLATE", (-1.0, plate), (2.0, 0.2), (chance.randint(3, 9), 1), stiffness=1000.0)
    scene.hold("PLATE", lambda _, y: y > plate + 0.19, "1, 1")
    scene.hold("PLATE", lambda _, y: y > plate + 0.19, "2, 2", -chance.uniform(0.01, 0.08)*plate)
    names = ["FLOOR", *(f"B{k}" for k in range(n)), "PLATE"]
    scene.pairs = [chance.choice([(a, b), (b, a)]) for a, b in zip(names, names[1:], strict=False)]
    if not scene.friction:
        hold_sideways(scene, names[1:-1])
    return scene


def hold_sideways(scene, names):
    """Without friction nothing keeps a body from sliding: one of its nodes is held sideways."""
    for name in names:
        if name in scene.reference:
            scene.held.append(([scene.reference[name][0]], "1, 1", 0.0))
        else:
            scene.held.append(([next(iter(scene.part[name].node))], "1, 1", 0.0))
