"""`*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR`, `EXPONENTIAL` and `TABULAR`: contact that gives way.

A block of one element stands on, or falls onto, a fixed floor: judged by places against closed forms.
"""

import math
import shutil
import subprocess

import numpy as np
import pytest
from scene_tools import Deck, attempt, run_deck
from test_contact_output import restart

FORMULATIONS = ["NODE TO SURFACE", "SEGMENT", "MORTAR"]
#: Pressure by overclosure, and the overclosure of a pressure, of each behaviour.
BEHAVIOURS = {
    "LINEAR\n100.": lambda p: p/100,
    "EXPONENTIAL\n.005, .5": lambda p: 0.005/math.log(100)*math.log(p/0.5),
    "TABULAR\n0., -.01\n2., .01\n10., .02": lambda p: -0.01 + p/100 if p < 2 else 0.01 + (p - 2)/800,
}


def deck(behaviour, formulation, step, *, gap=0.0, more="", young=1e3, start=""):
    """A unit square above a floor that is held."""
    return Deck(f"""*NODE
1, 0., {gap!r}
2, 1., {gap!r}
3, 1., {1 + gap!r}
4, 0., {1 + gap!r}
5, -.5, -1.
6, 1.5, -1.
7, 1.5, 0.
8, -.5, 0.
*ELEMENT, TYPE=CPE4, ELSET=A
1, 1, 2, 3, 4
*ELEMENT, TYPE=CPE4, ELSET=B
2, 5, 6, 7, 8
*MATERIAL, NAME=M
*ELASTIC
{young!r}, 0.
*DENSITY
1.
*SOLID SECTION, ELSET=A, MATERIAL=M
*SOLID SECTION, ELSET=B, MATERIAL=M
*NSET, NSET=FEET
1, 2
*SURFACE, NAME=SA
1, S1
*SURFACE, NAME=SB
2, S3
*SURFACE INTERACTION, NAME=I
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE={behaviour}
*CONTACT PAIR, INTERACTION=I, TYPE={formulation}{more}
SA, SB
*BOUNDARY
5, 1, 2
6, 1, 2
7, 1, 2
8, 1, 2
1, 1
2, 1
3, 1
4, 1
{start}{step}*NODE FILE, FREQUENCY=1
U, V
*CONTACT FILE, FREQUENCY=1
CF
*END STEP
""", "pressure")


def static(load, nlgeom=""):
    return f"*STEP{nlgeom}\n*STATIC\n.25, 1.\n*CLOAD\n3, 2, {-load/2!r}\n4, 2, {-load/2!r}\n"


def dynamic(h, t_end, kind="DIRECT"):
    return f"*STEP, NLGEOM\n*DYNAMIC, {kind}\n{h!r}, {t_end!r}\n"


FALLS = "*INITIAL CONDITIONS, TYPE=VELOCITY\n1, 2, -1.\n2, 2, -1.\n3, 2, -1.\n4, 2, -1.\n"


def feet(run):
    fields = run.fields()
    return (fields.x + fields["displacement"])[:, :2, 1]


@pytest.mark.parametrize("load", [0.5, 5.0])
@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("behaviour", BEHAVIOURS)
def test_a_load_goes_in_by_the_curve(behaviour, formulation, load, tmp_path):
    """The floor, loaded by the block alone, stays flat to the accuracy of what it gives way by."""
    run = run_deck(deck(behaviour, formulation, static(load)), tmp_path)
    assert run.verdict["verdict"] == "good"
    assert -feet(run)[-1] == pytest.approx(BEHAVIOURS[behaviour](load), rel=1e-9, abs=1e-12)
    assert run.fields()["contact_force"][-1][:2, 1].sum() == pytest.approx(load, rel=1e-9)


