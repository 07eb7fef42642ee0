"""Contact patch test: how far each formulation is from the uniform state."""

import numpy as np
from contact_sides import ALL, with_sides
from scene_tools import DECKS, Deck, figures, heading

from .common import (COLOURS, LARGE, MORTAR, Chapter, axes, legend, mortar, node, save, segment,
                     size, table)

PRESSURE = 10.0
#: Options of make_contact_patch.py.
VARIANTS = {
    "aligned": ("--upper", "4x2"),
    "misaligned": ("--upper", "5x2"),
    "finer slave": (),
    "the same, elements halved twice": ("--lower", "16x8", "--upper", "28x12"),
    "finer master": ("--lower", "9x3", "--upper", "4x2"),
    "sides swapped": ("--slave", "LOWER"),
    "inclined": ("--slope", 0.3, "--lateral", "EQUAL"),
    "inclined, swapped": ("--slope", -0.4, "--lateral", "EQUAL", "--slave", "LOWER"),
    "slave longer": ("--overhang", 0.7, "--lateral", "HELD", "--slave", "LOWER"),
    "slave longer, up to a node": ("--lower", "6x2", "--overhang", 1, "--lateral", "HELD",
                                   "--slave", "LOWER"),
    "master longer": ("--overhang", 0.7, "--lateral", "HELD"),
}
NODE, SMOOTH = "`NODE TO SURFACE`", "`MORTAR`, `HERMITE`"
BOTH, EXTERIOR = "`SIDES=BOTH`: stress", "`ALL EXTERIOR`: stress"
SEGMENT = {f"`SEGMENT`, `{basis}`": segment(basis) for basis in ("STANDARD", "DUAL")}
OTHERS = {NODE: node(), BOTH: {**node(), "sides": "BOTH"}, **SEGMENT, SMOOTH: mortar("EDGE", "DUAL", smoothing="HERMITE")}
POINTS = (1, 2, 3, 4, 5, 6, 8, 10)


def errors(deck, run):
    """Largest error of the pressure of active slave nodes and of the stress, relative to 10. Guards
    hold nodes of the master, by forces that stand for more than the edges beside these."""
    yy, xx = figures(deck, r"stress yy = (\S+), xx = (\S+), xy = 0 everywhere")
    fields = run.fields()
    slave = 1 if "the lower one is the slave" in heading(deck) else 2
    of_slave = np.concatenate([cell for cell, body in zip(fields.cells, fields["body"][-1], strict=True)
                               if body == slave])
    active = np.isin(np.arange(len(fields.x)), of_slave) & (fields["contact_active"][-1] == 1)
    stress = fields["cauchy_stress"][-1][:, [0, 1, 3]] - [xx, yy, 0.0]
    pressure = fields["contact_pressure"][-1][active] - PRESSURE
    return np.abs(pressure).max()/PRESSURE, np.abs(stress).max()/PRESSURE


def shown(value):
    if value < 1e-9:
        return size(value)
    return f"{100*value:.0f} %" if value > 0.1 else f"{100*value:.2g} %"


# ---- meshes -------------------------------------------------------------------------------------


def all_exterior(path):
    deck = with_sides(Deck.read(path), ALL)
    deck.insert("*EL FILE\nS\n*CONTACT FILE\nCSTR\n")
    return deck


def start_meshes(runs):
    decks = {name: runs.generated("contact_patch", *options) for name, options in VARIANTS.items()}
    started = {
        (name, choice): (deck, runs.start(deck, **parameters))
        for name, deck in decks.items()
        for choice, parameters in {**MORTAR, **OTHERS}.items()
    }
    return started | {(name, EXTERIOR): (deck, runs.start(all_exterior(deck)))
                      for name, deck in decks.items()}


def meshes(started, _):
    done = {key: errors(deck, future.result()) for key, (deck, future) in started.items()}
    rows = []
    for name in VARIANTS:
        best = np.max([done[name, choice] for choice in MORTAR], axis=0)
        between = max(abs(done[name, choice][1] - done[name, NODE][1]) for choice in SEGMENT)
        sides = [size(done[name, choice][1]) for choice in (BOTH, EXTERIOR)]
        rows.append((name, *map(size, best), *map(shown, done[name, NODE]), *sides, shown(between),
                     shown(done[name, SMOOTH][1])))
    return table(
        ["meshes", "`MORTAR`: pressure", "stress", f"{NODE}: pressure", "stress", BOTH, EXTERIOR,
         "`SEGMENT`: difference of the stress", f"{SMOOTH}: stress"],
        rows,
    )


# ---- Gauss points without segments --------------------------------------------------------------


def start_points(runs):
    decks = {name: runs.generated("contact_patch", *VARIANTS[name])
             for name in ("finer slave", "finer master")}
    return {
        (mesh, multiplier, n): (
            deck,
            runs.start(deck, **mortar("NODAL", multiplier, integration="ELEMENTS", points=n)),
        )
        for mesh, deck in decks.items()
        for multiplier in ("STANDARD", "DUAL")
        for n in POINTS
    }, runs.start(DECKS / "contact_patch.inp", **node())


def points(started, folder):
    runs, node_run = started
    done = {key: errors(deck, future.result()) for key, (deck, future) in runs.items()}
    kinds = list(dict.fromkeys(key[:2] for key in done))
    rows = [(n, *(shown(done[(*kind, n)][1]) for kind in kinds)) for n in POINTS]
    if folder:
        (axis,) = axes(1)
        for kind, colour, large in zip(kinds, COLOURS, LARGE[:2]*2, strict=False):
            axis.semilogy(POINTS, [100*done[(*kind, n)][1] for n in POINTS], "o-", color=colour,
                          ms=large, lw=0.4*large, label=f"{kind[0]}, {kind[1].lower()}")
        level = 100*errors(DECKS / "contact_patch.inp", node_run.result())[1]
        axis.axhline(level, color="0.5", ls="--", lw=1, label="node to surface, finer slave")
        axis.set(xlabel="Gauss points on a slave edge", ylabel="error of stress [%]")
        legend(axis, 3)
        save(folder / "verification_patch.png")
    return table(["`POINTS`", *(f"{mesh}, `{multiplier}`" for mesh, multiplier in kinds)], rows)


CHAPTERS = [
    Chapter("contact_patch", start_meshes, meshes),
    Chapter("contact_patch_points", start_points, points),
]
