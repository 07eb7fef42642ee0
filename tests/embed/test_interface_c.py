"""Contact for host codes in C and C++, against the installed library, by pkg-config only."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from embed_tools import HERE, ROOT, build, run

# 400 steps, each with a few roundings of the energy.
DRIFT = 400*np.finfo(float).eps

BAD_CALLS = """
#include <emcon.h>
#include <math.h>
#include <stdio.h>

static void tell(emcon_model *face, int status)
{
   const char *text = emcon_message(face);

   printf("%d %s\\n", status, status && text ? text : "");
}

#define TELL(face, call) do { int status = call; tell(face, status); } while (0)

int main(void)
{
   double x[] = {0, 0, 1, 0, 1, 1, 0, 1}, u[8] = {0}, bad[8] = {0}, lam[] = {0, 0};
   int lower[] = {1, 0}, upper[] = {3, 2}, wrong[] = {1, 9}, held[8] = {0}, active[2] = {0};
   int contact[] = {1, 0}, surface, n, outcome, done;
   emcon_pair_options options = {0};
   emcon_contact_settings settings = {0};
   emcon_sizes sizes;
   emcon_model *face;
   emcon_csr d, m;
   emcon_constraint_report values;

   TELL(NULL, emcon_hold(NULL, 4, held));
   TELL(face, emcon_new(-1, 2, x, &face));
   emcon_close(face);
   TELL(face, emcon_new(4, 2, NULL, &face));
   emcon_close(face);
   bad[5] = NAN;
   TELL(face, emcon_new(4, 2, bad, &face));
   TELL(face, emcon_add_surface(face, "any", 1, lower, &surface));
   TELL(face, emcon_build(face));
   emcon_close(face);
   TELL(face, emcon_new(4, 2, x, &face));
   TELL(face, emcon_add_pair(face, 0, 1, EMCON_MORTAR, NULL));
   TELL(face, emcon_add_surface(face, NULL, 1, wrong, &surface));
   TELL(face, emcon_add_surface(face, NULL, 1, lower, &surface));
   TELL(face, emcon_add_surface(face, "upper", 1, upper, &surface));
   TELL(face, emcon_add_pair(face, surface, 2, EMCON_MORTAR, NULL));
   TELL(face, emcon_add_pair(face, surface, 0, 9, NULL));
   options.normal_angle = 200;
   TELL(face, emcon_add_pair(face, surface, 0, EMCON_MORTAR, &options));
   TELL(face, emcon_add_tie(face, 1, 1, EMCON_DUAL, -1));
   TELL(face, emcon_add_pair(face, surface, 0, EMCON_MORTAR, NULL));
   settings.gap_tolerance = -1;
   TELL(face, emcon_set_contact(face, &settings));
   TELL(face, emcon_begin_contact(face, 4, u, u, 2, active, active));
   TELL(face, emcon_build(face));
   TELL(face, emcon_build(face));
   TELL(face, emcon_hold(face, 4, held));
   TELL(face, emcon_step(face, 0.1, NULL));
   TELL(face, emcon_advance(face, NULL));
   TELL(face, emcon_save(face, "none.h5"));
   TELL(face, emcon_get_tie_matrices(face, 0, &d, &m));
   TELL(face, emcon_evaluate_contact(face, 4, u, u, &values));
   TELL(face, emcon_begin_contact(face, 4, u, bad, 2, active, active));
   TELL(face, emcon_begin_contact(face, 4, u, u, 3, held, NULL));
   TELL(face, emcon_begin_contact(face, 4, u, u, 2, active, active));
   TELL(face, emcon_choose(face, 4, u, u, 2, contact, lam));
   TELL(face, emcon_curvature(face, 2, lam, &d));
   active[0] = 1;
   TELL(face, emcon_select(face, 4, u, u, 2, active, &n));
   TELL(face, emcon_null_space(face, &d, &m, &n, NULL));
   TELL(face, emcon_update_active(face, 4, u, u, 1, lam, NULL, 2, active, &done, &outcome));
   TELL(face, emcon_drop(face, 2, active, 2, active));
   TELL(face, emcon_constraints(face, 4, u, u, 0, &values));
   TELL(face, emcon_get_gaps(face, 4, u, u, 2, NULL));
   u[4] = 100;
   u[6] = 100;
   TELL(face, emcon_begin_contact(face, 4, u, u, 2, active, NULL));
   TELL(face, emcon_select(face, 4, u, u, 2, active, &n));
   TELL(face, emcon_get_sizes(face, &sizes));
   printf("%d %d %d\\n", sizes.n_contact, sizes.n_unknown, sizes.n_selected);
   emcon_close(face);
   emcon_close(NULL);
   return 0;
}
"""
TOLD = [
    "2", "2 n_node is -1, below 0", "2 x is NULL", "2 x is not finite at node 3",
    "there is no scene", "there is no scene", "0",
    "2 slave is 1, but there are none", "2 edge(2, 1) is 10, not in 1..4", "0", "0",
    "2 master is 3, not in 1..2", "formulation is 9, not in 1..3",
    "normal_angle is 200, above 180", "slave and master are both surface upper", "0",
    "gap_tolerance is -1, below 0", "not built yet", "0", "built already",
    "given before the model is built", "its host makes the steps", "its host makes the steps",
    "its host makes the steps", "2 tie is 1, but there are none", "no step of contact was begun",
    "du is not finite at node 3", "n_constraint is 3, but the model has 2", "0",
    "constraint 1 comes after 2", "n_selected is 2, but the model has 0", "0",
    "constraints were selected", "no constraints were evaluated", "redundant is 2, not in 1..1",
    "0", "no step of contact was begun", "0",
    "constraint 1 (slave node 3 of pair 1) has no surface within reach", "0", "2 8 0",
]


@pytest.fixture(scope="module", params=["cc", "c++"])
def bars(request: pytest.FixtureRequest, installed: dict[str, str],
         tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The same trusses: a step by one call, and by all calls one by one."""
    folder = tmp_path_factory.mktemp("bars")
    options = ["-std=c99"] if request.param == "cc" else ["-x", "c++", "-std=c++11"]
    for name in ("interface_bars", "contact_loop"):
        build(request.param, HERE/f"{name}.c", folder/name, installed, *options)
    return {name: folder/name for name in ("interface_bars", "contact_loop")}


