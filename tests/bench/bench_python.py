"""What Python costs: steps, opening, queries, models of arrays, functions of Python.

Prints tables; asserts nothing. `make bench`, or `.venv/bin/python tests/bench/bench_python.py`;
with `--short` a few calls, to see that all of it runs.
Ratios are medians of pairs that took turns, of CPU seconds; their spread is half the distance of
the quartiles. Orientation: a loop over `step` within 1.03 of the program, opening within 1.1 of
the library's own reading and building.
"""

import json
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile
import time
import tracemalloc

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT/"pywrap"), str(ROOT/"tests")]
sys.path.append(str(ROOT/"tests"/"bench"))

import numpy as np  # noqa: E402
from bench_ring import (  # noqa: E402
    DECKS, END, IS_SHORT, LENGTH, block_text, measure, overrides, table)  # fmt: skip
from timing import ENVIRONMENT  # noqa: E402

RING = DECKS/"ring.inp"
OUTPUT = ("*NODE FILE", "*EL FILE", "*CONTACT FILE", "*CONTACT PRINT", "*RESTART", "*TIME POINTS")


# ---- what is timed in processes of their own ----------------------------------------------------

def run_steps(deck):
    """CPU seconds of the process so far, of opening, of the loop; page faults of the loop."""
    from emcon.stepper import Stepper
    start = time.process_time()
    with Stepper(deck, **LENGTH) as ring:
        opened = time.process_time()
        faults = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
        while not ring.is_done:
            ring.step()
        faults = resource.getrusage(resource.RUSAGE_SELF).ru_minflt - faults
        return start, opened - start, time.process_time() - opened, faults


def in_python(name, *arguments):
    """CPU seconds of a process of Python, and what a function of this file returns in it."""
    command = [sys.executable, __file__, name, *map(str, arguments)] + ["--short"]*IS_SHORT
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, env=ENVIRONMENT, capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return cpu, json.loads(done.stdout)


# ---- pairs --------------------------------------------------------------------------------------

def half_spread(values):
    low, _, high = statistics.quantiles(values, n=4)
    return (high - low)/2


def pairs(first, second, n):
    """Seconds of calls of two functions that take turns, and who begins does as well, (n, 2)."""
    seconds = np.empty((n, 2))
    for k in range(n):
        order = ((0, first), (1, second)) if k % 2 else ((1, second), (0, first))
        for column, function in order:
            seconds[k, column] = function()
    return seconds


def cpu_of(function, count=1):
    """CPU seconds of a call, as a function for `pairs`."""
    def timed():
        start = time.process_time()
        for _ in range(count):
            function()
        return (time.process_time() - start)/count
    return timed


def without_output(folder):
    """The ring deck without requests for output: the program still writes log and history."""
    lines, keeps = [], True
    for line in RING.read_text().splitlines():
        if line.startswith("*") and not line.startswith("**"):
            keeps = not line.startswith(OUTPUT)
        if keeps:
            lines.append(line)
    deck = folder/"silent.inp"
    deck.write_text("\n".join(lines) + "\n")
    return deck


def bench_steps(folder, n=5):
    print(f"Ring scene, h = 0.01, 800 increments: the program and a loop over Stepper.step, "
          f"{n} pairs")
    row = table("files written by the program", "program [s]", "Python [s]", "ratio", "spread",
                "without start", "start [s]", "page faults")  # fmt: skip
    for name, deck in (("all of the deck", RING), ("log and history", without_output(folder))):
        inner, starts, faults = [], [], []

        def program(deck=deck):
            return measure(deck, "--quiet", "--output", folder/"out", *overrides(LENGTH))[0]

        def loop(deck=deck, inner=inner, starts=starts, faults=faults):
            cpu, (start, *work, fault) = in_python("run_steps", deck)
            starts.append(start)
            inner.append(sum(work))
            faults.append(fault)
            return cpu

        seconds = pairs(program, loop, n)
        ratio = seconds[:, 1]/seconds[:, 0]
        row(name, *np.median(seconds, axis=0).tolist(), float(np.median(ratio)),
            half_spread(ratio), float(np.median(inner/seconds[:, 0])), statistics.median(starts),
            int(statistics.median(faults)))  # fmt: skip


