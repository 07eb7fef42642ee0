"""A host in scikit-fem: what its stress does to the energy of a collision."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]/"pywrap"))

pytest.importorskip("skfem")
from scikit_fem_host import Collision, ElasticSolid, collide  # noqa: E402

FORMULATIONS = ["NODE TO SURFACE", "MORTAR"]


def depth(result: Collision) -> float:
    """How far the nodes of one body are in the other, at most [L]."""
    deepest = 0.0
    body = np.zeros(result.q.shape[1], int)
    body[result.q[0, :, 1] > 0.02] = 1
    for q in result.q:
        for k in (0, 1):
            edge = result.edges[body[result.edges[:, 0]] == k]
            first, last = (q[edge[:, a]] - q[body != k][:, None] for a in (0, 1))
            cross = first[..., 0]*last[..., 1] - first[..., 1]*last[..., 0]
            turn = np.arctan2(cross, (first*last).sum(-1)).sum(-1)
            way = last - first
            along = np.clip(-(first*way).sum(-1)/(way**2).sum(-1), 0, 1)
            near = np.hypot(*np.moveaxis(first + along[..., None]*way, -1, 0)).min(-1)
            deepest = max(deepest, near[turn > np.pi].max(initial=0.0))
    return deepest


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_own_discrete_gradient_keeps_the_energy(formulation: str) -> None:
    for h in (0.02, 0.01):
        result = collide(True, formulation, h)
        assert result.drift < 1e-10
        assert result.drift < 1e-13                # of some 60 sums over the bodies
        assert result.momenta < 1e-13
        assert 4 < result.n_touch < result.n_step - 2             # they meet, and part
        assert depth(result) < 0.02                # of cells of 0.2: what ends between two steps
        assert np.isfinite(result.q).all()


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_midpoint_stress_drifts(formulation: str) -> None:
    coarse, fine = (collide(False, formulation, h) for h in (0.02, 0.01))
    assert 1e-4 < fine.drift < coarse.drift < 0.1
    assert fine.momenta < 1e-13                    # which do not depend on the stress


@pytest.mark.parametrize("is_conserving", [True, False])
def test_solid_is_what_it_says(is_conserving: bool) -> None:
    skfem = pytest.importorskip("skfem")
    solid = ElasticSolid(skfem.MeshQuad.init_tensor(np.linspace(0, 2, 4), np.linspace(0, 1, 3)),
                         100.0, 0.3, 1.0, is_conserving)
    random = np.random.default_rng(1)
    u0, du, way = 0.1*random.standard_normal((3, 12, 2))
    force, last, tangent = solid.respond(u0, du, True)
    first = solid.respond(u0, 0*du, False)[1]
    error = abs((force*du).sum() - (last - first))
    assert error < 1e-12*last if is_conserving else error > 1e-6*last
    size = np.finfo(float).eps**(1/3)
    after, before = (solid.respond(u0, du + t*way, False)[0] for t in (size, -size))
    slope = (after - before)/(2*size)
    assert abs(slope - (tangent @ way.ravel()).reshape(-1, 2)).max() < 1e2*size**2*abs(slope).max()
