"""Rigid bodies: free, hinged, driven, tied, welded and in contact."""

import math

import numpy as np
import pytest
from scene_tools import EPSILON, Deck, has_fused_products, number, run_deck
from scipy.interpolate import CubicSpline
from scipy.special import ellipk

from emcon import Model, Stepper

ELASTIC = "*HYPERELASTIC, COUPLED NEO HOOKE\n1000., 0.3\n"


def grid(name, n, low, extent, first):
    """Nodes and CPE4 of a rectangle, labels from `first` on, in sets `name`."""
    nx, ny = n
    lines = [f"*NODE, NSET={name}"]
    for j in range(ny + 1):
        for i in range(nx + 1):
            x, y = low[0] + extent[0]*i/nx, low[1] + extent[1]*j/ny
            lines.append(f"{first + i + (nx + 1)*j}, {number(x)}, {number(y)}")
    lines.append(f"*ELEMENT, TYPE=CPE4, ELSET={name}")
    for j in range(ny):
        for i in range(nx):
            a = first + i + (nx + 1)*j
            lines.append(f"{first + i + nx*j}, {a}, {a + 1}, {a + nx + 2}, {a + nx + 1}")
    return "\n".join(lines) + "\n"


def section(name, law=""):
    return f"*MATERIAL, NAME=M{name}\n{law}*DENSITY\n1.\n" \
        f"*SOLID SECTION, ELSET={name}, MATERIAL=M{name}\n1.\n"


def step(cards="", h=0.02, t_end=1.0, procedure=None):
    return f"*STEP, NLGEOM, INC=1000000\n{procedure or f'*DYNAMIC, DIRECT{chr(10)}{h!r}, {t_end!r}'}\n" \
        f"{cards}*NODE FILE\nU, V, RF\n*END STEP\n"


def alone(model="", cards="", reference=(1.0, 0.5), **more):
    """A rigid rectangle of 2 by 1, node 100 its reference node."""
    return Deck(grid("BODY", (4, 2), (0, 0), (2, 1), 1) + f"*NODE, NSET=REF\n100, {reference[0]}, "
                f"{reference[1]}\n" + section("BODY") + "*RIGID BODY, ELSET=BODY, REF NODE=100\n"
                + model + step(cards, **more))


MASS, INERTIA = 2.0, 2.0*(2.0**2 + 1.0**2)/12.0          # of the rectangle about its centre
PLACE = np.array([(0.5*i, 0.5*j) for j in range(3) for i in range(5)] + [(1.0, 0.5)])


def balance(history):
    total = history["total"]
    return np.abs(total - total[0]).max()/(history["kinetic"] + history["strain"]).max()


def drift(history, name):
    """The largest change of a momentum, by the largest of the momenta in size."""
    scale = max(np.abs(history[k]).max() for k in ("px", "py", "lz"))
    return np.abs(history[name] - history[name][0]).max()/scale


def shape_error(x, rest):
    """The largest change of a distance between two nodes, by the extent."""
    def apart(p):
        return np.linalg.norm(p[:, None] - p[None], axis=2)
    return np.abs(apart(x) - apart(rest)).max()/apart(rest).max()


def turned(angle):
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


# ---- free ---------------------------------------------------------------------------------------


def spinning(folder, h, t_end, spin=3.0):
    deck = alone("*INITIAL CONDITIONS, TYPE=VELOCITY\n100, 1, 0.25\n100, 2, -0.5\n"
                 f"100, 6, {spin}\n", h=h, t_end=t_end)
    deck.replace("*NODE FILE", "*NODE FILE, FREQUENCY=100")
    return run_deck(deck, folder)


