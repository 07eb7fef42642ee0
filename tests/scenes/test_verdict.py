"""How a run ends: NAME.json, the verdict in log and on the screen, exit codes, --strict."""

import re

import numpy as np
import pytest
from plain_scenes import BOTH, ONE, Scene, turned
from scene_tools import DECKS, Deck, Run, emcon, run_deck


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    return run_deck(DECKS / "ring.inp", tmp_path_factory.mktemp("ring"), h=0.05,
                    initiation="PERSISTENT")


def test_figures_are_those_of_the_history(ring):
    """Nine digits are written; the largest error is that of the history, row by row."""
    found, rows = ring.verdict, ring.history
    assert found["verdict"] == "good" and found["reasons"] == [] and found["message"] == ""
    assert found["increments"] == rows["increment"][-1] and found["newton"] == rows["newton"].sum()
    for name in ("time", "kinetic", "strain", "external_work", "total"):
        assert found[name] == pytest.approx(rows[name][-1], rel=1e-8), name
    drift = np.abs(rows["total"] - rows["contact_work"] - rows["total"][0]).max()
    assert found["largest_energy_error"] == pytest.approx(drift, rel=1e-8, abs=0)
    assert 0 < found["mean_stand_off"] < found["stand_off"]


def test_stand_off_is_the_gap_held(ring):
    """Persistent contact holds the gap that it begins with, which shrinks with the increment."""
    fine = run_deck(DECKS / "ring.inp", ring.base.parent / "fine", h=0.01, t_end=1.5,
                    initiation="PERSISTENT")
    assert 0 < fine.verdict["stand_off"] < 0.5*ring.verdict["stand_off"]
    shut = run_deck(
        DECKS / "ring.inp", ring.base.parent / "shut", h=0.05, t_end=1.5, initiation="ADMISSIBLE")
    assert shut.verdict["stand_off"] <= 1e-10


def test_statics_have_a_verdict(tmp_path):
    run = run_deck(DECKS / "two_blocks_static.inp", tmp_path, options=["--strict"])
    assert run.verdict["verdict"] == "good"
    assert "verdict: good: nothing penetrates" in run.log


def ring_that_stops(folder):
    """The ring with one correction an increment at most, which cannot be cut."""
    deck = Deck.read(DECKS / "ring.inp")
    deck.replace("TOLERANCE=<tolerance>", "TOLERANCE=<tolerance>, MAXIMUM=1")
    deck.replace("<h>, <t_end>", "<h>, <t_end>, <h>")
    return deck.write(folder / "ring.inp")


def test_failed_run_is_not_called_good(tmp_path):
    path = ring_that_stops(tmp_path)
    done = emcon(path, "--output", tmp_path, "--set=h=0.05")
    assert done.returncode == 3
    run = Run(tmp_path / path.stem)
    assert run.verdict["verdict"] == "not completed"
    assert "the analysis stops" in run.verdict["message"]
    assert "verdict: NOT COMPLETED" in done.stdout and "closes to" not in done.stdout
    assert "verdict: NOT COMPLETED" in run.log and "closes to" not in run.log


def test_verdict_of_an_earlier_run_goes(tmp_path):
    """Nothing that scripts read is left of another run, also where this one fails at once; a deck
    that is refused begins no run, and costs nothing of what was written."""
    good = run_deck(DECKS / "ring.inp", tmp_path, h=0.05, t_end=0.1)
    assert good.verdict["verdict"] == "good" and len(good.history) == 3
    before = good.file(".json").read_bytes()
    run_deck(DECKS / "ring.inp", tmp_path, code=2, h=-0.05)
    assert good.file(".json").read_bytes() == before
    run = run_deck(ring_that_stops(tmp_path), tmp_path, code=3, h=0.05)
    assert run.verdict["verdict"] == "not completed" and len(run.history) == 1


def test_option_strict_is_known_to_restart(ring):
    done = emcon("restart", ring.file(".rst.h5"), "--strict", "--quiet")
    assert done.returncode == 0 and done.stderr == ring.errors


# ---- what is good, told or bad ------------------------------------------------------------------

#: A block of one element on another that is held, `gap` apart.
BLOCKS = """*NODE
1, 0., 0.
2, 1., 0.
3, 1., 1.
4, 0., 1.
5, 0., {low}
6, 1., {low}
7, 1., {high}
8, 0., {high}
*ELEMENT, TYPE=CPE4, ELSET=LOWER
1, 1, 2, 3, 4
*ELEMENT, TYPE=CPE4, ELSET=UPPER
2, 5, 6, 7, 8
*NSET, NSET=HELD
1, 2, 3, 4
*NSET, NSET=FREE, ELSET=UPPER
*MATERIAL, NAME=M
*ELASTIC
100., 0.
*DENSITY
1.
*SOLID SECTION, ELSET=LOWER, MATERIAL=M
*SOLID SECTION, ELSET=UPPER, MATERIAL=M
*SURFACE, NAME=TOP
1, S3
*SURFACE, NAME=FOOT
2, S1
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
FOOT, TOP
*BOUNDARY
HELD, 1, 2
"""
THROWN = "*INITIAL CONDITIONS, TYPE=VELOCITY\nFREE, 2, -1.\n"


