"""Linear and corotated sections: small strains beside large ones, exact balances, warnings."""

import math
import re

import numpy as np
import pytest
import scipy.linalg
from plain_scenes import AUTO, Scene
from scene_tools import (
    DECKS,
    Deck,
    coarse_ring,
    coarse_spinning_ring,
    emcon,
    number,
    run_deck,
)

from emcon import Stepper

EPS = np.finfo(float).eps


def balance(history):
    """The largest change of the total energy, by the largest energy that there is."""
    total = history["total"] - history["contact_work"]
    return np.abs(total - total[0]).max()/(history["kinetic"] + history["strain"]).max()


def linear(deck, name, kinematics="LINEAR"):
    """The deck with these kinematics in the section of the element set `name`."""
    deck.replace(f"ELSET={name}, MATERIAL", f"ELSET={name}, KINEMATICS={kinematics}, MATERIAL")
    return deck


# ---- statics ------------------------------------------------------------------------------------

LAWS = {"linear": "*ELASTIC\n1000., 0.3", "rubber": "*HYPERELASTIC, NEO HOOKE\n50., 0.002",
        "mixed": "*HYPERELASTIC, OGDEN, N=2\n40., 2., 10., -2., 0.01"}
PATCH = """*HEADING
patch
*NODE, NSET=ALL
1, 0., 0.
2, 1.1, 0.1
3, 2., 0.
4, 0., 1.
5, 0.9, 1.2
6, 2., 0.9
7, 0., 2.
8, 1.2, 2.
9, 2., 2.
*NSET, NSET=RIM
1, 2, 3, 4, 6, 7, 8, 9
*ELEMENT, TYPE=CPE4, ELSET=PATCH
1, 1, 2, 5, 4
2, 2, 3, 6, 5
3, 4, 5, 8, 7
4, 5, 6, 9, 8
*MATERIAL, NAME=STUFF
{law}
*SOLID SECTION, ELSET=PATCH, KINEMATICS=LINEAR, MATERIAL=STUFF
*STEP, NLGEOM
*STATIC
1., 1.
*BOUNDARY
{rim}
*NODE FILE
U
*EL FILE
S, E, ENER
*END STEP
"""


def patch(law):
    x = np.array([[0, 0], [1.1, .1], [2, 0], [0, 1], [2, .9], [0, 2], [1.2, 2], [2, 2]])
    slope = 1e-3*np.array([[2.0, 1.0], [0.5, -3.0]])
    rim = "\n".join(f"{node}, {a + 1}, {a + 1}, {number(slope[a] @ place)}" for node, place in
                    zip([1, 2, 3, 4, 6, 7, 8, 9], x) for a in range(2))
    return slope, Deck(PATCH.format(law=law, rim=rim))


@pytest.mark.parametrize("law", LAWS)
def test_a_patch_has_the_stress_of_the_law_at_rest(law, tmp_path):
    """Of any law: Lame's constants of the shear modulus and, if it has one, the bulk modulus."""
    slope, deck = patch(LAWS[law])
    run = run_deck(deck, tmp_path)
    mu, bulk = {"linear": (1000/2.6, 1000/1.2), "rubber": (100, 1000), "mixed": (50, 200)}[law]
    strain = (slope + slope.T)/2
    expected = (bulk - 2*mu/3)*np.trace(strain)*np.eye(2) + 2*mu*strain
    fields = run.fields()
    stress = fields["cauchy_stress"][-1][:, [0, 1, 3]]
    right = [expected[0, 0], expected[1, 1], expected[0, 1]]
    assert np.abs(stress - right).max() < 200*EPS*bulk*1e-3*bulk/mu
    assert run.history["strain"][-1] == pytest.approx(0.5*(expected*strain).sum()*3.9, rel=1e-12)


def test_statics_are_those_of_a_linear_analysis(tmp_path):
    deck = Deck.read(DECKS/"cantilever.inp")
    deck.replace("*STEP, NLGEOM", "*STEP")
    plain = run_deck(deck, tmp_path/"plain")
    deck = linear(Deck.read(DECKS/"cantilever.inp"), "BEAM")
    run = run_deck(deck, tmp_path/"section")
    u, expected = run.fields()["displacement"][-1], plain.fields()["displacement"][-1]
    assert np.abs(u - expected).max() < 1e-9*np.abs(expected).max()     # condition number times eps
    stress, expected = (r.fields()["cauchy_stress"] for r in (run, plain))
    assert np.abs(stress - expected).max() < 1e-8*np.abs(expected).max()
    assert run.verdict["linear_rotation"] > 0.05                        # half a radian, in truth
    assert any("BEAM is linear, but" in text for text in run.verdict["warnings"])
    assert "linear section BEAM: rotation up to" in run.log and "NOT small" in run.log
    assert "linear_rotation" not in plain.verdict


