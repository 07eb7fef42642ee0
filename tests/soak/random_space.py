"""Decks of three dimensions with one thing wrong: what is said names it, and where."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path
from random import Random

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).parents[1]/"scenes")]

from scene_tools import emcon  # noqa: E402
from space_mesh import (CUBE_EDGES, KINDS, QUADRATIC, TETRAHEDRA,  # noqa: E402
                        TETRAHEDRON_EDGES, Block)

LAW = "*HYPERELASTIC, NEO HOOKE\n20., 0.01\n"


class Case:
    """A block anywhere in space, of any kind, in any unit of length, and what is done to it."""

    def __init__(self, chance: Random):
        self.chance = chance
        self.kind = chance.choice(KINDS)
        draw = np.random.default_rng(chance.randrange(2**32))
        turn, _ = np.linalg.qr(draw.normal(size=(3, 3)))
        turn *= np.sign(np.linalg.det(turn))
        unit = 2.0**chance.randint(-30, 30)
        cells = tuple(chance.randint(1, 3) for _ in range(3))
        self.mesh = Block(self.kind, cells, (1, 1, 1), shake=0.03,
                          place=lambda x: unit*(x @ turn.T + draw.normal(size=3)))
        self.element = chance.randint(1, len(self.mesh.element))
        self.nodes = self.mesh.element[self.element - 1]
        self.load = self.before = self.step = ""

    def text(self) -> str:
        return self.mesh.deck(LAW, f"{self.before}*BOUNDARY\nNALL, 1, 3\n*STEP, NLGEOM\n*STATIC\n"
                              f"1., 1.\n{self.step}*DLOAD\nALL, GRAV, 1., 0., 0., -1.\n{self.load}"
                              "*NODE FILE\nU\n*END STEP\n")


def sound(case: Case) -> str:
    return ""


def too_few_nodes(case: Case) -> str:
    n = len(case.nodes)
    del case.nodes[case.chance.randrange(n)]
    return f"element {case.element} needs {n} nodes, found {n - 1}"


def too_many_nodes(case: Case) -> str:
    n = len(case.nodes)
    case.nodes.append(case.nodes[0])
    return f"element {case.element} needs {n} nodes: '{case.nodes[0]}' is too much"


def a_node_twice(case: Case) -> str:
    i, k = case.chance.sample(range(len(case.nodes)), 2)
    case.nodes[i] = case.nodes[k]
    return f"element {case.element} "


def a_node_that_is_not_there(case: Case) -> str:
    case.nodes[case.chance.randrange(len(case.nodes))] = 987654
    return "987654"


def in_a_mirror(case: Case) -> str:
    case.mesh.x[:, case.chance.randrange(3)] *= -1
    return "element 1.* inverted"


def flat(case: Case) -> str:
    case.mesh.x[:, case.chance.randrange(3)] = 0.75
    return "element 1.* no volume"


def a_middle_off(case: Case) -> str:
    if case.mesh.kind not in QUADRATIC:
        return sound(case)
    edges = TETRAHEDRON_EDGES if case.mesh.kind in TETRAHEDRA else CUBE_EDGES
    at = case.chance.randrange(len(edges))
    i, k = (case.mesh.x[case.nodes[j] - 1] for j in edges[at])
    part = case.chance.choice([0.02, 0.2, 0.8, 0.97])
    case.mesh.x[case.nodes[len(case.nodes) - len(edges) + at] - 1] = (1 - part)*i + part*k
    return r"element .*outside the middle half"


def no_such_face(case: Case) -> str:
    face = case.chance.choice([0, 7, 9]) if case.mesh.kind not in TETRAHEDRA else 5
    case.load = f"{case.element}, P{face}, 1.\n"
    return f"P{face}|no face {face}"


def a_support_that_turns(case: Case) -> str:
    case.step = f"*BOUNDARY\n{case.nodes[0]}, {case.chance.choice([4, 5, 6])}, , 0.1\n"
    return "turn|degrees? of freedom"


def no_such_freedom(case: Case) -> str:
    dof = case.chance.choice([0, 4, 7, -1])
    case.step = f"*CLOAD\n{case.nodes[0]}, {dof}, 1.\n"
    return f"degree of freedom {dof}|the degree of freedom '{dof}' is not positive|no moment can act"


def contact(case: Case) -> str:
    case.before = ("*SURFACE, NAME=A\nALL, S1\n*SURFACE, NAME=B\nALL, S2\n"
                   "*SURFACE INTERACTION, NAME=I\n*CONTACT DAMPING, TANGENT FRACTION=.5\n.2\n"
                   "*CONTACT PAIR, INTERACTION=I, TYPE=SEGMENT\nA, B\n")
    return "TYPE=SEGMENT is for plane models"


def plane_elements_too(case: Case) -> str:
    nodes = ", ".join(map(str, case.mesh.element[0][:4]))
    case.before = f"*ELEMENT, TYPE=CPE4, ELSET=P\n900001, {nodes}\n"
    return "of the plane or of space, not of both"


def no_third_coordinate(case: Case) -> None:
    """0 is taken: refused or not, by what becomes of the element."""


def any_place(case: Case) -> str | None:
    """A node anywhere: refused or not."""
    node = case.chance.choice(case.nodes) - 1
    case.mesh.x[node] = [case.chance.choice([0.0, 1e300, -1e-300, 3.0, 1e20]) for _ in range(3)]
    return None


FAULTS: list[Callable[[Case], str | None]] = [
    sound, too_few_nodes, too_many_nodes, a_node_twice, a_node_that_is_not_there, in_a_mirror, flat,
    a_middle_off, no_such_face, a_support_that_turns, no_such_freedom, contact, plane_elements_too,
    no_third_coordinate, any_place]


def without_z(text: str, node: int) -> str:
    return re.sub(rf"(?m)^({node}, [^,\n]+, [^,\n]+), [^,\n]+$", r"\1", text, count=1)


def fuzz_space(chance: Random, folder: Path, fault: Callable[[Case], str | None] | None = None) -> None:
    """A deck with one fault is refused with words that name it, a sound one is not."""
    case = Case(chance)
    fault = fault or chance.choice(FAULTS)
    wanted = fault(case)
    text = case.text()
    if fault is no_third_coordinate:
        text = without_z(text, case.nodes[0])
    (folder/"deck.inp").write_text(text)
    done = emcon("check", folder/"deck.inp", timeout=60)
    said = done.stderr
    if wanted is None:
        assert done.returncode in (0, 2), said
    elif wanted == "":
        assert done.returncode == 0, said
    else:
        assert done.returncode == 2, f"{fault.__name__}: taken\n{done.stdout}{said}"
        assert re.search(r"deck\.inp:\d+: error: .*(" + wanted + ")", said), \
            f"{fault.__name__}: {wanted}\n{said}"
