"""What a study is to run: its knobs, its members, one row of the manifest each."""

from __future__ import annotations

import csv
import hashlib
import itertools
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path

from .errors import StudyError

#: Knobs that are no parameters of a deck.
MESH, THREADS, DECK, PRECISION = "mesh", "threads", "deck", "precision"
PROGRAM_KNOBS = (MESH, THREADS, DECK, PRECISION)
#: Values of PRECISION, and where the source tree has the program of each.
PRECISIONS = {"double": "release", "single": "release-single", "quad": "release-quad"}
#: What these knobs are where they are not named; a deck has to be.
_PLAIN = {MESH: "1", THREADS: "1", PRECISION: "double"}
#: Why a member is run.
MEMBER, DEFAULT, REFERENCE, QUAD = "member", "default", "reference", "quad"
#: The deck's own setting but for one knob, to tell what that does by itself.
ALONE = "alone"


@dataclass(frozen=True)
class Member:
    """One run: values of the knobs as text, those of `--set` included."""

    index: int
    role: str
    settings: dict[str, str] = field(hash=False)

    @property
    def key(self) -> str:
        """Name of its folder: the same settings have the same one, whatever else a study runs."""
        text = json.dumps([self.role == QUAD, sorted(self.settings.items())])
        return hashlib.sha256(text.encode()).hexdigest()[:12]

    def text(self, knobs: Iterable[str]) -> str:
        """`h=0.1, initiation=ADMISSIBLE`"""
        words = [f"{name}={self.settings[name]}" for name in knobs if name in self.settings]
        return ", ".join(words) or "the deck as it is"


@dataclass(frozen=True)
class Plan:
    """Knobs with their values, the knob that refines, what is fixed, and the deck's own values."""

    vary: dict[str, tuple[str, ...]]
    fixed: dict[str, str]
    defaults: dict[str, str]        #: of the deck and of the program, for all known knobs
    step: str                       #: the knob whose values go to 0: the step size

    @property
    def knobs(self) -> tuple[str, ...]:
        return tuple(self.vary)

    def values(self, knob: str) -> tuple[str, ...]:
        """All that a knob takes in the members."""
        fixed = (self.fixed[knob],) if knob in self.fixed else ()
        return tuple(dict.fromkeys((*self.vary.get(knob, ()), *fixed)))

    def treatment(self, settings: Mapping[str, str]) -> tuple[str, ...]:
        """Values of all knobs but the one that refines."""
        return tuple(settings[name] for name in self.knobs if name != self.step)

    def size(self, settings: Mapping[str, str]) -> float:
        """Value of the knob that refines; nan where it is none."""
        return as_number(settings.get(self.step, ""))

    def default_settings(self) -> dict[str, str]:
        return {**self.fixed, **{name: self.fixed.get(name, self.defaults[name])
                                 for name in self.knobs}}

    def first_treatment(self) -> dict[str, str]:
        """The first value of each knob, the finest of the one that refines."""
        chosen = {name: values[0] for name, values in self.vary.items()}
        if self.step in self.vary:
            chosen[self.step] = min(self.vary[self.step], key=as_number)
        return {**self.fixed, **chosen}

    def members(self, references: Sequence[str], with_default: bool) -> list[Member]:
        """All rows of the manifest: the grid of the knobs, the deck's own setting, references."""
        rows = [(MEMBER, {**self.fixed, **dict(zip(self.knobs, values))})
                for values in itertools.product(*self.vary.values())]
        if with_default:
            own = self.default_settings()
            steps = [{**own, self.step: value} for value in self.vary.get(self.step, ())]
            rows += [(DEFAULT, wanted) for wanted in (*steps, own)
                     if not any(same_settings(wanted, settings) for _, settings in rows)]
        best = self.first_treatment()
        if "refined-mesh" in references:
            factors = [int(value) for value in self.vary.get(MESH, (best.get(MESH, "1"),))]
            wanted = [max(factors), 2*max(factors)]
            rows += [(REFERENCE, {**best, MESH: str(factor)}) for factor in wanted
                     if not any(same_settings(settings, {**best, MESH: str(factor)})
                                for _, settings in rows)]
        if "quad" in references:
            rows.append((QUAD, best))
        return [Member(k, role, settings) for k, (role, settings) in enumerate(rows)]


