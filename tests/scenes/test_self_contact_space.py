"""A surface in space in contact with itself: strips that fold, and many bodies that meet each other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import overlap
import pytest
from contact_space_scenes import RUBBER, bodies, dynamic, faces
from scene_tools import EPSILON, Run, run_deck
from space_mesh import Block

#: Energy and momenta, of the largest of each.
BALANCE = 1.0e-12
ARM, HALF, THICK, WIDE = 1.5, 0.5, 0.25, 0.5
LENGTH = 2*ARM + np.pi*HALF
PAIR = "*SURFACE INTERACTION, NAME=I\n*CONTACT PAIR, INTERACTION=I\nS1, S1\n"
ALL = "*CONTACT\n*CONTACT INCLUSIONS, ALL EXTERIOR\n"


def ran(folder: Path, text: str, code: int = 0) -> Run:
    deck = folder/"deck.inp"
    deck.write_text(text)
    return run_deck(deck, folder, code)


def bent(x: np.ndarray) -> np.ndarray:
    """A strip along the first axis as a U in the first two, opening along the first."""
    along, out = x[:, 0], HALF + x[:, 1] - 0.5*THICK
    turn = np.clip((along - ARM)/HALF, 0.0, np.pi)
    straight = np.where(along < ARM, ARM - along, np.maximum(along - (LENGTH - ARM), 0.0))
    return np.stack([straight - out*np.sin(turn), out*np.cos(turn), -x[:, 2]], axis=1)


def u_strip(kind: str, contact: str, speed: float = 3.0, until: float = 0.6, cells: tuple[int, int, int] = (16, 2, 2),
            h: float = 0.02, more: str = "", longer: float = 0.0) -> tuple[str, Block, np.ndarray]:
    """A free U whose arms fly at each other, one longer than the other; the places of its nodes along it."""
    block = Block(kind, cells, size=(LENGTH + longer, THICK, WIDE))
    block.x[:, 0] -= longer
    along = block.x[:, 0].copy()
    block.x = bent(block.x)
    v = -speed*np.sign(block.x[:, 1])*np.clip(block.x[:, 0]/ARM, 0.0, 1.0)
    moves = "".join(f"{k}, 2, {w!r}\n" for k, w in enumerate(v.tolist(), 1) if w)
    text = (bodies([block], [faces(block)], RUBBER) + contact + "*INITIAL CONDITIONS, TYPE=VELOCITY\n" + moves
            + dynamic(h, until, more))
    return text, block, along


def skin(cells: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of the outline of some cells."""
    known: dict[frozenset[int], list[list[int]]] = {}
    for cell in cells:
        for rim in overlap.rims(cell):
            known.setdefault(frozenset(rim), []).append(list(rim))
    points, triangles = [*x], []
    for rim, *others in known.values():
        if others:
            continue
        if len(rim) == 3:
            triangles.append(rim)
            continue
        triangles += [[a, b, len(points)] for a, b in zip(rim, rim[1:] + rim[:1], strict=True)]
        points.append(x[rim].mean(0))
    return np.array(points), np.array(triangles)


def arms_in_each_other(run: Run, block: Block, along: np.ndarray) -> float:
    """How deep the two arms of a U are in each other at any time, by numpy alone."""
    cells = np.array(block.element) - 1
    middle = along[cells].mean(1)
    arms = [cells[middle < ARM], cells[middle > LENGTH - ARM]]
    fields = run.fields()
    found = 0.0
    for u in fields["displacement"]:
        (p, t), (q, s) = (skin(arm, fields.x + u) for arm in arms)
        found = max(found, overlap.overlap_of_triangles(p, t, q, s))
    return found


def check_books(run: Run) -> None:
    """Energy and six momenta of free bodies."""
    history = run.history
    assert np.ptp(history["total"]) <= BALANCE*history["total"].max()
    for names in ("px py pz", "lx ly lz"):
        moments = np.array([history[name] for name in names.split()]).T
        assert np.abs(moments - moments[0]).max() <= BALANCE


@pytest.mark.parametrize(("kind", "contact", "deepest"), [
    ("C3D8", PAIR, 64*EPSILON), ("C3D8", ALL, 64*EPSILON), ("C3D4", PAIR, 0.02*THICK)])
def test_a_strip_closes_onto_itself(kind: str, contact: str, deepest: float, tmp_path: Path) -> None:
    """The nodes of each arm stop at the other one; sides of triangles cross between them by little."""
    text, block, along = u_strip(kind, contact)
    run = ran(tmp_path, text)
    assert run.verdict["verdict"] == "good", run.log[-600:]
    check_books(run)
    assert run.history["active"].max() > 0
    assert arms_in_each_other(run, block, along) <= deepest


def by_mortar(pair: str) -> str:
    return pair.replace("INTERACTION=I\nS1", "INTERACTION=I, TYPE=MORTAR\nS1")


def massless_strip(contact: str, initiation: str) -> tuple[str, Block, np.ndarray]:
    """A U that closes; the tip of its shorter arm is over the longer one."""
    return u_strip("C3D8", contact, 1.5, 0.5, (26, 3, 3), 0.01, f"*CONTACT INITIATION, TYPE={initiation}\n", 0.35)


