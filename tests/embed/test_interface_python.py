"""Contact for host codes in Python: a whole host, invariants, finite differences, bad calls."""

from __future__ import annotations

import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]/"pywrap"))

from emcon import _core  # noqa: E402
from emcon import interface as interface_module  # noqa: E402
from emcon.interface import InputError, Interface, Outcome  # noqa: E402
from interface_springs import collide  # noqa: E402

EPS = np.finfo(float).eps
# Gradients of some 14 coordinates, each of a few dozen roundings.
TOL = 512*EPS
# The error of a central difference is of the order of its square.
WIDTH = EPS**(1/3)
PAIRS = [
    {"formulation": "node to segment"},
    {"formulation": "segment", "smoothing": "hermite"},
    {"formulation": "mortar"},
    {"formulation": "mortar", "multiplier": "standard", "integration": "elements", "n_point": 4},
    {"formulation": "mortar", "normal": "edge", "normal_angle": 0.0},
]
SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]


def chain(n: int, first: int) -> np.ndarray:
    """Edges first, first + 1; first + 1, first + 2; ..."""
    return np.stack((np.arange(n), np.arange(1, n + 1)), 1) + first


def two_strips(is_end: bool = False, **pair: object) -> tuple[Interface, np.ndarray, np.ndarray]:
    """Nodes over an arc of nodes, a distance of about 0.1; and a step of theirs."""
    angle = np.linspace(2.2, 0.9, 9)
    lower = np.stack((3*np.cos(angle), 3*np.sin(angle) - 3), 1)[::-1]
    along = np.linspace(-1.2, 1.1, 7)
    upper = np.stack((along, np.sqrt(9.6 - along**2) - 3), 1)
    random = np.random.default_rng(5)
    nodes = np.vstack((lower, upper))
    face = Interface(nodes)
    face.configure(is_end=is_end)
    master = face.add_surface("lower", chain(8, 0))
    slave = face.add_surface("upper", chain(6, 9))
    face.add_pair(slave, master, **pair)
    face.prepare()
    return face, *(0.02*random.standard_normal((2, *nodes.shape)))


def choose_all(face: Interface, u0: np.ndarray, du: np.ndarray) -> None:
    """Select all contacts with a surface near, with a gap to hold."""
    face.begin_step(u0, du, np.zeros(face.n_contact, bool))
    near = np.flatnonzero(face.gaps(u0, du).is_near)
    assert len(near) >= 5
    face.choose(u0, du, near, np.full(len(near), 0.0625))


# ---- a whole host --------------------------------------------------------------------------------

@pytest.mark.parametrize("formulation", ["node to segment", "segment", "mortar"])
def test_springs_keep_their_energy_through_a_collision(formulation: str) -> None:
    result = collide(formulation)
    assert result.drift < 1e-12
    assert (result.momenta < 1e-12).all()
    assert 0 < result.n_touch < 150
    assert result.before == -1 and result.after > 0.2


def test_hosts_in_two_threads_get_the_bits_that_they_get_alone() -> None:
    names = ["mortar", "segment"]
    alone = [collide(name, 20, 0.02) for name in names]
    with ThreadPoolExecutor(2) as pool:
        for expected, found in zip(alone, pool.map(lambda name: collide(name, 20, 0.02), names)):
            assert (found.drift, found.after) == (expected.drift, expected.after)
            assert (found.momenta == expected.momenta).all()


# ---- gradients -----------------------------------------------------------------------------------

@pytest.mark.parametrize("pair", PAIRS)
def test_gaps_differ_by_the_gradient_times_the_motion(pair: dict[str, object]) -> None:
    face, u0, du = two_strips(**pair)
    with face:
        choose_all(face, u0, du)
        found = face.evaluate(u0, du)
        gaps = face.gaps(u0, du)
        g = found.g.toarray()
        assert abs(g @ du.ravel() - found.change).max() < TOL
        assert abs(found.end - found.start - found.change).max() < TOL
        assert (found.defect == found.end).all()
        assert (np.sign(gaps.end[found.contact] - found.target) == np.sign(found.end)).all()
        face.choose(u0, du, found.contact, gaps.end[found.contact])
        assert abs(face.evaluate(u0, du).defect).max() < TOL
        rows = g.reshape(-1, face.n_node, 2)
        middle = face.positions + u0 + du/2
        moments = (middle[:, 0]*rows[..., 1] - middle[:, 1]*rows[..., 0]).sum(1)
        assert abs(rows.sum(1)).max() < TOL and abs(moments).max() < 4*TOL
        assert (face.slave_nodes == np.arange(9, 16)).all()
        assert (face.pair_of_contact == 0).all()


