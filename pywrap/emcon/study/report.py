"""A study as a table and in words."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from .accuracy import COSTS, PROCESS, Run, fitted_order
from .choice import Goal, cheapest
from .measures import NAMES, OWN
from .plan import DEFAULT, MEMBER, MESH, QUAD, Member, Plan, same_settings
from .reference import Reference, knob_size, limits_of, sequence

#: Measures that tables in words begin with.
SHOWN = ("displacement", "position", "rebound", "impulse", "force", "energy")
_MOST_COLUMNS = 6
_MOST_COMPONENTS = 3


@dataclass(frozen=True)
class Study:
    """All that is known when its members have been run."""

    plan: Plan
    members: Sequence[Member]
    records: Mapping[int, dict[str, Any]]
    runs: Sequence[Run]                     #: those that are done
    references: Sequence[Reference]
    goals: Sequence[Goal]
    head: str
    cost: str = PROCESS                     #: a key of `COSTS`

    def price(self, run: Run) -> float:
        """What a run costs: processor time [s]."""
        return run.cost(self.cost)

    def label(self, member: Member) -> str:
        """`h=0.1, initiation=ADMISSIBLE`, with the mesh where there are several."""
        with_mesh = [MESH] if any(MESH in m.settings for m in self.members) else []
        shown = Member(member.index, member.role, {MESH: "1", **member.settings})
        return (shown if with_mesh else member).text(
            dict.fromkeys([*self.plan.knobs, *with_mesh])) + (", quad" if member.role == QUAD
                                                              else "")

    @cached_property
    def treatments(self) -> list[Treatment]:
        """Members that differ in the step alone, each against the finest of them."""
        found: dict[tuple[str, ...], Treatment] = {}
        for run in self.runs:
            key = self.plan.treatment(run.member.settings)
            if run.member.role != MEMBER or key in found:
                continue
            runs = [r for r in sequence(self.plan, self.runs, run.member.settings, self.plan.step)
                    if r.member.role == MEMBER]
            others = [name for name in self.plan.knobs if name != self.plan.step]
            own = Reference("own", runs[0].member.text(others), runs[0],
                            limits_of(runs, self.plan.step))
            found[key] = Treatment(runs, own)
        return list(found.values())


@dataclass(frozen=True)
class Treatment:
    """Runs of one treatment, the finest first, and the finest as their limit."""

    runs: Sequence[Run]
    limit: Reference


def rows_of(study: Study) -> list[dict[str, object]]:
    """A row of the table for each member."""
    by_index = {run.member.index: run for run in study.runs}
    own = _own_errors(study)
    rows = []
    for member in study.members:
        record, run = study.records.get(member.index, {}), by_index.get(member.index)
        row: dict[str, object] = {"index": member.index, "role": member.role, **member.settings}
        row |= {name: record.get(name, "") for name in
                ("status", "message", "verdict", *COSTS.values(), "increments", "newton",
                 "cuts")}
        if run is not None:
            row |= _values(run)
            for reference in study.references:
                row |= {f"error_{reference.kind}_{name}": error
                        for name, error in reference.errors(run).items()}
            row |= {f"own_{name}": error for name, error in own.get(member.index, {}).items()}
        rows.append(row)
    return rows


def _own_errors(study: Study) -> dict[int, dict[str, float]]:
    """Errors of each member against the finest one of its treatment."""
    return {run.member.index: treatment.limit.errors(run)
            for treatment in study.treatments if len(treatment.runs) > 1
            for run in treatment.runs}


def _values(run: Run) -> dict[str, object]:
    found: dict[str, object] = {}
    for name, measured in run.measures.items():
        n, components = measured.rows.shape
        if components > _MOST_COMPONENTS:
            continue
        for k in range(n):
            for c in range(components):
                label = name + (f"_{k + 1}" if n > 1 else "")
                label += f"_{'xyz'[c]}" if components > 1 else ""
                found[label] = float(measured.rows[k, c])
    return found


def write_table(folder: Path, rows: Sequence[Mapping[str, object]], head: str) -> None:
    """table.csv and table.h5, a data set for each column; cells that are missing empty or NaN."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    with (folder/"table.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows([_cell(row.get(name, "")) for name in names] for row in rows)
    with h5py.File(folder/"table.h5", "w") as file:
        file.attrs["study"] = head
        for name in names:
            values = [row.get(name, "") for row in rows]
            if all(isinstance(v, (int, float)) or v == "" for v in values):
                file[name] = np.array([math.nan if v == "" else v for v in values], dtype=float)
            else:
                file.create_dataset(name, data=[str(v) for v in values],
                                    dtype=h5py.string_dtype())


def _cell(value: object) -> str:
    return repr(value) if isinstance(value, float) else str(value)


# --- words -------------------------------------------------------------------------------------

