"""One picture of a run: the deformed bodies at six times, and three panels (`panels.py`)."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from .drawing import (LABEL_OFFSET, DrawnBodies, colour_scale, draw_colour_bar, fixed_scale,
                      frame_view, scale_axes, titles)
from .panels import (Force, Load, draw_convergence, draw_drift, draw_energies, draw_force,
                     draw_load, draw_momentum, is_static, read_force, read_load, read_residuals,
                     say)
from .results import Array, FieldFile, ResultError, ResultPaths, locate, read_history
from .scene import STYLE, Scene, read_scene

N_TIMES = 6
#: Sizes on paper [inch].
WIDTH, LEFT, RIGHT, TOP, BOTTOM = 11.0, 0.62, 1.0, 0.30, 0.48
MARGIN = 0.25                  # at the right, where nothing stands
SCENE_GAP, PANEL_GAP, PANEL_HEIGHT = 0.07, 0.72, 1.85
ROW_GAP, BARE_ROW_GAP = 0.98, 0.70   # below frames with numbers; below those of space
LEGEND_TOP = 0.62              # above panels without bodies
SCENE_HEIGHT = (1.0, 4.2)      # least, largest
RESOLUTION = 200               # dots per inch


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


# --- drawing -----------------------------------------------------------------------------------

def _draw_scene(figure: Figure, scene: Scene, clim: tuple[float, float] | None) -> None:
    """Draw the upper row, and give the figure the height that it takes."""
    views = scene.views()
    n = max(len(views), 1)
    right = RIGHT if scene.values is not None else MARGIN
    width = min((WIDTH - LEFT - right - SCENE_GAP*(n - 1))/n, SCENE_HEIGHT[1]*1.5)
    height = float(np.clip(width*(views[0][3] - views[0][2])/(views[0][1] - views[0][0]),
                           *SCENE_HEIGHT))
    gap = ROW_GAP if scene.order is None else BARE_ROW_GAP
    total = TOP + height + gap + PANEL_HEIGHT + BOTTOM
    figure.set_size_inches(WIDTH, total)
    base = total - TOP - height

    scale = colour_scale(scene) if clim is None else fixed_scale(scene, *clim)
    for k, (view, title) in enumerate(zip(views, titles(scene.times), strict=True)):
        x = LEFT + k*(width + SCENE_GAP)
        axes = figure.add_axes((x/WIDTH, base/total, width/WIDTH, height/total))
        DrawnBodies(axes, scene, k, view, width, scale)
        frame_view(axes, scene, view, width, height, is_first=k == 0)
        axes.set_title(title, fontsize=10, pad=4)
    if scene.values is not None:
        draw_colour_bar(figure, ((LEFT + n*width + (n - 1)*SCENE_GAP + 0.14)/WIDTH, base/total,
                                 0.11/WIDTH, height/total), scene, scale)


def draw(paths: ResultPaths, view: View = View()) -> tuple[Figure, list[str]]:
    """The picture of a run as a matplotlib figure, and notes on what is missing in it."""
    notes: list[str] = []
    scene, history, load = None, None, None
    if paths.table.is_file() or paths.history.is_file():
        history = read_history(paths)
    if paths.field.is_file():
        with FieldFile(paths.field) as file:
            scene = read_scene(file, view.frames(file), view.field)
            force = read_force(paths, file, history)
            if history is not None and is_static(history):
                load = read_load(file, history)
        notes += scene.notes
    else:
        notes.append(f"no field file {paths.field}: bodies are not shown")
        force = read_force(paths, None, history)
    if history is None:
        notes.append(f"no history {paths.table}: energies are not shown")
    marks = scene.times if scene is not None else []

    with matplotlib.rc_context(STYLE):
        figure = Figure()
        if scene is not None:
            _draw_scene(figure, scene, view.clim)
        else:
            figure.set_size_inches(WIDTH, LEGEND_TOP + PANEL_HEIGHT + BOTTOM)
        panels = _add_panels(figure)
        if history is not None and is_static(history):
            _draw_statics(panels, history, force, load, read_residuals(paths))
        else:
            notes += _draw_dynamics(panels, history, force)
        for axes in panels:
            _finish(axes, force.times if history is None else history["time"], marks)
        panels[0].yaxis.set_label_coords(-LABEL_OFFSET/_panel_width(), 0.5)
    return figure, notes


def _draw_dynamics(panels: list[Axes], history: NDArray[np.void] | None,
                   force: Force) -> list[str]:
    """Energies, drift, contact force; returns what is missing."""
    if history is not None:
        draw_energies(panels[0], history)
        draw_drift(panels[1], history)
    else:
        say(panels[0], "no history")
        say(panels[1], "no history")
    if force.curves:
        draw_force(panels[2], force)
    elif history is not None and not force.note:
        draw_momentum(panels[2], history)
    else:
        say(panels[2], force.note)
        return [force.note.replace("\n", " ")]
    return []


def _draw_statics(panels: list[Axes], history: NDArray[np.void], force: Force, load: Load | None,
                  solves: list[tuple[float, Array]]) -> None:
    """Load against displacement, convergence, contact force; energies where one is not there."""
    missing = []
    if load is not None:
        draw_load(panels[0], load)
    else:
        missing.append((panels[0], "supports bear no load, or the result\nhas no reactions (*NODE FILE, RF)"))
    if solves:
        draw_convergence(panels[1], solves)
    else:
        missing.append((panels[1], "no log"))
    if force.curves:
        draw_force(panels[2], force)
    else:
        missing.append((panels[2], force.note))
    for axes, why in missing[:-1]:
        say(axes, why)
    if missing:
        draw_energies(missing[-1][0], history)


def _finish(axes: Axes, times: Array, marks: list[float]) -> None:
    """A panel over time gets its axis, and lines at the times `marks` that are shown above."""
    if not axes.lines:
        return
    if not axes.get_xlabel():
        if times[-1] > times[0]:
            axes.set_xlim(times[0], times[-1])
        axes.xaxis.set_major_locator(MaxNLocator(8, steps=[1, 2, 5, 10]))
        axes.set_xlabel("time $t$ [T]", labelpad=1)
        for mark in marks:
            axes.axvline(mark, color="#e4e4e4", linewidth=0.6, zorder=0)
    scale_axes(axes)


def _panel_width() -> float:
    return (WIDTH - LEFT - MARGIN - 2*PANEL_GAP)/3.0


def _add_panels(figure: Figure) -> list[Axes]:
    """Three panels side by side at the foot of the figure."""
    total = figure.get_size_inches()[1]
    width = _panel_width()
    return [figure.add_axes(((LEFT + k*(width + PANEL_GAP))/WIDTH, BOTTOM/total, width/WIDTH,
                             PANEL_HEIGHT/total)) for k in range(3)]


def plot(result: str | os.PathLike[str], output: str | os.PathLike[str] | None = None,
         times: Sequence[float] | None = None, *, frame: int | None = None,
         field: str = "von_mises", clim: tuple[float, float] | None = None) -> Figure:
    """Draw a run: bodies at some times, energies, drift, contact forces, of statics load and
    convergence; writes the picture and returns it as a figure of matplotlib, which notebooks show.

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
                  view: View = View()) -> tuple[Figure, Path, list[str]]:
    """As `plot`; returns the figure, its path, and notes on what is missing or left out."""
    output = paths.picture if output is None else output
    kind = output.suffix[1:].lower()
    known = sorted(Figure().canvas.get_supported_filetypes())
    if kind not in known:
        raise ResultError(f"{output}: '{output.suffix}' is not a picture format; "
                          f"known are {', '.join(known)}")
    figure, notes = draw(paths, view)
    with matplotlib.rc_context(STYLE):
        figure.savefig(output, dpi=RESOLUTION)
    return figure, output, notes
