"""Round bodies in a row, the first of which flies at the others: what is symmetric stays so.

`python tests/scenes/head_on.py` runs all steps, meshes and formulations, and chains of ten.
"""

import itertools
import math
import pathlib
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from scene_tools import Deck, number, run_deck  # noqa: E402

RADIUS, GAP = 0.5, 0.1


def row(n_body, n_edge, h, t_end, turn=0.0):
    """Rigid rings of `n_edge` edges, vertex before vertex, along a line that is turned by `turn`.

    The first has the velocity 1. Parameters: formulation, sides.
    """
    c, s = math.cos(turn), math.sin(turn)
    nodes, cards, pairs = [], [], []
    for k in range(n_body):
        first, middle = 1 + 2*k*n_edge, k*(2*RADIUS + GAP)
        for level, i in itertools.product((0, 1), range(n_edge)):
            r, angle = RADIUS*(1 - 0.5*level), 2*math.pi*i/n_edge
            x, y = middle + r*math.cos(angle), r*math.sin(angle)
            nodes.append(f"{first + level*n_edge + i}, {number(c*x - s*y)}, {number(s*x + c*y)}")
        cards += [f"*ELEMENT, TYPE=CPE4, ELSET=B{k}"]
        for i in range(n_edge):
            a, b = first + i, first + (i + 1) % n_edge
            cards.append(f"{1 + k*n_edge + i}, {a}, {b}, {b + n_edge}, {a + n_edge}")
        cards += [f"*SURFACE, NAME=B{k}", f"B{k}, S1",
                  f"*SOLID SECTION, ELSET=B{k}, MATERIAL=M", "1.",
                  f"*RIGID BODY, ELSET=B{k}, REF NODE={10**6 + k}"]
        nodes.append(f"{10**6 + k}, {number(c*middle)}, {number(s*middle)}")
        if k > 0:
            pairs += ["*CONTACT PAIR, INTERACTION=I, TYPE=<formulation>, SIDES=<sides>",
                      f"B{k - 1}, B{k}"]
    return Deck("\n".join([
        "*HEADING", "head on", "*PARAMETER", "formulation = NODE TO SURFACE", "sides = AUTO",
        "*NODE", *nodes, *cards, "*MATERIAL, NAME=M", "*HYPERELASTIC, COUPLED NEO HOOKE",
        "1000., 0.3", "*DENSITY", "1.", "*SURFACE INTERACTION, NAME=I", *pairs,
        "*INITIAL CONDITIONS, TYPE=ROTATING VELOCITY",
        f"{10**6}, 0., {number(c)}, {number(s)}", "0., 0.",
        "*STEP, NLGEOM, INC=1000000", "*DYNAMIC, DIRECT", f"{number(h)}, {number(t_end)}",
        "*END STEP"]), "row")


def defect(run, turn=0.0):
    """The largest difference from what one body after the other hands on, by the velocity 1: the
    last one has all of it, along the line."""
    _, momentum = run.series("BODIES", "MOMENTUM")
    _, mass = run.series("BODIES", "MASS")
    velocity = momentum[-1, :, :2]/mass[0].reshape(-1, 1)
    wanted = np.zeros_like(velocity)
    wanted[-1] = math.cos(turn), math.sin(turn)
    return np.abs(velocity - wanted).max()


#: Formulation and sides.
FORMS = [("NODE TO SURFACE", "AUTO"), ("NODE TO SURFACE", "ONE"), ("NODE TO SURFACE", "BOTH"),
         ("SEGMENT", "AUTO"), ("MORTAR", "AUTO")]


def cases():
    """What the whole sweep runs: (bodies, edges, h, t_end, turn)."""
    for n_edge, h, turn in itertools.product((24, 48), (0.01, 0.02, 0.05, 0.1, 0.3, 1.0), (0, 0.3)):
        yield 2, n_edge, h, max(0.5, 2*h), turn
    for n_body, n_edge, h in itertools.product((3, 6, 10), (24, 48), (0.01, 0.02, 0.05, 0.1)):
        yield n_body, n_edge, h, GAP*n_body + 0.4, 0.3


def main():
    worst = 0.0
    with tempfile.TemporaryDirectory() as folder:
        for case, (form, sides) in itertools.product(cases(), FORMS):
            run = run_deck(row(*case), pathlib.Path(folder), formulation=form, sides=sides)
            found = defect(run, case[-1])
            worst = max(worst, found)
            if found > 1e-9:
                print(f"{found:.1e}", form, sides, *case, flush=True)
    print(f"largest difference from the exact velocities {worst:.1e}")


if __name__ == "__main__":
    main()
