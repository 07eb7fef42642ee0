"""Where the compiled program is."""

from __future__ import annotations

import shutil
from pathlib import Path


def find_program() -> str | None:
    """The program of this package: within it, or else in the source tree; None: nowhere."""
    package = Path(__file__).resolve().parent
    choices = (package/"bin"/"emcon", package.parents[1]/"build"/"release"/"emcon")
    return next((str(choice) for choice in choices if shutil.which(choice)), None)
