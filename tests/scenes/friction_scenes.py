"""Scenes of `*FRICTION`, for tests and the book."""

import math
import sys

import numpy as np
from plain_scenes import ONE, Scene
from scene_tools import DECKS, ROOT, Deck
from wheel_scenes import on_floor

sys.path.insert(0, str(ROOT/"pywrap"))

from emcon.model import Model  # noqa: E402

G = 10.0
WEIGHT = 2*G
SIDES = 40
NODES = {"formulation": "NODE TO SURFACE"}


def rubbing(deck, mu, name="SMOOTH"):
    deck.replace(f"*SURFACE INTERACTION, NAME={name}",
                 f"*SURFACE INTERACTION, NAME={name}\n*FRICTION\n{mu!r}")
    return deck


def balance(history, scale=0.0):
    kept = history["total"] - history["contact_work"] + history["damping_loss"] \
        + history["friction_loss"]
    return np.abs(kept - kept[0]).max()/max(scale, (history["kinetic"] + history["strain"]).max())


def make_rigid(scene, body, place, velocity=(0, 0)):
    """Make a body of the scene rigid, with the node 9000 at `place`, where its mass centre is."""
    (x, y), (vx, vy) = place, velocity
    scene.cards += [f"*NODE\n9000, {x!r}, {y!r}", f"*RIGID BODY, ELSET={body}, REF NODE=9000",
                    "*NSET, NSET=MIDDLE\n9000", "*INITIAL CONDITIONS, TYPE=ROTATING VELOCITY",
                    f"9000, 0., {vx!r}, {vy!r}\n{x!r}, {y!r}"]


def block_on_floor(h, t_end, mu, *, v0=0.0, slope=0.0, push=0.0, rigid=False, stiffness=2e4,
                   eta=0.0, cells=(4, 2), sides=ONE):
    """A block of 2 by 1 on a floor that is held; `slope` turns both, `push` pulls like gravity."""
    def turn(x, y):
        c, s = math.cos(slope), math.sin(slope)
        return c*x - s*y, s*x + c*y

    scene = Scene(h, t_end, gravity=G)
    scene.block("BLOCK", (0, 0), (2, 1), cells, stiffness=stiffness, shape=turn,
                velocity=turn(v0, 0))
    scene.block("FLOOR", (-1, -1), (6, 1), (6, 1), stiffness=stiffness, shape=turn)
    scene.hold("FLOOR", lambda x, y: True)
    scene.pairs = [("BLOCK", "FLOOR")]
    if rigid:
        make_rigid(scene, "BLOCK", turn(1, 0.5), turn(v0, 0))
    else:
        scene.cards += ["*NSET, NSET=MIDDLE", ", ".join(
            str(k) for k in range(1, 1 + (cells[0] + 1)*(cells[1] + 1)))]
    deck = rubbing(scene.deck(sides), mu)
    if eta:
        deck.replace("*MATERIAL, NAME=BLOCK", f"*MATERIAL, NAME=BLOCK\n*DAMPING, BETA={eta!r}")
    if push:
        deck.insert(f"*DLOAD\nBLOCK, GRAV, {push!r}, 1., 0.", before="*CONSTRAINT METHOD")
    return deck


def arch(mu, sides=ONE, h=0.01, t_end=0.4, stones=5):
    """Half a ring of wedges on two that are held, under gravity; nothing but friction holds them.
    The radii are 1 and 1.4, where a ring as thin as 1.11 would still stand by its shape."""
    scene = Scene(h, t_end, gravity=G)
    part = math.pi/(stones + 2)

    def stone(k):
        def place(x, y):
            angle = math.pi - (k + x)*part
            return (1 + 0.4*y)*math.cos(angle), (1 + 0.4*y)*math.sin(angle)
        return place

    names = [f"S{k}" for k in range(stones + 2)]
    for k, name in enumerate(names):
        scene.block(name, (0, 0), (1, 1), (2, 3), stiffness=2e4, shape=stone(k))
    for name in (names[0], names[-1]):
        scene.hold(name, lambda x, y: True)
    scene.pairs = [(names[1], names[0]), *zip(names[1:-1], names[2:], strict=True)]
    deck = rubbing(scene.deck(sides), mu)
    for name in names:
        deck.replace(f"*MATERIAL, NAME={name}\n", f"*MATERIAL, NAME={name}\n*DAMPING, BETA=5e-3\n")
    return deck


