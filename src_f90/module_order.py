"""Print make rules 'object: module files that it uses and the files it includes'.

Usage: module_order.py OBJECT_FOLDER MODULE_FOLDER SOURCE...
gfortran's own -M needs the .mod files first, so it cannot order the first build.

gfortran leaves a module file alone whose interface has not changed. The rule of such a file does
nothing, after which make looks at its time: an edit of a body compiles one file. Only where the
module file is gone, the object is made again: found while make reads the rules, for a call of make
in a recipe would run in a dry run (`make -n`) too, once for each way from module to module. The +
lets that look at the times.
"""

import pathlib
import re
import sys

END = r"\s*(?:!.*)?$"
MODULE = re.compile(r"^\s*module\s+(?!procedure\b|subroutine\b|function\b)(\w+)" + END, re.I | re.M)
PARENT = re.compile(r"^\s*submodule\s*\(\s*(\w+)", re.I | re.M)
USE = re.compile(r"^\s*use\b(?:\s*,\s*non_intrinsic\s*::|\s*::)?\s*(\w+)", re.I | re.M)
INCLUDE = re.compile(r"^\s*#?\s*include\s*[\"'<]([^\"'>]+)", re.I | re.M)


def defined(text):
    """Names of the modules that a source defines."""
    return [name.lower() for name in MODULE.findall(text)]


def used(text):
    """Names of the modules that a source uses (`use, intrinsic` excepted)."""
    return {name.lower() for name in USE.findall(text) + PARENT.findall(text)}


def included(path):
    """Files that a source includes, directly or through others, as far as they stand beside it."""
    found = []
    for name in INCLUDE.findall(path.read_text()):
        file = path.parent / name
        if file.exists() and file not in found:
            found += [file, *(f for f in included(file) if f not in found)]
    return found


def rules(folder, module_folder, sources):
    """The rules: one line for each source that needs any, one for each module."""
    files = {s: [s, *included(s)] for s in sources}
    text = {s: "\n".join(f.read_text() for f in files[s]) for s in sources}
    objects = {s: f"{folder}/{s.stem}.o" for s in sources}
    home = {m: s for s in sources for m in defined(text[s])}
    for s in sources:
        needed = {f"{module_folder}/{m}.mod" for m in used(text[s]) if home.get(m, s) != s}
        needed |= {f.as_posix() for f in files[s][1:]}
        if needed:
            yield f"{objects[s]}: {' '.join(sorted(needed))}"
    for m in sorted(home):
        file, made = f"{module_folder}/{m}.mod", objects[home[m]]
        yield f"{file}: {made} ; +@:"
        yield f"{made}: $(if $(wildcard {file}),,always)"
    yield ".PHONY: always"


if __name__ == "__main__":
    for rule in rules(sys.argv[1], sys.argv[2], [pathlib.Path(name) for name in sys.argv[3:]]):
        print(rule)