def test_two_hundred_turns(tmp_path):
    """Energy, momenta and shape stay; what a step turns obeys tan(angle/2) = spin h/2."""
    spin, h = 3.0, 0.1
    n = round(200*2*math.pi/spin/h/100)*100
    run = spinning(tmp_path, h, n*h, spin)
    assert balance(run.history) < 1e-12
    assert run.history["kinetic"][0] == pytest.approx(
        0.5*MASS*(0.25**2 + 0.5**2) + 0.5*INERTIA*spin**2, rel=100*EPSILON)
    way = np.linalg.norm([0.25, 0.5])*run.history["time"][-1]    # where the body has flown to
    for name, size in (("px", MASS*0.5), ("py", MASS*0.5), ("lz", way*MASS*0.5)):
        change = run.history[name] - run.history[name][0]
        assert np.abs(change).max() < 1e-12*size, name
    fields = run.fields()
    x = fields.x + fields["displacement"][-1]
    assert shape_error(x, PLACE) < 1e-13
    angle = 2*math.atan(0.5*spin*h)*n
    expected = (PLACE - PLACE[-1]) @ turned(angle).T + PLACE[-1] + np.array([0.25, -0.5])*n*h
    # A turn is 1e-16 of itself off in every step, which adds up over n steps.
    assert np.abs(x - expected).max() < 20*n*EPSILON*np.abs(expected).max()


def test_positions_converge_at_second_order(tmp_path):
    error = []
    for k, h in enumerate((0.1, 0.05)):
        run = spinning(tmp_path/str(k), h, 10.0)
        x = run.fields().x + run.fields()["displacement"][-1]
        exact = (PLACE - PLACE[-1]) @ turned(30.0).T + PLACE[-1] + np.array([2.5, -5.0])
        error.append(np.abs(x - exact).max())
    assert error[0]/error[1] == pytest.approx(4.0, rel=0.05)


def test_a_spin_about_a_point_in_one_card(tmp_path):
    """`ROTATING VELOCITY` gives nodes that deform and rigid bodies the same field."""
    card = "*INITIAL CONDITIONS, TYPE=ROTATING VELOCITY\n{}, 1.5, 0.25, -0.5\n-1., 2.\n"
    expected = np.array([0.25, -0.5]) + 1.5*np.stack([2.0 - PLACE[:, 1], PLACE[:, 0] + 1.0], 1)
    for k, (name, is_rigid) in enumerate((("BODY", False), ("REF", True))):
        deck = alone(card.format(name))
        if not is_rigid:
            deck.remove("*RIGID BODY")
            deck.replace("*DENSITY", ELASTIC + "*DENSITY")
        with Stepper(deck.write(tmp_path/f"{k}.inp")) as stepper:
            assert np.abs(stepper.v - expected)[:15 + is_rigid].max() < 16*EPSILON


def test_a_constant_moment(tmp_path):
    """Angular momentum grows by M h exactly, and the balance counts the work."""
    run = run_deck(alone(cards="*CLOAD\n100, 6, 2.\n", h=0.05, t_end=10.0), tmp_path)
    history = run.history
    assert np.abs(history["lz"] - 2.0*history["time"]).max() < 1e-12*history["lz"].max()
    assert balance(history) < 1e-12
    assert history["kinetic"][-1] == pytest.approx(0.5*20.0**2/INERTIA, rel=1e-5)


# ---- hinged and driven --------------------------------------------------------------------------


def swing(folder, h):
    """A physical pendulum from rest, 90 degrees: its history, and times at which it is lowest."""
    run = run_deck(alone(cards="*BOUNDARY\n100, 1, 2, 0.\n*DLOAD\nBODY, GRAV, 9., 0., -1.\n",
                         reference=(3.0, 0.5), h=h, t_end=7.5), folder)
    fields = run.fields()
    arm = fields.x[7] + fields["displacement"][:, 7] - np.array([3.0, 0.5])
    angle = np.arctan2(arm[:, 0], -arm[:, 1])
    return run, CubicSpline(fields.time, angle).roots(extrapolate=False)


def test_pendulum(tmp_path):
    """Period 4 K(k) sqrt(I/(m g l)), k = sin(45 degrees), at second order; energy exact."""
    length = 2.0
    period = 4*ellipk(0.5)*math.sqrt((INERTIA + MASS*length**2)/(MASS*9.0*length))
    error = []
    for k, h in enumerate((0.04, 0.02)):
        run, lowest = swing(tmp_path/str(k), h)
        assert balance(run.history) < 1e-12
        assert len(lowest) >= 3
        error.append((lowest[2] - lowest[0])/period - 1.0)
    assert abs(error[1]) < 1e-3
    assert error[0]/error[1] == pytest.approx(4.0, rel=0.1)


