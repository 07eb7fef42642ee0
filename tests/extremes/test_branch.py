"""Runs that go on from a restart file in a folder of their own: later ends, further steps."""

import numpy as np
import pytest
from scene_tools import DECKS, Deck, Run, coarse_ring, emcon, run_deck

SHORT = {"h": 0.02, "frame": 0.2}
STATES = ["kinetic", "strain", "total", "px", "py", "lz", "active"]


def ring(**parameters):
    deck = coarse_ring()
    deck.replace("*RESTART, WRITE, FREQUENCY=50", "*RESTART, WRITE, FREQUENCY=5")
    for name, value in {**SHORT, **parameters}.items():
        deck.set_parameter(name, value)
    return deck


@pytest.fixture(scope="module")
def half(tmp_path_factory):
    """The ring until it is in contact."""
    return run_deck(ring(t_end=1), tmp_path_factory.mktemp("half"))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return run_deck(ring(t_end=2), tmp_path_factory.mktemp("whole"))


def go_on(run, folder, *options, code=0):
    done = emcon("restart", run.file(".rst.h5"), "--output", folder, *options)
    assert done.returncode == code, done.stderr
    return Run(folder/run.file(".csv").stem) if code == 0 else done.stderr


def assert_same(history, other, names=STATES):
    for name in names:
        assert (history[name] == other[name]).all(), name


def test_a_later_end_has_the_bits_of_a_longer_run(half, whole, tmp_path):
    before = half.file(".csv").read_bytes()
    run = go_on(half, tmp_path/"on", "--until", "2")
    assert half.history["active"].any()
    later = whole.history[whole.history["time"] > 1 - 1e-9]
    assert run.history["time"][0] == half.history["time"][-1]
    assert_same(run.history, later)
    assert half.file(".csv").read_bytes() == before
    assert run.verdict["verdict"] == "good"


def test_a_branch_can_be_interrupted_and_branched_again(half, whole, tmp_path):
    first = go_on(half, tmp_path/"a", "--until", "1.5")
    again = emcon("restart", first.file(".rst.h5"))
    assert again.returncode == 0
    second = go_on(first, tmp_path/"b", "--until", "2")
    later = whole.history[whole.history["time"] > 1.5 - 1e-9]
    assert_same(second.history, later)


def test_further_steps(half, tmp_path):
    """Gravity from there on, as one deck has it with both steps."""
    more = "*STEP, NLGEOM, INC=1000\n*DYNAMIC, DIRECT\n0.02, 0.2\n" \
        "*DLOAD\nRING, GRAV, 5., 0., -1.\n*NODE FILE\nU\n*END STEP\n"
    (tmp_path/"more.inp").write_text("** further\n" + more)
    run = go_on(half, tmp_path/"on", "--steps", tmp_path/"more.inp")
    deck = ring(t_end=1)
    deck.card += Deck(more).card
    both = run_deck(deck, tmp_path/"both")
    later = both.history[both.history["time"] > 1 - 1e-9]
    assert_same(run.history, later)
    assert run.history["time"][-1] == pytest.approx(1.2, rel=1e-12)
    total = run.history["total"]
    assert np.abs(total - total[0]).max() < 1e-10*run.history["kinetic"].max()


def test_a_later_end_of_an_earlier_step_stays(half, tmp_path):
    """A branch with a later end gets a further step: the step before keeps that end."""
    first = go_on(half, tmp_path/"a", "--until", "1.5")
    (tmp_path/"more.inp").write_text(
        "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n0.02, 0.2\n*NODE FILE\nU\n*END STEP\n")
    run = go_on(first, tmp_path/"b", "--steps", tmp_path/"more.inp")
    assert run.history["time"][[0, -1]] == pytest.approx([1.5, 1.7], rel=1e-12)


