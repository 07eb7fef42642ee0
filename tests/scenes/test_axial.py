"""Solids of revolution in runs: closed forms, patches, free flight along the axis."""

import numpy as np
import pytest
from element_meshes import Mesh
from scene_tools import run_deck

KINDS = ["CAX3", "CAX4", "CAX6", "CAX8", "CAX8R"]
QUADRATIC = ("CAX6", "CAX8", "CAX8R")
ELASTIC = "*ELASTIC\n100., 0.3\n"
RUBBER = "*HYPERELASTIC, NEO HOOKE\n20., 0.02\n"
STEP = "*STEP{}\n*STATIC\n1., 1.\n"


def run(text, folder):
    (folder/"deck.inp").write_text(text)
    return run_deck(folder/"deck.inp", folder)


def faces(mesh, which):
    """Elements and faces along a side: bottom, right, top or left."""
    n, m = mesh.size
    side = ("bottom", "right", "top", "left").index(which)
    cells = ([k for k in range(n)], [n*k + n - 1 for k in range(m)],
             [n*(m - 1) + k for k in range(n)], [n*k for k in range(m)])[side]
    if not ("3" in mesh.kind or "6" in mesh.kind):
        return [(c + 1, side + 1) for c in cells]
    return [(2*c + 1, side + 1) if side < 2 else (2*c + 2, side) for c in cells]


def distorted(kind):
    """Where points are fewer only with straight sides, as a uniform stress asks for."""
    is_fine = kind not in ("CAX6", "CAX8R")
    return Mesh(kind, 3, 3, [(1, 0), (4, -0.5), (4.5, 2), (1.5, 2.5)], shake=0.1*is_fine)


def pressed(mesh, which, p):
    return "".join(f"{e}, P{f}, {p!r}\n" for e, f in faces(mesh, which))


def held(labels, dof):
    return "".join(f"{k}, {dof}\n" for k in labels)


@pytest.mark.parametrize("law, nlgeom", [(ELASTIC, ""), (ELASTIC, ", NLGEOM"),
                                         (RUBBER, ", NLGEOM")])
@pytest.mark.parametrize("kind", KINDS)
def test_patch(kind, law, nlgeom, tmp_path):
    """u = (a r, b y) on the rim of a mesh of distorted elements: inside too."""
    mesh = distorted(kind)
    u = mesh.x*[0.1, -0.05]
    rim = [k for which in ("bottom", "right", "top", "left") for k in mesh.side(which)]
    rows = "".join(f"{k}, {a}, {a}, {float(u[k - 1, a - 1])!r}\n" for k in sorted(set(rim))
                   for a in (1, 2))
    found = run(mesh.deck(law, f"{STEP.format(nlgeom)}*BOUNDARY\n{rows}*NODE FILE\nU\n*END STEP\n"),
                tmp_path).fields()["displacement"][-1]
    assert np.abs(found - u).max() <= 1e-12*np.abs(u).max()


@pytest.mark.parametrize("kind", KINDS)
def test_pressure_all_around(kind, tmp_path):
    """Of a ring: the stress is that pressure everywhere, also around the axis."""
    mesh = distorted(kind)
    load = "".join(pressed(mesh, which, 0.7) for which in ("bottom", "right", "top", "left"))
    after = f"*BOUNDARY\n1, 2\n{STEP.format(', NLGEOM')}*DLOAD\n{load}*EL FILE\nS\n*END STEP\n"
    stress = run(mesh.deck(RUBBER, after), tmp_path).fields()["cauchy_stress"][-1]
    assert np.abs(stress[:, :3] + 0.7).max() <= 1e-11
    assert np.abs(stress[:, 3:]).max() <= 1e-11


def mean_error(mesh, u, exact):
    """Root of the mean square over circles of the nodes, relative to the largest displacement."""
    square = np.square(u - exact).sum(1)
    return np.sqrt(np.average(square, weights=mesh.x[:, 0]))/np.abs(exact).max()


