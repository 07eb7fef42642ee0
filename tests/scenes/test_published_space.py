"""Mortar contact in space against displacements that another code publishes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from contact_space_scenes import bodies, faces
from plain_mortar import Scene, pressed
from scene_tools import attempt
from space_mesh import Block

PUSH = 0.14
#: Node and component of a displacement: what 4C has as the result of its test `contact3D_sp_dual_simple_new_struct`
#: (github.com/4C-multiphysics/4C, tests/input_files; the same of dual and of standard multipliers).
PUBLISHED = {((-0.8, -1.0, -1.02), 0): -0.00372699924569964806, ((-1.0, -1.0, -1.27), 1): -0.00306733887599670938,
             ((-1.0, -0.8, -0.77), 2): -0.00125810920755156999}


def blocks() -> tuple[Block, Block]:
    """A cube of one element, turned by an eighth of a circle, .02 above a block of 10 x 10 x 4."""
    c = np.sqrt(0.5)
    turn = np.array([[c, -c, 0.0], [c, c, 0.0], [0.0, 0.0, 1.0]])
    return (Block("C3D8", (1, 1, 1), place=lambda x: (x - 0.5) @ turn.T),
            Block("C3D8", (10, 10, 4), size=(2, 2, 1), place=lambda x: x - np.array([1.0, 1.0, 1.52])))


def by_code(folder: Path, options: str) -> np.ndarray:
    """Displacements of both bodies."""
    one, two = blocks()
    sets = (("TOP", one.on(2, 1)), ("FOOT", two.on(2, 0) + len(one.x)))
    deck = folder/"deck.inp"
    deck.write_text(
        bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)], "*ELASTIC\n2250., .3\n")
        + "".join(f"*NSET, NSET={name}\n" + "".join(f"{k}\n" for k in on) for name, on in sets)
        + f"*SURFACE INTERACTION, NAME=I\n*CONTACT PAIR, INTERACTION=I, TYPE=MORTAR{options}\nS1, S2\n"
        + f"*BOUNDARY\nFOOT, 1, 3\n*STEP, NLGEOM\n*STATIC\n.25, 1.\n*BOUNDARY\nTOP, 1, 2\nTOP, 3, 3, {-PUSH}\n"
        + "*NODE FILE\nU\n*END STEP\n")
    return attempt(deck, folder, (), {})[1].fields()["displacement"][-1]


def by_itself(is_conserving: bool) -> np.ndarray:
    """The same by `plain_mortar`."""
    one, two = blocks()
    n = len(one.x)
    x = np.concatenate([one.x, two.x])
    element = np.array(one.element + [[k + n for k in each] for each in two.element]) - 1
    top, foot = np.array(one.on(2, 1)) - 1, np.array(two.on(2, 0)) + n - 1
    u = np.zeros_like(x)
    u[top, 2] = -PUSH
    is_given = np.isin(np.arange(len(x)), np.concatenate([top, foot]))
    upper = element[1:][np.isclose(x[element[1:]][:, 4:, 2], -0.52).all(axis=1)][:, 4:]
    return pressed(Scene(x, element, is_given, u, element[0, :4], upper, 2250.0, 0.3), is_conserving)


def off(u: np.ndarray, other: np.ndarray | None = None) -> np.ndarray:
    """At the places that are published: what differs there, or from another solution, over the largest displacement."""
    x = np.concatenate([block.x for block in blocks()])
    found = []
    for (place, axis), value in PUBLISHED.items():
        node = np.abs(x - np.array(place)).sum(axis=1).argmin()
        found.append(u[node, axis] - (value if other is None else other[node, axis]))
    return np.array(found)/PUSH


def test_forces_along_the_normal_are_those_published() -> None:
    """What is published is understood: the cube presses by a uniform pressure that closes the gap in the mean."""
    u = by_itself(is_conserving=False)
    assert np.abs(off(u)).max() <= 1.0e-9


def test_a_turned_hexahedron_on_a_block(tmp_path: Path) -> None:
    """With nothing but the gap in the mean: what is published, but for 2e-3 in the mean of the three. This is what forces
    that conserve energy make, as the solution with such forces tells: the rest is that faces here are made of triangles."""
    u = by_code(tmp_path, ", GUARD=NO, EDGES=NO")
    found, of_forces = off(u), off(u, by_itself(is_conserving=True))
    print("over the push: off what is published by", found, "off the same forces by", of_forces)
    assert np.sqrt((found**2).mean()) <= 2.0e-3
    assert np.abs(of_forces).max() <= 1.0e-4
