"""Seeded fuzzers: bad decks, damaged files, calls in any order, killed runs, scenes by chance.

    .venv/bin/python tests/soak/soak.py [--seconds 600] [--seed 1] [decks crossed restart calls kill scenes
        space words damaged]

Every case has a seed of its own, which is printed where the case fails: `--seed N --cases 1` and
the name of the fuzzer repeat it. `make soak` runs all; a few cases of each are in the tests.
"""

import argparse
import ctypes
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from random_decks import fuzz_damaged, fuzz_words
from random_scenes import fuzz_scenes
from random_space import fuzz_space
from scene_tools import DECKS, PROGRAM, ROOT, Deck, Run, assert_no_crash, emcon, run_deck, start

#: No more text than this is mutated: long decks are long because of their nodes.
MOST_TEXT = 40000
WORDS = ["0", "-1", "1e400", "-1e308", "nan", "inf", "1e-320", "2147483648", "99999999999999999999",
         "", "*", "**", ",", "=", "<h>", "<<", '"', "'", "\t", "\0", "\xe9", "*END STEP", "*STEP",
         "*NODE", "*ELEMENT, TYPE=CPE4", "*INCLUDE, INPUT=.", "ALL", "1, 1, 1, 1, 1"]  # fmt: skip


# ---- decks --------------------------------------------------------------------------------------


def mutated(text, chance):
    """`text` with one to six things wrong."""
    for _ in range(chance.randint(1, 6)):
        lines = text.split("\n")
        i, j = chance.randrange(len(lines)), chance.randrange(len(lines))
        kind = chance.randrange(7)
        if kind == 0:
            del lines[i]
        elif kind == 1:
            lines.insert(j, lines[i])
        elif kind == 2:
            lines[i], lines[j] = lines[j], lines[i]
        elif kind == 3:
            words = lines[i].split(",")
            words[chance.randrange(len(words))] = chance.choice(WORDS)
            lines[i] = ",".join(words)
        elif kind == 4:
            at = chance.randrange(len(lines[i]) + 1)
            lines[i] = lines[i][:at] + chr(chance.randrange(256)) + lines[i][at + 1 :]
        elif kind == 5:
            lines[i] = lines[i]*chance.choice([2, 30])
        else:
            lines = lines[: i + 1]
        text = "\n".join(lines)
    return text


def fuzz_decks(chance, folder):
    """A deck with something wrong is refused in words, or runs until it is told to stop."""
    decks = [p for p in sorted((ROOT / "tests/decks").glob("*.inp")) if p.stat().st_size < MOST_TEXT]
    text = chance.choice(decks).read_text(encoding="latin-1")
    deck = folder / "deck.inp"
    deck.write_text(mutated(text, chance), encoding="latin-1")
    done = subprocess.run([PROGRAM, "check", deck], capture_output=True, timeout=60)
    said = done.stdout.decode(errors="replace") + done.stderr.decode(errors="replace")
    assert_no_crash(done.returncode, said)
    assert done.returncode in (0, 2, 3), f"exit code {done.returncode}\n{said}"
    assert done.returncode == 0 or done.stderr.strip(), "refused without a word"
    if done.returncode == 0 and chance.random() < 0.2:
        process = start(deck, "--quiet", "--output", folder / "out")
        try:
            process.wait(1.0)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=60)
        assert process.returncode in (0, 2, 3, 130, -signal.SIGTERM), err
        assert_no_crash(max(0, process.returncode), out + err)


# ---- crossed ------------------------------------------------------------------------------------

#: Decks that one process reads, one after the other.
PER_PROCESS = 25


def cards(text):
    """Lists of lines, each with its keyword first."""
    found = [[]]
    for line in text.split("\n"):
        if line.startswith("*") and not line.startswith("**"):
            found.append([])
        found[-1].append(line)
    return found


