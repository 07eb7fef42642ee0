"""Rigid polygons that are thrown along a floor or down a slope: they slide, then roll.

Of many corners they stay polygons, as SIDES=BOTH is asked. The floor lies along x; on a slope gravity
leans. What a run is judged by is read from its field file.
"""

import dataclasses
import math

import numpy as np
from scene_tools import Deck, number

RADIUS, SPEED, GRAVITY = 0.5, 1.0, 10.0
#: The wheel is turned by so much: no side lies on the floor, and no corner right below the middle.
TURN = 1e-3


def on_floor(place, mu):
    """The model of a rigid polygon, from its middle and its corners, over a rigid floor that is held."""
    sides = len(place) - 1
    nodes = "".join(f"{k}, {number(x)}, {number(y)}\n" for k, (x, y) in enumerate(place, 1))
    wedges = "".join(f"{k}, 1, {k + 1}, {k % sides + 2}\n" for k in range(1, sides + 1))
    return f"""*NODE
{nodes}1001, -4., -1.
1002, 20., -1.
1003, 20., 0.
1004, -4., 0.
*ELEMENT, TYPE=CPE3, ELSET=P
{wedges}*ELEMENT, TYPE=CPE4, ELSET=F
1001, 1001, 1002, 1003, 1004
*MATERIAL, NAME=M
*HYPERELASTIC, COUPLED NEO HOOKE
1e4, .3
*DENSITY
1.
*SOLID SECTION, ELSET=P, MATERIAL=M
*SOLID SECTION, ELSET=F, MATERIAL=M
*SURFACE, NAME=SP
P
*SURFACE, NAME=SF
1001, S3
*RIGID BODY, ELSET=P, REF NODE=1
*RIGID BODY, ELSET=F, REF NODE=1001
*SURFACE INTERACTION, NAME=I
*FRICTION
{mu!r}
*CONTACT PAIR, INTERACTION=I, TYPE=NODE TO SURFACE, SIDES=BOTH
SP, SF
*BOUNDARY
1001, 1, 2
1001, 6, 6
"""


@dataclasses.dataclass(frozen=True)
class Wheel:
    """A regular polygon of density 1, thrown without spin along a surface that falls by `slope`
    degrees; one corner touches."""

    sides: int
    slope: float
    mu: float
    h: float
    duration: float = 1.5

    @property
    def name(self):
        return f"wheel_{self.sides}_{self.slope:g}_{self.mu:g}_{self.h:g}"

    @property
    def gravity(self):
        turn = math.radians(self.slope)
        return GRAVITY*np.array([math.sin(turn), -math.cos(turn)])

    @property
    def mass(self):
        return 0.5*self.sides*RADIUS**2*math.sin(2*math.pi/self.sides)

    @property
    def gyration(self):
        """The squared radius of gyration about the middle."""
        return RADIUS**2*(2 + math.cos(2*math.pi/self.sides))/6

    def places(self):
        """The middle and the corners at the start."""
        angle = math.pi/2 + TURN + 2*math.pi*np.arange(self.sides)/self.sides
        corner = RADIUS*np.stack([np.cos(angle), np.sin(angle)], 1)
        return np.vstack([[0.0, 0.0], corner]) - [0.0, corner[:, 1].min()]

    def deck(self):
        place = self.places()
        along = self.gravity/GRAVITY
        return Deck(on_floor(place, self.mu) + f"""*INITIAL CONDITIONS, TYPE=VELOCITY
1, 1, {SPEED!r}
*STEP, NLGEOM, INC=100000
*DYNAMIC, DIRECT
{self.h!r}, {self.duration!r}
*DLOAD
P, GRAV, {GRAVITY!r}, {number(along[0])}, {number(along[1])}
*NODE FILE, FREQUENCY=1
U, V, VR
*CONTACT FILE, FREQUENCY=1
CF
*END STEP
""", self.name)

    def disc(self, time):
        """Way and speed of a disc of this radius of gyration: it slides until it rolls."""
        pull, push = self.gravity[0], -self.mu*self.gravity[1]
        lever = self.gyration/RADIUS**2
        # The contact point slows down by pull - push - push/lever until it stands.
        end = SPEED/(push*(1 + 1/lever) - pull)
        slides, rolls = np.minimum(time, end), np.maximum(time - end, 0.0)
        v = SPEED + (pull - push)*slides
        return (SPEED*slides + 0.5*(pull - push)*slides**2 + v*rolls
                + 0.5*pull/(1 + lever)*rolls**2, v + pull/(1 + lever)*rolls)


