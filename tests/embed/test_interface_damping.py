"""Damping of contact for a host: forces against the rate of gaps and slips, beside the rows of contact."""

from __future__ import annotations

import numpy as np
import pytest
from interface_solid import Floats, collision
from test_interface_solid import H, N_STEP, own_model
from test_interface_space import over_the_floor

from emcon import Stepper
from emcon.interface import InputError, Interface

#: Of the size of density times wave speed; over a clearance that is left in two steps.
DAMPING = {"damping": (20.0, 0.04, 0.3)}


@pytest.mark.parametrize("along", [{}, {"tangent_fraction": 0.5}])
@pytest.mark.parametrize(("kind", "friction"), [("node to segment", 0.0), ("node to segment", 0.4), ("mortar", 0.0), ("mortar", 0.3)])
def test_the_damped_host_gives_what_the_program_gives(kind: str, friction: float, along: dict[str, float]) -> None:
    host = collision(kind, friction, **DAMPING, **along)
    start = host.energy()
    model = own_model(host, kind, friction, itself=False, **DAMPING, **along)
    with Stepper(model) as program:
        for _ in range(N_STEP):
            program.step(H)
            host.step(H)
            assert abs(host.energy() - start) < 1e-13*start
            np.testing.assert_allclose(host.u, program.u, rtol=0, atol=1e-13)
            np.testing.assert_allclose(host.v, program.v, rtol=0, atol=2/H*1e-13)
        taken = program.ledger["contact_damping_loss"]
        assert taken > 0.05*start
        assert host.lost == pytest.approx(program.ledger["friction_loss"] + taken, abs=1e-13)


@pytest.mark.parametrize("fraction", [0.0, 0.6])
@pytest.mark.parametrize("kind", ["node to segment", "mortar"])
def test_the_derivative_of_damping_is_in_the_curvature(kind: str, fraction: float) -> None:
    face, _ = over_the_floor(kind=kind, **DAMPING, tangent_fraction=fraction)
    random = np.random.default_rng(8)
    u0, du, way = 0.01*random.standard_normal((3, face.n_node, 3))
    active = face.begin_step(u0, du, np.zeros(face.n_contact, bool), h=0.01)

    def force(t: float) -> Floats:
        face.select(u0, du + t*way, active)
        face.evaluate(u0, du + t*way)
        return face.law_forces()[0].ravel()

    assert np.abs(force(0.0)).max() > 0
    slope = face.curvature(np.zeros(0)).toarray() @ way.ravel()
    size = np.finfo(float).eps**(1/3)
    difference = (force(size) - force(-size))/(2*size)
    assert np.abs(slope - difference).max() < 1e-7*np.abs(slope).max()
    for way in 0.02*random.standard_normal((5, face.n_node, 3)):
        face.select(u0, way, face.begin_step(u0, way, np.zeros(face.n_contact, bool), h=0.01))
        face.evaluate(u0, way)
        push, taken = face.law_forces()
        assert taken >= 0 and taken == pytest.approx(-(push*way).sum(), abs=1e-13*np.abs(push).sum())


def test_a_rigid_mass_keeps_its_law() -> None:
    """M v + A m(g) is constant, in steps of any size: m is the damping up to the gap (theory, 4.14)."""
    mass, c, clearance = 2.0, 30.0, 0.1
    for h in (0.01, 0.037):
        x = np.array([[-1.0, 0.0], [1.0, 0.0], [-0.5, 0.12], [0.5, 0.12]])
        face = Interface(x)
        floor, sole = face.add_surface("floor", [[1, 0]]), face.add_surface("sole", [[2, 3]])
        face.add_pair(sole, floor, "node to segment", damping=(c, clearance, 0.0))
        face.prepare()
        u, v, active, found = np.zeros((4, 2)), np.zeros((4, 2)), np.zeros(face.n_contact, bool), []
        v[2:, 1] = -0.5
        for _ in range(40):
            def newton(du: Floats, n: int, u: Floats = u, v: Floats = v, h: float = h) -> tuple[Floats, Floats]:
                assert n == 0
                for _ in range(20):
                    face.evaluate(u, du)
                    force, _ = face.law_forces()
                    residual = (mass/2*2/h*(du/h - v) - force)[2:].ravel()
                    tangent = mass/2*2/h**2*np.eye(4) - face.curvature(np.zeros(0)).toarray()[4:, 4:]
                    du[2:] -= np.linalg.solve(tangent, residual).reshape(2, 2)
                return du, np.zeros(0)

            du, _, active = face.solve_step(u, h*v, active, newton, h=h)
            u, v = u + du, 2/h*du - v
            gap = 0.12 + u[2:, 1]
            m = c*np.where(gap < clearance, clearance/2 - gap + gap**2/(2*clearance), 0.0)     # integral of mu from the gap up
            found.append(mass/2*v[2:, 1] - 0.5*m)
        assert np.ptp(found) < 1e-13 and v[2, 1] > -0.2


def test_damping_against_slip_in_the_plane() -> None:
    """A mass that moves along the floor at a fixed gap: the pressure by velocity times the fraction, on its area."""
    x = np.array([[-1.0, 0.0], [1.0, 0.0], [-0.2, 0.04], [0.2, 0.04]])
    face = Interface(x)
    floor, sole = face.add_surface("floor", [[1, 0]]), face.add_surface("sole", [[2, 3]])
    face.add_pair(sole, floor, "node to segment", damping=(30.0, 0.1, 0.5), tangent_fraction=0.4)
    face.prepare()
    u, du, h = np.zeros((4, 2)), np.array([[0, 0], [0, 0], [0.02, 0], [0.02, 0]]), 0.05
    face.select(u, du, face.begin_step(u, du, np.zeros(face.n_contact, bool), h=h))
    face.evaluate(u, du)
    force, taken = face.law_forces()
    push = 30.0*0.4*0.2*0.02/h
    np.testing.assert_allclose(force[2:], [[-push, 0]]*2, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(force[:2].sum(0), [2*push, 0], rtol=1e-14, atol=1e-14)
    assert taken == pytest.approx(2*push*0.02)


def test_damping_needs_the_size_of_the_step() -> None:
    face, _ = over_the_floor(**DAMPING)
    u = np.zeros((face.n_node, 3))
    active = face.begin_step(u, u, np.zeros(face.n_contact, bool))
    face.select(u, u, active)
    with pytest.raises(InputError, match="the size of the step is to be told"):
        face.evaluate(u, u)
    with pytest.raises(InputError, match="h is 0"):
        face.begin_step(u, u, active, h=0.0)
    for wrong, said in ((-1.0, "damping is -1, below 0"), ((1, 0, 2), "the flat part of damping is 2"), ((), "one to three numbers")):
        other = Interface(face.positions)
        with pytest.raises(InputError, match=said):
            other.add_pair(other.add_faces("a", [[0, 1, 4]]), other.add_faces("b", [[2, 3, 6]]), damping=wrong)
