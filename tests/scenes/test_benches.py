"""The benches, the book's generator and the generators of decks run: in short forms."""

import re
import subprocess
import sys

import pytest
from scene_tools import CRASH, DECKS, ROOT, Deck, emcon, generated

BENCH = ROOT / "tests" / "bench"
sys.path.insert(0, str(BENCH))

import bench_targets  # noqa: E402
import kept_runs  # noqa: E402
import trade_coarse  # noqa: E402
import trade_discs  # noqa: E402
import trade_fine  # noqa: E402
import trade_first  # noqa: E402
import trade_knobs  # noqa: E402
import trade_studies  # noqa: E402
from bench_counts import rises  # noqa: E402
from floors import factor_columns  # noqa: E402
from peers.ring import ring_of  # noqa: E402


def run(*command):
    done = subprocess.run([sys.executable, *map(str, command)], capture_output=True, text=True,
                          timeout=300)  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert not CRASH.search(done.stdout + done.stderr)
    return done.stdout


@pytest.mark.parametrize(("name", "least"), [
    ("bench_ring", 10), pytest.param("bench_python", 10, marks=pytest.mark.long), ("bench_discs", 4),
    pytest.param("bench_ties_space", 7, marks=pytest.mark.long), ("bench_friction_space", 6)])
def test_bench(name, least):
    """Its tables are there; their figures are nothing to judge by."""
    lines = run(BENCH / f"{name}.py", "--short").splitlines()
    assert len([line for line in lines if line]) >= least


