"""Off means off: what a scene does not need is not called, and nothing is set up anew that stays.

Calls and allocations of the program itself, counted by valgrind from the beginning of an increment
to that of the next. Modules are counted by the folder they stand in.
"""

import collections
import pathlib
import re
import shutil
import subprocess

import pytest
from emcon import Stepper
from plain_scenes import AUTO, Scene
from scene_tools import PROGRAM, ROOT, run_deck

pytestmark = pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind counts calls")

SHORT, LONG = 4, 8
INCREMENT = "__emcon_march_MOD_march_increment"
FOLDER = {path.stem: path.parent.name for path in (ROOT/"src_f90").glob("*/*.f90")}

DECK = """
*NODE, NSET=ALL
{nodes}
*ELEMENT, TYPE=CPE4, ELSET=BLOCK
{elements}
*MATERIAL, NAME=M
*HYPERELASTIC, COUPLED NEO HOOKE
100., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=BLOCK, MATERIAL=M{section}
1.
*INITIAL CONDITIONS, TYPE=VELOCITY
1, 1, 0.5
*STEP, NLGEOM
{procedure}
{cards}
*NODE FILE, FREQUENCY=0
U
*END STEP
"""


def block(n, *cards, section="", procedure="*DYNAMIC, DIRECT\n0.01, {end}"):
    """A free block of n by n elements, and what a step says of it."""
    nodes = "\n".join(f"{1 + i + j*(n + 1)}, {i/n}, {j/n}"
                      for j in range(n + 1) for i in range(n + 1))
    elements = "\n".join(
        f"{1 + i + j*n}, {first}, {first + 1}, {first + n + 2}, {first + n + 1}"
        for j in range(n) for i in range(n) for first in [1 + i + j*(n + 1)])
    return DECK.format(nodes=nodes, elements=elements, section=section, procedure=procedure,
                       cards="\n".join(cards) or "**")


def counted(path):
    """Calls of each function, and allocations that each function makes itself."""
    names, calls, made = {}, collections.Counter(), collections.Counter()
    caller = callee = ""

    def named(text):
        number, name = re.match(r"\((\d+)\) ?(.*)", text).groups()
        return names.setdefault(number, name)

    for line in path.read_text().splitlines():
        if line.startswith("fn="):
            caller = named(line[3:])
        elif line.startswith("cfn="):
            callee = named(line[4:])
        elif line.startswith("calls="):
            n = int(line[6:].split()[0])
            calls[callee] += n
            if callee in ("malloc", "calloc", "realloc"):
                made[caller] += n
    return calls, made


def module(function):
    """The module of a Fortran procedure, or nothing."""
    found = re.match(r"__(?:emcon_\w+\.)?(emcon_\w+?)_MOD_", function)
    return found[1] if found else ""


def run_counted(text, n, folder, *options):
    """Calls and allocations of a run of `n` increments; the file they are in has the suffix .calls."""
    deck = pathlib.Path(folder)/f"deck{n}.inp"
    deck.write_text(text.replace("{end}", f"{n/100}"))
    out = deck.with_suffix(".calls")
    subprocess.run(["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", *options,
                    str(PROGRAM), str(deck), "--quiet", "--output", str(folder)], check=True,
                   capture_output=True, timeout=120)
    return counted(out)


def per_increment(text, folder):
    """Calls by function, and allocations by function, of one increment: those after the first few."""
    run_counted(text, LONG, folder, f"--dump-before={INCREMENT}")
    # Part k ends where increment k begins.
    parts = [counted(pathlib.Path(folder)/f"deck{LONG}.calls.{k}")
             for k in range(SHORT + 2, LONG + 1)]
    sums = [sum(kind, collections.Counter()) for kind in zip(*parts, strict=True)]
    return [{name: n/len(parts) for name, n in counts.items()} for counts in sums]


def called(calls, *modules):
    """The procedures of these modules that are called."""
    return sorted(name for name in calls if module(name) in modules)


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return per_increment(block(3), tmp_path_factory.mktemp("plain"))


