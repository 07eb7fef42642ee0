"""Contact surfaces without mass in space: forces that are smooth, gaps that close exactly, energy and momenta."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import overlap
import pytest
from contact_space_scenes import ball, bodies, dynamic, faces, pair, stack, turned, velocities
from scene_tools import EPSILON, Run, run_deck
from space_mesh import CUBE_FACES, Block

#: Energy and momenta, of the largest of each.
BALANCE = 1.0e-11
#: Gaps that are closed to round-off of positions of size 1.
CLOSED = 64*EPSILON
MASSLESS = "*CONTACT INITIATION, TYPE=MASSLESS\n"
#: Of positions of a part and of the whole: steps end at residuals of 1e-10.
SAME = 1.0e-10
#: What the log says where nodes find no balance.
BACK = "get their mass back"


def ran(folder: Path, text: str) -> Run:
    folder.mkdir(exist_ok=True)
    (folder/"deck.inp").write_text(text)
    return run_deck(folder/"deck.inp", folder)


def on_plate(one: Block, h: float, v: tuple[float, float, float] = (0, 0, -1), w: tuple[float, float, float] = (0, 0, 0),
             more: str = MASSLESS, cells: int = 1, outer: list[tuple[int, int]] | None = None, held: str = "",
             until: float = 0.64) -> str:
    """A body that falls from .06 onto a large rigid plate, which is fixed."""
    one.x[:, 2] += 0.06 - one.x[:, 2].min()
    two = Block("C3D8", (cells, cells, 1), size=(6, 6, 1), place=lambda x: x - np.array([3, 3, 1]))
    return (bodies([one, two], [faces(one) if outer is None else outer, faces(two, 2, 1)]) + pair()
            + velocities(one, v, w) + "*NODE\n9999, 0., 0., -.5\n*RIGID BODY, ELSET=B2, REF NODE=9999\n"
            + f"*BOUNDARY\n9999, 1, 6\n{held}" + dynamic(h, until, more))


def roughness(run: Run, h: float, each: int = 1) -> tuple[float, float]:
    """Of the force while there is one, from momenta after each so many steps, `h` apart: the root mean square of its
    second differences over the mean, and its total variation over the largest: 2 where it rises and falls once."""
    force = np.diff(run.history["pair1_impulse_z"][::each])/h
    acts = np.flatnonzero(np.abs(force) > 1.0e-9*np.abs(force).max())
    force = force[acts[0]:acts[-1] + 1]
    return (float(np.sqrt((np.diff(force, 2)**2).mean())/abs(force.mean())),
            float(np.abs(np.diff([0, *force, 0])).sum()/np.abs(force).max()))


def check(run: Run, is_free: bool, depth: float) -> None:
    history = run.history
    assert run.verdict["verdict"] == "good", run.log[-600:]
    assert np.ptp(history["total"]) <= BALANCE*history["total"].max()
    if is_free:
        for names in ("px py pz", "lx ly lz"):
            found = np.array([history[name] for name in names.split()]).T
            assert np.abs(found - found[0]).max() <= BALANCE
    assert overlap.worst(run.fields()).depth <= depth
    assert history["cuts"].sum() == 0
    assert BACK not in run.log
    assert history["active"].max() > 0


def test_the_force_of_a_ball_is_smooth(tmp_path: Path) -> None:
    """It rises and falls once, its second differences go with those of a smooth curve, the rebound converges, and
    nothing stands off; with mass forces jump up and down."""
    found = {}
    for h in (0.02, 0.01):
        run = ran(tmp_path/repr(h), on_plate(Block("C3D8", (4, 4, 4), size=(2, 2, 2), place=ball), h))
        check(run, False, CLOSED)
        rough, variation = roughness(run, h)
        assert variation <= 2.0 + 1.0e-6
        assert run.history["stand_off"].max() <= CLOSED
        found[h] = rough, -run.history["pz"][-1]/run.history["pz"][0]
    assert found[0.02][0] < 0.1
    assert found[0.02][0]/found[0.01][0] > 2.5
    assert abs(found[0.02][1] - found[0.01][1]) < 1.0e-3
    assert 0.99 < found[0.01][1] < 1.0
    text = on_plate(Block("C3D8", (4, 4, 4), size=(2, 2, 2), place=ball), 0.01, more="*CONTACT INITIATION, TYPE=PERSISTENT\n")
    assert roughness(ran(tmp_path/"mass", text), 0.01)[0] > 20*found[0.01][0]


def stiffness_at_the_pole(folder: Path, own: Block) -> float:
    """Of a surface without mass over inner nodes, which do not move within a short time: force by way, by statics."""
    pole = int(np.argmin(own.x[:, 2])) + 1
    outer = {own.element[e - 1][c] for e, f in faces(own) for c in CUBE_FACES[f - 1]}
    held = "".join(f"{k}, 1, 3\n" for k in range(1, len(own.x) + 1) if k not in outer)
    run = ran(folder, bodies([own], [faces(own)]) + f"*BOUNDARY\n{held}*STEP, NLGEOM\n*STATIC\n1., 1.\n*BOUNDARY\n"
              f"{pole}, 3, 3, 1e-5\n*NODE FILE\nU, RF\n*END STEP\n")
    return float(run.fields()["reaction_force"][-1][pole - 1][2])/1e-5


def test_where_the_force_of_a_ball_bends(tmp_path: Path) -> None:
    """A node that joins at the speed v is stiffer by k than none, and the rate of the force jumps by k v. So second
    differences are of the second order but where nodes join and leave: there they go with h. The same motion in steps of
    a half, looked at as rarely, is as rough; a finer mesh is not."""
    def own(n: int) -> Block:
        return Block("C3D8", (n, n, n), size=(2, 2, 2), place=ball)

    smooth, bends, runs = [], [], []
    for h in (0.01, 0.005):
        run = ran(tmp_path/repr(h), on_plate(own(4), h))
        force = np.diff(run.history["pair1_impulse_z"])/h
        second = np.diff(force, 2)
        joins = np.flatnonzero(np.diff(run.history["active"]))
        at_joins = np.zeros(len(second), bool)
        for i in joins:
            at_joins[i - 3:i + 2] = True
        acts = np.flatnonzero(force > 1.0e-9*force.max())
        inside = slice(acts[0], acts[-1] - 1)
        smooth.append(np.sqrt((second[inside][~at_joins[inside]]**2).mean()))
        bends.append(np.array([second[i - 2:i + 3].sum()/h for i in joins]))
        runs.append(run)
    assert smooth[0] > 2**1.8*smooth[1]
    assert len(bends[0]) == len(bends[1]) == 4
    assert np.abs(bends[0]/bends[1] - 1.0).max() < 0.15
    assert abs(bends[1][0]/stiffness_at_the_pole(tmp_path/"pole", own(4)) - 1.0) < 0.05
    assert roughness(runs[1], 0.01, each=2)[0] > 0.9*roughness(runs[0], 0.01)[0]
    assert roughness(ran(tmp_path/"finer", on_plate(own(5), 0.01)), 0.01)[0] < 0.02


def test_faces_of_a_plane_make_no_difference(tmp_path: Path) -> None:
    """A ball of small faces that hits a plate of one large face askew, or of many: the same but for round-off."""
    turn, places = turned(0.15), []
    for cells in (1, 6):
        one = Block("C3D8", (3, 3, 3), size=(2, 2, 2), place=lambda x: ball(x) @ turn.T)
        run = ran(tmp_path/str(cells), on_plate(one, 0.02, (.8, .3, -1), (0, 0, 1), cells=cells))
        check(run, False, CLOSED)
        assert roughness(run, 0.02)[1] <= 2.0 + 1.0e-6
        places.append(run.fields()["displacement"][-1][:len(one.x)])
    assert np.abs(places[0] - places[1]).max() <= 1.0e-9


def in_planes(own: Block) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Which nodes of a quarter are in the planes x = 0 and y = 0, and the faces that are not."""
    at = np.abs(own.x[:, :2]) < 1.0e-12
    return at, [(e, f) for e, f in faces(own)
                if not at[[own.element[e - 1][c] - 1 for c in CUBE_FACES[f - 1]]].all(0).any()]


