"""Mortar contact in space of a surface with itself: a strip and a tube that fold, and many bodies."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import overlap
import pytest
from contact_space_scenes import RUBBER, bodies, dynamic
from scene_tools import EPSILON, Run
from space_mesh import Block
from test_self_contact_space import ALL, THICK, arms_in_each_other, check_books, dropped, ran, skin, u_strip
from wall_space_scenes import cube, falling, pair, plane

MORTAR = "*SURFACE INTERACTION, NAME=I\n*CONTACT PAIR, INTERACTION=I, TYPE=MORTAR\n{0}, {0}\n"
#: Energy and momenta, of the largest of each.
BALANCE = 1.0e-11


@pytest.mark.parametrize("kind", ["C3D8", "C3D4"])
def test_a_strip_closes_onto_itself(kind: str, tmp_path: Path) -> None:
    """The arms of a hairpin stop at each other, by less than a fiftieth of their thickness."""
    text, block, along = u_strip(kind, MORTAR.format("S1"), until=0.3, cells=(12, 1, 1))
    run = ran(tmp_path, text)
    assert run.verdict["verdict"] == "good", run.log[-600:]
    check_books(run)
    assert run.history["active"].max() > 0
    assert arms_in_each_other(run, block, along) <= 0.02*THICK


def tube(contact: str, cells: int = 32, speed: float = 4.5, until: float = 0.7) -> tuple[str, Block]:
    """A free tube whose top and bottom fly at each other: it folds at both sides and closes between."""
    block = Block("C3D8", (cells, 1, 1), size=(2.0*np.pi, 0.2, 0.5))
    angle = block.x[:, 0].copy()
    radius = 0.8 + block.x[:, 1]
    block.x = np.stack([radius*np.cos(angle + 0.2), radius*np.sin(angle + 0.2), -block.x[:, 2]], axis=1)
    ends = angle > 2.0*np.pi - 1.0e-9             # the seam: what is there already
    to = np.arange(len(angle))
    starts = np.flatnonzero(angle < 1.0e-9)
    for k in np.flatnonzero(ends):
        to[k] = starts[np.linalg.norm(block.x[starts] - block.x[k], axis=1).argmin()]
    number = np.cumsum(~ends) - 1
    block.element = [[int(number[to[k - 1]]) + 1 for k in nodes] for nodes in block.element]
    block.x = block.x[~ends]
    moves = "".join(f"{k}, 2, {-speed*y!r}\n" for k, y in enumerate(block.x[:, 1].tolist(), 1))
    return (bodies([block], [[]], RUBBER) + "B1\n" + contact + "*INITIAL CONDITIONS, TYPE=VELOCITY\n" + moves
            + dynamic(0.02, until)), block


def halves_in_each_other(run: Run, block: Block) -> float:
    """How deep the upper half of a tube is in the lower one, apart from the folds, at any time."""
    fields, cells = run.fields(), np.array(block.element) - 1
    middle = fields.x[cells].mean(1)
    is_apart = np.arctan2(np.abs(middle[:, 1]), np.abs(middle[:, 0])) > 0.35
    halves = [cells[is_apart & (sign*middle[:, 1] > 0.0)] for sign in (1.0, -1.0)]
    found = 0.0
    for u in fields["displacement"]:
        (p, t), (q, s) = (skin(half, fields.x + u) for half in halves)
        found = max(found, overlap.overlap_of_triangles(p, t, q, s))
    return found


def test_a_tube_folds(tmp_path: Path) -> None:
    """Its inside meets itself, and neither what is next to it in the folds nor the outside is taken for that."""
    (tmp_path/"without").mkdir()
    text, block = tube("")
    assert halves_in_each_other(ran(tmp_path/"without", text), block) > 0.05
    text, block = tube(MORTAR.format("S1"))
    run = ran(tmp_path, text)
    assert run.verdict["verdict"] == "good", run.log[-600:]
    check_books(run)
    assert run.history["active"].max() >= 4
    assert halves_in_each_other(run, block) <= 0.02*0.2


def test_what_does_not_meet_is_not_held(tmp_path: Path) -> None:
    """A tube that is folded sharply and opens again takes the steps that it takes without contact."""
    ends = []
    for contact in ("", MORTAR.format("S1")):
        folder = tmp_path/str(len(contact))
        folder.mkdir()
        run = ran(folder, tube(contact, speed=3.5)[0])
        assert run.history["active"].max() == 0 and run.history["cuts"].sum() == 0
        ends.append(run.fields()["displacement"][-1])
    assert np.abs(ends[0] - ends[1]).max() <= 1.0e-10


def one_surface(n: tuple[int, int, int], until: float = 0.2) -> str:
    """Cubes that fall in layers, all of them and the floor one surface."""
    surface = "*SURFACE, NAME=Q\n" + "".join(f"B{k}\n" for k in range(1, int(np.prod(n)) + 2))
    return dropped(n, 0.01, until).replace(ALL, surface + MORTAR.format("Q"))


@pytest.mark.parametrize("n", [(1, 1, 2), (2, 1, 2)])
def test_many_cubes(n: tuple[int, int, int], tmp_path: Path) -> None:
    """One surface of all bodies: of two that meet one is the slave; nothing is lost, nothing overlaps."""
    run = ran(tmp_path, one_surface(n))
    history = run.history
    assert run.verdict["verdict"] == "good", run.log[-600:]
    assert np.ptp(history["total"]) <= BALANCE*history["total"].max()
    assert history["active"].max() > 0
    assert overlap.worst(run.fields()).depth <= 64*EPSILON


def test_all_exterior(tmp_path: Path) -> None:
    """It is the one surface of all bodies, bit by bit; a wall meets it, too."""
    everything, ends = ALL.replace("ALL EXTERIOR", "ALL EXTERIOR, TYPE=MORTAR"), []
    for name, text in (("named", one_surface((2, 1, 2))), ("all", dropped((2, 1, 2), 0.01, 0.2).replace(ALL, everything))):
        folder = tmp_path/name
        folder.mkdir()
        run = ran(folder, text)
        assert run.history["active"].max() > 0
        ends.append(run.fields()["displacement"][-1])
    assert np.array_equal(*ends)
    run = ran(tmp_path, falling(cube(), plane(), (0., 0., -1.)).replace(pair(), everything))
    assert run.verdict["verdict"] == "good"
    assert np.ptp(run.history["total"]) <= BALANCE*run.history["total"].max()
    assert run.history["pair2_active"].max() > 0 and run.history["pair1_active"].max() == 0
    assert "mortar" in next(line for line in run.log.splitlines() if "ALL_EXTERIOR (" in line and " W" in line)


@pytest.mark.parametrize("friction", ["", "*FRICTION\n0.3\n"])
def test_one_surface_is_a_pair(friction: str, tmp_path: Path) -> None:
    """Two bodies: one surface in contact with itself takes the steps of the pair, whose slave is the finer one."""
    ends, losses = [], []
    for name, text in (("itself", one_surface((1, 1, 1))), ("pair", dropped((1, 1, 1), 0.01, 0.2).replace(
            ALL, MORTAR.format("@").replace("@, @", "S2, S1")))):
        folder = tmp_path/name
        folder.mkdir()
        text = re.sub(r"^(\d+), 3, -1\.$", r"\1, 3, -1.\n\1, 1, 0.5", text, flags=re.M)     # and sideways
        run = ran(folder, text.replace("NAME=I\n", f"NAME=I\n{friction}", 1))
        assert run.history["active"].max() > 0
        ends.append(run.fields()["displacement"][-1])
        losses.append(run.history["friction_loss"])
    assert np.abs(ends[0] - ends[1]).max() <= 1.0e-10
    assert np.abs(losses[0] - losses[1]).max() <= 1.0e-10*run.history["total"].max()
    assert np.diff(losses[0]).min() >= 0.0 and (losses[0][-1] > 0.0) == bool(friction)