def pressed(gap, way, young, clearance, at_touch):
    """Gap that is left of a bar of length and area 1 whose other end moves by `way` to an exponential."""
    def missing(left):
        return at_touch*100.0**(-left/clearance) - young*(way - (gap - left))

    low, high = gap - way, gap + clearance
    while high - low > 1e-15:
        middle = 0.5*(low + high)
        low, high = (middle, high) if missing(middle) > 0 else (low, middle)
    return low


@pytest.mark.parametrize("gap", [0.0, 1e-6, 5e-4, 1.1e-3])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_stiff_exponential_that_pushes_from_the_start(formulation, gap, tmp_path):
    """A block within reach of its floor, or just outside, is pressed far beyond that in an increment."""
    step = "*STEP\n*STATIC\n.5, 1.\n*BOUNDARY\n3, 2, 2, -.02\n4, 2, 2, -.02\n"
    text = deck("EXPONENTIAL\n.001, 100.", formulation, step, gap=gap)
    run = run_deck(text, tmp_path)
    left = gap + run.fields()["displacement"][-1, :2, 1]
    np.testing.assert_allclose(left, pressed(gap, 0.02, 1e3, 1e-3, 100.0), atol=1e-10)
    assert run.history["cuts"].sum() == 0


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("behaviour", BEHAVIOURS)
def test_what_it_stores_does_not_snap(behaviour, formulation, tmp_path):
    """STABILIZE cuts increments in which energy is set free; what contact stores stays there."""
    step = static(5.0, ", NLGEOM").replace("*STATIC", "*STATIC, STABILIZE")
    run = run_deck(deck(behaviour, formulation, step), tmp_path)
    assert run.verdict["verdict"] == "good"
    assert run.verdict["cuts"] == 0
    assert run.verdict["contact_energy"] > 0.1*run.verdict["strain"]


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_blocks_that_fit_each_other(formulation, tmp_path):
    """Corner on corner, in by a tenth and a fifth of an edge: by the curve, and nothing else."""
    for load in (1.0, 10.0, 20.0):
        text = deck("LINEAR\n100.", formulation, static(load)).text()
        for old, new in (("5, -.5,", "5, 0.,"), ("6, 1.5,", "6, 1.,"), ("7, 1.5,", "7, 1.,"), ("8, -.5,", "8, 0.,")):
            text = text.replace(old, new)
        run = run_deck(Deck(text, "pressure"), tmp_path/str(load))
        assert run.verdict["verdict"] == "good"
        assert -feet(run)[-1] == pytest.approx(load/100, rel=1e-9)


def test_a_tension_bends_the_line(tmp_path):
    """K o (1/2 + atan(o/eps)/pi), eps = pi sigma/K, as CalculiX has it for nodes; surfaces that are
    integrated over have the line."""
    for formulation, expected in (("NODE TO SURFACE", None), ("MORTAR", 0.005)):
        run = run_deck(deck("LINEAR\n100., .1", formulation, static(0.5)), tmp_path/formulation)
        over = -feet(run)[-1, 0]
        if expected is None:
            eps = math.pi*0.1/100
            assert 100*over*(0.5 + math.atan(over/eps)/math.pi) == pytest.approx(0.5, rel=1e-9)
            assert "do not pull at each other" in run.errors
        else:
            assert over == pytest.approx(expected, rel=1e-9)


@pytest.mark.each_value
@pytest.mark.parametrize("gap", [0.0, 0.02])
@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("behaviour", BEHAVIOURS)
def test_energy_stays(behaviour, formulation, gap, tmp_path):
    """What the curve stores is in the balance, from the first instant on, also where it acts there
    already; the block comes back as it went."""
    run = run_deck(deck(behaviour, formulation, dynamic(0.002, 0.5), gap=gap, start=FALLS), tmp_path)
    history = run.history
    assert run.verdict["verdict"] == "good" and run.verdict["cuts"] == 0
    assert np.abs(history["total"] - history["total"][0]).max() < 1e-12*history["total"][0]
    assert np.abs(history["contact_work"]).max() < 1e-12
    assert history["contact_energy"].max() > 0.2 and history["contact_energy"][-1] == 0.0
    at_start = {"LINEAR": 0.0, "EXPONENTIAL": 0.5*0.005/math.log(100)*(1 - 1e-6), "TABULAR": 0.005}
    expected = at_start[behaviour.split()[0]] if gap == 0.0 else history["contact_energy"][0]
    assert history["contact_energy"][0] == pytest.approx(expected, rel=1e-9)
    assert history["kinetic"][-1] > 0.49 and history["py"][-1] > 0.9


