"""Contact of nodes in space: impacts through rebound, patch tests, slides, and what must not change them."""

from __future__ import annotations

import subprocess
from pathlib import Path

import h5py
import numpy as np
import overlap
import pytest
from contact_space_scenes import (bodies, dent, dynamic, faces, impact, pair, press, quadratic_increments, slide,
                                  stack, turned, velocities)
from scene_tools import EPSILON, PROGRAM, Run, run_deck
from space_mesh import Block

#: Energy and momenta through an impact, of the largest of each.
BALANCE = 1.0e-11
#: Depths that numpy finds in a run whose gaps are closed to round-off, per facet: roundings of positions of size 1.
DEPTH = 64*EPSILON
#: Where edges of a coarse ball cross others between nodes, per facet.
CROSSING = 2.0e-2


def ran(folder: Path, text: str, code: int = 0) -> Run:
    deck = folder/"deck.inp"
    deck.write_text(text)
    return run_deck(deck, folder, code)


def moments(run: Run, names: str) -> np.ndarray:
    return np.array([run.history[name] for name in names.split()]).T


def check_impact(run: Run, depth: float = DEPTH) -> None:
    """Energy, six momenta, no overlap by the check and by another one, no cut, and there was a rebound."""
    history = run.history
    assert run.verdict["verdict"] == "good", run.log[-600:]
    assert np.ptp(history["total"]) <= BALANCE*history["total"].max()
    p, angular = moments(run, "px py pz"), moments(run, "lx ly lz")
    size = max(np.abs(history[f"pair1_impulse_{a}"]).max() for a in "xyz")
    assert np.abs(p - p[0]).max() <= BALANCE*size
    assert np.abs(angular - angular[0]).max() <= BALANCE*max(size, np.abs(angular).max())
    assert run.verdict["penetration"] <= depth
    assert overlap.worst(run.fields()).depth <= depth
    assert history["cuts"].sum() == 0
    assert history["active"].max() > 0
    assert history["active"][-1] == 0


@pytest.mark.parametrize(("first", "second"), [
    ("C3D8", "C3D8"), ("C3D4", "C3D8"), ("C3D8", "C3D4"), ("C3D4", "C3D4"), ("C3D8I", "C3D8H"), ("C3D10", "C3D8"),
    pytest.param("C3D8", "C3D10", marks=pytest.mark.long), pytest.param("C3D10", "C3D10", marks=pytest.mark.long),
    pytest.param("C3D20", "C3D8", marks=pytest.mark.long), ("C3D4", "C3D20R"),
    pytest.param("C3D10", "C3D20", marks=pytest.mark.long)])
def test_a_ball_bounces_off_a_plate(first: str, second: str, tmp_path: Path) -> None:
    check_impact(ran(tmp_path, impact(first, second)), CROSSING)


def test_a_node_beside_a_slanted_rim_is_left_to_the_next_step(tmp_path: Path) -> None:
    """A block of tetrahedra falls flat beside the rim of a free one: a node of the rim comes to see the plane past the
    falling one at a slant, opens and closes without end. The run stopped there."""
    one = Block("C3D10", (2, 2, 1), size=(0.8, 0.8, 0.5), place=lambda x: x + np.array([0.1, 0.05, 0.02]))
    two = Block("C3D10", (3, 3, 1), size=(1, 1, 0.5), place=lambda x: x - np.array([0, 0, 0.5]))
    text = (bodies([one, two], [faces(one), faces(two)], "*HYPERELASTIC, COUPLED NEO HOOKE\n100., .3\n*DENSITY\n1.\n")
            + pair() + velocities(one, (0.1, 0., -1.0), (0., 0., 0.)) + dynamic(0.01, 0.04))
    run = ran(tmp_path, text)
    history = run.history
    assert run.verdict["verdict"] == "good" and history["active"].max() > 0
    assert np.ptp(history["total"]) <= BALANCE*history["total"].max()
    p, impulse = moments(run, "px py pz"), np.abs(history["pair1_impulse_z"]).max()
    assert impulse > 0.01 and np.abs(p - p[0]).max() <= BALANCE*impulse
    assert overlap.worst(run.fields()).by_edge <= CROSSING


