"""Coulomb friction: blocks that slide to rest, scenes of closed form, the ring on a free block."""

import math

import numpy as np
from friction_scenes import (
    NODES,
    balance,
    belt_way,
    block_on_floor,
    on_spring,
    partial_slip,
    polygon,
    pressed_round,
    pressed_sideways,
    ring,
    rolling,
    way,
)

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


# ---- known -------------------------------------------------------------------------------------


def on_belt(h):
    return lambda _, folder: on_spring(h, 1.4, 0.3, folder, stiffness=25.0, belt=0.3)


def pulled(_, folder):
    return on_spring(0.01, 3.4, 0.3, folder, pull=200/7, stiffness=24/7)


def start_known(runs):
    slope = -math.atan(0.5)
    return {
        "rest": runs.start(block_on_floor(0.01, 0.72, 0.3, v0=2.0, rigid=True), **NODES),
        **{push: runs.start(block_on_floor(0.01, 0.5, 0.5, push=push, rigid=True), **NODES)
           for push in (4.99, 5.01)},
        **{("slope", mu): runs.start(block_on_floor(0.01, 0.5, mu, slope=slope, rigid=True),
                                     **NODES) for mu in (0.49, 0.5)},
        **{("rolls", inner): runs.start(rolling(inner, 2.5e-4, 4e-3, 0.3, 0.02), **NODES)
           for inner in (0.95, 0.05)},
        "plate": runs.start(pressed_sideways(32)[0], **NODES),
        "pressed_round": runs.start(pressed_round(96)[0], **NODES),
        **{("belt", h): runs.start(None, on_belt(h)) for h in (0.02, 0.01, 0.005)},
        "pulled": runs.start(None, pulled),
    }


def plate(run):
    """Displacements of the plate at the floor."""
    place = pressed_sideways(32)[1]
    u = run.fields()["displacement"][-1, :len(place), 0]
    return [u[(abs(place[:, 0] - x) < 1e-9) & (place[:, 1] < 1e-9)].item()*1e6
            for x in (0, 0.00125, 0.005, 0.0075, 0.01125)]


def report_known(started, _):
    done = {name: future.result() for name, future in started.items()}
    rows = [("rigid block that slides to rest, h = 0.01", "2/3",
             f"{way(done['rest'], 15)[-1]:.6f}")]
    for push in (4.99, 5.01):
        rows.append((f"rigid block, mu = 0.5, pushed by {push/10:g} of its weight: acceleration",
                     f"{max(0.0, push - 5):g}", f"{done[push].history['px'][-1]:.9f}"))
    for mu in (0.49, 0.5):
        moved = way(done["slope", mu], 15, -math.atan(0.5))[-1]
        rows.append((f"the same on a slope of 1 in 2, mu = {mu:g}: acceleration",
                     f"{10*math.cos(math.atan(0.5))*(0.5 - mu):.9f}", f"{8*moved + 0.0:.9f}"))
    for inner, name in ((0.95, "ring"), (0.05, "disc")):
        (outside, turning), (hole, lost) = polygon(1.0), polygon(inner)
        mass = outside - hole
        rows.append((f"{name} of 40 sides that slides, then rolls: velocity left",
                     f"{1/(1 + (turning - lost)/mass):.5f}",
                     f"{done['rolls', inner].history['px'][-1]/mass/0.02:.5f}"))
    error = []
    for h in (0.02, 0.01, 0.005):
        time, x, _ = done["belt", h]
        error.append(np.abs(x - belt_way(time, 0.3, 25.0, 0.3)).max()/0.12)
    rows.append(("stick-slip on a belt, h = 0.02, 0.01, 0.005: largest error by the way that the "
                 "spring gives at the limit", "order 2", ", ".join(f"{e:.1e}" for e in error)))
    time, x, _ = done["pulled"]
    rows.append(("SDNV104, block pulled against a spring: places at t = 1.7 and 3.4", "14.917, 3.5",
                 f"{np.interp(1.7, time, x):.3f}, {np.interp(3.4, time, x):.3f}"))
    rows.append(("SSNV128, plate pressed sideways, 32 x 32: displacements at the floor, 1e-6",
                 "28.6, 27.2, 22.8, 19.8, 15.0",
                 ", ".join(f"{u:.2f}" for u in plate(done["plate"]))))
    force, width, strip = partial_slip(done["pressed_round"], pressed_round(96)[1]).T
    for k in np.flatnonzero(force < 0.98)[::2]:
        rows.append((f"two like bodies, one round, Q = {force[k]:.3f} mu P: strip that sticks by "
                     f"that in contact, nodes {strip[k]:.2f} apart",
                     f"{math.sqrt(1 - force[k]):.3f}",
                     f"{width[k]:.3f}"))
    return table(["scene", "known", "here"], rows)


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
            Chapter("friction_known", start_known, report_known),
            Chapter("friction_ring", start_ring, report_ring)]
