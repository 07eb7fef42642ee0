"""Laws in three dimensions in whole runs: Ogden's by its stretches, and beside CalculiX."""

import shutil
import sys

import numpy as np
import pytest
from scipy.optimize import brentq
from scene_tools import ROOT, run_deck
from space_mesh import Block
from test_space import flies

sys.path.insert(0, str(ROOT/"tests"/"bench"))

from peers import calculix_suite  # noqa: E402

#: mu, alpha and D of three terms.
MU, ALPHA, D = np.array([15.0, 2.5, 2.5]), np.array([1.3, 4.0, -2.0]), np.array([0.05, 0.5, 2.0])
OGDEN = ("*HYPERELASTIC, OGDEN, N=3\n" + ", ".join(f"{m}, {a}" for m, a in zip(MU, ALPHA, strict=True))
         + ", 0.05, 0.5\n2.\n")
#: That of exponent 2, and what it is.
TWO, NEO_HOOKE = "*HYPERELASTIC, OGDEN\n40., 2., 0.01\n", "*HYPERELASTIC, NEO HOOKE\n20., 0.01\n"


def run(text, folder):
    folder.mkdir(exist_ok=True)
    (folder/"deck.inp").write_text(text)
    return run_deck(folder/"deck.inp", folder)


@pytest.mark.parametrize("kind", ["C3D8", "C3D8I", *(
    pytest.param(kind, marks=pytest.mark.long) for kind in ("C3D8H", "C3D10", "C3D20R"))])
def test_free_flight(kind, tmp_path):
    flies(kind, OGDEN, tmp_path)


def cauchy(stretch):
    """Principal Cauchy stresses: by each log of a stretch the derivative of W, by the volume."""
    j = np.prod(stretch)
    power = (stretch/j**(1/3))[:, None]**ALPHA
    i = np.arange(1, 4)
    pressure = np.sum(2*i*(j - 1)**(2*i - 1)/D)
    return np.sum(2*MU/ALPHA*(power - power.mean(axis=0)), axis=1)/j + pressure


def stretched(kind, axes, to):
    """A cube whose axes are stretched, the others free; its three faces at 0 stay in their planes."""
    mesh = Block(kind, (2, 2, 2), (1, 1, 1), shake=0.08)
    rows = "".join(f"{n}, {a + 1}\n" for a in range(3) for n in mesh.on(a, 0))
    rows += "".join(f"{n}, {a + 1}, {a + 1}, {to - 1}\n" for a in axes for n in mesh.on(a, 1))
    return mesh, mesh.deck(OGDEN, "*STEP, NLGEOM\n*STATIC\n0.25, 1.\n*BOUNDARY\n" + rows
                           + "*NODE FILE\nU\n*EL FILE\nS\n*END STEP\n")


@pytest.mark.each_value
@pytest.mark.parametrize("kind", ["C3D8", "C3D8H", "C3D8I", "C3D10", "C3D20"])
@pytest.mark.parametrize("axes", [(2,), (0, 1)])
def test_uniaxial_and_biaxial(axes, kind, tmp_path):
    """Stretched by 1.6, and the other way pressed to 0.7: stress and the free stretch in closed form."""
    for to in (1.6, 0.7):
        mesh, text = stretched(kind, axes, to)
        fields = run(text, tmp_path/str(to)).fields()
        place = mesh.x + fields["displacement"][-1]

        def all_of(free, to=to):
            return np.array([to if a in axes else free for a in range(3)])

        off = next(a for a in range(3) if a not in axes)
        free = brentq(lambda free: cauchy(all_of(free))[off], 0.4, 2.0, xtol=1e-14)
        assert np.abs(place - mesh.x*all_of(free)).max() <= 1e-10
        wanted = cauchy(all_of(free))
        stress = fields["cauchy_stress"][-1]
        scale = np.abs(wanted).max()
        assert np.abs(stress[:, :3] - wanted).max() <= 1e-9*scale
        assert np.abs(stress[:, 3:]).max() <= 1e-9*scale


