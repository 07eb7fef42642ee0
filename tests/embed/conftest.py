"""Fixtures of the programs against the installed library."""

from __future__ import annotations

import os

import pytest
from embed_tools import ROOT, run


@pytest.fixture(scope="session")
def installed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of programs that use the installed library."""
    prefix = tmp_path_factory.mktemp("installed")
    run("make", "install", f"PREFIX={prefix}", cwd=ROOT)
    return os.environ | {"PKG_CONFIG_PATH": str(prefix/"lib"/"pkgconfig"),
                         "LD_LIBRARY_PATH": str(prefix/"lib"), "PREFIX": str(prefix)}
