"""Decks of two blocks in contact, drawn by a grammar of all cards, and written twice: in the plain words of
this project and in those of other programs.

`Model(chance)` is what is said; `plain()` and `dressed(chance)` say it, the second in parts and instances,
turned axes, `*OUTPUT`, parameters that mean the same, cards that change nothing, any capitals and blanks. The
two have to end alike, to the last digit where words do not round. `fuzz_words` runs them and judges what calls itself good: numbers are finite,
bodies are no deeper in each other than told, supports bear what is put on, and energies add up.
"""

import pathlib
import re
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

import overlap  # noqa: E402
from scene_tools import Run, assert_no_crash, emcon  # noqa: E402

#: Labels of the upper block lie so far above those of the lower one, in the plain deck.
ABOVE = 1000
#: Of energies and of forces of supports, by the largest; Newton's method stops at 1e-10.
ENERGY, BALANCE = 1e-8, 1e-6
#: So far, by the edge, bodies are in each other where nothing is told.
UNTOLD = 1e-3
#: Solutions an increment, in the mean, with which a static step looks for a balance and may find another one.
WANDERED = 12
#: Of strain energies of decks that say the same to round-off, by the largest energy.
ROUNDED = 1e-6
#: What a run may take [s].
PATIENCE = 60
#: Node sets of plain decks.
SETS = ["FEET", "HEAD", "BODY", "SOLE"]
#: Degrees of freedom of the head that lie along x and along y: axes of the model, and of a *TRANSFORM.
GLOBAL, TURNED = (1, 2), (2, 1)
#: How the last step frees a lid that is kept flat; None: by the names of its nodes.
FREED = {"freed": None, "freed at once": ("*EQUATION, REMOVE ALL", [])}


def number(chance, value):
    """A number in one of its forms."""
    text = repr(float(value))
    forms = [text, text.removesuffix("0") if text.endswith(".0") else text,
             text.replace("e", "D") if "e" in text else text + "E0", f" {text}  "]
    return chance.choice(forms)


class Block:
    """A grid of elements; nodes and elements count from 1."""

    def __init__(self, kind, cells, size, place):
        self.kind, (n, m) = kind, cells
        step = 2 if kind in {"CPE8", "CPS8"} else 1
        at = lambda i, j: (place[0] + size[0]*i/(n*step), place[1] + size[1]*j/(m*step))
        self.node, label = {}, {}
        for j in range(m*step + 1):
            for i in range(n*step + 1):
                if step == 1 or i % 2 == 0 or j % 2 == 0:
                    label[i, j] = len(label) + 1
                    self.node[label[i, j]] = at(i, j)
        self.element, self.bottom, self.top = {}, [], []
        for j in range(m):
            for i in range(n):
                a, b, c, d = [label[step*(i + k), step*(j + l)] for k, l in ((0, 0), (1, 0), (1, 1), (0, 1))]
                if kind == "CPE3":
                    faces = self._add([a, b, c]), self._add([a, c, d])
                    below, above = (faces[0], 1), (faces[1], 2)
                else:
                    middles = [label[2*i + k, 2*j + l] for k, l in ((1, 0), (2, 1), (1, 2), (0, 1))] if step == 2 else []
                    one = self._add([a, b, c, d, *middles])
                    below, above = (one, 1), (one, 3)
                self.bottom += [below] if j == 0 else []
                self.top += [above] if j == m - 1 else []
        self.feet = [label[k] for k in label if k[1] == 0]
        self.head = [label[k] for k in label if k[1] == m*step]

    def _add(self, nodes):
        self.element[len(self.element) + 1] = nodes
        return len(self.element)


