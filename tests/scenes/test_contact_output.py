"""What contact writes: forces on both sides, sums per pair, fields of nodes in several pairs."""

import dataclasses
import shutil
import sys

import h5py
import numpy as np
import pytest
from scene_tools import EPSILON, ROOT, Deck, emcon, run_deck

sys.path.insert(0, str(ROOT / "pywrap"))

from emcon.results import locate, read_pairs  # noqa: E402
from emcon.stepper import Stepper  # noqa: E402

FORMULATIONS = ["NODE TO SURFACE", "SEGMENT", "MORTAR"]
PROCEDURES = ["DYNAMIC", "STATIC"]
THICKNESS = 2.0

#: Nodes of the slave surface (0-based), the left side from above, then the bottom.
CHAIN = [3, 2, 1, 0, 4, 8, 12]

#: Round-off of a sum of contact forces, in units of epsilon times the sum of their sizes: each is
#: the multiplier times a discrete gradient, a handful of products and sums.
NOISE = 8


def grid(first, corner, size, count):
    """Nodes and CPE4 elements of a rectangle, upwards then to the right, with labels from `first`.

    Element (i, j) has the faces S1 below, S2 on the right, S3 above, S4 on the left.
    """
    (x, y), (a, b), (m, n) = corner, size, count
    nodes = [
        f"{first + i*(n + 1) + j}, {x + a*i/m!r}, {y + b*j/n!r}"
        for i in range(m + 1)
        for j in range(n + 1)
    ]
    elements = []
    for i in range(m):
        for j in range(n):
            k = first + i*(n + 1) + j
            elements.append(f"{first + i*n + j}, {k}, {k + n + 1}, {k + n + 2}, {k + 1}")
    return nodes, elements


def corner_deck(formulation, procedure):
    """A block goes into the corner of a floor and a wall, both its masters; its edge is one slave.

    Its lower left node touches both. Floor and wall pass through each other where they meet.
    """
    lines = ["*HEADING", "block into a corner"]
    for name, first, *shape in (
        ("BLOCK", 1, (0.02, 0.013), (1.0, 1.0), (3, 3)),
        ("FLOOR", 101, (-1.0, -1.0), (3.1, 1.0), (4, 1)),
        ("WALL", 201, (-1.0, -1.0), (1.0, 3.3), (1, 4)),
    ):
        nodes, elements = grid(first, *shape)
        lines += [f"*NODE, NSET={name}", *nodes, f"*ELEMENT, TYPE=CPE4, ELSET={name}", *elements]
    lines += """*NSET, NSET=HELD
101, 103, 105, 107, 109, 201, 202, 203, 204, 205
*NSET, NSET=HEAD
8, 12, 16
*NSET, NSET=BACK
14, 15, 16
*ELSET, ELSET=UPPER
101, 102, 103, 104
*ELSET, ELSET=RIGHT
201, 202, 203, 204
*SURFACE, NAME=EDGE, TYPE=ELEMENT
3, S4
2, S4
1, S4
1, S1
4, S1
7, S1
*SURFACE, NAME=FLOOR_TOP, TYPE=ELEMENT
UPPER, S3
*SURFACE, NAME=WALL_SIDE, TYPE=ELEMENT
RIGHT, S2
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, COUPLED NEO HOOKE
1000., 0.3
*DENSITY
1.""".split("\n")
    for name in ("BLOCK", "FLOOR", "WALL"):
        lines += [f"*SOLID SECTION, ELSET={name}, MATERIAL=RUBBER", f"{THICKNESS}"]
    lines += ["*SURFACE INTERACTION, NAME=FRICTIONLESS"]
    lines += ["*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD"]
    for master in ("FLOOR_TOP", "WALL_SIDE"):
        lines += [f"*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE={formulation}, SIDES=ONE",
                  f"EDGE, {master}"]
    step = "*NODE FILE\nU\n*CONTACT FILE\nCDIS, CSTR, CF\n*CONTACT PRINT, TOTALS=YES\n"
    step += "CDIS, CSTR, CF\n*RESTART, WRITE, FREQUENCY=1"
    if procedure == "DYNAMIC":
        lines += ["*INITIAL CONDITIONS, TYPE=VELOCITY", "BLOCK, 1, -1.", "BLOCK, 2, -1.3"]
        lines += ["*STEP, NLGEOM, INC=100000", "*DYNAMIC, DIRECT", "0.002, 0.1", step, "*END STEP"]
    else:
        lines += ["*STEP, NLGEOM, INC=1000", "*STATIC, DIRECT", "0.1, 1.", "*BOUNDARY"]
        lines += ["HELD, 1, 2", "BACK, 1, 1, -0.05", "HEAD, 2, 2, -0.04", step, "*END STEP"]
    return Deck("\n".join(lines), "corner")


