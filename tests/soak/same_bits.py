"""Does a rebuilt program give the same bits? `same_bits.py BEFORE AFTER [DECK...]`, two programs.

Each deck is run by both; exit codes, messages, and all that the result files hold must agree to
the last bit, times of the processor excepted; counts of calls where both tell them. Without decks:
all of input_decks/ and build/bits/, where `same_bits.py collect [TEST...]` puts each deck that
tests and the chapters of the book run. What a program gives is kept in build/bits/, so that BEFORE
is run once.
"""

import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import h5py

ROOT = pathlib.Path(__file__).resolve().parents[2]
STORE = ROOT / "build" / "bits"
#: A run that takes longer is cut, and the decks that were are counted.
SECONDS = 60
NOT_COMPARED = r"/cpu$|_SECONDS|^run/version$|^texts/build$"
WITHOUT = re.compile(r"[\d.]+ s of the processor|cpu[^,}\n]*", re.I)


# ---- the decks of the tests ---------------------------------------------------------------------


def keep(arguments):
    """Stand in for the program: keep the deck with the options it is run with, then run it."""
    deck = next((pathlib.Path(a) for a in arguments if a.endswith(".inp")), None)
    options = [a for a in arguments if a.startswith(("--set", "--lenient", "--strict"))]
    if deck and deck.exists() and "--restart" not in arguments:
        text = deck.read_text(errors="replace")
        if "*INCLUDE" not in text.upper():
            name = hashlib.sha256((text + "\n".join(options)).encode()).hexdigest()[:16]
            (STORE / f"{name}.inp").write_text(text)
            (STORE / f"{name}.options").write_text("\n".join(options))
    program = os.environ["EMCON_KEPT"]
    os.execv(program, [program, *arguments])


def collect(tests):
    STORE.mkdir(parents=True, exist_ok=True)
    stand_in = STORE / "emcon"
    stand_in.write_text(f"#!/bin/sh\nexec {sys.executable} {__file__} keep \"$@\"\n")
    stand_in.chmod(0o755)
    kept = os.environ.get("EMCON", str(ROOT / "build/release/emcon"))
    environment = {**os.environ, "EMCON": str(stand_in), "EMCON_KEPT": kept}
    tests = tests or ["tests/scenes", "tests/decks"]
    command = [sys.executable, "-m", "pytest", "-q", "-n", "2", *tests]
    subprocess.run(command, cwd=ROOT, env=environment, check=False)
    print(f"{len(list(STORE.glob('*.inp')))} decks in {STORE.relative_to(ROOT)}")


# ---- what a run gives ---------------------------------------------------------------------------


def table(path):
    """A history without its column of processor time."""
    rows = [line.split(",") for line in path.read_text().splitlines()]
    columns = [k for k, name in enumerate(rows[0]) if name != "cpu"]
    return "\n".join(",".join(row[k] for k in columns if k < len(row)) for row in rows).encode()


def verdict(path):
    """NAME.json without its seconds and counts."""
    found = json.loads(path.read_bytes())
    return json.dumps({k: v for k, v in found.items() if k not in ("seconds", "counts", "memory")}).encode()


def arrays(path):
    """Names and bytes of all arrays of an HDF5 file but times of the machine and its version."""
    parts = []
    with h5py.File(path, "r") as file:
        file.visititems(
            lambda name, item: parts.append((name, item[()]))
            if isinstance(item, h5py.Dataset)
            else None
        )
    parts = [(name, a) for name, a in parts if not re.search(NOT_COMPARED, name)]
    return b"".join(name.encode() + repr(a.shape).encode() + a.tobytes() for name, a in parts)


READ = {".csv": table, ".json": verdict, ".vtkhdf": arrays, ".h5": arrays}


def outcome(program, deck, options):
    """Digests of all that a run leaves, by name."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            done = subprocess.run(
                [program, deck, "--quiet", "--output", folder, *options],
                capture_output=True,
                text=True,
                timeout=SECONDS,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return {"cut": "after a while"}
        said = WITHOUT.sub("", done.stderr.replace(folder, ""))
        result = {"exit code": str(done.returncode), "messages": digest(said.encode())}
        for path in sorted(pathlib.Path(folder).iterdir()):
            if path.suffix in READ:
                held = READ[path.suffix](path).replace(folder.encode(), b"")
                result["".join(path.suffixes)] = digest(held)
            if path.suffix == ".json":
                counts = json.loads(path.read_bytes()).get("counts")
                result["counts"] = digest(json.dumps(counts).encode()) if counts else ""
    return result


def digest(data):
    return hashlib.sha256(data).hexdigest()[:16]


def outcomes(program, decks):
    """Outcome of each deck, from the store where this very program has run it."""
    program = pathlib.Path(program).resolve()
    store = STORE / f"of-{digest(program.read_bytes() + pathlib.Path(__file__).read_bytes())}.json"
    known = json.loads(store.read_text()) if store.exists() else {}
    new = [deck for deck in decks if key(deck) not in known]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        found = pool.map(lambda deck: outcome(program, deck, options_of(deck)), new)
        known.update(zip(map(key, new), found, strict=True))
    STORE.mkdir(parents=True, exist_ok=True)
    store.write_text(json.dumps(known))
    return {deck: known[key(deck)] for deck in decks}


def key(deck):
    return digest(deck.read_bytes() + "\n".join(options_of(deck)).encode())


def options_of(deck):
    beside = deck.with_suffix(".options")
    return beside.read_text().splitlines() if beside.exists() else []


def compare(before, after, decks):
    """Print the decks whose outcomes differ, and in what; the number of them."""
    old, new = outcomes(before, decks), outcomes(after, decks)
    different = 0
    for deck in decks:
        names = sorted(old[deck].keys() | new[deck].keys())
        if not (old[deck].get("counts") and new[deck].get("counts")):
            names = [name for name in names if name != "counts"]
        unlike = [n for n in names if old[deck].get(n) != new[deck].get(n)]
        if unlike:
            different += 1
            print(f"{deck}: {', '.join(unlike)} differ")
    cut = sum("cut" in old[deck] for deck in decks)
    print(f"{len(decks)} decks, {different} different, {cut} cut after {SECONDS} s")
    return different


def main(arguments):
    if arguments[:1] == ["keep"]:
        keep(arguments[1:])
    if arguments[:1] == ["collect"]:
        return collect(arguments[1:])
    if len(arguments) < 2:
        raise SystemExit(__doc__)
    decks = [pathlib.Path(a) for a in arguments[2:]]
    decks = decks or sorted([*(ROOT / "input_decks").glob("*.inp"), *STORE.glob("*.inp")])
    raise SystemExit(compare(arguments[0], arguments[1], decks) > 0)


if __name__ == "__main__":
    main(sys.argv[1:])
