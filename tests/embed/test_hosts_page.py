"""The table of docs/hosts.md has the examples that there are, and its program in C++ does what it shows."""

from __future__ import annotations

import re
from math import acosh, sinh
from pathlib import Path

from embed_tools import ROOT, build, run

PAGE = (ROOT/"docs"/"hosts.md").read_text(encoding="utf-8")
#: What is copied is to be read on two screens.
SHORTEST, LONGEST = 60, 150


def test_lengths_of_examples() -> None:
    told = {name: int(lines) for name, lines in re.findall(r"\| `(tests/[\w./]+)` \| (\d+) \|", PAGE)}
    assert len(told) == 10
    assert told == {name: len((ROOT/name).read_text(encoding="utf-8").splitlines()) for name in told}
    assert all(SHORTEST <= lines <= LONGEST for lines in told.values())


def test_other_files_of_the_page_are_there() -> None:
    assert all((ROOT/"tests"/"embed"/name).exists() for name in re.findall(r"`(\w+\.(?:c|f|f90|py))`", PAGE))


def test_statics_in_cpp(installed: dict[str, str], tmp_path: Path) -> None:
    """By the page, and by the solution of the difference equation of the sheet."""
    ((code, shown),) = re.findall(r"^```cpp\n(.*?)^```\n+^```text compiled\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    (tmp_path/"statics.cpp").write_text(code, encoding="utf-8")
    build("c++", tmp_path/"statics.cpp", tmp_path/"statics", installed, "-std=c++11")
    assert run(tmp_path/"statics", env=installed) == shown
    spring, tension, n_touch, n_free = 1.0, 4.0, 7, 7
    m = acosh(1 + spring/(2*tension))
    rows = [tuple(map(float, row)) for row in re.findall(r"foot at -(.*): (.*) nodes in contact, force (.*)", shown)]
    assert [depth for depth, *_ in rows] == [0.04, 0.09, 0.14, 0.19]
    for depth, n, force in rows:
        exact = depth*(n_touch*spring + 2*tension*(1 - sinh((n_free - 1)*m)/sinh(n_free*m)))
        assert n == n_touch and abs(force - exact) < 6e-13              # twelve digits are shown
