"""Contact for host codes in C and C++, against the installed library, by pkg-config only."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from embed_tools import HERE, ROOT, build, check_memory, run

SOURCE = HERE/"interface_bars.c"
# 400 steps, each with a few roundings of the energy.
DRIFT = 400*np.finfo(float).eps

BAD_CALLS = """
#include <emcon_interface.h>
#include <math.h>
#include <stdio.h>

static void tell(emcon_interface *face, int status)
{
   const char *text = emcon_interface_message(face);

   printf("%d %s\\n", status, status && text ? text : "");
}

#define TELL(face, call) do { int status = call; tell(face, status); } while (0)

int main(void)
{
   double x[] = {0, 0, 1, 0, 1, 1, 0, 1}, u[8] = {0}, bad[8] = {0}, lam[] = {0, 0};
   int lower[] = {1, 0}, upper[] = {3, 2}, wrong[] = {1, 9}, held[8] = {0}, active[2] = {0};
   int contact[] = {1, 0}, surface, n, outcome, done;
   emcon_pair_options options = {0};
   emcon_interface_settings settings = {0};
   emcon_interface_sizes sizes;
   emcon_interface *face;
   emcon_csr d, m;
   emcon_interface_constraints values;

   TELL(NULL, emcon_interface_prepare(NULL, NULL));
   TELL(face, emcon_interface_new(-1, x, &face));
   emcon_interface_free(face);
   TELL(face, emcon_interface_new(4, NULL, &face));
   emcon_interface_free(face);
   bad[5] = NAN;
   TELL(face, emcon_interface_new(4, bad, &face));
   TELL(face, emcon_interface_add_surface(face, "any", 1, lower, &surface));
   TELL(face, emcon_interface_prepare(face, NULL));
   emcon_interface_free(face);
   TELL(face, emcon_interface_new(4, x, &face));
   TELL(face, emcon_interface_add_pair(face, 0, 1, EMCON_MORTAR, NULL));
   TELL(face, emcon_interface_add_surface(face, NULL, 1, wrong, &surface));
   TELL(face, emcon_interface_add_surface(face, NULL, 1, lower, &surface));
   TELL(face, emcon_interface_add_surface(face, "upper", 1, upper, &surface));
   TELL(face, emcon_interface_add_pair(face, surface, 2, EMCON_MORTAR, NULL));
   TELL(face, emcon_interface_add_pair(face, surface, 0, 9, NULL));
   options.normal_angle = 200;
   TELL(face, emcon_interface_add_pair(face, surface, 0, EMCON_MORTAR, &options));
   TELL(face, emcon_interface_add_tie(face, 1, 1, EMCON_DUAL, -1));
   TELL(face, emcon_interface_add_pair(face, surface, 0, EMCON_MORTAR, NULL));
   settings.gap_tolerance = -1;
   TELL(face, emcon_interface_set(face, &settings));
   held[3] = 7;
   TELL(face, emcon_interface_prepare(face, held));
   TELL(face, emcon_interface_begin_step(face, u, u, 2, active, active));
   TELL(face, emcon_interface_prepare(face, NULL));
   TELL(face, emcon_interface_prepare(face, NULL));
   TELL(face, emcon_interface_get_tie_matrices(face, 0, &d, &m));
   TELL(face, emcon_interface_evaluate(face, u, u, &values));
   TELL(face, emcon_interface_begin_step(face, u, bad, 2, active, active));
   TELL(face, emcon_interface_begin_step(face, u, u, 3, held, NULL));
   TELL(face, emcon_interface_begin_step(face, u, u, 2, active, active));
   TELL(face, emcon_interface_choose(face, u, u, 2, contact, lam));
   TELL(face, emcon_interface_get_curvature(face, 2, lam, &d));
   active[0] = 1;
   TELL(face, emcon_interface_select(face, u, u, 2, active, &n));
   TELL(face, emcon_interface_get_null_space(face, &d, &m, &n, NULL));
   TELL(face, emcon_interface_update_active(face, u, u, 2, lam, NULL, 2, active, &done, &outcome));
   TELL(face, emcon_interface_drop(face, 2, active, 2, active));
   u[4] = 100;
   u[6] = 100;
   TELL(face, emcon_interface_begin_step(face, u, u, 2, active, NULL));
   TELL(face, emcon_interface_select(face, u, u, 2, active, &n));
   TELL(face, emcon_interface_get_sizes(face, &sizes));
   printf("%d %d %d\\n", sizes.n_contact, sizes.n_unknown, sizes.n_selected);
   emcon_interface_free(face);
   emcon_interface_free(NULL);
   return 0;
}
"""
TOLD = [
    "2", "2 the size of x is -2", "2 x is NULL", "2 x[5] is not a finite number",
    "called before interface_init", "2 interface_prepare: called before interface_init", "0",
    "there is no surface yet", "2 edge[1] is 9, not in 0..3", "0", "0",
    "2 master is 2, not in 0..1", "formulation is 9, not in 1..3", "not in 0..180 degrees",
    "slave and master are both surface upper", "0", "gap_tolerance is negative",
    "held[3] is 7, neither 0 nor 1", "called before interface_prepare", "0",
    "called after interface_prepare", "2 tie is 0, but there are none",
    "before interface_begin_step", "du[5] is not a finite number",
    "was_active has 3 entries, not 2", "0",
    "contact[1] is 0 after 1", "lam has 2 entries, not 0", "0", "before interface_evaluate",
    "before interface_evaluate", "redundant[0] is 1, not in 0..0", "0",
    "constraint 0 (slave node 2 of pair 0) has no surface within reach", "0", "2 8 0",
]


@pytest.fixture(scope="module", params=["cc", "c++"])
def bars(request: pytest.FixtureRequest, installed: dict[str, str],
         tmp_path_factory: pytest.TempPathFactory) -> Path:
    program = tmp_path_factory.mktemp("bars")/"bars"
    options = ["-std=c99"] if request.param == "cc" else ["-x", "c++", "-std=c++11"]
    build(request.param, SOURCE, program, installed, *options)
    return program


def test_a_host_in_c_keeps_its_energy_through_an_impact(
    bars: Path, installed: dict[str, str]
) -> None:
    rows = [line.split() for line in run(bars, env=installed).splitlines()]
    assert len(rows) == 3
    for row in rows:
        steps, touching, drift, gap, pressure, before, after = map(float, row)
        assert 0 < touching < steps
        assert drift <= DRIFT
        assert gap >= 0 and pressure > 0
        assert before == -1 and after > 0.5


def test_the_example_of_the_docs(installed: dict[str, str], tmp_path: Path) -> None:
    text = (ROOT/"docs"/"embedding.md").read_text(encoding="utf-8")
    (example,) = [block for block in re.findall(r"```c\n(.*?)```", text, re.DOTALL)
                  if "emcon_interface_new" in block]
    source = tmp_path/"example.c"
    source.write_text("""
#include <emcon_interface.h>
#include <stdio.h>

int main(void)
{
   const double x[] = {0, 0, 1, 0, 1, 1, 0, 1};
   const int lower_edges[] = {1, 0}, upper_edges[] = {3, 2}, n_node = 4, n_lower = 1, n_upper = 1;
""" + example + "return status;\n}\n")
    build("cc", source, tmp_path/"example", installed, "-std=c99")
    assert run(tmp_path/"example", env=installed) == ""


def test_memory_of_a_host_in_c(bars: Path, installed: dict[str, str]) -> None:
    """The impact is over after 100 steps."""
    check_memory(installed, bars, "100")


def test_bad_calls_from_c_are_told_in_words(installed: dict[str, str], tmp_path: Path) -> None:
    source = tmp_path/"bad_calls.c"
    source.write_text(BAD_CALLS)
    program = tmp_path/"bad_calls"
    build("cc", source, program, installed, "-std=c99")
    lines = run(program, env=installed).splitlines()
    assert len(lines) == len(TOLD), lines
    for line, text in zip(lines, TOLD):
        assert text in line and (line[0] == "0") == (text == "0") or text == line, (line, text)
    check_memory(installed, program)
