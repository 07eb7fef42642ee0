"""Runs of benches that are kept, so that what was interrupted goes on: below build/trade, by the program."""

import dataclasses
import json
import pathlib
import shutil

from scene_tools import PROGRAM, ROOT, Run
from timing import Usage, usage


def folder_of(name):
    """Where runs of a bench are kept as long as the program stays the same."""
    return ROOT / "build" / "trade" / str(int(pathlib.Path(PROGRAM).stat().st_mtime)) / name


def run_once(folder, deck, parameters, program=PROGRAM):
    """The run of `deck` with these parameters in `folder`, and what it took; an earlier one of the
    same deck and parameters is taken as it is."""
    options = [f"--set={name}={value}" for name, value in parameters.items()]
    asked = [str(program), int(pathlib.Path(program).stat().st_mtime), deck.text(), *options]
    kept = folder / "took.json"
    if kept.exists():
        found = json.loads(kept.read_text())
        if found["asked"] == asked:
            took = Usage(**found["took"])
            return Run(folder / "deck", took.errors), took
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    took = usage([program, deck.write(folder / "deck.inp"), "--quiet", "--output", folder, *options])
    beside = kept.with_suffix(".part")
    beside.write_text(json.dumps({"asked": asked, "took": dataclasses.asdict(took)}))
    beside.rename(kept)
    return Run(folder / "deck", took.errors), took


def name_of(*words):
    """A name of a folder from words and numbers."""
    return "-".join("".join(c if c.isalnum() or c == "." else "_" for c in str(word))
                    for word in words)
