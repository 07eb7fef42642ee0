"""The mesh of input_decks/make_ring.py, and what a run of it tells."""

import dataclasses
import sys

from scene_tools import DECKS

sys.path.insert(0, str(DECKS))

import make_ring  # noqa: E402
from deckwriter import Part, add_grid, box  # noqa: E402

#: Young's moduli of ring and block, and Poisson's ratio of both.
YOUNG, NU = (100.0, 1e5), 0.1


@dataclasses.dataclass(frozen=True)
class Ring:
    """Nodes and elements by label, counter-clockwise, and the parts of the scene."""

    node: dict
    element: dict
    ring: list            # elements
    block: list
    outer: list           # of the ring, their first faces are the rim
    top: list             # of the block, their third faces are the top
    bottom: list          # nodes

    @property
    def unknowns(self):
        return 2*(len(self.node) - len(self.bottom))

    def nodes_of(self, elements):
        return sorted({a for k in elements for a in self.element[k]})


def ring_of(around, block):
    """The scene with so many elements around and through the ring, along and down the block."""
    one, other = Part("RING"), Part("BLOCK")
    rim = add_grid(one, around, lambda k, j: make_ring.ring_position(k, j, around), closed=True)
    grid = add_grid(other, block, box(make_ring.BLOCK_CORNER, make_ring.BLOCK_SIZE, block),
                    first=(len(one.node) + 1, len(one.element) + 1))
    return Ring({**one.node, **other.node}, {**one.element, **other.element},
                list(one.element), list(other.element), [c[0] for c in rim.element],
                [c[-1] for c in grid.element], [c[0] for c in grid.node])


@dataclasses.dataclass
class Told:
    """What one run of a code tells."""

    user: float           # seconds of the processor per increment
    energy: list          # kinetic and strain, by increments, the first at the start
    iterations: float     # per increment

    @property
    def error(self):
        """The largest deviation of the energy from that at the start, over that, with its sign."""
        return max((e/self.energy[0] - 1 for e in self.energy), key=abs)
