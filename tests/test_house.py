"""The layers of the house, read from the sources: one way down, no arrow back up.

The rooms stand in the order of ROOMS; a module uses its own room and rooms before it. The
functions take the root of a tree and return findings, so they are tried on bad trees below.
"""

import ast
import collections
import functools
import graphlib
import importlib.util
import json
import pathlib
import re
import subprocess

import house_counts
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[1]
ROOMS = (
    "base algebra dgrad laws elements schemes scene deck space solid surfaces touch contact terms "
    "system prepare state solve active march results stepper record border app".split()
)
# The program knows runs and the stepper only; texts and errors of base are common to all.
ONLY = {"app": {"app", "record", "stepper", "base"}}
TOP = set("Makefile src_f90 pywrap input_decks tests docs".split())
TOP |= set("README.md LICENSE CHANGELOG.md CITATION.cff pyproject.toml CMakeLists.txt".split())

#: Where the kinds of each abstract type are made: nobody else knows one of them by name.
REGISTRY = {
    "sparse_solver_t": {"emcon_solver_kinds"},
    "law_t": {"emcon_law_kinds"},
    "shape_t": {"emcon_element_kinds"},
    "scheme_t": {"emcon_scheme_kinds"},
    "contact_t": {"emcon_contact_kinds"},
    "start_gaps_t": {"emcon_contact_kinds"},
    "overlap_query_t": {"emcon_overlap_query_kinds"},
    "term_t": {"emcon_term_kinds"},
    "constraint_t": {"emcon_constraint_kinds"},
    "host_force_t": {"emcon_stepper_user", "emcon_c_given"},
}
#: What is made of another kind of its room: gaps of nodes, interpolated or looked at; laws with
#: their lanes of space.
MADE_OF = {("emcon_segment", "emcon_nts"), ("emcon_start_gaps_plane", "emcon_nts")} | {
    (f"emcon_law_{law}_space", f"emcon_law_{law}")
    for law in ("linear", "neo_hooke", "coupled_neo_hooke", "mooney_rivlin", "yeoh")
}

COLUMNS = 100
#: A procedure fits a screen, and its arguments a line; but what C hands over one by one.
MOST_LINES, MOST_ARGUMENTS = 60, 7
FROM_C = {"stepper", "border"}
#: A type is taken in at a glance; these hold more than one subject and are still to be split.
MOST_COMPONENTS = 20
STILL_BIG = {"active_set_t"}

STRING = re.compile(r"\"[^\"\n]*\"|'[^'\n]*'")
COMMENT = re.compile(r"!.*")
# At the start of a statement or behind a one-line `if (...)`.
STOP = re.compile(r"(?:^|[;)])\s*(?:(?:error\s+)?stop\b(?!\s*[=(%])|call\s+(?:exit|abort)\b)", re.I)
PRINT = re.compile(r"(?:^|[;)])\s*(?:print\s*[*\"'(]|write\s*\(\s*\*)", re.I)

PLACED = {"contact", "touch", "solve", "active", "march"}
CITED = re.compile(r"(\S+\s)?\beqs?\. ((?:\(\w+\)(?:, | and | to )?)+)")

_spec = importlib.util.spec_from_file_location("module_order", ROOT / "src_f90/module_order.py")
module_order = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(module_order)


def sources(root):
    return sorted(p for p in (root / "src_f90").rglob("*") if p.suffix in {".f90", ".F90", ".inc"})


def room(root, path):
    return path.relative_to(root / "src_f90").parts[0]


def units(text):
    """Names of the modules and submodules that a source defines."""
    return module_order.defined(text) + list(module_order.submodules(text))


@functools.cache
def modules(root):
    """Module name -> (file, room, used modules); an included file counts for the including one.

    A submodule is one that uses the module it extends.
    """
    found = {}
    for path in sources(root):
        if path.suffix == ".inc":
            continue
        text = path.read_text()
        used = set()
        for part in [path, *module_order.included(path)]:
            used |= module_order.used(part.read_text())
        for name in units(text) or [f"program {path.stem}"]:
            found[name] = (path, room(root, path), used)
    return found


