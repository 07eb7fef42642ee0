"""Coulomb friction: blocks that slide to rest, scenes of closed form, flutter, bodies that friction
holds, the ring on a free block."""

import math
import os
import re
import subprocess

import numpy as np
from flutter import RISE, fastest, fluttering, rate_of
from friction_curves import BUSHES, bead, bead_error, bush, bush_torques
from friction_scenes import (
    NODES,
    arch,
    arch_needs,
    balance,
    belt_way,
    block_on_floor,
    on_spring,
    partial_slip,
    polygon,
    pressed_round,
    pressed_sideways,
    ring,
    rolling,
    stack_on_slope,
    way,
)
from friction_space_scenes import Ball, belt
from plain_scenes import BOTH, ONE
from plate_alone import displacements
from scene_tools import PROGRAM, Deck, Run
from test_friction_space import (
    CARDS_NEED,
    CORE,
    GRAVITY,
    ball_on_floor,
    billiard_balls,
    cards,
    inertia,
    on_floor,
    sliding_puck,
    slows_down,
    turns_away,
)
from test_friction_space import arch as space_arch

from .common import Chapter, drift, size, table


def law(run):
    return size(run.verdict["law_violation"])


# ---- sliding to rest ----------------------------------------------------------------------------

BLOCKS = {
    "elastic, `BETA=2e-3`": {"eta": 2e-3},
    "elastic, `BETA=2e-3`, 8 x 4": {"eta": 2e-3, "cells": (8, 4)},
    "elastic, undamped": {},
    "elastic, `BETA=2e-3`, `SEGMENT`": {"eta": 2e-3, "formulation": "SEGMENT"},
    "elastic, `BETA=2e-3`, `MORTAR`": {"eta": 2e-3, "formulation": "MORTAR"},
}


def start_rest(runs):
    started = {}
    for name, more in BLOCKS.items():
        body = {key: value for key, value in more.items() if key != "formulation"}
        for h in (0.02, 0.01, 0.005, 0.0025):
            started[name, h] = runs.start(
                block_on_floor(h, 0.72, 0.3, v0=2.0, **body),
                formulation=more.get("formulation", NODES["formulation"]))
    return started


def report_rest(started, _):
    rows = []
    for (name, h), future in started.items():
        run = future.result()
        history = run.history
        cells = BLOCKS[name].get("cells", (4, 2))
        distance = way(run, (cells[0] + 1)*(cells[1] + 1))[-1]
        rows.append((name, f"{h:g}", f"{distance:.5f}", size(balance(history)),
                     f"{history['newton'][1:].mean():.1f}", int(history["newton"].max()),
                     int(history["cuts"].sum()), law(run)))
    return table(["block", "h", "distance", "balance", "Newton", "at most", "cuts", "law"], rows)


# ---- known -------------------------------------------------------------------------------------


#: Elements of the plate along its side.
PLATES = (32, 64)
#: Where they are watched.
PLACES = (0, 0.00125, 0.005, 0.0075, 0.01125)
#: So far sideways that 0.92 of the force slides.
BACK = 0.546


def on_belt(h):
    return lambda _, folder: on_spring(h, 1.4, 0.3, folder, stiffness=25.0, belt=0.3)


def pulled(_, folder):
    return on_spring(0.01, 3.4, 0.3, folder, pull=200/7, stiffness=24/7)


def start_known(runs):
    slope = -math.atan(0.5)
    return {
        "rest": runs.start(block_on_floor(0.01, 0.72, 0.3, v0=2.0, rigid=True), **NODES),
        **{push: runs.start(block_on_floor(0.01, 0.5, 0.5, push=push, rigid=True), **NODES)
           for push in (4.99, 5.01)},
        **{("slope", mu): runs.start(block_on_floor(0.01, 0.5, mu, slope=slope, rigid=True),
                                     **NODES) for mu in (0.49, 0.5)},
        **{("rolls", inner): runs.start(rolling(inner, 2.5e-4, 4e-3, 0.3, 0.02), **NODES)
           for inner in (0.95, 0.05)},
        **{("plate", n): runs.start(pressed_sideways(n)[0], **NODES) for n in PLATES},
        "plate alone": runs.pool.submit(displacements, 32, True, PLACES),
        "to and fro": runs.start(pressed_round(96, back=BACK)[0], **NODES),
        **{("belt", h): runs.start(None, on_belt(h)) for h in (0.02, 0.01, 0.005)},
        "pulled": runs.start(None, pulled),
    }