def arch_needs(stones=5):
    """The least coefficient with which such an arch of rigid stones stands, by one on its crown: the
    weights of the stones and one thrust H must push through each joint within its cone of friction;
    closed form but for the best H."""
    k = np.arange(1, stones + 1, 2)
    tilt = k*math.pi/(2*(stones + 2))              # of the joints, from the crown
    share = np.linspace(0.01, 2.0, 20001)          # half of the weight of a stone by H
    off = np.abs(np.arctan(np.outer(share, k)) - tilt).max(axis=1)
    return math.tan(off.min())


def stack_on_slope(mu, slope, n=4, sides=ONE, h=0.01, t_end=0.4):
    """So many damped blocks on each other, on a floor that is held and slopes."""
    def turn(x, y):
        c, s = math.cos(slope), math.sin(slope)
        return c*x - s*y, s*x + c*y

    scene = Scene(h, t_end, gravity=G)
    names = [f"B{k}" for k in range(n)]
    for k, name in enumerate(names):
        scene.block(name, (0.02*k, 0.5*k), (2, 0.5), (4 + k % 2, 2), stiffness=2e4, shape=turn)
    scene.block("FLOOR", (-1, -1), (6, 1), (6, 1), stiffness=2e4, shape=turn)
    scene.hold("FLOOR", lambda x, y: True)
    scene.pairs = list(zip(names, ["FLOOR", *names[:-1]], strict=True))
    deck = rubbing(scene.deck(sides), mu)
    for name in names:
        deck.replace(f"*MATERIAL, NAME={name}\n", f"*MATERIAL, NAME={name}\n*DAMPING, BETA=5e-3\n")
    return deck


def way(run, n, slope=0.0):
    """Mean displacements of the first n nodes along the floor, of all frames."""
    u = run.fields()["displacement"][:, :n]
    return (u @ [math.cos(slope), math.sin(slope)]).mean(axis=1)


def rolling(inner, h, t_end, mu, v0):
    """A rigid ring of 40 sides, bored by `inner` of its radius 1, thrown along the floor."""
    scene = Scene(h, t_end, gravity=G)

    def place(angle, share):
        r = 1.0 - share*(1.0 - inner)
        return r*math.sin(angle), 1.0 - r*math.cos(angle)

    scene.ring("RING", place, (SIDES, 4), stiffness=1e3, velocity=(v0, 0))
    scene.block("FLOOR", (-2, -1), (4, 1), (4, 1), stiffness=1e3)
    scene.hold("FLOOR", lambda x, y: True)
    scene.pairs = [("RING", "FLOOR")]
    make_rigid(scene, "RING", (0, 1), (v0, 0))
    return rubbing(scene.deck(ONE), mu)


def rolling_polygon(sides, turn, mu):
    """A rigid polygon of radius 0.5, turned by `turn`, thrown along a rigid floor with velocity 1;
    its lowest corner touches."""
    angles = [turn + 2*math.pi*k/sides for k in range(sides)]
    middle = -0.5*min(math.sin(angle) for angle in angles)
    places = [(0.0, middle)] + [(0.5*math.cos(angle), middle + 0.5*math.sin(angle))
                                for angle in angles]
    return Deck(on_floor(places, mu) + f"""*INITIAL CONDITIONS, TYPE=ROTATING VELOCITY
1, 0., 1., 0.
0., {middle!r}
*STEP, NLGEOM
*DYNAMIC, DIRECT
0.02, 1.
*DLOAD
P, GRAV, 10., 0., -1.
*END STEP
""")


