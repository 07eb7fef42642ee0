"""Plain scenes of contact, judged by the positions alone: nothing is in, or went through, another.

The scenes, twenty of them, and their runs are those of plain_scenes.py; all of them stand in
docs/verification.md, here are those that a fault shows in first.
"""

import plain_scenes
import pytest
from plain_scenes import ALL, BOTH, SCENES, Outcome

#: What bodies may be in each other where the nodes of one side alone are held: the mesh decides.
MISSED = 0.5

#: Rounding of positions, by an edge: lengths are 30 edges at most, some tens of operations.
ROUNDING = 1e-13

FORMULATIONS = ["NODE TO SURFACE", "SEGMENT", "MORTAR"]


@pytest.mark.parametrize("n", [2, 4])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_crossing_squares_do_not_miss(tmp_path, formulation, n):
    """Bodies that cross each other's way meet, at every step and delay: 25 variants a mesh."""
    missed = {}
    for name, scene in plain_scenes.crossings(n).items():
        done = Outcome(scene, tmp_path / name, formulation=formulation)
        if not done.has_ended or done.way.by_edge > MISSED:
            missed[name] = f"exit code {done.code}, {done.way}"
    assert not missed


@pytest.mark.parametrize("method", ["NULL SPACE", "SADDLE POINT"])
@pytest.mark.parametrize("name", ["tower", "ledge", "slave floor", "drop", "punch", "gears"])
def test_nodes_held_from_both_sides_at_once_need_no_cuts(tmp_path, name, method):
    """Nodes nearly on nodes, in dents that they make: contacts that say the same, and kinks."""
    done = Outcome(SCENES[name](), tmp_path, ALL, formulation="NODE TO SURFACE", method=method)
    assert done.code == 0
    assert done.run.history["cuts"].sum() <= 8
    assert done.energy_error <= 1e-12


@pytest.mark.parametrize("name", ["wedge", "ledge", "bullet", "strips", "corners", "slide off",
                                  "accordion", "edge along edge", "twin", "tower", "crossing"])
@pytest.mark.parametrize("sides", [BOTH, ALL])
def test_two_sided_contact_overlaps_nowhere(tmp_path, sides, name):
    done = Outcome(SCENES[name](), tmp_path, sides, formulation="NODE TO SURFACE")
    assert done.code == 0
    assert done.run.history["active"].max() >= 1
    assert done.overlap.by_edge <= ROUNDING, done.overlap
    assert done.energy_error <= 1e-12
