"""What Python gives to a model: laws, potentials, solids of a host; functions that misbehave."""

from __future__ import annotations

import gc
import os
import resource
import signal
import sys
import threading
import time
import weakref
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]/"pywrap"))

from emcon import check_derivatives  # noqa: E402
from emcon.csr import Csr  # noqa: E402
from emcon.given import Outside  # noqa: E402
from emcon.mesh import block  # noqa: E402
from emcon.model import Model  # noqa: E402
from emcon.stepper import AnalysisError, InputError, Stepper  # noqa: E402

EPS = float(np.finfo(float).eps)
# Sums over some 300 points and a few dozen steps.
TOL = 256*EPS
YOUNG, NU = 50.0, 0.3
LAME = YOUNG*NU/((1 + NU)*(1 - 2*NU))
MU = YOUNG/(2*(1 + NU))
STIFFNESS = np.array([[LAME + 2*MU, LAME, 0], [LAME, LAME + 2*MU, 0], [0, 0, MU]])
Law = Callable[[np.ndarray], Any]


# ---- laws ----------------------------------------------------------------------------------------

def quadratic(strain: np.ndarray, stiffness: np.ndarray = STIFFNESS) -> Any:
    """St. Venant and Kirchhoff's, or any other with a constant tangent."""
    stress = strain @ stiffness
    return (0.5*(stress*strain).sum(axis=1), stress,
            np.broadcast_to(stiffness, (len(strain), 3, 3)))


def neo_hooke(strain: np.ndarray) -> Any:
    """mu/2 (tr C - 3) - mu ln J + lambda/2 ln^2 J."""
    e1, e2, shear = strain.T
    growth = 2*(e1 + e2) + 4*e1*e2 - shear**2
    det = 1 + growth
    if not (det > 0).all():
        raise Outside
    ln = 0.5*np.log1p(growth)
    d = np.stack((2*(1 + 2*e2), 2*(1 + 2*e1), -2*shear), axis=1)        # of det
    dln = d/(2*det[:, None])
    ddet = np.array([[0, 4, 0], [4, 0, 0], [0, 0, -2.0]])
    ddln = ddet/(2*det[:, None, None]) - 2*dln[:, :, None]*dln[:, None, :]
    return (MU*(e1 + e2) - MU*ln + 0.5*LAME*ln**2,
            MU*np.array([1, 1, 0]) + (LAME*ln - MU)[:, None]*dln,
            (LAME*ln - MU)[:, None, None]*ddln + LAME*dln[:, :, None]*dln[:, None, :])


def tension_only(strain: np.ndarray) -> Any:
    """Fibres in direction 1 that bear no pressure, in a soft matrix."""
    pull = np.maximum(strain[:, 0], 0.0)
    energy, stress, tangent = quadratic(strain)
    stress = stress + np.stack((100*pull, 0*pull, 0*pull), axis=1)
    tangent = tangent.copy()
    tangent[:, 0, 0] += 100*(strain[:, 0] > 0)
    return energy + 50*pull**2, stress, tangent


ANISOTROPIC = np.array([[90.0, 20, 7], [20, 40, -3], [7, -3, 15]])


def anisotropic(strain: np.ndarray) -> Any:
    return quadratic(strain, ANISOTROPIC)


# ---- scenes --------------------------------------------------------------------------------------

def impact(law: Law | None = None, formulation: str = "MORTAR", h: float = 0.01,
           duration: float = 0.4, h_min: float | None = None, newton: str = "KEPT",
           **material: Any) -> Model:
    """A block is thrown at another one."""
    mesh = (block((-1.1, 0.02), (2.0, 1.0), (4, 3), name="TOP")
            + block((-2.0, -1.0), (4.0, 1.0), (7, 2), name="LOW"))
    model = Model.from_mesh(mesh)
    model.material("RUBBER", density=1.0, law=law, **material)
    model.section("RUBBER", "TOP").section("RUBBER", "LOW")
    model.interaction("HARD")
    model.contact_pair("TOP_BOTTOM", "LOW_TOP", interaction="HARD", type=formulation)
    model.initial("VELOCITY", "TOP", (1, 2), (0.3, -1.0))
    model.step("DYNAMIC", h, duration, h_min, direct=h_min is None, nlgeom=True).newton(newton)
    return model


def flying(law: Law | None = None, h: float = 0.02, newton: str = "KEPT",
           **material: Any) -> Model:
    """A block that flies, turns and shakes; no contact."""
    model = Model.from_mesh(block((0.0, 0.0), (2.0, 1.0), (3, 2)))
    model.material("RUBBER", density=1.0, law=law, **material).section("RUBBER", "BLOCK")
    model.initial("VELOCITY", "BLOCK_RIGHT", (1, 2), (1.0, 0.8))
    model.step("DYNAMIC", h, 0.4, direct=True, nlgeom=True).newton(newton)
    return model


def pulled(law: Law | None = None, nlgeom: bool = True, **material: Any) -> Model:
    """A block, held on the left, pulled down on the right: statics."""
    model = Model.from_mesh(block((0.0, 0.0), (2.0, 1.0), (4, 2)))
    model.material("RUBBER", law=law, **material).section("RUBBER", "BLOCK")
    model.boundary("BLOCK_LEFT", (1, 2))
    step = model.step("STATIC", 0.5, nlgeom=nlgeom)
    step.load("BLOCK_RIGHT", 2, -0.3)
    return model


def run(model: Model) -> tuple[np.ndarray, float, int]:
    """Displacements at the end, the largest relative change of energy, most active contacts."""
    with Stepper(model) as stepper:
        before, drift, n = stepper.energies()["total"], 0.0, 0
        while not stepper.is_done:
            n = max(n, stepper.step().active)
            drift = max(drift, abs(stepper.energies()["total"] - before))
        return stepper.u, drift/abs(before) if before else drift, n


# ---- what a law does -----------------------------------------------------------------------------

@pytest.mark.each_value
@pytest.mark.parametrize("formulation", ["NODE TO SURFACE", "MORTAR"])
@pytest.mark.parametrize("law", [quadratic, neo_hooke, tension_only, anisotropic])
def test_energy_is_kept_through_an_impact(formulation: str, law: Law) -> None:
    _, drift, n = run(impact(law, formulation))
    assert n > 2
    assert drift < TOL


