"""`python -m emcon`: a picture or a short table of the result of a run.

Exit codes as in docs/deck.md: 0 done, 2 wrong or missing input, 4 cannot write.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

from . import __version__
from .results import ResultError, locate
from .summary import summary

_RESULT = "a result: its base name (NAME) or NAME.vtkhdf, NAME.h5, NAME.csv"


def _time(text: str) -> float:
    try:
        time = float(text)
    except ValueError:
        time = math.nan
    if not math.isfinite(time):
        raise argparse.ArgumentTypeError(f"'{text}' is not a time")
    return time


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m emcon", description="Look at EMCON results.")
    parser.add_argument("--version", action="version", version=f"emcon {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    plot = commands.add_parser("plot", help="write a picture of a run")
    plot.add_argument("result", metavar="RESULT", help=_RESULT)
    plot.add_argument("--output", metavar="FILE", type=Path,
                      help="picture to write, by suffix png, pdf, svg, ... (default NAME.png)")
    plot.add_argument("--times", metavar="T", type=_time, nargs="+",
                      help="times of the upper row (default: six, evenly spaced)")
    table = commands.add_parser("summary", help="print a short table of a run")
    table.add_argument("result", metavar="RESULT", help=_RESULT)
    return parser


def _plot(options: argparse.Namespace) -> None:
    # matplotlib takes half a second to load; the table does not need it
    from .plot import write_picture

    picture, notes = write_picture(locate(options.result), options.output, options.times)
    for note in notes:
        print(f"note: {note}", file=sys.stderr)
    print(f"picture: {picture}")


def main(arguments: list[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    options = _parser().parse_args(arguments)
    try:
        if options.command == "plot":
            _plot(options)
        else:
            print(summary(locate(options.result)))
    except ResultError as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 2
    except BrokenPipeError:
        sys.stderr.close()
        return 0
    except OSError as problem:
        where = f" {problem.filename}" if problem.filename else ""
        print(f"error: cannot write{where}: {problem.strerror or problem}", file=sys.stderr)
        return 4
    return 0


if __name__ == "__main__":
    sys.exit(main())
