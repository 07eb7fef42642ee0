"""Free bodies that collide and part, and a strip that folds onto itself: what is conserved."""

import numpy as np
from scene_tools import DECKS

from .common import FORMULATIONS, Chapter, drift, size, table

SCENES = {
    "two_bodies": "two bodies",
    "three_bodies": "three bodies",
    "self_contact": "self-contact",
}
COLUMNS = ("total", "px", "py", "lz")


def start(runs):
    return {
        (scene, name): runs.start(DECKS / f"{scene}.inp", frame=1, **choice)
        for scene in SCENES
        for name, choice in FORMULATIONS.items()
    }


def report(started, _):
    done = {key: future.result().history for key, future in started.items()}
    drifts = {key: [drift(h[column]) for column in COLUMNS] for key, h in done.items()}
    by_scene = []
    for scene, title in SCENES.items():
        runs = [done[scene, name] for name in FORMULATIONS]
        worst = np.max([drifts[scene, name] for name in FORMULATIONS], axis=0)
        newton = [h["newton"][1:].mean() for h in runs]
        by_scene.append(
            (
                title,
                len(runs[0]) - 1,
                *map(size, worst),
                f"{min(newton):.1f} to {max(newton):.1f}",
                int(sum(h["cuts"].sum() for h in runs)),
            )
        )
    by_formulation = [
        (name, *(f"{size(max(drifts[scene, name]))}, {touching(done[scene, name])}"
                 for scene in SCENES))
        for name in FORMULATIONS
    ]
    return [
        *table(["scene", "increments", "energy", "px", "py", "lz", "Newton", "cuts"], by_scene),
        "",
        *table(["formulation", *SCENES.values()], by_formulation),
    ]


def touching(history):
    """Number of increments at whose end something is in contact."""
    return int((history["active"] > 0).sum())


CHAPTERS = [Chapter("free_bodies", start, report)]