def polygon(r):
    """Area and second moment about the middle of SIDES sides on a circle of radius r."""
    angle = 2*math.pi/SIDES
    area = 0.5*SIDES*r**2*math.sin(angle)
    return area, area*r**2*(2 + math.cos(angle))/6


def on_spring(h, t_end, mu, folder, *, pull=0.0, stiffness=0.0, belt=0.0, rebound=None):
    """Times and places of a rigid block between a spring and a floor that moves with `belt`; `pull`
    and `stiffness` are by its mass. Also the ledger at the end, and Newton's iterations."""
    scene = Scene(h, t_end, gravity=G)
    scene.block("BLOCK", (0, 0), (2, 1), (1, 1), stiffness=1e3)
    scene.block("FLOOR", (-30, -1), (60, 1), (1, 1), stiffness=1e3,
                velocity=(belt, 0))
    if belt:
        scene.hold("FLOOR", lambda x, y: True, "2, 2")
        scene.hold("FLOOR", lambda x, y: True, "1, 1", belt*t_end)
    else:
        scene.hold("FLOOR", lambda x, y: True)
    scene.pairs = [("BLOCK", "FLOOR")]
    make_rigid(scene, "BLOCK", (1, 0.5))
    deck = rubbing(scene.deck(ONE), mu)
    if rebound is not None:
        deck.replace("*FRICTION", f"*FRICTION, RESTITUTION={rebound!r}")
    if pull:
        deck.insert(f"*DLOAD\nBLOCK, GRAV, {pull!r}, 1., 0.", before="*CONSTRAINT METHOD")
    deck.set_parameter("formulation", "NODE TO SURFACE")
    folder.mkdir(exist_ok=True, parents=True)
    deck.write(folder/"spring.inp")
    model = Model.from_deck(folder/"spring.inp")
    corners = [0.0, 0.0, 2.0, 2.0]                # in the order of their labels

    def spring(x):
        k = 2.0*stiffness/4
        way = x[:, 0] - np.resize(corners, len(x))     # at both ends of an increment
        hessian = np.zeros((len(x), 2, 2))
        hessian[:, 0, 0] = k
        return 0.5*k*way**2, np.stack((k*way, 0*way), axis=1), hessian

    model.potential(spring, [1, 2, 3, 4])
    with model.stepper() as stepper:
        time, way = [0.0], [0.0]
        while not stepper.is_done:
            stepper.step()
            time.append(stepper.time)
            way.append(stepper.u[0, 0])
        return np.array(time), np.array(way), stepper.ledger


def belt_way(time, mu, k, v):
    """Closed form: slides until it is as fast as the belt, sticks until the spring pulls by mu g,
    and swings about that place for ever."""
    w, end = math.sqrt(k), 10.0*mu/k
    t1 = math.asin(v*w/(10.0*mu))/w
    x1 = end*(1 - math.cos(w*t1))
    t2 = t1 + (end - x1)/v
    return np.select([time < t1, time < t2], [end*(1 - np.cos(w*time)), x1 + v*(time - t1)],
                     end + v/w*np.sin(w*(time - t2)))


def ring(mu, scene=None):
    """That of the paper, or another `scene` of it, against its block, which is free."""
    deck = rubbing(scene or Deck.read(DECKS / "ring.inp"), mu, "FRICTIONLESS")
    deck.remove("*BOUNDARY")
    return deck


def pressed(shift, mu, sides=ONE, floor=None):
    """A block whose top is pressed down and moved sideways, in ten static increments, on a floor
    that is held, or that is elastic, of so many elements."""
    scene = Scene(0.1, 1.0)
    scene.block("BLOCK", (0, 0), (2, 1), (8, 4), stiffness=100.0)
    scene.block("FLOOR", (-1, -1), (4, 1), (floor or 5, 4 if floor else 1), stiffness=100.0)
    scene.hold("FLOOR", lambda x, y: y < -0.99 or not floor)
    scene.hold("BLOCK", lambda x, y: y > 0.99, "2, 2", -0.02)
    scene.hold("BLOCK", lambda x, y: y > 0.99, "1, 1", shift)
    scene.side("BOTTOM", "BLOCK", lambda x, y: y < 0.01)
    scene.side("TOP", "FLOOR", lambda x, y: y > -0.01)
    scene.pairs = [("BOTTOM", "TOP" if floor else "FLOOR")]
    deck = rubbing(scene.deck(sides), mu)
    deck.replace("*DYNAMIC, DIRECT", "*STATIC, DIRECT")
    return deck


