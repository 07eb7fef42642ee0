"""Profiles of lines and arcs as rigid bodies without elements."""

import numpy as np
import pytest
from plain_scenes import Scene
from scene_tools import Deck, run_deck

REFERENCE = 900000


def with_profile(scene, cards, boundary="1, 2\n900000, 6", sides="ONE", slave="BODY"):
    """The scene on a profile whose body lies to the right of its way; all with one pair."""
    scene.pairs = [(slave, "PROFILE")]
    text = scene.deck(sides).text()
    profile = (f"*NODE\n{REFERENCE}, 0., -7.\n*SURFACE, NAME=PROFILE, TYPE=SEGMENTS\n{cards}\n"
               f"*RIGID BODY, ANALYTICAL SURFACE=PROFILE, REF NODE={REFERENCE}\n")
    text = text.replace("*SURFACE INTERACTION", profile + "*SURFACE INTERACTION", 1)
    return Deck(text.replace("*AMPLITUDE", f"*BOUNDARY\n{REFERENCE}, {boundary}\n*AMPLITUDE", 1))


def places(run):
    fields = run.fields()
    return fields.x + fields["displacement"]


def balances(history):
    total = history["total"]
    return np.abs(total - total[0]).max()/(history["kinetic"] + history["strain"]).max()


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
@pytest.mark.parametrize("initiation", ["PERSISTENT", "MASSLESS"])
def test_a_block_rebounds_from_a_line(formulation, initiation, tmp_path):
    """The body of the profile is to the right of its way: the ground below a line to the right."""
    scene = Scene(0.01, 0.6)
    scene.block("BODY", (0, 0.05), (1, 1), (4, 4), velocity=(0.5, -1))
    deck = with_profile(scene, "START, -3., 0.\nLINE, 3., 0.")
    run = run_deck(deck, tmp_path, formulation=formulation, initiation=initiation)
    assert (run.history["active"] > 0).any()
    assert run.history["py"][-1] > 0
    assert balances(run.history) < 1e-12
    assert places(run)[:, :25, 1].min() > -1e-12
    px = run.history["px"]                                       # no friction
    assert np.abs(px - px[0]).max() < 1e-12


@pytest.mark.parametrize(("smoothing", "off"), [("HERMITE", 1e-6), (None, 1e-12)])
def test_a_disc_in_a_bowl_of_arcs(smoothing, off, tmp_path):
    """Two arcs of a quarter each: the nodes stay within the circle, smoothed to 1e-6 of it."""
    scene = Scene(0.02, 1.0, gravity=10.0)
    scene.disc("BODY", (0.35, -0.606), 0.3, (6, 2), stiffness=3000.0)
    deck = with_profile(scene, "START, -1., 0.\nCIRCL, 0., -1., 0., 0.\nCIRCL, 1., 0., 0., 0.")
    more = {"smoothing": smoothing} if smoothing else {}
    run = run_deck(deck, tmp_path, formulation="NODE TO SURFACE", initiation="MASSLESS", **more)
    assert (run.history["active"] > 0).mean() > 0.5
    assert balances(run.history) < 1e-12
    n = len(scene.part["BODY"].node)
    r = np.linalg.norm(places(run)[:, :n], axis=2).max()
    assert 1 - 1e-3 < r < 1 + off


