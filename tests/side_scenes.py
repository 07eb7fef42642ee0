"""Scenes of bodies with nodes between the corners of their elements, made by mapped grids."""

import numpy as np
from element_meshes import Mesh
from scene_tools import Deck

YOUNG, POISSON = 1000.0, 0.3


def grid(kind, cells, place, shift=0.0):
    """A mesh of the image of the unit square; with `shift` nodes along its width move by up to so
    much of it, so that those between corners do not stand in the middle."""
    mesh = Mesh(kind, *cells, [(0, 0), (1, 0), (1, 1), (0, 1)])
    s, t = mesh.x.T
    mesh.x = np.array([place(a + 4*shift*a*(1 - a), b) for a, b in zip(s, t, strict=True)])
    return mesh


def block(x0, y0, x1, y1, angle=0.0, bulge=0.0):
    """A map to a rectangle, turned about its first corner, whose sides may bulge."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

    def place(s, t):
        way = [s*(x1 - x0), t*(y1 - y0) + bulge*np.sin(3*s + 1)*np.cos(2*t)]
        return [x0, y0] + turn @ way

    return place


def sector(inner, outer):
    """A map to a quarter of a ring, outwards with t; counter-clockwise in all."""

    def place(s, t):
        r, angle = inner + t*(outer - inner), np.pi/2*(1 - s)
        return r*np.array([np.cos(angle), np.sin(angle)])

    return place


def faces(mesh, which):
    """Elements with a face on a side of the mesh, and the number of the face."""
    side = set(mesh.side(which))
    n = 3 if mesh.kind[3] in "36" else 4
    return [(e, f + 1) for e, node in enumerate(mesh.elements(), 1) for f in range(n)
            if {node[f], node[(f + 1) % n]} <= side]


def bodies(**meshes):
    """Nodes, elements, sections, sets and surfaces of the sides of bodies."""
    text, n, m = "*MATERIAL, NAME=M\n*ELASTIC\n" + f"{YOUNG}, {POISSON}\n*DENSITY\n1\n", 0, 0
    for name, mesh in meshes.items():
        rows = list(mesh.elements())
        text += f"*NODE, NSET={name}\n" + "".join(
            f"{k + n}, {x!r}, {y!r}\n" for k, (x, y) in enumerate(mesh.x.tolist(), 1))
        text += f"*ELEMENT, TYPE={mesh.kind}, ELSET={name}\n" + "".join(
            f"{k + m}, {', '.join(str(i + n) for i in row)}\n" for k, row in enumerate(rows, 1))
        text += f"*SOLID SECTION, ELSET={name}, MATERIAL=M\n*SURFACE, NAME={name}\n{name}\n"
        for side in ("left", "right", "bottom", "top"):
            text += f"*NSET, NSET={name}_{side}\n" + "".join(
                f"{k + n},\n" for k in mesh.side(side))
            text += f"*SURFACE, NAME={name}_{side}\n" + "".join(
                f"{e + m}, S{f}\n" for e, f in faces(mesh, side))
        n, m = n + len(mesh.x), m + len(rows)
    return text


def pair(slave, master, options, friction=0.0):
    """Contact of two surfaces; a tie if there are no `options`."""
    if not options:
        return f"*TIE, NAME=T\n{slave}, {master}\n"
    law = f"*FRICTION\n{friction}\n" if friction else ""
    return (f"*SURFACE INTERACTION, NAME=I\n{law}"
            f"*CONTACT PAIR, INTERACTION=I, {options}\n{slave}, {master}\n")


def patch(kinds, options, swap=False, step="", cells=(4, 3)):
    """Two blocks, the lower one with nodes off the middle of its sides, under a pressure of 10."""
    low = grid(kinds[0], (cells[0], 2), block(0, -1, 4, 0), shift=0.05)
    high = grid(kinds[1], (cells[1], 2), block(0, 0, 4, 1.5))
    surfaces = ["HIGH_bottom", "LOW_top"]
    return Deck(bodies(LOW=low, HIGH=high) + pair(*surfaces[::-1 if swap else 1], options) + f"""
