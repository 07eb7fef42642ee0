"""The mesh of an Abaqus input file, with its labels, sets and surfaces.

Only the cards of the mesh are read; everything else is left to those who run the deck.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .checks import Labels, MeshError, kind_of
from .kinds import shape_of
from .mesh import Mesh
from .repair import add_lines, check_plane, fresh_name, turn_clockwise, warn

#: Families of plane elements: plane strain, plane stress, shells and membranes of a flat mesh.
_PLANE = re.compile(r"(?:CPE|CPS|CPEG|CAX|CGAX|M3D|STRI|S|R3D|SFM3D)(\d+)[A-Z]*\d*")
_LINE = re.compile(r"(?:T2D|T3D|B2|B3|R2D|RB2D|RB3D|RAX|SAX|F2D)(\d+)[A-Z]*")
_SOLID = re.compile(r"C3D(4|8|10|20)[A-Z]*")
#: Kinds in space that keep their name.
_OWN = ("C3D4", "C3D8", "C3D8H", "C3D8I", "C3D10", "C3D20", "C3D20R")
_MAX_DEPTH = 20


@dataclass
class _Card:
    """One keyword with parameters and data lines, each with its place `file:line`."""

    name: str
    options: dict[str, str]
    place: str
    data: list[tuple[str, list[str]]] = field(default_factory=list)

    def integers(self, place: str, words: list[str]) -> list[int]:
        try:
            return [int(word) for word in words]
        except ValueError:
            raise MeshError(f"{place}: a label is not a whole number: {', '.join(words)}"
                            ) from None


def read_abaqus(path: Path) -> Mesh:
    """The mesh in the file `path`; see `emcon.mesh.read`."""
    model = _Model(str(path))
    for card in _cards(path, 0):
        model.take(card)
    return model.mesh()


def _cards(path: Path, depth: int) -> Iterator[_Card]:
    """The cards of a file and of those that it includes."""
    if depth > _MAX_DEPTH:
        raise MeshError(f"{path}: files are nested deeper than {_MAX_DEPTH}")
    try:
        lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except FileNotFoundError:
        if depth == 0:
            raise
        raise MeshError(f"{path}, named by *INCLUDE, is not there") from None
    card: _Card | None = None
    goes_on = False
    for i, line in enumerate(lines, 1):
        text = line.strip()
        if not text or text.startswith("**"):
            continue
        words = [word.strip() for word in text.rstrip(",").split(",")]
        if text.startswith("*"):
            if card is not None:
                yield from _opened(card, path, depth)
            card = _Card(re.sub(r"\s", "", words[0][1:]).upper(), {}, f"{path}:{i}")
            words = words[1:]
        if text.startswith("*") or (card is not None and goes_on):
            assert card is not None
            for word in words:
                key, _, value = word.partition("=")
                card.options[re.sub(r"\s", "", key).upper()] = value.strip().strip("\"'")
            goes_on = text.endswith(",")
        elif card is not None:
            card.data.append((f"{path}:{i}", words))
    if card is not None:
        yield from _opened(card, path, depth)


def _opened(card: _Card, path: Path, depth: int) -> Iterator[_Card]:
    if card.name == "INCLUDE":
        yield from _cards(path.parent/card.options.get("INPUT", ""), depth + 1)
    else:
        yield card


class _Model:
    """What the cards define, by label."""

    def __init__(self, source: str) -> None:
        self.source = source
        self.node: dict[int, list[float]] = {}
        self.element: dict[int, list[int]] = {}       # solids, those in the plane, lines
        self.kind: dict[int, str] = {}                # of each; "" of a line
        self.node_set: dict[str, list[int]] = {}
        self.element_set: dict[str, list[int]] = {}
        self.surface: dict[str, list[tuple[str, list[str]]]] = {}

    def take(self, card: _Card) -> None:
        reader = {"NODE": self._node, "ELEMENT": self._element, "NSET": self._set,
                  "ELSET": self._set, "SURFACE": self._surface}.get(card.name)
        if card.name in ("PART", "ASSEMBLY", "INSTANCE"):
            raise MeshError(f"{card.place}: *{card.name}: write the file without parts and "
                            "assemblies, as a flat deck (an attribute of the model in Abaqus/CAE)")
        if card.name == "SYSTEM" and card.data:
            raise MeshError(f"{card.place}: *SYSTEM: coordinates must be those of the global axes")
        if reader is not None:
            reader(card)

    def _node(self, card: _Card) -> None:
        if card.options.get("SYSTEM", "R").upper() != "R":
            raise MeshError(f"{card.place}: *NODE, SYSTEM=: only rectangular coordinates are read")
        for place, words in card.data:
            (label,) = card.integers(place, words[:1])
            try:
                x = [float(re.sub("[dD]", "e", word or "0")) for word in words[1:4]]
            except ValueError:
                raise MeshError(f"{place}: a coordinate is not a number") from None
            if label in self.node:
                raise MeshError(f"{place}: node {label} is there twice")
            self.node[label] = x + [0.0]*(3 - len(x))
            self._join(self.node_set, card.options.get("NSET"), [label])

    def _element(self, card: _Card) -> None:
        kind, n = self._kind(card)
        words: list[str] = []
        for place, more in card.data:
            words += more
            if len(words) < n + 1:
                continue
            label, *nodes = card.integers(place, words)
            if len(nodes) > n:
                raise MeshError(f"{place}: element {label} has {len(nodes)} nodes where {n} are "
                                "due")
            if label in self.element:
                raise MeshError(f"{place}: element {label} is there twice")
            missing = [k for k in nodes if k not in self.node]
            if missing:
                raise MeshError(f"{place}: element {label} names node {missing[0]}, which is not "
                                "there")
            self.element[label] = nodes
            self.kind[label] = kind
            self._join(self.element_set, card.options.get("ELSET"), [label])
            words = []
        if words:
            raise MeshError(f"{card.place}: the last element has too few nodes")

    def _kind(self, card: _Card) -> tuple[str, int]:
        """The kind that elements become, "" for lines, and how many nodes they have."""
        kind = card.options.get("TYPE", "").upper()
        solid = _SOLID.fullmatch(kind)
        if solid:
            return kind if kind in _OWN else f"C3D{solid[1]}", int(solid[1])
        plane, line = _PLANE.fullmatch(kind), _LINE.fullmatch(kind)
        if line:
            # beams are counted otherwise: B21 and B31 are straight, B22 and B32 curved
            count = int(line[1]) + (1 if kind.startswith("B") else 0)
        elif plane:
            # S4R5 and its like: the first digit counts
            count = int(plane[1]) if not kind.startswith("STRI") else (6 if "65" in kind else 3)
        else:
            raise MeshError(f"{card.place}: EMCON has no elements of the kind {kind or '(none)'}")
        if count > 3 if line else not shape_of(f"CPE{count}"):
            raise MeshError(f"{card.place}: EMCON has no elements of the kind {kind}")
        return "" if line else f"CPE{count}", count

    @staticmethod
    def _join(sets: dict[str, list[int]], name: str | None, labels: list[int]) -> None:
        if name:
            sets.setdefault(name.upper(), []).extend(labels)

    def _set(self, card: _Card) -> None:
        sets = self.node_set if card.name == "NSET" else self.element_set
        known = self.node if card.name == "NSET" else self.element
        name = card.options.get(card.name, "")
        if not name:
            raise MeshError(f"{card.place}: *{card.name} without a name")
        if card.name == "NSET" and "ELSET" in card.options:
            of = self.element_set.get(card.options["ELSET"].upper(), [])
            self._join(sets, name, sorted({k for e in of for k in self.element[e]}))
        for place, words in card.data:
            if "GENERATE" in card.options:
                first, last, *step = card.integers(place, words)
                found = [k for k in range(first, last + 1, step[0] if step else 1) if k in known]
            else:
                found = [k for word in words if word for k in self._members(place, word, sets)]
            absent = [k for k in found if k not in known]
            if absent:
                raise MeshError(f"{place}: {name} names {absent[0]}, which is not there")
            self._join(sets, name, found)

    @staticmethod
    def _members(place: str, word: str, sets: dict[str, list[int]]) -> list[int]:
        """The label `word`, or the members of the set of that name."""
        if word.isdigit():
            return [int(word)]
        name = word.strip("\"'").upper()
        if name not in sets:
            raise MeshError(f"{place}: there is no set {name}")
        return sets[name]

    def _surface(self, card: _Card) -> None:
        name = card.options.get("NAME", "").upper()
        if card.options.get("TYPE", "ELEMENT").upper() == "ELEMENT" and name:
            self.surface.setdefault(name, []).extend(card.data)
        else:
            warn(f"{card.place}: the surface {name} is not one of element faces; left out")

    # --- the mesh --------------------------------------------------------------------------

    def mesh(self) -> Mesh:
        """All that was defined, as a mesh."""
        found = sorted({kind for kind in self.kind.values() if kind})
        if not found:
            raise MeshError(f"{self.source} has no elements in the plane or in space")
        n_dim = max(kind_of(kind).n_dim for kind in found)
        kinds = [kind for kind in found if kind_of(kind).n_dim == n_dim]
        plane = {e: nodes for e, nodes in self.element.items() if self.kind[e] in kinds}
        elements, labels = {}, {}
        for kind in kinds:
            chosen = {label: nodes for label, nodes in plane.items() if self.kind[label] == kind}
            labels[kind] = np.array(list(chosen), dtype=np.int64)
            elements[kind] = np.array(list(chosen.values()), dtype=np.int64)
        used = np.unique(np.concatenate([nodes.ravel() for nodes in elements.values()]))
        if len(used) < len(self.node):
            warn(f"{self.source}: {len(self.node) - len(used)} nodes belong to no element; "
                 "left out")
        kept = set(used.tolist())
        order = np.array([label for label in self.node if label in kept], dtype=np.int64)
        x = np.array([self.node[label] for label in order.tolist()])
        if n_dim == 2:
            check_plane(self.source, x)
        elif not np.isfinite(x).all():
            raise MeshError(f"{self.source}: a coordinate is not finite")
        ascending = np.argsort(order)
        turned = turn_clockwise(self.source, x[ascending, :n_dim], order[ascending], elements, labels)
        mesh = Mesh(x[:, :n_dim], elements, node_labels=order, element_labels=labels)
        self._add_sets(mesh, plane, kept)
        for name, data in self.surface.items():
            faces = self._faces(mesh, data, plane, turned)
            if len(faces):
                mesh.add_surface(fresh_name(mesh.surfaces, self.source, name), faces)
        return mesh

    def _add_sets(self, mesh: Mesh, plane: dict[int, list[int]], kept: set[int]) -> None:
        """Sets of elements; those of lines become surfaces and node sets."""
        node_set = dict(self.node_set)
        for name, members in self.element_set.items():
            solid = list(dict.fromkeys(e for e in members if e in plane))
            if solid:
                mesh.add_element_set(fresh_name(mesh.element_sets, self.source, name), solid)
            other = [e for e in members if e not in plane]
            lines = [row for row in (self._side(e, mesh.n_dim) for e in other) if row]
            if other and name not in self.surface:
                if len(lines) == len(other):
                    add_lines(mesh, self.source, name, np.array(lines))
                node_set.setdefault(name, sorted({k for e in other for k in self.element[e]}))
        for name, members in node_set.items():
            inside = list(dict.fromkeys(k for k in members if k in kept))
            if inside:
                mesh.add_node_set(fresh_name(mesh.node_sets, self.source, name), inside)

    def _side(self, e: int, n_dim: int) -> list[int]:
        """Corners of a line or, in space, of a face, 0 behind three; none for what is no side."""
        kind, nodes = self.kind[e], self.element[e]
        if n_dim == 2:
            return nodes[:2]
        if not kind:
            return []
        return (nodes[:kind_of(kind).n_corner] + [0])[:4]

    def _faces(self, mesh: Mesh, data: list[tuple[str, list[str]]],
               plane: dict[int, list[int]], turned: set[int]) -> Labels:
        """Rows (element, face) of a surface; without a face the free ones of the elements."""
        rows: list[tuple[int, int]] = []
        free: Labels | None = None
        for place, words in data:
            members = [e for e in self._members(place, words[0], self.element_set) if e in plane]
            if len(words) < 2 or not words[1]:
                free = mesh.boundary() if free is None else free
                rows += [(int(e), int(f)) for e, f in free if e in set(members)]
                continue
            if not re.fullmatch(r"S[1-6]", words[1].upper()):
                raise MeshError(f"{place}: {words[1]} is not a face of an element, S1 to S6")
            face = int(words[1][1])
            short = [e for e in members if len(kind_of(self.kind[e]).faces) < face]
            if short:
                raise MeshError(f"{place}: element {short[0]} has no face S{face}")
            rows += [(e, 1 + kind_of(self.kind[e]).mirrored_faces[face - 1] if e in turned else face)
                     for e in members]
        return np.array(rows, dtype=np.int64).reshape(-1, 2)
