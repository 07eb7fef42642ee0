"""docs/energy.md: each cause of a change of energy on its deck, against the figures of the page."""

import sys

import pytest
from scene_tools import ROOT

sys.path[:0] = [str(ROOT / "tests" / "bench"), str(ROOT / "tests" / "scenes")]
from book import causes, gain  # noqa: E402


class Now:
    """Stands for the runs of the book: each is made where it is asked for."""

    def __init__(self, folder):
        self.folder, self.count = folder, 0

    def start(self, deck, run, **parameters):
        self.count += 1
        return run(deck, self.folder/str(self.count), **parameters)


class Made:
    """A run that is there, where the book waits for one."""

    def __init__(self, run):
        self.run = run

    def result(self):
        return self.run


def rows_of_page(name):
    """The rows of a table, as lists of texts."""
    text = (ROOT / "docs" / causes.PAGE).read_text()
    lines = text.split(f"<!-- {name} -->\n")[1].split("<!-- end -->")[0].splitlines()
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines[2:]]


def test_the_page_has_all_causes():
    assert [row[0] for row in rows_of_page("causes")] == [cause.what for cause in causes.CAUSES]


@pytest.mark.parametrize("k", [pytest.param(k, marks=[pytest.mark.long]*(k == 7)) for k in range(len(causes.CAUSES))])
def test_cause(k, tmp_path):
    """What the page says of it holds, and its figures are those of the run."""
    cause = causes.CAUSES[k]
    run = causes.run_cause(cause, tmp_path)
    change = causes.changes(run)
    assert cause.holds(change, run), change
    row = rows_of_page("causes")[k]
    for name, cell in zip(causes.COLUMNS, row[2:6], strict=True):
        if cell in ("0", "round-off"):
            assert abs(change[name]) < 10*causes.SMALL, name
        else:
            assert float(cell) == pytest.approx(change[name], rel=0.06, abs=6e-4), name
    assert row[6].split()[0] == causes.cells(cause, run)[6].split()[0]


@pytest.mark.long
def test_the_bar_by_all_schemes(tmp_path):
    """The first table: energies after two impacts to a percent, and which runs are told to be bad."""
    futures = {key: Made(run) for key, run in gain.start(Now(tmp_path)).items()}
    found = [line.strip("| ").split(" | ") for line in gain.report(futures, None)[2:]]
    page = rows_of_page("gain")
    assert [row[:3] for row in page] == [row[:3] for row in found]
    for row, other in zip(page, found, strict=True):
        assert (row[5] == "good") == (other[5] == "good"), (row, other)
        if row[3].startswith("1 + "):
            assert other[3].startswith("1 + "), other
            assert float(other[3][4:]) < 1e-12
        elif float(row[3]) > 1.1:
            # The bar is thrown through the floor: how far it gets from there grows from round-off.
            assert float(other[3]) > 1.1
        else:
            assert float(row[3]) == pytest.approx(float(other[3]), rel=0.01)
