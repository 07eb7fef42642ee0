"""Make the tables and figures of docs/verification.md again.

    .venv/bin/python tests/bench/verification.py            # print the tables
    .venv/bin/python tests/bench/verification.py --update   # write them and the figures into docs/

Runs the decks of input_decks/ and a few made here, in a temporary folder, two at a time. Needs
the program (`make app`), and for one table the program in quadruple precision
(`make app WP=real128`), which is left out where that is missing.
"""

import argparse
import concurrent.futures
import dataclasses
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import h5py
import matplotlib as mpl
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / part) for part in ("tests", "tests/extremes", "input_decks")]

import deckwriter
import scene_tools
import test_units
from scene_tools import DECKS, Deck, run_deck

BOOK = ROOT / "docs" / "verification.md"
QUADRUPLE = ROOT / "build" / "release-real128" / "emcon"
TREATMENTS = ("PERSISTENT", "ADMISSIBLE", "VELOCITY UPDATE")
COLOURS = ("#1f4e79", "#b5532a", "#4c8c4a")


class Runs:
    """Runs of decks in the background, two at a time; a result is waited for when asked for."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.pool = concurrent.futures.ThreadPoolExecutor(2)
        self.count = 0

    def start(self, deck, **parameters):
        self.count += 1
        folder = self.folder / f"run{self.count}"
        return self.pool.submit(run_deck, deck, folder, **parameters)

    def generated(self, generator, *options):
        """A deck made by a generator of input_decks/."""
        self.count += 1
        path = self.folder / f"{generator}{self.count}.inp"
        script = DECKS / f"make_{generator}.py"
        subprocess.run([sys.executable, script, *options, "--output", path], check=True)
        return path


def table(head, rows):
    """Lines of a Markdown table."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|"*len(head)]
    return [*lines, *("| " + " | ".join(map(str, row)) + " |" for row in rows)]


def size(value):
    """A figure of round-off: two digits."""
    return f"{value:.1e}"


def drift(total):
    return np.abs(total - total[0]).max()/np.abs(total[0])


def with_print(deck, cards):
    """`deck` with further requests in front of the end of its last step."""
    at = len(deck.card) - 1
    deck.card[at:at] = Deck(cards).card
    return deck


# ---- ring ---------------------------------------------------------------------------------------


def ring_velocity(run):
    with h5py.File(run.file(".h5"), "r") as file:
        bodies = file["sets/BODIES"]
        return bodies["MOMENTUM"][-1, 0, :2]/bodies["MASS"][0, 0]


def start_ring(runs):
    fine = runs.generated("ring", "--ring", "128x8", "--block", "120x10")
    cases = [("128 x 8", "PERSISTENT", h, fine) for h in (0.02, 0.05)]
    for h in (0.005, 0.01, 0.02, 0.05):
        treatments = TREATMENTS if h > 0.005 else TREATMENTS[:1]
        cases += [("64 x 4", treatment, h, DECKS / "ring.inp") for treatment in treatments]
    return {
        (mesh, treatment, h): runs.start(deck, h=h, initiation=treatment, frame=1)
        for mesh, treatment, h, deck in cases
    }


def ring(started, figures):
    done = {key: future.result() for key, future in started.items()}
    rows = []
    order = sorted(done, key=lambda k: (k[0] != "64 x 4", TREATMENTS.index(k[1]), -k[2]))
    for mesh, treatment, h in order:
        run = done[mesh, treatment, h]
        history, total = run.history, run.history["total"]
        vx, vy = ring_velocity(run)
        rows.append(
            (
                mesh,
                f"`{treatment}`",
                f"{h:g}",
                f"{vx:.4f}",
                f"{vy:.3f}",
                f"{100*(total[-1]/total[0] - 1):+.3f} %" if treatment == "ADMISSIBLE"
                else size(drift(total)),
                size(run.closing(r"deepest penetration (\S+) of")),
                f"{history['newton'][1:].mean():.1f}",
                int(history["cuts"].sum()),
            )
        )
    if figures:
        draw_ring(done, figures / "verification_ring.png")
    return table(
        ["ring mesh", "treatment", "h", "vx", "vy", "energy", "penetration", "Newton", "cuts"], rows
    )


