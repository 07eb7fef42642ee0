"""Walls in space: shapes without faces, fixed, driven and free, from outside and inside."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
from contact_space_scenes import (RUBBER, ball, bodies, dynamic, faces, quadratic_increments, straight, turned,
                                  velocities)
from emcon.fields import FieldFile
from emcon.scene import read_scene
from scene_tools import EPSILON, Run, emcon, run_deck
from space_mesh import Block
from wall_space_scenes import FIXED, REFERENCE, cube, falling, pair, pin_in_a_hole, plane, sphere, wall

#: Energy and momenta, of the largest of each.
BALANCE = 1.0e-11
#: Depths of nodes whose gaps are closed to round-off, per facet.
DEPTH = 64*EPSILON
GRAVITY = "*DLOAD\nB1, GRAV, 10., 0., 0., -1.\n"
#: A body that keeps its shape where it slides: 1 % of its size by waves of its weight at most.
STIFF = "*HYPERELASTIC, NEO HOOKE\n5e5, 1e-6\n*DENSITY\n1.\n"

DOME = "TYPE=REVOLUTION\n0., 0., -2., 0., 0., 1.\nSTART, 0., 2.\nCIRCL, 2., 0., 0., 0.\n"
TUBE = "TYPE=REVOLUTION\n0., 0., 0., 0., 0., 1.\nSTART, 1.05, -5.\nLINE, 1.05, 5.\n"
#: A table with a rounded rim.
TABLE = "TYPE=REVOLUTION\n0., 0., -2., 0., 0., 1.\nSTART, 0., 2.\nLINE, 0.3, 2.\nCIRCL, 1.3, 1., 0.3, 1.\nLINE, 1.3, -1.\n"
RAIL = "TYPE=CYLINDER\n0., 0., -1., 1., 0., -1.\n0., 1., -1.\nSTART, -5., 1.\nLINE, 0.2, 1.\nCIRCL, 1.2, 0., 0.2, 0.\nLINE, 1.2, -3.\n"
CONE = "TYPE=REVOLUTION\n0., 0., -1.06, 0., 0., 1.\nSTART, 0., 1.\nLINE, 3., -0.5\n"


def ran(folder: Path, text: str, code: int = 0) -> Run:
    deck = folder/"deck.inp"
    deck.write_text(text)
    return run_deck(deck, folder, code)


def refusal(folder: Path, text: str) -> str:
    deck = folder/"deck.inp"
    deck.write_text(text)
    done = emcon(deck, "--quiet", "--output", folder)
    assert done.returncode == 2, done.stderr
    return done.stderr


def rubber_ball(place: tuple[float, float, float], cells: int = 3) -> Block:
    return straight(Block("C3D8", (cells,)*3, size=(2, 2, 2),
                          place=lambda x: ball(x) @ turned(0.15).T + np.array(place)))


def moments(run: Run, names: str) -> np.ndarray:
    return np.array([run.history[name] for name in names.split()]).T


def check_balance(run: Run, is_free: bool = False, pair: int = 1) -> None:
    """Energy; momentum with the impulse of the wall, or all six; nothing is behind the shape; there was a rebound."""
    history = run.history
    assert run.verdict["verdict"] == "good", run.log[-600:]
    assert np.ptp(history["total"]) <= BALANCE*history["total"].max()
    p, angular = moments(run, "px py pz"), moments(run, "lx ly lz")
    push = moments(run, " ".join(f"pair{pair}_impulse_{a}" for a in "xyz"))
    size = np.abs(push).max()
    if is_free:
        assert np.abs(angular - angular[0]).max() <= BALANCE*max(size, np.abs(angular).max())
        push = 0.0*push
    assert np.abs(p - p[0] - push).max() <= 1.0e-12*size
    assert run.verdict["penetration"] <= DEPTH
    assert history["cuts"].sum() == 0
    assert history["active"].max() > 0


@pytest.mark.parametrize(("shape", "place", "velocity"), [
    (plane(), (0., 0., 1.06), (0.6, 0.25, -1.)), (sphere(2., (0., 0., -2.)), (0.3, 0., 1.06), (0., 0.25, -1.)),
    (sphere(1.1, inside=True), (0., 0., 0.), (0.5, 0.25, -1.)), (DOME, (0.3, 0., 1.06), (0., 0.25, -1.)),
    (TABLE, (0.2, 0., 1.06), (0.6, 0.25, -1.)), (CONE, (0., 0.2, 1.3), (0.3, 0., -1.)),
    (TUBE, (0., 0., 0.), (1., 0.25, -1.)), (RAIL, (0.1, 0., 1.06), (0.6, 0.25, -1.))])
def test_a_ball_bounces_off(shape: str, place: tuple[float, float, float], velocity: tuple[float, float, float],
                            tmp_path: Path) -> None:
    check_balance(ran(tmp_path, falling(rubber_ball(place), shape, velocity, (0., 0.4, 1.), until=0.9)))


def test_moments_about_axes(tmp_path: Path) -> None:
    """A wall without friction does not turn a body about an axis of its own: of a sphere all, of a tube its axis."""
    run = ran(tmp_path, falling(rubber_ball((0.05, 0., 0.)), sphere(1.1, inside=True), (0.5, 0.25, -1.), (0., 0., 1.), until=0.9))
    assert np.ptp(moments(run, "lx ly lz"), axis=0).max() <= BALANCE
    run = ran(tmp_path, falling(rubber_ball((0.02, 0., 0.)), TUBE, (1., 0.25, -1.), (0., 0., 1.), until=0.9))
    assert np.ptp(run.history["lz"]) <= BALANCE
    assert np.ptp(run.history["pz"]) <= BALANCE
    assert run.history["active"].max() > 0


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_a_cube_lands(angle: float, tmp_path: Path) -> None:
    """Flat, where nothing turns, and on an edge first."""
    run = ran(tmp_path, falling(cube(gap=0.03 + 0.5*np.sin(angle), turn=turned(angle)), plane(), (0., 0., -1.)))
    check_balance(run)
    if angle == 0.0:
        assert np.ptp(moments(run, "px py lx ly lz"), axis=0).max() <= BALANCE


def test_a_plane_is_a_large_face(tmp_path: Path) -> None:
    """As a fixed mesh of one element: by nodes, or by means over patches, which see how the face of the cube bulges."""
    block = cube()
    plate = Block("C3D8", (1, 1, 1), size=(8, 8, 1), place=lambda x: x - np.array([4., 4., 1.]))
    mesh = (bodies([block, plate], [faces(block), faces(plate, 2, 1)]) + pair(", SIDES=ONE").replace("S1, W", "S1, S2")
            + velocities(block, (0., 0., -1.), (0., 0., 0.)) + "*BOUNDARY\nN2, 1, 3\n" + dynamic(0.02, 0.6))
    one = ran(tmp_path, falling(block, plane(), (0., 0., -1.)))
    other = ran(tmp_path, mesh)
    assert np.abs(one.history["pz"] - other.history["pz"]).max() < 1.0e-6
    assert np.ptp(one.history["pz"]) > 1.8


@pytest.mark.parametrize("shape", [plane((0., 0., 0.)), sphere(2., (0., 0., -2.)), TABLE, RAIL])
def test_a_free_wall(shape: str, tmp_path: Path) -> None:
    """A rigid body with mass and a shape: energy and all six momenta of both."""
    one = rubber_ball((0.2, 0.1, 1.06))
    two = Block("C3D8", (2, 2, 2), size=(2, 2, 1), place=lambda x: x - np.array([1., 1., 2.5]))
    text = bodies([one, two], [faces(one), []]).replace("*SURFACE, NAME=S2\n", "")
    run = ran(tmp_path, text + wall(shape, (0.1, 0., -0.5), "ELSET=B2, ") + pair()
              + velocities(one, (0.3, 0.25, -1.), (0., 0.4, 1.)) + dynamic(0.02, 0.9))
    check_balance(run, is_free=True)
    assert run.history["active"][-1] == 0


def test_a_rigid_body_meets_a_wall(tmp_path: Path) -> None:
    """Both are rigid: a cube that falls askew onto a plane, and into a bowl."""
    for shape, gap in ((plane(), 0.3), (sphere(2., (0., 0., 0.5), inside=True), 0.0)):
        block = cube((1, 1, 1), gap, turned(0.3))
        text = bodies([block], [faces(block)]) + "*NODE\n80000, 0., 0., 0.8\n*RIGID BODY, ELSET=B1, REF NODE=80000\n" + wall(shape)
        text += pair() + "*INITIAL CONDITIONS, TYPE=VELOCITY\n" + "".join(
            f"80000, {a}, {v}\n" for a, v in enumerate((0.4, 0.3, -1., 0.5, 1., 0.2), 1))
        check_balance(ran(tmp_path, text + f"*BOUNDARY\n{FIXED}" + dynamic(0.01, 1.5)))


def test_a_driven_wall(tmp_path: Path) -> None:
    """What a wall that moves does on a body is all in the ledger."""
    run = ran(tmp_path, "*AMPLITUDE, NAME=RAMP\n0., 0., 1., .8\n" + falling(
        cube(), plane(), (0., 0., 0.), support=f"{REFERENCE}, 1, 2\n{REFERENCE}, 4, 6\n",
        more=f"*BOUNDARY, AMPLITUDE=RAMP\n{REFERENCE}, 3, 3, 1.\n"))
    history = run.history
    energy = history["kinetic"] + history["strain"]
    assert np.abs(history["external_work"] - energy).max() <= BALANCE*energy.max()
    # The push of the wall times its way: the work of one that does not stop.
    work = 0.8*np.sum(np.diff(history["pz"]))
    assert history["external_work"][-1] == pytest.approx(work, rel=1.0e-11)
    # A bounce: nearly twice the speed of the wall.
    assert history["pz"][-1] > 1.2


def test_a_paddle(tmp_path: Path) -> None:
    """A plane that turns about an edge of the cube's floor and throws it: all work is in the ledger."""
    run = ran(tmp_path, "*AMPLITUDE, NAME=RAMP\n0., 0., 1., 1.\n" + falling(
        cube(), plane((-0.5, 0., 0.)), (0., 0., 0.), support=f"{REFERENCE}, 1, 4\n{REFERENCE}, 6\n",
        more=f"*BOUNDARY, AMPLITUDE=RAMP\n{REFERENCE}, 5, 5, -1.2\n").replace(
            f"*NODE\n{REFERENCE}, 0.0, 0.0, -3.0\n", f"*NODE\n{REFERENCE}, -0.5, 0., 0.\n"))
    history = run.history
    energy = history["kinetic"] + history["strain"]
    assert run.verdict["verdict"] == "good", run.log[-600:]
    assert np.abs(history["external_work"] - energy).max() <= BALANCE*energy.max()
    # Pushed by a plane whose normal turns from z to -x.
    assert history["pz"][-1] > 0.4 and history["px"][-1] < -0.05
    seen = FieldFile(run.file(".surfaces.vtkhdf"))
    of_wall = seen.point("node", 0) < 0
    place = (seen.points + seen.point("displacement", -1))[of_wall] - [-0.5, 0., 0.]
    angle = 1.2*seen.times[-1]
    assert np.abs(place @ [-np.sin(angle), 0., np.cos(angle)]).max() <= 1.0e-13
    body = (run.fields().x + run.fields()["displacement"][-1])[:27] - [-0.5, 0., 0.]
    assert (body @ [-np.sin(angle), 0., np.cos(angle)]).min() >= -1.0e-13


