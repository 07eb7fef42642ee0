"""What a tie in space costs: a cube of two tied meshes against one conforming mesh of the same size.

    .venv/bin/python tests/bench/bench_ties_space.py [--short] [--rounds N] [--update]

Some 50,000 unknowns each. Runs take turns on one thread; medians are told, those of ratios over pairs of
runs of one round. Prints a table, asserts nothing; the target is 1.15 times the conforming mesh in time and in memory. `--short`: small
meshes; `--update` writes the table of docs/performance.md.
"""

import argparse
import pathlib
import re
import sys
import tempfile
from statistics import median

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1]/name) for name in ("", "scenes")]

from bench_counts import PAGE  # noqa: E402
from book.common import table  # noqa: E402
from scene_tools import PROGRAM, Run  # noqa: E402
from space_mesh import Block  # noqa: E402
from tie_space_scenes import ELASTIC, RUBBER, box, tied  # noqa: E402
from timing import usage  # noqa: E402
from verification import update  # noqa: E402

MATCHING = "one mesh"
#: Cells of the lower and the upper half; the upper one is the slave.
MESHES = {MATCHING: ((25, 25, 25),), "25 on 25": ((25, 25, 12), (25, 25, 13)), "25 on 24": ((24, 24, 13), (25, 25, 13)),
          "28 on 21": ((21, 21, 11), (28, 28, 14)), "21 on 28": ((28, 28, 14), (21, 21, 11))}
SHORT = {MATCHING: ((6, 6, 6),), "7 on 5": ((5, 5, 3), (7, 7, 3))}
STATICS = "*STEP\n*STATIC, DIRECT\n1., 1.\n"
DYNAMICS = "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n.01, .02\n"
SCENES = {"linear statics": (ELASTIC, STATICS), "`NLGEOM` dynamics, 2 increments": (RUBBER, DYNAMICS)}


def blocks_of(cells: tuple) -> list[Block]:
    """Boxes on each other, a cube together."""
    ends = [i/len(cells) for i in range(len(cells) + 1)]
    return [box("C3D8", n, (0, 0, low), (1, 1, high)) for n, low, high in zip(cells, ends[:-1], ends[1:], strict=True)]


def deck(cells: tuple, law: str, step: str) -> str:
    """Held below, pulled sideways by the upper corner nodes."""
    blocks = blocks_of(cells)
    text, x = tied(blocks, [(1, 0, 2)] if len(blocks) > 1 else [], law)
    if len(blocks) == 1:
        text = text[:text.index("*TIE")]
    held = "".join(f"{k}, 1, 3\n" for k, p in enumerate(x, 1) if p[2] < 1e-9)
    loads = "".join(f"{k}, 1, 1e-3\n" for k, p in enumerate(x, 1) if p[2] > 1 - 1e-9 and {float(p[0]), float(p[1])} <= {0.0, 1.0})
    return f"{text}*BOUNDARY\n{held}{step}*CLOAD\n{loads}*NODE FILE, FREQUENCY=100\nU\n*END STEP\n"


def measure(path: pathlib.Path) -> tuple[float, float, dict]:
    """Seconds of the user, MB, and what the run says of itself."""
    done = usage([PROGRAM, path, "--quiet", "--threads", 1, "--output", path.parent])
    assert done.code == 0, done.errors
    run = Run(path.with_suffix(""))
    return done.user, done.memory, {"unknowns": int(re.search(r"(\d+) unknowns in step 1", run.log)[1]), "newton": run.verdict["newton"]}


def rows_of(scene: str, meshes: dict, folder: pathlib.Path, rounds: int) -> list[tuple]:
    law, step = SCENES[scene]
    found = {name: [] for name in meshes}
    for _ in range(rounds):
        for name, cells in meshes.items():
            path = folder/"cube.inp"
            path.write_text(deck(cells, law, step))
            found[name].append(measure(path))
    rows = []
    for name, runs in found.items():
        # Both runs of a ratio stand side by side, so that other work on the machine weighs on both.
        ratios = [median(run[k]/one[k] for run, one in zip(runs, found[MATCHING], strict=True)) for k in range(2)]
        seconds, memory = (median(run[k] for run in runs) for k in range(2))
        rows.append((scene, name, runs[0][2]["unknowns"], f"{seconds:.2f}", f"{memory:.0f}", runs[0][2]["newton"],
                     f"{ratios[0]:.2f}", f"{ratios[1]:.2f}"))
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--short", action="store_true", help="small meshes")
    parser.add_argument("--rounds", type=int, default=5, metavar="N", help="turns (default: 5)")
    parser.add_argument("--update", action="store_true", help=f"write the table of {PAGE.name}")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        rows = [row for scene in SCENES for row in rows_of(scene, SHORT if options.short else MESHES, pathlib.Path(name),
                                                           1 if options.short else options.rounds)]
    lines = table(["scene", "mesh", "unknowns", "seconds", "MB", "Newton", "seconds / one mesh", "MB / one mesh"], rows)
    print("\nA cube of two tied halves, on one thread", *lines, sep="\n")
    if options.update:
        PAGE.write_text(update(PAGE.read_text(), "ties_space", lines))


if __name__ == "__main__":
    main()
