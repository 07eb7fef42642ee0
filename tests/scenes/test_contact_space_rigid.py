"""Rigid bodies in contact in space: dropped, tumbling, spinning, driven; against closed forms of rigid mechanics."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import overlap
import pytest
from contact_space_scenes import RUBBER, ball, bodies, dynamic, faces, pair, quadratic_increments, velocities
from scene_tools import EPSILON, Run, run_deck
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from space_mesh import Block

#: Energy and momenta, of the largest of each.
BALANCE = 1.0e-11
GRAVITY = 10.0
WEIGHT = f"*DLOAD\nB1, GRAV, {GRAVITY}, 0., 0., -1.\n"
#: How a cube falls: on a face, an edge, a corner, and askew.
WAYS = {"face": Rotation.identity(), "edge": Rotation.from_rotvec([np.pi/4, 0, 0]),
        "corner": Rotation.from_rotvec(np.arccos(-1/np.sqrt(3))*np.array([-1, 1, 0])/np.sqrt(2)),
        "askew": Rotation.from_rotvec([.3, .2, .1])}


def ran(folder: Path, text: str) -> Run:
    folder.mkdir(exist_ok=True)
    (folder/"deck.inp").write_text(text)
    return run_deck(folder/"deck.inp", folder)


def columns(run: Run, names: str) -> np.ndarray:
    return np.array([run.history[name] for name in names.split()]).T


def rigid(i: int, block: Block, held: str = "", v: tuple | np.ndarray = (0, 0, 0),
          w: tuple | np.ndarray = (0, 0, 0)) -> str:
    """Body `i` is rigid about its middle: the lines of *BOUNDARY that hold it, or how it flies."""
    node = 9000 + i
    text = f"*NODE\n{node}, " + ", ".join(map(repr, block.x.mean(0).tolist())) + (
        f"\n*RIGID BODY, ELSET=B{i}, REF NODE={node}\n")
    if held:
        return text + "*BOUNDARY\n" + "".join(f"{node}, {line}\n" for line in held.split(";"))
    return text + "*INITIAL CONDITIONS, TYPE=VELOCITY\n" + "".join(
        f"{node}, {k}, {float(s)!r}\n" for k, s in enumerate([*v, *w], 1) if s)


def box(cells: int, way: Rotation, gap: float, size: tuple = (1, 1, 1), kind: str = "C3D8") -> Block:
    """A box above the plane z = 0, with its middle on the axis z."""
    block = Block(kind, (cells,)*3, size=size)
    block.x = way.apply(block.x - block.x.mean(0))
    block.x[:, 2] += gap - block.x[:, 2].min()
    return block


def plate(cells: int, width: float, kind: str = "C3D8") -> Block:
    return Block(kind, (cells, cells, 1), size=(width, width, 1),
                 place=lambda x: x - np.array([width/2, width/2, 1.0]))


def scene(one: Block, two: Block, bodies_text: str, step: str, interaction: str = "") -> str:
    name = "*SURFACE INTERACTION, NAME=I" + interaction
    return (bodies([one, two], [faces(one), faces(two)]) + pair().replace("*SURFACE INTERACTION, NAME=I", name)
            + bodies_text + step)


def places(run: Run, block: Block, first: int = 0) -> np.ndarray:
    """(n_frame, n_node, 3) of the nodes of a block."""
    fields, own = run.fields(), slice(first, first + len(block.x))
    return fields.x[own] + fields["displacement"][:, own]


def speed(x: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Velocity of the middle and spin of a body that flies, of the last increment: an angle phi is that of h times the
    spin as a map of Cayley has it, 2 tan(phi/2)."""
    before, after = x[-2] - x[-2].mean(0), x[-1] - x[-1].mean(0)
    turn = Rotation.align_vectors(after, before)[0].as_rotvec()
    half = max(0.5*float(np.linalg.norm(turn)), 1.0e-12)
    return (x[-1].mean(0) - x[-2].mean(0))/h, turn/h*(np.tan(half)/half)