def draw_ring(done, path):
    _, (left, right) = axes(2)
    for treatment, colour in zip(TREATMENTS, COLOURS, strict=True):
        for h, line in ((0.05, "--"), (0.01, "-")):
            history = done["64 x 4", treatment, h].history
            left.plot(history["time"], history["total"]/history["total"][0], line, color=colour,
                      lw=1.2, label=f"{treatment.lower()}, h = {h:g}")
        keys = [key for key in done if key[:2] == ("64 x 4", treatment)]
        right.semilogx([k[2] for k in keys], [ring_velocity(done[k])[1] for k in keys], "o-",
                       color=colour, ms=4, lw=1, label=f"64 x 4, {treatment.lower()}")
    keys = [key for key in done if key[0] == "128 x 8"]
    right.semilogx([k[2] for k in keys], [ring_velocity(done[k])[1] for k in keys], "s-",
                   color="black", ms=4, lw=1, label="128 x 8, persistent")
    right.axhspan(2.42, 2.43, color="0.85", zorder=0, label="three other codes, 128 x 8")
    left.set(xlabel="time", ylabel="total energy / initial")
    right.set(xlabel="h", ylabel="rebound velocity of the ring")
    right.set_xticks([0.005, 0.01, 0.02, 0.05], ["0.005", "0.01", "0.02", "0.05"])
    right.minorticks_off()
    left.legend(fontsize=6.5, frameon=False, loc="right", bbox_to_anchor=(1.0, 0.42))
    right.legend(fontsize=6.5, frameon=False)
    save(path)


# ---- spinning ring ------------------------------------------------------------------------------


def start_spin(runs):
    deck = DECKS / "spinning_ring.inp"
    return {h: runs.start(deck, h=h, t_end=1000*h, frame=500*h) for h in (0.1, 0.05, 0.01)}


def spin(started, _):
    rows = []
    for h, future in started.items():
        run = future.result()
        history = run.history
        rows.append(
            (
                f"{h:g}",
                *(size(drift(history[name])) for name in ("total", "px", "py", "lz")),
                f"{history['strain'].max()/history['total'][0]:.2f}",
                f"{history['newton'][1:].mean():.1f}",
                int(history["cuts"].sum()),
            )
        )
    return table(
        ["h", "energy", "px", "py", "lz", "largest strain energy / total", "Newton", "cuts"], rows
    )


# ---- bouncing bar -------------------------------------------------------------------------------


def bar_end(time, n_term=400):
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


def start_bar(runs):
    started = {}
    for n, h in ((25, 0.01), (50, 0.005), (100, 0.0025), (200, 0.00125), (50, 0.0025), (50, 0.01)):
        path = runs.generated("bouncing_bar", "--elements", str(n))
        deck = with_print(Deck.read(path), "*NODE PRINT, NSET=LOWER_END\nU, V\n")
        started[n, h] = runs.start(deck, h=h, t_end=16/3, frame=1)
    return started


