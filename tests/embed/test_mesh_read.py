"""Meshes from files: Abaqus input files as they are, Gmsh through meshio; good and bad ones."""

from __future__ import annotations

import builtins
import sys
from pathlib import Path

import numpy as np
import pytest

PACKAGE = Path(__file__).parents[2]/"pywrap"
sys.path.insert(0, str(PACKAGE))

from emcon.mesh import MeshError, MeshWarning, block, read  # noqa: E402

#: Two squares side by side, the right one cut in two triangles, one of them clockwise.
ABAQUS = """*HEADING
two squares
*NODE, NSET=ALL
 10, 0., 0.
 20, 1., 0., 0.
 30, 2., 0.
 11, 0., 1.D0
 21, 1., 1.
 31, 2., 1.
 99, 7., 7.
*ELEMENT, TYPE=CPS4R, ELSET=LEFT
 5, 10, 20,
 21, 11
*Element, type=CPE3, elset="right"
 7, 20, 30, 31
 8, 21, 31, 20
*ELEMENT, TYPE=T2D2, ELSET=FOOT
 70, 10, 20
 71, 30, 20
*NSET, NSET=EVEN, GENERATE
 10, 30, 10
*NSET, NSET=MORE
 EVEN, 21
*NSET, NSET=OF_RIGHT, ELSET=RIGHT
*ELSET, ELSET=BOTH
 LEFT, 7, 8
*SURFACE, NAME=TOP
 LEFT, S3
 8, S1
*SURFACE, NAME=RIM, TYPE=ELEMENT
 BOTH
*MATERIAL, NAME=SOFT
*STEP
*STATIC
*CLOAD
 21, 1, <f>
*END STEP
"""

GMSH_22 = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
3
1 1 "left side"
2 3 "Body-A"
1 4 "Middle"
$EndPhysicalNames
$Nodes
7
1 0 0 0.5
2 1 0 0.5
3 2 0 0.5
4 0 1 0.5
5 1 1 0.5
6 2 1 0.5
7 9 9 9
$EndNodes
$Elements
7
1 15 2 6 1 4
2 1 2 1 1 4 1
3 1 2 4 2 2 5
4 1 2 9 3 3 6
5 3 2 3 1 1 2 5 4
6 2 2 3 1 2 3 6
7 2 2 3 1 2 5 6
$EndElements
"""

GMSH_41 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
3
1 1 "foot"
2 2 "one"
2 3 "all"
$EndPhysicalNames
$Entities
0 1 2 0
1 0 0 0 2 0 0 1 1 0
1 0 0 0 1 1 0 2 2 3 1 1
2 1 0 0 2 1 0 1 3 1 1
$EndEntities
$Nodes
1 6 1 6
2 1 0 6
1
2
3
4
5
6
0 0 0
1 0 0
2 0 0
0 1 0
1 1 0
2 1 0
$EndNodes
$Elements
3 4 1 4
1 1 1 2
1 1 2
2 2 3
2 1 3 1
3 1 2 5 4
2 2 3 1
4 2 3 6 5
$EndElements
"""


def write(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def area_rows(mesh, name: str) -> list[list[float]]:
    """Positions of the nodes of a surface, in order."""
    return sorted(mesh.nodes[mesh.rows(mesh.surface_nodes(name))].tolist())


# --- Abaqus ------------------------------------------------------------------------------------

@pytest.fixture
def squares(tmp_path: Path):
    with pytest.warns(MeshWarning) as told:
        mesh = read(write(tmp_path/"squares.inp", ABAQUS))
    texts = " ".join(str(w.message) for w in told)
    assert "1 elements are numbered clockwise, among them 8; turned" in texts
    assert "1 nodes belong to no element" in texts and len(told) == 2
    return mesh


def test_abaqus_keeps_labels_and_sets(squares) -> None:
    assert squares.node_labels.tolist() == [10, 20, 30, 11, 21, 31]
    assert squares.nodes.tolist() == [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]]
    assert squares.elements["CPE4"].tolist() == [[10, 20, 21, 11]]
    assert squares.elements["CPE3"].tolist() == [[20, 30, 31], [21, 20, 31]]
    assert squares.element_labels["CPE3"].tolist() == [7, 8]
    assert {n: s.tolist() for n, s in squares.element_sets.items()} == {
        "LEFT": [5], "RIGHT": [7, 8], "BOTH": [5, 7, 8]}
    assert {n: s.tolist() for n, s in squares.node_sets.items()} == {
        "ALL": [10, 20, 30, 11, 21, 31], "EVEN": [10, 20, 30], "MORE": [10, 20, 30, 21],
        "OF_RIGHT": [20, 21, 30, 31], "FOOT": [10, 20, 30]}


