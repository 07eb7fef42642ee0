"""Do bodies overlap? Looked at from outside, with nothing but positions and cells.

`Bodies` finds the bodies of a mesh (cells that hang together by nodes) and their outlines from
the cells alone; surfaces, pairs and constraints of a deck play no part. `Bodies.overlap(x)` is
the deepest overlap of one configuration, `worst(fields)` that of a whole run, between its frames
too: on the straight way from frame to frame, so that a thin body that was crossed is seen.

What counts is a point of an outline, or the centre of a cell, inside another body: its distance
from that body's outline, in the length of the deck and by the length of the edge it is behind. Of
an outline all nodes are looked at, and the middle of each part of an edge between its crossings
with the other outline: bodies may overlap with no node of either inside the other. A body inside
itself is found by its outline likewise, away from the own edges of the point.

In three dimensions (`BodiesInSpace`) outlines are triangles: faces split about the points that
uniform pressure asks for. A point is inside where the solid angles of all triangles make a full
turn, edges are cut where they cross triangles, and depths count by the root of the area of a face.
A body inside itself is not looked for there. `overlap_of_triangles` does it for any two closed
surfaces.
"""

import dataclasses
import itertools

import numpy as np

#: Largest relative motion between two looks at a step, by the shortest edge: what is as thin as
#: one edge is then seen at least a quarter of an edge deep on the way through.
LOOK = 0.5


@dataclasses.dataclass(frozen=True, order=True)
class Overlap:
    """How deep, by the edge (what is compared) and in length, and where."""

    by_edge: float = 0.0
    depth: float = 0.0
    time: float = 0.0
    bodies: tuple = ()             # numbers from 0, in the order of their first nodes
    place: tuple = ()              # of the node, centre or end of an edge

    def __str__(self):
        if not self.bodies:
            return "no overlap"
        place = ", ".join(f"{x:.4g}" for x in self.place)
        return (f"body {self.bodies[0] + 1} is {self.depth:.3g} ({self.by_edge:.3g} edges) inside "
                f"body {self.bodies[1] + 1} at ({place}), time {self.time:.6g}")


# ---- figures of the plane -----------------------------------------------------------------------


def cross(a, b):
    return a[..., 0]*b[..., 1] - a[..., 1]*b[..., 0]


def to_edges(p, a, b):
    """Distance of each point from each edge a-b: (n_point, n_edge)."""
    d = b - a
    to_p = p[:, None] - a
    share = np.clip((to_p*d).sum(-1)/np.maximum((d*d).sum(-1), np.finfo(float).tiny), 0, 1)
    return np.linalg.norm(to_p - share[..., None]*d, axis=-1)


def layers(p, a, b):
    """How many times closed outlines a-b, the inside to the left, go around each point."""
    to_a, to_b = a - p[:, None], b - p[:, None]
    up = (to_a[..., 1] <= 0) & (to_b[..., 1] > 0)
    down = (to_a[..., 1] > 0) & (to_b[..., 1] <= 0)
    left = cross(to_a, to_b)
    return (up & (left > 0)).sum(1) - (down & (left < 0)).sum(1)


def more_layers(p, a, b, inside, touches):
    """How many times outlines go around points of their own, beyond the material there.

    `touches` (n_point, n_edge) are the edges that the point is on; the others turn about it by
    the angle `inside` of the material, and by a full turn for each further layer.
    """
    to_a, to_b = a - p[:, None], b - p[:, None]
    turn = np.arctan2(cross(to_a, to_b), (to_a*to_b).sum(-1))
    return np.rint((np.where(touches, 0.0, turn).sum(1) - inside)/(2*np.pi)).astype(int)


