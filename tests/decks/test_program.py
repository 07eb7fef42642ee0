"""The program itself: time in proportion to the deck, little memory, a full disk, odd names."""

from __future__ import annotations

import os
import resource
import subprocess

import pytest
from test_decks import EMCON, GOOD


def run(*args, **more):
    return subprocess.run([EMCON, *map(str, args)], stdin=subprocess.DEVNULL, text=True, timeout=60,
                          **{"capture_output": True, **more})


def many(n):
    """A deck of `n` parameters, node sets, materials and surface interactions."""
    parameters = "*PARAMETER\n" + "".join(f"P{i} = 1\n" for i in range(n))
    cards = "".join(f"*NSET, NSET=N{i}\n<P{i}>, N{max(0, i - 1)}\n*MATERIAL, NAME=M{i}\n*ELASTIC\n1., 0.3\n"
                    f"*SURFACE INTERACTION, NAME=I{i}\n" for i in range(1, n))
    head, tail = GOOD.split("*MATERIAL", 1)
    return f"{parameters}{head}*NSET, NSET=N0\n1\n{cards}*MATERIAL{tail}"


def test_reading_takes_time_in_proportion_to_the_deck(tmp_path):
    """Of processor time of the program; each name once looked for one by one takes 16 times as long."""
    seconds = []
    for n in (2000, 8000):
        (tmp_path/"a.inp").write_text(many(n))
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        done = run("check", "--quiet", tmp_path/"a.inp")
        assert done.returncode == 0, done.stderr
        seconds.append(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)
    assert seconds[1] < 7.5*seconds[0]


def limited(kilobytes):
    return lambda: resource.setrlimit(resource.RLIMIT_AS, (kilobytes*1024, kilobytes*1024))


@pytest.mark.skipif(os.environ.get("MODE") == "sanitize", reason="a sanitizer reserves address space")
@pytest.mark.parametrize("megabytes", [120, 300, 360])
@pytest.mark.parametrize("verb", ["--version", "check"])
def test_little_address_space(verb, megabytes):
    """Does what it is asked to, or says what is missing; it does not wait for ever."""
    deck = [os.path.join(os.path.dirname(__file__), "good_plain.inp")] if verb == "check" else []
    done = run(verb, *deck, preexec_fn=limited(1000*megabytes), env=os.environ | {"OMP_NUM_THREADS": "3"})
    assert done.returncode == 0 or (done.returncode == 3 and "ulimit -v" in done.stderr)


@pytest.mark.parametrize("args", [["--version"], ["--help"], ["check", "good_plain.inp"]])
def test_a_full_disk_behind_standard_output(args):
    with open("/dev/full", "w") as full:
        done = run(*args, cwd=os.path.dirname(__file__), capture_output=False, stdout=full, stderr=subprocess.PIPE)
    assert done.returncode == 4 and "cannot write to standard output" in done.stderr


def test_control_characters_do_not_reach_a_terminal(tmp_path):
    """Of Unicode, that is: a deck with those of ASCII is no text. CSI 31 m would be red."""
    deck = tmp_path/"a.inp"
    deck.write_text(GOOD.replace("MASTER", "MAS\x9b31mTER").replace("S3", "S9"), encoding="utf-8")
    done = run("check", deck)
    assert done.returncode == 2 and "\x9b" not in done.stderr + done.stdout
    done = run("check", tmp_path/"\x1b[31m.inp")
    assert done.returncode == 2 and "\x1b" not in done.stderr
