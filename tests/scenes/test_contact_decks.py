"""The bench of CalculiX' decks of contact: edits of decks, and elements that are split."""

import shutil
import sys

import numpy as np
import pytest
from scene_tools import ROOT, run_deck
from space_mesh import Block

sys.path.insert(0, str(ROOT/"tests"/"bench"))

import bench_contact_decks  # noqa: E402
from peers import contact_decks  # noqa: E402
from peers.refined import blocks, keyword, refined  # noqa: E402

STEPS = "*NODE\n1, 0, 0\n*STEP\n*FREQUENCY\n3\n*END STEP\n*STEP\n*STATIC\n1., 1.\n*END STEP\n"


def pulled(kind):
    """A bent block of two elements, held at one end, under a pressure on the other; in contact with nothing."""
    def bend(x):
        return x + np.stack([0.1*x[:, 1]*x[:, 0], 0.0*x[:, 0], 0.1*x[:, 0]*x[:, 2]], 1)

    block = Block(kind, (2, 1, 1), size=(2, 1, 1), place=bend)
    held = "".join(f"{k},\n" for k in block.on(0, 0))
    return block.deck("*ELASTIC\n100., 0.3\n", f"*NSET, NSET=HELD\n{held}*BOUNDARY\nHELD, 1, 3\n"
                      "*STEP\n*STATIC\n1., 1.\n*DLOAD\n2, P4, 1.\n*NODE FILE\nU\n*END STEP\n")


def test_edits():
    assert contact_decks.static(STEPS) == STEPS[:14] + STEPS[43:]
    assert contact_decks.static(STEPS[:43]) is None
    assert contact_decks.asked(STEPS).count("*NODE FILE\nU\n*END STEP") == STEPS.count("*END STEP")
    assert contact_decks.put(r"frequency\n3", "X")(STEPS).count("*X") == 1
    assert contact_decks.shrunk(STEPS).count("1., 1.\n*CONTACT INTERFERENCE, SHRINK\nSSLAV,SMAST\n*END") == 1
    assert contact_decks.is_one("*Tie, name=A\n") and contact_decks.is_one("*contact pair\n")
    assert contact_decks.is_one("*TIE, CYCLIC SYMMETRY, NAME=A\n")
    assert not contact_decks.is_one("*TIME POINTS, NAME=A\n*CONTACT FILE\n")
    with pytest.raises(AssertionError):
        contact_decks.put("nothing", "")(STEPS)


@pytest.mark.parametrize("kind, nodes", [("C3D8", 45), ("C3D20", 141)])
def test_split_elements(tmp_path, kind, nodes):
    """Sixteen elements for two: the held end and the load are those of the deck, and so is the end of refinement."""
    moved = []
    for n in (1, 2, 4):
        deck = tmp_path/f"{kind}{n}.inp"
        deck.write_text(refined(pulled(kind), n))
        cards = {keyword(card): lines for card, lines in blocks(deck.read_text())}
        assert len(cards["*DLOAD"]) == n*n
        if n == 2:
            assert len(cards["*NODE"]) == nodes
            assert len(cards["*NSET"]) == (9 if kind == "C3D8" else 21)
        moved.append(np.abs(run_deck(deck, tmp_path).fields()["displacement"][-1]).max())
    assert abs(moved[2] - moved[1]) < 0.6*abs(moved[1] - moved[0]) < 0.2*moved[2]


def test_rows():
    """What runs unchanged, with an edit, and not at all."""
    assert bench_contact_decks.shown("no") == "no" and bench_contact_decks.shown((3, 1.0, 0.02, 5e-7)) == "2.0e-02"
    lines = bench_contact_decks.lines_of([("`a`", "C3D8", 3, "1", "1e-9", "")], [("`b`", "no", "yes: 1e-9")],
                                         [("`c`", "no shells"), ("`d`", "no shells")])
    assert lines[0].startswith("1 decks run unchanged, 1 with the edit that is named, 2 are refused")
    assert lines[-1] == "| `c`, `d` | no shells |"


@pytest.mark.skipif(not shutil.which("ccx"), reason="CalculiX is not installed")
def test_deck_by_both():
    deck = contact_decks.asked(pulled("C3D20"))
    told = bench_contact_decks.row("own", deck, shutil.which("ccx"))
    assert told[:2] == ("`own`", "C3D20") and float(told[4]) < 1e-5
