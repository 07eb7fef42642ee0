"""Contact and ties over sides with midside nodes: patch test, orders on straight and curved
interfaces."""

import numpy as np
from scene_tools import attempt
from side_scenes import (
    POISSON,
    PRESSURE,
    RADII,
    YOUNG,
    patch,
    press_fit,
    pressed,
    pressed_errors,
    tied_ring,
    tied_ring_errors,
)

from .common import Chapter, size, table

KINDS = [("CPE4", "CPE4"), ("CPE4", "CPE8"), ("CPE8", "CPE4"), ("CPE8", "CPE8"), ("CPE8R", "CPE6"), ("CPE6", "CPE3")]
JOINS = {
    "`MORTAR`": "TYPE=MORTAR",
    "`SIDES=BOTH`": "TYPE=NODE TO SURFACE, SIDES=BOTH",
    "`SIDES=ONE`": "TYPE=NODE TO SURFACE, SIDES=ONE",
    "`*TIE`": "",
}
LEVELS = (4, 8, 16)
#: Elements of the reference along the interface: at its error errors of the table do not count.
FINER = 48
INTERFERENCE = 1e-3
HERMITE = "*SURFACE SMOOTHING, TYPE=HERMITE\n"


def fields(deck, folder):
    """Overlap is part of what one-sided contact does: the verdict is not asked."""
    return attempt(deck, folder, (), {})[1].fields()


# ---- patch test ---------------------------------------------------------------------------------


def start_patch(runs):
    return {(kinds, join): runs.start(patch(kinds, options), run=fields)
            for kinds in KINDS for join, options in JOINS.items()}


def shown(value):
    return size(value) if value < 1e-9 else f"{100*value:.0f} %"


def report_patch(started, _):
    rows = []
    for kinds in KINDS:
        errors = []
        for join in JOINS:
            stress = started[kinds, join].result()["cauchy_stress"][-1]
            errors.append(np.abs(stress[:, [0, 1, 3]] - [0, -PRESSURE, 0]).max()/PRESSURE)
        rows.append((kinds[1], kinds[0], *map(shown, errors)))
    return table(["above", "below", *JOINS], rows)


# ---- orders -------------------------------------------------------------------------------------


def fit_errors(fields):
    """Mean radial displacement of the bore and the rim of a press fit, against Lame."""
    a, b, c = RADII
    young, poisson = YOUNG/(1 - POISSON**2), POISSON/(1 - POISSON)
    hub = (b**2 + a**2)/(b**2 - a**2) - poisson
    sleeve = (c**2 + b**2)/(c**2 - b**2) + poisson
    pressure = INTERFERENCE*young/b/(hub + sleeve)
    right = {a: -2*pressure*b**2/(b**2 - a**2)*a/young, c: 2*pressure*b**2/(c**2 - b**2)*c/young}
    r = np.linalg.norm(fields.x, axis=1)
    u = (fields["displacement"][-1]*fields.x).sum(axis=1)/r
    return np.array([abs(u[np.abs(r - at) < 1e-6].mean()/value - 1) for at, value in right.items()])


def plates(options, card=""):
    def make(kind, n):
        deck = pressed(kind, n, options)
        deck.replace("*STATIC\n1, 1", f"*STATIC\n1, 1{card}")
        return deck

    return make


def fit(kind, n):
    return press_fit(kind, n, INTERFERENCE, JOINS["`SIDES=ONE`"], HERMITE)


SCENES = [
    ("pressed plates", "`MORTAR`", plates(JOINS["`MORTAR`"])),
    ("pressed plates", "`MORTAR`, `STANDARD`", plates(JOINS["`MORTAR`"], "\n*MORTAR, MULTIPLIER=STANDARD")),
    ("pressed plates", "`SIDES=BOTH`", plates(JOINS["`SIDES=BOTH`"])),
    ("tied rings", "`*TIE`", tied_ring),
    ("press fit", "`SIDES=ONE`, `HERMITE`", fit),
]


def start_orders(runs):
    finer = runs.start(pressed("CPE8", FINER), run=fields)
    return finer, {
        (scene, join, kind, n): runs.start(make(kind, n), run=fields)
        for scene, join, make in SCENES for kind in ("CPE4", "CPE6", "CPE8") for n in LEVELS}


def report_orders(started, _):
    finer, runs = started
    rows = []
    for scene, join, kind in dict.fromkeys(key[:3] for key in runs):
        errors = []
        for n in LEVELS:
            result = runs[scene, join, kind, n].result()
            if scene == "pressed plates":
                errors.append(pressed_errors(result, finer.result()))
            else:
                errors.append((tied_ring_errors if scene == "tied rings" else fit_errors)(result))
        for what, row in zip(("bore", "rim") if scene == "press fit" else ("displacement", "stress"),
                             np.transpose(errors), strict=True):
            order = "" if scene == "press fit" else f"{np.log2(row[-2]/row[-1]):.1f}"
            rows.append((scene, join, kind, what, *map(size, row), order))
    return table(["scene", "interface", "elements", "error of", *(f"n = {n}" for n in LEVELS), "order"], rows)


CHAPTERS = [Chapter("midside_patch", start_patch, report_patch),
            Chapter("midside_orders", start_orders, report_orders)]
