"""What decks mean: small runs whose displacements and reactions are known in closed form."""

import pathlib
import re

import h5py
import numpy as np
import pytest
from scene_tools import EPSILON, Deck, emcon, run_deck

MESHES = pathlib.Path(__file__).resolve().parent/"included"
YOUNG, POISSON, LENGTH, DENSITY = 100.0, 0.3, 2.0, 0.5
#: Strain along the bar per stress along it: plane strain, free to narrow.
COMPLIANCE = (1.0 - POISSON**2)/YOUNG
#: Digits of one linear solve: condition of the bar's 8 unknowns (1e3) times roundings.
DIGITS = 1e5*EPSILON
#: A bar of one element along y, 1 wide and 2 long; its lower end is held upright at y = 0.
BAR = f"""\
*NODE, NSET=ALL
1, 0., 0.
2, 1., 0.
3, 1., {LENGTH}
4, 0., {LENGTH}
*ELEMENT, TYPE=CPE4, ELSET=BAR
1, 1, 2, 3, 4
*NSET, NSET=END
3, 4
*NSET, NSET=FOOT
1, 2
*MATERIAL, NAME=M
*ELASTIC
{YOUNG}, {POISSON}
*DENSITY
{DENSITY}
*SOLID SECTION, ELSET=BAR, MATERIAL=M
*SURFACE, NAME=UPPER
BAR, S3
*AMPLITUDE, NAME=LATE
0., 0., 0.5, 0., 1., 1.
*BOUNDARY
FOOT, 2
1, 1
"""
PRINT = "*NODE PRINT, NSET=ALL\nU, RF\n"


def static(*steps):
    """Static steps of two increments, each with the cards of one text."""
    return "".join(f"*STEP\n*STATIC, DIRECT\n0.5, 1.\n{cards}{PRINT}*END STEP\n" for cards in steps)


def run(tmp_path, text, code=0):
    return run_deck(Deck(text, "deck"), tmp_path, code)


def ends(done):
    """Upward displacement of the two nodes of the free end at the end of each step."""
    time, u = done.series("ALL", "U")
    at = [np.flatnonzero(time == t)[-1] for t in range(1, round(time[-1]) + 1)]
    return u[at][:, 2:, 1]


def pulled(*forces):
    """The same in closed form, for the force on the whole end."""
    return COMPLIANCE*LENGTH*np.array(forces)[:, None]*np.ones(2)


def assert_pulled(done, *forces):
    scale = COMPLIANCE*LENGTH*max(1.0, *np.abs(forces))
    assert ends(done) == pytest.approx(pulled(*forces), rel=0, abs=DIGITS*scale)


# ---- loads: added within a step, replaced by a later one ------------------------------------------


@pytest.mark.parametrize("cards, force", [
    ("*CLOAD\nEND, 2, 1.\nEND, 2, 0.5\n", 3.0),
    ("*CLOAD\nEND, 2, 1.\n*CLOAD\n3, 2, 0.5\n4, 2, 0.5\n", 3.0),
    ("*CLOAD\nEND, 2, 1.\n*CLOAD, AMPLITUDE=LATE\nEND, 2, 0.5\n", 3.0),
    ("*CLOAD\nEND, 2, 1.\n*CLOAD, OP=NEW\nEND, 2, 0.5\n", 3.0),
    ("*DLOAD\nBAR, P3, -1.\nBAR, P3, -0.5\n", 1.5),
    ("*DLOAD\nBAR, P3, -1.\n*DLOAD, AMPLITUDE=LATE\n1, P3, -0.5\n", 1.5),
    ("*DLOAD\nBAR, P3, -1.\n*CLOAD\nEND, 2, 0.5\n", 2.0),
    ("*DSLOAD\nUPPER, P, -1.\n*DSLOAD, AMPLITUDE=LATE\nupper, p, -0.5\n", 1.5),
    ("*DSLOAD\nUPPER, P, -1.\n*DLOAD, OP=NEW\nBAR, P3, -0.5\nUPPER, P, -0.25\n", 1.75),
], ids=["lines", "cards", "amplitude", "op-new", "pressure", "pressures", "both", "surface",
        "faces"])
def test_loads_of_one_step_are_added(cards, force, tmp_path):
    assert_pulled(run(tmp_path, BAR + static(cards)), force)


