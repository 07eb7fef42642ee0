"""Run the program on decks, read what it leaves, and edit decks: helpers of the tests of runs."""

import contextlib
import ctypes
import dataclasses
import functools
import importlib
import io
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import time
from unittest import mock

import h5py
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
DECKS = ROOT / "input_decks"
PROGRAM = pathlib.Path(os.environ.get("EMCON", ROOT / "build" / "release" / "emcon"))
#: What a program allocates holds rubbish until it is set (glibc).
RUBBISH = {"GLIBC_TUNABLES": "glibc.malloc.tcache_count=0:glibc.malloc.perturb=128"}
EPSILON = np.finfo(float).eps
#: A program that checks every access takes longer: how many times what is allowed to others.
PATIENCE = float(os.environ.get("EMCON_PATIENCE", "1"))

#: What a program that crashed, or a library that was not asked to speak, leaves on the screen.
CRASH = re.compile(
    r"backtrace|forrtl|sigsegv|segmentation|fortran runtime error|error termination|hdf5-diag|"
    r"program received signal|floating-point exceptions|double free|core dumped|assertion",
    re.IGNORECASE,
)


# ---- running ------------------------------------------------------------------------------------


def emcon(*arguments, timeout=120, **options):
    """Call the program; exit code and texts as of `subprocess.run`. It must never crash."""
    done = subprocess.run(
        [PROGRAM, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=timeout*PATIENCE,
        **options,
    )
    assert_no_crash(done.returncode, done.stdout + done.stderr)
    return done


def assert_no_crash(code, text):
    assert code in (0, 2, 3, 4, 130), f"exit code {code}\n{text}"
    assert not CRASH.search(text), text


def start(*arguments, ignored=(), **options):
    """Run the program in the background; it ignores the signals `ignored` and no others."""

    def set_signals():
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGPIPE):
            signal.signal(number, signal.SIG_IGN if number in ignored else signal.SIG_DFL)

    return subprocess.Popen(
        [PROGRAM, *map(str, arguments)],
        text=True,
        preexec_fn=set_signals,
        **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options},
    )


def wait_for(path, process, seconds=60):
    """Until `path` is there; the process must not have ended before."""
    end = time.monotonic() + seconds
    while not path.exists():
        assert process.poll() is None and time.monotonic() < end, f"no {path}"
        time.sleep(0.002)


def overrides(parameters):
    """`--set` options for parameters of a deck."""
    return [f"--set={name}={value}" for name, value in parameters.items()]


def attempt(deck, folder, options, parameters, timeout=120):
    """Run `deck`, a path or a `Deck`, with results in `folder`: what the call gave, and the run."""
    folder = pathlib.Path(folder)
    if isinstance(deck, Deck):
        folder.mkdir(parents=True, exist_ok=True)
        deck = deck.write(folder / f"{deck.name}.inp")
    done = emcon(deck, "--quiet", "--output", folder, *options, *overrides(parameters), timeout=timeout)
    return done, Run(folder / deck.stem, done.stderr)


def has_fused_products():
    """Do OpenBLAS' kernels for this processor round products and sums once? Those for older ones, which it takes for
    processors that it does not know, round twice."""
    try:
        blas = ctypes.CDLL("libopenblas.so.0")
        blas.openblas_get_corename.restype = ctypes.c_char_p
    except (OSError, AttributeError):
        return True
    return blas.openblas_get_corename().decode().lower() not in {
        "prescott", "core2", "penryn", "dunnington", "nehalem", "atom", "nano", "sandybridge", "barcelona", "bobcat"}


def run_deck(deck, folder, code=0, options=(), timeout=120, **parameters):
    """Run `deck`, a path or a `Deck`, with results in `folder`; the exit code must be `code`."""
    done, run = attempt(deck, folder, options, parameters, timeout)
    assert done.returncode == code, f"exit code {done.returncode}\n{done.stderr}"
    return run


def run_one_sided(deck, folder, **parameters):
    """`run_deck` for contact that holds the nodes of one side: those of the other may go in.

    The exit code is then 3, and the overlap must be all that the verdict blames.
    """
    done, run = attempt(deck, folder, (), parameters)
    if done.returncode != 0:
        verdict = json.loads(run.file(".json").read_text())
        assert (done.returncode, verdict["verdict"]) == (3, "bad"), done.stderr
        assert all(reason.startswith("bodies overlap") for reason in verdict["reasons"]), verdict
    return run