def test_half_a_swing(tmp_path):
    """A stiff block on a linear pressure is a mass on a spring: depth v sqrt(m/K), and its time."""
    h = 1e-3
    run = run_deck(deck("LINEAR\n100.", "NODE TO SURFACE", dynamic(h, 0.5), young=1e6, start=FALLS),
                   tmp_path)
    way = feet(run)
    assert -way.min() == pytest.approx(0.1, rel=1e-3)
    out = np.flatnonzero((way[1:] > 0).all(axis=1))[0] + 1
    assert run.history["time"][out] == pytest.approx(math.pi/10, abs=2*h)


@pytest.mark.parametrize("behaviour", ["LINEAR\n100.", "TABULAR\n0., -.01\n2., .01\n10., .02"])
def test_in_explicit_steps(behaviour, tmp_path):
    run = run_deck(deck(behaviour, "NODE TO SURFACE", dynamic(2e-3, 0.5, "EXPLICIT, DIRECT"), gap=0.02,
                        start=FALLS), tmp_path)
    history = run.history
    assert history["contact_energy"].max() > 0.2
    assert np.abs(history["total"] - history["total"][0]).max() < 1e-2*history["total"][0]


def test_a_hard_pair_beside_it_gives_way_by_a_penalty_if_asked(tmp_path):
    text = deck("LINEAR\n100.", "NODE TO SURFACE", static(0.5)).text()
    text = text.replace("*BOUNDARY", "*SURFACE INTERACTION, NAME=H\n*CONTACT PAIR, INTERACTION=H, SIDES=ONE\n"
                        "SB, SA\n*BOUNDARY", 1)
    refused, _ = attempt(Deck(text, "pressure"), tmp_path/"a", (), {})
    assert refused.returncode == 2 and "it is hard, but other pairs have" in refused.stderr
    text = text.replace("*CLOAD", "*CONSTRAINT METHOD, TYPE=PENALTY\n*CLOAD")
    run = run_deck(Deck(text, "pressure"), tmp_path/"b")
    assert run.verdict["verdict"] == "good"


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("behaviour", list(BEHAVIOURS)[1:])
def test_a_block_at_rest_is_pushed_away(behaviour, formulation, tmp_path):
    """Nothing but the pressure before contact acts: what the curve has stored becomes motion."""
    stored = {"EXPONENTIAL": 0.5*0.005/math.log(100)*(1 - 1e-6), "TABULAR": 0.5*1.0*0.01}[behaviour.split("\n")[0]]
    run = run_deck(deck(behaviour, formulation, dynamic(0.005, 0.6), young=1e6), tmp_path)
    assert run.verdict["verdict"] == "good"
    assert run.history["total"][0] == pytest.approx(stored, rel=1e-9)
    assert run.history["active"][-1] == 0
    # The block takes up to a few times pressure by Young's modulus of it.
    assert run.history["py"][-1] == pytest.approx(math.sqrt(2*stored), rel=1e-4)


def test_a_run_goes_on_from_its_middle(tmp_path):
    """What contact has stored is in the restart file: the same bits."""
    text = deck("EXPONENTIAL\n.005, .5", "NODE TO SURFACE", dynamic(0.002, 0.02), start=FALLS).text()
    step = text[text.index("*STEP"):]
    text = text.replace("*NODE FILE", "*RESTART, WRITE, FREQUENCY=10\n*NODE FILE") \
        + step.replace("*NODE FILE", "*RESTART, WRITE, FREQUENCY=0\n*NODE FILE")
    run = run_deck(Deck(text, "pressure"), tmp_path/"whole")
    assert run.history["contact_energy"][10] > 0
    (tmp_path/"copy").mkdir()
    copy = restart(run, tmp_path/"copy")
    assert "resumed after increment 10" in copy.log
    assert copy.digits() == run.digits()
    assert run.verdict["give"] > 0 and copy.verdict["verdict"] == run.verdict["verdict"] == "good"


