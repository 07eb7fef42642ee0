"""State and conditions from Python: steps of any size, runs, snapshots, restart files, loads."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT/"pywrap"))

from emcon.stepper import Increment, InputError, Stepper  # noqa: E402

RING = ROOT/"input_decks"/"ring.inp"
EMCON = os.environ.get("EMCON", str(ROOT/"build"/"release"/"emcon"))
EPS = np.finfo(float).eps
#: Every kind of load and boundary condition on two elements, and a second step.
BLOCK = """*PARAMETER
force = 0.5
pressure = 0.25
gravity = 2.
push = 0.
held = 5
*NODE
1, 0., 0.
2, 1., 0.
3, 2., 0.
4, 0., 1.
5, 1., 1.
6, 2., 1.
*ELEMENT, TYPE=CPE4, ELSET=ALL
1, 1, 2, 5, 4
2, 2, 3, 6, 5
*MATERIAL, NAME=M
*HYPERELASTIC, NEO HOOKE
10., 0.05
*DENSITY
1.
*SOLID SECTION, ELSET=ALL, MATERIAL=M
*BOUNDARY
1, 1, 2
4, 1, 2
<held>, 2, 2
*STEP, NLGEOM
*DYNAMIC, DIRECT
0.125, 0.5
*BOUNDARY
3, 2, 2, <push>
*CLOAD
6, 1, <force>
*DLOAD
2, P3, <pressure>
1, GRAV, <gravity>, 0., -1.
*END STEP
*STEP, NLGEOM
*DYNAMIC, DIRECT
0.125, 0.25
*END STEP
"""


@pytest.fixture
def block(tmp_path: Path) -> Path:
    deck = tmp_path/"block.inp"
    deck.write_text(BLOCK)
    return deck


def bits(stepper: Stepper) -> list[np.ndarray]:
    return [stepper.u, stepper.v, stepper.lam, stepper.active, np.array(stepper.time),
            np.array(list(stepper.ledger.values()))]


def same(a: list[np.ndarray], b: list[np.ndarray]) -> bool:
    return all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))


def resident_pages() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1])


# --- steps and runs ----------------------------------------------------------------------------

def test_steps_of_the_size_of_the_grid_are_increments(block: Path) -> None:
    with Stepper(block) as a, Stepper(block) as b:
        for _ in range(4):
            assert a.step() == b.step(0.125)
        assert same(bits(a), bits(b))
        assert a.deck_step == 1 and not a.is_done
        a.step()
        assert a.deck_step == 2 and a.time == 0.625


def test_steps_of_any_size(block: Path) -> None:
    with Stepper(block) as free:
        made = free.step(0.1)
        assert made.h == free.time == 0.1
        with pytest.raises(InputError, match="between two increments"):
            free.step()
        free.step(0.025)                   # back on the grid: 0.1 + 0.025 is 0.125 to rounding
        assert free.step().time == 0.25
        free.step(1.0)                     # beyond the end of the step of the deck
        assert free.time == 1.25 and free.deck_step == 1
        free.next_step()
        assert free.deck_step == 2
        assert free.step().time == 1.375
        with pytest.raises(InputError, match="last one"):
            free.next_step()


def test_run_stops_where_told(block: Path) -> None:
    with Stepper(block) as a, Stepper(block) as b:
        seen = []
        assert a.run(until=0.3, callback=lambda s, i: seen.append((s.time, i))) == 3
        assert [t for t, _ in seen] == [0.125, 0.25, 0.375]
        assert all(isinstance(i, Increment) and i.time == t for t, i in seen)
        assert a.run(until=0.375) == a.run(until=-1.0) == 0
        assert a.run(callback=lambda s, i: s.time >= 0.5) == 1
        assert a.run() == 2 and a.is_done and a.run() == 0
        while not b.is_done:
            b.step()
        assert same(bits(a), bits(b))


def test_callback_that_fails_leaves_the_stepper_usable(block: Path) -> None:
    def fails(stepper: Stepper, increment: Increment) -> None:
        raise KeyError("mine")

    with Stepper(block) as a:
        with pytest.raises(KeyError, match="mine"):
            a.run(callback=fails)
        with pytest.raises(InputError, match=r"returned 'stop'; True stops"):
            a.run(callback=lambda s, i: "stop")
        assert a.time == 0.25
        with pytest.raises(InputError, match="closed"):
            a.run(callback=lambda s, i: s.close())


INTERRUPTED = """
import sys
sys.path.insert(0, sys.argv[1])
from emcon.stepper import Stepper
n = 0
with Stepper(sys.argv[2], h=0.02, t_end=0.8) as ring:
    while not ring.is_done:
        try:
            ring.run(callback=lambda *_: print("step", flush=True))
        except KeyboardInterrupt:
            n += 1
            print("interrupted", flush=True)
    print(n, ring.time, ring.u.tobytes().hex(), ring.v.tobytes().hex(), *ring.ledger.values())
