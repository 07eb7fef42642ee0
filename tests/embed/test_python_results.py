"""Reading, plotting and tabling of results, on small files written here: good, partial, bad."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import h5py
import numpy as np
import pytest
from numpy.lib.recfunctions import append_fields

PACKAGE = Path(__file__).parents[2]/"pywrap"
sys.path.insert(0, str(PACKAGE))

from emcon import (FieldFile, ResultError, energy_drift, locate, read_bodies,  # noqa: E402
                   read_history)
from emcon.__main__ import main  # noqa: E402
from emcon.results import (cpu_seconds, read_contact_force,  # noqa: E402
                           read_wall_seconds)

COLUMNS = ("increment,time,h,kinetic,strain,external_work,contact_work,stabilization,total,"
           "px,py,lz,active,newton,cuts,cpu").split(",")
COUNTS = ("increment", "active", "newton", "cuts")
ALL_FIELDS = ("displacement", "velocity", "reaction_force", "cauchy_stress", "von_mises",
              "contact_pressure", "contact_gap", "contact_active", "contact_force")
TIMES = np.linspace(0.0, 2.0, 9)
#: A square of two triangles above a unit quadrilateral; two bodies, nodes 4..7 the upper one.
POINTS = np.array([[0, -1, 0], [1, -1, 0], [1, 0, 0], [0, 0, 0],
                   [0, 0.5, 0], [1, 0.5, 0], [1, 1.5, 0], [0, 1.5, 0]], dtype=float)
CELLS = [[0, 1, 2, 3], [4, 5, 6], [4, 6, 7]]


def history_values() -> dict[str, np.ndarray]:
    """A body of mass 2 that bounces from (3, -4) to (3, 2.5) at t = 1."""
    rows = 9
    values = {name: np.zeros(rows) for name in COLUMNS}
    values["increment"] = np.arange(rows, dtype=float)
    values["time"] = TIMES.copy()
    values["h"][1:] = 0.25
    values["total"][:] = 25.0
    values["total"][5] = 25.0*(1.0 + 1e-11)
    values["strain"] = np.where(TIMES > 1.0, 9.75, 0.0)
    values["kinetic"] = values["total"] - values["strain"]
    values["px"][:] = 6.0
    values["py"] = np.where(TIMES > 1.0, 5.0, -8.0)
    values["newton"][1:] = 3
    values["cpu"] = 0.5*np.arange(rows)
    return values


def write_table(path: Path, values: dict[str, np.ndarray], names: Iterable[str] = COLUMNS) -> None:
    names = list(names)
    lines = [",".join(names)]
    for k in range(len(values["time"])):
        lines.append(",".join(str(int(values[n][k])) if n in COUNTS else f"{values[n][k]:.16E}"
                              for n in names))
    path.write_text("\n".join(lines) + "\n")


def write_history_file(path: Path, values: dict[str, np.ndarray]) -> None:
    with h5py.File(path, "w") as file:
        for name in COLUMNS:
            file[f"history/{name}"] = values[name]
        file["sets/BODIES/MASS"] = [[5.0, 2.0]]
        file["sets/BODIES/MOMENTUM"] = np.stack(
            [np.column_stack([0.0*values[name], values[name]]) for name in ("px", "py", "lz")], -1)


def field_values(name: str, time: float) -> np.ndarray:
    """Point field `name` at `time`: the upper body moves by (t, -t/4), its gap closes at t = 2."""
    n = len(POINTS)
    upper = np.arange(n) >= 4
    slave = np.isin(np.arange(n), (4, 5))
    if name in ("displacement", "velocity"):
        return np.where(upper[:, None], [time, -0.25*time, 0.0], 0.0)
    if name == "cauchy_stress":
        return np.tile([time, 0.0, 0.0, 0.0, 0.0, 0.0], (n, 1))
    if name == "contact_force":
        force = np.zeros((n, 3))
        force[slave, 1], force[2:4, 1] = time, -time
        return force
    if name == "contact_gap":
        return np.where(slave, 0.5 - 0.25*time, np.nan)
    if name == "reaction_force":
        return np.zeros((n, 3))
    return np.full(n, time)


def write_fields(path: Path, names: Iterable[str] = ALL_FIELDS, points: np.ndarray = POINTS,
                 times: np.ndarray = TIMES, n_step: int | None = None) -> None:
    with h5py.File(path, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array([2, 0])
        root.attrs["Type"] = np.bytes_("UnstructuredGrid")
        root["Points"] = points
        root["Connectivity"] = np.concatenate(CELLS)
        root["Offsets"] = np.cumsum([0] + [len(c) for c in CELLS])
        root["Types"] = np.array([9, 5, 5], dtype=np.uint8)
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = len(times) if n_step is None else n_step
        steps["Values"] = times
        for name in names:
            root[f"PointData/{name}"] = np.concatenate([field_values(name, t) for t in times])
            steps[f"PointDataOffsets/{name}"] = len(points)*np.arange(len(times))
        # written once: all frames point to the same rows
        root["CellData/strain_energy"] = np.arange(3.0)
        steps["CellDataOffsets/strain_energy"] = np.zeros(len(times), dtype=int)


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """Base name of a complete result."""
    base = tmp_path/"box.v2"
    values = history_values()
    write_table(tmp_path/"box.v2.csv", values)
    write_history_file(tmp_path/"box.v2.h5", values)
    write_fields(tmp_path/"box.v2.vtkhdf")
    return base


def is_png(path: Path) -> bool:
    return path.read_bytes().startswith(b"\x89PNG")


# --- reading -----------------------------------------------------------------------------------

@pytest.mark.parametrize("suffix", ["", ".csv", ".h5", ".vtkhdf", ".log", ".png"])
def test_any_name_of_a_run_is_found(run: Path, suffix: str) -> None:
    assert locate(str(run) + suffix).base == run


def test_table_and_history_file_hold_the_same(run: Path) -> None:
    paths = locate(run)
    table = read_history(paths)
    paths.table.unlink()
    group = read_history(paths)
    assert set(table.dtype.names) == set(group.dtype.names) == set(COLUMNS)
    for name in COLUMNS:
        assert np.array_equal(table[name], group[name]), name
    assert table["newton"].dtype.kind == "i" and table["time"].dtype == np.float64


def test_unfinished_last_line_is_left_out(run: Path) -> None:
    paths = locate(run)
    paths.table.write_text(paths.table.read_text()[:-7])
    assert len(read_history(paths)) == 8


def test_drift_is_relative_to_the_start(run: Path) -> None:
    drift, scale = energy_drift(read_history(locate(run)))
    assert scale == 25.0
    assert drift.argmax() == 5 and drift.max() == pytest.approx(1e-11, rel=1e-4)


def test_drift_of_a_start_from_rest_is_relative_to_the_largest_energy(run: Path) -> None:
    history = read_history(locate(run))
    history["total"] -= 25.0
    drift, scale = energy_drift(history)
    assert scale == history["kinetic"].max()
    assert np.isfinite(drift).all()
    for name in ("kinetic", "strain", "total"):
        history[name] = 0.0
    assert energy_drift(history)[1] == 0.0 and not energy_drift(history)[0].any()


@pytest.mark.parametrize("name", ["friction_loss", "damping_loss", "contact_damping_loss",
                                  "restitution_loss"])
def test_what_is_asked_for_is_no_drift(run: Path, name: str) -> None:
    history = read_history(locate(run))
    before = energy_drift(history)
    taken = np.linspace(0.0, 3.0, len(history))
    history["total"] -= taken
    assert energy_drift(history)[0].max() > 0.1
    drift, scale = energy_drift(append_fields(history, name, taken, usemask=False))
    assert scale == before[1]
    np.testing.assert_allclose(drift, before[0], rtol=0, atol=1e-15)


def test_cpu_time_survives_a_restart(run: Path) -> None:
    history = read_history(locate(run))
    assert cpu_seconds(history) == 4.0
    history["cpu"][5:] -= 2.25                      # 0, .5, 1, 1.5, 2, .25, .75, 1.25, 1.75
    assert cpu_seconds(history) == 3.75


def test_bodies_give_the_velocity_of_the_centre_of_mass(run: Path) -> None:
    bodies = read_bodies(locate(run))
    assert bodies is not None and bodies.main() == 1
    assert bodies.velocity(1, 0) == (3.0, -4.0)
    assert bodies.velocity(1, -1) == (3.0, 2.5)


def test_fields_by_frame(run: Path) -> None:
    with FieldFile(locate(run).field) as field:
        assert np.array_equal(field.times, TIMES) and field.points.shape == (8, 3)
        assert [list(c) for c in field.cells] == CELLS
        assert set(field.point_fields) == set(ALL_FIELDS)
        assert np.array_equal(field.point("displacement", 4), field_values("displacement", 1.0))
        assert np.array_equal(field.point("von_mises", -1), np.full(8, 2.0))
        assert np.array_equal(field.cell("strain_energy", 7), np.arange(3.0))
        assert field.nearest_frame(1.1) == 4
        assert list(field.bodies()) == [0, 0, 0, 0, 1, 1, 1, 1]
        with pytest.raises(ResultError, match="no field heat"):
            field.point("heat", 0)
        with pytest.raises(IndexError):
            field.point("velocity", 9)


def test_unfinished_frame_is_left_out(run: Path) -> None:
    path = locate(run).field
    write_fields(path, n_step=8)
    with FieldFile(path) as field:
        assert len(field.times) == 8


def test_contact_force_is_the_total_or_the_sum(run: Path) -> None:
    paths = locate(run)
    assert read_contact_force(paths) is None
    force = np.zeros((9, 3, 2))
    force[4] = [[0.5, 1.0], [0.0, 2.0], [-0.5, 3.0]]
    with h5py.File(paths.history, "a") as file:
        file["sets/CONTACT/CF"] = force
        file["sets/CONTACT/CF_time"] = TIMES
        file["sets/RUN/WALL_SECONDS"] = [12.5]
    found = read_contact_force(paths)
    assert found is not None
    assert list(found[1][4]) == [0.0, 6.0] and not found[1][3].any()
    assert read_wall_seconds(paths) == 12.5
    with h5py.File(paths.history, "a") as file:     # the total, where there is one
        file["sets/CONTACT/TOTAL_CF"] = 2.0*force.sum(axis=1, keepdims=True)
        file["sets/CONTACT/TOTAL_CF_time"] = TIMES
    found = read_contact_force(paths)
    assert found is not None and list(found[1][4]) == [0.0, 12.0]


# --- commands ----------------------------------------------------------------------------------

def test_plot_writes_a_picture_beside_the_result(run: Path,
                                                 capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plot", str(run)]) == 0
    out, err = capsys.readouterr()
    picture = Path(str(run) + ".png")
    assert is_png(picture) and str(picture) in out and err == ""


def test_plot_by_name(run: Path, tmp_path: Path) -> None:
    from emcon import plot

    figure = plot(run)
    assert is_png(Path(str(run) + ".png"))
    assert sum(bool(axes.get_title()) for axes in figure.axes) == 6
    plot(str(run), tmp_path/"some.png", [0.0])
    assert is_png(tmp_path/"some.png")
    with pytest.raises(ResultError, match="picture format"):
        plot(run, "some.inp")


def test_plot_shows_the_frames_nearest_to_the_times(run: Path) -> None:
    from emcon.plotting import View, draw

    figure, notes = draw(locate(run), View([0.1, 0.9, 1.1, 2.0]))
    titles = [axes.get_title() for axes in figure.axes if axes.get_title()]
    assert titles == ["$t = 0$", "$t = 1$", "$t = 2$"] and not notes
    figure, _ = draw(locate(run))
    assert sum(bool(axes.get_title()) for axes in figure.axes) == 6


def test_plot_of_a_frame_a_field_and_colours(run: Path, tmp_path: Path) -> None:
    """Bodies of one frame in the colours of a field of cells, between the values that are asked."""
    from emcon import plot
    from emcon.plotting import View, draw

    figure, notes = draw(locate(run), View(frame=-1, field="strain_energy", clim=(0.5, 1.5)))
    shown = [axes for axes in figure.axes if axes.get_title()]
    (elements,) = (part for part in shown[0].collections if part.get_array() is not None)
    assert len(shown) == 1 and not notes
    assert shown[0].get_title() == f"$t = {TIMES[-1]:g}$"
    assert np.array_equal(elements.get_array(), np.arange(3.0))
    assert elements.get_clim() == (0.5, 1.5)
    assert "strain energy\n[M L$^2$/T$^2$]" in [axes.get_ylabel() for axes in figure.axes]
    plot(run, tmp_path/"one.png", frame=0, field="displacement", clim=(0, 2))
    assert is_png(tmp_path/"one.png")
    for wrong, why in ((View(frame=99), "no frame 99"), (View([0.0], frame=0), "not both"),
                       (View(field="heat"), "heat"), (View(clim=(1, 1)), "larger one"),
                       (View(clim=(0, float("nan"))), "larger one")):
        with pytest.raises(ResultError, match=why):
            draw(locate(run), wrong)


def test_plot_command_has_field_frame_and_colours(run: Path, tmp_path: Path,
                                                  capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path/"two.png"
    assert main(["plot", str(run), "--output", str(output), "--frame", "-1", "--field",
                 "strain_energy", "--clim", "-1", "2"]) == 0
    assert is_png(output)
    assert main(["plot", str(run), "--field", "heat"]) == 2
    assert "no field heat" in capsys.readouterr().err


def test_plot_force_is_the_sum_over_the_slave_nodes(run: Path) -> None:
    from emcon.plotting import draw

    figure, _ = draw(locate(run))
    line = next(line for line in figure.axes[-1].lines if len(line.get_ydata()) == len(TIMES))
    assert np.array_equal(line.get_ydata(), 2.0*TIMES)


def test_views_share_one_scale_and_hold_the_moving_body(run: Path) -> None:
    from emcon.plotting import draw

    figure, _ = draw(locate(run))
    scenes = [axes for axes in figure.axes if axes.get_title()]
    widths = [np.ptp(axes.get_xlim()) for axes in scenes]
    heights = [np.ptp(axes.get_ylim()) for axes in scenes]
    assert np.ptp(widths) < 1e-12*widths[0] and np.ptp(heights) < 1e-12*heights[0]
    for axes, t in zip(scenes, np.linspace(0.0, 2.0, 6), strict=True):
        nearest = TIMES[np.argmin(abs(TIMES - t))]
        assert axes.get_xlim()[0] < nearest and axes.get_xlim()[1] > nearest + 1.0
        assert axes.get_ylim()[0] < 0.0 and axes.get_ylim()[1] > 1.5


@pytest.mark.parametrize(("absent", "note"), [
    ("von_mises", ""), ("von_mises cauchy_stress", "no stress"), ("displacement", "undeformed"),
    ("contact_force", "no contact force"), ("contact_gap", "no contact gap"),
    (" ".join(ALL_FIELDS), "no displacement")])
def test_plot_does_with_fewer_fields(run: Path, capsys: pytest.CaptureFixture[str], absent: str,
                                     note: str) -> None:
    write_fields(locate(run).field, [n for n in ALL_FIELDS if n not in absent.split()])
    assert main(["plot", str(run), "--output", str(run.with_name("less.pdf"))]) == 0
    err = capsys.readouterr().err
    assert note in err and bool(note) == bool(err)
    assert run.with_name("less.pdf").stat().st_size > 1000


def test_plot_does_with_one_frame_and_with_nothing_that_moves(run: Path) -> None:
    write_fields(locate(run).field, times=np.zeros(1))
    assert main(["plot", str(run)]) == 0


@pytest.mark.parametrize("gone", ["field", "table history"])
def test_plot_does_with_half_the_files(run: Path, capsys: pytest.CaptureFixture[str],
                                       gone: str) -> None:
    paths = locate(run)
    for name in gone.split():
        getattr(paths, name).unlink()
    assert main(["plot", str(run)]) == 0
    assert "not shown" in capsys.readouterr().err
    assert is_png(paths.picture)


def test_summary_says_what_matters(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["summary", str(run) + ".csv"]) == 0
    out = capsys.readouterr().out
    for text in ("8 increments", "t = 0 to 2", "1.00e-11", "t = 1.25", "(3, -4)", "(3, 2.5)",
                 "4 s, 500 ms per increment", "3 per increment", str(run) + ".vtkhdf",
                 "none yet"):
        assert text in out, text


def test_summary_does_without_the_history_file(run: Path,
                                               capsys: pytest.CaptureFixture[str]) -> None:
    locate(run).history.unlink()
    assert main(["summary", str(run)]) == 0
    assert "masses are not in the history" in capsys.readouterr().out


# --- bad input ---------------------------------------------------------------------------------

def refused(capsys: pytest.CaptureFixture[str], code: int, *arguments: str) -> str:
    """The message with which the command is refused."""
    assert main(list(arguments)) == code
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("error: ") and "Traceback" not in err
    return err


@pytest.mark.parametrize("command", ["plot", "summary"])
@pytest.mark.parametrize(("name", "message"), [
    ("nothing", "no result"), ("", "folder"), ("box.v2.rst.h5", "restart file"),
    ("box.inp", "is a deck")])
def test_missing_result(run: Path, capsys: pytest.CaptureFixture[str], command: str, name: str,
                        message: str) -> None:
    assert message in refused(capsys, 2, command, str(run.parent/name))


@pytest.mark.parametrize(("content", "message"), [
    (b"", "is not an EMCON history"), (b"a,b\n1,2\n", "is not an EMCON history"),
    (b"\x00\xff\xfe junk", "not a text file"),
    (b"increment,time\n0,0.0\n", "no column kinetic"),
    (b"increment,time,kinetic,strain,external_work,total\n", "no rows"),
    (b"increment,time,kinetic,strain,external_work,total\n0,0,0,0,0,0\n1,2\n", "csv:3: 2 values"),
    (b"increment,time,kinetic,strain,external_work,total\n0,0,x,0,0,0\n", "csv:2: a value"),
    (b"increment,time,kinetic,strain,external_work,total\nnan,0,0,0,0,0\n", "whole number")])
def test_bad_table(run: Path, capsys: pytest.CaptureFixture[str], content: bytes,
                   message: str) -> None:
    locate(run).table.write_bytes(content)
    assert message in refused(capsys, 2, "summary", str(run))
    assert message in refused(capsys, 2, "plot", str(run))


def test_foreign_history_file(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    paths = locate(run)
    paths.table.unlink()
    paths.history.write_bytes(b"not hdf5")
    assert "cannot read" in refused(capsys, 2, "summary", str(run))
    with h5py.File(paths.history, "w") as file:
        file["other"] = 1.0
    assert "/history" in refused(capsys, 2, "summary", str(run))


def test_foreign_field_file(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = locate(run).field
    whole = path.read_bytes()
    for content in (b"junk", b"", whole[:len(whole)//3]):
        path.write_bytes(content)
        assert str(path) in refused(capsys, 2, "plot", str(run))
    with h5py.File(path, "w") as file:
        file["VTKHDF/Points"] = POINTS
    assert "not an EMCON field file" in refused(capsys, 2, "plot", str(run))


@pytest.mark.parametrize(("name", "value", "message"), [
    ("Connectivity", np.full(10, 99), "mesh"), ("Offsets", np.array([0, 4]), "mesh"),
    ("PointData/displacement", np.zeros((8, 3)), "ends before frame"),
    ("Steps/Values", None, "no data set"), ("Points", np.array([b"x"]), "cannot read")])
def test_broken_field_file(run: Path, capsys: pytest.CaptureFixture[str], name: str,
                           value: np.ndarray | None, message: str) -> None:
    path = locate(run).field
    with h5py.File(path, "a") as file:
        del file["VTKHDF"][name]
        if value is not None:
            file["VTKHDF"][name] = value
    assert message in refused(capsys, 2, "plot", str(run))


def test_field_file_without_frames(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_fields(locate(run).field, n_step=0)
    assert "no frame" in refused(capsys, 2, "plot", str(run))


def test_three_dimensional_result_is_sent_to_paraview(run: Path,
                                                      capsys: pytest.CaptureFixture[str]) -> None:
    write_fields(locate(run).field, points=POINTS + np.arange(24.0).reshape(8, 3))
    assert "ParaView" in refused(capsys, 2, "plot", str(run))


def test_bad_times_and_formats(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "no frame near time 7" in refused(capsys, 2, "plot", str(run), "--times", "0", "7")
    assert "picture format" in refused(capsys, 2, "plot", str(run), "--output", "a.doc")
    assert "picture format" in refused(capsys, 2, "plot", str(run), "--output", "a")
    with pytest.raises(SystemExit) as stop:
        main(["plot", str(run), "--times", "nan"])
    assert stop.value.code == 2


def test_unwritable_picture(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    where = str(run.parent/"nowhere"/"a.png")
    assert "cannot write" in refused(capsys, 4, "plot", str(run), "--output", where)


def test_module_runs_from_the_shell(run: Path) -> None:
    def emcon(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([sys.executable, "-m", "emcon", *arguments], text=True,
                              capture_output=True, check=False,
                              env={**os.environ, "PYTHONPATH": str(PACKAGE)})

    helped = emcon("--help")
    assert helped.returncode == 0 and "plot" in helped.stdout and "summary" in helped.stdout
    assert emcon("plot", "--help").returncode == 0
    assert emcon("--version").stdout.startswith("emcon ")
    assert emcon().returncode == 2
    assert emcon("frobnicate").returncode == 2
    missing = emcon("plot", str(run.parent/"nothing"))
    assert missing.returncode == 2 and "Traceback" not in missing.stderr
    assert emcon("summary", str(run)).returncode == 0


def test_what_it_is_is_said_in_a_line(run: Path) -> None:
    """Representations are short, whatever the arrays hold; `dir` has what the package offers."""
    import emcon

    with emcon.Results(run) as results:
        assert repr(results).startswith("Results(") and "box.v2.csv" in repr(results)
    assert "closed" in repr(results)
    bodies = read_bodies(locate(run))
    assert bodies is not None and repr(bodies).startswith(f"Bodies({len(bodies.mass)} bodies")
    same = emcon.compare(run, run)
    assert repr(same).endswith("largest relative difference 0.00e+00")
    mesh = emcon.mesh.block((0.0, 0.0), (1.0, 1.0), (2, 2))
    assert repr(emcon.Model.from_mesh(mesh)).endswith("2 ELSET, 4 SURFACE)")
    assert repr(emcon.Model("a")) == "Model(1 HEADING)"
    with emcon.Stepper(PACKAGE.parent/"input_decks"/"tumbling_block.inp") as block:
        (body,) = block.bodies()
        assert re.match(r"Body\(72 nodes, mass 0.12, centre \[", repr(body))
    public = {name for name in dir(emcon) if not name.startswith("_")}
    assert public == {name for name in emcon.__all__ if not name.startswith("_")}
