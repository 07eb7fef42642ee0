"""Scenes of two to five bodies in space, drawn by a seed, beside what is right.

    .venv/bin/python tests/soak/space_crowds.py [--seeds 1 200] [--folder build/soak-crowds] [--mortar] [--friction]

Elastic and rigid bodies of all kinds of elements fly into each other, some of them onto a wall, a ball or a plate that is
held; each fifth scene is one of statics: bodies on each other that contact alone holds, with planes of symmetry. Options
are those that nobody chose; with --mortar each pair of bodies has a contact of that kind, and walls one of nodes. Energy is
that of the history, momentum and weight are summed here from positions and densities, overlap is that of `overlap.py`. With
--friction all scenes are of dynamics, and Coulomb's law is looked for at each contact: friction takes energy there, is
within the cone and at its limit where it slides, and its work is that of the forces over the positions of the nodes. On
planes stick, slip and its direction are found from forces, positions and velocities of the nodes alone.
The exit code is 1 where a run is called good and one of these says otherwise.
"""

import pathlib
import random
import re
import sys

import h5py
import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1]), str(pathlib.Path(__file__).resolve().parents[1]/"scenes")]

from contact_space_scenes import RUBBER, ball, bodies, faces, straight  # noqa: E402
from space_mesh import Block  # noqa: E402
from space_scenes import BALANCE, UNSEEN, deepest_overlap, rotation, run_scenes  # noqa: E402
from wall_space_scenes import REFERENCE, plane, sphere, wall  # noqa: E402

KINDS = ["C3D4", "C3D8", "C3D10", "C3D20"]
GRAVITY = 2.0
#: Of edges, across which forces act at most by default, where no increment had to be taken as it is.
GAP_TOLERANCE = 0.5
#: Of the forces in statics, which Newton's method leaves.
STATIC_BALANCE = 1.0e-7
#: Of the largest force, by which Coulomb's law may be missed at a contact: what a solve leaves of its smallest ones.
LAW = 1.0e-8


def block(chance, is_ball, size):
    kind = chance.choice(KINDS)
    most = 2 if kind in ("C3D10", "C3D20") else 3
    if is_ball:
        return Block(kind, (chance.randint(1, most),)*3, size=(2.0, 2.0, 2.0))
    return Block(kind, tuple(chance.randint(1, most) for _ in range(3)), size=size)


def flying(chance, draw, is_plain):
    """A body about the origin."""
    is_ball = not is_plain and chance.random() < 0.4
    size = (1.0, 1.0, 1.0) if is_plain else tuple(chance.uniform(0.6, 1.6) for _ in range(3))
    own = block(chance, is_ball, size)
    x = ball(own.x)*chance.uniform(0.4, 0.8) if is_ball else own.x - 0.5*np.array(size)
    own.x = x if is_plain else x @ rotation(draw).T
    return straight(own)


def reference(i, own, lines=""):
    node = REFERENCE + i
    return (f"*NODE\n{node}, {', '.join(map(repr, own.x.mean(0).tolist()))}\n*RIGID BODY, ELSET=B{i}, REF NODE={node}\n"
            + lines)


def starts(all_blocks, rigid, v, w):
    """Velocities of all bodies."""
    text, first = "", 0
    for i, own in enumerate(all_blocks, 1):
        if i in rigid:
            rows = [(REFERENCE + i, np.concatenate([v[i - 1], w[i - 1]]))]
        else:
            rows = [(first + k, s) for k, s in enumerate(v[i - 1] + np.cross(w[i - 1], own.x - own.x.mean(0)), 1)]
        text += "".join(f"{node}, {a}, {float(s)!r}\n" for node, row in rows for a, s in enumerate(row, 1) if s)
        first += len(own.x)
    return "*INITIAL CONDITIONS, TYPE=VELOCITY\n" + text if text else ""


