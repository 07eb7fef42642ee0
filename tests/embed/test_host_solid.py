"""A host's solid, potential and law in the library's step, from C, C++, Fortran; and wrong ones."""

from __future__ import annotations

import re
import shutil
import textwrap
from pathlib import Path

import numpy as np
import pytest
from embed_tools import HERE, ROOT, build, run

EPS = 2.0**-52
# Steps, and freedoms of the 39 nodes: each step adds roundings of a sum over them.
BOUND = 50*78*EPS
FORMULATIONS = ["NODE TO SURFACE", "SEGMENT", "MORTAR"]
COMPILERS = {"c": ("cc", "host_solid.c", "-std=c99"),
             "c++": ("c++", "host_solid.c", "-x", "c++", "-std=c++11"),
             "fortran": ("gfortran", "fortran_solid.f90", "-std=f2008")}

# Codes and messages of bad_given.c, in its order; "" where all is well.
NOT_GIVEN = [(0, ""), (2, "no forces were given"), (0, ""), (0, ""), (2, "no forces were given"),
             (0, ""), (2, r"bad_given:10: .* SOFT is a \*USER MATERIAL"), (2, "no scene")]
ARGUMENTS = [
    (2, "function is NULL"), (2, "name is NULL"), (2, "no material HARD"),
    (2, r"STEEL \(bad_given:15\) has a law of its own"),
    (2, "function is NULL"), (2, "node is NULL"), (2, "names no node"), (2, "node 5 twice"),
    (2, "node 7, which is not in 1..6"),
    (2, "pattern is NULL"), (2, "function is NULL"), (2, "pattern->row_start is NULL"),
    (2, "pattern->column is NULL"), (2, "SPRING: .*column 12 in row 9 is not in 0..11"),
    (2, "column 8 in row 9 .* not above the one before"), (2, "row 9 ends before it begins"),
    (2, "6 rows and 6 columns, not those of 2 freedoms for each of 6 nodes"), (2, "has no rows"),
    (2, "12 rows and 12 columns, not those of 6 nodes"), (2, "16 and 16 is not finite"), (2, "16 and 16 is negative: -1"),
    (2, "mass is NULL"),
    (0, ""), (2, "given already"), (0, ""), (0, ""), (2, "given already"), (0, ""),
    *[(2, "before the model is built")]*4, (0, ""), (0, ""),
    (2, "1 given forces and 1 masses, not with 0 .* give them again"),
]
GOING_WRONG = [
    (0, ""),
    (2, "SOFT has no finite value at zero strain"), (3, "SOFT has failed at zero strain"),
    (2, "SOFT has no finite value at zero strain"),
    (3, "SPRING is put out of its range by the displacements at the start"),
    (3, "SPRING failed"), (3, "SPRING is made infinite or NaN at node 15"),
    (3, "WELL is put out of its range"), (3, "WELL failed"), (3, "WELL is put out of its range"),
    # later: a step is cut until it is too small; what has failed ends it; then all goes on
    (3, "stops at time .* the smallest allowed, the law given for material SOFT has no"), (0, ""),
    (3, "the law given for material SOFT has failed"), (0, ""),
    (3, "stops at time .* SPRING is put out of its range"), (0, ""),
    (3, "SPRING failed"), (0, ""),
    (3, "stops at time .* WELL is put out of its range"), (0, ""),
    (3, "WELL failed"), (0, ""),
]


