"""Ties in space: a uniform stress over unlike distorted meshes, and a bar that is twisted by a full turn."""

import sys

import numpy as np
from scene_tools import DECKS, Deck

from .common import Chapter, size, table

sys.path.append(str(DECKS.parent/"tests"/"scenes"))
from contact_space_scenes import RUBBER, straight  # noqa: E402
from space_mesh import Block  # noqa: E402
from tie_space_scenes import box, shaken, stretch, tied  # noqa: E402

#: Kinds of slave and master, and cells along a side of each.
SIDES = [(("C3D8", "C3D8"), (3, 2)), (("C3D4", "C3D8"), (3, 2)), (("C3D8", "C3D10"), (3, 2)), (("C3D10", "C3D8"), (2, 3)),
         (("C3D10", "C3D10"), (3, 2)), (("C3D20", "C3D8"), (2, 3)), (("C3D20", "C3D20"), (3, 2)),
         (("C3D20R", "C3D10"), (2, 3)), (("C3D10", "C3D20R"), (3, 2))]
SHAKES = (0.0, 0.1, 0.25)
TURNS = 30
#: Cells across the two halves; one of them alone: one mesh.
BARS = [(4,), (6,), (4, 4), (4, 6), (6, 4)]


def start_patch(runs):
    started = {}
    for (slave, master), (n, m) in SIDES:
        for shake in SHAKES:
            lower = shaken(box(master, (m,)*3, (0, 0, 0), (1, 1, .5)), 0.5, shake)
            upper = shaken(box(slave, (n,)*3, (0, 0, .5), (1, 1, 1)), 0.5, shake)
            text, x = tied([lower, upper], [(1, 0, 2)])
            started[slave, master, shake] = runs.start(Deck(text + stretch(x))), len(x)
    return started


def report_patch(started, _):
    rows = []
    for (slave, master), (n, m) in SIDES:
        off = []
        for shake in SHAKES:
            run, n_node = started[slave, master, shake]
            stress = run.result().fields()["cauchy_stress"][-1].reshape(n_node, -1)
            exact = np.zeros_like(stress)
            exact[:, 2] = 1.0
            off.append(size(np.abs(stress - exact).max()))
        rows.append((f"`{slave}`", f"`{master}`", f"{n} on {m}", *off))
    return table(["slave", "master", "cells", *(f"moved by {100*s/2:g} %" if s else "as they are" for s in SHAKES)], rows)


def disc(low, high):
    """A unit cube as a round bar of radius 1/2 from z = low to high."""
    def place(x):
        p = 2*x[:, :2] - 1
        most, length = np.abs(p).max(1)[:, None], np.linalg.norm(p, axis=1)[:, None]
        length[length == 0] = 1.0
        return np.column_stack([0.35*(1 - most)*p + 0.5*most*most/length*p, low + (high - low)*x[:, 2]])
    return place


def twisted(cells):
    """A bar of length 6 whose ends are turned against each other and back, an increment for each part; then one is set free."""
    ends = np.linspace(0.0, 6.0, len(cells) + 1)
    blocks = [straight(Block("C3D8", (n, n, 24//len(cells)), place=disc(*ends[i:i + 2]))) for i, n in enumerate(cells)]
    text, x = tied(blocks, [(1, 0, 2)] if len(cells) > 1 else [], RUBBER)
    if len(cells) == 1:
        text = text[:text.index("*TIE")]
    text += "*BOUNDARY\n" + "".join(f"{k}, 1, 3\n" for k in np.flatnonzero(x[:, 2] < 1e-9) + 1)
    top = np.flatnonzero(x[:, 2] > 6 - 1e-9)
    for i in [*range(1, TURNS + 1), *range(TURNS - 1, -1, -1)]:
        angle = 2*np.pi*i/TURNS
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        u = x[top, :2] @ turn.T - x[top, :2]
        text += "*STEP, NLGEOM\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\n" + "".join(
            f"{k + 1}, 1, 1, {float(a)!r}\n{k + 1}, 2, 2, {float(b)!r}\n{k + 1}, 3, 3\n" for k, (a, b) in zip(top, u, strict=True))
        text += "*NODE FILE, FREQUENCY=100\nU\n*END STEP\n"
    text += "*STEP, NLGEOM\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY, OP=NEW\n" + "".join(
        f"{k}, 1, 3\n" for k in np.flatnonzero(x[:, 2] < 1e-9) + 1)
    return Deck(text + "*NODE FILE\nU\n*END STEP\n"), x


def start_bar(runs):
    started = {}
    for cells in BARS:
        deck, x = twisted(cells)
        started[cells] = runs.start(deck), x
    return started


def report_bar(started, _):
    """The torque is the slope of the strain energy over the angle, the drift that of the middle from the axis.

    What is left after all is free again is told along the axis, where it would add up, by the length."""
    found, rows = {}, []
    for cells in BARS:
        run, x = started[cells]
        done = run.result()
        w = np.asarray(done.history["strain"])[TURNS - 2:TURNS + 1]
        found[cells] = (3*w[2] - 4*w[1] + w[0])/(2*2*np.pi/TURNS)
        middle = np.abs(x[:, 2] - 3) < 1e-9
        fields = done.fields()
        turned = int(np.argmin(np.abs(np.array(fields.time) - TURNS)))
        drift = np.abs(fields["displacement"][turned][middle, :2].mean(0)).max()
        left = np.abs(fields["displacement"][-1][:, 2]).max()/6
        # Two halves in series: their angles add up.
        series = len(cells)/sum(1/found[(n,)] for n in cells)
        rows.append((" and ".join(f"{n} x {n}" for n in cells), f"{found[cells]:.5f}",
                     f"{100*(found[cells]/series - 1):+.2f} %" if len(cells) > 1 else "", size(drift), size(left)))
    return table(["cells across", "torque", "difference from two halves in series", "drift of the middle", "along the axis, unloaded"], rows)


CHAPTERS = [Chapter("ties_space_patch", start_patch, report_patch), Chapter("ties_space_bar", start_bar, report_bar)]
