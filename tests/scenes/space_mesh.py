"""Blocks of elements of three dimensions: nodes by their places in a grid, decks of them."""

import itertools

import numpy as np

KINDS = ["C3D4", "C3D8", "C3D8H", "C3D8I", "C3D10", "C3D20", "C3D20R"]
QUADRATIC = {"C3D10", "C3D20", "C3D20R"}
TETRAHEDRA = {"C3D4", "C3D10"}

#: Corners of a hexahedron, and of the six tetrahedra around a diagonal of it.
CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
#: Nodes between corners, as ends of their edges.
CUBE_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5),
              (2, 6), (3, 7)]
TETRAHEDRON_EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
#: Faces S1, S2, ... by their corners.
CUBE_FACES = [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)]
TETRAHEDRON_FACES = [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)]


def kuhn():
    """Six tetrahedra of positive volume that fill a cube."""
    for order in itertools.permutations(range(3)):
        corner = [np.zeros(3, int)]
        for axis in order:
            corner.append(corner[-1] + np.eye(3, dtype=int)[axis])
        if np.linalg.det(np.array(corner[1:]) - corner[0]) < 0:
            corner[1], corner[2] = corner[2], corner[1]
        if np.linalg.det(np.array(corner[1:]) - corner[0]) > 0:
            yield [tuple(c) for c in corner]


class Block:
    """n by m by l cells in a box, which `place` maps to where it is."""

    def __init__(self, kind, cells, size=(1, 1, 1), shake=0.0, place=None):
        self.kind = kind.rstrip("HI")
        self.type, self.cells = kind, cells
        self.step = 2 if self.kind in QUADRATIC else 1
        self.last = tuple(self.step*n for n in cells)
        self.cell_list = list(itertools.product(*(range(n) for n in cells)))
        self.element = []
        used = {}
        for cell in self.cell_list:
            origin = self.step*np.array(cell)
            parts = list(kuhn()) if self.kind in TETRAHEDRA else [CUBE]
            edges = TETRAHEDRON_EDGES if self.kind in TETRAHEDRA else CUBE_EDGES
            for part in parts:
                corner = [origin + self.step*np.array(c) for c in part]
                nodes = corner + [(corner[i] + corner[k])//2 for i, k in edges
                                  if self.kind in QUADRATIC]
                self.element.append([used.setdefault(tuple(map(int, p)), len(used) + 1)
                                     for p in nodes])
        self.label = used
        self.grid = np.array(list(used))
        self.x = self.grid/np.array(self.last)*np.array(size, float)
        self.inner = np.all((self.grid > 0) & (self.grid < self.last), axis=1)
        random = np.random.default_rng(5)
        self.x[self.inner] += shake*random.uniform(-1, 1, (int(self.inner.sum()), 3))
        if self.step == 2:                       # straight edges, with their nodes in the middle
            for nodes in self.element:
                edges = TETRAHEDRON_EDGES if self.kind in TETRAHEDRA else CUBE_EDGES
                for (i, k), m in zip(edges, nodes[-len(edges):], strict=True):
                    self.x[m - 1] = 0.5*(self.x[nodes[i] - 1] + self.x[nodes[k] - 1])
        if place is not None:
            self.x = place(self.x)

    def on(self, axis, end):
        """Labels of the nodes at the first (0) or last (1) layer along an axis."""
        return np.flatnonzero(self.grid[:, axis] == end*self.last[axis]) + 1

    def outer_faces(self):
        """(element, face) of the faces on the outline."""
        faces = TETRAHEDRON_FACES if self.kind in TETRAHEDRA else CUBE_FACES
        for e, nodes in enumerate(self.element, 1):
            for f, corners in enumerate(faces, 1):
                grid = self.grid[[nodes[c] - 1 for c in corners]]
                if np.any(np.all(grid == 0, axis=0) | np.all(grid == self.last, axis=0)):
                    yield e, f

    def deck(self, law, after, density=0.5):
        rows = "".join(f"{k}, {x!r}, {y!r}, {z!r}\n" for k, (x, y, z) in enumerate(self.x.tolist(), 1))
        lines = []
        for k, nodes in enumerate(self.element, 1):
            words = [k, *nodes]
            lines += [", ".join(map(str, words[i:i + 12])) + ("," if i + 12 < len(words) else "")
                      for i in range(0, len(words), 12)]
        elements = "\n".join(lines)
        return (f"*NODE, NSET=NALL\n{rows}*ELEMENT, TYPE={self.type}, ELSET=ALL\n{elements}\n"
                f"*MATERIAL, NAME=M\n{law}*DENSITY\n{density}\n"
                f"*SOLID SECTION, ELSET=ALL, MATERIAL=M\n" + after)