def test_walls_are_seen(tmp_path: Path) -> None:
    """As faces on the shape in the file of surfaces, which move with it; the picture has those that face the eye."""
    run = ran(tmp_path, falling(rubber_ball((0., 0., 0.)), sphere(2.1, inside=True), (0.5, 0.25, -1.), until=0.1))
    seen = FieldFile(run.file(".surfaces.vtkhdf"))
    of_wall = seen.point("node", 0) < 0
    assert np.linalg.norm(seen.points[of_wall], axis=1) == pytest.approx(2.1, rel=8*EPSILON)
    cells = [cell for cell in seen.cells if of_wall[cell].any()]
    assert len(cells) == 6*8*8 and all(of_wall[cell].all() for cell in cells)
    assert np.isnan(seen.cell("contact_pressure", -1)[-len(cells):]).all()
    assert set(seen.cell("surface", 0)[-len(cells):]) == {2}
    scene = read_scene(FieldFile(run.file(".vtkhdf")), [0, -1])
    drawn = [len(order) for order in scene.order]
    outer = len(seen.cells) - len(cells)
    assert drawn[0] == drawn[1] and outer + 0.4*len(cells) < drawn[0] < outer + 0.6*len(cells)

    (tmp_path/"driven").mkdir()
    run = ran(tmp_path/"driven", "*AMPLITUDE, NAME=RAMP\n0., 0., 1., .8\n" + falling(
        cube(), plane(), (0., 0., 0.), until=0.1, support=f"{REFERENCE}, 1, 2\n{REFERENCE}, 4, 6\n",
        more=f"*BOUNDARY, AMPLITUDE=RAMP\n{REFERENCE}, 3, 3, 1.\n"))
    seen = FieldFile(run.file(".surfaces.vtkhdf"))
    of_wall = seen.point("node", 0) < 0
    assert (seen.points[of_wall, 2] == 0).all() and np.ptp(seen.points[of_wall, :2], axis=0).min() > 2
    assert seen.point("displacement", -1)[of_wall, 2] == pytest.approx(0.08, rel=1e-12)


