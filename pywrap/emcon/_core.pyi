"""The compiled extension: the functions of emcon.h and emcon_interface.h, and their constants.

It is made from these headers. Signatures: `__doc__` of each function.
"""

from typing import Any

STRUCTURES: str

def __getattr__(name: str) -> Any: ...
