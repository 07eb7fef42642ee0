"""Corners of amplitudes are points of the grid of automatic increments; a run that crawls ends."""

import re

import numpy as np
import pytest
from scene_tools import EPSILON, Deck, emcon, run_deck

#: A column of two elements with nu = 0, its end driven: a spring of stiffness E A/L = 500.
COLUMN = """*NODE
1, 0., 0.
2, 0., 1.
3, 1., 0.
4, 1., 1.
5, 2., 0.
6, 2., 1.
*ELEMENT, TYPE=CPE4, ELSET=BAR
1, 1, 3, 4, 2
2, 3, 5, 6, 4
*NSET, NSET=END
5, 6
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*DENSITY
1.
*SOLID SECTION, ELSET=BAR, MATERIAL=M, KINEMATICS=LINEAR
*AMPLITUDE, NAME=ZIG{total}
{table}
*BOUNDARY
1, 1, 2
2, 1, 2
5, 2
6, 2
{steps}"""
STEP = """*STEP
*{procedure}
{h}, {duration}
*BOUNDARY, AMPLITUDE=ZIG
END, 1, 1, 0.01
*NODE PRINT, NSET=END, TOTALS=ONLY
RF
*END STEP
"""


def times(folder, table, h, duration, procedure="STATIC", total="", n_step=1):
    """Times at which the run is recorded, and the forces of the end there."""
    steps = STEP.format(procedure=procedure, h=h, duration=duration)*n_step
    text = COLUMN.format(table=table, steps=steps, total=total)
    run = run_deck(Deck(text), folder)
    time, force = run.series("END", "TOTAL_RF")
    return time, force[..., 0].ravel()


@pytest.mark.parametrize("corners, h", [((1.0, 3.0, 5.0), 0.5), ((0.3, 1.7, 4.1), 0.5),
                                        ((0.123, 0.9, 0.9001, 6.5), 1.0), ((2.0, 2.5), 7.0)])
def test_increments_end_at_corners(corners, h, tmp_path):
    """Between them lie whole increments, one, two, four ... of them at a time, and a shorter one."""
    values = [(-1)**k for k in range(len(corners))]
    table = "0., 0., " + ", ".join(f"{t}, {a}." for t, a in zip(corners, values, strict=True))
    time, force = times(tmp_path, table, h, 7.0)
    ends = [0.0, *corners, 7.0]
    for begin, end in zip(ends[:-1], ends[1:], strict=True):
        at = np.flatnonzero(np.abs(time - end) <= 8*EPSILON*7.0)
        assert len(at) == 1
        within = time[(time > begin + 1e-9) & (time < end - 1e-9)]
        whole = (within - begin)/h
        assert np.all(np.abs(whole - np.round(whole)) <= 100*EPSILON*7.0/h)
    # Between two of its corners the force is linear, so that what is recorded is the whole path.
    exact = 500*0.01*np.interp(time, [0.0, *corners], [0.0, *values])
    assert np.abs(force - exact).max() <= 1e-9*5.0


def test_grid_with_corners_on_it_is_the_one_without(tmp_path):
    """In dynamics increments are of one size: the same times, to the last bit."""
    corner, _ = times(tmp_path/"a", "0., 0., 0.3, 1., 0.9, 2.", 0.1, 1.0, "DYNAMIC")
    smooth, _ = times(tmp_path/"b", "0., 0., 1., 1.", 0.1, 1.0, "DYNAMIC")
    assert corner.tolist() == smooth.tolist()


def test_points_on_a_line_are_no_corners(tmp_path):
    time, _ = times(tmp_path, "0., 0., 0.21, 0.42, 0.55, 1.1, 2., 4.", 0.25, 1.0, "DYNAMIC")
    assert time == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0], abs=8*EPSILON)


def test_total_time_and_several_steps(tmp_path):
    """A corner at 1.3 of the analysis is one at 0.3 of its second step, and none of the first."""
    time, _ = times(tmp_path, "0., 0., 1.3, 1., 4., 0.", 0.5, 1.0, "DYNAMIC", ", TIME=TOTAL TIME", 2)
    assert np.unique(time) == pytest.approx([0.0, 0.5, 1.0, 1.3, 1.8, 2.0], abs=8*EPSILON)


def test_fixed_increments_pass_over_corners(tmp_path):
    time, _ = times(tmp_path, "0., 0., 0.3, 1., 1., 0.", 0.25, 1.0, "STATIC, DIRECT")
    assert time == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0], abs=8*EPSILON)


#: A square that turns about 380 times, in one increment, and falls on a floor.
CRAWL = """*NODE, NSET=B
1, 0, 0.01
2, 1, 0.01
3, 1, 1.01
4, 0, 1.01
11, -9., -1.
12, 9., -1.
13, 9., 0.
14, -9., 0.
*ELEMENT, TYPE=CPE4, ELSET=BLOCK
1, 1, 2, 3, 4
*ELEMENT, TYPE=CPE4, ELSET=FLOOR
2, 11, 12, 13, 14
*NSET, NSET=FLOOR, ELSET=FLOOR
*SURFACE, NAME=RIM
1, S1
1, S2
1, S3
1, S4
*SURFACE, NAME=TOP
2, S3
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*DENSITY
1.
*SOLID SECTION, ELSET=BLOCK, MATERIAL=M
*SOLID SECTION, ELSET=FLOOR, MATERIAL=M
*SURFACE INTERACTION, NAME=HARD
*CONTACT PAIR, INTERACTION=HARD, TYPE=NODE TO SURFACE, SIDES=ONE
RIM, TOP
*BOUNDARY
FLOOR, 1, 2
*INITIAL CONDITIONS, TYPE=ROTATING VELOCITY
B, 3., 0., 0.
0.5, 0.5
*STEP, NLGEOM
*DYNAMIC
8000., 8000., 0.1
*DLOAD
BLOCK, GRAV, 0.1, 0., -1.
*END STEP
"""


@pytest.mark.long
def test_an_increment_has_at_most_4000_parts(tmp_path):
    """How a square goes on that rolls and rests on its corners hangs on rounding: of four sizes of
    the increment some are tried in too many parts, and say so, the others come to their end."""
    stopped = 0
    for h in (8000, 8100, 8200, 8300):
        deck = Deck(CRAWL.replace("8000.", f"{h}.")).write(tmp_path/f"crawl{h}.inp")
        done = emcon(deck, "--output", tmp_path)
        if "the analysis stops" not in done.stderr:
            assert "NOT COMPLETED" not in done.stdout
            continue
        stopped += 1
        told = re.search(rf"stops at time ([\d.]+): an increment of h = {h} was tried in 4000 parts, the "
                         r"smallest of h = ([\d.]+), and ([\d.]+) % of it is complete; in them contact "
                         r"begins and ends at slave nodes [\d, ]+; give smaller", done.stderr)
        time, least, part = (float(value) for value in told.groups())
        assert done.returncode == 3 and part == pytest.approx(100*time/h, rel=1e-2)
        assert abs(h/least - round(h/least)) < 1e-3*h/least
    assert stopped
