"""Plane models with contact as FreeCAD, PrePoMax and Abaqus/CAE write them: each runs unchanged."""

import math
import pathlib
import re

import h5py
import numpy as np
import pytest
from scene_tools import EPSILON, Deck, emcon, run_deck

HERE = pathlib.Path(__file__).resolve().parent
TEXTS = {name: (HERE/f"good_{name}_contact.inp").read_text() for name in ("freecad", "prepomax", "abaqus")}


def run(name, folder):
    done = run_deck(HERE/f"good_{name}_contact.inp", folder)
    assert done.verdict["verdict"] == "good", done.verdict
    return done


# ---- the same models written plainly ------------------------------------------------------------


def rectangle(x, y):
    """Nodes and elements of a grid, nodes row by row."""
    n = len(x)
    elements = [(k, k + 1, k + n + 1, k + n) for j in range(len(y) - 1) for k in range(j*n, j*n + n - 1)]
    return [(a, b) for b in y for a in x], elements


def ring(n_around, radii):
    """Half a ring over the x axis, from its left to its right."""
    angles = [math.pi*(1 - k/n_around) for k in range(n_around + 1)]
    nodes = [(r*math.cos(a), r*math.sin(a) if 0 < k < n_around else 0.0)
             for r in radii for k, a in enumerate(angles)]
    return nodes, rectangle(angles, radii)[1]


def mesh(nodes, elements, kind, base, name, number="{:.17g}"):
    """Cards of one body; labels begin behind `base` = (nodes, elements)."""
    lines = ["*NODE"]
    lines += [f"{base[0] + k}, " + ", ".join(number.format(v) for v in x) for k, x in enumerate(nodes, 1)]
    lines += [f"*ELEMENT, TYPE={kind}, ELSET={name}"]
    lines += [f"{base[1] + k}, " + ", ".join(str(base[0] + n + 1) for n in e) for k, e in enumerate(elements, 1)]
    return "\n".join(lines) + "\n"


def faces(nodes, elements, base, lies_on):
    """`label, face` of the faces whose two nodes lie on something."""
    found = []
    for k, e in enumerate(elements, base + 1):
        found += [(k, f + 1) for f in range(4) if lies_on(*nodes[e[f]]) and lies_on(*nodes[e[(f + 1) % 4]])]
    return found


def surface(name, sides):
    return f"*SURFACE, NAME={name}\n" + "".join(f"{k}, S{f}\n" for k, f in sides)


def members(name, labels):
    return f"*NSET, NSET={name}\n" + "".join(f"{k},\n" for k in labels)


def arch():
    """The model of PrePoMax: an arch on a floor."""
    floor = rectangle([8.0*k - 40.0 for k in range(11)], [-10.0, -5.0, 0.0])
    body = ring(24, [24.0, 27.0, 30.0])
    pressed = faces(*body, 20, lambda x, y: abs(math.hypot(x, y) - 30) < 1e-6 and y > 24)
    load = "*DLOAD\n" + "".join(f"{k}, P{f}, 50.\n" for k, f in pressed)
    return (mesh(*floor, "CPE4", (0, 0), "FLOOR", "{:.8E}") + mesh(*body, "CPE4", (33, 20), "ARCH", "{:.8E}")
            + members("FOOT", range(1, 12)) + members("CROWN", (46, 71, 96)) + members("TOP", [96])
            + surface("UNDER", faces(*floor, 0, lambda x, y: y == 0))
            + surface("OVER", faces(*body, 20, lambda x, y: y == 0)) + f"""*MATERIAL, NAME=STEEL
*DENSITY
7.8e-9
*ELASTIC
210000., 0.28
*SOLID SECTION, ELSET=FLOOR, MATERIAL=STEEL
5.
*SOLID SECTION, ELSET=ARCH, MATERIAL=STEEL
5.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I, ADJUST=0.
OVER, UNDER
*AMPLITUDE, NAME=BLOW
0., 0., 0.0005, 1., 0.001, 0.
*BOUNDARY
FOOT, 1, 2
CROWN, 1
*STEP, NLGEOM
*STATIC
0.5, 1., 1e-5, 1.
{load}*NODE FILE
U
*END STEP
*STEP
*DYNAMIC, DIRECT
5e-5, 0.001
*CLOAD, AMPLITUDE=BLOW
TOP, 2, -500.
*NODE FILE
U
*END STEP
""")


