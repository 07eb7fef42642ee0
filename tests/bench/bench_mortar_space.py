"""What mortar costs in space beside nodes: blocks of 225 faces that land on a plate, or are pressed on it.

    .venv/bin/python tests/bench/bench_mortar_space.py [--short] [--rounds N] [--update]

Some 20,000 unknowns. Runs take turns, the fastest of each is told, on one thread. Prints a table,
asserts nothing; the target is 1.3 times the increment of nodes. `--short`: small blocks; `--update`
writes the table of docs/performance.md.
"""

import argparse
import pathlib
import sys
import tempfile

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1]/name) for name in ("", "scenes")]

import numpy as np  # noqa: E402
from bench_counts import PAGE  # noqa: E402
from book.common import table  # noqa: E402
from contact_space_scenes import bodies, dynamic, faces, pair, velocities  # noqa: E402
from scene_tools import PROGRAM, Run  # noqa: E402
from space_mesh import Block  # noqa: E402
from timing import usage  # noqa: E402
from verification import update  # noqa: E402

INCREMENT = .002
GAP = .0005
STIFF = "*ELASTIC\n1E4, .3\n*DENSITY\n1.\n"
#: How the bottom of the block is curved (its radius), and the increments of its landing, or of the
#: static step that presses it down.
SCENES = {"curved, lands": (3.0, 20), "flat, lands": (np.inf, 10),
          "curved, pressed": (3.0, 2), "flat, pressed": (np.inf, 2)}
DOWN = .02
FORMS = ("NODE TO SURFACE", "MORTAR")


def deck(n: int, layers: int, scene: str, form: str) -> str:
    """A block of `n` cells a side that lands on a plate of unlike cells, with a spin, or is pressed on it."""
    radius, increments = SCENES[scene]
    is_static = scene.endswith("pressed")

    def place(x: np.ndarray) -> np.ndarray:
        y = x - [.5, .5, 0]
        rise = (y[:, 0]**2 + y[:, 1]**2)/(2*radius)*(1 - y[:, 2]/.5)
        return y + np.column_stack([0*rise, 0*rise, rise + (0 if is_static else GAP)])

    m = n + 2
    block = Block("C3D8", (n, n, layers), size=(1, 1, .5), place=place)
    plate = Block("C3D8", (m, m, layers), size=(1.5, 1.5, .5), place=lambda x: x - np.array([.75, .75, .5]))
    held = "".join(f"{len(block.x) + k}, 1, 3\n" for k in plate.on(2, 0))
    text = bodies([block, plate], [faces(block, 2, 0), faces(plate, 2, 1)], STIFF) + pair(f", TYPE={form}", "")
    if is_static:
        pressed = "".join(f"{k}, 1, 2\n{k}, 3, 3, {-DOWN}\n" for k in block.on(2, 1))
        return f"{text}*STEP, NLGEOM\n*STATIC, DIRECT\n{1/increments}, 1.\n*BOUNDARY\n{held}{pressed}*END STEP\n"
    flight = velocities(block, np.array([.1, .05, -1.]), np.array([0, 0, .2]))
    step = dynamic(INCREMENT, INCREMENT*increments)
    return f"{text}{flight}*BOUNDARY\n{held}{step}".replace("*NODE FILE", "*NODE FILE, FREQUENCY=1000")


def measure(path: pathlib.Path) -> tuple[float, Run]:
    """Seconds of the user, and the run."""
    done = usage([PROGRAM, path, "--quiet", "--threads", 1, "--output", path.parent])
    assert done.code == 0, done.errors
    return done.user, Run(path.with_suffix(""))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--short", action="store_true", help="small blocks")
    parser.add_argument("--rounds", type=int, default=3, metavar="N", help="turns (default: 3)")
    parser.add_argument("--update", action="store_true", help=f"write the table of {PAGE.name}")
    options = parser.parse_args()
    n, layers = (3, 2) if options.short else (15, 10)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder)/"landing.inp"
        for scene, (_, increments) in SCENES.items():
            found: dict[str, list] = {form: [] for form in FORMS}
            for _ in range(1 if options.short else options.rounds):
                for form in FORMS:
                    path.write_text(deck(n, layers, scene, form))
                    seconds, run = measure(path)
                    found[form].append((seconds, run.verdict))
            nodes = max(min(seconds for seconds, _ in found[FORMS[0]]), 1e-3)
            for form in FORMS:
                seconds, verdict = min(run[0] for run in found[form]), found[form][0][1]
                counts = verdict["counts"]
                rows.append((scene, form, f"{seconds/increments:.2f}", f"{seconds/nodes:.2f}",
                             f"{counts['factorisations']/increments:.2f}", f"{counts['residuals']/increments:.1f}",
                             f"{verdict['memory']['factors']:.0f}", f"{verdict['memory']['most']:.0f}"))
    lines = table(["block", "contact", "s an increment", "by nodes", "factorisations an increment",
                   "residuals an increment", "factors [MB]", "all [MB]"], rows)
    print(f"\nBlocks of {n*n} faces on a plate, on one thread", *lines, sep="\n")
    if options.update:
        PAGE.write_text(update(PAGE.read_text(), "mortar_space_cost", lines))


if __name__ == "__main__":
    main()
