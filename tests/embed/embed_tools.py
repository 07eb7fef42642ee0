"""What the tests of programs against the installed library share."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HERE = Path(__file__).parent
API = ROOT/"src_f90"/"border"
#: The library has the address sanitizer in it (`make sanitize`), and so must programs have.
SANITIZED = os.environ.get("MODE") == "sanitize"
WARNINGS = ["-pedantic", "-Wall", "-Wextra", "-Werror"]


def run(*command: object, **more: object) -> str:
    """What the command prints; it has to succeed."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, **more)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def install(prefix: Path) -> dict[str, str]:
    """Install the library under `prefix`; the environment of programs that use it."""
    run("make", "install", f"PREFIX={prefix}", cwd=ROOT)
    return os.environ | {"PKG_CONFIG_PATH": str(prefix/"lib"/"pkgconfig"),
                         "LD_LIBRARY_PATH": str(prefix/"lib"), "PREFIX": str(prefix)}


def need(program: str) -> None:
    if not shutil.which(program):
        pytest.skip(f"there is no {program} here")


def build(compiler: str, source: Path, program: Path, env: dict[str, str], *options: str) -> None:
    """Compile and link by what pkg-config says, with warnings as errors."""
    need(compiler)
    flags = run("pkg-config", "--cflags", "--libs", "emcon", env=env).split()
    run(compiler, *WARNINGS, *options, source, "-o", program, *flags, "-lm", env=env,
        cwd=program.parent)
