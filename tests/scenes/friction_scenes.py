"""Scenes of `*FRICTION`, for tests and the book."""

import math

import numpy as np
from plain_scenes import ONE, Scene
from scene_tools import DECKS, Deck

G = 10.0
WEIGHT = 2*G
NODES = {"formulation": "NODE TO SURFACE"}


def rubbing(deck, mu, name="SMOOTH"):
    deck.replace(f"*SURFACE INTERACTION, NAME={name}",
                 f"*SURFACE INTERACTION, NAME={name}\n*FRICTION\n{mu!r}")
    return deck


def balance(history, scale=0.0):
    kept = history["total"] - history["contact_work"] + history["damping_loss"] \
        + history["friction_loss"]
    return np.abs(kept - kept[0]).max()/max(scale, (history["kinetic"] + history["strain"]).max())


def block_on_floor(h, t_end, mu, *, v0=0.0, slope=0.0, push=0.0, rigid=False, stiffness=2e4,
                   eta=0.0, cells=(4, 2), sides=ONE):
    """A block of 2 by 1 on a floor that is held; `slope` turns both, `push` pulls like gravity."""
    def turn(x, y):
        c, s = math.cos(slope), math.sin(slope)
        return c*x - s*y, s*x + c*y

    scene = Scene(h, t_end, gravity=G)
    scene.block("BLOCK", (0, 0), (2, 1), cells, stiffness=stiffness, shape=turn,
                velocity=turn(v0, 0))
    scene.block("FLOOR", (-1, -1), (6, 1), (6, 1), stiffness=stiffness, shape=turn)
    scene.hold("FLOOR", lambda x, y: True)
    scene.pairs = [("BLOCK", "FLOOR")]
    if rigid:
        x, y = turn(1, 0.5)
        scene.cards += [f"*NODE\n9000, {x!r}, {y!r}", "*RIGID BODY, ELSET=BLOCK, REF NODE=9000",
                        "*NSET, NSET=MIDDLE\n9000"]
        vx, vy = turn(v0, 0)
        scene.cards += ["*INITIAL CONDITIONS, TYPE=ROTATING VELOCITY",
                        f"9000, 0., {vx!r}, {vy!r}\n{x!r}, {y!r}"]
    else:
        scene.cards += ["*NSET, NSET=MIDDLE", ", ".join(
            str(k) for k in range(1, 1 + (cells[0] + 1)*(cells[1] + 1)))]
    deck = rubbing(scene.deck(sides), mu)
    if eta:
        deck.replace("*MATERIAL, NAME=BLOCK", f"*MATERIAL, NAME=BLOCK\n*DAMPING, BETA={eta!r}")
    if push:
        deck.insert(f"*DLOAD\nBLOCK, GRAV, {push!r}, 1., 0.", before="*CONSTRAINT METHOD")
    return deck


def way(run, n, slope=0.0):
    """Mean displacements of the first n nodes along the floor, of all frames."""
    u = run.fields()["displacement"][:, :n]
    return (u @ [math.cos(slope), math.sin(slope)]).mean(axis=1)


def ring(mu):
    """That of the paper against its block, which is free."""
    deck = rubbing(Deck.read(DECKS / "ring.inp"), mu, "FRICTIONLESS")
    deck.remove("*BOUNDARY")
    return deck


def pressed(shift, mu, sides=ONE):
    """A block whose top is pressed down and moved sideways, in ten static increments."""
    scene = Scene(0.1, 1.0)
    scene.block("BLOCK", (0, 0), (2, 1), (8, 4), stiffness=100.0)
    scene.block("FLOOR", (-1, -1), (4, 1), (5, 1), stiffness=100.0)
    scene.hold("FLOOR", lambda x, y: True)
    scene.hold("BLOCK", lambda x, y: y > 0.99, "2, 2", -0.02)
    scene.hold("BLOCK", lambda x, y: y > 0.99, "1, 1", shift)
    scene.side("BOTTOM", "BLOCK", lambda x, y: y < 0.01)
    scene.pairs = [("BOTTOM", "FLOOR")]
    deck = rubbing(scene.deck(sides), mu)
    deck.replace("*DYNAMIC, DIRECT", "*STATIC, DIRECT")
    return deck
