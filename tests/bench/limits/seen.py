"""What runs of plain decks come to by places and velocities alone: energies by quadrature in numpy.

Of four-node elements in plane strain and of eight-node ones in space, with the compressible neo-Hookean
law, the only one of the scenes here; the deck is read anew, nothing comes from the ledger of the program.
"""

import itertools
import re

import numpy as np
import overlap

#: Corners of an element in its own coordinates, of a square and of a cube.
SQUARE = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)
CORNERS = {4: SQUARE, 8: np.vstack([np.insert(SQUARE, 2, end, axis=1) for end in (-1.0, 1.0)])}
#: Nodes beyond which outlines are not held against each other: the tables are as large as its square.
MOST_NODES = 600


def sections(text):
    """(labels of the nodes of its elements, E, rho) of each section of a deck."""
    element, material = {}, {}
    for name, block in re.findall(r"\*ELEMENT, TYPE=(?:CPE4|C3D8), ELSET=(\w+)\n((?:[^*\n][^\n]*\n)+)", text):
        element[name] = [[int(n) for n in line.split(",")[1:]] for line in block.splitlines()]
    for name, block in re.findall(r"\*MATERIAL, NAME=(\w+)\n(.*?)(?=\*SOLID SECTION)", text, re.DOTALL):
        young, ratio = re.search(r"COUPLED NEO HOOKE\n(.*), (.*)\n", block).groups()
        assert float(ratio) == 0.3
        material[name] = float(young), float(re.search(r"\*DENSITY\n(.*)\n", block)[1])
    return [(np.array(element[name]), *material[name]) for name in element]


def logarithm_excess(j):
    """j - ln(1 + j), also where j is small."""
    series = j**2*(1/2 - j*(1/3 - j*(1/4 - j*(1/5 - j*(1/6 - j/7)))))
    return np.where(np.abs(j) < 1e-3, series, j - np.log1p(j))


def shapes(corner):
    """Values and slopes of the functions of the corners, at each of the points of Gauss of order 2."""
    for point in itertools.product((-3**-0.5, 3**-0.5), repeat=corner.shape[1]):
        part = (1 + corner*point)/2
        slope = [corner[:, k]/2*np.delete(part, k, axis=1).prod(1) for k in range(len(point))]
        yield part.prod(1), np.transpose(slope)


def energies(x, u, v, parts):
    """Kinetic and strain energy; `parts` as of `sections`, by numbers of nodes from 0."""
    kinetic = strain = 0.0
    for cell, young, density in parts:
        shear, lame = young/2.6, young*0.3/(1.3*0.4)
        for shape, slope in shapes(CORNERS[cell.shape[1]]):
            # Of differences, which are exact far from the origin, too.
            frame = np.einsum("eai,aj->eij", x[cell] - x[cell[:, :1]], slope)
            weight = np.linalg.det(frame)
            grad = np.einsum("eai,aj->eij", u[cell], slope) @ np.linalg.inv(frame)
            trace = np.trace(grad, axis1=1, axis2=2)
            # det(1 + grad) - 1 less the trace: the determinant, in space the minors besides.
            more = np.linalg.det(grad)
            if grad.shape[1] == 3:
                more = more + 0.5*(trace**2 - np.einsum("eij,eji->e", grad, grad))
            j = trace + more
            # mu/2 (tr C - n) - mu ln J, its linear parts taken off before they cancel.
            density_of = shear*(0.5*(grad**2).sum((1, 2)) - more + logarithm_excess(j)) \
                + 0.5*lame*np.log1p(j)**2
            strain += (weight*density_of).sum()
            speed = np.einsum("a,eai->ei", shape, v[cell])
            kinetic += 0.5*density*(weight*(speed**2).sum(1)).sum()
    return kinetic, strain


def fall(u, parts, x, gravity):
    """Work of gravity since the start."""
    unit = np.zeros_like(u)
    unit[:, -1] = 1.0
    # The cross term of the kinetic energy is the momentum.
    both = energies(x, 0*u, u + unit, parts)[0] - energies(x, 0*u, u - unit, parts)[0]
    return -gravity*0.5*both


def energy_seen(run):
    """Change of kinetic and strain energy less the work of gravity, by the largest energy."""
    fields, text = run.fields(), run.file(".inp").read_text()
    labels = [int(line.split(",")[0]) for block in
              re.findall(r"\*NODE, NSET=\w+\n((?:[^*\n][^\n]*\n)+)", text)
              for line in block.splitlines()]
    number = {label: k for k, label in enumerate(labels)}
    parts = [(np.vectorize(number.get)(cell), young, density)
             for cell, young, density in sections(text)]
    found = re.search(r"GRAV, (\S+), (?:0., )+-1.", text)
    gravity = float(found[1]) if found else 0.0
    total, largest = [], 0.0
    for u, v in zip(fields["displacement"], fields["velocity"], strict=True):
        made = energies(fields.x, u, v, parts)
        largest = max(largest, sum(made))
        total.append(sum(made) - fall(u, parts, fields.x, gravity))
    return np.abs(np.array(total) - total[0]).max()/largest


def overlap_seen(run):
    """The deepest overlap of two bodies in any frame, by the edge; 0 of large meshes."""
    fields = run.fields()
    return max(overlap.frames(fields)).by_edge if len(fields.x) <= MOST_NODES else 0.0
