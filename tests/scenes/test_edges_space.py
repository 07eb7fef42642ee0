"""Sharp edges that cross, with no node in front of a face: held, with energy and momenta, in dynamics and in statics."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import overlap
import pytest
from contact_space_scenes import bodies, dynamic, faces, pair, velocities
from scene_tools import EPSILON, Run, run_deck
from space_mesh import TETRAHEDRON_EDGES, Block

#: Energy and momenta, of the largest of each.
BALANCE = 1.0e-12
#: Depths that numpy finds where gaps are closed to round-off: positions have the size 2, and gaps hold to 64 roundings.
DEPTH = 256*EPSILON
#: What edges of smooth surfaces may cross by, per facet: more is bad.
CROSSING = 2.0e-2


def ran(folder: Path, text: str, code: int = 0) -> Run:
    deck = folder/"deck.inp"
    deck.write_text(text)
    return run_deck(deck, folder, code)


def tetrahedron(kind: str, x: np.ndarray) -> SimpleNamespace:
    """One element with the corners `x`, in any order."""
    if np.linalg.det(x[1:] - x[0]) < 0:
        x = x[[0, 2, 1, 3]]
    if kind == "C3D10":
        x = np.vstack([x, [0.5*(x[i] + x[k]) for i, k in TETRAHEDRON_EDGES]])
    return SimpleNamespace(kind="C3D4", type=kind, x=x, element=[list(range(1, len(x) + 1))])


def roofs(kind: str, spin: tuple[float, float, float], options: str = "", h: float = 0.01) -> str:
    """A tetrahedron that falls with its lower edge across the upper edge of another one, both free: the middles of the
    edges meet first, and nodes pass by."""
    low = np.array([[-1., 0., 0.], [1., 0., 0.], [0., -0.8, -1.2], [0., 0.8, -1.2]])
    high = low*[1, 1, -1] @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.]]).T + [0.15, 0.1, 0.1]
    two, one = tetrahedron(kind, low), tetrahedron(kind, high)
    sides = [[(1, f) for f in range(1, 5)]]*2
    return (bodies([one, two], sides) + pair(options) + velocities(one, np.array([0.1, 0.05, -1.0]), np.array(spin))
            + dynamic(h, 1.2))


def check_free_flight(run: Run, depth: float = DEPTH, balance: float = BALANCE) -> None:
    """Energy and six momenta to round-off, nothing in each other by the check and by numpy."""
    history = run.history
    assert run.verdict["verdict"] == "good", run.log[-500:]
    assert history["active"].max() > 0
    assert np.ptp(history["total"]) <= balance*history["total"].max()
    for names in ("px py pz", "lx ly lz"):
        moment = np.array([history[k] for k in names.split()])
        assert np.abs(moment - moment[:, :1]).max() <= balance*max(1.0, np.abs(moment).max())
    assert run.verdict["penetration"] <= depth
    assert overlap.worst(run.fields()).depth <= depth


@pytest.mark.parametrize("spin", [(0., 0., 0.), (0.5, 0.8, 1.5)])
@pytest.mark.parametrize("kind", ["C3D4", "C3D10"])
def test_edge_on_edge(kind: str, spin: tuple[float, float, float], tmp_path: Path) -> None:
    check_free_flight(ran(tmp_path, roofs(kind, spin)))


def test_without_edges_bodies_go_into_each_other(tmp_path: Path) -> None:
    """Which the verdict says."""
    run = ran(tmp_path, roofs("C3D4", (0., 0., 0.), ", EDGES=NO"), 3)
    assert run.verdict["verdict"] == "bad"
    assert overlap.worst(run.fields()).depth > 0.1


def bars(kind: str, cells: int, is_exact: bool) -> list[Block]:
    """Two bars that cross flat on each other, the upper one along the second axis; where they touch no node is."""
    gap = 0.0 if is_exact else 0.02
    one = Block(kind, (1, cells, 1), size=(0.5, 2, 0.5), place=lambda x: x + np.array([-0.25, -1., gap]))
    two = Block(kind, (cells, 1, 1), size=(2, 0.5, 0.5), place=lambda x: x - np.array([1., 0.25, 0.5]))
    return [one, two]


@pytest.mark.each_value
@pytest.mark.parametrize("is_exact", [True, False])
@pytest.mark.parametrize(("kind", "cells", "depth"), [
    ("C3D8", 1, DEPTH), ("C3D8", 3, CROSSING), ("C3D10", 1, CROSSING), ("C3D20", 1, CROSSING)])
def test_bars_that_cross_bounce(kind: str, cells: int, depth: float, is_exact: bool, tmp_path: Path) -> None:
    """Where several faces meet in a flat side they bend, and edges between them cross that are not sharp."""
    one, two = bars(kind, cells, is_exact)
    text = bodies([one, two], [faces(one), faces(two)]) + pair() + velocities(
        one, np.array([0., 0., -1.]), np.array([0., 0., 0.])) + dynamic(0.02, 0.6)
    run = ran(tmp_path, text)
    check_free_flight(run, depth)
    assert run.history["active"][-1] == 0


def edge_on_a_face(kind: str, cells: int, yaw: float, off: tuple[float, float]) -> str:
    """A bar that falls edge down across a cube: its edge meets the rims of the face, and what the face bends along."""
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0.], [np.sin(yaw), np.cos(yaw), 0.], [0., 0., 1.]])
    tilt = np.array([[1., 0., 0.], [0., 1., -1.], [0., 1., 1.]])*[1., np.sqrt(0.5), np.sqrt(0.5)]

    def above(x: np.ndarray) -> np.ndarray:
        y = (x - [1., 0.25, 0.25]) @ (turn @ tilt).T
        return y + [*off, 0.02 - y[:, 2].min()]

    low = Block(kind, (cells, cells, 1), size=(1., 1., 1.), place=lambda x: x - [0.5, 0.5, 1.])
    bar = Block(kind, (1, 1, 1), size=(2., 0.5, 0.5), place=above)
    return (bodies([bar, low], [faces(bar), faces(low)]) + pair()
            + velocities(bar, np.array([0., 0., -1.]), np.zeros(3)) + dynamic(0.02, 0.6))


@pytest.mark.parametrize(("kind", "cells", "yaw", "off", "depth"), [
    ("C3D8", 1, 0.3, (0., 0.), DEPTH),           # across the centre of a face
    ("C3D8", 1, 0.5, (0.1, 0.2), DEPTH), ("C3D8", 2, 0.3, (0.05, 0.1), DEPTH), ("C3D4", 2, 0.3, (0.05, 0.1), DEPTH),
    ("C3D20", 1, 0.3, (0.05, 0.1), DEPTH),
    ("C3D10", 1, 0.2, (0., 0.), DEPTH),          # more crossings than classes of edges tell apart
    ("C3D8", 3, 0.3, (0.05, 0.1), 0.25*CROSSING)])   # some cross less than the step before tells
def test_an_edge_on_a_face_that_bends(kind: str, cells: int, yaw: float, off: tuple[float, float], depth: float,
                                      tmp_path: Path) -> None:
    """With sharp edges of both bodies alone it is .01 to .13 of a facet in the other one."""
    run = ran(tmp_path, edge_on_a_face(kind, cells, yaw, off))
    check_free_flight(run, depth)
    assert run.history["active"][-1] == 0


@pytest.mark.parametrize("spin", [(0., 0., 0.), (0., 0., 0.8)])
def test_ridges_that_are_not_sharp(spin: tuple[float, float, float], tmp_path: Path) -> None:
    """Two faces of each body are a roof of 16 degrees; the ridges cross between their nodes. They are let in by as much
    as the verdict lets edges, and held."""
    def roof(x: np.ndarray) -> np.ndarray:
        y = x - [0.5, 0.5, 0.5]
        y[:, 2] -= 0.14*np.abs(y[:, 1])*(y[:, 2] > 0)
        return y

    def above(x: np.ndarray) -> np.ndarray:
        y = roof(x)*[1., 1., -1.]
        return np.stack([-y[:, 1], y[:, 0], y[:, 2]], axis=1) + [0.07, 0.04, 1.02]

    one, two = Block("C3D8", (1, 2, 1), place=above), Block("C3D8", (1, 2, 1), place=roof)
    one.element = [[*e[4:], *e[:4]] for e in one.element]        # mirrored
    text = bodies([one, two], [faces(one), faces(two)]) + pair() + velocities(
        one, np.array([0., 0., -1.]), np.array(spin)) + dynamic(0.02, 0.6)
    run = ran(tmp_path, text)
    check_free_flight(run, CROSSING)
    assert run.history["active"][-1] == 0


@pytest.mark.parametrize("sides", ["whole", "facing"])
def test_a_bar_on_a_bar_at_rest(sides: str, tmp_path: Path) -> None:
    """Four corners of the common square bear a quarter of the load each, whether surfaces are outlines or the two
    faces alone, whose bodies go on beyond them."""
    one, two = bars("C3D8", 1, True)
    surfaces = [faces(one), faces(two)] if sides == "whole" else [faces(one, 2, 0), faces(two, 2, 1)]
    top, bottom = one.on(2, 1), two.on(2, 0) + len(one.x)
    text = bodies([one, two], surfaces, "*ELASTIC\n1000., 0.3\n") + pair()
    text += "*BOUNDARY\n" + "".join(f"{k}, 1, 3\n" for k in bottom) + "".join(f"{k}, 1, 2\n" for k in top)
    text += "*STEP\n*STATIC, DIRECT\n1., 1.\n*CLOAD\n" + "".join(f"{k}, 3, -1.\n" for k in top)
    run = ran(tmp_path, text + "*NODE FILE\nU\n*CONTACT FILE\nCF\n*END STEP\n")
    assert run.verdict["verdict"] == "good"
    force = run.fields()["contact_force"][-1]
    assert force[:len(one.x)].sum(0) == pytest.approx([0, 0, 4], abs=1e-10)
    own = force[:len(one.x), 2]
    low = one.on(2, 0) - 1
    assert own[low] == pytest.approx(np.full(4, 1.0), abs=1e-10)
    assert overlap.worst(run.fields()).depth <= DEPTH


def test_edges_are_for_three_dimensions(tmp_path: Path) -> None:
    text = ("*NODE\n1, 0, 0\n2, 1, 0\n3, 1, 1\n4, 0, 1\n5, 0, 1\n6, 1, 1\n7, 1, 2\n8, 0, 2\n*ELEMENT, TYPE=CPE4, ELSET=A\n"
            "1, 1, 2, 3, 4\n2, 5, 6, 7, 8\n*MATERIAL, NAME=M\n*ELASTIC\n1., 0.\n*DENSITY\n1.\n*SOLID SECTION, ELSET=A, "
            "MATERIAL=M\n1.\n*SURFACE, NAME=S\n1, S3\n*SURFACE, NAME=T\n2, S1\n*SURFACE INTERACTION, NAME=I\n*CONTACT PAIR, "
            "INTERACTION=I, EDGES=NO\nT, S\n*STEP\n*DYNAMIC, DIRECT\n.1, 1.\n*END STEP\n")
    deck = tmp_path/"deck.inp"
    deck.write_text(text)
    run = run_deck(deck, tmp_path, 2)
    assert "EDGES is for three dimensions" in run.errors
