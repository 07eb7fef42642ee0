"""What contact writes in space: sums of forces and moments, pressures, the file of faces."""

import json
import sys

import h5py
import numpy as np
import pytest
from contact_blocks import FieldsOf, Pair, columns, pressed, thrown
from scene_tools import EPSILON, ROOT, Deck, emcon, run_deck

sys.path.insert(0, str(ROOT / "pywrap"))

from emcon.animation import animate  # noqa: E402
from emcon.results import FieldFile, Results, locate, read_pairs  # noqa: E402
from emcon.scene import read_scene  # noqa: E402
from emcon.stepper import Stepper  # noqa: E402

#: Round-off of a sum of contact forces, in units of epsilon times the sum of their sizes.
NOISE = 8
#: Kinds of the upper and the lower block, cells along their edges.
MESHES = [("C3D8", "C3D8", 3, 4), ("C3D4", "C3D8", 2, 3), ("C3D10", "C3D10", 2, 3),
          ("C3D20", "C3D20", 2, 3), ("C3D8", "C3D10", 3, 2)]
SIDES = ["", ", SIDES=ONE"]
#: Area and pressure of the pressed blocks: without lateral strain, 1000 at a strain that the large
#: rotations of NLGEOM leave as it is but for the stress that it takes.
STRAIN = 0.025
PRESSURE = 1000*STRAIN*(1 - 0.5*STRAIN)*(1 - STRAIN)


def series(run, place, variable):
    return run.series(place, variable)[1]


#: Held from both sides quadratic faces take seconds.
PRESSED = [pytest.param((m, s), marks=[pytest.mark.long]*(m[0] in ("C3D10", "C3D20") and not s))
           for m in MESHES for s in SIDES]


@pytest.fixture(scope="module", params=PRESSED,
                ids=lambda p: "-".join(map(str, p[0])) + ("-one" if p[1] else "-both"))
def pressing(request, tmp_path_factory):
    (upper, lower, m, n), sides = request.param
    pair = Pair((upper, lower), (m, n))
    # Edges bear forces that are of no node of the pair.
    text = pair.deck(pressed(), sides).replace("*CONTACT PAIR,", "*CONTACT PAIR, EDGES=NO,")
    run = run_deck(Deck(text, "pressed"), tmp_path_factory.mktemp("faces"))
    return run, pair, sides


@pytest.fixture(scope="module")
def impact(tmp_path_factory):
    """A turned block falls onto an edge with a spin, in free flight both, held from both sides."""
    pair = Pair(("C3D8", "C3D8"), (2, 3), gap=0.08, size=(0.8, 1.4), turn=0.12)
    text = pair.deck(thrown(pair.x[:pair.n_upper], spin=(0.0, 0.0, 1.0), more="*RESTART, WRITE, "
                            "FREQUENCY=8\n"), law="*HYPERELASTIC, NEO HOOKE\n40., 0.01\n")
    return run_deck(Deck(text, "impact"), tmp_path_factory.mktemp("impact")), pair


def sums(run, pair, is_dynamic):
    """Force and moment about the origin on both bodies, all frames, by numpy; and round-off."""
    fields = FieldsOf(run.file(".vtkhdf"))
    u = fields.point["displacement"].copy()
    if is_dynamic:
        u[1:] = 0.5*(u[1:] + u[:-1])          # forces belong to the middle of a step
    place, force = pair.x + u, fields.point["contact_force"]
    wrench = np.concatenate([force, np.cross(place, force)], axis=2)
    noise = NOISE*EPSILON*np.abs(force).sum(axis=(1, 2))[:, None]*max(1, np.abs(place).max())
    return wrench[:, pair.is_upper].sum(axis=1), wrench[:, ~pair.is_upper].sum(axis=1), noise


def test_forces_and_moments_of_both_bodies_are_opposite(pressing, impact):
    for run, pair, is_dynamic in ((*pressing[:2], False), (*impact, True)):
        upper, lower, noise = sums(run, pair, is_dynamic)
        assert np.abs(upper).max() > 1
        assert (np.abs(upper + lower) <= noise).all()