def press():
    """The model of Abaqus/CAE: half a ring, turned by half a turn, on a block."""
    block = rectangle([0.5*k - 2.0 for k in range(9)], [0.0, 0.5, 1.0])
    nodes, elements = ring(16, [0.5, 0.75, 1.0])
    punch = [(-float(f"{x:.9g}"), 2 - float(f"{y:.9g}")) for x, y in nodes], elements
    return (mesh(*block, "CPE4I", (0, 0), "BLOCK") + mesh(*punch, "CPE4I", (27, 16), "PUNCH")
            + members("FOOT", range(1, 10)) + members("TOP", [27 + k for k in (1, 17, 18, 34, 35, 51)])
            + surface("UNDER", faces(*block, 0, lambda x, y: y == 1))
            + surface("OVER", faces(*punch, 16, lambda x, y: math.hypot(x, y - 2) > 0.99))
            + surface("LOADED", faces(*punch, 16, lambda x, y: y == 2)) + """*MATERIAL, NAME=RUBBER
*DENSITY
1.1e-9
*HYPERELASTIC, MOONEY-RIVLIN
0.5, 0.1, 0.4
*MATERIAL, NAME=STEEL
*DENSITY
7.8e-9
*ELASTIC
2000., 0.3
*SOLID SECTION, ELSET=BLOCK, MATERIAL=RUBBER
*SOLID SECTION, ELSET=PUNCH, MATERIAL=STEEL
*SURFACE INTERACTION, NAME=I
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=I, TYPE=MORTAR, ADJUST=0.
OVER, UNDER
*AMPLITUDE, NAME=RAMP
0., 0., 1., 1.
*BOUNDARY
FOOT, 1, 2
*STEP, NLGEOM
*STATIC
0.25, 1., 1e-5, 1.
*BOUNDARY, AMPLITUDE=RAMP
TOP, 1, 1
TOP, 2, 2, -0.15
*NODE FILE
U
*END STEP
*STEP
*DYNAMIC
2e-6, 1e-4, 1e-9, 2e-6
*BOUNDARY, OP=NEW
FOOT, 1, 2
*DSLOAD
LOADED, P, 0.02
*NODE FILE
U
*END STEP
""")


# ---- runs ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("behaviour, inverse, rel", [
    ("LINEAR\n1000000", 1e-6, None),
    ("HARD", 0.0, 256*EPSILON),
    ("TIED\n1000000", 0.0, 256*EPSILON),
])
def test_two_blocks_as_freecad_writes_them(behaviour, inverse, rel, tmp_path):
    """Meshes that do not match have a uniform stress, in closed form.

    Contact that gives way pushes on the deformed surface, which is longer by the strain along it.
    """
    deck = tmp_path/"freecad.inp"
    deck.write_text(TEXTS["freecad"].replace("LINEAR\n1000000", behaviour))
    done = run_deck(deck, tmp_path)
    assert done.verdict["verdict"] == "good"
    fields = done.fields()
    p, poisson = 100.0, 0.3/210000
    x, y = fields.x[:, 0], fields.x[:, 1]
    is_upper = np.isin(np.arange(len(x)), np.concatenate(fields.cells[16:]))
    down = np.where(is_upper, p*(20/210000 + inverse + (y - 20)/105000), p*y/210000)
    u = fields["displacement"][-1]
    slack = (rel or poisson*p)*np.abs(u).max()
    assert np.abs(u[:, 0] - poisson*p*x).max() < slack
    assert np.abs(u[:, 1] + down).max() < slack
    with h5py.File(done.file(".h5"), "r") as file:
        assert file["sets/CONSTRAINTDISPLACEMENT/TOTAL_RF"][-1, 0, 1] == pytest.approx(4e4, rel=1e-12)
        if behaviour != "TIED\n1000000":
            assert file["sets/PAIRS/CF"][-1, 0, 1] == pytest.approx(4e4, rel=1e-12)
            assert "CF" not in file["sets/CONTACT"]        # totals alone, as MASTER= and SLAVE= ask


def compare(told, plain, least):
    """The last displacements are the same, and larger than `least`; so is what friction took."""
    u = [done.fields()["displacement"][-1] for done in (told, plain)]
    assert np.abs(u[0]).max() > least
    assert np.abs(u[0] - u[1]).max() < 1e-9*np.abs(u[0]).max()
    loss = [float(done.digits()["friction_loss"][-1]) for done in (told, plain)]
    assert loss[0] > 0 and loss[0] == pytest.approx(loss[1], rel=1e-9)


