"""Friction in space: slopes, turning slip, sliding and rolling, elastic blocks, on walls and on bodies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import wall_space_scenes as walls
from contact_blocks import FieldsOf
from contact_space_scenes import ball, bodies, dynamic, faces, pair, velocities
from friction_scenes import arch_needs
from friction_space_scenes import Ball, belt
from scene_tools import EPSILON, Run, run_deck
from scipy.integrate import solve_ivp
from space_mesh import Block
from test_contact_output import restart
from test_contact_space_rigid import columns, rigid

GRAVITY = 10.0
STIFF = "*ELASTIC\n1E4, .3\n*DENSITY\n1.\n"


def ran(folder: Path, text: str) -> Run:
    (folder/"deck.inp").write_text(text)
    return run_deck(folder/"deck.inp", folder)


def weight(slope: float = 0.0, of: str = "B1") -> str:
    """The floor stays level and the weight leans along x."""
    return f"*DLOAD\n{of}, GRAV, {GRAVITY}, {float(np.sin(slope))!r}, 0., {float(-np.cos(slope))!r}\n"


def slab(cells: tuple[int, int, int] = (2, 2, 1), turn: float = 0.0) -> Block:
    c, s = np.cos(turn), np.sin(turn)
    return Block("C3D8", cells, size=(1, 1, .5),
                 place=lambda x: (x - np.array([.5, .5, 0]))@np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))


def on_floor(mu: float, h: float, until: float, v: tuple, w: tuple = (0, 0, 0), slope: float = 0.0,
             is_rigid: bool = True, cells: tuple[int, int, int] = (2, 2, 1), is_whole: bool = False) -> str:
    """A slab on a plane, its surface the lower side or the whole outline."""
    block = slab(cells)
    flies = rigid(1, block, v=v, w=w) if is_rigid else velocities(block, np.array(v, float), np.array(w, float))
    surface = faces(block) if is_whole else faces(block, 2, 0)
    return (bodies([block], [surface], STIFF) + flies + walls.wall(walls.plane())
            + walls.pair("", f"*FRICTION\n{mu}\n") + f"*BOUNDARY\n{walls.FIXED}" + dynamic(h, until, weight(slope)))


def dissipates(run: Run, load: float = GRAVITY) -> None:
    """In each increment, but for what slip is rounded to, 64 epsilon of an edge of 1, under a weight of some 5, or `load`."""
    assert np.diff(run.history["friction_loss"]).min() >= -64*EPSILON*load


@pytest.mark.parametrize("slope", [.49, .499, .501, .51])
def test_slope(tmp_path: Path, slope: float) -> None:
    """A rigid slab with mu = .5 slides where the slope is above it, with the acceleration of a particle."""
    angle, until = float(np.arctan(slope)), 0.2
    run = ran(tmp_path, on_floor(.5, .01, until, (0, 0, 0), slope=angle))
    wanted = max(0.0, np.sin(angle) - .5*np.cos(angle))*GRAVITY*until
    # Forces are met to round-off of them, and add up over the steps.
    assert abs(run.history["px"][-1]/.5 - wanted) < 1e-12*GRAVITY*until
    dissipates(run)


GENERAL = "*CONTACT\n*CONTACT INCLUSIONS, ALL EXTERIOR\n*CONTACT PROPERTY ASSIGNMENT\n"


@pytest.mark.parametrize("lines", [", , I\n", "GLOBAL, GLOBAL, I\n", ", , SLIPPERY\nALL_EXTERIOR, W, I\n"])
def test_contact_of_all_with_all_has_the_friction_assigned_to_it(tmp_path: Path, lines: str) -> None:
    """An elastic slab that is thrown onto a plane and turns: what a pair does; of two lines the later one counts."""
    runs = []
    for name, contact in (("pair", "*CONTACT PAIR, INTERACTION=I\nS1, W\n"), ("all", GENERAL + lines)):
        text = on_floor(.3, .01, .2, (1., .2, 0), (0, 0, 1.), is_rigid=False).replace(
            "*CONTACT PAIR, INTERACTION=I\nS1, W\n", "*SURFACE INTERACTION, NAME=SLIPPERY\n" + contact)
        (tmp_path/name).mkdir()
        runs.append(ran(tmp_path/name, text))
    for column in ("kinetic", "friction_loss", "px"):
        assert np.allclose(runs[0].history[column], runs[1].history[column], rtol=1e-9, atol=1e-12)
    assert runs[1].history["friction_loss"][-1] > .01*runs[1].history["kinetic"][0]


def test_contact_of_all_with_all_has_restitution_and_damping(tmp_path: Path) -> None:
    """A rigid slab falls flat: it leaves at half its speed, then at less where the air is damped too."""
    speed = []
    for name, card in (("half", ""), ("damped", "*CONTACT DAMPING\n.2, .1, 0.\n")):
        text = on_floor(0., .01, .2, (0, 0, -1.)).replace("*FRICTION\n0.0\n", card)
        text = text.replace("NAME=I\n", "NAME=I, RESTITUTION=.5\n").replace(
            "*CONTACT PAIR, INTERACTION=I\nS1, W\n", GENERAL + ", , I\n").replace(weight(), "")
        (tmp_path/name).mkdir()
        run = ran(tmp_path/name, text)
        speed.append(run.history["pz"][-1]/.5)
    assert speed[0] == pytest.approx(.5, rel=1e-10)
    assert 0 < speed[1] < .5


def turns_away(slope: float, mu: float, until: float) -> np.ndarray:
    """The velocity of a particle that is thrown with 1 across a slope."""
    def rate(_t: float, v: np.ndarray) -> np.ndarray:
        return GRAVITY*(np.array([np.sin(slope), 0.0]) - mu*np.cos(slope)*v/np.hypot(*v))

    return solve_ivp(rate, [0, until], [0, 1.], rtol=1e-12, atol=1e-14).y[:, -1]


def test_turning_slip_is_of_second_order(tmp_path: Path) -> None:
    """A rigid slab slides across a slope, which turns its way: as a particle does."""
    slope, mu, until = .2, .3, .3
    wanted = turns_away(slope, mu, until)
    error = []
    for h in (.02, .01):
        run = ran(tmp_path, on_floor(mu, h, until, (0, 1., 0), slope=slope))
        error.append(np.abs(columns(run, "px py")[-1]/.5 - wanted).max())
        dissipates(run)
    # Half of the step leaves a quarter, by the next order within a twentieth.
    assert error[0] < 4e-4
    assert error[0]/error[1] == pytest.approx(4.0, rel=.05)


#: A cube of this side turns as the ball of radius 1 does.
CORE = float(np.sqrt(2.4))


def ball_on_floor(mu: float, h: float, cells: int, v: float = 0.0, slope: float = 0.0) -> str:
    """A ball, a wall, on elements of .02, along which it is thrown or down which it goes."""
    step = .02
    floor = Block("C3D8", (cells, 2, 1), size=(cells*step, 2*step, .1), place=lambda x: x - np.array([.06, step, .1]))
    core = Block("C3D8", (1, 1, 1), size=(CORE,)*3, place=lambda x: x - CORE/2 + np.array([0, 0, 1.]))
    flies = f"*INITIAL CONDITIONS, TYPE=VELOCITY\n{walls.REFERENCE}, 1, {v!r}\n" if v else ""
    return (bodies([floor, core], [faces(floor, 2, 1), faces(core)], STIFF)
            + walls.wall(walls.sphere(1., (0., 0., 1.)), (0., 0., 1.), "ELSET=B2, ")
            + walls.pair("", f"*FRICTION\n{mu}\n") + f"*BOUNDARY\nN1, 1, 3\n{flies}"
            + dynamic(h, .2, weight(slope, of="B2")))


def test_ball_slides_and_rolls(tmp_path: Path) -> None:
    """A ball that is thrown along a floor rolls with 5/7 of its speed, but for the nodes that it rolls over."""
    run = ran(tmp_path, ball_on_floor(.3, .01, 16, v=1.))
    speed = run.history["px"]/CORE**3
    assert speed[5] > .8
    # It sinks between nodes by the square of half their distance over its diameter: 5e-5 of it.
    assert np.abs(speed[14:] - 5/7).max() < .01
    dissipates(run)


@pytest.mark.parametrize("mu", [.3, .8])
def test_elastic_slab_comes_to_a_stop(tmp_path: Path, mu: float) -> None:
    text = on_floor(mu, .01, .5, (1., .2, 0), (0, 0, 1.), is_rigid=False)
    run = ran(tmp_path, text.replace("*END STEP", "*CONTACT FILE\nCF\n*END STEP"))
    first, last = columns(run, "kinetic strain").sum(1)[[0, -1]]
    assert last < .05*first                      # it vibrates on
    work = run.history["external_work"][-1] - run.history["friction_loss"][-1]
    assert abs(first + work - last) < 1e-11*first
    assert max(run.history["cuts"]) == 0
    assert run.verdict["verdict"] == "good"
    assert run.verdict["law_violation"] < 1e-10
    dissipates(run)
    judge_nodes(run, mu)


def judge_nodes(run: Run, mu: float) -> None:
    """Of each node on the plane, by forces and places alone: pushed, within the disc, braked; while it slides by all of it."""
    fields = run.fields()
    low = np.array(slab().on(2, 0)) - 1
    slip = np.diff(fields["displacement"][:, low, :2], axis=0)
    force = fields["contact_force"][1:, low]
    push, drag = force[..., 2], force[..., :2]
    tiny = 1e-10*push.max()
    assert push.min() >= -tiny
    assert (np.linalg.norm(drag, axis=2) - mu*push).max() <= tiny
    taken = -(drag*slip).sum(2)
    assert taken.min() >= -tiny*np.abs(slip).max()
    assert taken.sum() == pytest.approx(run.history["friction_loss"][-1], rel=1e-9)
    # Until the first of them could stop.
    along = slip[:5]/np.linalg.norm(slip[:5], axis=2, keepdims=True)
    assert np.abs(drag[:5] + mu*push[:5, :, None]*along).max() <= tiny


@pytest.mark.parametrize(("mu", "turn"), [(.3, 0.), (.3, .3), (.8, .3)])
def test_elastic_slab_on_a_free_plate(tmp_path: Path, mu: float, turn: float) -> None:
    """Thrown with a spin, nodes on nodes and askew: momenta stay, energy is what friction leaves."""
    one = slab(turn=turn)
    two = Block("C3D8", (4, 4, 1), size=(3, 3, .5), place=lambda x: x - np.array([1.5, 1.5, .5]))
    run = ran(tmp_path, bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)], STIFF)
              + pair("", f"*FRICTION\n{mu}\n") + velocities(one, np.array([1., .2, -1.]), np.array([0, 0, 1.]))
              + dynamic(.01, .4))
    for names in ("px py pz", "lx ly lz"):
        p = columns(run, names)
        assert np.abs(p - p[0]).max() < 1e-11*np.abs(p).max(), names
    energy = columns(run, "kinetic strain friction_loss").sum(1)
    assert np.abs(energy - energy[0]).max() < 1e-11*energy[0]
    assert run.history["friction_loss"][-1] > .05*energy[0]
    assert run.verdict["law_violation"] < 1e-10
    assert run.verdict["verdict"] == "good"
    dissipates(run)


def node_on_node(options: str, cells: int) -> str:
    """A cube that slides along x over one like it, which is held below; x-z is a plane of symmetry."""
    one = Block("C3D8", (cells,)*3)
    two = Block("C3D8", (cells,)*3, place=lambda x: x - np.array([0, 0, 1.]))
    held = "".join(f"{len(one.x) + k}, 1, 3\n" for k in two.on(2, 0))
    return (bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)], "*ELASTIC\n1000., 0.\n*DENSITY\n1.\n")
            + pair(options, "*FRICTION\n.3\n") + velocities(one, np.array([1., 0, 0]), np.zeros(3))
            + f"*BOUNDARY\n{held}" + dynamic(.01, .1, weight()))


def test_a_node_on_a_node_prefers_no_triangle(tmp_path: Path) -> None:
    """Nor does it leave a plane of symmetry: six increments, in which both cubes touch all over."""
    run = ran(tmp_path, node_on_node(", SIDES=ONE", 1))
    fields = run.fields()
    upper = fields.x[:8]
    mirror = [int(np.argmin(np.abs(upper - (x*[1, -1, 1] + [0, 1, 0])).sum(1))) for x in upper]
    for u in fields["displacement"][:7, :8]:
        assert np.abs(u - u[mirror]*[1, -1, 1]).max() <= 64*EPSILON
    assert run.history["friction_loss"][-1] > 0.0
    dissipates(run)


@pytest.mark.parametrize("cells", [1, 2])
def test_nodes_on_nodes_slide_without_cuts(tmp_path: Path, cells: int) -> None:
    """Held on both sides: each contact is there twice."""
    run = ran(tmp_path, node_on_node("", cells))
    assert run.verdict["verdict"] == "good"
    assert run.history["cuts"].sum() == 0
    assert run.verdict["law_violation"] < 1e-10
    dissipates(run)


def test_many_contacts_slide(tmp_path: Path) -> None:
    """225 nodes that slide and turn are solved as few are."""
    run = ran(tmp_path, on_floor(.3, .01, .02, (1., .2, 0), (0, 0, 1.), is_rigid=False, cells=(14, 14, 1)))
    assert max(run.history["cuts"]) == 0
    assert run.verdict["counts"]["factorisations"] <= 6
    dissipates(run)


def at_rest(slope: float, load: float, card: str = "*STEP, NLGEOM") -> str:
    """A slab under `load` times its weight on a floor with mu = .5."""
    block, angle, g = slab(), float(np.arctan(slope)), load*GRAVITY
    return (bodies([block], [faces(block, 2, 0)], STIFF) + walls.wall(walls.plane())
            + walls.pair("", "*FRICTION\n.5\n") + f"*BOUNDARY\n{walls.FIXED}"
            + f"{card}\n*STATIC\n.5, 1.\n*DLOAD\nB1, GRAV, {g!r}, {float(np.sin(angle))!r}, 0., "
            + f"{float(-np.cos(angle))!r}\n*NODE FILE\nU\n*END STEP\n")


@pytest.mark.parametrize("slope", [.45, .49, .499])
def test_held_by_friction_in_statics(tmp_path: Path, slope: float) -> None:
    """Friction alone holds an elastic slab, whose floor bears its weight. Near the limit all nodes slide.

    They do so along different ways, as the slab spreads: it stays where it is.
    """
    run = ran(tmp_path, at_rest(slope, 1.0))
    assert run.verdict["verdict"] == "good"
    assert not run.verdict["warnings"]
    angle = float(np.arctan(slope))
    force = columns(run, "pair1_force_x pair1_force_y pair1_force_z")[-1]
    wanted = .5*GRAVITY*np.array([np.sin(angle), 0.0, -np.cos(angle)])
    assert np.abs(np.abs(force) - np.abs(wanted)).max() < 1e-8*GRAVITY


def puck() -> Block:
    """An octagon of radius 1, thin, which stands on its eight corners."""
    def place(x: np.ndarray) -> np.ndarray:
        p = x[:, :2] - 1.0
        angle, r = np.arctan2(p[:, 1], p[:, 0]), np.abs(p).max(1)
        z = np.where((r == 0.0) & (x[:, 2] == 0.0), .5*x[:, 2].max(), x[:, 2])
        return np.column_stack([r*np.cos(angle), r*np.sin(angle), z])
    return Block("C3D8", (2, 2, 1), size=(2, 2, .002), place=place)


def slows_down(until: float, inertia: float) -> np.ndarray:
    """Momenta px, py, lz over the mass of what stands on eight points that rub with 1/8 each, from 1 along x and a spin
    of 2."""
    angle = np.arange(8)*np.pi/4

    def rate(_t: float, y: np.ndarray) -> np.ndarray:
        arm = np.array([np.cos(angle + y[5]), np.sin(angle + y[5])])
        slip = y[:2, None] + y[2]*np.array([-arm[1], arm[0]])
        force = -slip/np.linalg.norm(slip, axis=0)/8
        return np.array([*force.sum(1), (arm[0]*force[1] - arm[1]*force[0]).sum()/inertia, *y[:3]])

    v = solve_ivp(rate, [0, until], [1.0, 0, 2.0, 0, 0, 0], rtol=1e-11, atol=1e-13).y[:, -1]
    return np.array([v[0], v[1], inertia*v[2] + v[3]*v[1] - v[4]*v[0]])


def sliding_puck(h: float, until: float) -> str:
    block = puck()
    return (bodies([block], [faces(block, 2, 0)], STIFF) + rigid(1, block, v=(1, 0, 0), w=(0, 0, 2))
            + walls.wall(walls.plane()) + walls.pair("", "*FRICTION\n.1\n") + f"*BOUNDARY\n{walls.FIXED}"
            + dynamic(h, until, weight()))


def test_puck_slides_and_spins(tmp_path: Path) -> None:
    """To second order: the weight stays shared among eight corners of which three would do. It is half a thousandth
    above them, so that friction, a tenth of it, tips no more than 1e-4 of it from corner to corner."""
    last = []
    for h in (.01, .005, .00125):
        run = ran(tmp_path, sliding_puck(h, 1.0))
        last.append(columns(run, "px py lz")[-1]/run.history["px"][0])
        assert max(run.history["cuts"]) == 0
        dissipates(run)
    assert np.abs(last[2] - slows_down(1.0, run.history["lz"][0]/run.history["px"][0]/2)).max() < 1e-4
    error = [np.abs(x - last[2]).max() for x in last[:2]]
    # What the finest one is off by itself is 1/64 of the first: (1 - 1/64)/(1/4 - 1/64).
    assert error[0]/error[1] == pytest.approx(4.2, rel=.1)


def test_puck_comes_to_rest(tmp_path: Path) -> None:
    """It slides and spins until one increment, in which both motions end. What tips it then, at half a thousandth above
    the floor, rebounds fully."""
    run = ran(tmp_path, sliding_puck(.01, 1.7))
    p, spin, kinetic = (columns(run, name)[:, 0]/run.history[name][0] for name in ("px", "lz", "kinetic"))
    end = int(np.argmax(kinetic < 1e-9))
    # Friction takes the velocity of an increment, .01, before.
    assert .001 < p[end - 1] < .01
    assert .0002 < spin[end - 1] < .01
    assert np.abs(np.array([p, spin])[:, end:]).max() < 1e-7
    assert kinetic[end:].max() < 1e-9
    assert run.verdict["verdict"] == "good"
    dissipates(run)


def comes_to_rest(i: int, block: Block) -> str:
    return rigid(i, block).partition("*INITIAL")[0]


def cards(mu: float) -> str:
    """Two rigid cards of length 1 and thickness .1 lean on each other, 30 degrees from the vertical, under their weight."""
    lean = np.radians(30.0)
    blocks = []
    for side in (1, -1):
        def place(x: np.ndarray, side: int = side) -> np.ndarray:
            out, up = x[:, 0] if side > 0 else .1 - x[:, 0], x[:, 2]
            return np.column_stack([side*(np.sin(lean)*(1.0 - up) + np.cos(lean)*out), x[:, 1] - .25,
                                    np.cos(lean)*up + np.sin(lean)*out])
        blocks.append(Block("C3D8", (1, 2, 4), size=(.1, .5, 1), place=place))
    return (bodies(blocks, [faces(b) for b in blocks], STIFF) + comes_to_rest(1, blocks[0]) + comes_to_rest(2, blocks[1]) + walls.wall(walls.plane()) + pair("", f"*FRICTION\n{mu}\n") + "S1, W\nS2, W\n"
            + f"*BOUNDARY\n{walls.FIXED}" + dynamic(.01, .3, weight() + weight(of="B2")))


#: Of the cards, about their feet on the floor.
CARDS_NEED = .5*(np.tan(np.radians(30.0)) - .1)


@pytest.mark.parametrize("mu", [.2, .97*CARDS_NEED, 1.03*CARDS_NEED, .5])
def test_cards_stand_by_friction(tmp_path: Path, mu: float) -> None:
    """A card touches the floor at its lower inner edge and the other one at its upper inner edge: its weight has the arm
    sin(30)/2 - .1 cos(30)/2 about the floor, and the push of the other one, which friction bears, cos(30)."""
    run = ran(tmp_path, cards(mu))
    moved = np.abs(run.fields()["displacement"][-1]).max()
    if mu > CARDS_NEED:
        assert moved < 1e-12
    else:
        # A part of the push that is missed accelerates the feet by some of it and of gravity.
        assert moved > .1*(CARDS_NEED - mu)*.5*GRAVITY*.3**2
    assert run.verdict["verdict"] == "good"
    dissipates(run)


def arch(mu: float, stones: int = 5) -> str:
    """Half a ring of rigid wedges between two that are held; the radii are 1 and 1.4."""
    part = np.pi/(stones + 2)

    def stone(k: int) -> Block:
        def place(x: np.ndarray) -> np.ndarray:
            angle, r = np.pi - (k + x[:, 0])*part, 1.0 + .4*x[:, 2]
            return np.column_stack([r*np.cos(angle), .5*x[:, 1] - .25, r*np.sin(angle)])
        return Block("C3D8", (1, 1, 1), place=place)

    blocks = [stone(k) for k in range(stones + 2)]
    n = len(blocks)
    return (bodies(blocks, [faces(b) for b in blocks], STIFF)
            + "".join(comes_to_rest(i, blocks[i - 1]) for i in range(2, n))
            + f"*SURFACE INTERACTION, NAME=I\n*FRICTION\n{mu!r}\n*CONTACT PAIR, INTERACTION=I\n"
            + "".join(f"S{i}, S{i + 1}\n" for i in range(1, n)) + f"*BOUNDARY\nN1, 1, 3\nN{n}, 1, 3\n"
            + dynamic(.01, .15, "".join(weight(of=f"B{i}") for i in range(2, n))))


@pytest.mark.parametrize("part", [.97, 1.03])
def test_an_arch_stands_by_friction(tmp_path: Path, part: float) -> None:
    """A thrust H passes through each joint, tilted by t from the upright, with the weight above it, of k half stones, where
    |atan(k w/H) - t| is within the angle of friction for the best H: `arch_needs` has that bound. The ring is thick enough
    for the line of thrust."""
    run = ran(tmp_path, arch(part*arch_needs()))
    moved = np.abs(run.fields()["displacement"][-1]).max()
    if part > 1.0:
        assert moved < 1e-12
    else:
        # Joints that miss 3 % of their friction, .1 of their push, accelerate stones by some part of that and of gravity.
        assert moved > .1*(1.0 - part)*arch_needs()*.5*GRAVITY*.15**2
    assert run.verdict["verdict"] == "good"
    dissipates(run)


def on_each_other(folder: Path, blocks: list[Block], pairs: list[tuple[int, int]], mu: float, until: float,
                  push: str = "", *, many_touch: bool = False) -> Run:
    """Rigid blocks that fall on each other and a floor with a restitution of one half. `many_touch`: slips are rounded under
    the forces of all pairs."""
    n = range(1, len(blocks) + 1)
    text = bodies(blocks, [faces(b) for b in blocks], STIFF) + push
    text += "".join(comes_to_rest(i, blocks[i - 1]) for i in n if i > 1 or not push) + walls.wall(walls.plane())
    text += f"*SURFACE INTERACTION, NAME=I, RESTITUTION=.5\n*FRICTION\n{mu}\n*CONTACT PAIR, INTERACTION=I\n"
    text += "".join(f"S{a}, S{b}\n" for a, b in pairs) + "".join(f"S{i}, W\n" for i in n) + f"*BOUNDARY\n{walls.FIXED}"
    (folder/"deck.inp").write_text(text + dynamic(.01, until, "".join(weight(of=f"B{i}") for i in n)))
    run = run_deck(folder/"deck.inp", folder, timeout=900)
    history = run.history
    assert run.verdict["verdict"] == "good"
    assert run.verdict["law_violation"] < 1e-9
    total = history["total"] - history["contact_work"] + history["friction_loss"]
    assert np.ptp(total) < 1e-11*history["kinetic"].max()
    assert np.diff(history["restitution_loss"]).min() > -1e-13*history["kinetic"].max()
    load = max(GRAVITY, GRAVITY*sum(np.prod(np.ptp(b.x, 0)) for b in blocks))
    if many_touch:
        load = sum(abs(history[name]).max() for name in history.dtype.names if "_force_" in name)
    dissipates(run, load)
    assert history["friction_loss"][-1] > 0.0
    return run


@pytest.mark.parametrize(("count", "until"), [(3, 2.5), pytest.param(20, 6.0, marks=pytest.mark.long)])
def test_dominoes_fall_one_after_the_other(count: int, until: float, tmp_path: Path) -> None:
    """The first one is pushed over, with a restitution of one half. Fallen, all lie still."""
    blocks = [Block("C3D8", (1, 1, 1), size=(.2, .5, 1), place=lambda x, i=i: x + np.array([.5*i - .1, -.25, 0]))
              for i in range(count)]
    run = on_each_other(tmp_path, blocks, [(i, i + 1) for i in range(1, count)], .3, until,
                        rigid(1, blocks[0], v=(1, 0, .2), w=(0, 2, 0)))
    assert run.history["kinetic"][-1] < 1e-6*run.history["kinetic"][0]
    assert run.history["cuts"].sum() <= (0 if count == 3 else 1)
    assert (run.fields().x + run.fields()["displacement"][-1])[:8*count, 2].max() < (.8 if count == 3 else 1.0)


@pytest.mark.parametrize(("rows", "until"), [
    ((3, 2, 1), 1.0), pytest.param((10, 9), 2.0, marks=pytest.mark.long),
    pytest.param((8, 7, 6, 5, 4), 4.0, marks=pytest.mark.long)])
def test_a_pile_comes_to_rest(rows: tuple[int, ...], until: float, tmp_path: Path) -> None:
    """Each row falls onto the gaps of the one below. Impacts leave a quarter of the energy of what goes along normals, over
    and over in ever shorter times: after the last one that is further apart than an increment it dies out by increments.
    Of 30 blocks two are left on two corners across, one after the other, and fall to a third one at 1.1 and 2.7."""
    blocks: list[Block] = []
    pairs: list[tuple[int, int]] = []
    for r, n in enumerate(rows):
        below = len(blocks) - rows[r - 1] + 1
        for k in range(n):
            corner = np.array([.42*(k - .5*(n - 1)) - .2, -.15, .02 + .32*r])
            blocks.append(Block("C3D8", (1, 1, 1), size=(.4, .3, .3), place=lambda x, corner=corner: x + corner))
            i = len(blocks)
            pairs += [(i - 1, i)]*(k > 0) + ([(below + k, i), (below + k + 1, i)] if r > 0 else [])
    history = on_each_other(tmp_path, blocks, pairs, .5, until, many_touch=True).history
    kinetic = history["kinetic"]
    assert kinetic[-1] < 1e-12*kinetic.max()
    # Nothing stirs it up any more.
    assert kinetic[-5:].max() < 1e-10*kinetic.max()


def test_what_slides_down_has_no_rest(tmp_path: Path) -> None:
    (tmp_path/"deck.inp").write_text(at_rest(.51, 1.0))
    run = run_deck(tmp_path/"deck.inp", tmp_path, 3)
    assert run.verdict["verdict"] == "not completed"
    assert "friction is at its limit" in run.errors


@pytest.mark.parametrize("slope", [.45, .49])
def test_loads_of_any_size_take_the_same_iterations(tmp_path: Path, slope: float) -> None:
    """Linear elements: forces and motions are in proportion to the load."""
    counts, moved = [], []
    for load in (1e-3, 1.0, 1e3):
        run = ran(tmp_path, at_rest(slope, load, "*STEP"))
        counts.append(list(run.history["newton"]))
        moved.append(run.fields()["displacement"][-1]/load)
    assert counts[0] == counts[1] == counts[2]
    size = np.abs(moved[1]).max()
    assert max(np.abs(u - moved[1]).max() for u in moved) < 1e-6*size


@pytest.mark.parametrize("is_whole", [False, True])
def test_traction_and_slip_of_faces(is_whole: bool, tmp_path: Path) -> None:
    """Vectors in space: traction adds up to what acts along the plane, slip is how the nodes went. Faces beside the plane
    bear nothing but what they lean over it."""
    text = on_floor(.3, .01, .1, (1., .2, 0), (0, 0, 1.), is_rigid=False, is_whole=is_whole)
    run = ran(tmp_path, text.replace("*END STEP", "*CONTACT FILE\nCF, CSHEAR, CSLIP\n*END STEP"))
    fields, faces = run.fields(), FieldsOf(run.file(".surfaces.vtkhdf"))
    is_face = np.isfinite(faces.cell["contact_status"][0]).ravel()
    node = faces.point["node"][0].astype(int)
    is_low = np.array([np.ptp(fields.x[node[np.asarray(cell, int)], 2]) == 0.0 and fields.x[node[int(cell[0])], 2] == 0.0
                       for cell in faces.cells])
    for name in ("contact_shear", "contact_pressure"):
        size = np.abs(faces.cell[name][:, is_face]).reshape(len(fields.time), is_face.sum(), -1).max(-1)
        assert size[:, ~is_low[is_face]].max(initial=0.0) < 1e-2*size.max()
    is_face &= is_low
    shear, slip = faces.cell["contact_shear"][:, is_face], faces.cell["contact_slip"][:, is_face]
    assert is_face.sum() == 4
    force = fields["contact_force"][:, np.array(slab().on(2, 0)) - 1].sum(1)
    # Each face has a quarter of the area, but for what the slab strains.
    assert np.abs(.25*shear.sum(1)[1:, :2] - force[1:, :2]).max() < 1e-2*np.abs(force).max()
    assert np.abs(shear[..., 2]).max() < 1e-12*np.abs(shear).max()
    moved = fields["displacement"][-1]
    for k, way in zip(np.flatnonzero(is_face), slip[-1], strict=True):
        wanted = moved[node[np.asarray(faces.cells[k], int)], :2].mean(0)
        assert np.abs(way[:2] - wanted).max() < 1e-10
    assert run.history["pair1_friction_loss"][-1] == pytest.approx(run.history["friction_loss"][-1])


def test_belt_on_a_drum(tmp_path: Path) -> None:
    """The drum turns under the belt: pulls at its ends are as e to the mu times pi, in the middle of its thickness."""
    mu, thickness = .3, .02
    block, text = belt(24, mu, thickness)
    run = ran(tmp_path, text)
    pull = -run.fields()["reaction_force"][-1, np.array(block.on(0, 0)) - 1, 2].sum()
    assert pull == pytest.approx(np.exp(mu*np.pi), rel=.02)
    # Friction acts at the radius 1, pulls half of the thickness further out. Sides of the polygon: (pi/24)^2/8.
    assert pull == pytest.approx(np.exp(mu*np.pi/(1 + thickness/2)), rel=.003)


def test_a_belt_that_contact_alone_holds(tmp_path: Path) -> None:
    """Off the drum its free end would go 150 times its length under what pulls it: tangents without the stiffness of contact
    are of no use. All of it slides after the first increment, and each one more is solved by two tangents."""
    mu, thickness = .3, .02
    block, text = belt(48, mu, thickness)
    run = ran(tmp_path, text)
    assert run.verdict["verdict"] == "good"
    assert run.history["cuts"].sum() == 0
    assert run.history["newton"][2:].max() <= 3
    pull = -run.fields()["reaction_force"][-1, np.array(block.on(0, 0)) - 1, 2].sum()
    # Half of the thickness, and sides of the polygon: (pi/48)^2/8.
    assert pull == pytest.approx(np.exp(mu*np.pi/(1 + thickness/2)), rel=.001)


@pytest.mark.long
def test_a_twisted_ball_nears_hertz(tmp_path: Path) -> None:
    """Torque of full slip under the pressure of Hertz, 3 pi/16 mu P a, with two cells over a, then four."""
    error = []
    for cells in (2, 4):
        ball = Ball(cells)
        block = ball.block()
        run = ran(tmp_path, ball.deck(block, .15, 3))
        fields, low = run.fields(), np.array(block.on(2, 0)) - 1
        force, place = fields["contact_force"][-1, low], block.x[low] + fields["displacement"][-1, low]
        torque = (place[:, 0]*force[:, 1] - place[:, 1]*force[:, 0]).sum()
        error.append(torque/ball.torque(force[:, 2].sum()) - 1)
        # It is that of the forces which there are: all of them slide round the axis.
        by_forces = ball.mu*(force[:, 2]*np.hypot(place[:, 0], place[:, 1])).sum()
        assert torque == pytest.approx(by_forces, rel=1e-3)
        assert run.verdict["law_violation"] < 1e-8
    assert abs(error[1]) < abs(error[0])
    assert abs(error[1]) < .03


@pytest.mark.long
def test_a_ball_sticks_in_the_middle(tmp_path: Path) -> None:
    """Cattaneo and Mindlin: under a force Q along the plane what sticks has the radius a (1 - Q/(mu P))^(1/3), and a force to
    and fro takes the energy of Mindlin and Deresiewicz; with two cells over a, then four.

    Nearly incompressible, so that pushes shift nothing along the plane; small strains. What friction is below its limit adds
    up to mu P - Q, spread as the pressure of Hertz is over a circle of that radius, whose mean square radius is 2/5 of it.
    """
    radius, loss = [], []
    for cells in (2, 4):
        ball = Ball(cells, stiffness=1e5, nu=.49, width=.13, height=.19, kind="C3D8H")
        block = ball.block()
        run = ran(tmp_path, ball.deck_to_and_fro(block, 1e-4))
        fields, low, taken = run.fields(), np.array(block.on(2, 0)) - 1, run.history["friction_loss"]
        assert taken[1] < 1e-5*taken[-1]
        force = np.abs(fields["contact_force"][-1, low])
        push = force[:, 2].sum()
        use = force[:, 0].sum()/(ball.mu*push)
        below = ball.mu*force[:, 2] - force[:, 0]
        square = ((block.x[low] + fields["displacement"][-1, low])[:, :2]**2).sum(1)
        radius.append(np.sqrt(2.5*(below*square).sum()/below.sum())/(ball.contact_radius(push)*(1 - use)**(1/3)) - 1)
        loss.append((taken[-1] - taken[2])/ball.loop(use, push) - 1)
        # The first way there is half of each that follows.
        assert taken[3] - taken[2] == pytest.approx(2*taken[2], rel=1e-3)
        assert run.verdict["law_violation"] < 1e-8
    assert abs(radius[1]) < abs(radius[0])
    assert abs(radius[1]) < .03
    assert abs(loss[1]) < abs(loss[0])


@pytest.mark.long
def test_energy_of_a_loop(tmp_path: Path) -> None:
    """The same of what is compressible, to 3 %: pushed so deep that the edges of contact and of what sticks lie anywhere
    between nodes, of which each single run takes some 5 % more or less, in the mean over five runs.

    Friction is so small that it leaves the pressure as it is. Forces of nodes are tractions spread by the functions of
    linear elements, whose squares of distances are larger by h^2/6 in the mean along each axis.
    """
    radius, loss = [], []
    for deep in (np.linspace(.92, 1.08, 5)**2).tolist():
        ball = Ball(6, stiffness=1e5, width=.13, height=.19, mu=.03, is_half=True, deep=deep)
        block = ball.block()
        # Three quarters of the limit: the block gives way, too.
        way = .8*ball.slack(deep**1.5)
        run = ran(tmp_path, ball.deck_to_and_fro(block, way))
        fields, low, taken = run.fields(), np.array(block.on(2, 0)) - 1, run.history["friction_loss"]
        force = np.abs(fields["contact_force"][-1, low])
        push = 2*force[:, 2].sum()
        use = 2*force[:, 0].sum()/(ball.mu*push)
        assert .7 < use < .85
        below = ball.mu*force[:, 2] - force[:, 0]
        square = ((block.x[low] + fields["displacement"][-1, low])[:, :2]**2).sum(1)
        h = ball.contact_radius(1.0)/ball.cells
        stuck = np.sqrt(2.5*((below*square).sum()/below.sum() - h*h/3))
        radius.append(stuck/(ball.contact_radius(push)*(1 - use)**(1/3)) - 1)
        loss.append(2*(taken[-1] - taken[2])/ball.loop(use, push) - 1)
        assert run.verdict["law_violation"] < 1e-8
    assert abs(np.mean(radius)) < .03
    assert abs(np.mean(loss)) < .03


def thrown(card: str, v: tuple = (1., .2, 0)) -> str:
    return on_floor(.3, .01, .3, v, (0, 0, 1.), is_rigid=False).replace("*FRICTION\n0.3\n", card)


@pytest.mark.parametrize("card", [
    "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n1E5\n*FRICTION\n0.3, 1E4\n", "*FRICTION, ROUGH\n",
    "*FRICTION, RESTITUTION=0.5\n0.3\n"])
def test_cards_of_friction(tmp_path: Path, card: str) -> None:
    """What springs of stick store comes back; what is rough never slides; energy is known in all of them."""
    run = ran(tmp_path, thrown(card).replace("*END STEP", "*CONTACT FILE\nCSHEAR\n*END STEP"))
    h = run.history
    kept = columns(run, "kinetic strain friction_loss").sum(1) - h["external_work"]
    if "LINEAR" in card:
        kept = kept + h["contact_energy"]
        assert h["contact_energy"].max() > 1e-3
    assert np.abs(kept - kept[0]).max() < 1e-11*kept[0]
    dissipates(run)
    slides = run.fields()["contact_status"].max() == 2
    assert slides == ("ROUGH" not in card)


def test_springs_of_stick_give_back(tmp_path: Path) -> None:
    """Pushed by less than its limit and let go in one step: nothing is lost, and nothing stays."""
    block = slab((1, 1, 1))
    text = (bodies([block], [faces(block, 2, 0)], STIFF) + walls.wall(walls.plane())
            + walls.pair("", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n1E4\n*FRICTION\n.5, 1E3\n")
            + f"*BOUNDARY\n{walls.FIXED}*AMPLITUDE, NAME=A\n0., 0., 1., 1., 2., 0.\n*AMPLITUDE, NAME=B\n0., 1., 2., 1.\n"
            + "*STEP\n*STATIC, DIRECT\n.25, 2.\n*DLOAD, AMPLITUDE=B\nB1, GRAV, 10., 0., 0., -1.\n"
            + "*DLOAD, AMPLITUDE=A\nB1, GRAV, 3., .6, .8, 0.\n*NODE FILE\nU\n*END STEP\n")
    run = ran(tmp_path, text)
    low = np.array(block.on(2, 0)) - 1
    u = run.fields()["displacement"][:, low, :2].mean(1)
    # 1.5 over an area of 1.
    assert np.abs(u[4] - 1.5/1e3*np.array([.6, .8])).max() < 1e-10
    assert np.abs(u[-1]).max() < 1e-12
    assert abs(run.history["friction_loss"][-1]) < 1e-14


def test_impacts_with_restitution_and_friction(tmp_path: Path) -> None:
    """Along the normal half of the rate comes back; what that takes is told beside friction, energy is balanced."""
    run = ran(tmp_path, thrown("*FRICTION\n0.3\n", (1., .2, -1.)).replace("NAME=I\n", "NAME=I, RESTITUTION=.5\n"))
    kept = columns(run, "kinetic strain friction_loss restitution_loss").sum(1) - run.history["external_work"]
    assert run.history["restitution_loss"][-1] > .01*kept[0]
    assert np.diff(run.history["restitution_loss"]).min() >= 0.0
    assert np.abs(kept - kept[0]).max() < 1e-11*kept[0]
    dissipates(run)


def stops_at(block: Block, corner: np.ndarray, v: np.ndarray, w: np.ndarray, e: float, mu: float) -> np.ndarray:
    """The impulse by which friction stops a corner of a rigid block of density 1 that leaves with the part `e` of its speed."""
    size, axes = np.linalg.norm(block.x[[1, 3, 4]] - block.x[0], axis=1), block.x[[1, 3, 4]] - block.x[0]
    axes = axes/size[:, None]
    mass = size.prod()
    inverse = axes.T@np.diag(12/mass/(size@size - size**2))@axes
    arm = np.cross(np.eye(3), corner - block.x.mean(0))                # the moment of a force is its rows' sum
    rate = v + np.cross(w, corner - block.x.mean(0))
    impulse = np.linalg.solve(np.eye(3)/mass + arm@inverse@arm.T, np.array([0, 0, -e*rate[2]]) - rate)
    assert np.hypot(*impulse[:2]) < .9*mu*impulse[2]
    return impulse


@pytest.mark.parametrize(("turn", "v", "w", "e", "mu"), [
    ((.2, .48), (-.74, -.75, -2.), (4.7, 2.7, 2.9), .3, .6), ((-.1, .3), (-1.9, 1., -2.), (-1.7, 2.9, -2.), .5, .8),
    ((.3, .5), (.5, .2, -2.), (0., 0., 3.), .0, 1.)])
def test_a_corner_that_lands_stops(turn: tuple, v: tuple, w: tuple, e: float, mu: float, tmp_path: Path) -> None:
    """A rigid block lands on a corner, which sticks while the block goes on to turn: friction takes all of its velocity
    along the surface, in whatever direction that is as the impact ends."""
    (c, s), (d, t) = ((np.cos(a), np.sin(a)) for a in turn)
    axes = np.array([[1, 0, 0], [0, c, s], [0, -s, c]])@np.array([[d, 0, -t], [0, 1, 0], [t, 0, d]])
    block = Block("C3D8", (1, 1, 1), size=(.6, .5, .4), place=lambda x: x@axes)
    block.x[:, 2] += 1e-5 - block.x[:, 2].min()
    text = (bodies([block], [faces(block)], STIFF) + rigid(1, block, v=v, w=w) + walls.wall(walls.plane())
            + f"*SURFACE INTERACTION, NAME=I, RESTITUTION={e}\n*FRICTION\n{mu}\n*CONTACT PAIR, INTERACTION=I\nS1, W\n"
            + f"*BOUNDARY\n{walls.FIXED}" + dynamic(1e-4, 3e-4))
    run = ran(tmp_path, text)
    impulse = stops_at(block, block.x[block.x[:, 2].argmin()], np.array(v), np.array(w), e, mu)
    p = columns(run, "px py pz")
    # The block turns by 6e-4 in an increment.
    assert np.abs(p[-1] - p[0] - impulse).max() < 2e-3*np.abs(impulse).max()
    assert run.verdict["verdict"] == "good"
    assert run.verdict["jump_violation"] < 1e-10
    dissipates(run)


def test_a_restart_has_the_same_bits(tmp_path: Path) -> None:
    """Also of slips and tractions of faces, while the slab slides and turns."""
    (tmp_path/"whole").mkdir()
    (tmp_path/"again").mkdir()
    text = thrown("*FRICTION\n0.3\n").replace("*END STEP", "*CONTACT FILE\nCSHEAR, CSLIP\n*RESTART, WRITE, FREQUENCY=13\n*END STEP")
    whole = ran(tmp_path/"whole", text)
    again = restart(whole, tmp_path/"again")
    assert again.digits() == whole.digits()
    first, second = (FieldsOf(run.file(".surfaces.vtkhdf")).cell for run in (whole, again))
    for name in ("contact_shear", "contact_slip"):
        np.testing.assert_array_equal(first[name], second[name])
    assert np.abs(first["contact_slip"][-1, :4]).max() > .05


@pytest.mark.parametrize("mu", [.3, .8])
def test_friction_keeps_a_plane_of_symmetry(tmp_path: Path, mu: float) -> None:
    """Of a slab of several elements that slides along it, and stops."""
    run = ran(tmp_path, on_floor(mu, .01, .2, (1., 0, 0), is_rigid=False, cells=(4, 4, 2)))
    fields = run.fields()
    n = 5*5*3
    x = fields.x[:n]
    mirror = [int(np.argmin(np.abs(x - p*[1, -1, 1]).sum(1))) for p in x]
    u = fields["displacement"][:, :n]
    assert np.abs(u - u[:, mirror]*[1, -1, 1]).max() <= 64*EPSILON


def half_or_all(is_half: bool, card: str) -> tuple[Block, str]:
    """A slab that is pressed on the floor and shifted along it, or what of it is on one side of its plane of symmetry."""
    block = Block("C3D8", (4, 2 if is_half else 4, 2), size=(1, .5 if is_half else 1, .5),
                  place=lambda x: x - np.array([.5, 0 if is_half else .5, 0]))
    top = block.on(2, 1).tolist()
    held = "".join(f"{k}, 2, 2\n" for k in sorted({*top, *(block.on(1, 0).tolist() if is_half else [])}))
    text = (bodies([block], [faces(block, 2, 0)], STIFF) + walls.wall(walls.plane()) + walls.pair("", card)
            + f"*BOUNDARY\n{walls.FIXED}{held}*STEP, NLGEOM\n*STATIC\n.25, 1.\n*BOUNDARY\n")
    return block, text + "".join(f"{k}, 1, 1, .01\n{k}, 3, 3, -.02\n" for k in top) + "*NODE FILE\nU\n*CONTACT FILE\nCF\n*END STEP\n"


@pytest.mark.parametrize("card", ["*FRICTION\n.3\n", "*FRICTION\n1E-6\n", "*FRICTION, ROUGH\n"])
def test_half_of_what_is_symmetric(tmp_path: Path, card: str) -> None:
    """On the plane of symmetry no force moves a contact across it: it is solved as all of the body is."""
    (half, a), (whole, b) = half_or_all(is_half=True, card=card), half_or_all(is_half=False, card=card)
    for name in "ab":
        (tmp_path/name).mkdir()
    own, other = ran(tmp_path/"a", a), ran(tmp_path/"b", b)
    place = [int(np.argmin(np.abs(whole.x - p).sum(1))) for p in half.x]
    u = other.fields()["displacement"][-1][place]
    # Of statics, which Newton's method leaves.
    assert np.abs(own.fields()["displacement"][-1][:len(place)] - u).max() < 1e-9*np.abs(u).max()
    force = own.fields()["contact_force"][-1][half.on(1, 0) - 1]
    assert not force[:, 1].any()
    assert own.verdict["newton"] <= other.verdict["newton"]
    assert own.verdict["cuts"] == 0


def inertia(block: Block) -> tuple[float, float]:
    """Mass of a block of C3D8 of density 1, and its moment about the axis z through its middle."""
    point, weight = np.polynomial.legendre.leggauss(4)
    corner = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1],
                       [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])
    mass = moment = 0.0
    for nodes in block.element:
        x = block.x[np.array(nodes) - 1]
        for i, j, k in np.ndindex(4, 4, 4):
            part = (1 + corner*[point[i], point[j], point[k]])/2
            slope = corner/2*np.stack([part[:, 1]*part[:, 2], part[:, 2]*part[:, 0], part[:, 0]*part[:, 1]], 1)
            volume = weight[i]*weight[j]*weight[k]*np.linalg.det(slope.T@x)
            at = part.prod(1)@x
            mass, moment = mass + volume, moment + volume*(at[0]**2 + at[1]**2)
    return mass, moment


def billiard_balls(mu: float, h: float) -> tuple[Block, str]:
    """A ball hits one at rest at a cut of 30 degrees: that one, and the deck."""
    cut = np.radians(30.0)
    hit = Block("C3D8", (2, 2, 2), size=(2, 2, 2), place=ball)       # a node of it is where they touch
    core = Block("C3D8", (1, 1, 1), size=(CORE,)*3, place=lambda x: x - CORE/2 - np.array([2., 0, 0]))
    return hit, (bodies([hit, core], [faces(hit), faces(core)], STIFF) + comes_to_rest(1, hit)
                 + walls.wall(walls.sphere(1., (-2., 0., 0.)), (-2., 0., 0.), "ELSET=B2, ")
                 + walls.pair("", f"*FRICTION\n{mu}\n") + "*INITIAL CONDITIONS, TYPE=VELOCITY\n"
                 + f"{walls.REFERENCE}, 1, {float(np.cos(cut))!r}\n{walls.REFERENCE}, 2, {float(np.sin(cut))!r}\n"
                 + dynamic(h, 10*h))


@pytest.mark.parametrize("mu", [.06, .5])
def test_throw_of_billiard_balls(tmp_path: Path, mu: float) -> None:
    """A ball is hit at a cut of 30 degrees: friction throws it off the line of centres by atan(mu) = 3.434 degrees as long
    as they slide, and by the slip that is stopped over the push where they do not: for like balls atan(tan(30)/7)."""
    cut, h = np.radians(30.0), .001
    hit, text = billiard_balls(mu, h)
    run = ran(tmp_path, text)
    x = run.fields()["displacement"][:, :len(hit.x)].mean(1)
    way = x[-1] - x[-2]
    (m, turns), (n, spins) = inertia(hit), (CORE**3, .4*CORE**3)
    stopped = np.tan(cut)*(1/m + 1/n)/2/(1/m + 1/turns + 1/n + 1/spins)
    wanted = min(mu, stopped)
    assert .06 < stopped < .5
    # The line of centres turns by sin(30) h/2 in the increment of the impact.
    assert abs(np.arctan2(way[1], way[0]) - np.arctan(wanted)) < .5*h
    assert run.verdict["verdict"] == "good"
    dissipates(run)


@pytest.mark.parametrize("mu", [.1, .3])
def test_ball_rolls_down_a_slope(tmp_path: Path, mu: float) -> None:
    """Of 30 degrees: by 5/7 of its pull where mu is above 2/7 tan(30) = .165, and slides by its pull less friction else."""
    angle, until = float(np.radians(30.0)), .2
    run = ran(tmp_path, ball_on_floor(mu, .005, 12, slope=angle))
    pull = GRAVITY*np.sin(angle)
    wanted = 5/7*pull if mu > 2/7*np.tan(angle) else pull - mu*GRAVITY*np.cos(angle)
    speed = run.history["px"]/CORE**3
    assert speed[-1]/until == pytest.approx(wanted, rel=.01)
    dissipates(run)


@pytest.mark.parametrize("is_rigid", [True, False])
def test_friction_changes_between_steps(tmp_path: Path, is_rigid: bool) -> None:
    """A slab on a slope of .3 rests with mu = .5, slides down with .1 as a particle does, and is held again by RESET."""
    angle, until = float(np.arctan(.3)), .1
    text = on_floor(.5, .01, until, (0, 0, 0), slope=angle, is_rigid=is_rigid)
    step = text[text.index("*STEP"):]
    slides = "*CHANGE FRICTION, INTERACTION=I\n*FRICTION\n.1\n"
    text += step.replace("*NODE FILE", slides + "*NODE FILE")
    if is_rigid:
        text += step.replace("*NODE FILE", "*CHANGE FRICTION, INTERACTION=I, RESET\n*NODE FILE").replace(f"{until}\n", ".3\n")
    run = ran(tmp_path, text)
    t, p = run.history["time"], run.history["px"]/.5
    first = int(np.argmin(np.abs(t - until)))
    second = int(np.argmin(np.abs(t - 2*until)))
    wanted = GRAVITY*(np.sin(angle) - .1*np.cos(angle))*until
    if is_rigid:
        assert np.abs(p[:first + 1]).max() < 1e-12
        assert p[second] == pytest.approx(wanted, rel=1e-10)
        assert abs(p[-1]) < 1e-9
    else:                                        # it swings about that by what its shear gives
        assert p[second] == pytest.approx(wanted, rel=.1)
    dissipates(run)


def punch_on_a_pad(kind: str, mu: float, deep: float) -> str:
    """A rigid block with edges is pressed into a soft pad of height .6 and drawn aside by more than its length."""
    pad = Block("C3D8", (8, 5, 2), size=(2.4, 1.5, .6), place=lambda x: x - np.array([1.2, .75, .6]))
    punch = Block("C3D8", (1, 1, 1), size=(.6, .5, .3), place=lambda x: x - np.array([.85, .25, 0]))
    text = bodies([punch, pad], [faces(punch, 2, 0), faces(pad, 2, 1)], "*HYPERELASTIC, NEO HOOKE\n.5, .4\n*DENSITY\n1.\n")
    text += comes_to_rest(1, punch) + pair(kind, f"*FRICTION\n{mu}\n") + "*NSET, NSET=BASE\n"
    text += "".join(f"{len(punch.x) + i},\n" for i in pad.on(2, 0)) + "*BOUNDARY\nBASE, 1, 3\n"
    ref = 9001
    return text + "".join(f"*STEP, NLGEOM\n*STATIC\n{h}, 1.\n*BOUNDARY\n{b}*NODE FILE\nU\n*END STEP\n" for h, b in (
        (.5, f"{ref}, 1, 2\n{ref}, 3, 3, -{deep}\n{ref}, 4, 6\n"), (.1, f"{ref}, 1, 1, .7\n")))


@pytest.mark.parametrize("kind", ["", ", TYPE=MORTAR"])
def test_a_sharp_punch_is_dragged_over_a_pad(kind: str, tmp_path: Path) -> None:
    """It slides, and friction is what draws it back."""
    mu = .3
    run = ran(tmp_path, punch_on_a_pad(kind, mu, .05))
    drawn = run.history["time"] > 1.15
    force = (np.abs(columns(run, "pair1_force_x pair1_force_z"))*run.history["h"][:, None])[drawn].sum(0)
    assert run.verdict["verdict"] == "good"
    assert run.history["cuts"].sum() == 0
    # Edges climb onto elements and fall off them: in the mean over some that takes nothing.
    assert force[0] == pytest.approx(mu*force[1], rel=.1)
    dissipates(run)


@pytest.mark.parametrize("deep", [.05, .1])
def test_a_deep_drag_converges(deep: float, tmp_path: Path) -> None:
    """With mu = .8 the pad is sheared far: directions of slip and the ratio of normal forces change with it, and tangents
    know that. Without it .05 takes 310 of them, .1 comes no farther than 1.43."""
    run = ran(tmp_path, punch_on_a_pad(", TYPE=MORTAR", .8, deep))
    assert run.verdict["verdict"] == "good"
    assert run.history["cuts"].sum() == 0
    assert run.history["newton"].sum() < 200
    dissipates(run)


def ball_on_a_pad(mu: float, h: float, law: str = "", angle: float = 0.0, cells: tuple[int, int, int] = (8, 5, 2)) -> str:
    """A ball of radius .6, a wall, is pressed into a soft pad and drawn along it; all but the wall's vectors turned."""
    c, s = float(np.cos(angle)), float(np.sin(angle))
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    pad = Block("C3D8", cells, size=(2.4, 1.5, .6), place=lambda x: (x - np.array([1.2, .75, .6])) @ turn.T)
    at = (-.5*c, -.5*s, .6)
    text = bodies([pad], [faces(pad, 2, 1)], "*HYPERELASTIC, NEO HOOKE\n.5, .4\n*DENSITY\n1.\n")
    text += walls.wall(walls.sphere(.6, at), at) + walls.pair("", f"{law}*FRICTION\n{mu}\n") + "*NSET, NSET=BASE\n"
    text += "".join(f"{i},\n" for i in pad.on(2, 0)) + "*BOUNDARY\nBASE, 1, 3\n"
    held = f"{walls.REFERENCE}, 4, 6\n"
    return text + "".join(f"*STEP, NLGEOM\n*STATIC\n{step}, 1.\n*BOUNDARY\n{b}*NODE FILE\nU\n*END STEP\n" for step, b in (
        (.5, f"{walls.REFERENCE}, 1, 2\n{walls.REFERENCE}, 3, 3, -.05\n{held}"),
        (h, f"{walls.REFERENCE}, 1, 1, {.35*c}\n{walls.REFERENCE}, 2, 2, {.35*s}\n")))


