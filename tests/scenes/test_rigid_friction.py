"""Rigid bodies with friction and restitution: they rebound, roll, slide and come to rest."""

import math

import numpy as np
import pytest
from scene_tools import EPSILON, Deck, run_deck

#: Sums of some hundred products in double precision.
ROUND = 1e-13


def balance(history):
    total = history["total"] - history["contact_work"] + history["friction_loss"]
    return np.abs(total - total[0]).max()/(history["kinetic"].max() + 1e-300)


def holds_laws(history):
    """Energies close, and neither impacts nor friction give any."""
    scale = history["kinetic"].max()
    assert balance(history) < 1e-11
    for name in ("restitution_loss", "friction_loss", "pair1_friction_loss"):
        assert np.diff(history[name]).min() > -ROUND*scale, name


PLANE = """*SURFACE, NAME=GROUND, TYPE=SEGMENTS
START, -100., 0.
LINE, 100., 0.
*RIGID BODY, ANALYTICAL SURFACE=GROUND, REF NODE=10
"""


def scene(points, elements, *, e, mu, h, t_end, centre, velocity=(0.0, 0.0, 0.0), weight=8.0,
          slope=0.0, rebound=0.0):
    """A rigid body of density 1 on a plane; `velocity`: along, up, spin."""
    nodes = "\n".join(f"{k}, {x!r}, {y!r}" for k, (x, y) in points.items())
    faces = "\n".join(", ".join(map(str, (k + 1, *nodes))) for k, nodes in enumerate(elements))
    load = f"*DLOAD\nBODY, GRAV, {weight!r}, {math.sin(slope)!r}, {-math.cos(slope)!r}\n"
    x, y = centre
    return Deck(f"""*HEADING
A rigid body on a plane
*NODE, NSET=BODY
{nodes}
*NODE
9, {x!r}, {y!r}
10, 0., -5.
*ELEMENT, TYPE=CPE{len(elements[0])}, ELSET=BODY
{faces}
*MATERIAL, NAME=M
*DENSITY
1.
*SOLID SECTION, ELSET=BODY, MATERIAL=M
1.
*RIGID BODY, ELSET=BODY, REF NODE=9
*SURFACE, NAME=BODY
BODY,
{PLANE}*SURFACE INTERACTION, NAME=ROUGH, RESTITUTION={e!r}
*FRICTION, RESTITUTION={rebound!r}
{mu!r}
*CONTACT PAIR, INTERACTION=ROUGH, SIDES=ONE
BODY, GROUND
*BOUNDARY
10, 1
10, 2
10, 6
*INITIAL CONDITIONS, TYPE=ROTATING VELOCITY
9, {velocity[2]!r}, {velocity[0]!r}, {velocity[1]!r}
{x!r}, {y!r}
*STEP, NLGEOM, INC=1000000
*DYNAMIC, DIRECT
{h!r}, {t_end!r}
{load if weight else ""}*NEWTON, TOLERANCE=1e-12
*NODE FILE, FREQUENCY=100000
U
*END STEP
""")


def block(n, tilt=0.0, lift=0.0, **more):
    """A square of side 1 with n + 1 nodes below, its lowest one `lift` above the plane."""
    c, s = math.cos(tilt), math.sin(tilt)
    label = {(i, j): 100 + (n + 1)*j + i for j in (0, 1) for i in range(n + 1)}
    y0 = lift + 0.5*(c + abs(s))
    points = {label[i, j]: (c*(i/n - .5) - s*(j - .5), y0 + s*(i/n - .5) + c*(j - .5))
              for i, j in label}
    elements = [(label[i, 0], label[i + 1, 0], label[i + 1, 1], label[i, 1]) for i in range(n)]
    return scene(points, elements, centre=(0.0, y0), **more)