def names(root):
    """Files that are not one module of the file's name (in app/, one may be the program)."""
    for path in sources(root):
        if path.suffix == ".inc":
            continue
        if room(root, path) not in ROOMS:
            yield f"{path.relative_to(root)}: not in a room of the house"
        defined = units(path.read_text())
        for parent in module_order.submodules(path.read_text()).values():
            if not list(path.parent.glob(f"{parent}.[fF]90")):
                yield f"{path.relative_to(root)}: a submodule of {parent}, which stands elsewhere"
        is_program = not defined and room(root, path) == "app"
        if defined != [path.stem] and not is_program:
            yield f"{path.relative_to(root)}: defines {defined or 'no module'}, not {path.stem}"


def arrows_up(root):
    """Uses of a room that stands below the user's own."""
    found = modules(root)
    for name, (_, home, used) in sorted(found.items()):
        for other in sorted(used & set(found)):
            there = found[other][1]
            allowed = ONLY.get(home) or set(ROOMS[: ROOMS.index(home) + 1])
            if there not in allowed:
                yield f"{name} ({home}) uses {other} ({there})"


def cycles(root):
    """The first cycle among the modules, if any."""
    try:
        graphlib.TopologicalSorter({n: m[2] for n, m in modules(root).items()}).prepare()
    except graphlib.CycleError as error:
        yield " -> ".join(error.args[1])


EXTENDS = re.compile(
    r"^\s*type\b([^!\n]*)\bextends\s*\(\s*(\w+)\s*\)[^!\n]*::\s*(\w+)", re.I | re.M
)


def kinds(root):
    """Module -> abstract types that its own types are kinds of; those again abstract left out."""
    parent, concrete = {}, {}
    for path in sources(root):
        for words, base, name in EXTENDS.findall(path.read_text()):
            parent[name.lower()] = base.lower()
            if "abstract" not in words.lower():
                concrete.setdefault(path.stem, set()).add(name.lower())
    found = {}
    for module, types in concrete.items():
        for kind in types:
            while kind not in REGISTRY and kind in parent:
                kind = parent[kind]
            if kind in REGISTRY:
                found.setdefault(module, set()).add(kind)
    return found


def named_kinds(root):
    """Uses of a kind of law, term, constraint, ... outside its registry."""
    found, concrete = modules(root), kinds(root)
    for name, (_, _, used) in sorted(found.items()):
        for other in sorted(used & set(concrete)):
            allowed = set().union(*(REGISTRY[base] for base in concrete[other]))
            if name not in allowed and (name, other) not in MADE_OF:
                yield f"{name} uses {other}, a kind of {' and '.join(sorted(concrete[other]))}"


def compiled_with(root, name):
    """The files that are compiled where a module or submodule has a new interface, at the most."""
    found, new = modules(root), {name}
    while more := {user for user, (_, _, used) in found.items() if used & new} - new:
        new |= more
    return new


def statements(root, pattern, rooms_free):
    """Lines that match, comments and strings aside, outside the rooms that may do so."""
    for path in sources(root):
        if room(root, path) in rooms_free:
            continue
        for number, line in enumerate(path.read_text().splitlines(), 1):
            if pattern.search(COMMENT.sub("", STRING.sub('""', line))):
                yield f"{path.relative_to(root)}:{number}: {line.strip()}"


def plain_simd(root):
    """Sources with loops in lanes whose build tag does not let the compiler see the directive."""
    for path in sources(root):
        text = "".join(p.read_text() for p in [path, *module_order.included(path)])
        if path.suffix != ".inc" and re.search(r"^\s*!\$omp\s+simd\b", text, re.I | re.M):
            if not re.search(r"^! build: (lanes|streams)$", path.read_text(), re.M):
                yield f"{path.relative_to(root)}: !$omp simd without a tag ! build: lanes or streams"


def long_lines(root):
    """Lines of more columns than .fortitude.toml allows."""
    for path in sources(root):
        for number, line in enumerate(path.read_text().splitlines(), 1):
            if len(line) > COLUMNS:
                yield f"{path.relative_to(root)}:{number}: {len(line)} columns"


