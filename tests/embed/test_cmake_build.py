"""CMakeLists.txt beside the Makefile: the same flags for each source, so the same bits."""

from __future__ import annotations

import csv
import json
import re
import shlex
import shutil
from pathlib import Path

import pytest
from embed_tools import HERE, ROOT, SANITIZED, need, run

RELEASE = ROOT/"build"/"release"
pytestmark = pytest.mark.skipif(SANITIZED or not (RELEASE/"flags.txt").exists(), reason="flags are those of a release")
#: Where things are, not how they are compiled.
PLACES = re.compile(r"-(?:I|J|L|l)")


def options(words: list[str]) -> list[str]:
    """What tells how a source is compiled, sorted; `--param a=b` is `--param=a=b`."""
    joined = " ".join(words).replace("--param ", "--param=")
    return sorted(word for word in joined.split() if word.startswith("-") and not PLACES.match(word))


def of_make() -> tuple[list[str], list[str], dict[str, list[str]]]:
    """Flags of all Fortran sources, of C, and those of each tag."""
    text = (RELEASE/"flags.txt").read_text()
    fortran, c = re.fullmatch(r".*? (-std=f20.*?) (?:-march\S+ )?(?:\S*cc\S*) (-std=c99.*)\n?", text).groups()
    tags = {path.stem.removeprefix("flags_"): options(shlex.split(path.read_text())) for path in RELEASE.glob("flags_*.txt")}
    return options(fortran.split()), options(c.split()), tags


@pytest.fixture(scope="module")
def configured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    need("cmake")
    folder = tmp_path_factory.mktemp("cmake")
    run("cmake", "-S", ROOT, "-B", folder, "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON")
    return folder


def test_flags_are_those_of_the_makefile(configured: Path) -> None:
    fortran, c, tags = of_make()
    tagged = {name: tag for tag, names in re.findall(r"^TAGGED_(\w+) := (.*)$", (RELEASE/"order.mk").read_text(), re.MULTILINE)
              for name in names.split() if tag != "threads"}
    threads = set(re.search(r"^TAGGED_threads := (.*)$", (RELEASE/"order.mk").read_text(), re.MULTILINE)[1].split())
    base = [word for word in fortran if word not in ("-O2", "-g1")]
    seen = set()
    for entry in json.loads((configured/"compile_commands.json").read_text()):
        name = Path(entry["file"]).name
        found = [word for word in options(shlex.split(entry["command"])[1:]) if word not in ("-c", "-o")]
        seen.add(name)
        if name.endswith(".c"):
            assert found == c, name
            continue
        own = base + tags.get(tagged.get(Path(name).stem, ""), ["-O2", "-g1"])
        own += ["-fopenmp"]*(Path(name).stem in threads)
        assert found == sorted(own), name
    assert seen == {Path(name).name for name in (RELEASE/"sources.txt").read_text().split()
                    if "/kernels/" not in name and not name.endswith(".inc")} | {
                        path.name for path in (ROOT/"src_f90").glob("*/*.c")}


@pytest.mark.long
def test_the_build_gives_the_same_bits(tmp_path: Path) -> None:
    """Built as a part of a host's project, and installed from there: program, library, what projects find."""
    whole = tmp_path/"whole"
    run("cmake", "-S", HERE/"cmake", "-B", whole, f"-DEMCON_SOURCE={ROOT}")
    run("cmake", "--build", whole, "--parallel", "2")
    prefix = tmp_path/"prefix"
    run("cmake", "--install", whole, "--prefix", prefix)
    deck = ROOT/"input_decks"/"bouncing_ball.inp"
    tables = []
    for place in (RELEASE, prefix/"bin"):
        folder = tmp_path/f"of_{place.name}"
        folder.mkdir()
        shutil.copy(deck, folder)
        run(place/"emcon", folder/deck.name, "--set", "t_end=0.1", cwd=folder)
        with (folder/"bouncing_ball.csv").open() as file:
            tables.append([{name: text for name, text in row.items() if name != "cpu"} for row in csv.DictReader(file)])
    assert tables[0] == tables[1] and len(tables[0]) > 1
    run("cmake", "-S", HERE/"cmake", "-B", tmp_path/"host", f"-DCMAKE_PREFIX_PATH={prefix}")
    run("cmake", "--build", tmp_path/"host")
    for arguments, names in (([ROOT/"input_decks"/"ring.inp"], ("border", "border_static")), (["mortar", "0.3", "6"], ("blocks",))):
        found = {run(folder/name, *arguments) for name in names for folder in (whole, tmp_path/"host")}
        assert len(found) == 1 and len(found.pop().split()) >= 2


def test_wrong_choices_are_told(tmp_path: Path) -> None:
    need("cmake")
    for option, said in (("EMCON_PRECISION=half", "is single, double or quad, not half"),
                         ("EMCON_LICENSE=mit", "is gpl or permissive, not mit")):
        with pytest.raises(AssertionError, match=said):
            run("cmake", "-S", ROOT, "-B", tmp_path/option, f"-D{option}")
