"""Bodies that begin in each other with no node behind a face: edges that cross, faces in one plane. The error names place
and depth, before the first step."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from contact_space_scenes import bodies, dynamic, faces, pair
from scene_tools import emcon, run_deck
from space_mesh import Block

ALL = "*SURFACE INTERACTION, NAME=I\n*CONTACT\n*CONTACT INCLUSIONS, ALL EXTERIOR\n*CONTACT PROPERTY ASSIGNMENT\n, , I\n"


def block(size: tuple[float, float, float], at: tuple[float, float, float], kind: str = "C3D8") -> Block:
    return Block(kind, (1, 1, 1), size=size, place=lambda x: x + at)


def refused(deck: Path, text: str, surfaces: str, depth: float) -> None:
    deck.write_text(text)
    done = emcon(deck, "--quiet", "--output", deck.parent)
    assert done.returncode == 2
    found = re.search(r"deck\.inp:(\d+): error: bodies of " + surfaces + r" overlap at the start by \S+ of an edge: a point "
                      r"beside node \d+ of body \d is (\S+) behind the (face|edge) .* move the bodies apart", done.stderr)
    assert found, done.stderr
    card = text.splitlines()[int(found[1]) - 1]
    assert card.startswith("*CONTACT")
    # Middles of edges and places behind faces are asked: of bodies in one place the deepest is between.
    assert 0.6*depth < float(found[2]) < 1.01*depth


@pytest.mark.parametrize(("contact", "surfaces"), [(pair(), "surface S1 and of surface S2"), (ALL, "surface ALL_EXTERIOR")])
@pytest.mark.parametrize("kind", ["C3D8", "C3D4"])
@pytest.mark.parametrize(("one", "two", "depth"), [
    (((4, 1, 1), (0, 0, 0)), ((1, 4, 1), (1.5, -1.5, 0.95)), 0.05),        # bars that cross
    (((1, 1, 1), (0, 0, 0)), ((1, 1, 1), (0.9, 0, 0)), 0.1),               # nodes on faces of the other
    (((1, 1, 1), (0, 0, 0)), ((1, 1, 1), (0, 0, 0)), 0.5)])
def test_no_node_is_inside(one: tuple, two: tuple, depth: float, kind: str, contact: str, surfaces: str,
                           tmp_path: Path) -> None:
    blocks = [block(*one, kind), block(*two, kind)]
    text = bodies(blocks, [faces(b) for b in blocks]) + contact + dynamic(0.02, 0.04)
    refused(tmp_path/"deck.inp", text, surfaces, depth)


@pytest.mark.parametrize(("aside", "depth"), [((0.0, 0.0), 0.5), ((0.0, -0.5), 0.5), ((0.0, -0.8), 0.2)])
def test_squares_in_one_place(aside: tuple[float, float], depth: float, tmp_path: Path) -> None:
    """In the plane: with a pair refused, without one told."""
    square = ((0, 0), (1, 0), (1, 1), (0, 1))
    nodes = [(x + k*aside[0], y + k*aside[1]) for k in (0, 1) for x, y in square]
    text = ("*NODE\n" + "".join(f"{i}, {x!r}, {y!r}\n" for i, (x, y) in enumerate(nodes, 1))
            + "*ELEMENT, TYPE=CPE4, ELSET=A\n1, 1, 2, 3, 4\n*ELEMENT, TYPE=CPE4, ELSET=B\n2, 5, 6, 7, 8\n"
            "*MATERIAL, NAME=M\n*ELASTIC\n100., .3\n*DENSITY\n1.\n*SOLID SECTION, ELSET=A, MATERIAL=M\n"
            "*SOLID SECTION, ELSET=B, MATERIAL=M\n*SURFACE, NAME=S1\nA\n*SURFACE, NAME=S2\nB\n")
    step = "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n.01, .02\n*NODE FILE\nU\n*END STEP\n"
    refused(tmp_path/"deck.inp", text + pair() + step, "surface S1 and of surface S2", depth)
    (tmp_path/"deck.inp").write_text(text + step)
    warnings = run_deck(tmp_path/"deck.inp", tmp_path).verdict["warnings"]
    assert any("bodies overlap as a step begins" in text for text in warnings)


@pytest.mark.parametrize("lift", [0.0, 1e-6])
def test_what_touches_is_no_overlap(lift: float, tmp_path: Path) -> None:
    blocks = [block((4, 1, 1), (0, 0, 0)), block((1, 4, 1), (1.5, -1.5, 1.0 + lift))]
    deck = tmp_path/"deck.inp"
    deck.write_text(bodies(blocks, [faces(b) for b in blocks]) + pair() + dynamic(0.02, 0.04))
    assert run_deck(deck, tmp_path).verdict["verdict"] == "good"

