"""A few cases of each fuzzer, `make soak` runs more; the comparison of two programs."""

import json
import random

import pytest
import same_bits
from drawn_scenes import draw_case
from field_check import faults
from random_scenes import SCENES, UNGUARDED, Outcome, judge
from random_space import FAULTS, fuzz_space
from scene_tools import DECKS, PROGRAM, Run, run_deck
from scene_table import judge_seed, table
from soak import FUZZERS, soak
from space_crowds import judge as judge_crowd
from space_crowds import scene

CASES = {"decks": 25, "crossed": 3, "restart": 12, "calls": 4, "kill": 1, "scenes": 12, "space": 10, "words": 20, "damaged": 20}


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.long]*(name == "kill")) for name in FUZZERS])
def test_a_few_cases(name, tmp_path):
    assert soak(name, 1, tmp_path, cases=CASES[name]) == CASES[name]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.__name__)
def test_each_fault_in_space(fault, tmp_path):
    for seed in range(6):
        fuzz_space(random.Random(seed), tmp_path, fault)


def test_the_judge_of_scenes_sees_what_is_told_wrong(tmp_path):
    scene = SCENES["ledge"]()
    done = Outcome(scene, tmp_path, UNGUARDED, formulation="NODE TO SURFACE")
    assert judge(scene, done, meets_itself=False) == ""
    told = tmp_path / "scene.json"
    told.write_text(json.dumps(done.run.verdict | {"verdict": "good", "penetration": 0.0}) + "\n")
    done.run = Run(tmp_path / "scene")
    assert "told good" in judge(scene, done, meets_itself=False)


def test_bits_of_two_programs(tmp_path, capsys, monkeypatch):
    """A program has the bits of itself, and not those of one that takes another step."""
    monkeypatch.setattr(same_bits, "STORE", tmp_path)
    other = tmp_path / "other"
    other.write_text(f'#!/bin/sh\nexec "{PROGRAM}" "$@" --set=h=0.02\n')
    other.chmod(0o755)
    deck = [DECKS / "two_blocks_static.inp", DECKS / "bouncing_bar.inp"]
    assert same_bits.compare(PROGRAM, PROGRAM, deck) == 0
    assert same_bits.compare(PROGRAM, other, deck[1:]) == 1
    assert "bouncing_bar.inp: .csv, .h5, .json, .vtkhdf" in capsys.readouterr().out


def test_drawn_scenes_are_right_and_called_right(tmp_path):
    """Rigid, static, rubbing, mortar and segments: a corner that mortar alone lets in is seed 16, a
    static body of which all contacts slide seed 225, rows of rigid bodies beside them seed 470."""
    results = [judge_seed(seed, tmp_path / str(seed)) for seed in (1, 6, 15, 16, 30, 79, 225, 470)]
    lines, wrong = table(results)
    assert not wrong and [r["verdict"] for r in results] == ["good"]*8, lines


def test_scenes_whose_contacts_need_a_soft_problem(tmp_path):
    """Iterates that no forces solve unless contacts give way by a good part of W: stiffer ones were
    cut five times."""
    results = [judge_seed(seed, tmp_path / str(seed)) for seed in (8, 234, 426)]
    assert sum(r["cuts"] for r in results) <= 1 and [r["verdict"] for r in results] == ["good"]*3


def test_what_a_warning_tells_is_not_called_good(tmp_path):
    """Directions of forces, of contact across gaps; nothing else, and no other warning."""
    result = judge_seed(1, tmp_path)
    gaps = ["contact forces act across gaps of 0.3 of an edge on average (weighted by impulse): ..."]
    for faults, warnings, is_wrong in [({"push": "x"}, gaps, False), ({"push": "x"}, [], True),
                                       ({"push": "x", "energy": "y"}, gaps, True)]:
        lines, wrong = table([result | {"faults": faults, "warnings": warnings}])
        assert bool(wrong) == is_wrong and (f"wrong and warned of: {1 - is_wrong}" in lines)


def test_the_judge_of_fields_sees_what_is_wrong(tmp_path):
    """Each field changed in one frame breaks what it stands in."""
    case = draw_case(1)
    judge_seed(1, tmp_path)
    fields = Run(tmp_path / "scene").fields()
    cut = [False]*len(fields.time)
    assert faults(case, fields, cut) == {}
    for name, broken in (("velocity", {"balance", "momenta", "energy"}), ("contact_force", {"balance"}),
                         ("displacement", {"energy"})):
        whole = fields._data[name]
        fields._data[name] = whole.copy()
        fields._data[name][-1, :8] += 0.01
        assert broken <= set(faults(case, fields, cut)), name
        fields._data[name] = whole


def test_the_judge_of_fields_sees_a_pull(tmp_path):
    """Dual multipliers pull at nodes by what follows from pressures beside them, and by no more."""
    judge_seed(55, tmp_path)
    case, fields = draw_case(55), Run(tmp_path / "scene").fields()
    cut = [False]*len(fields.time)
    assert faults(case, fields, cut) == {}
    fields._data["contact_pressure"] = 0.3*fields["contact_pressure"]
    assert set(faults(case, fields, cut)) == {"push"}


@pytest.mark.parametrize("seed", [1, 15])
def test_crowds_in_space(seed, tmp_path):
    """Bodies that fly and bodies that rest, right by a judge that sees what is moved."""
    deck = tmp_path / "scene.inp"
    deck.write_text(scene(seed))
    run = run_deck(deck, tmp_path)
    assert run.verdict["verdict"] == "good" and judge_crowd(run, scene(seed)) == []
    run.fields()["displacement"][1] += 0.01*run.fields().x
    if "*STATIC" in scene(seed):
        run.fields()["reaction_force"][-1] *= 1.01
    assert judge_crowd(run, scene(seed)) != []


def test_a_crowd_in_space_that_rubs(tmp_path):
    """Friction takes energy at each elastic node, also in increments at the end of which it stops rigid bodies."""
    text = scene(36, friction=True)
    assert "RIGID BODY" in text
    deck = tmp_path / "scene.inp"
    deck.write_text(text)
    run = run_deck(deck, tmp_path)
    assert run.verdict["verdict"] == "good" and judge_crowd(run, text) == []


def test_a_crowd_whose_nodes_slide_off_corners(tmp_path):
    """Behind the corner that they leave there is another body, farther off than contact begins: nothing pushes it."""
    text = scene(11, mortar=True)
    deck = tmp_path / "scene.inp"
    deck.write_text(text)
    run = run_deck(deck, tmp_path)
    assert run.verdict["verdict"] == "good" and judge_crowd(run, text) == []
