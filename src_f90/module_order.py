"""Print make rules 'object: module files that it uses and the files it includes'.

Usage: module_order.py OBJECT_FOLDER MODULE_FOLDER TAGS SOURCE...
gfortran's own -M needs the .mod files first, so it cannot order the first build.

gfortran leaves a module file alone whose interface has not changed. The rule of such a file does
nothing, after which make looks at its time: an edit of a body compiles one file. Only where the
module file is gone, the object is made again: found while make reads the rules, for a call of make
in a recipe would run in a dry run (`make -n`) too, once for each way from module to module. The +
lets that look at the times.

A submodule stands on the .smod file of its parent, and nobody stands on a submodule: what a module
keeps there compiles one file.

A comment `! build: TAG` in a source chooses flags that the Makefile keeps by that name (TAGS are
those that it has, a blank between them): TAGGED_tag lists the files. Sources of the rooms OUTER that
have no such comment have the tag `outer`, if that is one of them. A loop that threads share, or
what one does at a time, is the tag `threads` by itself.
"""

import pathlib
import re
import sys

#: Rooms that read, write and hand on: nothing in them is repeated for each element or contact.
OUTER = {"deck", "scene", "results", "record", "stepper", "border", "app"}
END = r"\s*(?:!.*)?$"
MODULE = re.compile(r"^\s*module\s+(?!procedure\b|subroutine\b|function\b)(\w+)" + END, re.I | re.M)
SUBMODULE = re.compile(r"^\s*submodule\s*\(\s*(\w+)\s*(?::\s*(\w+)\s*)?\)\s*(\w+)" + END, re.I | re.M)
USE = re.compile(r"^\s*use\b(?:\s*,\s*non_intrinsic\s*::|\s*::)?\s*(\w+)", re.I | re.M)
INCLUDE = re.compile(r"^\s*#?\s*include\s*[\"'<]([^\"'>]+)", re.I | re.M)
TAG = re.compile(r"^\s*!\s*build\s*:(.*)$", re.I)
PARALLEL = re.compile(r"^\s*!\$omp\s+(parallel|critical)\b", re.I | re.M)


def defined(text):
    """Names of the modules that a source defines."""
    return [name.lower() for name in MODULE.findall(text)]


def submodules(text):
    """Name of each submodule that a source defines -> its module."""
    return {name.lower(): module.lower() for module, _, name in SUBMODULE.findall(text)}


def parents(text):
    """What the submodules of a source extend: `module`, or `module@submodule` for one of another."""
    return {f"{module}@{parent}".lower() if parent else module.lower()
            for module, parent, _ in SUBMODULE.findall(text)}  # fmt: skip


def used(text):
    """Names of the modules that a source uses or extends (`use, intrinsic` excepted)."""
    return {name.lower() for name in USE.findall(text)} | set(submodules(text).values())


def included(path):
    """Files that a source includes, directly or through others, as far as they stand beside it."""
    found = []
    for name in INCLUDE.findall(path.read_text()):
        file = path.parent / name
        if file.exists() and file not in found:
            found += [file, *(f for f in included(file) if f not in found)]
    return found


def tag(path, known):
    """The build tag of a source, or nothing; ends the script where it is none of the known ones."""
    found = [(number, match[1].strip()) for number, line
             in enumerate(path.read_text().splitlines(), 1) if (match := TAG.match(line))]  # fmt: skip
    for k, (number, name) in enumerate(found):
        if name not in known:
            there = ", ".join(known) or "none"
            raise SystemExit(f"{path}:{number}: there is no build tag '{name}'; there are: {there}")
        if k > 0:
            raise SystemExit(f"{path}:{number}: the second build tag of a file, which has one")
    if found:
        return found[0][1]
    return "outer" if "outer" in known and path.parent.name in OUTER else ""


def made_files(text):
    """Module files by the source that makes them: .mod of modules, .smod of what is extended."""
    extended = set().union(*(parents(t) for t in text.values()))
    for s in text:
        for m in defined(text[s]):
            yield f"{m}.mod", s
            if m in extended:
                yield f"{m}.smod", s
        for name, module in submodules(text[s]).items():
            if f"{module}@{name}" in extended:
                yield f"{module}@{name}.smod", s


def rules(folder, module_folder, sources):
    """The rules: one line for each source that needs any, one for each module file."""
    files = {s: [s, *included(s)] for s in sources}
    text = {s: "\n".join(f.read_text() for f in files[s]) for s in sources}
    objects = {s: f"{folder}/{s.stem}.o" for s in sources}
    home = dict(made_files(text))
    for s in sources:
        needed = {f"{m}.mod" for m in used(text[s])} | {f"{m}.smod" for m in parents(text[s])}
        needed = {f"{module_folder}/{m}" for m in needed if home.get(m, s) != s}
        needed |= {f.as_posix() for f in files[s][1:]}
        if needed:
            yield f"{objects[s]}: {' '.join(sorted(needed))}"
    for m in sorted(home):
        file, made = f"{module_folder}/{m}", objects[home[m]]
        yield f"{file}: {made} ; +@:"
        yield f"{made}: $(if $(wildcard {file}),,always)"
    yield ".PHONY: always"


def lists(known, sources):
    """Lists of files, without folder and ending: of each tag, of threads, of all modules."""
    tagged = {name: [] for name in known}
    for s in sources:
        if name := tag(s, known):
            tagged[name].append(s.stem)
    tagged["threads"] = [s.stem for s in sources if PARALLEL.search(s.read_text())]
    for name, stems in tagged.items():
        yield f"TAGGED_{name} := {' '.join(stems)}"
    modules = [m for s in sources for m in defined(s.read_text())]
    yield f"MODULES := {' '.join(modules)}"


if __name__ == "__main__":
    paths = [pathlib.Path(name) for name in sys.argv[4:]]
    for line in [*lists(sys.argv[3].split(), paths), *rules(sys.argv[1], sys.argv[2], paths)]:
        print(line)
