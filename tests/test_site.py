"""The pages that `make docs` makes of the sources: nothing public is left out, no link leads nowhere."""

import functools
import http.server
import re
import subprocess
import sys
import threading

import pytest
from scene_tools import DECKS, PROGRAM, ROOT

sys.path.append(str(ROOT / "docs" / "site"))

import build  # noqa: E402
import c_pages  # noqa: E402
import fortran_pages  # noqa: E402
import gallery  # noqa: E402
import landing  # noqa: E402
import links  # noqa: E402
import python_pages  # noqa: E402
from source_text import markdown  # noqa: E402


def test_python_has_all_names():
    import emcon

    page = python_pages.page()
    heads = set(re.findall(r"\{py:\w+\} (\w+)", page))
    values = {"__version__", "mesh"}
    assert set(emcon.__all__) - values <= heads
    methods = {name for name in vars(emcon.Stepper) if not name.startswith("_")}
    assert {name for name in methods if getattr(emcon.Stepper, name).__doc__} <= heads


def test_c_has_all_of_the_header():
    header = (ROOT / "src_f90/border/emcon.h").read_text()
    page = c_pages.page()
    shown = "".join(re.findall(r"```c\n(.*?)```", page, re.DOTALL))
    code = re.sub(r"/\*.*?\*/|\s", "", header, flags=re.DOTALL)
    assert re.sub(r"/\*.*?\*/|\s", "", shown, flags=re.DOTALL) == code
    assert "How it is used" in page and "\\_" in page


def test_fortran_has_all_names():
    page = fortran_pages.page()
    names = {name for _, names in fortran_pages.facade() for name in names}
    assert len(names) > 100
    assert not {name for name in names if f"### {name}\n" not in page and f"`{name}`" not in page}
    assert "### stepper_open\n" in page and "type(error_t), allocatable, intent(out) :: error" in page


def test_all_modules_are_listed():
    page = fortran_pages.modules_page()
    modules = {path.stem for path in (ROOT / "src_f90").rglob("emcon_*.[fF]90")}
    assert modules <= set(re.findall(r"^\| `(\w+)` \| \S", page, re.MULTILINE))


def test_gallery_has_all_decks():
    shown = [name for names in gallery.chapters().values() for name in names]
    assert sorted(shown) == sorted(path.stem for path in DECKS.glob("*.inp"))


def test_a_deck_is_shown_without_most_of_its_mesh():
    page = gallery.page("ring", "The run takes 3 s of processor time.")
    assert len(page.splitlines()) < 400 and "more lines" in page
    assert "*CONTACT PAIR" in page and "make_ring.py" in page


def test_every_page_is_in_the_contents():
    listed = {name for names in build.CONTENTS.values() for name in names.split()}
    pages = {path.stem for path in (ROOT / "docs").glob("*.md")}
    assert listed == pages | set(build.REFERENCES) | {"gallery/index", "changelog"}


@pytest.mark.parametrize("scheme", [row[0] for row in landing.SCHEMES])
def test_decks_of_the_first_figure(scheme, tmp_path):
    (tmp_path / "a.inp").write_text(landing.deck(scheme))
    done = subprocess.run([PROGRAM, "check", "a.inp"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "text, shown",
    [
        ("A * b, `c*d`.", "A \\* b, `c*d`."),
        ("h   the step [T]\n    of time", "- `h`: the step \\[T\\] of time"),
        ("Say:\n\n    code(1)\n\n    more", "Say:\n\n```\ncode(1)\n\nmore\n```"),
    ],
)
def test_docstrings(text, shown):
    assert markdown(text) == shown


def test_links_that_lead_nowhere_are_found(tmp_path):
    (tmp_path / "a.html").write_text(
        '<p id="x"><a href="b.html#y">1</a><a href="b.html#z">2</a><a href="c.html">3</a>'
        '<a href="#x">4</a><img src="d.png"><a href="https://example.org/q#r">5</a>'
    )
    (tmp_path / "b.html").write_text('<p id="y">')
    found, outside = links.broken(tmp_path)
    assert found == ["a.html: b.html#z", "a.html: c.html", "a.html: d.png"]
    assert outside == {"https://example.org/q"}


def test_pages_of_others_that_are_gone_are_found(tmp_path, capsys):
    """A server that has one page of two; an address where no server is is passed over."""
    (tmp_path / "here.html").write_text("x")
    serve = functools.partial(http.server.SimpleHTTPRequestHandler, directory=tmp_path)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), serve) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        base = f"http://127.0.0.1:{server.server_port}"
        found = links.unanswered({f"{base}/here.html", f"{base}/gone.html"})
        server.shutdown()
    assert found == [f"{base}/gone.html: 404"]
    assert not links.unanswered({f"{base}/here.html"})
    assert f"not reached: {base}/here.html" in capsys.readouterr().out
