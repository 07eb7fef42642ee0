"""Fixtures for all tests. Helpers to import are in scene_tools.py, beside this file."""

import collections
import concurrent.futures
import functools
import gc
import os
import pathlib
import random
import re
import signal

import pytest

# Threads that wait for work keep processors busy. An OpenBLAS with OpenMP looks at the first of these
# alone, others at the second; threads of our own wait as the third says. Tests of threads set them anew. Before numpy is loaded.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

import scene_tools  # noqa: E402

# What a script runs in the background is told to ignore Ctrl-C; what is tested here is not.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# A run puts its results on the disc before it ends: small ones would wait for that as long as they compute.
MEMORY = pathlib.Path("/dev/shm")
#: What of it must be free, in bytes: more than all that tests have at a time.
ROOM = 4e9

# Whole runs of the ring scene that tests of several files look at, dearest first.
RING_RUNS = [
    ("AUTO", 0.01),
    ("PERSISTENT", 0.01),
    ("ADMISSIBLE", 0.01),
    ("VELOCITY UPDATE", 0.01),
    ("VELOCITY UPDATE", 0.02),
    ("PERSISTENT", 0.02),
    ("ADMISSIBLE", 0.02),
    ("VELOCITY UPDATE", 0.05),
    ("ADMISSIBLE", 0.05),
    ("PERSISTENT", 0.05),
]


def pytest_addoption(parser):
    parser.addoption("--order", metavar="SEED", help="run the tests in an order drawn by chance: "
                     "files, and the tests of a file")
    parser.addoption("--long", action="store_true", help="tests marked as long as well")


def holds_programs(folder):
    """May programs be run from `folder`, and is there room for all that tests write?"""
    if not os.access(folder, os.W_OK | os.X_OK):
        return False
    system = os.statvfs(folder)
    free = re.search(r"^MemAvailable: *(\d+) kB", pathlib.Path("/proc/meminfo").read_text(), re.M)
    return (not system.f_flag & os.ST_NOEXEC and free is not None
            and min(system.f_bavail*system.f_frsize, int(free[1])*1024) > ROOM)


def pytest_configure(config):
    """Folders of tests in memory, unless the caller has named a place."""
    named = {"TMPDIR", "TEMP", "TMP", "PYTEST_DEBUG_TEMPROOT"} & set(os.environ)
    if config.option.basetemp is None and not named and holds_programs(MEMORY):
        os.environ["PYTEST_DEBUG_TEMPROOT"] = str(MEMORY)


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """What is collected stays to the end: no search for garbage looks at it."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()


def mark_what_others_show(items):
    """Of a test marked `each_value` as many cases are quick as hold each value of each parameter."""
    cases = collections.defaultdict(list)
    for item in items:
        if item.get_closest_marker("each_value") and not item.get_closest_marker("long"):
            values = {(name, id(value)) for name, value in item.callspec.params.items()}
            cases[item.function].append((values, item))
    for left in cases.values():
        n_seen = dict.fromkeys(set().union(*(values for values, _ in left)), 0)
        while 0 in n_seen.values():
            case = max(left, key=lambda case: (sum(n_seen[v] == 0 for v in case[0]),
                                               -sum(n_seen[v] for v in case[0])))
            for value in case[0]:
                n_seen[value] += 1
            left.remove(case)
        for _, item in left:
            item.add_marker("long")


def pytest_collection_modifyitems(config, items):
    """Long tests are left out unless asked for; no test may need another one to have run before it."""
    mark_what_others_show(items)
    if not config.getoption("--long"):
        config.hook.pytest_deselected(items=[item for item in items if item.get_closest_marker("long")])
        items[:] = [item for item in items if not item.get_closest_marker("long")]
    seed = config.getoption("--order")
    if seed is None:
        return
    chance = random.Random(seed)
    place = {path: chance.random() for path in dict.fromkeys(item.path for item in items)}
    items.sort(key=lambda item: (place[item.path], chance.random()))


@functools.cache
def runs_of(path):
    """Name of the runs that the tests of a file share; None if each makes its own."""
    text = (pathlib.Path(__file__).parent / path).read_text()
    if re.search(r"^def test_\w+\([^)]*\bring\b", text, re.M) and "def ring(" not in text:
        return "ring"
    return path if 'scope="module"' in text else None


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """One worker gets all tests that look at the same runs: those are made once."""
    from xdist.scheduler import LoadScopeScheduling

    class Scheduling(LoadScopeScheduling):
        def _split_scope(self, nodeid):
            return runs_of(nodeid.split("::")[0]) or nodeid

    return Scheduling(config, log)


@pytest.fixture(scope="session")
def ring(tmp_path_factory):
    """`ring(initiation, h)` is the finished run; each is made once, two at a time."""
    folder = tmp_path_factory.mktemp("ring")
    pool = concurrent.futures.ThreadPoolExecutor(1 if "PYTEST_XDIST_WORKER" in os.environ else 2)
    waiting = {}

    def run(initiation, h):
        return scene_tools.run_deck(
            scene_tools.DECKS / "ring.inp",
            folder / f"{initiation.split()[0].lower()}_{h}",
            initiation=initiation,
            h=h,
        )

    def ring_run(initiation, h):
        # The one asked for first; the others will be asked for too, unless tests are deselected.
        for key in [(initiation, h), *RING_RUNS]:
            if key not in waiting:
                waiting[key] = pool.submit(run, *key)
        return waiting[initiation, h].result()

    yield ring_run
    pool.shutdown(cancel_futures=True)
