"""The compiled extension: the functions of emcon.h, and its constants.

It is made from this header. Signatures: `__doc__` of each function.
"""

from typing import Any

STRUCTURES: str

def __getattr__(name: str) -> Any: ...