# ---- dynamics -----------------------------------------------------------------------------------


def beam(h=0.05, t_end=5.0, velocity=1e-3):
    """A cantilever of 20 x 2 elements whose free end moves upwards."""
    scene = Scene(h, t_end)
    scene.block("BEAM", (0, 0), (10, 1), (20, 2), stiffness=1000.0)
    scene.hold("BEAM", lambda x, y: x < .1)
    lines = [f"{n}, 2, {number(velocity*x*x)}" for n, (x, y) in scene.part["BEAM"].node.items()]
    scene.cards += ["*INITIAL CONDITIONS, TYPE=VELOCITY", *lines]
    deck = scene.deck(AUTO)
    for card in ("*SURFACE INTERACTION", "*CONTACT FILE", "*CONTACT PRINT"):
        deck.remove(card)
    return linear(deck, "BEAM")


def test_a_beam_swings_with_its_frequency_and_its_energy(tmp_path):
    """A mode of K and M, which moves by the scheme with tan(w h/2) = w_0 h/2."""
    deck = beam()
    path = deck.write(tmp_path/"beam.inp")
    with Stepper(path) as stepper:
        h, big = 0.05, 1e9
        mass = np.kron(stepper.mass.toarray(), np.eye(2))
        u = np.zeros_like(stepper.positions)
        free = np.repeat(stepper.positions[:, 0] > 0.1, 2)
        k = 2*(stepper.tangent(u, big).toarray() - 2/big**2*mass[np.ix_(free, free)])
        squares, modes = scipy.linalg.eigh(k, mass[np.ix_(free, free)])
        mode = np.zeros(free.size)
        mode[free] = modes[:, 0]
        stepper.set_state(v=mode.reshape(u.shape)*1e-3)
        turn, steps = 2*math.atan(math.sqrt(squares[0])*h/2), 100
        for _ in range(steps):
            stepper.step()
        amplitude = 1e-3/math.sqrt(squares[0])*math.sin(turn*steps)
        assert np.abs(stepper.u.ravel() - amplitude*mode).max() < 1e-9*np.abs(mode).max()*1e-3


def test_energy_of_a_beam_in_vibration(tmp_path):
    history = run_deck(beam(), tmp_path).history
    assert history["strain"].max() > 0.5*history["kinetic"].max()
    assert balance(history) < 1e-12


def test_small_vibrations_are_those_of_large_kinematics(tmp_path):
    """To the order of the rotations, with one correction in each increment."""
    runs = {}
    for kinematics in ("LINEAR", "NONLINEAR"):
        deck = beam()
        deck.replace("KINEMATICS=LINEAR", f"KINEMATICS={kinematics}")
        runs[kinematics] = run_deck(deck, tmp_path/kinematics)
    run, other = runs["LINEAR"], runs["NONLINEAR"]
    assert run.history["newton"].max() == 1
    rotation = run.verdict["linear_rotation"]
    assert 0.001 < rotation < 0.05
    assert np.abs(run.history["kinetic"] - other.history["kinetic"]).max() < (
        rotation*other.history["kinetic"].max())


def test_a_linear_body_in_fast_flight_vibrates(tmp_path):
    """Its momentum is that of the start, and no flight, ten lengths far, rounds its energy away."""
    scene = Scene(0.01, 1.0)
    scene.block("BODY", (0, 0), (4, 1), (8, 2))
    lines = [f"{n}, {a}, {number(v)}" for n, (x, y) in scene.part["BODY"].node.items()
             for a, v in ((1, 30 + 0.1*(x - 2)*(y - 0.5)), (2, 20 + 0.03*math.cos(math.pi*x)))]
    scene.cards += ["*INITIAL CONDITIONS, TYPE=VELOCITY", *lines]
    deck = scene.deck(AUTO)
    for card in ("*SURFACE INTERACTION", "*CONTACT FILE", "*CONTACT PRINT"):
        deck.remove(card)
    history = run_deck(linear(deck, "BODY"), tmp_path).history
    inner = history["total"] - (history["px"]**2 + history["py"]**2)/8      # mass 4
    assert history["strain"].max() > 0.3*inner[0] > 0
    for column in ("px", "py"):
        change = np.abs(history[column] - history[column][0]).max()
        assert change < 1e-13*abs(history[column][0])    # 100 increments of round-off
    assert np.abs(inner - inner[0]).max() < 100*EPS*history["total"][0]