@pytest.mark.parametrize(("options", "words"), [
    (["--until", "0.5"], "the run is at time 1 already"),
    (["--until", "1"], "the run is at time 1 already"),
    (["--until", "-1"], "--until takes a time"),
    (["--until", "soon"], "--until takes a time"),
    (["--steps", "none.inp"], "none.inp"),
    (["--set", "h=0.1"], "with the parameters of its run"),
])
def test_what_cannot_be_is_told(half, options, words, tmp_path):
    assert words in go_on(half, tmp_path/"on", *options, code=2)
    assert not (tmp_path/"on").exists()


@pytest.mark.parametrize(("text", "words"), [
    ("*NODE\n1, 0., 0.\n", "is in no step"),
    ("*STEP\n*STATIC\n1., 1.\n", "*END STEP is missing"),
    ("*STEP\n*STATIC\n1., 1.\n*CLOAD\nNONE, 1, 1.\n*END STEP\n", "more.inp:5"),
    ("", "empty"),
    ("*STEP\n*STATIC\n1., 1.\n*NO ANALYSIS\n*END STEP\n", "more.inp:4: error: *NO ANALYSIS is no step"),
])
def test_a_bad_step_is_told_with_its_line(half, text, words, tmp_path):
    (tmp_path/"more.inp").write_text(text)
    assert words in go_on(half, tmp_path/"on", "--steps", tmp_path/"more.inp", code=2)
    assert not (tmp_path/"on").exists()


def test_steps_that_change_the_unknowns_are_refused(tmp_path):
    """A stand-in is made for what is prescribed along a turned axis."""
    deck = coarse_ring()
    deck.replace("*RESTART, WRITE, FREQUENCY=50", "*RESTART, WRITE")
    deck.insert("*TRANSFORM, NSET=BOTTOM, TYPE=R\n1., 1., 0., -1., 1., 0.", before="*BOUNDARY")
    deck.replace("*BOUNDARY\nBOTTOM, 1, 2\n", "")
    run = run_deck(deck, tmp_path/"run", h=0.02, t_end=0.1, frame=0.1, initiation="PERSISTENT")
    (tmp_path/"more.inp").write_text(
        "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n.02, .1\n*BOUNDARY, FIXED\nBOTTOM, 1\n*END STEP\n")
    told = go_on(run, tmp_path/"on", "--steps", tmp_path/"more.inp", code=2)
    assert "change the unknowns of the model, as do conditions along axes of a *TRANSFORM" in told


def test_results_are_not_overwritten(half, tmp_path):
    done = emcon("restart", half.file(".rst.h5"), "--until", "2")
    assert done.returncode == 2 and "--output" in done.stderr
    folder = half.file(".csv").parent
    done = emcon("restart", half.file(".rst.h5"), "--until", "2", "--output", folder)
    assert done.returncode == 2 and "would overwrite" in done.stderr
    (tmp_path/"link").symlink_to(folder)
    history = half.file(".csv").read_bytes()
    for same in (f"{folder}/.", tmp_path/"link"):
        done = emcon("restart", half.file(".rst.h5"), "--until", "2", "--output", same)
        assert done.returncode == 2 and "would overwrite" in done.stderr
    assert half.file(".csv").read_bytes() == history
    deck = tmp_path/"ring.log"
    deck.write_bytes((DECKS/"ring.inp").read_bytes())
    done = emcon(deck, "--set", "t_end=0.02", "--output", f"{tmp_path}/.")
    assert done.returncode == 2 and deck.read_bytes() == (DECKS/"ring.inp").read_bytes()
    done = emcon(DECKS/"ring.inp", "--until", "2", "--output", tmp_path)
    assert done.returncode == 2 and "emcon restart" in done.stderr


def test_a_static_step_has_no_later_end(tmp_path):
    deck = Deck.read(DECKS/"cantilever.inp")
    deck.insert("*RESTART, WRITE, FREQUENCY=1\n", before="*NODE FILE")
    run = run_deck(deck, tmp_path/"first")
    assert "--until is for dynamic steps" in go_on(run, tmp_path/"on", "--until", "3", code=2)
