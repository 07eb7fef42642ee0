"""Schemes of time integration, each against its closed form, its order, and what it keeps."""

import itertools
import re

import numpy as np
import pytest
from emcon import Stepper
from scene_tools import DECKS

EPS = np.finfo(float).eps
ALPHA = "GENERALIZED ALPHA"
#: With contact at the end of the step, none of which keeps the energy of nonlinear bodies.
BACK = ["TRAPEZOIDAL", ALPHA, f"{ALPHA}, ALPHA=-0.3", f"{ALPHA}, SPECTRAL RADIUS=0.",
        f"{ALPHA}, SPECTRAL RADIUS=0.8", "BDF2"]
DECAY = "ENERGY DECAYING"
#: Angular momentum stays with these.
TURNING = ["MIDPOINT", DECAY, f"{DECAY}, DISSIPATION=1."]
SCHEMES = [*TURNING, *BACK]
OMEGA = 3.0


def oscillator(h, n, scheme, mass=1.0, length=1.0, time=1.0):
    """One element on rollers, fixed on the left: k = E, m = rho/3, omega = 3; in other units."""
    return f"""*NODE, NSET=ALL
1, 0., 0.
2, 0., {length!r}
3, {length!r}, 0.
4, {length!r}, {length!r}
*NSET, NSET=RIGHT
3, 4
*ELEMENT, TYPE=CPE4, ELSET=BAR
1, 1, 3, 4, 2
*MATERIAL, NAME=LINEAR
*ELASTIC
{3.0*mass/length/time**2!r}, 0.
*DENSITY
{mass/length**3!r}
*SOLID SECTION, ELSET=BAR, MATERIAL=LINEAR
*BOUNDARY
1, 1
2, 1
ALL, 2
*INITIAL CONDITIONS, TYPE=VELOCITY
RIGHT, 1, {length/time!r}
*STEP
*DYNAMIC, DIRECT
{h*time!r}, {n*h*time!r}
*TIME INTEGRATION, SCHEME={scheme}
*END STEP
"""


#: Of the nodes of the square below: it spins and is stretched, or is stretched alone.
SPIN = "1, 1, -1.\n3, 1, 1.5\n3, 2, 2."
STRETCH = "1, 1, -1.\n1, 2, -1.\n3, 1, 1.\n3, 2, 1."


def flight(h, scheme, section="", velocity=SPIN):
    """A square that flies and vibrates, with large strains."""
    return f"""*NODE
1, 0., 0.
2, 1., 0.
3, 1., 1.
4, 0., 1.
*ELEMENT, TYPE=CPE4, ELSET=BLOCK
1, 1, 2, 3, 4
*MATERIAL, NAME=RUBBER
*ELASTIC
20., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=BLOCK, MATERIAL=RUBBER{section}
*INITIAL CONDITIONS, TYPE=VELOCITY
{velocity}
*STEP, NLGEOM
*DYNAMIC, DIRECT
{h!r}, 1.
*TIME INTEGRATION, SCHEME={scheme}
*END STEP
"""


#: A block that flies to a wall, is stopped by contact, and flies back.
IMPACT = """*NODE, NSET=ALL
1, 1.1, -1.
2, 1.1, 2.
3, 1.4, -1.
4, 1.4, 2.
5, 0., 0.
6, 1., 0.
7, 0., 1.
8, 1., 1.
*NSET, NSET=WALL, GENERATE
1, 4
*ELEMENT, TYPE=CPE4, ELSET=FIXED
1, 1, 3, 4, 2
*ELEMENT, TYPE=CPE4, ELSET=BLOCK
2, 5, 6, 8, 7
*SURFACE, NAME=FACE
BLOCK, S2
*SURFACE, NAME=STOP
FIXED, S4
*SURFACE INTERACTION, NAME=HARD
*CONTACT PAIR, INTERACTION=HARD, TYPE=NODE TO SURFACE
FACE, STOP
*MATERIAL, NAME=LINEAR
*ELASTIC
3., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=FIXED, MATERIAL=LINEAR
*SOLID SECTION, ELSET=BLOCK, MATERIAL=LINEAR
*BOUNDARY
WALL, 1, 2
*INITIAL CONDITIONS, TYPE=VELOCITY
5, 1, 0.2
6, 1, 0.2
7, 1, 0.2
8, 1, 0.2
*STEP, NLGEOM
*DYNAMIC, DIRECT
{h}, 4.
*TIME INTEGRATION, SCHEME={scheme}
*CONTACT INITIATION, TYPE={initiation}
*CONSTRAINT METHOD, TYPE={method}
*NEWTON, TYPE={newton}
*END STEP
"""


