"""`attractors` and `basin_fractions`: what a system settles to, and how likely each response is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.basins import uncertainty
from saltus.analysis.basins.halton import halton
from saltus.analysis.basins.labels import complete, settle_all
from saltus.analysis.basins.pipeline import SCOUTS, memory
from saltus.analysis.dataset_parts import provenance, subject
from saltus.analysis.orbits.all_orbits import used_up
from saltus.analysis.orbits.find_attractors import find_attractors
from saltus.analysis.orbits.noisy import stray_attrs
from saltus.analysis.orbits.portrait import portraits
from saltus.analysis.orbits.turns import looks_every
from saltus.analysis.starts import check_system, ensemble, fill, fixed_states
from saltus.analysis.verb import verb
from saltus.errors import ParameterError, shown
from saltus.flow.counts import whole
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting
from saltus.flow.request import Schedule
from saltus.flow.room import check_room
from saltus.results import AttractorTable, Subject, build
from saltus.results.dataset import schema
from saltus.results.dataset.attractors import basin_meanings
from saltus.results.dataset.kinds import Kind
from saltus.system import System
from saltus.units import to_si

#: Iterates after which the range of the states is taken, where no box gives it.
SPREAD = 32
#: Trajectories that are watched between two iterates for it.
WATCHED = 64
#: Starts that tell the range.
SPREAD_STARTS = 4096


@verb
def attractors(
    system: System,
    start: Any,
    *,
    method: Method | None = None,
    periods: int = 2000,
    every: float | str | None = None,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """The attractors that given starts lead to: period, contacts, size, multipliers, margin to the
    next graze.

    A trajectory is followed until it has settled, not for a fixed number of periods. Periodic
    responses are polished by Newton's method on the stroboscopic map and verified by their Floquet
    multipliers; what never repeats is typed by its largest Lyapunov exponent. Where errors of the
    method keep a motion from closing (ode45 at a loose tolerance), exact integration says which
    orbit it scatters about.

    Parameters
    ----------
    system : System
        Equations, contacts and values.
    start : sequence, mapping or array
        Starts, as for :func:`saltus.simulate`; one or many.
    method : Method
        Default :class:`saltus.Taylor`.
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
        check_method(method),
        every=looks_every(system, every, group.start),
        threads=threads,
    )
    scale = spread(map_, group.start)
    with reporting(progress) as show:
        found, label, settled = find_attractors(map_, group.start, scale, periods, progress=show)
    starts = {
        "trajectory": np.arange(group.size),
        "basin": np.where(label < 0, Kind.UNCONVERGED, label),
        "periods_to_settle": settled,
    }
    attrs = (
        provenance(system, map_.method, system.values)
        | looked(periods, map_)
        | stray_attrs(found.astray)
        | {"smallest_basin_seen": uncertainty.smallest_basin(group.size)}
    )
    return attractors_dataset(subject(system, attrs), portraits(map_, found), starts)


