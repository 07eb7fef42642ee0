"""Lines of commands in pages: targets, scripts, decks, options and parameters are there.

Blocks of the languages `python` and `sh run` run in `tests/embed/test_python_doc.py`; here are the
indented ones and those of `sh`, whose runs take minutes or need what is not here: they are read.
"""

import re
import shlex
import subprocess
import sys

import pytest
from scene_tools import PROGRAM, ROOT

sys.path.insert(0, str(ROOT / "pywrap"))

from emcon.__main__ import _parser  # noqa: E402

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
#: What a line of commands begins with.
FIRST = r"(?:\$ )?(?:sudo )?(make|pip|valgrind|emcon|\S*python3?|build/\S+)\s"
#: Decks that an earlier line of a page makes, or that stand for a reader's own.
OWN_DECKS = {"big.inp", "fold.inp", "full.inp", "pile.inp", "strips.inp", "ring.inp", "ball.inp", "bar.inp"}
#: Words that stand for what a reader has.
OWN = {"PYTHON", "DIR", "BEFORE"}


def commands():
    """(page, line, words) of each."""
    for page in PAGES:
        language, before = None, ""
        for number, line in enumerate(page.read_text().splitlines(), 1):
            fence = re.match(r"```(.*)", line)
            if fence:
                language = None if language is not None else fence[1]
                before = ""
                continue
            is_indented = language is None and re.match(rf"    {FIRST}", line)
            if language == "sh" or is_indented:
                text = before + line.strip().removeprefix("$ ")
                before = text[:-1] if text.endswith("\\") else ""
                if not before and text:
                    yield page.name, number, shlex.split(text, comments=True)


FOUND = list(commands())


#: `SCRIPT --help` of each argument, in processes that find the packages loaded.
HELPS = """
import os, runpy, sys
import h5py, matplotlib.pyplot, numpy, scipy.sparse.linalg, scipy.special
sys.path[:0] = ["pywrap", "tests/bench"]
import emcon, emcon.plotting, emcon.study, verification
for script in sys.argv[1:]:
    if (child := os.fork()) == 0:
        sys.argv, sys.path[:1] = [script, "--help"], [os.path.dirname(script)]
        runpy.run_path(script, run_name="__main__")
        os._exit(1)                                  # --help ends a script before
    _, status = os.waitpid(child, 0)
    print("\\0", "" if status == 0 else script, "\\0", sep="", end="", flush=True)
"""


@pytest.fixture(scope="module")
def helps():
    """What the scripts of all lines tell of their options, by script."""
    given = [words for _, _, words in FOUND if any(word.startswith("--") for word in words)]
    scripts = sorted({word for words in given for word in words[:2] if word.endswith(".py")
                      and (ROOT / word).is_file() and "argparse" in (ROOT / word).read_text()})
    done = subprocess.run([sys.executable, "-c", HELPS, *(ROOT / script for script in scripts)],
                          capture_output=True, text=True, cwd=ROOT, timeout=100)
    texts, failed = done.stdout.split("\0")[:-1:2], done.stdout.split("\0")[1::2]
    assert not any(failed) and len(texts) == len(scripts), done.stderr
    return dict(zip(scripts, texts, strict=True))


def look_at_script(words, helps):
    """A script: it is there, and knows the options and the choices that it is given."""
    script = words[0]
    assert (ROOT / script).is_file()
    text = (ROOT / script).read_text()
    if "argparse" not in text:
        return
    for word in words[1:]:
        if word.startswith("--"):
            assert word in helps[script]
        elif script.endswith("verification.py"):
            assert word in "".join(path.read_text() for path in (ROOT / "tests/bench").rglob("*.py"))


def look_at_program(words, folder):
    """A deck that is there is read, with the parameters that the line gives."""
    options = words[1:]
    if not (ROOT / words[0]).is_file():
        assert words[0] in OWN_DECKS
        return
    given = [option for k, option in enumerate(options) if (options[k - 1] if k else "") == "--set"]
    done = subprocess.run(
        [PROGRAM, "check", ROOT / words[0], *(f"--set={one}" for one in given)],
        capture_output=True, text=True, cwd=folder, timeout=100,
    )
    assert done.returncode == 0, done.stderr
    rest = {option for option in options if option.startswith("--")} - {"--set", "--output"}
    assert not rest


@pytest.mark.parametrize("page, line, words", FOUND, ids=lambda value: str(value)[:60])
def test_a_line_can_be_typed(page, line, words, helps, tmp_path):
    words = ["1" if word.startswith("$") else word for word in words if word != "sudo"]
    if words[0] == "valgrind":
        words = [word for word in words[1:] if not word.startswith("--tool") and "callgrind" not in word]
    if ">" in words:
        words = words[: words.index(">")]
    first, rest = words[0], words[1:]
    if first == "make":
        makefile = (ROOT / "Makefile").read_text()
        targets = [word for word in rest if "=" not in word]
        assert all(re.search(rf"^{target}:", makefile, re.MULTILINE) for target in targets)
    elif first == "pip":
        assert rest[0] == "install"
    elif first.startswith("build/release/emcon"):
        look_at_program(rest, tmp_path)
    elif rest[:2] == ["-m", "venv"] or first == ".":
        assert rest[-1].split("/")[0] == "env"
    elif rest[:2] == ["-m", "emcon"] or first == "emcon":
        rest = rest if first == "emcon" else rest[2:]
        if rest != ["--version"]:
            _parser(rest).parse_args(rest)
    elif rest[0] == "-c":
        done = subprocess.run([sys.executable, *rest], capture_output=True, text=True, timeout=100)
        assert done.returncode == 0 and done.stdout, done.stderr
    else:
        look_at_script([word for word in rest if word not in OWN], helps)


def test_many_lines_are_found():
    assert len(FOUND) > 40 and {page for page, _, _ in FOUND} > {"README.md", "trade.md", "theory.md"}