def impact(h=0.0625, scheme="MIDPOINT", initiation="PERSISTENT", method="NULL SPACE",
           newton="KEPT"):
    return IMPACT.format(h=h, scheme=scheme, initiation=initiation, method=method, newton=newton)


def states(deck, folder, sizes=None):
    """Time, displacements, velocities, ledger after each increment, and the verdict."""
    path = folder/"deck.inp"
    path.write_text(deck)
    with Stepper(path) as stepper:
        rows = [(stepper.time, stepper.u.copy(), stepper.v.copy(), stepper.ledger)]
        while not stepper.is_done:
            stepper.step(None if sizes is None else next(sizes))
            rows.append((stepper.time, stepper.u.copy(), stepper.v.copy(), stepper.ledger))
        return rows, stepper.verdict()


def weights(scheme):
    """alpha_m, alpha_f, gamma, beta of Newmark's family, as the papers have them."""
    mass = force = 0.0
    if found := re.search("SPECTRAL RADIUS=(.*)", scheme):
        rho = float(found[1])
        mass, force = (2*rho - 1)/(rho + 1), rho/(rho + 1)
    elif scheme.startswith(ALPHA):
        force = -float(found[1]) if (found := re.search(" ALPHA=(.*)", scheme)) else 0.05
    return mass, force, 0.5 - mass + force, (1 - mass + force)**2/4


def decaying(scheme, x):
    """The matrix that takes (u, h v, du) over a step of the energy-decaying scheme: 2 (du - h v) +
    x^2 (u + du/2 + chi/2 (du - du before)) = 0."""
    chi = float(found[1]) if (found := re.search("DISSIPATION=(.*)", scheme)) else 0.125
    du = np.array([-x**2, 2, chi*x**2/2])/(2 + x**2*(1 + chi)/2)
    return np.array([[1, 0, 0] + du, 2*du - [0, 1, 0], du])


def amplification(scheme, x):
    """The matrix that takes (u, h v, h^2 a) over a step, x = omega h."""
    if scheme.startswith(DECAY):
        return decaying(scheme, x)
    mass, force, gamma, beta = weights(scheme)
    # a1 of (u, h v, h^2 a), by the balance; then Newmark's formulas.
    ahead = np.array([1, 1, 0.5 - beta])
    a1 = -(x**2*((1 - force)*ahead + force*np.array([1, 0, 0])) + [0, 0, mass])
    a1 = a1/(1 - mass + (1 - force)*beta*x**2)
    return np.array([ahead + beta*a1, np.array([0, 1, 1 - gamma]) + gamma*a1, a1])


def closed_form(scheme, h, n):
    """u and v of the oscillator that starts with u = 0 and v = 1, after each step."""
    x = OMEGA*h
    if scheme == "BDF2":
        # y' = A y by (3 y1 - 4 y0 + y-)/2 = A y1, the first step by the mid-point rule.
        a, one = np.array([[0, 1], [-x*x, 0]]), np.eye(2)
        y = [np.array([0, h])]
        y.append(np.linalg.solve(one - a/2, (one + a/2) @ y[0]))
        for _ in range(n - 1):
            y.append(np.linalg.solve(1.5*one - a, 2*y[-1] - y[-2]/2))
        return np.array(y)/[1, h]
    y = [np.array([0, h, 0])]
    for _ in range(n):
        y.append(amplification(scheme, x) @ y[-1])
    return np.array(y)[:, :2]/[1, h]


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("h", [0.125, 1.0, 100.0])
def test_oscillator_follows_the_closed_form(tmp_path, scheme, h):
    """Four steps to a tenth of a period, and half a period to 48 periods a step."""
    n = 60
    rows, verdict = states(oscillator(h, n, scheme), tmp_path)
    found = np.array([(u[2, 0], v[2, 0]) for _, u, v, _ in rows])
    # Each step rounds some ten times, which the next ones hand on; u up to 1/omega, or h.
    bound = 20*n*EPS*np.array([max(1/OMEGA, h), max(1, OMEGA*h)])
    assert (np.abs(found - closed_form(scheme, h, n)).max(0) <= bound).all()
    assert verdict["verdict"] == "good"


