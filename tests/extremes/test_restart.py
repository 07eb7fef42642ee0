"""Runs that were killed, interrupted or tampered with, and what `emcon restart` makes of them."""

import os
import random
import re
import shutil
import signal
import subprocess
import time

import h5py
import numpy as np
import pytest
from scene_tools import (
    DECKS,
    Run,
    assert_no_crash,
    coarse_ring,
    emcon,
    run_deck,
    start,
    wait_for,
)

PARAMETERS = {"h": 0.02, "t_end": 2, "frame": 0.1}


@pytest.fixture(scope="module")
def deck(tmp_path_factory):
    """The ring with a restart file every 5 increments."""
    deck = coarse_ring()
    deck.replace("*RESTART, WRITE, FREQUENCY=50", "*RESTART, WRITE, FREQUENCY=5")
    for name, value in PARAMETERS.items():
        deck.set_parameter(name, value)
    return deck.write(tmp_path_factory.mktemp("deck") / "ring.inp")


@pytest.fixture(scope="module")
def whole(deck, tmp_path_factory):
    """The run that nobody disturbed, and the seconds it took."""
    begin = time.monotonic()
    run = run_deck(deck, tmp_path_factory.mktemp("whole"))
    return run, time.monotonic() - begin


def kill_after(seconds, *arguments):
    process = start(*arguments)
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
    out, err = process.communicate(timeout=60)
    if process.returncode != -signal.SIGKILL:
        assert_no_crash(process.returncode, out + err)
    return process.returncode


def assert_files_open(run):
    """What is there under its final name is whole, however the run ended."""
    if run.file(".csv").exists():
        text = run.file(".csv").read_text()
        *lines, rest = text.split("\n")
        assert rest == "" or len(lines) == 0
        n = len(lines[0].split(",")) if lines else 0
        assert all(len(line.split(",")) == n for line in lines)
    for suffix in (".h5", ".vtkhdf", ".rst.h5"):
        if run.file(suffix).exists():
            with h5py.File(run.file(suffix), "r") as file:
                file.visititems(lambda _, item: item[...] if hasattr(item, "shape") else None)
    if run.file(".vtkhdf").exists():
        fields = run.fields()
        assert len(fields.time) >= 1 and "displacement" in fields.names()
        read_with_vtk(run.file(".vtkhdf"), len(fields.time))


def read_with_vtk(path, n_frame):
    try:
        from vtkmodules.vtkIOHDF import vtkHDFReader
    except ImportError:
        return
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == n_frame
    for k in (0, n_frame - 1):
        reader.SetStep(k)
        reader.Update()
        assert reader.GetOutputDataObject(0).GetPointData().GetArray("displacement") is not None


def contents(path):
    """All data sets of an HDF5 file, but for those that tell how long something took."""
    found = {}

    def visit(name, item):
        if isinstance(item, h5py.Dataset) and not name.endswith("/cpu") and "/RUN/" not in name:
            found[name] = item[...]

    with h5py.File(path, "r") as file:
        file.visititems(visit)
        steps = file.get("VTKHDF/Steps")
        if steps is not None:
            found["NSteps"] = np.array(steps.attrs["NSteps"])
    return found


def said(run):
    """The verdict without what this process alone has spent and counted."""
    return {name: value for name, value in run.verdict.items()
            if name not in ("seconds", "counts", "memory")}


def assert_same_results(run, expected):
    assert run.digits() == expected.digits()
    assert said(run) == said(expected)
    for suffix in (".vtkhdf", ".h5"):
        one, other = contents(run.file(suffix)), contents(expected.file(suffix))
        assert one.keys() == other.keys()
        for name in one:
            assert one[name].tobytes() == other[name].tobytes(), f"{suffix}: {name}"
    left = [p.name for p in run.base.parent.iterdir() if p.suffix in (".part", ".tmp")]
    assert not left, left


def finish(run, deck):
    """Go on from the restart file, or begin again where the kill came before there was one."""
    if run.file(".rst.h5").exists():
        done = emcon("restart", run.file(".rst.h5"), "--quiet")
    else:
        done = emcon(deck, "--quiet", "--output", run.base.parent)
    assert done.returncode == 0, done.stderr


