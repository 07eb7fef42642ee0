"""Which side is the slave: a floor that sees a disc turn must not push it sideways.

The disc of the book's chapter on slaves that are too coarse: it falls straight on a floor whose
edges are twice as long as its own, off its nodes.
"""

import pytest
from plain_scenes import AUTO, BOTH, ONE, disc_on_floor, slanted
from scene_tools import run_deck

MORTAR = {"formulation": "MORTAR"}
CHOICES = [MORTAR, {"formulation": "MORTAR", "multiplier": "STANDARD", "normal": "EDGE"},
           {"formulation": "SEGMENT"}]


def run(folder, choice, slave="TOP", contact=AUTO, sides=""):
    scene = disc_on_floor(1.93, 0.6, slave)
    deck = scene.deck(contact)
    deck.card = [(head + sides*head.startswith("*CONTACT PAIR"), data) for head, data in deck.card]
    return run_deck(deck, folder, **choice)


@pytest.mark.parametrize("choice", CHOICES, ids=lambda choice: ", ".join(choice.values()))
def test_the_rounder_surface_becomes_the_slave(tmp_path, choice):
    """Left to the program, the pair is the one that names the disc first, to the bit; what it
    transmits is told of the surface that the deck names first."""
    free = run(tmp_path / "free", choice)
    disc = run(tmp_path / "disc", choice, "DISC", contact=ONE)
    assert free.digits(pairs=False) == disc.digits(pairs=False)
    assert (free.history["pair1_force_y"] == -disc.history["pair1_force_y"]).all()
    assert "DISC (slave, 32 nodes, named second) on TOP" in free.log
    assert "DISC (slave, 32 nodes) on TOP" in disc.log


@pytest.mark.parametrize("formulation", ["MORTAR", "SEGMENT", "NODE TO SURFACE"])
def test_the_floor_as_the_slave_pushes_sideways(tmp_path, formulation):
    """At least five times as much as what is left with the disc as the slave."""
    choice = {"formulation": formulation}
    kept = run(tmp_path / "kept", choice, contact=ONE)
    free = run(tmp_path / "free", choice)
    assert "TOP (slave, " in kept.log
    assert slanted(kept) > 5*slanted(free)


def test_what_is_asked_for_is_not_warned_of(tmp_path):
    told = run(tmp_path / "told", MORTAR)
    asked = run(tmp_path / "asked", MORTAR, sides=", SIDES=AUTO")
    assert "SIDES=ONE keeps the order" in told.errors
    assert asked.errors == ""
    assert asked.digits() == told.digits()


def test_both_sides_have_no_order(tmp_path):
    both = run(tmp_path, {"formulation": "NODE TO SURFACE"}, contact=BOTH)
    assert both.errors == ""
    assert "TOP (slave, " in both.log