def contact(has_wall, all_blocks, mortar, mu):
    """Everything with everything, and all bodies with a wall."""
    text = "*SURFACE INTERACTION, NAME=I\n" + (f"*FRICTION\n{mu}\n" if mu > 0.0 else "")
    if mortar:
        n = len(all_blocks)
        text += "*CONTACT PAIR, INTERACTION=I, TYPE=MORTAR\n"
        text += "".join(f"S{i}, S{k}\n" for i in range(1, n + 1) for k in range(i + 1, n + 1))
        lines = "".join(f"S{i}, W\n" for i in range(1, n + 1)) if has_wall else ""
        return text + (f"*CONTACT PAIR, INTERACTION=I\n{lines}" if lines else "")
    if not (has_wall or mu > 0.0):
        return text + "*CONTACT\n*CONTACT INCLUSIONS, ALL EXTERIOR\n*CONTACT PROPERTY ASSIGNMENT\n, , I\n"
    first, lines = 0, ""
    for own in all_blocks:
        lines += "".join(f"{first + e}, S{f}\n" for e, f in own.outer_faces())
        first += len(own.element)
    return f"{text}*SURFACE, NAME=ALL\n{lines}*CONTACT PAIR, INTERACTION=I\nALL, ALL\n" + "ALL, W\n"*has_wall


def held_plate(own):
    foot = "".join(f"{k}\n" for k in own.on(2, 0))
    return f"*NSET, NSET=FOOT\n{foot}*BOUNDARY\nFOOT, 1, 3\n"


def dynamics(seed, mortar, friction):
    chance, draw = random.Random(f"crowd {seed}"), np.random.default_rng(seed)
    is_plain = seed % 3 == 0
    floor = chance.choice(["", "", "plane", "sphere", "plate"])
    n, gap = chance.randint(2, 5), chance.choice([0.0, 0.01, 0.03]) if is_plain else chance.uniform(0.005, 0.05)
    all_blocks, v, w = [], [], []
    for i in range(n):
        own = flying(chance, draw, is_plain)
        way = np.array([0.0, 0.0, 1.0])
        if floor == "plate" and i == 0:
            own = Block(chance.choice(KINDS), (2, 2, 1), size=(3.0, 3.0, 0.6))
            straight(own).x -= np.array([1.5, 1.5, 0.6])
        elif not is_plain:
            way = draw.normal(size=3) + (np.array([0.0, 0.0, 3.0]) if floor else 0.0)
            way /= np.linalg.norm(way)
        if i > 0 or floor in ("plane", "sphere"):
            if not (is_plain and chance.random() < 0.5):
                own.x += np.append(draw.uniform(-0.3, 0.3, 2), 0.0)
            top = max((b.x @ way).max() for b in all_blocks) if all_blocks else 0.0
            own.x += way*(top + gap - (own.x @ way).min())
            if floor:
                own.x[:, 2] += max(0.0, gap - own.x[:, 2].min())
        all_blocks.append(own)
        rests = (i == 0 and not floor) or (floor == "plate" and i == 0)
        v.append(np.zeros(3) if rests else -way*chance.uniform(0.5, 1.0))
        w.append(np.zeros(3) if is_plain or rests else draw.normal(size=3)*chance.choice([0.0, 0.5]))
    rigid = {i for i in range(1, n + 1) if chance.random() < 0.25 and not (floor == "plate" and i == 1)}
    text = bodies(all_blocks, [faces(b) for b in all_blocks])
    text += "".join(reference(i, all_blocks[i - 1]) for i in sorted(rigid))
    if floor in ("plane", "sphere"):
        text += wall(plane() if floor == "plane" else sphere(2.0, (0.0, 0.0, -2.0)))
        text += f"*BOUNDARY\n{REFERENCE}, ENCASTRE\n"
    elif floor:
        text += held_plate(all_blocks[0])
    mu = random.Random(f"friction {seed}").choice([0.1, 0.3, 0.8]) if friction else 0.0
    text += contact(floor in ("plane", "sphere"), all_blocks, mortar, mu) + starts(all_blocks, rigid, v, w)
    text += f"*STEP, NLGEOM, INC=10000\n*DYNAMIC\n{chance.choice([0.01, 0.02, 0.04])}, 0.6\n"
    if floor and chance.random() < 0.5:
        text += "*DLOAD\n" + "".join(f"B{i}, GRAV, {GRAVITY}, 0., 0., -1.\n" for i in range(1, n + 1))
    if friction:
        text += "*CONTACT PRINT\nCSTR, CF, CSHEAR, CSLIP, CNAREA\n*CONTACT FILE\nCF\n"
    return text + f"*NODE FILE\nU{', V'*friction}\n*END STEP\n"


