"""What is measured of one run: rows of numbers, of a body or of a pair of surfaces each."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..comparison import common_times
from ..fields import QUADRATIC, FieldFile
from ..results import (Array, Bodies, ResultPaths, read_bodies, read_history, read_pairs)
from .quadrature import points

#: What is measured, and its unit.
NAMES = {
    "displacement": "displacements of the nodes, over all frames [L]",
    "position": "how far the centre of a body has gone at the last frame [L]",
    "rebound": "velocity of the centre of a body at the end, 0 without mass [L/T]",
    "impulse": "impulse of a pair on its slave surface, over the run [M L/T]",
    "duration": "how long a pair was in contact [T]",
    "force": "force of a pair over time, means of windows of the run [M L/T^2]",
    "peak_force": "largest force of a pair in an increment [M L/T^2]",
    "peak_pressure": "largest contact pressure at a node, of the frames [M/(L T^2)]",
    "mean_pressure": "impulse over length in contact and time [M/(L T^2)]",
    "scatter": "force of an increment beside the mean of its neighbours, rms over rms of the force",
    "switches": "how often a pair came into contact or lost it",
    "penetration": "deepest overlap of bodies, looked for both ways, per edge",
    "stand_off": "largest air across which contact forces acted, per edge",
    "energy": "largest change of the total energy, over the largest energy",
    "rigid_energy": "kinetic energy of a body's translation and rotation at the last frame",
    "vibration": "kinetic energy beside that, and strain energy, of all bodies at the last frame",
    "momentum": "px, py, in space pz, at the end [M L/T]",
    "angular_momentum": "about the origin, at the end [M L^2/T]",
}
#: Those that should be 0: they are their own error.
OWN = ("scatter", "penetration", "stand_off", "energy")
#: Of which every row is a body, or a pair: `rebound_2` is that of body 2.
ROWS = ("position", "rebound", "impulse", "duration", "force", "peak_force", "mean_pressure",
        "switches", "rigid_energy")
#: Windows of the run over which forces are averaged.
WINDOWS = 50


@dataclass(frozen=True)
class Measured:
    """Values, (n_row, n_comp), and the largest size of the quantity over the run."""

    rows: Array
    size: float


def measure(paths: ResultPaths, windows: int = WINDOWS) -> dict[str, Measured]:
    """What the files of a run tell; measures that they do not tell are left out."""
    history = read_history(paths)
    bodies = read_bodies(paths)
    found = {**_of_history(history), **_of_pairs(history, windows), **_of_verdict(paths)}
    if bodies is not None:
        p = bodies.momentum
        v = _per_mass(p, bodies.mass[:, None])
        found["rebound"] = _of_rows(v[-1], v)
    pairs = read_pairs(paths)
    if pairs is not None:
        n = _n_pair(history)
        size = np.linalg.norm(pair_columns(history, "force")[1:], axis=2)
        force = (size*np.diff(history["time"])[:, None]).sum(axis=0)
        length = (pairs.length[1:, :n]*np.diff(pairs.time)[:, None]).sum(axis=0)
        mean = np.divide(force, length, out=np.zeros_like(force), where=length > 0.0)
        found["mean_pressure"] = _of_rows(mean[:, None])
    if paths.field.is_file():
        with FieldFile(paths.field) as fields:
            found |= _of_fields(fields, history, bodies)
    return {name: found[name] for name in NAMES if name in found
            and np.isfinite(found[name].rows).all()}


def _per_mass(values: Array, mass: Array) -> Array:
    """Of a body without mass 0."""
    found: Array = np.divide(values, mass, out=np.zeros_like(values), where=mass > 0.0)
    return found


def _of_rows(rows: Array, over_time: Array | None = None) -> Measured:
    rows = np.asarray(rows, dtype=np.float64)
    sizes = np.linalg.norm(rows if over_time is None else over_time, axis=-1)
    return Measured(rows, float(np.max(sizes, initial=0.0)))


def _of_history(history: NDArray[np.void]) -> dict[str, Measured]:
    total = history["total"]
    largest = max(float(np.abs(history[name]).max())
                  for name in ("kinetic", "strain", "external_work"))
    change = float(np.abs(total - total[0]).max())
    found = {"energy": _of_rows(np.array([[change/largest if largest > 0.0 else change]]))}
    for name, columns in (("momentum", ("px", "py", "pz")), ("angular_momentum", ("lx", "ly", "lz"))):
        over_time = np.column_stack([history[c] for c in columns if c in (history.dtype.names or ())])
        found[name] = _of_rows(over_time[-1:], over_time)
    return found


def _n_pair(history: NDArray[np.void]) -> int:
    names = history.dtype.names or ()
    return sum(name.startswith("pair") and name.endswith("_impulse_x") for name in names)


def _of_pairs(history: NDArray[np.void], windows: int) -> dict[str, Measured]:
    """From the columns of the pairs; nothing without a pair."""
    n = _n_pair(history)
    if not n:
        return {}
    force = pair_columns(history, "force")[1:]
    impulse = pair_columns(history, "impulse")
    duration = np.array([history[f"pair{k + 1}_duration"] for k in range(n)]).T
    active = np.array([history[f"pair{k + 1}_active"] for k in range(n)]) > 0
    means = windowed(history["time"], impulse, windows)
    rough = np.linalg.norm(force[1:-1] - 0.5*(force[:-2] + force[2:]), axis=2)
    size = np.linalg.norm(force, axis=2)
    found = {
        "impulse": _of_rows(impulse[-1], impulse),
        "duration": _of_rows(duration[-1][:, None]),
        "force": _of_rows(means.transpose(1, 0, 2).reshape(n, -1)),
        "peak_force": _of_rows(size.max(axis=0, initial=0.0)[:, None]),
        "switches": _of_rows((np.diff(active, axis=1) != 0).sum(axis=1)[:, None]),
    }
    if (size > 0.0).any():
        found["scatter"] = _of_rows(np.sqrt(np.sum(rough**2, keepdims=True)/np.sum(size**2)))
    return found


def pair_columns(history: NDArray[np.void], name: str) -> Array:
    """Columns `pairN_NAME_x`, `_y`, in space `_z`, of all pairs, (n_row, n_pair, n_dim)."""
    axes = [axis for axis in "xyz" if f"pair1_{name}_{axis}" in (history.dtype.names or ())]
    return np.array([[history[f"pair{k + 1}_{name}_{axis}"] for axis in axes]
                     for k in range(_n_pair(history))]).transpose(2, 0, 1)


def windowed(times: Array, integral: Array, windows: int) -> Array:
    """Means over equal windows of what has the `integral` (n_time, ...): (windows, ...).

    Means do not depend on the increments, but for those that a window's end cuts.
    """
    ends = np.linspace(times[0], times[-1], windows + 1)
    flat = integral.reshape(len(times), -1)
    at_ends = np.column_stack([np.interp(ends, times, column) for column in flat.T])
    means: Array = np.diff(at_ends, axis=0)/np.diff(ends)[:, None]
    return means.reshape(windows, *integral.shape[1:])


def _of_verdict(paths: ResultPaths) -> dict[str, Measured]:
    verdict = read_verdict(paths)
    return {name: _of_rows(np.array([[float(verdict[name])]]))
            for name in ("penetration", "stand_off") if name in verdict}


def read_verdict(paths: ResultPaths) -> dict[str, Any]:
    """NAME.json; empty where it is not there or broken."""
    try:
        found = json.loads(paths.base.with_name(paths.base.name + ".json").read_text("utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


# --- fields ------------------------------------------------------------------------------------

def _of_fields(fields: FieldFile, history: NDArray[np.void],
               bodies: Bodies | None) -> dict[str, Measured]:
    found: dict[str, Measured] = {}
    if "contact_pressure" in fields.point_fields:
        pressure = fields["contact_pressure"]
        peak = max(float(np.nanmax(np.abs(frame), initial=0.0)) for frame in pressure)
        found["peak_pressure"] = _of_rows(np.array([[peak]]))
    if bodies is None or "displacement" not in fields.point_fields:
        return found
    body = fields.bodies()
    if body.max() + 1 != len(bodies.mass):
        return found
    start = body_geometry(fields, body, None, bodies.mass)
    end = body_geometry(fields, body, fields["displacement"][-1][:, :fields.n_dim],
                        bodies.mass)
    found["position"] = _of_rows(end.centre - start.centre)
    row = common_times(fields.times[-1:], history["time"])[1]
    if len(row):
        rigid = rigid_energy(bodies, int(row[0]), end)
        stored = float(history["kinetic"][row[0]] + history["strain"][row[0]])
        top = float((history["kinetic"] + history["strain"]).max())
        found["rigid_energy"] = Measured(rigid[:, None], top)
        found["vibration"] = Measured(np.array([[stored - rigid.sum()]]), top)
    return found


@dataclass(frozen=True)
class Geometry:
    """Centre of mass (n_body, n_dim) [L] and moment of inertia about it [M L^2]: (n_body), in space the
    tensor (n_body, 3, 3)."""

    centre: Array
    inertia: Array


def body_geometry(fields: FieldFile, body: NDArray[np.int64], u: Array | None,
                  mass: Array) -> Geometry:
    """Of each body in the positions of `u` (n_node, n_dim); its density is taken as uniform."""
    n_body, n_dim = len(mass), fields.n_dim
    place = fields.points[:, :n_dim]
    moved = place if u is None else place + u
    size, first = np.zeros(n_body), np.zeros((n_body, n_dim))
    second = np.zeros((n_body, n_dim, n_dim))
    near = np.array([moved[body == k].mean(axis=0) for k in range(n_body)])
    for kind in np.unique(fields.types).tolist():
        cells = np.array([_corners_first(cell, kind) for cell, of in zip(fields.cells, fields.types)
                          if of == kind])
        owner = body[cells[:, 0]]
        for weight, values, slopes in points(kind):
            jacobian = np.einsum("kd,ekc->edc", slopes, place[cells])
            share = weight*np.abs(np.linalg.det(jacobian))
            # from a point of the body: far from the origin digits would be lost
            arm = np.einsum("k,ekc->ec", values, moved[cells]) - near[owner]
            np.add.at(size, owner, share)
            np.add.at(first, owner, share[:, None]*arm)
            np.add.at(second, owner, share[:, None, None]*arm[:, :, None]*arm[:, None, :])
    arm = first/size[:, None]
    spread = mass[:, None, None]*(second/size[:, None, None] - arm[:, :, None]*arm[:, None, :])
    polar = np.trace(spread, axis1=1, axis2=2)
    return Geometry(near + arm, polar if n_dim == 2 else polar[:, None, None]*np.eye(3) - spread)


def _corners_first(cell: NDArray[np.int64], kind: int) -> NDArray[np.int64]:
    """The nodes as VTK counts them: fields have quadratic cells of the plane along the outline."""
    return np.concatenate([cell[::2], cell[1::2]]) if kind in QUADRATIC else cell


def rigid_energy(bodies: Bodies, row: int, at: Geometry) -> Array:
    """Kinetic energy of translation and rotation of each body, (n_body)."""
    p = bodies.momentum[row]
    moved: Array = _per_mass(0.5*(p**2).sum(axis=1), bodies.mass)
    if bodies.lx is None or bodies.ly is None:
        spin = bodies.lz[row] - (at.centre[:, 0]*p[:, 1] - at.centre[:, 1]*p[:, 0])
        return moved + np.divide(0.5*spin**2, at.inertia, out=np.zeros_like(spin),
                                 where=at.inertia > 0.0)
    turn = np.stack([bodies.lx[row], bodies.ly[row], bodies.lz[row]], axis=1)
    turn = turn - np.cross(at.centre, p)
    return moved + 0.5*np.einsum("ki,kij,kj->k", turn, np.linalg.pinv(at.inertia), turn)


# --- storing -----------------------------------------------------------------------------------

def to_json(found: Mapping[str, Measured]) -> dict[str, Any]:
    return {name: {"rows": m.rows.tolist(), "size": m.size} for name, m in found.items()}


def from_json(found: Mapping[str, Any]) -> dict[str, Measured]:
    return {name: Measured(np.array(m["rows"], dtype=np.float64), float(m["size"]))
            for name, m in found.items()}
