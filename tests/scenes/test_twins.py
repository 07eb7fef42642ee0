"""What a step does depends on the state and on the step alone, not on what was asked before."""

import pathlib
import sys

import pytest
from scene_tools import DECKS, Deck, run_deck

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]/"soak"))

from twins import differ  # noqa: E402

import emcon  # noqa: E402

#: One of each formulation, small ones.
SCENES = {
    "nodes of one side": ("bouncing_bar", {"sides": "ONE"}),
    "nodes of both sides": ("bouncing_bar", {"sides": "BOTH"}),
    "admissible": ("bouncing_bar", {"initiation": "ADMISSIBLE"}),
    "velocity update": ("bouncing_bar", {"initiation": "VELOCITY UPDATE"}),
    "massless": ("bouncing_bar", {"initiation": "MASSLESS"}),
    "segments": ("bouncing_bar", {"formulation": "SEGMENT"}),
    "mortar": ("bouncing_bar", {"formulation": "MORTAR"}),
    "smoothed": ("bouncing_bar", {"smoothing": "HERMITE"}),
    "with itself": ("self_contact", {"h": 0.1}),
    "friction": ("sliding_block", {}),
    "rigid": ("rigid_bar", {}),
    "static": ("two_blocks_static", {}),
}
STEPS = """*STEP, INC=1000000
*DYNAMIC, DIRECT
{h}, {duration}
*CONTACT INITIATION, TYPE=PERSISTENT
*DLOAD
BAR, GRAV, 10., 0., -1., 0.
*NODE FILE
U
{output}*END STEP
"""


@pytest.mark.parametrize("name", SCENES)
def test_twins_have_the_same_bits(name, tmp_path):
    deck, parameters = SCENES[name]
    model = emcon.Model.from_deck(DECKS/f"{deck}.inp", **parameters)
    # Of the bar steps as long as its fall, then small ones; others as their decks go.
    plan = (1, 12, 200.0) if deck == "bouncing_bar" else (22, 7, 1.0)
    assert differ(model, 4, tmp_path, *plan) == ""


def test_output_changes_no_bit(tmp_path):
    """A bar falls by a step of a length of time, then by small ones near the floor."""
    text = Deck.read(DECKS/"bouncing_bar.inp").text()
    head = text[:text.index("*STEP")]
    ends = []
    for output in ("", "*CONTACT FILE\nCDIS, CSTR, CF\n*CONTACT PRINT, TOTALS=ONLY\nCF\n"):
        steps = [STEPS.format(h=h, duration=duration, output=output)
                 for h, duration in ((0.005, 0.005), (1.0, 1.0), (0.005, 0.005), (0.05, 0.2))]
        run = run_deck(Deck(head + "".join(steps)), tmp_path/f"{len(output)}")
        ends.append(run.digits(pairs=False))
    assert ends[0] == ends[1]
