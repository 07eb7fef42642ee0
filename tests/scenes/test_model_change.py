"""`*MODEL CHANGE, TYPE=CONTACT PAIR`: pairs that act in some steps, in the plane and in space.

A block flies at a floor, or is pressed on it. Without its pair it flies on; with it the run is that of a
pair that acts throughout.
"""

from __future__ import annotations

from pathlib import Path

import emcon
import numpy as np
import pytest
import wall_space_scenes as walls
from contact_space_scenes import dynamic
from plain_scenes import BOTH, ONE, Scene, below
from scene_tools import EPSILON, Deck, Run, attempt, run_deck

REMOVE = "*MODEL CHANGE, TYPE=CONTACT PAIR, REMOVE\nBLOCK, FLOOR\n"
ADD = "*MODEL CHANGE, TYPE=CONTACT PAIR, ADD\nBLOCK, FLOOR\n"
KINDS = [(2, "NODE TO SURFACE", ONE), (2, "NODE TO SURFACE", BOTH), (2, "MORTAR", ONE), (2, "SEGMENT", ONE),
         (3, "NODE TO SURFACE", ONE), (3, "NODE TO SURFACE", BOTH), (3, "MORTAR", ONE)]
EACH = pytest.mark.parametrize(("n_dim", "formulation", "sides"), KINDS)
GAP = 0.25


def scene(n_dim: int, gap: float = GAP, v: float = -1.0) -> Scene:
    """A block over a floor that is held; it falls with `v` and flies sideways."""
    new = Scene(0.01, 0.2)
    along = (0.0,)*(n_dim - 1)
    cells = (2,)*n_dim
    new.block("BLOCK", (*along, gap), (1.0,)*n_dim, cells, velocity=(0.3*bool(v), *([0.1*bool(v)]*(n_dim - 2)), v))
    new.block("FLOOR", (-1.0,)*n_dim, (*([3.0]*(n_dim - 1)), 1.0), (*([3]*(n_dim - 1)), 1)).hold("FLOOR", below(-1.0))
    return new


def deck(scene: Scene, sides: str, steps: list[tuple[float, str]]) -> Deck:
    """A deck with steps of these lengths, each with cards of its own."""
    text = scene.deck(sides).text()
    start = text.index("*STEP")
    step = text[start:]
    return Deck(text[:start] + "".join(
        step.replace("<t_end>", repr(length)).replace("*CONSTRAINT METHOD", cards + "*CONSTRAINT METHOD", 1)
        for length, cards in steps), "deck")


def same(one: Run, other: Run) -> None:
    """The same history, to the last bit."""
    assert one.history.dtype == other.history.dtype
    for name in one.history.dtype.names:
        if not name.startswith("cpu"):
            assert np.array_equal(one.history[name], other.history[name], equal_nan=True), name


@EACH
def test_a_pair_acts_from_its_step_on(n_dim: int, formulation: str, sides: str, tmp_path: Path) -> None:
    """Taken in before surfaces meet it is a pair that always acts; energy and momentum along stay."""
    always = run_deck(deck(scene(n_dim), sides, [(0.2, ""), (0.4, "")]), tmp_path/"1", formulation=formulation)
    later = run_deck(deck(scene(n_dim), sides, [(0.2, REMOVE), (0.4, ADD)]), tmp_path/"2", formulation=formulation)
    same(always, later)
    assert later.verdict["verdict"] == "good" and later.history["active"].max() > 0
    assert np.ptp(later.history["total"]) <= 64*EPSILON*later.history["total"][0]
    assert "contact of surfaces BLOCK and FLOOR does not act in this step" in later.log


@EACH
def test_without_its_pair_a_block_flies_on(n_dim: int, formulation: str, sides: str, tmp_path: Path) -> None:
    """Through the floor, which the verdict says; a step that takes the pair in then is refused."""
    done, run = attempt(deck(scene(n_dim), sides, [(0.2, REMOVE), (0.3, "")]), tmp_path/"1", (),
                        {"formulation": formulation})
    assert done.returncode == 3
    assert "no *CONTACT PAIR that acts then names the two" in run.verdict["reasons"][0]
    assert np.ptp(run.history["kinetic"]) <= 64*EPSILON*run.history["kinetic"][0]
    assert run.history["active"].max() == 0
    done, run = attempt(deck(scene(n_dim), sides, [(0.4, REMOVE), (0.1, ADD)]), tmp_path/"2", (),
                        {"formulation": formulation})
    assert done.returncode == 2
    assert "overlap as step 2 takes their pair in" in done.stderr and "*CONTACT INTERFERENCE, SHRINK" in done.stderr


