"""The scene that other codes are given: the same mesh, faces and cards that they can read."""

import re
import shutil
import sys

import pytest
from scene_tools import DECKS, ROOT

sys.path.insert(0, str(ROOT/"tests"/"bench"))
sys.path.insert(0, str(DECKS))

import bench_peers  # noqa: E402
from deckwriter import number  # noqa: E402
from peers import calculix, kratos  # noqa: E402
from peers.ring import Told, ring_of  # noqa: E402

RING = ring_of((64, 4), (60, 5))


def test_mesh_is_that_of_the_deck():
    lines = set((DECKS/"ring.inp").read_text().splitlines())
    assert all(f"{a}, {number(x)}, {number(y)}" in lines for a, (x, y) in RING.node.items())
    assert all(f"{k}, {', '.join(map(str, a))}" in lines for k, a in RING.element.items())
    assert RING.unknowns == 1250


def test_faces_of_contact_are_rim_and_top():
    for k in RING.outer:
        for a in RING.element[k][:2]:
            x, y = RING.node[a]
            assert abs(x**2 + (y - 10.1)**2 - 100) < 1e-12*100
    assert all(RING.node[a][1] == 0 for k in RING.top for a in RING.element[k][2:])


def test_calculix_reads_the_cards():
    """Fields of at most 20 characters; the layers move as one but where they are held."""
    text = calculix.deck(RING, 0.01, 3)
    for line in text.splitlines()[2:]:
        if not line.startswith("*"):
            assert all(len(field.strip()) <= 20 for field in line.split(","))
    assert text.count("\n2\n") == RING.unknowns
    one = re.search(r"ELSET=RING\n(.*)", text)[1].split(", ")
    assert len(one) == 9 and int(one[5]) - int(one[1]) == len(RING.node)


def test_energies_of_calculix():
    text = "".join(f"\n total {kind} energy for set ALL and time  0.1000000E+00\n\n        {e}\n"
                   for kind, e in (("internal", 1.5), ("kinetic", 2.0), ("internal", 1.0),
                                   ("kinetic", 2.4)))
    told = Told(1.0, [sum(e) for e in calculix.energies(text)], 1.0)
    assert told.energy == [3.5, 3.4] and told.error == pytest.approx(-0.1/3.5)


def test_parts_of_kratos_close():
    lines = [line.split() for line in kratos.mesh(RING).splitlines()]
    open_parts = []
    for words in lines:
        if words[0] == "Begin":
            open_parts.append(words[1])
        elif words[0] == "End":
            assert words[1] == open_parts.pop()
    assert not open_parts
    assert {m["model_part_name"] for m in kratos.materials()["properties"]} == {
        f"Structure.{words[2]}" for words in lines if words[:2] == ["Begin", "SubModelPart"]
        and words[2] in ("RING", "BLOCK")}


def peers(capsys, *arguments):
    """What `bench_peers --short` prints."""
    options = bench_peers.arguments().parse_args(["--short", *arguments])
    lines = bench_peers.compare(options)
    return lines[2:], capsys.readouterr().out


def test_codes_that_are_not_there_are_passed_over(capsys):
    rows, told = peers(capsys, "--ccx", "no_such_program", "--kratos", "/no/such/python")
    assert [row.split(" | ")[1].split()[0] for row in rows] == ["EMCON,"]*2
    assert told.count("passed over") == 2


@pytest.mark.skipif(not shutil.which("ccx"), reason="CalculiX is not installed")
def test_calculix_runs(capsys):
    rows, _ = peers(capsys, "--kratos", "/no/such/python")
    assert "CalculiX" in rows[-1]
    energy = float(rows[-1].split(" | ")[-1].split()[0])
    assert 0 < abs(energy) < 5                                # per cent: the scene is the same
