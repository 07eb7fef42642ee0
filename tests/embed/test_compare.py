"""Two results side by side: differences that are put in are found, and where."""

from __future__ import annotations

import math
import shutil
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from test_python_results import (POINTS, TIMES, history_values, write_fields, write_history_file,
                                 write_table)

sys.path.insert(0, str(Path(__file__).parents[2]/"pywrap"))

from emcon import Comparison, Difference, ResultError, compare  # noqa: E402
from emcon.__main__ import main  # noqa: E402
from emcon.comparison import common_times  # noqa: E402


@pytest.fixture
def runs(tmp_path: Path) -> tuple[Path, Path]:
    """Base names of two equal results."""
    values = history_values()
    write_table(tmp_path/"a.csv", values)
    write_history_file(tmp_path/"a.h5", values)
    with h5py.File(tmp_path/"a.h5", "a") as file:
        for name in ("MASS", "MOMENTUM"):
            file[f"sets/BODIES/{name}_time"] = TIMES[:len(file[f"sets/BODIES/{name}"])]
        file["sets/TIP/U"] = np.arange(36.0).reshape(9, 2, 2)
        file["sets/TIP/U_time"] = TIMES
        file["sets/TIP/U_label"] = [14, 11]
    write_fields(tmp_path/"a.vtkhdf")
    for suffix in (".csv", ".h5", ".vtkhdf"):
        shutil.copy(tmp_path/f"a{suffix}", tmp_path/f"b{suffix}")
    return tmp_path/"a", tmp_path/"b"


def row(found: Comparison, name: str) -> Difference:
    (chosen,) = [d for d in found.differences if d.name == name]
    return chosen


def test_equal_runs_do_not_differ(runs: tuple[Path, Path],
                                  capsys: pytest.CaptureFixture[str]) -> None:
    found = compare(*runs)
    assert found.largest == 0.0 and not found.notes and not found.exceeding(0.0)
    names = {d.name for d in found.differences}
    assert {"total", "lz", "active", "U", "MASS", "MOMENTUM", "displacement", "contact_gap",
            "strain_energy"} <= names
    assert not names & {"cpu", "newton", "cuts", "increment", "time", "h"}
    assert main(["compare", *map(str, runs), "--tolerance", "0"]) == 0
    assert f"0 of {len(found.differences)} above the tolerance 0" in capsys.readouterr().out


def test_a_difference_is_found_with_its_place_and_time(runs: tuple[Path, Path]) -> None:
    with h5py.File(f"{runs[1]}.vtkhdf", "a") as file:
        file["VTKHDF/PointData/displacement"][6*8 + 5, 1] += 1e-3     # frame 6, node 5, y
        file["VTKHDF/CellData/strain_energy"][2] += 0.25              # in all frames
    with h5py.File(f"{runs[1]}.h5", "a") as file:
        file["sets/TIP/U"][3, 1, 0] -= 0.5
    found = compare(*runs)
    u = row(found, "displacement")
    assert (u.group, u.time, u.place) == ("fields", TIMES[6], "node row 5, component 2")
    assert u.largest == pytest.approx(1e-3, rel=1e-12) and u.scale == 2.0
    energy = row(found, "strain_energy")
    assert (energy.largest, energy.scale, energy.place) == (0.25, 2.25, "element row 2")
    tip = row(found, "U")
    assert (tip.group, tip.largest, tip.time, tip.place) == (
        "series TIP", 0.5, TIMES[3], "11, component 1")
    assert tip.relative == 0.5/35.0
    assert {d.name for d in found.exceeding(1e-4)} == {"displacement", "strain_energy", "U"}
    assert {d.name for d in found.exceeding(1e-3)} == {"strain_energy", "U"}


def test_energies_and_momenta_share_a_scale(runs: tuple[Path, Path]) -> None:
    """A trace of an energy is not large because that energy is small."""
    values = history_values()
    values["contact_work"] = values["contact_work"] + 1e-14
    values["px"] = values["px"] + 1e-12
    write_table(Path(f"{runs[1]}.csv"), values)
    found = compare(*runs)
    work = row(found, "contact_work")
    assert work.largest == 1e-14 and work.scale == row(found, "total").scale >= 25.0
    assert row(found, "px").scale == 8.0