def test_driven_rotation(tmp_path):
    """Nodes are where the amplitude says; the work is the energy; the hinge bears the centre."""
    deck = alone("*AMPLITUDE, NAME=SPIN\n0., 0., 20., 40.\n",
                 "*BOUNDARY\n100, 1, 2, 0.\n*BOUNDARY, AMPLITUDE=SPIN\n100, 6, 6, 1.\n",
                 reference=(3.0, 0.5), h=0.02, t_end=5.0)
    run = run_deck(deck, tmp_path)
    fields = run.fields()
    expected = (PLACE[:15] - (3.0, 0.5)) @ turned(10.0).T + (3.0, 0.5)
    assert np.abs(fields.x[:15] + fields["displacement"][-1][:15] - expected).max() < 64*EPSILON
    energy = 0.5*(INERTIA + MASS*4.0)*2.0**2
    assert np.abs(run.history["kinetic"][1:] - energy).max() < 1e-12*energy
    assert np.abs(run.history["external_work"][1:] - energy).max() < 1e-12*energy
    # m l spin^2 towards the hinge, the mean of a step: second order.
    force = np.linalg.norm(fields["reaction_force"][-1][15])
    assert force == pytest.approx(MASS*2.0*2.0**2, rel=(2.0*0.02)**2)


def driven_wheel(method="NULL SPACE"):
    """A plate whose spin is driven, but whose reference node, off its centre, is free."""
    deck = alone("*INITIAL CONDITIONS, TYPE=VELOCITY\n100, 1, 0.5\n100, 2, 1.\n"
                 "*AMPLITUDE, NAME=SPIN\n0., 0., 1., 0.5, 2., 2., 3., 5., 20., 56.\n",
                 "*BOUNDARY, AMPLITUDE=SPIN\n100, 6, 6, 2.\n"
                 f"*CONSTRAINT METHOD, TYPE={method}\n", reference=(0.5, 0.25), h=0.02, t_end=6.0)
    deck.replace("U, V, RF", "U, V, RF, UR, VR, RM")
    return deck


@pytest.mark.parametrize("method", ["NULL SPACE", "SADDLE POINT"])
def test_a_driven_rotation_of_a_body_that_is_free_to_move(method, tmp_path):
    """No force comes from outside, only a moment, whose work the balance counts; the centre moves as
    it did at the start."""
    run = run_deck(driven_wheel(method), tmp_path)
    fields, history = run.fields(), run.history
    x = fields.x[:15] + fields["displacement"][:, :15]
    angle = fields["rotation"][:, 15]
    expected = 2.0*np.interp(fields.time, [0, 1, 2, 3, 20], [0, 0.5, 2, 5, 56])
    assert np.abs(angle - expected).max() < 1e-12*expected[-1]
    for k in (150, -1):
        arms = (PLACE[:15] - PLACE[-1]) @ turned(expected[k]).T
        assert np.abs(x[k] - x[k].mean(0) - arms).max() < 1e-12
    # the centre flies straight on, at the velocity that the first increment leaves it with
    assert np.abs(np.diff(history["px"][1:])).max() < 1e-12*MASS
    assert np.abs(np.diff(history["py"][1:])).max() < 1e-12*MASS
    assert history["px"][-1] == pytest.approx(history["px"][0], rel=1e-12)
    # A step by phi gives a couple of arms in the middle of it, cos(phi/2) as long, the impulse that
    # the jump of the spin by 1 takes: I (1 + cos(phi))/2. At constant spin there is none.
    moment = fields["reaction_moment"][1:, 15]
    phi = 1.0*0.02
    assert moment[0]*0.02 == pytest.approx(INERTIA*(1 + math.cos(phi))/2, rel=1e-12)
    kinks = np.isin(np.arange(len(moment)), [0, 50, 100, 150])
    assert np.abs(moment[~kinks]).max() < 1e-12*moment.max()
    assert moment.sum()*0.02 == pytest.approx(6.0*INERTIA, rel=(6.0*0.02)**2)
    assert balance(history) < 1e-12
    assert np.abs(fields["reaction_force"]).max() < 1e-10*np.abs(moment).max()
    spin = fields["spin"][:, 15]
    late = fields.time > 4.0
    assert np.abs(spin[late] - 6.0).max() < 1e-9*6.0


