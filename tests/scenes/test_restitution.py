"""Impacts that keep a part of their velocity: `*SURFACE INTERACTION, RESTITUTION=`."""

import math

import numpy as np
import pytest
from plain_scenes import BOTH, ONE, Scene
from scene_tools import Deck, run_deck

from emcon import Stepper


def balance(history):
    total = history["total"] - history["contact_work"]
    return np.abs(total - total[0]).max()/(history["kinetic"] + history["strain"]).max()


def with_restitution(deck, e, cards=""):
    deck.replace("*SURFACE INTERACTION, NAME=SMOOTH",
                 f"{cards}*SURFACE INTERACTION, NAME=SMOOTH, RESTITUTION={e}")
    return deck


# ---- two bodies ---------------------------------------------------------------------------------


def discs(e, off=0.0, rigid="AB", velocity=(1.0, -0.5), spin=0.0, sides=ONE):
    """Two discs, the second twice as heavy and `off` the line of the first one's centre."""
    scene = Scene(0.02, 0.7)
    cards = ""
    for k, (name, x, y) in enumerate((("A", -0.6, 0.0), ("B", 0.6, off))):
        turn = spin*(1 - k)
        scene.disc(name, (x, y), 0.5, (4, 2), velocity=(velocity[k], 0), spin=turn, density=k + 1.0)
        if name in rigid:
            cards += (f"*NODE\n{9000 + k}, {x}, {y}\n*RIGID BODY, ELSET={name}, REF NODE={9000 + k}\n"
                      f"*INITIAL CONDITIONS, TYPE=ROTATING VELOCITY\n{9000 + k}, {turn}, "
                      f"{velocity[k]}, 0.\n{x}, {y}\n")
    scene.pairs = [("A", "B")]
    return with_restitution(scene.deck(sides), e, cards)


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("initiation", ["PERSISTENT", "VELOCITY UPDATE", "MASSLESS"])
def test_rigid_discs_head_on(e, initiation, tmp_path):
    """They part at e times the rate at which they met; what goes is that of the reduced mass."""
    run = run_deck(discs(e), tmp_path, formulation="NODE TO SURFACE", initiation=initiation)
    _, momentum = run.series("BODIES", "MOMENTUM")
    first = momentum[:, 0, 0]
    mass = np.array([1.0, 2.0])*first[0]             # of A at a velocity of 1, B twice as heavy
    v = momentum[:, :2, 0]/mass
    assert v[-1, 1] - v[-1, 0] == pytest.approx(e*(v[0, 0] - v[0, 1]), abs=1e-12*1.5)
    history = run.history
    loss = 0.5*mass.prod()/mass.sum()*1.5**2*(1 - e**2)
    assert history["restitution_loss"][-1] == pytest.approx(loss, abs=1e-12*loss + 1e-15)
    assert history["contact_work"][-1] == pytest.approx(-loss, abs=1e-12)
    assert balance(history) < 1e-12
    for name in ("px", "py", "lz"):
        assert np.abs(history[name] - history[name][0]).max() < 1e-12*mass[0], name
    push = history["pair1_impulse_x"][-1]
    assert abs(push) == pytest.approx(abs(first[-1] - first[0]), rel=1e-12)


@pytest.mark.parametrize(("rigid", "formulation", "sides", "initiation"), [
    ("AB", "NODE TO SURFACE", BOTH, "PERSISTENT"), ("AB", "MORTAR", ONE, "PERSISTENT"),
    ("A", "NODE TO SURFACE", BOTH, "MASSLESS"), ("", "NODE TO SURFACE", BOTH, "PERSISTENT"),
    ("", "SEGMENT", ONE, "VELOCITY UPDATE"), ("", "MORTAR", ONE, "PERSISTENT")])
def test_off_the_centre_momenta_stay(rigid, formulation, sides, initiation, tmp_path):
    run = run_deck(discs(0.25, off=0.3, rigid=rigid, spin=0.5, sides=sides), tmp_path,
                   formulation=formulation, initiation=initiation)
    history = run.history
    assert history["restitution_loss"][-1] > 0
    assert (np.diff(history["restitution_loss"]) >= 0).all()
    assert balance(history) < 1e-12
    scale = np.abs(history["lz"]).max() + np.abs(history["px"]).max()
    for name in ("px", "py", "lz"):
        assert np.abs(history[name] - history[name][0]).max() < 1e-12*scale, name


# ---- on a plane ---------------------------------------------------------------------------------


