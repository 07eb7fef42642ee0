"""Programs and runs under the address and undefined-behaviour sanitizers: `make sanitize`.

    .venv/bin/python tests/soak/sanitize.py [--jobs 1] [PART...]

Programs of MODE=sanitize end at the first thing that is found. What they write about it goes into
files (of undefined behaviour in a shared library: to standard error); any such file is a failure,
also where the caller does not look at how the program ended. All parts are run, then it is shown.
"""

import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build" / "sanitize"
TESTS = [sys.executable, "-m", "pytest", "-q"]
SOAK = [sys.executable, ROOT / "tests/soak/soak.py", "--seed=1"]
EMBED = ROOT / "tests" / "embed"
#: What is compiled and linked with the library there; Python cannot load it with a sanitizer in it.
PROGRAMS = ["c", "c_query", "fortran", "fortran_77", "host_solid", "interface_c", "memory",
            "threads"]  # fmt: skip
PARTS = {
    "kernels": [BUILD / "kernels"],
    "programs": [*TESTS, *(EMBED / f"test_{name}.py" for name in PROGRAMS)],
    "decks": [*TESTS, ROOT / "tests/decks"],
    "runs": [*TESTS, f"{ROOT}/tests/scenes/test_input_decks.py::test_runs"],
    "fuzzers": [*SOAK, "--cases=40", "decks", "crossed", "restart"],
    "kills": [*SOAK, "--cases=5", "kill"],
}


def environment(folder):
    """What makes the programs of the tests those of MODE=sanitize; reports go to `folder`."""
    options = f"log_path={folder}/report:print_stacktrace=1"
    return os.environ | {
        "MODE": "sanitize",                           # of `make install`
        "EMCON": str(BUILD / "emcon"),
        "EMCON_PATIENCE": "10",
        "EMCON_OPENS": os.environ.get("EMCON_OPENS", "20000"),
        "ASAN_OPTIONS": f"{options}:detect_leaks=1",
        "UBSAN_OPTIONS": f"{options}:halt_on_error=1",
    }  # fmt: skip


def reports(folder):
    """What the sanitizers have written, by file."""
    return {path.name: path.read_text() for path in sorted(folder.glob("report.*"))}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="workers of pytest")
    parser.add_argument("part", nargs="*", choices=[[], *PARTS], help="all of them if none")
    options = parser.parse_args()
    failed = []
    with tempfile.TemporaryDirectory(prefix="emcon_sanitize_") as name:
        folder = pathlib.Path(name)
        for part in options.part or PARTS:
            begin = time.monotonic()
            workers = [f"-n{options.jobs}"] if "pytest" in PARTS[part] else []
            done = subprocess.run([*PARTS[part], *workers], cwd=ROOT, env=environment(folder))
            if done.returncode != 0:
                failed.append(f"{part} ended with code {done.returncode}")
            print(f"{part}: {time.monotonic() - begin:.0f} s", flush=True)
        for file, text in reports(folder).items():
            failed.append(f"{file}:\n{text}")
    print("\n".join(failed) or "nothing found")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