def in_words(study: Study) -> str:
    """The study as text: failures, references, errors, orders, what the goals ask for."""
    parts = [study.head, _failures(study)]
    for reference in study.references:
        parts += [_of_reference(study, reference)]
    parts += [_orders(study), *_goals(study)]
    return "\n\n".join(part for part in parts if part) + "\n"


def _failures(study: Study) -> str:
    lines = []
    for member in study.members:
        record = study.records.get(member.index, {})
        knobs = study.label(member)
        if record.get("status") != "done":
            text = " ".join(str(record.get("message", "")).split())
            lines.append(f"  {knobs}: failed: {text}")
        elif record.get("verdict") == "bad":
            lines.append(f"  {knobs}: bad: {'; '.join(record.get('reasons', []))}")
    return "\n".join(lines)


def shown_measures(study: Study, reference: Reference) -> list[str]:
    """Measures of goals first, then those that tell most."""
    known = {name for run in study.runs for name in reference.errors(run)}
    wanted = dict.fromkeys([*(goal.name for goal in study.goals), *SHOWN, *NAMES])
    return [name for name in wanted if name in known][:_MOST_COLUMNS]


def _of_reference(study: Study, reference: Reference) -> str:
    names = shown_measures(study, reference)
    knobs = max([len(study.label(run.member)) for run in study.runs], default=0)
    width = [max(len(name), 9) + 2 for name in names]
    lines = [f"reference {reference.kind}: {reference.title}",
             f"  {'':<{knobs}}{'CPU s':>9}" + "".join(f"{n:>{w}}" for n, w in zip(names, width))]
    for run in study.runs:
        errors = reference.errors(run)
        lines.append(f"  {study.label(run.member):<{knobs}}{study.price(run):>9.3g}"
                     + "".join(f"{_size(errors.get(n)):>{w}}" for n, w in zip(names, width))
                     + ("   the reference" if run is reference.run else ""))
    if reference.limits:
        lines.append(f"  {'uncertainty':<{knobs + 9}}"
                     + "".join(f"{'' if n in OWN else _size(reference.uncertainty(n)):>{w}}"
                               for n, w in zip(names, width)))
    return "\n".join(line.rstrip() for line in lines)


def _size(error: float | None) -> str:
    return "-" if error is None or math.isnan(error) else f"{error:.1e}"


def _orders(study: Study) -> str:
    """Orders in the step size of each treatment towards its own limit."""
    step = study.plan.step
    lines = []
    for treatment in study.treatments:
        coarse = treatment.runs[1:]
        if len(coarse) < 2:
            continue
        words = []
        for name in SHOWN:
            limit = treatment.limit.limits.get(name)
            if limit is None or name in OWN:
                continue
            errors = [treatment.limit.errors(run).get(name, math.nan) for run in coarse]
            slope = fitted_order([knob_size(run, step) for run in coarse], errors,
                                 limit.uncertainty)
            words.append(f"{name} {'none' if math.isnan(limit.order) else f'{limit.order:.1f}'}"
                         + (f" (slope {slope:.1f})" if not math.isnan(slope) else ""))
        lines.append(f"  {treatment.limit.title}: {', '.join(words)}")
    if not lines:
        return ""
    return "\n".join([f"orders in {step}, of the three finest runs (and the slope of the errors "
                      "against the finest)", *lines])


def _goals(study: Study) -> list[str]:
    if not study.goals or not study.references:
        return [f"goal {goal.name}:{goal.tolerance:g}: there is no reference to hold it against"
                for goal in study.goals]
    reference = study.references[0]
    return [goal_words(study, reference, goals) for goals in goal_groups(study.goals)]


def safe_error(reference: Reference, run: Run, name: str) -> float:
    """The error with what the reference may be wrong by; infinite where it is not known."""
    error = reference.errors(run).get(name, math.inf)
    return error if run is reference.run else error + reference.uncertainty(name)


def candidates(study: Study) -> list[Run]:
    """Runs that may be chosen: neither references alone nor bad ones."""
    return [run for run in study.runs if run.member.role in (MEMBER, DEFAULT)
            and run.record.get("verdict") != "bad"]


def choice(study: Study, reference: Reference, goals: Sequence[Goal]) -> Run | None:
    """The cheapest run that meets all `goals`."""
    runs = candidates(study)
    k = cheapest([study.price(run) for run in runs],
                 [excess(reference, run, goals) for run in runs], 1.0)
    return None if k is None else runs[k]


def goal_words(study: Study, reference: Reference, goals: Sequence[Goal]) -> str:
    """The cheapest setting that meets all `goals`, or how near the best one came."""
    text = " and ".join(f"{goal.name}:{goal.tolerance:g}" for goal in goals)
    run = choice(study, reference, goals)
    if run is None:
        return _not_met(study, reference, goals, text)
    errors = ", ".join(f"{g.name} to {safe_error(reference, run, g.name):.1e}" for g in goals)
    return (f"goal {text}: the cheapest setting is {study.label(run.member)}: "
            f"{study.price(run):.3g} s, {errors}" + _against_default(study, reference, goals, run))


