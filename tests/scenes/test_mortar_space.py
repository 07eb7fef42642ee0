"""Mortar contact in space: patch tests, impacts through rebound, slides, and ways to hold it."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
from contact_space_scenes import (bodies, dynamic, faces, impact, over_the_end, pair, press, quadratic_increments,
                                  slide, stack, turned, velocities)
from scene_tools import EPSILON
from space_mesh import Block
from test_contact_space import BALANCE, check_impact, moments, ran, scaled
from test_statics_space import bore, lame, shells

MORTAR = ", TYPE=MORTAR"
#: Of the largest stress: a thousand roundings.
EVEN = 1.0e-12
#: Where gaps are closed in the mean nodes go in by less than guards let them.
GUARDED = 0.05
#: Of bars, small beside that of waves; a quarter of what a wave takes through the smallest element.
BAR_SPEED, BAR_STEP = 1.0e-3, 0.02


@pytest.mark.each_value
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
    text = text.replace("*END STEP", "*CONTACT FILE\nCSTRESS\n*END STEP")
    run = ran(tmp_path, text)
    fields = run.fields()
    v = fields["cauchy_stress"][-1]
    stress = np.einsum("nij,ia,jb->nab", v[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2]]], turn, turn)
    stress[:, 2, 2] += 25.0
    assert np.abs(stress).max() <= EVEN*25.0
    pressure = fields["contact_pressure"][-1]
    pressure = pressure[np.isfinite(pressure)]
    assert np.count_nonzero(pressure) == (cells[0][0] + 1)*(cells[0][1] + 1)
    assert np.abs(pressure[pressure != 0.0] - 25.0).max() <= EVEN*25.0
    (tmp_path/"tangents").mkdir()
    run = ran(tmp_path/"tangents", text.replace("*END STEP", "*NEWTON, TYPE=FULL\n*END STEP"))
    assert run.history["newton"].max() <= 8


@pytest.mark.parametrize("form", ["NODE TO SURFACE", "MORTAR"])
def test_statics_by_a_kept_factor(form: str, tmp_path: Path) -> None:
    """It leads to the same place as tangents do, with fewer factorisations."""
    text = press([(4, 4, 2), (3, 3, 2)], ["C3D8", "C3D8"], 0.05, np.eye(3), nu=0.3, options=f", TYPE={form}").replace(
        "*STEP\n*STATIC, DIRECT\n1., 1.", "*STEP, NLGEOM\n*STATIC, DIRECT\n.25, 1.")
    runs = []
    for kind in ("KEPT", "FULL"):
        (tmp_path/kind).mkdir()
        runs.append(ran(tmp_path/kind, text.replace("*END STEP", f"*NEWTON, TYPE={kind}\n*END STEP")))
    u, full = (run.fields()["displacement"][-1] for run in runs)
    # Residuals of both are round-off; these bodies are less than 1e5 times softer than their elements.
    assert np.abs(u - full).max() <= 1e5*EPSILON*np.abs(full).max()
    kept, tangents = (run.verdict["counts"]["factorisations"] for run in runs)
    assert kept < tangents


@pytest.mark.parametrize(("first", "second"), [("C3D4", "C3D8"), ("C3D8", "C3D4"), ("C3D4", "C3D20R")])
def test_a_ball_bounces_off_a_plate(first: str, second: str, tmp_path: Path) -> None:
    check_impact(ran(tmp_path, impact(first, second, options=MORTAR)), GUARDED)


def test_surface_to_surface_is_mortar(tmp_path: Path) -> None:
    """As other programs call it: the same bits, and no warning."""
    histories = []
    for word in ("MORTAR", "SURFACE TO SURFACE"):
        folder = tmp_path/word[0]
        folder.mkdir()
        run = ran(folder, press([(2, 2, 1), (3, 3, 1)], ["C3D8", "C3D8"], 0.05, np.eye(3), options=f", TYPE={word}"))
        histories.append(run.history)
    for name in histories[0].dtype.names:
        if name not in ("wall", "cpu"):
            assert np.array_equal(histories[0][name], histories[1][name], equal_nan=True), name
    assert histories[0]["strain"][-1] > 0.0


def test_newton_is_quadratic(tmp_path: Path) -> None:
    """Residuals of steps with contact: each about the square of the one before, or round-off."""
    run = ran(tmp_path, impact("C3D4", "C3D8", "*NEWTON, TYPE=FULL\n", options=MORTAR, cells=3))
    assert quadratic_increments(run) > 10


@pytest.mark.parametrize(("kind", "cells", "angle"), [
    ("C3D8", [(2, 2, 2), (2, 2, 2)], 0.0), ("C3D4", [(2, 2, 2), (3, 3, 3)], 0.0), ("C3D4", [(2, 2, 2), (2, 2, 2)], 0.1),
    ("C3D8", [(2, 2, 2), (3, 3, 3)], 0.3)])
def test_cubes_fall_on_cubes(kind: str, cells: list[tuple[int, int, int]], angle: float, tmp_path: Path) -> None:
    """Meshes that match, or do not, with outlines in one plane: flat, and on an edge first."""
    check_impact(ran(tmp_path, stack(cells, 0.03, angle, kind=kind, options=MORTAR)), 2.0e-3)


@pytest.mark.parametrize("noise", [0.0, 1.0e-16, 1.0e-10, 1.0e-6])
def test_meshes_that_match_but_for_noise(noise: float, tmp_path: Path) -> None:
    """Sides of faces that run along each other, or nearly: as what runs apart."""
    draw = np.random.default_rng(1)
    blocks = [Block("C3D8", (2, 2, 1), place=lambda x, z=z: x + np.array([0.0, 0.0, z])) for z in (0.03, -1.0)]
    for block, end in zip(blocks, (0, 1), strict=True):
        on = block.on(2, end) - 1
        block.x[on, :2] += noise*draw.uniform(-1.0, 1.0, (len(on), 2))
    text = (bodies(blocks, [faces(blocks[0], 2, 0), faces(blocks[1], 2, 1)]) + pair(MORTAR)
            + velocities(blocks[0], (0., 0., -1.), (0., 0., 0.)) + dynamic(0.03, 0.6))
    check_impact(ran(tmp_path, text), 2.0e-3)


def test_ten_facets(tmp_path: Path) -> None:
    """Through a valley of sixteen facets that turn by .05 each, hopping: nothing is lost, no step is cut."""
    first, radius = -8.5, 20.0

    def bend(x: np.ndarray) -> np.ndarray:
        y = x - np.array([12.0, 1.0, 1.0])
        y[:, 2] += radius - np.sqrt(radius**2 - y[:, 0]**2)
        return y

    along = np.array([np.sqrt(1.0 - (first/radius)**2), 0.0, first/radius])
    up = np.array([-along[2], 0.0, along[0]])
    foot = np.array([first, 0.0, radius - np.sqrt(radius**2 - first**2)])
    one = Block("C3D8", (2, 1, 1), size=(2.0, 1.6, 0.5), place=lambda x: (x[:, :1] - 1.0)*along + (x[:, 2:] + 0.066)*up
                + (x[:, 1:2] - 0.77)*np.array([0.0, 1.0, 0.0]) + foot)
    two = Block("C3D8", (24, 2, 1), size=(24.0, 2.0, 1.0), place=bend)
    n = len(one.x)
    text = (bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)], "*HYPERELASTIC, NEO HOOKE\n2000., 1e-3\n*DENSITY\n1.\n")
            + pair(MORTAR) + velocities(one, 4.0*along, (0., 0., 0.)) + f"*NSET, NSET=FLOOR, GENERATE\n{n + 1}, {n + len(two.x)}\n"
            + "*BOUNDARY\nFLOOR, 1, 3\n" + dynamic(0.05, 2.0, "*DLOAD\nB1, GRAV, 10., 0., 0., -1.\n"))
    run = ran(tmp_path, text)
    assert run.verdict["verdict"] == "good"
    assert run.verdict["largest_energy_error"] <= 1.0e-13*run.verdict["largest_energy"]
    assert run.history["cuts"].sum() == 0
    assert run.fields()["displacement"][-1, 0, 0] > 10.0


@pytest.mark.parametrize("is_hill", [False, True])
def test_sliding_over_facets(is_hill: bool, tmp_path: Path) -> None:
    """Over sides of facets that turn by .05 each: nothing is lost, no step is cut."""
    run = ran(tmp_path, slide(0.05, 1.2, is_hill, MORTAR))
    assert run.verdict["verdict"] == "good"
    assert run.verdict["largest_energy_error"] <= 1.0e-13*run.verdict["largest_energy"]
    assert run.history["cuts"].sum() == 0
    assert run.history["active"].max() >= 3
    assert run.fields()["displacement"][-1, 0, 0] > 0.35*4.0*1.2


@pytest.mark.parametrize("options", ["", MORTAR])
@pytest.mark.parametrize("cells", [pytest.param(4, id="4"), pytest.param(8, id="8", marks=pytest.mark.long)])
def test_unlike_faces_land_flat(options: str, cells: int, tmp_path: Path) -> None:
    """A block with some slide and spin lands on a larger plate of another mesh: all of its face touches at once, and most
    conditions follow from others. No increment is cut, and no node needs its mass. No spring holds the plate: momenta
    stand until the block has left."""
    block = Block("C3D8", (cells, cells, 2), size=(1, 1, .5), place=lambda x: x - [.5, .5, -.0005])
    plate = Block("C3D8", (cells + 1, cells + 1, 2), size=(1.5, 1.5, .5), place=lambda x: x - [.75, .75, .5])
    text = bodies([block, plate], [faces(block, 2, 0), faces(plate, 2, 1)], "*ELASTIC\n1E4, .3\n*DENSITY\n1.\n")
    text += pair(options) + velocities(block, np.array([.1, .05, -1]), np.array([0, 0, .2]))
    run = ran(tmp_path, text + dynamic(.002, .04))
    history = run.history
    assert run.verdict["verdict"] == "good"
    assert history["cuts"].sum() == 0
    assert "get their mass back" not in run.log
    assert history["active"].max() >= (cells + 1)**2
    assert history["active"][-1] == 0
    for name in ("px", "py", "pz", "lx", "ly", "lz"):
        assert np.ptp(history[name]) < BALANCE
    assert np.ptp(history["total"]) < BALANCE*history["total"][0]
    x = run.fields().x + run.fields()["displacement"][-1]
    assert x[:len(block.x), 2].min() > x[len(block.x):][np.array(plate.on(2, 1)) - 1, 2].max()


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


#: Of the pair, from a step on.
CHANGE = "*MODEL CHANGE, TYPE=CONTACT PAIR, {}\nS1, S2\n"


def test_a_soft_cap_that_touches_stores_nothing(tmp_path: Path) -> None:
    """A cap on a plate: its mean gap is below 0 where its node touches. Nothing moves it, also not as a later step takes
    the pair in, and static steps warn of it."""
    blocks = [Block("C3D20", (2, 2, 1), size=(2.0, 2.0, 1.0),
                    place=lambda x: x - 1.0 + np.outer(0.1*((x[:, :2] - 1.0)**2).sum(1) + 1.0, [0.0, 0.0, 1.0])),
              Block("C3D8", (1, 1, 1), size=(4.0, 4.0, 1.0), place=lambda x: x - np.array([2.0, 2.0, 1.0]))]
    mesh = bodies(blocks, [faces(blocks[0], 2, 0), faces(blocks[1], 2, 1)])
    soft = "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n1e4\n"
    (tmp_path/"free").mkdir()
    run = ran(tmp_path/"free", mesh + pair(MORTAR, soft) + dynamic(0.05, 0.5))
    assert run.history["contact_energy"].max() == run.history["kinetic"].max() == 0.0
    (tmp_path/"later").mkdir()
    later = ran(tmp_path/"later", mesh + pair(MORTAR, soft) + dynamic(0.05, 0.1, CHANGE.format("REMOVE"))
                + dynamic(0.05, 0.2, CHANGE.format("ADD")))
    assert later.history["contact_energy"].max() == later.history["kinetic"].max() == 0.0
    n = [len(block.x) for block in blocks]
    held = (f"*NSET, NSET=TOP\n{', '.join(str(k) for k in blocks[0].on(2, 1))}\n*NSET, NSET=PLATE, GENERATE\n"
            f"{n[0] + 1}, {sum(n)}\n*STEP, NLGEOM\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\nPLATE, 1, 3\nTOP, 1, 2\nTOP, 3, 3, -.02\n"
            "*END STEP\n")
    for kind, n_warning in ((MORTAR, 1), ("", 0)):
        folder = tmp_path/f"held{n_warning}"
        folder.mkdir()
        text = mesh + pair(kind, soft) + held
        warnings = ran(folder, text).verdict["warnings"]
        assert len([w for w in warnings if "begin below 0" in w]) == n_warning


def test_bits_do_not_depend_on_units(tmp_path: Path) -> None:
    """In a unit of length and time 1024 times smaller: the same velocities."""
    text = stack([(1, 1, 1), (2, 2, 1)], 0.03, 0.1, options=MORTAR).replace("*NODE FILE\nU\n", "*NODE FILE\nU, V\n")
    found = []
    for power in (0, 10):
        folder = tmp_path/str(power)
        folder.mkdir()
        found.append(ran(folder, scaled(text, power)).fields()["velocity"][-1])
    assert np.array_equal(found[0], found[1])


def bars() -> str:
    """A bar of length 1 hits one of length 2; nothing moves sideways: c = 1, rho A = 1."""
    one = Block("C3D8", (1, 1, 20))
    two = Block("C3D8", (2, 2, 36), size=(1, 1, 2), place=lambda x: x - np.array([0., 0., 2.]))
    return (bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)], "*ELASTIC\n1., 0.\n*DENSITY\n1.\n")
            + pair(MORTAR) + velocities(one, (0., 0., -BAR_SPEED), (0., 0., 0.))
            + f"*NSET, NSET=ALL, GENERATE\n1, {len(one.x) + len(two.x)}\n*BOUNDARY\nALL, 1, 2\n"
            + dynamic(BAR_STEP, 2.6, "*CONTACT INITIATION, TYPE=MASSLESS\n"))


def test_two_bars(tmp_path: Path) -> None:
    """The short bar gives away all it has: the force is half of rho c v while a wave goes there and back, then none."""
    run = ran(tmp_path, bars())
    assert run.verdict["verdict"] == "good"
    time, impulse = run.history["time"], np.abs(run.history["pair1_impulse_z"])/BAR_SPEED
    force = np.diff(impulse)/BAR_STEP
    print("scatter of the force", force[time[1:] < 1.9].std())
    assert np.interp(2.0, time, impulse)/2.0 == pytest.approx(0.5, rel=0.01)
    assert run.history["active"][-1] == 0
    fields = run.fields()
    way = np.diff(fields["displacement"][-2:, :, 2], axis=0)[0]/(BAR_STEP*BAR_SPEED)
    n = 2*2*21                                   # nodes of the first bar
    for part, exact in ((slice(0, n), 0.0), (slice(n, None), -0.5)):
        levels, layer = np.unique(fields.x[part, 2].round(9), return_inverse=True)
        of_layer = np.bincount(layer, way[part])/np.bincount(layer)
        assert np.trapezoid(of_layer, levels)/np.ptp(levels) == pytest.approx(exact, abs=0.01)


def test_press_fit(tmp_path: Path) -> None:
    """Tubes whose faces meet, pressed into each other by so little that Lame holds: of second order."""
    off = []
    for n in (8, 16, 32):
        folder = tmp_path/str(n)
        folder.mkdir()
        run = ran(folder, shells((n, n), 1.0e-5).replace("INTERACTION=I\nF1", "INTERACTION=I, TYPE=MORTAR\nF1"))
        assert run.verdict["verdict"] == "good"
        off.append(abs(bore(run)/lame(1.0e-5) - 1.0))
    assert all(np.log2(np.divide(off[:-1], off[1:])) > 1.9)
    assert off[2] < 0.0005


@pytest.mark.parametrize(("n", "accuracy"), [((8, 11), 0.05), ((11, 8), 0.05), ((16, 21), 0.01)])
def test_press_fit_of_unlike_meshes(n: tuple[int, int], accuracy: float, tmp_path: Path) -> None:
    """Faces are off the tubes by more than the interference; what that makes of gaps is left out."""
    run = ran(tmp_path, shells(n, 1.0e-3).replace("INTERACTION=I\nF1", "INTERACTION=I, TYPE=MORTAR\nF1"))
    assert run.verdict["verdict"] == "good"
    assert bore(run) == pytest.approx(lame(1.0e-3), rel=accuracy)
    assert "F1 and F0: gaps are measured between the curves" in run.log


def test_a_turned_cube_pressed_on_a_block(tmp_path: Path) -> None:
    """Nodes and means agree as meshes get finer: of second order in the mean over all nodes."""
    c, s = np.cos(0.5), np.sin(0.5)
    turn, off = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), []
    for n in (2, 4):
        one = Block("C3D8", (n,)*3, place=lambda x: (x - np.array([0.5, 0.5, 0.0])) @ turn.T)
        two = Block("C3D8", (2*n, 2*n, n), size=(2, 2, 1), place=lambda x: x - np.array([1.0, 1.0, 1.0]))
        top, foot = one.on(2, 1), two.on(2, 0) + len(one.x)
        text = (bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)], "*HYPERELASTIC, NEO HOOKE\n200., 2e-3\n")
                + "".join(f"*NSET, NSET={name}\n" + "".join(f"{k}\n" for k in on) for name, on in (("TOP", top), ("FOOT", foot)))
                + pair() + "*BOUNDARY\nFOOT, 1, 3\n*STEP, NLGEOM\n*STATIC\n.25, 1.\n*BOUNDARY\nTOP, 1, 2\nTOP, 3, 3, -.1\n"
                + "*NODE FILE\nU\n*END STEP\n")
        u = []
        for options in ("", MORTAR):
            folder = tmp_path/f"{n}{bool(options)}"
            folder.mkdir()
            run = ran(folder, text.replace("INTERACTION=I\n", f"INTERACTION=I{options}\n"))
            assert run.verdict["verdict"] == "good"
            u.append(run.fields()["displacement"][-1])
        off.append(np.sqrt(((u[1] - u[0])**2).mean())/0.1)
    assert off[1] < 0.005 and off[1] < 0.35*off[0]


@pytest.mark.each_value
@pytest.mark.parametrize("is_slave", [False, True])
@pytest.mark.parametrize("kind", ["C3D4", "C3D8"])
def test_a_rigid_side(kind: str, is_slave: bool, tmp_path: Path) -> None:
    """A ball on a free plate, one of them rigid: energy and momenta of the flight, sums of both bodies."""
    text = impact(kind, "C3D8", options=MORTAR)
    rigid = 1 if is_slave else 2
    middle = "0., 0., 1.06" if is_slave else "0., 0., -.35"
    text = text.replace("*INITIAL", f"*NODE\n9999, {middle}\n*RIGID BODY, ELSET=B{rigid}, REF NODE=9999\n*INITIAL", 1)
    if is_slave:
        i, j = text.index("*INITIAL"), text.index("*STEP")
        text = text[:i] + "*INITIAL CONDITIONS, TYPE=VELOCITY\n9999, 1, .6\n9999, 2, .25\n9999, 3, -1.\n" + text[j:]
    run = ran(tmp_path, text)
    history = run.history
    assert run.verdict["verdict"] == "good"
    assert history["active"].max() > 0 and np.abs(history["pair1_impulse_z"]).max() > 0.1
    assert np.ptp(history["total"]) <= BALANCE*history["total"].max()
    for names in ("px py pz", "lx ly lz"):
        found = moments(run, names)
        assert np.abs(found - found[0]).max() <= BALANCE*np.abs(moments(run, "px py pz")).max()


@pytest.mark.parametrize("over", [0.3, 0.75, 1.0])
def test_covered_area(over: float, tmp_path: Path) -> None:
    """A cube that sticks out over the edge of a block: what is over that, and a fortieth of its faces at most."""
    one = Block("C3D8", (2, 2, 1), place=lambda x: x + np.array([1.0 - over, 0.0, 0.0]))
    two = Block("C3D8", (4, 4, 1), place=lambda x: x - np.array([0.0, 0.0, 1.0]))
    n = len(one.x)
    text = bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)], "*ELASTIC\n1000., 0.\n")
    text += "".join(f"*NSET, NSET={name}\n" + "".join(f"{k}\n" for k in on)
                    for name, on in (("TOP", one.on(2, 1)), ("FOOT", two.on(2, 0) + n)))
    text += pair(MORTAR) + "*BOUNDARY\nFOOT, 1, 3\n*STEP\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\nTOP, 1, 2\nTOP, 3, 3, -1e-6\n"
    run = ran(tmp_path, text + "*NODE FILE\nU\n*CONTACT FILE\nCNAREA, CSTRESS, CF\n*CONTACT PRINT, TOTALS=YES\nCNAREA, CF\n*END STEP\n")
    fields = run.fields()
    area, pressure = (np.array(fields[name][-1]).ravel() for name in ("contact_area", "contact_pressure"))
    assert (area[n:] == 0.0).all() and (area[:n][pressure[:n] > 0.0] > 0.0).all()
    assert over - EVEN <= area.sum() <= over + (0.025*0.25 if over < 1.0 else EVEN)
    # A vertex has one pressure here: over its area it is the force, but for what the bodies move meanwhile.
    force = np.array(fields["contact_force"][-1])[:n, 2].sum()
    assert area @ np.nan_to_num(pressure) == pytest.approx(force, rel=1.0e-5)
    with h5py.File(run.file(".h5")) as file:
        assert file["sets/PAIRS/CONTACT_AREA"][-1].sum() == pytest.approx(area.sum(), rel=EVEN)
        assert file["sets/CONTACT/CNAREA"][-1].sum() == pytest.approx(area.sum(), rel=EVEN)


@pytest.mark.parametrize("stiffness", [1.0e3, 3.0e3, 1.0e4])
def test_over_a_seam(stiffness: float, tmp_path: Path) -> None:
    """A block slides over the seam of two slabs on one foundation: sides of these that touch where they are held push nothing."""
    slabs = [Block("C3D8", (4, 4, 1), size=(2.0, 2.0, 0.5), place=lambda x, at=at: x + np.array([at, 0.0, -0.5])) for at in (0.0, 2.0)]
    block = Block("C3D8", (2, 2, 1), size=(0.8, 0.8, 0.4), place=lambda x: x + np.array([0.8, 0.6, 0.0]))
    blocks = [block, *slabs]
    held, n = "", len(block.x)
    for slab in slabs:
        held += "".join(f"{n + k}, 1, 3\n" for k in slab.on(2, 0))
        n += len(slab.x)
    run = ran(tmp_path, bodies(blocks, [faces(b) for b in blocks], f"*ELASTIC\n{stiffness}, .3\n*DENSITY\n1.\n")
              + "*SURFACE INTERACTION, NAME=I\n*CONTACT PAIR, INTERACTION=I, TYPE=MORTAR\nS1, S2\nS1, S3\nS2, S3\n"
              + f"*BOUNDARY\n{held}*INITIAL CONDITIONS, TYPE=VELOCITY\nN1, 1, 1.\n*AMPLITUDE, NAME=R\n0., 0., .3, 1., 9., 1.\n"
              + dynamic(0.02, 0.8, "*DLOAD, AMPLITUDE=R\nB1, GRAV, 10., 0., 0., -1.\n*CONTACT FILE\nCF\n"))
    assert run.verdict["verdict"] == "good"
    weight = 10.0*0.8*0.8*0.4
    # Where both slabs are held nothing pushes but by their strains, some 1e-2, of what does beside it.
    force = np.abs(run.fields()["contact_force"][..., 0])
    foot = np.array([int(line.split(",")[0]) - 1 for line in held.splitlines()])
    assert force[:, foot].max() <= 0.1*force.max()
    if stiffness < 1.0e4:
        return
    assert np.abs(run.history["pair3_force_x"]).max() <= 0.5*weight
    up = run.history["pair1_force_z"] + run.history["pair2_force_z"]
    assert up[-10:].mean() == pytest.approx(weight, rel=0.1)
    # Steps of the seam are some 1e-3 of the block's facets: the mean rides over them.
    speed = (run.history["px"][-1] - run.history["px"][0])/(0.8*0.8*0.4)
    assert abs(speed) <= 0.02
