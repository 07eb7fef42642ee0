"""Linear sections in three dimensions: their statics, frequencies, balances, and what is refused."""

import math

import numpy as np
import pytest
from scene_tools import emcon, run_deck
from space_mesh import KINDS, Block

EPS = np.finfo(float).eps
LAWS = {"linear": ("*ELASTIC\n1000., 0.3\n", 1000/2.6, 1000/1.2),
        "rubber": ("*HYPERELASTIC, NEO HOOKE\n50., 0.002\n", 100, 1000),
        "ogden": ("*HYPERELASTIC, OGDEN, N=2\n40., 2., 10., -2., 0.01, 0.\n", 50, 200)}
GRADIENT = 1e-3*np.array([[2.0, 1.0, -0.5], [0.5, -3.0, 0.7], [0.3, -1.2, 1.5]])


def linear(mesh, law, after):
    return mesh.deck(law, after).replace("ELSET=ALL, MATERIAL", "ELSET=ALL, KINEMATICS=LINEAR, MATERIAL")


def run(text, folder):
    folder.mkdir(exist_ok=True)
    (folder/"deck.inp").write_text(text)
    return run_deck(folder/"deck.inp", folder)


def rows_of(nodes, values):
    return "".join(f"{n}, {a + 1}, {a + 1}, {float(u)!r}\n" for n in nodes
                   for a, u in enumerate(values[n - 1]))


def speeds(v):
    return "*INITIAL CONDITIONS, TYPE=VELOCITY\n" + "".join(
        f"{k}, {a + 1}, {float(w)!r}\n" for k, row in enumerate(v, 1) for a, w in enumerate(row))