*STEP{step}
*STATIC
1, 1
*BOUNDARY
LOW_bottom, 2
LOW_left, 1
HIGH_left, 1
*DSLOAD
HIGH_top, P, 10
*NODE FILE
U
*EL FILE
S
*CONTACT FILE
CSTR
*END STEP
""")


def load(mesh, side, first, pressure):
    """Nodal forces of a pressure(x) on a straight side along x, by the shape functions of its
    elements; labels count from `first`."""
    label = np.array(mesh.side(side))
    label = label[np.argsort(mesh.x[label - 1, 0])]
    place, weight = np.polynomial.legendre.leggauss(6)
    shape = np.array([(1 - place)/2, (1 + place)/2])
    if mesh.step == 2:
        shape = np.array([place*(place - 1)/2, 1 - place**2, place*(place + 1)/2])
    force = dict.fromkeys(label.tolist(), 0.0)
    for k in range(0, len(label) - 1, mesh.step):
        own = label[k:k + mesh.step + 1]
        x = mesh.x[own - 1, 0]
        half = (x[-1] - x[0])/2
        values = weight*pressure(x[0] + half*(1 + place))*half
        for node, part in zip(own.tolist(), shape, strict=True):
            force[node] += part @ values
    return "".join(f"{k + first}, 2, {float(f)!r}\n" for k, f in force.items())


def pressed(kind, n, options=None):
    """Two equal plates pressed onto each other from both sides by a pressure that varies along
    them, n and 1.5 n elements long; without `options` the upper one on rollers, which is the same.
    """

    def pressure(x):
        return 10 + 5*np.cos(np.pi*x/4)

    upper = grid(kind, (n, n//2), block(0, 0, 4, 2))
    lower = grid(kind, (3*n//2, 3*n//4), block(0, -2, 4, 0))
    forces = load(upper, "top", 0, lambda x: -pressure(x))
    if options is None:
        model, held = bodies(UPPER=upper), "UPPER_bottom, 2\nUPPER_left, 1\n"
    else:
        model = bodies(UPPER=upper, LOWER=lower) + pair("UPPER_bottom", "LOWER_top", options)
        corner = len(upper.x) + lower.label[0, 0]
        held = f"UPPER_left, 1\nLOWER_left, 1\n{corner}, 2\n"
        forces += load(lower, "bottom", len(upper.x), pressure)
    return Deck(f"""{model}*STEP
*STATIC
1, 1
*BOUNDARY
{held}*CLOAD
{forces}*NODE FILE
U
*EL FILE
S
*END STEP
""")


def pressed_errors(fields, finer):
    """Errors along the interface at the nodes of the upper plate that `finer` has too, in the mean
    square: of the displacement along it and of the pressure, of the largest."""

    def along(fields):
        """The nodes at the height 0, the first of each place."""
        _, first = np.unique(np.round(fields.x, 6), axis=0, return_index=True)
        return {round(fields.x[k, 0], 6): k for k in first if abs(fields.x[k, 1]) < 1e-6}

    own, other = along(fields), along(finer)
    common = sorted(own.keys() & other.keys())
    assert len(common) > 4
    errors = []
    for name, component in (("displacement", 0), ("cauchy_stress", 1)):
        right = finer[name][-1][[other[x] for x in common], component]
        off = fields[name][-1][[own[x] for x in common], component] - right
        errors.append(np.sqrt((off**2).mean())/np.abs(right).max())
    return np.array(errors)


RADII, PRESSURE = (1.0, 2.0, 3.0), 10.0


def tied_ring(kind, n, swap=False):
    """A quarter of a ring of two tied ones, n and 1.5 n elements around, under a pressure inside."""
    inner = grid(kind, (n, n//2), sector(*RADII[:2]))
    outer = grid(kind, (3*n//2, 3*n//4), sector(*RADII[1:]))
    surfaces = ["INNER_top", "OUTER_bottom"]
    return Deck(bodies(INNER=inner, OUTER=outer) + pair(*surfaces[::-1 if swap else 1], "") + f"""
