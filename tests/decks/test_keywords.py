"""The list of keywords: what `emcon keywords` prints, and the tables of docs/deck.md made from it."""

import re
import sys

from scene_tools import ROOT, emcon

sys.path.insert(0, str(ROOT/"tests"/"bench"))

import keywords  # noqa: E402

TEXT = keywords.PAGE.read_text()


def test_documents_have_the_tables_of_the_program():
    """Else: `python tests/bench/keywords.py --update`."""
    assert keywords.page(TEXT) == TEXT


def test_every_keyword_is_described():
    """In the text of the reference, not in the list alone."""
    text = re.sub(r"<!-- \w+ -->\n.*?<!-- end -->", "", TEXT, flags=re.DOTALL)
    names = re.findall(r"^(\*[A-Z ]+): ", emcon("keywords").stdout, re.MULTILINE)
    assert len(names) > 60
    # Ends of what *PART, *ASSEMBLY and *INSTANCE begin are known from Abaqus.
    assert [name for name in names if f"`{name}" not in text and not name.startswith("*END ")] == []


def test_a_name_narrows_the_list():
    told = emcon("keywords", "*contact pa").stdout
    assert told.startswith("*CONTACT PAIR: before the first step\n   takes: INTERACTION=, TYPE=")
    assert "   without effect, with a warning: SMALLSLIDING, " in told
    assert "   neutral values: MECHANICALCONSTRAINT=KINEMATIC, OP=NEW\n" in told
    assert "   refused: NOSEPARATION\n" in emcon("keywords", "SURFACE BEHAVIOR").stdout
    assert emcon("keywords", "gap").stdout == ("changes nothing: *GAP CONDUCTANCE, *GAP HEAT GENERATION: there is no "
                                               "temperature\nnot supported: *GAP: use *CONTACT PAIR with a *SURFACE, "
                                               "TYPE=NODE as slave, as far from its master as the gap is wide\n")
    assert "left out with --lenient: *ELEMENT FILE: use *EL FILE" in emcon("keywords", "ELEMENT F").stdout


def test_a_name_of_no_keyword_is_told():
    done = emcon("keywords", "CONTRACT")
    assert (done.returncode, done.stdout, done.stderr) == (2, "", "emcon: no keyword begins with CONTRACT\n")
