"""Rigid surfaces from files of triangles (STL): as meshes of the same faces; free, driven, in a restart; faults of files."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import overlap
import pytest
import stl_files
from contact_space_scenes import bodies, dynamic, faces, turned, velocities
from scene_tools import EPSILON, Run, emcon, run_deck
from space_mesh import Block
from test_contact_output import restart
from wall_space_scenes import FIXED, REFERENCE, cube

#: Energy and momenta, of the largest of each.
BALANCE = 1.0e-11
CARD = "*SURFACE, NAME=W, TYPE=STL, INPUT=box.stl"
PAIR = "*SURFACE INTERACTION, NAME=I\n*CONTACT PAIR, INTERACTION=I\nS1, W\n"


def plate() -> Block:
    """Its top is the plane z = 0, a diagonal of it is below the cube."""
    return Block("C3D4", (2, 2, 1), size=(4, 4, 1), place=lambda x: x - np.array([2.0, 2.0, 1.0]))


def held(card: str = CARD, elements: str = "") -> str:
    return f"*NODE\n{REFERENCE}, 0., 0., -3.\n{card}\n*RIGID BODY, {elements}ANALYTICAL SURFACE=W, REF NODE={REFERENCE}\n"


def falling(card: str = CARD, more: str = "", until: float = 0.5) -> str:
    one = cube(gap=0.13, turn=turned(0.2))
    return (bodies([one], [faces(one)]) + held(card) + PAIR + velocities(one, (0.3, 0.2, -1.), (0., 0.4, 1.))
            + f"*BOUNDARY\n{FIXED}" + dynamic(0.02, until, more))


def ran(folder: Path, text: str) -> Run:
    (folder/"deck.inp").write_text(text)
    return run_deck(folder/"deck.inp", folder)


def said(folder: Path, text: str, code: int = 2) -> str:
    (folder/"deck.inp").write_text(text)
    done = emcon(folder/"deck.inp", "--quiet", "--output", folder)
    assert done.returncode == code, done.stderr
    return done.stderr


def columns(run: Run, names: str) -> np.ndarray:
    return np.array([run.history[name] for name in names.split()]).T


def on_mesh() -> str:
    """The same scene with a rigid mesh, whose faces are the triangles of the file."""
    one, two = cube(gap=0.13, turn=turned(0.2)), plate()
    return (bodies([one, two], [faces(one), faces(two)]) + f"*NODE\n{REFERENCE}, 0., 0., -3.\n*RIGID BODY, ELSET=B2, "
            f"REF NODE={REFERENCE}\n" + PAIR.replace("S1, W", "S1, S2") + velocities(one, (0.3, 0.2, -1.), (0., 0.4, 1.))
            + f"*BOUNDARY\n{FIXED}" + dynamic(0.02, 0.5))


def test_as_a_mesh_of_the_same_faces(tmp_path: Path) -> None:
    """Text, to round-off, with the file in the deck's folder; binary, to that of single precision; in other units."""
    mesh = ran(tmp_path, on_mesh())
    corner = stl_files.outline(plate())
    names = "px py pz lx ly lz kinetic total"
    for scale, is_binary, tolerance in ((1.0, False, 1.0e-12), (1.0, True, 1.0e-6), (1000.0, False, 1.0e-12)):
        stl_files.write(tmp_path/"box.stl", corner*scale, is_binary)
        run = ran(tmp_path, falling(CARD + f", SCALE={1.0/scale!r}"))
        assert run.verdict["verdict"] == "good", run.log[-600:]
        assert np.abs(columns(run, names) - columns(mesh, names)).max() <= tolerance
        assert run.history["active"].max() > 0
        fields = run.fields()
        assert len(fields.x) == 27 + 18 + 1
        assert f"W ({len(corner)} faces)" in run.log


def test_a_free_body(tmp_path: Path) -> None:
    """A rigid body with the mass of its elements and the surface of a file: energy and all six momenta of both."""
    one, two = cube(gap=0.13, turn=turned(0.2)), plate()
    stl_files.write(tmp_path/"box.stl", stl_files.outline(two))
    text = bodies([one, two], [faces(one), []]).replace("*SURFACE, NAME=S2\n", "")
    run = ran(tmp_path, text + held(elements="ELSET=B2, ") + PAIR + velocities(one, (0.3, 0.2, -1.), (0., 0.4, 1.))
              + dynamic(0.02, 0.9))
    assert run.verdict["verdict"] == "good", run.log[-600:]
    assert np.ptp(run.history["total"]) <= BALANCE*run.history["total"].max()
    for names in ("px py pz", "lx ly lz"):
        found = columns(run, names)
        assert np.abs(found - found[0]).max() <= BALANCE
    assert run.history["active"].max() > 0
    assert run.history["active"][-1] == 0
    fields = run.fields()
    assert overlap.worst(fields).depth <= 64*EPSILON


def test_driven(tmp_path: Path) -> None:
    """What a surface of a file does on a body at rest is in the ledger: its push times its way."""
    stl_files.write(tmp_path/"box.stl", stl_files.outline(plate()), is_binary=True)
    one = cube()
    run = ran(tmp_path, bodies([one], [faces(one)]) + held() + PAIR + f"*AMPLITUDE, NAME=RAMP\n0., 0., 1., .8\n*BOUNDARY\n{REFERENCE}, "
              f"1, 2\n{REFERENCE}, 4, 6\n" + dynamic(0.02, 0.6, f"*BOUNDARY, AMPLITUDE=RAMP\n{REFERENCE}, 3, 3, 1.\n"))
    assert run.verdict["verdict"] == "good", run.log[-600:]
    assert run.history["external_work"][-1] == pytest.approx(0.8*run.history["pz"][-1], rel=1.0e-10)
    assert run.history["pz"][-1] > 1.2


