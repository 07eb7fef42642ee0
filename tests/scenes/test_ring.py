"""The ring impact: energy, momentum and penetration of each treatment of first contact."""

import numpy as np
import pytest
from scene_tools import DECKS, EPSILON, Deck, coarse_ring, figures, run_deck

DECK = DECKS / "ring.inp"
DURATION = 8.0
N_ELEMENT = 556
N_RING_NODE = 320
# An energy is a sum over the elements: so much of it is round-off at worst.
ENERGY_NOISE = N_ELEMENT*EPSILON

PERSISTENT = pytest.mark.parametrize("h", [0.05, 0.02, 0.01])
OTHERS = pytest.mark.parametrize("h", [0.05, 0.02, 0.01])
ALL = pytest.mark.parametrize(
    "initiation, h",
    [("PERSISTENT", h) for h in (0.05, 0.02, 0.01)]
    + [(name, h) for name in ("ADMISSIBLE", "VELOCITY UPDATE") for h in (0.05, 0.02, 0.01)],
)


@ALL
def test_runs_to_the_end_on_the_grid(ring, initiation, h):
    history = ring(initiation, h).history
    n = round(DURATION/h)
    assert len(history) == n + 1
    np.testing.assert_array_equal(history["increment"], np.arange(n + 1))
    np.testing.assert_array_equal(history["time"][:-1], np.arange(n)*h)
    assert history["time"][-1] == DURATION
    assert history["active"].max() > 0


@PERSISTENT
def test_persistent_holds_the_energy(ring, h):
    run = ring("PERSISTENT", h)
    total = run.history["total"]
    assert np.abs(total - total[0]).max() <= 1e-10*total[0]
    assert run.closing(r"largest error of the energy balance (\S+)") <= 1e-10
    assert "closes to ten digits" in run.log


@OTHERS
def test_admissible_never_gains_energy(ring, h):
    total = ring("ADMISSIBLE", h).history["total"]
    assert np.diff(total).max() <= ENERGY_NOISE*total[0]
    assert total[-1] < total[0]


@OTHERS
def test_velocity_update_holds_the_energy_where_it_finds_a_root(ring, h):
    run = ring("VELOCITY UPDATE", h)
    total = run.history["total"]
    change = np.diff(total)/total[0]
    has_root = np.array([not any("no jump of velocities" in line for line in g) for g in run.increments])
    assert len(has_root) == len(change)
    assert np.abs(change[has_root]).sum() <= 1e-9
    assert change[~has_root].max(initial=0.0) <= ENERGY_NOISE
    assert any("restores an energy" in line for g in run.increments for line in g)


@OTHERS
def test_no_root_is_said_only_where_energy_is_lost(ring, h):
    run = ring("VELOCITY UPDATE", h)
    total = run.history["total"]
    for k, lines in enumerate(run.increments):
        if any("no jump of velocities" in line for line in lines):
            assert total[k + 1] < (1.0 - ENERGY_NOISE)*total[k], f"increment {k + 1}: {lines}"


@ALL
def test_nothing_penetrates(ring, initiation, h):
    """Gaps of slave nodes are per master edge, of length 1 here; overlap is looked for both ways.

    Where gaps close exactly, master nodes go in between slave nodes: contact has one side.
    """
    run = ring(initiation, h)
    assert np.nanmin(run.fields()["contact_gap"]) >= -1e-12
    limit = 1e-12 if initiation == "PERSISTENT" else 1e-3
    assert run.closing(r"deepest penetration (\S+) of an element") <= limit


def test_one_side_keeps_the_momentum_along_the_floor(ring, tmp_path):
    """Ten times better than both, as the heading says: the floor leans on the chords of the rim."""
    def change(run):
        px = run.series("BODIES", "MOMENTUM")[1][:, 0, 0]
        return abs(px[-1] - px[0])

    both = run_deck(DECK, tmp_path, h=0.02, t_end=5, frame=1, sides="BOTH")
    assert change(both) > 10*change(ring("PERSISTENT", 0.02))


