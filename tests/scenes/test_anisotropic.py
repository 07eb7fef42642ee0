"""*ELASTIC, TYPE=ORTHO, ANISO and ENGINEERING CONSTANTS, with *ORIENTATION, in three dimensions."""

import numpy as np
import pytest
from scene_tools import emcon
from space_mesh import KINDS, Block
from test_space import GRADIENT, flies, run, skew

PLAIN = [k for k in KINDS if not k.endswith("H")]
#: C of components 11, 22, 33, 12, 13, 23, as decks have it.
ORTHO = np.diag([50.0, 40.0, 30.0, 12.6, 10.0, 8.0])
ORTHO[0, 1] = ORTHO[1, 0] = ORTHO[0, 2] = ORTHO[2, 0] = ORTHO[1, 2] = ORTHO[2, 1] = 15.7
ANISO = ORTHO + 2.0*np.sin(np.add.outer(np.arange(6), np.arange(6)))
PAIR = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]


def lines(values):
    text = [f"{float(v)!r}" for v in values]
    return "".join(", ".join(text[i:i + 8]) + "\n" for i in range(0, len(text), 8))


def ortho(c):
    return "*ELASTIC, TYPE=ORTHO\n" + lines([*(c[i, k] for k in range(3) for i in range(k + 1)),
                                            *np.diag(c)[3:]])


def aniso(c):
    return "*ELASTIC, TYPE=ANISOTROPIC\n" + lines(c[i, k] for k in range(6) for i in range(k + 1))


def stress(c, strain):
    """Components xx, yy, zz, xy, yz, xz."""
    s = c @ [strain[p]*(1 if p[0] == p[1] else 2) for p in PAIR]
    return s[[0, 1, 2, 3, 5, 4]]


def patch(kind, law, folder, section=""):
    """The uniform stress of a patch under GRADIENT."""
    mesh = Block(kind, (2, 2, 2), (2, 2, 2), shake=0.08, place=skew)
    wanted = mesh.x @ GRADIENT.T
    rows = "".join(f"{k + 1}, {a + 1}, {a + 1}, {float(wanted[k, a])!r}\n"
                   for k in np.flatnonzero(~mesh.inner) for a in range(3))
    text = mesh.deck(law, f"*STEP\n*STATIC\n1., 1.\n*BOUNDARY\n{rows}*NODE FILE\nU\n*EL FILE\nS\n"
                     "*END STEP\n").replace("MATERIAL=M\n*STEP", f"MATERIAL=M{section}\n*STEP")
    frame = run(text, folder).fields()
    assert np.abs(frame["displacement"][-1] - wanted).max() <= 1e-12
    found = frame["cauchy_stress"][-1]
    assert np.abs(found - found[0]).max() <= 1e-11*50
    return found[0]


@pytest.mark.parametrize("kind", PLAIN)
@pytest.mark.parametrize("law, c", [(ortho, ORTHO), (aniso, ANISO)])
def test_the_stress_of_a_patch(law, c, kind, tmp_path):
    wanted = stress(c, 0.5*(GRADIENT + GRADIENT.T))
    assert np.abs(patch(kind, law(c), tmp_path) - wanted).max() <= 1e-11*50


def test_engineering_constants_are_those_of_bars(tmp_path):
    """The compliance has 1/E and -nu/E."""
    e, nu, g = (50.0, 40.0, 30.0), (0.2, 0.3, 0.25), (12.0, 10.0, 8.0)
    soft = np.diag([*(1/v for v in e), *(1/v for v in g)])
    soft[0, 1] = soft[1, 0] = -nu[0]/e[0]
    soft[0, 2] = soft[2, 0] = -nu[1]/e[0]
    soft[1, 2] = soft[2, 1] = -nu[2]/e[1]
    law = "*ELASTIC, TYPE=ENGINEERING CONSTANTS\n" + lines([*e, *nu, *g])
    wanted = stress(np.linalg.inv(soft), 0.5*(GRADIENT + GRADIENT.T))
    assert np.abs(patch("C3D8", law, tmp_path) - wanted).max() <= 1e-11*50


@pytest.mark.parametrize("law, c", [(ortho, ORTHO), (aniso, ANISO)])
def test_constants_along_turned_axes(law, c, tmp_path):
    """By the tensor of four indices."""
    a, b = np.array([1.0, 2.0, -0.5]), np.array([0.3, 1.0, 2.0])
    third = np.cross(a, b)
    axes = np.array([v/np.linalg.norm(v) for v in (a, np.cross(third, a), third)])
    full = np.zeros((3, 3, 3, 3))
    for m, (i, j) in enumerate(PAIR):
        for n, (k, o) in enumerate(PAIR):
            full[i, j, k, o] = full[j, i, k, o] = full[i, j, o, k] = full[j, i, o, k] = c[m, n]
    full = np.einsum("abcd,ai,bj,ck,dl->ijkl", full, axes, axes, axes, axes)
    turned = np.array([[full[p + q] for q in PAIR] for p in PAIR])
    wanted = stress(turned, 0.5*(GRADIENT + GRADIENT.T))
    card = f"*ORIENTATION, NAME=OR\n{', '.join(map(str, [*a, *b]))}\n"
    found = patch("C3D10", law(c), tmp_path,
                  ", ORIENTATION=OR\n" + card.strip())
    assert np.abs(found - wanted).max() <= 1e-11*50
    assert np.abs(wanted - stress(c, 0.5*(GRADIENT + GRADIENT.T))).max() > 0.1