@verb
def basin_fractions(
    system: System,
    *,
    samples: int = 10_000,
    seed: int = 1,
    at: Mapping[str, Any] | None = None,
    method: Method | None = None,
    periods: int = 2000,
    every: float | str | None = None,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
    **box: Any,
) -> xr.Dataset:
    """How likely each response is: random starts from a box of any number of states, with
    confidence intervals.

    Parameters
    ----------
    system, method, periods, every, threads, progress
        As for :func:`saltus.basins`.
    samples : int
        Random starts, uniform over the box.
    seed : int
        Of the random numbers: the same seed gives the same starts.
    at : mapping, optional
        Starts of the states that have no range; default zero.
    **box : (low, high)
        Range of each state that varies [SI or text with a unit].

    Returns
    -------
    Dataset
        As :func:`attractors`, with ``attractor_fraction`` and its 95 % Wilson interval, and
        ``smallest_basin_seen`` (rule of three).

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used.

    References
    ----------
    Menck, Heitzig, Marwan & Kurths, Nature Physics 9 (2013) 89-92; Wilson, J. Am. Stat. Assoc. 22
    (1927) 209-212.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> shares = sl.basin_fractions(rig, x=("-5 mm", "5 mm"), v=("-1 m/s", "1 m/s"), samples=200)
    >>> shares["attractor_period"].values.tolist()
    [1, 1, 3, 9]
    >>> bool((shares["attractor_fraction_low"] < shares["attractor_fraction"]).all())
    True
    """
    check_system(system)
    samples, periods, seed = (
        whole(samples, "samples"),
        whole(periods, "periods"),
        whole(seed, "seed", 0),
    )
    fixed = fixed_states(system, at, box)
    ranges = box_ranges(system, box)
    check_room(
        memory(samples, len(system.states)),
        f"{samples} random starts",
        "Draw fewer: samples=10_000 tells shares to 1 %.",
    )
    start = fill(
        system, draw(ranges, np.random.default_rng(seed).random((samples, len(ranges)))), fixed
    )
    map_ = Stroboscope(
        system,
        check_method(method),
        every=looks_every(system, every, start),
        threads=threads,
    )
    scale = spread(map_, start[:SPREAD_STARTS])
    with reporting(progress) as show:
        scouts = fill(system, draw(ranges, halton(min(SCOUTS, samples), len(ranges))), fixed)
        found = find_attractors(map_, scouts, scale, periods)[0]
        result = settle_all(map_, start, found, periods, threads, show)
        found = complete(map_, result, found, scale, periods, threads)
    table = replace(
        portraits(map_, found), fractions=uncertainty.fractions(result.label, len(found))
    )
    starts = {
        "trajectory": np.arange(samples),
        "basin": result.label,
        "periods_to_settle": result.periods,
    }
    ds = attractors_dataset(
        subject(system, provenance(system, map_.method, system.values) | looked(periods, map_)),
        table,
        starts,
    )
    strays = stray_attrs(found.astray if (result.label == Kind.UNCONVERGED).any() else [])
    return ds.assign_attrs(
        **strays,
        smallest_basin_seen=uncertainty.smallest_basin(len(start)),
        samples=samples,
        seed=seed,
    )


def looked(periods: int, map_: Stroboscope) -> dict[str, Any]:
    """Settings of a result that say how often motions were looked at, and for how long at most."""
    every = {} if map_.system.forced_at else {"every": float(map_.period[0])}
    return {"periods": periods} | every


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


def box_ranges(system: System, box: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    """The ends of each range of a box [SI]. Raises ParameterError, UnitError."""
    ranges = {}
    for name, given in box.items():
        try:
            low, high = given
        except (TypeError, ValueError):
            unit = system.units[name]
            raise ParameterError(
                f'{name} must be (low, high), such as {name}=("-1 {unit}", "1 {unit}"), not '
                f"{shown(given)}."
            ) from None
        low, high = (to_si(value, system.units[name], name) for value in (low, high))
        if not low < high:
            raise ParameterError(f"the range of {name} is empty: {shown(low)} to {shown(high)}.")
        ranges[name] = (low, high)
    if not ranges:
        raise ParameterError(
            f"give a range for at least one state of {', '.join(system.states)}: "
            f'{system.states[0]}=("-1 mm", "1 mm").'
        )
    return ranges


def draw(ranges: Mapping[str, tuple[float, float]], unit: np.ndarray) -> dict[str, np.ndarray]:
    """Starts of the states that have a range, from numbers in [0, 1), one column for each."""
    return {
        name: low + (high - low) * column
        for (name, (low, high)), column in zip(ranges.items(), unit.T, strict=True)
    }


def spread(map_: Stroboscope, start: np.ndarray) -> np.ndarray:
    """Range of each state over the starts, their first iterates and the time between two of them; 1
    for a state that never moves. Starts whose budget is used up aren't looked at.
    """
    flight = map_.launch(start, SPREAD)
    iterates = flight.advance(SPREAD)
    if (followed := ~used_up(flight)).any():
        start, iterates = start[followed], iterates[followed]
    last = iterates[:WATCHED, -1][np.isfinite(iterates[:WATCHED, -1]).all(axis=1)]
    between = map_.run(last, 1, Schedule.even(1, SPREAD)).samples
    points = np.concatenate(
        [start, iterates.reshape(-1, start.shape[1]), between.reshape(-1, start.shape[1])]
    )
    points = points[np.isfinite(points).all(axis=1)]
    wide = np.ptp(points, axis=0)
    return np.where(wide > 0, wide, 1.0)
