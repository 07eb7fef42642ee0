"""Deck of a static patch test: distorted triangles and quadrilaterals under uniform pressure.

    python3 make_patch_pressure.py --output patch_pressure.inp
"""

from __future__ import annotations

from deckwriter import Part, Point, arguments, comment, heading, number, set_lines, write_deck

SIZE = 2.0
YOUNG, POISSON, PRESSURE = 1000.0, 0.3, 10.0
N_X, N_Y = 4, 4            # cells; the lower half becomes quadrilaterals, the upper triangles

# How far the inner points are moved, in cells; rows from the bottom, chosen irregular.
SHIFT = {(1, 1): (0.22, -0.18), (2, 1): (-0.25, 0.12), (3, 1): (0.10, 0.24),
         (1, 2): (-0.20, 0.15), (2, 2): (0.18, 0.21), (3, 2): (-0.14, -0.23),
         (1, 3): (0.24, 0.08), (2, 3): (-0.11, -0.22), (3, 3): (0.19, 0.17)}


def position(i: int, j: int) -> Point:
    shift = SHIFT.get((i, j), (0.0, 0.0))
    return (round(SIZE*(i + shift[0])/N_X, 6), round(SIZE*(j + shift[1])/N_Y, 6))


def heading_text() -> str:
    strain_x = POISSON*(1.0 + POISSON)*PRESSURE/YOUNG
    strain_y = -(1.0 - POISSON**2)*PRESSURE/YOUNG
    return f"""
Patch test: two blocks of distorted CPE4 and CPE3 in one mesh, uniform pressure {PRESSURE:g}.

A square of side {SIZE:g}, E = {YOUNG:g}, nu = {POISSON:g}, linear elastic, plane strain. The lower
half is of quadrilaterals, the upper of triangles, all distorted. Rollers at the left and the
bottom.
Units: any consistent set (force F, length L; stress F/L^2, thickness 1 L).

What to look at: the stress is the same everywhere; anything else is a fault of the elements.

Expected, to round-off: stress yy = -{PRESSURE:g}, xx = xy = 0, zz = {-POISSON*PRESSURE:g};
          strain xx = {strain_x:g}, yy = {strain_y:g};
          displacement of the upper right corner ({SIZE*strain_x:g}, {SIZE*strain_y:g});
          strain energy {-0.5*PRESSURE*SIZE*SIZE*strain_y:g}.

Made by make_patch_pressure.py.
"""


MATERIAL = f"""
*MATERIAL, NAME=LINEAR
*ELASTIC
{number(YOUNG)}, {number(POISSON)}
*SOLID SECTION, ELSET=LOWER, MATERIAL=LINEAR
1.
*SOLID SECTION, ELSET=UPPER, MATERIAL=LINEAR
1.
*BOUNDARY
LEFT, 1
BOTTOM, 2
"""

STEP = """
*STEP
*STATIC
1., 1.
*DLOAD
TOP, P2, <pressure>
*NODE FILE
U, RF
*EL FILE
S, ENER
*END STEP
"""


def main() -> None:
    options = arguments(__doc__).parse_args()
    label = [[1 + i + j*(N_X + 1) for j in range(N_Y + 1)] for i in range(N_X + 1)]
    lower, upper = Part("LOWER"), Part("UPPER")
    points = Part("ALL", {label[i][j]: position(i, j)
                          for j in range(N_Y + 1) for i in range(N_X + 1)})
    top: list[int] = []
    for j in range(N_Y):
        for i in range(N_X):
            corner = (label[i][j], label[i + 1][j], label[i + 1][j + 1], label[i][j + 1])
            if 2*j < N_Y:
                lower.element[100*(j + 1) + i + 1] = corner
                continue
            first = 100*(j + 1) + 2*i + 1
            upper.element[first] = (corner[0], corner[1], corner[2])
            upper.element[first + 1] = (corner[0], corner[2], corner[3])
            if j == N_Y - 1:
                top.append(first + 1)

    lines = heading(heading_text())
    lines += ["**", "*PARAMETER", f"pressure = {number(PRESSURE)}"]
    lines += comment("Mesh; element labels: row times 100 plus place in the row")
    lines += points.node_lines() + lower.element_lines() + upper.element_lines()
    lines += comment("Sets")
    lines += set_lines("NSET", "LEFT", label[0])
    lines += set_lines("NSET", "BOTTOM", [column[0] for column in label])
    lines += set_lines("ELSET", "TOP", top)
    lines += comment("Material, supports") + MATERIAL.strip().splitlines()
    lines += comment("The step") + STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
