"""Bodies that go into each other in three dimensions, where nothing holds them: what the run says."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import overlap
import pytest
from scene_tools import EPSILON, Run, run_deck
from space_mesh import KINDS, TETRAHEDRA, Block

RUBBER = "*HYPERELASTIC, NEO HOOKE\n1000., 1e-4\n*DENSITY\n1.\n"


def together(folder: Path, blocks: list[Block], speed: list[tuple[float, float, float]], step: float, n: int,
             code: int = 3) -> Run:
    """A run of blocks that fly, each by its velocity, `n` steps."""
    text, first, cells = "", 0, 0
    for i, (block, v) in enumerate(zip(blocks, speed, strict=True), 1):
        text += f"*NODE, NSET=N{i}\n" + "".join(
            f"{first + k}, {x!r}, {y!r}, {z!r}\n" for k, (x, y, z) in enumerate(block.x.tolist(), 1))
        text += f"*ELEMENT, TYPE={block.type}, ELSET=B{i}\n"
        for k, nodes in enumerate(block.element, cells + 1):
            words = [str(w) for w in (k, *(first + m for m in nodes))]
            text += "".join(", ".join(words[j:j + 12]) + (",\n" if j + 12 < len(words) else "\n")
                            for j in range(0, len(words), 12))
        first, cells = first + len(block.x), cells + len(block.element)
        text += f"*SOLID SECTION, ELSET=B{i}, MATERIAL=M\n*INITIAL CONDITIONS, TYPE=VELOCITY\n"
        text += "".join(f"N{i}, {a}, {w!r}\n" for a, w in enumerate(v, 1))
    deck = folder/"deck.inp"
    deck.write_text(f"*MATERIAL, NAME=M\n{RUBBER}{text}*STEP, NLGEOM, INC={n}\n*DYNAMIC, DIRECT\n"
                    f"{step!r}, {step*n!r}\n*NODE FILE\nU\n*END STEP\n")
    return run_deck(deck, folder, code)


def moved(*to: float):
    return lambda x: x + np.array(to)


@pytest.mark.parametrize("kind", KINDS)
def test_a_block_sinks_into_another(kind: str, tmp_path: Path) -> None:
    """Nodes over nodes, sides in one plane: by 0.03 of its height in each of two steps."""
    blocks = [Block(kind, (2, 2, 2)), Block(kind, (2, 2, 2), place=moved(0., 0., 1.))]
    run = together(tmp_path, blocks, [(0., 0., 0.), (0., 0., -0.3)], 0.1, 2)
    length = np.sqrt(0.125) if kind in TETRAHEDRA else 0.5
    assert run.verdict["penetration"] == pytest.approx(0.06/length, rel=1e-8)
    assert list(run.history["penetration"]) == pytest.approx([0, 0.03/length, 0.06/length], rel=1e-9, abs=1e-15)
    (reason,) = run.verdict["reasons"]
    assert re.search(r"time 0.2, node \d+ of body 1 is 0.06 behind the face of nodes \d+(, \d+){2,7} of body 2: no "
                     r"\*CONTACT PAIR names the two; add one, or name all by \*CONTACT", reason)
    faces = 96 if kind in TETRAHEDRA else 48
    assert f"overlap checked: 2 bodies, {faces} faces; deepest penetration " in run.log


@pytest.mark.parametrize("kind", KINDS)
def test_blocks_in_touch_do_not_overlap(kind: str, tmp_path: Path) -> None:
    """Like and unlike meshes on top of each other, one of which flies along the other."""
    for k, cells in enumerate([(2, 2, 2), (3, 1, 1)]):
        (tmp_path/str(k)).mkdir()
        blocks = [Block(kind, (2, 2, 2)), Block(kind, cells, place=moved(0., 0., 1.))]
        run = together(tmp_path/str(k), blocks, [(0., 0., 0.), (0.3, 0.1, 0.)], 0.1, 2, code=0)
        assert run.verdict["penetration"] <= 16*EPSILON


def test_what_overlaps_from_the_start_is_told(tmp_path: Path) -> None:
    """And left as it is."""
    blocks = [Block("C3D8", (2, 2, 2)), Block("C3D8", (2, 2, 2), place=moved(0.1, 0., 0.95))]
    run = together(tmp_path, blocks, [(0., 0., 0.), (0., 0., -0.3)], 0.1, 2, code=0)
    assert any("bodies overlap as a step begins, by 0.1 of an edge" in text for text in run.verdict["warnings"])
    assert run.verdict["penetration"] == 0


def test_one_body_has_nothing_to_meet(tmp_path: Path) -> None:
    run = together(tmp_path, [Block("C3D8", (2, 2, 2))], [(0., 0., 1.)], 0.1, 2, code=0)
    assert "overlap not checked: no *CONTACT PAIR" in run.log


def turned(seed: int, to: tuple[float, ...] = (0., 0., 0.)):
    q = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    q *= np.sign(np.linalg.det(q))
    return lambda x: (x - 0.5) @ q.T + 0.5 + np.array(to)


@pytest.mark.parametrize(("seed", "kind"), list(enumerate(KINDS)))
def test_depths_are_those_that_an_outsider_finds(seed: int, kind: str, tmp_path: Path) -> None:
    """Two cubes of cells of unlike sizes that fly through each other, both turned."""
    blocks = [Block(kind, (2, 2, 2), place=turned(seed)),
              Block(kind, (3, 3, 3), place=turned(seed + 100, (0.2, 0.1, 1.8)))]
    run = together(tmp_path, blocks, [(0., 0., 0.), (0., 0.1, -1.)], 0.05, 24)
    fields = run.fields()
    bodies = overlap.BodiesInSpace(fields.cells, centres=False)
    frames = [bodies.overlap(x) for x in (fields.x + fields["displacement"])[::4]]
    told = run.history["penetration"][::4]
    assert max(f.by_edge for f in frames) > 0.3
    assert [f.by_edge for f in frames] == pytest.approx(list(told), rel=1e-6, abs=1e-9)


def test_bodies_without_a_pair_meet_from_afar_in_the_plane(tmp_path: Path) -> None:
    """In steps that are small beside what was between them."""
    deck = tmp_path/"deck.inp"
    squares = "".join(f"{4*k + i}, {x}, {y + 3.0*k}\n" for k in range(2)
                      for i, (x, y) in enumerate([(0, 0), (1, 0), (1, 1), (0, 1)], 1))
    deck.write_text(f"*MATERIAL, NAME=M\n{RUBBER}*NODE\n{squares}*ELEMENT, TYPE=CPE4, ELSET=ALL\n1, 1, 2, 3, 4\n"
                    "2, 5, 6, 7, 8\n*SOLID SECTION, ELSET=ALL, MATERIAL=M\n1.\n*NSET, NSET=UP, GENERATE\n5, 8\n"
                    "*INITIAL CONDITIONS, TYPE=VELOCITY\nUP, 2, -1.\n*STEP, NLGEOM, INC=22\n*DYNAMIC, DIRECT\n0.1, 2.2\n"
                    "*END STEP\n")
    run = run_deck(deck, tmp_path, 3)
    assert run.verdict["penetration"] == pytest.approx(0.2, rel=1e-8)


def plate(kind: str, at: float = 0.) -> Block:
    return Block(kind, (8, 8, 1), (2, 2, 0.05), place=moved(-1., -1., at))


@pytest.mark.parametrize("kind", ["C3D4", "C3D8", "C3D10", "C3D20"])
def test_a_block_goes_through_a_plate_in_one_step(kind: str, tmp_path: Path) -> None:
    """It is on the other side at the end. Halfway, nodes of the plate are deep in the block."""
    block = Block(kind, (2, 2, 2), (0.3, 0.3, 0.3), place=turned(3, (-0.3, -0.3, 0.)))
    run = together(tmp_path, [plate(kind), block], [(0., 0., 0.), (0.1, 0.05, -1.2)], 1., 1)
    assert 0.3 < run.verdict["penetration"] < 1.5
    assert "no *CONTACT PAIR names the two" in run.verdict["reasons"][0]
    frames = overlap.frames(run.fields())
    assert max(frames).depth == 0


def test_bars_go_through_each_other_in_one_step(tmp_path: Path) -> None:
    """No node of one meets a face of the other."""
    blocks = [Block("C3D8", (3, 1, 1), (2, 0.2, 0.2), place=moved(-1., -0.1, 0.)),
              Block("C3D8", (1, 1, 1), (0.2, 2, 0.2), place=moved(-0.1, -1., 0.5))]
    run = together(tmp_path, blocks, [(0., 0., 0.), (0.03, 0.02, -1.)], 1., 1)
    assert run.verdict["penetration"] > 0.1


@pytest.mark.parametrize("speed", [(3., 0., 0.), (0., 0., 3.), (2., 1., 0.), (-3., 0., -3.)])
def test_what_passes_by_in_one_step_is_no_overlap(speed: tuple[float, float, float], tmp_path: Path) -> None:
    """Along a plate that it stands on, away from it, and beside its edge."""
    where = (1.2, 0., 0.3) if speed[0] < 0 else (-0.15, 0., 0.05)
    speed = (-speed[0], 0., speed[2]) if speed[0] < 0 else speed
    block = Block("C3D8", (2, 2, 2), (0.3, 0.3, 0.3), place=moved(*where))
    run = together(tmp_path, [plate("C3D8"), block], [(0., 0., 0.), speed], 1., 1, code=0)
    assert run.verdict["penetration"] <= 16*EPSILON


def test_bodies_that_fly_together_are_looked_at_once(tmp_path: Path) -> None:
    """Far and fast, in touch all the way."""
    blocks = [Block("C3D8", (2, 2, 2)), Block("C3D8", (3, 3, 3), place=moved(0., 0., 1.))]
    run = together(tmp_path, blocks, [(30., 10., -20.)]*2, 1., 2, code=0)
    assert run.verdict["penetration"] <= 1e-12