def on_sphere(angle: float, radius: float, size: float, inside: bool = False) -> Block:
    """A small cube whose four lower nodes are on a sphere, away from its top; or from its bottom, inside."""
    block = Block("C3D8", (1, 1, 1), size=(size,)*3)
    end = np.sqrt(radius**2 - 0.5*size**2)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]] if inside else [[c, 0, s], [0, 1, 0], [-s, 0, c]])
    block.x = (block.x - np.array([0.5*size, 0.5*size, 0.]) + np.array([0., 0., -end if inside else end])) @ turn.T
    return block


def test_slides_off_a_sphere(tmp_path: Path) -> None:
    """A small body that slides down without friction leaves where cos = 2/3, after 48.19 degrees."""
    start, size = 0.1, 0.01
    block = on_sphere(start, 1.0, size)
    radius = np.linalg.norm(block.x.mean(0))
    arm = radius**2 + size**2/6.0
    rate = np.array([0., np.sqrt(20.0*radius*(1.0 - np.cos(start))/arm), 0.])
    run = ran(tmp_path, falling(block, sphere(1.0), tuple(np.cross(rate, block.x.mean(0))), tuple(rate), h=0.002,
                                until=0.7, law=STIFF, more=GRAVITY))
    history = run.history
    last = np.flatnonzero(history["active"] > 0)[-1]
    assert last + 1 < len(history)
    height = radius*np.cos(start) - history["external_work"][last:last + 2]/(10.0*size**3)
    assert np.degrees(np.arccos(height/radius)).mean() == pytest.approx(48.19, abs=0.2)
    assert np.abs(history["total"] - history["total"][0]).max() <= BALANCE*history["kinetic"].max()


