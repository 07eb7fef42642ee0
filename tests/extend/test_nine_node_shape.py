"""An element from outside: nine nodes, a file against the installed library."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent/"embed"))

from embed_tools import WARNINGS, need, run  # noqa: E402

SOURCES = ["nine_node_shape.f90", "shaped.f90"]
#: Columns and rows of a cell's nodes: around the outline, then the middle.
AROUND = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1), (1, 1)]
CARD = "*USER ELEMENT, TYPE=U9, NODES=9, FACES=8\n1, 2\n"
RUBBER = """*MATERIAL, NAME=RUBBER
*HYPERELASTIC, NEO HOOKE
10., 0.02
*DENSITY
1.
*SOLID SECTION, ELSET=ALL, MATERIAL=RUBBER
"""
#: A homogeneous deformation.
STRETCH = np.array([[0.2, 0.3], [-0.1, 0.15]])


def block(n: tuple[int, int], low: tuple[float, float], first: int, element: int,
          shake: float = 0.0) -> tuple[list[str], list[str], np.ndarray]:
    """Lines of nodes and of elements, and the positions, of a block of cells of size 1."""
    columns, rows = 2*n[0] + 1, 2*n[1] + 1
    x = np.array([[0.5*i, 0.5*j] for j in range(rows) for i in range(columns)])
    inner = np.all((x > 0) & (x < n), axis=1)
    x[inner] += shake*(np.random.default_rng(1).random((inner.sum(), 2)) - 0.5)
    x += low
    nodes = [f"{first + k}, {a!r}, {b!r}" for k, (a, b) in enumerate(x.tolist())]
    elements = []
    for j in range(n[1]):
        for i in range(n[0]):
            names = [first + 2*i + di + columns*(2*j + dj) for di, dj in AROUND]
            elements.append(", ".join(map(str, [element, *names])))
            element += 1
    return nodes, elements, x


def mesh(nodes: list[str], elements: list[str], card: str = CARD) -> str:
    return "\n".join(["*NODE", *nodes, card.strip(), "*ELEMENT, TYPE=U9, ELSET=ALL", *elements,
                      RUBBER])


@pytest.fixture(scope="module")
def program(installed: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    need("gfortran")
    folder = tmp_path_factory.mktemp("shape")
    env = installed
    flags = run("pkg-config", "--cflags", "--libs", "emcon", env=env).split()
    run("gfortran", *WARNINGS, "-Wno-unused-dummy-argument", "-std=f2008",
        *(HERE/name for name in SOURCES), "-o", folder/"shaped", *flags, env=env, cwd=folder)
    return folder/"shaped", env


def table(text: str, name: str) -> np.ndarray:
    return np.array([[float(word) for word in line.split()[1:]] for line in text.splitlines()
                     if line.startswith(name)])


def patch(shake: float) -> str:
    """Two by two cells whose outer nodes are moved as `STRETCH` says."""
    nodes, elements, x = block((2, 2), (0.0, 0.0), 1, 1, shake)
    outer = np.any((x == 0) | (x == 2), axis=1)
    u = (x @ STRETCH.T).tolist()
    moves = [f"{k + 1}, {a + 1}, {a + 1}, {u[k][a]!r}"
             for k in np.flatnonzero(outer) for a in range(2)]
    return mesh(nodes, elements) + "\n".join(
        ["*STEP, NLGEOM", "*STATIC", "0.5, 1.", "*BOUNDARY", *moves, "*END STEP", ""])


@pytest.mark.parametrize("shake", [0.0, 0.2], ids=["straight", "curved"])
def test_patch(program: tuple[Path, dict[str, str]], tmp_path: Path, shake: float) -> None:
    """The inner nodes follow a homogeneous deformation, and the stress is the same everywhere."""
    deck = tmp_path/"patch.inp"
    deck.write_text(patch(shake))
    out = run(program[0], deck, "u9", tmp_path/"patch", env=program[1])
    node, stress = table(out, "node"), table(out, "stress")
    expected = node[:, :2] @ STRETCH.T
    # What Newton's method leaves of the largest force: its tolerance is 1e-11.
    assert np.abs(node[:, 2:] - expected).max() < 1e-11*np.abs(expected).max()
    assert len(stress) == 4
    assert np.ptp(stress, axis=0).max() < 1e-11*np.abs(stress).max()
    assert np.abs(stress).max() > 1.0
    assert "4 elements U9" in out


CONTACT = """*SURFACE, NAME=UP
{upper}, S1
{upper}, S2
*SURFACE, NAME=DOWN
{lower}, S5
{lower}, S6
*SURFACE INTERACTION, NAME=HARD
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*CONTACT PAIR, INTERACTION=HARD, TYPE={kind}
UP, DOWN
*INITIAL CONDITIONS, TYPE=VELOCITY
FLYING, 2, -1.
FLYING, 1, 0.2
*STEP, NLGEOM
*DYNAMIC, DIRECT
0.02, 1.
*NODE FILE
U
*END STEP
"""


def meeting(kind: str) -> str:
    """A block that flies onto another one, both free."""
    down, cells, _ = block((3, 1), (0.0, 0.0), 1, 1)
    up, more, _ = block((2, 1), (0.3, 1.05), 101, 11)
    sets = ("*ELSET, ELSET=LOWER\n1, 2, 3\n*ELSET, ELSET=UPPER\n11, 12\n"
            "*NSET, NSET=FLYING, GENERATE\n101, 115\n")
    return mesh(down + up, cells + more) + sets + CONTACT.format(
        kind=kind, upper="UPPER", lower="LOWER")


@pytest.mark.parametrize("kind", ["NODE TO SURFACE", "MORTAR"])
def test_contact_keeps_energy(program: tuple[Path, dict[str, str]], tmp_path: Path,
                              kind: str) -> None:
    deck = tmp_path/"meeting.inp"
    deck.write_text(meeting(kind))
    out = run(program[0], deck, "U9", tmp_path/"meeting", env=program[1])
    total, drift, n_active = map(float, out.split("\n")[0].split())
    assert n_active >= 3
    assert drift <= 1e-12*total
    assert table(out, "restart")[0] == 0.0
    with h5py.File(tmp_path/"meeting.vtkhdf") as file:
        assert set(file["VTKHDF/Types"][:]) == {7}
        assert np.all(np.diff(file["VTKHDF/Offsets"][:]) == 8)


def test_pressure_and_weight(program: tuple[Path, dict[str, str]], tmp_path: Path) -> None:
    """What a pressure on the top face and gravity push in a time; dead loads of small strains."""
    nodes, elements, _ = block((2, 1), (0.0, 0.0), 1, 1)
    deck = tmp_path/"pushed.inp"
    deck.write_text(mesh(nodes, elements) + "*STEP\n*DYNAMIC, DIRECT\n0.1, 1.\n*DLOAD\n"
                    "ALL, P5, 0.3\nALL, P6, 0.3\nALL, GRAV, 0.2, 1., 0.\n*END STEP\n")
    out = run(program[0], deck, "U9", tmp_path/"pushed", env=program[1])
    # Force of a node: about ten roundings in each of ten steps.
    assert table(out, "momentum")[0] == pytest.approx([0.4, -0.6], rel=100*np.finfo(float).eps)


@pytest.mark.parametrize("name, words", [
    ("", "is of type U9, a *USER ELEMENT: a program has to give its shape"),
    ("CPE4", "a shape cannot be given for CPE4"),
    ("U8", "there is no element type U8 in the deck"),
])
def test_refused(program: tuple[Path, dict[str, str]], tmp_path: Path, name: str,
                 words: str) -> None:
    deck = tmp_path/"patch.inp"
    deck.write_text(patch(0.0))
    done = subprocess.run([program[0], deck, name, tmp_path/"patch"], env=program[1],
                          capture_output=True, text=True)
    assert done.returncode == 1
    assert words in done.stdout


def test_another_number_of_nodes_is_refused(program: tuple[Path, dict[str, str]],
                                            tmp_path: Path) -> None:
    deck = tmp_path/"eight.inp"
    nodes, elements, _ = block((1, 1), (0.0, 0.0), 1, 1)
    eight = [line.rsplit(",", 1)[0] for line in elements]
    deck.write_text(mesh(nodes, eight, CARD.replace("NODES=9", "NODES=8"))
                    + "*STEP\n*DYNAMIC, DIRECT\n0.1, 0.1\n*END STEP\n")
    done = subprocess.run([program[0], deck, "U9", tmp_path/"eight"], env=program[1],
                          capture_output=True, text=True)
    assert done.returncode == 1
    assert "the shape given for U9: it has 9 nodes, not 8" in done.stdout
