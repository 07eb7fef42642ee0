"""Statics of bodies that contact alone holds: solved, or refused with body and motion named."""

import json
import math

import numpy as np
import pytest
from plain_scenes import Scene

from scene_tools import run_deck

E, NU, FORCE = 1000.0, 0.3, 1.0
FORMULATIONS = [
    ("NODE TO SURFACE", "STANDARD"),
    ("SEGMENT", "STANDARD"),
    ("SEGMENT", "DUAL"),
    ("MORTAR", "STANDARD"),
    ("MORTAR", "DUAL"),
]
#: Newton's method ends at 1e-10 of the forces; of displacements some of that is left.
ACCURACY = 1e-9
GAPS = [0.0, 1e-9, 1e-3, 0.1, 5.0]

# ---- decks --------------------------------------------------------------------------------------


def tower(
    gaps,
    formulation=("NODE TO SURFACE", "STANDARD"),
    held="{name}_MID, 1",
    load=-FORCE,
    turn=0.0,
    nlgeom=False,
    n=2,
    step="",
):
    """Unit squares over each other with these gaps, turned, the lowest on a support.

    The load on the topmost is spread evenly over its upper edge; `held` are the other supports of
    each square. Node 100*k + 1 is the lower left one of square k.
    """
    lines, y = [], 0.0
    for k, gap in enumerate([0.0, *gaps]):
        y += gap + (k > 0)
        lines += square(k, y, turn if k else 0.0, n)
    top = len(gaps)
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{E}, {NU}"]
    lines += [f"*SOLID SECTION, ELSET=S{k}, MATERIAL=M" for k in range(top + 1)]
    lines += ["*SURFACE INTERACTION, NAME=HARD"]
    for k in range(top):
        lines += [f"*CONTACT PAIR, INTERACTION=HARD, TYPE={formulation[0]}", f"FOOT{k + 1}, HEAD{k}"]
    lines += ["*BOUNDARY", "BASE0, 2", "S0_MID, 1"]
    lines += [held.format(name=f"S{k}") for k in range(1, top + 1) if held]
    lines += ["*STEP, NLGEOM" if nlgeom else "*STEP", "*STATIC", "1., 1."]
    if formulation[1] and formulation[0] != "NODE TO SURFACE":
        lines += [f"*MORTAR, MULTIPLIER={formulation[1]}"]
    lines += ["*CLOAD"]
    for i in range(n + 1):
        label = 100 * top + n * (n + 1) + i + 1
        lines += [f"{label}, 2, {load / n * (0.5 if i in (0, n) else 1.0)!r}"]
    return "\n".join([*lines, "*NODE FILE", "U, RF", step, "*END STEP", ""]).replace("\n\n", "\n")


