"""A Fortran 77 code that takes contact from the library, built by the line in its heading."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from embed_tools import API, HERE, ROOT, SANITIZED

LIBRARY = ROOT/"build"/("sanitize" if SANITIZED else "release")
DRIVER = HERE/"host_driver.f"
EPS = 2.0**-52
# 400 steps, each with a few roundings of an energy of size 1.
DRIFT = 400*EPS

BAD_CALLS = """
      PROGRAM BAD
      DOUBLE PRECISION X(2,4), U(2,4), ANGLE(2)
      INTEGER IH(3), IED(2,1), IOPT(5), IHELD(2,4), IACT(2), ID(2)
      DATA X /0.D0,0.D0, 1.D0,0.D0, 1.D0,1.D0, 0.D0,1.D0/, U /8*0.D0/
      DATA IED /2,9/, IOPT /5*0/, ANGLE /2*0.D0/, IHELD /8*0/
      DATA IH /3*0/, IACT /2*0/
      CALL EMSURF(IH, 1, IED, IS, IERR)
      CALL TELL(IH, IERR)
      CALL EMNEW(IH, 4, X, IERR)
      CALL EMSURF(IH, 1, IED, IS, IERR)
      CALL TELL(IH, IERR)
      IED(2,1) = 1
      CALL EMSURF(IH, 1, IED, IM, IERR)
      IED(1,1) = 4
      IED(2,1) = 3
      CALL EMSURF(IH, 1, IED, IS, IERR)
      CALL EMPAIR(IH, IS, IM, 9, IOPT, ANGLE, IERR)
      CALL TELL(IH, IERR)
      CALL EMPAIR(IH, IS, IM, 1, IOPT, ANGLE, IERR)
      CALL EMPREP(IH, 3, IHELD, X, M, IERR)
      CALL TELL(IH, IERR)
      CALL EMPREP(IH, 4, IHELD, X, M, IERR)
      CALL TELL(IH, IERR)
      CALL EMSEL(IH, 4, M, U, U, IACT, K, IERR)
      CALL TELL(IH, IERR)
      U(2,3) = 0.D0
      U(2,3) = U(2,3)/U(2,3)
      CALL EMBEG(IH, 4, M, U, U, IACT, ID, IERR)
      CALL TELL(IH, IERR)
      CALL EMFREE(IH)
      CALL EMFREE(IH)
      CALL EMPREP(IH, 4, IHELD, X, M, IERR)
      CALL TELL(IH, IERR)
      END
      SUBROUTINE TELL(IH, IERR)
      INTEGER IH(3), IERR
      CHARACTER*200 TEXT
      TEXT = ' '
      IF (IERR.NE.0) CALL EMMSG(IH, 200, TEXT)
      WRITE (*,'(I2,1X,A)') IERR, TEXT
      END
"""
TOLD = [
    "no handle", "edge(2, 1) is 9, not in 1..4", "formulation is 9, not in 1..3",
    "n_node is 3, but the model has 4", "", "no step of contact was begun",
    "u0 is not finite at node 3", "no handle",
]


def run(command: str | list[str], **more: object) -> str:
    done = subprocess.run(command, shell=isinstance(command, str), capture_output=True, text=True,
                          env=os.environ | {"LIB": str(LIBRARY), "INCLUDE": str(API)}, **more)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def build(source: Path, folder: Path) -> Path:
    """Compile as the heading of the driver says."""
    if not shutil.which("gfortran"):
        pytest.skip("there is no gfortran here")
    heading = re.search(r"^C +(gfortran.*\n(?:C {6}.*\n)*)", DRIVER.read_text(), re.MULTILINE)
    line = " ".join(part.lstrip("C ").strip() for part in heading[1].splitlines())
    (folder/"host_driver.f").write_text(source.read_text())
    shutil.copy(HERE/"fortran_77.c", folder)
    run(line + " -fsanitize=address,undefined -static-libubsan"*SANITIZED, cwd=folder)
    return folder/"host_driver"


def test_a_legacy_code_keeps_its_energy_through_an_impact(tmp_path: Path) -> None:
    rows = [line.split() for line in run([str(build(DRIVER, tmp_path))]).splitlines()]
    assert [int(row[0]) for row in rows] == [1, 2, 3]
    for _, steps, touching, drift, gap, before, after in rows:
        assert 0 < int(touching) < int(steps)
        assert float(drift) <= DRIFT
        assert float(gap) >= 0
        assert float(before) == -1 and float(after) > 0.5


def test_bad_calls_are_told_in_words(tmp_path: Path) -> None:
    source = tmp_path/"bad_calls.f"
    source.write_text(BAD_CALLS)
    lines = run([str(build(source, tmp_path))]).splitlines()
    assert len(lines) == len(TOLD)
    for line, text in zip(lines, TOLD):
        assert text in line and int(line.split()[0]) == (2 if text else 0)
