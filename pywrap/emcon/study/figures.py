"""Pictures of a study: error over CPU time, error over step size."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ..plotting import RESOLUTION, WIDTH
from ..scene import GREY, STYLE
from .accuracy import PROCESS, Run, fitted_order
from .choice import pareto_front
from .measures import OWN
from .plan import MEMBER
from .reference import Reference, knob_size
from .report import Study, candidates, shown_measures

_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
_MARKS = "os^Dv<>"
_PER_ROW = 3
#: Numbers in each power of ten of an axis over less than a factor.
_WITHIN = ((8.0, (1.0, 1.5, 2.0, 3.0, 4.0, 6.0)), (50.0, (1.0, 2.0, 5.0)), (math.inf, (1.0,)))
#: Inches: of a row of panels; beside, above and below a panel, for its labels; of the title of the
#: figure, and of a row of the legend.
_ROW, _LEFT, _RIGHT, _ABOVE, _BELOW, _TITLE, _LEGEND = 3.3, 0.8, 0.25, 0.3, 0.5, 0.35, 0.2
_PER_LEGEND_ROW = 4


def write_figures(study: Study, folder: Path) -> list[Path]:
    """`work_REFERENCE.png` and, where steps vary, `steps_REFERENCE.png` for each reference."""
    written = []
    for reference in study.references:
        names = shown_measures(study, reference)
        if not names:
            continue
        kinds: list[tuple[str, Callable[..., None]]] = [("work", _draw_work)]
        if any(len(treatment.runs) > 1 for treatment in study.treatments):
            kinds.append(("steps", _draw_steps))
        for kind, drawer in kinds:
            path = folder/f"{kind}_{reference.kind}.png"
            _write(study, reference, names, drawer, path)
            written.append(path)
    return written


def _write(study: Study, reference: Reference, names: Sequence[str],
           drawer: Callable[[Axes, Study, Reference, str], None], path: Path) -> None:
    with matplotlib.rc_context(STYLE | {"axes.titley": 1.0}):    # where it is: nothing is measured for it
        figure = Figure()
        panels = figure.subplots(math.ceil(len(names)/_PER_ROW), _PER_ROW, squeeze=False).ravel()
        for axes, name in zip(panels, names):
            drawer(axes, study, reference, name)
        for axes in panels[len(names):]:
            axes.set_axis_off()
        shown = {label: handle for axes in panels
                 for handle, label in zip(*axes.get_legend_handles_labels())}
        labels = [*shown]
        figure.legend([*shown.values()], labels, loc="lower center", ncols=_PER_LEGEND_ROW, frameon=False,
                      fontsize=9)
        title = f"errors against {reference.kind}: {reference.title}"
        _arrange(figure, math.ceil(len(names)/_PER_ROW), math.ceil(len(labels)/_PER_LEGEND_ROW), title)
        figure.savefig(path, dpi=RESOLUTION)


def _arrange(figure: Figure, rows: int, legend_rows: int, title: str) -> None:
    """Panels of one size, with fixed room for their labels: to measure each label, as the layouts of
    matplotlib do, takes longer than all the rest."""
    legend = _LEGEND*(legend_rows + 1)
    height = _ROW*rows + _TITLE + legend
    wide, high = WIDTH/_PER_ROW - _LEFT - _RIGHT, _ROW - _ABOVE - _BELOW
    figure.set_size_inches(WIDTH, height)
    figure.subplots_adjust(left=_LEFT/WIDTH, right=1.0 - _RIGHT/WIDTH, wspace=(_LEFT + _RIGHT)/wide,
                           bottom=(legend + _BELOW)/height, top=1.0 - (_TITLE + _ABOVE)/height,
                           hspace=(_ABOVE + _BELOW)/high)
    figure.suptitle(title, fontsize=10, y=1.0 - 0.5*_TITLE/height, va="center")


def _points(reference: Reference, runs: Sequence[Run], name: str) -> list[tuple[Run, float]]:
    """Runs with an error that a logarithm has; the reference itself has none to show."""
    found = []
    for run in runs:
        error = reference.errors(run).get(name, math.nan)
        if (run is not reference.run or name in OWN) and 0.0 < error < math.inf:
            found.append((run, error))
    return found


def _floor(axes: Axes, reference: Reference, name: str) -> None:
    """What the reference may be wrong by: errors below are not known."""
    level = reference.uncertainty(name)
    if level > 0.0:
        axes.axhspan(1e-300, level, color="#eeeeee", zorder=0, label="reference not certain")
        axes.axhline(level, color=GREY, linewidth=0.7, linestyle="--")


def _begin(axes: Axes, study: Study, reference: Reference, name: str,
           place: Callable[[Run], float]) -> bool:
    """Points of all treatments; whether there are any."""
    all_points: list[tuple[Run, float]] = []
    for k, treatment in enumerate(study.treatments):
        points = _points(reference, treatment.runs, name)
        all_points += points
        axes.plot([place(run) for run, _ in points], [error for _, error in points],
                  marker=_MARKS[k//len(_COLOURS) % len(_MARKS)], markersize=4, linewidth=0.8,
                  color=_COLOURS[k % len(_COLOURS)], label=treatment.limit.title)
    axes.set_title(name, fontsize=9)
    if not all_points:
        axes.text(0.5, 0.5, "no errors above 0", transform=axes.transAxes, ha="center", color=GREY)
        return False
    axes.set_xscale("log")
    axes.set_yscale("log")
    _label(axes, [place(run) for run, _ in all_points])
    errors = [error for _, error in all_points]
    level = reference.uncertainty(name)
    goals = [goal.tolerance for goal in study.goals if goal.name == name]
    low = min([*errors, *goals, *([level] if level > 0.0 else [])])
    axes.set_ylim(0.3*low, 3.0*max(*errors, *goals, low))
    _floor(axes, reference, name)
    axes.set_ylabel("relative error" if name not in OWN else "value; 0 is right")
    return True


def _label(axes: Axes, places: Sequence[float]) -> None:
    """Numbers below an axis: the fewer powers of ten it has, the more in each; none overlaps the next."""
    longer = [within for length, within in _WITHIN if max(places) < length*min(places)]
    axes.xaxis.set_major_locator(LogLocator(subs=longer[0]))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


def _draw_work(axes: Axes, study: Study, reference: Reference, name: str) -> None:
    axes.set_xlabel("CPU time [s]" if study.cost == PROCESS else f"CPU time, {study.cost} [s]")
    if not _begin(axes, study, reference, name, study.price):
        return
    points = _points(reference, candidates(study), name)
    for run, error in points:
        if run.member.role != MEMBER:
            axes.plot(study.price(run), error, "x", color="black", label="the deck as it is")
    cost = [study.price(run) for run, _ in points]
    front = pareto_front(cost, [error for _, error in points])
    axes.plot([cost[k] for k in front], [points[k][1] for k in front], color="black",
              linewidth=3.0, alpha=0.2, marker="o", markersize=9, zorder=1, label="Pareto front")
    for goal in study.goals:
        if goal.name == name:
            axes.axhline(goal.tolerance, color="#b00000", linewidth=0.8, label="goal")


def _draw_steps(axes: Axes, study: Study, reference: Reference, name: str) -> None:
    step = study.plan.step
    axes.set_xlabel(step)
    if not _begin(axes, study, reference, name, lambda run: knob_size(run, step)):
        return
    floor = 0.0 if name in OWN else reference.uncertainty(name)
    words = []
    for treatment in study.treatments:
        points = _points(reference, treatment.runs, name)
        order = fitted_order([knob_size(run, step) for run, _ in points],
                             [error for _, error in points], floor)
        words.append("-" if math.isnan(order) else f"{order:.1f}")
    axes.set_title(f"{name}: slopes {', '.join(words)}", fontsize=9)
