"""The same decks in single, double and quadruple precision: bars in multiples of epsilon.

`make precisions` builds the programs; without them this file is passed over.
"""

import json
import subprocess
import sys

import numpy as np
import pytest
from scene_tools import CRASH, DECKS, ROOT, Run, overrides

sys.path.append(str(ROOT / "tests" / "scenes"))
from plain_scenes import AUTO, Scene, below  # noqa: E402

#: Round-off of a real, what the energy may be off by, and the bar of the verdict. Sums over some
#: hundred increments of some thousand terms take 1e4 epsilon.
EPSILON = {"single": 2.0**-23, "double": 2.0**-52, "quad": 2.0**-112}
BAR = {"single": 1e-4, "double": 1e-10, "quad": 1e-25}
ENERGY = 1e4
FOLDER = {"single": "release-single", "double": "release", "quad": "release-quad"}

#: Decks that run for seconds in double, and what is changed in them. Those of one-sided contact and
#: of coarse arcs overlap a little in every precision.
SCENES = {
    "bouncing_bar": {"t_end": 0.5},
    "ring": {"h": 0.05, "t_end": 0.25},
    "tied_ring": {"t_end": 0.1},
    "self_contact": {"t_end": 0.1},
    "hertz": {},
}

PROGRAMS = {name: ROOT / "build" / folder / "emcon" for name, folder in FOLDER.items()}


def is_current(name):
    """Is the program there, and no older than the one that all other tests run?"""
    path, double = PROGRAMS[name], PROGRAMS["double"]
    return path.exists() and double.exists() and path.stat().st_mtime >= double.stat().st_mtime


missing = [name for name in PROGRAMS if not is_current(name)]
pytestmark = pytest.mark.skipif(
    bool(missing), reason=f"no current program in {' or '.join(missing)} precision: make precisions"
)


def call(precision, *arguments):
    """Call the program of a precision; it must not crash."""
    done = subprocess.run([PROGRAMS[precision], *map(str, arguments)], capture_output=True,
                          text=True, timeout=600)  # fmt: skip
    assert done.returncode in (0, 2, 3, 4), done.stderr
    assert not CRASH.search(done.stdout + done.stderr), done.stderr
    return done


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """`runs(scene)`: the finished runs by precision, each made once."""
    made = {}

    def get(scene):
        if scene not in made:
            made[scene] = {}
            for precision in EPSILON:
                folder = tmp_path_factory.mktemp(f"{scene}_{precision}")
                deck = DECKS / f"{scene}.inp"
                done = call(precision, deck, "--quiet", "--output", folder,
                            *overrides(SCENES[scene]))  # fmt: skip
                assert done.returncode == 0, done.stderr
                made[scene][precision] = Run(folder / scene, done.stderr)
        return made[scene]

    return get


@pytest.mark.parametrize("precision", EPSILON)
@pytest.mark.parametrize("scene", SCENES)
def test_energy_is_kept_to_the_digits_of_the_precision(runs, scene, precision):
    run = runs(scene)[precision]
    verdict = run.verdict
    assert verdict["precision"] == precision
    assert f", {precision} precision, deck " in run.log.splitlines()[0]
    error = verdict["largest_energy_error"]/verdict["largest_energy"]
    assert error < ENERGY*EPSILON[precision] and error < BAR[precision]
    assert all(reason.startswith("bodies overlap") for reason in verdict["reasons"])
    assert verdict["unconverged"] < ENERGY*EPSILON[precision]


#: Increments by the time that a wave takes through an element of the disc: from a twentieth to
#: some ten; the last follows the error, between all of them.
INCREMENTS = {"0.001": 0.02, "0.005": 0.1, "0.02": 0.3, "0.1": 0.6, "0.25": 1.0, "adaptive": 0.1}