@ALL
def test_figures_of_the_heading(ring, initiation, h):
    run = ring(initiation, h)
    total0, mass, px, py = figures(
        DECK,
        r"total energy (\S+) throughout; ring mass (\S+); ring momentum \((\S+), (\S+)\) before",
    )
    low, high = figures(DECK, r"ring py between (\S+) and (\S+) ")
    ring_body = 0
    bodies = run.series("BODIES", "MOMENTUM")[1][:, ring_body, :]
    assert run.history["total"][0] == pytest.approx(total0, rel=1e-6)
    assert run.series("BODIES", "MASS")[1][0, ring_body] == pytest.approx(mass, rel=1e-5)
    np.testing.assert_allclose(bodies[0, :2], [px, py], rtol=1e-5)
    # In flight after the release.
    assert not run.history["active"][-round(0.5/h) :].any()
    assert low <= bodies[-1, 1] <= high
    # The surface is flat but for its own small deformation.
    assert bodies[-1, 0] == pytest.approx(px, rel=2e-3)


@pytest.mark.parametrize("initiation", ["PERSISTENT", "ADMISSIBLE"])
@pytest.mark.parametrize("method", ["NULL SPACE", "SADDLE POINT"])
def test_momentum_changes_by_the_impulse_of_the_support(tmp_path, initiation, method):
    """Ring and block together: contact is inner, only the clamped bottom acts from outside."""
    deck = coarse_ring()
    deck.insert("*NODE PRINT, NSET=BOTTOM, TOTALS=ONLY\nRF", before="*CONTACT PRINT")
    run = run_deck(deck, tmp_path, h=0.02, t_end=1.5, initiation=initiation, method=method)
    history = run.history
    force = run.series("BOTTOM", "TOTAL_RF")[1][:, 0, :]
    assert not history["cuts"].any()
    for a, name in enumerate(["px", "py"]):
        impulse = np.diff(history["time"])*force[1:, a]
        # Round-off of the nodal forces of the stiff block, which cancel in the sum.
        scale = np.abs(history["py"][0])
        np.testing.assert_allclose(np.diff(history[name]), impulse, rtol=0, atol=1e-12*scale)


def test_bodies_add_up_and_contact_forces_balance(ring):
    run = ring("PERSISTENT", 0.02)
    momentum = run.series("BODIES", "MOMENTUM")[1].sum(axis=1)
    for a, name in enumerate(["px", "py", "lz"]):
        scale = np.abs(run.history[name]).max()
        np.testing.assert_allclose(momentum[:, a], run.history[name], atol=64*EPSILON*scale, rtol=0)
    force = run.fields()["contact_force"]
    largest = np.abs(force).max()
    assert largest > 0
    assert np.abs(force.sum(axis=1)).max() <= 64*EPSILON*largest


def test_momentum_of_the_ring_is_kept_until_it_touches(tmp_path):
    """Flight before the impact: nothing changes but the position."""
    deck = Deck.read(DECK)
    deck.move_nodes(lambda label, x, y: (x, y + 3.0) if label <= N_RING_NODE else (x, y))
    history = run_deck(deck, tmp_path, h=0.05, t_end=1).history
    assert not history["active"].any()
    for name in ("px", "py", "total", "kinetic", "lz"):
        value = history[name]
        np.testing.assert_allclose(value, value[0], rtol=1e-12)


def test_two_runs_give_the_same_bits(tmp_path):
    runs = [run_deck(DECK, tmp_path / name, h=0.05, t_end=0.5) for name in "ab"]
    assert runs[0].digits() == runs[1].digits()


def test_h5_and_csv_tell_the_same(ring):
    import h5py

    run = ring("PERSISTENT", 0.05)
    with h5py.File(run.file(".h5"), "r") as file:
        for name in run.history.dtype.names:
            np.testing.assert_array_equal(file["history"][name][:], run.history[name])
        text = "\n".join(line.decode() for line in file["run"]["deck"][:])
    assert "*CONTACT PAIR, INTERACTION=FRICTIONLESS" in text


def test_needs_no_contact_code_while_far_apart(tmp_path):
    """Two Newton iterations per increment at most in flight, as without a contact pair."""
    with_pair = Deck.read(DECK)
    with_pair.move_nodes(lambda label, x, y: (x, y + 30.0) if label <= N_RING_NODE else (x, y))
    without = Deck(with_pair.text(), "without")
    without.remove("*CONTACT PAIR")
    without.remove("*CONTACT FILE")
    without.remove("*CONTACT PRINT")
    runs = [
        run_deck(deck, tmp_path / deck.name, h=0.05, t_end=0.5, initiation="PERSISTENT")
        for deck in (with_pair, without)
    ]
    assert runs[0].digits(pairs=False) == runs[1].digits(pairs=False)
