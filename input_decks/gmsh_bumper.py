"""From Gmsh to ParaView: a block falls onto a rubber arch. `python gmsh_bumper.py [FOLDER]`

    pip install gmsh 'emcon[mesh]' pyvista

Gmsh draws the two bodies, emcon runs them, pyvista makes the picture of what ParaView would show.
Units: mm, t, s, so that forces are in N and energies in mJ (docs/gmsh.md).
"""

from __future__ import annotations

import sys
from pathlib import Path

import gmsh

import emcon.mesh

#: Radii of the arch and size of its elements, half the width and the height of the block [mm].
OUTER, INNER, SIZE = 20.0, 14.0, 1.5
HALF, HEIGHT, GAP = 15.0, 20.0, 0.5


def draw(path: Path) -> None:
    """The mesh: what is to have a name in the deck is a physical group."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 2)
    shapes = gmsh.model.occ
    ring, _ = shapes.cut([(2, shapes.addDisk(0, 0, 0, OUTER, OUTER))],
                         [(2, shapes.addDisk(0, 0, 0, INNER, INNER))])
    (arch,), _ = shapes.cut(ring, [(2, shapes.addRectangle(-OUTER, -OUTER, 0, 2*OUTER, OUTER))])
    block = (2, shapes.addRectangle(-HALF, OUTER + GAP, 0, 2*HALF, HEIGHT))
    shapes.synchronize()

    def name(body: tuple[int, int], sides: dict[str, object], text: str) -> None:
        gmsh.model.addPhysicalGroup(2, [body[1]], name=text)
        for side, belongs in sides.items():
            curves = [tag for _, tag in gmsh.model.getBoundary([body], oriented=False)
                      if belongs(*gmsh.model.getBoundingBox(1, tag))]
            gmsh.model.addPhysicalGroup(1, curves, name=side)

    near = 1e-3
    name(arch, {"ARCH_OUTER": lambda x0, y0, _0, x1, y1, _1: x1 - x0 > 2*OUTER - near,
                "FEET": lambda x0, y0, _0, x1, y1, _1: y1 < near}, "ARCH")
    name(block, {"BLOCK_BOTTOM": lambda x0, y0, _0, x1, y1, _1: y1 < OUTER + GAP + near}, "BLOCK")
    gmsh.option.setNumber("Mesh.MeshSizeMax", SIZE)
    gmsh.option.setNumber("Mesh.RecombineAll", 1)
    gmsh.option.setNumber("Mesh.Algorithm", 8)
    gmsh.model.mesh.generate(2)
    gmsh.write(str(path))
    gmsh.finalize()


def scene(mesh: emcon.mesh.Mesh) -> emcon.Model:
    """Rubber on steel feet, and a block that weighs as steel, at 2.5 m/s."""
    model = emcon.Model.from_mesh(mesh, "A block falls onto a rubber arch")
    model.material("RUBBER", density=1.1e-9, coupled_neo_hooke=(3.0, 0.4))
    model.material("BLOCK", density=7.8e-9, coupled_neo_hooke=(200.0, 0.3))
    model.section("RUBBER", "ARCH").section("BLOCK", "BLOCK")
    model.contact_pair("ARCH_OUTER", "BLOCK_BOTTOM", type="MORTAR")
    model.boundary("FEET")
    model.initial("VELOCITY", "BLOCK", (1, 2), (0.0, -2500.0))
    model.step("DYNAMIC", 2e-4, 0.016, direct=True, nlgeom=True)
    return model


def picture(base: Path, mesh: emcon.mesh.Mesh) -> Path:
    """Von Mises stress where the arch is lowest, beside the start."""
    import numpy as np
    import pyvista

    with emcon.Results(base) as results:
        times = results.fields.times
        top = results.fields["displacement"][:, mesh.rows(mesh.node_sets["BLOCK_BOTTOM"])[0], 1]
    reader = pyvista.get_reader(f"{base}.vtkhdf").reader
    plotter = pyvista.Plotter(shape=(1, 2), off_screen=True, window_size=(1400, 700), border=False)
    for column, frame in enumerate((0, int(np.argmin(top)))):
        reader.SetStep(frame)
        reader.Update()
        grid = pyvista.wrap(reader.GetOutput()).copy()
        plotter.subplot(0, column)
        plotter.add_mesh(grid.warp_by_vector("displacement"), scalars="von_mises", clim=(0.0, 1.0),
                         cmap="magma_r", lighting=False, show_edges=True, edge_opacity=0.3,
                         show_scalar_bar=column == 1, scalar_bar_args={
                             "title": "von Mises [MPa]", "color": "black", "vertical": True,
                             "n_labels": 3, "fmt": "%.1f", "position_x": 0.84, "position_y": 0.6,
                             "height": 0.3})
        plotter.add_text(f"t = {1e3*times[frame]:.1f} ms", font_size=14, color="black",
                         position="upper_edge")
        plotter.camera_position = "xy"
        plotter.camera.focal_point = (0.0, 20.0, 0.0)
        plotter.camera.parallel_projection = True
        plotter.camera.parallel_scale = 27.0
    plotter.set_background("white")
    plotter.screenshot(f"{base}.png")
    return base.with_suffix(".png")


def main(folder: str = ".") -> None:
    base = Path(folder)/"gmsh_bumper"
    base.parent.mkdir(parents=True, exist_ok=True)
    draw(base.with_suffix(".msh"))
    mesh = emcon.mesh.read(base.with_suffix(".msh"))
    with emcon.Stepper(scene(mesh)) as bumper:
        start = bumper.energies()["total"]
        bumper.run(output=base, progress=sys.stderr.isatty())
        print(f"{bumper.n_element} elements, energy at the end over that at the start: 1"
              f"{bumper.energies()['total']/start - 1:+.0e}")
        print("verdict:", bumper.verdict()["verdict"])
        block = min(bumper.bodies(), key=lambda body: -body.mass)
        print(f"the block leaves with {1e-3*block.velocity[1]:.2f} m/s")
    print("picture:", picture(base, mesh))


if __name__ == "__main__":
    main(*sys.argv[1:])
