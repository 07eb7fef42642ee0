"""Scenes of `*FRICTION` on curves whose closed form is known, for tests and the book."""

import math

import numpy as np
from friction_scenes import make_rigid, rubbing
from plain_scenes import ONE, Scene
from scene_tools import Deck

#: Elements around of the sleeve and of the hub; nothing divides both, so that nodes are everywhere
#: over edges.
BUSHES = ((35, 24), (67, 48), (131, 96))


def smoothed(deck, smoothing):
    return Deck(deck.text().replace("<smoothing>", smoothing), deck.name)


def bead(h, edges, pad=0.05, mu=0.3, t_end=2.0):
    """A bead, a node with a pad, thrown along the inside of a circle of radius 1 without gravity."""
    scene = Scene(h, t_end)
    r, a = 1.0 - pad, 0.5*pad
    scene.block("BEAD", (-a/2, -r - a/2), (a, a), (1, 1), stiffness=1e3, velocity=(1.0, 0))
    scene.ring("TRACK", lambda angle, share: (
        (1.3 - 0.3*share)*math.sin(angle), -(1.3 - 0.3*share)*math.cos(angle)), (edges, 1),
        stiffness=1e3)
    scene.hold("TRACK", lambda x, y: True)
    scene.side("INSIDE", "TRACK", lambda x, y: math.hypot(x, y) < 1.1)
    make_rigid(scene, "BEAD", (0, -r), (1.0, 0))
    scene.cards.append("*SURFACE, NAME=CENTRE, TYPE=NODE\n9000")
    scene.pairs = [("CENTRE", "INSIDE")]
    deck = rubbing(scene.deck(ONE), mu)
    deck.replace("NAME=SMOOTH", f"NAME=SMOOTH, PAD THICKNESS={pad!r}")
    return smoothed(deck, "HERMITE")


def bead_error(run, pad=0.05, mu=0.3):
    """The curve pushes by m v^2/r, so that dv/dt = -mu v^2/r: v = 1/(1 + mu t/r), the capstan's
    v = exp(-mu phi) by the angle. The largest error of v, which begins at 1."""
    history = run.history
    v = np.sqrt(history["kinetic"]/history["kinetic"][0])
    return np.abs(v - 1.0/(1.0 + mu*history["time"]/(1.0 - pad))).max()


