"""A step as one problem of its contacts: what acts, sticks and slides is found with the motion."""

import math

import numpy as np
import plain_scenes
import pytest
from friction_scenes import (
    arch,
    arch_needs,
    balance,
    block_on_floor,
    pressed_round,
    stack_on_slope,
)
from plain_scenes import BOTH, ONE
from scene_tools import has_fused_products, run_deck

NODES = "NODE TO SURFACE"


def obeys(run):
    """The laws hold, the energy balance closes, friction takes."""
    assert run.verdict["verdict"] == "good" and balance(run.history) < 1e-12
    if "law_violation" in run.verdict:
        assert run.verdict["law_violation"] <= 1e-10


@pytest.mark.parametrize("formulation", [NODES, "MORTAR"])
def test_one_solution(formulation, tmp_path):
    """Damped, a block that slides has one motion: that of the other methods, but for round-off."""
    deck = block_on_floor(0.01, 0.4, 0.3, v0=2.0, eta=2e-3)
    runs = [run_deck(deck, tmp_path / method.replace(" ", "_"), formulation=formulation, method=method)
            for method in ("NULL SPACE", "SADDLE POINT")]
    for run in runs:
        obeys(run)
    u = [run.fields()["displacement"] for run in runs]
    assert np.abs(u[1] - u[0]).max() < 1e-11*np.abs(u[0]).max()


@pytest.mark.parametrize("mu", [0.15, 0.25])
def test_a_stack(mu, tmp_path):
    """Nodes on nodes, held from both sides: rows that follow from others. No increment is cut, and
    what is held to stay does."""
    run = run_deck(stack_on_slope(mu, -math.atan(0.2), sides=BOTH), tmp_path, formulation=NODES,
                   method="SADDLE POINT")
    obeys(run)
    assert run.history["cuts"].sum() == 0
    moved = np.abs(run.fields()["displacement"][-1]).max()
    assert (moved > 0.02) == (mu < 0.2)


@pytest.mark.parametrize("part", [0.8, pytest.param(6.0, marks=pytest.mark.long)])
def test_an_arch(part, tmp_path):
    run = run_deck(arch(part*arch_needs(), BOTH, t_end=0.2), tmp_path, formulation=NODES,
                   method="SADDLE POINT")
    obeys(run)
    # Where rounding is coarser Newton's method stalls twice before the first increment is solved.
    assert run.history["cuts"].sum() <= (0 if has_fused_products() else 2)


@pytest.mark.parametrize(("scene", "sides", "formulation", "most"), [
    ("comb", BOTH, NODES, 2), ("tower", BOTH, NODES, 1), ("pile", BOTH, NODES, 1),
    ("bowl", ONE, "MORTAR", 1)])
def test_few_cuts(scene, sides, formulation, most, tmp_path):
    """Many bodies meet at once, by each method that holds contact exactly."""
    deck = (plain_scenes.SCENES.get(scene) or getattr(plain_scenes, scene))().deck(sides)
    for method in ("NULL SPACE", "SADDLE POINT"):
        run = run_deck(deck, tmp_path / method.replace(" ", "_"), formulation=formulation, method=method)
        obeys(run)
        assert run.history["cuts"].sum() <= most, method


@pytest.mark.parametrize("scene", ["pile", "comb"])
def test_gaps_that_close_to_nothing(scene, tmp_path):
    """Contacts of both sides that say nearly the same, with targets that do not: the problem that is
    condensed far from the solution has none of its own."""
    deck = (plain_scenes.SCENES.get(scene) or getattr(plain_scenes, scene))().deck(BOTH)
    run = run_deck(deck, tmp_path, formulation=NODES, initiation="ADMISSIBLE")
    obeys(run)
    assert run.history["cuts"].sum() <= 6


def test_statics(tmp_path):
    """A round body that is pressed on and rubs: the state of equilibrium of the other methods, to the
    part of an edge, all shorter than 4, by which stencils may be those of another motion."""
    deck, _ = pressed_round(32, layers=6)
    u = []
    for method in ("NULL SPACE", "SADDLE POINT"):
        run = run_deck(deck, tmp_path / method.replace(" ", "_"), method=method)
        assert run.verdict["verdict"] == "good"
        u.append(run.fields()["displacement"])
    assert np.abs(u[1] - u[0]).max() < 4*np.sqrt(np.finfo(float).eps)


#: A block on a floor, held beside contact by a strip that is as soft as asked for alone.
WEAKLY_HELD = """*NODE, NSET=ALL
1, -1., -1.
2, 2., -1.
3, 2., 0.
4, -1., 0.
5, 0., 0.
6, 1., 0.
7, 1., 1.
8, 0., 1.
9, 3., .5
10, 3., 1.
11, 1., .5
12, 0., .5
*ELEMENT, TYPE=CPE4, ELSET=FLOOR
1, 1, 2, 3, 4
*ELEMENT, TYPE=CPE4, ELSET=BLOCK
2, 5, 6, 11, 12
4, 12, 11, 7, 8
*ELEMENT, TYPE=CPE4, ELSET=STRIP
3, 11, 9, 10, 7
*SURFACE, NAME=TOP
1, S3
*SURFACE, NAME=FOOT
2, S1
*MATERIAL, NAME=HARD
*ELASTIC
1e6, 0.
*MATERIAL, NAME=SOFT
*ELASTIC
<soft>, 0.
*SOLID SECTION, ELSET=FLOOR, MATERIAL=HARD
*SOLID SECTION, ELSET=BLOCK, MATERIAL=HARD
*SOLID SECTION, ELSET=STRIP, MATERIAL=SOFT
*CONTACT PAIR, INTERACTION=I, TYPE=<formulation>
FOOT, TOP
*SURFACE INTERACTION, NAME=I
*BOUNDARY
1, 1, 2
2, 1, 2
3, 1, 2
4, 1, 2
9, 1, 2
10, 1, 2
*STEP
*STATIC
*DLOAD
4, P3, <load>
*NODE FILE
U
*CONSTRAINT METHOD, TYPE=<method>
*END STEP
"""


@pytest.mark.parametrize("method", ["SADDLE POINT", "NULL SPACE"])
def test_a_body_that_a_spring_holds_weakly(method, tmp_path):
    """Neither the size of the load nor that of the spring decides whether it runs, or how soon: it
    stands by the load over the stiffness of its own height, 1/E."""
    newton = []
    for load in (1e-3, 1.0, 1e3):
        for soft in (1e-3, 1.0, 1e3):
            text = WEAKLY_HELD
            for name, value in (("soft", soft), ("load", load), ("formulation", NODES), ("method", method)):
                text = text.replace(f"<{name}>", str(value))
            folder = tmp_path / f"{load}_{soft}"
            folder.mkdir()
            (folder / "scene.inp").write_text(text)
            run = run_deck(folder / "scene.inp", folder)
            assert run.verdict["verdict"] == "good" and run.history["cuts"].sum() == 0
            u = run.fields()["displacement"][-1]
            np.testing.assert_allclose(u[[6, 7], 1], -load/1e6, rtol=2e-2 if soft > 1 else 1e-4)
            newton.append(run.history["newton"].sum())
    # Sets are tried first with the null space.
    assert max(newton) <= 2*min(newton)
