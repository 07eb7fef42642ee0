"""Many contacts at once: sets of active constraints that change while a step is solved."""

import sys

import numpy as np
import pytest
from overlap import Bodies, cross, layers, to_edges, worst
from scene_tools import EPSILON, ROOT, Deck, run_deck

sys.path.insert(0, str(ROOT / "tests" / "bench"))

import crowds  # noqa: E402


@pytest.fixture(scope="module")
def pile(tmp_path_factory):
    """Sixteen discs fall into the bowl, until all have met others."""
    return run_deck(crowds.pile(4), tmp_path_factory.mktemp("pile"), t_end=0.3, frame=0.01)


def test_a_pile_keeps_its_balance_of_energy(pile):
    history = pile.history
    assert history["active"].max() >= 8
    balance = history["kinetic"] + history["strain"] - history["external_work"]
    # Some thousand sums of terms that are rounded once each, per increment.
    assert np.abs(balance).max() <= 1e3*EPSILON*len(history)*history["kinetic"].max()


def test_steps_end_at_round_off_whatever_sets_were_left_on_the_way(pile):
    rows = [line.split() for line in pile.log.splitlines() if line.split()[:1] == ["30"]]
    assert float(rows[-1][-1]) <= 64*EPSILON
    assert pile.verdict["verdict"] == "good", pile.verdict["reasons"]


def test_no_disc_is_inside_another(pile):
    # A contact that begins may be closed by the square root of epsilon of an edge.
    assert worst(pile.fields()).by_edge <= EPSILON**0.5


@pytest.mark.parametrize("n", [50, 110, 300])
def test_long_strips_take_no_more_solves_than_short_ones(n, tmp_path):
    """All 2.1 n nodes of both come to touch in the first increment, and those of one side act: in
    dynamics the sets of 200 are told by one problem, those of more by trials."""
    run = run_deck(crowds.strips(n=n), tmp_path, t_end=6e-4)
    assert run.verdict["verdict"] == "good", run.verdict["reasons"]
    assert run.verdict["cuts"] == 0
    assert n < run.history["active"][-1] <= 2.1*n + 2
    # Four sets an increment, of five corrections each.
    assert run.verdict["newton"] <= 20*run.verdict["increments"]


# ---- smoothed -----------------------------------------------------------------------------------

#: So many chords for the curve of an edge.
CHORDS = 32


def curve(edge, rest, x):
    """Chords (n, 2, 2) of the cubic curves of the outline `edge`, by the slopes of parabolas.

    Turns at rest of more than 60 degrees are corners: there a curve is a parabola itself.
    """
    before = {b: a for a, b in edge}
    after = {a: b for a, b in edge}

    def slope(node):
        a, b = before[node], after[node]
        one, other = rest[node] - rest[a], rest[b] - rest[node]
        if abs(np.arctan2(cross(one, other), one @ other)) > np.pi/3:
            return None
        l, m = np.linalg.norm(one), np.linalg.norm(other)
        return ((x[node] - x[a])*m/l + (x[b] - x[node])*l/m)/(l + m)

    found = []
    for a, b in edge:
        way, length, one, other = x[b] - x[a], np.linalg.norm(rest[b] - rest[a]), slope(a), slope(b)
        if one is None:
            one = way/length if other is None else 2*way/length - other
        if other is None:
            other = 2*way/length - one
        t = np.linspace(0, 1, CHORDS + 1)[:, None]
        at = x[a] + t*t*(3 - 2*t)*way + length*(t*(1 - t)**2*one - t*t*(1 - t)*other)
        found.append(np.stack([at[:-1], at[1:]], axis=1))
    return np.concatenate(found)


@pytest.fixture(scope="module")
def smooth_pile(tmp_path_factory):
    text = crowds.pile(4).text().replace("*DLOAD", "*SURFACE SMOOTHING, TYPE=HERMITE\n*DLOAD", 1)
    return run_deck(Deck(text), tmp_path_factory.mktemp("smooth"), t_end=0.5, frame=0.05)


def test_smoothed_bodies_are_their_curves(smooth_pile):
    fields = smooth_pile.fields()
    bodies, deepest = Bodies(fields.cells), 0.0
    for x in fields.x + fields["displacement"]:
        for i in range(bodies.n):
            chord = curve(bodies.edges(i), fields.x, x)
            low, high = chord.min((0, 1)), chord.max((0, 1))
            p = x[np.unique(bodies.edge[bodies.body_of_edge != i])]
            p = p[((p >= low) & (p <= high)).all(1)]
            p = p[layers(p, chord[:, 0], chord[:, 1]) > 0]
            if not len(p):
                continue
            away = to_edges(p, chord[:, 0], chord[:, 1])
            edge = CHORDS*np.linalg.norm(chord[:, 1] - chord[:, 0], axis=1)[away.argmin(1)]
            deepest = max(deepest, (away.min(1)/edge).max())
    # A chord is off by an eighth of its length times its turn, below 1.
    assert deepest <= 1/(8*CHORDS**2)
    assert worst(fields).by_edge > 0.01
    assert smooth_pile.verdict["verdict"] == "good", smooth_pile.verdict["reasons"]
    assert "edges of curved surfaces overlap" in smooth_pile.log
