"""`*FRICTION`: what is written about it, looked at from outside: work node by node, laws."""

import sys

import friction_scenes
import h5py
import numpy as np
import pytest
from friction_curves import bush
from friction_scenes import NODES, block_on_floor, pressed, rubbing
from plain_scenes import Scene
from scene_tools import DECKS, ROOT, Deck, coarse_ring, run_deck
from test_segments import with_profile

sys.path.insert(0, str(ROOT/"pywrap"))

from emcon import Stepper  # noqa: E402

EPS = np.finfo(float).eps


def with_books(deck):
    """The same deck, with what each contact does written in each increment."""
    text = deck.text()
    head, steps = text[:text.index("*STEP")], text[text.index("*STEP"):]
    kept, skips = [], False
    for line in steps.splitlines():
        if line.startswith("*"):
            skips = line.split(",")[0] in ("*CONTACT PRINT", "*CONTACT FILE", "*NODE FILE", "*EL FILE")
        if not skips:
            kept.append(line)
    asked = "*NODE FILE\nU\n*CONTACT FILE\nCDIS, CSTR, CSHEAR, CSLIP\n" \
        "*CONTACT PRINT\nCDIS, CSTR, CSHEAR, CSLIP\n*END STEP"
    return Deck(head + "\n".join(kept).replace("*END STEP", asked) + "\n", deck.name)


def books(run):
    """Of each contact, at each increment: pressure, traction, status, slip."""
    with h5py.File(run.file(".h5"), "r") as file:
        group = file["sets/CONTACT"]
        return group["CSTR"][..., 0], group["CSHEAR"][..., 0], group["CSHEAR"][..., 1], \
            group["CSLIP"][..., 0], group["CSLIP"][..., 1]


def on_profile():
    scene = Scene(0.01, 0.3, gravity=10.0)
    scene.block("BODY", (0, 0), (2, 1), (4, 2), stiffness=2e4, velocity=(2.0, 0))
    return rubbing(with_profile(scene, "START, -3., 0.\nLINE, 0.7, 0.\nLINE, 6., 0."), 0.3)


def self_contact():
    return rubbing(Deck.read(DECKS/"self_contact.inp"), 0.5, "FRICTIONLESS")


#: The ring on fewer elements than in the book.
RING = friction_scenes.ring(0.5, coarse_ring())

#: Deck, coefficient, parameters.
SCENES = {
    "nodes": (RING, 0.5, {**NODES, "h": 0.02, "t_end": 0.6, "sides": "ONE"}),
    "both sides": (RING, 0.5, {**NODES, "h": 0.02, "t_end": 0.6, "sides": "BOTH"}),
    "segment": (RING, 0.5, {"formulation": "SEGMENT", "h": 0.02, "t_end": 0.6}),
    "mortar": (RING, 0.5, {"formulation": "MORTAR", "h": 0.02, "t_end": 0.6}),
    "smoothed": (RING, 0.5, {**NODES, "h": 0.02, "t_end": 0.6, "smoothing": "HERMITE"}),
    "admissible": (RING, 0.5, {**NODES, "h": 0.02, "t_end": 0.6, "initiation": "ADMISSIBLE"}),
    "massless": (RING, 0.5, {**NODES, "h": 0.02, "t_end": 0.6, "initiation": "MASSLESS"}),
    "itself": (self_contact(), 0.5, {**NODES, "t_end": 0.6, "sides": "BOTH"}),
    "rigid": (block_on_floor(0.01, 0.3, 0.3, v0=2.0, rigid=True), 0.3, NODES),
    "wall": (on_profile(), 0.3, NODES),
    "statics": (pressed(0.02, 0.2), 0.2, NODES),
    "statics on a curve": (bush((67, 48), "HERMITE"), 0.3, NODES),
}


