"""Bad input to the stepper: what is wrong is said, the stepper stays usable, no memory is lost."""

from __future__ import annotations

import copy
import pickle
import re
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT/"pywrap"))

from emcon import _core  # noqa: E402
from emcon.model import Model  # noqa: E402
from emcon.stepper import InputError, Stepper  # noqa: E402

RING = ROOT/"input_decks"/"ring.inp"
ONE_ELEMENT = """*NODE
1, 0., 0.
2, 1., 0.
3, 1., 1.
4, 0., 1.
*ELEMENT, TYPE=CPE4, ELSET=ALL
1, 1, 2, 3, 4
*MATERIAL, NAME=M
*ELASTIC
100., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=ALL, MATERIAL=M
*INITIAL CONDITIONS, TYPE=VELOCITY
3, 1, 1.
*STEP, NLGEOM
*DYNAMIC, DIRECT
0.1, 1.
*END STEP
"""
ZERO = np.zeros((4, 2))


@pytest.fixture
def one(tmp_path: Path) -> Path:
    deck = tmp_path/"one.inp"
    deck.write_text(ONE_ELEMENT)
    return deck


def with_entry(value: float) -> np.ndarray:
    field = np.zeros((4, 2))
    field[2, 1] = value
    return field


#: Arguments that no nodal field can be, and what is said of them.
FIELDS: dict[str, tuple[object, str]] = {
    "rows": (np.zeros((5, 2)), r"shape \(4, 2\), not \(5, 2\)"),
    "columns": (np.zeros((4, 3)), r"shape \(4, 2\), not \(4, 3\)"),
    "transposed": (np.zeros((2, 4)), r"shape \(4, 2\), not \(2, 4\)"),
    "flat": (np.zeros(8), r"not \(8,\)"),
    "nothing": (np.zeros((0, 2)), r"not \(0, 2\)"),
    "number": (1.0, r"not \(\)"),
    "complex": (ZERO + 0j, "real numbers, not complex128"),
    "text": ([["a", "b"]]*4, "real numbers, not text"),
    "objects": (np.full((4, 2), None), "real numbers, not object"),
    "flags": (np.ones((4, 2), dtype=bool), "real numbers, not bool"),
    "ragged": ([[0, 0], [0, 0, 0]], "no array"),
    "nan": (with_entry(np.nan), r"not finite at \(2, 1\): nan"),
    "infinite": (with_entry(-np.inf), r"not finite at \(2, 1\): -inf"),
}
TAKES_FIELD: dict[str, Callable[[Stepper, object], object]] = {
    "u": lambda s, field: s.set_state(u=field),
    "v": lambda s, field: s.set_state(v=field),
    "u1": lambda s, field: s.evaluate(field, 0.1),
    "q1": lambda s, field: s.constraint(s.positions, field),
    "u0": lambda s, field: s.constraint(u0=field, u1=ZERO),
}


@pytest.mark.parametrize("bad", FIELDS)
@pytest.mark.parametrize("name", TAKES_FIELD)
def test_bad_fields(one: Path, name: str, bad: str) -> None:
    with Stepper(one) as stepper:
        v = stepper.v
        field, text = FIELDS[bad]
        with pytest.raises(InputError, match=f"{name} is .*{text}"):
            TAKES_FIELD[name](stepper, field)
        assert np.array_equal(stepper.v, v) and not stepper.u.any()
        stepper.step()


@pytest.mark.parametrize(("bad", "text"), [
    (0.0, "> 0, not 0"), (-0.1, "> 0, not -0.1"), (np.nan, "not finite"), (np.inf, "not finite"),
    ("0.1", "real numbers"), (0.1j, "real numbers"), ([0.1], r"shape \(\)"), (True, "real numbers"),
    (object(), "real numbers")])
def test_bad_step_sizes(one: Path, bad: object, text: str) -> None:
    with Stepper(one) as stepper:
        for call in (stepper.step, stepper.guess, lambda h: stepper.evaluate(ZERO, h)):
            with pytest.raises(InputError, match=f"h is .*{text}"):
                call(bad)
        stepper.step()
        with pytest.raises(InputError, match="can tell"):
            stepper.step(1e-300)
        with pytest.raises(InputError, match="until is"):
            stepper.run(until=np.nan)
        assert stepper.time == 0.1


