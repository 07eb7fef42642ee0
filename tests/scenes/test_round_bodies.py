"""Statics of round bodies that contact alone holds, and that may be free to roll.

A disc in a groove under a lid, and Hertz contact by load from the first increment on.
"""

import functools
import math
import pathlib
import re
import sys
import tempfile

import numpy as np
import overlap
import pytest
from plain_scenes import Scene
from scene_tools import DECKS, ROOT, Deck, figures, made, number, run_deck
from test_statics import FORMULATIONS, ACCURACY, displacement, solve, tower

sys.path.insert(0, str(ROOT / "pywrap"))

from emcon.stepper import Stepper  # noqa: E402

LOAD, RIM, RADIUS = 2.0, 24, 1.0
STABILIZE = "*CONTACT CONTROLS, STABILIZE"
#: An edge of the disc, and what the arc of one edge and of two rises.
EDGE = 2*math.pi*RADIUS/RIM
ARC, TWO_ARCS = EDGE**2/8, EDGE**2/2


# ---- decks --------------------------------------------------------------------------------------


def wall(side):
    """Places of a wall of the groove: `u` along it from where the disc touches, `v` towards that."""
    r = math.sqrt(0.5)
    return lambda u, v: (r*(side + u - side*v), r*(-1 + side*u + v))