def test_a_driven_rotation_goes_on_with_the_same_bits(tmp_path):
    with Stepper(driven_wheel().write(tmp_path/"deck.inp")) as whole:
        for _ in range(60):
            whole.step()
        whole.write_restart(tmp_path/"half.rst.h5")
        with Stepper.from_restart(tmp_path/"half.rst.h5") as rest:
            for _ in range(15):
                whole.step()
                rest.step()
            assert (rest.u == whole.u).all() and (rest.v == whole.v).all()
            assert rest.ledger == whole.ledger


def test_a_rotation_driven_after_a_free_turn(tmp_path):
    """A second step takes a body that spins freely by its rotation, FIXED: the rest of its motion
    stays what it was."""
    deck = alone("*INITIAL CONDITIONS, TYPE=VELOCITY\n100, 1, 0.5\n100, 6, 2.\n", t_end=3.0)
    deck.card += Deck(step("*BOUNDARY, FIXED\n100, 6, 6\n", t_end=1.0)).card
    deck.card += Deck(step("*BOUNDARY, OP=NEW\n", t_end=1.0)).card
    deck.replace("U, V, RF", "U, V, RF, UR, VR, RM")
    run = run_deck(deck, tmp_path)
    fields, history = run.fields(), run.history
    angle = fields["rotation"][:, 15]
    held = angle[(fields.time > 3.0 - 1e-9)]
    assert np.abs(held - held[0]).max() < 1e-12
    assert held[0] == pytest.approx(6.0, rel=1e-3)
    assert np.abs(history["px"] - history["px"][0]).max() < 1e-12*MASS
    assert balance(history) < 1e-12
    x = fields.x[:15] + fields["displacement"][-1, :15]
    assert shape_error(x, PLACE[:15]) < 1e-13


def test_a_cam_lifts_a_weight(tmp_path):
    """Driven at its pivot or by the rotation of a free body: the moment of a pendulum that is
    held at an angle is m g l sin(angle)."""
    turn = "*BOUNDARY\n100, 1, 2, 0.\n100, 6, 6, 0.75\n*DLOAD\nBODY, GRAV, 9., 0., -1.\n"
    deck = alone(cards=turn, reference=(3.0, 0.5), procedure="*STATIC\n0.25, 1.")
    deck.replace("U, V, RF", "UR3, RM3")
    fields = run_deck(deck, tmp_path).fields()
    assert fields["rotation"][-1, 15] == pytest.approx(0.75, rel=1e-14)
    # the centre is two to the left of the pivot: its weight turns left
    assert fields["reaction_moment"][-1, 15] == pytest.approx(
        -MASS*9.0*2.0*math.cos(0.75), rel=1e-12)


def test_static_turn(tmp_path):
    """A turn by more than a whole one, then on from there, both ways."""
    turn = "*BOUNDARY\n100, 1, 1, 0.5\n100, 2, 2, 0.\n100, 6, 6, {}\n"
    deck = alone(cards=turn.format(7.0), procedure="*STATIC\n0.1, 1.")
    deck.card += Deck(step(turn.format(-1.0), procedure="*STATIC\n0.1, 1.")).card
    run = run_deck(deck, tmp_path)
    fields = run.fields()
    for time, angle in ((1.0, 7.0), (1.5, 3.0), (2.0, -1.0)):
        at = np.argmin(np.abs(fields.time - time))
        ramp = min(1.0, fields.time[at])*0.5
        angle += (-8.0*(fields.time[at] - time) if time > 1.0 else 0.0)
        expected = (PLACE - PLACE[-1]) @ turned(angle).T + PLACE[-1] + (ramp, 0.0)
        assert np.abs(fields.x + fields["displacement"][at] - expected).max() < 256*EPSILON


