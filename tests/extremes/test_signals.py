"""Signals: a run that is asked to stop leaves a restart file, soon, and says so with exit code 130."""

import os
import signal
import subprocess
import time

import pytest
from scene_tools import Run, assert_no_crash, coarse_ring, emcon, run_deck, start, wait_for

#: The whole run in one increment, cut into hundreds of parts: three iterations are not enough.
ONE_INCREMENT = {"h": 1.5, "t_end": 1.5}
#: More increments than any test waits for.
LONG = ["--set=h=0.0005"]


@pytest.fixture(scope="module")
def deck(tmp_path_factory):
    deck = coarse_ring()
    deck.insert("*NEWTON, MAXIMUM=3")
    return deck.write(tmp_path_factory.mktemp("deck") / "ring.inp")


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    """The same as it is."""
    return coarse_ring().write(tmp_path_factory.mktemp("flight") / "ring.inp")


@pytest.fixture(scope="module")
def whole(deck, tmp_path_factory):
    """The run in one increment that nobody disturbed."""
    return run_deck(deck, tmp_path_factory.mktemp("whole"), **ONE_INCREMENT)


def begun(folder, *arguments, **options):
    """A run that has left its files, and its results."""
    run = Run(folder / "ring")
    process = start(*arguments, "--output", folder, **options)
    wait_for(run.file(".csv"), process)
    return process, run


def end(process):
    out, err = process.communicate(timeout=60)
    assert_no_crash(process.returncode, (out or "") + (err or ""))
    return err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_cut_increment_listens(deck, whole, tmp_path, number):
    """It ends within its iteration; the restart file is that of the last whole increment."""
    options = [f"--set={name}={value}" for name, value in ONE_INCREMENT.items()]
    process, run = begun(tmp_path, deck, *options)
    time.sleep(0.05)
    process.send_signal(number)
    err = end(process)
    assert process.returncode == 130, err
    assert "interrupted after increment 0;" in err
    assert len(run.history) == 1
    done = emcon("restart", run.file(".rst.h5"), "--quiet")
    assert done.returncode == 0, done.stderr
    assert whole.history["cuts"].sum() > 3, "the increment is hardly cut"
    assert Run(run.base).digits() == whole.digits()


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGTERM])
def test_a_signal_leaves_a_restart_file(flight, tmp_path, number):
    process, run = begun(tmp_path, flight, *LONG)
    process.send_signal(number)
    err = end(process)
    assert process.returncode == 130, err
    assert run.file(".rst.h5").exists() and "emcon restart" in err


@pytest.mark.long
def test_standard_output_that_nobody_reads_any_more(flight, tmp_path):
    """As under `emcon deck | head -1`: the first line that is not taken stops the run."""
    read_end, write_end = os.pipe()
    # The first line comes after five seconds.
    process, run = begun(tmp_path, flight, "--set=h=0.0001", stdout=write_end)
    os.close(write_end)
    os.close(read_end)
    err = end(process)
    assert process.returncode == 130, err
    assert run.file(".rst.h5").exists()


def test_a_second_one_ends_at_once(deck, tmp_path):
    """Also where the first is not heard: the program is held up here by a pipe that is full."""
    read_end, write_end = os.pipe()
    os.set_blocking(write_end, False)
    try:
        while True:
            os.write(write_end, b" "*4096)
    except BlockingIOError:
        os.set_blocking(write_end, True)
    process = start(deck, "--set=h=0.05", "--set=t_end=0.1", "--output", tmp_path, stdout=write_end)
    log = tmp_path / "ring.log"
    limit = time.monotonic() + 30
    while not (log.exists() and "verdict" in log.read_text()):
        assert process.poll() is None and time.monotonic() < limit
        time.sleep(0.01)
    process.send_signal(signal.SIGTERM)
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(0.3)
    process.send_signal(signal.SIGTERM)
    assert process.wait(10) == 130
    os.close(write_end)
    os.close(read_end)
    process.stderr.close()


def test_the_same_signal_twice_in_a_moment_is_one(flight, tmp_path):
    """`timeout` signals the process and then its group."""
    process, run = begun(tmp_path, flight, *LONG)
    for _ in range(3):
        process.send_signal(signal.SIGTERM)
        time.sleep(0.002)
    err = end(process)
    assert process.returncode == 130 and "emcon restart" in err
    assert run.file(".rst.h5").exists()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_what_is_ignored_stays_ignored(flight, tmp_path, number):
    """Under `nohup`, and in the background of a script."""
    process, run = begun(
        tmp_path, flight, "--set=h=0.02", "--set=t_end=0.8", ignored=[number]
    )
    for _ in range(3):
        process.send_signal(number)
        time.sleep(0.15)
    err = end(process)
    assert process.returncode == 0, err
    assert len(run.history) == 41
