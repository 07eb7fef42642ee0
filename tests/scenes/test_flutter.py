"""Steady sliding of an elastic block: it flutters by itself where nothing damps it."""

import math

import numpy as np
import pytest
from friction_scenes import G, NODES, rubbing
from plain_scenes import ONE, Scene
from scene_tools import Deck, run_deck

RISE = 0.2


def growth(mu, cells=(4, 2), size=(2.0, 1.0), stiffness=2e4, nu=0.3, eta=0.0):
    """The fastest growth of a mode of a linear block of density 1 that slides, and its frequency:
    of P'MP and P'KP, where P has the tilted forces on the left and the held gaps on the right."""
    lam, shear = stiffness*nu/((1 + nu)*(1 - 2*nu)), stiffness/(2*(1 + nu))
    law = np.array([[lam + 2*shear, lam, 0], [lam, lam + 2*shear, 0], [0, 0, shear]])
    a, b = size[0]/cells[0], size[1]/cells[1]
    corner = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    k, m = np.zeros((8, 8)), np.zeros((8, 8))
    for s in np.array(corner)/np.sqrt(3):
        n = (1 + s[0]*corner[:, 0])*(1 + s[1]*corner[:, 1])/4
        d = np.array([corner[:, 0]*(1 + s[1]*corner[:, 1])/(2*a),
                      corner[:, 1]*(1 + s[0]*corner[:, 0])/(2*b)])
        strain = np.zeros((3, 8))
        strain[0, ::2], strain[1, 1::2], strain[2, ::2], strain[2, 1::2] = d[0], d[1], d[1], d[0]
        k += a*b/4*strain.T @ law @ strain
        m += a*b/4*np.kron(np.outer(n, n), np.eye(2))
    free = 2*(cells[0] + 1)*(cells[1] + 1)
    stiff, mass = np.zeros((free, free)), np.zeros((free, free))
    for i in range(cells[0]):
        for j in range(cells[1]):
            first = i*(cells[1] + 1) + j
            node = [first, first + cells[1] + 1, first + cells[1] + 2, first + 1]
            at = np.array([[2*n, 2*n + 1] for n in node]).ravel()
            stiff[np.ix_(at, at)] += k
            mass[np.ix_(at, at)] += m
    bears = [i*(cells[1] + 1) for i in range(cells[0] + 1)]
    kept = [d for d in range(free) if d not in [2*n + 1 for n in bears]]
    df = np.eye(free)[:, kept]
    push = df.copy()
    for n in bears:
        push[2*n + 1, kept.index(2*n)] = mu
    turn = -np.linalg.solve(push.T @ mass @ df, push.T @ stiff @ df)
    zero = np.zeros_like(turn)
    rate = np.linalg.eigvals(np.block([[zero, np.eye(len(kept))], [turn, eta*turn]]))
    rate = rate[np.abs(rate) > 1.0]                # the block slides as a whole at none
    fastest = rate[np.argmax(rate.real)]
    return fastest.real, abs(fastest.imag)

def fluttering(h, t_end, eta):
    """A block whose weight comes by and by, so that its shear swings little at first."""
    scene = Scene(h, t_end, gravity=G)
    scene.block("BLOCK", (0, 0), (2, 1), (4, 2), stiffness=2e4, velocity=(10, 0))
    scene.block("FLOOR", (-1, -1), (12, 1), (1, 1), stiffness=2e4)
    scene.hold("FLOOR", lambda x, y: True)
    scene.pairs = [("BLOCK", "FLOOR")]
    part = np.linspace(0, 1, 65)
    rise = part**4*(35 - 84*part + 70*part**2 - 20*part**3)
    rows = "\n".join(f"{RISE*a!r}, {b!r}"
                     for a, b in zip(part.tolist(), rise.tolist(), strict=True))
    text = rubbing(scene.deck(ONE), 0.3).text()
    text = text.replace("*AMPLITUDE, NAME=RAMP", f"*AMPLITUDE, NAME=RISE\n{rows}\n9., 1.\n"
                        "*AMPLITUDE, NAME=RAMP").replace("*DLOAD\n", "*DLOAD, AMPLITUDE=RISE\n")
    if eta:
        text = text.replace("*MATERIAL, NAME=BLOCK",
                            f"*MATERIAL, NAME=BLOCK\n*DAMPING, BETA={eta!r}")
    return Deck(text)


@pytest.mark.parametrize(("eta", "span"), [(0.0, 4), (2e-3, 8)])
def test_flutter_grows_as_its_eigenvalue_says(eta, span, tmp_path):
    """Undamped by 22 per second, damped it dies out by 19; no node leaves the floor meanwhile."""
    rate, frequency = growth(0.3, eta=eta)
    period = 2*math.pi/frequency
    run = run_deck(fluttering(5e-4, RISE + (span + 1)*period, eta), tmp_path, **NODES)
    assert run.verdict["verdict"] == "good" and run.verdict["law_violation"] <= 1e-9
    u = run.fields()["displacement"][:, :15, 0]
    shear, time = (u[:, 2::3] - u[:, ::3]).mean(axis=1), run.history["time"]
    windows = [(time >= RISE + k*period) & (time < RISE + (k + 1)*period) for k in range(span)]
    size = [np.std(shear[w]) for w in windows]
    seen = np.polyfit(period*np.arange(span), np.log(size), 1)[0]
    assert seen == pytest.approx(rate, abs=0.15*abs(rate))
    assert rate == pytest.approx(22.15 if not eta else -19.32, abs=0.01)
    assert (run.history["active"][1:] == 5).all()
