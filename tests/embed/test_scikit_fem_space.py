"""A host in scikit-fem in space, static and dynamic with friction, against the program's own runs."""

from __future__ import annotations

import sys

import numpy as np
import pytest

pytest.importorskip("skfem")
from embed_tools import HERE, run  # noqa: E402
from scikit_fem_space import Host, drive  # noqa: E402

from emcon import Model, Stepper  # noqa: E402

#: Corners of a C3D8 by the sides of its box.
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
TYPES = {"node to segment": "NODE TO SURFACE", "mortar": "MORTAR"}
FRICTION = [("node to segment", 0.0), ("node to segment", 0.3), ("mortar", 0.0), ("mortar", 0.3)]
DOWN, ALONG = 0.01, 0.02


def as_boxes(x: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Cells whose corners are in the order of C3D8."""
    at = x[cells] > x[cells].mean(1)[:, None]
    order = (at[:, None] == CORNERS[None, :, None]).all(-1).argmax(-1)
    return np.take_along_axis(cells, order, 1)


def own_model(host: Host, kind: str, friction: float) -> Model:
    """The same bodies with elements of the library."""
    x, cells, (lam, mu) = host.x, as_boxes(host.x, host.mesh.t.T), host.lame
    model = Model.from_arrays(x, {"C3D8": cells})
    model.material("M", density=1.0, elastic=(mu*(3*lam + 2*mu)/(lam + mu), lam/(2*(lam + mu)))).section("M")
    lowest = x[cells[:, 0], 2]
    model.surface("PLATE", faces=[(int(k), 2) for k in np.flatnonzero(lowest < -0.4)])
    model.surface("SOLE", faces=[(int(k), 1) for k in np.flatnonzero(lowest > -0.4)])
    model.interaction("I", **({"friction": friction} if friction else {}))
    model.contact_pair("SOLE", "PLATE", interaction="I", edges="NO", guard="NO", sides="ONE", type=TYPES[kind])
    model.boundary(np.flatnonzero(x[:, 2] == -0.5), (1, 2, 3))
    return model


@pytest.mark.parametrize(("kind", "friction"), FRICTION)
def test_steps_that_keep_the_energy(kind: str, friction: float) -> None:
    host, h = Host(kind, friction, False), 0.01
    host.v[host.n_plate:] = [1.0, 0.4, -1.0]
    model = own_model(host, kind, friction)
    model.initial("VELOCITY", range(host.n_plate, len(host.x)), (1, 2, 3), (1.0, 0.4, -1.0))
    model.step("DYNAMIC", h, 12*h, direct=True, nlgeom=True)
    energy = host.energy()
    with Stepper(model) as program:
        for _ in range(12):
            program.step(h)
            host.step(h*host.v, h)
            assert abs(host.energy() - energy) < 1e-13*energy
            np.testing.assert_allclose(host.u, program.u, rtol=0, atol=1e-13)
            np.testing.assert_allclose(host.v, program.v, rtol=0, atol=2e-11)
        assert host.lost == pytest.approx(program.ledger["friction_loss"], abs=1e-13)
    assert (host.lost > 0.1*energy) == (friction > 0) and host.v[host.n_plate:, 2].mean() > 0


@pytest.mark.parametrize(("kind", "friction"), FRICTION)
def test_statics(kind: str, friction: float) -> None:
    """Pressed down in two increments, then dragged along in four."""
    host = Host(kind, friction, True)
    top = np.flatnonzero(host.x[:, 2] == 0.6)
    model = own_model(host, kind, friction)
    model.step("STATIC", 1.0, 2.0, direct=True, nlgeom=True).boundary(top, (1, 2, 3), (0.0, 0.0, -2*DOWN))
    model.step("STATIC", 1.0, 4.0, direct=True).boundary(top, (1, 2, 3), (4*ALONG, 0.0, -2*DOWN))
    with Stepper(model) as program:
        for k in range(6):
            program.step()
            drive(host, 0.0 if k < 2 else ALONG, DOWN if k < 2 else 0.0)
            # What Newton's method leaves, which stops at 1e-9 of the motion at the latest.
            np.testing.assert_allclose(host.u, program.u, rtol=0, atol=1e-12)
        assert host.lost == pytest.approx(program.ledger["friction_loss"], abs=1e-12)
    pull, _, push = host.respond(0.0*host.u)[0].reshape(-1, 3)[top].sum(0)
    # The plate bends below, and the law is along that.
    assert abs(pull/push) == pytest.approx(friction, abs=2e-3)


def test_the_example_runs() -> None:
    lines = run(sys.executable, HERE/"scikit_fem_space.py").splitlines()
    assert [line.split("  ")[0].strip() for line in lines] == ["node to segment", "mortar"]
