"""Meshes: builders, transformations, joining, decks that the engine reads, and bad input."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT/"pywrap"))

from emcon.mesh import Mesh, MeshError, block, disc, grid, read, ring, strip  # noqa: E402
from emcon.model import Model  # noqa: E402
from emcon.stepper import InputError, Stepper  # noqa: E402

EPS = float(np.finfo(float).eps)
RING_CARDS = """
    *MATERIAL, NAME=SOFT
    *HYPERELASTIC, COUPLED NEO HOOKE
    100., 0.1
    *DENSITY
    0.01
    *SOLID SECTION, ELSET=RING, MATERIAL=SOFT
    1.
    *SOLID SECTION, ELSET=BLOCK, MATERIAL=SOFT
    1.
    *SURFACE INTERACTION, NAME=FRICTIONLESS
    *SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
    *CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=MORTAR
    RING_OUTER, BLOCK_TOP
    *BOUNDARY
    BLOCK_BOTTOM, 1, 2
    *INITIAL CONDITIONS, TYPE=VELOCITY
    RING, 2, -3.
    *STEP, NLGEOM
    *DYNAMIC, DIRECT
    <h>, 8.
    *END STEP
"""


def shapes(kind: str) -> list[Mesh]:
    return [
        block((1.0, -2.0), (3.0, 1.5), (4, 3), kind=kind),
        ring((1.0, 2.0), (8.0, 10.0), (16, 3), kind=kind),
        disc((1.0, 2.0), 3.0, (4, 3), turn=0.2, kind=kind),
        disc(cells=(1, 1), kind=kind),
        strip([(0.0, 0.0), (4.0, 0.0), (4.0, 6.0)], 0.5, (10, 2), kind=kind),
        sheared(0.7, kind),
        sheared(-0.7, kind),
        strip(lambda s: (math.cos(s), math.sin(s)), 0.1, (9, 2), kind=kind),
    ]


def sheared(slope: float, kind: str) -> Mesh:
    """A parallelogram of 3 x 2; its shorter diagonal is one or the other."""
    i, j = np.meshgrid(np.arange(4.0), np.arange(3.0), indexing="ij")
    return grid(np.stack([i + slope*j, j], axis=-1), kind=kind)


def area(mesh: Mesh) -> float:
    total = 0.0
    for kind in mesh.elements:
        x, y = np.moveaxis(mesh.nodes[mesh.connectivity(kind)], -1, 0)
        total += 0.5*float((x*np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1)*y).sum())
    return total


def face_rows(mesh: Mesh) -> list[tuple[int, ...]]:
    return sorted(tuple(row) for faces in mesh.surfaces.values() for row in faces.tolist())


# --- builders ----------------------------------------------------------------------------------

@pytest.mark.parametrize("kind", ["CPE3", "CPE4"])
def test_surfaces_are_the_boundary_and_node_sets_their_nodes(kind: str) -> None:
    for mesh in shapes(kind):
        assert set(mesh.elements) == {kind}
        assert face_rows(mesh) == sorted(map(tuple, mesh.boundary().tolist()))
        for name in mesh.surfaces:
            assert sorted(mesh.node_sets[name]) == mesh.surface_nodes(name).tolist(), name


@pytest.mark.parametrize("kind", ["CPE3", "CPE4"])
def test_sides_lie_where_their_names_say(kind: str) -> None:
    mesh = block((1.0, -2.0), (3.0, 1.5), (4, 3), kind=kind)
    for side, axis, value in (("LEFT", 0, 1.0), ("RIGHT", 0, 4.0), ("BOTTOM", 1, -2.0),
                              ("TOP", 1, -0.5)):
        rows = mesh.rows(mesh.surface_nodes(f"BLOCK_{side}"))
        assert len(rows) == (4 if axis == 0 else 5)
        assert (mesh.nodes[rows, axis] == value).all()
    mesh = ring((1.0, 2.0), (8.0, 10.0), (16, 3), kind=kind)
    for side, radius in (("OUTER", 10.0), ("INNER", 8.0)):
        rows = mesh.rows(mesh.surface_nodes(f"RING_{side}"))
        distance = np.hypot(*(mesh.nodes[rows] - [1.0, 2.0]).T)
        assert len(rows) == 16 and np.abs(distance - radius).max() <= 4*EPS*radius
    mesh = strip([(0.0, 0.0), (4.0, 0.0)], 0.5, (4, 2), kind=kind)
    assert (mesh.nodes[mesh.rows(mesh.node_sets["STRIP_LEFT"]), 1] == 0.25).all()
    assert (mesh.nodes[mesh.rows(mesh.node_sets["STRIP_END"]), 0] == 4.0).all()


def test_areas() -> None:
    """Of polygons, in closed form; sums of m terms round by at most m epsilon."""
    polygon = 0.5*16*math.sin(2*math.pi/16)
    for kind in ("CPE3", "CPE4"):
        one, two, three, _, bent, _, _, _ = shapes(kind)
        for mesh, exact in ((one, 4.5), (two, polygon*36.0), (three, polygon*9.0),
                            # the corner of the band: mitred, so lengths are those of the middle
                            (bent, 5.0)):
            assert area(mesh) == pytest.approx(exact, rel=200*EPS)


def test_strip_keeps_its_thickness() -> None:
    """Opposite faces of a bent strip are parallel to the middle at half the thickness."""
    mesh = strip([(0.0, 0.0), (4.0, 0.0), (4.0, 6.0)], 0.5, (10, 1))
    left = mesh.nodes[mesh.rows(mesh.node_sets["STRIP_LEFT"])]
    assert np.isclose(left[:, 1], 0.25, rtol=8*EPS).sum() == 5          # before the corner
    assert np.isclose(left[:, 0], 3.75, rtol=8*EPS).sum() == 7          # from the corner on
    assert [3.75, 0.25] in np.round(left, 12).tolist()


def test_ring_and_block_are_those_of_the_ring_deck() -> None:
    """Same labels, elements and surfaces; positions to the rounding of the largest, 35."""
    deck = read(ROOT/"input_decks/ring.inp")
    mesh = (ring((0.0, 10.1), (8.0, 10.0), (64, 4))
            + block((-25.0, -5.0), (60.0, 5.0), (60, 5)))
    assert np.array_equal(mesh.node_labels, deck.node_labels)
    assert np.array_equal(mesh.elements["CPE4"], deck.elements["CPE4"])
    assert np.abs(mesh.nodes - deck.nodes).max() <= 4*EPS*35.0
    for name in ("RING_OUTER", "BLOCK_TOP"):
        assert np.array_equal(mesh.surface_nodes(name), deck.surface_nodes(name))


def test_mirror_images_of_a_ring_have_the_same_digits() -> None:
    x = ring((0.0, 0.0), (1.0, 2.0), (24, 2)).nodes
    for image in (x*[-1.0, 1.0], x*[1.0, -1.0]):
        assert {tuple(p) for p in (image + 0.0).tolist()} == {tuple(p) for p in (x + 0.0).tolist()}


# --- changing ----------------------------------------------------------------------------------

def test_motions() -> None:
    mesh = block(cells=(2, 1), size=(2.0, 1.0))
    assert np.array_equal(mesh.move(0.5, -1.0).nodes, mesh.nodes + [0.5, -1.0])
    turned = mesh.rotate(math.pi/2, (2.0, 0.0))                # (x, y) -> (2 - y, x - 2)
    expected = np.column_stack([2.0 - mesh.nodes[:, 1], mesh.nodes[:, 0] - 2.0])
    assert np.abs(turned.nodes - expected).max() <= 4*EPS
    assert np.array_equal(mesh.scale((2.0, 3.0), (1.0, 1.0)).nodes,
                          [1.0, 1.0] + [2.0, 3.0]*(mesh.nodes - [1.0, 1.0]))
    assert np.array_equal(mesh.scale(2.0).nodes, 2.0*mesh.nodes)


@pytest.mark.parametrize("kind", ["CPE3", "CPE4"])
def test_mirror_keeps_sides_and_orientation(kind: str) -> None:
    for mesh in shapes(kind):
        image = mesh.mirror((1.0, 0.0), (0.0, 5.0))
        assert np.array_equal(image.nodes, mesh.nodes*[-1.0, 1.0] + [2.0, 0.0])
        assert area(image) == pytest.approx(area(mesh), rel=200*EPS)
        assert face_rows(image) == sorted(map(tuple, image.boundary().tolist()))
        for name in mesh.surfaces:
            assert np.array_equal(image.surface_nodes(name), mesh.surface_nodes(name))


def test_sum_has_disjoint_labels_and_all_sets() -> None:
    one, other = block(cells=(2, 2)), block((5.0, 0.0), cells=(1, 1), name="SMALL", kind="CPE3")
    both = one + other
    assert both.node_labels.tolist() == [*range(1, 14)]
    assert both.element_labels == {"CPE3": pytest.approx([5, 6]),
                                   "CPE4": pytest.approx([1, 2, 3, 4])}
    assert set(both.surfaces) == set(one.surfaces) | set(other.surfaces)
    assert both.node_sets["SMALL"].tolist() == [10, 11, 12, 13]
    top = both.nodes[both.rows(both.surface_nodes("SMALL_TOP"))]
    assert (top[:, 1] == 1.0).all() and (top[:, 0] >= 5.0).all()
    with pytest.raises(MeshError, match="both meshes have a node set BLOCK.*rename"):
        one + one
    twice = one + one.rename({name: f"B{name}" for name in (*one.node_sets,)})
    assert len(twice.surfaces) == 8


def test_labels_that_are_free_are_kept() -> None:
    one = Mesh([[0, 0], [1, 0], [0, 1]], {"CPE3": [[1, 2, 3]]})
    other = Mesh([[2, 0], [3, 0], [2, 1]], {"CPE3": [[70, 50, 60]]}, node_labels=[70, 50, 60],
                 element_labels={"CPE3": [9]})
    both = one + other
    assert both.node_labels.tolist() == [1, 2, 3, 70, 50, 60]
    assert both.element_labels["CPE3"].tolist() == [1, 9]
    assert both.rows([60, 70]).tolist() == [5, 3]


def test_sets_by_place() -> None:
    mesh = block(size=(4.0, 1.0), cells=(4, 1))
    mesh.add_node_set("ends", mesh.nodes_where(lambda x, y: (x == 0.0) | (x == 4.0)))
    assert mesh.nodes[mesh.rows(mesh.node_sets["ENDS"]), 0].tolist() == [0.0, 0.0, 4.0, 4.0]
    mesh.add_surface("half", mesh.boundary(lambda x, y: (y == 1.0) & (x <= 2.0)))
    assert mesh.surfaces["HALF"].tolist() == [[1, 3], [2, 3]]


# --- decks -------------------------------------------------------------------------------------

def test_deck_is_read_to_the_same_bits(tmp_path: Path) -> None:
    mesh = (ring((0.0, 10.1), (8.0, 10.0), (32, 2), kind="CPE3").rotate(0.1, (0.0, 10.1))
            + block((-25.0, -5.0), (60.0, 5.0), (30, 2)))
    model = Model.from_mesh(mesh, "A ring falls\non a block", parameters={"h": 0.05, "n": "2**6"})
    path = model.cards(RING_CARDS).write(tmp_path/"ring.inp")
    text = path.read_text()
    assert text.splitlines()[:6] == ["*HEADING", "A ring falls", "on a block", "*PARAMETER",
                                     "h = 0.05", "n = 2**6"]
    with Stepper(path) as stepper:
        assert np.array_equal(stepper.labels, mesh.node_labels)
        assert np.array_equal(stepper.positions, mesh.nodes)
        assert (stepper.n_element, stepper.n_body, stepper.n_pair) == (128 + 60, 2, 1)
        mass = 0.01*area(ring(radii=(8.0, 10.0), cells=(32, 2)))
        assert stepper.energies()["kinetic"] == pytest.approx(4.5*mass, rel=1e4*EPS)
        assert stepper.step().h == 0.05
    with Stepper(path, h=0.02) as stepper:
        assert stepper.step().h == 0.02
    again = read(path)
    assert np.array_equal(again.nodes, mesh.nodes) and again.surfaces.keys() == mesh.surfaces.keys()
    for name, faces in mesh.surfaces.items():
        assert np.array_equal(again.surfaces[name], faces)
    for name, labels in mesh.node_sets.items():
        assert np.array_equal(again.node_sets[name], labels), name


def test_every_shape_is_taken_by_the_engine() -> None:
    """The engine judges elements, surfaces and contact chains by itself."""
    for kind in ("CPE3", "CPE4"):
        for mesh in shapes(kind):
            name = next(iter(mesh.element_sets))
            model = Model.from_mesh(mesh).cards(f"""
                *MATERIAL, NAME=M
                *ELASTIC
                1., 0.3
                *DENSITY
                1.
                *SOLID SECTION, ELSET={name}, MATERIAL=M
                1.
                *STEP
                *DYNAMIC, DIRECT
                0.1, 0.1
                *END STEP
            """)
            with model.stepper() as stepper:
                assert stepper.n_body == 1 and stepper.n_node == len(mesh.nodes)


def test_mesh_file_is_for_include(tmp_path: Path) -> None:
    mesh = block(cells=(2, 1))
    mesh.write(tmp_path/"mesh.inp")
    (tmp_path/"deck.inp").write_text("*INCLUDE, INPUT=mesh.inp\n*NSET, NSET=MORE\nBLOCK\n")
    assert read(tmp_path/"deck.inp").node_sets["MORE"].tolist() == [1, 2, 3, 4, 5, 6]
    with pytest.raises(InputError):
        Stepper(tmp_path/"deck.inp")            # no material: the engine says so


# --- bad input ---------------------------------------------------------------------------------

SQUARE = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]


@pytest.mark.parametrize(("nodes", "elements", "message"), [
    ([[0, 0, 0]], {"CPE3": [[1, 2, 3]]}, "nodes with 2 coordinates, not 3"),
    ([[0, 0, 0, 0]], {"CPE3": [[1, 2, 3]]}, r"\(n, 2\) or \(n, 3\) array"),
    ([[0, 0], [1, math.nan], [1, 1]], {"CPE3": [[1, 2, 3]]}, r"nodes\[1\] is not finite"),
    (SQUARE, {}, "no elements"),
    (SQUARE, {"CPE9": [[1, 2, 3, 4]]}, "no kind of element; known are CPE3, CPE4"),
    (SQUARE, {"CPE4": [[1, 2, 3]]}, r"shape \(k, 4\) is wanted, not \(1, 3\)"),
    (SQUARE, {"CPE4": [[1.0, 2.0, 3.0, 4.0]]}, "whole numbers, not float64"),
    (SQUARE, {"CPE4": [[0, 1, 2, 3]]}, "labels are from 1"),
    (SQUARE, {"CPE4": [[1, 2, 3, 5]]}, "no node 5"),
    (SQUARE, {"CPE4": [[4, 3, 2, 1]]}, "element 1 of CPE4 is numbered clockwise"),
    (SQUARE, {"CPE4": [[1, 2, 4, 3]]}, "element 1 of CPE4 has no area"),
    ([*SQUARE, [0.4, 0.2]], {"CPE4": [[1, 2, 3, 5]], "CPE3": [[1, 5, 4]]}, "folded"),
    (SQUARE, {"CPE3": [[1, 2, 3]]}, "node 4 belongs to no element"),
    (SQUARE, {"CPE3": [[1, 2, 3], [3, 4, 1], [1, 3, 2], [1, 4, 2]]}, "clockwise .and 1 others"),
])
def test_meshes_that_cannot_be(nodes: list, elements: dict, message: str) -> None:
    with pytest.raises(MeshError, match=message):
        Mesh(nodes, elements)


def test_faults_are_those_of_the_engine_at_any_size() -> None:
    """Shape does not depend on the unit: powers of two as large as numbers can be."""
    bent = [[0.0, 0.0], [1.0, 0.0], [0.4, 0.4], [0.0, 1.0]]
    for factor in (2.0**-500, 1.0, 2.0**500):
        Mesh(factor*np.array(SQUARE), {"CPE4": [[1, 2, 3, 4]]})
        with pytest.raises(MeshError, match="folded"):
            Mesh(factor*np.array(bent), {"CPE4": [[1, 2, 3, 4]]})


def test_sets_and_labels_that_cannot_be() -> None:
    mesh = block(cells=(2, 1))
    for call, message in (
            (lambda: mesh.add_node_set("A", [7]), "no node 7"),
            (lambda: mesh.add_element_set("A", [3]), "no element 3"),
            (lambda: mesh.add_surface("A", [[1, 5]]), "element 1 has no face 5"),
            (lambda: mesh.add_surface("A", [1, 2]), r"shape \(k, 2\)"),
            (lambda: mesh.add_node_set("A", mesh.nodes_where(lambda x, y: x > 9)), "no members"),
            (lambda: mesh.add_node_set("a,b", [1]), "cannot be the name"),
            (lambda: mesh.add_node_set("12", [1]), "cannot be the name"),
            (lambda: mesh.rename({"NOWHERE": "B"}), "no set or surface NOWHERE"),
            (lambda: Mesh(mesh.nodes, mesh.elements, node_labels=[1, 2, 3, 4, 5, 5]), "twice"),
            (lambda: mesh.scale(-1.0), "mirror"),
            (lambda: mesh.mirror((0, 0), (0, 0)), "direction"),
            (lambda: mesh.rotate(1.0, (0, math.nan)), "centre")):
        with pytest.raises(MeshError, match=message):
            call()
    with pytest.raises(ValueError, match="read-only"):
        mesh.nodes[0, 0] = 1.0


def test_shapes_that_cannot_be() -> None:
    for call, message in (
            (lambda: block(size=(0.0, 1.0)), "size"), (lambda: block(cells=(0, 1)), "cells"),
            (lambda: block(cells=(1.5, 1)), "cells"), (lambda: block(kind="CPE5"), "CPE5"),
            (lambda: ring(radii=(2.0, 1.0)), "radii that grow"),
            (lambda: ring(cells=(2, 1)), "at least 3"), (lambda: disc(radius=-1.0), "radius"),
            (lambda: strip([(0, 0), (1, 0)], 0.0), "thickness"),
            (lambda: strip([(0, 0)], 0.1), "at least 2 points"),
            (lambda: strip([(0, 0), (0, 0)], 0.1), "no length"),
            (lambda: strip([(0, 0), (1, 0), (0, 0)], 0.1, (4, 1)), "turns back"),
            (lambda: strip([(0, 0), (1, 0), (1, 1)], 3.0, (4, 1)), "element"),
            (lambda: strip([(0, 0), (1, 0), (1, 1)], 3.0, (4, 1), kind="CPE3"), "element"),
            (lambda: grid(np.zeros((3, 2))), "2 x 2 points"),
            (lambda: grid(block().nodes.reshape(2, 2, 2), sides={"TOP": "TOP"}), "not TOP")):
        with pytest.raises(MeshError, match=message):
            call()
