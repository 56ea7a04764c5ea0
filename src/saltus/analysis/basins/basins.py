"""`basins`: the attractor that each start of a grid leads to."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import xarray as xr

from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.basins.labels import Settling, pieces_of, settle
from saltus.analysis.basins.pipeline import BasinPlan, basin_plan
from saltus.analysis.closed.capture import Neighbourhoods
from saltus.analysis.inputs.given import Axis, Value
from saltus.analysis.inputs.verb import verb
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting, stage
from saltus.flow.threads import on_threads
from saltus.interrupt import Interrupted
from saltus.system import System

#: Share of the progress bar at which all cells have been followed once. What is left is for those
#: that no attractor has captured.
LABELLED = 0.9


@verb
def basins(
    system: System,
    *,
    at: Mapping[str, Value] | None = None,
    method: Method | None = None,
    periods: int | None = None,
    every: float | str | None = None,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
    **axes: Axis,
) -> xr.Dataset:
    """The attractor that each start of a grid leads to, every attractor typed and verified.

    1. A fixed quasi-random sample of 1024 starts is followed until it settles, and its attractors
       are established as by :func:`saltus.attractors`: a small sample meets all large basins. Of
       systems of more than four states the first 16 say what a start costs, and so how many follow.
    2. About each attracting orbit a neighbourhood is taken in which the return map was seen to
       contract with an unchanged sequence of contacts: a trajectory inside needn't be followed any
       further.
    3. Every start of the grid is followed until it enters such a neighbourhood, so none runs longer
       than it must. Limit cycles and attractors that never repeat have none: a trajectory is on one
       of these if its iterates keep to it.
    4. New attractors are looked for from a sample of the trajectories that nothing captured within
       ``periods``, since small basins may be missing from the first sample. Then all of these go on
       for as long again.
    5. A random sample of the settled cells is computed again by a more exact method; ``flip_rate``
       is the share that leads elsewhere, an estimate of wrong labels. Nothing is more exact than
       :class:`saltus.Modal`: there it is NaN.
    6. Shares, entropies and the uncertainty exponent are computed from the labels; they say how far
       the map can be trusted.

    Parameters
    ----------
    system : System
        Equations, contacts and values.
    **axes : (low, high, count), or a list or array of starts
        Two states, the range of each [SI or text with a unit] and the number of starts, ends
        included: ``x=("-5 mm", "5 mm", 400), v=("-1 m/s", "1 m/s", 400)``. Of a structure by its
        modes two sensors of deflections or velocities: of all states that they show so, each start
        is that of least energy.
    at : mapping, optional
        Starts of the other states, or what other sensors show; default zero.
    method : Method
        Default :class:`saltus.Taylor`, or :class:`saltus.Modal` from eight states on where
        it serves.
    periods : int, optional
        Forcing periods that a trajectory is followed at most, and as many again in step 4. Default
        2000. Of D states, from eight on, cells times periods times D^3 are at most 2^35 by default,
        with 64 periods or more: 419 periods of 400 x 400 cells of four modes. Cells that haven't
        settled by then, as at very low damping, are ``unconverged``;
        :func:`saltus.describe` says how many.
    every : float or str, optional
        Time between two samples [s] of a system without forcing; default about a turn of its
        motions.
    threads : int, optional
        Default all processors. Results don't depend on it.
    progress : bool or callable
        Default: a bar on the terminal if the work lasts more than two seconds.

    Returns
    -------
    Dataset
        Dims: the two states, ``attractor``, ``multiplier``, ``phase``. Variables ``basin``,
        ``periods_to_settle``, ``status``, ``grazes_unresolved`` and the table ``attractor_*``;
        attributes: fractions' uncertainty, ``smallest_basin_seen``, ``flip_rate``,
        ``basin_entropy``, ``uncertainty_exponent``, ...

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used.
    Interrupted
        On Ctrl-C; its ``partial`` is the Dataset so far: the attractors found, the cells followed.

    References
    ----------
    Daza et al., Scientific Reports 6 (2016) 31416 (entropies); McDonald et al., Physica D 17 (1985)
    125 (uncertainty exponent).

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> found = sl.basins(rig, x=("-5 mm", "5 mm", 20), v=("-1 m/s", "1 m/s", 20))
    >>> found["basin"].shape, found["attractor_period"].values.tolist()
    ((20, 20), [1, 1, 3, 9])
    """
    return map_of(
        basin_plan(system, axes, at, check_method(method, system), periods, every),
        threads,
        progress,
    )


def map_of(
    plan: BasinPlan, threads: int | None, progress: bool | Callable[[float], None] | None
) -> xr.Dataset:
    """The Dataset of a planned map, as :func:`basins` returns it. Raises Interrupted on Ctrl-C."""
    size, every = len(plan.system.states), np.arange(plan.cells)
    scouting = LABELLED * plan.scouts / (plan.scouts + plan.cells)
    result, found = Settling.empty(plan.cells, size), AttractorSet(Neighbourhoods.none(size))
    with reporting(progress) as show:
        try:
            for known in plan.scouted(threads, stage(show, 0.0, scouting)):
                found = known
            map_ = compiled(plan)
            on_threads(
                lambda piece: settle(map_, plan.starts(every[piece]), found, plan.periods),
                pieces_of(plan.cells, size),
                result.put,
                threads,
                stage(show, scouting, LABELLED),
            )
            return plan.finish(result, found, threads, stage(show, LABELLED, 1.0))
        except KeyboardInterrupt:
            scouted = found
            raise Interrupted(lambda: plan.dataset(result, scouted, threads)) from None


def compiled(plan: BasinPlan) -> Stroboscope:
    """The map of a plan for one thread, compiled before threads ask for it."""
    map_ = plan.map(1)
    map_.launch(plan.starts(np.zeros(1, np.int64)), 1)
    return map_
