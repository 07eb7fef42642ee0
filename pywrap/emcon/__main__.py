"""`emcon`, or `python -m emcon`: run decks, look at results, turn meshes into decks, make studies.

What a deck needs (run, check, restart) is done by the program that is compiled, in place of this
one; the rest here. Exit codes as in docs/deck.md: 0 done, 2 wrong or missing input, 4 cannot write;
`compare` with a tolerance: 1 if a difference is above it; `study`: 1 if a goal is not met, 3 if no
member is done, 130 if interrupted.
"""

from __future__ import annotations

import argparse
import difflib
import math
import os
import subprocess
import sys
import warnings
from pathlib import Path

from .comparison import compare
from .program import find_program
from .results import ResultError, locate
from .summary import summary

#: Commands of this file; anything else is for the compiled program.
_COMMANDS = {"plot": "write a picture of a run", "animate": "write an animation of a run",
             "export": "write the fields of a run as .pvd and .vtu, for ParaView before 5.12",
             "compare": "print the largest differences of two runs",
             "summary": "print a short table of a run",
             "mesh": "turn a mesh of Gmsh or another program into cards of a deck",
             "study": "run a deck with many settings, weigh errors and cost"}
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
    name = "emcon" if Path(sys.argv[0]).name == "emcon" else "python -m emcon"
    parser = argparse.ArgumentParser(prog=name, description="Look at EMCON results; run studies.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    plot = commands.add_parser("plot", help=_COMMANDS["plot"])
    plot.add_argument("result", metavar="RESULT", help=_RESULT)
    plot.add_argument("--output", metavar="FILE", type=Path,
                      help="picture to write, by suffix png, pdf, svg, ... (default NAME.png)")
    plot.add_argument("--times", metavar="T", type=_time, nargs="+",
                      help="times of the upper row (default: six, evenly spaced)")
    plot.add_argument("--frame", metavar="N", type=int,
                      help="a frame of the file in place of times; -1 is the last")
    plot.add_argument("--field", metavar="NAME", default="von_mises",
                      help="point or cell field that gives the colours (default von_mises)")
    plot.add_argument("--clim", metavar=("LOW", "HIGH"), type=float, nargs=2,
                      help="values at the ends of the colours (default by the values)")
    movie = commands.add_parser("animate", help=_COMMANDS["animate"])
    movie.add_argument("result", metavar="RESULT", help=_RESULT)
    movie.add_argument("--output", metavar="FILE", type=Path,
                       help="animation to write, gif or mp4 by its suffix (default NAME.gif)")
    movie.add_argument("--fps", metavar="N", type=_positive, default=20.0,
                       help="frames per second (default 20)")
    movie.add_argument("--field", metavar="NAME", default="von_mises",
                       help="point or cell field that gives the colours (default von_mises)")
    movie.add_argument("--clim", metavar=("LOW", "HIGH"), type=float, nargs=2,
                       help="values at the ends of the colours (default by the values)")
    movie.add_argument("--frames", metavar=("FIRST", "LAST"), type=int, nargs=2,
                       help="frames of the file that are shown; -1 is the last (default all)")
    files = commands.add_parser("export", help=_COMMANDS["export"])
    files.add_argument("result", metavar="RESULT", help=_RESULT)
    files.add_argument("--output", metavar="FILE", type=Path,
                       help="file that lists the frames, NAME.pvd (default that of the result)")
    files.add_argument("--frames", metavar=("FIRST", "LAST"), type=int, nargs=2,
                       help="frames of the file that are written; -1 is the last (default all)")
    files.add_argument("--fields", metavar="NAME", nargs="+", default=[],
                       help="point and cell fields that are written (default all)")
    two = commands.add_parser("compare", help=_COMMANDS["compare"])
    two.add_argument("one", metavar="A", help=_RESULT)
    two.add_argument("other", metavar="B", help="another result of the same model")
    two.add_argument("--tolerance", metavar="TOL", type=_tolerance,
                     help="exit with 1 if a relative difference is above TOL")
    two.add_argument("--only", metavar="NAME", nargs="+", default=[],
                     help="compare these fields, columns and series only")
    table = commands.add_parser("summary", help=_COMMANDS["summary"])
    table.add_argument("result", metavar="RESULT", help=_RESULT)
    mesh = commands.add_parser("mesh", help=_COMMANDS["mesh"])
    mesh.add_argument("source", metavar="IN", type=Path,
                      help="mesh of Gmsh (.msh), Abaqus (.inp) or another format of meshio")
    mesh.add_argument("target", metavar="OUT", type=Path,
                      help="file to write, for *INCLUDE, INPUT=OUT in a deck")
    mesh.add_argument("--scale", metavar="F", type=_positive, default=1.0,
                      help="multiply lengths by F")
    mesh.add_argument("--refine", metavar="N", type=int, choices=range(7), default=0,
                      help="cut each element in four, in space in eight, N times")
    many = commands.add_parser("study", help=_COMMANDS["study"])
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
    from .plotting import View, write_picture

    view = View(options.times, options.frame, options.field,
                tuple(options.clim) if options.clim else None)
    _, picture, notes = write_picture(locate(options.result), options.output, view)
    for note in notes:
        print(f"note: {note}", file=sys.stderr)
    print(f"picture: {picture}")


def _animate(options: argparse.Namespace) -> None:
    from .animation import Film, write_animation

    film = Film(options.field, tuple(options.clim) if options.clim else None,
                tuple(options.frames) if options.frames else None)
    movie, notes = write_animation(locate(options.result), options.output, options.fps, film)
    for note in notes:
        print(f"note: {note}", file=sys.stderr)
    print(f"animation: {movie}")


def _export(options: argparse.Namespace) -> None:
    from .export import export

    for path in export(options.result, options.output, fields=options.fields,
                       frames=tuple(options.frames) if options.frames else None):
        print(f"to open: {path}")


def _compare(options: argparse.Namespace) -> int:
    """The exit code: 1 if the tolerance is given and exceeded."""
    found = compare(options.one, options.other, only=options.only)
    print(found.table(options.tolerance))
    return int(options.tolerance is not None and bool(found.exceeding(options.tolerance)))


def _mesh(options: argparse.Namespace) -> None:
    """Write the cards, say what sets and surfaces there are."""
    from .mesh import MeshError, read, refine

    if options.target.suffix.lower() != ".inp":
        raise ResultError(f"{options.target}: cards of a deck are written, so name it NAME.inp")
    with warnings.catch_warnings(record=True) as notes:
        warnings.simplefilter("always")
        try:
            found = refine(read(options.source), options.refine).scale(options.scale)
        except FileNotFoundError:
            raise ResultError(f"there is no file {options.source}") from None
        except (MeshError, ImportError) as problem:
            raise ResultError(str(problem)) from None
    for note in notes:
        print(f"note: {note.message}", file=sys.stderr)
    print(f"{found.write(options.target)}: {len(found.node_labels)} nodes")
    for kind, labels in found.element_labels.items():
        print(f"  {kind:<12} {len(labels)} elements")
    for what, sets in (("node set", found.node_sets), ("element set", found.element_sets),
                       ("surface", found.surfaces)):
        for name, members in sets.items():
            print(f"  {what:<12} {name}, {len(members)}")


def _hand_over(arguments: list[str]) -> int:
    """What is not for this file: the compiled program takes the place of this one."""
    first = arguments[0] if arguments else "--help"
    near = difflib.get_close_matches(first, _COMMANDS, 1)
    if near and not Path(first).exists():
        print(f"error: there is no command {first}; did you mean {near[0]}?", file=sys.stderr)
        return 2
    program = find_program()
    if not program:
        print("error: this installation has no compiled program: make pywrap in a clone, or pip "
              "install of its source, makes it", file=sys.stderr)
        return 4
    if first in {"--help", "-h"}:
        text = subprocess.run([program, "--help"], capture_output=True, text=True, check=True).stdout
        print(text.rstrip() + "\n\nalso, each with --help:")
        for name, what in _COMMANDS.items():
            print(f"  emcon {name:<10} {what}")
        return 0 if arguments else 2
    sys.stdout.flush()
    sys.stderr.flush()
    os.execv(program, ["emcon", *arguments])


def main(arguments: list[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    arguments = sys.argv[1:] if arguments is None else arguments
    if not arguments or arguments[0] not in _COMMANDS:
        return _hand_over(arguments)
    options = _parser(arguments).parse_args(arguments)
    try:
        if options.command == "plot":
            _plot(options)
        elif options.command == "animate":
            _animate(options)
        elif options.command == "export":
            _export(options)
        elif options.command == "compare":
            return _compare(options)
        elif options.command == "mesh":
            _mesh(options)
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