def crossed(decks, chance):
    """A deck with cards of others put in, in the place of its own, or with their data below its own."""
    mine = list(chance.choice(decks))
    for _ in range(chance.randint(1, 4)):
        other = chance.choice(decks)
        i, j, n = chance.randrange(len(other)), chance.randrange(len(mine)), chance.choice([1, 1, 1, 2, 4])
        kind = chance.randrange(5)
        if kind < 2:
            mine[j:j] = other[i : i + n]
        elif kind == 2:
            mine[j : j + n] = other[i : i + n]
        elif kind == 3:
            mine[j] = mine[j][:1] + other[i][1:]
        elif len(mine) > 1:
            del mine[j]
    return "\n".join("\n".join(card) for card in mine)


def reader(folder):
    """The program that reads decks by the library; made once."""
    program = folder / "read_decks"
    if not program.exists():
        library = PROGRAM.parent
        flags = ["-fsanitize=address,undefined"] if os.environ.get("MODE") == "sanitize" else []
        subprocess.run(["cc", "-std=c99", *flags, f"-I{ROOT / 'src_f90/border'}",
                        pathlib.Path(__file__).with_name("read_decks.c"), "-o", program, f"-L{library}",
                        "-lemcon", f"-Wl,-rpath,{library}"], check=True, timeout=60)  # fmt: skip
    return program


def fuzz_crossed(chance, folder):
    """Decks of unlike kinds put together are read or refused in words, many in one process."""
    found = [*(ROOT / "tests/decks").glob("*.inp"), *DECKS.glob("*.inp")]
    decks = [cards(p.read_text(encoding="latin-1")) for p in sorted(found) if p.stat().st_size < MOST_TEXT]
    paths = [folder / f"deck{k}.inp" for k in range(PER_PROCESS)]
    for path in paths:
        path.write_text(crossed(decks, chance), encoding="latin-1")
    done = subprocess.run([reader(folder.parent), *paths], capture_output=True, timeout=120,
                          cwd=ROOT / "tests/decks")
    said = done.stdout.decode(errors="replace") + done.stderr.decode(errors="replace")
    assert_no_crash(done.returncode, said)
    assert done.returncode == 0, said


# ---- restart ------------------------------------------------------------------------------------


def finished_run(folder):
    """A short run of the ring with all its files; made once."""
    if not (folder / "ring.rst.h5").exists():
        run_deck(DECKS / "ring.inp", folder, h=0.1, t_end=0.6, frame=0.2)
    return folder


def damaged(data, chance):
    """`data` with bytes changed, cut off, doubled or put in."""
    data = bytearray(data)
    at = chance.randrange(len(data))
    kind = chance.randrange(4)
    if kind == 0:
        for _ in range(chance.randint(1, 8)):
            data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    elif kind == 1:
        del data[at:]
    elif kind == 2:
        data[at:at] = data[at : at + chance.randint(1, 5000)]
    else:
        n = min(len(data) - at, chance.randint(1, 5000))
        data[at : at + n] = bytes(n) if chance.random() < 0.5 else chance.randbytes(n)
    return bytes(data)


def fuzz_restart(chance, folder):
    """A result that is not what the run wrote is refused, by its name, and left as it is."""
    shutil.copytree(finished_run(folder.parent / "finished"), folder, dirs_exist_ok=True)
    path = folder / chance.choice(["ring.rst.h5", "ring.h5", "ring.vtkhdf"])
    before = path.read_bytes()
    path.write_bytes(damaged(before, chance))
    data = {p: p.read_bytes() for p in folder.iterdir() if p.suffix != ".log"}
    done = emcon("restart", folder / "ring.rst.h5", "--quiet", timeout=60)
    if data[path] == before:
        assert done.returncode == 0, done.stderr
        return
    assert done.returncode in (2, 4) and path.name in done.stderr, done.stderr
    for p, content in data.items():
        assert p.read_bytes() == content, f"{p.name} was changed"


# ---- calls --------------------------------------------------------------------------------------