@pytest.mark.parametrize("second, forces", [
    ("*CLOAD\nEND, 2, 4.\n", (3.0, 8.0)),
    ("*CLOAD\nEND, 2, 4.\nEND, 2, 1.\n", (3.0, 10.0)),
    ("*CLOAD, OP=NEW\nEND, 2, 4.\n", (3.0, 8.0)),
    ("*CLOAD, OP=NEW\n", (3.0, 0.0)),
    ("", (3.0, 3.0)),
], ids=["one", "two", "new", "none", "kept"])
def test_loads_of_a_later_step_replace_all_of_an_earlier_one(second, forces, tmp_path):
    first = "*CLOAD\nEND, 2, 1.\nEND, 2, 0.5\n"
    assert_pulled(run(tmp_path, BAR + static(first, second)), *forces)


@pytest.mark.parametrize("second, forces", [
    ("*DSLOAD\nUPPER, P, -4.\n", (1.5, 4.0)),
    ("*DLOAD\nBAR, P3, -4.\n", (1.5, 4.0)),
    ("*DSLOAD, OP=NEW\n", (1.5, 0.0)),
    ("*DLOAD, OP=NEW\n", (1.5, 1.5)),
    ("", (1.5, 1.5)),
], ids=["surface", "face", "new", "new-of-elements", "kept"])
def test_a_face_has_the_pressure_of_the_last_step_that_gave_one(second, forces, tmp_path):
    """By whichever card; OP=NEW drops what cards of its own kind gave."""
    first = "*DSLOAD\nUPPER, P, -1.\nUPPER, P, -0.5\n"
    assert_pulled(run(tmp_path, BAR + static(first, second)), *forces)


def test_new_loads_on_elements_leave_those_on_surfaces(tmp_path):
    first = "*DSLOAD\nUPPER, P, -1.\n*DLOAD\nBAR, P1, 2.\n"
    kept = run(tmp_path, BAR + static(first, "*DLOAD, OP=NEW\n"))
    assert ends(kept)[1] == pytest.approx(pulled(1.0)[0], abs=DIGITS*COMPLIANCE*LENGTH)


def test_a_replaced_sum_is_left_along_a_ramp(tmp_path):
    """Half-way through the second step the force is the mean of the sums of both steps."""
    done = run(tmp_path, BAR + static("*CLOAD\nEND, 2, 1.\nEND, 2, 0.5\n", "*CLOAD\nEND, 2, 4.\n"))
    time, u = done.series("ALL", "U")
    middle = u[time == 1.5][0, 2:, 1]
    assert middle == pytest.approx(pulled(5.5)[0], rel=DIGITS)


def test_each_load_keeps_its_amplitude(tmp_path):
    done = run(tmp_path, BAR + static("*CLOAD\nEND, 2, 1.\n*CLOAD, AMPLITUDE=LATE\nEND, 2, 0.5\n"))
    time, u = done.series("ALL", "U")
    assert u[time == 0.5][0, 2:, 1] == pytest.approx(pulled(1.0)[0], rel=DIGITS)


@pytest.mark.parametrize("second, expected", [
    (None, (3.0, -4.0)),
    ("*DLOAD\nBAR, GRAV, 7., 0., 1.\n", (0.0, 7.0)),
    ("*DLOAD\nBAR, GRAV, 2., 5., 0.\nBAR, GRAV, 1., 0., -2.\n", (2.0, -1.0)),
], ids=["added", "turned", "again"])
def test_gravity_in_two_directions_is_added(second, expected, tmp_path):
    """The supports carry the weight; within a step it runs from one weight to the other."""
    first = "*DLOAD\nBAR, GRAV, 3., 1., 0.\nBAR, GRAV, 4., 0., -1.\n"
    done = run(tmp_path, BAR + static(first, *([second] if second else [])))
    time, force = done.series("ALL", "RF")
    weight = DENSITY*LENGTH*np.array(expected)
    scale = DENSITY*LENGTH*7.0
    assert force[-1].sum(axis=0) == pytest.approx(-weight, abs=DIGITS*scale)
    if second:
        half = 0.5*(weight + DENSITY*LENGTH*np.array((3.0, -4.0)))
        assert force[time == 1.5][0].sum(axis=0) == pytest.approx(-half, abs=DIGITS*scale)


# ---- supports -----------------------------------------------------------------------------------


def test_the_last_of_two_displacements_holds(tmp_path):
    done = run(tmp_path, BAR + static("*BOUNDARY\nEND, 2, 2, 0.5\n4, 2, 2, 0.1\n3, 2, 2, 0.1\n"))
    assert ends(done) == pytest.approx(0.1*np.ones((1, 2)), rel=DIGITS)
    assert "node 4 was prescribed otherwise before" in done.errors
    assert "node 3 was prescribed otherwise before" in done.errors


