"""Explicit steps: central differences with the mass at the nodes, contact that closes exactly."""

import dataclasses
import json
import re
import shutil

import numpy as np
import pytest
from scene_tools import DECKS, EPSILON, Deck, attempt, emcon, number, run_deck

#: Waves of bars of these constants run at 10.
YOUNG, DENSITY = 100.0, 1.0
EVERY = "*NODE PRINT, NSET=ALL\nU, V\n"
LAST = "*NODE FILE, FREQUENCY=1000000\nU, V\n"


def block(cells, size=(1.0, 1.0), nu=0.3, law="HYPERELASTIC, COUPLED NEO HOOKE", kinematics="",
          velocity=lambda x, y: (0, 0), model="", step="", procedure="*DYNAMIC, DIRECT, EXPLICIT"):
    """A rectangle of four-node elements, its lower left corner in the origin."""
    nx, ny = cells
    place = [(size[0]*i/nx, size[1]*j/ny) for j in range(ny + 1) for i in range(nx + 1)]
    lines = ["*HEADING", "block", "*NODE, NSET=ALL"]
    lines += [f"{k}, {number(x)}, {number(y)}" for k, (x, y) in enumerate(place, 1)]
    lines += ["*ELEMENT, TYPE=CPE4, ELSET=BLOCK"]
    for e, cell in enumerate(block_cells(cells), 1):
        lines += [f"{e}, " + ", ".join(str(k + 1) for k in cell)]
    lines += ["*MATERIAL, NAME=M", f"*{law}", f"{YOUNG}, {nu}", "*DENSITY", number(DENSITY),
              f"*SOLID SECTION, ELSET=BLOCK, MATERIAL=M{kinematics}", "1."]
    starts = [(k, velocity(*p)) for k, p in enumerate(place, 1)]
    if any(any(v) for _, v in starts):
        lines += ["*INITIAL CONDITIONS, TYPE=VELOCITY"]
        lines += [f"{k}, {a}, {number(v[a - 1])}" for k, v in starts for a in (1, 2)]
    lines += [*model.splitlines(), "*STEP, NLGEOM, INC=1000000", procedure, "<h>, <t_end>",
              *step.splitlines(), "*END STEP"]
    deck = Deck("\n".join(lines), "block")
    deck.insert("*PARAMETER\nh = 0.001\nt_end = 0.1", before="*NODE")
    return deck


def block_cells(cells):
    nx, ny = cells
    return [[j*(nx + 1) + i, j*(nx + 1) + i + 1, (j + 1)*(nx + 1) + i + 1, (j + 1)*(nx + 1) + i]
            for j in range(ny) for i in range(nx)]


LINEAR = {"law": "ELASTIC", "kinematics": ", KINEMATICS=LINEAR"}


def stiffness_and_mass(cells, size, nu):
    """K of plane strain by 2 x 2 points, and the mass of each freedom, by textbook formulas."""
    nx, ny = cells
    a, b = size[0]/nx, size[1]/ny
    factor = YOUNG/((1 + nu)*(1 - 2*nu))
    law = factor*np.array([[1 - nu, nu, 0], [nu, 1 - nu, 0], [0, 0, 0.5 - nu]])
    corner = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    local = np.zeros((8, 8))
    for r, s in corner/np.sqrt(3):
        gradient = np.array([corner[:, 0]*(1 + s*corner[:, 1])/(2*a),
                             corner[:, 1]*(1 + r*corner[:, 0])/(2*b)])
        strain = np.zeros((3, 8))
        strain[0, ::2], strain[1, 1::2] = gradient
        strain[2, ::2], strain[2, 1::2] = gradient[1], gradient[0]
        local += strain.T @ law @ strain*(a*b/4)
    n = 2*(nx + 1)*(ny + 1)
    stiffness, mass = np.zeros((n, n)), np.zeros(n)
    for cell in block_cells(cells):
        freedom = [2*k + c for k in cell for c in (0, 1)]
        stiffness[np.ix_(freedom, freedom)] += local
        mass[freedom] += DENSITY*a*b/4
    return stiffness, mass


def critical_step(run):
    return float(re.search(r"the critical step (\S+)", run.log)[1])


# ---- the scheme


