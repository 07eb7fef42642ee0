"""A constraint from outside, rods of fixed length, a file against the installed library."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent/"embed"))

from embed_tools import WARNINGS, need, run  # noqa: E402

SOURCES = ["rods.f90", "pendulum.f90"]
EPS = np.finfo(float).eps
#: Of what does not gain any more so many roundings are left at most: `kept_floor` of
#: emcon_convergence.
FLOOR = 16
# Two masses on two rods, the first about a fixed point, under their weight.
PENDULUM = """*NODE, NSET=ALL
1, 0., 0.
2, 1., 0.
3, 2., 0.5
*GIVEN FORCES
*BOUNDARY
1, 1, 2
*STEP, NLGEOM
*DYNAMIC, DIRECT
0.02, 10.
*CONSTRAINT METHOD, TYPE=<method>
*CLOAD
2, 2, -10.
3, 2, -10.
*END STEP
"""
# A block that swings on two rods and knocks against another one.
KNOCK = """*NODE, NSET=ALL
1, 0., 3.
2, 1., 0.
3, 2., 0.
4, 2., 1.
5, 1., 1.
6, -1.5, 0.
7, -0.5, 0.
8, -0.5, 1.
9, -1.5, 1.
*ELEMENT, TYPE=CPE4, ELSET=BOB
1, 2, 3, 4, 5
*ELEMENT, TYPE=CPE4, ELSET=WALL
2, 6, 7, 8, 9
*ELSET, ELSET=BOTH
1, 2
*MATERIAL, NAME=STUFF
*HYPERELASTIC, COUPLED NEO HOOKE
1000., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=BOTH, MATERIAL=STUFF
*GIVEN FORCES
*SURFACE, NAME=BOB
BOB,
*SURFACE, NAME=WALL
WALL,
*SURFACE INTERACTION, NAME=HARD
*CONTACT PAIR, INTERACTION=HARD
BOB, WALL
*BOUNDARY
1, 1, 2
6, 1, 2
9, 1, 2
*STEP, NLGEOM
*DYNAMIC, DIRECT
0.01, 4.
*CONSTRAINT METHOD, TYPE=<method>
*CONTACT INITIATION, TYPE=VELOCITY UPDATE
*DLOAD
BOB, GRAV, 10., 0., -1.
*END STEP
"""
# A block that nothing but three rods holds, in statics.
HUNG = """*NODE, NSET=ALL
1, 0., 3.
2, 0., 0.
3, 1., 0.
4, 1., 1.
5, 0., 1.
6, 1., 3.
*ELEMENT, TYPE=CPE4, ELSET=BLOCK
1, 2, 3, 4, 5
*MATERIAL, NAME=STUFF
*HYPERELASTIC, COUPLED NEO HOOKE
1000., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=BLOCK, MATERIAL=STUFF
*GIVEN FORCES
*BOUNDARY
1, 1, 2
6, 1, 2
*STEP, NLGEOM
*STATIC
1., 1.
*CONSTRAINT METHOD, TYPE=<method>
*DLOAD
BLOCK, GRAV, 10., 0., -1.
*END STEP
"""


@pytest.fixture(scope="module")
def program(installed: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    need("gfortran")
    folder = tmp_path_factory.mktemp("rods")
    env = installed
    flags = run("pkg-config", "--cflags", "--libs", "emcon", env=env).split()
    run("gfortran", *WARNINGS, "-std=f2008", *(HERE/name for name in SOURCES), "-o",
        folder/"pendulum", *flags, env=env, cwd=folder)
    return folder/"pendulum", env


@pytest.mark.parametrize("method", ["NULL SPACE", "SADDLE POINT"])
@pytest.mark.parametrize(("text", "arguments", "touches"), [
    (PENDULUM, "1  1 2  2 3", False),
    (KNOCK, "1  1 5  1 4", True),
], ids=["double pendulum", "block"])
def test_rods_keep_their_length_and_do_no_work(program: tuple[Path, dict[str, str]],
                                               tmp_path: Path, text: str, arguments: str,
                                               touches: bool, method: str) -> None:
    deck = tmp_path/"rods.inp"
    deck.write_text(text.replace("<method>", method))
    strain, drift, work, n_active = map(float, run(program[0], deck, *arguments.split(),
                                                   env=program[1]).split())
    assert strain <= FLOOR*EPS
    n_step = 500 if not touches else 400
    assert drift <= 4*EPS*work*n_step              # some roundings a step
    assert work > 1                                # it falls
    assert (n_active > 0) == touches


@pytest.mark.parametrize("method", ["NULL SPACE", "SADDLE POINT"])
@pytest.mark.parametrize("mass", ["1", "0"])     # 0: nothing but rods knows the places they hang from
def test_rods_hold_a_body_in_statics(program: tuple[Path, dict[str, str]], tmp_path: Path,
                                     mass: str, method: str) -> None:
    deck = tmp_path/"hung.inp"
    text = HUNG.replace("<method>", method)
    deck.write_text(text if mass == "1" else text.replace("*GIVEN FORCES\n", ""))
    out = run(program[0], deck, mass, *"1 5  6 4  1 4".split(), env=program[1])
    strain, _, work, _ = map(float, out.split())
    assert strain <= FLOOR*EPS
    assert 0 < work < 0.1                          # it sags by less than a hundredth


def test_a_failure_says_what_rods_would_have_to_hold(program: tuple[Path, dict[str, str]],
                                                     tmp_path: Path) -> None:
    """Pushed sideways a block on two rods swings away: they bear nothing yet that turns it back."""
    deck = tmp_path/"swing.inp"
    text = HUNG.replace("<method>", "NULL SPACE").replace("*GIVEN FORCES\n", "")
    text = text.replace("10., 0., -1.", "10., 1., 0.")
    deck.write_text(text)
    done = subprocess.run([program[0], deck, *"0 1 5  6 4".split()], env=program[1],
                          capture_output=True, text=True)
    assert done.returncode == 1
    assert "without given constraints the body of element 1 is free to move in x" in done.stdout
    assert "contact" not in done.stdout            # there is none


def test_a_constraint_without_conditions_is_refused(program: tuple[Path, dict[str, str]],
                                                    tmp_path: Path) -> None:
    deck = tmp_path/"rods.inp"
    deck.write_text(PENDULUM.replace("<method>", "NULL SPACE"))
    done = subprocess.run([program[0], deck, "1"], env=program[1], capture_output=True, text=True)
    assert done.returncode == 1
    assert "n_constraint is to be their number" in done.stdout