@pytest.mark.each_value
@pytest.mark.parametrize(("cells", "angle"), [
    ([(1, 1, 1), (1, 1, 1)], 0.0), ([(2, 2, 2), (2, 2, 2)], 0.0), ([(3, 3, 2), (3, 3, 2)], 0.0),
    ([(2, 2, 2), (3, 3, 3)], 0.0), ([(3, 3, 1), (2, 2, 1)], 0.0), ([(2, 2, 2), (2, 2, 2)], 0.1),
    ([(2, 2, 2), (2, 2, 2)], -0.1)])
@pytest.mark.parametrize("kind", ["C3D8", "C3D4"])
def test_cubes_node_on_node(kind: str, cells: list[tuple[int, int, int]], angle: float, tmp_path: Path) -> None:
    """Meshes that match, or do not, with outlines in one plane: flat, and on an edge first."""
    run = ran(tmp_path, stack(cells, 0.03, angle, kind=kind))
    check_impact(run)
    if angle == 0.0 and kind == "C3D8":          # as it is, mirrored: nothing turns
        for names in ("px py", "lx ly lz"):
            assert np.ptp(moments(run, names), axis=0).max() <= BALANCE


def test_newton_is_quadratic(tmp_path: Path) -> None:
    """Residuals of steps with contact: each about the square of the one before, or round-off."""
    run = ran(tmp_path, impact("C3D8", "C3D8", "*NEWTON, TYPE=FULL\n", cells=4))
    assert quadratic_increments(run) > 10


@pytest.mark.parametrize(("cells", "kind"), [
    ([(1, 1, 1), (1, 1, 1)], ["C3D8", "C3D8"]), ([(3, 3, 2), (3, 3, 2)], ["C3D8", "C3D8"]),
    ([(2, 2, 2), (3, 3, 3)], ["C3D8", "C3D8"]), ([(3, 3, 3), (2, 2, 2)], ["C3D8", "C3D8"]),
    ([(3, 3, 2), (4, 4, 2)], ["C3D8", "C3D8"])])
@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_uniform_pressure(cells: list[tuple[int, int, int]], kind: list[str], angle: float, tmp_path: Path) -> None:
    """Nodes of both sides hand a uniform pressure on through meshes that do not match, in any direction."""
    turn = turned(angle)
    run = ran(tmp_path, press(cells, kind, 0.01, turn))
    stress = run.fields()["cauchy_stress"][-1]
    s = np.array([[[v[0], v[3], v[4]], [v[3], v[1], v[5]], [v[4], v[5], v[2]]] for v in stress])
    if angle == 0.0:
        assert np.abs(s[:, 2, 2] - s[:, 2, 2].mean()).max() <= 1.0e-11*np.abs(s).max()
    pressure = np.einsum("nij,i,j->n", s, turn[:, 2], turn[:, 2]) if angle == 0.0 else np.trace(s, axis1=1, axis2=2)
    assert np.abs(pressure + 5.0).max() <= 1.0e-10*5.0


@pytest.mark.parametrize("more", [
    "*CONTACT INITIATION, TYPE=ADMISSIBLE\n", "*CONTACT INITIATION, TYPE=VELOCITY UPDATE\n",
    "*CONSTRAINT METHOD, TYPE=SADDLE POINT\n", "*CONSTRAINT METHOD, TYPE=PENALTY\n",
    "*CONSTRAINT METHOD, TYPE=AUGMENTED LAGRANGE\n"])
def test_other_ways_to_hold(more: str, tmp_path: Path) -> None:
    """Energy and momenta through all of them."""
    run = ran(tmp_path, impact("C3D8", "C3D8", more))
    history = run.history
    assert run.verdict["verdict"] == "good"
    # Penetrations of an augmented Lagrangian up to its tolerance have done work.
    balance = 1.0e-6 if "AUGMENTED" in more else BALANCE
    if "ADMISSIBLE" in more:                     # what is stopped loses a part
        assert np.diff(history["total"]).max() <= balance*history["total"].max()
    else:
        assert np.ptp(history["total"]) <= balance*history["total"].max()
    p, angular = moments(run, "px py pz"), moments(run, "lx ly lz")
    assert np.abs(p - p[0]).max() <= BALANCE*np.abs(p).max()
    assert np.abs(angular - angular[0]).max() <= BALANCE*np.abs(angular).max()


def test_null_space_and_saddle_point_agree(tmp_path: Path) -> None:
    states = []
    for k, more in enumerate(["", "*CONSTRAINT METHOD, TYPE=SADDLE POINT\n"]):
        folder = tmp_path/str(k)
        folder.mkdir()
        states.append(ran(folder, impact("C3D8", "C3D4", more)).fields()["displacement"][-1])
    assert np.abs(states[0] - states[1]).max() <= 1.0e-9


