"""Rows of one body: strains, ratios of Poisson, aspects, offsets, rotations, units."""

import functools
import tempfile

import numpy as np
from plain_scenes import AUTO, Scene, below
from scene_tools import number, run_deck

from .common import (
    Row,
    energy_error,
    one_element,
    with_penetration,
    with_velocities,
)

# ---- strain -------------------------------------------------------------------------------------

LAME, SHEAR = 100*0.3/(1.3*0.4), 100/2.6


def stretched(excess):
    """One element pulled along x to 1 + excess, all nodes driven, in four increments."""
    return one_element(nlgeom=True, cards="", step=(
        f"*STATIC\n0.25, 1.\n*BOUNDARY\n1, 1, 2\n4, 1, 2\n2, 1, 1, {number(excess)}\n2, 2\n"
        f"3, 1, 1, {number(excess)}\n3, 2\n*EL FILE\nS, ENER\n*NODE FILE\nU\n"))


def strain_error(run, excess):
    """Energy against 1/2 (lambda + 2 mu) E^2, E = e + e^2/2, and the Cauchy stress (1 + e) S."""
    strain = excess + excess*excess/2
    energy = 0.5*(LAME + 2*SHEAR)*strain**2
    stress = (1 + excess)*(LAME + 2*SHEAR)*strain
    history, fields = run.history, run.fields()
    found = fields["cauchy_stress"][-1].reshape(-1)[0]
    return max(abs(history["strain"][-1]/energy - 1), abs(found/stress - 1))


# ---- Poisson's ratio ----------------------------------------------------------------------------


def bent(ratio, kind="CPE4"):
    """A cantilever, 60 by 6 elements, under a small load at its end."""
    scene = Scene(1, 1)
    scene.block("BEAM", (0, 0), (10, 1), (60, 6)).hold("BEAM", lambda x, y: x < 1e-9)
    deck = scene.deck(AUTO)
    deck.replace("100.0, 0.3", f"100.0, {ratio!r}")
    deck.replace("*HYPERELASTIC, COUPLED NEO HOOKE", "*ELASTIC")
    deck.replace("*DYNAMIC, DIRECT\n<h>, <t_end>", "*STATIC\n1., 1.")
    deck.replace("TYPE=CPE4", f"TYPE={kind}")
    tip = [label for label, p in scene.part["BEAM"].node.items() if p[0] > 10 - 1e-9]
    deck.replace("*NODE FILE", "*CLOAD\n" + "\n".join(f"{n}, 2, -1e-7" for n in tip) + "\n*NODE FILE")
    return deck


def deflection_error(run, ratio):
    """Beam theory with shear, in plane strain; the clamp takes a percent."""
    modulus, force = 100/(1 - ratio**2), 7e-7
    exact = force*(10**3/(3*modulus/12) + 10/(5/6*100/(2*(1 + ratio))))
    fields = run.fields()
    tip = fields["displacement"][-1][fields.x[:, 0] > 10 - 1e-9, 1].mean()
    return abs(tip/-exact - 1)


# ---- aspect -------------------------------------------------------------------------------------


def flat_elements(ratio, make=Scene):
    """A disc falls on a layer of elements so many times as long as high."""
    scene = make(0.01, 0.3)
    scene.disc("DISC", (0.1, 0.51), 0.5, (4, 2), velocity=(0.1, -1))
    scene.block("LAYER", (-1, -0.5/ratio), (2, 0.5/ratio), (4, 1)).hold("LAYER", below(-0.5/ratio))
    return scene.deck(AUTO)


# ---- separation of scales -----------------------------------------------------------------------


def falling(value):
    """One element in free fall: rho L^2/(E h^2), and offset / size."""
    scale, offset = value
    size = 0.7
    h = (size**2/(100*scale))**0.5
    gravity = 0.1/h**2
    return one_element(size, at=(offset, -offset), step=(
        f"*DYNAMIC, DIRECT\n{h!r}, {10*h!r}\n*DLOAD\nONE, GRAV, {gravity!r}, 0., -1.\n"
        "*NODE FILE\nU, V\n"))


def fall_error(run, _):
    """g t^2/2 of ten increments of 0.1/h^2, 5, which mid-point inertia gives exactly."""
    u = run.fields()["displacement"][-1]
    return max(np.abs(u[:, 1]/-5.0 - 1).max(), np.abs(u[:, 0]/5).max())


SCALES = tuple(10.0**k for k in (-20, -16, -12, -8, -4, 0, 4, 8, 12, 16, 20))
OFFSETS = (0.0, 1e3, 1e6, 1e9, 1e12)


# ---- rotation -----------------------------------------------------------------------------------


