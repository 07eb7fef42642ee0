"""Results as arrays that are read when asked for: good files, files in the making, bad ones."""

from __future__ import annotations

import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from test_python_results import (TIMES, field_values, history_values, write_fields,
                                 write_history_file, write_table)

sys.path.insert(0, str(Path(__file__).parents[2]/"pywrap"))

from emcon import FieldFile, HistoryFile, ResultError, Results  # noqa: E402


@pytest.fixture
def box(tmp_path: Path) -> Path:
    """Base name of a complete result, with a printed series of two nodes."""
    base = tmp_path/"box"
    values = history_values()
    write_table(tmp_path/"box.csv", values)
    write_history_file(tmp_path/"box.h5", values)
    with h5py.File(tmp_path/"box.h5", "a") as file:
        file["sets/TIP/U"] = np.arange(36.0).reshape(9, 2, 2)
        file["sets/TIP/U_time"] = TIMES
        file["sets/TIP/U_label"] = [14, 11]
    write_fields(tmp_path/"box.vtkhdf")
    return base


# --- fields ------------------------------------------------------------------------------------

def test_a_field_is_an_array_over_frames(box: Path) -> None:
    whole = np.stack([field_values("displacement", t) for t in TIMES])
    with Results(box) as results:
        u = results.fields["displacement"]
        assert u.shape == whole.shape == (9, 8, 3) and u.ndim == 3 and len(u) == 9
        assert np.array_equal(u.times, TIMES)
        for key in (0, -1, np.int64(3), slice(None), slice(1, 7, 3), slice(None, None, -2),
                    (slice(None), 5), (4, 5), (4, -1), (-2, slice(4, 6)), (slice(2, 4), 5, 1),
                    (slice(None), slice(None), 0), (3, [1, 6]), (slice(5, 5), 4)):
            assert np.array_equal(u[key], whole[key]), key
        assert np.array_equal(np.asarray(u), whole)
        assert np.asarray(u, dtype=np.float32).dtype == np.float32
        assert [frame.tolist() for frame in u] == whole.tolist()
        assert np.array_equal(u.at(1.1), whole[4])
        assert np.array_equal(results.fields.at("displacement", 2.1), whole[-1])
        energy = results.fields["strain_energy"]                     # of the elements
        assert energy.shape == (9, 3) and np.array_equal(energy[:, 1], np.ones(9))


