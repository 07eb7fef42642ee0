"""The C interface in depth: steps of any size, conditions, matrices, and wrong calls."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from embed_tools import API, HERE, ROOT, WARNINGS, build, need, run

DECKS = ROOT/"input_decks"
HEADER = (API/"emcon.h").read_text(encoding="utf-8")
TYPES = ROOT/"build/release/made/emcon_c_types.f90"
EPS = 2.0**-52

# What is told of wrong calls, in the order of bad_calls.c; "" where all is well.
HALF_MADE = [
    "deck is NULL", "no scene", "no scene", "typed:2: error: .*nowhere", "no scene",
    "", "free to move", "no scene", "no scene", "", "", "not built yet", "not built yet", "", "",
    "path is NULL", "no scene", "has no checksum",
    "state.h5 does not exist",
]
WITHOUT_ARRAYS = [""]*10 + [
    "snapshot is NULL", "snapshot is NULL", "u1 is NULL", "u0 is NULL", "direction is NULL",
    "path is NULL",
]
RUBBISH = [
    "no step was evaluated", "no step was evaluated", "no step was evaluated", "no null space",
    "no constraints were evaluated", "n_node is 105, but the model has 106", "n_node is -1",
    "n_constraint is 5, but the model has 4", "n_node is 107", "n_constraint is 11", "not 0", "",
    "without tangent", "n_unknown is 203, but the model has 204", "finite", "not -0.1", "finite",
    "finite", "last one of the deck", "built already", "time -1 is before", "no load 51: .* has 50",
    "no load 0", "is -1", "NULL", "kind 99 is not one of loads", "not finite", "no load of this kind",
    "no node 0", "1 to 2, not 3",
    "is not prescribed", "0 threads", "cannot create no/such/folder", "u is not finite at node 106",
    "u1 is not finite", "u0 is not finite",
]
# Codes other than 2.
CODES = {"": 0, "free to move": 3, "has no checksum": 4, "state.h5 does not exist": 4,
         "cannot create no/such/folder": 4}


def program(name: str, folder: Path, env: dict[str, str]) -> Path:
    build("cc", HERE/f"{name}.c", folder/name, env, "-std=c99")
    return folder/name


@pytest.fixture(scope="module")
def query(installed: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    return program("query", tmp_path_factory.mktemp("query"), installed)


@pytest.fixture(scope="module")
def bad_calls(installed: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    return program("bad_calls", tmp_path_factory.mktemp("bad_calls"), installed)


def rows(query: Path, env: dict[str, str], *arguments: object) -> dict[str, list[list[float]]]:
    found: dict[str, list[list[float]]] = {}
    for line in run(query, *arguments, env=env).splitlines():
        name, numbers = line.split(":")
        found.setdefault(name, []).append([float(number) for number in numbers.split()])
    return found


def test_a_bar_falls_by_steps_of_the_program(query: Path, installed: dict[str, str]) -> None:
    """Mass 10 under gravity 10, then 20, with steps halved as it gets faster."""
    steps = rows(query, installed, DECKS/"bouncing_bar.inp")["step"]
    sizes = {h for h, *_ in steps}
    assert sizes == {0.05, 0.025, 0.0125}
    assert sum(h for h, *_ in steps) == pytest.approx(1.0, rel=100*EPS)
    for n, (_, time, py, total, kinetic, by_mass) in enumerate(steps, 1):
        # Sums over 204 unknowns, each some roundings off after n steps.
        bound = n*204*EPS
        assert by_mass == pytest.approx(kinetic, rel=204*EPS)
        assert abs(total) <= bound*kinetic
        if time < 0.89:                        # before it meets the floor
            speed = 10*time if time < 0.51 else 5 + 20*(time - 0.5)
            assert py == pytest.approx(-10*speed, rel=bound)
    assert steps[-1][2] > min(py for _, _, py, *_ in steps)      # the floor pushes


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "MORTAR"])
def test_null_space_is_orthogonal_to_gradients(
    query: Path, installed: dict[str, str], formulation: str
) -> None:
    found = rows(query, installed, DECKS/"ring.inp", f"formulation={formulation}")
    ((n_active, n_unknown, n_column, of_p, of_df, terms),) = found["null space"]
    assert n_active > 0 and n_column == n_unknown - n_active
    assert terms > 0
    # Sums of some tens of products, whose factors are off by some roundings.
    assert max(of_p, of_df) <= 100*EPS*terms


def test_wrong_calls_are_told(bad_calls: Path, installed: dict[str, str], tmp_path: Path) -> None:
    text = run(bad_calls, DECKS/"bouncing_bar.inp", tmp_path, env=installed)
    calls = re.findall(r"^(emcon_\w+)\|(\d+)\|(.*(?:\n(?!emcon_).*)*)$", text, re.MULTILINE)
    without = set(re.findall(r"^[a-z][\w *]*?(emcon_\w+)\(", HEADER, re.MULTILINE))
    without -= {"emcon_version", "emcon_message", "emcon_close", "emcon_free_snapshot",
                "emcon_status_text"}
    expected = ["NULL"]*len(without) + HALF_MADE + WITHOUT_ARRAYS + RUBBISH
    assert {name for name, _, _ in calls[:len(without)]} == without
    assert len(calls) == len(expected)
    for (name, code, message), pattern in zip(calls, expected):
        assert int(code) == CODES.get(pattern, 2), (name, message)
        assert re.search(pattern, message) if pattern else message == "", (name, message)


def structures() -> dict[str, list[str]]:
    """Structures of the header, and their components."""
    text = re.sub(r"/\*.*?\*/", "", HEADER, flags=re.DOTALL)
    found = {}
    for body, name in re.findall(r"typedef struct \w+ \{(.*?)\} (\w+);", text, re.DOTALL):
        found[name] = [re.search(r"(\w+)$", part.strip())[1]
                       for part in re.split("[;,]", body) if part.strip()]
    return found


def test_structures_are_the_same_on_both_sides(installed: dict[str, str], tmp_path: Path) -> None:
    """Size of each structure of the header and place of each component, in C and in Fortran."""
    c, fortran, declared = [], [], []
    for name, parts in structures().items():
        here = name.removeprefix("emcon_")
        declared.append(f"type({here}_c), target :: {here}")
        c.append(f'printf("{name} %d\\n", (int)sizeof({name}));')
        fortran.append(f'print "(a, 1x, i0)", "{name}", c_sizeof({here})')
        for part in parts:
            c.append(f'printf("{name}.{part} %d\\n", (int)offsetof({name}, {part}));')
            fortran.append(f'print "(a, 1x, i0)", "{name}.{part}", &\n'
                           f"place(c_loc({here}%{part})) - place(c_loc({here}))")
    assert len(c) > 40
    (tmp_path/"probe.c").write_text(
        "#include <emcon.h>\n#include <stdio.h>\nint main(void) {\n"
        + "\n".join(c) + "\nreturn 0; }\n")
    (tmp_path/"probe.f90").write_text(
        "program probe\nuse, intrinsic :: iso_c_binding\nuse emcon_c_types\nimplicit none\n"
        + "\n".join(declared + fortran)
        + "\ncontains\ninteger(c_intptr_t) function place(address)\ntype(c_ptr), intent(in) :: "
        "address\nplace = transfer(address, place)\nend function place\nend program probe\n")
    build("cc", tmp_path/"probe.c", tmp_path/"probe_c", installed, "-std=c99")
    build("gfortran", tmp_path/"probe.f90", tmp_path/"probe_f", installed)
    assert run(tmp_path/"probe_f", env=installed) == run(tmp_path/"probe_c", env=installed)
    assert set(structures()) == {
        f"emcon_{name}" for name in re.findall(r"end type (\w+)_c", TYPES.read_text())}


@pytest.mark.parametrize("language", ["-std=c99", "-std=c11", "-std=c++11", "-std=c++17"])
def test_header_is_clean(language: str, tmp_path: Path) -> None:
    compiler, ending = ("c++", "cpp") if "++" in language else ("cc", "c")
    need(compiler)
    (tmp_path/f"header.{ending}").write_text("#include <emcon.h>\n#include <emcon.h>\n")
    command = [compiler, *WARNINGS, language, f"-I{API}", "-fsyntax-only", tmp_path/f"header.{ending}"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stdout + done.stderr) == (0, "")