def plate(run, n):
    """Displacements of the plate at the floor."""
    place = pressed_sideways(n)[1]
    u = run.fields()["displacement"][-1, :len(place), 0]
    return [u[(abs(place[:, 0] - x) < 1e-9) & (place[:, 1] < 1e-9)].item()*1e6
            for x in PLACES]


def report_known(started, _):
    done = {name: future.result() for name, future in started.items()}
    rows = [("rigid block that slides to rest, h = 0.01", "2/3",
             f"{way(done['rest'], 15)[-1]:.6f}")]
    for push in (4.99, 5.01):
        rows.append((f"rigid block, mu = 0.5, pushed by {push/10:g} of its weight: acceleration",
                     f"{max(0.0, push - 5):g}", f"{done[push].history['px'][-1]:.9f}"))
    for mu in (0.49, 0.5):
        moved = way(done["slope", mu], 15, -math.atan(0.5))[-1]
        rows.append((f"the same on a slope of 1 in 2, mu = {mu:g}: acceleration",
                     f"{10*math.cos(math.atan(0.5))*(0.5 - mu):.9f}", f"{8*moved + 0.0:.9f}"))
    for inner, name in ((0.95, "ring"), (0.05, "disc")):
        (outside, turning), (hole, lost) = polygon(1.0), polygon(inner)
        mass = outside - hole
        rows.append((f"{name} of 40 sides that slides, then rolls: velocity left",
                     f"{1/(1 + (turning - lost)/mass):.5f}",
                     f"{done['rolls', inner].history['px'][-1]/mass/0.02:.5f}"))
    error = []
    for h in (0.02, 0.01, 0.005):
        time, x, _ = done["belt", h]
        error.append(np.abs(x - belt_way(time, 0.3, 25.0, 0.3)).max()/0.12)
    rows.append(("stick-slip on a belt, h = 0.02, 0.01, 0.005: largest error over the stretch of the spring at the "
                 "limit of friction", "order 2", ", ".join(f"{e:.1e}" for e in error)))
    time, x, _ = done["pulled"]
    rows.append(("SDNV104, block pulled against a spring: positions at t = 1.7 and 3.4", "14.917, 3.5",
                 f"{np.interp(1.7, time, x):.3f}, {np.interp(3.4, time, x):.3f}"))
    rows += [(f"SSNV128, plate pressed sideways, {n} x {n}: displacements at the floor, 1e-6",
              "28.6, 27.2, 22.8, 19.8, 15.0",
              ", ".join(f"{u:.2f}" for u in plate(done["plate", n], n))) for n in PLATES]
    rows.append(("the same by the independent numpy program, linear, elements of eight nodes, 32 x 32",
                 "28.6, 27.2, 22.8, 19.8, 15.0", ", ".join(f"{u:.2f}" for u in done["plate alone"])))
    force, width, strip = partial_slip(done["to and fro"], pressed_round(96, back=BACK)[1]).T
    turn = np.argmax(force)
    for k in (*range(3, turn, 4), turn, *range(turn + 2, len(force), 3)):
        goes_back = k > turn
        share = (force[turn] - force[k])/2 if goes_back else force[k]
        rows.append((f"two equal bodies, one round, Q = {force[k]:.3f} mu P{', back' if goes_back else ''}: "
                     f"width that sticks over width in contact, nodes {strip[k]:.2f} apart",
                     f"{math.sqrt(1 - share):.3f}", f"{width[k]:.3f}"))
    return table(["scene", "known", "here"], rows)


# ---- curves -------------------------------------------------------------------------------------

