"""The test decks of CalculiX unchanged through both codes: how far displacements differ.

    .venv/bin/python tests/bench/bench_suite.py [--ccx PROGRAM] [--suite FOLDER] [--update] [DECK...]

`PROGRAM` is that of CalculiX, by default `ccx` of the path, `FOLDER` the one of its decks, by
default where the Debian package calculix-ccx-test puts them; where one of them is missing, that is
all that is told. A deck that EMCON refuses is a line with the first reason. Differences are
relative to the largest displacement of the deck; those above what CalculiX prints have a remark.
Then how many decks `emcon check --lenient` accepts, which words refuse the others, and how many each
word would open alone. `--words` makes this table only. `--update` writes the tables into
docs/verification.md, DECK are names without .inp.
"""

import argparse
import json
import pathlib
import re
import sys
import tempfile

import h5py
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from book.common import table  # noqa: E402
from peers import calculix, calculix_suite, contact_decks  # noqa: E402
from scene_tools import Fields, emcon  # noqa: E402
from timing import usage  # noqa: E402
from verification import DOCS, update  # noqa: E402

PAGE = DOCS/"verification.md"
#: Cards of CalculiX that make Newton's method go on to round-off.
TIGHT = "*CONTROLS, PARAMETERS=FIELD\n1e-9, 1e-9\n"
#: A procedure with the data line of its increments.
PROCEDURE = r"(?im)^(\*(?:static|dynamic).*\n(?:[^*].*\n)?)"


def behind_procedure(cards):
    return lambda text: re.sub(PROCEDURE, lambda card: card[1] + cards, text)


def by_increments(h, end):
    """A dynamic step in increments of `h` up to `end`."""
    return lambda text: re.sub(r"(?im)^(\*dynamic)(,explicit|).*\n.*\n",
                               lambda card: f"{card[1]}{card[2] or ', DIRECT'}\n{h}, {end}\n", text)


def undamped(h, end):
    """The same for CalculiX, by the trapezoidal rule, to round-off."""
    def edit(text):
        text = behind_procedure(TIGHT)(by_increments(h, end)(text))
        return re.sub(r"(?im)^(\*dynamic.*)\n", lambda card: f"{card[1]}, ALPHA=0.\n", text)
    return edit


def fully(edit=lambda text: text):
    """The same with all points."""
    return lambda text: edit(text).replace("C3D20R", "C3D20")


NEWTON = "CalculiX ends Newton's method at 0.5 % of the forces; to round-off"
DAMPED = ("CalculiX damps numerically, ALPHA=-0.05, EMCON does not; both without damping, iterated"
          " to round-off, with short increments")
POINTS = "CalculiX integrates centrifugal forces with the 2 x 2 x 2 points of C3D20R; with C3D20"
#: Why a deck differs by more than CalculiX prints, and by what change of the deck for CalculiX and
#: for EMCON one sees it; the difference is then told, too.
WHY = {
    "beamnlp": (NEWTON, behind_procedure(TIGHT), None),
    "beamnlmpc": (NEWTON, behind_procedure(TIGHT), None),
    "beamnh": (NEWTON.replace("; to", "; EMCON has the closed form, tests/scenes/test_suite.py; to"),
               behind_procedure(TIGHT), None),
    "beamog": ("EMCON has the closed form, tests/scenes/test_suite.py", None, None),
    "beampic": ("an iterative solver of CalculiX; with a direct one",
                lambda text: re.sub("(?i),SOLVER=ITERATIVE CHOLESKY", "", text), None),
    "beamnldy": (DAMPED, undamped("1e-7", "5e-6"), by_increments("1e-7", "5e-6")),
    "beamnldynodirect": (DAMPED, undamped("1e-7", "5e-6"), by_increments("1e-7", "5e-6")),
    **dict.fromkeys(("beamdynamic", "beamimpdy1", "beamimpdy1nodirect"), (
        DAMPED + "; CalculiX also integrates the mass with the 2 x 2 x 2 points of C3D20R; in "
                 "addition with C3D20", *(fully(edit("1e-7", "1e-5")) for edit in (undamped, by_increments)))),
    "beamimpdy2": (DAMPED, undamped("1e-6", "1e-4"), by_increments("1e-6", "1e-4")),
    "equrem1": (DAMPED, undamped("2e-9", "2e-7"), by_increments("2e-9", "2e-7")),
    "equrem2": (DAMPED, undamped("2e-9", "2e-7"), by_increments("2e-9", "2e-7")),
    "equrem3": (DAMPED, undamped("2e-9", "2e-7"), by_increments("2e-9", "2e-7")),
    "segment1": (POINTS, *2*(fully(),)),
    "segment2": (POINTS, *2*(fully(),)),
    "beamnldye": ("explicit, five increments from rest: the lumped masses of the nodes decide, and"
                  " the codes lump differently; run for twenty times as long", by_increments("1e-8", "1e-6"),
                  by_increments("1e-8", "1e-6")),
    "ax6": ("CalculiX uses a wedge of two degrees with straight edges; EMCON gives the closed "
            "forms, tests/scenes/test_axial.py", None, None),
    "axial": ("CalculiX also integrates the mass with the 2 x 2 points of CAX8R; with CAX8 (the "
              "wedge of two degrees remains)", *2*(lambda text: text.replace("CAX8R", "CAX8"),)),
    "plate": ("contact between sides of three nodes, each of which EMCON treats as two straight "
              "edges; CalculiX uses a brick, as in planestress3; with CPE8R",
              *2*(lambda text: text.replace("CPS8R", "CPE8R"),)),
    "planestress3": ("CalculiX uses a brick whose thickness its nodes interpolate, EMCON has zero "
                     "stress across the plane at each point: tests/scenes/test_suite.py reproduces"
                     " the brick's digits", None, None),
}
#: Of contact and ties, where bench_contact_decks.py has the causes.
ELSEWHERE = "see [the next section](#decks-of-contact-and-ties)"
#: Times are printed with seven digits.
SAME_TIME = 1e-6


