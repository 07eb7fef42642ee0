"""Two cylinders pressed together: convergence to Hertz, and to the limit of these bodies."""

import dataclasses

import numpy as np
from scene_tools import figures

from .common import COLOURS, Chapter, axes, legend, mortar, node, order, save, segment, size, table

HALF_WIDTH, PEAK = 0.680778, 9.351351
LEVELS = (4, 8, 16, 32)
CHOICES = {
    "`NODE TO SURFACE`": node(),
    "`NODE TO SURFACE`, `HERMITE`": node(smoothing="HERMITE"),
    "`SEGMENT`, `STANDARD`": segment("STANDARD"),
    "`MORTAR`, `STANDARD`": mortar("EDGE", "STANDARD"),
    "`MORTAR`, `DUAL`": mortar("EDGE", "DUAL"),
    "`MORTAR`, `DUAL`, `HERMITE`": mortar("EDGE", "DUAL", smoothing="HERMITE"),
}


@dataclasses.dataclass(frozen=True)
class Contact:
    """Slave nodes from left to right: place, vertical force, and force by reference length."""

    x: np.ndarray
    force: np.ndarray
    pressure: np.ndarray
    share: float                 # of the force of the deck

    def width_error(self):
        """Of the half-width a, by the second moment of an ellipse, a^2/4."""
        width = 2*np.sqrt((self.force*self.x**2).sum()/self.force.sum())
        return width/(HALF_WIDTH*np.sqrt(self.share)) - 1

    def peak_error(self):
        return self.pressure.max()/(PEAK*np.sqrt(self.share)) - 1

    def pressure_error(self):
        """Root mean square, over the width, of nodal pressures against means of the ellipse."""
        exact = nodal_means(self.x, ellipse)
        edge = np.diff(self.x)
        length = 0.5*(np.r_[0, edge] + np.r_[edge, 0])
        square = (length*(self.pressure - exact)**2).sum()
        return np.sqrt(square/(length*exact**2).sum())


def ellipse(x):
    return PEAK*np.sqrt(np.maximum(1 - (x/HALF_WIDTH)**2, 0))


def nodal_means(x, function, n=200):
    """Means of a function, weighted with the hat functions of the nodes `x`."""
    s = (np.arange(n) + 0.5)/n
    edge = np.diff(x)
    values = function(x[:-1, None] + edge[:, None]*s)
    left, right = (edge*(values*w).mean(axis=1) for w in (1 - s, s))
    return (np.r_[0, right] + np.r_[left, 0])/(0.5*(np.r_[0, edge] + np.r_[edge, 0]))


def contact(run, share=1.0):
    """What acts on the upper arc of make_hertz.py, the slave."""
    fields = run.fields()
    x = fields.x
    first_upper = np.flatnonzero(x[:, 1] < -1e-9).max() + 1
    radius = 0.5*np.ptp(x[:, 1])
    upper = np.arange(first_upper, len(x))
    arc = upper[np.abs(np.hypot(x[upper, 0], x[upper, 1] - radius) - radius) < 1e-9]
    arc = arc[np.argsort(x[arc, 0])]
    edge = np.hypot(*np.diff(x[arc], axis=0).T)
    force = fields["contact_force"][-1][arc, 1]
    return Contact(x[arc, 0], force, force/(0.5*(np.r_[0, edge] + np.r_[edge, 0])), share)


# ---- convergence --------------------------------------------------------------------------------


def start_levels(runs):
    decks = {level: runs.generated("hertz", "--level", level) for level in LEVELS}
    for deck in decks.values():
        assert np.allclose(figures(deck, r"E'\)\) = (\S+), peak pressure 2 F/\(pi a\) = (\S+), "),
                           (HALF_WIDTH, PEAK), rtol=1e-6)
    return {(name, level): runs.start(deck, **choice)
            for name, choice in CHOICES.items() for level, deck in decks.items()}


def levels(started, folder):
    done = {key: contact(future.result()) for key, future in started.items()}
    steps = [HALF_WIDTH/level for level in LEVELS]
    rows = []
    for name in CHOICES:
        each = [done[name, level] for level in LEVELS]
        l2 = [c.pressure_error() for c in each]
        rows.append((name, "half-width", *(f"{100*c.width_error():+.3f} %" for c in each), ""))
        rows.append(("", "peak", *(f"{100*c.peak_error():+.3f} %" for c in each), ""))
        rows.append(("", "pressure, rms", *(f"{100*e:.2f} %" for e in l2),
                     f"{order(steps, l2):.1f}"))
    if folder:
        draw(done, folder / "verification_hertz.png")
    return table(["formulation", "error of", *(f"{n} edges" for n in LEVELS), "order"], rows)


def draw(done, path):
    left, right = axes(2)
    x = np.linspace(0, HALF_WIDTH, 400)
    left.plot(x, ellipse(x), color="0.7", lw=3, label="Hertz")
    for (name, level), mark, colour in (
        (("`NODE TO SURFACE`", 16), "x", COLOURS[1]),
        (("`MORTAR`, `DUAL`", 8), "o", COLOURS[0]),
        (("`MORTAR`, `DUAL`", 16), ".", COLOURS[2]),
    ):
        c = done[name, level]
        near = (c.x > -1e-9) & (c.x < 0.85)
        left.plot(c.x[near], c.pressure[near], mark, color=colour, ms=4,
                  label=f"{plain(name)}, {level} edges")
    for name, colour in zip(CHOICES, ("0.5", *COLOURS), strict=False):
        error = [100*done[name, level].pressure_error() for level in LEVELS]
        right.loglog(LEVELS, error, "o-", color=colour, ms=3, lw=1, label=plain(name))
    right.loglog(LEVELS, [10/level for level in LEVELS], "k:", lw=0.8, label="order 1")
    right.set_xticks(LEVELS, [str(level) for level in LEVELS])
    right.set_yticks([0.3, 1, 3], ["0.3", "1", "3"])
    right.minorticks_off()
    left.set(xlabel="x", ylabel="contact force / reference length", ylim=(0, None))
    right.set(xlabel="slave edges on the half-width", ylabel="rms error of the pressure [%]")
    legend(left)
    legend(right)
    save(path)


def plain(name):
    return name.replace("`", "").lower()


# ---- what the finite bodies cost ----------------------------------------------------------------

#: Share of the force, with the level that has 16 edges on the half-width.
SHARES = {1.0: 16, 0.25: 32, 0.0625: 64}
FULL_PRESSURE = 0.625


def start_size(runs):
    choice = mortar("EDGE", "STANDARD")
    return {share: runs.start(runs.generated("hertz", "--level", level),
                              pressure=FULL_PRESSURE*share, **choice)
            for share, level in SHARES.items()}


def body_size(started, _):
    rows = []
    for share, future in started.items():
        c = contact(future.result(), share)
        width = HALF_WIDTH*np.sqrt(share)
        rows.append((f"{10*share:g}", f"{width:.4f}", f"{width/8:.3f}",
                     f"{100*c.width_error():+.3f} %", f"{100*c.peak_error():+.3f} %",
                     size(abs(c.force.sum()/(10*share) - 1))))
    return table(["force", "half-width (Hertz)", "/ radius", "half-width", "peak",
                  "sum of forces"], rows)


CHAPTERS = [
    Chapter("hertz", start_levels, levels),
    Chapter("hertz_size", start_size, body_size),
]