#: Increments and edges of the track.
TRACKS = ((0.04, 16), (0.02, 32), (0.01, 64))
PADS = (0.05, 0.3)
#: Smoothing, formulation, overclosure.
HUBS = (("HERMITE", "NODE TO SURFACE", 0.02), ("NONE", "NODE TO SURFACE", 0.02),
        ("NONE", "SEGMENT", 0.02), ("NONE", "MORTAR", 0.005))


def start_curves(runs):
    return {**{("bead", pad, *track): runs.start(bead(*track, pad), **NODES)
               for pad in PADS for track in TRACKS},
            **{("hub", *hub, cells): runs.start(bush(cells, hub[0], fit=hub[2]), formulation=hub[1])
               for hub in HUBS for cells in BUSHES[0 if hub[0] == "HERMITE" else 1:]}}


def report_curves(started, _):
    rows = []
    for pad in PADS:
        runs = [started["bead", pad, *track].result() for track in TRACKS]
        rows.append((f"bead on a track of {', '.join(str(n) for _, n in TRACKS)} edges, pad of {pad:g}, "
                     f"h = {', '.join(f'{h:g}' for h, _ in TRACKS)}: velocity", "`HERMITE`",
                     "`NODE TO SURFACE`", ", ".join(size(bead_error(run, pad)) for run in runs),
                     max(int(run.history["newton"].max()) for run in runs), law(runs[-1])))
    for hub in HUBS:
        cells = BUSHES[0 if hub[0] == "HERMITE" else 1:]
        runs = [started["hub", *hub, one].result() for one in cells]
        rows.append((f"hub of {', '.join(str(n) for _, n in cells)} edges in a sleeve: torque",
                     f"`{hub[0]}`", f"`{hub[1]}`",
                     ", ".join(size(np.abs(bush_torques(run, edges)[0] - 1).max())
                               for run, (_, edges) in zip(runs, cells, strict=True)),
                     max(int(run.history["newton"].max()) for run in runs), law(runs[-1])))
    runs = [(started["hub", *HUBS[1], one].result(), one[1]) for one in BUSHES[1:]]
    both = [bush_torques(run, edges) for run, edges in runs]
    rows.append(("the same, from the moments of its nodes", f"`{HUBS[1][0]}`", f"`{HUBS[1][1]}`",
                 ", ".join(size(np.abs(torque - moments).max()) for torque, moments in both), "", ""))
    return table(["scene", "smoothing", "type", "largest error", "Newton, at most", "law"], rows)


# ---- flutter -----------------------------------------------------------------------------------

#: Cells and damping of a block that slides, the periods of its shear that are looked at.
SLIDING = (((4, 2), 0.0, 4), ((4, 2), 2e-3, 8), ((8, 4), 2e-3, 8))
STEP = 5e-4


def start_flutter(runs):
    return {(cells, eta): (runs.start(fluttering(STEP, RISE + (n + 1)*2*math.pi/200, eta, cells),
                                      **NODES)) for cells, eta, n in SLIDING}


def report_flutter(started, _):
    rows = []
    for (cells, eta), future in started.items():
        rate, row = fastest(0.3, cells=cells, eta=eta)
        run = future.result()
        seen = rate_of(run, row, STEP)
        rows.append((f"{cells[0]} x {cells[1]}", f"{eta:g}", f"{rate.real:.2f}", f"{seen.real:.2f}",
                     f"{rate.imag:.1f}", f"{seen.imag:.1f}", law(run)))
    return table(["mesh", "`BETA`", "growth, eigenvalue [1/s]", "in the run", "frequency, eigenvalue",
                  "in the run", "law"], rows)


# ---- bodies that friction holds ----------------------------------------------------------------

#: Sides, formulation.
HELD = ((ONE, "MORTAR"), (ONE, "SEGMENT"), (BOTH, "NODE TO SURFACE"))