def test_lines_of_the_deck(tmp_path: Path) -> None:
    """Nine coordinates a line do as a file does; a restart does not read the file again."""
    corner = stl_files.outline(plate())
    first, second = tmp_path/"first", tmp_path/"second"
    first.mkdir()
    second.mkdir()
    stl_files.write(first/"box.stl", corner)
    lines = "".join(", ".join(map(repr, x)) + "\n" for x in corner.reshape(-1, 9).tolist())
    files = [ran(first, falling(card)).history["pz"] for card in (CARD, "*SURFACE, NAME=W, TYPE=STL\n" + lines.rstrip())]
    assert (files[0] == files[1]).all()
    whole = ran(first, falling(more="*RESTART, WRITE, FREQUENCY=5\n"))
    (first/"box.stl").unlink()
    again = restart(whole, second)
    assert (again.history["pz"] == files[0]).all()


def test_what_is_mended(tmp_path: Path) -> None:
    """Corners that are off by the digits of the file, facets turned over, a facet without area, a hole."""
    corner = stl_files.outline(plate())
    shaken = corner + 1.0e-7*np.random.default_rng(3).uniform(-1, 1, corner.shape)
    shaken[[3, 17]] = shaken[[3, 17]][:, ::-1]
    shaken = np.insert(shaken, 5, shaken[5][[0, 1, 1]], axis=0)
    side = int(np.flatnonzero((corner[:, :, 2] == -1.0).all(1))[-1])
    whole = ran(tmp_path, on_mesh()).history
    assert side > 17
    for holes in ([], [side + 1]):
        stl_files.write(tmp_path/"box.stl", np.delete(shaken, holes, axis=0))
        run = ran(tmp_path, falling())
        assert "2 facets (the first: facet 4) turned over" in run.log
        assert "1 facet (the first: facet 6) without area left out" in run.log
        assert ("not closed: 3 sides" in run.log) == bool(holes)
        assert run.verdict["verdict"] == "good", run.log[-600:]
        assert np.abs(run.history["pz"] - whole["pz"]).max() <= 1.0e-5


def test_faults_of_files(tmp_path: Path) -> None:
    """Each with the file, the line or byte, and the line of the deck."""
    corner = stl_files.outline(plate())
    text, binary = stl_files.text(corner).splitlines(), stl_files.binary(corner)
    nan = bytearray(binary)
    nan[84 + 50 + 12:84 + 50 + 16] = struct.pack("<f", float("nan"))
    three = np.concatenate([corner, corner[:1] + np.array([[0, 0, 0], [0, 0, 0], [0, 0, 1]])])
    strip = [[(np.cos(a/2)*s + 2)*np.cos(a), (np.cos(a/2)*s + 2)*np.sin(a), s*np.sin(a/2)] for a in np.arange(6)*np.pi/3
             for s in (-0.5, 0.5)]
    strip = np.array([*strip, strip[1], strip[0]])
    moebius = np.array([strip[[i, i + 1, i + 2]] if i % 2 == 0 else strip[[i, i + 2, i + 1]] for i in range(12)])
    for content, words in (
            (None, "box.stl': no such file"), (b"", "the file is empty"), (b"not a file of triangles", "byte 23"),
            (binary[:-7], f"has {len(binary)} bytes, but this one has {len(binary) - 7}"),
            (binary[:84], "byte 81"), (bytes(nan), "byte 147: a coordinate of facet 2 is no number"),
            ("\n".join(text[:40]).encode(), "line 40: the file ends here, without 'endsolid'"),
            ("\n".join([*text[:3], "vertex 1 2 nan", *text[4:]]).encode(), "line 4: expected three numbers"),
            ("\n".join([*text[:3], *text[4:]]).encode(), "line 6: expected 'vertex', not 'endloop'"),
            ("\n".join([*text[:3], text[3], *text[3:]]).encode(), "line 7: expected 'endloop'"),
            (b"solid\nendsolid\n", "the file has no facet"),
            (stl_files.text(corner[:1][:, [0, 1, 1]]).encode(), "no facet has an area"),
            (stl_files.text(three).encode(), "branches: more than two facets meet in 1 side (the first: facet"),
            (stl_files.text(moebius).encode(), "has no outside")):
        (tmp_path/"box.stl").unlink(missing_ok=True)
        if content is not None:
            (tmp_path/"box.stl").write_bytes(content)
        found = said(tmp_path, falling())
        assert words in found, found
        assert "deck.inp:" in found
        assert found.count("error:") == 1, found
    for card, words in (("*SURFACE, NAME=W, TYPE=STL", "INPUT=file is missing"), (CARD + ", SCALE=0", "SCALE"),
                        (CARD.replace("STL", "SPHERE") + "\n0., 0., 0., 1.", "INPUT= is of TYPE=STL"),
                        ("*SURFACE, NAME=W, TYPE=STL\n1., 2., 3.", "three corners of a triangle")):
        stl_files.write(tmp_path/"box.stl", corner)
        assert words in said(tmp_path, falling(card))


def test_facets_that_face_inwards(tmp_path: Path) -> None:
    """A closed surface turned inside out is a hole, which is said: a cube bounces about in it."""
    two = Block("C3D4", (1, 1, 1), size=(3, 3, 3), place=lambda x: x - np.array([1.5, 1.5, 1.0]))
    stl_files.write(tmp_path/"box.stl", stl_files.outline(two)[:, ::-1])
    run = ran(tmp_path, falling(until=2.0).replace("-3.", "-5."))
    assert "face inwards" in run.log
    assert run.verdict["verdict"] == "good", run.log[-600:]
    assert np.ptp(run.history["total"]) <= BALANCE*run.history["total"].max()
    assert run.history["active"].max() > 0