def test_the_same_displacement_twice_is_no_contradiction(tmp_path):
    done = run(tmp_path, BAR + static("*BOUNDARY\nEND, 2, 2, 0.5\n4, 2, 2, 0.5\n"))
    assert "otherwise" not in done.errors


def test_a_smooth_step_between_the_times_of_an_amplitude(tmp_path):
    """x^3 (10 - 15 x + 6 x^2) at a quarter, a half, three quarters; the word of Abaqus."""
    text = BAR.replace("*BOUNDARY", "*AMPLITUDE, NAME=EASE, DEFINITION=SMOOTH STEP\n"
                       "0., 0., 1., 1.\n*BOUNDARY")
    done = run(tmp_path, text + "*STEP\n*STATIC, DIRECT\n0.25, 1.\n*BOUNDARY, AMPLITUDE=EASE\n"
               f"END, 2, 2, 0.1\n{PRINT}*END STEP\n")
    time, u = done.series("ALL", "U")
    for t, factor in ((0.25, 0.103515625), (0.5, 0.5), (0.75, 0.896484375), (1.0, 1.0)):
        assert u[time == t][0, 2:, 1] == pytest.approx(0.1*factor*np.ones(2), rel=DIGITS, abs=0)


@pytest.mark.parametrize("option, middle", [("", 0.05), (", AMPLITUDE=LATE", 0.0)])
def test_a_displacement_before_the_first_step_is_one_of_that_step(option, middle, tmp_path):
    text = BAR + f"*BOUNDARY{option}\nEND, 2, 2, 0.1\n" + static("", "")
    done = run(tmp_path, text)
    time, u = done.series("ALL", "U")
    assert u[time == 0.5][0, 2:, 1] == pytest.approx(middle*np.ones(2), rel=DIGITS, abs=0)
    assert ends(done) == pytest.approx(0.1*np.ones((2, 2)), rel=DIGITS)
    inside = run(tmp_path / "inside", BAR + static(f"*BOUNDARY{option}\nEND, 2, 2, 0.1\n", ""))
    assert done.digits() == inside.digits()


@pytest.mark.parametrize("name, free", [
    ("ENCASTRE", ()), ("pinned", ()), ("XSYMM", (1,)), ("YSYMM", (0,)), ("ZSYMM", (0, 1)),
    ("XASYMM", (0,)), ("YASYMM", (1,)), ("ZASYMM", ()),
])
def test_supports_by_name(name, free, tmp_path):
    """What the name holds does not move; the rest does."""
    text = BAR + f"*BOUNDARY\n4, {name}\n" + static("*CLOAD\nEND, 1, 1.\nEND, 2, 1.\n")
    _, u = run(tmp_path, text).series("ALL", "U")
    assert [i for i in (0, 1) if u[-1, 3, i] != 0.0] == list(free)


def test_zeros_out_of_the_plane_change_nothing(tmp_path):
    load = "*CLOAD\nEND, 2, 1.\n"
    plain = run(tmp_path / "plain", BAR + static(load))
    zeros = run(tmp_path / "zeros", BAR + "*BOUNDARY\nALL, 3, 6\nEND, 3, 3, 0.\n"
                + static(load + "END, 3, 0.\nEND, 6, 0.\n"))
    assert "warning: " not in zeros.errors
    assert zeros.digits() == plain.digits()


# ---- the files of Gmsh --------------------------------------------------------------------------

#: A punch on a block: what both decks below say after their mesh.
PUNCH = f"""\
*MATERIAL, NAME=M
*ELASTIC
{YOUNG}, {POISSON}
*SOLID SECTION, ELSET=block, MATERIAL=M
*SOLID SECTION, ELSET=punch, MATERIAL=M
*SURFACE INTERACTION, NAME=HARD
*CONTACT PAIR, INTERACTION=HARD, TYPE=MORTAR
SOLE, FLOOR
*BOUNDARY
HELD, ENCASTRE
PUSHED, 1
*STEP, NLGEOM
*STATIC
0.5, 1.
*BOUNDARY
PUSHED, 2, 2, -0.1
*END STEP
"""
LINES = """\
*SURFACE, NAME=FLOOR
floor
*SURFACE, NAME=SOLE
18
19
*NSET, NSET=HELD, ELSET=bottom
*NSET, NSET=PUSHED, ELSET=top
"""
FACES = """\
*SURFACE, NAME=FLOOR
28, S3
29, S2
*SURFACE, NAME=SOLE
30, S4
34, S4
*NSET, NSET=HELD
1, 2, 10
*NSET, NSET=PUSHED
7, 8, 16
"""


