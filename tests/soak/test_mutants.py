"""Mutants of the numerics and coverage: what they do to a line, which lines they name."""

import pytest
from kernel_coverage import ranges
from mutants import MISTAKES, code_of, last_version, mistakes, statement


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


def test_ranges():
    assert ranges([3, 4, 5, 9]) == "3-5 9"
    assert ranges([]) == ""