def test_bad_contact_arguments() -> None:
    with Stepper(RING, h=0.05) as ring:
        n = ring.n_constraint
        for bad, text in [
                ({"lam": np.zeros(n + 1)}, "lam is .*shape"),
                ({"lam": np.full(n, np.nan)}, "lam is not finite"),
                ({"active": np.zeros(n)}, "True and False, not float64"),
                ({"active": np.zeros(n - 1, dtype=bool)}, "active is .*shape")]:
            with pytest.raises(InputError, match=text):
                ring.set_state(**bad)
            with pytest.raises(InputError, match=text):
                ring.residual(ring.u, 0.05, **bad)
        with pytest.raises(InputError, match="does not act"):
            ring.set_state(lam=np.ones(n))
        for bad in ({}, {"q0": ring.q}, {"q1": ring.q}, {"u0": ring.u},
                    {"q0": ring.q, "q1": ring.q, "u0": ring.u, "u1": ring.u},
                    {"q0": ring.q, "u1": ring.u}):
            with pytest.raises(InputError, match="either q0 and q1 or u0 and u1"):
                ring.constraint(**bad)
        report = ring.constraint(ring.q, ring.q)
        with pytest.raises(InputError, match="the factor is .*shape"):
            report.curvature_times(np.ones(len(report.id) + 1), ring.u)
        with pytest.raises(InputError, match="the direction is .*shape"):
            report.curvature_times(report.gap0, ring.u.T)


def test_bad_states(one: Path, tmp_path: Path) -> None:
    with Stepper(one) as stepper, Stepper(RING) as ring:
        with pytest.raises(InputError, match="not taken from this model"):
            stepper.restore(ring.save())
        for bad in (None, 0, stepper.u):
            with pytest.raises(InputError, match=r"save\(\)"):
                stepper.restore(bad)
        with pytest.raises(InputError, match="before the start"):
            stepper.set_state(time=-1.0)
        with pytest.raises(InputError, match="given to Model"):
            Stepper(Model.from_deck(one), h=0.1)
        with pytest.raises(InputError, match="last one"):
            stepper.next_step()
        stepper.run()
        with pytest.raises(InputError, match="end"):
            stepper.step()


def test_everything_of_a_closed_stepper_says_so(one: Path) -> None:
    stepper = Stepper(one)
    saved = stepper.save()
    stepper.close()
    stepper.close()
    arguments: dict[str, tuple[object, ...]] = {
        "evaluate": (ZERO, 0.1), "residual": (ZERO, 0.1), "tangent": (ZERO, 0.1),
        "null_space": (ZERO, 0.1), "guess": (0.1,), "constraint": (ZERO, ZERO),
        "restore": (saved,), "write_restart": ("closed.rst.h5",), "prescribe": (1, 1, 0.0),
        "element_set": ("ALL",), "surface": ("ALL",), "field": ("U",), "release": (1, 1),
        "set_point_load": (1, 1, 0.0), "set_pressure": (1, 1, 0.0),
        "set_surface_pressure": ("ALL", 0.0), "add_surface_pressure": ("ALL", 0.0),
        "set_gravity": (1, 0.0), "add_point_load": (1, 1, 0.0), "add_pressure": (1, 1, 0.0),
        "add_gravity": (1, 0.0, (0.0, -1.0)), "set_threads": (1,), "node_set": ("ALL",)}
    free = {"close", "from_restart", "results"}
    for name in dir(Stepper):
        if name.startswith("_") or name in free:
            continue
        with pytest.raises(InputError, match="the model is closed"):
            found = getattr(stepper, name)
            found(*arguments.get(name, ()))
    assert not Path("closed.rst.h5").exists()


@pytest.mark.parametrize("duplicate", [copy.deepcopy, pickle.dumps])
def test_steppers_are_not_copied(one: Path, duplicate: Callable[[object], object]) -> None:
    """A copy would have the same address, and free it again."""
    with Stepper(one) as stepper:
        for thing in (stepper, stepper.save(), stepper.constraint(u0=ZERO, u1=ZERO)):
            with pytest.raises(TypeError, match="cannot be copied"):
                duplicate(thing)
        stepper.step()


