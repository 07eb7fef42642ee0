"""The decks of input_decks/ with contact of both sides, and of everything with everything."""

import math
import re

import numpy as np
import overlap
import pytest
from contact_sides import ALL, BOTH, NODES, ONE, FileOutcome, FileScene, with_sides
from plain_scenes import AUTO, Scene
from scene_tools import DECKS, EPSILON, Deck, attempt, made, run_deck

#: Decks with contact in short runs in which bodies meet; all of them, and whole: the book.
SHORT = {
    "bouncing_bar": {"h": 0.02, "t_end": 1.2},
    "contact_patch": {},
    "press_fit": {},
    "ring": {"h": 0.05, "t_end": 0.5},
    "self_contact": {"h": 0.02, "t_end": 0.4},
    "three_bodies": {"h": 0.02, "t_end": 0.4},
    "tied_ring": {"h": 0.05, "t_end": 0.5},
    "two_blocks_static": {},
    "two_bodies": {"h": 0.02, "t_end": 0.4},
}


def rounding(fields):
    """What positions are rounded by, by the shortest edge: a few roundings of the largest one."""
    edges = np.diff(fields.x[overlap.Bodies(fields.cells).edge], axis=1)
    return 8*EPSILON*np.abs(fields.x).max()/np.linalg.norm(edges, axis=-1).min()


@pytest.mark.each_value
@pytest.mark.parametrize("sides", [BOTH, ALL])
@pytest.mark.parametrize("name", SHORT)
def test_nothing_is_in_another(tmp_path, name, sides):
    done = FileOutcome(FileScene(DECKS / f"{name}.inp"), tmp_path, sides, **SHORT[name])
    assert (done.code, done.run.verdict["verdict"]) == (0, "good")
    assert done.run.history["active"].max() > 0
    assert done.overlap.by_edge <= rounding(done.fields)
    if done.is_dynamic:
        assert done.energy_error <= 1e-12


def test_bodies_of_one_surface_may_overlap_at_first(tmp_path):
    """A press fit of unlike meshes, whose edges cross: all exterior is one surface, of both. At the
    end circles touch, so that nodes are behind chords of the hole by their sagitta at most."""
    path = made("press_fit", tmp_path, "--hub", "8x4", "--sleeve", "11x5")
    done = FileOutcome(FileScene(path), tmp_path / "run", ALL)
    assert done.code == 0 and done.run.history["active"].max() > 0
    assert done.overlap.depth <= 1.01*2.0*(1.0 - math.cos(math.pi/4/11))
    fields = done.fields
    bore = np.abs(np.linalg.norm(fields.x, axis=1) - 1.0) < 1e-6
    moved = (fields["displacement"][-1]*fields.x).sum(axis=1)[bore].mean()
    assert moved == pytest.approx(-3.125e-4, rel=0.02)          # Lame, by the heading of the deck


def journal(sides):
    """A disc in a ring of the same radius: its nodes begin behind the chords of the ring."""
    scene = Scene(0.02, 0.1)
    scene.disc("DISC", (0.0, 0.0), 0.5, (3, 2), velocity=(0, -1))
    scene.ring("RING", lambda angle, share: ((0.8 - 0.3*share)*math.cos(angle),
                                             (0.8 - 0.3*share)*math.sin(angle)), (20, 2))
    scene.pairs = [("RING", "DISC")]
    return scene.deck(sides)


def test_polygons_of_one_curve_are_guarded(tmp_path):
    """The nodes of the ring are held; those of the disc cannot be, unless that is asked for."""
    run = run_deck(journal(AUTO), tmp_path / "free", formulation=NODES)
    assert "surface DISC dips into edges of RING at the start: its nodes are guarded" in run.log
    one = run_deck(journal(ONE), tmp_path / "one", formulation=NODES)
    assert run.history["total"].tolist() == one.history["total"].tolist()
    asked = attempt(journal(BOTH), tmp_path / "both", (), {"formulation": NODES})[0]
    assert asked.returncode == 2 and "penetrate surface RING" in asked.stderr


def test_an_overlap_is_found(tmp_path):
    """The deck as it is given holds nodes of one side."""
    done = FileOutcome(FileScene(DECKS / "contact_patch.inp"), tmp_path, ONE, formulation=NODES)
    assert done.overlap.by_edge > 1e-5


@pytest.mark.parametrize(("gap", "is_paired", "warns"), [
    (0.05, False, True), (0.05, True, False), (-0.05, False, False)])
def test_bodies_without_a_pair_that_go_through_each_other_are_told(tmp_path, gap, is_paired, warns):
    """Of two that fly at each other only pairs with a third are named; at first they may overlap."""
    scene = Scene(0.02, 0.2)
    scene.block("FLOOR", (-1.0, -0.5), (3.0, 0.4), (3, 1)).hold("FLOOR", lambda *_: True)
    scene.block("LEFT", (-0.5, 0.0), (0.5, 0.5), (2, 2), velocity=(1.0, 0.0))
    scene.block("RIGHT", (gap, 0.0), (0.5, 0.5), (2, 2))
    scene.pairs = [("LEFT", "FLOOR"), ("RIGHT", "FLOOR"), *[("LEFT", "RIGHT")]*is_paired]
    run = run_deck(scene.deck(AUTO), tmp_path, code=3*warns, formulation=NODES)
    assert (max(overlap.frames(run.fields())).by_edge > 0.1) is not is_paired
    told = [text for text in run.verdict["reasons"] if "no *CONTACT PAIR names the two" in text]
    assert len(told) == warns and run.verdict["verdict"] == ("bad" if warns else "good")
    assert (run.verdict["penetration"] > 0.1) is warns
    assert ("nothing penetrates" in run.log) is is_paired
    stays = [text for text in run.verdict["warnings"] if "overlap as a step begins" in text]
    assert len(stays) == (gap < 0) == ("nothing else penetrates" in run.log)
    if stays:
        assert re.match(r"bodies overlap as a step begins, by 0\.2 of an edge, node \d+ of body [23] is 0\.05 "
                        r"behind the edge .* of body [23]: no \*CONTACT PAIR", stays[0])


