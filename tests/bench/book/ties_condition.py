"""Condition numbers of the saddle point (6), as printed and scaled, and of the null space (7)."""

import os
import subprocess

from scene_tools import PROGRAM, Deck, overrides

from .common import COLOURS, LARGE, Chapter, axes, common_legend, save, size, table
from .tied_grid import DYNAMIC, STATIC, Grid

CONDITION = PROGRAM.parent / "ties_condition"
METHODS = ("NULL SPACE", "SADDLE POINT")
STEPS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
#: Elements along the side of a coarse piece; the fine ones have half as many again.
LEVELS = (2, 4, 6, 8)

#: A ring that touches its foundation, then one increment of the size that is asked for.
RING = ("--ring", "64x2", "--block", "60x2")
LAST_STEP = """*STEP, NLGEOM
*DYNAMIC, DIRECT
<last>, <last>
*CONSTRAINT METHOD, TYPE=<method>
*CONTACT INITIATION, TYPE=<initiation>
*NEWTON, TYPE=FULL, TOLERANCE=<tolerance>
*END STEP
"""
BEFORE_LAST = {"h": 0.02, "t_end": 1.7}


def ring_deck(runs):
    deck = Deck.read(runs.generated("ring", *RING))
    deck.remove("*RESTART")
    deck.data("*PARAMETER").append("last = 0.01")
    return Deck(deck.text() + LAST_STEP).write(runs.folder / "ring_condition.inp")


def pieces_deck(runs, level, law, step, side=1.0):
    path = runs.folder / f"pieces_{law}_{level}_{side:g}.inp"
    return Grid(m=2, coarse=level, fine=3*level//2, side=side).write(path, law, step)


def start(runs):
    if not CONDITION.exists():
        return {}
    motion, ring = pieces_deck(runs, 4, "hyperelastic", DYNAMIC), ring_deck(runs)
    scenes = {("pieces", h): (motion, {"h": h, "t_end": h}) for h in STEPS}
    scenes |= {("size", n): (pieces_deck(runs, n, "linear", STATIC), {}) for n in LEVELS}
    scenes["STANDARD", 4] = pieces_deck(runs, 4, "linear", STATIC), {"multiplier": "STANDARD"}
    scenes["steel", 4] = pieces_deck(runs, 4, "linear", STATIC), {"young": 2.1e11}
    scenes["small", 4] = pieces_deck(runs, 4, "linear", STATIC, 1e-3), {"young": 2.1e11}
    scenes |= {("contact", h): (ring, {**BEFORE_LAST, "last": h}) for h in STEPS}
    return {(*key, method): runs.pool.submit(condition, deck, {**more, "method": method})
            for key, (deck, more) in scenes.items() for method in METHODS}


def condition(deck, parameters):
    """Rows, conditions (as printed, scaled, as solved), eigenvalues: ends, number of negative."""
    command = [CONDITION, deck, *(text.removeprefix("--set=") for text in overrides(parameters))]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(list(map(str, command)), env=environment, capture_output=True,
                          text=True, check=True)  # fmt: skip
    form, *words = done.stdout.split(",")
    assert form == parameters["method"].lower() and int(words[0]) > 0, done.stdout
    return int(words[0]), *map(float, words[1:6]), int(words[6])


def label(kind, value):
    return {
        "pieces": f"pieces, h = {value:g}",
        "size": f"pieces, static, {value:g} and {1.5*value:g} elements",
        "STANDARD": "4 and 6 elements, `STANDARD`",
        "steel": "4 and 6 elements, E = 2.1e11",
        "small": "the same, side 0.001",
        "contact": f"contact, h = {value:g}",
    }[kind]


def report(started, folder):
    if not started:
        return ["*(left out: no `ties_condition`; make benches)*"]
    done = {key: future.result() for key, future in started.items()}
    keys = [key[:2] for key in done if key[2] == METHODS[0]]
    rows = []
    for key in keys:
        reduced, saddle = (done[*key, method] for method in METHODS)
        rows.append((label(*key), saddle[0], reduced[0], *map(size, saddle[1:4]),
                     size(reduced[3]), saddle[6], reduced[6], size(reduced[4]/reduced[5])))
    if folder:
        draw(done, folder / "verification_ties_condition.png")
    return table(["scene", "rows (6)", "rows (7)", "(6) as printed", "one scale",
                  "and rows by length", "(7)", "eigenvalues < 0 of (6)", "of (7)",
                  "smallest / largest eigenvalue of (7)"],
                 rows)


def draw(done, path):
    panels = axes(3)
    for axis, kind, values, title in (
        (panels[0], "pieces", STEPS, "tied pieces"),
        (panels[1], "size", LEVELS, "tied pieces, static"),
        (panels[2], "contact", STEPS, "contact"),
    ):
        reduced, saddle = ([done[kind, v, method] for v in values] for method in METHODS)
        lines = (("(6) as printed", [x[1] for x in saddle], "s-"),
                 ("(6), one scale", [x[2] for x in saddle], "^-"),
                 ("(6), rows by length too", [x[3] for x in saddle], "o-"),
                 ("(7)", [x[3] for x in reduced], "x--"))
        for (name, numbers, mark), colour, large in zip(lines, COLOURS, LARGE, strict=False):
            axis.loglog(values, numbers, mark, color=colour, ms=large, lw=0.2*large, label=name)
        axis.set_title(title, fontsize=10)
        axis.set_xlabel("time step" if kind != "size" else "elements along a coarse piece")
        if kind == "size":
            axis.set_xticks(LEVELS, [str(n) for n in LEVELS])
        else:
            axis.invert_xaxis()
        axis.minorticks_off()
    panels[0].set_ylabel("condition number")
    common_legend(panels[0])
    save(path)


CHAPTERS = [Chapter("ties_condition", start, report)]
