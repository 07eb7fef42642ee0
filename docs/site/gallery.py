"""The gallery: every deck of input_decks as a page, with the picture of its run and the deck.

Runs stay in build/site/runs, and are made anew where the program or the deck is younger.
"""

from __future__ import annotations

import csv
import re
import shutil
import subprocess
import sys
from pathlib import Path

from source_text import escape

ROOT = Path(__file__).resolve().parents[2]
DECKS = ROOT/"input_decks"
PROGRAM = ROOT/"build"/"release"/"emcon"

#: Decks by what they show; those that are not named stand last.
CHAPTERS = {
    "Parts of machines": "snap_fit dropped_casing seal wheel press_fit roller pressed_ball linked_rings",
    "Impacts": "ring two_bodies three_bodies self_contact bouncing_bar bar_on_wall rigid_bar "
               "bouncing_ball ball_in_bowl thrown_ring caught_ring hertz_ball",
    "Friction": "sliding_block dominoes",
    "Contact at rest": "hertz ironing two_blocks_static patch_pressure contact_patch",
    "Ties": "tied_ring tied_spin tied_rotation tied_cantilever tied_patch tied_smooth",
    "Bodies alone": "spinning_ring tumbling_block cantilever",
}
#: Decks of which a second picture shows another field.
FIELDS = {"sliding_block": "contact_shear", "hertz": "contact_pressure", "seal": "contact_pressure",
          "wheel": "contact_shear"}
#: Rows of a block of data that are shown.
SHOWN_ROWS = 4


def chapters() -> dict[str, list[str]]:
    """Decks of each chapter; one that is new has a place too."""
    found = {title: names.split() for title, names in CHAPTERS.items()}
    listed = {name for names in found.values() for name in names}
    rest = sorted({path.stem for path in DECKS.glob("*.inp")} - listed)
    return found | ({"Others": rest} if rest else {})


def heading(deck: str) -> tuple[str, str]:
    """First line and text of the heading of a deck."""
    lines = deck.split("\n")
    text = []
    for line in lines[2:]:
        if not line.startswith("**"):
            break
        text.append(line[2:].removeprefix(" "))
    return lines[1].strip(), "\n".join(text).strip()


def excerpt(deck: str) -> str:
    """The deck behind its heading, long blocks of numbers cut."""
    lines = deck.split("\n")
    first = next((k for k, line in enumerate(lines) if k > 1 and not line.startswith("**")), 0)
    made: list[str] = []
    rows = 0
    for line in [*lines[first:], "*"]:
        if re.match(r"\s*[-+\d.]", line):
            rows += 1
            if rows > SHOWN_ROWS:
                continue
        elif rows:
            if rows > SHOWN_ROWS:
                made.append(f"** ... {rows - SHOWN_ROWS} more lines")
            rows = 0
        made.append(line)
    return "\n".join(made[:-1]).rstrip("\n")


def run(name: str, runs: Path) -> Path:
    """The picture of the run of a deck."""
    deck, picture = DECKS/f"{name}.inp", runs/f"{name}.png"
    made = [picture, *([runs/f"{name}_field.png"] if name in FIELDS else [])]
    if all(path.exists() for path in made) and min(path.stat().st_mtime for path in made) > max(
            path.stat().st_mtime for path in (deck, PROGRAM)):
        return picture
    done = subprocess.run([PROGRAM, deck, "--output", runs], capture_output=True, text=True)
    if done.returncode not in (0, 3):
        raise SystemExit(f"{deck}: {done.stdout}{done.stderr}")
    pictures = [["--output", picture]]
    if name in FIELDS:
        pictures.insert(0, ["--output", runs/f"{name}_field.png", "--field", FIELDS[name]])
    for options in pictures:
        subprocess.run([sys.executable, "-m", "emcon", "plot", runs/name, *options],
                       check=True, capture_output=True, cwd=ROOT/"pywrap")
    return picture


def seconds(name: str, runs: Path) -> str:
    """What the run of a deck has taken, by the last line of its history."""
    with (runs/f"{name}.csv").open() as file:
        *_, last = csv.DictReader(file)
    return f"The run takes {float(last['cpu']):.2g} s of processor time."


def page(name: str, time: str) -> str:
    """The page of a deck, whose picture stands beside it."""
    text = (DECKS/f"{name}.inp").read_text(encoding="utf-8")
    title, more = heading(text)
    made = [f"# {name}", escape(title), f"![{title}]({name}.png)",
            f"    emcon input_decks/{name}.inp --output run\n    emcon plot run/{name}",
            *([f"    emcon plot run/{name} --field {FIELDS[name]}",
               f"![{FIELDS[name].replace('_', ' ')}]({name}_field.png)"] if name in FIELDS else []),
            time,
            f"```text\n{more}\n```" if more else "",
            f"The deck, without most of its mesh ([all of it](../input_decks/{name}.inp)):",
            f"```text\n{excerpt(text)}\n```"]
    script = DECKS/f"make_{name}.py"
    if script.is_file():
        made += [f"It is made by [make_{name}.py](../input_decks/make_{name}.py):",
                 f"```python\n{script.read_text(encoding='utf-8').strip()}\n```"]
    return "\n\n".join(part for part in made if part) + "\n"


def build(pages: Path, runs: Path) -> None:
    """The pages into the folder `gallery` of the site, and their index."""
    folder = pages/"gallery"
    folder.mkdir()
    runs.mkdir(parents=True, exist_ok=True)
    made = ["# Gallery", "All decks of `input_decks/`, each with the picture that `emcon plot` makes "
            "of its run. Scenes that begin with a drawing in Gmsh: [From Gmsh to ParaView]"
            "(../gmsh.md)."]
    for title, names in chapters().items():
        made.append(f"## {title}")
        for name in names:
            shutil.copy(run(name, runs), folder/f"{name}.png")
            if name in FIELDS:
                shutil.copy(runs/f"{name}_field.png", folder)
            time = seconds(name, runs)
            (folder/f"{name}.md").write_text(page(name, time), encoding="utf-8")
            first, _ = heading((DECKS/f"{name}.inp").read_text(encoding="utf-8"))
            made.append(f"### [{name}]({name}.md)\n\n{escape(first)} {time}\n\n"
                        f"[![{first}]({name}.png)]({name}.md)")
        made.append("```{toctree}\n:hidden:\n\n" + "\n".join(names) + "\n```")
    (folder/"index.md").write_text("\n\n".join(made) + "\n", encoding="utf-8")
