"""*TRANSFORM in runs: a model that is turned with its axes moves as the one that is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from element_meshes import Mesh
from numpy.typing import NDArray
from scene_tools import Run, run_deck
from space_mesh import Block

Array = NDArray[np.float64]

RUBBER = "*HYPERELASTIC, COUPLED NEO HOOKE\n100., 0.3\n"
ELASTIC = "*ELASTIC\n100., 0.3\n"
PROCEDURES = {"static": "*STATIC\n0.1, 1.\n", "dynamic": "*DYNAMIC, DIRECT\n0.05, 1.\n",
              "multipliers": "*STATIC\n0.1, 1.\n*CONSTRAINT METHOD, TYPE=SADDLE POINT\n",
              "explicit": "*DYNAMIC, EXPLICIT, DIRECT\n0.005, 0.5\n"}
AMPLITUDE = "*AMPLITUDE, NAME=A\n0., 0., 0.5, 1., 1., 0.4\n"


def rotation(n_dim: int, angle: float) -> Array:
    """A turn about z, in space then about x too."""
    c, s = np.cos(angle), np.sin(angle)
    if n_dim == 2:
        return np.array([[c, -s], [s, c]])
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) @ np.array([[c, -s, 0], [s, c, 0],
                                                                    [0, 0, 1]])


def axes_card(q: Array) -> str:
    """The axes whose columns are those of `q`."""
    points = np.zeros((2, 3))
    points[:, :len(q)] = q[:, :2].T
    return f"*TRANSFORM, NSET=NALL\n{', '.join(repr(float(v)) for v in points.ravel())}\n"


def in_plane(q: Array) -> tuple[Mesh, dict[str, list[int]]]:
    mesh = Mesh("CPE4", 3, 3, [(0, 0), (1, 0), (1, 1), (0, 1)], shake=0.05)
    mesh.x = mesh.x @ q.T
    return mesh, {side: mesh.side(side) for side in ("bottom", "top", "right")}


def in_space(q: Array) -> tuple[Block, dict[str, list[int]]]:
    block = Block("C3D8", (2, 2, 2), shake=0.05, place=lambda x: x @ q.T)
    return block, {"bottom": list(block.on(1, 0)), "top": list(block.on(1, 1)),
                   "right": list(block.on(0, 1))}


def rows(labels: list[int], text: str) -> str:
    return "".join(f"{k}, {text}\n" for k in labels)


def turned(n_dim: int, angle: float, procedure: str, folder: Path) -> Run:
    """A block on rollers, drawn at its top and pushed at its side, turned with its axes."""
    q = rotation(n_dim, angle)
    mesh, side = (in_plane if n_dim == 2 else in_space)(q)
    corner = side["bottom"][0]
    amplitude = "" if "*STATIC" in PROCEDURES[procedure] else ", AMPLITUDE=A"
    pushed = [k for k in side["right"] if k not in side["top"] + side["bottom"]]
    deck = mesh.deck(RUBBER, (axes_card(q) if angle else "") + AMPLITUDE
                     + f"*EQUATION\n2\n{side['top'][0]}, 1, 1., {side['top'][1]}, 1, -1.\n"
                     "*BOUNDARY\n" + rows(side["bottom"], "2") + f"{corner}, 1\n"
                     + ("" if n_dim == 2 else rows(side["bottom"], "3"))
                     + f"*STEP, NLGEOM\n{PROCEDURES[procedure]}"
                     f"*BOUNDARY{amplitude}\n" + rows(side["top"], "2, 2, 0.2")
                     + f"*CLOAD{amplitude}\n" + rows(pushed, "1, 2.") + rows(pushed, "2, -1.")
                     + "*NODE PRINT, NSET=NALL, TOTALS=YES\nU, V, RF\n*END STEP\n"
                     f"*STEP, NLGEOM\n{PROCEDURES[procedure]}"
                     "*BOUNDARY, FIXED\n" + rows(side["top"][1:], "1") + "*END STEP\n")
    folder.mkdir()
    (folder/"deck.inp").write_text(deck)
    return run_deck(folder/"deck.inp", folder)


@pytest.mark.each_value
@pytest.mark.parametrize("procedure", PROCEDURES)
@pytest.mark.parametrize("n_dim", [2, 3])
def test_turned_with_its_axes(n_dim: int, procedure: str, tmp_path: Path) -> None:
    """What is printed along its axes is what the model prints that is not turned."""
    straight = turned(n_dim, 0.0, procedure, tmp_path/"straight")
    for angle in (0.4, np.pi/2):
        run = turned(n_dim, angle, procedure, tmp_path/f"{angle}")
        for variable in ("U", "V", "RF", "TOTAL_U", "TOTAL_RF"):
            _, wanted = straight.series("NALL", variable)
            _, found = run.series("NALL", variable)
            assert np.abs(found - wanted).max() <= 1e-9*np.abs(wanted).max(), variable
        if procedure == "dynamic":
            energy = [run.history[name] for name in ("kinetic", "strain", "external_work")]
            assert np.abs(energy[0] + energy[1] - energy[2]).max() <= 1e-12*energy[1].max()


def test_fields_have_the_axes_of_the_model(tmp_path: Path) -> None:
    """The field file, and GLOBAL=YES; stand-ins are where their nodes are, forces at the nodes."""
    q = rotation(2, 0.4)
    mesh, side = in_plane(q)
    (tmp_path/"deck.inp").write_text(mesh.deck(ELASTIC, axes_card(q) + "*BOUNDARY\n"
        + rows(side["bottom"], "1, 2") + "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\n"
        + rows(side["top"], "2, 2, 0.01") + "*NODE FILE, GLOBAL=YES\nU, RF\n"
        "*NODE PRINT, GLOBAL=YES\nU\n*NODE PRINT, NSET=NALL\nRF\n*END STEP\n"))
    run = run_deck(tmp_path/"deck.inp", tmp_path)
    fields, n = run.fields(), len(mesh.x)
    u, force = fields["displacement"][-1], fields["reaction_force"][-1]
    top = np.array(side["top"]) - 1
    assert len(u) == n + len(side["top"] + side["bottom"])
    assert np.abs((u[top] @ q)[:, 1] - 0.01).max() <= 1e-15
    assert np.array_equal(run.series("ALL_NODES", "U")[1][-1], u[:n])
    assert np.abs(run.series("NALL", "RF")[1][-1] - force[:n] @ q).max() <= 1e-14
    assert np.abs(force.sum(axis=0)).max() <= 1e-13 < np.abs(force[:n]).max()
    assert not force[n:].any()
    assert all(np.any(np.all(u[:n] == row, axis=1)) for row in u[n:])


def radial(r: Array, inner: float, outer: float, drawn: float, nu: float) -> Array:
    """Displacement of a long tube whose inside is widened by `drawn`, free outside."""
    b = drawn/(1/inner + (1 - 2*nu)*inner/outer**2)
    return b*(1/r + (1 - 2*nu)*r/outer**2)


@pytest.mark.parametrize("n_dim", [2, 3])
def test_tube(n_dim: int, tmp_path: Path) -> None:
    """A sector between two planes through an axis that lies anywhere: displacement and force."""
    inner, outer, first, last, drawn, nu = 1.0, 2.0, 0.3, 1.4, 1e-3, 0.3
    q = rotation(n_dim, 0.0 if n_dim == 2 else 0.7)
    origin = np.array([0.3, -0.2, 0.5])[:n_dim]

    def place(x: Array) -> Array:
        r, angle = inner + (outer - inner)*x[:, 0], first + (last - first)*x[:, 1]
        ring = np.column_stack([r*np.cos(angle), r*np.sin(angle), *x.T[2:]])
        return ring @ q.T + origin

    if n_dim == 2:
        mesh = Mesh("CPE8", 4, 4, [(0, 0), (1, 0), (1, 1), (0, 1)])
        side = {name: mesh.side(name) for name in ("left", "bottom", "top")}
        mesh.x = place(mesh.x)
        flat = []
    else:
        mesh = Block("C3D20", (4, 4, 1), place=place)
        side = {"left": list(mesh.on(0, 0)), "bottom": list(mesh.on(1, 0)),
                "top": list(mesh.on(1, 1))}
        flat = [*mesh.on(2, 0), *mesh.on(2, 1)]
    a = np.append(origin, 0.0)[:3]
    b = a + (q[:, 2] if n_dim == 3 else [0, 0, 1])
    points = ", ".join(repr(float(v)) for v in [*a, *b])
    (tmp_path/"deck.inp").write_text(mesh.deck(f"*ELASTIC\n100., {nu}\n",
        f"*NSET, NSET=INNER\n{rows(side['left'], '')}"
        f"*TRANSFORM, NSET=NALL, TYPE=C\n{points}\n*BOUNDARY\n"
        + rows(side["bottom"] + side["top"], "2") + rows(flat, "3")
        + f"*STEP\n*STATIC\n1., 1.\n*BOUNDARY\n{rows(side['left'], f'1, 1, {drawn}')}"
        "*NODE PRINT, NSET=NALL\nU\n*NODE PRINT, NSET=INNER, TOTALS=ONLY\nRF\n*END STEP\n"))
    run = run_deck(tmp_path/"deck.inp", tmp_path)
    _, u = run.series("NALL", "U")
    flat_x = (mesh.x - origin) @ q
    wanted = radial(np.hypot(flat_x[:, 0], flat_x[:, 1]), inner, outer, drawn, nu)
    assert np.abs(u[-1][:, 0] - wanted).max() <= 2e-4*drawn
    assert np.abs(u[-1][:, 1:]).max() <= 2e-4*drawn
    # Pressure inside: 2 G (B/a^2 - A/(1 - 2 nu)).
    factor = drawn/(1/inner + (1 - 2*nu)*inner/outer**2)
    pressure = 100/(1 + nu)*factor*(1/inner**2 - 1/outer**2)
    _, force = run.series("INNER", "TOTAL_RF")
    assert force[-1].ravel()[0] == pytest.approx(pressure*inner*(last - first), rel=2e-3)
