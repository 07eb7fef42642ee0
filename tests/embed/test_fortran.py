"""The facade for Fortran: a program that uses nothing else, against the installed modules."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from embed_tools import API, HERE, ROOT, build, run

RING = ROOT/"input_decks"/"ring.inp"
EPS = 2.0**-52
# Modules that emcon_api stands for, by their files; other modules it takes single names from.
STANDS_FOR = ["emcon_stepper*", "emcon_quantities", "emcon_version"]
# For the other rooms of the library, not for programs.
INNER_MODULES = {"emcon_stepper_check"}
INNER_NAMES = {"stepper_read_source", "stepper_check_solids", "query_sync", "query_place",
               "query_forget", "report_evaluate", "report_check_list", "quantity_fields",
               "quantity_of_field", "loads_exchange"}


def statements(path: Path) -> list[str]:
    """The statements of a file, on one line each, without comments."""
    text = re.sub(r"\s*!.*", "", path.read_text())
    return [line.strip() for line in re.sub(r"\s*&\s*\n\s*", " ", text).splitlines()]


def listed(lines: list[str], pattern: str) -> set[str]:
    found = [re.fullmatch(pattern, line) for line in lines]
    return {name.strip() for match in found if match for name in match[1].split(",")}


def missing(facade: Path) -> set[str]:
    """Public names of the modules that the facade stands for, but does not have."""
    offered = listed(statements(facade), r"use \w+, only : (.*)")
    wanted = set()
    for pattern in STANDS_FOR:
        for path in (ROOT/"src_f90").glob(f"*/{pattern}.f90"):
            if path.stem not in INNER_MODULES and not path.stem.endswith("_c"):
                wanted |= listed(statements(path), r"public :: (.*)")
    assert len(wanted) > 60
    return wanted - offered - INNER_NAMES


@pytest.fixture(scope="module")
def host(installed: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    program = tmp_path_factory.mktemp("fortran")/"fortran_host"
    build("gfortran", HERE/"fortran_host.f90", program, installed, "-std=f2008")
    return program


def test_facade_has_all_public_names(tmp_path: Path) -> None:
    facade = API/"emcon_api.f90"
    assert missing(facade) == set()
    less = tmp_path/facade.name
    less.write_text(facade.read_text().replace("stepper_snapshot, ", ""))
    assert missing(less) == {"stepper_snapshot"}


def test_facade_tells_of_what_there_is() -> None:
    """Names in the guide at its head are exported."""
    text = (API/"emcon_api.f90").read_text()
    head, body = text.split("\nmodule emcon_api\n")
    told = set(re.findall(r"`((?:stepper|query|interface|conditions|restart)_\w+)`", head))
    assert len(told) > 40
    assert told <= set(re.findall(r"\w+", body))


@pytest.fixture(scope="module")
def lines(host: Path, installed: dict[str, str]) -> list[list[str]]:
    """What the program prints, in words."""
    return [line.split() for line in run(host, RING, env=installed).splitlines()]


def test_version_is_that_of_the_package(lines: list[list[str]], installed: dict[str, str]) -> None:
    version = run("pkg-config", "--modversion", "emcon", env=installed).strip()
    assert lines[0] == ["version", version]


def test_models_side_by_side(lines: list[list[str]]) -> None:
    rows = [[float(number) for number in line[1:]] for line in lines if line[0] == "model"]
    assert len(rows) == 40
    first = rows[0][2]
    for _, _, total, *_ in rows:
        # Each step adds roundings of a sum over 1250 unknowns.
        assert abs(total - first) <= 40*1250**0.5*EPS*first
    assert rows[-1][1] == pytest.approx(1.0, rel=100*EPS)
    assert rows[-1][4] > rows[0][4]            # the ring is on its way back
    assert ["alone", "T"] in lines
    assert ["same", "T", "T", "T"] in lines


def test_residual_of_a_step_is_round_off(lines: list[list[str]]) -> None:
    name, start, end, n_active = lines[-1]
    assert name == "residual" and int(n_active) > 0
    assert float(end) <= 100*EPS*float(start)  # some hundred terms in each row


def test_contact_for_a_program_with_its_own_solids(
    installed: dict[str, str], tmp_path: Path
) -> None:
    """Discrete gradients: g . du is the change of the gap; and P is orthogonal to them."""
    program = tmp_path/"fortran_contact"
    build("gfortran", HERE/"fortran_contact.f90", program, installed, "-std=f2008")
    lines = run(program, env=installed).splitlines()
    assert len(lines) == 4
    for line, expected in zip(lines, (4, 4, 4, 3), strict=True):     # the last one in space
        n, redundant, change, misfit, crossed = map(float, line.split())
        assert n == expected and redundant == 0
        assert change > 0.1
        # Sums of 12 products of numbers of size 1 at most, each off by some roundings.
        assert max(misfit, crossed) <= 100*EPS


@pytest.fixture(scope="module")
def bars(installed: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    program = tmp_path_factory.mktemp("bars")/"fortran_bars"
    build("gfortran", HERE/"fortran_bars.f90", program, installed, "-std=f2018")
    return program


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("formulation", [1, 2, 3])
def test_a_host_in_fortran_keeps_energy_and_momentum(bars: Path, formulation: int, friction: float, installed: dict[str, str]) -> None:
    """Two free trusses collide, by one call a step."""
    drift, lost, *momentum = map(float, run(bars, env=installed, input=f"{formulation} {friction}\n").split())
    # 400 steps, each with a few roundings of the energy, and of momenta whose parts are velocities of size 1 over steps.
    assert drift <= 400*EPS and (lost > 0.05) == (friction > 0)
    assert momentum == pytest.approx([1.5, -6.0], abs=6*400*EPS)


@pytest.fixture(scope="module")
def friction_loop(installed: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    program = tmp_path_factory.mktemp("loop")/"friction_loop"
    build("gfortran", HERE/"friction_loop.f90", program, installed, "-std=f2008")
    return program


@pytest.mark.parametrize(("friction", "velocity"), [(0.0, 1.0), (0.3, 0.4), (0.8, 0.0)])
def test_friction_by_sets_and_with_all_candidates(friction: float, velocity: float, installed: dict[str, str],
                                                  friction_loop: Path) -> None:
    """Of the velocity along the floor friction takes twice its coefficient, or all; the energy is in what is left and lost."""
    lines = run(friction_loop, friction, env=installed).splitlines()
    assert len(lines) == 2
    for line in lines:
        *v, left, lost = map(float, line.split())
        # Twenty steps, whose velocities are differences of ends.
        assert v == pytest.approx([velocity, 1.0]*2, abs=1e3*EPS)
        assert (left, left + lost) == pytest.approx((1.0 + velocity**2, 2.0), abs=1e3*EPS)


def test_errors_are_values(host: Path, installed: dict[str, str], tmp_path: Path) -> None:
    done = subprocess.run([host, tmp_path/"none.inp"], env=installed, capture_output=True,
                          text=True)
    assert done.returncode == 1
    assert re.match(r"error 2: .*none\.inp: .*no such file", done.stdout)