def check(run: Run, is_free: bool = True) -> None:
    history = run.history
    assert run.verdict["verdict"] == "good", run.log[-600:]
    assert np.ptp(history["total"]) <= BALANCE*history["total"].max()
    if is_free:
        for names in ("px py pz", "lx ly lz"):
            found = columns(run, names)
            assert np.abs(found - found[0]).max() <= BALANCE
    assert history["cuts"].sum() == 0
    assert history["active"].max() > 0
    assert overlap.worst(run.fields()).depth <= 64*EPSILON


@pytest.mark.each_value
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("cells", [1, 3])
@pytest.mark.parametrize("below", ["elastic", "free", "fixed"])
def test_a_box_is_dropped(below: str, cells: int, way: str, tmp_path: Path) -> None:
    """On a plate that gives way, one that flies off, one that stays: there straight it comes back as it came."""
    one, two = box(cells, WAYS[way], 0.03), plate(2, 2.0)
    on = {"elastic": "", "free": rigid(2, two), "fixed": rigid(2, two, "1, 6")}[below]
    run = ran(tmp_path, scene(one, two, rigid(1, one, v=(0, 0, -1)) + on, dynamic(0.02, 0.4)))
    check(run, below != "fixed")
    if below == "fixed" and way != "askew":
        v, w = speed(places(run, one), 0.02)
        assert np.abs(v - [0, 0, 1]).max() <= 1.0e-10
        assert np.abs(w).max() <= 1.0e-9


@pytest.mark.parametrize("interaction", ["", "*FRICTION\n.3\n"], ids=["smooth", "rough"])
@pytest.mark.parametrize("way", [WAYS["face"], Rotation.from_rotvec([0.02, 0.013, 0.3])], ids=["flat", "leaning"])
@pytest.mark.parametrize("is_rigid", [False, True], ids=["elastic", "rigid"])
def test_redundant_contacts_by_saddle_point(is_rigid: bool, way: Rotation, interaction: str, tmp_path: Path) -> None:
    """Four corners on one plate, three motions; rows of rigid bodies stay in the matrix, and nodes that only they hold have
    no mass. The steps are those of the null space."""
    one, two = box(1, way, 0.03), plate(2, 2.0)
    step = dynamic(0.02, 0.1, "*CONSTRAINT METHOD, TYPE=SADDLE POINT\n")
    text = scene(one, two, rigid(1, one, v=(0, 0, -1)) + (rigid(2, two) if is_rigid else ""), step).replace(
        "*SURFACE INTERACTION, NAME=I\n", f"*SURFACE INTERACTION, NAME=I\n{interaction}")
    runs = [ran(tmp_path/name, text.replace("SADDLE POINT", name)) for name in ("SADDLE POINT", "NULL SPACE")]
    for run in runs:
        total = run.history["total"] + (run.history["friction_loss"] if interaction else 0.0)
        assert run.verdict["verdict"] == "good" and run.history["cuts"].sum() == 0 and run.history["active"].max() > 0
        assert np.ptp(total) <= BALANCE*total.max()
        assert overlap.worst(run.fields()).depth <= 64*EPSILON
    u = [run.fields()["displacement"] for run in runs]
    assert np.abs(u[0] - u[1]).max() <= BALANCE*np.abs(u[1]).max()


