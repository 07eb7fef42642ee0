"""Scenes of tied pieces: patch tests, orders of convergence, free flight, rotation, the ring."""

import numpy as np
import pytest
from scene_tools import DECKS, EPSILON, Deck, figures, run_deck
from tie_tools import BEAM, SMOOTH, error_norms, made, residuals

MULTIPLIERS = ["DUAL", "STANDARD"]
METHODS = ["NULL SPACE", "SADDLE POINT"]


# ---- patch tests --------------------------------------------------------------------------------

INTERFACES = {
    "straight": ["--interface", "STRAIGHT"],
    "straight, swapped": ["--interface", "STRAIGHT", "--swap"],
    "inclined": ["--interface", "INCLINED"],
    "inclined, swapped": ["--interface", "INCLINED", "--swap"],
    "curved": ["--interface", "CURVED"],
    "curved, swapped": ["--interface", "CURVED", "--swap"],
    "three": ["--interface", "THREE"],
    "four": ["--interface", "FOUR"],
    "four, swapped": ["--interface", "FOUR", "--swap"],
}
LOADS = ["DISPLACEMENT", "TRACTION", "ROLLERS"]
ROUND_OFF = 1e-12


def assert_uniform(deck, run):
    """Displacement linear in the position and stress as the heading says, at the end."""
    a, b, c, d = figures(
        deck, r"ux,x = (\S+), ux,y = (\S+), uy,x = (\S+), uy,y = (\S+); "
    )
    xx, yy, zz, xy = figures(deck, r"stress xx = (\S+), yy = (\S+), zz = (\S+), xy = (\S+) ")
    fields = run.fields()
    u = fields.x @ np.array([[a, c], [b, d]])
    stress = np.broadcast_to([xx, yy, zz, xy, 0, 0], (len(u), 6))
    scale = np.abs(stress).max()
    np.testing.assert_allclose(
        fields["displacement"][-1], u, rtol=0, atol=ROUND_OFF*np.abs(u).max()
    )
    np.testing.assert_allclose(
        fields["cauchy_stress"][-1], stress, rtol=0, atol=ROUND_OFF*scale
    )


@pytest.mark.each_value
@pytest.mark.parametrize("multiplier", MULTIPLIERS)
@pytest.mark.parametrize("linear", [False, True], ids=["nlgeom", "linear"])
@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize("interface", INTERFACES)
def test_patch_in_statics(tmp_path, interface, load, linear, multiplier):
    options = [*INTERFACES[interface], "--load", load, *(["--linear"] if linear else [])]
    deck = made("patch", tmp_path, *options)
    assert_uniform(deck, run_deck(deck, tmp_path, multiplier=multiplier))


@pytest.mark.each_value
@pytest.mark.parametrize("multiplier", MULTIPLIERS)
@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize("interface", INTERFACES)
def test_patch_in_dynamics(tmp_path, interface, load, multiplier):
    """A uniform rate of strain, which needs no force inside; an equilibrium that stays."""
    deck = made("patch", tmp_path, *INTERFACES[interface], "--load", load, "--dynamic")
    run = run_deck(deck, tmp_path, multiplier=multiplier)
    assert len(run.history) == 11
    assert_uniform(deck, run)


@pytest.mark.parametrize("method", METHODS)
def test_patch_of_the_deck(tmp_path, method):
    deck = DECKS / "tied_patch.inp"
    assert_uniform(deck, run_deck(deck, tmp_path, method=method))


# ---- exact solutions ----------------------------------------------------------------------------


@pytest.mark.parametrize("exact", [SMOOTH, BEAM], ids=["smooth", "beam"])
def test_exact_solutions_are_exact(exact):
    """Equilibrium and Hooke's law, to the error of central differences."""
    step = 1e-4
    for x, y in ((0.3, 0.7), (0.9, 0.2)):
        scale = np.abs(exact.stress(x, y)).max()
        # Third derivatives are a few times the values here; round-off of E times u over the step.
        error = 100*step**2 + exact.young*np.abs(exact.displacement(x, y)).max()*EPSILON/step/scale
        np.testing.assert_allclose(residuals(exact, x, y, step), 0, rtol=0, atol=error*scale)


def errors_and_orders(norms, levels):
    """Slopes of the last two levels, for displacement and energy."""
    norms = np.array(norms)
    return norms[-1], np.log(norms[-2]/norms[-1])/np.log(levels[-1]/levels[-2])


