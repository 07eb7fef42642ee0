"""Steady sliding of an elastic block: it flutters by itself where nothing damps it."""

import math

import pytest
from flutter import RISE, fastest, fluttering, rate_of
from friction_scenes import NODES
from scene_tools import run_deck


@pytest.mark.parametrize(("eta", "span", "growth"), [(0.0, 4, 22.15), (2e-3, 8, -19.32)])
@pytest.mark.parametrize("h", [5e-4, 2.5e-4])
def test_flutter_grows_as_its_eigenvalue_says(eta, span, growth, h, tmp_path):
    """Rate and frequency of the linear block, but for its weight, which strains it by G/E = 5e-4; no
    node leaves the floor meanwhile."""
    rate, row = fastest(0.3, eta=eta)
    assert rate.real == pytest.approx(growth, abs=0.01)
    period = 2*math.pi/rate.imag
    run = run_deck(fluttering(h, RISE + (span + 1)*period, eta), tmp_path, **NODES)
    assert run.verdict["verdict"] == "good" and run.verdict["law_violation"] <= 1e-9
    assert (run.history["active"][run.history["time"] > 0.1*RISE] == 5).all()
    assert abs(rate_of(run, row, h) - rate) < 5e-4*abs(rate)