def disc(n, turn=0.0, lift=0.0, **more):
    """A polygon of n corners of radius 1/2, one of which comes first at turn = 0."""
    y0 = 0.5 + lift
    points = {100: (0.0, y0)} | {101 + k: (
        0.5*math.sin(turn + 2*math.pi*k/n), y0 - 0.5*math.cos(turn + 2*math.pi*k/n))
        for k in range(n)}
    elements = [(100, 101 + k, 101 + (k + 1) % n) for k in range(n)]
    return scene(points, elements, centre=(0.0, y0), **more)


# ---- closed forms -------------------------------------------------------------------------------


@pytest.mark.each_value
@pytest.mark.parametrize("e", [0.0, 0.5, 0.8, 1.0])
@pytest.mark.parametrize(("mu", "slide"), [(0.1, 1.0), (0.4, 3.0), (0.4, 0.5), (0.4, 0.7), (1.0, 0.3)])
def test_flat_and_oblique(e, mu, slide, tmp_path):
    """It leaves with e of its normal velocity, and friction takes mu (1 + e) of it along, or all.
    At a slide of 0.5 and 0.7 it sticks for e = 1 and slides for less than 1/4 and 3/4."""
    deck = block(1, lift=0.255, e=e, mu=mu, h=0.01, t_end=0.5, velocity=(slide, -1.0, 0.0), weight=0)
    history = run_deck(deck, tmp_path).history
    along = max(0.0, slide - mu*(1 + e))
    assert history["py"][-1] == pytest.approx(e, abs=ROUND)
    assert history["px"][-1] == pytest.approx(along, abs=ROUND)
    assert history["restitution_loss"][-1] == pytest.approx(0.5*(1 - e*e), abs=ROUND)
    assert history["friction_loss"][-1] == pytest.approx(0.5*(slide**2 - along**2), abs=ROUND)
    assert history["pair1_impulse_x"][-1] == pytest.approx(along - slide, abs=ROUND)
    holds_laws(history)


@pytest.mark.parametrize("e", [0.0, 0.5, 0.8])
@pytest.mark.parametrize(("mu", "slide", "spin"), [(0.05, 1.0, 0.0), (0.3, 2.0, 3.0), (1.0, 0.4, 1.0)])
def test_disc_on_a_corner(e, mu, slide, spin, tmp_path):
    """One contact below the centre: the impulse along is mu times that of the normal, or what
    stops the corner, slip/(1/m + r^2/I). The step turns the disc by spin h on the way."""
    h = 0.001
    turn = -0.05*spin                                 # so that the corner is below as it lands
    deck = disc(8, turn=turn, lift=0.0505, e=e, mu=mu, h=h, t_end=0.06, velocity=(slide, -1.0, spin),
                weight=0)
    history = run_deck(deck, tmp_path).history
    mass = -history["py"][0]
    area = 8*0.5*0.25*math.sin(math.pi/4)
    inertia = area*0.25/6*(2 + math.cos(math.pi/4))    # of a regular polygon about its centre
    assert mass == pytest.approx(area, rel=ROUND)
    slip = slide + 0.5*spin
    push = mass*(1 + e)
    drag = min(mu*push, slip/(1/mass + 0.25/inertia))
    loss = history["friction_loss"][-1]
    near = 8*(abs(spin) + abs(slip))*h                 # of the direction of the corner
    assert history["py"][-1] - history["py"][0] == pytest.approx(push, abs=mass*near)
    assert history["px"][0] - history["px"][-1] == pytest.approx(drag, abs=mass*near)
    assert loss == pytest.approx(drag*(slip - 0.5*drag*(1/mass + 0.25/inertia)), abs=mass*near)
    holds_laws(history)


# ---- circles ------------------------------------------------------------------------------------


def circle(**more):
    """A disc of radius 1/2 with the mass of an octagon: its centre with a pad as thick as that."""
    deck = disc(8, **more)
    text = deck.text().replace("*SURFACE, NAME=BODY\nBODY,", "*SURFACE, NAME=BODY, TYPE=NODE\n9")
    return Deck(text.replace("NAME=ROUGH,", "NAME=ROUGH, PAD THICKNESS=0.5,"))


