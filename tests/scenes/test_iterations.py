"""Conjugate gradients in place of factors: the same steps, the same bits for any threads."""

import json
import pathlib
import sys

import numpy as np
import pytest
from scene_tools import Deck, emcon, run_deck
from space_mesh import Block

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1]/"bench"))

from peers import plate  # noqa: E402

SOLVERS = ("DIRECT", "ITERATIVE")
LAWS = {"linear": ("*ELASTIC\n1., 0.3\n", ""), "NLGEOM": ("*HYPERELASTIC, NEO HOOKE\n0.2, 2.4\n", ", NLGEOM")}


def ball_on_plate(solver):
    """A ball falls onto a plate, 14 increments: contact without friction opens and closes."""
    deck = Deck(plate.deck(plate.scene(((3, 2), (6, 6, 2))), 0.005, 14), "plate")
    deck.replace("*DYNAMIC, DIRECT", f"*DYNAMIC, DIRECT, SOLVER={solver}")
    return deck


def sheared_block(law, solver, held=True):
    """A block, held below if `held`, whose top is moved sideways or pulled."""
    mesh = Block("C3D8", (5, 4, 4), (1, 1, 1))
    below = "".join(f"{k}, 1, 3\n" for k in mesh.on(2, 0))
    above = "".join(f"{k}, 1, 0.001\n" for k in mesh.on(2, 1))
    card, nlgeom = LAWS[law]
    fixed = f"*BOUNDARY\n{below}" if held else ""
    return Deck(mesh.deck(card, f"{fixed}*STEP{nlgeom}\n*STATIC, SOLVER={solver}, DIRECT\n1., 2.\n"
                          f"*CLOAD\n{above}*NODE FILE\nU, RF\n*END STEP\n"), "block")


def assert_near(first, second, names, tolerance):
    for name in names:
        scale = np.abs(first[name]).max()
        assert scale > 0
        np.testing.assert_allclose(first[name], second[name], rtol=0, atol=tolerance*scale)


def test_dynamics(tmp_path):
    """The same contacts act, and fields agree to what two runs differ by that round otherwise.

    Steps end at round-off of the forces; what that leaves grows by a few digits in impacts, as
    it does between UMFPACK and MUMPS (test_methods.py, 1e-9).
    """
    runs = [run_deck(ball_on_plate(solver), tmp_path/solver) for solver in SOLVERS]
    assert runs[0].history["active"].max() >= 2
    np.testing.assert_array_equal(runs[0].history["active"], runs[1].history["active"])
    assert_near(runs[0].fields(), runs[1].fields(), ("displacement",), 1e-9)
    assert runs[1].verdict["largest_energy_error"] < 1e-12*runs[1].verdict["largest_energy"]
    # Corrections by a hundredth gain what those of a factor gain, which is old.
    counts = [run.verdict["counts"]["residuals"] for run in runs]
    assert counts[1] <= 1.2*counts[0]


def test_threads(tmp_path):
    """Nothing of a solution depends on how many threads there are."""
    fields = [run_deck(ball_on_plate("ITERATIVE"), tmp_path/n, options=("--threads", n)).fields()
              for n in ("1", "2", "3")]
    for other in fields[1:]:
        for name in sorted(fields[0].names()):
            np.testing.assert_array_equal(fields[0][name], other[name])


@pytest.mark.parametrize("law", LAWS)
def test_statics(tmp_path, law):
    """Newton's method ends at round-off with either; a block's condition is below 1e4."""
    fields = [run_deck(sheared_block(law, solver), tmp_path/solver).fields() for solver in SOLVERS]
    assert_near(*fields, ("displacement", "reaction_force"), 1e-11)


def test_free_body(tmp_path):
    """What nothing holds has no solution: iterations do not end, and what follows tells as much."""
    errors = []
    for solver in SOLVERS:
        deck = sheared_block("linear", solver, held=False).write(tmp_path/f"{solver}.inp")
        done = emcon("run", deck, "--output", tmp_path/solver)
        assert done.returncode != 0
        errors.append(done.stderr.replace(solver, "SOLVER"))
    assert errors[0] == errors[1]


@pytest.mark.parametrize("solver", SOLVERS)
def test_report(tmp_path, solver):
    """The report tells how the systems are solved, and what factors would take."""
    deck = sheared_block("NLGEOM", solver).write(tmp_path/"block.inp")
    report = json.loads(emcon("check", deck, "--json").stdout)
    text = json.dumps(report)
    assert ("spared_entries" in text) == (solver == "ITERATIVE")
    assert ("factor_entries" in text) == (solver == "DIRECT")
