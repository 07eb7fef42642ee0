"""The benches, the book's generator and the generators of decks run: in short forms."""

import subprocess
import sys

import pytest
from scene_tools import CRASH, DECKS, ROOT, emcon

BENCH = ROOT / "tests" / "bench"
sys.path.insert(0, str(BENCH))

from bench_counts import rises  # noqa: E402


def run(*command):
    done = subprocess.run([sys.executable, *map(str, command)], capture_output=True, text=True,
                          timeout=300)  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert not CRASH.search(done.stdout + done.stderr)
    return done.stdout


@pytest.mark.parametrize(("name", "least"), [("bench_ring", 10), ("bench_python", 10),
                                             ("bench_discs", 4)])
def test_bench(name, least):
    """Its tables are there; their figures are nothing to judge by."""
    lines = run(BENCH / f"{name}.py", "--short").splitlines()
    assert len([line for line in lines if line]) >= least


def test_counts_that_rise_are_told():
    """By more than three per cent, of those that are stored; new ones are none."""
    stored = {"ring": {"newton": 100, "tangents": 100, "cuts": 0}}
    found = {"ring": {"newton": 104, "tangents": 103, "cuts": 0, "new": 5}, "other": {"newton": 9}}
    assert rises(stored, found) == (["ring: newton 100 -> 104"], [])
    assert rises(found, stored) == ([], ["ring: newton 104 -> 100"])
    assert rises(stored, {"ring": {"cuts": 1}})[0]


def test_table_of_phases():
    lines = run(BENCH / "bench_counts.py", "--phases", "--short").splitlines()
    assert any(line.startswith("| factorise |") for line in lines)


def test_chapter_of_the_book():
    text = run(BENCH / "verification.py", "patch")
    assert text.startswith("patch\n") and text.count("|") > 6


def test_table_of_simplifications():
    """The scene of docs/trade.md that is the quickest to run, each kind once."""
    lines = run(BENCH / "trade.py", "--rounds", "1", "gears").splitlines()
    assert len(lines) == 8 and all(line.count("|") == 11 for line in lines)
    assert all("e-1" in line for line in lines[2:])                 # the balances close


@pytest.mark.parametrize("generator", sorted(p.name for p in DECKS.glob("make_*.py")))
def test_generator_of_decks(generator, tmp_path):
    """What it makes by default is the deck of its name, one that the program accepts."""
    deck = tmp_path / "made.inp"
    run(DECKS / generator, "--output", deck)
    assert deck.read_text() == (DECKS / f"{generator[5:-3]}.inp").read_text()
    done = emcon("check", deck, "--quiet")
    assert done.returncode == 0, done.stderr


def test_every_deck_has_a_generator():
    made = {f"make_{p.stem}.py" for p in DECKS.glob("*.inp")}
    assert made == {p.name for p in DECKS.glob("make_*.py")}
