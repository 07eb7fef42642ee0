"""What scenes cost, beside what they may cost at most: one thread, energy to 1e-10.

    .venv/bin/python tests/bench/bench_targets.py [--long] [--kratos PYTHON] [--update]

Prints the table of targets of docs/performance.md, and the least time of each phase of the ring
(`floors.py`); asserts nothing. Seconds are those of the user, medians of three rounds; per
increment they are those from the first contact on, without reading. `--long` adds the rings of
72,272 and 286,880 unknowns, some minutes; `--kratos` the one of bench_peers.py; `--short` a few
increments, to see that all of it runs. Elements are timed by build/release/bench_element, which
`make benches` makes.
"""

import argparse
import dataclasses
import math
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

import bench_peers  # noqa: E402
from bench_counts import BIG, PAGE, RINGS  # noqa: E402
from book.common import size as digits  # noqa: E402
from book.common import table  # noqa: E402
from floors import floors  # noqa: E402
from peers import kratos  # noqa: E402
from scene_tools import DECKS, PROGRAM, Deck, Run, overrides  # noqa: E402
from timing import usage  # noqa: E402
from verification import update  # noqa: E402

H = 0.01
BEFORE = bench_peers.BEFORE
#: At most, of a size of the ring: seconds per increment.
PER_INCREMENT = {4724: 0.006, 18344: 0.03, 72272: 0.12, 286880: 0.6}
#: At most, of decks with their own parameters: seconds.
DECK_TARGETS = {"tied_ring": 1.2, "spinning_ring": 0.4, "self_contact": 0.35, "two_bodies": 0.6}
#: At least: how many times ours Kratos takes.
KRATOS = {1250: 25, 4724: 35}


@dataclasses.dataclass(frozen=True)
class Row:
    """Of the table. `target` is a most, or a least where `is_least`."""

    scene: str
    target: float
    unit: str
    found: float
    error: float | None = None
    is_least: bool = False

    @property
    def is_met(self):
        return self.found >= self.target if self.is_least else self.found <= self.target

    def cells(self):
        return (self.scene, f"{'>=' if self.is_least else '<='} {self.target:g}{self.unit}",
                f"{self.found:.3g}{self.unit}", f"{self.found/self.target:.2f}",
                "met" if self.is_met else "missed",
                "" if self.error is None else digits(self.error))


class Scene:
    """Runs of a deck, each with its usage and its verdict."""

    def __init__(self, deck, folder, rounds):
        self.deck, self.folder, self.rounds = deck, folder, rounds

    def runs(self, **parameters):
        options = overrides(parameters)
        for _ in range(self.rounds):
            done = usage([PROGRAM, self.deck, "--quiet", "--output", self.folder, *options])
            if done.code not in (0, 3):
                raise RuntimeError(done.errors)
            yield done, Run(self.folder/self.deck.stem).verdict

    def median(self, **parameters):
        """Seconds of the user, MiB, and the verdict of the last run."""
        done, verdicts = zip(*self.runs(**parameters), strict=True)
        return (statistics.median(d.user for d in done),
                statistics.median(d.memory for d in done), verdicts[-1])


def error_of(verdict):
    return verdict["largest_energy_error"]/verdict["largest_energy"]


def ring_deck(size, folder):
    deck = folder/f"ring_{size[0]}.inp"
    subprocess.run([sys.executable, DECKS/"make_ring.py", "--ring", size[0], "--block", size[1],
                    "--output", deck], check=True)
    return deck


def unpolished(folder):
    """The deck of the ring, solved to a tolerance and not to round-off."""
    deck = Deck.read(DECKS/"ring.inp")
    deck.replace("TOLERANCE=<tolerance>", "TOLERANCE=1e-11, POLISH=NO")
    return deck.write(folder/"unpolished.inp")


def whole_runs(folder, rounds, options):
    """The ring through impact and rebound."""
    for h, most in ((H, 1.2), (0.05, 0.6)):
        t_end = 10*h if options.short else 8.0
        for deck, how in ((DECKS/"ring.inp", ""), (unpolished(folder), ", to 1e-11")):
            user, memory, verdict = Scene(deck, folder, rounds).median(h=h, t_end=t_end)
            name = f"ring, 1250 unknowns, h = {h:g}, {verdict['increments']} increments{how}"
            yield Row(name, most, " s", user, error_of(verdict))
        if h == H:
            yield Row("ring, 1250 unknowns, memory", 40, " MiB", memory)


def per_increment(size, folder, rounds, increments):
    """Unknowns, seconds per increment in contact, and the last run of the longer ones."""
    scene = Scene(ring_deck(size, folder), folder, rounds)
    first, *_ = scene.median(h=H, t_end=H*BEFORE, frame=H*BEFORE)
    last, memory, verdict = scene.median(h=H, t_end=H*increments, frame=H*increments)
    unknowns = bench_peers.ring_of(*map(bench_peers.cells, size)).unknowns
    return unknowns, (last - first)/(increments - BEFORE), memory, verdict