@pytest.fixture(
    scope="module",
    params=[(f, p) for f in FORMULATIONS for p in PROCEDURES],
    ids=lambda param: "-".join(param).lower().replace(" ", "-"),
)
def case(request, tmp_path_factory):
    """The finished run with its formulation and procedure."""
    formulation, procedure = request.param
    run = run_deck(corner_deck(formulation, procedure), tmp_path_factory.mktemp("corner"))
    # The parts of an increment that was cut balance each on its own mid-configuration.
    assert procedure == "STATIC" or not run.history["cuts"].any()
    return run, formulation, procedure


def where_forces_act(run, procedure):
    """Positions at which the contact forces of each frame balance: in dynamics those half a step
    before, as the gradients are of the mid-configuration, in statics those of the end."""
    fields = run.fields()
    u = fields["displacement"].copy()
    if procedure == "DYNAMIC":
        u[1:] = 0.5*(u[1:] + u[:-1])
    return fields.x + u


def with_moment(place, force):
    """fx, fy, moment about the origin."""
    return np.concatenate(
        [force, (place[..., :1]*force[..., 1:] - place[..., 1:]*force[..., :1])], axis=-1
    )


def forces(run, procedure):
    """Force and moment on each node, all frames, and the size that their sums round by."""
    place, force = where_forces_act(run, procedure), run.fields()["contact_force"]
    scale = np.abs(force).sum(axis=(1, 2))
    scale = np.stack([scale, scale, scale*np.abs(place).max()], axis=-1)
    return with_moment(place, force), NOISE*EPSILON*scale


def pair_series(run, variable):
    return run.series("PAIRS", variable)[1]


def by_constraint(run, variable):
    """Values, nodes (0-based) and pairs (from 1) of what is written per possible constraint."""
    with h5py.File(run.file(".h5"), "r") as file:
        group = file["sets/CONTACT"]
        label, pair = group[f"{variable}_label"][:], group[f"{variable}_pair"][:]
        return group[variable][:], label - 1, pair


def test_the_scene_has_what_is_to_be_tested(case):
    """Both pairs act, and both at the corner node at once."""
    run, _, _ = case
    values, node, pair = by_constraint(run, "CSTR")
    at_corner = [values[:, (node == 0) & (pair == k), 1].ravel() for k in (1, 2)]
    assert (at_corner[0]*at_corner[1]).any()
    assert list(np.unique(pair)) == [1, 2]
    with h5py.File(run.file(".h5"), "r") as file:
        assert list(file["sets/PAIRS/SLAVE"][:]) == [b"EDGE", b"EDGE"]
        assert list(file["sets/PAIRS/MASTER"][:]) == [b"FLOOR_TOP", b"WALL_SIDE"]


def test_contact_forces_and_their_moments_balance(case):
    run, _, procedure = case
    force, noise = forces(run, procedure)
    assert np.abs(force).max() > 0
    assert (np.abs(force.sum(axis=1)) <= noise).all()


def test_totals_are_the_sums_of_the_field(case):
    """Each side of each pair has a body of its own but for the block, which has both slaves."""
    run, _, procedure = case
    force, noise = forces(run, procedure)
    block, floor, wall = force[:, :16], force[:, 16:26], force[:, 26:36]
    slave, master = pair_series(run, "CF"), pair_series(run, "CF_MASTER")
    assert (np.abs(slave.sum(axis=1) - block.sum(axis=1)) <= noise).all()
    assert (np.abs(master[:, 0] - floor.sum(axis=1)) <= noise).all()
    assert (np.abs(master[:, 1] - wall.sum(axis=1)) <= noise).all()
    assert (np.abs(slave + master) <= noise[:, None]).all()
    assert np.abs(slave).max(axis=0).all()


def test_forces_per_constraint_are_those_of_their_pair(case):
    run, _, procedure = case
    _, noise = forces(run, procedure)
    values, _, pair = by_constraint(run, "CF")
    total = pair_series(run, "CF")
    for k in (1, 2):
        difference = values[:, pair == k].sum(axis=1) - total[:, k - 1, :2]
        assert (np.abs(difference) <= noise[:, :2]).all()
    difference = run.series("CONTACT", "TOTAL_CF")[1][:, 0] - total[..., :2].sum(axis=1)
    assert (np.abs(difference) <= noise[:, :2]).all()


