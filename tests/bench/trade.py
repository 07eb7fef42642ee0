"""Make the table and the figure of docs/trade.md again: what each simplification saves and costs.

    .venv/bin/python tests/bench/trade.py            # print the table
    .venv/bin/python tests/bench/trade.py --update   # write it and the figure into docs/

Scenes of the plane and of space, each with one body as it is, corotated, linear, quasi-static and rigid, and with massive and
massless surfaces of contact, one run at a time. Times are those of whole processes, as ratios to
the first run of the scene in the same round; of three rounds the medians. Runs are kept in
build/trade/PROGRAM: what was interrupted goes on. Needs the program (`make app`).
"""

import argparse
import dataclasses
import math
import pathlib
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "scenes")]

from book.common import BROAD, COLOURS, axes, common_legend, save, size, table  # noqa: E402
from kept_runs import folder_of, name_of, run_once  # noqa: E402
from plain_scenes import AUTO, Scene, below, bowl, gears  # noqa: E402
from scene_tools import DECKS, PROGRAM, Deck  # noqa: E402
from verification import update  # noqa: E402

PAGE = ROOT / "docs" / "trade.md"
SURFACES = {"PERSISTENT": "massive", "MASSLESS": "massless"}
#: What is written into the section of the body.
SECTION = {"elastic": "", "corotated": ", KINEMATICS=COROTATED",
           "linear": ", KINEMATICS=LINEAR", "quasi-static": ", MASSLESS",
           "quasi-static, linear": ", KINEMATICS=LINEAR, MASSLESS"}
KINDS = (*SECTION, "rigid")
#: Corotated sections are of the plane.
SPACE_KINDS = tuple(kind for kind in KINDS if kind != "corotated")
#: A rigid body of which only its surface is left.
PROFILE = "rigid profile"
DRAWN = ("elastic", "linear", "quasi-static", "rigid")
NODE = 99999
#: In place of the stiffness of plain scenes, 100, for a body that others meet.
STIFF = 1e4


# ---- scenes -------------------------------------------------------------------------------------


def rigid(body, place, held, moves=()):
    """Cards of a rigid body with a reference node of its own, held there, or that moves with the
    velocity and the spin `moves`."""
    axes = [(1, 2), (6, 6)] if len(place) == 2 else [(1, 6)]
    boundary = "*BOUNDARY\n" + "".join(f"{NODE}, {a}, {b}\n" for a, b in axes) if held else ""
    if moves:
        boundary += "*INITIAL CONDITIONS, TYPE=VELOCITY\n" + "".join(f"{NODE}, {a}, {v}\n" for a, v in enumerate(moves, 1))
    return (f"*NODE\n{NODE}, {', '.join(map(str, place))}\n*RIGID BODY, ELSET={body}, REF NODE={NODE}\n"
            + boundary)


def simplified(deck, body, kind):
    """The section of a body that is not rigid, as `kind` has it."""
    if kind != "rigid":
        deck.replace(f"ELSET={body}, MATERIAL", f"ELSET={body}{SECTION[kind]}, MATERIAL")
    return deck


def massive(path):
    """A deck of input_decks/ whose nodes have mass where nothing else is said."""
    deck = Deck.read(path)
    if "initiation = AUTO" in deck.text():
        deck.replace("initiation = AUTO", "initiation = PERSISTENT")
    return deck


def ring(kind, path=DECKS / "ring.inp"):
    deck = massive(path)
    if kind not in ("rigid", PROFILE):
        return simplified(deck, "BLOCK", kind)
    body = rigid("BLOCK", (0, -5), True)
    if kind == PROFILE:
        for keyword in ("*NODE", "*ELEMENT", "*SOLID SECTION"):
            deck.remove(keyword, "ELSET=BLOCK" if keyword != "*NODE" else "NSET=BLOCK")
        deck.remove("*NSET", "NSET=BOTTOM")
        deck.remove("*ELSET", "ELSET=BLOCK_TOP")
        deck.remove("*SURFACE", "NAME=BLOCK_TOP")
        body = body.replace("*RIGID BODY, ELSET=BLOCK", "*SURFACE, TYPE=SEGMENTS, NAME=BLOCK_TOP\n"
                            "START, -25., 0.\nLINE, 35., 0.\n"
                            "*RIGID BODY, ANALYTICAL SURFACE=BLOCK_TOP")
    deck.replace("*BOUNDARY\nBOTTOM, 1, 2\n", body)
    return deck


def bar(kind):
    deck = massive(DECKS / "bouncing_bar.inp")
    return simplified(deck, "BAR", kind)


def drawn(scene, body, place, moves=()):
    """A plain scene, its body held as before or, where it is rigid, at its reference node; a body that
    flies, alone in its scene, has the velocity and the spin `moves`."""

    def deck(kind):
        drawing = scene()
        is_held = bool(drawing.held)
        if kind == "rigid" and not moves:
            drawing.held = []
        text = drawing.deck(AUTO)
        if is_held:
            text.replace(f"NAME={body}\n*HYPERELASTIC, COUPLED NEO HOOKE\n100.0",
                         f"NAME={body}\n*HYPERELASTIC, COUPLED NEO HOOKE\n{STIFF}")
        for head, lines in text.card:
            if head == "*DLOAD":                                 # of the others alone
                lines[:] = [line for line in lines if not line.startswith(body)]
        if kind == "rigid":
            if moves:
                text.remove("*INITIAL CONDITIONS")
            text.insert(rigid(body, place, is_held and not moves, moves), before="*STEP")
        return simplified(text, body, kind)

    return deck


