"""A disc on a flat slave floor: how far it is pushed sideways, as the floor is refined."""

import plain_scenes
from plain_scenes import AUTO, ONE, slanted
from scene_tools import run_deck

from .common import Chapter, mortar, segment, table

#: Lengths of the floor's edges by those of the disc.
RATIOS = (1.93, 0.97, 0.48, 0.24)
#: Where the disc falls, in edges from a node of the floor.
PLACES = (0.2, 0.6)

NODES = {"formulation": "NODE TO SURFACE"}
#: Slave that the pair names, sides and parameters, by what the table calls them.
KINDS = {
    "`MORTAR`, `DUAL`, `SIDES=ONE`": ("TOP", ONE, mortar("NODAL", "DUAL")),
    "`MORTAR`, `STANDARD`, `SIDES=ONE`": ("TOP", ONE, mortar("NODAL", "STANDARD")),
    "`SEGMENT`, `DUAL`, `SIDES=ONE`": ("TOP", ONE, segment("DUAL")),
    "`NODE TO SURFACE`, `SIDES=ONE`": ("TOP", ONE, NODES),
    "`MORTAR`, `DUAL`": ("TOP", AUTO, mortar("NODAL", "DUAL")),
    "`MORTAR`, `STANDARD`": ("TOP", AUTO, mortar("NODAL", "STANDARD")),
    "`SEGMENT`, `DUAL`": ("TOP", AUTO, segment("DUAL")),
    "`NODE TO SURFACE`": ("TOP", AUTO, NODES),
    "disc named as the slave: `MORTAR`, `DUAL`": ("DISC", ONE, mortar("NODAL", "DUAL")),
    "disc named as the slave: `NODE TO SURFACE`": ("DISC", ONE, NODES),
}


def start(runs):
    started = {}
    for kind, (slave, sides, parameters) in KINDS.items():
        for ratio in RATIOS:
            for place in PLACES:
                runs.count += 1
                scene = plain_scenes.disc_on_floor(ratio, place, slave)
                deck = scene.deck(sides)
                started.setdefault((kind, ratio), []).append(runs.pool.submit(
                    run_deck, deck, runs.folder / f"run{runs.count}", **parameters))
    return started


def report(started, _):
    rows = [(kind, *(f"{max(slanted(f.result()) for f in started[kind, ratio]):.4f}"
                     for ratio in RATIOS)) for kind in KINDS]
    return table(["edges of the slave floor / edges of the disc:", *map(str, RATIOS)], rows)


CHAPTERS = [Chapter("slave_floor", start, report)]
