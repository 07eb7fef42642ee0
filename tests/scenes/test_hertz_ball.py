"""A ball hits a rigid plane: Hertz's law of impact on a coarse mesh; the book has finer ones."""

import subprocess
import sys

import pytest
from scene_tools import DECKS, ROOT, run_deck

sys.path.append(str(ROOT/"tests"/"bench"))
from book import hertz_ball  # noqa: E402

SPEED = 0.01


def test_hertz_impact(tmp_path):
    """At a contact of 0.03 radii with three faces over it; books of momentum and energy close."""
    deck = tmp_path/"ball.inp"
    subprocess.run([sys.executable, DECKS/"make_hertz_ball.py", "--cells", "3", "--speed", str(SPEED),
                    "--increments", "80", "--output", deck], check=True)
    time, force, impulse, energy, back = hertz_ball.measured(
        run_deck(deck, tmp_path, initiation="PERSISTENT"), SPEED)
    assert time == pytest.approx(0, abs=0.06) and force == pytest.approx(0, abs=0.06)
    assert impulse < 1e-12 and energy < 1e-11
    assert back == pytest.approx(-1, abs=1e-3)
