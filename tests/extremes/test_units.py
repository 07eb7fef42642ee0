"""The ring scene in other units, and far from the origin.

Units scaled by powers of two change exponents only: all figures must be the same bit for bit.
"""

import numpy as np
import pytest
from scene_tools import DECKS, Deck, coarse_ring, number, run_deck

# Powers of length, mass and time in the columns of the history.
DIMENSION = {
    "increment": (0, 0, 0),
    "time": (0, 0, 1),
    "h": (0, 0, 1),
    "kinetic": (2, 1, -2),
    "strain": (2, 1, -2),
    "external_work": (2, 1, -2),
    "contact_work": (2, 1, -2),
    "stabilization": (2, 1, -2),
    "restitution_loss": (2, 1, -2),
    "scheme_loss": (2, 1, -2),
    "damping_loss": (2, 1, -2),
    "friction_loss": (2, 1, -2),
    "contact_damping_loss": (2, 1, -2),
    "contact_energy": (2, 1, -2),
    "total": (2, 1, -2),
    "px": (1, 1, -1),
    "py": (1, 1, -1),
    "lz": (2, 1, -1),
    "active": (0, 0, 0),
    "newton": (0, 0, 0),
    "cuts": (0, 0, 0),
    "penetration": (0, 0, 0),
    "stand_off": (0, 0, 0),
    "pair1_force_x": (1, 1, -2),
    "pair1_force_y": (1, 1, -2),
    "pair1_impulse_x": (1, 1, -1),
    "pair1_impulse_y": (1, 1, -1),
    "pair1_center_x": (1, 0, 0),
    "pair1_center_y": (1, 0, 0),
    "pair1_duration": (0, 0, 1),
    "pair1_active": (0, 0, 0),
}

# Exponents of two of the units of length, mass and time; the thickness is a length too.
UNITS = [(3, 0, 0), (0, 5, 0), (0, 0, -4), (-10, 20, -7), (1, 1, 1), (-40, 33, 17), (100, -90, 60)]


def dimension_of_stress(length, mass, time):
    return mass - length - 2*time


def in_units(length, mass, time, **parameters):
    """The ring deck with lengths multiplied by 2**length, and so on."""

    def scale(exponent):
        return lambda text: number(np.ldexp(float(text), exponent))

    deck = coarse_ring()
    x, v, t = scale(length), scale(length - time), scale(time)
    density, stress = scale(mass - 3*length), scale(dimension_of_stress(length, mass, time))
    deck.map_numbers("*NODE", lambda w: [w[0], x(w[1]), x(w[2])])
    deck.map_numbers("*HYPERELASTIC", lambda w: [stress(w[0]), w[1]])
    deck.map_numbers("*DENSITY", lambda w: [density(w[0])])
    deck.map_numbers("*SOLID SECTION", lambda w: [x(w[0])])
    deck.map_numbers("*INITIAL CONDITIONS", lambda w: [w[0], w[1], v(w[2])])
    for name, value in parameters.items():
        is_time = name in ("h", "t_end", "frame")
        deck.set_parameter(name, t(value) if is_time else value)
    return deck


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """Runs in the units of the deck, by their parameters."""
    known = {}

    def run(**parameters):
        key = tuple(sorted(parameters.items()))
        if key not in known:
            deck = in_units(0, 0, 0, **parameters)
            known[key] = run_deck(deck, tmp_path_factory.mktemp("reference"))
        return known[key]

    return run


def assert_same_bits(run, reference, units):
    history, expected = run.history, reference.history
    assert len(history) == len(expected)
    for name, powers in DIMENSION.items():
        exponent = int(np.dot(powers, units))
        found = np.ldexp(history[name], -exponent)
        same = (found == expected[name]) | (np.isnan(found) & np.isnan(expected[name]))
        assert same.all(), f"{name} differs first in row {np.argmin(same)}"


@pytest.mark.parametrize(("method", "units"), [
    *(("NULL SPACE", units) for units in UNITS),
    *((method, UNITS[k]) for method in ("SADDLE POINT", "PENALTY", "AUGMENTED LAGRANGE")
      for k in (3, -1))])
def test_history_has_the_same_bits(tmp_path, reference, units, method):
    parameters = {"h": 0.05, "t_end": 1.5, "frame": 0.5, "method": method}
    run = run_deck(in_units(*units, **parameters), tmp_path)
    assert run.history["active"].max() >= 2
    assert_same_bits(run, reference(**parameters), units)


@pytest.mark.parametrize("initiation", ["ADMISSIBLE", "VELOCITY UPDATE", "MASSLESS"])
def test_other_treatments_of_first_contact(tmp_path, reference, initiation):
    units = (-13, 7, 5)
    parameters = {"h": 0.02, "t_end": 0.6, "frame": 0.2, "initiation": initiation}
    run = run_deck(in_units(*units, **parameters), tmp_path)
    assert run.history["active"].max() >= 2
    assert_same_bits(run, reference(**parameters), units)