def procedures(path):
    """(first line, name, lines, arguments) of each procedure; interfaces of others aside.

    Of one whose body stands in a submodule, the interface has the arguments, the body the lines.
    """
    opened, inside = False, []
    for number, code, _ in house_counts.statements(path):
        low = code.lower()
        if re.match(r"(abstract )?interface\b", low):
            opened = True
        elif re.match(r"end\s*interface\b", low):
            opened = False
        elif opened and re.match(r"(pure\s+)?module\s", low) and (head := house_counts.HEAD.match(low)):
            yield number, head[1], 1, len(re.findall(r"\w+", head[2] or ""))
        elif not opened and re.match(r"end\s*(subroutine|function|procedure)\b", low):
            start, name, count = inside.pop()
            yield start, name, number - start + 1, count
        elif not opened and (head := re.match(r"module\s+procedure\s+(\w+)", low)):
            inside.append((number, head[1], 0))
        elif not opened and (head := house_counts.HEAD.match(low)):
            inside.append((number, head[1], len(re.findall(r"\w+", head[2] or ""))))


def long_procedures(root):
    """Procedures of too many lines or arguments."""
    for path in sources(root):
        if room(root, path) in FROM_C:
            continue
        for start, name, lines, count in procedures(path):
            if lines > MOST_LINES or count > MOST_ARGUMENTS:
                yield f"{path.relative_to(root)}:{start}: {name}, {lines} lines, {count} arguments"


def components(path):
    """(first line, name, components) of each type, its parents' own aside."""
    start, name, count = 0, "", 0
    for number, code, _ in house_counts.statements(path):
        low = code.lower()
        if head := re.match(r"type\b(?!\s*\(|\s+is\b)[^:]*(?:::)?\s*\b(\w+)$", low):
            start, name, count = number, head[1], 0
        elif name and re.match(r"contains$|end\s*type\b", low):
            yield start, name, count
            name = ""
        elif name and "::" in low:
            declared = house_counts.without_brackets(low.split("::", 1)[1])
            count += len([part for part in declared.split(",") if part.strip()])


def big_types(root):
    """Types of more components than a reader keeps in mind."""
    for path in sources(root):
        for number, name, count in components(path):
            if count > MOST_COMPONENTS and name not in STILL_BIG:
                yield f"{path.relative_to(root)}:{number}: {name}, {count} components"


def top_level(root):
    """Entries at the top that the house does not know; ignored files do not count."""
    listed = subprocess.run(
        ["git", "-C", root, "ls-files", "--cached", "--others", "--exclude-standard"],
        capture_output=True,
        text=True,
    )
    if listed.returncode == 0:
        entries = {line.split("/")[0] for line in listed.stdout.splitlines()}
    else:  # an unpacked archive
        entries = {p.name for p in root.iterdir()} - {"build"}
    return sorted(e for e in entries - TOP if not e.startswith("."))


def bound(body):
    """Names that the statements of a module or class define or import, but by assignment."""
    for node in body:
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            yield node.name
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            yield from (a.asname or a.name for a in node.names if a.name != "*")


def hidden(root):
    """Definitions in Python that a second one of their name hides: tests that never run."""
    for path in sorted(p for top in TOP for p in (root / top).rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for body in [tree.body, *(n.body for n in ast.walk(tree) if isinstance(n, ast.ClassDef))]:
            for name, times in collections.Counter(bound(body)).items():
                if times > 1:
                    yield f"{path.relative_to(root)}: defines {name} {times} times"


def imports(path, package):
    """Modules of the package that one of them imports, those for types alone included."""
    above = path.relative_to(package).parent
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.ImportFrom) or not node.level:
            continue
        base = package.joinpath(*above.parts[: len(above.parts) - node.level + 1])
        base = base.joinpath(*(node.module or "").split("."))
        for file in [base, *(base / alias.name for alias in node.names)]:
            if file.with_suffix(".py").is_file():
                yield ".".join(file.relative_to(package).parts)
        if (base / "__init__.py").is_file() and node.module:
            yield ".".join([*base.relative_to(package).parts, "__init__"])


def python_cycles(root):
    """The first cycle among the modules of the Python package, if any."""
    package = root / "pywrap/emcon"
    used = {".".join(path.relative_to(package).with_suffix("").parts): set(imports(path, package))
            for path in package.rglob("*.py")}  # fmt: skip
    try:
        graphlib.TopologicalSorter(used).prepare()
    except graphlib.CycleError as error:
        yield " -> ".join(error.args[1])


