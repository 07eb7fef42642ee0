"""The chapters of docs/verification.md: each module runs its decks, makes tables and figures."""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
PARTS = ("tests", "tests/scenes", "tests/extremes", "input_decks")
sys.path[:0] = [str(ROOT / part) for part in PARTS]
