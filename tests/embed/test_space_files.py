"""A run in space with contact and friction is drawn, animated, and opened by vtk's own readers.

Readers are those of this Python and of all that `EMCON_TEST_VTK` names (paths of Pythons with vtk and
numpy, between colons): other versions of vtk read other layouts of VTKHDF.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from embed_tools import HERE, ROOT
from PIL import Image
from vtk_reads import digest

sys.path.insert(0, str(ROOT/"pywrap"))

from emcon import Model, Results, animate, export, plot  # noqa: E402
from emcon.mesh import block  # noqa: E402

PYTHONS = [sys.executable]*(importlib.util.find_spec("vtkmodules") is not None) + [
    path for path in os.environ.get("EMCON_TEST_VTK", "").split(os.pathsep) if path]
FACES = ("contact_pressure", "contact_gap", "contact_status", "contact_force", "contact_shear", "contact_slip")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Base name: a cube is thrown aslant onto a slab, rubs on it, and sticks at some of its nodes."""
    mesh = (block((-1.0, -0.75, -0.5), (2.0, 1.5, 0.5), (4, 3, 1), "SLAB", kind="C3D8")
            + block((-0.6, -0.4, 0.02), (0.8, 0.8, 0.8), (2, 2, 2), "CUBE", kind="C3D8"))
    model = Model.from_mesh(mesh, "A cube rubs on a slab")
    model.material("RUBBER", density=1.0, coupled_neo_hooke=(100.0, 0.3))
    model.section("RUBBER", "SLAB").section("RUBBER", "CUBE")
    model.interaction("DRY", friction=0.3)
    model.contact_pair("CUBE_BACK", "SLAB_FRONT", interaction="DRY", type="MORTAR")
    model.boundary("SLAB_BACK").initial("VELOCITY", "CUBE", (1, 3), (2.0, -2.0))
    step = model.step("DYNAMIC", 0.01, 0.1, direct=True, nlgeom=True)
    step.output("NODE FILE", ("U", "V")).output("EL FILE", "S")
    step.output("CONTACT FILE", ("CSTR", "CDIS", "CF", "CSHEAR", "CSLIP"))
    base = tmp_path_factory.mktemp("space")/"cube"
    with model.stepper() as stepper:
        stepper.run(output=base)
    return base


def test_the_scene_has_what_is_to_be_seen(run: Path) -> None:
    """Open faces, faces that slide and, as the cube stops, faces that stick; friction takes energy."""
    with Results(run) as found:
        status = np.concatenate([found.surfaces.cell("contact_status", k) for k in range(len(found.surfaces.times))])
        assert set(np.unique(status)) == {0, 1, 2}
        assert found.history["friction_loss"][-1] > 0.01*found.history["total"][0]
    assert json.loads(run.with_suffix(".json").read_text())["verdict"] == "good"


def coloured(picture: Image.Image) -> int:
    """Points of a picture that are neither white nor grey."""
    rgb = np.asarray(picture.convert("RGB"), dtype=int)
    return int((np.ptp(rgb, axis=2) > 60).sum())


@pytest.mark.parametrize("field", ["von_mises", "contact_pressure", "contact_status", "contact_shear"])
def test_it_is_drawn(field: str, run: Path, tmp_path: Path) -> None:
    figure = plot(run, tmp_path/"cube.png", field=field)
    words = [text.get_text() for axes in figure.axes if axes.get_legend()
             for text in axes.get_legend().get_texts()]
    assert "losses" in words
    with Image.open(tmp_path/"cube.png") as picture:
        assert min(picture.size) > 400 and coloured(picture) > 1000


@pytest.mark.parametrize("field", ["von_mises", "contact_pressure"])
def test_it_is_animated(field: str, run: Path, tmp_path: Path) -> None:
    with Results(run) as found:
        n_frame = len(found.fields.times)
    with Image.open(animate(run, tmp_path/"cube.gif", field=field)) as film:
        assert film.n_frames == n_frame
        film.seek(n_frame - 1)
        assert coloured(film) > 500


def written(run: Path) -> list[list[list[Any]]]:
    """Times and digests of all fields and of the points, of both files, read by h5py."""
    files = []
    with Results(run) as found:
        for source in (found.fields, found.surfaces):
            frames = []
            for k, time in enumerate(source.times):
                arrays = {"points": source.points}
                arrays |= {f"point {name}": source.point(name, k) for name in source.point_fields}
                arrays |= {f"cell {name}": source.cell(name, k) for name in source.cell_fields}
                frames.append([time, {name: digest(values) for name, values in arrays.items()}])
            files.append(frames)
    return files


@pytest.mark.skipif(not PYTHONS, reason="no Python with vtk")
@pytest.mark.parametrize("python", PYTHONS)
def test_vtk_opens_all_files(python: str, run: Path) -> None:
    """NAME.vtkhdf, NAME.surfaces.vtkhdf and the files of `emcon export` have the same numbers, in vtk's eyes
    and in those of h5py."""
    expected = written(run)
    assert {f"cell {name}" for name in FACES} <= set(expected[1][-1][1])
    names = [run.with_suffix(".vtkhdf"), run.with_suffix(".surfaces.vtkhdf"), *export(run)]
    assert [name.suffix for name in names] == [".vtkhdf"]*2 + [".pvd"]*2
    done = subprocess.run([python, HERE/"vtk_reads.py", *names], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    for k, frames in enumerate(json.loads(done.stdout)["files"]):
        for (time, arrays), (at, found) in zip(expected[k % 2], frames, strict=True):
            assert time == at
            assert {name: found[name] for name in arrays} == arrays
