"""What a tie leaves free of its master surface: contact of everything with everything, the judge.

A block is tied on a long base; something small falls on the base beside it, or is thrown against
the block. Overlaps are looked at from outside, `overlap.py`.
"""

import pytest
from overlap import worst
from plain_scenes import ALL, UNGUARDED, Scene, below
from scene_tools import EPSILON, run_deck

#: Coordinates of the scenes are below 8, edges above 0.25: rounding of what is seen, by the edge.
ROUNDING = 64*EPSILON*8/0.25
NODES = "NODE TO SURFACE"
#: Base and block meet in the tie.
TIED = {(0, 1)}


def block_on_base(ends, cells=(2, 1), small_at=1.0, speed=0.0, lean=0.0, **more):
    """A base of eight edges of length 1, and a block tied on it whose foot reaches from `ends[0]`
    to `ends[1]`; its sides lean outwards by `lean`. The small one begins at x = `small_at`."""
    middle = sum(ends)/2
    scene = Scene(0.02, 0.8, gravity=2.0)
    scene.block("BASE", (0.0, 0.0), (8.0, 1.0), (8, 1)).hold("BASE", below(0.0))
    scene.block("BLOCK", (ends[0], 1.0), (ends[1] - ends[0], 1.0), cells,
                shape=lambda x, y: (x + lean*(y - 1)*(1 if x > middle else -1), y), **more)
    scene.block("SMALL", (small_at, 1.1), (0.5, 0.5), (1, 1), velocity=(speed, -1.0))
    scene.side("FOOT", "BLOCK", below(1.0)).side("TOP", "BASE", lambda x, y: y > 1 - 1e-9)
    scene.cards += ["*TIE, NAME=JOINT", "FOOT, TOP"]
    return scene


@pytest.mark.parametrize("scene", [
    pytest.param(block_on_base((3.0, 5.0)), id="ends at nodes"),
    pytest.param(block_on_base((3.4, 5.3)), id="ends between nodes"),
    pytest.param(block_on_base((3.4, 5.3), small_at=2.1, lean=0.5), id="a notch"),
    pytest.param(block_on_base((3.4, 3.9)), id="on one edge"),
    pytest.param(block_on_base((3.6, 4.4), small_at=4.7), id="over one node"),
    pytest.param(block_on_base((3.0, 5.0), small_at=1.5, speed=4.0), id="thrown, ends at nodes"),
    pytest.param(block_on_base((3.4, 5.3), small_at=1.5, speed=4.0), id="thrown, between nodes"),
    pytest.param(block_on_base((3.4, 5.3), (4, 4), 1.5, 4.0), id="thrown, a fine block"),
    pytest.param(block_on_base((3.4, 5.3), small_at=1.0, speed=4.0, lean=0.5), id="thrown, a notch"),
])
def test_what_is_free_bears(scene, tmp_path):
    run = run_deck(scene.deck(ALL), tmp_path, formulation=NODES)
    assert run.history["active"].max() > 0
    assert worst(run.fields(), TIED).by_edge <= ROUNDING
    assert run.verdict["verdict"] == "good"
    assert run.closing(r"energy balance (\S+)") <= 1e-12


def test_what_is_free_is_judged(tmp_path):
    """The only pair is at the end of the base: what falls through its top is seen."""
    scene = block_on_base((3.4, 5.3))
    scene.side("END", "BASE", lambda x, y: x > 8 - 1e-9)
    scene.pairs = [("SMALL", "END")]
    run = run_deck(scene.deck(UNGUARDED), tmp_path, code=3, formulation=NODES, t_end=0.3)
    seen = worst(run.fields(), TIED).by_edge
    assert seen > 0.2
    assert run.verdict["penetration"] == pytest.approx(seen, rel=1e-9)


def test_the_tie_alone_touches_nothing(tmp_path):
    """A block that ends on edges, shaken, while the small one misses the base."""
    scene = block_on_base((3.4, 5.3), (3, 1), small_at=9.0, lean=0.5, velocity=(1, -0.5))
    run = run_deck(scene.deck(ALL), tmp_path, formulation=NODES)
    assert run.history["active"].max() == 0
    assert run.verdict["verdict"] == "good"
