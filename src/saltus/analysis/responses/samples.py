"""Samples of each response in a bifurcation diagram: its turning points, its states at whole
periods, or its contacts.
"""

from __future__ import annotations

import numpy as np

from saltus.analysis.attractors.grid import Grid
from saltus.analysis.attractors.grid_responses import (
    APERIODIC_PERIODS,
    GridResponses,
    own_times,
    spans_of,
)
from saltus.analysis.closed.measures import Measures
from saltus.analysis.inputs.outputs import Outputs
from saltus.errors import ParameterError, one_of
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.flow.request import Outcome
from saltus.kernels import status as st
from saltus.system import System
from saltus.system.modes import mode_number, sides

#: Known kinds of samples.
SAMPLES = ("turning_points", "stroboscope", "contacts")
#: Responses sampled at a time.
PIECE = 256


def check_sample(sample: str, method: Method) -> str:
    """Return the kind of sample, checked. Raises ParameterError if it is unknown, or the method
    can't give it.
    """
    one_of(SAMPLES, sample=sample)
    if sample == "contacts" and not method.records_contacts:
        raise ParameterError(
            lambda say: (
                f"{method.name} with {say.key(events='ignore')} locates no contacts. Take "
                f"{say.key(sample='turning_points')}."
            )
        )
    return sample


def check_unforced_sample(sample: str, system: System) -> None:
    """Raise a ParameterError if a system without forcing can't show this sample."""
    if sample == "stroboscope" and system.forced_at is None:
        raise ParameterError(
            lambda say: (
                f"{system.name} has no forcing period: it has no stroboscope. Take "
                f"{say.key(sample='turning_points')} or "
                '"contacts".'
            )
        )


def sampled(
    sample: str,
    numbers: Measures,
    grid: Grid,
    method: Method,
    found: GridResponses,
    outputs: Outputs,
    threads: int | None = None,
) -> list[np.ndarray]:
    """The sampled states of each response and the outputs of the system, float64[n, K]: over one
    period, or over many for a motion that never repeats.
    """
    system, rows = grid.system, grid.rows[found.place]
    wide = len(system.states) + len(system.outputs)
    spans = np.where(found.period > 0, spans_of(found), APERIODIC_PERIODS)
    if sample == "stroboscope":
        return [
            _at_whole_periods(system, outputs, found.points(i)[:span], rows[i])[:, :wide]
            for i, span in enumerate(spans)
        ]
    if sample == "turning_points":
        return [one[:, :wide] for one in numbers.turning]
    start, result = found.start(), [np.zeros((0, wide))] * len(found)
    everything = Stroboscope(system, method, rows, own_times(found, grid), threads)
    for span in np.unique(spans):
        mine = np.flatnonzero(spans == span)
        for first in range(0, len(mine), PIECE):
            some = mine[first : first + PIECE]
            outcome = everything.rows(some).run(start[some], int(span), record=0)
            parts = _crossings(outcome, outputs, everything.rows(some))
            for row, part in zip(some, parts, strict=True):
                result[row] = part[:, :wide]
    return result


def _at_whole_periods(
    system: System, outputs: Outputs, points: np.ndarray, parameters: np.ndarray
) -> np.ndarray:
    """States float64[n, D] at whole periods with the outputs there, float64[n, K]."""
    values = dict(zip(system.values, parameters, strict=True))
    mode = mode_number(sides(system, 0.0, points.T, values))
    return outputs.values(0.0, points, values, mode)


def _crossings(outcome: Outcome, outputs: Outputs, map_: Stroboscope) -> list[np.ndarray]:
    """States and outputs at the crossings of all guards, of each trajectory."""
    crossings = outcome.contacts.rows(outcome.contacts.kind == st.CROSSING)
    values = {name: one[crossings.trajectory] for name, one in map_.values.items()}
    found = outputs.values(crossings.time, crossings.state, values, crossings.mode_after)
    return np.split(found, crossings.begins(len(map_))[1:-1])
