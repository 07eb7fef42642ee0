"""The decks of input_decks/, and of the book, with contact of both sides and of all with all."""

import dataclasses

from contact_sides import ALL, BOTH, NODES, ONE, FileOutcome, FileScene
from scene_tools import DECKS

from . import contact_patch
from .common import Chapter, size, table
from .plain import depth

#: What is run beside the deck as it is given: name in the table, sides, parameters.
OTHERS = (
    ("`NODE TO SURFACE`", ONE, {"formulation": NODES}),
    ("the same, `SIDES=BOTH`", BOTH, {}),
    ("`ALL EXTERIOR`", ALL, {}),
)
#: Decks that generators of input_decks/ make for other chapters: name, generator, its options.
GENERATED = {
    **{f"contact patch, {name}": ("contact_patch", *options)
       for name, options in contact_patch.VARIANTS.items()},
    "hertz, 16 edges": ("hertz", "--level", 16),
}
#: Till the ring has left the foundation: looking at every increment takes longer than the run.
SHORTER = {"ring": {"t_end": 4}, "tied ring": {"t_end": 4}}

#: A run of less CPU time [s] has no ratio.
SHORTEST = 0.1


@dataclasses.dataclass(frozen=True)
class Figures:
    """What is left of a run, whose files are large."""

    verdict: dict
    energy: float
    momentum: float                # or None: forces act from outside
    overlap: float
    way: float
    active: int
    cpu: float                     # of all increments but the first [s]
    digits: dict


def figures(runs, scene, sides, **parameters):
    runs.count += 1
    folder = runs.folder / f"run{runs.count}"

    def work():
        done = FileOutcome(scene, folder, sides, **parameters)
        history = done.run.history
        return Figures(done.run.verdict, done.energy_error if done.is_dynamic else None,
                       done.momentum_error if done.is_dynamic and scene.is_free else None,
                       done.overlap.by_edge, done.way.by_edge, int(history["active"].max()),
                       history["cpu"][-1] - history["cpu"][0], done.run.digits(pairs=False))

    return runs.pool.submit(work)


def scenes(runs):
    """All decks, by their names in the table."""
    given = {path.stem.replace("_", " "): path for path in sorted(DECKS.glob("*.inp"))}
    given |= {name: runs.generated(*how) for name, how in GENERATED.items()}
    return {name: FileScene(path) for name, path in given.items()}


# ---- decks with contact -------------------------------------------------------------------------


def formulation(deck):
    """What a deck has as its formulation if nothing is said."""
    lines = deck.data("*PARAMETER") if "<formulation>" in deck.text() else []
    return next((line.split("=")[1].strip() for line in lines
                 if line.split("=")[0].strip() == "formulation"), NODES)


def start(runs):
    started = {}
    for name, scene in scenes(runs).items():
        if not scene.has_contact:
            continue
        given, shorter = formulation(scene.given), SHORTER.get(name, {})
        started[name, f"as given, `{given}`"] = figures(runs, scene, ONE, **shorter)
        for contact, sides, parameters in OTHERS:
            if sides == BOTH and scene.has_walls:
                continue
            if sides != ONE or given != NODES:
                started[name, contact] = figures(runs, scene, sides, **parameters, **shorter)
    return started


def or_blank(value):
    return "" if value is None else size(value)


def ratio(done, given):
    """CPU time by that of the deck as given, where that is long enough for the clock."""
    return f"x {done.cpu/given.cpu:.2f}" if given.cpu > SHORTEST else ""


def cells(done, given):
    verdict = done.verdict["verdict"]
    if verdict == "not completed":
        verdict = f"stops at t = {done.verdict['time']:.3g}"
    return (or_blank(done.energy), or_blank(done.momentum), depth(done.overlap), depth(done.way),
            f"{done.verdict['newton']:.0f}", f"{done.verdict['cuts']:.0f}",
            f"{done.cpu:.2f} s" if done is given else ratio(done, given), verdict)


def report(started, _):
    done = {key: future.result() for key, future in started.items()}
    first = {}
    for (name, _), one in done.items():
        first.setdefault(name, one)
    rows = [(name, contact, *cells(one, first[name])) for (name, contact), one in done.items()]
    return table(["deck", "contact", "energy", "momenta", "overlap", "on the way", "Newton", "cuts",
                  "CPU", "verdict"], rows)


# ---- decks without ------------------------------------------------------------------------------


def start_without(runs):
    return {name: [figures(runs, scene, sides) for sides in (ONE, ALL)]
            for name, scene in scenes(runs).items() if scene.is_plane and not scene.has_contact}


def report_without(started, _):
    rows = []
    for name, futures in started.items():
        given, found = (future.result() for future in futures)
        rows.append((name, found.active,
                     "the same" if found.digits == given.digits else "others",
                     found.verdict["verdict"], f"{given.cpu:.2f} s", ratio(found, given)))
    return table(["deck", "active", "bits of the history", "verdict", "CPU", "with `ALL EXTERIOR`"],
                 rows)


CHAPTERS = [Chapter("contact_sides", start, report),
            Chapter("contact_sides_without", start_without, report_without)]
