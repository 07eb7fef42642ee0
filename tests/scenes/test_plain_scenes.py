"""Plain scenes of contact, judged by the positions alone: nothing is in, or went through, another.

The scenes, twenty of them, and their runs are those of plain_scenes.py; all of them stand in
docs/verification.md, here are those that a fault shows in first.
"""

import re

import numpy as np
import plain_scenes
import pytest
from emcon import Stepper
from plain_scenes import ALL, BOTH, ONE, SCENES, UNGUARDED, Outcome
from scene_tools import EPSILON

#: What bodies may be in each other where the nodes of one side alone are held: guards let nodes in
#: by a twentieth of an edge, and the judge cuts a step from 1.2 times that on.
GUARDED = 1.2/20
#: An overlap of this, also on the way, where squares that turn do not go straight, is a miss.
MISSED = 0.5

#: Rounding of positions, by an edge: lengths are 30 edges at most, some tens of operations.
ROUNDING = 1e-13

FORMULATIONS = ["NODE TO SURFACE", "SEGMENT", "MORTAR"]


@pytest.mark.each_value
@pytest.mark.parametrize("n", [2, 4])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_crossing_squares_do_not_miss(tmp_path, formulation, n):
    """Bodies that cross each other's way meet, at every step and delay: 25 variants, of the finer
    mesh every second one."""
    missed = {}
    for name, scene in list(plain_scenes.crossings(n).items())[::n//2]:
        done = Outcome(scene, tmp_path / name, formulation=formulation)
        if not done.has_ended or done.way.by_edge > MISSED:
            missed[name] = f"exit code {done.code}, {done.way}"
    assert not missed


@pytest.mark.each_value
@pytest.mark.parametrize("method", ["NULL SPACE", "SADDLE POINT"])
@pytest.mark.parametrize("name", ["tower", "ledge", "slave floor", "drop", "punch", "gears"])
def test_nodes_held_from_both_sides_at_once_need_no_cuts(tmp_path, name, method):
    """Nodes nearly on nodes, in dents that they make: contacts that say the same, and kinks."""
    done = Outcome(SCENES[name](), tmp_path, ALL, formulation="NODE TO SURFACE", method=method)
    assert done.code == 0
    assert done.run.history["cuts"].sum() <= 8
    assert done.energy_error <= 1e-12


@pytest.mark.each_value
@pytest.mark.parametrize("name", ["wedge", "ledge", "bullet", "strips", "corners", "slide off",
                                  "accordion", "edge along edge", "twin", "tower", "crossing"])
@pytest.mark.parametrize("sides", [BOTH, ALL])
def test_two_sided_contact_overlaps_nowhere(tmp_path, sides, name):
    done = Outcome(SCENES[name](), tmp_path, sides, formulation="NODE TO SURFACE")
    assert done.code == 0
    assert done.run.history["active"].max() >= 1
    assert done.overlap.by_edge <= ROUNDING, done.overlap
    assert done.energy_error <= 1e-12


@pytest.mark.each_value
@pytest.mark.parametrize("name", ["wedge", "ledge", "gears", "accordion", "slave floor",
                                  "slide off"])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_guards_hold_what_pairs_do_not(tmp_path, formulation, name):
    done = Outcome(SCENES[name](), tmp_path, ONE, formulation=formulation)
    assert done.code == 0
    assert done.overlap.by_edge <= GUARDED, done.overlap
    assert done.energy_error <= 1e-12


@pytest.mark.parametrize("sides", [ONE, UNGUARDED])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_corners_on_corners_do_not_slip_in(tmp_path, formulation, sides):
    """Side faces in one line: the nearer way out of a corner is sideways, by round-off."""
    done = Outcome(SCENES["twin"](), tmp_path, sides, formulation=formulation)
    assert done.code == 0
    assert done.run.history["active"].max() >= 5
    assert done.run.history["cuts"].sum() == 0
    assert done.overlap.by_edge <= ROUNDING, done.overlap
    assert done.energy_error <= 1e-12


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_without_guards_bodies_overlap(tmp_path, formulation):
    """What the guards are there for: the test above can fail."""
    done = Outcome(SCENES["ledge"](), tmp_path, UNGUARDED, formulation=formulation)
    assert done.code == 3
    assert done.overlap.by_edge > 0.3
    assert done.run.verdict["guarded_increments"] == 0


def test_guards_that_do_not_act_change_no_bit(tmp_path):
    """The drop goes in nowhere: the same digits with guards and without."""
    runs = [Outcome(SCENES["drop"](), tmp_path/sides, sides, formulation="NODE TO SURFACE").run
            for sides in (ONE, UNGUARDED)]
    assert runs[0].verdict["guarded_increments"] == 0
    assert runs[0].digits() == runs[1].digits()


def test_guards_keep_momenta_and_are_told(tmp_path):
    """Two free squares that fly into each other, corner first."""
    done = Outcome(plain_scenes.crossing(0.01, 0.04, 2), tmp_path, ONE, formulation="SEGMENT")
    assert done.run.verdict["guarded_increments"] > 0
    momentum = done.run.series("BODIES", "MOMENTUM")[1]          # (time, body, px py lz)
    change = np.abs(momentum.sum(1) - momentum[0].sum(0)).max()
    # 18 nodes and 25 increments, each with Newton's rounding of a few dozen operations.
    assert change <= 1e3*EPSILON*np.abs(momentum).max()
    assert "contact: guards stop nodes that the pairs do not" in done.run.log
    advice = re.search(r"guards act in \d+ increments; to avoid that: (.*)", done.run.log)[1]
    assert advice.startswith("TYPE=NODE TO SURFACE, ")


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_what_was_near_before_changes_no_bit(tmp_path, formulation):
    """A restart just before first contact, and a run that was asked for its gaps there."""
    deck = plain_scenes.crossing(0.01, 0.04, 2).deck(ONE)
    deck.set_parameter("formulation", formulation)
    deck = deck.write(tmp_path/"scene.inp")
    with Stepper(deck) as whole, Stepper(deck) as part:
        whole.step()
        whole.step()
        whole.gaps()                             # looks for what is near, with nothing moving
        whole.step()
        part.step()
        part.step()
        part.write_restart(tmp_path/"rest.h5")
        with Stepper.from_restart(tmp_path/"rest.h5") as again:
            again.step()
            assert whole.active.any()
            assert np.array_equal(whole.u, again.u)
            assert np.array_equal(whole.v, again.v)
