"""Which settings pay: the Pareto front, and the cheapest that meets a goal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from .accuracy import base
from .errors import StudyError
from .measures import NAMES, ROWS


@dataclass(frozen=True)
class Goal:
    """An error that is not to be exceeded."""

    name: str
    tolerance: float


def parse_goals(texts: Sequence[str]) -> list[Goal]:
    """`rebound:1e-3`; raises `StudyError` for measures that are not known."""
    found = []
    for text in texts:
        name, _, value = text.partition(":")
        name = name.strip()
        if base(name) not in NAMES or (name not in NAMES and base(name) not in ROWS):
            close = get_close_matches(name, NAMES, 1)
            raise StudyError(f"--goal {text}: there is no measure '{name}'; known are "
                             f"{', '.join(NAMES)}" + (f"; did you mean {close[0]}?" if close
                                                      else ""))
        try:
            tolerance = float(value)
        except ValueError:
            tolerance = math.nan
        if not (0.0 < tolerance < math.inf):
            raise StudyError(f"--goal {text}: give --goal MEASURE:TOLERANCE with a number above 0")
        found.append(Goal(name, tolerance))
    return found


def pareto_front(cost: Sequence[float], error: Sequence[float]) -> list[int]:
    """Rows, cheapest first, than which no other is both as cheap and as accurate."""
    front: list[int] = []
    best = math.inf
    for k in sorted(range(len(cost)), key=lambda k: (cost[k], error[k])):
        if error[k] < best:
            best = error[k]
            front.append(k)
    return front


def cheapest(cost: Sequence[float], error: Sequence[float], tolerance: float) -> int | None:
    """The row of the smallest cost whose error is within the tolerance; None: there is none."""
    fit = [k for k in range(len(cost)) if error[k] <= tolerance]
    return min(fit, key=lambda k: (cost[k], error[k])) if fit else None