@pytest.mark.parametrize("name", SCENES)
def test_work_of_every_node(name, tmp_path):
    """What friction does at a node takes energy, in every increment; traction is mu times pressure
    where it slides, and no more where it sticks. On flat slaves the sum is what the ledger says."""
    deck, mu, more = SCENES[name]
    run = run_deck(with_books(deck), tmp_path, **more)
    history = run.history
    pressure, shear, status, slip, path = books(run)
    assert len(pressure) == len(history)
    whole = history["cuts"][1:] == 0
    steps = np.ones_like(whole)
    if name == "massless":
        # Where contacts open or close z is balanced, and slides in that; what gives energy back for
        # it is an impulse beside the forces of the step.
        acts = status > 0
        steps = (acts[1:] == acts[:-1]).all(1)
    moved = np.diff(slip, axis=0)
    work = (shear[1:]*moved)[whole & steps]
    size = mu*pressure.max()
    assert (status == 2).any() and work.max() > 1e-9*size*np.abs(moved).max()
    # Slip is a difference of places, held to some ten of their roundings.
    assert work.min() >= -16*EPS*size*np.abs(run.fields()["displacement"]).max()
    pressure, shear, status = (a[1:][steps] for a in (pressure, shear, status))
    assert (np.abs(shear) <= mu*pressure + 1e-9*size).all()
    slides = status == 2
    assert np.abs(shear[slides]) == pytest.approx(mu*pressure[slides], rel=1e-9, abs=1e-12*size)
    assert (shear[status == 0] == 0).all() and (pressure[status > 0] >= -1e-9*size).all()
    assert np.diff(path, axis=0)[whole] == pytest.approx(np.abs(moved[whole]), abs=1e-13*path.max())
    assert (np.diff(path, axis=0) >= 0).all()


def test_the_sum_of_nodes_is_the_ledger(tmp_path):
    """On a block that does not deform areas are known: half of the edges on both sides of a node, all
    0.5 long, round the corners too. Pressure times area adds up to the force, traction times area
    and slip to what the pair and the ledger say."""
    deck, _, more = SCENES["rigid"]
    run = run_deck(with_books(deck), tmp_path, **more)
    fields = run.fields()
    x = fields.x[:15]                                  # those of the block come first
    bottom = np.flatnonzero(x[:, 1] == 0)
    area = np.full(len(bottom), 0.5)
    pushes = fields["contact_pressure"][1:, bottom] @ area
    assert pushes == pytest.approx(np.abs(run.history["pair1_force_y"][1:]), rel=1e-9)
    lost = (fields["contact_shear"][1:, bottom]*np.diff(fields["contact_slip"][:, bottom], axis=0)) \
        @ area
    assert lost == pytest.approx(np.diff(run.history["friction_loss"]), rel=1e-9)
    assert lost == pytest.approx(np.diff(run.history["pair1_friction_loss"]), rel=1e-9)


@pytest.mark.parametrize("sides", ["ONE", "BOTH"])
def test_friction_of_a_stepper(sides, tmp_path):
    """What a stepper says of contacts and pairs is what the run writes, to the bit."""
    path = with_books(RING).write(tmp_path/"ring.inp")
    more = {"formulation": "NODE TO SURFACE", "h": 0.02, "sides": sides}
    run = run_deck(path, tmp_path/"run", **more, t_end=0.3)
    with Stepper(path, **more, t_end=0.3) as stepper:
        while not stepper.is_done:
            stepper.step()
        rubs, pairs = stepper.friction(), stepper.pairs()
        lost, n = stepper.ledger["friction_loss"], len(stepper.contact()[2])
    pressure, *written = (values[-1] for values in books(run))
    m = len(pressure)
    assert rubs.shear.shape == rubs.slip.shape == (n, 1)
    for seen, wanted in zip(rubs, written, strict=True):
        assert len(seen) == n and np.array_equal(seen.ravel()[:m], wanted)
    assert (rubs.status == 2).any() and rubs.status.dtype.kind == "i"
    assert len(pairs) == (2 if sides == "BOTH" else 1)
    assert pairs[0].friction_loss == run.history["pair1_friction_loss"][-1] > 0
    assert all(pair.friction_loss == 0 for pair in pairs[1:])
    # The sum of all contacts and that of the pair are formed in orders of their own: two sums of losses
    # above 0, first over contacts, then over increments, half a rounding for each addition.
    assert lost == run.history["friction_loss"][-1]
    terms = len(run.history) + run.history["active"].max()
    assert lost == pytest.approx(pairs[0].friction_loss, rel=terms*EPS)