class Twin:
    """A model behind the functions of emcon.h; answers are codes, messages and bytes."""

    DOUBLE, INT = ctypes.c_double, ctypes.c_int

    def __init__(self, library):
        self.library, self.model, self.snapshot = library, ctypes.c_void_p(), ctypes.c_void_p()
        code = library.emcon_open(str(DECKS / "ring.inp").encode(), b"h=0.05", 0,
                                  ctypes.byref(self.model))  # fmt: skip
        assert code == 0, self.message()

    def message(self):
        return self.library.emcon_message(self.model)

    def call(self, name, *arguments):
        code = getattr(self.library, "emcon_" + name)(self.model, *arguments)
        assert code in (0, 2, 3, 4), f"emcon_{name}: {code} {self.message()}"
        return code, self.message() if code else b""

    def n_node(self):
        sizes = (self.INT*64)()                       # more than there are
        assert self.call("get_sizes", sizes)[0] == 0
        return sizes[0]

    def step(self, h):
        made = (self.DOUBLE*16)()                     # larger than any increment
        return *self.call("step", self.DOUBLE(h), made), bytes(made)

    def advance(self):
        made = (self.DOUBLE*16)()
        return *self.call("advance", made), bytes(made)

    def get(self, name, n, n_array):
        """A function that fills `n_array` arrays of two reals for each of n nodes."""
        size = 2*max(0, n) + 1
        arrays = [(self.DOUBLE*size)(*[7.0]*size) for _ in range(n_array)]
        answer = self.call(name, self.INT(n), *arrays)
        for array in arrays:
            assert array[len(array) - 1] == 7, f"emcon_{name} wrote behind its array"
        return *answer, *map(bytes, arrays)

    def evaluate(self, h, n, with_tangent):
        size = max(0, n)
        u1 = (self.DOUBLE*(2*size + 1))()
        code = self.call("guess", self.DOUBLE(h), self.INT(n), u1)
        return code, self.call("evaluate", self.DOUBLE(h), self.INT(n), u1, self.INT(with_tangent),
                               self.INT(0), None, None)  # fmt: skip

    def take(self):
        self.library.emcon_free_snapshot(self.snapshot)
        self.snapshot = ctypes.c_void_p()
        return self.call("take_snapshot", ctypes.byref(self.snapshot))

    def restore(self):
        return self.call("restore_snapshot", self.snapshot)

    def close(self):
        self.library.emcon_free_snapshot(self.snapshot)
        self.library.emcon_close(self.model)


def load_library():
    library = ctypes.CDLL(str(PROGRAM.parent / "libemcon.so"))
    library.emcon_message.restype = ctypes.c_char_p
    library.emcon_message.argtypes = [ctypes.c_void_p]
    library.emcon_close.argtypes = library.emcon_free_snapshot.argtypes = [ctypes.c_void_p]
    library.emcon_close.restype = library.emcon_free_snapshot.restype = None
    return library


def any_call(chance, n_node):
    """Name of a method of `Twin` and its arguments, right and wrong ones."""
    n = chance.choice([n_node]*6 + [0, -1, n_node - 1, n_node + 1, 2**31 - 1])
    n = min(n, n_node + 1)                            # the arrays are of the size that is told
    h = chance.choice([0.05, 0.02, 0.3, 1e-9] + [0.0, -1.0, float("nan"), 1e300, float("inf")])
    label, dof = chance.choice([1, 2, 50, 0, -3, 10**6]), chance.choice([1, 2, 0, 3, -1])
    value = ctypes.c_double(chance.choice([0.0, 1e-3, float("nan"), 1e308]))
    return chance.choice([
        ("advance",), ("advance",), ("step", h), ("take",), ("restore",),
        ("get", "get_state", n, 2), ("get", "get_positions", n, 1), ("evaluate", h, n, 1),
        ("evaluate", h, n, 0), ("call", "next_step"),
        ("call", "set_prescribed", label, dof, value),
        ("call", "remove_prescribed", label, dof),
        ("call", "set_load", chance.choice([0, -1, 5]), value),
    ])  # fmt: skip