def bench_opening(n=41):
    from emcon import _core
    from emcon.stepper import Stepper

    def of_library():
        status, handle = _core.emcon_open(os.fsencode(RING), b"", 0)
        assert status == 0
        _core.emcon_close(handle)

    def of_python():
        Stepper(RING).close()

    print(f"\nOpening the ring deck: emcon_open of the library, and Stepper, "
          f"{n} pairs")
    row = table("library [ms]", "Stepper [ms]", "ratio", "spread", "emcon check [ms]")
    seconds = pairs(cpu_of(of_library), cpu_of(of_python), n)
    ratio = seconds[:, 1]/seconds[:, 0]
    check = statistics.median(measure("check", RING, "--quiet")[0] for _ in range(1 if IS_SHORT else 11))
    row(*(1e3*np.median(seconds, axis=0)).tolist(), float(np.median(ratio)), half_spread(ratio),
        1e3*check)


def new_bytes(function):
    """Bytes that numpy allocates in a call at most, and bytes of what the call returns."""
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    result = function()
    peak = tracemalloc.get_traced_memory()[1] - before
    tracemalloc.stop()
    parts = result if isinstance(result, tuple) else (result,)
    kept = sum(array.nbytes for part in parts for array in
               ([part] if isinstance(part, np.ndarray) else
                [v for v in vars(part).values() if isinstance(v, np.ndarray)] +
                [a for v in vars(part).values() if hasattr(v, "indptr")
                 for a in (v.indptr, v.indices, v.data)]))  # fmt: skip
    return peak, kept


def bench_queries(n=41):
    from emcon import _core
    from emcon.stepper import Stepper
    with Stepper(RING) as ring:
        ring.run(1.0)
        a, n_node = ring._handle.address, ring.n_node
        u, u1 = ring.u, np.ascontiguousarray(ring.guess(0.01))
        none, flags = np.empty(0), np.empty(0, np.int32)

        n_unknown, n_constraint = ring.n_unknown, ring.n_constraint     # there are no ties

        def constraints():
            _core.emcon_constraints(a, u, u1, 0)

        def tangent():
            _core.emcon_evaluate(a, 0.01, u1, 1, n_constraint, none, flags)
            _core.emcon_tangent(a, 1)

        def residual():
            _core.emcon_evaluate(a, 0.01, u1, 0, n_constraint, none, flags)
            _core.emcon_residual(a, 1, n_node, n_unknown)

        calls = {
            "u": (lambda: _core.emcon_get_state(a, n_node), lambda: ring.u),
            "residual": (residual, lambda: ring.residual(u1, 0.01)),
            "tangent": (tangent, lambda: ring.tangent(u1, 0.01)),
            "mass": (lambda: _core.emcon_mass(a), lambda: ring.mass),
            "constraint": (constraints, lambda: ring.constraint(u0=u, u1=u1)),
            "constraint q": (constraints, lambda: ring.constraint(ring.positions + u,
                                                                  ring.positions + u1)),
        }
        print(f"\nQueries of the ring at t = 1: calls of the library and of Stepper, {n} pairs; "
              f"bytes allocated at most over those returned")
        row = table("query       ", "library [us]", "Stepper [us]", "ratio", "kB returned",
                    "bytes/returned")  # fmt: skip
        for name, (bare, whole) in calls.items():
            seconds = pairs(cpu_of(bare, 20), cpu_of(whole, 20), n)
            peak, kept = new_bytes(whole)
            row(name, *(1e6*np.median(seconds, axis=0)).tolist(),
                float(np.median(seconds[:, 1]/seconds[:, 0])), kept/1e3, peak/kept)


def bench_arrays(folder, n=224, repeats=5):
    from emcon.model import Model
    from emcon.stepper import Stepper
    text = "*HEADING\nBlock\n" + block_text(n, n, "BLOCK", 1, 1, (0, 0), (1, 1)) + "\n"
    text += END.format(sections="*SOLID SECTION, ELSET=BLOCK, MATERIAL=SOFT\n1.", h="0.01",
                       t_end="0.01")  # fmt: skip
    deck = folder/"block.inp"
    deck.write_text(text)
    line = np.linspace(0.0, 1.0, n + 1)
    nodes = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    first = ((n + 1)*np.arange(n)[:, None] + np.arange(n)).reshape(-1, 1)
    corners = first + np.array([0, n + 1, n + 2, 1])

    def made():
        model = Model.from_arrays(nodes, corners)
        model.material("SOFT", elastic=(100.0, 0.1), density=0.01).section("SOFT")
        model.step("DYNAMIC", h=0.01, duration=0.01, direct=True)
        return model

    print(f"\nA block of {len(nodes)} nodes: of a deck and of arrays, {repeats} pairs")
    row = table("deck [s]", "arrays [s]", "ratio", "of it the text [s]")
    seconds = pairs(cpu_of(lambda: Stepper(deck).close()), cpu_of(lambda: made().stepper().close()),
                    repeats)
    part = statistics.median(cpu_of(made)() for _ in range(repeats))
    row(*np.median(seconds, axis=0).tolist(), float(np.median(seconds[:, 1]/seconds[:, 0])), part)


