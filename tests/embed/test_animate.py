"""Animations: what is in their frames, formats, rates, and what cannot be shown."""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from test_python_results import ALL_FIELDS, POINTS, TIMES, write_fields

sys.path.insert(0, str(Path(__file__).parents[2]/"pywrap"))

import emcon  # noqa: E402
from emcon import ResultError, animate  # noqa: E402
from emcon.__main__ import main  # noqa: E402


@pytest.fixture
def fields(tmp_path: Path) -> Path:
    """Base name of a result of nine frames: a body moves by (t, -t/4) over a support."""
    write_fields(tmp_path/"box.vtkhdf")
    return tmp_path/"box"


def pictures(path: Path) -> list[np.ndarray]:
    with Image.open(path) as movie:
        found = []
        for k in range(movie.n_frames):
            movie.seek(k)
            found.append(np.asarray(movie.convert("RGB")).astype(int))
    return found


def refused(capsys: pytest.CaptureFixture[str], code: int, *arguments: str) -> str:
    assert main(["animate", *arguments]) == code
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("error: ") and "Traceback" not in err
    return err


# --- GIF ---------------------------------------------------------------------------------------

def test_gif_shows_all_frames_and_the_body_moves(fields: Path) -> None:
    assert animate(fields, fps=10) == fields.with_name("box.gif")
    assert emcon.animate is animate
    with Image.open(fields.with_name("box.gif")) as movie:
        assert movie.n_frames == len(TIMES) and movie.info["duration"] == 100
        assert movie.info["loop"] == 0
    frames = pictures(fields.with_name("box.gif"))
    assert all(not np.array_equal(a, b) for a, b in zip(frames, frames[1:]))
    # the view stands still with the support: of 3.36 on 643 pixels the upper edge sinks by 0.25
    top = [np.flatnonzero((f[40:-60, 70:-110].min(axis=2) < 200).any(axis=1)).min()
           for f in (frames[4], frames[8])]
    assert abs(top[1] - top[0] - 643*0.25/3.36) < 3
    # the middle of the body, which has gone on by 1: the stress has grown, the colour is darker
    assert frames[8][204, 575].sum() < frames[4][204, 383].sum() - 100


def test_colours_are_those_of_the_field(fields: Path) -> None:
    write_fields(Path(f"{fields}.vtkhdf"), times=TIMES[:2])
    stress, speed, energy = (
        pictures(animate(fields, fields.with_name(f"{name}.gif"), field=name))[-1]
        for name in ("von_mises", "velocity", "strain_energy"))
    assert not np.array_equal(stress, speed) and not np.array_equal(speed, energy)


