"""Free bodies that collide and part, and a strip that folds onto itself: what is conserved."""

import numpy as np
from scene_tools import DECKS, run_one_sided

from .common import FORMULATIONS, Chapter, drift, size, table

SCENES = {
    "two_bodies": "two bodies",
    "three_bodies": "three bodies",
    "self_contact": "self-contact",
}
COLUMNS = ("total", "px", "py", "lz")


def start(runs):
    return {
        (scene, name): runs.start(DECKS / f"{scene}.inp", run_one_sided, frame=1,
                                  **(choice | {"sides": "AUTO"}))
        for scene in SCENES
        for name, choice in FORMULATIONS.items()
    }


def report(started, _):
    ended = {key: future.result() for key, future in started.items()}
    done = {key: run.history for key, run in ended.items()}
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
        (name, *(f"{size(max(drifts[scene, name]))}, {touching(done[scene, name])}, "
                 f"{depth(ended[scene, name].verdict['penetration'])}" for scene in SCENES))
        for name in FORMULATIONS
    ]
    return [
        *table(["scene", "increments", "energy", "px", "py", "lz", "Newton", "cuts"], by_scene),
        "",
        *table(["formulation", *SCENES.values()], by_formulation),
    ]


def depth(penetration):
    """0 for what is rounding of positions."""
    return "0" if penetration <= 1e-13 else f"{penetration:.2g}"


def touching(history):
    """Number of increments at whose end something is in contact."""
    return int((history["active"] > 0).sum())


CHAPTERS = [Chapter("free_bodies", start, report)]
