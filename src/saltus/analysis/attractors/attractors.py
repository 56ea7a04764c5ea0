"""`attractors`: what a system settles to."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.find_attractors import find_attractors
from saltus.analysis.attractors.noisy import stray_attrs
from saltus.analysis.attractors.portrait import portraits
from saltus.analysis.closed.spread import spread
from saltus.analysis.closed.turns import looks_every
from saltus.analysis.dataset_parts import provenance, subject
from saltus.analysis.inputs.given import Starts
from saltus.analysis.inputs.starts import ensemble
from saltus.analysis.inputs.verb import verb
from saltus.flow.counts import whole
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting
from saltus.interrupt import answered
from saltus.intervals import smallest_seen
from saltus.results import AttractorTable, Subject, build
from saltus.results.dataset import schema
from saltus.results.dataset.attractors import basin_meanings
from saltus.results.dataset.kinds import Kind
from saltus.system import System
from saltus.system.volume import nothing_attracts


@verb
def attractors(
    system: System,
    start: Starts | None = None,
    *,
    method: Method | None = None,
    periods: int = 2000,
    every: float | str | None = None,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """The attractors that given starts lead to: period, contacts, size, multipliers, margin to the
    next graze.

    1. All trajectories are followed in rounds of some periods until they have settled, not for a
       fixed number of periods, since transients differ by orders of magnitude.
    2. Where the states at whole periods nearly recur, Newton's method closes the orbit: recurrence
       alone can't tell an orbit from a slow transient. Orbits attract by their Floquet multipliers;
       those that don't are only remembered.
    3. About each attracting orbit a neighbourhood is taken in which the return map was seen to
       contract. A trajectory that enters one has arrived, and leaves the work.
    4. Without forcing, trajectories that circle a limit cycle are recognised too, whatever their
       phase.
    5. Trajectories that haven't settled within ``periods`` are followed much longer. A set that
       never repeats is accepted as an attractor only if none of them leaves it, since chaotic
       saddles hold trajectories for thousands of periods too; its largest Lyapunov exponent gives
       its type.
    6. Where errors of the method keep a motion from closing (ode45 at a loose tolerance), exact
       integration says which orbit it scatters about.

    So much is done at most: ``periods`` for each start, and 4096 more if it hasn't settled; 24 of
    these again for 32 768 periods, and their exponents. Of D states, from eight on, these are D/4
    times fewer, but four at least, and go on for D/4 times fewer periods. Newton's method costs at
    most ten times what the starts were followed for. A neighbourhood is tried at 17 sizes at most,
    each by 2^26/D^3 periods, or by one response from 8 D starts where that is more.

    Parameters
    ----------
    system : System
        Equations, contacts and values.
    start : sequence, mapping or array
        Starts, as for :func:`saltus.simulate`; one or many. Default: rest.
    method : Method
        Default :class:`saltus.Taylor`, or :class:`saltus.Modal` from eight states on where
        it serves.
    periods : int
        Forcing periods after which a trajectory that hasn't settled is looked at for chaos.
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
        Dim ``attractor``: ``attractor_type``, ``attractor_period`` (the n of nT),
        ``attractor_contacts``, ``attractor_itinerary``, ``attractor_peak``, ``attractor_rms``,
        ``attractor_margin``, multipliers, exponent, and its states at whole periods. Of a noisy one
        these are the exact orbit's, and ``attractor_scatter`` [unit of the first state] says how
        far from it the points lie. Dim ``trajectory``: ``basin``, the attractor of each start (-2:
        none was established), ``periods_to_settle``. ``smallest_basin_seen``: of starts that were
        drawn at random from a box, an attractor with a basin of a smaller share of it may be missed
        (rule of three).

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used.
    Interrupted
        On Ctrl-C; its ``partial`` is the Dataset of the attractors that were found; the ``basin``
        of starts that hadn't settled is ``not_computed``.

    References
    ----------
    Nayfeh & Balachandran, Applied Nonlinear Dynamics (1995), chapters 3, 5 and 7.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> found = sl.attractors(rig, start={"x": ["0 mm", "0.75 mm", "5 mm"], "v": 0})
    >>> found["attractor_period"].values.tolist(), found["basin"].values.tolist()
    ([1, 3], [0, 1, 0])
    """
    group, periods = ensemble(system, start, None), whole(periods, "periods")
    map_ = Stroboscope(
        system,
        check_method(method, system),
        every=looks_every(system, every, group.start),
        threads=threads,
    )
    scale = spread(map_, group.start)

    def dataset(known: tuple[AttractorSet, np.ndarray, np.ndarray]) -> xr.Dataset:
        found, label, settled = known
        starts = {
            "trajectory": np.arange(group.size),
            "basin": np.where(label == -1, Kind.UNCONVERGED, label),
            "periods_to_settle": settled,
        }
        followed = int(np.count_nonzero(label != Kind.NOT_COMPUTED))
        attrs = (
            provenance(system, map_.method, system.values)
            | looked(periods, map_)
            | stray_attrs(found.astray)
            | no_attractor(system, found, label)
            | {"smallest_basin_seen": smallest_seen(followed)}
        )
        return attractors_dataset(subject(system, attrs), portraits(map_, found), starts)

    with reporting(progress) as show:
        return answered(
            lambda: find_attractors(map_, group.start, scale, periods, progress=show), dataset
        )


def looked(periods: int, map_: Stroboscope) -> dict[str, Any]:
    """Settings of a result that say how often motions were looked at, and for how long at most."""
    every = {} if map_.system.forced_at else {"every": float(map_.period[0])}
    return {"periods": periods} | every


def no_attractor(system: System, found: AttractorSet, labels: np.ndarray) -> dict[str, str]:
    """The reason why what was found is no attractor, as an attribute of a result; {} where all
    starts settled to orbits, or where there may be attractors.
    """
    if not found.sampled and (labels >= 0).all():
        return {}
    why = nothing_attracts(system)
    return {"no_attractor": why} if why else {}


def attractors_dataset(
    subject: Subject, table: AttractorTable, starts: Mapping[str, Any] | None = None
) -> xr.Dataset:
    """The Dataset of some attractors, and where they are kept of the starts: ``trajectory``,
    ``basin``, ``periods_to_settle``.
    """
    values = {**(starts or {}), **table.values(len(subject.states))}
    return build(
        schema.ATTRACTORS,
        subject,
        values,
        words={"<when>": table.points_when},
        flags={"basin": basin_meanings(len(table))},
    )
