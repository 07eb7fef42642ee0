"""Bodies in space that meet walls: shapes without faces, fixed, driven or free."""

from __future__ import annotations

import numpy as np
from contact_space_scenes import RUBBER, bodies, dynamic, faces, velocities
from space_mesh import Block

#: Label of the reference node of a wall.
REFERENCE = 90000
FIXED = f"{REFERENCE}, ENCASTRE\n"


def wall(shape: str, at: tuple[float, ...] = (0., 0., -3.), element_set: str = "") -> str:
    """A surface W with a shape, of a rigid body about a reference node."""
    return (f"*NODE\n{REFERENCE}, {', '.join(map(repr, at))}\n*SURFACE, NAME=W, {shape}"
            f"*RIGID BODY, {element_set}ANALYTICAL SURFACE=W, REF NODE={REFERENCE}\n")


def plane(point: tuple[float, ...] = (0., 0., 0.), normal: tuple[float, ...] = (0., 0., 1.)) -> str:
    return f"TYPE=PLANE\n{', '.join(map(repr, (*point, *normal)))}\n"


def sphere(radius: float, centre: tuple[float, ...] = (0., 0., 0.), inside: bool = False) -> str:
    return f"TYPE=SPHERE\n{', '.join(map(repr, (*centre, radius)))}{', INSIDE' if inside else ''}\n"


def pair(options: str = "", interaction: str = "") -> str:
    return f"*SURFACE INTERACTION, NAME=I\n{interaction}*CONTACT PAIR, INTERACTION=I{options}\nS1, W\n"


def falling(block: Block, shape: str, velocity: tuple[float, ...], spin: tuple[float, ...] = (0., 0., 0.),
            h: float = 0.02, until: float = 0.6, more: str = "", law: str = RUBBER, options: str = "",
            interaction: str = "", support: str = FIXED) -> str:
    """A body that flies onto a fixed wall."""
    return (bodies([block], [faces(block)], law) + wall(shape) + pair(options, interaction)
            + velocities(block, velocity, spin) + f"*BOUNDARY\n{support}" + dynamic(h, until, more))


def cube(cells: tuple[int, int, int] = (2, 2, 2), gap: float = 0.03, turn: np.ndarray | None = None) -> Block:
    turn = np.eye(3) if turn is None else turn
    return Block("C3D8", cells, place=lambda x: (x - np.array([0.5, 0.5, 0.0])) @ turn.T + np.array([0., 0., gap]))


def pin_in_a_hole(cells: int, radius: float, e: float, nu: float, options: str = "") -> tuple[Block, str]:
    """A disc of a radius in a rigid hole of radius 1, whose ends do not move along the axis; the block, and its deck."""

    def disc(x: np.ndarray) -> np.ndarray:
        p = x[:, :2] - 1.0
        most, length = np.abs(p).max(1)[:, None], np.linalg.norm(p, axis=1)[:, None]
        length[length == 0.0] = 1.0
        return np.hstack([radius*(0.7*(1.0 - most)*p + most*most/length*p), x[:, 2:]])

    block = Block("C3D8", (cells, cells, 1), size=(2, 2, 1), place=disc)
    text = bodies([block], [faces(block)], f"*ELASTIC\n{e}, {nu}\n") + "*NSET, NSET=ENDS\n"
    text += "".join(f"{k}\n" for k in [*block.on(2, 0), *block.on(2, 1)])
    text += wall("TYPE=REVOLUTION\n0., 0., 0., 0., 0., 1.\nSTART, 1., -5.\nLINE, 1., 5.\n") + pair(options)
    text += f"*BOUNDARY\nENDS, 3\n{FIXED}*STEP\n*STATIC, DIRECT\n.5, 1.\n*CONTACT INTERFERENCE, SHRINK\nS1, W\n"
    return block, text + "*NODE FILE\nU\n*CONTACT FILE\nCF, CSTRESS\n*END STEP\n"
