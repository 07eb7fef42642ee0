"""`*FRICTION`: Coulomb's law for nodes on edges, with what it takes in the ledger."""

import math
import re

import friction_scenes
import numpy as np
import pytest
from friction_scenes import (
    NODES,
    WEIGHT,
    G,
    balance,
    belt_way,
    block_on_floor,
    make_rigid,
    on_spring,
    partial_slip,
    polygon,
    pressed,
    pressed_round,
    pressed_sideways,
    rolling,
    rolling_polygon,
    rubbing,
    way,
)
from plain_scenes import BOTH, ONE, Scene
from plate_alone import displacements
from scene_tools import DECKS, Deck, coarse_ring, run_deck, run_one_sided
from test_contact_output import restart
from test_segments import with_profile

EPS = np.finfo(float).eps


def obeys(run, scale=0.0, law=1e-9, overlaps=False):
    """Energy is lost to friction alone, in no step made by it, and its law holds; with `overlaps`
    bodies may, as nodes of one side do, and means of gaps."""
    history = run.history
    assert balance(history, scale) < 1e-12
    # Forces by slips that are rounded to 16 epsilon of an edge.
    assert (np.diff(history["friction_loss"]) >= -1e-15*max(scale, history["kinetic"].max())).all()
    pairs = [name for name in history.dtype.names if name.endswith("_friction_loss")]
    assert np.allclose(sum(history[name] for name in pairs), history["friction_loss"],
                       rtol=1e-13, atol=1e-13*scale)
    assert run.verdict["law_violation"] <= law
    assert run.verdict["friction_loss"] == pytest.approx(history["friction_loss"][-1], rel=1e-8,
                                                         abs=1e-13*scale)
    if overlaps:
        assert all(reason.startswith("bodies overlap") for reason in run.verdict["reasons"])
    else:
        assert run.verdict["verdict"] == "good"


def keeps_momenta(run):
    for name in ("px", "py", "lz"):
        change = np.abs(run.history[name] - run.history[name][0]).max()
        assert change < 1e-13*np.abs(run.history["lz"][0])


# ---- sliding to rest ----------------------------------------------------------------------------


@pytest.mark.each_value
@pytest.mark.parametrize("cells", [(4, 2), (8, 4)])
@pytest.mark.parametrize("h", [0.02, 0.01, 0.005, 0.0025])
def test_a_damped_block_slides_to_rest(h, cells, tmp_path):
    """That of a rigid one, but for its shear: F H/(3 G A) = 1.3e-4 in the distance."""
    run = run_deck(block_on_floor(h, 0.72, 0.3, v0=2.0, eta=2e-3, cells=cells), tmp_path, **NODES)
    obeys(run)
    assert way(run, (cells[0] + 1)*(cells[1] + 1))[-1] == pytest.approx(2/3, abs=2e-4)
    assert run.history["newton"].max() <= 6 and run.history["cuts"].sum() == 0


@pytest.mark.parametrize(("rebound", "exact"), [(0, 0.66670), (0.5, 0.66665), (1, 0.66665)])
def test_restitution_of_friction(rebound, exact, tmp_path):
    """With 0.02 left of the velocity for the last increment that slides it goes on by 1e-4 times
    1 - RESTITUTION if it sticks; with 0.01 lost beyond zero friction is all that there may be."""
    deck = block_on_floor(0.01, 0.68, 0.3, v0=2.0, rigid=True)
    deck.replace("*FRICTION", f"*FRICTION, RESTITUTION={rebound}")
    run = run_deck(deck, tmp_path, **NODES)
    obeys(run)
    at_rest = np.argmin(abs(run.history["time"] - 0.67))
    assert way(run, 15)[at_rest] == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("cells", [(1, 1), (4, 2)])
