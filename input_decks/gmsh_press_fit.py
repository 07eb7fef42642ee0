"""From Gmsh to ParaView: a wheel is shrunk onto an axle. `python gmsh_press_fit.py [FOLDER]`

    pip install gmsh 'emcon[mesh]' pyvista

The axle is 0.05 mm thicker than the hole of the wheel, which has six more holes. Static, linear steel,
without friction. Units: mm, t, s, so that stresses are in MPa.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import gmsh
import gmsh_tools
import numpy as np

import emcon.mesh

#: Radii of hub, wheel, its holes and the circle they lie on; the radial interference [mm].
HUB, RIM, HOLE, CIRCLE, OVER = 15.0, 50.0, 8.0, 32.0, 0.025
#: Size of elements at the hub, and elsewhere [mm].
FINE, COARSE = 1.0, 2.2
STEEL = (210e3, 0.3)


def draw(path: Path) -> None:
    gmsh_tools.begin()
    shapes = gmsh.model.occ
    axle = (2, shapes.addDisk(0, 0, 0, HUB + OVER, HUB + OVER))
    full = (2, shapes.addDisk(0, 0, 0, RIM, RIM))
    holes = [(2, shapes.addDisk(0, 0, 0, HUB, HUB))]
    for k in range(6):
        angle = k*math.pi/3
        holes.append((2, shapes.addDisk(CIRCLE*math.cos(angle), CIRCLE*math.sin(angle), 0, HOLE,
                                        HOLE)))
    (wheel,), _ = shapes.cut([full], holes)
    shapes.synchronize()
    gmsh_tools.name(axle, "AXLE", {"SEAT": lambda x0, y0, x1, y1: True})
    gmsh_tools.name(wheel, "WHEEL", {
        "BORE": lambda x0, y0, x1, y1: HUB - 0.1 < x1 < HUB + 0.1 and x0 < 0.0,
        "TREAD": lambda x0, y0, x1, y1: x1 - x0 > 1.9*RIM})
    gmsh_tools.divide(FINE, "SEAT")       # equal edges: nodes meet nodes
    gmsh_tools.divide(FINE, "BORE")
    gmsh_tools.write(path, COARSE)


def nearest(mesh: emcon.mesh.Mesh, x: float, y: float) -> int:
    """The label of the node next to a place."""
    return int(mesh.node_labels[np.argmin(np.hypot(*(mesh.nodes[:, :2] - (x, y)).T))])


def scene(mesh: emcon.mesh.Mesh) -> emcon.Model:
    model = emcon.Model.from_mesh(mesh, "A wheel is shrunk onto an axle")
    model.material("STEEL", elastic=STEEL).section("STEEL", "AXLE").section("STEEL", "WHEEL")
    model.contact_pair("BORE", "SEAT", type="MORTAR")
    step = model.step("STATIC", 0.25, 1.0)
    step.contact_interference()
    step.boundary(nearest(mesh, 0.0, 0.0))
    step.boundary(nearest(mesh, 0.5*HUB, 0.0), 2)
    step.boundary(nearest(mesh, RIM, 0.0), 2)          # contact holds the wheel, except against rotation
    return model


def solid_wheel() -> float:
    """The pressure [MPa] if the wheel had no holes, by Lame: plane strain, one steel."""
    modulus = STEEL[0]/(1 - STEEL[1]**2)
    return OVER/HUB*modulus*(RIM**2 - HUB**2)/(2*RIM**2)


def main(folder: str = ".") -> None:
    base = Path(folder)/"gmsh_press_fit"
    base.parent.mkdir(parents=True, exist_ok=True)
    draw(base.with_suffix(".msh"))
    mesh = emcon.mesh.read(base.with_suffix(".msh"))
    with emcon.Stepper(scene(mesh)) as fit:
        fit.run(output=base, progress=sys.stderr.isatty())
        pressure = fit.pressures()
        acts = pressure > 0
        print(f"{fit.n_element} elements, verdict: {fit.verdict()['verdict']}")
        print(f"pressure {pressure[acts].min():.0f} to {pressure[acts].max():.0f} MPa; "
              f"without the holes {solid_wheel():.0f} MPa")
    with emcon.Results(base) as results:
        last = len(results.fields.times) - 1
    print("picture:", gmsh_tools.picture(base, [0, last], ["parts", "shrunk on"],
                                         view=(7.0, 0.0, 60.0), top=300.0, parts=True))


if __name__ == "__main__":
    main(*sys.argv[1:])
