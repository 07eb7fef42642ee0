"""`*CONTACT DAMPING` with a `TANGENT FRACTION` in space: closed forms of sliding, energy and momenta of impacts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import wall_space_scenes as walls
from contact_space_scenes import bodies, dynamic, faces, impact, pair, velocities
from scene_tools import EPSILON, Run, run_deck
from space_mesh import Block
from test_contact_space_rigid import rigid
from test_friction_space import STIFF, slab, weight

KINDS = [", EDGES=NO", ", TYPE=MORTAR, EDGES=NO"]
MASS, AREA, COEFFICIENT, FRACTION = 0.5, 1.0, 0.6, 0.5


def ran(folder: Path, text: str) -> Run:
    (folder/"deck.inp").write_text(text)
    return run_deck(folder/"deck.inp", folder)


def damping(clearance: str = "") -> str:
    return f"*CONTACT DAMPING, TANGENT FRACTION={FRACTION}\n{COEFFICIENT}{clearance}\n"


def takes(run: Run) -> None:
    """Damping takes energy in each increment, and the books agree."""
    history = run.history
    loss = history["contact_damping_loss"]
    total = history["kinetic"] + history["strain"] + loss + history["friction_loss"] - history["external_work"]
    assert run.verdict["verdict"] == "good", run.log[-600:]
    assert np.ptp(total) <= 1.0e-11*np.abs(total).max()
    assert np.diff(loss).min() >= 0 and loss[-1] > 0


def over_faces(kind: str, interaction: str, v: np.ndarray, gap: float = 0.0) -> str:
    """A rigid slab over a body that is held, whose nodes have guards."""
    one = slab()
    one.x[:, 2] += gap
    two = Block("C3D8", (4, 4, 1), size=(5, 5, 1), place=lambda x: x - np.array([2.5, 2.5, 1.0]))
    return (bodies([one, two], [faces(one, 2, 0), faces(two, 2, 1)], STIFF) + rigid(1, one, v=tuple(v))
            + pair(kind + ", SIDES=ONE", interaction) + "*BOUNDARY\n"
            + "".join(f"{len(one.x) + k}, 1, 3\n" for k in range(1, len(two.x) + 1)))


@pytest.mark.parametrize("kind", ["", *KINDS, ", TYPE=MORTAR"])
def test_a_rigid_slab_loses_velocity_by_the_way(kind: str, tmp_path: Path) -> None:
    """M v + A m(g) is constant, where mu falls over the clearance: the area is that of the slave alone, not of guards."""
    c, clearance, gap, v = 2.0, 0.3, 0.32, -0.4
    run = ran(tmp_path, over_faces(kind, f"*CONTACT DAMPING\n{c}, {clearance}, 0.\n", np.array([0, 0, v]), gap)
              + dynamic(0.03, 0.9))
    takes(run)
    g = gap + run.fields()["displacement"][:, 0, 2]
    m = c*np.where(g < clearance, g - g**2/(2*clearance), clearance/2)
    kept = run.history["pz"] + AREA*m
    assert g.min() < 0.2 and np.ptp(kept) < 1e-13


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("clearance", ["", ", .1, .5"])
@pytest.mark.parametrize("floor", ["plane", "faces"])
def test_a_rigid_slab_slides_ever_slower(floor: str, clearance: str, kind: str, tmp_path: Path) -> None:
    """Across its edges: by the rule of the middle v1/v0 = (1 - b/2)/(1 + b/2), b = f A mu h/M, in both directions."""
    h, until, v = 0.04, 0.4, np.array([1.0, 0.6, 0.0])
    one = slab()
    if floor == "plane":
        text = (bodies([one], [faces(one, 2, 0)], STIFF) + rigid(1, one, v=tuple(v)) + walls.wall(walls.plane())
                + walls.pair(kind.replace(", EDGES=NO", ""), damping(clearance)) + f"*BOUNDARY\n{walls.FIXED}")
    else:
        text = over_faces(kind, damping(clearance), v)
    run = ran(tmp_path, text + dynamic(h, until, weight()))
    takes(run)
    b, n = FRACTION*AREA*COEFFICIENT*h/MASS, np.arange(len(run.history))
    for name, start in zip(("px", "py"), v):
        assert np.abs(run.history[name]/MASS - start*((1 - b/2)/(1 + b/2))**n).max() < 1e-12
    assert np.abs(run.history["lz"]).max() < 1e-10


def test_a_spin_dies_away_on_a_plane(tmp_path: Path) -> None:
    """A rigid slab spins about its axis: its corners, sides and middle have 1, 2 and 4 parts of 16 of the area, so that
    f mu times the sum of areas by squares of distances to the axis slows the spin down."""
    one, h, spin = slab(), 0.01, 0.5
    run = ran(tmp_path, bodies([one], [faces(one, 2, 0)], STIFF) + rigid(1, one, w=(0, 0, spin)) + walls.wall(walls.plane())
              + walls.pair("", damping()) + f"*BOUNDARY\n{walls.FIXED}" + dynamic(h, 0.4, weight()))
    takes(run)
    inertia = MASS*(1 + 1)/12
    rate = FRACTION*COEFFICIENT*(4*0.5*1 + 4*0.25*2)/16/inertia
    assert run.history["lz"]/(inertia*spin) == pytest.approx(np.exp(-rate*run.history["time"]), rel=1e-4)
    for name in ("px", "py", "lx", "ly"):
        assert np.abs(run.history[name]).max() < 1e-9*inertia*spin


@pytest.mark.parametrize("friction", ["", "*FRICTION\n.3\n"])
@pytest.mark.parametrize(("first", "second", "kind"), [("C3D8", "C3D8", ""), ("C3D8", "C3D10", ""),
                                                       ("C3D8", "C3D8", ", TYPE=MORTAR")])
def test_an_impact_keeps_momenta_and_pays(first: str, second: str, kind: str, friction: str, tmp_path: Path) -> None:
    """Of two free bodies, askew and with a spin: what is damped is a force of each on the other."""
    run = ran(tmp_path, impact(first, second, interaction=friction + damping(", .1, .3"), options=kind))
    takes(run)
    history = run.history
    assert history["active"].max() > 0
    for names in ("px py pz", "lx ly lz"):
        found = np.array([history[name] for name in names.split()]).T
        assert np.abs(found - found[0]).max() <= 1.0e-11*np.abs(found).max()


def test_what_turns_with_its_floor_is_not_damped(tmp_path: Path) -> None:
    """Two bodies that spin as one, with contact closed between them: no slip, no loss but of the gap."""
    lower = Block("C3D8", (2, 2, 1), place=lambda x: x - np.array([.5, .5, 1.0]))
    upper = Block("C3D8", (3, 3, 1), place=lambda x: x - np.array([.5, .5, 0.0]))
    spin = np.array([0.0, 0.0, 2.0])
    together = "".join(velocities(block, np.zeros(3), spin) if k == 0 else "".join(
        f"{len(upper.x) + i}, {a}, {s!r}\n" for i, row in enumerate(np.cross(spin, lower.x).tolist(), 1)
        for a, s in enumerate(row, 1) if s) for k, block in enumerate((upper, lower)))
    text = (bodies([upper, lower], [faces(upper, 2, 0), faces(lower, 2, 1)], STIFF) + pair("", damping(", .01, 1."))
            + together + dynamic(0.01, 0.1))
    history = ran(tmp_path, text).history
    kinetic = history["kinetic"][0]
    # The bodies stretch, each by itself; what slips by that is small.
    assert history["contact_damping_loss"][-1] < 1e-5*kinetic
    assert np.ptp(history["lz"]) <= 64*EPSILON*len(history)*np.abs(history["lz"]).max()
