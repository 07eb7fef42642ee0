"""Which lines of the numerics each kernel suite and each test of whole runs passes, in release.

`line_trace.c` puts breakpoints at the places that the debugger's table of lines names: the programs
of build/release are asked as they are, at their own speed, and nothing is built for it. What was
found is kept below build/mutants until the program or a file of tests changes.
"""

import bisect
import collections
import concurrent.futures
import dataclasses
import json
import os
import pathlib
import re
import shlex
import struct
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
RELEASE = pathlib.Path("build/release")
KEPT = ROOT / "build" / "mutants"
#: Tests of whole runs that see much for their time.
FILES = [f"scenes/test_{name}.py" for name in (
    "contact_output", "scene_report", "contact_scenes", "friction", "massless", "rigid", "verdict",
    "segments", "restitution", "explicit", "midside", "head_on", "corners", "increments",
    "surface_pressure", "linear", "contact_damping", "friction_at_rest", "complementarity", "statics",
    "quasi_static", "round_bodies", "schemes", "contact_robustness")]
#: CPU time that a single test of these may take [s]; what takes longer is left out.
DEAREST = 10


@dataclasses.dataclass(frozen=True)
class Passed:
    """The lines that a suite or a test passes."""

    name: str
    seconds: float
    lines: dict  # file -> numbers of the lines that it runs


def sources(folders):
    """Names of the files of folders of `src_f90`, as the table of lines has them, and their paths."""
    return {path.name: str(path.relative_to(ROOT)) for folder in folders
            for path in (ROOT / "src_f90" / folder).glob("*.f90")}


def places(program, files):
    """Addresses of `program` in rising order, each with what stands there: (file, line).

    A loop may be entered behind where its line begins: all addresses count, not beginnings alone."""
    table = subprocess.run(["objdump", "--dwarf=decodedline", "-w", program], cwd=ROOT, check=True,
                           capture_output=True, text=True).stdout
    found = {}
    for row in re.finditer(r"^(\w+\.f90) +(\d+) +0x([0-9a-f]+)", table, re.M):
        if row[1] in files:
            found.setdefault(int(row[3], 16), (files[row[1]], int(row[2])))
    return sorted(found.items())


class Tracer:
    """Runs of one program whose lines are written down."""

    def __init__(self, program, files, folder=KEPT):
        folder.mkdir(parents=True, exist_ok=True)
        self.program = ROOT / program
        told = places(self.program, files)
        self.place = sorted({where for _, where in told})
        number = {where: k for k, where in enumerate(self.place)}
        name = f"{self.program.name}_{os.getpid()}"
        self.tool, self.table, self.out = (folder / f"{name}.{part}" for part in (
            "tracer", "places", "out"))
        self.table.write_bytes(b"".join(struct.pack("=QQ", address, number[where])
                                        for address, where in told))
        subprocess.run(["cc", "-std=c99", "-O2", pathlib.Path(__file__).parent / "line_trace.c",
                        "-o", self.tool], check=True)

    @property
    def command(self):
        return [str(part) for part in (self.tool, self.table, self.out, self.program)]

    def script(self):
        """A program in the place of the one that is looked at."""
        path = self.tool.with_suffix(".sh")
        path.write_text(f'#!/bin/sh\nexec {shlex.join(self.command)} "$@"\n')
        path.chmod(0o755)
        return path

    def told(self):
        """(test, CPU time, lines) of each run since the last call."""
        text = self.out.read_text() if self.out.exists() else ""
        self.out.unlink(missing_ok=True)
        for row in text.splitlines():
            test, seconds, bits = row.split("\t")
            lines = collections.defaultdict(set)
            for k, digit in enumerate(bits):
                for j in range(4):
                    if int(digit, 16) >> j & 1:
                        file, line = self.place[4*k + j]
                        lines[file].add(line)
            yield test, float(seconds), lines

    def close(self):
        for path in (self.tool, self.table, self.out, self.tool.with_suffix(".sh")):
            path.unlink(missing_ok=True)


def kept(name, made_of, measure):
    """What `measure` found, unless it is kept in a file newer than all of `made_of`."""
    path = KEPT / f"{name}.json"
    if not path.exists() or path.stat().st_mtime < max(p.stat().st_mtime for p in made_of):
        found = [(test, seconds, {file: sorted(lines) for file, lines in lines.items()})
                 for test, seconds, lines in measure()]
        path.write_text(json.dumps(found))
    return [Passed(*row) for row in json.loads(path.read_text())]


def lines_of_suites(folders):
    """The suites of the kernel tests with the lines of `folders` that each runs."""

    def measure():
        tracer = Tracer(RELEASE / "kernels", sources(folders))
        for suite in suites():
            done = subprocess.run([*tracer.command, suite], cwd=ROOT, stdout=subprocess.DEVNULL,
                                  check=False)
            for _, seconds, lines in tracer.told():
                # One that fails without a mutant notices none.
                if done.returncode == 0:
                    yield suite, seconds, lines
        tracer.close()

    return kept("suites_" + "_".join(folders), [ROOT / RELEASE / "kernels"], measure)


def suites():
    """Names of the suites of the kernel tests."""
    return re.findall(r'call run\("(\w+)"', (ROOT / "tests/kernels/main.F90").read_text())


def lines_of_runs(folders, jobs=None):
    """The tests of whole runs with the lines of `folders` that the program runs in each.

    A test whose runs others look at too stands for its file."""
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        found = pool.map(lines_of_file, FILES, [folders]*len(FILES))
        return [passed for of_file in found for passed in of_file]


def lines_of_file(file, folders):
    """The same of the tests of one file."""

    def measure():
        tracer = Tracer(RELEASE / "emcon", sources(folders))
        subprocess.run([sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider",
                        f"tests/{file}"], cwd=ROOT, stdout=subprocess.DEVNULL, check=False,
                       env=os.environ | {"EMCON": str(tracer.script()), "EMCON_PATIENCE": "20"})
        seconds, lines = collections.Counter(), collections.defaultdict(
            lambda: collections.defaultdict(set))
        for test, time, passed in tracer.told():
            name, phase = test.rsplit(" ", 1) if test else (f"tests/{file}", "")
            name = name if phase == "(call)" else name.split("::")[0]
            seconds[name] += time
            for source, numbers in passed.items():
                lines[name][source] |= numbers
        tracer.close()
        for name, time in seconds.items():
            if time < DEAREST:
                yield name, time, lines[name]

    return kept(f"{pathlib.Path(file).stem}_{'_'.join(folders)}",
                [ROOT / RELEASE / "emcon", ROOT / "tests" / file], measure)


class Code:
    """Which lines have code of their own; that of others is part of what stands before them. Of the
    library: the program leaves out what only host programs call."""

    def __init__(self, folders):
        self.lines = collections.defaultdict(list)
        library = places(RELEASE / "libemcon.so", sources(folders))
        for file, line in sorted({where for _, where in library}):
            self.lines[file].append(line)

    def passing(self, tests, file, numbers):
        """Those of `tests` that run one of the lines `numbers`, or what these are part of."""
        known = self.lines[file]
        before = known[max(bisect.bisect_left(known, numbers[0]) - 1, 0):][:1]

        def all_at(lines):
            return [test for test in tests if any(k in test.lines.get(file, ()) for k in lines)]

        # Optimised code may stand at the line before alone.
        return all_at([k for k in numbers if k in known]) or all_at(before)
