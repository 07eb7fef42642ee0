"""Every knob of a run turned by itself, on scenes of the plane and of space: what it costs and what it changes.

    .venv/bin/python tests/bench/trade_knobs.py [--update] [words of the names of scenes]

Writes a table between the marks `knobs` of docs/trade.md. Errors are those against the same mesh with
increments sixteen times as small and massless surfaces. Runs are kept in build/trade/PROGRAM: what was
interrupted goes on.
"""

import argparse
import pathlib
import re

import numpy as np
from trade import (NTS, PROGRAM, ball, bowl, drift, drawn, force_of, impulse_of, massive,
                   percent, space_ball, space_bars, space_cube, write)

from book.common import size, table  # isort: skip, `trade` says where
from book.forces import switches
from kept_runs import folder_of, name_of, run_once
from scene_tools import DECKS, Deck

SINGLE = PROGRAM.parent.parent / "release-single" / "emcon"


def knobbed(deck):
    """`deck` with `scheme` and `newton` among its parameters."""
    text = deck.text()
    if "TYPE=<newton>" not in text:
        for head in ("*NEWTON, TOLERANCE=<tolerance>\n", "*NEWTON\n"):
            text = text.replace(head, "")
        text = text.replace("*CONTACT INITIATION, TYPE=<initiation>\n",
                            "*CONTACT INITIATION, TYPE=<initiation>\n*NEWTON, TYPE=<newton>, "
                            "TOLERANCE=<tolerance>, POLISH=<polish>\n")
        text = text.replace("*PARAMETER\n", "*PARAMETER\nnewton = KEPT\npolish = YES\n", 1)
        if "\ntolerance = " not in text:
            text = text.replace("*PARAMETER\n", "*PARAMETER\ntolerance = 1e-10\n", 1)
    if "SCHEME=<scheme>" not in text:
        text = text.replace("*CONTACT INITIATION, TYPE=<initiation>\n", "*TIME INTEGRATION, "
                            "SCHEME=<scheme>\n*CONTACT INITIATION, TYPE=<initiation>\n")
        text = text.replace("*PARAMETER\n", "*PARAMETER\nscheme = ENERGY MOMENTUM\n", 1)
    return Deck(text)


def from_file(name):
    return lambda: knobbed(massive(DECKS / f"{name}.inp"))


def plain(scene, body):
    return lambda: knobbed(drawn(scene, body, None)("elastic"))


#: Name, deck, parameters of the default run; `reference` of what it is held against: massless surfaces, and of
#: coarse bodies in space, which would move most of their mass, what `AUTO` takes for them.
SCENES = (
    ("ring on a foundation", from_file("ring"), {**NTS, "h": 0.02, "t_end": 4.0, "frame": 4.0}),
    ("bouncing bar", from_file("bouncing_bar"),
     {**NTS, "h": 0.005, "t_end": 5.3, "frame": 5.3}),
    ("tied ring", from_file("tied_ring"), {**NTS, "h": 0.02, "t_end": 4.0, "frame": 4.0}),
    ("ball on a block", plain(ball, "BLOCK"), {**NTS, "h": 0.01}),
    ("disc in a bowl", plain(bowl, "BOWL"), {**NTS, "h": 0.01}),
    ("in space: ball on a plate", plain(space_ball, "PLATE"), {**NTS, "h": 0.01}),
    ("in space: cube on a plate", plain(space_cube, "PLATE"), {**NTS, "h": 0.01, "reference": "AUTO"}),
    ("in space: bars, edge on edge", plain(space_bars, "LOWER"), {**NTS, "h": 0.01, "reference": "AUTO"}),
)
MORTAR = {"formulation": "MORTAR"}


def explicit(method):
    """A deck by central differences, contact closed exactly or by `method`."""

    def change(deck):
        text = deck.text().replace("*DYNAMIC, DIRECT", "*DYNAMIC, DIRECT, EXPLICIT")
        for card in ("NEWTON", "CONTACT INITIATION", "TIME INTEGRATION", "CONSTRAINT METHOD"):
            text = re.sub(rf"\*{card}[^\n]*\n", "", text)
        return Deck(text.replace("*NODE FILE", method + "*NODE FILE"))

    return change


#: Steps that are told to be so much of the critical one; impacts make elements faster.
SHARE = 0.9
EXPLICIT = {"deck": explicit(""), "share": SHARE}
EXPLICIT_PENALTY = {"deck": explicit("*CONSTRAINT METHOD, TYPE=PENALTY\n"), "share": SHARE}