def circle_mass():
    """Mass, and what its inertia about the centre adds at the radius."""
    mass = 8*0.5*0.25*math.sin(math.pi/4)
    return mass, mass/6*(2 + math.cos(math.pi/4))


@pytest.mark.parametrize("mu", [0.05, 0.5])
def test_a_circle_rolls_down_a_slope(mu, tmp_path):
    """Or slides, if the coefficient is less than what rolling takes: both with a constant
    acceleration, which steps have exactly but for the angle that one turns by, squared."""
    slope, h, t_end = 0.35, 0.01, 1.0
    deck = circle(e=0.0, mu=mu, h=h, t_end=t_end, weight=8.0, slope=slope)
    deck.replace("FREQUENCY=100000\nU", "FREQUENCY=1\nV, VR")
    run = run_deck(deck, tmp_path)
    mass, added = circle_mass()
    drag = min(mu*mass*8*math.cos(slope), mass*8*math.sin(slope)*added/(mass + added))
    speed = 8*math.sin(slope)*t_end - drag/mass*t_end
    spin = drag*t_end/(0.5*added)                      # drag R = I times its rate, I = added R^2
    assert run.verdict["verdict"] == "good" and "do not roll" not in run.log
    history = run.history
    near = (spin*h)**2                                 # of what a step turns by
    assert history["px"][-1] == pytest.approx(mass*speed, rel=near)
    kinetic = 0.5*mass*speed**2 + 0.5*added*(0.5*spin)**2
    assert history["kinetic"][-1] == pytest.approx(kinetic, rel=2*near)
    slid = (speed - 0.5*spin)*0.5*t_end
    assert history["friction_loss"][-1] == pytest.approx(drag*slid, abs=near*kinetic)
    assert balance(history) < 1e-11


def polygon_rolls(n, weight, slope, t_end, dt):
    """The spin of a polygon of radius 1/2 that falls over its corners without slip and rebound, by
    the angular momentum about the next corner, and how many corners it falls over."""
    turn = 2*math.pi/n
    gyration = 0.25/6*(2 + math.cos(turn))             # squared, about the centre
    lean, spin, corners = 0.0, 0.0, 0
    for _ in range(round(t_end/dt)):
        rate = 0.5*weight*math.sin(lean + slope)/(0.25 + gyration)
        middle = 0.5*weight*math.sin(lean + 0.5*dt*spin + slope)/(0.25 + gyration)
        lean, spin = lean + dt*spin + 0.5*dt*dt*rate, spin + dt*middle
        if lean >= 0.5*turn:
            spin *= (gyration + 0.25*math.cos(turn))/(gyration + 0.25)
            lean, corners = lean - turn, corners + 1
    return spin, corners


@pytest.mark.parametrize("n", [12, 36])
def test_a_polygon_falls_over_its_corners(n, tmp_path):
    """Without rebound: what it loses is that of corners, not of a disc. A corner lands up to a step late,
    and its pull turns from forth to back as late."""
    slope, h, t_end, weight = 0.35, 0.001, 1.0, 8.0
    deck = disc(n, e=0.0, mu=1.0, h=h, t_end=t_end, weight=weight, slope=slope)
    history = run_deck(deck, tmp_path).history
    spin, corners = polygon_rolls(n, weight, slope, t_end, 1e-5)
    mass = 0.5*n*0.25*math.sin(2*math.pi/n)
    added = 0.25 + 0.25/6*(2 + math.cos(2*math.pi/n))
    found = math.sqrt(2*history["kinetic"][-1]/(mass*added))
    late = weight*math.sin(math.pi/n)*math.cos(slope)/added*h
    assert corners >= 3
    assert found == pytest.approx(spin, abs=corners*late)
    holds_laws(history)


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
@pytest.mark.parametrize(("mu", "slide", "spin"), [(0.05, 1.0, 0.0), (0.3, 2.0, 3.0), (1.0, 0.4, 1.0)])
def test_a_circle_falls(e, mu, slide, spin, tmp_path):
    """As `test_disc_on_a_corner`, wherever it lands; of what a step turns by is left its square."""
    h = 0.001
    deck = circle(turn=0.3, lift=0.0505, e=e, mu=mu, h=h, t_end=0.06, velocity=(slide, -1.0, spin),
                  weight=0)
    history = run_deck(deck, tmp_path).history
    mass, added = circle_mass()
    slip = slide + 0.5*spin
    push = mass*(1 + e)
    drag = min(mu*push, slip/(1/mass + 1/added))
    near = mass*((spin + 2*slip)*h)**2             # of what a step may turn it by
    along, left = slide - drag/mass, 0.5*spin - drag/added
    assert history["py"][-1] - history["py"][0] == pytest.approx(push, abs=ROUND)
    assert history["px"][-1] == pytest.approx(mass*along, abs=near)
    kinetic = 0.5*(mass*(along**2 + e*e) + added*left**2)
    assert history["kinetic"][-1] == pytest.approx(kinetic, abs=2*near)
    holds_laws(history)


