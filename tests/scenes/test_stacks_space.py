"""Stacks in space that contact of everything with everything holds, beside planes of symmetry: rigid boxes on corners, tip
on tip. The supports bear the weight, summed here."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from contact_space_scenes import ball, bodies, faces, straight
from scene_tools import Run, run_deck
from space_mesh import Block

LAW = "*HYPERELASTIC, NEO HOOKE\n200., 2e-3\n*DENSITY\n1.\n"
REFERENCE = 9001
G = 2.0
#: Of the weight, which Newton's method leaves.
LEFT = 1.0e-8


def stack(blocks: list[Block], rigid: tuple[int, ...] = ()) -> str:
    """Blocks about the axes x = 0 and y = 0, which are planes of symmetry, on each other under their weight."""
    text, held, first = bodies(blocks, [faces(b) for b in blocks], LAW), "", 0
    for i, own in enumerate(blocks, 1):
        if i in rigid:
            text += (f"*NODE\n{REFERENCE}, {', '.join(map(repr, own.x.mean(0).tolist()))}\n"
                     f"*RIGID BODY, ELSET=B{i}, REF NODE={REFERENCE}\n")
            held += f"{REFERENCE}, 1, 2\n{REFERENCE}, 4, 6\n"
        else:
            held += "".join(f"{first + k}, {a + 1}\n" for a in (0, 1) for k in own.on(a, 0))
        if i == 1:
            held += "".join(f"{first + k}, 3\n" for k in own.on(2, 0))
        first += len(own.x)
    text += "*SURFACE INTERACTION, NAME=I\n*CONTACT\n*CONTACT INCLUSIONS, ALL EXTERIOR\n*CONTACT PROPERTY ASSIGNMENT\n, , I\n"
    text += f"*BOUNDARY\n{held}*STEP, NLGEOM\n*STATIC\n.25, 1.\n*DLOAD\n"
    text += "".join(f"B{i}, GRAV, {G}, 0., 0., -1.\n" for i in range(1, len(blocks) + 1))
    return f"{text}*NODE FILE\nU, RF\n*END STEP\n"


def ran(folder: Path, text: str) -> Run:
    deck = folder/"deck.inp"
    deck.write_text(text)
    run = run_deck(deck, folder)
    assert run.verdict["verdict"] == "good"
    return run


@pytest.mark.parametrize("gap", [0.0, 0.01])
@pytest.mark.parametrize("size", [(0.7, 0.7), (0.7, 0.5), (0.5, 0.5)])
def test_rigid_box_on_a_corner(size: tuple[float, float], gap: float, tmp_path: Path) -> None:
    """Its rotations are prescribed: of its conditions none is left."""
    cube, box = Block("C3D8", (2, 2, 2)), Block("C3D8", (1, 1, 1), size=(*size, 0.5))
    box.x[:, 2] += 1.0 + gap
    run = ran(tmp_path, stack([cube, box], (2,)))
    fields = run.fields()
    weight = G*(1.0 + 0.5*size[0]*size[1])
    assert abs(fields["reaction_force"][-1, :, 2].sum() - weight) < LEFT*weight
    u = fields["displacement"][-1, len(cube.x):]
    assert np.abs(u[:len(box.x)] - u[0]).max() < 1e-12
    assert -0.01 < u[0, 2] + gap < 0.0


def tip(kind: str, z: float) -> Block:
    """A quarter of a ball of one element: above and below a point on the axis."""
    own = Block(kind, (1, 1, 1), size=(2.0, 2.0, 2.0))
    own.x = ball(own.x*[0.5, 0.5, 1.0] + [1.0, 1.0, 0.0])
    straight(own)
    own.x[:, 2] += z - own.x[:, 2].min()
    return own


def volume(own: Block) -> float:
    """Of tetrahedra by their corners, of a hexahedron by five of them: its faces are flat by symmetry or as the mean of
    both ways to split them."""
    total = 0.0
    for nodes in own.element:
        x = own.x[np.array(nodes) - 1]
        if len(x) == 8:
            point = np.array([-1.0, 1.0])/np.sqrt(3.0)
            corner = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1],
                               [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])
            for r in np.stack(np.meshgrid(point, point, point), -1).reshape(-1, 3):
                part = 0.5*(1.0 + corner*r)
                slope = np.stack([0.5*corner[:, a]*part[:, (a + 1) % 3]*part[:, (a + 2) % 3] for a in range(3)])
                total += np.linalg.det(slope @ x)
        else:
            total += np.linalg.det(x[1:4] - x[0])/6.0
    return total


@pytest.mark.parametrize("gap", [0.0, 0.01])
@pytest.mark.parametrize("kinds", [("C3D8", "C3D8"), ("C3D4", "C3D10"), ("C3D10", "C3D8")])
def test_tip_on_tip(kinds: tuple[str, str], gap: float, tmp_path: Path) -> None:
    """Of the corner that a quarter of a body has in its planes of symmetry there is none in the whole: what touches are the
    faces around the tips."""
    base = Block("C3D8", (1, 1, 1), size=(1.2, 1.2, 1.0))
    blocks = [base, tip(kinds[0], 1.0), tip(kinds[1], 3.0 + gap)]
    fields = ran(tmp_path, stack(blocks)).fields()
    weight = G*sum(map(volume, blocks))
    assert abs(fields["reaction_force"][-1, :, 2].sum() - weight) < LEFT*weight
    first = np.cumsum([0, *(len(b.x) for b in blocks)])
    z = fields.x[:, 2] + fields["displacement"][-1, :, 2]
    axis = (fields.x[:, 0] == 0.0) & (fields.x[:, 1] == 0.0)
    below, above = (z[a:b][axis[a:b]] for a, b in zip(first[1:-1], first[2:], strict=True))
    # Rounded over a patch of .07 of a facet, tips that turn by .4 to .8.
    assert -0.03 < above.min() - below.max() < 1e-3


@pytest.mark.parametrize("gap", [0.0, 0.01])
@pytest.mark.parametrize("kind", ["C3D4", "C3D8", "C3D10"])
def test_tip_on_faces_by_mortar(kind: str, gap: float, tmp_path: Path) -> None:
    """Faces around a tip meet in the mean where it is deep inside: its guard, which lets corners in by a thousandth of a
    face, bears a ball of one element from the start."""
    blocks = [Block("C3D8", (3, 1, 1), size=(0.9, 1.3, 1.0)), tip(kind, 1.0 + gap)]
    contact = "*CONTACT PAIR, INTERACTION=I, TYPE=MORTAR\nS1, S2\n*BOUNDARY"
    fields = ran(tmp_path, re.sub(r"\*CONTACT\n.*?\*BOUNDARY", contact, stack(blocks), flags=re.S)).fields()
    weight = G*sum(map(volume, blocks))
    assert abs(fields["reaction_force"][-1, :, 2].sum() - weight) < LEFT*weight
    z = fields.x[:, 2] + fields["displacement"][-1, :, 2]
    axis = (fields.x[:, 0] == 0.0) & (fields.x[:, 1] == 0.0)
    n = len(blocks[0].x)
    assert abs(z[:n][axis[:n]].max() - z[n:][axis[n:]].min()) < 1.0e-3


@pytest.mark.each_value
@pytest.mark.parametrize("kinds", [("C3D10", "C3D10"), ("C3D10", "C3D8"), ("C3D4", "C3D10")])
@pytest.mark.parametrize("cells", [[(2, 1, 1), (1, 1, 1)], [(1, 1, 1), (2, 1, 1)]])
def test_block_inside_the_rim_of_another(cells: list[tuple[int, int, int]], kinds: tuple[str, str], tmp_path: Path) -> None:
    """Its rim is .05 inside. The frames of the outer rim, where faces of unlike shape meet, leaned by 60 degrees from the
    mean normal there: one found the block behind it, pushed its corner out and up, and the run was called good. No node
    moves by more than all of the weight shortens a column of both by."""
    blocks = [Block(kinds[0], cells[0], size=(0.9, 0.95, 1.0)), Block(kinds[1], cells[1], size=(0.8, 0.9, 1.0))]
    blocks[1].x[:, 2] += 1.0
    fields = ran(tmp_path, stack(blocks)).fields()
    weight = G*(0.9*0.95 + 0.8*0.9)
    assert abs(fields["reaction_force"][-1, :, 2].sum() - weight) < LEFT*weight
    shear, bulk = 2.0*200.0, 2.0/2e-3
    young = 9.0*bulk*shear/(3.0*bulk + shear)
    assert np.abs(fields["displacement"][-1]).max() < 2.0*weight/(0.8*0.9)/young


def test_four_blocks_of_tetrahedra(tmp_path: Path) -> None:
    """Unlike sizes and meshes, gaps 0."""
    blocks = [Block("C3D10", (1 + k % 2, 1, 1), size=(1 - 0.1*k, 1 - 0.05*k, 1.0), place=lambda x, k=k: x + [0, 0, k])
              for k in range(4)]
    fields = ran(tmp_path, stack(blocks)).fields()
    weight = G*sum((1 - 0.1*k)*(1 - 0.05*k) for k in range(4))
    assert abs(fields["reaction_force"][-1, :, 2].sum() - weight) < LEFT*weight
