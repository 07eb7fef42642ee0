"""What the ring scene costs on one thread, and what reading and contact search cost at size.

Prints tables; asserts nothing. `make bench`, or `.venv/bin/python tests/bench/bench_ring.py`;
with `--short` a few increments of small scenes, to see that all of it runs.
What to expect: docs/performance.md.
"""

import pathlib
import sys
import tempfile

import h5py

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from scene_tools import DECKS, PROGRAM, Deck, Run, number, overrides  # noqa: E402
from timing import usage  # noqa: E402

TREATMENTS = ("PERSISTENT", "ADMISSIBLE", "VELOCITY UPDATE")
METHODS = ("NULL SPACE", "SADDLE POINT")
IS_SHORT = "--short" in sys.argv
#: Of the runs of the ring.
LENGTH = {"h": 0.1, "t_end": 0.5} if IS_SHORT else {}


def measure(*arguments):
    """Seconds of CPU, seconds on the clock and peak memory in MB of one call of the program."""
    done = usage([PROGRAM, *arguments])
    if done.code != 0:
        sys.exit(f"{' '.join(map(str, arguments))}:\n{done.errors}")
    return done.cpu, done.wall, done.memory


def table(*names):
    widths = [max(len(name), 8) for name in names]
    print("\n" + "  ".join(name.rjust(w) for name, w in zip(names, widths)))

    def row(*values):
        texts = [f"{v:.4g}" if isinstance(v, float) else str(v) for v in values]
        print("  ".join(text.rjust(w) for text, w in zip(texts, widths)), flush=True)

    return row


def bench_ring(folder):
    print("Ring scene, h = 0.01, 800 increments, one thread")
    row = table(
        "treatment      ", "method      ", "CPU [s]", "ms/increment", "Newton", "MB", "energy drift"
    )
    for treatment in TREATMENTS:
        for method in METHODS:
            out = folder / "ring"
            cpu, _, memory = measure(
                DECKS / "ring.inp", "--quiet", "--output", out, "--set", f"method={method}",
                "--set", f"initiation={treatment}", *overrides(LENGTH),
            )  # fmt: skip
            history = Run(out / "ring").history
            total = history["total"]
            drift = abs(total/total[0] - 1).max()
            row(
                treatment, method, cpu, 1e3*cpu/(len(history) - 1), int(history["newton"].sum()),
                memory, float(drift),
            )  # fmt: skip


def bench_formulations(folder):
    from book.common import FORMULATIONS     # with what draws: no other process needs that

    print("\nRing scene, formulations of contact; contact: search, gaps, null space; overlap: its check")
    row = table("formulation                              ", "h", "CPU [s]", "contact [s]",
                "share [%]", "overlap [%]", "Newton", "cuts", "MB")  # fmt: skip
    for name, choice in FORMULATIONS.items():
        for h in (0.05, 0.01)[: 1 if IS_SHORT else 2]:
            out = folder / "ring"
            parameters = overrides({"h": h, "frame": 1, **choice, **LENGTH})
            cpu, _, memory = measure(DECKS / "ring.inp", "--quiet", "--output", out, *parameters)
            run = Run(out / "ring")
            with h5py.File(run.file(".h5"), "r") as file:
                contact, judge = (float(file[f"sets/RUN/{name}_CPU_SECONDS"][()].item())
                                  for name in ("CONTACT", "JUDGE"))
            history = run.history
            row(name.replace("`", ""), h, cpu, contact, 100*contact/cpu, 100*judge/cpu,
                int(history["newton"].sum()), int(history["cuts"].sum()), memory)  # fmt: skip


def block_text(n_x, n_y, name, first_node, first_element, corner, size):
    """Nodes and elements of a rectangle, column by column from the left, each from the bottom."""
    lines = [f"*NODE, NSET={name}"]
    for i in range(n_x + 1):
        for j in range(n_y + 1):
            x, y = corner[0] + size[0]*i/n_x, corner[1] + size[1]*j/n_y
            lines.append(f"{first_node + i*(n_y + 1) + j}, {number(x)}, {number(y)}")
    lines.append(f"*ELEMENT, TYPE=CPE4, ELSET={name}")
    for i in range(n_x):
        for j in range(n_y):
            a = first_node + i*(n_y + 1) + j
            b = a + n_y + 1
            lines.append(f"{first_element + i*n_y + j}, {a}, {b}, {b + 1}, {a + 1}")
    return "\n".join(lines)


END = """*MATERIAL, NAME=SOFT
*ELASTIC
100., 0.1
*DENSITY
0.01
{sections}
*STEP, INC=1000000
*DYNAMIC, DIRECT
{h}, {t_end}
*NODE FILE, FREQUENCY=1000000
U
*END STEP
"""


def bench_reading(folder):
    print("\nReading and checking a deck of one block (`emcon check`)")
    row = table("nodes", "MB of text", "CPU [s]", "us/node", "MB")
    for n in (5,) if IS_SHORT else (50, 100, 200, 447):
        text = "*HEADING\nBlock\n" + block_text(n, n, "BLOCK", 1, 1, (0, 0), (1, 1)) + "\n"
        text += END.format(
            sections="*SOLID SECTION, ELSET=BLOCK, MATERIAL=SOFT\n1.", h="0.01", t_end="0.01"
        )
        deck = folder / "block.inp"
        deck.write_text(text)
        cpu, _, memory = measure("check", deck, "--quiet")
        n_node = (n + 1)**2
        row(n_node, len(text)/1e6, cpu, 1e6*cpu/n_node, memory)


def contact_deck(n, gap, touching):
    """A strip of n elements over a wider one of as many, half a length of an element apart."""
    parts = [
        "*HEADING\nStrips",
        block_text(n, 1, "LOWER", 1, 1, (0, -1), (n, 1)),
        block_text(n, 1, "UPPER", 2*n + 3, n + 1, (0.25, gap), (n - 0.5, 1)),
        "*SURFACE, NAME=TOP\nLOWER, S3\n*SURFACE, NAME=FOOT\nUPPER, S1",
    ]
    if touching:
        parts.append(
            "*SURFACE INTERACTION, NAME=HARD\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD\n"
            "*CONTACT PAIR, INTERACTION=HARD, TYPE=NODE TO SURFACE\nFOOT, TOP"
        )
    parts.append("*INITIAL CONDITIONS, TYPE=VELOCITY\nUPPER, 2, -0.01\nUPPER, 1, 0.01")
    sections = "*SOLID SECTION, ELSET=LOWER, MATERIAL=SOFT\n1.\n"
    sections += "*SOLID SECTION, ELSET=UPPER, MATERIAL=SOFT\n1."
    return Deck("\n".join(parts) + "\n" + END.format(sections=sections, h="0.01", t_end="0.2"))


def bench_search(folder):
    print("\nContact search: two strips of n elements, 20 increments, with and without the pair")
    row = table("slave nodes", "gap", "with [s]", "without [s]", "us/(node increment)")
    for gap in (0.25, 100.0):
        for n in (20,) if IS_SHORT else (1000, 4000, 16000):
            seconds = []
            for touching in (True, False):
                deck = contact_deck(n, gap, touching).write(folder / "strips.inp")
                seconds.append(min(measure(deck, "--quiet")[0] for _ in range(2)))
            row(n + 1, gap, *seconds, 1e6*(seconds[0] - seconds[1])/(20*(n + 1)))


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        bench_ring(pathlib.Path(name))
        bench_formulations(pathlib.Path(name))
        bench_reading(pathlib.Path(name))
        bench_search(pathlib.Path(name))
