"""Text of EMCON input decks: nodes, elements, sets, surfaces and structured grids.

Shared by the generators `make_*.py` of this folder; plain Python, no other package.
A deck is a list of lines; numbers are written so that reading them gives the same bits.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise, product

Point = tuple[float, ...]
#: Kinds of elements by how many nodes they have.
KINDS = {3: "CPE3", 4: "CPE4", 8: "C3D8"}


def number(value: float) -> str:
    """Shortest text that reads back as the same double: `0.1`, `10.1`, `1e-05`, `3.`"""
    text = repr(float(value) + 0.0)  # + 0.0 turns -0.0 into 0.0
    return text[:-1] if text.endswith(".0") else text


@dataclass
class Part:
    """A piece of mesh: nodes and elements with their labels, in the order they are written."""

    name: str
    node: dict[int, Point] = field(default_factory=dict)
    element: dict[int, tuple[int, ...]] = field(default_factory=dict)

    def node_lines(self) -> list[str]:
        """`*NODE` with the part's name as node set."""
        lines = [f"*NODE, NSET={self.name}"]
        lines += [f"{label}, {', '.join(map(number, place))}" for label, place in self.node.items()]
        return lines

    def element_lines(self) -> list[str]:
        """`*ELEMENT`, one card per kind, with the part's name as element set."""
        lines: list[str] = []
        for count, kind in KINDS.items():
            chosen = {k: n for k, n in self.element.items() if len(n) == count}
            if chosen:
                lines.append(f"*ELEMENT, TYPE={kind}, ELSET={self.name}")
                lines += [f"{k}, {', '.join(map(str, n))}" for k, n in chosen.items()]
        return lines


@dataclass
class Grid:
    """Quadrilaterals on a rectangular array of n_i x n_j cells, as labels by position.

    `node[i][j]` for i = 0..n_i, j = 0..n_j; `element[i][j]` for i < n_i, j < n_j.
    Faces of an element: S1 at j, S2 at i + 1, S3 at j + 1, S4 at i.
    """

    node: list[list[int]]
    element: list[list[int]]


def add_grid(part: Part, cells: tuple[int, int], position: Callable[[int, int], Point],
             first: tuple[int, int] = (1, 1), closed: bool = False) -> Grid:
    """Add a grid of four-node elements to `part`.

    cells     n_i, n_j
    position  reference position of grid point (i, j); (i, j) -> (x, y) must keep orientation
    first     first node label, first element label
    closed    the last column of cells joins the first (a ring)
    """
    n_i, n_j = cells
    n_column = n_i if closed else n_i + 1
    node = [[first[0] + i*(n_j + 1) + j for j in range(n_j + 1)] for i in range(n_column)]
    for i, column in enumerate(node):
        for j, label in enumerate(column):
            part.node[label] = position(i, j)
    if closed:
        node.append(node[0])
    element = [[first[1] + i*n_j + j for j in range(n_j)] for i in range(n_i)]
    for i in range(n_i):
        for j in range(n_j):
            part.element[element[i][j]] = (node[i][j], node[i + 1][j],
                                           node[i + 1][j + 1], node[i][j + 1])
    return Grid(node, element)


def add_bricks(part: Part, cells: tuple[int, int, int], size: Point) -> None:
    """Add a box of eight-node elements to `part`, its middle at the origin.

    cells     n_i, n_j, n_k
    size      lengths of its edges
    """
    def label(i: int, j: int, k: int) -> int:
        return 1 + k + (cells[2] + 1)*(j + (cells[1] + 1)*i)

    for i, j, k in product(*(range(n + 1) for n in cells)):
        part.node[label(i, j, k)] = tuple(a*(at/n - 0.5)
                                          for a, at, n in zip(size, (i, j, k), cells))
    for number_of, (i, j, k) in enumerate(product(*map(range, cells)), start=1):
        part.element[number_of] = tuple(
            label(i + di, j + dj, k + dk)
            for dk in (0, 1) for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)))


def box(corner: Point, size: Point, cells: tuple[int, int]) -> Callable[[int, int], Point]:
    """Positions of an even rectangular grid, for `add_grid`."""
    return lambda i, j: (corner[0] + size[0]*i/cells[0], corner[1] + size[1]*j/cells[1])


def set_lines(kind: str, name: str, labels: Iterable[int]) -> list[str]:
    """`*NSET` or `*ELSET` (`kind`); evenly spaced labels are written with GENERATE."""
    items = list(labels)
    steps = {b - a for a, b in pairwise(items)}
    if len(items) > 2 and len(steps) == 1:
        step = steps.pop()
        if step > 0:
            return [f"*{kind}, {kind}={name}, GENERATE", f"{items[0]}, {items[-1]}, {step}"]
    rows = [items[k:k + 16] for k in range(0, len(items), 16)]
    return [f"*{kind}, {kind}={name}"] + [", ".join(map(str, row)) for row in rows]


def surface_lines(name: str, face: str, labels: Iterable[int]) -> list[str]:
    """Element set `name` and, from its faces `face` (S1..S4), the surface `name`."""
    return set_lines("ELSET", name, labels) + [f"*SURFACE, NAME={name}, TYPE=ELEMENT",
                                               f"{name}, {face}"]


def comment(text: str) -> list[str]:
    """`text` as comment lines between rules, for the parts of a deck."""
    return ["**"] + [f"** {line}".rstrip() for line in text.strip().splitlines()]


def heading(text: str) -> list[str]:
    """`*HEADING` with the first line of `text`, then the other lines as comments."""
    first, *rest = text.strip().splitlines()
    return ["*HEADING", first] + [f"** {line}".rstrip() for line in rest]


def cells_argument(text: str) -> tuple[int, int]:
    """`64x4` -> (64, 4); for argparse."""
    try:
        n_i, n_j = (int(word) for word in text.lower().split("x"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not of the form 64x4") from None
    if n_i < 1 or n_j < 1:
        raise argparse.ArgumentTypeError(f"'{text}': both counts must be at least 1")
    return n_i, n_j


def arguments(purpose: str | None) -> argparse.ArgumentParser:
    """Command line of a generator: `--output FILE`; the generator adds its own."""
    parser = argparse.ArgumentParser(description=(purpose or "").strip().splitlines()[0])
    parser.add_argument("--output", metavar="FILE", help="write there (default: standard output)")
    return parser


def write_deck(lines: Sequence[str], output: str | None) -> None:
    """Write the deck to the file `output`, or to standard output."""
    text = "\n".join(lines) + "\n"
    if output is None:
        sys.stdout.write(text)
        return
    try:
        with open(output, "w", encoding="ascii", newline="\n") as file:
            file.write(text)
    except OSError as problem:
        sys.exit(f"cannot write {output}: {problem.strerror}")
