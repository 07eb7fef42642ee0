"""What a stepper shows of its mesh, its fields and its bodies, as arrays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from .errors import InputError
from .memory import reals, text

if TYPE_CHECKING:
    from .handle import Handle

#: Kinds of cells by VTK's numbers, as meshio calls them, and how many nodes they have.
CELLS = {5: ("triangle", 3), 9: ("quad", 4), 22: ("triangle6", 6), 23: ("quad8", 8),
         10: ("tetra", 4), 12: ("hexahedron", 8), 24: ("tetra10", 10), 25: ("hexahedron20", 20)}


@dataclass(frozen=True, repr=False)
class Body:
    """A connected mesh in the present state.

    `nodes` are rows of arrays of nodes, `centre` is that of its mass, `velocity` that of this
    centre, `spin` the angular momentum about it, in space (3,); `kinetic` and `strain` are its energies.
    """

    nodes: NDArray[np.intp]
    mass: float
    centre: NDArray[np.float64]
    velocity: NDArray[np.float64]
    spin: float | NDArray[np.float64]
    kinetic: float
    strain: float

    def __repr__(self) -> str:
        at, way = (np.array2string(x, precision=4, separator=", ")
                   for x in (self.centre, self.velocity))
        return (f"Body({len(self.nodes)} nodes, mass {self.mass:.4g}, centre {at}, velocity {way}, "
                f"kinetic {self.kinetic:.4g}, strain {self.strain:.4g})")


class Meshes:
    """The part of `Stepper` that tells mesh, fields and bodies. Arrays are copies."""

    _handle: Handle
    n_node: int
    n_element: int
    n_body: int

    # ---- mesh, sets, surfaces ---------------------------------------------------------------

    @property
    def cells(self) -> dict[str, NDArray[np.int32]]:
        """Rows of nodes of the elements, by the kind that meshio calls them, (m, k) each.

        ``meshio.Mesh(stepper.q, stepper.cells)`` and ``emcon.mesh`` take them; which elements they
        are tells `cell_elements`.
        """
        _, kind, node = self._elements()
        return {CELLS[k][0]: node[kind == k, :CELLS[k][1]] for k in np.unique(kind).tolist()}

    @property
    def cell_elements(self) -> dict[str, NDArray[np.intp]]:
        """Rows in arrays of elements of what `cells` tells, (m,) each."""
        kind = self._elements()[1]
        return {CELLS[k][0]: np.flatnonzero(kind == k) for k in np.unique(kind).tolist()}

    @property
    def element_labels(self) -> NDArray[np.int32]:
        """Element numbers of the deck, (n_element,)."""
        return self._elements()[0]

    def _elements(self) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
        found: tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]] = self._handle.call(
            _core.emcon_get_elements, self.n_element)
        return found

    def names(self) -> dict[str, list[str]]:
        """The names of "node sets", "element sets" and "surfaces"."""
        kinds = {"node set": "node sets", "element set": "element sets", "surface": "surfaces"}
        found: dict[str, list[str]] = {plural: [] for plural in kinds.values()}
        lines: str = self._handle.call(_names)
        for line in lines.split("\n"):
            for kind, plural in kinds.items():
                if line.startswith(f"{kind} "):
                    found[plural].append(line.removeprefix(f"{kind} "))
        return found

    def node_set(self, name: str) -> NDArray[np.intp]:
        """The rows of a node set in arrays of nodes, (k,). Raises `InputError` if there is none."""
        return np.flatnonzero(self._flags(_core.emcon_find_nodes, "node set", name, self.n_node))

    def element_set(self, name: str) -> NDArray[np.intp]:
        """The rows of an element set in arrays of elements, (k,); `InputError` if there is none."""
        return np.flatnonzero(
            self._flags(_core.emcon_find_elements, "element set", name, self.n_element))

    def surface(self, name: str) -> NDArray[np.intp]:
        """The faces of a surface: row of the element, and face from 1 as in the deck, (k, 2)."""
        flags = self._flags(_core.emcon_find_faces, "surface", name, self.n_element)
        return np.argwhere(flags) + (0, 1)

    def _flags(self, function: Callable[..., Any], what: str, name: str, n: int) -> Any:
        if not isinstance(name, str) or not name.strip() or "\0" in name:
            article = "an" if what[0] in "aeiou" else "a"
            raise InputError(f"{article} {what} has a name, not {name!r}")
        return self._handle.call(function, name.encode(), n)

    # ---- fields -----------------------------------------------------------------------------

    def field(self, variable: str) -> NDArray[np.float64]:
        """A variable of decks (docs/deck.md) in the present state, as the field file has it.

        (n_node,) or (n_node, k): U, V, RF, CSTR, CDIS, CF, S with von Mises stress as its last
        component; (n_element,) or (n_element, k): E, ENER. Raises `InputError` for others.
        """
        if not isinstance(variable, str):
            raise InputError(f"a variable is a word of decks, not {variable!r}")
        found: NDArray[np.float64] = self._handle.call(_field, variable.strip().encode())
        return found

    @property
    def stress(self) -> NDArray[np.float64]:
        """Cauchy stress 11, 22, 33, 12, 13, 23 at the nodes, (n_node, 6) [M/(L T^2)]."""
        return self.field("S")[:, :6]

    @property
    def von_mises(self) -> NDArray[np.float64]:
        """Von Mises stress at the nodes, (n_node,) [M/(L T^2)]."""
        return self.field("S")[:, 6]

    @property
    def strain_energy(self) -> NDArray[np.float64]:
        """Strain energy of each element, (n_element,) [M L^2/T^2]."""
        return self.field("ENER")

    @property
    def reactions(self) -> NDArray[np.float64]:
        """Forces of supports on the nodes, (n_node, n_dim) [M L/T^2]."""
        return self.field("RF")

    @property
    def contact_forces(self) -> NDArray[np.float64]:
        """Forces of contact on the nodes of both sides, (n_node, n_dim) [M L/T^2]."""
        return self.field("CF")

    # ---- bodies -----------------------------------------------------------------------------

    def bodies(self) -> list[Body]:
        """The bodies of the model, in the order of their first nodes, in the present state."""
        body = self._handle.call(_core.emcon_get_bodies, self.n_node)
        mass = self.mass                                                  # type: ignore[attr-defined]
        at, v = self.q, self.v                                              # type: ignore[attr-defined]
        share, momentum = mass @ np.ones(self.n_node), np.stack([mass @ along for along in v.T], 1)
        _, kind, node = self._elements()
        of_element = body[node[:, 0]] if len(kind) else np.empty(0, int)
        energy = self.strain_energy if len(kind) else np.empty(0)
        found = []
        for k in range(self.n_body):
            rows = np.flatnonzero(body == k)
            m = float(share[rows].sum())
            centre = share[rows] @ at[rows]/m if m > 0.0 else at[rows].mean(0)
            p = momentum[rows].sum(0)
            arm = at[rows] - centre
            spin = _cross(arm, momentum[rows]).sum(0)
            spin = float(spin) if spin.ndim == 0 else spin
            found.append(Body(rows, m, centre, p/m if m > 0.0 else 0.0*p, spin,
                              0.5*float((v[rows]*momentum[rows]).sum()),
                              float(energy[of_element == k].sum())))
        return found


def _cross(arm: NDArray[np.float64], vector: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vector products (k, 3), in the plane (k,)."""
    if arm.shape[1] == 3:
        return np.cross(arm, vector)
    product: NDArray[np.float64] = arm[:, 0]*vector[:, 1] - arm[:, 1]*vector[:, 0]
    return product


def _names(address: int) -> tuple[int, str]:
    status, place = _core.emcon_get_names(address)
    return status, "" if status else text(place)


def _field(address: int, name: bytes) -> tuple[int, NDArray[np.float64]]:
    status, n_place, n_component, place = _core.emcon_get_field(address, name)
    if status or not place:
        return status, np.empty((n_place, n_component))
    values = np.array(reals(place, n_place, n_component))
    return status, values[:, 0] if n_component == 1 else values
