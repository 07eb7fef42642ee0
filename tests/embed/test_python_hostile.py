"""What someone would do who wants to break the Python package: it says what is wrong, and lives."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT/"pywrap"))

from emcon.csr import Csr  # noqa: E402
from emcon.given import Outside  # noqa: E402
from emcon.interface import Interface  # noqa: E402
from emcon.model import Model  # noqa: E402
from emcon.stepper import AnalysisError, InputError, Snapshot, Stepper  # noqa: E402

RING = ROOT/"input_decks"/"ring.inp"
PATCH = ROOT/"input_decks"/"contact_patch.inp"
CORNERS = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
ZERO = np.zeros((4, 2))
EPS = np.finfo(float).eps

Law = Callable[[np.ndarray], tuple[Any, Any, Any]]


def square(law: Law | None = None, host: Any = None, mass: Any = None) -> Model:
    """A unit square with a velocity at a corner, as an element or as the solid of a host."""
    model = Model.from_arrays(CORNERS, None if host else [[0, 1, 2, 3]])
    if host:
        model.host(host, np.eye(4) if mass is None else mass)
    elif law:
        model.material("M", law=law, density=1.0).section("M")
    else:
        model.material("M", elastic=(100.0, 0.3), density=1.0).section("M")
    model.initial("VELOCITY", 2, 1, 1.0)
    # A tangent in each iteration, or rubbish in one is noticed late.
    model.step("DYNAMIC", h=0.1, duration=1.0, direct=True, nlgeom=True).newton("FULL")
    return model


def spring_law(z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return 0.5*(z*z).sum(axis=1), z, np.broadcast_to(np.eye(3), (len(z), 3, 3))


class Springs:
    """Springs to the places of the nodes; `answer` may make something else of what it returns."""

    def __init__(self, answer: Callable[..., Any] | None = None) -> None:
        self.answer = answer
        self.seen: list[np.ndarray] = []

    def respond(self, u0: np.ndarray, du: np.ndarray, wants_tangent: bool) -> Any:
        self.seen.append(du)
        u1 = (u0 + du).ravel()
        found = u0 + 0.5*du, 0.5*u1@u1, 0.5*np.eye(len(u1))
        return self.answer(*found) if self.answer else found


def in_child(program: str, *arguments: object, timeout: float = 60.0) -> str:
    """What a Python of its own prints, which must end well and in time."""
    begin = (f"import sys; sys.path.insert(0, {str(ROOT/'pywrap')!r})\n"
             "from emcon.stepper import InputError, Stepper\n")
    done = subprocess.run([sys.executable, "-X", "faulthandler", "-c", begin + program,
                           *map(str, arguments)], capture_output=True, text=True, timeout=timeout)
    assert done.returncode == 0 and not done.stderr, f"{done.returncode}: {done.stderr}"
    return done.stdout


# ---- what functions of Python are given, and what they return ------------------------------------

def test_a_function_may_keep_what_it_is_given() -> None:
    """The library's own memory is used again by the next call, and freed with the model."""
    seen: list[tuple[np.ndarray, np.ndarray]] = []

    def law(z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        seen.append((z, z.copy()))
        return spring_law(z)

    with square(law).stepper() as stepper:
        stepper.run()
    springs = Springs()
    copies: list[np.ndarray] = []
    springs.answer = lambda *found: (copies.append(springs.seen[-1].copy()), found)[1]
    with square(host=springs).stepper() as stepper:
        stepper.run()
    assert len(seen) > 20 and len(copies) > 10
    assert all(np.array_equal(kept, copy) for kept, copy in seen)
    assert all(np.array_equal(kept, copy) for kept, copy in zip(springs.seen, copies))


NAN_LAW: dict[str, Callable[[np.ndarray], Any]] = {
    "energy": lambda z: (np.nan*z[:, 0], *spring_law(z)[1:]),
    "stress": lambda z: (spring_law(z)[0], np.inf*np.ones_like(z), spring_law(z)[2]),
    "tangent": lambda z: (*spring_law(z)[:2], np.nan*spring_law(z)[2]),
}
NO_LAW: dict[str, tuple[Callable[[np.ndarray], Any], type[BaseException], str]] = {
    "nothing": (lambda z: None, InputError, "not NoneType"),
    "shape": (lambda z: (z, z, z), InputError, "the energy has the shape"),
    "text": (lambda z: ("a", "b", "c"), InputError, "not real numbers"),
    "masked": (lambda z: (np.ma.array(z[:, 0], mask=True), *spring_law(z)[1:]), InputError,
               "masked"),
    "raises": (lambda z: 1/0, ZeroDivisionError, "division"),
    "exits": (lambda z: sys.exit(3), SystemExit, "3"),
}


@pytest.mark.parametrize("bad", [*NAN_LAW, *NO_LAW, "outside"])
def test_a_law_that_fails_leaves_the_state(bad: str) -> None:
    answer: list[Callable[[np.ndarray], Any]] = [spring_law]
    with square(lambda z: answer[0](z)).stepper() as stepper:
        stepper.step()
        u, v = stepper.u, stepper.v

        def outside(z: np.ndarray) -> Any:
            raise Outside

        law, kind, text = NO_LAW.get(bad, (NAN_LAW.get(bad, outside), AnalysisError, "smallest"))
        answer[0] = law
        with pytest.raises(kind, match=text):
            stepper.step()
        assert np.array_equal(stepper.u, u) and np.array_equal(stepper.v, v)
        answer[0] = spring_law
        assert math.isclose(stepper.step().time, 0.2)


ROWS = np.arange(9, dtype=np.int32)
PLACES = np.arange(8, dtype=np.int32)
#: Indices and values that are no matrix (8, 8) of one entry a row, and what is said of them.
NO_MATRICES: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray, str]] = {
    "beyond": (ROWS, np.append(PLACES[:7], 99), np.ones(8), "tangent"),
    "before": (ROWS, np.append(PLACES[:7], -9), np.ones(8), "tangent"),
    "starts": (1000*ROWS, PLACES, np.ones(8), "tangent"),
    "backwards": (ROWS[[0, 2, 1, 3, 4, 5, 6, 7, 8]], PLACES, np.ones(8), "tangent"),
    "short": (ROWS[:3], PLACES[:2], np.ones(2), "tangent"),
    "twice": (np.append(2*ROWS[:5], ROWS[5:] + 4), np.repeat(PLACES, [2, 2, 2, 2, 1, 1, 1, 1]),
              np.ones(12), "tangent"),
    "values": (ROWS, PLACES, np.ones(3), "tangent"),
    "complex": (ROWS, PLACES, np.ones(8)*1j, "tangent"),
}