def test_bowl_pendulum(tmp_path: Path) -> None:
    """A small body that swings in a bowl: the period of a pendulum."""
    size, start, h = 0.02, 0.1, 0.01
    block = on_sphere(start, 1.0, size, inside=True)
    radius = np.linalg.norm(block.x.mean(0))
    run = ran(tmp_path, falling(block, sphere(1.0, inside=True), (0., 0., 0.), h=h, until=2.1, law=STIFF, more=GRAVITY))
    time, p = run.history["time"], run.history["px"]
    k = np.flatnonzero(p[1:-1]*p[2:] < 0.0) + 1
    turns = time[k] - p[k]*(time[k + 1] - time[k])/(p[k + 1] - p[k])
    period = 2.0*np.pi*np.sqrt((radius**2 + size**2/6.0)/(10.0*radius))*(1.0 + start**2/16.0)
    assert turns[1] == pytest.approx(period, rel=2.0e-3)
    assert run.history["active"][1:].min() == 4


def indented(cells: int) -> tuple[str, float]:
    """A quarter of a block of size 2, finer towards the place where a rigid sphere of radius 1 is pressed in; the force."""
    by, e, nu = 0.01, 1000.0, 0.3

    def grade(x: np.ndarray) -> np.ndarray:
        y = 2.0*x**2.2
        y[:, 2] = -2.0*(1.0 - x[:, 2])**2.2
        return y

    block = Block("C3D8", (cells,)*3, place=grade)
    text = bodies([block], [faces(block, 2, 1)], f"*ELASTIC\n{e}, {nu}\n")
    for name, axis in (("LEFT", 0), ("FRONT", 1), ("BOTTOM", 2)):
        text += f"*NSET, NSET={name}\n" + "".join(f"{k}\n" for k in block.on(axis, 0))
    text += wall(sphere(1.0, (0., 0., 1.)), (0., 0., 2.5)) + pair() + "*BOUNDARY\nLEFT, 1\nFRONT, 2\nBOTTOM, 1, 3\n"
    text += f"{REFERENCE}, 1, 2\n{REFERENCE}, 4, 6\n*STEP, NLGEOM\n*STATIC, DIRECT\n.5, 1.\n*BOUNDARY\n{REFERENCE}, 3, 3, {-by}\n"
    return text + "*NODE FILE\nU\n*END STEP\n", e/(1.0 - nu**2)/3.0*by**1.5


def test_hertz(tmp_path: Path) -> None:
    """A rigid sphere pressed into an elastic block: the force of Hertz, on a mesh with five elements in the contact's radius.

    Off by 7.5 % there, by 4.5 % with twelve elements, of the first a twelfth of the radius."""
    text, force = indented(8)
    run = ran(tmp_path, text)
    assert run.verdict["verdict"] == "good"
    assert -run.history["pair1_force_z"][-1] == pytest.approx(force, rel=0.09)


