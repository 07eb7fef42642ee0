"""The reference of Fortran, read from the sources: what `emcon_api` gives, and all modules."""

from __future__ import annotations

import re
from pathlib import Path

from source_text import escape

SOURCES = Path(__file__).resolve().parents[2]/"src_f90"
FACADE = SOURCES/"border"/"emcon_api.f90"

PROCEDURE = r"^ *(?:(?:pure|elemental|impure|recursive|module) )*(?:subroutine|function) {}\b"


def files() -> dict[str, Path]:
    """Files of modules by name, folder after folder as they stand on each other."""
    folders = re.search(r"`(base algebra [\w ]+ app)`",
                        (SOURCES.parent/"README.md").read_text(encoding="utf-8"))
    assert folders
    return {path.stem: path for folder in folders[1].split()
            for path in sorted((SOURCES/folder).glob("*.[fF]90"))}


def above(lines: list[str], k: int) -> str:
    """The comment that ends above line k."""
    first = k
    while first > 0 and lines[first - 1].lstrip().startswith("!>"):
        first -= 1
    return "\n".join(line.strip()[2:].removeprefix(" ") for line in lines[first:k])


def statement(lines: list[str], k: int) -> int:
    """The line behind the statement that begins in line k."""
    while lines[k].split("!")[0].rstrip().endswith("&"):
        k += 1
    return k + 1


def declaration(lines: list[str], k: int) -> list[str]:
    """Head of a procedure with its arguments, of a type with its components."""
    end = statement(lines, k)
    found = lines[k:end]
    if re.match(r" *type\b", lines[k]):
        while not re.match(r" *end type", lines[end]):
            end += 1
        return lines[k:end + 1]
    for line in lines[end:]:
        if re.match(r" *(?!\s)[^!]*\bintent\(|.*:: \w+.*!!", line):
            found.append(line)
        elif not re.match(r" *(!|use\b|import\b|implicit\b|$)", line):
            break
    return found


def entry(path: Path, name: str) -> tuple[str, str] | None:
    """Text and declaration of a public name, None for constants."""
    lines = path.read_text(encoding="utf-8").split("\n")
    for pattern in (PROCEDURE.format(name), rf"^ *type(?:, [\w() ,]+)? ::\s*{name}\b"):
        for k, line in enumerate(lines):
            if re.match(pattern, line) and not line.lstrip().startswith("end"):
                body = declaration(lines, k)
                shift = min(len(row) - len(row.lstrip()) for row in body if row.strip())
                return escape(above(lines, k)), "\n".join(row[shift:].rstrip() for row in body)
    return None


def facade() -> list[tuple[str, list[str]]]:
    """Modules and names that the facade gives, in its order."""
    text = FACADE.read_text(encoding="utf-8").replace("&\n", "")
    return [(module, re.findall(r"\w+", names)) for module, names in
            re.findall(r"^ *use (\w+), only : (.*)$", text, re.MULTILINE)]


def page() -> str:
    """The reference of `use emcon_api`."""
    lines = FACADE.read_text(encoding="utf-8").split("\n")
    begin = next(k for k, line in enumerate(lines) if line.startswith("module"))
    made = ["# Reference of Fortran", above(lines, begin).replace("->", "→"),
            "Programs with examples: [EMCON in other codes](embedding.md)."]
    known = files()
    for module, names in facade():
        found = {name: entry(known[module], name) for name in names}
        made.append(f"## {module}")
        constants = [name for name, what in found.items() if what is None]
        if constants:
            made.append("Also: " + ", ".join(f"`{name}`" for name in constants) + ".")
        for name, what in found.items():
            if what is not None:
                made += [f"### {name}", what[0], f"```fortran\n{what[1]}\n```"]
    return "\n\n".join(part for part in made if part) + "\n"


def modules_page() -> str:
    """All modules with the first sentence of each."""
    made = ["# All modules", "What stands where in `src_f90/`: a module uses those of its own "
            "folder and of the folders before it ([layout of the sources](develop.md#layout-of-the-sources))."]
    folder = ""
    for name, path in files().items():
        if path.parent.name != folder:
            folder = path.parent.name
            made.append(f"\n## {folder}\n\n| module | what it is |\n|---|---|")
        text = path.read_text(encoding="utf-8")
        head = re.search(r"^!>(.*(?:\n!>.*\S)*)", text, re.MULTILINE)
        says = re.sub(r"\s*\n!>\s*", " ", head[1]).strip() if head else ""
        says = re.split(r"(?<=[.:]) (?=[A-Z])", says)[0]
        made[-1] += f"\n| `{name}` | {escape(says)} |"
    return "\n\n".join(made) + "\n"
