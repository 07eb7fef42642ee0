"""Supports of whole faces in three dimensions: walls along the axes, and the same at any slope."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scene_tools import run_deck
from space_mesh import KINDS, Block

RUBBER = "*HYPERELASTIC, NEO HOOKE\n20., 0.01\n"
GRAVITY = np.array([-1.0, -2.0, -3.0])
PRESSURE = 0.5


def turn() -> np.ndarray:
    """Some rotation."""
    q = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    return q*np.sign(np.linalg.det(q))


def in_a_corner(kind: str, q: np.ndarray, procedure: str, folder: Path):
    """A cube in the corner of three walls that `q` turns, under gravity and a pressure on face P2 of its first
    element; walls along the axes are supports, others equations."""
    mesh = Block(kind, (2, 2, 2))
    held = [(k, a) for a in range(3) for k in mesh.on(a, 0)]
    mesh.x = mesh.x @ q.T
    if np.array_equal(q, np.eye(3)):
        walls = "*BOUNDARY\n" + "".join(f"{k}, {a + 1}\n" for k, a in held)
    else:
        terms = [", ".join(f"{k}, {i + 1}, {float(q[i, a])!r}" for i in np.argsort(-np.abs(q[:, a]))) for k, a in held]
        walls = "".join(f"*EQUATION\n3\n{term}\n" for term in terms)
    down = ", ".join(repr(float(g)) for g in q @ GRAVITY)
    folder.mkdir()
    deck = folder/"deck.inp"
    deck.write_text(mesh.deck(RUBBER, f"{walls}*STEP, NLGEOM\n{procedure}*DLOAD\n"
                              f"ALL, GRAV, {float(np.linalg.norm(GRAVITY))!r}, {down}\n1, P2, {PRESSURE}\n"
                              "*NODE FILE\nU, RF\n*END STEP\n"))
    return mesh, run_deck(deck, folder)


@pytest.mark.each_value
@pytest.mark.parametrize("procedure", ["*STATIC\n0.5, 1.\n", "*DYNAMIC, DIRECT\n0.05, 1.\n"])
@pytest.mark.parametrize("kind", KINDS)
def test_walls_at_any_slope(kind: str, procedure: str, tmp_path: Path) -> None:
    """Displacements turn with the walls, energies stay, to round-off."""
    q = turn()
    _, straight = in_a_corner(kind, np.eye(3), procedure, tmp_path/"straight")
    _, sloping = in_a_corner(kind, q, procedure, tmp_path/"sloping")
    u = straight.fields()["displacement"][-1]
    assert np.abs(sloping.fields()["displacement"][-1] - u @ q.T).max() <= 1e-12*np.abs(u).max()
    for name in ("kinetic", "strain", "total"):
        now, before = (run.history[name] for run in (sloping, straight))
        assert np.abs(now - before).max() <= 1e-12*straight.history["strain"].max(), name


@pytest.mark.parametrize("kind", ["C3D8", "C3D8H", "C3D8I"])
def test_what_walls_bear(kind: str, tmp_path: Path) -> None:
    """The weight and the pressure that follows its face: times the area vector by its diagonals."""
    mesh, run = in_a_corner(kind, np.eye(3), "*STATIC\n0.5, 1.\n", tmp_path/"run")
    frame = run.fields()
    x = mesh.x + frame["displacement"][-1]
    a, b, c, d = x[[mesh.element[0][k] - 1 for k in (4, 7, 6, 5)]]
    push = PRESSURE*0.5*np.cross(c - a, d - b)
    borne = frame["reaction_force"][-1].sum(axis=0)
    assert np.abs(borne + 0.5*GRAVITY + push).max() <= 1e-11*PRESSURE