"""


def test_interrupt_in_a_run_and_on_to_the_same_bits() -> None:
    program = subprocess.Popen([sys.executable, "-c", INTERRUPTED, str(ROOT/"pywrap"), str(RING)],
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert program.stdout is not None
    for pause in (0.004, 0.011, 0.007):    # within increments: they take nearly all of the time
        assert program.stdout.readline() == "step\n"
        time.sleep(pause)
        program.send_signal(signal.SIGINT)
        while (line := program.stdout.readline()) == "step\n":
            pass
        assert line == "interrupted\n"
    out, err = program.communicate(timeout=60)
    assert program.returncode == 0, err
    n, *values = out.splitlines()[-1].split()
    with Stepper(RING, h=0.02, t_end=0.8) as ring:
        ring.run()
        assert int(n) == 3
        assert values == [str(ring.time), ring.u.tobytes().hex(), ring.v.tobytes().hex(),
                          *map(str, ring.ledger.values())]


# --- state in and out --------------------------------------------------------------------------

def test_saved_states_come_back_to_the_bit() -> None:
    with Stepper(RING, h=0.05) as ring, Stepper(RING, h=0.05) as other:
        ring.run(until=0.7)
        saved = ring.save()
        before = bits(ring)
        ring.run(until=0.9)
        assert ring.active.any()
        after, later = bits(ring), ring.save()
        ring.restore(saved)
        assert same(bits(ring), before)
        ring.run(until=0.9)
        assert same(bits(ring), after)
        ring.restore(saved)
        ring.restore(later)
        assert same(bits(ring), after)
        other.restore(saved)               # one of the same deck
        del saved
        other.run(until=0.9)
        assert same(bits(other), after)


def test_saved_states_across_steps_of_the_deck(block: Path) -> None:
    with Stepper(block) as a:
        a.run(until=0.25)
        saved = a.save()
        a.run()
        after = bits(a)
        a.restore(saved)
        assert a.deck_step == 1
        a.run()
        assert same(bits(a), after)


def test_states_are_freed(block: Path) -> None:
    with Stepper(block) as a:
        a.step()
        saved = [a.save() for _ in range(100)]
        first = resident_pages()
        for _ in range(10_000):
            a.save()
        assert resident_pages() - first < 64       # pages; a state kept of a hundred is as much
        del saved
    with Stepper(block) as other:
        kept = other.save()
    del kept                               # after its stepper


def test_state_set_is_the_state_read() -> None:
    with Stepper(RING, h=0.05) as ring, Stepper(RING, h=0.05) as other:
        ring.run(until=0.8)
        other.set_state(u=ring.u, v=np.asfortranarray(ring.v), lam=ring.lam, active=ring.active,
                        time=ring.time)
        assert ring.active.any()
        assert same(bits(other)[:5], bits(ring)[:5])
        for name in ("kinetic", "strain", "px", "py", "lz"):
            assert other.ledger[name] == pytest.approx(ring.ledger[name], rel=1e3*EPS)
        ring.step()
        other.step()
        # the same equations, whose internal forces are summed otherwise; tolerance of the deck
        assert np.abs(other.u - ring.u).max() <= 1e-10*np.abs(ring.u).max()
        rest = other.v
        other.set_state(v=2*rest)
        assert np.array_equal(other.v, 2*rest) and other.time == ring.time


def test_set_state_on_strided_arrays(block: Path) -> None:
    rng = np.random.default_rng(3)
    wide = 0.01*rng.standard_normal((12, 4))
    with Stepper(block) as a, Stepper(block) as b:
        a.set_state(u=wide[::2, 1::2], v=wide[1::2, ::-2])
        b.set_state(u=wide[::2, 1::2].copy(), v=wide[1::2, ::-2].tolist())
        assert np.array_equal(a.u, wide[::2, 1::2]) and np.array_equal(a.v, b.v)
        assert a.energies() == b.energies()
        b.set_state(u=wide[::2, 1::2].astype(np.float32))
        assert np.array_equal(b.u, wide[::2, 1::2].astype(np.float32))


def test_arrays_are_copied_once_at_most() -> None:
    """Peaks of what numpy allocates, in arrays of the nodes, over what is handed over."""
    with Stepper(RING, h=0.05) as ring:
        u, v = ring.u, ring.v
        assert u.T.flags.f_contiguous and not u.T.flags.owndata

        def peak_once(call: Callable[[], object]) -> float:
            tracemalloc.start()
            kept = call()
            most = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
            del kept
            return most/u.nbytes

        def peak(call: Callable[[], object]) -> float:
            """The least of some: what the interpreter allocates beside the call comes and goes."""
            call()                         # what is cached is there
            return min(peak_once(call) for _ in range(3))

        small = 0.25                       # a flag each for what is finite, and small objects
        assert peak(lambda: ring.u) < 1 + small and peak(lambda: ring.v) < 1 + small
        assert peak(lambda: ring.set_state(u=u, v=v)) < small
        assert peak(lambda: ring.evaluate(u, 0.05)) < small
        assert peak(lambda: ring.residual(u, 0.05)) < 2 + small       # and on the unknowns
        report = ring.constraint(u0=u, u1=u)
        size = sum(m.data.nbytes + m.indices.nbytes + m.indptr.nbytes
                   for m in (report.discrete_gradient, report.jacobian))/u.nbytes
        assert peak(lambda: ring.constraint(u0=u, u1=u)) < size + 2*small


# --- restart files -----------------------------------------------------------------------------

def test_the_program_tells_a_file_of_a_stepper(tmp_path: Path) -> None:
    """What was changed of its conditions is for a stepper: the program would go on without it."""
    with Stepper(RING, h=0.05, t_end=0.2) as ring:
        ring.step()
        ring.write_restart(tmp_path/"ring.rst.h5")
    done = subprocess.run([EMCON, "restart", tmp_path/"ring.rst.h5", "--output", tmp_path/"on"],
                          capture_output=True, text=True)
    assert done.returncode == 2 and "Stepper.from_restart" in done.stderr
    assert not (tmp_path/"on").exists()


def test_restart_file_goes_on_to_the_same_bits(block: Path, tmp_path: Path) -> None:
    with Stepper(block, force=0.75) as a:
        a.run(until=0.25)
        a.step(0.03125)
        a.set_point_load(6, 1, 1.5)
        a.prescribe(6, 2, 0.001)
        a.write_restart(tmp_path/"a.rst.h5")
        before = bits(a)
        a.step(0.09375)
        a.run()
        with Stepper.from_restart(tmp_path/"a.rst.h5") as b:
            assert same(bits(b), before)
            b.step(0.09375)
            b.run()
            assert same(bits(a), bits(b))


def test_restart_file_of_the_program(tmp_path: Path) -> None:
    """A run that ends early, for it may make no more than 50 increments."""
    deck = tmp_path/"ring.inp"
    deck.write_text(RING.read_text(encoding="utf-8").replace("INC=1000000", "INC=50"))
    done = subprocess.run([EMCON, str(deck), "--quiet", "--set", "h=0.015"], capture_output=True,
                          text=True)
    assert done.returncode == 3 and "50 increments" in done.stderr
    with Stepper.from_restart(tmp_path/"ring.rst.h5") as ring, Stepper(RING, h=0.015) as alone:
        alone.run(until=0.75)
        assert same(bits(ring), bits(alone))
        ring.step(0.015)
        alone.step()
        assert ring.active.any() and same(bits(ring), bits(alone))


def test_no_restart_file(tmp_path: Path, block: Path) -> None:
    with pytest.raises(OSError, match="none"):
        Stepper.from_restart(tmp_path/"none")
    (tmp_path/"junk").write_bytes(b"junk")
    with pytest.raises(OSError, match="junk"):
        Stepper.from_restart(tmp_path/"junk")
    with Stepper(block) as a, pytest.raises(OSError, match="nowhere"):
        a.write_restart(tmp_path/"nowhere"/"a.rst.h5")


# --- loads and boundary values -----------------------------------------------------------------

@pytest.mark.parametrize(("parameter", "change"), [
    ({"force": 2.0}, lambda s: s.set_point_load(6, 1, 2.0)),
    ({"pressure": 3.0}, lambda s: s.set_pressure([2], [3], 3)),
    ({"gravity": -1.0}, lambda s: s.set_gravity(np.array([1]), np.array([-1.0]))),
    ({"push": 0.01}, lambda s: s.prescribe(3, 2, 0.01)),
    ({"held": 2}, lambda s: (s.release(5, 2), s.prescribe(2, 2, 0.0)))])
def test_changed_conditions_are_those_of_a_deck_with_them(block: Path, parameter: dict[str, float],
                                                          change: object) -> None:
    with Stepper(block, **parameter) as deck, Stepper(block) as changed, Stepper(block) as plain:
        change(changed)
        for stepper in (deck, changed, plain):
            stepper.run(until=0.375)
        # sums over the unknowns are in another order where others are prescribed
        assert np.abs(deck.u - changed.u).max() <= 1e-10*np.abs(deck.u).max()
        assert np.abs(deck.u - plain.u).max() > 1e-4*np.abs(deck.u).max()


def without(text: str, *lines: str) -> str:
    """The deck without these lines."""
    for line in lines:
        assert line in text
        text = text.replace(line, "")
    return text


ADDED = {
    "*CLOAD\n6, 1, <force>\n": lambda s: s.add_point_load(6, 1, 0.5),
    "2, P3, <pressure>\n": lambda s: s.add_pressure([2], [3], 0.25),
    "1, GRAV, <gravity>, 0., -1.\n": lambda s: s.add_gravity(1, 2.0, (0.0, -3.0)),
}


@pytest.mark.parametrize("kind", ["*DYNAMIC, DIRECT", "*STATIC, DIRECT"])
@pytest.mark.parametrize("line", ADDED)
def test_added_loads_are_those_of_a_deck_with_them(tmp_path: Path, line: str, kind: str) -> None:
    text = BLOCK.replace("*DYNAMIC, DIRECT", kind)
    (tmp_path/"with.inp").write_text(text)
    (tmp_path/"without.inp").write_text(without(text, line))
    with Stepper(tmp_path/"with.inp") as deck, Stepper(tmp_path/"without.inp") as added:
        assert added.n_step == 2
        ADDED[line](added)
        for stepper in (deck, added):
            stepper.run(until=0.5)
        # loads are summed in another order
        assert np.abs(deck.u - added.u).max() <= 1e-10*np.abs(deck.u).max()
        with Stepper(tmp_path/"without.inp") as plain:
            plain.run(until=0.5)
            assert np.abs(deck.u - plain.u).max() > 1e-3*np.abs(deck.u).max()


def test_loads_added_later_are_those_of_the_next_step(tmp_path: Path) -> None:
    """The loads of a second step, added where it begins, to the last bit."""
    one = without(BLOCK, "*CLOAD\n6, 1, <force>\n").split("*END STEP")[0]
    two = (one + "*END STEP\n*STEP, NLGEOM\n*DYNAMIC, DIRECT\n0.125, 0.5\n*CLOAD\n6, 1, 0.5\n"
           "5, 2, -0.25\n*END STEP\n")
    (tmp_path/"one.inp").write_text(one.replace("0.125, 0.5", "0.125, 1.0") + "*END STEP\n")
    (tmp_path/"two.inp").write_text(two)
    with Stepper(tmp_path/"two.inp") as deck, Stepper(tmp_path/"one.inp") as added:
        deck.run(until=0.5)
        added.run(until=0.5)
        assert np.array_equal(deck.u, added.u)
        added.add_point_load([6, 5], [1, 2], [0.5, -0.25])
        added.write_restart(tmp_path/"added.rst.h5")
        deck.run()
        added.run()
        assert np.array_equal(deck.u, added.u) and np.array_equal(deck.v, added.v)
        with Stepper.from_restart(tmp_path/"added.rst.h5") as again:
            again.set_point_load(5, 2, -0.25)      # it is there
            again.run()
            assert same(bits(again), bits(added))
        names = ("kinetic", "strain", "external_work")
        kinetic, strain, work = (added.energies()[name] for name in names)
        assert abs(kinetic + strain - work) <= 1e-12*abs(strain)


def test_freedoms_prescribed_and_released(block: Path) -> None:
    with Stepper(block) as a:
        n, unknown = a.n_unknown, a.unknowns
        assert n == (unknown >= 0).sum() == unknown.max() + 1
        a.prescribe(6, 1, 0.02)
        assert a.n_unknown == n - 1 and a.unknowns[5, 0] == -1
        a.step()
        assert a.u[5, 0] == 0.02
        a.release(6, 1)
        assert a.n_unknown == n and np.array_equal(a.unknowns, unknown)
        a.step()
        assert a.u[5, 0] != 0.02


def test_conditions_that_are_not_there(block: Path) -> None:
    with Stepper(block) as a, Stepper(block) as b:
        for bad, text in [
                (lambda: a.set_point_load(6, 2, 1.0), "no load of this kind on node 6"),
                (lambda: a.set_point_load([6, 77], 1, 1.0), "no load of this kind on node 77"),
                (lambda: a.set_pressure(2, 1, 1.0), "no load of this kind on element 2"),
                (lambda: a.set_gravity(2, 1.0), "no load of this kind on element 2"),
                (lambda: a.add_point_load([6, 6], [2, 1], 1.0), "such a load on node 6 already"),
                (lambda: a.add_point_load(6, 3, 1.0), "not in 1..2"),
                (lambda: a.add_pressure(2, 3, 1.0), "such a load on element 2 already"),
                (lambda: a.add_gravity(2, 1.0, (0, 0)), "direction of gravity is 0"),
                (lambda: a.add_gravity(2, 1.0, (0, 0, 1)), "direction"),
                (lambda: a.add_gravity(7, 1.0, (0, 1)), "no element 7"),
                (lambda: a.prescribe(77, 1, 0.0), "no node 77"),
                (lambda: a.prescribe(3, 3, 0.0), "1 to 2, not 3"),
                (lambda: a.release(6, 1), "not prescribed"),
                (lambda: a.set_point_load(6, 1, np.nan), "not finite"),
                (lambda: a.set_point_load(6.0, 1, 1.0), "whole number"),
                (lambda: a.set_point_load(-6, 1, 1.0), "out of range"),
                (lambda: a.set_point_load([6, 6], 1, [1.0, 2.0, 3.0]), "same number"),
                (lambda: a.set_point_load(6, 1, "much"), "real numbers"),
                (lambda: a.prescribe([3], 1, 0.0), "one whole number")]:
            with pytest.raises(InputError, match=text):
                bad()
        a.run()
        b.run()
        assert same(bits(a), bits(b))