def sizes_of(folder, rounds, options):
    """The ring at several sizes, and how its time grows."""
    sizes = RINGS[:2] if options.short else RINGS + BIG*options.long
    found = {}
    for size in sizes:
        is_big = size in BIG
        increments = 8 if options.short else 24 if is_big else 50
        n, seconds, memory, verdict = per_increment(size, folder, 1 if is_big else rounds,
                                                    increments)
        found[n] = seconds
        if n in PER_INCREMENT:
            yield Row(f"ring, {n} unknowns, per increment in contact", PER_INCREMENT[n], " s",
                      seconds, error_of(verdict))
    if is_big:
        yield Row(f"ring, {n} unknowns, memory", 1100, " MiB", memory)
        yield Row(f"ring, {n} unknowns, before the first increment", 1.5, " s", verdict["seconds"]["read"])
    (n, first), *_, (m, last) = found.items()
    if min(first, last) > 0:
        yield Row(f"exponent of time per increment, {n} to {m} unknowns", 1.1, "",
                  math.log(last/first)/math.log(m/n))


def decks(folder, rounds, options):
    for name, most in DECK_TARGETS.items():
        scene = Scene(DECKS/f"{name}.inp", folder, 1 if options.short else rounds)
        parameters = {"h": 0.05, "t_end": 0.1} if options.short else {}
        user, _, verdict = scene.median(**parameters)
        yield Row(f"`{name}.inp`", most, " s", user, error_of(verdict))


def elements():
    """Microseconds of a residual, and of one with tangent, of a neo-Hookean CPE4."""
    program = PROGRAM.parent/"bench_element"
    if not program.exists():
        print("Elements are passed over: no bench_element (make benches)")
        return
    line = next(line for line in usage([program]).text.splitlines()
                if line.split()[:1] == ["CPE4"] and "COUPLED NEO HOOKE" in line.upper())
    residual, both = map(float, line.split()[-2:])
    yield Row("CPE4, neo-Hooke: forces", 0.1, " us", residual)
    yield Row("CPE4, neo-Hooke: forces and tangent", 0.8, " us", both)


def beside_kratos(rounds, options):
    """How many times our seconds per increment Kratos takes."""
    if not kratos.version(options.kratos):
        print("Kratos is passed over: no Python interpreter that has it (--kratos)")
        return
    found = {bench_peers.OURS: bench_peers.Emcon("NODE TO SURFACE"),
             "Kratos": bench_peers.Peer(kratos, options.kratos)}
    for size, (n, least) in zip(RINGS, KRATOS.items(), strict=False):
        told = bench_peers.told_by(size, found, rounds, 6 if options.short else 50)
        yield Row(f"Kratos on the ring, {n} unknowns", least, " times",
                  bench_peers.times_ours(told, "Kratos"), is_least=True)


def two_threads(folder, rounds, options):
    """Seconds on the clock of one thread over those of two, where the program knows threads."""
    if "--threads" not in usage([PROGRAM, "--help"]).text:
        print("Two threads are passed over: the program knows one")
        return
    size = RINGS[0 if options.short else 2]
    deck, wall, csv = ring_deck(size, folder), {1: [], 2: []}, {}
    for _ in range(rounds):
        for n in wall:
            done = usage([PROGRAM, deck, "--quiet", "--output", folder, "--threads", n,
                          *overrides({"h": H, "t_end": 0.24, "frame": 0.24})],
                         OMP_NUM_THREADS=str(n))
            wall[n].append(done.wall)
            csv[n] = Run(folder/deck.stem).digits()
    ratio = statistics.median(a/b for a, b in zip(*wall.values(), strict=True))
    same = "the same" if csv[1] == csv[2] else "OTHER"
    unknowns = bench_peers.ring_of(*map(bench_peers.cells, size)).unknowns
    yield Row(f"two threads against one, {unknowns} unknowns, {same} bits", 1.6, " times", ratio,
              is_least=True)


def rows_of(options):
    rounds = 1 if options.short else options.rounds
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        yield from whole_runs(folder, rounds, options)
        yield from sizes_of(folder, rounds, options)
        yield from beside_kratos(rounds, options)
        yield from two_threads(folder, rounds, options)
        yield from elements()
        yield from decks(folder, rounds, options)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kratos", default=os.environ.get("EMCON_KRATOS_PYTHON"),
                        metavar="PYTHON", help="interpreter that has Kratos")
    parser.add_argument("--rounds", type=int, default=3, help="runs of each scene (3)")
    for name in ("long", "short", "update"):
        parser.add_argument(f"--{name}", action="store_true")
    return parser


def main():
    options = arguments().parse_args()
    targets = table(["scene", "target", "found", "found / target", "", "energy error"],
                    [row.cells() for row in rows_of(options)])
    print("\nTargets", *targets, sep="\n")
    least = floors(RINGS[:1] if options.short else RINGS + BIG[:1]*options.long)
    print("\nPhases of the ring: what they take, and at least", *least, sep="\n")
    if options.update:
        text = update(PAGE.read_text(), "targets", targets)
        PAGE.write_text(update(text, "floors", least))


if __name__ == "__main__":
    main()
