"""`*DAMPING` of materials: by mass and by moduli, with what it takes in the ledger."""

import math

import numpy as np
import pytest
from plain_scenes import BOTH, Scene
from scene_tools import Deck, run_deck
from test_contact_output import data_sets, restart


def damped(deck, alpha=0.0, beta=0.0):
    deck.replace("*DENSITY", f"*DAMPING, ALPHA={alpha!r}, BETA={beta!r}\n*DENSITY")
    return deck


def balance(history):
    kept = history["total"] - history["contact_work"] + history["damping_loss"]
    return np.abs(kept - kept[0]).max()/(history["kinetic"] + history["strain"]).max()


# ---- one mode of a bar --------------------------------------------------------------------------

N, YOUNG, RHO = 4, 100.0, 0.5
WAVE = math.pi/2                                 # of the first mode of a bar of length 1


def bar(h, t_end, section=""):
    """A bar held at one end, without strain across it, that starts in its first mode."""
    lines = ["*HEADING", "bar", "*NODE"]
    for j in range(2):
        lines += [f"{(N + 1)*j + i + 1}, {i/N!r}, {float(j)}" for i in range(N + 1)]
    lines += ["*ELEMENT, TYPE=CPE4, ELSET=BAR"]
    lines += [f"{i}, {i}, {i + 1}, {N + i + 2}, {N + i + 1}" for i in range(1, N + 1)]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{YOUNG}, 0.", "*DENSITY", str(RHO),
              f"*SOLID SECTION, ELSET=BAR, MATERIAL=M{section}", "1.",
              "*NSET, NSET=ALL, GENERATE", f"1, {2*N + 2}",
              "*BOUNDARY", f"1, 1\n{N + 2}, 1", "ALL, 2", "*INITIAL CONDITIONS, TYPE=VELOCITY"]
    lines += [f"{(N + 1)*j + i + 1}, 1, {math.sin(WAVE*i/N)!r}" for j in range(2)
              for i in range(1, N + 1)]
    return Deck("\n".join([*lines, "*STEP, INC=1000000", "*DYNAMIC, DIRECT", f"{h!r}, {t_end!r}",
                           "*END STEP", ""]))


def frequency():
    """Of that mode on the mesh, with the consistent mass."""
    c = math.cos(WAVE/N)
    return math.sqrt(YOUNG/RHO*6*N**2*(1 - c)/(2 + c))


@pytest.mark.parametrize(("alpha", "beta"), [(2.0, 0.0), (0.0, 0.01), (1.0, 0.005)])
def test_a_mode_of_a_bar_decays_as_the_oscillator(alpha, beta, tmp_path):
    """Step by step as one degree of freedom, and so with the ratio (alpha/w + beta w)/2."""
    omega = frequency()
    period = 2*math.pi/omega
    ratio = 0.5*(alpha/omega + beta*omega)
    errors = []
    for n in (20, 40):
        h = period/n
        run = run_deck(damped(bar(h, 4*period), alpha, beta), tmp_path/str(n))
        history = run.history
        c = alpha + beta*omega**2
        # x' = v at mid-step, v' = -c x' - w^2 x: the state after a step.
        left = np.array([[1, -h/2], [c + h*omega**2/2, 1]])
        right = np.array([[1, h/2], [c - h*omega**2/2, 1]])
        step = np.linalg.solve(left, right)
        state, energy = np.array([0.0, 1.0]), []
        for _ in history:
            energy.append(state[1]**2 + (omega*state[0])**2)
            state = step @ state
        total = (history["kinetic"] + history["strain"])/history["kinetic"][0]
        assert np.abs(total - energy).max() < 1e-11
        assert balance(history) < 1e-12
        assert (np.diff(history["damping_loss"]) >= 0).all()
        found = 0.5*math.log(np.abs(np.linalg.eigvals(step)[0])**-2)/h
        errors.append(abs(found/(ratio*omega) - 1))
    assert errors[0] < (omega*period/20)**2 and errors[1] < 0.3*errors[0]


# ---- momenta ------------------------------------------------------------------------------------


def spinning(h=0.02, t_end=2.0, section="", spin=2.0):
    scene = Scene(h, t_end)
    scene.block("A", (-1.0, -0.5), (2.0, 1.0), (4, 2), velocity=(0.3, -0.2), spin=spin)
    deck = scene.deck()
    if section:
        deck.replace("*SOLID SECTION, ELSET=A", f"*SOLID SECTION, ELSET=A, {section}")
    return deck


def test_damping_by_moduli_does_not_see_rigid_motions(tmp_path):
    """A body is let go as it spins: it stretches, swings, and then turns for ever."""
    run = run_deck(damped(spinning(t_end=4.0), beta=0.02), tmp_path)
    history = run.history
    assert balance(history) < 1e-12
    for name in ("px", "py", "lz"):
        assert np.abs(history[name]/history[name][0] - 1).max() < 1e-12, name
    loss = history["damping_loss"]
    half = len(loss)//2
    assert loss[-1] > 1e-4*history["kinetic"][0]
    # The slowest vibration that a spin excites is that along the block, of half a wave.
    slowest = math.pi*math.sqrt(100.0)/2.0
    assert loss[-1] - loss[half] < math.exp(-0.02*slowest**2*2.0)*loss[-1]
    # What is left is rotation with the stretch that goes with it.
    assert history["strain"][-1] > 0.1*loss[-1]