@pytest.mark.parametrize("h", [0.02, 0.01, 0.005])
def test_a_rigid_block_slides_to_rest(h, cells, tmp_path):
    """Whole steps lose mu g h; in the last one the velocity ends, so that its mean is half. However
    many nodes bear: what they say of each other is dropped."""
    run = run_deck(block_on_floor(h, 0.72, 0.3, v0=2.0, rigid=True, cells=cells), tmp_path, **NODES)
    obeys(run)
    n = math.floor(2.0/(3.0*h) + 1e-9)
    left = 2.0 - n*3.0*h
    moved = way(run, (cells[0] + 1)*(cells[1] + 1))[-1]
    assert moved == pytest.approx(n*h*(2.0 - 0.5*n*3.0*h) + 0.5*h*left, rel=1e-9)
    assert abs(moved - 2/3) <= 3.0*h**2/8 + 1e-9
    assert run.history["newton"].max() <= 8 and run.history["cuts"].sum() == 0


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
def test_a_block_slides_to_rest_on_a_profile(formulation, tmp_path):
    """A rigid surface of lines; three of them, so that nodes pass from one to the next."""
    scene = Scene(0.01, 0.72, gravity=10.0)
    scene.block("BODY", (0, 0), (2, 1), (4, 2), stiffness=2e4, velocity=(2.0, 0))
    deck = with_profile(scene, "START, -3., 0.\nLINE, 0.7, 0.\nLINE, 2.2, 0.\nLINE, 6., 0.")
    rubbing(deck, 0.3).replace("*MATERIAL, NAME=BODY", "*MATERIAL, NAME=BODY\n*DAMPING, BETA=2e-3")
    run = run_deck(deck, tmp_path, formulation=formulation)
    obeys(run)
    assert way(run, 15)[-1] == pytest.approx(2/3, abs=2e-4)
    assert run.history["newton"].max() <= 6 and run.history["cuts"].sum() == 0


@pytest.mark.parametrize("kinematics", ["LINEAR", "COROTATED"])
def test_a_block_of_small_strains_slides_to_rest(kinematics, tmp_path):
    deck = block_on_floor(0.01, 0.72, 0.3, v0=2.0, eta=2e-3)
    deck.replace("*SOLID SECTION, ELSET=FLOOR, MATERIAL=FLOOR",
                 f"*SOLID SECTION, ELSET=FLOOR, MATERIAL=FLOOR, KINEMATICS={kinematics}")
    run = run_deck(deck, tmp_path, **NODES)
    obeys(run)
    assert way(run, 15)[-1] == pytest.approx(2/3, abs=2e-4)


# ---- stick and slip -----------------------------------------------------------------------------


def test_an_elastic_block_sticks(tmp_path):
    """Below the limit all nodes stick; gravity comes at once, so that it bounces in place."""
    run = run_deck(block_on_floor(0.02, 1.0, 0.5, push=3.0, eta=5e-3), tmp_path, **NODES)
    obeys(run)
    assert np.abs(way(run, 5)).max() < 1e-3


@pytest.mark.each_value
@pytest.mark.parametrize("cells", [(1, 1), (2, 1), (4, 2)])
@pytest.mark.parametrize("push", [0.49, 0.499, 0.501, 0.51])
def test_a_rigid_block_that_is_pushed(push, cells, tmp_path):
    """Three conditions of a body of three freedoms: one node slides and the other one holds."""
    deck = block_on_floor(0.01, 0.5, 0.5, push=10.0*push, rigid=True, cells=cells)
    run = run_deck(deck, tmp_path, **NODES)
    obeys(run, scale=WEIGHT)
    moved = way(run, (cells[0] + 1)*(cells[1] + 1))[-1]
    assert moved == pytest.approx(0.5*0.5**2*10.0*max(0.0, push - 0.5), rel=1e-6, abs=1e-11)
    assert run.history["cuts"].sum() == 0


@pytest.mark.parametrize("mu", [0.49, 0.50, 0.51])
def test_a_rigid_block_on_a_slope(mu, tmp_path):
    slope = -math.atan(0.5)
    run = run_deck(block_on_floor(0.01, 0.5, mu, slope=slope, rigid=True), tmp_path, **NODES)
    obeys(run, scale=WEIGHT)
    moved = way(run, 15, slope)[-1]
    exact = 0.5*0.5**2*10.0*math.cos(slope)*max(0.0, 0.5 - mu)
    assert moved == pytest.approx(exact, rel=1e-6, abs=1e-11)


# ---- sliding and rolling ------------------------------------------------------------------------


@pytest.mark.parametrize("inner", [0.95, 0.05])
def test_what_is_thrown_rolls(inner, tmp_path):
    """A ring keeps half of its velocity, a disc two thirds: what it turns about is the node that it
    slides on, so that its angular momentum about that node stays. The node is vertically below
    the middle but for the way gone, v t = 1e-4, through which the weight turns the ring."""
    v0, mu = 0.02, 0.3
    run = run_deck(rolling(inner, 2.5e-4, 4e-3, mu, v0), tmp_path, **NODES)
    obeys(run)
    (outside, turning), (hole, lost) = polygon(1.0), polygon(inner)
    mass, inertia = outside - hole, turning - lost
    time, v = run.history["time"], run.history["px"]/mass
    slides = time < v0*(1 - 1/(1 + inertia/mass))/(10.0*mu) - 1e-9
    # In half a millimetre of turn the node stands off by so much: mu and the lever change by it.
    turned = 1e-4
    assert v[slides] == pytest.approx(v0 - 10.0*mu*time[slides], rel=4*turned)
    assert v[-1]/v0 == pytest.approx(1/(1 + inertia/mass), rel=4*turned)


