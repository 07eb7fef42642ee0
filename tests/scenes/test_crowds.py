"""Many contacts at once: sets of active constraints that change while a step is solved."""

import sys

import numpy as np
import pytest
from overlap import worst
from scene_tools import EPSILON, ROOT, run_deck

sys.path.insert(0, str(ROOT / "tests" / "bench"))

import crowds  # noqa: E402


@pytest.fixture(scope="module")
def pile(tmp_path_factory):
    """Sixteen discs fall into the bowl, until all have met others."""
    return run_deck(crowds.pile(4), tmp_path_factory.mktemp("pile"), t_end=0.3, frame=0.01)


def test_a_pile_keeps_its_balance_of_energy(pile):
    history = pile.history
    assert history["active"].max() >= 8
    balance = history["kinetic"] + history["strain"] - history["external_work"]
    # Some thousand sums of terms that are rounded once each, per increment.
    assert np.abs(balance).max() <= 1e3*EPSILON*len(history)*history["kinetic"].max()


def test_steps_end_at_round_off_whatever_sets_were_left_on_the_way(pile):
    rows = [line.split() for line in pile.log.splitlines() if line.split()[:1] == ["30"]]
    assert float(rows[-1][-1]) <= 64*EPSILON
    assert pile.verdict["verdict"] == "good", pile.verdict["reasons"]


def test_no_disc_is_inside_another(pile):
    # A contact that begins may be closed by the square root of epsilon of an edge.
    assert worst(pile.fields()).by_edge <= EPSILON**0.5
