"""A punch in space that stands beside a block, and comes in under its edge from the side.

The lower edge of the punch is behind the plane of the block's top, but not in the block: nothing may act before the
gap to the block's side has closed, and then it is the side that is pushed, not the top.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from contact_space_scenes import bodies, dynamic, faces, pair
from scene_tools import Run, run_deck
from space_mesh import Block

E, GAP, WAY = 100.0, 0.08, 0.15


def beside(depth: float, step: str, options: str = "", kind: str = "C3D8", more: str = "") -> str:
    """The punch reaches `depth` below the block's top, and is driven by WAY onto its side."""
    block = Block(kind, (4, 2, 2), size=(2.0, 1.0, 1.0), place=lambda x: x - np.array([0.0, 0.0, 1.0]))
    punch = Block(kind, (2, 2, 2), size=(0.5, 0.6, 0.5), place=lambda x: x + np.array([2.0 + GAP, 0.2, -depth]))
    n = len(punch.x)
    top, foot = punch.on(2, 1), block.on(2, 0) + n
    return (bodies([punch, block], [faces(punch), faces(block)], f"*ELASTIC\n{E}, 0.\n*DENSITY\n1.\n")
            + f"*SURFACE INTERACTION, NAME=I\n{more}*CONTACT PAIR, INTERACTION=I{options}\nS1, S2\n"
            + "*NSET, NSET=TOP\n" + "".join(f"{k}\n" for k in top) + "*NSET, NSET=FOOT\n" + "".join(f"{k}\n" for k in foot)
            + "*BOUNDARY\nFOOT, 1, 3\nTOP, 2, 3\n*AMPLITUDE, NAME=RAMP\n0., 0., 1., 1.\n"
            + f"*STEP, NLGEOM\n{step}\n*BOUNDARY, AMPLITUDE=RAMP\nTOP, 1, 1, -{WAY}\n*NODE FILE\nU\n*CONTACT FILE\nCF\n*END STEP\n")


def ran(folder: Path, text: str) -> tuple[Run, np.ndarray, np.ndarray]:
    """The run, how far the punch has gone on after it has closed the gap, forces on it: by increments."""
    deck = folder/"deck.inp"
    deck.write_text(text)
    run = run_deck(deck, folder)
    force = np.stack([run.history[f"pair1_force_{a}"] for a in "xyz"], axis=1)
    return run, run.history["time"]*WAY - GAP, force


# Depths from a few hundredths of the punch's elements to most of one.
@pytest.mark.parametrize("depth", [0.012, 0.03, 0.05, 0.08, 0.2])
@pytest.mark.parametrize("options", ["", ", SIDES=ONE", ", EDGES=NO", ", TYPE=MORTAR"])
def test_the_side_is_pushed_and_only_when_it_is_met(tmp_path: Path, depth: float, options: str) -> None:
    _, way, force = ran(tmp_path, beside(depth, "*STATIC, DIRECT\n.04, 1.", options))
    assert np.abs(force[way < -0.001*WAY]).max() == 0.0
    first = np.argmax(way > 0.0)
    pushes = force[first:first + 3, 0]
    assert (pushes > 0.0).all()
    # Without friction and before anything turns the side is pushed along its normal.
    assert np.abs(force[first:first + 3, 2]).max() <= 0.05*pushes.max()
    # It begins from nothing: the force follows the way from the first increment on. Edges between faces in one plane
    # join the nodes .016 of a face deeper, in the next increment: two of seven that hold.
    assert pushes[0] == pytest.approx(pushes[2]*way[first]/way[first + 2], rel=0.15)


@pytest.mark.parametrize("options", ["", ", TYPE=MORTAR"])
@pytest.mark.parametrize("more", ["", "*FRICTION\n.3\n"])
def test_nothing_acts_across_the_gap_in_dynamics(tmp_path: Path, more: str, options: str) -> None:
    run, way, force = ran(tmp_path, beside(0.05, "*DYNAMIC, DIRECT\n.02, 1.", options, more=more))
    # PERSISTENT contact acts across the last open gap at most, the way of one increment.
    assert np.abs(force[way < -0.02*WAY - 0.01*GAP]).max() == 0.0
    assert force[way > 0.0, 0].max() > 0.0
    assert run.verdict["verdict"] == "good"


@pytest.mark.each_value
@pytest.mark.parametrize("clearance", [0.0, 0.001, 0.005, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06])
@pytest.mark.parametrize("cells", [pytest.param((kind, options, n), id=f"{kind}{options}-{n}")
                                   for kind in ("C3D8", "C3D4") for options in ("", ", TYPE=MORTAR") for n in (1, 2, 4)])