def test_only_what_is_asked_for_is_read(box: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read = []
    real = h5py.Dataset.__getitem__

    def counted(self, key, *more):
        value = real(self, key, *more)
        read.append((self.name.rpartition("/")[2], np.size(value)))
        return value

    with FieldFile(f"{box}.vtkhdf") as file:
        monkeypatch.setattr(h5py.Dataset, "__getitem__", counted)
        u = file["displacement"]
        assert not read
        u[3]
        assert sum(size for name, size in read) == 24 + 1           # and the offset of the frame
        read.clear()
        u[:, 5]
        assert sum(size for name, size in read) == 9*(3 + 1)


def test_wrong_frames_times_and_names(box: Path) -> None:
    with Results(box) as results:
        u = results.fields["displacement"]
        for key in (9, -10, (9, 0)):
            with pytest.raises(IndexError, match="displacement has 9 frames"):
                u[key]
        with pytest.raises(IndexError):
            u[0, 8]
        with pytest.raises(TypeError, match="a frame is a number or a slice"):
            u[0.5]
        with pytest.raises(ResultError, match="no frame near time 3.*from 0 to 2"):
            u.at(3.0)
        for time in (-1.0, float("nan")):
            with pytest.raises(ResultError, match="no frame near time"):
                u.at(time)
        with pytest.raises(ResultError, match="no field heat; it has .*strain_energy"):
            results.fields["heat"]
        with pytest.raises(ValueError, match="copy"):
            np.asarray(u, copy=False)


# --- history -----------------------------------------------------------------------------------

def test_columns_and_series(box: Path) -> None:
    with HistoryFile(f"{box}.h5") as file:
        assert len(file) == 9 and "total" in file.columns
        assert np.array_equal(file["total"], history_values()["total"])
        assert file.sets == {"BODIES": (), "TIP": ("U",)}
        tip = file.series("tip", "u")
        assert tip.values.shape == (9, 2, 2) and tip.values[4, 1, 0] == 18.0
        assert tip.labels.tolist() == [14, 11] and np.array_equal(tip.times, TIMES)
        with pytest.raises(ResultError, match="no column heat"):
            file["heat"]
        with pytest.raises(ResultError, match="no series TIP V; it has TIP U"):
            file.series("TIP", "V")
    with Results(box) as results:
        assert np.array_equal(results.history["total"], history_values()["total"])
        assert np.array_equal(results.series("TIP", "U").values, tip.values)


def test_unfinished_rows_are_left_out(box: Path) -> None:
    with h5py.File(f"{box}.h5", "a") as file:
        del file["history/total"], file["sets/TIP/U_time"]
        file["history/total"] = np.arange(7.0)
        file["sets/TIP/U_time"] = TIMES[:8]
    with HistoryFile(f"{box}.h5") as history:
        assert len(history) == len(history["time"]) == len(history["total"]) == 7
        series = history.series("TIP", "U")
        assert len(series.times) == len(series.values) == 8


# --- closed, missing, growing, damaged ---------------------------------------------------------

def test_use_after_close(box: Path) -> None:
    with Results(box) as results:
        fields = results.fields
        u, first = fields["displacement"], fields["displacement"][0]
        results.series("TIP", "U")
    assert first.shape == (8, 3) and len(fields.times) == 9          # what was read stays
    for call in (lambda: u[0], lambda: u[:, 2], lambda: fields["velocity"],
                 lambda: fields.point("velocity", 0), lambda: fields.refresh(),
                 lambda: results.fields, lambda: results.history,
                 lambda: results.series("TIP", "U")):
        with pytest.raises(ResultError, match="closed"):
            call()
    results.close()
    history = HistoryFile(f"{box}.h5")
    history.close()
    history.close()
    with pytest.raises(ResultError, match="is closed"):
        history["total"]


def test_what_is_not_there_is_missed_when_asked_for(box: Path) -> None:
    Path(f"{box}.vtkhdf").unlink()
    Path(f"{box}.h5").unlink()
    with Results(box) as results:
        assert len(results.history) == 9
        with pytest.raises(ResultError, match="no file .*box.vtkhdf"):
            results.fields
        with pytest.raises(ResultError, match="no file .*box.h5"):
            results.series("TIP", "U")
    with pytest.raises(ResultError, match="no result"):
        Results(box.with_name("nothing"))


def test_file_that_grows(box: Path) -> None:
    path = Path(f"{box}.vtkhdf")
    write_fields(path, times=TIMES[:4])
    with FieldFile(path) as file:
        assert len(file.times) == 4
        write_fields(box.with_name("new.vtkhdf"))
        box.with_name("new.vtkhdf").replace(path)
        assert file.refresh() == 9
        assert np.array_equal(file["displacement"][-1], field_values("displacement", 2.0))


def test_file_that_was_cut_off(box: Path) -> None:
    """At every length: a message that names the file, never another exception."""
    for suffix, kind in ((".vtkhdf", FieldFile), (".h5", HistoryFile)):
        path = Path(f"{box}{suffix}")
        whole = path.read_bytes()
        for length in [*range(0, len(whole), len(whole)//40), len(whole) - 1]:
            path.write_bytes(whole[:length])
            with pytest.raises(ResultError, match=path.name):
                kind(path)
        path.write_bytes(whole[:len(whole)//2])
        with pytest.raises(ResultError, match=f"of its {len(whole)} bytes are there; it was cut"):
            kind(path)
        path.write_bytes(b"")
        with pytest.raises(ResultError, match="it is empty"):
            kind(path)


def test_file_with_holes(box: Path) -> None:
    """Damage inside a file: values or a message, never another exception."""
    path = Path(f"{box}.vtkhdf")
    whole = path.read_bytes()
    told = 0
    for start in range(0, len(whole), max(len(whole)//25, 1)):
        path.write_bytes(whole[:start] + b"\xff"*16 + whole[start + 16:])
        try:
            with FieldFile(path) as file:
                for name in (*file.point_fields, *file.cell_fields):
                    np.asarray(file[name])
        except ResultError as problem:
            assert path.name in str(problem)
            told += 1
    assert told > 0