def pressed_sideways(n):
    """code_aster's SSNV128: half of a plate, n by n elements, on a floor, pressed from above and
    more from its side; the node at the floor in the symmetry plane is held. Also where nodes are."""
    side, young = 0.04, 1.3e11
    scene = Scene(1.0, 1.0)
    scene.block("PLATE", (0, 0), (side, side), (n, n), stiffness=young)
    scene.block("FLOOR", (-side, -side), (3*side, side), (3, 1), stiffness=young)
    scene.hold("FLOOR", lambda x, y: True)
    scene.hold("PLATE", lambda x, y: x > 0.99*side, "1, 1")
    scene.hold("PLATE", lambda x, y: x > 0.99*side and y < 1e-9, "2, 2")
    scene.side("BOTTOM", "PLATE", lambda x, y: y < 1e-9 and x < side*(1 - 0.5/n))
    scene.pairs = [("BOTTOM", "FLOOR")]
    node = scene.part["PLATE"].node
    load = []
    for label, corner in scene.part["PLATE"].element.items():
        for k in range(4):
            ends = [node[corner[k]], node[corner[(k + 1) % 4]]]
            if all(y > 0.99*side for _, y in ends):
                load.append(f"{label}, P{k + 1}, 5e7")
            if all(x < 1e-9 for x, _ in ends):
                load.append(f"{label}, P{k + 1}, 15e7")
    text = rubbing(scene.deck(ONE), 1.0).text().replace("*DYNAMIC, DIRECT", "*STATIC, DIRECT")
    deck = Deck(text.replace(f"{young!r}, 0.3", f"{young!r}, 0.2"))
    deck.insert("*DLOAD\n" + "\n".join(load), before="*CONSTRAINT METHOD")
    return deck, np.array([node[label] for label in sorted(node)])


def pressed_round(n, radius=50.0, mu=0.3, back=0.0, layers=20):
    """Two bodies of one material, the upper one round, pressed together and then moved sideways in
    twelve static increments; meshes are finest in the middle. With `back` only by this part, and then
    to the other side in another twelve. Also the places of its nodes."""
    width = 10.0

    def grade(t):
        return width*math.sinh(4*t)/math.sinh(4)

    def upper(x, y):
        return grade(x), grade(y) + grade(x)**2/(2*radius)*(1 - y)

    scene = Scene(0.05, 1.6 if back else 1.0)
    scene.block("UPPER", (-1, 0), (2, 1), (n, layers), stiffness=100.0, shape=upper)
    scene.block("LOWER", (-1, -1), (2, 1), (n + 6, layers), stiffness=100.0,
                shape=lambda x, y: (grade(x), grade(y)))
    scene.hold("LOWER", lambda x, y: y < -0.99*width)
    scene.hold("UPPER", lambda x, y: y > 0.99*width, "2, 2", -0.12)
    scene.hold("UPPER", lambda x, y: y > 0.99*width, "1, 1", 0.12)
    scene.side("BOTTOM", "UPPER", lambda x, y: y < x*x/(2*radius) + 1e-6 and abs(x) < 4)
    scene.side("TOP", "LOWER", lambda x, y: y > -1e-9 and abs(x) < 6)
    scene.pairs = [("BOTTOM", "TOP")]
    deck = rubbing(scene.deck(ONE), mu)
    deck.replace("*DYNAMIC, DIRECT", "*STATIC, DIRECT")
    deck.replace("CDIS, CSTR, CF", "CSTR, CSHEAR, CSLIP")
    head, body = deck.text().split("*BOUNDARY, AMPLITUDE=RAMP\n")
    motion, tail = body.split("*CONSTRAINT METHOD")
    lines = motion.strip().splitlines()
    text = head.replace("*AMPLITUDE, NAME=RAMP", "*AMPLITUDE, NAME=DOWN\n0., 0., 0.4, 1., 2., 1.\n"
                        f"*AMPLITUDE, NAME=SIDEWAYS\n0., 0., 0.4, 0., 1., {back or 1.0!r}, 1.6, "
                        f"{-back!r}\n*AMPLITUDE, NAME=RAMP")
    for name, axis in (("DOWN", "2, 2"), ("SIDEWAYS", "1, 1")):
        text += "\n".join([f"*BOUNDARY, AMPLITUDE={name}",
                           *(line for line in lines if f", {axis}, " in line), ""])
    node = scene.part["UPPER"].node
    place = np.array([node[label] for label in sorted(node)])
    return Deck(f"{text}*CONSTRAINT METHOD{tail}"), place


