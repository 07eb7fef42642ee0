"""A host in FElupe, with contact and friction in space, against the program's own run."""

from __future__ import annotations

import sys

import numpy as np
import pytest

pytest.importorskip("felupe", reason="FElupe is not installed")
from embed_tools import HERE, run  # noqa: E402
from felupe_host import LAME, PLATE, Host, thrown  # noqa: E402

from emcon import Model, Stepper  # noqa: E402

TYPES = {"node to segment": "NODE TO SURFACE", "mortar": "MORTAR"}


def own_model(host: Host, kind: str, friction: float) -> Model:
    """The same block with elements of the library; its plate is an element, all of whose nodes are held."""
    lam, mu = LAME
    below = np.array(PLATE) - [0, 0, 1]
    x = np.concatenate([host.mesh.points, PLATE, below])
    plate = host.n + np.array([4, 5, 6, 7, 0, 1, 2, 3])
    model = Model.from_arrays(x, {"C3D8": [*host.mesh.cells, plate]})
    model.material("M", density=1.0, elastic=(mu*(3*lam + 2*mu)/(lam + mu), lam/(2*(lam + mu)))).section("M")
    lowest = np.isclose(host.mesh.points[host.mesh.cells, 2].min(1), 0.03)
    model.surface("SOLE", faces=[(int(k), 1) for k in np.flatnonzero(lowest)])
    model.surface("PLATE", faces=[(len(host.mesh.cells), 2)])
    model.interaction("I", **({"friction": friction} if friction else {}))
    model.contact_pair("SOLE", "PLATE", interaction="I", edges="NO", guard="NO", sides="ONE", type=TYPES[kind])
    model.boundary(range(host.n, len(x)), (1, 2, 3))
    model.initial("VELOCITY", range(host.n), (1, 2, 3), (1.0, 0.4, -1.0))
    model.step("DYNAMIC", 0.01, 0.24, direct=True, nlgeom=True)
    return model


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("kind", list(TYPES))
def test_a_host_in_felupe_does_what_the_program_does(kind: str, friction: float) -> None:
    """Flight, impact, rubbing and parting."""
    host = thrown(kind, friction)
    energy, n_touch = host.energy(), 0
    with Stepper(own_model(host, kind, friction)) as program:
        for _ in range(24):
            program.step(0.01)
            host.step(0.01)
            n_touch += host.active.any()
            assert abs(host.energy() - energy) < 1e-13*energy
            np.testing.assert_allclose(host.u, program.u[:host.n], rtol=0, atol=1e-13)
        assert host.lost == pytest.approx(program.ledger["friction_loss"], abs=1e-13)
    assert 0 < n_touch < 20 and not host.active.any()
    assert host.v[:, 2].mean() > 0 and (host.lost > 0.1*energy) == (friction > 0)


def test_the_derivative_is_that_of_the_residual() -> None:
    """Central differences of FElupe's forces by the material of a step."""
    host = thrown("mortar", 0.0)
    rng = np.random.default_rng(7)
    host.solid.umat.start = host.deform(0.05*rng.standard_normal(host.u.shape)).copy()
    at, way = (0.05*rng.standard_normal(host.u.shape) for _ in range(2))
    h = 1e-6

    def force(u: np.ndarray) -> np.ndarray:
        host.deform(u)
        return host.solid.assemble.vector(host.field).toarray().ravel()

    host.deform(at)
    slope = host.solid.assemble.matrix(host.field) @ way.ravel()
    differences = (force(at + h*way) - force(at - h*way))/(2*h)
    # Truncation is of second order in h, round-off of the forces by h.
    np.testing.assert_allclose(slope, differences, rtol=0, atol=1e-7*np.abs(slope).max())


def test_the_example_runs() -> None:
    lines = run(sys.executable, HERE/"felupe_host.py").splitlines()
    assert [line.split("  ")[0].strip() for line in lines] == list(TYPES)
