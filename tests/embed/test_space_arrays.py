"""Decks of three dimensions through C and Python: arrays, state, conditions, what is given."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from embed_tools import ROOT

sys.path[:0] = [str(ROOT/"pywrap"), str(ROOT/"tests"/"scenes")]

from emcon import InputError, Model, Results, Stepper, read_bodies  # noqa: E402
from emcon.csr import Csr  # noqa: E402
from emcon.results import locate  # noqa: E402
from space_mesh import KINDS, Block  # noqa: E402

EPS = np.finfo(float).eps
RUBBER = "*HYPERELASTIC, NEO HOOKE\n20., 0.01\n"
RATE = np.array([[0.4, -1.5, 0.6], [1.5, -0.3, -0.9], [-0.6, 0.9, 0.2]])


def flight(kind: str, cells: tuple[int, int, int] = (2, 1, 1), more: str = "") -> str:
    """The deck of a block that flies, spins and vibrates in a field of gravity."""
    mesh = Block(kind, cells, cells)
    v = (mesh.x - mesh.x.mean(0)) @ RATE.T + [0.3, -0.2, 0.25]
    speed = "".join(f"{k}, {a + 1}, {float(v[k - 1, a])!r}\n"
                    for k in range(1, len(v) + 1) for a in range(3))
    return mesh.deck(RUBBER, "*SURFACE, NAME=END\n1, S1\n"
                     f"*INITIAL CONDITIONS, TYPE=VELOCITY\n{speed}*STEP, NLGEOM\n"
                     "*DYNAMIC, DIRECT\n0.02, 0.4\n*DLOAD\nALL, GRAV, 2., 0.3, -0.5, 0.8\n"
                     f"{more}*NODE FILE\nU, V\n*EL FILE\nS, E\n*END STEP\n")


def deck(folder: Path, text: str) -> Path:
    path = folder/"block.inp"
    path.write_text(text)
    return path


@pytest.mark.parametrize("kind", KINDS)
def test_a_stepper_tells_what_the_program_writes(kind: str, tmp_path: Path) -> None:
    path = deck(tmp_path, flight(kind))
    subprocess.run([ROOT/"build"/"release"/"emcon", path, "--quiet"], check=True, cwd=tmp_path)
    with Stepper(path) as block, Results(tmp_path/"block") as files:
        assert block.n_dim == 3 and block.positions.shape == (block.n_node, 3)
        block.run()
        last = files.history[-1]
        for name, value in {**block.energies(), **block.momenta()}.items():
            if name in files.history.dtype.names:
                assert value == last[name], name
        assert list(block.momenta()) == ["px", "py", "pz", "lx", "ly", "lz"]
        for name, value in (("displacement", block.u), ("velocity", block.v),
                            ("cauchy_stress", block.stress), ("von_mises", block.von_mises)):
            assert np.array_equal(files.fields[name][-1], value), name
        of_files = read_bodies(locate(tmp_path/"block"))
        assert of_files is not None
        assert np.array_equal(of_files.momentum[-1], block.body_momenta()[:, :3])
        assert np.array_equal(np.stack([of_files.lx, of_files.ly, of_files.lz], -1)[-1],
                              block.body_momenta()[:, 3:])


def test_bodies_add_up(tmp_path: Path) -> None:
    with Stepper(deck(tmp_path, flight("C3D10"))) as block:
        block.run(until=0.1)
        (body,), (momenta,) = block.bodies(), block.body_momenta()
        size = np.abs(momenta).max()
        assert body.mass == pytest.approx(0.5*2, rel=100*EPS)
        assert np.abs(body.mass*body.velocity - momenta[:3]).max() <= 1e3*EPS*size
        about_origin = body.spin + np.cross(body.centre, momenta[:3])
        assert np.abs(about_origin - momenta[3:]).max() <= 1e3*EPS*size
        assert body.kinetic == pytest.approx(block.ledger["kinetic"], rel=1e3*EPS)
        assert body.strain == pytest.approx(block.ledger["strain"], rel=1e3*EPS)


def test_states_come_back_with_the_same_bits(tmp_path: Path) -> None:
    """By a snapshot, by a restart file, and by `set_state` where energies are measured anew."""
    path = deck(tmp_path, flight("C3D20R"))
    with Stepper(path) as block:
        block.run(until=0.1)
        kept = block.save()
        block.write_restart(tmp_path/"block.rst.h5")
        u, v = block.u, block.v
        block.run()
        end = block.u, block.v, block.ledger
        block.restore(kept)
        assert np.array_equal(block.u, u) and np.array_equal(block.v, v)
        block.run()
        with Stepper.from_restart(tmp_path/"block.rst.h5") as other:
            assert np.array_equal(other.u, u)
            other.run()
            for found in (block, other):
                assert np.array_equal(found.u, end[0]) and np.array_equal(found.v, end[1])
                assert found.ledger == end[2]
        block.set_state(u=u, v=v)
        assert np.array_equal(block.u, u) and np.array_equal(block.v, v)
        for wrong in (u[:, :2], u[:-1]):
            with pytest.raises(InputError, match="shape"):
                block.set_state(u=wrong)


def test_residual_and_tangent(tmp_path: Path) -> None:
    """The tangent is the derivative of the residual, freedom by freedom."""
    with Stepper(deck(tmp_path, flight("C3D8"))) as block:
        block.run(until=0.04)
        h = 0.02
        u1 = block.guess(h)
        k, unknown = block.tangent(u1, h), block.unknowns
        assert unknown.shape == (block.n_node, 3) and k.shape == 2*(3*block.n_node,)
        step = 1e-6
        for node, axis in ((0, 2), (5, 0)):
            change = np.zeros_like(u1)
            change[node, axis] = step
            ahead, back = (block.evaluate(u1 + s*change, h, with_tangent=False).unknown_residual()
                           for s in (1, -1))
            unit = np.zeros(k.shape[1])
            unit[unknown[node, axis]] = 1
            column = k @ unit
            assert np.abs((ahead - back)/(2*step) - column).max() <= 1e-7*np.abs(column).max()
        assert (block.mass @ np.ones(block.n_node)).sum() == pytest.approx(1.0, rel=100*EPS)
        assert block.links.shape == (3*block.n_node, block.n_unknown)


def test_conditions(tmp_path: Path) -> None:
    """Freedom 3 and face 6 are there, and what is behind them is not."""
    more = "*CLOAD\n1, 3, 0.1\n*DLOAD\n1, P6, 0.2\n"
    with Stepper(deck(tmp_path, flight("C3D8", more=more))) as block:
        n = block.n_unknown
        block.prescribe(2, 3, 0.0)
        assert block.n_unknown == n - 1
        block.release(2, 3)
        block.set_point_load(1, 3, 0.5)
        block.set_pressure(1, 6, 0.4)
        block.set_gravity(2, 1.0)
        block.add_pressure(2, 6, 0.1)
        block.step()
        for call in (lambda: block.prescribe(2, 4, 0.0), lambda: block.set_pressure(1, 7, 1.0)):
            with pytest.raises(InputError):
                call()


def test_pressure_on_a_surface(tmp_path: Path) -> None:
    """On all of its faces, as on each: of a deck, changed, and added between steps."""
    mesh = Block("C3D8", (2, 2, 1), (1, 1, 0.5))
    head = "*BOUNDARY\n" + "".join(f"{k}, 1, 3\n" for k in mesh.on(2, 0))
    head += "*SURFACE, NAME=UPPER\nALL, S2\n*SURFACE, NAME=LOOSE, TYPE=NODE\nNALL\n"
    step = "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n0.1, 1.\n{}*END STEP\n"
    with Stepper(deck(tmp_path, mesh.deck(RUBBER, head + step.format("")))) as one:
        one.add_surface_pressure("upper", 40.0)
        one.step()
        one.set_surface_pressure("UPPER", [10.0, 20.0, 30.0, 40.0])
        one.step()
        for name, what in (("NONE", "NONE"), ("LOOSE", "no faces"), (3, "surface")):
            with pytest.raises(InputError, match=what):
                one.set_surface_pressure(name, 1.0)
        surface = one.u
    loaded = head + step.format("*DSLOAD\nUPPER, P, 40.\n")
    with Stepper(deck(tmp_path, mesh.deck(RUBBER, loaded))) as other:
        other.step()
        other.set_pressure([1, 2, 3, 4], 2, [10.0, 20.0, 30.0, 40.0])
        other.step()
        assert np.array_equal(surface, other.u) and np.abs(surface).max() > 1e-2


def test_faces_and_cells(tmp_path: Path) -> None:
    with Stepper(deck(tmp_path, flight("C3D20"))) as block:
        assert block.surface("END").tolist() == [[0, 1]]
        (kind,) = block.cells
        assert kind == "hexahedron20" and block.cells[kind].shape == (2, 20)


@pytest.mark.parametrize("kind", KINDS)
def test_a_model_of_arrays_is_that_of_the_deck(kind: str, tmp_path: Path) -> None:
    """Block, support, follower pressure and gravity, said by calls and by a deck."""
    mesh = Block(kind, (2, 2, 2), (2, 1, 1))
    model = Model.from_arrays(mesh.x, {kind: np.array(mesh.element) - 1})
    model.material("M", neo_hooke=(20.0, 0.01), density=0.5).section("M")
    model.surface("END", faces=[(1, 4)])
    model.boundary(mesh.on(0, 0) - 1)
    step = model.step("STATIC", 0.5, 1.0, nlgeom=True)
    step.surface_pressure("END", 0.3).gravity("ALL", 2.0, (0.3, -0.5, 0.8))
    step.load(int(mesh.on(0, 1)[0]) - 1, (1, 3), (0.05, -0.02))
    held = "".join(f"{k}, 1, 3\n" for k in mesh.on(0, 0))
    text = mesh.deck(RUBBER, f"*BOUNDARY\n{held}*STEP, NLGEOM\n*STATIC\n0.5, 1.\n*DLOAD\n"
                     "2, P4, 0.3\nALL, GRAV, 2., 0.3, -0.5, 0.8\n*CLOAD\n"
                     f"{mesh.on(0, 1)[0]}, 1, 0.05\n{mesh.on(0, 1)[0]}, 3, -0.02\n*END STEP\n")
    with model.stepper() as mine, Stepper(deck(tmp_path, text)) as theirs:
        mine.run()
        theirs.run()
        assert np.abs(mine.u).max() > 1e-3
        assert np.array_equal(mine.u, theirs.u)


def test_arrays_of_a_model_that_do_not_fit() -> None:
    model = Model()
    model.add_nodes([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    for call, text in ((lambda: model.add_nodes([[0, 0]]), "2 coordinates here, and 3 before"),
                       (lambda: model.add_elements([[0, 1, 2, 3]]), "have a kind"),
                       (lambda: model.add_elements([[0, 1, 2]], kind="C3D4"), r"\(m, 4\)")):
        with pytest.raises(InputError, match=text):
            call()


def well(z: np.ndarray[Any, Any]) -> tuple[Any, Any, Any]:
    """An anharmonic well about (1, 0.5, 0.5)."""
    r = z - [1.0, 0.5, 0.5]
    square = (r*r).sum(1)
    second = (1 + square)[:, None, None]*np.eye(3) + 2*r[:, :, None]*r[:, None, :]
    return 0.5*square + 0.25*square**2, (1 + square)[:, None]*r, second


def test_a_potential_keeps_the_energy(tmp_path: Path) -> None:
    text = flight("C3D8").replace("*DLOAD\nALL, GRAV, 2., 0.3, -0.5, 0.8\n", "")
    model = Model.from_deck(deck(tmp_path, text)).potential(well)
    with model.stepper() as block:
        block.step(1e-6)
        first = block.energies()
        largest = 0.0
        while not block.time > 0.4:
            block.step(0.02)
            now = block.energies()
            largest = max(largest, abs(now["potential"] - first["potential"]))
            assert abs(now["total"] - first["total"]) <= 1e-12*first["total"]
        assert largest > 0.1*first["potential"]


class Spring:
    """A linear spring between two nodes, by freedoms, in all directions alike."""

    def __init__(self, first: int, last: int, n: int) -> None:
        self.ends, k = (first, last), np.zeros((n, n))
        k[np.ix_(self.ends, self.ends)] = 3.0*np.array([[1, -1], [-1, 1]])
        self.k = np.kron(k, np.eye(3))

    def respond(self, u0: Any, du: Any, wants_tangent: bool) -> tuple[Any, float, Any]:
        end = (u0 + du).ravel()
        force = self.k @ (u0 + 0.5*du).ravel()
        return force.reshape(-1, 3), float(0.5*end @ self.k @ end), 0.5*self.k


def test_a_solid_of_a_host(tmp_path: Path) -> None:
    """Its forces keep the energy, and act along all three axes."""
    text = flight("C3D8").replace("*DLOAD\nALL, GRAV, 2., 0.3, -0.5, 0.8\n", "")
    with Stepper(deck(tmp_path, text)) as bare:
        n = bare.n_node
        bare.run()
        free = bare.u
    scene, steps = text.split("*STEP", 1)
    model = Model().cards(scene).host(Spring(0, n - 1, n), 0.1*np.eye(3*n), nodes="NALL")
    model.cards("*STEP" + steps)
    with model.stepper() as block:
        block.step(1e-6)
        first = block.energies()["total"]
        for _ in range(20):
            block.step(0.02)
            assert abs(block.energies()["total"] - first) <= 1e-12*first
        assert (np.abs(block.u - free).max(0) > 1e-3).all()
        assert isinstance(block.mass, Csr)
        assert (block.mass @ np.ones(n)).sum() == pytest.approx(1.0 + 0.1*n, rel=1e3*EPS)


def test_laws_of_a_program_are_of_the_plane(tmp_path: Path) -> None:
    text = flight("C3D8").replace(RUBBER, "*USER MATERIAL, CONSTANTS=0\n")
    with pytest.raises(InputError, match="law"):
        Stepper(deck(tmp_path, text))