def run(deck):
    """Why EMCON does not run a deck to its end, None if it does; files are beside the deck."""
    done = emcon(deck, "--quiet", timeout=calculix_suite.MOST)
    if done.returncode == 2:
        told = re.search(r"(?:error|emcon): (?:\S+: error: )?(.*)", done.stderr)
        return told[1].replace(f"{deck.parent}/", "").split("; supported:")[0]
    if not deck.with_suffix(".json").exists():
        return "*NO ANALYSIS: the deck is read and checked, as it asks"
    verdict = json.loads(deck.with_suffix(".json").read_text())
    if verdict["verdict"] == "not completed":
        return f"ends early: {verdict['message'].splitlines()[0]}"
    return None


def displacements(deck):
    """{time: {node: u}}: the frames of the field file, and what `*NODE PRINT` asks for."""
    told = {}
    fields = Fields(deck.with_suffix(".vtkhdf"))
    if "displacement" in fields.names():
        labels = calculix_suite.node_labels(deck.read_text("latin-1"))
        for time, u in zip(fields.time, fields["displacement"], strict=True):
            told[time] = dict(zip(labels, u, strict=False))
    with h5py.File(deck.with_suffix(".h5"), "r") as file:
        for group in file["sets"].values():
            if "U" in group:
                for time, u in zip(group["U_time"][:], group["U"][:], strict=True):
                    told.setdefault(time, {}).update(zip(group["U_label"][:], u, strict=True))
    return told


def difference(ours, theirs):
    """Number of values compared, largest displacement, largest difference."""
    count, largest, worst = 0, 0.0, 0.0
    for time, block in theirs.items():
        now = min(ours, key=lambda t: abs(t - time))
        if abs(now - time) > SAME_TIME*max(ours):
            continue
        for node in block.keys() & ours[now].keys():
            value, wanted = ours[now][node], block[node]
            count += len(value)
            largest = max(largest, np.abs(wanted).max())
            worst = max(worst, np.abs(value - wanted[:len(value)]).max())
    return count, largest, worst


def by_both(name, text, program, edits=(None, None)):
    """Values, largest one, difference relative to it, half a digit printed; or why there are none.

    `edits` make of the deck's text what CalculiX and what EMCON reads.
    """
    theirs, ours = (edit(text) if edit else text for edit in edits)
    with tempfile.TemporaryDirectory() as folder:
        deck = pathlib.Path(folder)/f"{name}.inp"
        deck.write_text(ours, "latin-1")
        reason = run(deck)
        if reason:
            return reason
        found = displacements(deck)
        deck.write_text(theirs, "latin-1")
        told = calculix_suite.run(program, deck)
    if told is None:
        return "CalculiX prints no displacements"
    count, largest, worst = difference(found, told[0])
    if count == 0:
        return "the increments of the two end at different times"
    return count, largest, worst/largest if largest > 0 else worst, told[1]


def compare(name, text, program):
    """A row of the first table, or the reason why there is none."""
    told = by_both(name, text, program)
    if isinstance(told, str):
        return told
    count, largest, part, digit = told
    note = ""
    if part > digit:
        cause = ELSEWHERE if contact_decks.is_one(text) else "**more than is printed**"
        note, *edits = WHY.get(name, (cause, None, None))
        if any(edits):
            again = by_both(name, text, program, edits)
            note += f": {again}" if isinstance(again, str) else f": {again[2]:.1e}"
    return (f"`{name}`", ", ".join(calculix_suite.element_types(text)), count, f"{largest:.6g}",
            f"{part:.1e}", f"{digit:.0e}", note)


