"""The report on a scene: `emcon check`, its JSON, the head of a log, the repr of a Stepper."""

import json
import math
import resource
import subprocess
import sys

import numpy as np
import pytest
from plain_scenes import AUTO, Scene
from scene_tools import DECKS, ROOT, Deck, emcon, run_deck
from space_mesh import Block

from emcon import Stepper


def report(deck, *options):
    done = emcon("check", deck, "--json", *options)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def ring():
    return report(DECKS/"ring.inp")


def test_bodies_are_those_of_the_deck(ring):
    """The foundation: a rectangle of 60 by 5, density 0.01, 1000 times as stiff as the ring."""
    annulus, block = ring["bodies"]
    assert (block["elements"], block["kind"], block["law"]) == (300, "CPE4", "coupled neo hooke")
    assert math.isclose(block["mass"], 60*5*0.01, rel_tol=1e-8)
    assert math.isclose(block["center_x"], 5, rel_tol=1e-8)
    assert math.isclose(block["center_y"], -2.5, rel_tol=1e-8)
    assert math.isclose(block["inertia"], 3*(60**2 + 5**2)/12, rel_tol=1e-8)
    box = [block[f"{side}_{axis}"] for side in ("low", "high") for axis in "xy"]
    assert box == [-25, -5, 35, 0] and math.isclose(block["smallest_distance"], 1, rel_tol=1e-8)
    modulus = block["wave_speed"]**2*0.01
    assert math.isclose(modulus, 1000*annulus["wave_speed"]**2*0.01, rel_tol=1e-7)
    assert math.isclose(block["shortest_transit"]*block["wave_speed"], 1, rel_tol=1e-8)
    (sizes,) = ring["sizes"]
    assert sum(body["unknowns"] for body in ring["bodies"]) == sizes["unknowns"] == 1250


def test_pairs_parts_and_advice(ring):
    (pair,) = ring["pairs"]
    assert (pair["slave"], pair["slave_edges"], pair["constraints"]) == ("RING_OUTER", 64, 64)
    assert math.isclose(pair["smallest_gap"], 0.1, rel_tol=1e-8)
    parts = {part["part"]: part for part in ring["parts"]}
    assert parts["contact"]["is"] == parts["inertia"]["is"] == "on"
    assert parts["ties and equations"]["is"] == "off"
    assert "*TIE" in parts["ties and equations"]["because"]
    (advice,) = ring["advice"]
    assert (advice["body"], advice["fewer_percent"]) == (2, 49)
    assert math.isclose(advice["stiffer"], 1000, rel_tol=1e-8)
    (step,) = ring["increments"]
    assert math.isclose(step["courant_number"]*step["recommended_h"], step["h"], rel_tol=1e-8)


def test_a_rigid_body_changes_the_rebound_by_less_than_is_told(ring, tmp_path):
    """The impulse of contact is what the rebound takes."""
    (advice,) = ring["advice"]
    assert math.isclose(advice["rebound_percent"], 0.1, rel_tol=1e-8)
    impulse = []
    for cards in ("", "*NODE\n9999, 0, -5\n*RIGID BODY, ELSET=BLOCK, REF NODE=9999\n"):
        deck = Deck.read(DECKS/"ring.inp")
        if cards:
            deck.replace("*BOUNDARY\nBOTTOM, 1, 2\n", cards + "*BOUNDARY\n9999, 1, 2\n9999, 6\n")
        last = run_deck(deck, tmp_path/f"{len(impulse)}", h=0.02, t_end=4).history[-1]
        impulse.append(np.array([last["pair1_impulse_x"], last["pair1_impulse_y"]]))
    change = np.linalg.norm(impulse[1] - impulse[0])/np.linalg.norm(impulse[0])
    assert 0 < 100*change < advice["rebound_percent"]


def test_what_locks_and_what_makes_a_comb_is_told(tmp_path):
    comb = ["--set", "initiation=PERSISTENT"]
    assert "advice" not in report(DECKS/"bouncing_bar.inp")
    assert "TYPE=MASSLESS" in report(DECKS/"bouncing_bar.inp", *comb)["advice"][0]["text"]
    deck = Deck.read(DECKS/"bouncing_bar.inp").text()
    before, _, after = deck.partition("*ELASTIC\n")
    first, _, rest = after.partition("\n")
    (tmp_path/"locks.inp").write_text(before + "*ELASTIC\n" + first.split(",")[0] + ", 0.4999\n"
                                      + rest)
    texts = [row["text"] for row in report(tmp_path/"locks.inp")["advice"]]
    assert any("nu = 0.4999 locks" in text for text in texts)


def plate_under_a_ball(thick):
    """A ball falls on a plate a hundred times as stiff that is clamped at two sides."""
    scene = Scene(0.01, 0.7)
    scene.ball("BALL", (0.03, 0.02, 0.52), 0.5, (2, 2), velocity=(0.0, 0.0, -1.0))
    scene.block("PLATE", (-0.9, -0.9, -thick), (1.8, 1.8, thick), (6, 6, 1), stiffness=1e4)
    return scene.hold("PLATE", lambda x, y, z: abs(x) > 0.899).deck(AUTO)


