"""What ties cost: 16 tied pieces against one mesh of the same size and against multipliers.

Prints tables; asserts nothing. `make bench`, or `.venv/bin/python tests/bench/bench_ties.py`;
with `--short` small pieces, to see that all of it runs.
Orientation: by null space at most 1.15 times the mesh that matches, and not more than the saddle
point, in time and in memory.
"""

import pathlib
import statistics
import subprocess
import tempfile

from bench_ring import IS_SHORT, measure, table
from book.tied_grid import DYNAMIC, STATIC, Grid
from scene_tools import PROGRAM, Run, overrides
from timing import ENVIRONMENT

#: 2e5 unknowns each, unless short.
PIECES = Grid(m=4, coarse=6, fine=8) if IS_SHORT else Grid(m=4, coarse=78, fine=80)
ONE_MESH = Grid(m=1, coarse=28, fine=28) if IS_SHORT else Grid(m=1, coarse=316, fine=316)

#: What is measured against what. Runs take turns, so that a load from elsewhere hits all alike.
MATCHING = "matching mesh"
VARIANTS = {
    MATCHING: {},
    "null space, DUAL": {"method": "NULL SPACE", "multiplier": "DUAL"},
    "null space, STANDARD": {"method": "NULL SPACE", "multiplier": "STANDARD"},
    "saddle point, DUAL": {"method": "SADDLE POINT", "multiplier": "DUAL"},
    "saddle point, STANDARD": {"method": "SADDLE POINT", "multiplier": "STANDARD"},
}
N_TURN = 1 if IS_SHORT else 3
#: The slowest one is measured in the first turn only.
ONCE = "saddle point, STANDARD"

SCENES = {
    "linear statics": ("linear", STATIC, {}),
    "NLGEOM dynamics, 2 increments": (
        "hyperelastic", DYNAMIC, {"h": 0.01, "t_end": 0.02, "load": 0.01},
    ),
}  # fmt: skip


def decks(folder, law, step):
    return (PIECES.write(folder / "pieces.inp", law, step),
            ONE_MESH.write(folder / "one.inp", law, step))  # fmt: skip


def bench_scene(folder, name, law, step, parameters):
    print(f"\nTies: {name}; 16 pieces of {PIECES.coarse}^2 and {PIECES.fine}^2 elements, 24 ties")
    pieces, one = decks(folder, law, step)
    figures, newton = {variant: [] for variant in VARIANTS}, {}
    for turn in range(N_TURN):
        for variant, choice in VARIANTS.items():
            if variant == ONCE and turn > 0:
                continue
            deck = one if variant == MATCHING else pieces
            out = folder / "run"
            options = overrides({**parameters, **choice})
            cpu, _, memory = measure(deck, "--quiet", "--output", out, *options)
            figures[variant].append((cpu, memory))
            newton[variant] = int(Run(out / deck.stem).history["newton"].sum())
    row = table("                      ", "CPU [s]", "MB", "Newton", "CPU / matching",
                "MB / matching", "CPU / saddle", "MB / saddle")  # fmt: skip
    for variant in VARIANTS:
        cpu, memory = map(statistics.median, zip(*figures[variant], strict=True))
        row(variant, cpu, memory, newton[variant], *ratios(figures, variant, MATCHING),
            *ratios(figures, variant, variant.replace("null space", "saddle point")))  # fmt: skip


def ratios(figures, variant, other):
    """Medians over the turns of the ratios of CPU time and memory; nothing against itself."""
    if variant == other:
        return "", ""
    turns = zip(figures[variant], figures[other], strict=False)
    cpu, memory = zip(*((a/c, b/d) for (a, b), (c, d) in turns), strict=True)
    return statistics.median(cpu), statistics.median(memory)


def bench_elimination(folder):
    """The matrix without dependent unknowns: made while assembling, or as a product."""
    pieces, _ = decks(folder, "hyperelastic", DYNAMIC)
    for multiplier in ("DUAL", "STANDARD"):
        print(f"\nTies: T^T N T on the same pieces, {multiplier} multipliers", flush=True)
        subprocess.run([PROGRAM.parent / "ties_elimination", pieces, f"multiplier={multiplier}"],
                       env=ENVIRONMENT, check=True)  # fmt: skip


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for scene, (law, step, parameters) in SCENES.items():
            bench_scene(folder, scene, law, step, parameters)
        bench_elimination(folder)


if __name__ == "__main__":
    main()
