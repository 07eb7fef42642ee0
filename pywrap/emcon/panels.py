"""Panels below the bodies: energies, drift, forces of pairs; of statics load and convergence."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator
from numpy.typing import NDArray

from .results import (Array, FieldFile, ResultPaths, asked_losses, energy_drift, read_contact_force,
                      read_pairs)
from .scene import BLACK, BLUE, GREY, ORANGE, UNITS

#: Least drift drawn; an exact zero is drawn there.
DRIFT_FLOOR = 1e-17
#: The total is a band behind the other energies, so that none hides another.
BAND = "#c4c4c4"
#: A pause of the force ends a contact where it is longer than this part of the run.
PAUSE = 0.05
#: A curve of energy that is nowhere more than this part of the largest is the axis itself.
SMALL = 5e-3
#: Along an axis with reactions below this part of the largest, or of what the work from outside
#: asks for, there is no load.
ROUND_OFF = 1e-9
#: Increments whose convergence is shown at most; letters of a name in a legend.
MOST_SOLVES, NAME_LENGTH = 7, 14
#: Where a legend begins, by the width of its axes; rows that it may have above them.
LEGEND_START, MOST_ROWS = -0.04, 3
#: Increments up to which each has its step in the curve of a force; parts of a run with more.
MOST_STEPS, PARTS = 200, 100
#: An angular momentum that changes by less than this part is kept.
KEPT = 1e-6
COLOURS = (BLACK, BLUE, ORANGE, "#3a7d44", "#7b4fa3")
#: Curves beyond the colours have these again, in the next style.
LINE_STYLES = ("-", "--", ":")

_NUMBER = r"[-+]?[\d.]+(?:[DE][-+]?\d+)?"
#: A line of an increment in the log: its time, and the residuals behind the energies.
_INCREMENT = re.compile(rf"\s*\d+\s+({_NUMBER})\s+{_NUMBER}\s+\d+\s+\d+\s+\d+"
                        rf"(?:\s+{_NUMBER}){{3}}((?:\s+{_NUMBER})+)\s*$", re.IGNORECASE)


@dataclass
class Force:
    """Forces of contact over time, a curve per pair; without any a note says why."""

    times: Array = field(default_factory=lambda: np.empty(0))    #: (n_time) [T]
    curves: dict[str, Array] = field(default_factory=dict)       #: name: (n_time)
    label: str = ""
    has_means: bool = False                                      #: values are means of increments
    is_sampled: bool = False                                     #: at frames, not increments
    is_count: bool = False                                       #: numbers of constraints
    n_smaller: int = 0                                           #: pairs that are not drawn
    note: str = ""                                               #: empty: nothing meets


@dataclass
class Load:
    """Resultant of the supports over the largest displacement, along one axis, at frames."""

    displacement: Array    #: (n_time) [L]
    load: Array            #: (n_time) [M L/T^2]
    axis: str              #: x, y or z


# --- reading -----------------------------------------------------------------------------------

def is_static(history: NDArray[np.void]) -> bool:
    """Nothing has kinetic energy, and something happens."""
    return not np.any(history["kinetic"]) and bool(np.any(history["strain"]))


def read_force(paths: ResultPaths, file: FieldFile | None,
               history: NDArray[np.void] | None) -> Force:
    """What the pairs transmit: of increments where the history tells it, else of frames."""
    if history is not None and "pair1_active" in (history.dtype.names or ()):
        return _force_of_pairs(paths, history)
    by_increment = read_contact_force(paths)
    if by_increment is not None:
        return Force(by_increment[0], {"": by_increment[1][:, 1]},
                     f"contact force on slaves, $y$ {UNITS['force']}")
    if file is None:
        return Force(note=f"no field file\n{paths.field.name}")
    return _force_of_frames(file)


def _force_of_pairs(paths: ResultPaths, history: NDArray[np.void]) -> Force:
    """On the second surface of each pair, along the axis on which most is transmitted; with
    friction along all. Where these are more curves than colours, a curve per pair is the length of
    its force, and of more pairs than colours those with the largest forces are drawn."""
    columns = history.dtype.names or ()
    count = sum(re.fullmatch(r"pair\d+_active", name) is not None for name in columns)
    named = read_pairs(paths)
    pairs = [("", "")]*count
    if named is not None and len(named.slave) == count:
        pairs = list(zip(named.slave, named.master, strict=True))
    else:
        # One pair of the history is held in both orders where the log has two.
        told = {frozenset(pair): pair for pair in reversed(
            re.findall(r"^contact (\S+) on (\S+):", _log(paths), re.MULTILINE))}
        pairs = list(told.values())[::-1] if len(told) == count else pairs
    masters = [master for _, master in pairs]
    names = [f"pair {k + 1}" if not master else
             f"on {master}" if masters.count(master) == 1 else f"by {slave}"
             for k, (slave, master) in enumerate(pairs)]
    alone = [k for k, (slave, master) in enumerate(pairs) if not master or slave != master]
    if not alone:
        return Force(history["time"], {names[k]: history[f"pair{k + 1}_active"].astype(float)
                                       for k in range(count)},
                     "active constraints", is_count=True)
    axes = [axis for axis in "xyz" if f"pair1_force_{axis}" in columns]
    size = {axis: sum(float(np.nansum(np.abs(history[f"pair{k + 1}_force_{axis}"])))
                      for k in alone) for axis in axes}
    axis = max(axes, key=lambda name: size[name])
    curves: dict[str, Array] = {}
    for k in alone:
        name = names[k] if names[k] not in curves else f"{names[k]}, {k + 1}"
        rubs = bool(np.any(history[f"pair{k + 1}_friction_loss"])) \
            if f"pair{k + 1}_friction_loss" in columns else False
        for along in [axis, *(other for other in axes if rubs and other != axis)]:
            curves[f"{name}, ${along}$" if rubs else name] = \
                0.0 - history[f"pair{k + 1}_force_{along}"]
    if len(curves) > len(COLOURS):
        return _lengths_of_pairs(history, {k: names[k] for k in alone}, axes)
    is_along_one = len(curves) == len(alone)
    return Force(history["time"], curves, "contact force"
                 + (f", ${axis}$ " if is_along_one else " ") + UNITS["force"],
                 has_means=not is_static(history))


def _lengths_of_pairs(history: NDArray[np.void], names: dict[int, str], axes: list[str]) -> Force:
    """Lengths of the forces of pairs, those with the largest first."""
    length = {k: np.linalg.norm([history[f"pair{k + 1}_force_{axis}"] for axis in axes], axis=0)
              for k in names}
    order = sorted(names, key=lambda k: -float(np.nanmax(length[k], initial=0.0)))
    curves: dict[str, Array] = {}
    for k in order[:len(COLOURS)]:
        curves[names[k] if names[k] not in curves else f"{names[k]}, {k + 1}"] = length[k]
    return Force(history["time"], curves, f"contact force $|F|$ {UNITS['force']}",
                 has_means=not is_static(history), n_smaller=len(order) - len(curves))


def _force_of_frames(file: FieldFile) -> Force:
    """Sum of the field `contact_force` over the slave nodes: those that have a gap; neither curve
    nor note where there is no contact at all."""
    if not any(name.startswith("contact_") for name in file.point_fields):
        return Force()
    if "contact_force" not in file.point_fields:
        return Force(note="no contact force in the result\n(asked for by *CONTACT FILE, CF)")
    if "contact_gap" not in file.point_fields:
        return Force(note="no contact gap in the result, slave nodes not known\n"
                          "(asked for by *CONTACT FILE, CDIS)")
    values = np.empty(len(file.times))
    for k in range(len(values)):
        is_slave = np.isfinite(file.point("contact_gap", k))
        values[k] = file.point("contact_force", k)[is_slave, 1].sum()
    return Force(file.times, {"": values}, f"contact force on slaves, $y$ {UNITS['force']}",
                 is_sampled=True)


def means(times: Array, force: Array) -> list[tuple[float, float, float]]:
    """Start [T], end [T] and mean of the force of each contact, of means over increments.

    A contact goes on over pauses that are shorter than the part `PAUSE` of all times.
    """
    acts = np.flatnonzero(force[1:] != 0.0) + 1
    if not acts.size:
        return []
    pause = times[acts[1:] - 1] - times[acts[:-1]]
    ends = np.flatnonzero(pause > PAUSE*(times[-1] - times[0]))
    found = []
    for part in np.split(acts, ends + 1):
        first, last = part[0] - 1, part[-1]
        lasts = times[last] - times[first]
        if lasts > 0.0:
            impulse = np.sum(force[first + 1:last + 1]*np.diff(times[first:last + 1]))
            found.append((float(times[first]), float(times[last]), float(impulse/lasts)))
    return found


def part_means(times: Array, force: Array) -> tuple[Array, Array]:
    """Ends of equal parts of a run (n + 1) [T], and the mean in each (n), of means of increments."""
    ends = np.linspace(times[0], times[-1], PARTS + 1)
    impulse = np.concatenate([[0.0], np.cumsum(force[1:]*np.diff(times))])
    return ends, np.diff(np.interp(ends, times, impulse))/np.diff(ends)


def read_load(file: FieldFile, history: NDArray[np.void]) -> Load | None:
    """Load against displacement; None where the file has not both, or supports bear nothing.

    Along the axis of the largest displacement on which there are forces; the load is the sum of the
    reactions that point to one side of it, of that side where it is larger: with what else pushes
    the body they balance.
    """
    if not {"displacement", "reaction_force"} <= set(file.point_fields):
        return None
    most = np.array([np.abs(file.point("displacement", k)).max(axis=0)
                     for k in range(len(file.times))])
    load = np.zeros(most.shape)
    for k in range(len(most)):
        reaction = np.nan_to_num(file.point("reaction_force", k))
        load[k] = np.maximum(np.sum(reaction, axis=0, where=reaction > 0.0),
                             -np.sum(reaction, axis=0, where=reaction < 0.0))
    work = float(np.nanmax(np.abs(history["external_work"])))
    bears = (load.max(axis=0) > ROUND_OFF*load.max()) & (
        load.max(axis=0)*most.max() > ROUND_OFF*work)
    if not bears.any():
        return None
    axis = int(np.argmax(np.where(bears, most.max(axis=0), -1.0)))
    return Load(most[:, axis], load[:, axis], "xyz"[axis])


def read_residuals(paths: ResultPaths) -> list[tuple[float, Array]]:
    """Time [T] and relative residuals of the last Newton solve of each increment, of the log."""
    found = (_INCREMENT.match(line) for line in _log(paths).splitlines())
    return [(float(line[1]), np.array(line[2].split(), dtype=float)) for line in found if line]


def _log(paths: ResultPaths) -> str:
    """The log; nothing where there is none."""
    try:
        return paths.log.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


# --- drawing -----------------------------------------------------------------------------------

def draw_energies(axes: Axes, history: NDArray[np.void]) -> None:
    """Energies and the work from outside, which counts as taken: their sum is the total."""
    axes.plot(history["time"], history["total"], color=BAND, linewidth=4.0, label="total",
              solid_capstyle="butt")
    curves = (("kinetic", history["kinetic"], BLUE, "-"), ("strain", history["strain"], ORANGE, "-"),
              ("less external work", -history["external_work"], BLACK, "--"))
    sizes = [float(np.nanmax(np.abs(values), initial=0.0)) for _, values, _, _ in curves]
    for (label, values, colour, style), size in zip(curves, sizes, strict=True):
        if size > SMALL*max(sizes):
            axes.plot(history["time"], values, style, color=colour, label=label)
    taken = asked_losses(history)
    if np.any(taken > 0.0):
        axes.plot(history["time"], taken, ":", color=BLACK, label="losses")
    axes.set_ylabel(f"energy {UNITS['energy']}")
    _show_zero(axes)
    _legend(axes)


def _legend(axes: Axes) -> None:
    """Above the axes, where no curve is, and no wider: in rows, and what they do not hold counted."""
    handles, labels = axes.get_legend_handles_labels()
    if not handles:
        return
    width = (1.0 - LEGEND_START)*axes.get_window_extent().width
    for columns in range(min(5, len(handles)), 0, -1):
        shown, room = len(handles), MOST_ROWS*columns
        if shown > room:
            shown = room - 1
        more = [f"and {len(handles) - shown} more"] if shown < len(handles) else []
        nothing = [Line2D([], [], linestyle="none")]*len(more)
        legend = axes.legend([*handles[:shown], *nothing], [*labels[:shown], *more],
                             loc="lower left", bbox_to_anchor=(LEGEND_START, 1.0), ncols=columns,
                             handlelength=1.1, columnspacing=0.8, handletextpad=0.3,
                             borderaxespad=0.1)
        if legend.get_window_extent().width <= width:
            return


def draw_drift(axes: Axes, history: NDArray[np.void]) -> None:
    drift, scale = energy_drift(history)
    at_start = abs(float(history["total"][0]))
    _draw_round_off(axes, history["time"], drift)
    axes.set_ylabel(r"energy drift $|E - E_0|/|E_0|$" if scale == at_start and scale > 0.0
                    else r"energy drift $|E - E_0|/E_{\max}$")


def _draw_round_off(axes: Axes, times: Array, change: Array) -> None:
    """A relative change that is to be round-off, over powers of ten."""
    axes.semilogy(times, np.maximum(change, DRIFT_FLOOR), color=BLACK, linewidth=0.8)
    epsilon = float(np.finfo(np.float64).eps)
    axes.axhline(epsilon, color=GREY, linewidth=0.6, linestyle="--", label="machine epsilon")
    _legend(axes)
    axes.set_ylim(DRIFT_FLOOR, max(1e-8, 30.0*float(np.nanmax(change, initial=0.0))))
    axes.yaxis.set_major_locator(LogLocator(10.0, numticks=7))
    axes.yaxis.set_minor_locator(NullLocator())


def draw_force(axes: Axes, force: Force) -> None:
    """A curve per pair; a bar over each contact at the mean of its force.

    Of many increments the curve is the mean over parts of the run, before the values of each in a
    pale tone.
    """
    axes.axhline(0.0, color=GREY, linewidth=0.5)
    has_mean = False
    is_many = force.has_means and len(force.times) > MOST_STEPS + 1
    for n, (name, values) in enumerate(force.curves.items()):
        colour = COLOURS[n % len(COLOURS)]
        line = LINE_STYLES[n//len(COLOURS) % len(LINE_STYLES)]
        surface, comma, axis = name.partition(", ")
        shown = (surface if len(surface) <= NAME_LENGTH else f"{surface[:NAME_LENGTH - 1]}…") \
            + comma + axis
        style = "steps-pre" if force.has_means or force.is_count else "default"
        axes.plot(force.times, values, line, color=colour, linewidth=0.5 if is_many else 0.8,
                  marker="o" if force.is_sampled else "", markersize=1.8, markeredgewidth=0.0,
                  alpha=0.3 if is_many else 1.0, label=None if is_many else shown or None,
                  drawstyle=style)
        if is_many:
            ends, parts = part_means(force.times, values)
            axes.stairs(parts, ends, baseline=None, color=colour, linewidth=0.9, label=shown,
                        linestyle=line)
        if force.has_means:
            is_alone = len(force.curves) == 1
            for k, (start, end, mean) in enumerate(means(force.times, values)):
                axes.plot([start, end], [mean, mean], color=ORANGE if is_alone else colour,
                          linewidth=2.2, solid_capstyle="butt", alpha=1.0 if is_alone else 0.6,
                          label="mean" if k == 0 and not has_mean else None)
                has_mean = True
    if force.n_smaller:
        axes.plot([], [], linestyle="none", label=f"{force.n_smaller} smaller")
    if force.is_count:
        axes.yaxis.set_major_locator(MaxNLocator(6, integer=True))
    axes.set_ylabel(force.label)
    if any(force.curves):
        _legend(axes)


def draw_momentum(axes: Axes, history: NDArray[np.void]) -> None:
    """Angular momentum about the origin, of a run without contact; its change where it is kept."""
    names = [name for name in "xyz" if f"l{name}" in (history.dtype.names or ())]
    angular = np.array([history[f"l{name}"] for name in names])
    size = float(np.linalg.norm(angular, axis=0).max(initial=0.0))
    change = np.linalg.norm(angular - angular[:, :1], axis=0)
    if size > 0.0 and change.max() < KEPT*size:
        _draw_round_off(axes, history["time"], change/size)
        axes.set_ylabel(r"momentum drift $|L - L_0|/|L|_{\max}$")
        return
    for name, values, colour in zip(names, angular, COLOURS[-len(names):] if len(names) > 1
                                    else COLOURS, strict=False):
        axes.plot(history["time"], values, color=colour, label=f"$L_{name}$")
    _show_zero(axes)
    axes.set_ylabel(f"angular momentum {UNITS['action']}")
    _legend(axes)


def _show_zero(axes: Axes) -> None:
    """Zero and, around the curves, some room are within the axis."""
    low, high = min(axes.dataLim.y0, 0.0), max(axes.dataLim.y1, 0.0)
    room = 0.06*(high - low)
    if room > 0.0:
        axes.set_ylim(low - room, high + room)


def draw_load(axes: Axes, load: Load) -> None:
    axes.plot(load.displacement, load.load, color=BLACK, marker="o", markersize=3.0,
              linewidth=0.9, clip_on=False)
    axes.set_xlim(0.0, None)
    axes.set_ylim(0.0, None)
    axes.set_xlabel(f"largest displacement, ${load.axis}$ [L]", labelpad=1)
    axes.set_ylabel(f"force of supports, ${load.axis}$ {UNITS['force']}")
    axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))


def draw_convergence(axes: Axes, solves: list[tuple[float, Array]]) -> None:
    """Residuals of the last solve of some increments, side by side, each below its time."""
    if len(solves) > MOST_SOLVES:
        chosen = np.unique(np.linspace(0, len(solves) - 1, MOST_SOLVES).round().astype(int))
        solves = [solves[k] for k in chosen]
    start, places = 1, []
    for _, residuals in solves:
        at = start + np.arange(len(residuals))
        axes.semilogy(at, np.maximum(residuals, DRIFT_FLOOR), color=BLACK, marker="o",
                      markersize=2.2, linewidth=0.8)
        places.append(float(at.mean()))
        start += len(residuals) + 1
    axes.set_xlim(0, start)
    axes.set_ylim(DRIFT_FLOOR, max([10.0, *(10.0*np.nanmax(found) for _, found in solves)]))
    axes.set_xticks(places, [f"{time:.3g}" for time, _ in solves])
    axes.tick_params(axis="x", length=0)
    axes.yaxis.set_major_locator(LogLocator(10.0, numticks=7))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_xlabel("iterations of the last solve at time $t$ [T]", labelpad=1)
    axes.set_ylabel("residual, relative")


def say(axes: Axes, text: str) -> None:
    """A panel without data says why."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=GREY)
    axes.set_xticks([])
    axes.set_yticks([])
