"""What snaps through under *STATIC, STABILIZE: arches, with a mode jump on the way, and a hook."""

import math

import numpy as np
import pytest
from scene_tools import Deck, number, run_deck

SPAN, THICK, YOUNG = 100.0, 1.0, 1000.0
CELLS = 40
WAVE = math.pi/SPAN
#: Load per length of a sine arch of rise 1 and no stiffness along it.
STIFF = YOUNG*THICK**3/12*WAVE**4


def arch_load(rise, height):
    """The load, a sine downwards, under which an arch, a sine of so much rise, has the height `height`.

    Bending resists by EI k^4 (rise - height), the thrust EA k^2/4 (rise^2 - height^2) takes
    k^2 height times itself off: exact for slopes whose squares are small, of all that stay a sine.
    """
    return STIFF*((rise - height) + 3*height*(rise**2 - height**2)/THICK**2)


def arch_potential(rise, height, load):
    """Half the span times what is stored, and what the load has given, per length at the middle."""
    stored = 0.5*STIFF*(rise - height)**2 + 0.75*STIFF/THICK**2*(rise**2 - height**2)**2
    return 0.5*SPAN*(stored - load*(rise - height))


def arch(rise, load, option, twist=0.0, way=None, h="0.05, 1."):
    """Two elements across, pinned in the middle of its ends, without Poisson's ratio; `twist` of the
    rise is a second half wave. With `way` the middle of the arch is moved down by that instead."""
    nodes, across = [], 3
    for i in range(CELLS + 1):
        x = SPAN*i/CELLS
        y = rise*(math.sin(WAVE*x) + twist*math.sin(2*WAVE*x))
        for j in range(across):
            nodes.append(f"{1 + across*i + j}, {x!r}, {y + THICK*(j/(across - 1) - 0.5)!r}")
    elements = [f"{2*i + j + 1}, {a}, {a + across}, {a + across + 1}, {a + 1}"
                for i in range(CELLS) for j in range(2) for a in [1 + across*i + j]]
    loads = [f"{2 + across*i}, 2, {number(-load*SPAN/CELLS*math.sin(math.pi*i/CELLS))}"
             for i in range(1, CELLS)]
    middle = 2 + across*(CELLS//2)
    end = 2 + across*CELLS
    moved = ["*CLOAD", *loads] if way is None else ["*BOUNDARY", f"{middle}, 2, 2, {number(-way)}"]
    return Deck("\n".join([
        "*NODE", *nodes, "*ELEMENT, TYPE=CPS4I, ELSET=A", *elements, "*MATERIAL, NAME=M", "*ELASTIC",
        f"{YOUNG!r}, 0.", "*SOLID SECTION, ELSET=A, MATERIAL=M", "1.", "*BOUNDARY", "2, 1, 2",
        f"{end}, 1, 2", "*NSET, NSET=MIDDLE", f"{middle}", "*STEP, NLGEOM, INC=10000",
        "*STATIC" + option, h, *moved, "*NODE PRINT, NSET=MIDDLE, FREQUENCY=1", "U, RF", "*END STEP", ""]), "arch")


def critical(rise, jumps):
    """Height and load at which an arch is no longer stable: the most that it bears, or where its
    thrust is that under which a strut of the same span buckles in two half waves, 4 EI k^2."""
    square = rise**2 - 4*THICK**2/3 if jumps else (3*rise**2 - THICK**2)/9
    height = math.sqrt(square)
    return height, arch_load(rise, height)


def below(rise, load):
    """The height on the other side at which the arch bears `load`."""
    roots = np.roots([-3/THICK**2, 0.0, 3*rise**2/THICK**2 - 1, rise - load/STIFF])
    return roots[abs(roots.imag) < 1e-9].real.min()


#: Rise, a second half wave by it, and whether it buckles in that before it bears the most.
ARCHES = [(1.0, 0.0, False), (2.5, 1e-3, True), (2.5, 0.0, True)]


@pytest.mark.parametrize(("rise", "twist", "jumps"), ARCHES)
def test_arch_snaps_through(rise, twist, jumps, tmp_path):
    """To the other side, as shallow arches do; a high one by two half waves on its way, also where
    nothing but round-off leads there. What is set free is what viscous forces take: they take it at
    the end of an increment of 1/20, and where all is slow no more than the part of the deck."""
    high, load = critical(rise, jumps)
    at = 1/1.5 if not jumps else 1/4.0
    run = run_deck(arch(rise, load/at, ", STABILIZE", twist), tmp_path)
    _, moved = run.series("MIDDLE", "U")
    down = below(rise, load/at) - rise
    # Squares of slopes are left out of the closed form.
    assert moved.reshape(len(moved), -1)[-1, 1] == pytest.approx(down, rel=(rise*WAVE)**2)
    time, loss = run.history["time"], run.history["damping_loss"]
    assert run.verdict["verdict"] == "good" and not run.verdict["warnings"]
    assert (np.diff(loss) >= 0.0).all()
    slow = (time < at - 0.05) | (time > at + 0.1)
    assert np.diff(loss)[slow[1:] & slow[:-1]].max() < 2e-4*run.history["strain"].max()
    free = arch_potential(rise, high, load) - arch_potential(rise, below(rise, load), load)
    # The load at which it goes is found to an increment: what it sets free is steep in that.
    assert loss[-1] == pytest.approx(free, rel=0.15)
    assert run.verdict["damping_loss"] == pytest.approx(loss[-1], rel=1e-8)


def test_arch_stops_without_stabilize(tmp_path):
    """At the load that it bears; the message says what follows, and what to do."""
    _, load = critical(1.0, jumps=False)
    run = run_deck(arch(1.0, 1.5*load, ""), tmp_path, code=3)
    assert run.verdict["time"] == pytest.approx(1/1.5, rel=0.02)
    for word in ("the analysis stops at time 0.6", "may snap through", "*STATIC, STABILIZE", "*DYNAMIC"):
        assert word in run.errors


def pressed_strut(option, way):
    """A strut of 20 by 1, held below; a rigid plate without friction on its flat top comes down."""
    n = 20
    nodes = [f"{1 + 2*i + j}, {j - 0.5}, {float(i)}" for i in range(n + 1) for j in (0, 1)]
    elements = [f"{i + 1}, {2*i + 1}, {2*i + 2}, {2*i + 4}, {2*i + 3}" for i in range(n)]
    return Deck("\n".join([
        "*NODE", *nodes, "1001, -3., 20.", "1002, 3., 20.", "1003, 3., 21.", "1004, -3., 21.",
        "*ELEMENT, TYPE=CPE4I, ELSET=STRUT", *elements, "*ELEMENT, TYPE=CPE4, ELSET=PLATE",
        "1001, 1001, 1002, 1003, 1004", "*SURFACE, NAME=TOP", f"{n}, S3", "*SURFACE, NAME=PLATE",
        "1001, S1", "*MATERIAL, NAME=M", "*HYPERELASTIC, COUPLED NEO HOOKE", "1000., 0.3",
        "*SOLID SECTION, ELSET=STRUT, MATERIAL=M", "1.", "*SOLID SECTION, ELSET=PLATE, MATERIAL=M", "1.",
        "*RIGID BODY, ELSET=PLATE, REF NODE=1003", "*SURFACE INTERACTION, NAME=I",
        "*CONTACT PAIR, INTERACTION=I, TYPE=NODE TO SURFACE", "TOP, PLATE", "*NSET, NSET=ENDS",
        f"{2*n + 1}, {2*n + 2}", "*BOUNDARY", "1, 1, 2", "2, 1, 2", "*STEP, NLGEOM, INC=10000",
        "*STATIC" + option, "0.05, 1.", "*BOUNDARY", "1003, 1", "1003, 6", f"1003, 2, 2, {-way!r}",
        "*NODE PRINT, NSET=ENDS", "U", "*END STEP", ""]), "strut")


@pytest.mark.parametrize("option", ["", ", STABILIZE"])
def test_strut_buckles_under_a_plate(option, tmp_path):
    """Its flat top slides along the plate and stays flat: clamped and guided, at the strain
    pi^2 h^2/(12 l^2). What it is shortened by more is the slope of (w/2)(1 - cos(pi y/l)), squared,
    to the square of the slope itself, and the critical strain to its square. Without STABILIZE the straight strut is a balance, too."""
    way, long = 0.06, 20.0
    run = run_deck(pressed_strut(option, way), tmp_path)
    assert run.verdict["verdict"] == "good" and not run.verdict["warnings"]
    _, moved = run.series("ENDS", "U")
    aside = np.abs(moved.reshape(len(moved), 2, -1)[-1, :, 0]).mean()
    critical = math.pi**2/(12*long)
    bent = 4/math.pi*math.sqrt((way - critical)*long)
    slope = math.pi*bent/(2*long)
    if option:
        assert aside == pytest.approx(bent, rel=slope**2 + critical**2/long/(way - critical))
    else:
        assert aside < way/long


def hook(option, way=14.0):
    """An arm of 30 by 2 with a nose of height 2 on its end, undercut behind, and a rigid
    catch that moves by `way` along the arm over the nose."""
    nodes, elements = [], []
    for i in range(16):
        nodes += [f"{1 + 3*i + j}, {2.0*i}, {float(j)}" for j in range(3)]
    for i in range(15):
        elements += [f"{2*i + j + 1}, {a}, {a + 3}, {a + 4}, {a + 1}" for j in (0, 1) for a in [1 + 3*i + j]]
    nodes += [f"{49 + i}, {22.5 + 2.5*i}, {4.0 - 2*i/3!r}" for i in range(3)]
    elements += ["31, 39, 42, 50, 49", "32, 42, 45, 51, 50"]
    nodes += ["61, 30.5, 2.4", "62, 34.5, 2.4", "63, 34.5, 6.", "64, 30.5, 6."]
    skin = [f"{2*i + 2}, S3" for i in range(12)] + ["31, S4", "31, S3", "32, S3", "33, S2", "30, S2", "29, S2"]
    return Deck("\n".join([
        "*NODE", *nodes, "*ELEMENT, TYPE=CPS4I, ELSET=ARM", *elements,
        "*ELEMENT, TYPE=CPS3, ELSET=ARM", "33, 45, 48, 51", "*ELEMENT, TYPE=CPS4, ELSET=CATCH",
        "61, 61, 62, 63, 64", "*SURFACE, NAME=SKIN", *skin, "*SURFACE, NAME=CATCH", "CATCH",
        "*MATERIAL, NAME=M", "*ELASTIC", "2700., 0.3", "*SOLID SECTION, ELSET=ARM, MATERIAL=M", "1.",
        "*SOLID SECTION, ELSET=CATCH, MATERIAL=M", "1.", "*RIGID BODY, ELSET=CATCH, REF NODE=61",
        "*SURFACE INTERACTION, NAME=I", "*CONTACT PAIR, INTERACTION=I, TYPE=NODE TO SURFACE",
        "SKIN, CATCH", "*NSET, NSET=REF", "61", "*BOUNDARY", "1, 1, 2", "2, 1, 2", "3, 1, 2",
        "*STEP, NLGEOM, INC=10000", "*STATIC" + option, "0.02, 1.", "*BOUNDARY", "61, 2", "61, 6",
        f"61, 1, 1, {-way!r}", "*NODE PRINT, NSET=REF, FREQUENCY=1", "U, RF", "*END STEP", ""]), "hook")


@pytest.mark.parametrize("option", ["", pytest.param(", STABILIZE", marks=pytest.mark.long)])
def test_hook_passes_its_catch(option, tmp_path):
    """It springs up behind the catch and is free. With STABILIZE increments are cut where contact
    lets go, so that most of what is set free goes into viscous forces, which rest before and after."""
    run = run_deck(hook(option), tmp_path)
    assert run.verdict["verdict"] == "good" and not run.verdict["warnings"]
    _, force = run.series("REF", "RF")
    strain, loss, time = (run.history[name] for name in ("strain", "damping_loss", "time"))
    assert np.abs(force.reshape(len(force), -1)[-1]).max() < 1e-12*np.abs(force).max()
    assert strain[-1] < 1e-12*strain.max()
    if not option:
        assert loss[-1] == 0.0
        return
    assert loss[time < 0.6].max() < 2e-4*strain.max()
    assert loss[-1] == loss[time > 0.9][0]
    assert loss[-1] > 0.5*strain.max() and -run.history["contact_work"][-1] < 0.5*loss[-1]
