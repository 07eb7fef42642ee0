"""Steady sliding of an elastic block: the modes of the linear one, and the rate that a run shows."""

import numpy as np
from friction_scenes import G, rubbing
from plain_scenes import ONE, Scene
from scene_tools import Deck

RISE = 0.2


def fastest(mu, cells=(4, 2), size=(2.0, 1.0), stiffness=2e4, nu=0.3, eta=0.0):
    """The mode that grows fastest of a linear block of density 1 that slides, its rate and frequency
    as one complex number, and the row that tells how much of it there is in displacements and
    velocities of all nodes: of P'MP and P'KP, where P has the tilted forces on the left and the held
    gaps on the right."""
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
    rate, modes = np.linalg.eig(np.block([[zero, np.eye(len(kept))], [turn, eta*turn]]).T)
    # The block slides as a whole at none.
    k = np.argmax(np.where((np.abs(rate) > 1.0) & (rate.imag > 0), rate.real, -np.inf))
    row = np.zeros((2, free), complex)
    row[:, kept] = modes[:, k].reshape(2, -1)
    return rate[k], row.reshape(2, -1, 2)


def fluttering(h, t_end, eta=0.0, cells=(4, 2)):
    """A block whose weight comes by and by, so that its shear swings little at first."""
    scene = Scene(h, t_end, gravity=G)
    scene.block("BLOCK", (0, 0), (2, 1), cells, stiffness=2e4, velocity=(10, 0))
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
    return Deck(text.replace("*NODE FILE\nU\n", "*NODE FILE\nU, V\n"))


def rate_of(run, row, h):
    """The complex rate at which a mode grows in a run from RISE on. The midpoint rule takes a rate s
    for 2/h tanh(s h/2), which is what is given."""
    fields, time = run.fields(), run.history["time"]
    later = time > RISE + 0.5*h
    n = row.shape[1]
    found = np.einsum("tna,na->t", fields["displacement"][later, :n], row[0]) \
        + np.einsum("tna,na->t", fields["velocity"][later, :n], row[1])
    found = (found - found.mean())/np.abs(found - found.mean()).max()
    time = time[later] - time[later][0]

    def left(s):
        basis = np.stack([np.ones_like(time), np.exp(s*time)], axis=1)
        return found - basis @ np.linalg.lstsq(basis, found, rcond=None)[0]

    # Newton's method of least squares, from the angle by which what has changed meanwhile turns.
    lag = len(time)//8
    step = found[lag:] - found[:-lag]
    s = 1j*np.angle(np.vdot(step[:-1], step[1:]))/h
    small = 1e-3*abs(s)
    for _ in range(50):
        r = left(s)
        slope = (left(s + small) - left(s - small))/(2*small)
        change = -np.vdot(slope, r)/np.vdot(slope, slope)
        s += change
        if abs(change) < 1e-9*abs(s):
            break
    return 2/h*np.tanh(s*h/2)