def check_part(folder: Path, whole: str, part: str, at: list[int]) -> None:
    """A quarter moves as the whole does, node by node."""
    runs = [ran(folder/name, text) for name, text in (("whole", whole), ("part", part))]
    for run in runs:
        check(run, False, CLOSED)
    a, b = (run.fields()["displacement"] for run in runs)
    assert runs[1].history["active"].max() > 0
    assert np.abs(a[:, at] - b[:, :len(at)]).max() < SAME


@pytest.mark.parametrize(("cells", "more"), [(1, MASSLESS), (1, ""), (2, "")])
def test_a_quarter_of_a_ball(cells: int, more: str, tmp_path: Path) -> None:
    """Nodes in planes of symmetry are held as those of the whole, on which the surface goes on: over a face of the plate
    and over a node of it."""
    whole = Block("C3D8", (4, 4, 4), size=(2, 2, 2), place=ball)
    part = Block("C3D8", (2, 2, 4), size=(1, 1, 2), place=lambda x: ball(x + np.array([1, 1, 0])))
    at, outer = in_planes(part)
    held = "".join(f"{k}, {a + 1}, {a + 1}\n" for a in (0, 1) for k in np.flatnonzero(at[:, a]) + 1)
    same = [int(np.argmin(np.linalg.norm(whole.x - x, axis=1))) for x in part.x]
    check_part(tmp_path, on_plate(whole, 0.02, more=more, cells=cells, until=0.4),
               on_plate(part, 0.02, more=more, cells=cells, outer=outer, held=held, until=0.4), same)


