"""Do the tests notice a wrong line of the numerics? `make mutants COUNT=80`

    .venv/bin/python tests/soak/mutants.py [--count N] [--seed N] [--since COMMIT] [--folders ...]
    .venv/bin/python tests/soak/mutants.py --try src_f90/march/emcon_overlap_check.f90:120 'n = n - 1'

Each mutant is the library with one small mistake in one line: a relation or a sign turned round, a
factor halved, a condition left out, an assignment not made. Lines are drawn by chance from those of
contact, of elements and of steps (`FOLDERS`) that have changed since the last version; with
`--since=` and nothing behind it from all. `--try` puts a text of one's own into a line.

The kernel suites that run this line (`traced_lines.py` knows) come first, the quickest at their
head; then the tests of whole runs that do, until one fails. What compiles to the same object means
nothing and is not counted. Mutants that nobody notices are printed with their line; the exit code
is 1 where more than a twentieth are. Nothing but the changed file is compiled, beside build/release,
which stays as it is.
"""

import argparse
import collections
import concurrent.futures
import dataclasses
import os
import pathlib
import random
import re
import resource
import shlex
import shutil
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from scene_tools import RUBBISH  # noqa: E402
from traced_lines import KEPT, RELEASE, ROOT, Code, lines_of_runs, lines_of_suites  # noqa: E402

FOLDERS = ["surfaces", "touch", "contact", "terms", "solid", "state", "active", "march"]
GOAL = 0.95
#: A mutant may never end: CPU time of a program, in times of what it takes and more [s], and of the
#: tests that look at it.
SLOWER, GRACE, LONGEST_OF_TESTS = 5, 2, 600
#: Memory of any program [bytes].
ROOM = 4 << 30
#: CPU time that kernel suites and tests of runs may take before a mutant counts as not noticed [s].
LONGEST = 30

#: Mistakes: what to look for in the code of a line, and what stands there instead.
MISTAKES = [
    (re.compile(pattern), put)
    for pattern, put in [
        (r" <= ", " > "), (r" >= ", " < "), (r" < ", " >= "), (r"(?<!=) > ", " <= "),
        (r" == ", " /= "), (r" /= ", " == "), (r"\.and\.", ".or."), (r"\.or\.", ".and."),
        (r"\.not\. ?", ""), (r" \+ ", " - "), (r" - ", " + "), (r"(?<=[\w)])\*(?=[\w(])", "/"),
        (r"\bmin\(", "max("), (r"\bmax\(", "min("), (r"= \.true\.", "= .false."),
        (r"= \.false\.", "= .true."), (r"\b0\.5_wp", "0.25_wp"), (r"\b2\.0_wp", "1.0_wp"),
        (r"\b1\.0_wp", "2.0_wp"), (r"\babs\(", "("), (r"= -", "= "),
    ]
]  # fmt: skip
#: Statements that a mutant may leave out: assignments and calls of one line.
STATEMENT = re.compile(r"^ *(?! |do )(?:[\w%(),: +\-]+ = [^&]*|call \w[^&]*)$")
#: Lines without numerics: declarations, interfaces, use.
IDLE = re.compile(r"^ *(?:use|type|integer|real|logical|character|class|private|public|implicit|end|"
                  r"contains|module|submodule|pure|subroutine|function|procedure|associate|else$|allocate|"
                  r"deallocate|import|interface|!|#|$)")


@dataclasses.dataclass(frozen=True)
class Mutant:
    """One line of one file with a mistake in it."""

    file: str
    line: int
    before: str
    after: str

    @staticmethod
    def of(place, after):
        """A text of one's own in a line, FILE:LINE."""
        file, line = place.split(":")
        return Mutant(file, int(line), (ROOT / file).read_text().splitlines()[int(line) - 1], after)

    def __str__(self):
        return f"{self.file}:{self.line}\n  - {self.before.strip()}\n  + {self.after.strip()}"


def code_of(line):
    """A line without its comment; texts are left alone as they hold no relations between blanks."""
    return line.split("!")[0].rstrip() if "'" not in line and '"' not in line else ""


def mistakes(line, is_behind=False):
    """All that a line can be made into; `is_behind`: it goes on with the statement above it."""
    code = code_of(line)
    if IDLE.match(code):
        return []
    found = [code[:hit.start()] + put + code[hit.end():]
             for pattern, put in MISTAKES for hit in pattern.finditer(code)]
    if STATEMENT.match(code) and "=>" not in code and not is_behind:
        found.append(re.match(" *", code)[0] + "continue")
    return found


def statement(lines, number):
    """Numbers of the lines of the statement that goes through a line: counters know one of them."""
    first = last = number
    while first > 1 and lines[first - 2].endswith("&"):
        first -= 1
    while lines[last - 1].endswith("&"):
        last += 1
    return range(first, last + 1)


