"""Sections without inertia in dynamic steps: balances, the motion that they leave, what is refused."""

import math

import numpy as np
import pytest
import scipy.linalg
from plain_scenes import AUTO, Scene
from scene_tools import Deck, coarse_ring, run_deck
from test_linear import balance

from emcon import Stepper


def massless(deck, name, more=""):
    """The deck with MASSLESS in the section of the element set `name`."""
    deck.replace(f"ELSET={name}, MATERIAL", f"ELSET={name}, MASSLESS{more}, MATERIAL")
    return deck


def without_contact(scene):
    deck = scene.deck(AUTO)
    for card in ("*SURFACE INTERACTION", "*CONTACT FILE", "*CONTACT PRINT"):
        deck.remove(card)
    while "*CONTACT PAIR" in deck.text():
        deck.remove("*CONTACT PAIR")
    return deck


def column(h=0.02, t_end=0.5, more=""):
    """A column of two blocks in one: the lower half, held below, has no inertia."""
    scene = Scene(h, t_end)
    scene.block("COLUMN", (0, 0), (1, 4), (2, 8), stiffness=1000.0)
    scene.hold("COLUMN", lambda x, y: y < .1)
    deck = without_contact(scene)
    deck.insert("*ELSET, ELSET=LOW, GENERATE\n1, 4\n9, 12\n*ELSET, ELSET=HIGH, GENERATE\n5, 8\n"
                "13, 16\n", before="*MATERIAL")
    k = deck.find("*SOLID SECTION")
    deck.card[k:k + 1] = [(f"*SOLID SECTION, ELSET={name}, MATERIAL=COLUMN{flag}", ["1."])
                          for name, flag in (("LOW", ", MASSLESS" + more), ("HIGH", more))]
    return deck


# ---- motion -------------------------------------------------------------------------------------


def test_a_mode_on_a_massless_column(tmp_path):
    """K condensed on what has mass: the scheme has tan(w h/2) = w_0 h/2, and the rest follows."""
    h, big, steps, speed = 0.02, 1e9, 60, 1e-3
    with Stepper(column(h, 2.0, more=", KINEMATICS=LINEAR").write(tmp_path/"deck.inp")) as stepper:
        mass = np.kron(stepper.mass.toarray(), np.eye(2))
        u = np.zeros_like(stepper.positions)
        free = np.flatnonzero(np.repeat(stepper.positions[:, 1] > 0.1, 2))
        m = mass[np.ix_(free, free)]
        k = 2*(stepper.tangent(u, big).toarray() - 2/big**2*m)
        has = np.diag(m) > 0
        assert 0 < has.sum() < has.size
        assert not m[~has].any()
        follows = -np.linalg.solve(k[np.ix_(~has, ~has)], k[np.ix_(~has, has)])
        squares, modes = scipy.linalg.eigh(k[np.ix_(has, has)] + k[np.ix_(has, ~has)] @ follows,
                                           m[np.ix_(has, has)])
        mode = np.zeros(u.size)
        mode[free[has]] = modes[:, 0]
        stepper.set_state(v=speed*mode.reshape(u.shape))
        mode[free[~has]] = follows @ modes[:, 0]
        turn = 2*math.atan(math.sqrt(squares[0])*h/2)
        before = u
        for _ in range(steps):
            before = stepper.u.copy()
            stepper.step()
        amplitude = speed/math.sqrt(squares[0])*math.sin(turn*steps)
        assert np.abs(stepper.u.ravel() - amplitude*mode).max() < 1e-9*speed*np.abs(mode).max()
        shown = stepper.v.ravel()[free[~has]]
        expected = ((stepper.u - before)/h).ravel()[free[~has]]
        assert np.abs(shown - expected).max() <= 1e-9*np.abs(expected).max()


@pytest.mark.parametrize("choice", [
    {"initiation": "PERSISTENT", "formulation": "NODE TO SURFACE"},
    {"initiation": "MASSLESS", "formulation": "NODE TO SURFACE"},
    {"initiation": "MASSLESS", "formulation": "MORTAR"},
    {"initiation": "ADMISSIBLE", "formulation": "MORTAR"}], ids=lambda c: " ".join(c.values()))