@pytest.mark.parametrize("section", ["KINEMATICS=COROTATED", "KINEMATICS=LINEAR"])
def test_sections_of_small_strains_are_damped_too(section, tmp_path):
    spin = 0.02 if "LINEAR" in section else 2.0
    history = run_deck(damped(spinning(0.01, 0.5, section, spin), 0.5, 0.02), tmp_path).history
    assert history["damping_loss"][-1] > 1e-3*history["kinetic"][0]
    assert balance(history) < 1e-12


@pytest.mark.parametrize("h", [0.05, 0.0125])
def test_damping_by_mass_slows_as_the_scheme_says(h, tmp_path):
    """M (v1 - v0)/h = -alpha M (v0 + v1)/2: all momenta shrink by one factor in each step."""
    alpha = 3.0
    history = run_deck(damped(spinning(h, 1.0), alpha=alpha), tmp_path).history
    factor = (1 - alpha*h/2)/(1 + alpha*h/2)
    for name in ("px", "py"):
        expected = history[name][0]*factor**np.arange(len(history))
        assert np.abs(history[name] - expected).max() < 1e-12*abs(expected[0]), name
    assert balance(history) < 1e-12


# ---- impact -------------------------------------------------------------------------------------


def crash(scheme="ENERGY MOMENTUM", beta=0.01):
    scene = Scene(0.01, 0.8)
    scene.disc("A", (-0.6, 0.0), 0.5, (4, 2), velocity=(1.0, 0.0), spin=0.5)
    scene.disc("B", (0.6, 0.3), 0.5, (4, 2), velocity=(-0.5, 0.0), density=2.0)
    scene.pairs = [("A", "B")]
    deck = damped(scene.deck(BOTH), beta=beta)
    deck.replace("*NEWTON", f"*TIME INTEGRATION, SCHEME={scheme}\n*NEWTON")
    return deck


@pytest.mark.each_value
@pytest.mark.parametrize("method", ["NULL SPACE", "SADDLE POINT", "PENALTY"])
@pytest.mark.parametrize("scheme", ["ENERGY MOMENTUM", "ENERGY DECAYING"])
def test_damped_bodies_collide_with_their_books_in_order(scheme, method, tmp_path):
    run = run_deck(crash(scheme), tmp_path, method=method, formulation="NODE TO SURFACE")
    history = run.history
    assert history["active"].max() > 0 and history["active"][-1] == 0
    kept = history["total"] - history["contact_work"] + history["damping_loss"] \
        + history["scheme_loss"]
    assert np.abs(kept - kept[0]).max() < 1e-12*kept[0]
    assert np.abs(history["contact_work"]).max() < 1e-12*kept[0]
    assert history["damping_loss"][-1] > 0.01*kept[0]
    assert (np.diff(history["damping_loss"]) >= 0).all()
    scale = np.abs(history["lz"]).max() + np.abs(history["px"]).max()
    for name in ("px", "py", "lz"):
        assert np.abs(history[name] - history[name][0]).max() < 1e-12*scale, name
    assert run.verdict["verdict"] == "good"
    assert run.verdict["damping_loss"] == pytest.approx(history["damping_loss"][-1], rel=1e-8)
    assert "damping dissipated" in run.log


def test_without_numbers_damping_changes_nothing(tmp_path):
    """ALPHA and BETA of 0 are no damping: the same bits."""
    first = run_deck(crash(beta=0.0), tmp_path/"0", formulation="NODE TO SURFACE").digits()
    deck = crash(beta=0.0)
    deck.remove("*DAMPING")
    deck.remove("*DAMPING")
    assert run_deck(deck, tmp_path/"1", formulation="NODE TO SURFACE").digits() == first


def test_a_restart_goes_on_with_the_same_bits(tmp_path):
    deck = crash()
    k = deck.find("*STEP")
    second = [(head, list(data)) for head, data in deck.card[k:]]
    deck.card[k + 1] = (deck.card[k + 1][0], ["<h>, 0.3"])
    deck.card.insert(k + 2, ("*RESTART, WRITE, FREQUENCY=30", []))
    second.insert(2, ("*RESTART, WRITE, FREQUENCY=0", []))
    deck.card += second
    run = run_deck(deck, tmp_path/"whole", formulation="NODE TO SURFACE")
    assert run.history["damping_loss"][30] > 0
    (tmp_path/"copy").mkdir()
    copy = restart(run, tmp_path/"copy")
    assert "resumed after increment 30" in copy.log
    assert copy.digits() == run.digits()
    assert data_sets(copy.file(".h5")) == data_sets(run.file(".h5"))


def test_statics_are_not_damped(tmp_path):
    runs = []
    for beta in (0.0, 0.5):
        deck = damped(bar(0.25, 1.0), 1.0*bool(beta), beta)
        deck.replace("*DYNAMIC, DIRECT", "*STATIC, DIRECT")
        deck.replace("*END STEP", f"*CLOAD\n{N + 1}, 1, 1.\n*END STEP")
        runs.append(run_deck(deck, tmp_path/str(beta)))
    assert runs[0].digits() == runs[1].digits()
