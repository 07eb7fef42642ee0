"""The scene of blocks.cpp and host_77.f with linear elements of the library: a block lands on a plate and rubs over it."""

from __future__ import annotations

from itertools import product

import numpy as np

from emcon import Model


def landing(kind: str, friction: float) -> Model:
    n, size, lame = 3, [1/3, 1/3, 0.4], (60.0, 40.0)
    plate = [(x, y, z) for z in (-1, 0) for x, y in ((-2, -2), (2, -2), (2, 2), (-2, 2))]
    x = np.array(list(product(range(n + 1), range(n + 1), range(2))))*size - [0.5, 0.5, -0.02]
    corners = [(a, b, k) for k in range(2) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
    cells = [[8 + ((i + a)*(n + 1) + j + b)*2 + k for a, b, k in corners] for i, j in product(range(n), repeat=2)]
    model = Model.from_arrays(np.concatenate([plate, x]), {"C3D8": [list(range(8)), *cells]})
    lam, mu = lame
    model.material("M", density=1.0, elastic=(mu*(3*lam + 2*mu)/(lam + mu), lam/(2*(lam + mu)))).section("M")
    model.surface("PLATE", faces=[(0, 2)])
    model.surface("SOLE", faces=[(k, 1) for k in range(1, 10)])
    model.interaction("I", **({"friction": friction} if friction else {}))
    model.contact_pair("SOLE", "PLATE", interaction="I", edges="NO", guard="NO", sides="ONE", type=kind)
    model.boundary(list(range(8)), [1, 2, 3])
    for k, place in enumerate(x, 8):
        model.initial("VELOCITY", [k], [1, 2, 3], [0.8, 0.3 + 0.4*place[0], -0.5 + 0.2*place[1]])
    model.step("DYNAMIC", h=0.02, duration=0.24, nlgeom=False, direct=True)
    return model
