"""What is driven has the slope to the left at a corner of its amplitude, however times are rounded."""

import pytest
from plain_scenes import ONE, Scene
from scene_tools import run_deck

EPSILON = 2.0**-52


def driven(corner, h):
    """A block whose foot goes down until `corner` and rests then; three increments until there."""
    scene = Scene(h, 6*h)
    scene.block("BODY", (0.0, 0.0), (1.0, 1.0), (3, 3))
    deck = scene.deck(ONE)
    deck.insert(f"*AMPLITUDE, NAME=A\n0., 0., {corner!r}, 1., {2*corner!r}, 1.", before="*STEP")
    deck.insert("*BOUNDARY, AMPLITUDE=A\n" + "".join(
        f"{label}, 2, 2, -0.1\n" for label, (_, y) in scene.part["BODY"].node.items() if y == 0),
        before="*NODE FILE")
    return deck


@pytest.mark.parametrize("factor", [1 - 4*EPSILON, 1 + 4*EPSILON])
def test_rounding_of_a_corner_does_not_matter(factor, tmp_path):
    """3*0.1 is above 0.3, 3*0.05 is 0.15: of two tables that differ by round-off runs do, too."""
    for h in (0.1, 0.05):
        kinetic = [run_deck(driven(corner, h), tmp_path/f"{h}-{k}").history["kinetic"]
                   for k, corner in enumerate((3*h, 3*h*factor))]
        assert max(kinetic[0]) > 0
        assert kinetic[0] == pytest.approx(kinetic[1], abs=1e4*EPSILON*max(kinetic[0]))
