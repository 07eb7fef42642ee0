"""Rows of docs/stability.md in a short form: each run holds, or the program says why not."""

import sys

import pytest
from scene_tools import ROOT

sys.path[:0] = [str(ROOT / "tests" / "bench"), str(ROOT / "tests" / "scenes")]
from extremes import ROWS, text_of  # noqa: E402
from limits.common import HOLDS, SILENT, run_case  # noqa: E402

CASES = [pytest.param(row, k, id=f"{row.name}-{text_of(row.values[k]).replace(' ', '-')}")
         for row in ROWS for k in row.tested()]


@pytest.mark.parametrize(("row", "k"), CASES)
def test_holds_or_says_why_not(row, k, tmp_path):
    outcome = run_case(row, row.values[k], tmp_path)
    assert outcome.kind != SILENT, outcome
    assert k >= row.reach or outcome.kind == HOLDS, outcome
    assert outcome.kind == HOLDS or outcome.text, outcome