def test_a_box_tumbles_by_eulers_equations(tmp_path: Path) -> None:
    """Above a plate that it hits later: places by a fine integration, of second order; then balances."""
    size, spin, until = np.array([1.0, 0.7, 0.4]), np.array([2.0, 3.0, 1.0]), 0.4
    inertia = (size @ size - size**2)/12

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        x, w = y[:9].reshape(3, 3), y[9:]
        return np.concatenate([(x @ np.cross(np.eye(3), w)).ravel(), np.cross(inertia*w, w)/inertia])

    exact = solve_ivp(rate, (0, until), [*np.eye(3).ravel(), *spin], rtol=1e-12, atol=1e-13).y[:9, -1].reshape(3, 3)
    error = []
    for n in (20, 40):
        h = until/n
        one, two = box(1, Rotation.identity(), 0.9, tuple(size)), plate(2, 4.0)
        run = ran(tmp_path/str(n), scene(one, two, rigid(1, one, v=(0, 0, -1), w=spin) + rigid(2, two, "1, 6"),
                                         dynamic(h, 1.2)))
        check(run, False)
        x = places(run, one)
        k = int(np.argmin(np.abs(run.fields().time - until)))
        assert run.history["active"][:k + 1].max() == 0
        error.append(np.abs(x[k] - x[k].mean(0) - (one.x - one.x.mean(0)) @ exact.T).max())
    assert error[0] < 0.03
    assert error[0]/error[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("cells", [1, pytest.param(2, marks=pytest.mark.long)])
def test_a_top_on_a_plane(cells: int, tmp_path: Path) -> None:
    """A cube spins on its corner: with moments of inertia A, spin n and height l of its middle it goes round at the
    slow root of A cos(theta) Omega^2 - A n Omega + m g l = 0, at its angle; of second order."""
    theta, spin, until, a, arm = 0.4, 60.0, 0.2, 1/6, np.sqrt(3)/2
    around = (a*spin - np.sqrt((a*spin)**2 - 4*a*np.cos(theta)*GRAVITY*arm))/(2*a*np.cos(theta))
    axis = np.array([np.sin(theta), 0, np.cos(theta)])
    w = (spin - around*np.cos(theta))*axis + np.array([0, 0, around])
    error = []
    for h in (0.004, 0.002):
        one, two = box(cells, Rotation.from_rotvec([0, theta, 0])*WAYS["corner"], 0.0), plate(2, 4.0)
        tip = int(one.x[:, 2].argmin())
        run = ran(tmp_path/repr(h), scene(one, two, rigid(1, one, w=w) + rigid(2, two, "1, 6"),
                                          dynamic(h, until, WEIGHT)))
        check(run, False)
        x = places(run, one)
        assert np.abs(x[:, tip, 2]).max() <= 1.0e-12
        assert run.history["active"][1:].min() == 1
        lean = (x.mean(1) - x[:, tip])/arm
        turned = np.arctan2(lean[-1, 1], lean[-1, 0])
        error.append([abs(turned/until - around), np.ptp(np.arccos(lean[:, 2])), np.abs(x.mean(1)[-1, :2] - x[0].mean(0)[:2]).max()])
        assert np.ptp(run.history["lz"]) <= 1.0e-5*run.history["lz"][0]
    assert error[0][0] < 0.02*around
    for coarse, fine in zip(*error, strict=True):
        assert coarse/fine == pytest.approx(4.0, rel=0.15)


@pytest.mark.parametrize("angle", [0.0, 0.5, 0.9])
def test_balls_collide(angle: float, tmp_path: Path) -> None:
    """A corner of one meets the middle of a face of another on the line between their middles: the parts of velocities
    along it go over by the masses, those across stay. The corner slides off the line by v h at most, and that squared,
    over the square of the radius of gyration, is what is left of the impulse."""
    h, v = 0.01, np.array([0.0, 0.0, -1.0])
    n = np.array([np.sin(angle), 0, np.cos(angle)])
    way = Rotation.from_rotvec([0, angle, 0])
    one, two = (Block("C3D8", (cells,)*3, size=(2, 2, 2), place=lambda x: way.apply(ball(x))) for cells in (3, 4))
    one.x += ((one.x @ n).max() + (two.x @ n).max())*n - 0.113*v
    run = ran(tmp_path, scene(one, two, rigid(1, one, v=v) + rigid(2, two), dynamic(h, 0.3)))
    check(run)
    mass = [cell_volume(block) for block in (one, two)]
    assert -run.history["pz"][0] == pytest.approx(mass[0], rel=1e-12)
    closing = -(v @ n)
    impulse = 2*mass[0]*mass[1]/(mass[0] + mass[1])*closing
    bound = (np.sin(angle)*h)**2/0.4 + 1.0e-10
    for block, first, was, share in ((one, 0, v, impulse/mass[0]), (two, len(one.x), 0*v, -impulse/mass[1])):
        found, _ = speed(places(run, block, first), h)
        assert np.abs(found - was - share*n).max() <= bound*closing


def cell_volume(block: Block) -> float:
    """By 2^3 points of Gauss."""
    corner = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])*2.0 - 1
    total = 0.0
    for p in corner/np.sqrt(3):
        factor = 1 + corner*p
        slope = np.array([corner[:, a]*np.delete(factor, a, 1).prod(1) for a in range(3)])/8
        total += sum(np.linalg.det(slope @ block.x[np.array(nodes) - 1]) for nodes in block.element)
    return total


