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
from saltus.errors import ParameterError, one_of
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.flow.request import Outcome
from saltus.kernels import status as st
from saltus.system import System

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
    threads: int | None = None,
) -> list[np.ndarray]:
    """The sampled states of each response, float64[n, D]: over one period, or over many for a
    motion that never repeats.
    """
    spans = np.where(found.period > 0, spans_of(found), APERIODIC_PERIODS)
    if sample == "stroboscope":
        return [found.points(i)[:span] for i, span in enumerate(spans)]
    if sample == "turning_points":
        return numbers.turning
    start, result = found.start(), [np.zeros((0, len(grid.system.states)))] * len(found)
    everything = Stroboscope(
        grid.system, method, grid.rows[found.place], own_times(found, grid), threads
    )
    for span in np.unique(spans):
        rows = np.flatnonzero(spans == span)
        for first in range(0, len(rows), PIECE):
            some = rows[first : first + PIECE]
            parts = _crossings(
                everything.rows(some).run(start[some], int(span), record=0), len(some)
            )
            for row, part in zip(some, parts, strict=True):
                result[row] = part
    return result


def _crossings(outcome: Outcome, count: int) -> list[np.ndarray]:
    """States at the crossings of all guards, of each trajectory."""
    crossings = outcome.contacts.rows(outcome.contacts.kind == st.CROSSING)
    return np.split(crossings.state, crossings.begins(count)[1:-1])
