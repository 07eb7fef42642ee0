"""Threads share the work of a model, and no bit of a result depends on how many there are."""

import os
import pathlib
import subprocess
import sys

import h5py
import numpy as np
import pytest
from emcon import InputError, Stepper
from scene_tools import DECKS, coarse_ring, emcon, made, run_deck

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1]/"bench"))

import bench_contacts_space  # noqa: E402
import bench_space  # noqa: E402

SCENES = {
    "ring": {"h": 0.04, "t_end": 0.4, "frame": 0.4},
    "ring, MORTAR": {"h": 0.04, "t_end": 0.4, "frame": 0.4, "formulation": "MORTAR"},
    "ring, Newton": {"h": 0.04, "t_end": 0.2, "frame": 0.2, "method": "SADDLE POINT"},
    "tied_ring": {"h": 0.05, "t_end": 0.2},
    "press_fit": {},
    "sliding_block": {"t_end": 0.4},
}
RING = DECKS/"ring.inp"


def arrays(file):
    """The numbers that a file holds, without times of the processor."""
    found = {}

    def take(name, item):
        if isinstance(item, h5py.Dataset) and "cpu" not in name and "SECONDS" not in name:
            found[name] = item[()]

    with h5py.File(file) as content:
        content.visititems(take)
    return found


def results(scene, folder, *options):
    name = scene.split(",")[0]
    deck = coarse_ring() if name == "ring" else DECKS/f"{name}.inp"
    run = run_deck(deck, folder, options=options, **SCENES[scene])
    return run.digits(), arrays(run.file(".vtkhdf"))


@pytest.mark.parametrize("scene", SCENES)
def test_bits_do_not_depend_on_threads(scene, tmp_path):
    history, fields = results(scene, tmp_path/"1", "--threads", "1")
    assert fields, "there is something to compare"
    for n in (2, 3, 4, 7):
        other_history, other_fields = results(scene, tmp_path/str(n), f"--threads={n}")
        assert other_history == history, f"{n} threads"
        assert other_fields.keys() == fields.keys()
        for name, values in fields.items():
            same = np.asarray(other_fields[name]).tobytes() == np.asarray(values).tobytes()
            assert same, f"{n} threads: {name}"


def test_bits_of_large_bodies_do_not_depend_on_threads(tmp_path):
    """Both bodies have factors of dense blocks, made at a time."""
    deck = made("ring", tmp_path, "--ring", "128x8", "--block", "120x10")
    found = [run_deck(deck, tmp_path/f"{k}", options=["--threads", f"{n}"],
                      h=0.01, t_end=0.14, frame=1).digits() for k, n in enumerate((1, 2, 2, 3))]
    assert all(other == found[0] for other in found[1:])


@pytest.mark.parametrize("scene", ["dynamics", "statics", "contact"])
def test_bits_of_iterated_bodies_do_not_depend_on_threads(scene, tmp_path):
    """Of bodies that are large enough for threads to share the incomplete factor and vectors."""
    deck = tmp_path/"bodies.inp"
    if scene == "contact":
        bench_contacts_space.write(deck, (9, 9, 8), 3, True)
        deck.write_text(deck.read_text().replace("*DYNAMIC, DIRECT", "*DYNAMIC, DIRECT, SOLVER=ITERATIVE"))
    else:
        bench_space.write(deck, (14, 11, 11), "C3D8", 2, "ITERATIVE", scene == "statics")
    runs = [run_deck(deck, tmp_path/f"{n}", options=[f"--threads={n}"]) for n in (1, 2, 3)]
    assert runs[0].verdict["counts"]["solutions"] > 0
    for run in runs[1:]:
        assert run.digits() == runs[0].digits()
        for name, values in arrays(runs[0].file(".vtkhdf")).items():
            assert np.asarray(arrays(run.file(".vtkhdf"))[name]).tobytes() == np.asarray(values).tobytes(), name


def script_of(code):
    """Take a step of the ring after `code`, and print how many threads the process has then."""
    return f"""
import os
from emcon import Stepper
with Stepper({str(RING)!r}, h=0.04) as stepper:
    {code}
    stepper.step()
    print(len(os.listdir("/proc/self/task")))
"""


@pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="counted by Linux")
@pytest.mark.parametrize(("code", "asked", "more"), [
    ("pass", None, 0), ("pass", "3", 2), ("stepper.set_threads(4)", "3", 3),
    ("pass", "none", 0), ("pass", "2,4", 1)])
def test_as_many_threads_as_are_asked_for(code, asked, more):
    environment = {k: v for k, v in os.environ.items() if k != "OMP_NUM_THREADS"}
    environment["OPENBLAS_NUM_THREADS"] = "1"
    if asked:
        environment["OMP_NUM_THREADS"] = asked
    done = subprocess.run([sys.executable, "-c", script_of(code)], env=environment, check=True,
                          capture_output=True, text=True, timeout=60)
    assert int(done.stdout) == 1 + more


@pytest.mark.parametrize("value", ["0", "-2", "two", "1000000", "99999999999"])
def test_no_such_number_of_threads(value):
    done = emcon(RING, f"--threads={value}")
    assert done.returncode == 2
    assert "--threads" in done.stderr


def test_no_such_number_of_threads_in_python():
    with Stepper(RING) as stepper, pytest.raises(InputError, match="0 threads"):
        stepper.set_threads(0)
