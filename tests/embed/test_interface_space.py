"""Contact for host codes in three dimensions: faces of mixed kinds, gradients, an impact."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]/"pywrap"))

from emcon import _core  # noqa: E402
from emcon.interface import InputError, Interface, Outcome  # noqa: E402
from emcon.memory import text  # noqa: E402

EPS = np.finfo(float).eps
#: Values and gradients of some dozen coordinates, each of a few hundred roundings.
TOL = 1e-12
WIDTH = EPS**(1/3)


def floor(n: int = 3, size: float = 3.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes of a curved floor of n by n cells; quadrilaterals, and the last row as triangles."""
    at = np.linspace(-0.5*size, 0.5*size, n + 1)
    x, y = (part.ravel() for part in np.meshgrid(at, at, indexing="ij"))
    cell = [(n + 1)*i + j for i in range(n) for j in range(n)]
    quads = np.array([[k, k + n + 1, k + n + 2, k + 1] for k in cell])
    whole, last = quads[:-n], quads[-n:]
    triangles = np.concatenate([last[:, [0, 1, 2]], last[:, [0, 2, 3]]])
    return np.stack([x, y, -0.03*(x**2 + 0.5*y**2)], axis=1), whole, triangles


def foot(n: int = 2, size: float = 1.4, height: float = 0.0
         ) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and quadrilaterals of a turned foot over it, its outside below."""
    at = np.linspace(-0.5*size, 0.5*size, n + 1)
    x, y = (part.ravel() for part in np.meshgrid(at, at, indexing="ij"))
    cell = [(n + 1)*i + j for i in range(n) for j in range(n)]
    quads = np.array([[k, k + 1, k + n + 2, k + n + 1] for k in cell])
    turn = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    place = np.stack([x, y], axis=1) @ turn.T + [0.11, -0.07]
    return np.column_stack([place, np.full(len(place), height)]), quads


def over_the_floor(height: float = 0.02, is_end: bool = False, kind: str = "node to segment",
                   friction: float = 0.0, **more: object) -> tuple[Interface, int]:
    """A foot over a floor of quadrilaterals and triangles; and the number of nodes of the floor."""
    lower, quads, triangles = floor()
    upper, own = foot(height=height)
    face = Interface(np.concatenate([lower, upper]))
    face.configure(is_end=is_end)
    master = face.add_faces("floor", quads, triangles)
    slave = face.add_faces("foot", own + len(lower))
    face.add_pair(slave, master, kind, friction=friction, **more)
    face.prepare()
    return face, len(lower)


def motion(face: Interface, size: float = 0.02) -> np.ndarray:
    random = np.random.default_rng(3)
    return size*random.standard_normal((2, face.n_node, 3))


def all_near(face: Interface, u0: np.ndarray, du: np.ndarray) -> None:
    face.begin_step(u0, du, np.zeros(face.n_contact, bool))
    gaps = face.gaps(u0, du)
    near = np.flatnonzero(gaps.is_near & gaps.is_over)
    face.choose(u0, du, near, np.zeros(len(near)))


def test_sizes_are_those_of_space() -> None:
    face, n = over_the_floor()
    assert (face.n_dim, face.n_contact, face.n_unknown) == (3, 9, 3*face.n_node)
    assert face.positions.shape == (face.n_node, 3)
    assert sorted(face.slave_nodes) == list(range(n, n + 9))
    u0, du = motion(face)
    all_near(face, u0, du)
    values = face.evaluate(u0, du)
    assert values.n == 9
    assert values.g.shape == values.c.shape == (9, 3*face.n_node)
    assert face.links().shape == (3*face.n_node, 3*face.n_node)
    area, length = face.areas(u0 + du)
    assert area.sum() == pytest.approx(1.4**2, rel=0.1) and (length > 0).all()


def dense(matrix: object, n_column: int) -> np.ndarray:
    found = np.zeros((len(matrix.indptr) - 1, n_column))
    for row, (first, last) in enumerate(zip(matrix.indptr[:-1], matrix.indptr[1:], strict=True)):
        found[row, matrix.indices[first:last]] = matrix.data[first:last]
    return found


def test_forces_keep_energy_and_both_momenta() -> None:
    """g du is the change of f; forces have neither resultant nor moment in the middle."""
    face, _ = over_the_floor()
    u0, du = motion(face)
    all_near(face, u0, du)
    values = face.evaluate(u0, du)
    g = dense(values.g, 3*face.n_node)
    size = np.abs(g) @ np.abs(du.ravel())
    assert (np.abs(g @ du.ravel() - (values.end - values.start)) <= TOL*size).all()
    assert (np.abs(values.change - (values.end - values.start)) <= TOL*size).all()
    middle = face.positions + u0 + 0.5*du
    for row in g.reshape(-1, face.n_node, 3):
        assert np.abs(row.sum(axis=0)).max() < TOL
        assert np.abs(np.cross(middle, row).sum(axis=0)).max() < TOL


def test_gradients_at_the_end_and_second_derivatives() -> None:
    face, _ = over_the_floor()
    u0, du = motion(face)
    all_near(face, u0, du)
    near = face.evaluate(u0, du).contact
    random = np.random.default_rng(4)
    along = random.standard_normal(du.shape)
    lam = random.uniform(0.5, 1.0, len(near))

    def at(step: float) -> tuple[np.ndarray, np.ndarray]:
        face.choose(u0, du + step*along, near, np.zeros(len(near)))
        values = face.evaluate(u0, du + step*along)
        return values.end, dense(values.g, 3*face.n_node).T @ lam

    (right, after), (left, before) = at(WIDTH), at(-WIDTH)
    face.choose(u0, du, near, np.zeros(len(near)))
    c = dense(face.evaluate(u0, du).c, 3*face.n_node)
    np.testing.assert_allclose((right - left)/(2*WIDTH), c @ along.ravel(), atol=1e-7)
    curvature = face.second_times(lam, along).ravel()
    np.testing.assert_allclose((after - before)/(2*WIDTH), curvature, atol=2e-6)
    np.testing.assert_allclose(dense(face.curvature(lam), 3*face.n_node) @ along.ravel(), curvature,
                               atol=1e-12)


def fall(h: float = 0.05, n: int = 60) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Nodes of mass 1 that springs hold together fall on a floor that is held: kinetic and spring
    energy and the vertical momentum of each step, and how many contacts acted at most."""
    lower, quads, triangles = floor()
    upper, own = foot(height=0.12)
    nodes = np.concatenate([lower, upper])
    first = len(lower)
    face = Interface(nodes)
    slave = face.add_faces("foot", own + first)
    master = face.add_faces("floor", quads, triangles)
    face.add_pair(slave, master, "node to segment")
    held = np.zeros(nodes.shape, bool)
    held[:first] = True
    x = face.prepare(held)
    free = np.repeat(np.arange(len(nodes)) >= first, 3)
    pairs = [(i, j) for i in range(first, len(nodes)) for j in range(i)
             if j >= first and np.linalg.norm(x[i] - x[j]) < 1.05]
    rest = np.array([np.linalg.norm(x[i] - x[j]) for i, j in pairs])
    i, j = np.array(pairs).T
    stiffness = 40.0

    def energy(u: np.ndarray) -> float:
        return 0.5*stiffness*((np.linalg.norm((x + u)[i] - (x + u)[j], axis=1) - rest)**2).sum()

    def forces(u0: np.ndarray, u1: np.ndarray) -> np.ndarray:
        """Discrete gradient of the springs: of their lengths, along the mean of both ends."""
        d0, d1 = (x + u0)[i] - (x + u0)[j], (x + u1)[i] - (x + u1)[j]
        l0, l1 = np.linalg.norm(d0, axis=1), np.linalg.norm(d1, axis=1)
        pull = stiffness*(0.5*(l0 + l1) - rest)/(0.5*(l0 + l1))
        found = np.zeros_like(u0)
        np.add.at(found, i, 0.5*pull[:, None]*(d0 + d1))
        np.add.at(found, j, -0.5*pull[:, None]*(d0 + d1))
        return found

    u, v = np.zeros(x.shape), np.zeros(x.shape)
    v[first:] = [0.1, 0.05, -0.6]
    active, most, told = np.zeros(face.n_contact, bool), 0, []
    for _ in range(n):
        du = h*v
        active = face.begin_step(u, du, active)
        outcome = None
        while outcome is None:
            count = face.select(u, du, active)
            lam = np.zeros(count)
            for _ in range(30):
                values = face.evaluate(u, du)
                g, c = (dense(part, x.size) for part in (values.g, values.c))
                residual = (2/h**2*du - 2/h*v + forces(u, u + du)).ravel() - g.T @ lam
                size = np.abs(2/h*v).max() + np.abs(lam).max(initial=0.0)
                if (np.abs(residual[free]).max() < 1e-13*size
                        and np.abs(values.defect).max(initial=0.0) < 1e-14):
                    break
                tangent = 2/h**2*np.eye(x.size) - (dense(face.curvature(lam), x.size)
                                                   if count else 0)
                width = 1e-6
                for k in np.flatnonzero(free):
                    step = np.zeros(x.size)
                    step[k] = width
                    change = forces(u, u + du + step.reshape(x.shape)) - forces(
                        u, u + du - step.reshape(x.shape))
                    tangent[:, k] += change.ravel()/(2*width)
                m = free.sum()
                system = np.block([[tangent[np.ix_(free, free)], -g[:, free].T],
                                   [c[:, free], np.zeros((count, count))]])
                found = np.linalg.solve(system, -np.concatenate([residual[free], values.defect]))
                du = du.copy()
                du.ravel()[np.flatnonzero(free)] += found[:m]
                lam = lam + found[m:]
            active, outcome = face.update_active(u, du, lam, active)
        assert outcome is Outcome.DONE
        u, v = u + du, 2/h*du - v
        most = max(most, int(active.sum()))
        told.append((0.5*(v**2).sum(), energy(u), v[:, 2].sum()))
        depth, _ = face.overlap(u - du, du)
        assert depth < 0.05
    kinetic, stored, momentum = np.array(told).T
    return kinetic, stored, momentum, most


