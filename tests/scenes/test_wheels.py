"""Wheels with corners that slide and roll: some of those of `tests/soak/wheel_table.py`."""

import dataclasses
import math

import numpy as np
import pytest
from scene_tools import run_deck
from wheel_scenes import RADIUS, Wheel, judge, law_missed

#: What round-off may leave in balances and in the law of friction, over their scales.
ROUNDED = 1e-11


@pytest.mark.parametrize("values", [(12, 0.0, 1.0, 0.02), (24, 10.0, 0.2, 0.02), (12, 20.0, 0.5, 0.01),
                                    (48, 0.0, 0.2, 0.01), (48, 10.0, 1.0, 0.02), (48, 20.0, 0.2, 0.02)])
def test_balances_and_the_law_hold(values, tmp_path):
    """By positions, velocities and forces; the last two with steps that are longer than a corner takes."""
    wheel = Wheel(*values)
    run = run_deck(wheel.deck(), tmp_path)
    found, told = judge(wheel, run), run.verdict
    assert told["verdict"] == "good" and told["cuts"] <= 1
    assert max(found.overlap, found.momentum, found.energy, found.law) < ROUNDED, found
    assert told["law_violation"] < ROUNDED
    assert told["largest_energy_error"] < ROUNDED*told["largest_energy"]
    assert told["friction_loss"] > 0.0


@pytest.mark.parametrize("slope", [0.0, 20.0])
def test_of_many_corners_it_goes_as_a_disc(slope, tmp_path):
    """It slides until it rolls. A corner pushes along a line that misses the middle by up to half of a
    side, so that what it does to the spin is off by as much as a corner turns."""
    missed = []
    for sides in (24, 96):
        wheel = Wheel(sides, slope, 0.5, 0.00125, 1.0)
        found = judge(wheel, run_deck(wheel.deck(), tmp_path))
        way = wheel.disc(found.time)[0]
        missed.append(np.abs(found.way - way).max()/way[-1])
        assert missed[-1] < 2*math.pi/sides
    assert missed[1] < 0.5*missed[0]


def test_the_judge_sees_a_wrong_law(tmp_path):
    """Of another coefficient, and of a push that pulls."""
    wheel = Wheel(12, 0.0, 0.5, 0.02)
    run = run_deck(wheel.deck(), tmp_path)
    assert judge(dataclasses.replace(wheel, mu=0.49), run).law > 1e-3
    assert judge(dataclasses.replace(wheel, mu=0.51), run).law > 1e-3
    assert judge(dataclasses.replace(wheel, slope=1.0), run).momentum > 1e-4
    pull = np.array([[0.0, -1.0]])
    assert law_missed(0.5, pull, np.zeros(1), np.full(1, RADIUS)) == 1.0