def by_hand(text):
    """The mesh of a file of Gmsh as one would write it: no lines."""
    cards = [card for card in Deck(text).card
             if "T3D2" not in card[0] and card[0] not in ("*ELSET,ELSET=" + name for name in
                                                          ("bottom", "floor", "sole", "top"))]
    return "".join("\n".join([head, *data]) + "\n" for head, data in cards)


def test_a_file_of_gmsh_means_what_one_would_write_by_hand(tmp_path):
    """Lines are faces of the elements they lie on; an orphan point and idle lines do not disturb."""
    mesh = (MESHES/"gmsh.inp").read_text()
    gmsh = run(tmp_path/"gmsh", mesh + LINES + PUNCH)
    hand = run(tmp_path/"hand", by_hand(mesh) + FACES + PUNCH)
    assert gmsh.digits() == hand.digits()
    assert gmsh.history["active"][-1] > 0
    for text in ("elements of type T3D2 are lines",
                 "node 9 belongs to no element"):
        assert gmsh.errors.count(text) == 1
    assert hand.errors.count("warning: ") == 1


def test_a_set_of_lines_is_a_surface_of_edges(tmp_path):
    """The direction of the lines says where the body is: of the floor it is to the left."""
    mesh = (MESHES/"gmsh.inp").read_text()
    edges = LINES.replace("NAME=FLOOR", "NAME=FLOOR, TYPE=EDGE")
    faces = run(tmp_path/"faces", mesh + LINES + PUNCH)
    assert run(tmp_path/"edges", mesh + edges + PUNCH).digits() == faces.digits()


# ---- what changes nothing, and what would ---------------------------------------------------------

#: Each text of the bar's deck with the same text at neutral values.
NEUTRAL = [
    ("1, 0., 0.\n", "1, 0., 0., 0., 0., 0.\n"),
    ("TYPE=CPE4, ELSET=BAR\n1, 1, 2, 3, 4\n", "TYPE=CPE4, ELSET=BAR, OFFSET=0.\n1, 1, 2, 3, 4, 0\n"),
    ("*ELASTIC\n100.0, 0.3\n", "*ELASTIC, DEPENDENCIES=0\n100.0, 0.3, 0.\n"),
    ("ELSET=BAR, MATERIAL=M\n", "ELSET=BAR, MATERIAL=M, OFFSET=0.0\n1., 0.\n"),
    ("*STEP\n", "*STEP, UNSYMM=NO\n"),
    ("*DYNAMIC, DIRECT\n0.5, 1.\n", "*DYNAMIC, DIRECT, ALPHA=-0.\n0.5, 1., 0., 0., 0.\n"),
    ("*CLOAD\nEND, 2, 1.\n", "*CLOAD, TIME DELAY=0., LOAD CASE=1\nEND, 2, 1., 0.\n"),
    ("*BOUNDARY\nFOOT, 2\n", "*BOUNDARY, LOAD CASE=1\nFOOT, 2, 2, 0., 0.\n"),
]


def moving():
    """The bar, pulled suddenly."""
    return BAR + "*STEP\n*DYNAMIC, DIRECT\n0.5, 1.\n*CLOAD\nEND, 2, 1.\n" + PRINT + "*END STEP\n"


@pytest.mark.parametrize("plain, neutral", NEUTRAL, ids=lambda text: text.split("\n")[0])
def test_neutral_values_change_nothing(plain, neutral, tmp_path):
    assert plain in moving()
    done = run(tmp_path/"neutral", moving().replace(plain, neutral))
    assert "warning: " not in done.errors
    assert done.digits() == run(tmp_path/"plain", moving()).digits()


#: What exporters write before the material, into it and into steps, with what the log says of it.
EXPORTED = [
    ("*MATERIAL, NAME=M\n", "*PHYSICAL CONSTANTS, ABSOLUTE ZERO=0, STEFAN BOLTZMANN=5.67e-11\n",
     "*PHYSICAL CONSTANTS (there is no temperature)"),
    ("*DENSITY\n", "*EXPANSION, ZERO=0.\n1.2e-5\n*CONDUCTIVITY\n50., 0.\n*SPECIFIC HEAT\n500.\n",
     "*SPECIFIC HEAT (there is no temperature)"),
    ("*MATERIAL, NAME=M\n", "*ORIENTATION, NAME=O, SYSTEM=CYLINDRICAL\n0., 0., 0., 0., 0., 1.\n",
     "*ORIENTATION (materials are isotropic)"),
    ("*CLOAD\n", "*CONTROLS, PARAMETERS=TIME INCREMENTATION\n8, 10, , , , , , 5\n0.25, 0.5\n",
     "*CONTROLS ("),
    ("*CLOAD\n", "*OUTPUT, FREQUENCY=1\n", "*OUTPUT (every increment is written unless a request says otherwise)"),
    ("*MATERIAL, NAME=M\n", "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nEND, 293.\n",
     "*INITIAL CONDITIONS, TYPE=TEMPERATURE (no step changes a temperature)"),
    ("*CLOAD\n", "*PRINT, CONTACT=YES\n*MONITOR, NODE=1, DOF=2\n*FILE FORMAT, ASCII\n",
     "*MONITOR (it names no results)"),
    ("*BOUNDARY\n", "*SURFACE INTERACTION, NAME=I\n1.,\n*FRICTION\n0.3\n*BOUNDARY\n*FILTER, NAME=F\n",
     "thickness of *SURFACE INTERACTION (that of the sections counts)"),
]


