"""From Gmsh to ParaView: a block falls onto a rubber arch. `python gmsh_bumper.py [FOLDER]`

    pip install gmsh 'emcon[mesh]' pyvista

Gmsh draws the two bodies, emcon runs them, pyvista makes the picture of what ParaView would show.
Units: mm, t, s, so that forces are in N and energies in mJ (docs/gmsh.md).
"""

from __future__ import annotations

import sys
from pathlib import Path

import gmsh
import gmsh_tools
import numpy as np

import emcon.mesh

#: Radii of the arch and size of its elements, half the width and the height of the block [mm].
OUTER, INNER, SIZE = 20.0, 14.0, 1.5
HALF, HEIGHT, GAP = 15.0, 20.0, 0.5


def draw(path: Path) -> None:
    """The mesh. A physical group gives a body or a side its name in the model."""
    gmsh_tools.begin()
    shapes = gmsh.model.occ
    ring, _ = shapes.cut([(2, shapes.addDisk(0, 0, 0, OUTER, OUTER))],
                         [(2, shapes.addDisk(0, 0, 0, INNER, INNER))])
    (arch,), _ = shapes.cut(ring, [(2, shapes.addRectangle(-OUTER, -OUTER, 0, 2*OUTER, OUTER))])
    block = (2, shapes.addRectangle(-HALF, OUTER + GAP, 0, 2*HALF, HEIGHT))
    shapes.synchronize()
    near = 1e-3
    gmsh_tools.name(arch, "ARCH", {"ARCH_OUTER": lambda x0, y0, x1, y1: x1 - x0 > 2*OUTER - near,
                                   "FEET": lambda x0, y0, x1, y1: y1 < near})
    gmsh_tools.name(block, "BLOCK",
                    {"BLOCK_BOTTOM": lambda x0, y0, x1, y1: y1 < OUTER + GAP + near})
    gmsh_tools.write(path, SIZE)


def scene(mesh: emcon.mesh.Mesh) -> emcon.Model:
    """A rubber arch with fixed feet, and a block with the density of steel, at 2.5 m/s."""
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
    """Von Mises stress at the start, and when the arch is lowest."""
    with emcon.Results(base) as results:
        times = results.fields.times
        top = results.fields["displacement"][:, mesh.rows(mesh.node_sets["BLOCK_BOTTOM"])[0], 1]
    frames = [0, int(np.argmin(top))]
    titles = [f"t = {1e3*times[frame]:.1f} ms" for frame in frames]
    return gmsh_tools.picture(base, frames, titles, view=(0.0, 20.0, 27.0), top=1.0)


def main(folder: str = ".") -> None:
    base = Path(folder)/"gmsh_bumper"
    base.parent.mkdir(parents=True, exist_ok=True)
    draw(base.with_suffix(".msh"))
    mesh = emcon.mesh.read(base.with_suffix(".msh"))
    with emcon.Stepper(scene(mesh)) as bumper:
        start = bumper.energies()["total"]
        bumper.run(output=base, progress=sys.stderr.isatty())
        print(f"{bumper.n_element} elements, energy at the end divided by that at the start: 1"
              f"{bumper.energies()['total']/start - 1:+.0e}")
        print("verdict:", bumper.verdict()["verdict"])
        block = min(bumper.bodies(), key=lambda body: -body.mass)
        print(f"the block leaves with {1e-3*block.velocity[1]:.2f} m/s")
    print("picture:", picture(base, mesh))


if __name__ == "__main__":
    main(*sys.argv[1:])
