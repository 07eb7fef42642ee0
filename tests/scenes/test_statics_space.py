"""Statics in space of bodies that contact alone holds: towers, motions that nothing holds, interference."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from contact_space_scenes import bodies, faces
from scene_tools import Run, run_deck
from space_mesh import Block

E, NU, PRESSURE = 1000.0, 0.3, 1.0
#: Newton's method ends at 1e-10 of the forces; of displacements some of that is left.
ACCURACY = 1.0e-9
GAPS = [0.0, 1e-9, 1e-3, 0.1, 5.0]
SHRINK = "*CONTACT INTERFERENCE, SHRINK\n"
STABILIZE = "*CONTACT CONTROLS, STABILIZE\n"


def ran(folder: Path, text: str, code: int = 0) -> Run:
    deck = folder/"deck.inp"
    deck.write_text(text)
    return run_deck(deck, folder, code)


def rows(first: int, x: np.ndarray) -> str:
    return "".join(f"{first + k}, {a!r}, {b!r}, {c!r}\n" for k, (a, b, c) in enumerate(x.tolist(), 1))


def tower(gaps: list[float], cells: list[int] | int = 2, kind: str = "C3D8", is_held: bool = True,  # noqa: PLR0913
          load: str = "1.", nu: float = NU, head: str = "*STEP\n*STATIC\n1., 1.\n", cards: str = "") -> tuple[str, list]:
    """Unit cubes over each other, the lowest on a support, planes of symmetry of the others held or not."""
    n = [cells]*(len(gaps) + 1) if isinstance(cells, int) else cells
    text, first, before, z, held, tops = f"*MATERIAL, NAME=M\n*ELASTIC\n{E}, {nu}\n*DENSITY\n1.\n", 0, 0, 0.0, "", []
    for k, gap in enumerate([0.0, *gaps]):
        z += gap + (k > 0)
        block = Block(kind, (n[k],)*3, place=lambda x, z=z: x + np.array([0.0, 0.0, z]))
        text += f"*NODE\n{rows(first, block.x)}*ELEMENT, TYPE={kind}, ELSET=B{k}\n"
        for e, nodes in enumerate(block.element, before + 1):
            text += ", ".join(map(str, [e, *(first + m for m in nodes)])) + "\n"
        text += f"*SOLID SECTION, ELSET=B{k}, MATERIAL=M\n"
        for name, end in (("FOOT", 0), ("HEAD", 1)):
            text += f"*SURFACE, NAME={name}{k}\n" + "".join(f"{before + e}, S{f}\n" for e, f in faces(block, 2, end))
        for axis in [a for a in range(3) if (a == 2 and k == 0) or (a < 2 and (is_held or k == 0))]:
            text += f"*NSET, NSET=E{k}{axis}\n" + "".join(f"{first + i}\n" for i in block.on(axis, 0))
            held += f"E{k}{axis}, {axis + 1}\n"
        tops.append(first + block.on(2, 1) - 1)
        first, before = first + len(block.x), before + len(block.element)
    text += "*SURFACE INTERACTION, NAME=I\n" + "".join(
        f"*CONTACT PAIR, INTERACTION=I\nFOOT{k + 1}, HEAD{k}\n" for k in range(len(gaps)))
    load = f"*DSLOAD\nHEAD{len(gaps)}, P, {load}\n" if load != "GRAV" else "*DLOAD\n" + "".join(
        f"B{k}, GRAV, 1., 0., 0., -1.\n" for k in range(len(n)))
    return f"{text}*BOUNDARY\n{held}{head}{cards}{load}*NODE FILE\nU, RF\n*END STEP\n", tops


def check_tops(run: Run, tops: list, expected: np.ndarray, size: float) -> None:
    u = run.fields()["displacement"][-1, :, 2]
    for top, exact in zip(tops, expected, strict=True):
        assert np.abs(u[top] - exact).max() <= ACCURACY*size


@pytest.mark.each_value
@pytest.mark.parametrize("gap", GAPS)
@pytest.mark.parametrize(("kind", "cells"), [("C3D8", 2), ("C3D4", 2), ("C3D8", [1, 1]), ("C3D8", [2, 3]),
                                             ("C3D8", [3, 2])])
def test_cube_on_a_cube(kind: str, cells: list[int] | int, gap: float, tmp_path: Path) -> None:
    """Uniform pressure: each cube of height 1 shortens by p/E, the upper one falls by the gap first."""
    text, tops = tower([gap], cells, kind)
    check_tops(ran(tmp_path, text), tops, np.array([-1.0, -2.0])/E - [0.0, gap], 2.0/E)


@pytest.mark.parametrize("overlap", [1e-9, 1e-5, 1e-3, 0.02])
@pytest.mark.parametrize("kind", ["C3D8", "C3D4"])
def test_cubes_that_overlap(kind: str, overlap: float, tmp_path: Path) -> None:
    """`SHRINK` pushes the upper one out as far."""
    text, tops = tower([-overlap], kind=kind, cards=SHRINK)
    check_tops(ran(tmp_path, text), tops, np.array([-1.0, -2.0])/E + [0.0, overlap], 2.0/E + overlap)


@pytest.mark.parametrize(("load", "nu"), [("1.", NU), ("GRAV", 0.0)])
@pytest.mark.parametrize("head", ["*STEP\n*STATIC\n1., 1.\n", "*STEP\n*STATIC\n.1, 1., 1e-4, .5\n"])
def test_tower_of_five(head: str, load: str, nu: float, tmp_path: Path) -> None:
    """Pressed, or by its weight without Poisson's ratio: cube k shortens by the weight above it and half of its own."""
    gaps = [0.05, 0.0, 0.2, 0.1]
    text, tops = tower(gaps, load=load, nu=nu, head=head)
    shorter = np.ones(5) if load == "1." else 4.5 - np.arange(5)
    check_tops(ran(tmp_path, text), tops, -np.cumsum(shorter)/E - np.cumsum([0.0, *gaps]), shorter.sum()/E)


