"""Rigid bodies of three dimensions: a free top, a heavy one on a joint, one that holds a beam."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scene_tools import Run, emcon, run_deck
from scipy.spatial.transform import Rotation
from space_mesh import Block

LAW = "*HYPERELASTIC, NEO HOOKE\n20., 0.01\n"
#: A rod with a square section: its moments of inertia about its axis z, and about x and y.
SIZE, DENSITY = (1.0, 1.0, 2.0), 0.5
MASS = DENSITY*SIZE[0]*SIZE[1]*SIZE[2]
ALONG, ACROSS = MASS*2/12, MASS*(SIZE[0]**2 + SIZE[2]**2)/12
REFERENCE = 9999


def top(kind: str, reference: tuple[float, float, float], tilt: Rotation, spin: np.ndarray,
        velocity: tuple[float, float, float], step: str) -> tuple[str, np.ndarray]:
    """The deck of a rod that is turned by `tilt` about its reference node, and its nodes."""
    mesh = Block(kind, (1, 1, 2), SIZE)
    at = np.array(reference)
    mesh.x = at + tilt.apply(mesh.x - at)
    starts = "".join(f"{REFERENCE}, {k}, {v!r}\n"
                     for k, v in enumerate([*velocity, *map(float, spin)], 1))
    return mesh.deck("", f"*NODE\n{REFERENCE}, {', '.join(map(repr, map(float, at)))}\n"
                     f"*RIGID BODY, ELSET=ALL, REF NODE={REFERENCE}\n"
                     f"*INITIAL CONDITIONS, TYPE=VELOCITY\n{starts}{step}", DENSITY), mesh.x


def run(text: str, folder: Path) -> Run:
    folder.mkdir(exist_ok=True)
    (folder/"deck.inp").write_text(text)
    return run_deck(folder/"deck.inp", folder)


def dynamic(h: float, n: int, cards: str = "") -> str:
    return (f"*STEP, NLGEOM, INC={n}\n*DYNAMIC, DIRECT\n{h!r}, {h*n!r}\n{cards}"
            f"*NODE FILE, FREQUENCY={n}\nU\n*END STEP\n")


def drift(history: np.ndarray, names: list[str]) -> float:
    size = np.sqrt(sum(history[name][0]**2 for name in names))
    return max(np.abs(history[name] - history[name][0]).max() for name in names)/size


def shape_error(x: np.ndarray, rest: np.ndarray) -> float:
    def apart(p: np.ndarray) -> np.ndarray:
        return np.linalg.norm(p[:, None] - p[None], axis=2)
    return float(np.abs(apart(x) - apart(rest)).max()/apart(rest).max())


TILT = Rotation.from_rotvec([0.3, -0.5, 0.2])
SPIN = np.array([0.9, -0.4, 2.5])
CENTRE, VELOCITY = (0.5, 0.5, 1.0), (0.25, -0.5, 0.125)


@pytest.mark.parametrize("kind", ["C3D8", "C3D10"])
def test_a_free_top(kind: str, tmp_path: Path) -> None:
    """Energy, six momenta and shape over 1000 increments, with the moments of inertia of a rod."""
    text, rest = top(kind, CENTRE, TILT, SPIN, VELOCITY, dynamic(0.05, 1000))
    found = run(text, tmp_path)
    history = found.history
    assert len(history) == 1001
    for names in (["total"], ["px", "py", "pz"], ["lx", "ly", "lz"]):
        assert drift(history, names) <= 1e-12, names
    own = TILT.inv().apply(SPIN)
    inertia = np.array([ACROSS, ACROSS, ALONG])
    kinetic = 0.5*inertia @ own**2 + 0.5*MASS*np.dot(VELOCITY, VELOCITY)
    assert history["kinetic"][0] == pytest.approx(kinetic, rel=1e-13)
    momentum = TILT.apply(inertia*own) + MASS*np.cross(CENTRE, VELOCITY)
    for name, wanted in zip(("lx", "ly", "lz"), momentum, strict=True):
        assert history[name][0] == pytest.approx(wanted, abs=1e-13*np.linalg.norm(momentum))
    x = found.fields().x + found.fields()["displacement"][-1]
    assert shape_error(x[:len(rest)], rest) <= 1e-12


def test_it_precesses_as_a_symmetric_top_does(tmp_path: Path) -> None:
    """About the angular momentum by |L| t over the moment across, and about its own axis by what
    is left of its spin: places come near at second order."""
    own = TILT.inv().apply(SPIN)
    momentum = TILT.apply(own*[ACROSS, ACROSS, ALONG])
    time = 4.0
    turn = (Rotation.from_rotvec(momentum/ACROSS*time)
            * Rotation.from_rotvec(TILT.apply([0, 0, own[2]*(1 - ALONG/ACROSS)*time])))
    error = []
    for k, n in enumerate((200, 400)):
        text, rest = top("C3D8", CENTRE, TILT, SPIN, VELOCITY, dynamic(time/n, n))
        fields = run(text, tmp_path/str(k)).fields()
        exact = turn.apply(rest - CENTRE) + CENTRE + np.array(VELOCITY)*time
        found = fields.x + fields["displacement"][-1]
        error.append(np.abs(found[:len(rest)] - exact).max())
    assert error[0] < 0.02
    assert error[0]/error[1] == pytest.approx(4.0, rel=0.1)


def test_a_heavy_top_on_a_joint(tmp_path: Path) -> None:
    """Its foot is held, its weight pulls: energy, and the angular momentum about the vertical."""
    foot = (0.5, 0.5, 0.0)
    text, rest = top("C3D8", foot, Rotation.from_rotvec([0.4, 0, 0]), np.array([0, -4.0, 9.0]),
                     (0, 0, 0), f"*BOUNDARY\n{REFERENCE}, 1, 3\n" + dynamic(
                         0.02, 500, "*DLOAD\nALL, GRAV, 5., 0., 0., -1.\n"))
    found = run(text, tmp_path)
    history = found.history
    # About the vertical through the foot: the momentum moves the axis from the origin.
    lz = history["lz"] - (foot[0]*history["py"] - foot[1]*history["px"])
    assert np.abs(lz - lz[0]).max() <= 1e-12*abs(lz[0])
    assert np.abs(history["total"] - history["total"][0]).max() <= 1e-12*history["kinetic"].max()
    assert np.ptp(history["kinetic"]) > 0.01*history["kinetic"].max()
    x = found.fields().x + found.fields()["displacement"][-1]
    assert np.array_equal(x[-1], foot)
    assert shape_error(x[:len(rest)], rest) <= 1e-12


def test_a_held_body_is_a_clamp(tmp_path: Path) -> None:
    """A beam whose first cells are rigid and held bends as one whose nodes there are held; held at
    one point but free to turn it is told to be free."""
    mesh = Block("C3D8", (6, 1, 1), (6, 1, 1))
    nodes = "".join(f"{k}, 1, 3\n" for k in range(1, len(mesh.x) + 1) if mesh.x[k - 1, 0] < 1.5)
    end = "".join(f"{k}, 3, -0.01\n" for k in mesh.on(0, 1))
    rigid = (f"*NODE\n{REFERENCE}, 0.5, 0.5, 3.\n*ELSET, ELSET=FOOT\n1\n"
             f"*RIGID BODY, ELSET=FOOT, REF NODE={REFERENCE}\n")
    step = (f"*STEP, NLGEOM\n*STATIC\n1., 1.\n*CLOAD\n{end}*NODE FILE\nU\n*END STEP\n")
    held = run(mesh.deck(LAW, f"*BOUNDARY\n{nodes}{step}"), tmp_path/"nodes").fields()
    bodies = run(mesh.deck(LAW, f"{rigid}*BOUNDARY\n{REFERENCE}, ENCASTRE\n{step}"),
                 tmp_path/"body").fields()
    wanted = held["displacement"][-1]
    found = bodies["displacement"][-1][:len(wanted)]
    assert np.abs(wanted).max() > 0.01
    assert np.abs(found - wanted).max() <= 1e-10*np.abs(wanted).max()
    (tmp_path/"free.inp").write_text(mesh.deck(LAW, f"{rigid}*BOUNDARY\n{REFERENCE}, PINNED\n{step}"))
    done = emcon(tmp_path/"free.inp", "--quiet", "--output", tmp_path)
    assert done.returncode == 3
    assert "free to rotate about x, rotate about y, rotate about z" in done.stderr


def test_nodes_and_a_node_for_rotations_as_calculix_gives_them(tmp_path: Path) -> None:
    """NSET= of all nodes and ROT NODE=: the body of its elements with degrees of freedom 4 to 6, bit for bit."""
    text, _ = top("C3D8", CENTRE, TILT, SPIN, VELOCITY, dynamic(0.05, 20))
    text = text.replace(f"*NODE\n{REFERENCE},", f"*NODE\n9998, 7., 7., 7.\n{REFERENCE},")
    other = text.replace(f"*RIGID BODY, ELSET=ALL, REF NODE={REFERENCE}\n",
                         f"*NSET, NSET=BODY, GENERATE\n1, 12\n*RIGID BODY, NSET=BODY, REF NODE={REFERENCE}, ROT NODE=9998\n")
    for k in (1, 2, 3):
        other = other.replace(f"{REFERENCE}, {k + 3}, ", f"9998, {k}, ")
    assert other.count("9998, ") == 4
    one, two = run(text, tmp_path/"elements").history, run(other, tmp_path/"nodes").history
    for name in one.dtype.names:
        if name not in ("wall", "cpu"):
            assert np.array_equal(one[name], two[name], equal_nan=True), name


def test_a_rigid_end_of_an_elastic_bar_is_turned(tmp_path: Path) -> None:
    """Nodes of an elastic bar that move as a rigid body: a twist by ROT NODE ends as prescribed nodes do."""
    mesh, angle = Block("C3D8", (4, 2, 2), (4, 1, 1)), 0.4
    foot = "".join(f"{k}, 1, 3\n" for k in mesh.on(0, 0))
    end = mesh.on(0, 1)
    middle = np.array([5.0, 0.5, 0.5])                # beside the end: in its plane there were no frame
    nodes = (f"*NODE\n9998, 0., 0., 9.\n{REFERENCE}, 5., .5, .5\n*NSET, NSET=END\n" + ",\n".join(map(str, end))
             + f"\n*RIGID BODY, NSET=END, REF NODE={REFERENCE}, ROT NODE=9998\n")
    step = "*STEP, NLGEOM\n*STATIC\n.25, 1.\n*BOUNDARY\n{}*NODE FILE\nU\n*END STEP\n"
    turned = run(mesh.deck(LAW, f"{nodes}*BOUNDARY\n{foot}{REFERENCE}, 1, 3\n9998, 2, 3\n"
                           + step.format(f"9998, 1, 1, {angle}\n")), tmp_path/"turned").fields()
    places = Rotation.from_rotvec([angle, 0, 0]).apply(mesh.x[np.array(end) - 1] - middle) + middle
    given = "".join(f"{k}, {i + 1}, {i + 1}, {float(u)!r}\n" for k, place in zip(end, places, strict=True)
                    for i, u in enumerate(place - mesh.x[k - 1]))
    wanted = run(mesh.deck(LAW, f"*BOUNDARY\n{foot}" + step.format(given)), tmp_path/"given").fields()["displacement"][-1]
    found = turned["displacement"][-1][:len(wanted)]
    assert np.abs(found - wanted).max() <= 1e-9*np.abs(wanted).max()


@pytest.mark.parametrize("kind", ["DYNAMIC", "STATIC"])
def test_a_driven_turn(kind: str, tmp_path: Path) -> None:
    """By the components of a rotation vector, in statics in a second step on to another, beside driven displacements:
    every node is where it is to be."""
    way = np.array([0.3, 0.0, -0.1])
    turns = np.array([[0.5, -9.0, 2.0], [0.8, -7.0, 0.0]])[:1 if kind == "DYNAMIC" else 2]
    mesh = Block("C3D8", (1, 1, 2), SIZE)
    text = ("*AMPLITUDE, NAME=RAMP\n0., 0., 1., 1.\n" + mesh.deck(
        "", f"*NODE\n{REFERENCE}, {', '.join(map(repr, CENTRE))}\n*RIGID BODY, ELSET=ALL, REF NODE={REFERENCE}\n",
        DENSITY))
    for k, vector in enumerate(turns, 1):
        text += (f"*STEP, NLGEOM\n*{kind}, DIRECT\n.05, 1.\n*BOUNDARY{', AMPLITUDE=RAMP' if kind == 'DYNAMIC' else ''}\n"
                 + "".join(f"{REFERENCE}, {a}, {a}, {v!r}\n" for a, v in enumerate([*(k*way).tolist(), *vector.tolist()], 1))
                 + "*NODE FILE\nU\n*END STEP\n")
    fields = run(text, tmp_path).fields()
    assert len(fields.time) == 1 + 20*len(turns)
    for t, u in zip(fields.time, fields["displacement"], strict=True):
        vector = [np.interp(t, range(len(turns) + 1), [0.0, *turns[:, a]]) for a in range(3)]
        place = CENTRE + Rotation.from_rotvec(vector).apply(mesh.x - CENTRE) + t*way
        assert np.abs(mesh.x + u[:len(mesh.x)] - place).max() <= 1.0e-13


MOMENT = np.array([0.3, -0.7, 0.5])
#: Of the reference node, away from the centre.
FOOT = (0.0, 0.25, -0.5)


def about(history: np.ndarray, point: tuple[float, float, float]) -> np.ndarray:
    """Angular momentum about a point that rests."""
    momentum, angular = (np.array([history[n] for n in names]).T
                         for names in (("px", "py", "pz"), ("lx", "ly", "lz")))
    return angular - np.cross(point, momentum)


@pytest.mark.parametrize("rotation", [False, True])
def test_a_moment_is_the_rate_of_the_angular_momentum(rotation: bool, tmp_path: Path) -> None:
    """Of a tumbling body whose reference node is off its centre, exactly, with work by moments and no resultant; by
    forces on a ROT NODE the same bits."""
    node = 9998 if rotation else REFERENCE
    cards = "".join(f"{node}, {k + (0 if rotation else 3)}, {m!r}\n" for k, m in enumerate(MOMENT.tolist(), 1))
    text, _ = top("C3D8", FOOT, TILT, SPIN, VELOCITY, dynamic(0.05, 200, f"*CLOAD\n{cards}"))
    if rotation:
        text = text.replace(f"*NODE\n{REFERENCE},", f"*NODE\n9998, 7., 7., 7.\n{REFERENCE},").replace(
            f"REF NODE={REFERENCE}", f"REF NODE={REFERENCE}, ROT NODE=9998")
    history = run(text, tmp_path).history
    angular = np.array([history[name] for name in ("lx", "ly", "lz")]).T
    wanted = angular[0] + np.outer(history["time"], MOMENT)
    assert np.abs(angular - wanted).max() <= 1e-12*np.abs(angular).max()
    assert drift(history, ["px", "py", "pz"]) <= 1e-12
    assert history["kinetic"][-1] > 2*history["kinetic"][0]
    assert np.abs(history["total"] - history["total"][0]).max() <= 1e-12*history["kinetic"].max()


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_a_body_on_an_axle(axis: int, tmp_path: Path) -> None:
    """Two rotations held at 0: under a moment about the third it turns as its moment of inertia about that axis says,
    its angular momentum exactly, its angle to second order."""
    held = "".join(f"{REFERENCE}, {k + 3}\n" for k in (1, 2, 3) if k != axis)
    along, moment, time = np.eye(3)[axis - 1], 0.3, 4.0
    out = TILT.apply(np.array(CENTRE) - FOOT)
    inertia = (TILT.inv().apply(along)**2 @ [ACROSS, ACROSS, ALONG] + MASS*(out @ out - (out @ along)**2))
    exact = Rotation.from_rotvec(along*moment*time**2/(2*inertia))
    error = []
    for n in (50, 100):
        text, rest = top("C3D8", FOOT, TILT, np.zeros(3), (0, 0, 0), f"*BOUNDARY\n{REFERENCE}, 1, 3\n{held}"
                         + dynamic(time/n, n, f"*CLOAD\n{REFERENCE}, {axis + 3}, {moment!r}\n"))
        found = run(text, tmp_path/str(n))
        momentum = about(found.history, FOOT)[:, axis - 1]
        assert np.abs(momentum - moment*found.history["time"]).max() <= 1e-12*moment*time
        fields = found.fields()
        x = (fields.x + fields["displacement"][-1])[:len(rest)]
        assert np.abs(x - rest)[:, axis - 1].max() <= 1e-14
        assert shape_error(x, rest) <= 1e-12
        error.append(np.abs(x - exact.apply(rest - FOOT) - FOOT).max())
    assert found.history["kinetic"][-1] == pytest.approx((moment*time)**2/(2*inertia), rel=1e-3)
    assert error[0]/error[1] == pytest.approx(4.0, rel=0.1)


def test_a_wheel_on_its_axle_is_the_wheel_of_the_plane(tmp_path: Path) -> None:
    """A pendulum that a moment drives to and fro: the motion of the same body of plane elements."""
    step = ("*STEP, NLGEOM, INC=100\n*DYNAMIC, DIRECT\n.05, 5.\n"
            "*DLOAD\nALL, GRAV, 5., 0., -1.\n*CLOAD, AMPLITUDE=SWAY\n9999, 6, .4\n*NODE FILE, FREQUENCY=10\nU\n*END STEP\n")
    head = ("*AMPLITUDE, NAME=SWAY\n0., 0., 1., 1., 3., -1., 5., 0.\n", "*NODE\n9999, .3, 1.2\n*RIGID BODY, ELSET=ALL, REF NODE=9999\n"
            "*BOUNDARY\n9999, 1, 2\n")
    plane = (f"{head[0]}*NODE\n1, 0., 0.\n2, 1., 0.\n3, 1., .5\n4, 0., .5\n*ELEMENT, TYPE=CPE4, ELSET=ALL\n1, 1, 2, 3, 4\n"
             f"*MATERIAL, NAME=M\n*DENSITY\n.5\n*SOLID SECTION, ELSET=ALL, MATERIAL=M\n1.\n{head[1]}{step}")
    mesh = Block("C3D8", (1, 1, 1), (1.0, 0.5, 1.0))
    space = head[0] + mesh.deck("", head[1].replace("1.2\n", "1.2, .5\n").replace("1, 2\n", "1, 5\n"), DENSITY) + step
    one, two = run(plane, tmp_path/"plane").fields(), run(space, tmp_path/"space").fields()
    corner = [int(np.flatnonzero(np.all(mesh.x == [*x, 0.0], 1))[0]) for x in one.x[:4]]
    wanted = one["displacement"][:, :4, :2]
    assert np.abs(wanted).max() > 0.5
    assert np.abs(two["displacement"][:, corner, :2] - wanted).max() <= 1e-10


def test_a_moment_bends_and_twists_a_bar(tmp_path: Path) -> None:
    """By a rigid end that is free, or on an axle: supports balance the moment; what it turns by, prescribed, is the same state."""
    mesh = Block("C3D8", (4, 2, 2), (4, 1, 1))
    foot = "".join(f"{k}, 1, 3\n" for k in mesh.on(0, 0))
    nodes = (f"*NODE\n{REFERENCE}, 5., .5, .5\n*NSET, NSET=END\n" + ",\n".join(map(str, mesh.on(0, 1)))
             + f"\n*RIGID BODY, NSET=END, REF NODE={REFERENCE}\n")
    step = "*STEP, NLGEOM\n*STATIC\n.25, 1.\n{}*NODE FILE\nU, RF\n*END STEP\n"
    axle = f"{REFERENCE}, 1, 3\n{REFERENCE}, 5, 6\n"
    loads = {"free": ("", [0.4, 1.2, -0.9]), "axle": (axle, [0.8, 0.0, 0.0])}
    for name, (held, moment) in loads.items():
        cards = "*CLOAD\n" + "".join(f"{REFERENCE}, {k}, {m!r}\n" for k, m in enumerate(moment, 4))
        fields = run(mesh.deck(LAW, f"{nodes}*BOUNDARY\n{foot}{held}" + step.format(cards)), tmp_path/name).fields()
        x, force = fields.x + fields["displacement"][-1], fields["reaction_force"][-1]
        clamp = np.array(mesh.on(0, 0)) - 1
        total = np.cross(x[clamp], force[clamp]).sum(0) + np.array(moment)
        assert np.abs(total[:1] if held else total).max() <= 1e-9*np.abs(moment).max()
        assert held or np.abs(force[clamp].sum(0)).max() <= 1e-9
    u, end = fields["displacement"][-1], np.array(mesh.on(0, 1)) - 1
    arm = mesh.x[end[0]] - [5.0, 0.5, 0.5]
    turned = arm + u[end[0]]
    angle = np.arctan2(*(np.cross(arm, turned)[0], arm[1:] @ turned[1:]))
    assert angle > 0.2
    given = step.format(f"*BOUNDARY\n{REFERENCE}, 4, 4, {float(angle)!r}\n")
    again = run(mesh.deck(LAW, f"{nodes}*BOUNDARY\n{foot}{axle}" + given), tmp_path/"given").fields()["displacement"][-1]
    assert np.abs(again[:len(mesh.x)] - u[:len(mesh.x)]).max() <= 1e-9


def test_an_axle_is_let_go_and_held_again(tmp_path: Path) -> None:
    """A step on the axle, one without it, one as it is then; and on from a prescribed turn about it."""
    axle, go = f"*BOUNDARY\n{REFERENCE}, 1, 5\n", f"*BOUNDARY, OP=NEW\n{REFERENCE}, 1, 3\n"
    fixed = f"*BOUNDARY, FIXED\n{REFERENCE}, 4, 6\n"
    text, rest = top("C3D8", FOOT, TILT, np.array([0, 0, 1.5]), (0, 0, 0), "".join(
        dynamic(0.05, 20, cards) for cards in (axle, go, fixed)))
    found = run(text, tmp_path/"on")
    x = found.fields().x[:len(rest)] + found.fields()["displacement"][:, :len(rest)]
    assert np.abs(x[1] - x[0])[:, 2].max() <= 1e-13
    assert np.abs(x[2] - x[1])[:, 2].max() > 0.1
    assert np.abs(x[3] - x[2]).max() <= 1e-12
    kinetic = found.history["kinetic"]
    assert np.abs(kinetic[:21] - kinetic[0]).max() <= 1e-12*kinetic[0]
    assert np.abs(kinetic[21:41] - kinetic[0]).max() <= 1e-12*kinetic[0]
    text, rest = top("C3D8", FOOT, TILT, np.zeros(3), (0, 0, 0), f"*BOUNDARY\n{REFERENCE}, 1, 5\n"
                     + dynamic(0.05, 20, f"*BOUNDARY, AMPLITUDE=RAMP\n{REFERENCE}, 6, 6, .5\n")
                     + dynamic(0.05, 20, axle.replace("*BOUNDARY", "*BOUNDARY, OP=NEW")))
    fields = run("*AMPLITUDE, NAME=RAMP\n0., 0., 1., 1.\n" + text, tmp_path/"after").fields()
    x = fields.x[:len(rest)] + fields["displacement"][:, :len(rest)]
    for k, angle in ((1, 0.5), (2, 1.0)):
        place = Rotation.from_rotvec([0, 0, angle]).apply(rest - FOOT) + FOOT
        assert np.abs(x[k] - place).max() <= 1e-3, k


@pytest.mark.parametrize(("cards", "text"), [
    (f"*BOUNDARY\n{REFERENCE}, 4\n", "degrees of freedom 4 to 6 of a rigid body are all prescribed"),
    (f"*BOUNDARY, FIXED\n{REFERENCE}, 4\n*BOUNDARY\n{REFERENCE}, 5, 6\n", "all FIXED"),
    (f"*BOUNDARY\n{REFERENCE}, 4, 5, .1\n", "two of them are 0"),
    ("*BOUNDARY\n1, 5, 5, .1\n", "degrees of freedom 4 to 6 are of the reference node"),
    ("*CLOAD\n1, 6, 1.\n", "no moment can act on node 1: degrees of freedom 4 to 6"),
    (f"*CLOAD\n{REFERENCE}, 7, 1.\n", "degree of freedom 7 does not exist"),
    (f"*CLOAD\n{REFERENCE}, 0, 0.\n", "degree of freedom"),
    ("*BOUNDARY\n1, 1, 3\n", "prescribe that node"),
    ("*NODE FILE\nUR\n", "rotation of rigid bodies in three dimensions is not in this version")])
def test_what_is_refused(cards: str, text: str, tmp_path: Path) -> None:
    deck, _ = top("C3D8", CENTRE, TILT, SPIN, VELOCITY, dynamic(0.05, 2, cards))
    (tmp_path/"deck.inp").write_text(deck)
    done = emcon("check", tmp_path/"deck.inp")
    assert done.returncode == 2
    assert text in done.stderr
    assert done.stderr.count("error:") == 1


def test_a_turned_body_is_held_as_it_is(tmp_path: Path) -> None:
    hold = f"*BOUNDARY{{}}\n{REFERENCE}, 4, 6\n"
    for k, (fixed, code) in enumerate((("", 2), (", FIXED", 0))):
        deck, rest = top("C3D8", CENTRE, TILT, SPIN, VELOCITY,
                         dynamic(0.05, 4) + dynamic(0.05, 4, hold.format(fixed)))
        (tmp_path/f"{k}.inp").write_text(deck)
        done = emcon(tmp_path/f"{k}.inp", "--quiet", "--output", tmp_path)
        assert done.returncode == code, done.stderr
        assert code == 0 or "FIXED holds it as it is" in done.stderr
    fields = Run(tmp_path/"1").fields()
    way = (fields["displacement"][-1] - fields["displacement"][-2])[:len(rest)]
    assert np.abs(way - way[0]).max() <= 1e-12
    x = fields.x + fields["displacement"][-1]
    assert shape_error(x[:len(rest)], rest) <= 1e-12
