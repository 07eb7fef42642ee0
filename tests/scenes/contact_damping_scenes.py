"""Scenes of `*CONTACT DAMPING`, for tests and the book."""

import numpy as np
from friction_scenes import make_rigid
from plain_scenes import ONE, Scene
from scene_tools import DECKS, Deck

MASS = 2.0                                       # of the block, 2 by 1
AREA = 2.0                                       # of its bottom


def damped(deck, coefficient, clearance=None, flat=None, tangent=None, name="SMOOTH"):
    """Give the surface interaction of a deck viscous damping."""
    card = "*CONTACT DAMPING, DEFINITION=DAMPING COEFFICIENT"
    if tangent is not None:
        card += f", TANGENT FRACTION={tangent!r}"
    numbers = [coefficient, clearance, flat]
    line = ", ".join(repr(number) for number in numbers if number is not None)
    deck.replace(f"*SURFACE INTERACTION, NAME={name}",
                 f"*SURFACE INTERACTION, NAME={name}\n{card}\n{line}")
    return deck


def balance(history, scale=0.0):
    """What the energy balance leaves, by the largest energy."""
    kept = history["total"] - history["contact_work"] + history["damping_loss"] \
        + history["friction_loss"] + history["contact_damping_loss"]
    return np.abs(kept - kept[0]).max()/max(scale, (history["kinetic"] + history["strain"]).max())


def block_over_floor(h, t_end, *, height=0.0, velocity=(0.0, 0.0), gravity=0.0, cells=(4, 2),
                     rigid=True, sides=ONE, stiffness=2e4, floor=((-2, -1), (8, 1), (7, 1))):
    """A block of 2 by 1 whose bottom is above a floor that is held."""
    scene = Scene(h, t_end, gravity=gravity)
    scene.block("BLOCK", (0, height), (2, 1), cells, stiffness=stiffness, velocity=velocity)
    scene.block("FLOOR", *floor, stiffness=stiffness)
    scene.hold("FLOOR", lambda x, y: True)
    scene.side("BOTTOM", "BLOCK", lambda x, y: y < height + 1e-9)
    scene.side("TOP", "FLOOR", lambda x, y: y > -1e-9)
    scene.pairs = [("BOTTOM", "TOP")]
    if rigid:
        make_rigid(scene, "BLOCK", (1, height + 0.5), velocity)
    return scene.deck(sides)


def ring(coefficient, clearance, flat=0.0, tangent=0.0, scene=None):
    """That of the paper, or another `scene` of it, against its block, which is free."""
    deck = damped(scene or Deck.read(DECKS / "ring.inp"), coefficient, clearance, flat, tangent,
                  "FRICTIONLESS")
    deck.remove("*BOUNDARY")
    return deck
