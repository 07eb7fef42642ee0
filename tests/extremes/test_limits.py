"""Rows of docs/stability.md in a short form: each run holds, or the program says why not."""

import sys

import h5py
import numpy as np
import pytest
from emcon import Stepper
from scene_tools import EPSILON, ROOT, run_deck

sys.path[:0] = [str(ROOT / "tests" / "bench"), str(ROOT / "tests" / "scenes")]
from extremes import ROWS, text_of  # noqa: E402
from limits.common import HOLDS, SILENT, run_case  # noqa: E402
from limits.conditions import condition, conditions, matrices  # noqa: E402
from limits.impacts import NODES, stiffer  # noqa: E402
from limits.seen import energies, energy_seen, overlap_seen, sections  # noqa: E402

#: Rows whose runs take seconds.
LONG = {"sizes", "scale", "stack", "space_origin", "space_aspect", "space_rotation", "space_slant", "space_crossing",
        "space_gap", "space_corner", "space_modulus"}
CASES = [pytest.param(row, k, id=f"{row.name}-{text_of(row.values[k]).replace(' ', '-')}",
                      marks=[pytest.mark.long]*(row.name in LONG)) for row in ROWS for k in row.tested()]


@pytest.mark.parametrize(("row", "k"), CASES)
def test_holds_or_says_why_not(row, k, tmp_path):
    outcome = run_case(row, row.values[k], tmp_path)
    assert outcome.kind != SILENT, outcome
    assert k >= row.reach or outcome.kind == HOLDS, outcome
    assert outcome.kind == HOLDS or outcome.text, outcome


def test_the_grid_holds_where_inertia_counts(tmp_path):
    """A value of each offset at the smallest ratio that holds."""
    (row,) = (row for row in ROWS if row.name == "grid")
    for value in row.values:
        if value[0] == 1e-8:
            assert run_case(row, value, tmp_path).kind == HOLDS, value


# ---- what is seen from outside


def test_energies_of_an_affine_motion():
    """Against the closed forms, for small strains and for large ones."""
    x = np.array([[0.0, 0], [2, 0], [2, 1], [0, 1]])
    cell = np.array([[0, 1, 2, 3]])
    shear, lame = 100/2.6, 100*0.3/(1.3*0.4)
    for size in (1e-8, 1e-4, 0.3):
        grad = size*np.array([[1.0, 0.5], [-0.2, 0.7]])
        kinetic, strain = energies(x, x @ grad.T, np.full_like(x, 3.0), [(cell, 100.0, 0.5)])
        assert kinetic == pytest.approx(0.5*0.5*2*18, rel=8*EPSILON)
        if size < 1e-2:
            small = 0.5*(grad + grad.T)
            exact = 2*(shear*(small**2).sum() + 0.5*lame*np.trace(small)**2)
            assert strain == pytest.approx(exact, rel=10*size)
        else:
            f = np.eye(2) + grad
            log = np.log(np.linalg.det(f))
            exact = 2*(0.5*shear*((f**2).sum() - 2) - shear*log + 0.5*lame*log**2)
            assert strain == pytest.approx(exact, rel=64*EPSILON)


def test_what_is_seen_is_not_what_is_told(tmp_path):
    """Frames of which one is spoilt change energy and overlap, whatever the ledger says."""
    (row,) = (row for row in ROWS if row.name == "gap")
    run = run_deck(row.deck(1e-2), tmp_path, **row.parameters)
    assert energy_seen(run) < 1e-12 and overlap_seen(run) < 1e-12
    assert len(sections(run.file(".inp").read_text())) == 2
    with h5py.File(run.file(".vtkhdf"), "r+") as file:
        data = file["VTKHDF"]["PointData"]["displacement"]
        data[-28:-12, 1] = data[-28:-12, 1] - 0.1
    assert energy_seen(run) > 1e-2 and overlap_seen(run) > 1e-2


# ---- condition numbers


def test_the_estimate_is_near_the_condition_number():
    """Of the inverse a lower bound, seldom below a third."""
    random = np.random.default_rng(3)
    for n in (1, 5, 40):
        for spread in (0, 4, 8):
            a = random.standard_normal((n, n))*10.0**random.uniform(-spread, 0, n)
            exact = np.linalg.cond(a, 1)
            assert exact/3 <= condition(a)*(1 + 1e-6) <= exact*(1 + 1e-3)
    assert condition(np.array([[1.0, 2.0], [2.0, 4.0]])) == np.inf


@pytest.mark.parametrize("ratio", [1, 1e6])
def test_both_matrices_give_the_same_step(tmp_path, ratio):
    """The saddle point solved by numpy, and du of (7), for a random residual, no gaps left."""
    with Stepper(stiffer(ratio).write(tmp_path/"disc.inp"), **NODES) as stepper:
        while not stepper.active.any():
            made = stepper.step()
        tangent, force, gap, p, df = (part.toarray() for part in matrices(stepper, made.h))
    assert 0 < len(force) < len(tangent)
    np.testing.assert_allclose(p.T @ force.T, 0, atol=16*EPSILON)
    np.testing.assert_allclose(gap @ df, 0, atol=16*EPSILON)
    n, unit = len(tangent), abs(np.diag(tangent)).max()
    residual = np.random.default_rng(5).standard_normal(n)
    saddle = np.block([[tangent, -unit*force.T], [unit*gap, np.zeros((len(gap), len(gap)))]])
    step = np.linalg.solve(saddle, np.concatenate([-residual, np.zeros(len(gap))]))[:n]
    other = df @ np.linalg.solve(p.T @ tangent @ df, -p.T @ residual)
    bound = 16*EPSILON*np.linalg.cond(saddle)
    np.testing.assert_allclose(other, step, rtol=0, atol=bound*np.abs(step).max())


def test_the_null_space_has_the_smaller_condition(tmp_path):
    """Both grow with the ratio of stiffness; the saddle point as printed by far the most."""
    ill = [conditions(stiffer(ratio).write(tmp_path/"disc.inp"), NODES) for ratio in (1, 1e6)]
    for saddle, scaled, reduced in ill:
        assert 1 <= reduced < 1.1*scaled < scaled*100 < saddle
    assert ill[1][2] > 1e3*ill[0][2]
