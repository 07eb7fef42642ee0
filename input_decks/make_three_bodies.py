"""Deck of three discs in free flight: the middle one is struck from both sides.

    python3 make_three_bodies.py --output three_bodies.inp
    python3 make_three_bodies.py --two-pass --output two_pass.inp
"""

from __future__ import annotations

from deckwriter import (Part, Point, arguments, comment, heading, number, surface_lines,
                        write_deck)
from scenery import (FREE_STEP, Momenta, Motion, add_disc, contact_parameters, momenta,
                     momenta_text, velocity_lines)

DENSITY = 0.01


class Disc:
    """A disc of the scene: its size, mesh and motion."""

    def __init__(self, name: str, radius: float, cells: tuple[int, int], turn: float,
                 motion: Motion) -> None:
        self.part = Part(name)
        self.radius, self.cells, self.turn, self.motion = radius, cells, turn, motion

    def momenta(self) -> Momenta:
        return momenta(self.part, DENSITY, self.motion.at)


def discs() -> list[Disc]:
    return [Disc("LEFT", 4.0, (7, 3), 0.0, Motion((-7.3, -0.6), (2.5, 0.3), 0.3)),
            Disc("MIDDLE", 3.0, (6, 3), 0.3, Motion((0.0, 0.0), (0.0, 0.0), -0.5)),
            Disc("RIGHT", 2.0, (5, 2), 0.1, Motion((5.4, 0.5), (-4.0, -0.2), 0.8))]


def heading_text(disc: list[Disc], two_pass: bool) -> str:
    total = disc[0].momenta() + disc[1].momenta() + disc[2].momenta()
    passes = ", in both orders (two passes)" if two_pass else ""
    rows = "\n".join(f"  {d.part.name:6}  radius {d.radius:g}, velocity ({d.motion.velocity[0]:g}, "
                     f"{d.motion.velocity[1]:g}), spin {d.motion.spin:g}" for d in disc)
    return f"""
Three free spinning discs: the middle one is struck from both sides; plane strain, no friction.

{rows}
Left and right E = 100, nu = 0.3, the middle one E = 50, nu = 0.4, all compressible neo-Hookean.
No supports, no loads. The rim of the middle disc is the slave on that of the left one and the
master of that of the right one{passes}.
Units: any consistent set (length L, mass M, time T; stress M/(L T^2), thickness 1 L).

What to look at: total energy, px, py and lz (about the origin) of all bodies together stay as
they are at the start, through both contacts, for every h.

Expected: {momenta_text(total)};
          each constant to 1e-11 relative. In contact from t = 0.12 to 0.5; after that px is
          -0.51 of the left, 0.76 of the middle and 0.50 of the right disc, all +- 0.03 over
          h = 0.01 to 0.0025 and the formulations.

Made by make_three_bodies.py. Change a parameter for one run: --set h=0.005
"""


PARAMETERS = f"""
*PARAMETER
h = 0.01
t_end = 1.5
frame = 0.05
method = NULL SPACE
initiation = PERSISTENT
tolerance = 1e-12
{contact_parameters().strip()}
"""

MATERIAL = f"""
*MATERIAL, NAME=FIRM
*HYPERELASTIC, COUPLED NEO HOOKE
100., 0.3
*DENSITY
{number(DENSITY)}
*MATERIAL, NAME=SOFT
*HYPERELASTIC, COUPLED NEO HOOKE
50., 0.4
*DENSITY
{number(DENSITY)}
*SOLID SECTION, ELSET=LEFT, MATERIAL=FIRM
1.
*SOLID SECTION, ELSET=MIDDLE, MATERIAL=SOFT
1.
*SOLID SECTION, ELSET=RIGHT, MATERIAL=FIRM
1.
*SURFACE INTERACTION, NAME=FRICTIONLESS
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=<formulation>, SIDES=<sides>
MIDDLE_RIM, LEFT_RIM
RIGHT_RIM, MIDDLE_RIM
"""

FRAMES = """
*TIME POINTS, NAME=FRAMES, GENERATE
0., <t_end>, <frame>
"""


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--two-pass", action="store_true",
                        help="list the pairs in both orders")
    options = parser.parse_args()

    scene = discs()
    first, mesh, surfaces, start = (1, 1), [], [], []
    for disc in scene:
        grid = add_disc(disc.part, disc.motion.centre, disc.radius, disc.cells, first, disc.turn)
        first = (first[0] + len(disc.part.node), first[1] + len(disc.part.element))
        mesh += disc.part.node_lines() + disc.part.element_lines()
        surfaces += surface_lines(f"{disc.part.name}_RIM", "S1",
                                  [column[0] for column in grid.element])
        start += velocity_lines(disc.part, disc.motion.at)

    lines = heading(heading_text(scene, options.two_pass))
    lines += ["**"] + PARAMETERS.strip().splitlines()
    lines += comment("Discs: mantle from the rim inwards, then the square in the middle") + mesh
    lines += comment("Surfaces") + surfaces
    lines += comment("Materials, contact") + MATERIAL.strip().splitlines()
    lines += ["LEFT_RIM, MIDDLE_RIM", "MIDDLE_RIM, RIGHT_RIM"] if options.two_pass else []
    lines += FRAMES.strip().splitlines()
    lines += comment("Start: node, direction, velocity") + start
    lines += comment("The run") + FREE_STEP.strip().splitlines()
    write_deck(lines, options.output)


if __name__ == "__main__":
    main()