@pytest.mark.long
def test_what_can_bend_is_told_in_space(tmp_path):
    """As a rigid body a thin plate changes the impulse by more than the strain of a contact would, a thick one by less;
    the advice says which it is."""
    node = 9999
    for thick in (0.06, 1.0):
        impulse = []
        for is_rigid in (False, True):
            deck = plate_under_a_ball(thick)
            if is_rigid:
                deck.remove("*BOUNDARY")
                deck.insert(f"*NODE\n{node}, 0., 0., 0.\n*RIGID BODY, ELSET=PLATE, REF NODE={node}\n*BOUNDARY\n"
                            f"{node}, 1, 6\n", before="*STEP")
            else:
                (advice,) = [row for row in report(deck.write(tmp_path/"plate.inp"))["advice"] if "stiffer" in row]
            last = run_deck(deck, tmp_path, initiation="PERSISTENT").history[-1]
            impulse.append(np.array([last[f"pair1_impulse_{axis}"] for axis in "xyz"]))
        change = 100*np.linalg.norm(impulse[1] - impulse[0])/np.linalg.norm(impulse[0])
        assert math.isclose(advice["rebound_percent"], 1.0, rel_tol=1e-8)
        assert ("thickness" in advice) == (change > advice["rebound_percent"])
        assert ("more if it bends" in advice["text"]) == (thick < 0.5)


def test_a_comb_in_space_has_its_cure(tmp_path):
    deck = plate_under_a_ball(0.06).write(tmp_path/"plate.inp")
    texts = [row["text"] for row in report(deck, "--set", "h=1e-4", "--set", "t_end=1e-3", "--set",
                                           "initiation=PERSISTENT")["advice"]]
    assert any("TYPE=MASSLESS makes them smooth" in text for text in texts)
    texts = [row["text"] for row in report(deck, "--set", "h=1e-4", "--set", "t_end=1e-3", "--set",
                                           "initiation=AUTO")["advice"]]
    assert any("at least fourteen elements thick" in text for text in texts)


def test_ties_have_their_rows():
    told = report(DECKS/"tied_patch.inp")
    assert told["ties"] and all(tie["rows"] > 0 for tie in told["ties"])
    assert told["sizes"][0]["dependent"] > 0
    parts = {part["part"]: part["is"] for part in told["parts"]}
    assert (parts["ties and equations"], parts["contact"]) == ("on", "off")
    assert "pairs" not in told


