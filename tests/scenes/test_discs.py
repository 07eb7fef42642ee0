"""Rigid circles: closed polygons of 60 edges or more roll as discs, and arcs of profiles are true arcs.

Judged by positions of centres and nodes against closed forms.
"""

import math

import numpy as np
import pytest
from scene_tools import EPSILON, Deck, number, run_deck

GRAVITY = 10.0


def disc(first, middle, radius, name, n=72, hub=True):
    """Nodes from `first` on, the middle or a corner first, and elements of a regular polygon; its
    reference node is that one."""
    angle = 0.4 + 2*math.pi*np.arange(n)/n
    place = np.array(middle) + radius*np.stack([np.cos(angle), np.sin(angle)], 1)
    if hub:
        place = np.vstack([middle, place])
        wedge = [(first, first + k, first + k % n + 1) for k in range(1, n + 1)]
    else:
        wedge = [(first, first + k, first + k + 1) for k in range(1, n - 1)]
    node = "".join(f"{first + k}, {number(x)}, {number(y)}\n" for k, (x, y) in enumerate(place))
    element = "".join(f"{first + k}, {a}, {b}, {c}\n" for k, (a, b, c) in enumerate(wedge))
    return f"""*NODE
{node}*ELEMENT, TYPE=CPE3, ELSET={name}
{element}*SOLID SECTION, ELSET={name}, MATERIAL=M
*SURFACE, NAME=S{name}
{name}
*RIGID BODY, ELSET={name}, REF NODE={first}
"""


def profile(cards):
    """A ground that is held, from the lines of its profile."""
    return f"""*NODE
9001, 0., -3.
*SURFACE, NAME=GROUND, TYPE=SEGMENTS
{cards}
*RIGID BODY, ANALYTICAL SURFACE=GROUND, REF NODE=9001
"""


def deck(bodies, pair, held, h, t_end, *, start="", friction="", gravity=(0.0, -1.0), more=""):
    lines = "".join(f"{k}, 1, 2\n{k}, 6, 6\n" for k in held)
    rubs = f"*FRICTION{friction}\n" if friction else ""
    return Deck(f"""*MATERIAL, NAME=M
*ELASTIC
1e5, .3
*DENSITY
1.
{bodies}*SURFACE INTERACTION, NAME=I
{rubs}*CONTACT PAIR, INTERACTION=I, TYPE=NODE TO SURFACE{more}
{pair}
*BOUNDARY
{lines}{start}*STEP, NLGEOM, INC=100000
*DYNAMIC, DIRECT
{h!r}, {t_end!r}
*DLOAD
A, GRAV, {GRAVITY!r}, {number(gravity[0])}, {number(gravity[1])}
*NODE FILE, FREQUENCY=1
U, V, UR, VR
*CONTACT FILE, FREQUENCY=1
CF
*END STEP
""", "discs")


def lever(n=72):
    """Square of the radius of gyration of a polygon over that of its corners."""
    return (2 + math.cos(2*math.pi/n))/6


def spins(run, middle, corner):
    """By how much a body has turned at each frame, from two of its nodes."""
    fields = run.fields()
    x = fields.x + fields["displacement"]
    arm = x[:, corner] - x[:, middle]
    return np.unwrap(np.arctan2(arm[:, 1], arm[:, 0]))


def centre(run, node=0):
    fields = run.fields()
    return (fields.x + fields["displacement"])[:, node]


