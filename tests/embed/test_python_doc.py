"""docs/python.md and other pages tell the truth: their examples in Python run and print what the
pages show."""

from __future__ import annotations

from pathlib import Path

import pytest
from python_doc import OUTPUTS, PAGES, RUNS, blocks, examples, is_near, pictures, run_chapter

TEXTS = {path: path.read_text(encoding="utf-8") for path in PAGES}
#: Languages of other blocks, which `test_cmake`, `test_host_solid`, `test_interface_c`, `test_hosts_page` compile.
COMPILED = {"embedding": {"", "cmake", "c", "cpp", "fortran"}, "hosts": {"cpp", "text compiled"}}
#: Their runs take seconds.
LONG = {"7 Studies", "11 Cost and error of settings"}
CHAPTERS = [pytest.param(path, title, id=f"{path.stem}-{title}", marks=[pytest.mark.long]*(title in LONG))
            for path, text in TEXTS.items() for title in examples(text)]


@pytest.mark.parametrize("page, title", CHAPTERS)
def test_chapter(page: Path, title: str, tmp_path: Path) -> None:
    chapter = examples(TEXTS[page])[title]
    printed = run_chapter(TEXTS[page], title, tmp_path)
    for example, text in zip(chapter, printed, strict=True):
        where = f"docs/{page.name}, block at line {example.code.first + 1}"
        assert example.shows(text), f"{where} prints what the page does not show:\n{text}"
    for name, place in pictures(TEXTS[page]).items():
        if place == title:
            assert (tmp_path/name).is_file() and (page.parent/name).is_file(), name


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_page_is_understood(page: Path) -> None:
    """Every output belongs to an example, and every chapter with code is found."""
    text = TEXTS[page]
    all_blocks = blocks(text.splitlines(keepends=True))
    assert {block.language for block in all_blocks} <= RUNS | {*OUTPUTS, "sh"} | COMPILED.get(page.stem, set())
    chapters = examples(text)
    shown = [example.output for chapter in chapters.values() for example in chapter
             if example.output]
    assert len(shown) == sum(block.language in OUTPUTS for block in all_blocks)
    least = {"python": (8, 15), "tutorial": (4, 6), "howto": (6, 6), "hosts": (1, 2),
             "embedding": (2, 5)}[page.stem]
    assert len(chapters) >= least[0] and len(shown) >= least[1]
    assert pictures(text) or page.stem in ("howto", "hosts", "embedding")
    assert set(pictures(text).values()) <= set(chapters)


def test_near() -> None:
    """Counts may differ by some percent and round-off by all; orders, words and signs may not."""
    page = "PERSISTENT 0.01 651 1.9e-03 drift -2.1e-15"
    assert is_near("PERSISTENT  0.01  658 1.9e-03 drift 4e-16", page)
    for other in ("PERSISTENT 0.01 740 1.9e-03 drift -2.1e-15",
                  "PERSISTENT 0.01 651 1.9e-02 drift -2.1e-15",
                  "PERSISTENT 0.01 651 -1.9e-03 drift -2.1e-15",
                  "PERSISTENT 0.01 651 1.9e-03 drift 2.1e-9",
                  "ADMISSIBLE 0.01 651 1.9e-03 drift -2.1e-15", "PERSISTENT 0.01 651 1.9e-03"):
        assert not is_near(other, page), other