def test_around_an_axis(tmp_path):
    """The same of a cylinder that is stretched along its axis."""
    text = ("*NODE, NSET=ALL\n1, 0., 0.\n2, 1., 0.\n3, 1., 1.\n4, 0., 1.\n"
            "*ELEMENT, TYPE=CAX4, ELSET=E\n1, 1, 2, 3, 4\n*MATERIAL, NAME=M\n" + OGDEN
            + "*DENSITY\n1.\n*SOLID SECTION, ELSET=E, MATERIAL=M\n*STEP, NLGEOM\n*STATIC\n0.25, 1.\n"
            "*BOUNDARY\n1, 1\n4, 1\n1, 2\n2, 2\n3, 2, 2, 0.6\n4, 2, 2, 0.6\n"
            "*NODE FILE\nU\n*EL FILE\nS\n*END STEP\n")
    fields = run(text, tmp_path).fields()
    free = brentq(lambda free: cauchy(np.array([free, free, 1.6]))[0], 0.4, 2.0, xtol=1e-14)
    assert fields["displacement"][-1][1, 0] == pytest.approx(free - 1, rel=1e-10)
    assert fields["cauchy_stress"][-1][0, 1] == pytest.approx(cauchy(np.array([free, free, 1.6]))[2],
                                                              rel=1e-9)


@pytest.mark.parametrize("kind", ["C3D8", "C3D8H", "C3D10"])
def test_exponent_two_is_neo_hooke(kind, tmp_path):
    """Sheared and twisted at rest, where the discrete gradients of both are the gradient."""
    mesh = Block(kind, (3, 2, 2), (3, 1, 1))
    angle = 0.8
    rows = "".join(f"{n}, 1, 3\n" for n in mesh.on(0, 0))
    for n in mesh.on(0, 1):
        _, y, z = mesh.x[n - 1] - [0, 0.5, 0.5]
        way = [0.3, np.cos(angle)*y - np.sin(angle)*z - y, np.sin(angle)*y + np.cos(angle)*z - z]
        rows += "".join(f"{n}, {a + 1}, {a + 1}, {float(u)!r}\n" for a, u in enumerate(way))
    after = "*STEP, NLGEOM\n*STATIC\n0.25, 1.\n*BOUNDARY\n" + rows + "*NODE FILE\nU\n*END STEP\n"
    one, other = (run(mesh.deck(law, after), tmp_path/str(i)).fields()["displacement"][-1]
                  for i, law in enumerate([TWO, NEO_HOOKE]))
    assert np.abs(one - other).max() <= 1e-11*np.abs(other).max()


@pytest.mark.skipif(not shutil.which("ccx"), reason="CalculiX is not installed")
@pytest.mark.parametrize("order", [1, 2, 3])
def test_beside_calculix(order, tmp_path):
    """A bar bent and pulled at its end: displacements to what the other code prints, 7 digits."""
    law = (f"*HYPERELASTIC, OGDEN, N={order}\n" + ", ".join(
        [f"{m}, {a}" for m, a in zip(MU[:order], ALPHA[:order], strict=True)]
        + [str(d) for d in D[:order]][:8 - 2*order])
        + ("\n2.\n" if order == 3 else "\n"))
    mesh = Block("C3D20", (4, 1, 1), (4, 1, 1))
    rows = "".join(f"{n}, 1, 3\n" for n in mesh.on(0, 0))
    rows += "".join(f"{n}, {a}, {a}, {u}\n" for n in mesh.on(0, 1)
                    for a, u in ((1, 0.5), (2, 1.2), (3, -0.6)))
    after = ("*STEP, NLGEOM, INC=1000\n*STATIC, DIRECT\n0.25, 1.\n{controls}*BOUNDARY\n" + rows
             + "{output}*END STEP\n")
    ours = run(mesh.deck(law, after.format(controls="", output="*NODE FILE\nU\n")),
               tmp_path/"ours").fields()["displacement"][-1]
    (tmp_path/"theirs.inp").write_text(mesh.deck(law, after.format(
        controls="*CONTROLS, PARAMETERS=FIELD\n1e-9, 1e-9\n",
        output="*NODE PRINT, NSET=NALL, FREQUENCY=4\nU\n")))
    told, digit = calculix_suite.run(shutil.which("ccx"), tmp_path/"theirs.inp")
    theirs = np.array([u for _, u in sorted(told[max(told)].items())])
    assert np.abs(ours - theirs).max() <= digit*np.abs(theirs).max()