def bar(started, figures):
    rows, curves = [], {}
    for (n, h), future in started.items():
        run = future.result()
        time, u = run.series("LOWER_END", "U")
        y = 5.0 + u[:, 0, 1]
        t_force, force = run.series("CONTACT", "TOTAL_CF")
        force = force[:, 0, 1]
        exact = bar_end(time)
        flight = time < 16/3 + h/2
        error = np.abs(y - exact)[flight]
        rests = (t_force > 1.05) & (t_force < 1.6)
        ramp = 300 + 300*(t_force[rests] - 1)
        first = (t_force > 0.5) & (t_force < 2.5)
        impulse = np.sum(np.abs(force[first][1:])*np.diff(t_force[first]))
        rows.append(
            (
                n,
                f"{h:g}",
                f"{30*h/(10/n):g}",
                f"{math.sqrt(np.mean(error**2)):.4f}",
                f"{error.max():.4f}",
                f"{impulse:.1f}",
                f"{100*(np.abs(force[rests]) - ramp).std()/400:.0f} %",
                size(np.abs(run.history["total"]).max()/run.history["kinetic"].max()),
            )
        )
        curves[n, h] = time, y, exact, t_force, np.abs(force)
    if figures:
        draw_bar(curves, figures / "verification_bar.png")
    return table(
        ["elements", "h", "Courant", "error of height, rms", "largest", "impulse (266.7)",
         "scatter of force", "energy"],
        rows,
    )


def draw_bar(curves, path):
    _, (left, right) = axes(2)
    time, y, exact, t_force, force = curves[50, 0.005]
    left.plot(time, exact, color="0.6", lw=3, label="closed form")
    left.plot(time, y, color=COLOURS[0], lw=1, label="50 elements, h = 0.005")
    near = (t_force > 0.9) & (t_force < 1.8)
    width = round(0.1/0.005)
    mean = np.convolve(force, np.ones(width)/width, mode="same")
    right.plot(t_force[near], force[near], color="0.75", lw=0.8, label="contact force")
    right.plot(t_force[near], mean[near], color=COLOURS[0], lw=1.5, label="mean over 0.1")
    right.plot([0.9, 1, 1, 5/3, 5/3, 1.8], [0, 0, 300, 500, 0, 0], "k--", lw=1,
               label="closed form")
    left.set(xlabel="time", ylabel="height of the lower end", ylim=(-0.2, 6.3))
    right.set(xlabel="time", ylabel="contact force", ylim=(-40, 950))
    left.legend(fontsize=7, frameon=False)
    right.legend(fontsize=7, frameon=False)
    save(path)


# ---- statics without contact --------------------------------------------------------------------


def start_patch(runs):
    cards = "*EL PRINT, ELSET=BODY\nS\n"
    deck = Deck.read(DECKS / "patch_pressure.inp")
    body = re.search(r"\*SOLID SECTION, ELSET=(\w+)", deck.text())[1]
    return runs.start(with_print(deck, cards.replace("BODY", body)))


def patch(started, _):
    run = started.result()
    place = run.fields()["cauchy_stress"][-1]
    error = np.abs(place - np.array([0, -10, -3, 0, 0, 0])).max()/10
    corner = np.abs(run.fields()["displacement"][-1]).max(axis=0)
    return table(
        ["largest error of stress / 10", "corner, ux", "uy", "strain energy"],
        [
            (
                size(error),
                f"0.0078 {corner[0] - 0.0078:+.0e}",
                f"-0.0182 {0.0182 - corner[1]:+.0e}",
                f"0.182 {run.history['strain'][-1] - 0.182:+.0e}",
            )
        ],
    )


def start_cantilever(runs):
    return {
        mesh: runs.start(runs.generated("cantilever", "--beam", mesh))
        for mesh in ("40x2", "80x4", "160x8", "320x16")
    }


def cantilever(started, _):
    tips = {}
    for mesh, future in started.items():
        fields = future.result().fields()
        middle = np.argmin(np.abs(fields.x - [10.0, 0.0]).sum(axis=1))
        tips[mesh] = fields["displacement"][-1, middle]
    meshes = list(tips)
    limit = tips[meshes[-1]] + (tips[meshes[-1]] - tips[meshes[-2]])/3
    rows, last = [], None
    for mesh in meshes:
        error = np.abs(tips[mesh][1] - limit[1])
        order = f"{math.log2(last/error):.2f}" if last else ""
        tip = (f"{v:.5f}" for v in tips[mesh])
        rows.append((mesh.replace("x", " x "), *tip, size(error), order))
        last = error
    rows.append(("extrapolated", *(f"{v:.5f}" for v in limit), "", ""))
    rows.append(("elastica (no shear, no stretch)", "-0.5643", "-3.0172", "", ""))
    return table(["mesh", "ux of the tip", "uy", "error of uy", "order"], rows)