def test_totals_of_pairs_are_sums_of_the_field(pressing, impact):
    for run, pair, is_dynamic in ((*pressing[:2], False), (*impact, True)):
        upper, _, noise = sums(run, pair, is_dynamic)
        slave, master = series(run, "PAIRS", "CF"), series(run, "PAIRS", "CF_MASTER")
        total = slave[:, 0] + (master[:, 1] if slave.shape[1] > 1 else 0)
        assert (np.abs(total - upper) <= noise).all()
        assert (np.abs(slave + master) <= noise[:, None]).all()


def test_columns_of_the_pair_are_sums_of_the_field(impact):
    run, pair = impact
    upper, _, noise = sums(run, pair, True)
    table = run.file(".csv")
    assert (np.abs(columns(table, "pair1_force") - upper[:, :3]) <= noise).all()
    h = run.history["h"][:, None]
    impulse = columns(table, "pair1_impulse")
    np.testing.assert_allclose(impulse, np.cumsum(h*upper[:, :3], axis=0), atol=noise.max(), rtol=0)
    momentum = series(run, "BODIES", "MOMENTUM")[:, 0, :3]
    np.testing.assert_allclose(impulse, momentum - momentum[0], atol=noise.max(), rtol=0)
    centre = columns(table, "pair1_center")
    acts = np.abs(upper).max(axis=1) > 0
    assert (np.isnan(centre[:, 0]) == ~acts).all()
    assert 0 < run.history["pair1_duration"][-1] <= h.sum()
    # Where forces act lies in the box of what is in contact.
    fields = FieldsOf(run.file(".vtkhdf"))
    place = pair.x + fields.point["displacement"]
    for k in np.flatnonzero(acts):
        here = np.abs(fields.point["contact_force"][k]).max(axis=1) > 0
        size = np.ptp(place[k][here], axis=0).max()
        assert (centre[k] > place[k][here].min(axis=0) - 0.05*size).all()
        assert (centre[k] < place[k][here].max(axis=0) + 0.05*size).all()


def test_series_of_nodes_are_those_of_the_pairs(pressing):
    run, _, _ = pressing
    with h5py.File(run.file(".h5"), "r") as file:
        group = file["sets/CONTACT"]
        force, of_pair = group["CF"][:], group["CF_pair"][:]
        status = group["CSTR"][..., 1]
    total = series(run, "PAIRS", "CF")
    for k in range(total.shape[1]):
        np.testing.assert_allclose(force[:, of_pair == k + 1].sum(axis=1), total[:, k, :3],
                                   atol=1e-12, rtol=0)
    np.testing.assert_array_equal(status.sum(axis=1), run.history["active"])
    np.testing.assert_array_equal(series(run, "PAIRS", "CNUM").sum(axis=1), run.history["active"])


