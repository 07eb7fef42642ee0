"""Null space and saddle point: the same step, the same history."""

import numpy as np
import pytest
from scene_tools import DECKS, Deck, coarse_ring, number, run_deck

DECK = coarse_ring()
N_RING_NODE = 192
METHODS = ("NULL SPACE", "SADDLE POINT")
INITIATIONS = ("PERSISTENT", "ADMISSIBLE", "VELOCITY UPDATE")
COMPARED = {"displacement", "velocity", "contact_force", "contact_pressure"}
COLUMNS = ("kinetic", "strain", "contact_work", "total", "px", "py", "lz")


def assert_same_fields(first, second, tolerance):
    """Displacements and contact forces of all frames, relative to the largest of the frames."""
    for name in sorted(COMPARED & first.names()):
        scale = np.abs(first[name]).max()
        np.testing.assert_allclose(first[name], second[name], rtol=0, atol=tolerance*scale)
    np.testing.assert_array_equal(first["contact_active"], second["contact_active"])


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    """The ring, deformed on the foundation and thrown down once more, as a deck."""
    folder = tmp_path_factory.mktemp("pressed")
    run = run_deck(DECK, folder, h=0.01, t_end=0.4, frame=0.4, initiation="ADMISSIBLE")
    fields = run.fields()
    assert fields["contact_active"][-1].sum() >= 2
    fields["velocity"][-1, :N_RING_NODE, 1] -= 3.0
    deck = coarse_ring()
    deck.remove("*INITIAL CONDITIONS")
    for kind, name in (("DISPLACEMENT", "displacement"), ("VELOCITY", "velocity")):
        lines = [f"*INITIAL CONDITIONS, TYPE={kind}"]
        for node, vector in enumerate(fields[name][-1], start=1):
            # The clamped bottom stays where it is.
            lines += [f"{node}, {a}, {number(v)}" for a, v in enumerate(vector, 1) if v != 0]
        deck.insert("\n".join(lines), before="*TIME POINTS")
    return deck


@pytest.mark.each_value
@pytest.mark.parametrize("initiation", INITIATIONS)
@pytest.mark.parametrize("h", [0.05, 0.005, 0.0005])
def test_one_step_from_the_same_state(pressed, tmp_path, initiation, h):
    first, second = (
        run_deck(
            pressed, tmp_path / method, h=h, t_end=h, frame=h, initiation=initiation, method=method
        ).fields()
        for method in METHODS
    )
    np.testing.assert_array_equal(first["displacement"][0], second["displacement"][0])
    assert first["contact_active"][-1].any()
    assert_same_fields(first, second, 1e-9)


@pytest.mark.parametrize("initiation", INITIATIONS)
def test_histories(tmp_path, initiation):
    first, second = (
        run_deck(DECK, tmp_path / method, h=0.02, t_end=1, initiation=initiation, method=method)
        for method in METHODS
    )
    np.testing.assert_array_equal(first.history["active"], second.history["active"])
    energy = first.history["total"][0]
    for name in COLUMNS:
        scale = max(np.abs(first.history[name]).max(), energy if "p" not in name else 0)
        np.testing.assert_allclose(
            first.history[name], second.history[name], rtol=0, atol=1e-8*scale, err_msg=name
        )
    assert_same_fields(first.fields(), second.fields(), 1e-8)


COUPLED = [
    {"formulation": "SEGMENT", "multiplier": "STANDARD"},
    {"formulation": "MORTAR", "multiplier": "DUAL"},
    {"formulation": "MORTAR", "multiplier": "STANDARD", "normal": "EDGE"},
    {"formulation": "MORTAR", "multiplier": "STANDARD", "smoothing": "HERMITE"},
]


@pytest.mark.parametrize("choice", COUPLED, ids=lambda choice: ", ".join(choice.values()))
def test_coupled_constraints(tmp_path, choice):
    first, second = (
        run_deck(DECK, tmp_path / method, h=0.02, t_end=1.9, method=method, **choice)
        for method in METHODS
    )
    assert first.history["active"].max() >= 3
    np.testing.assert_array_equal(first.history["active"], second.history["active"])
    for name in COLUMNS:
        scale = max(np.abs(first.history[name]).max(), first.history["total"][0])
        np.testing.assert_allclose(
            first.history[name], second.history[name], rtol=0, atol=1e-8*scale, err_msg=name
        )
    assert_same_fields(first.fields(), second.fields(), 1e-8)


def test_static_contact(tmp_path):
    deck = DECKS / "two_blocks_static.inp"
    first, second = (run_deck(deck, tmp_path / m, method=m) for m in METHODS)
    assert_same_fields(first.fields(), second.fields(), 1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_solvers(pressed, tmp_path, method):
    """MUMPS solves the same step, but for round-off; a program may have been built without others."""
    runs = {}
    for solver in ("DEFAULT", "MUMPS"):
        deck = Deck(pressed.text(), "pressed")
        deck.replace("*DYNAMIC, DIRECT", f"*DYNAMIC, DIRECT, SOLVER={solver}")
        runs[solver] = run_deck(deck, tmp_path / solver, h=0.005, t_end=0.05, method=method)
    assert runs["MUMPS"].history["active"].max() >= 2
    assert runs["MUMPS"].verdict["largest_energy_error"] < 1e-12
    assert_same_fields(runs["DEFAULT"].fields(), runs["MUMPS"].fields(), 1e-9)


def test_static_solvers(tmp_path):
    """Without contact the matrix of statics is definite, with it that of a saddle point is not."""
    fields = []
    for solver in ("DEFAULT", "MUMPS"):
        deck = Deck.read(DECKS / "two_blocks_static.inp")
        deck.replace("*STATIC", f"*STATIC, SOLVER={solver}")
        fields.append(run_deck(deck, tmp_path / solver, method="SADDLE POINT").fields())
    assert_same_fields(*fields, 1e-9)