@pytest.mark.parametrize("increment", INCREMENTS)
@pytest.mark.parametrize("precision", EPSILON)
def test_an_impact_keeps_energy_with_any_increment(tmp_path, precision, increment):
    """A disc falls askew on a block; energy to the bar of the verdict, at each end of increment."""
    h = 0.02 if increment == "adaptive" else float(increment)
    scene = Scene(h, INCREMENTS[increment])
    scene.disc("DISC", (0.1, 0.501), 0.5, (4, 2), velocity=(0.3, -1.0))
    scene.block("BLOCK", (-1, -0.5), (2, 0.5), (6, 2)).hold("BLOCK", below(-0.5))
    deck = scene.deck(AUTO)
    if increment == "adaptive":
        deck.replace("*DYNAMIC, DIRECT", "*DYNAMIC")
        deck.insert("*TIME INTEGRATION, TOLERANCE=1e-2", before="*CONSTRAINT METHOD")
    done = call(precision, deck.write(tmp_path / "disc.inp"), "--quiet", "--output", tmp_path)
    assert done.returncode == 0, done.stderr
    run = Run(tmp_path / "disc", done.stderr)
    verdict, history = run.verdict, run.history
    if increment == "adaptive":
        assert len(np.unique(np.diff(history["time"]).round(9))) > 1
    assert history["strain"].max() > 0.01*history["kinetic"][0], "it has met the block"
    assert verdict["largest_energy_error"]/verdict["largest_energy"] < BAR[precision]
    # The sums of the file, which holds doubles, whatever the verdict says.
    off = np.abs(history["total"] - history["contact_work"] - history["total"][0])
    assert off.max() < max(BAR[precision], 64*EPSILON["double"])*history["total"][0]


@pytest.mark.parametrize("scene", SCENES)
def test_each_precision_is_nearer_to_quad(runs, scene):
    """Energies and momenta of each increment, against quad: a double is off by its round-off,
    amplified by the motion as that of a single is, so that single tells by how much."""
    runs_of = runs(scene)
    fine = runs_of["quad"].history
    names = ["time", "kinetic", "strain", "px", "py", "lz"]
    off = {}
    for precision in ("single", "double"):
        coarse = runs_of[precision].history
        assert len(coarse) == len(fine)
        off[precision] = max(
            np.max(np.abs(coarse[name] - fine[name]))/max(np.max(np.abs(fine[name])), scale(fine))
            for name in names
        )
    # One in a hundred of the square root: contact sets may differ by a corrector's last residual.
    assert off["double"] < 1e-8
    assert off["single"] < 1e-2
    assert off["double"] < 1e-3*off["single"]


def scale(history):
    """The largest energy: momenta that are nil are told beside it."""
    return np.max(history["kinetic"] + history["strain"])


def test_the_version_says_the_precision():
    for precision in EPSILON:
        assert call(precision, "--version").stdout.endswith(f", {precision} precision\n")


@pytest.mark.parametrize("other", ["single", "quad"])
def test_a_restart_file_of_another_precision_is_refused(tmp_path, other):
    deck = DECKS / "ring.inp"
    done = call("double", deck, "--quiet", "--output", tmp_path, "--set=h=0.05", "--set=t_end=3")
    assert done.returncode == 0, done.stderr
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    done = call(other, "restart", tmp_path / "ring.rst.h5", "--quiet")
    assert done.returncode == 4
    bits = {"single": 32, "quad": 128}[other]
    for words in ("ring.rst.h5", "reals of 64 bits", f"reals of {bits} bits",
                  f"This is {other} precision"):  # fmt: skip
        assert words in done.stderr
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_verdict_tells_its_own_digits(runs):
    """Written out in the log, and in the one line of NAME.json as members that are JSON."""
    for precision, digits in (("single", "four"), ("double", "ten"), ("quad", "twenty-five")):
        run = runs("ring")[precision]
        assert f"closes to {digits} digits or better" in run.log
        assert json.loads(run.file(".json").read_text())["verdict"] == "good"
