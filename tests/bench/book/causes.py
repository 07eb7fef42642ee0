"""Why runs of contact gain or lose energy: each cause on a deck that runs, with what its ledger says."""

import dataclasses
import re

import numpy as np
from limits.bodies import falling
from limits.impacts import bouncing
from plain_scenes import AUTO, ONE, SCENES
from scene_tools import DECKS, Deck, attempt

from .common import Chapter, size, table

PAGE = "energy.md"
#: Below this, by the largest energy, a change is round-off.
ROUNDING = 1e-10
#: And the page calls it so below this.
SMALL = 1e-13


@dataclasses.dataclass(frozen=True)
class Cause:
    """`deck()` and its parameters; `holds(change, run)` is what the page says of it;
    `also(run)` is a word on what the ledger has no column for.

    `change` has what columns of the history are off by in the end, by the largest energy.
    """

    what: str
    deck_name: str
    deck: object
    holds: object
    parameters: dict = dataclasses.field(default_factory=dict)
    also: object = None


COLUMNS = ("total", "contact_work", "external_work", "losses")
#: What else the ledger has taken from the total: the column `losses` here.
LOSSES = ("friction_loss", "damping_loss", "scheme_loss")


def changes(run):
    """Of each column since the start, where it is most, by the largest energy, with its sign."""
    history = run.history
    scale = (history["kinetic"] + history["strain"]).max()
    found = {}
    for name in COLUMNS:
        column = sum(history[loss] for loss in LOSSES) if name == "losses" else history[name]
        way = column - column[0]
        found[name] = way[np.abs(way).argmax()]/scale
    return found


def read(name):
    return lambda: Deck.read(DECKS / f"{name}.inp")


def ring_by(scheme):
    def deck():
        made = Deck.read(DECKS / "spinning_ring.inp")
        made.insert(f"*TIME INTEGRATION, SCHEME={scheme}", before="*NEWTON")
        return made
    return deck


def rebound(run):
    """The velocity of the bar's centre in the end, by that with which it came."""
    return -run.history["py"][-1]/run.history["py"][0]


def rebound_text(run):
    return f", rebounds at {rebound(run):.3f} of its speed"


def crossing_by(formulation):
    return lambda: SCENES["crossing"]().deck(ONE), {"method": "PENALTY", "formulation": formulation}


def none(change, names):
    return all(abs(change[name]) < ROUNDING for name in names)