def test_exit_codes_and_marks(runs: tuple[Path, Path], capsys: pytest.CaptureFixture[str]) -> None:
    values = history_values()
    values["total"] = values["total"]*(1.0 + 1e-6)
    write_table(Path(f"{runs[1]}.csv"), values)
    a, b = map(str, runs)
    assert main(["compare", a, b]) == 0
    assert "*" not in capsys.readouterr().out
    assert main(["compare", a, b, "--tolerance", "1e-7"]) == 1
    out = capsys.readouterr().out
    (line,) = [text for text in out.splitlines() if text.endswith("*")]
    assert "total" in line and "1.00e-06" in line and "1 of" in out
    assert main(["compare", a, b, "--tolerance", "1e-5"]) == 0
    assert main(["compare", a, b, "--tolerance", "1e-7", "--only", "px", "displacement"]) == 0
    assert "kinetic" not in capsys.readouterr().out.split("tolerance")[-1]


def test_only_common_times_count(runs: tuple[Path, Path]) -> None:
    """A run with half the step: its odd rows have no partner."""
    fine = np.linspace(0.0, 2.0, 17)
    values = {name: np.repeat(v, 2)[:17] for name, v in history_values().items()}
    values["time"] = fine
    for name, odd in values.items():
        if name not in ("time", "increment", "active", "newton", "cuts"):
            odd[1::2] = 1e6
    write_table(Path(f"{runs[1]}.csv"), values)
    write_fields(Path(f"{runs[1]}.vtkhdf"), times=fine)
    Path(f"{runs[1]}.h5").unlink()
    found = compare(*runs)
    assert found.largest == 0.0 and row(found, "displacement").scale == 2.0


def test_common_times() -> None:
    def pairs(a: list[float], b: list[float]) -> list[tuple[int, int]]:
        rows = common_times(np.array(a, dtype=float), np.array(b, dtype=float))
        return list(zip(rows[0].tolist(), rows[1].tolist()))

    assert pairs([0, 1, 2], [0, 0.5, 1, 1.5, 2]) == [(0, 0), (1, 2), (2, 4)]
    assert pairs([0, 0.1*3], [0, 0.3]) == [(0, 0), (1, 1)]             # differ in the last bit
    assert pairs([0, 1, 1, 2], [0, 1, 2, 2]) == [(0, 0), (2, 1), (3, 3)]
    assert pairs([5, 6], [0, 1]) == [] and pairs([], [0]) == []
    assert pairs([0, 1e-3], [0, 1e-3*(1 + 1e-6)]) == [(0, 0)]


def test_nan_equals_nan_only(runs: tuple[Path, Path]) -> None:
    with h5py.File(f"{runs[1]}.vtkhdf", "a") as file:
        file["VTKHDF/PointData/contact_gap"][2*8 + 4] = math.nan
    gap = row(compare(*runs), "contact_gap")
    assert gap.largest == gap.relative == math.inf
    assert (gap.time, gap.place) == (TIMES[2], "node row 4")
    zero = Difference("fields", "x", math.inf, 0.0, 0.0, "")
    assert zero.relative == math.inf


def test_what_cannot_be_compared_is_said(runs: tuple[Path, Path],
                                         capsys: pytest.CaptureFixture[str]) -> None:
    a, b = runs
    write_fields(Path(f"{b}.vtkhdf"), ["displacement"])
    with h5py.File(f"{b}.h5", "a") as file:
        del file["sets/TIP"]
    assert set(compare(a, b).notes) >= {f"only {a} has the series TIP U",
                                        f"only {a} has the field velocity"}
    assert f"only {a} has the field velocity" in compare(b, a).notes
    write_fields(Path(f"{b}.vtkhdf"), points=POINTS*1.001)
    found = compare(a, b)
    assert "the meshes are not the same: fields are not compared" in found.notes
    assert "fields" not in {d.group for d in found.differences}
    assert main(["compare", str(a), str(b)]) == 0
    assert "fields are not compared" in capsys.readouterr().out


def test_results_without_anything_in_common(runs: tuple[Path, Path],
                                            capsys: pytest.CaptureFixture[str]) -> None:
    def refused(*arguments: str) -> str:
        assert main(["compare", *arguments]) == 2
        out, err = capsys.readouterr()
        assert out == "" and err.startswith("error: ")
        return err

    a, b = map(str, runs)
    assert "no result" in refused(a, f"{b}x")
    assert "no heat to compare; there are kinetic" in refused(a, b, "--only", "heat")
    Path(f"{b}.h5").unlink()
    Path(f"{b}.csv").unlink()
    write_fields(Path(f"{b}.vtkhdf"), times=TIMES + 100.0)
    err = refused(a, b)
    assert "nothing to compare" in err and "no common time" in err
    for tolerance in ("-1", "nan", "much"):
        with pytest.raises(SystemExit) as stop:
            main(["compare", a, b, "--tolerance", tolerance])
        assert stop.value.code == 2
    with pytest.raises(ResultError):
        compare(a, f"{b}.inp")
