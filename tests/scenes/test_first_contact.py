"""How contact begins in dynamic steps that leave it to the program: `*CONTACT INITIATION, TYPE=AUTO`."""

import re

import pytest
from plain_scenes import AUTO, ONE, Scene
from scene_tools import Run, emcon

INITIATION = "*CONTACT INITIATION, TYPE=<initiation>\n"
SURFACE = "*SURFACE INTERACTION, NAME=SMOOTH"
METHOD = "*CONSTRAINT METHOD, TYPE=<method>"
OFF = "first contact: PERSISTENT: "


def block_on_floor(cells=12, sides=AUTO, pairs=None):
    """A square falls on a rigid floor; of 12 x 12 cells 16 % of the mass are at its outline."""
    scene = Scene(0.005, 0.3)
    scene.block("BODY", (0.0, 0.05), (1.0, 1.0), (cells, cells), velocity=(0.0, -1.0))
    scene.block("FLOOR", (-1.0, -0.4), (3.0, 0.4), (5, 1)).hold("FLOOR", lambda x, y: True)
    scene.pairs = pairs or []
    return scene.deck(sides).text().replace(INITIATION, "")


def check(text, folder, *options):
    path = folder/"deck.inp"
    path.write_text(text)
    done = emcon("check", path, *options)
    assert done.returncode == 0, done.stderr
    return done.stdout


def why_not(text, folder):
    """Why nodes of contact keep their mass."""
    told = check(text, folder)
    found = re.search("first contact: (?:PERSISTENT|ADMISSIBLE): (.*)", told)
    assert found, told
    return found[1]


def test_bodies_of_many_elements_shed_their_mass(tmp_path):
    """As if it had been asked for, to the last digit."""
    text = block_on_floor()
    assert ("first contact: MASSLESS: AUTO, no body has more than 20 % of its mass at nodes of contact"
            in check(text, tmp_path))
    told = []
    for name, card in (("auto", ""), ("word", "*CONTACT INITIATION, TYPE=AUTO\n"),
                       ("asked", "*CONTACT INITIATION, TYPE=MASSLESS\n")):
        folder = tmp_path/name
        folder.mkdir()
        (folder/"deck.inp").write_text(text.replace(METHOD, card + METHOD))
        done = emcon(folder/"deck.inp", "--quiet", "--output", folder)
        assert (done.returncode, done.stderr) == (0, "")
        run = Run(folder/"deck")
        assert run.verdict["verdict"] == "good"
        assert (run.history["active"] > 0).any()
        told.append(run.digits())
    assert told[0] == told[1] == told[2]


def test_coarse_bodies_keep_their_mass(tmp_path):
    """Of n x n cells 1 - (1 - 1/n)^2 of the mass is at the outline: 9 move 21 %, 10 move 19 %."""
    assert why_not(block_on_floor(9), tmp_path) == (
        "AUTO keeps masses, body 1 has 21 % of its mass at nodes of contact, more than 20 %")
    assert OFF not in check(block_on_floor(10), tmp_path)


def test_without_contact_nothing_is_chosen(tmp_path):
    text = block_on_floor()
    cut, end = text.index("*SURFACE INTERACTION"), text.index("*BOUNDARY")
    told = check(text[:cut] + text[end:].replace("*CONTACT FILE\nCDIS, CSTR, CF\n", "").replace(
        "*CONTACT PRINT, TOTALS=ONLY\nCF\n", ""), tmp_path)
    assert "contact: off" in told
    assert "first contact" not in told and "without mass" not in told


def test_thickness_counts(tmp_path):
    """Elements inside that are ten times as thick: the outline has a smaller part of the mass."""
    text = block_on_floor(9)
    section = "*SOLID SECTION, ELSET=BODY, MATERIAL=BODY\n1.\n"
    inner = [str(1 + i + 9*j) for j in range(1, 8) for i in range(1, 8)]
    outer = [str(k) for k in range(1, 82) if str(k) not in inner]
    assert section in text
    sets = "".join(f"*ELSET, ELSET={name}\n" + ",\n".join(labels) + "\n"
                   for name, labels in (("INNER", inner), ("OUTER", outer)))
    text = text.replace(section, sets + section.replace("=BODY,", "=OUTER,", 1)
                        + section.replace("=BODY,", "=INNER,", 1).replace("1.\n", "10.\n"))
    assert "first contact: MASSLESS" in check(text, tmp_path)


