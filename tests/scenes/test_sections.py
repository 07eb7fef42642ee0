"""*SECTION PRINT: force and moment on a cut through a body, on any mesh, as the loads say."""

import h5py
import numpy as np
import pytest
from element_meshes import Mesh
from scene_tools import emcon, run_deck
from space_mesh import CUBE_FACES, KINDS, TETRAHEDRA, TETRAHEDRON_FACES, Block

RUBBER = "*HYPERELASTIC, NEO HOOKE\n20., 0.01\n"
ELASTIC = "*ELASTIC\n100., 0.3\n"
WORDS = "SOF, SOM, SOMC, SOCENTER, SOAREA\n"


def run(text, folder):
    (folder/"deck.inp").write_text(text)
    return run_deck(folder/"deck.inp", folder)


def section(done, name):
    """{word: last values} of a section."""
    with h5py.File(done.file(".h5")) as file:
        group = file["sets"][name]
        return {word: group[word][-1].ravel() for word in WORDS.strip().split(", ")}


def faces_at(x, elements, faces, value):
    """Faces whose corners lie at x = `value`, of the elements before it."""
    for e, nodes in enumerate(elements, 1):
        at = x[np.array(nodes) - 1]
        for f, corners in enumerate(faces, 1):
            if np.allclose(at[list(corners), 0], value) and at[:, 0].mean() < value:
                yield e, f


def moment(place, force):
    if force.shape[1] == 2:
        return np.array([(place[:, 0]*force[:, 1] - place[:, 1]*force[:, 0]).sum()])
    return np.cross(place, force).sum(axis=0)


def pulled(mesh, elements, faces, ends, law, nlgeom, folder, tol=1e-8):
    """A body held at x = 0 and pulled at its end by forces of all sizes: what a cut in its middle
    says, and what it has to."""
    n_dim = mesh.x.shape[1]
    left, right = ends
    force = np.random.default_rng(7).uniform(-1, 1, (len(right), n_dim))
    loads = "".join(f"{k}, {a + 1}, {float(f[a])!r}\n" for k, f in zip(right, force, strict=True)
                    for a in range(n_dim))
    held = "".join(f"{k}, 1, {n_dim}\n" for k in left)
    cut = "".join(f"{e}, S{f}\n" for e, f in faces_at(mesh.x, elements, faces, 1.0))
    done = run(mesh.deck(law, f"*SURFACE, NAME=CUT\n{cut}*BOUNDARY\n{held}*STEP{nlgeom}, INC=100\n"
                         f"*STATIC\n0.5, 1.\n*CLOAD\n{loads}*SECTION PRINT, SURFACE=CUT, NAME=MIDDLE\n"
                         f"{WORDS}*NODE FILE\nU\n*END STEP\n"), folder)
    u = done.fields()["displacement"][-1][:, :n_dim]*bool(nlgeom)
    place = (mesh.x + u)[np.array(right) - 1]
    found = section(done, "MIDDLE")
    size = np.abs(force).sum()
    assert np.abs(found["SOF"] - force.sum(axis=0)).max() <= tol*size
    assert np.abs(found["SOM"] - moment(place, force)).max() <= tol*size
    centred = moment(place - found["SOCENTER"], force)
    assert np.abs(found["SOMC"] - centred).max() <= tol*size
    if not nlgeom:
        assert np.abs(found["SOCENTER"] - [1.0, *[0.5]*(n_dim - 1)]).max() <= 1e-12
        assert abs(found["SOAREA"][0] - 1) <= 1e-12
    return found