def lame(n, kind, folder):
    """Error of a thick cylinder under inner pressure:
    u = (1 + nu)/E p a^2/(b^2 - a^2) ((1 - 2 nu) r + b^2/r), without strain along the axis."""
    a, b, p, young, nu = 1.0, 2.0, 3.0, 100.0, 0.3
    mesh = Mesh(kind, n, n//2, [(a, 0), (b, 0), (b, 0.5), (a, 0.5)])
    after = (f"*BOUNDARY\nNALL, 2\n{STEP.format('')}*DLOAD\n{pressed(mesh, 'left', p)}"
             "*NODE FILE\nU\n*END STEP\n")
    u = run(mesh.deck(ELASTIC, after), folder).fields()["displacement"][-1]
    r = mesh.x[:, 0]
    exact = (1 + nu)/young*p*a*a/(b*b - a*a)*((1 - 2*nu)*r + b*b/r)
    return mean_error(mesh, u, np.stack([exact, 0*r], 1))


@pytest.mark.parametrize("kind", KINDS)
def test_thick_cylinder(kind, tmp_path):
    """Of second order with linear elements, of third at least with quadratic ones; CAX8R has the
    nodes exact."""
    coarse, fine = (lame(n, kind, tmp_path) for n in (8, 16))
    assert fine < 1e-12 or np.log2(coarse/fine) > (2.8 if kind in QUADRATIC else 1.8)
    assert fine < (1e-4 if kind in QUADRATIC else 1e-2)


def ball(n, kind, folder):
    """The same of a hollow ball: u = p a^3/(b^3 - a^3) ((1 - 2 nu) r + (1 + nu) b^3/(2 r^2))/E."""
    a, b, p, young, nu = 1.0, 2.0, 3.0, 100.0, 0.3
    mesh = Mesh(kind, n, n, [(a, 0), (b, 0), (b, 1), (a, 1)])
    far, turn = mesh.x[:, 0].copy(), np.pi/2*mesh.x[:, 1]
    mesh.x = np.stack([far*np.cos(turn), far*np.sin(turn)], 1)
    top, bottom = mesh.side("top"), mesh.side("bottom")
    mesh.x[np.array(top) - 1, 0] = 0
    after = (f"*BOUNDARY\n{held(top, 1)}{held(bottom, 2)}{STEP.format('')}"
             f"*DLOAD\n{pressed(mesh, 'left', p)}*NODE FILE\nU\n*END STEP\n")
    u = run(mesh.deck(ELASTIC, after), folder).fields()["displacement"][-1]
    exact = p*a**3/(b**3 - a**3)*((1 - 2*nu)*far + (1 + nu)*b**3/(2*far**2))/young
    out = np.stack([np.cos(turn), np.sin(turn)], 1)
    return mean_error(mesh, u, exact[:, None]*out)


@pytest.mark.parametrize("kind", KINDS)
def test_hollow_ball(kind, tmp_path):
    coarse, fine = (ball(n, kind, tmp_path) for n in (6, 12))
    assert np.log2(coarse/fine) > (2.8 if kind in QUADRATIC else 1.8)
    assert fine < (1e-4 if kind in QUADRATIC else 1e-2)


@pytest.mark.each_value
@pytest.mark.parametrize("damping", ["", "*DAMPING, BETA=0.1\n"])
@pytest.mark.parametrize("kind", KINDS)
def test_free_flight(kind, damping, tmp_path):
    """A ring that flies along its axis and vibrates, 1000 increments."""
    mesh = Mesh(kind, 2, 2, [(1, 0), (3, 0), (3, 1), (1, 1)])
    speed = "".join(f"{k}, 1, {0.3*(x - 1) - 0.4*(y - 0.5)!r}\n"
                    f"{k}, 2, {0.8 + 0.3*(y - 0.5) - 0.2*x!r}\n"
                    for k, (x, y) in enumerate(mesh.x.tolist(), 1))
    after = (f"*INITIAL CONDITIONS, TYPE=VELOCITY\n{speed}*STEP, NLGEOM, INC=2000\n"
             "*DYNAMIC, DIRECT\n0.02, 20.\n*NODE FILE, FREQUENCY=1000\nU\n*END STEP\n")
    history = run(mesh.deck(RUBBER + damping, after), tmp_path).history
    assert len(history) == 1001
    loss = history["damping_loss"]
    for values in (history["py"], history["total"] + loss):
        assert np.abs(values - values[0]).max() <= 1e-12*abs(values[0])
    assert not history["px"].any() and not history["lz"].any()
    assert history["strain"].max() > 1e-3*history["total"][0]
    assert (loss[-1] > 1e-3*history["total"][0]) == bool(damping) and (np.diff(loss) >= 0).all()
    if damping:                        # what is left is the flight along the axis
        flight = 0.5*history["py"][0]**2/(0.5*np.pi*(3**2 - 1))
        assert abs(history["kinetic"][-1] - flight) < 1e-4*flight


def rotor(n, kind, folder):
    """The same of a cylinder that turns: u = A r + B/r - k r^3/8 between free sides,
    k = rho omega^2 (1 + nu) (1 - 2 nu)/(E (1 - nu))."""
    a, b, square, density, young, nu = 1.0, 2.0, 4.0, 0.5, 100.0, 0.3
    mesh = Mesh(kind, n, n//2, [(a, 0), (b, 0), (b, 0.5), (a, 0.5)])
    after = (f"*BOUNDARY\nNALL, 2\n{STEP.format('')}*DLOAD\n"
             f"ALL, CENTRIF, {square}, 0., 0., 0., 0., 2., 0.\n*NODE FILE\nU\n*END STEP\n")
    u = run(mesh.deck(ELASTIC, after), folder).fields()["displacement"][-1]
    k = density*square*(1 + nu)*(1 - 2*nu)/(young*(1 - nu))
    # On free sides (1 - nu) u' + nu u/r = 0.
    rows = [[1, (2*nu - 1)/r**2] for r in (a, b)]
    one, other = np.linalg.solve(rows, [k*r*r/8*(3 - 2*nu) for r in (a, b)])
    r = mesh.x[:, 0]
    return mean_error(mesh, u, np.stack([one*r + other/r - k*r**3/8, 0*r], 1))


@pytest.mark.parametrize("kind", KINDS)
def test_rotor(kind, tmp_path):
    coarse, fine = (rotor(n, kind, tmp_path) for n in (8, 16))
    assert np.log2(coarse/fine) > (2.8 if kind in QUADRATIC else 1.8)
    assert fine < (1e-4 if kind in QUADRATIC else 1e-2)


def test_weight(tmp_path):
    """A ring on its lower side bears its weight: rho pi (b^2 - a^2) h g; forces on nodes are those
    on their circles."""
    mesh = Mesh("CAX8", 2, 1, [(1, 0), (2, 0), (2, 0.5), (1, 0.5)])
    bottom, top = mesh.side("bottom"), mesh.side("top")
    after = (f"*BOUNDARY\n{held(bottom, 2)}*NSET, NSET=BOTTOM\n{', '.join(map(str, bottom))}\n"
             f"{STEP.format('')}*DLOAD\nALL, GRAV, 9.81, 0., -1.\n*CLOAD\n{top[0]}, 2, -3.\n"
             "*NODE PRINT, NSET=BOTTOM, TOTALS=ONLY\nRF\n*END STEP\n")
    _, force = run(mesh.deck(ELASTIC, after), tmp_path).series("BOTTOM", "TOTAL_RF")
    assert force[-1].ravel()[1] == pytest.approx(3 + 0.5*np.pi*3*0.5*9.81, rel=1e-12)


def test_it_is_told_what_is_free(tmp_path):
    """A ring can only move along its axis; nodes on the axis are to be held there."""
    mesh = Mesh("CAX4", 1, 1, [(0, 0), (1, 0), (1, 1), (0, 1)])
    (tmp_path/"deck.inp").write_text(mesh.deck(ELASTIC, f"{STEP.format('')}*CLOAD\n1, 1, 1.\n"
                                               "*NODE FILE\nU\n*END STEP\n"))
    found = run_deck(tmp_path/"deck.inp", tmp_path, code=3)
    assert "move in y" in found.errors and "move in x" not in found.errors
    assert "nodes 1, 3 lie on the axis and may leave it" in found.errors
