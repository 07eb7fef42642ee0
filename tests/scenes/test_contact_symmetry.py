"""Scenes that mirror symmetry rules: what stands on the axis must not choose a side.

The middle node of a disc falls on a node, or on the middle of an edge, of a block. Bodies that
begin exactly as each other's mirror image remain so, to round-off, in every formulation.
"""

import itertools
import math

import numpy as np
import pytest
from scene_tools import EPSILON, Deck, number, run_deck, run_one_sided

N_SIDE, N_RING = 4, 2              # elements along a side of the disc's core; rings around it
GAP = 0.05


class Mesh:
    """Nodes and elements of one body, the same to the bit on both sides of x = 0."""

    def __init__(self, first):
        self.first, self.label, self.x, self.element = first, {}, {}, []

    def node(self, key, x, y):
        label = self.label.setdefault(key, self.first + len(self.label))
        self.x[label] = (x, y)
        return label

    def lines(self, name):
        return [
            f"*ELEMENT, TYPE=CPE4, ELSET={name}",
            *(f"{self.first + k}, " + ", ".join(map(str, e)) for k, e in enumerate(self.element)),
            f"*MATERIAL, NAME={name}", "*HYPERELASTIC, COUPLED NEO HOOKE", "100., 0.3",
            "*DENSITY", "1.", f"*SOLID SECTION, ELSET={name}, MATERIAL={name}", "1.",
        ]


