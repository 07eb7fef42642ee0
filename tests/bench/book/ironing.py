"""A die drawn along a block without friction: the ripple of its reaction."""

import re

import numpy as np

from .common import COLOURS, Chapter, axes, legend, mortar, node, save, table

SWAPPED = {"slave": "BLOCK_TOP", "master": "DIE_FACE"}
NODE = "`NODE TO SURFACE`"
CHOICES = {
    NODE: node(),
    f"{NODE}, roles swapped": node(**SWAPPED),
    f"{NODE}, `HERMITE`": node(smoothing="HERMITE"),
    "`MORTAR`, `STANDARD`": mortar("NODAL", "STANDARD"),
    "`MORTAR`, `DUAL`": mortar("NODAL", "DUAL"),
    "`MORTAR`, `STANDARD`, `HERMITE`": mortar("NODAL", "STANDARD", smoothing="HERMITE"),
    "`MORTAR`, `DUAL`, `HERMITE`": mortar("NODAL", "DUAL", smoothing="HERMITE"),
}
DRAWN = (f"{NODE}, roles swapped", f"{NODE}, `HERMITE`", "`MORTAR`, `STANDARD`",
         "`MORTAR`, `DUAL`, `HERMITE`")
#: Elements along the face of the die: against the block's, the ratio decides how ripples add up.
DIES = (16, 18, 20)
MIDDLE = DIES[1]


def start(runs):
    decks = {n: runs.generated("ironing", "--die", f"{n}x4") for n in DIES}
    return {(name, n): runs.start(deck, **choice)
            for name, choice in CHOICES.items() for n, deck in decks.items()
            if name != NODE or n == MIDDLE}


def reaction(run):
    """Time and reaction of the die, positive upwards and against the motion."""
    time, force = run.series("HEAD", "TOTAL_RF")
    return time, -force[:, 0, :]


def ripple(time, force):
    """Peak to peak over 4 < t < 9 without the parabola through it, by the mean vertical force."""
    middle = (time > 4) & (time < 9)
    t, f = time[middle], force[middle]
    mean = np.abs(f[:, 1].mean())
    smooth = [np.polyval(np.polyfit(t, f[:, a], 2), t) for a in (0, 1)]
    return mean, *(np.ptp(f[:, a] - smooth[a])/mean for a in (1, 0))


def cells(run):
    """Mean vertical reaction, and ripples by it: vertical, horizontal."""
    mean, vertical, horizontal = ripple(*reaction(run))
    return f"{mean/1e8:.2f}e8", f"{100*vertical:.2f} / {100*horizontal:.2f} %"


def outcome(future):
    """The run and its cells, or None and where it stopped."""
    failure = future.exception()
    if not failure:
        return future.result(), cells(future.result())
    at = re.search(r"the analysis stops at time (\d+\.\d+)", str(failure))
    assert at, failure
    return None, ("", f"stops at t = {float(at[1]):.1f}")


def report(started, folder):
    done = {key: outcome(future) for key, future in started.items()}
    rows = []
    for name in CHOICES:
        runs = [run for n in DIES if (run := done.get((name, n), (None,))[0])]
        ripples = (done[name, n][1][1] if (name, n) in done else "" for n in DIES)
        rows.append((name, done[name, MIDDLE][1][0], *ripples,
                     sum(int(run.history["cuts"].sum()) for run in runs) if runs else ""))
    if folder:
        draw({name: reaction(done[name, MIDDLE][0]) for name in DRAWN if done[name, MIDDLE][0]},
             folder / "verification_ironing.png")
    return table(["formulation", "mean vertical", *(f"die of {n}" for n in DIES), "cuts"], rows)


def draw(curves, path):
    upper, lower = axes(1, n_row=2, height=2.3)[:, 0]
    for (name, (time, force)), colour in zip(curves.items(), COLOURS, strict=False):
        drawn = time >= 1
        for axis, a in ((upper, 1), (lower, 0)):
            axis.plot(time[drawn] - 1, force[drawn, a]/1e8, color=colour, lw=1,
                      label=name.replace("`", "").lower())
    upper.set(ylabel="vertical reaction / 1e8", ylim=(7.35, 7.85))
    lower.set(xlabel="path of the die", ylabel="horizontal reaction / 1e8", ylim=(-0.2, 0.2))
    legend(upper, 4)
    save(path)


CHAPTERS = [Chapter("ironing", start, report)]
