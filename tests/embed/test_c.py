"""The C interface: programs in C and C++ against the installed library, by pkg-config only."""

from __future__ import annotations

import ctypes
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from embed_tools import API, HERE, ROOT, SANITIZED, build, run

sys.path.insert(0, str(ROOT/"pywrap"))

from emcon.stepper import Stepper  # noqa: E402

RING = ROOT/"input_decks"/"ring.inp"
HEADERS = {path.name: path.read_text(encoding="utf-8") for path in sorted(API.glob("*.h"))}
VERSION = [int(number) for number in re.findall(r"EMCON_VERSION_[A-Z]+ (\d+)", HEADERS["emcon.h"])]
FUNCTIONS = {name for text in HEADERS.values()
             for name in re.findall(r"^[a-z][\w *]*?(emcon_\w+)\(", text, re.MULTILINE)}


@pytest.fixture(scope="module")
def impact(installed: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    program = tmp_path_factory.mktemp("impact")/"impact"
    build("cc", HERE/"impact.c", program, installed, "-std=c99")
    return program


def test_c_gives_the_bits_of_python(impact: Path, installed: dict[str, str]) -> None:
    verdict, line = run(impact, RING, "h=0.05\nt_end=1.5", env=installed).splitlines()
    n, *values = line.split()
    with Stepper(RING, h=0.05, t_end=1.5) as ring:
        count = 0
        while not ring.is_done:
            ring.step()
            count += 1
        found = ring.verdict()
        expected = [ring.energies()["total"], ring.momenta()["py"], ring.u[0, 1], ring.v[0, 1]]
    is_good, json_text = verdict.split(maxsplit=1)
    assert json.loads(json_text) == found and (is_good == "1") == (found["verdict"] == "good")
    assert int(n) == count
    assert [float(value) for value in values] == expected


def test_c_tells_what_is_wrong_with_a_deck(
    impact: Path, installed: dict[str, str], tmp_path: Path
) -> None:
    deck = tmp_path/"bad.inp"
    deck.write_text("*NODE\n1, 0., 0.\n*ELEMNT, TYPE=CPE4\n")
    done = subprocess.run([impact, deck], env=installed, capture_output=True, text=True)
    assert done.returncode == 2
    assert re.search(r"error 2: .*bad\.inp:3: .*ELEMENT", done.stderr)


def test_threads_in_cpp(installed: dict[str, str], tmp_path: Path) -> None:
    program = tmp_path/"two_models"
    build("c++", HERE/"two_models.cpp", program, installed, "-std=c++11", "-pthread")
    assert "no such file" in run(program, RING, env=installed)


@pytest.mark.skipif(SANITIZED, reason="Python cannot load such a library")
def test_library_exports_what_the_headers_declare(installed: dict[str, str]) -> None:
    """A function that is declared is there; a change of the interface shows in the version."""
    major, minor, _ = VERSION
    series = f"{major}" if major > 0 else f"0.{minor}"       # until then minor ones may differ
    library = ctypes.CDLL(str(Path(installed["PREFIX"])/"lib"/f"libemcon.so.{series}"))
    assert set(HEADERS) == {"emcon.h"}
    for name in FUNCTIONS:
        assert hasattr(library, name), name
    version = [ctypes.c_int() for _ in range(3)]
    library.emcon_version(*(ctypes.byref(number) for number in version))
    assert [number.value for number in version] == VERSION
    text = subprocess.run(["nm", "-D", "--defined-only", library._name], capture_output=True,
                          text=True).stdout
    exported = set(re.findall(r" T (emcon_[a-z0-9_]+)$", text, re.MULTILINE))
    assert exported == FUNCTIONS
