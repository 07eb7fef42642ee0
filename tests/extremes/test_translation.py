"""The ring scene far from the origin: coordinates lose digits, the energy does not."""

import numpy as np
import pytest
from scene_tools import coarse_ring, run_deck

ELEMENT = 1.0


@pytest.fixture(scope="module")
def near(tmp_path_factory):
    return run_deck(coarse_ring(), tmp_path_factory.mktemp("near"), h=0.05, t_end=5, frame=1).history


@pytest.mark.parametrize(
    "distance, direction", [(1e4, (-1, 0.75)), (1e8, (1, 0)), (1e8, (0, 1)), (1e8, (-1, 0.75))]
)
def test_energy_is_held(tmp_path, near, distance, direction):
    """At 1e8 element sizes the mesh itself is rounded to 1e-8 of an element."""
    dx, dy = distance*ELEMENT*direction[0], distance*ELEMENT*direction[1]
    deck = coarse_ring()
    deck.move_nodes(lambda _, x, y: (x + dx, y + dy))
    run = run_deck(deck, tmp_path, h=0.05, t_end=5, frame=1)
    history = run.history
    assert np.abs(history["total"]/history["total"][0] - 1).max() <= 1e-10
    assert history["active"].max() >= 2
    assert run.closing(r"deepest penetration (\S+) of an element") <= 1e-12
    # The same impact: mass, momentum, duration.
    assert history["total"][0] == pytest.approx(near["total"][0], rel=1e-6)
    accuracy = 1e-3 if distance > 1e6 else 1e-6
    np.testing.assert_allclose(history["py"][:20], near["py"][:20], rtol=0, atol=accuracy)
    if dx:
        # Angular momentum about the origin: the lever is that long.
        assert history["lz"][0] == pytest.approx(
            near["lz"][0] + dx*near["py"][0] - dy*near["px"][0], rel=1e-6
        )
