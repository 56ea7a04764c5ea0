"""From what a flow computed to the parts of a Dataset that all analyses share: guards, counters, provenance, contacts and their errors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from saltus.analysis.starts import Ensemble
from saltus.flow.engine import Outcome
from saltus.flow.methods import Method
from saltus.kernels import status as st
from saltus.results import Contacts, Guards, attributes
from saltus.system.dimensions import units_of
from saltus.system.evaluate import evaluate
from saltus.system.system import System


def shared_values(system: System, group: Ensemble) -> dict[str, float]:
    """Parameter values of the first trajectory."""
    return dict(zip(system.values, (float(v) for v in group.parameters[0]), strict=True))


def guards(system: System, group: Ensemble) -> Guards:
    """The guards with their boundaries, one for each trajectory where a varied parameter moves them."""
    return guards_over(system, {**shared_values(system, group), **group.varied}, (group.size,))


def guards_over(system: System, values: Mapping[str, Any], shape: tuple[int, ...]) -> Guards:
    """The guards with their boundaries; of this shape where a parameter that is given as an array moves one of them."""
    places = []
    for guard in system.guards:
        place = np.nan if guard.boundary is None else evaluate([guard.boundary], values=values)[0]
        places.append(np.broadcast_to(place, shape if np.ndim(place) else ()))
    if any(np.ndim(place) for place in places):
        places = [np.broadcast_to(place, shape) for place in places]
    return Guards([g.name for g in system.guards], [g.state for g in system.guards], np.array(places, float), gap_units(system))


def gap_units(system: System) -> list[str]:
    """Unit of the gap of each guard, ``""`` where it isn't known."""
    return list(_gap_units(system.origin))


@lru_cache(maxsize=64)  # the same for all values, and as long to find as a short run
def _gap_units(system: System) -> tuple[str, ...]:
    found = units_of(system.states, system.units, system.field, [guard.gap for guard in system.guards])
    return tuple(unit if guard.state is None else system.units[guard.state] for guard, unit in zip(system.guards, found, strict=True))


def common(system: System, method: Method, group: Ensemble, outcome: Outcome) -> dict[str, Any]:
    """The arguments that every Dataset of trajectories takes."""
    return dict(
        states=system.states,
        units=system.units,
        guards=guards(system, group),
        status=[st.STATUS[int(code)][0] for code in outcome.status],
        counters={name: outcome.counters[:, i] for i, name in enumerate(st.COUNTERS)},
        minima={name: outcome.minima[:, i] for i, name in enumerate(st.MINIMA)},
        varied=group.varied,
        batch=group.batch,
        attrs=provenance(system, method, shared_values(system, group), group.varied),
    )


def provenance(system: System, method: Method, values: Mapping[str, float], varied: Iterable[str] = ()) -> dict[str, Any]:
    """Attributes that say where a result comes from; ``values`` are those of its parameters, but for the ``varied`` ones."""
    return attributes(
        system=system.name,
        equations=system.equations(),
        parameters=values,
        units=system.units,
        method=method.name,
        method_options=method.options(),
        fingerprint=system.fingerprint(),
        source=system.source,
        varied=varied,
    )


def gap_unit(system: System) -> str:
    """Unit of the gaps of all guards, ``""`` if they differ or aren't known."""
    units = set(gap_units(system))
    return units.pop() if len(units) == 1 else ""


def contacts(outcome: Outcome, states: int, time_error: np.ndarray) -> Contacts:
    """The table of contacts."""
    table = outcome.contacts
    same = ("trajectory", "time", "guard", "direction", "velocity", "mode_before", "mode_after", "steps")
    columns = {name: getattr(table, name) for name in same}
    return Contacts(**columns, time_error=time_error, kind=table.kind_name, states=table.state[:, :states])
