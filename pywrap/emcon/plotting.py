"""One picture of a run: the deformed bodies at six times, energies, drift, contact force."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator
from numpy.typing import NDArray

from .results import (Array, FieldFile, ResultError, ResultPaths, asked_losses, energy_drift,
                      locate, read_contact_force, read_history)
from .scene import (BLACK, BLUE, GREY, LABEL_OFFSET, ORANGE, STYLE, Scene, colour_scale,
                    draw_bodies, draw_colour_bar, fixed_scale, frame_view, read_scene)

N_TIMES = 6
#: Sizes on paper [inch].
WIDTH, LEFT, RIGHT, TOP, BOTTOM = 11.0, 0.62, 0.95, 0.30, 0.48
SCENE_GAP, PANEL_GAP, ROW_GAP, PANEL_HEIGHT = 0.07, 0.72, 0.86, 1.85
SCENE_HEIGHT = (1.0, 4.2)      # least, largest
RESOLUTION = 200               # dots per inch

#: Least drift drawn; an exact zero is drawn there.
DRIFT_FLOOR = 1e-17


def _choose_frames(file: FieldFile, times: Sequence[float] | None) -> list[int]:
    """Frames nearest to `times`, or to six evenly spaced times; each once, ascending."""
    if times is None:
        times = np.linspace(file.times[0], file.times[-1], N_TIMES).tolist()
    return sorted({file.frame_at(time) for time in times})


@dataclass(frozen=True)
class View:
    """What of the bodies a picture shows."""

    times: Sequence[float] | None = None          #: default six, evenly spaced [T]
    frame: int | None = None                      #: one frame of the file in place of times
    field: str = "von_mises"
    clim: tuple[float, float] | None = None       #: ends of the colours, default by the values

    def frames(self, file: FieldFile) -> list[int]:
        """Numbers of frames, ascending."""
        if self.frame is None:
            return _choose_frames(file, self.times)
        count = len(file.times)
        if self.times is not None:
            raise ResultError("give times or a frame, not both")
        if not -count <= self.frame < count:
            raise ResultError(f"there is no frame {self.frame}; the file has {count}, from 0 on")
        return [self.frame % count]


@dataclass
class _Force:
    """Vertical resultant of the contact force on the slave side; without values a note says why."""

    times: Array = field(default_factory=lambda: np.empty(0))    #: (n_time) [T]
    values: Array = field(default_factory=lambda: np.empty(0))   #: (n_time) [M L/T^2]
    is_sampled: bool = False                                     #: at frames, not increments
    note: str = ""


def _force_of_frames(file: FieldFile) -> _Force:
    """Sum of the field `contact_force` over the slave nodes: those that have a gap."""
    if "contact_force" not in file.point_fields:
        return _Force(note="no contact force in the result\n(asked for by *CONTACT FILE, CF)")
    if "contact_gap" not in file.point_fields:
        return _Force(note="no contact gap in the result, slave nodes not known\n"
                           "(asked for by *CONTACT FILE, CDIS)")
    values = np.empty(len(file.times))
    for k in range(len(values)):
        is_slave = np.isfinite(file.point("contact_gap", k))
        values[k] = file.point("contact_force", k)[is_slave, 1].sum()
    return _Force(file.times, values, is_sampled=True)


# --- drawing -----------------------------------------------------------------------------------

def _draw_scene(figure: Figure, scene: Scene, clim: tuple[float, float] | None) -> None:
    """Draw the upper row, and give the figure the height that it takes."""
    views = scene.views()
    n = max(len(views), 1)
    width = min((WIDTH - LEFT - RIGHT - SCENE_GAP*(n - 1))/n, SCENE_HEIGHT[1]*1.5)
    height = float(np.clip(width*(views[0][3] - views[0][2])/(views[0][1] - views[0][0]),
                           *SCENE_HEIGHT))
    total = TOP + height + ROW_GAP + PANEL_HEIGHT + BOTTOM
    figure.set_size_inches(WIDTH, total)
    base = total - TOP - height

    scale = colour_scale(scene) if clim is None else fixed_scale(scene, *clim)
    for k, view in enumerate(views):
        x = LEFT + k*(width + SCENE_GAP)
        axes = figure.add_axes((x/WIDTH, base/total, width/WIDTH, height/total))
        draw_bodies(axes, scene, k, view, width, scale)
        frame_view(axes, scene, view, width, height, is_first=k == 0)
        axes.set_title(f"$t = {scene.times[k]:.4g}$", fontsize=10, pad=4)
    if scene.values is not None:
        draw_colour_bar(figure, ((LEFT + n*width + (n - 1)*SCENE_GAP + 0.14)/WIDTH, base/total,
                                 0.11/WIDTH, height/total), scene, scale)


def _draw_energies(axes: Axes, history: NDArray[np.void]) -> None:
    for name, label, colour, style in (
            ("total", "total", BLACK, "-"), ("kinetic", "kinetic", BLUE, "-"),
            ("strain", "strain", ORANGE, "-"), ("external_work", "external work", GREY, "--")):
        axes.plot(history["time"], history[name], style, color=colour, label=label)
    taken = asked_losses(history)
    if np.any(taken > 0.0):
        axes.plot(history["time"], taken, ":", color=BLACK, label="losses")
    axes.set_ylabel("energy")
    _legend(axes)


def _legend(axes: Axes) -> None:
    """Above the axes, where no curve is."""
    axes.legend(loc="lower left", bbox_to_anchor=(-0.02, 1.0), ncols=5, handlelength=1.3,
                columnspacing=1.0, handletextpad=0.4, borderaxespad=0.1)


def _draw_drift(axes: Axes, history: NDArray[np.void]) -> None:
    drift, scale = energy_drift(history)
    at_start = abs(float(history["total"][0]))
    axes.semilogy(history["time"], np.maximum(drift, DRIFT_FLOOR), color=BLACK, linewidth=0.8)
    epsilon = float(np.finfo(np.float64).eps)
    axes.axhline(epsilon, color=GREY, linewidth=0.6, linestyle="--", label="machine epsilon")
    _legend(axes)
    top = float(np.nanmax(drift, initial=0.0))
    axes.set_ylim(DRIFT_FLOOR, max(1e-8, 30.0*top))
    axes.yaxis.set_major_locator(LogLocator(10.0, numticks=7))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_ylabel(r"energy drift $|E - E_0|/|E_0|$" if scale == at_start and scale > 0.0
                    else r"energy drift $|E - E_0|/E_{\max}$")


def _draw_force(axes: Axes, force: _Force) -> None:
    axes.axhline(0.0, color=GREY, linewidth=0.5)
    axes.plot(force.times, force.values, color=BLACK, linewidth=0.8,
              marker="o" if force.is_sampled else "", markersize=1.8, markeredgewidth=0.0)
    axes.set_ylabel("contact force, vertical")


def _say(axes: Axes, text: str) -> None:
    """A panel without data says why."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=GREY)
    axes.set_xticks([])
    axes.set_yticks([])


