"""Impacts of two bodies in space, drawn by a seed, beside what is right: energy, momenta, overlap.

    .venv/bin/python tests/soak/space_scenes.py [--seeds 1 100] [--folder build/soak-space]

Balls and boxes of all kinds of elements, in half of the scenes flat on each other with nodes on nodes. The exit code is
1 where a run is called good and its balance is off or `overlap.py` finds what the program does not. What stops, and what
is called bad, is counted: edges that cross between nodes are not held.
"""

import argparse
import pathlib
import random
import re
import signal
import subprocess
import sys

import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1]), str(pathlib.Path(__file__).resolve().parents[1] / "scenes")]

import overlap  # noqa: E402
from contact_space_scenes import ball, bodies, dynamic, faces, pair, straight, velocities  # noqa: E402
from scene_tools import CRASH, PROGRAM, Run  # noqa: E402
from space_mesh import KINDS, Block  # noqa: E402

#: Seconds of a processor that a run may take.
PATIENCE = 60
#: Energy and momenta, of the largest of each.
BALANCE = 1.0e-10
#: What a program may leave out of an overlap, by the edge: it looks at facets, the judge too, by another way.
UNSEEN = 1.0e-3
#: What of the straight way of an increment may lead past a corner, by the edge (docs/theory.md, 4.11).
CORNER = 0.1
WAYS = ["", "", "", "*CONSTRAINT METHOD, TYPE=SADDLE POINT\n", "*CONSTRAINT METHOD, TYPE=PENALTY\n", "*NEWTON, TYPE=FULL\n"]


def rotation(draw):
    turn, _ = np.linalg.qr(draw.normal(size=(3, 3)))
    return turn*np.sign(np.linalg.det(turn))


def body(chance, draw, is_plain, is_second):
    """A block, and whether all of its outline is its surface."""
    kind = chance.choice(KINDS)
    most = 2 if kind in ("C3D10", "C3D20", "C3D20R") else 3
    is_ball = not is_plain and chance.random() < 0.5
    cells = (chance.randint(1, most),)*3 if is_ball else tuple(chance.randint(1, most) for _ in range(3))
    size = (2.0, 2.0, 2.0) if is_ball else (1.0, 1.0, 1.0) if is_plain else tuple(chance.uniform(0.6, 1.6) for _ in range(3))
    turn = np.eye(3) if is_plain else rotation(draw)
    block = Block(kind, cells, size=size)
    x = ball(block.x) if is_ball else block.x - 0.5*np.array(size)
    block.x = x @ turn.T
    straight(block)
    return block


def scene(seed):
    """The text of a deck."""
    chance, draw = random.Random(f"space {seed}"), np.random.default_rng(seed)
    is_plain = seed % 2 == 0
    one, two = body(chance, draw, is_plain, False), body(chance, draw, is_plain, True)
    gap = chance.choice([0.0, 0.01, 0.05]) if is_plain else chance.uniform(0.01, 0.1)
    shift = np.zeros(3)
    if not (is_plain and chance.random() < 0.5):
        shift[:2] = draw.uniform(-0.3, 0.3, 2)
    one.x += shift
    one.x[:, 2] += two.x[:, 2].max() - one.x[:, 2].min() + gap
    way = np.array([chance.choice([0.0, 0.3]), chance.choice([0.0, -0.2]), -1.0])
    spin = draw.normal(size=3)*chance.choice([0.0, 0.0, 1.0])
    sides = [list(one.outer_faces()), list(two.outer_faces())]
    if is_plain and chance.random() < 0.5:
        sides = [faces(one, 2, 0), faces(two, 2, 1)]
    return (bodies([one, two], sides) + pair(chance.choice(["", "", ", SIDES=ONE"])) + velocities(one, way, spin)
            + dynamic(chance.choice([0.01, 0.02, 0.04]), 0.6, chance.choice(WAYS)))


def deepest_overlap(run):
    """At the ends of increments, and past a corner on the straight ways between of those that were not cut: the parts of
    others, which no file has, are not on these."""
    fields, bodies = run.fields(), overlap.bodies_of(run.fields())
    x = fields.x + fields["displacement"]
    cut = [i for i in range(1, len(x)) if run.history["cuts"][i] > 0]
    found = []
    for a, b in zip([0, *cut], [*cut, len(x)], strict=True):
        at_frame, on_way = bodies.looks(x[a:b], fields.time[a:b])
        found += at_frame + [look for look in on_way if look.by_edge > CORNER]
    return max(found)


def judge(run, _deck):
    """What is wrong with a run that is called good."""
    history, found = run.history, []
    if np.ptp(history["total"]) > BALANCE*history["total"].max():
        found.append("energy")
    p = np.array([history[k] for k in ("px", "py", "pz")])
    angular = np.array([history[k] for k in ("lx", "ly", "lz")])
    if np.abs(p - p[:, :1]).max() > BALANCE*np.abs(p).max() or np.abs(angular - angular[:, :1]).max() > BALANCE*max(
            np.abs(angular).max(), np.abs(p).max()):
        found.append("momentum")
    deepest = deepest_overlap(run)
    if deepest.by_edge > run.verdict["penetration"] + UNSEEN:
        found.append(f"overlap {deepest.by_edge:.3g}, told {run.verdict['penetration']:.3g}")
    return found


def run_scenes(scene, judge, seeds, folder, words=()):
    """Run what is drawn, count the verdicts, and say what is wrong; the exit code. `scene` is told of `words`."""
    parser = argparse.ArgumentParser()
    for word in words:
        parser.add_argument(f"--{word}", action="store_true")
    parser.add_argument("--seeds", type=int, nargs=2, default=seeds)
    parser.add_argument("--folder", type=pathlib.Path, default=pathlib.Path(folder))
    chosen = parser.parse_args()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    count, wrong, cuts, newton, steps = {}, 0, 0, 0, 0
    for seed in range(chosen.seeds[0], chosen.seeds[1] + 1):
        deck = chosen.folder/f"scene{seed}.inp"
        deck.write_text(scene(seed, **{word: getattr(chosen, word) for word in words}))
        done = subprocess.run(["sh", "-c", f'ulimit -t {PATIENCE}; exec "$@"', "sh", PROGRAM, deck, "--quiet"],
                              capture_output=True, text=True, check=False)
        if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
            word, why = "time limit", []
        else:
            said = done.stdout + done.stderr
            if CRASH.search(said) or done.returncode not in (0, 3):
                word, why = "refused" if done.returncode == 2 and not CRASH.search(said) else "CRASH", [said[-200:]]
                wrong += word == "CRASH"
            else:
                run = Run(deck.with_suffix(""), done.stderr)
                word, why = run.verdict["verdict"], run.verdict["reasons"] + [run.verdict["message"]]
                cuts, newton = cuts + run.verdict["cuts"], newton + run.verdict["newton"]
                steps += run.verdict["increments"]
                if word == "good":
                    why = judge(run, deck.read_text())
                    wrong += bool(why)
        count[word] = count.get(word, 0) + 1
        if word != "good" or why:
            print(seed, word, re.sub(r"\s+", " ", "; ".join(filter(None, why)))[:230], flush=True)
    print(count, f"cuts {cuts}, Newton {newton/max(steps, 1):.2f} an increment, {wrong} wrong")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(run_scenes(scene, judge, (1, 100), "build/soak-space"))