def test_law_that_is_built_in_gives_the_same() -> None:
    mine, built_in = (run(impact(**given))[0] for given in
                      ({"law": quadratic}, {"elastic": (YOUNG, NU)}))
    assert abs(mine - built_in).max() < TOL
    for nlgeom in (True, False):
        mine, built_in = (run(pulled(nlgeom=nlgeom, **given))[0] for given in
                          ({"law": quadratic}, {"elastic": (YOUNG, NU)}))
        assert abs(mine).max() > 0.05
        assert abs(mine - built_in).max() < TOL


def test_neo_hooke_is_the_built_in_one_to_second_order() -> None:
    # both are second order discrete gradients of one energy: the difference falls with h^2
    off = []
    for h in (0.02, 0.01, 0.005):
        mine, built_in = (run(flying(h=h, **given))[0] for given in
                          ({"law": neo_hooke}, {"coupled_neo_hooke": (YOUNG, NU)}))
        off.append(abs(mine - built_in).max())
    assert off[0] > off[1] > off[2]
    assert np.log2(off[0]/off[2])/2 > 1.7
    mine, built_in = (run(pulled(**given))[0] for given in
                      ({"law": neo_hooke}, {"coupled_neo_hooke": (YOUNG, NU)}))
    assert abs(mine - built_in).max() < 1e4*EPS           # of statics the equations are the same


def test_calls_are_few_and_for_all_points() -> None:
    sizes: list[int] = []

    def law(strain: np.ndarray) -> Any:
        sizes.append(len(strain))
        return quadratic(strain)

    n_point = 3*2*4
    with Stepper(flying(law, newton="FULL")) as stepper:
        del sizes[:]
        newton = stepper.step().newton
        # twice for each response; one response for each iteration and for the last residual
        assert set(sizes) <= {n_point, 2*n_point, 3*n_point}
        assert sizes.count(2*n_point) == sizes.count(3*n_point)
        assert newton <= sizes.count(2*n_point) <= newton + 2
    with Stepper(pulled(law)) as stepper:
        del sizes[:]
        newton = stepper.step().newton
        assert set(sizes) == {4*2*4}
        assert newton <= len(sizes) <= newton + 3


def test_functions_own_what_they_get() -> None:
    kept: list[np.ndarray] = []

    def law(strain: np.ndarray) -> Any:
        result = quadratic(strain)
        kept.append(strain)
        strain[:] = np.nan
        return result

    assert abs(run(flying(law))[0] - run(flying(quadratic))[0]).max() == 0.0
    assert all(np.isnan(strain).all() for strain in kept)


def test_lists_will_do() -> None:
    found = run(flying(lambda strain: [part.tolist() for part in quadratic(strain)]))[0]
    assert (found == run(flying(quadratic))[0]).all()


# ---- derivatives ---------------------------------------------------------------------------------

@pytest.mark.parametrize("law", [quadratic, neo_hooke, tension_only, anisotropic])
@pytest.mark.parametrize("size", [1e-12, 1.0, 1e12])
def test_good_laws_pass(law: Law, size: float) -> None:
    def scaled(strain: np.ndarray) -> Any:
        return tuple(size*part for part in law(strain))

    def spoilt(strain: np.ndarray) -> Any:
        energy, stress, modulus = scaled(strain)
        return energy, 1.001*stress, modulus

    Model().material("RUBBER", law=scaled)
    strains = 0.1*np.random.default_rng(7).standard_normal((50, 3))
    check_derivatives(scaled, strains)
    with pytest.raises(InputError, match="derivative of the energy"):      # in these units too
        check_derivatives(spoilt, strains)


def test_good_potentials_pass_far_from_the_origin() -> None:
    points = 1e4 + np.random.default_rng(3).standard_normal((20, 2))
    check_derivatives(attraction, points)
    check_derivatives(attraction, points, scale=1e4)
    with pytest.raises(InputError, match="derivative of the energy"):
        check_derivatives(lambda x: (2*attraction(x)[0], *attraction(x)[1:]), points)


