"""Surfaces that stay apart by a pad, and circles: nodes with a pad as thick as a radius."""

import math

import numpy as np
import pytest
from plain_scenes import BOTH, ONE, Scene, below
from scene_tools import EPSILON, Deck, run_deck
from scipy.interpolate import CubicSpline
from scipy.special import ellipk

PAD = 0.125


def with_pad(deck, pad=PAD):
    deck.replace("NAME=SMOOTH", f"NAME=SMOOTH, PAD THICKNESS={pad!r}")
    return deck


def balance(history):
    total = history["total"] - history["contact_work"]
    return np.abs(total - total[0]).max()/(history["kinetic"] + history["strain"]).max()


# ---- bodies apart -------------------------------------------------------------------------------


def falling(lift):
    scene = Scene(0.02, 0.5)
    scene.block("BLOCK", (-0.53, 0.0625 + lift), (1.0, 0.5), (4, 2), velocity=(0.25, -1))
    scene.block("FLOOR", (-1.0, -0.5), (2.0, 0.5), (6, 2)).hold("FLOOR", lambda *_: True)
    return scene


@pytest.mark.parametrize(("formulation", "sides", "initiation"), [
    ("NODE TO SURFACE", BOTH, "PERSISTENT"), ("NODE TO SURFACE", ONE, "MASSLESS"),
    ("SEGMENT", ONE, "PERSISTENT"), ("MORTAR", ONE, "PERSISTENT"), ("MORTAR", ONE, "MASSLESS")])
def test_over_a_plane_a_pad_is_a_lift(formulation, sides, initiation, tmp_path):
    """The same history as without it and nearer by as much."""
    history = []
    for lift in (0.0, PAD):
        deck = falling(lift).deck(sides)
        if lift:
            with_pad(deck)
        history.append(run_deck(deck, tmp_path/str(lift), formulation=formulation,
                                initiation=initiation).history)
    bare, padded = history
    assert 0 < (bare["active"] > 0).sum() < len(bare) and bare["py"][-1] > 0
    assert (bare["active"] == padded["active"]).all()
    # MORTAR looks at the floor along normals, which the block's side turns by up to 0.01 as it
    # bends: from farther off it sees farther by the square of that.
    accuracy = 1e-4 if formulation == "MORTAR" else 1e-9
    for name in ("kinetic", "strain", "px", "py"):
        assert np.abs(padded[name] - bare[name]).max() < accuracy*np.abs(bare[name]).max(), name
    assert balance(padded) < 1e-12


def test_a_free_pair_keeps_its_momenta(tmp_path):
    """Two discs, padded, meet off centre: energy and momenta stay; their sides stay apart."""
    scene = Scene(0.02, 0.6)
    scene.disc("A", (-0.6, 0.0), 0.5, (4, 2), velocity=(1, 0.2), spin=1.0)
    scene.disc("B", (0.6, 0.1), 0.5, (4, 2), velocity=(-1, 0))
    for k, (formulation, sides) in enumerate((("NODE TO SURFACE", BOTH), ("SEGMENT", ONE),
                                              ("MORTAR", ONE))):
        run = run_deck(with_pad(scene.deck(sides)), tmp_path/str(k), formulation=formulation)
        history = run.history
        assert (history["active"] > 0).any()
        assert balance(history) < 1e-12
        scale = np.abs(history["lz"]).max()
        for name in ("px", "py", "lz"):
            assert np.abs(history[name] - history[name][0]).max() < 1e-12*scale, name
        fields = run.fields()
        x = fields.x + fields["displacement"]
        n = len(scene.part["A"].node)
        apart = np.linalg.norm(x[:, :n, None] - x[:, None, n:], axis=3).min()
        assert apart > 0.9*PAD


def test_statics_bring_a_loose_body_onto_the_pad(tmp_path):
    """A block that only its weight holds settles a pad above the floor, however far it was."""
    scene = Scene(0.5, 1.0, gravity=1.0)
    scene.block("BLOCK", (-0.5, 0.75), (1.0, 0.5), (4, 2)).hold("BLOCK", lambda x, _: x < 9, "1")
    scene.block("FLOOR", (-1.0, -0.5), (2.0, 0.5), (4, 1)).hold("FLOOR", lambda *_: True)
    scene.pairs = [("BLOCK", "FLOOR")]
    text = with_pad(scene.deck(ONE)).text().replace("*DYNAMIC, DIRECT", "*STATIC").replace(
        "*CONTACT INITIATION", "*CONTACT CONTROLS, STABILIZE\n*CONTACT INITIATION")
    run = run_deck(Deck(text), tmp_path, formulation="NODE TO SURFACE")
    fields = run.fields()
    y = (fields.x + fields["displacement"][-1])[np.abs(fields.x[:, 1] - 0.75) < 1e-9, 1]
    assert len(y) == 5 and np.abs(y - PAD).max() < 1e-9


# ---- circles ------------------------------------------------------------------------------------

R, RADIUS, WEIGHT, ANGLE = 1.0, 0.3, 10.0, 0.9
N_DISC = 57                            # nodes of its mesh
PERIOD = 4*ellipk(math.sin(ANGLE/2)**2)*math.sqrt((R - RADIUS)/WEIGHT)


