"""Mortar contact in space as other codes have it, by nothing of EMCON: eight-node bricks of the law of St. Venant and
Kirchhoff, one face that is pressed down on the faces of a block, without friction.

The face is a square about the axis of the block, turned about it by some angle at which both are symmetric; its corners
then move alike, and of its weighted gaps one is left, the integral G of the gap over it. The pressure p is uniform. Forces
are p times

- the integrals of the shape functions of both sides, along the axis: what other codes take (`plain`);
- the gradient of G, which does the work that the gap takes: what EMCON takes (`conserving`). It differs where the gap,
  closed in the mean, is open and closed in parts: under a face that is coarser than those below.

Cells of the block are clipped by the face, and integrated by triangles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

CORNERS = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])
#: Barycentric coordinates and weights of seven points, exact for polynomials of degree five.
POINTS = np.array([(1/3, 1/3, 0.225)] + [
    (*place, weight) for a, weight in ((0.05971587178976982, 0.1323941527885062), (0.7974269853530873, 0.1259391805448271))
    for b in [(1 - a)/2] for place in ((a, b), (b, a), (b, b))])
#: Of the residual, over the forces.
SOLVED = 1.0e-11


@dataclass
class Scene:
    """Two bodies of one law."""

    x: np.ndarray            #: (n, 3), places at rest
    brick: np.ndarray        #: (m, 8), nodes from 0
    is_given: np.ndarray     #: (n,), nodes whose displacements are prescribed
    u: np.ndarray            #: (n, 3), these displacements, zero elsewhere
    face: np.ndarray         #: (4,), nodes of the face that presses, counter-clockwise seen from above
    below: np.ndarray        #: (k, 4), nodes of the faces below it, counter-clockwise seen from above
    modulus: float
    poisson: float


def solid(scene: Scene, u: np.ndarray) -> tuple[np.ndarray, sparse.csr_array]:
    """Forces (n, 3) and their derivatives."""
    mu = 0.5*scene.modulus/(1 + scene.poisson)
    lame = 2*mu*scene.poisson/(1 - 2*scene.poisson)
    x, ue, one = scene.x[scene.brick], u[scene.brick], np.eye(3)
    force, k = np.zeros_like(x), np.zeros((len(x), 8, 3, 8, 3))
    for point in CORNERS/np.sqrt(3.0):
        part = 1 + CORNERS*point
        slope = np.stack([CORNERS[:, i]*part[:, i - 2]*part[:, i - 1] for i in range(3)], axis=1)/8
        jacobian = np.einsum("eai,aj->eij", x, slope)
        volume = np.linalg.det(jacobian)
        b = np.einsum("aj,eji->eai", slope, np.linalg.inv(jacobian))
        f = one + np.einsum("eai,eaj->eij", ue, b)
        strain = 0.5*(np.einsum("eki,ekj->eij", f, f) - one)
        stress = lame*np.trace(strain, axis1=1, axis2=2)[:, None, None]*one + 2*mu*strain
        force += volume[:, None, None]*np.einsum("eij,ejk,eak->eai", f, stress, b)
        by = np.einsum("eaj,eik->eaijk", b, f)
        by = 0.5*(by + by.swapaxes(3, 4))                       # of the strain, by a displacement
        trace = np.einsum("eaijj->eai", by)
        here = lame*np.einsum("eai,ebj->eaibj", trace, trace) + 2*mu*np.einsum("eaikl,ebjkl->eaibj", by, by)
        here += np.einsum("eaj,ejk,ebk,il->eaibl", b, stress, b, one)
        k += volume[:, None, None, None, None]*here
    total = np.zeros_like(scene.x)
    np.add.at(total, scene.brick, force)
    freedom = (3*scene.brick[:, :, None] + np.arange(3)).reshape(len(x), 24)
    where = np.repeat(freedom, 24, axis=1).ravel(), np.tile(freedom, (1, 24)).ravel()
    return total, sparse.coo_array((k.ravel(), where), shape=(total.size, total.size)).tocsr()


def clipped(polygon: list[np.ndarray], quad: np.ndarray) -> list[np.ndarray]:
    """What of a convex polygon is in a convex quad, both counter-clockwise."""
    for first, last in zip(np.roll(quad, 1, axis=0), quad, strict=True):
        d = last - first
        side = [d[0]*(p[1] - first[1]) - d[1]*(p[0] - first[0]) for p in polygon]
        kept = []
        for i in range(len(polygon)):
            if side[i - 1]*side[i] < 0.0:
                kept.append(polygon[i - 1] + (polygon[i] - polygon[i - 1])*side[i - 1]/(side[i - 1] - side[i]))
            if side[i] >= 0.0:
                kept.append(polygon[i])
        polygon = kept
        if len(polygon) < 3:
            return []
    return polygon


def shapes(quad: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shape functions (q, 4) of quads (q, 4, 2) at points (q, 2) in the plane, and their slopes there (q, 4, 2)."""
    corner, r = CORNERS[:4, :2], np.zeros_like(p)
    for _ in range(8):                                          # Newton's method: quads are almost squares
        e = 1 + corner*r[:, None]
        n, slope = e.prod(axis=2)/4, corner*e[:, :, ::-1]/4
        jacobian = np.einsum("qai,qaj->qij", quad, slope)
        r = r - np.linalg.solve(jacobian, (np.einsum("qa,qai->qi", n, quad) - p)[:, :, None])[:, :, 0]
    return n, np.einsum("qaj,qji->qai", slope, np.linalg.inv(jacobian))