def test_a_host_of_springs_keeps_its_energy_through_impact() -> None:
    kinetic, stored, momentum, most = fall()
    total = kinetic + stored
    assert most >= 2
    assert momentum[0] < -4 and momentum[-1] > 0.5
    assert np.abs(total - 0.5*9*(0.1**2 + 0.05**2 + 0.6**2)).max() < 1e-11*total[0]


def test_mid_side_faces_are_seen_as_flat() -> None:
    """A floor of one face of each kind, all in one plane: gaps are heights."""
    corner = np.array([[0, 0], [2, 0], [2, 2], [0, 2], [4, 0], [4, 2]], float)

    def between(*ends: tuple[int, int]) -> np.ndarray:
        return np.array([0.5*(corner[a] + corner[b]) for a, b in ends])

    plane = np.concatenate([corner, between((0, 1), (1, 2), (2, 3), (3, 0)),
                            between((1, 4), (4, 2), (4, 5), (5, 2))])
    lower = np.column_stack([plane, np.zeros(len(plane))])
    upper = np.array([[1.1, 0.9, 0.2], [3.3, 0.6, 0.3], [2.7, 1.5, 0.4]])
    n = len(lower)
    face = Interface(np.concatenate([lower, upper]))
    master = face.add_faces("floor", [[0, 1, 2, 3, 6, 7, 8, 9]],
                            [[1, 4, 2, 10, 11, 7], [4, 5, 2, 12, 13, 11]])
    slave = face.add_faces("slave", [[n, n + 2, n + 1]])
    face.add_pair(slave, master, "node to segment")
    face.prepare()
    u = np.zeros((face.n_node, 3))
    face.begin_step(u, u, np.zeros(3, bool))
    gaps = face.gaps(u, u)
    assert gaps.is_near.all() and gaps.is_over.all()
    order = np.argsort(face.slave_nodes)
    np.testing.assert_allclose(gaps.start[order], [0.2, 0.3, 0.4], rtol=0.1)


