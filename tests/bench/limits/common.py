"""What a row of the table of extremes is, and what one of its runs comes to.

A run *holds* where it ends well and a figure that is computed outside of the program is within its
bar; it is *reported* where the program refuses, stops or calls its own result bad, or warns of what is
wrong. What is neither is silent: a result that is wrong, and nothing says so.
"""

import dataclasses
import hashlib
import json
import re
import shutil

import numpy as np
from scene_tools import Deck, Run, emcon, overrides

from .conditions import conditions
from .seen import energy_seen, overlap_seen

HOLDS, TOLD, SILENT = "holds", "reported", "silent"
#: Of the largest energy or momentum: what the scheme promises.
EXACT = 1e-10


@dataclasses.dataclass(frozen=True)
class Row:
    """A row of the table.

    values          what is tried, from the mildest on
    deck(value)     the `Deck`; `parameters` are those of its runs
    judge(run, value)   the figure
    warns           a pattern of what the log says where the figure is above the bar
    reach           the run holds for the values up to this many: tested
    short           places of the values that the tests try
    has_matrices    a stepper evaluates its contact: not that with friction
    """

    name: str
    what: str
    values: tuple
    deck: object
    judge: object
    figure: str
    bar: float = EXACT
    parameters: dict = dataclasses.field(default_factory=dict)
    warns: str = ""
    reach: int = 0
    short: tuple = (0, -1)
    timeout: float = 1800.0
    why: str = ""
    has_matrices: bool = True

    def tested(self):
        return sorted({k % len(self.values) for k in self.short})


@dataclasses.dataclass(frozen=True)
class Outcome:
    """Of one run: how it ended, its figure (nan: there is none), what the program said, and the
    largest residual that a solve was left with.

    ill     condition numbers of an increment in contact, if asked for: of (6), of (6) with scaled
            multipliers, of (7)
    """

    kind: str
    figure: float
    text: str
    residual: float = float("nan")
    ill: tuple | None = None


def shorter(text):
    """The first message, without the name of the program and of the file."""
    for line in text.splitlines():
        found = re.search(r"(?:error|BAD|warning): (.*)", line)
        if found:
            return found[1][:160]
    return text.strip().splitlines()[0][:160] if text.strip() else ""


#: A line of the log lists so many residuals of a solve, the first ones.
LISTED = 15
#: Tolerance of Newton's method.
TOLERANCE = 1e-10


def attained(run, verdict):
    """What the relative residuals that solves of increments have ended with are at most.

    Of a solve with more than the log lists the verdict tells what was above the tolerance.
    """
    made = re.compile(r"^ *\d+(?: +\S+){8}((?: +\d\.\dE[-+]\d+)+)$")
    with open(run.file(".log")) as file:
        lists = [found[1].split() for found in map(made.match, file) if found]
    beyond = max(TOLERANCE, verdict.get("unconverged", 0.0))
    return max((beyond if len(listed) == LISTED else float(listed[-1]) for listed in lists),
               default=float("nan"))


def run_case(row, value, folder, with_conditions=False):
    """Run a value of a row; an earlier outcome of the same deck and program is taken as it is.

    Rows that share a deck each have their own folder: they may run at the same time."""
    deck = row.deck(value)
    said = json.dumps([row.name, deck.text(), str(row.parameters)])
    key = hashlib.sha256(said.encode()).hexdigest()[:16]
    kept = folder / f"{key}.json"
    if kept.exists():
        return Outcome(**json.loads(kept.read_text()))
    place = folder / key
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    done = emcon(deck.write(place / "deck.inp"), "--quiet", "--output", place,
                 *overrides(row.parameters), timeout=row.timeout)
    run = Run(place / "deck", done.stderr)
    figure, text = float("nan"), done.stderr
    if done.returncode == 0:
        figure = float(row.judge(run, value))
    verdict = json.loads(run.file(".json").read_text()) if run.file(".json").exists() else {}
    if done.returncode == 0 and figure <= row.bar:
        kind, text = HOLDS, ""
    elif done.returncode != 0 or verdict.get("verdict") == "bad":
        kind, text = TOLD, shorter(text) or "; ".join(verdict.get("reasons", []))
    elif row.warns and re.search(row.warns, run.log):
        kind, text = TOLD, re.search(row.warns, run.log)[0]
    else:
        kind, text = SILENT, ""
    residual = attained(run, verdict) if run.file(".log").exists() else float("nan")
    ill = None
    if with_conditions and row.has_matrices and done.returncode == 0:
        ill = conditions(place / "deck.inp", row.parameters)
    outcome = Outcome(kind, figure, text, residual, ill)
    shutil.rmtree(place)
    kept.write_text(json.dumps(dataclasses.asdict(outcome)))
    return outcome