def test_an_arch_as_prepomax_writes_it(tmp_path):
    """As the plain deck, in statics and dynamics with friction: its faces stand in another order."""
    compare(run("prepomax", tmp_path), run_deck(Deck(arch(), "plain"), tmp_path), 0.05)


def test_a_press_as_abaqus_writes_it(tmp_path):
    """As the plain deck, whose nodes are turned by hand: off by the round-off of sines."""
    told, plain = run("abaqus", tmp_path), run_deck(Deck(press(), "plain"), tmp_path)
    compare(told, plain, 0.1)


def test_cards_that_change_nothing_are_named_in_the_log(tmp_path):
    for name, cards in {"freecad": ["*PHYSICAL CONSTANTS", "*EXPANSION", "*CONTROLS", "*OUTPUT"],
                        "prepomax": ["*Expansion", "*Conductivity", "*Specific heat", "*Output"],
                        "abaqus": ["*Section Controls", "thickness of *SURFACE INTERACTION", "*Controls"]}.items():
        (idle,) = [line for line in run(name, tmp_path).log.splitlines() if line.startswith("changes nothing: ")]
        assert all(f"{card} (" in idle for card in cards), idle


# ---- other forms of the same cards --------------------------------------------------------------

#: Exporter, text, what stands there instead, exit code, what is told; the first line is checked.
FORMS = [
    ("freecad", "LINEAR\n1000000", "LINEAR\n1000000\n*FRICTION\n0.2", 0, "no stick slope above 0 is given: half of the slope of the "
     "pressure is taken, 500000"),
    ("freecad", "LINEAR\n1000000", "EXPONENTIAL\n0.01, 100\n*FRICTION\n0.2", 0, "pressure is taken, 23025.9"),
    ("freecad", "LINEAR\n1000000", "TABULAR\n0, 0\n100, 0.01\n300, 0.02\n*FRICTION\n0.2", 0, "pressure is taken, 7500"),
    ("freecad", "LINEAR\n1000000", "LINEAR\n1000000\n*GAP CONDUCTANCE\n1000", 0, ""),
    ("freecad", "SLAVE=DEPConstraintContact", "SLAVE=INDConstraintContact", 2, "are no *CONTACT PAIR"),
    ("freecad", "LINEAR\n1000000", "TIED\n1000000", 0, "there is no *CONTACT PAIR that is not tied"),
    ("prepomax", "*Dynamic, Solver=Pardiso, Direct", "*Dynamic, Solver=Pardiso, Direct, Explicit=1", 0, ""),
    ("prepomax", "*Dynamic, Solver=Pardiso, Direct", "*Dynamic, Direct, Explicit=2", 2, "SCHEME=CENTRAL DIFFERENCE of step 2"),
    ("prepomax", "*Dynamic, Solver=Pardiso, Direct", "*Dynamic, Direct, Explicit=4", 2, "not a whole number from 0 to 3"),
    ("prepomax", "*Dynamic, Solver=Pardiso, Direct", "*Dynamic, Direct, Relative to absolute", 2, "motions are those in space"),
    ("prepomax", "*Dynamic, Solver=Pardiso, Direct", "*Dynamic, Direct, Alpha=-0.05", 2, "SCHEME=GENERALIZED ALPHA has"),
    ("prepomax", "** Steps", "*Initial conditions, Type=Temperature\nNode_Set-1, 20\n** Steps", 0, ""),
    ("prepomax", "** Steps", "*Pre-tension section, Surface=S, Node=1\n1, 0, 0\n** Steps", 2, "prescribe displacements by *BOUNDARY"),
    ("abaqus", "adjust=0.0", "adjust=0.0, no thickness", 0, "parameter NOTHICKNESS has no effect"),
    ("abaqus", "type=SURFACE TO SURFACE, adjust=0.0", "mechanical constraint=KINEMATIC, cpset=Int-1", 0, "parameter CPSET has no effect"),
    ("abaqus", "adjust=0.0", "tracking=STATE", 0, "parameter TRACKING has no effect"),
    ("abaqus", "Behavior, pressure-overclosure=HARD", "Behavior, penalty", 0, "parameter PENALTY has no effect"),
    ("abaqus", "pressure-overclosure=HARD", "no separation, pressure-overclosure=HARD", 2, "surfaces can separate; *TIE holds them together"),
    ("abaqus", "*Static\n", "*Static, stabilize=0.0002, allsdtol=0.05, continue=NO\n", 0, "parameter ALLSDTOL has no effect"),
    ("abaqus", "write, frequency=0\n** \n** FIELD OUTPUT: F-Output-1", "write, number interval=1, time marks=NO", 0,
     "parameter NUMBERINTERVAL has no effect"),
    ("abaqus", "application=TRANSIENT FIDELITY", "application=MODERATE DISSIPATION,initial=NO", 0, "APPLICATION=MODERATE DISSIPATION "
     "has no effect"),
    ("abaqus", "application=TRANSIENT FIDELITY", "application=QUASI-STATIC", 2, "use *STATIC for bodies that are held or press on each other"),
    ("abaqus", "** LOADS", "*Dload\n, GRAV, 9810., 0., -1.\n** LOADS", 0, ""),
    ("abaqus", "** LOADS", "*Dload\n, P1, 1.\n** LOADS", 2, "the element label or set is missing"),
    ("abaqus", "** LOADS", "*Bulk Viscosity\n0.06, 1.2\n** LOADS", 0, ""),
    ("abaqus", "** CONTROLS", "*Contact Interference, shrink\ns_Surf-1, m_Surf-1\n** CONTROLS", 0, ""),
    ("abaqus", "** CONTROLS", "*Contact Interference, shrink\ns_Surf-1, Surf-3\n** CONTROLS", 2, "no *CONTACT PAIR of these two "
     "surfaces"),
    ("abaqus", "** CONTROLS", "*Contact Interference, type=ELEMENT, shrink\n** CONTROLS", 2, "contact is that of *CONTACT PAIR"),
    ("abaqus", "** CONTROLS", "*Contact Controls, master=m_Surf-1, slave=s_Surf-1, stabilize=1.\n** CONTROLS", 0,
     "the value of STABILIZE has no effect"),
    ("abaqus", "*Output, field, variable=PRESELECT", "*Output, field, time points=T", 2, "unknown time points 'T'"),
    ("abaqus", "** INTERACTIONS", "*Contact Initialization Data, name=C\n** INTERACTIONS", 2, "or ADJUST of *CONTACT PAIR"),
]


