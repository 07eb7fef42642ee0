"""The bench of CalculiX's decks: what it reads, what it says where CalculiX is missing, some decks."""

import itertools
import shutil
import sys

import numpy as np
import pytest
from scene_tools import ROOT, run_deck

sys.path.insert(0, str(ROOT/"tests"/"bench"))

import bench_suite  # noqa: E402
from peers import calculix_suite  # noqa: E402

DAT = """
 displacements (vx,vy,vz) for set NALL and time  0.5000000E+00

         1  0.000000E+00  1.000000E-03  0.000000E+00
        12  2.500000E-04 -2.000000E-03  1.000000E-17

 stresses (elem, integ.pnt.,sxx,syy,szz,sxy,sxz,syz) for set EALL and time  0.5000000E+00

         1   1 -1.857143E-04  4.333333E-04  0.000000E+00  3.205511E-17 -4.336809E-19 -3.252607E-19
"""
FRD = """    1UDATE              23.november.2026
  100CL  101 1.00000E+00           2                     0    1           1
 -4  DISP        4    1
 -5  D1          1    2    1    0
 -1         1 0.00000E+00-1.00000E-03 0.00000E+00
 -1        12-2.50000E-04 2.00000E-03 0.00000E+00
 -3
 -4  STRESS      6    1
 -1         1 1.00000E+00-1.00000E-03 0.00000E+00
 -3
"""


def test_files_of_calculix_are_read():
    told = calculix_suite.read_dat(DAT)
    assert list(told) == [0.5] and list(told[0.5]) == [1, 12]
    assert list(told[0.5][12]) == [2.5e-4, -2e-3, 1e-17]
    told = calculix_suite.read_frd(FRD)
    assert list(told) == [1.0] and list(told[1.0]) == [1, 12]
    assert list(told[1.0][12]) == [-2.5e-4, 2e-3, 0]


def test_what_is_compared():
    """Nodes that both have, at times that both have."""
    ours = {0.5: {12: np.array([2.6e-4, -2e-3]), 1: np.array([0, 1e-3])},
            1.0: {12: np.ones(2), 1: np.ones(2)}}
    count, largest, worst = bench_suite.difference(ours, calculix_suite.read_dat(DAT))
    assert (count, largest) == (4, 2e-3) and worst == pytest.approx(1e-5)


def test_reasons_are_grouped():
    out = [("`a`", "no heat"), ("`b`", "no shells"), ("`c`", "no shells")]
    assert bench_suite.grouped(out) == [("`b`, `c`", "no shells"), ("`a`", "no heat")]
    assert bench_suite.lines_of([], bench_suite.grouped(out), 7)[0].startswith(
        "0 decks compared, 0 of them within what CalculiX prints; 3 mechanical ones not compared; 7")


def test_words_that_refuse_decks(tmp_path):
    """A deck that is accepted, one that a word alone refuses, one with two."""
    good = (ROOT/"tests/decks/good_plain.inp").read_text()
    for name, old, new in [("good", "", ""), ("plastic", "*DENSITY", "*PLASTIC\n1.\n*DENSITY"),
                           ("both", "*DENSITY", "*PLASTIC\n1.\n*CREEP\n1.\n*DENSITY")]:
        (tmp_path/f"{name}.inp").write_text(good.replace(old, new, 1) if old else good)
    told = bench_suite.refusals(bench_suite.arguments().parse_args(["--suite", str(tmp_path)]))
    assert told == {"both": ["*PLASTIC", "*CREEP"], "good": [], "plastic": ["*PLASTIC"]}
    lines = bench_suite.refusal_lines(told)
    assert lines[0].startswith("`emcon check --lenient` accepts 1 of all 3 decks")
    assert lines[-1] == "| `*PLASTIC` | 2 | 2 | `plastic` |"


