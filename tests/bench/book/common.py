"""What the chapters share: runs in the background, formulations of contact, tables, figures."""

import concurrent.futures
import dataclasses
import pathlib
import subprocess
import sys

import matplotlib as mpl
import numpy as np
from scene_tools import DECKS, ROOT, Deck, run_deck

sys.path.insert(0, str(ROOT / "pywrap"))

from emcon.plotting import RESOLUTION, WIDTH  # noqa: E402
from emcon.scene import STYLE  # noqa: E402

TREATMENTS = ("PERSISTENT", "ADMISSIBLE", "VELOCITY UPDATE")
COLOURS = ("#1f4e79", "#b5532a", "#4c8c4a", "#7b4a8c", "#b8962e")
#: Widths of curves that may lie on each other: what comes later leaves the ones below in sight.
BROAD = (3.6, 2.3, 1.4, 0.7)
#: Sizes of marks, likewise.
LARGE = (9, 6.5, 4.5, 3)


def mortar(normal, multiplier, **more):
    return {"formulation": "MORTAR", "normal": normal, "multiplier": multiplier, **more}


def node(**more):
    """The nodes of one side; the decks' own choice is both."""
    return {"formulation": "NODE TO SURFACE", "sides": "ONE", **more}


def segment(multiplier):
    return {"formulation": "SEGMENT", "multiplier": multiplier}


#: Mortar with segments, by what the tables call it.
MORTAR = {
    f"`MORTAR`, `{normal}`, `{multiplier}`": mortar(normal, multiplier)
    for normal in ("EDGE", "NODAL")
    for multiplier in ("STANDARD", "DUAL")
}

#: Parameters of the decks, by what the tables call them.
FORMULATIONS = {
    "`NODE TO SURFACE`": node(),
    "`NODE TO SURFACE`, `HERMITE`": node(smoothing="HERMITE"),
    "`SEGMENT`, `STANDARD`": segment("STANDARD"),
    "`SEGMENT`, `DUAL`": segment("DUAL"),
    **MORTAR,
    "`MORTAR`, `NODAL`, `DUAL`, `ELEMENTS`": mortar("NODAL", "DUAL", integration="ELEMENTS"),
    "`MORTAR`, `NODAL`, `DUAL`, `HERMITE`": mortar("NODAL", "DUAL", smoothing="HERMITE"),
}


class Runs:
    """Runs of decks in the background, two at a time; a result is waited for when asked for."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.pool = concurrent.futures.ThreadPoolExecutor(2)
        self.count = 0

    def start(self, deck, run=run_deck, **parameters):
        self.count += 1
        folder = self.folder / f"run{self.count}"
        return self.pool.submit(run, deck, folder, **parameters)

    def generated(self, generator, *options):
        """A deck made by a generator of input_decks/."""
        self.count += 1
        path = self.folder / f"{generator}{self.count}.inp"
        command = [sys.executable, DECKS / f"make_{generator}.py", *options, "--output", path]
        subprocess.run(list(map(str, command)), check=True)
        return path


@dataclasses.dataclass(frozen=True)
class Chapter:
    """A table of a page of docs/: `start` begins its runs, `report` waits and gives its lines.

    `report(started, figures)` draws into the folder `figures`, unless that is None.
    """

    name: str
    start: object
    report: object
    page: str = "verification.md"


def with_print(deck, cards):
    """`deck` with further requests in front of the end of its last step."""
    at = len(deck.card) - 1
    deck.card[at:at] = Deck(cards).card
    return deck


# ---- figures of a run ---------------------------------------------------------------------------


def drift(total):
    return np.abs(total - total[0]).max()/np.abs(total[0])


def order(sizes, errors):
    """Slope of the errors over the sizes, both as logarithms."""
    return np.polyfit(np.log(sizes), np.log(np.abs(errors)), 1)[0]


# ---- tables and pictures ------------------------------------------------------------------------


def table(head, rows):
    """Lines of a Markdown table."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|"*len(head)]
    return [*lines, *("| " + " | ".join(map(str, row)) + " |" for row in rows)]


def size(value):
    """A figure of round-off: two digits."""
    return f"{value:.1e}"


def axes(n, height=2.9, n_row=1):
    """`n` axes side by side, in `n_row` rows if more than one; all pictures are equally wide."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    plt.rcParams.update({**STYLE, "savefig.dpi": RESOLUTION})
    _, grid = plt.subplots(n_row, n, figsize=(WIDTH, height*n_row + 0.5), squeeze=False,
                           sharex=n_row > 1, layout="constrained")
    return grid[0] if n_row == 1 else grid


def legend(axis, n_column=2):
    """What the curves of one panel are, above it, where no curve is."""
    axis.legend(loc="lower left", bbox_to_anchor=(-0.02, 1.0), ncols=n_column, handlelength=1.6,
                columnspacing=1.0)


def common_legend(axis, n_column=4):
    """What the curves of all panels are, below them; `axis` has each of them."""
    axis.figure.legend(*axis.get_legend_handles_labels(), loc="outside lower center",
                       ncols=n_column, handlelength=1.8)


def save(path):
    from matplotlib import pyplot as plt

    plt.savefig(path)
    plt.close()
