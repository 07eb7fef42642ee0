"""Plain scenes of contact, small ones that an engineer would draw first, as generated decks.

`SCENES[name]()` is a `Scene`, `Scene.deck(sides)` its deck. All decks have the parameters of
`PARAMETERS` (`run_deck(deck, folder, formulation="SEGMENT", h=0.01)`), write the displacements of
every increment, and have one surface around each body, which bears the body's name.
"""

import functools
import itertools
import math
import sys

import numpy as np
import overlap
from scene_tools import DECKS, Deck, Run, emcon, number, overrides

sys.path.insert(0, str(DECKS))

from balls import add_ball  # noqa: E402
from deckwriter import Part, add_grid, box  # noqa: E402
from scenery import CONTACT_CARDS, add_disc, contact_parameters  # noqa: E402
from space_mesh import Block  # noqa: E402

PARAMETERS = f"""
initiation = PERSISTENT
method = NULL SPACE
tolerance = 1e-10
{contact_parameters().strip()}
"""

#: How the bodies of a scene are put in contact: pairs, whose slave comes first; the same without
#: guards; with nodes of both sides constrained; as the program chooses; everything with everything.
ONE, UNGUARDED, BOTH, AUTO, ALL = ("ONE", "UNGUARDED", "BOTH", "AUTO", "ALL")

REQUESTS = f"""
*CONSTRAINT METHOD, TYPE=<method>
*CONTACT INITIATION, TYPE=<initiation>
*NEWTON, TOLERANCE=<tolerance>
{CONTACT_CARDS.strip()}
*NODE FILE
U
*CONTACT FILE
CDIS, CSTR, CF
*CONTACT PRINT, TOTALS=ONLY
CF
*END STEP
"""


def turned(angle, about=(0.0, 0.0)):
    """The rotation about a point, for places."""
    c, s = math.cos(angle), math.sin(angle)

    def place(x, y):
        dx, dy = x - about[0], y - about[1]
        return about[0] + c*dx - s*dy, about[1] + s*dx + c*dy

    return place


def element_lines(part, kind):
    """The elements of a part, all of one kind, in lines of twelve words."""
    lines = [f"*ELEMENT, TYPE={kind}, ELSET={part.name}"]
    for label, nodes in part.element.items():
        words = [str(word) for word in (label, *nodes)]
        lines += [", ".join(words[k:k + 12]) + ("," if k + 12 < len(words) else "")
                  for k in range(0, len(words), 12)]
    return lines