@pytest.mark.parametrize("share", [0.1, 0.5, 0.99])
def test_oscillator_has_the_frequency_of_central_differences(tmp_path, share):
    """One element as a spring: u = v0 sin(w t) h/sin(w h) with w = (2/h) asin(w0 h/2), v = v0 cos.

    Half of the element's mass moves, by E b/a: w0^2 = 200. Nothing else vibrates.
    """
    held = "*BOUNDARY\n1, 1, 2\n3, 1, 2\n2, 2, 2\n4, 2, 2\n*EQUATION\n2\n4, 1, 1., 2, 1, -1."
    deck = block((1, 1), nu=0.0, velocity=lambda x, _: (1e-3*x, 0), model=held, step=EVERY, **LINEAR)
    omega = np.sqrt(2*YOUNG/DENSITY)
    h = share*2/omega
    run = run_deck(deck, tmp_path, h=h, t_end=1000*h)
    t, u = run.series("ALL", "U")
    v = run.series("ALL", "V")[1]
    w = 2/h*np.arcsin(omega*h/2)
    # Round-off of a step turns into a drift that grows with their number, and with dw/dw0.
    close = {"rtol": 0, "atol": 1000*8*EPSILON*1e-3/np.sqrt(1 - share**2)}
    np.testing.assert_allclose(v[:, 1, 0], 1e-3*np.cos(w*t), **close)
    np.testing.assert_allclose(u[:, 1, 0]*np.sin(w*h)/h, 1e-3*np.sin(w*t), **close)


def swing(x, y):
    return 0.6*np.sin(2*x) - 0.5*y, 0.4*x*y + 0.5*x


def test_second_order(tmp_path):
    """Large deformations, all that vibrates resolved: errors fall by four when h is halved."""
    deck = block((4, 3), size=(1.0, 0.75), velocity=swing, step=LAST)
    last = [run_deck(deck, tmp_path/str(k), h=0.008/2**k, t_end=0.32).fields()["displacement"][-1]
            for k in range(4)]
    change = [np.abs(a - b).max() for a, b in zip(last, last[1:], strict=False)]
    # To leading order 4, the next terms are (w h)^2/12 of it.
    assert 3.8 < change[1]/change[2] < 4.2, change


def test_work_where_a_prescribed_velocity_jumps(tmp_path):
    """An end driven to and fro: books close to the second order of the step, as the mass of driven
    nodes takes what its velocities say, and the energy is that of a bar of the same steps in numpy."""
    cells, size, way = (6, 1), (1.0, 0.1), 0.05
    deck = block(cells, size, nu=0.0, **LINEAR, model="*AMPLITUDE, NAME=A\n0, 0, 0.1, 1, 0.2, 0",
                 step=f"*BOUNDARY\nALL, 2\n*BOUNDARY, AMPLITUDE=A\n1, 1, 1, {way}\n8, 1, 1, {way}")
    off = []
    for n in (100, 200):
        run = run_deck(deck, tmp_path/str(n), h=0.2/n, t_end=0.2)
        history = run.history
        energy = history["kinetic"] + history["strain"]
        off += [np.abs(energy - history["external_work"]).max()/energy.max()]
    assert 3.5 < off[0]/off[1] < 4.5
    assert off[1] < 1e-3
    # The bar: masses and springs, the driven one left out of the equations.
    m = np.full(cells[0] + 1, DENSITY*size[1]*size[0]/cells[0])
    m[[0, -1]] /= 2
    k, h = YOUNG*size[1]*cells[0]/size[0], 0.2/n
    u, v = np.zeros(len(m)), np.zeros(len(m))

    def push(u):
        stretch = np.diff(u)
        return k*(np.r_[stretch, 0] - np.r_[0, stretch])

    for i in range(n):
        v += h/2*push(u)/m
        u += h*v
        u[0] = way*(1 - abs((i + 1)*h/0.1 - 1))
        v += h/2*push(u)/m
        v[0] = way/0.1*(1 if (i + 1)*h < 0.1 - h/2 else -1)
    assert history["strain"][-1] == pytest.approx(k*np.sum(np.diff(u)**2)/2, rel=1e-9)
    assert history["external_work"][-1] == pytest.approx(
        k*np.sum(np.diff(u)**2)/2 + np.sum(m*v*v)/2, rel=2*off[1])


def test_momenta_stay(tmp_path):
    """Forces are gradients where they push: linear and angular momentum stay to round-off."""
    deck = block((6, 4), velocity=swing, step=LAST)
    history = run_deck(deck, tmp_path, h=0.005, t_end=5.0).history
    assert history["strain"].max() > 0.01*history["total"][0]
    for name in ("px", "py", "lz"):
        size = abs(history["lz"][0])
        assert np.abs(history[name] - history[name][0]).max() <= 1000*EPSILON*size, name


# ---- the critical step