@EACH
def test_a_pair_that_is_taken_out_lets_go(n_dim: int, formulation: str, sides: str, tmp_path: Path) -> None:
    """In the middle of an impact: its forces end, and energy stays."""
    cards = deck(scene(n_dim), sides, [(0.3, ""), (0.04, REMOVE)])
    history = attempt(cards, tmp_path, (), {"formulation": formulation})[1].history
    force = history["pair1_force_" + "xyz"[n_dim - 1]]
    assert history["active"][30] > 0 and not history["active"][31:].any() and force[30] and not force[31:].any()
    assert np.ptp(history["total"]) <= 64*EPSILON*history["total"][0]


@pytest.mark.parametrize(("n_dim", "formulation", "sides"), [KINDS[0], KINDS[2], KINDS[4], KINDS[6]])
def test_restart_of_steps_that_change_pairs(n_dim: int, formulation: str, sides: str, tmp_path: Path) -> None:
    """From within a step without the pair, one with it, and one without it again: the bits of a run that goes through."""
    path = deck(scene(n_dim), sides, [(0.2, REMOVE), (0.4, ADD), (0.1, REMOVE)]).write(tmp_path/"deck.inp")
    for increments in (7, 20, 27, 65):
        with emcon.Stepper(path, formulation=formulation) as whole:
            for _ in range(increments):
                whole.step()
            whole.write_restart(tmp_path/"deck.rst.h5")
            with emcon.Stepper.from_restart(tmp_path/"deck.rst.h5") as again:
                for _ in range(70 - increments):
                    whole.step()
                    again.step()
                assert np.array_equal(whole.u, again.u) and np.array_equal(whole.v, again.v)
                assert whole.energies() == again.energies() and whole.is_done and again.is_done


def statics(n_dim: int, sides: str, steps: list[tuple[float, str]]) -> Deck:
    """Steps of statics, each of which moves the top of the block to a place in one increment."""
    new = scene(n_dim, 0.0, 0.0)
    top = [label for label, place in new.part["BLOCK"].node.items() if place[-1] >= 1.0 - 1e-9]
    text = new.deck(sides).text()
    start = text.index("*STEP")
    step = text[start:].replace("*DYNAMIC, DIRECT\n<h>, <t_end>", "*STATIC\n1., 1.")
    step = step.replace("*CONTACT INITIATION, TYPE=<initiation>\n", "")
    out = text[:start]
    for place, cards in steps:
        moves = "".join(f"{label}, {axis}, {axis}, {place if axis == n_dim else 0.0!r}\n"
                        for label in top for axis in range(1, n_dim + 1))
        out += step.replace("*CONSTRAINT METHOD", f"*BOUNDARY\n{moves}{cards}*CONSTRAINT METHOD", 1)
    return Deck(out, "deck")


@EACH
def test_static_steps_with_and_without_a_pair(n_dim: int, formulation: str, sides: str, tmp_path: Path) -> None:
    """Pressed, lifted without the pair and pressed again: nothing is left in between, and the forces are the same."""
    run = run_deck(statics(n_dim, sides, [(-0.02, ""), (0.01, REMOVE), (-0.02, ADD)]), tmp_path, formulation=formulation)
    assert run.verdict["verdict"] == "good"
    force = run.history[f"pair1_force_{'xyz'[n_dim - 1]}"]
    strain = run.history["strain"]
    assert abs(force[1]) > 1.0 and abs(force[2]) <= 1e-10*abs(force[1]) and force[3] == pytest.approx(force[1], rel=1e-9)
    assert strain[2] <= 1e-18*strain[1] and strain[3] == pytest.approx(strain[1], rel=1e-9)


@EACH
def test_an_overlap_that_a_step_takes_in_is_resolved(n_dim: int, formulation: str, sides: str, tmp_path: Path) -> None:
    """Moved into the floor without the pair, and pushed out evenly as that begins: the forces of pressing it on."""
    shrink = "*CONTACT INTERFERENCE, SHRINK\n"
    one = run_deck(statics(n_dim, sides, [(-0.02, "")]), tmp_path/"1", formulation=formulation)
    deck = statics(n_dim, sides, [(-0.02, REMOVE), (-0.02, ADD + shrink)])
    done, two = attempt(deck, tmp_path/"2", (), {"formulation": formulation})
    force = f"pair1_force_{'xyz'[n_dim - 1]}"
    assert two.history[force][-2] == 0 and two.history[force][-1] == pytest.approx(one.history[force][-1], rel=1e-9)
    assert two.history["strain"][-1] == pytest.approx(one.history["strain"][-1], rel=1e-9)


