"""CalculiX' test decks of contact and ties through both codes: which run, how far displacements differ.

    .venv/bin/python tests/bench/bench_contact_decks.py [--ccx PROGRAM] [--suite FOLDER] [--update] [DECK...]

Options as of bench_suite.py; the newest decks are in the folder `test` of CalculiX' repository. All
decks of bodies with *CONTACT PAIR or *TIE are tried, those of heat, fluids and the like are left
out. Of decks that differ by more than CalculiX prints a remark says why, and how far they differ
when the cause is taken away by edits (peers/contact_decks.py).
"""

import sys

import bench_suite
from book.common import table
from peers import calculix, calculix_suite, contact_decks
from verification import DOCS, update

PAGE = DOCS/"verification.md"


def shown(told):
    """A reason, or how far the two differ."""
    return told if isinstance(told, str) else f"{told[2]:.1e}"


def row(name, text, program):
    """Deck, elements, values, largest displacement, difference, remark; or name and reason."""
    told = bench_suite.by_both(name, text, program)
    remark, edits = contact_decks.REMARKS.get(name, ("", []))
    if edits and (isinstance(told, str) or told[2] > told[3]):
        found = [bench_suite.by_both(name, text, program, edit) for edit in edits]
        remark += ": " + ", ".join(map(shown, found))
        if isinstance(told, str) and not isinstance(found[0], str):
            return f"`{name}`", told, remark
    if isinstance(told, str):
        return f"`{name}`", told, ""
    if told[2] <= told[3]:
        remark = ""
    elif not remark:
        remark = "**more than is printed**"
    return (f"`{name}`", ", ".join(calculix_suite.element_types(text)), told[0], f"{told[1]:.6g}",
            f"{told[2]:.1e}", remark)


def tables(options, program):
    """Rows of the decks that run unchanged, with edits, and not."""
    rows = []
    for name, path in calculix_suite.decks(options.suite).items():
        text = calculix_suite.text_of(path)
        if options.only and name not in options.only or not contact_decks.is_one(text):
            continue
        if calculix_suite.is_mechanical(text):
            rows.append(row(name, contact_decks.asked(text), program))
    return ([each for each in rows if len(each) == 6], [each for each in rows if len(each) == 3 and each[2]],
            [each[:2] for each in rows if len(each) == 3 and not each[2]])


def lines_of(unchanged, edited, out):
    return [f"{len(unchanged)} decks run unchanged, {len(edited)} with the edit that is named, {len(out)} are refused.", "",
            *table(["deck", "elements", "values", "largest u", "difference", "remark"], unchanged), "",
            *table(["deck", "what EMCON says first", "with the edit"], edited), "",
            *table(["decks", "what EMCON says first"], bench_suite.grouped(out))]


def main():
    options = bench_suite.arguments().parse_args()
    program = calculix.program(options.ccx)
    if not program:
        print("CalculiX is passed over: no program ccx (--ccx)")
        return
    if not options.suite.is_dir():
        print(f"CalculiX is passed over: no decks in {options.suite} (--suite)")
        return
    lines = lines_of(*tables(options, program))
    print("\nCalculiX' decks of contact and ties by both codes", *lines, sep="\n")
    if options.update:
        lines[0] = f"CalculiX {bench_suite.release(program)}: {lines[0]}"
        PAGE.write_text(update(PAGE.read_text(), "suite_contact", lines))


if __name__ == "__main__":
    sys.exit(main())
