"""An elastic bar dropped on a rigid floor, against its closed form."""

import dataclasses
import math

import numpy as np
from scene_tools import DECKS, Deck

from .common import (BROAD, COLOURS, Chapter, axes, legend, mortar, node, save, size, table,
                     with_print)

PERIOD = 16/3
#: Text of *CONTACT INITIATION.
TREATMENTS = {
    "`PERSISTENT`": "PERSISTENT",
    "`PERSISTENT`, `GAP TOLERANCE`": "PERSISTENT, GAP TOLERANCE=0.001",
    "`ADMISSIBLE`": "ADMISSIBLE",
    "`VELOCITY UPDATE`": "VELOCITY UPDATE",
}
FORMULATIONS = {"`NODE TO SURFACE`": node(), "`MORTAR`": mortar("NODAL", "DUAL")}


def exact_height(time, n_term=400):
    """Height of the lower end, one period of 16/3 (Doyen, Ern, Piperno 2011)."""
    length, gravity, c = 10.0, 10.0, 30.0
    tau = length/c
    y = np.zeros_like(time)
    falls = time < 1.0
    y[falls] = 5.0 - gravity*time[falls]**2/2
    flies = (time >= 1 + 2*tau) & (time < 3 + 2*tau)
    s = time[flies] - (1 + 2*tau)
    n = np.arange(1, n_term + 1)[:, None]
    wave = 4*gravity*length**2/(c*n*math.pi)**2*np.cos(c*n*math.pi*s/length)
    y[flies] = 5 - gravity*(s - 1)**2/2 - 2*gravity*length**2/(3*c*c) + wave.sum(axis=0)
    again = time >= 3 + 4*tau
    y[again] = 5 - gravity*(time[again] - (3 + 4*tau) - 1)**2/2
    return y


@dataclasses.dataclass(frozen=True)
class Bounce:
    """Height of the lower end and contact force of a run over a period, increment by increment."""

    time: np.ndarray
    height: np.ndarray
    force: np.ndarray
    total: np.ndarray            # energy relative to the largest kinetic energy

    @classmethod
    def of(cls, run):
        time, u = run.series("LOWER_END", "U")
        force = np.abs(run.series("CONTACT", "TOTAL_CF")[1][:, 0, 1])
        history = run.history
        return cls(time, 5.0 + u[:, 0, 1], force, history["total"]/history["kinetic"].max())

    def error(self):
        return np.abs(self.height - exact_height(self.time))[self.time < PERIOD]

    def impulse(self):
        """Of the first contact."""
        first = (self.time > 0.5) & (self.time < 2.5)
        return np.sum(self.force[first][1:]*np.diff(self.time[first]))

    def scatter(self):
        """Standard deviation from the closed form in the middle of the contact, by its mean."""
        rests = (self.time > 1.05) & (self.time < 1.6)
        return (self.force[rests] - 300 - 300*(self.time[rests] - 1)).std()/400

    def figures(self):
        error = self.error()
        return (f"{math.sqrt(np.mean(error**2)):.4f}", f"{error.max():.4f}",
                f"{self.impulse():.1f}", f"{100*self.scatter():.0f} %")


FIGURES = ["error of height, rms", "largest", "impulse (266.7)", "scatter of force"]


def started(runs, path, h, initiation="PERSISTENT", **choice):
    deck = with_print(Deck.read(path), "*NODE PRINT, NSET=LOWER_END\nU, V\n")
    deck.replace("TYPE=<initiation>", f"TYPE={initiation}")
    return runs.start(deck, h=h, t_end=PERIOD, frame=1, **choice)


# ---- meshes and increments ----------------------------------------------------------------------


def start_meshes(runs):
    cases = (25, 0.01), (50, 0.005), (100, 0.0025), (200, 0.00125), (50, 0.0025), (50, 0.01)
    return {(n, h): started(runs, runs.generated("bouncing_bar", "--elements", n), h)
            for n, h in cases}


def meshes(futures, _):
    rows = []
    for (n, h), future in futures.items():
        bounce = Bounce.of(future.result())
        rows.append((n, f"{h:g}", f"{30*h/(10/n):g}", *bounce.figures(),
                     size(np.abs(bounce.total).max())))
    return table(["elements", "h", "Courant", *FIGURES, "energy"], rows)


# ---- treatments of first contact ----------------------------------------------------------------


def start_treatments(runs):
    return {(treatment, formulation): started(runs, DECKS / "bouncing_bar.inp", 0.005,
                                              initiation, **choice)
            for treatment, initiation in TREATMENTS.items()
            for formulation, choice in FORMULATIONS.items()}


def treatments(futures, folder):
    done = {key: Bounce.of(future.result()) for key, future in futures.items()}
    rows = []
    for (treatment, formulation), bounce in done.items():
        loses = treatment == "`ADMISSIBLE`"
        rows.append((treatment, formulation, f"{abs(bounce.height[bounce.force > 0].max()):.4f}",
                     *bounce.figures(),
                     f"{100*bounce.total[-1]:+.2f} %" if loses
                     else size(np.abs(bounce.total).max())))
    if folder:
        draw({treatment: done[treatment, "`MORTAR`"] for treatment in TREATMENTS},
             folder / "verification_bar.png")
    return table(["treatment", "formulation", "stand-off", *FIGURES, "energy"], rows)


def draw(bounces, path):
    """Error of the height, and force of the second contact: the motion is its own mirror image
    about the middle of the period, so the force of the first one comes in reverse."""
    left, right = axes(2)
    begin, end = 11/3, 13/3
    right.plot([3.5, begin, begin, end, end, 4.5], [0, 0, 500, 300, 0, 0], color="0.75", lw=7,
               label="closed form")
    width = round(0.1/0.005)
    for (treatment, bounce), colour, broad in zip(bounces.items(), COLOURS, BROAD, strict=False):
        label = treatment.replace("`", "").lower()
        near = (bounce.time > 3.5) & (bounce.time < 4.5)
        mean = np.convolve(bounce.force, np.ones(width)/width, mode="same")
        if treatment == "`PERSISTENT`":
            right.plot(bounce.time[near], bounce.force[near], color=colour, alpha=0.35, lw=0.6,
                       label="persistent, each increment")
        left.plot(bounce.time, bounce.height - exact_height(bounce.time), color=colour,
                  lw=0.6*broad, label=label)
        right.plot(bounce.time[near], mean[near], color=colour, lw=broad, label=label)
    for start in (1, begin):
        left.axvspan(start, start + 2/3, color="0.92", zorder=0)
    left.set(xlabel="time (contact: grey)", ylabel="height of the lower end - closed form")
    right.set(xlabel="time", ylabel="contact force, mean over 0.1")
    legend(left)
    legend(right)
    save(path)


CHAPTERS = [
    Chapter("bar", start_meshes, meshes),
    Chapter("bar_treatments", start_treatments, treatments),
]