def dropped(e, t_end, h=0.01, tilt=0.0, slide=0.0, lift=0.0, weight=8.0, unit=(1.0, 1.0)):
    """A rigid square of side 1 on a plane that moves by `lift`; `unit`: of length and time."""
    length, time = unit
    c, s = (round(2**20*value)/2**20 for value in (math.cos(tilt), math.sin(tilt)))
    nodes = "\n".join(f"{k + 1}, {length*(c*x - s*y)!r}, {length*(1.75 + s*x + c*y)!r}" for k, (x, y)
                      in enumerate(((-.5, -.5), (.5, -.5), (.5, .5), (-.5, .5))))
    ground = "10, 1\n10, 6\n" + ("" if lift else "10, 2\n")
    drive = f"*BOUNDARY, AMPLITUDE=TIME\n10, 2, 2, {lift*length/time!r}\n" if lift else ""
    speed = f"*INITIAL CONDITIONS, TYPE=VELOCITY\n9, 2, {slide*length/time!r}\n" if slide else ""
    load = f"*DLOAD\nBODY, GRAV, {weight*length/time**2!r}, 0., -1.\n" if weight else ""
    return Deck(f"""*HEADING
A square dropped on a plane
*NODE, NSET=BODY
{nodes}
*NODE
9, 0., {1.75*length!r}
10, 0., {-5.0*length!r}
*ELEMENT, TYPE=CPE4, ELSET=BODY
1, 1, 2, 3, 4
*MATERIAL, NAME=M
*DENSITY
{1.0/length**3!r}
*SOLID SECTION, ELSET=BODY, MATERIAL=M
{length!r}
*RIGID BODY, ELSET=BODY, REF NODE=9
*SURFACE, NAME=BODY
BODY, S1
*SURFACE, NAME=GROUND, TYPE=SEGMENTS
START, {-10.0*length!r}, 0.
LINE, {10.0*length!r}, 0.
*RIGID BODY, ANALYTICAL SURFACE=GROUND, REF NODE=10
*SURFACE INTERACTION, NAME=SMOOTH, RESTITUTION={e!r}
*CONTACT PAIR, INTERACTION=SMOOTH, SIDES=ONE
BODY, GROUND
*BOUNDARY
{ground}*AMPLITUDE, NAME=TIME
0., 0., {100*time!r}, 100.
{speed}*STEP, NLGEOM, INC=1000000
*DYNAMIC, DIRECT
{h*time!r}, {t_end*time!r}
{drive}{load}*NODE FILE
U
*END STEP
""")


@pytest.mark.parametrize("e", [0.0, 0.5, 0.8])
def test_flat_on_a_plane(e, tmp_path):
    """Two corners at once: e of the velocity, e^2 of the height, and at last rest."""
    history = run_deck(dropped(e, 4.0, h=0.005), tmp_path).history
    p = history["py"]
    first = np.argmax(history["active"] > 0)
    assert p[first] == pytest.approx(-e*p[first - 1], abs=1e-12)
    assert balance(history) < 1e-12
    height = 1.25 - history["external_work"]/8.0              # above the plane, by what gravity did
    top = height[1:-1][(height[1:-1] > height[:-2]) & (height[1:-1] >= height[2:])][:2]
    # A contact begins within an increment of the way there; e = 0 stays there.
    assert np.abs(top - np.array([1.25*e**2, 1.25*e**4])).max() < math.sqrt(2*8.0*1.25)*0.005*2
    if e <= 0.5:
        assert history["kinetic"][-1] < 1e-20
        assert history["active"][-1] > 0


def test_on_a_corner(tmp_path):
    """The push of the first contact is (1 + e) v / (1/m + a^2/I), a the arm of the corner."""
    e, tilt, h = 0.5, 0.3, 0.002
    history = run_deck(dropped(e, 1.0, h=h, tilt=tilt, weight=0.0, slide=-2.0), tmp_path).history
    corner = np.array([[math.cos(tilt), -math.sin(tilt)], [math.sin(tilt), math.cos(tilt)]]) \
        @ np.array([-0.5, -0.5])
    inertia = 1.0/6.0
    push = (1 + e)*2.0/(1.0 + corner[0]**2/inertia)
    first = np.argmax(history["active"] > 0)
    spin = push*abs(corner[0])/inertia
    assert history["py"][first] - history["py"][0] == pytest.approx(push, rel=spin*h)
    assert balance(history) < 1e-12


def test_it_is_the_same_on_a_plane_that_moves(tmp_path):
    """What an impact takes does not depend on who looks; the plane's work is external."""
    loss = [run_deck(dropped(0.5, 1.0, weight=0.0, slide=-2.0 + lift, lift=lift),
                     tmp_path/str(lift)).history for lift in (0.0, 0.75)]
    assert loss[0]["restitution_loss"][-1] == pytest.approx(0.5*2.0**2*0.75, rel=1e-12)
    assert loss[1]["restitution_loss"][-1] == pytest.approx(loss[0]["restitution_loss"][-1],
                                                            rel=1e-9)
    assert balance(loss[1]) < 1e-12


def test_powers_of_two_as_units_change_no_bit(tmp_path):
    length, time = 2.0**12, 2.0**-7
    plain, other = (run_deck(dropped(0.5, 1.0, tilt=0.25, unit=unit), tmp_path/str(k)).history
                    for k, unit in enumerate(((1.0, 1.0), (length, time))))
    energy = length**2/time**2
    assert plain["restitution_loss"][-1] > 0
    for name in ("kinetic", "restitution_loss", "contact_work"):
        assert (other[name] == energy*plain[name]).all(), name


def test_restart_goes_on_with_the_same_bits(tmp_path):
    with Stepper(dropped(0.5, 0.8, tilt=0.25).write(tmp_path/"deck.inp")) as whole:
        while not whole.ledger["restitution_loss"] > 0:
            whole.step()
        whole.write_restart(tmp_path/"half.rst.h5")
        with Stepper.from_restart(tmp_path/"half.rst.h5") as rest:
            for _ in range(15):
                whole.step()
                rest.step()
            assert (rest.u == whole.u).all() and (rest.v == whole.v).all()
            assert rest.ledger == whole.ledger
