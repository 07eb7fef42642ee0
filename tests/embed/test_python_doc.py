"""docs/python.md tells the truth: its examples run and print what the page shows."""

from __future__ import annotations

from pathlib import Path

import pytest
from python_doc import PAGE, blocks, examples, pictures, run_chapter, tidy

TEXT = PAGE.read_text(encoding="utf-8")
CHAPTERS = examples(TEXT)


@pytest.mark.parametrize("title", CHAPTERS)
def test_chapter(title: str, tmp_path: Path) -> None:
    chapter = CHAPTERS[title]
    printed = run_chapter(TEXT, title, tmp_path)
    for example, text in zip(chapter, printed, strict=True):
        where = f"docs/python.md, block at line {example.code.first + 1}"
        if example.output is None:
            assert not text, f"{where} prints what the page does not show: {text}"
        elif example.varies:
            assert text.strip(), f"{where} prints nothing"
        else:
            assert tidy(text) == example.output.text, where
    for name, place in pictures(TEXT).items():
        if place == title:
            assert (tmp_path/name).is_file() and (PAGE.parent/name).is_file(), name


def test_page_is_understood() -> None:
    """Every output belongs to an example, and every chapter with code is found."""
    all_blocks = blocks(TEXT.splitlines(keepends=True))
    assert {block.language for block in all_blocks} <= {"python", "text", "text varies", "sh"}
    shown = [example.output for chapter in CHAPTERS.values() for example in chapter
             if example.output]
    assert len(shown) == sum(block.language.startswith("text") for block in all_blocks)
    assert len(CHAPTERS) >= 8 and len(shown) >= 15
    assert pictures(TEXT) and set(pictures(TEXT).values()) <= set(CHAPTERS)
