"""Pace: trajectories whose steps bring almost no progress are stopped.

The Taylor kernel checks a trajectory every CHECK_STEPS steps and stops it if its progress is below
the average that is due. Most of these are slow for a while only: they go on, and are stopped if
LONG_CHECK_STEPS steps stay below the average. The second check finds trajectories at rest: at a
singular point, such as the root of an empty tank, steps shrink until time no longer passes. The
outcome depends on the trajectory alone, so results are the same in every chunk and on every thread.
"""

from __future__ import annotations

import numpy as np

from saltus.kernels import status as st

#: Steps between two checks of a trajectory's pace.
CHECK_STEPS = 20_000
#: Steps between two long checks, over which its average pace is measured.
LONG_CHECK_STEPS = 1_000_000
#: Share of the remaining run that CHECK_STEPS steps must bring. Less would need 2e11 steps to the
#: end: days.
MIN_PROGRESS = 1e-7


def marks(count: int) -> dict[str, np.ndarray]:
    """State of ``count`` trajectories at the last check and at the last long check: steps, whole
    periods, phase [s].
    """
    never = {
        "check_steps": np.full(count, -LONG_CHECK_STEPS),
        "long_steps": np.zeros(count, np.int64),
    }
    return never | {
        f"{which}_{what}": np.zeros(count)
        for which in ("check", "long")
        for what in ("count", "phase")
    }


def resume(arrays: dict[str, np.ndarray], due: float | np.ndarray) -> bool:
    """Resume the stopped trajectories that are fast enough; True if there are any.

    Parameters
    ----------
    arrays : dict of str to ndarray
        The arrays of a kernel's batch, with its :func:`marks`.
    due : float or float64[n]
        Periods that LONG_CHECK_STEPS steps must bring.
    """
    status = arrays["status"]
    stopped = np.flatnonzero(status == st.BUDGET_STEPS)
    if not len(stopped):
        return False
    steps = arrays["counters"][stopped, st.STEPS]
    rest = -_since(arrays, stopped, "end")
    still = (steps - arrays["check_steps"][stopped] < 2 * CHECK_STEPS) & (
        _since(arrays, stopped, "check") < MIN_PROGRESS * rest
    )
    long = steps - arrays["long_steps"][stopped]
    least = np.broadcast_to(due, status.shape)[stopped] * long / LONG_CHECK_STEPS
    slow = (long >= LONG_CHECK_STEPS) & ~(_since(arrays, stopped, "long") >= least)
    on = stopped[~(still | slow)]
    for which, who in (("check", on), ("long", on[(long >= LONG_CHECK_STEPS)[~(still | slow)]])):
        arrays[f"{which}_steps"][who] = arrays["counters"][who, st.STEPS]
        arrays[f"{which}_count"][who], arrays[f"{which}_phase"][who] = (
            arrays["count"][who],
            arrays["phase"][who],
        )
    status[on] = st.RUNNING
    return len(on) > 0


def _since(arrays: dict[str, np.ndarray], who: np.ndarray, which: str) -> np.ndarray:
    """Periods since a mark. Whole periods and the rest are subtracted apart, so that a long run
    loses no digits.
    """
    whole, phase = (
        arrays["count"][who] - arrays[f"{which}_count"][who],
        arrays["phase"][who] - arrays[f"{which}_phase"][who],
    )
    periods: np.ndarray = whole + phase / arrays["period"][who]
    return periods