# ---- contact, static ----------------------------------------------------------------------------

INTERACTION = """
*SURFACE INTERACTION, NAME=FRICTIONLESS
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=NODE TO SURFACE
"""


def two_steps(nlgeom, approach, supports, pressure, output):
    """Close the contact by a small displacement of HEAD, then put a pressure in its place."""
    return f"""
*STEP{nlgeom}
*STATIC
1., 1.
*BOUNDARY
{supports}
HEAD, 2, 2, {approach}
*END STEP
*STEP{nlgeom}
*STATIC
0.5, 1.
*BOUNDARY, OP=NEW
{supports}
*DLOAD
{pressure}
{output}
*END STEP
"""


def contact_patch_deck(upper, lower, is_upper_slave):
    """A block over 0..1 on a foundation over -1..2, both guided at x = 0; pressure 10 on the block
    and beside it: both are in the same uniform state."""
    large, small = deckwriter.Part("LARGE"), deckwriter.Part("SMALL")
    n = lower[0]//3
    grid = deckwriter.add_grid(large, lower, deckwriter.box((-1.0, -1.0), (3.0, 1.0), lower))
    over = deckwriter.add_grid(
        small, upper, deckwriter.box((0.0, 0.0), (1.0, 1.0), upper),
        first=(len(large.node) + 1, len(large.element) + 1),
    )
    lines = ["*HEADING", "Contact patch test"]
    lines += large.node_lines() + large.element_lines() + small.node_lines() + small.element_lines()
    lines += deckwriter.set_lines("NSET", "LEFT", grid.node[n] + over.node[0])
    lines += deckwriter.set_lines("NSET", "BASE", [column[0] for column in grid.node])
    lines += deckwriter.set_lines("NSET", "HEAD", [column[-1] for column in over.node])
    lines += deckwriter.set_lines("ELSET", "HEAD", [column[-1] for column in over.element])
    beside = [column[-1] for column in grid.element[:n] + grid.element[2*n:]]
    lines += deckwriter.set_lines("ELSET", "BESIDE", beside)
    lines += deckwriter.surface_lines("FOOT", "S1", [column[0] for column in over.element])
    top = grid.element if is_upper_slave else grid.element[n : 2*n]
    lines += deckwriter.surface_lines("TOP", "S3", [column[-1] for column in top])
    lines += ["*MATERIAL, NAME=RUBBER", "*HYPERELASTIC, COUPLED NEO HOOKE", "1000., 0.4"]
    lines += [f"*SOLID SECTION, ELSET={part.name}, MATERIAL=RUBBER" for part in (large, small)]
    lines += INTERACTION.strip().splitlines()
    lines += ["FOOT, TOP" if is_upper_slave else "TOP, FOOT"]
    lines += two_steps(
        ", NLGEOM", -0.001, "BASE, 2\nLEFT, 1", "HEAD, P3, 10.\nBESIDE, P3, 10.",
        "*CONTACT PRINT\nCSTR\n*EL PRINT, ELSET=SMALL\nS\n*EL PRINT, ELSET=LARGE\nS",
    ).strip().splitlines()
    return Deck("\n".join(lines), "patch")


def start_contact_patch(runs):
    cases = [
        ("matching", (6, 6), (18, 6), True),
        ("slave coarser", (5, 5), (18, 6), True),
        ("the same, all elements halved twice", (20, 20), (72, 24), True),
        ("slave finer", (13, 13), (18, 6), True),
        ("slave much coarser", (5, 5), (72, 24), True),
    ]
    return [
        (name, upper, lower, runs.start(contact_patch_deck(upper, lower, is_slave)))
        for name, upper, lower, is_slave in cases
    ]