@pytest.mark.parametrize("scheme", SCHEMES[:-1])
@pytest.mark.parametrize("h", [0.125, 0.5])
def test_period_and_damping_are_those_of_the_method(tmp_path, scheme, h):
    """The pair of roots of u(n+3) = a u(n+2) + b u(n+1) + c u(n); of the rules that keep nothing of
    the past two terms are enough."""
    n, x = 60, OMEGA*h
    m = 2 if scheme in ("MIDPOINT", "TRAPEZOIDAL") else 3
    rows, _ = states(oscillator(h, n, scheme), tmp_path)
    u = np.array([u[2, 0] for _, u, _, _ in rows])
    # Rows of one size, as the motion dies out.
    past = np.array([u[k:k + m] for k in range(n + 1 - m)])
    size = np.abs(past).max(1)
    fit, *_ = np.linalg.lstsq(past/size[:, None], u[m:]/size, rcond=None)
    found = max(np.roots([1, *-fit[::-1]]), key=lambda root: root.imag)
    expected = max(np.linalg.eigvals(amplification(scheme, x)), key=lambda root: root.imag)
    assert abs(abs(found) - abs(expected)) <= 1e-10
    assert abs(np.angle(found) - np.angle(expected)) <= 1e-10
    if scheme in ("MIDPOINT", "TRAPEZOIDAL"):
        assert abs(abs(found) - 1) <= 1e-10
        assert abs(np.angle(found) - 2*np.arctan(x/2)) <= 1e-10
    else:
        assert abs(found) < 1


@pytest.mark.parametrize(("scheme", "radius"), [("TRAPEZOIDAL", 1.0), (BACK[3], 0.0),
                                                (BACK[4], 0.8), ("BDF2", 0.0)])
def test_the_highest_frequencies_shrink_as_asked(tmp_path, scheme, radius):
    """At 1e4 radians a step: what is left after 40 steps, up to a factor that grows as their
    number (a multiple root)."""
    n, x = 40, 1e4
    rows, _ = states(oscillator(x/OMEGA, n, scheme), tmp_path)
    size = np.hypot(OMEGA*rows[-1][1][2, 0], rows[-1][2][2, 0])
    assert 0.3*radius**n <= size <= n**2*max(radius, 1e-2)**n


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """The conserving scheme in small steps."""
    rows, _ = states(flight(1/8192, "ENERGY MOMENTUM"), tmp_path_factory.mktemp("fine"))
    return rows[-1][1]


@pytest.mark.parametrize("scheme", SCHEMES)
def test_second_order_in_free_flight(tmp_path, reference, scheme):
    error = []
    for h in (1/256, 1/512):
        rows, _ = states(flight(h, scheme), tmp_path)
        error.append(np.abs(rows[-1][1] - reference).max())
        start, end = rows[0][3], rows[-1][3]
        for name in ("px", "py"):
            assert abs(end[name] - start[name]) <= 100*EPS*(1 + abs(start[name]))
        if scheme in TURNING:
            assert abs(end["lz"] - start["lz"]) <= 1e3*EPS*abs(start["lz"])
    assert abs(np.log2(error[0]/error[1]) - 2) <= 0.1


def test_backward_differences_keep_their_order_over_steps_of_any_size(tmp_path, reference):
    error = []
    for h in (1/512, 1/1024):
        sizes = itertools.cycle([h, 2*h, h/2, h/2])
        rows, _ = states(flight(h, "BDF2"), tmp_path, sizes)
        assert rows[-1][0] == 1.0
        error.append(np.abs(rows[-1][1] - reference).max())
    assert abs(np.log2(error[0]/error[1]) - 2) <= 0.1


@pytest.mark.each_value
@pytest.mark.parametrize("kinematics", ["LINEAR", "COROTATED"])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_bodies_of_small_strains(tmp_path, scheme, kinematics):
    """Linear forces have one mean over a step, wherever they are taken: what keeps the energy of
    linear bodies does. Corotated ones have to be of second order."""
    section = f", KINEMATICS={kinematics}"
    if kinematics == "LINEAR":
        rows, _ = states(flight(1/32, scheme, section, STRETCH), tmp_path)
        total = np.array([ledger["total"] for *_, ledger in rows])
        if scheme in ("MIDPOINT", "TRAPEZOIDAL"):
            assert np.abs(total/total[0] - 1).max() <= 1e-12
        else:
            assert total[-1] < total[0]
        return
    fine, _ = states(flight(1/4096, "ENERGY MOMENTUM", section), tmp_path)
    error = []
    for h in (1/128, 1/256):
        rows, _ = states(flight(h, scheme, section), tmp_path)
        error.append(np.abs(rows[-1][1] - fine[-1][1]).max())
    assert abs(np.log2(error[0]/error[1]) - 2) <= 0.15


