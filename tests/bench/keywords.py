"""The tables of keywords in docs/deck.md, made from what `emcon keywords` prints.

`python tests/bench/keywords.py --update` writes them; without it they are printed.
"""

import argparse
import os
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = pathlib.Path(os.environ.get("EMCON", ROOT/"build/release/emcon"))
PAGE = ROOT/"docs/deck.md"
COLUMNS = ["takes", "neutral values", "without effect, with a warning", "refused"]


def quoted(names):
    return ", ".join(f"`{name}`" for name in names.split(", ")) if names else ""


def tables(told):
    """Name of a table -> its lines, from the lines of the program."""
    known, refused, idle = [], [], []
    for line in told.splitlines():
        if found := re.match(r"(\*[\w ]+): (.*)", line):
            known.append((found[1], found[2], {}))
        elif found := re.match(r"   ([a-z, ]+): (.*)", line):
            known[-1][2][found[1]] = found[2]
        elif found := re.match(r"(not supported|changes nothing)(, left out with --lenient)?: ([*\w, -]+): (.*)", line):
            row = f"| {quoted(found[3])} | " + re.sub(r"[*][A-Z]+( [A-Z]+)*", lambda name: f"`{name[0]}`", found[4])
            row += "; left out with `--lenient` |" if found[2] else " |"
            (idle if found[1] == "changes nothing" else refused).append(row)
        else:
            raise ValueError(line)
    rows = [f"| `{name}` | {place} | " + " | ".join(quoted(of.get(column, "")) for column in COLUMNS) + " |"
            for name, place, of in known]
    return {
        "keywords": ["| keyword | where | " + " | ".join(COLUMNS) + " |", "|---|---" + "|---"*len(COLUMNS) + "|", *rows],
        "refusals": ["| keywords | why |", "|---|---|", *refused],
        "idle": ["| keywords | why |", "|---|---|", *idle],
    }


def page(text):
    """The page with its tables made anew."""
    told = subprocess.run([PROGRAM, "keywords"], capture_output=True, text=True, check=True).stdout
    for name, lines in tables(told).items():
        mark = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end -->)", re.DOTALL)
        assert mark.search(text), f"docs/deck.md has no table {name}"
        text = mark.sub(lambda match, lines=lines: match[1] + "\n".join(lines) + "\n" + match[2], text)
    return text


def main():
    parser = argparse.ArgumentParser(description="Tables of keywords in docs/deck.md")
    parser.add_argument("--update", action="store_true", help="write into docs/deck.md")
    made = page(PAGE.read_text())
    if parser.parse_args().update:
        PAGE.write_text(made)
    else:
        print(made.split("<!-- keywords -->")[1])


if __name__ == "__main__":
    main()
