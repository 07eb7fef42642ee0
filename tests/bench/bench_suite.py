"""The test decks of CalculiX unchanged through both codes: how far displacements differ.

    .venv/bin/python tests/bench/bench_suite.py [--ccx PROGRAM] [--suite FOLDER] [--update] [DECK...]

`PROGRAM` is that of CalculiX, by default `ccx` of the path, `FOLDER` the one of its decks, by
default where the Debian package calculix-ccx-test puts them; where one of them is missing, that is
all that is told. A deck that EMCON refuses is a line with the first reason. Differences are
relative to the largest displacement of the deck; those above what CalculiX prints have a remark.
`--update` writes the tables into docs/verification.md, DECK are names without .inp.
"""

import argparse
import pathlib
import re
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from book.common import table  # noqa: E402
from peers import calculix, calculix_suite  # noqa: E402
from scene_tools import emcon  # noqa: E402
from timing import usage  # noqa: E402
from verification import DOCS, update  # noqa: E402

PAGE = DOCS/"verification.md"
#: Why a deck differs by more than CalculiX prints.
WHY = {
    "planestress3": "CalculiX takes a brick whose thickness its nodes interpolate, EMCON a sheet as "
                    "thick as each point likes: tests/scenes/test_suite.py has the brick's digits",
}
#: Times are printed with seven digits.
SAME_TIME = 1e-6


def refusal(deck):
    """The first error that the program tells of a deck, None if it takes the deck."""
    done = emcon("check", deck)
    if done.returncode == 0:
        return None
    told = re.search(r"error: (.*)", done.stdout + done.stderr)
    return told[1].split("; supported:")[0] if told else f"exit code {done.returncode}"


def displacements(deck):
    """{time: (labels, u)} at the end of each increment."""
    from emcon.stepper import Stepper

    told = {}
    with Stepper(deck) as run:
        while not run.is_done:
            run.step()
            told[run.time] = run.labels, run.u
    return told


def difference(ours, theirs):
    """Number of values compared, largest displacement, largest difference."""
    count, largest, worst = 0, 0.0, 0.0
    for time, block in theirs.items():
        now = min(ours, key=lambda t: abs(t - time))
        if abs(now - time) > SAME_TIME*max(ours):
            continue
        labels, u = ours[now]
        place = {int(label): k for k, label in enumerate(labels)}
        for node, wanted in block.items():
            if node not in place:
                continue
            value = u[place[node]]
            count += len(value)
            largest = max(largest, np.abs(wanted).max())
            worst = max(worst, np.abs(value - wanted[:len(value)]).max())
    return count, largest, worst


def compare(name, text, program, folder):
    """A row of the first table, or the reason why there is none."""
    deck = folder/f"{name}.inp"
    deck.write_text(text, "latin-1")
    reason = refusal(deck)
    if reason:
        return reason
    try:
        ours = displacements(deck)
    except ArithmeticError as failure:
        return f"ends early: {str(failure).splitlines()[0]}"
    except ValueError as refused:
        return f"the stepper: {str(refused).splitlines()[0]}"
    theirs = calculix_suite.run(program, deck)
    if theirs is None:
        return "CalculiX prints no displacements"
    told, digit = theirs
    count, largest, worst = difference(ours, told)
    if count == 0:
        return "the increments of the two end at different times"
    part = worst/largest if largest > 0 else worst
    note = "" if part <= digit else WHY.get(name, "**more than is printed**")
    return (f"`{name}`", ", ".join(calculix_suite.element_types(text)), count, f"{largest:.6g}",
            f"{part:.1e}", f"{digit:.0e}", note)


def tables(options, program):
    rows, out = [], []
    others = 0
    for name, path in calculix_suite.decks(options.suite).items():
        text = calculix_suite.text_of(path)
        if options.only and name not in options.only:
            continue
        if not calculix_suite.is_mechanical(text):
            others += 1
            continue
        with tempfile.TemporaryDirectory() as folder:
            told = compare(name, text, program, pathlib.Path(folder))
        if isinstance(told, str):
            out.append((f"`{name}`", told.replace("|", "/")))
        else:
            rows.append(told)
    return rows, out, others


def grouped(out):
    """Reasons with the decks that have them, the most frequent first."""
    names = {}
    for name, reason in out:
        names.setdefault(reason, []).append(name)
    return sorted(((", ".join(decks), reason) for reason, decks in names.items()),
                  key=lambda row: (-row[0].count("`"), row[1]))


def lines_of(rows, out, others):
    within = sum(not row[-1] for row in rows)
    sizes = len(rows), within, len(re.findall("`[^`]+`", "".join(row[0] for row in out)))
    return ["{} decks compared, {} of them within what CalculiX prints; {} mechanical ones not "
            "compared; {} of heat, fluids and the like left out.".format(*sizes, others), "",
            *table(["deck", "elements", "values", "largest u", "difference", "printed to",
                    "remark"], rows), "",
            *table(["decks", "not compared: what EMCON says first"], out)]


def release(program):
    return usage([program, "-v"]).text.split()[-1]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ccx", metavar="PROGRAM", help="CalculiX (ccx)")
    parser.add_argument("--suite", type=pathlib.Path, default=calculix_suite.FOLDER,
                        metavar="FOLDER", help="its decks")
    parser.add_argument("--update", action="store_true", help="write into docs/")
    parser.add_argument("only", nargs="*", metavar="DECK", help="these decks alone")
    return parser


def main():
    options = arguments().parse_args()
    program = calculix.program(options.ccx)
    if not program:
        print("CalculiX is passed over: no program ccx (--ccx)")
        return
    if not options.suite.is_dir():
        print(f"CalculiX is passed over: no decks in {options.suite} (--suite)")
        return
    rows, out, others = tables(options, program)
    print("\nThe decks of CalculiX by both codes", *lines_of(rows, out, others), sep="\n")
    if options.update:
        lines = lines_of(rows, grouped(out), others)
        lines[0] = f"CalculiX {release(program)}, {lines[0]}"
        PAGE.write_text(update(PAGE.read_text(), "suite", lines))


if __name__ == "__main__":
    main()