def changed_lines(folders, since):
    """File -> numbers of its lines that are not those of `since`, all of them if that is empty."""
    lines = {}
    for folder in folders:
        for path in sorted((ROOT / "src_f90" / folder).glob("*.f90")):
            name = str(path.relative_to(ROOT))
            if not since:
                lines[name] = range(1, len(path.read_text().splitlines()) + 1)
                continue
            diff = git("diff", "--unified=0", since, "--", name)
            hunks = re.findall(r"^@@ -\S+ \+(\d+)(?:,(\d+))? @@", diff, re.M)
            lines[name] = [k for start, n in hunks for k in range(int(start), int(start)
                                                                  + int(n or 1))]
    return lines


def git(*arguments):
    """What git says; nothing where this is no clone."""
    return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True,
                          check=False).stdout


def last_version():
    """The commit that wrote the version of the library; empty where git does not know."""
    text = (ROOT / "pyproject.toml").read_text()
    version = re.search(r'^version = ".*"$', text, re.M)[0]
    return git("log", "--format=%H", "-1", f"-S{version}", "--", "pyproject.toml").strip()


def draw(folders, since, seed):
    """All mutants in an order of chance."""
    found = []
    for name, numbers in changed_lines(folders, since).items():
        text = ["", *(ROOT / name).read_text().splitlines()]
        found += [Mutant(name, k, text[k], after) for k in numbers
                  for after in mistakes(text[k], is_behind=text[k - 1].endswith("&"))]
    random.Random(seed).shuffle(found)
    return found


class Build:
    """What make would call for build/release: how a file is compiled and the programs are linked."""

    def __init__(self, files):
        new = [f"-W{name}" for name in files]
        told = subprocess.run(["make", "--dry-run", "V=1", *new, "lib", "app", "kernels"], cwd=ROOT,
                              capture_output=True, text=True, check=True).stdout
        calls = [shlex.split(line) for line in told.replace("\\\n", " ").splitlines()
                 if " -o " in line]
        self.call = {call[call.index("-o") + 1]: call for call in calls}

    def compile(self, name, text, folder):
        """The object made of a file that reads `text` now; None where that is no Fortran."""
        path = pathlib.Path(name)
        source, made = folder / path.name, folder / (path.stem + ".o")
        source.write_text(text)
        call = [part for part in self.call[str(RELEASE / "obj" / made.name)]
                if not part.startswith("-J")]
        call[call.index("-c") + 1], call[call.index("-o") + 1] = str(source), str(made)
        # Places of code in its line are no difference: -g0.
        done = subprocess.run([*call, "-g0", f"-J{folder}", f"-I{RELEASE/'mod'}", f"-I{path.parent}"],
                              cwd=ROOT, capture_output=True, check=False)
        return made if done.returncode == 0 else None

    def link(self, program, made, folder):
        """A program or the library with `made` in the place of what it has."""
        call = list(self.call[str(RELEASE / program)])
        call[call.index("-o") + 1] = str(folder / program)
        own = str(RELEASE / "obj" / made.name)
        if own in call:
            call[call.index(own)] = str(made)
        else:
            call.insert(call.index(str(RELEASE / "libemcon.a")), str(made))
        subprocess.run([*call, "-Wl,--strip-debug"], cwd=ROOT, check=True)
        return folder / program


class Trial:
    """Mutants tried one at a time, in a folder below build/mutants."""

    def __init__(self, build, code, suites, runs):
        self.folder = ROOT / "build" / "mutants" / str(os.getpid())
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)
        self.build = build
        self.code = code
        self.suites = suites
        self.runs = runs
        self.sound = {}
        self.unsound = set()

    def noticed_by(self, mutant):
        """Name of the test that notices; "" if none, None if it is no mutant."""
        text = (ROOT / mutant.file).read_text()
        lines = text.splitlines(keepends=True)
        lines[mutant.line - 1] = mutant.after + "\n"
        made = self.build.compile(mutant.file, "".join(lines), self.folder)
        if made is None:
            return None
        numbers = statement(text.splitlines(), mutant.line)
        by = self.failing_suite(made, self.code.passing(self.suites, mutant.file, numbers))
        # What a kernel test notices means something: the file as it is need not be compiled.
        if by or self.means_nothing(mutant.file, text, made):
            return by or None
        return self.failing_run(made, self.code.passing(self.runs, mutant.file, numbers))

    def means_nothing(self, name, text, made):
        """Does the file as it is compile to the same object?"""
        own = made.read_bytes()
        if name not in self.sound:
            # In the same place: objects have the path of their source in messages.
            self.sound[name] = self.build.compile(name, text, self.folder).read_bytes()
            made.write_bytes(own)
        return own == self.sound[name]

    def failing_suite(self, made, suites):
        """Name of the first of these suites that fails, the quickest at their head."""
        chosen = within(sorted(suites, key=lambda s: s.seconds), LONGEST)
        program = self.build.link("kernels", made, self.folder) if chosen else None
        for suite in chosen:
            limit = GRACE + SLOWER*suite.seconds
            if call([program, suite.name], self.folder, limit, RUBBISH).returncode != 0:
                return suite.name
        return ""

    def failing_run(self, made, runs):
        """Name of the first of these tests that fails; one that fails anyway has noticed nothing."""
        program = self.build.link("emcon", made, self.folder) if runs else None
        while chosen := within(by_turns([r for r in runs if r.name not in self.unsound]), LONGEST):
            failed = failing_test(chosen, program)
            if not failed:
                break
            if not failing_test([r for r in chosen if r.name == failed], ROOT / RELEASE / "emcon"):
                return failed
            self.unsound.add(failed)
        return ""