@pytest.mark.parametrize(("old", "new", "words"), [
    ("*DENSITY", "*DAMPING, BETA=1e-4\n*DENSITY", "DAMPING of materials"),
    (METHOD, "*CONSTRAINT METHOD, TYPE=PENALTY", "constraint method of step 1"),
    (METHOD, "*CONSTRAINT METHOD, TYPE=AUGMENTED LAGRANGE", "constraint method of step 1"),
    ("*DYNAMIC, DIRECT", "*DYNAMIC, DIRECT, EXPLICIT", "the constraint method of step 1"),
    (SURFACE, SURFACE + ", RESTITUTION=0.5", "a contact has a RESTITUTION"),
    (SURFACE, f"{SURFACE}\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n1e4", "a pressure by its overclosure"),
    ("*CONTACT PAIR,", "*CONTACT PAIR, INITIATION=PERSISTENT,", "a *CONTACT PAIR has INITIATION="),
    (METHOD, f"*CONTACT INITIATION, TYPE=PERSISTENT\n{METHOD}", "as the deck says"),
], ids=["damping", "penalty", "augmented", "explicit", "restitution", "soft", "pair", "persistent"])
def test_what_needs_mass_keeps_it(old, new, words, tmp_path):
    text = block_on_floor(sides=ONE)
    assert old in text
    if METHOD not in old:
        text = text[:text.index(METHOD)] + text[text.index("*NODE FILE"):]
    assert words in why_not(text.replace(old, new, 1), tmp_path)


def test_steps_that_say_nothing_go_with_those_that_do(tmp_path):
    """Mass does not come and go."""
    text = block_on_floor()
    more = "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n<h>, 0.1\n*CONTACT INITIATION, TYPE={}\n*END STEP\n"
    assert "as the deck says" in why_not(text + more.format("ADMISSIBLE"), tmp_path)
    assert OFF not in check(text + more.format("MASSLESS"), tmp_path)
    assert OFF not in check(text + more.format("AUTO"), tmp_path)
    assert "body 1 has" in why_not(block_on_floor(4) + more.format("AUTO"), tmp_path)


def test_a_slave_that_cannot_shed_its_mass_is_held_as_it_is(tmp_path):
    """No warning: nobody has asked for what its pair does not do."""
    text = block_on_floor(sides=ONE, pairs=[("FLOOR", "BODY")])
    (tmp_path/"deck.inp").write_text(text)
    done = emcon(tmp_path/"deck.inp", "--quiet", "--output", tmp_path)
    assert done.returncode == 0
    assert "mass" not in done.stderr


@pytest.mark.parametrize(("procedure", "words"), [
    ("*DYNAMIC, DIRECT", None),
    ("*DYNAMIC, DIRECT\n<h>, 0.1\n*TIME INTEGRATION, SCHEME=TRAPEZOIDAL", "MASSLESS"),
    ("*DYNAMIC, DIRECT, EXPLICIT", "MASSLESS"),
    ("*DYNAMIC, DIRECT\n<h>, 0.1\n*BOUNDARY, FIXED\nBODY, 1, 2", "no mass in the run so far, is held or")],
    ids=["same", "trapezoidal", "explicit", "held"])
def test_further_steps_of_a_run_follow_it(procedure, words, tmp_path):
    """Their surfaces have no mass left that a scheme could use."""
    (tmp_path/"deck.inp").write_text(
        block_on_floor().replace("*END STEP", "*RESTART, WRITE\n*END STEP"))
    assert emcon(tmp_path/"deck.inp", "--quiet", "--output", tmp_path).returncode == 0
    data = "" if "0.1" in procedure else "<h>, 0.1\n"
    (tmp_path/"more.inp").write_text(f"*STEP, NLGEOM\n{procedure}\n{data}*END STEP\n")
    done = emcon("restart", tmp_path/"deck.rst.h5", "--quiet", "--output", tmp_path/"on", "--steps",
                 tmp_path/"more.inp")
    if words:
        assert done.returncode == 2
        assert words in done.stderr
    else:
        assert done.returncode == 0, done.stderr
        assert OFF not in (tmp_path/"on"/"deck.log").read_text()
        assert Run(tmp_path/"on"/"deck").verdict["verdict"] == "good"
