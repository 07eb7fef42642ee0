"""Deck of a cantilever bent far by a dead load at its tip (Euler's elastica).

    python3 make_cantilever.py --output cantilever.inp
"""

from __future__ import annotations

from deckwriter import (Part, add_grid, arguments, box, cells_argument, comment, heading, number,
                        set_lines, write_deck)

LENGTH, HEIGHT = 10.0, 1.0
LOAD = -10.0
CELLS = (80, 4)

HEADING = """
Cantilever under a dead load at its tip, large displacements, static, plane strain.

Length 10, height 1, E = 12000, nu = 0 (bending stiffness E I = 1000), St. Venant-Kirchhoff
(*ELASTIC with NLGEOM). The load of 10, equal on the nodes of the tip, keeps its direction:
P L^2/(E I) = 1.
Units: any consistent set (force F, length L; stress F/L^2, thickness 1 L).

What to look at: the tip moves down and, as the beam shortens in projection, back.

Expected: this mesh, middle of the tip: u = (-0.56450, -3.01840), from an independent program;
          160 x 8: (-0.57038, -3.03372), 320 x 16: (-0.57187, -3.03759);
          elastica, without shear and stretch: (-0.5643, -3.0172) (Bisshopp & Drucker 1945);
          reaction at the wall: vertical 10, horizontal 0.

Made by make_cantilever.py. Change a parameter for one run: --set load_per_node=-4
"""

MODEL = """
*MATERIAL, NAME=STEEL
*ELASTIC
12000., 0.
*SOLID SECTION, ELSET=BEAM, MATERIAL=STEEL
1.
*BOUNDARY
WALL, 1, 2
"""

STEP = """
*STEP, NLGEOM
*STATIC
0.1, 1.
*CLOAD
TIP, 2, <load_per_node>
*NODE FILE
U, RF
*EL FILE
S, ENER
*END STEP
"""


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--beam", type=cells_argument, default=CELLS, metavar="80x4",
                        help="elements along and across the beam")
    options = parser.parse_args()
    beam = Part("BEAM")
    grid = add_grid(beam, options.beam, box((0.0, -0.5*HEIGHT), (LENGTH, HEIGHT), options.beam))

    lines = heading(HEADING)
    lines += ["**", "*PARAMETER", f"load_per_node = {number(LOAD/(options.beam[1] + 1))}"]
    lines += comment("Beam: {} x {} elements, column by column from the wall, each from the "
                     "bottom up".format(*options.beam))
    lines += beam.node_lines() + beam.element_lines()
    lines += comment("Sets") + set_lines("NSET", "WALL", grid.node[0])
    lines += set_lines("NSET", "TIP", grid.node[-1])
    lines += comment("Material, supports") + MODEL.strip().splitlines()
    lines += comment("The step: the load grows linearly in ten increments")
    lines += STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