@pytest.mark.parametrize(("cells", "restitution"), [
    (1, 0.5), (1, 0.0), pytest.param(2, 0.5, marks=pytest.mark.long)])
def test_a_box_comes_to_rest(cells: int, restitution: float, tmp_path: Path) -> None:
    """It tumbles without friction, loses at each impact, and lies flat at the end: what is left is its spin about the
    vertical and its flight along the plane. Energy goes down, never up."""
    one, two = box(cells, WAYS["askew"], 0.03), plate(2, 6.0)
    run = ran(tmp_path, scene(one, two, rigid(1, one, v=(0.2, 0, -1), w=(3, 2, 1)) + rigid(2, two, "1, 6"),
                              dynamic(0.01, 2.2, WEIGHT), f", RESTITUTION={restitution}"))
    history = run.history
    assert run.verdict["verdict"] == "good"
    assert history["cuts"].sum() == 0
    assert np.diff(history["total"]).max() <= BALANCE*history["kinetic"].max()
    x = places(run, one)
    _, w = speed(x, 0.01)
    assert overlap.worst(run.fields()).depth <= 64*EPSILON
    assert history["restitution_loss"][-1] == pytest.approx(history["total"][0] - history["total"][-1], rel=1e-10)
    assert np.abs(w[:2]).max() <= 1.0e-3
    left = 0.5*(history["px"]**2 + history["py"]**2)[-1] + 3*w[2]**2/36
    assert history["kinetic"][-1] == pytest.approx(left, rel=1.0e-6)
    # Of gravity no normal of its faces is more than an increment off: the part along the plane changes little.
    assert np.abs(columns(run, "px py")[-1] - [0.2, 0]).max() <= 1.0e-3


def test_a_driven_plate_throws_a_box(tmp_path: Path) -> None:
    """A plate of speed V leaves a box that was at rest 2 V."""
    one, two = box(2, Rotation.identity(), 0.05), plate(3, 2.0)
    step = dynamic(0.01, 0.2, "*BOUNDARY, AMPLITUDE=A\n9002, 3, 3, 1.\n")
    run = ran(tmp_path, scene(one, two, rigid(1, one) + rigid(2, two, "1, 2;4, 6")
                              + "*AMPLITUDE, NAME=A\n0., 0., 1., .7\n", step))
    assert run.verdict["verdict"] == "good"
    v, w = speed(places(run, one), 0.01)
    assert np.abs(v - [0, 0, 1.4]).max() <= 1.0e-10
    assert np.abs(w).max() <= 1.0e-9
    history = run.history
    assert history["external_work"][-1] == pytest.approx(0.5*1.4**2 + history["external_work"][1], rel=1e-10)