def test_quadratic_tetrahedra(tmp_path: Path) -> None:
    """Corners would have to pull by a little: the pressure is uniform to a part in a hundred."""
    text, tops = tower([0.1], 1, "C3D10")
    u = ran(tmp_path, text).fields()["displacement"][-1, :, 2]
    assert u[tops[1]].mean() + 0.1 == pytest.approx(-2.0/E, rel=0.01)


@pytest.mark.parametrize("gap", GAPS[:4])
def test_motions_that_nothing_holds_are_named(gap: float, tmp_path: Path) -> None:
    """Sideways, and about the normal; `STABILIZE` takes the smallest one."""
    text, tops = tower([gap], is_held=False)
    run = ran(tmp_path, text, code=3)
    assert "body of element 9 is free to move in x, move in y, rotate about z" in run.errors
    folder = tmp_path/"stabilized"
    folder.mkdir()
    run = ran(folder, tower([gap], is_held=False, cards=STABILIZE)[0])
    assert "body of element 9 is free to move in x" in run.errors
    u = run.fields()["displacement"][-1, :, 2]
    assert u[tops[1]].mean() == pytest.approx(-gap - 2.0/E, abs=1.0e-6/E)


def test_what_is_pulled_off_is_named(tmp_path: Path) -> None:
    run = ran(tmp_path, tower([0.1], load="-1.")[0], code=3)
    assert "body of element 9 is free to move in z;" in run.errors