def contact_patch(started, _):
    rows = []
    for name, upper, lower, future in started:
        run = future.result()
        _, pressure = run.series("CONTACT", "CSTR")
        pressure = pressure[-1, :, 0]
        pressure = pressure[pressure > 0]
        stress = [run.series(part, "S")[1][-1, :, 1] for part in ("SMALL", "LARGE")]
        errors = [np.abs(s + 10).max()/10 for s in stress]
        worst = np.abs(pressure - 10).max()/10
        rows.append(
            (
                name,
                f"{upper[0]} on {lower[0]//3}",
                *(size(v) if v < 1e-9 else f"{100*v:.3g} %" for v in (worst, *errors)),
            )
        )
    return table(
        ["interface", "elements along it", "contact pressure", "stress, block",
         "stress, foundation"],
        rows,
    )


def hertz_deck(n, ratio):
    """A quarter of a cylinder of radius 8, pressed on a rigid floor by 0.625 on its equator."""
    radius, corner = 8.0, 0.25*math.pi
    grading = np.cumsum(np.concatenate([[0.0], ratio**np.arange(n)]))
    grading /= grading[-1]

    def arc(angle):
        return radius*math.sin(angle), -radius*math.cos(angle)

    def position(i, j):
        """Transfinite: along i the foot of the arc, up j the axis; grading from the foot."""
        s, t = grading[i], grading[j]
        foot, side = arc(s*corner), arc((2 - t)*corner)
        side = arc(corner*(1 + t))
        axis, equator = (0.0, -radius*(1 - t)), (radius*s, 0.0)
        ends = (0.0, -radius), arc(corner), (0.0, 0.0), (radius, 0.0)
        return tuple(
            (1 - t)*foot[k] + t*equator[k] + (1 - s)*axis[k] + s*side[k]
            - (1 - s)*(1 - t)*ends[0][k] - s*(1 - t)*ends[1][k]
            - (1 - s)*t*ends[2][k] - s*t*ends[3][k]
            for k in range(2)
        )

    disc, floor = deckwriter.Part("DISC"), deckwriter.Part("FLOOR")
    grid = deckwriter.add_grid(disc, (n, n), position)
    base = deckwriter.add_grid(
        floor, (1, 1), deckwriter.box((-8.0, -9.0), (24.0, 1.0), (1, 1)),
        first=(len(disc.node) + 1, len(disc.element) + 1),
    )
    lines = ["*HEADING", "Cylinder on a rigid floor"]
    lines += disc.node_lines() + disc.element_lines() + floor.node_lines() + floor.element_lines()
    lines += deckwriter.set_lines("NSET", "AXIS", grid.node[0])
    lines += deckwriter.set_lines("NSET", "HEAD", [column[-1] for column in grid.node])
    lines += deckwriter.set_lines("ELSET", "HEAD", [column[-1] for column in grid.element])
    lines += deckwriter.surface_lines("FOOT", "S1", [column[0] for column in grid.element])
    lines += deckwriter.surface_lines("TOP", "S3", [base.element[0][0]])
    lines += ["*MATERIAL, NAME=ELASTIC", "*ELASTIC", "200., 0.3"]
    lines += [f"*SOLID SECTION, ELSET={part.name}, MATERIAL=ELASTIC" for part in (disc, floor)]
    lines += [*INTERACTION.strip().splitlines(), "FOOT, TOP"]
    lines += two_steps(
        "", -0.02, "FLOOR, 1, 2\nAXIS, 1", "HEAD, P3, 0.625",
        "*CONTACT PRINT\nCDIS, CSTR, CF\n*NODE PRINT, NSET=DISC\nU",
    ).strip().splitlines()
    return Deck("\n".join(lines), "hertz"), {
        label: disc.node[label][0] for label in (column[0] for column in grid.node)
    }