class Scene:
    """Bodies, what holds and moves them, and which of them may meet; of as many dimensions as the
    places of their nodes have."""

    def __init__(self, h, t_end, gravity=0.0):
        self.h, self.t_end, self.gravity = h, t_end, gravity
        self.part, self.cards, self.held, self.alone = {}, [], [], set()
        self.pairs = []                # (slave, master); empty: each with all that come after it
        self.n_node = self.n_element = 0
        self.n_dim = 2

    # ---- bodies

    def add(self, name, mesh, stiffness=100.0, density=1.0, velocity=(0, 0, 0), spin=(0, 0, 0),
            kind=None):
        """A body; `mesh(part, first)` fills a part with labels from `first` on. `spin` is a number in
        the plane; `kind` that of the elements, where their number of nodes does not say it."""
        part = Part(name)
        mesh(part, (self.n_node + 1, self.n_element + 1))
        self.n_node += len(part.node)
        self.n_element += len(part.element)
        self.part[name] = part
        places = np.array(list(part.node.values()))
        self.n_dim = places.shape[1]
        is_plane = self.n_dim == 2
        self.cards += [*(element_lines(part, kind) if kind else part.element_lines()), f"*SURFACE, NAME={name}", f"{name},",
                       f"*MATERIAL, NAME={name}", "*HYPERELASTIC, COUPLED NEO HOOKE",
                       f"{number(stiffness)}, 0.3", "*DENSITY", number(density),
                       f"*SOLID SECTION, ELSET={name}, MATERIAL={name}", *(["1."] if is_plane else [])]
        arm = np.zeros((len(places), 3))
        arm[:, :self.n_dim] = places - np.mean(places, axis=0)
        speed = np.cross((0, 0, spin) if np.isscalar(spin) else spin, arm)
        lines = []
        for label, turning in zip(part.node, speed, strict=True):
            v = [a + b for a, b in zip(velocity[:self.n_dim], turning[:self.n_dim], strict=True)]
            lines += [f"{label}, {axis}, {number(a)}" for axis, a in enumerate(v, 1) if a]
        if lines:
            self.cards += ["*INITIAL CONDITIONS, TYPE=VELOCITY", *lines]
        return self

    def block(self, name, corner, size, cells, turn=0.0, shape=None, **more):
        """A rectangle, turned about its middle, or with its places (x, y) mapped by `shape`; or a box, with
        its places (n, 3) mapped by `shape`."""
        if len(size) == 3:
            return self.box(name, corner, size, cells, shape, **more)
        place = box(corner, size, cells)
        move = shape or turned(turn, (corner[0] + size[0]/2, corner[1] + size[1]/2))
        if turn == 0.0 and shape is None:
            return self.add(name, lambda part, first: add_grid(part, cells, place, first), **more)
        return self.add(name, lambda part, first: add_grid(
            part, cells, lambda i, j: move(*place(i, j)), first), **more)

    def box(self, name, corner, size, cells, shape=None, kind="C3D8", **more):
        mesh = Block(kind, cells, size, place=lambda x: x + np.array(corner, float))
        x = mesh.x if shape is None else shape(mesh.x)

        def fill(part, first):
            for label, place in zip(range(first[0], first[0] + len(x)), x.tolist(), strict=True):
                part.node[label] = tuple(place)
            for label, nodes in enumerate(mesh.element, first[1]):
                part.element[label] = tuple(first[0] - 1 + n for n in nodes)

        return self.add(name, fill, kind=kind, **more)

    def ball(self, name, centre, radius, cells, **more):
        """n^3 bricks in the cube inside, m layers of them around it."""
        return self.add(name, lambda part, first: add_ball(part, radius, centre, cells, first),
                        **more)

    def disc(self, name, centre, radius, cells, turn=0.0, **more):
        return self.add(name, lambda part, first: add_disc(part, centre, radius, cells, first,
                                                           turn), **more)

    def ring(self, name, place, cells, **more):
        """A closed grid; `place(angle, share)` goes counter-clockwise, and inwards with share."""
        n, m = cells
        return self.add(name, lambda part, first: add_grid(
            part, cells, lambda i, j: place(2*math.pi*i/n, j/m), first, closed=True), **more)

    # ---- supports

    def hold(self, name, where, axes=None, value=0.0):
        """Hold the nodes of a body where `where(x, y)`, or move them by `value` within t_end."""
        axes = axes or f"1, {self.n_dim}"
        nodes = [label for label, p in self.part[name].node.items() if where(*p)]
        assert nodes, name
        self.held.append((nodes, axes, value))
        return self

    def side(self, name, body, where):
        """A surface of the edges of a body both of whose ends are `where(x, y)`."""
        part = self.part[body]
        edges = overlap.Bodies(part.element.values()).edge
        edges = [e for e in edges if all(where(*part.node[n]) for n in e)]
        self.cards += [f"*SURFACE, NAME={name}, TYPE=EDGE", *(f"{i}, {j}" for i, j in edges)]
        return self

    # ---- text

    def contact(self, sides):
        names = list(self.part)
        pairs = self.pairs or [(a, b) for k, a in enumerate(names) for b in names[k + 1:]]
        card = "*CONTACT PAIR, INTERACTION=SMOOTH, TYPE=<formulation>"
        card += {ONE: ", SIDES=ONE", UNGUARDED: ", SIDES=ONE, GUARD=NO",
                 BOTH: ", SIDES=BOTH"}.get(sides, "")
        lines = [f"{card}\n{slave}, {master}" for slave, master in pairs]
        if sides == ALL:
            lines = ["*CONTACT", "*CONTACT INCLUSIONS, ALL EXTERIOR"]
        return ["*SURFACE INTERACTION, NAME=SMOOTH", *lines]

    def deck(self, sides=ONE, name="scene"):
        nodes = [line for part in self.part.values() for line in part.node_lines()]
        still = [(n, axes) for n, axes, value in self.held if not value]
        moved = [(n, axes, value) for n, axes, value in self.held if value]
        boundary = [f"{label}, {axes}" for labels, axes in still for label in labels]
        motion = [f"{label}, {axes}, {number(value)}" for labels, axes, value in moved
                  for label in labels]
        down = ", ".join(["0."]*(self.n_dim - 1) + ["-1."])
        weight = [f"{name}, GRAV, {number(self.gravity)}, {down}" for name in self.part]
        # What is of the plane alone: integrated gaps, and how surfaces are smoothed.
        requests, formulation = REQUESTS.strip(), "MORTAR"
        if self.n_dim == 3:
            requests = requests.replace(CONTACT_CARDS.strip() + "\n", "")
            formulation = "NODE TO SURFACE"
        return Deck("\n".join([
            "*HEADING", "plain scene", "*PARAMETER", f"h = {number(self.h)}",
            f"t_end = {number(self.t_end)}", f"formulation = {formulation}", *[
                line for line in PARAMETERS.strip().splitlines()
                if not line.startswith("formulation")],
            *nodes, *self.cards, *self.contact(sides),
            *(["*BOUNDARY", *boundary] if boundary else []),
            "*AMPLITUDE, NAME=RAMP", f"0., 0., {number(self.t_end)}, 1.",
            "*STEP, NLGEOM, INC=1000000", "*DYNAMIC, DIRECT", "<h>, <t_end>",
            *(["*BOUNDARY, AMPLITUDE=RAMP", *motion] if motion else []),
            *(["*DLOAD", *weight] if self.gravity else []), requests,
        ]), name)