def area(corner):
    """Of a flat face, with or without nodes between its corners, which come first."""
    corner = corner[:len(corner)//2] if len(corner) > 4 else corner
    edges = corner[1:] - corner[0]
    return 0.5*np.linalg.norm(np.cross(edges[:-1], edges[1:]).sum(axis=0))


def test_area_in_contact(pressing):
    """Of one side all of the foot; where both are held each bears a part of it."""
    run, _, sides = pressing
    area = series(run, "PAIRS", "CONTACT_AREA")[-1]
    if sides:
        assert area == pytest.approx([1.0], rel=0.02)
    else:
        assert 0.98 <= area.sum() <= 2.02


def test_pressures_of_nodes(pressing):
    """Times the areas they are what presses; at corners, between them and at nodes alike, within
    what single nodes scatter by on unlike meshes."""
    run, pair, _ = pressing
    values, force = (series(run, "CONTACT", name)[-1] for name in ("CSTR", "CF"))
    with h5py.File(run.file(".h5"), "r") as file:
        node, of_pair = (file["sets/CONTACT"][f"CSTR_{name}"][:] for name in ("label", "pair"))
    faces = FieldsOf(run.file(".surfaces.vtkhdf"))
    of_faces, place = faces.point["node"][0].astype(int), faces.x + faces.point["displacement"][-1]
    for k in np.unique(of_pair):
        pressure = np.zeros(len(pair.x))
        pressure[node[of_pair == k] - 1] = values[of_pair == k, 0]
        pressed = sum(area(place[cell])*pressure[of_faces[cell]].mean() for cell, body in
                      zip(faces.cells, faces.cell["body"][0], strict=True) if body == k)
        assert pressed == pytest.approx(np.abs(force[of_pair == k].sum(axis=0)).max(), rel=0.05)
    if len(np.unique(of_pair)) == 1:
        assert np.median(values[:, 0]) == pytest.approx(PRESSURE, rel=0.1)


# ---- faces --------------------------------------------------------------------------------------


def test_faces_have_all_of_the_force(pressing, impact):
    for run, pair, is_dynamic in ((*pressing[:2], False), (*impact, True)):
        upper, lower, noise = sums(run, pair, is_dynamic)
        faces = FieldsOf(run.file(".surfaces.vtkhdf"))
        np.testing.assert_array_equal(faces.time, FieldsOf(run.file(".vtkhdf")).time)
        body = faces.cell["body"][0]
        force = faces.cell["contact_force"]
        assert (np.abs(force[:, body == 1].sum(axis=1) - upper[:, :3]) <= noise).all()
        assert (np.abs(force[:, body == 2].sum(axis=1) - lower[:, :3]) <= noise).all()


def test_faces_are_pressed_alike_on_both_sides(pressing):
    """Whichever side is held: patch tests of nodes that meet unlike meshes."""
    run, pair, sides = pressing
    faces = FieldsOf(run.file(".surfaces.vtkhdf"))
    pressure, force = faces.cell["contact_pressure"][-1], faces.cell["contact_force"][-1]
    scatter = 0.5 if sides else 0.15
    if not sides and {mesh.kind for mesh in pair.mesh} == {"C3D8"}:
        scatter = 1e-9
    assert pressure == pytest.approx(PRESSURE, rel=scatter)
    body = faces.cell["body"][-1]
    place = faces.x + faces.point["displacement"][-1]
    on = np.array([area(place[cell]) for cell in faces.cells])
    for k in (1, 2):
        assert (on*pressure)[body == k].sum() == pytest.approx(
            abs(force[body == k, 2].sum()), rel=1e-3)
    assert (faces.cell["contact_status"][-1] == 1).all()
    assert (faces.cell["contact_status"][0] == 0).all()
    assert np.isnan(faces.cell["contact_gap"][-1][body == 2]).all() == bool(sides)
    assert np.abs(faces.cell["contact_gap"][-1][body == 1]).max() < 0.01


def test_faces_are_cells_of_the_surfaces(pressing):
    run, pair, _ = pressing
    faces = FieldsOf(run.file(".surfaces.vtkhdf"))
    expected = [(3 if "4" in mesh.kind or "10" in mesh.kind else 4)*(1 + (mesh.step == 2))
                for mesh in pair.mesh]
    number = [len(list(pair.faces(k, k))) for k in (0, 1)]
    assert [len(cell) for cell in faces.cells] == [expected[0]]*number[0] + [expected[1]]*number[1]
    kinds = {3: 5, 4: 9, 6: 22, 8: 23}
    assert list(faces.types) == [kinds[len(cell)] for cell in faces.cells]
    node = faces.point["node"][0].astype(int)
    np.testing.assert_array_equal(faces.x, pair.x[node])
    np.testing.assert_array_equal(
        faces.point["displacement"], FieldsOf(run.file(".vtkhdf")).point["displacement"][:, node])
    assert set(faces.cell["surface"][0][:number[0]]) == {1}
    for cell in faces.cells:                       # corners first, seen from outside
        corner = faces.x[cell[:len(cell)//2 if len(cell) > 4 else len(cell)]]
        normal = np.cross(corner[1] - corner[0], corner[2] - corner[0])
        assert (normal[2] < 0) == (node[cell[0]] < pair.n_upper)
        if len(cell) > 4:
            middle = faces.x[cell[len(cell)//2:]]
            np.testing.assert_allclose(middle, 0.5*(corner + np.roll(corner, -1, axis=0)),
                                       atol=1e-14)


def test_vtk_reads_the_faces(impact):
    vtk_hdf = pytest.importorskip("vtkmodules.vtkIOHDF")
    run, _ = impact
    reader = vtk_hdf.vtkHDFReader()
    assert reader.CanReadFile(str(run.file(".surfaces.vtkhdf")))
    reader.SetFileName(str(run.file(".surfaces.vtkhdf")))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == len(run.history)
    reader.SetStep(8)
    reader.Update()
    grid = reader.GetOutputDataObject(0)
    assert grid.GetNumberOfCells() == 2*2 + 3*3
    for data, names in ((grid.GetPointData(), ["displacement", "contact_pressure", "contact_gap"]),
                        (grid.GetCellData(), ["contact_pressure", "contact_force", "surface"])):
        assert [name for name in names if data.GetArray(name) is None] == []


def test_the_file_goes_on_after_a_restart(impact, tmp_path):
    run, _ = impact
    for path in run.base.parent.iterdir():
        (tmp_path/path.name).write_bytes(path.read_bytes())
    deck = tmp_path/run.base.name
    done = emcon("restart", f"{deck}.rst.h5", "--quiet")
    assert done.returncode == 0, done.stderr
    again, whole = (FieldsOf(f"{base}.surfaces.vtkhdf") for base in (deck, run.base))
    for name, values in whole.cell.items():
        np.testing.assert_array_equal(again.cell[name], values)


def test_runs_without_fields_of_contact_have_no_such_file(tmp_path):
    pair = Pair(("C3D8", "C3D8"), (1, 1))
    text = pair.deck(pressed())
    run = run_deck(Deck(text, "faces"), tmp_path)
    assert run.file(".surfaces.vtkhdf").exists()
    run = run_deck(Deck(text.replace("*CONTACT FILE\nCDIS, CSTR, CF\n", ""), "faces"), tmp_path)
    assert not run.file(".surfaces.vtkhdf").exists()


def test_python_reads_the_pairs(impact):
    run, _ = impact
    pairs = read_pairs(locate(run.base))
    on_slave = np.concatenate([pairs.force, pairs.moment], axis=2)
    np.testing.assert_array_equal(on_slave, series(run, "PAIRS", "CF"))
    np.testing.assert_array_equal(pairs.length, series(run, "PAIRS", "CONTACT_AREA"))


# ---- pictures -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["contact_pressure", "contact_force", "contact_status",
                                  "contact_gap", "contact_active"])
def test_pictures_show_faces_of_contact(impact, name):
    """As the faces' file has them, nothing on all others; a field that it has not by the nodes."""
    run, pair = impact
    faces = FieldsOf(run.file(".surfaces.vtkhdf"))
    frame = int(np.argmax(np.abs(faces.cell["contact_force"]).sum(axis=(1, 2))))
    with FieldFile(run.file(".vtkhdf")) as file:
        scene = read_scene(file, [0, frame], name)
    assert len(scene.values[1]) == len(scene.cells) == 6*(2**2 + 3**2)
    shown = {tuple(sorted(cell.tolist())): value for cell, value in
             zip(scene.cells, scene.values[1], strict=True) if np.isfinite(value)}
    node = faces.point["node"][0].astype(int)
    on = {tuple(sorted(node[cell].tolist())): k for k, cell in enumerate(faces.cells)}
    assert shown and (name == "contact_active" or shown.keys() <= on.keys())
    if name == "contact_pressure":
        expected = faces.cell[name][frame]
        assert all(shown[key] == expected[k] for key, k in on.items() if key in shown)
        assert expected.max() == max(shown.values())
        assert not np.isfinite(scene.values[0]).any()
    if name == "contact_status":
        assert set(shown.values()) == {1.0} and scene.states[1] == "closed"


def test_animations_show_faces_of_contact(impact, tmp_path):
    run, _ = impact
    path = animate(run.base, tmp_path/"impact.gif", field="contact_pressure")
    assert path.stat().st_size > 1000


# ---- report -------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["C3D8", "C3D10"])
def test_the_report_tells_what_surfaces_consist_of(kind, tmp_path):
    """A whole cube over the top of another one."""
    pair = Pair((kind, "C3D8"), (2, 3), gap=0.25, size=(1.0, 1.5))
    deck = Deck(pair.deck(pressed(0.3)), "report")
    outline = [f"{e}, S{f}" for e, f in pair.mesh[0].outer_faces()]
    deck.card = [(head, outline if head == "*SURFACE, NAME=UPPER" else data)
                 for head, data in deck.card]
    deck.write(tmp_path/"report.inp")
    done = emcon("check", tmp_path/"report.inp", "--json")
    assert done.returncode == 0, done.stderr
    upper, lower = json.loads(done.stdout)["surfaces"]
    is_quadratic = pair.mesh[0].step == 2
    assert (upper["name"], lower["name"]) == ("UPPER", "LOWER")
    assert upper["faces"] == len(outline) == (48 if is_quadratic else 24)
    assert (upper["nodes"], upper["parts"]) == (98 if is_quadratic else 26, 1)
    assert upper["area"] == pytest.approx(6) and lower["area"] == pytest.approx(2.25)
    assert upper["shortest"] == pytest.approx((1/8 if is_quadratic else 1/4)**0.5)
    assert lower["shortest"] == lower["longest"] == pytest.approx(0.5)
    # Twelve edges of two cells, in quadratic elements each with a node between.
    assert upper["features"] == (48 if is_quadratic else 24)
    assert upper["sharpest_degrees"] == pytest.approx(90)
    assert upper["feature_angle"] == 20
    assert (upper["free_sides"], lower["features"], lower["free_sides"]) == (0, 0, 12)
    assert lower["sharpest_degrees"] == lower["deepest_degrees"] == 0


# ---- Python, and what output must not change ----------------------------------------------------


def test_python_reads_the_faces(impact):
    run, pair = impact
    with Results(f"{run.base}.surfaces.vtkhdf") as results:
        assert results.paths.base == run.base
        faces = results.surfaces
        node = faces.point("node", 0).astype(int)
        for k in (0, 5, -1):
            np.testing.assert_array_equal(
                faces.point("displacement", k), results.fields["displacement"][k][node])
            force = results.fields["contact_force"][k][pair.is_upper].sum(axis=0)
            upper = faces.cell("body", k) == 1
            np.testing.assert_allclose(faces.cell("contact_force", k)[upper].sum(axis=0), force,
                                       atol=1e-12)


def test_the_stepper_tells_what_pairs_transmit(impact):
    run, _ = impact
    pairs = read_pairs(locate(run.base))
    with Stepper(run.file(".inp")) as stepper:
        for k in range(12):
            for i, total in enumerate(stepper.pairs()):
                np.testing.assert_array_equal(total.slave[:3], pairs.force[k, i])
                np.testing.assert_array_equal(total.slave[3:], pairs.moment[k, i])
                np.testing.assert_array_equal(total.master[3:], pairs.master_moment[k, i])
                assert total.length == pairs.length[k, i] and total.active == pairs.active[k, i]
            np.testing.assert_array_equal(stepper.field("CF"),
                                          FieldsOf(run.file(".vtkhdf")).point["contact_force"][k])
            stepper.step()
    assert np.abs(pairs.force[:12]).max() > 0


def test_output_does_not_change_the_run(impact, tmp_path):
    run, pair = impact
    text = run.file(".inp").read_text()
    first, last = text.index("*NODE FILE"), text.index("*END STEP")
    for name, asked in (("nothing", "*NODE FILE, FREQUENCY=0\nU\n"),
                        ("all", "*OUTPUT, FIELD\n*CONTACT OUTPUT, VARIABLE=ALL\n")):
        other = run_deck(Deck(text[:first] + asked + text[last:], name), tmp_path)
        assert other.digits() == run.digits()


def test_a_surface_of_nodes_has_contact_and_no_faces(tmp_path):
    pair = Pair(("C3D8", "C3D8"), (2, 3))
    text = pair.deck(pressed(), ", SIDES=ONE, EDGES=NO")     # of edges CF has no forces
    nodes = "*SURFACE, NAME=FOOT, TYPE=NODE\nBASE_UPPER\n*SURFACE INTERACTION"
    text = text.replace("*SURFACE INTERACTION", nodes).replace("\nUPPER, LOWER\n", "\nFOOT, LOWER\n")
    run = run_deck(Deck(text, "nodes"), tmp_path)
    assert series(run, "PAIRS", "CNUM")[-1] == [9]
    upper, _, noise = sums(run, pair, False)
    assert (np.abs(series(run, "PAIRS", "CF")[:, 0] - upper) <= noise).all()
    assert upper[-1, 2] == pytest.approx(PRESSURE, rel=0.05)
    faces = FieldsOf(run.file(".surfaces.vtkhdf"))
    assert set(faces.cell["body"][0]) == {2} and len(faces.cells) == 9
    assert faces.cell["contact_force"][-1].sum(axis=0)[2] == pytest.approx(-upper[-1, 2])