def square(k, y, turn, n):
    """Cards of one unit square of n x n elements."""
    c, s = math.cos(turn), math.sin(turn)
    first = 100 * k + 1
    lines = ["*NODE"]
    for j in range(n + 1):
        for i in range(n + 1):
            a, b = i / n, j / n
            lines += [f"{first + j * (n + 1) + i}, {c * a - s * b!r}, {y + s * a + c * b!r}"]
    lines += [f"*ELEMENT, TYPE=CPE4, ELSET=S{k}"]
    for j in range(n):
        for i in range(n):
            a = first + j * (n + 1) + i
            lines += [f"{first + j * n + i}, {a}, {a + 1}, {a + n + 2}, {a + n + 1}"]
    middle = [first + j * (n + 1) + n // 2 for j in range(n + 1)]
    lines += [f"*NSET, NSET=S{k}_MID", ", ".join(map(str, middle))]
    lines += [f"*NSET, NSET=S{k}_ONE", str(middle[0])]
    lines += [f"*NSET, NSET=BASE{k}", ", ".join(str(first + i) for i in range(n + 1))]
    lines += [f"*SURFACE, NAME=FOOT{k}"] + [f"{first + i}, S1" for i in range(n)]
    lines += [f"*SURFACE, NAME=HEAD{k}"] + [f"{first + (n - 1) * n + i}, S3" for i in range(n)]
    return lines


def solve(tmp_path, text, code=0):
    path = tmp_path / "deck.inp"
    path.write_text(text)
    return run_deck(path, tmp_path, code)


def displacement(run, k, n=2):
    """End positions' displacements of square k, (n + 1, n + 1, 2) by row and column."""
    fields = run.fields()
    m = (n + 1) ** 2
    return fields["displacement"][-1][m * k : m * (k + 1)].reshape(n + 1, n + 1, 2)


# ---- held by contact ----------------------------------------------------------------------------


@pytest.mark.each_value
@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
@pytest.mark.parametrize("gap", GAPS)
def test_square_on_a_square(tmp_path, formulation, gap):
    """Uniform pressure in plane strain: each square of height 1 shortens by (1 - nu^2) F/E."""
    run = solve(tmp_path, tower([gap], formulation))
    top = displacement(run, 1)[-1, :, 1]
    shortening = 2.0 * (1.0 - NU**2) * FORCE / E
    # Newton's tolerance is 1e-10 of the forces; positions of size 1 + gap are rounded.
    assert np.allclose(top, -gap - shortening, rtol=0, atol=ACCURACY * shortening)

@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
@pytest.mark.parametrize("overlap", [1e-9, 1e-5, 1e-3, 0.02])
def test_squares_that_overlap_and_that_contact_alone_holds(tmp_path, formulation, overlap):
    """`SHRINK` pushes the upper one out as far, however it is held below."""
    text = tower([-overlap], formulation)
    text = text.replace("*CLOAD", "*CONTACT INTERFERENCE, SHRINK\n*CLOAD", 1)
    run = solve(tmp_path, text)
    top = displacement(run, 1)[-1, :, 1]
    shortening = 2.0 * (1.0 - NU**2) * FORCE / E
    assert np.allclose(top, overlap - shortening, rtol=0, atol=ACCURACY * (shortening + overlap))


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
def test_tower_of_four(tmp_path, formulation):
    """Three squares without support below fall onto each other, each by all gaps under it."""
    gaps = [0.05, 0.0, 0.2]
    run = solve(tmp_path, tower(gaps, formulation))
    shortening = (1.0 - NU**2) * FORCE / E
    for k in range(1, 4):
        top = displacement(run, k)[-1, :, 1]
        assert np.allclose(top, -sum(gaps[:k]) - (k + 1) * shortening, rtol=0, atol=ACCURACY * shortening)


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
@pytest.mark.parametrize("turn", [0.02, -0.15])
def test_leaning_square_lands_flat(tmp_path, formulation, turn):
    """A square that leans turns about the corner that touches first until it lies on its foot."""
    text = tower([0.2], formulation, held="{name}_ONE, 1", turn=turn, nlgeom=True, load=-0.1)
    run = solve(tmp_path, text)
    u = displacement(run, 1)
    x = run.fields().x[9:18].reshape(3, 3, 2) + u
    side = x[0, -1] - x[0, 0]
    assert abs(side[1] / side[0]) < 1e-3
    assert abs(math.atan2(side[1], side[0])) < 1e-3
    floor = (run.fields().x + run.fields()["displacement"][-1])[6:9, 1]
    # Where foot and floor meet, neither gets through by more than the elastic dip of an edge.
    assert (x[0, :, 1] - floor.min()).min() > -1e-4
    assert np.isclose(run.fields()["reaction_force"][-1][:3, 1].sum(), 0.1, rtol=1e-8)


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
@pytest.mark.parametrize("gap", GAPS[:4])
def test_motion_that_nothing_holds_is_named(tmp_path, formulation, gap):
    """Without friction nothing holds a square sideways on a flat one."""
    run = solve(tmp_path, tower([gap], formulation, held=""), code=3)
    assert "body of element 101 is free to move in x" in run.errors
    assert "move in y" not in run.errors


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
@pytest.mark.parametrize("gap", GAPS[:4])
def test_square_that_is_pulled_off(tmp_path, formulation, gap):
    run = solve(tmp_path, tower([gap], formulation, load=FORCE), code=3)
    assert "body of element 101 is free to move in y" in run.errors


@pytest.mark.each_value
@pytest.mark.parametrize("formulation", FORMULATIONS[::2], ids=" ".join)
@pytest.mark.parametrize("part", [0.5, 0.98])
@pytest.mark.parametrize("first", [0.02, 0.2, 1.0])
def test_a_push_below_the_limit_of_friction_is_held(tmp_path, formulation, part, first):
    """At one corner: nodes slide there and the others hold; increments of any size come to it."""
    push = part * 0.3 * FORCE
    text = tower([0.0], formulation, held="", n=4, nlgeom=True)
    text = text.replace("NAME=HARD", "NAME=HARD\n*FRICTION\n0.3", 1)
    text = text.replace("TYPE=NODE TO SURFACE", "TYPE=NODE TO SURFACE, SIDES=ONE")
    text += f"*STEP, NLGEOM\n*STATIC\n{first}, 1.\n*CLOAD\n101, 1, {push!r}\n*END STEP\n"
    run = solve(tmp_path, text)
    assert run.verdict["verdict"] == "good"
    assert run.history["time"][-1] == 2.0
    reaction = run.fields()["reaction_force"][-1].sum(axis=0)[:2]
    assert reaction == pytest.approx([-push, FORCE], abs=1e-8 * FORCE)


def grid(name, corner, size, cells, first):
    """Cards of a rectangle, with a surface of its upper edges and one of its lower ones."""
    (n, m), lines = cells, [f"*NODE, NSET={name}"]
    lines += [f"{first + j * (n + 1) + i}, {corner[0] + size[0] * i / n!r}, {corner[1] + size[1] * j / m!r}"
              for j in range(m + 1) for i in range(n + 1)]
    lines += [f"*ELEMENT, TYPE=CPE4, ELSET={name}"]
    for k in range(n * m):
        a = first + k // n * (n + 1) + k % n
        lines += [f"{first + k}, {a}, {a + 1}, {a + n + 2}, {a + n + 1}"]
    lines += [f"*SOLID SECTION, ELSET={name}, MATERIAL=M", f"*SURFACE, NAME={name}_LOW"]
    lines += [f"{first + k}, S1" for k in range(n)]
    return [*lines, f"*SURFACE, NAME={name}_TOP", *(f"{first + (m - 1) * n + k}, S3" for k in range(n))]


@pytest.mark.each_value
@pytest.mark.parametrize("cells", [(4, 2), (3, 2), (8, 4)])
@pytest.mark.parametrize("first", [0.05, 0.1, 0.5, 1.0])
def test_a_push_in_big_increments_on_a_wide_floor(cells, first, tmp_path):
    """Other states that balance, as of a block on one corner, are not taken for its end."""
    push, weight = 5.9, 20.0
    lines = [*grid("BLOCK", (0.0, 0.0), (2.0, 1.0), cells, 1),
             *grid("FLOOR", (-1.0, -1.0), (5.0, 1.0), (10, 2), 101),
             "*MATERIAL, NAME=M", "*HYPERELASTIC, COUPLED NEO HOOKE", "10000., 0.3", "*DENSITY", "1.",
             "*SURFACE INTERACTION, NAME=ROUGH", "*FRICTION", "0.3",
             "*CONTACT PAIR, INTERACTION=ROUGH", "BLOCK_LOW, FLOOR_TOP",
             "*BOUNDARY", *(f"{101 + i}, 1, 2" for i in range(11)),
             "*STEP, NLGEOM", "*STATIC", "1., 1.", "*DLOAD", "BLOCK, GRAV, 10., 0., -1.", "*END STEP",
             "*STEP, NLGEOM", "*STATIC", f"{first}, 1.", "*CLOAD", f"1, 1, {push}",
             "*NODE FILE", "RF", "*END STEP", ""]
    run = solve(tmp_path, "\n".join(lines))
    assert run.verdict["verdict"] == "good"
    reaction = run.fields()["reaction_force"][-1].sum(axis=0)[:2]
    assert reaction == pytest.approx([-push, weight], abs=1e-8 * weight)


# ---- what is accepted as round-off ----------------------------------------------------------------


@pytest.mark.parametrize("h, word", [(1e-4, "good"), (0.1, "bad"), (10.0, "bad")])
def test_free_fall_with_steps_far_beyond_a_vibration(tmp_path, h, word):
    """One element of steel of 0.1 mm, whose own vibrations take 1e-8 s, in free fall.

    Displacements of many metres round the forces within the element by more than its weight: the
    balance holds nevertheless, no residual above 1e-3 is accepted, and any above the tolerance told.
    """
    gravity, n = 9810.0, 20
    text = f"""*NODE
1, 0., 0.
2, 0.1, 0.
3, 0.1, 0.1
4, 0., 0.1
*ELEMENT, TYPE=CPE4, ELSET=A
1, 1, 2, 3, 4
*MATERIAL, NAME=STEEL
*ELASTIC
210000., 0.3
*DENSITY
7.85e-9
*SOLID SECTION, ELSET=A, MATERIAL=STEEL
*STEP, NLGEOM
*DYNAMIC, DIRECT
{h}, {n * h}
*DLOAD
A, GRAV, {gravity}, 0., -1.
*END STEP
"""
    run = solve(tmp_path, text)
    fallen = 0.5 * gravity * (n * h) ** 2
    kinetic, work = run.history["kinetic"][-1], 7.85e-9 * 0.01 * gravity * fallen
    assert np.isclose(kinetic, work, rtol=1e-7)
    verdict = json.loads(run.file(".json").read_text())
    assert verdict["verdict"] == word
    low, high = (0.0, 1e-6) if word == "good" else (1e-6, 1e-3)
    assert low < verdict["unconverged"] <= high
    assert "is accepted as round-off" in run.log
    assert ("BAD" in run.errors) == (word == "bad")
    assert ("or round-off (" in run.log) == (word == "good")


def between_plates(unit, force, kind, way):
    """A block of rubber, E = 1, on a plate of 2e5 with another one above that comes down by `way`
    and half of its height, in other units of length and force."""
    lines, stress = [], force / unit**2
    for k, (x, y, nx, ny) in enumerate(((0.0, 0.0, 4, 2), (-1.0, -0.5, 5, 1), (-1.0, 1.0 + way, 5, 1))):
        first, width, height = 100 * k + 1, 2.0 if k == 0 else 4.0, 1.0 if k == 0 else 0.5
        lines += ["*NODE"]
        lines += [f"{first + j * (nx + 1) + i}, {unit * (x + width * i / nx)!r}, "
                  f"{unit * (y + height * j / ny)!r}" for j in range(ny + 1) for i in range(nx + 1)]
        lines += [f"*ELEMENT, TYPE=CPE4, ELSET=E{k}"]
        for a in [first + j * (nx + 1) + i for j in range(ny) for i in range(nx)]:
            lines += [f"{a}, {a}, {a + 1}, {a + nx + 2}, {a + nx + 1}"]
        lines += [f"*SURFACE, NAME=LOW{k}"] + [f"{first + i}, S1" for i in range(nx)]
        lines += [f"*SURFACE, NAME=TOP{k}"]
        lines += [f"{first + (ny - 1) * (nx + 1) + i}, S3" for i in range(nx)]
        lines += [f"*SOLID SECTION, ELSET=E{k}, MATERIAL=M{k}", f"{unit!r}", f"*MATERIAL, NAME=M{k}"]
        lines += ["*ELASTIC", f"{(2e5 if k else 1.0) * stress!r}, {0.3 if k else 0.4}"]
    held = "*NSET, NSET=FIX, GENERATE\n101, 106\n*NSET, NSET=HEAD, GENERATE\n207, 212\n"
    return "\n".join(lines) + f"""
{held}*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I, TYPE={kind}
LOW0, TOP1
TOP0, LOW2
*BOUNDARY
FIX, 1, 2
HEAD, 1, 1
*STEP, NLGEOM
*CONTACT CONTROLS, STABILIZE
*STATIC
0.1, 1., 1e-4, 0.2
*BOUNDARY
HEAD, 2, 2, {-unit * (way + 0.5)!r}
*END STEP
"""


@pytest.mark.each_value
@pytest.mark.parametrize("kind", ["SURFACE TO SURFACE", "NODE TO SURFACE"])
@pytest.mark.parametrize(("unit", "force"), [(1.0, 1.0), (1e-6, 1.0), (1e6, 1.0), (1.0, 1e6)])
def test_rubber_between_plates_that_come_from_afar(tmp_path, unit, force, kind):
    """Where they touch first the forces of the rubber are less than what the way of the plate,
    thirty heights, rounds in its own; the force at the end is that of a plate that comes from near.
    """
    runs = [solve(tmp_path, between_plates(unit, force, kind, way)) for way in (1.0, 30.0)]
    near, far = (run.history["strain"][-1] for run in runs)
    assert far == pytest.approx(near, rel=1e-3)
    assert runs[1].verdict["verdict"] == "good"
    assert runs[1].verdict["cuts"] == 0


@pytest.mark.parametrize(
    "pairs", [["FOOT1, HEAD0"], ["L, HEAD0", "R, HEAD0"], ["HEAD0, L", "HEAD0, R"]], ids=len
)
def test_nodes_on_nodes_from_both_sides(tmp_path, pairs):
    """Each place is held once, also where two surfaces share one."""
    halves = [f"*SURFACE, NAME={name}\n" + "".join(f"{k}, S1\n" for k in range(first, first + 4))
              for name, first in (("L", 101), ("R", 105))]
    surfaces = "".join(halves)
    text = tower([0.0], load=-40.0, n=8).replace("*MATERIAL", surfaces + "*MATERIAL", 1)
    text = text.replace("\nFOOT1, HEAD0\n", "\n" + "\n".join(pairs) + "\n")
    run = solve(tmp_path, text)
    assert run.verdict["verdict"] == "good"
    assert run.history["active"][-1] == 9


# ---- what snaps through --------------------------------------------------------------------------


def truss(h, unit=1.0, stress=1000.0, option=", STABILIZE", load=2.0):
    """Two bars, each of two triangles on either side of its line, from 10 units beside up to their
    apex of height 1, with a load on it that grows to `load` times what it bears. Their law is
    linear, without Poisson's ratio: the load at height y is E V (H^2 - y^2) y/l^4."""
    wide, high, square = 10.0 * unit, unit, 101.0 * unit**2
    side = 0.2 * unit / math.sqrt(square)
    volume = math.sqrt(square) * 0.2 * unit * unit
    top = load * 2 * stress * volume * high**3 / (3 * math.sqrt(3) * square**2)
    nodes = [(-wide, 0.0), (0.0, high), (-wide / 2 - high * side, high / 2 + wide * side),
             (-wide / 2 + high * side, high / 2 - wide * side), (wide, 0.0),
             (wide / 2 + high * side, high / 2 + wide * side),
             (wide / 2 - high * side, high / 2 - wide * side)]
    lines = ["*NODE"] + [f"{i}, {x!r}, {y!r}" for i, (x, y) in enumerate(nodes, 1)]
    lines += ["*ELEMENT, TYPE=CPS3, ELSET=A", "1, 1, 2, 3", "2, 1, 4, 2", "3, 2, 5, 6", "4, 2, 7, 5"]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{stress!r}, 0.", "*SOLID SECTION, ELSET=A, MATERIAL=M"]
    lines += [repr(unit), "*NSET, NSET=TOP", "2", "*BOUNDARY", "1, 1, 2", "5, 1, 2", "2, 1"]
    lines += ["*STEP, NLGEOM", "*STATIC" + option, h, "*CLOAD", f"2, 2, {-top!r}"]
    roots = np.roots([1.0, 0.0, -high**2, top * square**2 / (stress * volume)])
    down = roots[abs(roots.imag) < 1e-9 * unit].real.min() - high
    free = 0.75 * stress * volume * high**4 / square**2
    return "\n".join([*lines, "*NODE FILE", "U", "*END STEP", ""]), down, free


@pytest.mark.parametrize("unit, stress", [(1.0, 1000.0), (1e-6, 1000.0), (1.0, 1e9)])
def test_truss_snaps_through(tmp_path, unit, stress):
    """To the other branch, and what is set free is all taken by the viscous forces; a little more,
    as the load grows on the way."""
    text, down, free = truss("0.1, 1.", unit, stress)
    run = solve(tmp_path, text)
    assert run.fields()["displacement"][-1][1, 1] == pytest.approx(down, rel=1e-5)
    loss = run.history["damping_loss"]
    assert (np.diff(loss) >= 0.0).all()
    assert loss[-1] == pytest.approx(free, rel=0.01)
    assert run.verdict["verdict"] == "good"


def test_viscous_forces_are_small_where_nothing_snaps(tmp_path):
    """Up to nine tenths of what the truss bears they take the part of the deck, or less."""
    moved = []
    for k, option in enumerate(("", ", STABILIZE", ", STABILIZE=0")):
        (tmp_path / str(k)).mkdir()
        run = solve(tmp_path / str(k), truss("0.05, 1., 0., 0.05", option=option, load=0.9)[0])
        moved += [run.fields()["displacement"][-1][1, 1]]
        loss, strain = run.history["damping_loss"], run.history["strain"]
        assert (loss[-1] > 0.0) == (option == ", STABILIZE")
        assert loss[1] <= 4e-4 * strain[1]
    assert moved[2] == moved[0]
    assert moved[1] == pytest.approx(moved[0], rel=1e-4) and moved[1] != moved[0]


# ---- slave nodes that the deck moves -------------------------------------------------------------


def driven(way, whole):
    """A square of two by two elements a tenth above another: its lower left node goes down by `way`,
    the rest is pulled up by 1; the upper side of the other square is held, or free."""
    text = tower([0.1], ("NODE TO SURFACE, SIDES=ONE", ""), held="", load=0.0)
    lines = ["*BOUNDARY", "101, 1, 1", f"101, 2, 2, {-way}", "107, 1, 1", "102, 1, 1"]
    lines += [f"{k}, 2, 2, 1." for k in (102, 103, 107, 108, 109)]
    lines += [f"{k}, 1, 2" for k in (7, 8, 9) if whole]
    return text.replace("*CLOAD\n", "\n".join([*lines, "*CLOAD", ""]), 1)


def test_slave_node_that_is_driven(tmp_path):
    """No fault where it does not meet its master, or that is free; what nothing can prevent is told."""
    for name, way, whole in (("short", 0.09, True), ("free", 0.15, False)):
        (tmp_path / name).mkdir()
        assert solve(tmp_path / name, driven(way, whole)).verdict["verdict"] == "good"
    run = solve(tmp_path, driven(0.15, True), code=3)
    assert "slave node 101 of surface FOOT1" in run.errors and "behind surface HEAD0" in run.errors


# ---- overclosure resolved -------------------------------------------------------------------------


def press_fit(cells, formulation, interference, cards=(), amplitude=""):
    """Quarters of two rings, radii 1, 2 + interference and 2, 3, of so many elements around each."""
    lines = []
    radii = [(1.0, 2.0 + interference), (2.0, 3.0)]
    for k, ((inner, outer), cells) in enumerate(zip(radii, cells, strict=True)):
        first, rows = 10000 * k + 1, cells // 2
        label = {}
        lines += ["*NODE"]
        for i in range(cells + 1):
            angle = 0.5 * math.pi * (1.0 - i / cells)
            for j in range(rows + 1):
                r = inner + (outer - inner) * j / rows
                label[i, j] = first + i * (rows + 1) + j
                x = 0.0 if i == 0 else r * math.cos(angle)
                y = 0.0 if i == cells else r * math.sin(angle)
                lines += [f"{label[i, j]}, {x!r}, {y!r}"]
        lines += [f"*ELEMENT, TYPE=CPE4, ELSET=R{k}"]
        for i in range(cells):
            for j in range(rows):
                corners = [label[i, j], label[i + 1, j], label[i + 1, j + 1], label[i, j + 1]]
                lines += [f"{first + i * rows + j}, " + ", ".join(map(str, corners))]
        face, j = ("S3", rows - 1) if k == 0 else ("S1", 0)
        lines += [f"*SURFACE, NAME=F{k}"] + [f"{first + i * rows + j}, {face}" for i in range(cells)]
        for i, axis in ((0, 1), (cells, 2)):
            lines += [f"*NSET, NSET=E{k}{axis}"] + [str(label[i, j]) for j in range(rows + 1)]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{E}, {NU}"]
    lines += ["*SOLID SECTION, ELSET=R0, MATERIAL=M", "*SOLID SECTION, ELSET=R1, MATERIAL=M"]
    lines += ["*SURFACE INTERACTION, NAME=HARD"]
    lines += [f"*CONTACT PAIR, INTERACTION=HARD, TYPE={formulation[0]}", "F1, F0"]
    lines += ["*BOUNDARY", "E01, 1", "E02, 2", "E11, 1", "E12, 2", "*STEP", "*STATIC", "0.5, 1."]
    if formulation[0] != "NODE TO SURFACE":
        lines += [f"*MORTAR, MULTIPLIER={formulation[1]}"]
    lines += [*cards, f"*CONTACT INTERFERENCE, SHRINK{amplitude}", "*NODE FILE", "U", "*END STEP", ""]
    return "\n".join(lines)


def lame(interference):
    """Displacement of the bore, radii 1, 2 and 3 and one material, in plane strain."""
    stiffness = E / (1.0 - NU**2)
    pressure = stiffness * interference / 2.0 * (4 - 1) * (9 - 4) / (2 * 4 * (9 - 1))
    return -2.0 * pressure * 4.0 / (stiffness * (4 - 1))


def bore(run):
    """Mean radial displacement of the bore, in each frame."""
    fields = run.fields()
    inside = np.abs(np.linalg.norm(fields.x, axis=1) - 1.0) < 1e-6
    return (fields["displacement"] * fields.x).sum(axis=2)[:, inside].mean(axis=1)


@pytest.mark.parametrize("formulation", FORMULATIONS[::2], ids=" ".join)
@pytest.mark.parametrize("interference", [1e-2, 1e-4, 1e-5, 1e-8])
def test_squares_pressed_into_each_other(tmp_path, formulation, interference):
    """Like squares whose nodes meet, between plates: uniform pressure E' d/2, of any interference."""
    text = tower([-interference], formulation, load=0.0)
    text = text.replace("*BOUNDARY\n", "*BOUNDARY\n107, 2\n108, 2\n109, 2\n", 1)
    text = text.replace("*CLOAD", "*CONTACT INTERFERENCE, SHRINK\n*CLOAD", 1)
    run = solve(tmp_path, text)
    force = run.fields()["reaction_force"][-1][-3:, 1]
    # Coordinates of size 2 are rounded to 2 epsilon, gaps between three of them.
    tol = 16*np.finfo(float).eps/interference + 1e-10
    assert np.allclose(-4*force, E/(1 - NU**2)*interference/2*np.array([1, 2, 1]), rtol=tol, atol=0)


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
def test_press_fit(tmp_path, formulation):
    """Two rings pressed into each other against Lame, with small strains: nodes meet nodes."""
    interference, error = 1e-4, []
    for n in (8, 16):
        (tmp_path / str(n)).mkdir()
        run = solve(tmp_path / str(n), press_fit((n, n), formulation, interference))
        assert "overclosure of surface" not in run.errors
        error.append(abs(bore(run)[-1] / lame(interference) - 1.0))
    # Second order: a fourth on the finer mesh.
    assert error[1] < 0.01
    assert error[1] < 0.3 * error[0]


@pytest.mark.parametrize("formulation", FORMULATIONS[:4:2], ids=" ".join)
def test_press_fit_stays_at_rest(tmp_path, formulation):
    """With inertia from then on: vertices that rest on vertices do not slip off them. Positions end
    static steps off by round-off, some 1e-13 of the way; the square of that is kinetic."""
    text = press_fit((8, 8), formulation, 1e-2).replace("*STEP\n", "*STEP, NLGEOM\n")
    text = text.replace("*SOLID", "*DENSITY\n1.\n*SOLID", 1)
    run = solve(tmp_path, text + "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n0.005, 0.3\n*END STEP\n")
    assert run.history["kinetic"].max() < 1e-22 * run.history["strain"][-1]


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
def test_overclosure_that_is_meant_is_no_penetration(tmp_path, formulation):
    """Of 0.025 edges half is left in the first of two increments."""
    run = solve(tmp_path, press_fit((8, 8), formulation, 0.01))
    assert run.verdict["verdict"] == "good"
    assert run.history["penetration"].max() < 1e-3


@pytest.mark.parametrize("formulation", FORMULATIONS[2::2], ids=" ".join)
def test_coarse_ring_around_a_fine_one(tmp_path, formulation):
    """The fine one's nodes begin behind chords of the coarse one, whose arcs are 0.02 off: in either
    order of the pair the coarse one is the slave, as `SIDES=ONE` has it: to the bit in both orders,
    and to round-off without the guards of the other side, which say the same at two corners."""
    text = press_fit((12, 4), formulation, -0.02).replace("*CONTACT INTERFERENCE, SHRINK\n", "")
    bore = "*SURFACE, NAME=BORE\n" + "".join(f"{1 + 6*i}, S1\n" for i in range(12))
    text = text.replace("*MATERIAL", bore + "*MATERIAL", 1)
    text = text.replace("*NODE FILE", "*DSLOAD\nBORE, P, 60.\n*NODE FILE")
    moved = []
    for sides, order in ((", SIDES=ONE", "F1, F0"), ("", "F1, F0"), ("", "F0, F1")):
        folder = tmp_path / str(len(moved))
        folder.mkdir()
        named = text.replace("F1, F0", order).replace(f"={formulation[0]}", f"={formulation[0]}{sides}")
        run = solve(folder, named)
        assert ("F1 is the slave" in run.log) == (sides == "")
        moved.append(run.fields()["displacement"][-1])
    assert np.abs(moved[0]).max() > 0.02
    assert (moved[2] == moved[1]).all()
    assert np.abs(moved[1] - moved[0]).max() <= 64*np.finfo(float).eps*np.abs(moved[0]).max()


@pytest.mark.parametrize("cells", [(8, 11), (11, 8)], ids=str)
@pytest.mark.parametrize("formulation", FORMULATIONS, ids=" ".join)
def test_press_fit_of_unlike_meshes(tmp_path, formulation, cells):
    """Arcs rise over edges by twelve times the interference; what counts is that of the arcs. Like
    meshes of 8 elements are off by half a percent of what the elements cannot do."""
    run = solve(tmp_path, press_fit(cells, formulation, 1e-3))
    assert bore(run)[-1] == pytest.approx(lame(1e-3), rel=0.02)
    assert "F1 and F0: gaps are measured between the curves" in run.log
    assert run.verdict["verdict"] == "good"
    assert run.history["penetration"].max() < 1e-3


def test_press_fit_of_smoothed_arcs(tmp_path):
    """Positions on the cubics are exact to fourth order, displacements to second."""
    interference, error = 1e-3, []
    for cells in ((8, 11), (16, 22)):
        folder = tmp_path / str(cells[0])
        folder.mkdir()
        text = press_fit(cells, FORMULATIONS[0], interference, ["*SURFACE SMOOTHING, TYPE=HERMITE"])
        run = solve(folder, text)
        error.append(abs(bore(run)[-1] / lame(interference) - 1.0))
    assert error[1] < 0.01
    assert error[1] < 0.3 * error[0]


def test_overlap_of_arcs_is_told(tmp_path):
    """A pair of one node of the rim holds nothing: chords of one circle are no overlap, those of
    circles that differ by two sagittas are."""
    for interference, verdict in ((0.0, "good"), (0.02, "bad")):
        text = press_fit((8, 11), FORMULATIONS[0], interference)
        text = text.replace("*CONTACT INTERFERENCE, SHRINK\n", "")
        text = text.replace("*MATERIAL", "*SURFACE, NAME=RIM, TYPE=NODE\n10006\n*MATERIAL", 1)
        folder = tmp_path / verdict
        folder.mkdir()
        run = solve(folder, text.replace("\nF1, F0\n", "\nRIM, F0\n"))
        assert run.verdict["verdict"] == verdict


@pytest.mark.parametrize("formulation", [FORMULATIONS[0], FORMULATIONS[4]], ids=" ".join)
def test_sleeve_on_a_drum(tmp_path, formulation):
    """A sleeve, radii 2 and 3, pressed onto an arc of radius 2, edges of one degree. Chords of the
    hole have to overlap the arc; that is no penetration. Lame, with the hole held, but for what a
    mean gap of chords is off by: a part of their sagitta."""
    text = press_fit((2, 16), formulation, 0.0).replace("*CONTACT INTERFERENCE, SHRINK\n", "")
    text = text[text.index("*NODE\n10001") :]                       # without the hub
    at = [f"{2 * math.sin(a)!r}, {2 * math.cos(a)!r}" for a in (-0.2, 0.5 * math.pi + 0.2)]
    drum = ["*NODE, NSET=REF", "9999, 0., 0.", "*SURFACE, TYPE=SEGMENTS, NAME=DRUM"]
    drum += [f"START, {at[0]}", f"CIRCL, {at[1]}, 0., 0."]
    drum += ["*RIGID BODY, ANALYTICAL SURFACE=DRUM, REF NODE=9999", "*SURFACE, NAME=RIM"]
    drum += [f"{10001 + 8 * i + 7}, S3" for i in range(16)]
    text = text.replace("*MATERIAL", "\n".join([*drum, "*MATERIAL"]), 1)
    text = text.replace("*SOLID SECTION, ELSET=R0, MATERIAL=M\n", "").replace("F1, F0", "F1, DRUM")
    text = text.replace("E01, 1\nE02, 2\n", "REF, ENCASTRE\n")
    run = solve(tmp_path, text.replace("*NODE FILE", "*DSLOAD\nRIM, P, 20.\n*NODE FILE"))
    shear, first = E / 2 / (1 + NU), E * NU / (1 + NU) / (1 - 2 * NU)
    exact = -20.0 * (3 - 4 / 3) / (2 * (first + shear) + 2 * shear * 4 / 9)
    fields = run.fields()
    rim = np.abs(np.linalg.norm(fields.x, axis=1) - 3.0) < 1e-6
    moved = (fields["displacement"][-1] * fields.x).sum(axis=1)[rim].mean() / 3.0
    assert moved == pytest.approx(exact, abs=2 * (1 - math.cos(math.pi / 64)))
    assert run.verdict["verdict"] == "good"


def test_amplitude_of_the_overclosure(tmp_path):
    """With a tenth left at half the time nine tenths are done, as all is linear."""
    text = press_fit((8, 8), FORMULATIONS[0], 1e-4, amplitude=", AMPLITUDE=LEFT")
    table = "*AMPLITUDE, NAME=LEFT\n0., 1., 0.5, 0.1, 1., 0.\n*STEP\n"
    done = bore(solve(tmp_path, text.replace("*STEP\n", table)))
    assert done[1] / done[2] == pytest.approx(0.9, rel=1e-3)


def test_one_element_of_few_points(tmp_path):
    """CPE8R has a motion without strain, held as it is: what to take is told."""
    x = [(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5)]
    lines = ["*NODE", *(f"{k}, {a}, {b}" for k, (a, b) in enumerate(x, 1))]
    lines += ["*ELEMENT, TYPE=CPE8R, ELSET=B", "7, 1, 2, 3, 4, 5, 6, 7, 8"]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{E}, {NU}", "*SOLID SECTION, ELSET=B, MATERIAL=M"]
    lines += ["*STEP", "*STATIC, DIRECT", "1., 1.", "*BOUNDARY", "1, 1, 2", "2, 2"]
    run = solve(tmp_path, "\n".join([*lines, "*CLOAD", "3, 1, 0.01", "*END STEP", ""]), code=3)
    assert "; elements of type CPE8R, as 7, have zero-energy modes" in run.errors
    assert run.errors.rstrip().endswith("use two rows, or CPE8")


def test_what_slides_on_a_bent_surface_is_not_said_to_rotate(tmp_path):
    """A block lies on another one without friction, pressed by its weight: it is free to slide, and
    turns as the surface under it bends."""
    scene = Scene(1.0, 1.0, gravity=1.0)
    scene.block("LOW", (0, 0), (2, 1), (4, 2)).hold("LOW", lambda x, y: y < 0.01)
    scene.block("HIGH", (0.3, 1), (1, 0.5), (2, 1))
    scene.pairs = [("HIGH", "LOW")]
    deck = scene.deck("AUTO")
    deck.replace("*DYNAMIC, DIRECT", "*STATIC, DIRECT")
    run = run_deck(deck, tmp_path, code=3, formulation="MORTAR")
    assert "body of element 9 is free to move in x" in run.errors and "rotate" not in run.errors


def test_a_beam_between_three_rollers(tmp_path):
    """Nothing but arcs above and below holds it; their ends have twelve digits, so that one of them
    touches first and pushes nothing. Force and sag of theory with shear, to (height/span)**2."""
    height, ends = 5.0, range(1, 42)
    x = [(-60 + 3 * i, 1.25 * j) for j in range(5) for i in range(41)]
    cells = [41 * j + i + 1 for j in range(4) for i in range(40)]
    lines = ["*NODE", *(f"{k}, {a}, {b}" for k, (a, b) in enumerate(x, 1))]
    lines += ["901, -50., -3.05", "902, 50., -3.05", "903, 0., 8.1"]
    lines += ["*ELEMENT, TYPE=CPE4I, ELSET=BEAM"]
    lines += [f"{k}, {a}, {a + 1}, {a + 42}, {a + 41}" for k, a in enumerate(cells, 1)]
    lines += ["*SURFACE, NAME=LOWER", *(f"{k}, S1" for k in ends[:40])]
    lines += ["*SURFACE, NAME=UPPER", *(f"{k + 120}, S3" for k in ends[:40])]
    a, b = 1.5 * math.sqrt(3), 1.5
    for k, (cx, cy, up) in enumerate([(-50, -3.05, 1), (50, -3.05, 1), (0, 8.1, -1)], 1):
        lines += [f"*SURFACE, TYPE=SEGMENTS, NAME=S{k}", f"START, {cx - up * a:.12g}, {cy + up * b:.12g}"]
        lines += [f"CIRCL, {cx + up * a:.12g}, {cy + up * b:.12g}, {cx}, {cy}"]
        lines += [f"*RIGID BODY, ANALYTICAL SURFACE=S{k}, REF NODE=90{k}"]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", "1e4, 0.3", "*SOLID SECTION, ELSET=BEAM, MATERIAL=M"]
    lines += ["*SURFACE INTERACTION, NAME=I", "*CONTACT PAIR, INTERACTION=I, TYPE=NODE TO SURFACE"]
    lines += ["LOWER, S1", "LOWER, S2", "UPPER, S3", "*BOUNDARY", "901, ENCASTRE", "902, ENCASTRE"]
    lines += ["903, 1", "903, 6", *(f"{21 + 41 * j}, 1" for j in range(5))]
    lines += ["*STEP, NLGEOM", "*STATIC", "0.1, 1.", "*BOUNDARY", "903, 2, 2, -1.", "*NODE FILE", "U"]
    run = solve(tmp_path, "\n".join([*lines, "*CONTACT PRINT, TOTALS=ONLY", "CF", "*END STEP", ""]))
    assert run.verdict["verdict"] == "good", run.verdict["reasons"]
    fields = run.fields()
    # The supports lie 0.05 below it.
    sag = -fields["displacement"][-1][20, 1] - 0.05
    stiffness = 1e4 / (1 - 0.3**2)
    give = 1e6 / 48 / (stiffness * height**3 / 12) + 100 / 4 / (1e4 / 2.6 * height * 5 / 6)
    force = abs(run.history["pair3_force_y"][-1])
    assert force == pytest.approx(sag / give, rel=8 * (height / 100)**2)