def contact(scene: Scene, u: np.ndarray, is_conserving: bool) -> tuple[float, np.ndarray]:
    """The integral of the gap over the face, and what a uniform pressure of 1 presses with (n, 3)."""
    x = scene.x + u
    own = x[scene.face, :2]
    points, cell, weight = [], [], []
    for nodes in scene.below:
        polygon = clipped(list(own), x[nodes, :2])
        for i in range(2, len(polygon)):
            a, b = polygon[i - 1] - polygon[0], polygon[i] - polygon[0]
            points.append(polygon[0] + POINTS[:, :1]*a + POINTS[:, 1:2]*b)
            weight.append(0.5*(a[0]*b[1] - a[1]*b[0])*POINTS[:, 2])
            cell.append(np.tile(nodes, (len(POINTS), 1)))
    p, cell, weight = (np.concatenate(each) for each in (points, cell, weight))
    n, slope = shapes(x[cell, :2], p)
    own_n, own_slope = shapes(np.broadcast_to(own, (len(p), 4, 2)), p)
    gap = own_n @ x[scene.face, 2] - np.einsum("qa,qa->q", n, x[cell, 2])
    force = np.zeros_like(x)
    force[scene.face, 2] = weight @ own_n
    np.add.at(force[:, 2], cell, -n*weight[:, None])
    if is_conserving:
        tilt = np.einsum("qai,qa->qi", slope, x[cell, 2])*weight[:, None]
        for i in range(2):
            np.add.at(force[:, i], cell, n*tilt[:, i:i + 1])
            force[scene.face, i] += (gap*weight) @ own_slope[:, :, i] - tilt[:, i] @ own_n
    return gap @ weight, force


def pressed(scene: Scene, is_conserving: bool) -> np.ndarray:
    """Displacements (n, 3) in equilibrium with the gap closed in the mean; Newton's method, with contact's own derivatives
    left out."""
    u, pressure, free = scene.u.copy(), 0.0, np.repeat(~scene.is_given, 3)
    for _ in range(40):
        force, k = solid(scene, u)
        gap, push = contact(scene, u, is_conserving)
        push = push.ravel()[free]
        off = force.ravel()[free] - pressure*push
        if np.abs(off).max() <= SOLVED*np.abs(force).max():
            return u
        factors = splu(k[free][:, free].tocsc())
        y, z = factors.solve(off), factors.solve(push)
        change = (push @ y - gap)/(push @ z)
        v = u.ravel()
        v[free] += change*z - y
        pressure += change
    raise AssertionError(f"no equilibrium: {np.abs(off).max()} of {np.abs(force).max()}")
