"""Good and bad decks: `emcon check DECK` tells exactly what the head of the deck expects.

Head lines of a deck: `** EXPECT: LINE TEXT` is one message, at that line (0: none), that holds TEXT;
`** ARGS: ...` are further arguments. A message without EXPECT fails too: consequences of an error
are not to be told. The program is the environment variable EMCON, or build/release/emcon.
"""

import os
import pathlib
import random
import re
import subprocess

import pytest

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
EMCON = os.environ.get("EMCON", str(ROOT / "build" / "release" / "emcon"))
GOOD = (HERE / "good_plain.inp").read_text()
DECKS = sorted(HERE.glob("*.inp"))


def check(path, *args, cwd=HERE):
    """Exit code and messages of one check; a message is (line or 0, text)."""
    run = subprocess.run([EMCON, "check", str(path), *args], cwd=cwd, capture_output=True, timeout=60)
    messages = []
    for text in run.stderr.decode("utf-8", "replace").splitlines():
        found = re.match(re.escape(str(path)) + r":(?:(\d+):)? ((?:error|warning): .*)", text)
        if found:
            messages.append((int(found[1] or 0), found[2]))
        elif re.match(r"(error|warning): |and \d+ more ", text):
            messages.append((0, text))
        elif "error: " in text or "warning: " in text:
            messages.append((-1, text))
    return run.returncode, messages, run.stderr.decode("utf-8", "replace")


def expectations(text):
    return [(int(line), part) for line, part in re.findall(r"^\*\* EXPECT: (\d+) (.+)$", text, re.M)]


@pytest.mark.parametrize("deck", DECKS, ids=lambda deck: deck.stem)
def test_deck(deck):
    text = deck.read_text()
    args = re.search(r"^\*\* ARGS: (.+)$", text, re.M)
    code, messages, shown = check(deck.name, *(args[1].split() if args else []))
    expected = expectations(text)
    assert code == (2 if deck.stem.startswith("bad_") else 0), shown
    left = list(messages)
    for line, part in expected:
        hit = next((m for m in left if m[0] == line and part in m[1]), None)
        assert hit, f"expected at line {line}: {part}\ngot:\n{shown}"
        left.remove(hit)
    assert not left, f"not expected: {left}"
    lines = [m[0] for m in messages]
    assert lines == sorted(lines)


def test_every_bad_deck_expects_something():
    for deck in DECKS:
        if deck.stem.startswith("bad_"):
            assert expectations(deck.read_text()), deck.name


def test_missing_file(tmp_path):
    code, messages, _ = check("no_such_deck.inp", cwd=tmp_path)
    assert (code, messages) == (2, [(0, "error: no such file")])


@pytest.mark.parametrize("n", range(55, 60))
def test_long_words_are_cut_between_characters(n, tmp_path):
    """Messages are UTF-8 wherever the word is cut."""
    (tmp_path/"deck.inp").write_text("*" + "A"*n + "é"*40 + "\n", encoding="utf-8")
    done = subprocess.run([EMCON, "check", "deck.inp"], cwd=tmp_path, capture_output=True, timeout=60)
    assert re.search(r"unknown keyword '\*A+é*\.{3,4}'", done.stderr.decode("utf-8"))


def test_name_without_its_end(tmp_path):
    """As other programs have it."""
    (tmp_path/"ball.inp").write_text("*HEADING\n")
    code, messages, _ = check("ball", cwd=tmp_path)
    assert (code, messages) == (2, [(0, "error: no such file; did you mean ball.inp?")])


def test_directory(tmp_path):
    (tmp_path / "folder").mkdir()
    code, messages, _ = check("folder", cwd=tmp_path)
    assert (code, messages) == (2, [(0, "error: is a directory, not a deck")])


@pytest.mark.skipif(hasattr(os, "geteuid") and os.geteuid() == 0, reason="root may read all files")
def test_unreadable(tmp_path):
    (tmp_path / "a.inp").write_text(GOOD)
    (tmp_path / "a.inp").chmod(0)
    code, messages, _ = check("a.inp", cwd=tmp_path)
    assert code == 2 and "cannot be read" in messages[0][1]