#: Text, what changes: parameters (h as a factor), or the program.
KNOBS = (
    ("default", {}),
    ("h, twice", {"h": 2.0}), ("h, half", {"h": 0.5}), ("h, a quarter", {"h": 0.25}),
    ("`SCHEME=MIDPOINT`", {"scheme": "MIDPOINT"}),
    ("`SCHEME=TRAPEZOIDAL`", {"scheme": "TRAPEZOIDAL"}),
    ("`SCHEME=GENERALIZED ALPHA`", {"scheme": "GENERALIZED ALPHA"}),
    ("`SCHEME=BDF2`", {"scheme": "BDF2"}),
    ("`SCHEME=ENERGY DECAYING`", {"scheme": "ENERGY DECAYING"}),
    ("`ADMISSIBLE`", {"initiation": "ADMISSIBLE"}),
    ("`VELOCITY UPDATE`", {"initiation": "VELOCITY UPDATE"}),
    ("`MASSLESS`", {"initiation": "MASSLESS"}),
    ("`MASSLESS`, h, half", {"initiation": "MASSLESS", "h": 0.5}),
    ("`SIDES=ONE`", {"formulation": "'NODE TO SURFACE, SIDES=ONE'"}),
    ("`SIDES=BOTH`", {"formulation": "'NODE TO SURFACE, SIDES=BOTH'"}),
    ("`EDGES=NO`", {"formulation": "'NODE TO SURFACE, EDGES=NO'"}),
    ("`SEGMENT`", {"formulation": "SEGMENT"}), ("`MORTAR`", MORTAR),
    ("`MORTAR`, `STANDARD`", {**MORTAR, "multiplier": "STANDARD"}),
    ("`HERMITE`", {"smoothing": "HERMITE"}),
    ("`*NEWTON, TYPE=FULL`", {"newton": "FULL"}),
    ("`POLISH=NO`, 1e-8", {"polish": "NO", "tolerance": "1e-8"}),
    ("`SADDLE POINT`", {"method": "SADDLE POINT"}),
    ("`PENALTY`", {"method": "PENALTY"}),
    ("`PENALTY, FACTOR=10`", {"method": "'PENALTY, FACTOR=10'"}),
    ("`AUGMENTED LAGRANGE`", {"method": "AUGMENTED LAGRANGE"}),
    ("`EXPLICIT`", EXPLICIT), ("`EXPLICIT`, `PENALTY`", EXPLICIT_PENALTY),
    ("`PRECISION=single`", {"program": SINGLE}),
)
#: Knobs that only the plane has, or only space.
OF_PLANE = {"`SEGMENT`", "`MORTAR`", "`MORTAR`, `STANDARD`", "`HERMITE`"}
OF_SPACE = {"`EDGES=NO`", "`SIDES=ONE`", "`SIDES=BOTH`"}


def knobs_of(deck):
    """Those that a deck has, by its dimension."""
    others = OF_PLANE if "TYPE=C3D" in deck.text() else OF_SPACE
    return [(knob, change) for knob, change in KNOBS if knob not in others]


def run_of(deck, folder, parameters, change):
    """The run, or None if the program stopped, and what it took."""
    change = dict(change)
    program = change.pop("program", PROGRAM)
    deck = change.pop("deck", lambda own: own)(deck)
    share = change.pop("share", None)
    merged = {**parameters, **change}
    if "h" in change:
        merged["h"] = parameters["h"]*change["h"]
    if share:
        merged["h"] = share*critical_step(deck, folder.with_name(folder.name + "-limit"), merged)
    run, done = run_once(folder, deck, merged, program)
    is_whole = done.code in (0, 3) and "the analysis stops" not in done.errors
    return (run if is_whole else None), done


def stop_of(errors):
    """When a run stopped, by what it said last."""
    time = re.search(r"the analysis stops at time ([-+.0-9E]+)", errors)
    return f"stops at time {float(time[1]):.3g}" if time else "is refused"


def critical_step(deck, folder, parameters):
    """What the program says of an increment as long as the run."""
    t_end = parameters.get("t_end") or re.search(r"^t_end = (\S+)", deck.text(), re.MULTILINE)[1]
    _, done = run_once(folder, deck, {**parameters, "h": t_end})
    return float(re.search(r"the critical step ([-+.0-9E]+)", done.errors)[1])


def figures_of(run, reference):
    """Displacements, impulse and forces (means over a fiftieth of the run) against the reference."""
    u, exact = (r.fields()["displacement"][-1] for r in (run, reference))
    place = np.linalg.norm(u - exact)/np.linalg.norm(exact)
    impulse, full = impulse_of(run.history), impulse_of(reference.history)
    means = []
    for r in (run, reference):
        history = r.history
        time = history["time"]
        total = np.cumsum(np.linalg.norm(force_of(history, 1)[1], axis=0)*np.diff(time))
        means.append(np.diff(np.interp(np.linspace(0, time[-1], 51), time[1:], total)))
    force = np.linalg.norm(means[0] - means[1])/np.linalg.norm(means[1])
    along = np.linalg.norm(force_of(run.history, 1)[1], axis=0)
    return (percent(place), percent(np.linalg.norm(impulse - full)/np.linalg.norm(full)),
            percent(force), switches(along), size(drift(run.history)))


def lines_of(name, make, parameters, rounds):
    """Rows of a scene; the processor time is the least of the rounds, over that of the default."""
    deck, cost, kept = make(), {}, {}
    folder = folder_of("knobs")
    parameters = dict(parameters)
    initiation = parameters.pop("reference", "MASSLESS")
    reference, done = run_of(deck, folder / name_of(name, "reference"), parameters,
                             {"h": 1/16, "initiation": initiation})
    assert reference, done.errors
    for k in range(rounds):
        for knob, change in knobs_of(deck):
            if not pathlib.Path(change.get("program", PROGRAM)).exists():
                continue
            if "share" in change and k > 0:              # of thousands of increments once is enough
                continue
            run, done = run_of(deck, folder / name_of(name, knob, k), parameters, change)
            cost.setdefault(knob, []).append(done.cpu)
            if k == 0:
                kept[knob] = figures_of(run, reference) if run else (
                    stop_of(done.errors), "", "", "", "")
    first = min(cost["default"])
    return [(name, knob, f"{min(cost[knob])/first:.2f}", *found) for knob, found in kept.items()]


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
    lines = table(["scene", "knob", "CPU", "displacements", "impulse", "forces", "switches",
                   "energy"], lines)
    print(*lines, sep="\n")
    if options.update:
        write("knobs", lines)


if __name__ == "__main__":
    main()
