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


def bush_torques(run, mu=0.3):
    """Of each increment in which all slides: the torque at the hub by mu times all the pressure on
    it, radius 1, added up from the places of nodes."""
    fields = run.fields()
    hole = np.flatnonzero(fields["contact_status"][-1] > 0)
    place = fields.x + fields["displacement"]
    seen = []
    for k, now in enumerate(place[:, hole]):
        if not (fields["contact_status"][k, hole] == 2).all():
            continue
        around = now[np.argsort(np.arctan2(now[:, 1], now[:, 0]))]
        edge = np.linalg.norm(np.roll(around, -1, 0) - around, axis=1)
        pressure = fields["contact_pressure"][k, hole[np.argsort(np.arctan2(now[:, 1], now[:, 0]))]]
        push = pressure @ (0.5*(edge + np.roll(edge, 1)))
        moment = fields["reaction_moment"][k].ravel()
        seen.append(abs(moment[np.abs(moment).argmax()])/(mu*push))
    return np.array(seen)
