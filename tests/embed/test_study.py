"""What studies compute of runs, against closed forms in numpy."""

from __future__ import annotations

import dataclasses
import io
import itertools
import math
from pathlib import Path
from types import SimpleNamespace

import h5py
import matplotlib
import numpy as np
import pytest
from emcon.mesh import block, disc, refine
from emcon.plotting import WIDTH
from emcon.results import Bodies, ResultPaths, read_bodies
from emcon.scene import STYLE
from emcon.study import StudyError
from emcon.study.accuracy import (Limit, Run, common_nodes, difference, fitted_order, limit_of,
                                  observed_order)
from emcon.study.choice import cheapest, pareto_front, parse_goals
from emcon.study.deck import DeckFile, read_deck, refined_deck
from emcon.study.execution import Progress, bar_text
from emcon.study.figures import _draw_work
from emcon.study.measures import (Measured, _of_history, _of_pairs, _per_mass, body_geometry,
                                  rigid_energy, windowed)
from emcon.study.plan import Member, make_plan, parse_vary, read_manifest, write_manifest
from emcon.study.reference import Reference
from emcon.study.report import Study, goal_words, goals_met, missing_knobs
from matplotlib.figure import Figure

EPSILON = np.finfo(float).eps
SIZES = [(1.0, 2.0, 4.0), (0.1, 0.15, 0.4), (0.01, 0.02, 0.03)]


# --- convergence -------------------------------------------------------------------------------

@pytest.mark.parametrize("p", [0.6, 1.0, 1.7, 2.0, 4.0])
@pytest.mark.parametrize("sizes", SIZES)
def test_order_and_limit_of_a_power(p: float, sizes: tuple[float, ...]) -> None:
    """Of values that err by 3 h**p the order is p, and what the finest errs by is 3 h1**p."""
    values = [1.0 + 3.0*h**p for h in sizes]
    fine, coarse = values[1] - values[0], values[2] - values[1]
    # differences lose digits: epsilon of the values, over the differences, over the logarithm
    digits = 16*EPSILON*max(values)/min(fine, coarse)/math.log(sizes[2]/sizes[1])
    assert observed_order(sizes, fine, coarse) == pytest.approx(p, abs=digits*max(1.0, p))
    found = limit_of(sizes, fine, coarse)
    if p <= 2.0:
        slope = 8.0*p/min(1.0, (sizes[1]/sizes[0])**p - 1.0)
        assert found.uncertainty == pytest.approx(3.0*sizes[0]**p, rel=slope*digits + 1e-13)
    else:
        # no more than second order is believed: a bound, not an estimate
        assert found.uncertainty > 3.0*sizes[0]**p


def test_limits_where_no_order_is_seen() -> None:
    assert limit_of((1.0, 2.0), 0.3, None).uncertainty == pytest.approx(0.3, rel=4*EPSILON)
    assert limit_of((1.0, 4.0), 0.3, None).uncertainty == pytest.approx(0.1, rel=4*EPSILON)
    # growing or equal differences: no convergence, the larger counts
    for fine, coarse in ((0.3, 0.1), (0.3, 0.3)):
        found = limit_of((1.0, 2.0, 4.0), fine, coarse)
        assert found.uncertainty == 0.3 and not found.order >= 0.5
    assert limit_of((1.0, 2.0, 4.0), 0.0, 0.1) == pytest.approx(Limit(0.0, math.nan), nan_ok=True)


def test_fitted_order_looks_above_the_floor() -> None:
    h = np.array([0.1, 0.2, 0.4, 0.8])
    assert fitted_order(h, 5.0*h**1.5, 0.0) == pytest.approx(1.5, rel=1e-14)
    noisy = np.maximum(5.0*h**1.5, 1.0)
    assert fitted_order(h, noisy, 1.0) == pytest.approx(1.5, rel=1e-14)
    assert math.isnan(fitted_order(h, noisy, 100.0))


