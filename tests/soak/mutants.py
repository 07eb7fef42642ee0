"""Do the tests notice a wrong line of the numerics? `make mutants COUNT=80`

    .venv/bin/python tests/soak/mutants.py [--count N] [--seed N] [--since COMMIT] [--folders ...]

Each mutant is the library with one small mistake in one line: a relation or a sign turned round, a
factor halved, a condition left out, an assignment not made. Lines are drawn by chance from those of
`contact`, `march`, `terms` and `solid` that have changed since the last version; with `--since=`
and nothing behind it from all. The kernel tests are run, then the runs of tests/scenes file by file,
until one fails. What compiles to the same object means nothing and is not counted. Mutants that
nobody notices are printed with their line; the exit code is 1 where more than a twentieth are.
Two mutants are tried at a time, in copies of the repository below build/mutants.
"""

import argparse
import concurrent.futures
import dataclasses
import os
import pathlib
import queue
import random
import re
import shutil
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDERS = ["contact", "march", "terms", "solid"]
GOAL = 0.95
#: What a mutant may make endless [s].
PATIENCE = 120
#: What tests of runs may take before a mutant counts as not noticed [s].
LONGEST = 240

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
                  r"contains|module|pure|subroutine|function|procedure|associate|else$|allocate|"
                  r"deallocate|import|interface|!|#|$)")


@dataclasses.dataclass(frozen=True)
class Mutant:
    """One line of one file with a mistake in it."""

    file: str
    line: int
    before: str
    after: str

    def __str__(self):
        return f"{self.file}:{self.line}\n  - {self.before.strip()}\n  + {self.after.strip()}"


def code_of(line):
    """A line without its comment; texts are left alone as they hold no relations between blanks."""
    return line.split("!")[0].rstrip() if "'" not in line and '"' not in line else ""


def mistakes(line):
    """All that a line can be made into."""
    code = code_of(line)
    if IDLE.match(code):
        return []
    found = [code[:hit.start()] + put + code[hit.end():]
             for pattern, put in MISTAKES for hit in pattern.finditer(code)]
    if STATEMENT.match(code) and "=>" not in code:
        found.append(re.match(" *", code)[0] + "continue")
    return found


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
        text = (ROOT / name).read_text().splitlines()
        found += [Mutant(name, k, text[k - 1], after)
                  for k in numbers for after in mistakes(text[k - 1])]
    random.Random(seed).shuffle(found)
    return found


class Place:
    """A copy of the repository with what is built, in which one mutant is tried at a time."""

    def __init__(self, number):
        self.folder = ROOT / "build" / "mutants" / str(number)
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)
        for name in ("src_f90", "tests", "input_decks", "docs", ".ci", "pywrap", "Makefile",
                     "pyproject.toml", "README.md"):
            copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy2
            copy(ROOT / name, self.folder / name)
        (self.folder / ".venv").symlink_to(ROOT / ".venv")
        shutil.copytree(ROOT / "build" / "release", self.folder / "build" / "release",
                        ignore=shutil.ignore_patterns("py"), symlinks=True)
        settings = (ROOT / "build" / "config.mk").read_text()
        (self.folder / "build" / "config.mk").write_text(
            settings.replace(f" {ROOT}\n", f" {self.folder}\n", 1))
        shutil.copystat(ROOT / "build" / "config.mk", self.folder / "build" / "config.mk")
        self.make()

    def run(self, command, timeout, **options):
        """Exit code; 1 where it takes too long."""
        try:
            return subprocess.run(command, cwd=self.folder, stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL, timeout=timeout, **options).returncode
        except subprocess.TimeoutExpired:
            return 1

    def make(self):
        return self.run(["make", "--silent", "app", "kernels"], 600)

    def noticed_by(self, mutant):
        """Name of the test that notices; "" if none, None if it is no mutant."""
        path = self.folder / mutant.file
        sound = path.read_text()
        made = self.folder / "build/release/obj" / (path.stem + ".o")
        object_before = made.read_bytes()
        lines = sound.splitlines(keepends=True)
        lines[mutant.line - 1] = mutant.after + "\n"
        path.write_text("".join(lines))
        try:
            if self.make() != 0 or made.read_bytes() == object_before:
                return None
            return self.first_failure()
        finally:
            path.write_text(sound)
            self.make()

    def first_failure(self):
        program = self.folder / "build/release/kernels"
        if self.run([program], PATIENCE) != 0:
            return "kernels"
        begin = time.monotonic()
        for test in tests_of_runs():
            rest = LONGEST - (time.monotonic() - begin)
            if rest < 0:
                break
            done = self.run([sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider",
                             f"tests/{test}"], max(rest, 1.0))
            if done != 0:
                return test
        return ""


def tests_of_runs():
    """Tests of whole runs, those first that see much for their time."""
    first = ["scenes/test_friction.py", "scenes/test_contact_scenes.py", "scenes/test_soft_contact.py",
             "scenes/test_explicit.py", "scenes/test_massless.py", "scenes/test_rigid.py"]
    others = sorted(p.relative_to(ROOT / "tests").as_posix()
                    for p in (ROOT / "tests" / "scenes").glob("test_*.py"))
    return first + [name for name in others if name not in first]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--count", type=int, default=80, help="mutants that are tried")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--since", metavar="COMMIT", help="lines changed since then; empty: all")
    parser.add_argument("--folders", nargs="+", default=FOLDERS)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    since = last_version() if options.since is None else options.since
    waiting = draw(options.folders, since, options.seed)
    print(f"{len(waiting)} mutants of lines "
          + (f"changed since {since[:12]}" if since else "of " + " ".join(options.folders)))
    places = queue.SimpleQueue()
    for k in range(options.jobs):
        places.put(Place(k))

    def attempt(mutant):
        place = places.get()
        try:
            return place.noticed_by(mutant)
        finally:
            places.put(place)

    noticed, missed = 0, []
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        waiting = iter(waiting)
        running = {}
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
                if by:
                    noticed += 1
                elif by is not None:
                    missed.append(mutant)
                    print(mutant, flush=True)
    total = noticed + len(missed)
    print(f"{noticed} of {total} mutants noticed ({noticed/max(total, 1):.0%})")
    return noticed < GOAL*total


if __name__ == "__main__":
    sys.exit(main())