def test_a_quarter_of_two_bodies(tmp_path: Path) -> None:
    """A ball falls onto an elastic block; both are cut by the planes."""
    texts, parts = [], []
    for cut in (1, 2):
        one = Block("C3D8", (4//cut, 4//cut, 4), size=(2/cut, 2/cut, 2),
                    place=lambda x, cut=cut: ball(x + np.array([1, 1, 0])*(cut - 1)))
        two = Block("C3D8", (4//cut, 4//cut, 2), size=(3/cut, 3/cut, 1),
                    place=lambda x, cut=cut: x - np.array([1.5, 1.5, 0])*(2 - cut) - np.array([0, 0, 1]))
        one.x[:, 2] += 0.06 - one.x[:, 2].min()
        n = len(one.x)
        text = bodies([one, two], [in_planes(own)[1] if cut == 2 else faces(own) for own in (one, two)]) + pair()
        text += velocities(one, (0, 0, -1), (0, 0, 0)) + "*BOUNDARY\n"
        text += "".join(f"{n + k}, 1, 3\n" for k in two.on(2, 0))
        if cut == 2:
            text += "".join(f"{first + k}, {a + 1}\n" for own, first in ((one, 0), (two, n)) for a in (0, 1)
                            for k in np.flatnonzero(in_planes(own)[0][:, a]) + 1)
        texts.append(text + dynamic(0.02, 0.4))
        parts.append(np.vstack([one.x, two.x]))
    check_part(tmp_path, *texts, [int(np.argmin(np.linalg.norm(parts[0] - x, axis=1))) for x in parts[1]])


def test_a_ball_on_a_free_block(tmp_path: Path) -> None:
    """Both deform, neither has mass at its surface; nodes of one hold, those of the other are guards."""
    turn = turned(0.15)
    one = Block("C3D8", (3, 3, 3), size=(2, 2, 2), place=lambda x: ball(x) @ turn.T)
    one.x[:, 2] += 0.06 - one.x[:, 2].min()
    two = Block("C3D8", (4, 4, 2), size=(3, 3, 1.5), place=lambda x: x - np.array([1.5, 1.5, 1.5]))
    text = bodies([one, two], [faces(one), faces(two, 2, 1)]) + pair() + velocities(one, (.6, .25, -1), (0, 0, 1))
    run = ran(tmp_path, text + dynamic(0.02, 0.9, MASSLESS))
    check(run, True, 1.0e-3)
    rough, variation = roughness(run, 0.02)
    assert rough < 0.1
    assert variation <= 2.0 + 1.0e-6
    assert run.history["stand_off"].max() <= CLOSED
    assert "stands no denser than" in run.errors + run.log


@pytest.mark.each_value
@pytest.mark.parametrize("kind", ["C3D8", "C3D4"])
@pytest.mark.parametrize(("cells", "angle"), [
    ([(1, 1, 1), (1, 1, 1)], 0.0), ([(2, 2, 2), (2, 2, 2)], 0.0), ([(2, 2, 2), (2, 2, 2)], 0.1),
    ([(3, 3, 2), (3, 3, 2)], 0.1), ([(2, 2, 2), (3, 3, 3)], 0.0)])
def test_cubes_node_on_node(kind: str, cells: list[tuple[int, int, int]], angle: float, tmp_path: Path) -> None:
    """Where nodes of both surfaces meet each other no node takes its mass back; guards let nodes in by less than a
    twentieth of a face."""
    run = ran(tmp_path, stack(cells, 0.03, angle, kind=kind, options=", EDGES=NO", more=MASSLESS))
    check(run, True, 0.05)


def test_both_sides_are_held_if_asked(tmp_path: Path) -> None:
    """Nodes that find no balance may take their mass back; energy and momenta stay."""
    run = ran(tmp_path, stack([(2, 2, 2), (3, 3, 3)], 0.03, options=", SIDES=BOTH", more=MASSLESS))
    history = run.history
    assert run.verdict["verdict"] == "good"
    assert "no denser" not in run.errors + run.log
    assert np.ptp(history["total"]) <= BALANCE*history["total"].max()
    for names in ("px py pz", "lx ly lz"):
        found = np.array([history[name] for name in names.split()]).T
        assert np.abs(found - found[0]).max() <= BALANCE


def test_many_nodes_are_balanced_by_a_factor_of_their_own(tmp_path: Path) -> None:
    """A face of 121 nodes that lands on another, as by a solver whose factors serve no other set of contacts: all
    balances are then by tangents."""
    text = stack([(10, 10, 1), (10, 10, 1)], 0.003, h=0.004, more=MASSLESS).replace("0.004, 0.6\n", "0.004, 0.024\n")
    runs = [ran(tmp_path/solver, text.replace("*DYNAMIC, DIRECT", f"*DYNAMIC, DIRECT, SOLVER={solver}"))
            for solver in ("DEFAULT", "UMFPACK")]
    for run in runs:
        check(run, True, 1.0e-3)
        assert run.history["active"].max() == 121
    u = [run.fields()["displacement"][-1] for run in runs]
    assert np.abs(u[0] - u[1]).max() <= SAME*np.abs(u[1]).max()


@pytest.mark.parametrize(("cells", "wanted"), [((3, 3, 3), "MASSLESS"), ((2, 2, 2), "PERSISTENT")])
def test_what_the_program_chooses(cells: tuple[int, int, int], wanted: str, tmp_path: Path) -> None:
    """By the part of a body's mass at its surface: a face of a cube has half of a layer, 1/6 of three and 1/4 of two."""
    run = ran(tmp_path, stack([cells, cells], 0.03))
    found = re.search(r"first contact: (\w+)", run.log)
    assert found is not None
    assert found[1] == wanted
