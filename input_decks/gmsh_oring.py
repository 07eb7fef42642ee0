"""From Gmsh to ParaView: an O-ring is pressed into its groove. `python gmsh_oring.py [FOLDER]`

    pip install gmsh 'emcon[mesh]' pyvista

The section of a rubber ring, 3.5 mm thick, lies in a groove of steel. Bolts pull a lid down by 0.8 mm.
Static, without friction. Units: mm, t, s, so that stresses are in MPa, and forces in N per millimetre
of seal.
"""

from __future__ import annotations

import sys
from pathlib import Path

import gmsh
import gmsh_tools
import numpy as np

import emcon.mesh

#: Radius of the section, half the width and the depth of the groove, travel of the lid [mm].
RADIUS, HALF, DEPTH, WAY = 1.75, 2.05, 2.6, 0.8
#: Overlap of the ring with groove and lid at the start, so that contact holds it [mm].
START = 0.02
#: Where the lid is at the start [mm].
LOW = 2*(RADIUS - START)
#: Wall of the groove, size of elements in rubber and in steel [mm].
WALL, FINE, COARSE = 1.2, 0.16, 0.3


def draw(path: Path) -> None:
    gmsh_tools.begin()
    shapes = gmsh.model.occ
    ring = (2, shapes.addDisk(0, RADIUS - START, 0, RADIUS, RADIUS))
    outer = (2, shapes.addRectangle(-HALF - WALL, -WALL, 0, 2*(HALF + WALL), WALL + DEPTH))
    hollow = (2, shapes.addRectangle(-HALF, 0, 0, 2*HALF, DEPTH + 1, 0, 0.3))
    (groove,), _ = shapes.cut([outer], [hollow])
    lid = (2, shapes.addRectangle(-HALF + 0.05, LOW, 0, 2*HALF - 0.1, WALL))
    shapes.synchronize()
    near = 1e-3
    gmsh_tools.name(ring, "RING", {"RING_OUTER": lambda x0, y0, x1, y1: True})
    gmsh_tools.name(groove, "GROOVE", {
        "GROOVE_INNER": lambda x0, y0, x1, y1: x0 > -HALF - near and x1 < HALF + near
        and y0 > -near and not (y0 > DEPTH - near),
        "GROOVE_FOOT": lambda x0, y0, x1, y1: y1 < -WALL + near})
    gmsh_tools.name(lid, "LID", {
        "LID_BOTTOM": lambda x0, y0, x1, y1: y1 < LOW + near,
        "LID_TOP": lambda x0, y0, x1, y1: y0 > LOW + WALL - near})
    gmsh_tools.divide(FINE, "RING_OUTER")
    gmsh_tools.write(path, COARSE)


def scene(mesh: emcon.mesh.Mesh) -> emcon.Model:
    """Rubber between parts of steel, one held, one driven."""
    model = emcon.Model.from_mesh(mesh, "An O-ring is pressed into its groove")
    model.material("RUBBER", coupled_neo_hooke=(6.0, 0.4))
    model.material("STEEL", coupled_neo_hooke=(210e3, 0.3))
    model.section("RUBBER", "RING").section("STEEL", "GROOVE").section("STEEL", "LID")
    model.contact_pair("RING_OUTER", "GROOVE_INNER")
    model.contact_pair("RING_OUTER", "LID_BOTTOM")
    model.boundary("GROOVE_FOOT")
    model.boundary("LID_TOP", 1)
    middle = [label for label in mesh.node_sets["RING_OUTER"]
              if abs(mesh.nodes[mesh.rows([label])[0], 0]) < 1e-6]
    model.boundary(middle, 1)            # by symmetry, no force acts there
    model.boundary("LID_TOP", 2)
    model.step("STATIC", 0.5, 1.0, nlgeom=True).contact_interference()
    step = model.step("STATIC", 0.02, 1.0, nlgeom=True)
    step.boundary("LID_TOP", 2, START - WAY)
    step.output("NODE FILE", ["U", "RF"], frequency=1)
    step.output("EL FILE", ["S"], frequency=1)
    step.output("CONTACT FILE", ["CSTR"], frequency=1)
    return model


def main(folder: str = ".") -> None:
    base = Path(folder)/"gmsh_oring"
    base.parent.mkdir(parents=True, exist_ok=True)
    draw(base.with_suffix(".msh"))
    mesh = emcon.mesh.read(base.with_suffix(".msh"))
    with emcon.Stepper(scene(mesh)) as seal:
        seal.run(output=base, progress=sys.stderr.isatty())
        bolts = seal.reactions[mesh.rows(mesh.node_sets["LID_TOP"]), 1].sum()
        print(f"{seal.n_element} elements, verdict: {seal.verdict()['verdict']}")
        print(f"the bolts pull with {-bolts:.1f} N per millimetre of seal")
        print(f"contact pressure up to {seal.pressures().max():.1f} MPa")
    with emcon.Results(base) as results:
        row = mesh.rows(mesh.node_sets["LID_TOP"])[0]
        way = START - results.fields["displacement"][:, row, 1]
    frames = [0, int(np.argmin(abs(way - 0.5*WAY))), len(way) - 1]
    print("picture:", gmsh_tools.picture(
        base, frames, ["parts", *(f"lid down by {way[k]:.2f} mm" for k in frames[1:])],
        view=(0.0, 1.5, 3.6), top=3.0, parts=True))


if __name__ == "__main__":
    main(*sys.argv[1:])
