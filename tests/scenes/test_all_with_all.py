"""Two-sided contact: pairs with SIDES=BOTH, and all free faces with all by *CONTACT.

Overlaps are looked at from outside, `overlap.py`; the scenes are those of `plain_scenes.py`.
One-sided node to surface contact lets corners of the master into the slave in some of them.
"""

import numpy as np
import pytest
from overlap import worst
from plain_scenes import ALL, AUTO, BOTH, ONE, SCENES, UNGUARDED, Scene
from scene_tools import EPSILON, run_deck

#: Coordinates of the scenes are below 4, edges above 0.1: rounding of what is seen, by the edge.
ROUNDING = 64*EPSILON*4/0.1


def run_scene(name, sides, folder, code=0):
    scene = SCENES[name]()
    run = run_deck(scene.deck(sides), folder, code, formulation="NODE TO SURFACE")
    return run, worst(run.fields(), scene.alone).by_edge


@pytest.mark.each_value
@pytest.mark.parametrize("sides", [BOTH, ALL])
@pytest.mark.parametrize("name", ["ledge", "bowl", "coil", "accordion", "slide off"])
def test_nothing_overlaps(name, sides, tmp_path):
    run, depth = run_scene(name, sides, tmp_path)
    assert depth <= ROUNDING
    assert run.closing(r"energy balance (\S+)") <= 1e-12


@pytest.mark.parametrize("name, least", [("ledge", 0.3), ("slide off", 0.1)])
def test_one_side_is_not_enough(name, least, tmp_path):
    """What the others are measured against: overlaps of one-sided contact, with exit code 3."""
    assert run_scene(name, UNGUARDED, tmp_path, code=3)[1] > least


def test_sides_both_is_the_pair_in_both_orders(tmp_path):
    """The same digits as of decks that list the pair twice, or leave it to the program."""
    scene = SCENES["crossing"]()
    scene.pairs = [("EAST", "NORTH")]
    both, free = (run_deck(scene.deck(sides), tmp_path / sides, formulation="NODE TO SURFACE")
                  for sides in (BOTH, AUTO))
    scene.pairs = [("EAST", "NORTH"), ("NORTH", "EAST")]
    twice, each = (run_deck(scene.deck(sides), tmp_path / f"{sides} twice",
                            formulation="NODE TO SURFACE") for sides in (ONE, AUTO))
    assert both.digits() == twice.digits() == free.digits() == each.digits()
    assert both.history["active"].max() > 0


@pytest.mark.parametrize("sides", [BOTH, ALL])
def test_held_nodes_hold(sides, tmp_path):
    """A bar of one element falls on a stub between its nodes, all nodes of which are held."""
    scene = Scene(0.02, 0.6, gravity=5.0)
    scene.block("BAR", (-1.0, 0.02), (2.0, 0.3), (1, 1))
    scene.block("STUB", (-0.1, -0.2), (0.25, 0.2), (1, 1)).hold("STUB", lambda x, y: True)
    run = run_deck(scene.deck(sides), tmp_path, formulation="NODE TO SURFACE")
    assert worst(run.fields(), {(1, 1)}).by_edge <= ROUNDING
    assert run.history["active"].max() > 0
    assert run.closing(r"energy balance (\S+)") <= 1e-12


def test_all_with_all_is_every_pair(tmp_path):
    """Two bodies: contact of all with all takes the steps of the pair with both sides."""
    runs = [run_scene("ledge", sides, tmp_path / sides)[0] for sides in (BOTH, ALL)]
    one, other = (run.fields() for run in runs)
    for field in ("displacement", "contact_force"):
        scale = np.abs(one[field]).max()
        assert np.abs(one[field] - other[field]).max() <= 1e-8*scale


def test_forces_balance_and_belong_to_nodes(tmp_path):
    """Fields of two-sided contact: forces sum to zero, and act where something is active."""
    run, _ = run_scene("bowl", ALL, tmp_path)
    fields = run.fields()
    force = fields["contact_force"]
    scale = np.abs(force).max()
    assert scale > 0
    assert np.abs(force.sum(1)).max() <= 1e-12*len(fields.x)*scale