def theory_numbers(root):
    """Equations and sections that sources cite and docs/theory.md does not have."""
    theory = (root / "docs/theory.md").read_text()
    tags = re.findall(r"\\tag\{(\w+)\}", theory)
    numbers = set(tags)
    for number in sorted(numbers):
        if tags.count(number) > 1:
            yield f"docs/theory.md: equation ({number}) is there {tags.count(number)} times"
    sections = set(re.findall(r"^##+ ([\d.]+) ", theory, re.M))
    for path in sources(root):
        comments = " ".join(re.findall(r"!+[<>]?\s?(.*)", path.read_text()))
        for kind, cited in re.findall(CITED, comments):
            for number in re.findall(r"\w+", re.sub(r"and|to", "", cited)):
                if not kind.startswith("paper") and number not in numbers:
                    yield f"{path.relative_to(root)}: eq. ({number}) is not in docs/theory.md"
        for cited in re.findall(r"theory\.md, sections? ((?:\d[\d.]*(?:, | and )?)+)", comments):
            for number in set(re.findall(r"\d+(?:\.\d+)?", cited)) - sections:
                yield f"{path.relative_to(root)}: section {number} is not in docs/theory.md"


def theory_places(root):
    """Modules of contact and of the march that docs/theory.md does not name."""
    theory = set(re.findall(r"\w+", (root / "docs/theory.md").read_text()))
    for path in sources(root):
        if room(root, path) in PLACED and path.suffix != ".inc" and path.stem not in theory:
            yield f"docs/theory.md does not name {path.stem}"


CHECKS = {
    "theory": theory_numbers,
    "theory places": theory_places,
    "names": names,
    "arrows up": arrows_up,
    "cycles": cycles,
    "python cycles": python_cycles,
    "kinds": named_kinds,
    "stop": lambda root: statements(root, STOP, {"app"}),
    "print": lambda root: statements(root, PRINT, {"app", "results"}),
    "simd": plain_simd,
    "long lines": long_lines,
    "long procedures": long_procedures,
    "big types": big_types,
    "top level": top_level,
    "hidden": hidden,
}


@pytest.mark.parametrize("check", CHECKS)
def test_house(check):
    assert list(CHECKS[check](ROOT)) == []


@pytest.mark.parametrize("table", sorted(
    {name for names in REGISTRY.values() for name in names if name.endswith("_kinds")}
    | {"emcon_contact_law_kinds", "emcon_quantity_rows"}))  # fmt: skip
def test_a_new_kind_compiles_its_file_and_its_table(table):
    """A law, an element, a scheme, a solver, a term, ...: nobody else is to be compiled anew."""
    assert compiled_with(ROOT, table) == {table}


def test_counts_only_fall():
    """Dummy arguments that say nothing, literals and words of the plane: `house_counts.py --list`."""
    record = json.loads(house_counts.RECORD.read_text())
    assert set(record) == set(house_counts.KINDS)
    assert list(house_counts.risen(house_counts.counts(ROOT), record)) == []


def test_tables_of_develop_name_what_there_is():
    """The modules of the glossary, the suites and files that stand beside each folder."""
    text = (ROOT / "docs/develop.md").read_text()
    glossary = text.split("\n## Glossary\n")[1].split("\n## ")[0]
    told = set(re.findall(r"`(emcon_\w+)`", glossary))
    assert told and told <= set(modules(ROOT))
    table = text.split("\n## Which tests for which folder\n")[1].split("\n## ")[0]
    rows = re.findall(r"^\| `(\w+)` \|(.*)\|(.*)\|$", table, re.M)
    assert {row[0] for row in rows} == set(ROOMS)
    assert all((ROOT / f"tests/kernels/test_{name}.f90").is_file()
               for row in rows for name in re.findall(r"`(\w+)`", row[1]))  # fmt: skip
    assert all((ROOT / name).exists() for row in rows for name in re.findall(r"`(.+?)`", row[2]))


