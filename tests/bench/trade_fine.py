"""What the default of first contact does to bodies of many elements: scenes drawn by chance.

    .venv/bin/python tests/bench/trade_fine.py [--update] [--scenes N]

Scenes of `draw_fine` of tests/soak/random_scenes.py, by nodes, segments or mortar, with and without
friction, each with `PERSISTENT` and as the default, `AUTO`, would have it. Writes between the marks
`fine` of docs/trade.md.
"""

import argparse
import pathlib
import random
import statistics
import sys
import tempfile

from trade import PAGE, PROGRAM, ROOT

sys.path.insert(0, str(ROOT / "tests" / "soak"))

from book.common import size, table  # noqa: E402
from plain_scenes import AUTO, BOTH, ONE  # noqa: E402
from random_scenes import draw_fine  # noqa: E402
from timing import usage  # noqa: E402
from verification import update  # noqa: E402

sys.path.insert(0, str(ROOT / "pywrap"))

from emcon.results import ResultPaths  # noqa: E402
from emcon.study.measures import read_verdict  # noqa: E402

TREATMENTS = ("PERSISTENT", "AUTO")
SURFACE = "*SURFACE INTERACTION, NAME=SMOOTH\n"


def deck_of(seed):
    """Text of a drawn scene, and its formulation."""
    chance = random.Random(seed)
    scene = draw_fine(chance)
    formulation = chance.choice(["NODE TO SURFACE"]*3 + ["SEGMENT", "MORTAR"])
    sides = chance.choice([AUTO, AUTO, AUTO, ONE, BOTH if formulation[0] == "N" else AUTO])
    text = scene.deck(sides).text()
    if chance.random() < 0.4:
        text = text.replace(SURFACE, SURFACE + "*FRICTION\n0.3\n")
    return text, formulation


def run(seed, treatment, folder):
    """The verdict of one run, its time, and whether nodes are without mass."""
    text, formulation = deck_of(seed)
    path = pathlib.Path(folder) / "deck.inp"
    path.write_text(text)
    done = usage([PROGRAM, path, "--quiet", "--output", folder, f"--set=formulation={formulation}",
                  f"--set=initiation={treatment}"])
    verdict = read_verdict(ResultPaths(path.with_suffix("")))
    is_massless = "first contact: MASSLESS" in path.with_suffix(".log").read_text()
    return verdict | {"cpu": done.cpu, "is_massless": is_massless}


def lines_of(seeds):
    """The table, over the scenes in which the two differ."""
    runs = []
    for seed in seeds:
        with tempfile.TemporaryDirectory() as folder:
            runs.append({t: run(seed, t, folder) for t in TREATMENTS})
    differ = [r for r in runs if r["AUTO"]["is_massless"]]
    rows = [(f"`{t}`", sum(r[t].get("cuts", 0) for r in differ),
             sum(r[t]["verdict"] != "good" for r in differ),
             size(max(r[t].get("largest_energy_error", 0.0) for r in differ)),
             f"{statistics.median(r[t]['cpu']/r['PERSISTENT']['cpu'] for r in differ):.2f}")
            for t in TREATMENTS] if differ else []
    worse = sum(r["AUTO"]["verdict"] != "good" for r in differ if r["PERSISTENT"]["verdict"] == "good")
    return [f"`AUTO` is `MASSLESS` in {len(differ)} of {len(runs)} drawn scenes; of these {worse} end "
            "worse than with `PERSISTENT`:", "",
            *table(["treatment", "cuts", "bad", "energy", "CPU, median"], rows)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--update", action="store_true", help="write into docs/trade.md")
    parser.add_argument("--scenes", type=int, default=100, help="how many (100)")
    options = parser.parse_args()
    lines = lines_of(range(options.scenes))
    print(*lines, sep="\n")
    if options.update:
        PAGE.write_text(update(PAGE.read_text(), "fine", lines))


if __name__ == "__main__":
    main()
