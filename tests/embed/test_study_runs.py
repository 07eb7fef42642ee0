"""Whole studies: of a bar that falls, freely in closed form or onto a floor."""

from __future__ import annotations

import concurrent.futures
import contextlib
import csv
import io
import json
import os
import re
import shutil
import signal
import stat
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from emcon.__main__ import main
from emcon.mesh import block
from emcon.study.deck import DeckFile, read_deck
from emcon.study.execution import RECORD, Task, call, record_of, run_member
from emcon.study.plan import Member
from python_doc import PAGES, examples

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("EMCON", ROOT/"build"/"release"/"emcon"))
BAR = ROOT/"input_decks"/"bouncing_bar.inp"
RING = ROOT/"input_decks"/"ring.inp"
SINGLE = ROOT/"build"/"release-single"/"emcon"
EPSILON = np.finfo(float).eps
#: Of one study [s].
LONGEST = 300


def study(folder: Path, *options: object, deck: Path = BAR, code: int = 0,
          is_apart: bool = False) -> subprocess.CompletedProcess[str]:
    """The command, within this process; with `is_apart` in one of its own, as from a shell."""
    if "--figures" not in options:
        options = (*options, "--no-figures")
    line = command(deck, *(option for option in options if option != "--figures"))
    if is_apart:
        done = subprocess.run(line, cwd=folder, env=ENVIRONMENT, text=True, capture_output=True,
                              timeout=LONGEST)
    else:
        out, err = io.StringIO(), io.StringIO()
        with contextlib.chdir(folder), contextlib.redirect_stdout(out), \
                contextlib.redirect_stderr(err):
            try:
                found = main(line[3:])
            except SystemExit as end:                    # of the parser
                found = end.code
        done = subprocess.CompletedProcess(line, found, out.getvalue(), err.getvalue())
    assert done.returncode == code, done.stdout + done.stderr
    assert "Traceback" not in done.stderr, done.stderr
    return done


def command(deck: Path, *options: object) -> list[str]:
    return [sys.executable, "-m", "emcon", "study", str(deck), "--output", "study",
            "--program", str(PROGRAM), *map(str, options)]


ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT/"pywrap"), "MPLBACKEND": "agg"}


def table(folder: Path) -> list[dict[str, str]]:
    with (folder/"study"/"table.csv").open() as file:
        return list(csv.DictReader(file))


def stamps(folder: Path) -> dict[str, int]:
    """When each whole member was written; one in work has the name of a part."""
    return {p.parent.name: p.stat().st_mtime_ns
            for p in (folder/"study"/"members").glob(f"*/{RECORD}") if ".part-" not in p.parent.name}


FREE = ("--vary", "h=0.1,0.05", "--set", "t_end=0.5", "--set", "frame=0.5")


