"""Mortar contact in space with walls: pressures on planes, rebounds off shapes, ends of shapes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from contact_space_scenes import bodies, dynamic, faces, quadratic_increments, turned, velocities
from scene_tools import Run
from space_mesh import Block
from test_walls_space import BALANCE, CONE, DOME, GRAVITY, RAIL, TABLE, TUBE, moments, ran, refusal, rubber_ball
from wall_space_scenes import FIXED, cube, falling, pair, pin_in_a_hole, plane, sphere, wall

MORTAR = ", TYPE=MORTAR"
#: Of the largest stress: a thousand roundings.
EVEN = 1.0e-12
#: Where gaps are closed in the mean nodes go in by less than guards let them.
GUARDED = 0.05


def pressed(kind: str, cells: tuple[int, int, int], turn: np.ndarray, is_whole: bool, more: str = "") -> tuple[str, int]:
    """A block of height 1 pressed by .025 onto a plane, both turned; along the plane it moves freely; its number of nodes."""
    block = Block(kind, cells, place=lambda x: x @ turn.T)
    side = faces(block) if is_whole else faces(block, 2, 0)
    text = bodies([block], [side], "*ELASTIC\n1000., 0.\n") + wall(plane((0., 0., 0.), tuple(turn[:, 2].tolist())))
    text += pair(MORTAR) + "*NSET, NSET=TOP\n" + "".join(f"{k}\n" for k in block.on(2, 1))
    text += f"*BOUNDARY\n{FIXED}*STEP\n*STATIC, DIRECT\n1., 1.\n{more}*BOUNDARY\n"
    text += "".join(f"TOP, {a}, {a}, {s!r}\n" for a, s in enumerate((-0.025*turn[:, 2]).tolist(), 1))
    return text + "*NODE FILE\nU\n*EL FILE\nS\n*CONTACT FILE\nCSTRESS, CNAREA\n*END STEP\n", len(block.x)


@pytest.mark.each_value
@pytest.mark.parametrize(("kind", "cells"), [
    ("C3D8", (1, 1, 1)), ("C3D8", (2, 3, 1)), ("C3D4", (2, 2, 1)), ("C3D10", (2, 1, 1)), ("C3D20", (2, 2, 1)),
    ("C3D20R", (1, 2, 1))])
@pytest.mark.parametrize("is_whole", [False, True])
@pytest.mark.parametrize("more", ["", "*MORTAR, MULTIPLIER=STANDARD\n"])
def test_uniform_pressure(kind: str, cells: tuple[int, int, int], is_whole: bool, more: str, tmp_path: Path) -> None:
    """Force by area at every vertex, and no other stress, whatever element stands on the plane."""
    c, s = np.cos(0.4), np.sin(0.4)
    turn = turned(0.7) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    text, n = pressed(kind, cells, turn, is_whole, more)
    fields = ran(tmp_path, text).fields()
    v = fields["cauchy_stress"][-1][:n]
    stress = np.einsum("nij,ia,jb->nab", v[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2]]], turn, turn)
    stress[:, 2, 2] += 25.0
    assert np.abs(stress).max() <= EVEN*25.0
    pressure = np.array(fields["contact_pressure"][-1]).ravel()
    pressure = pressure[np.isfinite(pressure)]
    assert np.count_nonzero(pressure) == (cells[0] + 1)*(cells[1] + 1)
    assert np.abs(pressure[pressure != 0.0] - 25.0).max() <= EVEN*25.0
    assert fields["contact_area"][-1].sum() == pytest.approx(1.0, rel=EVEN)


def check_balance(run: Run, slack: float) -> None:
    """Energy; momentum with the impulse of the wall; no node is deeper than guards allow; there was a rebound."""
    history = run.history
    assert run.verdict["verdict"] == "good", run.log[-600:]
    assert np.ptp(history["total"]) <= BALANCE*history["total"].max()
    p = moments(run, "px py pz")
    push = moments(run, "pair1_impulse_x pair1_impulse_y pair1_impulse_z")
    assert np.abs(p - p[0] - push).max() <= BALANCE*np.abs(push).max()
    assert run.verdict["penetration"] <= slack
    assert history["cuts"].sum() == 0
    assert history["pair1_active"].max() > 0


@pytest.mark.parametrize(("shape", "place", "velocity"), [
    (plane(), (0., 0., 1.06), (0.6, 0.25, -1.)), (sphere(2., (0., 0., -2.)), (0.3, 0., 1.06), (0., 0.25, -1.)),
    (sphere(1.1, inside=True), (0., 0., 0.), (0.5, 0.25, -1.)), (DOME, (0.3, 0., 1.06), (0., 0.25, -1.)),
    (TABLE, (0.2, 0., 1.06), (0.6, 0.25, -1.)), (CONE, (0., 0.2, 1.3), (0.3, 0., -1.)),
    (TUBE, (0., 0., 0.), (1., 0.25, -1.)), (RAIL, (0.1, 0., 1.06), (0.6, 0.25, -1.))])
def test_a_ball_bounces_off(shape: str, place: tuple[float, float, float], velocity: tuple[float, float, float],
                            tmp_path: Path) -> None:
    check_balance(ran(tmp_path, falling(rubber_ball(place, 2), shape, velocity, (0., 0.4, 1.), until=0.7,
                                    options=MORTAR)), GUARDED)


@pytest.mark.parametrize("more", ["", "*MORTAR, MULTIPLIER=STANDARD\n"])
@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi/4])
def test_a_cube_falls(angle: float, more: str, tmp_path: Path) -> None:
    """Flat and on an edge, where the two faces there say the same; linear multipliers leave edges to guards."""
    run = ran(tmp_path, falling(cube(gap=0.03 + 0.5*np.sin(angle), turn=turned(angle)), plane(), (0., 0., -1.), until=0.7,
                                more=more, options=MORTAR))
    check_balance(run, 1.0e-3 if more else 64*np.finfo(float).eps)
    assert run.history["active"][-1] == 0


def test_between_two_walls(tmp_path: Path) -> None:
    """A ball that flies to and fro between two planes: the push of both is the change of momentum."""
    other = f"*NODE\n91000, 0., 0., 5.\n*SURFACE, NAME=W2, {plane((0., 0., 2.2), (0., 0., -1.))}"
    text = falling(rubber_ball((0., 0., 1.06), 2), plane(), (0.3, 0., -1.), (0., 0.4, 1.), until=1.4, options=MORTAR,
                   support=f"{FIXED}91000, ENCASTRE\n").replace(
        pair(MORTAR), f"{other}*RIGID BODY, ANALYTICAL SURFACE=W2, REF NODE=91000\n{pair(MORTAR)}S1, W2\n")
    run = ran(tmp_path, text)
    history = run.history
    assert run.verdict["verdict"] == "good"
    assert np.ptp(history["total"]) <= BALANCE*history["total"].max()
    push = history["pair1_impulse_z"] + history["pair2_impulse_z"]
    assert np.abs(history["pz"] - history["pz"][0] - push).max() <= 1.0e-12*np.abs(push).max()
    assert history["pair1_active"].max() > 0 and history["pair2_active"].max() > 0


@pytest.mark.parametrize("shape", [plane((0., 0., 0.)), sphere(2., (0., 0., -2.)), TABLE, RAIL])
def test_a_free_wall(shape: str, tmp_path: Path) -> None:
    """A rigid body with mass and a shape: energy and all six momenta of both."""
    one = rubber_ball((0.2, 0.1, 1.06), 2)
    two = Block("C3D8", (2, 2, 2), size=(2, 2, 1), place=lambda x: x - np.array([1., 1., 2.5]))
    text = bodies([one, two], [faces(one), []]).replace("*SURFACE, NAME=S2\n", "")
    run = ran(tmp_path, text + wall(shape, (0.1, 0., -0.5), "ELSET=B2, ") + pair(MORTAR)
              + velocities(one, (0.3, 0.25, -1.), (0., 0.4, 1.)) + dynamic(0.02, 0.7))
    history = run.history
    assert run.verdict["verdict"] == "good", run.log[-600:]
    assert np.ptp(history["total"]) <= BALANCE*history["total"].max()
    for names in ("px py pz", "lx ly lz"):
        found = moments(run, names)
        assert np.abs(found - found[0]).max() <= BALANCE*np.abs(moments(run, "px py pz")).max()
    assert history["active"].max() > 0 and history["active"][-1] == 0


def test_a_rigid_body_meets_a_wall(tmp_path: Path) -> None:
    """Both are rigid: a cube that falls askew onto a plane."""
    block = cube((1, 1, 1), 0.3, turned(0.3))
    text = bodies([block], [faces(block)]) + "*NODE\n80000, 0., 0., 0.8\n*RIGID BODY, ELSET=B1, REF NODE=80000\n" + wall(plane())
    text += pair(MORTAR) + "*INITIAL CONDITIONS, TYPE=VELOCITY\n" + "".join(
        f"80000, {a}, {v}\n" for a, v in enumerate((0.4, 0.3, -1., 0.5, 1., 0.2), 1))
    check_balance(ran(tmp_path, text + f"*BOUNDARY\n{FIXED}" + dynamic(0.01, 1.0)), 1.0e-3)


def test_newton_is_quadratic(tmp_path: Path) -> None:
    """On curved walls, past joints of a profile too: each residual about the square of the one before."""
    run = ran(tmp_path, falling(rubber_ball((0.2, 0., 1.06), 2), TABLE, (0.6, 0.25, -1.), (0., 0.4, 1.), until=0.7,
                                more="*NEWTON, TYPE=FULL\n", options=MORTAR))
    assert quadratic_increments(run) > 5


def test_penalty(tmp_path: Path) -> None:
    """A pressure by the overclosure stores what it takes; at corners of a whole outline it is no softer."""
    law = "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n1e4\n"
    run = ran(tmp_path, falling(cube(), plane(), (0., 0., -1.), interaction=law, options=MORTAR))
    assert run.verdict["verdict"] == "good"
    assert np.ptp(run.history["total"]) <= BALANCE*run.history["total"].max()
    assert run.history["active"].max() > 0 and run.history["active"][-1] == 0
    text, n = pressed("C3D8", (2, 3, 1), np.eye(3), True)
    fields = ran(tmp_path, text.replace("NAME=I\n", f"NAME=I\n{law}", 1)).fields()
    pressure = np.array(fields["contact_pressure"][-1]).ravel()[:n]
    # A spring of the pressure and one of the block, 1e4 and 1000 by its height, one behind the other. The energy of the
    # layer is by the area as it is: closed by .002 of a face it draws that together at its rim.
    assert pressure[pressure != 0.0] == pytest.approx(0.025/(1.0e-4 + 1.0e-3), rel=5.0e-3)


def test_past_the_end_of_a_profile(tmp_path: Path) -> None:
    """A block that slides off a narrow rail falls."""
    rail = "TYPE=CYLINDER\n0., 0., 0., 1., 0., 0.\n0., 1., 0.\nSTART, -1., 0.\nLINE, 0.4, 0.\n"
    run = ran(tmp_path, falling(cube(gap=0.0), rail, (1.5, 0., 0.), until=1.2, more=GRAVITY, options=MORTAR))
    assert run.verdict["verdict"] == "good", run.log[-600:]
    assert run.history["active"][1] > 0 and run.history["active"][-1] == 0
    total = run.history["total"]
    assert np.ptp(total) <= BALANCE*(total.max() + run.history["external_work"].max())


def test_pin_in_a_hole(tmp_path: Path) -> None:
    """Too large by .2 %, its facets off the pin by more than that: what facets are off is left out."""
    radius, e, nu = 1.002, 1000.0, 0.3

    block, text = pin_in_a_hole(8, radius, e, nu, MORTAR)
    fields = ran(tmp_path, text).fields()
    pressure = np.array(fields["contact_pressure"][-1]).ravel()[:len(block.x)]
    rim = np.abs(np.linalg.norm(block.x[:, :2], axis=1) - radius) < 1.0e-9
    assert pressure[rim] == pytest.approx((radius - 1.0)/radius*e/((1.0 + nu)*(1.0 - 2.0*nu)), rel=0.05)


def test_pairs_refused(tmp_path: Path) -> None:
    text = falling(cube(), plane(), (0., 0., -1.), options=MORTAR)
    assert "swap the two" in refusal(tmp_path, text.replace("S1, W\n", "W, S1\n"))