def start_held(runs):
    started = {}
    for sides, formulation in HELD:
        for part in (0.8, 1.2, 2.5):
            started["arch", part*arch_needs(), sides, formulation] = runs.start(
                arch(part*arch_needs(), sides), formulation=formulation)
        for mu in (0.15, 0.25):
            started["stack", mu, sides, formulation] = runs.start(
                stack_on_slope(mu, -math.atan(0.2), sides=sides), formulation=formulation)
    return started


def report_held(started, _):
    rows = []
    for (scene, mu, sides, formulation), future in started.items():
        run = future.result()
        history = run.history
        if scene == "arch":
            u = np.abs(run.fields()["displacement"]).max(axis=(1, 2))
            needs, stands = arch_needs(), mu > arch_needs()
        else:
            u = way(run, 66, -math.atan(0.2))
            needs, stands = 0.2, mu > 0.2
        rows.append((scene, f"`{formulation}`", f"`{sides}`", f"{mu:.3f}", f"{needs:.4f}",
                     "stands" if stands else "slides", f"{u[len(u)//2]:.4f}", f"{u[-1]:.4f}",
                     size(balance(history)), f"{history['newton'][1:].mean():.1f}",
                     int(history["cuts"].sum()), law(run), run.verdict["verdict"]))
    return table(["scene", "type", "sides", "mu", "mu needed", "known", "moved at 0.2", "at 0.4",
                  "balance", "Newton", "cuts", "law", "verdict"], rows)


# ---- small problems ----------------------------------------------------------------------------


def start_random(runs):
    return runs.pool.submit(subprocess.run, [PROGRAM.with_name("kernels"), "contact_problem"],
                            capture_output=True, text=True, check=True,
                            env={**os.environ, "EMCON_TEST_CASES": "10000"})


def report_random(started, _):
    rows = re.findall(r"^   (\d) slips, ([a-z ]+?)(, targets)?: (\d+) of (\d+) not solved, (\d+) not by"
                      r" trials alone, (\S+) trials each, law missed by (\S+)",
                      started.result().stdout, re.MULTILINE)
    return table(["slips", "W", "targets", "problems", "not solved", "not by trials alone",
                  "trials", "law"],
                 [(slips, kind, "yes" if leads else "no", n, missed, turned, trials,
                   size(float(law))) for slips, kind, leads, missed, n, turned, trials, law in rows])


# ---- ring ---------------------------------------------------------------------------------------


#: Formulation, method, sides.
RINGS = (("NODE TO SURFACE", "NULL SPACE", "ONE"), ("NODE TO SURFACE", "SADDLE POINT", "ONE"),
         ("NODE TO SURFACE", "NULL SPACE", "BOTH"), ("SEGMENT", "NULL SPACE", "ONE"),
         ("MORTAR", "NULL SPACE", "ONE"), ("MORTAR", "SADDLE POINT", "ONE"))


def start_ring(runs):
    return {(mu, *kind): runs.start(ring(mu), h=0.01, t_end=1.0, formulation=kind[0], method=kind[1],
                                    sides=kind[2])
            for mu in (0.2, 0.8) for kind in RINGS}


def report_ring(started, _):
    rows = []
    for (mu, *kind), future in started.items():
        run = future.result()
        history = run.history
        least = np.diff(history["friction_loss"]).min()
        rows.append((f"{mu:g}", *(f"`{word}`" for word in kind),
                     f"{history['friction_loss'][-1]:.12f}", size(max(0.0, -least)),
                     size(balance(history)), *(size(drift(history[name]))
                                               for name in ("px", "py", "lz")),
                     f"{history['newton'][1:].mean():.1f}", int(history["cuts"].sum()), law(run)))
    return table(["mu", "type", "method", "sides", "dissipated by friction", "gained from it", "balance", "px",
                  "py", "lz", "Newton", "cuts", "law"], rows)


# ---- in space -----------------------------------------------------------------------------------

BELTS = [(12, .02), (24, .02), (48, .02), (12, .002), (24, .002)]
BALLS = (2, 3, 4)


def start_space(runs):
    started = {}
    for cells, thickness in BELTS:
        block, text = belt(cells, .3, thickness)
        started["belt", cells, thickness] = block, runs.start(Deck(text, "belt"), patient)
    for cells in BALLS:
        ball = Ball(cells)
        block = ball.block()
        started["ball", cells, ball] = block, runs.start(Deck(ball.deck(block, .15, 6), "ball"), patient)
    return started


