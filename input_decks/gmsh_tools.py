"""Shared by the scenes that are drawn in Gmsh: names, mesh, pictures by pyvista."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import gmsh

#: Is a curve with the box (x0, y0, x1, y1) part of a side?
Belongs = Callable[[float, float, float, float], bool]


def name(body: tuple[int, int], text: str, sides: dict[str, Belongs]) -> None:
    """Physical groups of a surface and of the curves around it: names in the model."""
    gmsh.model.addPhysicalGroup(2, [body[1]], name=text)
    for side, belongs in sides.items():
        curves = []
        for _, tag in gmsh.model.getBoundary([body], oriented=False):
            x0, y0, _, x1, y1, _ = gmsh.model.getBoundingBox(1, tag)
            if belongs(x0, y0, x1, y1):
                curves.append(tag)
        gmsh.model.addPhysicalGroup(1, curves, name=side)


def divide(size: float, group: str) -> None:
    """Edges of about this size on the curves of a group; on each a multiple of four, for symmetry."""
    (tag,) = [tag for dim, tag in gmsh.model.getPhysicalGroups(1)
              if gmsh.model.getPhysicalName(dim, tag) == group]
    for curve in gmsh.model.getEntitiesForPhysicalGroup(1, tag):
        edges = 4*max(1, round(gmsh.model.occ.getMass(1, curve)/size/4))
        gmsh.model.mesh.setTransfiniteCurve(curve, edges + 1)


def write(path: Path, size: float) -> None:
    """Quadrilaterals of about a size [L] into a file."""
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.option.setNumber("Mesh.RecombineAll", 1)
    gmsh.option.setNumber("Mesh.Algorithm", 8)
    gmsh.model.mesh.generate(2)
    gmsh.write(str(path))
    gmsh.finalize()


def begin() -> None:
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 2)


def picture(base: Path, frames: Sequence[int], titles: Sequence[str], *,
            view: tuple[float, float, float], top: float, unit: str = "MPa",
            parts: bool = False) -> Path:
    """Frames of BASE.vtkhdf side by side, deformed and coloured by the von Mises stress.

    view    x and y of the middle, half of the height
    top     stress at the dark end of the colour scale
    parts   the first frame shows which body is which
    """
    import pyvista

    pyvista.vtk_verbosity("off")        # it warns where there is no screen, which it does not need
    reader = pyvista.get_reader(f"{base}.vtkhdf").reader
    plotter = pyvista.Plotter(shape=(1, len(frames)), off_screen=True, border=False,
                              window_size=(700*len(frames), 700))
    bar = {"title": f"von Mises [{unit}]\n", "color": "black", "vertical": True, "n_labels": 3,
           "fmt": "%.3g", "position_x": 0.84, "position_y": 0.68, "height": 0.25}
    for column, (frame, title) in enumerate(zip(frames, titles, strict=True)):
        reader.SetStep(frame)
        reader.Update()
        grid = pyvista.wrap(reader.GetOutput()).copy().warp_by_vector("displacement")
        plotter.subplot(0, column)
        shown: dict[str, object] = {"scalars": "von_mises", "clim": (0.0, top), "cmap": "magma_r",
                                    "show_scalar_bar": column == len(frames) - 1,
                                    "scalar_bar_args": bar}
        if parts and column == 0:
            shown = {"scalars": "body", "cmap": "Pastel1", "clim": (1, 9),
                     "show_scalar_bar": False}
        plotter.add_mesh(grid, lighting=False, show_edges=True, edge_opacity=0.3, **shown)
        plotter.add_text(title, font_size=14, color="black", position="upper_edge")
        plotter.camera_position = "xy"
        plotter.camera.focal_point = (view[0], view[1], 0.0)
        plotter.camera.parallel_projection = True
        plotter.camera.parallel_scale = view[2]
    plotter.set_background("white")
    plotter.screenshot(f"{base}.png")
    return base.with_suffix(".png")
