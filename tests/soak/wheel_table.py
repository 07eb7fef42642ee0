"""Wheels of 12, 24 and 48 corners on a floor and on slopes: a table of what is right and what is not.

    .venv/bin/python tests/soak/wheel_table.py [--folder build/wheels] [--sides 12 24 48]

Each wheel is thrown along the surface without spin: it slides, its friction gives it spin, and it goes
on from corner to corner, hopping, as contacts that hold a gap give energy back. Overlap, momenta,
energy and the law of friction are judged by the fields of a run (`tests/scenes/wheel_scenes.py`). `way`
is how far the middle goes, `disc` how far a disc would, which polygons come near as corners and steps
become small. The exit code is 1 where a run stops, is called bad, or misses a balance or the law.
"""

import argparse
import itertools
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "scenes"))

from scene_tools import ROOT, attempt  # noqa: E402
from wheel_scenes import Wheel, judge  # noqa: E402

#: What balances and the law of friction may miss, over their scales.
MISSED = 1e-10


def line_of(wheel, folder):
    """A line of the table, and whether the run is right."""
    done, run = attempt(wheel.deck(), folder / wheel.name, (), {})
    head = f"{wheel.sides:5d} {wheel.slope:5g} {wheel.mu:4g} {wheel.h:6g}"
    if done.returncode != 0:
        return f"{head}  stopped: {run.verdict['message']}", False
    found, told = judge(wheel, run), run.verdict
    way = wheel.disc(found.time[-1])[0]
    missed = max(found.overlap, found.momentum, found.energy, found.law, told["law_violation"],
                 told["largest_energy_error"]/told["largest_energy"])
    return (f"{head} {told['verdict']:>7} {told['cuts']:4d} {told['newton']/told['increments']:6.1f} "
            f"{found.overlap:8.0e} {found.momentum:8.0e} {found.energy:8.0e} {found.law:8.0e} "
            f"{found.way[-1]:7.3f} {way:7.3f}"), told["verdict"] == "good" and missed < MISSED


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--folder", type=pathlib.Path, default=ROOT / "build" / "wheels")
    parser.add_argument("--sides", type=int, nargs="+", default=(12, 24, 48), metavar="N")
    options = parser.parse_args()
    print("sides slope   mu      h verdict cuts newton  overlap momentum   energy      law     way"
          "    disc")
    wrong = count = 0
    for values in itertools.product(options.sides, (0.0, 10.0, 20.0), (0.2, 0.5, 1.0),
                                    (0.02, 0.01, 0.005)):
        line, is_right = line_of(Wheel(*values), options.folder)
        print(line if is_right else line + "  WRONG", flush=True)
        count += 1
        wrong += not is_right
    print(f"{count} runs, {wrong} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