@pytest.mark.parametrize(("sides", "turn"), [(12, 0.0), (16, 0.1), (24, 0.1)])
def test_a_polygon_rolls_from_corner_to_corner(sides, turn, tmp_path):
    """Two corners of a rigid body that stick depend on each other: the slip of one follows until the
    set changes, also where the set is left before the step is solved with it."""
    run = run_deck(rolling_polygon(sides, turn, 0.5), tmp_path)
    obeys(run, law=1e-12)


# ---- stick-slip ---------------------------------------------------------------------------------


def test_stick_slip_on_a_belt(tmp_path):
    """Second order, through slip, stick and slip."""
    error = []
    for h in (0.02, 0.01, 0.005):
        time, x, _ = on_spring(h, 1.4, 0.3, tmp_path, stiffness=25.0, belt=0.3)
        error.append(np.abs(x - belt_way(time, 0.3, 25.0, 0.3)).max())
    order = np.log2(np.array(error[:-1])/error[1:])
    assert (order > 1.7).all(), (error, order)
    assert error[-1] < 1e-3*0.12


def test_a_block_pulled_against_a_spring(tmp_path):
    """code_aster's SDNV104: half a swing about (F - mu N)/k, and half a swing back about
    (F + mu N)/k: 14.917 at 1.70, 3.5 at 3.39."""
    pull, k = 200.0/7.0, 24.0/7.0
    time, x, energies = on_spring(0.01, 3.4, 0.3, tmp_path, pull=pull, stiffness=k)
    half = math.pi/math.sqrt(k)
    assert np.interp(half, time, x) == pytest.approx(2*(pull - 3)/k, rel=1e-3)
    assert np.interp(2*half, time, x) == pytest.approx(3.5, rel=1e-2)
    path = 2*(pull - 3)/k + (2*(pull - 3)/k - 3.5)
    assert energies["friction_loss"] == pytest.approx(2*3*path, rel=1e-2)


# ---- statics ------------------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
def test_statics_stick_and_slide(formulation, tmp_path):
    """A block moved by little sticks, and its force is linear in the way; moved by much all of it
    slides, with mu times the pressure. Null space and saddle point to the same digits. Where slip is
    held it is held to some ten roundings of the shift, and forces work on that."""
    force = {}
    for shift in (0.001, 0.002, 0.05):
        runs = [run_deck(pressed(shift, 0.5), tmp_path/f"{shift}{method[0]}", method=method,
                         formulation=formulation) for method in ("NULL SPACE", "SADDLE POINT")]
        history = runs[0].history
        force[shift] = np.array([history["pair1_force_x"][-1], history["pair1_force_y"][-1]])
        for run in runs:
            assert run.verdict["verdict"] == "good" and run.verdict["law_violation"] < 1e-9
            assert run.history["newton"].max() <= 8 and run.history["cuts"].sum() == 0
            lost = np.diff(run.history["friction_loss"])
            assert (lost >= -16*EPS*shift*np.abs(run.history["pair1_force_x"]).max()).all()
            assert run.history["pair1_force_x"][-1] == pytest.approx(force[shift][0], rel=1e-10)
    assert force[0.002][0] == pytest.approx(2*force[0.001][0], rel=1e-2)
    # Where nodes hold the floor is straight; mean gaps leave edges tilted by a part of the strain.
    rel = 1e-10 if formulation == "NODE TO SURFACE" else 0.01
    assert -force[0.05][0] == pytest.approx(0.5*force[0.05][1], rel=rel)
    assert run.history["friction_loss"][-1] > 0


