"""Two bodies of space in contact: decks, and sums by numpy of what a run has written."""

import csv

import h5py
import numpy as np
from space_mesh import CUBE_FACES, TETRAHEDRA, TETRAHEDRON_FACES, Block

SURFACES = "*SURFACE INTERACTION, NAME=I\n*CONTACT PAIR, INTERACTION=I{pair}\nUPPER, LOWER\n"


class Pair:
    """A block over another: nodes and elements of both in one deck, the surfaces that face."""

    def __init__(self, kinds, cells, gap=0.0, size=(1.0, 1.0), shift=(0.0, 0.0), turn=0.0):
        turned = np.array([[1, 0, 0], [0, np.cos(turn), -np.sin(turn)],
                           [0, np.sin(turn), np.cos(turn)]])
        self.mesh = [
            Block(kinds[0], (cells[0],)*3, (size[0], size[0], 1),
                  place=lambda x: (x - [0.5*size[0], 0.5*size[0], 0]) @ turned.T
                  + [*shift, gap]),
            Block(kinds[1], (cells[1],)*3, (size[1], size[1], 1),
                  place=lambda x: x - [0.5*size[1], 0.5*size[1], 1])]
        self.n_upper = len(self.mesh[0].x)
        self.x = np.concatenate([mesh.x for mesh in self.mesh])
        self.is_upper = np.arange(len(self.x)) < self.n_upper

    def faces(self, body, end):
        """(element, face) of a body on its lower (0) or upper (1) end."""
        mesh = self.mesh[body]
        on = set(mesh.on(2, end))
        corners = 4 if mesh.kind in TETRAHEDRA else 8
        faces = TETRAHEDRON_FACES if mesh.kind in TETRAHEDRA else CUBE_FACES
        for e, nodes in enumerate(mesh.element, 1):
            for f, face in enumerate(faces, 1):
                if all(nodes[:corners][c] in on for c in face):
                    yield e, f

    def deck(self, after, pair="", law="*ELASTIC\n1000., 0.\n"):
        text, node, element = "", 0, 0
        for name, mesh in zip(("UPPER", "LOWER"), self.mesh, strict=True):
            text += f"*NODE, NSET=N{name}\n" + "".join(
                f"{node + k}, {x!r}, {y!r}, {z!r}\n" for k, (x, y, z) in
                enumerate(mesh.x.tolist(), 1))
            text += f"*ELEMENT, TYPE={mesh.type}, ELSET=E{name}\n"
            for e, nodes in enumerate(mesh.element, 1):
                words = [str(element + e), *(str(node + n) for n in nodes)]
                text += ", ".join(words[:12]) + (",\n" + ", ".join(words[12:])
                                                 if len(words) > 12 else "") + "\n"
            body = 0 if name == "UPPER" else 1
            text += f"*SURFACE, NAME={name}\n" + "".join(
                f"{element + e}, S{f}\n" for e, f in self.faces(body, body))
            for side, end in (("BASE", 0), ("TOP", 1)):
                text += f"*NSET, NSET={side}_{name}\n" + "".join(
                    f"{node + k}\n" for k in mesh.on(2, end))
            text += f"*SOLID SECTION, ELSET=E{name}, MATERIAL=M\n"
            node += len(mesh.x)
            element += len(mesh.element)
        return (f"{text}*MATERIAL, NAME=M\n{law}*DENSITY\n1.\n{SURFACES.format(pair=pair)}"
                f"{after}")


#: What decks ask for.
OUTPUT = """*NODE FILE
U, V
*CONTACT FILE
CDIS, CSTR, CF
*CONTACT PRINT, TOTALS=YES
CDIS, CSTR, CF, CNUM
"""


def pressed(by=0.05):
    """The upper block is pressed onto the lower one, which stands."""
    return (f"*BOUNDARY\nBASE_LOWER, 1, 3\nTOP_UPPER, 1, 2\n*STEP, NLGEOM\n*STATIC\n0.5, 1.\n"
            f"*BOUNDARY\nTOP_UPPER, 3, 3, {-by!r}\n{OUTPUT}*END STEP\n")


def thrown(x, n=20, h=0.02, velocity=(0.3, 0.2, -1.0), spin=(0.0, 0.0, 0.0), more=""):
    """Nodes at `x`, the first of the deck, have a velocity."""
    v = (np.array(velocity) + np.cross(spin, x - x.mean(axis=0))).tolist()
    rows = "".join(f"{k}, {a + 1}, {v[k - 1][a]!r}\n" for k in range(1, len(x) + 1)
                   for a in range(3) if v[k - 1][a])
    return (f"*INITIAL CONDITIONS, TYPE=VELOCITY\n{rows}*STEP, NLGEOM, INC=10000\n"
            f"*DYNAMIC, DIRECT\n{h!r}, {n*h!r}\n{OUTPUT}{more}*END STEP\n")


class FieldsOf:
    """All frames of a field file: `point[name]`, `cell[name]`."""

    def __init__(self, path):
        with h5py.File(path, "r") as file:
            root = file["VTKHDF"]
            self.x, self.time = root["Points"][:], root["Steps/Values"][:]
            self.types = root["Types"][:]
            ends = root["Offsets"][:]
            nodes = root["Connectivity"][:]
            self.cells = [nodes[i:k] for i, k in zip(ends[:-1], ends[1:], strict=True)]
            self.point, self.cell = (
                {name: np.array([data[k:k + count] for k in root[f"Steps/{group}Offsets"][name]])
                 for name, data in root[group].items()}
                for group, count in (("PointData", len(self.x)), ("CellData", len(self.cells))))


def columns(path, name):
    """The x, y and z columns of a history, `name` with a direction behind it."""
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    head = [word.strip() for word in rows[0]]
    table = np.array(rows[1:], float)
    return np.stack([table[:, head.index(f"{name}_{axis}")] for axis in "xyz"], axis=1)
