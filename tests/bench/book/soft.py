"""Contact that gives way and materials that are damped, against closed forms."""

import math

import numpy as np
from test_damping import balance as damped_balance
from test_damping import bar, damped, frequency
from test_soft_contact import (AUGMENTED, DECKS, MASS, OMEGA, PENALTY, SPEED, attempt,
                               balance, explicit, falling, place)

from .common import Chapter, size, table

#: Increments by the time 1/omega of the mass on the spring.
STEPS = (0.2, 0.1, 0.05)
#: Of the bar.
METHODS = ("NULL SPACE", f"{PENALTY}, FACTOR=0.1", PENALTY, f"{PENALTY}, FACTOR=10", AUGMENTED)
#: By mass and by moduli.
DAMPED = ((2.0, 0.0), (0.0, 0.01), (1.0, 0.005))


def attempted(deck, folder, **parameters):
    return attempt(deck, folder, (), parameters)[1]


# ---- a mass on the spring of a penalty ----------------------------------------------------------


def start_spring(runs):
    found = {}
    for scheme, change in (("`ENERGY MOMENTUM`", lambda deck: deck), ("`EXPLICIT`", explicit)):
        for step in STEPS:
            deck = change(falling(step/OMEGA, 1.0))
            found[scheme, step] = runs.start(deck, attempted, method=PENALTY,
                                             formulation="NODE TO SURFACE")
    return found


def spring(futures, _):
    rows = []
    for (scheme, step), future in futures.items():
        history = future.result().history
        v, gap = place(history)
        rows.append((scheme, f"{step:g}", f"{-gap.min()*OMEGA/SPEED:.4f}", f"{v[-1]/SPEED:.4f}",
                     f"{2*history['contact_energy'].max()/(MASS*SPEED**2):.4f}",
                     size(balance(history)[0])))
    return table(["scheme", "h omega", "depth (1)", "rebound (1)", "stored, at most (1)",
                  "energy"], rows)


# ---- the bouncing bar ---------------------------------------------------------------------------


def start_bar(runs):
    return {method: runs.start(DECKS/"bouncing_bar.inp", attempted, method=f"'{method}'", t_end=2.0,
                               frame=2.0, formulation="NODE TO SURFACE", h=0.0025)
            for method in METHODS}


def bars(futures, _):
    rows = []
    for method, future in futures.items():
        run = future.result()
        history = run.history
        force = np.abs(history["pair1_force_y"])
        touches = np.nonzero(force > 0)[0]
        impulse = np.abs(history["pair1_impulse_y"][-1])
        verdict = run.verdict
        rows.append((f"`{method}`", f"{verdict.get('give', 0.0):.1e}",
                     f"{history['contact_energy'].max()/500:.1e}", f"{impulse:.1f}",
                     f"{history['time'][touches[-1]] - history['time'][touches[0] - 1]:.3f}",
                     size(balance(history)[0]), verdict["verdict"]))
    return table(["method", "penetration / edge", "stored / kinetic energy",
                  "impulse (266.7)", "contact lasts (0.667)", "energy", "verdict"], rows)


# ---- damping ------------------------------------------------------------------------------------


def start_damping(runs):
    period = 2*math.pi/frequency()
    return {(alpha, beta, n): runs.start(damped(bar(period/n, 4*period), alpha, beta), attempted)
            for alpha, beta in DAMPED for n in (20, 40)}


def damping(futures, _):
    """The ratio of damping from what is left of the energy after four periods."""
    omega, rows = frequency(), []
    for (alpha, beta, n), future in futures.items():
        history = future.result().history
        exact = 0.5*(alpha/omega + beta*omega)
        total = history["kinetic"] + history["strain"]
        found = math.log(total[0]/total[-1])/(2*omega*history["time"][-1])
        rows.append((f"{alpha:g}", f"{beta:g}", n, f"{found:.5f}", f"{exact:.5f}",
                     f"{100*abs(found/exact - 1):.2f} %",
                     f"{history['damping_loss'][-1]/total[0]:.4f}", size(damped_balance(history))))
    return table(["`ALPHA`", "`BETA`", "increments in a period", "ratio found", "of the oscillator",
                  "off by", "dissipated / energy", "energy"], rows)


CHAPTERS = [Chapter("soft_spring", start_spring, spring), Chapter("soft_bar", start_bar, bars),
            Chapter("soft_damping", start_damping, damping)]