def test_fields_of_what_rubs(tmp_path):
    """On a floor that is held slip is how far nodes have gone; shear is mu times the pressure where
    they slide and less where they stick; to and fro, the path is longer than the way."""
    deck = pressed(0.02, 0.2)
    deck.replace("CDIS, CSTR, CF", "CSTR, CSHEAR, CSLIP")
    deck.replace("0., 0., 1.0, 1.", "0., 0., 0.6, 2.5, 1.0, 1.")
    run = run_deck(deck, tmp_path, **NODES)
    fields = run.fields()
    bears = (fields["contact_status"] > 0).any(axis=0)
    assert bears.sum() == 9
    status = fields["contact_status"][1:, bears]
    assert (status == 1).any() and (status == 2).any() and (status > 0).all()
    shear, pressure = fields["contact_shear"][1:, bears], fields["contact_pressure"][1:, bears]
    slides = status == 2
    assert np.abs(shear[slides]) == pytest.approx(0.2*pressure[slides], rel=1e-9)
    assert (np.abs(shear[~slides]) <= 0.2*pressure[~slides]*(1 + 1e-9)).all()
    slip, path = fields["contact_slip"][:, bears], fields["slip_path"][:, bears]
    way = fields["displacement"][:, bears, 0]
    assert np.abs(np.abs(slip) - np.abs(way)).max() < 1e-12
    assert np.allclose(path[1:], np.cumsum(np.abs(np.diff(way, axis=0)), axis=0), atol=1e-12)
    assert (path[-1] > np.abs(slip[-1]) + 1e-6).any()


@pytest.mark.parametrize("floor", [11, 16])
def test_statics_of_both_sides(floor, tmp_path):
    """Nodes of both sides, between each other or face to face, where half of them say nearly what
    the others do: as of one side, but for the mesh; where all slide mu bounds the whole force, but
    for the tilt of the surface, a part of the strain."""
    for shift in (0.002, 0.05):
        force = {}
        for sides in (ONE, BOTH):
            run = run_deck(pressed(shift, 0.5, sides, floor), tmp_path/f"{shift}{sides}", **NODES)
            history = run.history
            assert run.verdict["verdict"] == "good" and run.verdict["law_violation"] < 1e-9
            assert (np.diff(history["friction_loss"]) >= -1e-18).all()
            assert history["cuts"].sum() == 0
            force[sides] = np.array([history["pair1_force_x"][-1], history["pair1_force_y"][-1]])
        assert force[BOTH] == pytest.approx(force[ONE], rel=0.02)
        if shift == 0.05:
            assert -force[BOTH][0] == pytest.approx(0.5*force[BOTH][1], rel=0.01)


@pytest.mark.parametrize("steps", [1, 4])
def test_a_plate_pressed_sideways(steps, tmp_path):
    """code_aster's SSNV128, displacements at the floor: part of it sticks, part slides, and
    how many increments there are is the same. At the fifth place 15.0 is given, where code_aster
    has 15.6."""
    deck, place = pressed_sideways(32)
    run = run_deck(deck, tmp_path, **NODES, h=1.0/steps)
    history = run.history
    assert run.verdict["verdict"] == "good" and run.verdict["law_violation"] <= 1e-9
    assert history["cuts"].sum() == 0 and (np.diff(history["friction_loss"]) >= 0).all()
    u = run.fields()["displacement"][-1, :len(place), 0]
    seen = [u[(abs(place[:, 0] - x) < 1e-9) & (place[:, 1] < 1e-9)].item()*1e6
            for x in (0, 0.00125, 0.005, 0.0075, 0.01125)]
    assert seen[:4] == pytest.approx([28.6, 27.2, 22.8, 19.8], rel=0.01)
    assert seen[4] == pytest.approx(15.0, rel=0.05)
    # The top is pressed by 2e6, of which the node held in the corner bears 2.6 per cent.
    assert history["pair1_force_y"][-1] == pytest.approx(2e6, rel=0.03)


def test_a_plate_as_it_is_outside_the_program(tmp_path):
    """The same of a linear plate and by one in numpy, which knows nothing of the program: to what
    rounding does to the matrix of a plate, whose condition is some ten times the square of twice
    its elements along a side."""
    n, places = 32, (0, 0.00125, 0.005, 0.0075, 0.01125)
    deck, place = pressed_sideways(n)
    deck.replace("ELSET=PLATE, MATERIAL=PLATE", "ELSET=PLATE, MATERIAL=PLATE, KINEMATICS=LINEAR")
    run = run_deck(deck, tmp_path, **NODES)
    u = run.fields()["displacement"][-1, :len(place), 0]
    seen = [u[(abs(place[:, 0] - x) < 1e-9) & (place[:, 1] < 1e-9)].item()*1e6 for x in places]
    assert seen == pytest.approx(displacements(n, False, places), rel=10*(2*n)**2*EPS)