@pytest.mark.parametrize("when", ["first", "later"])
@pytest.mark.parametrize("bad", NO_MATRICES)
def test_a_host_whose_tangent_is_no_matrix(bad: str, when: str) -> None:
    *arrays, text = NO_MATRICES[bad]
    matrix = Csr((8, 8), *arrays)
    springs = Springs()
    if when == "later":
        with square(host=springs).stepper() as stepper:
            stepper.step()
            u = stepper.u
            springs.answer = lambda force, energy, tangent: (force, energy, matrix)
            with pytest.raises(InputError, match=text):
                stepper.step()
            assert np.array_equal(stepper.u, u)
    else:
        springs.answer = lambda force, energy, tangent: (force, energy, matrix)
        with pytest.raises(InputError, match=text):
            square(host=springs).stepper()


@pytest.mark.parametrize(("mass", "text"), [
    ("x", "mass"), (5.0, "mass"), (np.ones(4), "mass"), (np.eye(5), "shape"),
    (np.ones((8, 8)), "couples"), (-np.eye(4), "negative"), (np.nan*np.eye(4), "not finite"),
    (np.triu(np.ones((4, 4))), "other way round"), (np.zeros((4, 4)), "no mass"),
    (np.eye(4)*1j, "not real"), (np.ma.masked_equal(np.eye(4), 0.0), "masked")])
def test_masses_that_are_none(mass: Any, text: str) -> None:
    with pytest.raises(InputError, match=text):
        square(host=Springs(), mass=mass).stepper()


def test_a_law_that_calls_its_stepper() -> None:
    own: list[Stepper] = []

    def law(z: np.ndarray) -> Any:
        if own:
            own[0].step()
        return spring_law(z)

    with square(law).stepper() as stepper:
        own.append(stepper)
        with pytest.raises(InputError, match="your"):
            stepper.step()
        own.clear()
        stepper.step()


# ---- arguments ----------------------------------------------------------------------------------

def test_masked_entries_are_not_values() -> None:
    """`numpy.asarray` would take what lies under the mask."""
    field = np.ma.array(ZERO, mask=[[True, False]] + 3*[[False, False]])
    with square().stepper() as stepper:
        for call in (lambda: stepper.set_state(u=field), lambda: stepper.residual(field, 0.1),
                     lambda: stepper.step(np.ma.masked),
                     lambda: Model.from_arrays(field, [[0, 1, 2, 3]]),
                     lambda: Model.from_arrays(CORNERS, np.ma.masked_equal([[0, 1, 2, 3]], 3))):
            with pytest.raises(InputError, match="masked"):
                call()
        stepper.set_state(u=np.ma.array(ZERO))     # nothing is hidden in this one