@pytest.mark.parametrize("program", sorted(BENCH.glob("*.f90")), ids=lambda path: path.stem)
def test_programs_compile(program, tmp_path):
    """Against the modules of the library as they are; to link and run them is for `make bench`."""
    config = (ROOT / "build" / "config.mk").read_text()
    compiler = re.search(r"^COMPILER := \S+ (\S+)", config, re.M)[1]
    done = subprocess.run([compiler, "-std=f2018", "-fsyntax-only", "-J", tmp_path, "-I",
                           ROOT / "build" / "release" / "mod", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_counts_that_rise_are_told():
    """By more than three per cent, of those that are stored; new ones are none."""
    stored = {"ring": {"newton": 100, "tangents": 100, "cuts": 0}}
    found = {"ring": {"newton": 104, "tangents": 103, "cuts": 0, "new": 5}, "other": {"newton": 9}}
    assert rises(stored, found) == (["ring: newton 100 -> 104"], [])
    assert rises(found, stored) == ([], ["ring: newton 104 -> 100"])
    assert rises(stored, {"ring": {"cuts": 1}})[0]


def test_the_table_of_goals_says_what_their_reports_say():
    page = trade_studies.PAGE.read_text()
    shown = {name: re.search(f"<!-- {name} -->\n(.*?)<!-- end -->", page, re.DOTALL)[1].splitlines()
             for name in ("goals", "goal table")}
    assert trade_studies.goal_table(shown["goals"]) == shown["goal table"]
    assert len(shown["goal table"]) == 2 + 5


def test_runs_of_trade_go_on_where_they_were(tmp_path):
    """A run that is there is taken as it is; not one of another deck, or that did not end."""
    deck = Deck.read(DECKS / "bouncing_bar.inp")
    asked = {"t_end": 0.1, "frame": 0.1}
    _, first = kept_runs.run_once(tmp_path/"run", deck, asked)
    assert kept_runs.run_once(tmp_path/"run", deck, asked)[1] == first
    run, other = kept_runs.run_once(tmp_path/"run", deck, {**asked, "t_end": 0.05})
    assert other != first and run.history["time"][-1] == pytest.approx(0.05)
    (tmp_path/"run"/"took.json").rename(tmp_path/"run"/"took.part")
    assert kept_runs.run_once(tmp_path/"run", deck, {**asked, "t_end": 0.05})[1] != other


def test_explicit_knobs_run_below_their_critical_step(tmp_path):
    name, make, parameters = trade_knobs.SCENES[1]
    for knob in (trade_knobs.EXPLICIT, trade_knobs.EXPLICIT_PENALTY):
        run, done = trade_knobs.run_of(make(), tmp_path/str(len(list(tmp_path.iterdir()))),
                                       {**parameters, "t_end": 1.2, "frame": 1.2}, knob)
        assert run, f"{name}: {done.errors}"
        assert "h is 0.9 of it" in run.log and run.history["active"].max() > 0


def test_table_of_phases():
    lines = run(BENCH / "bench_counts.py", "--phases", "--short").splitlines()
    assert any(line.startswith("| factorise |") for line in lines)


def test_targets(tmp_path):
    """Runs of the table, a few increments each: their energy is exact, the rows say met or not."""
    options = bench_targets.arguments().parse_args(["--short"])
    rows = [*bench_targets.whole_runs(tmp_path, 1, options),
            *bench_targets.decks(tmp_path, 1, options)]
    # The system counts the time of a process in ticks: that of a run of milliseconds may be 0.
    assert len(rows) == 9 and all(row.found >= 0 for row in rows if "exponent" not in row.scene)
    assert sum(row.found for row in rows if row.unit == " s") > 0
    assert all(row.error < 1e-10 for row in rows if row.error is not None)


@pytest.mark.parametrize(("found", "is_least", "told"), [(0.5, False, "met"), (2, False, "missed"),
                                                         (2, True, "met"), (0.5, True, "missed")])
def test_targets_that_are_missed(found, is_least, told):
    assert told in bench_targets.Row("scene", 1, " s", found, is_least=is_least).cells()


def test_entries_of_the_factor():
    """Not less than those of the matrix below its diagonal, which nodes of one element make."""
    ring = ring_of((8, 1), (6, 1))
    free = set(ring.node) - set(ring.bottom)
    pairs = {(a, b) for nodes in ring.element.values() for a in nodes for b in nodes
             if a <= b and {a, b} <= free}
    column, n = factor_columns(ring), 2*len(free)
    assert len(column) == n
    assert sum(3 if a == b else 4 for a, b in pairs) <= column.sum() < n*(n + 1)/2


def test_chapter_of_the_book():
    text = run(BENCH / "verification.py", "patch")
    assert text.startswith("patch\n") and text.count("|") > 6


@pytest.mark.long
def test_table_of_simplifications():
    """The scene of docs/trade.md that is the quickest to run, each kind once."""
    lines = run(BENCH / "trade.py", "--rounds", "1", "gears").splitlines()
    assert len(lines) == 8 and all(line.count("|") == 11 for line in lines)
    assert all("e-1" in line for line in lines[2:])                 # the balances close


def test_table_of_first_contact(tmp_path, monkeypatch):
    """A row of docs/trade.md: both treatments, three increments; what is there is not run again."""
    monkeypatch.setattr(trade_first, "KEPT", tmp_path)
    lines, runs = trade_first.lines_of(["punch"])
    assert len(lines) == 3 and lines[2].count("|") == 11 and len(runs) == 6
    assert "`PERSISTENT`" in lines[2]
    assert all(r["energy"][0][0] < 1e-12 and r["verdict"] == "good" for r in runs.values())
    monkeypatch.setattr(trade_first, "run", None)
    assert trade_first.lines_of(["punch"])[0] == lines


@pytest.mark.long
def test_table_of_drawn_fine_scenes():
    """Of the first three scenes all shed their mass, and none ends worse for it."""
    lines = trade_fine.lines_of(range(3))
    assert lines[0].startswith("`AUTO` is `MASSLESS` in 3 of 3 drawn scenes; of these 0 end worse")
    assert [line.count("|") for line in lines[2:]] == 4*[6]


@pytest.mark.long
def test_table_of_discs():
    """Without mass at the rim the force is smoother with half of h; with it it is rough."""
    lines = trade_discs.lines_of(edges=(24,), steps=(0.01, 0.005))
    rough = [float(line.split("|")[4]) for line in lines[2:]]
    assert len(rough) == 4 and rough[3] < 0.5*rough[2] < 0.1*min(rough[:2])


def test_force_of_the_bar_in_closed_form():
    """Over a period contact gives what gravity takes: mass 10, g 10, 16/3."""
    means = trade_studies.closed_form(16/3)["force"]
    assert sum(means[::2]) == 0.0
    assert sum(means[1::2])*16/3/50 == pytest.approx(10*10*16/3, rel=1e-14)
    assert trade_studies.force_of_bar(1.2, 1.2 + 1e-6) == pytest.approx(360, rel=1e-6)
    assert trade_studies.force_of_bar(4.0, 4.0 + 1e-6) == pytest.approx(400, rel=1e-6)


@pytest.mark.parametrize("order", [0.5, 1.0, 2.0])
def test_orders_of_a_power(order):
    """Slopes of errors, each the mean of two increments, that grow as a power of the increment."""
    sizes = (0.04, 0.02, 0.01)
    rows = [{"h": f"{k*h:.6g}", "own_force": repr(3.0*(k*h)**order)} for h in sizes
            for k in (1, trade_studies.BESIDE)]
    slope, last = trade_studies.slope_of(rows, "force", sizes)
    assert float(slope) == order
    beside = trade_studies.BESIDE**(order/2)
    assert float(last) == pytest.approx(3.0*0.01**order*beside, rel=0.05)


def test_goal_of_the_bar(tmp_path, monkeypatch):
    """The force of each increment to 5 %: with massless surfaces, and with massive ones never."""
    monkeypatch.setattr(trade_studies, "FOLDER", tmp_path)
    steps = (0.02, 0.005)
    words, rows, command = trade_studies.goal_of_bar(tmp_path, 2, steps=steps, decks=("bar.inp",))
    # Both treatments, both steps, the precisions whose programs there are.
    assert sum(row["role"] == "member" for row in rows) == 4*(1 + trade_studies.SINGLE.exists())
    told = " ".join(line for line in words.splitlines() if line.startswith("goal scatter"))
    assert re.search(r"the cheapest setting is .*initiation=MASSLESS.*h=0.005", told)
    assert "with h alone the deck's own does not meet the goal down to h=0.005" in told
    # Which precision is cheaper is the clock's to say; with the deck's own the knob is alone.
    chosen = told.split("the cheapest setting is ")[1].split(";")[0]
    assert ("initiation=MASSLESS alone: " in told) == ("precision=single" in chosen)
    assert command.startswith("python -m emcon study bar.inp --vary deck=bar.inp")


def test_what_a_fifth_of_the_bar_pays_for(tmp_path, monkeypatch):
    """Its start is no less than a hundredth of the run, and no more than all of it."""
    monkeypatch.setattr(trade_studies, "FOLDER", tmp_path)
    line = trade_studies.fifths(1, ["bar"], rounds=1)[-1]
    name, increments, own, fifth, start, paid = (word.strip() for word in line.strip("| ").split("|"))
    assert (name, increments) == ("bar", "1100")
    # Printed to a thousandth.
    assert 0.01*float(own) < float(start) < float(own) == pytest.approx(5*float(fifth), abs=6*0.0005)
    assert 0 <= int(paid) < 220


@pytest.mark.parametrize("generator", sorted(p.name for p in DECKS.glob("make_*.py")))
def test_generator_of_decks(generator, tmp_path):
    """What it makes by default is the deck of its name, one that the program accepts."""
    deck = tmp_path / "made.inp"
    generated(generator.removesuffix(".py"), "--output", str(deck))
    assert deck.read_text() == (DECKS / f"{generator[5:-3]}.inp").read_text()
    done = emcon("check", deck, "--quiet")
    assert done.returncode == 0, done.stderr


def test_every_deck_has_a_generator():
    made = {f"make_{p.stem}.py" for p in DECKS.glob("*.inp")}
    assert made == {p.name for p in DECKS.glob("make_*.py")}


def test_what_massless_surfaces_cost_coarse_bodies(tmp_path):
    """Of four elements across seven sixteenths of the mass move, and the momentum comes back."""
    make = trade_coarse.BODIES["square on its side"]
    for treatment, moved in (("PERSISTENT", 0.0), ("MASSLESS", 44.0)):
        momentum, cuts, found = trade_coarse.fall(make, 4, 0.01, treatment, tmp_path)
        assert cuts == 0 and found == moved
        assert momentum[0] < 0 < momentum[-1]
