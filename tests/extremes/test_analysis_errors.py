"""Scenes that cannot be computed, or not as asked: what is said, and what is kept."""

import numpy as np
import pytest
from scene_tools import DECKS, Deck, Run, emcon, run_deck

N_RING_NODE = 320


def ring():
    return Deck.read(DECKS / "ring.inp")


def ring_moved_down(by):
    deck = ring()
    deck.move_nodes(lambda label, x, y: (x, y - by) if label <= N_RING_NODE else (x, y))
    return deck


def run(deck, folder, **parameters):
    """Run a deck that may fail; the files and what was said."""
    path = deck.write(folder / "deck.inp")
    done = emcon(path, "--quiet", *(f"--set={k}={v}" for k, v in parameters.items()))
    return done, Run(folder / "deck", done.stderr)


def assert_told(done, code, *words):
    assert done.returncode == code, done.stderr
    text = done.stderr.strip()
    assert len(text.splitlines()) == 1, text
    for word in words:
        assert word in text, f"'{word}' is missing in: {text}"


# ---- singular static problems -------------------------------------------------------------------


@pytest.mark.parametrize(
    "supports, motions",
    [
        ("BOTTOM, 2", ["move in x"]),
        ("LEFT, 1", ["move in y"]),
        ("21, 1, 2", ["rotate"]),
        ("1, 1\n21, 1", ["move in y"]),
        ("1, 1\n21, 1\n1, 2", []),
        ("21, 2", ["move in x", "rotate"]),
    ],
)
def test_free_motion_is_named(tmp_path, supports, motions):
    deck = Deck.read(DECKS / "patch_pressure.inp")
    deck.replace("LEFT, 1\nBOTTOM, 2", supports)
    done, result = run(deck, tmp_path)
    if not motions:
        assert done.returncode == 0, done.stderr
        return
    assert_told(done, 3, "singular", "body of element 101", *motions)
    for other in {"move in x", "move in y", "rotate"} - set(motions):
        assert other not in done.stderr
    # Seen before the first increment: nothing is begun.
    assert not result.file(".csv").exists()


def test_free_body_beside_a_held_one(tmp_path):
    deck = Deck.read(DECKS / "two_blocks_static.inp")
    deck.remove("*CONTACT PAIR")
    for _ in range(2):
        deck.remove("*CONTACT FILE")
    deck.replace("HEAD, 1\nHEAD, 2, 2, <approach>", "HEAD, 2, 2, <approach>")
    done, _ = run(deck, tmp_path)
    assert_told(done, 3, "singular", "body of element 201", "move in x")


def test_free_motion_that_only_contact_could_stop(tmp_path):
    """In the second step nothing holds the block against a pressure that pulls."""
    deck = Deck.read(DECKS / "two_blocks_static.inp")
    done, result = run(deck, tmp_path, pressure=-10)
    assert_told(done, 3, "body of element 201", "move in y")
    # The first step is kept.
    assert result.history["time"][-1] == 1


# ---- contact at the start -----------------------------------------------------------------------


def test_initial_penetration_is_listed(tmp_path):
    deck = ring_moved_down(0.25)
    done, result = run(deck, tmp_path)
    assert_told(done, 2, "3 slave nodes", "RING_OUTER", "BLOCK_TOP", "1 (0.15)", "ADJUST")
    depth = 0.25 - 0.14815273327803027
    for node in (6, 316):
        assert f"{node} ({depth:.6g})" in done.stderr
    assert "deck.inp:" in done.stderr
    assert not result.file(".csv").exists()


def test_initial_penetration_by_displacement(tmp_path):
    deck = ring()
    deck.insert("*INITIAL CONDITIONS, TYPE=DISPLACEMENT\nRING, 2, -0.125", before="*TIME POINTS")
    done, _ = run(deck, tmp_path)
    assert_told(done, 2, "1 slave node of", "1 (0.025)")


def test_touching_is_no_penetration(tmp_path):
    done, result = run(ring_moved_down(0.1), tmp_path, h=0.05, t_end=0.2)
    assert done.returncode == 0, done.stderr
    assert result.history["active"].max() > 0


def test_adjust_moves_slave_nodes_onto_the_surface(tmp_path):
    deck = ring_moved_down(0.25)
    deck.replace("TYPE=<formulation>", "TYPE=<formulation>, ADJUST=0.0")
    done, result = run(deck, tmp_path, h=0.05, t_end=1)
    assert done.returncode == 0, done.stderr
    assert "ADJUST moves 3 slave nodes, by 0.15 at most" in result.log
    fields = result.fields()
    np.testing.assert_allclose(fields.x[[0, 5, 315], 1], 0, atol=1e-15)
    np.testing.assert_allclose(fields["contact_gap"][0, [0, 5, 315]], 0, atol=1e-15)
    # Free of stress, and the energy is held from there.
    assert result.history["strain"][0] == 0
    total = result.history["total"]
    assert np.abs(total/total[0] - 1).max() <= 1e-10


def test_adjust_closes_gaps_up_to_its_distance(tmp_path):
    deck = ring()
    deck.replace("TYPE=<formulation>", "TYPE=<formulation>, ADJUST=0.12")
    done, result = run(deck, tmp_path, h=0.05, t_end=0.1)
    assert done.returncode == 0, done.stderr
    assert "ADJUST moves 1 slave nodes" in result.log
    gap = result.fields()["contact_gap"][0]
    assert abs(gap[0]) <= 1e-15 and gap[5] > 0.12


