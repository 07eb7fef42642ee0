"""Elements: Cook's membrane, beams of MacNeal and Harder, elastica, frequencies."""

import numpy as np
from element_meshes import Mesh
from scene_tools import run_deck
from space_mesh import KINDS as SOLIDS
from space_mesh import Block

from .common import Chapter, table

STRAIN = ("CPE3", "CPE4", "CPE4H", "CPE4I", "CPE6", "CPE8", "CPE8R")
KINDS = (*STRAIN, "CPS3", "CPS4", "CPS4I", "CPS6", "CPS8", "CPS8R")
COOK = (*STRAIN, *SOLIDS)
CELLS = (4, 8, 16, 32)


def elastic(kind, young, nu):
    """Constants of plane stress; those with which plane strain has the same moduli for CPE."""
    if kind.startswith("CPE"):
        young, nu = young*(1 + 2*nu)/(1 + nu)**2, nu/(1 + nu)
    return f"*ELASTIC\n{young!r}, {nu!r}\n"


def start_static(runs, mesh, law, loads, nlgeom="", increment=1.0):
    """A static run, clamped at the left, with a load along the right side; its tip afterwards."""
    runs.count += 1
    path = runs.folder/f"elements{runs.count}.inp"
    held = "".join(f"{k}, 1, 2\n" for k in mesh.side("left"))
    rows = "".join(f"{k}, {axis}, {float(load*part)!r}\n" for axis, load in loads.items()
                   for k, part in mesh.shares("right").items())
    path.write_text(mesh.deck(law, f"*BOUNDARY\n{held}*STEP{nlgeom}\n*STATIC\n{increment}, 1.\n"
                              f"*CLOAD\n{rows}*NODE FILE\nU\n*END STEP\n"))

    def tip(deck, folder):
        u = run_deck(deck, folder).fields()["displacement"][-1]
        right = mesh.side("right")
        return u[np.array([right[0], right[-1]]) - 1, :2]

    return runs.start(path, tip)


# ---- Cook's membrane ----------------------------------------------------------------------------

MEMBRANE = [(0, 0), (48, 44), (48, 60), (0, 44)]


def cook_law(nu):
    mu = 80.194
    bulk = 2*mu*(1 + nu)/(3*(1 - 2*nu))
    return f"*HYPERELASTIC, NEO HOOKE\n{mu/2!r}, {2/bulk!r}\n"


def membrane_place(s):
    """Of a block: its first two axes, one layer as thick as 1."""
    left, right = np.array([MEMBRANE[0], MEMBRANE[3]]), np.array([MEMBRANE[1], MEMBRANE[2]])
    ends = (1 - s[:, :1, None])*left + s[:, :1, None]*right
    return np.column_stack([(1 - s[:, 1:2])*ends[:, 0] + s[:, 1:2]*ends[:, 1], s[:, 2]])


def start_layer(runs, kind, n, law):
    """The membrane as one layer of solids, held across: plane strain. Its corner afterwards."""
    mesh = Block(kind, (n, n, 1))
    mesh.x = membrane_place(mesh.grid/np.array(mesh.last))
    runs.count += 1
    path = runs.folder/f"elements{runs.count}.inp"
    held = "".join(f"{k}, 1, 2\n" for k in mesh.on(0, 0)) + "NALL, 3\n"
    rows = "".join(f"{k}, 2, {100.0*part!r}\n" for k, part in end_shares(mesh)[0].items() if part)
    path.write_text(mesh.deck(law, f"*BOUNDARY\n{held}*STEP, NLGEOM\n*STATIC\n0.25, 1.\n*CLOAD\n{rows}"
                              "*NODE FILE\nU\n*END STEP\n"))
    corner = mesh.label[mesh.last[0], mesh.last[1], 0] - 1
    return runs.start(path, lambda deck, folder:
                      run_deck(deck, folder).fields()["displacement"][-1][corner, 1])


def start_cook(runs, nu=0.4999):
    started, law = {}, cook_law(nu)
    for kind in COOK:
        for n in CELLS[:-1] if kind in SOLIDS else CELLS:
            started[kind, n] = (start_layer(runs, kind, n, law) if kind in SOLIDS else
                                start_static(runs, Mesh(kind, n, n, MEMBRANE), law, {2: 100.0},
                                             ", NLGEOM", 0.25))
    return started


def start_soft_cook(runs):
    return start_cook(runs, 0.3)


def cook(started, _):
    tip = {(kind, n): future.result() if kind in SOLIDS else future.result()[1, 1]
           for (kind, n), future in started.items()}
    a, b, c = (tip["CPE8R", n] for n in CELLS[-3:])
    limit = c - (c - b)**2/((c - b) - (b - a))
    rows = []
    for kind in COOK:
        error = [abs(tip[kind, n] - limit) for n in CELLS if (kind, n) in tip][-2:]
        rows.append((kind, *(f"{tip[kind, n]:.3f}" if (kind, n) in tip else "" for n in CELLS),
                     f"{100*(tip[kind, 16]/limit - 1):+.1f} %", f"{np.log2(error[0]/error[1]):.1f}"))
    return [*table(["kind", *(f"{n} x {n}" for n in CELLS), "error of 16 x 16", "order at the end"],
                   rows), "", f"Limit of CPE8R: {limit:.3f}."]


