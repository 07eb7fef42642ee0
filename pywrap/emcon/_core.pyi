"""The compiled extension: one object for each module of flat calls. Their signatures: `__doc__`."""

from typing import Any

emcon_flat: Any
emcon_flat_conditions: Any
emcon_flat_given: Any
emcon_flat_interface: Any
emcon_flat_interface_step: Any
emcon_flat_query: Any
emcon_flat_source: Any
emcon_flat_state: Any