@pytest.mark.parametrize("order", ["SA, GROUND", "GROUND, SA"])
def test_it_rolls_down_a_slope(order, tmp_path):
    """Whichever of the two is named first."""
    slope = math.radians(20)
    bodies = disc(1, (0.0, 1.0), 1.0, "A") + """*NODE
201, -3., -1.
202, 9., -1.
203, 9., 0.
204, -3., 0.
*ELEMENT, TYPE=CPE4, ELSET=F
201, 201, 202, 203, 204
*SOLID SECTION, ELSET=F, MATERIAL=M
*SURFACE, NAME=GROUND
201, S3
*RIGID BODY, ELSET=F, REF NODE=201
"""
    run = run_deck(deck(bodies, order, [201], 0.005, 1.0, friction="\n.5",
                        gravity=(math.sin(slope), -math.cos(slope))), tmp_path)
    assert run.verdict["verdict"] == "good" and run.verdict["cuts"] == 0
    x, turn = centre(run), spins(run, 0, 1)
    # The first increment begins without velocity and without contact force.
    speed = GRAVITY*math.sin(slope)/(1 + lever())
    assert x[-1, 0] == pytest.approx(0.5*speed, rel=1e-3)
    assert np.abs(x[:, 1] - 1.0).max() < 1e3*EPSILON
    assert np.abs((turn - turn[0]) + (x[:, 0] - x[0, 0])).max() < 1e-3*x[-1, 0]
    assert "is a rigid circle of radius 1 about node 1, and is treated as a disc, which rolls" in " ".join(run.log.split())


def test_a_disc_rolls_off_a_disc(tmp_path):
    """From the top of one that is fixed. It leaves where its weight along the normal, m g cos theta, is
    m v^2/(R + r), by the energy of rolling."""
    big, small, v = 1.0, 0.5, 0.8
    bodies = disc(1, (0.0, big + small), small, "A") + disc(201, (0.0, 0.0), big, "B")
    start = f"*INITIAL CONDITIONS, TYPE=VELOCITY\n1, 1, {v!r}\n1, 6, {-v/small!r}\n"
    h = 0.002
    run = run_deck(deck(bodies, "SA, SB", [201], h, 1.2, start=start, friction=", ROUGH"), tmp_path)
    assert run.verdict["verdict"] == "good" and run.verdict["cuts"] == 0
    x, turn = centre(run), spins(run, 0, 1)
    away = np.linalg.norm(x, axis=1) - (big + small)
    touches = np.abs(away) < 1e-10
    last = np.flatnonzero(touches)[-1]
    assert touches[:last].all() and away[last + 20] > 1e-5
    angle = np.arctan2(x[:, 0], x[:, 1])
    energy = 0.5*(1 + lever())*v**2/(GRAVITY*(big + small))
    leaves = math.acos((2 + 2*energy)/(3 + lever()))
    rate = math.sqrt(GRAVITY*math.cos(leaves)/(big + small))
    assert angle[last] == pytest.approx(leaves, abs=2*rate*h)
    rolled = -(turn - turn[0]) - (1 + big/small)*angle
    assert np.abs(rolled[:last]).max() < 1e-3*angle[last]
    total = run.history["total"]
    assert np.abs(total - total[0]).max() < 1e-4*run.history["kinetic"].max()


@pytest.mark.parametrize("friction", ["", pytest.param(", ROUGH", marks=pytest.mark.long)])
def test_into_a_quarter_pipe(friction, tmp_path):
    """From a line into a hollow arc that goes on from it, up and back: no bump, no loss."""
    radius, small, v = 2.0, 0.5, 3.0
    bodies = disc(1, (-1.0, small), small, "A") + profile(
        "START, -5., 0.\nLINE, 0., 0.\nCIRCL, 2., 2., 0., 2.\nLINE, 2., 3.")
    spin = f"1, 6, {-v/small!r}\n" if friction else ""
    start = f"*INITIAL CONDITIONS, TYPE=VELOCITY\n1, 1, {v!r}\n{spin}"
    run = run_deck(deck(bodies, "SA, GROUND", [9001], 0.005, 2.8, start=start, friction=friction),
                   tmp_path)
    assert run.verdict["verdict"] == "good" and run.verdict["cuts"] == 0
    x = centre(run)
    over = x[:, 0] > 0
    assert over.any() and x[-1, 0] < -0.5
    assert np.abs(np.linalg.norm(x[over] - [0.0, 2.0], axis=1) - (radius - small)).max() < 1e-12
    assert np.abs(x[~over, 1] - small).max() < 1e-12
    height = 0.5*v**2*(1 + (lever() if friction else 0.0))/GRAVITY
    assert x[:, 1].max() - small == pytest.approx(height, rel=1e-3)
    assert run.history["active"][1:].min() == 1