def disc(radius, height):
    """A core of squares with rings around it; a node at its lowest point. Rim: face S2."""
    mesh, n = Mesh(1001), N_SIDE
    around = [*((i, 0) for i in range(n)), *((n, i) for i in range(n)),
              *((n - i, n) for i in range(n)), *((0, n - i) for i in range(n))]

    def core(i, j):
        s, t = 2*i/n - 1, 2*j/n - 1
        half = 0.45*radius
        return half*s*(1 + 0.28*(1 - t*t)), half*t*(1 + 0.28*(1 - s*s))

    def rim(k):
        """The k-th of the rim, from -135 degrees on; place and mirror image from one angle."""
        step = (k - n//2 + 2*n) % (4*n) - 2*n              # from the lowest point, to the right
        angle = math.pi*abs(step)/(2*n)
        aside = radius*math.sin(angle) if -2*n < step else 0.0
        return math.copysign(aside, step), -radius*math.cos(angle)

    def ring(k, level):
        k %= 4*n
        inner, outer = core(*around[k]), rim(k)
        share = level/N_RING
        x, y = (a + (b - a)*share for a, b in zip(inner, outer, strict=True))
        return mesh.node(around[k] if level == 0 else (k, level, "ring"), x, height + y)

    grid = [[mesh.node((i, j), core(i, j)[0], height + core(i, j)[1]) for j in range(n + 1)]
            for i in range(n + 1)]
    for i, j in itertools.product(range(n), range(n)):
        mesh.element.append((grid[i][j], grid[i + 1][j], grid[i + 1][j + 1], grid[i][j + 1]))
    for level, k in itertools.product(range(N_RING), range(4*n)):
        mesh.element.append((ring(k, level), ring(k, level + 1), ring(k + 1, level + 1),
                             ring(k + 1, level)))
    last = len(mesh.element)
    return mesh, [(mesh.first + k, "S2") for k in range(last - 4*n, last)]


def block(width, height, cells, base, first=1):
    """A grid of `cells` under the axis; its top is face S3, its bottom S1."""
    mesh, (n, m) = Mesh(first), cells
    node = [[mesh.node((i, j), width*(2*i - n)/(2*n), base + height*j/m) for j in range(m + 1)]
            for i in range(n + 1)]
    for i, j in itertools.product(range(n), range(m)):
        mesh.element.append((node[i][j], node[i + 1][j], node[i + 1][j + 1], node[i][j + 1]))
    return mesh, {"T": [(first + i*m + m - 1, "S3") for i in range(n)],
                  "B": [(first + i*m, "S1") for i in range(n)]}


def scene(lower, upper, pair, h, t_end, velocity=(0.0, -1.0)):
    """A deck: two bodies (mesh, faces), the upper one moving; `pair`: slave and master."""
    (below, low_faces), (above, up_faces) = lower, upper
    return Deck("\n".join([
        "*HEADING", "mirror symmetry", "*PARAMETER",
        "formulation = MORTAR", "normal = NODAL", "integration = SEGMENTS", "multiplier = DUAL",
        "smoothing = NONE", "initiation = PERSISTENT", "*NODE",
        *(f"{k}, {number(x)}, {number(y)}" for k, (x, y) in {**below.x, **above.x}.items()),
        *below.lines("LOWER"), *above.lines("UPPER"),
        "*SURFACE, NAME=LOW", *(f"{k}, {face}" for k, face in low_faces),
        "*SURFACE, NAME=UP", *(f"{k}, {face}" for k, face in up_faces),
        "*INITIAL CONDITIONS, TYPE=VELOCITY",
        *(f"{k}, {axis}, {number(v)}" for k in above.x for axis, v in enumerate(velocity, 1) if v),
        "*SURFACE INTERACTION, NAME=SMOOTH",
        "*CONTACT PAIR, INTERACTION=SMOOTH, TYPE=<formulation>, SIDES=ONE", ", ".join(pair),
        "*STEP, NLGEOM", "*DYNAMIC, DIRECT", f"{number(h)}, {number(t_end)}",
        "*CONTACT INITIATION, TYPE=<initiation>",
        "*MORTAR, INTEGRATION=<integration>, MULTIPLIER=<multiplier>, NORMAL=<normal>",
        "*SURFACE SMOOTHING, TYPE=<smoothing>", "*NODE FILE", "U, V", "*END STEP",
    ]), "mirror")


def mirror_defect(run):
    """Largest distance of a node from the mirror image of its partner, over all frames."""
    fields = run.fields()
    place = {tuple(x): i for i, x in enumerate(fields.x + 0.0)}
    partner = [place[-x + 0.0, y] for x, y in fields.x]
    q = fields.x + fields["displacement"]
    return np.abs(q - q[:, partner]*[-1.0, 1.0]).max()


def assert_symmetric(run, n_step):
    """Mirror symmetric, and the balances closed, without a cut. Each step leaves some
    sixteen roundings of the positions, which the motion carries on: a few steps only, as a disc
    on its lowest node is unstable, and falls off it by a factor of about two a step."""
    history = run.history
    size = np.abs(run.fields().x).max()
    assert mirror_defect(run) <= 16*EPSILON*size*n_step
    change = history["total"] - history["total"][0]
    assert np.abs(change).max() <= 1e-12*history["kinetic"].max()
    assert history["cuts"].sum() == 0
    assert history["active"].max() >= 1


# ---- a disc dropped straight down ---------------------------------------------------------------

MORTAR = [*itertools.product(["MORTAR"], ["NODAL", "EDGE"], ["SEGMENTS", "ELEMENTS"],
                             ["DUAL", "STANDARD"], ["NONE", "HERMITE"])]
#: Options that a formulation does not read are left at their defaults.
EVERY = [*MORTAR,
         *itertools.product(["SEGMENT"], ["NODAL"], ["SEGMENTS"], ["DUAL", "STANDARD"],
                            ["NONE", "HERMITE"]),
         *itertools.product(["NODE TO SURFACE"], ["NODAL"], ["SEGMENTS"], ["DUAL"],
                            ["NONE", "HERMITE"])]
NAMES = ("formulation", "normal", "integration", "multiplier", "smoothing")


@pytest.mark.each_value
@pytest.mark.parametrize("place", ["node over node", "node over edge"])
@pytest.mark.parametrize("slave", ["UP", "LOW"])
@pytest.mark.parametrize("choice", EVERY, ids=", ".join)
def test_disc_on_block(tmp_path, choice, slave, place):
    above = disc(1.0, 1.0 + GAP)
    below, faces = block(4.0, 1.0, (8 if place == "node over node" else 9, 2), -1.0)
    pair = ("UP", "LOW") if slave == "UP" else ("LOW", "UP")
    h, n_step = 0.03, 6
    deck = scene((below, faces["T"]), above, pair, h, n_step*h)
    run = run_one_sided(deck, tmp_path, **dict(zip(NAMES, choice, strict=True)))
    assert_symmetric(run, n_step)


@pytest.mark.parametrize("size", [(0.3, 4), (0.5, 5)])
@pytest.mark.parametrize("normal", ["NODAL", "EDGE"])
@pytest.mark.parametrize("multiplier", ["DUAL", "STANDARD"])
def test_disc_and_block_in_one_surface(tmp_path, multiplier, normal, size):
    """In contact with itself, with edges of 0.1 to 1: the far side of the disc, nearer than the
    longest edge, lies beyond the point where the normals of its edges cross."""
    radius, cells = size
    mesh, rim = disc(radius, radius + GAP)
    below, faces = block(4.0, 1.0, (cells, 3), -1.0)
    h, n_step = 0.03, 8
    deck = scene((below, faces["T"]), (mesh, rim + faces["T"]), ("UP", "UP"), h, n_step*h)
    run = run_one_sided(deck, tmp_path, multiplier=multiplier, normal=normal)
    assert_symmetric(run, n_step)


# ---- corners and edges that coincide ------------------------------------------------------------

@pytest.mark.each_value
@pytest.mark.parametrize("slave", ["UP", "LOW"])
@pytest.mark.parametrize("choice", EVERY, ids=", ".join)
def test_punch_with_corners_over_nodes(tmp_path, choice, slave):
    above, up = block(2.0, 1.0, (4, 2), GAP, first=1001)
    below, low = block(4.0, 1.0, (8, 3), -1.0)
    pair = ("UP", "LOW") if slave == "UP" else ("LOW", "UP")
    h, n_step = 0.025, 8
    deck = scene((below, low["T"]), (above, up["B"]), pair, h, n_step*h)
    assert_symmetric(run_deck(deck, tmp_path, **dict(zip(NAMES, choice, strict=True))), n_step)


@pytest.mark.each_value
@pytest.mark.parametrize("choice", MORTAR, ids=", ".join)
def test_square_on_its_twin(tmp_path, choice):
    """Of gaps of nodes the gradient jumps at every node here: Newton's method may need cuts."""
    above, up = block(4.0, 1.0, (8, 3), GAP, first=1001)
    below, low = block(4.0, 1.0, (8, 3), -1.0)
    pair = ("UP", "LOW")
    h, n_step = 0.01, 20
    deck = scene((below, low["T"]), (above, up["B"]), pair, h, n_step*h)
    assert_symmetric(run_deck(deck, tmp_path, **dict(zip(NAMES, choice, strict=True))), n_step)


@pytest.mark.parametrize("choice", EVERY, ids=", ".join)
def test_edge_along_edge(tmp_path, choice):
    """Edges in one line that slide along each other feel nothing, whatever passes whatever."""
    above, up = block(2.0, 1.0, (5, 2), 0.0, first=1001)
    below, low = block(4.0, 1.0, (8, 2), -1.0)
    deck = scene((below, low["T"]), (above, up["B"]), ("UP", "LOW"), 0.04, 0.4, (1.0, 0.0))
    history = run_deck(deck, tmp_path, **dict(zip(NAMES, choice, strict=True))).history
    assert history["cuts"].sum() == 0
    assert history["strain"].max() <= 1e-24*history["kinetic"][0]