def within(tests, seconds):
    """The first of `tests`, as many as take so long together; one in any case."""
    chosen = []
    for test in tests:
        if chosen and test.seconds > seconds:
            break
        seconds -= test.seconds
        chosen.append(test)
    return chosen


def by_turns(tests):
    """The quickest test of each file, quickest first, then the next one of each."""
    turns = collections.Counter()
    order = {}
    for test in sorted(tests, key=lambda t: t.seconds):
        file = test.name.split("::")[0]
        order[test.name] = (turns[file], test.seconds)
        turns[file] += 1
    return sorted(tests, key=lambda t: order[t.name])


def failing_test(tests, program):
    """The first of these tests that fails; `program` runs them, each time for so long at most."""
    limit = GRACE + SLOWER*max(test.seconds for test in tests)
    limited = KEPT / f"limited_{os.getpid()}.sh"
    limited.write_text(f'#!/bin/sh\nulimit -t {int(limit) + 1}\nexec {program} "$@"\n')
    limited.chmod(0o755)
    done = call([sys.executable, "-m", "pytest", "-q", "-x", "--tb=no", "-p", "no:cacheprovider",
                 *(f"tests/{test.name}" for test in tests)], ROOT, LONGEST_OF_TESTS,
                {"EMCON_PATIENCE": "20", "EMCON": str(limited)})
    told = [test.name for test in tests if re.search(
        rf"^(?:FAILED|ERROR) tests/{re.escape(test.name)}(?: |$|::)", done.stdout, re.M)]
    return told[0] if told else ""


def call(command, folder, seconds, place=None):
    """What a command gives; its code is not 0 where one of its programs takes more than `seconds`."""

    def limit():
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 2))
        resource.setrlimit(resource.RLIMIT_AS, (ROOM, ROOM))

    try:
        return subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, timeout=40*(seconds + 30),
                              stderr=subprocess.DEVNULL, text=True, errors="replace",
                              preexec_fn=limit, env=os.environ | (place or {}), check=False)
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(command, 1, "")


def main():
    options = read_options()
    since = last_version() if options.since is None else options.since
    if options.put:
        waiting = [Mutant.of(*put) for put in options.put]
    else:
        waiting = draw(options.folders, since, options.seed)
        print(f"{len(waiting)} mutants of lines "
              + (f"changed since {since[:12]}" if since else "of " + " ".join(options.folders)))
    build = Build(sorted({mutant.file for mutant in waiting}))
    told = (Code(options.folders), lines_of_suites(options.folders),
            [] if options.kernels else lines_of_runs(options.folders, options.jobs))
    noticed, missed = 0, []
    with concurrent.futures.ProcessPoolExecutor(options.jobs, initializer=begin,
                                                initargs=(build, *told)) as pool:
        waiting, running = iter(waiting), {}
        while True:
            while len(running) < options.jobs and (
                    noticed + len(missed) + len(running) < options.count):
                mutant = next(waiting, None)
                if mutant is None:
                    break
                running[pool.submit(attempt, mutant)] = mutant
            if not running:
                break
            for task in concurrent.futures.wait(
                    running, return_when=concurrent.futures.FIRST_COMPLETED).done:
                mutant, by = running.pop(task), task.result()
                if by is None:
                    continue
                noticed += by != ""
                missed += [mutant] if by == "" else []
                if options.all or by == "":
                    print(mutant, f"\n  {by or 'NOT NOTICED'}", flush=True)
    total = noticed + len(missed)
    print(f"{noticed} of {total} mutants noticed ({noticed/max(total, 1):.0%})")
    return noticed < GOAL*total


def read_options():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--count", type=int, default=80, help="mutants that are tried")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--since", metavar="COMMIT", help="lines changed since then; empty: all")
    parser.add_argument("--folders", nargs="+", default=FOLDERS)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--kernels", action="store_true", help="ask the kernel tests alone")
    parser.add_argument("--all", action="store_true", help="print what is noticed too, and by what")
    parser.add_argument("--try", dest="put", nargs=2, action="append", metavar=("FILE:LINE", "TEXT"))
    return parser.parse_args()


def begin(*told):
    """Of each process that tries mutants."""
    global trial
    trial = Trial(*told)


def attempt(mutant):
    return trial.noticed_by(mutant)


if __name__ == "__main__":
    sys.exit(main())
