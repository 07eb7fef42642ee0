"""Ties in space against closed forms: a smooth field, a cantilever, spheres; orders of convergence."""

import itertools
import sys

import numpy as np
from scene_tools import DECKS, Deck
from tie_tools import BEAM

from .common import Chapter, size, table

sys.path.append(str(DECKS.parent/"tests"/"scenes"))
from contact_space_scenes import straight  # noqa: E402
from space_mesh import CUBE, CUBE_EDGES, TETRAHEDRON_EDGES, Block  # noqa: E402
from tie_space_scenes import ELASTIC, box, eighths, shells, tied  # noqa: E402

YOUNG, POISSON = 1000.0, 0.3
#: Cells of the coarse side along half of the body.
LEVELS = (2, 4, 8)


# ---- exact solutions -----------------------------------------------------------------------------


class Smooth:
    """A smooth field without body force, by Papkovich and Neuber: (3 - 4 nu) f e - x df, of a harmonic f.

    f = exp(3 x) sin(a y + .3) cos(b z - .4), e along the first axis.
    """

    a, b = 1.8, 2.4                              # a^2 + b^2 = 3^2

    def parts(self, x):
        """f, its slopes and its second derivatives along the first axis and another."""
        e = np.exp(3*(x[:, 0] - 1))
        s, c = np.sin(self.a*x[:, 1] + .3), np.cos(self.a*x[:, 1] + .3)
        p, q = np.cos(self.b*x[:, 2] - .4), -np.sin(self.b*x[:, 2] - .4)
        return e, (s, c), (p, q)

    def derivative(self, x, order):
        """Of f, by the numbers of derivatives along the axes."""
        e, y, z = self.parts(x)
        value = e*3.0**order[0]
        for pair, rate, n in ((y, self.a, order[1]), (z, self.b, order[2])):
            value = value*rate**n*(pair[n % 2] if n < 2 else -pair[0])
        return value

    def displacement(self, x):
        unit = np.eye(3, dtype=int)
        u = [-x[:, 0]*self.derivative(x, unit[i]) for i in range(3)]
        u[0] = u[0] + (3 - 4*POISSON)*self.derivative(x, (0, 0, 0))
        return np.stack(u, axis=1)

    def gradient(self, x):
        """(point, component, direction)"""
        unit = np.eye(3, dtype=int)
        slope = np.empty((len(x), 3, 3))
        for i, k in itertools.product(range(3), repeat=2):
            slope[:, i, k] = -x[:, 0]*self.derivative(x, unit[i] + unit[k])
            if k == 0:
                slope[:, i, k] -= self.derivative(x, unit[i])
            if i == 0:
                slope[:, i, k] += (3 - 4*POISSON)*self.derivative(x, unit[k])
        return slope


class Cantilever:
    """The beam of the plane in plane strain, its sides held across."""

    def displacement(self, x):
        u, v = BEAM.displacement(x[:, 0], x[:, 1])
        return np.stack([u, v, 0*u], axis=1)

    def gradient(self, x):
        """By differences of a polynomial of third degree, which central ones meet to round-off."""
        slope, step = np.zeros((len(x), 3, 3)), 0.5
        for k in range(2):
            way = np.eye(3)[k]
            wide, narrow = ((self.displacement(x + h*way) - self.displacement(x - h*way))/(2*h) for h in (2*step, step))
            slope[:, :, k] = (4*narrow - wide)/3
        return slope


class Sphere:
    """A shell of radii 1 and 2 with a unit pressure inside (Lame)."""

    def displacement(self, x):
        r = np.linalg.norm(x, axis=1)[:, None]
        return x*((1 - 2*POISSON)/YOUNG + (1 + POISSON)/YOUNG*4/r**3)/7

    def gradient(self, x):
        r = np.linalg.norm(x, axis=1)[:, None, None]
        a, b = (1 - 2*POISSON)/(7*YOUNG), (1 + POISSON)/(7*YOUNG)*4
        return (a + b/r**3)*np.eye(3) - 3*b/r**5*x[:, :, None]*x[:, None, :]


# ---- errors --------------------------------------------------------------------------------------


def shape_of(kind):
    """Corners and nodes between them, and the exponents of the polynomials of an element."""
    if kind == "C3D10":
        corner = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
        node = [*corner, *(corner[[i, k]].mean(0) for i, k in TETRAHEDRON_EDGES)]
        return np.array(node), [p for p in itertools.product(range(3), repeat=3) if sum(p) <= 2]
    corner = 2*np.array(CUBE, float) - 1
    if kind == "C3D8":
        return corner, list(itertools.product(range(2), repeat=3))
    node = [*corner, *(corner[[i, k]].mean(0) for i, k in CUBE_EDGES)]
    # Each variable to at most the second power, one of them alone.
    return np.array(node), [p for p in itertools.product(range(3), repeat=3) if p.count(2) <= 1]