def fuzz_calls(chance, folder):
    """Two models that are called alike answer alike, whatever the calls; nothing crashes."""
    library = load_library()
    twins = [Twin(library), Twin(library)]
    n_node = twins[0].n_node()
    try:
        for _ in range(chance.randint(5, 25)):
            name, *arguments = any_call(chance, n_node)
            one, other = [getattr(twin, name)(*arguments) for twin in twins]
            assert one == other, f"{name}{arguments}: {one[:2]} and {other[:2]}"
    finally:
        for twin in twins:
            twin.close()


# ---- kill ---------------------------------------------------------------------------------------


#: Decks that are killed: a line of each, the restarts written in its place, and parameters that make it short.
KILLED = {
    "ring": ("*RESTART, WRITE, FREQUENCY=50", "*RESTART, WRITE, FREQUENCY=3", {"h": 0.05, "t_end": 1.0, "frame": 0.2}),
    "bouncing_ball": ("*END STEP", "*RESTART, WRITE, FREQUENCY=3\n*END STEP", {"t_end": 0.1, "frame": 0.02}),
}


def fuzz_kill(chance, folder):
    """Killed any number of times, a run ends as if nothing had been."""
    name = chance.choice(sorted(KILLED))
    line, restarts, parameters = KILLED[name]
    whole = folder.parent / "whole"
    deck = Deck.read(DECKS / f"{name}.inp")
    deck.replace(line, restarts)
    if not (whole / f"{name}.log").exists():
        run_deck(deck, whole, **parameters)
    for parameter, value in parameters.items():
        deck.set_parameter(parameter, value)
    path, run = deck.write(folder / f"{name}.inp"), Run(folder / name)
    for k in range(20):
        goes_on = run.file(".rst.h5").exists()
        order = ["restart", run.file(".rst.h5")] if goes_on else [path]
        process = start(*order, "--quiet")
        try:
            process.wait(60 if k == 19 else chance.uniform(0.0, 0.4))
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
        out, err = process.communicate(timeout=60)
        assert process.returncode in (0, -signal.SIGKILL), err
        if process.returncode == 0:
            break
    assert run.digits() == Run(whole / name).digits()


# ---- driver -------------------------------------------------------------------------------------

FUZZERS = {"decks": fuzz_decks, "crossed": fuzz_crossed, "restart": fuzz_restart, "calls": fuzz_calls,
           "kill": fuzz_kill, "scenes": fuzz_scenes, "space": fuzz_space, "words": fuzz_words,
           "damaged": lambda chance, folder: fuzz_damaged(chance, folder, mutated)}


def soak(name, seed, folder, cases=None, seconds=None):
    """Cases `seed`, `seed` + 1, ... of a fuzzer, so many or for so long; how many there were."""
    end = time.monotonic() + (seconds or 0.0)
    n = 0
    while n < cases if cases else time.monotonic() < end:
        case = folder / str(seed + n)
        case.mkdir()
        try:
            FUZZERS[name](random.Random(f"{name} {seed + n}"), case)
        except BaseException:
            print(f"{name}: failed with --seed {seed + n}; its files are in {case}", flush=True)
            raise
        shutil.rmtree(case)
        n += 1
    return n


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--seconds", type=float, default=600.0, help="altogether")
    parser.add_argument("--cases", type=int, help="of each fuzzer, instead of seconds")
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("name", nargs="*", choices=[[], *FUZZERS], help="all of them if none")
    options = parser.parse_args()
    names = options.name or list(FUZZERS)
    root = pathlib.Path(tempfile.mkdtemp(prefix="emcon_soak_"))
    for name in names:
        folder = root / name
        folder.mkdir()
        n = soak(name, options.seed, folder, options.cases, options.seconds/len(names))
        print(f"{name}: {n} cases from seed {options.seed}", flush=True)
    shutil.rmtree(root)


if __name__ == "__main__":
    main()
