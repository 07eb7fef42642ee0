"""What friction costs in space: blocks that slide with and without it, on a wall and on a plate.

    .venv/bin/python tests/bench/bench_friction_space.py [--short] [--rounds N] [--update]

Runs take turns, the fastest of each is told, on one thread. Prints a table, asserts nothing; the target
is 1.5 times the increment without friction in the median. `--short`: one small scene; `--update` writes
the table of docs/performance.md.
"""

import argparse
import pathlib
import statistics
import sys
import tempfile

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1]/name) for name in ("", "scenes")]

import numpy as np  # noqa: E402
import wall_space_scenes as walls  # noqa: E402
from bench_counts import PAGE  # noqa: E402
from book.common import table  # noqa: E402
from contact_space_scenes import bodies, dynamic, faces, pair, velocities  # noqa: E402
from scene_tools import PROGRAM, Run  # noqa: E402
from space_mesh import Block  # noqa: E402
from timing import usage  # noqa: E402
from verification import update  # noqa: E402

#: Cells of the block, and whether it slides on a plate.
SCENES = [((2, 2, 1), False), ((4, 4, 2), False), ((8, 8, 3), False), ((2, 2, 1), True), ((4, 4, 2), True), ((6, 6, 2), True)]
COEFFICIENTS = (0.0, 0.3, 0.8)
INCREMENTS = 20
STIFF = "*ELASTIC\n1E4, .3\n*DENSITY\n1.\n"


def deck(cells: tuple[int, int, int], on_plate: bool, mu: float) -> str:
    """A block that is thrown along a floor with a spin, under its weight."""
    c, s = np.cos(.3), np.sin(.3)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    block = Block("C3D8", cells, size=(1, 1, .5), place=lambda x: (x - [.5, .5, 0]) @ turn)
    law = f"*FRICTION\n{mu}\n" if mu > 0 else ""
    if on_plate:
        n = 2*cells[0]
        plate = Block("C3D8", (n, n, 2), size=(3, 3, .5), place=lambda x: x - np.array([1.5, 1.5, .5]))
        held = "".join(f"{len(block.x) + k}, 1, 3\n" for k in plate.on(2, 0))
        text = bodies([block, plate], [faces(block, 2, 0), faces(plate, 2, 1)], STIFF) + pair("", law)
    else:
        held = walls.FIXED
        text = bodies([block], [faces(block, 2, 0)], STIFF) + walls.wall(walls.plane()) + walls.pair("", law)
    flight = velocities(block, np.array([1., .2, 0]), np.array([0, 0, 1.]))
    step = dynamic(.01, .01*INCREMENTS, "*DLOAD\nB1, GRAV, 10., 0., 0., -1.\n")
    return f"{text}{flight}*BOUNDARY\n{held}{step}".replace("*NODE FILE", "*NODE FILE, FREQUENCY=1000")


def measure(path: pathlib.Path) -> tuple[float, dict]:
    """Seconds of the processor, and what the run says of itself. Of runs of some ms Linux tells by samples alone which of
    them are the user's."""
    done = usage([PROGRAM, path, "--quiet", "--threads", 1, "--output", path.parent])
    assert done.code == 0, done.errors
    return done.cpu, Run(path.with_suffix("")).verdict


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--short", action="store_true", help="one small scene")
    parser.add_argument("--rounds", type=int, default=3, metavar="N", help="turns (default: 3)")
    parser.add_argument("--update", action="store_true", help=f"write the table of {PAGE.name}")
    options = parser.parse_args()
    rows, ratios = [], []
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder)/"slide.inp"
        for cells, on_plate in SCENES[:1] if options.short else SCENES:
            found: dict[float, list] = {mu: [] for mu in COEFFICIENTS}
            for _ in range(1 if options.short else options.rounds):
                for mu in COEFFICIENTS:
                    path.write_text(deck(cells, on_plate, mu))
                    found[mu].append(measure(path))
            without = min(run[0] for run in found[0.0])
            for mu in COEFFICIENTS:
                seconds, verdict = min(run[0] for run in found[mu]), found[mu][0][1]
                counts = verdict["counts"]
                ratio = seconds/max(without, 1e-3)
                if mu > 0:
                    ratios.append(ratio)
                rows.append(("plate" if on_plate else "wall", "{} x {} x {}".format(*cells), f"{mu:g}",
                             f"{1000*seconds/INCREMENTS:.1f}", f"{ratio:.2f}",
                             f"{counts['factorisations']/INCREMENTS:.2f}", f"{counts['residuals']/INCREMENTS:.1f}"))
    rows.append(("median with friction", "", "", "", f"{statistics.median(ratios):.2f}", "", ""))
    lines = table(["surface", "cells", "mu", "ms an increment", "time / without friction", "factorisations an increment",
                   "residuals an increment"], rows)
    print("\nBlocks that slide in space, on one thread", *lines, sep="\n")
    if options.update:
        PAGE.write_text(update(PAGE.read_text(), "friction_space_cost", lines))


if __name__ == "__main__":
    main()