def test_a_rigid_punch(tmp_path: Path) -> None:
    """On a block of its own width, without a Poisson's ratio: force by the shortening, equal at all its nodes' shares."""
    by, modulus = 0.02, 1000.0
    one, two = box(2, Rotation.identity(), 0.0), plate(3, 1.0)
    first = len(one.x)
    text = bodies([one, two], [faces(one), faces(two)], f"*ELASTIC\n{modulus}, 0.\n") + pair()
    text += rigid(1, one, "1, 2;4, 6") + "*NSET, NSET=FOOT\n" + "".join(f"{first + k}\n" for k in two.on(2, 0))
    text += ("*BOUNDARY\nFOOT, 1, 3\n*STEP, NLGEOM=NO\n*STATIC\n1., 1.\n*BOUNDARY\n" + f"9001, 3, 3, {-by}\n"
             + "*NODE FILE\nU, RF\n*EL FILE\nS\n*END STEP\n")
    run = ran(tmp_path, text)
    fields = run.fields()
    stress = fields["cauchy_stress"][-1][len(one.element):len(one.element) + len(two.element)]
    assert run.verdict["verdict"] == "good"
    assert np.ptp(stress[:, 2]) <= 1.0e-10*modulus*by
    assert np.abs(places(run, one)[-1] - one.x - [0, 0, -by]).max() <= 1.0e-14
    assert fields["reaction_force"][-1][:first].sum(0)[2] + fields["reaction_force"][-1][-1][2] == pytest.approx(
        -modulus*by, rel=0.03)


@pytest.mark.parametrize("held", ["", pytest.param("1, 6", marks=pytest.mark.long)])
def test_a_ball_bounces_off_a_rigid_plate(held: str, tmp_path: Path) -> None:
    """An elastic ball, askew with a spin, on one that is free or fixed; Newton's method is quadratic: each residual is
    about the square of the one before, or round-off."""
    one = Block("C3D8", (4, 4, 4), size=(2, 2, 2), place=lambda x: ball(x) + np.array([0, 0, 1.06]))
    two = plate(5, 3.0)
    run = ran(tmp_path, scene(one, two, velocities(one, (.6, .25, -1), (0, 0, 1)) + rigid(2, two, held),
                              dynamic(0.02, 1.2, "*NEWTON, TYPE=FULL\n")))
    check(run, not held)
    assert run.history["active"][-1] == 0
    assert quadratic_increments(run) > 10


@pytest.mark.parametrize("cells", [4, 6])
def test_nothing_holds_a_ball_in_the_air(cells: int, tmp_path: Path) -> None:
    """It flies away from a plate of one face that is much larger than its own, and turns: its nodes see the rim of the
    plate along slanted normals, and far from it."""
    one = Block("C3D8", (cells,)*3, size=(2, 2, 2), place=lambda x: Rotation.from_rotvec([.15, 0, 0]).apply(ball(x)))
    one.x[:, 2] += 0.3 - one.x[:, 2].min()
    two = plate(1, 6.0)
    text = (bodies([one, two], [faces(one), faces(two, 2, 1)]) + pair() + rigid(1, one, v=(.8, .3, .4), w=(0, 0, 1))
            + rigid(2, two, "1, 6") + dynamic(0.04, 2.0))
    history = ran(tmp_path, text).history
    assert history["active"].max() == 0
    assert np.ptp(history["px"]) <= BALANCE


def test_bodies_without_a_pair_are_found(tmp_path: Path) -> None:
    one, two = box(1, WAYS["askew"], 0.03), plate(2, 2.0)
    text = bodies([one, two], [faces(one), faces(two)], RUBBER) + rigid(1, one, v=(0, 0, -1)) + rigid(2, two)
    folder = tmp_path/"deck.inp"
    folder.write_text(text + dynamic(0.02, 0.4))
    run = run_deck(folder, tmp_path, 3)
    assert run.verdict["penetration"] == pytest.approx(overlap.worst(run.fields()).by_edge, rel=0.1)
