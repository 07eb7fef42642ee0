"""Arrays of the C interface: nothing beside them is touched, wrong counts are refused."""

from __future__ import annotations

from pathlib import Path

from embed_tools import HERE, ROOT, build, check_memory


def test_arrays_of_exact_size(installed: dict[str, str], tmp_path: Path) -> None:
    """Also after the unknowns have changed between an evaluation and what is asked of it."""
    program = tmp_path/"exact_arrays"
    build("cc", HERE/"exact_arrays.c", program, installed, "-std=c99")
    check_memory(installed, program, ROOT/"input_decks"/"contact_patch.inp")


def test_arrays_of_an_interface(installed: dict[str, str], tmp_path: Path) -> None:
    """Of C and of Fortran 77: counts up to the largest integer are refused."""
    program = tmp_path/"exact_interface"
    build("cc", HERE/"exact_interface.c", program, installed, "-std=c99")
    check_memory(installed, program)
