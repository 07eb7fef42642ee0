"""Scenes of friction in space with closed forms, for tests and the book: a belt on a drum, a ball that is twisted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import wall_space_scenes as walls
from contact_space_scenes import bodies, faces
from space_mesh import Block


def belt(cells: int, mu: float, thickness: float, legs: int = 2) -> tuple[Block, str]:
    """A belt over the upper half of a drum of radius 1 that turns under it, held at one end, pulled by 1 at the other.

    Its stiffness along is such that it stretches by 1/2000 where it is pulled by 1.
    """
    n, width, down = cells + 2*legs, .1, .2

    def place(x: np.ndarray) -> np.ndarray:
        s, r = x[:, 0]*n - legs, 1.0 + x[:, 2]*thickness
        angle = np.pi*(1.0 - np.clip(s/cells, 0.0, 1.0))
        past = np.maximum(np.maximum(-s, s - cells), 0.0)*down/legs
        return np.stack([r*np.cos(angle), (x[:, 1] - .5)*width, r*np.sin(angle) - past], 1)

    block = Block("C3D8", (n, 1, 1), place=place)
    held = "".join(f"{k}, 1, 3\n" for k in block.on(0, 0))
    end = block.on(0, 1)
    drum = "TYPE=REVOLUTION\n0., -1., 0., 0., 1., 0.\nSTART, 1., 2.\nLINE, 1., 0.\n"
    text = bodies([block], [faces(block, 2, 0)], f"*ELASTIC\n{2e3/(width*thickness)!r}, 0.\n")
    text += walls.wall(drum, (0., 0., 0.)) + walls.pair("", f"*FRICTION\n{mu!r}\n")
    text += f"*BOUNDARY\n{held}{walls.REFERENCE}, 1, 4\n{walls.REFERENCE}, 6, 6\n*STEP, NLGEOM\n*STATIC\n.25, 1.\n"
    text += f"*BOUNDARY\n{walls.REFERENCE}, 5, 5, .02\n*CLOAD\n"
    text += "".join(f"{k}, 3, {-1.0/len(end)!r}\n" for k in end) + "*NODE FILE\nU, RF\n*END STEP\n"
    return block, text


@dataclass(frozen=True)
class Ball:
    """The underside of a ball on a rigid plane that is pressed against it and then turned."""

    cells: int                                   # over the contact's radius
    radius: float = 1.0
    stiffness: float = 1000.0
    nu: float = 0.3
    mu: float = 0.3
    width: float = 0.6                           # half of what is meshed, across
    height: float = 0.9
    kind: str = "C3D8"
    is_half: bool = False                        # what is on one side of y = 0, where force and shift are along x
    deep: float = 1.0                            # it is pressed by this and the square of the contact's radius under 1

    def contact_radius(self, push: float) -> float:
        """Hertz."""
        return (0.75*push*self.radius*(1 - self.nu**2)/self.stiffness)**(1/3)

    def torque(self, push: float) -> float:
        """That of full slip under Hertz's pressure."""
        return 3*np.pi/16*self.mu*push*self.contact_radius(push)

    def slack(self, push: float) -> float:
        """How far a force at the limit shifts the contact."""
        shear = .5*self.stiffness/(1 + self.nu)
        return 3*self.mu*push*(2 - self.nu)/(16*self.contact_radius(push)*shear)

    def loop(self, use: float, push: float) -> float:
        """What a force to and fro takes in a cycle: Mindlin and Deresiewicz, who have each way back as the way there, of
        twice the force and shift."""
        q = np.linspace(0, 1, 2001)
        there = 2*self.slack(push)*(1 - (1 - q*use)**(2/3))
        force = 2*use*self.mu*push*q
        # Between the way there and the same one turned round.
        return 2*np.trapezoid(force, there) - force[-1]*there[-1]

    def places(self, fine: float, end: float) -> np.ndarray:
        """Even ones up to `fine`, then ever wider ones."""
        h = self.contact_radius(1.0)/self.cells
        x = list(h*np.arange(int(np.ceil(fine/h)) + 1))
        n = len(x)
        while x[-1] < end:
            h *= 1.7
            x.append(x[-1] + h)
        x = np.array(x)
        x[n:] = x[n - 1] + (x[n:] - x[n - 1])*(end - x[n - 1])/(x[-1] - x[n - 1])
        return x

    def block(self) -> Block:
        a = self.contact_radius(1.0)
        half, up = self.places(1.15*a, self.width), self.places(.5*a, self.height)
        across = np.concatenate([-half[:0:-1], half])
        along_y = half if self.is_half else across

        def place(p: np.ndarray) -> np.ndarray:
            i = np.rint(p*[len(across) - 1, len(along_y) - 1, len(up) - 1]).astype(int)
            x, y = across[i[:, 0]], along_y[i[:, 1]]
            low = self.radius - np.sqrt(self.radius**2 - x*x - y*y)
            return np.stack([x, y, low + (1 - low/self.height)*up[i[:, 2]]], 1)

        return Block(self.kind, (len(across) - 1, len(along_y) - 1, len(up) - 1), place=place)

    def deck(self, block: Block, turn: float, increments: int) -> str:
        """Pressed in one increment, turned in `increments`."""
        return self.driven(block, [(1.0, ["6, 6", self.pressed()], ""), (1.0/increments, [f"6, 6, {turn!r}"], "")],
                           held=(1, 2))

    def pressed(self) -> str:
        return f"3, 3, {self.deep*self.contact_radius(1.0)**2/self.radius!r}"

    def deck_to_and_fro(self, block: Block, way: float) -> str:
        """Pressed without friction, then shifted along x, back, and again."""
        change = "*CHANGE FRICTION, INTERACTION=I\n*FRICTION\n{}\n"
        moves = [(1.0, ["1, 1", "6, 6", self.pressed()], change.format(1e-6*self.mu))]
        moves += [(1.0, [f"1, 1, {x!r}"], change.format(self.mu)) for x in (way, -way, way)]
        return self.driven(block, moves, held=(2, 2))

    def driven(self, block: Block, moves: list[tuple[float, list[str], str]], held: tuple[int, int]) -> str:
        """The plane is held along `held` and against tilting; steps by increments, what is driven, and cards each."""
        a = self.contact_radius(1.0)
        low = set(block.on(2, 0).tolist())
        near = [(e, f) for e, f in faces(block, 2, 0) if np.linalg.norm(
            block.x[[k - 1 for k in block.element[e - 1] if k in low], :2].mean(0)) < 1.6*a]
        top = "".join(f"{k}, 1, 3\n" for k in block.on(2, 1))
        if self.is_half:
            top += "".join(f"{k}, 2, 2\n" for k in sorted(set(block.on(1, 0).tolist()) - set(block.on(2, 1).tolist())))
        text = bodies([block], [near], f"*ELASTIC\n{self.stiffness!r}, {self.nu!r}\n")
        text += walls.wall(walls.plane(), (0., 0., 0.)) + walls.pair(", SIDES=ONE", f"*FRICTION\n{self.mu!r}\n")
        text += f"*BOUNDARY\n{top}{walls.REFERENCE}, {held[0]}, {held[1]}\n{walls.REFERENCE}, 4, 5\n"
        for h, lines, cards in moves:
            text += f"*STEP, NLGEOM, INC=1000\n*STATIC\n{h!r}, 1.\n*BOUNDARY\n"
            text += "".join(f"{walls.REFERENCE}, {line}\n" for line in lines) + cards
            text += "*NODE FILE\nU\n*CONTACT FILE\nCF\n*END STEP\n"
        return text
