"""Members are run: one process of the program each, whole or not at all."""

from __future__ import annotations

import hashlib
import importlib
import json
import os
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

from ..program import find_program as packed_program
from ..results import ResultError, ResultPaths, read_history
from .accuracy import COSTS
from .deck import DeckFile, refined_deck, times_of
from .errors import StudyError
from .measures import measure, read_verdict, to_json
from .plan import MESH, PRECISIONS, PROGRAM_KNOBS, THREADS, Member, unique

#: The file that a member has once it is whole.
RECORD = "run.json"
#: Exit codes of a run that is over: done, bad input, failed analysis, cannot write (docs/deck.md).
_OVER = (0, 2, 3)


@dataclass(frozen=True)
class Task:
    """All that a process anywhere needs to run a member; the folder is on a file system of all."""

    member: Member
    folder: str                 #: of the study
    deck: DeckFile
    program: str
    repeat: int                 #: runs, of which the smallest CPU time counts
    time_limit: float | None    #: of one run, on the clock [s]

    @property
    def home(self) -> Path:
        """Folder of the member."""
        return Path(self.folder)/"members"/self.member.key


def record_of(task: Task) -> dict[str, Any] | None:
    """The record of a member that is whole, else None."""
    try:
        found = json.loads((task.home/RECORD).read_text("utf-8"))
    except (OSError, ValueError):
        return None
    if not isinstance(found, dict) or found.get("runs", 0) < task.repeat:
        return None
    is_told = found.get("status") != "done" or set(COSTS.values()) <= set(found)
    return found if is_told else None


def run_member(task: Task) -> dict[str, Any]:
    """Run a member unless it is whole; its record.

    A run that the program ended by itself is whole, also where it failed: the record says how. One
    that a signal or the time limit ended is not, and is repeated the next time. What is not whole
    lies in a folder of another name, so that no two processes write into one.
    """
    done = record_of(task)
    if done is not None:
        return done
    part = task.home.with_name(f"{task.home.name}.part-{unique()}")
    part.mkdir(parents=True)
    try:
        record = _run(task, part)
        if record.pop("is_whole"):
            (part/RECORD).write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
            _put(part, task)
        return record
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _put(part: Path, task: Task) -> None:
    """Give a whole member its folder, unless another process was faster."""
    if record_of(task) is None:
        shutil.rmtree(task.home, ignore_errors=True)
    try:
        part.rename(task.home)
    except OSError:
        if record_of(task) is None:
            raise


def _run(task: Task, part: Path) -> dict[str, Any]:
    settings = task.member.settings
    deck = task.deck.path
    record: dict[str, Any] = {"status": "failed", "message": "", "settings": settings, "code": 2,
                              "runs": task.repeat, "is_whole": True}
    if int(settings.get(MESH, "1")) > 1:
        try:
            text = refined_deck(task.deck, times_of(settings[MESH]), part/"mesh.tmp.inp")
        except StudyError as problem:
            return record | {"message": str(problem)}
        deck = part/task.deck.path.name
        deck.write_text(text, encoding="utf-8")
    command = [task.program, str(deck), "--quiet", "--output", str(part)]
    command += [f"--set={name}={value}" for name, value in settings.items()
                if name not in PROGRAM_KNOBS]
    if THREADS in settings:
        command += ["--threads", settings[THREADS]]
    paths = ResultPaths(part/task.deck.name)
    seconds: list[tuple[float, float]] = []
    for _ in range(task.repeat):
        code, cpu, text = call(command, part/"messages.txt", task.time_limit)
        seconds.append((cpu, _of_increments(paths, cpu)))
        if code != 0:
            break
    verdict = read_verdict(paths)
    record |= {"code": code, **dict(zip(COSTS.values(), map(min, zip(*seconds)))),
               "is_whole": code in _OVER,
               **{name: verdict[name] for name in ("verdict", "reasons", "increments", "newton",
                                                   "cuts", "time") if name in verdict}}
    if code == 0 or (code == 3 and verdict.get("verdict") == "bad"):
        try:
            return record | {"status": "done", "measures": to_json(measure(paths))}
        except ResultError as problem:
            return record | {"message": str(problem)}
    return record | {"message": _why(code, text, verdict, task.time_limit)}


def _of_increments(paths: ResultPaths, cpu: float) -> float:
    """Processor time from the state at the start to the last increment [s]; `cpu` without any."""
    try:
        told = read_history(paths)["cpu"]
    except (ResultError, ValueError):
        return cpu
    return float(told[-1] - told[0]) if len(told) > 1 else cpu


def _why(code: int, text: str, verdict: dict[str, Any], limit: float | None) -> str:
    if code == -9 and limit is not None and text == _LATE:
        return f"not done after {limit:g} s (--time-limit)"
    if code < 0:
        return f"the program was ended by signal {-code}"
    if code == 130:
        return "interrupted"
    lines = [line for line in text.splitlines() if "error" in line] or text.splitlines()[-1:]
    return str(verdict.get("message") or " ".join(lines) or f"exit code {code}")


_LATE = "late"


