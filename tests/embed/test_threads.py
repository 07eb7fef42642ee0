"""Models that are opened in threads: nothing in the library is shared between them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from embed_tools import HERE, ROOT, build, run

# The long form (`make soak`): EMCON_OPENS=20000.
N_OPEN = int(os.environ.get("EMCON_OPENS", "400"))
DECKS = sorted((ROOT/"tests"/"decks").glob("good_*.inp")) \
    + [ROOT/"input_decks"/f"{name}.inp" for name in ("contact_patch", "tied_patch")]


@pytest.fixture(scope="module")
def opener(installed: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    program = tmp_path_factory.mktemp("open")/"open_models"
    build("cc", HERE/"open_models.c", program, installed, "-std=c99", "-pthread")
    return program


def test_decks_open_in_eight_threads(opener: Path, installed: dict[str, str]) -> None:
    alone = {deck for deck in DECKS if subprocess.run(
        [opener, "1", deck], env=installed, capture_output=True, text=True).stdout == "0\n"}
    assert len(alone) > len(DECKS)/2
    assert run(opener, N_OPEN, *sorted(alone), env=installed) == "0\n"


def test_one_deck_opens_in_eight_threads(opener: Path, installed: dict[str, str],
                                         tmp_path: Path) -> None:
    """All threads read the same file and the same included file, at the same time."""
    deck = tmp_path/"whole.inp"
    text = (ROOT/"input_decks"/"contact_patch.inp").read_text(encoding="utf-8")
    cut = text.index("*MATERIAL")
    (tmp_path/"part.inp").write_text(text[:cut], encoding="utf-8")
    deck.write_text("*INCLUDE, INPUT=part.inp\n" + text[cut:], encoding="utf-8")
    assert run(opener, N_OPEN//4, deck, env=installed) == "0\n"


def test_no_length_of_a_result_is_static(installed: dict[str, str]) -> None:
    """gfortran keeps the length of a deferred-length result in a variable `slen`."""
    library = Path(installed["PREFIX"])/"lib"/"libemcon.so"
    symbols = run("nm", library)
    assert " emcon_open\n" in symbols
    assert not re.search(r"\bslen\b", symbols)


def deferred_results(text: str) -> list[str]:
    """The functions in a Fortran source that have a result of deferred length."""
    text = re.sub(r"&\s*\n\s*", "", text)
    found = []
    for match in re.finditer(r"^ *(?!end )([\w()=:*, ]*?)\bfunction (\w+) *\(.*?\)(?:.*?result *"
                             r"\( *(\w+) *\))?.*?\n(.*?)^ *end function", text, re.M | re.S):
        prefix, name, result, body = match.groups()
        declared = rf"character *\((?:len *= *)?: *\)[^\n!]*::[^\n!]*\b{result or name}\b"
        if re.search(declared, body) or re.search(r"character *\((?:len *= *)?:", prefix):
            found.append(name)
    return found


def test_no_function_has_a_result_of_deferred_length() -> None:
    assert deferred_results("pure function f(a) &\n   result(b)\n   integer :: a\n"
                            "   character(len=:), allocatable :: b\nend function f\n") == ["f"]
    sources = [path for folder in ("src_f90", "tests") for path in (ROOT/folder).rglob("*.[fF]90")]
    assert len(sources) > 200
    assert {str(path.relative_to(ROOT)): names for path in sources
            if (names := deferred_results(path.read_text(encoding="utf-8")))} == {}


STATICS = """
from emcon import Model
from emcon.mesh import block

mesh = block((0.0, 0.0, 0.0), (2.0, 1.0, 1.0), (8, 4, 4), "BAR", kind="C3D8")
bar = Model.from_mesh(mesh).material("M", elastic=(100.0, 0.3)).section("M", "BAR").boundary("BAR_LEFT")
bar.step("STATIC", 1.0, 1.0, nlgeom=True).boundary("BAR_RIGHT", 3, 0.1)
with bar.stepper() as stepper:
    stepper.run()
    print(stepper.energies()["strain"].hex())
"""


def test_a_factor_is_made_whatever_threads_blas_may_have() -> None:
    """Factors with fronts that OpenBLAS would share among threads: in a host that has set nothing, and in one with four."""
    found = set()
    for threads in (None, "1", "4"):
        environment = {name: value for name, value in os.environ.items()
                       if name not in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
        environment["PYTHONPATH"] = str(ROOT/"pywrap")
        if threads is not None:
            environment["OMP_NUM_THREADS"] = threads
        done = subprocess.run([sys.executable, "-c", STATICS], capture_output=True, text=True, env=environment,
                              timeout=60)
        assert done.returncode == 0, done.stderr
        found.add(done.stdout)
    assert len(found) == 1