def test_a_trough_with_round_corners_is_that_bowl(tmp_path):
    """FILLET RADIUS of half its width and all of its depth leaves nothing of three sides."""
    way = []
    for name, cards in (("bowl", "START, -1., 0.\nCIRCL, 0., -1., 0., 0.\nCIRCL, 1., 0., 0., 0."),
                        ("trough", "START, -1., 0.\nLINE, -1., -1.\nLINE, 1., -1.\nLINE, 1., 0.")):
        scene = Scene(0.02, 0.4, gravity=10.0)
        scene.disc("BODY", (0.35, -0.606), 0.3, (6, 2), stiffness=3000.0)
        deck = with_profile(scene, cards)
        if name == "trough":
            deck.replace("TYPE=SEGMENTS", "TYPE=SEGMENTS, FILLET RADIUS=1.")
        run = run_deck(deck, tmp_path/name)
        assert (run.history["active"] > 0).mean() > 0.5
        n = len(scene.part["BODY"].node)
        way.append(places(run)[:, :n])
    np.testing.assert_allclose(way[1], way[0], rtol=0, atol=1e-12)


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT"])
def test_short_edges_on_a_short_hollow_arc(formulation, tmp_path):
    """Corners that touch it next to its ends are behind a chord, by .002 of it: no overlap."""
    scene = Scene(0.01, 1.0, gravity=10.0)
    scene.block("BODY", (-0.35, 0.1), (0.7, 0.2), (4, 2), stiffness=1000.0)
    radius, turn = 10.0, np.radians(2.5)
    x, y = radius*np.sin(turn), radius*(1 - np.cos(turn))
    slope = np.tan(turn)
    deck = with_profile(scene, f"START, -3., {float(y + slope*(3 - x))!r}\n"
                        f"LINE, {float(-x)!r}, {float(y)!r}\n"
                        f"CIRCL, {float(x)!r}, {float(y)!r}, 0., {radius}\n"
                        f"LINE, 3., {float(y + slope*(3 - x))!r}")
    run = run_deck(deck, tmp_path, formulation=formulation, initiation="MASSLESS", sides="ONE")
    assert (run.history["active"] > 0).any()
    assert balances(run.history) < 1e-12
    assert run.verdict["penetration"] < 1e-9


def test_a_block_on_a_roller_of_arcs(tmp_path):
    """It falls on the top of a half circle: nodes that touch are on it, none is in it."""
    scene = Scene(0.01, 1.0, gravity=10.0)
    scene.block("BODY", (-0.53, 0.02), (1.0, 0.5), (9, 3), stiffness=1000.0)
    deck = with_profile(scene, "START, -2., -2.\nCIRCL, 0., 0., 0., -2.\nCIRCL, 2., -2., 0., -2.")
    run = run_deck(deck, tmp_path, formulation="NODE TO SURFACE", initiation="MASSLESS")
    assert balances(run.history) < 1e-12
    assert (run.history["active"] > 1).any()
    n = len(scene.part["BODY"].node)
    away = np.linalg.norm(places(run)[:, :n] - [0.0, -2.0], axis=2) - 2.0
    assert away.min() > -1e-12
    assert ((away < 1e-12).sum(axis=1) == run.history["active"]).all()


def test_a_die_of_three_lines_is_pressed_in(tmp_path):
    """Driven down by 0.05 over the run: what it does is the energy of the block."""
    scene = Scene(0.05, 1.0)
    scene.block("BODY", (-1, -1), (2, 1), (8, 4)).hold("BODY", lambda x, y: y < -1 + 1e-9)
    scene.side("TOP", "BODY", lambda x, y: y > -1e-9)
    die = "START, 0.5, 1.\nLINE, 0.3, 0.\nLINE, -0.3, 0.\nLINE, -0.5, 1."
    deck = with_profile(scene, die, boundary="1\n900000, 6", slave="TOP")
    text = deck.text().replace(
        "*DYNAMIC, DIRECT\n<h>, <t_end>", "*DYNAMIC, DIRECT\n<h>, <t_end>\n"
        f"*BOUNDARY, AMPLITUDE=RAMP\n{REFERENCE}, 2, 2, -0.05", 1)
    run = run_deck(Deck(text), tmp_path, formulation="NODE TO SURFACE", sides="ONE",
                   initiation="MASSLESS")
    assert balances(run.history) < 1e-12
    assert run.history["strain"][-1] > 0
    y = places(run)[-1, :45]
    under = np.abs(y[:, 0]) < 0.28
    assert y[under, 1].max() < -0.05 + 1e-9
