"""EMCON: conserving dynamics of deformable bodies in contact.

Results of a run, read when asked for:

    from emcon import Results, animate, compare, export, plot

    with Results("ring") as ring:
        ring.history["total"]                # (n_row), one row per increment
        u = ring.fields["displacement"]      # (n_frame, n_node, 3) [L]
        u[-1], u.at(2.5), u[:, 12]           # last frame, a time, a node over time
    plot("ring")                             # ring.png
    animate("ring")                          # ring.gif
    export("ring")                           # ring.pvd, for ParaView before 5.12
    print(compare("ring", "other/ring"))     # largest differences

A mesh, and a deck made of it: `emcon.mesh`.

A run, step by step:

    from emcon import Stepper

    with Stepper("ring.inp", h=0.02) as ring:
        ring.run()
        print(ring.energies(), ring.momenta())

Contact and ties for a code with its own solids: `emcon.interface`.

Single kernels, for tests: `emcon.kernels`. From the shell: `python -m emcon plot ring`,
`summary ring`, `animate ring`, `export ring`, `compare ring other/ring`.

Units are those of the deck, any consistent set: length [L], mass [M], time [T].
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .animation import animate
    from .comparison import Comparison, Difference, compare
    from .derivatives import check_derivatives
    from .errors import AnalysisError, InputError
    from .export import export
    from .given import Outside
    from .interface import Interface
    from .model import Model
    from .plotting import plot
    from .results import (Bodies, FieldFile, FieldSeries, HistoryFile, Pairs, ResultError,
                          ResultPaths, Results, Series, energy_drift, locate, read_bodies,
                          read_history, read_pairs)
    from .stepper import Stepper

__all__ = ["AnalysisError", "Bodies", "Comparison", "Difference", "FieldFile", "FieldSeries",
           "HistoryFile", "InputError", "Interface", "Model", "Outside", "Pairs", "ResultError",
           "ResultPaths", "Results", "Series", "Stepper", "__version__", "animate",
           "check_derivatives", "compare", "energy_drift", "export", "get_cmake_dir", "get_include",
           "get_library", "locate", "mesh", "plot", "read_bodies", "read_history", "read_pairs"]

#: The names of the package by module, imported when first used: matplotlib and HDF5 take long to
#: load, and results are read without the compiled extension.
_PLACES = {
    "animation": "animate",
    "comparison": "Comparison Difference compare",
    "derivatives": "check_derivatives",
    "errors": "AnalysisError InputError",
    "export": "export",
    "given": "Outside",
    "interface": "Interface",
    "model": "Model",
    "plotting": "plot",
    "results": "Bodies FieldFile FieldSeries HistoryFile Pairs ResultError ResultPaths Results "
               "Series energy_drift locate read_bodies read_history read_pairs",
    "stepper": "Stepper",
}
_LATE = {name: module for module, names in _PLACES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        found: Any = _version()
    elif name == "mesh":
        found = importlib.import_module(".mesh", __name__)
    elif name not in _LATE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    else:
        try:
            found = getattr(importlib.import_module(f".{_LATE[name]}", __name__), name)
        except AttributeError as error:
            raise ImportError(f"{error}: the compiled extension is not of this version of the "
                              "package; make pywrap, or pip install of its source, makes it anew"
                              ) from error
    globals()[name] = found
    return found


def get_include() -> str:
    """The folder of `emcon.h` and `emcon.hpp`, for programs that embed the library."""
    return str(Path(__file__).parent/"include")


def get_library() -> str:
    """The shared library, to be linked with by this path and found by it when the program runs."""
    (library,) = Path(__file__).parent.glob("libemcon.so.*")
    return str(library)


def get_cmake_dir() -> str:
    """What CMake is to be told as `emcon_DIR`, so that find_package(emcon) finds the library."""
    return str(Path(__file__).parent/"cmake")


def __dir__() -> list[str]:
    """What the package offers, and what Python asks of modules."""
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})


def _version() -> str:
    """The version in `pyproject.toml`: above the package in the source tree, else as installed."""
    import importlib.metadata
    import tomllib
    project = Path(__file__).parents[2]/"pyproject.toml"
    if Path(__file__).parents[1].name == "pywrap" and project.is_file():
        return str(tomllib.loads(project.read_text(encoding="utf-8"))["project"]["version"])
    return importlib.metadata.version("emcon")