@pytest.mark.parametrize("n", [1, 120])
def test_all_exterior_in_space(n, tmp_path):
    """One surface of all bodies, however many."""
    corner = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    node = [f"{8*b + k + 1}, {x + 2*b}, {y}, {z}" for b in range(n) for k, (x, y, z) in enumerate(corner)]
    element = [", ".join(map(str, [b + 1, *range(8*b + 1, 8*b + 9)])) for b in range(n)]
    (tmp_path/"a.inp").write_text("\n".join([
        "*NODE, NSET=ALL", *node, "*ELEMENT, TYPE=C3D8, ELSET=E", *element, "*MATERIAL, NAME=M",
        "*ELASTIC", "100., 0.3", "*SOLID SECTION, ELSET=E, MATERIAL=M", "*CONTACT",
        "*CONTACT INCLUSIONS, ALL EXTERIOR", "*BOUNDARY", "ALL, 1, 3", "*STEP", "*STATIC", "1., 1.",
        "*NODE FILE", "U", "*END STEP", ""]))
    code, messages, shown = check("a.inp", cwd=tmp_path)
    assert code == 0 and not messages, shown


@pytest.mark.parametrize("text", ["", "\n\n", "** only a remark\n", " \t\r\n"])
def test_empty(tmp_path, text):
    (tmp_path / "a.inp").write_text(text)
    code, messages, shown = check("a.inp", cwd=tmp_path)
    assert code == 2 and len(messages) == 1 and "empty" in messages[0][1], shown


def test_binary(tmp_path):
    (tmp_path / "a.inp").write_bytes(bytes(range(256))*20)
    code, messages, shown = check("a.inp", cwd=tmp_path)
    assert code == 2 and len(messages) == 1 and "not a text file" in messages[0][1], shown


@pytest.mark.parametrize("end", ["\r\n", "\r", "\n"], ids=["dos", "mac", "unix"])
def test_line_ends(tmp_path, end):
    (tmp_path / "a.inp").write_bytes(GOOD.replace("\n", end).encode())
    assert check("a.inp", cwd=tmp_path)[:2] == (0, [])


def test_byte_order_mark_and_missing_last_line_end(tmp_path):
    (tmp_path / "a.inp").write_bytes(b"\xef\xbb\xbf" + GOOD.rstrip("\n").encode())
    assert check("a.inp", cwd=tmp_path)[:2] == (0, [])


def test_utf8_in_remarks_and_heading(tmp_path):
    (tmp_path / "a.inp").write_text(GOOD.replace("*HEADING", "** größer\n*HEADING\nπ", 1))
    assert check("a.inp", cwd=tmp_path)[:2] == (0, [])


def test_at_most_50_errors_are_shown(tmp_path):
    bad = "\n".join(f"{i}, x" for i in range(100, 1100))
    (tmp_path / "a.inp").write_text(GOOD.replace("*ELEMENT, TYPE=CPE4, ELSET=FOUNDATION", bad
                                                 + "\n*ELEMENT, TYPE=CPE4, ELSET=FOUNDATION"))
    code, messages, _ = check("a.inp", cwd=tmp_path)
    errors = [m for m in messages if m[1].startswith("error")]
    assert code == 2 and len(errors) == 50 and (0, "and 950 more errors") in messages


def test_long_lists_of_labels_are_cut(tmp_path):
    nodes = "".join(f"{i}, 9., {i}.\n" for i in range(100, 130))
    (tmp_path / "a.inp").write_text(GOOD.replace("*ELEMENT, TYPE=CPE4, ELSET=FOUNDATION", nodes
                                                 + "*ELEMENT, TYPE=CPE4, ELSET=FOUNDATION"))
    code, messages, _ = check("a.inp", cwd=tmp_path)
    assert code == 0 and "107, 108, 109 and 20 more belongs" in messages[0][1]