def shells(n: tuple[int, int], interference: float, kind: str = "C3D8") -> str:
    """Quarters of two tubes of radii 1, 2 + interference and 2, 3, with so many elements around."""
    text, held, first, before = f"*MATERIAL, NAME=M\n*ELASTIC\n{E}, {NU}\n", "", 0, 0
    for k, (inner, outer) in enumerate([(1.0, 2.0 + interference), (2.0, 3.0)]):
        def bend(x: np.ndarray, inner: float = inner, outer: float = outer) -> np.ndarray:
            r, turn = inner + (outer - inner)*x[:, 0], 0.5*np.pi*x[:, 1]
            return np.stack([np.where(x[:, 1] == 1.0, 0.0, r*np.cos(turn)), r*np.sin(turn), 0.5*x[:, 2]], axis=1)

        block = Block(kind, (n[k]//2, n[k], 1), place=bend)
        text += f"*NODE\n{rows(first, block.x)}*ELEMENT, TYPE={kind}, ELSET=B{k}\n"
        for e, nodes in enumerate(block.element, before + 1):
            words = [str(w) for w in (e, *(first + m for m in nodes))]
            text += ", ".join(words[:12]) + (",\n" + ", ".join(words[12:]) if len(words) > 12 else "") + "\n"
        text += f"*SOLID SECTION, ELSET=B{k}, MATERIAL=M\n*SURFACE, NAME=F{k}\n"
        text += "".join(f"{before + e}, S{f}\n" for e, f in faces(block, 0, 1 - k))
        for axis, ends in enumerate([[block.on(1, 1)], [block.on(1, 0)], [block.on(2, 0), block.on(2, 1)]]):
            text += f"*NSET, NSET=E{k}{axis}\n" + "".join(f"{first + i}\n" for i in np.concatenate(ends))
            held += f"E{k}{axis}, {axis + 1}\n"
        first, before = first + len(block.x), before + len(block.element)
    return (f"{text}*SURFACE INTERACTION, NAME=I\n*CONTACT PAIR, INTERACTION=I\nF1, F0\n*BOUNDARY\n{held}"
            f"*STEP\n*STATIC\n1., 1.\n{SHRINK}*NODE FILE\nU\n*END STEP\n")


def bore(run: Run) -> float:
    fields = run.fields()
    r = np.hypot(fields.x[:, 0], fields.x[:, 1])
    on = np.abs(r - 1.0) < 1e-9
    return float(((fields["displacement"][-1]*fields.x)[:, :2].sum(1)/r)[on].mean())


def lame(interference: float) -> float:
    """Displacement of the bore, radii 1, 2 and 3 and one material, in plane strain."""
    stiffness = E/(1.0 - NU**2)
    pressure = stiffness*interference/2.0*(4 - 1)*(9 - 4)/(2*4*(9 - 1))
    return -2.0*pressure*4.0/(stiffness*(4 - 1))


@pytest.mark.parametrize("interference", [1e-5, 1e-4, 1e-2])
def test_press_fit(interference: float, tmp_path: Path) -> None:
    """Tubes whose nodes meet, pressed into each other, against Lame: better as meshes get finer, at any interference,
    as what faces are off the tubes is left out of gaps."""
    off = []
    for n in (2, 8):
        folder = tmp_path/str(n)
        folder.mkdir()
        run = ran(folder, shells((n, n), interference))
        assert run.verdict["verdict"] == "good"
        off.append(abs(bore(run)/lame(interference) - 1.0))
    assert off[1] < 0.02
    assert off[1] < 0.5*off[0]


@pytest.mark.parametrize("n", [(8, 11), (11, 8)])
def test_press_fit_of_unlike_meshes(n: tuple[int, int], tmp_path: Path) -> None:
    """Faces are off the tubes by ten times the interference."""
    run = ran(tmp_path, shells(n, 1e-3))
    assert run.verdict["verdict"] == "good"
    assert bore(run) == pytest.approx(lame(1e-3), rel=0.06)
    assert "F1 and F0: gaps are measured between the curves" in run.log


@pytest.mark.parametrize("options", ["", ", TYPE=MORTAR"])
@pytest.mark.parametrize("kind", ["C3D10", "C3D20"])
def test_press_fit_of_quadratic_elements(kind: str, options: str, tmp_path: Path) -> None:
    """Middles of faces, which contact holds beside their nodes, are off the tubes themselves."""
    run = ran(tmp_path, shells((8, 11), 1e-3, kind).replace("INTERACTION=I\nF1", f"INTERACTION=I{options}\nF1"))
    assert run.verdict["verdict"] == "good"
    assert bore(run) == pytest.approx(lame(1e-3), rel=0.01)


@pytest.mark.parametrize("options", ["", ", TYPE=MORTAR"])
def test_press_fit_of_coarse_meshes(options: str, tmp_path: Path) -> None:
    """Faces turn by 22.5 degrees: their sides are no edges. They are off the tubes by forty times the interference, of
    which the meshes tell too little: the run says so."""
    run = ran(tmp_path, shells((4, 5), 1e-3).replace("INTERACTION=I\nF1", f"INTERACTION=I{options}\nF1"))
    assert run.verdict["verdict"] == "good"
    assert bore(run) == pytest.approx(lame(1e-3), rel=0.4)
    assert "small compared with the distance of faces from the curves" in run.errors


@pytest.mark.parametrize(("method", "accuracy"), [("SADDLE POINT", ACCURACY), ("AUGMENTED LAGRANGE", 1.0e-3)])
def test_other_ways_to_hold(method: str, accuracy: float, tmp_path: Path) -> None:
    """A tower over gaps; an augmented Lagrangian lets in up to its tolerance."""
    text, tops = tower([0.1, 0.0], [2, 3, 2], cards=f"*CONSTRAINT METHOD, TYPE={method}\n")
    u = ran(tmp_path, text).fields()["displacement"][-1, :, 2]
    for top, exact in zip(tops, -np.arange(1.0, 4.0)/E - [0.0, 0.1, 0.1], strict=True):
        assert np.abs(u[top] - exact).max() <= accuracy*3.0/E


@pytest.mark.parametrize("k", [0, 1])
def test_nodes_that_the_deck_moves(k: int, tmp_path: Path) -> None:
    """All nodes of a cube, as the slave or the master, go .03 into where the other one stands: that shortens by it."""
    text, tops = tower([0.01], load="0.")
    moved = [first + (0 if k == 0 else 27) for first in range(1, 28)]
    way = 0.04 if k == 0 else -0.04
    rest = tops[1 - k] + 1 if k == 0 else range(1, 1)
    text = text.replace("E00, 1\n", "").replace("E01, 2\n", "").replace("E02, 3\n", "") if k == 0 else text
    text = text.replace("E10, 1\n", "").replace("E11, 2\n", "") if k == 1 else text
    cards = "*BOUNDARY\n" + "".join(f"{n}, {a}, {a}, {way if a == 3 else 0.0!r}\n" for n in moved for a in (1, 2, 3))
    cards += "".join(f"{n}, 3, 3, 0.\n" for n in rest)
    run = ran(tmp_path, text.replace("*DSLOAD", cards + "*DSLOAD"))
    assert run.verdict["verdict"] == "good"
    force = abs(run.history["pair1_force_z"][-1])
    fields = run.fields()
    z = fields.x[:, 2] + fields["displacement"][-1, :, 2]
    foot, head = fields.x[:, 2] == 1.01, fields.x[:, 2] == 1.0
    assert z[foot] == pytest.approx(z[head].mean(), abs=1.0e-9)
    # Sides are free: the stress is E times the strain.
    assert force == pytest.approx(E*0.03, rel=1.0e-6)


def test_what_an_amplitude_drives_has_no_kinetic_energy(tmp_path: Path) -> None:
    """A static step has no velocities, of driven nodes neither: they may move at any speed."""
    block = Block("C3D8", (1, 1, 2))
    text = (bodies([block], [faces(block)], f"*ELASTIC\n{E}, {NU}\n*DENSITY\n1.\n")
            + "*NSET, NSET=FOOT\n" + "".join(f"{k}\n" for k in block.on(2, 0))
            + "*NSET, NSET=HEAD\n" + "".join(f"{k}\n" for k in block.on(2, 1))
            + "*AMPLITUDE, NAME=A\n0., 0., 1., .1\n*BOUNDARY\nFOOT, 1, 3\n*STEP\n*STATIC\n.25, 1.\n"
            + "*BOUNDARY, AMPLITUDE=A\nHEAD, 3, 3, 1.\n*NODE FILE\nV\n*END STEP\n")
    run = ran(tmp_path, text)
    assert run.history["strain"][-1] > 0.0
    assert (run.history["kinetic"] == 0.0).all()
    assert np.abs(run.fields()["velocity"]).max() == 0.0