def kirchhoff(young, nu):
    """Energy, stress and tangent of the linear law, as a function of Python."""
    tangent = young/((1 + nu)*(1 - 2*nu))*np.array(
        [[1 - nu, nu, 0], [nu, 1 - nu, 0], [0, 0, (1 - 2*nu)/2]])

    def law(strain):
        stress = strain@tangent
        return (0.5*np.einsum("ni,ni->n", strain, stress), stress,
                np.broadcast_to(tangent, (len(strain), 3, 3)))
    return law


class LinearSolid:
    """A host's solid that is nothing but half a stiffness, for what its calls cost."""

    def __init__(self, half):
        self.half = half

    def respond(self, u0, du, wants_tangent):
        u1 = (u0 + du).ravel()
        force = self.half@(2.0*u0 + du).ravel()
        return force.reshape(-1, 2), u1@(self.half@u1), self.half


def square(n, law=None, host=None):
    """A stepper of a unit square that is set going, of n x n elements or of the solid of a host."""
    from emcon.model import Model
    line = np.linspace(0.0, 1.0, n + 1)
    nodes = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    first = ((n + 1)*np.arange(n)[:, None] + np.arange(n)).reshape(-1, 1)
    model = Model.from_arrays(nodes, None if host else first + np.array([0, n + 1, n + 2, 1]))
    if host:
        model.host(LinearSolid(host[0]), host[1])
    elif law:
        model.material("SOFT", law=law, density=0.01).section("SOFT")
    else:
        model.material("SOFT", elastic=(100.0, 0.1), density=0.01).section("SOFT")
    model.initial("VELOCITY", [0, 1], 1, 0.5)
    model.step("DYNAMIC", h=0.01, duration=1e6, direct=True, nlgeom=not host, increments=10**6)
    return model.stepper()


def bench_given(n=24, repeats=21):
    print(f"\nA step of a square of {n} x {n} elements: the library's own, and a function of "
          f"Python, {repeats} pairs")
    row = table("given       ", "own [ms]", "given [ms]", "ratio", "in the function [%]")
    with square(n) as own:
        # all nodes are free: unknown 2 i + a is freedom a of node i
        assert (own.unknowns.ravel() == np.arange(own.n_unknown)).all()
        half, mass = own.tangent(own.u, 1e6), own.mass
    inside = [0.0]

    def counted(function):
        def timed(*arguments):
            start = time.process_time()
            found = function(*arguments)
            inside[0] += time.process_time() - start
            return found
        return timed

    LinearSolid.respond = counted(LinearSolid.respond)
    for name, more in (("law", {"law": counted(kirchhoff(100.0, 0.1))}),
                       ("solid", {"host": (half, mass)})):
        with square(n) as own, square(n, **more) as given:
            inside[0] = 0.0
            seconds = pairs(cpu_of(own.step), cpu_of(given.step), repeats)
            row(name, *(1e3*np.median(seconds, axis=0)).tolist(),
                float(np.median(seconds[:, 1]/seconds[:, 0])),
                100*inside[0]/float(seconds[:, 1].sum()))


if __name__ == "__main__":
    words = [word for word in sys.argv[1:] if word != "--short"]
    if words:
        print(json.dumps(globals()[words[0]](*words[1:])))
        sys.exit()
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    n = {"n": 2} if IS_SHORT else {}
    with tempfile.TemporaryDirectory() as name:
        bench_steps(pathlib.Path(name), **n)
        bench_opening(**n)
        bench_queries(**n)
        bench_arrays(pathlib.Path(name), **({"n": 8, "repeats": 2} if IS_SHORT else {}))
        bench_given(**({"n": 4, "repeats": 2} if IS_SHORT else {}))
