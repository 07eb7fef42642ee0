"""What a stepper shows of mesh, sets, fields and bodies, and the files that its runs leave."""

from __future__ import annotations

import copy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT/"pywrap"))

from emcon import (AnalysisError, InputError, Model, ResultError, Results, Stepper,  # noqa: E402
                   mesh)

DECK = ROOT/"input_decks"/"ring.inp"
SETTINGS = {"h": 0.05, "t_end": 1.5}
EPS = np.finfo(float).eps


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Stepper, Path]:
    """The ring at its end, and the base name of what its run left."""
    base = tmp_path_factory.mktemp("recorded")/"ring"
    ring = Stepper(DECK, **SETTINGS)
    assert ring.run(output=base) == 30
    return ring, base


def test_files_of_a_run_are_those_of_the_program(
    recorded: tuple[Stepper, Path], tmp_path: Path
) -> None:
    """To the last bit, but for the time that it took."""
    _, base = recorded
    sets = [part for name, value in SETTINGS.items() for part in ("--set", f"{name}={value}")]
    subprocess.run([ROOT/"build"/"release"/"emcon", DECK, *sets, "--quiet", "--output", tmp_path],
                   check=True)
    with Results(base) as mine, Results(tmp_path/"ring") as theirs:
        names = [name for name in theirs.history.dtype.names if name != "cpu"]
        assert mine.history.dtype == theirs.history.dtype
        assert all(np.array_equal(mine.history[name], theirs.history[name], equal_nan=True)
                   for name in names)
        assert list(mine.fields) == list(theirs.fields) == [name for name, _ in mine.fields.items()]
        assert np.array_equal(mine.fields.times, theirs.fields.times)
        for name, field in theirs.fields.items():
            assert np.array_equal(mine.fields[name], field, equal_nan=True), name
    log, of_program = (Path(f"{path}.log").read_text().splitlines()
                       for path in (base, tmp_path/"ring"))
    parts = next(k for k, line in enumerate(of_program) if line.startswith("phase "))
    assert log == of_program[:parts] and log[-1].startswith("verdict: good")


def test_a_log_tells_from_where_on_and_what_failed(tmp_path: Path) -> None:
    """A step that is not made leaves its reason, and the record goes on behind it."""
    block = mesh.block(cells=(2, 2))
    model = Model.from_mesh(block)
    model.material("RUBBER", coupled_neo_hooke=(100.0, 0.3)).section("RUBBER", "BLOCK")
    model.boundary("BLOCK_BOTTOM")
    model.step("STATIC", h=0.25, nlgeom=True).boundary("BLOCK_TOP", 2, -1.5)
    with model.stepper() as stepper:
        stepper.step()
        (tmp_path/"run.json").write_text("of a run before")
        with pytest.raises(AnalysisError) as caught:
            stepper.run(output=tmp_path)
        assert not (tmp_path/"run.json").read_text().startswith("of a run before")
        log = (tmp_path/"run.log").read_text().splitlines()
        made = [int(line.split()[0]) for line in log if line[:10].strip().isdigit()]
    assert Path(__file__).name in log[0]
    assert "recorded from increment 1 on, time 0.25" in log
    assert str(caught.value) in log and made == [2]


def test_a_name_is_recorded_into_by_one_at_a_time(tmp_path: Path) -> None:
    with Stepper(DECK, **SETTINGS) as ring, Stepper(DECK, **SETTINGS) as other:
        with pytest.raises(OSError, match="ring.log"):
            ring.run(output=tmp_path/"ring", callback=lambda *_: other.run(output=tmp_path/"ring"))
        assert other.run(until=0.1, output=tmp_path/"ring") == 2
    with Results(tmp_path/"ring") as result:
        assert len(result.history) == 3


def test_fields_are_those_of_the_file(recorded: tuple[Stepper, Path]) -> None:
    ring, base = recorded
    with Results(base) as results:
        fields = results.fields
        assert "von_mises" in fields and "none" not in fields and len(fields) == 11
        for shown, name in ((ring.stress, "cauchy_stress"), (ring.von_mises, "von_mises"),
                            (ring.strain_energy, "strain_energy"),
                            (ring.reactions, "reaction_force"), (ring.u, "displacement"),
                            (ring.contact_forces, "contact_force"),
                            (ring.field("cstr")[:, 0], "contact_pressure"),
                            (ring.field("CDIS"), "contact_gap")):
            kept = fields[name][-1]
            assert np.array_equal(shown, kept[:, :2] if shown.shape[1:] == (2,) else kept,
                                  equal_nan=True), name
    assert np.isclose(ring.strain_energy.sum(), ring.ledger["strain"], rtol=1e3*EPS)
    s = np.zeros((ring.n_node, 3, 3))
    for k, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        s[:, i, j] = s[:, j, i] = ring.stress[:, k]
    deviator = s - np.trace(s, axis1=1, axis2=2)[:, None, None]*np.eye(3)/3
    von_mises = np.sqrt(1.5*(deviator**2).sum((1, 2)))
    assert np.allclose(ring.von_mises, von_mises, rtol=1e3*EPS, atol=100*EPS*von_mises.max())