def test_critical_step_is_sharp(tmp_path):
    """2 over the highest frequency, by numpy; beyond it the same scheme grows, below it does not."""
    cells, size, nu = (5, 3), (1.0, 0.5), 0.3
    stiffness, mass = stiffness_and_mass(cells, size, nu)
    square = np.linalg.eigvalsh(stiffness/np.sqrt(np.outer(mass, mass)))[-1]
    limit = 2/np.sqrt(square)
    deck = block(cells, size, nu, velocity=lambda x, y: (1e-4*np.sin(9*x), 1e-4*np.cos(8*y)),
                 step=LAST, **LINEAR)
    run = run_deck(deck, tmp_path/"below", h=0.999*limit, t_end=2000*0.999*limit)
    assert critical_step(run) == pytest.approx(limit, rel=1e-5)       # six digits in the log
    deck.set_parameter("h", number(0.999*limit))
    done = emcon("check", deck.write(tmp_path/"block.inp"), "--json")
    (row,) = json.loads(done.stdout)["increments"]
    assert row["critical_h"] == pytest.approx(limit, rel=1e-8)
    # At h w = 1.998 the highest vibration holds up to 1/(1 - 0.999^2) = 500 times its energy.
    assert run.history["total"].max() <= 500*run.history["total"][0]
    done, _ = attempt(deck, tmp_path/"above", (), {"h": 1.001*limit, "t_end": 1})
    assert done.returncode == 2
    assert "is larger than the critical step" in done.stderr and "element" in done.stderr
    u, v = np.zeros(len(mass)), np.random.default_rng(1).standard_normal(len(mass))
    for factor, grows in ((0.999, False), (1.001, True)):
        x, rate, h = u.copy(), v.copy(), factor*limit
        for _ in range(2000):
            rate -= h*(stiffness @ x)/mass
            x += h*rate
        assert (np.abs(x).max() > 1e6*np.abs(v).max()*h) == grows


def test_compression_ends_in_words(tmp_path):
    """Squeezed elements are faster: the limit is looked at again, and named."""
    model = ("*NSET, NSET=LOW, GENERATE\n1, 4\n*NSET, NSET=TOP, GENERATE\n13, 16\n"
             "*AMPLITUDE, NAME=RUN\n0., 0., 100., 100.\n")
    step = "*BOUNDARY\nLOW, 1, 2\n*BOUNDARY, AMPLITUDE=RUN\nTOP, 2, 2, -0.1\n" + LAST
    deck = block((3, 3), model=model, step=step)
    first = run_deck(deck, tmp_path/"first", h=0.001, t_end=0.1)
    h = 0.95*critical_step(first)
    done, run = attempt(deck, tmp_path, (), {"h": h, "t_end": 9.0})
    assert done.returncode == 3
    assert "is larger than the critical step" in done.stderr
    assert np.isfinite(run.history["total"]).all()


# ---- contact


def bar(cells, gap=0.02, speed=0.1, kind="NODE TO SURFACE", more=""):
    """A bar without lateral strain that flies down onto a wall at -`gap`."""
    n = cells[0]
    faces = "\n".join(f"{k}, S1" for k in range(1, n + 1))
    model = f"""*NODE
9001, -1., {number(-gap - 0.5)}
9002, 2., {number(-gap - 0.5)}
9003, 2., {number(-gap)}
9004, -1., {number(-gap)}
*ELEMENT, TYPE=CPE4, ELSET=WALL
9001, 9001, 9002, 9003, 9004
*SURFACE, NAME=FLOOR
WALL, S3
*SURFACE, NAME=FOOT
{faces}
*SOLID SECTION, ELSET=WALL, MATERIAL=M
1.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I, TYPE={kind}
FOOT, FLOOR
*BOUNDARY
9001, 1, 2
9002, 1, 2
9003, 1, 2
9004, 1, 2
{more}"""
    return block(cells, (0.1, 1.0), nu=0.0, velocity=lambda _x, _y: (0, -speed), model=model,
                 step=EVERY, **LINEAR)


