"""Tied pieces: patch tests, orders of convergence, cantilever, free flight, the ring in pieces."""

import math

import numpy as np
from scene_tools import DECKS, figures
from tie_tools import BEAM, SMOOTH, error_norms

from .common import (COLOURS, LARGE, Chapter, axes, common_legend, drift, mortar, node, save,
                     size, table)
from .ring import rebound

MULTIPLIERS = ("DUAL", "STANDARD")

# ---- patch tests --------------------------------------------------------------------------------

INTERFACES = {
    "straight": ("--interface", "STRAIGHT"),
    "straight, sides swapped": ("--interface", "STRAIGHT", "--swap"),
    "inclined": ("--interface", "INCLINED"),
    "arc": ("--interface", "CURVED"),
    "arc, sides swapped": ("--interface", "CURVED", "--swap"),
    "three pieces": ("--interface", "THREE"),
    "four pieces": ("--interface", "FOUR"),
    "four pieces, sides swapped": ("--interface", "FOUR", "--swap"),
}
#: Columns: options of make_tied_patch.py.
WAYS = {
    "statics, linear": ("--linear",),
    "statics, `NLGEOM`": (),
    "dynamics, `NLGEOM`": ("--dynamic",),
}
LOADS = ("DISPLACEMENT", "TRACTION", "ROLLERS")


def start_patch(runs):
    started = {}
    for name, interface in INTERFACES.items():
        for way, more in WAYS.items():
            for load in LOADS:
                deck = runs.generated("tied_patch", *interface, *more, "--load", load)
                for multiplier in MULTIPLIERS:
                    run = runs.start(deck, multiplier=multiplier)
                    started[name, way, load, multiplier] = deck, run
    return started


def stress_error(deck, run):
    """Largest error of the stress at the end, relative to the largest stress."""
    wanted = figures(deck, r"stress xx = (\S+), yy = (\S+), zz = (\S+), xy = (\S+) ")
    stress = run.fields()["cauchy_stress"][-1][:, :4]
    return np.abs(stress - wanted).max()/np.abs(wanted).max()


def patch(started, _):
    done = {key: stress_error(deck, run.result()) for key, (deck, run) in started.items()}
    rows = []
    for name in INTERFACES:
        for multiplier in MULTIPLIERS:
            errors = [max(done[name, way, load, multiplier] for load in LOADS) for way in WAYS]
            rows.append((name, f"`{multiplier}`", *map(size, errors)))
    return table(["interface", "multiplier", *WAYS], rows)


# ---- orders -------------------------------------------------------------------------------------

#: Elements of the coarse side along half of the square, per ratio of the two sides.
LEVELS = {1: (4, 8, 16, 32, 64), 1.5: (4, 8, 16, 32, 64), 10: (4, 8, 16)}
SMOOTH_INTERFACES = {
    "straight": "STRAIGHT",
    "arc": "CURVED",
    "2 x 2 pieces": "FOUR",
    "2 x 2 pieces, arcs": "FOUR CURVED",
}
MATCHING = "one piece"


def start_orders(runs):
    started = {}
    for level in LEVELS[1]:
        deck = runs.generated("tied_smooth", "--interface", "NONE", "--level", level)
        started[MATCHING, 1, "", level] = runs.start(deck)
    for name, interface in SMOOTH_INTERFACES.items():
        for ratio, levels in LEVELS.items():
            for level in levels:
                deck = runs.generated("tied_smooth", "--interface", interface, "--ratio", ratio,
                                      "--level", level)
                for multiplier in MULTIPLIERS:
                    run = runs.start(deck, multiplier=multiplier)
                    started[name, ratio, multiplier, level] = run
    return started


def last_orders(norms, levels):
    """Slopes between the last two levels."""
    step = math.log(levels[-1]/levels[-2])
    return np.log(np.array(norms[-2])/norms[-1])/step


def orders(started, folder):
    done = {key: error_norms(run.result().fields(), SMOOTH) for key, run in started.items()}
    rows = [order_row(done, MATCHING, 1, [""])]
    rows += [order_row(done, name, ratio, MULTIPLIERS)
             for name in SMOOTH_INTERFACES for ratio in LEVELS]
    if folder:
        draw_orders(done, folder / "verification_ties.png")
    return table(["interface", "ratio", "displacement, level 16", "order", "energy, level 16",
                  "order", "`STANDARD` against `DUAL`"], rows)


def order_row(done, name, ratio, multipliers):
    """Figures of the first multiplier, and how much the other one changes an error at most."""
    levels = LEVELS[ratio]
    norms = [[done[name, ratio, m, level] for level in levels] for m in multipliers]
    order = last_orders(norms[0], levels)
    at = levels.index(16)
    change = size(np.abs(np.array(norms[1])/norms[0] - 1).max()) if len(norms) > 1 else ""
    return (name, f"1 : {ratio:g}", size(norms[0][at][0]), f"{order[0]:.2f}",
            size(norms[0][at][1]), f"{order[1]:.2f}", change)


def draw_orders(done, path):
    panels = axes(len(SMOOTH_INTERFACES), n_row=2, height=2.4)
    for name, column in zip(SMOOTH_INTERFACES, panels.T, strict=True):
        column[0].set_title(name, fontsize=10)
        for row, axis in enumerate(column):
            draw_errors(axis, done, name, row)
        column[1].set_xlabel("elements along half of the square")
    panels[0, 0].set_ylabel("error of displacement")
    panels[1, 0].set_ylabel("error of energy")
    common_legend(panels[0, -1])
    save(path)