@pytest.mark.parametrize("interaction", [
    "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n200.\n",
    "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=EXPONENTIAL\n.05, 2.\n",
    pytest.param("*CONTACT DAMPING\n2., .05\n", marks=pytest.mark.long)])
def test_laws_of_contact(interaction: str, tmp_path: Path) -> None:
    """What pressures store comes back; what a damper takes is told."""
    run = ran(tmp_path, impact("C3D8", "C3D8", interaction=interaction, cells=4))
    history = run.history
    taken = history["contact_damping_loss"] + history["contact_energy"]
    total = history["kinetic"] + history["strain"] + taken
    assert run.verdict["verdict"] == "good", run.log[-600:]
    assert np.ptp(total) <= BALANCE*total.max()
    assert history["active"].max() > 0
    if "DAMPING" in interaction:
        assert history["contact_damping_loss"][-1] > 0.0
    p = moments(run, "px py pz")
    assert np.abs(p - p[0]).max() <= BALANCE*np.abs(p).max()


def test_a_mirrored_scene_is_mirrored(tmp_path: Path) -> None:
    """A cube on one of its edges, from either side."""
    ends = []
    for k, angle in enumerate([0.1, -0.1]):
        folder = tmp_path/str(k)
        folder.mkdir()
        run = ran(folder, stack([(2, 2, 2), (3, 3, 2)], 0.03, angle))
        ends.append(run.history["lx"])
        check_impact(run)
    assert np.ptp(ends[0]) <= BALANCE


@pytest.mark.parametrize("cells", [(2, 2), (2, 3)])
def test_a_block_that_slides_off_keeps_its_mirror(cells: tuple[int, int], tmp_path: Path) -> None:
    """Without friction over the rim of another one: past the rim the surface fades alike on both sides of the plane."""
    one = Block("C3D8", (cells[0],)*3)
    two = Block("C3D8", (cells[1],)*3, place=lambda x: x - np.array([0, 0, 1.]))
    text = (bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)], "*ELASTIC\n1000., 0.\n*DENSITY\n1.\n") + pair()
            + velocities(one, np.array([1., 0, 0]), np.zeros(3)) + "*BOUNDARY\n"
            + "".join(f"{len(one.x) + k}, 1, 3\n" for k in two.on(2, 0))
            + dynamic(.01, .12, "*DLOAD\nB1, GRAV, 10., 0., 0., -1.\n"))
    fields = ran(tmp_path, text).fields()
    x = fields.x[:len(one.x)]
    mirror = [int(np.argmin(np.abs(x - (p*[1, -1, 1] + [0, 1, 0])).sum(1))) for p in x]
    for u in fields["displacement"][:, :len(x)]:
        assert np.abs(u - u[mirror]*[1, -1, 1]).max() <= 64*EPSILON


def scaled(text: str, power: int) -> str:
    """Coordinates, times, velocities of a deck in a unit of length 2**power times smaller; speeds alike."""
    unit, out, card = 2.0**power, [], ""
    for line in text.splitlines():
        if line.startswith("*"):
            card = line.split(",")[0]
        elif card == "*NODE":
            label, *x = line.split(",")
            line = ", ".join([label, *(repr(float(w)*unit) for w in x)])
        elif card == "*DYNAMIC":
            line = ", ".join(repr(float(w)*unit) for w in line.split(","))
        out.append(line)
    return "\n".join(out) + "\n"


def test_bits_do_not_depend_on_units(tmp_path: Path) -> None:
    """In a unit of length and time 1024 times smaller: the same velocities."""
    text = impact("C3D8", "C3D4").replace("*NODE FILE\nU\n", "*NODE FILE\nU, V\n")
    found = []
    for power in (0, 10):
        folder = tmp_path/str(power)
        folder.mkdir()
        found.append(ran(folder, scaled(text, power)).fields()["velocity"][-1])
    assert np.array_equal(found[0], found[1])


def test_bits_do_not_depend_on_a_restart(tmp_path: Path) -> None:
    whole = ran(tmp_path, impact("C3D8", "C3D8", "*RESTART, WRITE, FREQUENCY=10\n"))
    short = tmp_path/"short"
    short.mkdir()
    deck = short/"deck.inp"
    deck.write_text(impact("C3D8", "C3D8", "*RESTART, WRITE, FREQUENCY=10\n"))
    run_deck(deck, short, 0)
    assert whole.digits() == Run(short/"deck").digits()


