"""*EQUATION, REMOVE: what was coupled goes on as it is, without the equation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from element_meshes import Mesh
from numpy.typing import NDArray
from scene_tools import emcon, run_deck

Array = NDArray[np.float64]

LAW = "*HYPERELASTIC, COUPLED NEO HOOKE\n100., 0.3\n"


def strips(n: int = 4) -> tuple[Mesh, Mesh, str]:
    """Two strips, one above the other, in one deck."""
    low = Mesh("CPE4", n, 1, [(0, 0), (4, 0), (4, 1), (0, 1)])
    high = Mesh("CPE4", n, 1, [(0, 2), (4, 2), (4, 3), (0, 3)])
    count = len(low.x)
    nodes = "".join(f"{k}, {x!r}, {y!r}\n" for k, (x, y) in enumerate(
        np.vstack([low.x, high.x]).tolist(), 1))
    elements = "".join(f"{k}, {', '.join(map(str, e))}\n" for k, e in enumerate(
        [*low.elements(), *([i + count for i in e] for e in high.elements())], 1))
    return low, high, (f"*NODE, NSET=NALL\n{nodes}*ELEMENT, TYPE=CPE4, ELSET=ALL\n{elements}"
                       f"*MATERIAL, NAME=M\n{LAW}*DENSITY\n0.5\n"
                       "*SOLID SECTION, ELSET=ALL, MATERIAL=M\n")


def coupled(which: str) -> str:
    """The ends of both strips move alike; then those that `which` names no longer."""
    low, _, text = strips()
    n = len(low.x)
    ends = low.side("right")
    pairs = "".join(f"2\n{k}, {a}, 1., {k + n}, {a}, -1.\n" for k in ends for a in (1, 2))
    return (text + f"*EQUATION\n{pairs}*BOUNDARY\n"
            + "".join(f"{k}, 1, 2\n{k + n}, 1, 2\n" for k in low.side("left"))
            + "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n0.1, 2.\n*CLOAD\n"
            + "".join(f"{k}, 1, 2.\n{k}, 2, 0.4\n" for k in ends)
            + f"*NODE PRINT, NSET=NALL\nU, V\n*END STEP\n*STEP, NLGEOM\n*DYNAMIC, DIRECT\n0.1, 2.\n"
            f"{which}*END STEP\n")


def test_one_pushed_one_not(tmp_path: Path) -> None:
    """What is coupled moves alike, then each on its own; energy is kept throughout."""
    (tmp_path/"deck.inp").write_text(coupled("*EQUATION, REMOVE ALL\n"))
    run = run_deck(tmp_path/"deck.inp", tmp_path)
    low, _, _ = strips()
    end, n = np.array(low.side("right")) - 1, len(low.x)
    time, u = run.series("NALL", "U")
    _, v = run.series("NALL", "V")
    apart = np.abs(u[:, end] - u[:, end + n]).max(axis=(1, 2))
    assert apart[time <= 2.05].max() <= 1e-14 < 0.1 < apart[-1]
    # The upper strip is free of forces then: its own energy is that at the moment.
    history = run.history
    total = history["kinetic"] + history["strain"] - history["external_work"]
    assert np.abs(total).max() <= 1e-12*history["external_work"].max()
    last = int(np.argmax(time > 2.05))
    assert np.abs(v[last, end + n] - v[last - 1, end + n]).max() < np.abs(v).max()


def test_named_ones(tmp_path: Path) -> None:
    """REMOVE takes the equations with these first terms, and no others."""
    low, _, _ = strips()
    end, n = np.array(low.side("right")), len(low.x)
    which = "*EQUATION, REMOVE\n" + "".join(f"{k}, 1\n" for k in end)
    (tmp_path/"deck.inp").write_text(coupled(which))
    _, u = run_deck(tmp_path/"deck.inp", tmp_path).series("NALL", "U")
    apart = np.abs(u[:, end - 1] - u[:, end + n - 1]).max(axis=(0, 1))
    assert apart[1] <= 1e-14 < 1e-3 < apart[0]


@pytest.mark.parametrize("which, code", [("*EQUATION, REMOVE ALL\n", 3),
                                         ("*EQUATION, REMOVE\n2, 2\n", 0)])
def test_statics(which: str, code: int, tmp_path: Path) -> None:
    """A handle without element leaves the model with its equation; what nothing holds is told."""
    mesh = Mesh("CPE4", 1, 1, [(0, 0), (1, 0), (1, 1), (0, 1)])
    (tmp_path/"deck.inp").write_text(mesh.deck(LAW, "*NODE\n99, 9., 9.\n*EQUATION\n"
        "2\n1, 1, 1., 99, 1, -1.\n2\n1, 2, 1., 99, 2, -1.\n2\n2, 2, 1., 99, 2, -1.\n"
        "2\n3, 2, 1., 4, 2, -1.\n*BOUNDARY\n99, 1, 2\n*STEP\n*STATIC\n1., 1.\n*CLOAD\n4, 1, 0.1\n"
        "3, 1, -0.1\n*NODE FILE\nU\n*END STEP\n*STEP\n*STATIC\n1., 1.\n" + which + "*END STEP\n"))
    done = emcon(tmp_path/"deck.inp", "--quiet", "--output", tmp_path)
    assert done.returncode == code, done.stderr
    assert code == 0 or "the static problem is singular" in done.stderr