def test_without_a_pair_no_code_of_contact_runs(plain):
    calls, _ = plain
    assert calls[INCREMENT] == 1 and called(calls, "emcon_march_commit") and called(calls, "emcon_solid_term")
    contact = [name for name in FOLDER if FOLDER[name] == "contact"]
    assert called(calls, *contact) == []
    sets = {"constraints_select", "constraints_evaluate", "constraints_rows", "linearise"}
    assert not [name for name in calls if name.split("_MOD_")[-1] in sets]
    assert not called(calls, "emcon_layer", "emcon_layer_push", "emcon_velocity_update",
                      "emcon_velocity_mass", "emcon_rate_jump", "emcon_gaps",
                      "emcon_contact_support_gaps", "emcon_overclosure")


def test_without_a_tie_nothing_is_eliminated(plain):
    calls, _ = plain
    assert not called(calls, "emcon_null_space", "emcon_null_basis", "emcon_dependent_block",
                      "emcon_independent_rows", "emcon_row_elimination", "emcon_triple_product",
                      "emcon_saddle_point", "emcon_linear_conditions", "emcon_rigidity")


def test_what_is_constant_is_made_once(plain):
    """Mass, patterns, numbering, orderings: not once per increment."""
    calls, _ = plain
    once = {"add_up", "inertia_init", "csr_from_elements", "solid_init", "system_begin_step",
            "space_begin_step", "umf_di_symbolic", "umfpack_di_symbolic", "amd_order", "tree_build",
            "solver_create", "factorise_mass", "bodies_find", "scene_report"}
    assert not [name for name in calls if name.split("_MOD_")[-1] in once]


def test_nothing_is_computed_for_output_that_nobody_asks_for(plain):
    calls, _ = plain
    assert not called(calls, "emcon_quantities", "emcon_stress", "emcon_restart",
                      "emcon_restart_data")
    assert not [name for name in calls if name.endswith(("vtkhdf_write", "begin_frame"))]


@pytest.mark.long
def test_rows_and_frames_are_gathered(tmp_path):
    """They go to the library of files many at a time, and restart files are not written anew at
    once: on its own pace this happens a few times in a run, however short the increments are."""
    n = 60
    text = block(3, "*RESTART, WRITE, FREQUENCY=1").replace("*NODE FILE, FREQUENCY=0\nU",
                                                            "*NODE FILE\nU, V\n*EL FILE\nS")
    calls, _ = run_counted(text, n, tmp_path)
    assert calls["__emcon_vtkhdf_MOD_vtkhdf_end_frame"] == n + 1
    assert 2 <= calls["__emcon_restart_MOD_restart_write"] < n/2
    per_row = len(next((tmp_path/f"deck{n}.csv").open()).split(","))
    assert calls["__emcon_hdf5_series_MOD_series_append"] > n*per_row
    assert calls["__emcon_hdf5_series_MOD_write_rows"] < n*per_row/2


def test_an_increment_allocates_for_its_record_alone(plain):
    """Rows of the history, lines of the log, and the residuals that the log tells. What is left is
    made by the libraries of solvers and files."""
    _, made = plain
    own = {name: n for name, n in made.items() if module(name) and n > 0}
    assert sum(n for name, n in own.items() if FOLDER[module(name)] in ("record", "results")) > 0
    others = {name: n for name, n in own.items()
              if FOLDER[module(name)] not in ("record", "results", "base")}
    assert others.pop("__emcon_march_commit_MOD_march_commit") == 1                # residuals
    assert not others


@pytest.mark.long
def test_allocations_do_not_grow_with_the_mesh(plain, tmp_path):
    """What the program itself allocates in an increment is as much for four times the elements."""
    _, made = plain
    _, finer = per_increment(block(6), tmp_path)
    # Numbers as text: how many are tried until one gives its digits depends on the number.
    own = [{name: n for name, n in some.items() if module(name) not in ("", "emcon_text")}
           for some in (made, finer)]
    grown = {name: (own[0].get(name, 0), n) for name, n in own[1].items()
             if n > own[0].get(name, 0) + 0.5}
    assert not grown