@pytest.mark.parametrize("pair", PAIRS)
def test_derivatives_are_those_of_finite_differences(pair: dict[str, object]) -> None:
    face, u0, du = two_strips(**pair)
    random = np.random.default_rng(7)
    with face:
        choose_all(face, u0, du)
        found = face.evaluate(u0, du)
        lam = random.random(found.n)
        way = random.standard_normal(du.shape)
        product = face.second_times(lam, way)
        assert abs(face.curvature(lam) @ way.ravel() - product.ravel()).max() < 100*TOL
        beyond = face.evaluate(u0, du + WIDTH*way)
        before = face.evaluate(u0, du - WIDTH*way)
        slope = (beyond.end - before.end)/(2*WIDTH)
        assert abs(found.c @ way.ravel() - slope).max() < 1e3*WIDTH**2
        turn = lam @ (beyond.g.toarray() - before.g.toarray())/(2*WIDTH)
        assert abs(product.ravel() - turn).max() < 1e4*WIDTH**2


def test_statics_takes_gradients_at_the_end() -> None:
    face, u0, du = two_strips(is_end=True)
    with face:
        active = face.begin_step(u0, du, np.zeros(face.n_contact, bool))
        active[1:-1] = True
        face.select(u0, du, active)
        found = face.evaluate(u0, du)
        assert (found.g.data == found.c.data).all()
        assert (found.target == 0).all() and (found.defect == found.end).all()
        way = np.random.default_rng(3).standard_normal(du.shape)
        lam = np.ones(found.n)
        turn = lam @ (face.evaluate(u0, du + WIDTH*way).g.toarray()
                      - face.evaluate(u0, du - WIDTH*way).g.toarray())/(2*WIDTH)
        face.evaluate(u0, du)
        assert abs(face.second_times(lam, way).ravel() - turn).max() < 1e4*WIDTH**2
        face.configure()
        face.begin_step(u0, du, active)
        face.select(u0, du, active)
        assert (face.evaluate(u0, du).target != 0).all()


# ---- null space and ties -------------------------------------------------------------------------

def test_null_space_sees_no_contact_force() -> None:
    face, u0, du = two_strips(formulation="mortar")
    random = np.random.default_rng(11)
    with face:
        choose_all(face, u0, du)
        found = face.evaluate(u0, du)
        space = face.null_space()
        t = face.links().toarray()
        assert (t == np.eye(2*face.n_node)).all() and not len(space.redundant)
        p, df = space.p.toarray(), space.df.toarray()
        assert p.shape == df.shape == (2*face.n_node, face.n_unknown - found.n)
        assert abs(found.g @ p).max() < 10*TOL
        assert abs(found.c @ df).max() < 10*TOL
        part = face.particular(found.defect)
        assert abs(found.c @ part.ravel() + found.defect).max() < 10*TOL
        lam = random.random(found.n)
        force = (lam @ found.g).reshape(du.shape)
        assert abs(face.multipliers(force) - lam).max() < 100*TOL


def disc_in_hole(multiplier: str) -> Interface:
    """Two polygons on one circle, tied; the outer one has held nodes."""
    angle = [np.linspace(0, 2*np.pi, n, endpoint=False) for n in (14, 23)]
    nodes = np.vstack([np.stack((np.cos(a), np.sin(a)), 1) for a in angle])
    face = Interface(nodes)
    ring = np.stack((np.arange(14), np.roll(np.arange(14), -1)), 1)
    hole = np.stack((np.roll(np.arange(23), -1), np.arange(23)), 1) + 14
    slave, master = face.add_surface("disc", ring), face.add_surface("hole", hole)
    assert face.add_tie(slave, master, multiplier=multiplier) == 0
    held = np.zeros(nodes.shape, bool)
    held[14] = True
    face.prepare(held)
    return face