def as_number(text: str) -> float:
    """The number that `text` is; nan for words."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def same_settings(one: Mapping[str, str], other: Mapping[str, str]) -> bool:
    """Numbers count by value; a mesh that is not named is the deck's own."""
    names = set(one) | set(other)
    return all(_is_same(one.get(n, _PLAIN.get(n, "")), other.get(n, _PLAIN.get(n, "")))
               for n in names)


def _is_same(one: str, other: str) -> bool:
    return as_number(one) == as_number(other) or one.upper() == other.upper()


def parse_vary(texts: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """`h=0.1,0.05` as name and values."""
    vary: dict[str, tuple[str, ...]] = {}
    for text in texts:
        name, values = _assignment(text, "--vary")
        listed = tuple(value.strip() for value in values.split(","))
        if not all(listed):
            raise StudyError(f"--vary {text}: a value is empty; give NAME=VALUE,VALUE,...")
        if name in vary:
            raise StudyError(f"--vary {name} is there twice; give all its values at once")
        vary[name] = tuple(dict.fromkeys(listed))
    return vary


def parse_set(texts: Sequence[str]) -> dict[str, str]:
    """`t_end=1` as name and value."""
    return dict(_assignment(text, "--set") for text in texts)


def _assignment(text: str, option: str) -> tuple[str, str]:
    name, equal, value = text.partition("=")
    if not (equal and name.strip() and value.strip()):
        raise StudyError(f"{option} {text}: give {option} NAME=VALUE")
    return name.strip().lower(), value.strip()


def make_plan(vary: dict[str, tuple[str, ...]], fixed: dict[str, str],
              parameters: Mapping[str, str], step: str, deck: str = "") -> Plan:
    """The plan; raises `StudyError` for knobs that the deck, a file `deck`, does not have."""
    known = {**parameters, **_PLAIN, DECK: deck}
    for name in (*vary, *fixed):
        if name not in known:
            close = get_close_matches(name, known, 1)
            raise StudyError(f"there is no knob '{name}'; known are the parameters of the deck "
                             f"{', '.join(parameters) or '(none)'}, and {', '.join(PROGRAM_KNOBS)}"
                             + (f"; did you mean {close[0]}?" if close else ""))
    both = sorted(set(vary) & set(fixed))
    if both:
        raise StudyError(f"{both[0]} is varied and set; one of --vary and --set")
    for name, values in {**vary, **{name: (value,) for name, value in fixed.items()}}.items():
        _check_values(name, values)
    step = step.lower()
    if step in vary and not all(as_number(value) > 0.0 for value in vary[step]):
        raise StudyError(f"--vary {step}: its values are to be numbers above 0, since orders are "
                         "observed over it; --step NAME names another knob")
    return Plan(vary, fixed, known, step)


def _check_values(name: str, values: Sequence[str]) -> None:
    from .deck import times_of
    if name == MESH:
        for value in values:
            times_of(value)
    elif name == THREADS and not all(value.isdigit() and int(value) > 0 for value in values):
        raise StudyError(f"{name}={','.join(values)}: whole numbers above 0")
    elif name == PRECISION and not set(values) <= set(PRECISIONS):
        raise StudyError(f"{name}={','.join(values)}: known are {', '.join(PRECISIONS)}")


# --- manifest ----------------------------------------------------------------------------------

def write_manifest(path: Path, members: Sequence[Member], knobs: Sequence[str]) -> None:
    """One row a run; an array job of a cluster takes one by its index."""
    names = list(dict.fromkeys([*knobs, *(n for m in members for n in m.settings)]))
    part = path.with_name(f"{path.name}.{unique()}")
    with part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["index", "role", "folder", *names])
        for member in members:
            writer.writerow([member.index, member.role, f"members/{member.key}",
                             *(member.settings.get(name, "") for name in names)])
    part.replace(path)


def read_manifest(path: Path) -> list[Member]:
    """The rows of a manifest; raises `StudyError` where it is damaged."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return [Member(int(row.pop("index")), row.pop("role"),
                           {name: value for name, value in row.items()
                            if name != "folder" and value})
                    for row in csv.DictReader(file)]
    except (OSError, KeyError, ValueError, TypeError) as problem:
        raise StudyError(f"cannot read {path}: {problem}") from None


def unique() -> str:
    """A word that no other process on any machine has."""
    import os
    import socket
    import threading
    return f"{socket.gethostname()}-{os.getpid()}-{threading.get_ident()}"