def test_ends_of_colours_and_frames(fields: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Frames 2 to the last but one; with the colours of a larger range these are paler."""
    every = pictures(animate(fields))
    some = pictures(animate(fields, frames=(2, -2)))
    assert len(some) == len(every) - 3
    assert main(["animate", str(fields), "--clim", "0", "100", "--frames", "2", "-2"]) == 0
    paler = pictures(fields.with_name("box.gif"))
    assert len(paler) == len(some) and paler[-1][277, 543].sum() > some[-1][277, 543].sum() + 100
    for wrong, why in (({"frames": (0, 9)}, "no frame 9"), ({"frames": (3, 2)}, "later one"),
                       ({"clim": (1.0, 1.0)}, "larger one"), ({"field": "heat"}, "no field heat")):
        with pytest.raises(ResultError, match=why):
            animate(fields, **wrong)


def test_negative_values_are_within_the_scale(fields: Path) -> None:
    """The gap closes from 0.5 to 0; nodes without gap are blank."""
    assert len(pictures(animate(fields, field="contact_gap"))) == len(TIMES)


def test_command_says_what_it_wrote(fields: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = fields.with_name("b.gif")
    assert main(["animate", str(fields), "--fps", "5", "--field", "velocity", "--output",
                 str(output)]) == 0
    out, err = capsys.readouterr()
    assert str(output) in out and err == ""
    with Image.open(output) as movie:
        assert movie.info["duration"] == 200


@pytest.mark.parametrize(("absent", "note", "count"), [
    ("von_mises cauchy_stress", "no stress", 9), ("displacement", "undeformed", 1)])
def test_fewer_fields(fields: Path, capsys: pytest.CaptureFixture[str], absent: str, note: str,
                      count: int) -> None:
    write_fields(Path(f"{fields}.vtkhdf"), [n for n in ALL_FIELDS if n not in absent.split()])
    assert main(["animate", str(fields)]) == 0
    assert note in capsys.readouterr().err
    assert len(pictures(fields.with_name("box.gif"))) == count


def test_long_runs_are_thinned(fields: Path, capsys: pytest.CaptureFixture[str],
                               monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("emcon.animation.MOST_FRAMES", 4)
    assert main(["animate", str(fields)]) == 0
    assert "4 of 9 frames are shown" in capsys.readouterr().err
    assert len(pictures(fields.with_name("box.gif"))) == 4


# --- MP4 ---------------------------------------------------------------------------------------

def fake_ffmpeg(folder: Path, body: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A program `ffmpeg` in the PATH that runs `body`; the true one may be missing."""
    program = folder/"bin"/"ffmpeg"
    program.parent.mkdir()
    program.write_text(f"#!{sys.executable}\nimport sys\n{body}\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}{os.environ['PATH']}")


def test_mp4_needs_ffmpeg(fields: Path, capsys: pytest.CaptureFixture[str],
                          monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(fields.parent))
    output = fields.with_name("box.mp4")
    err = refused(capsys, 2, str(fields), "--output", str(output))
    assert "needs the program ffmpeg" in err and "GIF" in err and not output.exists()


def test_mp4_is_handed_to_ffmpeg(fields: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All frames, of the size that is announced, at the rate."""
    fake_ffmpeg(fields.parent, "a = sys.argv; n = len(sys.stdin.buffer.read())\n"
                "w, h = map(int, a[a.index('-s') + 1].split('x'))\n"
                "open(a[-1], 'w').write(f\"{n/(4*w*h)} {a[a.index('-framerate') + 1]}\")",
                monkeypatch)
    output = animate(fields, fields.with_name("box.mp4"), fps=30)
    count, rate = output.read_text().split()
    assert float(count) == len(TIMES) and float(rate) == 30.0


@pytest.mark.parametrize("reads", ["sys.stdin.buffer.read()", "sys.stdin.close()"])
def test_what_ffmpeg_complains_of_is_told(fields: Path, capsys: pytest.CaptureFixture[str],
                                          monkeypatch: pytest.MonkeyPatch, reads: str) -> None:
    """Whether it takes all frames before or ends at once."""
    fake_ffmpeg(fields.parent, f"{reads}; open(sys.argv[-1], 'w').write('part')\n"
                "sys.exit('Unknown encoder')", monkeypatch)
    output = fields.with_name("box.mp4")
    output.write_text("the one before")
    assert "ffmpeg could not write" in refused(capsys, 2, str(fields), "--output", str(output))
    assert output.read_text() == "the one before"
    assert sorted(p.name for p in fields.parent.iterdir()) == ["bin", "box.mp4", "box.vtkhdf"]


# --- bad input ---------------------------------------------------------------------------------

def test_what_cannot_be_shown(fields: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name = str(fields)
    assert "no result" in refused(capsys, 2, f"{name}x")
    assert "no field heat; it has" in refused(capsys, 2, name, "--field", "heat")
    assert "known are gif, mp4" in refused(capsys, 2, name, "--output", "a.avi")
    assert "known are gif, mp4" in refused(capsys, 2, name, "--output", "a")
    assert "at most 50" in refused(capsys, 2, name, "--fps", "60")
    assert "cannot write" in refused(capsys, 4, name, "--output", f"{name}/nowhere/a.gif")
    for rate in ("0", "-1", "nan", "fast"):
        with pytest.raises(SystemExit) as stop:
            main(["animate", name, "--fps", rate])
        assert stop.value.code == 2
    capsys.readouterr()
    with pytest.raises(ResultError, match="above 0"):
        animate(fields, fps=float("nan"))
    write_fields(Path(f"{fields}.vtkhdf"), points=POINTS + np.arange(24.0).reshape(8, 3))
    assert "ParaView" in refused(capsys, 2, name)
    Path(f"{fields}.vtkhdf").write_bytes(b"junk")
    assert "cannot read" in refused(capsys, 2, name)
    assert not fields.with_name("box.gif").exists()
