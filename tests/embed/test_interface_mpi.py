"""A host of several processes of MPI: the same bits by one, two and three of them."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile

import numpy as np
import pytest
from embed_tools import HERE, SANITIZED
from interface_solid import collision

N_STEP, FRICTION = 10, 0.3
KINDS = ["node to segment", "mortar"]
pytestmark = [pytest.mark.skipif(shutil.which("mpirun") is None, reason="there is no mpirun: apt-get install mpi-default-bin"),
              pytest.mark.skipif(importlib.util.find_spec("mpi4py") is None, reason="there is no mpi4py in this environment"),
              pytest.mark.skipif(SANITIZED, reason="MPI's own leaks would be reported")]


@pytest.fixture(scope="module")
def printed() -> list[dict[str, list[str]]]:
    """What the host prints of each kind by one, two and three processes, of one thread each."""
    return [dict(zip(KINDS, map(str.split, by(n).splitlines()), strict=True)) for n in (1, 2, 3)]


def by(n_process: int) -> str:
    root = ["--allow-run-as-root"] if os.geteuid() == 0 else []
    # Two that begin at once would both make the folder of their sessions.
    with tempfile.TemporaryDirectory() as own:
        done = subprocess.run(["mpirun", *root, "--oversubscribe", "-n", str(n_process), sys.executable,
                               HERE/"interface_mpi.py", str(FRICTION), str(N_STEP), *KINDS], capture_output=True, text=True,
                              timeout=300, env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "TMPDIR": own})
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.parametrize("kind", KINDS)
def test_bits_do_not_depend_on_the_number_of_processes(kind: str, printed: list[dict[str, list[str]]]) -> None:
    """And they are those of the serial host to round-off: impact, sliding, parting."""
    one, two, three = (of[kind] for of in printed)
    assert one == two == three
    host = collision(kind, FRICTION)
    for _ in range(N_STEP):
        host.step(0.01)
    assert host.n_status[2] > 20
    *state, drift = map(float.fromhex, one)
    np.testing.assert_allclose(state[:-1], np.concatenate([host.u.ravel(), host.v.ravel()]), rtol=0, atol=2e-11)
    assert abs(state[-1] - host.lost) < 1e-13 and abs(drift) < 1e-13