def test_ring_on_a_quasi_static_foundation(choice, tmp_path):
    deck = massless(coarse_ring(), "BLOCK")
    deck.replace("*DENSITY\n0.01\n*SOLID SECTION", "*SOLID SECTION")     # STIFF needs none
    assert deck.text().count("*DENSITY") == 1
    history = run_deck(deck, tmp_path, h=0.02, t_end=0.8, frame=1, **choice).history
    assert history["active"].max() >= 3
    assert balance(history) < 1e-12
    if choice["initiation"] == "MASSLESS":
        assert history["stand_off"].max() < 1e-12
    assert np.abs(history["px"] - history["px"][0]).max() < 0.02*history["px"][0]


def buffer(h=0.01, t_end=1.0):
    """Two free bodies that collide askew; a half of one of them has no inertia."""
    scene = Scene(h, t_end)
    scene.block("LEFT", (0, 0), (2, 1), (6, 3), velocity=(1, 0.1), stiffness=200.0)
    scene.block("RIGHT", (2.1, 0.3), (2, 1), (5, 4), velocity=(-0.5, 0), stiffness=200.0, turn=0.05)
    scene.pairs = [("LEFT", "RIGHT")]
    deck = scene.deck(AUTO)
    columns = [range(3*k + 1, 3*k + 4) for k in range(6)]
    sets = {"REAR": columns[:3], "FRONT": columns[3:]}
    text = "".join(f"*ELSET, ELSET={name}\n" + "".join(f"{e}\n" for c in part for e in c)
                   for name, part in sets.items())
    deck.insert(text, before="*MATERIAL")
    k = deck.find("*SOLID SECTION")
    deck.card[k:k + 1] = [(f"*SOLID SECTION, ELSET={name}, MATERIAL=LEFT{flag}", ["1."])
                          for name, flag in (("REAR", ""), ("FRONT", ", MASSLESS"))]
    return deck


@pytest.mark.parametrize("initiation", ["PERSISTENT", "MASSLESS"])
def test_momenta_of_free_bodies(initiation, tmp_path):
    history = run_deck(buffer(), tmp_path, formulation="NODE TO SURFACE",
                       initiation=initiation).history
    assert history["active"].max() >= 2 and history["active"][-1] == 0
    assert balance(history) < 1e-12
    scale = math.sqrt(2*history["kinetic"].max()*4)
    for column in ("px", "py", "lz"):
        assert np.abs(history[column] - history[column][0]).max() < 1e-12*scale, column


def test_restart_goes_on_with_the_same_bits(tmp_path):
    deck = buffer()
    deck.set_parameter("initiation", "MASSLESS")
    path = deck.write(tmp_path/"deck.inp")
    with Stepper(path) as whole:
        for _ in range(20):
            whole.step()
        whole.write_restart(tmp_path/"half.rst.h5")
        with Stepper.from_restart(tmp_path/"half.rst.h5") as rest:
            for _ in range(20):
                whole.step()
                rest.step()
            assert (rest.u == whole.u).all() and (rest.v == whole.v).all()
            assert rest.ledger == whole.ledger


# ---- statics, weight, the start -----------------------------------------------------------------


def hanging(card, more=""):
    """A column of which the upper half has inertia, pulled at the top of the lower one."""
    deck = column(more=more)
    deck.insert(f"{card}, OP=MOD\n13, 2, 3.\n", before="*NODE FILE")
    return deck


def test_statics_have_no_inertia_anyway(tmp_path):
    fields = []
    for flag in (True, False):
        deck = hanging("*CLOAD")
        deck.replace("*DYNAMIC, DIRECT\n<h>, <t_end>", "*STATIC\n1., 1.")
        if not flag:
            deck.replace(", MASSLESS", "")
        run = run_deck(deck, tmp_path/str(flag))
        assert ("MASSLESS has no effect" in run.errors) == flag
        fields.append(run.fields()["displacement"])
    assert (fields[0] == fields[1]).all()


def test_a_load_that_begins_at_once_is_told(tmp_path):
    once = run = run_deck(hanging("*CLOAD"), tmp_path/"once")
    assert any("a force of 3 is not balanced at node 13" in w for w in run.verdict["warnings"])
    assert balance(run.history) < 1e-12
    run = run_deck(hanging("*CLOAD, AMPLITUDE=RAMP"), tmp_path/"ramp")
    assert run.verdict["warning_count"] == 0
    swing, ramp = (np.abs(np.diff(r.fields()["displacement"][:, 12, 1], 3)).max()
                   for r in (once, run))
    assert swing > 30*ramp                                     # from increment to increment