def test_include_is_relative_to_the_including_file(tmp_path):
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "a" / "deck.inp").write_text(GOOD.replace("*BOUNDARY", '*include, input="b/first.inc"\n*BOUNDARY'))
    (tmp_path / "a" / "b" / "first.inc").write_text("*INCLUDE, INPUT=second.inc")
    (tmp_path / "a" / "b" / "second.inc").write_text("*NSET, NSET=MORE\n99\n")
    code, _, shown = check("a/deck.inp", cwd=tmp_path)
    assert code == 2
    assert "a/b/second.inc:2: error: *NSET: node 99 does not exist" in shown


def test_includes_nested_too_deep(tmp_path):
    for i in range(30):
        (tmp_path / f"{i}.inp").write_text(f"*INCLUDE, INPUT={i + 1}.inp\n")
    code, messages, shown = check("0.inp", cwd=tmp_path)
    assert code == 2 and "files are nested more than 20 deep" in shown


def test_includes_in_powers_of_two_end(tmp_path):
    for i in range(19):
        (tmp_path / f"{i}.inp").write_text(f"*INCLUDE, INPUT={i + 1}.inp\n"*2)
    (tmp_path / "19.inp").write_text("** end\n")
    code, _, shown = check("0.inp", cwd=tmp_path)
    assert code == 2 and "more than 10000 files are included" in shown


def test_overrides_win_and_must_be_well_formed(tmp_path):
    (tmp_path / "a.inp").write_text(GOOD.replace("*NODE, NSET=ALL", "*PARAMETER\nh = 0.1\n*NODE, NSET=ALL")
                                    .replace("0.1, 1.\n", "<h>, 1.\n"))
    assert check("a.inp", cwd=tmp_path)[0] == 0
    assert check("a.inp", "--set", "h=2", cwd=tmp_path)[0] == 2
    assert check("a.inp", "--set", "h=1/3", cwd=tmp_path)[0] == 0
    code, _, shown = check("a.inp", "--set", "h", cwd=tmp_path)
    assert code == 2 and "NAME=VALUE" in shown.upper()


def mutated(text, pick):
    """One small accident: a byte, a line, or a field."""
    lines = text.split("\n")
    kind = pick.randrange(6)
    i = pick.randrange(len(lines))
    if kind == 0:
        k = pick.randrange(len(text))
        return text[:k] + chr(pick.choice([9, 32, 42, 44, 45, 46, 48, 57, 60, 62, 61, 34, 69, 110])) + text[k + 1:]
    if kind == 1:
        del lines[i]
    elif kind == 2:
        lines.insert(i, pick.choice(lines))
    elif kind == 3:
        lines[i] = lines[i][:pick.randrange(len(lines[i]) + 1)]
    elif kind == 4:
        fields = lines[i].split(",")
        fields[pick.randrange(len(fields))] = pick.choice(
            ["", "0", "-1", "1e308", "-1e-308", "nan", "2147483647", "99999999999", "ALL", "S9", "<x>", "*", "**", "1.5"])
        lines[i] = ",".join(fields)
    else:
        k = pick.randrange(len(text))
        return text[:k]
    return "\n".join(lines)


def test_accidents_end_in_messages(tmp_path):
    """Random damage to good decks never ends in anything but success or messages."""
    pick = random.Random(int(os.environ.get("EMCON_SEED", "1")))
    good = [deck.read_text() for deck in DECKS if deck.stem.startswith("good_")]
    for i in range(int(os.environ.get("EMCON_ACCIDENTS", "150"))):
        text = pick.choice(good)
        for _ in range(pick.randrange(1, 4)):
            text = mutated(text, pick) or "\n"
        (tmp_path / "a.inp").write_text(text)
        code, messages, shown = check("a.inp", cwd=tmp_path)
        is_told = any("error: " in m[1] for m in messages)
        if code != (2 if is_told else 0) or "Fortran runtime" in shown or "Backtrace" in shown:
            (ROOT / "build").mkdir(exist_ok=True)
            (ROOT / "build" / "accident.inp").write_text(text)
            pytest.fail(f"accident {i}, exit code {code} (deck in build/accident.inp):\n{shown}")