def test_difference_by_scale() -> None:
    rows = Measured(np.array([[3.0, 4.0], [0.0, 0.0]]), 10.0)
    other = Measured(np.array([[3.0, 4.5], [0.1, 0.0]]), 10.0)
    assert difference(other, rows) == pytest.approx(0.1, rel=1e-14)      # over the largest row
    assert difference(other, rows, 1) == pytest.approx(0.01, rel=1e-14)  # 0: over the size
    assert difference(rows, rows) == 0.0
    assert math.isnan(difference(rows, Measured(np.zeros((3, 2)), 1.0)))
    assert difference(other, Measured(np.zeros((2, 2)), 0.0)) == math.inf
    given = Measured(np.array([[3.0, 4.0], [np.nan, np.nan]]), 10.0)
    assert difference(other, given) == pytest.approx(0.1, rel=1e-14)


def test_common_nodes_of_bodies_that_touch() -> None:
    coarse = np.array([[0.0, 0, 0], [1.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]])
    fine = np.array([[0.5, 0, 0], [1.0, 0, 0], [2.0, 0, 0], [0.0, 0, 0], [1.0, 0, 0]])
    a, b = common_nodes(coarse, fine)
    assert a.tolist() == [0, 1, 2, 3] and b.tolist() == [3, 1, 4, 2]
    b, a = common_nodes(fine, coarse)
    assert a.tolist() == [0, 1, 2, 3] and b.tolist() == [3, 1, 4, 2]
    assert common_nodes(coarse, fine + 0.1) is None


# --- choice ------------------------------------------------------------------------------------

def test_pareto_front_by_definition() -> None:
    draw = np.random.default_rng(5)
    for n in (1, 2, 7, 40):
        cost, error = draw.integers(1, 9, n).astype(float), draw.integers(1, 9, n).astype(float)
        better = [any((cost[j] <= cost[k] and error[j] <= error[k]
                       and (cost[j], error[j]) != (cost[k], error[k])) for j in range(n))
                  for k in range(n)]
        front = pareto_front(cost, error)
        assert {(cost[k], error[k]) for k in front} == {
            (cost[k], error[k]) for k in range(n) if not better[k]}
        assert all(cost[a] < cost[b] for a, b in itertools.pairwise(front))


def test_cheapest_within_the_goal() -> None:
    assert cheapest([3.0, 1.0, 2.0], [0.01, 1.0, 0.1], 0.1) == 2
    assert cheapest([3.0, 1.0], [0.5, math.nan], 0.1) is None


@pytest.mark.parametrize(("text", "words"), [
    ("rebond:1e-3", "no measure 'rebond'.*did you mean rebound"),
    ("energy_2:1", "no measure 'energy_2'"),
    ("rebound", "MEASURE:TOLERANCE"),
    ("rebound:-1", "above 0"),
    ("rebound:nan", "above 0"),
])
def test_wrong_goals(text: str, words: str) -> None:
    with pytest.raises(StudyError, match=words):
        parse_goals([text])


def study_of(errors: dict[str, tuple[float, float]], limit: float, goal: str,
             *more: str) -> Study:
    """Members `h, initiation`, and what `more` varies, with CPU times and errors of the impulse,
    around a reference of 1."""
    plan = plan_of("h=0.1,0.01", "initiation=ADMISSIBLE,PERSISTENT", *more)
    members = plan.members([], True)
    runs = []
    for member in members:
        cpu, error = errors[" ".join([member.settings["h"], member.settings["initiation"][0],
                                      *(member.settings[knob.split("=")[0]] for knob in more)])]
        runs.append(Run(member, {"cpu": cpu, "verdict": "good"},
                        {"impulse": Measured(np.array([[1.0 + error, 0.0]]), 1.0)}, None))
    right = Run(Member(-1, "file", {}), {}, {"impulse": Measured(np.array([[1.0, 0.0]]), 1.0)},
                None)
    reference = Reference("file", "exact", right, {"impulse": Limit(limit, 1.0)})
    return Study(plan, members, {}, runs, [reference], parse_goals([goal]), "")


ERRORS = {"0.1 A": (1.0, 0.04), "0.1 P": (2.0, 0.2), "0.01 A": (10.0, 0.01), "0.01 P": (12.0, 0.02)}