def parts(a, b, c, d, alike):
    """Edges a-b in parts, cut where edges c-d cross them: middles (n, 2), and the edge of each.

    Edges that are `alike` (n_edge, n_other) are the same or share a node: they do not cross.
    """
    along, across = (b - a)[:, None], d - c
    turn = cross(along, across)
    to_c = c - a[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        s, t = cross(to_c, across)/turn, cross(to_c, along)/turn
    hit = (s > 0) & (s < 1) & (t >= 0) & (t <= 1) & ~alike
    cuts = np.concatenate([np.zeros((len(a), 1)), np.sort(np.where(hit, s, 1.0), axis=1),
                           np.ones((len(a), 1))], axis=1)
    k, m = np.nonzero(np.diff(cuts, axis=1) > 0)
    middle = 0.5*(cuts[k, m] + cuts[k, m + 1])
    return a[k] + middle[:, None]*(b - a)[k], k


# ---- bodies -------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Outline:
    """Of a body: edges (n, 2) of its outline, their nodes with those before and after them, edges that
    a node touches (n_node, n), edges that share one (n, n), and its cells by their number of nodes."""

    edge: np.ndarray
    node: np.ndarray
    after: np.ndarray
    before: np.ndarray
    touches: np.ndarray
    alike: np.ndarray
    cells: list


class Bodies:
    """The bodies of a mesh: cells (0-based nodes, counter-clockwise) and outlines of each. Lines, as
    of trusses and springs, have none."""

    def __init__(self, cells):
        self.cells = [np.asarray(cell) for cell in cells if len(cell) > 2]
        faces = [(int(i), int(j)) for cell in self.cells
                 for i, j in zip(cell, np.roll(cell, -1), strict=True)]
        twice = {(j, i) for i, j in faces} & set(faces)
        self.edge = np.array([face for face in faces if face not in twice])
        body = self._together()
        self.n = 1 + max(body.values())
        self._outline = {}
        self.body_of_edge = np.array([body[i] for i in self.edge[:, 0]])
        self.body_of_cell = np.array([body[int(cell[0])] for cell in self.cells])

    def _together(self):
        """Node -> number of its body: cells that share a node are of one body."""
        above = {}

        def top(i):
            while above.setdefault(i, i) != i:
                above[i] = i = above[above[i]]
            return i

        for cell in self.cells:
            for i in cell[1:]:
                one, other = sorted((top(int(cell[0])), top(int(i))))
                above[other] = one
        numbers = {root: k for k, root in enumerate(sorted({top(i) for i in above}))}
        return {i: numbers[top(i)] for i in above}

    def edges(self, body):
        return self.outline(body).edge

    def outline(self, body):
        """What of a body does not change with the places of its nodes."""
        if body not in self._outline:
            self._outline[body] = self._made(body)
        return self._outline[body]

    def _made(self, body):
        edge = self.edge[self.body_of_edge == body]
        into = {node: k for k, node in enumerate(edge[:, 1])}
        out_of = {node: k for k, node in enumerate(edge[:, 0])}
        node = np.unique(edge)
        cells = [cell for cell, of in zip(self.cells, self.body_of_cell, strict=True) if of == body]
        sizes = dict.fromkeys(map(len, cells))
        return Outline(
            edge, node,
            after=edge[[out_of[n] for n in node], 1], before=edge[[into[n] for n in node], 0],
            touches=(edge[None] == node[:, None, None]).any(-1),
            alike=(edge[:, None, :, None] == edge[None, :, None, :]).any((-1, -2)),
            cells=[np.array([cell for cell in cells if len(cell) == n]) for n in sizes])

    def overlap(self, x, time=0.0, alone=()):
        """The deepest overlap of the configuration `x` (n_node, 2).

        `alone` are pairs of bodies (i, j), i <= j, not to be looked at: (i, i) is a body with
        itself.
        """
        box = [(x[e].min((0, 1)), x[e].max((0, 1))) for e in map(self.edges, range(self.n))]
        found = [Overlap()]
        for i, j in itertools.combinations_with_replacement(range(self.n), 2):
            if (i, j) in alone:
                continue
            if i == j:
                found += self._with_itself(x, i)
            elif (np.maximum(box[i][0], box[j][0]) <= np.minimum(box[i][1], box[j][1])).all():
                found += [*self._inside(x, i, j, box[j]), *self._inside(x, j, i, box[i])]
        return dataclasses.replace(max(found), time=float(time))

    def _inside(self, x, i, j, box):
        """The deepest of the points of body i that are inside body j."""
        edge, inner = self.edges(j), self.outline(i)
        own = inner.edge
        near = ((x[own].max(1) >= box[0]) & (x[own].min(1) <= box[1])).all(1)
        middles, _ = parts(*x[own[near].T], *x[edge.T], False)
        p = np.vstack([x[inner.node], middles, *(x[cells].mean(1) for cells in inner.cells)])
        p = p[((p >= box[0]) & (p <= box[1])).all(1)]
        p = p[layers(p, *x[edge.T]) > 0]
        return deepest(p, x[edge], to_edges(p, *x[edge.T]), (i, j))

    def _with_itself(self, x, i):
        """The deepest point of the outline of body i in another part of the body."""
        own = self.outline(i)
        edge, node = own.edge, own.node
        after, before = x[own.after] - x[node], x[own.before] - x[node]
        inside = np.arctan2(cross(after, before), (after*before).sum(-1)) % (2*np.pi)
        middles, k = parts(*x[edge.T], *x[edge.T], own.alike)
        p = np.vstack([x[node], middles])
        inside = np.append(inside, np.full(len(middles), np.pi))
        touches = np.vstack([own.touches, k[:, None] == np.arange(len(edge))])
        deep = more_layers(p, *x[edge.T], inside, touches) > 0
        away = np.where(touches[deep], np.inf, to_edges(p[deep], *x[edge.T]))
        return deepest(p[deep], x[edge], away, (i, i))

    def looks(self, x, time, alone=()):
        """The deepest overlap of each of the frames `x` (n_frame, n_node, 2), by itself, and that of
        each look on the way between them."""
        shortest = np.linalg.norm(np.diff(x[0][self.edge], axis=1)[:, 0], axis=-1).min()
        nodes = np.unique(self.edge)
        at_frame, on_way = [self.overlap(x[0], time[0], alone)], []
        for k in range(1, len(x)):
            step = x[k] - x[k - 1]
            # No two nodes move against each other by more than the diagonal of all motions.
            n = max(1, int(np.ceil(np.linalg.norm(np.ptp(step[nodes], axis=0))/(LOOK*shortest))))
            for s in np.arange(1, n)/n:
                on_way.append(self.overlap(
                    x[k - 1] + s*step, time[k - 1] + s*(time[k] - time[k - 1]), alone))
            at_frame.append(self.overlap(x[k], time[k], alone))
        return at_frame, on_way

    def worst(self, x, time, alone=()):
        """The deepest overlap of frames and on the way between them."""
        at_frame, on_way = self.looks(x, time, alone)
        return max(at_frame + on_way)


def deepest(p, edge, away, bodies):
    """A list of the deepest of points behind edges, `away` (n_point, n_edge) from them, or none."""
    if not len(p):
        return []
    k = int(np.argmax(away.min(1)))
    m = int(np.argmin(away[k]))
    depth = float(away[k, m])
    length = float(np.linalg.norm(edge[m, 1] - edge[m, 0]))
    return [Overlap(depth/length, depth, 0.0, bodies, tuple(map(float, p[k])))]


# ---- three dimensions ---------------------------------------------------------------------------

#: Pairs of a point and a triangle that are looked at in one go: as many as stay in a cache.
AT_ONCE = 20_000
TETRAHEDRON = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))
HEXAHEDRON = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
BETWEEN = {10: ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
           20: ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5),
                (2, 6), (3, 7))}
