"""Equations of three dimensions that what is prescribed contradicts, or fulfils already."""

from __future__ import annotations

from pathlib import Path

import pytest
from scene_tools import emcon
from space_mesh import Block


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_what_is_prescribed_at_both_ends(axis: int, tmp_path: Path) -> None:
    """Equal values fulfil an equation of the two; unequal ones are told, with their nodes."""
    mesh = Block("C3D8", (2, 1, 1), (2, 1, 1))
    one, other = (mesh.label[place] for place in [(2, 0, 1), (2, 1, 1)])
    foot = "".join(f"{k}, 1, 3\n" for k in mesh.on(0, 0))
    for k, value in enumerate((0.01, 0.02)):
        deck = mesh.deck("*ELASTIC\n100., 0.3\n",
                         f"*EQUATION\n2\n{one}, {axis}, 1., {other}, {axis}, -1.\n"
                         f"*BOUNDARY\n{foot}{one}, {axis}, {axis}, 0.01\n"
                         f"{other}, {axis}, {axis}, {value}\n"
                         "*STEP\n*STATIC\n1., 1.\n*NODE FILE\nU\n*END STEP\n")
        (tmp_path/f"{k}.inp").write_text(deck)
        done = emcon(tmp_path/f"{k}.inp", "--quiet", "--output", tmp_path)
        assert done.returncode == (0 if value == 0.01 else 2), done.stderr
        if done.returncode:
            low, high = sorted((one, other))
            assert "*EQUATION 1 contradicts what is prescribed at nodes " \
                f"{low}, {high}:" in done.stderr
