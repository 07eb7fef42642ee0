"""A cantilever of hexahedra swings, by one thread and by more: seconds of an increment, and whether the bits are the same.

    .venv/bin/python tests/bench/bench_threads_space.py [--cells 30x30x30 ...] [--threads 1 2] [--rounds 3]

An increment is what a longer run takes more than a short one. Threads sleep while they wait; *busiest* is what the
thread that works most takes of the processor: on a machine that does nothing else, about the seconds of the clock.
On one that does, it tells more than those. The table has medians of rounds.
"""

from __future__ import annotations

import argparse
import dataclasses
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1]/name) for name in ("", "scenes")]

from bench_space import write  # noqa: E402
from scene_tools import PROGRAM  # noqa: E402
from timing import ENVIRONMENT  # noqa: E402

SHORT, LONG = 2, 12
TICK = 1/os.sysconf("SC_CLK_TCK")
PAUSE = 0.01


@dataclasses.dataclass(frozen=True)
class Work:
    """Seconds of a run: of the clock, of the processor, and of the thread that worked most."""

    wall: float
    cpu: float
    busiest: float

    def __sub__(self, other: Work) -> Work:
        return Work(self.wall - other.wall, self.cpu - other.cpu, self.busiest - other.busiest)


def thread_seconds(pid: int) -> dict[str, float]:
    """Seconds of the processor of each thread, as Linux counts them."""
    found = {}
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        fields = (task/"stat").read_text(encoding="ascii").rpartition(")")[2].split()
        found[task.name] = TICK*(int(fields[11]) + int(fields[12]))
    return found


def run(program: str, deck: pathlib.Path, threads: int) -> tuple[Work, bytes]:
    """What a run takes, and its results."""
    start = time.monotonic()
    process = subprocess.Popen([program, deck, "--quiet", "--threads", str(threads), "--output", deck.parent],
                               env={**ENVIRONMENT, "OMP_WAIT_POLICY": "passive"})
    seconds: dict[str, float] = {}
    while process.poll() is None:
        try:
            seconds.update(thread_seconds(process.pid))
        except OSError:                     # it, or one of its threads, has just ended
            pass
        time.sleep(PAUSE)
    assert process.returncode == 0
    wall = time.monotonic() - start
    return Work(wall, sum(seconds.values()), max(seconds.values())), deck.with_suffix(".vtkhdf").read_bytes()


def measure(cells: tuple[int, ...], options: argparse.Namespace) -> None:
    """Rows of the table."""
    found: dict[int, list[Work]] = {n: [] for n in options.threads}
    results: dict[int, set[bytes]] = {SHORT: set(), LONG: set()}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(options.rounds):
            for threads in options.threads:
                taken = {}
                for n in (SHORT, LONG):
                    deck = pathlib.Path(folder)/f"beam{n}.inp"
                    write(deck, cells, "C3D8", n)
                    taken[n], result = run(options.program, deck, threads)
                    results[n].add(result)
                found[threads].append(taken[LONG] - taken[SHORT])
    same = "the same" if all(len(each) == 1 for each in results.values()) else "others"
    first = found[options.threads[0]]
    for threads, work in found.items():
        each = [statistics.median(getattr(w, name) for w in work)/(LONG - SHORT)
                for name in ("wall", "cpu", "busiest")]
        gain = [statistics.median(getattr(a, name)/getattr(b, name) for a, b in zip(first, work, strict=True))
                for name in ("wall", "busiest")]
        print(f"| {'x'.join(map(str, cells))} | {threads} | " + " | ".join(f"{x:.2f}" for x in each + gain)
              + f" | {same} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", nargs="*", default=["30x30x30"])
    parser.add_argument("--threads", type=int, nargs="*", default=[1, 2])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--program", default=PROGRAM, help="another emcon")
    options = parser.parse_args()
    print("| cells | threads | clock [s] | processor [s] | busiest [s] | gain by clock | by busiest | bits |\n"
          + "|---"*8 + "|")
    for size in options.cells:
        measure(tuple(map(int, size.split("x"))), options)


if __name__ == "__main__":
    main()
