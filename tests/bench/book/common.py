"""What the chapters share: runs in the background, formulations of contact, tables, figures."""

import concurrent.futures
import dataclasses
import pathlib
import subprocess
import sys

import matplotlib as mpl
import numpy as np
from scene_tools import DECKS, Deck, run_deck

TREATMENTS = ("PERSISTENT", "ADMISSIBLE", "VELOCITY UPDATE")
COLOURS = ("#1f4e79", "#b5532a", "#4c8c4a", "#7b4a8c", "#b8962e")


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


def axes(n, height=2.7, n_row=1, width=3.6):
    """`n` small axes side by side, in `n_row` rows if more than one."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    plt.rcParams.update({"font.size": 8, "axes.spines.top": False, "axes.spines.right": False})
    _, grid = plt.subplots(
        n_row, n, figsize=(width*n + 0.3, height*n_row), squeeze=False, sharex=n_row > 1
    )
    return grid[0] if n_row == 1 else grid


def save(path):
    from matplotlib import pyplot as plt

    plt.tight_layout()
    plt.savefig(path, dpi=110)
    plt.close()
