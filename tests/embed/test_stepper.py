"""The Python stepper against the batch program, its errors, and the kernels it can call."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT/name) for name in ("pywrap", "tests/scenes")]

from space_mesh import Block  # noqa: E402

from emcon.kernels import LAWS, law_response, nts_gap  # noqa: E402
from emcon.stepper import AnalysisError, InputError, Stepper  # noqa: E402

RING = ROOT/"input_decks"/"ring.inp"
EMCON = os.environ.get("EMCON", str(ROOT/"build"/"release"/"emcon"))
EPS = np.finfo(float).eps
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
*STEP, NLGEOM
*DYNAMIC, DIRECT
0.1, 0.1
*END STEP
"""


def test_stepper_gives_the_bits_of_the_batch_run(tmp_path: Path) -> None:
    subprocess.run([EMCON, str(RING), "--output", str(tmp_path), "--quiet", "--set", "h=0.05",
                    "--set", "t_end=0.5"], check=True)
    with open(tmp_path/"ring.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    with Stepper(RING, h=0.05, t_end=0.5) as ring:
        for row in rows[1:]:
            increment = ring.step()
            values = ring.energies() | ring.momenta() | {"time": increment.time}
            assert values.pop("potential") == 0.0          # no forces are given: no column
            assert increment.newton == int(row["newton"])
            assert increment.active == int(row["active"])
            for name, value in values.items():
                assert value == float(row[name]), name
        assert ring.is_done
        of_run = json.loads((tmp_path/"ring.json").read_text(encoding="utf-8"))
        for name in ("seconds", "counts", "memory"):                   # of the run alone
            assert of_run.pop(name)
        assert ring.verdict() == of_run


def test_verdict_goes_with_the_state() -> None:
    """Mean gaps let nodes in; what is set is no error of the balance, what is restored forgets."""
    deck = ROOT/"input_decks"/"two_bodies.inp"
    with Stepper(deck, h=0.01) as bodies:
        start = bodies.save()
        while bodies.time < 0.3:
            increment = bodies.step()
        found = bodies.verdict()
        error = found["largest_energy_error"]/found["largest_energy"]
        assert 0 < increment.penetration <= found["penetration"]
        assert found["verdict"] == "good" and found["penetration"] > 1e-3
        bodies.set_state(v=2*bodies.v)
        assert bodies.verdict()["largest_energy_error"] < 1e-12 and error < 1e-12
        bodies.restore(start)
        assert bodies.verdict()["penetration"] == 0 and bodies.verdict()["newton"] == 0


def test_two_models_side_by_side_do_not_meet() -> None:
    with Stepper(RING, h=0.05) as a, Stepper(RING, h=0.02) as b, Stepper(RING, h=0.05) as c:
        for _ in range(3):
            a.step()
            b.step()
        for _ in range(3):
            c.step()
        assert np.array_equal(a.u, c.u) and np.array_equal(a.v, c.v)
        assert not np.array_equal(a.u, b.u)


def test_models_in_threads_give_the_bits_of_one_alone() -> None:
    def run(formulation: str) -> tuple[list[float], np.ndarray]:
        with Stepper(RING, h=0.05, t_end=2, formulation=formulation) as ring:
            totals = []
            while not ring.is_done:
                ring.step()
                totals.append(ring.energies()["total"])
            return totals, ring.u

    formulations = ["NODE TO SURFACE", "MORTAR", "SEGMENT", "NODE TO SURFACE", "MORTAR"]
    alone = {formulation: run(formulation) for formulation in set(formulations)}
    with ThreadPoolExecutor(len(formulations)) as pool:
        together = list(pool.map(run, formulations))
    for formulation, (totals, u) in zip(formulations, together):
        assert totals == alone[formulation][0]
        assert np.array_equal(u, alone[formulation][1])


def test_orderings_in_threads_give_the_bits_of_one_alone(tmp_path: Path) -> None:
    """METIS, which orders cubes of so many elements, draws from the generator of the process."""
    def run(deck: Path) -> np.ndarray:
        with Stepper(deck) as cube:
            cube.step()
            return cube.u

    decks = []
    for n in (12, 13):
        mesh = Block("C3D8", (n, n, n))
        held = "".join(f"{k}, 1, 3\n" for k in mesh.on(0, 0))
        decks.append(tmp_path/f"cube{n}.inp")
        decks[-1].write_text(mesh.deck(
            "*HYPERELASTIC, NEO HOOKE\n20., 0.01\n*DENSITY\n1.\n", f"*BOUNDARY\n{held}*STEP, NLGEOM\n"
            "*DYNAMIC, DIRECT, SOLVER=DIRECT\n0.1, 0.1\n*DLOAD\nALL, GRAV, 1., 0., 0., -1.\n*END STEP\n"))
    alone = [run(deck) for deck in decks]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(run, 6*decks))
    assert all(np.array_equal(u, alone[k % 2]) for k, u in enumerate(together))


