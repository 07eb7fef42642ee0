"""*NEWTON, TYPE=KEPT ends each step where TYPE=FULL does, with a fraction of its factorisations."""

import numpy as np
import pytest
from scene_tools import DECKS, EPSILON, Deck, run_deck


def run(deck, kind, folder, **parameters):
    deck = Deck.read(DECKS/deck)
    deck.replace("*NEWTON,", f"*NEWTON, TYPE={kind},")
    return run_deck(deck, folder/kind, **parameters)


RING = {"h": 0.02, "t_end": 3.0}


@pytest.mark.parametrize(("deck", "parameters"), [
    ("ring.inp", RING), ("ring.inp", {**RING, "formulation": "MORTAR"}), ("two_bodies.inp", {})])
def test_both_end_at_the_same_step(tmp_path, deck, parameters):
    """Both leave some roundings of a residual in each increment, which the motion carries on."""
    kept, full = (run(deck, kind, tmp_path, **parameters) for kind in ("KEPT", "FULL"))
    one, other = kept.history, full.history
    assert one["active"].max() >= 1
    assert (one["active"] == other["active"]).all()
    total = other["total"].max()
    for name in ("kinetic", "strain"):
        assert np.abs(one[name] - other[name]).max() <= 16*EPSILON*len(one)*total
    factorisations = [run.verdict["counts"]["factorisations"] for run in (kept, full)]
    assert factorisations[0] < 0.2*factorisations[1]
