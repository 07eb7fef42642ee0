"""The mesh: nodes, elements, sets and surfaces, all named by labels."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..deck_text import element_table, set_text, table, write_text
from .checks import (FAULTS, Array, Labels, MeshError, checked_name, corner_fault, kind_of,
                     label_array, places, point_of, positions, refuse_twice)
from .kinds import middles


class Mesh:
    """Nodes, elements, sets and surfaces.

    nodes           (n, 2) positions [L], or (n, 3)
    elements        by kind, as decks call it (CPE4, C3D10, ...): (m, k) node labels in the order of
                    docs/deck.md, in the plane counter-clockwise
    node_labels     (n,) whole numbers from 1 on, each once; default 1..n
    element_labels  by kind, (m,); default 1.. in the order of `elements`
    node_sets       by name, (k,) node labels
    element_sets    by name, (k,) element labels
    surfaces        by name, (k, 2) rows of element label and face from 1; in the plane face i goes
                    from corner i to the next

    The attributes have the same names and shapes. Names are kept in capitals, as decks do not
    distinguish case. Positions, elements and labels do not change once the mesh is made: `move`,
    `rotate`, `scale`, `mirror` and `+` give new meshes.

    Raises `MeshError` for wrong shapes, positions that are not finite, labels that are missing or
    used twice, nodes without element, elements in the plane beside others in space, and elements
    without area or volume, folded, or numbered clockwise or as their mirror image.
    """

    def __init__(self, nodes: ArrayLike, elements: Mapping[str, ArrayLike], *,
                 node_labels: ArrayLike | None = None,
                 element_labels: Mapping[str, ArrayLike] | None = None,
                 node_sets: Mapping[str, ArrayLike] | None = None,
                 element_sets: Mapping[str, ArrayLike] | None = None,
                 surfaces: Mapping[str, ArrayLike] | None = None) -> None:
        self.nodes: Array = positions(nodes)
        n, self.n_dim = self.nodes.shape
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
            shape = kind_of(kind)
            if shape.n_dim != self.n_dim:
                raise MeshError(f"elements of {kind} have nodes with {shape.n_dim} coordinates, "
                                f"not {self.n_dim}")
            array = label_array(nodes, f"elements[{kind!r}]", (None, shape.n_node))
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
            fault = corner_fault(self.nodes[self.rows(nodes[:, :kind_of(kind).n_corner])])
            for code, text in enumerate(FAULTS[self.n_dim], 1):
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
        """Elements of one kind as rows of `nodes`, from 0: (m, k)."""
        return self.rows(self.elements[kind])

    def faces_of(self, labels: ArrayLike) -> NDArray[np.int64]:
        """Number of faces of each element, same shape. Raises `MeshError` for unknown labels."""
        known = np.concatenate(list(self.element_labels.values()))
        count = np.repeat([len(kind_of(k).faces) for k in self.elements],
                          [len(e) for e in self.elements.values()])
        found: Labels = count[places(known, np.argsort(known, kind="stable"), labels, "element")]
        return found

    def all_faces(self) -> tuple[Labels, Labels]:
        """Faces of all elements: (k, 2) element and face; labels of its corners.

        These are (k, 2) in the plane, (k, 4) in space, the last one 0 where a face has three.
        """
        faces, ends = [], []
        width = 2 if self.n_dim == 2 else 4
        for kind, nodes in self.elements.items():
            for i, corners in enumerate(kind_of(kind).faces):
                label = self.element_labels[kind]
                faces.append(np.column_stack([label, np.full(len(label), i + 1)]))
                at = np.zeros((len(label), width), dtype=np.int64)
                at[:, :len(corners)] = nodes[:, list(corners)]
                ends.append(at)
        return np.concatenate(faces), np.concatenate(ends)

    def boundary(self, where: Callable[..., ArrayLike] | None = None) -> Labels:
        """Free faces as (k, 2) rows of element and face, for `add_surface`.

        where   function of x and y, in space of x, y and z, all (k,) [L], that gives truth values
                (k,): a face counts if all its corners do; default all free faces
        """
        faces, ends = self.all_faces()
        _, inverse, count = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True,
                                      return_counts=True)
        chosen = count[inverse.ravel()] == 1
        if where is not None:
            known = np.where(ends > 0, ends, ends[:, :1])
            chosen &= self._true_at(where)[self.rows(known)].all(axis=1)
        found: Labels = faces[chosen]
        return found

    def nodes_where(self, where: Callable[..., ArrayLike]) -> Labels:
        """Labels (k,) of the nodes at which `where(x, y)` is true, for `add_node_set`.

        In space `where(x, y, z)`.
        """
        return self.node_labels[self._true_at(where)]

    def _true_at(self, where: Callable[..., ArrayLike]) -> NDArray[np.bool_]:
        return np.broadcast_to(np.asarray(where(*self.nodes.T), dtype=bool), len(self.nodes))

    def surface_nodes(self, name: str) -> Labels:
        """Labels (k,) of the nodes of a surface, each once, ascending."""
        wanted = self.surfaces[name.upper()]
        found = [np.empty(0, np.int64)]
        for kind, nodes in self.elements.items():
            for i in range(len(kind_of(kind).faces)):
                chosen = np.isin(self.element_labels[kind], wanted[wanted[:, 1] == i + 1, 0])
                found.append(nodes[chosen][:, kind_of(kind).face_nodes(i)].ravel())
        return np.unique(np.concatenate(found))

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

    def move(self, *by: float) -> Mesh:
        """Shifted by dx, dy, in space dx, dy, dz [L]."""
        return self._with(self.nodes + point_of(by, "the way", self.n_dim))

    def rotate(self, angle: float, centre: ArrayLike | None = None,
               axis: ArrayLike = (0.0, 0.0, 1.0)) -> Mesh:
        """Turned by `angle` [rad] about `centre` (2,) [L], default the origin.

        In space about the axis through `centre` (3,) along `axis` (3,), of any length.
        """
        c, s = math.cos(angle), math.sin(angle)
        arm = self.nodes - self._point(centre)
        if self.n_dim == 2:
            return self._with(self._point(centre) + arm @ np.array([[c, s], [-s, c]]))
        e = point_of(axis, "axis", 3)
        if not np.linalg.norm(e) > 0.0:
            raise MeshError("the axis of a turn is 0")
        e = e/np.linalg.norm(e)
        turned = c*arm + s*np.cross(e, arm) + (1.0 - c)*np.outer(arm @ e, e)
        return self._with(self._point(centre) + turned)

    def _point(self, centre: ArrayLike | None) -> Array:
        return point_of(np.zeros(self.n_dim) if centre is None else centre, "centre", self.n_dim)

    def scale(self, factor: ArrayLike, centre: ArrayLike | None = None) -> Mesh:
        """Stretched from `centre` [L], default the origin, by one factor, or by one along each axis.

        All are above 0.
        """
        by = np.broadcast_to(np.asarray(factor, dtype=float), self.n_dim)
        if not (by > 0.0).all():
            raise MeshError(f"factors are above 0, not {by}; `mirror` gives mirror images")
        return self._with(self._point(centre) + by*(self.nodes - self._point(centre)))

    def mirror(self, point: ArrayLike, direction: ArrayLike) -> Mesh:
        """Mirror image in the line through `point` (2,) [L] along `direction` (2,).

        In space in the plane through `point` (3,) that `direction` (3,) is square to. Elements
        begin at the same corner and are turned; surfaces keep their places.
        """
        along = point_of(direction, "direction", self.n_dim)
        if not np.abs(along).max() > 0.0:
            raise MeshError("the direction of the mirror line is 0")
        along = along/np.abs(along).max()
        along = along/np.linalg.norm(along)
        start = point_of(point, "point", self.n_dim)
        arm = self.nodes - start
        image = 2.0*np.outer(arm @ along, along) - arm
        image = start + (image if self.n_dim == 2 else -image)
        turned = {k: e[:, kind_of(k).mirrored] for k, e in self.elements.items()}
        faces = {name: self.mirrored_faces(f) for name, f in self.surfaces.items()}
        return self._with(image, turned, faces)

    def mirrored_faces(self, faces: Labels) -> Labels:
        """Faces (k, 2), element and face, where elements are numbered as their mirror images."""
        found = np.array(faces)
        for kind, labels in self.element_labels.items():
            chosen = np.isin(faces[:, 0], labels)
            place = np.array(kind_of(kind).mirrored_faces)
            found[chosen, 1] = 1 + place[faces[chosen, 1] - 1]
        return found

    def retype(self, kinds: Mapping[str, str]) -> Mesh:
        """With elements of other kinds, `{old: new}`: of the same nodes, or quadratic for linear.

        The nodes between the corners then stand in the middle of straight edges, with labels above
        those that there are; they are in a node set where both ends of the edge are.
        """
        mesh = self
        for old, new in kinds.items():
            if old not in mesh.elements:
                raise MeshError(f"there are no elements of {old}; there are {_listed(mesh.elements)}")
        quadratic = {old for old, new in kinds.items()
                     if kind_of(new).n_node > kind_of(old).n_node}
        if quadratic and (quadratic != set(mesh.elements) or any(
                kind_of(old).n_node > kind_of(old).n_corner for old in quadratic)):
            raise MeshError("all elements of a mesh become quadratic, or none; they are linear before")
        for old, new in kinds.items():
            if kind_of(new).faces != kind_of(old).faces:
                raise MeshError(f"elements of {old} have another shape than those of {new}")
        return _with_middles(mesh, kinds) if quadratic else _retyped(mesh, kinds)

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
        if self.n_dim != other.n_dim:
            raise MeshError(f"a mesh of {self.n_dim} dimensions and one of {other.n_dim} make no mesh")
        own = np.concatenate(list(self.element_labels.values()))
        new = np.concatenate(list(other.element_labels.values()))
        node = _shift(self.node_labels, other.node_labels)
        element = _shift(own, new)
        kinds = sorted({*self.elements, *other.elements})
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
        parts = ["*NODE\n", table(self.node_labels, *self.nodes.T)]
        for kind, nodes in self.elements.items():
            parts += [f"*ELEMENT, TYPE={kind}\n", element_table(self.element_labels[kind], nodes)]
        for card, sets in (("NSET", self.node_sets), ("ELSET", self.element_sets)):
            parts += [set_text(card, name, labels) for name, labels in sets.items()]
        for name, faces in self.surfaces.items():
            parts.append(f"*SURFACE, NAME={name}, TYPE=ELEMENT\n")
            parts += [f"{element}, S{face}\n" for element, face in faces.tolist()]
        return "".join(parts)

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the mesh alone, for `*INCLUDE, INPUT=`; returns the path. May raise `OSError`."""
        return write_text(path, self.text())


