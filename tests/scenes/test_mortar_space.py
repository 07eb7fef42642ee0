"""Mortar contact in space: patch tests, impacts through rebound, slides, and ways to hold it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from contact_space_scenes import impact, over_the_end, press, slide, stack, turned
from test_contact_space import BALANCE, check_impact, moments, ran, scaled

MORTAR = ", TYPE=MORTAR"
#: Of the largest stress: a thousand roundings.
EVEN = 1.0e-12
#: Where gaps are closed in the mean nodes go in by less than guards let them.
GUARDED = 0.05


@pytest.mark.parametrize(("cells", "kind"), [
    ([(1, 1, 1), (1, 1, 1)], ["C3D8", "C3D8"]), ([(3, 3, 1), (3, 3, 1)], ["C3D8", "C3D8"]),
    ([(2, 2, 2), (3, 3, 2)], ["C3D8", "C3D8"]), ([(4, 4, 1), (3, 3, 1)], ["C3D8", "C3D8"]),
    ([(2, 2, 1), (3, 3, 1)], ["C3D4", "C3D8"]), ([(2, 2, 1), (3, 3, 1)], ["C3D8", "C3D4"]),
    ([(2, 2, 1), (3, 3, 1)], ["C3D8", "C3D10"]), ([(2, 2, 1), (3, 3, 1)], ["C3D8", "C3D20"]),
    ([(2, 2, 1), (3, 3, 1)], ["C3D10", "C3D8"]), ([(2, 2, 1), (3, 3, 1)], ["C3D20", "C3D20R"])])
@pytest.mark.parametrize("is_whole", [False, True])
def test_uniform_pressure(cells: list[tuple[int, int, int]], kind: list[str], is_whole: bool, tmp_path: Path) -> None:
    """Askew, with faces that meet or with the whole outlines as surfaces; pressures at vertices are that of the press."""
    c, s = np.cos(0.4), np.sin(0.4)
    turn = turned(0.7) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    text = press(cells, kind, 0.05, turn, options=MORTAR, is_whole=is_whole)
    run = ran(tmp_path, text.replace("*END STEP", "*CONTACT FILE\nCSTRESS\n*END STEP"))
    fields = run.fields()
    v = fields["cauchy_stress"][-1]
    stress = np.einsum("nij,ia,jb->nab", v[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2]]], turn, turn)
    stress[:, 2, 2] += 25.0
    assert np.abs(stress).max() <= EVEN*25.0
    pressure = fields["contact_pressure"][-1]
    pressure = pressure[np.isfinite(pressure)]
    assert np.count_nonzero(pressure) == (cells[0][0] + 1)*(cells[0][1] + 1)
    assert np.abs(pressure[pressure != 0.0] - 25.0).max() <= EVEN*25.0
    assert run.history["newton"].max() <= 8


@pytest.mark.parametrize(("first", "second"), [("C3D4", "C3D8"), ("C3D8", "C3D4"), ("C3D4", "C3D20R")])
def test_a_ball_bounces_off_a_plate(first: str, second: str, tmp_path: Path) -> None:
    check_impact(ran(tmp_path, impact(first, second, options=MORTAR)), GUARDED)


def test_newton_is_quadratic(tmp_path: Path) -> None:
    """Residuals of steps with contact: each about the square of the one before, or round-off."""
    run = ran(tmp_path, impact("C3D4", "C3D8", "*NEWTON, TYPE=FULL\n", options=MORTAR, cells=3))
    n = 0
    for row, active in zip(run.increments, run.history["active"][1:], strict=True):
        residuals = [float(word) for word in row[-1].split()[9:]]
        if active == 0 or len(residuals) < 4:
            continue
        n += 1
        for before, after in zip(residuals[1:], residuals[2:], strict=False):
            assert after <= max(1.0e3*before**2, 1.0e-14), row[-1]
    assert n > 10


@pytest.mark.parametrize(("kind", "cells", "angle"), [
    ("C3D8", [(2, 2, 2), (2, 2, 2)], 0.0), ("C3D4", [(2, 2, 2), (3, 3, 3)], 0.0), ("C3D4", [(2, 2, 2), (2, 2, 2)], 0.1),
    ("C3D8", [(2, 2, 2), (3, 3, 3)], 0.3)])
def test_cubes_fall_on_cubes(kind: str, cells: list[tuple[int, int, int]], angle: float, tmp_path: Path) -> None:
    """Meshes that match, or do not, with outlines in one plane: flat, and on an edge first."""
    check_impact(ran(tmp_path, stack(cells, 0.03, angle, kind=kind, options=MORTAR)), 2.0e-3)


@pytest.mark.parametrize("is_hill", [False, True])
def test_sliding_over_facets(is_hill: bool, tmp_path: Path) -> None:
    """Over sides of facets that turn by .05 each: nothing is lost, no step is cut."""
    run = ran(tmp_path, slide(0.05, 1.2, is_hill, MORTAR))
    assert run.verdict["verdict"] == "good"
    assert run.verdict["largest_energy_error"] <= 1.0e-13*run.verdict["largest_energy"]
    assert run.history["cuts"].sum() == 0
    assert run.history["active"].max() >= 3
    assert run.fields()["displacement"][-1, 0, 0] > 0.35*4.0*1.2


def test_off_the_end(tmp_path: Path) -> None:
    """Vertices are let go as their faces leave the plate: nothing is lost, no step is cut."""
    run = ran(tmp_path, over_the_end(0.02, 0.9, MORTAR))
    assert run.verdict["verdict"] == "good"
    assert run.verdict["largest_energy_error"] <= 1.0e-13*run.verdict["largest_energy"]
    assert run.history["cuts"].sum() == 0
    assert run.history["active"].max() >= 9
    assert run.history["active"][-1] == 0


@pytest.mark.parametrize("more", [
    "*CONTACT INITIATION, TYPE=PERSISTENT\n", "*CONTACT INITIATION, TYPE=MASSLESS\n",
    "*CONTACT INITIATION, TYPE=ADMISSIBLE\n", "*CONTACT INITIATION, TYPE=VELOCITY UPDATE\n",
    "*CONSTRAINT METHOD, TYPE=SADDLE POINT\n", "*CONSTRAINT METHOD, TYPE=PENALTY\n",
    "*MORTAR, MULTIPLIER=STANDARD\n"])
def test_ways_to_hold(more: str, tmp_path: Path) -> None:
    """Energy and momenta through all of them."""
    run = ran(tmp_path, stack([(1, 1, 1), (2, 2, 1)], 0.03, 0.05, options=MORTAR, more=more))
    history = run.history
    assert run.verdict["verdict"] == "good"
    if "ADMISSIBLE" in more:                     # what is stopped loses a part
        assert np.diff(history["total"]).max() <= BALANCE*history["total"].max()
    else:
        assert np.ptp(history["total"]) <= BALANCE*history["total"].max()
    p, angular = moments(run, "px py pz"), moments(run, "lx ly lz")
    assert history["active"].max() >= 2
    assert np.abs(p - p[0]).max() <= BALANCE*np.abs(p).max()
    assert np.abs(angular - angular[0]).max() <= BALANCE*np.abs(p).max()


def test_momenta_of_explicit_steps(tmp_path: Path) -> None:
    text = stack([(1, 1, 1), (2, 2, 1)], 0.01, 0.05, options=MORTAR)
    run = ran(tmp_path, text.replace("*DYNAMIC, DIRECT\n0.02, 0.6", "*DYNAMIC, DIRECT, EXPLICIT\n0.004, 0.12"))
    p, angular = moments(run, "px py pz"), moments(run, "lx ly lz")
    assert run.history["active"].max() > 0
    assert np.abs(p - p[0]).max() <= BALANCE*np.abs(p).max()
    assert np.abs(angular - angular[0]).max() <= BALANCE*np.abs(p).max()


@pytest.mark.parametrize("is_whole", [False, True])
def test_pressure_by_the_overclosure(is_whole: bool, tmp_path: Path) -> None:
    """What the bodies do not take, E = 1000 and height 1 each, the layer of 500 does; at corners of whole outlines it
    is no softer. Energy of the layer is by the area as it is, whose faces are drawn together by .01 of their size."""
    text = press([(3, 3, 2), (4, 4, 2)], ["C3D8", "C3D8"], 0.02, turned(0.0), is_whole=is_whole, options=MORTAR)
    run = ran(tmp_path, text.replace("NAME=I\n", "NAME=I\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n500.\n", 1))
    assert abs(run.history["pair1_force_z"][-1]) == pytest.approx(0.02/(2/1000 + 1/500), rel=2.0e-3)


def test_bits_do_not_depend_on_units(tmp_path: Path) -> None:
    """In a unit of length and time 1024 times smaller: the same velocities."""
    text = stack([(1, 1, 1), (2, 2, 1)], 0.03, 0.1, options=MORTAR).replace("*NODE FILE\nU\n", "*NODE FILE\nU, V\n")
    found = []
    for power in (0, 10):
        folder = tmp_path/str(power)
        folder.mkdir()
        found.append(ran(folder, scaled(text, power)).fields()["velocity"][-1])
    assert np.array_equal(found[0], found[1])
