"""The ring on a foundation by EMCON, CalculiX and Kratos: seconds per increment, energy.

    .venv/bin/python tests/bench/bench_peers.py --kratos PYTHON [--ccx PROGRAM] [--update]

`PYTHON` is an interpreter that has KratosMultiphysics and its applications StructuralMechanics,
ContactStructuralMechanics, ConstitutiveLaws and LinearSolvers, by default $EMCON_KRATOS_PYTHON;
`PROGRAM` the one of CalculiX, by default `ccx` of the path. A code that is not there is passed
over. Runs take turns, on one thread. Prints a table, and writes it into docs/performance.md;
asserts nothing. `--short`: few increments of the coarse mesh, to see that all of it runs.
"""

import argparse
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from bench_counts import PAGE, RINGS  # noqa: E402
from book.common import table  # noqa: E402
from peers import calculix, kratos  # noqa: E402
from peers.ring import Told, ring_of  # noqa: E402
from scene_tools import DECKS, PROGRAM, Run, overrides  # noqa: E402
from timing import usage  # noqa: E402
from verification import update  # noqa: E402

H = 0.01
BEFORE = calculix.BEFORE
#: Our runs are so short that one would tell little.
TURNS = 5
OURS = "EMCON, node to segment"


def cells(text):
    return tuple(map(int, text.split("x")))


class Emcon:
    """The same mesh by this code, as `calculix.run` does it."""

    def __init__(self, formulation):
        self.formulation = formulation

    def run(self, size, h, increments, folder):
        deck = folder/"ring.inp"
        subprocess.run([sys.executable, DECKS/"make_ring.py", "--ring", size[0], "--block", size[1],
                        "--output", deck], check=True)
        user = {BEFORE: [], increments: []}
        for n in (BEFORE, increments)*TURNS:
            choice = {"h": h, "t_end": h*n, "frame": h*n, "formulation": self.formulation}
            done = usage([PROGRAM, deck, "--quiet", "--output", folder, *overrides(choice)])
            if done.code not in (0, 3):
                raise RuntimeError(done.errors)
            user[n].append(done.user)
        first, last = (statistics.median(seconds) for seconds in user.values())
        history = Run(folder/"ring").history
        return Told((last - first)/(increments - BEFORE), list(history["total"]),
                    history["newton"][BEFORE + 1:].sum()/(increments - BEFORE))


class Peer:
    def __init__(self, code, program):
        self.code, self.program = code, program

    def run(self, size, h, increments, folder):
        return self.code.run(self.program, ring_of(*map(cells, size)), h, increments, folder)


def codes(options):
    """What is there, by name; what is not is told."""
    found = {OURS: Emcon("NODE TO SURFACE"), "EMCON, mortar": Emcon("MORTAR")}
    version = kratos.version(options.kratos)
    if version:
        found[f"Kratos {version}, mortar"] = Peer(kratos, options.kratos)
    else:
        print("Kratos is passed over: no Python interpreter that has it (--kratos)")
    ccx = calculix.program(options.ccx)
    if ccx:
        release = usage([ccx, "-v"]).text.split()[-1]
        found[f"CalculiX {release}, node to segment"] = Peer(calculix, ccx)
    else:
        print("CalculiX is passed over: no program ccx (--ccx)")
    return found


def told_by(size, found, rounds, increments):
    """What the runs of each code tell, in turns."""
    told = {name: [] for name in found}
    for _ in range(rounds):
        for name, code in found.items():
            with tempfile.TemporaryDirectory() as folder:
                told[name].append(code.run(size, H, increments, pathlib.Path(folder)))
    return told


def times_ours(told, name):
    """The median of the ratios of each round."""
    return statistics.median(a.user/b.user for a, b in zip(told[name], told[OURS], strict=True))


def rows_of(size, found, rounds, increments):
    """Of the table, for one size."""
    told = told_by(size, found, rounds, increments)
    unknowns = ring_of(*map(cells, size)).unknowns
    for name, runs in told.items():
        error = runs[0].error
        yield (unknowns, name, f"{1e3*statistics.median(r.user for r in runs):.3g} ms",
               f"{times_ours(told, name):.3g}", f"{runs[0].iterations:.1f}",
               f"{100*error:+.2f} %" if abs(error) > 1e-6 else f"{abs(error):.0e}")


def compare(options):
    """Lines of the table."""
    sizes = RINGS[:1] if options.short else RINGS[:2]
    increments, rounds = (6, 1) if options.short else (options.increments, options.rounds)
    found = codes(options)
    lines = [row for size in sizes for row in rows_of(size, found, rounds, increments)]
    return table(["unknowns", "code", "CPU per increment", "times ours", "iterations",
                  f"energy by t = {H*increments:g}"], lines)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kratos", default=os.environ.get("EMCON_KRATOS_PYTHON"),
                        metavar="PYTHON", help="interpreter that has Kratos")
    parser.add_argument("--ccx", metavar="PROGRAM", help="CalculiX (ccx)")
    parser.add_argument("--increments", type=int, default=50, help="of h = 0.01 (50)")
    parser.add_argument("--rounds", type=int, default=3, help="runs of each code (3)")
    for name in ("update", "short"):
        parser.add_argument(f"--{name}", action="store_true")
    return parser


def main():
    options = arguments().parse_args()
    lines = compare(options)
    print("\nThe ring by several codes, one thread", *lines, sep="\n")
    if options.update:
        PAGE.write_text(update(PAGE.read_text(), "peers", lines))


if __name__ == "__main__":
    main()