def start_hertz(runs):
    started = []
    for n, ratio in ((20, 1.2), (40, 1.095), (80, 1.0465)):
        deck, x = hertz_deck(n, ratio)
        started.append((n, x, runs.start(deck)))
    return started


def hertz(started, figures):
    half, peak = 0.680778, 9.351351
    rows, curves = [], {}
    for n, x, future in started:
        run = future.result()
        with h5py.File(run.file(".h5"), "r") as file:
            group = file["sets/CONTACT"]
            label = group["CSTR_label"][:]
            pressure = group["CSTR"][-1, :, 0]
            force = group["CF"][-1, :, 1]
        position = np.array([x[k] for k in label])
        order = np.argsort(position)
        position, pressure, force = position[order], pressure[order], force[order]
        edge = np.diff(position)
        by_length = force/(0.5*(np.append(edge, 0) + np.insert(edge, 0, 0)))
        inner = by_length > 0.3*peak
        slope, level = np.polyfit(position[inner]**2, by_length[inner]**2, 1)
        width = math.sqrt(-level/slope)
        rows.append(
            (
                f"{n} x {n}",
                f"{position[1]:.3f}",
                int((pressure > 0).sum()),
                f"{by_length[0]:.4f} ({100*(by_length[0]/peak - 1):+.2f} %)",
                f"{pressure[0]:.4f} ({100*(pressure[0]/peak - 1):+.2f} %)",
                f"{width:.4f} ({100*(width/half - 1):+.2f} %)",
                f"{2*force.sum():.10f}",
            )
        )
        curves[n] = position, by_length
    if figures:
        draw_hertz(curves, half, peak, figures / "verification_hertz.png")
    return table(
        ["mesh of the quarter", "first edge", "nodes in contact", "peak (9.3514)",
         "on deformed area", "half-width (0.6808)", "force (10)"],
        rows,
    )


def draw_hertz(curves, half, peak, path):
    _, (axis,) = axes(1)
    x = np.linspace(0, half, 200)
    axis.plot(x, peak*np.sqrt(1 - (x/half)**2), color="0.6", lw=3, label="Hertz")
    for (n, (position, pressure)), colour, mark in zip(curves.items(), COLOURS, "o^.", strict=True):
        near = position < 1.0
        axis.plot(position[near], pressure[near], mark, color=colour, ms=4, label=f"{n} x {n}")
    axis.set(xlabel="x", ylabel="contact force / undeformed length")
    axis.legend(fontsize=7, frameon=False)
    save(path)


# ---- numbers ------------------------------------------------------------------------------------


def start_units(runs):
    parameters = {"h": 0.05, "t_end": 1.5, "frame": 0.5}
    return [
        (units, runs.start(test_units.in_units(*units, **parameters)))
        for units in ((0, 0, 0), (3, 0, 0), (-10, 20, -7), (100, -90, 60))
    ]


def units(started, _):
    rows = []
    _, reference = started[0]
    for powers, future in started[1:]:
        try:
            test_units.assert_same_bits(future.result(), reference.result(), powers)
            same = "all bits"
        except AssertionError as problem:
            same = str(problem)
        rows.append((*(f"2^{p}" for p in powers), same))
    return table(["length", "mass", "time", "columns of the history that agree"], rows)


def start_translation(runs):
    started = []
    for distance in (0.0, 1e4, 1e8):
        deck = Deck.read(DECKS / "ring.inp")
        deck.move_nodes(lambda _, x, y, d=distance: (x + d, y + 0.75*d))
        started.append((distance, runs.start(deck, h=0.05, t_end=5, frame=1)))
    return started


def translation(started, _):
    rows = []
    first = started[0][1].result().history
    for distance, future in started:
        run = future.result()
        history = run.history
        rows.append(
            (
                f"{distance:.0e}" if distance else "0",
                f"{history['total'][0]:.12g}",
                size(drift(history["total"])),
                size(run.closing(r"deepest penetration (\S+) of")),
                size(abs(history["py"][-1] - first["py"][-1])) if distance else "",
            )
        )
    return table(["moved by", "total", "drift", "penetration", "change of py at t = 5"], rows)