# ---- to rest ------------------------------------------------------------------------------------


@pytest.mark.each_value
@pytest.mark.parametrize("e", [0.0, 0.5])
@pytest.mark.parametrize(("n", "tilt", "spin", "mu"), [
    (1, 0.0, 0.0, 0.1), (3, 0.0, 0.0, 1.0), (8, 0.0, 0.0, 0.4), (1, 0.05, 0.0, 1.0),
    (3, 0.3, 1.0, 0.4), (8, 0.05, 0.0, 0.4), (2, 0.7, 3.0, 1.0), (8, 0.7, 3.0, 0.1)])
def test_block_comes_to_rest(n, tilt, spin, mu, e, tmp_path):
    deck = block(n, tilt=tilt, lift=0.6, e=e, mu=mu, h=0.005, t_end=5.0, velocity=(1.0, -1.0, spin))
    run = run_deck(deck, tmp_path)
    history = run.history
    holds_laws(history)
    assert run.verdict["verdict"] == "good"
    assert run.verdict["cuts"] == 0
    assert run.verdict["law_violation"] < 1e-10
    assert history["kinetic"][-1] < 1e-16*history["kinetic"].max()


@pytest.mark.parametrize(("n", "slope", "mu", "tilt"), [
    (1, 0.4, 0.5, 0.0), pytest.param(2, 0.6, 0.7, 0.0, marks=pytest.mark.long), (3, 0.4, 0.5, 0.05),
    pytest.param(8, 0.25, 0.3, 0.0, marks=pytest.mark.long)])
def test_at_rest_on_a_slope_it_stays(n, slope, mu, tilt, tmp_path):
    deck = block(n, tilt=tilt, lift=0.1, e=0.5, mu=mu, h=0.01, t_end=110.0, slope=slope,
                 velocity=(0.3, -0.5, 0.0))
    deck.replace("FREQUENCY=100000", "FREQUENCY=1000")
    run = run_deck(deck, tmp_path)
    holds_laws(run.history)
    assert run.verdict["verdict"] == "good"
    assert run.history["restitution_loss"][-1] > 0
    assert (run.history["kinetic"][1000:] < 1e-18).all()
    fields = run.fields()
    place = fields["displacement"][fields.time >= 9.99]
    assert len(place) == 11                           # after 1000 increments, and 10000 more
    assert np.abs(place - place[0]).max() < 1e-12


def test_traction_is_the_coefficient_times_the_pressure(tmp_path):
    """Where it slides, in the increment of the impact too: both are of step and jump together."""
    deck = block(1, lift=0.255, e=0.5, mu=0.1, h=0.01, t_end=0.3, velocity=(1.0, -1.0, 0.0), weight=0)
    deck.replace("*NODE FILE, FREQUENCY=100000", "*CONTACT FILE\nCSTR, CSHEAR\n*NODE FILE")
    fields = run_deck(deck, tmp_path).fields()
    pressure = np.nan_to_num(fields["contact_pressure"].reshape(len(fields.time), -1))
    shear = np.nan_to_num(fields["contact_shear"].reshape(len(fields.time), -1))
    assert pressure.max() > 1.0
    assert np.abs(np.abs(shear) - 0.1*pressure).max() < ROUND*pressure.max()