def test_one_version():
    """The library, the package, the citation bear one version, the newest of CHANGELOG.md."""
    library = (ROOT / "src_f90/base/emcon_version.f90").read_text()
    package = (ROOT / "pyproject.toml").read_text()
    (number,) = re.findall(r'version = "([\d.]+)"', library)
    assert number in re.findall(r'^version = "(.*)"', package, re.M)
    changes = re.findall(r"^## \[(\d\S*)\] - (\S+)", (ROOT / "CHANGELOG.md").read_text(), re.M)
    citation = (ROOT / "CITATION.cff").read_text()
    told = [re.search(rf"^{key}: \"?([^\"\n]*)", citation, re.M)[1]
            for key in ("version", "date-released")]
    assert (number, *told[1:]) == changes[0] and told[0] == number


# ---- the checks themselves, on made-up trees ----------------------------------------------------


GOOD = {
    "base/emcon_kinds.F90": "module emcon_kinds ! the kinds\nend module emcon_kinds\n",
    "base/emcon_text.f90": "!> Source: docs/theory.md, eqs. (1) and (2b); paper eq. (9).\n"
    "!> Source: docs/theory.md, section 4.\n"
    "module emcon_text\n   use emcon_kinds, only : wp\n"
    "   ! stop\n   text = 'stop'; stop_at = 1\nend module emcon_text\n",
    "stepper/emcon_stepper.f90": "module emcon_stepper\n   use :: emcon_text\n"
    "   use, intrinsic :: iso_c_binding\nend module emcon_stepper\n",
    "app/emcon.f90": "program emcon\n   use emcon_stepper\n   print *, 1\n   stop 1\nend program\n",
    "laws/emcon_law_y.f90": "! build: lanes\nmodule emcon_law_y\n   include 'lanes.inc'\n   type, extends(law_t) :: law_y_t\n"
    "   end type\nend module\n",
    "laws/emcon_law_registry.f90": "module emcon_law_registry\nend module\n",
    "laws/emcon_law_kinds.f90": "submodule (emcon_law_registry) emcon_law_kinds\n"
    "   use emcon_law_y\ncontains\n   module procedure f\n   end procedure\nend submodule\n",
    "../pywrap/emcon/model.py": "from .mesh.read import f\nfrom .mesh import g\nfrom . import b\n",
    "../pywrap/emcon/mesh/read.py": "import os\nfrom .. import b\n",
    "../pywrap/emcon/mesh/__init__.py": "from .read import f\n",
    "../pywrap/emcon/b.py": "",
    "laws/lanes.inc": "   !$omp simd\n",
    "order.py": "def f():\n    pass\n\n\nclass A:\n    def f(self):\n        pass\n",
}
BAD = {
    "theory": {"base/emcon_a.f90": "module emcon_a ! eqs. (1) and (3a)\nend module emcon_a\n"},
    "theory, section": {
        "base/emcon_a.f90": "module emcon_a ! docs/theory.md, sections 4 and 4.2.\nend module\n"
    },
    "theory, two lines": {
        "base/emcon_a.f90": "!> Source: docs/theory.md,\n!> eq. (4).\nmodule emcon_a\nend module\n"
    },
    "names": {"base/emcon_sort.f90": "module emcon_order\nend module emcon_order\n"},
    "names, two": {
        "base/emcon_a.f90": "module emcon_a\nend module\nmodule emcon_b\nend module\n"
    },
    "names, submodule": {
        "laws/emcon_law_kinds.f90": "submodule (emcon_law_registry) emcon_kinds_of_laws\nend submodule\n"
    },
    "names, submodule elsewhere": {
        "march/emcon_a.f90": "submodule (emcon_law_registry) emcon_a\nend submodule\n"
    },
    "names, room": {"misc/emcon_a.f90": "module emcon_a\nend module emcon_a\n"},
    "arrows up": {"scene/emcon_a.f90": "module emcon_a\n  use emcon_stepper\nend module emcon_a\n"},
    "arrows up, submodule": {
        "laws/emcon_law_kinds.f90": "submodule (emcon_law_registry) emcon_law_kinds\n"
        "   use emcon_stepper\nend submodule\n",
    },
    "arrows up, include": {
        "scene/emcon_a.f90": 'module emcon_a\n   include "a.inc"\nend module emcon_a\n',
        "scene/a.inc": "   USE emcon_stepper, ONLY : x\n",
    },
    "arrows up, program": {
        "laws/emcon_law.f90": "module emcon_law\nend module emcon_law\n",
        "app/emcon.f90": "program emcon\n   use emcon_law\nend program\n",
    },
    "cycles, submodule": {
        "base/emcon_a.f90": "module emcon_a\n  use emcon_b\nend module emcon_a\n",
        "base/emcon_b.f90": "submodule (emcon_a) emcon_b\nend submodule emcon_b\n",
    },
    "cycles": {
        "base/emcon_a.f90": "module emcon_a\n   use emcon_b\nend module emcon_a\n",
        "base/emcon_b.f90": "module emcon_b\n   use emcon_a\nend module emcon_b\n",
    },
    "python cycles": {"../pywrap/emcon/mesh/read.py": "def f():\n    from ..model import g\n"},
    "python cycles, package": {"../pywrap/emcon/b.py": "if True:\n    from .mesh import g\n",
                               "../pywrap/emcon/mesh/__init__.py": "from .. import b\n"},
    "simd": {"laws/emcon_law_y.f90": "! biuld: lanes\nmodule emcon_law_y\n   include 'lanes.inc'\n"
             "end module\n"},
    "long lines": {"base/emcon_a.f90": f"module emcon_a ! {'a'*100}\nend module emcon_a\n"},
    "kinds": {
        "laws/emcon_law_x.f90": "module emcon_law_x\n   type, extends(law_t) :: law_x_t\n"
        "   end type\nend module\n",
        "march/emcon_a.f90": "module emcon_a\n   use emcon_law_x, only : law_x_t\nend module\n",
    },
    "kinds, in a registry": {
        "laws/emcon_law_registry.f90": "module emcon_law_registry\n   use emcon_law_y\nend module\n",
    },
    "kinds, by a parent": {
        "contact/emcon_b.f90": "module emcon_b\n   type, abstract, extends(contact_t) :: b_t\n"
        "   end type\nend module\n",
        "contact/emcon_c.f90": "module emcon_c\n   use emcon_b\n"
        "   TYPE, EXTENDS(b_t), public :: c_t\n   end type\nend module\n",
        "prepare/emcon_a.f90": "module emcon_a\n   use emcon_c\nend module\n",
    },
    "long procedures": {
        "base/emcon_a.f90": "module emcon_a\ncontains\n   subroutine f\n" + "x = 1\n"*59
        + "   end subroutine f\nend module\n"
    },
    "long procedures, body": {
        "laws/emcon_law_kinds.f90": "submodule (emcon_law_registry) emcon_law_kinds\ncontains\n"
        "   module procedure f\n" + "x = 1\n"*59 + "   end procedure f\nend submodule\n"
    },
    "long procedures, interface": {
        "base/emcon_a.f90": "module emcon_a\ninterface\n   pure module subroutine f(a, b, c, d, &\n"
        "         e, f, g, h)\n   end subroutine f\nend interface\nend module\n"
    },
    "long procedures, arguments": {
        "base/emcon_a.f90": "module emcon_a\ncontains\n   pure subroutine f(a, b, c, d, &\n"
        "         e, f, g, h)\n   end subroutine f\nend module\n"
    },
    "big types": {
        "base/emcon_a.f90": "module emcon_a\n   type, public :: a_t\n" + "      real :: a(2), b = f(1, 2)\n"*10
        + "      type(a_t), pointer :: next => null()\n   end type a_t\nend module\n"
    },
    "theory places": {"solve/emcon_a.f90": "module emcon_a\nend module emcon_a\n"},
    "theory, twice": {"../docs/theory.md": "## 4 X\n$$x \\tag{1}$$\n$$y \\tag{1}$$\n"},
    "stop": {"march/emcon_a.f90": "module emcon_a\n   if (x > 0) error stop 'no'\nend module\n"},
    "stop, exit": {"stepper/emcon_a.f90": "module emcon_a\n   call exit(1)\nend module emcon_a\n"},
    "print": {"deck/emcon_a.f90": "module emcon_a\n   write (*, *) x\nend module emcon_a\n"},
    "hidden": {"order.py": "def f():\n    pass\n\n\ndef f():\n    pass\n"},
    "hidden, method": {"order.py": "class A:\n    def f(self):\n        pass\n    f = 1\n\n"
                       "    def f(self):\n        pass\n"},
    "hidden, import": {"order.py": "from a import f\n\n\ndef f():\n    pass\n"},
}


