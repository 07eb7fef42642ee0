"""Extensions from outside: a law, a potential and a solver, a file each, against the installed library."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent/"embed"))

from embed_tools import ROOT, WARNINGS, need, run  # noqa: E402

SOURCES = ["gent_law.f90", "fading_well.f90", "dense_solver.f90", "extended.f90"]
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
# A block that is thrown at another one, from which it bounces.
BLOCKS = """*NODE, NSET=ALL
1, 0., 0.
2, 1., 0.
3, 0., 1.
4, 1., 1.
5, 0.2, 1.05
6, 0.9, 1.05
7, 0.2, 2.
8, 0.9, 2.
*ELEMENT, TYPE=CPE4, ELSET=BELOW
1, 1, 2, 4, 3
*ELEMENT, TYPE=CPE4, ELSET=ABOVE
2, 5, 6, 8, 7
*ELSET, ELSET=BOTH
1, 2
*MATERIAL, NAME=STUFF
*HYPERELASTIC, COUPLED NEO HOOKE
100., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=BOTH, MATERIAL=STUFF
*SURFACE, NAME=TOP
BELOW,
*SURFACE, NAME=BOTTOM
ABOVE,
*SURFACE INTERACTION, NAME=HARD
*CONTACT PAIR, INTERACTION=HARD, TYPE=<formulation>
BOTTOM, TOP
*INITIAL CONDITIONS, TYPE=VELOCITY
5, 2, -1.
6, 2, -1.
7, 2, -1.
8, 2, -1.
*STEP, NLGEOM
*DYNAMIC, DIRECT, SOLVER=<solver>
0.02, 0.5
*NEWTON, TYPE=FULL
*CONSTRAINT METHOD, TYPE=<method>
*CONTACT INITIATION, TYPE=VELOCITY UPDATE
*END STEP
"""


@pytest.fixture(scope="module")
def program(installed: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    need("gfortran")
    folder = tmp_path_factory.mktemp("extend")
    env = installed
    flags = run("pkg-config", "--cflags", "--libs", "emcon", env=env).split()
    run("gfortran", *WARNINGS, "-std=f2008", *(HERE/name for name in SOURCES), "-o",
        folder/"extended", *flags, "-llapack", env=env, cwd=folder)
    return folder/"extended", env


def figures(program: tuple[Path, dict[str, str]], deck: Path, *more: str) -> list[float]:
    first = run(program[0], deck, *more, env=program[1]).splitlines()[0]
    return [float(word) for word in first.split()]


def refusal(program: tuple[Path, dict[str, str]], deck: Path, *more: str) -> str:
    done = subprocess.run([program[0], deck, *more], env=program[1], capture_output=True, text=True)
    assert done.returncode == 1
    return done.stdout


@pytest.mark.parametrize("more", [("law",), ("law", "well")], ids=["law", "law and potential"])
def test_energy_stays(program: tuple[Path, dict[str, str]], tmp_path: Path,
                      more: tuple[str, ...]) -> None:
    deck = tmp_path/"square.inp"
    deck.write_text(DECK)
    total, drift, strain, *_ = figures(program, deck, *more)
    assert drift <= 1e-12*abs(total)
    assert strain > 0.05*abs(total)                # it is stretched


def test_constants_of_the_card_reach_the_law(program: tuple[Path, dict[str, str]],
                                             tmp_path: Path) -> None:
    """What the limit of stretch changes vanishes with 1/Jm, in first order."""
    strain = []
    for limit in ("1e3", "2e3", "1e9"):
        deck = tmp_path/f"limit{limit}.inp"
        deck.write_text(DECK.replace("10., 20., 2.", f"10., 20., {limit}"))
        strain.append(figures(program, deck, "law")[2])
    assert abs((strain[0] - strain[2])/(strain[1] - strain[2]) - 2) < 0.1


@pytest.mark.parametrize("constants, words", [("10., 20., 0.", "Jm = 0 must be positive"),
                                              ("10., 20.", "three constants")])
def test_law_refuses_its_constants(program: tuple[Path, dict[str, str]], tmp_path: Path,
                                   constants: str, words: str) -> None:
    deck = tmp_path/"square.inp"
    n = len(constants.split())
    deck.write_text(DECK.replace("10., 20., 2.", constants).replace("=3\n", f"={n}\n"))
    said = refusal(program, deck, "law")
    assert f"{deck}:16: error: material RUBBER: " in said and words in said


def blocks(path: Path, **option: str) -> Path:
    text = BLOCKS
    for name, word in option.items():
        text = text.replace(f"<{name}>", word)
    path.write_text(text)
    return path


@pytest.mark.parametrize("method", ["NULL SPACE", "SADDLE POINT"])
def test_solver(program: tuple[Path, dict[str, str]], tmp_path: Path, method: str) -> None:
    """LAPACK's dense factors give what the default gives, but for round-off; by tangents that are new
    in each correction, as a solver that is given has no others."""
    deck = {name: blocks(tmp_path/f"{name}.inp", solver=name, method=method, formulation="MORTAR")
            for name in ("DENSE", "DEFAULT")}
    of_dense, of_default = (figures(program, path, "solver") for path in deck.values())
    assert of_dense[1] <= 1e-12*of_dense[0]                  # the energy stays
    assert of_dense[3] >= 2                                  # in contact
    assert of_dense != of_default                            # it was another solver
    assert abs(of_dense[4] - of_default[4]) <= 1e-9*of_default[4]
    assert ", solver DENSE\n" in run(program[0], deck["DENSE"], "solver", env=program[1])


def test_solver_that_is_not_given(program: tuple[Path, dict[str, str]], tmp_path: Path) -> None:
    deck = blocks(tmp_path/"sparse.inp", solver="SPARSE ONE", method="NULL SPACE",
                  formulation="SEGMENT")
    line = deck.read_text().splitlines().index("*DYNAMIC, DIRECT, SOLVER=SPARSE ONE") + 1
    said = refusal(program, deck, "solver")
    assert f"{deck}:{line}: error: SOLVER=SPARSEONE: no program has given this solver" in said
    assert said in run_emcon(deck)


def run_emcon(deck: Path) -> str:
    done = subprocess.run([os.environ.get("EMCON", ROOT/"build"/"release"/"emcon"), deck,
                           "--output", deck.parent], capture_output=True, text=True)
    assert done.returncode == 2
    return done.stderr


def test_solver_that_bears_the_name_of_another(program: tuple[Path, dict[str, str]],
                                               tmp_path: Path) -> None:
    deck = blocks(tmp_path/"own.inp", solver="DENSE", method="NULL SPACE", formulation="SEGMENT")
    assert "cannot be given as MUMPS: EMCON has its own" in refusal(program, deck, "mumps")
    assert "the solver DENSE is given already" in refusal(program, deck, "solver", "solver")