def test_no_analysis(tmp_path):
    """The deck is read and checked, and no files are written."""
    deck = tmp_path/"deck.inp"
    deck.write_text(moving().replace("*DYNAMIC, DIRECT\n0.5, 1.\n", "*NO ANALYSIS\n"))
    done = emcon(deck)
    assert done.returncode == 0 and list(tmp_path.iterdir()) == [deck]
    assert done.stdout.splitlines()[-1] == "*NO ANALYSIS: the deck was read and checked; nothing was computed"
    deck.write_text(moving().replace("*DYNAMIC, DIRECT\n0.5, 1.\n", "*NO ANALYSIS\n").replace("*ELASTIC\n", ""))
    assert emcon(deck).returncode == 2


@pytest.mark.parametrize("before, cards, told", EXPORTED, ids=lambda text: text.split("\n")[0])
def test_cards_of_exporters_change_nothing_and_the_log_names_them(before, cards, told, tmp_path):
    plain = run(tmp_path/"plain", moving())
    assert before in moving()
    done = run(tmp_path/"exported", moving().replace(before, cards + before, 1))
    assert "warning: " not in done.errors and "changes nothing" not in plain.log
    assert [told in line for line in done.log.splitlines() if line.startswith("changes nothing: ")] == [True]
    assert done.digits() == plain.digits()


#: Requests in the words of *OUTPUT, and the same as *... FILE and *... PRINT.
REQUESTS = [
    ("*OUTPUT, FIELD, VARIABLE=PRESELECT\n", "*NODE FILE\nU, V, RF\n*EL FILE\nS, E\n"),
    ("*OUTPUT, FIELD, FREQUENCY=2\n*NODE OUTPUT\nU2, RF\n*ELEMENT OUTPUT, DIRECTIONS=YES\nS11, E\n",
     "*NODE FILE, FREQUENCY=2\nU, RF\n*EL FILE, FREQUENCY=2\nS, E\n"),
    ("*OUTPUT, HISTORY, VARIABLE=PRESELECT\n*NODE OUTPUT, NSET=END\nU1, V2\n",
     "*ENERGY PRINT\n*NODE PRINT, NSET=END\nU, V\n"),
    ("*OUTPUT, HISTORY\n*ELEMENT OUTPUT, ELSET=BAR, VARIABLE=PRESELECT\n*ENERGY OUTPUT\nALLKE\n",
     "*EL PRINT, ELSET=BAR\nS, E\n*ENERGY PRINT\nALLKE\n"),
    ("*NODE FILE\nU\n*EL FILE, FREQUENCY=1\nS\n*OUTPUT, FREQUENCY=2\n*NODE PRINT\nV\n",
     "*NODE FILE, FREQUENCY=2\nU\n*EL FILE\nS\n*NODE PRINT, FREQUENCY=2\nV\n"),
]


@pytest.mark.parametrize("asked, plain", REQUESTS, ids=["preselect", "field", "history", "sets", "frequency"])
def test_output_in_the_words_of_abaqus(asked, plain, tmp_path):
    """The same files, but for their names and times of the machine."""
    runs = [run(tmp_path/name, moving().replace(PRINT, cards))
            for name, cards in [("asked", asked), ("plain", plain)]]
    assert "warning: " not in runs[0].errors
    found = []
    for done in runs:
        found.append({})
        for suffix in (".vtkhdf", ".h5"):
            with h5py.File(done.file(suffix), "r") as file:
                file.visititems(lambda name, item: found[-1].update({name: item[()].tobytes()})
                                if isinstance(item, h5py.Dataset) and not re.search("SECONDS|cpu|texts|^run", name)
                                else None)
    assert found[0] == found[1]


