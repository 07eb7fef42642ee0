"""Twins: a run in which somebody asks, saves, loads and goes back is the run in which nobody does.

    .venv/bin/python tests/soak/twins.py [--seeds 3] [--first 1] [--only NAME]

Every deck of input_decks, in the formulations that it can be given, goes on by steps of random
sizes, 1e-3 to 1 times its own; between any two of them its twin is asked, writes output, is saved,
loaded, or makes a step of another size and goes back. What is the same: every increment as it is
reported, and in the end displacements, velocities and multipliers, to the last bit.
"""

import argparse
import contextlib
import pathlib
import random
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from scene_tools import DECKS, Deck  # noqa: E402

import emcon  # noqa: E402
from emcon import AnalysisError, Stepper  # noqa: E402

#: Increments of the deck before the random steps, at most; and how many of these.
MOST_BEFORE, STEPS = 25, 8
#: The same of decks whose increments take seconds each.
FEWER = {"hertz": (2, 3), "roller": (2, 3), "ironing": (8, 4)}
FORMULATIONS = (
    {},
    {"formulation": "NODE TO SURFACE", "sides": "BOTH"},
    {"formulation": "SEGMENT"},
    {"formulation": "MORTAR"},
    {"smoothing": "HERMITE"},
    {"initiation": "MASSLESS"},
    {"initiation": "ADMISSIBLE"},
)


# ---- what may come between two steps ------------------------------------------------------------


def ask(stepper, chance, folder):
    """One of the questions that a stepper answers."""
    name = chance.choice(("contact", "pressures", "gaps", "pairs", "friction", "verdict", "ledger",
                          "energies", "momenta", "report", "body_momenta", "mass", "u",
                          "lam"))  # fmt: skip
    getattr(stepper, name)() if callable(getattr(type(stepper), name)) else getattr(stepper, name)
    return stepper


def evaluate(stepper, chance, folder):
    """The residual and the tangent of a step that is not made."""
    h = 10.0**chance.uniform(-3, 0)*stepper_size(stepper)
    with contextlib.suppress(AnalysisError, emcon.InputError):   # friction is not evaluated
        stepper.evaluate(stepper.guess(h), h).residual()
    return stepper


def look(stepper, chance, folder):
    """Gaps of bodies that are somewhere else."""
    stepper.constraint(u0=stepper.u, u1=stepper.u + chance.uniform(-1, 1))
    return stepper


def write(stepper, chance, folder):
    """Output of the present state, as its deck asks for it."""
    stepper.run(until=stepper.time, output=folder/"output")
    return stepper


def save(stepper, chance, folder):
    stepper.write_restart(folder/"twin.rst.h5")
    return stepper


def load(stepper, chance, folder):
    save(stepper, chance, folder).close()
    return Stepper.from_restart(folder/"twin.rst.h5")


def go_back(stepper, chance, folder):
    """A step of another size that is not kept."""
    before = stepper.save()
    with contextlib.suppress(AnalysisError):
        stepper.step(10.0**chance.uniform(-3, 0.5)*stepper_size(stepper))
    stepper.restore(before)
    return stepper


def keep(stepper, chance, folder):
    stepper.restore(stepper.save())
    return stepper


WAYS = (ask, ask, evaluate, look, write, save, load, go_back, go_back, keep)


def stepper_size(stepper):
    """A size of a step, as the run had so far."""
    return max(stepper.time, 1e-30)/20


# ---- two runs -----------------------------------------------------------------------------------


def advance(stepper, h, is_own):
    """One increment, of the deck or of size h, as it is told; or why it fails."""
    try:
        return stepper.step(None if is_own else h)
    except AnalysisError as error:
        return str(error)


def final(stepper):
    return [np.array(a) for a in (stepper.u, stepper.v, stepper.lam, stepper.active)]


def run(model, plan, folder=None, seed=0):
    """Increments and the end of one run; with a folder that of the twin."""
    stepper, told, ways, size = Stepper(model), [], [[]], 0.0
    chance = random.Random(seed)
    for is_own, factor in plan:
        if folder is not None:
            for _ in range(chance.randint(0, 2)):
                way = chance.choice(WAYS)
                ways[-1].append(way.__name__)
                stepper = way(stepper, chance, folder)
        if stepper.is_done and is_own:
            break
        told.append(advance(stepper, factor*size, is_own))
        if is_own and isinstance(told[-1], str):
            break
        size = size or told[-1].h
        ways.append([])
    end = final(stepper)
    stepper.close()
    return told, end, ways


def differ(model, seed, folder, before=None, steps=STEPS, largest=1.0):
    """Where the twins part, in words; "" if they do not.

    `before` increments of the deck at first, then `steps` up to `largest` times their size.
    """
    chance = random.Random(seed)
    plan = [(True, 0.0)]*(before or 1 + chance.randint(0, MOST_BEFORE))
    # Small steps after large ones: what a large one left behind would show there.
    plan += [(False, largest*10.0**chance.choice((chance.uniform(-0.5, 0), chance.uniform(-3, -1))))
             for _ in range(steps)]
    told, end, _ = run(model, plan)
    twin, twin_end, ways = run(model, plan, folder, seed)
    for k, (mine, its) in enumerate(zip(told, twin, strict=False)):
        if repr(mine) != repr(its):
            return (f"increment {k + 1} of {len(plan)}, after {ways[:k + 1][-4:]}:\n"
                    f"  {mine}\n  {its}")
    if len(told) != len(twin):
        return f"{len(told)} increments, the twin {len(twin)}"
    for name, mine, its in zip(("u", "v", "lam", "active"), end, twin_end, strict=True):
        if mine.tobytes() != its.tobytes():
            return f"{name} at the end, by {abs(mine*1.0 - its).max():.3g}"
    return ""


# ---- decks --------------------------------------------------------------------------------------


def differ_of(path, model, seed, folder):
    """`differ` with as many increments as the deck at `path` has time for."""
    if path.stem not in FEWER:
        return differ(model, seed, folder)
    before, steps = FEWER[path.stem]
    return differ(model, seed, folder, 1 + seed % before, steps)


def variants():
    """All decks, in the formulations that they have parameters for: name, Model maker."""
    for path in sorted(DECKS.glob("*.inp")):
        names = Deck.read(path).text()
        for extra in FORMULATIONS:
            if any(f"<{name}>" not in names for name in extra):
                continue
            words = [path.stem, *(f"{name}={value}" for name, value in extra.items())]
            yield " ".join(words), path, extra


def fuzz_twins(chance, folder):
    """A deck by chance, in a formulation by chance."""
    name, path, extra = chance.choice(list(variants()))
    try:
        model = emcon.Model.from_deck(path, **extra)
        Stepper(model).close()
    except emcon.InputError:
        return                                     # this formulation is not for this deck
    where = differ_of(path, model, chance.randrange(10**6), folder)
    assert not where, f"{name}: {where}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    n_bad = 0
    for name, path, extra in variants():
        if options.only not in name:
            continue
        for seed in range(options.first, options.first + options.seeds):
            with tempfile.TemporaryDirectory() as folder:
                model = emcon.Model.from_deck(path, **extra)
                try:
                    Stepper(model).close()
                except emcon.InputError as error:
                    print(f"{name}: refused: {str(error)[:100]}")
                    break
                where = differ_of(path, model, seed, pathlib.Path(folder))
            n_bad += bool(where)
            print(f"{name}, seed {seed}: {where or 'the same'}", flush=True)
    return min(n_bad, 1)


if __name__ == "__main__":
    sys.exit(main())
