"""Output variables that users of other programs ask for."""

import numpy as np
from plain_scenes import ONE, Scene
from scene_tools import run_deck


def test_places_and_strains_by_their_other_names(tmp_path):
    """COORD is where a node is, in both files; ME is E where nothing expands by heat."""
    scene = Scene(0.01, 0.1)
    scene.block("BODY", (0.5, 0.2), (1.0, 1.0), (3, 3), velocity=(0.3, -1.0), spin=2.0)
    deck = scene.deck(ONE)
    deck.insert("*NODE PRINT, NSET=BODY\nU, COORD\n*EL PRINT, ELSET=BODY\nME", before="*NODE FILE")
    deck.replace("*NODE FILE\nU", "*NODE FILE\nU, COORD")
    run = run_deck(deck, tmp_path, formulation="NODE TO SURFACE")
    start = np.array([scene.part["BODY"].node[label] for label in sorted(scene.part["BODY"].node)])
    u, place = (run.series("BODY", name)[1] for name in ("U", "COORD"))
    assert (place == start + u).all() and np.abs(u[-1]).max() > 0.1
    fields = run.fields()
    assert (fields["position"][-1] == fields.x + fields["displacement"][-1]).all()
    assert run.series("BODY", "E")[1].shape[1:] == (9, 3)