@pytest.fixture(scope="module")
def hosts(installed: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    programs = {}
    for language, (compiler, source, *options) in COMPILERS.items():
        programs[language] = tmp_path_factory.mktemp("hosts")/"host_solid"
        build(compiler, HERE/source, programs[language], installed, *options)
    return programs


def table(program: Path, env: dict[str, str], *arguments: str) -> np.ndarray:
    """Rows of time, total, kinetic, strain, potential, px, py, contacts."""
    return np.loadtxt(run(program, *arguments, env=env).splitlines())


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_energy_is_kept(
    hosts: dict[str, Path], installed: dict[str, str], formulation: str
) -> None:
    """Of a block that falls on a host's solid; and the same from all languages."""
    rows = {name: table(program, installed, formulation) for name, program in hosts.items()}
    c = rows["c"]
    total = c[0, 1]
    assert len(c) == 51 and total == pytest.approx(0.5*0.9*(1 + 0.3**2), rel=BOUND)
    for found in rows.values():
        assert np.abs(found[:, 1]/total - 1).max() <= 1e-12
        assert np.abs(found[:, 5]/c[0, 5] - 1).max() <= BOUND
        assert np.abs(found[:, 1:7] - c[:, 1:7]).max() <= BOUND*max(total, 1)
        assert np.array_equal(found[:, 7], c[:, 7])
    # It bounces, by contact, with energy in the block, the triangles and the bed.
    assert c[0, 6] == pytest.approx(-0.9, rel=BOUND) and c[:, 6].max() > 0.5
    assert c[:, 7].max() >= 2 and c[-1, 0] == pytest.approx(0.5, rel=BOUND)
    assert c[:, 3].max() > 0.05*total and c[:, 4].max() > 0.2*total


def test_hosts_are_told_what_is_wrong(hosts: dict[str, Path], installed: dict[str, str]) -> None:
    for program in hosts.values():
        with pytest.raises(AssertionError, match="error 2: .*solid:.*unknown.*FRICTIONAL"):
            run(program, "FRICTIONAL", env=installed)


@pytest.fixture(scope="module")
def bad(installed: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    program = tmp_path_factory.mktemp("bad")/"bad_given"
    build("cc", HERE/"bad_given.c", program, installed, "-std=c99")
    return program


def test_what_cannot_be_given(bad: Path, installed: dict[str, str], tmp_path: Path) -> None:
    text = run(bad, tmp_path/"given.h5", env=installed)
    calls = re.findall(r"^emcon_\w+\|(\d+)\|(.*)$", text, re.MULTILINE)
    expected = NOT_GIVEN + ARGUMENTS + GOING_WRONG
    assert len(calls) == len(expected) == len(text.splitlines())
    for (code, message), (wanted, pattern) in zip(calls, expected):
        assert int(code) == wanted, message
        assert re.search(pattern, message) if pattern else message == "", message


def examples(language: str) -> list[str]:
    """The blocks of docs/embedding.md that drive a model."""
    text = (ROOT/"docs"/"embedding.md").read_text(encoding="utf-8")
    return [block for block in re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)
            if "interface" not in block and "emcon_new" not in block]


def run_example(source: Path, compiler: str, standard: str, env: dict[str, str]) -> None:
    shutil.copy(ROOT/"input_decks"/"ring.inp", source.parent)
    build(compiler, source, source.with_suffix(""), env, standard, f"-I{HERE}")
    assert run(source.with_suffix(""), env=env, cwd=source.parent) == ""


def test_examples_of_the_docs_in_c(installed: dict[str, str], tmp_path: Path) -> None:
    opening, giving = examples("c")
    (tmp_path/"opening.c").write_text("""
#include <emcon.h>
#include <stdio.h>
int main(void)
{
   emcon_progress progress = NULL;
   emcon_log show = NULL;
   void *user = NULL;
""" + opening + "return status;\n}\n")
    run_example(tmp_path/"opening.c", "cc", "-std=c99", installed)
    (tmp_path/"giving.c").write_text("""
#define main main_of_host
#include "host_solid.c"
#undef main
int main(int argc, char **argv)
{
   static struct host host;
   static char deck[100*N_NODE + 2000];
   const int foot[] = {0, 1, 2, 3, 4, 5, 6}, n_foot = NX + 1;
   int status;
   emcon_csr mass = {N_NODE, N_NODE, host.start, host.column, host.mass};
   emcon_csr pattern = {2*N_NODE, 2*N_NODE, host.start2, host.column2, NULL};
   emcon_model *model;
   make_mesh(&host);
   make_matrices(&host);
   write_deck(&host, "MORTAR", 0.05, deck);
""" + giving + "emcon_close(model);\nreturn argc > 1 ? main_of_host(argc, argv) : status;\n}\n")
    run_example(tmp_path/"giving.c", "cc", "-std=c99", installed)


def test_examples_of_the_docs_in_fortran(installed: dict[str, str], tmp_path: Path) -> None:
    opening, giving = examples("fortran")
    source = tmp_path/"opening.f90"
    source.write_text(f"program opening\n{opening}if (allocated(error)) stop 1\n"
                      "end program opening\n")
    run_example(source, "gfortran", "-std=f2008", installed)
    assert textwrap.indent(giving, "   ") in (HERE/"fortran_solid.f90").read_text()