@pytest.mark.parametrize("faces, said", [
    ([[0, 1, 2, 9]], "not in 0..7"),
    ([[0, 1, 2, 2]], "face 1 has node 3 twice"),
    ([[0, 1]], "one of 3, 4, 6, 8"),
    ([[0, 1, 8 - 1, 6]], None),
    (np.zeros((0, 4), int), "k > 0"),
    ([[0, 1, 2, 3], [0, 1, 2, 3]], "branches at node"),
])
def test_bad_faces(faces: object, said: str | None) -> None:
    x = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0],
                  [0, 0, 1], [2, 0, 0], [1, 0, 1], [0.5, 0, 2]], float)
    face = Interface(x)
    if said is None:
        assert face.add_faces("good", faces) == 0
        return
    with pytest.raises(InputError, match=re.escape(said)):
        face.add_faces("bad", faces)
    assert face.add_faces("good", [[0, 1, 2, 3]]) == 0


def test_what_is_of_the_plane_is_refused() -> None:
    x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]], float)
    face = Interface(x)
    with pytest.raises(InputError, match="surfaces of edges are of the plane"):
        face.add_surface("edges", [[0, 1]])
    with pytest.raises(InputError, match=r"face 1 has no area"):
        Interface(np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]], float)).add_faces("flat", [[0, 1, 2]])
    lower, upper = face.add_faces("lower", [[0, 1, 2]]), face.add_faces("upper", [[3, 5, 4]])
    with pytest.raises(InputError, match="contact in three dimensions is node to segment .* or mortar"):
        face.add_pair(upper, lower, "segment")
    with pytest.raises(InputError, match="smoothing is of the plane"):
        face.add_pair(upper, lower, "node to segment", smoothing="hermite")


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("kind", ["node to segment", "mortar"])
def test_the_pattern_is_known_before_the_step_is_solved(kind: str, friction: float) -> None:
    """It has all entries of whatever acts, sticks or slides, and none where nothing is near; also by a map."""
    face, n = over_the_floor(kind=kind, friction=friction)
    u0, du = motion(face)
    with pytest.raises(InputError, match="no step of contact was begun"):
        face.pattern(u0, du)
    face.begin_step(u0, du, np.zeros(face.n_contact, bool))
    known = face.pattern(u0, du).toarray()
    assert known.shape == (3*face.n_node,)*2 and set(np.unique(known)) == {0.0, 1.0}
    np.testing.assert_array_equal(known, known.T)
    random = np.random.default_rng(6)
    used = np.zeros(known.shape, bool)
    for _ in range(6):
        active = random.random(face.n_contact) < 0.6
        for select in (face.select, face.select_candidates):
            n_row = select(u0, du, active)
            rows = face.evaluate(u0, du)
            second = face.curvature(random.uniform(0.5, 1.0, n_row)).toarray()
            g, c = (part.toarray() != 0 for part in (rows.g, rows.c))
            of = [rows.contact == k for k in np.unique(rows.contact)]
            used |= (second != 0) | np.any([np.einsum("ki,kj->ij", c[k], g[k]) for k in of], axis=0)
    assert used.any() and not (used & (known == 0)).any()
    # The pattern is by directions alike; a contact has at least these.
    assert used.sum() > 0.5*known.sum()
    a = random.standard_normal((3*face.n_node, 4))
    a[random.random(a.shape) < 0.6] = 0.0
    face.set_map(a)
    np.testing.assert_array_equal(face.pattern(u0, du).toarray(), np.abs(a).T @ known @ np.abs(a) > 0)
    assert n < face.n_node


