"""Which lines of the library tests run: `make coverage`.

    .venv/bin/python tests/soak/kernel_coverage.py [--lines FOLDER] [COMMAND...]

Runs the kernel tests of MODE=coverage, or COMMAND with the program of that mode in the environment
variable EMCON, and prints for each folder of `src_f90` the part of its lines that ran;
`--lines march` prints which lines of `march` did not.
"""

import argparse
import collections
import gzip
import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build" / "coverage"
SOURCES = ROOT / "src_f90"


def lines_run(objects):
    """File -> {line: how often it ran}, of the files of `src_f90`."""
    counters = sorted(objects.glob("*.gcda"))
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


def count_lines(command):
    """Run `command` with counters at zero."""
    for path in (BUILD / "obj").glob("*.gcda"):
        path.unlink()
    done = subprocess.run(command, cwd=ROOT, env=os.environ | {"EMCON": str(BUILD / "emcon")},
                          check=False)
    if done.returncode != 0:
        sys.exit(f"{command[0]} ended with code {done.returncode}")


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
