"""The first figure of README.md: `python docs/site/landing.py`.

The ring of input_decks/ring.inp thrown three times as fast, by three schemes of the same program, mesh and
increments: the bodies at some times by the first two, and the energies of all.
"""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

import matplotlib
import numpy as np
from emcon.results import FieldFile, locate, read_history
from emcon.scene import (BLACK, BLUE, GREY, ORANGE, STYLE, colour_scale, draw_bodies, frame_view,
                         read_scene)
from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT/"build"/"release"/"emcon"

#: Word of decks, what it is called, its colour; the first two are shown as bodies.
SCHEMES = (("ENERGY MOMENTUM", "energy-momentum", BLACK),
           ("TRAPEZOIDAL", "trapezoidal rule", ORANGE),
           ("GENERALIZED ALPHA, ALPHA=-0.05", r"HHT, $\alpha = -0.05$", BLUE))
TIMES = (0.0, 1.2, 2.4, 3.6)
H, T_END, FRAME = 0.05, 6.0, 0.4
#: Sizes [inch], dots per inch.
WIDTH, HEIGHT, RESOLUTION = 11.0, 4.4, 160


def deck(scheme: str) -> str:
    """The deck with a faster start and a scheme."""
    text = (ROOT/"input_decks"/"ring.inp").read_text(encoding="utf-8")
    for old, new in (("\nRING, 1, 2.\n", "\nRING, 1, 4.\n"),
                     ("\nRING, 2, -3.\n", "\nRING, 2, -8.\n"),
                     ("\n*CONSTRAINT METHOD",
                      f"\n*TIME INTEGRATION, SCHEME={scheme}\n*CONSTRAINT METHOD")):
        if text.count(old) != 1:
            raise SystemExit(f"ring.inp has no longer one {old.strip()}")
        text = text.replace(old, new)
    return text


def run(folder: Path, k: int) -> Path:
    path = folder/f"scheme{k}.inp"
    path.write_text(deck(SCHEMES[k][0]), encoding="utf-8")
    done = subprocess.run([PROGRAM, path, "--quiet", "--set", f"h={H}", "--set", f"t_end={T_END}",
                           "--set", f"frame={FRAME}"], capture_output=True, text=True)
    if done.returncode not in (0, 3):
        raise SystemExit(done.stderr)
    return path.with_suffix("")


def draw(bases: list[Path]) -> Figure:
    scenes = []
    for base in bases[:2]:
        with FieldFile(locate(base).field) as file:
            scenes.append(read_scene(file, [file.frame_at(time) for time in TIMES]))
    scale = colour_scale(scenes[0])
    views = [(-14.0, 30.0, -5.0, 33.0)]*len(TIMES)
    figure = Figure(figsize=(WIDTH, HEIGHT))
    width, height = 1.68, 1.68
    for row, scene in enumerate(scenes):
        bottom = HEIGHT - 0.42 - height - row*(height + 0.3)
        for k, view in enumerate(views):
            axes = figure.add_axes(((0.3 + k*(width + 0.06))/WIDTH, bottom/HEIGHT,
                                    width/WIDTH, height/HEIGHT))
            draw_bodies(axes, scene, k, view, width, scale)
            frame_view(axes, view, width, height, is_first=False)
            axes.tick_params(labelbottom=False, length=0)
            axes.set_xlabel("")
            if row == 0:
                axes.set_title(f"$t = {TIMES[k]:g}$", fontsize=10, pad=3)
            if k == 0:
                axes.set_ylabel(SCHEMES[row][1], color=SCHEMES[row][2], labelpad=4)
    draw_energies(figure, bases)
    return figure


def draw_energies(figure: Figure, bases: list[Path]) -> None:
    """Kinetic and strain energy over that of the start."""
    axes = figure.add_axes((7.95/WIDTH, 0.55/HEIGHT, 2.8/WIDTH, (HEIGHT - 1.45)/HEIGHT))
    for base, (_, label, colour) in zip(bases, SCHEMES, strict=True):
        history = read_history(locate(base))
        energy = history["kinetic"] + history["strain"]
        axes.plot(history["time"], energy/energy[0], color=colour, label=label)
    axes.axhline(0.0, color=GREY, linewidth=0.4)
    axes.set(xlim=(0.0, T_END), xlabel="time $t$ (consistent units)", ylim=(0.0, None),
             ylabel="energy of the bodies, over that of the start")
    axes.set_xticks(np.arange(0.0, T_END + 0.5))
    axes.legend(loc="lower left", bbox_to_anchor=(-0.05, 1.0), handlelength=1.4)


def main() -> None:
    with tempfile.TemporaryDirectory() as name, matplotlib.rc_context(STYLE):
        figure = draw([run(Path(name), k) for k in range(len(SCHEMES))])
        figure.savefig(ROOT/"docs"/"landing.png", dpi=RESOLUTION)


if __name__ == "__main__":
    main()