def statics(seed, mortar):
    """Bodies on each other, each with two planes of symmetry."""
    chance = random.Random(f"crowd {seed}")
    floor, n = chance.choice(["plane", "support"]), chance.randint(2, 5)
    all_blocks, z, held, first, rigid = [], 0.0, "", 0, set()
    load = chance.choice(["gravity", "pressure", "driven"])
    for i in range(n):
        is_ball = 0 < i < n - 1 and chance.random() < 0.4
        size = tuple(chance.uniform(0.6, 1.6) for _ in range(3))
        own = block(chance, is_ball, size)
        if is_ball:                                  # a quarter of it
            own.x = ball(own.x*[0.5, 0.5, 1.0] + [1.0, 1.0, 0.0])
            straight(own)
        gap = chance.choice([0.0, 0.0, 0.01]) if i > 0 or floor == "plane" else 0.0
        own.x[:, 2] += z + gap - own.x[:, 2].min()
        z = own.x[:, 2].max()
        all_blocks.append(own)
        if 0 < i < n - 1 and not is_ball and chance.random() < 0.2:
            rigid.add(i + 1)
            held += f"{REFERENCE + i + 1}, 1, 2\n{REFERENCE + i + 1}, 4, 6\n"
        else:
            held += "".join(f"{first + k}, {a + 1}\n" for a in (0, 1) for k in own.on(a, 0))
        if i == 0 and floor == "support":
            held += "".join(f"{first + k}, 3\n" for k in own.on(2, 0))
        if i == n - 1 and load == "driven":
            driven = [first + k for k in own.on(2, 1)]
        first += len(own.x)
    text = bodies(all_blocks, [faces(b) for b in all_blocks], "*HYPERELASTIC, NEO HOOKE\n200., 2e-3\n*DENSITY\n1.\n")
    text += "*SURFACE, NAME=TOP\n" + "".join(
        f"{sum(len(b.element) for b in all_blocks[:-1]) + e}, S{f}\n" for e, f in faces(all_blocks[-1], 2, 1))
    text += "".join(reference(i, all_blocks[i - 1]) for i in sorted(rigid))
    if floor == "plane":
        text += wall(plane())
        held += f"{REFERENCE}, ENCASTRE\n"
    text += contact(floor == "plane", all_blocks, mortar, 0.0) + f"*BOUNDARY\n{held}*STEP, NLGEOM\n*STATIC\n0.25, 1.\n"
    if load == "gravity":
        text += "*DLOAD\n" + "".join(f"B{i}, GRAV, {GRAVITY}, 0., 0., -1.\n" for i in range(1, n + 1))
    elif load == "pressure":
        text += "*DSLOAD\nTOP, P, 10.\n"
    else:
        text += "*BOUNDARY\n" + "".join(f"{k}, 3, 3, -0.08\n" for k in driven)
    return text + "*NODE FILE\nU, RF\n*END STEP\n"


def scene(seed, mortar=False, friction=False):
    return statics(seed, mortar) if seed % 5 == 0 and not friction else dynamics(seed, mortar, friction)


# ---- what is right --------------------------------------------------------------------------------


def masses(fields, density=1.0):
    """Of nodes, by linear tetrahedra and trilinear cubes of the corners: the mass of a body whose edges are straight, and
    by its middle the first moment, as any element of it has them; elements of more nodes share theirs out as the
    integrals of their own shape functions."""
    mass = np.zeros(len(fields.x))
    for cell in fields.cells:
        nodes = np.asarray(cell)
        mass[nodes] += density*integrals(fields.x[nodes])
    return mass


def integrals(x):
    """Integrals of the shape functions of an element over its volume."""
    if len(x) in (4, 10):
        volume = np.linalg.det(x[1:4] - x[0])/6.0
        return volume*np.array([0.25]*4) if len(x) == 4 else volume*np.array([-0.05]*4 + [0.2]*6)
    point, weight = np.polynomial.legendre.leggauss(3)
    total = np.zeros(len(x))
    for i, j, k in np.ndindex(3, 3, 3):
        n, d = cube_shapes(np.array([point[i], point[j], point[k]]), len(x))
        total += weight[i]*weight[j]*weight[k]*np.linalg.det(d @ x)*n
    return total


CORNERS = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])
EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]