def test_closed_models_leave_no_memory(tmp_path: Path) -> None:
    """A model of one element, opened and closed over and over, and once with an error each."""
    deck = tmp_path/"one.inp"
    deck.write_text(ONE_ELEMENT)

    def cycles(n: int) -> int:
        for k in range(n):
            with Stepper(deck) as one:
                one.step()
            with pytest.raises(InputError):
                Stepper(deck, none=k)
        return int(Path("/proc/self/statm").read_text().split()[1])

    first = cycles(200)
    assert cycles(1000) - first < 256       # pages: one more allocation of 1 kB a cycle is as much


def test_state_arrays_have_the_documented_shapes() -> None:
    with Stepper(RING, h=0.05) as ring:
        ring.step()
        assert ring.u.shape == ring.v.shape == ring.q.shape == (ring.n_node, 2)
        assert np.array_equal(ring.q, ring.positions + ring.u)
        lam, active, label = ring.contact()
        assert lam.shape == active.shape == label.shape == (ring.n_constraint,)
        assert (lam[active] > 0.0).all() and not lam[~active].any()
        assert set(label) <= set(ring.labels)


def test_errors_are_exceptions_with_the_message(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        Stepper(tmp_path/"none.inp")
    bad = tmp_path/"bad.inp"
    bad.write_text("*NODE\n1, 0., 0.\n*ELEMNT, TYPE=CPE4\n")
    with pytest.raises(InputError, match=r"(?s)bad\.inp:3: .*ELEMENT"):
        Stepper(bad)
    with pytest.raises(InputError, match="HH"):
        Stepper(RING, hh=1)
    ring = Stepper(RING, h=8)
    ring.close()
    with pytest.raises(InputError, match="closed"):
        ring.step()
    with Stepper(RING, h=0.05, t_end=0.05) as ring:
        ring.step()
        with pytest.raises(InputError, match="end"):
            ring.step()


def test_failed_analysis_keeps_the_model_usable() -> None:
    with Stepper(RING, h=0.05, tolerance="1e-300") as ring:
        first = ring.energies()
        try:
            ring.step()
        except AnalysisError:
            pass
        assert set(ring.energies()) == set(first) and np.isfinite(ring.u).all()


def test_open_and_close_do_not_pile_up_models(tmp_path: Path) -> None:
    deck = tmp_path/"one.inp"
    deck.write_text(ONE_ELEMENT)
    for _ in range(300):                    # more than the table of models holds
        one = Stepper(deck)
        assert one.n_node == 4
        one.close()


@pytest.mark.parametrize("law", LAWS)
def test_law_kernel_is_a_discrete_gradient(law: str) -> None:
    rng = np.random.default_rng(1)
    constants = [0.3 if name == "nu" else 1.0 for name in LAWS[law].constants]
    for size in (1.0, 1e-8, 1e-150):
        strain, dstrain = 0.1*rng.standard_normal((2, 3))
        dstrain *= size
        step = law_response(law, constants, strain, dstrain)
        change = step.energy - law_response(law, constants, strain).energy
        scale = abs(step.energy) + np.abs(step.stress)@np.abs(dstrain)
        assert abs(step.stress@dstrain - change) <= 16*EPS*scale


def test_gap_kernel_is_a_discrete_gradient() -> None:
    rng = np.random.default_rng(2)
    x0 = np.array([[0.5, 0.2], [1.0, 0.0], [0.0, 0.0], [2.0, -0.2], [-1.0, -0.3]])
    for size in (0.8, 1e-6, 1e-200):
        dx = size*(rng.random((5, 2)) - 0.5)
        gap = nts_gap(x0, dx)
        assert abs(gap.g@dx.ravel() - gap.dgap) <= 32*EPS*np.abs(gap.g)@np.abs(dx.ravel())
        assert np.abs(gap.g.reshape(5, 2).sum(axis=0)).max() <= 16*EPS