def test_the_knobs_that_pay_are_named() -> None:
    study = study_of(ERRORS, 0.005, "impulse:0.05")
    words = goal_words(study, study.references[0], study.goals)
    assert "the cheapest setting is h=0.1, initiation=ADMISSIBLE: 1 s, impulse to 4.5e-02" in words
    assert "12 times cheaper than the deck's own (h=0.01, initiation=PERSISTENT, 12 s)" in words
    assert "h=0.1 alone: 6 times, and the goal is not met" in words
    assert ("; initiation=ADMISSIBLE alone: 1.2 times; with h alone the deck's own meets the goal "
            "at h=0.01, for 12 times the time") in words
    assert goals_met(study)


def test_what_the_own_treatment_needs() -> None:
    """The chosen one against the deck's own: at the step that it needs, or at none that was tried."""
    near = {**ERRORS, "0.1 P": (2.0, 0.04), "0.01 P": (12.0, 0.2)}
    study = study_of(near, 0.005, "impulse:0.05")
    words = goal_words(study, study.references[0], study.goals)
    assert words.endswith("with h alone the deck's own meets the goal at h=0.1, for 2 times the time")
    far = {**ERRORS, "0.01 P": (12.0, 0.2)}
    study = study_of(far, 0.005, "impulse:0.05")
    words = goal_words(study, study.references[0], study.goals)
    assert words.endswith("with h alone the deck's own does not meet the goal down to h=0.01, "
                          "for 12 times the time")


@pytest.mark.parametrize(("last", "words"), [
    (0.04, "meets the goal at mesh=2, h=0.01, for 40 times the time"),
    (0.2, "does not meet the goal down to mesh=2, h=0.01, for 40 times the time")])
def test_a_finer_mesh_is_no_other_treatment(last: float, words: str) -> None:
    """What the deck's own needs is looked for at all steps and meshes."""
    errors = {f"{key} {mesh}": (4*cpu if mesh == 2 else cpu, 0.2) for key, (cpu, _) in
              ERRORS.items() for mesh in (1, 2)}
    errors.update({"0.1 A 1": (1.2, 0.01), "0.01 P 2": (48.0, last)})
    study = study_of(errors, 0.005, "impulse:0.05", "mesh=1,2")
    found = goal_words(study, study.references[0], study.goals)
    assert found.endswith(f"with mesh and h alone the deck's own {words}")


def test_figures_mark_the_front_the_floor_and_the_goal() -> None:
    study = study_of(ERRORS, 0.02, "impulse:0.05")
    axes = Figure().subplots()
    _draw_work(axes, study, study.references[0], "impulse")
    drawn = {artist.get_label(): artist for artist in (*axes.lines, *axes.patches)}
    floor = drawn["reference not certain"].get_extents().transformed(axes.transData.inverted())
    assert floor.y1 == pytest.approx(0.02, rel=1e-12) and floor.y0 < 0.003
    # 1 s for 0.04, 10 s for 0.01; what is dearer and worse is not on it
    assert drawn["Pareto front"].get_xydata() == pytest.approx(np.array([[1.0, 0.04],
                                                                         [10.0, 0.01]]))
    assert list(drawn["goal"].get_ydata()) == [0.05, 0.05]


@pytest.mark.parametrize("length", [1.8, 4.5, 7.9, 12.0, 49.0, 1e4])
def test_numbers_of_figures_do_not_overlap(length: float) -> None:
    """In a panel of its size, from any cost on."""
    for cheapest in (0.107, 0.3, 0.9, 2.2):
        costs = cheapest*length**np.linspace(0.0, 1.0, len(ERRORS))
        errors = {name: (float(cost), error) for cost, (name, (_, error)) in zip(costs, ERRORS.items(), strict=True)}
        check_numbers(study_of(errors, 0.02, "impulse:0.05"))


def check_numbers(study: Study) -> None:
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH/3, 3.3))
        axes = figure.subplots()
        figure.subplots_adjust(left=0.8/(WIDTH/3), right=1 - 0.25/(WIDTH/3))
        _draw_work(axes, study, study.references[0], "impulse")
        figure.canvas.draw()
        low, high = axes.get_xlim()
        boxes = [label.get_window_extent() for tick, label in zip(axes.get_xticks(), axes.get_xticklabels())
                 if low <= tick <= high]
        boxes += [label.get_window_extent() for label in axes.get_xticklabels(minor=True) if label.get_text()]
        assert len(boxes) >= 2
        boxes.sort(key=lambda box: box.x0)
        assert all(a.x1 < b.x0 for a, b in itertools.pairwise(boxes))