def test_pin_in_a_hole(tmp_path: Path) -> None:
    """Too large by .2 %: its nodes come to the hole itself, and the pressure is that of a disc in plane strain."""
    radius, e, nu = 1.002, 1000.0, 0.3

    block, text = pin_in_a_hole(4, radius, e, nu)
    fields = ran(tmp_path, text).fields()
    n = len(block.x)
    rim = np.flatnonzero(np.abs(np.linalg.norm(block.x[:, :2], axis=1) - radius) < 1.0e-9)
    at = (fields.x + fields["displacement"][-1])[:n][rim]
    assert np.abs(np.linalg.norm(at[:, :2], axis=1) - 1.0).max() <= DEPTH
    pressure = np.array(fields["contact_pressure"][-1]).ravel()[:n][rim]
    assert pressure == pytest.approx((radius - 1.0)/radius*e/((1.0 + nu)*(1.0 - 2.0*nu)), rel=0.04)
    force = np.array(fields["contact_force"][-1])[:n][rim]
    assert np.abs(force[:, 0]*at[:, 1] - force[:, 1]*at[:, 0]).max() <= 1.0e-12
    assert np.abs(force[:, 2]).max() <= 1.0e-12


@pytest.mark.parametrize("size", [1.0e-6, 1.0e6])
def test_units(size: float, tmp_path: Path) -> None:
    """The same in other units of length."""
    block = Block("C3D8", (2, 2, 2), place=lambda x: (x + np.array([0., 0., 0.03]))*size)
    law = f"*HYPERELASTIC, NEO HOOKE\n{40*size**2!r}, {0.01/size**2!r}\n*DENSITY\n1.\n"
    run = ran(tmp_path, falling(block, plane(), (0., 0., -size), law=law).replace("0.0, 0.0, -3.0", f"0., 0., {-size!r}"))
    check_balance(run)
    other = ran(tmp_path, falling(cube(), plane(), (0., 0., -1.)))
    assert run.history["pz"]/size**4 == pytest.approx(other.history["pz"], rel=1.0e-9, abs=1.0e-9)


def test_a_corner_of_two_walls(tmp_path: Path) -> None:
    """Two planes hold the nodes on their common line together."""
    block = Block("C3D8", (2, 2, 2), place=lambda x: x + np.array([0.1, 0., 0.1]))
    other = f"*NODE\n91000, -3., 0., 0.\n*SURFACE, NAME=W2, {plane((0., 0., 0.), (1., 0., 0.))}"
    text = falling(block, plane(), (-1., 0.1, -1.), until=1., support=f"{FIXED}91000, ENCASTRE\n").replace(
        pair(), f"{other}*RIGID BODY, ANALYTICAL SURFACE=W2, REF NODE=91000\n{pair()}S1, W2\n")
    history = ran(tmp_path, text).history
    assert np.ptp(history["total"]) <= BALANCE*history["total"].max()
    assert np.ptp(history["py"]) <= BALANCE
    assert history["pair1_active"].max() == history["pair2_active"].max() == 9
    assert history["active"][-1] == 0


def test_over_a_sharp_edge(tmp_path: Path) -> None:
    """A cube slides over the edge of a table, in steps of a fifth of its size, tips and falls."""
    table = "TYPE=CYLINDER\n0., 0., 0., 1., 0., 0.\n0., 1., 0.\nSTART, -5., 0.\nLINE, .2, 0.\nLINE, .2, -5.\n"
    run = ran(tmp_path, falling(cube(gap=0.01), table, (2., 0.2, -.2), h=0.1, until=1.2, more=GRAVITY))
    total = run.history["total"] + 0.0
    assert run.verdict["verdict"] == "good"
    assert np.ptp(total) <= BALANCE*(run.history["kinetic"].max() + run.history["external_work"].max())
    assert run.history["active"].max() >= 6


