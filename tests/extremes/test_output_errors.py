"""Output that cannot be written: told in one line, exit code 4, nothing lost that was there."""

import os
import pathlib
import resource
import shutil
import signal
import subprocess
import time

import h5py
import pytest
from emcon.__main__ import _COMMANDS as COMMANDS
from scene_tools import DECKS, PROGRAM, Run, assert_no_crash, emcon, root_user, run_deck

DECK = DECKS / "ring.inp"
SHORT = ["--quiet", "--set=h=0.05", "--set=t_end=0.2"]


def assert_told(done, code, *words):
    assert done.returncode == code, done.stderr
    text = done.stderr.strip()
    assert len(text.splitlines()) == 1, text
    for word in words:
        assert word in text, text


def contents(folder):
    return {p.name: p.read_bytes() for p in pathlib.Path(folder).iterdir() if p.is_file()}


# ---- exit codes ---------------------------------------------------------------------------------


def test_code_0(tmp_path):
    done = emcon(DECK, "--output", tmp_path, *SHORT, "--set=h=0.02")     # without a warning
    assert done.returncode == 0
    assert done.stdout == done.stderr == ""


@pytest.mark.parametrize(
    "arguments",
    [
        ["no_such.inp"],
        ["--no-such-option", DECK],
        [DECK, DECK],
        [DECK, "--set"],
        [DECK, "--set", "h"],
        [DECK, "--set", "no_such=1"],
        [DECK, "--set", "h=abc"],
        [DECK, "--set", "h=0"],
        [DECK, "--set", "h=-0.1"],
        [DECK, "--set", "h=nan"],
        [DECK, "--set", "h=inf"],
        [DECK, "--set", "t_end=0.001"],
        [DECK, "--output"],
        ["check"],
        ["restart"],
        [str(DECKS)],
        ["/dev/null"],
    ],
    ids=lambda arguments: " ".join(pathlib.Path(str(a)).name for a in arguments),
)
def test_code_2(tmp_path, arguments):
    if "--output" not in arguments:
        arguments = [*arguments, "--output", tmp_path / "out"]
    done = emcon(*arguments, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert done.stderr.strip()
    assert not list(tmp_path.iterdir()), "something was written"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["chek", DECK], "did you mean check?"),
        ([DECK, "--set"], "known: H=0.01, T_END=8"),
        ([DECK, "--set", "--output", "out"], "known: H=0.01, T_END=8"),
        ([DECK, "--set", "hh=1"], "did you mean H? (known: H=0.01"),
        (["restart", "no_such.rst.h5"], "no_such.rst.h5: there is no such file"),
        ([DECK, "--output", "--quiet"], "--output needs a value"),
        *(([verb, "run"], f"a command of the Python package: python -m emcon {verb}")
          for verb in COMMANDS),
    ],
)
def test_a_slip_is_told_with_what_is_known(tmp_path, arguments, words):
    done = emcon(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert words in done.stderr
    assert not list(tmp_path.iterdir())


# ---- folders ------------------------------------------------------------------------------------


def test_folders_are_made(tmp_path):
    done = emcon(DECK, "--output", tmp_path / "a" / "b c" / "d", *SHORT)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a" / "b c" / "d" / "ring.csv").exists()


def test_results_go_beside_the_deck(tmp_path):
    shutil.copy(DECK, tmp_path / "my.scene.inp")
    done = emcon("my.scene.inp", *SHORT, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert {p.name for p in tmp_path.iterdir()} == {
        f"my.scene.{suffix}" for suffix in ("inp", "csv", "h5", "json", "log", "vtkhdf", "rst.h5")
    }


def test_output_is_a_file(tmp_path):
    path = tmp_path / "results"
    path.write_text("precious")
    assert_told(emcon(DECK, "--output", path, *SHORT), 4, "results")
    assert path.read_text() == "precious"
    assert_told(emcon(DECK, "--output", path / "deeper", *SHORT), 4, "results")


@pytest.mark.parametrize("suffix", [".csv", ".h5", ".vtkhdf", ".log", ".rst.h5"])
def test_a_result_is_a_folder(tmp_path, suffix):
    (tmp_path / f"ring{suffix}").mkdir()
    done = emcon(DECK, "--output", tmp_path, *SHORT)
    assert_told(done, 4, f"ring{suffix}")
    assert (tmp_path / f"ring{suffix}").is_dir()
    assert not [p for p in tmp_path.iterdir() if p.suffix in (".part", ".tmp")]


@pytest.mark.skipif(root_user(), reason="root may write anywhere")
def test_unwritable_folder(tmp_path):
    (tmp_path / "locked").mkdir(mode=0o555)
    assert_told(emcon(DECK, "--output", tmp_path / "locked", *SHORT), 4, "locked")
    assert_told(emcon(DECK, "--output", tmp_path / "locked" / "in", *SHORT), 4, "locked")


def test_folder_that_nobody_can_write():
    assert_told(emcon(DECK, "--output", "/proc/emcon", *SHORT), 4, "/proc/emcon")


@pytest.mark.skipif(root_user(), reason="root may write anywhere")
@pytest.mark.parametrize("suffix", [".csv", ".h5", ".vtkhdf", ".log"])
def test_old_result_that_must_not_be_written(tmp_path, suffix):
    """The log is written in place; the others are replaced, which the folder decides."""
    run_deck(DECK, tmp_path, h=0.05, t_end=0.1)
    (tmp_path / f"ring{suffix}").chmod(0o444)
    done = emcon(DECK, "--output", tmp_path, *SHORT)
    assert done.returncode == (4 if suffix == ".log" else 0), done.stderr


# ---- full disk ----------------------------------------------------------------------------------


def limited(kilobytes):
    """No file may grow beyond this: as on a full disk, but for each file by itself."""

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (kilobytes*1024, kilobytes*1024))

    return limit


@pytest.mark.parametrize("kilobytes", [0, 1, 2, 4, 8, 16, 64, 150, 300, 500])
def test_file_size_limit(tmp_path, kilobytes):
    """From nothing at all to all but the last frames of the field file."""
    run = Run(tmp_path / "ring")
    done = emcon(
        DECK, "--output", tmp_path, "--quiet", "--set=h=0.05", "--set=t_end=1",
        preexec_fn=limited(kilobytes),
    )  # fmt: skip
    assert_told(done, 4, "ring.")
    assert "File too large" in done.stderr
    assert_whole(run)


def assert_whole(run):
    for suffix in (".h5", ".vtkhdf", ".rst.h5"):
        if run.file(suffix).exists():
            with h5py.File(run.file(suffix), "r") as file:
                file.visititems(lambda _, item: item[...] if hasattr(item, "shape") else None)
    if run.file(".csv").exists():
        text = run.file(".csv").read_text()
        assert text == "" or text.endswith("\n")
        widths = {line.count(",") for line in text.splitlines()}
        assert len(widths) <= 1


def test_rows_before_the_failure_are_kept(tmp_path):
    expected = run_deck(DECK, tmp_path / "whole", h=0.05, t_end=1)
    run = Run(tmp_path / "limited" / "ring")
    emcon(
        DECK, "--output", run.base.parent, "--quiet", "--set=h=0.05", "--set=t_end=1",
        preexec_fn=limited(500),
    )  # fmt: skip
    rows, all_rows = run.digits()["total"], expected.digits()["total"]
    assert 5 < len(rows) <= len(all_rows)
    assert rows == all_rows[: len(rows)]
    assert len(run.fields().time) >= 1


def test_old_results_outlive_a_run_that_cannot_begin(tmp_path):
    run_deck(DECK, tmp_path, h=0.05, t_end=0.5)
    before = contents(tmp_path)
    done = emcon(DECK, "--output", tmp_path, *SHORT, preexec_fn=limited(2))
    assert done.returncode == 4
    after = contents(tmp_path)
    for suffix in (".h5", ".vtkhdf", ".rst.h5"):
        assert after[f"ring{suffix}"] == before[f"ring{suffix}"]


@pytest.fixture
def small_disk(tmp_path):
    """`small_disk(kilobytes)` is the folder of a new file system; needs the right to mount."""
    folder = tmp_path / "disk"
    folder.mkdir()

    def mount(kilobytes):
        command = ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", folder]
        if not root_user() or subprocess.run(command, capture_output=True).returncode != 0:
            pytest.skip("no right to mount a small disk")
        return folder

    yield mount
    if os.path.ismount(folder):
        subprocess.run(["umount", folder], check=True)


@pytest.mark.parametrize("kilobytes", [16, 100, 250, 600, 900])
def test_disk_full(small_disk, kilobytes):
    """At the start, while the first files are made, and in the middle of the run."""
    disk = small_disk(kilobytes)
    done = emcon(DECK, "--output", disk, "--quiet", "--set=h=0.05", "--set=t_end=2")
    assert_told(done, 4, "No space left on device")
    assert_whole(Run(disk / "ring"))


def test_read_only_disk(small_disk):
    disk = small_disk(4000)
    run_deck(DECK, disk, h=0.05, t_end=0.1)
    before = contents(disk)
    subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
    assert_told(emcon(DECK, "--output", disk, *SHORT), 4, "Read-only file system")
    assert contents(disk) == before


def test_standard_output_full():
    """Results matter more than the progress line."""
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [PROGRAM, "--help"], stdout=full, stderr=subprocess.PIPE, text=True, timeout=60
        )
    assert_no_crash(done.returncode, done.stderr)


