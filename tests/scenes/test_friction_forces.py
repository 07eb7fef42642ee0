"""Forces of friction that act: mu times the normal ones, in sum and node by node."""

import numpy as np
import pytest
from friction_scenes import dragged
from plain_scenes import BOTH
from scene_tools import run_one_sided

MU = 0.2
MESHED = [{"formulation": "NODE TO SURFACE"}, {"formulation": "SEGMENT"}, {"formulation": "MORTAR"},
          {"formulation": "SEGMENT", "multiplier": "STANDARD"},
          {"formulation": "MORTAR", "multiplier": "STANDARD"},
          {"formulation": "MORTAR", "integration": "ELEMENTS"}]


def ratios(run, floor, since=0.0):
    """Of all increments from a time on: friction by push of the pair, and of each node of the block
    with a push of more than a twentieth of the largest. The floor has the last `floor` nodes."""
    late = run.history["time"] > since + 1e-9
    whole = run.history["pair1_force_x"][late]/run.history["pair1_force_y"][late]
    force = run.fields()["contact_force"][late, :-floor]
    pushed = np.abs(force[..., 1]) > 0.05*np.abs(force[..., 1]).max()
    return np.abs(whole), np.abs(force[..., 0][pushed]/force[..., 1][pushed])


def lean(run):
    """The largest slopes of edges of the surfaces at the height 0, in any frame, of all bodies: they
    lean where they are pressed in over a part of their length, and what a mean gap leaves between
    edges turns its gradient by no more."""
    fields, steepest = run.fields(), 0.0
    place = fields.x + fields["displacement"]
    bodies = fields["body"][-1].ravel()
    for body in np.unique(bodies):
        node = np.unique(np.concatenate([fields.cells[k] for k in np.flatnonzero(bodies == body)]))
        side = node[np.abs(fields.x[node, 1]) < 1e-9]
        edge = np.diff(place[:, side[np.argsort(fields.x[side, 0])]], axis=1)
        steepest += np.abs(edge[..., 1]/edge[..., 0]).max()
    return steepest


def rubs(run, floor=28, since=0.0):
    """In sum and of each node by 1 %; in statics, of each node, by what surfaces lean,
    (mu + s)/(1 - mu s) at a slope s."""
    whole, nodes = ratios(run, floor, since)
    slope = lean(run)
    assert len(whole) > 4 and slope < 0.01
    assert np.abs(whole/MU - 1).max() < 0.01
    assert np.abs(nodes/MU - 1).max() < 0.01
    if since == 0:
        assert np.abs(nodes - MU).max() < slope*(1 + MU*MU)/(1 - MU*slope)
    assert run.verdict["law_violation"] < 1e-9
    assert not any("catch" in text for text in run.verdict["warnings"])


def unguarded(deck):
    """Without guards of corners, whose forces at a node are not those of the pair."""
    deck.replace("*CONTACT PAIR", "*CONTACT PAIR, GUARD=NO")
    return deck


@pytest.mark.each_value
@pytest.mark.parametrize("leaves", [False, True])
@pytest.mark.parametrize("more", MESHED)
def test_a_block_comes_onto_a_floor_or_leaves_it(more, leaves, tmp_path):
    rubs(run_one_sided(unguarded(dragged(MU, leaves=leaves)), tmp_path, **more))


def test_guards_rub_as_their_pair(tmp_path):
    """A corner of the floor under the block bears a part of the push: the sum alone."""
    run = run_one_sided(dragged(MU, cells=(11, 2)), tmp_path, **MESHED[0])
    assert "guards act in" in run.log
    assert np.abs(ratios(run, 28)[0]/MU - 1).max() < 0.01


@pytest.mark.each_value
@pytest.mark.parametrize("leaves", [False, True])
@pytest.mark.parametrize("more", [MESHED[k] for k in (1, 2, 3)])
def test_a_block_of_two_pieces_or_with_inertia(more, leaves, tmp_path):
    """Over the joint of a tie, and damped in a dynamic step, once the start has died away: there
    mortar shares friction among nodes as at the expected end of the step, not as in its middle."""
    tied = unguarded(dragged(MU, leaves=leaves, tied=True))
    rubs(run_one_sided(tied, tmp_path/"tied", **more))
    moving = dragged(MU, leaves=leaves, statics=False, increments=48)
    rubs(run_one_sided(unguarded(moving), tmp_path/"moving", **more), since=0.4)


@pytest.mark.parametrize("cells", [(3, 1), (11, 2)])
def test_other_meshes(cells, tmp_path):
    rubs(run_one_sided(dragged(MU, cells=cells, floor=9), tmp_path), floor=20)


def test_nodes_of_both_sides(tmp_path):
    """The sum alone: nodes are pushed as slaves and as masters."""
    run = run_one_sided(dragged(MU, sides=BOTH), tmp_path, **MESHED[0])
    assert np.abs(ratios(run, 28)[0]/MU - 1).max() < 0.01