# ---- results ------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Run:
    """The files of a run, `base` plus a suffix each, and what it wrote to standard error."""

    base: pathlib.Path
    errors: str = ""

    def file(self, suffix):
        return self.base.with_name(self.base.name + suffix)

    @functools.cached_property
    def log(self):
        return self.file(".log").read_text()

    @functools.cached_property
    def verdict(self):
        """NAME.json: one object in one line."""
        (line,) = self.file(".json").read_text().splitlines()
        return json.loads(line)

    @functools.cached_property
    def history(self):
        """NAME.csv as a structured array, one row per increment."""
        with self.file(".csv").open() as file:
            columns = [(name, float) for name in file.readline().strip().split(",")]
            return np.loadtxt(file, columns, delimiter=",", ndmin=1)

    def digits(self, pairs=True):
        """The columns of NAME.csv as they are written, all but `cpu`, for comparison bit by bit;
        with those of the contact pairs or without."""
        head, *rows = [line.split(",") for line in self.file(".csv").read_text().splitlines()]
        return {name: [row[k] for row in rows] for k, name in enumerate(head)
                if name != "cpu" and (pairs or not name.startswith("pair"))}

    @functools.cached_property
    def increments(self):
        """The lines of the log that belong to each increment: remarks, then its own line."""
        groups, group = [], []
        for line in self.log.split(" increment          time", 1)[1].splitlines()[1:]:
            group.append(line)
            if re.match(r" {0,9}\d+ +\d\.\d+E", line):
                groups.append(group)
                group = []
        return groups

    def closing(self, pattern):
        """The number that `pattern` finds in the closing balance of the log."""
        return float(re.search(pattern, self.log)[1])

    def series(self, place, variable):
        """Times and values of one requested quantity in NAME.h5."""
        with h5py.File(self.file(".h5"), "r") as file:
            group = file["sets"][place]
            return group[f"{variable}_time"][:], group[variable][:]

    def fields(self):
        """NAME.vtkhdf, read once as long as nobody writes to it."""
        path = self.file(".vtkhdf")
        written = path.stat().st_mtime_ns
        if self.__dict__.get("_read", (None, None))[0] != written:
            self.__dict__["_read"] = written, Fields(path)
        return self.__dict__["_read"][1]


class Fields:
    """The field file: times, `x` (n_node, n_dim) and fields (n_frame, n, n_component), each of which
    is read when it is asked for first."""

    #: Cells of three dimensions.
    SPACE = (10, 12, 24, 25)

    def __init__(self, path):
        self._path = path
        self._written = path.stat().st_mtime_ns
        with h5py.File(path, "r") as file:
            root = file["VTKHDF"]
            steps = root["Steps"]
            n_frame = int(steps.attrs["NSteps"])
            self.time = steps["Values"][:n_frame]
            self.n_dim = 3 if np.isin(root["Types"][:], self.SPACE).any() else 2
            self.x = root["Points"][:, :self.n_dim]
            self.cells = np.split(root["Connectivity"][:], root["Offsets"][1:-1])
            self._kind = {name: kind for kind in ("PointData", "CellData") for name in root[kind]}
        self._data = {}

    def _read(self, name):
        kind = self._kind[name]
        assert self._path.stat().st_mtime_ns == self._written, f"{self._path} was written anew"
        n, n_frame = len(self.x) if kind == "PointData" else len(self.cells), len(self.time)
        with h5py.File(self._path, "r") as file:
            root = file["VTKHDF"]
            first = root["Steps"][f"{kind}Offsets"][name][:n_frame]
            whole = root[kind][name][:]
        # Frames that follow one another are read at once.
        rows = (first[:, None] + np.arange(n)).ravel()
        if not np.array_equal(rows, np.arange(len(whole))):
            whole = whole[rows]
        return whole.reshape(n_frame, n, *whole.shape[1:])

    def names(self):
        return set(self._kind)

    def __getitem__(self, name):
        if name not in self._data:
            self._data[name] = self._read(name)
        values = self._data[name]
        is_vector = values.ndim == 3 and values.shape[2] == 3
        return values[..., :self.n_dim] if is_vector else values