# ---- several bodies -----------------------------------------------------------------------------


def below(y):
    """Places up to a height, the last coordinate: what stands on the ground there."""
    return lambda *place: place[-1] <= y + 1e-9


def pile():
    """Ten discs, four, three, two and one, fall on a floor and on each other."""
    scene = Scene(0.02, 0.5, gravity=10.0)
    d, row = 1.02, math.sqrt(3)/2*1.02
    for k in range(4):
        for i in range(4 - k):
            scene.disc(f"D{k}{i}", (d*(i + k/2), 0.51 + row*k), 0.5, (3, 1), turn=0.3*(i + 2*k),
                       stiffness=300.0)
    scene.block("FLOOR", (-1.0, -0.5), (5.0, 0.5), (9, 1)).hold("FLOOR", below(-0.5))
    return scene


def wedge():
    """A stiff wedge is shot into the slit between two blocks."""
    scene = Scene(0.01, 0.4)
    scene.block("WEDGE", (-0.25, 0.0), (0.5, 1.0), (2, 3), stiffness=300.0, velocity=(0, -3),
                shape=lambda x, y: (x*(0.2 + 0.8*y), 0.81 + y))
    for name, x in (("LEFT", -1.05), ("RIGHT", 0.05)):
        scene.block(name, (x, 0.0), (1.0, 0.8), (3, 2)).hold(name, below(0.0))
    scene.pairs = [("WEDGE", "LEFT"), ("WEDGE", "RIGHT")]
    return scene


def ledge():
    """A coarse block falls with its middle on the corner of a fixed one, and tips over it."""
    scene = Scene(0.02, 0.8, gravity=5.0)
    scene.block("UPPER", (-0.7, 0.02), (1.5, 0.5), (2, 1))
    scene.block("LEDGE", (-1.0, -0.6), (1.0, 0.6), (4, 2)).hold("LEDGE", below(-0.6))
    return scene


def gear(phase, teeth=8, tooth=0.16):
    """Places of a gear of radius 1 with blunt teeth, for `Scene.ring`."""

    def place(angle, share):
        wave = math.cos(teeth*(angle - phase))
        r = (1.0 + tooth*max(-0.6, min(0.6, wave))/0.6)*(1 - share) + 0.45*share
        return r*math.cos(angle), r*math.sin(angle)

    return place


def gears():
    """Two gears of eight teeth; one turns, the other, which is free too, is taken along."""
    scene = Scene(0.01, 0.5)
    scene.ring("DRIVE", gear(0.0), (48, 2), stiffness=400.0, spin=2.0)
    other = gear(math.pi/8)
    scene.ring("DRIVEN", lambda a, s: (2.06 + other(a, s)[0], other(a, s)[1]), (48, 2),
               stiffness=400.0)
    return scene