@pytest.mark.parametrize("cells", [(1, 1), (2, 3)])
def test_bodies_of_a_deck_without_contact_are_looked_at(tmp_path, cells):
    """A square falls into one of the same width: of single elements no node or edge crosses."""
    scene = Scene(0.05, 0.5)
    scene.block("LOWER", (0.0, 0.0), (1.0, 1.0), cells)
    scene.block("UPPER", (0.0, 1.1), (1.0, 1.0), cells, velocity=(0.0, -1.0))
    deck = scene.deck(AUTO)
    for card in ("*SURFACE INTERACTION", "*CONTACT PAIR", "*CONTACT FILE", "*CONTACT PRINT"):
        deck.remove(card)
    run = run_deck(deck, tmp_path, code=3)
    assert run.verdict["penetration"] >= 0.39 and run.history["penetration"][-1] >= 0.39
    assert "names the two; add one, or name all by *CONTACT" in run.verdict["reasons"][0]


def test_decks_made_anew():
    given = Deck("*CONTACT PAIR, INTERACTION=I, TYPE=<formulation>\nA, B\n*STEP\n*STATIC\n"
                 "*NODE FILE, FREQUENCY=5\nU, V\n*CONTACT PRINT\nCF\n*END STEP", "made")
    step = "*STEP\n*STATIC\n*NODE FILE\nU\n*END STEP\n"
    assert [with_sides(given, sides).text() for sides in (ONE, BOTH, ALL)] == [
        f"*CONTACT PAIR, INTERACTION=I, TYPE=<formulation>, SIDES=ONE\nA, B\n{step}",
        f"*CONTACT PAIR, INTERACTION=I, SIDES=BOTH, TYPE={NODES}\nA, B\n{step}",
        f"*CONTACT\n*CONTACT INCLUSIONS, ALL EXTERIOR\n{step}"]


@pytest.mark.parametrize(("name", "parameters"), [
    ("tied_rotation", {}),
    ("tied_spin", {"t_end": 1}),
    ("spinning_ring", {"t_end": 0.5}),
])
def test_what_meets_nothing_has_no_contact(tmp_path, name, parameters):
    """Tied pieces neither: with contact of everything with everything the bits are the same."""
    scene = FileScene(DECKS / f"{name}.inp")
    without, with_all = (run_deck(scene.deck(sides), tmp_path / sides, **parameters)
                         for sides in (ONE, ALL))
    assert with_all.history["active"].max() == 0
    assert with_all.digits(pairs=False) == without.digits(pairs=False)


@pytest.mark.parametrize(("name", "parameters"), [
    ("bar_on_wall", {"initiation": "PERSISTENT"}),
    ("rigid_bar", {}),
])
def test_all_with_all_meets_analytical_surfaces(tmp_path, name, parameters):
    """As the pair of the deck with the nodes of both sides held: the same motion."""
    scene = FileScene(DECKS / f"{name}.inp")
    both, everything = (run_deck(scene.deck(sides), tmp_path / sides, **parameters)
                        for sides in (BOTH, ALL))
    assert everything.history["active"].max() > 0
    assert everything.verdict["verdict"] == both.verdict["verdict"] == "good"
    moved = [run.fields()["displacement"] for run in (both, everything)]
    assert np.abs(moved[1] - moved[0]).max() <= 1e4*EPSILON*np.abs(moved[0]).max()


OWN_WALL = """*NODE
1, 0., -1.
2, 4., -1.
3, 4., 0.
4, 0., 0.
11, 1., 0.1
12, 2., 0.1
13, 2., 1.1
14, 1., 1.1
99, 0., 0.
*ELEMENT, TYPE=CPE4, ELSET=FLOOR
1, 1, 2, 3, 4
*ELEMENT, TYPE=CPE4, ELSET=BLOCK
2, 11, 12, 13, 14
*SURFACE, TYPE=SEGMENTS, NAME=WALL
START, 0., 0.
LINE, 4., 0.
*RIGID BODY, ELSET=FLOOR, ANALYTICAL SURFACE=WALL, REF NODE=99
*MATERIAL, NAME=M
*ELASTIC
1e4, 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=BLOCK, MATERIAL=M
*SOLID SECTION, ELSET=FLOOR, MATERIAL=M
*BOUNDARY
99, 1, 2
99, 6
*CONTACT
*CONTACT INCLUSIONS, ALL EXTERIOR
*STEP, NLGEOM
*DYNAMIC, DIRECT
0.01, 0.4
*DLOAD
BLOCK, GRAV, 10., 0., -1.
*NODE FILE
U
*END STEP
"""


def test_a_rigid_body_is_met_at_its_analytical_surface(tmp_path):
    """A block falls on a rigid one whose upper side is a surface of its own, too: it arrives after
    the time of a fall through 0.1, and never goes in."""
    run = run_deck(Deck(OWN_WALL), tmp_path)
    assert run.verdict["verdict"] == "good"
    foot = run.fields()["displacement"][:, 4:6, 1].min(axis=1)
    assert foot.min() >= -0.1 - 1e4*EPSILON and run.history["active"].max() > 0
    first = run.history["time"][np.argmax(run.history["active"] > 0)]
    assert first == pytest.approx(math.sqrt(0.02), abs=0.01)
