"""Contact and ties over sides with midside nodes: patch tests, convergence, motion."""

import numpy as np
import pytest
from scene_tools import Deck, run_deck
from side_scenes import (
    block,
    bodies,
    collision,
    grid,
    pair,
    patch,
    pressed,
    pressed_errors,
    tied_ring,
    tied_ring_errors,
    tied_sectors,
)

#: What passes the patch test where sides are single edges: docs/theory.md, section 4.10.
EXACT = {
    "mortar": "TYPE=MORTAR",
    "both sides": "TYPE=NODE TO SURFACE, SIDES=BOTH",
    "tie": "",
}
KINDS = [("CPE4", "CPE8"), ("CPE8", "CPE4"), ("CPE8", "CPE8"), ("CPE8R", "CPE6"), ("CPE6", "CPE3")]
ROUND_OFF = 1e-12


@pytest.mark.each_value
@pytest.mark.parametrize("swap", [False, True], ids=["", "swapped"])
@pytest.mark.parametrize("join", EXACT)
@pytest.mark.parametrize("kinds", KINDS, ids="-".join)
def test_patch(tmp_path, kinds, join, swap):
    """Meshes that do not match, nodes below off the middle of their sides: no stress but the
    pressure, and contact tells just that. With large displacements, and without."""
    deck = patch(kinds, EXACT[join], swap, ", NLGEOM" if swap else "")
    fields = run_deck(deck, tmp_path).fields()
    stress = fields["cauchy_stress"][-1]
    for component, value in ((0, 0), (1, -10), (3, 0)):
        np.testing.assert_allclose(stress[:, component], value, rtol=0, atol=10*ROUND_OFF)
    if join == "mortar":
        acts = fields["contact_active"][-1] == 1
        assert acts.sum() > 3
        pressure = fields["contact_pressure"][-1][acts]
        # By the deformed area, which without large displacements the load does not know.
        np.testing.assert_allclose(pressure, 10 if swap else pressure[0], rtol=ROUND_OFF)


@pytest.mark.parametrize("swap", [False, True], ids=["", "swapped"])
@pytest.mark.parametrize("kind", ["CPE6", "CPE8"])
def test_constant_stress_over_a_curved_tie(tmp_path, kind, swap):
    stress = run_deck(tied_sectors(kind, swap), tmp_path).fields()["cauchy_stress"][-1]
    right = 1e-3*1000/(1.3*0.4)*np.array([0.7, 0.3])
    np.testing.assert_allclose(stress[:, 0], right[0], rtol=1e-10)
    np.testing.assert_allclose(stress[:, 1], right[1], rtol=1e-10)
    np.testing.assert_allclose(stress[:, 3], 0, rtol=0, atol=1e-10*right[0])


@pytest.fixture(scope="module")
def finer(tmp_path_factory):
    return run_deck(pressed("CPE8", 32), tmp_path_factory.mktemp("finer")).fields()


@pytest.mark.long
@pytest.mark.parametrize("options", ["TYPE=MORTAR", "TYPE=NODE TO SURFACE"])
@pytest.mark.parametrize("kind", ["CPE6", "CPE8"])
def test_order_of_contact(tmp_path, finer, kind, options):
    """Stresses of quadratic elements are of second order, displacements of third: two meshes."""
    errors = [pressed_errors(run_deck(pressed(kind, n, options), tmp_path/str(n)).fields(), finer)
              for n in (4, 8)]
    order = np.log2(errors[0]/errors[1])
    assert order[0] > 2.5 and order[1] > 1.8, order


@pytest.mark.parametrize("swap", [False, True], ids=["", "swapped"])
def test_order_of_curved_ties(tmp_path, swap):
    errors = [tied_ring_errors(run_deck(tied_ring("CPE8", n, swap), tmp_path/str(n)).fields())
              for n in (4, 8)]
    order = np.log2(errors[0]/errors[1])
    assert order[0] > 2.3 and order[1] > 1.5, order


@pytest.mark.parametrize(("kinds", "options", "treatment", "friction"), [
    (("CPE8", "CPE8"), "TYPE=NODE TO SURFACE", "PERSISTENT", 0),
    (("CPE4", "CPE6"), "TYPE=SEGMENT", "PERSISTENT", 0),
    (("CPE8R", "CPE8"), "TYPE=NODE TO SURFACE", "MASSLESS", 0),
    (("CPE8", "CPE6"), "TYPE=NODE TO SURFACE", "PERSISTENT", 0.2),
], ids=["both sides", "segment", "massless", "friction"])
def test_collision(tmp_path, kinds, options, treatment, friction):
    """Curved sides at large rotations: momenta, and without friction energy, to round-off."""
    run = run_deck(collision(kinds, options, treatment, friction), tmp_path)
    history = run.history
    assert history["active"].max() >= 4
    momenta = np.array([history[name] for name in ("px", "py", "lz")])
    assert np.abs(momenta - momenta[:, :1]).max() <= 1e-13*np.abs(momenta).max()
    lost = history["friction_loss"] if friction else 0.0
    energy = history["total"] + lost
    np.testing.assert_allclose(energy, energy[0], rtol=1e-13)
    if friction:
        assert history["total"][-1] < 0.99*history["total"][0]


def test_displaced_at_the_start(tmp_path):
    """The middle of a side of CPE8 is displaced by d, its contact point by 4/3 d: there a node
    of the other body touches it, before the first step and in it, but for the corner that is round
    over 1e-6 of an edge: 3/16 of that by the half turn of 0.02 (docs/theory.md, 4.2)."""
    low = grid("CPE8", (1, 1), block(0, -1, 4, 0))
    high = grid("CPE4", (2, 1), block(0, 0, 4, 1))
    first = len(low.x)
    deck = Deck(bodies(LOW=low, HIGH=high) + pair("HIGH_bottom", "LOW_top", "TYPE=NODE TO SURFACE")
                + f"""*INITIAL CONDITIONS, TYPE=DISPLACEMENT
{low.label[1, 2]}, 2, -0.03
{first + high.label[1, 0]}, 2, -0.04
*STEP, NLGEOM
*DYNAMIC, DIRECT
1e-6, 1e-6
*CONTACT FILE
CDISP
*END STEP
""")
    gap = run_deck(deck, tmp_path).fields()["contact_gap"][0]
    touching = [low.label[1, 2] - 1, first + high.label[1, 0] - 1]
    np.testing.assert_allclose(gap[touching], 0, rtol=0, atol=1.01*3/16*2e-6*0.02)
