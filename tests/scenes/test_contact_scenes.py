"""Scenes of contact in every formulation: patch test, Hertz, ironing, impact of free bodies."""

import functools

import numpy as np
import pytest
from contact_sides import ALL, with_sides
from scene_tools import (
    DECKS,
    EPSILON,
    Deck,
    coarse_ring,
    figures,
    made,
    run_deck,
    run_one_sided,
)

#: Names of what a step can choose; the rest of a choice is what the decks say.
CHOICES = {
    "node": {"formulation": "NODE TO SURFACE"},
    "node, smooth": {"formulation": "NODE TO SURFACE", "smoothing": "HERMITE"},
    "segment": {"formulation": "SEGMENT", "multiplier": "STANDARD"},
    "segment, dual": {"formulation": "SEGMENT", "multiplier": "DUAL"},
    "edge": {"formulation": "MORTAR", "normal": "EDGE", "multiplier": "STANDARD"},
    "edge, dual": {"formulation": "MORTAR", "normal": "EDGE", "multiplier": "DUAL"},
    "nodal": {"formulation": "MORTAR", "normal": "NODAL", "multiplier": "STANDARD"},
    "nodal, dual": {"formulation": "MORTAR", "normal": "NODAL", "multiplier": "DUAL"},
    "points": {"formulation": "MORTAR", "integration": "ELEMENTS", "points": 4},
    "smooth": {"formulation": "MORTAR", "smoothing": "HERMITE", "normal": "EDGE"},
}
MORTAR = ["edge", "edge, dual", "nodal", "nodal, dual"]


# ---- patch test ---------------------------------------------------------------------------------

PATCH = {
    "aligned": ["--upper", "4x2"],
    "misaligned": ["--upper", "5x2"],
    "finer slave": [],
    "finer master": ["--lower", "9x3", "--upper", "4x2"],
    "swapped": ["--slave", "LOWER"],
    "inclined": ["--slope", 0.3, "--lateral", "EQUAL"],
    "inclined, swapped": ["--slope", -0.4, "--lateral", "EQUAL", "--slave", "LOWER"],
    "partly covered": ["--overhang", 0.7, "--lateral", "HELD", "--slave", "LOWER"],
    "partly covered up to a node": [
        *["--lower", "6x2", "--overhang", 1, "--lateral", "HELD", "--slave", "LOWER"]
    ],
    "master beyond the slave": ["--overhang", 0.7, "--lateral", "HELD"],
}
PRESSURE = 10.0
ROUND_OFF = 1e-12*PRESSURE


def patch(deck, folder, **parameters):
    """Last frame of a patch test: stress (n_node, 6) and pressure of the active slave nodes."""
    fields = run_deck(deck, folder, **parameters).fields()
    active = fields["contact_active"][-1] == 1
    return fields["cauchy_stress"][-1], fields["contact_pressure"][-1][active]


