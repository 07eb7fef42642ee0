"""The examples of docs/python.md and other pages, run in order; `python tests/embed/python_doc.py
--write [--page tutorial]` puts what they print, and their pictures, into the page anew.

A chapter is one namespace and one folder, with `input_decks` beside it and `emcon` on the path. A
python block whose first line is `# name.py` is a file: all chapters find it, and it is run as a
script where it stands. So is a block of the language `text deck` that begins with `** name.inp`, which
is not run; a block `sh run` is run by the shell. A text block right after one that runs is what that
prints; of `text rounded` the words are the same and the numbers nearly so, on any processor; `text varies`
says that it is not the same each time. Pictures of the page are files that its examples leave.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import io
import itertools
import json
import linecache
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT/"docs"/f"{name}.md" for name in ("python", "tutorial", "howto", "hosts", "embedding")]
#: Languages of blocks that are files or run.
RUNS = {"python", "sh run", "text deck"}
#: Languages of blocks that show what is printed.
OUTPUTS = ("text", "text rounded", "text varies")
#: Of one chapter [s].
LONGEST = 300
#: Files in the folder of a chapter: what its examples print, and what went past that.
ANSWER, ERRORS = ".answer", ".errors"
#: Numbers of `text rounded`: processors round differently, so that counts of iterations and last
#: digits differ by some percent; what is below the other bound is round-off as a whole.
NEARLY, ROUND_OFF = 0.1, 1e-10
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?(?!\w)")


@dataclass(frozen=True)
class Block:
    """A fenced block; lines of the page count from 0, `last` is that of its closing fence."""

    language: str
    text: str
    first: int
    last: int
    chapter: str


@dataclass(frozen=True)
class Example:
    """Python and what it prints; None where the page does not show that."""

    code: Block
    output: Block | None

    @property
    def file(self) -> str | None:
        """The name of the file that the block is."""
        name = re.match(r"(?:#|\*\*) (\w+\.(?:py|inp))\n", self.code.text)
        return name[1] if name else None

    def shows(self, printed: str) -> bool:
        """Is `printed` what the page shows?"""
        if self.output is None:
            return not printed
        if self.output.language == "text varies":
            return bool(printed.strip())
        if self.output.language == "text rounded":
            return is_near(printed, self.output.text)
        return tidy(printed) == self.output.text


def blocks(lines: list[str]) -> list[Block]:
    """All fenced blocks of a page."""
    found: list[Block] = []
    chapter, start = "", None
    for k, line in enumerate(lines):
        if start is None and line.startswith("## "):
            chapter = line[3:].strip()
        if not line.startswith("```"):
            continue
        if start is None:
            start = k
        else:
            found.append(Block(lines[start][3:].strip(), "".join(lines[start + 1:k]), start, k,
                               chapter))
            start = None
    return found


def examples(page: str) -> dict[str, list[Example]]:
    """The examples of each chapter, in order."""
    lines = page.splitlines(keepends=True)
    found: dict[str, list[Example]] = {}
    all_blocks = blocks(lines)
    for block, after in zip(all_blocks, [*all_blocks[1:], None]):
        if block.language not in RUNS:
            continue
        shows = (after is not None and after.language in OUTPUTS
                 and not "".join(lines[block.last + 1:after.first]).strip())
        found.setdefault(block.chapter, []).append(Example(block, after if shows else None))
    return found


def pictures(page: str) -> dict[str, str]:
    """Names of the pictures of the page, and the chapters that they stand in."""
    return {name: chapter.partition("\n")[0].strip()
            for chapter in re.split(r"^## ", page, flags=re.MULTILINE)
            for name in re.findall(r"!\[[^\]]*\]\((\w+\.png)\)", chapter)}


# --- running -----------------------------------------------------------------------------------

def run_chapter(page: str, title: str, folder: Path) -> list[str]:
    """What each example of a chapter prints. Raises `AssertionError` where one fails."""
    chapters = examples(page)
    chapter = chapters[title]
    for example in itertools.chain(*chapters.values()):
        if example.file:
            (folder/example.file).write_text(example.code.text, encoding="utf-8")
    (folder/"input_decks").symlink_to(ROOT/"input_decks")
    work = [(example.code.text, example.file, example.code.language) for example in chapter]
    answer = server().answer(folder, work)
    printed: list[str] = answer["printed"]
    if answer["failed"]:
        block = chapter[len(printed)].code
        raise AssertionError(f"block at line {block.first + 1}: {answer['failed']}")
    return printed


class Server:
    """A process that has loaded what examples import, and runs each chapter in a copy of itself."""

    def __init__(self) -> None:
        path = os.pathsep.join([str(ROOT/"build"/"release"), os.environ.get("PATH", "")])
        env = os.environ | {"PYTHONPATH": str(ROOT/"pywrap"), "PATH": path, "MPLBACKEND": "agg"}
        self.process = subprocess.Popen([sys.executable, str(Path(__file__).resolve()), "--run"], env=env, text=True,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def answer(self, folder: Path, work: list[tuple[str, str | None, str]]) -> dict[str, Any]:
        assert self.process.stdin and self.process.stdout
        print(json.dumps([str(folder), work]), file=self.process.stdin, flush=True)
        status = int(self.process.stdout.readline())
        assert status == 0, f"a chapter ends with {status}\n{(folder/ERRORS).read_text()}"
        return dict(json.loads((folder/ANSWER).read_text()))


@functools.cache
def server() -> Server:
    return Server()


def serve() -> None:
    """For each line of standard input: run the chapter in its folder, tell how that has ended."""
    import h5py  # noqa: F401
    import matplotlib.pyplot  # noqa: F401
    import numpy  # noqa: F401

    for line in sys.stdin:
        folder, work = json.loads(line)
        child = os.fork()
        if child == 0:
            signal.alarm(LONGEST)
            os.chdir(folder)
            os.dup2(os.open(os.devnull, os.O_RDWR), 0)
            os.dup2(os.open(ERRORS, os.O_WRONLY | os.O_CREAT), 2)
            os.dup2(2, 1)
            Path(ANSWER).write_text(json.dumps(run_blocks(work)))
            sys.stdout.flush()
            os._exit(0)
        print(os.waitpid(child, 0)[1], flush=True)


def run_blocks(work: list[tuple[str, str | None, str]]) -> dict[str, Any]:
    """In a process of its own: what each example prints, and what was wrong with the last."""
    printed: list[str] = []
    failed = ""
    namespace: dict[str, Any] = {"__name__": "__doc_example__"}
    sys.path[0] = os.getcwd()
    for k, (text, file, language) in enumerate(work):
        out = io.StringIO()
        try:
            with contextlib.redirect_stdout(out):
                if language == "sh run":
                    out.write(run_shell(text))
                elif language == "text deck":
                    pass
                elif file is None:
                    name = "example.py"
                    linecache.cache[name] = (len(text), None, text.splitlines(True), name)
                    exec(compile(text, name, "exec"), namespace)
                else:
                    out.write(run_command([sys.executable, file]))
        except BaseException:
            failed = f"block {k + 1} of the chapter\n{out.getvalue()}{traceback.format_exc()}"
            break
        printed.append(out.getvalue())
    return {"printed": printed, "failed": failed}


def run_shell(text: str) -> str:
    """What commands print, where `emcon` is the command of the package and `python` this one."""
    tools = Path(".tools")
    tools.mkdir(exist_ok=True)
    for name, module in (("emcon", "-m emcon"), ("python", "")):
        (tools/name).write_text(f'#!/bin/sh\nexec "{sys.executable}" {module} "$@"\n')
        (tools/name).chmod(0o755)
    path = f"{tools.resolve()}{os.pathsep}{os.environ['PATH']}"
    return run_command(["env", f"PATH={path}", "sh", "-e", "-c", text])


def run_command(command: list[str]) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{command[-1]} ends with {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def tidy(text: str) -> str:
    """Without blanks at line ends and empty lines at the end: what is compared."""
    return "".join(line.rstrip() + "\n" for line in text.rstrip().splitlines())


def is_near(text: str, other: str) -> bool:
    """The same words, and numbers that rounding can make of each other?"""
    words = [NUMBER.sub("#", tidy(t)).split() for t in (text, other)]
    numbers = [[float(n) for n in NUMBER.findall(t)] for t in (text, other)]
    return words[0] == words[1] and all(
        max(abs(a), abs(b)) < ROUND_OFF or abs(a - b) <= NEARLY*max(abs(a), abs(b))
        for a, b in zip(*numbers, strict=True))


# --- writing the page --------------------------------------------------------------------------

def main() -> None:
    parser = argparse.ArgumentParser(description="Run the examples of a page.")
    parser.add_argument("--page", default="python", choices=[path.stem for path in PAGES])
    parser.add_argument("--write", action="store_true",
                        help="put outputs and pictures into the page anew")
    parser.add_argument("--only", metavar="TEXT", default="",
                        help="only chapters with TEXT in the title")
    parser.add_argument("--run", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.run:
        serve()
        return
    path = ROOT/"docs"/f"{options.page}.md"
    page = path.read_text(encoding="utf-8")
    lines = page.splitlines(keepends=True)
    changes: list[tuple[Block, str]] = []
    for title, chapter in examples(page).items():
        if options.only.lower() not in title.lower():
            continue
        start = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            printed = run_chapter(page, title, Path(folder))
            for name, place in pictures(page).items():
                if options.write and place == title:
                    (path.parent/name).write_bytes((Path(folder)/name).read_bytes())
        print(f"{time.perf_counter() - start:6.1f} s  {title}")
        for example, text in zip(chapter, printed):
            if example.output is None:
                print(text, end="")
            elif tidy(text) != example.output.text and not (
                    example.output.language == "text rounded" and example.shows(text)):
                changes.append((example.output, tidy(text)))
    for block, text in reversed(changes):
        print(f"line {block.first + 1}:\n{text}", end="")
        lines[block.first + 1:block.last] = [text]
    if options.write:
        path.write_text("".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
