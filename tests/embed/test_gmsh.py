"""From Gmsh to a picture: the script of docs/gmsh.md, where gmsh, meshio and pyvista are.

They are no part of .venv: GMSH_PYTHON names an interpreter that has them.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PYTHON = os.environ.get("GMSH_PYTHON", sys.executable)


#: Of one scene [s].
LONGEST = 300


def run(scene: str, factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder that a scene leaves, and what it says."""
    found = subprocess.run([PYTHON, "-c", "import gmsh, meshio, pyvista"], capture_output=True)
    if found.returncode:
        pytest.skip(f"{PYTHON} has no gmsh, meshio and pyvista; GMSH_PYTHON names another")
    folder = factory.mktemp(scene)
    env = os.environ | {"PYTHONPATH": str(ROOT/"pywrap")}
    done = subprocess.run([PYTHON, ROOT/"input_decks"/f"gmsh_{scene}.py", folder], env=env,
                          capture_output=True, text=True, timeout=LONGEST)
    assert done.returncode == 0, done.stderr
    return folder, done.stdout


@pytest.fixture(scope="module")
def bumper(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    return run("bumper", tmp_path_factory)


@pytest.fixture(scope="module")
def oring(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    return run("oring", tmp_path_factory)


@pytest.fixture(scope="module")
def press_fit(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    return run("press_fit", tmp_path_factory)


def test_the_bumper_keeps_its_energy(bumper: tuple[Path, str]) -> None:
    _, told = bumper
    assert "verdict: good" in told
    assert abs(float(re.search(r"start: 1(\S+)", told)[1])) < 1e-12
    assert 0.0 < float(re.search(r"with (\S+) m/s", told)[1]) < 2.5


def test_the_picture_shows_something(bumper: tuple[Path, str]) -> None:
    from matplotlib import image

    folder, _ = bumper
    pixels = image.imread(folder/"gmsh_bumper.png")[..., :3]
    assert pixels.shape == (700, 1400, 3)
    halves = pixels[:, :700], pixels[:, 700:]
    assert all(0.1 < (half.min(2) < 0.95).mean() < 0.6 for half in halves)      # bodies on white
    assert (halves[1].max(2) < 0.3).mean() > 3*(halves[0].max(2) < 0.3).mean()  # stress is dark


def test_the_oring_is_in_balance(oring: tuple[Path, str]) -> None:
    """What the lid is drawn down with is what the foot of the groove bears."""
    import emcon
    import emcon.mesh

    folder, told = oring
    assert "verdict: good" in told
    bolts = float(re.search(r"with (\S+) N", told)[1])
    mesh = emcon.mesh.read(folder/"gmsh_oring.msh")
    with emcon.Results(folder/"gmsh_oring") as results:
        forces = results.fields["reaction_force"][-1]
        body = results.fields["body"][-1]
    foot = forces[mesh.rows(mesh.node_sets["GROOVE_FOOT"]), 1].sum()
    assert foot == pytest.approx(bolts, abs=0.05001)         # of the last digit told
    sides = abs(forces[mesh.rows(mesh.node_sets["RING_OUTER"]), 0])
    assert sides.max() < 0.05*bolts                          # meshes are not symmetric
    assert sorted(set(body)) == [1.0, 2.0, 3.0]


def test_the_press_fit_is_softer_than_a_full_wheel(press_fit: tuple[Path, str]) -> None:
    """Lame's pressure is an upper bound: holes take stiffness away."""
    _, told = press_fit
    assert "verdict: good" in told
    low, high, full = (float(text) for text in re.search(
        r"pressure (\d+) to (\d+) MPa; without the holes (\d+) MPa", told).groups())
    assert 0.5*full < low < high < full


@pytest.mark.parametrize("scene", ["oring", "press_fit"])
def test_pictures_show_parts_and_stress(scene: str, request: pytest.FixtureRequest) -> None:
    from matplotlib import image

    folder, _ = request.getfixturevalue(scene)
    pixels = image.imread(folder/f"gmsh_{scene}.png")[..., :3]
    first, last = pixels[:, :700], pixels[:, -700:]
    assert all(0.1 < (part.min(2) < 0.95).mean() < 0.8 for part in (first, last))
    assert (last.max(2) < 0.5).mean() > 3*(first.max(2) < 0.5).mean()       # stress is dark
