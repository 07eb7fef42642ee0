"""What contact of all with all costs at size: discs that run into each other at random.

Prints a table; asserts nothing. `make bench`, or `.venv/bin/python tests/bench/bench_discs.py`;
with `--short` few discs. Time and memory per edge should not grow with the number of discs.
"""

import math
import pathlib
import random
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from bench_ring import IS_SHORT, measure, table  # noqa: E402
from scene_tools import DECKS, Deck, Run, number  # noqa: E402

sys.path.insert(0, str(DECKS))

from deckwriter import Part  # noqa: E402
from scenery import add_disc  # noqa: E402

#: Elements along a quarter of the rim, and across.
CELLS = (3, 1)
INCREMENTS = 10


def discs_deck(n):
    """n discs in rows, a twentieth of a radius apart, each with a velocity of its own."""
    part, velocity = Part("DISCS"), []
    across = math.isqrt(n - 1) + 1
    chance = random.Random(n)
    for k in range(n):
        row, place = divmod(k, across)
        centre = (1.025*(place + 0.5*(row % 2)), 1.025*math.sqrt(0.75)*row)
        before = len(part.node)
        add_disc(part, centre, 0.5, CELLS, (before + 1, len(part.element) + 1), turn=0.7*k)
        v = [chance.uniform(-1, 1), chance.uniform(-1, 1)]
        velocity += [f"{label}, {axis}, {number(v[axis - 1])}"
                     for label in range(before + 1, len(part.node) + 1) for axis in (1, 2)]
    return Deck("\n".join([
        "*HEADING", f"{n} discs", *part.node_lines(), *part.element_lines(),
        "*MATERIAL, NAME=SOFT", "*HYPERELASTIC, COUPLED NEO HOOKE", "300., 0.3", "*DENSITY", "1.",
        "*SOLID SECTION, ELSET=DISCS, MATERIAL=SOFT", "1.", "*CONTACT",
        "*CONTACT INCLUSIONS, ALL EXTERIOR", "*INITIAL CONDITIONS, TYPE=VELOCITY", *velocity,
        "*STEP, NLGEOM, INC=1000000", "*DYNAMIC, DIRECT", f"0.005, {number(0.005*INCREMENTS)}",
        "*CONTACT PRINT, TOTALS=ONLY", "CF", "*END STEP"]))


def bench_discs(folder):
    print(f"\nDiscs of {4*CELLS[0]} edges, all with all, {INCREMENTS} increments of 0.005")
    row = table("discs", "edges", "active", "CPU [s]", "us/(edge Newton)", "memory [MB]",
                "kB/edge")
    empty = measure("--version")[2]
    for n in (9, 16) if IS_SHORT else (100, 300, 1000):
        deck = discs_deck(n).write(folder / "discs.inp")
        cpu, _, memory = measure(deck, "--quiet", "--output", folder)
        edges, history = 4*CELLS[0]*n, Run(folder / "discs", "").history
        row(n, edges, int(history["active"].max()), cpu, 1e6*cpu/(edges*history["newton"].sum()),
            memory, 1024*(memory - empty)/edges)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        bench_discs(pathlib.Path(name))