def accordion():
    """A meandering strip, pressed together till its folds meet; its ends are held and moved."""
    scene = Scene(0.02, 1.0)
    n, waves, length, thick = 32, 2, 2.4, 0.08
    # A curve whose direction swings by 110 degrees to either side of upwards.
    s = (np.arange(n + 1) + 0.5)/n
    step = 0.5*np.pi + 1.9*np.sin(2*np.pi*waves*s)
    line = waves*length/n*np.cumsum(np.exp(1j*np.append(0.5*np.pi, step[:-1])))
    across = 1j*np.exp(1j*np.append(0.5*np.pi + 1.9*np.sin(2*np.pi*waves*s[:-1] - np.pi*waves/n),
                                    0.5*np.pi))

    def fold(i, j):
        z = line[i] + thick*(0.5 - (1 - j))*across[i]
        return z.real, z.imag

    scene.add("FOLD", lambda part, first: add_grid(part, (n, 1), fold, first))
    bottom, top = ({fold(i, j) for j in (0, 1)} for i in (0, n))
    scene.hold("FOLD", lambda x, y: (x, y) in bottom)
    scene.hold("FOLD", lambda x, y: (x, y) in top, "1, 1")
    scene.hold("FOLD", lambda x, y: (x, y) in top, "2, 2", -0.45*abs(line[-1] - line[0]))
    scene.side("FREE", "FOLD", lambda x, y: (x, y) not in bottom | top)
    scene.pairs = [("FREE", "FREE")]
    return scene


def coil():
    """A strip wound twice, which flies apart against its outer winding: in contact with itself."""
    scene = Scene(0.02, 0.8)
    n, turns, thick, pitch = 36, 2.25, 0.12, 0.16

    def wound(i, j):
        angle = 2*math.pi*turns*i/n
        r = 0.5 + pitch*angle/(2*math.pi) + thick*(1 - j)
        return r*math.cos(angle), r*math.sin(angle)

    scene.add("COIL", lambda part, first: add_grid(part, (n, 1), wound, first), spin=-3.0)
    scene.pairs = [("COIL", "COIL")]
    return scene


def comb():
    """Two combs, teeth between teeth, pushed sideways and into each other."""
    scene = Scene(0.02, 0.8)
    for name, side, x, v in (("UPPER", -1, 0.22, (0.3, -1.0)), ("LOWER", 1, 0.0, (0, 0))):
        def mesh(part, first, side=side, x=x):
            """A bar of nine columns, the odd ones with a tooth."""
            label = {}

            def node(i, j):
                return label.setdefault((i, j), first[0] + len(label))

            cells = [(i, 0) for i in range(9)]
            cells += [(i, j) for i in range(0, 9, 2) for j in (1, 2)]
            for k, (i, j) in enumerate(cells):
                nodes = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)]
                part.element[first[1] + k] = tuple(nodes if side > 0 else nodes[::-1])
            for (i, j), n in label.items():
                # Teeth are narrower than the gaps between them.
                wide = 0.22*i + (0.03 if i % 2 else 0.0)*(-1 if j else 1)*bool(j)
                part.node[n] = (x + wide, side*(0.25*j) + (0.0 if side > 0 else 1.3))

        scene.add(name, mesh, velocity=v)
    scene.hold("LOWER", below(0.0))
    return scene


def bowl():
    """A disc dropped into a bowl of little more than its radius."""
    scene = Scene(0.02, 0.8, gravity=5.0)
    scene.disc("DISC", (0.1, 0.0), 0.5, (4, 2), velocity=(0, -0.5))

    def round_place(i, j):
        angle = math.pi*(1.05 + 0.9*i/10)
        r = 0.62 + 0.3*j/2
        return r*math.cos(angle), r*math.sin(angle)

    scene.add("BOWL", lambda part, first: add_grid(
        part, (10, 2), lambda i, j: round_place(i, 2 - j), first))
    return scene.hold("BOWL", lambda x, y: math.hypot(x, y) > 0.91)


def tower():
    """Three blocks of different meshes fall on a floor and on each other."""
    scene = Scene(0.02, 0.8, gravity=10.0)
    for k, cells in enumerate([(4, 2), (3, 2), (5, 2)]):
        scene.block(f"B{k}", (0.05*k, 0.51*k + 0.01), (1.0, 0.5), cells)
    scene.block("FLOOR", (-1.0, -0.5), (3.0, 0.5), (6, 1)).hold("FLOOR", below(-0.5))
    scene.pairs = [("B0", "FLOOR"), ("B1", "B0"), ("B2", "B1")]
    return scene