def cube_shapes(r, n_node):
    """Shape functions and their derivatives (3, n) of cubes of 8 or 20 nodes."""
    at = np.vstack([CORNERS, [(CORNERS[a] + CORNERS[b])/2 for a, b in EDGES]])[:n_node]
    n, d = np.zeros(n_node), np.zeros((3, n_node))
    for k, c in enumerate(at):
        part = np.where(c == 0, 1 - r**2, (1 + r*c)/2)
        slope = np.where(c == 0, -2*r, c/2)
        n[k] = part.prod()
        d[:, k] = [slope[a]*part[(a + 1) % 3]*part[(a + 2) % 3] for a in range(3)]
    for k in range(8, n_node):                       # corners less half of the edges that meet there
        for c in EDGES[k - 8]:
            n[c] -= n[k]/2
            d[:, c] -= d[:, k]/2
    return n, d


def judge(run, deck):
    """What is wrong with a run that is called good."""
    history, fields, found = run.history, run.fields(), []
    deepest = deepest_overlap(run)
    if deepest.by_edge > run.verdict["penetration"] + UNSEEN:
        found.append(f"overlap {deepest.by_edge:.3g}, told {run.verdict['penetration']:.3g}")
    if "*STATIC" in deck:
        return found + judge_rest(fields, deck)
    if history["stand_off"].max() > GAP_TOLERANCE:
        found.append(f"forces across {history['stand_off'].max():.2g} of an edge")
    stored = history["kinetic"] + history["strain"] - history["external_work"] + history["friction_loss"]
    stored = stored + history["restitution_loss"]    # what would change the shape of rigid bodies that stop
    if "*FRICTION" in deck:
        found += judge_friction(run, deck, (history["kinetic"] + history["strain"]).max())
    if np.ptp(stored) > BALANCE*(history["kinetic"] + history["strain"]).max():
        found.append(f"energy {np.ptp(stored)/(history['kinetic'] + history['strain']).max():.1e}")
    if "*BOUNDARY" in deck:
        return found
    step = np.diff(fields.time)[:, None]
    u = fields["displacement"]
    mass = masses(fields)
    p = np.einsum("n,tnk->tk", mass, np.diff(u, axis=0))/step
    size = (np.einsum("n,tn->t", np.abs(mass), np.linalg.norm(np.diff(u, axis=0), axis=2))/step[:, 0]).max()
    if np.abs(p - p[0]).max() > BALANCE*size:
        found.append(f"momentum {np.abs(p - p[0]).max()/size:.1e}")
    return found


def judge_friction(run, deck, most):
    """Coulomb's law, of all contacts and of each."""
    history, found = run.history, []
    least = np.diff(history["friction_loss"]).min()
    if least < -BALANCE*most:
        found.append(f"friction gives {-least/most:.1e}")
    mu = float(deck.split("*FRICTION\n")[1].split()[0])
    record = Rubbing(run, deck)
    found += judge_cones(record, mu) + judge_work(record, history, deck, most)
    return found + (judge_plane(record, mu) if "TYPE=PLANE" in deck else [])


class Rubbing:
    """What a run says of each contact in each increment, and of the nodes."""

    def __init__(self, run, deck):
        with h5py.File(run.file(".h5"), "r") as file:
            series = {name: values[1:] if values.ndim > 1 else values[:] for name, values in file["sets/CONTACT"].items()}
        self.node, self.pair, self.force = series["CSTR_label"], series["CSTR_pair"], series["CF"]
        self.pressure, self.shear = series["CSTR"][..., 0], series["CSHEAR"][..., :2]
        self.slides = series["CSHEAR"][..., 2] == 2
        self.area = series["CNAREA"]
        slip = np.concatenate([0*series["CSLIP"][:1, :, :2], series["CSLIP"][..., :2]])
        self.slip = np.diff(slip, axis=0)
        #: Sums of parts are not what the last part has.
        self.is_whole = run.history["cuts"][1:] == 0
        self.h = run.history["h"][1:]
        fields = run.fields()
        self.u, self.v, self.field_force = fields["displacement"], fields["velocity"], fields["contact_force"]
        #: Nodes of faces with nodes between: their pressures are means over faces, their forces of several contacts.
        self.has_mean = np.zeros(len(fields.x) + 1, bool)
        #: Nodes of rigid bodies, which jumps of velocities stop.
        self.is_rigid = np.zeros(len(fields.x) + 1, bool)
        rigid = {int(i) for i in re.findall(r"RIGID BODY, ELSET=B(\d+)", deck)}
        for cell, number in zip(fields.cells, np.asarray(fields["body"])[0].ravel(), strict=False):
            nodes = np.asarray(cell) + 1
            self.has_mean[nodes] |= len(nodes) in (10, 20)
            self.is_rigid[nodes] |= int(number) in rigid


