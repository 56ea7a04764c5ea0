"""Units of the gaps of a system's guards."""

from __future__ import annotations

from functools import lru_cache

from saltus.contact.reduction import free_field
from saltus.language.dimensions import units_of
from saltus.language.roots import with_root
from saltus.system.system import System


def gap_units(system: System) -> list[str]:
    """Unit of the gap of each guard of a system, ``""`` where it isn't known."""
    return list(_gap_units(system.origin))


@lru_cache(maxsize=256)  # the same for all values, and as slow to find as a short run
def _gap_units(system: System) -> tuple[str, ...]:
    gaps = [with_root(guard.gap) for guard in system.guards]
    found = units_of(system.states, system.units, free_field(system.field, system.guards), gaps)
    return tuple(
        unit if guard.state is None else system.units[guard.state]
        for guard, unit in zip(system.guards, found, strict=True)
    )
