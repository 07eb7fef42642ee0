"""Statics without contact: patch test under pressure, cantilever."""

import math
import re

import numpy as np
from scene_tools import DECKS, Deck

from .common import Chapter, size, table, with_print


def start_patch(runs):
    cards = "*EL PRINT, ELSET=BODY\nS\n"
    deck = Deck.read(DECKS / "patch_pressure.inp")
    body = re.search(r"\*SOLID SECTION, ELSET=(\w+)", deck.text())[1]
    return runs.start(with_print(deck, cards.replace("BODY", body)))


def patch(started, _):
    run = started.result()
    place = run.fields()["cauchy_stress"][-1]
    error = np.abs(place - np.array([0, -10, -3, 0, 0, 0])).max()/10
    corner = np.abs(run.fields()["displacement"][-1]).max(axis=0)
    return table(
        ["largest error of stress / 10", "corner, ux", "uy", "strain energy"],
        [
            (
                size(error),
                f"0.0078 {corner[0] - 0.0078:+.0e}",
                f"-0.0182 {0.0182 - corner[1]:+.0e}",
                f"0.182 {run.history['strain'][-1] - 0.182:+.0e}",
            )
        ],
    )


def start_cantilever(runs):
    return {
        mesh: runs.start(runs.generated("cantilever", "--beam", mesh))
        for mesh in ("40x2", "80x4", "160x8", "320x16")
    }


def cantilever(started, _):
    tips = {}
    for mesh, future in started.items():
        fields = future.result().fields()
        middle = np.argmin(np.abs(fields.x - [10.0, 0.0]).sum(axis=1))
        tips[mesh] = fields["displacement"][-1, middle]
    meshes = list(tips)
    limit = tips[meshes[-1]] + (tips[meshes[-1]] - tips[meshes[-2]])/3
    rows, last = [], None
    for mesh in meshes:
        error = np.abs(tips[mesh][1] - limit[1])
        order = f"{math.log2(last/error):.2f}" if last else ""
        tip = (f"{v:.5f}" for v in tips[mesh])
        rows.append((mesh.replace("x", " x "), *tip, size(error), order))
        last = error
    rows.append(("extrapolated", *(f"{v:.5f}" for v in limit), "", ""))
    rows.append(("elastica (no shear, no stretch)", "-0.5643", "-3.0172", "", ""))
    return table(["mesh", "ux of the tip", "uy", "error of uy", "order"], rows)


CHAPTERS = [
    Chapter("patch", start_patch, patch),
    Chapter("cantilever", start_cantilever, cantilever),
]
