"""`wolf`: the largest Lyapunov exponent of a recorded series, by the fixed evolution time program
of Wolf et al.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from saltus.analysis.inputs.given import Value
from saltus.analysis.inputs.verb import verb
from saltus.analysis.recorded.embedding import embed as embedded
from saltus.analysis.recorded.embedding import (
    false_neighbours,
    first_minimum,
    hardly_correlated,
    least_dimension,
)
from saltus.analysis.recorded.neighbours import (
    CROWD,
    Evolutions,
    NeighbourSearch,
    crowd_distance,
    follow,
)
from saltus.analysis.recorded.series import (
    LEAST_POINTS,
    check_length,
    columns_of,
    interval_of,
    samples_of,
)
from saltus.analysis.statistics import BOUNDED, CONFIDENCE, UNCLEAR, batch_means, running_ends
from saltus.errors import ParameterError, SaltusWarning, among, must_be, unknown
from saltus.flow.counts import whole
from saltus.results import Subject, build, made_by
from saltus.results.dataset import schema

#: Largest default of the largest distance, as a share of the range: beyond it growth isn't that of
#: small deviations (Wolf's rule).
WIDEST = 0.1
#: Default of the smallest distance: rounding in a clean series.
CLEANEST = 1e-6
#: Delays in an evolution by default: the delay is about a quarter of a turn of the motion.
DELAYS = 4
#: Share of false neighbours above which an embedding doesn't show states.
UNFOLDED = 0.1
UNITS = {"1/s": 1.0, "bit/s": math.log(2)}


@dataclass(frozen=True)
class Growing:
    """The exponent measured from neighbours on one trajectory.

    Attributes
    ----------
    exponent, error, half_width : float
        Largest exponent, its standard error and half of the 95 % interval [1/s].
    batches : int
        Independent batches that the error comes from.
    kind : str
        ``chaotic``, ``regular`` or ``unclear``.
    ends, running, running_half : float64[m]
        Evolutions after which running means are kept, and these with their half-widths.
    evolutions : Evolutions
        The evolutions.
    """

    exponent: float
    error: float
    half_width: float
    batches: int
    kind: str
    ends: np.ndarray
    running: np.ndarray
    running_half: np.ndarray
    evolutions: Evolutions


_NONE = np.zeros(0)
#: Result without neighbours, or without a trajectory.
NOTHING = Growing(
    math.nan, math.nan, math.nan, 0, "unclear", _NONE, _NONE, _NONE, Evolutions(_NONE, _NONE, _NONE)
)


@verb
def wolf(
    series: ArrayLike,
    sampling_interval: Value | ArrayLike,
    *,
    dimension: int | None = None,
    delay: int | str | None = None,
    evolve: int | str | None = None,
    smallest_distance: float = CLEANEST,
    largest_distance: float | None = None,
    exclude: int | str | None = None,
    embed: bool | None = None,
    unit: str = "1/s",
) -> xr.Dataset:
    """The largest Lyapunov exponent of a recorded motion, by the algorithm of Wolf et al. (1985),
    fixed evolution time.

    The distance of neighbours grows with the largest exponent until it is as large as the motion;
    so neighbours are replaced after a fixed time by others that lie in the same direction. Besides
    the statistical error there is a bias of some 5 to 15 %, usually upwards, which more points make
    smaller. Negative exponents can't be seen: neighbours on an orbit stay neighbours, and give 0.
    Noise has positive exponents too; the share of false neighbours tells it from chaos.

    Parameters
    ----------
    series : array (n,) or (n, D)
        One quantity, which is embedded, or D states at each time, which are taken as they are. Any
        unit: each column is divided by its range.
    sampling_interval : float, str or array (n,)
        Time between two samples [s], or the times of all. For a map: 1.
    dimension : int, optional
        Coordinates of the embedding. Default: the least without false neighbours (Kennel et al.
        1992), 10 at most.
    delay : int or str, optional
        Between coordinates: samples, or a time with its unit. Default: the first minimum of the
        mutual information (Fraser & Swinney 1986), about a quarter of a turn; 1 for a series whose
        neighbouring samples are hardly correlated, as those of a map.
    evolve : int or str, optional
        Time of an evolution: samples, or a time with its unit. Wolf recommends half a turn to one
        and a half. Default: four delays; 1 for a map.
    smallest_distance : float
        Least distance of a new neighbour, as a share of the range: the level of the noise. Default:
        1e-6, for clean series.
    largest_distance : float, optional
        Largest distance of a new neighbour, as a share of the range; up to five times as far if
        there is none in the right direction. Default: half of the points have 20 neighbours within
        it, but at most 0.1.
    exclude : int or str, optional
        Samples, or a time, before and after a point that aren't neighbours of it. Default: as
        evolve, 10 samples at least (Wolf's).
    embed : bool, optional
        Whether to embed. Default: if the series has one column.
    unit : {"1/s", "bit/s"}
        Unit of the exponent. For a map with interval 1: per iterate.

    Returns
    -------
    Dataset
        As that of :func:`saltus.lyapunov`, with one ``trajectory`` and one ``exponent``:
        ``lyapunov_exponent`` with its standard error and 95 % interval from the statistics of the
        evolutions (batch means). The interval doesn't hold the bias of the method. ``kind``:
        ``chaotic`` where the interval lies above zero, ``regular`` where it is narrow and holds
        zero, or growth is no more than a factor of 50 in all, else ``unclear``. ``replacements``,
        ``replaced_distance`` (mean, as a share of the range), ``replaced_angle``. What was chosen
        for the parameters stands in the attributes, and ``false_neighbours``.

    Raises
    ------
    ParameterError, UnitError
        If the series is too short, constant, not finite or not evenly sampled, or an argument can't
        be used.

    References
    ----------
    Wolf, Swift, Swinney & Vastano, Physica D 16 (1985) 285-317; Fraser & Swinney, Phys. Rev. A 33
    (1986) 1134-1140; Kennel, Brown & Abarbanel, Phys. Rev. A 45 (1992) 3403-3411.

    Examples
    --------
    >>> import numpy as np
    >>> import saltus as sl
    >>> x = [0.3]
    >>> for _ in range(2000):
    ...     x.append(1 - 1.4 * x[-1] ** 2 + 0.3 * (x[-2] if len(x) > 1 else 0.0))
    >>> exponent = sl.wolf(np.array(x[100:]), 1)  # Henon's map: 0.419 per iterate
    >>> str(exponent["kind"].values[0])
    'chaotic'
    >>> bool(0.35 < exponent["lyapunov_exponent"].values[0, 0] < 0.5)
    True
    """
    if not among(unit, UNITS):
        raise unknown("the exponent isn't given in", unit, UNITS)
    columns = columns_of(series, embed)
    interval = interval_of(sampling_interval, len(columns))
    single = columns.shape[1] == 1 if embed is None else embed
    coarse = hardly_correlated(columns[:, 0])
    lag = samples_of(delay, interval, "delay") or (1 if coarse else first_minimum(columns[:, 0]))
    steps = samples_of(evolve, interval, "evolve") or (1 if coarse else DELAYS * lag)
    apart = samples_of(exclude, interval, "exclude", 0) if exclude is not None else max(10, steps)
    size, false = columns.shape[1], math.nan
    if single:
        size = (
            least_dimension(columns[:, 0], lag, apart)
            if dimension is None
            else whole(dimension, "dimension")
        )
        columns, false = _unfold(columns[:, 0], size, lag, apart)
    check_length(len(columns), steps, apart)
    search = _search(columns, steps, smallest_distance, largest_distance, apart)
    found = measure(columns, interval, search)
    if not len(found.evolutions.growth):
        raise ParameterError(
            f"no point of the series has a neighbour between {search.smallest:g} and {WIDEST:g} of "
            f"the range: the motion repeats "
            "exactly, or the points are too few. Lower smallest_distance=, or raise "
            "largest_distance=."
        )
    _warn(found, search, false, size, largest_distance is None)
    settings = {
        **made_by(),
        "algorithm": "Wolf et al. (1985), fixed evolution time", "confidence": CONFIDENCE,
        "unit": unit, "sampling_interval_s": interval,
        "samples": len(columns), "dimension": size, "delay_samples": lag if single else 0,
        "evolve_samples": steps,
        "exclude_samples": apart, "smallest_distance": search.smallest,
        "largest_distance": search.largest, "false_neighbours": false,
    }  # fmt: skip
    values = {"trajectory": np.arange(1), **_table(found, interval * steps, UNITS[unit], false)}
    return build(schema.EXPONENTS, Subject((), attrs=settings), values, words={"<rate>": unit})


def measure(points: np.ndarray, interval: float, search: NeighbourSearch) -> Growing:
    """Exponents from the neighbours on a trajectory float64[n, m] at this sampling interval [s]."""
    evolutions = follow(points, search)
    time, count = interval * search.evolve, len(evolutions.growth)
    if not count:
        return NOTHING
    ends = running_ends(count)
    means = batch_means(evolutions.growth / time, ends)
    exponent, error, half = (
        float(part[-1]) for part in (means.mean, means.error, means.half_width)
    )
    kind = "unclear"
    if abs(exponent) <= BOUNDED / (time * count) or abs(exponent) < half < UNCLEAR / time:
        kind = "regular"
    elif exponent - half > 0.0:
        kind = "chaotic"
    return Growing(
        exponent,
        error,
        half,
        int(means.batches[-1]),
        kind,
        ends * time,
        means.mean,
        means.half_width,
        evolutions,
    )


def _table(found: Growing, block: float, logarithm: float, false: float) -> dict[str, Any]:
    """The columns of the result."""
    mean, error, half = (
        np.array([[value / logarithm]]) for value in (found.exponent, found.error, found.half_width)
    )
    running, running_half = (
        part[None, None] / logarithm for part in (found.running, found.running_half)
    )
    kind = "unclear" if false > UNFOLDED else found.kind
    return {
        "kind": [kind], "response_period": [0], "lyapunov_exponent": mean, "lyapunov_error": error,
        "lyapunov_low": mean - half,
        "lyapunov_high": mean + half, "independent_batches": [found.batches], "block_time": [block],
        "status": ["ok"],
        "running_time": found.ends[None], "running_exponent": running,
        "running_low": running - running_half,
        "running_high": running + running_half, **replaced([found]),
    }  # fmt: skip


def replaced(found: list[Growing]) -> dict[str, Any]:
    """Columns about the replacements on some trajectories."""
    taken = [np.isfinite(one.evolutions.angle) for one in found]
    return {
        "replacements": [int(mask.sum()) for mask in taken],
        "replaced_distance": [
            _mean(one.evolutions.distance[mask]) for one, mask in zip(found, taken, strict=True)
        ],
        "replaced_angle": [
            _mean(one.evolutions.angle[mask]) for one, mask in zip(found, taken, strict=True)
        ],
    }


def _mean(values: np.ndarray) -> float:
    return float(values.mean()) if len(values) else math.nan


# -- arguments -------------------------------------------------------------------------------------
def _unfold(
    series: np.ndarray, dimension: int, delay: int, exclude: int
) -> tuple[np.ndarray, float]:
    """The embedded series, and the share of false neighbours in it."""
    if len(series) < dimension * delay + 2 * exclude + LEAST_POINTS:
        raise ParameterError(
            f"{len(series)} samples are too few for {dimension} coordinates with a delay of "
            f"{delay} samples. Record longer, or lower "
            "dimension= or delay=."
        )
    return embedded(series, dimension, delay), false_neighbours(series, dimension, delay, exclude)


def _search(
    points: np.ndarray, evolve: int, smallest: Any, largest: Any, exclude: int
) -> NeighbourSearch:
    """The distances, checked."""
    for name, value in (("smallest_distance", smallest), ("largest_distance", largest)):
        if value is not None and not (isinstance(value, int | float) and 0 < value < 1):
            raise must_be(name, "a share of the range, between 0 and 1", value)
    return default_search(points, evolve, exclude, float(smallest), largest)


def default_search(
    points: np.ndarray,
    evolve: int,
    exclude: int,
    smallest: float = CLEANEST,
    largest: float | None = None,
) -> NeighbourSearch:
    """The search for neighbours; a largest distance that isn't given follows from the density of
    points.
    """
    far = (
        max(min(crowd_distance(points, smallest, exclude), WIDEST), 2.0 * smallest)
        if largest is None
        else float(largest)
    )
    if far <= smallest:
        raise ParameterError(
            f"largest_distance = {far:g} must be above smallest_distance = {smallest:g}."
        )
    return NeighbourSearch(evolve, smallest, far, exclude)


def _warn(
    found: Growing, search: NeighbourSearch, false: float, dimension: int, by_density: bool
) -> None:
    """Warn about the causes that make the exponent doubtful."""
    if false > UNFOLDED:
        warnings.warn(
            f"{false:.0%} of the neighbours are false in {dimension} dimensions: the series shows "
            f"no states there. It is mostly noise, or "
            "needs more samples or another delay=; its exponent means nothing.",
            SaltusWarning,
            stacklevel=3,
        )
    elif by_density and search.largest >= WIDEST and found.kind != "regular":
        warnings.warn(
            f"the points lie far apart: less than {CROWD} neighbours within {WIDEST:g} of the "
            f"range. Such distances aren't small: record "
            "longer.",
            SaltusWarning,
            stacklevel=3,
        )