@pytest.mark.parametrize(("mu", "h"), [(.3, .04), (.8, .1), (.8, .04)])
def test_a_ball_is_dragged_over_a_pad(mu: float, h: float, tmp_path: Path) -> None:
    """Where nodes are over the ball makes no difference to where friction points."""
    run = ran(tmp_path, ball_on_a_pad(mu, h))
    assert run.verdict["verdict"] == "good"
    assert run.history["cuts"].sum() == 0
    dissipates(run)


@pytest.mark.parametrize("law", ["", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n200.\n"])
def test_a_drag_turned_is_the_same(law: str, tmp_path: Path) -> None:
    """Springs of stick too, whose stretch is kept from step to step; but for the square of the angle that the ball's normal
    turns by over an increment, as directions are those of its middle."""
    runs = []
    for name, angle in (("a", 0.0), ("b", .6)):
        text = ball_on_a_pad(.3, .05, law, angle)
        if law:
            text = text.replace("*FRICTION\n0.3\n", "*FRICTION\n0.3, 2.\n")
        (tmp_path/name).mkdir()
        runs.append(ran(tmp_path/name, text))
    for name in ("strain", "external_work", "friction_loss"):
        one, other = (run.history[name] for run in runs)
        assert np.abs(one - other).max() <= (.05*.35/.6)**2*np.abs(one).max(), name
