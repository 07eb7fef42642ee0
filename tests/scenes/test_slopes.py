"""A block on a flat slope: without friction nothing holds it, wherever the nodes of the slope are.

Forces between a flat side and a corner are normal to the side, so that no node of the floor may
hold the block by its corner, whichever node comes to stand there as the block slides on.
"""

import math

import pytest
from scene_tools import Deck, run_deck

G = 10.0


def block(floor, slope, order="BLOCK, FLOOR", mu=0.0, lean=0.0, procedure="*STATIC\n1., 1."):
    """A square on edges from `floor` to `floor`, x of their nodes, on a slope of so many degrees.

    Its sides lean over by `lean` at the top.
    """
    n = len(floor)
    nodes = [(0.0, 0.0), (1.0, 0.0), (1.0 + lean, 1.0), (-lean, 1.0)]
    nodes += [(x, y) for x in floor for y in (-1.0, 0.0)]
    lines = ["*NODE", *(f"{k}, {x!r}, {y!r}" for k, (x, y) in enumerate(nodes, 1))]
    lines += ["*ELEMENT, TYPE=CPE4, ELSET=BLOCK", "1, 1, 2, 3, 4"]
    lines += ["*ELEMENT, TYPE=CPE4, ELSET=FLOOR"]
    lines += [f"{k + 2}, {2*k + 5}, {2*k + 7}, {2*k + 8}, {2*k + 6}" for k in range(n - 1)]
    lines += ["*NSET, NSET=HELD, GENERATE", f"5, {2*n + 4}"]
    lines += ["*SURFACE, NAME=BLOCK", "BLOCK", "*SURFACE, NAME=FLOOR", "FLOOR, S3"]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", "2e4, 0.3", "*DENSITY", "1."]
    lines += [f"*SOLID SECTION, ELSET={name}, MATERIAL=M" for name in ("BLOCK", "FLOOR")]
    lines += ["*SURFACE INTERACTION, NAME=I", *(["*FRICTION", repr(mu)] if mu else [])]
    lines += ["*CONTACT PAIR, INTERACTION=I", order, "*BOUNDARY", "HELD, 1, 2"]
    along, down = math.sin(math.radians(slope)), math.cos(math.radians(slope))
    lines += ["*STEP, NLGEOM", procedure, "*DLOAD", f"BLOCK, GRAV, {G}, {along!r}, {-down!r}"]
    return Deck("\n".join([*lines, "*CONTACT FILE", "CF", "*END STEP", ""]))


@pytest.mark.parametrize("order", ["BLOCK, FLOOR", "FLOOR, BLOCK"])
@pytest.mark.parametrize("floor, slope, lean", [
    ([-2, 1.5, 6], 6.0, 0.0),                    # the corner slides up to a node,
    ([-2, 1, 6], 20.0, 0.0),                     # or stands on it
    ([-2, 1 + 1e-6, 6], 1.0, 0.0),
    ([-2, 0.25, 6], 6.0, 0.0),
    ([-2, 7], 6.0, 0.0),                         # only the end of the floor is in its way
    ([-2, -1, 0, 1, 2], 1.0, 0.3),               # blunt and sharp corners
    ([-3, 0, 0.5, 1.5, 3], 6.0, -0.3),
])
def test_without_friction_nothing_holds_a_block(floor, slope, lean, order, tmp_path):
    """The step is refused, and says why."""
    run = run_deck(block(floor, slope, order, lean=lean), tmp_path, code=3)
    assert "is free to move" in run.errors
    assert "*BOUNDARY" in run.errors


@pytest.mark.parametrize("floor, order", [([-2, 1.5, 6], "BLOCK, FLOOR"), ([-2, 1, 6], "FLOOR, BLOCK"),
                                          ([-2, 0, 1, 6], "BLOCK, FLOOR")])
def test_friction_holds_it(floor, order, tmp_path):
    """Above the tangent of the slope: the force of contact is the weight, upwards."""
    run = run_deck(block(floor, 20.0, order, mu=0.5), tmp_path)
    sign = 1.0 if order.startswith("B") else -1.0
    force = [sign*run.history[f"pair1_force_{axis}"][-1] for axis in "xy"]
    turn = math.radians(20.0)
    # Newton's method ends at 1e-10 of the forces.
    assert abs(force[0] + G*math.sin(turn)) <= 1e-9*G
    assert abs(force[1] - G*math.cos(turn)) <= 1e-9*G


def test_in_time_it_slides(tmp_path):
    """By g sin of the slope, past the node."""
    run = run_deck(block([-2, 1.05, 6], 6.0, procedure="*DYNAMIC\n.05, .5"), tmp_path)
    exact = G*math.sin(math.radians(6.0))*0.5
    assert abs(run.history["px"][-1] - exact) <= 1e-9*exact