def test_a_static_step_puts_into_balance(tmp_path):
    deck = hanging("*CLOAD")
    text = deck.text()
    first = text.index("*STEP")
    static = text[first:].replace("*DYNAMIC, DIRECT\n<h>, <t_end>", "*STATIC\n1., 1.")
    run = run_deck(Deck(text[:first] + static + text[first:]), tmp_path)
    assert run.verdict["warning_count"] == 0
    moves = run.history["time"] > 1
    assert run.history["kinetic"][moves].max() < 1e-20*run.history["strain"].max()


def test_weight_is_that_of_the_density(tmp_path):
    """Half of the column has no inertia; its weight is borne all the same: the reaction has it."""
    scene = Scene(0.02, 1.0, gravity=2.0)
    scene.block("COLUMN", (0, 0), (1, 4), (2, 8)).hold("COLUMN", lambda x, y: y < .1)
    deck = without_contact(scene)
    deck.replace("*DYNAMIC, DIRECT\n<h>, <t_end>", "*STATIC\n1., 1.")
    deck.replace("*NODE FILE\nU", "*NODE FILE\nU, RF")
    reaction = run_deck(massless(deck, "COLUMN"), tmp_path).fields()["reaction_force"][-1]
    assert reaction[:, 1].sum() == pytest.approx(8.0, rel=1e-9)


# ---- what is refused ----------------------------------------------------------------------------


def test_what_is_massless_must_be_held(tmp_path):
    scene = Scene(0.01, 0.1)
    scene.block("LOOSE", (0, 0), (1, 1), (2, 2))
    scene.block("FLOOR", (-1, -1), (3, 1), (3, 1)).hold("FLOOR", lambda x, y: y < -.9)
    run = run_deck(massless(scene.deck(AUTO), "LOOSE"), tmp_path, code=3)
    assert "a MASSLESS section has no inertia to hold it, and contact may open: the body of " \
        "element 1 is free to move in x, move in y, rotate; add *BOUNDARY" in run.errors
    scene.hold("LOOSE", lambda x, y: y > .9, axes="1, 1")
    run = run_deck(massless(scene.deck(AUTO), "LOOSE"), tmp_path, code=3)
    assert "free to move in y" in run.errors
    scene.hold("LOOSE", lambda x, y: y > .9, axes="2, 2")
    run_deck(massless(scene.deck(AUTO), "LOOSE"), tmp_path)


def test_contact_that_pushes_masses_is_refused(tmp_path):
    deck = massless(coarse_ring(), "BLOCK")
    run = run_deck(deck, tmp_path, code=2, initiation="VELOCITY UPDATE")
    assert "TYPE=VELOCITY UPDATE needs masses, but a surface in contact is of a MASSLESS" \
        in run.errors
    scene = Scene(0.01, 0.1)
    scene.block("LOW", (0, 0), (3, 1), (3, 1)).hold("LOW", lambda x, y: y < .1)
    scene.block("PAD", (0, 1), (3, 1), (5, 2)).block("BALL", (1, 2.1), (1, 1), (2, 2))
    scene.side("A", "LOW", lambda x, y: y > .9).side("B", "PAD", lambda x, y: y < 1.1)
    scene.pairs = [("BALL", "PAD")]
    deck = massless(scene.deck(AUTO), "PAD")
    deck.insert("*TIE, NAME=JOINT\nB, A\n", before="*STEP")
    run = run_deck(deck, tmp_path/"tie", code=2, initiation="MASSLESS")
    assert "is not for MASSLESS sections in contact that are also in a *TIE" in run.errors
    run_deck(deck, tmp_path/"tie")


def test_everything_massless_is_refused(tmp_path):
    scene = Scene(0.01, 0.1)
    scene.block("BODY", (0, 0), (1, 1), (2, 2)).hold("BODY", lambda x, y: y < .1)
    run = run_deck(massless(without_contact(scene), "BODY"), tmp_path, code=2)
    assert "all sections are MASSLESS: nothing has inertia; use *STATIC" in run.errors