def test_a_cube_falls_past_a_table(tmp_path: Path, cells: tuple[str, str, int], clearance: float) -> None:
    """Beside it, nearer than any facet is long, or along its side: a free fall."""
    kind, options, n = cells
    table = Block(kind, (2, 4, 4), size=(1.0, 2.0, 2.0), place=lambda x: x + np.array([1.0, 0.0, -2.0]))
    cube = Block(kind, (n,)*3, size=(0.5, 0.5, 0.5), place=lambda x: x + np.array([2.0 + clearance, 0.7, 0.1]))
    foot = "".join(f"{len(cube.x) + k}, 1, 3\n" for k in table.on(2, 0))
    deck = tmp_path/"deck.inp"
    deck.write_text(bodies([cube, table], [faces(cube), faces(table)], "*ELASTIC\n1000., .3\n*DENSITY\n1.\n")
                    + f"*SURFACE INTERACTION, NAME=I\n*CONTACT PAIR, INTERACTION=I{options}\nS1, S2\n*BOUNDARY\n{foot}"
                    + dynamic(0.01, 0.3, "*DLOAD\nB1, GRAV, 10., 0., 0., -1.\n"))
    run = run_deck(deck, tmp_path)
    u = run.fields()["displacement"][-1][:len(cube.x)]
    assert np.abs(u - [0.0, 0.0, -0.5*10.0*0.3**2]).max() <= 1e-11
    assert max(np.abs(run.history[f"pair1_force_{a}"]).max() for a in "xyz") <= 1e-11


@pytest.mark.parametrize("options", ["", ", TYPE=MORTAR"])
@pytest.mark.parametrize("kind", ["C3D4", "C3D10", "C3D20"])
def test_kinds_of_elements(tmp_path: Path, kind: str, options: str) -> None:
    _, way, force = ran(tmp_path, beside(0.05, "*STATIC, DIRECT\n.04, 1.", options, kind))
    assert np.abs(force[way < -0.001*WAY]).max() == 0.0
    assert force[-1, 0] > 0.5*abs(force[-1, 2])


def test_soft_contact_keeps_what_it_stores_past_an_end(tmp_path: Path) -> None:
    """A block deep in soft contact slides off a table: what a node has stored it gets back, however it leaves."""
    table = Block("C3D8", (4, 4, 1), size=(2.0, 2.0, 1.0), place=lambda x: x - np.array([0.0, 0.0, 1.0]))
    block = Block("C3D8", (2, 2, 2), size=(0.5, 0.5, 0.5), place=lambda x: x + np.array([1.2, 0.75, 0.0]))
    n = len(block.x)
    foot = "".join(f"{k}\n" for k in table.on(2, 0) + n)
    text = (bodies([block, table], [faces(block), faces(table)], "*HYPERELASTIC, COUPLED NEO HOOKE\n1000., .3\n*DENSITY\n1.\n")
            + pair(interaction="*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n100.\n")
            + f"*NSET, NSET=FOOT\n{foot}*BOUNDARY\nFOOT, 1, 3\n*INITIAL CONDITIONS, TYPE=VELOCITY\nN1, 1, .9\n"
            + dynamic(0.01, 0.8, "*DLOAD\nB1, GRAV, 5., 0., 0., -1.\n"))
    deck = tmp_path/"deck.inp"
    deck.write_text(text)
    total = run_deck(deck, tmp_path).history["total"]
    assert np.abs(total - total[0]).max() <= 1e-12*total[0]


@pytest.mark.parametrize("options", ["", ", TYPE=MORTAR"])
@pytest.mark.parametrize("thickness", [0.05, 0.01, 0.00625, 0.001])
def test_far_sides_of_thin_sheets_do_not_meet(tmp_path: Path, thickness: float, options: str) -> None:
    """A sheet much thinner than its facets are long is pressed on another: what is behind them is not touched."""
    low = Block("C3D8", (4, 4, 1), size=(1.0, 1.0, thickness), place=lambda x: x)
    high = Block("C3D8", (3, 3, 1), size=(1.0, 1.0, thickness), place=lambda x: x + np.array([0.0, 0.0, 1.2*thickness]))
    foot = "".join(f"{k}\n" for k in low.on(2, 0) + len(high.x))
    deck = tmp_path/"deck.inp"
    deck.write_text(bodies([high, low], [faces(high), faces(low)], f"*ELASTIC\n{E}, 0.\n*DENSITY\n1.\n")
                    + f"*SURFACE INTERACTION, NAME=I\n*CONTACT PAIR, INTERACTION=I{options}\nS1, S2\n*NSET, NSET=FOOT\n{foot}"
                    + "*BOUNDARY\nFOOT, 1, 3\nN1, 1, 2\n*STEP, NLGEOM\n*STATIC, DIRECT\n.25, 1.\n*DLOAD\nB1, P2, 1.\n"
                    + "*NODE FILE\nU\n*CONTACT FILE\nCF\n*END STEP\n")
    run = run_deck(deck, tmp_path)
    force = sum(run.history[name][-1] for name in run.history.dtype.names if name.endswith("force_z"))
    assert abs(force) == pytest.approx(1.0, rel=1e-9)
    # A pressure of .01 E in both sheets, after the gap.
    u = run.fields()["displacement"][-1][:len(high.x), 2]
    assert u.min() == pytest.approx(-0.22*thickness, rel=2e-3)
    assert run.history["cuts"].sum() == 0
    assert run.verdict["verdict"] == "good"