def test_a_step_of_cards_that_change_nothing_has_no_procedure(tmp_path):
    deck = tmp_path/"deck.inp"
    for cards in ("*CONTROLS\n", "*SECTION FILE, NAME=P, SURFACE=UPPER\nSOF\n"):
        deck.write_text(moving().replace("*DYNAMIC, DIRECT\n0.5, 1.\n", cards))
        assert "the step has no procedure" in emcon("check", "--lenient", deck).stderr


def test_output_of_a_set_without_members_is_warned_of(tmp_path):
    empty = "*NSET, NSET=NONE\n*ELSET, ELSET=NONE\n*MATERIAL, NAME=M\n"
    asked = "*NODE PRINT, NSET=NONE\nU\n*EL PRINT, ELSET=NONE, TOTALS=YES\nS\n"
    done = run(tmp_path, moving().replace("*MATERIAL, NAME=M\n", empty).replace(PRINT, PRINT + asked))
    assert done.errors.count("the set 'NONE' is empty: nothing will be written") == 2
    with h5py.File(done.file(".h5"), "r") as file:
        assert "ALL" in file["sets"] and "NONE" not in file["sets"]


def test_output_of_abaqus_that_is_not_written_is_warned_of(tmp_path):
    done = run(tmp_path, moving().replace(PRINT, "*OUTPUT, FIELD\n*NODE OUTPUT\nU, A\n*ELEMENT OUTPUT\nLE\n"))
    assert [line.split("variable ")[1][:4] for line in done.errors.splitlines()] == ["'A' ", "'LE'"]


def test_orientation_of_a_section_is_told(tmp_path):
    done = run(tmp_path, moving().replace("ELSET=BAR, MATERIAL=M\n", "ELSET=BAR, MATERIAL=M, ORIENTATION=O\n"))
    assert "parameter ORIENTATION has no effect (materials are isotropic" in done.errors


@pytest.mark.parametrize("before, cards", [
    ("*CLOAD\n", "*OUTPUT, FIELD, HISTORY\n"),
    ("*CLOAD\n", "*NODE OUTPUT\nU\n"),
    ("*CLOAD\n", "*OUTPUT, FIELD, VARIABLE=SOME\n"),
    ("*CLOAD\n", "*OUTPUT, FIELD, TIME POINTS=T\n*NODE OUTPUT\nU\n"),
    ("*BOUNDARY\n", "*SURFACE INTERACTION, NAME=I\n0.\n"),
    ("*BOUNDARY\n", "*SURFACE INTERACTION, NAME=I\n1., 2.\n"),
    ("*BOUNDARY\n", "*SURFACE INTERACTION, NAME=I\n1.\n2.\n"),
    ("*CLOAD\n", "*NO ANALYSIS\n"),
], ids=["both", "alone", "word", "times", "thin", "fields", "lines", "no-analysis"])
def test_cards_of_exporters_that_would_change_something_are_refused(before, cards, tmp_path):
    text = moving().replace(before, cards if cards.startswith("ELSET") else cards + before, 1)
    deck = tmp_path/"deck.inp"
    deck.write_text(text)
    told = emcon("check", deck).stderr
    assert len(re.findall(r"deck\.inp:\d+: error: ", told)) == 1, told


@pytest.mark.parametrize("plain, other", [
    ("*STEP\n", "*STEP, UNSYMM=YES\n"),
    ("*DYNAMIC, DIRECT\n", "*DYNAMIC, DIRECT, ALPHA=-0.05\n"),
    ("ELSET=BAR, MATERIAL=M\n", "ELSET=BAR, MATERIAL=M, OFFSET=0.1\n"),
    ("*CLOAD\nEND, 2, 1.\n", "*CLOAD\nEND, 2, 1., 0.1\n"),
    ("*MATERIAL, NAME=M\n", "*MATERIAL, NAME=M\n1., 2.\n"),
    ("*DYNAMIC, DIRECT\n", "*CONTACT PRINT\nCDIS\n*DYNAMIC, DIRECT\n"),
    ("*DYNAMIC, DIRECT\n", "*CONTACT INITIATION, TYPE=ADMISSIBLE, GAP TOLERANCE=1.\n*DYNAMIC, DIRECT\n"),
    ("*DYNAMIC, DIRECT\n", "*ENERGY PRINT, FREQUENCY=5\nALLSE\n*DYNAMIC, DIRECT\n"),
    ("*END STEP\n", "*END STEP\n1., 2.\n"),
], ids=["unsymm", "alpha", "offset", "fields", "lines", "no-pair", "tolerance", "energy", "end"])
def test_nothing_is_ignored_without_a_word(plain, other, tmp_path):
    """Values that would mean something here are refused or warned of, once."""
    assert plain in moving()
    deck = Deck("").write(tmp_path/"deck.inp")
    deck.write_text(moving().replace(plain, other))
    told = emcon("check", deck).stderr
    assert len(re.findall(r"deck\.inp:\d+: (?:error|warning): ", told)) == 1, told


