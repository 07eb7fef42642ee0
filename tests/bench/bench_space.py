"""A cantilever of hexahedra swings: time of an increment by phases, and memory, by size.

    .venv/bin/python tests/bench/bench_space.py [--cells 25x7x7 ...] [--kind C3D8] [--increments 3]
                                                [--solver NAME ...] [--static] [--bulk K] [--long]

`--static`: it bends by its weight instead, an equal part more in each increment; Newton's method
factorises for each iterate. `--bulk`: bulk modulus, beside a shear modulus of 40; from some 1e5
times that on factors in single precision do not do.

The largest of its own sizes, a hundred thousand hexahedra, takes a minute and 1 GB; with `--long` a million unknowns come
after it, which take some minutes and 4 GB.
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
MILLION = "110x55x55"
LENGTH, STEP = 4.0, 0.01


def write(path: pathlib.Path, cells: tuple[int, ...], kind: str, n: int,
          solver: str = "DEFAULT", is_static: bool = False, bulk: float = 200.0) -> int:
    """A deck of `n` increments; how many nodes it has."""
    mesh = Block(kind, cells, (LENGTH, 1, 1))
    held = "".join(f"{k}, 1, 3\n" for k in mesh.on(0, 0))
    speed = "".join(f"{k}, 3, {0.3*x*x!r}\n" for k, x in enumerate(mesh.x[:, 0].tolist(), 1))
    moved = f"*INITIAL CONDITIONS, TYPE=VELOCITY\n{speed}"
    step = f"*DYNAMIC, DIRECT, SOLVER={solver}\n{STEP}, {STEP*n}\n"
    if is_static:
        moved = ""
        step = f"*STATIC, SOLVER={solver}\n{1/n}, 1.\n*DLOAD\nALL, GRAV, 0.5, 0., 0., -1.\n"
    path.write_text(mesh.deck(
        f"*HYPERELASTIC, NEO HOOKE\n20., {2/bulk!r}\n", f"*BOUNDARY\n{held}{moved}"
        f"*STEP, NLGEOM, INC={n}\n{step}*NODE FILE, FREQUENCY={n}\nU\n*END STEP\n"))
    return len(mesh.x)


def measure(cells: tuple[int, ...], solver: str, options: argparse.Namespace) -> list[str]:
    """A row of the table."""
    kind, n = options.kind, options.increments
    with tempfile.TemporaryDirectory() as folder:
        deck = pathlib.Path(folder)/"beam.inp"
        n_node = write(deck, cells, kind, n, solver, options.static, options.bulk)
        done = usage([options.program, deck, "--quiet", "--threads", options.threads, "--output",
                      folder])
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
    parser.add_argument("--static", action="store_true", help="no inertia: Newton's method")
    parser.add_argument("--bulk", type=float, default=200.0, help="modulus (default: 200)")
    parser.add_argument("--long", action="store_true", help="a million unknowns too")
    parser.add_argument("--program", default=PROGRAM, help="another emcon")
    options = parser.parse_args()
    print("| mesh | solver | cells | unknowns | residuals | factors | residual [s] | assemble | "
          "factorise | solve | read [s] | all [s] | memory [MB] |\n" + "|---"*13 + "|")
    for size in (*options.cells, *[MILLION]*options.long):
        cells = tuple(map(int, size.split("x")))
        for solver in options.solver:
            print("| " + " | ".join(measure(cells, solver, options)) + " |", flush=True)
    print("seconds of CPU per increment; read and all are those of the run")


if __name__ == "__main__":
    main()
