"""One picture of a run: the deformed bodies at six times, energies, drift, contact force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator
from numpy.typing import NDArray

from .results import (Array, FieldFile, ResultError, ResultPaths, energy_drift, read_contact_force,
                      read_history)

N_TIMES = 6
#: Sizes on paper [inch].
WIDTH, LEFT, RIGHT, TOP, BOTTOM = 11.0, 0.62, 0.95, 0.30, 0.48
SCENE_GAP, PANEL_GAP, ROW_GAP, PANEL_HEIGHT = 0.07, 0.72, 0.86, 1.85
LABEL_OFFSET = 0.36            # of the y labels at the left
SCENE_HEIGHT = (1.0, 4.2)      # least, largest
RESOLUTION = 200               # dots per inch

#: A body that moves less than this fraction of the largest displacement counts as support.
SUPPORT_FRACTION = 0.1
#: Room around the moving bodies, as a fraction of their extent; room for the supports below.
MARGIN, SUPPORT_ROOM = 0.06, 0.30
#: The view follows the bodies where their whole path is this much longer than they are.
FOLLOW_RATIO = 1.25
#: The colour scale ends where all but this fraction of the elements that move are below.
COLOUR_CUT = 0.01
#: Least drift drawn; an exact zero is drawn there.
DRIFT_FLOOR = 1e-17

STYLE: dict[Any, Any] = {"font.family": "STIXGeneral", "mathtext.fontset": "stix", "font.size": 10,
         "axes.linewidth": 0.6, "axes.spines.top": False, "axes.spines.right": False,
         "axes.labelsize": 10, "xtick.labelsize": 9, "ytick.labelsize": 9,
         "xtick.direction": "in", "ytick.direction": "in", "xtick.major.width": 0.6,
         "ytick.major.width": 0.6, "legend.frameon": False, "legend.fontsize": 9,
         "lines.linewidth": 1.1, "svg.hashsalt": "emcon", "pdf.fonttype": 42}
BLACK, BLUE, ORANGE, GREY = "#1a1a1a", "#1f5fa8", "#d1660f", "#8a8a8a"


def _stress_colours() -> LinearSegmentedColormap:
    """Pale to dark, equal steps in lightness; pale enough that unloaded bodies recede."""
    colours = matplotlib.colormaps["magma_r"](np.linspace(0.03, 0.86, 256))
    colours[:48, :3] += (1.0 - np.linspace(0.0, 1.0, 48)[:, None])*(0.96 - colours[:48, :3])
    return LinearSegmentedColormap.from_list("stress", colours)


@dataclass
class _Scene:
    """What the upper row shows: per frame positions (n_node, 2) and element stress, the views."""

    times: list[float]
    position: list[Array]
    stress: list[Array] | None      #: each (n_element) von Mises [M/(L T^2)]
    cells: list[NDArray[np.int64]]
    is_support: NDArray[np.bool_]   #: per node
    notes: list[str] = field(default_factory=list)

    def views(self) -> list[tuple[float, float, float, float]]:
        """(x_min, x_max, y_min, y_max) [L] per frame; all of one size and one y range."""
        boxes = np.array([_extent(p[~self.is_support]) for p in self.position])
        y_min, y_max = float(boxes[:, 2].min()), float(boxes[:, 3].max())
        margin = MARGIN*(y_max - y_min)
        if self.is_support.any():
            room = SUPPORT_ROOM*float(np.max(boxes[:, 3] - boxes[:, 2]))
            _, _, low, high = _extent(np.concatenate(self.position))
            y_low, y_high = max(low, y_min - room), min(high, y_max + room)
        else:
            y_low, y_high = y_min, y_max
        # no margin where a support is cut: it goes on beyond the frame
        y_low = y_low if y_low < y_min else y_min - margin
        y_high = y_high if y_high > y_max else y_max + margin
        return [(x0, x1, y_low, y_high) for x0, x1 in _windows(boxes[:, 0], boxes[:, 1])]

    def moves(self) -> NDArray[np.bool_]:
        """Per element: part of a body that moves."""
        return np.array([not self.is_support[cell[0]] for cell in self.cells])


def _extent(points: Array) -> tuple[float, float, float, float]:
    low, high = points.min(axis=0), points.max(axis=0)
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def _windows(low: Array, high: Array) -> list[tuple[float, float]]:
    """Intervals of one length that hold [low, high] of each frame, with margin.

    They are one and the same unless the way is long: then they follow.
    """
    length = float(np.max(high - low))
    centre = 0.5*(low + high)
    path = float(high.max() - low.min())
    if path <= FOLLOW_RATIO*length:
        length = path
        centre = np.full(len(low), 0.5*float(low.min() + high.max()))
    half = 0.5*length*(1.0 + 2.0*MARGIN)
    return [(float(c) - half, float(c) + half) for c in centre]


def _choose_frames(file: FieldFile, times: Sequence[float] | None) -> list[int]:
    """Frames nearest to `times`, or to six evenly spaced times; each once, ascending."""
    if times is None:
        times = np.linspace(file.times[0], file.times[-1], N_TIMES).tolist()
    else:
        slack = 0.5*float(np.max(np.diff(file.times), initial=0.0))
        for time in times:
            if not file.times[0] - slack <= time <= file.times[-1] + slack:
                raise ResultError(f"no frame near time {time:g}; {file.path} runs from "
                                  f"{file.times[0]:g} to {file.times[-1]:g}")
    return sorted({file.nearest_frame(time) for time in times})


def _von_mises(file: FieldFile, frame: int) -> Array | None:
    """Von Mises stress per node (n_node) [M/(L T^2)], or None if the file has no stress."""
    if "von_mises" in file.point_fields:
        return file.point("von_mises", frame)
    if "cauchy_stress" not in file.point_fields:
        return None
    xx, yy, zz, xy, yz, xz = file.point("cauchy_stress", frame).T
    square: Array = (0.5*((xx - yy)**2 + (yy - zz)**2 + (zz - xx)**2)
                     + 3.0*(xy**2 + yz**2 + xz**2))
    return np.sqrt(square)


def _read_scene(file: FieldFile, times: Sequence[float] | None) -> _Scene:
    if np.ptp(file.points[:, 2]) > 0.0:
        raise ResultError(f"{file.path} is three-dimensional; open it in ParaView")
    notes = []
    frames = _choose_frames(file, times)
    if "displacement" in file.point_fields:
        shift = [file.point("displacement", k)[:, :2] for k in frames]
    else:
        notes.append("no displacement in the result (asked for by *NODE FILE, U): bodies shown "
                     "undeformed")
        frames = frames[:1]
        shift = [np.zeros((len(file.points), 2))]
    stress = []
    for k in frames:
        nodal = _von_mises(file, k)
        if nodal is not None:
            stress.append(np.array([nodal[cell].mean() for cell in file.cells]))
    if not stress:
        notes.append("no stress in the result (asked for by *EL FILE, S): bodies shown in grey")

    body = file.bodies()
    travel = np.max([np.hypot(u[:, 0], u[:, 1]) for u in shift], axis=0)
    most = np.array([np.max(travel[body == b], initial=0.0) for b in range(body.max() + 1)])
    support = most < SUPPORT_FRACTION*most.max()
    return _Scene(times=[float(file.times[k]) for k in frames],
                  position=[file.points[:, :2] + u for u in shift],
                  stress=stress or None, cells=file.cells,
                  is_support=(body < 0) | support[body], notes=notes)


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

def _draw_scene(figure: Figure, scene: _Scene) -> None:
    """Draw the upper row, and give the figure the height that it takes."""
    views = scene.views()
    n = max(len(views), 1)
    width = min((WIDTH - LEFT - RIGHT - SCENE_GAP*(n - 1))/n, SCENE_HEIGHT[1]*1.5)
    height = float(np.clip(width*(views[0][3] - views[0][2])/(views[0][1] - views[0][0]),
                           *SCENE_HEIGHT))
    total = TOP + height + ROW_GAP + PANEL_HEIGHT + BOTTOM
    figure.set_size_inches(WIDTH, total)
    base = total - TOP - height

    norm = Normalize(0.0, 1.0)
    clipped = False
    if scene.stress is not None:
        norm, clipped = _stress_scale(scene.stress, scene.moves())
    colours = _stress_colours()

    for k, view in enumerate(views):
        x = LEFT + k*(width + SCENE_GAP)
        axes = figure.add_axes((x/WIDTH, base/total, width/WIDTH, height/total))
        elements = PolyCollection([scene.position[k][cell] for cell in scene.cells],
                                  edgecolors=(0.1, 0.1, 0.1, 0.55),
                                  linewidths=_edge_width(scene, view, width))
        if scene.stress is not None:
            elements.set(array=scene.stress[k], norm=norm, cmap=colours)
        else:
            elements.set_facecolor("#dddddd")
        axes.add_collection(elements)
        _frame_view(axes, view, width, height, is_first=k == 0)
        axes.set_title(f"$t = {scene.times[k]:.4g}$", fontsize=10, pad=4)

    if scene.stress is not None:
        bar = figure.add_axes(((LEFT + n*width + (n - 1)*SCENE_GAP + 0.14)/WIDTH, base/total,
                               0.11/WIDTH, height/total))
        mappable = matplotlib.cm.ScalarMappable(norm, colours)
        colour_bar = figure.colorbar(mappable, cax=bar, extend="max" if clipped else "neither",
                                     extendfrac=0.04)
        colour_bar.set_label("von Mises stress")
        colour_bar.outline.set_linewidth(0.5)
        bar.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
        bar.tick_params(direction="in", width=0.5)


def _stress_scale(stress: list[Array], moves: NDArray[np.bool_]) -> tuple[Normalize, bool]:
    """Colour scale from zero to the highest stress in what moves, and whether some is above."""
    top = 0.0
    chosen = np.concatenate([s[moves] for s in stress])
    if np.isfinite(chosen).any():
        top = float(np.quantile(chosen[np.isfinite(chosen)], 1.0 - COLOUR_CUT))
    highest = float(np.nanmax(np.concatenate(stress), initial=0.0))
    return Normalize(0.0, top if top > 0.0 else 1.0), highest > 1.02*top > 0.0


def _edge_width(scene: _Scene, view: tuple[float, float, float, float], width: float) -> float:
    """Line width [point]: thin against the smallest elements as printed."""
    side = min(float(np.ptp(scene.position[0][cell], axis=0).max()) for cell in scene.cells)
    return float(np.clip(0.04*side/(view[1] - view[0])*width*72.0, 0.05, 0.35))


def _frame_view(axes: Axes, view: tuple[float, float, float, float], width: float,
                height: float, is_first: bool) -> None:
    """Limits, widened where the panel is larger than the view so that the scale stays true."""
    x_min, x_max, y_min, y_max = view
    scale = max((x_max - x_min)/width, (y_max - y_min)/height)
    x_pad, y_pad = 0.5*(scale*width - (x_max - x_min)), 0.5*(scale*height - (y_max - y_min))
    axes.set_xlim(x_min - x_pad, x_max + x_pad)
    axes.set_ylim(y_min - y_pad, y_max + y_pad)
    axes.set_aspect("equal", adjustable="box")
    for spine in axes.spines.values():
        spine.set(visible=True, linewidth=0.4, color=GREY)
    axes.xaxis.set_major_locator(MaxNLocator(3, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    axes.tick_params(width=0.4, length=2.5)
    axes.set_xlabel("$x$", labelpad=1)
    if is_first:
        axes.set_ylabel("$y$")
        axes.yaxis.set_label_coords(-LABEL_OFFSET/width, 0.5)
    else:
        axes.tick_params(labelleft=False)


def _draw_energies(axes: Axes, history: NDArray[np.void]) -> None:
    for name, label, colour, style in (
            ("total", "total", BLACK, "-"), ("kinetic", "kinetic", BLUE, "-"),
            ("strain", "strain", ORANGE, "-"), ("external_work", "external work", GREY, "--")):
        axes.plot(history["time"], history[name], style, color=colour, label=label)
    axes.set_ylabel("energy")
    axes.legend(loc="lower left", bbox_to_anchor=(-0.02, 1.0), ncols=4, handlelength=1.3,
                columnspacing=1.0, handletextpad=0.4, borderaxespad=0.1)


def _draw_drift(axes: Axes, history: NDArray[np.void]) -> None:
    drift, scale = energy_drift(history)
    at_start = abs(float(history["total"][0]))
    axes.semilogy(history["time"], np.maximum(drift, DRIFT_FLOOR), color=BLACK, linewidth=0.8)
    epsilon = float(np.finfo(np.float64).eps)
    axes.axhline(epsilon, color=GREY, linewidth=0.6, linestyle="--")
    axes.annotate("machine epsilon", (1.0, epsilon), xycoords=("axes fraction", "data"),
                  xytext=(-2, 2), textcoords="offset points", ha="right", color=GREY, fontsize=8)
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


def draw(paths: ResultPaths, times: Sequence[float] | None = None) -> tuple[Figure, list[str]]:
    """The picture of a run as a matplotlib figure, and notes on what is missing in it.

    times   wanted times of the upper row [T]; default six, evenly spaced over the run
    """
    notes: list[str] = []
    scene, history = None, None
    force = _Force(note=f"no field file\n{paths.field.name}")
    if paths.field.is_file():
        with FieldFile(paths.field) as file:
            scene = _read_scene(file, times)
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
            _draw_scene(figure, scene)
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


def write_picture(paths: ResultPaths, output: Path | None = None,
                  times: Sequence[float] | None = None) -> tuple[Path, list[str]]:
    """Draw the run and write the picture (`output`, default NAME.png); returns it and the notes.

    Raises `ResultError` for a result that cannot be drawn or a format that is not known, `OSError`
    where the file cannot be written.
    """
    output = paths.picture if output is None else output
    kind = output.suffix[1:].lower()
    known = sorted(Figure().canvas.get_supported_filetypes())
    if kind not in known:
        raise ResultError(f"{output}: '{output.suffix}' is not a picture format; "
                          f"known are {', '.join(known)}")
    figure, notes = draw(paths, times)
    with matplotlib.rc_context(STYLE):
        figure.savefig(output, dpi=RESOLUTION)
    return output, notes