def test_iterations_give_way_to_factors(tmp_path: Path) -> None:
    """Flat faces that land on each other: in sets that iterations find some rows follow from others. Factors find one,
    from there on, and a run that is resumed knows; the motion is that of factors."""
    one = Block("C3D8", (8, 8, 3), place=lambda x: x + np.array([0, 0, 0.003]))
    two = Block("C3D8", (8, 8, 3), place=lambda x: x - np.array([0, 0, 1]))
    z = np.concatenate([one.x[:, 2], two.x[:, 2]])
    speed = np.repeat([-1.0, 0.0], [len(one.x), len(two.x)]) + 0.5*z
    scene = (bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)]) + pair()
             + "*INITIAL CONDITIONS, TYPE=VELOCITY\n"
             + "".join(f"{k}, 3, {v!r}\n" for k, v in enumerate(speed.tolist(), 1)))

    def run(solver: str, until: float) -> Run:
        folder = tmp_path/f"{solver}{until}"
        folder.mkdir()
        return ran(folder, scene + f"*STEP, NLGEOM, INC=8\n*DYNAMIC, DIRECT, SOLVER={solver}\n0.002, {until}\n"
                   "*RESTART, WRITE, FREQUENCY=8\n*NODE FILE, FREQUENCY=8\nU\n*END STEP\n")

    whole, part, direct = run("ITERATIVE", 0.016), run("ITERATIVE", 0.012), run("DIRECT", 0.016)
    assert whole.verdict["verdict"] == "good"
    file = tmp_path/"ITERATIVE0.012"/"deck.rst.h5"
    with h5py.File(file) as restart:
        assert "factor_complete" in restart["integers"]
    subprocess.run([PROGRAM, "restart", file, "--until", "0.016", "--output", tmp_path, "--quiet"], check=True)
    resumed = Run(tmp_path/"deck").history
    for name in ("kinetic", "strain", "active"):
        assert resumed[name][-1] == whole.history[name][-1]
    assert part.history["active"].max() > 70
    for name in ("kinetic", "strain"):
        assert whole.history[name][-1] == pytest.approx(direct.history[name][-1], rel=1.0e-10)


@pytest.mark.parametrize(("h", "until", "is_hill"), [(0.05, 1.5, False), (0.0125, 0.5, False), (0.05, 1.2, True)])
def test_sliding_over_facets(h: float, until: float, is_hill: bool, tmp_path: Path) -> None:
    """Over sides and vertices of facets that turn by .05 each: nothing is lost, no step is cut."""
    run = ran(tmp_path, slide(h, until, is_hill))
    assert run.verdict["verdict"] == "good"
    assert run.verdict["largest_energy_error"] <= 1.0e-13*run.verdict["largest_energy"]
    assert run.history["cuts"].sum() == 0
    assert run.history["active"].max() >= 3
    travelled = run.fields()["displacement"][-1, 0, 0]
    assert travelled > 0.35*4.0*until


@pytest.mark.parametrize("angle", [0.5, 1.0])
def test_rest_in_a_dent(angle: float, tmp_path: Path) -> None:
    """Two feet are pulled to a fold of the floor and come to rest on it, where a sharp gap has no gradient."""
    run = ran(tmp_path, dent(angle))
    assert run.verdict["verdict"] == "good"
    feet = (run.fields().x + run.fields()["displacement"])[-1, 2:4]
    width = 0.1*np.sqrt(0.8*0.45)                # a patch of the shorter facets
    assert np.abs(feet[:, 1]).max() < 0.5*width
    assert run.history["newton"][1:].max() <= 9
    last = [float(word) for word in run.increments[-1][-1].split()[9:]]
    assert len(last) <= 8


def test_nodes_without_faces(tmp_path: Path) -> None:
    """A slave surface of nodes of the ball: on the faces of its elements, as the surface of these."""
    ends = []
    for k, kind in enumerate(["face", "node"]):
        text = impact("C3D8", "C3D8", options=", SIDES=ONE")
        if kind == "node":
            head, rest = text.split("*SURFACE, NAME=S1\n")
            cut = rest.index("*")
            block = Block("C3D8", (2, 2, 2))
            outer = sorted({int(n) for axis in range(3) for end in (0, 1) for n in block.on(axis, end)})
            nodes = "".join(f"{n}\n" for n in outer)
            text = head + "*SURFACE, NAME=S1, TYPE=NODE\n" + nodes + rest[cut:]
        folder = tmp_path/str(k)
        folder.mkdir()
        ends.append(ran(folder, text).fields()["displacement"][-1])
    assert np.array_equal(ends[0], ends[1])