def test_the_probe_counts_all_increments_and_leaves_no_file(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    (tmp_path/"out").mkdir()
    for name in ("two_blocks_static", "tied_rotation"):
        (cost,) = report(DECKS/f"{name}.inp")["cost"]
        run = run_deck(DECKS/f"{name}.inp", tmp_path/"out")
        assert cost["increments"] == len(run.history) - 1
        assert cost["cpu_seconds"] > 0
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_the_memory_is_that_of_a_run():
    """By the bench, a small process: what it has held itself would count for what it starts."""
    done = subprocess.run([sys.executable, ROOT/"tests/bench/report_cost.py",
                           DECKS/"two_blocks_static.inp", DECKS/"hertz.inp"],
                          capture_output=True, text=True, check=True, timeout=120)
    rows = [line.split() for line in done.stdout.splitlines()[1:]]
    assert len(rows) == 2
    assert all(1/1.5 < float(row[6]) < 1.5 for row in rows)


def test_what_takes_memory_is_told(tmp_path):
    """Of bodies in space: at least the entries of the matrix, places of nodes, a deck's own text; in
    proportion to the elements; and all of it is no more than the process has held."""
    found = []
    for n in (10, 14):
        deck = tmp_path/f"cube{n}.inp"
        mesh = Block("C3D8", (n, n, n), (1, 1, 1))
        held = "".join(f"{k}, 1, 3\n" for k in mesh.on(0, 0))
        deck.write_text(mesh.deck(
            "*HYPERELASTIC, NEO HOOKE\n20., 0.01\n", f"*BOUNDARY\n{held}*STEP, NLGEOM\n"
            "*DYNAMIC, DIRECT\n0.01, 0.01\n*DLOAD\nALL, GRAV, 1., 0., 0., -1.\n*END STEP\n"))
        told = report(deck)
        (memory,), (sizes,) = told["memory"], told["sizes"]
        del memory["text"]
        most, rest = memory.pop("most"), memory.pop("rest")
        assert sum(memory.values()) + rest < most
        assert memory["contact"] < 0.01 and memory["factors"] > memory["matrix"]/4
        entries = sizes["matrix_entries"]
        assert 12*entries < memory["matrix"]*2**20 < 18*entries
        text = deck.stat().st_size
        assert text < memory["scene"]*2**20 < 10*text
        found.append(memory["elements"]*2**20/n**3)
        run = run_deck(deck, tmp_path)
        assert run.verdict["memory"]["elements"] == pytest.approx(memory["elements"], rel=0.05)
        assert run.log.splitlines()[-1].startswith("memory: deck and mesh ")
    assert found[1] == pytest.approx(found[0], rel=0.1)
    assert found[1] < 2500


def test_bodies_that_are_iterated_hold_no_matrix(tmp_path):
    """Before there is a factor, 4 kB for each hexahedron of a large body: it has 1.07 nodes for each."""
    n = 16
    mesh = Block("C3D8", (n, n, n), (1, 1, 1))
    held = "".join(f"{k}, 1, 3\n" for k in mesh.on(0, 0))
    pushed = "".join(f"{k}, 3, {0.01*x!r}\n" for k, x in enumerate(mesh.x[:, 0].tolist(), 1))
    deck = tmp_path/"cube.inp"
    deck.write_text(mesh.deck(
        "*HYPERELASTIC, NEO HOOKE\n20., 0.01\n",
        f"*BOUNDARY\n{held}*INITIAL CONDITIONS, TYPE=VELOCITY\n{pushed}*STEP, NLGEOM\n"
        "*DYNAMIC, DIRECT, SOLVER=ITERATIVE\n0.01, 0.03\n*END STEP\n"))
    (sizes,) = report(deck)["sizes"]
    run = run_deck(deck, tmp_path)
    memory = run.verdict["memory"]
    assert memory["factors"] > 0
    assert memory["matrix"]*2**20 < 8*sizes["matrix_entries"]
    held = sum(memory[name] for name in ("scene", "elements", "matrix"))
    assert held*2**20/(n + 1)**3 < 4000/1.07


def block(n, force=10.0):
    """A soft block of n by n elements, pulled at a corner by more than it can bear."""
    node = "".join(f"{1 + i + (n + 1)*j}, {i/n}, {j/n}\n" for j in range(n + 1) for i in range(n + 1))
    first = [(i, j, 1 + i + (n + 1)*j) for j in range(n) for i in range(n)]
    element = "".join(f"{1 + i + n*j}, {k}, {k + 1}, {k + n + 2}, {k + n + 1}\n" for i, j, k in first)
    return (f"*NODE\n{node}*ELEMENT, TYPE=CPE4, ELSET=E\n{element}*MATERIAL, NAME=M\n"
            "*HYPERELASTIC, NEO HOOKE\n20., 0.01\n*SOLID SECTION, ELSET=E, MATERIAL=M\n"
            f"*NSET, NSET=BASE, GENERATE\n1, {n + 1}\n*BOUNDARY\nBASE, 1, 2\n*STEP, NLGEOM\n*STATIC\n"
            f"1., 1.\n*CLOAD\n{(n + 1)**2}, 1, {force}\n*END STEP\n")


def test_a_probe_that_fails_says_why(tmp_path):
    (tmp_path/"hard.inp").write_text(block(2, 1e6))
    (cost,) = report(tmp_path/"hard.inp")["cost"]
    assert "of the probe fails: the analysis stops at time" in cost["text"]


def test_a_probe_of_an_increment_that_takes_long_ends(tmp_path):
    """A second of processor time, where the increment alone takes more than ten."""
    (tmp_path/"long.inp").write_text(block(60))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    (cost,) = report(tmp_path/"long.inp")["cost"]
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert "cpu_seconds" not in cost and "not predicted" in cost["text"]
    assert after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime < 5


def test_a_log_begins_with_it_and_makes_no_probe(ring, tmp_path):
    log = run_deck(DECKS/"ring.inp", tmp_path, h=0.05, t_end=0.1, frame=1).log
    assert all(body["text"] in log for body in ring["bodies"])
    assert "cost:" not in log
    text = emcon("check", DECKS/"ring.inp").stdout
    assert ring["bodies"][0]["text"] in text
    assert "cost: expected" in text


def test_json_is_of_check_alone(tmp_path):
    done = emcon("run", DECKS/"ring.inp", "--json", "--output", tmp_path)
    assert done.returncode == 2
    assert "--json is for emcon check" in done.stderr


def test_a_stepper_shows_it(ring):
    with Stepper(DECKS/"ring.inp") as stepper:
        before = stepper.u.copy()
        assert stepper.report()["bodies"] == ring["bodies"]
        assert ring["pairs"][0]["text"] in repr(stepper)
        assert "<table>" in stepper._repr_html_()
        assert (stepper.u == before).all()


def test_asking_changes_no_bits():
    with Stepper(DECKS/"two_bodies.inp", h=0.02) as asked, \
            Stepper(DECKS/"two_bodies.inp", h=0.02) as silent:
        for _ in range(30):
            asked.step()
            asked.report()
            silent.step()
        assert asked.active.any() or np.abs(asked.v).max() > 0
        assert (asked.u == silent.u).all() and (asked.v == silent.v).all()
