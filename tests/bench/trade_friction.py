"""What friction costs, and what its knobs change: a block that slides to rest, and a ring.

    .venv/bin/python tests/bench/trade_friction.py [--update] [--rounds N]

Writes a table between the marks `friction` of docs/trade.md. Runs are kept in build/trade/PROGRAM: what was
interrupted goes on.
"""

import argparse

import numpy as np
from trade import NTS, PAGE, percent

from book.common import size, table  # isort: skip, `trade` says where
from friction_scenes import balance, block_on_floor, ring
from kept_runs import folder_of, name_of, run_once
from scene_tools import Deck
from verification import update

FRICTION = "*FRICTION\n"


def with_friction(mu):
    """The deck with another coefficient; None: without the card."""

    def change(deck):
        text = deck.text()
        k = text.index(FRICTION)
        end = text.index("\n", k + len(FRICTION)) + 1
        return Deck(text[:k] + (f"{FRICTION}{mu!r}\n" if mu is not None else "") + text[end:])

    return change


def replaced(old, new):
    return lambda deck: Deck(deck.text().replace(old, new))


def damped(eta):
    """Kelvin-Voigt damping of all bodies by `eta`, or none."""

    def change(deck):
        lines = deck.text().splitlines()
        kept = [line for line in lines if not line.startswith("*DAMPING")]
        if eta:
            for k in range(len(kept) - 1, -1, -1):
                if kept[k].startswith("*MATERIAL"):
                    kept.insert(k + 1, f"*DAMPING, BETA={eta!r}")
        return Deck("\n".join(kept) + "\n")

    return change


#: Name, deck, parameters of the default run, coefficient, damping.
SCENES = (
    ("block that slides to rest", lambda: block_on_floor(0.01, 0.72, 0.3, v0=2.0, eta=2e-3),
     {**NTS, "h": 0.01}, 0.3, 2e-3),
    ("ring on a free block", lambda: ring(0.8), {**NTS, "h": 0.01, "t_end": 1.0, "sides": "ONE"},
     0.8, 0.0),
)


def knobs(mu, eta):
    """Text, and what changes: parameters (h as a factor), or the deck."""
    return (
        ("default", {}),
        ("without friction", {"deck": with_friction(None)}),
        ("mu, half", {"deck": with_friction(0.5*mu)}), ("mu, twice", {"deck": with_friction(2*mu)}),
        ("h, twice", {"h": 2.0}), ("h, half", {"h": 0.5}), ("h, a quarter", {"h": 0.25}),
        ("`RESTITUTION=1`", {"deck": replaced(FRICTION, "*FRICTION, RESTITUTION=1\n")}),
        (("undamped", {"deck": damped(0.0)}) if eta else
         ("`BETA=2e-3`", {"deck": damped(2e-3)})),
        ("`SEGMENT`", {"formulation": "SEGMENT"}), ("`MORTAR`", {"formulation": "MORTAR"}),
        ("`SIDES=BOTH`", {"deck": replaced(", SIDES=ONE", ", SIDES=BOTH"), "sides": "BOTH"}),
        ("`ADMISSIBLE`", {"initiation": "ADMISSIBLE"}),
        ("`SADDLE POINT`", {"method": "SADDLE POINT"}),
    )


def run_of(deck, folder, parameters, change):
    """The run, and what it took."""
    change = dict(change)
    deck = change.pop("deck", lambda own: own)(deck)
    merged = {**parameters, **change}
    merged["h"] = parameters["h"]*change.get("h", 1.0)
    if "sides" not in parameters:
        merged.pop("sides", None)
    run, done = run_once(folder, deck, merged)
    assert done.code in (0, 3), done.errors
    return run, done


def lines_of(name, make, parameters, mu, eta, rounds):
    """Rows of a scene; displacements at the end against the default in increments a sixteenth."""
    folder, deck = folder_of("friction"), make()
    reference, _ = run_of(deck, folder / name_of(name, "reference"), parameters, {"h": 1/16})
    exact = reference.fields()["displacement"][-1]
    cost, kept = {}, {}
    for k in range(rounds):
        for knob, change in knobs(mu, eta):
            run, done = run_of(deck, folder / name_of(name, knob, k), parameters, change)
            cost.setdefault(knob, []).append(done.cpu)
            if k:
                continue
            history, u = run.history, run.fields()["displacement"][-1]
            kept[knob] = (f"{history['newton'][1:].mean():.1f}", int(history["cuts"].sum()),
                          percent(np.linalg.norm(u - exact)/np.linalg.norm(exact)),
                          f"{history['friction_loss'][-1]:.4f}", f"{history['damping_loss'][-1]:.4f}",
                          size(balance(history)), size(run.verdict.get("law_violation", 0.0)))
    first = min(cost["default"])
    return [(name, knob, f"{min(cost[knob])/first:.2f}", *found) for knob, found in kept.items()]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--update", action="store_true", help="write into docs/trade.md")
    parser.add_argument("--rounds", type=int, default=1, help="runs of each (1)")
    options = parser.parse_args()
    lines = table(["scene", "knob", "CPU", "Newton", "cuts", "displacements", "dissipated by friction",
                   "by damping", "energy", "law"],
                  [line for scene in SCENES for line in lines_of(*scene, options.rounds)])
    print(*lines, sep="\n")
    if options.update:
        PAGE.write_text(update(PAGE.read_text(), "friction", lines))


if __name__ == "__main__":
    main()
