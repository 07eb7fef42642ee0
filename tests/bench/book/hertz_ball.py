"""A ball hits a rigid plane: Hertz's law of impact, over speed and mesh."""

import re
import sys

import numpy as np
from scene_tools import DECKS

from . import ball_law
from .common import Chapter, drift, size, table

sys.path.append(str(DECKS))
import make_hertz_ball  # noqa: E402

SPEEDS, CELLS = (1.0, 0.1, 0.01), (4, 8)
#: The time of contact is measured between passes through this part of the largest force.
PART = 0.1


def long_part():
    """Of Hertz's time of contact, how much has more than PART of the largest force."""
    def passed(first):
        """From an approach of `first` to the largest one, x = 1 - s^2 takes the root away."""
        s = (np.arange(20000) + 0.5)/20000*np.sqrt(1.0 - first)
        return (2*s/np.sqrt(1.0 - (1.0 - s*s)**2.5)).mean()*np.sqrt(1.0 - first)

    return passed(PART**(2/3))/passed(0.0)


def measured(run, speed):
    """Errors of time and largest force, of the impulse beside momentum, of the energy."""
    history, law = run.history, make_hertz_ball.law(speed)
    force, time = 4*np.asarray(history["pair1_force_z"]), np.asarray(history["time"])
    over = np.flatnonzero(force > PART*force.max())
    first, last = slice(over[0] - 1, over[0] + 1), slice(over[-1], over[-1] + 2)
    passes = (np.interp(PART*force.max(), force[first], time[first]),
              np.interp(-PART*force.max(), -force[last], time[last]))
    momentum = np.asarray(history["pz"])
    impulse = momentum - momentum[0] - np.asarray(history["pair1_impulse_z"])
    return ((passes[1] - passes[0])/(long_part()*law["time"]) - 1, force.max()/law["force"] - 1,
            np.abs(impulse).max()/abs(momentum[0]), drift(np.asarray(history["total"])),
            momentum[-1]/momentum[0])


def by_ball(speed):
    """Time and largest force of the ball by those of the half space."""
    energy = 0.5*make_hertz_ball.MASS*speed**2/(make_hertz_ball.MODULUS*make_hertz_ball.RADIUS**3)
    return ball_law.impact(energy, make_hertz_ball.POISSON)


def start(runs):
    return {(speed, cells): runs.start(runs.generated("hertz_ball", "--speed", speed, "--cells", cells,
                                                      "--increments", 150))
            for cells in CELLS for speed in SPEEDS}


def unknowns(run):
    return re.search(r"(\d+) unknowns in step 1", run.file(".log").read_text())[1]


def report(started, _):
    rows = []
    for cells in CELLS:
        for speed in SPEEDS:
            run = started[speed, cells].result()
            errors = measured(run, speed)
            own = [(1 + error)/law - 1 for error, law in zip(errors, by_ball(speed), strict=False)]
            rows.append((f"1/{cells}", unknowns(run), f"{speed:g}", f"{make_hertz_ball.law(speed)['radius']:.3f}",
                         *(f"{100*e:+.2f} %" for e in (*errors[:2], *own)), size(errors[2]), size(errors[3]),
                         f"{errors[4]:.5f}"))
    rows.extend(("ball's law", "", f"{speed:g}", f"{make_hertz_ball.law(speed)['radius']:.3f}",
                 *(f"{100*(e - 1):+.2f} %" for e in by_ball(speed)), *[""]*5) for speed in SPEEDS)
    return table(["facet / a", "unknowns", "speed", "a / R", "time", "largest force", "time, by the ball",
                  "force, by the ball", "impulse", "energy", "rebound"], rows)


CHAPTERS = [Chapter("hertz_ball", start, report)]
