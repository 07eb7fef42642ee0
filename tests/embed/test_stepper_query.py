"""What the stepper is asked: residual, tangent, constraints, null space, against each other."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT/"pywrap"))

import emcon  # noqa: E402
from emcon.stepper import AnalysisError, Csr, InputError, Stepper  # noqa: E402

DECKS = ROOT/"input_decks"
RING = DECKS/"ring.inp"
EMCON = ROOT/"build"/"release"/"emcon"
EPS = np.finfo(float).eps
#: Central differences: the step for which truncation and rounding are about the same.
PROBE = EPS**(1/3)
#: What they leave of a value, for third derivatives up to this many times it.
DIFFERENCE = 1e3*PROBE**2
H = 0.05
FORMULATIONS = ("NODE TO SURFACE", "MORTAR")


class Contact:
    """The ring at the start of a step in contact; where the step leads to."""

    def __init__(self, formulation: str) -> None:
        self.stepper = Stepper(RING, h=H, formulation=formulation, initiation="PERSISTENT")
        self.stepper.run(until=0.75, callback=lambda ring, _: bool(ring.active.sum() >= 2))
        self.before = self.stepper.save()
        self.u0 = self.stepper.u
        self.increment = self.stepper.step()
        self.u1, self.lam, self.active = (self.stepper.u, self.stepper.lam, self.stepper.active)
        assert self.increment.cuts == 0 and self.active.sum() >= 2
        self.stepper.restore(self.before)


@pytest.fixture(scope="module", params=FORMULATIONS)
def contact(request: pytest.FixtureRequest) -> Contact:
    return Contact(request.param)


def same_state(ring: Stepper, u: np.ndarray, v: np.ndarray) -> bool:
    return np.array_equal(ring.u, u) and np.array_equal(ring.v, v)


def direction_of(ring: Stepper, seed: int) -> np.ndarray:
    """A random motion of the unknowns, (n_unknown,), whose size is that of an element."""
    return 0.1*(np.random.default_rng(seed).random(ring.n_unknown) - 0.5)


# --- residual, tangent, null space -------------------------------------------------------------

def test_solved_step_leaves_no_residual(contact: Contact) -> None:
    ring = contact.stepper
    solved = ring.evaluate(contact.u1, H, lam=contact.lam, active=contact.active)
    free = solved.unknown_residual(contact=False)
    assert np.abs(free).max() > 0.1
    # a sum of inertia, of the order of M v/h, and of the stresses in the foundation
    assert np.abs(solved.unknown_residual()).max() <= 1e3*EPS*(np.abs(ring.momenta()["py"])/H + 1)
    solved.null_space()
    lam = solved.multipliers()
    assert np.abs(lam - contact.lam).max() <= 1e4*EPS*contact.lam.max()
    nodal = solved.residual(contact=False)
    assert nodal.shape == (ring.n_node, 2)
    assert np.abs(ring.links.T @ nodal.ravel() - free).max() <= 64*EPS*np.abs(nodal).max()
    assert np.array_equal(nodal, ring.residual(contact.u1, H, lam=contact.lam,
                                               active=contact.active, contact=False))


@pytest.mark.parametrize("with_contact", [True, False])
def test_tangent_is_the_derivative_of_the_residual(contact: Contact, with_contact: bool) -> None:
    ring = contact.stepper
    q = direction_of(ring, 5)
    along = (ring.links @ q).reshape(-1, 2)

    def residual(step: float) -> np.ndarray:
        there = ring.evaluate(contact.u1 + step*along, H, lam=contact.lam, active=contact.active,
                              with_tangent=False)
        return there.unknown_residual(contact=with_contact)

    tangent = ring.tangent(contact.u1, H, lam=contact.lam, active=contact.active,
                           contact=with_contact)
    product = tangent @ q
    slope = (residual(PROBE) - residual(-PROBE))/(2*PROBE)
    assert np.abs(slope - product).max() <= DIFFERENCE*np.abs(product).max()


def test_null_space_is_one(contact: Contact) -> None:
    ring = contact.stepper
    p, d = ring.null_space(contact.u1, H, lam=contact.lam, active=contact.active)
    report = ring.constraint(u0=contact.u0, u1=contact.u1, keeps_gap=True)
    rows = np.flatnonzero(contact.active[report.id])
    assert len(rows) == contact.active.sum()
    assert p.shape == d.shape == (2*ring.n_node, ring.n_unknown - len(rows))
    g, c = report.discrete_gradient.toarray()[rows], report.jacobian.toarray()[rows]
    for matrix, rest in ((p, g @ p.toarray()), (d, c @ d.toarray())):
        assert np.abs(rest).max() <= 64*EPS*np.abs(matrix.data).max()
        np.linalg.cholesky(matrix.T @ matrix.toarray())      # fails unless columns are free


def test_newton_step_in_numpy(contact: Contact) -> None:
    """The null-space Newton iteration of the library, made of what it tells, finds its step.

    Per iteration: motion that closes the linearised gaps, and with DF such that none opens; the
    equations are those that P leaves of the residual.
    """
    ring = contact.stepper
    links = ring.links
    u, lam = ring.guess(H), 0*contact.lam
    size = np.abs(contact.u1 - contact.u0).max()
    errors = []
    while not errors or errors[-1] > 1e-9 and len(errors) < 8:
        report = ring.constraint(u0=contact.u0, u1=u, keeps_gap=True)
        rows = np.flatnonzero(contact.active[report.id])
        c, gap = report.jacobian.toarray()[rows] @ links, report.dgap[rows]
        here = ring.evaluate(u, H, lam=lam, active=contact.active)
        p, d = here.null_space()
        here = ring.evaluate(u, H, lam=here.multipliers(), active=contact.active)
        k, r = here.tangent(), here.unknown_residual(contact=False)
        onto = np.linalg.lstsq(c, -gap, rcond=None)[0]
        opens_none = links.T @ d.toarray()
        along = np.linalg.solve(p.T @ (links @ (k @ opens_none)), -(p.T @ (links @ (r + k @ onto))))
        u = u + (links @ (onto + opens_none @ along)).reshape(-1, 2)
        here = ring.evaluate(u, H, active=contact.active)
        here.null_space()
        lam = here.multipliers()
        errors.append(np.abs(u - contact.u1).max()/size)
    # quadratic in the end; the library stops at a relative residual of 1e-10
    assert errors[-1] < 1e-9 and errors[-2] > 100*errors[-1], errors
    assert np.abs(lam - contact.lam).max() <= 1e-8*contact.lam.max()


def test_asking_leaves_no_trace(contact: Contact) -> None:
    ring = contact.stepper
    ring.evaluate(ring.guess(3*H), H).null_space()
    ring.constraint(u0=ring.u, u1=contact.u1)
    ring.body_momenta()
    ring.pressures()
    ring.gaps()
    ring.step()
    assert np.array_equal(ring.u, contact.u1) and np.array_equal(ring.lam, contact.lam)
    ring.restore(contact.before)


def test_null_space_that_is_not_there(tmp_path: Path) -> None:
    """The same surfaces as two pairs: each constraint follows from its twin."""
    deck = tmp_path/"twice.inp"
    deck.write_text(RING.read_text(encoding="utf-8").replace(
        "RING_OUTER, BLOCK_TOP\n", "RING_OUTER, BLOCK_TOP\n"
        "*SURFACE, NAME=AGAIN, TYPE=ELEMENT\nBLOCK_TOP, S3\n"
        "*CONTACT PAIR, INTERACTION=FRICTIONLESS\nRING_OUTER, AGAIN\n", 1))
    with Stepper(deck, h=H) as ring:
        active = ring.positions[np.searchsorted(ring.labels, ring.contact()[2]), 1] == 0.1
        assert active.sum() == 2
        with pytest.raises(AnalysisError, match="are redundant"):
            ring.null_space(ring.u, H, active=active)


def test_friction_is_not_evaluated_from_outside(tmp_path: Path) -> None:
    """What sticks is told by increments alone; these go on."""
    deck = tmp_path/"rubs.inp"
    deck.write_text(RING.read_text(encoding="utf-8").replace(
        "*SURFACE BEHAVIOR", "*FRICTION\n0.3\n*SURFACE BEHAVIOR", 1))
    with Stepper(deck, h=H) as ring:
        with pytest.raises(InputError, match="FRICTION is not evaluated from outside"):
            ring.residual(ring.u, H)
        ring.run(until=1.0)
        assert ring.ledger["friction_loss"] > 0


def test_damping_is_not_evaluated_from_outside(tmp_path: Path) -> None:
    """What is near is told by increments alone; these go on."""
    deck = tmp_path/"damped.inp"
    deck.write_text(RING.read_text(encoding="utf-8").replace(
        "*SURFACE BEHAVIOR", "*CONTACT DAMPING\n0.5, 0.1\n*SURFACE BEHAVIOR", 1))
    with Stepper(deck, h=H) as ring:
        with pytest.raises(InputError, match="CONTACT DAMPING is not evaluated from outside"):
            ring.residual(ring.u, H)
        ring.run(until=1.0)
        assert ring.ledger["contact_damping_loss"] > 0
        assert ring.energies()["contact_damping_loss"] == ring.ledger["contact_damping_loss"]


# --- constraints -------------------------------------------------------------------------------

def test_discrete_gradients_of_the_gaps(contact: Contact) -> None:
    ring = contact.stepper
    report = ring.constraint(u0=contact.u0, u1=contact.u1)
    n = len(report.id)
    assert n >= 2 and (np.diff(report.id) > 0).all() and (report.pair == 0).all()
    assert np.array_equal(ring.labels[report.node], ring.contact()[2][report.id])
    du = (contact.u1 - contact.u0).ravel()
    g = report.discrete_gradient
    assert g.shape == report.jacobian.shape == (n, 2*ring.n_node)
    terms = Csr(g.shape, g.indptr, g.indices, np.abs(g.data)) @ np.abs(du)
    assert (np.abs(g @ du - report.dgap) <= 64*EPS*terms).all()
    assert (np.abs(report.gap1 - report.gap0 - report.dgap) <= 64*EPS*np.abs(report.gap0)).all()
    with_positions = ring.constraint(ring.positions + contact.u0, ring.positions + contact.u1)
    assert np.array_equal(with_positions.id, report.id)
    assert np.abs(with_positions.gap1 - report.gap1).max() <= 64*EPS*np.abs(ring.positions).max()


def test_jacobian_and_curvature_against_differences(contact: Contact) -> None:
    ring = contact.stepper
    along = 0.1*(np.random.default_rng(6).random((ring.n_node, 2)) - 0.5)

    def report(step: float):
        return ring.constraint(u0=contact.u0, u1=contact.u1 + step*along)

    high, low = report(PROBE), report(-PROBE)
    here = report(0.0)
    assert np.array_equal(high.id, here.id) and np.array_equal(low.id, here.id)
    slope = (high.gap1 - low.gap1)/(2*PROBE)
    assert np.abs(slope - here.jacobian @ along.ravel()).max() <= DIFFERENCE
    factor = np.linspace(1.0, 2.0, len(here.id))
    change = factor @ high.discrete_gradient - factor @ low.discrete_gradient
    product = here.curvature_times(factor, along)
    assert np.abs(product).max() > 1e-3
    assert np.abs(change/(2*PROBE) - product.ravel()).max() <= DIFFERENCE


def test_no_constraints_are_a_report_too() -> None:
    with Stepper(RING) as ring:
        up = np.where(ring.positions[:, 1:] > 0.0, [[0.0, 50.0]], 0.0)
        report = ring.constraint(u0=up, u1=up)
        assert len(report.id) == 0 and report.discrete_gradient.shape == (0, 2*ring.n_node)
        assert report.jacobian.toarray().shape == (0, 2*ring.n_node)
        assert not report.curvature_times([], up).any()
        p, d = ring.null_space(ring.u, H)
        assert np.array_equal(p.toarray(), ring.links.toarray())
        assert np.array_equal(d.toarray(), p.toarray())


# --- what is over ------------------------------------------------------------------------------

def test_stale_evaluations_say_so(contact: Contact) -> None:
    ring = contact.stepper

    def stale(*changes) -> None:
        for change in changes:
            evaluation = ring.evaluate(contact.u1, H)
            expected = evaluation.residual()
            ring.guess(H), ring.mass, ring.links, ring.body_momenta(), ring.u   # noqa: B018
            assert np.array_equal(evaluation.residual(), expected)
            change()
            for ask in (evaluation.residual, evaluation.unknown_residual, evaluation.tangent,
                        evaluation.null_space, evaluation.multipliers):
                with pytest.raises(InputError, match="stale"):
                    ask()

    stale(lambda: ring.evaluate(contact.u0, H), lambda: ring.residual(contact.u1, H),
          lambda: ring.constraint(u0=contact.u0, u1=contact.u1), ring.step,
          lambda: ring.restore(contact.before), lambda: ring.set_state(v=ring.v),
          lambda: ring.prescribe(1, 1, float(ring.u[0, 0])), lambda: ring.release(1, 1))
    ring.restore(contact.before)
    first = ring.constraint(u0=contact.u0, u1=contact.u1)
    ring.constraint(u0=contact.u0, u1=contact.u0)
    with pytest.raises(InputError, match="stale"):
        first.curvature_times(first.gap0, contact.u0)
    with Stepper(RING, h=H) as other:
        evaluation = other.evaluate(other.u, H)
        report = other.constraint(u0=other.u, u1=other.u)
    with pytest.raises(InputError, match="closed"):
        evaluation.residual()
    with pytest.raises(InputError, match="closed"):
        report.curvature_times(report.gap0, contact.u0)


def test_evaluation_without_tangent(contact: Contact) -> None:
    plain = contact.stepper.evaluate(contact.u1, H, with_tangent=False)
    with pytest.raises(InputError, match="without tangent"):
        plain.tangent()
    inverted = 3.0*np.random.default_rng(7).random(contact.u1.shape)
    with pytest.raises(AnalysisError, match="inverted"):
        contact.stepper.evaluate(inverted, H)
    with pytest.raises(InputError, match="no step was evaluated"):
        plain._n_changes = contact.stepper._handle.n_changes
        plain.residual()


def test_evaluation_that_is_not_finite_says_so(contact: Contact) -> None:
    for h in (1e-170, 5e-324):              # 1/h^2 overflows
        with pytest.raises(AnalysisError, match="not finite"):
            contact.stepper.evaluate(contact.u1, h)
    assert np.isfinite(contact.stepper.residual(contact.u1, H)).all()


# --- sums and matrices -------------------------------------------------------------------------

def test_mass_and_momenta() -> None:
    with Stepper(RING) as ring:
        mass, v = ring.mass, ring.v
        p = mass @ v
        bodies = ring.body_momenta()
        assert bodies.shape == (ring.n_body, 3)
        total = ring.momenta()
        scale = 1e2*EPS*np.abs(p).sum()
        assert np.abs(bodies.sum(axis=0)[:2] - p.sum(axis=0)).max() <= scale
        assert abs(bodies.sum(axis=0)[0] - total["px"]) <= scale
        q = ring.q
        lz = q[:, 0] @ p[:, 1] - q[:, 1] @ p[:, 0]
        assert abs(lz - total["lz"]) <= scale*np.abs(q).max()
        assert abs(0.5*(v*p).sum() - ring.energies()["kinetic"]) <= scale*np.abs(v).max()
        assert ring.ledger == ring.energies() | total


def test_ties_are_in_the_links() -> None:
    """Spinning tied pieces: dependent nodes move as the links say."""
    with Stepper(DECKS/"tied_spin.inp") as spin:
        links, unknown, v = spin.links, spin.unknowns.ravel(), spin.v.ravel()
        free = unknown >= 0
        assert not free.all()
        q = np.zeros(spin.n_unknown)
        q[unknown[free]] = v[free]
        assert np.abs(links @ q - v).max() <= 64*EPS*np.abs(v).max()
        assert (spin.evaluate(spin.guess(0.01), 0.01).unknown_residual()).shape == q.shape


def test_pressures_are_those_of_the_results(tmp_path: Path) -> None:
    """Static blocks: pressures and gaps of the last frame, at the slave nodes."""
    deck = DECKS/"contact_patch.inp"
    subprocess.run([EMCON, str(deck), "--output", str(tmp_path), "--quiet"], check=True)
    with h5py.File(tmp_path/"contact_patch.vtkhdf") as file:
        data = file["VTKHDF/PointData"]
        with Stepper(deck) as patch:
            patch.run()
            n = 8                                # slave nodes; those of guards come after them
            rows = np.searchsorted(patch.labels, patch.contact()[2])[:n]
            assert patch.pressures().max() > 0.0
            assert patch.pressures()[n:].max() == 0.0
            pressure, gap = (np.asarray(data[name]).ravel()[-patch.n_node:]
                             for name in ("contact_pressure", "contact_gap"))
            assert len(set(rows)) == len(rows)
            assert np.array_equal(pressure[rows], patch.pressures()[:n])
            assert np.array_equal(gap[rows], patch.gaps()[:n], equal_nan=True)


def test_csr_of_any_shape() -> None:
    full = np.array([[0.0, 2.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 3.0], [0.0, 4.0, 0.0]])
    matrix = Csr((4, 3), np.array([0, 1, 1, 3, 4], dtype=np.int32),
                 np.array([1, 0, 2, 1], dtype=np.int32), np.array([2.0, 1.0, 3.0, 4.0]))
    x = np.array([1.0, 10.0, 100.0])
    many = np.arange(6.0).reshape(3, 2)
    assert matrix.nnz == 4 and np.array_equal(matrix.toarray(), full)
    assert np.array_equal(matrix @ x, full @ x) and np.array_equal(matrix @ many, full @ many)
    y = np.arange(4.0)
    assert np.array_equal(y @ matrix, y @ full)
    assert np.array_equal(many.T @ matrix.T, many.T @ full.T)
    assert np.array_equal(matrix.T.toarray(), full.T)
    with pytest.raises(InputError, match="3 columns"):
        matrix @ y
    scipy = pytest.importorskip("scipy.sparse")
    assert isinstance(matrix.to_scipy(), scipy.csr_array)
    assert np.array_equal(matrix.to_scipy().toarray(), full)


def test_names_of_the_package() -> None:
    assert emcon.Stepper is Stepper and emcon.InputError is InputError
    assert emcon.AnalysisError is AnalysisError and emcon.Model.__name__ == "Model"
