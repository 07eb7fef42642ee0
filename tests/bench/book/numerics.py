"""What the numbers themselves do: units, translation, quadruple precision."""

import subprocess

import scene_tools
import test_units
from scene_tools import DECKS, ROOT, Deck

from .common import Chapter, drift, size, table

QUADRUPLE = ROOT / "build" / "release-quad" / "emcon"


def start_units(runs):
    parameters = {"h": 0.05, "t_end": 1.5, "frame": 0.5}
    return [
        (units, runs.start(test_units.in_units(*units, **parameters)))
        for units in ((0, 0, 0), (3, 0, 0), (-10, 20, -7), (100, -90, 60))
    ]


def units(started, _):
    rows = []
    _, reference = started[0]
    for powers, future in started[1:]:
        try:
            test_units.assert_same_bits(future.result(), reference.result(), powers)
            same = "all bits"
        except AssertionError as problem:
            same = str(problem)
        rows.append((*(f"2^{p}" for p in powers), same))
    return table(["length", "mass", "time", "columns of the history that agree"], rows)


def start_translation(runs):
    started = []
    for distance in (0.0, 1e4, 1e8):
        deck = Deck.read(DECKS / "ring.inp")
        deck.move_nodes(lambda _, x, y, d=distance: (x + d, y + 0.75*d))
        started.append((distance, runs.start(deck, h=0.05, t_end=5, frame=1)))
    return started


def translation(started, _):
    rows = []
    first = started[0][1].result().history
    for distance, future in started:
        run = future.result()
        history = run.history
        rows.append(
            (
                f"{distance:.0e}" if distance else "0",
                f"{history['total'][0]:.12g}",
                size(drift(history["total"])),
                size(run.closing(r"deepest penetration (\S+) of")),
                size(abs(history["py"][-1] - first["py"][-1])) if distance else "",
            )
        )
    return table(["moved by", "total", "drift", "penetration", "change of py at t = 5"], rows)


def start_referee(runs):
    if not QUADRUPLE.exists():
        return []
    started = []
    for method in ("NULL SPACE", "SADDLE POINT"):
        for program in (scene_tools.PROGRAM, QUADRUPLE):
            folder = runs.folder / f"{program.parent.name}_{method[0]}"
            call = [program, DECKS / "ring.inp", "--quiet", "--output", folder]
            call += scene_tools.overrides({"h": 0.05, "t_end": 0.5, "method": method})
            run = scene_tools.Run(folder / "ring")
            future = runs.pool.submit(subprocess.run, call, check=True)
            started.append((program, method, run, future))
    return started


def referee(started, _):
    rows = []
    for program, method, run, future in started:
        future.result()
        last = run.increments[-1][-1].split()
        kind = "quadruple" if program == QUADRUPLE else "double"
        rows.append(
            (
                kind,
                f"`{method}`",
                size(run.closing(r"error of the energy balance (\S+) of")),
                last[-1],
                f"{run.history['kinetic'][-1]:.15f}",
            )
        )
    if not rows:
        return ["*(left out: no `build/release-quad/emcon`; make app PRECISION=quad)*"]
    return table(
        ["state", "method", "energy balance", "last residual", "kinetic energy, t = 0.5"], rows
    )


CHAPTERS = [
    Chapter("units", start_units, units),
    Chapter("translation", start_translation, translation),
    Chapter("referee", start_referee, referee),
]
