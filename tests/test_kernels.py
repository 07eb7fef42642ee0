"""The kernel tests, one suite at a time, as built for use and with all run-time checks."""

import itertools
import os
import pathlib
import re
import subprocess

import pytest
from scene_tools import RUBBISH

ROOT = pathlib.Path(__file__).resolve().parents[1]
SUITES = re.findall(r'^ *call run\("(\w+)"', (ROOT / "tests/kernels/main.F90").read_text(), re.M)


#: With all checks it takes ten seconds; the kernels of marches, that take one, call the same code.
LONG = {("march_units", "debug")}


@pytest.mark.parametrize(("suite", "mode"), [
    pytest.param(*which, marks=[pytest.mark.long]*(which in LONG))
    for which in itertools.product(SUITES, ["release", "debug"])])
def test_suite(suite, mode):
    program = ROOT / "build" / mode / "kernels"
    done = subprocess.run(
        [program, suite], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120,
        env=os.environ | RUBBISH
    )
    assert done.returncode == 0, done.stdout


def test_every_suite_is_run():
    """A file test_<suite>.f90 that main.F90 forgets would pass unseen."""
    files = {p.stem.removeprefix("test_") for p in (ROOT / "tests/kernels").glob("test_*.f90")}
    assert files == set(SUITES)
