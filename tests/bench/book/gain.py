"""Where runs with contact gain energy, and where they lose it: one bar, all schemes."""

import re

import numpy as np
from scene_tools import DECKS, Deck, attempt

from .bar import PERIOD
from .common import Chapter, size, table
from .impacts import switches

PAGE = "energy.md"
SCHEMES = ("ENERGY MOMENTUM", "MIDPOINT", "TRAPEZOIDAL", "GENERALIZED ALPHA", "BDF2")
#: Increments in which a wave crosses a half and one element of the bar, 10/50 long, at 30.
COURANT = (0.5, 1.0)
#: Largest kinetic energy of the fall, with which the bar meets the floor.
KINETIC = 500.0


def start(runs):
    """Exact contact at the end of each increment for all, and what else the program has."""
    cases = [(scheme, "ADMISSIBLE", courant) for scheme in SCHEMES for courant in COURANT]
    cases += [("ENERGY MOMENTUM", kind, courant) for kind in ("PERSISTENT", "MASSLESS")
              for courant in COURANT]
    deck = Deck.read(DECKS / "bouncing_bar.inp")

    def run(deck, folder, **parameters):
        return attempt(deck, folder, (), parameters)[1]

    return {(scheme, kind, courant): runs.start(deck, run, scheme=scheme, initiation=kind,
                                                h=courant*0.2/30, t_end=PERIOD, frame=1)
            for scheme, kind, courant in cases}


def report(futures, _):
    rows = []
    for (scheme, kind, courant), future in futures.items():
        run = future.result()
        history = run.history
        energy = KINETIC + history["total"]
        reasons = run.verdict["reasons"]
        said = re.sub(r"(at time|, which).*", "", reasons[0]).strip(" ,") if reasons else "good"
        rows.append((f"`{scheme}`", f"`{kind}`", f"{courant:g}",
                     f"{energy[-1]/KINETIC:.3f}" if abs(energy[-1] - KINETIC) > 1e-9*KINETIC
                     else f"1 + {size(abs(energy[-1]/KINETIC - 1))}",
                     switches(np.abs(history["pair1_force_y"])), said))
    return table(["scheme", "first contact", "Courant", "energy after two impacts (1)",
                  "switches (4)", "verdict"], rows)


CHAPTERS = [Chapter("gain", start, report, PAGE)]
