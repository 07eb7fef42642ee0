"""The ball's law of the book: displacements of a sphere under known stresses, and its limit."""

import sys

import numpy as np
import pytest
from scene_tools import ROOT

sys.path.append(str(ROOT/"tests"/"bench"))
from book import ball_law  # noqa: E402

NU = 0.3


def test_known_stresses_of_a_ball():
    """All-round tension, a pull along the axis, and the same acceleration of all of the ball."""
    unit = np.eye(4)
    out, along = ball_law.response(unit[0], 0*unit[0], NU)
    assert out == pytest.approx((1 - 2*NU)*unit[0]) and along == pytest.approx(0*unit[0])
    out, along = ball_law.response(unit[0]/3 + 2/3*unit[2], unit[2]/3, NU)
    assert out == pytest.approx(((1 + NU)/3 - NU)*unit[0] + 2/3*(1 + NU)*unit[2])
    assert along == pytest.approx((1 + NU)/3*unit[2])
    # a uniform acceleration leaves the centre of mass where it is
    out, along = ball_law.response(unit[1], 0*unit[1], NU)
    lame, shear = NU/((1 + NU)*(1 - 2*NU)), 0.5/(1 + NU)
    part = 1/(6*lame + 4*shear)
    assert (out[1], along[1]) == pytest.approx((1.2*part, -0.8*part))


def test_half_space_is_the_limit():
    """Hertz's pressure has the energy 0.3 F^2/(E* a) on a half space, and 0.2 a^2 of mean gap."""
    near, far = ((ball_law.energies(a, NU, 1)[0]*a/(1 - NU*NU), ball_law.energies(a, NU, 1)[1]/a**2)
                 for a in (0.05, 0.1))
    assert 2*near[0] - far[0] == pytest.approx(0.3, rel=5e-3)      # a log a is left
    assert near[1] == pytest.approx(0.2, rel=5e-4)
    assert ball_law.stiffer(1e-3, NU) > 1 > ball_law.impact(1e-5, NU)[0]