@pytest.mark.each_value
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("law", LAWS)
def test_a_patch_has_the_stress_of_the_law_at_rest(law, kind, tmp_path):
    """Small strains under NLGEOM, of any law."""
    card, mu, bulk = LAWS[law]
    mesh = Block(kind, (2, 2, 2), (2, 2, 2), shake=0.08)
    outer = np.flatnonzero(~mesh.inner) + 1
    result = run(linear(mesh, card, "*STEP, NLGEOM\n*STATIC\n1., 1.\n*BOUNDARY\n"
                        + rows_of(outer, mesh.x @ GRADIENT.T) + "*NODE FILE\nU\n*EL FILE\nS\n*END STEP\n"),
                 tmp_path)
    fields = result.fields()
    strain = (GRADIENT + GRADIENT.T)/2
    wanted = (bulk - 2*mu/3)*np.trace(strain)*np.eye(3) + 2*mu*strain
    assert np.abs(fields["displacement"][-1] - mesh.x @ GRADIENT.T).max() <= 1e-12*4e-3
    assert np.abs(fields["cauchy_stress"][-1] - wanted[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]).max() \
        <= 1e-12*bulk
    assert result.history["strain"][-1] == pytest.approx(0.5*(wanted*strain).sum()*8, rel=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_statics_are_those_of_a_linear_analysis(kind, tmp_path):
    mesh = Block(kind, (4, 2, 2), (4, 1, 1), shake=0.05)
    held = "".join(f"{n}, 1, 3\n" for n in mesh.on(0, 0))
    pull = "".join(f"{n}, {a}, {f}\n" for n in mesh.on(0, 1) for a, f in ((2, 1.0), (3, -0.6)))
    after = "*STEP{}\n*STATIC\n1., 1.\n*BOUNDARY\n" + held + "*CLOAD\n" + pull \
        + "*NODE FILE\nU\n*EL FILE\nS\n*END STEP\n"
    law = LAWS["linear"][0]
    one = run(linear(mesh, law, after.format(", NLGEOM")), tmp_path/"one")
    other = run(mesh.deck(law, after.format("")), tmp_path/"other")
    for name in ("displacement", "cauchy_stress"):
        a, b = (result.fields()[name][-1] for result in (one, other))
        assert np.abs(a - b).max() <= 1e-9*np.abs(b).max()
    assert one.verdict["linear_rotation"] > 0.05
    assert any("ALL is linear, but" in text for text in one.verdict["warnings"])


def test_a_bar_swings_with_its_frequency(tmp_path):
    """Along its axis, held across: elements of one dimension and length d with mass m between them have
    w^2 = 6 M/(rho d^2) (1 - cos(p d))/(2 + cos(p d)) for sin(p x), and steps tan(w' h/2) = w h/2."""
    n, length, modulus, density, h = 6, 3.0, 900.0, 0.5, 0.01
    mesh = Block("C3D8", (n, 1, 1), (length, 1, 1))
    mu, bulk = LAWS["linear"][1:]
    modulus = bulk + 4*mu/3
    p, d = math.pi/(2*length), length/n
    square = 6*modulus/(density*d*d)*(1 - math.cos(p*d))/(2 + math.cos(p*d))
    shape = np.sin(p*mesh.x[:, 0])
    v = np.column_stack([0.1*shape, 0*shape, 0*shape])
    held = "".join(f"{k}, 2, 3\n" for k in range(1, len(v) + 1)) + "".join(
        f"{k}, 1\n" for k in mesh.on(0, 0))
    result = run(linear(mesh, LAWS["linear"][0], speeds(v) + "*STEP, NLGEOM, INC=200\n*DYNAMIC, DIRECT\n"
                        f"{h}, {100*h}\n*BOUNDARY\n{held}*NODE FILE\nU\n*END STEP\n"), tmp_path)
    u = result.fields()["displacement"]
    turn = 2*math.atan(math.sqrt(square)*h/2)
    wanted = 0.1/math.sqrt(square)*np.sin(turn*np.arange(len(u)))
    assert len(u) == 101
    assert np.abs(u[:, :, 0] - wanted[:, None]*shape).max() <= 1e-11*wanted.max()
    history = result.history
    assert np.abs(history["total"] - history["total"][0]).max() <= 1e-12*history["total"][0]


@pytest.mark.parametrize("kind", KINDS)
def test_a_body_in_fast_flight_vibrates(kind, tmp_path):
    """Momentum and energy, ten lengths far; rounding is that of the energy of flight."""
    mesh = Block(kind, (4, 1, 1), (4, 1, 1))
    x, y, z = (mesh.x - [2, 0.5, 0.5]).T
    v = np.column_stack([30 + 0.1*x*y, 20 + 0.2*np.cos(np.pi*x), -10 + 0.1*x*z])
    history = run(linear(mesh, LAWS["linear"][0], speeds(v) + "*STEP, NLGEOM, INC=200\n"
                         "*DYNAMIC, DIRECT\n0.01, 1.\n*NODE FILE, FREQUENCY=100\nU\n*END STEP\n"),
                  tmp_path).history
    inner = history["total"] - (history["px"]**2 + history["py"]**2 + history["pz"]**2)/4
    assert history["strain"].max() > 0.1*inner[0] > 0
    for name in ("px", "py", "pz"):
        assert np.abs(history[name] - history[name][0]).max() <= 1e-13*abs(history["px"][0])
    assert np.abs(inner - inner[0]).max() <= 100*EPS*history["total"][0]


def test_beside_large_strains(tmp_path):
    """A stiff linear end of a soft block that is bent far: energy and linear momentum."""
    mesh = Block("C3D8", (6, 1, 1), (6, 1, 1))
    stiff = [k for k, cell in enumerate(mesh.cell_list, 1) if cell[0] < 2]
    soft = [k for k, cell in enumerate(mesh.cell_list, 1) if cell[0] >= 2]
    x, y, z = (mesh.x - [3, 0.5, 0.5]).T
    v = np.column_stack([0*x, 0.6*np.maximum(x + 1, 0)**2, -0.3*np.maximum(x + 1, 0)**2])
    sets = "".join(f"*ELSET, ELSET={name}\n" + "".join(f"{k}\n" for k in part)
                   for name, part in (("STIFF", stiff), ("SOFT", soft)))
    text = mesh.deck("*HYPERELASTIC, NEO HOOKE\n20., 0.01\n", speeds(v)
                     + "*STEP, NLGEOM, INC=2000\n*DYNAMIC, DIRECT\n0.01, 2.\n*BOUNDARY\n"
                     + "".join(f"{n}, 1, 3\n" for n in mesh.on(0, 0))
                     + "*NODE FILE, FREQUENCY=200\nU\n*END STEP\n")
    text = text.replace("*SOLID SECTION, ELSET=ALL, MATERIAL=M\n",
                        sets + "*MATERIAL, NAME=S\n*ELASTIC\n2e4, 0.3\n*DENSITY\n0.5\n"
                        "*SOLID SECTION, ELSET=SOFT, MATERIAL=M\n"
                        "*SOLID SECTION, ELSET=STIFF, MATERIAL=S, KINEMATICS=LINEAR\n")
    result = run(text, tmp_path)
    history = result.history
    assert np.abs(history["total"] - history["total"][0]).max() <= 1e-12*history["total"][0]
    assert history["strain"].max() > 0.3*history["total"][0]
    assert np.abs(result.fields()["displacement"][-1]).max() > 0.5
    assert result.verdict["linear_rotation"] < 0.05


@pytest.mark.parametrize("axis", [0, 2])
def test_a_linear_body_must_not_spin(axis, tmp_path):
    """About its long axis as about another: 0.2 rad within the step are refused, 0.05 not."""
    mesh = Block("C3D8", (8, 1, 1), (8, 1, 1))
    omega = np.eye(3)[axis]
    for turned, is_refused in ((0.2, True), (0.05, False)):
        v = np.cross(turned*omega, mesh.x - [4, 0.5, 0.5])
        (tmp_path/"deck.inp").write_text(linear(mesh, LAWS["linear"][0], speeds(v)
            + "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n0.5, 1.\n*NODE FILE\nU\n*END STEP\n"))
        done = emcon("check", tmp_path/"deck.inp")
        assert (done.returncode == 2) == is_refused
        assert (f"by {turned} rad" in done.stderr + done.stdout) == is_refused
