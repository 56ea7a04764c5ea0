"""`basin_fractions`: the probability of each response."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import xarray as xr

from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.attractors import attractors_dataset, looked, no_attractor
from saltus.analysis.attractors.noisy import stray_attrs
from saltus.analysis.attractors.portrait import portraits
from saltus.analysis.basins import uncertainty
from saltus.analysis.basins.labels import OPEN, Settling, complete, settle_all
from saltus.analysis.basins.pipeline import memory
from saltus.analysis.basins.scouting import SCOUTS, affordable, scouted
from saltus.analysis.closed.capture import Neighbourhoods
from saltus.analysis.closed.spread import SPREAD, spread
from saltus.analysis.closed.turns import looks_every
from saltus.analysis.dataset_parts import provenance, subject
from saltus.analysis.inputs.box import box_ranges, draw, fixed_of, states_at
from saltus.analysis.inputs.given import Range, Value
from saltus.analysis.inputs.halton import halton
from saltus.analysis.inputs.starts import check_system
from saltus.analysis.inputs.verb import verb
from saltus.flow.counts import whole
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting, stage
from saltus.flow.room import check_room
from saltus.interrupt import Interrupted
from saltus.intervals import smallest_seen
from saltus.results import Subject
from saltus.results.dataset.kinds import Kind
from saltus.system import System

#: Starts that measure the range of the states.
SPREAD_STARTS = 4096


@verb
def basin_fractions(
    system: System,
    *,
    samples: int = 10_000,
    seed: int = 1,
    at: Mapping[str, Value] | None = None,
    method: Method | None = None,
    periods: int = 2000,
    every: float | str | None = None,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
    **box: Range,
) -> xr.Dataset:
    """Share of random starts that lead to each response, with confidence intervals. The starts are
    uniform in a box of any number of states.

    Attractors are looked for first, as for :func:`saltus.basins`, within a budget that falls with
    the number of states. Then each start is followed for twice ``periods`` at most, and only until
    an attractor captures it, so the work is in proportion to ``samples``.

    Parameters
    ----------
    system, method, periods, every, threads, progress
        As for :func:`saltus.basins`.
    samples : int
        Random starts, uniform over the box. 1000 tell a share to 3 %, a tenth of the work.
    seed : int
        Of the random numbers: the same seed gives the same starts.
    at : mapping, optional
        Starts of the states that have no range, or what other sensors show; default zero.
    **box : (low, high)
        Range of each state that varies [SI or text with a unit]. Of a structure by its modes ranges
        of sensors of deflections or velocities: of all states that show them so, each start is that
        of least energy.

    Returns
    -------
    Dataset
        As :func:`attractors`, with ``attractor_fraction`` and its 95 % Wilson interval, and
        ``smallest_basin_seen`` (rule of three).

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used.
    Interrupted
        On Ctrl-C; its ``partial`` is the Dataset so far, in which starts that weren't followed to
        an end are in no share's favour.

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
    fixed, size = fixed_of(system, at, box), len(system.states)
    ranges = box_ranges(system, box)
    check_room(
        memory(samples, size),
        f"{samples} random starts",
        "Draw fewer: samples=10_000 tells shares to 1 %.",
    )
    start = states_at(
        system, draw(ranges, np.random.default_rng(seed).random((samples, len(ranges)))), fixed
    )
    map_ = Stroboscope(
        system,
        check_method(method, system),
        every=looks_every(system, every, start),
        threads=threads,
    )
    scouts = states_at(system, draw(ranges, halton(min(SCOUTS, samples), len(ranges))), fixed)
    found, result = AttractorSet(Neighbourhoods.none(size)), Settling.empty(samples, size)
    about = subject(system, provenance(system, map_.method, system.values) | looked(periods, map_))
    with reporting(progress) as show:
        try:
            scale = spread(map_, start[: affordable(SPREAD, size, SPREAD_STARTS)])
            for known in scouted(map_, scouts, scale, periods, stage(show, 0.0, 0.1)):
                found = known
            settle_all(map_, start, found, periods, threads, stage(show, 0.1, 0.9), result)
            found = complete(map_, result, found, scale, periods, threads, stage(show, 0.9, 1.0))
        except KeyboardInterrupt:
            part = functools.partial(_dataset, about, map_, result, found, seed)
            raise Interrupted(part) from None
    return _dataset(about, map_, result, found, seed)


def _dataset(
    about: Subject, map_: Stroboscope, result: Settling, found: AttractorSet, seed: int
) -> xr.Dataset:
    """The Dataset of all known labels; starts that nothing has captured count as unconverged.
    Changes ``result``.
    """
    result.label[result.label == OPEN] = Kind.UNCONVERGED
    samples = len(result.label)
    table = replace(
        portraits(map_, found), fractions=uncertainty.fractions(result.label, len(found))
    )
    starts = {
        "trajectory": np.arange(samples),
        "basin": result.label,
        "periods_to_settle": result.periods,
    }
    ds = attractors_dataset(about, table, starts)
    strays = stray_attrs(found.astray if (result.label == Kind.UNCONVERGED).any() else [])
    return ds.assign_attrs(
        **strays,
        **no_attractor(map_.system, found, result.label),
        smallest_basin_seen=smallest_seen(samples),
        samples=samples,
        seed=seed,
    )
