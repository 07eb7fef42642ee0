"""`*CLEARANCE`: a contact pair gets its gap at the start, in the plane, in space and over walls."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import wall_space_scenes as walls
from plain_scenes import BOTH, ONE, Scene, below
from scene_tools import EPSILON, Deck, emcon, run_deck
from test_model_change import EACH, deck

AS_DECK = pytest.mark.parametrize("value", [0.013, 0.0, 0.2])


def over_floor(n_dim: int, sides: str, value: float, gap: float = 0.05, v: float = -1.0) -> Deck:
    """A block whose bottom is askew, over a floor, with a clearance."""
    new = Scene(0.01, 0.3)
    along = (0.0,)*(n_dim - 1)

    def shape(*place):
        if n_dim == 2:
            x, y = place
            return x, y + gap + 0.02*x*(1.0 - y)
        x = np.array(place[0])
        x[:, 2] += gap + 0.02*x[:, 0]*(1.0 - x[:, 2])
        return x

    new.block("BLOCK", (*along, 0.0), (1.0,)*n_dim, (2,)*n_dim, velocity=(*along, v), shape=shape)
    new.block("FLOOR", (-1.0,)*n_dim, (*([3.0]*(n_dim - 1)), 1.0), (*([3]*(n_dim - 1)), 1)).hold("FLOOR", below(-1.0))
    text = deck(new, sides, [(0.3, "")]).text()
    card = f"*CLEARANCE, SLAVE=BLOCK, MASTER=FLOOR, VALUE={value!r}\n"
    return Deck(text.replace("*AMPLITUDE", card + "*AMPLITUDE", 1), "deck")


@AS_DECK
@EACH
def test_a_block_falls_from_its_clearance(n_dim: int, formulation: str, sides: str, value: float, tmp_path: Path) -> None:
    """All bottom nodes are at that height, others stay; free fall at a constant rate until it is closed."""
    run = run_deck(over_floor(n_dim, sides, value), tmp_path, formulation=formulation, h=0.005)
    assert run.verdict["verdict"] == "good" and "*CLEARANCE moves" in run.log
    x = run.fields().x
    x = x[:3**n_dim]
    bottom = np.sort(x[:, n_dim - 1])[:3**(n_dim - 1)]
    assert np.abs(bottom - value).max() <= 8*EPSILON
    assert x[:, n_dim - 1].max() == pytest.approx(1.05, abs=1e-12)
    closes = run.history["time"][np.argmax(run.history["active"] > 0)]
    assert value - 1e-12 <= closes <= value + 0.006


@pytest.mark.parametrize(("n_dim", "formulation"), [(2, "NODE TO SURFACE"), (2, "MORTAR"), (3, "MORTAR")])
def test_an_overlap_needs_a_step_that_resolves_it(n_dim: int, formulation: str, tmp_path: Path) -> None:
    """Below 0 slave nodes are behind the floor: an error that says what to do, or a press fit."""
    cards = over_floor(n_dim, ONE, -0.01, v=0.0)
    path = cards.write(tmp_path/"deck.inp")
    done = emcon("check", path, f"--set=formulation={formulation}")
    assert done.returncode == 2 and "penetrate surface FLOOR, by 0.01 at most" in done.stderr
    assert "*CONTACT INTERFERENCE, SHRINK" in done.stderr
    text = cards.text().replace("*DYNAMIC, DIRECT\n<h>, 0.3", "*STATIC\n.5, 1.\n*CONTACT INTERFERENCE, SHRINK\n"
                                "*BOUNDARY\nTOP, 1, " + str(n_dim))
    text = text.replace("*CONTACT INITIATION, TYPE=<initiation>\n", "")
    nodes = text[text.index("*NODE"):text.index("*ELEMENT")].splitlines()
    top = [line.split(",")[0] for line in nodes if not line.startswith("*") and float(line.split(",")[-1]) > 1.0]
    text = text.replace("*AMPLITUDE", "*NSET, NSET=TOP\n" + ", ".join(top) + "\n*AMPLITUDE", 1)
    run = run_deck(Deck(text, "deck"), tmp_path/"2", formulation=formulation)
    assert run.verdict["verdict"] == "good" and run.history["strain"][-1] > 1e-4


@pytest.mark.parametrize("kind", ["", ", TYPE=MORTAR"])
def test_walls_have_clearances(kind: str, tmp_path: Path) -> None:
    """Of a plane in space."""
    text = walls.falling(walls.cube(gap=0.1), walls.plane(), (0.0, 0.0, -1.0), h=0.005, until=0.1, options=kind)
    text = text.replace("*INITIAL CONDITIONS", "*CLEARANCE, SLAVE=S1, MASTER=W, VALUE=0.04\n*INITIAL CONDITIONS", 1)
    (tmp_path/"deck.inp").write_text(text)
    run = run_deck(tmp_path/"deck.inp", tmp_path)
    assert np.sort(run.fields().x[:27, 2])[:9] == pytest.approx(0.04, abs=1e-14)
    assert run.verdict["verdict"] == "good" and 0.0395 <= run.history["time"][np.argmax(run.history["active"] > 0)] <= 0.051
