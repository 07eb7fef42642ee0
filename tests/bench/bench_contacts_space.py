"""Two blocks of hexahedra that fly into each other, beside the same two that do not meet: what an increment takes.

    .venv/bin/python tests/bench/bench_contacts_space.py [--cells 24x24x8 44x44x8 ...] [--increments 8]

Each block is stretched as it flies, so that both runs have forces in all elements. Seconds of the processor of all
increments, less those of the model and of reading. The sizes by default are 625 and 2,025 contacts; the larger one takes
some minutes and 2.5 GB.
"""

from __future__ import annotations

import argparse
import pathlib
import sys
import tempfile

import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1]/name) for name in ("", "scenes")]

from contact_space_scenes import bodies, faces, pair  # noqa: E402
from scene_tools import PROGRAM, Run  # noqa: E402
from space_mesh import Block  # noqa: E402
from timing import usage  # noqa: E402

SIZES = ("24x24x8", "44x44x8")
#: Of the flight, the gap before it, and the rate of the stretch; steps are some transit times of an element.
SPEED, GAP, RATE, STEP = 1.0, 0.003, 0.5, 0.002
PHASES = ("search", "gaps", "residual", "eliminate", "factorise", "solve", "restitution")


def write(path: pathlib.Path, cells: tuple[int, ...], n: int, meets: bool) -> int:
    """A deck of `n` increments; how many unknowns it has."""
    one = Block("C3D8", cells, place=lambda x: x + np.array([0, 0, GAP]))
    two = Block("C3D8", cells, place=lambda x: x - np.array([0, 0, 1]))
    z = np.concatenate([one.x[:, 2], two.x[:, 2]])
    fall = np.repeat([-SPEED if meets else SPEED, 0], [len(one.x), len(two.x)])
    speed = "".join(f"{k}, 3, {v!r}\n" for k, v in enumerate((fall + RATE*z).tolist(), 1))
    path.write_text(
        bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)]) + (pair() if meets else "")
        + f"*INITIAL CONDITIONS, TYPE=VELOCITY\n{speed}*STEP, NLGEOM, INC={n}\n*DYNAMIC, DIRECT\n{STEP}, {STEP*n!r}\n"
        + f"*NODE FILE, FREQUENCY={n}\nU\n*END STEP\n")
    return 3*len(z)


def measure(cells: tuple[int, ...], meets: bool, options: argparse.Namespace) -> tuple[list[str], float]:
    """A row of the table, and the seconds of an increment."""
    n = options.increments
    with tempfile.TemporaryDirectory() as folder:
        deck = pathlib.Path(folder)/"blocks.inp"
        n_unknown = write(deck, cells, n, meets)
        done = usage([options.program, deck, "--quiet", "--threads", "1", "--output", folder])
        assert done.code == 0, done.errors
        run = Run(deck.with_suffix(""))
        verdict, n_active = run.verdict, run.history["active"].max()
    seconds = verdict["seconds"]
    each = (sum(seconds.values()) - seconds["read"] - seconds["output"])/n
    return ["x".join(map(str, cells)), str(n_unknown), f"{n_active:.0f}",
            f"{verdict['newton']/n:.1f}", *[f"{seconds[name]/n:.2f}" for name in PHASES], f"{each:.2f}",
            f"{done.memory:.0f}"], each


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", nargs="*", default=SIZES, help="of each block")
    parser.add_argument("--increments", type=int, default=8)
    parser.add_argument("--program", default=PROGRAM, help="another emcon")
    options = parser.parse_args()
    print(f"| cells | unknowns | contacts | Newton | {' | '.join(PHASES)} | increment [s] | memory [MB] | ratio |\n"
          + "|---"*(7 + len(PHASES)) + "|")
    for size in options.cells:
        cells = tuple(map(int, size.split("x")))
        alone = 0.0
        for meets in (False, True):
            row, each = measure(cells, meets, options)
            alone = alone or each
            print("| " + " | ".join([*row, f"{each/alone:.1f}"]) + " |", flush=True)
    print("an increment each; seconds of the processor")


if __name__ == "__main__":
    main()
