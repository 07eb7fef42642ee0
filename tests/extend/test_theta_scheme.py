"""Schemes of time integration from outside, a file each against the installed library."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent/"embed"))

from embed_tools import WARNINGS, need, run  # noqa: E402

SOURCES = ["theta_scheme.f90", "own_schemes.f90", "integrated.f90"]
EPS = np.finfo(float).eps
#: Of what does not gain any more so many roundings are left at most: `kept_floor` of
#: emcon_convergence. Those of 30 steps add up to less than four times as many.
FLOOR = 16
SUM = 4*FLOOR
# One element on rollers, fixed on the left: one linear oscillator, k = E, m = rho/3, omega = 3.
OSCILLATOR = """*NODE, NSET=ALL
1, 0., 0.
2, 0., 1.
3, 1., 0.
4, 1., 1.
*NSET, NSET=RIGHT
3, 4
*ELEMENT, TYPE=CPE4, ELSET=BAR
1, 1, 3, 4, 2
*MATERIAL, NAME=LINEAR
*ELASTIC
3., 0.
*DENSITY
1.
*SOLID SECTION, ELSET=BAR, MATERIAL=LINEAR
*BOUNDARY
1, 1
2, 1
ALL, 2
*INITIAL CONDITIONS, TYPE=VELOCITY
RIGHT, 1, 1.
*STEP
*DYNAMIC, DIRECT
{h}, {end}
*TIME INTEGRATION, SCHEME=Theta
*END STEP
"""
OMEGA = 3.0
# A square that spins, is stretched, and has large strains.
SPINNING = """*NODE
1, 0., 0.
2, 1., 0.
3, 1., 1.
4, 0., 1.
*ELEMENT, TYPE=CPE4, ELSET=BLOCK
1, 1, 2, 3, 4
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, NEO HOOKE
5., 0.1
*DENSITY
1.
*SOLID SECTION, ELSET=BLOCK, MATERIAL=RUBBER
*INITIAL CONDITIONS, TYPE=VELOCITY
1, 1, -2.
3, 1, 2.
3, 2, 3.
*STEP, NLGEOM
*DYNAMIC, DIRECT
{h}, 1.
*TIME INTEGRATION, SCHEME=THETA
*END STEP
"""


# A block that flies to a wall, is stopped by contact, and flies back.
IMPACT = """*NODE, NSET=ALL
1, 1.1, 0.
2, 1.1, 1.
3, 1.4, -1.
4, 1.4, 2.
5, 0., 0.
6, 1., 0.
7, 0., 1.
8, 1., 1.
*NSET, NSET=WALL, GENERATE
1, 4
*ELEMENT, TYPE=CPE4, ELSET=FIXED
1, 1, 3, 4, 2
*ELEMENT, TYPE=CPE4, ELSET=BLOCK
2, 5, 6, 8, 7
*SURFACE, NAME=FACE
BLOCK, S2
*SURFACE, NAME=STOP
FIXED, S4
*SURFACE INTERACTION, NAME=HARD
*CONTACT PAIR, INTERACTION=HARD, TYPE=NODE TO SURFACE
FACE, STOP
*MATERIAL, NAME=LINEAR
*ELASTIC
3., 0.
*DENSITY
1.
*SOLID SECTION, ELSET=FIXED, MATERIAL=LINEAR
*SOLID SECTION, ELSET=BLOCK, MATERIAL=LINEAR
*BOUNDARY
WALL, 1, 2
ALL, 2
*INITIAL CONDITIONS, TYPE=VELOCITY
5, 1, 0.2
6, 1, 0.2
7, 1, 0.2
8, 1, 0.2
*STEP
*DYNAMIC, DIRECT
0.0625, 4.
*TIME INTEGRATION, SCHEME=THETA
*END STEP
"""


@pytest.fixture(scope="module")
def program(installed: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    need("gfortran")
    folder = tmp_path_factory.mktemp("extend")
    env = installed
    flags = run("pkg-config", "--cflags", "--libs", "emcon", env=env).split()
    run("gfortran", *WARNINGS, "-std=f2008", *(HERE/name for name in SOURCES), "-o",
        folder/"integrated", *flags, env=env, cwd=folder)
    return folder/"integrated", env


def history(program: tuple[Path, dict[str, str]], folder: Path, deck: str,
            theta: float, *more: str) -> np.ndarray:
    """Time, displacement, velocity, energy, angular momentum, work of contact, momenta: a row
    each."""
    path = folder/"deck.inp"
    path.write_text(deck)
    lines = run(program[0], path, "theta", theta, *more, env=program[1]).splitlines()
    return np.array([[float(word) for word in line.split()] for line in lines]).T


@pytest.mark.parametrize("theta", [0.5, 0.75, 1.0])
def test_oscillator_follows_the_closed_form(program: tuple[Path, dict[str, str]], tmp_path: Path,
                                            theta: float) -> None:
    """v + i omega u is multiplied by R = (1 + (1 - theta) i omega h)/(1 - theta i omega h): |R|,
    the spectral radius, is 1 for the mid-point rule and below it for theta > 1/2."""
    h, n = 0.125, 80
    _, u, v, energy, *_ = history(program, tmp_path, OSCILLATOR.format(h=h, end=n*h), theta)
    x = OMEGA*h
    factor = ((1 + (1 - theta)*1j*x)/(1 - theta*1j*x))**np.arange(n + 1)
    # Each step rounds u, v and what they are computed from: some ten times.
    assert np.abs(v + 1j*OMEGA*u - factor).max() <= 20*n*EPS
    # The energies of kinetic and strain: m/2 |R|^2n, m = 1/3.
    assert np.abs(energy - np.abs(factor)**2/6).max() <= 20*n*EPS


@pytest.mark.parametrize(("theta", "order"), [(0.5, 2), (1.0, 1)])
def test_order_of_convergence(program: tuple[Path, dict[str, str]], tmp_path: Path,
                              theta: float, order: int) -> None:
    error = []
    for h in (1/64, 1/128):
        time, u, v, *_ = history(program, tmp_path, OSCILLATOR.format(h=h, end=1.), theta)
        error.append(abs(v[-1] + 1j*OMEGA*u[-1] - np.exp(1j*OMEGA*time[-1])))
    assert abs(np.log2(error[0]/error[1]) - order) < 0.05


def test_midpoint_rule_keeps_angular_momentum_but_not_energy(
        program: tuple[Path, dict[str, str]], tmp_path: Path) -> None:
    drift = []
    for h in (1/32, 1/64):
        _, _, _, energy, angular, *_ = history(program, tmp_path, SPINNING.format(h=h), 0.5)
        # Newton stops at round-off: of forces that turn the square some times in a unit of time.
        assert np.abs(angular - angular[0]).max() <= 1e3*EPS*abs(angular[0])
        drift.append(np.abs(energy - energy[0]).max()/energy[0])
    assert drift[0] > 1e-5
    assert abs(np.log2(drift[0]/drift[1]) - 2) < 0.3


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_contact_works_over_the_whole_step(program: tuple[Path, dict[str, str]], tmp_path: Path,
                                           theta: float) -> None:
    """Wherever forces are evaluated, contact makes and takes nothing: energy stays with the
    mid-point rule and a linear law, and falls with the backward Euler method."""
    _, u, v, energy, *_ = history(program, tmp_path, IMPACT, theta)
    assert u.max() <= 0.1 and v[0] > 0 > v[-1]
    growth = np.diff(energy)/energy[0]
    if theta == 0.5:
        assert np.abs(growth).max() <= 64*EPS
    else:
        assert growth.max() <= 64*EPS and energy[-1] < 0.9*energy[0]


# Two blocks that fly at each other, one of them pushed by a load that grows.
COLLISION = """*NODE, NSET=ALL
1, 0., 0.
2, 1., 0.
3, 1., 1.
4, 0., 1.
5, 1.04, 0.3
6, 2.04, 0.3
7, 2.04, 1.3
8, 1.04, 1.3
*ELEMENT, TYPE=CPE4, ELSET=LEFT
1, 1, 2, 3, 4
*ELEMENT, TYPE=CPE4, ELSET=RIGHT
2, 5, 6, 7, 8
*ELSET, ELSET=BOTH
1, 2
*MATERIAL, NAME=STUFF
*HYPERELASTIC, COUPLED NEO HOOKE
100., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=BOTH, MATERIAL=STUFF
*SURFACE, NAME=ONE
LEFT, S2
*SURFACE, NAME=OTHER
RIGHT, S4
*SURFACE INTERACTION, NAME=HARD
*CONTACT PAIR, INTERACTION=HARD
ONE, OTHER
*AMPLITUDE, NAME=GROWS
0., 0., 0.5, 1.
*INITIAL CONDITIONS, TYPE=VELOCITY
5, 1, -1.
6, 1, -1.
7, 1, -1.
8, 1, -1.
*STEP, NLGEOM
*DYNAMIC, DIRECT
0.01, {end}
*TIME INTEGRATION, SCHEME={scheme}
{load}*END STEP
"""
LOAD = "*CLOAD, AMPLITUDE=GROWS\n1, 2, 3.\n4, 2, 3.\n"
KINDS = ["ENERGY MOMENTUM", "MIDPOINT", "TRAPEZOIDAL", "GENERALIZED ALPHA", "BDF2",
         "ENERGY DECAYING"]


@pytest.mark.parametrize("theta", [0.5, 0.75, 1.0])
def test_contact_that_pushes_at_the_end(program: tuple[Path, dict[str, str]], tmp_path: Path,
                                        theta: float) -> None:
    """Its forces are those along the gradients there, and so is their work: the mid-point rule and
    a linear law change energy by just that, others lose more. Momentum stays."""
    linear = COLLISION.replace("*HYPERELASTIC, COUPLED NEO HOOKE", "*ELASTIC").replace(
        ", NLGEOM", "")
    deck = linear.format(scheme="THETA", load="", end=0.3)
    table = history(program, tmp_path, deck, theta, "end")
    energy, work, momentum = table[3], table[5], table[6:]
    assert np.abs(np.diff(work)).max() > 1e-6*energy[0]
    left = np.diff(energy - work)/energy[0]
    assert left.max() <= FLOOR*EPS
    if theta == 0.5:
        assert left.min() >= -FLOOR*EPS
    else:
        assert energy[-1] < 0.99*energy[0]
    assert np.abs(momentum.T - [-1., 0.]).max() <= SUM*EPS


@pytest.mark.parametrize("kind", KINDS)
def test_copies_do_what_their_originals_do(program: tuple[Path, dict[str, str]], tmp_path: Path,
                                           kind: str) -> None:
    """Together they set all that a `evaluation_t` has: what one of them leaves out would be seen here.
    Nor does it matter that a run goes on in other steppers."""
    path = tmp_path/"deck.inp"
    lines = []
    for scheme, name, more in ((kind, "", ""), ("OWN", "own", ""), ("OWN", "own", "again")):
        path.write_text(COLLISION.format(scheme=scheme, load=LOAD, end=0.3))
        lines.append(run(program[0], path, name, kind.replace(" ", ""), more,
                         env=program[1]).splitlines())
    assert lines[0] == lines[1] == lines[2]
    assert len({line.split()[2] for line in lines[0]}) > 10      # it is stopped in contact


@pytest.mark.parametrize("kind", KINDS)
def test_contact_leaves_momentum(program: tuple[Path, dict[str, str]], tmp_path: Path,
                                 kind: str) -> None:
    """Whatever a scheme says of contact, forces on both surfaces are opposite."""
    path = tmp_path/"deck.inp"
    path.write_text(COLLISION.format(scheme="OWN", load="", end=0.3))
    lines = run(program[0], path, "own", kind.replace(" ", ""), env=program[1]).splitlines()
    table = np.array([[float(word) for word in line.split()] for line in lines])
    momentum = table[:, 6:]
    assert np.abs(momentum - [-1., 0.]).max() <= SUM*EPS
    assert table[-1, 2] > -0.9                      # the right block was stopped


@pytest.mark.parametrize(("name", "theta", "words"), [
    ("", 0.5, "deck.inp:25: error: SCHEME=THETA: no program has given this scheme"),
    ("other", 0.5, "deck.inp:25: error: SCHEME=THETA: no program has given this scheme"),
    ("energy momentum", 0.5, "cannot be given as ENERGY MOMENTUM: EMCON has its own"),
    ("theta", 1.5, "the scheme THETA: at = 1.5 must be above 0 and at most 1")])
def test_refusals(program: tuple[Path, dict[str, str]], tmp_path: Path, name: str, theta: float,
                  words: str) -> None:
    path = tmp_path/"deck.inp"
    path.write_text(OSCILLATOR.format(h=0.1, end=1.))
    done = subprocess.run([program[0], path, name, str(theta)], env=program[1],
                          capture_output=True, text=True)
    assert done.returncode == 1
    assert words in done.stdout
