"""Two rings pressed into each other: convergence to Lame, with like and unlike meshes."""

import numpy as np
from scene_tools import figures

from .common import Chapter, mortar, node, segment, table

HUB = (8, 16, 32)
LIKE, UNLIKE = 1.0, 1.375
#: Errors that have no order.
LARGE = 0.1
#: Formulations, ratio of elements around the sleeve to those around the hub.
CHOICES = {
    ("`NODE TO SURFACE`", LIKE): node(),
    ("`SEGMENT`, `STANDARD`", LIKE): segment("STANDARD"),
    ("`MORTAR`, `STANDARD`", LIKE): mortar("NODAL", "STANDARD"),
    ("`MORTAR`, `DUAL`", LIKE): mortar("NODAL", "DUAL"),
    ("`NODE TO SURFACE`", UNLIKE): node(),
    ("`NODE TO SURFACE`, `HERMITE`", UNLIKE): node(smoothing="HERMITE"),
    ("`SEGMENT`, `STANDARD`", UNLIKE): segment("STANDARD"),
    ("`MORTAR`, `STANDARD`", UNLIKE): mortar("NODAL", "STANDARD"),
    ("`MORTAR`, `DUAL`", UNLIKE): mortar("NODAL", "DUAL"),
    ("`MORTAR`, `DUAL`, `HERMITE`", UNLIKE): mortar("NODAL", "DUAL", smoothing="HERMITE"),
}


def start(runs):
    decks = {}
    for ratio in (LIKE, UNLIKE):
        for n in HUB:
            decks[ratio, n] = runs.generated(
                "press_fit", "--hub", f"{n}x{n//2}",
                "--sleeve", f"{round(ratio*n)}x{round(ratio*n)//2}")
    exact = [*figures(decks[LIKE, HUB[0]], r"radial displacement (\S+) at the bore"),
             *figures(decks[LIKE, HUB[0]], r"(\S+) at the rim")]
    return exact, {(*choice, n): runs.start(decks[choice[1], n], **parameters)
                   for choice, parameters in CHOICES.items() for n in HUB}


def radial(fields, radius):
    """Mean radial displacement of the nodes at a radius."""
    there = np.abs(np.linalg.norm(fields.x, axis=1) - radius) < 1e-6
    return (fields["displacement"][-1]*fields.x).sum(axis=1)[there].mean()/radius


def order(errors):
    """By the differences of neighbouring meshes, as errors do not end at 0; of small errors."""
    if np.abs(errors).max() > LARGE:
        return ""
    return f"{np.log2(abs((errors[0] - errors[1])/(errors[1] - errors[2]))):.1f}"


def report(started, _):
    exact, futures = started
    rows = []
    for name, ratio in CHOICES:
        fields = [futures[name, ratio, n].result().fields() for n in HUB]
        for what, radius, value in (("bore", 1.0, exact[0]), ("rim", 3.0, exact[1])):
            errors = [radial(f, radius)/value - 1 for f in fields]
            first = (name, "like" if ratio == LIKE else "unlike") if what == "bore" else ("", "")
            rows.append((*first, what, *(f"{100*e:+.3g} %" for e in errors), order(errors)))
    return table(["formulation", "meshes", "error of", *(f"{n} elements" for n in HUB), "order"],
                 rows)


CHAPTERS = [Chapter("press_fit", start, report)]