def test_numbers_of_constraints_and_lengths_in_contact(case):
    run, _, _ = case
    values, _, pair = by_constraint(run, "CSTR")
    number, length = pair_series(run, "CNUM"), pair_series(run, "CONTACT_LENGTH")
    np.testing.assert_array_equal(number.sum(axis=1), run.history["active"])
    for k in (1, 2):
        np.testing.assert_array_equal(number[:, k - 1], values[:, pair == k, 1].sum(axis=1))
    np.testing.assert_array_equal(length > 0, number > 0)
    assert length.max() <= slave_edges(run).sum(axis=1).max()*(1 + NOISE*EPSILON)


def slave_edges(run):
    """Lengths of the edges of the slave surface, all frames."""
    fields = run.fields()
    return np.linalg.norm(np.diff((fields.x + fields["displacement"])[:, CHAIN], axis=1), axis=2)


@pytest.mark.parametrize("case", [("NODE TO SURFACE", p) for p in PROCEDURES], indirect=True)
def test_nodes_carry_half_of_their_edges(case):
    """Length in contact, and the area that turns force into pressure, of node to segment.

    The force acts along the discrete gradient of the gap, its size differs from the multiplier's
    by the turn of the surface within a step.
    """
    run, _, _ = case
    values, node, pair = by_constraint(run, "CSTR")
    force, _, _ = by_constraint(run, "CF")
    edge = slave_edges(run)
    share = np.zeros((len(edge), 16))
    share[:, CHAIN[:-1]] += 0.5*edge
    share[:, CHAIN[1:]] += 0.5*edge
    length = values[..., 1]*share[:, node]
    for k in (1, 2):
        np.testing.assert_allclose(
            length[:, pair == k].sum(axis=1),
            pair_series(run, "CONTACT_LENGTH")[:, k - 1],
            rtol=NOISE*EPSILON,
        )
    np.testing.assert_allclose(
        values[..., 0]*length*THICKNESS, np.linalg.norm(force, axis=2), rtol=1e-3, atol=0
    )


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_pressures_do_not_depend_on_what_else_is_asked_for(tmp_path, formulation):
    deck = corner_deck(formulation, "STATIC")
    with_gaps, _, _ = by_constraint(run_deck(deck, tmp_path / "all"), "CSTR")
    deck.replace("CDIS, CSTR, CF", "CSTR")
    alone, _, _ = by_constraint(run_deck(deck, tmp_path / "some"), "CSTR")
    np.testing.assert_array_equal(with_gaps, alone)
    assert (alone[..., 0] > 0).any()


def test_fields_of_a_node_in_two_pairs(case):
    """Sum of the pressures, smallest gap, active if it is so in one; none off the slave nodes."""
    run, _, _ = case
    fields = run.fields()
    n_frame, n_node = fields["contact_gap"].shape[:2]
    gap, node, _ = by_constraint(run, "CDIS")
    values, _, _ = by_constraint(run, "CSTR")
    assert len(np.unique(node)) == len(node)/2
    expected = np.full((3, n_frame, n_node), [[[np.inf]], [[0.0]], [[0.0]]])
    for k, i in enumerate(node):
        expected[0, :, i] = np.fmin(expected[0, :, i], gap[:, k])
        expected[1, :, i] += values[:, k, 0]
        expected[2, :, i] = np.maximum(expected[2, :, i], values[:, k, 1])
    expected[0][np.isinf(expected[0])] = np.nan
    for name, field in zip(("contact_gap", "contact_pressure", "contact_active"), expected):
        np.testing.assert_array_equal(fields[name].reshape(n_frame, n_node), field, name)
    assert np.isnan(gap).any() and not np.isnan(fields["contact_gap"][:, node]).all()


def test_the_number_of_constraints_needs_no_totals(tmp_path):
    deck = corner_deck(FORMULATIONS[0], "STATIC")
    deck.remove("*CONTACT PRINT")
    deck.insert("*CONTACT PRINT\nCNUM")
    run = run_deck(deck, tmp_path)
    np.testing.assert_array_equal(pair_series(run, "CNUM").sum(axis=1), run.history["active"])
    with h5py.File(run.file(".h5"), "r") as file:
        assert "CF" not in file["sets/PAIRS"] and "CONTACT" not in file["sets"]
    assert read_pairs(locate(run.base)) is None


# ---- restart ------------------------------------------------------------------------------------


