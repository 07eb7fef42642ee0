"""What the panels of pictures show of runs: closed forms, and nothing that hides another."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from embed_tools import ROOT
from matplotlib.figure import Figure

sys.path.insert(0, str(ROOT/"pywrap"))

from emcon import FieldFile, locate, read_history  # noqa: E402
from emcon.panels import PAUSE, means  # noqa: E402
from emcon.plotting import draw  # noqa: E402
from emcon.scene import UNITS, number, scale_ticks  # noqa: E402

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
    """The mean bar times its length is the impulse that the history tells, on the other side."""
    (energy, _, force), base = panels(tmp_path, "sliding_block")
    history = read_history(locate(base))
    bars = [line for line in force.lines if line.get_linewidth() > 2.0]
    impulse = sum(np.ptp(bar.get_xdata())*bar.get_ydata()[0] for bar in bars)
    assert impulse == pytest.approx(-history["pair1_impulse_y"][-1], rel=1e-12)
    total = next(line for line in energy.lines if line.get_label() == "total")
    others = [line for line in energy.lines if line is not total]
    assert total.get_linewidth() > 2.0*max(line.get_linewidth() for line in others)
    assert energy.lines[0] is total             # a band below all others
    assert labels(force) == ("time $t$ [T]", f"contact force, $y$ {UNITS['force']}")


def test_runs_without_contact_show_angular_momentum(tmp_path: Path) -> None:
    (_, _, momentum), base = panels(tmp_path, "tumbling_block", "--set", "t_end=0.5")
    history = read_history(locate(base))
    for name in "xyz":
        line = next(line for line in momentum.lines if line.get_label() == f"$L_{name}$")
        assert np.array_equal(line.get_ydata(), history[f"l{name}"])


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


def test_numbers_in_titles() -> None:
    assert [number(value) for value in (0.0, 1.25, 3e-05)] == ["0", "1.25", r"3\times10^{-5}"]