@pytest.mark.parametrize("multiplier", ["standard", "dual"])
def test_ties_meet_in_the_mean(multiplier: str) -> None:
    random = np.random.default_rng(13)
    with disc_in_hole(multiplier) as face:
        x = face.positions
        d, m = face.tie_matrices()
        assert d.shape == m.shape == (14, face.n_node)
        assert abs(d @ x - m @ x).max() < TOL
        assert 0 < face.largest_move < 0.1 and face.notes
        t = face.links()
        assert t.shape == (2*face.n_node, face.n_unknown) and face.n_unknown == 2*(23 - 1)
        assert abs(((d.toarray() - m.toarray()) @ t.toarray()[::2])).max() < TOL
        u, r = random.standard_normal((2, *x.shape))
        followed = face.follow(u)
        assert abs(d @ followed - m @ followed).max() < 10*TOL
        # The same power, and nothing left on what follows.
        assert abs((followed*r).sum() - (u*face.gather(r)).sum()) < 100*TOL
        assert (face.gather(r)[:14] == 0).all()
        none = np.zeros(0, bool)
        assert face.n_contact == 0 and not len(face.begin_step(u, u, none))
        assert face.select(u, u, none) == 0 and face.evaluate(u, u).g.shape == (0, 2*face.n_node)
        assert face.curvature([]).data.size == 0
        assert face.null_space().p.shape == (2*face.n_node, face.n_unknown)
        assert face.update_active(u, u, [], none)[1] is Outcome.DONE


# ---- active set ----------------------------------------------------------------------------------

def blocks(formulation: str) -> Interface:
    """Edges of two and three cells, 0.1 apart, of width 2."""
    x = [[0, 0], [1, 0], [2, 0], [0, 0.1], [0.6, 0.1], [1.3, 0.1], [2, 0.1]]
    face = Interface(x)
    master = face.add_surface("lower", [[1, 0], [2, 1]])
    slave = face.add_surface("upper", chain(3, 3))
    face.add_pair(slave, master, formulation)
    face.prepare()
    return face


@pytest.mark.parametrize("formulation", ["node to segment", "segment", "mortar"])
def test_active_set_takes_in_what_penetrates_and_releases_what_pulls(formulation: str) -> None:
    with blocks(formulation) as face:
        u0, du = np.zeros((2, face.n_node, 2))
        du[3:, 1] = -0.15
        active = face.begin_step(u0, du, np.zeros(face.n_contact, bool))
        assert not active.any()
        assert face.gaps(u0, du).start == pytest.approx(0.1, rel=TOL)
        assert face.gaps(u0, du).end == pytest.approx(-0.05, rel=10*TOL)
        assert face.select(u0, du, active) == 0
        active, outcome = face.update_active(u0, du, [], active)
        assert active.all() and outcome is None
        assert face.select(u0, du, active) == face.n_contact
        du[3:, 1] = 0.0                                   # the gap at the start is held
        assert (face.evaluate(u0, du).defect == 0).all()
        again, outcome = face.update_active(u0, du, np.ones(face.n_contact), active)
        assert again.all() and outcome is Outcome.DONE
        area, length = face.areas(u0)
        assert area.sum() == pytest.approx(2, rel=TOL) == length.sum()
        # The pressure 3 gives the multipliers 3 area, and the force 3 times the width.
        force = (3*area) @ face.evaluate(u0, du).g
        assert force.reshape(-1, 2)[3:].sum(0) == pytest.approx([0, 6], abs=6*TOL)
        pull = np.ones(face.n_contact)
        pull[0] = -1
        active, outcome = face.update_active(u0, du, pull, active)
        assert not active[0] and active[1:].all() and outcome is None
        active = face.drop([])
        with pytest.raises(InputError, match=r"redundant\[0\] is 9, not in 0..3"):
            face.drop([9])


def test_geometry_finds_what_is_behind_an_outline() -> None:
    lower = np.array([[0, 0], [2, 0], [2, 1], [0, 1]])
    with Interface(np.vstack((lower, SQUARE + np.array([0.5, 1.1])))) as face:
        master, slave = (face.add_surface(name, chain(4, first) % 4 + first)
                         for name, first in (("lower", 0), ("upper", 4)))
        face.add_pair(slave, master, "node to segment")
        face.prepare()
        u0, du = np.zeros((2, 8, 2))
        assert face.overlap(u0, du) == (0, None)
        du[4:, 1] = -0.15
        depth, node = face.overlap(u0, du)                # per edge of the upper one
        assert depth == pytest.approx(0.05, rel=10*TOL)
        assert node in (2, 3, 4, 5)


# ---- bad calls -----------------------------------------------------------------------------------

BAD_NODES = [
    (np.zeros((0, 2)), "no nodes"), (np.zeros((3, 4)), r"nodes .*\(3, 4\)"), ("text", "nodes"),
    (5, "nodes"), ([[0, 0], [1, np.nan]], "nodes is not finite"), ([[0, 0], [1]], "nodes"),
    (np.array([[1j, 0]]), "nodes .*complex"),
]