@pytest.mark.each_value
@pytest.mark.parametrize("choice", MORTAR)
@pytest.mark.parametrize("variant", PATCH)
def test_mortar_passes_the_patch_test(tmp_path, variant, choice):
    deck = made("contact_patch", tmp_path, *PATCH[variant])
    yy, xx = figures(deck, r"stress yy = (\S+), xx = (\S+), xy = 0 everywhere")
    stress, pressure = patch(deck, tmp_path, **CHOICES[choice])
    np.testing.assert_allclose(stress[:, 1], yy, rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(stress[:, 0], xx, rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(stress[:, 3], 0, rtol=0, atol=ROUND_OFF)
    assert len(pressure) >= 4
    np.testing.assert_allclose(pressure, PRESSURE, rtol=0, atol=ROUND_OFF)


@pytest.mark.parametrize("variant", [name for name in PATCH if name[-4:] != "node"])
def test_nodes_of_both_sides_pass_the_patch_test(tmp_path, variant):
    """But where a corner stands exactly on a node, over which it is rounded."""
    deck = made("contact_patch", tmp_path, *PATCH[variant])
    yy, xx = figures(deck, r"stress yy = (\S+), xx = (\S+), xy = 0 everywhere")
    stress, _ = patch(deck, tmp_path, formulation="NODE TO SURFACE")
    np.testing.assert_allclose(stress[:, [1, 0, 3]], [[yy, xx, 0]]*len(stress), rtol=0,
                               atol=10*ROUND_OFF)


@pytest.mark.parametrize("variant", ["inclined", "inclined, swapped"])
def test_sides_of_blocks_do_not_come_into_the_patch_test(tmp_path, variant):
    """With all exterior: their corners meet, and in an iteration stand beside each other's side."""
    made("contact_patch", tmp_path, *PATCH[variant])
    deck = with_sides(Deck.read(tmp_path / "contact_patch.inp"), ALL)
    deck.insert("*EL FILE\nS\n*CONTACT FILE\nCSTR\n")
    yy, xx = figures(tmp_path / "contact_patch.inp", r"stress yy = (\S+), xx = (\S+), xy = 0 every")
    stress, _ = patch(deck, tmp_path / "all")
    np.testing.assert_allclose(stress[:, [1, 0, 3]], [[yy, xx, 0]]*len(stress), rtol=0,
                               atol=10*ROUND_OFF)


@pytest.mark.parametrize("method", ["NULL SPACE", "SADDLE POINT"])
def test_patch_is_homogeneous(tmp_path, method):
    deck = DECKS / "contact_patch.inp"
    a, b = figures(deck, r"stretches (\S+) along x, (\S+) along y")
    fields = run_deck(deck, tmp_path, method=method).fields()
    u = fields["displacement"][-1]
    np.testing.assert_allclose(u, fields.x*[a - 1, b - 1], rtol=0, atol=1e-13*fields.x.max())


def test_nodes_of_one_side_and_few_points_fail_the_patch_test(tmp_path):
    """Nodes of both sides pass, and a Gauss rule over whole edges comes closer with more points."""
    deck = DECKS / "contact_patch.inp"

    def error(name, **parameters):
        stress, _ = patch(deck, tmp_path / name, **parameters)
        return np.abs(stress[:, 1] + PRESSURE).max()

    node = error("node", formulation="NODE TO SURFACE", sides="ONE")
    both = error("both", formulation="NODE TO SURFACE")
    few = error("few", formulation="MORTAR", integration="ELEMENTS", points=2)
    many = error("many", formulation="MORTAR", integration="ELEMENTS", points=10)
    assert node > 1e6*ROUND_OFF
    assert both <= ROUND_OFF
    assert few > many > 1e6*ROUND_OFF


# ---- Hertz --------------------------------------------------------------------------------------


LEVELS = (3, 6, 12)


def hertz_pressure(run):
    """Place, nodal force and pressure on the upper arc, per length of the reference mesh.

    The bodies are linear elastic: their theory does not tell the meshes apart, which differ here
    by strains of 2 % in the contact.
    """
    fields = run.fields()
    x, n = fields.x, len(fields.x)
    first_upper = np.flatnonzero(x[:, 1] < -1e-9).max() + 1
    radius = 0.5*np.ptp(x[:, 1])
    upper = np.arange(first_upper, n)
    arc = upper[np.abs(np.hypot(x[upper, 0], x[upper, 1] - radius) - radius) < 1e-9]
    arc = arc[np.argsort(x[arc, 0])]
    edge = np.hypot(*np.diff(x[arc], axis=0).T)
    length = 0.5*(np.r_[0, edge] + np.r_[edge, 0])
    force = fields["contact_force"][-1][arc, 1]
    return x[arc, 0], force, force/length


@pytest.mark.parametrize("choice", [pytest.param("edge", marks=pytest.mark.long), "nodal, dual"])
def test_hertz_converges(tmp_path, choice):
    """Half-width, from the second moment of the force (a^2/4), and peak pressure."""
    width_error, peak_error = [], []
    for level in LEVELS:
        folder = tmp_path / str(level)
        folder.mkdir()
        deck = made("hertz", folder, "--level", level)
        a, peak = figures(deck, r"R'/\(pi E'\)\) = (\S+), peak pressure 2 F/\(pi a\) = (\S+), ")
        (total,) = figures(deck, r"Sum of the contact forces (\S+)\. ")
        run = run_deck(deck, folder, **CHOICES[choice])
        # Corrections that close gaps from a state of rest are taken whole, not searched back; an
        # increment ends with one residual where a set stands, with two where all are condensed.
        counts = run.verdict["counts"]
        assert counts["tangents"] <= counts["factorisations"] + run.verdict["increments"]
        x, force, pressure = hertz_pressure(run)
        assert force.sum() == pytest.approx(total, rel=1e-9)
        width_error.append(abs(2*np.sqrt((force*x**2).sum()/total)/a - 1))
        peak_error.append(abs(pressure.max()/peak - 1))
    # With elements of e = a/level the second moment of nodal forces is that of the pressure and
    # e^2/6, by which the width is e^2/(3 a^2) too large; the mean of an ellipse around its middle,
    # half an edge from the next node at most, is e^2/(12 a^2) + e^2/(8 a^2) too small.
    bound = [1/(3*level**2) for level in LEVELS]
    assert (np.array(width_error) <= bound).all()
    assert (np.array(peak_error) <= bound).all()


# ---- ironing ------------------------------------------------------------------------------------


@pytest.mark.parametrize("choice", ["edge", "nodal, dual", "smooth"])
def test_ironing_in_equilibrium(tmp_path, choice):
    deck = Deck.read(DECKS / "ironing.inp")
    deck.insert("*NODE PRINT, NSET=BASE, TOTALS=ONLY\nRF", before="*CONTACT PRINT")
    run = run_deck(deck, tmp_path, h_press=0.25, h=0.2, path=1, **CHOICES[choice])
    head, base = (run.series(name, "TOTAL_RF")[1][1:, 0, :] for name in ("HEAD", "BASE"))
    assert head.shape == (9, 2) and head[-1, 1] < 0
    # To the tolerance of the iteration, 1e-10 of the forces before they cancel.
    np.testing.assert_allclose(head + base, 0, rtol=0, atol=1e-8*np.abs(head).max())
    # Not the first frame: dual means of a gap that opens from one node on can be negative.
    assert np.nanmin(run.fields()["contact_gap"][1:]) >= -1e-12


def test_ironing_works_on_the_block_only(tmp_path):
    """Without friction the work of the horizontal reaction is all strain energy, at each place."""
    n = 8
    element = path = 0.3125
    run = run_deck(DECKS / "ironing.inp", tmp_path, h_press=0.25, h=path/n, path=path)
    drawn = run.series("HEAD", "TOTAL_RF")[1][-n - 1 :, 0, 0]
    work = 0.5*(drawn[1:] + drawn[:-1]).mean()*path
    energy = run.history["strain"][-1] - run.history["strain"][-n - 1]
    # Error of the trapezoid for a force that swings once over an element: F''/12 per (path/n)^2.
    error = (2*np.pi*path/element/n)**2/12*np.abs(drawn).max()*path
    assert abs(work - energy) <= error


@pytest.mark.long
def test_ironing_with_nodes_of_both_sides_held(tmp_path):
    """Nodes fall into dents and are pushed over corners, up to t = 2.9: no cuts down to the smallest.

    Both sides are held by one geometry, so that what is closed is closed to round-off.
    """
    run = run_deck(DECKS / "ironing.inp", tmp_path, formulation="NODE TO SURFACE", sides="BOTH",
                   path=1.9)
    size = 16                                    # of the scene, on the safe side
    assert run.verdict["penetration"] <= 16*EPSILON*size
    assert run.history["cuts"].sum() <= 12


# ---- free bodies --------------------------------------------------------------------------------

#: Time by which the bodies have parted, and increment.
FREE = {"two_bodies": (1.2, 0.02), "three_bodies": (0.8, 0.02), "self_contact": (0.8, 0.01)}


def assert_conserved(run, deck, tolerance=1e-11):
    mass, energy = figures(deck, r"mass (\S+); total energy (\S+), all kinetic")
    px, py, lz = figures(deck, r"px = (\S+), py = (\S+), lz = (\S+);")
    assert run.series("BODIES", "MASS")[1][0].sum() == pytest.approx(mass, rel=1e-11)
    for name, value in (("total", energy), ("px", px), ("py", py), ("lz", lz)):
        column = run.history[name]
        assert column[0] == pytest.approx(value, rel=1e-11), name
        assert np.abs(column - column[0]).max() <= tolerance*abs(value), name


@pytest.fixture(scope="module")
def free(tmp_path_factory):
    """`free(scene, choice)` is the finished run; each is made once."""

    @functools.cache
    def run(scene, choice):
        t_end, h = FREE[scene]
        return run_one_sided(DECKS / f"{scene}.inp", tmp_path_factory.mktemp(scene), h=h,
                             t_end=t_end, frame=t_end/40, **CHOICES[choice])

    return run


@pytest.mark.each_value
@pytest.mark.parametrize("choice", CHOICES)
@pytest.mark.parametrize("scene", FREE)
def test_free_bodies_conserve(free, scene, choice):
    run = free(scene, choice)
    assert_conserved(run, DECKS / f"{scene}.inp")
    assert run.history["active"].max() >= 2
    assert np.nanmin(run.fields()["contact_gap"]) >= -1e-12


@pytest.mark.parametrize("choice", CHOICES)
@pytest.mark.parametrize("scene", ["two_bodies", "three_bodies"])
def test_bodies_meet_and_part(free, scene, choice):
    run = free(scene, choice)
    active = run.history["active"]
    assert active[0] == 0 and active.max() > 0 and active[-1] == 0
    # Each body has been turned round or set going.
    momentum = run.series("BODIES", "MOMENTUM")[1]
    change = np.abs(momentum[-1, :, 0] - momentum[0, :, 0])
    assert (change > 0.1*np.abs(momentum[0, :, 0]).max()).all()


def test_momenta_of_the_headings(tmp_path):
    """What each body has after the impact, to the spread that the headings name."""
    ring_x, ring_y, disc_x, disc_y, spread = figures(
        DECKS / "two_bodies.inp",
        r"the ring has px = (\S+) and py = (\S+), the disc px = (\S+) and py = (\S+), "
        r"all \+- (\S+) over",
    )
    run = run_deck(DECKS / "two_bodies.inp", tmp_path, t_end=1)
    momentum = run.series("BODIES", "MOMENTUM")[1][-1, :, :2]
    expected = [[ring_x, ring_y], [disc_x, disc_y]]
    np.testing.assert_allclose(momentum, expected, rtol=0, atol=spread)
    *px, spread = figures(
        DECKS / "three_bodies.inp",
        r"px is (\S+) of the left, (\S+) of the middle and (\S+) of the right disc, "
        r"all \+- (\S+) over",
    )
    run = run_one_sided(DECKS / "three_bodies.inp", tmp_path, t_end=0.8)
    momentum = run.series("BODIES", "MOMENTUM")[1][-1, :, 0]
    np.testing.assert_allclose(momentum, px, rtol=0, atol=spread)


@pytest.mark.each_value
@pytest.mark.parametrize("method", ["NULL SPACE", "SADDLE POINT"])
@pytest.mark.parametrize("choice", ["node", "segment", "edge", "nodal, dual"])
def test_two_passes(tmp_path, choice, method):
    """Each pair in both orders: constraints that depend on each other."""
    deck = made("three_bodies", tmp_path, "--two-pass")
    t_end, h = FREE["three_bodies"]
    run = run_one_sided(deck, tmp_path, h=h, t_end=t_end, method=method, **CHOICES[choice])
    assert_conserved(run, deck)
    assert run.history["active"].max() >= 2


@pytest.mark.parametrize("choice", CHOICES)
def test_folded_strip_does_not_pass_through_itself(free, choice):
    """No node of the inside of one leg lies deep in the other leg.

    Means of gaps are held, or those of the nodes of one leg only: nodes may be behind the other
    side by a fraction of an element, a quarter here.
    """
    fields = free("self_contact", choice).fields()
    x = fields.x
    legs = [np.flatnonzero((x[:, 0] > 0) & (sign*x[:, 1] > 0)) for sign in (1, -1)]
    inside = [leg[np.abs(np.abs(x[leg, 1]) - 0.5) < 1e-9] for leg in legs]
    assert all(len(nodes) == 22 for nodes in inside)
    element = np.ptp(x[inside[0], 0])/21
    for u in fields["displacement"]:
        q = x + u
        for here, there in (inside, inside[::-1]):
            line = q[there[np.argsort(x[there, 0])]]
            away = 1 if x[there[0], 1] < 0 else -1
            assert depth_behind(q[here], line, away) <= element/4


def depth_behind(points, line, away):
    """Largest distance of points behind a line of nodes along x; `away`: its free side is left."""
    deepest = 0.0
    for p in points:
        a, d = line[:-1], np.diff(line, axis=0)
        share = ((p - a)*d).sum(axis=1)/(d*d).sum(axis=1)
        side = away*(d[:, 0]*(p - a)[:, 1] - d[:, 1]*(p - a)[:, 0])/np.hypot(*d.T)
        over = (share >= 0) & (share <= 1)
        if over.any():
            deepest = max(deepest, -side[over].min())
    return deepest


# ---- ring and bar -------------------------------------------------------------------------------


def whole_impact(folder, choice, h, deck):
    """The ring until it has left the foundation, with the reactions at the clamped bottom."""
    deck.insert("*NODE PRINT, NSET=BOTTOM\nRF", before="*CONTACT PRINT")
    run = run_deck(deck, folder, h=h, t_end=4, **CHOICES[choice])
    assert run.history["active"].max() > 0 and run.history["active"][-1] == 0
    return run


def assert_balances(run):
    """Energy, and what the clamped bottom does to momenta."""
    history = run.history
    assert np.abs(history["total"]/history["total"][0] - 1).max() <= 1e-10
    force = run.series("BOTTOM", "RF")[1][1:]
    x = np.array([run.fields().x[i] for i in bottom_nodes(run)])
    outer = {
        "px": force[..., 0].sum(axis=1),
        "py": force[..., 1].sum(axis=1),
        "lz": (x[:, 0]*force[..., 1] - x[:, 1]*force[..., 0]).sum(axis=1),
    }
    # Of an increment that was cut only the reactions of its last part are known.
    whole = history["cuts"][1:] == 0
    for name, rate in outer.items():
        scale = np.abs(history[name]).max()
        rest = np.where(whole, np.diff(history[name]) - np.diff(history["time"])*rate, 0)
        assert np.abs(np.cumsum(rest)).max() <= 1e-11*scale, name


@pytest.mark.parametrize("choice", ["node", "segment, dual", "nodal, dual", "points", "smooth"])
def test_ring_balances_and_rebounds(tmp_path, choice):
    """The others are in the book."""
    run = whole_impact(tmp_path, choice, 0.05, Deck.read(DECKS / "ring.inp"))
    assert_balances(run)
    # The rebound of the heading, with a spread that holds for every formulation.
    low, high = figures(DECKS / "ring.inp", r"ring py between (\S+) and (\S+) ")
    assert low <= run.series("BODIES", "MOMENTUM")[1][-1, 0, 1] <= high


def test_ring_balances_by_small_steps(tmp_path):
    assert_balances(whole_impact(tmp_path, "edge", 0.02, coarse_ring()))


def bottom_nodes(run):
    """Places in the field file of the clamped nodes, in the order of their labels."""
    x = run.fields().x
    return np.flatnonzero(x[:, 1] == x[:, 1].min())


@pytest.mark.parametrize("choice", CHOICES)
def test_bar_keeps_its_energy_and_rests_for_two_crossings(tmp_path, choice):
    """The floor is one element: every formulation sees the same two gaps."""
    element, wave_speed, crossing = 0.2, 30.0, 1/3
    run = run_deck(DECKS / "bouncing_bar.inp", tmp_path, t_end=2, **CHOICES[choice])
    history = run.history
    assert np.abs(history["total"]).max() <= 1e-10*history["kinetic"].max()
    touching = history["time"][history["active"] > 0]
    h = history["h"][1]
    assert touching[0] == pytest.approx(1.0, abs=1.5*h)
    assert touching[-1] == pytest.approx(1.0 + 2*crossing, abs=element/wave_speed + 1.5*h)


@pytest.mark.parametrize("choice", ["edge", "nodal, dual"])
def test_contact_forces_balance(tmp_path, choice):
    deck = DECKS / "two_bodies.inp"
    run = run_deck(deck, tmp_path, h=0.05, t_end=1, frame=0.05, **CHOICES[choice])
    force = run.fields()["contact_force"]
    largest = np.abs(force).max()
    assert largest > 0
    assert np.abs(force.sum(axis=1)).max() <= 64*EPSILON*largest
