"""Make the tables and figures of docs/verification.md and docs/impacts.md again.

    .venv/bin/python tests/bench/verification.py            # print the tables
    .venv/bin/python tests/bench/verification.py --update   # write them and the figures into docs/

Runs the decks of input_decks/ and a few made here, in a temporary folder, two at a time; the
chapters are the modules of tests/bench/book/. Needs the program (`make app`), and for one table
the program in quadruple precision (`make app PRECISION=quad`), for another the program of condition
numbers (`make build/release/ties_condition`); a table is left out where its program is missing.
"""

import argparse
import os
import pathlib
import re
import tempfile

from book import (bar, causes, contact_damping, contact_patch, contact_sides, elements, forces, free_bodies,
                  friction, gain, hertz, hertz_ball, hertz_pressed, impacts,
                  ironing, midside, numerics, plain, press_fit, ring, self_contact_space, slave_floor, soft, spin, statics, ties,
                  ties_condition, ties_space, ties_space_orders)
from book.common import Runs

DOCS = pathlib.Path(__file__).resolve().parents[2] / "docs"

#: In the order of the book.
CHAPTERS = [
    chapter
    for module in (ring, spin, bar, forces, free_bodies, self_contact_space, statics, elements, ties, ties_condition, ties_space, ties_space_orders, contact_patch,
                   hertz, hertz_pressed, hertz_ball, press_fit, midside, ironing, friction, contact_damping, plain, contact_sides, slave_floor, soft, numerics, impacts,
                   gain, causes)
    for chapter in module.CHAPTERS
]


def update(text, name, lines):
    """`text` of a page with the table between the marks of `name` made anew."""
    mark = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end -->)", re.DOTALL)
    assert mark.search(text), f"the page has no table {name}"
    return mark.sub(lambda match: match[1] + "\n".join(lines) + "\n" + match[2], text)


def main():
    parser = argparse.ArgumentParser(description="Tables and figures of docs/")
    parser.add_argument("--update", action="store_true", help="write into docs/")
    parser.add_argument("only", nargs="*", help="chapters, as they are named in the output")
    options = parser.parse_args()
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    chapters = [c for c in CHAPTERS if not options.only or c.name in options.only]
    figures = DOCS if options.update else None
    with tempfile.TemporaryDirectory() as folder:
        runs = Runs(folder)
        try:
            started = [(chapter, chapter.start(runs)) for chapter in chapters]
            for chapter, futures in started:
                lines = chapter.report(futures, figures)
                print(f"{chapter.name}\n", *lines, "", sep="\n", flush=True)
                if options.update:
                    page = DOCS / chapter.page
                    page.write_text(update(page.read_text(), chapter.name, lines))
        finally:
            runs.pool.shutdown(cancel_futures=True)


if __name__ == "__main__":
    main()