def partial_slip(run, place, mu=0.3):
    """Of each increment that moves sideways: force along the surface by mu times that across, width
    of what sticks by that in contact, and the largest distance of nodes by it."""
    status = run.fields()["contact_status"][:, :len(place)]
    history, rows = run.history, []
    for k in np.flatnonzero(history["time"] > 0.4 + 1e-9):
        bears, sticks = (np.sort(place[kind, 0]) for kind in (status[k] > 0, status[k] == 1))
        half = (bears[-1] - bears[0])/2
        held = (sticks[-1] - sticks[0])/2 if len(sticks) else 0.0
        rows.append((-history["pair1_force_x"][k]/(mu*history["pair1_force_y"][k]), held/half,
                     np.diff(bears).max()/half))
    return np.array(rows)


def dragged(mu, *, leaves=False, tied=False, statics=True, increments=12, sides=ONE, cells=(6, 2),
            floor=13):
    """A block whose top is pressed down and moved along a floor of elements, whose end at 0 it comes
    onto, or leaves: with both in proportion, so that all slides at once. With `tied` it is two
    pieces."""
    scene = Scene(1/increments, 1.0)
    scene.block("BLOCK", (-1.5, 0), (1 if tied else 2, 1), cells, stiffness=1e4, density=1e-4)
    if tied:
        scene.block("SECOND", (-0.5, 0), (1, 1), (cells[0] + 1, cells[1]), stiffness=1e4,
                    density=1e-4)
    scene.block("FLOOR", (-6 if leaves else 0, -1), (6, 1), (floor, 1), stiffness=1e4, density=1e-4)
    scene.hold("FLOOR", lambda x, y: y < -0.99)
    for name in ("BLOCK", "SECOND")[:1 + tied]:
        scene.hold(name, lambda x, y: y > 0.99, "1, 1", 1.0)
        scene.hold(name, lambda x, y: y > 0.99, "2, 2", -5e-4)
        scene.side(f"UNDER_{name}", name, lambda x, y: y < 0.01)
    scene.side("TOP", "FLOOR", lambda x, y: y > -0.01)
    scene.pairs = [("UNDER_BLOCK", "TOP")]
    if tied:
        scene.side("LEFT", "BLOCK", lambda x, y: x > -0.51)
        scene.side("RIGHT", "SECOND", lambda x, y: x < -0.49)
        scene.cards += ["*TIE, NAME=SEAM", "LEFT, RIGHT"]
    deck = rubbing(scene.deck(sides), mu)
    if tied:
        under = [deck.data("*SURFACE", f"NAME=UNDER_{name}") for name in ("BLOCK", "SECOND")]
        under[0] += under[1]
    if statics:
        deck.replace("*DYNAMIC, DIRECT", "*STATIC, DIRECT")
    else:
        for name in ("BLOCK", "SECOND", "FLOOR"):
            if f"*MATERIAL, NAME={name}\n" in deck.text():
                deck.replace(f"*MATERIAL, NAME={name}\n",
                             f"*MATERIAL, NAME={name}\n*DAMPING, BETA=1e-2\n")
    return deck