def blocks(cards, gap=0.0):
    """The two blocks with cards of the model and one step of `cards`."""
    model, _, step = cards.partition("*STEP")
    return Deck(BLOCKS.format(low=1 + gap, high=2 + gap) + model + f"*STEP{step}\n*END STEP\n")


def test_round_off_of_forces_at_rest_is_no_error(tmp_path):
    """A rigid block that lies there: its energies are nothing but what its weight is rounded by."""
    deck = blocks("*RIGID BODY, ELSET=UPPER, REF NODE=5\n*STEP, NLGEOM\n*DYNAMIC, DIRECT\n"
                  "0.01, 3.\n*DLOAD\nUPPER, GRAV, 10., 0., -1.")
    deck.move_nodes(lambda label, x, y: (x - 0.3*(label < 5), y/3))   # no dyadic heights
    run = run_deck(deck, tmp_path)
    assert run.verdict["verdict"] == "good", run.verdict["reasons"]
    assert run.verdict["largest_energy"] < 1e-20
    assert "round-off of the forces" in run.log


def thrown(h, card=""):
    return blocks(f"{THROWN}*STEP, NLGEOM\n*DYNAMIC, DIRECT\n{h}, 16.{card}", gap=5.3)


@pytest.mark.parametrize("h, left", [(5, 0.3), (8, 0.3), (16, 0.3), (1.8, 0.35)])
def test_air_is_half_an_edge_at_most(tmp_path, h, left):
    """The increment of contact is halved until less than that is left of the height, an edge being 1."""
    found = run_deck(thrown(h), tmp_path).verdict
    assert found["stand_off"] == pytest.approx(left, rel=1e-6)
    assert found["verdict"] == "good"


@pytest.mark.parametrize("width, pair", [
    (100, "FOOT, TOP"), (100, "TOP, FOOT"), (1e4, "FOOT, TOP"),
    (100, ", SIDES=ONE\nFOOT, TOP"), (10, ", TYPE=SEGMENT\nTOP, FOOT"), (10, ", TYPE=MORTAR\nTOP, FOOT"),
    (100, ", TYPE=MORTAR\nFOOT, TOP")])
def test_air_is_measured_in_the_smaller_edge(tmp_path, width, pair):
    """A floor of one wide face is no measure for a block of 1: on either side, by all kinds."""
    deck = thrown(8)
    deck.replace("\nFOOT, TOP", pair if pair.startswith(",") else f"\n{pair}")
    deck.move_nodes(lambda label, x, y: (x if label > 4 else 0.5 + width*(x - 0.5), y))
    found = run_deck(deck, tmp_path).verdict
    assert found["stand_off"] == pytest.approx(0.3, rel=1e-6)
    assert found["verdict"] == "good"


@pytest.mark.parametrize("h, verdict, told", [(0.4, "good", 0), (5, "good", 1), (8, "bad", 0)])
def test_air_that_holds_a_block(tmp_path, h, verdict, told):
    """Thrown at 1 from a height of 5.3: what is left of it where the step of contact begins."""
    run = run_deck(thrown(h, "\n*CONTACT INITIATION, GAP TOLERANCE=9"), tmp_path)
    found = run.verdict
    assert found["mean_stand_off"] == pytest.approx(5.3 % h, rel=1e-6)
    assert (found["verdict"], found["warning_count"]) == (verdict, told)
    assert all("act across gaps" in text for text in found["reasons"] + found["warnings"])


@pytest.mark.parametrize("how, verdict, told", [
    ("EXPLICIT, DIRECT\n0.01, 0.5", "bad", "impacts have lost 50 % of the largest energy"),
    ("DIRECT\n0.01, 0.5\n*CONTACT INITIATION, TYPE=ADMISSIBLE", "good", "impacts have lost "),
    ("DIRECT\n0.01, 0.5", "good", "")])
def test_what_impacts_take(tmp_path, how, verdict, told):
    """Two of four equal masses stop: half of the energy is gone, at once and for good."""
    run = run_deck(blocks(f"{THROWN}*STEP, NLGEOM\n*DYNAMIC, {how}", gap=0.01), tmp_path)
    assert run.verdict["verdict"] == verdict
    texts = run.verdict["reasons"] + run.verdict["warnings"]
    assert len(texts) == (told != "") and all(text.startswith(told) for text in texts)


@pytest.mark.parametrize("force, verdict", [(18.0, "good"), (22.0, "bad")])
def test_linear_elements_that_turn(tmp_path, force, verdict):
    """Sheared by gamma = F/(G A) with G = 50, which is a rotation by half of it."""
    deck = blocks(f"*BOUNDARY\nFREE, 2\n5, 1\n6, 1\n*STEP, NLGEOM\n*STATIC\n1., 1.\n"
                  f"*CLOAD\n7, 1, {force/2}\n8, 1, {force/2}", gap=0.5)
    deck.replace("ELSET=UPPER, MATERIAL=M", "ELSET=UPPER, MATERIAL=M, KINEMATICS=LINEAR")
    run = run_deck(deck, tmp_path)
    assert run.verdict["linear_rotation"] == pytest.approx(force/100, rel=1e-9)
    assert run.verdict["verdict"] == verdict
    assert all("linear elements rotate" in text for text in run.verdict["reasons"])