@pytest.mark.each_value
@pytest.mark.parametrize("kind", ["NODE TO SURFACE", "SEGMENT", "MORTAR"])
@pytest.mark.parametrize("share", [0.3, 0.9])
def test_bar_on_a_wall(tmp_path, kind, share):
    """It stands still on the wall for two transits, then flies: closed forms of the impact.

    The nodes that touch lose their kinetic energy, as they have mass; nothing else is lost in
    contact. The wave stops at 2 L/c; what remains is dispersion of the mesh.
    """
    n, gap, speed = 20, 0.02, 0.1
    h = share/n/10*np.sqrt(0.5)
    run = run_deck(bar((2, n), gap, speed, kind), tmp_path, h=h, t_end=0.6)
    history, active = run.history, run.history["active"] > 0
    assert np.abs(np.diff(active.astype(int))).sum() == 2
    assert history["time"][active][0] == pytest.approx(gap/speed, abs=2*h)
    assert history["time"][active][-1] - gap/speed == pytest.approx(0.2, rel=0.03)
    lost = 0.5*(DENSITY*0.1/(2*n))*speed**2
    assert history["contact_work"][-1] == pytest.approx(-lost, rel=0.1)
    u = run.series("ALL", "U")[1]
    assert u[:, :3, 1].min() >= -gap - 8*EPSILON
    # Pushes of the wall are all that changes momentum.
    assert history["py"][-1] == pytest.approx(0.1*DENSITY*speed, rel=0.06)


def explicit(name):
    deck = Deck.read(DECKS/f"{name}.inp")
    deck.replace("*DYNAMIC, DIRECT", "*DYNAMIC, DIRECT, EXPLICIT")
    for card in ("*NEWTON", "*CONSTRAINT METHOD"):
        try:
            deck.remove(card)
        except KeyError:
            pass
    try:
        deck.remove("*CONTACT INITIATION", "TYPE=<initiation>")
    except KeyError:
        pass
    return deck


def test_impact_keeps_momenta(tmp_path):
    """Two bodies in the plane: exact momenta through the impact, no nodes in the other body."""
    run = run_deck(explicit("two_bodies"), tmp_path, h=0.002, t_end=1.0,
                   formulation="NODE TO SURFACE")
    history = run.history
    assert history["active"].max() > 0
    for name in ("px", "py", "lz"):
        drift = np.abs(history[name] - history[name][0]).max()
        assert drift <= 500*EPSILON*abs(history["lz"][0]), name
    assert run.verdict["verdict"] == "good"
    # Impacts lose what the nodes that meet have; that gaps are curved makes less by orders.
    change = np.diff(history["contact_work"])
    assert 0 < change[change > 0].sum() < -1e-3*change[change < 0].sum()


@pytest.mark.long
def test_impact_beside_the_energy_momentum_scheme(tmp_path):
    """The same bodies by both schemes, small steps: what the masses of the nodes do is left."""
    there = run_deck(explicit("two_bodies"), tmp_path/"explicit", h=0.001, t_end=1.0)
    deck = Deck.read(DECKS/"two_bodies.inp")
    here = run_deck(deck, tmp_path/"implicit", h=0.001, t_end=1.0, initiation="ADMISSIBLE")
    pushed = [abs(run.history["pair1_impulse_x"][-1]) + abs(run.history["pair1_impulse_y"][-1])
              for run in (there, here)]
    assert pushed[0] == pytest.approx(pushed[1], rel=0.1)


# ---- ties, rigid bodies, equations


def test_ties_keep_momenta(tmp_path):
    """Mass of dependent nodes goes to those that they follow, and is no diagonal any more."""
    history = run_deck(explicit("tied_spin"), tmp_path, h=0.0005, t_end=0.5).history
    for name in ("px", "py", "lz"):
        size = max(abs(history[n][0]) for n in ("px", "py", "lz"))
        assert np.abs(history[name] - history[name][0]).max() <= 1000*EPSILON*size, name


def test_rigid_body_turns(tmp_path):
    """A free rigid block spins about its centre: it keeps its shape, momenta and energy."""
    model = ("*NODE\n100, 1., 0.5\n*RIGID BODY, ELSET=BLOCK, REF NODE=100\n"
             "*INITIAL CONDITIONS, TYPE=VELOCITY\n100, 1, 0.5\n100, 6, 1.")
    deck = block((2, 1), size=(2.0, 1.0), model=model, step=EVERY)
    run = run_deck(deck, tmp_path, h=0.01, t_end=5.0)
    history = run.history
    for name in ("px", "py", "lz"):
        assert np.abs(history[name] - history[name][0]).max() <= 1e-12*abs(history["lz"][0]), name
    # RATTLE: the energy of a body that turns stays near that of the start, h^2/12 of it off.
    assert np.abs(history["total"]/history["total"][0] - 1).max() < 0.01**2
    u = run.series("ALL", "U")[1]
    corner = np.array([2.0, 0.0]) + u[:, 2] - u[:, 0]
    np.testing.assert_allclose(np.hypot(*corner.T), 2.0, rtol=1e-13)


# ---- growth without bound