# ---- friction with a slope of stick -------------------------------------------------------------

MU, STICK = 0.3, 50.0


def rubs(deck_, free=True):
    text = deck_.text().replace("*CONTACT PAIR", f"*FRICTION\n{MU}, {STICK}\n*CONTACT PAIR")
    return text.replace("1, 1\n2, 1\n3, 1\n4, 1\n", "") if free else text


def requests(text):
    return text[text.index("*NODE FILE"):]


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_block_is_moved_to_and_fro(formulation, tmp_path):
    """Pressed by 1, all nodes led along: the spring, up to the coefficient times the push."""
    text = rubs(deck("LINEAR\n100.", formulation, ""))
    ask = requests(text).replace("CF\n", "CF, CSHEAR, CSLIP\n")
    text = text[:text.index("*NODE FILE")]
    led = "".join(f"{k}, 1, 1, .02\n" for k in range(1, 5))
    text += ("*AMPLITUDE, NAME=A, TIME=TOTAL TIME\n0., 0., 1., 0., 1.5, 1., 2.5, -1., 3.5, 1.\n"
             "*STEP\n*STATIC\n.25, 1.\n*BOUNDARY\n1, 1\n2, 1\n3, 1\n4, 1\n*CLOAD\n3, 2, -.5\n4, 2, -.5\n" + ask
             + "*STEP\n*STATIC\n.05, 2.5\n*BOUNDARY, OP=NEW\n5, 1, 2\n6, 1, 2\n7, 1, 2\n8, 1, 2\n"
             "*BOUNDARY, AMPLITUDE=A\n" + led + ask)
    run = run_deck(Deck(text, "pressure"), tmp_path)
    assert run.verdict["verdict"] == "good"
    fields = run.fields()
    way, force = fields["displacement"][:, 0, 0], fields["contact_force"][:, :2, 0].sum(axis=1)
    shear = fields["contact_shear"]
    stretch, last = 0.0, 0.0
    for k in range(5, len(way)):
        stretch = np.clip(stretch + way[k] - last, -MU/STICK, MU/STICK)
        last = way[k]
        assert force[k] == pytest.approx(-STICK*stretch, abs=1e-9)
        # Slip counts along the floor's edge, which goes to the left.
        assert shear[k][:2].mean() == pytest.approx(-STICK*stretch, abs=1e-8)
    assert np.abs(force).max() == pytest.approx(MU, rel=1e-9) and force.min() < 0 < force.max()
    # Each way from side to side: to the limit on the other side, and on at it.
    loss = MU*(0.02 - MU/STICK) + 2*MU*(0.04 - 2*MU/STICK)
    assert run.history["friction_loss"][-1] == pytest.approx(loss, rel=1e-6)


@pytest.mark.each_value
@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("behaviour", BEHAVIOURS)
def test_it_slides_to_rest(behaviour, formulation, tmp_path):
    """Energy with what friction took is that of the start; friction never gives; it goes about as far as
    a mass point that mu g stops."""
    start = "*INITIAL CONDITIONS, TYPE=VELOCITY\n1, 1, .3\n2, 1, .3\n3, 1, .3\n4, 1, .3\n"
    step = dynamic(0.005, 1.5) + "*DLOAD\nA, GRAV, 1., 0., -1.\n"
    run = run_deck(Deck(rubs(deck(behaviour, formulation, step, start=start)), "pressure"), tmp_path)
    history = run.history
    assert run.verdict["verdict"] == "good" and run.verdict["cuts"] == 0
    balance = history["total"] + history["friction_loss"]
    assert np.abs(balance - balance[0]).max() < 1e-12
    assert np.diff(history["friction_loss"]).min() >= 0.0
    assert history["friction_loss"][-1] == pytest.approx(0.045, rel=0.1)
    # It bounces once and a half on the way, as it begins without a pressure.
    way = run.fields()["displacement"][-1, :4, 0].mean()
    assert way == pytest.approx(0.5*0.3**2/MU, rel=0.25)