@pytest.mark.parametrize("kind", PLAIN)
def test_free_flight(kind, tmp_path):
    """Energy and momenta of a spinning body under NLGEOM."""
    flies(kind, aniso(ANISO), tmp_path)


@pytest.mark.parametrize("kind", ["C3D8", "C3D8I", "C3D10"])
def test_what_takes_energy(kind, tmp_path):
    """Damping and schemes take it by all moduli."""
    damped = flies(kind, aniso(ANISO) + "*DAMPING, BETA=0.02\n", tmp_path/"material")
    assert damped["damping_loss"][-1] > 0.01
    decayed = flies(kind, aniso(ANISO), tmp_path/"scheme", "ENERGY DECAYING, DISSIPATION=0.5")
    assert decayed["scheme_loss"][-1] > 1e-4*decayed["total"][0]


def test_small_strains_are_those_of_a_linear_step(tmp_path):
    wanted = stress(ANISO, 0.5*(GRADIENT + GRADIENT.T))
    found = patch("C3D8", aniso(ANISO), tmp_path, ", KINEMATICS=LINEAR")
    assert np.abs(found - wanted).max() <= 1e-11*50


@pytest.mark.parametrize("law, section, told", [
    ("*ELASTIC, TYPE=ORTHO\n1., 2., 1., 0., 0., 1., 1., 1.\n1.\n", "", "not positive definite"),
    ("*ELASTIC, TYPE=ENGINEERING CONSTANTS\n1., 0., 1., 0., 0., 0., 1., 1.\n1.\n", "",
     "E1, E2, E3 must be positive"),
    ("*ELASTIC, TYPE=ORTHO\n1., 0., 1., 0., 0., 1., 1., 1.\n", "",
     "the data line with D2323 is missing"),
    ("*ELASTIC, TYPE=LAMINA\n1., 1., 0., 1., 1., 1.\n", "", "use ENGINEERING CONSTANTS with solids"),
    (ortho(ORTHO), ", ORIENTATION=NONE", "unknown orientation 'NONE'"),
    (ortho(ORTHO), ", ORIENTATION=O\n*ORIENTATION, NAME=O, SYSTEM=CYLINDRICAL\n0., 0., 0., 0., 0., 1.",
     "only rectangular axes turn the constants of a material"),
    (ortho(ORTHO), ", ORIENTATION=O\n*ORIENTATION, NAME=O\n1., 0., 0., 2., 0., 0.", "on one line"),
    (ortho(ORTHO), ", ORIENTATION=O\n*ORIENTATION, NAME=O\n1., 0., 0., 0., 1., 0.\n3, 30.",
     "a further turn about an axis is not in this version"),
    (ortho(ORTHO), ", ORIENTATION=O\n*ORIENTATION, NAME=O", "the line with the two points is missing")])
def test_what_is_refused(law, section, told, tmp_path):
    deck = tmp_path/"deck.inp"
    deck.write_text(Block("C3D8", (1, 1, 1)).deck(law, "*STEP\n*DYNAMIC, DIRECT\n1., 1.\n*END STEP\n")
                    .replace("MATERIAL=M\n*STEP", f"MATERIAL=M{section}\n*STEP"))
    done = emcon("check", deck)
    assert done.returncode == 2 and told in done.stderr, done.stderr


def test_it_is_of_three_dimensions(tmp_path):
    deck = tmp_path/"deck.inp"
    deck.write_text("*NODE\n1, 0., 0.\n2, 1., 0.\n3, 0., 1.\n*ELEMENT, TYPE=CPE3, ELSET=E\n1, 1, 2, 3\n"
                    f"*MATERIAL, NAME=M\n{ortho(ORTHO)}*SOLID SECTION, ELSET=E, MATERIAL=M\n"
                    "*STEP\n*STATIC\n1., 1.\n*END STEP\n")
    assert "which is for elements C3D alone" in emcon("check", deck).stderr


def test_elements_with_a_mean_volume_are_refused(tmp_path):
    deck = tmp_path/"deck.inp"
    deck.write_text(Block("C3D8H", (1, 1, 1)).deck(ortho(ORTHO), "*STEP\n*STATIC\n1., 1.\n*END STEP\n"))
    told = emcon("check", deck).stderr.splitlines()[-1]
    assert told.startswith(f"{deck}:") and ": error: element 1 is of type C3D8H, which takes the mean change of volume" in told