# ---- killed -------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(6))
def test_killed_at_a_random_moment(deck, whole, tmp_path, seed):
    expected, seconds = whole
    chance = random.Random(seed)
    run = Run(tmp_path / "ring")
    kill_after(chance.uniform(0, seconds), deck, "--quiet", "--output", tmp_path)
    assert_files_open(run)
    # And once more, while it goes on.
    if run.file(".rst.h5").exists():
        kill_after(chance.uniform(0, seconds), "restart", run.file(".rst.h5"), "--quiet")
        assert_files_open(run)
    finish(run, deck)
    assert_same_results(run, expected)


def test_killed_many_times_in_its_first_moments(deck, tmp_path):
    """Before and while the files are made; a later run is not disturbed by what is left."""
    run = Run(tmp_path / "ring")
    for k in range(12):
        kill_after(0.01*k, deck, "--quiet", "--output", tmp_path)
        assert_files_open(run)
    done = emcon(deck, "--quiet", "--output", tmp_path, "--set=t_end=0.2")
    assert done.returncode == 0, done.stderr
    assert len(run.history) == 11


def test_killed_run_keeps_what_was_before(deck, tmp_path):
    """A run over old results that dies at once leaves files that open."""
    run = run_deck(deck, tmp_path, t_end=0.2)
    before = contents(run.file(".vtkhdf"))
    kill_after(0.005, deck, "--quiet", "--output", tmp_path)
    assert_files_open(run)
    assert len(before["VTKHDF/Steps/Values"]) == 3


def test_restart_does_not_need_the_deck(deck, whole, tmp_path):
    """The restart file holds the deck with what --set said; the deck may have moved."""
    copy = shutil.copy(deck, tmp_path / "ring.inp")
    process = start(copy, "--quiet", "--output", tmp_path / "out", "--set", "t_end=2.0")
    run = Run(tmp_path / "out" / "ring")
    wait_for(run.file(".rst.h5"), process)
    process.kill()
    process.communicate()
    os.remove(copy)
    finish(run, None)
    assert run.digits() == whole[0].digits()


# ---- interrupted --------------------------------------------------------------------------------


def interrupt(deck, run, moment, number=signal.SIGINT):
    """Interrupt a run when `moment(process, attempt)` returns; again where it had ended by then."""
    for attempt in range(8):
        shutil.rmtree(run.base.parent, ignore_errors=True)
        process = start(deck, "--output", run.base.parent)
        moment(process, attempt)
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
        if process.returncode != 0:
            break
    return process.returncode, out, err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupt_keeps_all_whole_increments(deck, whole, tmp_path, number):
    expected, _ = whole
    run = Run(tmp_path / "out" / "ring")
    code, out, err = interrupt(deck, run, lambda process, _: wait_for(run.file(".rst.h5"), process), number)
    assert code == 130
    assert_no_crash(code, out + err)
    assert "interrupted after increment" in err and "emcon restart" in err
    assert_files_open(run)
    n_done = len(run.history) - 1
    assert 0 < n_done < len(expected.history) - 1
    # Nothing is lost: the restart file holds the last increment of the table.
    assert f"interrupted after increment {n_done};" in err
    finish(run, deck)
    assert_same_results(Run(run.base), expected)
    assert f"resumed after increment {n_done}" in run.file(".log").read_text()


def test_interrupt_before_the_first_increment(deck, whole, tmp_path):
    """At any moment of the first half: 130 with files that can be gone on with, or not begun."""
    for k in range(4):
        run = Run(tmp_path / str(k) / "ring")
        code, out, err = interrupt(deck, run, lambda _, attempt, k=k: time.sleep(whole[1]*k/8/2**attempt))
        if code == -signal.SIGINT:
            assert not run.file(".csv").exists()
            continue
        assert code == 130, err
        assert_no_crash(code, out + err)
        finish(run, deck)
        assert run.digits() == whole[0].digits()


# ---- odd restart files --------------------------------------------------------------------------


@pytest.fixture
def stopped(deck, whole, tmp_path):
    """A copy of a finished run, restart file and all."""
    for path in whole[0].base.parent.iterdir():
        shutil.copy(path, tmp_path / path.name)
    return Run(tmp_path / "ring")


def test_restart_of_a_finished_run_changes_nothing(stopped, whole):
    done = emcon("restart", stopped.file(".rst.h5"), "--quiet")
    assert done.returncode == 0, done.stderr
    assert_same_results(stopped, whole[0])


