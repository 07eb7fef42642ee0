"""A deck of bricks (C3D8, C3D20, C3D20R) with each element split into n x n x n.

What decks of tests ask is kept: nodes and elements have new labels beside those of old nodes, which
stay; sets of nodes get the new ones on edges and faces whose corners they have all, sets of
elements, faces of surfaces and loads of elements those of the parts. Equations and turned axes are
not split.
"""

import itertools
import re

import numpy as np

#: Corners of a brick, in halves of its edges, and its nodes between corners.
CORNERS = np.array([(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)])
MIDDLES = np.array([(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2),
                    (0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)])
#: The side of each face: axis, and which end.
FACES = {1: (2, 0), 2: (2, -1), 3: (1, 0), 4: (0, -1), 5: (1, -1), 6: (0, 0)}


def shapes(place, n_nodes):
    """Shape functions of a brick of 8 or 20 nodes at `place` in [-1, 1]^3."""
    nodes = np.vstack([CORNERS, MIDDLES][:1 if n_nodes == 8 else 2]) - 1
    one = 1 + nodes*place
    value = one.prod(axis=1)/8
    if n_nodes == 20:
        value[:8] *= (nodes[:8]*place).sum(axis=1) - 2
        for k in range(8, 20):
            axis = int(np.flatnonzero(nodes[k] == 0)[0])
            value[k] = np.delete(one[k], axis).prod()*(1 - place[axis]**2)/4
    return value


def blocks(text):
    """[card, its data lines], without comments."""
    found = []
    for line in text.splitlines():
        if line.startswith("**") or not line.strip():
            continue
        if line.startswith("*"):
            found.append([line, []])
        elif found:
            found[-1][1].append(line)
    return found


def keyword(card):
    return card.split(",")[0].strip().upper().replace(" ", "")


def option(card, name):
    match = re.search(rf"(?i),\s*{name}\s*=\s*([^,\s]+)", card)
    return match[1].upper() if match else None


def entries(lines):
    return [part.strip() for part in ",".join(lines).split(",") if part.strip()]


def bodies(elements):
    """A number per node, the same for nodes that elements connect."""
    root = {}

    def find(node):
        while root.setdefault(node, node) != node:
            node = root[node]
        return node

    for nodes in elements.values():
        for node in nodes[1:]:
            root[find(node)] = find(nodes[0])
    return {node: find(node) for node in list(root)}


class Mesh:
    """The split mesh: `xyz`, `elements` {label: nodes}, `parts` {old element: array of new labels},
    `on` {new node: corners of the old edge, face or element on which it is}."""

    def __init__(self, xyz, elements, n):
        self.xyz, self.elements, self.parts, self.on, self.n = dict(xyz), {}, {}, {}, n
        body = bodies(elements)
        size = max(np.ptp(np.array([xyz[node] for node in nodes]), axis=0).max()
                   for nodes in elements.values())
        self.known = {}
        for node in body:
            self.known[self.key(body[node], xyz[node], size)] = node
        for label, nodes in elements.items():
            self.split(label, nodes, body[nodes[0]], size)

    @staticmethod
    def key(body, place, size):
        return (body, *np.round(np.asarray(place)/size*1e6).astype(int))

    def node(self, at, nodes, body, size):
        """The node at `at`, in halves of parts, of the element of `nodes`."""
        place = at/self.n - 1
        key = self.key(body, shapes(place, len(nodes)) @ [self.xyz[k] for k in nodes], size)
        if key not in self.known:
            label = max(self.xyz) + 1
            self.xyz[label] = shapes(place, len(nodes)) @ [self.xyz[k] for k in nodes]
            self.known[key] = label
            inside = (0 < at) & (at < 2*self.n)
            self.on[label] = [nodes[k] for k, corner in enumerate(CORNERS)
                              if (inside | (corner*self.n == at)).all()]
        return self.known[key]

    def split(self, label, nodes, body, size):
        n = self.n
        self.parts[label] = np.zeros((n, n, n), int)
        within = np.vstack([CORNERS, MIDDLES])[:len(nodes)]
        for i in itertools.product(range(n), repeat=3):
            new = label if not self.elements else max(self.elements) + 1
            self.elements[new] = [self.node(2*np.array(i) + at, nodes, body, size) for at in within]
            self.parts[label][i] = new

    def side(self, label, face):
        axis, end = FACES[face]
        return self.parts[label].take(end, axis).ravel()


def refined(text, n):
    """`text` with each brick split into n x n x n."""
    deck = blocks(text)
    xyz, elements = {}, {}
    for card, lines in deck:
        if keyword(card) == "*NODE":
            xyz.update((int(line.split(",")[0]), np.array(line.split(",")[1:4], float)) for line in lines)
        if keyword(card) == "*ELEMENT":
            count = 20 if option(card, "TYPE").startswith("C3D20") else 8
            numbers = [int(part) for part in entries(lines)]
            elements.update((row[0], row[1:]) for row in
                            (numbers[k:k + count + 1] for k in range(0, len(numbers), count + 1)))
    mesh = Mesh(xyz, elements, n)
    out = []
    for card, lines in deck:
        out += [card, *split_lines(card, lines, mesh)]
    return "\n".join(out) + "\n"


def split_lines(card, lines, mesh):
    """The data lines of a card for the split mesh."""
    name = keyword(card)
    if name == "*NODE":
        return [f"{label}, {', '.join(repr(float(x)) for x in place)}" for label, place in mesh.xyz.items()]
    if name == "*ELEMENT":
        count = 20 if option(card, "TYPE").startswith("C3D20") else 8
        own = [int(part) for part in entries(lines)][::count + 1]
        return [row for label in own for new in mesh.parts[label].ravel()
                for row in rows([new, *mesh.elements[new]])]
    if name == "*NSET":
        have = {int(part) for part in entries(lines)}
        have |= {label for label, corners in mesh.on.items() if have.issuperset(corners)}
        return [f"{label}," for label in sorted(have)]
    if name == "*ELSET":
        return [f"{new}," for part in entries(lines) for new in mesh.parts[int(part)].ravel()]
    if name in ("*SURFACE", "*DLOAD") and option(card, "TYPE") != "NODE":
        return [row for line in lines for row in faces(line, mesh)]
    return lines


def faces(line, mesh):
    """A line `element, face` for the parts at the face."""
    label, face, *rest = (part.strip() for part in line.split(","))
    if not label.isdigit():
        return [line]
    return [", ".join([str(new), face, *rest]) for new in mesh.side(int(label), int(face[-1]))]


def rows(numbers):
    """Data lines of at most eleven numbers, all but the last with a comma at the end."""
    parts = [numbers[k:k + 11] for k in range(0, len(numbers), 11)]
    return [", ".join(map(str, part)) + ("," if part is not parts[-1] else "") for part in parts]