# ---- many bodies --------------------------------------------------------------------------------


def crowd(bodies, pairs, *, e, mu, h, t_end, velocity=None, box=(-100.0, 100.0)):
    """Rigid polygons, name: (centre, corners), all on a floor between walls, which fall."""
    cards, rigid, label, element = [], [], 0, 0
    for k, (name, (centre, corners)) in enumerate(bodies.items()):
        first = label + 1
        cards += [f"*NODE, NSET={name}", *(f"{first + i}, {x!r}, {y!r}" for i, (x, y) in
                                           enumerate([centre, *corners])),
                  "*NODE", f"{9000 + k}, {centre[0]!r}, {centre[1]!r}",
                  f"*ELEMENT, TYPE=CPE3, ELSET={name}"]
        n = len(corners)
        cards += [f"{element + i + 1}, {first}, {first + 1 + i}, {first + 1 + (i + 1) % n}"
                  for i in range(n)]
        label, element = label + n + 1, element + n
        cards += [f"*SOLID SECTION, ELSET={name}, MATERIAL=M", "1.", f"*SURFACE, NAME={name}",
                  f"{name},", f"*RIGID BODY, ELSET={name}, REF NODE={9000 + k}"]
        if velocity and name in velocity:
            spin, (x, y) = velocity[name]
            rigid += ["*INITIAL CONDITIONS, TYPE=ROTATING VELOCITY", f"{9000 + k}, {spin!r}, 0., 0.",
                      f"{x!r}, {y!r}"]
    low, high = box
    lines = "\n".join(f"{a}, {b}" for a, b in pairs)
    ground = "\n".join(f"{name}, GROUND" for name in bodies)
    load = "\n".join(f"*DLOAD\n{name}, GRAV, 10., 0., -1." for name in bodies)
    cards = "\n".join(["*HEADING", "Rigid bodies fall on each other", "*MATERIAL, NAME=M", "*DENSITY",
                       "1.", *cards, "*NODE", "8999, 0., -5.", *rigid])
    return Deck(f"""{cards}
*SURFACE, NAME=GROUND, TYPE=SEGMENTS
START, {low!r}, 20.
LINE, {low!r}, 0.
LINE, {high!r}, 0.
LINE, {high!r}, 20.
*RIGID BODY, ANALYTICAL SURFACE=GROUND, REF NODE=8999
*SURFACE INTERACTION, NAME=ROUGH, RESTITUTION={e!r}
*FRICTION
{mu!r}
*CONTACT PAIR, INTERACTION=ROUGH, SIDES=ONE
{ground}
*CONTACT PAIR, INTERACTION=ROUGH
{lines}
*BOUNDARY
8999, 1
8999, 2
8999, 6
*STEP, NLGEOM, INC=1000000
*DYNAMIC, DIRECT
{h!r}, {t_end!r}
{load}
*NODE FILE, FREQUENCY=50
U
*END STEP
""")


def comes_to_rest(deck, folder):
    run = run_deck(deck, folder)
    history = run.history
    assert run.verdict["verdict"] == "good"
    assert run.verdict["law_violation"] < 1e-10
    assert balance(history) < 1e-9                    # of Newton's default tolerance
    assert np.diff(history["restitution_loss"]).min() >= 0
    assert history["restitution_loss"][-1] > 0.1*history["kinetic"].max()
    assert history["kinetic"][-1] < 1e-12*history["kinetic"].max()
    return run