def ball():
    scene = Scene(0.01, 1.0)
    scene.disc("BALL", (0.0, 0.52), 0.5, (8, 4), velocity=(0.3, -1.0))
    scene.block("BLOCK", (-1.5, -0.8), (3.0, 0.8), (30, 8))
    scene.pairs = [("BALL", "BLOCK")]
    return scene.hold("BLOCK", below(-0.8))


def _turn(first, second):
    """About the first axis, then about the second one [rad]."""
    (c, s), (d, t) = ((math.cos(a), math.sin(a)) for a in (first, second))
    return np.array([[d, 0, t], [0, 1, 0], [-t, 0, d]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


#: How the cube of `space_cube` is turned, where its middle is, .02 above the plate with a corner, and how it moves.
TURN = _turn(0.5, 0.3)
MIDDLE = (0.03, 0.02, 0.02 + 0.5*np.abs(TURN[2]).sum())
SPEED, SPIN = (0.2, 0.1, -1.0), (0.3, -0.2, 0.5)


def space_ball():
    """A ball falls askew, with a spin, on a plate that is held below."""
    scene = Scene(0.01, 0.6)
    scene.ball("BALL", (0.03, 0.02, 0.52), 0.5, (3, 2), velocity=(0.3, 0.1, -1.0), spin=(0, 0, 1))
    scene.block("PLATE", (-0.9, -0.9, -0.5), (1.8, 1.8, 0.5), (7, 7, 2))
    return scene.hold("PLATE", below(-0.5))


def space_cube(kind="C3D8", cells=3, floor=(5, 5, 2), h=0.01):
    """A cube that is turned about two axes falls with a corner first on a plate, and tumbles."""
    def place(x):
        return (x - 0.5) @ TURN.T + MIDDLE

    scene = Scene(h, 0.6)
    scene.block("CUBE", (0, 0, 0), (1, 1, 1), (cells,)*3, kind=kind, shape=place,
                velocity=SPEED, spin=SPIN)
    scene.block("PLATE", (-1.1, -1.1, -0.5), (2.2, 2.2, 0.5), floor, kind=kind)
    return scene.hold("PLATE", below(-0.5))


def space_bars(kind="C3D4", cells=2):
    """Two free bars cross each other on their edges; no node meets a face at first."""
    d = math.sqrt(0.5)

    def lower(x):
        along, a, b = (x - (1.0, 0.5, 0.5)).T
        return np.stack([along, d*(a - b), d*(a + b) - d - 0.01], axis=1)

    def upper(x):
        along, a, b = (x - (1.0, 0.5, 0.5)).T
        return np.stack([d*(b - a) + 0.03, along + 0.04, d*(a + b) + d + 0.01], axis=1)

    scene = Scene(0.01, 0.6)
    scene.block("UPPER", (0, 0, 0), (2, 1, 1), (2*cells, cells, cells), kind=kind, shape=upper,
                velocity=(0.1, 0.05, -1.0), spin=(0, 0, 0.3))
    return scene.block("LOWER", (0, 0, 0), (2, 1, 1), (2*cells, cells, cells), kind=kind, shape=lower)


@dataclasses.dataclass(frozen=True)
class Case:
    """A scene, the body that is simplified, how, and the parameters of its runs."""

    name: str
    deck: object
    kinds: tuple
    parameters: dict


NTS = {"formulation": "NODE TO SURFACE"}
CASES = (
    Case("ring on a foundation", ring, (*KINDS, PROFILE), {**NTS, "h": 0.02, "t_end": 4.0, "frame": 4}),
    Case("bar on a floor, the bar", bar, ("elastic", "linear"),
         {**NTS, "h": 0.0025, "t_end": 2.0, "frame": 2}),
    Case("ball on a block", drawn(ball, "BLOCK", (0, -0.4)), KINDS, NTS),
    Case("disc in a bowl", drawn(bowl, "BOWL", (0, 0)), KINDS, {**NTS, "h": 0.01}),
    Case("gears, the driven one", drawn(gears, "DRIVEN", (2.06, 0)), ("elastic", "corotated", "rigid"),
         {**NTS, "h": 0.005}),
    Case("in space: ball on a plate", drawn(space_ball, "PLATE", (0, 0, -0.25)), SPACE_KINDS, NTS),
    Case("in space: cube on a plate, the cube", drawn(space_cube, "CUBE", MIDDLE, (*SPEED, *SPIN)),
         ("elastic", "rigid"), NTS),
)


# ---- runs ---------------------------------------------------------------------------------------


def measured(deck, folder, parameters):
    """The run of a deck, its processor time [s] and its largest memory [MiB]."""
    run, done = run_once(folder, deck, parameters)
    assert done.code == 0 or "bodies overlap" in done.errors, done.errors
    return run, done.cpu, done.memory


def force_of(history, n=5):
    """Sum of the forces of all pairs, the mean of `n` increments at a time, and its times."""
    names = [name for name in history.dtype.names if "_force_" in name]
    both = np.array([sum(history[name] for name in names if name.endswith(axis))
                     for axis in "xyz" if any(name.endswith(axis) for name in names)])
    usable = (both.shape[1] - 1)//n*n
    mean = both[:, 1:usable + 1].reshape(len(both), -1, n).mean(axis=2)
    return history["time"][1:usable + 1].reshape(-1, n).mean(axis=1), mean


def impulse_of(history):
    force = force_of(history, 1)[1]
    return force @ np.diff(history["time"])


@dataclasses.dataclass
class Result:
    """What the runs of one kind of a scene gave."""

    history: object
    rows: int
    cpu: list
    memory: list


def results(case, folder, rounds):
    """Results by kind of body and of surface; runs are kept in `folder`."""
    found = {}
    for k in range(rounds):
        for kind in case.kinds:
            for surfaces in SURFACES:
                where = folder / name_of(case.name, kind, surfaces, k)
                run, cpu, memory = measured(case.deck(kind), where,
                                            {**case.parameters, "initiation": surfaces})
                key = kind, surfaces
                if k == 0:
                    unknowns = int(run.closing(r"(\d+) unknowns in step 1"))
                    found[key] = Result(run.history, unknowns, [], [])
                found[key].cpu.append(cpu)
                found[key].memory.append(memory)
    return found


def drift(history):
    kept = history["total"] - history["contact_work"]
    return np.abs(kept - kept[0]).max()/(history["kinetic"] + history["strain"]).max()


def rows_of(case, found):
    """Lines of the table; differences are from the elastic body with the same surfaces, those of
    its own massless surfaces from the massive ones."""
    first = found["elastic", "PERSISTENT"]
    for (kind, surfaces), result in found.items():
        other = found["elastic", surfaces]
        if kind == "elastic":
            other = first
        _, force = force_of(result.history)
        _, expected = force_of(other.history)
        impulse, full = impulse_of(result.history), impulse_of(other.history)
        rms = np.sqrt(np.mean((force - expected)**2)/np.mean(expected**2))
        is_first = result is first
        yield (case.name, kind, SURFACES[surfaces], result.rows,
               f"{np.median(np.divide(result.cpu, first.cpu)):.2f}",
               f"{np.median(result.memory):.0f}",
               f"{np.linalg.norm(impulse):.4g}",
               "" if is_first else percent(np.linalg.norm(impulse - full)/np.linalg.norm(full)),
               "" if is_first else percent(rms),
               size(drift(result.history)))


def percent(part):
    if part < 1e-4:
        return "< 0.01 %"
    return f"{100*part:.0f} %" if part >= 0.1 else f"{100*part:.2g} %"


# ---- the page -----------------------------------------------------------------------------------


def write(name, lines):
    """Put a table into the page; rows of scenes that were not run stay as they are."""
    text = PAGE.read_text()
    head, rule, *rows = lines
    made = {}
    old = text.split(f"<!-- {name} -->\n", 1)[1].split("<!-- end -->", 1)[0].splitlines()[2:]
    of_new = {row.split("|")[1] for row in rows}
    for row in [row for row in old if row.split("|")[1] not in of_new] + rows:
        made.setdefault(row.split("|")[1], []).append(row)
    PAGE.write_text(update(text, name, [head, rule, *(row for of in made.values() for row in of)]))


def draw(found, path):
    """Contact force of the ring on its foundations, massive and massless surfaces."""
    pictures = axes(2)
    for picture, surfaces in zip(pictures, SURFACES, strict=True):
        for kind, colour, broad in zip(DRAWN, COLOURS, BROAD, strict=False):
            time, force = force_of(found[kind, surfaces].history)
            picture.plot(time, np.abs(force[1]), color=colour, lw=broad, label=kind)
        picture.set(xlim=(0, 3), xlabel="time", title=f"{SURFACES[surfaces]} surfaces",
                    ylabel="contact force, mean of 5 increments")
    common_legend(pictures[0])
    save(path)


def main():
    parser = argparse.ArgumentParser(description="The table and the figure of docs/trade.md")
    parser.add_argument("--update", action="store_true", help="write into docs/")
    parser.add_argument("--rounds", type=int, default=3, help="runs of each kind (3)")
    parser.add_argument("only", nargs="*", help="words of the names of scenes")
    options = parser.parse_args()
    lines = []
    for case in CASES:
        if options.only and not any(word in case.name for word in options.only):
            continue
        found = results(case, folder_of("simplified"), options.rounds)
        lines += rows_of(case, found)
        if options.update and case.deck is ring:
            draw(found, PAGE.parent / "trade_ring.png")
    lines = table(["scene", "body", "surfaces", "unknowns", "CPU", "MiB", "impulse", "differs by",
                   "force, rms", "energy"], lines)
    print(*lines, sep="\n")
    if options.update:
        write("simplified", lines)


if __name__ == "__main__":
    main()
