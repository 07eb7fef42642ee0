"""The ring for CalculiX: one layer of C3D8 in plane strain, its layers tied by equations.

Contact by the nodes of the rim, with a penalty; *DYNAMIC, DIRECT with the damping of its default.
CPE4 would be the same layer, but takes no initial velocities.
"""

import re
import shutil

import make_ring
from peers.ring import NU, YOUNG, Told
from timing import usage

#: Pressure per penetration: a hundred times the modulus of the ring over a length of one.
PENALTY = 1e4
#: What comes before contact is left out of seconds.
BEFORE = 4


def program(path=None):
    """The full path of the program, None where there is none."""
    return shutil.which(path or "ccx")


def number(value):
    """Fields have at most 20 characters."""
    return f"{float(value):.13g}"


def labels(card, items):
    return [card, *(f"{k}," for k in items)]


def layers(scene):
    """Nodes, elements, sets and surfaces of the layer; faces S3 and S5 are those on 1-2 and 3-4."""
    n = max(scene.node)
    lines = ["*NODE"]
    for z in (0, 1):
        lines += [f"{a + z*n}, {number(x)}, {number(y)}, {z}." for a, (x, y) in scene.node.items()]
    for name, elements in (("RING", scene.ring), ("BLOCK", scene.block)):
        lines.append(f"*ELEMENT, TYPE=C3D8, ELSET={name}")
        for k in elements:
            a = scene.element[k]
            lines.append(f"{k}, " + ", ".join(map(str, (*a, *(b + n for b in a)))))
    rim = sorted({a for k in scene.outer for a in scene.element[k][:2]})
    ring = scene.nodes_of(scene.ring)
    lines += ["*ELSET, ELSET=ALL", "RING, BLOCK",
              *labels("*NSET, NSET=MOVING", [*ring, *(a + n for a in ring)]),
              *labels("*NSET, NSET=BOTTOM", [*scene.bottom, *(a + n for a in scene.bottom)]),
              *labels("*NSET, NSET=RIM", rim),
              *labels("*ELSET, ELSET=TOP", scene.top),
              "*NSET, NSET=NODES, GENERATE", f"1, {2*n}",
              "*SURFACE, NAME=SLAVE, TYPE=NODE", "RIM",
              "*SURFACE, NAME=MASTER, TYPE=ELEMENT", "TOP, S5", "*EQUATION"]
    held = set(scene.bottom)
    for a in scene.node:
        if a not in held:
            for axis in (1, 2):
                lines += ["2", f"{a + n}, {axis}, 1., {a}, {axis}, -1."]
    return [*lines, "*BOUNDARY", "NODES, 3, 3", "BOTTOM, 1, 2"]


def deck(scene, h, increments):
    """Its text; the law keeps volumes by (J - 1)^2/D1, with the moduli of small strains."""
    lines = ["*HEADING", "Ring on a foundation", *layers(scene)]
    for name, young in zip(("RING", "BLOCK"), YOUNG, strict=True):
        shear, bulk = young/(2 + 2*NU), young/(3 - 6*NU)
        lines += [f"*MATERIAL, NAME={name}", "*HYPERELASTIC, NEO HOOKE",
                  f"{number(shear/2)}, {number(2/bulk)}", "*DENSITY", number(make_ring.DENSITY)]
    lines += ["*SOLID SECTION, ELSET=RING, MATERIAL=RING",
              "*SOLID SECTION, ELSET=BLOCK, MATERIAL=BLOCK",
              "*SURFACE INTERACTION, NAME=CONTACT",
              "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", number(PENALTY),
              "*CONTACT PAIR, INTERACTION=CONTACT, TYPE=NODE TO SURFACE", "SLAVE, MASTER",
              "*INITIAL CONDITIONS, TYPE=VELOCITY",
              *(f"MOVING, {k}, {number(v)}" for k, v in enumerate(make_ring.VELOCITY, start=1)),
              "*STEP, NLGEOM, INC=1000000", "*DYNAMIC, DIRECT", f"{h}, {number(h*increments)}",
              "*EL PRINT, ELSET=ALL, TOTALS=ONLY", "ELSE, ELKE", "*END STEP"]
    return "\n".join(lines) + "\n"


def energies(text):
    """Strain and kinetic energy of each increment, of NAME.dat."""
    kind = {"internal": [], "kinetic": []}
    for name, value in re.findall(r"total (internal|kinetic) energy[^\n]*\n\s*\n\s*(\S+)", text):
        kind[name].append(float(value))
    return list(zip(kind["internal"], kind["kinetic"], strict=True))


def run(path, scene, h, increments, folder):
    """`Told` by two runs, the shorter of which ends where contact begins."""
    user = []
    for n in (BEFORE, increments):
        (folder/"ring.inp").write_text(deck(scene, h, n))
        done = usage([path, "ring"], folder)
        rows = (folder/"ring.sta").read_text().splitlines()[2:]
        if done.code != 0 or len(rows) != n or any("U" in row for row in rows):
            raise RuntimeError(f"CalculiX did not do {n} increments:\n{done.text[-2000:]}")
        user.append(done.user)
    iterations = sum(int(row.split()[3]) for row in rows[BEFORE:])
    mass = energies((folder/"ring.dat").read_text())
    # Before contact, in the first increment, the ring flies: that is its energy.
    return Told((user[1] - user[0])/(increments - BEFORE), [sum(e) for e in mass],
                iterations/(increments - BEFORE))
