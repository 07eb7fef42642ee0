"""Vertex on vertex, head on: bodies that meet so do not leave sideways, whatever the step."""

import pytest
from head_on import FORMS, defect, row
from scene_tools import run_deck
from test_contact_symmetry import Mesh, assert_symmetric, scene

#: Velocities are off by round-off; an impact multiplies what stands aside, and the steps that are
#: long beside the edges solve for it with some digits less.
TOLERANCE = 1e-9


@pytest.mark.each_value
@pytest.mark.parametrize(("n_edge", "h"), [(24, 0.01), (24, 0.3), (24, 1.0), (48, 0.05), (48, 1.0)])
@pytest.mark.parametrize(("form", "sides"), FORMS)
def test_two_discs(tmp_path, form, sides, n_edge, h):
    run = run_deck(row(2, n_edge, h, max(0.3, 2*h)), tmp_path, formulation=form, sides=sides)
    assert defect(run) < TOLERANCE and run.verdict["verdict"] == "good"


@pytest.mark.parametrize(("form", "h"), [("NODE TO SURFACE", 0.05), ("SEGMENT", 0.05),
                                         ("MORTAR", 0.01)])
def test_a_chain_of_ten(tmp_path, form, h):
    """Turned, so that coordinates are off by round-off; the last one leaves with all."""
    run = run_deck(row(10, 24, h, 1.3, turn=0.3), tmp_path, formulation=form)
    assert defect(run, 0.3) < TOLERANCE


def tip(first, base, n=3, size=0.3):
    """A square of n x n elements that stands on its tip; faces of its rim."""
    mesh = Mesh(first)
    node = [[mesh.node((i, j), size*(i - j), base + size*(i + j)) for j in range(n + 1)]
            for i in range(n + 1)]
    for i in range(n):
        for j in range(n):
            mesh.element.append((node[i][j], node[i + 1][j], node[i + 1][j + 1], node[i][j + 1]))
    sides = {"S1": (0, n), "S2": ((n - 1)*n, 1), "S3": (n - 1, n), "S4": (0, 1)}
    return mesh, [(first + start + k*step, side) for side, (start, step) in sides.items()
                  for k in range(n)]


@pytest.mark.parametrize("h", [0.002, 0.01, 0.05])
@pytest.mark.parametrize("form", ["NODE TO SURFACE", "SEGMENT"])
def test_a_square_on_its_tip_on_a_tip(tmp_path, form, h):
    """Elastic: they rest tip on tip over many steps, and neither gives way to a side."""
    n_step = 24
    gap = 4.5*h
    run = run_deck(scene(tip(1, -1.8), tip(1001, gap), ("UP", "LOW"), h, n_step*h), tmp_path,
                   formulation=form)
    assert_symmetric(run, n_step)