# ---- beside others ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def rings(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rings")
    parameters = {"h": 0.02, "t_end": 0.8, "frame": 0.1}
    return [run_deck(deck, folder/name, **parameters) for name, deck in (
        ("linear", linear(coarse_ring(), "BLOCK")),
        ("full", coarse_ring()))]


def test_ring_on_a_linear_foundation(rings):
    run, full = (run.history for run in rings)
    assert run["active"].max() >= 3
    assert balance(run) < 1e-12
    assert run["penetration"].max() < 1e-12
    force, expected = np.diff(run["py"]), np.diff(full["py"])
    assert np.abs(force - expected).max() < 0.01*np.abs(expected).max()
    assert np.abs(run["kinetic"] - full["kinetic"]).max() < 0.01*full["kinetic"].max()
    assert rings[0].verdict["linear_rotation"] < 0.01
    assert rings[0].verdict["warning_count"] == rings[1].verdict["warning_count"]


def test_the_foundation_deforms_as_with_large_kinematics(rings):
    run, full = (run.fields() for run in rings)
    block = run.x[:, 1] <= 1e-9
    u, expected = (fields["displacement"][-1][block] for fields in (run, full))
    assert np.abs(expected).max() > 0
    assert np.abs(u - expected).max() < 0.01*np.abs(expected).max()


def test_initiations_and_formulations(tmp_path):
    for choice in ({"initiation": "MASSLESS", "formulation": "MORTAR"},
                   {"initiation": "MASSLESS"}, {"method": "SADDLE POINT"}):
        deck = linear(coarse_ring(), "BLOCK")
        run = run_deck(deck, tmp_path, h=0.02, t_end=0.4, frame=1, **choice)
        assert run.history["active"].max() >= 2
        assert balance(run.history) < 1e-12


def test_tied_and_loaded(tmp_path):
    """A linear layer tied between others, under weight and a pressure: balance and reactions."""
    scene = Scene(0.05, 1.0, gravity=0.5)
    scene.block("LOW", (0, 0), (3, 1), (3, 1)).hold("LOW", lambda x, y: y < .1)
    scene.block("MIDDLE", (0, 1), (3, 1), (5, 2))
    scene.block("HIGH", (0, 2), (3, 1), (4, 1))
    sides = (("B", "MIDDLE", 1), ("A", "LOW", 1), ("C", "MIDDLE", 2), ("D", "HIGH", 2))
    for name, body, height in sides:
        scene.side(name, body, lambda x, y, at=height: abs(y - at) < 1e-9)
    deck = scene.deck(AUTO)
    deck.remove("*CONTACT PAIR")
    deck.remove("*CONTACT PAIR")
    deck.remove("*CONTACT PAIR")
    for card in ("*CONTACT FILE", "*CONTACT PRINT", "*SURFACE INTERACTION"):
        deck.remove(card)
    deck.insert("*TIE, NAME=ONE\nB, A\n*TIE, NAME=TWO\nC, D\n", before="*STEP")
    high = next(iter(scene.part["HIGH"].element))
    deck.insert(f"*DLOAD\n{high}, P3, 2.\n", before="*NODE FILE")
    run = run_deck(linear(deck, "MIDDLE"), tmp_path)
    assert balance(run.history) < 1e-12
    assert run.history["strain"].max() > 0


# ---- units and restart --------------------------------------------------------------------------


def test_restart_goes_on_with_the_same_bits(tmp_path):
    deck = linear(coarse_ring(), "BLOCK")
    deck.set_parameter("h", 0.02)
    path = deck.write(tmp_path/"deck.inp")
    with Stepper(path) as whole:
        for _ in range(12):
            whole.step()
        assert whole.active.any()
        whole.write_restart(tmp_path/"half.rst.h5")
        with Stepper.from_restart(tmp_path/"half.rst.h5") as rest:
            for _ in range(8):
                whole.step()
                rest.step()
            assert (rest.u == whole.u).all() and (rest.v == whole.v).all()
            assert rest.ledger == whole.ledger


