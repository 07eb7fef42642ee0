"""How far runs are from each other, orders of convergence, what a reference may be wrong by."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..comparison import SAME_TIME, common_times
from ..fields import FieldFile
from ..hdf5 import ResultError
from ..results import Array, ResultPaths
from .measures import NAMES, OWN, ROWS, Measured, read_verdict
from .plan import Member

#: A reference value below this fraction of the largest size of the quantity counts as 0.
ZERO = math.sqrt(float(np.finfo(np.float64).eps))
#: Orders that are believed of three runs: a scheme is of second order at most, and below a half
#: three runs show no convergence.
LEAST_ORDER, MOST_ORDER = 0.5, 2.0
#: What counts as the cost of a run, and where its record has it.
PROCESS, INCREMENTS = "process", "increments"
COSTS = {PROCESS: "cpu", INCREMENTS: "increments_cpu"}


@dataclass(frozen=True)
class Run:
    """A member that is done, with what was measured of it."""

    member: Member
    record: dict[str, Any]
    measures: Mapping[str, Measured]
    paths: ResultPaths | None       #: None: there are no fields

    def cost(self, kind: str) -> float:
        """Processor time of the process, or of its increments [s]."""
        return float(self.record[COSTS[kind]])


def difference(one: Measured, other: Measured, row: int | None = None) -> float:
    """Largest difference of the rows, or of one of them, over the largest row of `other`.

    Where that is 0, over the largest size of the quantity in `other`. Rows of `other` that are NaN
    are not compared; NaN where there is nothing to compare.
    """
    chosen = slice(None) if row is None else slice(row, row + 1)
    if one.rows.shape != other.rows.shape:
        return math.nan
    a, b = one.rows[chosen], other.rows[chosen]
    known = np.isfinite(b).all(axis=1)
    if not known.any():
        return math.nan
    apart = float(np.linalg.norm(a[known] - b[known], axis=1).max())
    scale = float(np.linalg.norm(b[known], axis=1).max())
    if not scale > ZERO*other.size:
        scale = other.size
    if apart == 0.0:
        return 0.0
    return apart/scale if scale > 0.0 else math.inf


def differences(run: Run, other: Run) -> dict[str, float]:
    """Errors of `run` if `other` is right, by measure; of several bodies or pairs also of each.

    What should be 0 is its own error.
    """
    found: dict[str, float] = {}
    shift = field_difference(run.paths, other.paths)
    if shift is not None:
        found["displacement"] = shift
    for name, value in run.measures.items():
        if name in OWN:
            found[name] = float(np.abs(value.rows).max())
        elif name in other.measures:
            found[name] = difference(value, other.measures[name])
            if name in ROWS and len(value.rows) > 1:
                found |= {f"{name}_{k + 1}": difference(value, other.measures[name], k)
                          for k in range(len(value.rows))}
    order = list(NAMES)
    return {name: found[name] for name in sorted(found, key=lambda n: (order.index(base(n)), n))
            if not math.isnan(found[name])}


def base(name: str) -> str:
    """The measure that `rebound_2` is a row of."""
    stem, _, number = name.rpartition("_")
    return stem if number.isdigit() else name


def field_difference(one: ResultPaths | None, other: ResultPaths | None) -> float | None:
    """Displacements at common frames and nodes: rms of the difference over rms of `other`.

    Places and times of a run in single precision are those of another but for its rounding.
    """
    if one is None or other is None or not (one.field.is_file() and other.field.is_file()):
        return None
    try:
        with FieldFile(one.field) as a, FieldFile(other.field) as b:
            if not all("displacement" in f.point_fields for f in (a, b)):
                return None
            kind = _coarser_kind(one, other)
            nodes = common_nodes(a.points.astype(kind), b.points.astype(kind))
            frames = common_times(a.times, b.times, max(SAME_TIME, 8*float(np.finfo(kind).eps)))
            if nodes is None or not len(frames[0]):
                return None
            apart = size = 0.0
            of_a, of_b = a["displacement"], b["displacement"]
            for i, j in zip(*frames):
                u, v = of_a[int(i)][nodes[0]], of_b[int(j)][nodes[1]]
                apart += float(((u - v)**2).sum())
                size += float((v**2).sum())
    except ResultError:
        return None
    return math.sqrt(apart/size) if size > 0.0 else (0.0 if apart == 0.0 else math.inf)


def _coarser_kind(one: ResultPaths, other: ResultPaths) -> type[np.floating[Any]]:
    is_single = any(read_verdict(paths).get("precision") == "single" for paths in (one, other))
    return np.float32 if is_single else np.float64


def common_nodes(a: Array, b: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """Rows of the nodes of the coarser mesh in both; None where the finer one lacks some.

    Nodes of a refined mesh have the very positions that they had; of several in one place, the
    first of one is the first of the other.
    """
    coarse, fine = (a, b) if len(a) <= len(b) else (b, a)
    places: dict[tuple[float, ...], list[int]] = {}
    for row, x in reversed(list(enumerate(map(tuple, fine.tolist())))):
        places.setdefault(x, []).append(row)
    found = []
    for x in map(tuple, coarse.tolist()):
        if not places.get(x):
            return None
        found.append(places[x].pop())
    rows = np.arange(len(coarse)), np.array(found, dtype=np.int64)
    return rows if coarse is a else (rows[1], rows[0])


# --- convergence -------------------------------------------------------------------------------

def observed_order(sizes: Sequence[float], fine: float, coarse: float) -> float:
    """The order p at which differences of three runs shrink; NaN where they do not.

    sizes    step sizes of the runs, ascending: h1 < h2 < h3
    fine     difference of runs 1 and 2
    coarse   difference of runs 2 and 3

    p solves (h3^p - h2^p)/(h2^p - h1^p) = coarse/fine.
    """
    if not (fine > 0.0 and coarse > 0.0 and math.isfinite(coarse)):
        return math.nan
    near, far = math.log(sizes[1]/sizes[0]), math.log(sizes[2]/sizes[1])

    def ratio(p: float) -> float:
        return math.exp(p*near)*math.expm1(p*far)/math.expm1(p*near)

    low, high = 1e-3, 16.0
    if not ratio(low) < coarse/fine < ratio(high):
        return math.nan
    for _ in range(80):
        middle = 0.5*(low + high)
        low, high = (middle, high) if ratio(middle) < coarse/fine else (low, middle)
    return 0.5*(low + high)


@dataclass(frozen=True)
class Limit:
    """The finest run of a sequence, and what it may be wrong by."""

    uncertainty: float      #: relative; NaN: there is one run alone
    order: float            #: observed; NaN: fewer than three runs, or no convergence


def limit_of(sizes: Sequence[float], fine: float, coarse: float | None) -> Limit:
    """What the finest of two or three runs may be wrong by.

    The two finest differ by C (h2^p - h1^p), where the finest errs by C h1^p: that is `fine`
    over (h2/h1)^p - 1. The order p is the observed one, two at most; one, that of a scheme
    through an impact, where there are two runs; and where three runs do not converge, the larger
    of their differences counts.
    """
    order = math.nan
    if coarse is not None:
        order = observed_order(sizes, fine, coarse)
        if fine > 0.0 and not order >= LEAST_ORDER:
            return Limit(max(fine, coarse), order)
    p = 1.0 if math.isnan(order) else min(order, MOST_ORDER)
    return Limit(fine/((sizes[1]/sizes[0])**p - 1.0), order)


def limits(runs: Sequence[Run], sizes: Sequence[float]) -> dict[str, Limit]:
    """For each measure, of runs in the order of ascending step sizes."""
    if len(runs) < 2:
        return {}
    fine = differences(runs[1], runs[0])
    coarse = differences(runs[2], runs[1]) if len(runs) > 2 else {}
    return {name: Limit(0.0, math.nan) if base(name) in OWN
            else limit_of(sizes, value, coarse.get(name)) for name, value in fine.items()}


def fitted_order(sizes: Sequence[float], errors: Sequence[float], floor: float) -> float:
    """Slope of the logarithms by least squares, of errors above `floor`; NaN of fewer than two."""
    pairs = [(h, e) for h, e in zip(sizes, errors) if e > floor and 0.0 < e < math.inf]
    if len({h for h, _ in pairs}) < 2:
        return math.nan
    h, e = np.log(np.array(pairs)).T
    h = h - h.mean()
    return float((h*e).sum()/(h*h).sum())