def points_of(kind):
    """Points and weights of Gauss; of tetrahedra those of a cube that is drawn together."""
    at, weight = np.polynomial.legendre.leggauss(4)
    point = np.array(list(itertools.product(at, repeat=3)))
    size_of = np.array(list(itertools.product(weight, repeat=3))).prod(1)
    if kind != "C3D10":
        return point, size_of
    u = (point + 1)/2
    place = np.stack([u[:, 0], u[:, 1]*(1 - u[:, 0]), u[:, 2]*(1 - u[:, 0])*(1 - u[:, 1])], axis=1)
    return place, size_of/8*(1 - u[:, 0])**2*(1 - u[:, 1])


def power(at, exponent):
    return np.stack([(at**np.array(p)).prod(-1) for p in exponent], axis=-1)


def slopes(at, exponent):
    """(point, direction, monomial)"""
    rows = []
    for k in range(3):
        lower = [tuple(max(n - (i == k), 0) for i, n in enumerate(p)) for p in exponent]
        rows.append(power(at, lower)*[p[k] for p in exponent])
    return np.stack(rows, axis=1)


def elastic(strain):
    """Twice the energy per volume, of (..., 3, 3)."""
    mu, lam = YOUNG/(2*(1 + POISSON)), YOUNG*POISSON/((1 + POISSON)*(1 - 2*POISSON))
    return 2*mu*(strain**2).sum((-1, -2)) + lam*np.trace(strain, axis1=-2, axis2=-1)**2


def error_norms(cells, x, u, kind, exact):
    """Errors of displacement in the mean square and of stress in energy: (2, error and solution), squared sums."""
    node, exponent = shape_of(kind)
    back = np.linalg.inv(power(node, exponent))
    cell, total = np.array(cells), np.zeros((2, 2))
    for at, weight in zip(*points_of(kind), strict=True):
        shape, slope = power(at, exponent) @ back, slopes(at[None], exponent)[0] @ back
        jacobian = np.einsum("ka,eai->eki", slope, x[cell])
        volume = weight*np.linalg.det(jacobian)
        gradient = np.linalg.solve(jacobian, np.einsum("ka,eai->eki", slope, u[cell])).transpose(0, 2, 1)
        point = np.einsum("a,eai->ei", shape, x[cell])
        wanted, place = exact.gradient(point), exact.displacement(point)
        strains = [0.5*(g + g.transpose(0, 2, 1)) for g in (gradient - wanted, wanted)]
        moves = [np.einsum("a,eai->ei", shape, u[cell]) - place, place]
        for k in range(2):
            total[0, k] += (volume*(moves[k]**2).sum(1)).sum()
            total[1, k] += (volume*elastic(strains[k])).sum()
    return total


def relative(blocks, fields, exact):
    """Both errors of all pieces together, relative to the solution."""
    total, first = np.zeros((2, 2)), 0
    x, u = fields.x, fields["displacement"][-1]
    for block in blocks:
        cells = np.array(block.element) - 1 + first
        total += error_norms(cells, x, u, block.kind.removesuffix("R"), exact)
        first += len(block.x)
    return np.sqrt(total[:, 0]/total[:, 1])


# ---- smooth field --------------------------------------------------------------------------------


def bulged(block, low):
    """A piece of the cube below or above z = 1/2, which is bulged where the pieces meet."""
    grid = block.x.copy()
    part = grid[:, 2]/0.5 if low else (1 - grid[:, 2])/0.5
    block.x[:, 2] += 0.4*part*grid[:, 0]*(1 - grid[:, 0])*grid[:, 1]*(1 - grid[:, 1])*4
    return block


def halves(kind, n, m):
    return [box(kind, (2*n, 2*n, n), (0, 0, 0), (1, 1, .5)), box(kind, (2*m, 2*m, m), (0, 0, .5), (1, 1, 1))], [(1, 0, 2)]


def arched(kind, n, m):
    blocks, ties = halves(kind, n, m)
    return [bulged(b, low) for b, low in zip(blocks, (True, False), strict=True)], ties


def pieces(kind, n, m):
    """Eight boxes, coarse and fine ones in turn, the fine ones are slaves."""
    fine = [sum(at) % 2 == 1 for at in itertools.product((0, 1), repeat=3)]
    blocks, ties = eighths([kind]*8, [m if f else n for f in fine])
    return blocks, ties, [not fine[farther] for farther, *_ in ties]


def one_mesh(kind, n, _):
    return [box(kind, (2*n,)*3, (0, 0, 0), (1, 1, 1))], []


