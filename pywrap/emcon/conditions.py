"""Loads and boundary values, changed and added between steps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from .arguments import labels, number, real_array
from .errors import InputError
from .handle import Handle


class Conditions:
    """Methods of a stepper that change loads and boundary values of the present step of the deck.

    With an amplitude, a value is the factor of the amplitude. Without one, loads of a static step
    change linearly from their present value to the new value at the end of the step; in a dynamic
    step the value acts from the next increment on. Nodes and elements are named by their numbers in
    the deck; in a model of arrays without labels these are row + 1. Methods raise `InputError`, and
    then nothing has changed.
    """

    _handle: Handle
    n_dim: int
    element_labels: np.ndarray
    surface: Callable[[str], np.ndarray]

    def set_point_load(self, node: ArrayLike, dof: ArrayLike, value: ArrayLike) -> None:
        """Give the force on degree of freedom `dof` (1 to n_dim) of `node` a new value [M L/T^2].

        The arguments are numbers or lists, and the present step of the deck must have such a load.
        """
        self._set_loads(_core.EMCON_LOAD_POINT, node, dof, value)

    def set_pressure(self, element: ArrayLike, face: ArrayLike, value: ArrayLike) -> None:
        """Give the pressure on `face` (1 to 4, in space to 6) of `element`, > 0 inwards, a new value [M/(L T^2)].

        The arguments are numbers or lists, and the present step of the deck must have such a load.
        """
        self._set_loads(_core.EMCON_LOAD_PRESSURE, element, face, value)

    def set_surface_pressure(self, surface: str, value: ArrayLike) -> None:
        """Give the pressure on all faces of a surface, or on each, a new value [M/(L T^2)].

        The deck has such a load on each face in the present step.
        """
        self.set_pressure(*self._faces(surface), value)

    def set_gravity(self, element: ArrayLike, value: ArrayLike) -> None:
        """Give the gravity on `element` a new value [L/T^2]; its direction stays.

        The arguments are numbers or lists, and the present step of the deck must have such a load.
        """
        self._set_loads(_core.EMCON_LOAD_GRAVITY, element, 0, value)

    def add_point_load(self, node: ArrayLike, dof: ArrayLike, value: ArrayLike) -> None:
        """Let a force [M L/T^2] act on degree of freedom `dof` (1 to n_dim) of `node` from now on.

        The arguments are numbers or lists. The present step of the deck must not have such a load
        yet. In a static step it grows linearly from 0 to `value` at the end of the step.
        """
        self._add_loads(_core.EMCON_LOAD_POINT, node, dof, value)

    def add_pressure(self, element: ArrayLike, face: ArrayLike, value: ArrayLike) -> None:
        """Let a pressure [M/(L T^2)], > 0 inwards, act on `face` of `element` from now on.

        As `add_point_load`.
        """
        self._add_loads(_core.EMCON_LOAD_PRESSURE, element, face, value)

    def add_surface_pressure(self, surface: str, value: ArrayLike) -> None:
        """Let a pressure [M/(L T^2)], > 0 inwards, act on all faces of a surface from now on.

        As `add_point_load`; a list has a value for each face, in the order of `surface(name)`.
        """
        self.add_pressure(*self._faces(surface), value)

    def _faces(self, surface: str) -> tuple[np.ndarray, np.ndarray]:
        """Labels of elements and numbers of faces of a surface."""
        row, face = self.surface(surface).T
        if not row.size:
            raise InputError(f"surface {surface} has no faces of elements")
        return self.element_labels[row], face

    def add_gravity(self, element: ArrayLike, value: ArrayLike, direction: ArrayLike) -> None:
        """Let gravity [L/T^2] act on `element` from now on, along `direction`, n_dim numbers.

        As `add_point_load`.
        """
        direction = real_array(direction, "the direction", (self.n_dim,))
        self._add_loads(_core.EMCON_LOAD_GRAVITY, element, 0, value,
                        np.concatenate([direction, np.zeros(3 - self.n_dim)]))

    def _add_loads(self, kind: int, label: ArrayLike, place: ArrayLike, value: ArrayLike,
                   direction: ArrayLike = ()) -> None:
        self._handle.change(_core.emcon_add_loads, kind, *_places(label, place, value), direction)

    def _set_loads(self, kind: int, label: ArrayLike, place: ArrayLike, value: ArrayLike) -> None:
        self._handle.change(_set_loads, kind, *(part.tolist() for part in
                                                _places(label, place, value)))

    def prescribe(self, node: int, dof: int, value: float) -> None:
        """Prescribe displacement `dof` (1 to n_dim) of `node` [L], whether it was free before or not.

        A free one has no equation any more: `n_unknown` and `unknowns` change.
        """
        value = number(value, "the value")
        self._handle.change(_core.emcon_prescribe, *_freedom(node, dof), value)

    def release(self, node: int, dof: int) -> None:
        """Release the prescribed displacement `dof` (1 to n_dim) of `node`."""
        self._handle.change(_core.emcon_remove_prescribed, *_freedom(node, dof))


def _places(label: ArrayLike, place: ArrayLike,
            value: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Labels, places and values of loads, of the same number."""
    label = labels(label, "the label")
    place = labels(place, "the place")
    shape = np.shape(value)
    if len(shape) > 1:
        raise InputError(f"the value is to be a number or a list of such, not {shape}")
    value = real_array(value, "the value", shape)
    try:
        label, place, value = np.broadcast_arrays(label, place, value)
    except ValueError as error:
        raise InputError("labels, places and values are to be of the same number") from error
    if not label.size:
        raise InputError("no node or element is named")
    return label.ravel(), place.ravel(), value.ravel()


def _set_loads(address: int, kind: int, labels: list[int], places: list[int],
               values: list[float]) -> int:
    """The status of giving loads new values: none is changed before all are found."""
    loads = []
    for label, place in zip(labels, places):
        status, load = _core.emcon_find_load(address, kind, label, place)
        if status:
            return int(status)
        loads.append(load)
    return max(_core.emcon_set_load(address, load, value) for load, value in zip(loads, values))


def _freedom(node: int, dof: int) -> tuple[int, int]:
    found = []
    for value, name in ((node, "the node"), (dof, "the degree of freedom")):
        array = labels(value, name)
        if np.ndim(value) > 0:
            raise InputError(f"{name} is to be one whole number")
        found.append(int(array[0]))
    return found[0], found[1]
