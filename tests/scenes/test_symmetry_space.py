"""Mirror symmetry in space: a ball that falls on a plate stays its own mirror image, and a quarter of a ball that falls
on a wall moves as the whole."""

import numpy as np
from contact_space_scenes import ball, bodies, dynamic, faces, pair, velocities
from scene_tools import run_deck
from space_mesh import Block

WALL = """*NODE
9001, 0., 0., 0.
*SURFACE, NAME=S2, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*RIGID BODY, ANALYTICAL SURFACE=S2, REF NODE=9001
*BOUNDARY
9001, ENCASTRE
"""
MASSLESS = "*CONTACT INITIATION, TYPE=MASSLESS\n"


def above(x):
    return ball(x) + np.array([0.0, 0.0, 1.01])


def images(x, way):
    """The node at the mirror image of each."""
    return [int(np.argmin(((x - y)**2).sum(axis=1))) for y in x*way]


def test_ball_on_a_plate(tmp_path):
    """Its nodes meet corners and middles of the plate's faces: patches see folds, each as its mirror image does."""
    one = Block("C3D8", (4, 4, 4), size=(2, 2, 2), place=above)
    two = Block("C3D8", (6, 6, 1), size=(3, 3, 0.5), place=lambda x: x - np.array([1.5, 1.5, 0.5]))
    held = "".join(f"{len(one.x) + k}, 1, 3\n" for k in two.on(2, 0))
    deck = tmp_path/"ball.inp"
    deck.write_text(bodies([one, two], [faces(one), faces(two, 2, 1)]) + pair() + "*BOUNDARY\n" + held
                    + velocities(one, (0, 0, -1), (0, 0, 0)) + dynamic(0.02, 0.4, MASSLESS))
    run = run_deck(deck, tmp_path)
    assert run.history["pair1_force_z"].max() > 1
    moved = run.fields()["displacement"][:, :len(one.x)]
    for way in ([-1, 1, 1], [1, -1, 1]):
        assert np.abs(moved[:, images(one.x, way)]*way - moved).max() < 1e-11


def test_quarter_ball_on_a_wall(tmp_path):
    moved = []
    for cells, corner in ((4, 0), (2, 1)):
        one = Block("C3D8", (cells, cells, 4), size=(2 - corner, 2 - corner, 2),
                    place=lambda x, corner=corner: above(x + corner*np.array([1, 1, 0])))
        inner = {face for axis in (0, 1) for face in faces(one, axis, 0)} if corner else set()
        sides = [face for face in faces(one) if face not in inner]
        held = "".join(f"{k}, {axis + 1}\n" for axis in (0, 1) for k in one.on(axis, 0)) if corner else ""
        deck = tmp_path/f"ball{cells}.inp"
        deck.write_text(bodies([one], [sides]) + WALL + held + pair() + velocities(one, (0, 0, -1), (0, 0, 0))
                        + dynamic(0.02, 0.4, MASSLESS))
        moved.append((one.x, run_deck(deck, tmp_path/str(cells)).fields()["displacement"]))
    (whole, of_whole), (quarter, of_quarter) = moved
    same = [int(np.argmin(((whole - y)**2).sum(axis=1))) for y in quarter]
    assert np.abs(of_quarter[:, :, 2]).max() > 0.1
    assert np.abs(of_whole[:, same] - of_quarter[:, :len(quarter)]).max() < 1e-11
