"""The deformed bodies at some frames, and the values of a field that gives their colours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .projection import SOLIDS, far_first, is_seen, outer_faces, project
from .results import Array, FieldFile, ResultError

#: A body that moves less than this fraction of the largest displacement counts as support.
SUPPORT_FRACTION = 0.1
#: Room around the moving bodies, as a fraction of their extent; room for the supports below.
MARGIN, SUPPORT_ROOM = 0.06, 0.30
#: The view follows the bodies where their whole path is this much longer than they are; where a
#: body is at rest, which would seem to move, only if it is much longer.
FOLLOW_RATIO, FOLLOW_RATIO_AT_REST = 1.25, 5.0
#: Lengths below this part of the size of the scene are round-off.
ROUND_OFF = 1e-12

STYLE: dict[Any, Any] = {"font.family": "STIXGeneral", "mathtext.fontset": "stix", "font.size": 10,
         "axes.linewidth": 0.6, "axes.spines.top": False, "axes.spines.right": False,
         "axes.labelsize": 10, "xtick.labelsize": 9, "ytick.labelsize": 9,
         "xtick.direction": "in", "ytick.direction": "in", "xtick.major.width": 0.6,
         "ytick.major.width": 0.6, "legend.frameon": False, "legend.fontsize": 9,
         "lines.linewidth": 1.1, "svg.hashsalt": "emcon", "pdf.fonttype": 42}
BLACK, BLUE, ORANGE, GREY = "#1a1a1a", "#1f5fa8", "#d1660f", "#8a8a8a"

#: Consistent units, as powers of length, mass and time.
UNITS = {"length": "[L]", "time": "[T]", "energy": "[M L$^2$/T$^2$]",
         "force": "[M L/T$^2$]", "stress": "[M/(L T$^2$)]", "velocity": "[L/T]",
         "action": "[M L$^2$/T]"}
#: Of the fields that the program writes.
FIELD_UNITS = {"von_mises": "stress", "cauchy_stress": "stress", "contact_pressure": "stress",
               "contact_shear": "stress", "displacement": "length", "contact_gap": "length",
               "contact_slip": "length", "slip_path": "length", "velocity": "velocity",
               "strain_energy": "energy", "contact_force": "force", "reaction_force": "force"}
#: Fields that are 0 off some surfaces: of these bodies show the sides alone. A gap of 0 is one.
OF_SIDES = ("contact_force", "contact_gap", "contact_pressure", "contact_shear", "contact_slip",
            "contact_status", "contact_active", "slip_path", "reaction_force")
#: Fields that number states, and what the numbers mean; of faces in space.
STATES = {"contact_status": ("none", "sticks", "slides"),
          "contact_active": ("not active", "active")}
FACE_STATES = STATES | {"contact_status": ("open", "closed", "slides")}
#: What of a field of surfaces is less than this part of the largest value is not shown in space.
LEAST_SHOWN = 0.01

#: (x_min, x_max, y_min, y_max) [L]
View = tuple[float, float, float, float]


@dataclass
class Scene:
    """Some frames: positions (n_node, 2), colour values per polygon or per half side, and the views.

    In the plane polygons are the elements, in three dimensions the outer faces, which lie in front
    of each other.
    """

    times: list[float]
    position: list[Array]
    #: Each (n_polygon) or (2, n_side), units of the field; NaN where a face of space has none.
    values: list[Array] | None
    label: str                      #: what they are
    cells: list[NDArray[np.int64]]  #: nodes of the polygons
    is_support: NDArray[np.bool_]   #: per node
    #: Of three dimensions: numbers of the polygons, the farthest first, per frame.
    order: list[NDArray[np.int64]] | None = None
    #: Where colours are those of sides: their ends (n_side, 2); values are NaN where none is.
    sides: NDArray[np.int64] | None = None
    states: tuple[str, ...] = ()    #: what the values 0, 1, 2 mean, if they number states
    #: Ends of lines that bound what has no elements (n_line, 2).
    profiles: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 2), dtype=np.int64))
    floor: float = 0.0              #: differences of values below this are round-off
    notes: list[str] = field(default_factory=list)

    def views(self) -> list[View]:
        """Views [L] per frame; all of one size and one y range."""
        boxes = np.array([_extent(p[~self.is_support]) for p in self.position])
        y_min, y_max = float(boxes[:, 2].min()), float(boxes[:, 3].max())
        margin = MARGIN*(y_max - y_min)
        if self.is_support.any():
            room = SUPPORT_ROOM*float(np.max(boxes[:, 3] - boxes[:, 2]))
            low, high = self._heights(margin)
            y_low, y_high = max(low, y_min - room), min(high, y_max + room)
        else:
            y_low, y_high = y_min, y_max
        # no margin where a support is cut: it goes on beyond the frame
        y_low = y_low if y_low < y_min else y_min - margin
        y_high = y_high if y_high > y_max else y_max + margin
        ratio = FOLLOW_RATIO_AT_REST if self.is_support.any() else FOLLOW_RATIO
        return [(x0, x1, y_low, y_high) for x0, x1 in _windows(boxes[:, 0], boxes[:, 1], ratio)]

    def _heights(self, margin: float) -> tuple[float, float]:
        """The lowest and the highest place of all that is drawn, a margin beyond profiles [L]."""
        drawn = np.unique(np.concatenate(self.cells))
        heights = [(p[drawn, 1].min(), p[drawn, 1].max()) for p in self.position]
        heights += [(p[self.profiles, 1].min() - margin, p[self.profiles, 1].max() + margin)
                    for p in self.position if len(self.profiles)]
        return float(min(low for low, _ in heights)), float(max(high for _, high in heights))

    def moves(self) -> NDArray[np.bool_]:
        """Per polygon, or per side: part of a body that moves."""
        first = self.starts() if self.sides is None else self.sides[:, 0]
        return ~self.is_support[first]

    def starts(self) -> NDArray[np.int64]:
        """The first node of each polygon."""
        sizes = np.array([len(cell) for cell in self.cells])
        return np.concatenate(self.cells)[np.cumsum(sizes) - sizes]

    def polygons(self, frame: int) -> list[Array] | Array:
        """Corners (3 or more, 2) of each polygon [L], as they are drawn one over the other; an
        array where all have as many, which is faster."""
        order = np.arange(len(self.cells)) if self.order is None else self.order[frame]
        if len({len(cell) for cell in self.cells}) == 1:
            corners: Array = self.position[frame][np.asarray(self.cells)[order]]
            return corners
        return [self.position[frame][self.cells[k]] for k in order]

    def colours(self, frame: int) -> Array | None:
        """Values of `polygons` (n_polygon), or of `halves`, units of the field; None: there are
        none."""
        if self.values is None:
            return None
        if self.order is None:
            return self.values[frame].ravel()
        return self.values[frame][self.order[frame]]

    def halves(self, frame: int) -> Array:
        """Both halves of each side, (2 n_side, 2, 2) [L]: from its ends to its middle."""
        if self.sides is None:
            return np.empty((0, 2, 2))
        first, last = (self.position[frame][self.sides[:, k]] for k in (0, 1))
        middle = 0.5*(first + last)
        return np.concatenate([np.stack([first, middle], axis=1), np.stack([last, middle], axis=1)])


def _extent(points: Array) -> View:
    low, high = points.min(axis=0), points.max(axis=0)
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def _windows(low: Array, high: Array, ratio: float) -> list[tuple[float, float]]:
    """Intervals of one length that hold [low, high] of each frame, with margin.

    They are one and the same unless the way is `ratio` times as long: then they follow.
    """
    length = float(np.max(high - low))
    centre = 0.5*(low + high)
    path = float(high.max() - low.min())
    if path <= ratio*length:
        length = path
        centre = np.full(len(low), 0.5*float(low.min() + high.max()))
    half = 0.5*length*(1.0 + 2.0*MARGIN)
    return [(float(c) - half, float(c) + half) for c in centre]


# --- reading -----------------------------------------------------------------------------------

def _von_mises(file: FieldFile, frame: int) -> Array | None:
    """Von Mises stress per node (n_node) [M/(L T^2)], or None if the file has no stress."""
    if "von_mises" in file.point_fields:
        return file.point("von_mises", frame)
    if "cauchy_stress" not in file.point_fields:
        return None
    xx, yy, zz, xy, yz, xz = file.point("cauchy_stress", frame).T
    square: Array = (0.5*((xx - yy)**2 + (yy - zz)**2 + (zz - xx)**2)
                     + 3.0*(xy**2 + yz**2 + xz**2))
    return np.sqrt(square)


def _means(cells: Sequence[NDArray[np.int64]], nodal: Array) -> Array:
    """Means of values of nodes over the nodes of each cell (n_cell)."""
    sizes = np.array([len(cell) for cell in cells])
    sums: Array = np.add.reduceat(nodal[np.concatenate(cells)], np.cumsum(sizes) - sizes)
    return sums/sizes


def _values(file: FieldFile, name: str, frame: int) -> Array | None:
    """A field, of vectors the length; None: no stress is there."""
    if name == "von_mises":
        return _von_mises(file, frame)
    values = file[name][frame]
    return np.sqrt((values**2).sum(axis=1)) if values.ndim > 1 else values


def _colour_values(file: FieldFile, name: str, frame: int) -> Array | None:
    """A field per element (n_element): mean over its nodes; of vectors the length."""
    values = _values(file, name, frame)
    if values is None or name in file.cell_fields and name not in file.point_fields:
        return values
    return _means(file.cells, values)


def _side_values(file: FieldFile, name: str, frame: int, sides: NDArray[np.int64]) -> Array:
    """A field at both ends of each side (2, n_side); NaN on sides where it is nothing, and on those
    that begin at a slave surface and leave it."""
    values = _values(file, name, frame)
    assert values is not None
    ends: Array = values[sides.T]
    is_nothing = np.isnan(ends) if name == "contact_gap" else np.isnan(ends) | (ends == 0.0)
    is_nothing = is_nothing.all(axis=0) | np.isnan(ends)
    if "contact_gap" in file.point_fields:
        is_slave = np.isfinite(file.point("contact_gap", frame))[sides.T]
        is_nothing |= is_slave[0] != is_slave[1]
    return np.where(is_nothing, np.nan, ends)


def _surfaces_of(file: FieldFile) -> Path:
    """Where the faces of contact in space are, if they are."""
    return file.path.with_name(file.path.name.removesuffix(".vtkhdf") + ".surfaces.vtkhdf")


def _walls(file: FieldFile, frames: Sequence[int]) -> tuple[list[NDArray[np.int64]], list[Array]]:
    """The faces of walls, numbers of their points in turn, and these points (n_point, 3) per frame
    [L]."""
    path = _surfaces_of(file)
    if not path.is_file():
        return [], []
    with FieldFile(path) as surfaces:
        if max(frames) >= len(surfaces.times):
            return [], []
        is_wall = surfaces.point("node", 0) < 0
        number = np.cumsum(is_wall) - 1
        cells = [number[cell] for cell in surfaces.cells if is_wall[cell].all()]
        return cells, [(surfaces.points + surfaces.point("displacement", k))[is_wall]
                       for k in frames]


def _face_values(file: FieldFile, name: str, frames: Sequence[int],
                 faces: Sequence[NDArray[np.int64]]) -> list[Array]:
    """A field of surfaces per face (n_face), NaN where it is nothing: as the file of the faces has
    it, or else the mean over the nodes."""
    path = _surfaces_of(file)
    found: list[Array] = []
    if path.is_file():
        with FieldFile(path) as surfaces:
            if name in surfaces.cell_fields and max(frames) < len(surfaces.times):
                node = surfaces.point("node", 0).astype(np.int64)
                number = {tuple(sorted(node[cell])): k for k, cell in enumerate(surfaces.cells)}
                place = np.array([number.get(tuple(sorted(face)), -1) for face in faces])
                for frame in frames:
                    values = surfaces.cell(name, frame)
                    if values.ndim > 1:
                        values = np.sqrt((values**2).sum(axis=1))
                    found.append(np.where(place < 0, np.nan, values[place]))
    if not found:
        nodal = [_values(file, name, frame) for frame in frames]
        found = [_means(faces, values) for values in nodal if values is not None]
    if name == "contact_gap":
        return found
    every = np.concatenate(found) if found else np.zeros(0)
    least = LEAST_SHOWN*np.abs(every[np.isfinite(every)]).max(initial=0.0)
    return [np.where(np.abs(values) > least, values, np.nan) for values in found]


def outer_sides(cells: Sequence[NDArray[np.int64]]) -> NDArray[np.int64]:
    """Pairs of nodes (n_side, 2) along the outlines of bodies: those of one element alone."""
    first = np.concatenate(cells)
    last = np.concatenate([np.roll(cell, -1) for cell in cells])
    _, place, count = np.unique(np.sort(np.column_stack([first, last]), axis=1), axis=0,
                                return_index=True, return_counts=True)
    alone = np.sort(place[count == 1])
    return np.column_stack([first[alone], last[alone]])


def read_scene(file: FieldFile, frames: Sequence[int], name: str = "von_mises") -> Scene:
    """The bodies at some frames, coloured by the point or cell field `name`.

    Raises `ResultError` for a field that is not there and for shells in space; a missing stress or
    displacement is a note.
    """
    notes = []
    if "displacement" in file.point_fields:
        place = [file.points + file.point("displacement", k) for k in frames]
    else:
        notes.append("no displacement in the result (asked for by *NODE FILE, U): bodies shown "
                     "undeformed")
        frames = frames[:1]
        place = [file.points]
    in_space = bool(np.ptp(file.points[:, 2]) > 0.0)
    sides = outer_sides(file.cells) if name in OF_SIDES and not in_space else None
    if in_space and not np.isin(file.types, SOLIDS).all():
        raise ResultError(f"{file.path} is three-dimensional, and not of tetrahedra and "
                          "hexahedra alone; open it in ParaView")
    if in_space and name in OF_SIDES:
        values = _face_values(file, name, frames, outer_faces(file.cells)[0])
    elif sides is None:
        values = [v for v in (_colour_values(file, name, k) for k in frames) if v is not None]
    else:
        values = [_side_values(file, name, k, sides) for k in frames]
    if not values:
        notes.append("no stress in the result (asked for by *EL FILE, S): bodies shown in grey")
    scene = Scene(times=[float(file.times[k]) for k in frames], position=[p[:, :2] for p in place],
                  values=values or None, label=_label(name), cells=file.cells,
                  is_support=_supports(file, place), sides=sides, profiles=file.profiles,
                  states=(FACE_STATES if in_space else STATES).get(name, ()),
                  floor=ROUND_OFF*float(np.ptp(file.points)) if FIELD_UNITS.get(name) == "length"
                  else 0.0, notes=notes)
    if in_space:
        _see(scene, place, of_faces=name in OF_SIDES)
        _see_walls(scene, place, *_walls(file, frames))
    return scene


def _label(name: str) -> str:
    """What a field is called, and its unit."""
    label = "von Mises stress" if name == "von_mises" else name.replace("_", " ")
    return f"{label}\n{UNITS[FIELD_UNITS[name]]}" if name in FIELD_UNITS else label


def _supports(file: FieldFile, place: Sequence[Array]) -> NDArray[np.bool_]:
    """Per node: it belongs to no body that moves; `place` has the nodes (n_node, 3) per frame [L]."""
    body = file.bodies()
    travel = np.max([np.linalg.norm(p - file.points, axis=1) for p in place], axis=0)
    most = np.zeros(body.max() + 1)
    np.maximum.at(most, body[body >= 0], travel[body >= 0])
    support = most < SUPPORT_FRACTION*most.max()
    return (body < 0) | support[body]


def _see(scene: Scene, place: Sequence[Array], of_faces: bool) -> None:
    """Put a scene of three dimensions on paper; `place` has the nodes (n_node, 3) per frame [L],
    values are those of faces, or of elements."""
    scene.cells, cell_of = outer_faces(scene.cells)
    if scene.values is not None and not of_faces:
        scene.values = [values[cell_of] for values in scene.values]
    seen = [project(points) for points in place]
    scene.position = [on_paper for on_paper, _ in seen]
    scene.order = [far_first(scene.cells, *places) for places in seen]


def _see_walls(scene: Scene, place: Sequence[Array], walls: Sequence[NDArray[np.int64]],
               points: Sequence[Array]) -> None:
    """Put the faces of walls behind those of bodies, as supports without colour; of each frame
    those that face the eye are drawn."""
    if not walls:
        return
    n_node, n_face = len(scene.is_support), len(scene.cells)
    scene.cells = [*scene.cells, *(cell + n_node for cell in walls)]
    scene.is_support = np.concatenate([scene.is_support, np.ones(len(points[0]), dtype=bool)])
    if scene.values is not None:
        none = np.full(len(walls), np.nan)
        scene.values = [np.concatenate([values, none]) for values in scene.values]
    scene.order = []
    for k, (bodies, wall) in enumerate(zip(place, points, strict=True)):
        scene.position[k], near = project(np.concatenate([bodies, wall]))
        order = far_first(scene.cells, scene.position[k], near)
        seen = np.concatenate([np.ones(n_face, dtype=bool),
                               is_seen(scene.position[k], scene.cells[n_face:])])
        scene.order.append(order[seen[order]])
