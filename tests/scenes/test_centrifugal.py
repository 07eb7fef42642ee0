"""Centrifugal forces: what holds a body that turns, in the plane and in three dimensions."""

import numpy as np
import pytest
from element_meshes import Mesh
from scene_tools import emcon, run_deck

BLOCK = """\
*NODE, NSET=NALL
1, 1., 0., 0.
2, 3., 0., 0.
3, 3., 1., 0.
4, 1., 1., 0.
5, 1., 0., 2.
6, 3., 0., 2.
7, 3., 1., 2.
8, 1., 1., 2.
*ELEMENT, TYPE=C3D8, ELSET=ALL
1, 1, 2, 3, 4, 5, 6, 7, 8
*MATERIAL, NAME=M
*ELASTIC
100., 0.3
*DENSITY
0.5
*SOLID SECTION, ELSET=ALL, MATERIAL=M
"""
AFTER = ("*BOUNDARY\nNALL, 1, 3\n*STEP{}\n*STATIC\n1., 1.\n*DLOAD\n{}"
         "*NODE PRINT, NSET=NALL, TOTALS=ONLY\nRF\n*END STEP\n")


def held_by(text, folder):
    (folder/"deck.inp").write_text(text)
    _, force = run_deck(folder/"deck.inp", folder).series("NALL", "TOTAL_RF")
    return force[-1].ravel()


def test_an_axis_in_space(tmp_path):
    """Mass times omega**2 times the arm of the centre, and gravity beside it."""
    mass, square, point = 0.5*4, 3.0, np.array([0.5, -1.0, 2.0])
    axis = np.array([1.0, 2.0, 2.0])/3
    load = f"ALL, CENTRIF, {square}, 0.5, -1., 2., 2., 4., 4.\nALL, GRAV, 9.81, 0., 0., -1.\n"
    arm = np.array([2.0, 0.5, 1.0]) - point
    wanted = -mass*(square*(arm - axis*(axis @ arm)) - [0, 0, 9.81])
    assert held_by(BLOCK + AFTER.format("", load), tmp_path) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize("kind", ["CPE3", "CPE4", "CPS8R"])
def test_a_plane_model(kind, tmp_path):
    mesh = Mesh(kind, 2, 2, [(1, 0), (3, 0), (3, 1), (1, 1)])
    load = "ALL, CENTRIF, 3., 0.5, -1., 7., 0., 0., -2.\n"
    wanted = -0.5*2*3.0*np.array([1.5, 1.5])
    found = held_by(mesh.deck("*ELASTIC\n100., 0.3\n", AFTER.format("", load)), tmp_path)
    assert found == pytest.approx(wanted, rel=1e-12)


def test_a_later_gravity_does_not_stop_it(tmp_path):
    load = "ALL, CENTRIF, 3., 0., 0., 0., 0., 0., 1.\n"
    later = ("*STEP\n*STATIC\n1., 1.\n*DLOAD\nALL, GRAV, 9.81, 0., 0., -1.\n"
             "*NODE PRINT, NSET=NALL, TOTALS=ONLY\nRF\n*END STEP\n")
    found = held_by(BLOCK + AFTER.format("", load) + later, tmp_path)
    assert found == pytest.approx([-2*3*2, -2*3*0.5, 2*9.81], rel=1e-12)


@pytest.mark.parametrize("step, load, told", [
    (", NLGEOM", "ALL, CENTRIF, 3., 0., 0., 0., 0., 0., 1.\n",
     "23: error: *DLOAD: CENTRIF is known but not supported with NLGEOM"),
    ("", "ALL, CENTRIF, 3., 0., 0., 0.\n", "CENTRIF needs an axis"),
    ("", "ALL, CENTRIF, 3., 0., 0., 0., 0., 0., 1., 5.\n", "'5.' is too much")])
def test_what_is_refused(step, load, told, tmp_path):
    (tmp_path/"deck.inp").write_text(BLOCK + AFTER.format(step, load))
    done = emcon("check", tmp_path/"deck.inp")
    assert done.returncode == 2 and told in done.stderr


def test_a_plane_model_turns_in_its_plane(tmp_path):
    load = "ALL, CENTRIF, 3., 0., 0., 0., 0., 1., 0.\n"
    mesh = Mesh("CPE4", 1, 1, [(1, 0), (3, 0), (3, 1), (1, 1)])
    (tmp_path/"deck.inp").write_text(mesh.deck("*ELASTIC\n100., 0.3\n", AFTER.format("", load)))
    done = emcon("check", tmp_path/"deck.inp")
    assert done.returncode == 2 and "about an axis normal to it" in done.stderr
