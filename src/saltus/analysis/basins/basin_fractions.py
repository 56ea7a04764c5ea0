"""`basin_fractions`: the probability of each response."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import xarray as xr

from saltus.analysis.attractors.attractors import attractors_dataset, looked, no_attractor
from saltus.analysis.attractors.noisy import stray_attrs
from saltus.analysis.attractors.portrait import portraits
from saltus.analysis.basins import uncertainty
from saltus.analysis.basins.labels import complete, settle_all
from saltus.analysis.basins.pipeline import memory
from saltus.analysis.basins.scouting import SCOUTS, scouted
from saltus.analysis.closed.spread import spread
from saltus.analysis.closed.turns import looks_every
from saltus.analysis.dataset_parts import provenance, subject
from saltus.analysis.inputs.box import box_ranges, draw
from saltus.analysis.inputs.given import Range, Value
from saltus.analysis.inputs.halton import halton
from saltus.analysis.inputs.starts import check_system, fill, fixed_states
from saltus.analysis.inputs.verb import verb
from saltus.flow.counts import whole
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting, stage
from saltus.flow.room import check_room
from saltus.intervals import smallest_seen
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
        check_method(method, system),
        every=looks_every(system, every, start),
        threads=threads,
    )
    scale = spread(map_, start[:SPREAD_STARTS])
    with reporting(progress) as show:
        scouts = fill(system, draw(ranges, halton(min(SCOUTS, samples), len(ranges))), fixed)
        *_, found = scouted(map_, scouts, scale, periods, stage(show, 0.0, 0.1))
        result = settle_all(map_, start, found, periods, threads, stage(show, 0.1, 0.9))
        found = complete(map_, result, found, scale, periods, threads, stage(show, 0.9, 1.0))
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
        **no_attractor(system, found, result.label),
        smallest_basin_seen=smallest_seen(len(start)),
        samples=samples,
        seed=seed,
    )