def in_ring(gap=1e-8):
    """A rigid disc, whose mesh only gives it mass, in a rigid ring of four arcs."""
    scene = Scene(0.01, 1.0, gravity=WEIGHT)
    away = R - RADIUS - gap
    centre = (away*math.sin(ANGLE), -away*math.cos(ANGLE))
    scene.disc("DISC", centre, 0.9*RADIUS, (4, 2))
    assert len(scene.part["DISC"].node) == N_DISC
    scene.pairs = [("CENTRE", "RING")]
    arcs = "\n".join(f"CIRCL, {x}, {y}, 0., 0." for x, y in ((0, -R), (R, 0), (0, R), (-R, 0)))
    cards = (f"*NODE\n5000, {centre[0]!r}, {centre[1]!r}\n9000, 0., 0.\n"
             "*RIGID BODY, ELSET=DISC, REF NODE=5000\n*SURFACE, NAME=CENTRE, TYPE=NODE\n5000\n"
             f"*SURFACE, NAME=RING, TYPE=SEGMENTS\nSTART, {-R}, 0.\n{arcs}\n"
             "*RIGID BODY, ANALYTICAL SURFACE=RING, REF NODE=9000\n*BOUNDARY\n9000, 1, 2\n9000, 6\n")
    text = scene.deck().text()
    return with_pad(Deck(text.replace("*SURFACE INTERACTION", cards + "*SURFACE INTERACTION", 1)),
                    RADIUS)


def slide(folder, h, periods=2.2, **more):
    """A run, the places of the centre, and its mean period."""
    run = run_deck(in_ring(), folder, formulation="NODE TO SURFACE", smoothing="HERMITE",
                   h=h, t_end=h*math.ceil(periods*PERIOD/h), **more)
    fields = run.fields()
    x = (fields.x + fields["displacement"])[:, N_DISC]
    lowest = CubicSpline(fields.time, np.arctan2(x[:, 0], -x[:, 1])).roots(extrapolate=False)
    n = (len(lowest) - 1)//2
    return run, x, (lowest[2*n] - lowest[0])/n


@pytest.mark.parametrize("more", [{}, {"initiation": "MASSLESS"},
                                  {"initiation": "VELOCITY UPDATE"}], ids=str)
def test_a_disc_slides_in_a_ring(more, tmp_path):
    """In contact in every increment, on its circle, with the period of a pendulum."""
    run, x, period = slide(tmp_path, 0.02, **more)
    history = run.history
    assert (history["active"][1:] == 1).all()
    assert balance(history) < 1e-12
    # The smoothed arcs are within 1e-6 of the circle.
    assert np.abs(np.linalg.norm(x, axis=1) - (R - RADIUS)).max() < 1e-6*R
    assert period == pytest.approx(PERIOD, rel=3e-4)


def test_no_pad_is_nothing(tmp_path):
    """A pad of 0 changes no bit."""
    bits = []
    for k, pad in enumerate(("", ", PAD THICKNESS=0.")):
        deck = falling(0.0).deck(ONE)
        deck.replace("NAME=SMOOTH", f"NAME=SMOOTH{pad}")
        bits.append(run_deck(deck, tmp_path/str(k), formulation="MORTAR").digits())
    assert bits[0] == bits[1]


def over_the_edge(h, push):
    """A rigid disc on a fixed table goes over its corner: a deck, and the corner."""
    scene = Scene(h, 0.9, gravity=4.0)
    scene.block("TABLE", (-2.0, -1.0), (2.0, 1.0), (4, 2)).hold("TABLE", lambda *_: True)
    scene.disc("DISC", (-0.2, RADIUS + 1e-6), 0.9*RADIUS, (4, 2))
    scene.pairs = [("CENTRE", "TABLE")]
    text = scene.deck().text()
    cards = (f"*NODE\n5000, -0.2, {RADIUS + 1e-6}\n*RIGID BODY, ELSET=DISC, REF NODE=5000\n"
             "*SURFACE, NAME=CENTRE, TYPE=NODE\n5000\n*INITIAL CONDITIONS, TYPE=VELOCITY\n"
             f"5000, 1, {push}\n")
    text = text.replace("*SURFACE INTERACTION", cards + "*SURFACE INTERACTION", 1)
    return with_pad(Deck(text), RADIUS)


def test_a_disc_goes_around_a_corner(tmp_path):
    """It pivots about the corner, at its radius, till it flies: where v^2 = g r cos(angle)."""
    run = run_deck(over_the_edge(0.005, 0.5), tmp_path, formulation="NODE TO SURFACE")
    history, fields = run.history, run.fields()
    x = (fields.x + fields["displacement"])[:, -1]               # of the centre
    beside = np.maximum(x, 0.0)
    away = np.where(x[:, 0] < 0, x[:, 1], np.hypot(x[:, 0], beside[:, 1]))
    assert away.min() > RADIUS
    turning = (x[:, 0] > 0) & (history["active"] > 0)
    assert turning.sum() > 20
    assert np.abs(away[turning] - RADIUS).max() < 2e-6
    assert balance(history) < 1e-12
    # Energy: v^2 = v0^2 + 2 g r (1 - cos), so it flies at cos = (v0^2/(g r) + 2)/3.
    leaves = (0.5**2/(4.0*RADIUS) + 2)/3
    last = np.flatnonzero(turning)[-1]
    assert x[last, 1]/RADIUS == pytest.approx(leaves, abs=0.01)
