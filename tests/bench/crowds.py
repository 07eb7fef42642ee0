"""Decks with many contacts: a pile of discs in a bowl, two strips that slide, a strip that folds.

    .venv/bin/python tests/bench/crowds.py pile|strips|fold > deck.inp

Each takes h and t_end, the strips a formulation too.
"""

import math
import pathlib
import random
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from scene_tools import DECKS, Deck, number  # noqa: E402

sys.path.insert(0, str(DECKS))

from deckwriter import Part, add_grid, box, set_lines, surface_lines  # noqa: E402
from scenery import add_disc  # noqa: E402

#: Of a disc: elements along a quarter of the rim, and across.
CELLS = (4, 1)
#: Of the bowl: its radius, by that of the circle around all discs; where it begins and ends.
ROOM, BEGIN, END = 1.005, math.radians(170), math.radians(370)


def material(names, stiffness, density=1.0):
    return ["*MATERIAL, NAME=SOFT", "*HYPERELASTIC, COUPLED NEO HOOKE",
            f"{number(stiffness)}, 0.3", "*DENSITY", number(density),
            *(line for name in names
              for line in (f"*SOLID SECTION, ELSET={name}, MATERIAL=SOFT", "1."))]


def step(*loads):
    return ["*STEP, NLGEOM, INC=1000000", "*DYNAMIC, DIRECT", "<h>, <t_end>", *loads,
            "*NODE FILE, TIME POINTS=FRAMES", "U, V", "*CONTACT PRINT, TOTALS=ONLY", "CF",
            "*END STEP"]


def parameters(h, t_end, formulation=""):
    lines = ["*PARAMETER", f"h = {number(h)}", f"t_end = {number(t_end)}", "frame = 0.1"]
    return lines + [f"formulation = {formulation}"]*bool(formulation)


FRAMES = ["*TIME POINTS, NAME=FRAMES, GENERATE", "0., <t_end>, <frame>"]


def pile(n_row=10, seed=1, jitter=0.01):
    """n_row x n_row discs of radius 1/2, a lattice that is a little out of order, fall into a bowl.

    Their rims are at least 0.04 - 2 `jitter` apart.
    """
    chance, discs, bowl = random.Random(seed), Part("DISCS"), Part("BOWL")
    pitch, middle = 1.04, 0.5*(n_row - 1)
    for k in range(n_row*n_row):
        row, place = divmod(k, n_row)
        centre = [pitch*(place - middle + 0.25*(-1)**row), pitch*math.sqrt(0.75)*(row - middle)]
        centre = tuple(c + chance.uniform(-jitter, jitter) for c in centre)
        before = len(discs.node)
        add_disc(discs, centre, 0.5, CELLS, (before + 1, len(discs.element) + 1),
                 turn=chance.uniform(0, math.pi))
    radius = ROOM*max(math.hypot(*x) for x in discs.node.values())
    n = round((END - BEGIN)*radius/0.3)

    def wall(i, j):
        angle, r = BEGIN + (END - BEGIN)*i/n, radius + 0.4*(1 - j/2)
        return r*math.cos(angle), r*math.sin(angle)

    grid = add_grid(bowl, (n, 2), wall, (len(discs.node) + 1, len(discs.element) + 1))
    return Deck("\n".join([
        "*HEADING", f"{n_row*n_row} discs fall into a bowl", *parameters(0.01, 1.0),
        *discs.node_lines(), *discs.element_lines(), *bowl.node_lines(), *bowl.element_lines(),
        *set_lines("NSET", "OUTSIDE", [column[0] for column in grid.node]),
        *material(("DISCS", "BOWL"), 1e4), *FRAMES,
        "*BOUNDARY", "OUTSIDE, 1, 2", "*CONTACT", "*CONTACT INCLUSIONS, ALL EXTERIOR",
        *step("*DLOAD", "DISCS, GRAV, 10., 0., -1.")]))


def strips(n=5000, formulation="NODE TO SURFACE"):
    """A strip of n edges slides over one of 1.1 n edges, which do not meet, and is pressed on."""
    lower, upper, size = Part("LOWER"), Part("UPPER"), 0.01*n
    below = add_grid(lower, (n + n//10, 1), box((0.0, -0.02), (1.05*size, 0.02), (n + n//10, 1)))
    above = add_grid(upper, (n, 1), box((0.02*size, 1e-5), (size, 0.02), (n, 1)),
                     (len(lower.node) + 1, len(lower.element) + 1))
    return Deck("\n".join([
        "*HEADING", f"{n} edges slide over {n + n//10}", *parameters(2e-4, 4e-3, formulation),
        *lower.node_lines(), *lower.element_lines(), *upper.node_lines(), *upper.element_lines(),
        *set_lines("NSET", "GROUND", [column[0] for column in below.node]),
        *surface_lines("TOP", "S3", [column[-1] for column in below.element]),
        *surface_lines("BOTTOM", "S1", [column[0] for column in above.element]),
        *material(("LOWER", "UPPER"), 1000.0), *FRAMES,
        "*SURFACE INTERACTION, NAME=FRICTIONLESS",
        "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD",
        "*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=<formulation>", "BOTTOM, TOP",
        "*BOUNDARY", "GROUND, 1, 2", "*INITIAL CONDITIONS, TYPE=VELOCITY",
        "UPPER, 1, 10.", "UPPER, 2, -0.1", *step("*DLOAD", "UPPER, P3, 2.")]))


def fold(n=6):
    """The strip of self_contact.inp, so many times as fine."""
    done = subprocess.run([sys.executable, DECKS/"make_self_contact.py", "--leg", str(22*n),
                           "--bend", str(10*n), "--through", "3"], check=True,
                          capture_output=True, text=True)
    return Deck(done.stdout)


SCENES = {"pile": pile, "strips": strips, "fold": fold}

if __name__ == "__main__":
    sys.stdout.write(SCENES[sys.argv[1]]().text())
