"""Pace: which trajectories are stopped because they hardly get on, and which of those that a kernel stopped to be looked at go on.

The Taylor kernel looks at a trajectory every LOOK steps and stops it if they brought it less than they must on average. Most of these are
only slow for a while, so they go on, until a million steps say otherwise. What stands still is told by the second look: a singular point,
such as the root of an empty tank, to which steps shrink until time no longer passes. All of it depends on the trajectory alone, so results
are the same in every chunk and on every thread.
"""

from __future__ import annotations

import numpy as np

from saltus.kernels import status as st

#: Steps between two looks at a trajectory; steps after which one that is slow on the whole is stopped.
LOOK, LONG = 20_000, 1_000_000
#: Share of the rest of a run that LOOK steps must bring: less would need 2e11 steps to the end, days.
STILL = 1e-7


def marks(count: int) -> dict[str, np.ndarray]:
    """Where so many trajectories stood at the look before, and when their long pace was measured last: steps, whole periods, phase [s]."""
    never = {"look_steps": np.full(count, -LONG), "long_steps": np.zeros(count, np.int64)}
    return never | {f"{which}_{what}": np.zeros(count) for which in ("look", "long") for what in ("count", "phase")}


def resume(arrays: dict[str, np.ndarray], due: float) -> bool:
    """Let trajectories go on that were stopped to be looked at; returns whether any does.

    Parameters
    ----------
    arrays : dict of str to ndarray
        A batch as kernels have it, with its :func:`marks`.
    due : float
        Periods that LONG steps must bring.
    """
    here = np.flatnonzero(arrays["status"] == st.BUDGET_STEPS)
    if not len(here):
        return False
    steps = arrays["counters"][here, st.STEPS]
    rest = -_since(arrays, here, "end")
    still = (steps - arrays["look_steps"][here] < 2 * LOOK) & (_since(arrays, here, "look") < STILL * rest)
    long = steps - arrays["long_steps"][here]
    slow = (long >= LONG) & ~(_since(arrays, here, "long") >= due * long / LONG)
    on = here[~(still | slow)]
    for which, who in (("look", on), ("long", on[(long >= LONG)[~(still | slow)]])):
        arrays[f"{which}_steps"][who] = arrays["counters"][who, st.STEPS]
        arrays[f"{which}_count"][who], arrays[f"{which}_phase"][who] = arrays["count"][who], arrays["phase"][who]
    arrays["status"][on] = st.RUNNING
    return len(on) > 0


def _since(arrays: dict[str, np.ndarray], who: np.ndarray, which: str) -> np.ndarray:
    """Periods since a mark: whole ones and the rest apart, so that no digit is lost in a long run."""
    whole, phase = arrays["count"][who] - arrays[f"{which}_count"][who], arrays["phase"][who] - arrays[f"{which}_phase"][who]
    return whole + phase / arrays["period"][who]
