"""Whether the derivatives that a function gives are those of its values."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .errors import InputError
from .given import Array, GivenPoints, Outside, PointFunction

#: Strains at which the derivatives of a law are checked: of some size, and on no axis.
_PLANE = np.array([[0.03, -0.02, 0.01], [-0.01, 0.05, -0.04], [0.02, 0.01, 0.07],
                   [-0.04, -0.03, 0.02], [0.11, 0.06, -0.09]])
_SPACE = np.column_stack([_PLANE[:, :2], [-0.05, 0.02, 0.04, 0.06, 0.01], _PLANE[:, 2],
                          [0.02, 0.05, -0.03, 0.08, -0.06], [-0.07, 0.03, 0.06, -0.01, 0.04]])


def check_law(law: PointFunction, n_dim: int | None = None) -> None:
    """`check_derivatives` of a strain energy, at small strains where it has no values at others.

    n_dim   None: it has to pass in the plane or in three dimensions
    """
    try:
        _check_at(law, _SPACE if n_dim == 3 else _PLANE)
    except Exception:
        if n_dim is not None or not _is_of_space(law):
            raise


def _is_of_space(law: PointFunction) -> bool:
    try:
        _check_at(law, _SPACE)
    except Exception:  # whatever a law of the plane says to six strains
        return False
    return True


def _check_at(law: PointFunction, strains: Array) -> None:
    for part in (1.0, 0.125, 0.015625):
        try:
            check_derivatives(law, part*strains)
        except Outside:
            continue
        return


def check_derivatives(function: PointFunction, points: ArrayLike, scale: float = 1.0) -> None:
    """Compare the derivatives that `function` gives with differences of what it gives.

    points  (n, m), away from kinks
    scale   size of changes over which the function varies

    Raises `InputError` where a gradient is not that of the energy or a second derivative not that
    of the gradient, by more than differences of second order can tell.
    """
    z = np.asarray(points, dtype=float)
    if z.ndim != 2 or not np.isfinite(z).all():
        raise InputError(f"points are an (n, m) array of finite numbers, not one of {z.shape}")
    given = GivenPoints("the function", function)
    value = given.evaluate(z.copy())
    for array, what in zip(value, ("energy", "gradient", "second derivative")):
        if not np.isfinite(array).all():
            point = int(np.argwhere(~np.isfinite(array))[0, 0])
            raise InputError(f"the {what} at {z[point].tolist()} is infinite or NaN")
    energy, gradient, hessian = (float(np.abs(array).max(initial=0.0)) for array in value)
    # what an energy and a gradient may consist of, before terms cancel
    size = (energy + scale*(gradient + scale*hessian), gradient + scale*hessian)
    step = scale*np.finfo(float).eps**(1/3)
    for k in range(z.shape[1]):
        coarse, fine = (_difference(given, z, k, t*step) for t in (2.0, 1.0))
        for order, derivative in enumerate((value[1][:, k], value[2][:, :, k])):
            noise = 16*np.finfo(float).eps*size[order]/step
            doubt = np.abs(coarse[order] - fine[order]).max(initial=0.0) + noise
            off = np.abs(fine[order] - derivative)
            if not np.all(off <= doubt):
                point = int(np.unravel_index(np.argmax(off), off.shape)[0])
                what, of = (("gradient", "energy"), ("second derivative", "gradient"))[order]
                raise InputError(f"the {what} by variable {k} at {z[point].tolist()} is not the "
                                 f"derivative of the {of}: it is off by {off.max():.3g}, "
                                 f"differences tell it to {doubt:.1g}")


def _difference(given: GivenPoints, z: Array, k: int, step: float) -> tuple[Array, Array]:
    """Central differences of energies (n,) and gradients (n, m) by variable `k`."""
    after, before = z.copy(), z.copy()
    after[:, k] += step
    before[:, k] -= step
    width = after[:, k] - before[:, k]
    (e1, g1, _), (e0, g0, _) = given.evaluate(after), given.evaluate(before)
    return (e1 - e0)/width, (g1 - g0)/width[:, None]