# --- other kinds -------------------------------------------------------------------------------

def _retyped(mesh: Mesh, kinds: Mapping[str, str]) -> Mesh:
    """`mesh` with other words for its kinds."""
    elements: dict[str, list[Labels]] = {}
    labels: dict[str, list[Labels]] = {}
    for old, nodes in mesh.elements.items():
        elements.setdefault(kinds.get(old, old), []).append(nodes)
        labels.setdefault(kinds.get(old, old), []).append(mesh.element_labels[old])
    return Mesh(mesh.nodes, {k: np.concatenate(e) for k, e in elements.items()},
                node_labels=mesh.node_labels,
                element_labels={k: np.concatenate(e) for k, e in labels.items()},
                node_sets=mesh.node_sets, element_sets=mesh.element_sets, surfaces=mesh.surfaces)


def _with_middles(mesh: Mesh, kinds: Mapping[str, str]) -> Mesh:
    """`mesh` of linear elements with nodes in the middle of all edges."""
    ends = {old: middles(old, nodes) for old, nodes in mesh.elements.items()}
    pairs, place = np.unique(np.sort(np.concatenate([e.reshape(-1, 2) for e in ends.values()])),
                             axis=0, return_inverse=True)
    new = int(mesh.node_labels.max()) + 1 + np.arange(len(pairs))
    of_kind = np.split(new[place.ravel()], np.cumsum([e.shape[0]*e.shape[1]
                                                     for e in ends.values()])[:-1])
    elements = {kinds[old]: np.column_stack([mesh.elements[old], part.reshape(ends[old].shape[:2])])
                for (old, part) in zip(ends, of_kind, strict=True)}
    return Mesh(np.concatenate([mesh.nodes, mesh.nodes[mesh.rows(pairs)].mean(axis=1)]), elements,
                node_labels=np.concatenate([mesh.node_labels, new]),
                element_labels={kinds[old]: mesh.element_labels[old] for old in ends},
                node_sets={name: np.concatenate([s, new[np.isin(pairs, s).all(axis=1)]])
                           for name, s in mesh.node_sets.items()},
                element_sets=mesh.element_sets, surfaces=mesh.surfaces)


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