@pytest.mark.parametrize("edits", [
    [("TYPE=CPE4", "TYPE=CPE4RH")],
    [("TYPE=CPE4, ELSET=FOUNDATION", "TYPE=B21, ELSET=FOUNDATION"),
     ("TOP, 2, -1.\n", "TOP, 2, -1.\n*DLOAD\n1, P1, 1.\n*EL PRINT, ELSET=FOUNDATION\nS\n")],
    [("TYPE=CPE4, ELSET=BLOCK", "TYPE=C3D8, ELSET=BLOCK"), ("BLOCK, S1", "11, S1\n12, S1")],
], ids=["all", "loads", "faces"])
def test_a_refused_element_type_is_one_message(edits, tmp_path):
    """Nothing that only follows from it: missing elements, sets, faces, sections."""
    text = (MESHES.parent/"good_plain.inp").read_text()
    for plain, other in edits:
        assert plain in text
        text = text.replace(plain, other)
    deck = tmp_path/"deck.inp"
    deck.write_text(text)
    told = emcon("check", deck).stderr
    assert len(re.findall(r"(?:error|warning): ", told)) == 1 and "element type" in told, told


@pytest.mark.parametrize("card", ["*CLOAD", "*BOUNDARY"])
def test_a_delay_is_an_amplitude_with_later_times(card, tmp_path):
    """Two delays of one amplitude, in two cards."""
    more, other = (", 2", ", 1") if card == "*BOUNDARY" else ("", "")
    pull = (f"{card}, AMPLITUDE=A{{}}\nEND, 2{more}, 0.1\n"
            f"{card}, AMPLITUDE=A{{}}\nEND, 1{other}, 0.05\n")

    def deck(tables, cards):
        return moving().replace("*STEP\n", tables + "*STEP\n").replace(
            "*CLOAD\nEND, 2, 1.\n", cards)

    table = "*AMPLITUDE, NAME=A\n0., 0., 1., 1.\n"
    later = "*AMPLITUDE, NAME=AB\n0.25, 0., 1.25, 1.\n*AMPLITUDE, NAME=AC\n0.5, 0., 1.5, 1.\n"
    delayed = run(tmp_path/"delayed", deck(table, pull.format(
        ", TIME DELAY=0.25", ", TIME DELAY=0.5")))
    assert delayed.digits() == run(tmp_path/"plain", deck(later, pull.format("B", "C"))).digits()
    assert delayed.digits() != run(tmp_path/"now", deck(table, pull.format("", ""))).digits()


def test_a_delay_of_nothing_is_refused(tmp_path):
    deck = tmp_path/"deck.inp"
    deck.write_text(moving().replace("*CLOAD\n", "*CLOAD, TIME DELAY=0.1\n"))
    assert "TIME DELAY delays an amplitude; name one by AMPLITUDE=" in emcon("check", deck).stderr


def test_a_restart_file_may_be_asked_for_before_the_first_step(tmp_path):
    card = "*RESTART, WRITE, FREQUENCY=1\n"
    before = run(tmp_path/"before", moving().replace("*STEP\n", card + "*STEP\n"))
    inside = run(tmp_path/"inside", moving().replace("*DYNAMIC", card + "*DYNAMIC"))
    assert before.file(".rst.h5").exists() and inside.file(".rst.h5").exists()
    assert before.digits() == inside.digits()
    assert not run(tmp_path/"without", moving()).file(".rst.h5").exists()


@pytest.mark.parametrize("name, taken", [("CPE4R", "CPE4I"), ("CPS4R", "CPS4I")])
def test_elements_of_one_point_are_taken_as_those_that_keep_the_energy(name, taken, tmp_path):
    reduced, own = (run(tmp_path/kind, moving().replace("TYPE=CPE4,", f"TYPE={kind},")) for kind in (name, taken))
    assert f"elements of type {name} are taken as {taken}" in reduced.errors
    assert reduced.digits() == own.digits()