def build(root, files):
    for name, text in {**GOOD, **files}.items():
        path = root / "src_f90" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    (root / "docs").mkdir(exist_ok=True)
    theory = root / "docs/theory.md"
    if not theory.exists():
        theory.write_text("## 4 X\n$$x = 1 \\tag{1}$$\n$$y = 2, \\tag{2b}$$\n")
    return root


@pytest.mark.parametrize("check", CHECKS)
def test_good_tree_passes(check, tmp_path):
    assert list(CHECKS[check](build(tmp_path, {}))) == []


@pytest.mark.parametrize("fault", BAD)
def test_bad_tree_fails(fault, tmp_path):
    assert list(CHECKS[fault.split(",")[0]](build(tmp_path, BAD[fault])))


COUNTED = """module emcon_a
   private
   public :: f, a_t
   type :: a_t
   contains
      procedure :: g
      procedure, private :: k => k_of
   end type a_t
contains
   subroutine f(x, y, z, n, &
         error)
      real(wp), intent(in) :: x(2, n), y(:)
      real(wp), intent(out) :: z    !! 2*n_node of them
      integer, intent(in) :: &
         n                          !! > 0
      type(error_t), intent(out) :: error(:)
      real(wp) :: work(3)              ! at a corner
      type(chain_t) :: c
      call tell("an edge", n_corner, ledger, search)
      n = c%node_edges(1)
      work(1) = y(2*(n - 1) + 1)**2 + sum(x, 2)
   end subroutine f
   pure integer function g(self, i)
      class(a_t), intent(in) :: self
      integer, intent(in) :: i
   end function g
   subroutine hidden(i)
      integer, intent(in) :: i
   end subroutine hidden
end module emcon_a
"""