def crushed():
    """Thrown together so fast that it stiffens within a few increments, before it is looked at."""
    deck = block((2, 1), velocity=lambda x, _: (50*(x - 0.5), 0), step=LAST)
    deck.set_parameter("h", 0.027)
    deck.set_parameter("t_end", 3)
    return deck


def test_energy_that_grows_without_bound_ends_the_analysis(tmp_path):
    done, run = attempt(crushed(), tmp_path, (), {})
    assert done.returncode == 3
    found = re.search(r"stops at time (\S+): the explicit step grows without bound, its energy (\S+) "
                      r"is (\S+) times what was put in; give a smaller increment", done.stderr)
    assert found, done.stderr
    time, energy, factor = map(float, found.groups())
    # No load does work: what was put in is the energy at the start, or that of the first increment.
    history = run.history
    assert factor > 1e6 and energy/history["total"][:2].max() == pytest.approx(factor, rel=0.3)
    assert history["total"].max() <= 1e6*history["total"][:2].max()
    assert time == pytest.approx(history["time"][-1], abs=1e-8)
    assert run.verdict["verdict"] != "good"


@pytest.mark.parametrize("power", [155, 200, 306])
def test_energy_that_is_no_number_ends_the_analysis(tmp_path, power):
    deck = block((2, 1), velocity=lambda x, _: (10.0**power*(x - 0.5), 0), step=LAST, **LINEAR)
    done, _ = attempt(deck, tmp_path, (), {"h": 0.015, "t_end": 3})
    assert done.returncode == 3
    assert "the explicit step grows without bound, its energy is not finite" in done.stderr


@pytest.mark.parametrize("every", [1, 5, 11])
def test_what_bounds_the_step_is_in_the_restart_file(tmp_path, every):
    """From the last file on, whose increment is far above the critical step by then, the run ends as
    it does in one go: with the same words, the energy that was put in among them."""
    deck = crushed()
    deck.insert(f"*RESTART, WRITE, FREQUENCY={every}")
    whole, run = attempt(deck, tmp_path, (), {})
    assert whole.returncode == 3
    done = emcon("restart", run.file(".rst.h5"), "--quiet")
    assert done.returncode == 3
    assert done.stderr == whole.stderr


# ---- the same bits


def test_restart_has_the_same_bits(tmp_path):
    """The file is of an increment in contact, the last of a first step."""
    deck = explicit("two_bodies")
    k = deck.find("*STEP")
    second = [(head, list(data)) for head, data in deck.card[k:]]
    deck.data("*DYNAMIC")[:] = ["0.002, 0.38"]
    deck.insert("*RESTART, WRITE, FREQUENCY=190")
    deck.card += second
    deck.card.insert(-1, ("*RESTART, WRITE, FREQUENCY=0", []))
    run = run_deck(deck, tmp_path/"whole", h=0.002, t_end=0.3)
    assert run.history["active"][190] > 0
    shutil.copytree(tmp_path/"whole", tmp_path/"copy")
    done = emcon("restart", tmp_path/"copy"/"two_bodies.rst.h5", "--quiet")
    assert done.returncode == 0, done.stderr
    copy = dataclasses.replace(run, base=tmp_path/"copy"/"two_bodies")
    assert "resumed after increment 190" in copy.log
    assert copy.digits() == run.digits()


def test_units_have_the_same_bits(tmp_path):
    """Lengths in units of 2^-20, times of 2^10: the same digits but for the exponents."""
    plain = run_deck(bar((1, 6)), tmp_path/"plain", h=0.005, t_end=0.5)
    deck = bar((1, 6))
    length, time = 2.0**20, 2.0**-10
    deck.move_nodes(lambda _, x, y: (length*x, length*y))
    deck.map_numbers("*INITIAL CONDITIONS", lambda w: [*w[:2], number(float(w[2])*length/time)])
    deck.replace(f"{YOUNG}, 0.0", f"{number(YOUNG/(length*time**2))}, 0.0")
    deck.replace("*DENSITY\n1.0", f"*DENSITY\n{number(DENSITY/length**3)}")
    scaled = run_deck(deck, tmp_path/"scaled", h=0.005*time, t_end=0.5*time)
    u, other = (run.series("ALL", "U")[1] for run in (plain, scaled))
    np.testing.assert_array_equal(u*length, other)


def test_threads_have_the_same_bits(tmp_path):
    deck = explicit("two_bodies")
    runs = [run_deck(deck, tmp_path/str(n), h=0.002, t_end=0.5, options=("--threads", str(n)))
            for n in (1, 3)]
    assert runs[0].digits() == runs[1].digits()