def test_penalty(tmp_path: Path) -> None:
    """A pressure by the overclosure stores what it takes; a uniform one is uniform at all nodes of a flat face."""
    law = "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n1e4\n"
    run = ran(tmp_path, falling(cube(), plane(), (0., 0., -1.), interaction=law))
    assert run.verdict["verdict"] == "good"
    assert np.ptp(run.history["total"]) <= BALANCE*run.history["total"].max()
    assert run.history["active"][-1] == 0
    block = cube((2, 3, 1), 0.0)
    text = bodies([block], [faces(block)], "*ELASTIC\n1000., 0.\n") + wall(plane()) + pair("", law)
    text += "*NSET, NSET=TOP\n" + "".join(f"{k}\n" for k in block.on(2, 1))
    text += f"*BOUNDARY\nTOP, 1, 2\n{FIXED}*STEP\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\nTOP, 3, 3, -.01\n"
    fields = ran(tmp_path, text + "*NODE FILE\nU\n*CONTACT FILE\nCSTRESS\n*END STEP\n").fields()
    pressure = np.array(fields["contact_pressure"][-1]).ravel()[:len(block.x)][block.on(2, 0) - 1]
    # A spring of the pressure and one of the block, 1e4 and 1000 by its height, one behind the other.
    assert pressure == pytest.approx(0.01/(1.0e-4 + 1.0e-3), rel=1.0e-9)


def test_newton_is_quadratic(tmp_path: Path) -> None:
    """On curved walls, past joints of a profile too: each residual about the square of the one before."""
    run = ran(tmp_path, falling(rubber_ball((0.2, 0., 1.06)), TABLE, (0.6, 0.25, -1.), (0., 0.4, 1.), until=0.9,
                                more="*NEWTON, TYPE=FULL\n"))
    assert quadratic_increments(run) > 5


def test_a_body_held_by_a_bowl(tmp_path: Path) -> None:
    """A cube in a bowl under its weight, with nothing else that holds it but against turning and drift."""
    block = on_sphere(0.0, 2.0, 1.0, inside=True)
    block.x[:, 2] += 0.01
    text = bodies([block], [faces(block)], "*ELASTIC\n1000., .3\n*DENSITY\n1.\n") + wall(sphere(2.0, inside=True)) + pair()
    text += f"*BOUNDARY\n{FIXED}N1, 1, 2\n*STEP\n*STATIC, DIRECT\n1., 1.\n*DLOAD\nB1, GRAV, 10., 0., 0., -1.\n*NODE FILE\nU\n*END STEP\n"
    run = ran(tmp_path, text)
    assert run.verdict["verdict"] == "good"
    assert run.history["pair1_force_z"][-1] == pytest.approx(10.0, rel=1.0e-9)


def test_past_the_end_of_a_profile(tmp_path: Path) -> None:
    """A block that slides off a narrow rail falls."""
    rail = "TYPE=CYLINDER\n0., 0., 0., 1., 0., 0.\n0., 1., 0.\nSTART, -1., 0.\nLINE, 0.4, 0.\n"
    run = ran(tmp_path, falling(cube(gap=0.0), rail, (1.5, 0., 0.), until=1.2, more=GRAVITY))
    assert run.verdict["verdict"] == "good", run.log[-600:]
    assert run.history["active"][1] > 0
    assert run.history["active"][-1] == 0
    total = run.history["total"]
    assert np.ptp(total) <= BALANCE*(total.max() + run.history["external_work"].max())


@pytest.mark.parametrize("shape", [
    "TYPE=CYLINDER\n0., 0., 0., 1., 0., 0.\n0., 1., 0.\nSTART, -{0}, 0.\nLINE, {0}, 0.\n",
    "TYPE=REVOLUTION\n0., 0., 0., 0., 0., 1.\nSTART, 0., 0.\nLINE, {0}, 0.\n",
    "TYPE=SPHERE\n0., 0., -{0}, {0}\n"])
def test_a_wall_that_is_smaller_than_a_face(shape: str, tmp_path: Path) -> None:
    """It goes through a face of 1 between its nodes; the deck is told, and not of one that is wider."""
    for radius, said in ((0.4, "has faces 1 long, and wall W is 0.8 wide"), (0.6, "")):
        deck = tmp_path/"deck.inp"
        deck.write_text(falling(cube((1, 1, 1), gap=0.5), shape.format(radius), (0., 0., -1.), until=0.1))
        done = emcon("check", deck)
        assert done.returncode == 0
        assert said in done.stderr and ("wide" in done.stderr) == bool(said), done.stderr


def test_all_exterior_meets_walls(tmp_path: Path) -> None:
    text = falling(cube(), plane(), (0., 0., -1.)).replace(
        pair(), "*CONTACT\n*CONTACT INCLUSIONS, ALL EXTERIOR\n")
    check_balance(ran(tmp_path, text), pair=2)   # the first one is of the cube with itself


def test_behind_at_the_start(tmp_path: Path) -> None:
    said = refusal(tmp_path, falling(cube(gap=-0.1), plane(), (0., 0., -1.)))
    assert "9 slave nodes of surface S1 penetrate surface W, by 0.1 at most" in said
    ran(tmp_path, falling(cube(gap=-0.01), plane(), (0., 0., -1.), options=", ADJUST=0."))


