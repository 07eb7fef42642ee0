"""A short table of a run: energies and momenta, largest drift, rebound, effort, files."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .results import (Bodies, ResultPaths, cpu_seconds, energy_drift, read_bodies, read_history,
                      read_wall_seconds)

_QUANTITIES = (("kinetic", "kinetic energy"), ("strain", "strain energy"),
               ("external_work", "external work"), ("total", "total energy"),
               ("friction_loss", "lost by friction"), ("damping_loss", "lost by damping"),
               ("contact_damping_loss", "lost by contact damping"),
               ("restitution_loss", "lost in impacts"), ("scheme_loss", "lost by the scheme"),
               ("px", "linear momentum x"), ("py", "linear momentum y"),
               ("pz", "linear momentum z"), ("lx", "angular momentum x"),
               ("ly", "angular momentum y"), ("lz", "angular momentum z"))


def summary(paths: ResultPaths) -> str:
    """The table of the run, as lines of text."""
    history = read_history(paths)
    lines = [_title(paths, history), ""]
    lines += _balance_lines(history)
    lines += _rebound_lines(history, read_bodies(paths))
    lines += _effort_lines(history, read_wall_seconds(paths)) + [""]
    lines += _file_lines(paths)
    return "\n".join(lines)


def _title(paths: ResultPaths, history: NDArray[np.void]) -> str:
    count = int(history["increment"][-1] - history["increment"][0])
    return (f"{paths.base.name}: {count} increments, "
            f"t = {history['time'][0]:g} to {history['time'][-1]:g}")


def _row(name: str, *values: str) -> str:
    return f"  {name:<26}" + "".join(f"{value:>18}" for value in values)


def _balance_lines(history: NDArray[np.void]) -> list[str]:
    lines = [_row("", "start", "end")]
    for column, name in _QUANTITIES:
        if column not in (history.dtype.names or ()):
            continue
        if np.any(history[column]) or not column.endswith("_loss"):
            lines.append(_row(name, *(f"{history[column][k]:.10g}" for k in (0, -1))))
    drift, scale = energy_drift(history)
    worst = int(np.nanargmax(drift)) if np.isfinite(drift).any() else 0
    of = ("of its start" if scale == abs(float(history["total"][0]))
          else "of the largest single energy")
    lines += ["", f"  largest drift of total energy   {drift[worst]:.2e} {of}, "
                  f"at t = {history['time'][worst]:g}"]
    return lines


def _rebound_lines(history: NDArray[np.void], bodies: Bodies | None) -> list[str]:
    if bodies is None:
        return ["  velocities of bodies            (their masses are not in the history)"]
    body = bodies.main()
    start, end = bodies.velocity(body, 0), bodies.velocity(body, -1)
    return [f"  velocity of body {body + 1}, start      ({', '.join(f'{v:.6g}' for v in start)})"
            f"   mass {bodies.mass[body]:.6g}",
            f"  velocity of the same, end       ({', '.join(f'{v:.6g}' for v in end)})"]


def _effort_lines(history: NDArray[np.void], wall: float | None) -> list[str]:
    names = history.dtype.names or ()
    count = max(int(history["increment"][-1] - history["increment"][0]), 1)
    lines = []
    for seconds, name in ((wall, "wall time"), (cpu_seconds(history), "CPU time")):
        if seconds is not None:
            lines.append(f"  {name:<32}{seconds:.3g} s, {1e3*seconds/count:.3g} ms per increment")
    if "newton" in names and "cuts" in names:
        lines.append(f"  Newton iterations               "
                     f"{history['newton'].sum()/count:.3g} per increment; "
                     f"steps cut: {history['cuts'].sum()}")
    return lines


def _file_lines(paths: ResultPaths) -> list[str]:
    lines = []
    for path, what in ((paths.picture, "picture"), (paths.field, "fields (ParaView)"),
                       (paths.surfaces, "faces of contact"),
                       (paths.table, "history"), (paths.history, "history, bodies"),
                       (paths.log, "log"), (paths.restart, "restart")):
        if path.is_file():
            lines.append(f"  {what:<20}{path}")
        elif path == paths.picture:
            lines.append(f"  {what:<20}(none yet: emcon plot {paths.base})")
    return lines
