"""Kinds of elements and meshes in space: what they cost, and what they change.

    .venv/bin/python tests/bench/trade_kinds.py [--update] [words of the names of scenes]

A bar on two supports that a block is pressed on, in statics, and a ball that falls on a plate. Each is compared with
the finest mesh of C3D20. Writes a table between the marks `kinds` of docs/trade.md. Runs are kept in
build/trade/PROGRAM: what was interrupted goes on.
"""

import argparse

import numpy as np
from trade import AUTO, NTS, Scene, drift, force_of, impulse_of, percent, write

from book.common import size, table  # isort: skip, `trade` says where
from kept_runs import folder_of, name_of, run_once

#: Kinds, and how many elements across: of quadratic ones half as many have as many nodes.
LINEAR, QUADRATIC = ("C3D4", "C3D8", "C3D8I", "C3D8H"), ("C3D10", "C3D20", "C3D20R")
MESHES = [(kind, n) for kind in LINEAR for n in (2, 4)] + [(kind, n) for kind in QUADRATIC for n in (1, 2)]
REFERENCE = ("C3D20", 3)


def bridge(kind, n):
    """A bar that rests on its ends; a block is pressed on its middle, and bends it by a third of its height."""
    scene = Scene(0.25, 1.0)
    scene.block("BLOCK", (-0.15, -0.2, 0.15), (0.3, 0.4, 0.3), (n, n, n), kind=kind, stiffness=1000.0)
    scene.block("BAR", (-1.0, -0.3, -0.15), (2.0, 0.6, 0.3), (6*n, 2*n, n), kind=kind)
    scene.hold("BAR", lambda x, y, z: abs(x) > 0.999)
    scene.hold("BLOCK", lambda x, y, z: z > 0.449, "1, 2")
    scene.hold("BLOCK", lambda x, y, z: z > 0.449, "3, 3", -0.1)
    deck = scene.deck(AUTO)
    deck.replace("*DYNAMIC, DIRECT\n<h>, <t_end>", "*STATIC\n<h>, <t_end>")
    deck.remove("*CONTACT INITIATION")
    return deck


def impact(kind, n):
    """A block falls flat on a free one, askew, with unlike meshes."""
    scene = Scene(0.01, 0.6)
    scene.block("UPPER", (0.1, 0.05, 0.02), (0.8, 0.8, 1.0), (n, n, n), kind=kind, velocity=(0.1, 0.0, -1.0))
    scene.block("LOWER", (0, 0, -1.0), (1, 1, 1.0), (n + 1, n + 1, n), kind=kind)
    return scene.deck(AUTO)


SCENES = (("bar that a block is pressed on, static", bridge, {"h": 0.25}),
          ("block on a free block, impact", impact, {**NTS, "h": 0.01}))


def figures_of(run, reference, is_static):
    """Force at the end or impulse, and force over time, against the reference; energy."""
    if is_static:
        found, exact = (force_of(r.history, 1)[1][:, -1] for r in (run, reference))
    else:
        found, exact = impulse_of(run.history), impulse_of(reference.history)
    force, expected = (force_of(r.history, 1 if is_static else 5)[1] for r in (run, reference))
    rms = np.sqrt(np.mean((force - expected)**2)/np.mean(expected**2))
    return (percent(np.linalg.norm(found - exact)/np.linalg.norm(exact)), percent(rms),
            "" if is_static else size(drift(run.history)))


def lines_of(name, make, parameters, rounds):
    folder = folder_of("kinds")
    reference, done = run_once(folder / name_of(name, *REFERENCE), make(*REFERENCE), parameters)
    assert done.code == 0, done.errors
    rows, first = [], None
    for kind, n in MESHES:
        for k in range(rounds):
            run, done = run_once(folder / name_of(name, kind, n, k), make(kind, n), parameters)
            assert done.code in (0, 3), done.errors
            cost = done.cpu if k == 0 else min(cost, done.cpu)
        first = first or cost
        if "the analysis stops" in done.errors:
            rows.append((name, kind, n, "", f"{cost/first:.2f}", "stops", "", "", ""))
            continue
        rows.append((name, f"`{kind}`", n, int(run.closing(r"(\d+) unknowns in step 1")), f"{cost/first:.2f}",
                     *figures_of(run, reference, "static" in name), run.verdict["verdict"]))
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--update", action="store_true", help="write into docs/trade.md")
    parser.add_argument("--rounds", type=int, default=3, help="runs of each (3)")
    parser.add_argument("only", nargs="*", help="words of the names of scenes")
    options = parser.parse_args()
    lines = []
    for name, make, parameters in SCENES:
        if not options.only or any(word in name for word in options.only):
            lines += lines_of(name, make, parameters, options.rounds)
    lines = table(["scene", "element", "across", "unknowns", "CPU", "force at the end, or impulse",
                   "force over time", "energy", "verdict"], lines)
    print(*lines, sep="\n")
    if options.update:
        write("kinds", lines)


if __name__ == "__main__":
    main()