def test_mesh_is_that_of_the_deck(recorded: tuple[Stepper, Path]) -> None:
    ring, _ = recorded
    deck = mesh.read(DECK)
    (cells,), (rows,) = ring.cells.values(), ring.cell_elements.values()
    assert list(ring.cells) == ["quad"] and np.array_equal(rows, np.arange(ring.n_element))
    assert np.array_equal(ring.labels[cells], deck.elements["CPE4"])
    assert np.array_equal(ring.element_labels, deck.element_labels["CPE4"])
    assert ring.names() == {"node sets": list(deck.node_sets),
                            "element sets": list(deck.element_sets),
                            "surfaces": list(deck.surfaces)}
    for name, labels in deck.node_sets.items():
        assert np.array_equal(ring.labels[ring.node_set(name)], np.sort(labels))
    for name, labels in deck.element_sets.items():
        assert np.array_equal(ring.element_labels[ring.element_set(name.lower())], np.sort(labels))
    for name, faces in deck.surfaces.items():
        found = ring.surface(name)
        found = np.column_stack([ring.element_labels[found[:, 0]], found[:, 1]])
        assert sorted(found.tolist()) == sorted(faces.tolist())


def test_bodies_add_up(recorded: tuple[Stepper, Path]) -> None:
    """Masses by the area; momenta as the library tells them; energies sum to the ledger."""
    ring, _ = recorded
    bodies = ring.bodies()
    ledger, momenta = ring.ledger, ring.body_momenta()
    assert len(bodies) == ring.n_body == 2
    assert sum(len(body.nodes) for body in bodies) == ring.n_node
    tolerance = 1e3*EPS*ledger["total"]
    assert abs(sum(body.kinetic for body in bodies) - ledger["kinetic"]) < tolerance
    assert abs(sum(body.strain for body in bodies) - ledger["strain"]) < tolerance
    for body, (px, py, lz) in zip(bodies, momenta):
        p = body.mass*body.velocity
        assert np.allclose(p, (px, py), atol=1e3*EPS*np.abs(momenta).max())
        about_origin = body.spin + body.centre[0]*p[1] - body.centre[1]*p[0]
        assert abs(about_origin - lz) < 1e4*EPS*np.abs(momenta).max()
    corners = ring.positions[ring.cells["quad"]]
    x, y = corners[..., 0], corners[..., 1]
    area = 0.5*((x*np.roll(y, -1, 1) - np.roll(x, -1, 1)*y).sum(1))
    density = {0: None, 1: None}
    for k, body in enumerate(bodies):
        of_body = np.isin(ring.cells["quad"][:, 0], body.nodes)
        density[k] = body.mass/area[of_body].sum()
    text = DECK.read_text().upper().split("*DENSITY")[1:]
    assert np.allclose(sorted(density.values()),
                       sorted(float(part.split("\n")[1].split(",")[0]) for part in text))


def test_a_part_of_a_run_is_recorded_alone(tmp_path: Path) -> None:
    with Stepper(DECK, h=0.05, t_end=0.5) as ring:
        assert ring.t_end == 0.5 and ring.fraction == 0.0
        ring.run(until=0.2)
        assert ring.fraction == pytest.approx(0.4, rel=100*EPS)
        with pytest.raises(InputError, match="output="):
            ring.results()
        ring.run(until=0.3, output=tmp_path)
        ring.run()
        assert ring.fraction == 1.0
    with ring.results() as part:
        assert str(tmp_path/"run") in repr(part)
        assert np.allclose(part.history["time"], [0.2, 0.25, 0.3])
        fields = part.fields
        assert "run.vtkhdf" in repr(fields)
    assert "closed" in repr(fields)
    assert (tmp_path/"run.json").is_file()


def test_what_a_callback_raises_leaves_whole_files(tmp_path: Path) -> None:
    def stop(stepper: Stepper, _: object) -> None:
        if stepper.time > 0.09:
            raise KeyError("enough")

    with Stepper(DECK, h=0.05, t_end=0.5) as ring:
        with pytest.raises(KeyError):
            ring.run(callback=stop, output=tmp_path/"part")
        with Results(tmp_path/"part") as part:
            assert len(part.history) == 3
            assert np.isclose(part.fields.times[-1], 0.1)    # the deck asks for one each tenth
        assert ring.run(output=tmp_path/"rest") == 8


def test_progress_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    with Stepper(DECK, h=0.05, t_end=0.1) as ring:
        ring.run(progress=True)
    told = capsys.readouterr()
    assert "100%  time 0.1  increments 2" in told.err and not told.out


@pytest.mark.parametrize("call", [
    lambda s, _: s.field("NONE"), lambda s, _: s.field(7), lambda s, _: s.surface("NONE"),
    lambda s, _: s.element_set("NONE"), lambda s, _: s.element_set(""),
    lambda s, _: s.surface("A\0"),
    lambda s, path: s.run(output=path/"one", callback=lambda s, i: s.run(output=path/"two")),
])  # fmt: skip
def test_what_is_not_there_is_refused(call: object, tmp_path: Path) -> None:
    with Stepper(DECK, h=0.05, t_end=0.5) as ring, pytest.raises(InputError):
        call(ring, tmp_path)


def test_files_and_copies_that_cannot_be(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no such file") as caught:
        Stepper(tmp_path/"none.inp")
    assert isinstance(caught.value, InputError)
    with pytest.raises(FileNotFoundError, match="no result") as missing:
        Results(tmp_path/"none")
    assert isinstance(missing.value, ResultError)
    with Stepper(DECK) as ring:
        with pytest.raises(FileNotFoundError):
            ring.run(output=tmp_path/"no"/"such")
        with pytest.raises(TypeError, match="cannot be copied"):
            copy.copy(ring)
        (tmp_path/"taken.vtkhdf").mkdir()
        with pytest.raises(OSError):
            ring.run(output=tmp_path/"taken")
        assert ring.time == 0.0 and ring.run(until=0.01) == 1
