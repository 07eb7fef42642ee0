"""A host in space with a solid of its own against the program's own run of the same bodies."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from embed_tools import HERE, run
from interface_solid import CORNERS, Host, collision

from emcon import Model, Stepper
from emcon.interface import outer_faces

H, N_STEP = 0.01, 20
#: The side of the unit cube, axis and place, that is face 1 to 6 of a C3D8.
SIDES = ((2, 0), (2, 1), (1, 0), (0, 1), (1, 1), (0, 0))


def own_model(host: Host, kind: str, friction: float, itself: bool, **more: object) -> Model:
    """The model of the same bodies: elements of the library, contact of the same nodes, no edges."""
    x, cells, (lam, mu) = host.solid.x, host.solid.cells, host.solid.lame
    model = Model.from_arrays(x, {"C3D8": cells})
    model.material("M", density=1.0, elastic=(mu*(3*lam + 2*mu)/(lam + mu), lam/(2*(lam + mu)))).section("M")
    plate, block = np.unique(cells[:9]), np.unique(cells[9:])
    model.surface("PLATE", faces=[(k, 2) for k in range(9)])
    model.surface("SOLE", faces=[(k, 1) for k in range(9, len(cells))])
    outer = set(map(frozenset, outer_faces(cells)[0].tolist()))
    model.surface("SKIN", faces=[(k, n) for k, cell in enumerate(cells) for n, (axis, place) in enumerate(SIDES, 1)
                                 if frozenset(cell[CORNERS[:, axis] == place].tolist()) in outer])
    model.interaction("I", **({"friction": friction} if friction > 0 else {}), **more)
    # A surface by nodes holds all of these; of mortar guards would hold what it lets in.
    rules = {} if itself and kind != "mortar" else {"guard": "NO"}
    model.contact_pair(*(("SKIN", "SKIN") if itself else ("SOLE", "PLATE")), interaction="I", edges="NO",
                       type={"node to segment": "NODE TO SURFACE", "mortar": "MORTAR"}[kind],
                       **rules, **({} if itself else {"sides": "ONE"}))
    model.boundary([int(k) for k in plate if np.isclose(x[k, 2], -0.5)], [1, 2, 3])
    model.initial("VELOCITY", [int(k) for k in block], [1, 2, 3], [1.0, 0.4, -1.0])
    model.step("DYNAMIC", h=H, duration=N_STEP*H, nlgeom=True, direct=True)
    return model


@pytest.mark.parametrize("itself", [False, True])
@pytest.mark.parametrize(("kind", "friction"), [("node to segment", 0.0), ("node to segment", 0.1), ("node to segment", 0.4),
                                                ("node to segment", 0.8), ("mortar", 0.0), ("mortar", 0.1), ("mortar", 0.6)])
def test_the_host_gives_what_the_program_gives(kind: str, friction: float, itself: bool) -> None:
    """Impact, sliding or sticking, and parting; energy and losses stay what they are."""
    host = collision(kind, friction, itself)
    start = host.energy()
    with Stepper(own_model(host, kind, friction, itself)) as program:
        for _ in range(N_STEP):
            program.step(H)
            host.step(H)
            assert abs(host.energy() - start) < 1e-13*start
            # To the round-off of steps, and 2/h times that.
            np.testing.assert_allclose(host.u, program.u, rtol=0, atol=1e-13)
            np.testing.assert_allclose(host.v, program.v, rtol=0, atol=2/H*1e-13)
        assert host.lost == pytest.approx(program.ledger["friction_loss"], abs=1e-13)
    _, n_sticking, n_sliding = host.n_status
    assert n_sliding + n_sticking >= 27 and (n_sliding > 0) == (friction > 0)
    assert friction < 0.6 or n_sticking > 9
    assert host.v[len(np.unique(host.solid.cells[:9])):, 2].mean() > 0.3


@pytest.mark.parametrize("kind", ["node to segment", "mortar"])
def test_an_interface_remembers_nothing(kind: str) -> None:
    """Two collisions in turn through one interface: the bits of each by its own."""
    alone, others = [collision(kind) for _ in range(2)], [collision(kind) for _ in range(2)]
    others[1].face = others[0].face
    for pair in (alone, others):
        pair[1].v *= [0.5, -1.0, 1.3]
        for _ in range(12):
            for host in pair:
                host.step(H)
    for one, other in zip(alone, others, strict=True):
        np.testing.assert_array_equal(one.u, other.u)
        np.testing.assert_array_equal(one.v, other.v)
        np.testing.assert_array_equal(one.active, other.active)
        assert one.lost == other.lost and one.active.any() or one.n_status[1:].any()


def test_the_example_runs() -> None:
    lines = run(sys.executable, HERE/"interface_solid.py").splitlines()
    assert [line.split("  ")[0].strip() for line in lines] == ["node to segment", "mortar"]
