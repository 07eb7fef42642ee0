"""How smooth the contact force of a disc is: thrown at three angles on shifted meshes of a floor.

    .venv/bin/python tests/bench/trade_discs.py [--update]

Rms of the second differences of the force over its mean, while it acts: the mean and the largest
over angles and shifts. Writes between the marks `discs` of docs/trade.md.
"""

import argparse
import itertools
import math
import pathlib
import sys
import tempfile

import numpy as np
from trade import PAGE, ROOT

sys.path.insert(0, str(ROOT / "tests" / "scenes"))

from book.common import table  # noqa: E402
from plain_scenes import AUTO, Scene  # noqa: E402
from scene_tools import run_deck  # noqa: E402
from verification import update  # noqa: E402

TREATMENTS = ("PERSISTENT", "AUTO")
#: From the floor, in degrees; and shifts by parts of an edge of the floor.
ANGLES = (30, 60, 90)
SHIFTS = (0.0, 0.08, 0.16, 0.25)
STEPS = (0.02, 0.01, 0.005, 0.0025)


def throw(edges, angle, shift, h):
    """An elastic disc of radius 1 and `edges` edges, and a rigid floor with edges twice as long."""
    scene = Scene(h, 1.2)
    way = math.radians(angle)
    scene.disc("DISC", (0.0, 1.03), 1.0, (edges//4, edges//8),
               velocity=(1.8*math.cos(way), -1.8*math.sin(way)))
    width = 12/edges
    scene.block("FLOOR", (-2.0 + shift*width, -0.5), (6.0, 0.5), (edges//2, 1))
    return scene.hold("FLOOR", lambda x, y: True)


def roughness(run):
    """Rms of the second differences of the force over its mean, while it acts."""
    force = np.diff(run.history["py"])/np.diff(run.history["time"])
    acts = np.flatnonzero(force > 1e-9*force.max())
    force = force[acts[0]:acts[-1] + 1]
    return np.sqrt(np.mean(np.diff(force, 2)**2))/force.mean()


def lines_of(edges=(24, 48), steps=STEPS):
    """The table, over discs, treatments and increments."""
    rows = []
    for n, treatment, h in itertools.product(edges, TREATMENTS, steps):
        rough, cuts, deepest = [], 0, 0.0
        for angle, shift in itertools.product(ANGLES, SHIFTS):
            with tempfile.TemporaryDirectory() as folder:
                run = run_deck(throw(n, angle, shift, h).deck(AUTO), pathlib.Path(folder),
                               initiation=treatment, formulation="NODE TO SURFACE")
                rough.append(roughness(run))
                cuts += int(run.history["cuts"].sum())
                deepest = max(deepest, run.history["stand_off"].max())
        rows.append((n, f"`{treatment}`", h, f"{np.mean(rough):.3f}", f"{max(rough):.3f}", cuts,
                     f"{deepest:.1e}"))
    return table(["edges", "treatment", "h", "mean", "largest", "cuts", "stand-off"], rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--update", action="store_true", help="write into docs/trade.md")
    options = parser.parse_args()
    lines = lines_of()
    print(*lines, sep="\n")
    if options.update:
        PAGE.write_text(update(PAGE.read_text(), "discs", lines))


if __name__ == "__main__":
    main()
