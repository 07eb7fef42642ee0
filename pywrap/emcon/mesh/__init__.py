"""Meshes in the plane and in space, with sets and surfaces.

    from emcon.mesh import block, ring
    from emcon.model import Model

    mesh = (ring((0.0, 10.1), (8.0, 10.0), (64, 4))
            + block((-25.0, -5.0), (60.0, 5.0), (60, 5)))
    model = Model.from_mesh(mesh, "A ring falls on a block")
    model.cards(text)                         # materials, contact, steps: text of docs/deck.md,
    model.section("SOFT", "RING")             # or calls
    model.write("ring.inp")

The sides of what the builders make have names: BLOCK_TOP, RING_OUTER, ... Each is a surface and
the set of its nodes; the body itself is a set of nodes and of elements. `read` takes meshes from
files of Gmsh and Abaqus; `refine` cuts each element in four; `boundary_edges` finds the edges of
bodies in cells of any code. Elements are of any kind that decks know: `block(kind="C3D10")`,
`Mesh.retype({"C3D8": "C3D20R"})`.

Lengths are in the deck's unit [L], angles in radians, counter-clockwise. Nodes and elements are
named by their labels, whole numbers from 1 on, as in a deck.
"""

from .checks import MeshError, MeshWarning
from .edges import boundary_edges
from .mesh import Mesh
from .reading import read
from .refinement import refine
from .shapes import block, disc, grid, ring, strip

__all__ = ["Mesh", "MeshError", "MeshWarning", "block", "boundary_edges", "disc", "grid", "read",
           "refine", "ring", "strip"]
