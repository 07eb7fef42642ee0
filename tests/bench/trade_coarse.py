"""What massless surfaces cost coarse bodies: bodies of few elements across fall on a rigid floor.

    .venv/bin/python tests/bench/trade_coarse.py [--update]

A square on its corner, one on its side, and a disc, of 2 to 16 elements across, with both treatments
of first contact, against 32 elements without mass at the surface. Writes between the marks `coarse`
of docs/trade.md.
"""

import argparse
import math
import pathlib
import re
import tempfile

import numpy as np
from trade import PAGE, PROGRAM, ROOT  # noqa: F401, `trade` says where modules are

from book.common import table  # isort: skip
from plain_scenes import AUTO, Scene  # isort: skip
from scene_tools import run_deck  # isort: skip
from verification import update  # isort: skip

#: Elements across, and increments that follow the waves in them.
MESHES = {16: 0.0025, 12: 0.0025, 8: 0.005, 6: 0.005, 4: 0.01, 3: 0.01, 2: 0.01}
FINE, FINE_STEP = 32, 0.00125
#: Times at which momenta are compared: before, in and after the impact.
TIMES = np.linspace(0.01, 0.8, 80)
TREATMENTS = ("PERSISTENT", "MASSLESS")


def square(scene, n, turn):
    """A square of side 1 above the floor, turned by `turn` [rad]."""
    c, s = math.cos(turn), math.sin(turn)
    height = 0.5*(abs(c) + abs(s)) + 0.01
    scene.block("BODY", (-0.5, -0.5), (1.0, 1.0), (n, n), velocity=(0.0, -1.0),
                shape=lambda x, y: (c*x - s*y, s*x + c*y + height))


def disc(scene, n):
    scene.disc("BODY", (0.0, 0.51), 0.5, (n, max(2, n//2)), velocity=(0.0, -1.0))


BODIES = {"square on its corner": lambda scene, n: square(scene, n, math.pi/4),
          "square on its side": lambda scene, n: square(scene, n, 0.0), "disc": disc}


def fall(make, n, h, treatment, folder):
    """Momentum upwards at the times, cuts, and the part of its mass that the body has moved."""
    scene = Scene(h, 0.8)
    make(scene, n)
    scene.block("FLOOR", (-2.0, -0.3), (4.0, 0.3), (4, 1)).hold("FLOOR", lambda x, y: True)
    run = run_deck(scene.deck(AUTO), folder, formulation="NODE TO SURFACE", initiation=treatment)
    moved = re.search(r"; (\S+) % of the mass of body 1 moves", run.log)
    return (np.interp(TIMES, run.history["time"], run.history["py"]),
            int(run.history["cuts"].sum()), float(moved[1]) if moved else 0.0)


def lines():
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for name, make in BODIES.items():
            exact, *_ = fall(make, FINE, FINE_STEP, "MASSLESS", folder)
            for n, h in MESHES.items():
                found = [fall(make, n, h, treatment, folder) for treatment in TREATMENTS]
                away = [np.abs(momentum - exact).max()/np.ptp(exact) for momentum, *_ in found]
                rows.append([name, n, f"{found[1][2]:.0f} %", *(f"{100*a:.1f} %" for a in away),
                             " / ".join(str(cuts) for _, cuts, _ in found)])
    return table(["body", "elements across", "mass moved", *(f"`{t}`" for t in TREATMENTS), "cuts"], rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--update", action="store_true", help="write into docs/trade.md")
    found = lines()
    print(*found, sep="\n")
    if parser.parse_args().update:
        PAGE.write_text(update(PAGE.read_text(), "coarse", found))


if __name__ == "__main__":
    main()
