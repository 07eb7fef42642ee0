"""The ring impact: treatments of first contact, meshes, formulations."""

import h5py
import numpy as np
from scene_tools import DECKS, Deck

from .common import (BROAD, COLOURS, FORMULATIONS, TREATMENTS, Chapter, axes, drift, legend,
                     save, size, table, with_print)


def rebound(run):
    """Velocity of the ring's centre of mass at the end."""
    with h5py.File(run.file(".h5"), "r") as file:
        bodies = file["sets/BODIES"]
        return bodies["MOMENTUM"][-1, 0, :2]/bodies["MASS"][0, 0]


# ---- treatments of first contact ----------------------------------------------------------------


def start_treatments(runs):
    fine = runs.generated("ring", "--ring", "128x8", "--block", "120x10")
    cases = [("128 x 8", "PERSISTENT", h, fine) for h in (0.02, 0.05)]
    for h in (0.005, 0.01, 0.02, 0.05):
        treatments = TREATMENTS if h > 0.005 else TREATMENTS[:1]
        cases += [("64 x 4", treatment, h, DECKS / "ring.inp") for treatment in treatments]
    return {
        (mesh, treatment, h): runs.start(deck, h=h, initiation=treatment, frame=1)
        for mesh, treatment, h, deck in cases
    }


def treatments(started, figures):
    done = {key: future.result() for key, future in started.items()}
    rows = []
    order = sorted(done, key=lambda k: (k[0] != "64 x 4", TREATMENTS.index(k[1]), -k[2]))
    for mesh, treatment, h in order:
        run = done[mesh, treatment, h]
        history, total = run.history, run.history["total"]
        vx, vy = rebound(run)
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
        draw(done, figures / "verification_ring.png")
    return table(
        ["ring mesh", "treatment", "h", "vx", "vy", "energy", "penetration", "Newton", "cuts"], rows
    )


def draw(done, path):
    left, right = axes(2)
    for treatment, colour in zip(TREATMENTS, COLOURS, strict=False):
        broad = BROAD[TREATMENTS.index(treatment)]
        for h, line in ((0.05, "--"), (0.01, "-")):
            history = done["64 x 4", treatment, h].history
            left.plot(history["time"], history["total"]/history["total"][0], line, color=colour,
                      lw=broad, label=f"{treatment.lower()}, h = {h:g}")
        keys = [key for key in done if key[:2] == ("64 x 4", treatment)]
        right.semilogx([k[2] for k in keys], [rebound(done[k])[1] for k in keys], "o-",
                       color=colour, ms=4, lw=1, label=f"64 x 4, {treatment.lower()}")
    keys = [key for key in done if key[0] == "128 x 8"]
    right.semilogx([k[2] for k in keys], [rebound(done[k])[1] for k in keys], "s-",
                   color="black", ms=4, lw=1, label="128 x 8, persistent")
    right.axhspan(2.42, 2.43, color="0.85", zorder=0, label="three other codes, 128 x 8")
    left.set(xlabel="time", ylabel="total energy / initial")
    right.set(xlabel="h", ylabel="rebound velocity of the ring")
    right.set_xticks([0.005, 0.01, 0.02, 0.05], ["0.005", "0.01", "0.02", "0.05"])
    right.minorticks_off()
    legend(left)
    legend(right)
    save(path)


# ---- formulations -------------------------------------------------------------------------------


def start_formulations(runs):
    started = {}
    for name, choice in FORMULATIONS.items():
        for h in (0.05, 0.01):
            deck = with_print(Deck.read(DECKS / "ring.inp"), "*NODE PRINT, NSET=BOTTOM\nRF\n")
            started[name, h] = runs.start(deck, h=h, frame=1, **choice)
    return started


def bottom_places(run):
    """Positions, which stay, of the clamped nodes whose reactions are printed."""
    place = {}
    for head, lines in Deck.read(run.file(".inp")).card:
        if head.split(",")[0] == "*NODE":
            for line in lines:
                label, x, y = line.split(",")
                place[int(label)] = float(x), float(y)
    with h5py.File(run.file(".h5"), "r") as file:
        return np.array([place[k] for k in file["sets/BOTTOM/RF_label"][:]])


def balances(run):
    """Largest error of px and lz of ring and foundation against the impulse of the support,
    relative to the start. Without increments that were cut: only their last part is printed."""
    history = run.history
    force = run.series("BOTTOM", "RF")[1][1:]
    x, y = bottom_places(run).T
    rate = {"px": force[:, :, 0].sum(axis=1),
            "lz": (x*force[:, :, 1] - y*force[:, :, 0]).sum(axis=1)}
    for name, values in rate.items():
        error = np.diff(history[name]) - np.diff(history["time"])*values
        error[history["cuts"][1:] > 0] = 0
        yield np.abs(np.cumsum(error)).max()/np.abs(history[name][0])


def formulations(started, _):
    rows = []
    for (name, h), future in started.items():
        run = future.result()
        history = run.history
        rows.append(
            (
                name,
                f"{h:g}",
                size(drift(history["total"])),
                *map(size, balances(run)),
                f"{rebound(run)[1]:.3f}",
                f"{history['newton'][1:].mean():.1f}",
                int(history["cuts"].sum()),
            )
        )
    return table(["formulation", "h", "energy", "px", "lz", "vy", "Newton", "cuts"], rows)


CHAPTERS = [
    Chapter("ring", start_treatments, treatments),
    Chapter("ring_formulations", start_formulations, formulations),
]
