"""Drive everything to its extremes; write the table of docs/stability.md.

    .venv/bin/python tests/bench/extremes.py [ROW ...]      # print it
    .venv/bin/python tests/bench/extremes.py --update       # write it into docs/stability.md

Outcomes are kept in build/extremes by deck and program: what was interrupted goes on. Fails if a run
is silent: wrong, and nothing says so; or does not hold where its row says that it does.
"""

import argparse
import concurrent.futures
import os
import pathlib
import re
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "scenes"), str(ROOT / "tests" / "bench")]

from book.common import table  # noqa: E402
from limits import bodies, friction, impacts, long, space, space_impacts  # noqa: E402
from limits.common import HOLDS, SILENT, run_case  # noqa: E402
from scene_tools import PROGRAM  # noqa: E402

ROWS = [*bodies.ROWS, *space.ROWS, *impacts.ROWS, *friction.ROWS, *space_impacts.ROWS, *long.ROWS]
PAGE = ROOT / "docs" / "stability.md"
#: The row whose values are pairs: a table of its own.
GRID = "grid"


def text_of(value):
    if isinstance(value, tuple):
        return " ".join(text_of(part) for part in value if part not in (0.0, 1.0)) or "1"
    return f"{value:.8g}" if not isinstance(value, str) else value


def folder_of_program():
    """A folder for the outcomes of this program."""
    stamp = int(pathlib.Path(PROGRAM).stat().st_mtime)
    folder = ROOT / "build" / "extremes" / str(stamp)
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def line_of(row, outcomes):
    held = [value for value, outcome in zip(row.values, outcomes, strict=True)
            if outcome.kind == HOLDS]
    others = [(value, outcome) for value, outcome in zip(row.values, outcomes, strict=True)
              if outcome.kind != HOLDS]
    worst = max((o.figure for o in outcomes if o.kind == HOLDS), default=float("nan"))
    said = "; ".join(f"{text_of(value)}: " + (f"**silent** {outcome.figure:.1e}"
                                              if outcome.kind == SILENT else outcome.text)
                     for value, outcome in others)
    return (row.what, ", ".join(map(text_of, row.values)), "all" if not others else ", ".join(map(text_of, held)),
            f"{row.figure}: {worst:.1e} (bound {row.bar:g})",
            said.replace("|", "\\|") or "", row.why)


def grid_lines(row, outcomes):
    """The rows of the table of a row whose values are pairs."""
    firsts, seconds = (list(dict.fromkeys(value[k] for value in row.values)) for k in (0, 1))
    of = dict(zip(row.values, outcomes, strict=True))
    cells = [[of[a, b] for b in seconds] for a in firsts]
    return table(("", *(f"{b:g}" for b in seconds)),
                 [(f"{a:g}", *(f"{o.figure:.1e}" if o.kind == HOLDS else f"{o.kind}: {o.figure:.1e}"
                               for o in line)) for a, line in zip(firsts, cells, strict=True)])


HEAD = ("what", "tried", "holds", "largest figure", "else the program says", "limit")
ILL_HEAD = ("what", "(6)", "(6), multipliers scaled", "(7)", "residual, at most")


def ill_line_of(row, outcomes):
    """Condition numbers where they are largest, each, and the largest residual of runs that hold."""
    known = [(value, o.ill) for value, o in zip(row.values, outcomes, strict=True) if o.ill]
    if not known:
        return None
    worst = [max(((ill[k], value) for value, ill in known), key=lambda pair: pair[0])
             for k in range(3)]
    residual = max((o.residual for o in outcomes if o.kind == HOLDS), default=float("nan"))
    return (row.what, *(f"{figure:.0e} ({text_of(value)})" for figure, value in worst),
            f"{residual:.0e}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--update", action="store_true", help="write docs/stability.md")
    parser.add_argument("rows", nargs="*", help="names of rows; all")
    options = parser.parse_args()
    rows = [row for row in ROWS if not options.rows or row.name in options.rows]
    folder = folder_of_program()
    lines, ill_lines, grid, n_wrong = [], [], None, 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        futures = [[pool.submit(run_case, row, value, folder, True) for value in row.values]
                   for row in rows]
        for row, future in zip(rows, futures, strict=True):
            start = time.monotonic()
            outcomes = [f.result() for f in future]
            n_wrong += sum(o.kind == SILENT or (k < row.reach and o.kind != HOLDS)
                           for k, o in enumerate(outcomes))
            if row.name == GRID:
                grid = grid_lines(row, outcomes)
            else:
                lines.append(line_of(row, outcomes))
                ill_lines += [line for line in [ill_line_of(row, outcomes)] if line]
            print(f"{row.name} ({time.monotonic() - start:.0f} s)", flush=True)
            for value, o in zip(row.values, outcomes, strict=True):
                print(f"   {text_of(value):>14}  {o.kind:6}  {o.figure:.1e}  {o.text}"
                      f"  {o.residual:.0e}  {' '.join(f'{c:.0e}' for c in o.ill or ())}", flush=True)
    if options.update:
        text = PAGE.read_text()
        for name, made in (("extremes", table(HEAD, lines)), ("grid", grid),
                           ("conditions", table(ILL_HEAD, ill_lines))):
            if made is None:
                continue
            mark = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end -->)", re.DOTALL)
            made = "\n".join(made)
            text = mark.sub(lambda match, made=made: match[1] + made + "\n" + match[2], text)
        PAGE.write_text(text)
    return n_wrong


if __name__ == "__main__":
    sys.exit(min(main(), 1))