@pytest.mark.parametrize("size", [np.float32(0.125), np.float64(0.125), np.array(0.125),
                                  np.longdouble(0.125), np.float16(0.125)])
def test_step_sizes_of_any_real_kind(size: Any) -> None:
    with square().stepper() as stepper:
        assert stepper.step(size).time == 0.125


def test_absurd_step_sizes_leave_a_finite_state() -> None:
    for size in (5e-324, 1e-300, 1e-20, 1e20, 1e300, sys.float_info.max):
        with square().stepper() as stepper:
            saved = stepper.save()
            try:
                stepper.step(size)
            except AnalysisError:
                assert stepper.time == 0.0
            assert np.isfinite(stepper.u).all() and np.isfinite(stepper.v).all()
            stepper.restore(saved)
            assert math.isclose(stepper.step().time, 0.1)


def test_run_into_the_past_and_callbacks_that_are_none() -> None:
    with square().stepper() as stepper:
        for no_function in ("no", 5, [print]):
            with pytest.raises(InputError, match="function"):
                stepper.run(callback=no_function)
        assert stepper.time == 0.0                 # told before the first increment
        stepper.step()
        assert stepper.run(until=-1.0) == 0 and stepper.run(until=0.1) == 0
        with pytest.raises(InputError, match="closed"):
            stepper.run(callback=lambda stepper, increment: stepper.close())


def test_names_of_files_that_are_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A name with a zero byte would end there in C, and name another file."""
    monkeypatch.chdir(tmp_path)
    other = tmp_path/"other"
    other.write_text("precious")
    pipe = tmp_path/"pipe"
    os.mkfifo(pipe)
    with square().stepper() as stepper:
        for name in ("other\0.rst.h5", b"other\0", ""):
            with pytest.raises(InputError, match="name of a file"):
                stepper.write_restart(name)
            with pytest.raises(InputError, match="name of a file"):
                Stepper.from_restart(name)
        for name in (tmp_path, pipe):              # nor devices: they would be replaced
            with pytest.raises(OSError, match="no file"):
                stepper.write_restart(name)
    assert other.read_text() == "precious" and pipe.is_fifo()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["other", "pipe"]


def test_faces_that_are_arrays() -> None:
    with pytest.raises(InputError, match="a face is 1 to 6"):
        square().surface("S", faces=[(0, np.array([1, 2]))])


# ---- conditions ---------------------------------------------------------------------------------

def test_everything_prescribed_and_released_again() -> None:
    freedoms = [(node, dof) for node in (1, 2, 3, 4) for dof in (1, 2)]
    with square().stepper() as stepper:
        for _ in range(2):                         # what is prescribed may be so again
            for node, dof in freedoms:
                stepper.prescribe(node, dof, 0.0)
        assert stepper.n_unknown == 0 and stepper.links.shape == (8, 0)
        stepper.step()
        assert not stepper.u.any()
        assert stepper.tangent(stepper.u, 0.1).shape == (0, 0)
        assert [matrix.shape for matrix in stepper.null_space(ZERO, 0.1)] == [(8, 0), (8, 0)]
        for node, dof in freedoms:
            stepper.release(node, dof)
            with pytest.raises(InputError, match="not prescribed"):
                stepper.release(node, dof)
        assert stepper.n_unknown == 8
        stepper.step()


def test_loads_on_nothing() -> None:
    with square().stepper() as stepper:
        for none in ([], np.empty(0, int)):
            for call in (stepper.set_point_load, stepper.set_pressure):
                with pytest.raises(InputError, match="named"):
                    call(none, 1, 1.0)
            with pytest.raises(InputError, match="named"):
                stepper.set_gravity(none, [])


def test_states_of_others() -> None:
    one, other = square().stepper(), square().stepper()
    one.step()
    saved, u = one.save(), one.u
    one.close()
    other.restore(saved)                           # it has outlived its own stepper
    assert np.array_equal(other.u, u)
    for forged in (Snapshot(0), object(), None):
        with pytest.raises(InputError):
            other.restore(forged)
    del one, saved
    Snapshot.__new__(Snapshot).__del__()           # as when the library had no memory for it
    other.step()


# ---- processes and threads ----------------------------------------------------------------------

def test_a_fork_has_a_stepper_of_its_own() -> None:
    text = in_child(f"""
import os
ring = Stepper({str(RING)!r}, h=0.05, t_end=0.3)
ring.step()
child = os.fork()
ring.run()
if child:
    assert os.waitpid(child, 0)[1] == 0
