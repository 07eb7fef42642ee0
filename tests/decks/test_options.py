"""docs/deck.md names every row of the tables of options and laws."""

import pathlib
import re

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
OPTION = re.compile(r'option_row_t\("(\w+)", \w+, "([A-Z ]+)"')
LAW = re.compile(r'law_row_t\("[\w ]+", "(\w+)", "([\w-]*)", \d+, \w+, \[[^"]+([^]]+)\]')


def read(path):
    """A source with continued lines joined."""
    return re.sub(r"&\s*\n\s*", "", (ROOT / path).read_text())


def missing(doc):
    """Words of rows that the text does not have between backquotes, alone or after NAME=."""
    doc = re.sub(r"```.*?```", "", doc, flags=re.S)
    code = set(re.findall(r"`([^`]+)`", doc))
    words = {word for text in code for word in re.split(r"=|, (?=[A-Z])", text)}
    source = read("src_f90/scene/emcon_options.f90")
    rows = OPTION.findall(source)
    assert len(rows) == source.count("option_row_t(")
    yield from (word for _, word in rows if word not in words)
    source = read("src_f90/laws/emcon_law_registry.f90")
    laws = LAW.findall(source)
    assert len(laws) == source.count("law_row_t(")
    for keyword, variant, constants in laws:
        names = [name for name in re.findall(r'"(\w*)"', constants) if name]
        squeezed = {text.replace(" ", "") for text in code}
        if f"*{keyword}{',' * bool(variant)}{variant}" not in squeezed:
            yield f"{keyword} {variant}"
        if not (", ".join(names) in doc or "mu1" in names):
            yield ", ".join(names)


def test_the_reference_names_every_row():
    assert list(missing((ROOT / "docs/deck.md").read_text())) == []


@pytest.mark.parametrize("word", ["SADDLE POINT", "YEOH", "C10, C01, D1", "HERMITE"])
def test_a_row_that_is_not_named_is_found(word):
    doc = (ROOT / "docs/deck.md").read_text()
    assert len(list(missing(doc.replace(word, "?")))) >= 1