def test_damping_beside_friction(tmp_path):
    """Of each what it takes: the balance closes with both, and shears are those of friction alone."""
    step = dynamic(0.005, 0.5) + "*DLOAD\nA, GRAV, 1., .2, -1.\n"
    text = rubs(deck("LINEAR\n100.", "NODE TO SURFACE", step)).replace(
        "*CONTACT PAIR", "*CONTACT DAMPING, TANGENT FRACTION=.5\n2., .1, .5\n*CONTACT PAIR", 1)
    run = run_deck(Deck(text.replace("CF\n", "CF, CSHEAR, CSTR\n"), "pressure"), tmp_path)
    history = run.history
    assert run.verdict["verdict"] == "good"
    balance = history["total"] + history["friction_loss"] + history["contact_damping_loss"]
    assert np.abs(balance - balance[0]).max() < 1e-12
    assert history["contact_damping_loss"][-1] > 1e-3 and history["contact_energy"].max() > 1e-3
    fields = run.fields()
    shear, pressure = fields["contact_shear"][:, :2], fields["contact_pressure"][:, :2]
    assert (np.abs(shear) <= MU*pressure + 1e-12).all() and np.abs(shear).max() > 0.05


def test_friction_goes_on_from_the_middle(tmp_path):
    text = rubs(deck("LINEAR\n100.", "MORTAR", dynamic(0.005, 0.2) + "*DLOAD\nA, GRAV, 1., 0., -1.\n",
                     start="*INITIAL CONDITIONS, TYPE=VELOCITY\n1, 1, .3\n2, 1, .3\n3, 1, .3\n4, 1, .3\n"))
    step = text[text.index("*STEP"):]
    text = text.replace("*NODE FILE", "*RESTART, WRITE, FREQUENCY=40\n*NODE FILE") \
        + step.replace("*NODE FILE", "*RESTART, WRITE, FREQUENCY=0\n*NODE FILE")
    run = run_deck(Deck(text, "pressure"), tmp_path/"whole")
    (tmp_path/"copy").mkdir()
    copy = restart(run, tmp_path/"copy")
    assert "resumed after increment 40" in copy.log
    assert copy.digits() == run.digits()


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("behaviour", BEHAVIOURS)
def test_friction_alone_holds_a_block(behaviour, formulation, tmp_path):
    """Nothing else does sideways: it slips by the shear over the slope; no static state above mu N."""
    def pushed(push):
        step = "*STEP\n*STATIC\n.5, 1.\n*CLOAD\n3, 2, -.5\n4, 2, -.5\n" \
            f"1, 1, {push/2!r}\n2, 1, {push/2!r}\n"
        return Deck(rubs(deck(behaviour, formulation, step, young=1e7)), "pressure")
    run = run_deck(pushed(0.2), tmp_path/"below")
    assert run.verdict["verdict"] == "good"
    assert run.fields()["displacement"][-1, :2, 0].mean() == pytest.approx(0.2/STICK, rel=1e-4)
    done, _ = attempt(pushed(0.4), tmp_path/"above", (), {})
    assert done.returncode == 3, done.stderr


# ---- beside CalculiX ----------------------------------------------------------------------------


def patch(first, x0, y0, width, height, n):
    """Nodes from `first` on and elements, two high and `n` wide."""
    node = "".join(f"{first + j*(n + 1) + i}, {x0 + width*i/n!r}, {y0 + height*j/2!r}, 0.\n"
                   for j in range(3) for i in range(n + 1))
    corner = [(first + j*n + i, first + j*(n + 1) + i) for j in range(2) for i in range(n)]
    return node, "".join(f"{k}, {a}, {a + 1}, {a + n + 2}, {a + n + 1}\n" for k, a in corner)