def test_two_threads_in_one_stepper() -> None:
    """One runs, and lets others run while it steps; what they ask is an error, never a crash."""
    with Stepper(RING, h=0.05, t_end=0.4) as ring, Stepper(RING, h=0.05, t_end=0.4) as alone:
        refused: list[str] = []
        begun, over = threading.Event(), threading.Event()

        def meddle() -> None:
            begun.set()
            while not over.is_set():
                for ask in (ring.step, lambda: ring.u, ring.close):
                    try:
                        ask()
                    except InputError as error:
                        refused.append(str(error))

        # within one call of the library, so that there is no time between calls to meddle in
        def steps(address: int) -> int:
            other.start()
            begun.wait()
            for _ in range(8):
                ierr, _ = _core.emcon_advance(address)
            over.set()
            other.join()
            return ierr

        other = threading.Thread(target=meddle)
        ring._handle.call(steps)
        assert refused and all("in use by another thread" in text for text in refused)
        alone.run()
        assert ring.is_done and np.array_equal(ring.u, alone.u)


def cycles(n: int, deck: Path, bad: Path) -> int:
    """Pages that are in use after models were opened and closed, opened in vain, and misused."""
    for k in range(n):
        with Stepper(deck) as stepper:
            if k % 10 == 0:
                saved = stepper.save()
                stepper.step()
                evaluation = stepper.evaluate(stepper.u, 0.1)
                evaluation.tangent()
                evaluation.null_space()
                stepper.constraint(u0=ZERO, u1=ZERO)
                with pytest.raises(InputError):
                    stepper.step(-1.0)
                stepper.restore(saved)
        with pytest.raises(InputError):
            Stepper(bad)
    return int(Path("/proc/self/statm").read_text().split()[1])


@pytest.mark.long
def test_no_memory_is_lost_in_2000_cycles(one: Path) -> None:
    """In a process of its own: what other tests leave in the heap moves its size. The heap finds its
    size by steps, in two thousand cycles at most; what is lost is lost in all of them."""
    bad = one.with_name("bad.inp")
    bad.write_text(ONE_ELEMENT.replace("*DENSITY", "*DENSITTY"))
    program = ("import sys; from pathlib import Path; sys.path.insert(0, sys.argv[1]); "
               "from test_stepper_errors import cycles; one, bad = map(Path, sys.argv[2:]); "
               "size = [cycles(1000, one, bad) for _ in range(2)]; "
               "size += [cycles(1000, one, bad)] if size[1] - size[0] >= 12 else []; "
               "print(*size[-2:])")
    done = subprocess.run([sys.executable, "-c", program, str(Path(__file__).parent), str(one),
                           str(bad)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    first, last = map(int, done.stdout.split())
    assert last - first < 12               # pages: 50 bytes a cycle are as much


def test_a_closed_stepper_shows_itself(one: Path) -> None:
    """A debugger or a notebook may show it."""
    stepper = Stepper(one)
    stepper.close()
    assert repr(stepper) == stepper._repr_html_() == "a closed Stepper"


@pytest.mark.parametrize(("value", "text"), [
    ("a", "h is to hold real numbers, not text"), (np.nan, "h is not finite: nan"), (-1, "h is to be > 0, not -1")])
def test_bad_numbers(one: Path, value: object, text: str) -> None:
    with Stepper(one) as stepper, pytest.raises(InputError, match=f"^{text}$"):
        stepper.step(value)


@pytest.mark.parametrize("value", ["1", 1.5, [[1]]])
def test_bad_whole_numbers(one: Path, value: object) -> None:
    text = re.escape(f"a whole number or a list of such, not {value!r}")
    with Stepper(one) as stepper, pytest.raises(InputError, match=text):
        stepper.prescribe(1, value, 0.0)


def test_one_constant_where_a_law_has_two() -> None:
    with pytest.raises(InputError, match="elastic has 2 constants, not 1"):
        Model().material("STEEL", elastic=3.0)