@pytest.mark.long
def test_fifteen_discs(tmp_path):
    corners = 12
    bodies = {}
    for k in range(15):
        x, y = 0.62*(k % 5) - 1.24 + 0.05*(k//5), 0.4 + 0.66*(k//5)
        bodies[f"D{k}"] = ((x, y), [(x + 0.3*math.cos(2*math.pi*(i + 0.3*k)/corners),
                                     y + 0.3*math.sin(2*math.pi*(i + 0.3*k)/corners))
                                    for i in range(corners)])
    pairs = [(a, b) for a in bodies for b in bodies if a < b]
    deck = crowd(bodies, pairs, e=0.5, mu=0.3, h=0.01, t_end=4.0, box=(-1.7, 1.7))
    comes_to_rest(deck, tmp_path)


@pytest.mark.long
def test_ten_dominoes(tmp_path):
    """The first one is pushed over; they fall one after the other and lie on each other."""
    bodies = {}
    for k in range(10):
        x = 0.5*k
        bodies[f"D{k}"] = ((x, 0.5), [(x - 0.1, 0.0), (x + 0.1, 0.0), (x + 0.1, 1.0), (x - 0.1, 1.0)])
    pairs = [(f"D{k}", f"D{k + 1}") for k in range(9)]
    deck = crowd(bodies, pairs, e=0.5, mu=0.3, h=0.01, t_end=4.0, velocity={"D0": (-2.0, (0.1, 0.0))})
    run = comes_to_rest(deck, tmp_path)
    fields = run.fields()
    top = fields["displacement"][-1][[6*k + 4 for k in range(10)]]     # with reference nodes
    assert (top[:, 1] < -0.1).all()                   # of the upper left corners: all have fallen


# ---- statics: nothing deforms -------------------------------------------------------------------


def at_rest(n, slope, mu, unit=1.0, formulation="NODE TO SURFACE", gap=0.0):
    """A rigid square of n edges, 1 and of density 1, in a static step; gravity 8 is turned."""
    deck = block(n, lift=gap, e=1.0, mu=mu, h=1.0, t_end=1.0, weight=8.0*unit, slope=slope)
    deck.replace("*DYNAMIC, DIRECT", "*STATIC")
    deck.replace(", RESTITUTION=1.0", "")
    deck.replace(", RESTITUTION=0.0", "")
    deck.replace("SIDES=ONE", f"SIDES=ONE, TYPE={formulation}")
    deck.insert("*CONTACT FILE\nCF")
    deck.remove("*INITIAL CONDITIONS")
    return deck


@pytest.mark.each_value
@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize(("n", "slope", "gap"), [(1, 0.0, 0.0), (1, 0.4, 0.0), (3, 0.4, 0.0), (8, 0.0, 0.25)])
def test_a_rigid_block_stands_in_statics(n, slope, gap, unit, formulation, tmp_path):
    """Friction holds it on slopes below the coefficient, by as many contacts as there are."""
    run = run_deck(at_rest(n, slope, 0.5, unit, formulation, gap), tmp_path)
    assert run.verdict["verdict"] == "good" and run.verdict["cuts"] == 0
    fields = run.fields()
    body = np.flatnonzero(fields["displacement"].any(axis=(0, 2))) if gap else []
    assert np.abs(fields["displacement"][-1][body] - [0.0, -gap]).max(initial=0.0) < ROUND
    force = fields["contact_force"][-1]
    push = force[force[:, 1] > 0].sum(axis=0)
    weight = 8.0*unit
    assert push == pytest.approx([-weight*math.sin(slope), weight*math.cos(slope)], abs=1e-10*weight)
    at_nodes = force[force[:, 1] > 0]
    assert (np.abs(at_nodes[:, 0]) <= 0.5*at_nodes[:, 1] + ROUND*weight).all()


@pytest.mark.parametrize("slope", [0.47, 0.6])
def test_a_rigid_block_that_slides_off_has_no_static_state(slope, tmp_path):
    """tan(slope) above the coefficient."""
    run = run_deck(at_rest(1, slope, 0.5), tmp_path, code=3)
    assert "is free to move in x" in run.errors