RIGID = """*NODE
1, 0., 0.
2, 1., 0.
3, 1., 1.
4, 0., 1.
9, 0.5, 0.5
*ELEMENT, TYPE=CPE4, ELSET=BLOCK
1, 1, 2, 3, 4
*MATERIAL, NAME=STEEL
*ELASTIC
20., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=BLOCK, MATERIAL=STEEL
*RIGID BODY, ELSET=BLOCK, REF NODE=9
*INITIAL CONDITIONS, TYPE=VELOCITY
9, 1, 1.
9, 6, 3.
*STEP, NLGEOM
*DYNAMIC, DIRECT
{h!r}, 1.
*TIME INTEGRATION, SCHEME={scheme}
*END STEP
"""


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_rigid_body_turns_in_second_order(tmp_path, scheme):
    """By 3 radians, and keeps its edges; the first step starts from the acceleration that turns."""
    error = []
    corner = complex(0.5, 0.5)
    for h in (1/64, 1/128):
        rows, _ = states(RIGID.format(h=h, scheme=scheme), tmp_path)
        u, place = rows[-1][1], corner*np.exp(3j) - corner + 1
        error.append(abs(complex(*u[2]) - place))
        edge = complex(1, 0) + complex(*u[1]) - complex(*u[0])
        assert abs(abs(edge) - 1) <= 1e3*EPS
    assert abs(np.log2(error[0]/error[1]) - 2) <= 0.1


@pytest.mark.parametrize("initiation", ["PERSISTENT", "ADMISSIBLE"])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_contact(tmp_path, scheme, initiation):
    """The block does not go through the wall, and comes back; impulse is what turns it."""
    rows, verdict = states(impact(scheme=scheme, initiation=initiation), tmp_path)
    assert verdict["penetration"] <= 1e-12
    assert all(reason.startswith("contact has added an energy") for reason in verdict["reasons"])
    assert rows[0][2][5, 0] > 0 > rows[-1][3]["px"]
    # Both corners come down on the wall; nothing goes deeper.
    assert max(u[5:8:2, 0].max() for _, u, _, _ in rows) <= 0.1*(1 + 64*EPS)
    # Which no scheme that does not keep energy is blamed for.
    balance = verdict["largest_energy_error"]/verdict["largest_energy"]
    assert (balance > 1e-12) is not scheme.startswith(DECAY)


@pytest.mark.parametrize("chi", [0.05, 0.125, 1.0])
@pytest.mark.parametrize("initiation", ["PERSISTENT", "ADMISSIBLE"])
def test_the_decaying_scheme_never_adds_energy(tmp_path, initiation, chi):
    """Through an impact, in increments up to twice the transit time of the block: the energy is
    never above that of the start, and what was taken closes the balance to ten digits."""
    for h in (0.0625, 0.25, 1.0):
        rows, verdict = states(impact(h, f"{DECAY}, DISSIPATION={chi}", initiation), tmp_path)
        total, loss, contact = (np.array([ledger[name] for *_, ledger in rows])
                                for name in ("total", "scheme_loss", "contact_work"))
        assert total.max() <= total[0]*(1 + 64*EPS)
        assert loss.min() >= 0 and loss[-1] > 1e-6*total[0]
        assert np.abs(total + loss - contact - total[0]).max() <= 1e-12*total[0]
        assert verdict["verdict"] == "good"
        assert verdict["scheme_loss"] == pytest.approx(loss[-1], rel=1e-8)


def test_the_decaying_scheme_without_dissipation_is_the_default(tmp_path):
    first, _ = states(impact(scheme=f"{DECAY}, DISSIPATION=0"), tmp_path)
    other, _ = states(impact(scheme="ENERGY MOMENTUM"), tmp_path)
    assert np.array_equal(first[-1][1], other[-1][1])


