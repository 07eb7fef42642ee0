"""A strip in space that folds onto itself, with and without mass at its surface."""

import sys

import numpy as np
from scene_tools import ROOT

from .common import Chapter, drift, size, table

sys.path.append(str(ROOT / "tests" / "scenes"))
import test_self_contact_space as strips  # noqa: E402

KINDS = {"NODE TO SURFACE": strips.PAIR, "MORTAR": strips.by_mortar(strips.PAIR)}
INITIATIONS = ("PERSISTENT", "MASSLESS")


def start(runs):
    started = {}
    for kind, contact in KINDS.items():
        for initiation in INITIATIONS:
            deck = runs.folder / f"strip{len(started)}.inp"
            deck.write_text(strips.massless_strip(contact, initiation)[0])
            started[kind, initiation] = runs.start(deck)
    return started


def report(started, _):
    rows = []
    for (kind, initiation), future in started.items():
        run = future.result()
        history = run.history
        moments = [np.array([history[name] for name in names.split()]).T for names in ("px py pz", "lx ly lz")]
        rows.append((f"`{kind}`", f"`{initiation}`", size(drift(history["total"])),
                     *(size(np.abs(m - m[0]).max()) for m in moments), size(history["stand_off"].max()),
                     size(history["penetration"].max()), int(history["cuts"].sum())))
    return table(["contact", "first contact", "energy", "momentum", "angular momentum", "stand-off", "penetration",
                  "cuts"], rows)


CHAPTERS = [Chapter("self_contact_space", start, report)]