def press():
    """A block between a fixed plate and one that is moved down by a third of its height."""
    scene = Scene(0.02, 1.0)
    scene.block("BLOCK", (0.0, 0.0), (1.0, 0.6), (5, 3))
    scene.block("UPPER", (-0.5, 0.6), (2.0, 0.2), (6, 1), stiffness=1000.0)
    scene.block("LOWER", (-0.5, -0.2), (2.0, 0.2), (6, 1), stiffness=1000.0)
    scene.pairs = [("BLOCK", "UPPER"), ("BLOCK", "LOWER")]
    scene.hold("LOWER", below(-0.2))
    scene.hold("UPPER", lambda _, y: y > 0.79, "1, 1")
    return scene.hold("UPPER", lambda _, y: y > 0.79, "2, 2", -0.2)


# ---- through and past each other ----------------------------------------------------------------


def bullet(h=0.02):
    """A small block shot at a thin plate, further in a step than the plate is thick."""
    scene = Scene(h, 0.2)
    scene.block("BULLET", (-0.1, 0.07), (0.2, 0.3), (2, 3), velocity=(0, -5), stiffness=400.0)
    scene.block("PLATE", (-1.0, -0.05), (2.0, 0.05), (20, 1), stiffness=400.0)
    return scene.hold("PLATE", lambda x, _: abs(x) > 0.999)


def crossing(delay=0.0, h=0.05, n=2):
    """Two squares whose ways cross at right angles; the second comes later by `delay`."""
    scene = Scene(h, 1.0)
    scene.block("EAST", (-0.7, -0.2), (0.4, 0.4), (n, n), velocity=(1, 0))
    scene.block("NORTH", (-0.2, -0.7 - delay), (0.4, 0.4), (n, n), velocity=(0, 1))
    return scene


#: Delays and steps of the variants of `crossing`.
DELAYS = (0.0, 0.01, 0.03, 0.1, 0.2)
STEPS = (0.04, 0.05, 0.06, 0.08, 0.1)


def crossings(n):
    """The variants with n x n elements each, by a name."""
    return {f"delay {delay}, h {h}": crossing(delay, h, n)
            for delay, h in itertools.product(DELAYS, STEPS)}


def strips(h=0.1):
    """Two thin strips cross, each by twice its thickness in a step."""
    scene = Scene(h, 0.8)
    scene.block("EAST", (-0.45, -0.2), (0.05, 0.4), (1, 4), velocity=(1, 0))
    scene.block("NORTH", (-0.2, -0.47), (0.4, 0.05), (4, 1), velocity=(0, 1))
    return scene


def corners(shift=0.0, cells=(2, 2)):
    """Tip on tip: two squares that stand on their corners."""
    scene = Scene(0.02, 0.6)
    scene.block("UPPER", (-0.5 + shift, 0.35), (1, 1), cells, math.pi/4, velocity=(0, -1))
    scene.block("LOWER", (-0.5, -1.12), (1, 1), cells, math.pi/4)
    return scene


def slide_off():
    """A block pressed on a fixed one by its weight slides over the end and tips."""
    scene = Scene(0.02, 1.0, gravity=5.0)
    scene.block("SLIDER", (0.0, 0.0), (0.8, 0.4), (3, 2), velocity=(1.5, 0))
    scene.block("TABLE", (-0.2, -0.5), (1.2, 0.5), (5, 2)).hold("TABLE", below(-0.5))
    return scene


# ---- symmetric ones, nodes on nodes -------------------------------------------------------------


def drop(shift=0.0, cells=(4, 2), floor=(8, 3)):
    """A disc falls straight on a block, its lowest node over one of the block's nodes."""
    scene = Scene(0.02, 0.6)
    scene.disc("DISC", (shift, 0.52), 0.5, cells, velocity=(0, -1))
    return scene.block("BLOCK", (-1.0, -0.75), (2.0, 0.75), floor).hold("BLOCK", below(-0.75))


def slave_floor(floor=(8, 2)):
    """The disc that falls on a floor that is coarser, and the slave; it should not go sideways."""
    scene = Scene(0.02, 0.8)
    scene.disc("DISC", (0.043, 0.52), 0.5, (8, 3), turn=0.1, velocity=(0, -1))
    scene.block("FLOOR", (-1.0, -0.5), (2.0, 0.5), floor).hold("FLOOR", below(-0.5))
    scene.side("TOP", "FLOOR", lambda _, y: y > -1e-9)
    scene.pairs = [("TOP", "DISC")]
    return scene