def test_behind_a_wall_turned_away(tmp_path: Path) -> None:
    """A cube that hangs below the plane: its upper side, which alone is the slave, has gap 0."""
    block = cube(gap=-1.0)
    text = (bodies([block], [faces(block, 2, 1)]) + wall(plane()) + pair() + f"*BOUNDARY\n{FIXED}" + dynamic(0.02, 0.1))
    said = refusal(tmp_path, text)
    assert "overlap at the start by 2 of an edge" in said and "turn the wall round" in said
    ran(tmp_path, text.replace(plane(), plane(normal=(0., 0., -1.))))


def test_fillets(tmp_path: Path) -> None:
    """The rim of a table, and a hollow corner, which is refused without one."""
    sharp = "TYPE=REVOLUTION, FILLET RADIUS=1.\n0., 0., -2., 0., 0., 1.\nSTART, 0., 2.\nLINE, 1.3, 2.\nLINE, 1.3, -1.\n"
    way = []
    for name, shape in (("arc", TABLE), ("fillet", sharp)):
        folder = tmp_path/name
        folder.mkdir()
        text = falling(rubber_ball((1.5, 0.25, 1.06)), shape, (0., 0., -1.))
        way.append(ran(folder, text).fields()["displacement"][-1])
    assert np.abs(way[1] - way[0]).max() <= 1e-12*np.abs(way[0]).max()
    bowl = "TYPE=REVOLUTION, FILLET RADIUS=.5\n0, 0, -.06, 0, 0, 1\nSTART, 0., 0.\nLINE, 3., 0.\nLINE, 3., 2.\n"
    assert "concave corner" in refusal(tmp_path, falling(cube(), bowl.replace(", FILLET RADIUS=.5", ""), (0., 0., -1.)))
    check_balance(ran(tmp_path, falling(cube(), bowl, (0., 0., -1.))))


@pytest.mark.parametrize(("shape", "said"), [
    ("TYPE=REVOLUTION\n0, 0, 0, 0, 0, 1\nSTART, 1., 2.\nLINE, 1., 0.\nLINE, 3., 0.\n", "concave corner at 1, 0"),
    ("TYPE=REVOLUTION\n0, 0, 0, 0, 0, 1\nSTART, -1., 2.\nLINE, 1., 0.\n", "radii below 0"),
    ("TYPE=REVOLUTION\n0, 0, 0, 0, 0, 0\nSTART, 1., 2.\nLINE, 1., 0.\n", "a and b are the same"),
    ("TYPE=REVOLUTION\n0, 0, 0, 0, 0, 1\n", "a profile begins with START"),
    ("TYPE=CYLINDER\n0, 0, 0, 1, 0, 0\n1., 1., 0.\nSTART, 1., 2.\nLINE, 1., 0.\n", "right angle"),
    ("TYPE=PLANE, FILLET RADIUS=1.\n0, 0, 0, 0, 0, 1\n", "FILLET RADIUS= is of TYPE=SEGMENTS, REVOLUTION and CYLINDER"),
    ("TYPE=REVOLUTION, FILLET RADIUS=1.5\n0, 0, 0, 0, 0, 1\nSTART, 0., 0.\nLINE, 1., 0.\nLINE, 1., -3.\n",
     "FILLET RADIUS=1.5 has no room at 1, 0"),
    ("TYPE=REVOLUTION, FILLET RADIUS=-1.\n0, 0, 0, 0, 0, 1\nSTART, 0., 0.\nLINE, 1., 0.\n", "is not 0 or a positive number"),
    ("TYPE=SPHERE\n0., 0., 0., -1.\n", "radius is not above 0"), ("TYPE=SPHERE\n0., 0., 0., 1., UP\n", "INSIDE or OUTSIDE"),
    ("TYPE=PLANE\n0., 0., 0., 0., 0., 0.\n", "normal has no length"), ("TYPE=PLANE\n", "a data line is missing")])
def test_refused(shape: str, said: str, tmp_path: Path) -> None:
    text = refusal(tmp_path, falling(cube(), shape, (0., 0., -1.)))
    assert said in text
    assert text.count("error:") == 1


