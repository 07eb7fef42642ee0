"""Decks of parts and instances: the same runs as of the flat decks that say the same."""

import re

import numpy as np
import pytest
from scene_tools import EPSILON, Deck, emcon, run_deck

#: A square of four elements, 1 wide, its lower edge BELOW and its upper one ABOVE.
NODES = [(k, (k - 1) % 3/2, (k - 1)//3/2) for k in range(1, 10)]
ELEMENTS = [(1, 1, 2, 5, 4), (2, 2, 3, 6, 5), (3, 4, 5, 8, 7), (4, 5, 6, 9, 8)]
LAW = "*MATERIAL, NAME=M\n*ELASTIC\n100., 0.3\n*DENSITY\n1.\n"
STEP = """*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I, TYPE=SURFACE TO SURFACE
{over}, {under}
*BOUNDARY
{foot}, 1, 2
{top}, 1
*STEP, NAME=Press, NLGEOM=YES
*STATIC
0.5, 1.
*BOUNDARY
{top}, 2, 2, -0.05
*CLOAD
{node}, 1, 0.01
*OUTPUT, FIELD, VARIABLE=PRESELECT
*END STEP
"""
PART = "\n".join([
    "** PARTS", "*Part, name=Square", "*Node", *(f"{k:7d}, {x:12}, {y:12}" for k, x, y in NODES),
    "*Element, type=CPE4", *(", ".join(map(str, e)) for e in ELEMENTS),
    "*Nset, nset=ABOVE, generate", " 7,  9,  1", "*Nset, nset=BELOW", " 1, 2, 3",
    "*Elset, elset=All, generate", " 1,  4,  1", "*Elset, elset=UP", "3, 4", "*Elset, elset=Both", "All, UP",
    "*Surface, type=ELEMENT, name=LOWER", "1, S1", "2, S1", "*Surface, type=ELEMENT, name=UPPER", "UP, S3",
    "*Solid Section, elset=Both, material=M", ",", "*End Part", "**\n"])
ASSEMBLY = """*Assembly, name=Assembly
**
*Instance, name=Base-1, part=Square
*End Instance
*Instance, name=Punch-1, part=Square
          0.25,           1.,           0.
*End Instance
*Nset, nset=Top, internal, instance=Punch-1, generate
 7,  9,  1
*Nset, nset=Foot
Base-1.BELOW,
*Elset, elset=_Under_S3, internal, instance=Base-1
 3, 4
*Surface, type=ELEMENT, name=Under
_Under_S3, S3
*End Assembly
"""
PARTS = PART + ASSEMBLY + LAW + STEP.format(over="Punch-1.LOWER", under="Under", foot="Foot", top="Top",
                                            node="Base-1.5")


def flat(place=lambda x, y: (x + 0.25, y + 1.0)):
    """The same by hand, labels of the second square ten higher."""
    lines = ["*NODE"]
    for base, where in ((0, lambda x, y: (x, y)), (10, place)):
        lines += [f"{k + base}, {where(x, y)[0]!r}, {where(x, y)[1]!r}" for k, x, y in NODES]
    lines += ["*ELEMENT, TYPE=CPE4, ELSET=ALL"]
    lines += [", ".join(str(n + base) for n in e) for base in (0, 10) for e in ELEMENTS]
    lines += ["*NSET, NSET=TOP", "17, 18, 19", "*NSET, NSET=FOOT", "1, 2, 3", "*SURFACE, NAME=OVER", "11, S1",
              "12, S1", "*SURFACE, NAME=UNDER", "3, S3", "4, S3", "*SOLID SECTION, ELSET=ALL, MATERIAL=M"]
    return "\n".join(lines) + "\n" + LAW + STEP.format(over="OVER", under="UNDER", foot="FOOT", top="TOP", node="5")


def test_instances_are_the_flat_deck(tmp_path):
    """Bit by bit."""
    runs = [run_deck(Deck(text, "deck"), tmp_path/name) for name, text in (("parts", PARTS), ("flat", flat()))]
    assert runs[0].verdict["verdict"] == "good" and "warning: " not in runs[0].errors
    assert "labels BASE-1 + 0, PUNCH-1 + 10" in runs[0].log
    assert runs[0].digits() == runs[1].digits()
    fields = [run.fields() for run in runs]
    assert np.array_equal(fields[0].x, fields[1].x)
    assert np.array_equal(fields[0]["displacement"][-1], fields[1]["displacement"][-1])


@pytest.mark.parametrize("axis, place", [
    ("2., 0., 0., 2., 0., 1., 90.", lambda x, y: (2 - y, x - 2)),
    ("0.5, 0., 0., 0.5, 0., -3., -180.", lambda x, y: (1 - x, -y)),
    ("0., 0., 0., 0., 0., 1., 30.", lambda x, y: (np.sqrt(0.75)*x - y/2, x/2 + np.sqrt(0.75)*y)),
])
def test_an_instance_is_moved_and_then_turned(axis, place, tmp_path):
    text = PARTS.replace("          0.25,           1.,           0.\n", f"-2., 3., 0.,\n{axis},,\n")
    deck = tmp_path/"deck.inp"
    deck.write_text(text.replace("*STATIC\n0.5, 1.\n", "*STATIC\n0.5, 1.\n*CONTROLS\n").replace(
        "*CONTACT PAIR, INTERACTION=I, TYPE=SURFACE TO SURFACE\nPunch-1.LOWER, Under\n", ""))
    emcon(deck, "--quiet", "--output", tmp_path)
    x = run_deck(Deck(deck.read_text(), "moved"), tmp_path).fields().x
    expected = np.array([place(x - 2.0, y + 3.0) for _, x, y in NODES])
    # Coordinates of size 5, of some sums.
    assert np.abs(x[9:, :2] - expected).max() <= 32*EPSILON*5


def test_nodes_of_the_assembly_have_labels_of_their_own(tmp_path):
    """A reference node 1 beside the nodes 1 of both squares: the upper one is rigid."""
    own = "*Node\n      1, 0.75, 2.5, 0.\n*Nset, nset=Ref, internal\n1,\n*End Assembly\n"
    text = PARTS.replace("*End Assembly\n", own).replace("*SURFACE INTERACTION", "*Rigid Body, ref node=Ref, "
                                                         "elset=Punch-1.All\n*SURFACE INTERACTION")
    text = text.replace("Top, 1\n", "Ref, 1\nRef, 6\n").replace("Top, 2, 2", "Ref, 2, 2")
    run = run_deck(Deck(text, "deck"), tmp_path)
    assert run.verdict["verdict"] == "good"
    u = run.fields()["displacement"][-1]
    assert np.allclose(u[9:], u[9], rtol=0, atol=16*EPSILON) and u[9, 1] == pytest.approx(-0.05)


def test_a_profile_goes_with_its_instance(tmp_path):
    """An analytical surface of a part that is moved and turned, its reference node by its label."""
    wall = ("*Part, name=Wall\n*Node\n7, 0., 0., 0.\n*Surface, type=SEGMENTS, name=Face\n"
            "START, 0., -3.\nLINE, 0., -1.\nCIRCL, 0., 1., -5., 0.\n*End Part\n")
    instance = "*Instance, name=Wall-1, part=Wall\n0.25, 0., 0.\n0., 0., 0., 0., 0., 1., -90.\n*End Instance\n"
    body = ("*Node\n      1, 0., 0.3, 0.\n*Rigid Body, analytical surface=Wall-1.Face, ref node=1\n"
            "*Nset, nset=Ref\n1,\n*End Assembly\n")
    text = PARTS.replace("*Assembly", wall + "*Assembly").replace("*Nset, nset=Top", instance + "*Nset, nset=Top")
    text = text.replace("*End Assembly\n", body).replace("Foot, 1, 2\n", "Foot, 1, 2\nRef, 1, 2\nRef, 6\n")
    deck = Deck(text, "deck")
    run = run_deck(deck, tmp_path)
    # The profile lies behind the nodes of three instances and that of the assembly; a point (0, y) of
    # the part is at (y, -0.25).
    assert np.abs(run.fields().x[20:22, :2] - [(-3.0, -0.25), (-1.0, -0.25)]).max() <= 32*EPSILON*3


@pytest.mark.parametrize("old, new, told", [
    ("*Nset, nset=BELOW\n 1, 2, 3", "*Nset, nset=BELOW\n 1, 12, 3", "*Nset: a label here is none of the part"),
    ("1, S1\n2, S1", "1, S1\n14, S1", "*Surface: a label here is none of the part"),
    ("part=Square\n*End Instance\n*Instance", "part=Circle\n*End Instance\n*Instance", "no part 'CIRCLE'"),
    ("name=Punch-1", "name=Base-1", "instance 'BASE-1' is given twice"),
    ("name=Punch-1, ", "", "*INSTANCE needs NAME="),
    ("*End Part\n", "", "*END PART is missing"),
    ("*End Instance\n*Nset", "*Nset", "*END INSTANCE is missing"),
    ("*Assembly, name=Assembly\n", "", "*INSTANCE stands in *ASSEMBLY alone"),
    ("1.,           0.\n*End", "one\n*End", "expected a line of the way"),
    ("1.,           0.\n*End", "1., 0.\n0., 0., 0., 0., 0., 0., 90.\n*End", "expected a line of the way"),
    ("internal, instance=Punch-1", "internal, instance=Hammer-1", "there is no instance 'HAMMER-1'"),
    ("*Part, name=Square", "*Part, name=Square\n*End Part\n*Part, name=SQUARE", "part 'SQUARE' is given twice"),
    ("*Part, name=Square", "*Part", "*PART needs NAME="),
    ("      9,          1.0,          1.0", "      9,          1.0,          <y>", "parameter"),
    ("*End Assembly", "*End Assembly\n*End Part", "*End Part ends nothing"),
    ("Base-1.BELOW", "Base-1.BENEATH", "'BASE-1.BENEATH'"),
    ("Base-1.BELOW", "BELOW", "unknown node set 'BELOW'; did you mean BASE-1.BELOW?"),
    ("Top, 1\n", "Above, 1\n", "unknown node set 'ABOVE'; did you mean BASE-1.ABOVE?"),
    ("Punch-1.LOWER, Under", "LOWER, Under", "unknown slave surface 'LOWER'; did you mean BASE-1.LOWER?"),
    ("Base-1.5, 1", "5, 1", "*CLOAD: 5 may be a label of any instance; write INSTANCE.5, with the name of one"),
    ("*End Part\n", "*Instance, name=Inner, part=Square\n*End Instance\n*End Part\n",
     "*Instance may not stand between *PART and *END PART"),
    ("*Nset, nset=ABOVE", "*Part, name=Inner\n*End Part\n*Nset, nset=ABOVE",
     "*Part may not stand between *PART and *END PART"),
    ("*End Instance\n", "*Instance, name=Inner, part=Square\n*End Instance\n*End Instance\n",
     "*Instance may not stand between *INSTANCE and *END INSTANCE"),
    ("*Nset, nset=Top", "*Assembly, name=Again\n*Nset, nset=Top",
     "*Assembly may not stand between *ASSEMBLY and *END ASSEMBLY"),
    ("*End Part\n", "*Material, name=Z\n*Elastic\n1., 0.3\n*End Part\n",
     "*Material may not stand between *PART and *END PART"),
    ("*End Part\n", "*Step\n*Static\n*End Step\n*End Part\n", "*Step may not stand between *PART and *END PART"),
    ("*End Assembly\n", "", "*END ASSEMBLY is missing"),
    ("*End Assembly\n", "*Material, name=Z\n*Elastic\n1., 0.3\n*End Assembly\n",
     "*Material may not stand between *ASSEMBLY and *END ASSEMBLY"),
    ("*End Assembly\n", "*End Assembly\n*End Assembly\n", "*End Assembly ends nothing"),
    ("      9, ", "2000000000, ", "labels are too large for so many instances"),
])
def test_what_is_wrong_with_parts_is_told(old, new, told, tmp_path):
    """With file and line, in one message."""
    assert old in PARTS, old
    deck = tmp_path/"deck.inp"
    deck.write_text(PARTS.replace(old, new, 1))
    done = emcon("check", deck)
    assert done.returncode == 2
    # A coordinate that is a parameter without a value is no number, either.
    assert len(re.findall(r"deck\.inp:\d+: error: ", done.stderr)) == 1 + (told == "parameter"), done.stderr
    assert told in done.stderr, done.stderr