def patient(deck, folder):
    """A run that may take its time."""
    folder.mkdir(parents=True, exist_ok=True)
    subprocess.run([PROGRAM, deck.write(folder/"deck.inp"), "--quiet", "--output", folder], check=True)
    return Run(folder/"deck")


def report_space(started, _):
    rows = []
    for (scene, cells, more), (block, future) in started.items():
        run = future.result()
        fields = run.fields()
        if scene == "belt":
            value = -fields["reaction_force"][-1, np.array(block.on(0, 0)) - 1, 2].sum()
            known, own = math.exp(.3*math.pi), math.exp(.3*math.pi/(1 + more/2))
            name = f"belt, t = {more:g}: ratio of pulls"
        else:
            low = np.array(block.on(2, 0)) - 1
            force = fields["contact_force"][-1, low]
            place = block.x[low] + fields["displacement"][-1, low]
            value = (place[:, 0]*force[:, 1] - place[:, 1]*force[:, 0]).sum()
            known = more.torque(force[:, 2].sum())
            own = more.mu*(force[:, 2]*np.hypot(place[:, 0], place[:, 1])).sum()
            name = "ball: torque"
        rows.append((name, cells, f"{value:.6f}", f"{known:.6f}", f"{100*(value/known - 1):+.2f} %",
                     f"{100*(value/own - 1):+.3f} %", f"{run.history['newton'].sum():.0f}",
                     f"{run.history['cuts'].sum():.0f}", law(run)))
    return table(["scene", "cells over pi, a", "found", "known", "difference", "difference with thickness, with forces", "Newton",
                  "cuts", "law"], rows)


#: The last one is the reference of the others.
PUCKS = (.01, .005, .00125)


def start_space_known(runs):
    texts = {}
    for mu in (.49, .5):
        texts["slope", mu] = on_floor(mu, .01, .2, (0, 0, 0), slope=math.atan(.5))
    for h in (.02, .01):
        texts["turning", h] = on_floor(.3, h, .3, (0, 1., 0), slope=.2)
    for h in PUCKS:
        texts["puck", h] = sliding_puck(h, 1.0)
    texts["puck ends", .01] = sliding_puck(.01, 1.7)
    texts["rolling", .3] = ball_on_floor(.3, .01, 16, v=1.)
    for mu in (.1, .3):
        texts["down", mu] = ball_on_floor(mu, .005, 12, slope=math.radians(30))
    for mu in (.06, .5):
        texts["throw", mu] = billiard_balls(mu, .001)[1]
    for mu in (.2, .97*CARDS_NEED, 1.03*CARDS_NEED, .5):
        texts["cards", mu] = cards(mu)
    for part in (.97, 1.03):
        texts["arch", part] = space_arch(part*arch_needs())
    for mu in (.3, .8):
        texts["slab", mu] = on_floor(mu, .01, .5, (1., .2, 0), (0, 0, 1.), is_rigid=False)
    return {key: runs.start(Deck(text, key[0])) for key, text in texts.items()}