def test_a_guide_lets_a_body_fall_but_not_turn(tmp_path):
    deck = alone(cards="*BOUNDARY\n100, 1, 1, 0.\n100, 6, 6, 0.\n"
                 "*DLOAD\nBODY, GRAV, 8., 0., -1.\n*CLOAD\n100, 6, 3.\n")
    deck.replace("U, V, RF", "U, RM")
    run = run_deck(deck, tmp_path)
    u = run.fields()["displacement"][-1, :16]
    assert np.abs(u - (0.0, -4.0)).max() < 1e-13*4.0
    # The guide bears what would turn the body.
    assert np.abs(run.fields()["reaction_moment"][1:, 15] + 3.0).max() < 1e-12*3.0
    assert balance(run.history) < 1e-13


# ---- with bodies that deform --------------------------------------------------------------------


def test_tied_and_welded(tmp_path):
    """A rigid base, a block welded to it and one tied: free, spinning, energy and momenta stay."""
    text = grid("ALL", (4, 3), (0, 0), (2, 3), 1) + "*ELSET, ELSET=BASE, GENERATE\n1, 4\n" \
        "*ELSET, ELSET=BLOCK, GENERATE\n5, 12\n" + grid("SIDE", (2, 3), (2, 0), (1, 1), 101) \
        + "*ELSET, ELSET=EDGE\n101, 103, 105\n*NODE, NSET=REF\n100, 1., -1.\n" \
        "*NSET, NSET=WHOLE\nALL, SIDE, REF\n" + section("BASE") \
        + section("BLOCK", ELASTIC) + section("SIDE", ELASTIC) \
        + "*RIGID BODY, ELSET=BASE, REF NODE=100\n*SURFACE, NAME=SLAVE\nEDGE, S4\n" \
        "*SURFACE, NAME=MASTER\n4, S2\n*TIE, NAME=T\nSLAVE, MASTER\n" \
        "*INITIAL CONDITIONS, TYPE=ROTATING VELOCITY\nWHOLE, 2., 0.3, 0.1\n1., 1.\n" + step(t_end=2.0)
    history = {}
    for method in ("NULL SPACE", "SADDLE POINT"):
        deck = Deck(text)
        deck.insert(f"*CONSTRAINT METHOD, TYPE={method}\n", before="*NODE FILE")
        run = run_deck(deck, tmp_path/method[:4])
        history[method] = run.history
        assert balance(run.history) < 1e-12
        for name in ("px", "py", "lz"):
            assert drift(run.history, name) < 1e-12, name
        assert run.history["strain"].max() > 1e-3*run.history["kinetic"].max()
        x = run.fields().x + run.fields()["displacement"][-1]
        assert shape_error(x[:10], run.fields().x[:10]) < 1e-13
    for name in ("kinetic", "strain"):
        one, other = (h[name] for h in history.values())
        assert np.abs(one - other).max() < 1e-9*history["NULL SPACE"]["kinetic"].max(), name


# ---- contact ------------------------------------------------------------------------------------

FORMS = {"nts": "", "segment": ", TYPE=SEGMENT", "mortar": ", TYPE=MORTAR"}


