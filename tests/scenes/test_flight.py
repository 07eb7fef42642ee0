"""Free flight of a ring that spins, translates and vibrates: what must not change does not."""

import numpy as np
import pytest
from scene_tools import EPSILON, coarse_spinning_ring, run_deck


@pytest.mark.parametrize(("h", "n"), [(0.001, 1000), (0.01, 300), (0.05, 1000), (0.2, 300), (0.5, 100)])
def test_momenta_and_energy_stay(tmp_path, h, n):
    """`n` increments, from 5000 per turn down to 12, where elements would invert without cuts."""
    t_end = n*h
    history = run_deck(coarse_spinning_ring(), tmp_path, h=h, t_end=t_end, frame=t_end).history
    assert len(history) == n + 1
    for name in ("px", "py", "lz", "total"):
        drift = np.abs(history[name] - history[name][0]).max()
        # Each iteration rounds by an epsilon at random: three standard deviations of their sum.
        assert drift <= 3*np.sqrt(history["newton"].sum())*EPSILON*abs(history[name][0]), name
    # It does vibrate.
    assert history["strain"].max() > 1e-3*history["total"][0]


def test_centre_of_mass_flies_straight(tmp_path):
    """Moment about the origin of a moving body: the centre of mass must move by p t / m."""
    run = run_deck(coarse_spinning_ring(), tmp_path, h=0.02, t_end=2, frame=0.5)
    fields = run.fields()
    mass = run.series("BODIES", "MASS")[1][0, 0]
    p = np.array([run.history["px"][0], run.history["py"][0]])
    centre = []
    for u in fields["displacement"]:
        # Consistent mass: the centre of mass is the mean over the elements at their Gauss points.
        moment, volume = np.zeros(2), 0.0
        for cell in fields.cells:
            m, v = quadrilateral_moment(fields.x[cell], (fields.x + u)[cell])
            moment += m
            volume += v
        centre.append(moment/volume)
    moved = np.array(centre) - centre[0]
    expected = np.outer(fields.time, p/mass)
    np.testing.assert_allclose(moved, expected, rtol=0, atol=1e-12*np.abs(expected).max())


def quadrilateral_moment(x, field):
    """Integral of a nodal field over a four-node element, and its area, by 2 x 2 points."""
    total, area = np.zeros(2), 0.0
    for xi in (-1, 1):
        for eta in (-1, 1):
            r, s = xi/np.sqrt(3), eta/np.sqrt(3)
            n = np.array([(1 - r)*(1 - s), (1 + r)*(1 - s), (1 + r)*(1 + s), (1 - r)*(1 + s)])/4
            dn = np.array(
                [[s - 1, 1 - s, 1 + s, -1 - s], [r - 1, -1 - r, 1 + r, 1 - r]],
            )/4
            weight = np.linalg.det(dn @ x)
            total += weight*(n @ field)
            area += weight
    return total, area