#: Weights of corners, and of nodes between them, in the point that a face is split about.
WEIGHTS = {4: (1/4, 1/4), 6: (-1/3, 2/3), 8: (-1/2, 3/4)}


def rims(cell):
    """The nodes around each face of a cell, outside in front."""
    n = len(cell)
    corners = 4 if n in {4, 10} else 8
    middle = {frozenset(ends): corners + k for k, ends in enumerate(BETWEEN.get(n, ()))}
    for face in TETRAHEDRON if corners == 4 else HEXAHEDRON:
        rim = []
        for i, j in zip(face, (*face[1:], face[0]), strict=True):
            rim += [i, middle[frozenset((i, j))]] if middle else [i]
        yield tuple(int(cell[k]) for k in rim)


def in_parts(n_point, n_triangle):
    """Slices of the points, so that no table of both is too large."""
    size = max(1, AT_ONCE//max(1, n_triangle))
    return [slice(k, k + size) for k in range(0, n_point, size)]


def dot(a, b):
    """Of vectors by their components, (3, ...): no sums over short axes, which take longer than all else."""
    return a[0]*b[0] + a[1]*b[1] + a[2]*b[2]


def normal_to(a, b):
    return a[1]*b[2] - a[2]*b[1], a[2]*b[0] - a[0]*b[2], a[0]*b[1] - a[1]*b[0]


def between(start, end):
    return [e - s for s, e in zip(start, end, strict=True)]


def by_component(points):
    """Components of points (n, 3) as (3, n); of corners (n, 3, 3) as (3, 3, n), the first index which corner."""
    return np.ascontiguousarray(np.moveaxis(points, 0, -1))


def turns(p, corner):
    """How many times closed triangles (n, 3, 3), seen from outside counter-clockwise, go around each point."""
    found = np.zeros(len(p))
    corners, points = by_component(corner), by_component(p)[..., None]
    for part in in_parts(len(p), len(corner)):
        a, b, c = (between(points[:, part], own) for own in corners)
        la, lb, lc = (np.sqrt(dot(v, v)) for v in (a, b, c))
        rest = la*lb*lc + dot(a, b)*lc + dot(b, c)*la + dot(c, a)*lb
        found[part] = np.arctan2(dot(a, normal_to(b, c)), rest).sum(-1)/(2*np.pi)
    return found


def to_triangles(p, corner):
    """Distance of each point from the triangles, and the index of the nearest."""
    far, which = np.zeros(len(p)), np.zeros(len(p), int)
    corners, points = by_component(corner), by_component(p)[..., None]
    side = [between(corners[k], corners[(k + 1) % 3]) for k in range(3)]
    normal = normal_to(side[0], between(corners[0], corners[2]))
    tiny = np.finfo(float).tiny
    for part in in_parts(len(p), len(corner)):
        square, over = np.inf, True
        for start, d in zip(corners, side, strict=True):
            to_q = between(start, points[:, part])
            share = np.clip(dot(to_q, d)/np.maximum(dot(d, d), tiny), 0, 1)
            left = [q - share*along for q, along in zip(to_q, d, strict=True)]
            square = np.minimum(square, dot(left, left))
            over = over & (dot(normal_to(d, to_q), normal) > 0)
        height = np.abs(dot(between(corners[0], points[:, part]), normal))/np.maximum(np.sqrt(dot(normal, normal)), tiny)
        away = np.where(over, height, np.sqrt(square))
        which[part] = away.argmin(1)
        far[part] = away.min(1)
    return far, which


def cut(a, b, corner):
    """Middles of the parts in which edges a-b are cut by triangles."""
    middles = []
    corners = by_component(corner)
    one, other = between(corners[0], corners[1]), between(corners[0], corners[2])
    start_of, along_of = by_component(a)[..., None], by_component(b - a)[..., None]
    for part in in_parts(len(a), len(corner)):
        along = along_of[:, part]
        with np.errstate(divide="ignore", invalid="ignore"):
            sideways = normal_to(along, other)
            turn = dot(one, sideways)
            start = between(corners[0], start_of[:, part])
            u = dot(start, sideways)/turn
            up = normal_to(start, one)
            v = dot(along, up)/turn
            t = dot(other, up)/turn
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < 1)
        is_cut = hit.any(1)
        middles.append((a[part] + 0.5*(b - a)[part])[~is_cut])
        for k in np.flatnonzero(is_cut):
            cuts = np.unique([0., *t[k, hit[k]], 1.])
            middles.append(a[part][k] + 0.5*(cuts[1:] + cuts[:-1])[:, None]*(b - a)[part][k])
    return np.vstack([np.empty((0, 3)), *middles])