@pytest.mark.parametrize("tolerance", ["1e-6", "10"])
def test_figures_reach_to_a_goal_far_from_all_errors(tolerance: str) -> None:
    study = study_of(ERRORS, 0.02, f"impulse:{tolerance}")
    axes = Figure().subplots()
    _draw_work(axes, study, study.references[0], "impulse")
    low, high = axes.get_ylim()
    assert low < float(tolerance) < high
    assert low < 0.01 and high > 0.04


def test_the_price_may_leave_out_the_start() -> None:
    """Of two settings that meet the goal, by one the whole process is cheaper, by the other the
    increments."""
    plain = study_of({**ERRORS, "0.01 A": (1.5, 0.01)}, 0.005, "impulse:0.05")
    for run, parts in zip(plain.runs, (0.8, 1.0, 0.5, 11.0), strict=True):
        run.record["increments_cpu"] = parts
    words = goal_words(plain, plain.references[0], plain.goals)
    assert "h=0.1, initiation=ADMISSIBLE: 1 s" in words and "12 times cheaper" in words
    study = dataclasses.replace(plain, cost="increments")
    words = goal_words(study, study.references[0], study.goals)
    assert "h=0.01, initiation=ADMISSIBLE: 0.5 s" in words and "22 times cheaper" in words


def test_each_knob_of_the_choice_is_asked_for_alone() -> None:
    study = study_of(ERRORS, 0.005, "impulse:0.05")
    assert missing_knobs(study) == []                    # the grid has them
    few = [m for m in study.members if m.settings["h"] == "0.1"
           and m.settings["initiation"] == "ADMISSIBLE"]
    runs = [run for run in study.runs if run.member in few]
    lone = Study(study.plan, few, {}, runs, study.references, study.goals, "")
    assert missing_knobs(lone) == [{"h": "0.1", "initiation": "PERSISTENT"},
                                   {"h": "0.01", "initiation": "ADMISSIBLE"}]


def test_a_dearer_setting_is_called_so() -> None:
    """The deck's own is cheaper, but does not meet the goal."""
    errors = {**ERRORS, "0.01 P": (5.0, 0.2), "0.1 A": (1.0, 0.2)}
    study = study_of(errors, 0.005, "impulse:0.05")
    words = goal_words(study, study.references[0], study.goals)
    assert "h=0.01, initiation=ADMISSIBLE: 10 s" in words
    assert ("2 times dearer than the deck's own (h=0.01, initiation=PERSISTENT, 5 s, and the goal "
            "is not met)") in words


def test_what_the_reference_is_not_certain_of_counts() -> None:
    """An error of 0.04 is not known to be below 0.05 by a reference that may err by 0.02."""
    study = study_of(ERRORS, 0.02, "impulse:0.05")
    words = goal_words(study, study.references[0], study.goals)
    assert "the cheapest setting is h=0.01, initiation=ADMISSIBLE" in words
    study = study_of(ERRORS, 0.1, "impulse:0.05")
    words = goal_words(study, study.references[0], study.goals)
    assert "not met. The best, h=0.01, initiation=ADMISSIBLE, comes to impulse 1.1e-01" in words
    assert "2.2 times the goal" in words and "uncertainty of the reference is larger than the goal in impulse" in words
    assert not goals_met(study)


# --- measures ----------------------------------------------------------------------------------

def history(times: np.ndarray, **columns: np.ndarray) -> np.ndarray:
    names = ["time", "kinetic", "strain", "external_work", "total", "px", "py", "lz",
             *(f"pair1_{what}" for what in ("force_x", "force_y", "impulse_x", "impulse_y",
                                            "duration", "active")), *columns]
    table = np.zeros(len(times), dtype=[(name, float) for name in dict.fromkeys(names)])
    table["time"] = times
    for name, values in columns.items():
        table[name] = values
    return table