LED = "1, 1, 1\n6, 1, 1\n11, 1, 1\n"


def two_patches(behaviour, friction, load):
    """A block on a floor, pressed by `load`; with friction also pushed, else led on its left side."""
    (upper, block), (lower, floor) = patch(1, 0.0, 0.0, 1.0, 0.5, 4), patch(101, -0.5, -0.5, 2.0, 0.5, 8)
    rows = {"FOOT": range(1, 5), "TOP": range(109, 117)}
    faces = {name: "".join(f"{k}, S{1 if name == 'FOOT' else 3}\n" for k in row)
             for name, row in rows.items()}
    rubs_ = "*FRICTION\n0.3, 5000.\n" if friction else ""
    held = "".join(f"{k}, 1, 2\n" for k in range(101, 110))
    push = f"*CLOAD\n11, 1, {0.04*load!r}\n12, 1, {0.04*load!r}\n"
    return f"""*NODE, NSET=ALL
{upper}{lower}*ELEMENT, TYPE=CPE4, ELSET=A
{block}*ELEMENT, TYPE=CPE4, ELSET=B
{floor}*MATERIAL, NAME=M
*ELASTIC
1000., .3
*SOLID SECTION, ELSET=A, MATERIAL=M
1.
*SOLID SECTION, ELSET=B, MATERIAL=M
1.
*SURFACE, NAME=FOOT
{faces["FOOT"]}*SURFACE, NAME=TOP
{faces["TOP"]}*SURFACE INTERACTION, NAME=I
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE={behaviour}
{rubs_}*CONTACT PAIR, INTERACTION=I, TYPE=NODE TO SURFACE, GUARD=NO
FOOT, TOP
*BOUNDARY
{held}{"" if friction else LED}*STEP
*STATIC
.25, 1.
*DLOAD
{"".join(f"{k}, P3, {load!r}" + chr(10) for k in range(5, 9))}{push if friction else ""}*NODE PRINT, NSET=ALL
U
*NODE FILE
U
*END STEP
"""


@pytest.mark.each_value
@pytest.mark.skipif(not shutil.which("ccx"), reason="CalculiX is not installed")
@pytest.mark.parametrize("friction", [False, True])
@pytest.mark.parametrize("behaviour", ["LINEAR\n1e4, 1e-6", "LINEAR\n1e4, 1.",
                                       "TABULAR\n0., 0.\n10., .001\n1000., .01"])
def test_calculix_says_the_same(behaviour, friction, tmp_path):
    """The same text through both, nodes on surfaces: displacements differ by what they turn by, which
    only one of the codes follows without NLGEOM, and fall with the load."""
    missed = []
    for load in (5.0, 0.05):
        folder = tmp_path/str(load)
        folder.mkdir()
        text = two_patches(behaviour, friction, load)
        (folder/"peer.inp").write_text(text)
        subprocess.run(["ccx", "-i", "peer"], cwd=folder, capture_output=True, timeout=100, check=False)
        rows = (folder/"peer.dat").read_text().rpartition("displacements")[2].splitlines()
        theirs = {int(row.split()[0]): [float(u) for u in row.split()[1:3]] for row in rows if len(row.split()) == 4}
        fields = run_deck(Deck(text, "ours"), folder).fields()
        ours = dict(zip([*range(1, 16), *range(101, 128)], fields["displacement"][-1]))
        assert len(theirs) == len(ours) == 42
        scale = np.abs(list(theirs.values())).max()
        missed.append(max(np.abs(ours[k][:2] - theirs[k]).max() for k in ours)/scale)
    assert missed[0] < 1e-3 and missed[1] < 1e-4 and missed[1] < 0.2*missed[0], missed