def test_over_a_round_edge(tmp_path):
    """From a table over a quarter circle: slowly, it stays on the arc until it leaves it."""
    radius, small, v = 2.0, 0.5, 2.0
    bodies = disc(1, (-0.1, small), small, "A") + profile(
        "START, -5., 0.\nLINE, 0., 0.\nCIRCL, 2., -2., 0., -2.\nLINE, 2., -4.")
    start = f"*INITIAL CONDITIONS, TYPE=VELOCITY\n1, 1, {v!r}\n"
    run = run_deck(deck(bodies, "SA, GROUND", [9001], 0.005, 1.2, start=start), tmp_path)
    assert run.verdict["verdict"] == "good" and run.verdict["cuts"] == 0
    x = centre(run)
    away = np.where(x[:, 0] > 0, np.linalg.norm(x - [0.0, -2.0], axis=1) - (radius + small),
                    x[:, 1] - small)
    last = np.flatnonzero(np.abs(away) < 1e-12)[-1]
    assert (np.abs(away[:last]) < 1e-12).all()
    angle = math.atan2(x[last, 0], x[last, 1] + 2.0)
    leaves = math.acos((2 + v**2/(GRAVITY*(radius + small)))/3)
    assert angle == pytest.approx(leaves, abs=2*0.005*math.sqrt(GRAVITY/(radius + small)))


def test_without_a_node_in_its_centre_it_is_a_polygon_and_told(tmp_path):
    bodies = disc(1, (0.0, 1.0), 1.0, "A", hub=False) + profile("START, -3., 0.\nLINE, 9., 0.")
    run = run_deck(deck(bodies, "SA, GROUND", [9001], 0.01, 0.02), tmp_path)
    assert "is a rigid circle of radius 1 about (0, 1), where its body has no node" in " ".join(run.log.split())
    assert "is treated as a disc" not in run.log


@pytest.mark.parametrize(("n", "more"), [(48, ""), (72, ", SIDES=BOTH"), (72, ", SIDES=ONE")])
def test_what_stays_a_polygon(n, more, tmp_path):
    bodies = disc(1, (0.0, 1.0), 1.0, "A", n) + profile("START, -3., 0.\nLINE, 9., 0.")
    run = run_deck(deck(bodies, "SA, GROUND", [9001], 0.01, 0.02, more=more), tmp_path)
    assert "rigid circle" not in run.log


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT"])
def test_coordinates_of_six_digits_lie_on_an_arc(formulation, tmp_path):
    """A pad that fits a drum: its nodes are in the drum by roundings, and not refused; what is in by more
    than an edge of the profile is off its arc is."""
    def pad(inner):
        angle = math.radians(60) + math.radians(60)*np.arange(13)/12
        place = [(r*math.cos(a), r*math.sin(a)) for r in (inner, 2.2) for a in angle[::-1]]
        node = "".join(f"{k}, {x:.6g}, {y:.6g}\n" for k, (x, y) in enumerate(place, 1))
        element = "".join(f"{k}, {k}, {k + 1}, {k + 14}, {k + 13}\n" for k in range(1, 13))
        return (f"*NODE\n{node}*ELEMENT, TYPE=CPE4I, ELSET=A\n{element}*SOLID SECTION, ELSET=A, MATERIAL=M\n"
                "*SURFACE, NAME=SA\nA, S1\n")
    drum = profile("START, -2., 0.\nCIRCL, 0., 2., 0., 0.\nCIRCL, 2., 0., 0., 0.")
    scene = deck(pad(2.0) + drum, "SA, GROUND", [9001], 0.01, 0.1, more=", SIDES=ONE")
    text = scene.text().replace("TYPE=NODE TO SURFACE", f"TYPE={formulation}")
    run = run_deck(Deck(text, "pad"), tmp_path/"fits")
    assert run.verdict["verdict"] == "good" and run.history["active"][-1] > 3
    low = deck(pad(1.999) + drum, "SA, GROUND", [9001], 0.01, 0.1, more=", SIDES=ONE").text()
    run = run_deck(Deck(low.replace("TYPE=NODE TO SURFACE", f"TYPE={formulation}"), "pad"),
                   tmp_path/"does not", code=2)
    assert "penetrate surface GROUND" in run.errors
