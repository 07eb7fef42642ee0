"""`*FRICTION`: Coulomb's law for nodes on edges, with what it takes in the ledger."""

import numpy as np
import pytest
from friction_scenes import NODES, balance, block_on_floor, pressed, ring, way
from scene_tools import run_deck
from test_contact_output import restart


def obeys(run, scale=0.0, law=1e-9):
    """Energy is lost to friction alone, in no step made by it, and its law holds."""
    history = run.history
    assert balance(history, scale) < 1e-12
    assert (np.diff(history["friction_loss"]) >= -1e-15*max(scale, history["kinetic"].max())).all()
    pairs = [name for name in history.dtype.names if name.endswith("_friction_loss")]
    assert np.allclose(sum(history[name] for name in pairs), history["friction_loss"],
                       rtol=1e-13, atol=1e-13*scale)
    assert run.verdict["law_violation"] <= law
    assert run.verdict["friction_loss"] == pytest.approx(history["friction_loss"][-1], rel=1e-8,
                                                         abs=1e-13*scale)
    assert run.verdict["verdict"] == "good"


# ---- sliding to rest ----------------------------------------------------------------------------


@pytest.mark.parametrize("h", [0.01, 0.005])
def test_a_damped_block_slides_to_rest(h, tmp_path):
    """That of a rigid one, but for its shear: F H/(3 G A) = 1.3e-4 in the distance."""
    run = run_deck(block_on_floor(h, 0.72, 0.3, v0=2.0, eta=2e-3), tmp_path, **NODES)
    obeys(run)
    assert way(run, 15)[-1] == pytest.approx(2/3, abs=2e-4)
    assert run.history["newton"].max() <= 6 and run.history["cuts"].sum() == 0


# ---- stick and slip -----------------------------------------------------------------------------


def test_an_elastic_block_sticks(tmp_path):
    """Below the limit all nodes stick; gravity comes at once, so that it bounces in place."""
    run = run_deck(block_on_floor(0.02, 1.0, 0.5, push=3.0, eta=5e-3), tmp_path, **NODES)
    obeys(run)
    assert np.abs(way(run, 5)).max() < 1e-3


# ---- statics ------------------------------------------------------------------------------------


def test_statics_stick_and_slide(tmp_path):
    """A block moved by little sticks, and its force is linear in the way; moved by much all of it
    slides, with mu times the pressure. Null space and saddle point to the same digits."""
    force = {}
    for shift in (0.001, 0.002, 0.05):
        runs = [run_deck(pressed(shift, 0.5), tmp_path/f"{shift}{method[0]}", **NODES, method=method)
                for method in ("NULL SPACE", "SADDLE POINT")]
        history = runs[0].history
        force[shift] = np.array([history["pair1_force_x"][-1], history["pair1_force_y"][-1]])
        for run in runs:
            assert run.verdict["verdict"] == "good" and run.verdict["law_violation"] < 1e-9
            assert run.history["newton"].max() <= 8 and run.history["cuts"].sum() == 0
            assert (np.diff(run.history["friction_loss"]) >= 0).all()
            assert run.history["pair1_force_x"][-1] == pytest.approx(force[shift][0], rel=1e-10)
    assert force[0.002][0] == pytest.approx(2*force[0.001][0], rel=1e-2)
    assert -force[0.05][0] == pytest.approx(0.5*force[0.05][1], rel=1e-10)
    assert run.history["friction_loss"][-1] > 0


# ---- the ring -----------------------------------------------------------------------------------


@pytest.mark.parametrize("mu", [0.2, 0.8])
def test_a_ring_keeps_momenta_and_pays_for_friction(mu, tmp_path):
    runs = [run_deck(ring(mu), tmp_path/method, **NODES, h=0.02, t_end=0.6, method=method)
            for method in ("NULL SPACE", "SADDLE POINT")]
    for run in runs:
        obeys(run)
        history = run.history
        assert history["friction_loss"][-1] > 0.05*history["kinetic"][0]
        scale = np.abs(history["lz"][0])
        for name in ("px", "py", "lz"):
            assert np.abs(history[name] - history[name][0]).max() < 1e-13*scale
    for name in ("kinetic", "friction_loss", "strain"):
        assert np.allclose(runs[0].history[name], runs[1].history[name], rtol=1e-9, atol=1e-11)
    assert (runs[0].history["newton"] == runs[1].history["newton"]).all()


@pytest.mark.parametrize("more", [{"sides": "BOTH"}, {"initiation": "ADMISSIBLE"}])
def test_a_ring_held_in_other_ways(more, tmp_path):
    run = run_deck(ring(0.8), tmp_path, **NODES, h=0.01, t_end=0.3, **more)
    obeys(run)


def test_a_restart_has_the_same_bits(tmp_path):
    deck = ring(0.8)
    deck.replace("FREQUENCY=50", "FREQUENCY=13")
    (tmp_path/"again").mkdir()
    whole = run_deck(deck, tmp_path/"whole", **NODES, h=0.02, t_end=0.4)
    again = restart(whole, tmp_path/"again")
    assert again.history["friction_loss"][-1] > again.history["friction_loss"][-7] > 0
    assert again.digits() == whole.digits()