@pytest.mark.parametrize("message, word", [
    ("*ELEMENT: element type B31 is known but not supported by this version", "beams"),
    ("*ELEMENT: unknown element type 'D'; supported: CPE3", "TYPE=D"),
    ("*Rigid Body: parameter NSET is known but not supported (made of)", "*RIGID BODY, NSET"),
    ("*ELASTIC: TYPE='ORTHO' is known but not supported (materials)", "*ELASTIC, TYPE=ORTHO"),
    ("unknown keyword '*SUBMODEL'", "*SUBMODEL"),
    ("*MPC: known but not supported: write what it couples", "*MPC"),
    ("*CONTACT PAIR: contact in three dimensions is not in this version",
     "contact in three dimensions"),
    ("*NODE: node 12 is defined twice; first at", "*NODE: node # is defined twice")])
def test_words_of_messages(message, word):
    assert bench_suite.word(message) == word


def test_mechanical_decks():
    assert calculix_suite.is_mechanical("*STATIC\n*ELEMENT, TYPE=C3D8\n")
    assert not calculix_suite.is_mechanical("*Heat transfer\n")
    assert not calculix_suite.is_mechanical("*ELEMENT, TYPE=D, ELSET=PIPE\n")


def test_without_calculix(capsys, monkeypatch):
    for missing in (["--ccx", "no_such_program"], ["--ccx", "true", "--suite", "/no/such/folder"]):
        monkeypatch.setattr(sys, "argv", ["bench_suite.py", *missing])
        bench_suite.main()
        assert "CalculiX is passed over" in capsys.readouterr().out


@pytest.mark.skipif(not (shutil.which("ccx") and calculix_suite.FOLDER.is_dir()),
                    reason="CalculiX (calculix-ccx, calculix-ccx-test) is not installed")
def test_some_decks():
    names = ["oneel", "planestrain", "planestrain2", "planestress", "b31"]
    options = bench_suite.arguments().parse_args(names)
    rows, out, _ = bench_suite.tables(options, shutil.which("ccx"))
    assert [row[0] for row in rows] == [f"`{name}`" for name in sorted(names[:-1])]
    assert not any(row[-1] for row in rows)
    assert out == [("`b31`", "*ELEMENT: element type B31 is known but not supported by this version")]


def brick(corners, thickness, moduli):
    """Stiffness of eight nodes for motions of a sheet: (u, v, half of what it grows) per corner."""
    sign = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    place = np.array([(*c, s) for s in (-1, 1) for c in sign])
    x = np.array([(*c, s*thickness/2) for s in (-1, 1) for c in corners])
    sheet = np.zeros((24, 12))
    for a, (_, _, s) in enumerate(place):
        for k, way in enumerate((1, 1, s)):
            sheet[3*a + k, 3*(a % 4) + k] = way
    total = np.zeros((24, 24))
    for point in itertools.product((-3**-0.5, 3**-0.5), repeat=3):
        one = 1 + place*point
        slope = place*np.stack([one[:, 1]*one[:, 2], one[:, 0]*one[:, 2], one[:, 0]*one[:, 1]], 1)/8
        jacobian = x.T @ slope
        strain = np.zeros((6, 24))
        for a, (gx, gy, gz) in enumerate(slope @ np.linalg.inv(jacobian)):
            strain[:, 3*a:3*a + 3] = [[gx, 0, 0], [0, gy, 0], [0, 0, gz], [gy, gx, 0], [0, gz, gy],
                                      [gz, 0, gx]]
        total += np.linalg.det(jacobian)*strain.T @ moduli @ strain
    return sheet.T @ total @ sheet


def test_the_brick_of_planestress3():
    """Why CPS4 of CalculiX differ by 2.3 %: the thickness of its sheet follows its nodes."""
    young, nu = 9.1e3, 0.3
    lam, mu = young*nu/((1 + nu)*(1 - 2*nu)), young/(2 + 2*nu)
    moduli = mu*np.diag([2, 2, 2, 1, 1, 1.0])
    moduli[:3, :3] += lam
    x = np.array([(i, j) for j in (0, 5, 10) for i in (0, 10, 20)], float)
    matrix = np.zeros((27, 27))
    for element in ([0, 1, 4, 3], [1, 2, 5, 4], [4, 5, 8, 7], [3, 4, 7, 6]):
        place = (3*np.array(element)[:, None] + np.arange(3)).ravel()
        matrix[np.ix_(place, place)] += brick(x[element], 0.1, moduli)
    free = [12, 13, *range(2, 27, 3)]
    force = np.zeros(27)
    force[12:14] = 86.60254038, 50
    u = np.linalg.solve(matrix[np.ix_(free, free)], force[free])
    assert u[0] == pytest.approx(5.288692e-2, rel=5e-7)      # as CalculiX prints
    assert u[1] == pytest.approx(1.639336e-2, rel=5e-7)


