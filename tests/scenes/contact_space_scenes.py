"""Two bodies in space in contact: decks from blocks of elements."""

from __future__ import annotations

import numpy as np
from scene_tools import Run
from space_mesh import CUBE_EDGES, TETRAHEDRON_EDGES, Block

RUBBER = "*HYPERELASTIC, NEO HOOKE\n40., .01\n*DENSITY\n1.\n"


def ball(x: np.ndarray) -> np.ndarray:
    """A cube of size 2 around 1 as a ball of radius 1 around 0."""
    p = x - 1.0
    most, length = np.abs(p).max(1)[:, None], np.linalg.norm(p, axis=1)[:, None]
    length[length == 0.0] = 1.0
    return 0.6*(1.0 - most)*p + most*most/length*p


def straight(block: Block) -> Block:
    """Nodes between corners into the middle."""
    edges = TETRAHEDRON_EDGES if block.kind in ("C3D4", "C3D10") else CUBE_EDGES
    if block.step == 2:
        for nodes in block.element:
            for (i, k), m in zip(edges, nodes[-len(edges):], strict=True):
                block.x[m - 1] = 0.5*(block.x[nodes[i] - 1] + block.x[nodes[k] - 1])
    return block


def turned(angle: float) -> np.ndarray:
    """About the first axis."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def faces(block: Block, axis: int | None = None, end: int = 0) -> list[tuple[int, int]]:
    """Those of the outline, or those at one end of an axis."""
    if axis is None:
        return list(block.outer_faces())
    on = set(block.on(axis, end).tolist())
    n_corner = 4 if block.kind in ("C3D4", "C3D10") else 8
    found = []
    for e, f in block.outer_faces():
        nodes = block.element[e - 1][:n_corner]
        corners = ([(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)] if n_corner == 4 else
                   [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)])[f - 1]
        if all(nodes[c] in on for c in corners):
            found.append((e, f))
    return found


def bodies(blocks: list[Block], sides: list[list[tuple[int, int]]], law: str = RUBBER) -> str:
    """Sets N1, N2, ..., surfaces S1, S2, ... of faces."""
    text, first, cells = f"*MATERIAL, NAME=M\n{law}", 0, 0
    for i, (block, side) in enumerate(zip(blocks, sides, strict=True), 1):
        text += f"*NODE, NSET=N{i}\n" + "".join(
            f"{first + k}, {x!r}, {y!r}, {z!r}\n" for k, (x, y, z) in enumerate(block.x.tolist(), 1))
        text += f"*ELEMENT, TYPE={block.type}, ELSET=B{i}\n"
        for k, nodes in enumerate(block.element, cells + 1):
            words = [str(w) for w in (k, *(first + m for m in nodes))]
            text += "".join(", ".join(words[j:j + 12]) + (",\n" if j + 12 < len(words) else "\n")
                            for j in range(0, len(words), 12))
        text += f"*SOLID SECTION, ELSET=B{i}, MATERIAL=M\n*SURFACE, NAME=S{i}\n"
        text += "".join(f"{cells + e}, S{f}\n" for e, f in side)
        first, cells = first + len(block.x), cells + len(block.element)
    return text


def pair(options: str = "", interaction: str = "") -> str:
    return f"*SURFACE INTERACTION, NAME=I\n{interaction}*CONTACT PAIR, INTERACTION=I{options}\nS1, S2\n"


def velocities(block: Block, v: np.ndarray, w: np.ndarray) -> str:
    """A flight with spin of the first block."""
    u = np.asarray(v, float) + np.cross(w, block.x - block.x.mean(0))
    return "*INITIAL CONDITIONS, TYPE=VELOCITY\n" + "".join(
        f"{k}, {a}, {s!r}\n" for k, row in enumerate(u.tolist(), 1) for a, s in enumerate(row, 1) if s)


def dynamic(h: float, until: float, more: str = "") -> str:
    return f"*STEP, NLGEOM, INC=10000\n*DYNAMIC, DIRECT\n{h!r}, {until!r}\n{more}*NODE FILE\nU\n*END STEP\n"


def impact(first: str, second: str, more: str = "", interaction: str = "", cells: int = 2, h: float = 0.02,
           options: str = "") -> str:
    """A ball that flies askew with a spin onto a free plate, and off."""
    turn = turned(0.15)
    one = straight(Block(first, (cells,)*3, size=(2, 2, 2),
                         place=lambda x: ball(x) @ turn.T + np.array([0., 0., 1.06])))
    n = (3, 3, 1) if second in ("C3D10", "C3D20", "C3D20R") else (5, 5, 1)
    two = Block(second, n, size=(3, 3, 0.7), place=lambda x: x - np.array([1.5, 1.5, 0.7]))
    return (bodies([one, two], [faces(one), faces(two, 2, 1)]) + pair(options, interaction)
            + velocities(one, (0.6, 0.25, -1.0), (0., 0., 1.)) + dynamic(h, 0.9, more))


def stack(cells: list[tuple[int, int, int]], gap: float, angle: float = 0.0, options: str = "", more: str = "",
          kind: str = "C3D8", h: float = 0.02, interaction: str = "") -> str:
    """A cube that falls flat, or turned by `angle`, onto a free one of the same size."""
    turn = turned(angle)
    one = Block(kind, cells[0], place=lambda x: (x - np.array([0.5, 0.5, 0.0])) @ turn.T
                + np.array([0.5, 0.5, gap + 0.5*np.sin(abs(angle))]))
    two = Block(kind, cells[1], place=lambda x: x - np.array([0., 0., 1.]))
    return (bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)]) + pair(options, interaction)
            + velocities(one, (0., 0., -1.0), (0., 0., 0.)) + dynamic(h, 0.6, more))


def press(cells: list[tuple[int, int, int]], kind: list[str], by: float, turn: np.ndarray, nu: float = 0.0,
          options: str = "", is_whole: bool = False) -> str:
    """A cube pressed flat onto one of the same size, all turned by `turn`; along the sides they move freely."""
    one = Block(kind[0], cells[0], place=lambda x: x @ turn.T)
    two = Block(kind[1], cells[1], place=lambda x: (x - np.array([0., 0., 1.])) @ turn.T)
    n = len(one.x)
    top, bottom = one.on(2, 1), two.on(2, 0) + n
    way = -by*turn[:, 2]
    sides = [faces(one), faces(two)] if is_whole else [faces(one, 2, 0), faces(two, 2, 1)]
    text = bodies([one, two], sides, f"*ELASTIC\n1000., {nu!r}\n")
    text += "*NSET, NSET=TOP\n" + "".join(f"{k}\n" for k in top)
    text += "*NSET, NSET=BOTTOM\n" + "".join(f"{k}\n" for k in bottom)
    text += pair(options) + "*BOUNDARY\nBOTTOM, 1, 3\n*STEP\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\n"
    text += "".join(f"TOP, {a}, {a}, {s!r}\n" for a, s in enumerate(way.tolist(), 1))
    return text + "*NODE FILE\nU\n*EL FILE\nS\n*END STEP\n"


def slide(h: float, until: float, hill: bool, options: str = "") -> str:
    """A block that slides over facets of length 1 on a cylinder of radius 20, held on it by its weight."""
    sign = -1.0 if hill else 1.0

    def bend(x: np.ndarray) -> np.ndarray:
        y = x - np.array([1.0, 2.0, 1.0])
        y[:, 2] += sign*(20.0 - np.sqrt(400.0 - y[:, 0]**2))
        return y

    one = Block("C3D8", (2, 2, 1), size=(2.0, 1.6, 0.5), place=lambda x: x - np.array([1.0, 0.77, 0.0]) + np.array(
        [0.53, 0.0, 0.02 if hill else 0.066]))
    two = Block("C3D8", (16, 4, 1), size=(16.0, 4.0, 1.0), place=bend)
    n = len(one.x)
    return (bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)], "*HYPERELASTIC, NEO HOOKE\n2000., 1e-3\n*DENSITY\n1.\n")
            + pair(options) + velocities(one, (4.0, 0.7, 0.0), (0., 0., 0.)) + f"*NSET, NSET=FLOOR, GENERATE\n{n + 1}, {n + len(two.x)}\n"
            + "*BOUNDARY\nFLOOR, 1, 3\n" + dynamic(h, until, "*DLOAD\nB1, GRAV, 10., 0., 0., -1.\n"))


def over_the_end(h: float, until: float, options: str = "", more: str = "") -> str:
    """A block that slides off a plate under its weight, tips over the end and falls."""
    one = Block("C3D8", (3, 2, 1), size=(1.5, 1.0, 0.5), place=lambda x: x + np.array([1.0, 0.27, 0.001]))
    two = Block("C3D8", (4, 3, 1), size=(3.0, 1.6, 0.5), place=lambda x: x - np.array([0.0, 0.0, 0.5]))
    n = len(one.x)
    return (bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)], "*HYPERELASTIC, NEO HOOKE\n200., 1e-2\n*DENSITY\n1.\n")
            + pair(options) + velocities(one, (3.0, 0.2, 0.0), (0., 0., 0.)) + f"*NSET, NSET=FLOOR, GENERATE\n{n + 1}, {n + len(two.x)}\n"
            + "*BOUNDARY\nFLOOR, 1, 3\n" + dynamic(h, until, "*DLOAD\nB1, GRAV, 10., 0., 0., -1.\n" + more))


def dent(angle: float) -> str:
    """A cube that is pressed into a valley of two planes, its middle node over the fold; it finds rest in the dent."""
    lean = float(np.tan(0.5*angle))

    def fold(x: np.ndarray) -> np.ndarray:
        y = x - np.array([1.5, 2.0, 1.0])
        y[:, 2] += lean*np.abs(y[:, 1])*(x[:, 2])
        return y

    one = Block("C3D8", (1, 2, 1), size=(0.8, 0.9, 0.6), place=lambda x: x - np.array([0.37, 0.41, -0.28]) - np.array(
        [[0., 0., 1.]])*0.25*(1.0 - 2.2*np.abs(x[:, 1:2] - 0.45))*(1.0 - x[:, 2:]/0.6))
    two = Block("C3D8", (3, 4, 1), size=(3.0, 4.0, 1.0), place=fold)
    n = len(one.x)
    top = "".join(f"{k}\n" for k in one.on(2, 1))
    return (bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)]) + pair(", SIDES=ONE")
            + f"*NSET, NSET=FLOOR, GENERATE\n{n + 1}, {n + len(two.x)}\n*NSET, NSET=TOP\n{top}*BOUNDARY\nFLOOR, 1, 3\n"
            + "*STEP, NLGEOM\n*STATIC, DIRECT\n.25, 1.\n*NEWTON, TYPE=FULL\n*BOUNDARY\nTOP, 1, 1, 0.\n"
            + f"TOP, 2, 2, -.05\nTOP, 3, 3, -.1\n*NODE FILE\nU\n*END STEP\n")


def quadratic_increments(run: Run) -> int:
    """How many increments with contact have four residuals or more, each about the square of the one before, or round-off."""
    n = 0
    for row, active in zip(run.increments, run.history["active"][1:], strict=True):
        residuals = [float(word) for word in row[-1].split()[9:]]
        if active == 0 or len(residuals) < 4:
            continue
        n += 1
        for before, after in zip(residuals[1:], residuals[2:], strict=False):
            assert after <= max(1.0e3*before**2, 1.0e-14), row[-1]
    return n
