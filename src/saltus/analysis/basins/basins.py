"""`basins`: the attractor that each start of a grid leads to."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import xarray as xr

from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.basins.labels import Settling
from saltus.analysis.basins.pipeline import BasinPlan, basin_plan
from saltus.analysis.inputs.given import Axis, Value
from saltus.analysis.inputs.verb import verb
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting, stage
from saltus.flow.threads import on_threads
from saltus.interrupt import Interrupted
from saltus.system import System

#: Share of the progress bar for the search for attractors.
SCOUTING = 0.05


@verb
def basins(
    system: System,
    *,
    at: Mapping[str, Value] | None = None,
    method: Method | None = None,
    periods: int = 2000,
    every: float | str | None = None,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
    **axes: Axis,
) -> xr.Dataset:
    """The attractor that each start of a grid leads to, every attractor typed and verified.

    1. A fixed quasi-random sample of 1024 starts is followed until it settles, and its attractors
       are established as by :func:`saltus.attractors`: a small sample meets all large basins.
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
       is the share that leads elsewhere, an estimate of wrong labels.
    6. Shares, entropies and the uncertainty exponent are computed from the labels; they say how far
       the map can be trusted.

    Parameters
    ----------
    system : System
        Equations, contacts and values.
    **axes : (low, high, count), or a list or array of starts
        Two states, the range of each [SI or text with a unit] and the number of starts, ends
        included: ``x=("-5 mm", "5 mm", 400), v=("-1 m/s", "1 m/s", 400)``.
    at : mapping, optional
        Starts of the other states; default zero.
    method : Method
        Default :class:`saltus.Taylor`, or :class:`saltus.Modal` from eight states on where
        it serves.
    periods : int
        Forcing periods that a trajectory is followed at most.
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
        On Ctrl-C; its ``partial`` is the Dataset so far.

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
    result = Settling.empty(plan.cells, len(plan.system.states))
    found = None
    with reporting(progress) as show:
        try:
            found = plan.scout(threads, stage(show, 0.0, SCOUTING))
            chunks, rest = range(plan.chunks), stage(show, SCOUTING, 1.0)
            label_all(
                plan,
                found,
                chunks,
                lambda i, part: result.put(plan.cells_of(i), part),
                threads,
                rest,
            )
            return plan.finish(result, found, threads)
        except KeyboardInterrupt:
            scouted = found
            raise Interrupted(
                None if scouted is None else lambda: plan.dataset(result, scouted, threads)
            ) from None


def label_all(
    plan: BasinPlan,
    found: AttractorSet,
    chunks: Sequence[int],
    done: Callable[[int, Settling], None],
    threads: int | None,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Label chunks on threads; ``done(index, settling)`` is called from this thread as each is
    ready, in any order.
    """
    map_ = plan.map(1)
    map_.launch(plan.starts(plan.cells_of(0)[:1]), 1)  # compiles before threads ask for it
    on_threads(lambda index: plan.chunk(index, found, map_), chunks, done, threads, progress)
