"""The field file in the eyes of vtk's own reader, and what the contact fields mean."""

import numpy as np
import pytest
from scene_tools import DECKS, EPSILON, run_deck

vtk_hdf = pytest.importorskip("vtkmodules.vtkIOHDF")
numpy_support = pytest.importorskip("vtkmodules.util.numpy_support")

N_COMPONENT = {
    "displacement": 3,
    "velocity": 3,
    "reaction_force": 3,
    "cauchy_stress": 6,
    "von_mises": 1,
    "contact_gap": 1,
    "contact_pressure": 1,
    "contact_active": 1,
    "contact_force": 3,
}


def frames(path):
    """Times and grids of all frames."""
    reader = vtk_hdf.vtkHDFReader()
    assert reader.CanReadFile(str(path))
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    for k in range(reader.GetNumberOfSteps()):
        reader.SetStep(k)
        reader.Update()
        yield reader.GetTimeValue(), reader.GetOutputDataObject(0)


def point_array(grid, name):
    return numpy_support.vtk_to_numpy(grid.GetPointData().GetArray(name))


def test_reader_finds_all_frames_and_fields(ring):
    run = ring("PERSISTENT", 0.05)
    fields = run.fields()
    times = []
    for k, (time, grid) in enumerate(frames(run.file(".vtkhdf"))):
        times.append(time)
        assert (grid.GetNumberOfPoints(), grid.GetNumberOfCells()) == (686, 556)
        for name, n in N_COMPONENT.items():
            array = grid.GetPointData().GetArray(name)
            assert array is not None, name
            assert array.GetNumberOfComponents() == n
        u = point_array(grid, "displacement")
        np.testing.assert_array_equal(u[:, :2], fields["displacement"][k])
        assert not u[:, 2].any()
        assert grid.GetCellData().GetArray("strain_energy").GetNumberOfTuples() == 556
        assert grid.GetCell(0).GetCellType() == 9
    np.testing.assert_array_equal(times, fields.time)
    np.testing.assert_allclose(times, np.arange(81)*0.1, atol=1e-9)


def test_bodies_are_cell_data_of_every_frame(ring):
    """By geometry: the ring is what has its middle above the foundation at the start."""
    run = ring("PERSISTENT", 0.05)
    expected = None
    for _, grid in frames(run.file(".vtkhdf")):
        body = numpy_support.vtk_to_numpy(grid.GetCellData().GetArray("body"))
        if expected is None:
            low = [grid.GetCell(k).GetBounds()[2] for k in range(grid.GetNumberOfCells())]
            expected = np.where(np.array(low) >= 0.0, 1.0, 2.0)
        np.testing.assert_array_equal(body, expected)


def test_strain_energy_of_the_cells_is_that_of_the_history(ring):
    run = ring("PERSISTENT", 0.05)
    strain = {round(t, 6): e for t, e in zip(run.history["time"], run.history["strain"])}
    scale = max(strain.values())
    for time, grid in frames(run.file(".vtkhdf")):
        cells = numpy_support.vtk_to_numpy(grid.GetCellData().GetArray("strain_energy"))
        assert cells.sum() == pytest.approx(strain[round(time, 6)], abs=556*EPSILON*scale)


def test_pressure_times_area_is_contact_force(ring):
    """Area: half of the two deformed edges at the node, thickness 1.

    The force acts along the discrete gradient of the gap, at mid-step, the area is of the end of
    the step: they differ by the turn of the surface within a step.
    """
    run = ring("PERSISTENT", 0.01)
    outer = np.arange(64)*5
    n_touching = 0
    for _, grid in frames(run.file(".vtkhdf")):
        x = numpy_support.vtk_to_numpy(grid.GetPoints().GetData())[outer, :2]
        x = x + point_array(grid, "displacement")[outer, :2]
        edge = np.linalg.norm(np.roll(x, -1, axis=0) - x, axis=1)
        area = 0.5*(edge + np.roll(edge, 1))
        pressure = point_array(grid, "contact_pressure")
        force = point_array(grid, "contact_force")
        active = point_array(grid, "contact_active")
        assert not np.delete(pressure, outer).any()
        assert not np.delete(active, outer).any()
        assert set(np.unique(active)) <= {0.0, 1.0}
        assert not pressure[active == 0].any()
        if not active.any():
            assert not force.any()
            continue
        n_touching += 1
        assert (pressure[active == 1] >= 0).all()
        length = np.linalg.norm(force[outer], axis=1)
        np.testing.assert_allclose(pressure[outer]*area, length, rtol=1e-3, atol=0)
        # Upwards on the ring, the opposite on the foundation.
        assert (force[outer, 1] >= 0).all()
        assert (pressure[outer] @ area) == pytest.approx(force[outer, 1].sum(), rel=1e-3)
    assert n_touching > 10


def test_gap_is_measured_near_the_surface_only(ring):
    fields = ring("PERSISTENT", 0.01).fields()
    gap = fields["contact_gap"]
    outer = np.arange(64)*5
    others = np.setdiff1d(np.arange(gap.shape[1]), outer)
    assert np.isnan(gap[:, others]).all()
    # At the start: the height of the node over the flat top.
    first = gap[0, outer]
    near = ~np.isnan(first)
    assert near[0] and not near[32]
    np.testing.assert_allclose(first[near], fields.x[outer[near], 1], rtol=0, atol=1e-13)


@pytest.mark.parametrize("name", ["cantilever", "patch_pressure", "bouncing_bar"])
def test_other_decks_can_be_read(tmp_path, name):
    run = run_deck(DECKS / f"{name}.inp", tmp_path)
    seen = [grid.GetNumberOfPoints() for _, grid in frames(run.file(".vtkhdf"))]
    assert len(seen) == len(run.fields().time) >= 2
    assert set(seen) == {len(run.fields().x)}
