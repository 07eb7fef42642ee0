"""A few cases of each fuzzer; `make soak` runs more."""

import pytest
from soak import FUZZERS, soak

CASES = {"decks": 25, "restart": 12, "calls": 4, "kill": 1}


@pytest.mark.parametrize("name", FUZZERS)
def test_a_few_cases(name, tmp_path):
    assert soak(name, 1, tmp_path, cases=CASES[name]) == CASES[name]