def draw_errors(axis, done, name, kind):
    """Errors of one interface over the level; `kind` 0: displacement, 1: energy."""
    levels = LEVELS[1]
    norm = [done[MATCHING, 1, "", level][kind] for level in levels]
    axis.loglog(levels, norm, "k-", lw=0.8, label="one piece")
    slope = [0.5*norm[0]*(levels[0]/level)**(2 - kind) for level in levels]
    axis.loglog(levels, slope, ":", color="0.5", lw=1, label=f"order {2 - kind}")
    for ratio, colour, large in zip(LEVELS, COLOURS, LARGE, strict=False):
        for multiplier, line in zip(MULTIPLIERS, ("o-", "x--"), strict=True):
            norm = [done[name, ratio, multiplier, level][kind] for level in LEVELS[ratio]]
            axis.loglog(LEVELS[ratio], norm, line, color=colour, ms=large, lw=0.2*large,
                        label=f"1 : {ratio:g}, {multiplier.lower()}")
    axis.set_xticks(levels, [str(level) for level in levels])
    axis.minorticks_off()


# ---- cantilever ---------------------------------------------------------------------------------


BEAM_LEVELS = {1: (4, 8, 16), 1.5: (4, 8, 16), 10: (2, 4, 8)}


def start_cantilever(runs):
    return {
        (ratio, multiplier, level): runs.start(
            runs.generated("tied_cantilever", "--ratio", ratio, "--level", level),
            multiplier=multiplier,
        )
        for ratio, levels in BEAM_LEVELS.items()
        for multiplier in MULTIPLIERS
        for level in levels
    }


def cantilever(started, _):
    done = {}
    for key, run in started.items():
        fields = run.result().fields()
        tip = np.flatnonzero((fields.x == [BEAM.length, 0]).all(axis=1))[0]
        exact = BEAM.displacement(BEAM.length, 0.0)[1]
        uy = fields["displacement"][-1, tip, 1]
        done[key] = *error_norms(fields, BEAM), uy/exact - 1
    rows = []
    for ratio, levels in BEAM_LEVELS.items():
        for k, level in enumerate(levels):
            norms = [done[ratio, "DUAL", n][:2] for n in levels[: k + 1]]
            order = [f"{v:.2f}" for v in last_orders(norms, levels[: k + 1])] if k else ("", "")
            dual, standard = (np.array(done[ratio, m, level]) for m in MULTIPLIERS)
            rows.append((f"1 : {ratio:g}", level, f"{100*dual[2]:+.2f} %", size(dual[0]), order[0],
                         size(dual[1]), order[1], size(np.abs(standard/dual - 1).max())))
    return table(["ratio", "elements over the depth", "tip", "displacement", "order", "energy",
                  "order", "`STANDARD` against `DUAL`"], rows)


# ---- free flight --------------------------------------------------------------------------------


def start_spin(runs):
    started = {}
    for multiplier in MULTIPLIERS:
        for h in (0.05, 0.01):
            started[multiplier, h] = runs.start(
                DECKS / "tied_spin.inp", multiplier=multiplier, h=h, t_end=1000*h, frame=500*h
            )
        started[multiplier, "turn"] = runs.start(
            DECKS / "tied_rotation.inp", multiplier=multiplier
        )
    return started


def spin(started, _):
    rows = []
    for (multiplier, h), future in started.items():
        run = future.result()
        if h == "turn":
            stress = np.abs(run.fields()["cauchy_stress"]).max()/100
            rows.append((f"`{multiplier}`", "turned by 90 degrees", *[""]*5, size(stress)))
            continue
        history = run.history
        rows.append((f"`{multiplier}`", f"h = {h:g}",
                     *(size(drift(history[name])) for name in ("total", "px", "py", "lz")),
                     f"{history['strain'].max()/history['total'][0]:.2f}", ""))
    return table(["multiplier", "motion", "energy", "px", "py", "lz",
                  "largest strain energy / total", "largest stress / E"], rows)


# ---- ring ---------------------------------------------------------------------------------------

CONTACT = {"`NODE TO SURFACE`": node(), "`MORTAR`": mortar("NODAL", "DUAL")}


def start_ring(runs):
    return {
        (name, contact, h): runs.start(DECKS / f"{name}.inp", h=h, frame=8, **choice)
        for contact, choice in CONTACT.items()
        for h in (0.02, 0.01)
        for name in ("ring", "tied_ring")
    }


def ring(started, _):
    rows = []
    for (name, contact, h), future in started.items():
        run = future.result()
        history = run.history
        velocity = rebound(run) if name == "ring" else piece_velocity(run)
        rows.append(("one piece" if name == "ring" else "six and three pieces", contact, f"{h:g}",
                     *(f"{v:.4f}" for v in velocity), size(drift(history["total"])),
                     f"{history['newton'][1:].mean():.1f}", int(history["cuts"].sum())))
    return table(["ring", "contact", "h", "vx", "vy", "energy", "Newton", "cuts"], rows)


def piece_velocity(run):
    """Velocity at the end of all bodies, from the first on, that make up the mass of the ring."""
    (mass,) = figures(DECKS / "tied_ring.inp", r"ring mass (\S+);")
    masses = run.series("BODIES", "MASS")[1][0]
    n = int(np.argmin(np.abs(np.cumsum(masses) - mass))) + 1
    return run.series("BODIES", "MOMENTUM")[1][-1, :n, :2].sum(axis=0)/masses[:n].sum()


CHAPTERS = [
    Chapter("ties_patch", start_patch, patch),
    Chapter("ties_orders", start_orders, orders),
    Chapter("ties_cantilever", start_cantilever, cantilever),
    Chapter("ties_spin", start_spin, spin),
    Chapter("ties_ring", start_ring, ring),
]
