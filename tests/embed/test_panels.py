"""What the panels of pictures show of runs: closed forms, and nothing that hides another."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import h5py
import matplotlib
import numpy as np
import pytest
from embed_tools import ROOT
from matplotlib.figure import Figure

sys.path.insert(0, str(ROOT/"pywrap"))

from emcon import FieldFile, locate, read_history  # noqa: E402
from emcon.drawing import DIGIT_WIDTH, InnerLocator, scale_ticks, titles  # noqa: E402
from emcon.panels import (  # noqa: E402
    MOST_STEPS, PARTS, PAUSE, Force, draw_force, means, part_means)
from emcon.plotting import View, draw  # noqa: E402
from emcon.scene import STYLE, UNITS, outer_sides, read_scene  # noqa: E402
from emcon.summary import summary  # noqa: E402

PROGRAM = ROOT/"build"/"release"/"emcon"


def panels(folder: Path, deck: str, *options: str) -> tuple[list, Path]:
    """The three panels of the picture of a run, and its base name."""
    subprocess.run([PROGRAM, ROOT/"input_decks"/f"{deck}.inp", "--quiet", "--output", folder,
                    *options], check=True, timeout=100)
    figure, notes = draw(locate(folder/deck))
    assert not notes
    return [axes for axes in figure.axes if axes.get_position().y1 < 0.55], folder/deck


def labels(axes: object) -> tuple[str, str]:
    return axes.get_xlabel(), axes.get_ylabel()


def test_means_are_impulses_over_times_of_contacts() -> None:
    """Increments of unlike size; a short pause is part of a contact, a long one ends it."""
    times = np.array([0.0, 1.0, 3.0, 3.5, 4.0, 5.0, 9.0, 10.0])
    force = np.array([0.0, 0.0, 2.0, 0.0, 6.0, 0.0, 0.0, 5.0])
    assert 0.5 <= PAUSE*10.0
    assert means(times, force) == [(1.0, 4.0, (2.0*2.0 + 6.0*0.5)/3.0), (9.0, 10.0, 5.0)]
    assert means(times, 0.0*force) == []


def test_statics_show_load_convergence_and_force_of_the_pair(tmp_path: Path) -> None:
    """A patch below a pressure of 10 that follows it: supports bear 10 times its width."""
    (load, solves, force), base = panels(tmp_path, "contact_patch")
    assert labels(load) == ("largest displacement, $y$ [L]",
                            f"force of supports, $y$ {UNITS['force']}")
    u, p = load.lines[0].get_data()
    with FieldFile(base.with_suffix(".vtkhdf")) as file:
        top = file.points[:, 1] == file.points[:, 1].max()
        width = np.ptp((file.points + file.point("displacement", -1))[top, 0])
        assert u[-1] == np.abs(file.point("displacement", -1)[:, 1]).max()
    assert p[-1] == pytest.approx(10.0*width, rel=1e-9) and u[0] == p[0] == 0.0
    told = [np.array(line.split()[9:], dtype=float) for line in
            base.with_suffix(".log").read_text().splitlines()
            if re.match(r"\s+\d+ (\s*[\d.E+-]+){2}(\s+\d+){3}\s", line)]
    shown = [line.get_ydata() for line in solves.lines]
    assert len(told) == len(shown) > 2
    for one, other in zip(told, shown, strict=True):
        assert np.array_equal(np.maximum(one, 1e-17), other)
    places = np.concatenate([line.get_xdata() for line in solves.lines])
    assert len(set(places)) == len(places)      # side by side
    (curve,) = (line for line in force.lines if len(line.get_ydata()) == len(u))
    assert curve.get_ydata()[-1] == pytest.approx(-p[-1], rel=1e-9)
    assert force.get_legend().get_texts()[0].get_text().startswith("on ")


def test_load_is_along_an_axis_that_bears_something(tmp_path: Path) -> None:
    """Supports of the tied patch bear round-off: energies take the place of a load."""
    (first, _, last), _ = panels(tmp_path, "tied_patch")
    assert first.texts and "energy" in last.get_ylabel()


def test_dynamics_show_the_mean_over_a_contact_on_the_master(tmp_path: Path) -> None:
    """The mean bar times its length is the impulse that the history tells, on the other side; with
    friction there is one for each direction."""
    (energy, _, force), base = panels(tmp_path, "sliding_block")
    history = read_history(locate(base))
    bars = [line for line in force.lines if line.get_linewidth() > 2.0]
    impulses = sorted(np.ptp(bar.get_xdata())*bar.get_ydata()[0] for bar in bars)
    told = sorted(-history[f"pair1_impulse_{axis}"][-1] for axis in "xy")
    assert impulses == pytest.approx(told, rel=1e-12)
    total = next(line for line in energy.lines if line.get_label() == "total")
    others = [line for line in energy.lines if line is not total]
    assert total.get_linewidth() > 2.0*max(line.get_linewidth() for line in others)
    assert energy.lines[0] is total             # a band below all others
    assert labels(force) == ("time $t$ [T]", f"contact force {UNITS['force']}")


def test_curves_of_energy_add_up_to_the_band_and_none_lies_on_the_axis(tmp_path: Path) -> None:
    """A bar that falls: its kinetic energy is the work of gravity, which is drawn as taken."""
    (energy, _, _), base = panels(tmp_path, "bouncing_bar", "--set", "t_end=1.5")
    shown = {line.get_label(): np.asarray(line.get_ydata()) for line in energy.lines
             if line.get_label()[0] != "_"}
    total = shown.pop("total")
    most = max(np.abs(values).max() for values in shown.values())
    assert set(shown) == {"kinetic", "strain", "less external work"}
    assert np.abs(sum(shown.values()) - total).max() < 1e-12*most
    low, high = energy.get_ylim()
    assert low < 0.0 < high
    subprocess.run([PROGRAM, ROOT/"input_decks/rigid_bar.inp", "--quiet", "--output", tmp_path],
                   check=True, timeout=100)
    figure, notes = draw(locate(tmp_path/"rigid_bar"))
    assert len(notes) == 1 and "no stress" in notes[0]
    (still,) = (axes for axes in figure.axes if axes.get_ylabel() == f"energy {UNITS['energy']}")
    assert [line.get_label() for line in still.lines if line.get_label()[0] != "_"] == [
        "total", "kinetic"]


def test_many_increments_are_shown_by_means_of_parts(tmp_path: Path) -> None:
    """The curve in front has the impulse of the pale one behind it, part by part."""
    (_, _, force), base = panels(tmp_path, "ring", "--set", "t_end=3")
    history = read_history(locate(base))
    assert len(history) > MOST_STEPS + 1
    (curve,) = force.patches
    values, ends, _ = curve.get_data()
    assert len(values) == PARTS and ends[0] == 0.0 and ends[-1] == history["time"][-1]
    assert np.sum(values*np.diff(ends)) == pytest.approx(-history["pair1_impulse_y"][-1], rel=1e-12)
    pale = next(line for line in force.lines if len(line.get_ydata()) == len(history))
    assert pale.get_alpha() < 0.5 and np.array_equal(pale.get_ydata(), -history["pair1_force_y"])
    times = np.linspace(0.0, 1.0, 2*PARTS + 1)
    force = np.tile([1.0, 5.0], PARTS)
    assert part_means(times, np.append(7.0, force))[1] == pytest.approx(3.0*np.ones(PARTS))


def test_runs_without_contact_show_that_angular_momentum_is_kept(tmp_path: Path) -> None:
    (_, _, momentum), base = panels(tmp_path, "tumbling_block", "--set", "t_end=0.5")
    history = read_history(locate(base))
    vector = np.array([history[f"l{name}"] for name in "xyz"])
    told = np.sqrt(((vector - vector[:, :1])**2).sum(axis=0)/(vector**2).sum(axis=0).max())
    assert np.maximum(told, 1e-17) == pytest.approx(momentum.lines[0].get_ydata(), rel=1e-9)
    assert momentum.get_yscale() == "log" and "$|L - L_0|" in momentum.get_ylabel()


def test_angular_momentum_that_changes_is_a_curve_for_each_axis() -> None:
    from emcon.panels import draw_momentum

    history = np.zeros(3, dtype=[("time", float), ("lx", float), ("ly", float), ("lz", float)])
    history["time"], history["ly"] = [0.0, 1.0, 2.0], [1.0, 2.0, 4.0]
    axes = Figure().add_subplot()
    draw_momentum(axes, history)
    for name in "xyz":
        line = next(line for line in axes.lines if line.get_label() == f"$L_{name}$")
        assert np.array_equal(line.get_ydata(), history[f"l{name}"])
    assert axes.get_ylim()[0] < 0.0 and axes.get_ylim()[1] > 4.0


def test_what_surfaces_have_is_shown_on_their_sides(tmp_path: Path) -> None:
    """Each node has its own value on both halves beside it: the largest pressure is in the picture,
    shear has two signs, states have words."""
    _, base = panels(tmp_path, "sliding_block")
    with FieldFile(base.with_suffix(".vtkhdf")) as file:
        last = len(file.times) - 1
        place = file.points + file.point("displacement", last)
        for name in ("contact_pressure", "contact_shear", "contact_status"):
            figure, _ = draw(locate(base), View(frame=-1, field=name))
            (axes,) = (axes for axes in figure.axes if axes.get_title())
            lines = next(part for part in axes.collections if part.get_array() is not None)
            told = file.point(name, last)
            on_slave = np.flatnonzero(np.isfinite(file.point("contact_gap", last)))
            assert set(lines.get_array()) == set(told[on_slave]) != {0.0}
            assert len(lines.get_segments()) == 2*(len(on_slave) - 1)
            for (start, _), value in zip(lines.get_segments(), lines.get_array(), strict=True):
                nearest = np.argmin(np.hypot(*(place[on_slave, :2] - start).T))
                assert value == told[on_slave[nearest]]
            low, top = lines.get_clim()
            assert low == -top if name == "contact_shear" else low <= 0.0 < top
        bar = figure.axes[1]
        assert [text.get_text() for text in bar.get_yticklabels()] == ["none", "sticks", "slides"]


def test_a_gap_of_round_off_has_no_colours(tmp_path: Path) -> None:
    _, base = panels(tmp_path, "sliding_block")
    with h5py.File(base.with_suffix(".vtkhdf"), "r+") as file:
        file["VTKHDF/PointData/contact_gap"][...] += 1e-16
    figure, _ = draw(locate(base), View(frame=-1, field="contact_gap"))
    (axes,) = (axes for axes in figure.axes if axes.get_title())
    lines = next(part for part in axes.collections if part.get_array() is not None)
    assert 0.0 < np.abs(lines.get_array()).max() < 1e-15 and lines.get_clim() == (0.0, 1.0)


def test_walls_without_elements_are_drawn(tmp_path: Path) -> None:
    """The profile of the wall goes through the picture, along y = 0, where the bar turns back."""
    _, base = panels(tmp_path, "bar_on_wall")
    figure, _ = draw(locate(base))
    scenes = [axes for axes in figure.axes if axes.get_title()]
    for axes in scenes:
        ends = [segment for part in axes.collections[:1] for segment in part.get_segments()]
        assert len(ends) == 1 and np.all(ends[0][:, 1] == 0.0)
        assert axes.get_ylim()[0] < 0.0
        assert ends[0][:, 0].min() < axes.get_xlim()[0] and ends[0][:, 0].max() > axes.get_xlim()[1]
    with FieldFile(base.with_suffix(".vtkhdf")) as file:
        assert len(file.profiles) == 1 and len(file.cells) == 40
        assert file["strain_energy"].shape == (len(file.times), 40)
        energy = np.array([file.cell("strain_energy", k).sum() for k in range(len(file.times))])
        history = read_history(locate(base))
        told = np.interp(file.times, history["time"], history["strain"])
        assert energy == pytest.approx(told, rel=1e-9, abs=1e-9*told.max())


def test_windows_stand_still_with_a_body_at_rest(tmp_path: Path) -> None:
    """The ring flies over twice its width along the foundation; alone it is followed."""
    _, base = panels(tmp_path, "ring", "--set", "h=0.05")
    with FieldFile(base.with_suffix(".vtkhdf")) as file:
        scene = read_scene(file, range(0, len(file.times), 20))
    assert scene.is_support.any() and len(set(scene.views())) == 1
    scene.is_support[:] = False
    scene.cells = scene.cells[:256]                    # the elements of the ring
    for position in scene.position:
        position[scene.starts().max() + 1:] = position[0]
    assert len(set(scene.views())) > 1


@pytest.mark.parametrize("count", [1, 3, 6, 40])
def test_legends_stay_within_their_panel(count: int) -> None:
    """As wide as the axes at most, three rows; both names that differ along the axis alone."""
    times = np.array([0.0, 1.0, 2.0])
    curves = {f"on A_SURFACE_OF_A_LONG_NAME_{k}, ${axis}$": np.array([0.0, k + 1.0, 0.0])
              for k in range(count) for axis in "xy"}
    with matplotlib.rc_context(STYLE):
        figure = Figure((11.0, 4.0))
        axes = figure.add_axes((0.1, 0.1, 0.28, 0.5))
        draw_force(axes, Force(times, curves, has_means=True))
        legend, panel = axes.get_legend(), axes.get_window_extent()
        box = legend.get_window_extent()
    assert box.x1 <= panel.x1 and box.x0 >= panel.x0 - 0.05*panel.width
    assert box.height <= 0.62*figure.dpi
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts[0] == "on A_SURFACE_…, $x$" and texts[2] == "on A_SURFACE_…, $y$"
    assert (len(texts) == 2*count + 1) or texts[-1] == f"and {2*count + 2 - len(texts)} more"


def test_outer_sides_are_those_of_one_element() -> None:
    cells = [np.array([0, 1, 2, 3]), np.array([1, 4, 2])]
    assert {frozenset(map(int, side)) for side in outer_sides(cells)} == {
        frozenset(pair) for pair in ((0, 1), (2, 3), (3, 0), (1, 4), (4, 2))}


@pytest.mark.parametrize(("low", "high", "length"),
                         [(0.0, 10.0, 1.5), (-14.0, 11.2, 1.5), (7.8, 14.2, 1.3), (-107.0, 107.0, 1.7),
                          (-0.045, 0.055, 1.3), (-1.0, 1.0, 6.0)])
def test_numbers_below_a_panel_stay_there_and_apart(low: float, high: float,
                                                    length: float) -> None:
    ticks = InnerLocator(length, 3, is_along=True).tick_values(low, high)
    place = (ticks - low)/(high - low)*length
    half = np.array([0.5*DIGIT_WIDTH*len(f"{tick:.4g}") for tick in ticks])
    assert 1 <= len(ticks) <= 9 and (place >= half).all() and (place <= length - half).all()
    assert (np.diff(place) > half[1:] + half[:-1]).all()


@pytest.mark.parametrize(("largest", "power", "shown"),
                         [(1.6e-4, -6, "20"), (4.5e8, 6, "20"), (20.0, 0, None)])
def test_powers_of_ten_are_in_the_unit(largest: float, power: int, shown: str | None) -> None:
    axes = Figure().add_subplot()
    axes.plot([0.0, largest], [0.0, 1.0])
    axes.set_xlim(0.0, largest)
    axes.set_xlabel("time $t$ [T]")
    scale_ticks(axes.xaxis)
    if shown is None:
        assert axes.get_xlabel() == "time $t$ [T]"
    else:
        assert axes.get_xlabel() == f"time $t$ [10$^{{{power}}}$ T]"
        assert axes.xaxis.get_major_formatter()(20.0*10.0**power) == shown
        assert axes.xaxis.get_major_formatter()(-20.0*10.0**power) == "\N{MINUS SIGN}20"


def test_titles_share_a_power_of_ten() -> None:
    assert titles([0.0, 1.25]) == ["$t = 0$", "$t = 1.25$"]
    assert titles([0.0, 3e-05, 1.3e-4]) == ["$t = 0$", r"$t = 30\times10^{-6}$",
                                            r"$t = 130\times10^{-6}$"]


def test_curves_of_many_pairs_differ() -> None:
    """More pairs than colours: no two curves have both colour and style in common."""
    curves = {f"on S{k}": np.array([0.0, k + 1.0, 0.0]) for k in range(12)}
    axes = Figure().add_subplot()
    draw_force(axes, Force(np.array([0.0, 1.0, 2.0]), curves))
    drawn = {(line.get_color(), line.get_linestyle()) for line in axes.lines if line.get_label()[0] != "_"}
    assert len(drawn) == len(curves)


def test_many_curves_give_way_to_lengths_of_forces(tmp_path: Path) -> None:
    """Friction on many pairs: a curve each, no more than colours, and the number of the others."""
    subprocess.run([PROGRAM, ROOT/"input_decks"/"dominoes.inp", "--quiet", "--output", tmp_path,
                    "--set", "t_end=0.3"], check=True, timeout=100)
    paths = locate(tmp_path/"dominoes")
    force = draw(paths)[0].axes[-1]
    names = [text.get_text() for text in force.get_legend().get_texts()]
    history = read_history(paths)
    count = sum(name.endswith("_active") for name in history.dtype.names if name.startswith("pair"))
    length = [np.linalg.norm([history[f"pair{k}_force_{axis}"] for axis in "xyz"], axis=0)
              for k in range(1, count + 1)]
    drawn = [line.get_ydata() for line in force.lines if len(line.get_ydata()) == len(history)]
    largest = sorted(length, key=lambda values: -values.max())[:5]
    assert count > 5 and len(drawn) == 5 and names[-1] == f"{count - 5} smaller"
    assert all(any(np.array_equal(one, other) for other in length) for one in drawn)
    assert [one.max() for one in drawn] == [one.max() for one in largest]
    assert labels(force)[1] == f"contact force $|F|$ {UNITS['force']}"


def test_pairs_with_one_master_have_names_of_their_own(tmp_path: Path) -> None:
    (*_, force), _ = panels(tmp_path, "ball_in_bowl", "--set", "t_end=0.1")
    shown = {text.get_text() for text in force.get_legend().get_texts()}
    assert {"by SKIN_ONE", "by SKIN_TWO"} <= shown and "on BOWL" not in shown


def test_summary_tells_what_friction_took(tmp_path: Path) -> None:
    """What was kinetic is lost by friction, but for what is left in the block; losses that are 0 are not told."""
    _, run = panels(tmp_path, "sliding_block")
    rows = dict(re.findall(r"^  (\S.*?)  +\S+ +(\S+)$", summary(locate(run)), re.MULTILINE))
    history = read_history(locate(run))
    assert float(rows["lost by friction"]) == pytest.approx(history["friction_loss"][-1], rel=1e-9)
    assert history["friction_loss"][-1] > 3.9 and "lost by the scheme" not in rows