def disc_on_floor(ratio, place, slave="TOP"):
    """A disc falls straight on a stiff floor whose edges are `ratio` times as long as its own,
    `place` edges beside a node; nothing about it is symmetric. Slave: TOP of the floor or DISC."""
    n = 8
    edge = ratio*math.pi/(4*n)
    cells = 2*math.ceil(0.4/edge)
    scene = Scene(0.01, 0.5)
    scene.disc("DISC", (0.0, 0.502), 0.5, (n, 2), turn=0.1, velocity=(0, -0.1))
    scene.block("FLOOR", ((place - cells/2)*edge, -0.25), (cells*edge, 0.25), (cells, 2),
                stiffness=1e4)
    scene.hold("FLOOR", below(-0.25)).side("TOP", "FLOOR", lambda _, y: y > -1e-9)
    scene.pairs = [("TOP", "DISC") if slave == "TOP" else ("DISC", "TOP")]
    return scene


def twin():
    """A square falls on its twin: all nodes of the sides on each other."""
    scene = Scene(0.02, 0.6)
    scene.block("UPPER", (0, 1.01), (1, 1), (4, 4), velocity=(0, -1))
    return scene.block("LOWER", (0, 0), (1, 1), (4, 4))


def punch():
    """A narrow punch with its corners over nodes of a fixed block."""
    scene = Scene(0.02, 0.6)
    scene.block("PUNCH", (-0.5, 0.01), (1.0, 0.5), (4, 2), velocity=(0, -1), stiffness=1000.0)
    scene.block("BLOCK", (-1.0, -1.0), (2.0, 1.0), (8, 4)).hold("BLOCK", below(-1.0))
    return scene


def edge_along_edge():
    """A block slides along another, edge exactly on edge, while both are pressed together."""
    scene = Scene(0.02, 0.8)
    scene.block("UPPER", (-0.5, 0.0), (1.0, 0.5), (4, 2), velocity=(1.0, -0.2))
    scene.block("LOWER", (-1.0, -0.5), (2.0, 0.5), (8, 2)).hold("LOWER", below(-0.5))
    return scene


SCENES = {
    "pile": pile, "wedge": wedge, "ledge": ledge, "gears": gears, "accordion": accordion,
    "coil": coil, "comb": comb, "bowl": bowl, "tower": tower, "press": press, "bullet": bullet,
    "crossing": crossing, "strips": strips, "corners": corners, "slide off": slide_off,
    "drop": drop, "slave floor": slave_floor, "twin": twin, "punch": punch,
    "edge along edge": edge_along_edge,
}


def slanted(run):
    """Sideways momentum of the first body after the contact, by that upwards it was given."""
    _, momentum = run.series("BODIES", "MOMENTUM")
    first = momentum[:, 0, :]
    return abs(first[-1, 0])/(first[-1, 1] - first[0, 1])


# ---- runs ---------------------------------------------------------------------------------------


class Outcome:
    """A run of a scene, however it ended, and what an eye from outside makes of it."""

    #: Seconds that it may take.
    patience = 120

    def __init__(self, scene, folder, sides=ONE, **parameters):
        folder.mkdir(parents=True, exist_ok=True)
        deck = scene.deck(sides).write(folder / "scene.inp")
        done = emcon(deck, "--quiet", "--output", folder, *overrides(parameters),
                     timeout=self.patience)
        assert done.returncode in (0, 3), done.stderr
        self.code = done.returncode
        self.run = Run(folder / "scene", done.stderr)

    @functools.cached_property
    def fields(self):
        return self.run.fields()

    @property
    def has_ended(self):
        """Did it get to its end? Also of a run that overlaps, whose exit code is 3."""
        return self.run.verdict["verdict"] != "not completed"

    @property
    def energy_error(self):
        """The largest change of the total energy, by the largest energy that there is."""
        history = self.run.history
        change = history["total"] - history["contact_work"]
        return np.abs(change - change[0]).max()/(history["kinetic"] + history["strain"]).max()

    @functools.cached_property
    def overlap(self):
        """The deepest overlap at the end of an increment."""
        return max(overlap.frames(self.fields))

    @functools.cached_property
    def way(self):
        """The deepest overlap, on the straight ways between increments too.

        Bodies that turn do not go straight: it may be above 0 by what an arc is above its chord.
        """
        return overlap.worst(self.fields)

    @property
    def cpu(self):
        """CPU time per increment [s], without reading the deck."""
        time = self.run.history["cpu"]
        return (time[-1] - time[0])/max(1, len(time) - 1)
