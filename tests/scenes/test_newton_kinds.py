"""*NEWTON, TYPE=KEPT ends each step where TYPE=FULL does, with a fraction of its factorisations."""

import numpy as np
import pytest
from scene_tools import DECKS, EPSILON, Deck, coarse_ring, run_deck


def run(name, kind, folder, **parameters):
    deck = coarse_ring() if name == "ring" else Deck.read(DECKS/f"{name}.inp")
    deck.replace("*NEWTON,", f"*NEWTON, TYPE={kind},")
    return run_deck(deck, folder/kind, **parameters)


RING = {"h": 0.02, "t_end": 3.0}


@pytest.mark.parametrize(("deck", "parameters"), [
    ("ring", RING), ("ring", {**RING, "formulation": "MORTAR"}), ("two_bodies", {"h": 0.02, "t_end": 1.2})])
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


@pytest.mark.parametrize("kind", ["KEPT", "FULL"])
def test_without_polish_it_ends_at_the_tolerance(tmp_path, kind):
    """An increment may leave the energy the tolerance, of forces that move no farther than bodies."""
    tolerance = 1e-8
    rough, fine = (run("ring", f"{kind}, POLISH={polish}", tmp_path, **RING,
                       tolerance=tolerance) for polish in ("NO", "YES"))
    solutions = [run.verdict["counts"]["solutions"] for run in (rough, fine)]
    assert solutions[0] < 0.85*solutions[1]
    assert rough.verdict["unconverged"] == 0
    n = len(rough.history)
    errors = [run.verdict["largest_energy_error"]/run.verdict["largest_energy"]
              for run in (rough, fine)]
    assert errors[1] < 16*EPSILON*n < errors[0] < tolerance*n
    assert "Newton's method ends where the residual is within 1.00000E-08" in rough.log


def test_a_guess_without_forces_leaves_the_factor(tmp_path):
    """In long increments elements are turned inside out on the way of the velocities: the step
    begins from rest, and the factor of those before serves on."""
    kept = run("ring", "KEPT", tmp_path, h=0.16, t_end=3.2)
    counts = kept.verdict["counts"]
    assert max(counts["factorisations"], counts["tangents"]) < kept.verdict["increments"]