def test_partial_slip(tmp_path):
    """Cattaneo and Mindlin: a strip sticks whose width by that in contact is sqrt(1 - Q/(mu P)), to
    one distance of nodes, until all slides."""
    deck, place = pressed_round(64, layers=10)
    run = run_deck(deck, tmp_path, **NODES)
    assert run.verdict["verdict"] == "good" and run.verdict["law_violation"] <= 1e-9
    assert run.history["cuts"].sum() == 0
    force, width, strip = partial_slip(run, place).T
    part = force < 0.98
    assert part.sum() >= 7 and width[part].min() < 0.2
    assert (np.abs(width - np.sqrt(1 - force))[part] < strip[part]).all()
    assert (width[~part] == 0).all() and force[~part] == pytest.approx(1, abs=0.01)


def test_what_is_rough_does_not_slide(tmp_path):
    """Pushed along by more than any coefficient of use would hold: no node slides, and none moves on
    the floor, as with a very large one."""
    runs = []
    for card in ("*FRICTION, ROUGH", "*FRICTION\n1e3"):
        deck = pressed(0.05, 0.5)
        deck.replace("*FRICTION\n0.5", card)
        deck.replace("CDIS, CSTR, CF", "CSTR, CSHEAR, CSLIP")
        runs.append(run_deck(deck, tmp_path/str(len(runs)), **NODES))
        fields = runs[-1].fields()
        assert (fields["contact_status"] == 1).any() and not (fields["contact_status"] == 2).any()
        assert fields["slip_path"].max() < 16*EPS*0.05*10
        assert runs[-1].verdict["verdict"] == "good"
    assert runs[0].digits() == runs[1].digits()


# ---- the ring -----------------------------------------------------------------------------------


def ring(mu):
    """On fewer elements than in the book."""
    return friction_scenes.ring(mu, coarse_ring())


