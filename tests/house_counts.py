"""What the house has too much of, counted per room, or per flag: these counts may only fall.

`house_counts.py` prints the counts of today beside those of tests/house_counts.json,
`--list WHAT ROOM` the places, `--update` writes down what has fallen and refuses what has risen.
"""

import argparse
import collections
import json
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
RECORD = ROOT / "tests/house_counts.json"
#: Rooms whose procedures say what their arguments are.
TOLD = "laws schemes solid surfaces touch contact terms system state solve active march".split()

STRING = re.compile(r"\"[^\"\n]*\"|'[^'\n]*'")


def statements(path):
    """(first line, statement without comments, its FORD comments), continued lines joined."""
    code, told, start = "", "", 0
    for number, line in enumerate(path.read_text().splitlines(), 1):
        bare, _, comment = STRING.sub('""', line).partition("!")
        start = start if code else number
        told += comment[1:] if comment[:1] in {"!", ">"} else ""
        code += bare.strip().removeprefix("&")
        if code.endswith("&"):
            code = code[:-1]
        elif code:
            yield start, code, told.strip()
            code, told = "", ""


def sources(root):
    for path in sorted((root / "src_f90").rglob("*")):
        if path.suffix in {".f90", ".F90", ".inc"}:
            yield path.relative_to(root / "src_f90").parts[0], path


# ---- dummy arguments that say nothing -----------------------------------------------------------


HEAD = re.compile(
    r"^(?!end\b)(?:[^'\"=]|\(len=)*?\b(?:subroutine|function)\s+(\w+)\s*(?:\(([^()]*)\))?", re.I
)
DECLARED = re.compile(
    r"^(integer|real|logical|complex|character|procedure|type|class)\b.*?::(.*)", re.I
)
BOUND = re.compile(r"^(?:procedure|generic)\b\s*(?:\((\w+)\))?[^:]*::\s*(.*)", re.I)


def public_names(path):
    """Procedures that other modules can call: listed as public, bound to types, interfaces."""
    names, opened = set(), False
    for _, code, _ in statements(path):
        low = code.lower()
        if match := re.match(r"public\s*::\s*(.*)", low):
            names |= set(re.findall(r"\w+", match[1]))
        if re.match(r"(abstract )?interface\b", low):
            opened = True
        elif low.startswith("end interface"):
            opened = False
        elif opened and (head := HEAD.match(low)):
            names.add(head[1])
        elif not opened and (match := BOUND.match(low)):
            names |= {item.split("=>")[-1].strip() for item in match[2].split(",")}
            names |= {match[1]} - {None}
    return names


def without_brackets(text):
    while "(" in text and (shorter := re.sub(r"\([^()]*\)", "", text)) != text:
        text = shorter
    return text


def silent_arguments(path):
    """(line, procedure, argument) of public procedures whose declaration has no `!!` or `!>`.

    A single object of a derived type says with its type what it is, and counts as told.
    """
    names, inside = public_names(path), []
    for number, code, told in statements(path):
        low = code.lower()
        if re.match(r"end\s*(subroutine|function|procedure)\b", low):
            inside = inside[:-1]
        elif head := HEAD.match(low):
            inside.append((head[1], set(re.findall(r"\w+", head[2] or ""))))
        elif inside and inside[-1][0] in names and (match := DECLARED.match(low)):
            if told:
                continue
            arrays = set(re.findall(r"(\w+)\(", match[2]))
            for name in re.findall(r"\w+", without_brackets(match[2])):
                is_single = match[1] in {"type", "class"} and name not in arrays
                if name in inside[-1][1] and not is_single:
                    yield number, inside[-1][0], name


# ---- literals of the plane ----------------------------------------------------------------------


# A 2 here counts or names what it says itself: a dimension of an array, a pass, a power,
# a constant of a law, a figure of a record.
OTHER = re.compile(
    r"\b(?:size|sum|spread|minval|maxval|any|all|count|merge|min|max|lbound|ubound|norm2)"
    r"\((?:[^()]|\((?:[^()]|\([^()]*\))*\))*\)|\bdo pass = .*|\*\*\s*2\b"
    r"|\b(?:constant|figure|effort)\(\d+\)",
    re.I,
)
PLANAR = re.compile(
    r"\w\((?::|1:)?2(?=\s*[,)])"  # x(2), x(:2), x(2, n)
    r"|\w\([\w:],\s*(?::|1:)?2\)"  # f(1, 2), f(:, 2)
    r"|\[2,"  # [2, n]
    r"|(?<![\w.*])2\s*\*\s*\(?\s*\w+(?:%\w+)*(?:\([^()]*\))?\s*-\s*1\b"  # 2*(i - 1), 2*i - 1
    r"|(?<![\w.*])2\s*\*\s*(?:\w+%)*n_node\b"  # 2*n_node
    r"|\+\s*1\)\s*/\s*2(?![\w.])|\bmod\([^()]*,\s*2\)"  # (dof + 1)/2, 2 - mod(dof, 2)
    r"|\bdo\s+[a-e]\s*=\s*1,\s*2$|\bn_dim\s*=\s*2\b",
    re.I,
)