@dataclasses.dataclass(frozen=True)
class Findings:
    """What fields say of a run: what does not close, each over its own scale, and how far it went."""

    overlap: float                     #: of a corner below the floor, over the radius
    momentum: float                    #: forces and weight against momentum and its moment
    energy: float                      #: friction and weight against kinetic energy
    law: float                         #: by how much friction misses its law, over the largest force
    time: np.ndarray
    way: np.ndarray                    #: of the middle along the floor


def products(wheel, a, b):
    """Sums over the wheel of the products of two linear fields: (n_frame, n_node, n_component)."""
    third, fourth = np.roll(a[:, 1:], -1, axis=1), np.roll(b[:, 1:], -1, axis=1)
    first = [np.broadcast_to(f[:, :1], f[:, 1:].shape) for f in (a, b)]
    of_a, of_b = (first[0], a[:, 1:], third), (first[1], b[:, 1:], fourth)
    whole = sum(of_a)[..., :, None]*sum(of_b)[..., None, :]
    whole = whole + sum(p[..., :, None]*q[..., None, :] for p, q in zip(of_a, of_b))
    return whole.sum(axis=1)*wheel.mass/wheel.sides/12


def judge(wheel, run):
    """Look at the positions, velocities and forces of all frames.

    Where an increment was cut its forces are those of its last part: balances and the law are not
    looked at in these.
    """
    fields, whole = run.fields(), run.history["cuts"][1:] == 0
    n = wheel.sides + 1
    x, v = (fields.x + fields["displacement"])[:, :n], fields["velocity"][:, :n]
    force = fields["contact_force"][1:, 1:n]
    h = np.diff(fields.time)
    slip = np.diff(x[:, 1:, 0], axis=0)
    # Momentum and moment of momentum about the middle of the floor.
    flux, mean = products(wheel, x, v), 0.5*(x[:-1] + x[1:])
    one = products(wheel, np.ones_like(x[..., :1]), v)[:, 0]
    weight = wheel.mass*wheel.gravity
    kick = np.diff(one, axis=0) - h[:, None]*(force.sum(axis=1) + weight)
    turn = np.diff(flux[:, 0, 1] - flux[:, 1, 0]) - h*(
        moment(mean[:, 1:], force).sum(axis=1) + moment(mean[:, 0], weight))
    kinetic = 0.5*np.trace(products(wheel, v, v), axis1=1, axis2=2)
    gain = np.diff(kinetic) - np.diff(x[:, 0], axis=0) @ weight - (force[..., 0]*slip).sum(axis=1)
    missed = law_missed(wheel.mu, force, slip, 0.5*h[:, None]*v[:-1, 1:, 0])
    impulse = np.abs(one).max()
    return Findings(
        overlap=max(0.0, -x[:, 1:, 1].min())/RADIUS,
        momentum=max(np.abs(kick[whole]).max(), np.abs(turn[whole]).max()/np.abs(x).max())/impulse,
        energy=np.abs(gain[whole]).max()/kinetic.max(),
        law=missed[whole].max()/np.abs(force).max(),
        time=fields.time, way=x[:, 0, 0] - x[0, 0, 0])


def moment(place, force):
    return place[..., 0]*force[..., 1] - place[..., 1]*force[..., 0]


def law_missed(mu, force, slip, stop):
    """The distance of each force from what (14m) of theory.md allows: `stop` is the slip with which a
    corner ends at rest; between no slip and that one there is no friction."""
    normal, friction = force[..., 1], -force[..., 0]
    low, high = np.minimum(stop, 0.0), np.maximum(stop, 0.0)
    bound = mu*np.maximum(normal, 0.0)
    # A slip is the difference of two places: at an end where it is nearer than their rounding.
    near = 64*np.finfo(float).eps*(RADIUS + np.abs(slip).max())
    most = np.where(slip > high - near, bound, np.where(slip > low - near, 0.0, -bound))
    least = np.where(slip < low + near, -bound, np.where(slip < high + near, 0.0, bound))
    missed = np.maximum(friction - most, least - friction)
    return np.maximum(np.maximum(missed, -normal), 0.0)
