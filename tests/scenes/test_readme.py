"""README.md and docs/*.md tell the truth: figures, links, folders, make targets, options."""

import functools
import pathlib
import re
import shlex
import subprocess
import sys

import h5py
import pytest
from scene_tools import DECKS, PROGRAM, ROOT, Deck

README = ROOT / "README.md"
PAGES = [README, *sorted((ROOT / "docs").glob("*.md"))]
EACH_PAGE = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)


# ---- what stands in a page ----------------------------------------------------------------------


def code_blocks(text):
    """Lines of fenced and of indented code."""
    in_fence = False
    for line in text.splitlines():
        if line.lstrip().startswith("```"):
            in_fence = not in_fence
        elif in_fence or line.startswith("    "):
            yield line.strip()


def code_spans(text):
    """What stands between single back quotes on one line, outside of blocks."""
    text = re.sub(r"^\s*```.*?^\s*```", "", text, flags=re.DOTALL | re.MULTILINE)
    return re.findall(r"`([^`\n]+)`", text)


def commands(page):
    """Command lines as lists of words, a prompt and a remark left out; options that stand alone are
    those of the program, of its studies or of its meshes."""
    text = page.read_text()
    for line in [*code_blocks(text), *code_spans(text)]:
        line = line.removeprefix("$ ").split("  #")[0]
        if line.startswith("--"):
            line = "emcon " + line
        if re.match(r"(make|emcon|python3?|\S*/(emcon|python3?)|\S+\.py)\b", line):
            try:
                words = shlex.split(line)
            except ValueError:  # a sentence, not a command
                continue
            if len(words) > 1:
                yield words


def links(page):
    """Targets of links and pictures within the repository, with and without an anchor."""
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
        if not re.match(r"[a-z]+://|mailto:", target):
            yield target


def anchors(page):
    """The names under which headings can be linked to."""
    for title in re.findall(r"^#+ +(.*)$", page.read_text(), re.MULTILINE):
        yield re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


# ---- links, files, commands ---------------------------------------------------------------------


@EACH_PAGE
def test_links(page):
    for target in links(page):
        name, _, anchor = target.partition("#")
        path = page.parent / name if name else page
        assert path.exists(), target
        assert not anchor or anchor in anchors(path), target


@EACH_PAGE
def test_files_and_folders(page):
    """Names in code type that begin with a folder of the repository."""
    folders = "docs input_decks pywrap src_f90 tests".split()
    for span in code_spans(page.read_text()):
        for word in span.split():
            if re.fullmatch(rf"({'|'.join(folders)})/[\w./]*", word):
                assert (ROOT / word).exists(), word


@EACH_PAGE
def test_make_targets(page):
    targets = re.findall(r"^([a-z][\w-]*):", (ROOT / "Makefile").read_text(), re.MULTILINE)
    variables = "MODE PRECISION LICENSE V PREFIX FC CC FFLAGS CFLAGS SECONDS VECTOR COUNT ORDER SEEDS".split()
    for words in commands(page):
        for word in words[1:] if words[0] == "make" else []:
            name, equals, _ = word.partition("=")
            assert name in (variables if equals else targets), words


def program_of(words):
    """The call of which `--help` lists the options of a command line, and the words left."""
    if words[0].split("/")[-1] == "emcon":
        return (PROGRAM,), words[1:]
    if re.search(r"(^|/)python3?$", words[0]):
        words = words[1:]
    if words[0] == "-m":
        verbs = {"study", "plot", "animate", "compare", "summary", "mesh"}
        n = 3 if words[1] == "emcon" and verbs & set(words[2:3]) else 2
        return (sys.executable, *words[:n]), words[n:]
    return (sys.executable, ROOT / words[0]), words[1:]


@functools.cache
def options_of(program):
    """What `--help` lists; of a script what it and the modules beside it add to their parsers."""
    script = pathlib.Path(program[-1])
    if script.suffix == ".py":
        text = script.read_text()
        beside = [script.with_name(f"{name}.py") for name in re.findall(r"^(?:from|import) (\w+)",
                                                                      text, re.MULTILINE)]
        text += "".join(path.read_text() for path in beside if path.exists())
        return {"--help", *(f"--{name}" for name in re.findall(r'"(?:--)?([a-z][\w-]*)"', text))}
    told = subprocess.run([*program, "--help"], capture_output=True, text=True, check=True).stdout
    return set(re.findall(r"--[a-z][\w-]*", told))


@EACH_PAGE
def test_options(page):
    for words in commands(page):
        if words[0] == "make":
            continue
        program, rest = program_of(words)
        options = set(re.findall(r"--[a-z][\w-]*", " ".join(rest)))
        if not options:
            continue
        known = options_of(program)
        if words[0] == "emcon" and rest[0].startswith("--"):
            for verb in ("study", "mesh"):
                known = known | options_of((sys.executable, "-m", "emcon", verb))
        assert options <= known, words


@EACH_PAGE
def test_parameters(page):
    """`--set NAME=VALUE` behind a deck of the repository names a parameter that the deck has."""
    for words in commands(page):
        decks = [word for word in words if re.fullmatch(r"input_decks/\w+\.inp", word)]
        for option, value in zip(words, words[1:], strict=False):
            if decks and option == "--set":
                names = [line.split("=")[0].strip() for line in Deck.read(ROOT / decks[0]).data("*PARAMETER")]
                assert value.split("=")[0] in names, words


# ---- figures of the README ----------------------------------------------------------------------