def missing_knobs(study: Study) -> list[dict[str, str]]:
    """Settings that would tell what each knob of the chosen ones does by itself."""
    own = study.plan.default_settings()
    found: list[dict[str, str]] = []
    for goals in goal_groups(study.goals) if study.references else []:
        run = choice(study, study.references[0], goals)
        for knob in study.plan.knobs if run else ():
            assert run is not None
            alone = {**own, knob: run.member.settings[knob]}
            known = [*found, *(member.settings for member in study.members)]
            if not any(same_settings(alone, settings) for settings in known):
                found.append(alone)
    return found


def goal_groups(goals: Sequence[Goal]) -> list[Sequence[Goal]]:
    """Each goal, and all of them."""
    return [*([goal] for goal in goals), *([goals] if len(goals) > 1 else [])]


def _not_met(study: Study, reference: Reference, goals: Sequence[Goal], text: str) -> str:
    runs = candidates(study)
    over = [excess(reference, run, goals) for run in runs]
    reached = [k for k in range(len(runs)) if over[k] < math.inf]
    if not reached:
        return f"goal {text}: not measured in any member that is done"
    k = min(reached, key=lambda k: over[k])
    words = [f"goal {text}: not met. The best, {study.label(runs[k].member)}, comes to "
             + ", ".join(f"{g.name} {safe_error(reference, runs[k], g.name):.1e}" for g in goals)
             + f", {over[k]:.2g} times the goal"]
    vague = [g.name for g in goals if reference.uncertainty(g.name) > g.tolerance]
    if vague:
        words.append(f"The uncertainty of the reference is larger than the goal in {', '.join(vague)}: "
                     f"use a smaller {study.plan.step}")
    return ". ".join(words)


def _against_default(study: Study, reference: Reference, goals: Sequence[Goal], chosen: Run) -> str:
    """How many times cheaper than the deck's own setting, and by which knobs."""
    own = study.plan.default_settings()
    default = next((run for run in study.runs if same_settings(run.member.settings, own)
                    and run.member.role in (MEMBER, DEFAULT)), None)
    if default is None or default is chosen:
        return "; it is the deck's own" if default is chosen else ""
    cpu = study.price(default)
    gain = cpu/study.price(chosen)
    words = [f"; {max(gain, 1.0/gain):.2g} times {'cheaper' if gain >= 1.0 else 'dearer'} than the "
             f"deck's own ({study.label(default.member)}, {cpu:.3g} s"
             + ("" if excess(reference, default, goals) <= 1.0 else ", and the goal is not met")
             + ")"]
    for knob in study.plan.knobs:
        value = chosen.member.settings[knob]
        if same_settings({knob: value}, {knob: own[knob]}):
            continue
        alone = next((run for run in study.runs
                      if same_settings(run.member.settings, {**own, knob: value})), None)
        if alone is None:
            words.append(f"{knob}={value} alone: failed")
        elif alone is not chosen:
            met = excess(reference, alone, goals) <= 1.0
            words.append(f"{knob}={value} alone: {cpu/study.price(alone):.2g} times"
                         + ("" if met else ", and the goal is not met"))
    return "; ".join([*words, *_by_refinement(study, reference, goals, chosen)])


def _by_refinement(study: Study, reference: Reference, goals: Sequence[Goal],
                   chosen: Run) -> list[str]:
    """At which step and mesh the deck's own treatment meets the goal, and what it costs there."""
    own = study.plan.default_settings()
    fine = [knob for knob in (MESH, study.plan.step) if knob in study.plan.knobs]
    free = dict.fromkeys(fine, "")
    runs = [run for run in candidates(study)
            if same_settings({**run.member.settings, **free}, {**own, **free})]
    if study.plan.step not in fine or len(runs) < 2:
        return []
    words = f"with {' and '.join(fine)} alone the deck's own "
    met = [run for run in runs if excess(reference, run, goals) <= 1.0]
    if met:
        run = min(met, key=study.price)
        words += "meets the goal at "
    else:
        run = min(runs, key=lambda run: tuple(knob_size(run, knob) for knob in fine))
        words += "does not meet the goal down to "
    gain = study.price(run)/study.price(chosen)
    where = ", ".join(f"{knob}={run.member.settings[knob]}" for knob in fine)
    return [f"{words}{where}, for {gain:.2g} times the time"] if run is not chosen else []


def excess(reference: Reference, run: Run, goals: Sequence[Goal]) -> float:
    """The largest error of a run over what the goals allow."""
    return max(safe_error(reference, run, goal.name)/goal.tolerance for goal in goals)


def goals_met(study: Study) -> bool:
    """Whether some member meets each goal."""
    return all(any(safe_error(study.references[0], run, goal.name) <= goal.tolerance
                   for run in candidates(study)) for goal in study.goals
               ) if study.references else not study.goals
