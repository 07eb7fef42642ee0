"""Where the time of a run goes: the table of phases in NAME.log and NAME.json."""

import resource

import pytest
from scene_tools import DECKS, Deck, run_deck

PHASES = ["read", "search", "gaps", "residual", "assemble", "eliminate", "factorise", "solve",
          "restitution", "judge", "vectors", "output"]


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    """A run of some seconds, and the CPU time that the system says it took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run = run_deck(DECKS/"ring.inp", tmp_path_factory.mktemp("ring"), h=0.04)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return run, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def table(run):
    """Rows of the table at the end of the log: seconds, per cent, and what was counted."""
    lines = run.log.splitlines()
    (start,) = [k for k, line in enumerate(lines) if line.startswith("phase  ")]
    (end,) = [k for k, line in enumerate(lines) if line.startswith("memory: ")]
    rows = [line.split(maxsplit=3) for line in lines[start + 1:end]]
    return {name: (float(seconds), float(share), "".join(rest))
            for name, seconds, share, *rest in rows}


def test_phases_are_all_of_the_time(ring):
    run, cpu = ring
    rows = table(run)
    assert list(rows) == [*PHASES, "all"]
    assert sum(rows[name][0] for name in PHASES) == pytest.approx(rows["all"][0], abs=0.01)
    assert rows["all"][0] == pytest.approx(cpu, rel=0.05)
    assert sum(run.verdict["seconds"].values()) == pytest.approx(rows["all"][0], abs=0.001)


def test_elements_and_factors_take_most_of_it(tmp_path):
    """None of the phases that do hard work is charged to the rest: with a factor for each correction
    they take some fifteen times as much as what is left, which no load of the machine turns round."""
    deck = Deck.read(DECKS/"ring.inp")
    deck.replace("*NEWTON,", "*NEWTON, TYPE=FULL,")
    rows = table(run_deck(deck, tmp_path, h=0.05, t_end=1, frame=1))
    hard = [rows[name][0] for name in ("assemble", "factorise")]
    assert min(hard) > 0.25*rows["vectors"][0] and sum(hard) > 3*rows["vectors"][0]


def test_counts_are_those_of_newtons_method(tmp_path):
    """In statics, without cuts, it factorises once per iteration."""
    run = run_deck(DECKS/"press_fit.inp", tmp_path)
    counts, rows = run.verdict["counts"], table(run)
    assert counts["factorisations"] == run.history["newton"].sum() == run.verdict["newton"]
    assert counts["solutions"] >= counts["factorisations"]
    assert counts["tangents"] >= counts["factorisations"]
    assert rows["factorise"][2].startswith(str(counts["factorisations"]))
    # Once where the step begins, and once for each set that was solved.
    assert counts["searched"] >= 2*run.verdict["increments"]


def test_without_contact_nothing_is_searched(tmp_path):
    counts = run_deck(DECKS/"spinning_ring.inp", tmp_path, h=0.05, t_end=0.5).verdict["counts"]
    assert counts["searched"] == counts["measured"] == 0 < counts["tangents"]