def data_sets(path):
    """All data of NAME.h5 but the time it took."""
    found = {}

    def visit(name, item):
        if isinstance(item, h5py.Dataset) and not name.endswith("/cpu") and "/RUN/" not in name:
            found[name] = item[...].tobytes()

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return found


def closing_lines(run):
    """What the log says last of the pairs."""
    lines = run.log.split("largest error of the energy balance")[-1].splitlines()
    return [line for line in lines if line.startswith("contact ")]


def restart(run, folder):
    """A copy of a run in `folder`, gone on with from its restart file."""
    copy = dataclasses.replace(run, base=folder / run.base.name)
    for path in run.base.parent.iterdir():
        shutil.copy(path, folder)
    done = emcon("restart", copy.file(".rst.h5"), "--quiet")
    assert done.returncode == 0, done.stderr
    return copy


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_restart_in_contact_gives_the_same_bits(tmp_path, formulation):
    """The restart file is of the end of a first step, in which the forces are largest."""
    deck = corner_deck(formulation, "DYNAMIC")
    k = deck.find("*STEP")
    second = [(head, list(data)) for head, data in deck.card[k:]]
    deck.card[k + 1] = (deck.card[k + 1][0], ["0.002, 0.04"])
    deck.card += second
    deck.card[-2] = ("*RESTART, WRITE, FREQUENCY=0", [])
    (tmp_path / "copy").mkdir()
    run = run_deck(deck, tmp_path / "whole")
    assert run.history["active"][20] > 0
    copy = restart(run, tmp_path / "copy")
    assert "resumed after increment 20" in copy.log
    assert copy.digits() == run.digits()
    assert data_sets(copy.file(".h5")) == data_sets(run.file(".h5"))
    assert closing_lines(copy) == closing_lines(run)
    force = np.linalg.norm(pair_series(run, "CF")[..., :2], axis=2)
    assert (force[:20].max(axis=0) > force[20:].max(axis=0)).any()


def test_restart_brings_back_what_pairs_transmit(case, tmp_path):
    """Of a finished run only what the restart file holds can be told."""
    run, _, procedure = case
    copy = restart(run, tmp_path)
    lines = closing_lines(copy)
    assert len(lines) == 2 and lines == closing_lines(run)
    number = [int(line.split(": ")[1].split()[0]) for line in lines]
    assert number == list(pair_series(run, "CNUM")[-1])
    assert procedure == "DYNAMIC" or min(number) > 0


def test_two_requests_for_the_same_share_a_series(tmp_path):
    """Written when either is due, once."""
    deck = corner_deck(FORMULATIONS[0], "STATIC")
    deck.insert("*CONTACT PRINT, TOTALS=ONLY, FREQUENCY=2\nCF", before="*CONTACT PRINT")
    run = run_deck(deck, tmp_path)
    time, force = run.series("PAIRS", "CF")
    np.testing.assert_array_equal(time, run.history["time"])
    assert len(force) == len(time) and force[-1].any()


# ---- Python -------------------------------------------------------------------------------------


def test_python_reads_the_pairs(case):
    run, _, _ = case
    pairs = read_pairs(locate(run.base))
    assert pairs.slave == ("EDGE", "EDGE") and pairs.master == ("FLOOR_TOP", "WALL_SIDE")
    np.testing.assert_array_equal(pairs.time, run.history["time"])
    on_slave = np.concatenate([pairs.force, pairs.moment[..., None]], axis=2)
    on_master = np.concatenate([pairs.master_force, pairs.master_moment[..., None]], axis=2)
    np.testing.assert_array_equal(on_slave, pair_series(run, "CF"))
    np.testing.assert_array_equal(on_master, pair_series(run, "CF_MASTER"))
    np.testing.assert_array_equal(pairs.length, pair_series(run, "CONTACT_LENGTH"))
    np.testing.assert_array_equal(pairs.active, pair_series(run, "CNUM"))


def test_python_has_no_pairs_where_none_were_written(tmp_path):
    deck = corner_deck(FORMULATIONS[0], "STATIC")
    deck.remove("*CONTACT PRINT")
    assert read_pairs(locate(run_deck(deck, tmp_path).base)) is None


def test_the_stepper_tells_what_pairs_transmit(case):
    run, _, _ = case
    pairs = read_pairs(locate(run.base))
    with Stepper(run.file(".inp")) as stepper:
        for k in range(len(pairs.time)):
            for i, total in enumerate(stepper.pairs()):
                np.testing.assert_array_equal(total.slave[:2], pairs.force[k, i])
                assert total.slave[2] == pairs.moment[k, i]
                np.testing.assert_array_equal(total.master[:2], pairs.master_force[k, i])
                assert total.length == pairs.length[k, i]
                assert total.active == pairs.active[k, i]
            if not stepper.is_done:
                stepper.step()
        assert stepper.n_pair == 2


