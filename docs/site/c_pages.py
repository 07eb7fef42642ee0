"""The reference of C and C++, read from the headers."""

from __future__ import annotations

import re
from pathlib import Path

from source_text import escape

BORDER = Path(__file__).resolve().parents[2]/"src_f90"/"border"


def comment_text(comment: str) -> str:
    """What a comment says, its paragraphs kept."""
    lines = [re.sub(r"^ ?\*? ?", "", line.strip()) for line in comment[2:-2].split("\n")]
    return escape("\n".join(lines).strip())


#: A comment that begins a line, or the declarations up to the next of these.
PIECE = re.compile(r"^/\*.*?\*/\s*?$|(?:(?!^/\*).)+", re.DOTALL | re.MULTILINE)


def page() -> str:
    """All that emcon.h declares, comments as text."""
    text = (BORDER/"emcon.h").read_text(encoding="utf-8")
    made = ["# Reference of C and C++", "`emcon.h` as it stands. How it is used, step by step: "
            "[EMCON in other codes](embedding.md). `emcon.hpp` has the same for C++: [below]"
            "(#c-11-emcon-hpp)."]
    for piece in (found[0].strip() for found in PIECE.finditer(text)):
        title = re.fullmatch(r"/\* ---- (.*?) -+ \*/", piece)
        if title:
            made.append(f"## {title[1].capitalize()}")
        elif piece.startswith("/*"):
            made.append(comment_text(piece))
        elif piece:
            made.append(f"```c\n{piece}\n```")
    return "\n\n".join(made) + "\n\n" + cpp()


def cpp() -> str:
    text = (BORDER/"emcon.hpp").read_text(encoding="utf-8")
    return f"## C++11: emcon.hpp\n\n```cpp\n{text.strip()}\n```\n"