# ---- figures ------------------------------------------------------------------------------------


def thinned(run, rows=10000):
    """The history, of a long run about so many rows."""
    with open(run.file(".csv")) as file:
        n = sum(1 for _ in file)
    every = max(1, n//rows)
    with open(run.file(".csv")) as file:
        lines = [line for k, line in enumerate(file) if k == 0 or (k - 1) % every == 0 or k == n - 1]
    return np.genfromtxt(lines, delimiter=",", names=True)


def energy_error(run, _=None):
    """Change of the total, less the work of contact, by the largest energy that was there."""
    history = thinned(run)
    kept = history["total"] - history["contact_work"]
    largest = (np.abs(history["kinetic"]) + np.abs(history["strain"])).max()
    return np.abs(kept - kept[0]).max()/largest


#: Lengths are some hundred edges at most: what positions are rounded to, by an edge.
PLACES = 1e-13


def with_penetration(run, _=None):
    """The same, by the ledger and by places and velocities, or the deepest overlap by the edge,
    that the judge saw or that is seen from outside, where that is more."""
    return max(energy_error(run), energy_seen(run), run.verdict["penetration"],
               max(0.0, overlap_seen(run) - PLACES))


#: In space smooth surfaces stand a part of a face off each other's triangles: by the face, what the
#: verdict lets pass.
FACETS = 0.02


def with_facets(run, _=None):
    """The same in space, the overlap less what is of facets."""
    deep = max(run.verdict["penetration"], overlap_seen(run))
    return max(energy_error(run), energy_seen(run), deep - FACETS)


def momentum_error(run, _=None):
    """Energy, overlap, and the momenta of free bodies by the largest momentum."""
    history = run.history
    names = [name for name in ("px", "py", "pz") if name in history.dtype.names]
    momentum = np.array([history[name] for name in names])
    size = np.linalg.norm(momentum, axis=0).max()
    drift = np.abs(momentum - momentum[:, :1]).max()
    seen = with_penetration if len(names) == 2 else with_facets
    return max(seen(run), drift/size if size else 0.0)


def with_velocities(deck):
    """`deck`, a function of the value, with velocities in the frames: what `energy_seen` looks at."""
    def made(value):
        found = deck(value)
        for k, (head, lines) in enumerate(found.card):
            if head.startswith("*NODE FILE") and lines == ["U"]:
                found.card[k] = (head, ["U, V"])
        return found
    return made


def one_element(size=1.0, at=(0.0, 0.0), material="*ELASTIC\n100., 0.3\n*DENSITY\n1.", cards="",
                step="", nlgeom=True):
    """The deck of one square element; `step` is what stands between *STEP and *END STEP."""
    x, y = at
    places = [(x, y), (x + size, y), (x + size, y + size), (x, y + size)]
    nodes = "\n".join(f"{k}, {px!r}, {py!r}" for k, (px, py) in enumerate(places, 1))
    return Deck(f"*HEADING\none element\n*NODE, NSET=ALL\n{nodes}\n"
                "*ELEMENT, TYPE=CPE4, ELSET=ONE\n1, 1, 2, 3, 4\n"
                f"*MATERIAL, NAME=M\n{material}\n*SOLID SECTION, ELSET=ONE, MATERIAL=M\n1.\n{cards}"
                f"*STEP{', NLGEOM' if nlgeom else ''}, INC=100000000\n{step}*END STEP\n")
