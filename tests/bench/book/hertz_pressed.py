"""A ball is pressed on a rigid plane and on another ball: Hertz in statics, over the mesh."""

import sys

import numpy as np
from scene_tools import DECKS

from . import ball_law
from .common import Chapter, order, table

sys.path.append(str(DECKS))
import make_pressed_ball as ball  # noqa: E402

CELLS = (3, 4, 6)
#: Of `make_pressed_ball.py`, by their names.
SCENES = {"ball on plane": ["--plane"], "ball on ball": [], "ball on ball, `MORTAR`": ["--mortar"]}


def errors(run, pair):
    """Of the radius of the contact and the largest pressure for the force found, of that force by half spaces
    and by balls.

    The radius is that of Hertz's pressure with the same second moment, 2/5 of its square.
    """
    fields = run.fields()
    upper = fields.x[:, 2] > 0
    force = fields["contact_force"][-1][upper, 2]
    square = (fields.x[upper, :2]**2).sum(axis=1)
    total, radius = 4*force.sum(), np.sqrt(2.5*(force*square).sum()/force.sum())
    half = 0.5 if pair else 1.0
    curve, stiffness = half*ball.RADIUS, half*ball.STIFFNESS
    hertz = (0.75*total*curve/stiffness)**(1/3)
    pushed = 4/3*stiffness*ball.CONTACT**3/curve
    own = ball_law.stiffer((ball.CONTACT/ball.RADIUS)**2, ball.POISSON)
    return radius/hertz - 1, (hertz/radius)**2 - 1, total/pushed - 1, total/(pushed*own) - 1


def pressure_error(run):
    """Of the pressure of mortar in the middle of two balls, for the force found.

    Pressures are over the areas at the start of the last increment, when the bodies had come nearer by 3/4 of what they
    are at the end. The middle is drawn together there, by (1 + nu) (1 - 2 nu) over E of the pressure.
    """
    fields = run.fields()
    upper = fields.x[:, 2] > 0
    total, curve, stiffness = 4*fields["contact_force"][-1][upper, 2].sum(), 0.5*ball.RADIUS, 0.5*ball.STIFFNESS
    expected = 1.5*total/(np.pi*(0.75*total*curve/stiffness)**(2/3))
    drawn = (1 + ball.POISSON)*(1 - 2*ball.POISSON)*np.sqrt(0.75)*expected/ball.MODULUS
    middle = upper & (np.hypot(fields.x[:, 0], fields.x[:, 1]) == 0)
    return np.nanmax(np.asarray(fields["contact_pressure"][-1]).ravel()[middle])*(1 - drawn)/expected - 1


def start(runs):
    return {(name, cells): runs.start(runs.generated("pressed_ball", "--cells", cells, *options), timeout=1800)
            for name, options in SCENES.items() for cells in CELLS}


def report(started, _):
    rows = []
    for name, options in SCENES.items():
        results = [started[name, cells].result() for cells in CELLS]
        found = np.array([errors(run, "--plane" not in options) for run in results])
        what = ["radius", "largest pressure", "force by the approach", "the same, by the ball's law"]
        if "--mortar" in options:
            found = np.hstack([found, [[pressure_error(run)] for run in results]])
            what.append("pressure in the middle")
        for k, word in enumerate(what):
            rows.append(("" if k else name, word, *(f"{100*e:+.2f} %" for e in found[:, k]),
                         f"{order([1/n for n in CELLS], found[:, k]):.1f}"))
    return table(["", "error of", *(f"a/{n}" for n in CELLS), "order"], rows)


CHAPTERS = [Chapter("hertz_pressed", start, report)]
