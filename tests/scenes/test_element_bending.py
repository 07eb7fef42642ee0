"""What bends: short forms of the chapter of elements in the book."""

import json
import re
import sys

import numpy as np
import pytest
from scene_tools import ROOT, emcon

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


# ---- elements too stiff where they are bent ------------------------------------------------------

SLENDER = [(0, 0), (50, 0), (50, 1), (0, 1)]


def told_of_bending(runs, mesh, steps):
    """The part of strain energy that the verdict tells, 0: none, and all warnings."""
    runs.count += 1
    path = runs.folder/f"bent{runs.count}.inp"
    path.write_text(mesh.deck("*ELASTIC\n1e4, 0.3\n", steps))
    warnings = elements.run_deck(path, runs.folder/f"bent{runs.count}").verdict["warnings"]
    told = [re.search("is bent and made of linear elements, too stiff by about (.*) %", text)
            for text in warnings]
    return sum(float(found[1])/100 for found in told if found), warnings


def drawn(mesh, held, end, dofs, axis, load, nlgeom=", NLGEOM"):
    """Held at some nodes, with a small force on each of the others."""
    rows = "".join(f"{k}, 1, {dofs}\n" for k in held)
    loads = "".join(f"{k}, {axis}, {load/len(end)!r}\n" for k in end)
    return f"*BOUNDARY\n{rows}*STEP{nlgeom}\n*STATIC\n0.5, 1.\n*CLOAD\n{loads}*END STEP\n"


@pytest.mark.parametrize("nlgeom", ["", ", NLGEOM"])
@pytest.mark.parametrize("kind", ["CPE4", "CPS4"])
@pytest.mark.parametrize("n", [12, 25, 50])
def test_part_that_resists_bending(kind, n, nlgeom, runs):
    """One element across, of length l and height 1: against the closed form; clamp and load are a few
    parts in a hundred off."""
    mesh = elements.Mesh(kind, n, 1, SLENDER)
    part, _ = told_of_bending(runs, mesh, drawn(mesh, mesh.side("left"), mesh.side("right"), 2, 2, 1e-3,
                                                nlgeom))
    mu = 1/2.6
    stiff, free = (mu*2*0.7/0.4, 1/(1 - 0.09)) if kind == "CPE4" else (1/(1 - 0.09), 1.0)
    assert part == pytest.approx(1 - free/(stiff + mu*(50/n)**2), rel=0.03)


@pytest.mark.parametrize(("kind", "cells", "is_told"), [
    ("CPE3", (50, 1), True), ("CPE3", (100, 2), True), ("CPE4", (100, 2), False), ("CPE4H", (10, 1), True),
    ("CPE4I", (50, 1), False), ("CPE6", (50, 1), False), ("CPE8R", (50, 1), False), ("CAX4", (50, 1), True),
    ("C3D4", (50, 1, 1), True), ("C3D8", (50, 1, 1), True), ("C3D8H", (10, 1, 1), True),
    ("C3D8I", (50, 1, 1), False), ("C3D10", (20, 1, 1), False)])
def test_slender_body_that_is_bent(kind, cells, is_told, runs):
    if kind.startswith("C3D"):
        mesh = elements.Block(kind, cells, (50, 1, 1))
        steps = drawn(mesh, mesh.on(0, 0), mesh.on(0, 1), 3, 2, 1e-3)
    else:
        corners = np.add(SLENDER, (100, 0)) if kind == "CAX4" else SLENDER
        mesh = elements.Mesh(kind, *cells, corners)
        steps = drawn(mesh, mesh.side("left"), mesh.side("right"), 2, 2, 1e-3)
    part, warnings = told_of_bending(runs, mesh, steps)
    assert (part > 0) == is_told, warnings


@pytest.mark.parametrize("kind", ["CPE3", "CPE4", "CPS4", "C3D4", "C3D8"])
@pytest.mark.parametrize("shape", ["block", "bar"])
def test_what_is_pressed_is_not_told(kind, shape, runs):
    """A compact block and a slender bar, each under pressure along its length."""
    n, length = (4, 1.0) if shape == "block" else (50, 50.0)
    across = 4 if shape == "block" else 1
    if kind.startswith("C3D"):
        mesh = elements.Block(kind, (n, across, across), (length, 1, 1))
        held, end, dofs = mesh.on(0, 0), mesh.on(0, 1), 3
    else:
        mesh = elements.Mesh(kind, n, across, [(0, 0), (length, 0), (length, 1), (0, 1)])
        held, end, dofs = mesh.side("left"), mesh.side("right"), 2
    part, warnings = told_of_bending(runs, mesh, drawn(mesh, held, end, dofs, 1, -1.0))
    assert part == 0, warnings


@pytest.mark.parametrize("kind", ["CPE3", "CPE4", "C3D4", "C3D8"])
def test_bar_that_a_wave_runs_through_is_not_told(kind, runs):
    """One end stops at once: the front is a jump, and rings."""
    if kind.startswith("C3D"):
        mesh = elements.Block(kind, (50, 1, 1), (50, 1, 1))
        held = mesh.on(0, 0)
    else:
        mesh = elements.Mesh(kind, 50, 1, SLENDER)
        held = mesh.side("left")
    rows = "".join(f"{k}, 1\n" for k in held)
    part, warnings = told_of_bending(
        runs, mesh, f"*BOUNDARY\n{rows}*INITIAL CONDITIONS, TYPE=VELOCITY\nNALL, 1, -1.\n*STEP, NLGEOM\n"
        "*DYNAMIC, DIRECT\n0.01, 0.15\n*END STEP\n")
    assert part == 0, warnings


def test_what_is_bent_is_told_by_check(runs):
    mesh = elements.Mesh("CPE4", 50, 1, SLENDER)
    path = runs.folder/"check.inp"
    path.write_text(mesh.deck("*ELASTIC\n1e4, 0.3\n", drawn(mesh, mesh.side("left"), mesh.side("right"), 2, 2,
                                                             1e-3)))
    told = json.loads(emcon("check", "--json", path).stdout)
    assert any(row.get("bending_percent", 0) > 30 for row in told["advice"])
