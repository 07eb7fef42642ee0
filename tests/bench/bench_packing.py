"""What compressing the fields would save and cost, for decks of input_decks.

    .venv/bin/python tests/bench/bench_packing.py [--update] [DECK...]

Fields of all frames are compressed as the library of the files would, bytes of the same rank
together; `--update` writes the table of docs/performance.md.
"""

import argparse
import pathlib
import sys
import tempfile
import time
import zlib

import h5py
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from scene_tools import DECKS, ROOT, run_deck  # noqa: E402
from verification import update  # noqa: E402

PAGE = ROOT/"docs/performance.md"
DEFAULT = ("ring", "tied_ring", "spinning_ring", "self_contact", "two_bodies")
LEVELS = (1, 4)


def packed(values, level):
    """Bytes and seconds of a frame that is compressed."""
    planes = np.ascontiguousarray(values).view(np.uint8).reshape(-1, 8).T.tobytes()
    begin = time.process_time()
    return len(zlib.compress(planes, level)), time.process_time() - begin


def measure(path):
    """Of fields that are stored packed, and of the others: bytes, and bytes and seconds packed."""
    sums = {True: np.zeros(1 + 2*len(LEVELS)), False: np.zeros(1 + 2*len(LEVELS))}
    with h5py.File(path) as file:
        for group in ("PointData", "CellData"):
            offsets = file[f"VTKHDF/Steps/{group}Offsets"]
            for name, data in file[f"VTKHDF/{group}"].items():
                n = file[f"VTKHDF/NumberOf{'Points' if group == 'PointData' else 'Cells'}"][0]
                for first in sorted(set(offsets[name][...])):
                    frame = data[first:first + n]
                    found = [x for level in LEVELS for x in packed(frame, level)]
                    sums[data.compression is not None] += [frame.nbytes, *found]
    return sums


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("deck", nargs="*", default=DEFAULT)
    parser.add_argument("--update", action="store_true")
    options = parser.parse_args()
    lines = ["| deck | fields | as they are | level 1 | level 4 | time of the run |",
             "|---|---|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as folder:
        for deck in options.deck:
            run = run_deck(DECKS/f"{deck}.inp", folder)
            seconds = sum(run.verdict["seconds"].values())
            for is_packed, found in measure(run.file(".vtkhdf")).items():
                if found[0] == 0:
                    continue
                cells = [f"{size/found[0]:.0%} in {took:.3f} s"
                         for size, took in zip(found[1::2], found[2::2], strict=True)]
                lines.append(f"| {deck} | {'sparse' if is_packed else 'others'} | "
                             f"{found[0]/1e6:.2f} MB | {' | '.join(cells)} | {seconds:.2f} s |")
    print("\n".join(lines))
    if options.update:
        PAGE.write_text(update(PAGE.read_text(), "packing", lines))


if __name__ == "__main__":
    main()