#: Interface, kind, ratios of the numbers of cells.
SMOOTH = [("one piece", one_mesh, "C3D8", 1), ("flat", halves, "C3D8", 1), ("flat", halves, "C3D8", 1.5),
          ("arched", arched, "C3D8", 1), ("arched", arched, "C3D8", 1.5), ("2 x 2 x 2 pieces", pieces, "C3D8", 1.5),
          ("one piece", one_mesh, "C3D20", 1), ("flat", halves, "C3D20", 1.5), ("arched", arched, "C3D20", 1.5),
          ("one piece", one_mesh, "C3D10", 1), ("flat", halves, "C3D10", 1.5), ("arched", arched, "C3D10", 1.5)]
SMOOTH_LEVELS = {"C3D8": LEVELS, "C3D20": (2, 4, 6), "C3D10": (2, 4)}


def made(blocks, ties, flipped=()):
    """The deck of pieces; of ties that are `flipped` the slave is the piece that is nearer along the axis."""
    text, x = tied(blocks, ties)
    for t, is_flipped in enumerate(flipped, 1):
        if is_flipped:
            text = text.replace(f"NAME=T{t}S", "NAME=KEPT").replace(f"NAME=T{t}M", f"NAME=T{t}S").replace("NAME=KEPT", f"NAME=T{t}M")
    return (text if ties else text[:text.index("*TIE")]), x


def start_smooth(runs):
    started = {}
    for name, body, kind, ratio in SMOOTH:
        for n in SMOOTH_LEVELS[kind]:
            blocks, *ties = body(kind, n, round(ratio*n))
            text, x = made(blocks, *ties)
            outer = np.flatnonzero((np.abs(x - 0.5) > 0.5 - 1e-9).any(1))
            text += "*STEP\n*STATIC, DIRECT\n1., 1.\n" + prescribed(outer, Smooth().displacement(x[outer]))
            started[name, kind, ratio, n] = blocks, runs.start(Deck(text + "*NODE FILE\nU\n*END STEP\n"))
    return started


def prescribed(nodes, u):
    return "*BOUNDARY\n" + "".join(f"{k + 1}, {a + 1}, {a + 1}, {float(row[a])!r}\n"
                                   for k, row in zip(nodes, u, strict=True) for a in range(3))


def slope_of(levels, errors):
    """Between the last two levels."""
    return np.log(errors[-2]/errors[-1])/np.log(levels[-1]/levels[-2])


def report_smooth(started, _):
    rows = []
    for name, _, kind, ratio in SMOOTH:
        levels = SMOOTH_LEVELS[kind]
        norms = np.array([relative(blocks, run.result().fields(), Smooth())
                          for blocks, run in (started[name, kind, ratio, n] for n in levels)])
        rows.append((name, f"`{kind}`", f"1 : {ratio:g}", f"{levels[-1]}", size(norms[-1, 0]), f"{slope_of(levels, norms[:, 0]):.2f}",
                     size(norms[-1, 1]), f"{slope_of(levels, norms[:, 1]):.2f}"))
    return table(["interface", "elements", "ratio", "level", "displacement", "order", "energy", "order"], rows)


# ---- cantilever ----------------------------------------------------------------------------------

BEAMS = [("C3D8", 1), ("C3D8", 1.5), ("C3D20", 1), ("C3D20", 1.5)]
BEAM_LEVELS = {"C3D8": (4, 8, 16), "C3D20": (2, 4)}


def beam(kind, ratio, n):
    """Three pieces, the one in the middle finer; two cells across the coarse ones, as wide as the depth of one level."""
    cells = (round(BEAM.length/3*n/BEAM.depth), n, 2)
    fine = tuple(round(ratio*k) for k in cells)
    ends = np.linspace(0, BEAM.length, 4)
    half, width = BEAM.depth/2, 0.5*BEAM.depth
    blocks = [box(kind, fine if i == 1 else cells, (ends[i], -half, 0), (ends[i + 1], half, width)) for i in range(3)]
    return blocks, width


def tip_loads(block, first):
    """Forces on the nodes of the end of the last piece by the parabola of shear stress."""
    corners = {"C3D8": [1, 2, 6, 5], "C3D20": [1, 2, 6, 5, 9, 18, 13, 17]}[block.kind]
    node, exponent = shape_of(block.kind)
    back, force = np.linalg.inv(power(node, exponent)), np.zeros(len(block.x))
    at, weight = np.polynomial.legendre.leggauss(4)
    on = set(block.on(0, 1).tolist())
    for nodes in block.element:
        if not all(nodes[c] in on for c in corners):
            continue
        x = block.x[np.array(nodes) - 1]
        area = np.ptp(x[:, 1])*np.ptp(x[:, 2])/4
        for (r, wr), (s, ws) in itertools.product(zip(at, weight, strict=True), repeat=2):
            shape = power(np.array([1.0, r, s]), exponent) @ back
            y = shape @ x[:, 1]
            force[np.array(nodes) - 1] += shape*wr*ws*area*BEAM.stress(BEAM.length, y)[2]
    return "*CLOAD\n" + "".join(f"{first + k + 1}, 2, {float(f)!r}\n" for k, f in enumerate(force) if f != 0)


