"""Laws that Python gives in three dimensions: beside those that are built in, and balances."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from emcon import InputError, Outside, Stepper
from emcon.mesh import block
from emcon.model import Model

YOUNG, NU = 100.0, 0.3
LAME, MU = YOUNG*NU/((1 + NU)*(1 - 2*NU)), YOUNG/(2 + 2*NU)
STIFFNESS = np.diag([2*MU]*3 + [MU]*3)
STIFFNESS[:3, :3] += LAME
#: Of no symmetry, positive definite.
CRYSTAL = STIFFNESS + 5*np.cos(np.add.outer(np.arange(6), np.arange(6))) + 20*np.eye(6)
UNIT = np.array([1.0, 1, 1, 0, 0, 0])
Law = Callable[[np.ndarray], Any]


def quadratic(strain: np.ndarray, stiffness: np.ndarray = STIFFNESS) -> Any:
    stress = strain @ stiffness
    return (0.5*(stress*strain).sum(axis=1), stress,
            np.broadcast_to(stiffness, (len(strain), 6, 6)))


def crystal(strain: np.ndarray) -> Any:
    return quadratic(strain, CRYSTAL)


def neo_hooke(strain: np.ndarray) -> Any:
    """mu/2 (tr C - 3) - mu ln J + lambda/2 ln^2 J, by C and its inverse."""
    c = np.zeros((len(strain), 3, 3))
    for k, (a, b) in enumerate([(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)]):
        c[:, a, b] = c[:, b, a] = strain[:, k]*(2 if a == b else 1) + (a == b)
    det = np.linalg.det(c)
    if not (det > 0).all():
        raise Outside
    ln = 0.5*np.log(det)
    inv = np.linalg.inv(c)
    pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)]
    flat = np.stack([inv[:, a, b] for a, b in pairs], axis=1)           # d ln J by strains
    change = np.zeros((len(strain), 6, 6))
    for i, (a, b) in enumerate(pairs):
        for j, (k, m) in enumerate(pairs):
            change[:, i, j] = -(inv[:, a, k]*inv[:, m, b] + inv[:, a, m]*inv[:, k, b])
    return (MU*strain[:, :3].sum(axis=1) - MU*ln + 0.5*LAME*ln**2,
            MU*UNIT + (LAME*ln - MU)[:, None]*flat,
            (LAME*ln - MU)[:, None, None]*change + LAME*flat[:, :, None]*flat[:, None, :])


def flying(kind: str, law: Law | None = None, h: float = 0.02, **material: Any) -> Model:
    """A block that flies, turns and shakes."""
    model = Model.from_mesh(block(size=(2.0, 1.0, 1.0), cells=(2, 1, 1), kind=kind))
    model.material("RUBBER", density=1.0, law=law, **material).section("RUBBER", "BLOCK")
    model.initial("VELOCITY", "BLOCK_RIGHT", (1, 2, 3), (1.0, 0.8, -0.6))
    model.step("DYNAMIC", h, 0.4, direct=True, nlgeom=True)
    return model


def pulled(kind: str, law: Law | None = None, nlgeom: bool = True, **material: Any) -> Model:
    """A block, held on the left, sheared on the right: statics."""
    model = Model.from_mesh(block(size=(2.0, 1.0, 1.0), cells=(2, 1, 1), kind=kind))
    model.material("RUBBER", law=law, **material).section("RUBBER", "BLOCK")
    model.boundary("BLOCK_LEFT", (1, 2, 3))
    step = model.step("STATIC", 0.5, nlgeom=nlgeom)
    step.load("BLOCK_RIGHT", 2, -0.05).load("BLOCK_RIGHT", 3, 0.03)
    return model


def momenta_of(stepper: Stepper) -> np.ndarray:
    return np.array(list(stepper.momenta().values()))


def run(model: Model) -> tuple[np.ndarray, np.ndarray, float]:
    """Displacements and stress at the end, the largest relative change of energy."""
    with Stepper(model) as stepper:
        before, drift = stepper.energies()["total"], 0.0
        momenta = momenta_of(stepper)
        while not stepper.is_done:
            stepper.step()
            drift = max(drift, abs(stepper.energies()["total"] - before))
        if before:
            assert np.abs(momenta_of(stepper) - momenta).max() <= 1e-12*np.abs(momenta).max()
        return stepper.u, stepper.stress, drift/abs(before) if before else drift


@pytest.mark.each_value
@pytest.mark.parametrize("kind", ["C3D4", "C3D8", "C3D10", "C3D20"])
@pytest.mark.parametrize("law", [quadratic, neo_hooke, crystal])
def test_energy_and_momenta_are_kept(law: Law, kind: str) -> None:
    u, _, drift = run(flying(kind, law))
    assert drift <= 1e-12
    assert np.abs(u).max() > 0.1


@pytest.mark.parametrize("kind", ["C3D4", "C3D8", "C3D10", "C3D20"])
def test_law_that_is_built_in_gives_the_same(kind: str) -> None:
    """At rest both are gradients; of a quadratic energy discrete gradients are the same, too."""
    for own, built_in in ((quadratic, {"elastic": (YOUNG, NU)}),
                          (neo_hooke, {"coupled_neo_hooke": (YOUNG, NU)})):
        for nlgeom in (True, False):
            one, other = (run(pulled(kind, nlgeom=nlgeom, **law)) for law in ({"law": own}, built_in))
            assert np.abs(one[0] - other[0]).max() <= 1e-11*np.abs(other[0]).max()
            assert np.abs(one[1] - other[1]).max() <= 1e-10*np.abs(other[1]).max()
    one, other = (run(flying(kind, **law)) for law in ({"law": quadratic}, {"elastic": (YOUNG, NU)}))
    assert np.abs(one[0] - other[0]).max() <= 1e-11*np.abs(other[0]).max()


def test_discrete_gradients_differ_in_second_order() -> None:
    """Two discrete gradients of one energy: a quarter of the difference for half of the step."""
    off = []
    for h in (0.005, 0.0025):
        one, other = (run(flying("C3D8", h=h, **law))
                      for law in ({"law": neo_hooke}, {"coupled_neo_hooke": (YOUNG, NU)}))
        off.append(np.abs(one[0] - other[0]).max())
    assert 0.2 < off[1]/off[0] < 0.3


@pytest.mark.parametrize("kind", ["C3D8H", "C3D8I"])
def test_elements_that_ask_for_more_are_refused(kind: str) -> None:
    with pytest.raises(InputError, match="the law given for material RUBBER"):
        Stepper(pulled(kind, quadratic))


def test_laws_of_the_plane_are_told() -> None:
    def plane(strain: np.ndarray) -> Any:
        return quadratic(strain[:, :3] @ np.eye(3, 6))

    with pytest.raises(InputError, match=re.escape("(5, 6)") + "|gradient"):
        pulled("C3D8", plane)


def test_what_a_law_has_no_value_for_cuts_the_step() -> None:
    def narrow(strain: np.ndarray) -> Any:
        if np.abs(strain).max() > 0.15:
            raise Outside
        return quadratic(strain)

    model = flying("C3D8", narrow)
    with Stepper(model) as stepper:
        stepper.set_state(v=10*stepper.v)
        with pytest.raises(Exception, match="no finite value|law given"):
            stepper.run()