@pytest.mark.skipif(not list(calculix_suite.FOLDER.glob("beamog.inp*")),
                    reason="the decks of CalculiX are not installed")
def test_the_closed_form_of_beamog(tmp_path):
    """A bar of eight under forces of 1 in all, of Ogden's law; the deck has them with six digits."""
    mu, alpha = 3.488, 2.163
    d1 = 0.1/mu                                              # in place of 0

    def faults(stretch):
        long, wide = stretch
        volume = long*wide**2
        power = (stretch/volume**(1/3))**alpha
        shear = 2*mu/alpha*2/3*(power[0] - power[1])
        push = 2/d1*(volume - 1)*volume
        return np.array([(shear + push)/long - 1, push - shear/2])

    stretch = np.array([1.1, 0.95])
    for _ in range(20):
        slope = [(faults(stretch + h) - faults(stretch - h))/2e-6 for h in 1e-6*np.eye(2)]
        stretch = stretch - np.linalg.solve(np.transpose(slope), faults(stretch))
    deck = tmp_path/"beamog.inp"
    deck.write_text(calculix_suite.text_of(next(calculix_suite.FOLDER.glob("beamog.inp*"))), "latin-1")
    bench_suite.run(deck)
    told = bench_suite.displacements(deck)
    assert max(u[2] for u in told[max(told)].values()) == pytest.approx(8*(stretch[0] - 1), rel=1e-6)


def test_labels_of_nodes():
    text = "*Node, nset=A\n** first\n7, 0, 0\n3, 1, 0\n*NODE PRINT\nU\n*NODE\n5, 1, 1\n7, 0, 0\n"
    assert calculix_suite.node_labels(text) == [7, 3, 5]


def test_the_closed_form_of_beamnh(tmp_path):
    """A bar of neo-Hooke's law under a pull on what its end is: 2 of Cauchy stress."""
    c10, d1, pull = 1.92505, 0.026, 2.0

    def faults(stretch):
        long, wide = stretch
        volume = long*wide**2
        shear = 4/3*c10*volume**(-5/3)*(long**2 - wide**2)
        push = 2/d1*(volume - 1)
        return np.array([shear + push - pull, push - shear/2])

    stretch = np.array([1.1, 0.95])
    for _ in range(20):
        slope = [(faults(stretch + h) - faults(stretch - h))/2e-6 for h in 1e-6*np.eye(2)]
        stretch = stretch - np.linalg.solve(np.transpose(slope), faults(stretch))
    long, wide = stretch
    faces = "*BOUNDARY\n1, 1, 3\n2, 2, 3\n3, 3\n4, 1\n4, 3\n"
    corner = [(0, 0), (1, 0), (1, 1), (0, 1)]
    nodes = "".join(f"{4*z + k + 1}, {x}, {y}, {z}\n" for z in (0, 1) for k, (x, y) in
                    enumerate(corner))
    (tmp_path/"bar.inp").write_text(
        f"*NODE\n{nodes}*ELEMENT, TYPE=C3D8, ELSET=E\n1, 1, 2, 3, 4, 5, 6, 7, 8\n{faces}"
        f"*MATERIAL, NAME=M\n*HYPERELASTIC, NEO HOOKE\n{c10}, {d1}\n"
        f"*SOLID SECTION, ELSET=E, MATERIAL=M\n*STEP, NLGEOM\n*STATIC\n1., 1.\n"
        f"*DLOAD\n1, P2, {-pull}\n*NODE FILE\nU\n*END STEP\n")
    u = run_deck(tmp_path/"bar.inp", tmp_path).fields()["displacement"][-1]
    assert u[6] == pytest.approx([wide - 1, wide - 1, long - 1], rel=1e-9)
