"""Laws of rubber in runs: energy and momenta in large motion, and Ogden's law as neo-Hooke's."""

import numpy as np
import pytest
from scene_tools import coarse_spinning_ring, run_deck

LAWS = {
    "neo hooke": ["*HYPERELASTIC, NEO HOOKE", "50., 0.004"],
    "mooney-rivlin": ["*HYPERELASTIC, MOONEY-RIVLIN", "40., 10., 0.004"],
    "yeoh": ["*HYPERELASTIC, YEOH", "50., -2., 1., 0.004, 0.1, 0.1"],
    "ogden 1": ["*HYPERELASTIC, OGDEN", "100., 2., 0.004"],
    "ogden 3": ["*HYPERELASTIC, OGDEN, N=3", "75., 1.3, 12.5, 4., 12.5, -2., 0.004, 0.1", "0.1"],
}


def ring(law, folder, h, t_end):
    """A ring that spins and vibrates, made of `law`."""
    deck = coarse_spinning_ring()
    deck.remove("*HYPERELASTIC")
    deck.insert("\n".join(LAWS[law]), before="*DENSITY")
    return run_deck(deck, folder, h=h, t_end=t_end, frame=t_end)


@pytest.mark.parametrize("law", [pytest.param(law, marks=[pytest.mark.long]*(law == "ogden 3")) for law in LAWS])
def test_energy_and_momenta_stay(tmp_path, law):
    """16 increments, 12 a turn."""
    history = ring(law, tmp_path, 0.5, 8).history
    for name in ("px", "py", "lz", "total"):
        drift = np.abs(history[name] - history[name][0]).max()
        assert drift <= 1e-12*abs(history[name][0]), name
    assert history["strain"].max() > 1e-3*history["total"][0]


def test_ogden_with_exponent_two_is_neo_hooke(tmp_path):
    """Two forms of one energy: their runs differ by less than the step leaves of error."""
    def end(law, h):
        run = ring(law, tmp_path / f"{law}{h}".replace(" ", ""), h, 0.4)
        return run.fields()["displacement"][-1]

    coarse = end("neo hooke", 0.02)
    left = np.abs(end("neo hooke", 0.01) - coarse).max()
    assert np.abs(end("ogden 1", 0.02) - coarse).max() < left < 0.01*np.abs(coarse).max()
