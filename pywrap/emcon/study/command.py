"""`python -m emcon study`: many runs of a deck, and what settings cost."""

from __future__ import annotations

import argparse
import json
import math
import os
import shutil
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..results import ResultPaths
from .accuracy import COSTS, INCREMENTS, PROCESS, Run
from .choice import parse_goals
from .deck import DeckFile, read_deck
from .errors import StudyError
from .execution import (Progress, Task, build_of, executor_of, find_program, record_of, run_all,
                        run_member, sweep, version_of)
from .measures import from_json
from .plan import (ALONE, DECK, PRECISION, QUAD, Member, Plan, make_plan, parse_set, parse_vary,
                   unique, write_manifest)
from .reference import check_references, references_of
from .report import Study, goals_met, in_words, missing_knobs, rows_of, write_table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the command."""
    parser.add_argument("deck", metavar="DECK", type=Path, help="the deck to vary")
    parser.add_argument("--vary", metavar="NAME=V,V,...", action="append", default=[],
                        help="values of a parameter of the deck, of mesh (edges cut into 1, 2, 4), "
                        "threads, precision (double, single, quad) or deck (files beside DECK, "
                        "that one if left out); may be repeated: all combinations are run")
    parser.add_argument("--set", metavar="NAME=V", action="append", default=[], dest="fixed",
                        help="the same value in all members")
    parser.add_argument("--reference", metavar="KIND", action="append", default=[],
                        help="finest (default), refined-mesh, quad, closed-form:FILE.json, "
                        "file:RESULT; may be repeated, goals look at the first")
    parser.add_argument("--goal", metavar="MEASURE:TOL", action="append", default=[],
                        help="find the cheapest setting within TOL; exit with 1 if there is none")
    parser.add_argument("--step", metavar="NAME", default="h",
                        help="the knob that goes to 0 (default h)")
    parser.add_argument("--output", metavar="DIR", type=Path,
                        help="folder of the study (default NAME_study)")
    parser.add_argument("--repeat", metavar="N", type=_count, default=1,
                        help="run each member N times, the smallest CPU time counts")
    parser.add_argument("--cost", choices=list(COSTS), default=PROCESS,
                        help="CPU time of the whole process (default), or of its increments "
                        "alone, without start, reading and closing")
    parser.add_argument("--jobs", metavar="N", type=_count, default=os.cpu_count() or 1,
                        help="runs at a time (default: the processors)")
    parser.add_argument("--executor", metavar="MODULE:CALLABLE",
                        help="function that makes the concurrent.futures executor to run by")
    parser.add_argument("--run-member", metavar="K", type=int,
                        help="run the member in row K of the manifest, nothing else")
    parser.add_argument("--manifest", action="store_true", help="write the manifest, run nothing")
    parser.add_argument("--time-limit", metavar="S", type=_seconds,
                        help="end a run after S seconds on the clock")
    parser.add_argument("--no-figures", action="store_true", help="tables and words alone")
    parser.add_argument("--fresh", action="store_true", help="remove what an earlier study left")
    parser.add_argument("--program", metavar="FILE", help="the program (default: emcon)")
    parser.add_argument("--single-program", metavar="FILE",
                        help="the program of single precision")
    parser.add_argument("--quad-program", metavar="FILE",
                        help="the program of quadruple precision")


def _count(text: str) -> int:
    if not (text.isdigit() and int(text) > 0):
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number above 0")
    return int(text)


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number above 0")
    return value


@dataclass(frozen=True)
class _Setup:
    """What the command line asks for."""

    deck: DeckFile
    plan: Plan
    members: list[Member]
    tasks: list[Task]
    folder: Path
    version: str
    programs: dict[str, str]        #: by precision
    decks: dict[str, DeckFile]      #: by value of the knob

    def task(self, member: Member, options: argparse.Namespace) -> Task:
        precision = "quad" if member.role == QUAD else member.settings.get(PRECISION, "double")
        deck = self.decks.get(member.settings.get(DECK, ""), self.deck)
        return Task(member, str(self.folder.resolve()), DeckFile(deck.path.resolve(), deck.text),
                    self.programs[precision], options.repeat, options.time_limit)


def run_study(options: argparse.Namespace) -> int:
    """Exit code: 0 done, 1 a goal is not met, 3 no member is done. Raises `StudyError`."""
    setup = _set_up(options)
    if options.manifest:
        print(f"{setup.folder/'manifest.csv'}: {len(setup.members)} rows, 0 to "
              f"{len(setup.members) - 1}")
        return 0
    if options.run_member is not None:
        return _one(setup, options.run_member)
    sweep(setup.folder)
    records, n_run = _run(setup.tasks, options)
    study = _study(setup, options, records, n_run)
    alone = missing_knobs(study)
    if alone:
        setup = _with_members(setup, alone, options)
        more, n_more = _run(setup.tasks[-len(alone):], options)
        study = _study(setup, options, records | more, n_run + n_more)
    return _conclude(setup, study, not options.no_figures)


def _run(tasks: Sequence[Task], options: argparse.Namespace) -> tuple[dict[int, Any], int]:
    """Records of all members by index, and how many had to be run."""
    waiting = [task for task in tasks if record_of(task) is None]
    fresh: dict[int, Any] = {}
    if waiting:
        with executor_of(options.executor, options.jobs) as executor:
            fresh = run_all(waiting, executor, Progress(len(waiting), sys.stderr))
    return {task.member.index: fresh.get(task.member.index) or record_of(task) or {}
            for task in tasks}, len(waiting)


def _with_members(setup: _Setup, settings: Sequence[dict[str, str]],
                  options: argparse.Namespace) -> _Setup:
    """With rows at the end of the manifest."""
    new = [Member(len(setup.members) + k, ALONE, values) for k, values in enumerate(settings)]
    members = [*setup.members, *new]
    write_manifest(setup.folder/"manifest.csv", members, setup.plan.knobs)
    tasks = [setup.task(member, options) for member in new]
    return replace(setup, members=members, tasks=[*setup.tasks, *tasks])


def _set_up(options: argparse.Namespace) -> _Setup:
    deck = read_deck(options.deck)
    goals = parse_goals(options.goal)
    plan = make_plan(parse_vary(options.vary), parse_set(options.fixed), deck.parameters(),
                     options.step, deck.path.name)
    references = options.reference or ["finest"]
    check_references(references, plan)
    programs = _programs(options, plan, references)
    decks = {name: read_deck(deck.path.parent/name) for name in plan.values(DECK)}
    decks[deck.path.name] = deck
    members = plan.members(references, bool(goals))
    folder = options.output or Path(f"{deck.name}_study")
    version = version_of(programs["double"])
    builds = {precision: build_of(path) for precision, path in programs.items()}
    _claim(folder, deck.path.name, decks, (version, builds), options.fresh)
    write_manifest(folder/"manifest.csv", members, plan.knobs)
    setup = _Setup(deck, plan, members, [], folder, version, programs, decks)
    return replace(setup, tasks=[setup.task(member, options) for member in members])


def _programs(options: argparse.Namespace, plan: Plan, references: Sequence[str]) -> dict[str, str]:
    """Those that are needed; that of double precision always, it tells the version."""
    wanted = {"double", *plan.values(PRECISION), *(["quad"] if "quad" in references else [])}
    named = {"double": options.program, "single": options.single_program,
             "quad": options.quad_program}
    return {precision: find_program(named[precision], precision) for precision in wanted}


def _claim(folder: Path, main: str, decks: Mapping[str, DeckFile],
           program: tuple[str, Mapping[str, str]], fresh: bool) -> None:
    """Make the folder of the study, or see that what is there is of these decks and program.

    Values of the knob `deck` may be added, beside that of the study, `main`; precisions too.
    `program`: its version, and the checksums of its builds by precision.
    """
    version, builds = program
    if fresh:
        shutil.rmtree(folder/"members", ignore_errors=True)
        (folder/"study.json").unlink(missing_ok=True)
    checksums = {name: deck.checksum for name, deck in decks.items()}
    mark = folder/"study.json"
    try:
        found = json.loads(mark.read_text(encoding="utf-8"))
    except FileNotFoundError:
        found = {"version": version, "deck": main, "checksums": {}}
    except (OSError, ValueError) as problem:
        raise StudyError(f"cannot read {mark}: {problem}; --fresh begins anew") from None
    known = found.get("checksums", {})
    changed = [f"the deck {decks[name].path}, or what it includes," for name in decks
               if known.get(name, checksums[name]) != checksums[name]
               or (name == main and found.get("deck") != main)]
    built = found.get("builds", {})
    anew = [name for name in builds if built.get(name, builds[name]) != builds[name]]
    changed += ["the program"] if found.get("version") != version or anew else []
    if changed:
        told = (f" ({found.get('version')} then, {version} now)"
                if found.get("version") != version else
                f" (built anew: {' and '.join(anew)} precision)" if anew else "")
        raise StudyError(f"{folder} holds a study begun before {' and '.join(changed)} changed"
                         f"{told}: its members cannot be compared with new ones. Give another "
                         "--output, --fresh to run all members anew, or bring back what changed")
    (folder/"members").mkdir(parents=True, exist_ok=True)
    part = folder/f"study.json.{unique()}"
    wanted = {"deck": main, "version": version, "checksums": {**known, **checksums},
              "builds": {**built, **builds}}
    part.write_text(json.dumps(wanted) + "\n", encoding="utf-8")
    part.replace(mark)


def _one(setup: _Setup, index: int) -> int:
    if not 0 <= index < len(setup.tasks):
        raise StudyError(f"--run-member {index}: the manifest has the rows 0 to "
                         f"{len(setup.tasks) - 1}")
    record = run_member(setup.tasks[index])
    text = setup.members[index].text(setup.plan.knobs)
    print(f"{index}: {text}: {record['status']}"
          + (f": {record['message']}" if record["status"] != "done" else ""))
    return 0


def _runs(setup: _Setup, records: Mapping[int, dict[str, Any]]) -> list[Run]:
    return [Run(task.member, records[task.member.index],
                from_json(records[task.member.index]["measures"]),
                ResultPaths(task.home/task.deck.name))
            for task in setup.tasks if records[task.member.index].get("status") == "done"]


def _study(setup: _Setup, options: argparse.Namespace, records: Mapping[int, dict[str, Any]],
           n_run: int) -> Study:
    runs = _runs(setup, records)
    n = len(setup.members)
    head = (f"study of {setup.deck.path.name}: {n} members, {len(runs)} done"
            + (f", {n - len(runs)} failed" if len(runs) < n else "")
            + (f"; {n - n_run} of them were there" if n_run < n else "")
            + ("; CPU times of the increments alone" if options.cost == INCREMENTS else ""))
    return Study(setup.plan, setup.members, records, runs,
                 references_of(_kinds(options), setup.plan, runs), parse_goals(options.goal), head,
                 options.cost)


def _conclude(setup: _Setup, study: Study, draws: bool) -> int:
    figures: list[Path] = []
    write_table(setup.folder, rows_of(study), study.head)
    text = in_words(study)
    (setup.folder/"report.txt").write_text(text, encoding="utf-8")
    if draws:
        # matplotlib takes long to load
        from .figures import write_figures

        figures = write_figures(study, setup.folder)
    print(text)
    print("written:", *(str(setup.folder/name) for name in ("table.csv", "table.h5",
                                                            "report.txt")),
          *map(str, figures))
    if not study.runs:
        return 3
    return 0 if goals_met(study) else 1


def _kinds(options: argparse.Namespace) -> Sequence[str]:
    kinds: Sequence[str] = options.reference or ["finest"]
    return kinds
