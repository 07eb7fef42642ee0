"""Scenes of contact drawn by chance: a few bodies, plain places as often as odd ones.

`draw(chance)` is a `Scene` of tests/scenes/plain_scenes.py: blocks, discs and rings, half of the
time with sides and nodes exactly on each other, that fly at each other or fall on a floor.
`judge(scene, done, ...)` says what is wrong with a run of it that calls itself good: by positions,
and by energies and momenta.
"""

import math
import pathlib
import re
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "scenes"))

import overlap  # noqa: E402
from plain_scenes import (  # noqa: E402
    ALL,
    AUTO,
    BOTH,
    SCENES,
    UNGUARDED,
    Outcome,
    Scene,
    below,
)

__all__ = ["SCENES", "UNGUARDED", "Outcome", "draw", "draw_fine", "fuzz_scenes", "judge"]

#: Rounding of positions, by an edge: lengths are 30 edges at most, some tens of operations.
ROUNDING = 1e-13
SIZES = (0.2, 0.3, 0.5, 1.0)
#: A tenth of the speed of waves at most, or so: bodies bounce, and are not crushed.
SPEEDS = (0.0, 0.3, 1.0)


def place_of(chance, plain):
    """A place in a square of 1.6: on a lattice of tenths if `plain`."""
    place = (chance.uniform(-0.8, 0.8), chance.uniform(0.0, 1.6))
    return tuple(round(x, 1) for x in place) if plain else place


def velocity_of(chance, place, plain):
    """Mostly towards the middle of the scene; along an axis if `plain`."""
    speed = chance.choice(SPEEDS)
    if plain:
        return chance.choice([(speed, 0.0), (-speed, 0.0), (0.0, -speed), (0.0, -speed)])
    way = math.atan2(0.8 - place[1], -place[0]) + chance.uniform(-0.7, 0.7)
    return speed*math.cos(way), speed*math.sin(way)


def add_body(scene, name, chance, plain, **extra):
    """One body; its mesh, place, stiffness and motion by chance, `extra` as `Scene.add` takes it."""
    place = place_of(chance, plain)
    density = chance.choice([0.1, 1.0, 1.0, 10.0])
    more = {"stiffness": density*chance.choice([100.0, 300.0, 1000.0]), "density": density,
            "velocity": velocity_of(chance, place, plain),
            "spin": 0.0 if plain else chance.choice([0.0, 0.0, 2.0, -5.0]), **extra}
    kind = chance.choice(["block", "block", "block", "disc", "ring"])
    if kind == "block":
        size = chance.choice(SIZES), chance.choice(SIZES)
        cells = tuple(max(1, min(5, round(s/chance.choice([0.1, 0.2, 0.25])))) for s in size)
        turn = chance.choice([0.0, 0.0, 0.0, math.pi/4]) if plain else chance.uniform(0, math.pi)
        scene.block(name, place, size, cells, turn, **more)
    elif kind == "disc":
        cells = chance.choice([(2, 1), (3, 1), (4, 2)])
        scene.disc(name, place, chance.choice(SIZES[:3]), cells,
                   0.0 if plain else chance.uniform(0, 1), **more)
    else:
        outer = chance.choice(SIZES[1:])
        scene.ring(name, lambda angle, share: (
            place[0] + outer*(1 - 0.4*share)*math.cos(angle),
            place[1] + outer*(1 - 0.4*share)*math.sin(angle)), (chance.choice([8, 12, 16]), 1),
            **more)


def is_apart(scene):
    """Do no two bodies overlap at the start?"""
    label = [n for part in scene.part.values() for n in part.node]
    number = {n: i for i, n in enumerate(label)}
    x = np.array([p for part in scene.part.values() for p in part.node.values()])
    bodies = overlap.Bodies([[number[n] for n in cell] for part in scene.part.values()
                             for cell in part.element.values()])
    return bodies.n == len(scene.part) and bodies.overlap(x).by_edge <= ROUNDING


def draw(chance):
    """A scene whose bodies do not overlap at the start."""
    while True:
        plain = chance.random() < 0.5
        scene = Scene(chance.choice([0.005, 0.01, 0.02, 0.03]), 0.0,
                      gravity=chance.choice([0.0, 0.0, 10.0]))
        scene.t_end = 60*scene.h
        for k in range(chance.randint(2, 5)):
            add_body(scene, f"B{k}", chance, plain)
        if chance.random() < 0.5:
            scene.block("FLOOR", (-2.0, -0.5), (4.0, 0.5), (chance.choice([8, 13, 20]), 1),
                        stiffness=chance.choice([100.0, 1000.0]))
            scene.hold("FLOOR", below(-0.5))
        if is_apart(scene):
            return scene


