"""The decks of input_decks/ with contact of both sides, and of everything with everything."""

import pytest
from contact_sides import ALL, ONE, FileScene
from scene_tools import DECKS, run_deck


@pytest.mark.parametrize(("name", "parameters"), [
    ("tied_rotation", {}),
    ("tied_spin", {"t_end": 1}),
    ("tied_spin", {"t_end": 1, "multiplier": "STANDARD"}),
    ("spinning_ring", {"t_end": 0.5}),
])
def test_what_meets_nothing_has_no_contact(tmp_path, name, parameters):
    """Tied pieces neither: with contact of everything with everything the bits are the same."""
    scene = FileScene(DECKS / f"{name}.inp")
    without, with_all = (run_deck(scene.deck(sides), tmp_path / sides, **parameters)
                         for sides in (ONE, ALL))
    assert with_all.history["active"].max() == 0
    assert with_all.digits() == without.digits()
