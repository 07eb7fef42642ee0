"""What the members of a study are held against, and how much of that is certain."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..results import ResultError, locate
from .accuracy import Limit, Run, base, differences, limits
from .errors import StudyError
from .measures import NAMES, OWN, ROWS, Measured, measure
from .plan import ALONE, MESH, QUAD, Member, Plan, as_number, same_settings

#: Kinds of references; the last two with a file behind a colon.
KINDS = ("finest", "quad", "refined-mesh", "closed-form", "file")


@dataclass(frozen=True)
class Reference:
    """A run, or closed forms, with what it may be wrong by, relative, by measure."""

    kind: str
    title: str
    run: Run
    limits: dict[str, Limit]
    _known: dict[int, dict[str, float]] = field(default_factory=dict, repr=False, compare=False)

    def errors(self, run: Run) -> dict[str, float]:
        """Of a run; that of the reference itself is what it may be wrong by."""
        index = run.member.index
        if index not in self._known:
            self._known[index] = (self._of_itself() if run is self.run
                                  else differences(run, self.run))
        return self._known[index]

    def _of_itself(self) -> dict[str, float]:
        own = {name: limit.uncertainty for name, limit in self.limits.items()}
        return own | {name: float(np.abs(self.run.measures[name].rows).max())
                      for name in OWN if name in self.run.measures}

    def uncertainty(self, name: str) -> float:
        limit = self.limits.get(name)
        return limit.uncertainty if limit and not math.isnan(limit.uncertainty) else 0.0


def check_references(texts: Sequence[str], plan: Plan) -> None:
    """Raises `StudyError` for what is no reference, before anything is run."""
    for text in texts:
        kind, _, rest = text.partition(":")
        if kind not in KINDS:
            raise StudyError(f"--reference {text}: known are finest, quad, refined-mesh, "
                             "closed-form:FILE.json, file:RESULT")
        if kind in ("closed-form", "file") and not rest:
            raise StudyError(f"--reference {kind}: give --reference {kind}:"
                             f"{'FILE.json' if kind == 'closed-form' else 'RESULT'}")
        if kind == "finest" and len(plan.vary.get(plan.step, ())) < 2:
            raise StudyError(f"--reference finest: {plan.step} is not varied; give --vary "
                             f"{plan.step}=... with two values at least, --step NAME for another "
                             "knob that refines, or another reference")
        if kind == "closed-form":
            read_closed_form(Path(rest))
        if kind == "file":
            _of_file(rest)


def references_of(texts: Sequence[str], plan: Plan, runs: Sequence[Run]) -> list[Reference]:
    """The references that can be made of the members that are done."""
    found = []
    for text in texts:
        kind, _, rest = text.partition(":")
        made = (_closed(rest, runs) if kind == "closed-form"
                else _of_file(rest) if kind == "file"
                else _of_members(kind, plan, runs))
        if made:
            found.append(made)
    return found


def sequence(plan: Plan, runs: Sequence[Run], settings: dict[str, str], knob: str) -> list[Run]:
    """Runs that differ from `settings` in `knob` alone, the finest first."""
    chosen = [run for run in runs if run.member.role not in (ALONE, QUAD)
              and same_settings({**run.member.settings, knob: "1"}, {**settings, knob: "1"})]
    return sorted(chosen, key=lambda run: knob_size(run, knob))


def knob_size(run: Run, knob: str) -> float:
    """What goes to 0: the value of the knob, of the mesh the length of its edges."""
    if knob == MESH:
        return 1.0/as_number(run.member.settings.get(MESH, "1"))
    return as_number(run.member.settings.get(knob, "nan"))


def limits_of(runs: Sequence[Run], knob: str) -> dict[str, Limit]:
    return limits(runs, [knob_size(run, knob) for run in runs])


def _of_members(kind: str, plan: Plan, runs: Sequence[Run]) -> Reference | None:
    best = plan.first_treatment()
    if kind == "quad":
        of_quad = [run for run in runs if run.member.role == QUAD]
        title = f"quadruple precision at {of_quad[0].member.text(plan.knobs)}" if of_quad else ""
        return Reference(kind, title, of_quad[0], {}) if of_quad else None
    in_time = sequence(plan, runs, best, plan.step)
    if kind == "finest":
        if not in_time:
            return None
        return Reference(kind, in_time[0].member.text(plan.knobs), in_time[0],
                         limits_of(in_time, plan.step))
    in_space = sequence(plan, runs, best, MESH)
    if not in_space:
        return None
    of_time, of_space = limits_of(in_time, plan.step), limits_of(in_space, MESH)
    both = {name: Limit(limit.uncertainty + (of_time[name].uncertainty if name in of_time
                                             else 0.0), limit.order)
            for name, limit in of_space.items()}
    knobs = tuple(dict.fromkeys([MESH, *plan.knobs]))
    return Reference(kind, in_space[0].member.text(knobs), in_space[0], both)


def _of_file(result: str) -> Reference:
    try:
        paths = locate(result)
        run = Run(Member(-1, "file", {}), {}, measure(paths), paths)
    except ResultError as problem:
        raise StudyError(f"--reference file:{result}: {problem}") from None
    return Reference("file", str(paths.base), run, {})


def read_closed_form(path: Path) -> dict[str, Any]:
    """Values by measure, `{"rebound_1": [0, 10], "duration": 0.667}`."""
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as problem:
        raise StudyError(f"--reference closed-form:{path}: {problem}") from None
    if not isinstance(values, dict) or not values:
        raise StudyError(f"{path}: an object of measures and values is due, "
                         '{"rebound_1": [0, 10]}')
    for name, value in values.items():
        if base(name) not in NAMES or base(name) == "displacement" or (
                name not in NAMES and base(name) not in ROWS):
            raise StudyError(f"{path}: there is no measure '{name}' with a closed form; known are "
                             f"{', '.join(n for n in NAMES if n != 'displacement')}"
                             ", those of one body or pair with its number behind: rebound_2")
        try:
            np.atleast_1d(np.array(value, dtype=np.float64))
        except (TypeError, ValueError):
            raise StudyError(f"{path}: {name}: {value!r} is no number and no list of numbers"
                             ) from None
    return values


def _closed(name: str, runs: Sequence[Run]) -> Reference | None:
    """Closed forms in the shape of what was measured; rows that are not given are NaN."""
    path = Path(name)
    if not runs:
        return None
    shapes = runs[0].measures
    found: dict[str, Measured] = {}
    for key, value in read_closed_form(path).items():
        stem = base(key)
        if stem not in shapes:
            continue
        shape = shapes[stem].rows.shape
        rows = found[stem].rows if stem in found else np.full(shape, np.nan)
        row = slice(None) if key == stem else int(key.rpartition("_")[2]) - 1
        try:
            rows[row] = np.array(value, dtype=np.float64)
        except (ValueError, IndexError):
            raise StudyError(f"{path}: {key} is {value}, but a run has {shape[0]} rows of "
                             f"{shape[1]} numbers") from None
        found[stem] = Measured(rows, shapes[stem].size)
    return Reference("closed-form", str(path), Run(Member(-1, "closed-form", {}), {}, found, None),
                     {})
