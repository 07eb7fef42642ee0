"""Contact from outside, in three dimensions: a file against the installed library."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent/"embed"))

from embed_tools import WARNINGS, need, run  # noqa: E402

SOURCES = ["nodes_on_faces.f90", "met.f90"]
# A brick over a larger one.
BRICKS = """*NODE, NSET=ALL
1, 0., 0., 0.
2, 1., 0., 0.
3, 1., 1., 0.
4, 0., 1., 0.
5, 0., 0., 1.
6, 1., 0., 1.
7, 1., 1., 1.
8, 0., 1., 1.
11, 0.2, 0.2, {low}
12, 0.8, 0.2, {low}
13, 0.8, 0.8, {low}
14, 0.2, 0.8, {low}
15, 0.2, 0.2, 2.
16, 0.8, 0.2, 2.
17, 0.8, 0.8, 2.
18, 0.2, 0.8, 2.
*ELEMENT, TYPE=C3D8, ELSET=LOWER
1, 1, 2, 3, 4, 5, 6, 7, 8
*ELEMENT, TYPE=C3D8, ELSET=UPPER
2, 11, 12, 13, 14, 15, 16, 17, 18
*NSET, NSET=UPPERN, GENERATE
11, 18
*NSET, NSET=BOTTOM, GENERATE
1, 4
*NSET, NSET=TOP, GENERATE
15, 18
*SURFACE, NAME=MASTER
LOWER, S2
*SURFACE, NAME=SLAVE
UPPER, S1
*MATERIAL, NAME=M
*HYPERELASTIC, COUPLED NEO HOOKE
100., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=LOWER, MATERIAL=M
*SOLID SECTION, ELSET=UPPER, MATERIAL=M
*SURFACE INTERACTION, NAME=HARD
*CONTACT PAIR, INTERACTION=HARD, TYPE=USER
SLAVE, MASTER
"""
IMPACT = """*INITIAL CONDITIONS, TYPE=VELOCITY
UPPERN, 1, 0.3
UPPERN, 2, 0.1
UPPERN, 3, -2.
*STEP, NLGEOM, INC=100000
*DYNAMIC, DIRECT
0.01, 0.4
*CONSTRAINT METHOD, TYPE={method}
*CONTACT INITIATION, TYPE={initiation}
*END STEP
"""
PRESS = """*BOUNDARY
BOTTOM, 1, 3
*STEP, NLGEOM
*STATIC
0.25, 1.
*BOUNDARY
TOP, 1, 2
TOP, 3, 3, -0.2
*NODE FILE
U, RF
*CONTACT FILE
CDIS, CSTR, CF
*CONTACT PRINT, TOTALS=ONLY
CF
*END STEP
"""
# Nothing but contact holds the upper brick along z.
REST = """*BOUNDARY
BOTTOM, 1, 3
TOP, 1, 2
*STEP, NLGEOM
*STATIC
0.5, 1.
*CLOAD
TOP, 3, -0.1
*END STEP
"""


@pytest.fixture(scope="module")
def program(installed: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    need("gfortran")
    folder = tmp_path_factory.mktemp("extend")
    env = installed
    flags = run("pkg-config", "--cflags", "--libs", "emcon", env=env).split()
    run("gfortran", *WARNINGS, "-std=f2008", "-fcheck=bounds", *(HERE/name for name in SOURCES),
        "-o", folder/"met", *flags, env=env, cwd=folder)
    return folder/"met", env


def met(program: tuple[Path, dict[str, str]], folder: Path, deck: str,
        *base: Path) -> tuple[np.ndarray, str]:
    """A row for each time, and what the run says of itself."""
    path = folder/"bricks.inp"
    path.write_text(deck)
    lines = run(program[0], path, "slave", "master", *base, env=program[1]).splitlines()
    table = [[float(word) for word in line.split()] for line in lines if line[0] != "#"]
    return np.array(table), "\n".join(line for line in lines if line[0] == "#")


def refusal(program: tuple[Path, dict[str, str]], folder: Path, deck: str, *names: str) -> str:
    path = folder/"bricks.inp"
    path.write_text(deck)
    done = subprocess.run([program[0], path, *names], env=program[1], capture_output=True,
                          text=True)
    assert done.returncode == 1, done.stderr
    return done.stdout


def deepest(said: str) -> float:
    """The overlap that the verdict tells, per face: of two bricks."""
    found, = re.findall(r"overlap checked: 2 bodies, 12 faces; deepest penetration (\S+) of an element", said)
    return float(found)


@pytest.mark.parametrize(("method", "initiation"), [
    ("NULL SPACE", "PERSISTENT"), ("NULL SPACE", "VELOCITY UPDATE"), ("NULL SPACE", "MASSLESS"),
    ("SADDLE POINT", "PERSISTENT")])
def test_bricks_collide(program: tuple[Path, dict[str, str]], tmp_path: Path, method: str,
                        initiation: str) -> None:
    """Energy and linear momenta stay, and the brick bounces."""
    table, said = met(program, tmp_path, BRICKS.format(low=1.05) +
                      IMPACT.format(method=method, initiation=initiation))
    energy, momentum, active, force = table[:, 1], table[:, 3:6], table[:, 9], table[:, 10:]
    assert np.abs(energy - energy[0]).max() <= 1e-13*energy[0]
    assert np.abs(momentum - momentum[0]).max() <= 1e-13*np.abs(momentum[0]).max()
    assert active.max() >= 3 and active[-1] == 0
    assert force[:, 2].max() > 0
    assert 0 < deepest(said) < 0.2             # faces that warp are other triangles in the check


def test_brick_is_pressed(program: tuple[Path, dict[str, str]], tmp_path: Path) -> None:
    """Nodes of one that stand on the other at the start are in contact from there on."""
    table, said = met(program, tmp_path, BRICKS.format(low=1.) + PRESS, tmp_path/"pressed")
    assert (table[1:, 9] == 4).all()
    force = table[1:, 12]
    assert (np.diff(force) > 0).all()
    assert 0 < deepest(said) < 0.2             # faces that warp are other triangles in the check
    with h5py.File(tmp_path/"pressed.vtkhdf") as file:
        data = file["VTKHDF"]["PointData"]
        written = {name: data[name][-16:] for name in ("contact_force", "contact_pressure",
                                                       "contact_gap", "reaction_force")}
    assert abs(written["contact_force"][8:, 2].sum() - force[-1]) <= 1e-14
    assert (written["contact_pressure"] > 0).sum() == 4
    assert np.isfinite(written["contact_gap"]).sum() == 4
    # The lower brick hands on what it is pressed by.
    assert abs(written["reaction_force"][:4, 2].sum() - force[-1]) <= 1e-12
    header, *rows = (tmp_path/"pressed.csv").read_text().splitlines()
    assert abs(float(rows[-1].split(",")[header.split(",").index("pair1_force_z")])
               - force[-1]) <= 1e-14


def test_brick_is_pressed_against_a_tetrahedron(program: tuple[Path, dict[str, str]],
                                                tmp_path: Path) -> None:
    """Which stands in the lower brick; its nodes are those of the brick's upper face."""
    deck = BRICKS.format(low=1.).replace(
        "*SURFACE, NAME=MASTER\nLOWER, S2", "*ELEMENT, TYPE=C3D4, ELSET=LOWER\n"
        "3, 5, 8, 7, 1\n4, 5, 7, 6, 1\n*SURFACE, NAME=MASTER\n3, S1\n4, S1")
    table, _ = met(program, tmp_path, deck + PRESS)
    assert (table[1:, 9] == 4).all()