@pytest.mark.parametrize("option", ["KINEMATICS=LINEAR", "MASSLESS"])
def test_sections(tmp_path, option):
    units = (-13, 7, 5)
    parameters = {"h": 0.02, "t_end": 0.4, "frame": 0.2, "initiation": "MASSLESS"}
    runs = []
    for exponents in ((0, 0, 0), units):
        deck = in_units(*exponents, **parameters)
        deck.replace("ELSET=BLOCK, MATERIAL", f"ELSET=BLOCK, {option}, MATERIAL")
        runs.append(run_deck(deck, tmp_path/str(len(runs))))
    assert runs[0].history["active"].max() >= 2
    assert_same_bits(runs[1], runs[0], units)


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
def test_friction(tmp_path, formulation):
    units = (-13, 7, 5)
    parameters = {"h": 0.02, "t_end": 0.4, "frame": 0.2, "formulation": formulation}
    runs = []
    for exponents in ((0, 0, 0), units):
        deck = in_units(*exponents, **parameters)
        deck.replace("NAME=FRICTIONLESS", "NAME=FRICTIONLESS\n*FRICTION\n0.5")
        runs.append(run_deck(deck, tmp_path/str(len(runs))))
    assert runs[0].history["friction_loss"][-1] > 0
    assert_same_bits(runs[1], runs[0], units)
    taken = [run.history["pair1_friction_loss"] for run in runs]
    energy = int(np.dot(DIMENSION["friction_loss"], units))
    np.testing.assert_array_equal(np.ldexp(taken[1], -energy), taken[0])


@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
def test_contact_damping(tmp_path, formulation):
    """A pressure by velocity, and a length."""
    units = (-13, 7, 5)
    parameters = {"h": 0.02, "t_end": 0.4, "frame": 0.2, "formulation": formulation}
    runs = []
    for exponents in ((0, 0, 0), units):
        deck = in_units(*exponents, **parameters)
        coefficient = float(np.ldexp(0.5, int(np.dot((-2, 1, -1), exponents))))
        clearance = float(np.ldexp(0.125, exponents[0]))
        deck.replace("NAME=FRICTIONLESS", "NAME=FRICTIONLESS\n*CONTACT DAMPING, TANGENT FRACTION"
                     f"=0.75\n{coefficient!r}, {clearance!r}, 0.25")
        runs.append(run_deck(deck, tmp_path/str(len(runs))))
    assert runs[0].history["contact_damping_loss"][-1] > 0
    assert_same_bits(runs[1], runs[0], units)
    taken = [run.history["pair1_contact_damping_loss"] for run in runs]
    energy = int(np.dot(DIMENSION["contact_damping_loss"], units))
    np.testing.assert_array_equal(np.ldexp(taken[1], -energy), taken[0])


FORMULATIONS = [
    {"formulation": "NODE TO SURFACE", "smoothing": "HERMITE"},
    {"formulation": "SEGMENT", "multiplier": "STANDARD"},
    {"formulation": "MORTAR", "normal": "EDGE", "multiplier": "STANDARD"},
    {"formulation": "MORTAR", "normal": "NODAL", "multiplier": "DUAL"},
    {"formulation": "MORTAR", "integration": "ELEMENTS"},
    {"formulation": "MORTAR", "smoothing": "HERMITE"},
]


@pytest.mark.each_value
@pytest.mark.parametrize("units", [(-10, 20, -7), (100, -90, 60)])
@pytest.mark.parametrize("choice", FORMULATIONS, ids=lambda choice: ", ".join(choice.values()))
def test_formulations(tmp_path, reference, choice, units):
    parameters = {"h": 0.05, "t_end": 1.5, "frame": 0.5, **choice}
    run = run_deck(in_units(*units, **parameters), tmp_path)
    assert run.history["active"].any()
    assert_same_bits(run, reference(**parameters), units)


def test_cut_steps(tmp_path, reference):
    """Where Newton's method fails at first, the decisions too are the same."""
    units = (9, -4, -6)
    parameters = {"h": 2, "t_end": 8, "frame": 2}
    expected = reference(**parameters)
    assert expected.history["cuts"].sum() > 0
    assert_same_bits(run_deck(in_units(*units, **parameters), tmp_path), expected, units)


def test_fields_have_the_same_bits(tmp_path, reference):
    units = length, mass, time = (5, -3, 2)
    parameters = {"h": 0.05, "t_end": 0.5, "frame": 0.1}
    fields = run_deck(in_units(*units, **parameters), tmp_path).fields()
    expected = reference(**parameters).fields()
    force = length + mass - 2*time
    exponents = {
        "displacement": length,
        "velocity": length - time,
        "reaction_force": force,
        "contact_force": force,
        "contact_gap": length,
        "contact_pressure": dimension_of_stress(*units),
        "contact_active": 0,
        "cauchy_stress": dimension_of_stress(*units),
        "von_mises": dimension_of_stress(*units),
        "strain_energy": force + length,
        "body": 0,
    }
    assert fields.names() == set(exponents)
    for name, exponent in exponents.items():
        np.testing.assert_array_equal(np.ldexp(fields[name], -exponent), expected[name], name)


def test_static_contact(tmp_path):
    """Statics: force and length."""
    deck = Deck.read(DECKS / "two_blocks_static.inp")
    base = run_deck(deck, tmp_path / "base").fields()
    length, stress = 7, -11

    def scaled(text, exponent):
        return number(np.ldexp(float(text), exponent))

    deck.map_numbers("*NODE", lambda w: [w[0], scaled(w[1], length), scaled(w[2], length)])
    deck.map_numbers("*HYPERELASTIC", lambda w: [scaled(w[0], stress), w[1]])
    deck.map_numbers("*SOLID SECTION", lambda w: [scaled(w[0], length)])
    deck.set_parameter("pressure", scaled(10, stress))
    deck.set_parameter("approach", scaled(-0.002, length))
    fields = run_deck(deck, tmp_path / "scaled").fields()
    for name, exponent in (("displacement", length), ("contact_force", stress + 2*length)):
        np.testing.assert_array_equal(np.ldexp(fields[name], -exponent), base[name], name)
