"""Bodies in space that ties hold together: decks, and figures by their own sums."""

import itertools

import numpy as np
from contact_space_scenes import RUBBER, bodies, faces, straight
from space_mesh import CUBE_FACES, TETRAHEDRON_FACES, Block

ELASTIC = "*ELASTIC\n1000., .3\n*DENSITY\n1.\n"
GAUSS = [tuple(p) for p in itertools.product((-3**-0.5, 3**-0.5), repeat=3)]
CORNER = np.array([(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)])


def tied(blocks: list[Block], ties: list[tuple[int, int, int]], law: str = ELASTIC, options: str = "") -> tuple[str, np.ndarray]:
    """Blocks, of which ties (slave, master, axis along which the slave is farther) join faces; and all nodes."""
    text = bodies(blocks, [faces(b) for b in blocks], law)
    before = np.cumsum([0] + [len(b.element) for b in blocks])
    for t, (slave, master, axis) in enumerate(ties, 1):
        for role, b, end in (("S", slave, 0), ("M", master, 1)):
            text += f"*SURFACE, NAME=T{t}{role}\n" + "".join(f"{before[b] + e}, S{f}\n" for e, f in faces(blocks[b], axis, end))
    text += f"*TIE, NAME=T{options}\n" + "".join(f"T{t}S, T{t}M\n" for t in range(1, len(ties) + 1))
    return text, np.vstack([b.x for b in blocks])


def box(kind: str, cells: tuple[int, int, int], low: tuple, high: tuple) -> Block:
    low, high = np.array(low, float), np.array(high, float)
    return straight(Block(kind, cells, place=lambda x: low + x*(high - low)))


def shaken(block: Block, z: float, by: float) -> Block:
    """Nodes of one plane moved along it, but for those at its sides."""
    inside = (np.abs(block.x[:, 2] - z) < 1e-9) & (np.abs(block.x[:, :2] - 0.5) < 0.499).all(1)
    block.x[inside, :2] += by*np.random.default_rng(1).uniform(-0.5, 0.5, (int(inside.sum()), 2))
    return straight(block)


def eighths(kinds: list[str], cells: list[int]) -> tuple[list[Block], list[tuple[int, int, int]]]:
    """A cube of eight boxes that meet in six edges and a point, tied by twelve ties."""
    blocks, ties = [], []
    for at, kind, n in zip(itertools.product((0, 1), repeat=3), kinds, cells, strict=True):
        ties += [(len(blocks), len(blocks) - (4, 2, 1)[a], a) for a in range(3) if at[a]]
        blocks.append(box(kind, (n,)*3, np.array(at)/2, (np.array(at) + 1)/2))
    return blocks, ties


def stretch(x: np.ndarray, by: float = 0.001) -> str:
    """Three planes of symmetry, the top at z = 1 moved."""
    text = "*BOUNDARY\n" + "".join(f"{k}, {a + 1}, {a + 1}\n" for k, p in enumerate(x, 1) for a in range(3) if p[a] < 1e-9)
    text += "*STEP\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\n"
    text += "".join(f"{k}, 3, 3, {by!r}\n" for k, p in enumerate(x, 1) if p[2] > 1 - 1e-9)
    return text + "*NODE FILE\nU\n*EL FILE\nS\n*END STEP\n"


def flight(x: np.ndarray, more: str = "", steps: int = 20) -> str:
    """A free flight that turns and swings."""
    y = x - x.mean(0)
    v = np.cross([.4, 1.3, .7], y) + 0.3*np.stack([np.sin(3*y[:, 1]), np.cos(2*y[:, 2]), np.sin(2*y[:, 0] + 1)], 1)
    text = "*INITIAL CONDITIONS, TYPE=VELOCITY\n" + "".join(
        f"{k}, {a}, {s!r}\n" for k, row in enumerate((v + [.2, 0, .1]).tolist(), 1) for a, s in enumerate(row, 1))
    return text + f"*STEP, NLGEOM\n*DYNAMIC, DIRECT\n.05, {0.05*steps!r}\n{more}*NODE FILE\nU, V\n*END STEP\n"


def momenta(element: list[list[int]], x0: np.ndarray, x: np.ndarray, v: np.ndarray, density: float = 1.0) -> np.ndarray:
    """Linear and angular momentum of eight-node elements, by 2x2x2 points in the shape at the start."""
    total = np.zeros(6)
    for nodes in element:
        n = np.array(nodes) - 1
        for p in GAUSS:
            factor = 1 + CORNER*np.array(p)
            shape = factor.prod(1)/8
            slope = np.stack([CORNER[:, a]*np.delete(factor, a, 1).prod(1)/8 for a in range(3)], 1)
            weight = density*np.linalg.det(slope.T @ x0[n])
            place, speed = shape @ x[n], shape @ v[n]
            total += weight*np.concatenate([speed, np.cross(place, speed)])
    return total