def test_standard_output_closed(tmp_path):
    """As under `emcon deck | head -1`."""
    done = subprocess.run(
        f"'{PROGRAM}' '{DECK}' --output '{tmp_path}' --set h=0.05 --set t_end=0.5 | head -c 1",
        shell=True,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert_no_crash(done.returncode, done.stderr)
    assert len(Run(tmp_path / "ring").history) == 11


# ---- two runs -----------------------------------------------------------------------------------


def test_two_runs_on_the_same_output(tmp_path):
    run = Run(tmp_path / "ring")
    options = ["--output", tmp_path, "--quiet"]
    first = subprocess.Popen([PROGRAM, DECK, *map(str, options), "--set=h=0.02", "--set=t_end=2"])
    try:
        end = time.monotonic() + 30
        while not run.file(".csv").exists():
            assert time.monotonic() < end
            time.sleep(0.002)
        assert_told(emcon(DECK, *options), 4, "ring.log", "another run")
        if run.file(".rst.h5").exists():
            assert_told(emcon("restart", run.file(".rst.h5")), 4, "another run")
        assert first.poll() is None, "the first run was too short for this test"
        assert first.wait(60) == 0
    finally:
        first.kill()
    assert len(run.history) == 101
    assert "verdict" in run.log
    # The lock goes with the run.
    assert emcon(DECK, "--output", tmp_path, *SHORT).returncode == 0


def test_a_killed_run_holds_no_lock(tmp_path):
    process = subprocess.Popen([PROGRAM, DECK, "--quiet", "--output", tmp_path])
    end = time.monotonic() + 30
    while not (tmp_path / "ring.csv").exists():
        assert time.monotonic() < end
        time.sleep(0.002)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert emcon(DECK, "--output", tmp_path, *SHORT).returncode == 0


def test_same_deck_into_two_folders(tmp_path):
    running = [
        subprocess.Popen([PROGRAM, DECK, "--output", tmp_path / name, *SHORT]) for name in "ab"
    ]
    assert [process.wait(60) for process in running] == [0, 0]


def test_deck_is_not_overwritten(tmp_path):
    """A deck without extension is no reason to write over it."""
    deck = shutil.copy(DECK, tmp_path / "ring")
    text = pathlib.Path(deck).read_bytes()
    done = emcon("ring", *SHORT, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert pathlib.Path(deck).read_bytes() == text
    deck = shutil.copy(DECK, tmp_path / "other.csv")
    done = emcon("other.csv", *SHORT, cwd=tmp_path)
    assert_no_crash(done.returncode, done.stderr)
    assert pathlib.Path(deck).read_bytes() == text, "the deck was overwritten by a result"


def test_umask_is_kept(tmp_path):
    emcon(DECK, "--output", tmp_path, *SHORT, preexec_fn=lambda: os.umask(0o077))
    for path in tmp_path.iterdir():
        assert path.stat().st_mode & 0o077 == 0, path.name
