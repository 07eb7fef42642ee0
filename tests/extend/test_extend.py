"""Extensions from outside: a law and a potential, a file each, against the installed library."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent/"embed"))

from embed_tools import WARNINGS, install, need, run  # noqa: E402

SOURCES = ["gent_law.f90", "fading_well.f90", "extended.f90"]
# A square of two by two elements that spins and is stretched.
DECK = """*NODE, NSET=ALL
1, 0., 0.
2, 1., 0.
3, 2., 0.
4, 0., 1.
5, 1., 1.
6, 2., 1.
7, 0., 2.
8, 1., 2.
9, 2., 2.
*ELEMENT, TYPE=CPE4, ELSET=BLOCK
1, 1, 2, 5, 4
2, 2, 3, 6, 5
3, 4, 5, 8, 7
4, 5, 6, 9, 8
*MATERIAL, NAME=RUBBER
*USER MATERIAL, CONSTANTS=3
10., 20., 2.
*DENSITY
1.
*SOLID SECTION, ELSET=BLOCK, MATERIAL=RUBBER
*INITIAL CONDITIONS, TYPE=VELOCITY
1, 1, -2.
3, 1, 2.
9, 2, 3.
7, 1, -1.
*STEP, NLGEOM
*DYNAMIC, DIRECT
0.05, 5.
*END STEP
"""


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    need("gfortran")
    folder = tmp_path_factory.mktemp("extend")
    env = install(folder/"installed")
    flags = run("pkg-config", "--cflags", "--libs", "emcon", env=env).split()
    run("gfortran", *WARNINGS, "-std=f2008", *(HERE/name for name in SOURCES), "-o",
        folder/"extended", *flags, env=env, cwd=folder)
    return folder/"extended", env


def figures(program: tuple[Path, dict[str, str]], deck: Path, *more: str) -> list[float]:
    return [float(word) for word in run(program[0], deck, *more, env=program[1]).split()]


@pytest.mark.parametrize("more", [(), ("well",)], ids=["law", "law and potential"])
def test_energy_stays(program: tuple[Path, dict[str, str]], tmp_path: Path,
                      more: tuple[str, ...]) -> None:
    deck = tmp_path/"square.inp"
    deck.write_text(DECK)
    total, drift, strain = figures(program, deck, *more)
    assert drift <= 1e-12*abs(total)
    assert strain > 0.05*abs(total)                # it is stretched


def test_constants_of_the_card_reach_the_law(program: tuple[Path, dict[str, str]],
                                             tmp_path: Path) -> None:
    """What the limit of stretch changes vanishes with 1/Jm, in first order."""
    strain = []
    for limit in ("1e3", "2e3", "1e9"):
        deck = tmp_path/f"limit{limit}.inp"
        deck.write_text(DECK.replace("10., 20., 2.", f"10., 20., {limit}"))
        strain.append(figures(program, deck)[2])
    assert abs((strain[0] - strain[2])/(strain[1] - strain[2]) - 2) < 0.1


@pytest.mark.parametrize("constants, words", [("10., 20., 0.", "Jm = 0 must be positive"),
                                              ("10., 20.", "three constants")])
def test_law_refuses_its_constants(program: tuple[Path, dict[str, str]], tmp_path: Path,
                                   constants: str, words: str) -> None:
    deck = tmp_path/"square.inp"
    n = len(constants.split())
    deck.write_text(DECK.replace("10., 20., 2.", constants).replace("=3\n", f"={n}\n"))
    done = subprocess.run([program[0], deck], env=program[1], capture_output=True, text=True)
    assert done.returncode == 1
    assert f"{deck}:16: error: material RUBBER: " in done.stdout and words in done.stdout