def test_windows_do_not_see_the_increments() -> None:
    """Means of cos(t) over windows are differences of sin, on any grid that has their ends."""
    ends = np.linspace(0.0, 3.0, 11)
    coarse = ends
    fine = np.union1d(np.linspace(0.0, 3.0, 371), ends)
    expected = np.diff(np.sin(ends))/np.diff(ends)
    for times in (coarse, fine):
        found = windowed(times, np.sin(times)[:, None, None], 10)[:, 0, 0]
        assert np.abs(found - expected).max() < 64*EPSILON


def test_pairs_of_a_comb() -> None:
    """A force of 0, 2, 0, 2 beside means of neighbours: 2 everywhere, over the rms of force."""
    n = 101
    times = np.linspace(0.0, 1.0, n)
    force = np.where(np.arange(n) % 2 == 0, 2.0, 0.0)
    force[0] = 0.0
    table = history(times, pair1_force_y=force, pair1_active=(force > 0).astype(float),
                    pair1_impulse_y=np.cumsum(force)*0.01, pair1_duration=np.full(n, 0.5))
    found = _of_pairs(table, 10)
    inner = n - 3                                        # increments with two neighbours
    assert found["scatter"].rows[0, 0] == pytest.approx(
        math.sqrt(inner*4.0/(force**2).sum()), rel=1e-14)
    assert found["switches"].rows[0, 0] == n - 2
    assert found["impulse"].rows[0].tolist() == [0.0, pytest.approx(1.0, rel=1e-13)]
    assert found["peak_force"].rows[0, 0] == 2.0 and found["duration"].rows[0, 0] == 0.5
    assert np.allclose(found["force"].rows[0][1::2], 1.0, rtol=0.0, atol=1e-13)
    straight = history(times, pair1_force_y=1.0 + times)
    assert _of_pairs(straight, 10)["scatter"].rows[0, 0] < 16*EPSILON


def test_energy_and_momenta() -> None:
    times = np.linspace(0.0, 1.0, 5)
    found = _of_history(history(times, kinetic=np.array([4.0, 3, 2, 1, 2]),
                                total=np.array([4.0, 4.0, 3.5, 4.0, 4.0]),
                                px=np.array([0.0, 3, 0, 0, 0]), py=np.array([0.0, 4, 0, 0, 1])))
    assert found["energy"].rows[0, 0] == 0.5/4.0
    assert found["momentum"].rows.tolist() == [[0.0, 1.0]] and found["momentum"].size == 5.0


def fields_of(mesh: object) -> SimpleNamespace:
    """As a file of results has them, of meshes of linear elements and of quadratic ones of space."""
    cells = [row for kind in mesh.elements for row in mesh.connectivity(kind)]
    n_dim = mesh.nodes.shape[1]
    type_of = {(2, 3): 5, (2, 4): 9, (3, 4): 10, (3, 8): 12, (3, 10): 24, (3, 20): 25}
    return SimpleNamespace(points=np.column_stack([mesh.nodes, np.zeros((len(mesh.nodes), 3 - n_dim))]),
                           cells=cells, n_dim=n_dim,
                           types=np.array([type_of[n_dim, len(cell)] for cell in cells]))


def test_centre_and_inertia_of_a_rectangle() -> None:
    """m (a^2 + b^2)/12 of a rectangle, moved and turned; of any mesh of it, far from 0."""
    mesh = refine(block((1e3, 2e3), (3.0, 1.0), (2, 2))) + block((0.0, 0.0), (1.0, 1.0), (1, 1),
                                                                 "SECOND")
    body = np.array([0]*25 + [1]*4)
    found = body_geometry(fields_of(mesh), body, None, np.array([6.0, 2.0]))
    assert found.centre[0] == pytest.approx([1001.5, 2000.5], rel=4*EPSILON)
    # products of lengths, of positions that are rounded by epsilon of a thousand
    assert found.inertia == pytest.approx([6.0*10.0/12.0, 2.0*2.0/12.0], rel=1e3*64*EPSILON)
    c, s = math.cos(0.7), math.sin(0.7)
    x = mesh.nodes
    u = (x - x[0]) @ np.array([[c, s], [-s, c]]) - (x - x[0])
    turned = body_geometry(fields_of(mesh), body, u, np.array([6.0, 2.0]))
    assert turned.inertia == pytest.approx(found.inertia, rel=1e4*64*EPSILON)