def test_abaqus_surfaces_follow_turned_elements_and_lines(squares) -> None:
    assert area_rows(squares, "TOP") == [[0, 1], [1, 1], [2, 1]]
    assert squares.surfaces["TOP"].tolist() == [[5, 3], [8, 3]]
    assert area_rows(squares, "FOOT") == [[0, 0], [1, 0], [2, 0]]
    assert squares.surfaces["FOOT"].tolist() == [[5, 1], [7, 1]]
    assert sorted(squares.surfaces["RIM"].tolist()) == sorted(squares.boundary().tolist())


def test_abaqus_needs_no_meshio(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hide_meshio(monkeypatch)
    mesh = block(cells=(3, 2))
    assert np.array_equal(read(mesh.write(tmp_path/"a.inp")).nodes, mesh.nodes)


@pytest.mark.parametrize(("old", "new", "message"), [
    ("TYPE=CPS4R", "TYPE=C3D6", r"a\.inp:11: EMCON has no elements of the kind C3D6"),
    ("TYPE=CPS4R", "TYPE=CPE8R", "the last element has too few nodes"),
    ("TYPE=T2D2", "TYPE=B23", "no elements of the kind B23"),
    ("TYPE=CPS4R", "TYPE=SPRING1", "no elements of the kind SPRING1"),
    ("TYPE=CPS4R,", "", r"of the kind \(none\)"),
    (" 20, 1., 0., 0.", " 20, 1., 0., 0.5", "three-dimensional: z goes from 0 to 0.5"),
    (" 20, 1., 0., 0.", " 20, 1., zero", r"a\.inp:5: a coordinate is not a number"),
    (" 20, 1., 0., 0.", " 20, 1., nan", "coordinate is not finite"),
    (" 20, 1., 0., 0.", " 10, 1., 0., 0.", "a.inp:5: node 10 is there twice"),
    (" 7, 20, 30, 31", " 5, 20, 30, 31", "element 5 is there twice"),
    (" 7, 20, 30, 31", " 7, 20, 30, 32", "names node 32, which is not there"),
    (" 7, 20, 30, 31", " 7, 20, 30, 31, 21", "has 4 nodes where 3 are due"),
    (" 7, 20, 30, 31", " 7, 20, 30, <n>", "label is not a whole number"),
    (" 7, 20, 30, 31", " 7, 20, 30, 10", "has no area"),
    (" 8, 21, 31, 20", " 8, 21, 31", "too few nodes"),
    (" LEFT, 7, 8", " LEFT, 7, 9", "BOTH names 9, which is not there"),
    (" LEFT, 7, 8", " WRONG, 7", "no set WRONG"),
    (" LEFT, S3", " LEFT, SPOS", "SPOS is not a face"),
    (" LEFT, S3", " LEFT, S3\n RIGHT, S4", "has no face"),
    ("*HEADING\ntwo squares", "*PART, NAME=P", "without parts and assemblies"),
    ("*HEADING\ntwo squares", "*INCLUDE, INPUT=none.inp", "none.inp, named by"),
    ("*HEADING\ntwo squares", "*INCLUDE, INPUT=a.inp", "nested deeper than 20"),
])
@pytest.mark.filterwarnings("ignore::emcon.mesh.MeshWarning")
def test_bad_abaqus_files(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in ABAQUS
    with pytest.raises(MeshError, match=message):
        read(write(tmp_path/"a.inp", ABAQUS.replace(old, new, 1)))


def test_files_without_a_mesh(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match="no elements in the plane or in space"):
        read(write(tmp_path/"a.inp", ""))
    with pytest.raises(FileNotFoundError):
        read(tmp_path/"none.inp")
    with pytest.raises(FileNotFoundError):
        read(tmp_path/"none.msh")


# --- Gmsh --------------------------------------------------------------------------------------

def hide_meshio(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(name: str, *rest: object, **more: object) -> object:
        if name.partition(".")[0] == "meshio":
            raise ImportError("No module named 'meshio'")
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)


def test_without_meshio_the_error_says_what_to_install(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hide_meshio(monkeypatch)
    with pytest.raises(ImportError, match="needs the package meshio: pip install meshio"):
        read(write(tmp_path/"a.msh", GMSH_22))


def test_gmsh_groups_become_sets_and_surfaces(tmp_path: Path) -> None:
    pytest.importorskip("meshio")
    with pytest.warns(MeshWarning) as told:
        mesh = read(write(tmp_path/"a.msh", GMSH_22))
    texts = " ".join(str(w.message) for w in told)
    for text in ("1 nodes belong to no element", "1 elements are numbered clockwise",
                 "a line of Middle lies between two elements"):
        assert text in texts
    assert mesh.nodes.tolist() == [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]]
    assert mesh.elements["CPE4"].tolist() == [[1, 2, 5, 4]]
    assert mesh.elements["CPE3"].tolist() == [[2, 3, 6], [2, 6, 5]]
    assert mesh.element_sets["BODY-A"].tolist() == [1, 2, 3]
    assert area_rows(mesh, "LEFT_SIDE") == [[0, 0], [0, 1]]
    assert area_rows(mesh, "CURVE_9") == [[2, 0], [2, 1]]          # a group without a name
    assert set(mesh.surfaces) == {"LEFT_SIDE", "CURVE_9"}
    assert mesh.node_sets["MIDDLE"].tolist() == [2, 5]
    assert mesh.node_sets["POINT_6"].tolist() == [4]


def test_gmsh_element_may_be_in_two_groups(tmp_path: Path) -> None:
    pytest.importorskip("meshio")
    mesh = read(write(tmp_path/"a.msh", GMSH_41))
    assert {n: s.tolist() for n, s in mesh.element_sets.items()} == {"ONE": [1], "ALL": [1, 2]}
    assert area_rows(mesh, "FOOT") == [[0, 0], [1, 0], [2, 0]]
    assert len(mesh.node_sets["ALL"]) == 6 and mesh.node_sets["ONE"].tolist() == [1, 2, 4, 5]


@pytest.mark.parametrize(("old", "new", "message"), [
    ("3 2 0 0.5", "3 2 0 0.6", "three-dimensional: z goes from 0.5 to 0.6"),
    ("3 2 0 0.5", "3 nan 0 0.5", "not finite"),
    ("7 2 2 3 1 2 5 6", "7 4 2 3 1 2 5 6 3", "of C3D4 has no volume"),
    ("7 2 2 3 1 2 5 6", "7 21 2 3 1 2 5 6 1 3 4 2 5 6 1", "no elements of the kind triangle10"),
    ("2 1 2 1 1 4 1", "2 26 2 1 1 4 1 2 5", "no elements of the kind line4"),
    ("7 2 2 3 1 2 5 6", "7 2 2 3 1 2 3 3", "no area"),
    ('1 4 "Middle"', '1 4 "left_side"', "two groups would have the name LEFT_SIDE"),
    ("$MeshFormat\n2.2", "$MeshFormat\n9.9", "meshio cannot read it"),
])
@pytest.mark.filterwarnings("ignore::emcon.mesh.MeshWarning")
def test_bad_gmsh_files(tmp_path: Path, old: str, new: str, message: str) -> None:
    pytest.importorskip("meshio")
    assert old in GMSH_22
    text = GMSH_22.replace(old, new, 1)
    if "left_side" in new:
        text = text.replace("3 1 2 4 2 2 5", "3 1 2 4 2 3 6")
    with pytest.raises(MeshError, match=message):
        read(write(tmp_path/"a.msh", text))


@pytest.mark.filterwarnings("ignore::emcon.mesh.MeshWarning")
def test_gmsh_file_that_was_cut_off(tmp_path: Path) -> None:
    """Wherever it ends: also within a number, which leaves another number."""
    pytest.importorskip("meshio")
    for text in (GMSH_22, GMSH_41):
        whole = text.rindex("$EndElements") + len("$End")
        for length in range(whole):
            with pytest.raises(MeshError, match=r"a\.msh"):
                read(write(tmp_path/"a.msh", text[:length]))
        read(write(tmp_path/"a.msh", text[:whole]))


def test_other_formats(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    meshio.Mesh(points, [("triangle", [[0, 1, 2], [0, 2, 3]])]).write(tmp_path/"a.vtk")
    mesh = read(tmp_path/"a.vtk")
    assert mesh.nodes.tolist() == points
    assert mesh.elements["CPE3"].tolist() == [[1, 2, 3], [1, 3, 4]]
    with pytest.raises(MeshError, match="cannot read it"):
        read(write(tmp_path/"a.unknown", GMSH_22))


@pytest.mark.parametrize(("begins", "why"), [
    ("$NOD\n1\n1 0 0 0\n$ENDNOD\n$ELM\n0\n$ENDELM\n", "format 1 .*Mesh.MshFileVersion"),
    ("$MeshFormat\n4 0 8\n$EndMeshFormat\n", r"format 4\.0 .*Mesh.MshFileVersion"),
    ("hello\n", "does not begin with"), ("", "does not begin with"),
    ("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 9 1", "cut off")])
def test_what_is_no_mesh_of_gmsh_is_said(tmp_path: Path, begins: str, why: str) -> None:
    path = tmp_path/"some.msh"
    path.write_text(begins)
    with pytest.raises(MeshError, match=why):
        read(path)