def test_a_rigid_motion_keeps_its_energy(tmp_path):
    """Stiff bodies that turn by a radian in ten increments: nothing but vibrations is damped."""
    deck = flight(0.05, DECAY, velocity="\n".join(
        f"{label}, 1, {-2.0*y}\n{label}, 2, {2.0*x}"
        for label, (x, y) in enumerate([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)], 1)))
    rows, _ = states(deck.replace("20., 0.3", "2e6, 0.3"), tmp_path)
    start, end = rows[0][3], rows[-1][3]
    assert abs(end["lz"] - start["lz"]) <= 1e3*EPS*start["lz"]
    assert 0 <= end["scheme_loss"] <= 1e-3*start["total"]


@pytest.mark.parametrize("courant", [0.5, 1.0])
@pytest.mark.parametrize("initiation", ["PERSISTENT", "ADMISSIBLE"])
def test_contact_makes_energy_under_the_trapezoidal_rule(tmp_path, initiation, courant):
    """A known defect of multipliers that an acceleration remembers: the bar that drops on a floor
    has a multiple of its energy, and the verdict says whose work that is. Backward differences,
    which remember none, take some."""
    text = (DECKS/"bouncing_bar.inp").read_text()
    grown = {}
    for scheme in ("TRAPEZOIDAL", "BDF2"):
        h = courant*0.2/30
        deck = text
        for name, value in (("h", h), ("t_end", 1.2 + 100*h), ("initiation", initiation),
                            ("scheme", scheme)):
            deck = re.sub(f"(?m)^{name} = .*", f"{name} = {value}", deck)
        rows, verdict = states(deck, tmp_path)
        # The work of gravity down to the floor: mass 10, acceleration 10, height 5.
        drop = 10*10*5
        grown[scheme] = 1 + rows[-1][3]["total"]/drop
        blames = [reason.startswith("contact has added") for reason in verdict["reasons"]]
        assert any(blames) == (scheme == "TRAPEZOIDAL")
    assert grown["TRAPEZOIDAL"] > 1.8
    assert 0.5 < grown["BDF2"] < 1.0


@pytest.mark.parametrize("scheme", SCHEMES)
def test_methods_agree(tmp_path, scheme):
    """Null space or saddle point, kept factor or new tangents: the same digits."""
    end = [states(impact(scheme=scheme, method=method, newton=newton), tmp_path)[0][-1]
           for method, newton in (("NULL SPACE", "KEPT"), ("NULL SPACE", "FULL"),
                                  ("SADDLE POINT", "FULL"))]
    for other in end[1:]:
        assert np.abs(other[1] - end[0][1]).max() <= 1e-10
        assert np.abs(other[2] - end[0][2]).max() <= 1e-9


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_run_that_goes_on_has_the_same_bits(tmp_path, scheme):
    """From a restart file, and from a snapshot, in contact."""
    path, file = tmp_path/"deck.inp", tmp_path/"half.rst.h5"
    path.write_text(impact(scheme=scheme))
    with Stepper(path) as whole:
        whole.run(until=2.0)
        whole.write_restart(file)
        kept = whole.save()
        whole.run()
        expected = whole.u.copy(), whole.v.copy(), whole.ledger
        whole.restore(kept)
        whole.run()
        assert all(np.array_equal(a, b) for a, b in zip(expected, (whole.u, whole.v),
                                                        strict=False))
    with Stepper.from_restart(file) as half:
        half.run()
        assert np.array_equal(half.u, expected[0]) and np.array_equal(half.v, expected[1])
        assert half.ledger == expected[2]


@pytest.mark.parametrize("scheme", SCHEMES)
def test_units_do_not_matter(tmp_path, scheme):
    """Powers of two: the same bits."""
    own, _ = states(oscillator(0.125, 20, scheme), tmp_path)
    other, _ = states(oscillator(0.125, 20, scheme, 2.0**9, 2.0**-5, 2.0**12), tmp_path)
    assert np.array_equal(own[-1][1]*2.0**-5, other[-1][1])
    assert np.array_equal(own[-1][2]*2.0**-17, other[-1][2])


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_state_from_outside_has_no_past(tmp_path, scheme):
    """A run from the displacements and velocities of another one starts as that did."""
    path = tmp_path/"deck.inp"
    path.write_text(flight(1/32, scheme))
    with Stepper(path) as stepper:
        u, v = stepper.u.copy(), stepper.v.copy()
        first = [(stepper.step(), stepper.u.copy())[1] for _ in range(3)]
        stepper.set_state(u=u, v=v)
        for expected in first:
            stepper.step()
            assert np.array_equal(stepper.u, expected)