def test_triangles_and_quadrilaterals_have_one_inertia() -> None:
    quads = block((0.0, 0.0), (3.0, 2.0), (1, 1))
    corner = quads.connectivity("CPE4")[0]
    split = SimpleNamespace(points=fields_of(quads).points, n_dim=2, types=np.array([5, 5]),
                            cells=[corner[[0, 1, 2]], corner[[0, 2, 3]]])
    body = np.zeros(4, dtype=int)
    one, other = (body_geometry(f, body, None, np.ones(1)) for f in (fields_of(quads), split))
    assert one.inertia == pytest.approx(13.0/12.0, rel=16*EPSILON)
    assert other.inertia == pytest.approx(13.0/12.0, rel=16*EPSILON)


@pytest.mark.parametrize("kind", ["C3D4", "C3D8", "C3D10", "C3D20"])
def test_inertia_of_a_box(kind: str) -> None:
    """m (b^2 + c^2)/12 about each axis, also turned, of all kinds of elements."""
    mesh = block((1.0, 2.0, 3.0), (3.0, 1.0, 2.0), (2, 1, 2), kind=kind)
    fields, body = fields_of(mesh), np.zeros(len(mesh.nodes), dtype=int)
    found = body_geometry(fields, body, None, np.array([6.0]))
    exact = 0.5*np.diag([1.0 + 4.0, 9.0 + 4.0, 9.0 + 1.0])
    assert found.centre[0] == pytest.approx([2.5, 2.5, 4.0], rel=64*EPSILON)
    assert found.inertia[0] == pytest.approx(exact, abs=1e3*EPSILON)
    turn = np.array([[0.0, -1.0, 0.0], [0.8, 0.0, -0.6], [0.6, 0.0, 0.8]])
    turned = body_geometry(fields, body, mesh.nodes @ turn.T - mesh.nodes, np.array([6.0]))
    assert turned.inertia[0] == pytest.approx(turn @ exact @ turn.T, abs=1e3*EPSILON)


def test_energy_of_a_rigid_motion_in_space() -> None:
    """1/2 m v^2 + 1/2 w I w, of a moment about the origin."""
    mass, v, w, c = 4.0, np.array([2.0, -1.0, 3.0]), np.array([1.0, 2.0, -1.0]), np.array([5.0, 7.0, -2.0])
    inertia = np.array([[2.0, 0.3, 0.0], [0.3, 1.0, -0.2], [0.0, -0.2, 3.0]])
    p = mass*v
    lx, ly, lz = inertia @ w + np.cross(c, p)
    at = SimpleNamespace(centre=c[None], inertia=inertia[None])
    bodies = Bodies(np.array([mass]), *(np.array([[a]]) for a in (p[0], p[1], lz, p[2], lx, ly)))
    assert rigid_energy(bodies, 0, at)[0] == pytest.approx(0.5*mass*v @ v + 0.5*w @ inertia @ w,
                                                           rel=64*EPSILON)


def test_inertia_of_a_disc_of_chords() -> None:
    """The polygon of n corners on a circle: m r^2/6 (2 + cos(2 pi/n)); a disc in the limit."""
    mesh = disc((0.0, 0.0), 2.0, (6, 3))
    n = len(mesh.surfaces["DISC_RIM"])
    found = body_geometry(fields_of(mesh), np.zeros(len(mesh.nodes), dtype=int), None,
                          np.ones(1))
    assert found.inertia[0] == pytest.approx(4.0/6.0*(2.0 + math.cos(2.0*math.pi/n)), rel=1e-13)


