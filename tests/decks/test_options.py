"""The tables of options and laws: documents, decks, headers and Python say what their rows say."""

import pathlib
import re

import pytest
from emcon import _core
from emcon.options import LAWS, OPTIONS, host_choices

ROOT = pathlib.Path(__file__).resolve().parents[2]
DECK = (ROOT / "docs/deck.md").read_text()
HEADER = (ROOT / "src_f90/border/emcon.h").read_text()
#: Options without a default: decks have to say which.
NEEDED = {"procedure", "element"}
#: The cards that choose.
CARD = {
    "formulation": "*CONTACT PAIR",
    "integration": "*MORTAR",
    "multiplier": "*MORTAR",
    "tie multiplier": "*TIE",
    "normal": "*MORTAR",
    "smoothing": "*SURFACE SMOOTHING",
    "initiation": "*CONTACT INITIATION",
    "kinematics": "*SOLID SECTION",
    "method": "*CONSTRAINT METHOD",
    "newton": "*NEWTON",
    "scheme": "*TIME INTEGRATION",
    "surface": "*SURFACE",
    "events": "*EVENTS",
    "solver": "*STATIC",
}


def missing(doc):
    """What the text does not have between backquotes, alone, after NAME= or behind an asterisk."""
    doc = re.sub(r"```.*?```", "", doc, flags=re.S)
    code = set(re.findall(r"`([^`]+)`", doc))
    words = {word.removeprefix("*") for text in code for word in re.split(r"=|, (?=[A-Z])", text)}
    yield from (row.word for rows in OPTIONS.values() for row in rows if row.word not in words)
    squeezed = {text.replace(" ", "") for text in code}
    for law in LAWS.values():
        if f"*{law.keyword}{',' * bool(law.variant)}{law.variant}" not in squeezed:
            yield law.name
        if not (", ".join(law.constants) in doc or "mu1" in law.constants):
            yield ", ".join(law.constants)


def wrong_defaults(doc):
    """Options whose default the table of cards does not tell: as `WORD` (default), or in a column."""
    for option, card in CARD.items():
        word = next(row.word for row in OPTIONS[option] if row.is_default)
        line = next(line for line in doc.splitlines() if line.startswith(f"| `{card}` |"))
        last = line.strip(" |").split("|")[-1]
        if f"{word}` (default)" not in line and f"`{word}`" not in last:
            yield option


def test_the_reference_names_every_row():
    assert list(missing(DECK)) == []


def test_the_reference_tells_every_default():
    assert set(CARD) | NEEDED == set(OPTIONS)
    assert list(wrong_defaults(DECK)) == []


@pytest.mark.parametrize("word", ["SADDLE POINT", "YEOH", "C10, C01, D1", "HERMITE", "CPE3"])
def test_a_row_that_is_not_named_is_found(word):
    assert len(list(missing(DECK.replace(word, "?")))) >= 1


@pytest.mark.parametrize(("option", "right", "wrong"), [
    ("formulation", "SURFACE` (default)", "SURFACE`"),
    ("normal", "`DUAL`, `NODAL`", "`DUAL`, `EDGE`"),
])
def test_a_wrong_default_is_found(option, right, wrong):
    assert list(wrong_defaults(DECK.replace(right, wrong))) == [option]


def test_the_reference_tells_which_models_a_value_is_for():
    """The table of values for some models is the rows that are not for all."""
    table = DECK.split("\n### Values for some models only\n")[1].split("\n#")[0]
    told = re.findall(r"^\| `([^`]+)` \| `([^`]+)` \| ([^|]+) \| `([^`]+)` \|$", table, re.M)
    assert told == [(CARD[option], row.word, ", ".join(row.models), row.instead)
                    for option, rows in OPTIONS.items() for row in rows if row.instead]
    for rows in OPTIONS.values():
        for row in rows:
            assert (row.models == ("plane", "axial", "space")) == (row.instead == "")
            assert row.instead in ("", *(other.word for other in rows if other.is_default))


@pytest.mark.parametrize("option", OPTIONS)
def test_values_of_an_option(option):
    """Each has a word and a code of its own; one is the default, where there is one."""
    rows = OPTIONS[option]
    assert len({row.word for row in rows}) == len({row.code for row in rows}) == len(rows)
    assert sum(row.is_default for row in rows) == (option not in NEEDED)


def test_enumerations_of_the_header():
    """Each name of an option in the header is that of a row, with its code, and the other way."""
    rows = {(row.c_name, row.code) for rows in OPTIONS.values() for row in rows if row.c_name}
    assert all(getattr(_core, name) == code for name, code in rows)
    found = re.findall(r"^enum \{(.*)\};\s+/\* (\w+) \*/$", HEADER, re.M)
    assert {option for _, option in found} == {option for option in OPTIONS
                                               if option != "tie multiplier"
                                               and any(row.c_name for row in OPTIONS[option])}
    for body, option in found:
        pairs = re.findall(r"(\w+) = (\d+)", body)
        assert pairs == [(row.c_name, str(row.code)) for row in OPTIONS[option] if row.c_name]


def test_words_of_hosts():
    assert host_choices("formulation") == {"node to surface": 1, "segment": 2, "mortar": 3,
                                           "node to segment": 1}
    assert "velocity update" not in host_choices("initiation")


def test_names_of_laws():
    """In capitals the name is the parameter that chooses the law."""
    for law in LAWS.values():
        assert law.variant in ("", law.family.upper().replace(" ", ""))
    assert {"elastic", "coupled_neo_hooke", "mooney_rivlin", "ogden"} <= {
        law.argument for law in LAWS.values()}


def test_words_have_no_second_list():
    """Where one of several words is read it is by the table: no reader lists them again."""
    words = [row.word.replace(" ", "") for option in ("multiplier", "smoothing", "initiation")
             for row in OPTIONS[option] if row.word != "NONE"]
    cases = [line for path in (ROOT / "src_f90").glob("*/*.f90")
             for line in path.read_text().splitlines() if "case (" in line]
    assert len(cases) > 200
    assert [line for line in cases for word in words if f'"{word}"' in line] == []
