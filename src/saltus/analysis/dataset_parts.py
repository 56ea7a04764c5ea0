"""From what a flow computed to the parts of a Dataset that all analyses share: guards, counters,
provenance.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from saltus.analysis.inputs.outputs import outputs_of
from saltus.analysis.inputs.starts import Ensemble
from saltus.contact.guards import is_hold
from saltus.flow.contact_table import ContactTable
from saltus.flow.methods import Method, note_on
from saltus.flow.request import Outcome
from saltus.flow.until import STATUS
from saltus.kernels import status as st
from saltus.language.evaluate import evaluate
from saltus.results import Guards, Subject, attributes
from saltus.system import System, gap_units, margin_gaps
from saltus.system.quantity import jumping_states


def shared_values(system: System, group: Ensemble) -> dict[str, float]:
    """Parameter values of the first trajectory."""
    return dict(zip(system.values, (float(v) for v in group.parameters[0]), strict=True))


def guards(system: System, group: Ensemble) -> Guards:
    """The guards with their boundaries, one for each trajectory where a varied parameter moves
    them.
    """
    return guards_over(system, {**shared_values(system, group), **group.varied}, (group.size,))


def guards_over(system: System, values: Mapping[str, Any], shape: tuple[int, ...]) -> Guards:
    """The guards with their boundaries; of this shape where a parameter that is given as an array
    moves one of them.
    """
    boundaries = [guard.boundary for guard in system.guards]
    found = iter(evaluate([one for one in boundaries if one is not None], values=values))
    places = [np.nan if one is None else next(found) for one in boundaries]
    if any(np.ndim(place) for place in places):
        places = [np.broadcast_to(place, shape) for place in places]
    return Guards(
        [g.name for g in system.guards],
        [g.state for g in system.guards],
        np.array(places, float),
        gap_units(system),
    )


def subject(
    system: System,
    attrs: Mapping[str, Any],
    guards: Guards | None = None,
    varied: Mapping[str, Any] | None = None,
) -> Subject:
    """The subject of a Dataset of this system."""
    return with_outputs(
        Subject(
            system.states, system.units, attrs, guards, gap_unit(system), varied or {},
            margin_unit=margin_gaps(system)[1],
        ),
        system,
    )  # fmt: skip


def with_outputs(subject: Subject, system: System) -> Subject:
    """The subject with the outputs of its system."""
    mine = system.outputs
    if not len(mine):
        return subject
    units = {**subject.units, **dict(zip(mine.names, mine.units, strict=True))}
    return replace(subject, units=units, outputs=mine.names, outputs_first=mine.first)


def trajectories(
    system: System, method: Method, group: Ensemble, forcing_period: float | np.ndarray | None
) -> Subject:
    """The subject of Datasets of some trajectories."""
    about = Subject(
        states=system.states,
        units=system.units,
        guards=guards(system, group),
        gap_unit=gap_unit(system),
        varied=group.varied,
        batch=group.batch,
        forcing_period=forcing_period,
        attrs=provenance(system, method, shared_values(system, group), group.varied),
    )
    return with_outputs(about, system)


def motion_values(
    system: System,
    group: Ensemble,
    time: Any,
    states: np.ndarray,
    mode: np.ndarray,
    rows: np.ndarray | None = None,
) -> np.ndarray:
    """The states of a system and its outputs at places of its trajectories.

    Parameters
    ----------
    system : System
        The equations and values.
    group : Ensemble
        The trajectories.
    time : float64[...]
        When [s].
    states : float64[n, ..., D]
        The states there, of each trajectory; more of them at the end are left out.
    mode : int64[n, ...]
        Sides of the guards there.
    rows : int64[n], optional
        The trajectory of each place; default all of them in turn.

    Returns
    -------
    float64[n, ..., K]
    """
    states = states[..., : len(system.states)]
    if not len(system.outputs):
        return states
    alike = rows is None or len(group.parameters) == 1
    own = group.parameters if alike else group.parameters[rows]
    shape = (len(own), *(1,) * (states.ndim - 2))
    # a level of a section stands behind the parameters of the system
    values = dict(zip(system.values, (one.reshape(shape) for one in own.T), strict=False))
    return outputs_of(system).values(time, states, values, mode)


def endings(outcome: Outcome, counters: Iterable[str] = st.COUNTERS) -> dict[str, Any]:
    """The end of each trajectory, and the counters on its way."""
    status = {"status": [STATUS[int(code)][0] for code in outcome.status]}
    return status | {name: outcome.counters[:, st.COUNTERS.index(name)] for name in counters}


def minima(outcome: Outcome) -> dict[str, np.ndarray]:
    """The smallest values of each trajectory."""
    return {name: outcome.minima[:, i] for i, name in enumerate(st.MINIMA)}


def provenance(
    system: System, method: Method, values: Mapping[str, float], varied: Iterable[str] = ()
) -> dict[str, Any]:
    """Attributes that say where a result comes from; ``values`` are those of its parameters, but
    for the ``varied`` ones.
    """
    note = note_on(method, system)
    return ({"method_note": note} if note else {}) | attributes(
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
    """Unit of the gaps of all guards, ``""`` if they differ or aren't known. What holds a contact
    is a force and doesn't count: its rows have no rate.
    """
    gaps = zip(gap_units(system), system.guards, strict=True)
    units = {unit for unit, guard in gaps if not is_hold(guard)}
    return units.pop() if len(units) == 1 else ""


def before_jumps(system: System, table: ContactTable) -> np.ndarray:
    """States before the contacts of a run of the system that remembers what jumps
    (:func:`saltus.system.quantity.remembering`), float64[c, D]: only impacts and jumps change them.
    """
    names, struck = jumping_states(system), table.kind == st.IMPACT
    states: np.ndarray = table.state[:, : len(system.states)].copy()
    for name, was in zip(reversed(names), table.state.T[::-1], strict=False):
        states[struck, system.states.index(name)] = was[struck]
    return states
