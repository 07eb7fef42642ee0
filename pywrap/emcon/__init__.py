"""EMCON: conserving dynamics of deformable bodies in contact.

Results of a run, read from Python:

    from emcon import FieldFile, locate, read_history

    paths = locate("ring")
    history = read_history(paths)            # one row per increment; history["total"], ...
    with FieldFile(paths.field) as field:
        u = field.point("displacement", -1)  # (n_node, 3) [L], last frame

A run, step by step:

    from emcon.stepper import Stepper

    with Stepper("ring.inp", h=0.02) as ring:
        while not ring.is_done:
            ring.step()
        print(ring.energies(), ring.momenta())

Single kernels, for tests: `emcon.kernels`. From the shell: `python -m emcon plot ring`, `python -m emcon summary ring`.

Units are those of the deck, any consistent set: length [L], mass [M], time [T].
"""

from __future__ import annotations

import importlib.metadata
import tomllib
from pathlib import Path

from .results import (Bodies, FieldFile, Pairs, ResultError, ResultPaths, energy_drift, locate,
                      read_bodies, read_history, read_pairs)

__all__ = ["Bodies", "FieldFile", "Pairs", "ResultError", "ResultPaths", "__version__",
           "energy_drift", "locate", "read_bodies", "read_history", "read_pairs"]


def _version() -> str:
    """The version in `pyproject.toml`: beside the package in the source tree, else as installed."""
    project = Path(__file__).parents[1]/"pyproject.toml"
    if project.is_file():
        return str(tomllib.loads(project.read_text(encoding="utf-8"))["project"]["version"])
    return importlib.metadata.version("emcon")


__version__ = _version()
