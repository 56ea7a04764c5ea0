"""`stroboscope`: states at whole forcing periods."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import xarray as xr

from saltus.analysis import dataset_parts
from saltus.analysis.inputs.given import Starts, Values
from saltus.analysis.inputs.spans import span
from saltus.analysis.inputs.starts import check_system, ensemble, trajectories
from saltus.analysis.inputs.verb import verb
from saltus.analysis.motion.window import computed
from saltus.analysis.outcome_messages import warn
from saltus.errors import ParameterError
from saltus.flow.counts import whole
from saltus.flow.methods import Method, check_method
from saltus.flow.request import Outcome, Schedule
from saltus.flow.room import check_room
from saltus.results import build
from saltus.results.dataset import schema
from saltus.system import System


@verb
def stroboscope(
    system: System,
    start: Starts | None = None,
    periods: int = 1,
    keep: int | None = None,
    *,
    t_start: float | str = 0.0,
    method: Method | None = None,
    values: Mapping[str, Values] | None = None,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """States at whole forcing periods after the start (the stroboscopic map, iterated). The phase
    stays exact over millions of periods.

    Parameters
    ----------
    system, start, t_start, method, values, threads, progress
        As for :func:`saltus.simulate`.
    periods : int
        Whole forcing periods to run.
    keep : int
        How many of the last whole periods to keep (default all, the start included). A run of 1e6
        starts that keeps one takes well under 1 GB.

    Returns
    -------
    Dataset
        Dims ``trajectory``, ``period`` (whole periods since the start), ``guard``; a variable per
        state, ``status``, counters.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used, or the system isn't forced.
    Interrupted
        On Ctrl-C; its ``partial`` is the Dataset so far.

    References
    ----------
    Guckenheimer & Holmes, Nonlinear Oscillations, Dynamical Systems, and Bifurcations of Vector
    Fields (1983), section 1.5.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> points = sl.stroboscope(rig, start=("0.75 mm", 0), periods=300)
    >>> x = points["x"].values[0]
    >>> bool(abs(x[300] - x[297]) < 1e-6 < abs(x[300] - x[299]))  # it repeats after three periods
    True
    """
    method = check_method(method, system)
    check_system(system)
    if system.forced_at is None:
        raise ParameterError(
            f"{system.name} has no forcing period to be seen once in. Take "
            f"sl.simulate with t_end=, or sl.poincare."
        )
    whole_periods = whole(periods, "periods")
    first = 0 if keep is None else max(whole_periods + 1 - whole(keep, "keep"), 0)
    count = whole_periods + 1 - first
    many = trajectories(start, values)
    size = count * many * (16.0 * len(system.states) + 16.0)
    check_room(
        size,
        f"{many} trajectories with {count} periods each",
        lambda say: f"Give {say.key('keep')} (last periods).",
    )
    group = ensemble(system, start, values)
    length = span(system, group, periods, None, t_start)
    periods_kept = np.arange(first, whole_periods + 1, dtype=np.int64)
    schedule = Schedule(periods_kept, np.zeros(len(periods_kept)))
    request = length.request(group.start, group.parameters, schedule, None)

    def dataset(outcome: Outcome) -> xr.Dataset:
        reached = slice(outcome.reached())
        own_periods = bool(np.ptp(length.period) > 0)
        subject = dataset_parts.trajectories(
            system, method, group, length.period if own_periods else float(length.period[0])
        )
        values = {
            "trajectory": np.arange(group.size),
            "period": periods_kept[reached],
            "<state>": dataset_parts.motion_values(
                system,
                group,
                length.t_start + periods_kept[reached] * length.period[:, None],
                outcome.samples[:, reached],
                outcome.sample_mode[:, reached],
            ),
            **dataset_parts.endings(outcome),
            **dataset_parts.minima(outcome),
        }
        return build(schema.STROBOSCOPE, replace(subject, batch=True), values)

    result = computed(system, method.suited_to(group.size), request, dataset, threads, progress)
    warn(result)
    return result
