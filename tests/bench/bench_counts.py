"""What the program does, counted: against stored counts, and by phases for rings of several sizes.

    .venv/bin/python tests/bench/bench_counts.py            # compare with tests/bench/counts.json
    .venv/bin/python tests/bench/bench_counts.py --phases   # the table of docs/performance.md
    ... --update                                            # write what was found into either

Counts that are more than three per cent above those stored make it fail; seconds are printed, and
nothing is judged by them. `--short` for the quickest scene, `--long` for a fourth ring. What
increments allocate is counted by tests/scenes/test_off.py.
"""

import argparse
import collections
import json
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

import crowds  # noqa: E402
from peers import plate  # noqa: E402
from scene_tools import DECKS, ROOT, Deck, run_deck  # noqa: E402
from verification import update  # noqa: E402

STORE = pathlib.Path(__file__).with_name("counts.json")
PAGE = ROOT/"docs/performance.md"
#: A count may rise by this factor.
MOST = 1.03
SCENES = {
    "two_bodies": {"h": 0.05, "t_end": 2},
    "ring": {"h": 0.04, "t_end": 4, "initiation": "PERSISTENT"},
    "ring, MORTAR": {"h": 0.04, "t_end": 4, "formulation": "MORTAR", "initiation": "PERSISTENT"},
    "ring, massless": {"h": 0.04, "t_end": 4, "initiation": "MASSLESS"},
    "spinning_ring": {"h": 0.05, "t_end": 2},
    "tied_ring": {"h": 0.05, "t_end": 2, "initiation": "PERSISTENT"},
    "self_contact": {},
    "press_fit": {},
    "hertz": {},
    "pile": {"t_end": 0.3},
    "strips": {"t_end": 6e-4},
    "strips, MORTAR": {"t_end": 6e-4, "formulation": "MORTAR"},
    "fold": {"t_end": 1, "formulation": "NODE TO SURFACE"},
    "ball on plate": {},
}
#: One pile takes its way by chance: that of a set of contacts, of a factor that is made anew. Five
#: of them together tell three per cent.
SEEDS = {"pile": range(1, 6)}
#: Of the verdict, beside `counts`.
OWN = ("increments", "newton", "cuts")
RINGS = (("64x4", "60x5"), ("128x8", "120x10"), ("256x16", "240x20"))
#: With `--long`.
BIG = (("512x32", "480x40"), ("1024x64", "960x80"))
INCREMENTS = 50


def decks(base):
    """Those that a scene consists of."""
    if base == "ball on plate":
        return [Deck(plate.deck(plate.scene(), 0.005, 14), "plate")]
    if base not in crowds.SCENES:
        return [DECKS/f"{base}.inp"]
    make = crowds.SCENES[base]
    return [make(seed=seed) for seed in SEEDS[base]] if base in SEEDS else [make()]


def count(name, folder):
    """Counts of a scene, and the seconds it took: all, and those of search and gaps."""
    counts, took, near = collections.Counter(), 0.0, 0.0
    for deck in decks(name.split(",")[0]):
        verdict = run_deck(deck, folder, **SCENES[name]).verdict
        for key, n in [*((key, verdict[key]) for key in OWN), *verdict["counts"].items()]:
            counts[key] += n
        seconds = verdict["seconds"]
        took += sum(seconds.values())
        near += seconds["search"] + seconds["gaps"]
    return dict(counts), took, near


def rises(stored, found):
    """What is told of counts: those that rose by more than is allowed, those that fell by as much."""
    above, below = [], []
    for scene, counts in found.items():
        for name, n in counts.items():
            before = stored.get(scene, {}).get(name)
            if before is None:
                continue
            text = f"{scene}: {name} {before} -> {n}"
            if n > MOST*before:
                above.append(text)
            elif before > MOST*n:
                below.append(text)
    return above, below


def compare(scenes, writes):
    """Run `scenes`, print their counts; whether none has risen."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in scenes:
            found[name], seconds, near = count(name, folder)
            told = ", ".join(f"{n} {key}" for key, n in found[name].items())
            print(f"{name}: {told}; {seconds:.2f} s, search and gaps {100*near/seconds:.0f} %",
                  flush=True)
    stored = json.loads(STORE.read_text()) if STORE.exists() else {}
    above, below = rises(stored, found)
    for text in below:
        print("fallen:", text, "(--update keeps that)")
    for text in above:
        print("RISEN:", text)
    if writes:
        STORE.write_text(json.dumps(stored | found, indent=1) + "\n")
    return writes or not above


def ring_run(ring, block):
    """Unknowns, seconds, counts and bytes of results of so many increments of the ring."""
    with tempfile.TemporaryDirectory() as folder:
        deck = pathlib.Path(folder)/f"ring_{ring}.inp"
        subprocess.run([sys.executable, DECKS/"make_ring.py", "--ring", ring, "--block", block,
                        "--output", deck], check=True)
        run = run_deck(deck, folder, h=0.01, t_end=0.01*INCREMENTS, frame=1)
        unknowns = int(re.search(r"(\d+) unknowns in step 1", run.log)[1])
        deck.unlink()
        written = sum(file.stat().st_size for file in pathlib.Path(folder).iterdir())
        return unknowns, run.verdict["seconds"], run.verdict["counts"], written


#: Phases that the table names otherwise than the program.
NAMES = {"judge": "overlap check"}


def phases(sizes):
    """Lines of the table of phases: milliseconds per increment, and shares."""
    columns = [ring_run(*size)[:3] for size in sizes]
    lines = ["| phase | " + " | ".join(f"{n} unknowns" for n, _, _ in columns) + " |",
             "|---"*(len(columns) + 1) + "|"]
    for name in columns[0][1]:
        cells = []
        for _, seconds, _ in columns:
            per = 1e3*seconds[name]/INCREMENTS
            cells.append(f"{per:.3g} ms, {100*seconds[name]/sum(seconds.values()):.1f} %")
        lines.append(f"| {NAMES.get(name, name)} | " + " | ".join(cells) + " |")
    lines.append("| all | " + " | ".join(
        f"{1e3*sum(seconds.values())/INCREMENTS:.3g} ms" for _, seconds, _ in columns) + " |")
    for name in ("tangents", "residuals", "factorisations", "solutions", "searched", "measured"):
        lines.append(f"| {name} per increment | " + " | ".join(
            f"{counts[name]/INCREMENTS:.2f}" for _, _, counts in columns) + " |")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("phases", "update", "short", "long"):
        parser.add_argument(f"--{name}", action="store_true")
    options = parser.parse_args()
    if options.phases:
        lines = phases(RINGS[:1] if options.short else RINGS + BIG[:1]*options.long)
        print("\n".join(lines))
        if options.update:
            PAGE.write_text(update(PAGE.read_text(), "phases", lines))
    elif not compare(["two_bodies"] if options.short else SCENES, options.update):
        sys.exit("counts have risen by more than three per cent")


if __name__ == "__main__":
    main()
