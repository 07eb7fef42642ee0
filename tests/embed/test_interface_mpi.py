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
pytestmark = [pytest.mark.skipif(shutil.which("mpirun") is None, reason="there is no mpirun: apt-get install mpi-default-bin"),
              pytest.mark.skipif(importlib.util.find_spec("mpi4py") is None, reason="there is no mpi4py in this environment"),
              pytest.mark.skipif(SANITIZED, reason="MPI's own leaks would be reported")]


def by(n_process: int, kind: str) -> list[str]:
    """What the host prints with so many processes, of one thread each."""
    root = ["--allow-run-as-root"] if os.geteuid() == 0 else []
    # Two that begin at once would both make the folder of their sessions.
    with tempfile.TemporaryDirectory() as own:
        done = subprocess.run(["mpirun", *root, "--oversubscribe", "-n", str(n_process), sys.executable,
                               HERE/"interface_mpi.py", kind, str(FRICTION), str(N_STEP)], capture_output=True, text=True,
                              timeout=300, env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "TMPDIR": own})
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.split()


@pytest.mark.parametrize("kind", ["node to segment", "mortar"])
def test_bits_do_not_depend_on_the_number_of_processes(kind: str) -> None:
    """And they are those of the serial host to round-off: impact, sliding, parting."""
    one, two, three = (by(n, kind) for n in (1, 2, 3))
    assert one == two == three
    host = collision(kind, FRICTION)
    for _ in range(N_STEP):
        host.step(0.01)
    assert host.n_status[2] > 20
    *state, drift = map(float.fromhex, one)
    np.testing.assert_allclose(state[:-1], np.concatenate([host.u.ravel(), host.v.ravel()]), rtol=0, atol=2e-11)
    assert abs(state[-1] - host.lost) < 1e-13 and abs(drift) < 1e-13
