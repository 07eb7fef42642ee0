"""Bodies of three dimensions that supports do not hold in a static step: said by name."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT/"pywrap"), str(ROOT/"tests")]

from emcon import AnalysisError, InputError  # noqa: E402
from emcon.mesh import block  # noqa: E402
from emcon.model import Model  # noqa: E402
from element_meshes import Mesh  # noqa: E402
from scene_tools import run_deck  # noqa: E402
from space_mesh import Block  # noqa: E402

TURNS = "rotate about x, rotate about y, rotate about z"


def solve(kind: str, supports: list[tuple[tuple[int, ...], tuple[int, ...]]],
          equations: list[tuple[int, ...]] = []) -> np.ndarray:
    """Reactions of a unit cube, 2 x 2 x 2, pulled at 111 by 0.1 along z; supports and equations are at
    corners 000 to 111."""
    mesh = block(cells=(2, 2, 2), kind=kind)
    model = Model.from_mesh(mesh)
    model.material("M", elastic=(100.0, 0.3)).section("M", "BLOCK")
    corner = {tuple(x): int(label) for x, label in zip(mesh.nodes.tolist(), mesh.node_labels)}
    for place, dofs in supports:
        model.boundary(corner[place], dofs)
    for place in equations:
        model.equation([(corner[place], 1, 1.0), (corner[place], 2, 1.0)])
    step = model.step("STATIC", 1.0, 1.0)
    step.load(corner[1, 1, 1], 3, 0.1)
    with model.stepper() as stepper:
        stepper.run()
        return stepper.reactions


@pytest.mark.parametrize("kind", ["C3D8", "C3D10"])
@pytest.mark.parametrize(("supports", "equations", "text"), [
    ([], [], f"move in x, move in y, move in z, {TURNS}"),
    ([((0, 0, 0), (1, 2, 3))], [], TURNS),
    ([((0, 0, 0), (1, 2, 3)), ((1, 0, 0), (2, 3))], [], "rotate about x"),
    ([((0, 0, 0), (1, 2, 3)), ((1, 1, 0), (1, 2, 3))], [],
     r"rotate about an axis along \(1, 1, 0\)"),
    ([((0, 0, 0), (3,)), ((1, 0, 0), (3,)), ((0, 1, 0), (3,))], [],
     "move in x, move in y, rotate about z"),
    ([((0, 0, 0), (1, 2)), ((0, 0, 1), (1, 2))], [], "move in z, rotate about z"),
    ([((0, 0, 0), (3,)), ((1, 0, 0), (3,)), ((0, 1, 0), (3,))], [(0, 0, 0), (1, 0, 0)],
     r"move along \(1, -1, 0\)"),
])
def test_what_is_free_is_named(kind: str, supports: list, equations: list, text: str) -> None:
    with pytest.raises((AnalysisError, InputError),
                       match=f"the body of element 1 is free to {text}; add"):
        solve(kind, supports, equations)


@pytest.mark.parametrize("kind", ["C3D8", "C3D10"])
def test_a_body_that_just_stands_is_solved(kind: str) -> None:
    reactions = solve(kind, [((0, 0, 0), (1, 2, 3)), ((1, 0, 0), (2, 3)), ((0, 1, 0), (3,))])
    assert reactions.sum(axis=0) == pytest.approx([0, 0, -0.1], abs=1e-9*0.1)


@pytest.mark.parametrize("kind", ["CPE4", "C3D8"])
def test_a_turned_body_is_held_as_it_lies(kind: str, tmp_path: Path) -> None:
    """Turned by 45 degrees by its tip, then held there along x alone: that would not hold it at rest."""
    mesh = (Block("C3D8", (4, 1, 1), (4, 1, 1)) if kind == "C3D8" else
            Mesh(kind, 4, 1, [(0, 0), (4, 0), (4, 1), (0, 1)]))
    is_low = mesh.x[:, 1] == 0
    hinge, tip = (1 + np.flatnonzero(is_low & (mesh.x[:, 0] == x)) for x in (0, 4))
    held = "".join(f"{k}, 1, {mesh.x.shape[1]}\n" for k in hinge)
    up = float(4*np.sqrt(0.5))

    def tips(dof: int, way: float) -> str:
        return held + "".join(f"{k}, {dof}, {dof}, {way!r}\n" for k in tip)

    path = tmp_path/"turned.inp"
    path.write_text(mesh.deck("*ELASTIC\n1000., 0.3\n", f"*STEP, NLGEOM\n*STATIC\n0.125, 1.\n*BOUNDARY\n{tips(2, up)}"
                              f"*END STEP\n*STEP, NLGEOM\n*STATIC\n1., 1.\n*BOUNDARY, OP=NEW\n{tips(1, up - 4)}"
                              "*NODE FILE\nU\n*END STEP\n"))
    u = run_deck(path, tmp_path).fields()["displacement"][-1]
    turn = np.array([[1, -1], [1, 1]])*np.sqrt(0.5)
    assert np.abs(mesh.x[:, :2] + u[:, :2] - mesh.x[:, :2] @ turn.T).max() <= 1e-9*4