def fall(form="nts", floor="rigid", method="NULL SPACE", scale=(0, 0), tilt=0.0, h=0.01,
         initiation="PERSISTENT"):
    """A rigid block falls on a floor that is fixed. `scale`: powers of 2 of lengths, times."""
    length, time = 2.0**scale[0], 2.0**scale[1]
    text = grid("BLOCK", (4, 2), (-1*length, 0.0625*length), (2*length, length), 1) \
        + grid("FLOOR", (6, 2), (-3*length, -length), (6*length, length), 101) \
        + f"*NODE\n100, 0., {0.5625*length}\n200, 0., {-2.0*length}\n*NSET, NSET=REF\n100,\n" \
        + section("BLOCK") + section("FLOOR", "" if floor == "rigid" else ELASTIC) \
        + "*RIGID BODY, ELSET=BLOCK, REF NODE=100\n" \
        + ("*RIGID BODY, ELSET=FLOOR, REF NODE=200\n" if floor == "rigid" else "") \
        + "*NSET, NSET=SOLE, GENERATE\n101, 107\n*SURFACE, NAME=BLOCK\nBLOCK,\n" \
        "*SURFACE, NAME=FLOOR\nFLOOR,\n*SURFACE INTERACTION, NAME=HARD\n" \
        f"*CONTACT PAIR, INTERACTION=HARD{FORMS[form]}\nBLOCK, FLOOR\n" \
        "*INITIAL CONDITIONS, TYPE=VELOCITY\n" \
        f"100, 2, {-1.0*length/time}\n100, 1, {0.375*length/time}\n100, 6, {tilt/time}\n" \
        + step(("*BOUNDARY\n200, ENCASTRE\n" if floor == "rigid" else "*BOUNDARY\nSOLE, 1, 2\n")
               + f"*DLOAD\nBLOCK, GRAV, {10.0*length/time**2}, 0., -1.\n"
               f"*CONSTRAINT METHOD, TYPE={method}\n*CONTACT INITIATION, TYPE={initiation}\n",
               h=h*time, t_end=time)
    text = text.replace("1000., 0.3", f"{1000.0*(length/time)**2}, 0.3")
    if floor != "rigid":
        text = text.replace(f"200, 0., {-2.0*length}\n", "")
    return Deck(text)


@pytest.mark.parametrize("floor", ["rigid", "elastic"])
@pytest.mark.parametrize("form", FORMS)
def test_flat_on_a_floor(form, floor, tmp_path):
    """Five nodes touch at once, of which a rigid body needs two."""
    run = run_deck(fall(form, floor), tmp_path)
    history = run.history
    assert history["active"].max() >= 2
    assert balance(history) < 1e-12
    if form == "nts" or floor == "rigid":                # integrated gaps are closed in the mean
        assert history["penetration"].max() < 1e-12
    if floor == "rigid":
        assert drift(history, "px") < 1e-12


def split(x, v):
    """The spin of a field of velocities, and the largest velocity beside the rigid motion."""
    arm = x - x.mean(0)
    left = np.stack([-arm[:, 1], arm[:, 0]], 1)
    spin = (left*v).sum()/(arm**2).sum()
    return spin, np.abs(v - v.mean(0) - spin*left).max()


@pytest.mark.each_value
@pytest.mark.parametrize("initiation", ["PERSISTENT", "ADMISSIBLE", "VELOCITY UPDATE", "MASSLESS"])
@pytest.mark.parametrize("floor", ["rigid", "elastic"])
def test_tilted_on_a_floor(initiation, floor, tmp_path):
    run = run_deck(fall(floor=floor, tilt=0.5, initiation=initiation), tmp_path)
    history = run.history
    assert history["active"].max() >= 1
    if initiation != "ADMISSIBLE":                        # closes at once, and takes the energy
        # Newton's method ends at 1e-10 of the forces.
        assert balance(history) < (1e-11 if has_fused_products() else 1e-10)
    fields = run.fields()
    assert shape_error(fields.x[:15] + fields["displacement"][-1][:15], fields.x[:15]) < 1e-13
    # Velocities are those of a rigid motion but for what impacts leave: half the angle of a step
    # times the jump, for each change of the set at most.
    spin, rest = zip(*(split(fields.x[:15] + u[:15], v[:15]) for u, v in
                       zip(fields["displacement"], fields["velocity"])))
    changes = np.count_nonzero(np.diff(history["active"]))
    largest = np.abs(fields["velocity"][:, :15]).max()
    assert max(rest) < changes*0.5*0.01*np.abs(spin).max()*largest


def test_null_space_and_saddle_point_agree(tmp_path):
    runs = [run_deck(fall(floor="elastic", tilt=4.0, method=method), tmp_path/method[:4])
            for method in ("NULL SPACE", "SADDLE POINT")]
    u = [run.fields()["displacement"] for run in runs]
    assert np.abs(u[0] - u[1]).max() < 1e-11*np.abs(u[0]).max()


