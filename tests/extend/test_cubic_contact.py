"""A law of contact from outside, a file against the installed library."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent/"embed"))

from embed_tools import WARNINGS, need, run  # noqa: E402

SOURCES = ["cubic_contact.f90", "cushion.f90"]
EPS = np.finfo(float).eps
STIFFNESS = 3000.0
# A square above another one that is fixed, `gap` apart.
BLOCKS = """*NODE, NSET=ALL
1, 0., {gap}
2, 1., {gap}
3, 1., {top}
4, 0., {top}
5, -0.5, -1.
6, 1.5, -1.
7, 1.5, 0.
8, -0.5, 0.
*NSET, NSET=HEAD
3, 4
*NSET, NSET=UPPER
1, 2, 3, 4
*ELEMENT, TYPE=CPE4, ELSET=BOB
1, 1, 2, 3, 4
*ELEMENT, TYPE=CPE4, ELSET=WALL
2, 5, 6, 7, 8
*ELSET, ELSET=BOTH
1, 2
*MATERIAL, NAME=STUFF
*HYPERELASTIC, COUPLED NEO HOOKE
1000., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=BOTH, MATERIAL=STUFF
*SURFACE, NAME=BOB
BOB,
*SURFACE, NAME=WALL
WALL,
*SURFACE INTERACTION, NAME=SOFT
*CONTACT PAIR, INTERACTION=SOFT, TYPE={formulation}
BOB, WALL
*BOUNDARY
5, 1, 2
6, 1, 2
7, 1, 2
8, 1, 2
"""
FALLS = """*INITIAL CONDITIONS, TYPE=VELOCITY
UPPER, 2, -1.
*STEP, NLGEOM
*DYNAMIC, DIRECT
0.005, 0.4
*CONSTRAINT METHOD, TYPE={method}
*END STEP
"""
PRESSED = """*BOUNDARY
UPPER, 1
*STEP, NLGEOM
*STATIC
1., 1.
*CONSTRAINT METHOD, TYPE={method}
*BOUNDARY
HEAD, 2, 2, -0.02
*END STEP
"""


@pytest.fixture(scope="module")
def program(installed: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    need("gfortran")
    folder = tmp_path_factory.mktemp("cubic")
    env = installed
    flags = run("pkg-config", "--cflags", "--libs", "emcon", env=env).split()
    run("gfortran", *WARNINGS, "-std=f2008", *(HERE/name for name in SOURCES), "-o",
        folder/"cushion", *flags, env=env, cwd=folder)
    return folder/"cushion", env


def cushion(program: tuple[Path, dict[str, str]], tmp_path: Path, step: str, formulation: str,
            gap: float) -> np.ndarray:
    deck = tmp_path/"scene.inp"
    deck.write_text(BLOCKS.format(gap=gap, top=1.0 + gap, formulation=formulation)
                    + step.format(method="PENALTY"))
    numbers, refused = run(program[0], deck, STIFFNESS, env=program[1]).splitlines()
    assert "with 0 given forces and 0 masses and a given law of contact, not with" in refused
    return np.array(numbers.split(), float)


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "MORTAR"])
def test_an_impact_keeps_its_energy(program: tuple[Path, dict[str, str]], tmp_path: Path,
                                    formulation: str) -> None:
    """Contact stores and gives back; what is left is the rounding of some hundred steps."""
    drift, force, depth, most = cushion(program, tmp_path, FALLS, formulation, 0.01)
    assert drift < 1000*EPS
    assert most > 0.01*0.5                       # of the kinetic energy at the start
    assert force == depth == 0.0                 # it has left


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "MORTAR"])
def test_pressed_it_is_as_deep_as_the_law_says(program: tuple[Path, dict[str, str]],
                                               tmp_path: Path, formulation: str) -> None:
    """All of the side of length 1 is closed as far: the force is k d^2."""
    _, force, depth, _ = cushion(program, tmp_path, PRESSED, formulation, 0.0)
    assert depth > 1e-3
    assert force == pytest.approx(STIFFNESS*depth**2, rel=1e-9)


def test_a_law_that_no_step_asks_for_is_refused(program: tuple[Path, dict[str, str]],
                                                tmp_path: Path) -> None:
    deck = tmp_path/"scene.inp"
    deck.write_text(BLOCKS.format(gap=0.01, top=1.01, formulation="MORTAR")
                    + FALLS.format(method="NULL SPACE"))
    done = subprocess.run([program[0], deck, "1."], env=program[1], capture_output=True,
                          text=True, check=False)
    assert done.returncode == 1
    assert "TYPE=PENALTY" in done.stdout