def deepest_inside(x, triangle, other, other_triangle, more=()):
    """The deepest point of closed triangles `triangle` (n, 3) of points `x`, or of points `more`, in others: how
    deep, the triangle that it is behind, and where; or none."""
    corner = other[other_triangle]
    low, high = corner.min((0, 1)), corner.max((0, 1))
    edge = np.unique(np.sort(np.vstack([triangle[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1), axis=0)
    edge = edge[((x[edge].max(1) >= low) & (x[edge].min(1) <= high)).all(1)]
    used = x[np.unique(triangle)]
    own = np.array([used.min(0), used.max(0)])
    close = corner[((corner.max(1) >= own[0]) & (corner.min(1) <= own[1])).all(1)]
    p = np.vstack([used, cut(*x[edge.T], close), np.reshape(more, (-1, 3))])
    p = p[((p >= low) & (p <= high)).all(1)]
    p = p[turns(p, corner) > 0.5 + 1e-9]
    if not len(p):
        return None
    far, which = to_triangles(p, corner)
    k = int(far.argmax())
    return float(far[k]), int(which[k]), tuple(map(float, p[k]))


def overlap_of_triangles(x, triangle, other, other_triangle):
    """How deep two closed surfaces are in each other, looked at both ways: a length, 0 if they are apart."""
    found = [deepest_inside(x, triangle, other, other_triangle),
             deepest_inside(other, other_triangle, x, triangle)]
    return max((depth for depth, *_ in filter(None, found)), default=0.0)


class BodiesInSpace(Bodies):
    """The bodies of a mesh of tetrahedra and hexahedra. Without `centres` what of an outline is inside counts alone,
    not the centres of cells."""

    def __init__(self, cells, centres=True):
        self.centres = centres
        self.cells = [np.asarray(cell) for cell in cells if len(cell) in {4, 8, 10, 20}]
        known = {}
        for k, cell in enumerate(self.cells):
            for rim in rims(cell):
                known.setdefault(frozenset(rim), []).append((k, rim))
        free = sorted(one for one, *others in known.values() if not others)
        body = self._together()
        self.n = 1 + max(body.values())
        self.body_of_cell = np.array([body[int(cell[0])] for cell in self.cells])
        self.edge = np.array([(i, j) for _, rim in free for i, j in zip(rim, rim[1:] + rim[:1], strict=True)])
        self.rim = [[rim for k, rim in free if self.body_of_cell[k] == b] for b in range(self.n)]

    def triangles(self, x, body):
        """Points of the mesh and of the middles of its faces, triangles of a body, and the face of each."""
        points, triangle, face = [*x], [], []
        for f, rim in enumerate(self.rim[body]):
            if len(rim) == 3:
                triangle.append(rim)
                face.append(f)
                continue
            corner, between = WEIGHTS[len(rim)]
            weight = [between if k % 2 and len(rim) > 4 else corner for k in range(len(rim))]
            triangle += [(i, j, len(points)) for i, j in zip(rim, rim[1:] + rim[:1], strict=True)]
            face += [f]*len(rim)
            points.append(np.array(weight) @ x[list(rim)])
        return np.array(points), np.array(triangle), np.array(face)

    def overlap(self, x, time=0.0, alone=()):
        """The deepest overlap of two bodies in the configuration `x` (n_node, 3)."""
        shape = [self.triangles(x, b) for b in range(self.n)]
        box = [(p[t].min((0, 1)), p[t].max((0, 1))) for p, t, _ in shape]
        found = [Overlap()]
        for i, j in itertools.permutations(range(self.n), 2):
            if (min(i, j), max(i, j)) in alone or (np.maximum(box[i][0], box[j][0])
                                                   > np.minimum(box[i][1], box[j][1])).any():
                continue
            centres = [x[cell].mean(0) for cell, of in zip(self.cells, self.body_of_cell, strict=True)
                       if self.centres and of == i]
            (p, t, _), (q, u, face) = shape[i], shape[j]
            deep = deepest_inside(p, t, q, u, centres)
            if deep is not None:
                a, b, c = (q[u[face == face[deep[1]]]][:, k] for k in range(3))
                length = float(np.sqrt(np.linalg.norm(np.cross(b - a, c - a).sum(0)/2)))
                found.append(Overlap(deep[0]/length, deep[0], 0.0, (i, j), deep[2]))
        return dataclasses.replace(max(found), time=float(time))


# ---- runs ---------------------------------------------------------------------------------------


def bodies_of(fields):
    return (Bodies if fields.x.shape[1] == 2 else BodiesInSpace)(fields.cells)


def worst(fields, alone=()):
    """The deepest overlap of a run that wrote its displacements in every increment."""
    bodies = bodies_of(fields)
    return bodies.worst(fields.x + fields["displacement"], fields.time, alone)


def looks(fields, alone=()):
    """The deepest overlap of each frame, and of each look on the way between frames."""
    bodies = bodies_of(fields)
    return bodies.looks(fields.x + fields["displacement"], fields.time, alone)


def frames(fields, alone=()):
    """The deepest overlap of each frame, by itself."""
    bodies = bodies_of(fields)
    return [bodies.overlap(x, t, alone)
            for x, t in zip(fields.x + fields["displacement"], fields.time, strict=True)]