def report_space_known(started, _):
    run = {key: future.result() for key, future in started.items()}
    pull, until = GRAVITY*math.sin(math.radians(30)), .2
    rows = []

    def add(scene, known, here, *of):
        rows.append((scene, known, here, f"{sum(int(r.history['cuts'].sum()) for r in of)}",
                     size(max(r.verdict["law_violation"] for r in of))))

    for mu in (.49, .5):
        r, angle = run["slope", mu], math.atan(.5)
        add(f"rigid slab on a slope of 1 in 2, mu = {mu}: acceleration",
            f"{max(0., math.sin(angle) - mu*math.cos(angle))*GRAVITY:.9f}", f"{abs(r.history['px'][-1])/.5/.2:.9f}", r)
    wanted = turns_away(.2, .3, .3)
    of = [run["turning", h] for h in (.02, .01)]
    error = [max(abs(r.history[name][-1]/.5 - w) for name, w in zip(("px", "py"), wanted)) for r in of]
    add("the same thrown across a slope, h = 0.02, 0.01: difference of the velocity from that of a particle", "order 2",
        ", ".join(f"{e:.1e}" for e in error), *of)
    of = [run["puck", h] for h in PUCKS]
    first = of[0].history
    last = [np.array([r.history[name][-1] for name in ("px", "py", "lz")])/first["px"][0] for r in of]
    add("puck of eight nodes that slides and spins, h = 0.01, 0.005: difference of the momenta from those with h = 0.00125", "order 2",
        ", ".join(f"{np.abs(p - last[2]).max():.1e}" for p in last[:2]), *of)
    wanted = slows_down(1.0, first["lz"][0]/first["px"][0]/2)
    add("the same, h = 0.00125: difference of the momenta from the equations of a flat puck; the centre of mass is 5e-4 of its radius above the floor",
        "below 1e-4", f"{np.abs(last[2] - wanted).max():.1e}", of[2])
    r = run["puck ends", .01]
    ends = [r.history["time"][np.argmax(np.abs(r.history[name]) < 1e-6*r.history[name][0])] for name in ("px", "lz")]
    add("the same: instants at which its motion and its spin end", "equal", ", ".join(f"{t:.2f}" for t in ends), r)
    r = run["rolling", .3]
    add("ball thrown along a floor of elements of 0.02: velocity as it rolls", "0.714286",
        f"{r.history['px'][-1]/CORE**3:.6f}", r)
    for mu in (.1, .3):
        r = run["down", mu]
        known = 5/7*pull if mu > .165 else pull - mu*GRAVITY*math.cos(math.radians(30))
        add(f"ball on a slope of 30 degrees, mu = {mu}: acceleration", f"{known:.4f}",
            f"{r.history['px'][-1]/CORE**3/until:.4f}", r)
    for mu in (.06, .5):
        r, hit = run["throw", mu], billiard_balls(mu, .001)[0]
        (m, turns), (n, spins) = inertia(hit), (CORE**3, .4*CORE**3)
        stopped = math.tan(math.radians(30))*(1/m + 1/n)/2/(1/m + 1/turns + 1/n + 1/spins)
        way = np.diff(r.fields()["displacement"][-2:, :len(hit.x)].mean(1), axis=0)[0]
        add(f"ball hit at a cut of 30 degrees, mu = {mu}: throw in degrees, to 0.014",
            f"{math.degrees(math.atan(min(mu, stopped))):.3f}", f"{math.degrees(math.atan2(way[1], way[0])):.3f}", r)
    for name, needs in (("cards", CARDS_NEED), ("arch", arch_needs())):
        for (scene, value), r in run.items():
            if scene == name:
                mu = value if name == "cards" else value*needs
                what = "two cards leaning by 30 degrees" if name == "cards" else "arch of five stones"
                add(f"{what}, mu = {mu:.4f} of {needs:.4f}: moved", "0" if mu > needs else "falls",
                    size(np.abs(r.fields()["displacement"][-1]).max()), r)
    for mu in (.3, .8):
        r = run["slab", mu]
        add(f"elastic slab thrown with a spin, to its stop, mu = {mu}: error of the energy, least loss in an increment",
            "0, >= 0", f"{size(balance(r.history))}, {size(np.diff(r.history['friction_loss']).min())}", r)
    return table(["scene", "known", "here", "cuts", "law"], rows)


CHAPTERS = [Chapter("friction_rest", start_rest, report_rest),
            Chapter("friction_known", start_known, report_known),
            Chapter("friction_curves", start_curves, report_curves),
            Chapter("friction_flutter", start_flutter, report_flutter),
            Chapter("friction_held", start_held, report_held),
            Chapter("friction_space", start_space, report_space),
            Chapter("friction_space_known", start_space_known, report_space_known),
            Chapter("friction_random", start_random, report_random),
            Chapter("friction_ring", start_ring, report_ring)]
