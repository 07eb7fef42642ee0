"""Contact for codes in Fortran 77: an example, built by the line in its heading, and all calls one by one."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from embed_tools import API, HERE, ROOT, SANITIZED

LIBRARY = ROOT/"build"/("sanitize" if SANITIZED else "release")
EXAMPLE = HERE/"host_77.f"
LOOP = HERE/"contact_loop.f"
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
      CALL EMNEW(IH, 2, 4, X, IERR)
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
FAILING = """
      PROGRAM FAILS
      DOUBLE PRECISION X(2,4), U(8), DU(8), ALAM(2)
      INTEGER IH(3), IHELD(8), IACT(2), IUP(2), ILOW(2)
      COMMON /KIND/ IKIND
      EXTERNAL SOLVE
      DATA X /-1.D0,0.D0, 1.D0,0.D0, -.3D0,.1D0, .3D0,.1D0/, U /8*0.D0/
      DATA DU /4*0.D0, 0.D0,-.2D0, 0.D0,-.2D0/, IHELD /4*1, 4*0/
      DATA IACT /2*0/, ILOW /2,1/, IUP /3,4/
      CALL EMNEW(IH, 2, 4, X, IERR)
      CALL EMSURF(IH, 1, ILOW, IM, IERR)
      CALL EMSURF(IH, 1, IUP, IS, IERR)
      CALL EMRUB(IH, IS, IM, 1, 0.5D0, IERR)
      CALL EMPREP(IH, 4, IHELD, X, M, IERR)
      DO 10 IKIND = 1, 2
         CALL EMSTEP(IH, 4, M, U, DU, DU, IACT, ALAM, SOLVE, IERR)
   10    CALL TELL(IH, IERR)
      WRITE (*,'(F6.2,2I3)') DU(8), IACT
      CALL EMSTEP(IH, 5, M, U, DU, DU, IACT, ALAM, SOLVE, IERR)
      CALL TELL(IH, IERR)
      CALL EMFREE(IH)
      END
      SUBROUTINE SOLVE(NU, DU, IROW, ICOL, SEC, NC, COLS, IERR)
      DOUBLE PRECISION DU(NU), SEC(*), COLS(NU,NC)
      INTEGER IROW(*), ICOL(*)
      COMMON /KIND/ IKIND
      IF (IKIND.EQ.1) IERR = 7
      COLS(5,NC) = 0.D0
      IF (IKIND.EQ.2) COLS(5,NC) = 1.D0/COLS(5,NC)
      END
      SUBROUTINE TELL(IH, IERR)
      INTEGER IH(3), IERR
      CHARACTER*200 TEXT
      CALL EMMSG(IH, 200, TEXT)
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
    """Compile as the heading of the example says."""
    if not shutil.which("gfortran"):
        pytest.skip("there is no gfortran here")
    heading = re.search(r"^C +(gfortran.*\n(?:C {6}.*\n)*)", EXAMPLE.read_text(), re.MULTILINE)
    line = " ".join(part.lstrip("C ").strip() for part in heading[1].splitlines())
    (folder/"host_77.f").write_text(source.read_text())
    shutil.copy(HERE/"fortran_77.c", folder)
    run(line + " -fsanitize=address,undefined -static-libubsan"*SANITIZED, cwd=folder)
    return folder/"host_77"


@pytest.fixture(scope="module")
def example(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(EXAMPLE, tmp_path_factory.mktemp("host_77"))


@pytest.mark.parametrize("friction", [0.0, 0.3, 0.8])
@pytest.mark.parametrize(("form", "kind"), [(1, "NODE TO SURFACE"), (3, "MORTAR")])
def test_an_old_code_does_what_the_program_does(example: Path, form: int, kind: str, friction: float) -> None:
    """Impact in space, sliding, sticking and parting, to round-off."""
    drift, lost, *u = map(float, run([str(example)], input=f"{form} {friction} 12\n").split())
    assert drift < 1e-13 and (lost > 0) == (friction > 0)
    if SANITIZED:
        return                           # Python cannot load the library with a sanitizer in it
    from landing_block import landing

    from emcon import Stepper

    with Stepper(landing(kind, friction)) as program:
        for _ in range(12):
            program.step(0.02)
        np.testing.assert_allclose(np.reshape(u, (-1, 3))[4:], program.u[8:], rtol=0, atol=1e-13)
        assert lost == pytest.approx(program.ledger["friction_loss"], abs=1e-13)


def test_failures_of_the_host_end_the_step(tmp_path: Path) -> None:
    """A solver that returns an error, and one that finds no finite numbers; what was given stays."""
    source = tmp_path/"failing.f"
    source.write_text(FAILING)
    lines = run([str(build(source, tmp_path))]).splitlines()
    assert lines[0].split() == ["3", "the", "function", "that", "solves", "for", "the", "host", "returned", "7"]
    assert lines[1].startswith(" 3 what the host's solver found is not finite")
    assert lines[2].split() == ["-0.20", "0", "0"]
    assert lines[3].startswith(" 2 ") and "NULL" not in lines[3]


def test_a_legacy_code_keeps_its_energy_through_an_impact(tmp_path: Path) -> None:
    rows = [line.split() for line in run([str(build(LOOP, tmp_path))]).splitlines()]
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
