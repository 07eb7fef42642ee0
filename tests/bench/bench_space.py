"""A cantilever of hexahedra swings: time of an increment by phases, and memory, by size.

    .venv/bin/python tests/bench/bench_space.py [--cells 25x7x7 ...] [--kind C3D8] [--increments 3] [--solver NAME ...]

The largest of its own sizes, a hundred thousand hexahedra, takes some minutes and 4 GB.
"""

from __future__ import annotations

import argparse
import pathlib
import sys
import tempfile

import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1]/name) for name in ("", "scenes")]

from scene_tools import PROGRAM, Run  # noqa: E402
from space_mesh import Block  # noqa: E402
from timing import usage  # noqa: E402

#: Cells along the beam and across.
SIZES = ("25x7x7", "50x14x14", "100x32x32")
LENGTH, STEP = 4.0, 0.01


def write(path: pathlib.Path, cells: tuple[int, ...], kind: str, n: int,
          solver: str = "DEFAULT") -> int:
    """A deck of `n` increments; how many nodes it has."""
    mesh = Block(kind, cells, (LENGTH, 1, 1))
    held = "".join(f"{k}, 1, 3\n" for k in mesh.on(0, 0))
    speed = "".join(f"{k}, 3, {0.3*x*x!r}\n" for k, x in enumerate(mesh.x[:, 0].tolist(), 1))
    path.write_text(mesh.deck(
        "*HYPERELASTIC, NEO HOOKE\n20., 0.01\n", f"*BOUNDARY\n{held}*INITIAL CONDITIONS, "
        f"TYPE=VELOCITY\n{speed}*STEP, NLGEOM, INC={n}\n*DYNAMIC, DIRECT, SOLVER={solver}\n{STEP}, {STEP*n}\n"
        f"*NODE FILE, FREQUENCY={n}\nU\n*END STEP\n"))
    return len(mesh.x)


def measure(cells: tuple[int, ...], kind: str, n: int, threads: int, solver: str) -> list[str]:
    """A row of the table."""
    with tempfile.TemporaryDirectory() as folder:
        deck = pathlib.Path(folder)/"beam.inp"
        n_node = write(deck, cells, kind, n, solver)
        done = usage([PROGRAM, deck, "--quiet", "--threads", threads, "--output", folder])
        assert done.code == 0, done.errors
        verdict = Run(deck.with_suffix("")).verdict
    seconds, counts = verdict["seconds"], verdict["counts"]
    phases = [seconds[name]/n for name in ("residual", "assemble", "factorise", "solve")]
    return [f"{kind} {'x'.join(map(str, cells))}", solver, str(int(np.prod(cells))), str(3*n_node),
            f"{counts['residuals']/n:.1f}", f"{counts['factorisations']/n:.2f}",
            *[f"{x:.2f}" for x in phases], f"{seconds['read']:.1f}", f"{done.user:.1f}",
            f"{done.memory:.0f}"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", nargs="*", default=SIZES)
    parser.add_argument("--kind", default="C3D8")
    parser.add_argument("--increments", type=int, default=3)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--solver", nargs="*", default=["DEFAULT"], help="words of SOLVER= of decks")
    options = parser.parse_args()
    print("| mesh | solver | cells | freedoms | residuals | factors | residual [s] | assemble | "
          "factorise | solve | read [s] | all [s] | memory [MB] |\n" + "|---"*13 + "|")
    for size in options.cells:
        cells = tuple(map(int, size.split("x")))
        for solver in options.solver:
            print("| " + " | ".join(measure(cells, options.kind, options.increments, options.threads,
                                            solver)) + " |", flush=True)
    print("an increment each, but for what is read and all; seconds of the processor")


if __name__ == "__main__":
    main()
