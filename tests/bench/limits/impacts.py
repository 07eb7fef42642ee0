"""Rows of contact: ratios of stiffness, mass and size, increments, speeds, gaps, piles."""

import dataclasses

import numpy as np
from plain_scenes import AUTO, Scene, below
from scene_tools import number

from .common import EXACT, Row, momentum_error, with_penetration, with_velocities

# ---- a disc on a block --------------------------------------------------------------------------

#: Wave speed of the disc, sqrt((lambda + 2 mu)/rho) of E = 100, nu = 0.3, rho = 1, and the time that
#: it takes through the shortest element, about.
WAVE = (100*0.7/(1.3*0.4))**0.5
TRANSIT = 0.1/WAVE


def dropped(h=0.01, t_end=0.5, velocity=(0.1, -1.0), gap=0.01, stiffness=1000.0, gravity=0.0, make=Scene):
    scene = make(h, t_end, gravity)
    scene.disc("DISC", (0.1, 0.5 + gap), 0.5, (4, 2), velocity=velocity)
    scene.block("BLOCK", (-1, -0.5), (2, 0.5), (6, 2), stiffness=stiffness)
    return scene.hold("BLOCK", below(-0.5)).deck(AUTO)


def stiffer(ratio, make=Scene):
    return dropped(stiffness=100.0*ratio, make=make)


def against_heavier(ratio, make=Scene):
    """A light disc hits a free one that is so many times as dense, and as stiff."""
    scene = make(0.01, 0.6)
    scene.disc("LIGHT", (0.1, 1.01), 0.5, (4, 2), velocity=(0, -1))
    scene.disc("HEAVY", (0, 0), 0.5, (4, 2), stiffness=100.0*ratio, density=ratio)
    return scene.deck(AUTO)


def denser(ratio, make=Scene):
    """A light disc hits a free one that is so many times as dense, of the same stiffness."""
    scene = make(0.01, 0.6)
    scene.disc("LIGHT", (0.1, 1.01), 0.5, (4, 2), velocity=(0, -1))
    scene.disc("HEAVY", (0, 0), 0.5, (4, 2), density=ratio)
    return scene.deck(AUTO)


def in_increments(transits, make=Scene):
    """Ten increments; the disc reaches the block in the fifth."""
    h = transits*TRANSIT
    return dropped(h=h, t_end=10*h, velocity=(0, -1), gap=4.5*h, make=make)


def at_speed(share, make=Scene):
    speed = share*WAVE
    return dropped(h=0.02/speed, t_end=1.2/speed, velocity=(0, -speed), gap=0.05, make=make)


def grazing(angle, make=Scene):
    """A disc flies along a floor that it meets at so many radians."""
    scene = make(0.02, 2.0)
    scene.disc("DISC", (-1, 0.5 + angle), 0.5, (6, 2), velocity=(1, -angle))
    scene.block("FLOOR", (-2, -0.5), (4, 0.5), (8, 1)).hold("FLOOR", below(-0.5))
    return scene.deck(AUTO)


def from_gap(gap, make=Scene):
    """A block falls flat on a floor under gravity."""
    scene = make(0.005, 0.3, gravity=10.0)
    scene.block("BLOCK", (0, gap), (1, 1), (3, 3))
    scene.block("FLOOR", (-1, -0.5), (3, 0.5), (5, 1)).hold("FLOOR", below(-0.5))
    return scene.deck(AUTO)


# ---- meshes -------------------------------------------------------------------------------------


def sizes(ratio, make=Scene):
    """Edges of a block that falls, by those of the floor."""
    slaves, masters = (1, round(ratio)) if ratio >= 1 else (round(1/ratio), 1)
    scene = make(0.01, 0.2)
    scene.block("BLOCK", (0, 0.05), (1, 1), (slaves, 1), velocity=(0.1, -1))
    scene.block("FLOOR", (0, -1), (1, 1), (masters, 1)).hold("FLOOR", below(-1))
    return scene.deck(AUTO)


