"""Contact forces as increments become small: surfaces with mass and without."""

import math

import numpy as np
import scipy.special
from plain_scenes import Scene, add_grid
from scene_tools import DECKS, Deck, number

from . import bar
from .common import (COLOURS, Chapter, axes, drift, legend, mortar, node, save, size, table,
                     with_print)

KINDS = ("PERSISTENT", "MASSLESS")
CHOICES = {"`NODE TO SURFACE`": node(), "`MORTAR`": mortar("NODAL", "DUAL")}


def switches(force):
    """How often the contact as a whole begins or ends."""
    return int(np.abs(np.diff((force > 0).astype(int))).sum())


# ---- the bar ------------------------------------------------------------------------------------

WAVE = 30.0                                                      # speed; edges are 10/50 long


def start_bar(runs):
    return {(kind, name, courant): bar.started(runs, DECKS / "bouncing_bar.inp",
                                               courant*0.2/WAVE, kind, **choice)
            for kind in KINDS for name, choice in CHOICES.items()
            for courant in (1.5, 0.375, 0.1) if kind == "MASSLESS" or name != "`MORTAR`"}


def bars(futures, folder):
    rows, done = [], {}
    for (kind, name, courant), future in futures.items():
        run = future.result()
        bounce = done[kind, name, courant] = bar.Bounce.of(run)
        first = (bounce.time > 0.9) & (bounce.time < 1.8)
        rows.append((f"`{kind}`", name, f"{courant:g}", f"{100*bounce.scatter():.1f} %",
                     f"{bounce.force[first].max()/400:.2f}", switches(bounce.force),
                     f"{np.sqrt(np.mean(bounce.error()**2)):.3f}",
                     size(run.history["stand_off"].max()), size(np.abs(bounce.total).max())))
    if folder:
        draw({kind: done[kind, "`NODE TO SURFACE`", 0.375] for kind in KINDS}, folder)
    return table(["surfaces", "formulation", "Courant", "scatter of force", "largest/mean",
                  "switches (4)", "error of height, rms", "stand-off", "energy"], rows)


def draw(bounces, folder):
    (picture,) = axes(1)
    for (kind, bounce), colour in zip(bounces.items(), COLOURS[1::-1], strict=False):
        picture.plot(bounce.time, bounce.force, color=colour, lw=1.2 if kind == "MASSLESS" else 0.4,
                     label=kind.lower())
    picture.plot([0.9, 1, 1, 5/3, 5/3, 1.8], [0, 0, 300, 500, 0, 0], color="0.6", lw=3, zorder=0,
                 label="closed form")
    picture.set(xlim=(0.9, 1.8), xlabel="time",
                ylabel="contact force of each increment")
    legend(picture, 3)
    save(folder / "verification_forces.png")


# ---- h to 0 on one mesh -------------------------------------------------------------------------

#: The first contact, at t = 1, is off the grid of each of them.
COARSEST, N_FRAME, N_HALVING = 0.0102, 500, 6


def start_order(runs):
    def start(kind, k):
        deck = Deck.read(DECKS / "bouncing_bar.inp")
        deck.replace("TYPE=<initiation>", f"TYPE={kind}")
        return runs.start(deck, h=COARSEST/2**k, t_end=N_FRAME*COARSEST, frame=COARSEST,
                          **node())

    return {kind: [start(kind, k) for k in range(N_HALVING + 1)] for kind in KINDS}


def orders(futures, _):
    rows = []
    for kind, runs in futures.items():
        u = [run.result().fields()["displacement"] for run in runs]
        far = [np.sqrt(np.mean((a - b)[..., 1]**2, axis=1)).max()
               for a, b in zip(u, u[1:], strict=False)]
        slope = [math.log2(a/b) for a, b in zip(far, far[1:], strict=False)]
        rows.append((f"`{kind}`", *(f"{x:.4f}" for x in far),
                     ", ".join(f"{x:.1f}" for x in slope[-3:])))
    return table(["surfaces", *(f"h/{2**k}" for k in range(1, N_HALVING + 1)), "last orders"], rows)