@pytest.mark.parametrize("name, old, new, code, told", FORMS, ids=[f"{f[0]}-{k}" for k, f in enumerate(FORMS)])
def test_other_forms(name, old, new, code, told, tmp_path):
    """Those that mean nothing here are taken, those that do are refused with what to do instead."""
    assert old in TEXTS[name], old
    deck = tmp_path/"deck.inp"
    deck.write_text(TEXTS[name].replace(old, new, 1))
    done = emcon("check", deck)
    assert done.returncode == code, done.stderr
    assert told in done.stderr and len(re.findall(": error: ", done.stderr)) == (code > 0), done.stderr


def test_gravity_without_a_set_acts_on_all_elements(tmp_path):
    """As on a set of all of them."""
    runs = []
    for name in ("", "Whole"):
        deck = tmp_path/f"deck{name}.inp"
        sets = "*Elset, elset=Whole\nBlock-1.Set-1, Punch-1.Set-1\n*End Assembly"
        deck.write_text(TEXTS["abaqus"].replace("** LOADS", f"*Dload\n{name}, GRAV, 1e6, 0., -1.\n** LOADS", 1)
                        .replace("*End Assembly", sets))
        runs.append(run_deck(deck, tmp_path))
    assert runs[0].digits() == runs[1].digits()


def test_meshes_of_instances_that_are_no_parts(tmp_path):
    """Independent instances bring their own mesh, in the axes of their part."""
    text = TEXTS["abaqus"]
    for part, head in (("Block", "part=Block\n"), ("Punch", "180.\n")):
        mesh_of = re.search(rf"\*Part, name={part}\n(.*?)\*End Part\n", text, re.DOTALL)[1]
        text = text.replace(mesh_of, "").replace(head, head + mesh_of)
    deck = tmp_path/"independent.inp"
    deck.write_text(text)
    assert run_deck(deck, tmp_path).digits() == run("abaqus", tmp_path).digits()


def test_friction_on_a_pressure_has_half_of_its_slope_to_stick(tmp_path):
    """As if the deck said so: the blocks are of unlike stiffness across the load, and slip a little."""
    runs = []
    for law in ("0.2", "0.2, 500000"):
        deck = tmp_path/"freecad.inp"
        deck.write_text(TEXTS["freecad"].replace("LINEAR\n1000000", f"LINEAR\n1000000\n*FRICTION\n{law}")
                        .replace("105000,0.15", "105000,0.3"))
        runs.append(run_deck(deck, tmp_path).digits())
    assert runs[0] == runs[1] and float(runs[0]["contact_energy"][-1]) > 2.0