def energy_table():
    """(treatment, h, text) of the cells of the README's table of energies."""
    lines = [line for line in README.read_text().splitlines() if line.startswith("| ")]
    start = next(k for k, line in enumerate(lines) if line.startswith("| treatment |"))
    head = [cell.strip() for cell in lines[start].strip("|").split("|")]
    for line in lines[start + 1 :]:
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        treatment = re.match(r"`([A-Z ]+)`", cells[0])
        if not treatment:
            return
        for title, cell in zip(head, cells, strict=True):
            if title.startswith("energy, h = "):
                yield treatment[1], float(title.removeprefix("energy, h = ")), cell


def agrees(value, text):
    """Is `text` the number `value`, rounded to the digits that it has?"""
    n_digit = len(text.partition(".")[2])
    return abs(value - float(text)) <= 0.5000001*10.0**-n_digit


def test_table_has_all_cells():
    assert len(list(energy_table())) == 8


@pytest.mark.parametrize("treatment, h, text", list(energy_table()))
def test_energy_table(ring, treatment, h, text):
    total = ring(treatment, h).history["total"]
    held = re.match(r"conserved to (\S+)", text)
    loss = re.match(r"loses (\S+) %", text)
    if held:
        assert abs(total - total[0]).max() <= float(held[1])*total[0]
    else:
        assert agrees(100.0*(1.0 - total[-1]/total[0]), loss[1])


def test_printed_run(ring):
    """The screen text of the README against the closing balance of the same run: counts and
    energies; figures of round-off by their size. Digits vary a little from machine to machine."""
    run = ring("AUTO", 0.01)
    shown = README.read_text()

    def both(pattern):
        found = [re.search(pattern, text) for text in (shown, run.log)]
        assert all(found), pattern
        return [float(match[1]) for match in found]

    for pattern in (r"increments (\d+)", r"increments \d+, time (\S+),", r"cuts (\d+)"):
        left, right = both(pattern)
        assert left == right, pattern
    left, right = both(r"Newton iterations (\d+)")
    assert left == pytest.approx(right, rel=0.01)
    for pattern in (r"kinetic (\S+),", r"strain (\S+),", r"total at start (\S+),", r"at end (\S+)"):
        left, right = both(pattern)
        assert left == pytest.approx(right, rel=1e-5), pattern
    for pattern in (r"contact work (\S+)", r"error of the energy balance (\S+)"):
        assert max(map(abs, both(pattern))) <= 1e-13, pattern
    assert re.search(r"verdict: (.*)", shown)[1] == re.search(r"verdict: (.*)", run.log)[1]


def test_rebound_velocity(ring):
    with h5py.File(ring("AUTO", 0.01).file(".h5"), "r") as file:
        bodies = file["sets/BODIES"]
        velocity = bodies["MOMENTUM"][-1, 0, :2]/bodies["MASS"][0, 0]
    shown = re.search(r"leaves it with \((\S+), (\S+)\)", README.read_text())
    assert all(agrees(v, text) for v, text in zip(velocity, shown.groups(), strict=True))


def test_printed_files(ring):
    """The files that the README says a run leaves are there, and no other."""
    run = ring("AUTO", 0.01)
    shown = set(re.findall(r"`(ring\.[\w.]+)`(?=.*\|)", README.read_text()))
    left = {p.name for p in run.base.parent.iterdir()}
    assert {name for name in shown if name != "ring.inp"} == left


def test_rooms():
    """The folders of src_f90 that the README lists are those that there are."""
    rooms = {p.name for p in (ROOT / "src_f90").iterdir() if p.is_dir() and p.name[0] not in "._"}
    listed = [set(span.split()) for span in code_spans(README.read_text())]
    assert rooms in listed


def test_modules():
    """Modules that docs/develop.md names are there, and its table has the folders in their order."""
    text = (ROOT / "docs/develop.md").read_text()
    modules = {p.stem for p in (ROOT / "src_f90").rglob("emcon*") if p.suffix in {".f90", ".F90"}}
    functions = set(re.findall(r"\b(emcon_\w+)\(", (ROOT / "src_f90/border/emcon.h").read_text()))
    named = {span for span in code_spans(text) if re.fullmatch(r"emcon_\w+", span)}
    assert named & modules and named <= modules | functions
    table = text.split("## Layout of the sources")[1].split("Beside it")[0]
    rooms = re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE)
    assert rooms == next(s.split() for s in code_spans(README.read_text()) if s.endswith(" app"))


def test_decks_are_complete():
    """Every deck opens with a heading that says what to expect, as the README promises."""
    for deck in DECKS.glob("*.inp"):
        text = deck.read_text()
        assert text.startswith("*HEADING\n"), deck.name
        assert "Expected" in text.split("*NODE")[0], deck.name


def test_other_codes_are_those_of_the_bench():
    """The table of the README is the first lines of that of docs/performance.md."""
    table = (ROOT / "docs/performance.md").read_text().split("<!-- peers -->")[1].split("<!-- end")[0]
    rows = [[cell.strip() for cell in line.strip("| ").split("|")] for line in table.splitlines()]
    bench = {row[1]: (row[2], row[5]) for row in rows if row[0] == "1250"}
    shown = re.findall(r"^\| ((?:EMCON|Kratos|CalculiX).*?) \| (.*?) \| (.*?) \|$",
                       README.read_text(), re.MULTILINE)
    assert len(shown) == 4
    for code, time, energy in shown:
        assert bench[code] == (time, energy.removeprefix("below "))