def call(command: Sequence[str], log: Path, limit: float | None) -> tuple[int, float, str]:
    """Exit code, CPU time of the process, user and system [s], and what it said."""
    late = threading.Event()

    def end() -> None:
        late.set()
        process.kill()

    with log.open("w+", encoding="utf-8", errors="replace") as out:
        try:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=out)
        except OSError as problem:
            raise StudyError(f"cannot run {command[0]}: {problem.strerror}") from None
        timer = threading.Timer(limit, end) if limit is not None else None
        if timer:
            timer.start()
        try:
            _, status, usage = os.wait4(process.pid, 0)
        finally:
            if timer:
                timer.cancel()
        code = process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        text = _LATE if late.is_set() else out.read()
    return code, usage.ru_utime + usage.ru_stime, text


def sweep(folder: Path) -> None:
    """Remove what processes of this machine that are gone have left unfinished."""
    for part in folder.glob("members/*.part-*"):
        host, _, rest = part.name.partition(".part-")[2].rpartition("-")[0].rpartition("-")
        if host == socket.gethostname() and rest.isdigit() and not _is_alive(int(rest)):
            shutil.rmtree(part, ignore_errors=True)


def _is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True


# --- many of them ------------------------------------------------------------------------------

def load_executor(name: str) -> Callable[[], Executor]:
    """The function `module:callable` that makes an executor, the working folder searched too."""
    module, colon, attribute = name.partition(":")
    if not (module and colon and attribute):
        raise StudyError(f"--executor {name}: give MODULE:CALLABLE, a function without arguments "
                         "that returns a concurrent.futures.Executor")
    sys.path.insert(0, os.getcwd())
    try:
        made: Callable[[], Executor] = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError) as problem:
        raise StudyError(f"--executor {name}: {problem}") from None
    finally:
        sys.path.remove(os.getcwd())
    return made


@contextmanager
def executor_of(name: str | None, jobs: int) -> Iterator[Executor]:
    """The executor that `name` makes; else threads, each of which waits for a process."""
    executor = load_executor(name)() if name else ThreadPoolExecutor(jobs)
    if not callable(getattr(executor, "submit", None)):
        raise StudyError(f"--executor {name}: it gives {executor!r}, which has no submit()")
    try:
        yield executor
    except BaseException:
        executor.shutdown(wait=False, cancel_futures=True)
        raise
    executor.shutdown(wait=True)


def run_all(tasks: Sequence[Task], executor: Executor, bar: Progress) -> dict[int, dict[str, Any]]:
    """Records of all members by index; whatever happens to one of them is its record."""
    futures: dict[Future[dict[str, Any]], Task] = {executor.submit(run_member, task): task
                                                   for task in tasks}
    records: dict[int, dict[str, Any]] = {}
    bar.show(0, 0)
    try:
        for future in as_completed(futures):
            member = futures[future].member
            try:
                records[member.index] = future.result()
            except StudyError:
                raise
            except Exception as problem:
                records[member.index] = {"status": "failed", "settings": member.settings,
                                         "message": f"{type(problem).__name__}: {problem}"}
            bar.show(len(records), sum(r["status"] != "done" for r in records.values()))
    finally:
        bar.end()
    return records


class Progress:
    """A bar on a terminal; nothing anywhere else."""

    def __init__(self, total: int, out: TextIO) -> None:
        self.total = total
        self._out = out
        self._is_shown = out.isatty() and total > 0
        self._start = time.monotonic()

    def show(self, done: int, failed: int) -> None:
        if self._is_shown:
            seconds = time.monotonic() - self._start
            self._out.write("\r" + bar_text(done, failed, self.total, seconds))
            self._out.flush()

    def end(self) -> None:
        if self._is_shown:
            self._out.write("\n")


def bar_text(done: int, failed: int, total: int, seconds: float, width: int = 30) -> str:
    """`[####......] 4 of 10, 1 failed, 12 s`"""
    full = width*done//total
    text = f"[{'#'*full}{'.'*(width - full)}] {done} of {total}"
    return f"{text}{f', {failed} failed' if failed else ''}, {seconds:.0f} s"


def find_program(named: str | None, precision: str = "double") -> str:
    """The program of a precision: as named, in the source tree, or, of double, that of the package
    or on the path."""
    folder = PRECISIONS[precision]
    built = Path(__file__).resolve().parents[3]/"build"/folder/"emcon"
    on_path = shutil.which("emcon") if precision == "double" else None
    packed = packed_program() if precision == "double" else None
    choices: Iterable[str | None] = [named] if named else [str(built), packed, on_path]
    for choice in choices:
        found = shutil.which(choice) if choice else None
        if found:
            return str(Path(found).resolve())
    if precision != "double":
        raise StudyError(f"there is no program of {_LONG[precision]} precision, {named or built}; "
                         f"make app PRECISION={precision} builds it, --{precision}-program names "
                         "another")
    raise StudyError(f"no program {named or 'emcon'}: it is not on the path; make app builds it, "
                     "--program names it")


_LONG = {"single": "single", "quad": "quadruple"}


def build_of(program: str) -> str:
    """A checksum of the program: the same version may have been built anew."""
    try:
        return hashlib.sha256(Path(program).read_bytes()).hexdigest()[:16]
    except OSError as problem:
        raise StudyError(f"cannot read {program}: {problem.strerror}") from None


def version_of(program: str) -> str:
    """What `emcon --version` says."""
    try:
        done = subprocess.run([program, "--version"], capture_output=True, text=True, timeout=60)
    except (OSError, subprocess.TimeoutExpired) as problem:
        raise StudyError(f"cannot run {program}: {problem}") from None
    if done.returncode != 0:
        raise StudyError(f"{program} --version ends with {done.returncode}: {done.stderr.strip()}")
    return done.stdout.strip()
