"""Studies: a deck run with many settings, what each buys in accuracy and costs in time.

    python -m emcon study ring.inp --vary h=0.1,0.05,0.025 --goal rebound:1e-2

`plan` says what is run, `execution` runs it, `measures` tells what a run gave, `accuracy` how far
two runs are apart, `reference` against which one, `choice` which setting pays, `report` and
`figures` show it, `command` is the command line. `deck` reads decks and refines their meshes.
"""

from .command import add_arguments, run_study
from .errors import StudyError
from .measures import NAMES, measure

__all__ = ["NAMES", "StudyError", "add_arguments", "measure", "run_study"]
