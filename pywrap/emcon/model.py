"""The model: what is to be analysed, as in a deck. A `Stepper` analyses it.

    nodes = [[0, 0], [1, 0], [1, 1], [0, 1]]
    model = Model.from_arrays(nodes, [[0, 1, 2, 3]], heading="A square, pulled at a corner")
    model.material("RUBBER", coupled_neo_hooke=(100.0, 0.3)).section("RUBBER")
    model.boundary(0, (1, 2)).boundary(1, 2)
    step = model.step("STATIC", h=0.5, nlgeom=True)
    step.load(2, 2, 1.0)
    with model.stepper() as square:
        square.step()
    model.write("square.inp")                 # for `emcon run`

Messages about the model name the lines of Python that made its cards.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .cards import Dof, Number, Where, array_of, card, real, text_lines, whole
from .deck_text import element_table, set_text, table, write_text
from .derivatives import check_law
from .errors import InputError
from .given import PointFunction, Solid, check_function, check_solid
from .options import LAWS, words
from .source import Source, parameter_text
from .stepper import Stepper
from .steps import Step

if TYPE_CHECKING:
    from .mesh import Mesh

#: The interaction of pairs that name none.
_FRICTIONLESS = "FRICTIONLESS CONTACT"
#: Nodes of an element, by kind.
KINDS = {word: int(re.sub("C(PE|PS|AX|3D)|[A-Z]", "", word)) for word in words("element")}


class Model(Source):
    """A scene: mesh, sets, materials, contact, steps; made of a deck, a mesh, arrays or calls.

    Each method adds one card, which docs/deck.md explains. In place of a number, `"<name>"` stands
    for a parameter of the deck. Errors name the line of Python that made the card:
    ``study.py:42: error: ...``.

    Nodes and elements are counted from 0 in the order in which `add_nodes` and `add_elements` (or
    `from_arrays`) give them; row i has the label i + 1, in messages and results, unless labels are
    given. In a model of a deck or of a `Mesh` they are named by their labels.

    Lengths are in any unit [L], masses [M] and times [T] likewise.
    """

    def __init__(self, heading: str = "") -> None:
        super().__init__()
        self._has_frictionless = False
        if heading:
            self.heading(heading)

    # --- making ----------------------------------------------------------------------------

    @classmethod
    def from_arrays(cls, nodes: ArrayLike,
                    elements: ArrayLike | Mapping[str, ArrayLike] | None = None, *,
                    node_labels: ArrayLike | None = None,
                    element_labels: ArrayLike | Mapping[str, ArrayLike] | None = None,
                    heading: str = "") -> Model:
        """The model of one mesh, with the sets ALL of its nodes and of its elements.

        nodes            (n, 2) positions [L], or (n, 3)
        elements         (m, 3) or (m, 4) rows of `nodes`, counter-clockwise; or by kind, a word of
                         `emcon.options.words("element")`: CPE4H, C3D8, ...; None where
                         `given_forces` stand for elements
        node_labels      (n,) whole numbers from 1 on, each once; default 1..n
        element_labels   (m,), or by kind; default 1.. in the order of `elements`
        """
        model = cls(heading)
        model.add_nodes(nodes, labels=node_labels)
        if elements is None:
            elements = {}
        kinds = elements if isinstance(elements, Mapping) else {"": elements}
        labels = (element_labels if isinstance(element_labels, Mapping)
                  else {kind: element_labels for kind in kinds})
        if element_labels is not None and (isinstance(element_labels, Mapping)
                                           != isinstance(elements, Mapping)
                                           or set(labels) != set(kinds)):
            raise InputError("element_labels have the kinds of elements: "
                             f"{', '.join(map(repr, kinds))}")
        for kind, corners in kinds.items():
            if kind and kind not in KINDS:
                raise InputError(f"{kind!r} is no kind of element; known are "
                                 f"{', '.join(words('element'))}")
            array = array_of(corners, "elements")
            if kind and array.ndim == 2 and array.shape[1] != KINDS[kind]:
                raise InputError(f"elements of {kind} have {KINDS[kind]} nodes, not "
                                 f"{array.shape[1]}")
            model.add_elements(array, labels=labels[kind], kind=kind or None)
        return model

    @classmethod
    def from_mesh(cls, mesh: Mesh, heading: str = "", *,
                  parameters: Mapping[str, float | str] | None = None) -> Model:
        """The model of a mesh with its sets and surfaces, and a heading and `*PARAMETER` before it.

        Nodes and elements are named by the labels of the mesh; the sets ALL hold all nodes and all
        elements, unless the mesh has sets of this name. `parameters`: see `parameter`.
        """
        model = cls._labelled()
        if heading:
            model.heading(heading)
        if parameters:
            model.parameter(**parameters)
        model._nodes.n_dim = mesh.n_dim
        model._add(mesh.text())
        for card, sets, labels in (
                ("NSET", mesh.node_sets, mesh.node_labels),
                ("ELSET", mesh.element_sets, np.concatenate([*mesh.element_labels.values()]))):
            if not any(name.upper() == "ALL" for name in sets):
                model._add(set_text(card, "ALL", labels))
        return model

    def __repr__(self) -> str:
        cards = re.findall(r"^\*(?!\*)([^,\n]+)", "".join(b.text for b in self._all_blocks()),
                           re.MULTILINE)
        count = {card.strip().upper(): cards.count(card) for card in cards}
        return f"Model({', '.join(f'{n} {card}' for card, n in count.items()) or 'empty'})"

    # --- text and parameters ---------------------------------------------------------------

    def heading(self, text: str) -> Model:
        """`*HEADING`: text that goes to the log of a run."""
        lines = text_lines(text)
        if any(line.lstrip().startswith("*") for line in lines):
            raise InputError("a line of a heading does not begin with a star")
        self._add("\n".join(["*HEADING", *lines]) + "\n")
        return self

    def parameter(self, **values: float | str) -> Model:
        """`*PARAMETER`: values of `"<name>"` in what follows, which `emcon run --set` may change.

        Numbers, or text as it stands in a deck: `60./n`, `NULL SPACE`.
        """
        self._add("*PARAMETER\n" + "".join(f"{name} = {parameter_text(name, value)}\n"
                                           for name, value in values.items()))
        return self

    # --- mesh ------------------------------------------------------------------------------

    def add_nodes(self, positions: ArrayLike, *, labels: ArrayLike | None = None,
                  name: str = "ALL") -> NDArray[np.int64]:
        """`*NODE`: nodes at positions (n, 2) or (n, 3) [L], in the node set `name`.

        Returns their rows (n,).

        labels   (n,) whole numbers from 1 on; required in a model of a deck or a `Mesh`, which
                 gets labels back
        """
        x = real(positions, "nodes")
        if x.ndim != 2 or x.shape[1] not in (2, 3):
            raise InputError(f"nodes are an (n, 2) or (n, 3) array of positions, not {x.shape}")
        if self._nodes.count and x.shape[1] != self._nodes.n_dim:
            raise InputError(f"nodes have {x.shape[1]} coordinates here, and {self._nodes.n_dim} "
                             "before")
        self._nodes.n_dim = x.shape[1]
        head = card("NODE", {"NSET": name})
        first = self._nodes.count
        label = self._nodes.extend(len(x), labels)
        self._add(head + (table(label, *x.T) if len(x) else ""))
        return np.arange(first, first + len(x)) if self._nodes.rows else label

    def add_elements(self, corners: ArrayLike, *, labels: ArrayLike | None = None,
                     name: str = "ALL", kind: str | None = None) -> NDArray[np.int64]:
        """`*ELEMENT`: elements of three nodes (m, 3), CPE3, or of four (m, 4), CPE4, or of a kind.

        corners   nodes, counter-clockwise, in space as docs/deck.md counts them; of quadratic
                  kinds with those between them behind
        labels    (m,), as with `add_nodes`
        name      of the element set that they are in
        kind      a word of `emcon.options.words("element")`: CPE4H, CPS4, C3D8, C3D20R, ...

        Returns the rows (m,) of the elements.
        """
        array = array_of(corners, "elements")
        n = array.shape[-1] if array.ndim == 2 else 0
        if kind is not None and n != KINDS.get(kind):
            raise InputError(f"elements of {kind} are an (m, {KINDS[kind]}) array of nodes, not "
                             f"{array.shape}" if kind in KINDS else f"{kind!r} is no kind of "
                             f"element; known are {', '.join(words('element'))}")
        if kind is None and self._nodes.n_dim == 3:
            raise InputError("elements of nodes with three coordinates have a kind: C3D8, ...")
        if kind is None and n not in (3, 4):
            raise InputError(f"elements are an (m, 3) or (m, 4) array of nodes, not {array.shape}")
        nodes = self._nodes.labels(array, "elements", (None, n))
        head = card("ELEMENT", {"TYPE": kind or f"CPE{n}", "ELSET": name})
        first = self._elements.count
        label = self._elements.extend(len(nodes), labels)
        self._add(head + (element_table(label, nodes) if len(nodes) else ""))
        return np.arange(first, first + len(nodes)) if self._elements.rows else label

    def surface(self, name: str, *, faces: ArrayLike | Sequence[tuple[Any, int]] | None = None,
                elements: Where | None = None, nodes: Where | None = None,
                edges: ArrayLike | None = None,
                segments: Sequence[tuple[Any, ...]] | None = None,
                fillet_radius: Number | None = None,
                stl: str | os.PathLike[str] | None = None, scale: Number | None = None) -> Model:
        """`*SURFACE`: of faces, of free faces of elements, of nodes, of edges, a profile, a file.

        faces      (k, 2): element (or element set) and face 1..4; face i of an element goes from
                   corner i to the next; in space 1..6, as docs/deck.md counts them
        elements   element set, or (k,) elements
        nodes      node set, or (k,) nodes; only for slave surfaces of NODE TO SURFACE
        edges      (k, 2): first and last node of each edge
        segments   ("START", x, y), then ("LINE", x, y) or ("CIRCL", x, y, xc, yc): lines and arcs
                   for `rigid_body(profile=)`, the body to the right [L]; `fillet_radius` [L] of
                   the arcs that corners between them get, default none
        stl        file of triangles in space, text or binary, beside the deck; for
                   `rigid_body(profile=)`; its lengths are `scale` (default 1) of the model's
        """
        given = [kind for kind, value in (("faces", faces), ("elements", elements),
                                          ("nodes", nodes), ("edges", edges),
                                          ("segments", segments), ("stl", stl))
                 if value is not None]
        if len(given) != 1:
            raise InputError(f"surface {name} is made of faces, elements, nodes, edges, segments "
                             f"or a file, one of them, not {len(given)}")
        if stl is not None:
            return self._card("SURFACE", {"NAME": name, "TYPE": "STL", "INPUT": os.fspath(stl),
                                          "SCALE": scale})
        what = f"surface {name}"
        rows: Sequence[Sequence[object]] = ()
        data = ""
        if edges is not None:
            ends = self._nodes.labels(edges, what, (None, 2))
            data = table(*ends.T) if len(ends) else ""
        elif segments is not None:
            rows = [tuple(row) for row in segments]
        elif faces is not None:
            rows = [(item, f"S{face}") for item, face in self._faces(faces, what)]
        elif elements is not None:
            rows = [(item,) for item in self._names(elements, self._elements, what)]
        elif nodes is not None:
            rows = [(item,) for item in self._names(nodes, self._nodes, what)]
        kind = {"edges": "EDGE", "nodes": "NODE", "segments": "SEGMENTS"}.get(given[0], "ELEMENT")
        return self._card("SURFACE", {"NAME": name, "TYPE": kind, "FILLET RADIUS": fillet_radius},
                          rows, data)

    def _faces(self, faces: ArrayLike | Sequence[tuple[Any, int]],
               what: str) -> list[tuple[str | int, int]]:
        if isinstance(faces, np.ndarray):
            array = whole(faces, what, (None, 2))
            pairs: list[Any] = list(zip(self._elements.labels(array[:, 0], what).tolist(),
                                        array[:, 1].tolist()))
        else:
            pairs = [tuple(pair) if isinstance(pair, (list, tuple, np.ndarray)) else ()
                     for pair in cast("Sequence[Any]", faces)]
            if any(len(pair) != 2 for pair in pairs):
                raise InputError(f"{what}: faces are pairs of an element or an element set and a "
                                 "face")
            pairs = [(self._names(item, self._elements, what)[0], face) for item, face in pairs]
        wrong = [face for _, face in pairs if np.ndim(face) or face not in range(1, 7)]
        if wrong or not pairs:
            raise InputError(f"{what}: a face is 1 to 6, not {wrong[0]!r}" if wrong
                             else f"{what} has no faces")
        return [(item, int(face)) for item, face in pairs]

    # --- materials -------------------------------------------------------------------------

    def material(self, name: str, *, density: Number | None = None,
                 damping: tuple[Number, Number] | None = None,
                 user: Sequence[Number] | None = None, law: PointFunction | None = None,
                 **constants: Sequence[Number] | None) -> Model:
        """`*MATERIAL` with one law, or none where bodies are rigid; stresses in [M/(L T^2)].

        density             [M/L^3]; required in dynamic steps and for gravity
        damping             by mass [1/T] and by moduli [T]: `*DAMPING, ALPHA=, BETA=`
        constants           those of a law of the library, `elastic=(E, nu)`, by the name of the law:
                            `emcon.options.LAWS` and docs/deck.md list them
        law                 a function of strains (n, 3), E11, E22, 2 E12 of Green and Lagrange (the
                            small ones without NLGEOM), that returns energies per reference volume
                            (n,), stresses (n, 3) and tangents (n, 3, 3), the first and second
                            derivatives; in three dimensions of strains (n, 6), E11, E22, E33,
                            2 E12, 2 E23, 2 E13. Checked here by differences, see `check_derivatives`
        user                constants (k,) of `*USER MATERIAL`, for decks of other programs; the law
                            does not see them
        """
        if law is not None and user is None:
            user = ()
        given = {key: values for key, values in {**constants, "user": user}.items()
                 if values is not None}
        known = {row.argument for row in LAWS.values()}
        unknown = sorted(set(given) - known - {"user"})
        if unknown:
            raise InputError(f"material {name}: there is no law {unknown[0]!r}; known are "
                             f"{', '.join(sorted(known))}")
        if len(given) > 1:
            raise InputError(f"material {name} has one law, not {len(given)}")
        text = card("MATERIAL", {"NAME": name})
        for chosen, values in given.items():
            if isinstance(values, (int, float)):
                values = (values,)
            numbers = list(values)
            kind, options = _law_card(name, chosen, len(numbers))
            text += card(kind, options, [numbers[k:k + 8] for k in range(0, len(numbers), 8)])
        if law is not None:
            self.give_law(name, law)
        if damping is not None:
            text += card("DAMPING", dict(zip(("ALPHA", "BETA"), damping, strict=True)))
        self._add(text if density is None else text + card("DENSITY", rows=[(density,)]))
        return self

    def section(self, material: str, elements: str = "ALL", *, thickness: Number = 1.0,
                kinematics: str | None = None, massless: bool = False,
                orientation: str | None = None) -> Model:
        """`*SOLID SECTION`: an element set is of a material, of `thickness` [L].

        kinematics    NONLINEAR (default), as the steps say; LINEAR: small strains in all steps;
                      COROTATED: the same in frames that turn with the elements
        massless      no inertia in dynamic steps: a quasi-static part
        orientation   axes of a material with directions
        """
        return self._card("SOLID SECTION", {"ELSET": elements, "MATERIAL": material,
                                            "KINEMATICS": kinematics, "MASSLESS": massless,
                                            "ORIENTATION": orientation}, [(thickness,)])

    def orientation(self, name: str, a: Sequence[Number], b: Sequence[Number]) -> Model:
        """`*ORIENTATION`: axes of a material, for `section`.

        a, b    points on the first axis, and on the second side of it, from the origin; x, y, z
        """
        return self._card("ORIENTATION", {"NAME": name, "SYSTEM": "RECTANGULAR"}, [(*a, *b)])

    def rigid_body(self, elements: str | None, reference: int | str, *,
                   nodes: str | None = None, profile: str | None = None) -> Model:
        """`*RIGID BODY`: an element set that keeps its shape, a set of nodes, a profile, or some of these.

        reference   node, or set of one, that is prescribed, loaded and started: in the plane degrees
                    of freedom 1, 2 and 6, in three dimensions 1 to 6
        nodes       node set that moves as a rigid body, with the elements that have no other nodes;
                    the nodes of a face of an elastic body are a rigid end
        profile     surface of segments, or a wall; without elements it is prescribed in every step
        """
        (name,) = self._names(reference, self._nodes, "*RIGID BODY")
        return self._card("RIGID BODY", {"ELSET": elements, "NSET": nodes,
                                         "ANALYTICAL SURFACE": profile, "REF NODE": name})

    def initial(self, type: Literal["VELOCITY", "DISPLACEMENT"], where: Where, dof: Dof,
                value: Number | ArrayLike) -> Model:
        """`*INITIAL CONDITIONS`: velocities [L/T] or displacements [L] at the start.

        dof     1, 2, 3 or some of them; of the reference node of a rigid body 6, in three
                dimensions 4, 5 and 6 too: spins [1/T]
        value   one for all, (n_dof,), or (k, n_dof) for k nodes
        """
        self._valued("INITIAL CONDITIONS", where, dof, value, {"TYPE": type})
        return self

    def rotating(self, where: Where, spin: Number, *, velocity: Sequence[Number] | None = None,
                 about: Sequence[Number] | Sequence[Sequence[Number]] | None = None) -> Model:
        """`*INITIAL CONDITIONS, TYPE=ROTATING VELOCITY`: a spin about an axis that moves.

        spin       > 0 turns left; in three dimensions seen from the second point of the axis [1/T]
        velocity   (n_dim,) of the axis [L/T]; default 0
        about      (2,) where the axis is at the start; in three dimensions (2, 3) two of its points
                   [L]; default the origin, and the axis z
        """
        n_dim = self._nodes.n_dim
        if about is None:
            about = (0.0, 0.0) if n_dim == 2 else ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        axis = [x for point in about for x in
                ((point,) if isinstance(point, (int, float, str)) else point)]
        if len(axis) != (2 if n_dim == 2 else 6):
            raise InputError("the axis of a spin is given by one point (2,)" if n_dim == 2 else
                             "the axis of a spin is given by two points (2, 3)")
        moves = (0.0,)*n_dim if velocity is None else velocity
        return self._card("INITIAL CONDITIONS", {"TYPE": "ROTATING VELOCITY"},
                          [row for name in self._names(where, self._nodes, "*INITIAL CONDITIONS")
                           for row in ((name, spin, *moves), axis)])

    # --- contact, ties, equations ----------------------------------------------------------

    def interaction(self, name: str, *, friction: Number | Literal["ROUGH"] | None = None,
                    friction_restitution: Number | None = None,
                    pad_thickness: Number | None = None,
                    restitution: Number | None = None,
                    damping: Number | Sequence[Number] | None = None,
                    tangent_fraction: Number | None = None,
                    pressure: Sequence[Any] | None = None) -> Model:
        """`*SURFACE INTERACTION`, hard if no pressure is given.

        friction        coefficient of Coulomb's law, 0 or more; "ROUGH": nothing slides; default 0
        friction_restitution   0 to 1: the fraction of the velocity along the surface that contacts
                        which stick reverse; default 0
        pad_thickness   of a layer that keeps the surfaces apart, 0 or more [L]; contact treats a
                        node with a pad as a circle, in space as a ball
        restitution     0 to 1: the fraction of the speed of approach with which nodes with mass
                        separate; default 1
        damping         pressure over relative velocity [M/(L^2 T)]; or this, the gap beyond which
                        there is no damping [L], and the part of that gap, 0 to 1, with the full
                        damping; default none
        tangent_fraction   damping against slip over that against approach, 0 or more; default 0
        pressure        over the overclosure: ("LINEAR", slope [M/(L^2 T^2)]), optionally with a
                        tension [M/(L T^2)] at its end; ("EXPONENTIAL", clearance [L], pressure
                        at zero gap); ("TABULAR", (pressure, overclosure), ...) from pressure 0 on
        """
        if damping is None and tangent_fraction is not None:
            raise InputError("tangent_fraction is a part of damping: give damping too")
        if friction is None and friction_restitution is not None:
            raise InputError("friction_restitution is for pairs with friction: give friction too")
        text = card("SURFACE INTERACTION", {"NAME": name, "PAD THICKNESS": pad_thickness,
                                            "RESTITUTION": restitution})
        kind, *values = pressure or ("HARD",)
        rows = values if str(kind).upper() == "TABULAR" else [tuple(values)]*bool(values)
        text += card("SURFACE BEHAVIOR", {"PRESSURE-OVERCLOSURE": kind}, rows=rows)
        if friction is not None:
            is_rough = isinstance(friction, str) and friction.upper() == "ROUGH"
            text += card("FRICTION", {"ROUGH": is_rough, "RESTITUTION": friction_restitution},
                         rows=[] if is_rough else [(friction,)])
        if damping is not None:
            row = tuple(damping) if isinstance(damping, Sequence) else (damping,)
            text += card("CONTACT DAMPING", {"DEFINITION": "DAMPING COEFFICIENT",
                                             "TANGENT FRACTION": tangent_fraction}, rows=[row])
        self._add(text)
        return self

    def contact_pair(self, slave: str, master: str, *, interaction: str | None = None,
                     type: str = "NODE TO SURFACE", sides: str | None = None,
                     guard: str | None = None, edges: str | None = None,
                     adjust: Number | None = None, initiation: str | None = None) -> Model:
        """`*CONTACT PAIR` of two surfaces, or of one with itself.

        interaction   default one of its own, frictionless
        type          NODE TO SURFACE, SEGMENT or MORTAR
        sides         ONE: contact stops nodes of the slave; BOTH: of the master, too, NODE TO SURFACE
                      only; AUTO (default): both for NODE TO SURFACE; else the rounder surface
                      becomes the slave if the other is too coarse for it, without `adjust`
        guard         YES (default): other nodes enter by a twentieth of an edge at most; NO: they
                      may enter
        edges         YES (default): sharp edges that cross are stopped, in three dimensions; NO: not
        adjust        distance [L] up to which slave nodes are moved onto the master, or a node set
        initiation    MASSLESS: its slave nodes carry no mass; PERSISTENT: they do; default: as
                      `contact_initiation` says
        """
        if interaction is None:
            interaction = _FRICTIONLESS
            if not self._has_frictionless:
                self.interaction(interaction)
                self._has_frictionless = True
        return self._card("CONTACT PAIR", {"INTERACTION": interaction, "TYPE": type,
                                           "SIDES": sides, "GUARD": guard, "EDGES": edges,
                                           "ADJUST": adjust, "INITIATION": initiation},
                          [(slave, master)])

    def clearance(self, slave: str, master: str, value: Number) -> Model:
        """`*CLEARANCE`: the gap of a contact pair at the start.

        Nodes of the slave surface that face the master are moved there, without stress.

        value           gap of these nodes [L]; below 0 they overlap
        """
        return self._card("CLEARANCE", {"SLAVE": slave, "MASTER": master, "VALUE": value})

    def contact(self, *surfaces: str | tuple[str, str], interaction: str | None = None,
                type: str | None = None) -> Model:
        """`*CONTACT`: all free faces of the model with all, or what `surfaces` names.

        surfaces      names of surfaces, each in contact with itself, or pairs of names
        type          NODE TO SURFACE (default) or, in three dimensions, MORTAR
        interaction   of all of them; default frictionless
        """
        rows = [(s, s) if isinstance(s, str) else tuple(s) for s in surfaces]
        self._card("CONTACT", {})
        self._card("CONTACT INCLUSIONS", {"ALL EXTERIOR": not rows, "TYPE": type}, rows)
        if interaction is not None:
            self._card("CONTACT PROPERTY ASSIGNMENT", {}, [("GLOBAL", "GLOBAL", interaction)])
        return self

    def tie(self, name: str, slave: str, master: str, *,
            position_tolerance: Number | None = None, multiplier: str | None = None,
            translation: Sequence[Number] | None = None, reference: int | str | None = None,
            cyclic_symmetry: bool = False, adjust: bool = True) -> Model:
        """`*TIE` of two surfaces, of a cell that repeats itself or of a sector.

        position_tolerance   largest distance between them [L]; default a tenth of an edge
        multiplier           DUAL (default) or STANDARD
        translation          (2,) or (3,) from the slave to where it lies on the master [L]
        reference            node whose displacement adds to the translation
        cyclic_symmetry      the slave turned by a sector lies on the master: see `sectors`
        adjust               False: slave nodes are not moved; across gaps angular momentum is not
                             conserved
        """
        return self._card("TIE", {"NAME": name, "POSITION TOLERANCE": position_tolerance,
                                  "MULTIPLIER": multiplier, "ADJUST": "YES" if adjust else "NO",
                                  "TYPE": "SURFACE TO SURFACE",
                                  "TRANSLATION": translation is not None, "REF NODE": reference,
                                  "CYCLIC SYMMETRY": cyclic_symmetry},
                          [(slave, master, *(translation or ()))])

    def sectors(self, n: int, a: Sequence[Number], b: Sequence[Number], *,
                tie: str | None = None) -> Model:
        """`*CYCLIC SYMMETRY MODEL`: the model is one of n equal sectors of a full turn.

        a, b   two points of the axis, (2,) or (3,) [L]
        tie    that of the two cuts; needed where there are several ties
        """
        return self._card("CYCLIC SYMMETRY MODEL", {"N": n, "TIE": tie}, [(*a, *b)])

    def equation(self, terms: Sequence[tuple[str | int, int, Number]]) -> Model:
        """`*EQUATION`: the sum of coefficient times displacement over the terms is 0.

        terms   node or node set, 1 to 3, coefficient; the first one is eliminated
        """
        rows: list[Sequence[object]] = [(len(terms),)]
        for term in terms:
            if len(term) != 3:
                raise InputError(f"a term is node, degree of freedom, coefficient, not {term!r}")
            rows.append((*self._names(term[0], self._nodes, "*EQUATION"), *term[1:]))
        return self._card("EQUATION", rows=rows)

    def transform(self, nodes: str, a: Sequence[Number], b: Sequence[Number],
                  type: Literal["R", "C"] = "R") -> Model:
        """`*TRANSFORM`: degrees of freedom of a node set along axes of their own.

        a, b    R: a point on the first axis, and one on the second side of it, from the origin;
                C: two points of the axis of a cylinder; x, y, z each
        """
        return self._card("TRANSFORM", {"NSET": nodes, "TYPE": type}, [(*a, *b)])

    # --- what a deck cannot say --------------------------------------------------------------

    def give_law(self, material: str, law: PointFunction) -> Model:
        """The law of a `*USER MATERIAL`, as `law` of `material`, for the model of a deck."""
        check_law(law, self._nodes.n_dim if self._nodes.count else None)
        self._laws[material] = law
        return self

    def given_forces(self, nodes: str | None = None) -> Model:
        """`*GIVEN FORCES`: nodes whose forces and mass another program gives; `host` does.

        nodes   node set; default the nodes that belong to no element
        """
        return self._card("GIVEN FORCES", {"NSET": nodes})

    def host(self, solid: Solid, mass: Any = None, *, nodes: str | None = None) -> Model:
        """Forces and mass of the solid of a host code, on nodes that need no elements.

        solid   an object with a method respond(u0, du, wants_tangent), see `emcon.given.Solid`; it
                may stand for any forces between nodes
        mass    (n, n) between nodes, or (d n, d n), the same in all d directions, over all nodes of
                the model: a sparse matrix of scipy, a `Csr`, or an array [M]; those of several
                solids, and of elements, add up
        nodes   node set; default the nodes that belong to no element
        """
        check_solid(f"solid {len(self._hosts) + 1}", solid)
        self._hosts.append((solid, mass))
        return self.given_forces(nodes)

    def potential(self, function: PointFunction, nodes: Where | None = None) -> Model:
        """A potential of the present position of each of some nodes: V [M L^2/T^2].

        function   of positions (n, d) [L], d dimensions; it returns V (n,) and its first and second
                   derivatives, (n, d) and (n, d, d)
        nodes      node set, or (k,) nodes; default all

        Energies contain it as `potential`; its discrete gradient conserves the total.
        """
        check_function(f"potential {len(self._potentials) + 1}", function)
        where = None
        if nodes is not None:
            where = nodes if isinstance(nodes, str) else self._nodes.labels(nodes, "a potential")
        self._potentials.append((function, where))
        return self

    # --- steps -----------------------------------------------------------------------------

    def step(self, procedure: Literal["STATIC", "DYNAMIC"], h: Number = 1.0,
             duration: Number = 1.0, h_min: Number | None = None, h_max: Number | None = None, *,
             direct: bool = False, explicit: bool = False, stabilize: bool | Number = False,
             nlgeom: bool | None = None, increments: int | str | None = None,
             amplitude: Literal["RAMP", "STEP"] | None = None, solver: str | None = None) -> Step:
        """`*STEP`: a further step, to which conditions, settings and output are added.

        h, duration    increment and length of the step [T]
        h_min, h_max   bounds of the increment [T] where it is cut or grown
        direct         keep to h
        explicit       of dynamic steps: central differences, h below the critical step
        stabilize      of static steps: viscous forces, so that snapping bodies find an equilibrium;
                       a number: the fraction of the strain energy that they dissipate in the
                       first increment (2e-4)
        nlgeom         large displacements; stays on for later steps
        increments     largest number of increments of the step; default no limit
        amplitude      RAMP (default of static steps) or STEP (default of dynamic ones)
        solver         DEFAULT, DIRECT, ITERATIVE, UMFPACK or MUMPS
        """
        options: dict[str, object] = {
            "NLGEOM": "NO" if nlgeom is False else nlgeom, "INC": increments,
            "AMPLITUDE": amplitude}
        step = Step((self._nodes, self._elements), options, procedure,
                    {"DIRECT": direct, "EXPLICIT": explicit, "STABILIZE": stabilize, "SOLVER": solver},
                    (h, duration, h_min, h_max))
        self._steps.append(step)
        return step

    # --- using -----------------------------------------------------------------------------

    def deck(self) -> str:
        """The model as the text of a deck, which `emcon run` reads.

        Raises `InputError` for the model of a deck that is given other values of its parameters.
        """
        if self._overrides:
            options = " ".join(f"--set {name}={value}" for name, value in self._overrides.items())
            raise InputError("the deck of this model is given parameters; run it with "
                             f"emcon run DECK {options}")
        return "".join(block.written or block.text for block in self._all_blocks())

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write `deck()` to a file; returns its path. Raises `OSError` where that fails."""
        return write_text(path, self.deck())

    def stepper(self) -> Stepper:
        """A new `Stepper` of this model. Raises `InputError`."""
        return Stepper(self)

def _law_card(material: str, argument: str, n: int) -> tuple[str, dict[str, object]]:
    """The card of a law with `n` constants, and its parameters."""
    if argument == "user":
        return "USER MATERIAL", {"CONSTANTS": n}
    rows = {len(row.constants): row for row in LAWS.values() if row.argument == argument}
    if n not in rows:
        raise InputError(f"material {material}: {argument} has {' or '.join(map(str, rows))} "
                         f"constants, not {n}")
    row = rows[n]
    return row.card, {"TYPE": "ISO"} if row.keyword == "ELASTIC" else {"N": row.order}
