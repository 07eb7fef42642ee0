"""Contact forces times the increment are the change of momentum, jumps of velocities included."""

import h5py
import numpy as np
import pytest
from plain_scenes import BOTH, ONE, Scene, below
from scene_tools import EPSILON, run_deck

WAYS = [("PERSISTENT", 1.0), ("PERSISTENT", 0.5), ("VELOCITY UPDATE", 1.0), ("MASSLESS", 1.0)]


def two_blocks(sides, restitution):
    """One free block meets another with an edge that is not parallel to it."""
    scene = Scene(0.005, 0.2)
    scene.block("UPPER", (0.1, 0.02), (1, 1), (3, 3), turn=0.02, velocity=(0.2, -1.0))
    scene.block("LOWER", (-0.5, -1), (2, 1), (4, 2))
    scene.pairs = [("UPPER", "LOWER")]
    deck = scene.deck(sides)
    deck.replace("*SURFACE INTERACTION, NAME=SMOOTH",
                 f"*SURFACE INTERACTION, NAME=SMOOTH, RESTITUTION={restitution!r}")
    return deck, 16


@pytest.mark.parametrize(("sides", "formulation"), [(BOTH, "NODE TO SURFACE"), (ONE, "MORTAR")])
@pytest.mark.parametrize(("initiation", "restitution"), WAYS)
def test_forces_are_the_change_of_momentum(initiation, restitution, sides, formulation, tmp_path):
    """The mean force over an increment, of fields as of sums of the pair, times its size is what the
    body gains, its moment what it turns by: to the round-off of momenta that are summed over nodes."""
    deck, n = two_blocks(sides, restitution)
    run = run_deck(deck, tmp_path, initiation=initiation, formulation=formulation)
    h = run.history["h"][1:]
    with h5py.File(run.file(".h5")) as file:
        momentum = file["sets/BODIES/MOMENTUM"][:, 0]
        pairs = file["sets/PAIRS"]
        total = pairs["CF"][-len(h):, 0]
        if sides == BOTH:
            total = total + pairs["CF_MASTER"][-len(h):, 1]
    gained, size = np.diff(momentum, axis=0), np.abs(momentum).max()
    assert np.abs(gained).sum() > 0.5*size   # they have met
    field = run.fields()["contact_force"][1:, :n].sum(axis=1)[:, :2]
    assert np.abs(field*h[:, None] - gained[:, :2]).max() < 1000*EPSILON*size
    assert np.abs(total*h[:, None] - gained).max() < 1000*EPSILON*size
    force = np.stack([run.history[f"pair1_force_{axis}"][1:] for axis in "xy"], axis=1)
    assert np.abs(force*h[:, None] - gained[:, :2]).max() < 1000*EPSILON*size


@pytest.mark.parametrize("held", ["all", "bottom"])
@pytest.mark.parametrize(("initiation", "restitution"), WAYS)
def test_reactions_have_the_impulses_too(initiation, restitution, held, tmp_path):
    """What holds a floor, rigid or at its bottom, is what the momenta change by."""
    scene = Scene(0.01, 0.4)
    scene.block("BODY", (0.0, 0.2), (1.0, 1.0), (6, 6), 0.2, velocity=(0.3, -1.0))
    scene.block("FLOOR", (-1.0, -0.4), (3.0, 0.4), (5, 3))
    scene.hold("FLOOR", below(-0.4) if held == "bottom" else below(0.0))
    deck = scene.deck(ONE)
    deck.replace("*SURFACE INTERACTION, NAME=SMOOTH",
                 f"*SURFACE INTERACTION, NAME=SMOOTH, RESTITUTION={restitution!r}")
    deck.insert("*NODE PRINT, NSET=FLOOR\nRF", before="*NODE FILE")
    run = run_deck(deck, tmp_path, initiation=initiation, formulation="NODE TO SURFACE")
    h = run.history["h"][1:]
    with h5py.File(run.file(".h5")) as file:
        label = file["sets/FLOOR/RF_label"][:]
    x = np.array([scene.part["FLOOR"].node[i] for i in label])
    force = run.series("FLOOR", "RF")[1][1:]
    moment = (x[:, 0]*force[..., 1] - x[:, 1]*force[..., 0]).sum(axis=1)
    taken = {"px": force[..., 0].sum(axis=1), "py": force[..., 1].sum(axis=1), "lz": moment}
    assert (run.history["active"] > 0).any()
    assert run.history["cuts"].max() == 0
    for name, rate in taken.items():
        momentum = run.history[name]
        left = np.cumsum(np.diff(momentum) - h*rate)
        assert np.abs(left).max() < 1000*EPSILON*np.abs(run.history["py"]).max(), name