def bush(cells, smoothing="NONE", mu=0.3, fit=0.02, turn=0.1):
    """A rigid hub of radius 1 in an elastic sleeve that is too small by `fit` and held at its rim: the
    fit, then the hub is turned, in static increments."""
    around, edges = cells
    scene = Scene(0.1, 1.0)
    scene.ring("SLEEVE", lambda angle, share: (
        (1.5 - (0.5 + fit)*share)*math.cos(angle), (1.5 - (0.5 + fit)*share)*math.sin(angle)),
        (around, max(2, around//16)), stiffness=1e3)
    scene.ring("HUB", lambda angle, share: ((1 - 0.5*share)*math.cos(angle),
                                            (1 - 0.5*share)*math.sin(angle)), (edges, 1),
               stiffness=1e3)
    scene.hold("SLEEVE", lambda x, y: math.hypot(x, y) > 1.4)
    scene.side("HOLE", "SLEEVE", lambda x, y: math.hypot(x, y) < 1.0)
    scene.side("SEAT", "HUB", lambda x, y: math.hypot(x, y) > 0.9)
    scene.pairs = [("HOLE", "SEAT")]
    make_rigid(scene, "HUB", (0, 0))
    text = smoothed(rubbing(scene.deck(ONE), mu), smoothing).text()
    head, step = text.replace("CDIS, CSTR, CF", "CSTR, CSHEAR").replace("U\n", "U, RM\n") \
        .split("*STEP, NLGEOM")
    body = step[step.index("*CONSTRAINT METHOD"):]
    fitted = "*STATIC, DIRECT\n0.5, 1.\n*CONTACT INTERFERENCE, SHRINK\n*BOUNDARY\n9000, 1, 2\n9000, 6, 6, 0."
    turned = f"*STATIC, DIRECT\n<h>, 1.\n*BOUNDARY\n9000, 6, 6, {turn!r}"
    return Deck(head + "".join(f"*STEP, NLGEOM\n{begin}\n{body}" for begin in (fitted, turned)))


def bush_torques(run, edges, mu=0.3):
    """Of each increment in which all slides, by mu times all the pressure on the hub, radius 1: the
    torque, and the moments of what the nodes of the hole push with across and along the `edges`
    that they stand over."""
    fields = run.fields()
    hole = np.flatnonzero(fields["contact_status"][-1] > 0)
    rim = np.setdiff1d(np.flatnonzero(np.abs(np.linalg.norm(fields.x, axis=1) - 1) < 1e-9), hole)[0]
    place = fields.x + fields["displacement"]
    seen = []
    for k, now in enumerate(place[:, hole]):
        if not (fields["contact_status"][k, hole] == 2).all():
            continue
        angle = np.arctan2(now[:, 1], now[:, 0])
        order = np.argsort(angle)
        around = now[order]
        edge = np.linalg.norm(np.roll(around, -1, 0) - around, axis=1)
        push = fields["contact_pressure"][k, hole[order]]*(0.5*(edge + np.roll(edge, 1)))
        moment = fields["reaction_moment"][k].ravel()
        start, end = (np.arctan2(*at[::-1]) for at in (fields.x[rim], place[k, rim]))
        # From the middle of the edge; the hub's nodes are at whole numbers of edges.
        lead = (angle[order] - (end - start)) % (2*np.pi/edges) - np.pi/edges
        radius = np.linalg.norm(around, axis=1)
        arms = mu*radius*np.cos(lead) - radius*np.sin(lead)
        seen.append([np.abs(moment).max(), push @ arms]/(mu*push.sum()))
    return np.array(seen).T


def belt_on_drum(edges, mu, smoothing="NONE"):
    """A belt of so many elements on half a drum of as many edges, which it does not meet at its
    nodes: drawn over it by one end against a pull at the other."""
    length = math.pi*50/edges

    def circle(r, angle):
        return r*math.cos(angle), r*math.sin(angle)

    belt = [[(-50.0, -k*length), (-51.0, -k*length)] for k in (2, 1)]
    for k in range(edges + 1):
        angle = math.pi*(1 - k/edges)
        belt.append([circle(50, angle), circle(51, angle)])
    belt += [[(50.0, -k*length), (51.0, -k*length)] for k in (1, 2)]
    drum = [[circle(r, math.radians(210) - (k - 0.3)*math.pi/edges) for r in (45, 50)]
            for k in range(4*edges//3 + 1)]
    nodes = [f"{first + 2*i + k}, {x!r}, {y!r}" for first, rows in ((1, belt), (1001, drum))
             for i, row in enumerate(rows) for k, (x, y) in enumerate(row)]
    n, m = len(belt) - 1, len(drum) - 1
    over = [f"{i + 1}, {2*i + 1}, {2*i + 3}, {2*i + 4}, {2*i + 2}" for i in range(n)]
    under = [f"{1001 + i}, {1001 + 2*i}, {1003 + 2*i}, {1004 + 2*i}, {1002 + 2*i}"
             for i in range(m)]
    smooth = f", 1.\n*SURFACE SMOOTHING, TYPE={smoothing}\n"
    press, draw = (f"*STEP, NLGEOM\n*STATIC\n{h!r}{smooth}" for h in (0.25, 0.1))
    return Deck("\n".join([
        "*NODE", *nodes, "*ELEMENT, TYPE=CPE4I, ELSET=BELT", *over,
        "*ELEMENT, TYPE=CPE4, ELSET=DRUM", *under, "*NSET, NSET=A\n1, 2",
        f"*NSET, NSET=B\n{2*n + 1}, {2*n + 2}",
        f"*NSET, NSET=D, GENERATE\n1001, {1002 + 2*m}, 1",
        "*SURFACE, NAME=INNER", *(f"{i + 1}, S1" for i in range(1, n - 1)),
        "*SURFACE, NAME=OUTER", *(f"{1001 + i}, S3" for i in range(m)),
        "*MATERIAL, NAME=M\n*ELASTIC\n2000, 0.\n*SOLID SECTION, ELSET=BELT, MATERIAL=M",
        "*SOLID SECTION, ELSET=DRUM, MATERIAL=M",
        f"*SURFACE INTERACTION, NAME=I\n*FRICTION\n{mu!r}",
        "*CONTACT PAIR, INTERACTION=I, TYPE=NODE TO SURFACE\nINNER, OUTER",
        "*BOUNDARY\nD, 1, 2\nA, 1\nB, 1", press + "*CLOAD\nA, 2, -5.",
        "*BOUNDARY\nB, 2, 2, -0.5\n*END STEP", draw + "*BOUNDARY",
        f"B, 2, 2, {-6 - 1.5*length!r}", "*NODE PRINT, NSET=B, TOTALS=ONLY\nRF\n*END STEP"]))
