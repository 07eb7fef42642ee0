"""DrawnBodies drawn into axes: their colours, the colour bar, and the frame around them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Colormap, LinearSegmentedColormap, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, ScalarFormatter
from numpy.typing import NDArray

from .projection import basis
from .results import Array, ResultError
from .scene import BLACK, BLUE, GREY, ORANGE, Scene, View

#: The colour scale ends where all but this fraction of what moves is below; what is less than this
#: fraction of the largest beyond 0 on the other side is no sign.
COLOUR_CUT = 0.01
#: Distance of the y labels from the axes at the left [inch].
LABEL_OFFSET = 0.43
#: Length of the axes that tell directions [inch].
DIRECTION_LENGTH = 0.16
#: Width of a digit of the numbers at ticks [inch].
DIGIT_WIDTH = 0.065
#: Width of lines that show values of sides [point].
SIDE_WIDTH = 3.0
#: Width of lines that bound bodies without elements [point].
PROFILE_WIDTH = 1.4
#: Lines of the mesh, on pale and on dark colours; what is less light than this is dark.
EDGE, EDGE_ON_DARK, DARK = (0.1, 0.1, 0.1, 0.55), (1.0, 1.0, 1.0, 0.40), 0.35
#: Lines of a mesh with more polygons than this are not drawn: they would cover it.
MOST_LINES = 20000
PALE = "#e9e9e9"
#: Faces in space that have nothing of what is shown: what lies behind is seen through them.
GLASS = (0.80, 0.82, 0.85, 0.22)


@dataclass
class ColourScale:
    """Colours of the values of a scene; `extend` says at which ends some are beyond."""

    norm: Normalize
    colours: Colormap
    extend: str


class InnerLocator(MaxNLocator):
    """Ticks of an axis of a length [inch] whose numbers neither reach beyond its ends nor meet.

    Two or more where that is possible; `is_along` is true where the numbers stand side by side.
    """

    def __init__(self, length: float, count: int, is_along: bool) -> None:
        super().__init__(count, steps=[1, 2, 5, 10])
        self._length, self._count, self._is_along = length, count, is_along

    def tick_values(self, vmin: float, vmax: float) -> Array:
        best = np.empty(0)
        for count in range(self._count, 3*self._count):
            self.set_params(nbins=count)
            ticks = np.asarray(super().tick_values(vmin, vmax))
            place = (ticks - vmin)/(vmax - vmin)*self._length
            widest = max(len(f"{tick:.4g}") for tick in ticks) if self._is_along else 1
            half = 0.5*DIGIT_WIDTH*widest
            inner = ticks[(place >= half) & (place <= self._length - half)]
            apart = np.diff(place)[0] if len(place) > 1 else np.inf
            if len(inner) > len(best) and (apart > DIGIT_WIDTH*(widest + 1) or not len(best)):
                best = inner
            if len(best) > 1:
                break
        return best


# --- colours -----------------------------------------------------------------------------------

def _pale_to_dark() -> LinearSegmentedColormap:
    """Equal steps in lightness; pale enough that unloaded bodies recede."""
    colours = matplotlib.colormaps["magma_r"](np.linspace(0.03, 0.86, 256))
    colours[:48, :3] += (1.0 - np.linspace(0.0, 1.0, 48)[:, None])*(0.96 - colours[:48, :3])
    return LinearSegmentedColormap.from_list("stress", colours)


def _two_signs() -> LinearSegmentedColormap:
    """Below zero blue, above it orange."""
    return LinearSegmentedColormap.from_list("signed", ["#123a66", "#4f8fcf", "#f4f4f4", "#e8924a",
                                                        "#7a3403"])


def fixed_scale(scene: Scene, low: float, top: float) -> ColourScale:
    """Between two values; raises `ResultError` where they are none."""
    if not (np.isfinite([low, top]).all() and low < top):
        raise ResultError(f"colours go from a value to a larger one, not from {low:g} to {top:g}")
    lowest, highest = _ends(scene)
    extend = {(True, True): "both", (True, False): "max", (False, True): "min"}
    return ColourScale(Normalize(low, top), _two_signs() if low == -top else _pale_to_dark(),
                       extend.get((highest > top, lowest < low), "neither"))


def _ends(scene: Scene) -> tuple[float, float]:
    """The least and the largest of all values; 0 where there are none."""
    every = np.concatenate([v.ravel() for v in scene.values]) if scene.values else np.zeros(1)
    every = every[np.isfinite(every)]
    return float(every.min(initial=np.inf)) if every.size else 0.0, \
        float(every.max(initial=-np.inf)) if every.size else 0.0


def colour_scale(scene: Scene) -> ColourScale:
    """From zero to the highest value in what moves, a few outliers aside; where there are values
    below zero too as far to both sides of it."""
    if scene.states:
        count = len(scene.states)
        colours = ListedColormap([PALE, BLUE, ORANGE][:count] if count > 2 else [PALE, BLACK])
        return ColourScale(Normalize(-0.5, count - 0.5), colours, "neither")
    low, top = 0.0, 0.0
    if scene.values is not None:
        moves = scene.moves()
        chosen = np.concatenate([v[..., moves].ravel() for v in scene.values])
        chosen = chosen[np.isfinite(chosen)]
        if chosen.size:
            top = max(float(np.quantile(chosen, 1.0 - COLOUR_CUT)), 0.0)
            low = min(float(np.quantile(chosen, COLOUR_CUT)), 0.0)
    if not top - low > scene.floor:
        return ColourScale(Normalize(0.0, 1.0), _pale_to_dark(), "neither")
    lowest, highest = _ends(scene)
    if low < -COLOUR_CUT*top:
        low, top = -max(-low, top), max(-low, top)
    else:
        low = 0.0
    slack = 0.02*(top - low)
    extend = {(True, True): "both", (True, False): "max", (False, True): "min"}
    return ColourScale(Normalize(low, top), _two_signs() if low < 0.0 else _pale_to_dark(),
                       extend.get((highest > top + slack, lowest < low - slack), "neither"))


# --- bodies ------------------------------------------------------------------------------------

class DrawnBodies:
    """The bodies of a scene in axes; `show` puts another frame in place of the one drawn first."""

    def __init__(self, axes: Axes, scene: Scene, frame: int, view: View, width: float,
                 scale: ColourScale) -> None:
        """`width` [inch] of the axes, in which `view` is to be seen."""
        self._scene = scene
        is_fine = len(scene.cells) > MOST_LINES
        self._has_lines = not is_fine
        self.elements = PolyCollection(
            [], closed=True, edgecolors="face" if is_fine else [EDGE],
            linewidths=0.1 if is_fine else _edge_width(scene, view, width))
        self.sides = LineCollection([], linewidths=SIDE_WIDTH, capstyle="butt")
        if scene.values is None or scene.sides is not None:
            self.elements.set_facecolor(PALE if scene.sides is not None else "#dddddd")
        self.profiles = LineCollection([], linewidths=PROFILE_WIDTH, colors=GREY)
        for part in (self.elements, self.sides):
            part.set(norm=scale.norm, cmap=scale.colours.with_extremes(bad=GLASS))
        for part in (self.profiles, self.elements, self.sides):
            axes.add_collection(part, autolim=False)
        self.show(frame)

    def show(self, frame: int) -> None:
        self.elements.set_verts(self._scene.polygons(frame))
        self.profiles.set_segments(list(self._scene.position[frame][self._scene.profiles]))
        values = self._scene.colours(frame)
        if self._scene.sides is not None:
            assert values is not None
            has_value = np.isfinite(values)
            self.sides.set_segments(list(self._scene.halves(frame)[has_value]))
            self.sides.set_array(values[has_value])
        elif values is not None:
            self.elements.set_array(np.ma.masked_invalid(values))
            if self._has_lines:
                colours = self.elements.cmap(self.elements.norm(np.ma.masked_invalid(values)))
                light = colours[:, :3] @ (0.299, 0.587, 0.114)
                self.elements.set_edgecolor(np.where((light < DARK)[:, None], EDGE_ON_DARK, EDGE))


def _edge_width(scene: Scene, view: View, width: float) -> float:
    """Line width [point]: thin against the smallest elements as printed."""
    sizes = np.array([len(cell) for cell in scene.cells])
    start = np.cumsum(sizes) - sizes
    corners = scene.position[0][np.concatenate(scene.cells)]
    extent = np.maximum.reduceat(corners, start) - np.minimum.reduceat(corners, start)
    side = float(extent.max(axis=1).min())
    return float(np.clip(0.04*side/(view[1] - view[0])*width*72.0, 0.05, 0.35))


def draw_colour_bar(figure: Figure, box: tuple[float, float, float, float], scene: Scene,
                    scale: ColourScale) -> None:
    """Draw the colour bar into a box (left, bottom, width, height) of the figure, 0 to 1."""
    bar = figure.add_axes(box)
    mappable = matplotlib.cm.ScalarMappable(scale.norm, scale.colours)
    colour_bar = figure.colorbar(mappable, cax=bar, extend=scale.extend, extendfrac=0.04)
    colour_bar.set_label(scene.label, labelpad=8, linespacing=1.3)
    colour_bar.outline.set_linewidth(0.5)
    bar.tick_params(direction="in", width=0.5)
    if scene.states:
        bar.set_yticks(range(len(scene.states)), scene.states, rotation=90, va="center")
        bar.tick_params(length=0)
        bar.minorticks_off()
        return
    bar.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    scale_ticks(bar.yaxis)


# --- numbers and frames ------------------------------------------------------------------------

def _power(largest: float) -> int:
    """The power of ten that is taken out of numbers up to this one, a multiple of three."""
    power = int(np.floor(np.log10(largest))) if largest > 0.0 and np.isfinite(largest) else 0
    return 0 if -3 < power < 5 else 3*(power//3)


def titles(times: Sequence[float]) -> list[str]:
    """Times [T] as titles of panels, with one power of ten."""
    power = _power(max(map(abs, times), default=0.0))
    behind = rf"\times10^{{{power}}}" if power else ""
    texts = [f"{time/10.0**power:.4g}" for time in times]
    return [f"$t = {text}{behind if float(text) else ''}$" for text in texts]


def scale_ticks(axis: Axis) -> None:
    """Numbers of an axis that are large or small by a power of ten, which its unit then has."""
    power = _power(max(map(abs, axis.get_view_interval())))
    if power:
        axis.set_major_formatter(FuncFormatter(
            lambda value, _: f"{value/10.0**power:.4g}".replace("-", "\N{MINUS SIGN}")))
        label = axis.get_label_text()
        axis.set_label_text(label.replace("[", f"[10$^{{{power}}}$ ", 1) if "[" in label else
                            f"{label} / 10$^{{{power}}}$")
    elif isinstance(axis.get_major_formatter(), ScalarFormatter):
        axis.get_major_formatter().set_useOffset(False)


def scale_axes(axes: Axes) -> None:
    """`scale_ticks` of both axes, where their ticks are not chosen one by one."""
    for axis in (axes.xaxis, axes.yaxis):
        if axis.get_scale() == "linear" and not isinstance(axis.get_major_locator(), FixedLocator):
            scale_ticks(axis)


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
    axes.xaxis.set_major_locator(InnerLocator(width, 3, is_along=True))
    axes.yaxis.set_major_locator(InnerLocator(height, 5, is_along=False))
    axes.tick_params(width=0.4, length=2.5)
    axes.set_xlabel("$x$ [L]", labelpad=1)
    if is_first:
        axes.set_ylabel("$y$ [L]")
        axes.yaxis.set_label_coords(-LABEL_OFFSET/width, 0.5)
    else:
        axes.tick_params(labelleft=False)
    scale_axes(axes)


def _draw_directions(axes: Axes, position: NDArray[np.float64], width: float,
                     height: float) -> None:
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
