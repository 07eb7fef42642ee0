"""Mutants of the numerics and coverage: what they do to a line, which lines they name."""

import platform
import subprocess

import mutants
import pytest
from kernel_coverage import ranges
from mutants import (
    MISTAKES,
    by_turns,
    code_of,
    failing_test,
    last_version,
    mistakes,
    statement,
    within,
)
from traced_lines import Passed, Tracer


@pytest.mark.parametrize(
    "line, mutant",
    [
        ("      if (gap < 0.0_wp) n = n + 1", "      if (gap >= 0.0_wp) n = n + 1"),
        ("      if (gap < 0.0_wp) n = n + 1", "      if (gap < 0.0_wp) n = n - 1"),
        ("      f = a*b  ! force", "      f = a/b"),
        ("      call add(self, f)", "      continue"),
        ("      is_open = is_open .and. .not. acts", "      is_open = is_open .and. acts"),
    ],
)
def test_a_line_with_a_mistake(line, mutant):
    assert mutant in mistakes(line)


@pytest.mark.parametrize("line", [
    "      integer :: n = 0", "   end subroutine add", "      !> a < b", "      do i = 1, n",
    '      message = "a < b"', "      use emcon_kinds, only : wp", ""])  # fmt: skip
def test_a_line_without_numerics(line):
    assert not mistakes(line)


def test_every_mistake_changes_the_line():
    for pattern, put in MISTAKES:
        assert not pattern.search(put) or pattern.pattern in (r"\.not\. ?", r"\babs\("), pattern


def test_comments_hold_no_mistakes():
    assert code_of("   a = b   ! c < d") == "   a = b"


def test_a_line_of_a_longer_statement():
    assert [list(statement(["a = 1", "b = c &", "   + d &", "   - e", "f = 2"], k))
            for k in (1, 3, 4, 5)] == [[1], [2, 3, 4], [2, 3, 4], [5]]
    assert "      continue" not in mistakes("      b = 3", is_behind=True)


def test_the_last_version_is_a_commit():
    assert len(last_version()) in (0, 40)


SOURCE = """program traced
   implicit none
   character(len=8) :: word
   call get_command_argument(1, word)
   if (word == "left") then
      print '(a)', "left"
   else
      print '(a)', "right"
      stop 3
   end if
end program traced
"""


@pytest.mark.skipif(platform.machine() != "x86_64", reason="breakpoints of x86-64")
def test_lines_that_a_program_passes(tmp_path):
    """One way through a branch, and the other; the exit code is that of the program."""
    source, program = tmp_path / "traced.f90", tmp_path / "traced"
    source.write_text(SOURCE)
    subprocess.run(["gfortran", "-O0", "-g1", source, "-o", program], check=True)
    tracer = Tracer(program, {"traced.f90": "traced.f90"}, tmp_path)
    for word, code, passed, other in (("left", 0, 6, 8), ("right", 3, 8, 6)):
        done = subprocess.run([tracer.script(), word], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stdout.split()) == (code, [word])
        [(_, seconds, lines)] = tracer.told()
        assert passed in lines["traced.f90"] and other not in lines["traced.f90"]
        assert 0 <= seconds < 10


def test_tests_that_are_asked():
    """Each file has its turn, and no more is asked than there is time for, but one."""
    tests = [Passed(name, seconds, {}) for name, seconds in (
        ("a::1", 3), ("a::2", 1), ("b::1", 2), ("a::3", 9))]
    assert [t.name for t in by_turns(tests)] == ["a::2", "b::1", "a::1", "a::3"]
    assert [t.name for t in within(by_turns(tests), 5)] == ["a::2", "b::1"]
    assert len(within(tests, 0)) == 1


@pytest.mark.parametrize("told, failing", [
    ("FAILED tests/a.py::test_x - AssertionError", "a.py::test_x"),
    ("FAILED tests/a.py::test_x", "a.py::test_x"),
    ("ERROR tests/a.py::test_x - OSError", "a.py::test_x"),
    ("FAILED tests/a.py::test_x[1-b c] - Error", "a.py::test_x[1-b c]"),
    ("FAILED tests/b.py::test_any - Error", "b.py"),
    ("FAILED tests/a.py::test_xy - Error", ""),
    ("FAILED tests/a.py::test_x[2] - Error", ""),
    ("E   FAILED tests/a.py::test_x - Error", ""),
    ("2 passed in 1.0s", ""),
    ("", "")])  # fmt: skip
def test_the_test_that_pytest_names(monkeypatch, tmp_path, told, failing):
    """A test fails where pytest says so of its whole name; a run that ends otherwise names none."""
    monkeypatch.setattr(mutants, "KEPT", tmp_path)
    monkeypatch.setattr(mutants, "call", lambda *_: subprocess.CompletedProcess((), 1, told))
    tests = [Passed(name, 1, {}) for name in ("a.py::test_x", "a.py::test_x[1-b c]", "b.py")]
    assert failing_test(tests, "program") == failing


RUN = """import os, subprocess

def test_run():
    assert subprocess.run([os.environ["EMCON"], "7"]).returncode == 0

def test_other():
    pass
"""


def test_the_test_that_fails(monkeypatch, tmp_path):
    """A program of one's own is run by tests, and its exit code is what they see."""
    monkeypatch.setattr(mutants, "KEPT", tmp_path)
    monkeypatch.setattr(mutants, "ROOT", tmp_path)
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests/test_a.py").write_text(RUN)
    program = tmp_path / "program"
    tests = [Passed(f"test_a.py::test_{name}", 1, {}) for name in ("other", "run")]
    for word, failing in (("7", ""), ("8", "test_a.py::test_run")):
        program.write_text(f'#!/bin/sh\ntest "$1" = {word}\n')
        program.chmod(0o755)
        assert failing_test(tests, program) == failing


def test_ranges():
    assert ranges([3, 4, 5, 9]) == "3-5 9"
    assert ranges([]) == ""
