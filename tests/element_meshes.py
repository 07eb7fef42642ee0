"""Meshes of every plane kind between four corners, and their decks."""

import numpy as np

QUADRATIC = {"CPE6", "CPE8", "CPE8R", "CPS6", "CPS8", "CPS8R", "CAX6", "CAX8", "CAX8R"}


class Mesh:
    """n by m cells between four corners; nodes by their places in the grid."""

    def __init__(self, kind, n, m, corners, shake=0.0):
        self.kind, self.size = kind, (n, m)
        self.step = 2 if kind in QUADRATIC else 1
        self.last = (self.step*n, self.step*m)
        self.label, self.x = {}, []
        corners = np.array(corners, float)
        for j in range(self.last[1] + 1):
            for i in range(self.last[0] + 1):
                if "8" in kind and i % 2 and j % 2:
                    continue
                s, t = i/self.last[0], j/self.last[1]
                self.label[i, j] = len(self.x) + 1
                self.x.append(np.array([(1 - s)*(1 - t), s*(1 - t), s*t, (1 - s)*t]) @ corners)
        self.x = np.array(self.x)
        inner = [k for (i, j), k in self.label.items()
                 if 0 < i < self.last[0] and 0 < j < self.last[1]]
        self.inner = np.array(inner, int) - 1
        random = np.random.default_rng(3)
        self.x[self.inner] += shake*random.uniform(-1, 1, (len(inner), 2))

    def at(self, *places):
        return [self.label[place] for place in places]

    def elements(self):
        q = self.step
        for j in range(self.size[1]):
            for i in range(self.size[0]):
                a = [(q*i, q*j), (q*i + q, q*j), (q*i + q, q*j + q), (q*i, q*j + q)]
                parts = [a] if "3" not in self.kind and "6" not in self.kind else [a[:3],
                                                                                  [a[0], *a[2:]]]
                for part in parts:
                    ends = zip(part, part[1:] + part[:1])
                    middle = [((p[0] + r[0])//2, (p[1] + r[1])//2) for p, r in ends]
                    yield self.at(*part, *(middle if q == 2 else []))

    def side(self, which):
        """Labels along the left, right, bottom or top side."""
        i, j = self.last
        return [k for (a, b), k in self.label.items()
                if {"left": a == 0, "right": a == i, "bottom": b == 0, "top": b == j}[which]]

    def deck(self, law, after):
        rows = "".join(f"{k}, {x!r}, {y!r}\n" for k, (x, y) in enumerate(self.x.tolist(), 1))
        elements = "".join(f"{k}, {', '.join(map(str, e))}\n"
                           for k, e in enumerate(self.elements(), 1))
        return (f"*NODE, NSET=NALL\n{rows}*ELEMENT, TYPE={self.kind}, ELSET=ALL\n{elements}"
                f"*MATERIAL, NAME=M\n{law}*DENSITY\n0.5\n*SOLID SECTION, ELSET=ALL, MATERIAL=M\n"
                + after)

    def shares(self, which):
        """Parts of a load along a side that is as large everywhere, by label; their sum is 1."""
        side, found = self.side(which), {}
        parts = np.array([1, 4, 1])/6 if self.step == 2 else np.array([1, 1])/2
        cells = (len(side) - 1)//self.step
        for first in range(0, len(side) - 1, self.step):
            for k, part in enumerate(parts):
                found[side[first + k]] = found.get(side[first + k], 0) + part/cells
        return found
