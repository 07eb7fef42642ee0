"""Studies for docs/trade.md: what three goals cost at least, and errors against time and step.

    .venv/bin/python tests/bench/trade_studies.py [--update] [--jobs N] [goals] [fifths] [orders] [adaptive]

Each is a `python -m emcon study` of decks that are made here, in build/trade/PROGRAM; what was
interrupted goes on. Writes between the marks `goals`, `fifths`, `orders` and `adaptive`, and the figure.
Needs the program, for single precision the one of `make app PRECISION=single`.
"""

import argparse
import csv
import dataclasses
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys

import numpy as np
from trade import NTS, PAGE, PROFILE, PROGRAM, ROOT, ball, bar, drawn, massive, ring
from trade_knobs import SINGLE, knobbed

from book.common import COLOURS, axes, common_legend, save, table  # isort: skip, `trade` says where
from scene_tools import DECKS, Deck
from timing import usage
from verification import update

#: By both programs: a study does not go on with another one.
FOLDER = ROOT / "build" / "trade" / "-".join(str(int(program.stat().st_mtime))
                                             for program in (PROGRAM, SINGLE) if program.exists())
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT / "pywrap"), "OMP_NUM_THREADS": "1",
               "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "agg"}
TREATMENTS = ("MASSLESS", "PERSISTENT", "ADMISSIBLE", "VELOCITY UPDATE")
#: Of a run [s]: what takes longer is no setting to choose.
LONGEST = 600


# ---- decks --------------------------------------------------------------------------------------


def by_sets(deck):
    """The ball with sets in place of labels, so that its mesh can be refined."""
    held = []
    for head, lines in deck.card:
        if head.startswith("*INITIAL CONDITIONS"):
            lines[:] = ["BALL, 1, 0.3", "BALL, 2, -1."]
        if head.startswith("*BOUNDARY"):
            held = [line.split(",")[0] for line in lines]
            lines[:] = ["HELD, 1, 2"]
    deck.insert("*NSET, NSET=HELD\n" + "\n".join(held) + "\n", before="*BOUNDARY")
    return deck


def ball_deck(kind):
    return by_sets(drawn(ball, "BLOCK", None)(kind))


def generated(generator, *options):
    """The path of a deck that a generator of input_decks/ makes."""
    path = FOLDER / f"{generator}.inp"
    path.parent.mkdir(parents=True, exist_ok=True)
    subprocess.run([sys.executable, DECKS / f"make_{generator}.py", *options, "--output", path],
                   check=True)
    return massive(path).write(path)


def adaptive(deck, tolerance, events):
    """Increments follow the error, and end where contact begins and ends."""
    text = deck.text().replace("*DYNAMIC, DIRECT", "*DYNAMIC")
    text = text.replace("SCHEME=<scheme>", f"SCHEME=<scheme>, TOLERANCE={tolerance}")
    if events:
        text = text.replace("*CONTACT INITIATION", "*EVENTS, TYPE=PAIR\n*CONTACT INITIATION")
    return Deck(text)


def force_of_bar(start, end):
    """Mean contact force of the bar of `bouncing_bar.inp` in the closed form."""

    def impulse(t):
        first, second = (np.clip(t - begin, 0, 2/3) for begin in (1, 11/3))
        return 300*first + 150*first**2 + 500*second - 150*second**2

    return (impulse(end) - impulse(start))/(end - start)


def closed_form(t_end, windows=50):
    ends = np.linspace(0, t_end, windows + 1)
    means = force_of_bar(ends[:-1], ends[1:])
    return {"force": [x for mean in means for x in (0.0, float(mean))], "scatter": 0.0}


@dataclasses.dataclass(frozen=True)
class Case:
    """A scene: its deck, the parameters of all runs, the h of the deck, and step sizes."""

    name: str
    deck: object
    fixed: dict
    h: float
    steps: tuple


