"""Pressure on surfaces: what the same pressure on each of their faces does, and closed forms."""

import collections

import numpy as np
import pytest
from element_meshes import Mesh
from scene_tools import run_deck
from space_mesh import Block

YOUNG, POISSON, PRESSURE = 100.0, 0.3, 0.75
LAW = f"*ELASTIC\n{YOUNG}, {POISSON}\n"
RUBBER = "*HYPERELASTIC, NEO HOOKE\n20., 0.02\n"
OUTLINE = "*SURFACE, NAME=OUTLINE\nALL\n"
PLANE = ["CPE3", "CPE4", "CPE6", "CPE8R", "CPS4"]
AXIAL = ["CAX4", "CAX6"]
SPACE = ["C3D4", "C3D8", "C3D10", "C3D20R"]


def scene(kind):
    if kind in SPACE:
        return Block(kind, (2, 1, 2), (1.0, 0.5, 1.5))
    return Mesh(kind, 3, 2, [(1, 0), (4, -0.5), (4.5, 2), (1.5, 2.5)])


def outer_faces(mesh):
    """(element, face) of the faces that no other element has, by element and face."""
    if isinstance(mesh, Block):
        return list(mesh.outer_faces())
    n_corner = 3 if "3" in mesh.kind or "6" in mesh.kind else 4
    edges = [[frozenset((nodes[k], nodes[(k + 1) % n_corner])) for k in range(n_corner)]
             for nodes in mesh.elements()]
    times = collections.Counter(edge for own in edges for edge in own)
    return [(e, k) for e, own in enumerate(edges, 1) for k, edge in enumerate(own, 1)
            if times[edge] == 1]


def run(text, folder):
    folder.mkdir()
    (folder/"deck.inp").write_text(text)
    return run_deck(folder/"deck.inp", folder)


@pytest.mark.each_value
@pytest.mark.parametrize("card", ["DSLOAD", "DLOAD"])
@pytest.mark.parametrize("kind", [*PLANE, *AXIAL, *SPACE])
def test_as_on_each_face(kind, card, tmp_path):
    """To the last bit: a free body is squeezed, later than the amplitude says, and let go."""
    mesh = scene(kind)
    step = ("*AMPLITUDE, NAME=PUSH\n0., 0., 0.2, 1., 0.4, 0.\n*STEP, NLGEOM\n*DYNAMIC, DIRECT\n"
            "0.1, 0.8\n*{}, AMPLITUDE=PUSH, TIME DELAY=0.1\n{}*NODE FILE\nU\n*END STEP\n"
            "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n0.1, 0.2\n*{}, OP=NEW\n{}*END STEP\n")
    faces = "".join(f"{e}, P{k}, {{0}}\n" for e, k in outer_faces(mesh))
    on_faces = step.format("DLOAD", faces.format(PRESSURE), "DLOAD", faces.format(-0.5))
    on_surface = step.format(card, f"OUTLINE, P, {PRESSURE}\n", card, "OUTLINE, P, -0.5\n")
    one = run(mesh.deck(RUBBER, OUTLINE + on_surface), tmp_path/"surface")
    other = run(mesh.deck(RUBBER, on_faces), tmp_path/"faces")
    assert one.digits() == other.digits()
    for name in ("displacement", "velocity"):
        if name in one.fields().names():
            assert np.array_equal(one.fields()[name], other.fields()[name])
    assert np.abs(one.history["strain"]).max() > 1e-3*PRESSURE


def held_in_place(mesh):
    """Where the body is held, so that it can change its size alone; supports and equations."""
    if isinstance(mesh, Block):
        places = (0, 0, 0), (mesh.last[0], 0, 0), (0, mesh.last[1], 0)
        corner, along, up = (mesh.label[place] for place in places)
        return mesh.x[corner - 1], f"{corner}, 1, 3\n{along}, 2, 3\n{up}, 3\n", ""
    corner, along = mesh.label[0, 0], mesh.label[mesh.last[0], 0]
    origin = mesh.x[corner - 1]
    if mesh.kind in AXIAL:
        return np.array([0.0, origin[1]]), f"{corner}, 2\n", ""
    dx, dy = (mesh.x[along - 1] - origin).tolist()       # held across the line between both
    return origin, f"{corner}, 1, 2\n", f"*EQUATION\n2\n{along}, 2, {dx!r}, {along}, 1, {-dy!r}\n"


@pytest.mark.parametrize("kind", [*PLANE, *AXIAL, *SPACE])
def test_all_round(kind, tmp_path):
    """A body under the same pressure on all sides gets smaller, and keeps its shape."""
    mesh = scene(kind)
    origin, held, equation = held_in_place(mesh)
    step = (f"*BOUNDARY\n{held}*STEP\n*STATIC\n1., 1.\n*DSLOAD\nOUTLINE, P, {PRESSURE}\n"
            "*NODE FILE\nU\n*END STEP\n")
    done = run(mesh.deck(LAW, OUTLINE + equation + step), tmp_path/"run")
    strain = -PRESSURE/YOUNG*(1 - 2*POISSON)
    if kind.startswith("CPE"):
        strain *= 1 + POISSON
    elif kind.startswith("CPS"):
        strain = -PRESSURE/YOUNG*(1 - POISSON)
    expected = strain*(mesh.x - origin)
    u = done.fields()["displacement"][-1]
    # Roundings of a linear solve of some hundred unknowns, times its condition.
    assert np.abs(u - expected).max() <= 1e5*np.finfo(float).eps*np.abs(expected).max()