def test_a_body_without_mass_has_no_velocity(tmp_path: Path) -> None:
    """A profile, say: the other body is measured all the same."""
    paths = ResultPaths(tmp_path/"run")
    with h5py.File(paths.history, "w") as file:
        file["sets/BODIES/MASS"] = np.array([[2.0, 0.0]])
        file["sets/BODIES/MOMENTUM"] = np.array([[[6.0, 8.0, 1.0], [0.0, 0.0, 0.0]]]*3)
    bodies = read_bodies(paths)
    assert bodies is not None and bodies.main() == 0
    p = np.stack([bodies.px, bodies.py], axis=2)
    assert np.array_equal(_per_mass(p, bodies.mass[:, None])[-1], [[3.0, 4.0], [0.0, 0.0]])
    with h5py.File(paths.history, "a") as file:
        file["sets/BODIES/MASS"][...] = [[-2.0, 1.0]]
    assert read_bodies(paths) is None


def test_energy_of_a_rigid_motion() -> None:
    """v = (2, -1), spin 3 about the centre at (5, 7): 1/2 m v^2 + 1/2 I w^2."""
    mass, inertia = 4.0, 0.5
    p = mass*np.array([2.0, -1.0])
    spin = inertia*3.0 + 5.0*p[1] - 7.0*p[0]
    bodies = Bodies(np.array([mass]), p[None, :1], p[None, 1:], np.array([[spin]]))
    at = SimpleNamespace(centre=np.array([[5.0, 7.0]]), inertia=np.array([inertia]))
    assert rigid_energy(bodies, 0, at)[0] == pytest.approx(0.5*4*5 + 0.5*0.5*9, rel=64*EPSILON)


# --- plans -------------------------------------------------------------------------------------

PARAMETERS = {"h": "0.01", "t_end": "8", "initiation": "PERSISTENT"}


def plan_of(*vary: str, **fixed: str) -> object:
    return make_plan(parse_vary(vary), fixed, PARAMETERS, "h")


def test_members_are_the_grid_with_the_default() -> None:
    plan = plan_of("h=0.2,0.1", "initiation=ADMISSIBLE,PERSISTENT", t_end="1")
    members = plan.members(["finest"], True)
    assert [m.role for m in members] == ["member"]*4 + ["default"]
    assert members[-1].settings == {"h": "0.01", "initiation": "PERSISTENT", "t_end": "1"}
    assert len({m.key for m in members}) == 5
    assert plan_of("h=0.02,1e-2").members(["finest"], True)[-1].role == "member"


def test_the_own_treatment_is_run_at_all_steps() -> None:
    members = plan_of("h=0.2,0.1", "initiation=ADMISSIBLE").members([], True)
    assert [(m.role, *m.settings.values()) for m in members] == [
        ("member", "0.2", "ADMISSIBLE"), ("member", "0.1", "ADMISSIBLE"),
        ("default", "0.2", "PERSISTENT"), ("default", "0.1", "PERSISTENT"),
        ("default", "0.01", "PERSISTENT")]


def test_refined_mesh_asks_for_one_more() -> None:
    members = plan_of("h=0.2,0.1").members(["refined-mesh"], False)
    assert [(m.role, m.settings.get("mesh")) for m in members] == [
        ("member", None), ("member", None), ("reference", "2")]
    assert members[-1].settings["h"] == "0.1"
    two = plan_of("h=0.2,0.1", "mesh=1,2").members(["refined-mesh"], False)
    assert [m.settings["mesh"] for m in two if m.role == "reference"] == ["4"]


def test_a_member_keeps_its_folder_when_a_study_grows() -> None:
    few, many = plan_of("h=0.2,0.1"), plan_of("h=0.4,0.2,0.1")
    keys = [{m.settings["h"]: m.key for m in plan.members([], False)} for plan in (few, many)]
    assert keys[0].items() <= keys[1].items()


@pytest.mark.parametrize(("vary", "fixed", "words"), [
    (["hh=1,2"], {}, "no knob 'hh'.*h, t_end, initiation, and mesh, threads, deck, precision; did you mean h"),
    (["h=0.1,x"], {}, "numbers above 0"),
    (["h=0.1,0"], {}, "numbers above 0"),
    (["h=0.1,,2"], {}, "a value is empty"),
    (["h"], {}, "give --vary NAME=VALUE"),
    (["h=1", "h=2"], {}, "there twice"),
    (["h=1"], {"h": "2"}, "varied and set"),
    (["mesh=1,3"], {}, "cutting edges in half"),
    (["threads=0"], {}, "whole numbers above 0"),
    (["precision=half"], {}, "known are double, single, quad"),
])
def test_wrong_plans(vary: list[str], fixed: dict[str, str], words: str) -> None:
    with pytest.raises(StudyError, match=words):
        plan_of(*vary, **fixed)