print(ring.energies()["total"], float(ring.u.sum()), flush=True)
ring.close()
if not child:
    os._exit(0)
""")
    first, second = text.splitlines()
    assert first == second


def test_a_fork_amid_a_step_is_told_that_it_cannot_go_on() -> None:
    text = in_child(f"""
import os
ring = Stepper({str(RING)!r}, h=0.05)
def fork_within(address):
    if os.fork() == 0:
        for call in (ring.step, ring.close):
            try:
                call()
            except InputError as error:
                print("refused", flush=True)
        with Stepper({str(RING)!r}, h=0.05) as another:
            another.step()
            print("another", flush=True)
        os._exit(0)
    os.wait()
    return 0
ring._handle.call(fork_within)
ring.step()
""")
    assert text.split().count("refused") == 2 and "another" in text


def test_the_interpreter_ends_with_all_kinds_alive() -> None:
    in_child(f"""
import builtins, threading, time
ring = Stepper({str(RING)!r}, h=0.01)
u = ring.u
ring.kept = [ring, ring.save(), ring.evaluate(u, 0.01), ring.constraint(u0=u, u1=u)]
builtins.kept = ring
running = Stepper({str(RING)!r}, h=0.01)
threading.Thread(target=running.run, daemon=True).start()
time.sleep(0.3)
""")


def test_opening_in_vain_costs_nothing() -> None:
    text = in_child("""
import os
from pathlib import Path
def tries(n):
    for _ in range(n):
        try:
            Stepper("there is none.inp")
        except InputError:
            pass
    return int(Path("/proc/self/statm").read_text().split()[1])
first = tries(500)
print(tries(4000) - first, len(os.listdir("/proc/self/fd")))
""")
    pages, files = map(int, text.split())
    assert pages < 64 and files < 8                # 64 bytes a time would be 62 pages


# ---- the interface ------------------------------------------------------------------------------

def test_interface_takes_no_hidden_values_and_no_contacts() -> None:
    nodes = np.array([[2.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.2, 0.1], [1.8, 0.1]])
    with pytest.raises(InputError, match="masked"):
        Interface(np.ma.masked_equal(nodes, 0.2))
    with Interface(nodes) as face:
        master = face.add_surface("lower", [[0, 1], [1, 2]])
        face.add_pair(face.add_surface("upper", [[3, 4]]), master)
        face.prepare()
        zero = np.zeros_like(nodes)
        face.begin_step(zero, zero, np.zeros(face.n_contact, bool))
        face.choose(zero, zero, np.empty(0, int), np.empty(0))
        assert face.evaluate(zero, zero).g.shape == (0, 10)


# ---- kinks --------------------------------------------------------------------------------------

def test_tangent_is_continuous_where_ends_of_surfaces_coincide() -> None:
    """Mortar integrals have no kink where the end of one surface lies on that of the other.

    Ends are rounded over 1e-2 of an edge, so the tangent changes by at most the way over that; to
    either side it is the derivative of the residual.
    """
    with Stepper(PATCH) as patch:
        patch.run(until=1.25)
        label, u, lam, active = list(patch.labels), patch.u, patch.lam, patch.active
        left, right = label.index(16), label.index(44)      # ends of the slave surface
        links = patch.links.toarray()

        def residual(u1: np.ndarray) -> np.ndarray:
            return patch.evaluate(u1, 0.25, lam=lam, active=active,
                                  with_tangent=False).unknown_residual()

        def tangent(u1: np.ndarray) -> np.ndarray:
            return patch.tangent(u1, 0.25, lam=lam, active=active).toarray()

        def moved(a: float, b: float) -> np.ndarray:
            found = u.copy()
            found[left, 0] += a
            found[right, 0] += b
            return found

        here = tangent(u)
        size = abs(here).max()
        step = EPS**(1/3)
        for a, b in ((1, -1), (1, 1), (-1, -1), (-1, 1)):
            beside = moved(1e-3*a, 1e-3*b)
            differences = np.column_stack([
                (residual(beside + step*move) - residual(beside - step*move))/(2*step)
                for move in (column.reshape(-1, 2) for column in links.T)])
            assert abs(differences - tangent(beside)).max() < 100*step**2*size
            jump = abs(tangent(moved(1e-9*a, 1e-9*b)) - here).max()/size
            assert jump < 1e-9/1e-2
        # continuous: what is left of a change of 2e-9 is that of the tangent
        assert abs(residual(moved(1e-9, -1e-9)) - residual(moved(-1e-9, 1e-9))).max() < 8e-9*size
