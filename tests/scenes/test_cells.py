"""Sectors against the whole that they stand for; cells under a mean strain; constant stress over cuts of unlike meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cell_scenes import ELASTIC, RUBBER, Mesh, cell, initial, repeated, sector, solid, surface
from scene_tools import Deck, Run, run_deck

STATIC = "*STEP, NLGEOM\n*STATIC, DIRECT\n.5, 1.\n"
WRITTEN = "*NODE FILE\nU, V\n*EL FILE\nS\n*END STEP\n"


def run(text: str, folder: Path, **more: object) -> Run:
    return run_deck(Deck(text), folder, **more)


def swirl(x: np.ndarray) -> np.ndarray:
    """A quarter of a square plate around the axis, without planes of symmetry."""
    angle = 0.4*(x[:, 0]**2 + x[:, 1]**2)
    turned = np.stack([x[:, 0]*np.cos(angle) - x[:, 1]*np.sin(angle), x[:, 0]*np.sin(angle) + x[:, 1]*np.cos(angle)], 1)
    return np.column_stack([turned, .5*x[:, 2:]])


def hollow(x: np.ndarray) -> np.ndarray:
    """A sixth of a ring."""
    r, angle = 1 + x[:, 0], np.pi/3*x[:, 1] + .3*x[:, 0]
    return np.column_stack([r*np.cos(angle), r*np.sin(angle), .5*x[:, 2:]])


#: How many sectors, the place map, the cells, slave and master cut, sides under pressure (axis, end).
RINGS = {"to the axis": (4, swirl, (3, 3, 2), (1, 0), (0, 0), [(0, 1), (1, 1)]),
         "to the point": (4, swirl, (3, 3), (1, 0), (0, 0), [(0, 1), (1, 1)]),
         "hollow": (6, hollow, (2, 3, 2), (1, 0), (1, 1), [(0, 1)]),
         "hollow in the plane": (6, hollow, (2, 3), (1, 0), (1, 1), [(0, 1)]),
         "other slave": (6, hollow, (2, 3), (1, 1), (1, 0), [(0, 1)])}


def whole_deck(mesh: Mesh, n: int, sides: list[tuple[int, int]]) -> tuple[str, np.ndarray, np.ndarray]:
    x, element, first = repeated(mesh, n)
    text = solid(x, element, mesh.kind, RUBBER)
    faces = [f for side in sides for f in mesh.at(*side)]
    text += surface("OUT", [(e + k*len(mesh.element), s) for k in range(n) for e, s in faces])
    return text, x, first


@pytest.mark.each_value
@pytest.mark.parametrize("how", ["large", "linear", "multipliers"])
@pytest.mark.parametrize("name", RINGS)
def test_sector_at_rest(name: str, how: str, tmp_path: Path) -> None:
    """Under pressure, or centrifugal forces, a sector deforms as the whole does, meshes being the same."""
    n, place, cells, low, high, sides = RINGS[name]
    mesh = Mesh(cells, place)

    def held(x: np.ndarray) -> str:
        r = np.linalg.norm(x[:, :2], axis=1)
        rim = np.isclose(r, r.max()) if r.min() < 1e-9 else r < 1 + 1e-9
        text = "*BOUNDARY\n" + "".join(f"{k}, 1, 2\n" for k in np.flatnonzero(rim) + 1)
        return text + ("".join(f"{k}, 3, 3\n" for k in np.flatnonzero(x[:, 2] < 1e-9) + 1) if mesh.dim == 3 else "")

    step = STATIC + "*DSLOAD\nOUT, P, 3.\n"
    if how == "linear":
        step = "*STEP\n*STATIC, DIRECT\n1., 1.\n*DLOAD\nALL, CENTRIF, 40., 0., 0., 0., 0., 0., 1.\n"
    elif how == "multipliers":
        step += "*CONSTRAINT METHOD, TYPE=SADDLE POINT\n"
    one = sector(mesh, n, low, high) + surface("OUT", [f for side in sides for f in mesh.at(*side)])
    text, x, first = whole_deck(mesh, n, sides)
    u = run(one + held(mesh.x) + step + WRITTEN, tmp_path/"one").fields()["displacement"][-1]
    w = run(text + held(x) + step + WRITTEN, tmp_path/"all").fields()["displacement"][-1]
    assert np.abs(w).max() > 1e-3
    np.testing.assert_allclose(u, w[first - 1], rtol=0, atol=1e-10*np.abs(w).max())


@pytest.mark.parametrize("name", RINGS)
def test_sector_in_motion(name: str, tmp_path: Path) -> None:
    """A free ring that spins and swings: a sector moves as the whole, and keeps its energy and what it may keep of momenta."""
    n, place, cells, low, high, sides = RINGS[name]
    mesh = Mesh(cells, place)
    text, x, first = whole_deck(mesh, n, sides)

    def speed(x: np.ndarray) -> np.ndarray:
        r2 = (x[:, :2]**2).sum(1)[:, None]
        v = (1 + .4*r2)*np.stack([-x[:, 1], x[:, 0]], 1) + .6*x[:, :2]
        return v if mesh.dim == 2 else np.column_stack([v, .3*r2[:, 0] - .5*x[:, 2]])

    step = "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n.05, .5\n" + WRITTEN
    done = run(sector(mesh, n, low, high) + initial(speed(mesh.x)) + step, tmp_path/"one")
    whole = run(text + initial(speed(x)) + step, tmp_path/"all")
    u, w = done.fields()["displacement"][-1], whole.fields()["displacement"][-1]
    np.testing.assert_allclose(u, w[first - 1], rtol=0, atol=1e-10*np.abs(w).max())
    history = done.history
    assert np.ptp(history["total"]) < 1e-13*history["total"][0]
    assert np.ptp(history["lz"]) < 1e-13*abs(history["lz"][0])
    if mesh.dim == 3:
        assert np.ptp(history["pz"]) < 1e-13*np.abs(whole.history["kinetic"]).max()
    assert history["strain"].max() > 0.01*history["total"][0]


def grade(by: float):
    """Nodes at the cut x = 0 are elsewhere than those at y = 0."""
    def place(x: np.ndarray) -> np.ndarray:
        y = x.copy()
        y[:, 0] = x[:, 0] + by*x[:, 0]*(1 - x[:, 0])*(1 - x[:, 1])
        if x.shape[1] == 3:
            y[:, 2] = x[:, 2] + by*x[:, 2]*(1 - x[:, 2])*x[:, 0]
        return y
    return place


@pytest.mark.parametrize(("cells", "kind", "by"), [
    ((2, 3), "CPE4", 0.), ((3, 2), "CPE4", .4), ((2, 3), "CPE8", 0.), ((2, 3, 2), "C3D8", 0.), ((3, 2, 2), "C3D8", .4),
    ((2, 3, 1), "C3D10", 0.), ((2, 2, 2), "C3D4", .4), ((3, 2, 1), "C3D20", 0.)])
def test_constant_stress_in_sector(cells, kind, by, tmp_path: Path) -> None:
    """A square plate under pressure on its sides: a quarter whose cuts have unlike meshes has the same stress everywhere."""
    mesh = Mesh(cells, grade(by), kind)
    if kind in ("C3D10", "C3D20"):
        mesh = Mesh(cells, None, kind)
    text = sector(mesh, 4, (1, 0), (0, 0), ELASTIC)
    text += surface("OUT", mesh.at(0, 1) + mesh.at(1, 1))
    text += "*BOUNDARY\n"
    text += f"{np.flatnonzero((mesh.box[:, 1] == 0) & (mesh.box[:, 0] == 1))[0] + 1}, 2, 2\n"
    if mesh.dim == 3:
        text += "".join(f"{k}, 3, 3\n" for k in mesh.on(2, 0))
    done = run(text + "*STEP\n*STATIC, DIRECT\n1., 1.\n*DSLOAD\nOUT, P, 1.\n" + WRITTEN, tmp_path)
    stress = done.fields()["cauchy_stress"][-1].reshape(len(mesh.x), -1)
    plane = 0 if mesh.dim == 3 else -.6
    for k, s in enumerate((-1, -1, plane)):
        np.testing.assert_allclose(stress[:, k], s, rtol=0, atol=1e-10)
    u = done.fields()["displacement"][-1]
    part = -(1 - .3)/1000 if mesh.dim == 3 else -(1 + .3)*(1 - .6)/1000
    np.testing.assert_allclose(u[:, :2], part*mesh.x[:, :2], rtol=0, atol=1e-12)


def shaken(by: float):
    """Opposite sides of a box get unlike meshes."""
    def place(x: np.ndarray) -> np.ndarray:
        bump = x*(1 - x)
        y = x.copy()
        for a in range(x.shape[1]):
            y[:, a] += by*bump[:, a]*(x[:, a - 1] - .3*x[:, (a + 1) % x.shape[1]])
        return y*np.array([1., 2., .5][:x.shape[1]])
    return place


CELLS = [((3, 4), "CPE4", .0), ((3, 4), "CPE4", .5), ((2, 3), "CPE8", .0), ((2, 3, 2), "C3D8", .0), ((3, 3, 3), "C3D8", .4),
         ((2, 2, 2), "C3D4", .4), ((2, 1, 1), "C3D10", .0), ((2, 2, 1), "C3D20", .0)]


@pytest.mark.parametrize(("cells", "kind", "by"), CELLS)
def test_mean_strain(cells, kind, by, tmp_path: Path) -> None:
    """A cell of one material under a mean deformation gradient has that everywhere; in three dimensions one width is free."""
    mesh = Mesh(cells, shaken(by), kind)
    size = np.array([1., 2., .5][:mesh.dim])
    mean = np.array([[.1, .25, .05], [-.05, -.08, .1], [.02, 0., .0]])[:mesh.dim, :mesh.dim]
    text = cell(mesh, size)
    text += "*BOUNDARY\n" + f"{np.flatnonzero((mesh.box == 0).all(1))[0] + 1}, 1, {mesh.dim}\n" + STATIC + "*BOUNDARY\n"
    for a in range(mesh.dim):
        text += "".join(f"{9001 + a}, {b + 1}, {b + 1}, {float(mean[b, a]*size[a])!r}\n" for b in range(mesh.dim))
    done = run(text + WRITTEN, tmp_path)
    u = done.fields()["displacement"][-1][:len(mesh.x)]
    np.testing.assert_allclose(u, mesh.x @ mean.T, rtol=0, atol=1e-12)


def test_free_width_and_mean_force(tmp_path: Path) -> None:
    """Translations that nothing prescribes are found, and forces on their nodes are mean stresses."""
    mesh = Mesh((2, 3, 2), shaken(.3))
    text = cell(mesh, np.array([1., 2., .5]), ELASTIC)
    text += "*BOUNDARY\n" + f"{np.flatnonzero((mesh.box == 0).all(1))[0] + 1}, 1, 3\n9001, 2, 3\n9002, 3, 3\n"
    text += "*STEP\n*STATIC, DIRECT\n1., 1.\n*CLOAD\n9001, 1, 2.\n" + WRITTEN
    done = run(text, tmp_path)
    stress = done.fields()["cauchy_stress"][-1].reshape(len(mesh.x) + 3, -1)[:len(mesh.x)]
    np.testing.assert_allclose(stress[:, 0], 2.0, rtol=0, atol=1e-10)
    np.testing.assert_allclose(stress[:, 1:], 0.0, rtol=0, atol=1e-10)
    np.testing.assert_allclose(done.fields()["displacement"][-1][len(mesh.x):], np.diag([.002, -.0012, -.0003]), rtol=0, atol=1e-13)


@pytest.mark.parametrize(("cells", "by"), [((3, 4), .5), ((3, 3, 3), .4)])
def test_cell_in_motion(cells, by, tmp_path: Path) -> None:
    """Waves in a cell whose translations stay: energy and linear momenta stay, too."""
    mesh = Mesh(cells, shaken(by))
    dim = mesh.dim
    text = cell(mesh, np.array([1., 2., .5][:dim]))
    text += "*BOUNDARY\n" + "".join(f"{9001 + a}, 1, {dim}\n" for a in range(dim))
    v = .5*np.sin(2*np.pi*np.roll(mesh.box, 1, axis=1)) + .2
    done = run(text + initial(v) + "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n.02, .3\n" + WRITTEN, tmp_path)
    history = done.history
    assert np.ptp(history["total"]) < 1e-13*history["total"][0]
    assert history["strain"].max() > .05*history["total"][0]
    for name in ("px", "py", "pz")[:dim]:
        assert np.ptp(history[name]) < 1e-13*np.abs(history[name][0])


def test_turned_flight(tmp_path: Path) -> None:
    """The axis may be anywhere, and the slave may be on either side."""
    mesh = Mesh((2, 3, 2), hollow)
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    at = np.array([3., -2., 1.])
    u = []
    for k, (rotate, shift) in enumerate(((np.eye(3), 0*at), (turn, at))):
        text = sector(mesh, 6, (1, 0), (1, 1)).split("*CYCLIC")[0]
        rows = mesh.x @ rotate.T + shift
        head, tail = text.split("*ELEMENT", 1)
        head = "*NODE, NSET=NALL\n" + "".join(f"{i}, " + ", ".join(map(repr, row)) + "\n" for i, row in enumerate(rows.tolist(), 1))
        ends = [*shift.tolist(), *(shift + 2*rotate[:, 2]).tolist()]
        text = head + "*ELEMENT" + tail + "*CYCLIC SYMMETRY MODEL, N=6\n" + ", ".join(map(repr, ends)) + "\n"
        v = (np.cross([0, 0, 1.], mesh.x) + .4*mesh.x*[1, 1, -.5]) @ rotate.T
        done = run(text + initial(v) + "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n.05, .5\n" + WRITTEN, tmp_path/str(k))
        u.append(done.fields()["displacement"][-1] @ rotate)
    np.testing.assert_allclose(u[1], u[0], rtol=0, atol=1e-11*np.abs(u[0]).max())


