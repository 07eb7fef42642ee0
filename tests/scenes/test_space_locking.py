"""Nearly incompressible solids of three dimensions: what locks, what does not, and what is told."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT/"pywrap")]

from emcon import Stepper  # noqa: E402
from emcon.mesh import block  # noqa: E402
from emcon.model import Model  # noqa: E402

#: Cook's membrane: of nearly incompressible CPE8R its corner comes to this (book, chapter elements).
COOK = 6.920
MU, NU = 80.194, 0.4999
#: Of neo-Hookean material.
CONSTANTS = (MU/2, 3*(1 - 2*NU)/(MU*(1 + NU)))


def cook(kind: str, n: int, law: str, constants: tuple[float, ...], nlgeom: bool) -> Stepper:
    """The membrane n by n, clamped at its left end and sheared at the right, done; plane strain.

    In space one layer of thickness 1, held across.
    """
    in_space = kind.startswith("C3D")
    cells = (n, n, 1) if in_space else (n, n)
    mesh = block(cells=cells, kind=kind)
    s, t = mesh.nodes[:, :2].T
    x = np.column_stack([48*s, 44*s + t*(44 + s*(60 - 44 - 44)), *mesh.nodes.T[2:]])
    model = Model.from_arrays(x, {kind: mesh.elements[kind] - 1})
    model.material("M", **{law: constants}).section("M")
    model.boundary(np.flatnonzero(s == 0))
    if in_space:
        model.boundary(np.arange(len(x)), 3)
    step = model.step("STATIC", 0.25 if nlgeom else 1.0, 1.0, nlgeom=nlgeom)
    end = np.flatnonzero(s == 1)
    share = np.where((t[end] == 0) | (t[end] == 1), 0.5, 1.0)*(0.5 if in_space else 1.0)
    step.load(end, 2, (100.0/n*share)[:, None])
    stepper = model.stepper()
    stepper.run()
    return stepper


def corner(stepper: Stepper) -> float:
    """The deflection of the upper right corner."""
    return float(stepper.u[np.lexsort((stepper.positions[:, 1], stepper.positions[:, 0]))[-1], 1])


@pytest.mark.parametrize("nlgeom", [False, True])
@pytest.mark.parametrize(("solid", "plane"), [("C3D8H", "CPE4H"), ("C3D8I", "CPE4I"), ("C3D8", "CPE4")])
def test_a_layer_held_across_is_plane_strain(solid: str, plane: str, nlgeom: bool) -> None:
    """Node by node and in energy: another program, of other invariants, for the same element."""
    law, constants = ("neo_hooke", CONSTANTS) if nlgeom else ("elastic", (3*MU, NU))
    with cook(solid, 4, law, constants, nlgeom) as layer, \
            cook(plane, 4, law, constants, nlgeom) as sheet:
        place = {tuple(x): k for k, x in enumerate(sheet.positions.tolist())}
        of_sheet = sheet.u[[place[tuple(x[:2])] for x in layer.positions.tolist()]]
        # Rounding is multiplied by the ratio of the moduli, some 1e4.
        assert np.abs(layer.u[:, :2] - of_sheet).max() <= 1e-9*np.abs(of_sheet).max()
        assert np.abs(layer.u[:, 2]).max() == 0.0
        assert layer.ledger["strain"] == pytest.approx(sheet.ledger["strain"], rel=1e-9)
        assert np.abs(of_sheet).max() > 1.0


def test_cook() -> None:
    """C3D8 is told to lock, and what to take; C3D8H is what is told, and comes near."""
    with cook("C3D8", 8, "neo_hooke", CONSTANTS, True) as locked, \
            cook("C3D8H", 8, "neo_hooke", CONSTANTS, True) as free:
        assert corner(locked) < 0.5*COOK
        assert 0.95*COOK < corner(free) < COOK       # CPE4H on this mesh: 6.619
        told = [json.dumps(locked.verdict()), str(locked)]
        assert all("locks" in text and "C3D8H" in text and "CPE" not in text for text in told)
        assert "locks" not in json.dumps(free.verdict()) and "locks" not in str(free)