def assert_same_part(runs):
    """Friction takes its part of the first run, whose beginning the second one is: the half in which
    bodies come together, and most is lost."""
    whole, part = (run.history for run in runs)
    assert whole["friction_loss"][-1] > 0.05*whole["kinetic"][0]
    assert part["friction_loss"][-1] > 0.5*whole["friction_loss"][-1]
    for name in ("kinetic", "friction_loss", "strain"):
        assert np.allclose(whole[name][:len(part)], part[name], rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("mu", [0.2, 0.8])
def test_a_ring_keeps_momenta_and_pays_for_friction(mu, tmp_path):
    runs = [run_deck(ring(mu), tmp_path/method, **NODES, h=0.02, t_end=t_end, method=method)
            for method, t_end in (("NULL SPACE", 0.6), ("SADDLE POINT", 0.3))]
    for run in runs:
        obeys(run)
        keeps_momenta(run)
    assert_same_part(runs)
    assert (runs[0].history["newton"][:len(runs[1].history)] == runs[1].history["newton"]).all()


@pytest.mark.parametrize("more", [{"sides": "BOTH"}, {"initiation": "ADMISSIBLE"}])
def test_a_ring_held_in_other_ways(more, tmp_path):
    run = run_deck(ring(0.8), tmp_path, **NODES, h=0.01, t_end=0.3, **more)
    obeys(run)


@pytest.mark.each_value
@pytest.mark.parametrize("more", [{"formulation": "SEGMENT"}, {"formulation": "MORTAR"},
                                  {"formulation": "MORTAR", "integration": "ELEMENTS"},
                                  {"formulation": "MORTAR", "multiplier": "STANDARD"}])
@pytest.mark.parametrize("mu", [0.2, 0.8])
def test_a_ring_by_integrated_gaps(mu, more, tmp_path):
    """Slips of points on edges, in their means: momenta, energy and law as of nodes."""
    runs = [run_deck(ring(mu), tmp_path/method, h=0.02, t_end=t_end, method=method, **more)
            for method, t_end in (("NULL SPACE", 0.6), ("SADDLE POINT", 0.3))]
    for run in runs:
        obeys(run)
        keeps_momenta(run)
    assert_same_part(runs)


# ---- integrated gaps ----------------------------------------------------------------------------


INTEGRATED = [{"formulation": "SEGMENT"}, {"formulation": "MORTAR"},
              {"formulation": "MORTAR", "normal": "EDGE"},
              {"formulation": "MORTAR", "integration": "ELEMENTS"}]


@pytest.mark.parametrize("more", INTEGRATED)
def test_a_rigid_block_slides_to_rest_by_integrated_gaps(more, tmp_path):
    """The way of nodes, to round-off: on a flat floor all points slide as their nodes."""
    h = 0.02
    run = run_deck(block_on_floor(h, 0.72, 0.3, v0=2.0, rigid=True), tmp_path, **more)
    obeys(run)
    n = math.floor(2.0/(3.0*h) + 1e-9)
    left = 2.0 - n*3.0*h
    assert way(run, 15)[-1] == pytest.approx(n*h*(2.0 - 0.5*n*3.0*h) + 0.5*h*left, rel=1e-9)


@pytest.mark.each_value
@pytest.mark.parametrize("more", INTEGRATED)
@pytest.mark.parametrize("push", [0.499, 0.501])
def test_a_rigid_block_pushed_by_integrated_gaps(push, more, tmp_path):
    run = run_deck(block_on_floor(0.01, 0.5, 0.5, push=10.0*push, rigid=True), tmp_path, **more)
    obeys(run, scale=WEIGHT)
    moved = way(run, 15)[-1]
    assert moved == pytest.approx(0.5*0.5**2*10.0*max(0.0, push - 0.5), rel=1e-6, abs=1e-11)


@pytest.mark.parametrize("more", INTEGRATED)
def test_a_rigid_block_on_a_slope_by_integrated_gaps(more, tmp_path):
    slope = -math.atan(0.5)
    for mu in (0.49, 0.51):
        run = run_deck(block_on_floor(0.01, 0.5, mu, slope=slope, rigid=True), tmp_path/f"{mu}",
                       **more)
        obeys(run, scale=WEIGHT)
        exact = 0.5*0.5**2*10.0*math.cos(slope)*max(0.0, 0.5 - mu)
        assert way(run, 15, slope)[-1] == pytest.approx(exact, rel=1e-6, abs=1e-11)


@pytest.mark.parametrize("more", INTEGRATED)
def test_a_damped_block_slides_to_rest_by_integrated_gaps(more, tmp_path):
    run = run_deck(block_on_floor(0.01, 0.72, 0.3, v0=2.0, eta=2e-3), tmp_path, **more)
    obeys(run)
    assert way(run, 15)[-1] == pytest.approx(2/3, abs=2e-4)
    assert run.history["newton"].max() <= 6 and run.history["cuts"].sum() == 0

# ---- a surface with itself ----------------------------------------------------------------------


@pytest.mark.parametrize("more", [{"sides": "BOTH", **NODES}, {"formulation": "MORTAR"},
                                  pytest.param({"sides": "ONE", **NODES}, marks=pytest.mark.long),
                                  pytest.param({"formulation": "SEGMENT"}, marks=pytest.mark.long)])
def test_a_strip_that_rubs_itself(more, tmp_path):
    """The hairpin whose legs fly together: momenta, energy and law; null space and saddle point."""
    deck = rubbing(Deck.read(DECKS / "self_contact.inp"), 0.5, "FRICTIONLESS")
    runs = [run_one_sided(deck, tmp_path/method, t_end=0.6, method=method, **more)
            for method in ("NULL SPACE", "SADDLE POINT")]
    for run in runs:
        obeys(run, overlaps=more.get("sides") != "BOTH")
        keeps_momenta(run)
        assert run.history["friction_loss"][-1] > 1e-4*run.history["kinetic"][0]
    for name in ("kinetic", "friction_loss", "strain"):
        assert np.allclose(runs[0].history[name], runs[1].history[name], rtol=1e-9, atol=1e-11)


# ---- smoothed surfaces --------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "MORTAR"])
def test_a_rigid_block_slides_on_a_smoothed_floor(formulation, tmp_path):
    """A smoothed flat is flat: the way of the polygon, to round-off."""
    deck = block_on_floor(0.02, 0.72, 0.3, v0=2.0, rigid=True)
    moved = []
    for smoothing in ("NONE", "HERMITE"):
        smooth = Deck(deck.text())
        smooth.insert(f"*SURFACE SMOOTHING, TYPE={smoothing}", before="*CONSTRAINT METHOD")
        run = run_deck(smooth, tmp_path/smoothing, formulation=formulation)
        obeys(run)
        moved.append(way(run, 15))
    assert np.abs(moved[1] - moved[0]).max() < 1e-12


@pytest.mark.parametrize("more", [{"formulation": "NODE TO SURFACE"},
                                  {"formulation": "MORTAR", "normal": "EDGE"}])
@pytest.mark.parametrize("mu", [0.2, 0.8])
def test_a_ring_on_a_smoothed_surface(mu, more, tmp_path):
    runs = [run_deck(ring(mu), tmp_path/method, h=0.02, t_end=t_end, method=method,
                     smoothing="HERMITE", **more)
            for method, t_end in (("NULL SPACE", 0.6), ("SADDLE POINT", 0.3))]
    for run in runs:
        obeys(run)
        keeps_momenta(run)
    assert_same_part(runs)


# ---- mass, and the limit of one solution --------------------------------------------------------


def test_what_rebounds_along_the_surface_keeps_its_mass(tmp_path):
    """A step without mass at the surfaces is for other pairs: the run is that of PERSISTENT."""
    deck = ring(0.8)
    deck.replace("*FRICTION", "*FRICTION, RESTITUTION=0.5")
    runs = [run_deck(deck, tmp_path/word, **NODES, h=0.02, t_end=0.3, initiation=word)
            for word in ("PERSISTENT", "MASSLESS")]
    assert "both surfaces keep their mass" in runs[1].log.replace("\n", " ")
    assert runs[0].digits() == runs[1].digits()


@pytest.mark.parametrize("angle", [30, math.degrees(math.atan(2)), 75])
def test_the_limit_of_a_rod(angle, tmp_path):
    """A rigid rod that touches with one corner at (x, y) from its centre: (r^2 + x^2)/|x y|, r the
    radius of gyration; for a thin one 4/3 at least."""
    length, thick, turn = 2.0, 0.02, math.radians(angle)
    c, s = math.cos(turn), math.sin(turn)
    y = 0.5*(length*s + thick*c)
    x = -0.5*(length*c - thick*s)

    def rod(p, q):
        return c*(p - length/2) - s*(q - thick/2), s*(p - length/2) + c*(q - thick/2) + y

    limit = ((length**2 + thick**2)/12 + x**2)/abs(x*y)
    told = []
    for mu in (0.98*limit, 1.02*limit):
        scene = Scene(1e-5, 2e-5, gravity=G)
        scene.block("ROD", (0, 0), (length, thick), (10, 1), stiffness=1e3, shape=rod,
                    velocity=(0.0, -1e-3))
        scene.block("FLOOR", (-3, -1), (6, 1), (4, 1), stiffness=1e3)
        scene.hold("FLOOR", lambda x, y: True)
        scene.pairs = [("ROD", "FLOOR")]
        make_rigid(scene, "ROD", (0, y), (0.0, -1e-3))
        run = run_deck(rubbing(scene.deck(ONE), mu), tmp_path/f"{mu}", **NODES)
        told += re.findall(r"is above (\S+): in an increment", run.log)
    assert len(told) == 1 and float(told[0]) == pytest.approx(limit, rel=2e-3)


def test_a_restart_has_the_same_bits(tmp_path):
    deck = ring(0.8)
    deck.replace("FREQUENCY=50", "FREQUENCY=13")
    (tmp_path/"again").mkdir()
    whole = run_deck(deck, tmp_path/"whole", **NODES, h=0.02, t_end=0.4)
    again = restart(whole, tmp_path/"again")
    assert again.history["friction_loss"][-1] > again.history["friction_loss"][-7] > 0
    assert again.digits() == whole.digits()


def test_without_friction_nothing_of_it_runs(tmp_path):
    """A coefficient of 0 is none: the same bits, corrections and counters, and no law to miss."""
    runs = []
    for card in ("", "\n*FRICTION\n0."):
        deck = Deck.read(DECKS/"ring.inp")
        deck.replace("NAME=FRICTIONLESS", f"NAME=FRICTIONLESS{card}")
        runs.append(run_deck(deck, tmp_path/f"{len(runs)}", **NODES, h=0.04, t_end=0.6))
    assert runs[0].history["active"].any()
    assert runs[0].digits() == runs[1].digits()
    assert runs[0].verdict["counts"] == runs[1].verdict["counts"]
    assert all("law_violation" not in run.verdict for run in runs)


# ---- lines of symmetry --------------------------------------------------------------------------


def pressed_blocks(half, statics=True):
    """A block on a wider, softer one, pressed in by its top: the whole, or what is right of x = 0."""
    scene = Scene(0.25 if statics else 0.01, 1.0 if statics else 0.25)
    n = 1 if half else 2
    for name, y, width, cells, stiffness in (("LOW", -1.0, 2.0, 5, 50.0), ("HIGH", 0.0, 1.0, 3, 100.0)):
        scene.block(name, (-width*(n - 1), y), (n*width, 1.0), (n*cells, 3), stiffness=stiffness)
        if half:
            scene.hold(name, lambda x, y: abs(x) < 1e-9, "1, 1")
    scene.pairs = [("HIGH", "LOW")]
    scene.hold("LOW", lambda x, y: y < -0.99)
    scene.hold("HIGH", lambda x, y: y > 0.99, "2, 2", -0.05)
    scene.hold("HIGH", lambda x, y: y > 0.99 and abs(x) < 1e-9, "1, 1")
    deck = rubbing(scene.deck("AUTO"), 0.3)
    if statics:
        deck.replace("*DYNAMIC, DIRECT", "*STATIC, DIRECT")
    return deck


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
def test_half_a_model_rubs_as_half_of_the_whole(formulation, tmp_path):
    """On the line of symmetry nothing slides: no friction, though any would satisfy the law there. There
    the whole has the mean of two edges that lean, half of it one of these: equal but for slope^2."""
    forces = []
    for half in (False, True):
        deck = pressed_blocks(half)
        run = run_deck(deck, tmp_path/str(half), formulation=formulation)
        assert run.verdict["verdict"] == "good"
        fields = run.fields()
        force = fields["contact_force"][-1]
        right = fields.x[:, 0] > 1e-9
        forces.append(force[right][np.lexsort(fields.x[right].T)])
    low = np.flatnonzero(np.abs(fields.x[:, 1]) < 1e-9)
    first = low[np.argsort(fields.x[low, 0])][:4]
    slope = np.abs(np.ptp(fields["displacement"][-1][first, 1])/np.ptp(fields.x[first, 0]))
    assert np.abs(forces[0]).max() > 0.1 and 1e-4 < slope < 0.1
    assert forces[1] == pytest.approx(forces[0], abs=slope**2*np.abs(forces[0]).max())


def test_one_element_on_a_line_of_symmetry(tmp_path):
    """Held on its left side, pressed on a profile: the weight of the load, and no search for what holds
    the body."""
    scene = Scene(1.0, 1.0)
    scene.block("BODY", (0, 0), (2, 1), (1, 1), stiffness=1e3)
    scene.hold("BODY", lambda x, y: x < 0.01, "1, 1")
    deck = rubbing(with_profile(scene, "START, -5., 0.\nLINE, 9., 0."), 0.3)
    deck.replace("*DYNAMIC, DIRECT", "*STATIC, DIRECT")
    deck.replace("*CONSTRAINT METHOD", "*CLOAD\n3, 2, -5.\n4, 2, -5.\n*CONSTRAINT METHOD")
    run = run_deck(deck, tmp_path, **NODES)
    assert run.verdict["verdict"] == "good" and run.history["newton"].sum() < 30
    assert run.history["pair1_force_y"][-1] == pytest.approx(10.0, rel=1e-9)


@pytest.mark.parametrize("way", [1e-2, 1e-8])
def test_what_is_driven_along_a_fixed_surface_rubs(way, tmp_path):
    """One element whose motion along is driven, however slowly: mu times what it is pressed by."""
    scene = Scene(0.25, 1.0)
    scene.block("BODY", (0, 0), (2, 1), (1, 1), stiffness=1e3)
    scene.hold("BODY", lambda x, y: True, "1, 1", way)
    deck = rubbing(with_profile(scene, "START, -5., 0.\nLINE, 9., 0."), 0.3)
    deck.replace("*DYNAMIC, DIRECT", "*STATIC, DIRECT")
    deck.replace("*CONSTRAINT METHOD", "*CLOAD\n3, 2, -5.\n4, 2, -5.\n*CONSTRAINT METHOD")
    run = run_deck(deck, tmp_path, **NODES)
    assert run.verdict["verdict"] == "good"
    assert np.abs(run.history["pair1_force_x"][1:]/run.history["pair1_force_y"][1:]) == pytest.approx(0.3, rel=1e-9)


def test_friction_changes_between_steps(tmp_path):
    """The momentum that a block loses by steps: 3/10, 1/10 and again 3/10 of its weight of 20, for .2 each."""
    deck = (DECKS / "sliding_block.inp").read_text()
    model, step = deck[:deck.index("*STEP")], deck[deck.index("*STEP"):].replace("<t_end>", ".2")
    load = "*DLOAD\nBLOCK, GRAV, 10., 0., -1.\n"
    changes = ["*CHANGE FRICTION, INTERACTION=ROUGH\n*FRICTION\n.1\n", "*CHANGE FRICTION, INTERACTION=ROUGH, RESET\n"]
    text = model.replace("<t_end>", ".6") + step + "".join(step.replace(load, change) for change in changes)
    run = run_deck(Deck(text, "changes"), tmp_path)
    assert run.verdict["law_violation"] < 1e-10 and run.history["cuts"].sum() == 0
    at = [np.argmin(np.abs(run.history["time"] - time)) for time in (0.0, 0.2, 0.4, 0.6)]
    # The block vibrates on its floor: its weight is met in the mean.
    assert -np.diff(run.history["px"][at]) == pytest.approx([1.2, 0.4, 1.2], rel=1e-3)