def damage_nothing_left(path):
    path.write_bytes(b"")


def damage_cut(path):
    data = path.read_bytes()
    path.write_bytes(data[: len(data)//2])


def damage_junk(path):
    path.write_bytes(random.Random(1).randbytes(50000))


def damage_text(path):
    path.write_text("this is not a restart file\n"*100)


def damage_foreign(path):
    path.unlink()
    with h5py.File(path, "w") as file:
        file["data"] = np.arange(10)


def damage_bits(path):
    """One byte in the middle of the displacements: checksums must notice."""
    with h5py.File(path, "r") as file:
        where = file["reals/u"].id
        offset = where.get_chunk_info(0).byte_offset if where.get_num_chunks() else None
        offset = where.get_offset() if offset is None else offset
    data = bytearray(path.read_bytes())
    data[offset + 200] ^= 0x40
    path.write_bytes(data)


def damage_entry_missing(path):
    with h5py.File(path, "a") as file:
        del file["reals/v"]


def damage_other_size(path):
    with h5py.File(path, "a") as file:
        del file["reals/v"]
        file["reals/v"] = np.zeros(10)


DAMAGES = [
    damage_nothing_left,
    damage_cut,
    damage_junk,
    damage_text,
    damage_foreign,
    damage_bits,
    damage_entry_missing,
    damage_other_size,
]


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda f: f.__name__.removeprefix("damage_"))
def test_broken_restart_file(stopped, whole, damage):
    path = stopped.file(".rst.h5")
    damage(path)
    done = emcon("restart", path, "--quiet")
    assert done.returncode in (2, 4)
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    assert path.name in done.stderr or "restart" in done.stderr
    # The results are as they were.
    assert stopped.digits() == whole[0].digits()
    assert contents(stopped.file(".vtkhdf")).keys() == contents(whole[0].file(".vtkhdf")).keys()


@pytest.mark.parametrize("suffix", [".rst.h5", ".h5", ".vtkhdf"])
def test_one_wrong_byte_anywhere_is_found(stopped, suffix):
    """Before the HDF5 library reads the file: some damages it never comes back from."""
    path = stopped.file(suffix)
    whole = path.read_bytes()
    chance = random.Random(7)
    # The seal, the first bytes of the library's, and any others.
    for place in [3, 10, 512, 520, 560, len(whole) - 1, *chance.choices(range(len(whole)), k=6)]:
        data = bytearray(whole)
        data[place] ^= 1 << chance.randrange(8)
        path.write_bytes(data)
        done = emcon("restart", stopped.file(".rst.h5"), "--quiet", timeout=30)
        assert done.returncode == 4, f"byte {place}: {done.stderr}"
        assert path.name in done.stderr and "damaged" in done.stderr
        assert path.read_bytes() == data, "the file was changed"
    for data in (whole[:-1], whole + b"\0", whole[:600]):
        path.write_bytes(data)
        done = emcon("restart", stopped.file(".rst.h5"), "--quiet", timeout=30)
        assert done.returncode == 4 and path.name in done.stderr
    path.write_bytes(whole)
    assert emcon("restart", stopped.file(".rst.h5"), "--quiet").returncode == 0


def seal_of(rest):
    """What stands before the bytes `rest` of a file: Fletcher's sums, in the integers of Python."""
    words = np.frombuffer(rest + b" "*(-len(rest) % 4), "<u4").astype(object)
    prime = 2**32 - 5
    first = 1 + np.cumsum(words)
    seal = f"EMCON\n{len(rest)} {int(first.sum()) % prime:08X}{int(first[-1]) % prime:08X}\n"
    return seal.ljust(512).encode()


def test_the_seal_is_the_sum_of_the_bytes(whole):
    """Behind it in the files of results a line that names the run, the same in both."""
    lines = []
    for suffix in (".rst.h5", ".h5", ".vtkhdf"):
        data = whole[0].file(suffix).read_bytes()
        sums = seal_of(data[512:]).rstrip(b" ")
        assert data.startswith(sums)
        lines.append(data[len(sums):512].rstrip(b" "))
    assert lines[0] == b"" and lines[1] == lines[2]
    assert re.fullmatch(rb"run \d+ [0-9A-F]{16}\n", lines[1])


@pytest.mark.parametrize("suffix", [".h5", ".vtkhdf"])
def test_files_of_another_run_are_refused(deck, stopped, tmp_path, suffix):
    """Whole ones, of the same deck with another --set: their seals fit, but not this run."""
    other = run_deck(deck, tmp_path / "other", h=0.04)
    shutil.copy(other.file(suffix), stopped.file(suffix))
    before = {p: p.read_bytes() for p in stopped.base.parent.glob("ring.*") if p.suffix != ".log"}
    done = emcon("restart", stopped.file(".rst.h5"), "--quiet")
    assert done.returncode == 4 and f"ring{suffix} is of another run" in done.stderr
    for path, data in before.items():
        assert path.read_bytes() == data, f"{path.name} was changed"


def test_another_build_is_told(stopped):
    """The file says of itself that it is of another BLAS: a warning, on the screen and in the log."""
    path = stopped.file(".rst.h5")
    with h5py.File(path, "a") as file:
        texts = file["texts/build"][...]
        kind = file["texts/build"].dtype
        assert len(texts[4]) > 0, "no BLAS is named"
        del file["texts/build"]
        before = texts[4]
        texts[4] = b"OpenBLAS of another machine"[: kind.itemsize]
        file.create_dataset("texts/build", data=texts, dtype=kind)
    rest = path.read_bytes()[512:]
    path.write_bytes(seal_of(rest) + rest)
    done = emcon("restart", path, "--quiet")
    assert done.returncode == 0, done.stderr
    for text in (done.stderr, stopped.log):
        assert "another BLAS: 'OpenBLAS of another machine'" in text and before.decode() in text


def test_missing_restart_file(tmp_path):
    done = emcon("restart", tmp_path / "none.rst.h5")
    assert done.returncode == 2
    assert "none.rst.h5" in done.stderr
    assert not list(tmp_path.iterdir())


def test_restart_wants_a_restart_file(deck):
    done = emcon("restart", deck)
    assert done.returncode == 2
    assert "NAME.rst.h5" in done.stderr


@pytest.mark.parametrize("suffix", [".vtkhdf", ".h5"])
def test_restart_without_the_results(stopped, suffix):
    stopped.file(suffix).unlink()
    others = {p: p.read_bytes() for p in stopped.base.parent.iterdir() if p.suffix != ".log"}
    done = emcon("restart", stopped.file(".rst.h5"), "--quiet")
    assert done.returncode in (2, 4)
    assert f"ring{suffix}" in done.stderr
    for path, data in others.items():
        assert path.read_bytes() == data, f"{path.name} was changed"


@pytest.mark.parametrize("rows", [0, 20])
def test_restart_brings_the_table_back(stopped, whole, rows):
    """NAME.csv has nothing that NAME.h5 has not: gone or cut, it is written anew."""
    table = stopped.file(".csv")
    lines = table.read_text().splitlines(keepends=True)
    table.write_text("".join(lines[:rows])) if rows else table.unlink()
    done = emcon("restart", stopped.file(".rst.h5"), "--quiet")
    assert done.returncode == 0, done.stderr
    assert_same_results(stopped, whole[0])


def test_restart_with_results_of_fewer_increments(stopped):
    """Results that end before the restart file does: said, not filled with gaps."""
    with h5py.File(stopped.file(".h5"), "a") as file:
        for column in file["history"].values():
            column.resize(20, axis=0)
    done = emcon("restart", stopped.file(".rst.h5"), "--quiet")
    assert done.returncode in (2, 4)
    assert "ring.h5" in done.stderr


def test_a_new_run_drops_the_restart_file_of_an_earlier_one(tmp_path):
    """Killed before it wrote one itself, it must not go on from the state of another run."""
    deck = DECKS / "ring.inp"
    run_deck(deck, tmp_path, h=0.05, t_end=0.1)
    restart = tmp_path / "ring.rst.h5"
    assert restart.exists()
    process = start(deck, "--quiet", "--output", tmp_path, "--set=h=0.001")
    deadline = time.monotonic() + 30.0
    while restart.exists() and time.monotonic() < deadline:
        time.sleep(0.005)
    process.kill()
    process.communicate()
    assert not restart.exists()
    done = emcon("restart", restart)
    assert done.returncode == 2 and "no such file" in done.stderr