def test_the_record_of_rotations_goes_into_the_restart_file(tmp_path):
    deck = beam(velocity=0.1, t_end=1.0)
    whole = run_deck(deck, tmp_path/"whole")
    deck.insert("*RESTART, WRITE, FREQUENCY=5\n", before="*NODE FILE")
    deck.replace("INC=1000000", "INC=10")
    run_deck(deck, tmp_path/"part", code=3)
    done = emcon("restart", tmp_path/"part"/"scene.rst.h5", "--quiet")
    assert done.returncode == 3                           # no increments are left, none is made
    assert whole.verdict["linear_rotation"] > 0.05


# ---- what is refused ----------------------------------------------------------------------------


def spinner(t_end, **more):
    scene = Scene(0.01, t_end)
    scene.block("BODY", (0, 0), (2, 1), (4, 2), **more)
    deck = scene.deck(AUTO)
    for card in ("*SURFACE INTERACTION", "*CONTACT FILE", "*CONTACT PRINT"):
        deck.remove(card)
    return linear(deck, "BODY")


def test_a_linear_body_must_not_spin(tmp_path):
    run = run_deck(spinner(1.0, spin=0.5), tmp_path, code=2)
    assert "section BODY is linear, but its initial velocities turn the body of element 1 by " \
        "0.5 rad" in run.errors, run.errors
    run_deck(spinner(0.1, spin=0.5), tmp_path)            # 0.05 rad
    run = run_deck(spinner(0.5, velocity=(3, 1)), tmp_path)
    assert balance(run.history) < 1e-12                   # it flies, and does not deform
    assert run.verdict["linear_rotation"] < 1e-12


# ---- corotated ----------------------------------------------------------------------------------


def test_a_corotated_ring_spins_and_vibrates(tmp_path):
    """All momenta and the energy to round-off, over a turn and a half; close to large strains."""
    runs = [run_deck(deck, tmp_path/str(k), t_end=2.0) for k, deck in enumerate(
        (linear(coarse_spinning_ring(), "RING", "COROTATED"), coarse_spinning_ring()))]
    history = runs[0].history
    assert history["strain"].max() > 0.01*history["kinetic"].max()
    assert balance(history) < 1e-12
    for column in ("px", "py", "lz"):
        change = np.abs(history[column] - history[column][0]).max()
        assert change < 1e-12*np.abs(history["lz"][0]), column
    strain = runs[0].verdict["linear_strain"]
    other = runs[1].history["strain"]
    assert np.abs(history["strain"] - other).max() < 3*strain*other.max()


def test_corotated_bodies_in_contact(tmp_path):
    for choice in ({"formulation": "MORTAR"}, {"initiation": "MASSLESS"}):
        deck = Deck.read(DECKS/"two_bodies.inp")
        for name in re.findall(r"\*SOLID SECTION, ELSET=(\w+)", deck.text()):
            linear(deck, name, "COROTATED")
        history = run_deck(deck, tmp_path, h=0.02, frame=1, **choice).history
        assert (history["active"] > 0).any()
        assert balance(history) < 1e-12
        scale = math.sqrt(2*history["kinetic"].max())
        for column in ("px", "py", "lz"):
            assert np.abs(history[column] - history[column][0]).max() < 1e-12*scale, column


@pytest.mark.parametrize("angle", [0.5, 2.0, 3.1])
def test_stress_turns_with_the_body(angle, tmp_path):
    """A patch with the strain of the linear one, turned in 20 increments."""
    slope, deck = patch(LAWS["rubber"])
    slope = (slope + slope.T)/2
    x = np.array([[0, 0], [1.1, .1], [2, 0], [0, 1], [2, .9], [0, 2], [1.2, 2], [2, 2]])
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    k = deck.find("*BOUNDARY")
    deck.card[k][1][:] = [
        f"{node}, {a + 1}, {a + 1}, {number(((turn @ (np.eye(2) + slope) - np.eye(2)) @ place)[a])}"
        for node, place in zip([1, 2, 3, 4, 6, 7, 8, 9], x) for a in range(2)]
    deck.replace("KINEMATICS=LINEAR", "KINEMATICS=COROTATED")
    run = run_deck(deck, tmp_path)
    mu, bulk = 100, 1000
    expected = turn @ ((bulk - 2*mu/3)*np.trace(slope)*np.eye(2) + 2*mu*slope) @ turn.T
    stress = run.fields()["cauchy_stress"][-1][:, [0, 1, 3]]
    right = [expected[0, 0], expected[1, 1], expected[0, 1]]
    assert np.abs(stress - right).max() < 1e-9*np.abs(expected).max()
    assert run.verdict["linear_strain"] < 0.1                          # none of the turn