def judge_cones(record, mu):
    """At each contact: surfaces push, friction is within the limit, and at it where it slides."""
    plain = ~record.has_mean[record.node]
    push, drag = record.pressure[:, plain], np.linalg.norm(record.shear[:, plain], axis=2)
    slides = record.slides[:, plain] & ~record.is_rigid[record.node[plain]]
    largest, found = max(np.abs(push).max(initial=0.0), 1e-300), []
    for name, miss in (("a contact pulls", -push), ("friction over its limit", drag - mu*np.abs(push)),
                       ("friction below its limit where it slides", (mu*push - drag)*slides)):
        if miss.max(initial=0.0) > LAW*largest:
            found.append(f"{name} by {miss.max()/largest:.1e} of the largest pressure")
    return found


def judge_work(record, history, deck, most):
    """Friction takes energy at each contact of nodes whose pressures are their own, where no velocities jump as it stops;
    with contact that does no work along its normal, as much as the forces of the nodes do over their ways, where no
    velocities jump."""
    plain = ~(record.is_rigid | record.has_mean)[record.node]     # a product of means is no work
    work = np.einsum("tka,tka->tk", record.shear, record.slip)*record.area*plain
    found, least = [], work[record.is_whole].min(initial=0.0)
    if least < -LAW*most:
        found.append(f"friction gives {-least/most:.1e} at a contact")
    if "*RIGID BODY, ELSET" not in deck:
        by_nodes = -np.einsum("tka,tka->t", record.field_force[1:], np.diff(record.u, axis=0))
        miss = np.abs(by_nodes - np.diff(history["friction_loss"]))[record.is_whole].max(initial=0.0)
        if miss > BALANCE*most:
            found.append(f"forces of contact take {miss/most:.1e} more than friction")
    return found


def judge_plane(record, mu):
    """At each node on the plane z = 0 that is in contact by itself: over an increment the friction of a push n is the remainder of tau + c s over its
    nearest point on the way from 0 to c a, cut to mu n, for any c; s is the slip, and a 0 or what it would stop after."""
    on_plane = (record.pair == record.pair.max()) & ~(record.is_rigid | record.has_mean)[record.node]
    node = record.node[on_plane] - 1
    push, drag = record.force[:, on_plane, 2], -record.force[:, on_plane, :2]
    slip = np.diff(record.u[:, node, :2], axis=0)
    to_stop = 0.5*record.h[:, None, None]*record.v[:-1, node, :2]
    largest = np.abs(record.force[:, on_plane]).max(initial=1e-300)
    stiffness = largest/max(np.abs(slip[push > 0.0]).max(initial=0.0), 1e-300)
    missed = np.minimum(*(law_missed(push, drag, stiffness*slip, stiffness*a, mu) for a in (0*to_stop, to_stop)))
    missed = np.maximum(missed, -push)[record.is_whole].max(initial=0.0)
    return [f"on the plane the law is missed by {missed/largest:.1e}"] if missed > LAW*largest else []


def law_missed(push, drag, slip, target, mu):
    """By how much, at each contact; slips are by a stiffness, as forces."""
    trial = drag + slip
    part = (trial*target).sum(-1)/np.maximum((target**2).sum(-1), 1e-300)
    over = trial - np.clip(part, 0.0, 1.0)[..., None]*target
    length = np.linalg.norm(over, axis=-1)
    most = mu*np.maximum(push, 0.0)
    return np.linalg.norm(drag - (np.minimum(1.0, most/np.maximum(length, 1e-300)))[..., None]*over, axis=-1)*(push > 0.0)


def judge_rest(fields, deck):
    """What supports bear along z is the load."""
    reaction = fields["reaction_force"][-1, :, 2]
    if "GRAV" in deck:
        load = -GRAVITY*masses(fields).sum()
    elif "DSLOAD" in deck:
        return []                                    # the face follows
    else:
        load = 0.0
    miss = abs(reaction.sum() + load)
    return [f"weight {miss:.2g}"] if miss > STATIC_BALANCE*np.abs(reaction).sum() else []


if __name__ == "__main__":
    sys.exit(run_scenes(scene, judge, (1, 200), "build/soak-crowds", ["mortar", "friction"]))