def test_a_host_in_c_keeps_its_energy_through_an_impact(
    bars: dict[str, Path], installed: dict[str, str]
) -> None:
    """Candidates condensed by the library, and multipliers solved for by the host: the same to round-off."""
    rows = [line.split() for line in run(bars["contact_loop"], env=installed).splitlines()]
    assert len(rows) == 3
    for formulation, row in enumerate(rows, 1):
        steps, touching, drift, gap, pressure, before, after = map(float, row)
        assert 0 < touching < steps
        assert drift <= DRIFT
        assert gap >= 0 and pressure > 0
        assert before == -1 and after > 0.5
        steps_there, touching_there, drift_there, push, after_there = map(
            float, run(bars["interface_bars"], formulation, env=installed).split())
        assert (steps_there, touching_there) == (steps, touching)
        assert drift_there <= DRIFT and push > 0
        assert after_there == pytest.approx(after, abs=DRIFT)


def test_the_example_of_the_docs(installed: dict[str, str], tmp_path: Path) -> None:
    text = (ROOT/"docs"/"embedding.md").read_text(encoding="utf-8")
    (example,) = [block for block in re.findall(r"```c\n(.*?)```", text, re.DOTALL)
                  if "emcon_new" in block]
    source = tmp_path/"example.c"
    source.write_text("""
#include <emcon.h>
#include <stdio.h>

int main(void)
{
   const double x[] = {0, 0, 1, 0, 1, 1, 0, 1};
   const int lower_edges[] = {1, 0}, upper_edges[] = {3, 2}, n_node = 4, n_lower = 1, n_upper = 1;
""" + example + "return status;\n}\n")
    build("cc", source, tmp_path/"example", installed, "-std=c99")
    assert run(tmp_path/"example", env=installed) == ""


def test_bad_calls_from_c_are_told_in_words(installed: dict[str, str], tmp_path: Path) -> None:
    source = tmp_path/"bad_calls.c"
    source.write_text(BAD_CALLS)
    program = tmp_path/"bad_calls"
    build("cc", source, program, installed, "-std=c99")
    lines = run(program, env=installed).splitlines()
    assert len(lines) == len(TOLD), lines
    for line, text in zip(lines, TOLD):
        assert text in line and (line[0] == "0") == (text == "0") or text == line, (line, text)
