"""Coulomb friction: blocks that slide to rest, and the ring on a free block."""

from friction_scenes import NODES, balance, block_on_floor, ring, way

from .common import Chapter, drift, size, table


def law(run):
    return size(run.verdict["law_violation"])


# ---- sliding to rest ----------------------------------------------------------------------------

BLOCKS = {
    "elastic, `BETA=2e-3`": {"eta": 2e-3},
    "elastic, `BETA=2e-3`, 8 x 4": {"eta": 2e-3, "cells": (8, 4)},
    "elastic, undamped": {},
}


def start_rest(runs):
    return {(name, h): runs.start(block_on_floor(h, 0.72, 0.3, v0=2.0, **more), **NODES)
            for name, more in BLOCKS.items() for h in (0.01, 0.005, 0.0025)}


def report_rest(started, _):
    rows = []
    for (name, h), future in started.items():
        run = future.result()
        history = run.history
        cells = BLOCKS[name].get("cells", (4, 2))
        distance = way(run, (cells[0] + 1)*(cells[1] + 1))[-1]
        rows.append((name, f"{h:g}", f"{distance:.5f}", size(balance(history)),
                     f"{history['newton'][1:].mean():.1f}", int(history["newton"].max()),
                     int(history["cuts"].sum()), law(run)))
    return table(["block", "h", "distance", "balance", "Newton", "at most", "cuts", "law"], rows)


# ---- ring ---------------------------------------------------------------------------------------


def start_ring(runs):
    return {(mu, method, sides): runs.start(ring(mu), **NODES, h=0.01, t_end=1.0, method=method,
                                            sides=sides)
            for mu in (0.2, 0.8)
            for method, sides in (("NULL SPACE", "ONE"), ("SADDLE POINT", "ONE"),
                                  ("NULL SPACE", "BOTH"))}


def report_ring(started, _):
    rows = []
    for (mu, method, sides), future in started.items():
        run = future.result()
        history = run.history
        rows.append((f"{mu:g}", f"`{method}`", f"`{sides}`", f"{history['friction_loss'][-1]:.12f}",
                     size(balance(history)), *(size(drift(history[name]))
                                               for name in ("px", "py", "lz")),
                     f"{history['newton'][1:].mean():.1f}", int(history["cuts"].sum()), law(run)))
    return table(["mu", "method", "sides", "taken by friction", "balance", "px", "py", "lz",
                  "Newton", "cuts", "law"], rows)


CHAPTERS = [Chapter("friction_rest", start_rest, report_rest),
            Chapter("friction_ring", start_ring, report_ring)]