@pytest.fixture(scope="module")
def matching(tmp_path_factory):
    """Errors of one piece with elements of the given number along half of the square."""
    known = {}

    def norms(level):
        if level not in known:
            folder = tmp_path_factory.mktemp(f"matching{level}")
            deck = made("smooth", folder, "--interface", "NONE", "--level", level)
            known[level] = error_norms(run_deck(deck, folder).fields(), SMOOTH)
        return known[level]

    return norms


def test_orders_of_one_piece(matching):
    levels = (8, 16)
    _, order = errors_and_orders([matching(n) for n in levels], levels)
    np.testing.assert_allclose(order, [2, 1], rtol=0, atol=0.05)


LEVELS = {1: (8, 16), 1.5: (8, 16), 10: (3, 6)}
SMOOTH_INTERFACES = ["STRAIGHT", "CURVED", "FOUR", "FOUR CURVED"]


@pytest.mark.each_value
@pytest.mark.parametrize("multiplier", MULTIPLIERS)
@pytest.mark.parametrize("ratio", LEVELS)
@pytest.mark.parametrize("interface", SMOOTH_INTERFACES)
def test_orders(tmp_path, matching, interface, ratio, multiplier):
    norms = []
    for level in LEVELS[ratio]:
        folder = tmp_path / str(level)
        folder.mkdir()
        options = ["--interface", interface, "--ratio", ratio, "--level", level]
        run = run_deck(made("smooth", folder, *options), folder, multiplier=multiplier)
        norms.append(error_norms(run.fields(), SMOOTH))
    last, order = errors_and_orders(norms, LEVELS[ratio])
    np.testing.assert_array_less([1.9, 0.9], order)
    # Not worse than the coarse mesh all over, but for curved pieces and their longer elements.
    assert (last <= 1.25*matching(LEVELS[ratio][-1])).all()


#: Of the beam, on whose orders the clamped end has more of a say.
BEAM_LEVELS = LEVELS | {10: (4, 8)}


@pytest.mark.each_value
@pytest.mark.parametrize("multiplier", MULTIPLIERS)
@pytest.mark.parametrize("ratio", BEAM_LEVELS)
def test_cantilever(tmp_path, ratio, multiplier):
    norms = []
    for level in BEAM_LEVELS[ratio]:
        folder = tmp_path / str(level)
        folder.mkdir()
        deck = made("cantilever", folder, "--ratio", ratio, "--level", level)
        run = run_deck(deck, folder, multiplier=multiplier)
        fields = run.fields()
        norms.append(error_norms(fields, BEAM))
        reaction = fields["reaction_force"][-1].sum(axis=0)
        np.testing.assert_allclose(reaction, [0, -BEAM.force], rtol=0, atol=1e-9)
    _, order = errors_and_orders(norms, BEAM_LEVELS[ratio])
    np.testing.assert_allclose(order, [2, 1], rtol=0, atol=0.1)


def test_tip_of_the_cantilever(tmp_path):
    deck = DECKS / "tied_cantilever.inp"
    (tip,) = figures(deck, r"middle of the tip of the exact solution uy = (\S+);")
    (vertical,) = figures(deck, r"reaction at the wall: vertical (\S+)\.")
    fields = run_deck(deck, tmp_path).fields()
    place = np.flatnonzero((fields.x == [BEAM.length, 0]).all(axis=1))
    # Four elements over the depth, of second order: 1/16 of the deflection at most.
    assert fields["displacement"][-1, place, 1] == pytest.approx(tip, rel=1/16)
    assert fields["reaction_force"][-1, :, 1].sum() == pytest.approx(vertical, rel=1e-9)


# ---- motion -------------------------------------------------------------------------------------

CONSERVED = ("total", "px", "py", "lz")


def spin_deck(velocity=None):
    """The square of four pieces; with one velocity for all nodes, if that is given."""
    deck = Deck.read(DECKS / "tied_spin.inp")
    if velocity is not None:
        while "*INITIAL CONDITIONS" in deck.text():
            deck.remove("*INITIAL CONDITIONS")
        lines = [f"{name}, {k}, {v}" for name in ("SW", "SE", "NE", "NW")
                 for k, v in enumerate(velocity, start=1)]
        deck.insert("\n".join(["*INITIAL CONDITIONS, TYPE=VELOCITY", *lines]), before="*STEP")
    return deck