def test_in_place_of_a_gap_element(tmp_path):
    """A bar of an end that may go up by a twentieth: as GAPUNI from its nodes to the ground would hold it."""
    wall = """*NODE
9, 0., 9.
*SURFACE, NAME=TIP, TYPE=NODE
END
*SURFACE, NAME=WALL, TYPE=SEGMENTS
START, 2., 2.05
LINE, -1., 2.05
*RIGID BODY, ANALYTICAL SURFACE=WALL, REF NODE=9
*BOUNDARY
9, 1, 6
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
TIP, WALL
"""
    cards = "*CLOAD\nEND, 2, {}\n"
    done = run(tmp_path, BAR + wall + static(cards.format(1.0), cards.format(2.0)))
    assert np.allclose(ends(done), [[COMPLIANCE*LENGTH*2.0]*2, [0.05]*2], rtol=1e-9, atol=0.0)


@pytest.mark.parametrize(("card", "told"), [
    ("*MPC\nBEAM, 1, 2\n", "write what it couples as *EQUATION; what moves as a whole is a *RIGID BODY"),
    ("*COUPLING, CONSTRAINT NAME=C, REF NODE=1, SURFACE=S\n", "make the coupled nodes a *RIGID BODY"),
    ("*DISTRIBUTING\n1, 3\n", "spread the force over the nodes by *CLOAD"),
    ("*EMBEDDED ELEMENT\nE\n", "join their surfaces by *TIE"),
    ("*SPRING, ELSET=E\n", "use a strip of soft solid elements"),
    ("*DASHPOT, ELSET=E\n", "damp the material by *DAMPING"),
    ("*MASS, ELSET=E\n1.\n", "give this mass to solid elements by their *DENSITY"),
    ("*SHELL SECTION, ELSET=E, MATERIAL=M\n0.1\n", "mesh the thickness with solid elements"),
    ("*BEAM SECTION, ELSET=E, MATERIAL=M, SECTION=RECT\n", "mesh the cross section with solid elements"),
    ("*PLASTIC\n1., 0.\n", "leave it out where stresses stay below the yield stress"),
    ("*CREEP\n1., 1., 1.\n", "take the moduli of the time that is of interest"),
    ("*TEMPERATURE\n1, 20.\n", "move surfaces by *CONTACT INTERFERENCE or *BOUNDARY"),
    ("*HEAT TRANSFER\n", "there is no temperature; the procedures are *STATIC and *DYNAMIC"),
    ("*FREQUENCY\n3\n", "let the body swing in a *DYNAMIC step"),
    ("*BUCKLE\n3\n", "load beyond the limit in a step with NLGEOM"),
    ("*ELEMENT, TYPE=S4, ELSET=E\n", "mesh the thickness with solid elements"),
    ("*ELEMENT, TYPE=B31, ELSET=E\n", "mesh the cross section with solid elements"),
    ("*ELEMENT, TYPE=SPRINGA, ELSET=E\n", "use a strip of soft solid elements"),
    ("*ELEMENT, TYPE=GAPUNI, ELSET=E\n", "use *CONTACT PAIR"),
    ("*ELEMENT, TYPE=MASS, ELSET=E\n", "give this mass to solid elements by *DENSITY"),
    ("*ELEMENT, TYPE=CONN3D2, ELSET=E\n", "couple nodes by *EQUATION or *RIGID BODY"),
    ("*ELEMENT, TYPE=R3D4, ELSET=E\n", "use *RIGID BODY with solid elements")])
def test_what_is_not_here_says_what_to_do_instead(card, told, tmp_path):
    deck = tmp_path/"deck.inp"
    deck.write_text(card + moving())
    done = emcon("check", deck)
    assert done.returncode == 2 and "known but not supported" in done.stderr and told in done.stderr


def test_a_tie_of_surfaces_that_touch_tells_no_couple(tmp_path):
    """ADJUST=NO without a gap: what is left of the couple is rounding."""
    upper = """\
*NODE
11, 0.3, 2.
12, 0.8, 2.
13, 0.8, 3.
14, 0.3, 3.
*ELEMENT, TYPE=CPE4, ELSET=BLOCK
11, 11, 12, 13, 14
*SOLID SECTION, ELSET=BLOCK, MATERIAL=M
*SURFACE, NAME=LOWER
BLOCK, S1
*TIE, NAME=T, ADJUST=NO
LOWER, UPPER
"""
    step = static("*BOUNDARY\n13, 1\n14, 1\n13, 2, 2, -0.05\n14, 2, 2, -0.05\n")
    assert run(tmp_path, BAR + upper + step).verdict["warnings"] == []
    wide = BAR + upper.replace("2.\n12", "2.01\n12").replace("0.8, 2.\n", "0.8, 2.01\n") + step
    assert "have a couple of up to" in run(tmp_path, wide).verdict["warnings"][0]