@pytest.mark.long
def test_a_linear_body_is_factorised_once(tmp_path):
    """Its matrix is symmetric and constant: by Cholesky, once in a run."""
    calls, _ = run_counted(block(3, section=", KINEMATICS=LINEAR"), LONG, tmp_path)
    assert calls[INCREMENT] == LONG
    assert calls["__emcon_supernodal_MOD_supernodal_factorise"] == 1
    assert "__emcon_umfpack_MOD_umfpack_analyse" not in calls


@pytest.mark.long
def test_statics_of_small_displacements_are_symmetric(tmp_path):
    procedure = "*STATIC, DIRECT\n0.01, {end}\n*BOUNDARY\n1, 1, 2\n4, 1, 2\n*CLOAD\n16, 1, 0.01"
    text = block(3, procedure=procedure).replace("NLGEOM", "INC=100").replace(
        "*INITIAL CONDITIONS, TYPE=VELOCITY\n1, 1, 0.5\n", "")
    calls, _ = run_counted(text, SHORT, tmp_path)
    assert calls["__emcon_supernodal_MOD_supernodal_factorise"] > 0
    assert "__emcon_umfpack_MOD_umfpack_analyse" not in calls


# ---- surfaces that are far apart ----------------------------------------------------------------


def bullet(speed, distance, looks=False):
    """A block that flies at another one; with `looks` it is looked where they are all the time."""
    scene = Scene(h=0.01, t_end=0.6)
    scene.block("TARGET", (0, 0), (1, 1), (4, 4), stiffness=1000.0)
    scene.block("TIP", (-0.5 - distance, 0.23), (0.5, 0.5), (2, 2), stiffness=1000.0,
                velocity=(speed, 0))
    deck = scene.deck(AUTO)
    deck.card[deck.find("*NODE FILE")] = ("*NODE FILE, FREQUENCY=0", ["U"])
    if not looks:
        deck.card[deck.find("*CONTACT FILE")] = ("*CONTACT FILE, FREQUENCY=0", ["CDIS"])
    return deck


def test_nothing_of_a_far_pair_is_called(tmp_path):
    """The judge and guards included: the increments after the first do not know of it, but for that
    a step begins."""
    deck = bullet(0.5, 50.0)
    deck.set_parameter("t_end", "{end}")
    calls, _ = per_increment(deck.text(), tmp_path)
    contact = [name for name in FOLDER if FOLDER[name] == "contact"]
    assert called(calls, *contact) == []
    assert called(calls, "emcon_gaps", "emcon_overlap_check") == ["__emcon_gaps_MOD_gaps_forget"]


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
def test_what_was_far_is_found_in_time(tmp_path, formulation):
    """At most a third of an edge per increment and at more: the same bits as where it is looked in
    every increment."""
    for speed in (8.0, 40.0):
        runs = [run_deck(bullet(speed, 0.3*speed, looks).write(tmp_path/f"{name}.inp"), tmp_path,
                         formulation=formulation)
                for looks, name in ((False, "passed"), (True, "looked"))]
        assert runs[0].digits() == runs[1].digits()
        passed, looked = (run.verdict["counts"]["searched"] for run in runs)
        assert passed < 0.8*looked
        assert runs[0].history["active"].max() > 0 == runs[0].history["active"][:29].max()


def test_what_was_far_is_found_after_going_back(tmp_path):
    """From a snapshot and from a restart file of the flight, the same bits."""
    def go(stepper):
        while stepper.time < 0.45:
            stepper.step()
        return stepper.u.tobytes(), stepper.v.tobytes()

    with Stepper(bullet(20.0, 6.0).write(tmp_path/"bullet.inp")) as flight:
        while flight.time < 0.2:
            flight.step()
        flight.write_restart(tmp_path/"bullet.rst.h5")
        there = flight.save()
        found = go(flight)
        assert flight.v[:25].any()                       # the target was hit
        flight.restore(there)
        assert go(flight) == found
    with Stepper.from_restart(tmp_path/"bullet.rst.h5") as resumed:
        assert go(resumed) == found