CASES = {
    "ring": Case("ring on a foundation", lambda: ring("elastic"),
                 {**NTS, "t_end": "4", "frame": "4"}, 0.01, (0.04, 0.02, 0.01, 0.005, 0.0025)),
    "ball": Case("ball on a block", lambda: ball_deck("elastic"), NTS, 0.01,
                 (0.02, 0.01, 0.005, 0.0025, 0.00125)),
    "bar": Case("bouncing bar", lambda: bar("elastic"), {**NTS, "t_end": "2", "frame": "2"}, 0.005,
                (0.01, 0.005, 0.0025, 0.00125, 0.000625)),
}


def write_decks(folder, decks):
    folder.mkdir(parents=True, exist_ok=True)
    for name, deck in decks.items():
        path = folder / f"{name}.inp"
        text = knobbed(deck).text()
        if not path.exists() or path.read_text() != text:
            path.write_text(text)


# ---- studies ------------------------------------------------------------------------------------


def study(folder, deck, options, jobs):
    """Words and rows of a study in `folder`, and its command as one would type it there."""
    command = ["study", f"{deck}.inp", *options, "--output", f"{deck}_study"]
    done = subprocess.run(
        [sys.executable, "-m", "emcon", *command, "--no-figures", "--program", PROGRAM, "--jobs",
         str(jobs), "--time-limit", str(LONGEST)],
        cwd=folder, env=ENVIRONMENT, capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stdout + done.stderr
    with (folder / f"{deck}_study" / "table.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["status"] == "done"]
    return done.stdout, rows, shlex.join(["python", "-m", "emcon", *command[:-2]])


def vary(**knobs):
    """Options for knobs; several values are varied, one is set."""
    found = []
    for name, values in knobs.items():
        many = isinstance(values, (tuple, list))
        text = ",".join(map(str, values)) if many else str(values)
        found += ["--vary" if many else "--set", f"{name}={text}"]
    return found


# ---- goals --------------------------------------------------------------------------------------

BAR_STEPS = (0.02, 0.01, 0.005, 0.0025, 0.00125, 0.000625, 0.0003125)
HALVES = (0.05, 0.025, 0.02, 0.0125, 0.00625, 0.003125, 0.0015625)


def precisions():
    return {"precision": ("double", "single")} if SINGLE.exists() else {}


def goal_of_ring(folder, jobs):
    coarse = generated("ring", "--ring", "64x2")
    write_decks(folder, {"ring": ring("elastic"), "ring_on_profile": ring(PROFILE),
                         "ring_64x2_on_profile": ring(PROFILE, coarse)})
    return study(folder, "ring", [
        *vary(deck=("ring.inp", "ring_on_profile.inp", "ring_64x2_on_profile.inp"),
              initiation=("MASSLESS", "PERSISTENT"), **precisions(), h=HALVES, t_end=4,
              frame=4), "--repeat", "2", "--goal", "rebound:1e-2"], jobs)


def goal_of_ball(folder, jobs):
    write_decks(folder, {"ball": ball_deck("elastic")})
    steps = (0.01, 0.005, 0.0025, 0.00125, 0.000625)
    return study(folder, "ball", [
        *vary(mesh=(1, 2), initiation=("MASSLESS", "PERSISTENT"), **precisions(), h=steps,
              formulation="NODE TO SURFACE"), "--goal", "position:1e-3"], jobs)


def goal_of_bar(folder, jobs, steps=BAR_STEPS, decks=("bar.inp", "bar_of_25.inp")):
    coarse = Deck.read(generated("bouncing_bar", "--elements", "25"))
    write_decks(folder, {"bar": bar("elastic"), "bar_of_25": coarse})
    (folder / "bar.json").write_text(json.dumps(closed_form(5.5)))
    return study(folder, "bar", [
        *vary(deck=decks, initiation=("MASSLESS", "PERSISTENT"),
              **precisions(), h=steps), "--repeat", "2", "--reference",
        "closed-form:bar.json", "--goal", "force:5e-2", "--goal", "scatter:5e-2"], jobs)


GOALS = {"ring": goal_of_ring, "ball": goal_of_ball, "bar": goal_of_bar}


def goals(jobs, names=GOALS):
    """Commands and what they say of their goals."""
    lines = []
    for name in names:
        words, _, command = GOALS[name](FOLDER / "goals", jobs)
        told = [line for line in words.splitlines() if line.startswith("goal ")]
        lines += ["```sh", *re.sub(r" (?=--(vary|set|goal|repeat|reference))", " \\\\\n    ",
                                   command).splitlines(), "```", "", "```text"]
        lines += [line.replace("; ", ";\n    ") for line in told] + ["```", ""]
    return [part for line in lines for part in line.split("\n")]


def goal_table(lines):
    """A row for each goal by what the reports of `goals` say."""
    rows, told = [], []
    for line in lines:
        if line.startswith("goal "):
            told.append(line)
        elif told and line.startswith("    ") and not line.startswith("    --"):
            told[-1] += " " + line.strip()
    for text in told:
        goal, words = text.removeprefix("goal ").split(": the cheapest setting is ", 1)
        ratio, kind, own = re.search(r"([0-9.]+) times (cheaper|dearer) than the deck's own \((.*?)\);",
                                     words).groups()
        alone = [(name.split("=")[0], float(n)) for name, n, misses in re.findall(
            r"(\w+=[^;:]*) alone: ([0-9.]+) times(, and the goal is not met)?", words)]
        most = [f"{name} {n:g}" for name, n in sorted(alone, key=lambda one: -one[1]) if n > 1]
        times, = re.search(r"for ([0-9.]+) times the time", words).groups()
        meets = "alone the deck's own meets" in words
        rows.append((goal, "misses it" if "the goal is not met" in own else "meets it",
                     "meets it" if meets else "misses it with every h and mesh",
                     f"{ratio} times {kind}", f"{'' if meets else 'more than '}{times} times cheaper",
                     ", ".join(most)))
    return table(["goal", "the deck's own setting", "its treatment, any h", "cheapest against the deck's own",
                  "against its treatment", "one knob alone, times cheaper"], rows)


# ---- what a fifth pays for ----------------------------------------------------------------------

#: Decks of the goals as they are: name, deck, parameters, h, end.
OWN = (("ring", lambda: ring("elastic"), {"t_end": 4, "frame": 4}, 0.01, 4.0),
       ("ball", lambda: ball_deck("elastic"), {}, 0.01, 1.0),
       ("bar", lambda: bar("elastic"), {}, 0.005, 5.5))


def least(deck, parameters, rounds):
    """The least processor time of some runs."""
    folder = FOLDER / "fifths"
    options = [f"--set={name}={value}" for name, value in parameters.items()]
    runs = [usage([PROGRAM, folder / f"{deck}.inp", "--quiet", "--output", folder / "out",
                   *options]) for _ in range(rounds)]
    assert all(run.code in (0, 3) for run in runs), runs[0].errors
    return min(run.cpu for run in runs)


def fifths(_, names=tuple(case[0] for case in OWN), rounds=9):
    """How many increments of the deck's own a fifth of its time pays for, beside its start."""
    lines = []
    for name, make, fixed, h, end in OWN:
        if name not in names:
            continue
        deck = make()
        write_decks(FOLDER / "fifths", {name: deck})
        output = {"frame": h} if "<frame>" in deck.text() else {}
        own = least(name, {**fixed, "h": h}, rounds)
        start = least(name, {**fixed, "h": h, "t_end": h, **output}, rounds)
        paid = max(0, int((own/5 - start)/(own - start)*(end/h - 1)))
        lines.append((name, f"{end/h:.0f}", f"{own:.3f}", f"{own/5:.3f}", f"{start:.3f}", f"{paid}"))
    return table(["deck", "increments", "CPU s", "a fifth", "one increment", "a fifth pays for"],
                 lines)


# ---- orders through an impact -------------------------------------------------------------------

#: Beside each step size one that meets the impact elsewhere.
BESIDE = 1.19
SHOWN = {"displacement": "displacements", "impulse": "impulse", "force": "force"}


def orders_of(case, name, jobs, steps=None):
    """Rows of the table: slopes of errors against each treatment's own finest run."""
    folder = FOLDER / "orders"
    write_decks(folder, {name: case.deck()})
    sizes = steps or case.steps[:-1]
    finest = sizes[-1]/4
    fixed = {key: value for key, value in case.fixed.items() if key != "formulation"}
    steps = [f"{h:.6g}" for h in (*sizes, *(BESIDE*h for h in sizes), finest)]
    _, rows, _ = study(folder, name, vary(
        initiation=TREATMENTS, formulation=("NODE TO SURFACE", "MORTAR"), h=steps, **fixed), jobs)
    for formulation in ("NODE TO SURFACE", "MORTAR"):
        for treatment in TREATMENTS:
            chosen = [row for row in rows if row["role"] == "member" and
                      (row["initiation"], row["formulation"]) == (treatment, formulation)]
            yield (case.name, f"`{formulation}`", f"`{treatment}`",
                   *(cell for measure in SHOWN for cell in slope_of(chosen, measure, sizes)),
                   apart(chosen, finest))


def errors_at(rows, measure, sizes, kind="own"):
    """Of each size and the one beside it, the geometric mean."""
    by_h = {float(row["h"]): float(row[f"{kind}_{measure}"]) for row in rows
            if row[f"{kind}_{measure}"]}
    return [np.sqrt(np.prod([by_h[float(f"{k*h:.6g}")] for k in (1, BESIDE)])) for h in sizes]


def slope_of(rows, measure, sizes):
    """Slope over all sizes, and the error at the smallest one."""
    errors = errors_at(rows, measure, sizes)
    slope = np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    return f"{slope:.1f}", f"{errors[-1]:.1e}"


def apart(rows, finest):
    """Displacements of the finest run from those of massless surfaces."""
    (row,) = (row for row in rows if float(row["h"]) == float(f"{finest:.6g}"))
    text = row["error_finest_displacement"]
    return "" if row["initiation"] == "MASSLESS" and row["formulation"] == "NODE TO SURFACE" \
        else f"{float(text):.1e}"


def orders(jobs, names=CASES, steps=None):
    lines = [line for name in names for line in orders_of(CASES[name], name, jobs, steps)]
    return table(["scene", "formulation", "first contact", "displacements, order", "at last",
                  "impulse, order", "at last", "force, order", "at last", "limits apart"], lines)


# ---- adaptive steps -----------------------------------------------------------------------------

TOLERANCES = ("1e-1", "1e-2", "1e-3")


def adaptive_of(case, name, jobs, tolerances=TOLERANCES, steps=None):
    """Rows of runs with fixed and with adaptive increments, held against one fine run.

    Events with massless surfaces alone: nodes with mass come and go too often.
    """
    folder = FOLDER / "adaptive"
    sizes = steps or case.steps
    write_decks(folder, {name: case.deck()})
    both = ("MASSLESS", "PERSISTENT")
    _, fixed, _ = study(folder, name, vary(
        initiation=both, h=[f"{h:.6g}" for h in (*sizes, sizes[-1]/4)], **case.fixed), jobs)
    reference = min((row for row in fixed if row["initiation"] == "MASSLESS"),
                    key=lambda row: float(row["h"]))
    where = next(row["folder"] for row in manifest(folder / f"{name}_study")
                 if row["index"] == reference["index"])
    free = []
    for events, treatments in ((False, both), (True, both[:1])):
        decks = {f"{name}_{tolerance}{'_events' if events else ''}":
                 adaptive(knobbed(case.deck()), tolerance, events) for tolerance in tolerances}
        write_decks(folder, decks)
        _, rows, _ = study(folder, next(iter(decks)), [
            *vary(deck=[f"{deck}.inp" for deck in decks], initiation=treatments, h=f"{case.h:g}",
                  **case.fixed), "--reference", f"file:{name}_study/{where}/{name}"], jobs)
        free += rows
    return [row for row in fixed if row is not reference], free


def manifest(folder):
    with (folder / "manifest.csv").open() as file:
        return list(csv.DictReader(file))


def curve(row):
    """Treatment, kind of increments, and their size or tolerance."""
    if "deck" not in row:
        return row["initiation"], "fixed h", row["h"]
    _, tolerance, *events = pathlib.Path(row["deck"]).stem.split("_")
    return (row["initiation"], "`TOLERANCE`, `*EVENTS`" if events else "`TOLERANCE`", tolerance)


def figures(row):
    kind = "file" if "deck" in row else "finest"
    return [float(row[f"error_{kind}_{measure}"] or "nan") for measure in SHOWN]


def adaptive_lines(jobs, figure=None, names=CASES, **short):
    lines = []
    pictures = axes(len(names)) if figure else [None]*len(names)
    for name, picture in zip(names, pictures, strict=True):
        fixed, free = adaptive_of(CASES[name], name, jobs, **short)
        rows = sorted([*fixed, *free], key=lambda row: (*curve(row)[:2], -float(curve(row)[2])))
        if picture is not None:
            draw(picture, CASES[name].name, rows)
        for row in rows:
            treatment, kind, value = curve(row)
            lines.append((CASES[name].name, f"`{treatment}`", kind, f"{float(value):g}",
                          row["increments"], f"{float(row['cpu']):.2g}",
                          *(f"{error:.1e}" for error in figures(row)), row["verdict"]))
    if figure:
        common_legend(pictures[-1], 3)
        save(figure)
    return table(["scene", "first contact", "increments", "h or tolerance", "number", "CPU s",
                  *SHOWN.values(), "verdict"], lines)


def draw(picture, title, rows):
    """Errors of displacements over processor time."""
    kinds = list(dict.fromkeys(curve(row)[:2] for row in rows))
    for treatment, kind in kinds:
        chosen = [row for row in rows if curve(row)[:2] == (treatment, kind)]
        picture.loglog([float(row["cpu"]) for row in chosen], [figures(row)[0] for row in chosen],
                       color=COLOURS[0 if treatment == "MASSLESS" else 1], lw=1, ms=4,
                       marker={"fixed h": "o", "`TOLERANCE`": "^"}.get(kind, "s"),
                       ls="-" if kind == "fixed h" else ":",
                       label=f"{treatment}, {kind.replace('`', '')}")
    picture.xaxis.set_minor_formatter("")
    picture.set(title=title, xlabel="CPU time [s]", ylabel="displacements, rms error")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--update", action="store_true", help="write into docs/")
    parser.add_argument("--jobs", type=int, default=1, help="runs at a time (1)")
    parser.add_argument("only", nargs="*", choices=["goals", "fifths", "orders", "adaptive",
                                                      []])
    options = parser.parse_args()
    figure = PAGE.parent / "trade_steps.png" if options.update else None
    for name, make in (("goals", goals), ("fifths", fifths), ("orders", orders),
                       ("adaptive", lambda jobs: adaptive_lines(jobs, figure))):
        if options.only and name not in options.only:
            continue
        lines = make(options.jobs)
        print(*lines, sep="\n", flush=True)
        if options.update:
            PAGE.write_text(update(PAGE.read_text(), name, lines))
            if name == "goals":
                PAGE.write_text(update(PAGE.read_text(), "goal table", goal_table(lines)))


if __name__ == "__main__":
    main()