#: What a message complains of: a pattern, and the word for it.
COMPLAINTS = [
    (r"element type '?(B\d|PIPE)", "beams"), (r"element type '?S\d", "shells"),
    (r"element type '?M3D", "membranes"), (r"element type '?(SPRING|DASHPOT|GAP|MASS)",
                                           "springs, dashpots, gap elements"),
    (r"element type '?(T\dD)|holds lines", "trusses"),
    (r"element type '?([\w]+)", "TYPE=\\1"),
    (r"(?i)^(\*[a-z -]+[a-z]): (?:unknown )?parameter '?(\w+)", "\\1, \\2"),
    (r"(?i)^(\*[a-z -]+[a-z]): (\w+)='(.*?)' is known", "\\1, \\2=\\3"),
    (r"unknown keyword '(.*?)'", "\\1"),
    (r"(?i)^(\*[a-z -]+[a-z]): known but not supported", "\\1"),
    (r"(contact|ties|\*DAMPING|rigid bodies) (in three dimensions|with elements CAX)", "\\1 \\2"),
    (r"(?:load type|unknown load type) '?(\w+)", "*DLOAD, \\1"),
    (r"beside solids of revolution", "elements CPS beside CAX"),
    (r"is a \*USER MATERIAL", "*USER MATERIAL"),
    (r"do not depend on temperature", "constants by temperature"),
]
#: Messages that follow from others.
FOLLOWS = re.compile(r"has no law|the deck has no|expected E, nu|ELSET= is missing|unknown (?:\w+ )?set")


def word(message):
    """What an error complains of, in a word."""
    for pattern, name in COMPLAINTS:
        found = re.search(pattern, message)
        if found:
            return found.expand(name).upper() if pattern.startswith("(?i)") else found.expand(name)
    return re.sub(r"\d+", "#", message.split(";")[0])


def words_of(deck):
    """What `emcon check --lenient` complains of in a deck, in its order; none: it is accepted."""
    done = emcon("check", "--lenient", "--quiet", deck.name, cwd=deck.parent,
                 timeout=calculix_suite.MOST)
    told = re.findall(r"error: (.*)", done.stderr)
    own = [message for message in told if not FOLLOWS.search(message)] or told
    return list(dict.fromkeys(word(message) for message in own)) if done.returncode else []


def refusals(options):
    """{deck: the words that refuse it}, for all decks, those of heat and the like too."""
    told = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, path in calculix_suite.decks(options.suite).items():
            (pathlib.Path(folder)/f"{name}.inp").write_bytes(
                calculix_suite.text_of(path).encode("latin-1"))
        for name in calculix_suite.decks(options.suite):
            if not options.only or name in options.only:
                told[name] = words_of(pathlib.Path(folder)/f"{name}.inp")
    return told


def refusal_lines(told):
    """A row for each word: decks that it refuses first, that have it, that it would open alone."""
    first, has, alone = {}, {}, {}
    for name, words in told.items():
        for k, each in enumerate(words):
            has.setdefault(each, []).append(name)
            if k == 0:
                first.setdefault(each, []).append(name)
            if len(words) == 1:
                alone.setdefault(each, []).append(name)
    rows = sorted(has, key=lambda each: (-len(alone.get(each, [])), -len(has[each]), each))
    shown = [each for each in rows if each in alone or len(first.get(each, [])) > 3]
    accepted = sum(not words for words in told.values())
    return [f"`emcon check --lenient` accepts {accepted} of all {len(told)} decks. The table lists the "
            "words (keywords, parameters, element types) for which the others are refused. A word is listed "
            "if it is the only cause for some deck, or the first cause for more than three:", "",
            *table(["word", "decks that have it", "refused by it first", "refused by it alone"],
                   [(f"`{each}`" if each.startswith(("*", "TYPE")) else each, len(has[each]),
                     len(first.get(each, [])),
                     ", ".join(f"`{deck}`" for deck in alone.get(each, []))) for each in shown])]


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
        told = compare(name, text, program)
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
    parser.add_argument("--words", action="store_true", help="only which words refuse decks")
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
    words = refusal_lines(refusals(options))
    if options.words:
        print(*words, sep="\n")
        return
    rows, out, others = tables(options, program)
    print("\nThe decks of CalculiX by both codes", *lines_of(rows, out, others), "", *words, sep="\n")
    if options.update:
        lines = lines_of(rows, grouped(out), others)
        lines[0] = f"CalculiX {release(program)}, {lines[0]}"
        PAGE.write_text(update(PAGE.read_text(), "suite", [*lines, "", *words]))


if __name__ == "__main__":
    main()
