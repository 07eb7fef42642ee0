"""Decks of files with their contact anew: of one side, of both, of everything with everything.

`with_sides(deck, sides)` is the transformation, `FileScene(path)` a deck of a file in the place of a
`plain_scenes.Scene`, for `plain_scenes.Outcome`.
"""

import functools
import pathlib
import re
import sys

import numpy as np
import overlap
from scene_tools import Deck

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "scenes"))

from plain_scenes import ALL, BOTH, ONE, Outcome  # noqa: E402

#: What a deck wants to have written; in its place the displacements of every increment.
OUTPUT = ("*NODE FILE", "*EL FILE", "*CONTACT FILE", "*NODE PRINT", "*EL PRINT", "*CONTACT PRINT",
          "*RESTART")
#: Bodies that ties hold together, by deck; in another deck with a tie all of them. They meet in the
#: tie, as well as their meshes allow.
TIED = {"tied_ring": (range(6), range(6, 9))}
NODES = "NODE TO SURFACE"


def keyword(head):
    return head.split(",")[0].strip()


def has(deck, name):
    return any(keyword(head) == name for head, _ in deck.card)


def options(head, **new):
    """A keyword line with other values of some parameters."""
    kept = [word for word in head.split(",") if word.split("=")[0].strip() not in new]
    return ",".join([*kept, *(f" {name}={value}" for name, value in new.items())])


def with_sides(deck, sides):
    """A copy of a deck with its contact pairs as given but with one side, `ONE`; with both, node to
    surface; or with contact of everything with everything, also where there is none."""
    card = [(head, list(data)) for head, data in deck.card if keyword(head) not in OUTPUT]
    new = Deck("", deck.name)
    for head, data in card:
        if keyword(head) == "*CONTACT PAIR":
            if sides == ALL:
                continue
            more = {"TYPE": NODES} if sides == BOTH else {}
            head = options(head, SIDES=sides, **more)
        elif keyword(head) == "*STEP" and sides == ALL and not has(new, "*CONTACT"):
            new.card += [("*CONTACT", []), ("*CONTACT INCLUSIONS, ALL EXTERIOR", [])]
        elif keyword(head) == "*END STEP":
            new.card.append(("*NODE FILE", ["U"]))
        new.card.append((head, data))
    return new


class FileScene:
    """The deck of a file, in runs with other contact."""

    def __init__(self, path):
        self.given = Deck.read(path)

    def deck(self, sides=ONE):
        return with_sides(self.given, sides)

    @property
    def has_contact(self):
        return has(self.given, "*CONTACT PAIR")

    @property
    def has_walls(self):
        """Are there surfaces without nodes, which have one side?"""
        kinds = re.findall(r"\*SURFACE,.*TYPE=(\w+)", self.given.text().upper())
        return any(kind not in ("ELEMENT", "NODE") for kind in kinds)

    @property
    def is_plane(self):
        return not any(keyword(head) == "*ELEMENT" and "TYPE=C3D" in head.replace(" ", "").upper()
                       for head, _ in self.given.card)

    @property
    def is_free(self):
        """Does nothing act from outside?"""
        return not any(has(self.given, name) for name in ("*BOUNDARY", "*CLOAD", "*DLOAD"))

    def alone(self, n_body):
        """Pairs of bodies, numbers from 0, that are not looked at: what a tie holds together, and a
        body with itself unless its surface is in contact with itself."""
        pairs = [line.split(",") for head, data in self.given.card
                 if keyword(head) == "*CONTACT PAIR" for line in data]
        folds = any(slave.strip() == master.strip() for slave, master in pairs)
        alone = set() if folds else {(i, i) for i in range(n_body)}
        if has(self.given, "*TIE"):
            alone |= {(i, j) for group in TIED.get(self.given.name, [range(n_body)])
                      for i in group for j in group if i < j}
        return alone


class FileOutcome(Outcome):
    """A run of a `FileScene`, and what an eye from outside makes of it."""

    patience = 1800

    def __init__(self, scene, folder, sides=ONE, **parameters):
        super().__init__(scene, folder, sides, **parameters)
        self.scene = scene

    @functools.cached_property
    def alone(self):
        return self.scene.alone(overlap.Bodies(self.fields.cells).n)

    @property
    def is_dynamic(self):
        return self.run.history["kinetic"].max() > 0

    @property
    def momentum_error(self):
        """The largest change of momentum, and of angular momentum by the size of the scene, by what
        the mass would have at the largest kinetic energy."""
        history = self.run.history
        mass = self.run.series("BODIES", "MASS")[1].sum()
        size = np.ptp(self.fields.x, axis=0).max()
        change = [np.abs(history[name] - history[name][0]).max()/over
                  for name, over in (("px", 1), ("py", 1), ("lz", size))]
        return max(change)/np.sqrt(2*mass*history["kinetic"].max())

    @functools.cached_property
    def looks(self):
        return overlap.looks(self.fields, self.alone)

    @property
    def overlap(self):
        """The deepest overlap at the end of an increment; of a press fit, at the end of the run."""
        at_end = self.looks[0]
        return at_end[-1] if has(self.scene.given, "*CONTACT INTERFERENCE") else max(at_end)

    @property
    def way(self):
        return max([self.overlap, *self.looks[1]])
