"""Whether massless surfaces may be the default: both treatments of first contact on all scenes.

    .venv/bin/python tests/bench/trade_first.py [--update] [words of the names of scenes]

Decks of input_decks/ and plain scenes of tests/scenes/, each with the increment of its deck, half
of it and an eighth. Writes between the marks `first` of docs/trade.md. Figures are kept in
build/trade/PROGRAM: what was interrupted goes on.
"""

import argparse
import concurrent.futures
import json
import math
import pathlib
import re
import sys
import tempfile

import numpy as np
from trade import NTS, PAGE, PROGRAM, ROOT

from book.common import size, table  # isort: skip, `trade` says where
from plain_scenes import AUTO, SCENES
from scene_tools import DECKS, Deck
from timing import usage
from verification import update

sys.path.insert(0, str(ROOT / "pywrap"))

from emcon.results import ResultError, ResultPaths  # noqa: E402
from emcon.study.measures import measure, read_verdict  # noqa: E402

KEPT = ROOT / "build" / "trade"
TREATMENTS = ("PERSISTENT", "MASSLESS")
#: Of the increment of the deck; the last is what the others are held against.
PARTS = (1.0, 0.5, 0.125)
#: Decks of input_decks/ with dynamic contact of elastic bodies, and what is shortened.
OF_DECKS = {"ring": {"t_end": 4, "frame": 4}, "bouncing_bar": {"t_end": 2, "frame": 2},
            "bar_on_wall": {}, "self_contact": {}, "three_bodies": {}, "two_bodies": {},
            "tied_ring": {"t_end": 4, "frame": 4}}
SECONDS = 600


def scenes():
    """Name, deck and parameters."""
    for name, parameters in OF_DECKS.items():
        yield name.replace("_", " "), Deck.read(DECKS / f"{name}.inp"), parameters
    for name, make in SCENES.items():
        yield name, make().deck(AUTO), NTS


def step_of(deck):
    return float(re.search(r"^h = (\S+)", deck.text(), re.MULTILINE)[1])


def record(name, deck, parameters, treatment, part):
    """What one run gave; kept by scene, treatment, increment and program."""
    folder = KEPT / str(int(PROGRAM.stat().st_mtime)) / "first"
    folder.mkdir(parents=True, exist_ok=True)
    kept = folder / f"{name}-{treatment}-{part:g}.json".replace(" ", "_")
    if kept.exists():
        return json.loads(kept.read_text())
    found = run(deck, {**parameters, "h": step_of(deck)*part, "initiation": treatment})
    kept.write_text(json.dumps(found) + "\n")
    return found


def run(deck, parameters):
    with tempfile.TemporaryDirectory() as folder:
        path = deck.write(pathlib.Path(folder) / "deck.inp")
        done = usage([PROGRAM, path, "--quiet", "--output", folder,
                      *(f"--set={name}={value}" for name, value in parameters.items())])
        paths = ResultPaths(pathlib.Path(folder) / "deck")
        verdict = read_verdict(paths)
        found = {"cpu": done.cpu, "cuts": verdict.get("cuts", 0),
                 "verdict": verdict.get("verdict", "none"), "reasons": verdict.get("reasons", [])}
        try:
            measures = measure(paths)
        except ResultError:
            return found
    names = ("energy", "penetration", "stand_off", "position", "impulse")
    return found | {name: measures[name].rows.tolist() for name in names if name in measures}


def chosen(deck, parameters):
    """The treatment that `AUTO`, the default, takes."""
    with tempfile.TemporaryDirectory() as folder:
        path = deck.write(pathlib.Path(folder) / "deck.inp")
        told = usage([PROGRAM, "check", path, *(f"--set={name}={value}" for name, value in {
            **parameters, "initiation": "AUTO"}.items())]).text
    return "`MASSLESS`" if "first contact: MASSLESS" in told else "`PERSISTENT`"


def away(found, exact, name):
    """How far a run is from its limit, by the largest row; nan where it is not measured."""
    a, b = (np.array(r.get(name, [[math.nan]])) for r in (found, exact))
    scale = np.linalg.norm(b, axis=1).max()
    return np.linalg.norm(a - b, axis=1).max()/scale if scale > 0 else math.nan


def largest(runs, name):
    return max((r[name][0][0] for r in runs if name in r), default=math.nan)


def share(value):
    return "" if math.isnan(value) else f"{100*value:.2g} %" if value >= 1e-4 else "< 0.01 %"


def line_of(name, runs, default):
    """A row of the table; `runs` by treatment and part, `default` what `AUTO` takes."""
    of = {t: [runs[t, part] for part in PARTS] for t in TREATMENTS}
    massive, massless = of["PERSISTENT"], of["MASSLESS"]
    both = [(share(away(runs_of[0], runs_of[-1], "position")),
             share(away(runs_of[0], runs_of[-1], "impulse"))) for runs_of in of.values()]
    bad = {t: sum(r["verdict"] != "good" for r in of[t]) for t in TREATMENTS}
    return (name, f"{massless[0]['cpu']/massive[0]['cpu']:.2f}",
            f"{massless[-1]['cpu']/massive[-1]['cpu']:.2f}",
            " / ".join(str(sum(r["cuts"] for r in of[t])) for t in TREATMENTS),
            " / ".join(map(str, bad.values())),
            *(f"{size(largest(massive, key))} / {size(largest(massless, key))}"
              for key in ("energy", "stand_off")),
            *(" / ".join(pair) if any(pair) else "" for pair in zip(*both, strict=True)), default)


HEAD = ["scene", "CPU", "CPU, h/8", "cuts", "bad", "energy", "stand-off", "position", "impulse",
        "`AUTO`"]


def lines_of(only, jobs=1):
    wanted = [scene for scene in scenes()
              if not only or any(word in scene[0] for word in only)]
    asked = [(scene, t, part) for scene in wanted for t in TREATMENTS for part in PARTS]
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        found = list(pool.map(lambda one: record(*one[0], *one[1:]), asked))
    by_key = {(scene[0], t, part): r for (scene, t, part), r in zip(asked, found, strict=True)}
    rows = []
    for name, deck, parameters in wanted:
        runs = {(t, part): by_key[name, t, part] for t in TREATMENTS for part in PARTS}
        rows.append(line_of(name, runs, chosen(deck, parameters)))
    return table(HEAD, rows), by_key


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--update", action="store_true", help="write into docs/trade.md")
    parser.add_argument("--jobs", type=int, default=1, help="runs at a time (1)")
    parser.add_argument("only", nargs="*", help="words of the names of scenes")
    options = parser.parse_args()
    lines, runs = lines_of(options.only, options.jobs)
    print(*lines, sep="\n")
    for (name, treatment, part), found in runs.items():
        if found["verdict"] != "good":
            print(f"{name}, {treatment}, {part:g} h: {'; '.join(found['reasons'])}")
    if options.update:
        PAGE.write_text(update(PAGE.read_text(), "first", lines))


if __name__ == "__main__":
    main()