@pytest.mark.parametrize(("nodes", "text"), BAD_NODES)
def test_bad_nodes_are_refused(nodes: object, text: str) -> None:
    with pytest.raises(InputError, match=text):
        Interface(nodes)


def test_bad_surfaces_pairs_and_ties_are_refused() -> None:
    def refuse(text: str, call: object, *arguments: object, **more: object) -> None:
        with pytest.raises(InputError, match=text):
            call(*arguments, **more)

    with Interface(SQUARE) as face:
        refuse("no surface yet", face.add_pair, 0, 1)
        refuse("no text|not a text", face.add_surface, 5, [[1, 0]])
        refuse(r"edges\[0, 1\] is 4, not in 0..3", face.add_surface, "bad", [[1, 4]])
        refuse(r"edges\[0, 0\] is -1", face.add_surface, "bad", [[-1, 0]])
        refuse(r"\(1, 3\)", face.add_surface, "bad", [[1, 2, 3]])
        refuse("integers", face.add_surface, "bad", [[1.0, 2.0]])
        refuse("shape", face.add_surface, "bad", [])
        refuse("branches at node 1", face.add_surface, "bad", [[0, 1], [0, 2]])
        refuse("no length", face.add_surface, "bad", [[1, 1]])
        low = face.add_surface("low", [[1, 0]])
        up = face.add_surface("up", np.array([[3, 2]], np.int64))
        side = face.add_surface("side", [[2, 1]])
        assert (low, up, side) == (0, 1, 2)
        refuse("master is 3, not in 0..2", face.add_pair, low, 3)
        refuse("slave is 'low', not an integer", face.add_pair, "low", 1)
        refuse("formulation is 'glue', not one of 'node to", face.add_pair, up, low, "glue")
        refuse("smoothing is 3", face.add_pair, up, low, smoothing=3)
        refuse("n_point is 11, not in 1..10", face.add_pair, up, low, n_point=11)
        refuse("n_point is 1, not in 2..10", face.add_pair, up, low, n_point=1)
        refuse("normal_angle is 181", face.add_pair, up, low, normal_angle=181)
        refuse("smoothing_angle", face.add_pair, up, low, smoothing_angle=np.inf)
        refuse("both surface up", face.add_tie, up, up)
        refuse("tolerance is -1", face.add_tie, up, low, tolerance=-1)
        refuse("initiation is 'late'", face.configure, initiation="late")
        refuse("gap_tolerance is -1, below 0", face.configure, gap_tolerance=-1)
        refuse("share node 3", face.add_pair, up, side, "node to segment")
    with Interface(SQUARE) as face:
        low, up = face.add_surface("low", [[1, 0]]), face.add_surface("up", [[3, 2]])
        face.add_pair(up, low)
        refuse(r"held .*\(4, 2\)", face.prepare, np.zeros((4, 3), bool))
        refuse("True and False", face.prepare, np.zeros((4, 2), int))
        assert face.prepare().shape == (4, 2)


def test_bad_steps_are_refused_and_the_interface_stays_usable() -> None:
    face, u0, du = two_strips()
    none = np.zeros(face.n_contact, bool)

    def refuse(text: str, call: object, *arguments: object) -> None:
        with pytest.raises(InputError, match=text):
            call(*arguments)

    with face:
        bad = du.copy()
        bad[3, 1] = np.inf
        refuse("du .*finite", face.begin_step, u0, bad, none)
        refuse(r"u0 .*\(16, 2\), not \(2, 16\)", face.begin_step, u0.T, du, none)
        refuse("was_active", face.begin_step, u0, du, none[1:])
        refuse("was_active", face.begin_step, u0, du, none.astype(int))
        refuse("no step of contact was begun", face.gaps, u0, du)
        refuse("no step of contact was begun", face.evaluate, u0, du)
        face.begin_step(u0, du, none)
        refuse("do not ascend", face.choose, u0, du, [2, 1], [0.0, 0.0])
        refuse(r"contact\[0\] is 7", face.choose, u0, du, [7], [0.0])
        refuse("target", face.choose, u0, du, [2], [0.0, 0.0])
        all_of_them = ~none
        face.select(u0, du, all_of_them)
        refuse("no constraints were evaluated", face.curvature, np.ones(7))
        refuse("constraints were selected", face.null_space)
        refuse(r"lam .*\(7,\)", face.curvature, [1.0])
        refuse("no null space", face.particular, np.zeros(7))
        found = face.evaluate(u0, du)
        refuse("lam is not finite", face.second_times, np.full(7, np.nan), du)
        refuse("direction", face.second_times, np.ones(7), du[1:])
        refuse("magnitude", face.update_active, u0, du, np.ones(7), all_of_them, du[1:])
        refuse("not the set", face.update_active, u0, du, np.ones(7), none)
        refuse("there is no tie", face.tie_matrices)
        far = u0.copy()
        far[9:, 1] += 100
        face.begin_step(far, du, none)
        refuse(r"constraint 1 \(slave node 10 of pair 1\)", face.select, far, du, all_of_them)
        face.begin_step(u0, du, none)
        face.select(u0, du, all_of_them)
        assert (face.evaluate(u0, du).g.data == found.g.data).all()