def spinning(angle):
    """A block that turns by so many radians in each increment."""
    scene = Scene(0.1, 10)
    scene.block("BLOCK", (0, 0), (2, 1), (4, 2), spin=angle/0.1, stiffness=1e4*angle**2)
    return scene.deck(AUTO)


def spin_error(run, _):
    history = run.history
    return max(energy_error(run), np.abs(history["lz"]/history["lz"][0] - 1).max())


# ---- units --------------------------------------------------------------------------------------


def impact(length=1.0, mass=1.0, time=1.0, make=Scene):
    """A disc on a block, in units so many times as small."""
    scene = make(0.01*time, 0.6*time)
    # A length more in space: of a volume, and of what a stress acts on.
    thick = 1.0 if make is Scene else length
    speed, density = length/time, mass/length**2/thick
    stiffness = mass/time**2/thick
    scene.disc("DISC", (0.1*length, 0.51*length), 0.5*length, (4, 2), velocity=(0.1*speed, -speed),
               stiffness=100*stiffness, density=density)
    scene.block("BLOCK", (-length, -0.5*length), (2*length, 0.5*length), (6, 2),
                stiffness=1000*stiffness, density=density)
    scene.hold("BLOCK", lambda _, y: y < -0.5*length*(1 - 1e-9))
    return scene.deck(AUTO)


def in_units(value, make=Scene):
    kind, factor = value
    return impact(**{kind: factor}, make=make)


def unit_error(run, value, make=Scene):
    """The rebound is that of units 1, to what rounding grows to on a motion through contact."""
    return max(energy_error(run), abs(rebound_of(run)/rebound(make) - 1))


def rebound_of(run):
    history = run.history
    upwards = history["pz" if "pz" in history.dtype.names else "py"]
    return upwards[-1]/upwards[0]


@functools.cache
def rebound(make):
    with tempfile.TemporaryDirectory() as folder:
        return rebound_of(run_deck(impact(make=make), folder))


UNITS = tuple((kind, 10.0**k) for kind in ("length", "mass", "time") for k in (-30, -15, 15, 30))

ROWS = [
    Row("strain", "strain of an element, driven: 1e-12 to 9", (
        1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 4.0, 9.0), stretched, strain_error,
        "energy and stress, relative", bar=1e-8, reach=8),
    Row("poisson", "Poisson's ratio of a cantilever, 60 by 6 `CPE4`",
        (0.3, 0.45, 0.49, 0.499, 0.4999, 0.49999, 0.4999999), bent, deflection_error,
        "error of the deflection against beam theory", bar=0.1, warns="body .* locks.*", reach=2,
        why="plain four-node elements lock: volume is constrained at four points of each"),
    Row("poisson_mean", "the same of `CPE4H`",
        (0.3, 0.45, 0.49, 0.499, 0.4999, 0.49999, 0.4999999),
        functools.partial(bent, kind="CPE4H"), deflection_error, "error of the deflection against beam theory", bar=0.1,
        reach=7, short=(0, -1)),
    Row("aspect", "length / height of elements that a disc falls on",
        (1, 1e2, 1e3, 1e4, 1e5), with_velocities(flat_elements), with_penetration, "energy, overlap", reach=5),
    Row("scale", "rho L^2/(E h^2) of an element in free fall",
        tuple((10.0**k, 0.0) for k in (0, 4, 8, 12, 16, 20, -4, -8, -12, -16, -20)), falling,
        fall_error, "position after ten increments", bar=1e-8, reach=8, short=(0, 5, 7, -1),
        why="inertia, rho L^3/h^2, is smaller than forces due to round-off of strains, eps E L"),
    Row("offset", "offset / size of an element in free fall",
        tuple((1.0, 10.0**k) for k in (0, 3, 6, 9, 12)), falling, fall_error,
        "position after ten increments", bar=1e-8, reach=5,
        why="the positions of the nodes themselves are rounded to eps times the offset"),
    Row("grid", "both: rho L^2/(E h^2), and offset / size",
        tuple((scale, offset) for scale in SCALES for offset in OFFSETS), falling, fall_error,
        "position after ten increments", bar=1e-8, reach=0, short=(3*len(OFFSETS) - 1, 4*len(OFFSETS) - 1, -1),
        why="that of the one or of the other: below"),
    Row("rotation", "radians that a block turns by in an increment",
        (0.1, 0.5, 1.0, 2.0, 3.0, 6.0), spinning, spin_error, "energy, angular momentum", reach=6),
    Row("units", "units of length, mass and time", UNITS, in_units, unit_error, "energy; rebound", bar=1e-6, reach=12, short=(0, 4, -1)),
]
