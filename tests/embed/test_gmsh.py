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


@pytest.fixture(scope="module")
def bumper(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    found = subprocess.run([PYTHON, "-c", "import gmsh, meshio, pyvista"], capture_output=True)
    if found.returncode:
        pytest.skip(f"{PYTHON} has no gmsh, meshio and pyvista; GMSH_PYTHON names another")
    folder = tmp_path_factory.mktemp("bumper")
    env = os.environ | {"PYTHONPATH": str(ROOT/"pywrap")}
    done = subprocess.run([PYTHON, ROOT/"input_decks"/"gmsh_bumper.py", folder], env=env,
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder, done.stdout


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
