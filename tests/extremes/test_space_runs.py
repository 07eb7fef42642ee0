"""Runs in three dimensions: in other units, with threads, restarted, interrupted and killed."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from scene_tools import Run, emcon, run_deck, start, wait_for

sys.path[:0] = [str(Path(__file__).parents[1]/"scenes")]

from space_mesh import KINDS, Block  # noqa: E402

#: Exponents of two of the units of length, mass and time.
UNITS = [(3, 0, 0), (0, 5, 0), (0, 0, -4), (-10, 20, -7), (-40, 33, 17), (60, -50, 40)]
ENERGIES = ("kinetic", "strain", "external_work", "total")
#: Powers of length, mass and time of columns and fields.
COLUMNS = ({"time": (0, 0, 1), "newton": (0, 0, 0), "cuts": (0, 0, 0)}
           | dict.fromkeys(ENERGIES, (2, 1, -2)) | dict.fromkeys(("px", "py", "pz"), (1, 1, -1))
           | dict.fromkeys(("lx", "ly", "lz"), (2, 1, -1)))
FIELDS = {"displacement": (1, 0, 0), "velocity": (1, 0, -1), "reaction_force": (1, 1, -2),
          "cauchy_stress": (-1, 1, -2), "von_mises": (-1, 1, -2), "strain_energy": (2, 1, -2)}


def scene(kind: str, units: tuple[int, int, int] = (0, 0, 0), n: int = 12, cells: int = 2,
          restart: str = "") -> str:
    """A bar that is clamped at one end spins up: it falls under gravity, pressed on one face."""
    length, mass, time_ = units

    def of(value: float, *powers: int) -> str:
        return repr(float(np.ldexp(value, int(np.dot(powers, units)))))

    mesh = Block(kind, (cells, 1, 1), (2, 1, 1), shake=0.05)
    mesh.x = np.ldexp(mesh.x, length)
    face = next(mesh.outer_faces())
    held = "".join(f"{k}, 1, 3\n" for k in mesh.on(0, 0))
    spin = "".join(f"{k}, {a + 1}, {of(0.3*mesh.grid[k - 1, 0] - 0.1*a, 1, 0, -1)}\n"
                   for k in mesh.on(0, 1) for a in range(3))
    law = f"*HYPERELASTIC, NEO HOOKE\n{of(20.0, -1, 1, -2)}, {of(0.01, 1, -1, 2)}\n"
    return mesh.deck(law, f"*BOUNDARY\n{held}*INITIAL CONDITIONS, TYPE=VELOCITY\n{spin}"
                     f"*STEP, NLGEOM, INC=100000\n*DYNAMIC, DIRECT\n{of(0.05, 0, 0, 1)}, "
                     f"{of(0.05*n, 0, 0, 1)}\n*DLOAD\nALL, GRAV, {of(1.5, 1, 0, -2)}, 0.6, 0., -0.8\n"
                     f"{face[0]}, P{face[1]}, {of(0.75, -1, 1, -2)}\n{restart}"
                     "*NODE FILE, FREQUENCY=4\nU, V, RF\n*EL FILE, FREQUENCY=4\nS, ENER\n"
                     "*END STEP\n", density=of(0.5, -3, 1, 0))


def run(text: str, folder: Path, *options: str) -> Run:
    folder.mkdir(exist_ok=True)
    (folder/"deck.inp").write_text(text)
    return run_deck(folder/"deck.inp", folder, options=options)


def arrays(run: Run) -> dict[str, bytes]:
    """The numbers of the field file, without times of the processor."""
    found = {}

    def take(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and "cpu" not in name and "SECONDS" not in name:
            found[name] = np.asarray(item[()]).tobytes()

    with h5py.File(run.file(".vtkhdf")) as content:
        content.visititems(take)
    return found


def assert_same(one: Run, other: Run) -> None:
    assert one.digits() == other.digits()
    found, expected = arrays(one), arrays(other)
    assert found.keys() == expected.keys()
    assert [name for name in found if found[name] != expected[name]] == []


@pytest.mark.parametrize("kind", KINDS)
def test_other_units_have_the_same_bits(kind: str, tmp_path: Path) -> None:
    base = run(scene(kind), tmp_path/"base")
    fields = base.fields()
    assert base.history["strain"].max() > 0
    assert set(FIELDS) <= set(fields.names())
    for units in UNITS:
        other = run(scene(kind, units), tmp_path/"_".join(map(str, units)))
        for name, powers in COLUMNS.items():
            found = np.ldexp(other.history[name], -int(np.dot(powers, units)))
            assert np.array_equal(found, base.history[name]), (units, name)
        frames = other.fields()
        for name, powers in FIELDS.items():
            found = np.ldexp(frames[name], -int(np.dot(powers, units)))
            assert np.array_equal(found, fields[name]), (units, name)


@pytest.mark.parametrize("kind", KINDS)
def test_bits_do_not_depend_on_threads(kind: str, tmp_path: Path) -> None:
    text = scene(kind, cells=12, n=4 if kind == "C3D8" else 2)
    base = run(text, tmp_path/"1", "--threads", "1")
    for n in (2, 3, 4, 7) if kind == "C3D8" else (7,):      # all kinds go through one loop
        assert_same(run(text, tmp_path/str(n), "--threads", str(n)), base)


RESTART = "*RESTART, WRITE, FREQUENCY=3\n"


@pytest.mark.parametrize("kind", KINDS)
def test_interrupted_and_gone_on_with(kind: str, tmp_path: Path) -> None:
    """All that a stop at any increment leaves leads to the same bits."""
    text = scene(kind, n=150, cells=3, restart=RESTART)
    base = run(text, tmp_path/"whole")
    deck = tmp_path/"deck.inp"
    deck.write_text(text)
    process = start(deck, "--quiet", "--output", tmp_path)
    wait_for(tmp_path/"deck.rst.h5", process)
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=60)
    found = Run(tmp_path/"deck")
    assert process.returncode == 130
    assert len(found.history) < 151
    done = emcon("restart", found.file(".rst.h5"), "--quiet")
    assert done.returncode == 0, done.stderr
    assert_same(Run(tmp_path/"deck"), base)


@pytest.mark.parametrize("seed", range(4))
def test_killed_at_random_moments(seed: int, tmp_path: Path) -> None:
    chance = random.Random(seed)
    kind = KINDS[seed % len(KINDS)]
    text = scene(kind, n=150, cells=3, restart=RESTART)
    begin = time.monotonic()
    base = run(text, tmp_path/"whole")
    seconds = time.monotonic() - begin
    deck, found = tmp_path/"deck.inp", Run(tmp_path/"deck")
    deck.write_text(text)
    for _ in range(3):
        goes_on = found.file(".rst.h5").exists()
        order = ["restart", found.file(".rst.h5")] if goes_on else [deck, "--output", tmp_path]
        process = start(*order, "--quiet")
        try:
            process.wait(chance.uniform(0, seconds))
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
        process.communicate(timeout=60)
        assert process.returncode in (0, -signal.SIGKILL)
        for suffix in (".vtkhdf", ".rst.h5"):
            if found.file(suffix).exists():
                h5py.File(found.file(suffix)).close()
    goes_on = found.file(".rst.h5").exists()
    done = emcon(*(["restart", found.file(".rst.h5")] if goes_on else [deck, "--output", tmp_path]),
                 "--quiet")
    assert done.returncode == 0, done.stderr
    assert_same(Run(tmp_path/"deck"), base)
