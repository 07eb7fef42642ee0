"""`python -m emcon`: a picture, an animation or a short table of a run; two runs compared; studies.

Exit codes as in docs/deck.md: 0 done, 2 wrong or missing input, 4 cannot write; `compare` with a
tolerance: 1 if a difference is above it; `study`: 1 if a goal is not met, 3 if no member is done,
130 if interrupted.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

from . import __version__
from .comparison import compare
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


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise argparse.ArgumentTypeError(f"'{text}' is not a number above 0")
    return value


def _tolerance(text: str) -> float:
    return 0.0 if text.strip() == "0" else _positive(text)


def _parser(arguments: list[str]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m emcon", description="Look at EMCON results; run studies.")
    parser.add_argument("--version", action="version", version=f"emcon {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    plot = commands.add_parser("plot", help="write a picture of a run")
    plot.add_argument("result", metavar="RESULT", help=_RESULT)
    plot.add_argument("--output", metavar="FILE", type=Path,
                      help="picture to write, by suffix png, pdf, svg, ... (default NAME.png)")
    plot.add_argument("--times", metavar="T", type=_time, nargs="+",
                      help="times of the upper row (default: six, evenly spaced)")
    movie = commands.add_parser("animate", help="write an animation of a run")
    movie.add_argument("result", metavar="RESULT", help=_RESULT)
    movie.add_argument("--output", metavar="FILE", type=Path,
                       help="animation to write, gif or mp4 by its suffix (default NAME.gif)")
    movie.add_argument("--fps", metavar="N", type=_positive, default=20.0,
                       help="frames per second (default 20)")
    movie.add_argument("--field", metavar="NAME", default="von_mises",
                       help="point or cell field that gives the colours (default von_mises)")
    two = commands.add_parser("compare", help="print the largest differences of two runs")
    two.add_argument("one", metavar="A", help=_RESULT)
    two.add_argument("other", metavar="B", help="another result of the same model")
    two.add_argument("--tolerance", metavar="TOL", type=_tolerance,
                     help="exit with 1 if a relative difference is above TOL")
    two.add_argument("--only", metavar="NAME", nargs="+", default=[],
                     help="compare these fields, columns and series only")
    table = commands.add_parser("summary", help="print a short table of a run")
    table.add_argument("result", metavar="RESULT", help=_RESULT)
    many = commands.add_parser("study", help="run a deck with many settings, weigh errors and cost")
    if "study" in arguments[:1]:
        # h5py and matplotlib take long to load; other commands do not need all of it
        from .study import add_arguments

        add_arguments(many)
    return parser


def _study(options: argparse.Namespace) -> int:
    from .study import StudyError, run_study

    try:
        return run_study(options)
    except StudyError as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted; the same command goes on with what is left", file=sys.stderr)
        return 130


def _plot(options: argparse.Namespace) -> None:
    # matplotlib takes half a second to load; the table does not need it
    from .plotting import write_picture

    picture, notes = write_picture(locate(options.result), options.output, options.times)
    for note in notes:
        print(f"note: {note}", file=sys.stderr)
    print(f"picture: {picture}")


def _animate(options: argparse.Namespace) -> None:
    from .animation import write_animation

    movie, notes = write_animation(locate(options.result), options.output, fps=options.fps,
                                   field=options.field)
    for note in notes:
        print(f"note: {note}", file=sys.stderr)
    print(f"animation: {movie}")


def _compare(options: argparse.Namespace) -> int:
    """The exit code: 1 if the tolerance is given and exceeded."""
    found = compare(options.one, options.other, only=options.only)
    print(found.table(options.tolerance))
    return int(options.tolerance is not None and bool(found.exceeding(options.tolerance)))


def main(arguments: list[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    arguments = sys.argv[1:] if arguments is None else arguments
    options = _parser(arguments).parse_args(arguments)
    try:
        if options.command == "plot":
            _plot(options)
        elif options.command == "animate":
            _animate(options)
        elif options.command == "compare":
            return _compare(options)
        elif options.command == "study":
            return _study(options)
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