def planar_literals(path):
    """(line, statement) of lines where a 2 is an extent or a component of the plane."""
    if path.stem.endswith(("_plane", "_space")):
        return
    for number, line in enumerate(path.read_text().splitlines(), 1):
        code = STRING.sub('""', line).partition("!")[0].strip()
        if PLANAR.search(OTHER.sub("n", code)):
            yield number, code


# ---- words of the plane -------------------------------------------------------------------------

#: Rooms that know surfaces. In those above, a chain is the rule of derivatives.
SURFACED = ("scene deck space solid surfaces touch contact terms system prepare state solve "
            "active march results stepper record border app").split()  # fmt: skip
WORD = re.compile(r"\b(?:[a-z]\w*_)?(?:chain|corner|edge|arc|outline)s?(?:_\w+)?\b", re.I)
# Corners of elements and of facets are there in space, too; those of an amplitude are instants.
ELSEWHERE = re.compile(
    r"\b(?:n_corner|amplitude_corners|\w*grid_corner_t|march_next_corner|step%time%corner"
    r"|(?:self|facets|split)%corner|allocatable :: corner)\b", re.I
)


def planar_words(path):
    """(line, statement) of lines that name a chain, a corner, an edge, an arc or an outline."""
    if path.stem.endswith(("_plane", "_space")):
        return
    for number, line in enumerate(path.read_text().splitlines(), 1):
        code = STRING.sub('""', line).partition("!")[0].strip()
        if WORD.search(ELSEWHERE.sub("n", code)):
            yield number, code


# ---- flags that are asked in many files ---------------------------------------------------------

#: Rooms whose logical components are data of a scene, a scheme or a state.
FLAGGED = {"scene", "schemes", "state"}
MOST_ASKING = 5
#: What a statement sets: it is not asked.
SET = re.compile(r"^(?:\w|%|\([^()]*\))*%\w+(?:\([^()]*\))?(?=\s*=[^=>])")


def components(path):
    """Names of the logical components of the types of a file."""
    inside = False
    for _, code, _ in statements(path):
        low = code.lower()
        if re.match(r"type\b(?!\s*\(|\s+is\b)", low):
            inside = True
        elif re.match(r"end\s*type\b|contains\b", low):
            inside = False
        elif inside and (match := re.match(r"logical\b.*?::(.*)", low)):
            yield from re.findall(r"(\w+)(?:\([^()]*\))?\s*(?:=[^,]*)?(?:,|$)", match[1])


def flags_asked(root):
    """(flag, file, (line, statement)) of flags of `FLAGGED` that more than `MOST_ASKING` files name.

    A flag is known by its name: where types of two rooms have one of a name, files of both count.
    """
    flags = {name for room, path in sources(root) if room in FLAGGED for name in components(path)}
    asked = collections.defaultdict(dict)
    for _, path in sources(root):
        for number, code, _ in statements(path):
            read = SET.sub("", code.lower())
            for name in re.findall(r"%\s*(\w+)", read):
                if name in flags:
                    asked[name].setdefault(path, (number, code))
    for name, found in sorted(asked.items()):
        if len(found) > MOST_ASKING:
            for path, finding in found.items():
                yield name, path.relative_to(root), finding


# ---- counts against the record ------------------------------------------------------------------


KINDS = {
    "silent arguments": (silent_arguments, TOLD),
    "planar literals": (planar_literals, None),
    "planar words": (planar_words, SURFACED),
    "flags asked": (flags_asked, None),
}


def places(root, kind):
    """(room, file, finding) of one kind; of flags their name is in place of the room."""
    find, rooms = KINDS[kind]
    if find is flags_asked:
        yield from flags_asked(root)
        return
    for room, path in sources(root):
        if rooms is None or room in rooms:
            for finding in find(path):
                yield room, path.relative_to(root), finding


def counts(root):
    """{kind: {room: count}}, rooms without any left out."""
    return {
        kind: dict(sorted(collections.Counter(room for room, _, _ in places(root, kind)).items()))
        for kind in KINDS
    }


def risen(found, record):
    """Counts above the record, as lines; a room, or a flag, that it does not know may have none.

    A kind that it does not know is a new one, whose counts `--update` writes down.
    """
    for kind, rooms in found.items():
        for room, count in rooms.items():
            if kind in record and count > (most := record[kind].get(room, 0)):
                yield f"{kind} in {room}: {count}, not more than {most}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--list", nargs=2, metavar=("WHAT", "ROOM"), help="print the places")
    parser.add_argument("--update", action="store_true", help="write down what has fallen")
    options = parser.parse_args()
    if options.list:
        for room, path, finding in places(ROOT, options.list[0]):
            if room == options.list[1]:
                print(f"{path}:{': '.join(map(str, finding))}")
        return
    found, record = counts(ROOT), json.loads(RECORD.read_text())
    for kind, rooms in found.items():
        for room in sorted({*rooms, *record.get(kind, {})}):
            most = record.get(kind, {}).get(room, "none")
            print(f"{kind:18} {room:10} {rooms.get(room, 0):5} of {most}")
    if faults := list(risen(found, record)):
        sys.exit("\n".join(faults))
    if options.update:
        RECORD.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
