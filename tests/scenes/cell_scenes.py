"""Sectors and cells that repeat themselves, in the plane and in space: decks, and the whole that they stand for."""

from __future__ import annotations

import itertools

import numpy as np
from contact_space_scenes import RUBBER
from space_mesh import TETRAHEDRA, TETRAHEDRON_FACES, Block

ELASTIC = "*ELASTIC\n1000., .3\n*DENSITY\n1.\n"
#: Sides of a quadrilateral and faces of a hexahedron, by their corners.
SIDES = {2: [(0, 1), (1, 2), (2, 3), (3, 0)],
         3: [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)]}
SOLID = {2: "CPE4", 3: "C3D8"}


class Mesh:
    """A box of cells that `place` maps; of each element side the places of its corners in the box are kept."""

    def __init__(self, cells: tuple[int, ...], place=None, kind: str | None = None) -> None:
        self.dim = len(cells)
        self.kind = kind or SOLID[self.dim]
        if self.dim == 3:
            block = Block(self.kind, cells)
            self.box, self.element = block.x, block.element
        else:
            steps = [2*n if self.kind == "CPE8" else n for n in cells]
            label, self.element = {}, []
            step = 2 if self.kind == "CPE8" else 1
            for i, j in itertools.product(range(cells[0]), range(cells[1])):
                at = [(0, 0), (step, 0), (step, step), (0, step)]
                if step == 2:
                    at += [(1, 0), (2, 1), (1, 2), (0, 1)]
                self.element.append([label.setdefault((step*i + a, step*j + b), len(label) + 1) for a, b in at])
            self.box = np.array(list(label))/np.array(steps)
        self.x = self.box.copy() if place is None else place(self.box)

    def at(self, axis: int, end: int) -> list[tuple[int, int]]:
        """(element, side) of the sides at an end of an axis of the box."""
        sides = TETRAHEDRON_FACES if self.kind in TETRAHEDRA else SIDES[self.dim]
        return [(e, s) for e, nodes in enumerate(self.element, 1) for s, corners in enumerate(sides, 1)
                if all(abs(self.box[nodes[c] - 1, axis] - end) < 1e-9 for c in corners)]

    def on(self, axis: int, end: int) -> np.ndarray:
        return np.flatnonzero(np.abs(self.box[:, axis] - end) < 1e-9) + 1


def rotation(dim: int, angle: float) -> np.ndarray:
    turn = np.eye(dim)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return turn


def repeated(mesh: Mesh, n: int) -> tuple[np.ndarray, list[list[int]], np.ndarray]:
    """All sectors with their common nodes made one: places, elements, and the node of each node of the first sector."""
    used: dict[tuple, int] = {}
    place, element, first = [], [], None
    for k in range(n):
        x = mesh.x @ rotation(mesh.dim, 2*np.pi*k/n).T
        label = []
        for row in x:
            key = tuple(np.round(row, 7) + 0.0)
            if used.setdefault(key, len(place) + 1) > len(place):
                place.append(row)
            label.append(used[key])
        first = np.array(label) if first is None else first
        element += [[label[i - 1] for i in nodes] for nodes in mesh.element]
    return np.array(place), element, first


def solid(x: np.ndarray, element: list[list[int]], kind: str, law: str) -> str:
    text = "*NODE, NSET=NALL\n" + "".join(", ".join([str(k), *map(repr, row)]) + "\n" for k, row in enumerate(x.tolist(), 1))
    text += f"*ELEMENT, TYPE={kind}, ELSET=ALL\n"
    for k, nodes in enumerate(element, 1):
        words = [str(w) for w in (k, *nodes)]
        text += "".join(", ".join(words[j:j + 12]) + (",\n" if j + 12 < len(words) else "\n") for j in range(0, len(words), 12))
    return text + f"*MATERIAL, NAME=M\n{law}*SOLID SECTION, ELSET=ALL, MATERIAL=M\n"


def surface(name: str, sides: list[tuple[int, int]]) -> str:
    return f"*SURFACE, NAME={name}\n" + "".join(f"{e}, S{s}\n" for e, s in sides)


def sector(mesh: Mesh, n: int, low: tuple[int, int], high: tuple[int, int], law: str = RUBBER, options: str = "") -> str:
    """One of `n` sectors: `low` and `high` are (axis, end) of its two cuts, slave and master."""
    text = solid(mesh.x, mesh.element, mesh.kind, law) + surface("LEFT", mesh.at(*low)) + surface("RIGHT", mesh.at(*high))
    axis = "0., 0., 0., 0., 0., 1." if mesh.dim == 3 else "0., 0."
    return text + f"*TIE, NAME=RING, CYCLIC SYMMETRY{options}\nLEFT, RIGHT\n*CYCLIC SYMMETRY MODEL, N={n}, TIE=RING\n{axis}\n"


def cell(mesh: Mesh, size: np.ndarray, law: str = RUBBER, options: str = "") -> str:
    """A cell that repeats itself along all axes; nodes 9001, 9002, ... are those of the translations."""
    text = solid(mesh.x, mesh.element, mesh.kind, law) + "*NODE\n"
    text += "".join(f"{9001 + a}, " + ", ".join(["0."]*mesh.dim) + "\n" for a in range(mesh.dim))
    for a in range(mesh.dim):
        way = [0.0]*mesh.dim
        way[a] = float(size[a])
        text += surface(f"LOW{a}", mesh.at(a, 0)) + surface(f"HIGH{a}", mesh.at(a, 1))
        text += f"*TIE, NAME=WAY{a}, TRANSLATION, REF NODE={9001 + a}{options}\nLOW{a}, HIGH{a}, " + ", ".join(map(repr, way)) + "\n"
    return text


def initial(v: np.ndarray) -> str:
    return "*INITIAL CONDITIONS, TYPE=VELOCITY\n" + "".join(
        f"{k}, {a}, {s!r}\n" for k, row in enumerate(v.tolist(), 1) for a, s in enumerate(row, 1))