class Mesh:
    """Parts with their common nodes made one; as much of a `Block` as decks ask for."""

    def __init__(self, parts: list[Block]) -> None:
        self.type, self.kind, self.element, place, used = parts[0].type, parts[0].kind, [], [], {}
        for part in parts:
            for row in part.x:
                if used.setdefault(tuple(np.round(row, 9) + 0.0), len(place) + 1) > len(place):
                    place.append(row)
            label = [used[tuple(np.round(row, 9) + 0.0)] for row in part.x]
            self.element += [[label[k - 1] for k in nodes] for nodes in part.element]
        self.x = np.array(place)

    def at(self, radius: float) -> list[tuple[int, int]]:
        corners = TETRAHEDRON_FACES if self.kind in ("C3D4", "C3D10") else CUBE_FACES
        r = np.linalg.norm(self.x, axis=1)
        return [(e, f) for e, nodes in enumerate(self.element, 1) for f, c in enumerate(corners, 1)
                if np.allclose(r[[nodes[i] - 1 for i in c]], radius, atol=1e-9)]


def shell(kind: str, cells: int, layers: int, inner: float, outer: float) -> Mesh:
    """An eighth of a spherical shell, made of three patches."""
    def part(axis: int) -> Block:
        def place(x: np.ndarray) -> np.ndarray:
            way = np.roll(np.column_stack([np.ones(len(x)), np.tan(x[:, :2]*np.pi/4)]), axis, axis=1)
            return way/np.linalg.norm(way, axis=1)[:, None]*(inner + (outer - inner)*x[:, 2:])
        return Block(kind, (cells, cells, layers), place=place)

    return Mesh([part(axis) for axis in range(3)])


def shells(kinds: list[str], cells: list[int], layers: int) -> tuple[str, np.ndarray]:
    """Shells of radii 1, 1.5 and 1.5, 2 tied to each other, a unit pressure inside."""
    parts = [shell(kinds[0], cells[0], layers, 1.0, 1.5), shell(kinds[1], cells[1], layers, 1.5, 2.0)]
    text = bodies(parts, [p.at(1.5) for p in parts], ELASTIC)
    text += "*SURFACE, NAME=INNER\n" + "".join(f"{e}, S{f}\n" for e, f in parts[0].at(1.0))
    x = np.vstack([p.x for p in parts])
    text += "*TIE, NAME=T\nS2, S1\n*BOUNDARY\n" + "".join(
        f"{k}, {a + 1}, {a + 1}\n" for k, p in enumerate(x, 1) for a in range(3) if abs(p[a]) < 1e-9)
    return text + "*STEP\n*STATIC, DIRECT\n1., 1.\n*DSLOAD\nINNER, P, 1.\n*NODE FILE\nU\n*END STEP\n", x


def quarter_shells(cells: list[tuple[int, int]], kinds: list[str]) -> tuple[str, np.ndarray]:
    """Two quarters of a cylinder in each other, meshes that do not match."""
    def bent(inner: float, outer: float):
        def place(x: np.ndarray) -> np.ndarray:
            r, angle = inner + (outer - inner)*x[:, 0], np.pi/2*x[:, 1]
            return np.stack([r*np.cos(angle), r*np.sin(angle), x[:, 2]], 1)
        return place

    blocks = [Block(kinds[0], (1, *cells[0]), place=bent(1.0, 1.3)), Block(kinds[1], (1, *cells[1]), place=bent(1.3, 1.6))]
    return tied(blocks, [(1, 0, 0)], RUBBER)


def cube_in_hole(cells: tuple[int, int], kinds: tuple[str, str], slave: int, law: str = ELASTIC) -> tuple[str, np.ndarray]:
    """A cube in the hole of a larger one: a closed interface with edges. Meshes of (hole, cube), `slave` 1 or 2."""
    third = [np.array(at)/3 for at in itertools.product(range(3), repeat=3) if at != (1, 1, 1)]
    outer = Mesh([box(kinds[0], (cells[0],)*3, low, low + 1/3) for low in third])
    inner = box(kinds[1], (cells[1],)*3, (1/3,)*3, (2/3,)*3)
    corners = TETRAHEDRON_FACES if outer.kind in ("C3D4", "C3D10") else CUBE_FACES
    at = [(e, f, outer.x[[nodes[i] - 1 for i in c]]) for e, nodes in enumerate(outer.element, 1) for f, c in enumerate(corners, 1)]
    hole = [(e, f) for e, f, x in at if np.all(np.abs(x - 0.5) < 1/6 + 1e-9) and
            np.any(np.all(np.abs(np.abs(x - 0.5) - 1/6) < 1e-9, axis=0) & (np.ptp(x, axis=0) < 1e-9))]
    text = bodies([outer, inner], [hole, faces(inner)], law)
    text += f"*TIE, NAME=T\nS{slave}, S{3 - slave}\n"
    return text, np.vstack([outer.x, inner.x])
