"""Which lines of the library tests run: `make coverage`.

    .venv/bin/python tests/soak/kernel_coverage.py [--lines FOLDER] [COMMAND...]

Runs the kernel tests of MODE=coverage, or COMMAND with the program of that mode in the environment
variable EMCON, and prints for each folder of `src_f90` the part of its lines that ran;
`--lines march` prints which lines of `march` did not.
"""

import argparse
import collections
import dataclasses
import gzip
import json
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build" / "coverage"
SOURCES = ROOT / "src_f90"
#: What stands before the counters of a function in a file of gcov.
COUNTERS = (0x01a10000).to_bytes(4, "little")


@dataclasses.dataclass(frozen=True)
class Suite:
    """One suite of the kernel tests."""

    name: str
    seconds: float
    lines: dict  # file -> numbers of the lines that it runs


def has_run(path):
    """Has anything of a file been run? Counters that are all zero are left out, which their length
    tells: it is negative."""
    data, place = path.read_bytes(), -1
    while (place := data.find(COUNTERS, place + 1)) >= 0:
        if int.from_bytes(data[place + 4:place + 8], "little", signed=True) > 0:
            return True
    return False


def lines_run(objects, folders=()):
    """File -> {line: how often it ran}, of the files of `folders` of `src_f90`; of all if none is
    named."""
    names = {path.stem for folder in folders for path in (SOURCES / folder).iterdir()}
    counters = [path for path in sorted(objects.glob("*.gcda"))
                if not names or path.stem in names and has_run(path)]
    found = collections.defaultdict(collections.Counter)
    if not counters:
        return found
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["gcov", "--json-format", *counters], cwd=folder, check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for path in pathlib.Path(folder).glob("*.gcov.json.gz"):
            with gzip.open(path) as file:
                told = json.load(file)
            for source in told["files"]:
                name = (ROOT / source["file"]).resolve()
                if not name.is_relative_to(SOURCES):
                    continue
                for line in source["lines"]:
                    found[name.relative_to(SOURCES)][line["line_number"]] += line["count"]
    return found


def count_lines(command, **options):
    """Run `command` with counters at zero; CPU time that it took [s]."""
    for path in (BUILD / "obj").glob("*.gcda"):
        path.unlink()
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run(command, cwd=ROOT, env=os.environ | {"EMCON": str(BUILD / "emcon")},
                          **options)
    if done.returncode != 0:
        sys.exit(f"{command[0]} ended with code {done.returncode}")
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def lines_of_suites(folders):
    """The suites of the kernel tests with the lines of `folders` that each runs, measured once for
    each program of MODE=coverage."""
    program = BUILD / "kernels"
    kept = BUILD / "suites"
    kept.mkdir(exist_ok=True)
    suites = []
    main = (ROOT / "tests/kernels/main.F90").read_text()
    for name in re.findall(r'call run\("(\w+)"', main):
        path = kept / f"{name}_{'_'.join(folders)}.json"
        if not path.exists() or path.stat().st_mtime < program.stat().st_mtime:
            seconds = count_lines([str(program), name], stdout=subprocess.DEVNULL)
            lines = {f"src_f90/{file}": sorted(k for k, n in counts.items() if n > 0)
                     for file, counts in lines_run(BUILD / "obj", folders).items()}
            path.write_text(json.dumps({"seconds": seconds, "lines": lines}))
        suites.append(Suite(name, **json.loads(path.read_text())))
    return suites


def ranges(numbers):
    """[3, 4, 5, 9] as "3-5 9"."""
    text, first, last = [], None, None
    for n in [*numbers, None]:
        if first is not None and n != last + 1:
            text.append(f"{first}-{last}" if last > first else f"{first}")
            first = None
        if first is None:
            first = n
        last = n
    return " ".join(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--lines", metavar="FOLDER", help="print which lines of it did not run")
    parser.add_argument("command", nargs="*", help="by default the kernel tests")
    options = parser.parse_args()
    count_lines(options.command or [str(BUILD / "kernels")])
    found = lines_run(BUILD / "obj")
    total = collections.Counter()
    ran = collections.Counter()
    for name, lines in sorted(found.items()):
        folder = name.parts[0]
        total[folder] += len(lines)
        ran[folder] += sum(n > 0 for n in lines.values())
        never = sorted(k for k, n in lines.items() if n == 0)
        if folder == options.lines and never:
            print(f"{name}: {ranges(never)}")
    print(f"{'folder':12} {'lines':>7} {'run':>7}")
    for folder in sorted(total):
        print(f"{folder:12} {total[folder]:7} {ran[folder]/total[folder]:7.1%}")


if __name__ == "__main__":
    main()