def start_beam(runs):
    started = {}
    for kind, ratio in BEAMS:
        for n in BEAM_LEVELS[kind]:
            blocks, width = beam(kind, ratio, n)
            law = f"*ELASTIC\n{BEAM.young!r}, {BEAM.poisson!r}\n"
            # The finer piece is the slave of both.
            text, x = made([blocks[1], blocks[0], blocks[2]], [(0, 1, 0), (2, 0, 0)], (False, True))
            text = text.replace(ELASTIC, law)
            wall = np.flatnonzero(x[:, 0] < 1e-9)
            side = np.flatnonzero((x[:, 2] < 1e-9) | (x[:, 2] > width - 1e-9))
            text += "*STEP\n*STATIC, DIRECT\n1., 1.\n" + prescribed(wall, Cantilever().displacement(x[wall]))
            text += "".join(f"{k + 1}, 3, 3\n" for k in np.setdiff1d(side, wall))
            text += tip_loads(blocks[2], len(blocks[1].x) + len(blocks[0].x))
            tip = np.flatnonzero((np.abs(x - [BEAM.length, 0, 0]) < 1e-9).all(1))
            run = runs.start(Deck(text + "*NODE FILE\nU\n*END STEP\n"))
            started[kind, ratio, n] = [blocks[1], blocks[0], blocks[2]], tip, run
    return started


def report_beam(started, _):
    rows, exact = [], Cantilever().displacement(np.array([[BEAM.length, 0.0, 0.0]]))[0, 1]
    for kind, ratio in BEAMS:
        norms, levels = [], BEAM_LEVELS[kind]
        for n in levels:
            blocks, tip, run = started[kind, ratio, n]
            fields = run.result().fields()
            norms.append(relative(blocks, fields, Cantilever()))
            orders = [f"{slope_of(levels[:len(norms)], np.array(norms)[:, k]):.2f}" if len(norms) > 1 else "" for k in range(2)]
            off = f"{100*(fields['displacement'][-1][tip[0], 1]/exact - 1):+.2f} %"
            rows.append((f"`{kind}`", f"1 : {ratio:g}", n, off, size(norms[-1][0]), orders[0], size(norms[-1][1]), orders[1]))
    return table(["elements", "ratio", "over the depth", "tip", "displacement", "order", "energy", "order"], rows)


# ---- spheres -------------------------------------------------------------------------------------

SPHERES = [("C3D8", (1.0, 1.5)), ("C3D8", (1.5, 1.0)), ("C3D20", (1.0, 1.5)), ("C3D20R", (1.0, 1.5)), ("C3D10", (1.0, 1.5))]
SPHERE_LEVELS = {"C3D8": (2, 4, 8), "C3D20": (2, 4), "C3D20R": (2, 4), "C3D10": (2, 4)}


def start_spheres(runs):
    started = {}
    for kind, cells in SPHERES:
        for n in SPHERE_LEVELS[kind]:
            text, x = shells([kind]*2, [round(n*c) for c in cells], n//2)
            started[kind, cells, n] = x, runs.start(Deck(text))
    return started


def report_spheres(started, _):
    rows = []
    for kind, cells in SPHERES:
        off, levels = [], SPHERE_LEVELS[kind]
        for n in levels:
            x, run = started[kind, cells, n]
            exact = Sphere().displacement(x)
            error = np.linalg.norm(run.result().fields()["displacement"][-1] - exact, axis=1)/np.linalg.norm(exact, axis=1).max()
            at_tie = np.abs(np.linalg.norm(x, axis=1) - 1.5) < 1e-9
            off.append((np.sqrt((error**2).mean()), error[at_tie].max()))
        off = np.array(off)
        rows.append((f"`{kind}`", f"{cells[0]:g} : {cells[1]:g}", levels[-1], size(off[-1, 0]), f"{slope_of(levels, off[:, 0]):.2f}",
                     size(off[-1, 1]), f"{slope_of(levels, off[:, 1]):.2f}"))
    return table(["elements", "inner : outer", "level", "displacement", "order", "at the tie, at most", "order"], rows)


CHAPTERS = [Chapter("ties_space_orders", start_smooth, report_smooth), Chapter("ties_space_cantilever", start_beam, report_beam),
            Chapter("ties_space_spheres", start_spheres, report_spheres)]
