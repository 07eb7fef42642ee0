"""Friction for host codes, in the plane and in space: closed forms, gradients, losses, P and DF."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
import pytest
from test_interface_space import over_the_floor

from emcon.interface import Constraints, InputError, Interface, Outcome, Slips

EPS = np.finfo(float).eps
G, H, MU = 10.0, 0.02, 0.3
KINDS = ("node to segment", "mortar")


@dataclass
class Feet:
    """Point masses of 1 on a floor that is held, each of them free; motion along the surface only."""

    face: Interface
    x: np.ndarray
    first: int      #: the first of the masses

    def __post_init__(self) -> None:
        self.u, self.v = np.zeros(self.x.shape), np.zeros(self.x.shape)
        self.active = np.zeros(self.face.n_contact, bool)
        self.push = np.zeros(self.x.shape)
        self.push[self.first:, -1] = -G

    def step(self, rests: bool = True, way: str = "multipliers") -> tuple[Constraints, Slips]:
        """One step of size H; with `rests` friction stops, else it turns round."""
        face, n_dim = self.face, self.x.shape[1]
        du = H*self.v
        free = np.eye(self.x.size)[:, n_dim*self.first:]
        self.active = face.begin_step(self.u, du, self.active, stop=0.5*H*self.v if rests else None)
        outcome = None
        while outcome is None:
            select = face.select_candidates if way == "candidates" else face.select
            n = select(self.u, du, self.active)
            lam = np.zeros(n)
            for _ in range(8):
                rows = face.evaluate(self.u, du)
                assert rows.n == n
                g, c = rows.g.toarray() @ free, rows.c.toarray() @ free
                residual = (2/H*(du/H - self.v) - self.push).ravel()
                if way == "null space":
                    space = face.null_space()
                    p, df = free.T @ space.p.toarray(), free.T @ space.df.toarray()
                    np.testing.assert_allclose(p.T @ g.T, 0, atol=1e-13)
                    np.testing.assert_allclose(c @ df, 0, atol=1e-13)
                    lam = face.multipliers(residual.reshape(du.shape))
                stiff = 2/H**2*np.eye(free.shape[1]) - free.T @ face.curvature(lam).toarray() @ free
                if way == "candidates":
                    solved = np.linalg.solve(stiff, np.column_stack([g.T, free.T @ residual]))
                    if n:
                        lam = face.solve_contacts(c @ solved[:, :n], rows.defect - c @ solved[:, n])
                    du = du + (free @ (solved[:, :n] @ lam - solved[:, n])).reshape(du.shape)
                    continue
                if way == "null space":
                    part = free.T @ face.particular(rows.defect).ravel()
                    y = np.linalg.solve(p.T @ stiff @ df, -p.T @ (free.T @ residual + stiff @ part))
                    du = du + (free @ (part + df @ y)).reshape(du.shape)
                    continue
                matrix = np.block([[stiff, -g.T], [c, np.zeros((n, n))]])
                found = np.linalg.solve(matrix, -np.concatenate(
                    [free.T @ residual - g.T @ lam, rows.defect]))
                du = du + (free @ found[:len(stiff)]).reshape(du.shape)
                lam = lam + found[len(stiff):]
            self.active, outcome = face.update_active(self.u, du, lam, self.active)
        assert outcome is Outcome.DONE
        self.u, self.v = self.u + du, 2/H*du - self.v
        return rows, face.slips()


def feet(n_dim: int, kind: str, mu: float = MU) -> Feet:
    if n_dim == 2:
        x = np.array([[-5, 0], [5, 0], [-0.3, 0], [0.3, 0]], float)
        first, sides = 2, ([[1, 0]], [[2, 3]])
    else:
        x = np.array([[-5, -5, 0], [5, -5, 0], [5, 5, 0], [-5, 5, 0], [0, 0, 0], [0.5, 0.1, 0],
                      [0.1, 0.6, 0]], float)
        first, sides = 4, ([[0, 1, 2, 3]], [[4, 6, 5]])
    face = Interface(x)
    floor, sole = face.add_faces("floor", sides[0]), face.add_faces("sole", sides[1])
    face.add_pair(sole, floor, kind, friction=mu)
    held = np.zeros(x.shape, bool)
    held[:first] = True
    face.prepare(held)
    return Feet(face, x, first)


@pytest.mark.parametrize("way", ["multipliers", "null space", "candidates"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("n_dim", [2, 3])
def test_masses_slide_and_come_to_rest(n_dim: int, kind: str, way: str) -> None:
    """v falls by mu g h in each step, along itself, until it is 0; what is lost is friction by slip."""
    host = feet(n_dim, kind)
    along = np.array([1.0, 0.4, 0.0])[:n_dim]
    along[-1] = 0.0
    speed = np.linalg.norm(along)
    host.v[host.first:] = along
    for k in range(1, 31):
        before = 0.5*(host.v**2).sum()
        _, slips = host.step(way=way)
        left = max(0.0, 1 - k*MU*G*H/speed)
        np.testing.assert_allclose(host.v[host.first:], np.tile(left*along, (n_dim, 1)), rtol=0,
                                   atol=1e3*EPS*speed)
        lost = (slips.friction*slips.slip).sum(axis=1)
        assert (lost >= -EPS).all()
        assert before - 0.5*(host.v**2).sum() == pytest.approx(lost.sum(), abs=1e3*EPS)
        if left > 0:
            assert (slips.status == 2).all()
            np.testing.assert_allclose(np.linalg.norm(slips.friction, axis=1).sum(), MU*G*n_dim,
                                       rtol=1e3*EPS)
        elif k*MU*G*H/speed > 2:
            assert (slips.status == 1).all()
    assert not np.abs(host.v).max() > 1e3*EPS


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("n_dim", [2, 3])
def test_without_a_motion_to_rest_what_sticks_turns_round(n_dim: int, kind: str) -> None:
    """With friction that is enough (2 v/h = 7 of 10) the velocity is reversed: no loss."""
    host = feet(n_dim, kind, mu=1.0)
    host.active[:] = True
    host.v[host.first:, 0] = 0.07
    start = host.v.copy()
    for sign in (-1, 1):
        _, slips = host.step(rests=False)
        assert (slips.status == 1).all()
        np.testing.assert_allclose(host.v, sign*start, rtol=0, atol=1e3*EPS)
        assert np.abs(slips.friction*slips.slip).max() < 1e3*EPS


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("n_dim", [2, 3])
def test_a_load_along_the_surface_holds_up_to_its_limit(n_dim: int, kind: str) -> None:
    host = feet(n_dim, kind)
    host.push[host.first:, 0] = 0.99*MU*G
    host.active[:] = True
    _, slips = host.step()
    assert (slips.status == 1).all() and not np.abs(host.v).max() > 1e3*EPS
    host.push[host.first:, 0] = 1.5*MU*G
    _, slips = host.step()
    assert (slips.status == 2).all()
    np.testing.assert_allclose(host.v[host.first:, 0], 0.5*MU*G*H, rtol=1e4*EPS)


def rubbing(kind: str, slides: bool) -> tuple[Interface, np.ndarray, np.ndarray, np.ndarray]:
    """A foot over a curved floor, after one step began; all slide, or all stick."""
    face, _ = over_the_floor(kind=kind, friction=0.4)
    random = np.random.default_rng(3)
    u0, du = 0.02*random.standard_normal((2, face.n_node, 3))
    active = face.begin_step(u0, du if slides else 0*du, np.ones(face.n_contact, bool))
    assert active.all()
    return face, u0, du, active


@pytest.mark.parametrize("slides", [True, False], ids=["slides", "sticks"])
@pytest.mark.parametrize("kind", KINDS)
def test_gradients_and_second_derivatives(kind: str, slides: bool) -> None:
    """c by differences of f; `curvature` by differences of forces, whose directions turn with slip."""
    face, u0, du, active = rubbing(kind, slides)
    random = np.random.default_rng(4)
    along = random.standard_normal(du.shape)
    n = face.select(u0, du, active)
    assert n == (9 if slides else 27)
    lam = random.uniform(0.5, 1.0, n)*np.where(np.arange(n) % 2, -1, 1)     # some pull on the way

    def at(step: float) -> tuple[np.ndarray, np.ndarray]:
        face.select(u0, du + step*along, active)
        rows = face.evaluate(u0, du + step*along)
        return rows.end, rows.g.toarray().T @ lam

    error = []
    for width in (4e-6, 1e-6):
        (right, after), (left, before) = at(width), at(-width)
        face.select(u0, du, active)
        rows = face.evaluate(u0, du)
        error.append((np.abs((right - left)/(2*width) - rows.c.toarray() @ along.ravel()).max(),
                      np.abs((after - before)/(2*width) - face.second_times(lam, along).ravel()).max()))
    size = np.abs(face.second_times(lam, along)).max()
    np.testing.assert_allclose(face.curvature(lam).toarray() @ along.ravel(),
                               face.second_times(lam, along).ravel(), rtol=0, atol=1e-13*size)
    # Central differences: a quarter of the width leaves a sixteenth, or round-off of eps/width.
    floor = 1e3*EPS/1e-6*size
    assert error[1][0] <= max(error[0][0]/8, floor)
    assert error[1][1] <= max(error[0][1]/8, floor)
    assert error[1][1] < 1e-5*size


@pytest.mark.parametrize("slides", [True, False], ids=["slides", "sticks"])
@pytest.mark.parametrize("kind", KINDS)
def test_friction_has_neither_resultant_nor_moment(kind: str, slides: bool) -> None:
    face, u0, du, active = rubbing(kind, slides)
    face.select(u0, du, active)
    rows = face.evaluate(u0, du)
    middle = face.positions + u0 + 0.5*du
    for row in rows.g.toarray().reshape(rows.n, -1, 3):
        assert np.abs(row.sum(axis=0)).max() < 1e2*EPS
        assert np.abs(np.cross(middle, row).sum(axis=0)).max() < 1e2*EPS


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("n_dim", [2, 3])
def test_candidates_that_do_not_push_are_let_go(n_dim: int, kind: str) -> None:
    host = feet(n_dim, kind)
    host.active[:] = True
    host.push[host.first:, -1] = [G, -G, -G][:n_dim]
    _, slips = host.step(way="candidates")
    if kind == "mortar":      # each multiplier pulls at all nodes
        return
    assert sorted(slips.status) == [0] + [1]*(n_dim - 1)
    assert host.active.sum() == n_dim - 1


def test_compliances_that_do_not_fit() -> None:
    host = feet(3, "node to segment")
    n = host.face.n_contact
    active = host.face.begin_step(host.u, host.u, np.ones(n, bool))
    rows = host.face.select_candidates(host.u, host.u, active)
    assert rows == 3*n
    with pytest.raises(InputError, match="no constraints were evaluated"):
        host.face.solve_contacts(np.eye(rows), np.zeros(rows))
    host.face.evaluate(host.u, host.u)
    with pytest.raises(InputError, match="w"):
        host.face.solve_contacts(np.eye(rows - 1), np.zeros(rows))
    np.testing.assert_array_equal(host.face.solve_contacts(np.eye(rows), np.ones(rows))[:n], 0.0)


def test_bad_coefficients() -> None:
    face = Interface([[0, 0], [1, 0], [0, 1], [1, 1]])
    lower, upper = face.add_surface("lower", [[1, 0]]), face.add_surface("upper", [[2, 3]])
    for mu, said in ((-0.1, "friction is -"), (float("nan"), "friction")):
        with pytest.raises(InputError, match=re.escape(said)):
            face.add_pair(upper, lower, friction=mu)