@pytest.mark.parametrize("away, told", [(4e7, 0), (5e7, 1)])
def test_coordinates_that_leave_few_digits(tmp_path, away, told):
    """Distances keep eight digits up to 1e-8 over epsilon, 4.5e7 edges of 1."""
    deck = blocks(f"{THROWN}*STEP, NLGEOM\n*DYNAMIC, DIRECT\n0.01, 0.01", gap=0.5)
    deck.move_nodes(lambda label, x, y: (x + away, y))
    run = run_deck(deck, tmp_path)
    assert [" keep 7 digits" in text for text in run.verdict["warnings"]] == [True]*told


@pytest.mark.parametrize("initiation, told", [("PERSISTENT", True), ("MASSLESS", False)])
def test_forces_that_are_a_comb(tmp_path, initiation, told):
    """A bar thrown on a wall: its last node bounces off and comes back, unless it has no mass."""
    run = run_deck(DECKS/"bouncing_bar.inp", tmp_path, t_end=1.5, initiation=initiation)
    assert ("TYPE=MASSLESS makes it smooth" in run.log) == told
    assert (run.verdict["force_scatter"] > 0.5) == told


def test_a_side_inside_is_named(tmp_path):
    """A plate of 3 falls by 0.125 onto a block of 1/2, 0.1 below, whose corners nobody holds: inside is the middle of
    its side, no node."""
    deck = blocks(f"{THROWN}*STEP, NLGEOM\n*DYNAMIC, DIRECT\n0.025, 0.125", gap=0.1)
    deck.replace("*CONTACT PAIR, INTERACTION=I", "*CONTACT PAIR, INTERACTION=I, SIDES=ONE, GUARD=NO")
    deck.move_nodes(lambda label, x, y: (3*x - 1, y) if label > 4 else (0.5*x, y))
    found = run_deck(deck, tmp_path).verdict
    assert found["penetration"] == pytest.approx(0.025/0.5, rel=1e-9)
    assert re.fullmatch(r"bodies overlap by 0.05 of an edge at time 0.125, a point beside node [56] of body 2 is "
                        r"0.025 behind the edge from node 3 to 4 of body 1", found["reasons"][0])


def test_a_body_that_goes_through_itself_is_told(tmp_path):
    """A soft ring between plates, with pairs of its outer side alone: what is above its bore comes
    out below. The verdict is bad for that, and says what nothing has held apart before."""
    scene = Scene(0.02, 1.0)
    scene.ring("RING", lambda a, s: ((1 - 0.15*s)*np.cos(a), 1 + (1 - 0.15*s)*np.sin(a)), (24, 1),
               stiffness=10.0)
    scene.block("FLOOR", (-2, -0.5), (4, 0.5), (7, 1), stiffness=1e4).hold("FLOOR", lambda *_: True)
    scene.block("PLATE", (-2, 2.02), (4, 0.5), (7, 1), stiffness=1e4)
    scene.hold("PLATE", lambda *_: True, "1, 1")
    scene.hold("PLATE", lambda *_: True, "2, 2", -1.95)
    scene.side("OUTER", "RING", lambda x, y: np.hypot(x, y - 1) > 0.99)
    scene.pairs = [("OUTER", "FLOOR"), ("OUTER", "PLATE")]
    found = run_deck(scene.deck(BOTH), tmp_path, code=3, formulation="NODE TO SURFACE").verdict
    assert found["verdict"] == "bad"
    assert any("a body has gone through itself by then" in text for text in found["reasons"])


@pytest.mark.parametrize("turn", [0.0, 0.1, 0.7])
def test_bodies_that_touch_are_not_meant_to_go_on(turn, tmp_path):
    """Driven into each other without a pair: by round-off they overlap at the start."""
    scene = Scene(0.05, 0.5)
    place = turned(turn)
    scene.block("UPPER", (0.0, 0.0), (1.0, 1.0), (4, 4), shape=place)
    scene.block("LOWER", (-0.5, -1.0), (2.0, 1.0), (8, 4), shape=place)
    scene.hold("LOWER", lambda x, y: True)
    down = place(0.0, -0.2)
    for axis, way in zip("12", down, strict=True):
        scene.hold("UPPER", lambda x, y: True, axes=f"{axis}, {axis}", value=way)
    scene.pairs = [("UPPER", "UPPER")]
    deck = scene.deck(ONE)
    deck.remove("*CONTACT PAIR")
    deck.remove("*CONTACT FILE")
    deck.remove("*CONTACT PRINT")
    done = emcon(deck.write(tmp_path/"scene.inp"), "--quiet", "--output", tmp_path)
    assert done.returncode == 3
    assert "bodies overlap by 0.8 of an edge" in done.stderr
    assert "no *CONTACT PAIR names the two" in done.stderr