def test_the_pattern_in_the_plane_has_the_near_contacts_only() -> None:
    face = Interface([[0, 0], [1, 0], [2, 0], [9, 0], [0.4, 0.01], [0.6, 0.01], [8, 5]])
    lower = face.add_surface("lower", [[2, 1], [1, 0], [3, 2]])
    upper = face.add_surface("upper", [[4, 5], [5, 6]])
    face.add_pair(upper, lower, "node to segment")
    face.prepare()
    u0 = np.zeros((7, 2))
    face.begin_step(u0, u0, np.zeros(face.n_contact, bool))
    coupled = face.pattern(u0, u0).toarray().reshape(7, 2, 7, 2).any(axis=(1, 3))
    assert coupled[4, 0] and coupled[5, 1] and not coupled[6].any() and not coupled[3].any()


@pytest.mark.parametrize(("kind", "adjust"), [("node to segment", 0.15), ("mortar", 0.15), ("mortar", 0.0)])
def test_nodes_are_adjusted_onto_faces(kind: str, adjust: float) -> None:
    """Those up to the distance, and those behind; the others stay. Without, bodies of mortar must not overlap."""
    height = np.array([0.1, -0.05, 0.15, 0.3])
    foot = np.column_stack([[0.2, 0.6, 0.2, 0.6], [0.2, 0.2, 0.6, 0.6], height])
    face = Interface(np.concatenate([[[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], foot]))
    lower, upper = face.add_faces("lower", [[0, 1, 2, 3]]), face.add_faces("upper", [[4, 6, 5], [5, 6, 7]])
    face.add_pair(upper, lower, kind, adjust=adjust)
    if not adjust:
        with pytest.raises(InputError, match="node 6 is 0.05 behind the face of nodes 1, 2, 3, 4; move"):
            face.prepare()
        return
    face.prepare()
    foot[height <= adjust, 2] = 0.0
    np.testing.assert_allclose(face.positions[4:], foot, rtol=0, atol=1e-15)
    assert face.notes == ["contact of surfaces upper and lower: adjust moves 3 slave nodes, by 0.15 at most"]
    other = Interface(face.positions)
    with pytest.raises(InputError, match="adjust is -1, below 0"):
        other.add_pair(other.add_faces("upper", [[4, 6, 5]]), 0, adjust=-1.0)


def test_tie_of_faces() -> None:
    """A triangle on a square: weights that give positions back, and a slave that is too far off."""
    x = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [.5, .5, 0], [1, .5, 0], [.5, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]],
                 float)
    face = Interface(x)
    lower, upper = face.add_faces("lower", [[0, 1, 2, 3]]), face.add_faces("upper", [[4, 6, 5]])
    far = face.add_faces("far", [[7, 9, 8]])
    assert face.add_tie(upper, lower) == 0
    face.prepare()
    # On each triangle of the square about its middle positions are linear: the weights give them back.
    d, m = face.tie_matrices()
    ratio = m.toarray()[:, :4]/d.toarray()[:, 4:7].diagonal()[:, None]
    np.testing.assert_allclose(ratio @ x[:4], x[4:7], rtol=0, atol=1e-14)
    np.testing.assert_allclose(ratio.sum(1), 1.0, rtol=0, atol=1e-14)
    assert face.largest_move == 0.0
    other = Interface(x)
    lower, far = other.add_faces("lower", [[0, 1, 2, 3]]), other.add_faces("far", [[7, 9, 8]])
    other.add_tie(far, lower)
    with pytest.raises(InputError, match="the surfaces do not meet: slave node 8, the nearest one, is 1 from"):
        other.prepare()