# ---- beams of MacNeal and Harder ----------------------------------------------------------------

SHAPES = ("regular", "trapezoids", "parallelograms")


def straight(kind, shape):
    """6 by 1 cells over 6 by 0.2; lines between them lean by 45 degrees."""
    mesh = Mesh(kind, 6, 1, [(0, 0), (6, 0), (6, 0.2), (0, 0.2)])
    lean = {"regular": np.zeros(7), "trapezoids": np.array([0, 1, -1, 1, -1, 1, 0.0]),
            "parallelograms": np.array([0, 1, 1, 1, 1, 1, 0.0])}[shape]
    mesh.x[:, 0] += np.interp(mesh.x[:, 0], np.arange(7), lean)*(mesh.x[:, 1] - 0.1)
    return mesh


def curved(kind):
    """A quarter of a circle between the radii 4.12 and 4.32; clamped at its left end."""
    mesh = Mesh(kind, 6, 1, [(0, 0), (1, 0), (1, 1), (0, 1)])
    angle, radius = 0.5*np.pi*(1 - mesh.x[:, 0]), 4.12 + 0.2*mesh.x[:, 1]
    mesh.x = np.stack([radius*np.cos(angle), radius*np.sin(angle)], 1)
    return mesh


def start_beams(runs):
    """Thickness 0.1: ten times the load for one of 1."""
    started = {}
    for kind in KINDS:
        for shape in SHAPES:
            started[kind, shape] = start_static(runs, straight(kind, shape),
                                                elastic(kind, 1e7, 0.3), {2: 10.0})
        # The free end lies at the angle 0: along x the load is radial.
        started[kind, "curved"] = start_static(runs, curved(kind), elastic(kind, 1e7, 0.25),
                                               {1: 10.0})
    return started


def beams(started, _):
    part = {}
    for (kind, shape), future in started.items():
        axis, wanted = (0, 0.08734) if shape == "curved" else (1, 0.1081)
        part[kind, shape] = abs(future.result()[:, axis].mean())/wanted
    return table(["kind", *SHAPES, "curved beam"],
                 [(kind, *(f"{part[kind, shape]:.3f}" for shape in (*SHAPES, "curved")))
                  for kind in KINDS])


# ---- the same in three dimensions ----------------------------------------------------------------


def ring_place(s):
    """The quarter of a circle, of width 0.1; the free end, at the angle 0, is the last one."""
    angle, radius = 0.5*np.pi*(1 - s[:, 0]), 4.12 + 0.2*s[:, 1]
    return np.stack([radius*np.cos(angle), radius*np.sin(angle), 0.1*s[:, 2]], 1)


def twisted_place(s):
    """12 by 1.1 by 0.32, turned by a right angle from end to end; wide along y where it is held."""
    angle, y, z = 0.5*np.pi*s[:, 0], 1.1*(s[:, 1] - 0.5), 0.32*(s[:, 2] - 0.5)
    return np.stack([12*s[:, 0], np.cos(angle)*y - np.sin(angle)*z,
                     np.sin(angle)*y + np.cos(angle)*z], 1)


#: Cells, place, law, then each axis of a unit load at the tip with the displacement by beam theory.
SPACE_BEAMS = {
    "curved, in its plane": ((6, 1, 1), ring_place, "1e7, 0.25", 1, 0.08734),
    "curved, out of it": ((6, 1, 1), ring_place, "1e7, 0.25", 3, 0.5022),
    "twisted, flat at the tip": ((12, 2, 1), twisted_place, "29e6, 0.22", 2, 0.001754),
    "twisted, upright at the tip": ((12, 2, 1), twisted_place, "29e6, 0.22", 3, 0.005424),
}


def end_shares(mesh):
    """Part of a uniform load on each node of the free end, and that end's corners."""
    share, corners, grid = {}, set(), mesh.grid
    is_triangle = mesh.kind in ("C3D4", "C3D10")
    for nodes in mesh.element:
        end = [k for k in nodes if grid[k - 1][0] == mesh.last[0]]
        if len(end) < (3 if is_triangle else 4):
            continue
        ends = [k for k in end if k in nodes[:4 if is_triangle else 8]]
        for k in end:
            if mesh.step == 1:
                part = 1/len(ends)
            elif is_triangle:
                part = 0.0 if k in ends else 1/3
            else:
                part = -1/12 if k in ends else 1/3
            share[k] = share.get(k, 0.0) + part
        corners.update(ends)
    total = sum(share.values())
    return {k: part/total for k, part in share.items()}, np.array(sorted(corners)) - 1