SHORT_BAR = {"t_end": 3.0, "frame": 3.0}
CROSSING, CROSSING_MORTAR = crossing_by("MORTAR")
CAUSES = [
    Cause("`INITIATION=ADMISSIBLE`: nodes that arrive are stopped", "`bouncing_bar.inp`",
          read("bouncing_bar"), lambda c, _: c["contact_work"] < -1e-3
          and abs(c["total"] - c["contact_work"]) < ROUNDING,
          {**SHORT_BAR, "h": 0.1/30, "initiation": "ADMISSIBLE"}),
    Cause("gravity: no error", "`bouncing_bar.inp`", read("bouncing_bar"),
          lambda c, _: c["external_work"] > 0.5 and none(c, ("total", "contact_work")), SHORT_BAR),
    Cause("a driven plate: no error", "a block between two plates", lambda: SCENES["press"]().deck(AUTO),
          lambda c, _: c["external_work"] > 0.5 and none(c, ("total", "contact_work")),
          {"formulation": "NODE TO SURFACE"}),
    Cause("friction and damping: no error", "`sliding_block.inp`", read("sliding_block"),
          lambda c, _: c["losses"] > 0.1
          and abs(c["total"] + c["losses"] - c["contact_work"]) < ROUNDING),
    Cause("`RESTITUTION=0.5`: no error", "a disc that bounces", lambda: bouncing(0.5),
          lambda c, run: c["contact_work"] < -0.1 and abs(c["total"] - c["contact_work"]) < ROUNDING
          and run.history["restitution_loss"][-1] > 0.1, {"formulation": "NODE TO SURFACE"}),
    Cause("no error: the bar vibrates after the impact", "`bar_on_wall.inp`", read("bar_on_wall"),
          lambda c, run: none(c, ("total", "contact_work")) and rebound(run) < 0.99,
          {"initiation": "PERSISTENT"}, rebound_text),
    Cause("the same with `MASSLESS`: it vibrates less", "`bar_on_wall.inp`", read("bar_on_wall"),
          lambda c, run: none(c, ("total", "contact_work")) and rebound(run) > 0.99,
          {"initiation": "MASSLESS"}, rebound_text),
    Cause("round-off of strains larger than inertia: $\\rho L^2/(Eh^2)=10^{-20}$",
          "one element in free fall", lambda: falling((1e-20, 0.0)),
          lambda c, run: abs(c["total"]) > ROUNDING and run.verdict["verdict"] == "bad"),
    Cause("bodies that overlap at the start and are pushed apart: `SHRINK`", "`press_fit.inp`",
          read("press_fit"), lambda c, _: c["contact_work"] > 0.1),
    Cause("`SCHEME=TRAPEZOIDAL` without contact", "`spinning_ring.inp`", ring_by("TRAPEZOIDAL"),
          lambda c, _: abs(c["total"]) > 1e-3 and c["contact_work"] == 0, {"h": 0.2}),
    Cause("`SCHEME=MIDPOINT` without contact", "`spinning_ring.inp`", ring_by("MIDPOINT"),
          lambda c, _: abs(c["total"]) > 1e-4 and c["contact_work"] == 0, {"h": 0.2}),
    Cause("the same by `ENERGY MOMENTUM`", "`spinning_ring.inp`", ring_by("ENERGY MOMENTUM"),
          lambda c, _: none(c, COLUMNS), {"h": 0.2}),
    Cause("no error: `PENALTY` of `MORTAR`, an edge that has entered a surface passes its end",
          "squares whose corners cross", CROSSING,
          lambda c, _: none(c, ("total", "contact_work")), CROSSING_MORTAR),
    Cause("`PENALTY` of `NODE TO SURFACE` there", "squares whose corners cross", CROSSING,
          lambda c, _: none(c, ("total", "contact_work")), crossing_by("NODE TO SURFACE")[1]),
    Cause("`PENALTY` with `SCHEME=TRAPEZOIDAL`", "`bouncing_bar.inp`", read("bouncing_bar"),
          lambda c, run: abs(c["contact_work"]) > 1e-6,
          {**SHORT_BAR, "scheme": "TRAPEZOIDAL", "method": "PENALTY"}),
]


def told(run):
    """The first reason of the verdict, without its figures' places."""
    reasons = run.verdict["reasons"]
    return re.sub(r"(at time|, which|: nodes|\(it ).*", "", reasons[0]).strip(" ,") if reasons else \
        run.verdict["verdict"]


def cells(cause, run):
    """A row of the table."""
    change = changes(run)
    return (cause.what, cause.deck_name, *(
        "0" if change[name] == 0 else "round-off" if abs(change[name]) < SMALL else
        size(change[name]) if abs(change[name]) < 1e-3 else f"{change[name]:.3f}"
        for name in COLUMNS),
        told(run) + (cause.also(run) if cause.also else ""))


def run_cause(cause, folder):
    return attempt(cause.deck(), folder, (), cause.parameters)[1]


def start(runs):
    def run(cause, folder):
        return run_cause(cause, folder)

    return [(cause, runs.start(cause, run)) for cause in CAUSES]


HEAD = ("cause", "deck", "`total`", "`contact_work`", "`external_work`", "losses", "verdict")


def report(started, _):
    return table(HEAD, [cells(cause, future.result()) for cause, future in started])


CHAPTERS = [Chapter("causes", start, report, PAGE)]