@pytest.mark.parametrize(("spoil", "message"), [
    (lambda w, s, c: (w, 1.001*s, c), "the gradient by variable 0 .* derivative of the energy"),
    (lambda w, s, c: (w, s, 1.001*c), "second derivative by variable 0 .* of the gradient"),
    (lambda w, s, c: (w, s, 0*c), "second derivative"),
    (lambda w, s, c: (w, s*[1, 1, 2], c), "gradient by variable 2|second derivative by variable 0"),
    (lambda w, s, c: (0*w, s, c), "gradient"),
    (lambda w, s, c: (w, s, c + 1e-3*np.triu(np.ones((3, 3)), 1)), "second derivative"),
    (lambda w, s, c: (w, s, np.nan*c), "the second derivative at .* is infinite or NaN"),
    (lambda w, s, c: (np.inf*w, s, c), "the energy at .* is infinite or NaN"),
])
@pytest.mark.parametrize("law", [quadratic, neo_hooke])
def test_wrong_derivatives_are_told(law: Law, spoil: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Model().material("RUBBER", law=lambda strain: spoil(*law(strain)))


def test_laws_of_small_strains_are_checked_at_those() -> None:
    def small(strain: np.ndarray, factor: float = 1.0) -> Any:
        if (abs(strain) > 0.02).any():
            raise Outside
        energy, stress, tangent = quadratic(strain)
        return energy, factor*stress, tangent

    Model().material("RUBBER", law=small)
    with pytest.raises(InputError, match="not the derivative"):
        Model().material("RUBBER", law=lambda strain: small(strain, 1.1))


def test_energies_that_lose_digits_do_no_harm() -> None:
    """Round-off of the modulus in the energy is told from what the quadrature misses.

    What of it is taken for real is divided by the change of strain, which is then above 1e-3: a
    relative error of eps/1e-3^2 in stresses of such changes, times the steps.
    """
    def careless(strain: np.ndarray) -> Any:
        _, stress, tangent = neo_hooke(strain)
        e1, e2, shear = strain.T
        ln = 0.5*np.log((1 + 2*e1)*(1 + 2*e2) - shear**2)
        trace = (1 + 2*e1) + (1 + 2*e2)
        return MU/2*(trace - 2) - MU*ln + LAME/2*ln**2, stress, tangent

    for scene in (flying, impact):
        (u, drift, _), (careful, _, _) = run(scene(careless)), run(scene(neo_hooke))
        assert np.abs(u - careful).max() <= 40*EPS/1e-3**2*np.abs(careful).max()
        assert drift <= 1e-12


def test_points_to_check_have_to_be_some() -> None:
    for points in (np.zeros(3), [[np.nan, 0, 0]]):
        with pytest.raises(InputError, match="points are"):
            check_derivatives(quadratic, points)


# ---- potentials ----------------------------------------------------------------------------------

def attraction(position: np.ndarray) -> Any:
    """-5/r for each node."""
    r = np.hypot(*position.T)[:, None]
    way = position/r
    second = 3*way[:, :, None]*way[:, None, :] - np.eye(2)
    return -5/r[:, 0], 5*way/r**2, -5*second/r[:, :, None]**3


def harmonic(position: np.ndarray) -> Any:
    stiffness = np.array([[3.0, 0.4], [0.4, 2.0]])
    force = position @ stiffness
    return (0.5*(force*position).sum(axis=1), force,
            np.broadcast_to(stiffness, (len(position), 2, 2)))


def wall(position: np.ndarray) -> Any:
    """A soft wall at x = 2.05: k d^3/3 of the depth d behind it."""
    depth = np.maximum(position[:, 0] - 2.05, 0.0)
    first, second = np.zeros((len(depth), 2)), np.zeros((len(depth), 2, 2))
    first[:, 0] = 4e3*depth**2
    second[:, 0, 0] = 8e3*depth
    return 4e3*depth**3/3, first, second


@pytest.mark.parametrize("potential", [harmonic, attraction, wall])
def test_potentials_count_in_the_energy(potential: Law) -> None:
    model = Model.from_mesh(block((1.0, 0.0), (1.0, 1.0), (2, 2)))
    model.material("RUBBER", density=10.0, elastic=(4*YOUNG, NU)).section("RUBBER", "BLOCK")
    model.initial("VELOCITY", "BLOCK", (1, 2), (1.0, 0.4))
    model.potential(potential)
    model.step("DYNAMIC", 0.01, 0.5, direct=True, nlgeom=True)
    with Stepper(model) as stepper:
        before, most, drift = stepper.energies(), 0.0, 0.0
        while not stepper.is_done:
            stepper.step()
            now = stepper.energies()
            assert now["potential"] == pytest.approx(potential(stepper.q)[0].sum(), rel=TOL)
            assert (now["kinetic"] + now["strain"] + now["potential"] - now["external_work"]
                    == pytest.approx(now["total"], rel=TOL))
            most = max(most, abs(now["potential"] - before["potential"]))
            drift = max(drift, abs(now["total"] - before["total"]))
    size = before["kinetic"] + abs(before["potential"])
    assert most > 0.05*before["kinetic"]
    assert drift < TOL*size


def square_with_potential(nodes: Any, labels: Any = None) -> list[int]:
    """Which nodes of a square a potential pushes, in the order in which they were added."""
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    model = Model.from_arrays(corners, [[0, 1, 2, 3]], node_labels=labels)
    model.material("RUBBER", density=1.0, elastic=(YOUNG, NU)).section("RUBBER")
    model.cards("*NSET, NSET=SOME\n" + ("7, 9" if labels is not None else "1, 3"))
    model.potential(lambda z: (z[:, 0], np.tile([1.0, 0], (len(z), 1)), np.zeros((len(z), 2, 2))),
                    nodes)
    model.step("DYNAMIC", 0.01, 0.1, direct=True, nlgeom=True)
    with Stepper(model) as stepper:
        force = stepper.residual(np.zeros((4, 2)), 0.01)
        assert set(np.round(np.unique(force), 12)) <= {0.0, 1.0}
        pushed = stepper.positions[force[:, 0] > 0.5]
    return [k for k, corner in enumerate(corners) if (pushed == corner).all(axis=1).any()]


def test_nodes_are_rows_labels_or_sets() -> None:
    for nodes, found in ((None, [0, 1, 2, 3]), ("some", [0, 2]), ([0, 2], [0, 2]),
                         (np.array([3]), [3]), ("ALL", [0, 1, 2, 3])):
        assert square_with_potential(nodes) == found
    for nodes, found in ((None, [0, 1, 2, 3]), ("SOME", [0, 2]), ([3, 0, 1], [0, 1, 3])):
        assert square_with_potential(nodes, [9, 3, 7, 5]) == found       # rows all the same


def test_nodes_of_a_deck_are_labels(tmp_path: Path) -> None:
    deck = tmp_path/"square.inp"
    deck.write_text("*NODE, NSET=ALL\n9, 0, 0\n3, 1, 0\n7, 1, 1\n5, 0, 1\n*ELEMENT, TYPE=CPE4, "
                    "ELSET=ALL\n1, 9, 3, 7, 5\n*MATERIAL, NAME=WOVEN\n*USER MATERIAL, "
                    "CONSTANTS=0\n*DENSITY\n1.\n*SOLID SECTION, ELSET=ALL, MATERIAL=WOVEN\n1.\n"
                    "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n0.01, 0.1\n*END STEP\n")
    model = Model.from_deck(deck).give_law("woven", quadratic)
    model.potential(harmonic, [5, 7])
    with Stepper(model) as stepper:
        assert stepper.energies()["potential"] == harmonic(np.array([[0, 1], [1, 1.0]]))[0].sum()
    with pytest.raises(InputError, match="potential 1: there is no node 6"):
        Stepper(Model.from_deck(deck).give_law("WOVEN", quadratic).potential(harmonic, [6]))
    with pytest.raises(InputError, match="square.inp:.*WOVEN is a .USER MATERIAL: a program has"):
        Stepper(deck)
    with pytest.raises(InputError, match="there is no material SILK"):
        Stepper(Model.from_deck(deck).give_law("SILK", quadratic))


@pytest.mark.parametrize(("nodes", "message"), [
    ([4], "there is no node 4; rows of nodes are 0 to 3"), ([0, 0], "names node 1 twice"),
    ("NONE", "there is no node set NONE"), (" ", "is not the name of a node set"),
    ([0.5], "whole numbers|integer"),
])
def test_nodes_that_are_none_are_refused(nodes: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        square_with_potential(nodes)


# ---- hosts ---------------------------------------------------------------------------------------

class Springs:
    """Springs between nodes, of energy k L e^2/2 with the strain e = (l^2 - L^2)/(2 L^2)."""

    def __init__(self, x: np.ndarray, pairs: list[tuple[int, int]], stiffness: float = 100.0,
                 form: Callable[[np.ndarray], Any] = lambda dense: dense) -> None:
        self.i, self.j = np.array(pairs).T
        self.side = x[self.j] - x[self.i]
        self.length = np.hypot(*self.side.T)
        self.stiffness = stiffness
        self.form = form
        self.asked: list[bool] = []

    def strain(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        turn = u[self.j] - u[self.i]
        return ((self.side + turn/2)*turn).sum(1)/self.length**2, self.side + turn

    def respond(self, u0: np.ndarray, du: np.ndarray, wants_tangent: bool) -> Any:
        self.asked.append(wants_tangent)
        (e0, way0), (e1, way1) = self.strain(u0), self.strain(u0 + du)
        middle = (way0 + way1)/2
        pull = self.stiffness/self.length*(e0 + e1)/2
        force = np.zeros(u0.shape)
        np.add.at(force, self.j, pull[:, None]*middle)
        np.add.at(force, self.i, -pull[:, None]*middle)
        energy = 0.5*self.stiffness*(self.length*e1**2).sum()
        if not wants_tangent:
            return force, energy, None
        part = (self.stiffness/(2*self.length**3))[:, None, None]*middle[:, :, None]*way1[:, None]
        part = part + (pull/2)[:, None, None]*np.eye(2)
        full = np.zeros(2*u0.shape)
        for a, b, sign in ((self.i, self.i, 1), (self.j, self.j, 1), (self.i, self.j, -1),
                           (self.j, self.i, -1)):
            np.add.at(full.transpose(0, 2, 1, 3), (a, b), sign*part)
        return force, energy, self.form(full.reshape(force.size, force.size))


def lattice(nx: int, ny: int, low: tuple[float, float]) -> tuple[np.ndarray, list[Any]]:
    """Nodes and springs of a rectangle of cells of side 0.5, with diagonals."""
    node = np.arange((nx + 1)*(ny + 1)).reshape(nx + 1, ny + 1)
    x = np.stack(np.indices((nx + 1, ny + 1)), -1).reshape(-1, 2)*0.5 + low
    pairs: list[Any] = []
    for a, b in ((node[:-1], node[1:]), (node[:, :-1], node[:, 1:]),
                 (node[:-1, :-1], node[1:, 1:]), (node[1:, :-1], node[:-1, 1:])):
        pairs += zip(a.ravel().tolist(), b.ravel().tolist())
    return x, pairs


def csr(dense: np.ndarray, keep: np.ndarray | None = None) -> Csr:
    keep = dense != 0 if keep is None else keep
    row, column = np.nonzero(keep)
    start = np.searchsorted(row, np.arange(len(dense) + 1)).astype(np.int32)
    return Csr(dense.shape, start, column.astype(np.int32), dense[row, column])


def scipy_csr(dense: np.ndarray) -> Any:
    return pytest.importorskip("scipy.sparse").csr_matrix(dense)


def thrown(form: Any = lambda dense: dense, mass: Any = None, pattern: Any = None,
           duration: float = 0.3) -> tuple[Model, Springs]:
    """A lattice of springs is thrown at a block of elements."""
    x, pairs = lattice(3, 2, (0.3, 1.02))
    solid = Springs(x, pairs, form=form)
    if pattern is not None:
        solid.pattern = pattern
    model = Model()
    rows = model.add_nodes(x, name="LATTICE")
    n = len(x)
    bottom = rows.reshape(4, 3)[:, 0]
    low = np.stack(np.meshgrid(np.linspace(0, 2, 6), [0.0, 0.5, 1.0]), -1).reshape(-1, 2)
    base = model.add_nodes(low).reshape(3, 6)
    cells = np.stack((base[:-1, :-1], base[:-1, 1:], base[1:, 1:], base[1:, :-1]), -1)
    model.add_elements(cells.reshape(-1, 4))
    model.material("RUBBER", density=1.0, elastic=(YOUNG, NU)).section("RUBBER")
    total = n + len(low)
    solid.n_node = total
    model.host(solid, np.diag([0.1]*n + [0.0]*len(low)) if mass is None else mass(n, total))
    model.surface("UP", edges=np.stack((bottom[:-1], bottom[1:]), 1))
    model.surface("DOWN", edges=np.stack((base[2, 1:], base[2, :-1]), 1)[::-1])
    model.interaction("HARD").contact_pair("UP", "DOWN", interaction="HARD", type="MORTAR")
    model.initial("VELOCITY", "LATTICE", (1, 2), (0.2, -2.0))
    model.step("DYNAMIC", 0.01, duration, direct=True, nlgeom=True)
    return model, solid


def test_springs_of_a_host_beside_elements_keep_the_energy() -> None:
    model, solid = thrown()
    _, drift, n = run(model)
    assert n > 1
    assert drift < TOL
    assert not all(solid.asked) and any(solid.asked)


@pytest.mark.parametrize("form", [csr, scipy_csr, lambda dense: csr(dense, dense == dense),
                                  lambda dense: scipy_csr(dense).tocoo()])
def test_tangents_come_in_any_form(form: Any) -> None:
    expected, drift, _ = run(thrown()[0])
    found, drift, _ = run(thrown(form, pattern=np.ones((60, 60)))[0])
    assert drift < TOL
    assert abs(found - expected).max() < TOL


def test_masses_come_in_any_form() -> None:
    rng = np.random.default_rng(4)
    some = rng.random((12, 12))

    def of_nodes(n: int, total: int) -> np.ndarray:
        full = np.zeros((total, total))
        full[:n, :n] = 0.1*np.eye(n) + 0.001*(some + some.T)
        return full

    forms = [of_nodes, lambda *n: csr(of_nodes(*n)), lambda *n: scipy_csr(of_nodes(*n)),
             lambda *n: np.kron(of_nodes(*n), np.eye(2)),
             lambda *n: scipy_csr(np.kron(of_nodes(*n), np.eye(2))),
             lambda *n: csr(np.kron(of_nodes(*n), np.eye(2))), lambda *n: of_nodes(*n).tolist()]
    expected = run(thrown(mass=of_nodes, duration=0.1)[0])[0]
    for form in forms[1:]:
        assert abs(run(thrown(mass=form, duration=0.1)[0])[0] - expected).max() == 0.0


@pytest.mark.parametrize(("mass", "message"), [
    (lambda n: np.eye(n + 1), r"the mass has the shape \(5, 5\); it is between 4 nodes, \(4, 4\)"),
    (lambda n: 3.0, r"the mass has the shape \(\)"),
    (lambda n: np.ones(n), r"shape \(4,\)"),
    (lambda n: np.eye(n)*1j, "complex128, not real numbers"),
    (lambda n: np.eye(n)*np.nan, "is not finite"),
    (lambda n: -np.eye(n), "is negative"),
    (lambda n: np.eye(n) + np.triu(np.full((n, n), 0.1), 1), "not that of the other way round"),
    (lambda n: np.diag([1.0, 2.0]*n), "not the same in both directions"),
    (lambda n: np.eye(2*n) + 0.1*np.eye(2*n)[::-1], "couples the two directions"),
    (lambda n: Csr((n, n), np.arange(n + 1), np.arange(n) + 1, np.ones(n)), "columns 0 to 3"),
    (lambda n: Csr((n, n), np.arange(n), np.arange(n), np.ones(n)), "indptr does not run"),
    (lambda n: Csr((n, n), np.arange(n + 1), np.arange(n), np.ones(n + 1)), "has the shape"),
])
def test_masses_that_are_none_are_refused(mass: Any, message: str) -> None:
    x, pairs = lattice(1, 1, (0.0, 0.0))
    model = Model.from_arrays(x).host(Springs(x, pairs), mass(4))
    model.step("DYNAMIC", 0.01, 0.1, direct=True, nlgeom=True)
    with pytest.raises(InputError, match=message):
        Stepper(model)


def free_springs(solid: Any = None, form: Any = lambda dense: dense, mass: float = 1.0,
                 newton: str = "KEPT") -> Model:
    x, pairs = lattice(2, 1, (0.0, 0.0))
    model = Model.from_arrays(x).host(solid or Springs(x, pairs, form=form), mass*np.eye(6))
    model.initial("VELOCITY", [0, 5], (1, 2), [[1.0, 0.3], [-0.5, 0.4]])
    model.step("DYNAMIC", 0.05, 1.0, direct=True, nlgeom=True).newton(newton)
    return model


def test_hosts_alone_and_together() -> None:
    alone, drift, _ = run(free_springs())
    assert drift < TOL
    x, pairs = lattice(2, 1, (0.0, 0.0))
    half = [Springs(x, pairs[k::2]) for k in (0, 1)]
    model = Model.from_arrays(x)
    for solid in half:
        model.host(solid, 0.5*np.eye(6))
    model.initial("VELOCITY", [0, 5], (1, 2), [[1.0, 0.3], [-0.5, 0.4]])
    model.step("DYNAMIC", 0.05, 1.0, direct=True, nlgeom=True)
    both, drift, _ = run(model)
    assert drift < TOL
    assert abs(both - alone).max() < 1e3*TOL      # of sums in another order, after 20 steps


def test_entries_outside_the_pattern() -> None:
    class Growing(Springs):
        def respond(self, u0: np.ndarray, du: np.ndarray, wants_tangent: bool) -> Any:
            force, energy, tangent = super().respond(u0, du, wants_tangent)
            if tangent is not None and abs(u0).max() > 0:
                tangent[0, 11] = tangent[11, 0] = 1e-9
            return force, energy, None if tangent is None else csr(tangent)

    x, pairs = lattice(2, 1, (0.0, 0.0))
    with Stepper(free_springs(Growing(x, pairs), newton="FULL")) as stepper, \
            pytest.raises(InputError, match=r"entry \(0, 11\) that is not in its pattern.*"
                                            "attribute `pattern`"):
        stepper.run()
    solid = Growing(x, pairs)
    solid.pattern = np.ones((12, 12))
    assert run(free_springs(solid))[1] < TOL
    solid.pattern = np.ones((6, 6))
    with pytest.raises(InputError, match=r"its pattern has the shape \(6, 6\), not \(12, 12\)"):
        Stepper(free_springs(solid))


def test_ties_and_equations_hold_nodes_of_a_host() -> None:
    x, pairs = lattice(2, 1, (0.0, 0.0))
    model = Model.from_arrays(np.vstack((x, x + [0.0, 0.6])))
    second = [(a + 6, b + 6) for a, b in pairs]
    whole = np.vstack((x, x + [0.0, 0.6]))
    model.host(Springs(whole, pairs + second), np.eye(12))
    model.equation([(3, 1, 1.0), (6, 1, -1.0)]).equation([(3, 2, 1.0), (6, 2, -1.0)])
    model.initial("VELOCITY", 0, (1, 2), (1.0, 0.5))
    model.step("DYNAMIC", 0.02, 0.4, direct=True, nlgeom=True)
    u, drift, _ = run(model)
    assert drift < TOL and abs(u[6]).max() > 0
    assert abs(u[3] - u[6]).max() < TOL

    model = Model.from_arrays(np.vstack((x, x + [0.0, 0.5])))
    whole = np.vstack((x, x + [0.0, 0.5]))
    model.host(Springs(whole, pairs + second), np.eye(12))
    model.surface("UP", edges=[[5, 3], [3, 1]]).surface("DOWN", edges=[[6, 8], [8, 10]])
    model.tie("SEAM", "DOWN", "UP")
    model.initial("VELOCITY", 0, (1, 2), (1.0, 0.5))
    model.step("DYNAMIC", 0.02, 0.4, direct=True, nlgeom=True)
    u, drift, _ = run(model)
    assert drift < TOL and abs(u[6]).max() > 0
    assert abs(u[[6, 8, 10]] - u[[1, 3, 5]]).max() < TOL


def test_forces_without_an_energy_are_solved_too() -> None:
    class Circling(Springs):                 # pushes along x where displaced along y: unsymmetric
        def respond(self, u0: np.ndarray, du: np.ndarray, wants_tangent: bool) -> Any:
            force, energy, tangent = super().respond(u0, du, wants_tangent)
            force[:, 0] += 5*(u0 + du/2)[:, 1]
            if tangent is not None:
                tangent[np.arange(0, 12, 2), np.arange(1, 12, 2)] += 2.5
            return force, energy, tangent

    x, pairs = lattice(2, 1, (0.0, 0.0))
    with Stepper(free_springs(Circling(x, pairs))) as stepper:
        newton = max(stepper.step().newton for _ in range(10))
        assert newton < 8                    # converges with the tangent as it is given


# ---- queries and states --------------------------------------------------------------------------

def all_given() -> Model:
    """A model with a law, a potential, and a host's springs between nodes of elements."""
    model = flying(neo_hooke)
    mesh = block((0.0, 0.0), (2.0, 1.0), (3, 2))
    order = np.argsort(mesh.node_labels)
    x = mesh.nodes[order]
    model.potential(attraction_from_afar)
    model.host(Springs(x, [(0, 11), (3, 8), (1, 6)], 3.0), nodes="BLOCK")
    return model


def attraction_from_afar(position: np.ndarray) -> Any:
    return attraction(position + [5.0, 4.0])


def test_queries_agree_with_differences() -> None:
    with Stepper(all_given()) as stepper:
        stepper.step()
        rng = np.random.default_rng(2)
        u1 = stepper.u + 0.02*rng.standard_normal(stepper.u.shape)
        way = rng.standard_normal(u1.shape)
        size = EPS**(1/3)
        after, before = (stepper.evaluate(u1 + t*way, 0.02).unknown_residual()
                         for t in (size, -size))
        tangent = stepper.tangent(u1, 0.02)
        found = tangent @ np.linalg.lstsq(stepper.links.toarray(), way.ravel(), rcond=None)[0]
        # third derivatives here are up to some hundred times the second ones
        assert abs((after - before)/(2*size) - found).max() < 1e3*size**2*abs(found).max()


def test_states_and_restarts_go_on_to_the_bit(tmp_path: Path) -> None:
    model = all_given()
    with Stepper(model) as stepper:
        for _ in range(3):
            stepper.step()
        kept = stepper.save()
        stepper.write_restart(tmp_path/"a.restart")
        stepper.run()
        end = stepper.u
        stepper.restore(kept)
        stepper.run()
        assert (stepper.u == end).all()
    with Stepper.from_restart(tmp_path/"a.restart", model) as again:
        assert again.time > 0
        again.run()
        assert (again.u == end).all()
    with pytest.raises(InputError, match="give them again"):
        Stepper.from_restart(tmp_path/"a.restart")


def test_exception_comes_out_of_a_restart(tmp_path: Path) -> None:
    law, mood = moody()
    with Stepper(flying(law)) as stepper:
        stepper.step()
        stepper.write_restart(tmp_path/"a.restart")
    model = flying(law)
    mood["call"] = raising(ZeroDivisionError("mine"))
    with pytest.raises(ZeroDivisionError, match="mine"):
        Stepper.from_restart(tmp_path/"a.restart", model)


# ---- functions that misbehave --------------------------------------------------------------------

def moody(law: Law = quadratic) -> tuple[Law, dict[str, Any]]:
    """A law that does something else once `mood` says so."""
    mood: dict[str, Any] = {"call": law, "n": 0}

    def outer(strain: np.ndarray) -> Any:
        mood["n"] += 1
        return mood["call"](strain)

    return outer, mood


def raising(exception: BaseException) -> Law:
    def law(strain: np.ndarray) -> Any:
        raise exception
    return law


@pytest.mark.parametrize("kind", [ZeroDivisionError, KeyError, KeyboardInterrupt, SystemExit,
                                  StopIteration, MemoryError, InputError, AnalysisError])
def test_exceptions_come_out_and_the_stepper_goes_on(kind: type[BaseException]) -> None:
    law, mood = moody()
    expected = run(flying(quadratic))[0]
    with Stepper(flying(law)) as stepper:
        stepper.step()
        u, v, lam, time_now = stepper.u, stepper.v, stepper.lam, stepper.time
        for _ in range(2):
            mood["call"] = raising(kind("of mine"))
            with pytest.raises(kind, match="of mine") as caught:
                stepper.step()
            assert any("the law of RUBBER" in note for note in caught.value.__notes__)
            assert caught.value.__context__ is None and caught.value.__cause__ is None
            assert (stepper.u == u).all() and (stepper.v == v).all() and stepper.time == time_now
            assert (stepper.lam == lam).all()
        with pytest.raises(kind, match="of mine"):
            stepper.residual(u, 0.02)
        mood["call"] = quadratic
        assert abs(stepper.residual(u, 0.02)).max() > 0
        stepper.run()
        assert (stepper.u == expected).all()


def test_causes_of_an_exception_stay() -> None:
    def law(strain: np.ndarray) -> Any:
        try:
            return {}["nothing"]
        except KeyError as error:
            raise RuntimeError("of mine") from error

    outer, mood = moody()
    with Stepper(flying(outer)) as stepper:
        mood["call"] = law
        with pytest.raises(RuntimeError) as caught:
            stepper.step()
    assert isinstance(caught.value.__cause__, KeyError)


def test_exception_while_building() -> None:
    law, mood = moody()
    model = flying(law)
    mood["call"] = raising(ZeroDivisionError("at rest"))
    with pytest.raises(ZeroDivisionError, match="at rest"):
        Stepper(model)
    mood["call"] = quadratic
    assert (run(model)[0] == run(flying(quadratic))[0]).all()


@pytest.mark.parametrize(("answer", "message"), [
    (lambda w, s, c: None, "the law of RUBBER: its function is to return energies, gradients and "
                           "second derivatives, not NoneType"),
    (lambda w, s, c: (w, s), "three things, not 2"),
    (lambda w, s, c: (w[:-1], s, c), r"the energy has the shape \(\d+,\), not \(\d+,\)"),
    (lambda w, s, c: (w, s.T, c), r"the gradient has the shape \(3, \d+\), not \(\d+, 3\)"),
    (lambda w, s, c: (w, s, c[0]), r"the second derivative has the shape \(3, 3\), not"),
    (lambda w, s, c: (1j*w, s, c), "the energy is of dtype complex128, not real numbers"),
    (lambda w, s, c: (w, s.astype(str), c), "the gradient is of dtype <U"),
    (lambda w, s, c: (w, s.astype(object), c), "the gradient is of dtype object"),
    (lambda w, s, c: (w > 0, s, c), "the energy is of dtype bool"),
    (lambda w, s, c: (w, s, None), "the second derivative is None"),
    (lambda w, s, c: (w, [[1, 2], [3]], c), "the gradient: no array can be made of it"),
])
def test_rubbish_is_told(answer: Any, message: str) -> None:
    law, mood = moody()
    with Stepper(flying(law)) as stepper:
        mood["call"] = lambda strain: answer(*quadratic(strain))
        with pytest.raises(InputError, match=message):
            stepper.step()
        mood["call"] = quadratic
        stepper.run()
        assert (stepper.u == run(flying(quadratic))[0]).all()
    with pytest.raises(InputError, match=message.replace("the law of RUBBER", "the function")):
        Model().material("RUBBER", law=lambda strain: answer(*quadratic(strain)))


@pytest.mark.parametrize(("answer", "message"), [
    (lambda f, e, k: None, r"solid 1: its function is to return forces, energy and tangent, not"),
    (lambda f, e, k: (f.ravel(), e, k), r"solid 1: the force has the shape \(12,\), not \(6, 2\)"),
    (lambda f, e, k: (f, [e], k), r"the energy has the shape \(1,\), not \(\)"),
    (lambda f, e, k: (f, e, None), "the tangent is None"),
    (lambda f, e, k: (f, e, np.eye(3)), r"the tangent has the shape \(3, 3\), not \(12, 12\)"),
    (lambda f, e, k: (f, e, csr(np.eye(3))), r"the tangent has the shape \(3, 3\), not"),
    (lambda f, e, k: (f, e, scipy_csr(np.eye(12))*1j), "of dtype complex128"),
    (lambda f, e, k: (f, e, Csr((12, 12), np.arange(13), np.arange(12) + 1, np.ones(12))),
     "columns 0 to 11 that ascend"),
    (lambda f, e, k: (f, e, Csr((12, 12), np.arange(13), np.arange(12), np.ones(11))),
     r"has the shape \(11,\), not \(12,\)"),
    (lambda f, e, k: (f, e, Csr((12, 12), np.arange(12), np.arange(12), np.ones(12))),
     "indptr does not run"),
])
def test_rubbish_of_a_host_is_told(answer: Any, message: str) -> None:
    class Odd(Springs):
        is_odd = False

        def respond(self, u0: np.ndarray, du: np.ndarray, wants_tangent: bool) -> Any:
            force, energy, tangent = super().respond(u0, du, True)
            return answer(force, energy, tangent) if self.is_odd else (force, energy, tangent)

    x, pairs = lattice(2, 1, (0.0, 0.0))
    solid = Odd(x, pairs)
    with Stepper(free_springs(solid, newton="FULL")) as stepper:
        stepper.step()
        solid.is_odd = True
        with pytest.raises(InputError, match=message):
            stepper.step()
        solid.is_odd = False
        stepper.run()
        assert (stepper.u == run(free_springs(newton="FULL"))[0]).all()
        solid.is_odd = True
    with pytest.raises(InputError, match=message):
        Stepper(free_springs(solid))


def test_things_that_are_no_functions_are_refused() -> None:
    with pytest.raises(InputError, match="a function is needed, not 3"):
        Model().material("RUBBER", law=3)
    with pytest.raises(InputError, match="potential 1: a function is needed, not 'x'"):
        Stepper(flying(quadratic).potential("x"))
    with pytest.raises(InputError, match=r"solid 1: an object with a method respond\(u0, du"):
        Stepper(flying(quadratic).host(np.eye(3)))
    with pytest.raises(InputError, match="one law, not 2"):
        Model().material("RUBBER", law=quadratic, elastic=(1, 0))


@pytest.mark.parametrize("nothing", [
    lambda strain: (np.nan*quadratic(strain)[0], *quadratic(strain)[1:]),
    lambda strain: (*quadratic(strain)[:2], np.nan*quadratic(strain)[2]), raising(Outside())])
def test_states_without_energy_cut_the_step(nothing: Law) -> None:
    law, mood = moody()
    model = impact(law, h_min=0.001, newton="FULL")
    with Stepper(model) as stepper:
        stepper.step()
        u, time_now = stepper.u, stepper.time
        mood["call"] = nothing
        with pytest.raises(AnalysisError, match="RUBBER"):
            stepper.step()
        assert (stepper.u == u).all() and stepper.time == time_now
        first = mood["n"]
        mood["call"] = lambda strain: (quadratic if mood["n"] > first + 3 else nothing)(strain)
        assert stepper.step().cuts > 0
        mood["call"] = quadratic
        stepper.run()


def test_limits_of_a_law_are_kept_by_smaller_steps() -> None:
    largest: list[float] = []

    def law(strain: np.ndarray) -> Any:
        largest.append(abs(strain).max())
        if largest[-1] > 0.125:
            raise Outside("too large")
        return quadratic(strain)

    with Stepper(impact(law, h=0.05, duration=0.1, h_min=1e-4)) as stepper:
        with pytest.raises(AnalysisError, match="RUBBER"):
            stepper.set_state(u=1.5*stepper.positions)        # strains of 2.6
        del largest[:]
        stepper.run()
        assert max(largest) > 0.125                           # and that step was cut
        del largest[:]
        stepper.residual(stepper.u, 0.01)
        assert 0.01 < max(largest) <= 0.125


def test_stepper_is_not_used_by_the_functions_that_it_calls() -> None:
    law, mood = moody()
    with Stepper(flying(law)) as stepper:
        for deed in (lambda: stepper.step(), lambda: stepper.u, lambda: stepper.save(),
                     lambda: stepper.close()):
            mood["call"] = lambda strain, deed=deed: (deed(), quadratic(strain))[1]
            with pytest.raises(InputError, match="in use by"):
                stepper.step()
        mood["call"] = lambda strain: (run(flying(quadratic)), quadratic(strain))[1]
        stepper.step()                                         # another stepper may be
        mood["call"] = quadratic
        stepper.run()
        assert (stepper.u == run(flying(quadratic))[0]).all()


def test_functions_live_as_long_as_the_stepper() -> None:
    def make() -> Stepper:
        scale = np.ones(1000)
        return Stepper(all_given().potential(lambda z: tuple(scale[0]*w for w in harmonic(z))))

    with make() as stepper:
        gc.collect()
        before = stepper.energies()
        for _ in range(3):
            stepper.step()
        after = stepper.energies()
        assert after["potential"] != before["potential"]
        assert abs(after["total"] - before["total"]) <= 1e-12*before["total"]


def test_everything_goes_with_the_stepper_at_once() -> None:
    class Law:
        def __call__(self, strain: np.ndarray) -> Any:
            if self.is_bad:
                raise ZeroDivisionError
            return quadratic(strain)

        is_bad = False

    gc.collect()
    gc.disable()
    try:
        for ends_badly in (False, True):
            law = Law()
            stepper = Stepper(flying(law))
            stepper.step()
            if ends_badly:
                law.is_bad = True
                for _ in range(2):
                    try:
                        stepper.step()
                    except ZeroDivisionError:
                        pass
            alive = weakref.ref(law), weakref.ref(stepper), weakref.ref(stepper._handle)
            del law, stepper
            assert [thing() for thing in alive] == [None]*3
    finally:
        gc.enable()


def test_exceptions_that_the_library_got_over_do_not_come_later() -> None:
    law, mood = moody()
    with Stepper(flying(law)) as stepper:
        stepper._handle.given[0].exception = None
        mood["call"] = raising(ZeroDivisionError("first"))
        with pytest.raises(ZeroDivisionError):
            stepper.step()
        assert all(item.exception is None for item in stepper._handle.given)
        mood["call"] = quadratic
        with pytest.raises(InputError, match="shape"):
            stepper.residual(np.zeros((1, 2)), 0.01)
        stepper.run()


def test_what_a_function_has_not_set_is_no_value(monkeypatch: pytest.MonkeyPatch) -> None:
    # as when the handler of a signal raises before the function is entered
    for model, name in ((flying(quadratic), "RUBBER"), (pulled(quadratic), "RUBBER"),
                        (free_springs(), "solid 1")):
        with Stepper(model) as stepper:
            monkeypatch.setattr(stepper._handle.given[0], "guarded", lambda deed: 0)
            with pytest.raises(AnalysisError, match=name):
                stepper.step()


def test_steppers_in_two_threads_share_a_law() -> None:
    model = impact(neo_hooke, duration=0.1)
    expected = run(model)[0]
    with ThreadPoolExecutor(2) as pool:
        for found, _, _ in pool.map(lambda _: run(model), range(4)):
            assert (found == expected).all()


def test_a_stepper_in_use_refuses_another_thread() -> None:
    law, mood = moody()
    entered, leave = threading.Event(), threading.Event()

    def waiting(strain: np.ndarray) -> Any:
        entered.set()
        assert leave.wait(30)
        return quadratic(strain)

    with Stepper(flying(law)) as stepper:
        mood["call"] = waiting
        with ThreadPoolExecutor(1) as pool:
            step = pool.submit(stepper.step)
            assert entered.wait(30)
            with pytest.raises(InputError, match="in use by another thread"):
                stepper.step()
            leave.set()
            assert step.result().newton > 0


def test_ctrl_c_waits_for_the_increment() -> None:
    model = impact(quadratic, duration=0.2)
    expected = run(model)[0]
    for delay in np.linspace(0.001, 0.03, 12):
        thread = threading.Thread(target=lambda: (time.sleep(delay),
                                                  os.kill(os.getpid(), signal.SIGINT)))
        with Stepper(model) as stepper:
            with pytest.raises(KeyboardInterrupt):
                thread.start()
                stepper.run()
                time.sleep(30)
            thread.join()
            stepper.run()
            assert (stepper.u == expected).all()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_second_ctrl_c_does_not_wait() -> None:
    law, mood = moody()

    def stuck(strain: np.ndarray) -> Any:
        for _ in range(2):
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.01)
        raise AssertionError("not interrupted")

    with Stepper(flying(law)) as stepper:
        mood["call"] = stuck
        with pytest.raises(KeyboardInterrupt):
            stepper.step()
        mood["call"] = quadratic
        stepper.run()
        assert (stepper.u == run(flying(quadratic))[0]).all()


def test_no_memory_is_lost_in_500_cycles() -> None:
    mesh = block((0.0, 0.0), (1.0, 1.0), (1, 1))

    def cycle(n: int) -> None:
        for k in range(n):
            model = Model.from_mesh(mesh)
            big = np.ones(5000)
            model.material("RUBBER", density=1.0, law=lambda strain: quadratic(big[0]*strain))
            model.section("RUBBER", "BLOCK")
            model.step("DYNAMIC", 0.01, 1.0, direct=True, nlgeom=True)
            model.potential(harmonic)
            with Stepper(model) as stepper:
                if k % 4 == 0:
                    stepper.step()

    gc.disable()
    try:
        cycle(200)
        before = resident()
        cycle(500)
        assert resident() - before < 4e6           # the law's array alone would be 20e6
    finally:
        gc.enable()


def resident() -> float:
    """Memory in use, bytes."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages*resource.getpagesize()
