"""A ball hits a plate in three dimensions, by EMCON and by CalculiX: seconds per increment.

    .venv/bin/python tests/bench/bench_plate.py [--ccx PROGRAM] [--short] [--rounds N] [--update]

Both take the same mesh, St. Venant-Kirchhoff's law and increments, EMCON hard contact of the nodes
of both sides, CalculiX its penalty, node to surface. Seconds are those of the user, on one thread,
from the fourth increment on. `PROGRAM` is that of CalculiX, by default `ccx` of the path; without
it only ours is told. Prints a table, asserts nothing. `--short`: a coarse mesh; `--rounds`: the two
take turns so often, and medians are told; `--update` writes the table of docs/performance.md.
"""

import argparse
import pathlib
import statistics
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from bench_counts import PAGE  # noqa: E402
from book.common import table  # noqa: E402
from peers import calculix, plate  # noqa: E402
from scene_tools import PROGRAM, Run  # noqa: E402
from timing import usage  # noqa: E402
from verification import update  # noqa: E402

H, BEFORE, INCREMENTS = 0.005, 4, 14
SHORT = ((3, 2), (6, 6, 2))


def ours(scene, folder):
    """Seconds per increment, and what part of them the search and the gaps of contact take."""
    seconds = []
    for n in (BEFORE, INCREMENTS):
        deck = folder/f"ours{n}.inp"
        deck.write_text(plate.deck(scene, H, n))
        done = usage([PROGRAM, deck, "--quiet", "--threads", 1, "--output", folder])
        assert done.code == 0, done.errors
        seconds.append(done.user)
    phase = Run(deck.with_suffix("")).verdict["seconds"]
    contact = (phase["search"] + phase["gaps"])/sum(phase.values())
    return (seconds[1] - seconds[0])/(INCREMENTS - BEFORE), contact


def theirs(program, scene, folder):
    """Seconds per increment; None where CalculiX does not get there."""
    seconds = []
    for n in (BEFORE, INCREMENTS):
        (folder/"plate.inp").write_text(plate.deck(scene, H, n, peer=True))
        done = usage([program, "plate"], folder)
        rows = (folder/"plate.sta").read_text().splitlines()[2:]
        if done.code != 0 or len(rows) != n:
            return None
        seconds.append(done.user)
    return (seconds[1] - seconds[0])/(INCREMENTS - BEFORE)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ccx", metavar="PROGRAM", help="CalculiX (default: ccx of the path)")
    parser.add_argument("--short", action="store_true", help="a coarse mesh")
    parser.add_argument("--rounds", type=int, default=1, metavar="N", help="turns (default: 1)")
    parser.add_argument("--update", action="store_true", help=f"write the table of {PAGE.name}")
    options = parser.parse_args()
    scene = plate.scene(SHORT if options.short else plate.MESH)
    program = calculix.program(options.ccx)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        rounds = [(*ours(scene, folder), theirs(program, scene, folder) if program else None)
                  for _ in range(options.rounds)]
    seconds, contact, peer = ([x for x in part if x is not None] for part in zip(*rounds))
    if not program:
        print("CalculiX is passed over: no program (--ccx)")
    rows = [("EMCON", f"{statistics.median(seconds):.2f}", "1",
             f"{100*statistics.median(contact):.0f} %")]
    if peer:
        ratio = statistics.median(b/a for a, b in zip(seconds, peer))
        rows.append(("CalculiX", f"{statistics.median(peer):.2f}", f"{ratio:.1f}", ""))
    lines = table([f"{scene.unknowns} unknowns", "s / increment", "ratio", "search and gaps"], rows)
    print(*lines, sep="\n")
    if options.update:
        PAGE.write_text(update(PAGE.read_text(), "plate", lines))


if __name__ == "__main__":
    main()
