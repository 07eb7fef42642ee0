"""A moving picture of a run: the deformed bodies over time, coloured by a field."""

from __future__ import annotations

import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.figure import Figure

from .drawing import (DrawnBodies, ColourScale, colour_scale, draw_colour_bar, fixed_scale, frame_view,
                      set_view, titles)
from .fields import frame_range
from .results import FieldFile, ResultError, ResultPaths, locate
from .scene import STYLE, Scene, read_scene

#: Sizes [inch].
WIDTH, LEFT, RIGHT, TOP, BOTTOM = 8.0, 0.62, 0.95, 0.34, 0.48
HEIGHT = (1.5, 6.0)            # of the panel: least, largest
RESOLUTION = 100               # dots per inch
#: Frames shown at most; a longer run is thinned evenly.
MOST_FRAMES = 300

_LARGEST_RATE = {".gif": 50.0, ".mp4": 240.0}      # a GIF counts in hundredths of a second


def animate(result: str | os.PathLike[str], output: str | os.PathLike[str] | None = None, *,
            fps: float = 20.0, field: str = "von_mises",
            clim: tuple[float, float] | None = None,
            frames: tuple[int, int] | None = None) -> Path:
    """Write an animation of a run; returns its path.

    result   base name of the run, or any one of its files
    output   file to write, GIF or MP4 by its suffix; default NAME.gif
    fps      frames per second, above 0, at most 50 for GIF; of the run, frames are shown one by
             one, up to 300
    field    point or cell field that gives the colours; of a vector its length
    clim     values at the ends of the colours; default from 0, or the lowest, to the highest
    frames   the first and the last of the field file that are shown, from 0 on; -1 is the last

    Raises `ResultError` for a result, a field or frames that cannot be shown, for other formats,
    and for MP4 where there is no program `ffmpeg`; `OSError` where the file cannot be written.
    """
    return write_animation(locate(result), None if output is None else Path(output), fps,
                           Film(field, clim, frames))[0]


@dataclass(frozen=True)
class Film:
    """What of a run an animation shows."""

    field: str = "von_mises"
    clim: tuple[float, float] | None = None       #: ends of the colours, default by the values
    frames: tuple[int, int] | None = None         #: first and last, default all


def write_animation(paths: ResultPaths, output: Path | None = None, fps: float = 20.0,
                    film: Film = Film()) -> tuple[Path, list[str]]:
    """As `animate`; returns the path and notes on what is missing or left out."""
    output = paths.base.with_name(paths.base.name + ".gif") if output is None else output
    writer = _writer(output, fps)
    if not output.parent.is_dir():
        raise FileNotFoundError(2, "no such folder", str(output.parent))
    with FieldFile(paths.field) as file:
        asked = frame_range(film.frames, len(file.times))
        frames = _choose_frames(asked)
        scene = read_scene(file, frames, film.field)
        notes = list(scene.notes)
        if len(frames) < len(asked):
            notes.append(f"{len(frames)} of {len(asked)} frames are shown")
    scale = colour_scale(scene) if film.clim is None else fixed_scale(scene, *film.clim)
    # a file that stands there is replaced by a whole one only
    part = output.with_name(f".{output.stem}.part{output.suffix}")
    try:
        with matplotlib.rc_context(STYLE):
            _write(writer, scene, scale, part)
        part.replace(output)
    except (subprocess.CalledProcessError, BrokenPipeError) as problem:
        text = getattr(problem, "stderr", None) or ""
        said = (text if isinstance(text, str) else text.decode("utf-8", "replace")).splitlines()
        raise ResultError(f"ffmpeg could not write {output}"
                          f"{': ' + said[-1].strip() if said else ''}") from None
    finally:
        part.unlink(missing_ok=True)
    return output, notes


def _writer(output: Path, fps: float) -> AbstractMovieWriter:
    kind = output.suffix.lower()
    if kind not in _LARGEST_RATE:
        raise ResultError(f"{output}: '{output.suffix}' is not a format of animations; known are "
                          "gif, mp4")
    if not 0.0 < fps <= _LARGEST_RATE[kind]:
        raise ResultError(f"frames per second are above 0 and, for {kind[1:].upper()}, at most "
                          f"{_LARGEST_RATE[kind]:g}, not {fps:g}")
    if kind == ".gif":
        return PillowWriter(fps=fps)  # type: ignore[arg-type]  # it takes any number
    if not FFMpegWriter.isAvailable():
        raise ResultError("writing MP4 needs the program ffmpeg, which is not in the PATH; a GIF "
                          "needs nothing")
    # an even number of pixels both ways: what the usual players take
    return FFMpegWriter(fps=fps, codec="libx264",  # type: ignore[arg-type]
                        extra_args=["-pix_fmt", "yuv420p", "-vf",
                                    "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white"])


def _choose_frames(asked: range) -> list[int]:
    if len(asked) <= MOST_FRAMES:
        return list(asked)
    return [asked[int(k)] for k in np.linspace(0, len(asked) - 1, MOST_FRAMES).round()]


def _write(writer: AbstractMovieWriter, scene: Scene, scale: ColourScale, output: Path) -> None:
    """Draw frame by frame; the picture is made once and changed."""
    views = scene.views()
    width = WIDTH - LEFT - RIGHT
    height = float(np.clip(width*(views[0][3] - views[0][2])/(views[0][1] - views[0][0]), *HEIGHT))
    total = TOP + height + BOTTOM
    figure = Figure(figsize=(WIDTH, total))
    axes = figure.add_axes((LEFT/WIDTH, BOTTOM/total, width/WIDTH, height/total))
    bodies = DrawnBodies(axes, scene, 0, views[0], width, scale)
    frame_view(axes, scene, views[0], width, height, is_first=True)
    if scene.values is not None:
        draw_colour_bar(figure, ((LEFT + width + 0.14)/WIDTH, BOTTOM/total, 0.11/WIDTH,
                                 height/total), scene, scale)
    with writer.saving(figure, str(output), RESOLUTION):
        for k, (view, title) in enumerate(zip(views, titles(scene.times), strict=True)):
            bodies.show(k)
            set_view(axes, view, width, height)
            axes.set_title(title, fontsize=10, pad=4)
            writer.grab_frame()
