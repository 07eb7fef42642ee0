"""Columns of each pair in the history: force, impulse, centre of pressure, duration, active."""

import h5py
import numpy as np
import pytest
from scene_tools import DECKS, run_deck

NTS = {"formulation": "NODE TO SURFACE"}
INITIATIONS = ["PERSISTENT", "ADMISSIBLE", "VELOCITY UPDATE", "MASSLESS"]


def vectors(history, name, pair=1):
    """One row per increment."""
    return np.stack([history[f"pair{pair}_{name}_{a}"] for a in "xy"], 1)


def momenta(run):
    """Masses of the bodies, and (row, body, xy) their momenta."""
    with h5py.File(run.file(".h5"), "r") as file:
        bodies = file["sets"]["BODIES"]
        return bodies["MASS"][0], bodies["MOMENTUM"][:, :, :2]


@pytest.mark.parametrize("initiation", INITIATIONS)
def test_impulse_on_a_bar_is_its_change_of_momentum(initiation, tmp_path):
    """Weight and floor are all that pushes it; jumps of the velocities belong to the contact."""
    run = run_deck(DECKS/"bouncing_bar.inp", tmp_path, h=0.01, t_end=2, frame=1,
                   initiation=initiation, **NTS)
    history = run.history
    mass, momentum = momenta(run)
    bar = int(np.argmax(np.abs(momentum[:, :, 1]).max(0)))
    expected = momentum[:, bar, 1] - momentum[0, bar, 1] + 10*mass[bar]*history["time"]
    impulse = vectors(history, "impulse")
    assert impulse[-1, 1] > 100
    assert np.abs(impulse[:, 1] - expected).max() < 1e-12*np.abs(momentum).max()
    assert np.abs(impulse[:, 0]).max() < 1e-12*np.abs(momentum).max()
    force = vectors(history, "force")[1:]
    assert np.allclose(np.cumsum(force*history["h"][1:, None], 0), impulse[1:], rtol=0,
                       atol=1e-12*impulse[-1, 1])


@pytest.mark.parametrize("choice", [
    {**NTS, "initiation": "MASSLESS"}, {**NTS, "sides": "BOTH", "initiation": "VELOCITY UPDATE"},
    {"formulation": "MORTAR", "sides": "ONE", "initiation": "MASSLESS"}],
    ids=["nts", "both", "mortar"])
def test_impulse_of_two_free_bodies(choice, tmp_path):
    """On the surface that the deck names first, however many orders the pair is held in."""
    run = run_deck(DECKS/"two_bodies.inp", tmp_path, h=0.02, t_end=1.5, frame=1, **choice)
    history = run.history
    assert "pair2_force_x" not in history.dtype.names
    _, momentum = momenta(run)
    change = momentum - momentum[0]
    impulse = vectors(history, "impulse")
    scale = np.abs(momentum).max()
    assert np.abs(impulse).max() > 0.1*scale
    first = 0 if np.abs(impulse - change[:, 0]).max() < np.abs(impulse - change[:, 1]).max() else 1
    assert np.abs(impulse - change[:, first]).max() < 1e-12*scale
    assert np.abs(impulse + change[:, 1 - first]).max() < 1e-12*scale


def test_duration_counts_the_time_with_force(tmp_path):
    history = run_deck(DECKS/"two_bodies.inp", tmp_path, h=0.02, t_end=2, frame=1).history
    acts = np.abs(vectors(history, "force")).sum(1) > 0
    assert 0 < acts.sum() < len(acts)
    assert np.allclose(history["pair1_duration"], np.cumsum(acts*history["h"]), rtol=1e-12)
    assert (np.isnan(history["pair1_center_x"]) == ~acts).all()
    assert (history["pair1_active"] == history["active"]).all()


def test_what_a_block_that_is_pressed_transmits(tmp_path):
    """In statics the force is that at the end, nothing is counted over time."""
    history = run_deck(DECKS/"two_blocks_static.inp", tmp_path).history
    assert abs(history["pair1_force_y"][-1] - 20) < 1e-9*20
    assert abs(history["pair1_force_x"][-1]) < 1e-9*20
    assert abs(history["pair1_center_x"][-1]) < 1e-9
    assert (history["pair1_impulse_y"] == 0).all()
    assert (history["pair1_duration"] == 0).all()


RESTING = """
*NODE, NSET=ALL
1, 0., 0.
2, 4., 0.
3, 0., 1.
4, 4., 1.
5, 1., 1.
6, 1.5, 1.
7, 2., 1.
8, 1., 2.
9, 1.5, 2.
10, 2., 2.
*NSET, NSET=BELOW
1, 2, 3, 4
*ELEMENT, TYPE=CPE4, ELSET=FLOOR
1, 1, 2, 4, 3
*ELEMENT, TYPE=CPE4, ELSET=BLOCK
2, 5, 6, 9, 8
3, 6, 7, 10, 9
*SURFACE, NAME=LOWER
BLOCK, S1
*SURFACE, NAME=UPPER
FLOOR, S3
*MATERIAL, NAME=M
*HYPERELASTIC, COUPLED NEO HOOKE
1000., 0.3
*DENSITY
2.
*SOLID SECTION, ELSET=FLOOR, MATERIAL=M
1.
*SOLID SECTION, ELSET=BLOCK, MATERIAL=M
1.
*BOUNDARY
BELOW, 1, 2
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
{pair}
*STEP, NLGEOM
*STATIC
1., 1.
*BOUNDARY
9, 1
*DLOAD
BLOCK, GRAV, 10., 0., -1., 0.
*END STEP
*STEP, NLGEOM
*DYNAMIC, DIRECT
0.125, 1.
*END STEP
"""


@pytest.mark.parametrize(("pair", "sign"), [("LOWER, UPPER", 1), ("UPPER, LOWER", -1)])
def test_a_block_at_rest_presses_with_its_weight(pair, sign, tmp_path):
    deck = tmp_path/"resting.inp"
    deck.write_text(RESTING.format(pair=pair))
    history = run_deck(deck, tmp_path/"out").history
    weight = 2*10
    assert np.abs(history["pair1_force_y"][1:] - sign*weight).max() < 1e-8*weight
    assert np.abs(history["pair1_center_x"][1:] - 1.5).max() < 1e-8
    assert np.abs(history["pair1_center_y"][1:] - 1).max() < 1e-8
    moves = history["time"] > 1
    expected = np.where(moves, history["time"] - 1, 0)
    assert np.abs(history["pair1_impulse_y"] - sign*weight*expected).max() < 1e-8*weight
    assert (history["pair1_duration"] == expected).all()
    assert (history["pair1_active"][1:] == 3).all()


def test_no_columns_without_pairs(tmp_path):
    history = run_deck(DECKS/"spinning_ring.inp", tmp_path, h=0.05, t_end=0.1).history
    assert not any(name.startswith("pair") for name in history.dtype.names)