def draw(paths: ResultPaths, view: View = View()) -> tuple[Figure, list[str]]:
    """The picture of a run as a matplotlib figure, and notes on what is missing in it."""
    notes: list[str] = []
    scene, history = None, None
    force = _Force(note=f"no field file\n{paths.field.name}")
    if paths.field.is_file():
        with FieldFile(paths.field) as file:
            scene = read_scene(file, view.frames(file), view.field)
            force = _force_of_frames(file)
        notes += scene.notes
    else:
        notes.append(f"no field file {paths.field}: bodies are not shown")
    by_increment = read_contact_force(paths)
    if by_increment is not None:
        force = _Force(by_increment[0], by_increment[1][:, 1])
    if force.note:
        notes.append(force.note.replace("\n", " "))
    if paths.table.is_file() or paths.history.is_file():
        history = read_history(paths)
    else:
        notes.append(f"no history {paths.table}: energies are not shown")

    with matplotlib.rc_context(STYLE):
        figure = Figure()
        if scene is not None:
            _draw_scene(figure, scene, view.clim)
        else:
            figure.set_size_inches(WIDTH, TOP + PANEL_HEIGHT + BOTTOM)
        _draw_panels(figure, history, force, scene.times if scene is not None else [])
    return figure, notes


def _draw_panels(figure: Figure, history: NDArray[np.void] | None, force: _Force,
                 marks: list[float]) -> None:
    """The lower row: energies, drift, contact force over one time axis; lines at `marks`."""
    panels = _add_panels(figure)
    times = force.times
    if history is not None:
        times = history["time"]
        _draw_energies(panels[0], history)
        _draw_drift(panels[1], history)
    else:
        _say(panels[0], "no history")
        _say(panels[1], "no history")
    if force.values.size:
        _draw_force(panels[2], force)
    else:
        _say(panels[2], force.note)
    for axes in panels:
        if not axes.lines:
            continue
        if times[-1] > times[0]:
            axes.set_xlim(times[0], times[-1])
        axes.xaxis.set_major_locator(MaxNLocator(8, steps=[1, 2, 5, 10]))
        axes.set_xlabel("time $t$", labelpad=1)
        for mark in marks:
            axes.axvline(mark, color="#e4e4e4", linewidth=0.6, zorder=0)
    panels[0].yaxis.set_label_coords(-LABEL_OFFSET/_panel_width(), 0.5)


def _panel_width() -> float:
    return (WIDTH - LEFT - 0.25 - 2*PANEL_GAP)/3.0


def _add_panels(figure: Figure) -> list[Axes]:
    """Three panels side by side at the foot of the figure."""
    total = figure.get_size_inches()[1]
    width = _panel_width()
    return [figure.add_axes(((LEFT + k*(width + PANEL_GAP))/WIDTH, BOTTOM/total, width/WIDTH,
                             PANEL_HEIGHT/total)) for k in range(3)]


def plot(result: str | os.PathLike[str], output: str | os.PathLike[str] | None = None,
         times: Sequence[float] | None = None, *, frame: int | None = None,
         field: str = "von_mises", clim: tuple[float, float] | None = None) -> Path:
    """Draw a run: bodies at some times, energies, drift, contact force; returns the picture's path.

    result   base name of the run, or any one of its files
    output   file to write, its suffix tells the format; default NAME.png
    times    of the bodies that are shown [T]
    frame    a frame of the field file in place of times, from 0 on; -1 is the last
    field    point or cell field that gives the colours; of a vector its length
    clim     values at the ends of the colours; default from 0, or the lowest, to the highest

    Raises `ResultError` for a result that cannot be drawn, a field or frame that is not there or a
    format that is not known, `OSError` where the file cannot be written.
    """
    view = View(times, frame, field, clim)
    return write_picture(locate(result), None if output is None else Path(output), view)[0]


def write_picture(paths: ResultPaths, output: Path | None = None,
                  view: View = View()) -> tuple[Path, list[str]]:
    """As `plot`; returns the path and notes on what is missing or left out."""
    output = paths.picture if output is None else output
    kind = output.suffix[1:].lower()
    known = sorted(Figure().canvas.get_supported_filetypes())
    if kind not in known:
        raise ResultError(f"{output}: '{output.suffix}' is not a picture format; "
                          f"known are {', '.join(known)}")
    figure, notes = draw(paths, view)
    with matplotlib.rc_context(STYLE):
        figure.savefig(output, dpi=RESOLUTION)
    return output, notes