class Model:
    """What a deck says."""

    def __init__(self, chance):
        pick = chance.choice
        kind = pick(["CPE4", "CPE4", "CPE4I", "CPS4", "CPE3", "CPE8"])
        self.gap = pick([0.0, 0.0, 0.0, 1/64, 1/8, -1/128])
        self.low = Block(kind, (pick([1, 2, 4]), pick([1, 2])), (pick([2.0, 3.0]), 0.5), (-1.0, -0.5))
        self.up = Block(kind, (pick([1, 2, 4]), pick([1, 2])), (pick([0.5, 1.0, 1.5]), pick([0.5, 1.0])),
                        (pick([-0.5, 0.0, 0.25, 1.0]), self.gap))
        edges = [abs(np.subtract(block.node[block.element[1][0]], block.node[block.element[1][1]])).max()
                 for block in (self.low, self.up)]
        self.ratio = max(edges)/min(edges)
        self.young = pick([100.0, 2048.0])
        self.nu = pick([0.0, 0.25, 0.3])
        self.law = pick(["ELASTIC", "ELASTIC", "HYPERELASTIC, COUPLED NEO HOOKE"])
        self.density = self.young/pick([100.0, 400.0])
        self.thickness = pick([1.0, 1.0, 0.5])
        self.is_guided = chance.random() < 0.7
        self._draw_contact(chance)
        self.steps = [self._step(chance, k) for k in range(pick([1, 1, 2]))]
        #: Do the other words say the same to round-off alone?
        self.is_rounded = False
        self.lid = pick([None, None, None, "flat", "freed", "freed at once"])
        self.is_read_alone = chance.random() < 0.02
        if chance.random() < 0.9:
            self._reconcile()
        self.speed = pick([0.0, 0.02, 0.1])*np.sqrt(self.young/self.density)

    def _draw_contact(self, chance):
        pick = chance.choice
        self.behaviour = pick(["HARD", "HARD", "HARD", "LINEAR", "LINEAR", "EXPONENTIAL", "TABULAR", "TIED"])
        k = self.young*pick([1.0, 8.0, 64.0])
        self.slope = {"LINEAR": k, "EXPONENTIAL": np.log(100.0)*k/64, "TABULAR": k}.get(self.behaviour, 0.0)
        self.curve = {"HARD": [], "LINEAR": [[k] + pick([[], [], [k/1000]])], "EXPONENTIAL": [[1/64, k/4096]],
                      "TABULAR": [[0.0, pick([0.0, -1/64])], [k/64, 1/64]], "TIED": [[k]]}[self.behaviour]
        if self.behaviour == "EXPONENTIAL":
            self.slope = np.log(100.0)*self.curve[0][1]/self.curve[0][0]
        if self.behaviour == "TABULAR":
            (p0, o0), (p1, o1) = self.curve
            self.slope = (p1 - p0)/(o1 - o0)
        self.friction = pick([None, None, 0.1, 0.5])
        self.is_rough = self.friction is not None and chance.random() < 0.1
        self.stick = pick([None, k]) if self.friction and not self.is_rough else None
        self.formulation = pick(["NODE TO SURFACE", "SEGMENT", "MORTAR"])
        self.pair = [*pick([[], [], [], ["SIDES=ONE"], ["SIDES=BOTH"], ["GUARD=NO"]]), *pick([[], [], ["ADJUST=0."], ["ADJUST=0.05"], ["ADJUST=SOLE"]])]
        self.interaction = pick([[], [], [], [], ["RESTITUTION=0.5"], ["PAD THICKNESS=0.015625"]])
        self.damping = pick([None, None, None, [np.sqrt(self.young*self.density), 0.25, 0.5]])
        self.method = pick([[]]*6 + [["*CONSTRAINT METHOD, TYPE=PENALTY"], ["*CONTACT INITIATION, TYPE=ADMISSIBLE"],
                                     ["*CONTACT INITIATION, TYPE=MASSLESS"], ["*CONSTRAINT METHOD, TYPE=SADDLE POINT"]])

    def _reconcile(self):
        """Take out what is refused beside something else that is said."""
        is_hard, first = self.behaviour == "HARD", self.steps[0]
        if not is_hard:
            self.interaction = [word for word in self.interaction if "RESTITUTION" not in word]
            self.method = []
        elif self.friction and "PENALTY" in "".join(self.method) or "ADMISSIBLE" in "".join(self.method) + "".join(self.interaction):
            self.method = []
        if self.formulation != "NODE TO SURFACE":
            self.pair = [word for word in self.pair if word != "SIDES=BOTH"]
        elif "GUARD=NO" in self.pair:
            self.pair.append("SIDES=ONE")
        if self.behaviour == "TIED" or self.damping and not any(step["is_dynamic"] for step in self.steps):
            self.damping = None
        if any(step["load"] == "way" for step in self.steps):
            self.lid = None
        for step in self.steps[1:] if self.behaviour != "TIED" else self.steps:
            step["more"] = step.get("more", "").replace("interference", "").replace("loose", "")
        if self.gap < 0 and is_hard and not any("ADJUST" in word for word in self.pair):
            if first["is_dynamic"] or first["more"]:
                self.pair.append("ADJUST=0.05")
            else:
                first["more"] = "interference"

    def _step(self, chance, k):
        pick = chance.choice
        step = {"nlgeom": pick([True, True, False]), "is_dynamic": chance.random() < 0.5,
                "load": pick(["pressure", "force", "way", "weight", None]), "new": k > 0 and chance.random() < 0.5}
        if step["is_dynamic"]:
            h = pick([1/32, 1/8])/np.sqrt(self.young/self.density)
            step["times"] = [float(h), float(pick([8, 16])*h)]
            step["direct"] = chance.random() < 0.5
        else:
            step["times"], step["direct"] = [pick([0.25, 0.5, 1.0]), 1.0], chance.random() < 0.2
            step["more"] = pick([""]*8 + ["interference", "interference", "loose", "stabilize"])
        step["size"] = pick([1e-3, 1e-2])
        return step

    def size(self, step):
        """Pressure of a step, force of a node of the head, or its way; weights are of the same order."""
        return {"pressure": self.young, "force": self.young*self.thickness/len(self.up.head), "way": 1.0,
                "weight": self.young/self.density}.get(step["load"], 0.0)*step["size"]

    # ---- in plain words -------------------------------------------------------------------------

    def plain(self):
        up = lambda labels: [label + ABOVE for label in labels]
        cards = [("*NODE", [[n, *x] for n, x in self.low.node.items()]
                  + [[n + ABOVE, *x] for n, x in self.up.node.items()]),
                 (f"*ELEMENT, TYPE={self.low.kind}, ELSET=LOW", [[e, *n] for e, n in self.low.element.items()]),
                 (f"*ELEMENT, TYPE={self.up.kind}, ELSET=UP",
                  [[e + ABOVE, *up(n)] for e, n in self.up.element.items()]),
                 ("*ELSET, ELSET=ALL", [["LOW"], ["UP"]]), ("*NSET, NSET=FEET", [[n] for n in self.low.feet]),
                 ("*NSET, NSET=HEAD", [[n] for n in up(self.up.head)]),
                 ("*NSET, NSET=BODY", [[n] for n in up(self.up.node)]), ("*NSET, NSET=SOLE", [[n] for n in up(self.up.feet)]),
                 ("*SURFACE, NAME=UNDER", [[e, f"S{f}"] for e, f in self.low.top]),
                 ("*SURFACE, NAME=OVER", [[e + ABOVE, f"S{f}"] for e, f in self.up.bottom]),
                 ("*SURFACE, NAME=LID", [[e + ABOVE, f"S{f}"] for e, f in self.up.top])]
        return written(cards + self._rest("OVER", "UNDER", "LID", "ALL", SETS, up(self.up.head)))

    def _rest(self, over, under, lid, everything, sets, top, axes=GLOBAL):
        """All but the mesh, plainly; `sets`: the feet, the head, the whole and the lower side of the upper block;
        `top`: the nodes of the head, and along which `axes` their degrees of freedom are."""
        feet, head, body, sole = sets
        law = [("*" + self.law, [[self.young, self.nu]])]
        cards = [("*MATERIAL, NAME=M", []), *law, ("*DENSITY", [[self.density]]),
                 (f"*SOLID SECTION, ELSET={everything}, MATERIAL=M", [[self.thickness]]),
                 (", ".join(["*SURFACE INTERACTION, NAME=I", *self.interaction]), [])]
        if self.behaviour != "HARD":
            cards += [(f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE={self.behaviour}", self.curve)]
        if self.friction:
            stick = self.stick or (0.5*self.slope if self.slope else None)
            rough = ("*FRICTION, ROUGH", [])
            cards += [rough if self.is_rough else ("*FRICTION", [[self.friction] + ([stick] if stick else [])])]
        if self.damping:
            cards += [("*CONTACT DAMPING", [self.damping])]
        pair = ", ".join(["*CONTACT PAIR, INTERACTION=I", f"TYPE={self.formulation}", *self.pair])
        cards += [(pair.replace("SOLE", sole), [[over, under]]),
                  ("*BOUNDARY", [[feet, 1, 2]] + ([[head, axes[0]]] if self.is_guided else []))]
        if self.lid:
            cards += [("*EQUATION", [row for n in top[1:] for row in ([2], [n, axes[1], 1.0, top[0], axes[1], -1.0])])]
        if any(step["is_dynamic"] for step in self.steps):
            cards += [("*INITIAL CONDITIONS, TYPE=VELOCITY", [[body, 2, -self.speed]])]
        for k, step in enumerate(self.steps):
            cards += self._step_cards(step, lid, everything, head, axes)
            if k == len(self.steps) - 1 and self.lid in FREED:
                cards[-1:-1] = [FREED[self.lid] or ("*EQUATION, REMOVE", [[n, axes[1]] for n in top[1:]])]
            if k == len(self.steps) - 1 and self.is_read_alone:
                cards = [("*NO ANALYSIS", []) if card[1] == [step["times"]] else card for card in cards]
        return cards

    def _step_cards(self, step, lid, everything, head, axes):
        kind = ("*DYNAMIC" if step["is_dynamic"] else "*STATIC") + (", DIRECT" if step["direct"] else "")
        more = step.get("more")
        kind += ", STABILIZE" if more == "stabilize" else ""
        cards = [("*STEP, NLGEOM" if step["nlgeom"] else "*STEP", []), (kind, [step["times"]]),
                 *[(line, []) for line in self.method]]
        if more == "interference":
            cards += [("*CONTACT INTERFERENCE, SHRINK", [])]
        elif more == "loose":
            cards += [("*CONTACT CONTROLS, STABILIZE", [])]
        new, size = ", OP=NEW" if step["new"] else "", self.size(step)
        if step["new"]:
            cards += [(f"*{name}, OP=NEW", []) for name in ("CLOAD", "DLOAD", "DSLOAD")]
        if step["load"] == "pressure":
            cards += [("*DSLOAD" + new, [[lid, "P", size]])]
        elif step["load"] == "force":
            cards += [("*CLOAD" + new, [[head, axes[1], -size]])]
        elif step["load"] == "way":
            cards += [("*BOUNDARY", [[head, axes[1], axes[1], -size]])]
        elif step["load"] == "weight":
            cards += [("*DLOAD" + new, [[everything, "GRAV", size, 0.0, -1.0]])]
        return [*cards, ("*NODE FILE, FREQUENCY=1", [["U", "RF"]]), ("*CONTACT FILE, FREQUENCY=1", [["CF"]]),
                ("*END STEP", [])]

    # ---- in the words of others -----------------------------------------------------------------

    def dressed(self, chance):
        """The same deck as other programs would write it."""
        if chance.random() < 0.5:
            cards = self._parts(chance)
            names = ["Up-1.Over", "Under", "Up-1.Lid", "Everything", ["Feet", "Up-1.Head", "Up-1.Body", "Up-1.Sole"]]
            top = [f"Up-1.{n}" for n in self.up.head]
        else:
            shift = chance.choice([500, 7000, 10**6])
            cards, names = self._flat(chance, shift), ["OVER", "UNDER", "LID", "ALL", SETS]
            top = [n + shift for n in self.up.head]
        axes = chance.choice([GLOBAL, GLOBAL, TURNED])
        rest = self._rest(*names, top, axes)
        turns = [(f"*TRANSFORM, NSET={names[4][1]}", [[0.0, 3.0, 0.0, -2.0, 0.0, 0.0]])] if axes == TURNED else []
        if chance.random() < 0.2:
            self.is_rounded = True
            turns += [(f"*TRANSFORM, TYPE=C, NSET={names[4][0]}", [[0.0, 9.0, 0.0, 0.0, 9.0, 1.0]])]
        rest[0:0] = turns
        return written(self._reworded(cards, rest, chance, names), chance)

    def _flat(self, chance, shift):
        """The mesh with labels of its own and sets by GENERATE, sides by element sets."""
        up = lambda labels: [label + shift for label in labels]
        cards = [("*NODE, NSET=Nall", [[n, *x] + [0.0] for n, x in self.low.node.items()]
                  + [[n + shift, *x] for n, x in self.up.node.items()]),
                 (f"*ELEMENT, TYPE={self.low.kind}, ELSET=Efaces", [[e, *n] for e, n in self.low.element.items()]
                  + [[e + shift, *up(n)] for e, n in self.up.element.items()]),
                 ("*ELSET, ELSET=ALL", [["Efaces"]]),
                 *self._set("NSET", "FEET", self.low.feet, chance), *self._set("NSET", "HEAD", up(self.up.head), chance),
                 *self._set("NSET", "BODY", up(self.up.node), chance), *self._set("NSET", "SOLE", up(self.up.feet), chance)]
        for name, sides, base in (("UNDER", self.low.top, 0), ("OVER", self.up.bottom, shift), ("LID", self.up.top, shift)):
            face = sides[0][1]
            cards += [*self._set("ELSET", f"_{name}_S{face}", [e + base for e, _ in sides], chance),
                      (f"*SURFACE, TYPE=ELEMENT, NAME={name}", [[f"_{name}_S{face}", f"S{face}"]])]
        return cards

    @staticmethod
    def _set(kind, name, labels, chance, more=""):
        labels = list(labels)
        steps = set(np.diff(labels))
        if len(steps) == 1 and chance.random() < 0.6:
            return [(f"*{kind}, {kind}={name}{more}, GENERATE", [[labels[0], labels[-1], int(steps.pop())]])]
        rows = [labels[k:k + 16] for k in range(0, len(labels), 16)]
        return [(f"*{kind}, {kind}={name}{more}", rows)]

    def _parts(self, chance):
        """Two parts; the upper one lies somewhere else in its part, by eighths."""
        way = [chance.randint(-16, 16)/8 for _ in range(2)]
        turn = chance.choice([(1.0, 0.0, ""), (1.0, 0.0, ""), (0.0, 1.0, "90."), (-1.0, 0.0, "-180.0")])
        self.is_rounded = self.is_rounded or bool(turn[2])
        back = lambda x, y: (turn[0]*x + turn[1]*y, turn[0]*y - turn[1]*x)
        lower = [(f"*Part, name=Low{k}", rows) for k, rows in [("", [])]]
        lower += [("*Node", [[n, *x] for n, x in self.low.node.items()]),
                  (f"*Element, type={self.low.kind}", [[e, *n] for e, n in self.low.element.items()]), ("*End Part", [])]
        upper = [("*Part, name=Up", []), ("*Node", [[n, *back(x - way[0], y - way[1])] for n, (x, y) in self.up.node.items()]),
                 (f"*Element, type={self.up.kind}, elset=Whole", [[e, *n] for e, n in self.up.element.items()]),
                 *self._set("NSET", "Head", self.up.head, chance), *self._set("NSET", "Body", self.up.node, chance),
                 *self._set("NSET", "Sole", self.up.feet, chance),
                 ("*Surface, type=ELEMENT, name=Over", [[e, f"S{f}"] for e, f in self.up.bottom]),
                 ("*Surface, type=ELEMENT, name=Lid", [[e, f"S{f}"] for e, f in self.up.top]), ("*End Part", [])]
        face = self.low.top[0][1]
        assembly = [("*Assembly, name=Assembly", []), ("*Instance, name=Low-1, part=Low", []), ("*End Instance", []),
                    ("*Instance, name=Up-1, part=Up", ([[*way, 0.0]] if any(way) or turn[2] or chance.random() < 0.5 else [])
                     + ([[*way, 0.0, *way, 1.0, turn[2]]] if turn[2] else [])),
                    ("*End Instance", []), *self._set("Nset", "Feet", self.low.feet, chance, ", instance=Low-1"),
                    *self._set("Elset", "_Under", [e for e, _ in self.low.top], chance, ", internal, instance=Low-1"),
                    ("*Surface, type=ELEMENT, name=Under", [["_Under", f"S{face}"]]),
                    *self._set("Elset", "Everything", self.low.element, chance, ", instance=Low-1"),
                    ("*Elset, elset=Everything", [["Up-1.Whole"]]), ("*End Assembly", [])]
        parts = [lower, upper]
        chance.shuffle(parts)
        return [card for part in parts for card in part] + assembly

    def _reworded(self, mesh, rest, chance, names):
        """Cards that say the same, and cards that say nothing, between those of the deck."""
        cards = [("*HEADING", [["any text, 100 %"]])] + (PREFACE[:chance.randint(0, len(PREFACE))]) + mesh
        is_step = False
        for line, data in rest:
            line, data, more = self._same(line, data, chance, names)
            is_step = is_step or line.startswith("*STEP")
            cards.append((line, data))
            cards += more
            name = re.match(r"\*[A-Z ]+", line)[0]
            fits = IDLE.get(name, [])
            if fits and chance.random() < 0.4:
                cards.append(chance.choice(fits))
        return cards

    def _same(self, line, data, chance, names):
        """A card that means the same, and what follows it."""
        often, pick, more = (lambda: chance.random() < 0.5), chance.choice, []
        if line.startswith("*SURFACE INTERACTION") and often():
            data = [[1.0]]
        elif line.startswith("*CONTACT PAIR"):
            if self.formulation == "MORTAR" and often():
                line = line.replace("MORTAR", pick(["SURFACE TO SURFACE", "LINMORTAR", "PGLINMORTAR"]))
            line = line.replace(", TYPE=NODE TO SURFACE", "") if often() else line
            line += pick(["", "", ", SMALL SLIDING", ", NO THICKNESS", ", TRACKING=STATE"])
        elif line == "*FRICTION":
            if self.behaviour == "HARD" and often():
                data = [[self.friction, 1000.0]]
            elif self.behaviour in {"LINEAR", "EXPONENTIAL", "TABULAR"} and not self.stick and often():
                data = [[self.friction]]
            line += pick(["", "", ", SLIP TOLERANCE=0.005"])
        elif line.startswith("*SURFACE BEHAVIOR"):
            line += pick(["", ", DIRECT", ", PENALTY"])
        elif line.startswith("*STATIC") or line.startswith("*DYNAMIC"):
            line += pick(["", "", ", SOLVER=PARDISO"])
            line += pick(["", ", ALPHA=0", ", APPLICATION=TRANSIENT FIDELITY"]) if line.startswith("*DYNAMIC") else ""
        elif line.startswith("*STEP"):
            line += pick(["", ", INC=100000", ", NAME=Step-1", ", UNSYMM=NO"])
            line = line.replace("NLGEOM", "NLGEOM=YES") if often() else line
        elif line.startswith("*CONTACT INTERFERENCE") and often():
            line, data = line + pick(["", ", TYPE=CONTACT PAIR"]), [names[:2]]
        elif line.startswith("*CONTACT CONTROLS") and often():
            line = pick([line + f", MASTER={names[1]}, SLAVE={names[0]}", line + "=1."])
        elif line == "*STATIC, STABILIZE" and often():
            line += "=0.0002, ALLSDTOL=0.05, CONTINUE=NO"
        elif line.startswith("*DLOAD") and data and often():
            data = [["", *data[0][1:]]]
        elif line.startswith("*BOUNDARY") and data and data[0][1:] == [1, 2] and often():
            data = [[data[0][0], pick(["ENCASTRE", "PINNED"])], *data[1:]]
        elif line == "*NODE FILE, FREQUENCY=1":
            line, data, more = pick([
                (line, data, []), ("*NODE FILE", data, []), ("*NODE FILE, OUTPUT=2D", [["U", "NT"], ["RF"]], []),
                ("*OUTPUT, FIELD", [], [("*NODE OUTPUT", [["U1", "U2", "RF"]]), ("*ELEMENT OUTPUT, DIRECTIONS=YES", [["S", "PEEQ"]])])])
        elif line == "*END STEP":
            more = []
        return line, data, more


#: Cards in front of a deck.
PREFACE = [("*PREPRINT, ECHO=NO, MODEL=NO, HISTORY=NO, CONTACT=NO", []),
           ("*PHYSICAL CONSTANTS, ABSOLUTE ZERO=0, STEFAN BOLTZMANN=5.670374419e-11", []),
           ("*ORIENTATION, NAME=O, SYSTEM=RECTANGULAR", [[1., 0., 0., 0., 1., 0.], [3, 0.]]),
           ("*FILTER, NAME=F, TYPE=BUTTERWORTH", [[0.1]]), ("*SECTION CONTROLS, NAME=E, HOURGLASS=ENHANCED", [[1., 1., 1.]])]
#: Cards that change nothing, by that behind which they may stand.
IDLE = {
    "*DENSITY": [("*EXPANSION, ZERO=20", [[1.1e-5]]), ("*CONDUCTIVITY", [[14.0]]), ("*SPECIFIC HEAT", [[4.4e8]])],
    "*SURFACE INTERACTION": [("*GAP CONDUCTANCE", [[1000.0]])],
    "*STATIC": [("*CONTROLS, PARAMETERS=TIME INCREMENTATION", [[4, 8, 9, 16, 10, 4, "", 5]]),
                ("*OUTPUT, FREQUENCY=1", []), ("*CONTROLS, RESET", []), ("*RESTART, WRITE, FREQUENCY=0", [])],
    "*DYNAMIC": [("*CONTROLS, PARAMETERS=FIELD", [[0.005, 0.01, "", "", 0.02]]), ("*OUTPUT, FREQUENCY=1", []),
                 ("*BULK VISCOSITY", [[0.06, 1.2]]), ("*MONITOR, NODE=1, DOF=2", []), ("*PRINT, CONTACT=YES", [])],
    "*NODE FILE": [("*EL FILE", [["S", "E", "NOE"]]), ("*OUTPUT, FREQUENCY=1", [])],
    "*OUTPUT": [],
    "*CONTACT FILE": [("*CONTACT PRINT, TOTALS=YES", [["CF", "CFN", "CELS", "CNUM"]]), ("*ENERGY PRINT", [["ALLKE"]]),
                      ("*NODE PRINT, TOTALS=ONLY", [["RF"]]), ("*OUTPUT, HISTORY, VARIABLE=PRESELECT", [])],
}


# ---- text ---------------------------------------------------------------------------------------


def written(cards, chance=None):
    """The text of a deck; with `chance` in any capitals, blanks, forms of numbers and comments."""
    lines = []
    for line, data in cards:
        rows = [line, *(", ".join(v if isinstance(v, str) else str(v) if chance is None or isinstance(v, int)
                                  else number(chance, v) for v in map(native, row)) for row in data)]
        lines += rows if chance is None else [mumbled(row, k == 0, line, chance) for k, row in enumerate(rows)]
    return "\n".join(lines) + "\n"


def native(value):
    return value.item() if isinstance(value, np.generic) else value


def mumbled(row, is_keyword, line, chance):
    """A line with other capitals and blanks, maybe a comment in front of it."""
    row = chance.choice([row, row, row.lower() if not line.startswith("*HEADING") else row, row.replace(", ", ","), row.replace(",", " ,  ")])
    if is_keyword and chance.random() < 0.2 and "=" in row and not line.startswith("*HEADING"):
        head, _, tail = row.rpartition(",")
        row = f"{head},\n{tail.strip()}" if head and re.match(r"\s*[A-Za-z]", tail) else row
    elif not is_keyword and chance.random() < 0.1 and not re.match(r"\*(ELEMENT|HEADING)", line, re.IGNORECASE):
        row += ","
    return chance.choice(["", "", "", "** text\n", "**\n", "  "]) + row


# ---- judge --------------------------------------------------------------------------------------


def energies(run):
    """What energies do not add up to, by the largest of them; None if a step is static."""
    columns = {name: np.array(column, dtype=float) for name, column in run.digits(pairs=False).items()}
    change = columns["total"] - columns["total"][0]
    change = change - columns["contact_work"] + sum(columns[f"{name}_loss"] for name in ("scheme", "damping", "friction", "contact_damping"))
    largest = max(np.abs(columns[name]).max() for name in ("kinetic", "strain", "external_work", "friction_loss"))
    return np.abs(change).max()/largest if largest else 0.0


def energies_differ(model, run, same):
    """By what the strain energies at the end differ, by the largest, or that of a strain of 1e-6."""
    one, other = run.digits(pairs=False), same.digits(pairs=False)
    largest = max(np.abs(np.array(one[name], dtype=float)).max() for name in ("kinetic", "strain", "external_work"))
    return abs(float(one["strain"][-1]) - float(other["strain"][-1]))/max(largest, 1e-12*model.young)


def wrong(model, run):
    """What is wrong with a run that calls itself good; empty: nothing."""
    table = run.digits()
    for name, column in table.items():
        if "_center_" not in name and not np.isfinite(np.array(column, dtype=float)).all():
            return f"{name} is not finite"
    if run.verdict["verdict"] != "good":
        return ""
    fields = run.fields()
    u = fields["displacement"][..., :2]
    if not np.isfinite(u).all():
        return "displacements are not finite"
    begin = 1.0 if model.steps[0].get("more") == "interference" else 0.0
    seen = deepest(fields, begin)
    # What only the chords of bent surfaces are in is told where it is more than that which is in.
    chords = re.search(r"edges of curved surfaces overlap by up to (\S+) of their length", run.log)
    soft = re.search(r"largest penetration of contact (\S+) of an edge", run.log)
    told = max(run.verdict["penetration"], *(float(line[1])*(1 + 5e-3) for line in (chords, soft) if line), 0.0)
    told += max(run.verdict["penetration"], UNTOLD)
    # What gives way is told by the edge of the surface that it goes into, whichever is longer.
    told *= model.ratio if soft else 1.0
    if model.behaviour != "TIED" and seen.by_edge > told*(1 + 1e-5) + 1e-12:
        return f"told {told:.3g} deep, but {seen}"
    force = fields["contact_force"][..., :2] if "contact_force" in fields.names() else np.zeros(1)
    if np.abs(force.sum(axis=-2)).max(initial=0) > 1e-9*np.abs(force).max(initial=0):
        return "contact forces do not add up to nothing"
    if all(step["is_dynamic"] for step in model.steps) and energies(run) > ENERGY:
        return f"energies do not add up, by {energies(run):.2e}"
    return supports(model, fields)


def deepest(fields, begin):
    """The deepest overlap at the ends of increments, from time `begin` on. Contact sees a side with a midside node as two edges
    that meet in this node at the start, and farther out as the side bends, by a third of that."""
    cells = [cell.reshape(2, -1).T.ravel() if len(cell) == 8 else cell for cell in fields.cells]
    bodies, found = overlap.Bodies(cells), overlap.Overlap()
    for time, u in zip(fields.time, fields["displacement"]):
        if time < begin:
            continue
        way = u[:, :2].copy()
        for cell in cells:
            if len(cell) == 8:
                way[cell[1::2]] = (8*u[cell[1::2]] - u[cell[::2]] - u[np.roll(cell[::2], -1)])[:, :2]/6
        found = max(found, bodies.overlap(fields.x + way, time))
    return found


def area(x, cells):
    """Of all elements."""
    total = 0.0
    for cell in cells:
        ring = x[cell]
        if len(cell) == 8:
            ring = ring.reshape(2, 4, -1).swapaxes(0, 1).reshape(8, -1)
            # As much lies below a parabola as in a triangle whose tip is a third farther out.
            ring[1::2] = (8*ring[1::2] - ring[::2] - np.roll(ring[::2], -1, axis=0))/6
        total += 0.5*overlap.cross(ring, np.roll(ring, -1, axis=0)).sum()
    return total


def supports(model, fields):
    """Do the supports of a last static step bear what stands on them?"""
    step = model.steps[-1]
    if step["is_dynamic"] or step["more"] == "stabilize" or len(model.steps) > 1 or step["load"] not in {"pressure", "force", "weight"}:
        return ""
    size, nodes = model.size(step), len(model.low.node)
    if step["load"] == "force":
        load = size*len(model.up.head)
    elif step["load"] == "weight":
        load = size*model.density*model.thickness*area(fields.x, fields.cells)
    else:
        x = fields.x[:, 0] + (fields["displacement"][-1][:, 0] if step["nlgeom"] else 0.0)
        ends = [nodes + model.up.head[k] - 1 for k in (0, -1)]
        load = size*model.thickness*(x[ends[1]] - x[ends[0]])
    borne = fields["reaction_force"][-1][:, 1].sum()
    return "" if abs(borne - load) <= BALANCE*load else f"supports bear {borne!r} of {load!r}"


def ended(text, folder, name):
    """Exit code and run of a deck."""
    deck = folder/f"{name}.inp"
    deck.write_text(text)
    done = emcon(deck, "--quiet", "--output", folder, timeout=PATIENCE)
    assert_no_crash(done.returncode, done.stderr)
    assert done.returncode == 0 or done.stderr.strip(), "refused without a word"
    return done, Run(folder/name, done.stderr)


def fuzz_words(chance, folder):
    """A deck in other words ends as in plain ones, and what calls itself good is so."""
    model = Model(chance)
    (plain, run), (dressed, same) = ended(model.plain(), folder, "plain"), ended(model.dressed(chance), folder, "dressed")
    if model.is_rounded and 3 in (plain.returncode, dressed.returncode):
        # What hardly holds, or is hardly near, round-off may decide.
        assert 2 not in (plain.returncode, dressed.returncode)
        return
    assert plain.returncode == dressed.returncode, f"{plain.returncode}, {dressed.returncode}\n{plain.stderr}\n{dressed.stderr}"
    if plain.returncode == 2 or model.is_read_alone:
        return
    if model.is_rounded:
        # Friction goes by the way: by other increments it ends elsewhere.
        is_other = run.verdict["cuts"] != same.verdict["cuts"] or any(
            one.verdict["newton"] > WANDERED*one.verdict["increments"] for one in (run, same))
        assert is_other or energies_differ(model, run, same) <= ROUNDED, "other words, other energies"
    else:
        assert run.digits() == same.digits(), "other words, other digits"
    fault = wrong(model, run)
    assert not fault, fault


def fuzz_damaged(chance, folder, mutated):
    """The same decks with something wrong are refused in words, or end."""
    done, run = ended(mutated(Model(chance).dressed(chance), chance), folder, "damaged")
    if done.returncode in (0, 3) and run.file(".csv").exists():
        for name, column in run.digits().items():
            assert "_center_" in name or "nan" not in " ".join(column).lower(), f"{name} is not a number"
