"""What the scene report expects of a run against the run: CPU time and memory of each deck.

`report_cost.py [DECK...]`, without decks all of input_decks/. One line each: expected, found, ratio.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("EMCON", str(ROOT / "build/release/emcon"))


def measured(*arguments):
    """Text, CPU seconds and megabytes of a run of the program."""
    with tempfile.TemporaryFile("w+") as out:
        process = subprocess.Popen([PROGRAM, *arguments], stdout=out, stderr=subprocess.DEVNULL)
        _, _, usage = os.wait4(process.pid, 0)
        out.seek(0)
        return out.read(), usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def main(decks):
    print(f"{'deck':20}{'expected s':>12}{'found s':>10}{'ratio':>7}"
          f"{'expected MB':>13}{'found MB':>10}{'ratio':>7}{'check s':>9}")
    for deck in decks:
        text, spent, _ = measured("check", deck, "--json")
        (cost,) = json.loads(text)["cost"]
        with tempfile.TemporaryDirectory() as folder:
            _, seconds, megabytes = measured(deck, "--quiet", "--output", folder)
        expected = cost["cpu_seconds"], cost["memory_megabytes"]
        print(f"{pathlib.Path(deck).stem:20}{expected[0]:12.2f}{seconds:10.2f}"
              f"{expected[0] / seconds:7.2f}{expected[1]:13.1f}{megabytes:10.1f}"
              f"{expected[1] / megabytes:7.2f}{spent:9.2f}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:] or [str(p) for p in sorted((ROOT / "input_decks").glob("*.inp"))])
