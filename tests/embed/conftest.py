"""Fixtures of the programs against the installed library."""

from __future__ import annotations

import pytest
from embed_tools import install


@pytest.fixture(scope="session")
def installed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of programs that use the installed library."""
    return install(tmp_path_factory.mktemp("installed"))
