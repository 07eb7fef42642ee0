"""`*FRICTION` on curves: the capstan's law of a bead on a track, the torque of a hub in a sleeve."""

import math

import h5py
import numpy as np
import pytest
from friction_curves import BUSHES, bead, bead_error, belt_on_drum, bush, bush_torques
from friction_scenes import NODES, balance
from scene_tools import run_deck, run_one_sided


@pytest.mark.parametrize("pad", [0.05, 0.3])
def test_a_bead_on_a_track(pad, tmp_path):
    """Second order at least in increments and edges together, whatever the gap that its pad keeps:
    friction on the node is mu times its push, not more by the curvature times the pad."""
    error = []
    for k, (h, edges) in enumerate([(0.04, 16), (0.02, 32), (0.01, 64)]):
        run = run_deck(bead(h, edges, pad), tmp_path/str(k), **NODES)
        assert run.verdict["verdict"] == "good" and run.verdict["law_violation"] <= 1e-9
        assert balance(run.history) < 1e-12 and "slide, but do not roll" in run.log
        assert run.history["cuts"].sum() == 0
        error.append(bead_error(run, pad))
    assert (np.log2(np.array(error[:-1])/error[1:]) > 2).all(), error
    # Two bounds of the last: h/r turned in an increment, squared, and the dip of an edge.
    assert error[-1] < (0.01/(1 - pad))**2 + (np.pi/64)**2/2


@pytest.mark.parametrize(("smoothing", "more"), [("HERMITE", NODES), ("NONE", NODES),
                                                 ("NONE", {"formulation": "SEGMENT"}),
                                                 ("NONE", {"formulation": "MORTAR"})])
def test_a_hub_turned_in_a_sleeve(smoothing, more, tmp_path):
    """The torque is mu N times the radius, but for the arm of an edge, shorter by half of its tilt
    squared; over a smoothed hub better than that order from mesh to mesh. Single nodes push aside by
    their place on an edge: by the moments of their forces, which act along the edges as they are in
    the middle of an increment, of 0.01 radians. Means of gaps push by a pressure that varies as
    the edges of both dip into their arcs, by that part of the fit, at an arm of up to half an edge."""
    fit, mu = 0.0125 if more["formulation"] == "MORTAR" else 0.02, 0.3
    cells = BUSHES[:2] if smoothing == "HERMITE" else BUSHES[1:2]
    error = []
    for around, edges in cells:
        run = run_deck(bush((around, edges), smoothing, fit=fit), tmp_path/str(edges), **more)
        assert run.verdict["law_violation"] <= 1e-9
        assert run.history["cuts"].sum() == 0
        torque, moments = bush_torques(run, edges)
        tilt = np.pi/edges
        assert len(torque) >= 8
        error.append(np.abs(torque - 1).max())
        if more["formulation"] == "MORTAR":
            dips = tilt**2/2 + (np.pi/around)**2/2
            assert error[-1] < tilt**2/2 + dips/fit*tilt/(2*mu)
        elif smoothing == "NONE":
            assert np.abs(torque - moments).max() < 0.005*tilt
        else:
            assert error[-1] < tilt**2/2
    if len(error) > 1:
        assert np.log2(error[0]/error[1]) > 3


@pytest.mark.parametrize("smoothing", ["NONE", "HERMITE"])
def test_corners_that_catch_are_told(smoothing, tmp_path):
    """Edges that turn by 7.5 degrees have a push of up to 0.066 along the curve: 22 % of a friction
    of 0.3. Smoothed ones have none, and the pulls differ by exp(mu pi)."""
    run = run_one_sided(belt_on_drum(24, 0.3, smoothing), tmp_path)
    told = [text for text in run.verdict["warnings"] if "catch" in text]
    assert len(told) == (smoothing == "NONE")
    assert all("7.5 degrees" in text and "22 %" in text and "HERMITE" in text for text in told)
    if smoothing == "HERMITE":
        with h5py.File(run.file(".h5")) as file:
            pull = -file["sets/B/TOTAL_RF"][-1].reshape(-1)[1]
        assert pull/10 == pytest.approx(math.exp(0.3*math.pi), rel=0.02)
