"""Time and memory of a command, as the system counts them for a small caller."""

import dataclasses
import os
import subprocess
import sys

ENVIRONMENT = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}

# Linux counts the memory of the caller as that of a child at first: a small caller, then.
CALLER = """
import os, sys, time
start = time.monotonic()
child = os.posix_spawn(sys.argv[1], sys.argv[1:], os.environ)
_, status, usage = os.wait4(child, 0)
print("\\nUSAGE", os.waitstatus_to_exitcode(status), usage.ru_utime, usage.ru_stime,
      time.monotonic() - start, usage.ru_maxrss)
"""
# In kB on Linux, in bytes on macOS.
UNIT = 1024**2 if sys.platform == "darwin" else 1024


@dataclasses.dataclass(frozen=True)
class Usage:
    """What one call took: seconds of the processor and of the clock, MiB at most; what it told."""

    code: int
    user: float
    system: float
    wall: float
    memory: float
    text: str
    errors: str

    @property
    def cpu(self):
        return self.user + self.system


def usage(command, folder=None, **environment):
    """Run `command`, its program by the full path, in `folder`; variables besides ENVIRONMENT."""
    done = subprocess.run([sys.executable, "-I", "-S", "-c", CALLER, *map(str, command)],
                          cwd=folder, env={**ENVIRONMENT, **environment}, capture_output=True,
                          text=True)
    text, _, told = done.stdout.rpartition("\nUSAGE ")
    code, user, system, wall, memory = told.split()
    return Usage(int(code), float(user), float(system), float(wall), float(memory)/UNIT, text,
                 done.stderr)