# ---- decks --------------------------------------------------------------------------------------


def number(value):
    """The shortest text that reads back as the same double."""
    return repr(float(value))


class Deck:
    """A deck as a list of cards, each a keyword line and its data lines, without comments.

    Enough for the decks of this project, one keyword per line; parameters stay as they are.
    """

    def __init__(self, text, name="deck"):
        self.name = name
        self.card = self._cards(text)

    @staticmethod
    def _cards(text):
        cards = []
        for line in text.splitlines():
            if line.startswith("**") or not line.strip():
                continue
            if line.startswith("*"):
                cards.append((line, []))
            else:
                cards[-1][1].append(line)
        return cards

    @classmethod
    def read(cls, path):
        return cls(pathlib.Path(path).read_text(), pathlib.Path(path).stem)

    def text(self):
        return "".join("\n".join([head, *data]) + "\n" for head, data in self.card)

    def write(self, path):
        path = pathlib.Path(path)
        path.write_text(self.text())
        return path

    def find(self, keyword, containing=""):
        """Index of the first card with this keyword and `containing` in its keyword line."""
        for k, (head, _) in enumerate(self.card):
            if head.split(",")[0].strip() == keyword and containing in head:
                return k
        raise KeyError(f"{keyword} {containing}")

    def replace(self, old, new):
        """Another text in place of `old`, which must be there, in all lines."""
        assert old in self.text(), old
        self.card = self._cards(self.text().replace(old, new))

    def insert(self, text, before="*END STEP"):
        """Put cards in front of the first card of the keyword `before`."""
        k = self.find(before)
        self.card[k:k] = self._cards(text)

    def remove(self, keyword, containing=""):
        del self.card[self.find(keyword, containing)]

    def data(self, keyword, containing=""):
        return self.card[self.find(keyword, containing)][1]

    def map_numbers(self, keyword, function):
        """Change the values of all cards of a keyword: `function(words)` gives the new words."""
        for head, data in self.card:
            if head.split(",")[0].strip() == keyword:
                data[:] = [
                    ", ".join(function([word.strip() for word in line.split(",")])) for line in data
                ]

    def move_nodes(self, function):
        """Node positions anew: `function(label, x, y)` gives (x, y)."""

        def moved(words):
            x, y = function(int(words[0]), float(words[1]), float(words[2]))
            return [words[0], number(x), number(y)]

        self.map_numbers("*NODE", moved)

    def set_parameter(self, name, value):
        data = self.data("*PARAMETER")
        k = next(k for k, line in enumerate(data) if line.split("=")[0].strip() == name)
        data[k] = f"{name} = {value}"


@functools.cache
def generated(name, *options):
    """What the generator `name` of input_decks writes with these options, made once."""
    if str(DECKS) not in sys.path:
        sys.path.insert(0, str(DECKS))
    text = io.StringIO()
    with mock.patch("sys.argv", [name, *options]), contextlib.redirect_stdout(text):
        importlib.import_module(name).main()
    return text.getvalue()


def made(scene, folder, *options):
    """A deck of a generator with other options than those of the deck in the tree."""
    deck = folder / f"{scene}.inp"
    deck.write_text(generated(f"make_{scene}", *map(str, options)))
    return deck


def coarse_ring():
    """The ring scene on less than half of its elements, beneath the same surfaces: for tests of contact
    and of steps, whose cost is that of the elements."""
    return Deck(generated("make_ring", "--ring", "64x2", "--block", "60x2"), "ring")


def coarse_spinning_ring():
    """The ring in free flight, on less than half of its elements."""
    return Deck(generated("make_spinning_ring", "--ring", "32x2"), "spinning_ring")


def heading(deck):
    """The opening lines of a deck file, up to its first keyword after *HEADING, as running text."""
    lines = []
    for line in pathlib.Path(deck).read_text().splitlines()[1:]:
        if line.startswith("*") and not line.startswith("**"):
            break
        lines.append(line.lstrip("* "))
    return " ".join(lines)


def figures(deck, pattern):
    """Numbers that `pattern`, with one group each, finds in the heading of a deck file."""
    found = re.search(pattern, heading(deck))
    assert found, f"{pattern} is not in the heading of {deck}"
    return [float(text) for text in found.groups()]


def root_user():
    return os.geteuid() == 0
