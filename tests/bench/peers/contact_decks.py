"""CalculiX' decks of contact and ties: where results differ, why, and what is edited to show it.

A remark is a sentence and edits: pairs of what CalculiX and what EMCON reads in place of the deck's
text; the differences that are left with them stand behind the sentence.
"""

import functools
import re

from peers.refined import refined

PAIR = re.compile(r"(?im)^\*(?:CONTACT PAIR|TIE\s*,)")


def is_one(text):
    """Has the deck contact or ties?"""
    return bool(PAIR.search(text))


def asked(text):
    """The deck, with a request for displacements if it has none."""
    if re.search(r"(?im)^\*NODE (PRINT|FILE)", text):
        return text
    return re.sub(r"(?im)^\*END STEP", "*NODE FILE\nU\n*END STEP", text)


def static(text):
    """Without steps of frequencies; None where no other step is left."""
    head, *steps = re.split(r"(?im)^(?=\*STEP)", text)
    kept = [step for step in steps if not re.search(r"(?im)^\*FREQUENCY", step)]
    return head + "".join(kept) if kept else None


def spun(node, square="1.E6"):
    """One static step in place of all: the sector spins about the axis x, `node` is held."""
    def edit(text):
        head = re.split(r"(?im)^(?=\*STEP)", text)[0]
        head = re.sub(r"(?im)^\*(?:INITIAL CONDITIONS|COUPLING|DISTRIBUTING|DESIGN ?VARIABLES|EXPANSION).*\n(?:[^*].*\n)*", "", head)
        return (f"{head}*STEP\n*STATIC\n*BOUNDARY\n{node},1,3\n*DLOAD\nEall,CENTRIF,{square},0.,0.,0.,1.,0.,0.\n"
                "*NODE PRINT,NSET=Nall\nU\n*END STEP\n")
    return edit


def tie_instead(text):
    """The surfaces in contact are tied."""
    return re.sub(r"(?im)^\*CONTACT PAIR.*", "*TIE, NAME=INSTEAD", text)


def put(old, new):
    """An edit that puts `new` in place of `old`, capitals or not."""
    def edit(text):
        found, count = re.subn(f"(?i){old}", new, text)
        assert count, old
        return found
    return edit


def shrunk(text):
    """Overlaps at the start go out in the first step."""
    return re.sub(r"(?im)^(\*STATIC.*\n(?:[^*].*\n)?)",
                  r"\1*CONTACT INTERFERENCE, SHRINK\nSSLAV,SMAST\n", text, count=1)


def chain(*edits):
    return lambda text: functools.reduce(lambda now, edit: edit(now), edits, text)


def split(counts, mine=None, theirs=None):
    """Edits with each element split into n x n x n by both."""
    def edit(n, own):
        return chain(own or str, lambda text: refined(text, n))
    return [(edit(n, theirs), edit(n, mine)) for n in counts]


AREA = ("the slave is one node of a corner: CalculiX gives it a quarter of each of its three faces as area, EMCON a "
        "quarter of the face that faces the master; with three times the pressure")
POINTS = ("CalculiX integrates over faces of the slave, against the curved faces of the master; EMCON uses contact "
          "points, against faces made of triangles")
MEANS = ("CalculiX has a pressure at each integration point of the slave's faces; EMCON, by mortar, one for the mean gap "
         "at each node")
SPLIT = "both with each element split into n x n x n"
RIM = ("mean gaps of EMCON's mortar over faces that rise from the edge of the flat part of the punch are -8e-4 at the "
       "start, 1.3 times the largest displacement; with TYPE=NODE TO SURFACE")
SHRINK = "an overlap at the start, which CalculiX removes gradually over the step; with *CONTACT INTERFERENCE, SHRINK"
STEPS = "without the steps of *FREQUENCY"
SPUN = "its steps replaced by a static one with centrifugal forces"
DIGITS = "; in the deck the two sides of the cut differ by 5e-6"
UNLIKE = "; the meshes at the cut do not match: CalculiX ties nodes, EMCON means over faces"
TIED = "with *TIE in place of the contact"
ONE_SIDE = f"the meshes do not match: {MEANS}"

#: Deck: sentence, edits. Of decks that do not run unchanged the first edit is what lets them run.
REMARKS = {
    "contact1": (AREA, [(None, put("1.5351e-7,6.66666", "1.5351e-7,19.99998"))]),
    "contact3": (f"{SHRINK}; and {AREA}", [(None, shrunk), (None, chain(
        shrunk, put(r"1\.e7,3\.", "3.e7,9.")))]),
    "contact6": (f"{SHRINK}; and {AREA}", [(None, shrunk), (None, chain(
        shrunk, put(r"1\.e9,3\.", "3.e9,9.")))]),
    "contact4": (f"HARD of CalculiX has a stiffness of 50 E, pressure over overclosure, here 1E9; {MEANS}; {SPLIT}, n = 1, 2, 3, 4",
                 split((1, 2, 3, 4), theirs=put("=HARD", "=LINEAR\n1.E9,1."))),
    "contact4_mortar": ("both with each element split into n x n x n, n = 1, 2, 3", split((1, 2, 3))),
    "cubesmortar": ("both with each element split into n x n x n, n = 1, 2, 3", split((1, 2, 3))),
    "cubesmortar2": ("both with each element split into n x n x n, n = 1, 2, 3", split((1, 2, 3))),
    "cubespring": (f"{POINTS}; {SPLIT}, n = 2, 3, 4", split((2, 3, 4))),
    "punch1": (RIM, [(None, put("TYPE=SURFACE TO SURFACE", "TYPE=NODE TO SURFACE"))]),
    "punch2": ("as `punch1`", []),
    "beamcontact": (f"{MEANS}; {SPLIT}, n = 2", split((2,))),
    **{name: (ONE_SIDE, []) for name in ("hueeber1", "hueeber2", "hueeber3", "hueeber4")},
    "cubef2f1": ("CalculiX ties by a penalty, EMCON by constraints", []),
    "cubef2f2": ("CalculiX ties by a penalty, EMCON by constraints", []),
    "cubef2f3": ("CalculiX ties nodes to faces here; its own result differs by 2.5e-02 from that of its tied faces, `cubef2f1`", []),
    **{name: (STEPS, [(static, static)]) for name in ("beamptied3", "beamptied4", "beamptied7", "ringfcontact5")},
    "ringfcontact2": (f"{MEANS}; {STEPS}", [(static, chain(static, put("(INTERACTION=SI1)", r"\1,ADJUST=1.E-6")))]),
    **{name: (SPUN + DIGITS, [(spun(20), spun(20))]) for name in (
        "segment", "segmentnum", "segmentface", "segmentlintemp", "segmenttemp", "segdyn", "segststate", "coupling13",
        "coupling14")},
    **{name: (SPUN + UNLIKE, [(spun(20), spun(20))]) for name in ("segmenttet", "segmenttetsms", "fullseg")},
    "scheibe2f2f": (f"{MEANS}; {TIED}", [(tie_instead, tie_instead)]),
    "scheibe2n2f": (f"{POINTS}; {TIED}", [(tie_instead, tie_instead)]),
}