#: Two blocks, one on the other.
BLOCKS = """*NODE, NSET=ALL
1, 0., 0.
2, 1., 0.
3, 1., 1.
4, 0., 1.
5, 0.1, 1.
6, 0.9, 1.
7, 0.9, 1.8
8, 0.1, 1.8
*ELEMENT, TYPE=CPE4, ELSET=LOWER
1, 1, 2, 3, 4
*ELEMENT, TYPE=CPE4, ELSET=UPPER
2, 5, 6, 7, 8
*ELSET, ELSET=BOTH
LOWER, UPPER
*MATERIAL, NAME=STUFF
*ELASTIC
100., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=BOTH, MATERIAL=STUFF
<model>
*BOUNDARY
1, 1, 2
2, 1, 2
5, 1
*STEP
*STATIC
1., 1.
*CLOAD
<loaded>, 2, -1.
*CONTACT PRINT
CSTR, CDIS
*END STEP
"""
PAIR = """*SURFACE, NAME=TOP
LOWER, S3
*SURFACE, NAME=FOOT
UPPER, S1
*SURFACE INTERACTION, NAME=HARD
*CONTACT PAIR, INTERACTION=HARD
FOOT, TOP"""


def test_pairs_are_counted_behind_linear_constraints(tmp_path):
    """Conditions of equations come before those of contact; a pair has its number all the same."""
    model = f"*EQUATION\n2\n7, 1, 1., 8, 1, -1.\n2\n7, 2, 1., 8, 2, -1.\n{PAIR}"
    run = run_deck(Deck(BLOCKS.replace("<model>", model).replace("<loaded>", "8")), tmp_path)
    for variable in ("CSTR", "CDIS"):
        _, node, pair = by_constraint(run, variable)
        both = sorted(zip(node, pair, strict=True))     # the reverse is a pair of its own
        assert both == [(2, 2), (3, 2), (4, 1), (5, 1)]


def test_contact_output_without_contact(tmp_path):
    """Nothing is written, as the warning says."""
    deck = BLOCKS.replace("<model>", "*EQUATION\n2\n5, 2, 1., 6, 2, -1.\n2\n5, 2, 1., 4, 2, -1.")
    run = run_deck(Deck(deck.replace("<loaded>", "4")), tmp_path)
    assert "there is no *CONTACT PAIR that is not tied: nothing will be written" in run.errors
    with h5py.File(run.file(".h5"), "r") as file:
        assert "CONTACT" not in file.get("sets", {})


STACK = """*NODE
1, 0., 0.
2, 0.5, 0.
3, 1., 0.
4, 0., 1.
5, 0.5, 1.
6, 1., 1.
11, -3., -1.
12, 0.5, -1.
13, 4., -1.
14, -3., 0.
15, 0.5, 0.
16, 4., 0.
*ELEMENT, TYPE=CPE4, ELSET=BLOCK
1, 1, 2, 5, 4
2, 2, 3, 6, 5
*ELEMENT, TYPE=CPE4, ELSET=FLOOR
11, 11, 12, 15, 14
12, 12, 13, 16, 15
*NSET, NSET=HELD, GENERATE
11, 16
*SURFACE, NAME=FOOT
BLOCK, S1
*SURFACE, NAME=TOP
FLOOR, S3
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=BLOCK, MATERIAL=M
*SOLID SECTION, ELSET=FLOOR, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
{pair}
*BOUNDARY
HELD, 1, 2
2, 1
5, 1
*STEP
*STATIC
1., 1.
*DLOAD
BLOCK, P3, 8.
*CONTACT PRINT
CSTR
*END STEP
"""


@pytest.mark.parametrize("pair", ["FOOT, TOP", "TOP, FOOT"])
def test_pressure_where_nodes_of_both_sides_meet(pair, tmp_path):
    """Whichever of both nodes the constraint belongs to, what is pressed is the block's side."""
    values, _, _ = by_constraint(run_deck(Deck(STACK.format(pair=pair)), tmp_path), "CSTR")
    pressure, acts = values[-1][..., 0], values[-1][..., 1] > 0
    assert acts.sum() >= 3
    # Newton's method ends at 1e-10 of the forces.
    np.testing.assert_allclose(pressure[acts], 8.0, rtol=1e-9)