# ---- the ring -----------------------------------------------------------------------------------


#: In place of the supports of the foundation.
RIGID = """*NODE
99999, 0., -5.
*RIGID BODY, ELSET=BLOCK, REF NODE=99999
*BOUNDARY
99999, 1, 2
99999, 6
"""


def start_ring(runs):
    text = Deck.read(DECKS / "ring.inp").text().replace("*BOUNDARY\nBOTTOM, 1, 2\n", RIGID)

    def start(kind, choice, h):
        deck = Deck(text.replace("TYPE=<initiation>", f"TYPE={kind}"))
        return runs.start(deck, h=h, t_end=1.0, frame=1, **choice)

    return {(kind, name, h): start(kind, choice, h) for kind in KINDS
            for name, choice in CHOICES.items() for h in (0.005, 0.0025, 0.00125)}


def rings(futures, _):
    rows, before = [], {}
    for (kind, name, h), future in futures.items():
        run = future.result()
        time, force = run.series("CONTACT", "TOTAL_CF")
        force = np.abs(force[:, 0, 1])
        # The mean force of each 0.02, for the difference from the run with 2 h.
        per = round(0.02/h)
        mean = force[1:1 + (len(force) - 1)//per*per].reshape(-1, per).mean(axis=1)
        change = ""
        if (kind, name) in before:
            last = before[kind, name]
            change = f"{100*np.sqrt(np.mean((mean - last)**2))/mean[mean > 0].mean():.0f} %"
        before[kind, name] = mean
        rows.append((f"`{kind}`", name, f"{h:g}", switches(force),
                     f"{force.max()/force[force > 0].mean():.1f}", change,
                     f"{run.history['newton'].mean():.1f}", size(run.history["stand_off"].max()),
                     size(drift(run.history["total"]))))
    return table(["surfaces", "formulation", "h", "switches", "largest/mean force",
                  "change of force to 2 h", "iterations", "stand-off", "energy"], rows)


# ---- a disc in a bowl ---------------------------------------------------------------------------

RADIUS, BOWL, GRAVITY, ANGLE = 0.3, 1.0, 10.0, math.radians(30)


def exact_period():
    """Of a disc that slides without friction: a pendulum of the length between the centres."""
    return 4*scipy.special.ellipk(math.sin(ANGLE/2)**2)*math.sqrt((BOWL - RADIUS)/GRAVITY)


def pendulum(h, n_period, at_rest, rim=64):
    """A stiff disc in a bowl is let go: from rest under its weight, or before it has any."""
    way = BOWL - RADIUS
    middle = way*math.sin(ANGLE), -way*math.cos(ANGLE)
    scene = Scene(h, n_period*exact_period(), gravity=GRAVITY)
    scene.disc("DISC", middle, RADIUS, (rim//4, 4), stiffness=1e4)
    span, n = math.radians(75), 60

    def place(i, j):
        angle, r = -math.pi/2 - span + 2*span*i/n, BOWL + 0.2*(1 - j)
        return r*math.cos(angle), r*math.sin(angle)

    scene.add("BOWL", lambda part, first: add_grid(part, (n, 1), place, first))
    scene.hold("BOWL", lambda x, y: True)
    scene.side("INNER", "BOWL", lambda x, y: math.hypot(x, y) < BOWL + 1e-6)
    scene.side("RIM", "DISC", lambda x, y: math.hypot(x - middle[0], y - middle[1]) > RADIUS - 1e-6)
    scene.pairs = [("RIM", "INNER")]
    part = scene.part["DISC"]
    centre = min(part.node, key=lambda k: math.dist(part.node[k], middle))
    text = scene.deck("ONE").text()
    first = text.index("*STEP")
    if not at_rest:
        return Deck(text)
    rests = text[first:].replace("*DYNAMIC, DIRECT\n<h>, <t_end>", "*STATIC\n1., 1.").replace(
        "*DLOAD", f"*BOUNDARY\n{centre}, 1\n*DLOAD", 1)
    goes = text[first:].replace("*DLOAD", "*BOUNDARY, OP=NEW\n" + "\n".join(
        f"{k}, 1, 2" for k in scene.part["BOWL"].node) + "\n*DLOAD", 1)
    return Deck(text[:first] + rests + goes)


def start_bowl(runs):
    cases = [(True, "`NODE TO SURFACE`", h) for h in (0.02, 0.01, 0.005)]
    cases += [(True, "`MORTAR`", 0.01), (False, "`NODE TO SURFACE`", 0.01)]
    return {(kind, at_rest, name, h): runs.start(
                pendulum(h, 2.2, at_rest), initiation=kind, smoothing="HERMITE", **CHOICES[name])
            for kind in KINDS for at_rest, name, h in cases}


def period(time, px):
    """From the first to the last time that the disc comes to rest."""
    turns = np.flatnonzero(px[:-1]*px[1:] < 0)
    place = time[turns] + (time[turns + 1] - time[turns])*px[turns]/(px[turns] - px[turns + 1])
    return (place[-1] - place[0])*2/(len(place) - 1)


def bowls(futures, _):
    rows = []
    for (kind, at_rest, name, h), future in futures.items():
        history = future.result().history
        moves = history["time"] > (1 if at_rest else h/2)
        total = history["total"][moves]
        longer = period(history["time"][moves], history["px"][moves])/exact_period() - 1
        rows.append((f"`{kind}`", name, f"{h:g}", "rest" if at_rest else "no weight",
                     f"{100*(history['active'][moves] > 0).mean():.1f} %", f"{100*longer:+.2f} %",
                     size(np.abs(total - total[0]).max()/history["kinetic"].max())))
    return table(["surfaces", "formulation", "h", "start", "in contact", "period", "energy"], rows)


# ---- a disc in a ring, for long -----------------------------------------------------------------

PERIODS = 50


#: A rigid ring of arcs, held.
CIRCLE = "*NODE\n90000, 0., 0.\n*SURFACE, NAME=RING, TYPE=SEGMENTS\nSTART, -1., 0.\n" + "".join(
    f"CIRCL, {x}, {y}, 0., 0.\n" for x, y in ((0, -1), (1, 0), (0, 1), (-1, 0))) + (
    "*RIGID BODY, ANALYTICAL SURFACE=RING, REF NODE=90000\n*BOUNDARY\n90000, 1, 2\n90000, 6\n")


def in_ring(h):
    """A rigid disc, a circle, is let go in a rigid ring of arcs."""
    way = BOWL - RADIUS - 1e-8
    middle = way*math.sin(ANGLE), -way*math.cos(ANGLE)
    scene = Scene(h, math.ceil(PERIODS*exact_period()/h + 1)*h, gravity=GRAVITY)
    scene.disc("DISC", middle, RADIUS, (4, 2))
    scene.pairs = [("CENTRE", "RING")]
    cards = (f"*NODE\n90001, {middle[0]!r}, {middle[1]!r}\n"
             "*RIGID BODY, ELSET=DISC, REF NODE=90001\n*SURFACE, NAME=CENTRE, TYPE=NODE\n90001\n"
             f"{CIRCLE}")
    text = scene.deck("ONE").text().replace(
        "*SURFACE INTERACTION, NAME=SMOOTH",
        f"{cards}*SURFACE INTERACTION, NAME=SMOOTH, PAD THICKNESS={RADIUS}")
    for request in ("*NODE FILE", "*CONTACT FILE", "*CONTACT PRINT"):
        text = text.replace(request, f"{request}, FREQUENCY=1000000")
    return Deck(text)


def start_circle(runs):
    return {h: runs.start(in_ring(h), initiation="PERSISTENT", formulation="NODE TO SURFACE",
                          smoothing="HERMITE") for h in (0.02, 0.01, 0.005)}


def circles(futures, _):
    rows = []
    for h, future in futures.items():
        history = future.result().history
        acts = history["active"][1:] > 0
        longer = period(history["time"], history["px"])/exact_period() - 1
        rows.append((f"{h:g}", str(len(acts)), f"{100*acts.mean():.0f} %", f"{100*longer:+.4f} %",
                     f"{history['newton'][1:].mean():.1f}",
                     size(np.abs(history["total"]).max()/history["kinetic"].max())))
    return table(["h", "increments", "in contact", "mean period", "iterations", "energy"], rows)


def elastic_in_ring(stiffness, h, n_period=PERIODS, rim=64):
    """An elastic disc is let go in a rigid ring of arcs. It rests there first, under the part of
    its weight that presses it on the ring: what is added afterwards accelerates all of it alike."""
    down = math.sin(ANGLE), -math.cos(ANGLE)
    middle = [(BOWL - RADIUS)*x for x in down]
    scene = Scene(h, n_period*exact_period(), gravity=GRAVITY)
    scene.disc("DISC", middle, RADIUS, (rim//4, 4), stiffness=stiffness)
    scene.side("RIM", "DISC", lambda x, y: math.dist((x, y), middle) > RADIUS - 1e-6)
    scene.pairs = [("RIM", "RING")]
    part = scene.part["DISC"]
    centre = min(part.node, key=lambda k: math.dist(part.node[k], middle))
    text = scene.deck("ONE").text().replace(
        "*SURFACE INTERACTION", f"{CIRCLE}*SURFACE INTERACTION", 1)
    for request in ("*NODE FILE", "*CONTACT FILE", "*CONTACT PRINT"):
        text = text.replace(request, f"{request}, FREQUENCY=1000000")
    first = text.index("*STEP")
    rests = text[first:].replace("*DYNAMIC, DIRECT\n<h>, <t_end>", "*STATIC\n1., 1.").replace(
        "*DLOAD", f"*BOUNDARY\n{centre}, 1\n*DLOAD", 1).replace(
        f"GRAV, {number(GRAVITY)}, 0., -1.",
        f"GRAV, {GRAVITY*math.cos(ANGLE)!r}, {down[0]!r}, {down[1]!r}")
    goes = text[first:].replace("*DLOAD", "*BOUNDARY, OP=NEW\n90000, 1, 2\n90000, 6\n*DLOAD", 1)
    return Deck(text[:first] + rests + goes)


def start_disc(runs):
    return {stiffness: runs.start(elastic_in_ring(stiffness, 0.01), initiation="MASSLESS",
                                  formulation="NODE TO SURFACE", smoothing="HERMITE")
            for stiffness in (10000.0, 2000.0)}


def discs(futures, _):
    rows = []
    for stiffness, future in futures.items():
        history = future.result().history
        history = history[history["time"] > 1]
        weight = math.pi*RADIUS**2*GRAVITY
        force = np.hypot(history["pair1_force_x"], history["pair1_force_y"])
        longer = period(history["time"], history["px"])/exact_period() - 1
        total = history["total"]
        rows.append((f"{stiffness:g}", str(len(history)),
                     f"{100*(history['active'] > 0).mean():.2f} %", f"{force.min()/weight:.2f}",
                     f"{force.max()/weight:.2f}", f"{100*longer:+.3f} %",
                     size(np.abs(total - total[0]).max()/history["kinetic"].max())))
    return table(["stiffness", "increments", "in contact", "smallest force/weight", "largest",
                  "mean period", "energy"], rows)


CHAPTERS = [
    Chapter("forces_bar", start_bar, bars),
    Chapter("forces_order", start_order, orders),
    Chapter("forces_ring", start_ring, rings),
    Chapter("forces_bowl", start_bowl, bowls),
    Chapter("forces_circle", start_circle, circles),
    Chapter("forces_disc", start_disc, discs),
]
