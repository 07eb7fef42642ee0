"""Friction by mortar in space: patches that are sheared, slopes, slides to a stop, throws, and ways to hold it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from contact_blocks import FieldsOf
from contact_space_scenes import ball, bodies, dynamic, faces, pair, turned, velocities
from scene_tools import Run
from space_mesh import Block
from test_contact_output import restart
from test_contact_space_rigid import columns, rigid
from test_friction_space import GRAVITY, STIFF, dissipates, ran, slab, weight
from test_walls_space import DOME, TABLE
from wall_space_scenes import FIXED, REFERENCE, plane, sphere, wall
from wall_space_scenes import pair as on_wall

MORTAR = ", TYPE=MORTAR"
RUBS = "*FRICTION\n0.3\n"


def wide(cells: tuple[int, int, int] = (3, 3, 1), size: float = 4.0) -> Block:
    return Block("C3D8", cells, size=(size, size, .5), place=lambda x: x - np.array([size/2, size/2, .5]))


def held(one: Block, two: Block, nodes: np.ndarray | None = None) -> str:
    """Nodes of the second block, all of them unless told."""
    nodes = np.arange(1, len(two.x) + 1) if nodes is None else nodes
    return "*BOUNDARY\n" + "".join(f"{len(one.x) + k}, 1, 3\n" for k in nodes)


def sheared(mu: float, pressure: float, slide: float, lower: int, turn: float) -> tuple[Block, str]:
    """A block with no Poisson's ratio under `pressure` on a wide one that is held; its top is drawn along until it slides by
    `slide`, or by so much less than that. Its sides bear the shear that goes with that of its bottom."""
    shear, cells, size = mu*pressure, (3, 3, 2), np.array([1, 1, .5])
    c, s = np.cos(turn), np.sin(turn)
    axes = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.]])
    one = Block("C3D8", cells, size=tuple(size), place=lambda x: (x - np.array([.5, .5, 0]))@axes.T)
    two = wide((lower, lower, 1))
    load = np.zeros_like(one.x)
    for axis, end, force in ((2, 1, -pressure), (0, 1, shear*.5), (0, 0, -shear*.5)):
        for k in one.on(axis, end):
            at = (one.x[k - 1]@axes + np.array([.5, .5, 0]))/size
            part = [(.5 if min(at[a], 1 - at[a]) < 1e-9 else 1.)/cells[a] for a in range(3) if a != axis]
            load[k - 1, 2] += force*np.prod(part)
    way = (slide + shear/500.*.5)*axes[:, 0]
    text = bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)], "*ELASTIC\n1000., 0.\n") + pair(MORTAR, f"*FRICTION\n{mu!r}\n")
    text += held(one, two) + "*STEP\n*STATIC\n.25, 1.\n*BOUNDARY\n"
    text += "".join(f"{k}, {a}, {a}, {float(way[a - 1])!r}\n" for k in one.on(2, 1) for a in (1, 2)) + "*CLOAD\n"
    text += "".join(f"{k}, 3, {float(load[k - 1, 2])!r}\n" for k in np.flatnonzero(load[:, 2]) + 1)
    return one, text + "*NODE FILE\nU\n*CONTACT FILE\nCSTRESS, CSHEAR, CSLIP\n*END STEP\n"


@pytest.mark.parametrize(("lower", "turn"), [(4, .3), (12, 0.)])
def test_a_sheared_patch_slides(lower: int, turn: float, tmp_path: Path) -> None:
    """Over faces that do not match: pressure, and friction of mu times it, at each vertex, and the slip."""
    mu, pressure, slide = .3, 25., .35
    one, text = sheared(mu, pressure, slide, lower, turn)
    run = ran(tmp_path, text)
    fields, low = run.fields(), np.array(one.on(2, 0)) - 1
    assert np.abs(fields["contact_pressure"][-1, low] - pressure).max() < 1e-10*pressure
    shear, slip = fields["contact_shear"][-1, low], fields["contact_slip"][-1, low]
    assert np.abs(np.linalg.norm(shear, axis=1) - mu*pressure).max() < 1e-10*pressure
    # Increments are met to 1e-10 or so of what is moved.
    assert np.abs(np.linalg.norm(slip, axis=1) - slide).max() < 1e-9
    # Loads and ways are in proportion to time, and each increment is by the forces at its end.
    t = run.history["time"]
    assert run.history["friction_loss"][-1] == pytest.approx(mu*pressure*slide*(t[1:]*np.diff(t)).sum(), rel=1e-9)
    moved = fields["displacement"][-1, low]
    assert np.abs(moved - slide*np.array([np.cos(turn), np.sin(turn), 0])).max() < 1e-9


def test_a_sheared_patch_sticks(tmp_path: Path) -> None:
    """Drawn by half as far as it could bear: no vertex moves along the surface."""
    one, text = sheared(.3, 25., -.3*25./500.*.25, 4, .3)
    run = ran(tmp_path, text)
    low = np.array(one.on(2, 0)) - 1
    assert np.abs(run.fields()["displacement"][-1, low]).max() < 1e-12
    assert abs(run.history["friction_loss"][-1]) < 1e-13


def on_plate(mu: float, until: float, v: tuple, slope: float = 0.0, is_rigid: bool = True, w: tuple = (0, 0, 0),
             h: float = .01) -> str:
    """A slab on faces that are held."""
    one, two = slab(), wide()
    flies = rigid(1, one, v=v, w=w) if is_rigid else velocities(one, np.array(v, float), np.array(w, float))
    return (bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)], STIFF) + flies + pair(MORTAR, f"*FRICTION\n{mu!r}\n")
            + held(one, two) + dynamic(h, until, weight(slope)))


@pytest.mark.parametrize("slope", [.499, .501])
def test_slope(slope: float, tmp_path: Path) -> None:
    """A rigid slab with mu = .5 slides where the slope is above it, with the acceleration of a particle."""
    angle, until = float(np.arctan(slope)), 0.1
    run = ran(tmp_path, on_plate(.5, until, (0, 0, 0), angle))
    wanted = max(0.0, np.sin(angle) - .5*np.cos(angle))*GRAVITY*until
    assert abs(run.history["px"][-1]/.5 - wanted) < 1e-11*GRAVITY*until
    dissipates(run)


def test_slides_to_a_stop(tmp_path: Path) -> None:
    """By v^2/(2 mu g), but for what the last increment is stopped in."""
    mu, v, h = .3, 1.0, .01
    run = ran(tmp_path, on_plate(mu, .4, (v, 0, 0)))
    moved = run.fields()["displacement"][-1, :len(slab().x)]
    assert np.abs(moved[:, 0] - v*v/(2*mu*GRAVITY)).max() < .5*mu*GRAVITY*h*h
    assert np.abs(moved[:, 1:]).max() < 1e-12
    assert run.history["friction_loss"][-1] == pytest.approx(.5*.5*v*v, rel=1e-12)
    dissipates(run)


@pytest.mark.parametrize("is_rigid", [True, False])
def test_thrown_with_a_spin_through_the_stop(is_rigid: bool, tmp_path: Path) -> None:
    run = ran(tmp_path, on_plate(.3, .5, (1., .2, 0), is_rigid=is_rigid, w=(0, 0, 1.)))
    # What holds the rates of a rigid body as it stops takes the square of what its turn leaves of them.
    kept = columns(run, "kinetic strain friction_loss restitution_loss").sum(1) - run.history["external_work"]
    assert np.abs(kept - kept[0]).max() < 1e-11*kept[0]
    assert 0.0 <= run.history["restitution_loss"][-1] < (1e-9 if is_rigid else 1e-11)*kept[0]
    assert run.history["kinetic"][-1] < (1e-9 if is_rigid else .05)*kept[0]
    assert max(run.history["cuts"]) == 0
    assert run.verdict["verdict"] == "good"
    assert run.verdict["law_violation"] < 1e-8
    dissipates(run)


def on_plane(mu: float, until: float, v: tuple, slope: float = 0.0, is_rigid: bool = True, w: tuple = (0, 0, 0),
             turn: np.ndarray | None = None) -> str:
    """A slab on a plane wall, all of it turned."""
    turn = np.eye(3) if turn is None else turn
    one = slab()
    one.x[:] = one.x@turn.T
    v, w, pull = (tuple((turn@np.array(a)).tolist()) for a in (v, w, (np.sin(slope), 0.0, -np.cos(slope))))
    flies = rigid(1, one, v=v, w=w) if is_rigid else velocities(one, np.array(v, float), np.array(w, float))
    return (bodies([one], [faces(one, 2, 0)], STIFF) + wall(plane(normal=tuple(turn[:, 2].tolist()))) + flies
            + on_wall(MORTAR, f"*FRICTION\n{mu!r}\n") + f"*BOUNDARY\n{FIXED}"
            + dynamic(.01, until, f"*DLOAD\nB1, GRAV, {GRAVITY!r}, {', '.join(map(repr, pull))}\n"))


def askew() -> np.ndarray:
    c, s = np.cos(.7), np.sin(.7)
    return turned(.4)@np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.]])


@pytest.mark.parametrize("turn", [np.eye(3), askew()], ids=["flat", "askew"])
@pytest.mark.parametrize("slope", [.49, .499, .501])
def test_slope_of_a_wall(slope: float, turn: np.ndarray, tmp_path: Path) -> None:
    """A rigid slab with mu = .5 slides where the slope is above it, with the acceleration of a particle."""
    angle, until = float(np.arctan(slope)), 0.1
    run = ran(tmp_path, on_plane(.5, until, (0, 0, 0), angle, turn=turn))
    p = columns(run, "px py pz")[-1]@turn/.5
    wanted = max(0.0, np.sin(angle) - .5*np.cos(angle))*GRAVITY*until
    assert np.abs(p - np.array([wanted, 0, 0])).max() < 1e-11*GRAVITY*until
    dissipates(run)


@pytest.mark.parametrize("turn", [np.eye(3), askew()], ids=["flat", "askew"])
def test_slides_to_a_stop_on_a_wall(turn: np.ndarray, tmp_path: Path) -> None:
    """By v^2/(2 mu g), but for what the last increment is stopped in."""
    mu, v, h = .3, 1.0, .01
    run = ran(tmp_path, on_plane(mu, .4, (v, 0, 0), turn=turn))
    moved = run.fields()["displacement"][-1, :len(slab().x)]@turn
    assert np.abs(moved[:, 0] - v*v/(2*mu*GRAVITY)).max() < .5*mu*GRAVITY*h*h
    assert np.abs(moved[:, 1:]).max() < 1e-12
    assert run.history["friction_loss"][-1] == pytest.approx(.5*.5*v*v, rel=1e-12)
    dissipates(run)


@pytest.mark.parametrize(("v", "w"), [((1., 0, 0), (0, 0, 0)), ((1., .2, 0), (0, 0, 1.)), ((.2, 0, 0), (0, 0, 4.))])
@pytest.mark.parametrize("options", ["", MORTAR])
def test_stops_within_the_limit(options: str, v: tuple, w: tuple, tmp_path: Path) -> None:
    """A tall rigid block: friction that stops it tips it by less than what slid, and is at each node within the limit of the
    push that is left there, which changes in the increment of the stop."""
    mu, one = .3, Block("C3D8", (2, 2, 2), size=(1, 1, 1.5), place=lambda x: x - np.array([.5, .5, 0]))
    text = (bodies([one], [faces(one, 2, 0)], STIFF) + wall(plane()) + rigid(1, one, v=v, w=w)
            + on_wall(options, f"*FRICTION\n{mu!r}\n") + f"*BOUNDARY\n{FIXED}" + dynamic(.01, .5, weight()))
    run = ran(tmp_path, text.replace("U\n*END", "U\n*CONTACT FILE\nCSTRESS, CSHEAR\n*END"))
    fields, low = run.fields(), np.array(one.on(2, 0)) - 1
    push, drag = fields["contact_pressure"][1:, low], np.linalg.norm(fields["contact_shear"][1:, low], axis=-1)
    assert push.min() > -1e-10*push.max()
    assert (drag - mu*push).max() < 1e-12*push.max()
    assert np.ptp(push[5], axis=0) > .2*push.mean()
    # All goes by friction, but what holds the rates of a rigid body as it stops: a power of its turn in an increment.
    start = run.history["kinetic"][0]
    assert run.history["kinetic"][-1] < 1e-24*start
    assert run.history["restitution_loss"][-1] < (.01*np.linalg.norm(w))**4*start + 1e-24
    assert abs(run.history["friction_loss"][-1] + run.history["restitution_loss"][-1] - start) < 1e-11*start
    dissipates(run)


@pytest.mark.parametrize("is_rigid", [True, False])
def test_thrown_with_a_spin_on_a_wall(is_rigid: bool, tmp_path: Path) -> None:
    run = ran(tmp_path, on_plane(.3, .5, (1., .2, 0), is_rigid=is_rigid, w=(0, 0, 1.)))
    kept = columns(run, "kinetic strain friction_loss restitution_loss").sum(1) - run.history["external_work"]
    assert np.abs(kept - kept[0]).max() < 1e-11*kept[0]
    assert run.history["kinetic"][-1] < (1e-9 if is_rigid else .05)*kept[0]
    assert max(run.history["cuts"]) == 0
    assert run.verdict["verdict"] == "good"
    assert run.verdict["law_violation"] < 1e-8
    dissipates(run)


def test_a_driven_wall_drags(tmp_path: Path) -> None:
    """A plane moved at .8 below a slab at rest: that gains mu g per time, and the plane does mu m g times its way."""
    mu, v, until = .3, .8, .2
    text = on_plane(mu, until, (0, 0, 0)).replace(FIXED, f"{REFERENCE}, 2, 6\n").replace(
        "*STEP", "*AMPLITUDE, NAME=RAMP\n0., 0., 1., 1.\n*STEP", 1)
    run = ran(tmp_path, text.replace("*DLOAD", f"*BOUNDARY, AMPLITUDE=RAMP\n{REFERENCE}, 1, 1, {v}\n*DLOAD"))
    push = mu*.5*GRAVITY
    assert run.history["px"][-1] == pytest.approx(push*until, rel=1e-11)
    assert run.history["external_work"][-1] == pytest.approx(push*v*until, rel=1e-11)
    assert run.history["friction_loss"][-1] == pytest.approx(push*(v*until - .5*mu*GRAVITY*until**2), rel=1e-11)
    dissipates(run)


@pytest.mark.parametrize("slope", [.45, .499])
def test_held_in_statics_on_a_wall(slope: float, tmp_path: Path) -> None:
    angle = float(np.arctan(slope))
    text = (bodies([slab()], [faces(slab(), 2, 0)], STIFF) + wall(plane()) + on_wall(MORTAR, "*FRICTION\n.5\n")
            + f"*BOUNDARY\n{FIXED}*STEP\n*STATIC\n.5, 1.\n" + weight(angle) + "*NODE FILE\nU\n*END STEP\n")
    run = ran(tmp_path, text)
    assert run.verdict["verdict"] == "good"
    force = columns(run, "pair1_force_x pair1_force_y pair1_force_z")[-1]
    assert np.abs(np.abs(force) - .5*GRAVITY*np.array([np.sin(angle), 0.0, np.cos(angle)])).max() < 1e-8*GRAVITY


def test_springs_of_stick_on_a_wall(tmp_path: Path) -> None:
    """What they store comes back."""
    law = "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n1E5\n*FRICTION\n0.3, 1E4\n"
    run = ran(tmp_path, on_free_wall(sphere(2., (0., 0., -2.)), law))
    energy = columns(run, "kinetic strain friction_loss contact_energy").sum(1)
    assert np.abs(energy - energy[0]).max() < 1e-11*energy[0]
    dissipates(run)


def test_traction_and_slip_on_a_wall(tmp_path: Path) -> None:
    """Of all vertices: traction adds up to the force along the plane, and slip is the way."""
    run = ran(tmp_path, on_plane(.3, .1, (1., .2, 0)).replace("*END STEP", "*CONTACT FILE\nCF, CSHEAR, CSLIP\n*END STEP"))
    fields, low = run.fields(), np.array(slab().on(2, 0)) - 1
    force = fields["contact_force"][1:, low].sum(1)
    push = np.array([-1., -.2, 0])*.3*.5*GRAVITY/np.hypot(1, .2)
    assert np.abs(force*[1, 1, 0] - push).max() < 1e-9*GRAVITY
    surface = FieldsOf(run.file(".surfaces.vtkhdf"))
    is_face = np.flatnonzero(np.isfinite(surface.cell["contact_status"][0]).ravel())[:4]
    slip = surface.cell["contact_slip"][-1, is_face]
    assert np.abs(slip - fields["displacement"][-1, low[0]]).max() < 1e-9
    shear = surface.cell["contact_shear"][1:, is_face]
    assert np.abs(.25*shear.sum(1) - push).max() < 1e-9*GRAVITY


def on_free_plate(interaction: str, more: str = "", kinds: tuple[str, str] = ("C3D8", "C3D8"), options: str = MORTAR) -> str:
    """Thrown askew with a spin onto a free plate, and off."""
    turn = .3
    c, s = np.cos(turn), np.sin(turn)
    one = Block(kinds[0], (2, 2, 1), size=(1, 1, .5),
                place=lambda x: (x - np.array([.5, .5, 0]))@np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))
    two = Block(kinds[1], (4, 4, 1), size=(3, 3, .5), place=lambda x: x - np.array([1.5, 1.5, .5]))
    return (bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)], STIFF) + pair(options, interaction)
            + velocities(one, np.array([1., .2, -1.]), np.array([0, 0, 1.])) + dynamic(.01, .3, more))


def keeps(run: Run, more: str = "") -> None:
    """All momenta, and energy but for what is taken."""
    for names in ("px py pz", "lx ly lz"):
        p = columns(run, names)
        assert np.abs(p - p[0]).max() < 1e-11*np.abs(p).max(), names
    energy = columns(run, "kinetic strain friction_loss " + more).sum(1)
    assert np.abs(energy - energy[0]).max() < 1e-11*energy[0]
    assert run.history["friction_loss"][-1] > .05*energy[0]
    assert run.verdict["verdict"] == "good"
    dissipates(run)


def on_free_wall(shape: str, interaction: str, more: str = "", kind: str = "C3D8") -> str:
    """Thrown askew with a spin onto a free rigid body with a shape, and off."""
    c, s = np.cos(.3), np.sin(.3)
    one = Block(kind, (2, 2, 1), size=(1, 1, .5),
                place=lambda x: (x - np.array([.5, .5, -.02]))@np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))
    two = Block("C3D8", (2, 2, 2), size=(2, 2, 1), place=lambda x: x - np.array([1., 1., 2.5]))
    text = bodies([one, two], [faces(one), []], STIFF).replace("*SURFACE, NAME=S2\n", "")
    return (text + wall(shape, (.1, 0., -.5), "ELSET=B2, ") + on_wall(MORTAR, interaction)
            + velocities(one, np.array([1., .2, -1.]), np.array([0, 0, 1.])) + dynamic(.01, .3, more))


@pytest.mark.parametrize(("shape", "kind"), [
    (plane(), "C3D8"), (plane(), "C3D10"), (sphere(2., (0., 0., -2.)), "C3D8"), (DOME, "C3D4"), (TABLE, "C3D8")])
def test_slab_on_a_free_wall(shape: str, kind: str, tmp_path: Path) -> None:
    run = ran(tmp_path, on_free_wall(shape, RUBS, kind=kind))
    keeps(run)
    assert max(run.history["cuts"]) == 0
    assert run.verdict["law_violation"] < 1e-8


@pytest.mark.parametrize(("mu", "kinds"), [
    (.3, ("C3D8", "C3D8")), (.8, ("C3D8", "C3D8")), (.3, ("C3D4", "C3D8")), (.3, ("C3D10", "C3D8"))])
def test_slab_on_a_free_plate(mu: float, kinds: tuple[str, str], tmp_path: Path) -> None:
    run = ran(tmp_path, on_free_plate(f"*FRICTION\n{mu}\n", kinds=kinds))
    keeps(run)
    assert max(run.history["cuts"]) == 0
    assert run.verdict["law_violation"] < 1e-8


@pytest.mark.parametrize("more", [
    "*CONTACT INITIATION, TYPE=PERSISTENT\n", "*CONTACT INITIATION, TYPE=MASSLESS\n",
    "*CONSTRAINT METHOD, TYPE=SADDLE POINT\n", "*MORTAR, MULTIPLIER=STANDARD\n"])
def test_ways_to_hold(more: str, tmp_path: Path) -> None:
    keeps(ran(tmp_path, on_free_plate(RUBS, more)))


@pytest.mark.parametrize("card", [
    "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n1E5\n*FRICTION\n0.3, 1E4\n", "*FRICTION, ROUGH\n"])
def test_cards_of_friction(card: str, tmp_path: Path) -> None:
    """What springs of stick store comes back; what is rough never slides."""
    run = ran(tmp_path, on_free_plate(card).replace("*END STEP", "*CONTACT FILE\nCSHEAR\n*END STEP"))
    is_rough = "ROUGH" in card
    energy = columns(run, "kinetic strain friction_loss" + ("" if is_rough else " contact_energy")).sum(1)
    assert np.abs(energy - energy[0]).max() < 1e-11*energy[0]
    assert (run.fields()["contact_status"].max() == 2) != is_rough
    dissipates(run)


def test_impacts_with_restitution(tmp_path: Path) -> None:
    keeps(ran(tmp_path, on_free_plate(RUBS).replace("NAME=I\n", "NAME=I, RESTITUTION=.5\n")), "restitution_loss")


def test_friction_changes_between_steps(tmp_path: Path) -> None:
    """A rigid slab on a slope of .3 rests with mu = .5 and slides down with .1 as a particle does."""
    angle, until = float(np.arctan(.3)), .05
    text = on_plate(.5, until, (0, 0, 0), angle)
    step = text[text.index("*STEP"):]
    run = ran(tmp_path, text + step.replace("*NODE FILE", "*CHANGE FRICTION, INTERACTION=I\n*FRICTION\n.1\n*NODE FILE"))
    first = int(np.argmin(np.abs(run.history["time"] - until)))
    p = run.history["px"]/.5
    assert np.abs(p[:first + 1]).max() < 1e-12
    assert p[-1] == pytest.approx(GRAVITY*(np.sin(angle) - .1*np.cos(angle))*until, rel=1e-10)


@pytest.mark.parametrize("slope", [.45, .499])
def test_held_in_statics(slope: float, tmp_path: Path) -> None:
    """Up to the limit; loads of any size take the same iterations."""
    counts, moved = [], []
    for load in (1e-3, 1.0):
        one, two = slab(), wide()
        angle, g = float(np.arctan(slope)), load*GRAVITY
        text = (bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)], STIFF) + pair(MORTAR, "*FRICTION\n.5\n")
                + held(one, two) + f"*STEP\n*STATIC\n.5, 1.\n*DLOAD\nB1, GRAV, {g!r}, {float(np.sin(angle))!r}, 0., "
                + f"{float(-np.cos(angle))!r}\n*NODE FILE\nU\n*END STEP\n")
        run = ran(tmp_path, text)
        assert run.verdict["verdict"] == "good"
        counts.append(run.history["newton"].sum())
        moved.append(run.fields()["displacement"][-1]/load)
        force = columns(run, "pair1_force_x pair1_force_y pair1_force_z")[-1]
        assert np.abs(np.abs(force) - .5*g*np.array([np.sin(angle), 0.0, np.cos(angle)])).max() < 1e-8*g
    # Places change by some 1e-3 of a face under the load of 1.
    assert np.abs(moved[0] - moved[1]).max() < 1e-2*np.abs(moved[1]).max()


@pytest.mark.parametrize("cells", [1, 2])
@pytest.mark.parametrize("shape", [lambda x: x, ball])
def test_dragged_along_a_diagonal(shape: Callable[[np.ndarray], np.ndarray], cells: int, tmp_path: Path) -> None:
    """What is its own mirror image in x = y is pressed on a face and dragged along that, in one increment: so friction is,
    though the faces of the slave are sheared and turn."""
    one = Block("C3D8", (cells,)*3, size=(2, 2, 2), place=shape)
    one.x[:, 2] -= one.x[:, 2].min()
    two = Block("C3D8", (1, 1, 1), size=(8, 8, 1), place=lambda x: x - np.array([4, 4, 1]))
    top = "".join(f"*NSET, NSET={name}\n" + "".join(f"{k}\n" for k in on)
                  for name, on in (("TOP", one.on(2, 1)), ("PLATE", range(len(one.x) + 1, len(one.x) + len(two.x) + 1))))
    text = (bodies([one, two], [faces(one), faces(two, 2, 1)], "*ELASTIC\n1000., 0.\n") + top + pair(MORTAR, "*FRICTION\n.3\n")
            + "*BOUNDARY\nPLATE, 1, 3\n*STEP, NLGEOM\n*STATIC\n1., 1.\n*BOUNDARY\nTOP, 1, 2\nTOP, 3, 3, -.05\n*END STEP\n"
            + "*STEP, NLGEOM\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\nTOP, 1, 2, .2\n*NODE FILE\nRF\n*END STEP\n")
    run = ran(tmp_path, text)
    assert run.verdict["verdict"] == "good"
    force = run.fields()["reaction_force"][-1, np.array(one.on(2, 1)) - 1].sum(0)
    assert abs(force[0] - force[1]) < 1e-9*abs(force[2])
    assert np.hypot(*force[:2]) == pytest.approx(.3*abs(force[2]), rel=1e-3)


def test_a_ball_slides_and_rolls(tmp_path: Path) -> None:
    """With 5/7 of the speed it is thrown with, but for the faces that it rolls over: their middles are 1/2 per cent of the
    radius nearer to the centre than their corners."""
    c, s = np.cos(.2), np.sin(.2)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])@np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    one = Block("C3D8", (8, 8, 8), size=(2, 2, 2), place=lambda x: ball(x)@turn.T)
    one.x[:, 2] -= one.x[:, 2].min()
    two = Block("C3D8", (6, 4, 1), size=(2, 1, .2), place=lambda x: x - np.array([.5, .5, .2]))
    low = [(e, f) for e, f in faces(one) if one.x[np.array(one.element[e - 1]) - 1, 2].min() < .2]
    run = ran(tmp_path, bodies([one, two], [low, faces(two, 2, 1)], STIFF) + rigid(1, one, v=(1., 0, 0)) + pair(MORTAR, RUBS)
              + held(one, two) + dynamic(.01, .2, weight()))
    speed = run.history["px"]/run.history["px"][0]
    assert speed[5] > .8
    # The centre rises and falls by .005: g times that is a tenth of v^2/2, of which 7/5 is that of the mass.
    assert np.abs(speed[10:] - 5/7).max() < .07
    assert run.verdict["verdict"] == "good"
    dissipates(run)


def test_a_ball_slides_and_rolls_on_a_wall(tmp_path: Path) -> None:
    """As on faces."""
    c, s = np.cos(.2), np.sin(.2)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])@np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    one = Block("C3D8", (8, 8, 8), size=(2, 2, 2), place=lambda x: ball(x)@turn.T)
    one.x[:, 2] -= one.x[:, 2].min()
    low = [(e, f) for e, f in faces(one) if one.x[np.array(one.element[e - 1]) - 1, 2].min() < .2]
    run = ran(tmp_path, bodies([one], [low], STIFF) + wall(plane()) + rigid(1, one, v=(1., 0, 0)) + on_wall(MORTAR, RUBS)
              + f"*BOUNDARY\n{FIXED}" + dynamic(.01, .2, weight()))
    speed = run.history["px"]/run.history["px"][0]
    assert speed[5] > .8
    assert np.abs(speed[10:] - 5/7).max() < .07
    assert run.verdict["verdict"] == "good"
    dissipates(run)


def test_traction_and_slip_of_faces(tmp_path: Path) -> None:
    """Traction adds up to the force along the plane, slip is the way."""
    run = ran(tmp_path, on_plate(.3, .1, (1., .2, 0)).replace("*END STEP", "*CONTACT FILE\nCF, CSHEAR, CSLIP\n*END STEP"))
    fields, surface = run.fields(), FieldsOf(run.file(".surfaces.vtkhdf"))
    is_face = np.flatnonzero(np.isfinite(surface.cell["contact_status"][0]).ravel())[:4]
    shear, slip = surface.cell["contact_shear"][:, is_face], surface.cell["contact_slip"][-1, is_face]
    low = np.array(slab().on(2, 0)) - 1
    force = fields["contact_force"][1:, low].sum(1)
    assert np.abs(.25*shear.sum(1)[1:] - force*[1, 1, 0]).max() < 1e-9*np.abs(force).max()
    assert np.abs(slip - fields["displacement"][-1, low[0]]).max() < 1e-9
    assert run.history["pair1_friction_loss"][-1] == pytest.approx(run.history["friction_loss"][-1])


def test_a_restart_has_the_same_bits(tmp_path: Path) -> None:
    (tmp_path/"whole").mkdir()
    (tmp_path/"again").mkdir()
    text = on_plate(.3, .1, (1., .2, 0), is_rigid=False, w=(0, 0, 1.))
    whole = ran(tmp_path/"whole", text.replace(
        "*END STEP", "*CONTACT FILE\nCSHEAR, CSLIP\n*RESTART, WRITE, FREQUENCY=7\n*END STEP"))
    again = restart(whole, tmp_path/"again")
    assert again.digits() == whole.digits()
    first, second = (FieldsOf(run.file(".surfaces.vtkhdf")).cell for run in (whole, again))
    for name in ("contact_shear", "contact_slip"):
        np.testing.assert_array_equal(first[name], second[name])
