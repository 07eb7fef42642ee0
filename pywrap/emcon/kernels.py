"""Single kernels of the library, for tests and for trying things out. Needs the extension."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .options import LAWS

__all__ = ["LAWS", "Gap", "LawResponse", "law_response", "nts_gap"]


@dataclass(frozen=True)
class LawResponse:
    """Strain energy density at the end of a step, algorithmic stress (3,), its tangent (3, 3)."""

    energy: float
    stress: NDArray[np.float64]
    tangent: NDArray[np.float64]


def law_response(law: str, constants: ArrayLike, strain: ArrayLike,
                 dstrain: ArrayLike = (0.0, 0.0, 0.0)) -> LawResponse:
    """Response of `law` to a Green-Lagrange strain that goes from `strain` to `strain + dstrain`.

    Components 11, 22, 2*12; plane strain. The stress S satisfies S.dstrain = W1 - W0 exactly and
    is the stress itself for dstrain = 0. Raises `ValueError` for an unknown law and for
    constants that it refuses.
    """
    if law not in LAWS:
        raise ValueError(f"there is no law '{law}'; known: {', '.join(LAWS)}")
    status, energy, stress, tangent = _core.emcon_law_response(LAWS[law].code, constants, strain,
                                                               dstrain)
    if status:
        raise ValueError(f"the law '{law}' ({', '.join(LAWS[law].constants)}) refuses {constants}")
    return LawResponse(float(energy), stress, tangent)


@dataclass(frozen=True)
class Gap:
    """Gap of a slave node at the start and end of a step, with derivatives by 10 coordinates.

    `g` is the discrete gradient (g.dx = dgap), `c` the gradient at the end, `h[i, j]` the
    derivative of g[i] by end coordinate j. Coordinates: x, y of slave, edge start, edge end, node
    before, node after.
    """

    start: float
    end: float
    dgap: float
    g: NDArray[np.float64]
    c: NDArray[np.float64]
    h: NDArray[np.float64]


def nts_gap(x0: ArrayLike, dx: ArrayLike, *, before: bool = True, after: bool = True,
            rounding: float = 0.0) -> Gap:
    """Gap over a master edge and its neighbours [L].

    `x0` (5, 2) positions at the start, `dx` (5, 2) their motion; rows: slave, edge start, edge
    end, node before and after the edge (not read unless `before`, `after`). `rounding` [L] is the
    length over which corners are rounded.
    """
    x0, dx = (np.asarray(a, dtype=float) for a in (x0, dx))
    if x0.shape != (5, 2) or dx.shape != (5, 2):
        raise ValueError(f"x0 and dx are (5, 2) arrays, not {x0.shape} and {dx.shape}")
    _, gap, g, c, h = _core.emcon_node_gap(x0, dx, int(before), int(after), rounding)
    return Gap(float(gap[0]), float(gap[1]), float(gap[2]), g, c, h)