@pytest.fixture(scope="module")
def free(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A fall of half a time unit, g = 10, held against closed forms, and on two meshes."""
    folder = tmp_path_factory.mktemp("free")
    values = {"rebound_1": [0.0, -5.0], "position_1": [0.0, -1.25], "momentum": [0.0, -50.0],
              "rigid_energy_1": 125.0, "vibration": 0.0, "impulse": [0.0, 0.0], "force": 0.0}
    (folder/"closed.json").write_text(json.dumps(values))
    done = study(folder, *FREE, "--vary", "mesh=1,2", "--reference", "closed-form:closed.json",
                 "--reference", "finest", "--goal", "rebound:1e-9", "--figures")
    return folder, done.stdout


@pytest.mark.long
def test_a_free_fall_has_no_error(free: tuple[Path, str]) -> None:
    """The scheme is exact for it: errors are rounding, of sums over fifty elements."""
    folder, text = free
    rows = table(folder)
    assert [row["status"] for row in rows] == ["done"]*len(rows)
    for row in rows:
        for name in ("rebound", "position", "momentum", "rigid_energy", "vibration", "impulse",
                     "force"):
            assert float(row[f"error_closed-form_{name}"]) < 1e5*EPSILON, name
    assert "the cheapest setting is" in text and "rebound to" in text


def box_deck() -> str:
    """A box above another one that is held; it falls with a speed to the side, and has not landed at .2."""
    mesh = (block((0.1, 0.05, 0.5), (0.8, 0.8, 0.6), (1, 1, 1), "UP", kind="C3D8")
            + block((0.0, 0.0, -0.6), (1.0, 1.0, 0.6), (1, 1, 1), "LO", kind="C3D8"))
    return ("*HEADING\nboxes\n*PARAMETER\nh = 0.05\nt_end = 0.2\n" + mesh.text()
            + "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n*DENSITY\n2.\n*SOLID SECTION, ELSET=UP, MATERIAL=M\n"
            "*SOLID SECTION, ELSET=LO, MATERIAL=M\n*SURFACE INTERACTION, NAME=I\n*CONTACT PAIR, INTERACTION=I\n"
            "UP_BACK, LO_FRONT\n*BOUNDARY\nLO, 1, 3\n*INITIAL CONDITIONS, TYPE=VELOCITY\nUP, 1, 0.5\nUP, 2, 0.25\n"
            "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n<h>, <t_end>\n*DLOAD\nUP, GRAV, 10., 0., 0., -1.\n"
            "*NODE FILE\nU\n*CONTACT FILE\nCSTR\n*CONTACT PRINT, TOTALS=ONLY\nCF\n*END STEP\n")


def test_a_free_fall_in_space_has_no_error(tmp_path: Path) -> None:
    """Of a box of mass .768, of two meshes, against closed forms in three components."""
    (tmp_path/"box.inp").write_text(box_deck())
    mass = 2*0.8*0.8*0.6
    values = {"rebound_1": [0.5, 0.25, -2.0], "position_1": [0.1, 0.05, -0.2],
              "momentum": [0.5*mass, 0.25*mass, -2.0*mass], "impulse": [0.0, 0.0, 0.0],
              "rigid_energy_1": 0.5*mass*(0.25 + 0.0625 + 4.0), "vibration": 0.0, "force": 0.0}
    (tmp_path/"closed.json").write_text(json.dumps(values))
    study(tmp_path, "--vary", "h=0.1,0.05", "--vary", "mesh=1,2", "--reference", "closed-form:closed.json",
          "--goal", "rebound:1e-9", deck=tmp_path/"box.inp")
    rows = table(tmp_path)
    assert [row["status"] for row in rows] == ["done"]*4 and len({row["mesh"] for row in rows}) == 2
    for row in rows:
        assert float(row["rebound_1_z"]) == pytest.approx(-2.0, rel=1e5*EPSILON)
        for name in ("rebound", "position", "momentum", "rigid_energy", "vibration", "impulse", "force"):
            assert float(row[f"error_closed-form_{name}"]) < 1e5*EPSILON, name


def test_members_on_two_meshes_share_nodes(free: tuple[Path, str]) -> None:
    rows = table(free[0])
    assert {row["mesh"] for row in rows} >= {"1", "2"}
    errors = [float(row["error_finest_displacement"]) for row in rows]
    assert max(errors) < 1e5*EPSILON                     # and so it was found on each mesh


def test_the_two_tables_agree(free: tuple[Path, str]) -> None:
    rows = table(free[0])
    with h5py.File(free[0]/"study"/"table.h5") as file:
        assert set(file) == set(rows[0])
        for name in file:
            column = file[name][()]
            if column.dtype.kind == "f":
                expected = np.array([float(row[name] or "nan") for row in rows])
                assert np.array_equal(column, expected, equal_nan=True), name
            else:
                assert [v.decode() for v in column] == [row[name] for row in rows], name


def test_pictures_and_words_are_there(free: tuple[Path, str]) -> None:
    folder, text = free
    for name in ("work_closed-form", "work_finest", "steps_finest"):
        assert (folder/"study"/f"{name}.png").read_bytes()[:4] == b"\x89PNG", name
    assert (folder/"study"/"report.txt").read_text() in text


def test_whole_members_are_not_run_again(free: tuple[Path, str]) -> None:
    folder, _ = free
    before = stamps(folder)
    done = study(folder, *FREE, "--vary", "mesh=1,2")
    assert "4 members, 4 done; 4 of them were there" in done.stdout
    assert stamps(folder) == before


# --- goals and references ----------------------------------------------------------------------

def test_errors_of_the_impact_and_a_goal_too_far(tmp_path: Path) -> None:
    """A goal below what the reference is certain of is not met, and the text says so."""
    done = study(tmp_path, "--vary", "h=0.02,0.01,0.005", "--set", "t_end=1.5",
                 "--goal", "rebound:1e-13", "--goal", "displacement:1", code=1)
    text = " ".join(done.stdout.split())
    assert "goal rebound:1e-13: not met. The best" in text and "times the goal" in text
    assert "The uncertainty of the reference is larger than the goal in rebound" in text
    assert "goal displacement:1: the cheapest setting is h=" in text
    assert "goal rebound:1e-13 and displacement:1: not met" in text
    rows = table(tmp_path)
    finest = min(rows, key=lambda row: float(row["h"]))
    assert float(finest["impulse_y"]) > 0.0
    assert all(float(row["energy"]) < 1e-12 for row in rows)


def test_the_contact_of_the_bar_is_measured(tmp_path: Path) -> None:
    """The first impact in closed form, and what its measures are by each other."""
    h, front = 0.005, 2*0.2/30                           # the wave front is some two elements wide
    study(tmp_path, "--vary", f"h=0.03,{h}", "--vary", "initiation=MASSLESS,PERSISTENT",
          "--set", "t_end=2")
    found = {(row["h"], row["initiation"]): {name: float(value) for name, value in row.items()
                                             if re.fullmatch(r"-?[\d.]+(e-?\d+)?", value)}
             for row in table(tmp_path)}
    smooth = found[f"{h}", "MASSLESS"]
    slack = 2*h + front
    assert smooth["switches"] == 2.0
    assert smooth["duration"] == pytest.approx(2/3, abs=slack)
    # of a width of 1, all of it in contact
    mean = smooth["impulse_y"]/smooth["duration"]
    assert smooth["mean_pressure"] == pytest.approx(mean, rel=1e-12)
    assert mean == pytest.approx(400.0, rel=slack/(2/3))
    assert smooth["penetration"] < 64*15/0.2*EPSILON     # heights up to 15 over the edge
    # m = 10, the centre above x = 0.5; what gravity, 10, has done is in motion and strain
    p = smooth["momentum_y"]
    assert smooth["rebound_1_y"] == pytest.approx(p/10, rel=1e-12)
    assert smooth["angular_momentum"] == pytest.approx(0.5*p, rel=1e-10)
    assert smooth["rigid_energy_1"] == pytest.approx(p**2/20, rel=1e-10)
    assert smooth["rigid_energy_1"] + smooth["vibration"] == pytest.approx(
        -100*smooth["position_1_y"], rel=1e-10)
    # held where it was at 0.99, when the next increment would have met the floor; its edge is 1
    assert found["0.03", "PERSISTENT"]["stand_off"] == pytest.approx(5 - 5*0.99**2, rel=1e-8)


def test_each_treatment_has_its_own_limit(tmp_path: Path) -> None:
    study(tmp_path, "--vary", "h=0.02,0.01", "--vary", "initiation=MASSLESS,PERSISTENT", "--set",
          "t_end=1.5")
    found = {(row["h"], row["initiation"]): row for row in table(tmp_path)}

    def apart(other: str) -> float:
        """Of the impulse of `PERSISTENT` from the finer run of a treatment."""
        one, two = (float(found[key]["impulse_y"]) for key in (("0.02", "PERSISTENT"),
                                                               ("0.01", other)))
        return abs(one/two - 1.0)

    row = found["0.02", "PERSISTENT"]
    assert float(row["error_finest_impulse"]) == pytest.approx(apart("MASSLESS"), rel=1e-9)
    assert float(row["own_impulse"]) == pytest.approx(apart("PERSISTENT"), rel=1e-9)
    assert abs(apart("MASSLESS")/apart("PERSISTENT") - 1.0) > 1e-3


def test_pressure_of_the_patch(tmp_path: Path) -> None:
    """10 at all nodes, on an edge of 2 that Poisson's ratio makes longer; a study of statics."""
    force = 10*2*1.00560920918586
    (tmp_path/"closed.json").write_text(json.dumps({"peak_pressure": 10, "peak_force": force}))
    study(tmp_path, "--vary", "formulation=MORTAR", "--reference", "closed-form:closed.json",
          deck=ROOT/"input_decks"/"contact_patch.inp")
    (row,) = table(tmp_path)
    for name in ("peak_pressure", "peak_force"):
        assert float(row[f"error_closed-form_{name}"]) < 1e-12, name


def test_the_cost_may_be_that_of_the_increments(tmp_path: Path) -> None:
    """A fall of one increment is all start and reading."""
    options = ("--vary", "h=0.5,0.005", "--set", "t_end=0.5", "--set", "frame=0.5", "--goal",
               "position:1e-9")
    text = study(tmp_path, *options, "--cost", "increments").stdout
    assert "CPU times of the increments alone" in text
    one, many = table(tmp_path)
    for row in (one, many):
        assert 0.0 < float(row["increments_cpu"]) < float(row["cpu"])
    whole, parts = (float(many[name])/float(one[name]) for name in ("cpu", "increments_cpu"))
    assert parts > whole
    told = re.search(r"cheapest setting is h=0.5: ([\d.e-]+) s.*?([\d.]+) times cheaper", text)
    assert told and float(told[1]) == pytest.approx(float(one["increments_cpu"]), rel=5e-3)
    assert float(told[2]) == pytest.approx(parts, rel=0.05)
    again = study(tmp_path, *options).stdout             # the same runs, another price
    assert "2 of them were there" in again and "of the increments alone" not in again


@pytest.mark.skipif(not SINGLE.exists(), reason="make app PRECISION=single")
def test_displacements_of_single_precision(tmp_path: Path) -> None:
    """Its places and times are rounded, and are those of the others all the same."""
    study(tmp_path, *FREE, "--vary", "precision=double,single", "--single-program", SINGLE)
    rows = [row for row in table(tmp_path) if row["precision"] == "single"]
    errors = [float(row["error_finest_displacement"]) for row in rows]
    single = float(np.finfo(np.float32).eps)
    # heights of 15 are rounded each increment, displacements are 1.25
    assert len(errors) == 2 and all(0.0 < error < 10*15/1.25*single for error in errors)


def test_a_refined_mesh_of_the_ring(tmp_path: Path) -> None:
    study(tmp_path, "--vary", "h=0.1", "--set", "t_end=0.2", "--set", "frame=0.1",
          "--reference", "refined-mesh", deck=RING)
    rows = table(tmp_path)
    assert [row["mesh"] for row in rows] == ["", "2"]
    assert all(row["status"] == "done" and row["verdict"] == "good" for row in rows)
    # both are of one ring: its displacements differ by a bit of the discretisation
    assert 0.0 < float(rows[0]["error_refined-mesh_displacement"]) < 0.1


def test_another_run_as_reference(tmp_path: Path) -> None:
    subprocess.run([PROGRAM, BAR, "--quiet", "--output", tmp_path, "--set=h=0.01",
                    "--set=t_end=0.5"], check=True)
    study(tmp_path, "--vary", "h=0.01", "--set", "t_end=0.5", "--reference", "file:bouncing_bar")
    (row,) = table(tmp_path)
    errors = {name: float(value) for name, value in row.items()
              if name.startswith("error_file_") and value}
    assert len(errors) > 8 and "error_file_displacement" in errors
    own = {"error_file_energy", "error_file_penetration", "error_file_stand_off"}
    assert all(error == 0.0 for name, error in errors.items() if name not in own)


def test_a_program_of_another_precision(tmp_path: Path) -> None:
    """It runs the finest setting once more; here the program is the same: nothing differs."""
    done = study(tmp_path, *FREE, "--reference", "quad", "--quad-program", PROGRAM)
    rows = table(tmp_path)
    assert [(row["role"], row["h"]) for row in rows] == [
        ("member", "0.1"), ("member", "0.05"), ("quad", "0.05")]
    assert float(rows[1]["error_quad_displacement"]) == 0.0
    assert "reference quad: quadruple precision at h=0.05" in done.stdout


def test_decks_and_precisions_are_knobs(tmp_path: Path) -> None:
    """Files beside the deck, and programs; of a heavier bar each falls as the other."""
    text = BAR.read_text()
    (tmp_path/"bar.inp").write_text(text)
    (tmp_path/"heavy.inp").write_text(text.replace("*DENSITY\n1.", "*DENSITY\n2."))
    asked = (*FREE, "--vary", "deck=bar.inp,heavy.inp", "--vary", "precision=double,single",
             "--single-program", PROGRAM, "--goal", "position:1e-6")
    study(tmp_path, *asked, deck=tmp_path/"bar.inp")
    rows = table(tmp_path)
    found = {(row["deck"], row["precision"], row["h"]): float(row["momentum_y"])
             for row in rows if row["role"] == "member"}
    assert len(found) == 8
    for (deck, _, _), momentum in found.items():
        assert abs(momentum/(-50.0 if deck == "bar.inp" else -100.0) - 1.0) < 1e-12
    assert [row["deck"] for row in rows if row["role"] == "default"] == ["bar.inp"]
    (tmp_path/"third.inp").write_text(text)              # decks may be added, not changed
    more = [str(option).replace("heavy.inp", "heavy.inp,third.inp") for option in asked]
    assert "were there" in study(tmp_path, *more, deck=tmp_path/"bar.inp").stdout
    error = study(tmp_path, *FREE, deck=tmp_path/"third.inp", code=2).stderr
    assert "third.inp, or what it includes, changed" in error
    (tmp_path/"heavy.inp").write_text(text)
    error = study(tmp_path, *asked, deck=tmp_path/"bar.inp", code=2).stderr
    assert "begun before" in error


def test_no_program_of_single_precision(tmp_path: Path) -> None:
    done = study(tmp_path, *FREE, "--vary", "precision=double,single", "--single-program",
                 "nowhere", code=2)
    assert "there is no program of single precision, nowhere" in done.stderr
    assert "--single-program" in done.stderr


def test_no_quadruple_precision(tmp_path: Path) -> None:
    done = study(tmp_path, *FREE, "--reference", "quad", "--quad-program", "nowhere", code=2)
    assert "there is no program of quadruple precision" in done.stderr
    assert "--quad-program" in done.stderr


# --- failures ----------------------------------------------------------------------------------

def test_a_member_that_fails_is_a_result(tmp_path: Path) -> None:
    done = study(tmp_path, *FREE, "--vary", "method=NULL SPACE,NONSENSE")
    rows = table(tmp_path)
    assert [row["status"] for row in rows] == ["done", "failed", "done", "failed"]
    assert all("NONSENSE" in row["message"] for row in rows if row["status"] == "failed")
    assert "4 members, 2 done, 2 failed" in done.stdout and "NONSENSE" in done.stdout
    before = stamps(tmp_path)
    study(tmp_path, *FREE, "--vary", "method=NULL SPACE,NONSENSE")
    assert stamps(tmp_path) == before and len(before) == 4


def test_all_fail(tmp_path: Path) -> None:
    done = study(tmp_path, *FREE, "--set", "method=NONSENSE", code=3)
    assert "2 members, 0 done, 2 failed" in done.stdout


def program(folder: Path, text: str) -> Path:
    """A program in front of the real one."""
    path = folder/"program"
    path.write_text("#!/bin/sh\n" + textwrap.dedent(text))
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def task_of(folder: Path, runs: Path = PROGRAM, limit: float | None = None,
            **settings: str) -> Task:
    deck = read_deck(BAR)
    return Task(Member(0, "member", {"t_end": "0.1", "frame": "0.1", **settings}), str(folder),
                DeckFile(BAR, deck.text), str(runs), 1, limit)


def test_a_run_ended_by_a_signal_is_repeated(tmp_path: Path) -> None:
    task = task_of(tmp_path, program(tmp_path, "kill -9 $$\n"))
    record = run_member(task)
    assert record["status"] == "failed" and record["message"] == (
        "the program was ended by signal 9")
    assert record_of(task) is None and not list((tmp_path/"members").iterdir())
    assert run_member(task_of(tmp_path))["status"] == "done" and record_of(task) is not None


def test_a_run_that_takes_too_long(tmp_path: Path) -> None:
    record = run_member(task_of(tmp_path, program(tmp_path, "exec sleep 60\n"), limit=0.2))
    assert record["message"] == "not done after 0.2 s (--time-limit)"


def test_the_time_is_that_of_the_processor(tmp_path: Path) -> None:
    burn = "import time\nwhile time.process_time() < 0.3: pass"
    code, cpu, _ = call([sys.executable, "-c", burn], tmp_path/"log", None)
    assert code == 0 and cpu >= 0.3
    start = time.monotonic()
    code, cpu, _ = call(["/bin/sleep", "0.3"], tmp_path/"log", None)
    assert code == 0 and cpu < 0.3 <= time.monotonic() - start


def test_the_smallest_time_of_several(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    times = iter((3.0, 1.0, 2.0))

    def timed(*arguments: object) -> tuple[int, float, str]:
        code, _, text = call(*arguments)
        return code, next(times), text

    monkeypatch.setattr("emcon.study.execution.call", timed)
    task = task_of(tmp_path)
    record = run_member(Task(task.member, task.folder, task.deck, task.program, 3, None))
    assert (record["cpu"], record["runs"], record["status"]) == (1.0, 3, "done")
    assert record_of(task) is not None                   # three runs are more than one


def test_a_study_that_is_killed_goes_on(tmp_path: Path) -> None:
    """kill -9 in the middle: whole members stay, the half one is repeated, the end is the same."""
    options = ("--vary", "h=0.02,0.01,0.001", "--set", "t_end=1.5", "--jobs", 1)
    running = subprocess.Popen(command(BAR, *options), cwd=tmp_path, env=ENVIRONMENT,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    members = tmp_path/"study"/"members"
    deadline = time.monotonic() + LONGEST
    while len(stamps(tmp_path)) < 2 or not list(members.glob("*.part-*/bouncing_bar.*")):
        assert running.poll() is None and time.monotonic() < deadline
        time.sleep(0.005)
    running.send_signal(signal.SIGKILL)
    running.wait()
    before = stamps(tmp_path)
    assert len(before) == 2 and list(members.glob("*.part-*"))
    done = study(tmp_path, *options)
    assert "3 members, 3 done; 2 of them were there" in done.stdout
    after = stamps(tmp_path)
    assert before.items() <= after.items() and len(after) == 3
    assert not list(members.glob("*.part-*"))
    other = tmp_path/"other"
    other.mkdir()
    study(other, *options)
    for one, two in zip(table(tmp_path), table(other), strict=True):
        for name in ("cpu", "increments_cpu"):
            one.pop(name), two.pop(name)
        assert one == two


# --- many machines -----------------------------------------------------------------------------

def test_rows_of_the_manifest_one_by_one(tmp_path: Path) -> None:
    """What an array job does: each index in a process of its own, at the same time."""
    done = study(tmp_path, *FREE, "--manifest")
    assert done.stdout == "study/manifest.csv: 2 rows, 0 to 1\n"
    with (tmp_path/"study"/"manifest.csv").open() as file:
        assert [row["h"] for row in csv.DictReader(file)] == ["0.1", "0.05"]
    assert not stamps(tmp_path)
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        jobs = [pool.submit(study, tmp_path, *FREE, "--run-member", k, is_apart=True)
                for k in (0, 1, 0, 1)]
        texts = [job.result().stdout for job in jobs]
    assert texts == ["0: h=0.1: done\n", "1: h=0.05: done\n"]*2
    before = stamps(tmp_path)
    done = study(tmp_path, *FREE)
    assert "2 of them were there" in done.stdout and stamps(tmp_path) == before
    study(tmp_path, *FREE, "--run-member", 2, code=2)


def test_any_executor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "mine", raising=False)
    (tmp_path/"mine.py").write_text(textwrap.dedent("""\
        import concurrent.futures

        class Lossy(concurrent.futures.ThreadPoolExecutor):
            count = 0

            def submit(self, work, task):
                self.count += 1
                if self.count == 1:
                    return super().submit(divmod, 1, 0)      # a worker that is lost
                return super().submit(work, task)

        def lossy():
            return Lossy(2)

        def processes():
            return concurrent.futures.ProcessPoolExecutor(2)

        def nothing():
            return 7
        """))
    done = study(tmp_path, *FREE, "--executor", "mine:lossy")
    assert "1 failed" in done.stdout and "ZeroDivisionError" in done.stdout
    done = study(tmp_path, *FREE, "--executor", "mine:processes", is_apart=True)
    assert "2 members, 2 done; 1 of them were there" in done.stdout
    other = ("--vary", "h=0.25", *FREE[2:], "--reference", "file:study/none")
    assert "no result" in study(tmp_path, *other, code=2).stderr
    for name, words in (("mine", "MODULE:CALLABLE"), ("mine:absent", "absent"),
                        ("none_such:x", "none_such"), ("mine:nothing", "no submit")):
        fresh = study(tmp_path, *FREE, "--fresh", "--executor", name, code=2)
        assert words in fresh.stderr


def test_a_local_dask_cluster(tmp_path: Path) -> None:
    (example,) = [found for chapter in examples(PAGES[0].read_text(encoding="utf-8")).values()
                  for found in chapter if found.file == "cluster.py"]
    (tmp_path/"cluster.py").write_text(example.code.text)
    done = study(tmp_path, *FREE, "--executor", "cluster:dask", is_apart=True)
    assert "2 members, 2 done" in done.stdout
    assert [row["status"] for row in table(tmp_path)] == ["done", "done"]


# --- refusals ----------------------------------------------------------------------------------

def test_a_deck_that_changed_is_refused(tmp_path: Path) -> None:
    deck = tmp_path/"bar.inp"
    deck.write_text(BAR.read_text())
    study(tmp_path, *FREE, deck=deck)
    before = stamps(tmp_path)
    deck.write_text(BAR.read_text().replace("10., 0., -1., 0.", "11., 0., -1., 0."))
    error = study(tmp_path, *FREE, deck=deck, code=2).stderr
    assert "bar.inp, or what it includes, changed" in error
    assert "--output" in error and "--fresh" in error
    assert stamps(tmp_path) == before
    study(tmp_path, *FREE, "--fresh", deck=deck)
    (row, _) = table(tmp_path)
    assert float(row["rebound_1_y"]) == pytest.approx(-5.5, rel=1e-9)


def test_another_version_is_refused(tmp_path: Path) -> None:
    study(tmp_path, *FREE)
    other = program(tmp_path, "echo emcon 99.0\n")
    error = study(tmp_path, *FREE, "--program", other, code=2).stderr
    assert re.search(r"before the program changed \(emcon [\d.]+.* then, emcon 99.0 now\)", error)


def test_another_build_of_the_version_is_refused(tmp_path: Path) -> None:
    """A program that was built anew between two calls, its version as it was."""
    here = tmp_path/"emcon"
    shutil.copy(PROGRAM, here)
    study(tmp_path, *FREE, "--program", here)
    before = stamps(tmp_path)
    study(tmp_path, *FREE, "--program", here)
    with here.open("ab") as file:
        file.write(b"\0")
    error = study(tmp_path, *FREE, "--program", here, code=2).stderr
    assert "before the program changed (built anew: double precision)" in error and "--fresh" in error
    assert stamps(tmp_path) == before
    study(tmp_path, *FREE, "--program", here, "--fresh")
    assert stamps(tmp_path) != before


@pytest.mark.parametrize(("options", "words"), [
    (["--vary", "hh=1"], "there is no knob 'hh'"),
    (["--vary", "method=NULL SPACE,SADDLE POINT"], "h is not varied"),
    (["--vary", "h=1,2", "--goal", "nothing:1"], "there is no measure 'nothing'"),
    (["--vary", "h=1,2", "--reference", "truth"], "known are finest, quad, refined-mesh"),
    (["--vary", "h=1,2", "--reference", "closed-form:none.json"], "none.json"),
    (["--vary", "h=1,2", "--jobs", "0"], "whole number above 0"),
    (["--vary", "h=1,2", "--program", "/nowhere/emcon"], "no program /nowhere/emcon"),
])
def test_refusals(options: list[str], words: str, tmp_path: Path) -> None:
    assert words in study(tmp_path, *options, code=2).stderr
    assert not (tmp_path/"study").exists()


def test_a_deck_that_is_not_there(tmp_path: Path) -> None:
    assert "cannot read" in study(tmp_path, deck=tmp_path/"none.inp", code=2).stderr