@pytest.mark.parametrize("contact", [PAIR, by_mortar(PAIR)])
def test_a_strip_without_mass_at_its_surface(contact: str, tmp_path: Path) -> None:
    """Both arms are slave and master, and neither has mass: gaps close, nothing gets its mass back, the books hold."""
    text, block, along = massless_strip(contact, "MASSLESS")
    run = ran(tmp_path, text)
    assert run.verdict["verdict"] == "good", run.log[-600:]
    assert "contact surfaces without mass: 332 nodes" in run.log and "mass back" not in run.log
    check_books(run)
    assert run.history["active"].max() > 4 and run.history["cuts"].sum() == 0
    assert run.history["stand_off"].max() <= 64*EPSILON
    assert arms_in_each_other(run, block, along) <= 0.02*THICK


def test_without_contact_it_goes_through_itself(tmp_path: Path) -> None:
    """What the others are measured against; the check of a run without contact looks at bodies alone."""
    text, block, along = u_strip("C3D8", "")
    assert arms_in_each_other(ran(tmp_path, text), block, along) > 0.25*THICK


def test_what_crosses_itself_at_the_start_is_named(tmp_path: Path) -> None:
    """A strip in a circle that is closed by more than its length: its ends are in each other."""
    def wound(x: np.ndarray) -> np.ndarray:
        turn = 2.05*np.pi*x[:, 0]
        return np.stack([(1.0 + x[:, 1])*np.cos(turn), (1.0 + x[:, 1])*np.sin(turn), x[:, 2]], axis=1)

    block = Block("C3D8", (24, 2, 2), size=(1.0, 0.25, 0.5))
    block.x = wound(block.x)
    block.x[:, 2] *= -1.0
    run = ran(tmp_path, bodies([block], [faces(block)], RUBBER) + PAIR + dynamic(0.02, 0.1), code=2)
    assert "contact surface S1 crosses itself: face S" in run.errors


def dropped(n: tuple[int, int, int], gap: float, until: float) -> str:
    """Cubes in layers over a floor that is held, shifted at random, falling at 1."""
    random, blocks = np.random.default_rng(3), []
    for k, j, i in np.ndindex(n[::-1]):
        corner = np.array([1.06*i, 1.06*j, gap + (1.0 + gap)*k]) + [*random.uniform(-0.02, 0.02, 2), 0.0]
        blocks.append(Block("C3D8", (1, 1, 1), place=lambda x, corner=corner: x + corner))
    wide = 1.06*max(n[:2]) + 1.0
    floor = Block("C3D8", (3, 3, 1), size=(wide, wide, 0.5), place=lambda x: x - np.array([0.5, 0.5, 0.5]))
    m = 8*len(blocks)
    moves = "".join(f"{k}, 3, -1.\n" for k in range(1, m + 1))
    return (bodies([*blocks, floor], [faces(b) for b in [*blocks, floor]], "*ELASTIC\n1000., .3\n*DENSITY\n1.\n") + ALL
            + f"*NSET, NSET=FLOOR, GENERATE\n{m + 1}, {m + len(floor.x)}\n*BOUNDARY\nFLOOR, 1, 3\n"
            + "*INITIAL CONDITIONS, TYPE=VELOCITY\n" + moves + dynamic(0.02, until))


@pytest.mark.parametrize(("n", "until"), [((2, 2, 2), 0.3), pytest.param((5, 4, 3), 0.06, marks=pytest.mark.long)])
def test_many_cubes(n: tuple[int, int, int], until: float, tmp_path: Path) -> None:
    """One surface of all bodies: nothing is lost, nothing overlaps."""
    run = ran(tmp_path, dropped(n, 0.01, until))
    history = run.history
    assert np.ptp(history["total"]) <= BALANCE*history["total"].max()
    assert history["active"].max() > 0
    assert run.verdict["penetration"] <= 64*EPSILON
    assert overlap.worst(run.fields()).depth <= 64*EPSILON
    assert [name for name in history.dtype.names if name.endswith("_force_z")] == ["pair1_force_z"]


def test_bodies_that_begin_in_each_other_are_named(tmp_path: Path) -> None:
    run = ran(tmp_path, dropped((1, 1, 2), -0.01, 0.1), code=2)
    assert "penetrate surface ALL_EXTERIOR, by 0.01 at most" in run.errors


def test_all_with_all_is_every_pair(tmp_path: Path) -> None:
    """Two bodies: one surface in contact with itself takes the steps of the pair with both sides."""
    ends = []
    for name, contact in (("all", ALL), ("pair", "*SURFACE INTERACTION, NAME=I\n*CONTACT PAIR, INTERACTION=I\nS1, S2\n")):
        folder = tmp_path/name
        folder.mkdir()
        text = dropped((1, 1, 1), 0.01, 0.2)
        ends.append(ran(folder, text.replace(ALL, contact)).fields()["displacement"][-1])
    assert np.abs(ends[0] - ends[1]).max() <= 1.0e-10