def groove(turn, gap=0.0):
    """A disc between two walls of 45 degrees, and a lid over it, stiffer than the disc.

    The mesh of the disc is turned: by 0 nodes are where it touches, by half an edge edges are.
    """
    scene = Scene(1.0, 1.0)
    scene.disc("DISC", (0, 0), RADIUS, (RIM//4, 4), turn=turn)
    scene.block("RIGHT", (-0.9, -0.6), (2.2, 0.6), (9, 3), shape=wall(1), stiffness=1000.0)
    scene.block("LEFT", (-1.3, -0.6), (2.2, 0.6), (9, 3), shape=wall(-1), stiffness=1000.0)
    scene.block("LID", (-1.5, 1 + gap), (3, 0.5), (10, 2), stiffness=1000.0)
    for name, side in (("RIGHT", 1), ("LEFT", -1)):
        scene.hold(name, lambda x, y, side=side: side*x - y > 1.59*math.sqrt(2))
    scene.hold("LID", lambda x, _: abs(x) > 1.49, "1")
    scene.pairs = [("DISC", "RIGHT"), ("DISC", "LEFT"), ("DISC", "LID")]
    return scene


def static_deck(scene, formulation, load=LOAD, step=""):
    """The scene with a load on the upper edge of the lid, in four increments."""
    part = scene.part["LID"]
    top = max(y for _, y in part.node.values())
    row = sorted((x, n) for n, (x, y) in part.node.items() if y > top - 1e-9)
    share = load/(len(row) - 1)
    lines = [line for each in scene.part.values() for line in each.node_lines()] + scene.cards
    lines += ["*SURFACE INTERACTION, NAME=SMOOTH"]
    for slave, master in scene.pairs:
        lines += [f"*CONTACT PAIR, INTERACTION=SMOOTH, TYPE={formulation[0]}", f"{slave}, {master}"]
    lines += ["*BOUNDARY", *(f"{n}, {axes}" for nodes, axes, _ in scene.held for n in nodes)]
    lines += ["*STEP, NLGEOM", "*STATIC", "0.25, 1."]
    if formulation[0] != "NODE TO SURFACE":
        lines += [f"*MORTAR, MULTIPLIER={formulation[1]}"]
    lines += ["*CLOAD"]
    for k, (_, n) in enumerate(row):
        lines += [f"{n}, 2, {number(-share*(0.5 if k in (0, len(row) - 1) else 1.0))}"]
    return Deck("\n".join([*lines, step, "*NODE FILE", "U, RF", "*END STEP", ""])
                .replace("\n\n", "\n"), "groove")


def check(run, formulation):
    """Forces in balance, and no overlap but what the formulation allows, by positions alone."""
    fields = run.fields()
    reaction = fields["reaction_force"][-1].sum(axis=0)
    assert np.allclose(reaction, [0, LOAD], rtol=0, atol=1e-9*LOAD)
    # What is between the nodes of the disc is off by the arc of an edge; a mean gap that is 0 lets
    # a node dip as far as its neighbours rise from it.
    is_mean = formulation[0] != "NODE TO SURFACE" and formulation[1] == "STANDARD"
    assert overlap.worst(fields).by_edge < (TWO_ARCS if is_mean else ARC)/EDGE


# ---- a disc that is held to first order ---------------------------------------------------------


@pytest.mark.each_value
@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
@pytest.mark.parametrize(("turn", "gap"), [(math.pi/RIM, 0.0), (0.05, 0.0), (0.05, 0.03)])
def test_disc_rolls_onto_its_edges(tmp_path, formulation, turn, gap):
    """With an edge on each wall the disc is held; one that leans rolls there with the first load."""
    run = run_deck(static_deck(groove(turn, gap), formulation), tmp_path)
    check(run, formulation)
    assert (run.history["stabilization"] == 0.0).all()


# ---- a motion that no load works on --------------------------------------------------------------


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
def test_disc_on_its_nodes_is_refused_at_once(tmp_path, formulation):
    """One node on each surface: their normals meet in the axle, about which nothing holds."""
    run = run_deck(static_deck(groove(0.0), formulation), tmp_path, code=3)
    first = min(run.fields().cells[0]) + 1
    assert f"body of element {first} is free to rotate; no load does work on it" in run.errors
    assert "*CONTACT CONTROLS, STABILIZE" in run.errors
    assert "increment cut" not in run.log


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
def test_disc_on_its_nodes_with_stabilize(tmp_path, formulation):
    """Asked for, the smallest motion: symmetric, no rotation, and no force of the stabilization."""
    run = run_deck(static_deck(groove(0.0), formulation, step=STABILIZE), tmp_path)
    check(run, formulation)
    assert "warning: the body of element 1 is free to rotate" in run.errors
    others = [text for text in run.verdict["warnings"] if "which guards allow" not in text]
    assert "smallest motion" in run.errors and len(others) == 1
    strain, borne = run.history["strain"][-1], run.history["stabilization"]
    assert np.abs(borne).max() < 1e-10*strain                  # Newton's tolerance
    assert run.verdict["stabilization"] == pytest.approx(borne[-1])
    # The axle: forces of three nodes on the axes of symmetry do not turn it.
    u, x = run.fields()["displacement"][-1], run.fields().x
    disc = np.hypot(*x.T) < RADIUS + 1e-9
    turn = (x[disc, 0]*u[disc, 1] - x[disc, 1]*u[disc, 0]).sum()/(x[disc]**2).sum()
    assert abs(turn) < 1e-8


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
@pytest.mark.parametrize("gap", [0.0, 1e-3])
def test_square_without_support_stays_where_it_is(tmp_path, formulation, gap):
    """Free to slide on a flat one, and loaded straight down: as if it were held in the middle."""
    (tmp_path / "held").mkdir()
    held = solve(tmp_path / "held", tower([gap], formulation))
    run = solve(tmp_path, tower([gap], formulation, held="", step=STABILIZE))
    assert "body of element 101 is free to move in x" in run.errors
    u = displacement(held, 1)
    assert np.allclose(displacement(run, 1), u, rtol=0, atol=1e-8*np.abs(u - u.mean((0, 1))).max())


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
def test_what_a_load_moves_is_not_stabilized(tmp_path, formulation):
    """Pulled off, or with a share of the load along the free motion: an error all the same."""
    (tmp_path / "off").mkdir()
    run = solve(tmp_path / "off", tower([0.0], formulation, load=1.0, step=STABILIZE), code=3)
    assert "body of element 101 is free to move in y" in run.errors
    sideways = "*CLOAD\n101, 1, 1e-6\n" + STABILIZE
    run = solve(tmp_path, tower([0.0], formulation, held="", step=sideways), code=3)
    assert "body of element 101 is free to move in x" in run.errors
    assert "no load does work" not in run.errors


def test_restart_file_holds_what_is_borne(tmp_path):
    deck = static_deck(groove(0.0), FORMULATIONS[4], step=STABILIZE).write(tmp_path / "groove.inp")
    with Stepper(deck) as stepper:
        stepper.run(until=0.5)
        before = stepper.ledger
        assert before["stabilization"] != 0.0
        stepper.write_restart(tmp_path / "half.rst.h5")
        stepper.run()
        with Stepper.from_restart(tmp_path / "half.rst.h5") as other:
            assert other.ledger == before
            other.run()
            assert other.ledger == stepper.ledger


def test_reset_asks_for_the_error_again(tmp_path):
    text = tower([0.0], held="", step=STABILIZE)
    second = "*STEP\n*STATIC\n1., 1.\n*END STEP\n"
    solve(tmp_path, text + second)
    second = second.replace("*END STEP", "*CONTACT CONTROLS, RESET\n*END STEP")
    run = solve(tmp_path, text + second, code=3)
    assert "free to move in x" in run.errors and run.verdict["time"] == 1.0


# ---- without any load -----------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
def test_body_without_load_is_brought_to_its_master(tmp_path, formulation):
    """Which a warning says; over no gap there is nothing to say."""
    run = solve(tmp_path, tower([0.1], formulation, load=0.0))
    assert np.allclose(displacement(run, 1)[..., 1], -0.1, rtol=0, atol=0.1*ACCURACY)
    assert "body of element 101 is free to move in y" in run.errors
    assert "moved over a gap of 0.1 onto the surface nearest to it" in run.errors
    assert run.verdict["verdict"] == "good" and run.verdict["warning_count"] == 1
    assert "no load" not in solve(tmp_path, tower([0.0], formulation, load=0.0)).errors


# ---- Hertz by load --------------------------------------------------------------------------------


@functools.lru_cache
def hertz(level, is_free=False):
    """The deck of make_hertz.py with its second step only, the pressure.

    `is_free`: no support of the upper cylinder either, which may roll on the lower one.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = made("hertz", pathlib.Path(folder), "--level", level)
        text, known = path.read_text(), figures(path, r"= (\S+), peak pressure 2 F/\(pi a\) = (\S+),")
    model, _, press = re.split(r"^\*STEP\n", text, flags=re.M)
    if is_free:
        model = re.sub(r"(?s)(NSET=AXIS.*)\*NSET, NSET=AXIS[^*]*", r"\1", model)
        press = press.replace("*DLOAD", STABILIZE + "\n*DLOAD")
    return model + "*STEP\n" + press.replace(", OP=NEW", ""), known


def pressed(folder, formulation, level, is_free=False):
    """The run, and half-width and peak of the pressure on the slave side over those of Hertz."""
    text, (width, peak) = hertz(level, is_free)
    kind = {"formulation": formulation[0], "multiplier": formulation[1]}
    run = run_deck(Deck(text, "hertz"), folder, **kind)
    fields = run.fields()
    # The upper cylinder, whose nodes come last: the others of its arc bear 0.
    first = np.flatnonzero(fields.x[:, 1] < -1e-9).max() + 1
    x, force = fields.x[first:, 0], fields["contact_force"][-1][first:, 1]
    assert force.sum() == pytest.approx(10.0, rel=1e-9)
    # The second moment of half an ellipse is a^2/4; edges are even where contact is.
    found = 2*math.sqrt((force*x**2).sum()/force.sum())
    return run, found/width - 1, force.max()/(width/level)/peak - 1


@pytest.fixture(scope="module")
def guided(tmp_path_factory):
    """`guided(formulation, level)` is `pressed`; each is made once."""
    return functools.cache(lambda *which: pressed(tmp_path_factory.mktemp("hertz"), *which))


@pytest.mark.each_value
@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
@pytest.mark.parametrize("level", [3, 6])
def test_hertz_by_load(guided, formulation, level):
    """No step that closes the contact first. Half-width and peak to second order of an edge."""
    _, width, peak = guided(formulation, level)
    assert abs(width) < level**-2 and abs(peak) < level**-2


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
def test_hertz_by_load_without_support(guided, tmp_path, formulation):
    """Free to roll on the lower cylinder: with STABILIZE as if it were guided."""
    held, width, peak = guided(formulation, 3)
    run, free_width, free_peak = pressed(tmp_path, formulation, 3, is_free=True)
    assert "rotate; no load does work on it" in run.errors
    assert (free_width, free_peak) == pytest.approx((width, peak), abs=1e-8)
    u = held.fields()["displacement"][-1]
    assert np.allclose(run.fields()["displacement"][-1], u, rtol=0, atol=1e-8*np.abs(u).max())
    assert np.abs(run.history["stabilization"]).max() < 1e-10*held.history["strain"][-1]


@pytest.mark.parametrize("cuts", [1, 40])
def test_a_disc_flattens_on_one_long_line(cuts, tmp_path):
    """At the rim of the contact normals of the disc cross before the ends of the line, which stand
    beside all edges: as on a line in pieces, and within 2 % of NODE TO SURFACE."""
    scene = Scene(1.0, 1.0, gravity=30.0)
    scene.disc("DISC", (0.0, 1.0), 1.0, (24, 6), stiffness=1000.0)
    scene.hold("DISC", lambda x, _: abs(x) < 1e-9, "1, 1")
    line = "\n".join(f"LINE, {-5 + 10*(k + 1)/cuts!r}, 0." for k in range(cuts))
    scene.cards += ["*SURFACE, TYPE=SEGMENTS, NAME=FLOOR", "START, -5., 0.", *line.splitlines(),
                    "*NODE", "99999, 0., 0.", "*RIGID BODY, ANALYTICAL SURFACE=FLOOR, REF NODE=99999",
                    "*BOUNDARY", "99999, 1, 2", "99999, 6"]
    scene.pairs = [("DISC", "FLOOR")]
    deck = scene.deck()
    deck.replace("*DYNAMIC, DIRECT", "*STATIC")
    ends = []
    for formulation in ("NODE TO SURFACE", "MORTAR"):
        run = run_deck(deck, tmp_path/formulation, formulation=formulation)
        assert run.verdict["verdict"] == "good"
        ends.append(run.fields()["displacement"][-1])
    assert np.abs(ends[1] - ends[0]).max() < 0.02*np.abs(ends[0]).max()
