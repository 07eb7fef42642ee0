"""Vertex on vertex, head on: bodies that meet so do not leave sideways, whatever the step."""

import pytest
from head_on import FORMS, defect, row
from scene_tools import run_deck

#: Velocities are off by round-off; an impact multiplies what stands aside, and the steps that are
#: long beside the edges solve for it with some digits less.
TOLERANCE = 1e-9


@pytest.mark.parametrize(("n_edge", "h"), [(24, 0.01), (24, 0.3), (24, 1.0), (48, 0.05), (48, 1.0)])
@pytest.mark.parametrize(("form", "sides"), FORMS)
def test_two_discs(tmp_path, form, sides, n_edge, h):
    run = run_deck(row(2, n_edge, h, max(0.3, 2*h)), tmp_path, formulation=form, sides=sides)
    assert defect(run) < TOLERANCE


@pytest.mark.parametrize(("form", "h"), [("NODE TO SURFACE", 0.05), ("SEGMENT", 0.05),
                                         ("MORTAR", 0.01)])
def test_a_chain_of_ten(tmp_path, form, h):
    """Turned, so that coordinates are off by round-off; the last one leaves with all."""
    run = run_deck(row(10, 24, h, 1.3, turn=0.3), tmp_path, formulation=form)
    assert defect(run, 0.3) < TOLERANCE