@pytest.mark.parametrize("low", [1., 1.05])
def test_brick_rests(program: tuple[Path, dict[str, str]], tmp_path: Path, low: float) -> None:
    """Contact alone holds it, also across a gap, and bears what the load weighs."""
    table, _ = met(program, tmp_path, BRICKS.format(low=low) + REST)
    assert table[-1, 9] == 4
    # Newton stops at round-off of stresses of some hundred.
    assert abs(table[-1, 12] - 0.4) <= 1e-12
    slave, master = table[-1, 10:16], table[-1, 16:]
    assert np.abs(slave + master).max() <= 1e-14 and np.abs(slave[3:5]).max() > 0.1


def test_refusals(program: tuple[Path, dict[str, str]], tmp_path: Path) -> None:
    deck = BRICKS.format(low=1.)
    line = deck.splitlines().index("*CONTACT PAIR, INTERACTION=HARD, TYPE=USER") + 1
    said = refusal(program, tmp_path, deck + PRESS, "", "")
    assert f"bricks.inp:{line}: error: " in said and "no program has given this contact" in said
    said = refusal(program, tmp_path, deck + PRESS, "master", "slave")
    assert "no *CONTACT PAIR, TYPE=USER of slave surface MASTER" in said
    said = refusal(program, tmp_path, BRICKS.format(low=0.99) + PRESS, "slave", "master")
    assert "4 slave nodes of surface SLAVE penetrate surface MASTER, by 0.01 at most" in said


@pytest.mark.parametrize(("old", "new", "words"), [
    ("TYPE=USER", "TYPE=SEGMENT", "TYPE=SEGMENT is for plane models"),
    ("TYPE=USER", "TYPE=USER, ADJUST=0.1", "ADJUST does not work with TYPE=USER"),
    ("TYPE=USER", "TYPE=USER, GUARD=YES", "GUARD=YES does not work with TYPE=USER"),
    ("TYPE=USER", "TYPE=USER, SIDES=BOTH", "the program that gives TYPE=USER decides"),
    ("NAME=HARD\n", "NAME=HARD, PAD THICKNESS=0.1\n", "PAD THICKNESS of its surface interaction"),
    ("NAME=HARD\n", "NAME=HARD\n*FRICTION\n0.1\n", "*FRICTION of its surface interaction")])
def test_what_contact_of_a_program_does_not_know(program: tuple[Path, dict[str, str]],
                                                 tmp_path: Path, old: str, new: str,
                                                 words: str) -> None:
    deck = BRICKS.format(low=1.).replace(old, new)
    assert words in refusal(program, tmp_path, deck + PRESS, "slave", "master")