def test_what_is_counted(tmp_path):
    build(tmp_path, {"solid/emcon_a.f90": COUNTED, "contact/emcon_a_plane.f90": COUNTED})

    def found(kind, room):
        return [f[2] for f in house_counts.places(tmp_path, kind) if f[0] == room]

    silent = [(12, "f", "x"), (12, "f", "y"), (16, "f", "error"), (25, "g", "i")]
    assert found("silent arguments", "solid") == silent
    assert [number for number, _ in found("planar literals", "solid")] == [12, 21]
    assert found("planar literals", "contact") == []
    assert [number for number, _ in found("planar words", "solid")] == [18, 20]
    assert found("planar words", "contact") == []
    counts = house_counts.counts(tmp_path)
    assert list(house_counts.risen(counts, counts)) == []
    counts["planar literals"]["solid"] -= 1
    assert len(list(house_counts.risen(house_counts.counts(tmp_path), counts))) == 1


def test_flags_asked_in_many_files_are_counted(tmp_path):
    """By the name of the component: not where it is set, nor up to five files."""
    scene = ("module emcon_a\n   type :: a_t\n      logical :: is_on = .true., has(2), &\n"
             "         is_off\n   end type a_t\nend module\n")
    asks = "module emcon_{0}\n   if (a%is_on) b%c = a%is_off\n   a%has(1) = .true.\nend module\n"
    files = {f"march/emcon_{name}.f90": asks.format(name) for name in "bcdefg"}
    files["march/emcon_g.f90"] = files["march/emcon_g.f90"].replace("a%is_off", "a%has(2)")
    build(tmp_path, {"scene/emcon_a.f90": scene, **files})
    assert house_counts.counts(tmp_path)["flags asked"] == {"is_on": 6}


@pytest.mark.parametrize("in_git", [False, True])
def test_stray_file_at_the_top_fails(in_git, tmp_path):
    if in_git:
        subprocess.run(["git", "init", "--quiet", tmp_path], check=True)
        (tmp_path / ".gitignore").write_text("/kept_out\n")
        (tmp_path / "kept_out").write_text("")
    (tmp_path / "notes.md").write_text("")
    assert top_level(build(tmp_path, {})) == ["notes.md"]
