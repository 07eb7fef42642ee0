"""The mesh: nodes, elements, sets and surfaces, all named by labels."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..deck_text import set_text, table, write_text
from .checks import (KINDS, Array, Labels, MeshError, checked_name, corner_fault, label_array,
                     places, point_of, positions, refuse_twice)


class Mesh:
    """Nodes, elements, sets and surfaces.

    nodes           (n, 2) positions [L]
    elements        by kind, CPE3 or CPE4: (m, 3) or (m, 4) node labels, counter-clockwise
    node_labels     (n,) whole numbers from 1 on, each once; default 1..n
    element_labels  by kind, (m,); default 1.. in the order of `elements`
    node_sets       by name, (k,) node labels
    element_sets    by name, (k,) element labels
    surfaces        by name, (k, 2) rows of element label and face 1..4; face i goes from corner i
                    to the next

    The attributes have the same names and shapes. Names are kept in capitals, as decks do not
    distinguish case. Positions, elements and labels do not change once the mesh is made: `move`,
    `rotate`, `scale`, `mirror` and `+` give new meshes.

    Raises `MeshError` for wrong shapes, positions that are not finite, labels that are missing or
    used twice, nodes without element, and elements without area, folded or numbered clockwise.
    """

    def __init__(self, nodes: ArrayLike, elements: Mapping[str, ArrayLike], *,
                 node_labels: ArrayLike | None = None,
                 element_labels: Mapping[str, ArrayLike] | None = None,
                 node_sets: Mapping[str, ArrayLike] | None = None,
                 element_sets: Mapping[str, ArrayLike] | None = None,
                 surfaces: Mapping[str, ArrayLike] | None = None) -> None:
        self.nodes: Array = positions(nodes)
        n = len(self.nodes)
        self.node_labels = label_array(np.arange(1, n + 1) if node_labels is None else node_labels,
                                   "node_labels", (n,))
        refuse_twice(self.node_labels, "node")
        self._node_order = np.argsort(self.node_labels, kind="stable")
        self.elements: dict[str, Labels] = {}
        self.element_labels: dict[str, Labels] = {}
        self._add_elements(elements, element_labels)
        self._check_elements()
        self.node_sets: dict[str, Labels] = {}
        self.element_sets: dict[str, Labels] = {}
        self.surfaces: dict[str, Labels] = {}
        for name, labels in (node_sets or {}).items():
            self.add_node_set(name, labels)
        for name, labels in (element_sets or {}).items():
            self.add_element_set(name, labels)
        for name, faces in (surfaces or {}).items():
            self.add_surface(name, faces)

    # --- making ----------------------------------------------------------------------------

    def _add_elements(self, elements: Mapping[str, ArrayLike],
                      labels: Mapping[str, ArrayLike] | None) -> None:
        if labels is not None and set(labels) != set(elements):
            raise MeshError(f"element_labels are of {_listed(labels)}, elements of "
                            f"{_listed(elements)}")
        first = 1
        for kind, nodes in elements.items():
            if kind not in KINDS:
                raise MeshError(f"{kind!r} is no kind of element; known are {_listed(KINDS)}")
            array = label_array(nodes, f"elements[{kind!r}]", (None, KINDS[kind]))
            if not len(array):
                continue
            self.elements[kind] = array
            self.element_labels[kind] = label_array(
                np.arange(first, first + len(array)) if labels is None else labels[kind],
                f"element_labels[{kind!r}]", (len(array),))
            first += len(array)
        if not self.elements:
            raise MeshError("the mesh has no elements")
        refuse_twice(np.concatenate(list(self.element_labels.values())), "element")

    def _check_elements(self) -> None:
        used = np.zeros(len(self.nodes), dtype=bool)
        for kind, nodes in self.elements.items():
            used[self.rows(nodes)] = True
            fault = corner_fault(self.nodes[self.rows(nodes)])
            for code, text in ((1, "has no area"), (2, "is numbered clockwise"),
                               (3, "is folded: the angle at a corner is 180 degrees or more")):
                bad = self.element_labels[kind][fault == code]
                if len(bad):
                    others = f" (and {len(bad) - 1} others)" if len(bad) > 1 else ""
                    raise MeshError(f"element {bad[0]} of {kind} {text}{others}")
        if not used.all():
            raise MeshError(f"node {self.node_labels[~used][0]} belongs to no element")

    def add_node_set(self, name: str, labels: ArrayLike) -> None:
        """Define, or define anew, a set of nodes (k,). Raises `MeshError` for unknown labels."""
        array = label_array(labels, f"node set {name}", (None,))
        self.rows(array)
        self.node_sets[checked_name(name)] = array

    def add_element_set(self, name: str, labels: ArrayLike) -> None:
        """Define, or define anew, a set of elements (k,). Raises `MeshError` for unknown ones."""
        array = label_array(labels, f"element set {name}", (None,))
        self.faces_of(array)
        self.element_sets[checked_name(name)] = array

    def add_surface(self, name: str, faces: ArrayLike) -> None:
        """Define, or define anew, a surface: (k, 2) rows of element label and face.

        Raises `MeshError` for elements and faces that are not there.
        """
        array = label_array(faces, f"surface {name}", (None, 2))
        count = self.faces_of(array[:, 0])
        if (array[:, 1] > count).any():
            element, face = array[array[:, 1] > count][0]
            raise MeshError(f"surface {name}: element {element} has no face {face}")
        self.surfaces[checked_name(name)] = array

    # --- asking ----------------------------------------------------------------------------

    def rows(self, labels: ArrayLike) -> NDArray[np.int64]:
        """Rows of `nodes` with these labels, same shape. Raises `MeshError` for unknown ones."""
        return places(self.node_labels, self._node_order, labels, "node")

    def connectivity(self, kind: str) -> NDArray[np.int64]:
        """Elements of one kind as rows of `nodes`, from 0: (m, 3) or (m, 4)."""
        return self.rows(self.elements[kind])

    def faces_of(self, labels: ArrayLike) -> NDArray[np.int64]:
        """Number of faces of each element, same shape. Raises `MeshError` for unknown labels."""
        known = np.concatenate(list(self.element_labels.values()))
        count = np.repeat([KINDS[k] for k in self.elements],
                          [len(e) for e in self.elements.values()])
        found: Labels = count[places(known, np.argsort(known, kind="stable"), labels, "element")]
        return found

    def all_faces(self) -> tuple[Labels, Labels]:
        """Faces of all elements: (k, 2) element and face; (k, 2) labels of its two nodes."""
        faces, ends = [], []
        for kind, nodes in self.elements.items():
            for i in range(KINDS[kind]):
                label = self.element_labels[kind]
                faces.append(np.column_stack([label, np.full(len(label), i + 1)]))
                ends.append(np.column_stack([nodes[:, i], nodes[:, (i + 1) % KINDS[kind]]]))
        return np.concatenate(faces), np.concatenate(ends)

    def boundary(self, where: Callable[[Array, Array], ArrayLike] | None = None) -> Labels:
        """Free faces as (k, 2) rows of element and face, for `add_surface`.

        where   function of x and y, both (k,) [L], that gives truth values (k,): a face counts if
                both its ends do; default all free faces
        """
        faces, ends = self.all_faces()
        _, inverse, count = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True,
                                      return_counts=True)
        chosen = count[inverse.ravel()] == 1
        if where is not None:
            chosen &= self._true_at(where)[self.rows(ends)].all(axis=1)
        found: Labels = faces[chosen]
        return found

    def nodes_where(self, where: Callable[[Array, Array], ArrayLike]) -> Labels:
        """Labels (k,) of the nodes at which `where(x, y)` is true, for `add_node_set`."""
        return self.node_labels[self._true_at(where)]

    def _true_at(self, where: Callable[[Array, Array], ArrayLike]) -> NDArray[np.bool_]:
        return np.broadcast_to(np.asarray(where(self.nodes[:, 0], self.nodes[:, 1]), dtype=bool),
                               len(self.nodes))

    def surface_nodes(self, name: str) -> Labels:
        """Labels (k,) of the nodes of a surface, each once, ascending."""
        faces, ends = self.all_faces()
        wanted = self.surfaces[name.upper()]
        key, chosen = (8*array[:, 0] + array[:, 1] for array in (faces, wanted))
        return np.unique(ends[np.isin(key, chosen)])

    def __repr__(self) -> str:
        elements = ", ".join(f"{len(nodes)} {kind}" for kind, nodes in self.elements.items())
        return f"Mesh({len(self.nodes)} nodes, {elements}; surfaces {_listed(self.surfaces)})"

    # --- changing --------------------------------------------------------------------------

    def _with(self, nodes: Array, elements: Mapping[str, ArrayLike] | None = None,
              surfaces: Mapping[str, ArrayLike] | None = None) -> Mesh:
        return Mesh(nodes, self.elements if elements is None else elements,
                    node_labels=self.node_labels, element_labels=self.element_labels,
                    node_sets=self.node_sets, element_sets=self.element_sets,
                    surfaces=self.surfaces if surfaces is None else surfaces)

    def move(self, dx: float, dy: float) -> Mesh:
        """Shifted by (dx, dy) [L]."""
        return self._with(self.nodes + np.array([dx, dy]))

    def rotate(self, angle: float, centre: ArrayLike = (0.0, 0.0)) -> Mesh:
        """Turned by `angle` [rad] about `centre` (2,) [L]."""
        c, s = math.cos(angle), math.sin(angle)
        arm = self.nodes - point_of(centre, "centre")
        return self._with(point_of(centre, "centre") + arm @ np.array([[c, s], [-s, c]]))

    def scale(self, factor: ArrayLike, centre: ArrayLike = (0.0, 0.0)) -> Mesh:
        """Stretched from `centre` (2,) [L] by one factor, or by two along x and y, all above 0."""
        by = np.broadcast_to(np.asarray(factor, dtype=float), 2)
        if not (by > 0.0).all():
            raise MeshError(f"factors are above 0, not {by}; `mirror` gives mirror images")
        return self._with(point_of(centre, "centre") + by*(self.nodes - point_of(centre, "centre")))

    def mirror(self, point: ArrayLike, direction: ArrayLike) -> Mesh:
        """Mirror image in the line through `point` (2,) [L] along `direction` (2,).

        Elements begin at the same corner and are turned; surfaces keep their places.
        """
        along = point_of(direction, "direction")
        if not np.abs(along).max() > 0.0:
            raise MeshError("the direction of the mirror line is 0")
        along = along/np.abs(along).max()
        along = along/np.linalg.norm(along)
        arm = self.nodes - point_of(point, "point")
        image = point_of(point, "point") + 2.0*np.outer(arm @ along, along) - arm
        turned = {k: np.column_stack([e[:, :1], e[:, :0:-1]]) for k, e in self.elements.items()}
        faces = {name: np.column_stack([f[:, 0], self.faces_of(f[:, 0]) + 1 - f[:, 1]])
                 for name, f in self.surfaces.items()}
        return self._with(image, turned, faces)

    def rename(self, names: Mapping[str, str]) -> Mesh:
        """With other names of sets and surfaces, `{old: new}`; raises `MeshError` for unknown."""
        new = {old.upper(): name for old, name in names.items()}
        groups = (self.node_sets, self.element_sets, self.surfaces)
        unknown = set(new) - {name for group in groups for name in group}
        if unknown:
            raise MeshError(f"no set or surface {_listed(sorted(unknown))}")
        renamed = [_renamed(group, new) for group in groups]
        return Mesh(self.nodes, self.elements, node_labels=self.node_labels,
                    element_labels=self.element_labels, node_sets=renamed[0],
                    element_sets=renamed[1], surfaces=renamed[2])

    def __add__(self, other: Mesh) -> Mesh:
        """Both meshes; nodes are not joined, even where they coincide.

        Labels of `other` that are taken are avoided by adding the largest one of this mesh to all
        of them. Raises `MeshError` where both have a set or a surface of one name.
        """
        if not isinstance(other, Mesh):
            return NotImplemented
        own = np.concatenate(list(self.element_labels.values()))
        new = np.concatenate(list(other.element_labels.values()))
        node = _shift(self.node_labels, other.node_labels)
        element = _shift(own, new)
        kinds = [k for k in KINDS if k in self.elements or k in other.elements]
        faces = {name: f + np.array([element, 0]) for name, f in other.surfaces.items()}
        return Mesh(
            np.concatenate([self.nodes, other.nodes]),
            _joined(kinds, self.elements, other.elements, node),
            node_labels=np.concatenate([self.node_labels, other.node_labels + node]),
            element_labels=_joined(kinds, self.element_labels, other.element_labels, element),
            node_sets=_united("node set", self.node_sets,
                              {k: v + node for k, v in other.node_sets.items()}),
            element_sets=_united("element set", self.element_sets,
                                 {k: v + element for k, v in other.element_sets.items()}),
            surfaces=_united("surface", self.surfaces, faces))

    # --- writing ---------------------------------------------------------------------------

    def text(self) -> str:
        """The mesh as cards of a deck: nodes, elements, sets, surfaces."""
        parts = ["*NODE\n", table(self.node_labels, self.nodes[:, 0], self.nodes[:, 1])]
        for kind, nodes in self.elements.items():
            parts += [f"*ELEMENT, TYPE={kind}\n", table(self.element_labels[kind], *nodes.T)]
        for card, sets in (("NSET", self.node_sets), ("ELSET", self.element_sets)):
            parts += [set_text(card, name, labels) for name, labels in sets.items()]
        for name, faces in self.surfaces.items():
            parts.append(f"*SURFACE, NAME={name}, TYPE=ELEMENT\n")
            parts += [f"{element}, S{face}\n" for element, face in faces.tolist()]
        return "".join(parts)

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the mesh alone, for `*INCLUDE, INPUT=`; returns the path. May raise `OSError`."""
        return write_text(path, self.text())


# --- joining -----------------------------------------------------------------------------------

def _shift(taken: Labels, new: Labels) -> int:
    return int(taken.max()) if np.isin(new, taken).any() else 0


def _joined(kinds: Iterable[str], one: Mapping[str, Labels], other: Mapping[str, Labels],
            shift: int) -> dict[str, Labels]:
    found: dict[str, Labels] = {}
    for kind in kinds:
        arrays = [one[kind]] if kind in one else []
        arrays += [other[kind] + shift] if kind in other else []
        found[kind] = np.concatenate(arrays)
    return found


def _united(what: str, one: Mapping[str, Labels], other: Mapping[str, Labels]
            ) -> dict[str, Labels]:
    both = sorted(set(one) & set(other))
    if both:
        raise MeshError(f"both meshes have a {what} {both[0]}; give one of them another name "
                        "(`name=` of the builder, or `rename`)")
    return {**one, **other}


def _renamed(group: Mapping[str, Labels], names: Mapping[str, str]) -> dict[str, Labels]:
    found: dict[str, Labels] = {}
    for old, labels in group.items():
        name = names.get(old, old).upper()
        if name in found:
            raise MeshError(f"two would have the name {name}")
        found[name] = labels
    return found


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names) or "none"