def soft(cards: Deck, behavior: str) -> Deck:
    text = cards.text().replace("*CONSTRAINT METHOD, TYPE=<method>\n", "")
    return Deck(text.replace("*SURFACE INTERACTION, NAME=SMOOTH\n", "*SURFACE INTERACTION, NAME=SMOOTH\n"
                             f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE={behavior}\n"), "deck")


@pytest.mark.parametrize("behavior", ["LINEAR\n500.", "EXPONENTIAL\n.05, 5.", "TABULAR\n0., -.01\n2., .01\n30., .1"])
@pytest.mark.parametrize(("n_dim", "formulation"), [(2, "NODE TO SURFACE"), (2, "MORTAR"), (3, "NODE TO SURFACE")])
def test_what_soft_contact_stores_goes_out_with_it(n_dim: int, formulation: str, behavior: str, tmp_path: Path) -> None:
    """As external work, to round-off."""
    cards = soft(deck(scene(n_dim, 0.05), ONE, [(0.12, ""), (0.02, REMOVE)]), behavior)
    history = attempt(cards, tmp_path, (), {"formulation": formulation})[1].history
    stored = history["contact_energy"]
    assert stored[12] > 1e-3 and not stored[13:].any()
    assert history["external_work"][13] == pytest.approx(-stored[12], rel=1e-12)
    assert np.ptp(history["total"]) <= 1e-12*history["total"][0]


@pytest.mark.parametrize("n_dim", [2, 3])
def test_what_soft_contact_stores_as_it_begins_comes_in(n_dim: int, tmp_path: Path) -> None:
    """A pressure that acts over a clearance: what it stores there is external work, as much as it stores in a run that
    begins there, and no more."""
    behavior = "EXPONENTIAL\n.05, 5."
    later = soft(deck(scene(n_dim, 0.05, -0.01), ONE, [(0.05, REMOVE), (0.3, ADD)]), behavior)
    there = soft(deck(scene(n_dim, 0.0495, -0.01), ONE, [(0.01, "")]), behavior)
    history = run_deck(later, tmp_path/"1", formulation="NODE TO SURFACE").history
    energy = run_deck(there, tmp_path/"2", formulation="NODE TO SURFACE").history["contact_energy"][0]
    assert energy > 0 and not history["external_work"][:6].any()
    assert history["external_work"][6:] == pytest.approx(energy, rel=1e-9) and np.ptp(history["external_work"][6:]) == 0
    assert np.ptp(history["total"]) <= 1e-12*energy


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "MORTAR"])
def test_friction_and_massless_surfaces_let_go(formulation: str, tmp_path: Path) -> None:
    """Of blocks that stick, in steps without the pair friction takes nothing and nothing pushes."""
    for initiation in ("PERSISTENT", "MASSLESS"):
        cards = deck(scene(2, 0.05), ONE, [(0.12, ""), (0.02, REMOVE)])
        text = Deck(cards.text().replace("*SURFACE INTERACTION, NAME=SMOOTH\n",
                                         "*SURFACE INTERACTION, NAME=SMOOTH\n*FRICTION\n.5\n"), "deck")
        history = attempt(text, tmp_path/initiation, (), {"formulation": formulation, "initiation": initiation})[1].history
        assert history["friction_loss"][12] > 1e-4 and np.ptp(history["friction_loss"][12:]) == 0
        assert not history["active"][13:].any()
        balance = history["total"] + history["friction_loss"]
        assert np.ptp(balance) <= 1e-11*balance[0]


def test_explicit_steps_change_pairs(tmp_path: Path) -> None:
    """A block flies on without its pair, and bounces with it."""
    cards = deck(scene(2), ONE, [(0.2, REMOVE), (0.4, ADD)])
    text = cards.text().replace("*DYNAMIC, DIRECT\n<h>", "*DYNAMIC, DIRECT, EXPLICIT\n0.002")
    for card in ("*CONSTRAINT METHOD, TYPE=<method>", "*CONTACT INITIATION, TYPE=<initiation>",
                 "*NEWTON, TOLERANCE=<tolerance>"):
        text = text.replace(card + "\n", "")
    history = run_deck(Deck(text, "deck"), tmp_path, formulation="NODE TO SURFACE").history
    assert not history["active"][history["time"] < 0.2].any() and history["active"].any()
    assert history["py"][-1] > 0.3


@pytest.mark.parametrize("kind", ["", ", TYPE=MORTAR"])
def test_walls_act_in_steps_of_their_pairs(kind: str, tmp_path: Path) -> None:
    """A plane in space: bounced off with its pair, flown through without it, which the verdict does not mind."""
    remove, add = REMOVE.replace("BLOCK, FLOOR", "S1, W"), ADD.replace("BLOCK, FLOOR", "S1, W")
    block = walls.cube(gap=0.2)

    def steps(*changes: str) -> Deck:
        text = walls.falling(block, walls.plane(), (0.3, 0.1, -1.0), h=0.01, until=0.15, more=changes[0], options=kind)
        return Deck(text + "".join(dynamic(0.01, 0.3, change) for change in changes[1:]), "deck")

    with_it = run_deck(steps("", ""), tmp_path/"1")
    same(with_it, run_deck(steps(remove, add), tmp_path/"2"))
    assert with_it.history["pz"][-1] > 0
    history = run_deck(steps(remove, ""), tmp_path/"3").history
    assert np.ptp(history["kinetic"]) <= 64*EPSILON*history["kinetic"][0] and not history["active"].any()