def test_pairs_refused(tmp_path: Path) -> None:
    text = falling(cube(), plane(), (0., 0., -1.))
    assert "swap the two" in refusal(tmp_path, text.replace("S1, W\n", "W, S1\n"))
    assert "leave out SIDES=BOTH" in refusal(tmp_path, falling(cube(), plane(), (0., 0., -1.), options=", SIDES=BOTH"))
    assert "degrees of freedom, 1 to 6" in refusal(tmp_path, falling(cube(), plane(), (0., 0., -1.), support=f"{REFERENCE}, 1, 2\n"))


def assembled(in_part: str, in_assembly: str) -> str:
    """A cube that is an instance of a part, moved, and falls."""
    nodes = "".join(f"{k}, {x}, {y}, {z}\n" for k, (x, y, z) in enumerate(
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], 1))
    return (f"*PART, NAME=P\n*NODE\n{nodes}*ELEMENT, TYPE=C3D8, ELSET=E\n1, 1, 2, 3, 4, 5, 6, 7, 8\n*SOLID SECTION, ELSET=E, MATERIAL=M\n"
            f"{in_part}*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=I, PART=P\n0., 0., 0.1\n*END INSTANCE\n*NODE\n900, 0., 0., -1.\n"
            f"*NSET, NSET=REF\n900\n{in_assembly}*SURFACE, NAME=S1\nI.E\n*END ASSEMBLY\n*MATERIAL, NAME=M\n{RUBBER}"
            "*SURFACE INTERACTION, NAME=J\n*CONTACT PAIR, INTERACTION=J\nS1, W\n*BOUNDARY\nREF, ENCASTRE\n"
            + dynamic(0.02, 0.3, "*DLOAD\nI.E, GRAV, 10., 0., 0., -1.\n"))


def test_walls_of_assemblies(tmp_path: Path) -> None:
    """Their lines are coordinates, whole numbers too."""
    shape = "*SURFACE, NAME=W, TYPE=SPHERE\n0, 0, -2, 2\n"
    run = ran(tmp_path, assembled("", f"{shape}*RIGID BODY, ANALYTICAL SURFACE=W, REF NODE=REF\n"))
    assert run.verdict["verdict"] == "good"
    assert run.history["active"].max() > 0


@pytest.mark.parametrize(("shape", "moved"), [
    ("PLANE\n1, 2, -7, 0, 2, 9\n", "PLANE\n-2., 2., -6.5, -2., 0., 9.\n"),
    ("SPHERE\n1, 2, 3, 4., OUTSIDE\n", "SPHERE\n-2., 2., 3.5, 4., OUTSIDE\n"),
    ("REVOLUTION\n1, 2, 3, 1.5, 4, 4.25\nSTART, 0., 2.\nLINE, 3., 1.\n", "REVOLUTION\n-2., 2., 3.5, -4., 2.5, 4.75\nSTART, 0., 2.\nLINE, 3., 1.\n"),
    ("CYLINDER\n1, 2, 3, 2, 2, 3\n1, 3, 3\nSTART, 3., 1.\nLINE, 0., 2.\n",
     "CYLINDER\n-2., 2., 3.5, -2., 3., 3.5\n-3., 2., 3.5\nSTART, 3., 1.\nLINE, 0., 2.\n"),
    ("STL, SCALE=2.\n.5, 1., 1.5, 1.5, 1., 1.5, .5, 2., 1.5\n", "STL, SCALE=2.\n-1., 1., 1.75, -1., 2., 1.75, -2., 1., 1.75\n")])
def test_walls_of_parts_move_with_their_instance(shape: str, moved: str, tmp_path: Path) -> None:
    """By (1, 0, .5), then by a quarter turn about z, as written out by hand: (x, y, z) comes to (-y, x + 1, z + .5)."""
    points = []
    for name, text, motion in (("part", shape, "1., 0., .5\n0., 0., 0., 0., 0., 1., 90.\n"), ("moved", moved, "")):
        wall_part = f"*PART, NAME=Q\n*SURFACE, NAME=W, TYPE={text}*END PART\n"
        deck = wall_part + assembled("", f"*INSTANCE, NAME=K, PART=Q\n{motion}*END INSTANCE\n*RIGID BODY, ANALYTICAL SURFACE=K.W, REF NODE=REF\n")
        (tmp_path/name).mkdir()
        ran(tmp_path/name, deck.replace("0., 0., 0.1\n", "20., 0., 0.\n").replace("S1, W\n", "S1, K.W\n"))
        with h5py.File(tmp_path/name/("deck.vtkhdf" if "STL" in text else "deck.surfaces.vtkhdf")) as file:
            points.append(file["VTKHDF/Points"][...])
    assert np.abs(points[0] - points[1]).max() <= 64*EPSILON*np.abs(points[1]).max()