def start_space_beams(runs):
    started = {}
    for kind in SOLIDS:
        for name, (cells, place, law, axis, _) in SPACE_BEAMS.items():
            mesh = Block(kind, cells)
            mesh.x = place(mesh.grid/np.array(mesh.last))
            share, corners = end_shares(mesh)
            runs.count += 1
            path = runs.folder/f"elements{runs.count}.inp"
            held = "".join(f"{k}, 1, 3\n" for k in mesh.on(0, 0))
            rows = "".join(f"{k}, {axis}, {part!r}\n" for k, part in share.items() if part)
            path.write_text(mesh.deck(f"*ELASTIC\n{law}\n", f"*BOUNDARY\n{held}*STEP\n*STATIC\n1., 1.\n"
                                      f"*CLOAD\n{rows}*NODE FILE\nU\n*END STEP\n"))

            def tip(deck, folder, corners=corners, axis=axis):
                return run_deck(deck, folder).fields()["displacement"][-1][corners, axis - 1].mean()

            started[kind, name] = runs.start(path, tip)
    return started


def space_beams(started, _):
    return table(["kind", *SPACE_BEAMS],
                 [(kind, *(f"{abs(started[kind, name].result())/beam[-1]:.3f}"
                           for name, beam in SPACE_BEAMS.items())) for kind in SOLIDS])


# ---- elastica -----------------------------------------------------------------------------------

LENGTH, STIFF = 50.0, 1e4
#: Of the tip, over the length, at P L^2/(E I) = 10: Mattiasson (1981).
ELASTICA = np.array([0.55500, 0.81061])
BEAMS = ((50, 1), (100, 2), (200, 4))


def beam(kind, cells):
    return Mesh(kind, *cells, [(0, -0.5), (LENGTH, -0.5), (LENGTH, 0.5), (0, 0.5)])


def start_elastica(runs):
    load = 10*STIFF/12/LENGTH**2
    return {(kind, cells): start_static(runs, beam(kind, cells), elastic(kind, STIFF, 0.0),
                                        {2: load}, ", NLGEOM", 0.125)
            for kind in KINDS for cells in BEAMS}


def elastica(started, _):
    rows = []
    for kind in KINDS:
        row = [kind]
        for cells in BEAMS:
            tip = np.abs(started[kind, cells].result().mean(axis=0))/LENGTH
            row.append(f"{100*(tip[1]/ELASTICA[1] - 1):+.2f} %")
        rows.append(row)
    return table(["kind", *(f"{n} x {m}" for n, m in BEAMS)], rows)


# ---- frequencies --------------------------------------------------------------------------------


def start_frequencies(runs):
    """Decks; they are not run."""
    started = {}
    for kind in KINDS:
        for cells in BEAMS:
            mesh = beam(kind, cells)
            runs.count += 1
            path = runs.folder/f"elements{runs.count}.inp"
            held = "".join(f"{k}, 1, 2\n" for k in mesh.side("left"))
            path.write_text(mesh.deck(elastic(kind, STIFF, 0.0), f"*BOUNDARY\n{held}*STEP, NLGEOM\n"
                                      "*DYNAMIC, DIRECT\n1., 1.\n*END STEP\n"))
            started[kind, cells] = path
    return started


def first_frequency(deck):
    """Radians per time, by the tangents of steps so large and so small that they tell K and M."""
    from emcon.stepper import Stepper
    from scipy.sparse.linalg import eigsh

    with Stepper(deck) as model:
        u = np.zeros((model.n_node, 2))
        small, large = (model.tangent(u, h).to_scipy() for h in (1e-3, 1e3))
        mass = (small - large)/(2e6 - 2e-6)
        stiffness = 2*(large - 2e-6*mass)
        return np.sqrt(eigsh(stiffness.tocsc(), 1, mass.tocsc(), sigma=0.0)[0][0])


def frequencies(started, _):
    """Against the beam of Euler and Bernoulli; the density is 0.5, the thickness 1."""
    wanted = 1.8751040687119611**2*np.sqrt(STIFF/12/0.5)/LENGTH**2
    return table(["kind", *(f"{n} x {m}" for n, m in BEAMS)],
                 [(kind, *(f"{100*(first_frequency(started[kind, cells])/wanted - 1):+.2f} %"
                           for cells in BEAMS)) for kind in KINDS])


CHAPTERS = [
    Chapter("elements_cook", start_cook, cook),
    Chapter("elements_soft_cook", start_soft_cook, cook),
    Chapter("elements_beams", start_beams, beams),
    Chapter("elements_space_beams", start_space_beams, space_beams),
    Chapter("elements_elastica", start_elastica, elastica),
    Chapter("elements_frequencies", start_frequencies, frequencies),
]