def test_edges_of_the_plane_may_be_given_as_faces() -> None:
    one, other = Interface([[0, 0], [1, 0], [1, 1], [0, 1]]), Interface([[0, 0], [1, 0], [1, 1],
                                                                         [0, 1]])
    for face, add in ((one, one.add_surface), (other, other.add_faces)):
        face.add_pair(add("upper", [[3, 2]]), add("lower", [[1, 0]]), "node to segment")
        face.prepare()
    u = np.zeros((4, 2))
    for face in (one, other):
        face.begin_step(u, u, np.zeros(2, bool))
    np.testing.assert_array_equal(one.gaps(u, u).start, other.gaps(u, u).start)


def test_lists_that_do_not_fit() -> None:
    """Kinds, offsets and nodes, as C takes them."""
    status, model = _core.emcon_new(np.eye(3))
    assert status == 0
    for kind, offset, node, said in (
            ([12], [3], [0, 1, 2], "kind(1) is 12; faces of nodes with 3 coordinates are 5 (tri"),
            ([5], [4], [0, 1, 2], "offset(1) is 4, but the face is a triangle of 3 nodes behind 0"),
            ([5, 5], [3, 6], [0, 1, 2], "offset(2) is 6, but node has 3 entries"),
            ([5], [3], [0, 1, 2, 0], "node has 4 entries, but faces have 3"),
            ([5], [3], [0, 1, 3], "node(3) is 4, not in 1..3")):
        bad, _ = _core.emcon_add_faces(model, b"lists", *(np.array(part, np.int32)
                                                          for part in (kind, offset, node)))
        assert bad == _core.EMCON_ERROR_INPUT
        assert said in text(_core.emcon_message(model))
    _core.emcon_close(model)