@pytest.mark.each_value
@pytest.mark.parametrize("nlgeom", ["", ", NLGEOM"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_cut_in_space(kind, nlgeom, tmp_path):
    mesh = Block(kind, (3, 2, 2), (3, 1, 1))
    faces = TETRAHEDRON_FACES if mesh.kind in TETRAHEDRA else CUBE_FACES
    pulled(mesh, mesh.element, faces, (mesh.on(0, 0), mesh.on(0, 1)),
           RUBBER if nlgeom else ELASTIC, nlgeom, tmp_path)


@pytest.mark.parametrize("nlgeom", ["", ", NLGEOM"])
@pytest.mark.parametrize("kind", ["CPE3", "CPE4", "CPE4H", "CPE4I", "CPE6", "CPE8", "CPE8R", "CPS3",
                                  "CPS4", "CPS4I", "CPS8"])
def test_a_cut_in_the_plane(kind, nlgeom, tmp_path):
    mesh = Mesh(kind, 3, 2, [(0, 0), (3, 0), (3, 1), (0, 1)])
    n = 3 if "3" in kind or "6" in kind else 4
    pulled(mesh, list(mesh.elements()), [(i, (i + 1) % n) for i in range(n)],
           (mesh.side("left"), mesh.side("right")), RUBBER if nlgeom else ELASTIC, nlgeom, tmp_path)


@pytest.mark.parametrize("kinematics", ["LINEAR", "COROTATED"])
def test_a_cut_of_small_strains(kinematics, tmp_path):
    """Of corotated elements to first order in the strains, which are some percent here."""
    mesh = Mesh("CPE4", 3, 2, [(0, 0), (3, 0), (3, 1), (0, 1)])
    plain = mesh.deck
    mesh.deck = lambda law, after: plain(law, after).replace("MATERIAL=M\n*S", "MATERIAL=M, "
                                                             f"KINEMATICS={kinematics}\n*S")
    pulled(mesh, list(mesh.elements()), [(i, (i + 1) % 4) for i in range(4)],
           (mesh.side("left"), mesh.side("right")), ELASTIC,
           *((", NLGEOM", tmp_path, 1e-3) if kinematics == "COROTATED" else ("", tmp_path)))


@pytest.mark.parametrize("nlgeom", ["", ", NLGEOM"])
@pytest.mark.parametrize("kind", ["CAX3", "CAX4", "CAX8R"])
def test_a_cut_of_a_ring(kind, nlgeom, tmp_path):
    """A tube pulled along its axis: the force of the whole ring."""
    mesh = Mesh(kind, 2, 2, [(1, 0), (2, 0), (2, 2), (1, 2)])
    n = 3 if "3" in kind else 4
    held = "".join(f"{k}, 1, 2\n" for k in mesh.side("bottom"))
    loads = "".join(f"{k}, 2, {float(3*part)!r}\n" for k, part in mesh.shares("top").items())
    turned = mesh.x[:, ::-1]
    cut = "".join(f"{e}, S{f}\n" for e, f in faces_at(turned, list(mesh.elements()),
                                                      [(i, (i + 1) % n) for i in range(n)], 1.0))
    found = section(run(mesh.deck(RUBBER if nlgeom else ELASTIC, f"*SURFACE, NAME=CUT\n{cut}*BOUNDARY\n{held}"
                                  f"*STEP{nlgeom}\n*STATIC\n1., 1.\n*CLOAD\n{loads}"
                                  f"*SECTION PRINT, SURFACE=CUT\n{WORDS}*END STEP\n"), tmp_path), "CUT")
    assert np.abs(found["SOF"] - [0, 3]).max() <= 1e-8
    assert not found["SOM"].any() and not found["SOMC"].any() and found["SOCENTER"][0] == 0
    if not nlgeom:
        assert abs(found["SOAREA"][0] - 3*np.pi) <= 1e-12*10
        assert abs(found["SOCENTER"][1] - 1) <= 1e-12


def test_a_held_side_tells_its_reaction(tmp_path):
    """The section force of an outer side is what supports and contact do to it."""
    body = Mesh("CPE4", 3, 2, [(0, 0), (3, 0), (3, 1), (0, 1)])
    pressure = "".join(f"{e}, P3, 2.\n" for e in (4, 5, 6))
    held = "".join(f"{k}, 2\n" for k in body.side("bottom"))
    done = run(body.deck(ELASTIC, "*SURFACE, NAME=FOOT\n1, S1\n2, S1\n3, S1\n"
                         f"*BOUNDARY\n1, 1\n{held}*STEP\n*STATIC\n1., 1.\n*DLOAD\n{pressure}"
                         f"*SECTION PRINT, SURFACE=FOOT\n{WORDS}*END STEP\n"), tmp_path)
    found = section(done, "FOOT")
    assert np.abs(found["SOF"] - [0, 6]).max() <= 1e-10
    assert np.abs(found["SOM"] - 9).max() <= 1e-10 and np.abs(found["SOMC"]).max() <= 1e-10


def test_sections_of_rigid_bodies_are_refused(tmp_path):
    body = Mesh("CPE4", 1, 1, [(0, 0), (1, 0), (1, 1), (0, 1)])
    again = "*STEP\n*DYNAMIC, DIRECT\n0.1, 0.1\n*END STEP\n"
    deck = tmp_path/"deck.inp"
    deck.write_text(body.deck(ELASTIC, "*SURFACE, NAME=FOOT\n1, S1\n*RIGID BODY, ELSET=ALL, REF NODE=1\n"
                              + again.replace("*END", f"*SECTION PRINT, SURFACE=FOOT\n{WORDS}*END") + again))
    told = emcon("check", deck).stderr
    assert told.count("surface FOOT has elements of rigid body ALL, which have no stress") == 1, told
