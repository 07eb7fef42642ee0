"""Unknowns of a host that are no displacements of surface nodes: rows, forces and tangents by a map."""

from __future__ import annotations

import re

import numpy as np
import pytest
from test_interface_friction import G, H, MU, feet
from test_interface_space import over_the_floor

from emcon.csr import Csr
from emcon.interface import InputError, Interface

EPS = np.finfo(float).eps


def sparse(matrix: np.ndarray) -> Csr:
    rows, columns = np.nonzero(matrix)
    start = np.searchsorted(rows, np.arange(len(matrix) + 1)).astype(np.int32)
    return Csr(matrix.shape, start, columns.astype(np.int32), matrix[rows, columns])


@pytest.mark.parametrize("as_array", [True, False])
@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("kind", ["node to segment", "mortar"])
def test_rows_and_tangents_are_those_of_the_nodes_by_the_map(kind: str, friction: float, as_array: bool) -> None:
    face, _ = over_the_floor(kind=kind, friction=friction)
    random = np.random.default_rng(5)
    u0, du = 0.02*random.standard_normal((2, face.n_node, 3))
    a = random.standard_normal((3*face.n_node, 7))
    a[random.random(a.shape) < 0.6] = 0.0
    active = face.begin_step(u0, du, np.ones(face.n_contact, bool))
    n = face.select(u0, du, active)
    lam = random.uniform(0.5, 1.0, n)
    plain, second = face.evaluate(u0, du), face.curvature(lam).toarray()
    face.set_map(a if as_array else sparse(a))
    rows = face.evaluate(u0, du)
    np.testing.assert_array_equal(rows.defect, plain.defect)
    for found, of_nodes in ((rows.g, plain.g), (rows.c, plain.c)):
        assert found.shape == (n, 7)
        size = np.abs(of_nodes.toarray()) @ np.abs(a)
        assert (np.abs(found.toarray() - of_nodes.toarray() @ a) <= 1e2*EPS*size).all()
    size = np.abs(a).T @ np.abs(second) @ np.abs(a)
    assert (np.abs(face.curvature(lam).toarray() - a.T @ second @ a) <= 1e3*EPS*size).all()
    with pytest.raises(InputError, match="not of the unknowns of a map"):
        face.null_space()


@pytest.mark.parametrize("n_dim", [2, 3])
def test_a_rigid_sole_slides_as_one_body(n_dim: int) -> None:
    """Three or two masses that move as one: as many unknowns as directions, and friction of all of them."""
    host = feet(n_dim, "mortar")
    face, m = host.face, n_dim*(len(host.x) - host.first)
    a = np.zeros((host.x.size, n_dim))
    a[n_dim*host.first:] = np.tile(np.eye(n_dim), (m//n_dim, 1))
    face.set_map(a)
    w, v = np.zeros(n_dim), np.eye(n_dim)[0]
    mass, active = m//n_dim, np.zeros(face.n_contact, bool)
    for k in range(1, 9):
        dw = H*v
        u = (a @ w).reshape(host.x.shape)
        active = face.begin_step(u, (a @ dw).reshape(u.shape), active, stop=(a @ (0.5*H*v)).reshape(u.shape))
        outcome = None
        while outcome is None:
            lam = np.zeros(face.select(u, (a @ dw).reshape(u.shape), active))
            for _ in range(8):
                rows = face.evaluate(u, (a @ dw).reshape(u.shape))
                g, c = rows.g.toarray(), rows.c.toarray()
                residual = mass*(2/H*(dw/H - v) + G*np.eye(n_dim)[-1]) - lam @ g
                stiff = mass*2/H**2*np.eye(n_dim) - face.curvature(lam).toarray()
                # Contacts follow from each other here: the least multipliers do.
                matrix = np.block([[stiff, -g.T], [c, np.zeros((len(lam), len(lam)))]])
                found = np.linalg.lstsq(matrix, -np.concatenate([residual, rows.defect]), rcond=1e-9)[0]
                dw, lam = dw + found[:n_dim], lam + found[n_dim:]
            active, outcome = face.update_active(u, (a @ dw).reshape(u.shape), lam, active)
        w, v = w + dw, 2/H*dw - v
        np.testing.assert_allclose(v, (1 - k*MU*G*H)*np.eye(n_dim)[0], rtol=0, atol=1e-12)


@pytest.mark.parametrize(("shape", "said"), [((5, 2), "(5, 2), not (12, 2)"), ((12,), "(12,), not (12, any)"),
                                             ((12, 0), "(12, 0), not (12, any)")])
def test_bad_maps(shape: tuple[int, ...], said: str) -> None:
    face = Interface(np.eye(4, 3))
    face.prepare()
    with pytest.raises(InputError, match=re.escape(said)):
        face.set_map(np.zeros(shape))
