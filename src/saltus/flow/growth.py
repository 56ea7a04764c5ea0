"""Detect motions that grow only by the errors of fixed steps. Steps beyond a method's limit of
stability multiply their errors, and the end looks like any other number.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from saltus.kernels import status as st

if TYPE_CHECKING:
    from saltus.flow.request import Outcome, Request

#: A motion that ends beyond this magnitude [SI], or beyond this multiple of its start, is computed
#: again.
LARGE = 1e3
#: A motion grew by errors alone if its end exceeds that of the exact motion by this factor.
TOO_LARGE = 1e3


def mark_growth(outcome: Outcome, request: Request, exactly: Callable[[Request], Outcome]) -> None:
    """Give the status ``nonfinite`` to trajectories whose end was reached only by errors that grew.

    Parameters
    ----------
    outcome : Outcome
        The outcome of steps of a fixed length.
    request : Request
        Its request.
    exactly : callable
        The outcome of a request by an exact method.
    """
    with np.errstate(over="ignore"):
        begin = np.maximum(np.abs(request.start).max(axis=1), 1.0)
        end = np.abs(outcome.state).max(axis=1)
    ended = np.isin(outcome.status, (st.OK, st.GRAZE_UNRESOLVED))
    large = np.flatnonzero(ended & (end > LARGE * begin))
    if not len(large):
        return
    shared = len(request.parameters) == 1
    exact = exactly(
        request.unsampled(
            start=request.start[large],
            parameters=request.parameters if shared else request.parameters[large],
            **{
                name: getattr(request, name)[large] for name in ("period", "end_count", "end_phase")
            },
            until=request.until and request.until.of(large),
            record_from=None,
            checks=0,
        )
    )
    known = np.isin(exact.status, (st.OK, st.GRAZE_UNRESOLVED))
    size = np.maximum(np.abs(exact.state).max(axis=1), begin[large])
    outcome.status[large[known & (end[large] > TOO_LARGE * size)]] = st.NONFINITE
