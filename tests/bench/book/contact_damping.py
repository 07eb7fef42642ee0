"""Viscous damping between surfaces, against closed forms, and what it takes of the ring."""

import numpy as np
from contact_damping_scenes import MASS, balance, block_over_floor, damped, ring

from .common import Chapter, drift, size, table

#: By what is left of the clearance, the velocity along the surface by what it was.
SIZES = (0.08, 0.04, 0.02)
TYPES = ("NODE TO SURFACE", "SEGMENT", "MORTAR")
#: Formulation, method, sides.
RINGS = (("NODE TO SURFACE", "NULL SPACE", "ONE"), ("NODE TO SURFACE", "SADDLE POINT", "ONE"),
         ("NODE TO SURFACE", "PENALTY", "ONE"), ("NODE TO SURFACE", "NULL SPACE", "BOTH"),
         ("SEGMENT", "NULL SPACE", "ONE"), ("MORTAR", "NULL SPACE", "ONE"))


def start_known(runs):
    found = {}
    for kind in TYPES:
        for h in SIZES:
            fall = damped(block_over_floor(h, 1.2, height=0.5, velocity=(0.0, -1.0)), 3.0, 0.5, 1.0)
            slide = damped(block_over_floor(h, 0.8, velocity=(1.0, 0.0), gravity=10.0), 1.5, 0.1,
                           tangent=0.5)
            found[kind, h] = [runs.start(deck, formulation=kind) for deck in (fall, slide)]
    return found


def report_known(started, _):
    rows = []
    for (kind, h), futures in started.items():
        fall, slide = (future.result() for future in futures)
        gap = 0.5 + fall.fields()["displacement"][:, :15, 1].mean(axis=1)
        kept = fall.history["py"]/MASS + 3.0*gap
        exact = 0.5 - (1 - np.exp(-3.0*fall.history["time"]))/3.0
        velocity = slide.history["px"]/MASS
        rows.append((f"`{kind}`", f"{h:g}", size(np.ptp(kept)), size(np.abs(gap - exact).max()),
                     size(np.abs(velocity - np.exp(-0.75*slide.history["time"])).max()),
                     size(max(balance(run.history) for run in (fall, slide)))))
    return table(["type", "h", "change of v + 3 g", "gap", "velocity along the floor", "balance"],
                 rows)


def start_ring(runs):
    return {kind: runs.start(ring(0.5, 0.1, 0.3, 0.7), h=0.01, t_end=1.0, formulation=kind[0],
                             method=kind[1], sides=kind[2]) for kind in RINGS}


def report_ring(started, _):
    rows = []
    for kind, future in started.items():
        history = future.result().history
        least = np.diff(history["contact_damping_loss"]).min()
        rows.append((*(f"`{word}`" for word in kind),
                     f"{history['contact_damping_loss'][-1]/history['kinetic'][0]:.8f}",
                     size(max(0.0, -least)), size(balance(history)),
                     *(size(drift(history[name])) for name in ("px", "py", "lz")),
                     f"{history['newton'][1:].mean():.1f}", int(history["cuts"].sum())))
    return table(["type", "method", "sides", "dissipated / energy", "gained from it", "balance", "px",
                  "py", "lz", "Newton", "cuts"], rows)


CHAPTERS = [Chapter("contact_damping_known", start_known, report_known),
            Chapter("contact_damping_ring", start_ring, report_ring)]
