"""What bends: short forms of the chapter of elements in the book."""

import sys

import numpy as np
import pytest
from scene_tools import ROOT

sys.path.insert(0, str(ROOT/"tests"/"bench"))

from book import elements  # noqa: E402
from book.common import Runs  # noqa: E402

BENDS = ("CPS4I", "CPE4I", "CPS6", "CPS8", "CPS8R")
CELLS = (50, 1)


@pytest.fixture
def runs(tmp_path):
    made = Runs(tmp_path)
    yield made
    made.pool.shutdown(cancel_futures=True)


@pytest.mark.parametrize("kind", BENDS)
def test_elastica(kind, runs, monkeypatch):
    monkeypatch.setattr(elements, "KINDS", (kind,))
    monkeypatch.setattr(elements, "BEAMS", (CELLS,))
    tip = elements.start_elastica(runs)[kind, CELLS].result().mean(axis=0)
    assert np.abs(np.abs(tip)/elements.LENGTH/elements.ELASTICA - 1).max() <= 0.01


@pytest.mark.parametrize("kind", BENDS)
def test_first_frequency(kind, runs, monkeypatch):
    pytest.importorskip("scipy")
    monkeypatch.setattr(elements, "KINDS", (kind,))
    monkeypatch.setattr(elements, "BEAMS", (CELLS,))
    lines = elements.frequencies(elements.start_frequencies(runs), None)
    assert abs(float(lines[-1].split("|")[2].replace("%", ""))) <= 1


def test_beams_of_macneal_and_harder(runs, monkeypatch):
    """As published: CPS4 for four nodes and full integration, CPS8R for eight with reduced, CPS4I for
    four with incompatible modes."""
    monkeypatch.setattr(elements, "KINDS", ("CPS4", "CPS8R", "CPS4I"))
    rows = [[float(cell) for cell in line.split("|")[2:6]]
            for line in elements.beams(elements.start_beams(runs), None)[2:]]
    assert rows[0] == [0.093, 0.027, 0.034, 0.073]
    assert np.abs(np.array(rows[1]) - 1).max() <= 0.04
    assert rows[2] == [0.993, 0.052, 0.632, 0.888]


def test_beams_in_space(runs, monkeypatch):
    """The twisted beam by all that bend; the quarter of a circle out of its plane, where six elements
    are few, and two that lock."""
    monkeypatch.setattr(elements, "SOLIDS", ("C3D8", "C3D8I", "C3D10", "C3D20", "C3D20R"))
    rows = {line.split("|")[1].strip(): [float(cell) for cell in line.split("|")[2:6]]
            for line in elements.space_beams(elements.start_space_beams(runs), None)[2:]}
    assert max(rows.pop("C3D8")) < 0.4
    part = np.array(list(rows.values()))
    assert np.abs(part[:, 2:] - 1).max() <= 0.02
    assert 0.8 < part.min()
    assert part.max() < 1.01


def test_warned_where_it_locks(runs):
    """Of nearly incompressible kinds those with corners alone; not in plane stress."""
    for kind, locks in [("CPE3", True), ("CPE4", True), ("CPE4H", False), ("CPE4I", False), ("CPE8R", False),
                        ("CPS3", False), ("CPS4", False)]:
        mesh = elements.Mesh(kind, 2, 2, [(0, 0), (1, 0), (1, 1), (0, 1)])
        path = runs.folder/f"{kind}.inp"
        path.write_text(mesh.deck("*ELASTIC\n1., 0.499\n", "*STEP\n*STATIC\n*BOUNDARY\n1, 1, 2\n"
                                  "2, 2\n*NODE FILE\nU\n*END STEP\n"))
        done = elements.run_deck(path, runs.folder/kind)
        assert ("at nu = 0.499 locks" in done.log) == locks, kind