def test_master_surface_that_looks_away(tmp_path):
    """The lower side of the foundation as master: its outward normals point down."""
    deck = ring()
    deck.replace("261, 556, 5", "257, 552, 5")
    deck.replace("BLOCK_TOP, S3", "BLOCK_TOP, S1")
    done, _ = run(deck, tmp_path)
    assert_told(done, 2, "normals", "BLOCK_TOP", "point away", "RING_OUTER")


# ---- inverted elements --------------------------------------------------------------------------


@pytest.mark.parametrize("deck_name", ["ring", "spinning_ring"])
def test_element_inverted_by_initial_displacement(tmp_path, deck_name):
    deck = Deck.read(DECKS / f"{deck_name}.inp")
    deck.insert("*INITIAL CONDITIONS, TYPE=DISPLACEMENT\n7, 2, 5.", before="*TIME POINTS")
    done, _ = run(deck, tmp_path)
    assert_told(done, 3, "element", "inverted")


def test_driven_through_itself(tmp_path):
    """A cantilever whose tip is pushed through its wall: cut, then told, results kept."""
    deck = Deck.read(DECKS / "cantilever.inp")
    deck.replace("*CLOAD\nTIP, 2, <load_per_node>", "*BOUNDARY\nTIP, 1, 1, -12.")
    done, result = run(deck, tmp_path)
    assert_told(done, 3, "the analysis stops at time")
    assert 0 < result.history["time"][-1] < 1
    assert result.fields()["displacement"][-1].min() < -1
    assert "increment cut" in result.log


# ---- steps that are too large -------------------------------------------------------------------


@pytest.mark.parametrize("h", [0.5, 1, 2])
def test_large_step_is_cut_and_returns_to_the_grid(tmp_path, h):
    result = run_deck(ring(), tmp_path, h=h, t_end=8)
    history = result.history
    assert history["cuts"].sum() > 0
    assert result.log.count("increment cut at time") == history["cuts"].sum()
    np.testing.assert_array_equal(history["time"], np.arange(len(history))*h)
    assert history["time"][-1] == 8
    total = history["total"]
    assert np.abs(total/total[0] - 1).max() <= 1e-10


def test_grid_times_have_no_drift(tmp_path):
    """0.1 added up is not n times 0.1."""
    result = run_deck(ring(), tmp_path, h=0.1, t_end=2)
    np.testing.assert_array_equal(result.history["time"], np.arange(21)*0.1)


def test_last_increment_meets_the_end(tmp_path):
    result = run_deck(ring(), tmp_path, h=0.3, t_end=1)
    np.testing.assert_array_equal(result.history["time"], [0, 0.3, 2*0.3, 3*0.3, 1])
    total = result.history["total"]
    assert np.abs(total/total[0] - 1).max() <= 1e-10


def test_failed_analysis_keeps_its_results(tmp_path):
    """In flight, where contacts are at play too, two iterations do; in the end they do not, and no
    cut is allowed."""
    deck = ring_moved_down(-1.0)
    deck.replace("TOLERANCE=<tolerance>", "TOLERANCE=<tolerance>, MAXIMUM=2")
    deck.replace("<h>, <t_end>", "<h>, <t_end>, <h>")
    done, result = run(deck, tmp_path, h=0.05, frame=0.1)
    assert_told(done, 3, "the analysis stops at time", "smallest allowed", "Newton")
    history = result.history
    assert len(history) > 5 and history["time"][-1] < 8
    assert result.fields().time[-1] == pytest.approx(history["time"][-1], abs=0.1)
    assert "the analysis stops" in result.log and "verdict" in result.log
    assert f"time {history['time'][-1]:.3g}" in done.stderr


@pytest.mark.long
def test_impact_beyond_reason(tmp_path):
    """Three times the speed of sound: it may fail, with a word."""
    deck = ring()
    deck.replace("RING, 2, -3.", "RING, 2, -300.")
    done, result = run(deck, tmp_path, h=0.1, t_end=0.2)
    assert done.returncode in (0, 3)
    total = result.history["total"]
    assert np.abs(total/total[0] - 1).max() <= 1e-10


def test_increments_of_the_step_are_used_up(tmp_path):
    deck = ring()
    deck.replace("INC=1000000", "INC=7")
    done, result = run(deck, tmp_path, h=0.05)
    assert_told(done, 3, "7", "INC=")
    assert len(result.history) == 8


def test_no_density_in_dynamics(tmp_path):
    deck = ring()
    deck.replace("*DENSITY\n0.01\n*MATERIAL, NAME=STIFF", "*MATERIAL, NAME=STIFF")
    done, _ = run(deck, tmp_path)
    assert_told(done, 2, "SOFT", "DENSITY")


def test_weak_elements_under_pressure(tmp_path):
    """A pressure a thousand times the modulus: cut, told, kept."""
    deck = Deck.read(DECKS / "two_blocks_static.inp")
    done, result = run(deck, tmp_path, pressure=1e6)
    assert_told(done, 3, "the analysis stops at time")
    assert result.history["time"][-1] >= 1
    assert np.isfinite(result.history["strain"]).all()