*STEP
*STATIC
1, 1
*BOUNDARY
INNER_left, 1
INNER_right, 2
OUTER_left, 1
OUTER_right, 2
*DSLOAD
INNER_bottom, P, {PRESSURE}
*NODE FILE
U
*EL FILE
S
*END STEP
""")


def tied_ring_errors(fields):
    """Errors in the mean square against Lame: of the radial displacement, of that at the
    interface, and of the radial stress there, of its size."""
    a, b, c = RADII
    young, poisson = YOUNG/(1 - POISSON**2), POISSON/(1 - POISSON)
    share = PRESSURE*a**2/(c**2 - a**2)
    r = np.linalg.norm(fields.x, axis=1)
    normal = fields.x/r[:, None]
    u = (fields["displacement"][-1]*normal).sum(axis=1)

    def displacement(r):
        return share/young*((1 - poisson)*r + (1 + poisson)*c**2/r)

    xx, yy, _, xy = fields["cauchy_stress"][-1][:, :4].T
    stress = xx*normal[:, 0]**2 + yy*normal[:, 1]**2 + 2*xy*normal[:, 0]*normal[:, 1]
    there = np.abs(r - b) < 0.01
    right = share*(1 - c**2/b**2)
    return np.array([np.sqrt(((u - displacement(r))**2).mean())/displacement(b),
                     np.sqrt(((stress - share*(1 - c**2/r**2))[there]**2).mean())/abs(right)])


def tied_sectors(kind, swap=False):
    """The same rings with bore and rim displaced as by a strain of 1e-3 along x."""
    inner = grid(kind, (4, 2), sector(*RADII[:2]))
    outer = grid(kind, (6, 2), sector(*RADII[1:]))
    surfaces = ["INNER_top", "OUTER_bottom"]
    held, first = "", 0
    for mesh, side in ((inner, "bottom"), (outer, "top")):
        for node in mesh.side(side):
            held += f"{node + first}, 1, 1, {1e-3*float(mesh.x[node - 1, 0])!r}\n"
            held += f"{node + first}, 2\n"
        first += len(mesh.x)
    return Deck(bodies(INNER=inner, OUTER=outer) + pair(*surfaces[::-1 if swap else 1], "") + f"""
*BOUNDARY
INNER_left, 1
INNER_right, 2
OUTER_left, 1
OUTER_right, 2
*STEP
*STATIC
1, 1
*BOUNDARY
{held}*EL FILE
S
*END STEP
""")


def press_fit(kind, n, interference, options, smoothing=""):
    """A hub, radii 1 to 2 and the interference, in a sleeve to 3: quarters, n and 1.375 n elements
    around."""
    m = round(1.375*n)
    hub = grid(kind, (n, n//2), sector(1, 2 + interference))
    sleeve = grid(kind, (m, m//2), sector(2, 3))
    return Deck(bodies(HUB=hub, SLEEVE=sleeve) + pair("HUB_top", "SLEEVE_bottom", options) + f"""
*STEP
*STATIC
1, 1
*CONTACT INTERFERENCE, SHRINK
{smoothing}*BOUNDARY
HUB_left, 1
HUB_right, 2
SLEEVE_left, 1
SLEEVE_right, 2
*NODE FILE
U
*END STEP
""")


def collision(kinds, options, treatment, friction=0.0, bulge=0.1, duration=0.5):
    """A block that flies onto another one, both with curved sides."""
    low = grid(kinds[0], (4, 2), block(0, -1, 4, 0, bulge=bulge))
    high = grid(kinds[1], (3, 2), block(0.8, 0.35, 2.8, 1.35, angle=0.1, bulge=bulge))
    return Deck(bodies(LOW=low, HIGH=high) + pair("HIGH", "LOW", options, friction) + f"""
*INITIAL CONDITIONS, TYPE=VELOCITY
HIGH, 1, 2
HIGH, 2, -4
LOW, 2, 1
*STEP, NLGEOM, INC=1000
*DYNAMIC, DIRECT
0.005, {duration}
*CONTACT INITIATION, TYPE={treatment}
*END STEP
""")