def add_fine_body(scene, name, chance, plain):
    """One body of ten elements and more across, a ring of five between its circles."""
    place = place_of(chance, plain)
    density = chance.choice([0.1, 1.0, 1.0, 10.0])
    more = {"stiffness": density*chance.choice([100.0, 300.0, 1000.0]), "density": density,
            "velocity": velocity_of(chance, place, plain),
            "spin": 0.0 if plain else chance.choice([0.0, 2.0, -5.0])}
    kind = chance.choice(["block", "disc", "ring"])
    if kind == "block":
        size = chance.choice([0.6, 1.0]), chance.choice([0.6, 1.0])
        cells = chance.choice([11, 12, 14]), chance.choice([11, 12, 14])
        turn = chance.choice([0.0, 0.0, math.pi/4]) if plain else chance.uniform(0, math.pi)
        scene.block(name, place, size, cells, turn, **more)
    elif kind == "disc":
        scene.disc(name, place, chance.choice([0.3, 0.4]), (chance.choice([6, 8]), chance.choice([3, 5])),
                   0.0 if plain else chance.uniform(0, 1), **more)
    else:
        outer = chance.choice([0.4, 0.5])
        more["stiffness"] *= 10.0      # no wall is to meet the other one
        scene.ring(name, lambda angle, share: (
            place[0] + outer*(1 - 0.4*share)*math.cos(angle),
            place[1] + outer*(1 - 0.4*share)*math.sin(angle)), (chance.choice([32, 48]), 5), **more)


def draw_fine(chance):
    """One to three bodies of many elements, with or without a floor, as `draw` draws coarse ones."""
    while True:
        plain = chance.random() < 0.4
        scene = Scene(chance.choice([0.005, 0.01, 0.02]), 0.0, gravity=chance.choice([0.0, 0.0, 10.0]))
        scene.t_end = 60*scene.h
        for k in range(chance.randint(1, 3)):
            add_fine_body(scene, f"B{k}", chance, plain)
        floors = ["rigid", "fine"] + ["none"]*(len(scene.part) > 1)
        floor = chance.choice(floors)
        if floor == "rigid":
            scene.block("FLOOR", (-2.0, -0.5), (4.0, 0.5), (chance.choice([8, 13, 30]), 1))
            scene.hold("FLOOR", lambda x, y: True)
        elif floor == "fine":
            scene.block("FLOOR", (-2.0, -0.5), (4.0, 0.5), (chance.choice([20, 33]), 7),
                        stiffness=chance.choice([100.0, 1000.0])).hold("FLOOR", below(-0.5))
        if is_apart(scene):
            return scene


def judge(scene, done, meets_itself):
    """What is wrong with a run that is told to be good; empty: nothing.

    `meets_itself`: are bodies in contact with themselves too?
    """
    verdict = done.run.verdict
    if verdict["verdict"] != "good":
        return ""
    seen = done.overlap
    is_meant = meets_itself or len(set(seen.bodies)) == 2
    # Of curved surfaces the log tells apart how far only the chords of their edges are in, from a
    # thousandth on.
    chords = re.search(r"edges of curved surfaces overlap by up to (\S+) of their length", done.run.log)
    told = max(verdict["penetration"], float(chords[1])*(1 + 5e-3) if chords else 1e-3)
    if is_meant and seen.by_edge > told*(1 + 1e-6) + ROUNDING:
        return f"told good and {told:.3g} deep, but {seen}"
    if verdict["largest_energy"] > 0 and done.energy_error > 1e-10:
        return f"told good, but the energy changes by {done.energy_error:.2e}"
    if scene.held or scene.gravity:
        return ""
    momentum = done.run.series("BODIES", "MOMENTUM")[1]
    change = np.abs(momentum.sum(1) - momentum[0].sum(0)).max()
    if change > 1e-11*np.abs(momentum).max():
        return f"told good, but momenta change by {change:.2e}"
    return ""


#: How scenes are run: who is in contact, and the parameters of the deck.
WAYS = [(ALL, {"formulation": "NODE TO SURFACE"}),
        (ALL, {"formulation": "NODE TO SURFACE", "initiation": "ADMISSIBLE"}),
        (ALL, {"formulation": "NODE TO SURFACE", "initiation": "MASSLESS"}),
        (AUTO, {"formulation": "NODE TO SURFACE", "initiation": "AUTO"}),
        (ALL, {"formulation": "NODE TO SURFACE", "method": "AUGMENTED LAGRANGE"}),
        (BOTH, {"formulation": "NODE TO SURFACE", "method": "SADDLE POINT"}),
        (AUTO, {"formulation": "SEGMENT"}), (AUTO, {"formulation": "MORTAR"}),
        (AUTO, {"formulation": "MORTAR", "initiation": "MASSLESS"})]


def fuzz_scenes(chance, folder):
    """A scene drawn by chance ends as it is told, or stops and says why."""
    scene = draw_fine(chance) if chance.random() < 0.1 else draw(chance)
    sides, parameters = chance.choice(WAYS)
    done = Outcome(scene, folder, sides, **parameters)
    assert done.has_ended or done.run.verdict["message"]
    wrong = judge(scene, done, sides == ALL)
    assert not wrong, f"{sides}, {parameters}: {wrong}"
