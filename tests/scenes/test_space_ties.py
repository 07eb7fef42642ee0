"""Ties in space: constant stress over unlike meshes, flights, spheres, pieces that meet in edges and a point."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from contact_space_scenes import RUBBER, ball, bodies, faces, straight, turned, velocities
from scene_tools import Deck, Run, run_deck
from space_mesh import Block
from tie_space_scenes import (box, cube_in_hole, eighths, flight, momenta, quarter_shells, shaken, shells, stretch, tied)


def run(text: str, folder: Path, **more: object) -> Run:
    return run_deck(Deck(text), folder, **more)


def check_stretched(done: Run, x: np.ndarray) -> None:
    """A bar that is pulled by a thousandth: stress E/1000 along it and nothing else, places in closed form."""
    fields = done.fields()
    # Newton's method stops at residuals of 1e-12 of the largest force; the condition of the mesh is some 1e2.
    np.testing.assert_allclose(fields["displacement"][-1], 0.001*x*[-0.3, -0.3, 1.0], rtol=0, atol=1e-10*0.001)
    stress = fields["cauchy_stress"][-1].reshape(len(x), -1)
    np.testing.assert_allclose(stress[:, 2], 1.0, rtol=0, atol=1e-10)
    np.testing.assert_allclose(np.delete(stress, 2, 1), 0.0, rtol=0, atol=1e-10)


@pytest.mark.parametrize(("kinds", "cells", "shake", "options"), [
    (("C3D8", "C3D8"), (2, 3), 0.1, ""), (("C3D8", "C3D8"), (3, 2), 0.1, ""),
    (("C3D8", "C3D8"), (2, 4), 0.1, ", MULTIPLIER=STANDARD"), (("C3D8", "C3D8"), (1, 1), 0.0, ""),
    (("C3D4", "C3D8"), (2, 3), 0.1, ""), (("C3D8", "C3D4"), (2, 2), 0.1, ""),
    (("C3D10", "C3D8"), (2, 3), 0.1, ""), (("C3D8", "C3D10"), (3, 2), 0.1, ""),
    (("C3D20R", "C3D10"), (2, 1), 0.1, ""), (("C3D10", "C3D20"), (2, 2), 0.1, ""), (("C3D20", "C3D20R"), (3, 2), 0.2, ""),
    (("C3D8", "C3D20"), (2, 1), 0.0, ", MULTIPLIER=STANDARD")])
def test_constant_stress(kinds, cells, shake, options, tmp_path: Path) -> None:
    """Over unlike meshes of any kinds, with nodes between corners on either side."""
    lower = shaken(box(kinds[0], (cells[0],)*3, (0, 0, 0), (1, 1, .5)), 0.5, shake)
    upper = shaken(box(kinds[1], (cells[1],)*3, (0, 0, .5), (1, 1, 1)), 0.5, shake)
    text, x = tied([lower, upper], [(1, 0, 2)], options=options)
    check_stretched(run(text + stretch(x), tmp_path), x)


def test_constant_stress_turned(tmp_path: Path) -> None:
    """The same, of a body that is turned."""
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    blocks = [shaken(box("C3D20", (2,)*3, (0, 0, 0), (1, 1, .5)), 0.5, 0.2), shaken(box("C3D8", (3,)*3, (0, 0, .5), (1, 1, 1)), 0.5, 0.2)]
    x = np.vstack([b.x for b in blocks])
    for block in blocks:
        block.x = block.x @ turn.T
    text, y = tied(blocks, [(1, 0, 2)])
    u = 0.001*x*[-0.3, -0.3, 1.0] @ turn.T
    text += "*STEP\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\n" + "".join(
        f"{k + 1}, {a + 1}, {a + 1}, {float(u[k, a])!r}\n" for k in np.flatnonzero((x[:, 2] < 1e-9) | (x[:, 2] > 1 - 1e-9)) for a in range(3))
    fields = run(text + "*NODE FILE\nU\n*EL FILE\nS\n*END STEP\n", tmp_path).fields()
    np.testing.assert_allclose(fields["displacement"][-1], u, rtol=0, atol=1e-10*0.001)


@pytest.mark.parametrize(("kinds", "cells"), [
    (["C3D8"]*8, [2, 3, 2, 3, 3, 2, 4, 3]), (["C3D8"]*8, [1]*8),
    (["C3D8", "C3D10", "C3D20", "C3D4", "C3D8I", "C3D20R", "C3D10", "C3D8H"], [1, 2, 2, 1, 2, 1, 1, 2])])
def test_pieces_that_meet_in_edges_and_a_point(kinds, cells, tmp_path: Path) -> None:
    """Eight boxes, twelve ties: constant stress passes; in flight energy and momenta stay."""
    blocks, ties = eighths(kinds, cells)
    text, x = tied(blocks, ties)
    check_stretched(run(text + stretch(x), tmp_path), x)
    text, x = tied(blocks, ties, RUBBER)
    check_flight(run(text + flight(x, steps=6), tmp_path), blocks)


def check_flight(done: Run, blocks: list[Block]) -> None:
    """Energy and momenta of the balance; of eight-node elements momenta by sums of our own, too."""
    history = done.history
    assert np.ptp(history["total"]) < 1e-13*history["total"][0]
    for place in ("px", "py", "pz"), ("lx", "ly", "lz"):
        value = np.array([history[name] for name in place])
        assert np.ptp(value, axis=1).max() < 1e-13*np.abs(value).max()
    assert history["strain"].max() > 0.02*history["total"][0], "the bodies are to swing"
    if any(block.kind != "C3D8" for block in blocks):
        return
    fields, element, first = done.fields(), [], 0
    for block in blocks:
        element += [[first + k for k in nodes] for nodes in block.element]
        first += len(block.x)
    x, u, v = fields.x, fields["displacement"], fields["velocity"]
    start, end = (momenta(element, x, x + u[i], v[i]) for i in (0, -1))
    # Fields are written in double; the sums have some hundred terms.
    np.testing.assert_allclose(end, start, rtol=0, atol=1e-13*np.abs(start).max())


@pytest.mark.parametrize(("cells", "kinds", "slave"), [
    ((1, 2), ("C3D8", "C3D8"), 2), ((2, 3), ("C3D8", "C3D8"), 1), ((2, 2), ("C3D8", "C3D8"), 2),
    ((1, 2), ("C3D20", "C3D8"), 2), ((1, 2), ("C3D8", "C3D10"), 2)])
def test_interface_with_edges(cells, kinds, slave, tmp_path: Path) -> None:
    """At its edges a constant stress has two tractions: nodes there have no multiplier that both sides share."""
    text, x = cube_in_hole(cells, kinds, slave)
    check_stretched(run(text + stretch(x), tmp_path), x)


@pytest.mark.each_value
@pytest.mark.parametrize("more", ["", "*CONSTRAINT METHOD, TYPE=SADDLE POINT\n"])
@pytest.mark.parametrize("kinds", [("C3D8", "C3D8"), ("C3D8", "C3D10"), ("C3D10", "C3D8"), ("C3D20", "C3D20R"), ("C3D10", "C3D20")])
def test_flight_of_curved_pieces(kinds, more, tmp_path: Path) -> None:
    """Slave nodes are put onto the polygons of the master: then nothing is lost on a curved interface."""
    cells = [(4, 2), (6, 3)] if kinds[0] == kinds[1] else [(3, 1), (4, 2)] if "C3D8" in kinds else [(2, 1), (3, 1)]
    text, x = quarter_shells(cells, list(kinds))
    done = run(text + flight(x, more, 8), tmp_path)
    check_flight(done, [Block(k, (1, *n)) for k, n in zip(kinds, cells, strict=True)])
    assert "slave nodes moved onto the master surface" in done.log


def test_eliminated_or_by_multipliers(tmp_path: Path) -> None:
    """Other unknowns, another matrix, the same motion."""
    blocks = [box("C3D8", (2,)*3, (0, 0, 0), (1, 1, .5)), box("C3D8", (3,)*3, (0, 0, .5), (1, 1, 1))]
    text, x = tied(blocks, [(1, 0, 2)], RUBBER)
    u = [run(text + flight(x, more, 5), tmp_path/str(i)).fields()["displacement"][-1]
         for i, more in enumerate(("", "*CONSTRAINT METHOD, TYPE=SADDLE POINT\n"))]
    assert np.abs(u[0] - u[1]).max() < 1e-11*np.abs(u[0]).max()


@pytest.mark.parametrize(("kinds", "cells", "bound"), [
    (("C3D8", "C3D8"), (1.0, 1.5), 0.04), (("C3D8", "C3D8"), (1.5, 1.0), 0.04),
    (("C3D20R", "C3D20R"), (1.0, 1.5), 2.2e-4)])
def test_shells_under_pressure(kinds, cells, bound, tmp_path: Path) -> None:
    """Lame's sphere in two tied shells: the displacement at both ends and at the tie, of second order at least.

    `bound` is what meshes of one piece of 4 by 4 by 2 elements a patch and shell are off by, and a tenth of that.
    """
    exact = [8.0e-4, 4.15873016e-4, 3.0e-4]
    off, worst = [], []
    for i, n in enumerate((2, 4)):
        text, x = shells(list(kinds), [round(n*c) for c in cells], n//2)
        u = run(text, tmp_path/str(i)).fields()["displacement"][-1]
        r = np.linalg.norm(x, axis=1)
        out = (u*x).sum(1)/r
        off.append([abs(out[np.abs(r - at) < 1e-9].mean()/e - 1) for at, e in zip((1, 1.5, 2), exact, strict=True)])
        worst.append(np.abs(out[np.abs(r - 1.5) < 1e-9]/exact[1] - 1).max())
    assert max(off[1]) < min(bound, max(off[0])/3)
    assert worst[1] < worst[0]/(6 if kinds[0] == "C3D20R" else 3), "of third order at the tie, or of second"


@pytest.mark.parametrize("how", ["*CONTACT PAIR, INTERACTION=I\nS1, TOP\n", "*CONTACT PAIR, INTERACTION=I\nTOP, S1\n",
                                 "*CONTACT\n*CONTACT INCLUSIONS, ALL EXTERIOR\n"])
def test_contact_on_tied_pieces(how: str, tmp_path: Path) -> None:
    """A ball that meets two halves of a plate near the seam, and leaves them."""
    turn = turned(.15)
    blocks = [straight(Block("C3D8", (2,)*3, size=(2, 2, 2), place=lambda x: ball(x) @ turn.T + [.1, .05, 1.02])),
              box("C3D8", (2, 4, 1), (-1.5, -1.5, -.7), (0, 1.5, 0)), box("C3D8", (3, 5, 2), (0, -1.5, -.7), (1.5, 1.5, 0))]
    text = bodies(blocks, [faces(blocks[0]), faces(blocks[1], 0, 1), faces(blocks[2], 0, 0)])
    before = np.cumsum([0] + [len(b.element) for b in blocks])
    text += "*SURFACE, NAME=TOP\n" + "".join(f"{before[i] + e}, S{f}\n" for i in (1, 2) for e, f in faces(blocks[i], 2, 1))
    text += "*TIE, NAME=SEAM\nS3, S2\n*SURFACE INTERACTION, NAME=I\n" + how
    text += velocities(blocks[0], (.6, .25, -1.0), (0., 0., 1.))
    done = run(text + "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n.02, .8\n*NODE FILE\nU, V\n*END STEP\n", tmp_path)
    history = done.history
    assert history["active"].max() > 0 and history["active"][-1] == 0
    assert history["pz"][0] < 0 and done.verdict["verdict"] == "good"
    check_flight(done, blocks)


def test_rigid_master(tmp_path: Path) -> None:
    """A block that is tied to a rigid one flies with it."""
    blocks = [box("C3D8", (2,)*3, (0, 0, 0), (1, 1, .5)), box("C3D8", (3,)*3, (0, 0, .5), (1, 1, 1))]
    text, x = tied(blocks, [(1, 0, 2)], RUBBER)
    n = len(blocks[0].x)
    spin = np.array([.4, 1.3, .7])
    v = np.cross(spin, x[n:] - x[0])
    text += "*RIGID BODY, ELSET=B1, REF NODE=1\n*INITIAL CONDITIONS, TYPE=VELOCITY\n"
    text += "".join(f"1, {a + 4}, {s!r}\n" for a, s in enumerate(spin.tolist()))
    text += "".join(f"{n + k}, {a}, {s!r}\n" for k, row in enumerate(v.tolist(), 1) for a, s in enumerate(row, 1))
    done = run(text + "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n.05, .5\n*NODE FILE\nU, V\n*END STEP\n", tmp_path)
    history = done.history
    assert np.ptp(history["total"]) < 1e-13*history["total"][0]
    assert max(np.ptp(history[k]) for k in ("lx", "ly", "lz")) < 1e-13*max(abs(history[k][0]) for k in ("lx", "ly", "lz"))


def as_nodes(text: str) -> str:
    """The slave as a surface of the nodes of its faces: here all of its block that are on the master."""
    return text.replace("*TIE, NAME=T", "*SURFACE, NAME=T1N, TYPE=NODE\nSLAVES\n*TIE, NAME=T").replace("T1S, T1M", "T1N, T1M")


@pytest.mark.parametrize(("cells", "is_exact"), [((2, 2), True), ((3, 2), False)])
def test_slave_of_nodes(cells, is_exact, tmp_path: Path) -> None:
    """Nodes on nodes are one mesh; elsewhere a uniform stress scatters, and the warning says so. Nothing is lost in flight."""
    blocks = [box("C3D8", (cells[0],)*3, (0, 0, 0), (1, 1, .5)), box("C3D8", (cells[1],)*3, (0, 0, .5), (1, 1, 1))]
    first = len(blocks[0].x)
    labels = "*NSET, NSET=SLAVES\n" + "".join(f"{first + k}\n" for k in blocks[1].on(2, 0))
    text, x = tied(blocks, [(1, 0, 2)])
    done = run(as_nodes(text.replace("*TIE", labels + "*TIE", 1)) + stretch(x), tmp_path/"rest")
    assert "its nodes are tied one by one" in done.errors
    if is_exact:
        check_stretched(done, x)
    else:
        assert np.ptp(done.fields()["cauchy_stress"][-1].reshape(len(x), -1)[:, 2]) > 1e-3
    text, x = tied(blocks, [(1, 0, 2)], RUBBER)
    check_flight(run(as_nodes(text.replace("*TIE", labels + "*TIE", 1)) + flight(x, steps=6), tmp_path/"flight"), blocks)


def by_nodes(blocks: list[Block], text: str, sides: str) -> str:
    """The sides of the first tie, S or M or both, as surfaces of nodes."""
    first = np.cumsum([0] + [len(b.x) for b in blocks])
    for side, b, end in (("S", 1, 0), ("M", 0, 1)):
        if side in sides:
            labels = "".join(f"{first[b] + k}\n" for k in blocks[b].on(2, end))
            text = text.replace("*TIE, NAME=T", f"*NSET, NSET=NODES{side}\n{labels}*SURFACE, NAME=N{side}, TYPE=NODE\nNODES{side}\n*TIE, NAME=T")
            text = text.replace(f"T1{side}, T1M" if side == "S" else ", T1M", f"N{side}, T1M" if side == "S" else ", NM")
    return text


@pytest.mark.parametrize(("sides", "kinds"), [("SM", ("C3D8", "C3D8")), ("SM", ("C3D20", "C3D10")), ("M", ("C3D10", "C3D8"))])
def test_faces_that_nodes_make_up(sides, kinds, tmp_path: Path) -> None:
    """A master of nodes is their faces, and so is a slave of nodes beside it: a uniform stress passes between unlike meshes."""
    blocks = [box(kinds[0], (2,)*3, (0, 0, 0), (1, 1, .5)), box(kinds[1], (3,)*3, (0, 0, .5), (1, 1, 1))]
    text, x = tied(blocks, [(1, 0, 2)])
    text = by_nodes(blocks, text, sides)
    assert text.count("TYPE=NODE") == len(sides)
    done = run(text + stretch(x), tmp_path)
    check_stretched(done, x)
    assert done.errors.count("free faces whose nodes are all in it") == len(sides)


def test_nodes_that_make_up_no_face(tmp_path: Path) -> None:
    blocks = [box("C3D8", (2,)*3, (0, 0, 0), (1, 1, .5)), box("C3D8", (3,)*3, (0, 0, .5), (1, 1, 1))]
    text, x = tied(blocks, [(1, 0, 2)])
    text = by_nodes(blocks, text, "M")
    nodes = re.search(r"(?s)NSET=NODESM\n(.*?)\*", text)[1]
    one, *_ = nodes.splitlines()
    errors = run(text.replace(f"NSET=NODESM\n{nodes}", f"NSET=NODESM\n{one}\n") + stretch(x), tmp_path, code=2).errors
    assert "the master surface 'NM' has TYPE=NODE" in errors


def two_sides(upper: Block, slave: tuple[int, int] = (2, 0), master: tuple[int, int] = (2, 1), options: str = "") -> str:
    """A block of unlike mesh near another, and ends of axes that are slave and master."""
    lower = box("C3D8", (2,)*3, (0, 0, 0), (1, 1, .5))
    text = bodies([lower, upper], [faces(lower), faces(upper)])
    text += "*SURFACE, NAME=SLAVE\n" + "".join(f"{len(lower.element) + e}, S{f}\n" for e, f in faces(upper, *slave))
    text += "*SURFACE, NAME=MASTER\n" + "".join(f"{e}, S{f}\n" for e, f in faces(lower, *master))
    return text + f"*TIE, NAME=T{options}\nSLAVE, MASTER\n" + stretch(np.vstack([lower.x, upper.x]))


@pytest.mark.parametrize(("low", "slave", "master", "options", "told"), [
    ((0, 0, .8), (2, 0), (2, 1), "", "the surfaces do not meet: slave node 28, the nearest one, is 0.3 from the master"),
    ((.4, 0, .5), (2, 0), (2, 1), "", "8 of 16 nodes of slave surface SLAVE are farther from master surface MASTER than"),
    ((0, 0, .5), (2, 1), (2, 1), ", POSITION TOLERANCE=1.", "their faces do not face each other: check the face labels"),
    ((0, 0, .5), (0, 0), (2, 1), ", POSITION TOLERANCE=.6", "their faces do not face each other: check the face labels")])
def test_sides_that_do_not_fit(low, slave, master, options, told, tmp_path: Path) -> None:
    """Each is an error with its line and what there is to know."""
    upper = box("C3D8", (3,)*3, low, np.array(low) + [1, 1, .5])
    text = two_sides(upper, slave, master, options)
    line = text[:text.index("SLAVE, MASTER\n")].count("\n") + 1
    errors = run(text, tmp_path, code=2).errors
    assert f"deck.inp:{line}: error: tie T: " in errors
    assert told in errors


@pytest.mark.parametrize("pair", ["SIDE, WALL", "WALL, SIDE"])
def test_contact_of_tied_slave_nodes(pair: str, tmp_path: Path) -> None:
    """Two tied blocks hit a third by a side that has the seam: nodes of the tie are in contact, too."""
    blocks = [box("C3D8", (2,)*3, (0, 0, 0), (1, 1, .5)), box("C3D8", (3,)*3, (0, 0, .5), (1, 1, 1)),
              box("C3D8", (2,)*3, (1.02, -.1, -.1), (2, 1.1, 1.1))]
    text, x = tied(blocks, [(1, 0, 2)], RUBBER)
    before = np.cumsum([0] + [len(b.element) for b in blocks])
    for name, sides in (("SIDE", ((0, 0, 1), (1, 0, 1))), ("WALL", ((2, 0, 0),))):
        text += f"*SURFACE, NAME={name}\n" + "".join(f"{before[i] + e}, S{f}\n" for i, a, end in sides for e, f in faces(blocks[i], a, end))
    n = len(blocks[0].x) + len(blocks[1].x)
    text += "*INITIAL CONDITIONS, TYPE=VELOCITY\n" + "".join(f"{k}, 1, 1.\n" for k in range(1, n + 1))
    text += f"*SURFACE INTERACTION, NAME=I\n*CONTACT PAIR, INTERACTION=I\n{pair}\n"
    done = run(text + "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n.01, .5\n*NODE FILE\nU, V\n*END STEP\n", tmp_path)
    history = done.history
    assert history["active"].max() > 0
    assert done.verdict["verdict"] == "good"
    assert np.ptp(history["total"]) < 1e-12*history["total"][0]
    assert np.ptp(history["px"]) < 1e-12*history["px"][0]


@pytest.mark.parametrize(("step", "part"), [
    ("*DYNAMIC, DIRECT\n.05, .4\n", 1e-12), ("*DYNAMIC, DIRECT\n.05, .4\n*CONSTRAINT METHOD, TYPE=SADDLE POINT\n", 1e-12),
    ("*DYNAMIC, EXPLICIT, DIRECT\n.002, .4\n", 1e-3)])
def test_surfaces_that_stay_apart(step: str, part: float, tmp_path: Path) -> None:
    """Polygons in polygons, not adjusted: angular momentum is lost, as much as the warning says; nothing else is."""
    cells = [(4, 2), (6, 3)]
    text, x = quarter_shells(cells, ["C3D8", "C3D8"])
    text = text.replace("*TIE, NAME=T", "*TIE, NAME=T, ADJUST=NO")
    done = run(text + flight(x).replace("*DYNAMIC, DIRECT\n.05, 1.0\n", step), tmp_path)
    fields, element, first = done.fields(), [], 0
    np.testing.assert_allclose(fields.x, x, rtol=0, atol=1e-15, err_msg="nothing is moved")
    apart = float(re.search(r"its surfaces stay apart by up to (\S+),", done.log)[1])
    assert 0.0 < apart < 1.3*(1 - np.cos(np.pi/16)), "less than the sagitta of the coarser polygon"
    for i, n in enumerate(cells):
        block = Block("C3D8", (1, *n))
        element += [[first + k for k in nodes] for nodes in block.element]
        first += len(block.x)
    start, end = (momenta(element, x, x + fields["displacement"][i], fields["velocity"][i]) for i in (0, -1))
    if "EXPLICIT" in step:                       # its masses are at the nodes
        start, end = (np.array([done.history[k][i] for k in ("px", "py", "pz", "lx", "ly", "lz")]) for i in (0, -1))
    np.testing.assert_allclose(end[:3], start[:3], rtol=0, atol=1e-13*np.abs(start).max())
    told = next(w for w in done.verdict["warnings"] if "ADJUST=NO" in w)
    lost = float(re.search(r"has changed by ([-+.\dE]+),", told)[1])
    # Three digits are printed.
    assert lost == pytest.approx(np.linalg.norm(end[3:] - start[3:]), rel=5e-3)
    assert lost > 1e-3*np.linalg.norm(start[3:])
    assert np.ptp(done.history["total"]) < part*done.history["total"][0]


def test_no_gap_loses_nothing(tmp_path: Path) -> None:
    """Surfaces that meet exactly have no couple to tell, adjusted or not."""
    blocks = [box("C3D8", (2,)*3, (0, 0, 0), (1, 1, .5)), box("C3D8", (3,)*3, (0, 0, .5), (1, 1, 1))]
    text, x = tied(blocks, [(1, 0, 2)], RUBBER, ", ADJUST=NO")
    check_flight(run(text + flight(x, steps=6), tmp_path), blocks)
