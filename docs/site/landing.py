"""The first figures of README.md: `python docs/site/landing.py`, some minutes.

A block hits a rubber arch that folds onto itself and onto the floor, by three schemes of the same
program, with the same mesh and increments: bodies at some times by the first two, energies of all
(landing.png), and the first two over time (landing.gif). Prints what README.md says of it.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT/"pywrap"))

import emcon  # noqa: E402
from emcon.drawing import ColourScale, DrawnBodies, colour_scale, frame_view  # noqa: E402
from emcon.mesh import block, strip  # noqa: E402
from emcon.results import FieldFile, locate, read_history  # noqa: E402
from emcon.scene import BLACK, BLUE, GREY, ORANGE, STYLE, Scene, read_scene  # noqa: E402

#: Word of decks, what it is called, its colour; the first two are shown as bodies.
SCHEMES = (("ENERGY MOMENTUM", "energy-momentum", BLACK),
           ("TRAPEZOIDAL", "trapezoidal rule", ORANGE),
           ("GENERALIZED ALPHA", r"HHT, $\alpha = -0.05$", BLUE))
#: Middle radius and thickness of the arch, speed of the block [mm, s]; steps in time [s].
RADIUS, THICKNESS, SPEED = 17.0, 6.0, 6000.0
H, T_END = 1e-4, 0.012
#: What is shown [s]; of the film frames a second, end [s] and number of colours.
TIMES = (0.0, 0.0012, 0.0024, 0.0029, 0.006)
RATE, FILM_END, COLOURS = 12, 0.0075, 64
VIEW = (-24.0, 24.0, -5.0, 43.0)
#: Sizes [inch], dots per inch of the figure and of the film.
WIDTH, HEIGHT, PANEL, RESOLUTION, COARSE = 11.0, 4.2, 1.5, 200, 90


@dataclass
class Run:
    """What is shown of one run."""

    scene: Scene             #: every frame
    time: np.ndarray         #: of the history [s]
    energy: np.ndarray       #: over that of the start
    said: str                #: why it ended, or nothing


def model(scheme: str) -> emcon.Model:
    """The scene: mm, t, s, so that forces are in N and energies in mJ."""
    arch = strip(lambda s: (-RADIUS*np.cos(np.pi*s), RADIUS*np.sin(np.pi*s)), THICKNESS, (48, 4),
                 "ARCH")
    mesh = (arch + block((-15.0, RADIUS + 3.5), (30.0, 20.0), (12, 8), "BLOCK")
            + block((-13.0, -4.0), (26.0, 4.0), (26, 2), "FLOOR"))
    made = emcon.Model.from_mesh(mesh, "A block hits a rubber arch, which folds onto the floor")
    made.material("RUBBER", density=1.1e-9, coupled_neo_hooke=(3.0, 0.4))
    made.material("STIFF", density=7.8e-9, coupled_neo_hooke=(200.0, 0.3))
    made.section("RUBBER", "ARCH").section("STIFF", "BLOCK").section("STIFF", "FLOOR")
    made.contact_pair("ARCH_LEFT", "BLOCK_BOTTOM").contact_pair("ARCH_RIGHT", "FLOOR_TOP")
    made.contact_pair("ARCH_RIGHT", "ARCH_RIGHT")
    for held in ("ARCH_START", "ARCH_END", "FLOOR_BOTTOM"):
        made.boundary(held)
    made.initial("VELOCITY", "BLOCK", (1, 2), (0.0, -SPEED))
    made.step("DYNAMIC", H, T_END, direct=True, nlgeom=True).time_integration(scheme)
    return made


def deck(scheme: str) -> str:
    return model(scheme).deck()


def run(scheme: str, base: Path) -> Run:
    said = ""
    with emcon.Stepper(model(scheme)) as bodies:
        try:
            bodies.run(output=base)
        except emcon.AnalysisError as problem:
            said = str(problem)
        verdict = bodies.verdict()["verdict"]
    with FieldFile(locate(base).field) as file:
        scene = read_scene(file, range(len(file.times)))
    history = read_history(locate(base))
    energy = (history["kinetic"] + history["strain"])/history["total"][0]
    print(f"{scheme}: verdict {verdict}, {len(history) - 1} increments, energy over that of the "
          f"start at most {energy.max():.3g}, total at the end 1{energy[-1] - 1:+.1e} {said}")
    return Run(scene, history["time"], energy, said)


def _bodies(axes: Axes, shown: Run, time: float, scale: ColourScale, label: str) -> None:
    """The frame at a time; after the end of the run its last one, which says so."""
    scene = shown.scene
    frame = int(np.argmin(np.abs(np.array(scene.times) - time)))
    DrawnBodies(axes, scene, frame, VIEW, PANEL, scale)
    frame_view(axes, scene, VIEW, PANEL, PANEL, is_first=False)
    axes.tick_params(labelbottom=False, length=0)
    axes.set_xlabel("")
    axes.set_ylabel(label, labelpad=4)
    if shown.said and time > scene.times[-1] + 0.5*H:
        axes.text(0.5, 0.94, f"stopped at {1e3*scene.times[-1]:.1f} ms", color=ORANGE, ha="center",
                  va="top", transform=axes.transAxes)


def _energies(axes: Axes, runs: list[Run], until: float) -> None:
    """Kinetic and strain energy over that of the start."""
    for shown, (_, label, colour) in zip(runs, SCHEMES, strict=False):
        chosen = shown.time <= until + 0.5*H
        axes.plot(1e3*shown.time[chosen], shown.energy[chosen], color=colour, label=label)
    axes.axhline(0.0, color=GREY, linewidth=0.4)
    axes.set(xlim=(0.0, 1e3*T_END), xlabel="time [ms]", ylim=(0.0, 3.0),
             ylabel="energy, over that of the start")
    axes.legend(loc="lower left", bbox_to_anchor=(-0.05, 1.0), handlelength=1.4)


def figure(runs: list[Run]) -> Figure:
    made = Figure(figsize=(WIDTH, HEIGHT))
    scale = colour_scale(runs[0].scene)
    for row, shown in enumerate(runs[:2]):
        bottom = HEIGHT - 0.42 - PANEL - row*(PANEL + 0.3)
        for k, time in enumerate(TIMES):
            axes = made.add_axes(((0.3 + k*(PANEL + 0.06))/WIDTH, bottom/HEIGHT, PANEL/WIDTH,
                                  PANEL/HEIGHT))
            _bodies(axes, shown, time, scale, SCHEMES[row][1] if k == 0 else "")
            axes.yaxis.label.set_color(SCHEMES[row][2])
            if row == 0:
                axes.set_title(f"{1e3*time:g} ms", fontsize=10, pad=3)
    low = HEIGHT - 0.42 - 2*PANEL - 0.3
    axes = made.add_axes((8.7/WIDTH, low/HEIGHT, 2.1/WIDTH, (HEIGHT - low - 1.0)/HEIGHT))
    _energies(axes, runs, T_END)
    return made


def film(runs: list[Run], output: Path) -> None:
    """Both runs over time, side by side, and their energies."""
    width, height, panel = 8.8, 3.1, 2.6
    made = Figure(figsize=(width, height), dpi=COARSE)
    scale = colour_scale(runs[0].scene)
    places = [made.add_axes(((0.1 + k*(panel + 0.1))/width, 0.1/height, panel/width,
                             panel/height)) for k in range(2)]
    energies = made.add_axes((6.1/width, 0.45/height, 2.5/width, 1.6/height))
    canvas, pictures = FigureCanvasAgg(made), []
    for time in (time for time in runs[0].scene.times if time < FILM_END):
        for axes, shown, (_, label, colour) in zip(places, runs, SCHEMES, strict=False):
            axes.clear()
            _bodies(axes, shown, time, scale, "")
            axes.set_title(f"{label}, {1e3*min(time, shown.scene.times[-1]):.1f} ms",
                           color=colour, fontsize=10, pad=3)
        energies.clear()
        _energies(energies, runs[:2], time)
        canvas.draw()
        pictures.append(Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3]))
    # One set of colours for all, so that what stands still takes no room.
    colours = pictures[len(pictures)//2].quantize(COLOURS)
    first, *others = (shown.quantize(palette=colours, dither=Image.Dither.NONE)
                      for shown in pictures)
    first.save(output, save_all=True, append_images=others, loop=0, optimize=True,
               duration=[1000//RATE]*len(others) + [3000])


def main() -> None:
    with tempfile.TemporaryDirectory() as name, matplotlib.rc_context(STYLE):
        runs = [run(word, Path(name)/f"scheme{k}") for k, (word, _, _) in enumerate(SCHEMES)]
        figure(runs).savefig(ROOT/"docs"/"landing.png", dpi=RESOLUTION)
        film(runs, ROOT/"docs"/"landing.gif")


if __name__ == "__main__":
    main()