def test_the_manifest_is_read_as_it_was_written(tmp_path: Path) -> None:
    plan = plan_of("h=0.2,0.1", "initiation=VELOCITY UPDATE,PERSISTENT", t_end="1")
    members = plan.members(["refined-mesh"], True)
    write_manifest(tmp_path/"manifest.csv", members, plan.knobs)
    assert read_manifest(tmp_path/"manifest.csv") == members


# --- decks -------------------------------------------------------------------------------------

def test_parameters_and_checksum_know_included_files(tmp_path: Path) -> None:
    (tmp_path/"inner.inp").write_text("*PARAMETER\nH = 0.1 # size\nword = 'A B'\n")
    (tmp_path/"deck.inp").write_text("*PARAMETER\nt_end=1\n*Include, input=inner.inp\n")
    deck = read_deck(tmp_path/"deck.inp")
    assert deck.parameters() == {"t_end": "1", "h": "0.1", "word": "A B"}
    (tmp_path/"inner.inp").write_text("*PARAMETER\nH = 0.2\n")
    assert read_deck(tmp_path/"deck.inp").checksum != deck.checksum
    (tmp_path/"inner.inp").unlink()
    with pytest.raises(StudyError, match=r"cannot read .*inner.inp"):
        read_deck(tmp_path/"deck.inp")


MESH = """*NODE, NSET=ALL
1, 0, 0
2, 1, 0
3, 1, 1
4, 0, 1
*NODE
99, 5, 5
*ELEMENT, TYPE=CPE4, ELSET=BODY
1, 1, 2, 3, 4
*NSET, NSET=FOOT
1, 2
"""


@pytest.mark.parametrize(("card", "words"), [
    ("*CLOAD\nFOOT, 2, 1.\n", "CLOAD: the values on the set FOOT"),
    ("*EQUATION\n2\nFOOT, 1, 1., 3, 1, -1.\n", "EQUATION"),
    ("*DLOAD\n1, GRAV, 1., 0., -1., 0.\n", "element 1 is cut in parts"),
    ("*INITIAL CONDITIONS, TYPE=VELOCITY\n3, 1, 1.\n", "node 3 is named by its label"),
])
def test_what_a_finer_mesh_would_change_is_refused(card: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(StudyError, match=words):
        refined_deck(DeckFile(Path("deck.inp"), MESH + card), 1, tmp_path/"scratch.inp")


def test_pressure_stays_on_its_face(tmp_path: Path) -> None:
    text = refined_deck(DeckFile(Path("deck.inp"), MESH + "*DLOAD\nBODY, P3, 2.\n"), 1,
                        tmp_path/"scratch.inp")
    assert "BODY_P3_PARTS, P3, 2." in text and "99, 5.0, 5.0" in text
    assert not (tmp_path/"scratch.inp").exists()
    (tmp_path/"fine.inp").write_text(text)
    from emcon.mesh import MeshWarning, read
    with pytest.warns(MeshWarning):
        fine = read(tmp_path/"fine.inp")
    wanted = set(fine.element_sets["BODY_P3_PARTS"].tolist())
    assert wanted == {int(e) for e, f in fine.boundary(lambda x, y: y == 1.0)}


# --- the bar -----------------------------------------------------------------------------------

def test_the_bar_is_for_terminals() -> None:
    assert bar_text(4, 1, 10, 12.3, 10) == "[####......] 4 of 10, 1 failed, 12 s"
    for is_terminal in (False, True):
        out = io.StringIO()
        out.isatty = lambda known=is_terminal: known
        bar = Progress(2, out)
        bar.show(1, 0)
        bar.end()
        assert bool(out.getvalue()) == is_terminal
