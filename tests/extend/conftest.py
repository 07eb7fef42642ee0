"""Fixtures of extensions against the installed library."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]/"embed"))

from embed_tools import install  # noqa: E402


@pytest.fixture(scope="session")
def installed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of programs that use the installed library."""
    return install(tmp_path_factory.mktemp("installed"))