@pytest.mark.parametrize("multiplier", MULTIPLIERS)
def test_spinning_pieces_conserve(tmp_path, multiplier):
    run = run_deck(DECKS / "tied_spin.inp", tmp_path, multiplier=multiplier, t_end=4)
    history = run.history
    assert len(history) == 401 and history["cuts"].sum() == 0
    assert history["strain"].max() > 0.02*history["total"][0]
    for name in CONSERVED:
        assert np.abs(history[name]/history[name][0] - 1).max() <= 1e-11, name


def test_figures_of_the_spinning_pieces(tmp_path):
    deck = DECKS / "tied_spin.inp"
    pattern = r"mass (\S+), total energy (\S+), px = (\S+), py = (\S+), lz = (\S+), within"
    mass, *values = figures(deck, pattern)
    run = run_deck(deck, tmp_path, t_end=0.1)
    assert run.series("BODIES", "MASS")[1][0].sum() == pytest.approx(mass, rel=0.01)
    for name, value in zip(CONSERVED, values, strict=True):
        assert run.history[name][0] == pytest.approx(value, rel=0.01), name


@pytest.mark.parametrize("multiplier", MULTIPLIERS)
def test_translation_gives_no_stress(tmp_path, multiplier):
    velocity = np.array([2.0, 1.0])
    run = run_deck(spin_deck(velocity), tmp_path, multiplier=multiplier, t_end=1)
    fields = run.fields()
    n = len(run.history)
    assert fields.time[-1] == 1 and n > 10
    moved = velocity*fields.time[-1]
    np.testing.assert_allclose(
        fields["displacement"][-1], np.broadcast_to(moved, fields.x.shape), rtol=0,
        atol=n*16*EPSILON*np.abs(moved).max(),
    )
    # Young's modulus is 100; strains are differences of displacements over elements of a tenth.
    assert np.abs(fields["cauchy_stress"][-1]).max() <= n*100*64*EPSILON*np.abs(moved).max()/0.1


@pytest.mark.parametrize("multiplier", MULTIPLIERS)
def test_rotation_gives_no_stress(tmp_path, multiplier):
    fields = run_deck(DECKS / "tied_rotation.inp", tmp_path, multiplier=multiplier).fields()
    assert len(fields.time) == 10
    for k, (u, stress, force) in enumerate(
        zip(fields["displacement"], fields["cauchy_stress"], fields["reaction_force"], strict=True)
    ):
        c, s = np.cos(k*np.pi/18), np.sin(k*np.pi/18)
        exact = fields.x @ np.array([[c - 1, s], [-s, c - 1]])
        size = np.abs(fields.x).max()
        np.testing.assert_allclose(u, exact, rtol=0, atol=ROUND_OFF*size)
        assert np.abs(stress).max() <= ROUND_OFF*100
        assert np.abs(force).max() <= ROUND_OFF*100


@pytest.mark.parametrize("multiplier", MULTIPLIERS)
def test_saddle_point_makes_the_same_steps(tmp_path, multiplier):
    one, other = (
        run_deck(DECKS / "tied_spin.inp", tmp_path / method[:4], multiplier=multiplier, t_end=1,
                 method=method).history
        for method in METHODS
    )
    scale = one["total"][0]
    for name in ("kinetic", "strain"):
        np.testing.assert_allclose(one[name], other[name], rtol=0, atol=1e-12*scale, err_msg=name)
    for name in CONSERVED:
        np.testing.assert_allclose(one[name], other[name], rtol=1e-12, err_msg=name)


# ---- ring ---------------------------------------------------------------------------------------


def ring_momentum(run, mass):
    """Momentum of the ring at the end: of the bodies, from the first on, that make up its mass."""
    masses = run.series("BODIES", "MASS")[1][0]
    n = int(np.argmin(np.abs(np.cumsum(masses) - mass))) + 1
    return run.series("BODIES", "MOMENTUM")[1][-1, :n, :2].sum(axis=0)/masses[:n].sum()


@pytest.mark.long
def test_ring_in_pieces(tmp_path):
    """Energy, and the rebound of the ring of one piece within 1 percent; with nodes in the book."""
    runs = [
        run_deck(DECKS / f"{name}.inp", tmp_path, formulation="MORTAR", frame=8, h=0.02)
        for name in ("ring", "tied_ring")
    ]
    velocity = []
    for run in runs:
        total = run.history["total"]
        assert np.abs(total/total[0] - 1).max() <= 1e-10
        assert run.history["active"].max() > 0
        (mass,) = figures(DECKS / f"{run.base.name}.inp", r"ring mass (\S+);")
        velocity.append(ring_momentum(run, mass))
    np.testing.assert_allclose(velocity[1], velocity[0], rtol=0.01)