def test_two_free_rigid_bodies(tmp_path):
    """Neither gives way: what they hand over keeps energy and both momenta."""
    deck = fall(tilt=0.5)
    deck.replace("200, ENCASTRE\n", "")
    deck.replace("*BOUNDARY\n", "")
    deck.replace("200, 0., -2.0", "200, 0., -0.5")
    run = run_deck(Deck("".join(f"{head}\n" + "".join(f"{d}\n" for d in data)
                                for head, data in deck.card if head != "*DLOAD")), tmp_path)
    history = run.history
    assert history["active"].max() >= 1
    assert balance(history) < 1e-12
    for name in ("px", "py", "lz"):
        assert drift(history, name) < 1e-12, name
    assert history["penetration"].max() < 1e-12


def test_powers_of_two_as_units_change_no_bit(tmp_path):
    for k, floor in enumerate(("rigid", "elastic")):
        plain = run_deck(fall(floor=floor, tilt=0.5), tmp_path/f"plain{k}").history
        scaled = run_deck(fall(floor=floor, tilt=0.5, scale=(3, 1)), tmp_path/f"scaled{k}").history
        energy = 2.0**(2*3)*2.0**(2*(3 - 1))              # mass by area, and velocity
        assert (scaled["kinetic"] == energy*plain["kinetic"]).all()
        assert (scaled["newton"] == plain["newton"]).all()


def test_restart_goes_on_with_the_same_bits(tmp_path):
    path = fall(floor="elastic", tilt=0.5, h=0.02).write(tmp_path/"deck.inp")
    with Stepper(path) as whole:
        while not whole.active.any():
            whole.step()
        whole.write_restart(tmp_path/"half.rst.h5")
        with Stepper.from_restart(tmp_path/"half.rst.h5") as rest:
            for _ in range(15):
                whole.step()
                rest.step()
            assert (rest.u == whole.u).all() and (rest.v == whole.v).all()
            assert rest.ledger == whole.ledger


@pytest.mark.parametrize("method", ["NULL SPACE", "SADDLE POINT"])
def test_pressed_on_a_block(method, tmp_path):
    """In statics: the force and the moment on the reference node come out below."""
    deck = fall(floor="elastic", method=method)
    deck.remove("*DLOAD")
    deck.remove("*INITIAL CONDITIONS")
    deck.remove("*CONTACT INITIATION")
    deck.replace("*DYNAMIC, DIRECT\n0.01, 1.0", "*STATIC\n0.25, 1.")
    deck.move_nodes(lambda label, x, y: (x, y - 0.0625 if label <= 100 else y))
    deck.insert("*BOUNDARY\n100, 1\n*CLOAD\n100, 2, -30.\n100, 6, -3.\n", before="*NODE FILE")
    run = run_deck(deck, tmp_path)
    fields = run.fields()
    reaction = fields["reaction_force"][-1]
    below = reaction[15:22]
    assert below[:, 1].sum() == pytest.approx(30.0, rel=1e-9)
    assert below[:, 0].sum() == pytest.approx(-reaction[36, 0], abs=1e-9*30.0)
    assert run.history["penetration"].max() < 1e-12
    x = fields.x + fields["displacement"][-1]
    moment = (x[15:22, 0]*below[:, 1] - x[15:22, 1]*below[:, 0]).sum()
    assert moment == pytest.approx(3.0 + 0.0, rel=0.05)


# ---- the package --------------------------------------------------------------------------------


def test_model_in_python(tmp_path):
    """The wrapper writes the cards, and a rigid body steps with energies and momenta as others."""
    model = Model()
    model.add_nodes(PLACE)
    model.add_elements([(i + 5*j, 1 + i + 5*j, 6 + i + 5*j, 5 + i + 5*j)
                        for j in range(2) for i in range(4)], name="BODY")
    model.material("M", density=1.0).section("M", "BODY").rigid_body("BODY", 15)
    model.rotating(15, 2.0, velocity=(0.5, 0.0), about=(1.0, 0.5))
    model.step("DYNAMIC", 0.05, 1.0, direct=True, nlgeom=True)
    with Stepper(model) as stepper:
        start = stepper.ledger
        for _ in range(20):
            stepper.step()
        assert stepper.ledger["total"] == pytest.approx(start["total"], rel=1e-12)
        assert start["kinetic"] == pytest.approx(0.5*MASS*0.25 + 0.5*INERTIA*4.0, rel=1e-12)