def start_referee(runs):
    if not QUADRUPLE.exists():
        return []
    started = []
    for method in ("NULL SPACE", "SADDLE POINT"):
        for program in (scene_tools.PROGRAM, QUADRUPLE):
            folder = runs.folder / f"{program.parent.name}_{method[0]}"
            call = [program, DECKS / "ring.inp", "--quiet", "--output", folder]
            call += scene_tools.overrides({"h": 0.05, "t_end": 0.5, "method": method})
            run = scene_tools.Run(folder / "ring")
            future = runs.pool.submit(subprocess.run, call, check=True)
            started.append((program, method, run, future))
    return started


def referee(started, _):
    rows = []
    for program, method, run, future in started:
        future.result()
        last = run.increments[-1][-1].split()
        kind = "quadruple" if program == QUADRUPLE else "double"
        rows.append(
            (
                kind,
                f"`{method}`",
                size(run.closing(r"error of the energy balance (\S+) of")),
                last[-1],
                f"{run.history['kinetic'][-1]:.15f}",
            )
        )
    if not rows:
        return ["*(left out: no `build/release-real128/emcon`; make app WP=real128)*"]
    return table(
        ["state", "method", "energy balance", "last residual", "kinetic energy, t = 0.5"], rows
    )


# ---- the book -----------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Chapter:
    """A table of the book: `start` begins its runs, `report` waits and gives its lines."""

    name: str
    start: object
    report: object


#: In the order of the book.
BOOK_ORDER = [
    Chapter("ring", start_ring, ring),
    Chapter("spin", start_spin, spin),
    Chapter("bar", start_bar, bar),
    Chapter("patch", start_patch, patch),
    Chapter("cantilever", start_cantilever, cantilever),
    Chapter("contact_patch", start_contact_patch, contact_patch),
    Chapter("hertz", start_hertz, hertz),
    Chapter("units", start_units, units),
    Chapter("translation", start_translation, translation),
    Chapter("referee", start_referee, referee),
]


def axes(n):
    """`n` small axes side by side."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    plt.rcParams.update({"font.size": 8, "axes.spines.top": False, "axes.spines.right": False})
    figure, list_of_axes = plt.subplots(1, n, figsize=(3.6*n + 0.3, 2.7), squeeze=False)
    return figure, list_of_axes[0]


def save(path):
    from matplotlib import pyplot as plt

    plt.tight_layout()
    plt.savefig(path, dpi=110)
    plt.close()


def update(text, name, lines):
    """`text` of the book with the table between the marks of `name` made anew."""
    mark = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end -->)", re.DOTALL)
    assert mark.search(text), f"docs/verification.md has no table {name}"
    return mark.sub(lambda match: match[1] + "\n".join(lines) + "\n" + match[2], text)


def main():
    parser = argparse.ArgumentParser(description="Tables and figures of docs/verification.md")
    parser.add_argument("--update", action="store_true", help="write into docs/")
    parser.add_argument("only", nargs="*", help="chapters, as they are named in the output")
    options = parser.parse_args()
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    chapters = [c for c in BOOK_ORDER if not options.only or c.name in options.only]
    figures = BOOK.parent if options.update else None
    text = BOOK.read_text() if options.update else ""
    with tempfile.TemporaryDirectory() as folder:
        runs = Runs(folder)
        try:
            started = [(chapter, chapter.start(runs)) for chapter in chapters]
            for chapter, futures in started:
                lines = chapter.report(futures, figures)
                print(f"{chapter.name}\n", *lines, "", sep="\n", flush=True)
                if options.update:
                    text = update(text, chapter.name, lines)
        finally:
            runs.pool.shutdown(cancel_futures=True)
    if options.update:
        BOOK.write_text(text)


if __name__ == "__main__":
    main()
