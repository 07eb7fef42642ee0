"""`*FRICTION`: bodies that nothing else holds, slaves that are held, and partial slip to and fro."""

import itertools
import math

import numpy as np
import pytest
from friction_scenes import (
    NODES,
    WEIGHT,
    arch,
    arch_needs,
    balance,
    block_on_floor,
    partial_slip,
    pressed_round,
    rubbing,
    stack_on_slope,
    way,
)
from plain_scenes import BOTH, ONE, Scene, below
from scene_tools import run_deck


def loses(run):
    """Energy goes to friction and damping alone, and the laws are met. Where slip is held it is held
    to some ten roundings of the motion it is a difference of, and forces work on that."""
    assert balance(run.history) < 1e-12 and run.verdict["law_violation"] <= 1e-9
    force = sum(np.hypot(run.history[f"pair{k}_force_x"], run.history[f"pair{k}_force_y"]).max()
                for k in range(1, 100) if f"pair{k}_force_x" in run.history.dtype.names)
    motion = np.abs(run.fields()["displacement"]).max()
    noise = 16*np.finfo(float).eps*motion*force
    assert (np.diff(run.history["friction_loss"]) >= -noise).all()


@pytest.mark.parametrize(("formulation", "rigid"),
                         [("SEGMENT", True), ("SEGMENT", False), ("MORTAR", True)])
def test_the_floor_is_the_slave(formulation, rigid, tmp_path):
    """Nodes that are held have no stiffness to try slips with: that of others counts. The block stops,
    and is not driven back. Nodes of the floor come and go, each with an increment of smaller force."""
    deck = block_on_floor(0.01, 0.8, 0.3, v0=2.0, rigid=rigid, eta=0.0 if rigid else 2e-3)
    deck.replace("BLOCK, FLOOR", "FLOOR, BLOCK")
    run = run_deck(deck, tmp_path, formulation=formulation)
    loses(run)
    gone = way(run, 15)
    assert gone[-1] == pytest.approx(2/3, rel=5e-3)
    assert np.ptp(gone[-10:]) < 1e-3
    assert run.history["friction_loss"][-1] == pytest.approx(4.0, rel=5e-3)


@pytest.mark.parametrize(("sides", "formulation"),
                         [(ONE, "MORTAR"), (BOTH, "NODE TO SURFACE")])
