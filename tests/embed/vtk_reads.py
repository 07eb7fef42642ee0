"""What vtk's own readers find in files of fields: `PYTHON vtk_reads.py FILE...` prints JSON.

A list for each file, NAME.vtkhdf or NAME.pvd: of each frame its time and, by names, the shape of each
array and a digest of its numbers. It needs vtk and numpy only, so that any Python that has them can
run it; `digest` needs no vtk.
"""

import hashlib
import json
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np


def digest(values):
    """Shape, and what differs if any number does; NaN is one number here."""
    array = np.array(values, dtype="<f8")
    array[np.isnan(array)] = np.nan
    return [list(array.shape), hashlib.sha256((array + 0.0).tobytes()).hexdigest()]


def arrays(grid):
    """All that a grid holds, by names."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    cells = grid.GetCells()
    found = {"points": grid.GetPoints().GetData(), "connectivity": cells.GetConnectivityArray(),
             "offsets": cells.GetOffsetsArray()}
    for where, data in (("point", grid.GetPointData()), ("cell", grid.GetCellData())):
        for k in range(data.GetNumberOfArrays()):
            found[f"{where} {data.GetArrayName(k)}"] = data.GetArray(k)
    return {name: digest(vtk_to_numpy(array)) for name, array in found.items()
            if name != "cell vtkGhostType"}


def frames(path):
    """Time and grid of each frame of a file."""
    if path.suffix == ".vtkhdf":
        from vtkmodules.vtkIOHDF import vtkHDFReader

        reader = vtkHDFReader()
        reader.SetFileName(str(path))
        reader.UpdateInformation()
        for k in range(reader.GetNumberOfSteps()):
            reader.SetStep(k)
            reader.Update()
            yield reader.GetTimeValue(), reader.GetOutputDataObject(0)
        return
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    for item in ElementTree.parse(path).iter("DataSet"):
        reader = vtkXMLUnstructuredGridReader()
        reader.SetFileName(str(path.parent/item.get("file")))
        reader.Update()
        yield float(item.get("timestep")), reader.GetOutputDataObject(0)


if __name__ == "__main__":
    from vtkmodules.vtkCommonCore import vtkVersion

    found = [[[time, arrays(grid)] for time, grid in frames(Path(name))] for name in sys.argv[1:]]
    print(json.dumps({"version": vtkVersion.GetVTKVersion(), "files": found}))