def test_calls_before_prepare_after_it_and_after_close() -> None:
    face = Interface(SQUARE)
    with pytest.raises(InputError, match="before Interface.prepare"):
        face.begin_step(SQUARE, SQUARE, [])
    face.close()
    face, u0, du = two_strips()
    with pytest.raises(InputError, match="after Interface.prepare"):
        face.add_surface("late", [[1, 0]])
    face.close()
    face.close()
    for call in (lambda: face.positions, lambda: face.gaps(u0, du), face.links, face.prepare,
                 lambda: face.notes, face.null_space):
        with pytest.raises(InputError, match="closed"):
            call()


def test_fields_over_other_nodes_are_refused_below_python_too() -> None:
    """What the package hands over has been looked at there; the functions below look again."""
    face, u0, _ = two_strips()
    handle, short = face._handle, u0[1:].copy()
    flags, contacts = np.zeros(short.shape, np.int32), np.zeros(face.n_contact, np.int32)
    numbers = np.zeros(0)
    assert _core.emcon_begin_contact(handle, u0, u0, contacts)[0] == 0
    for name, *arguments in (
        ("hold", flags), ("get_positions", len(short)), ("follow", short), ("gather", short),
        ("begin_contact", short, short, contacts), ("get_gaps", short, short, face.n_contact),
        ("select", short, short, contacts), ("choose", short, short, contacts[:0], numbers),
        ("evaluate_contact", short, short), ("curvature_times", numbers, short),
        ("update_active", short, short, numbers, short, contacts),
        ("get_areas", short, face.n_contact), ("overlap", short, short),
        ("multipliers", len(short), short, face.n_contact),
    ):  # fmt: skip
        answer = getattr(_core, f"emcon_{name}")(handle, *arguments)
        assert (answer[0] if isinstance(answer, tuple) else answer) == 2, name
    with pytest.raises(_core.__core_error, match="len_du==n_node"):
        _core.emcon_evaluate_contact(handle, u0, short)
    assert _core.emcon_evaluate_contact(handle, u0, u0)[0] == 0


def test_use_from_two_threads_at_once_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    face, u0, du = two_strips()
    choose_all(face, u0, du)
    inside, leave = threading.Event(), threading.Event()

    class Slow:
        def __getattr__(self, name: str) -> object:
            return getattr(_core, name)

        def emcon_evaluate_contact(self, *arguments: object) -> object:
            inside.set()
            assert leave.wait(60)
            return _core.emcon_evaluate_contact(*arguments)

    monkeypatch.setattr(interface_module, "_core", Slow())
    with face, ThreadPoolExecutor(1) as pool:
        found = pool.submit(face.evaluate, u0, du)
        assert inside.wait(60)
        for call in (lambda: face.gaps(u0, du), lambda: face.positions, face.close):
            with pytest.raises(InputError, match="another thread"):
                call()
        leave.set()
        assert found.result().n >= 5
        assert face.gaps(u0, du).is_near.any()


def test_cycles_lose_no_memory() -> None:
    def cycle(n: int) -> int:
        """Bytes of the process after `n` interfaces that were made, used and closed."""
        for _ in range(n):
            face, u0, du = two_strips(formulation="mortar")
            with face:
                choose_all(face, u0, du)
                found = face.evaluate(u0, du)
                face.curvature(np.ones(found.n))
                face.null_space()
            with pytest.raises(InputError):
                Interface([[np.nan, 0]])
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return 4096*pages

    if not Path("/proc/self/statm").exists():
        pytest.skip("the size of the process cannot be told here")
    before = cycle(100)
    # An interface that is lost has some 50 kB.
    assert cycle(300) - before < 300*1024