@pytest.mark.parametrize("part", [0.8, 1.2, pytest.param(6.0, marks=pytest.mark.long)])
def test_an_arch(part, sides, formulation, tmp_path):
    """It stands by friction where a line of thrust has room in all cones, and else gives way."""
    run = run_deck(arch(part*arch_needs(), sides), tmp_path, formulation=formulation)
    loses(run)
    u = np.abs(run.fields()["displacement"]).max(axis=(1, 2))
    if part > 1:
        assert run.verdict["verdict"] == "good"
        assert u[-1] < 2e-3 and u[-1] < 1.05*u[len(u)//2]
        assert run.history["cuts"].sum() <= 2          # sets that come back are found, not cut
    else:
        assert u[-1] > 0.05 and u[-1] > 3*u[len(u)//2]


@pytest.mark.parametrize(("sides", "formulation"),
                         [(ONE, "MORTAR"), (BOTH, "NODE TO SURFACE")])
@pytest.mark.parametrize("mu", [0.25, 0.15])
def test_a_stack_on_a_slope(mu, sides, formulation, tmp_path):
    """Of 1 in 5: all of it rests, or slides as one."""
    slope = -math.atan(0.2)
    run = run_deck(stack_on_slope(mu, slope, sides=sides), tmp_path, formulation=formulation)
    loses(run)
    assert run.verdict["verdict"] == "good"
    assert run.history["cuts"].sum() <= (0 if sides == ONE else 10)
    gone, time = way(run, 2*(5 + 6)*3, slope), run.history["time"]
    later = time > 0.1
    seen = 2*np.polyfit(time[later], gone[later], 2)[0]
    exact = 10*math.cos(slope)*max(0.0, 0.2 - mu)
    assert seen == pytest.approx(exact, abs=0.02)
    if mu > 0.2:
        assert np.ptp(gone[time > 0.2]) < 1e-4


FORMULATIONS = [(ONE, "NODE TO SURFACE"), (BOTH, "NODE TO SURFACE"), (ONE, "SEGMENT"),
                (ONE, "MORTAR")]


@pytest.mark.each_value
@pytest.mark.parametrize(("sides", "formulation"), FORMULATIONS)
@pytest.mark.parametrize("cells", [(1, 1), (2, 1), (4, 2)])
def test_a_rigid_block_rests_and_slides_slowly(cells, sides, formulation, tmp_path):
    """Of nodes that hold the same body any may act. In small increments a first guess, which flies,
    meets gaps and forces nearly; slips of a body at rest are round-off. No increment is cut."""
    for v0, h in ((0.0, 0.005), (0.0, 0.001), (0.01, 0.0025), (0.1, 0.005), (0.1, 0.001),
                  (0.3, 0.0025)):
        deck = block_on_floor(h, 60*h, 0.3, v0=v0, rigid=True, cells=cells, sides=sides)
        run = run_deck(deck, tmp_path/f"{v0} {h}", formulation=formulation)
        assert run.verdict["verdict"] == "good" and run.verdict["law_violation"] <= 1e-9
        assert run.history["cuts"].sum() == 0
        # Whole increments lose mu g h; in the last one the velocity ends. It hops by 3 h at most.
        n = min(60, math.floor(v0/(3.0*h) + 1e-9))
        exact = n*h*(v0 - 0.5*n*3.0*h) + (0.5*h*(v0 - n*3.0*h) if n < 60 else 0.0)
        gone = way(run, (cells[0] + 1)*(cells[1] + 1))
        assert gone[-1] == pytest.approx(exact, abs=1.5*h*h)


def static(deck, nlgeom=True):
    deck.replace("*DYNAMIC, DIRECT", "*STATIC, DIRECT")
    if not nlgeom:
        deck.replace("*STEP, NLGEOM", "*STEP")
    return deck


@pytest.mark.each_value
@pytest.mark.parametrize(("sides", "formulation"), FORMULATIONS)
@pytest.mark.parametrize("method", ["NULL SPACE", "SADDLE POINT"])
@pytest.mark.parametrize(("slope", "nlgeom"), [(0.0, True), (0.4, False), (0.4, True),
                                               (0.4995, True)])
def test_a_block_lies_by_friction_alone(slope, nlgeom, method, sides, formulation, tmp_path):
    """Nothing but friction holds it along the floor; this bears its weight, across and along."""
    deck = static(block_on_floor(0.5, 1.0, 0.5, slope=-math.atan(slope), sides=sides), nlgeom)
    run = run_deck(deck, tmp_path, formulation=formulation, method=method)
    assert run.verdict["verdict"] == "good" and run.verdict["law_violation"] <= 1e-9
    assert run.history["cuts"].sum() == 0 and (np.diff(run.history["friction_loss"]) >= -1e-18).all()
    force = sum(np.array([run.history[f"pair{k}_force_{axis}"][-1] for axis in "xy"])
                for k in range(1, 3) if f"pair{k}_force_x" in run.history.dtype.names)
    assert np.abs(force - [0.0, WEIGHT]).max() < 1e-9*WEIGHT


@pytest.mark.parametrize(("sides", "formulation"), [
    pytest.param(*which, marks=[pytest.mark.long]*(which[0] == BOTH)) for which in FORMULATIONS])
def test_a_block_slides_off_in_statics(sides, formulation, tmp_path):
    """A thousandth above the limit no state of rest is there, and the message says so."""
    deck = static(block_on_floor(0.5, 1.0, 0.5, slope=-math.atan(0.5005), sides=sides))
    run = run_deck(deck, tmp_path, code=3, formulation=formulation)
    assert "is free to move" in run.errors and "friction is at its limit" in run.errors


@pytest.mark.parametrize(("sides", "formulation"), [(ONE, "MORTAR"), (BOTH, "NODE TO SURFACE")])
def test_a_stack_lies_by_friction_alone(sides, formulation, tmp_path):
    """Four blocks on a slope of 1 in 5, each held by nothing but its neighbours and friction."""
    deck = static(stack_on_slope(0.25, -math.atan(0.2), sides=sides, h=0.5, t_end=1.0))
    run = run_deck(deck, tmp_path, formulation=formulation)
    assert run.verdict["verdict"] == "good" and run.verdict["law_violation"] <= 1e-9
    assert run.history["cuts"].sum() == 0 and (np.diff(run.history["friction_loss"]) >= -1e-18).all()


def overhanging(shift):
    """A block of 1 by 1 on another one, with its middle `shift` before the end of that."""
    scene = Scene(1.0, 1.0, gravity=1.0)
    scene.block("LOW", (0, 0), (1, 1), (4, 4), stiffness=1e5)
    scene.block("HIGH", (0.5 - shift, 1), (1, 1), (4, 4), stiffness=1e5)
    scene.block("FLOOR", (-3, -1), (6, 1), (12, 2), stiffness=1e5)
    scene.hold("FLOOR", below(-1.0))
    scene.pairs = [("LOW", "FLOOR"), ("HIGH", "LOW")]
    return static(rubbing(scene.deck("AUTO"), 0.5))


@pytest.mark.each_value
@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
@pytest.mark.parametrize("shift", [0.12, 0.07, 0.05, 0.03])
def test_a_block_stands_over_an_end(shift, formulation, tmp_path):
    """By `SEGMENT` the last slave node over the end, below its middle, bears it, and the guard of the
    corner from 8e-4 of an edge on: it tips by that over the way between them, and what is elastic."""
    run = run_deck(overhanging(shift), tmp_path, formulation=formulation)
    assert run.verdict["verdict"] == "good" and run.verdict["law_violation"] <= 1e-9
    assert run.history["cuts"].sum() == 0
    names = [n for n in run.history.dtype.names if n.endswith("_force_y") and n.startswith("pair")]
    force = np.array([run.history[name][-1] for name in names])
    assert np.abs(force).sum() == pytest.approx(3.0, abs=1e-9)     # of both, and of the upper one
    moved = np.abs(run.fields()["displacement"][-1]).max()
    tips = 8e-4*0.25/shift if formulation == "SEGMENT" else 0.0
    elastic = 10*1.0/1e5                                # a weight over the stiffness, at one corner
    assert moved < 1.5*(tips + elastic/shift)


def test_friction_without_a_push_holds_nothing(tmp_path):
    """The block touches the floor, and nothing presses it down."""
    deck = static(block_on_floor(0.5, 1.0, 0.5))
    deck.replace("GRAV, 10.0", "GRAV, 0.0")
    run = run_deck(deck, tmp_path, code=3, **NODES)
    assert "nothing resists a motion" in run.errors


@pytest.mark.long
def test_partial_slip_to_and_fro(tmp_path):
    """Mindlin and Deresiewicz: on the way back from Q* what slides anew leaves a strip of
    sqrt(1 - (Q* - Q)/(2 mu P)) stuck, with what the way there has locked in."""
    deck, place = pressed_round(64, back=0.546, layers=10)
    run = run_deck(deck, tmp_path, **NODES)
    assert run.verdict["verdict"] == "good" and run.verdict["law_violation"] <= 1e-9
    assert run.history["cuts"].sum() == 0 and (np.diff(run.history["friction_loss"]) >= -1e-18).all()
    force, width, strip = partial_slip(run, place).T
    turn = np.argmax(force)
    there, back = np.arange(len(force)) <= turn, np.arange(len(force)) > turn
    assert force[turn] == pytest.approx(0.92, abs=0.005) and force[-1] < -0.9
    assert (np.abs(width - np.sqrt(1 - force))[there] < strip[there]).all()
    assert (np.abs(width - np.sqrt(1 - (force[turn] - force)/2))[back] < strip[back]).all()

    fields, k = run.fields(), len(run.history) - len(force) + 6 + turn
    q, p = (fields[name][k, :len(place)] for name in ("contact_shear", "contact_pressure"))
    bears = fields["contact_status"][k, :len(place)] > 0
    x, q, p = place[bears, 0], q[bears], p[bears]
    half = np.ptp(x)/2

    def ellipse(part):
        return np.sqrt(np.maximum(0.0, part - (x/half)**2))

    now = force[k - len(run.history) + len(force)]
    exact = ellipse(1) - 2*ellipse(1 - (force[turn] - now)/2) + ellipse(1 - force[turn])
    error = min(np.sqrt(np.mean((sign*q/(0.3*p.max()) - exact)**2)) for sign in (1, -1))
    assert error < strip[k - len(run.history)]
