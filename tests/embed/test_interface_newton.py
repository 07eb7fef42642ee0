"""Newton's method of an interface: by maps, ties, the null space, sparse matrices, solvers of the host's own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from interface_solid import Floats, Host, Solid, block, collision

from emcon.interface import AnalysisError, InputError, Interface, outer_faces

H, N_STEP = 0.01, 14
scipy_sparse = pytest.importorskip("scipy.sparse")


class Sparse(Host):
    """The host with a sparse tangent, all candidates or sets of contacts."""

    together = False

    def step(self, h: float) -> None:
        def respond(du: Floats) -> tuple[Floats, Any]:
            residual, tangent = self.respond(h, du)
            return residual, scipy_sparse.csr_array(tangent)

        du, _, self.active = self.face.solve_step(self.u, h*self.v, self.active, self.face.newton(self.u, respond),
                                                  together=self.together)
        self.u, self.v = self.u + du, 2/h*du - self.v


class Mapped(Host):
    """The host that solves for the displacements of free nodes, by a map."""

    def step(self, h: float) -> None:
        a = self.face.links()
        self.face.set_map(a)

        def respond(du: Floats) -> tuple[Floats, Floats]:
            residual, tangent = self.respond(h, du)
            return residual @ a, a.toarray().T @ tangent @ a.toarray()

        du, _, self.active = self.face.solve_step(self.u, h*self.v, self.active, self.face.newton(self.u, respond),
                                                  stop=0.5*h*self.v, h=h, together=True)
        self.lost += self.face.slips().loss + self.face.law_forces()[1]
        self.u, self.v = self.u + du, 2/h*du - self.v


def turned(host: Host, kind: type[Host]) -> Host:
    other = kind.__new__(kind)
    vars(other).update(vars(host))
    return other


def assert_like(host: Host, other: Host) -> None:
    """Both go the same way, to the round-off of steps."""
    has_touched = False
    for _ in range(N_STEP):
        host.step(H)
        other.step(H)
        np.testing.assert_allclose(other.u, host.u, rtol=0, atol=1e-13)
        np.testing.assert_array_equal(other.active, host.active)
        assert other.lost == pytest.approx(host.lost, abs=1e-13)
        has_touched |= host.active.any()
    assert has_touched


@pytest.mark.parametrize("together", [False, True])
@pytest.mark.parametrize("kind", ["node to segment", "mortar"])
def test_null_space_and_candidates_agree(kind: str, together: bool) -> None:
    sparse = turned(collision(kind, 0.0), Sparse)
    sparse.together = together
    assert_like(collision(kind, 0.0), sparse)


@pytest.mark.parametrize("more", [{}, {"damping": (20.0, 0.04, 0.3)}])
def test_unknowns_of_a_map(more: dict[str, Any]) -> None:
    assert_like(collision("mortar", 0.3, **more), turned(collision("mortar", 0.3, **more), Mapped))


def test_a_solver_of_the_hosts_own_solves() -> None:
    sizes = []

    def solve(matrix: Floats, right: Floats) -> Floats:
        sizes.append((len(matrix), len(right)))
        return np.linalg.solve(matrix, right)

    plain, other = collision(), collision()
    other.solve = solve
    for _ in range(N_STEP):
        plain.step(H)
        other.step(H)
    np.testing.assert_array_equal(plain.u, other.u)
    n = other.face.n_unknown
    assert len(sizes) > N_STEP and set(sizes) == {(n, n)}


@pytest.mark.parametrize("together", [False, True])
def test_a_tied_body_collides(together: bool) -> None:
    """Its halves have meshes that do not match; energy stays, and the halves stay together."""
    plate, lower = block((2, 2, 1), np.array([-1.0, -1.0, -0.4]), np.array([2.0, 2.0, 0.4]))
    middle, half = block((2, 2, 1), np.array([-0.5, -0.4, 0.01]), np.array([0.9, 0.8, 0.3]), len(plate))
    top, other = block((3, 3, 1), np.array([-0.5, -0.4, 0.31]), np.array([0.9, 0.8, 0.3]), len(plate) + len(middle))
    x, cells = np.concatenate([plate, middle, top]), np.concatenate([lower, half, other])
    face, (skin,) = Interface(x), outer_faces(cells)
    n = len(plate) + len(middle)

    def at(name: str, z: float, first: int, last: int) -> int:
        return face.add_faces(name, skin[np.isclose(x[skin, 2], z).all(1) & (skin >= first).all(1) & (skin < last).all(1)])

    face.add_pair(at("sole", 0.01, 0, n), at("plate", 0.0, 0, n), "node to segment")
    face.add_tie(at("above", 0.31, n, len(x)), at("below", 0.31, 0, n))
    face.prepare(np.isclose(x[:, 2], -0.4)[:, None] & np.ones(3, bool))
    host = Host(Solid(x, cells, (600.0, 400.0), 1.0), face)
    host.v[len(plate):] = [0.3, 0.1, -0.7]
    energy, n_touch = host.energy(), 0
    for _ in range(12):
        du, _, host.active = face.solve_step(host.u, H*host.v, host.active,
                                             face.newton(host.u, lambda du: host.respond(H, du)), together=together)
        host.u, host.v = host.u + du, 2/H*du - host.v
        n_touch += host.active.any()
        assert abs(host.energy() - energy) < 1e-13*energy
        np.testing.assert_allclose(face.follow(host.u), host.u, rtol=0, atol=1e-14)
    assert 0 < n_touch < 12 and np.abs(host.u[n:]).max() > 0.01


def test_what_does_not_converge_or_does_not_go_together_is_told() -> None:
    host = collision("node to segment", 0.0)
    flat = np.eye(host.solid.x.size)
    for newton, error, said in (
            (host.face.newton(host.u, lambda du: (np.ones(du.size), flat)), AnalysisError, "last correction is"),
            (host.face.newton(host.u, lambda du: host.respond(H, du), free=[0, 1]), InputError, "free goes with")):
        with pytest.raises(error, match=said):
            host.face.solve_step(host.u, H*host.v, host.active, newton)


def test_contacts_that_follow_from_others_are_told() -> None:
    """The same pair twice holds each gap twice."""
    x = np.array([[-1.0, 0.0], [1.0, 0.0], [-0.3, 0.1], [0.3, 0.1]])
    with Interface(x) as face:
        face.configure(is_end=True, initiation="admissible")
        floor, sole = face.add_surface("floor", [[1, 0]]), face.add_surface("sole", [[2, 3]])
        for _ in range(2):
            face.add_pair(sole, floor, "node to segment")
        face.prepare(np.arange(4)[:, None] < 2 + np.zeros(2))
        du = np.where(np.arange(4)[:, None] > 1, [0.0, -0.2], 0.0)
        newton = face.newton(np.zeros((4, 2)), lambda motion: (motion - du, np.eye(8)))
        with pytest.raises(AnalysisError, match=r"the contacts \[\d \d\] are redundant: solve with together=True"):
            face.solve_step(np.zeros((4, 2)), du, np.zeros(4, bool), newton)
        motion, lam, active = face.solve_step(np.zeros((4, 2)), du, np.zeros(4, bool), newton, together=True)
    np.testing.assert_allclose(motion[2:], [[0.0, -0.1]]*2, rtol=0, atol=1e-15)
    assert active.any() and lam.sum() == pytest.approx(0.2)


@pytest.mark.parametrize("found", [None, (np.zeros((4, 2)),)])
def test_what_a_host_solves_is_checked(found: object) -> None:
    with Interface(np.array([[-1.0, 0.0], [1.0, 0.0], [-0.3, 0.1], [0.3, 0.13]])) as face:
        face.add_pair(face.add_surface("sole", [[2, 3]]), face.add_surface("floor", [[1, 0]]), "node to segment")
        face.prepare(np.zeros((4, 2), bool))
        none = np.zeros(face.n_contact, bool)
        with pytest.raises(InputError, match="to return the motion and the multipliers, not"):
            face.solve_step(np.zeros((4, 2)), np.zeros((4, 2)), none, lambda du, n: found)
