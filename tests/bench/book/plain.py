"""Plain scenes of contact: balance, overlap and cost, in each kind of contact."""

import dataclasses
import statistics

import plain_scenes
from plain_scenes import ALL, AUTO, ONE, SCENES, UNGUARDED, Outcome

from .common import Chapter, size, table

#: Kinds of contact by what the table calls them: sides, parameters of the deck.
KINDS = {
    "`NODE TO SURFACE`, `SIDES=ONE`": (ONE, {"formulation": "NODE TO SURFACE"}),
    "`NODE TO SURFACE`": (AUTO, {"formulation": "NODE TO SURFACE"}),
    "`ALL EXTERIOR`": (ALL, {}),
    "`SEGMENT`": (ONE, {"formulation": "SEGMENT"}),
    "`MORTAR`": (ONE, {"formulation": "MORTAR"}),
}
#: What is less than this is rounding, in the tables: positions have 16 digits.
ROUNDING = 1e-13


@dataclasses.dataclass(frozen=True)
class Figures:
    """What is left of a run, whose files may be large."""

    ends: bool
    time: float
    energy: float
    own: float
    overlap: float
    way: float
    stand_off: float
    cuts: int
    cpu: float


def figures(runs, scene, sides, parameters):
    runs.count += 1
    folder = runs.folder / f"run{runs.count}"

    def work():
        done = Outcome(scene, folder, sides, **parameters)
        verdict, history = done.run.verdict, done.run.history
        return Figures(done.has_ended, verdict["time"], done.energy_error, verdict["penetration"],
                       done.overlap.by_edge, done.way.by_edge, verdict["stand_off"],
                       int(history["cuts"].sum()), done.cpu)

    return runs.pool.submit(work)


def start(runs):
    """Each kind, and those of one side without their guards too."""
    return {(name, kind, sides): figures(runs, scene(), sides, parameters)
            for name, scene in SCENES.items() for kind, (given, parameters) in KINDS.items()
            for sides in ([given, UNGUARDED] if given == ONE else [given])}


def depth(value):
    return "0" if value <= ROUNDING else f"{value:.2g}"


def cells(done, bare):
    without = "" if bare is None else depth(bare.overlap) if bare.ends else "stops"
    if not done.ends:
        return (f"stops at t = {done.time:.2g}", *3*("",), without, "", done.cuts, "")
    return (size(done.energy), *map(depth, (done.own, done.overlap, done.way)), without,
            depth(done.stand_off), done.cuts, f"{1000*done.cpu:.1f}")


def report(started, _):
    done = {key: future.result() for key, future in started.items()}
    rows = [(name, kind, *cells(done[name, kind, sides], done.get((name, kind, UNGUARDED))))
            for name in SCENES for kind, (sides, _) in KINDS.items()]
    return table(["scene", "contact", "energy", "penetration", "overlap", "on the way",
                  "without guards", "stand-off", "cuts", "CPU [ms]"], rows)


# ---- ways that cross ----------------------------------------------------------------------------


def crossings_start(runs):
    return {kind: [figures(runs, scene, *choice)
                   for n in (2, 4) for scene in plain_scenes.crossings(n).values()]
            for kind, choice in KINDS.items()}


def crossings_report(started, _):
    rows = []
    for kind, futures in started.items():
        done = [future.result() for future in futures]
        ended = [one for one in done if one.ends]
        rows.append((kind, sum(one.way > 0.5 for one in ended), len(done) - len(ended),
                     depth(max(one.way for one in ended)),
                     size(max(one.energy for one in ended)), sum(one.cuts for one in done),
                     f"{1000*statistics.mean(one.cpu for one in done):.1f}"))
    return table(["contact", "missed", "stopped", "deepest overlap", "energy", "cuts", "CPU [ms]"],
                 rows)


CHAPTERS = [Chapter("plain", start, report),
            Chapter("plain_crossings", crossings_start, crossings_report)]
