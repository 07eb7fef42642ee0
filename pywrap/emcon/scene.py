"""The deformed bodies at some frames, coloured by a field: read, and drawn into axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, ScalarFormatter
from numpy.typing import NDArray

from .projection import SOLIDS, basis, far_first, outer_faces, project
from .results import Array, FieldFile, ResultError

#: A body that moves less than this fraction of the largest displacement counts as support.
SUPPORT_FRACTION = 0.1
#: Room around the moving bodies, as a fraction of their extent; room for the supports below.
MARGIN, SUPPORT_ROOM = 0.06, 0.30
#: The view follows the bodies where their whole path is this much longer than they are.
FOLLOW_RATIO = 1.25
#: The colour scale ends where all but this fraction of the elements that move are below.
COLOUR_CUT = 0.01
#: Distance of the y labels from the axes at the left [inch].
LABEL_OFFSET = 0.43
#: Length of the axes that tell directions [inch].
DIRECTION_LENGTH = 0.16

STYLE: dict[Any, Any] = {"font.family": "STIXGeneral", "mathtext.fontset": "stix", "font.size": 10,
         "axes.linewidth": 0.6, "axes.spines.top": False, "axes.spines.right": False,
         "axes.labelsize": 10, "xtick.labelsize": 9, "ytick.labelsize": 9,
         "xtick.direction": "in", "ytick.direction": "in", "xtick.major.width": 0.6,
         "ytick.major.width": 0.6, "legend.frameon": False, "legend.fontsize": 9,
         "lines.linewidth": 1.1, "svg.hashsalt": "emcon", "pdf.fonttype": 42}
BLACK, BLUE, ORANGE, GREY = "#1a1a1a", "#1f5fa8", "#d1660f", "#8a8a8a"

#: Consistent units, as powers of length, mass and time.
UNITS = {"length": "[L]", "time": "[T]", "energy": "[M L$^2$/T$^2$]",
         "force": "[M L/T$^2$]", "stress": "[M/(L T$^2$)]", "velocity": "[L/T]",
         "action": "[M L$^2$/T]"}
#: Of the fields that the program writes.
FIELD_UNITS = {"von_mises": "stress", "cauchy_stress": "stress", "contact_pressure": "stress",
               "contact_shear": "stress", "displacement": "length", "contact_gap": "length",
               "contact_slip": "length", "velocity": "velocity", "strain_energy": "energy",
               "contact_force": "force", "reaction_force": "force"}

#: (x_min, x_max, y_min, y_max) [L]
View = tuple[float, float, float, float]


@dataclass
class Scene:
    """Some frames: positions (n_node, 2) and colour values per polygon, and the views.

    In the plane polygons are the elements, in three dimensions the outer faces, which lie in front
    of each other.
    """

    times: list[float]
    position: list[Array]
    values: list[Array] | None      #: each (n_polygon), units of the field
    label: str                      #: what they are
    cells: list[NDArray[np.int64]]  #: nodes of the polygons
    is_support: NDArray[np.bool_]   #: per node
    #: Of three dimensions: numbers of the polygons, the farthest first, per frame.
    order: list[NDArray[np.int64]] | None = None
    notes: list[str] = field(default_factory=list)

    def views(self) -> list[View]:
        """Views [L] per frame; all of one size and one y range."""
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
        """Per polygon: part of a body that moves."""
        return np.array([not self.is_support[cell[0]] for cell in self.cells])

    def polygons(self, frame: int) -> list[Array]:
        """Corners (3 or more, 2) of each polygon [L], as they are drawn one over the other."""
        order = range(len(self.cells)) if self.order is None else self.order[frame]
        return [self.position[frame][self.cells[k]] for k in order]

    def colours(self, frame: int) -> Array | None:
        """Values of `polygons` (n_polygon), units of the field; None: there are none."""
        if self.values is None or self.order is None:
            return None if self.values is None else self.values[frame]
        return self.values[frame][self.order[frame]]


def _extent(points: Array) -> View:
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


# --- reading -----------------------------------------------------------------------------------

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


def _colour_values(file: FieldFile, name: str, frame: int) -> Array | None:
    """A field per element (n_element): mean over its nodes; of vectors the length."""
    nodal = _von_mises(file, frame) if name == "von_mises" else None
    if name == "von_mises" and nodal is None:
        return None
    if nodal is None:
        values = file[name][frame]
        if values.ndim > 1:
            values = np.sqrt((values**2).sum(axis=1))
        if name not in file.point_fields:
            return values
        nodal = values
    return np.array([nodal[cell].mean() for cell in file.cells])


def read_scene(file: FieldFile, frames: Sequence[int], name: str = "von_mises") -> Scene:
    """The bodies at some frames, coloured by the point or cell field `name`.

    Raises `ResultError` for a field that is not there and for shells in space; a missing stress or
    displacement is a note.
    """
    notes = []
    if "displacement" in file.point_fields:
        place = [file.points + file.point("displacement", k) for k in frames]
    else:
        notes.append("no displacement in the result (asked for by *NODE FILE, U): bodies shown "
                     "undeformed")
        frames = frames[:1]
        place = [file.points]
    values = [v for v in (_colour_values(file, name, k) for k in frames) if v is not None]
    if not values:
        notes.append("no stress in the result (asked for by *EL FILE, S): bodies shown in grey")

    body = file.bodies()
    travel = np.max([np.linalg.norm(p - file.points, axis=1) for p in place], axis=0)
    most = np.array([np.max(travel[body == b], initial=0.0) for b in range(body.max() + 1)])
    support = most < SUPPORT_FRACTION*most.max()
    label = "von Mises stress" if name == "von_mises" else name.replace("_", " ")
    if name in FIELD_UNITS:
        label = f"{label}\n{UNITS[FIELD_UNITS[name]]}"
    scene = Scene(times=[float(file.times[k]) for k in frames], position=[p[:, :2] for p in place],
                  values=values or None, label=label, cells=file.cells,
                  is_support=(body < 0) | support[body], notes=notes)
    if np.ptp(file.points[:, 2]) > 0.0:
        if not np.isin(file.types, SOLIDS).all():
            raise ResultError(f"{file.path} is three-dimensional, and not of tetrahedra and "
                              "hexahedra alone; open it in ParaView")
        _see(scene, place)
    return scene


def _see(scene: Scene, place: Sequence[Array]) -> None:
    """Put a scene of three dimensions on paper; `place` has the nodes (n_node, 3) per frame [L]."""
    scene.cells, cell_of = outer_faces(scene.cells)
    if scene.values is not None:
        scene.values = [values[cell_of] for values in scene.values]
    seen = [project(points) for points in place]
    scene.position = [on_paper for on_paper, _ in seen]
    scene.order = [far_first(scene.cells, near) for _, near in seen]


# --- drawing -----------------------------------------------------------------------------------

@dataclass
class ColourScale:
    """Colours of the values of a scene; `extend` says at which ends some are beyond."""

    norm: Normalize
    colours: LinearSegmentedColormap
    extend: str


def fixed_scale(scene: Scene, low: float, top: float) -> ColourScale:
    """Between two values; raises `ResultError` where they are none."""
    if not (np.isfinite([low, top]).all() and low < top):
        raise ResultError(f"colours go from a value to a larger one, not from {low:g} to {top:g}")
    every = np.concatenate(scene.values) if scene.values else np.zeros(1)
    above, below = bool(np.nanmax(every) > top), bool(np.nanmin(every) < low)
    extend = {(True, True): "both", (True, False): "max", (False, True): "min"}
    return ColourScale(Normalize(low, top), _colours(), extend.get((above, below), "neither"))


def _colours() -> LinearSegmentedColormap:
    """Pale to dark, equal steps in lightness; pale enough that unloaded bodies recede."""
    colours = matplotlib.colormaps["magma_r"](np.linspace(0.03, 0.86, 256))
    colours[:48, :3] += (1.0 - np.linspace(0.0, 1.0, 48)[:, None])*(0.96 - colours[:48, :3])
    return LinearSegmentedColormap.from_list("stress", colours)


def colour_scale(scene: Scene) -> ColourScale:
    """From zero, or the lowest, to the highest value in what moves, a few outliers aside."""
    if scene.values is None:
        return ColourScale(Normalize(0.0, 1.0), _colours(), "neither")
    low, top = 0.0, 0.0
    every = np.concatenate(scene.values)
    moves = scene.moves()
    chosen = np.concatenate([s[moves] for s in scene.values])
    chosen = chosen[np.isfinite(chosen)]
    if chosen.size:
        top = float(np.quantile(chosen, 1.0 - COLOUR_CUT))
        low = min(float(np.quantile(chosen, COLOUR_CUT)), 0.0)
    highest, lowest = float(np.nanmax(every, initial=0.0)), float(np.nanmin(every, initial=0.0))
    if not top > low:
        top = low + 1.0
        return ColourScale(Normalize(low, top), _colours(), "neither")
    above = highest > top + 0.02*(top - low)
    below = lowest < low - 0.02*(top - low)
    extend = {(True, True): "both", (True, False): "max", (False, True): "min"}
    return ColourScale(Normalize(low, top), _colours(), extend.get((above, below), "neither"))


def draw_bodies(axes: Axes, scene: Scene, frame: int, view: View, width: float,
                scale: ColourScale) -> PolyCollection:
    """Draw the elements of one frame into axes of a width [inch]."""
    elements = PolyCollection(scene.polygons(frame), edgecolors=(0.1, 0.1, 0.1, 0.55),
                              linewidths=_edge_width(scene, view, width))
    if scene.values is not None:
        elements.set(array=scene.colours(frame), norm=scale.norm, cmap=scale.colours)
    else:
        elements.set_facecolor("#dddddd")
    axes.add_collection(elements)
    return elements


def draw_colour_bar(figure: Figure, box: tuple[float, float, float, float], scene: Scene,
                    scale: ColourScale) -> None:
    """Draw the colour bar into a box (left, bottom, width, height) of the figure, 0 to 1."""
    bar = figure.add_axes(box)
    mappable = matplotlib.cm.ScalarMappable(scale.norm, scale.colours)
    colour_bar = figure.colorbar(mappable, cax=bar, extend=scale.extend, extendfrac=0.04)
    colour_bar.set_label(scene.label, labelpad=8, linespacing=0.95)
    colour_bar.outline.set_linewidth(0.5)
    bar.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    bar.tick_params(direction="in", width=0.5)
    scale_ticks(bar.yaxis)


def number(value: float) -> str:
    """A number of four digits in mathematical type."""
    digits, _, power = f"{value:.4g}".partition("e")
    return rf"{digits}\times10^{{{int(power)}}}" if power else digits


def scale_ticks(axis: Axis) -> None:
    """Numbers of an axis that are large or small by a power of ten, which its unit then has."""
    largest = max(map(abs, axis.get_view_interval()))
    power = int(np.floor(np.log10(largest))) if largest > 0.0 and np.isfinite(largest) else 0
    power = 0 if -3 < power < 5 else 3*(power//3)
    if power:
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value/10.0**power:.4g}"))
        label = axis.get_label_text()
        axis.set_label_text(label.replace("[", f"[10$^{{{power}}}$ ", 1) if "[" in label else
                            f"{label} / 10$^{{{power}}}$")
    elif isinstance(axis.get_major_formatter(), ScalarFormatter):
        axis.get_major_formatter().set_useOffset(False)


def _edge_width(scene: Scene, view: View, width: float) -> float:
    """Line width [point]: thin against the smallest elements as printed."""
    side = min(float(np.ptp(scene.position[0][cell], axis=0).max()) for cell in scene.cells)
    return float(np.clip(0.04*side/(view[1] - view[0])*width*72.0, 0.05, 0.35))


def set_view(axes: Axes, view: View, width: float, height: float) -> None:
    """Limits, widened where the panel [inch] is larger than the view so that the scale is true."""
    x_min, x_max, y_min, y_max = view
    scale = max((x_max - x_min)/width, (y_max - y_min)/height)
    x_pad, y_pad = 0.5*(scale*width - (x_max - x_min)), 0.5*(scale*height - (y_max - y_min))
    axes.set_xlim(x_min - x_pad, x_max + x_pad)
    axes.set_ylim(y_min - y_pad, y_max + y_pad)


def frame_view(axes: Axes, scene: Scene, view: View, width: float, height: float,
               is_first: bool) -> None:
    """A frame with ticks around a view; the first of a row has labels at its left. In three
    dimensions it has the directions of the axes instead."""
    set_view(axes, view, width, height)
    axes.set_aspect("equal", adjustable="box")
    for spine in axes.spines.values():
        spine.set(visible=True, linewidth=0.4, color=GREY)
    if scene.order is not None:
        axes.set(xticks=[], yticks=[])
        if is_first:
            _draw_directions(axes, scene.position[0], width, height)
        return
    axes.xaxis.set_major_locator(MaxNLocator(3, steps=[1, 2, 5, 10], prune="upper"))
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    axes.tick_params(width=0.4, length=2.5)
    axes.set_xlabel("$x$ [L]", labelpad=1)
    if is_first:
        axes.set_ylabel("$y$ [L]")
        axes.yaxis.set_label_coords(-LABEL_OFFSET/width, 0.5)
    else:
        axes.tick_params(labelleft=False)


def _draw_directions(axes: Axes, position: Array, width: float, height: float) -> None:
    """Where x, y and z go, in the corner of a panel [inch] with the fewest nodes (n_node, 2)."""
    size, room = np.array([width, height]), 2.6*DIRECTION_LENGTH
    low, high = np.array([axes.get_xlim(), axes.get_ylim()]).T
    at = (position - low)/(high - low)*size
    corners = [(x, y) for y in (0.0, height) for x in (0.0, width)]
    taken = [int(np.all(np.abs(at - corner) < room, axis=1).sum()) for corner in corners]
    corner = np.array(corners[int(np.argmin(taken))])
    middle = np.where(corner > 0.0, corner - 1.9*DIRECTION_LENGTH, 1.3*DIRECTION_LENGTH)
    for name, way in zip("xyz", basis()[:2].T):
        for part, text in ((1.0, ""), (1.3, f"${name}$")):
            x, y = (middle[k] + part*DIRECTION_LENGTH*way[k] for k in (0, 1))
            if text:
                axes.text(x/width, y/height, text, transform=axes.transAxes, ha="center",
                          va="center", fontsize=8, color=GREY)
            else:
                axes.plot([middle[0]/width, x/width], [middle[1]/height, y/height], color=GREY,
                          linewidth=0.8, transform=axes.transAxes)
