"""`emcon export`: files for ParaView before 5.12, in the eyes of vtk and of meshio."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from embed_tools import ROOT
from scene_tools import DECKS, Deck, run_deck
from test_python_results import CELLS, POINTS, TIMES, field_values, write_fields

sys.path[:0] = [str(ROOT/"pywrap"), str(ROOT/"tests"/"scenes")]

from contact_blocks import Pair, pressed  # noqa: E402

from emcon import ResultError, export  # noqa: E402
from emcon.__main__ import main  # noqa: E402


@pytest.fixture
def fields(tmp_path: Path) -> Path:
    """Base name of a result of nine frames: two bodies of a quadrilateral and of triangles."""
    write_fields(tmp_path/"box.v2.vtkhdf")
    return tmp_path/"box.v2"


def listed(path: Path) -> dict[float, Path]:
    """Times and files of a listing, in its order."""
    return {float(item.get("timestep", "")): path.parent/item.get("file", "")
            for item in ElementTree.parse(path).iter("DataSet")}


def test_meshio_reads_mesh_and_fields(fields: Path) -> None:
    assert export(fields) == [fields.with_name("box.v2.pvd")]
    files = listed(fields.with_name("box.v2.pvd"))
    assert list(files) == list(TIMES)
    for time, path in files.items():
        mesh = meshio.read(path)
        np.testing.assert_array_equal(mesh.points, POINTS)
        assert [cell.tolist() for block in mesh.cells for cell in block.data] == [
            list(cell) for cell in CELLS]
        np.testing.assert_array_equal(np.concatenate(mesh.cell_data["strain_energy"]), np.arange(3))
        for name, values in mesh.point_data.items():
            np.testing.assert_array_equal(values, field_values(name, time))


def test_frames_and_fields_are_chosen(fields: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Frames of an earlier call do not stay behind, other files of the folder do."""
    target = fields.with_name("some.pvd")
    export(fields, target)
    (target.with_suffix(".frames")/"notes.txt").write_text("mine")
    assert main(["export", f"{fields}.vtkhdf", "--output", str(target), "--frames", "-3", "-2",
                 "--fields", "displacement"]) == 0
    assert capsys.readouterr().out == f"to open: {target}\n"
    files = listed(target)
    assert list(files) == list(TIMES[-3:-1])
    assert sorted(path.name for path in target.with_suffix(".frames").iterdir()) == sorted(
        ["notes.txt", *(path.name for path in files.values())])
    mesh = meshio.read(list(files.values())[0])
    assert list(mesh.point_data) == ["displacement"] and not mesh.cell_data


@pytest.mark.parametrize(("arguments", "message", "code"), [
    (["--output", "box.vtu"], "box.vtu: the file that lists the frames is to be named NAME.pvd", 2),
    (["--output", "nowhere/box.pvd"], "cannot write nowhere/box.frames: No such file", 4),
    (["--fields", "heat"], "has no field heat; it has ", 2),
    (["--frames", "0", "9"], "there is no frame 9; the file has 9, from 0 on", 2),
    (["--frames", "3", "1"], "frames go from one to a later one, not from 3 to 1", 2)])
def test_what_cannot_be_written_is_told(fields: Path, arguments: list[str], message: str, code: int,
                                        monkeypatch: pytest.MonkeyPatch,
                                        capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(fields.parent)
    assert main(["export", fields.name, *arguments]) == code
    out, err = capsys.readouterr()
    assert out == "" and message in err
    assert [path.name for path in fields.parent.iterdir()] == ["box.v2.vtkhdf"]


@pytest.mark.parametrize("name", ["box.v2.surfaces", "box.v2.surfaces.vtkhdf", "box.v2.surfaces.pvd", "box.v2.pvd"])
def test_any_file_of_a_run_names_it(fields: Path, name: str) -> None:
    write_fields(fields.with_name("box.v2.surfaces.vtkhdf"))
    both = [fields.with_name("box.v2.pvd"), fields.with_name("box.v2.surfaces.pvd")]
    assert export(fields.with_name(name)) == both
    assert [len(listed(path)) for path in both] == [len(TIMES)]*2


def test_a_result_without_fields(fields: Path) -> None:
    fields.with_name("box.v2.vtkhdf").rename(fields.with_name("box.v2.csv"))
    with pytest.raises(ResultError, match="no file .*box.v2.vtkhdf"):
        export(fields)


# --- beside vtk's reader of VTKHDF -------------------------------------------------------------

def parts(grid: Any) -> dict[str, np.ndarray]:
    """All that a grid of vtk holds, by names."""
    numpy = pytest.importorskip("vtkmodules.util.numpy_support").vtk_to_numpy
    cells = grid.GetCells()
    found = {"points": numpy(grid.GetPoints().GetData()),
             "connectivity": numpy(cells.GetConnectivityArray()),
             "offsets": numpy(cells.GetOffsetsArray()),
             "types": [grid.GetCellType(k) for k in range(grid.GetNumberOfCells())]}
    for where, data in (("point", grid.GetPointData()), ("cell", grid.GetCellData())):
        for k in range(data.GetNumberOfArrays()):
            array = data.GetArray(k)
            if array.GetName() != "vtkGhostType":
                found[f"{where} {array.GetName()}"] = numpy(array)
    return {name: np.asarray(values, dtype=float) for name, values in found.items()}


def grids(source: Path) -> Iterator[tuple[float, dict[str, np.ndarray]]]:
    """Times and frames of a field file, by vtk."""
    reader = pytest.importorskip("vtkmodules.vtkIOHDF").vtkHDFReader()
    reader.SetFileName(str(source))
    reader.UpdateInformation()
    for k in range(reader.GetNumberOfSteps()):
        reader.SetStep(k)
        reader.Update()
        yield reader.GetTimeValue(), parts(reader.GetOutputDataObject(0))


#: A profile, whose lines are cells behind the elements; a wall, whose faces are in the file of
#: surfaces; quadratic elements, whose faces are there, too.
SCENES: dict[str, tuple[Any, dict[str, float]]] = {
    "profile": (DECKS/"rigid_bar.inp", {"t_end": 3e-6}),
    "wall": (DECKS/"ball_in_bowl.inp", {"t_end": 0.02}),
    "quadratic": (Deck(Pair(("C3D20", "C3D10"), (1, 1)).deck(pressed())), {})}


@pytest.mark.parametrize("scene", SCENES)
def test_vtk_reads_the_same_from_both_files(scene: str, tmp_path: Path) -> None:
    reader = pytest.importorskip("vtkmodules.vtkIOXML").vtkXMLUnstructuredGridReader()
    deck, settings = SCENES[scene]
    run = run_deck(deck, tmp_path, **settings)
    written = export(run.base)
    sources = [path for path in (run.file(".vtkhdf"), run.file(".surfaces.vtkhdf"))
               if path.is_file()]
    assert written == [path.with_suffix(".pvd") for path in sources]
    for source, listing in zip(sources, written):
        files = listed(listing)
        for (time, expected), (at, path) in zip(grids(source), files.items(), strict=True):
            reader.SetFileName(str(path))
            reader.Update()
            found = parts(reader.GetOutputDataObject(0))
            assert time == at and set(found) == set(expected)
            for name, values in expected.items():
                np.testing.assert_array_equal(found[name], values, err_msg=name)
