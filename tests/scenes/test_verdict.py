"""How a run ends: NAME.json, the verdict in log and on the screen, exit codes, --strict."""

import numpy as np
import pytest
from scene_tools import DECKS, Deck, emcon, run_deck


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    return run_deck(DECKS / "ring.inp", tmp_path_factory.mktemp("ring"), h=0.05)


def test_figures_are_those_of_the_history(ring):
    """Nine digits are written; the largest error is that of the history, row by row."""
    found, rows = ring.verdict, ring.history
    assert found["verdict"] == "good" and found["reasons"] == [] and found["message"] == ""
    assert found["increments"] == rows["increment"][-1] and found["newton"] == rows["newton"].sum()
    for name in ("time", "kinetic", "strain", "external_work", "total"):
        assert found[name] == pytest.approx(rows[name][-1], rel=1e-8), name
    drift = np.abs(rows["total"] - rows["contact_work"] - rows["total"][0]).max()
    assert found["largest_energy_error"] == pytest.approx(drift, rel=1e-8, abs=0)
    assert 0 < found["mean_stand_off"] < found["stand_off"]


def test_stand_off_is_the_gap_held(ring):
    """Persistent contact holds the gap that it begins with, which shrinks with the increment."""
    fine = run_deck(DECKS / "ring.inp", ring.base.parent / "fine", h=0.01, t_end=1.5)
    assert 0 < fine.verdict["stand_off"] < 0.5*ring.verdict["stand_off"]
    shut = run_deck(
        DECKS / "ring.inp", ring.base.parent / "shut", h=0.05, t_end=1.5, initiation="ADMISSIBLE")
    assert shut.verdict["stand_off"] <= 1e-10


def test_statics_have_a_verdict(tmp_path):
    run = run_deck(DECKS / "two_blocks_static.inp", tmp_path, options=["--strict"])
    assert run.verdict["verdict"] == "good"
    assert "verdict: good: nothing penetrates" in run.log


def ring_that_stops(folder):
    """The ring with two corrections an increment at most, which cannot be cut."""
    deck = Deck.read(DECKS / "ring.inp")
    deck.replace("TOLERANCE=<tolerance>", "TOLERANCE=<tolerance>, MAXIMUM=2")
    deck.replace("<h>, <t_end>", "<h>, <t_end>, <h>")
    return deck.write(folder / "ring.inp")


def test_failed_run_is_not_called_good(tmp_path):
    path = ring_that_stops(tmp_path)
    done = emcon(path, "--output", tmp_path, "--set=h=0.05")
    assert done.returncode == 3
    run = run_deck(path, tmp_path, code=3, h=0.05)
    assert run.verdict["verdict"] == "not completed"
    assert "the analysis stops" in run.verdict["message"]
    assert "verdict: NOT COMPLETED" in done.stdout and "closes to" not in done.stdout
    assert "verdict: NOT COMPLETED" in run.log and "closes to" not in run.log


def test_verdict_of_an_earlier_run_goes(tmp_path):
    """Nothing that scripts read is left of another run, also where this one fails at once; a deck
    that is refused begins no run, and costs nothing of what was written."""
    good = run_deck(DECKS / "ring.inp", tmp_path, h=0.05, t_end=0.1)
    assert good.verdict["verdict"] == "good" and len(good.history) == 3
    before = good.file(".json").read_bytes()
    run_deck(DECKS / "ring.inp", tmp_path, code=2, h=-0.05)
    assert good.file(".json").read_bytes() == before
    run = run_deck(ring_that_stops(tmp_path), tmp_path, code=3, h=0.05)
    assert run.verdict["verdict"] == "not completed" and len(run.history) == 1


def test_option_strict_is_known_to_restart(ring):
    done = emcon("restart", ring.file(".rst.h5"), "--strict", "--quiet")
    assert done.returncode == 0 and done.stderr == ring.errors