def thin_column(share, make=Scene):
    """The floor under a disc has a column of elements that is so much thinner than the others."""
    scene = make(0.01, 0.3)
    scene.disc("DISC", (0.5 + 0.3*share, 0.51), 0.5, (4, 2), velocity=(0, -1))
    x = [-1, 0, 0.5, 0.5 + share, 1.0 + share, 2]
    scene.block("FLOOR", (0, -0.5), (5, 0.5), (5, 1), shape=lambda s, y: (
        x[round(s)], y)).hold("FLOOR", below(-0.5))
    return scene.deck(AUTO)


def at_once(n, make=Scene):
    """So many nodes meet a floor in the same increment."""
    scene = make(0.01, 0.1)
    scene.block("SLAB", (0, 0.025), (0.1*(n - 1), 0.2), (n - 1, 2), velocity=(0, -1))
    scene.block("FLOOR", (-1, -1), (0.1*(n - 1) + 2, 1), (max(4, n//3), 1))
    return scene.hold("FLOOR", below(-1)).deck(AUTO)


def stack(n, make=Scene):
    """Blocks on each other, a small gap between them, fall on a floor."""
    scene = make(0.005, 0.3, gravity=10.0)
    for k in range(n):
        scene.block(f"B{k}", (0.05*(-1)**k, 0.01 + 0.51*k), (1, 0.5), (3 + k % 2, 2), stiffness=1e4)
    scene.block("FLOOR", (-1, -0.5), (3, 0.5), (5, 1), stiffness=1e4).hold("FLOOR", below(-0.5))
    scene.pairs = [("B0", "FLOOR"), *((f"B{k + 1}", f"B{k}") for k in range(n - 1))]
    return scene.deck(AUTO)


# ---- rest and restitution -----------------------------------------------------------------------


FALL, GRAVITY, INCREMENT = 0.2, 10.0, 0.0025


def bouncing(restitution):
    """A rigid disc that falls straight on a rigid floor: in the series of its bounces it comes to
    rest at t (1 + e)/(1 - e), t the first fall."""
    end = FALL*(1 + restitution)/(1 - restitution)
    scene = Scene(INCREMENT, end + 1.0, gravity=GRAVITY)
    scene.disc("DISC", (0, 0.5 + 0.5*GRAVITY*FALL**2), 0.5, (4, 2))
    scene.block("FLOOR", (-1, -1), (2, 1), (4, 1))
    deck = scene.deck(AUTO)
    deck.replace("*SURFACE INTERACTION, NAME=SMOOTH",
                 f"*NODE\n9001, 0., {0.5 + 0.5*GRAVITY*FALL**2!r}\n9002, 0., -1.\n"
                 "*RIGID BODY, ELSET=DISC, REF NODE=9001\n*RIGID BODY, ELSET=FLOOR, REF NODE=9002\n"
                 "*BOUNDARY\n9001, 1\n9001, 6\n9002, 1, 2\n9002, 6\n"
                 f"*SURFACE INTERACTION, NAME=SMOOTH, RESTITUTION={restitution}")
    return deck


def rest_error(run, restitution):
    """How far the instant from which the disc is slower than two increments of falling make it is
    from the end of the series, by what increments allow; and any overlap.

    Impacts fall into increments, which shifts each by one at most, and the speed after it by what
    one increment of falling makes, the next bounce by two increments, and so on: 1 + 2/(1 - e) of them
    for each of n bounces. What the series still has below that speed takes 4/(1 - e).
    """
    history = run.history
    speed = np.sqrt(history["kinetic"]/history["kinetic"][1])*GRAVITY*INCREMENT
    slow = 2*GRAVITY*INCREMENT
    end = FALL*(1 + restitution)/(1 - restitution)
    found = history["time"][np.nonzero(speed > slow)[0][-1]]
    n = np.log(slow/(GRAVITY*FALL))/np.log(restitution) if restitution else 1.0
    allowed = INCREMENT*(n*(1 + 2/(1 - restitution)) + 4/(1 - restitution))
    return max(abs(found - end)/allowed, run.verdict["penetration"])


def settled(n):
    """A block on a floor, first in equilibrium, then for `n` increments of dynamics."""
    scene = Scene(0.01, 0.01*n, gravity=10.0)
    scene.block("BLOCK", (0, 0), (1, 1), (2, 2))
    scene.block("FLOOR", (-1, -0.5), (3, 0.5), (4, 1)).hold("FLOOR", below(-0.5))
    scene.hold("BLOCK", lambda x, y: abs(x - 0.5) < 1e-9, axes="1")
    deck = scene.deck(AUTO)
    k = deck.find("*STEP")
    statics = [(head.replace("*DYNAMIC, DIRECT", "*STATIC"), list(lines))
               for head, lines in deck.card[k:]]
    statics[1] = ("*STATIC", ["0.5, 1."])
    deck.card[k:k] = statics
    deck.replace("*NODE FILE\nU\n", "*NODE FILE, FREQUENCY=1000\nU\n")
    return deck


def stir(run, _):
    """Largest kinetic energy of the dynamics, by the strain energy."""
    history = run.history
    return history["kinetic"].max()/history["strain"].max()


NODES = {"formulation": "NODE TO SURFACE"}
ROWS = [dataclasses.replace(row, parameters=NODES, deck=with_velocities(row.deck)) for row in (
    Row("stiffness", "stiffness of a block / that of the disc that falls on it",
        (1, 1e3, 1e6, 1e9, 1e12), stiffer, with_penetration, "energy, overlap", reach=5),
    Row("mass", "mass and stiffness of a disc / those of the one that hits it",
        (1, 1e3, 1e6, 1e9, 1e12), against_heavier, momentum_error, "energy, momenta, overlap", reach=5),
    Row("density", "mass of a disc / that of one of the same stiffness that hits it",
        (1, 1e3, 1e6, 1e9, 1e12), denser, momentum_error, "energy, momenta, overlap", reach=5),
    Row("increment", "h / time of a wave through an element; impact in the fifth of ten increments",
        (1.0, 1e-2, 1e-4, 1e-6, 1e-8, 1e1, 1e2, 1e3), in_increments, with_penetration,
        "energy, overlap", reach=8, short=(0, 4, -1)),
    Row("speed", "speed of an impact / speed of waves", (1e-2, 1e-4, 1e-6, 0.1, 0.3, 1.0, 2.0),
        at_speed, with_penetration, "energy, overlap", reach=7),
    Row("grazing", "angle at which a disc meets a floor [rad]",
        (1e-2, 1e-4, 1e-6, 1e-8), grazing, with_penetration, "energy, overlap", reach=4),
    Row("gap", "gap from which a block falls flat on a floor", (1e-2, 1e-6, 1e-12, 0.0), from_gap,
        with_penetration, "energy, overlap", reach=4),
    Row("sizes", "edges of the falling block / edges of the floor",
        (1, 1e-1, 1e-2, 1e-3, 1e1, 1e2, 1e3), sizes, with_penetration, "energy, overlap", reach=7),
    Row("thin", "width of an element under a disc / width of its neighbours",
        (1e-1, 1e-3, 1e-6, 1e-9, 1e-12), thin_column, with_penetration, "energy, overlap", reach=4),
    Row("at_once", "nodes that meet a floor in one increment", (10, 100, 1000, 10000), at_once,
        with_penetration, "energy, overlap", reach=4, short=(0, 1)),
    Row("stack", "blocks of a stack that falls", (2, 5, 10, 20), stack, with_penetration,
        "energy, overlap", reach=4, short=(0, 2)),
    Row("restitution", "`RESTITUTION` of a rigid disc that bounces to rest, in infinitely many bounces",
        (0.0, 0.2, 0.5, 0.7, 0.9), bouncing, rest_error,
        "instant of rest: difference from the limit of the series / resolution of the increments", bar=1.0, reach=5),
    Row("rest", "increments of a block that rests", (100, 1000, 100000), settled, stir,
        "kinetic / strain energy", bar=EXACT, reach=3, short=(0,)),
)]