@pytest.mark.parametrize("cells", [[(2, 2, 2), (2, 2, 2)], [(1, 1, 1), (1, 1, 1)]])
@pytest.mark.parametrize("is_whole", [False, True])
@pytest.mark.parametrize("sides", ["", ", SIDES=ONE"])
def test_pressure_by_the_overclosure(sides: str, is_whole: bool, cells: list[tuple[int, int, int]],
                                     tmp_path: Path) -> None:
    """A soft layer between two cubes: springs in a row, also where nodes stand at the ends of both surfaces, and
    where the surfaces are the whole outlines: the other faces at an edge are not pressed."""
    text = press(cells, ["C3D8", "C3D8"], 0.02, turned(0.0), is_whole=is_whole).replace(
        "NAME=I\n", "NAME=I\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n500.\n", 1)
    run = ran(tmp_path, text.replace("INTERACTION=I\n", f"INTERACTION=I{sides}\n"))
    # Two cubes of E = 1000 and height 1, and a layer of 500: flexibilities add up.
    assert abs(run.history["pair1_force_z"][-1]) == pytest.approx(0.02/(2/1000 + 1/500), rel=1.0e-4)


def test_momenta_of_explicit_steps(tmp_path: Path) -> None:
    """Pushes along gradients at the start of each step have no moment there."""
    text = impact("C3D8", "C3D8").replace("*DYNAMIC, DIRECT\n0.02, 0.9", "*DYNAMIC, DIRECT, EXPLICIT\n0.004, 0.5")
    run = ran(tmp_path, text)
    p, angular = moments(run, "px py pz"), moments(run, "lx ly lz")
    assert run.history["active"].max() > 0
    assert np.abs(p - p[0]).max() <= BALANCE*np.abs(p).max()
    assert np.abs(angular - angular[0]).max() <= BALANCE*np.abs(angular).max()


@pytest.mark.parametrize("angle", [0.2, 0.3, 0.5])
def test_cubes_on_an_edge_come_to_an_end(angle: float, tmp_path: Path) -> None:
    """Nodes at the ends of both surfaces come and go: energy is kept, no step is given up."""
    run = ran(tmp_path, stack([(2, 2, 2), (3, 3, 3)], 0.0, angle))
    history = run.history
    assert history["time"][-1] == pytest.approx(0.6)
    assert np.ptp(history["total"]) <= BALANCE*history["total"].max()


@pytest.mark.parametrize(("to", "at", "h"), [((0.424, 0.483, -0.699), (-0.027, -0.467), 0.02),
                                             ((-0.405, 0.603, -0.769), (-0.077, 0.133), 0.01)])
def test_corner_first_on_one_element(to: tuple[float, float, float], at: tuple[float, float], h: float,
                                     tmp_path: Path) -> None:
    """The frame of a corner looks at the side of the other body, too, at the limit of what faces it: where that is left to
    fade, the top does not. The corner fell through by .06 of the face."""
    way = np.array(to)/np.linalg.norm(to)
    about, c = np.cross(way, [0, 0, -1]), -way[2]
    cross = np.array([[0, -about[2], about[1]], [about[2], 0, -about[0]], [-about[1], about[0], 0]])
    turn = np.eye(3) + cross + cross @ cross/(1 + c)
    one = Block("C3D4", (2, 2, 2), place=lambda x: (x - 0.5)*1.5 @ turn.T)
    one.x += np.array([*at, 0.01 - one.x[:, 2].min()])
    two = Block("C3D8", (1, 1, 1), place=lambda x: x - np.array([0.5, 0.5, 1.0]))
    run = ran(tmp_path, bodies([one, two], [faces(one), faces(two)]) + pair() + velocities(one, (0., 0., -2.), (0., 0., 0.))
              + dynamic(h, 0.4))
    assert run.verdict["verdict"] == "good"
    assert run.verdict["penetration"] < 1e-6
    assert overlap.worst(run.fields()).by_edge < 1e-6
