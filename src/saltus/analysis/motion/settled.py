"""The response that a motion has settled to, as far as the kept periods show.

The stroboscope (states at whole forcing periods) is searched for the smallest n after which it
repeats. That is an observation, not a proof: a slow transient may pass for settled, and a response
of more than half of the kept periods for aperiodic. Nothing here says whether an orbit is stable;
Newton and Floquet multipliers do that.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.inputs.verb import verb
from saltus.errors import ParameterError
from saltus.flow.counts import whole as whole_number
from saltus.flow.method import check_positive
from saltus.results import build, inherited, subject_of
from saltus.results.dataset.reader import reader
from saltus.results.dataset.schema import (
    SETTLED,
    TRAJECTORY,
    check,
    kind_of,
    outputs_in,
    sample_dim,
    states_of,
)

#: Largest mismatch that counts as a repeat: far above rounding, far below the difference of 24T
#: from its neighbour 12T on the rig (1e-2).
TOLERANCE = 1e-6
#: A transient of an nT response may repeat to the tolerance after 3n periods a little before it
#: does after n. If a part of the period repeats to this multiple of the tolerance, the response is
#: undecided.
UNDECIDED = 10
#: Default number of last periods: enough for two repeats of a 48T response.
LAST = 96
#: Least size of a state, as a share of the largest of its unit, if only magnitudes are known: a
#: state that has decayed beside others has no size of its own.
LEAST_SHARE = 1e-6
#: Least size of any state [SI], for one that has decayed and is alone in its unit. An atom measures
#: 1e-10 m.
AT_REST = 1e-14
#: Rounding of a state, relative to the largest value of its unit.
ROUNDING = 64 * np.finfo(float).eps
#: Numbers of one state that are processed together.
TOGETHER = 2**19


@verb
@reader
def settled(
    run: xr.Dataset, *, tolerance: float = TOLERANCE, last: int | None = None
) -> xr.Dataset:
    """Period, contacts, peak and rms of a forced motion, from its last periods.

    Parameters
    ----------
    run : Dataset
        The result of ``simulate`` for a forced system with samples at whole periods, or of
        ``stroboscope``.
    tolerance : float
        Largest difference of states n periods apart that counts as a repeat, relative to the
        largest range that a state of the same unit has in the samples looked at; where there are
        samples at whole periods only, to the largest magnitude of the state, and at least to a
        millionth of the largest of its unit. States without a unit count as of one unit.
    last : int, optional
        Whole periods at the end to compare; at least 2, by default at most 96. The longest response
        that is recognised is half of them.

    Returns
    -------
    Dataset
        Dim ``trajectory`` if ``run`` has it. ``response_period``: smallest n [forcing periods] such
        that all stroboscopic states n periods apart agree; 0 if none up to the attribute
        ``longest_period`` does, or if the trajectory didn't reach the end. ``mismatch``: largest
        relative difference at that n (at the best n, where none repeats). From ``simulate`` also
        ``contacts_per_response`` (grazes left out; NaN if not periodic), and ``<state>_peak``,
        ``<state>_rms`` over whole responses: largest absolute value and root mean square of the
        samples [unit of the state]; of the outputs of the system too.

    Raises
    ------
    ParameterError
        If the system isn't forced, or fewer than two whole periods were kept.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> run = sl.simulate(rig, start=("0.75 mm", 0), periods=400, keep=100)
    >>> int(sl.settled(run)["response_period"])
    3
    """
    check(run, caller="settled")
    check_positive("tolerance", tolerance)
    phases = _phases(run)
    whole_periods = np.flatnonzero(phases == np.round(phases))
    if not (np.diff(phases[whole_periods]) == 1.0).all():
        raise ParameterError(
            "settled compares whole forcing periods one after the other, and this run has some of "
            "them at times of its own (at=). Run it with samples= instead."
        )
    available = max(whole_periods.size - 1, 0)
    last = min(LAST, available) if last is None else whole_number(last, "last")
    if not 2 <= last <= available:
        raise ParameterError(
            f"settled compares 2 whole forcing periods or more: last = {last}, and {available} "
            f"were kept. Give keep={max(last, LAST)}."
        )
    whole_periods = whole_periods[-last - 1 :]
    states = states_of(run)
    samples = [np.atleast_2d(run[name].transpose(..., sample_dim(run)).values) for name in states]
    units = [str(run[name].attrs.get("units", "")) for name in states]
    parts = [
        _smallest_repeats(
            np.stack([of[some][:, whole_periods] for of in samples], axis=1),
            _scales([of[some] for of in samples], units, whole_periods, tolerance),
            tolerance,
        )
        for some in _parts(samples[0])
    ]
    n, mismatch = (np.concatenate(column) for column in zip(*parts, strict=True))
    n = np.where(np.isin(run["status"].values, ("ok", "graze_unresolved")), n, 0)
    values: dict[str, Any] = {"mismatch": mismatch, "response_period": n}
    if kind_of(run) == TRAJECTORY:
        others = [name for name in outputs_in(run) if name not in states and name in run]
        sized = dict(zip(states, samples, strict=True)) | {
            name: np.atleast_2d(run[name].transpose(..., sample_dim(run)).values) for name in others
        }
        values |= _measures(run, sized, whole_periods, n)
    return _dataset(run, values, last // 2)


def _phases(run: xr.Dataset) -> np.ndarray:
    """t/T at the samples, whole periods exact."""
    if "period" not in run.variables:
        raise ParameterError(
            "settled needs a forced system: without a forcing period there is nothing to repeat "
            "after. For an oscillation by itself ask "
            "sl.attractors(system, start), which names equilibria and limit cycles with their "
            "periods; for a forced system declare forced_at=."
        )
    phases = np.asarray(run["period"].values, dtype=float)
    nearest = np.round(phases)
    return np.where(np.abs(phases - nearest) < 1e-9 * np.maximum(1.0, nearest), nearest, phases)


def _parts(samples: np.ndarray) -> Iterator[slice]:
    """Groups of trajectories that are processed together."""
    size = max(TOGETHER // max(samples.shape[1], 1), 1)
    return (slice(first, first + size) for first in range(0, len(samples), size))


def _scales(
    samples: Sequence[np.ndarray], units: Sequence[str], whole_periods: np.ndarray, tolerance: float
) -> np.ndarray:
    """Scales of the differences of each state, float64[trajectory, state].

    The range of a state at rest, or near it, is no scale: the range of other states of its unit,
    the rounding of values of that unit, or :data:`AT_REST` stands for it.
    """
    between = whole_periods[-1] - whole_periods[0] > len(whole_periods) - 1
    looked_at = [of[:, whole_periods[0] : whole_periods[-1] + 1] for of in samples]
    ranges = np.stack(
        [np.ptp(of, axis=1) if between else np.abs(of).max(axis=1) for of in looked_at], axis=1
    )
    size = np.stack([np.abs(of).max(axis=1) for of in samples], axis=1)
    for unit in set(units):
        alike = np.array([one == unit for one in units])
        largest = ranges[:, alike].max(axis=1, keepdims=True) * (1.0 if between else LEAST_SHARE)
        rounding = np.fmax.reduce(size[:, alike], axis=1)[:, None] * (ROUNDING / tolerance)
        ranges[:, alike] = np.maximum(np.maximum(ranges[:, alike], largest), rounding)
    scales: np.ndarray = np.maximum(ranges, AT_REST)
    return scales


def _smallest_repeats(
    strobe: np.ndarray, scale: np.ndarray, tolerance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Smallest n with states n periods apart equal, and their mismatch, for each trajectory; 0 and
    the smallest mismatch if undecided.

    ``strobe`` has shape (trajectory, state, period), ``scale`` (trajectory, state); n runs up to
    half of the periods.
    """
    finite = np.isfinite(strobe).all(axis=(1, 2))
    points = np.where(finite[:, None, None], strobe, 0.0)
    longest = (strobe.shape[2] - 1) // 2
    mismatches = np.stack(
        [
            (np.abs(points[..., n:] - points[..., :-n]).max(axis=2) / scale).max(axis=1)
            for n in range(1, longest + 1)
        ],
        axis=1,
    )
    repeats, near = mismatches <= tolerance, mismatches <= UNDECIDED * tolerance
    for n in range(1, longest + 1):
        parts = [part - 1 for part in range(1, n) if n % part == 0]
        repeats[:, n - 1] &= ~near[:, parts].any(axis=1)
    found = repeats.any(axis=1)
    chosen = np.where(found, repeats.argmax(axis=1), mismatches.argmin(axis=1))
    mismatch = mismatches[np.arange(len(strobe)), chosen]
    return np.where(found & finite, chosen + 1, 0), np.where(finite, mismatch, np.nan)


def _measures(
    run: xr.Dataset, samples: Mapping[str, np.ndarray], whole_periods: np.ndarray, n: np.ndarray
) -> dict[str, Any]:
    """Contacts in a response, peak and rms of each state, over whole responses; over all kept
    periods if nothing repeats.
    """
    last, each = len(whole_periods) - 1, np.arange(len(n))
    repeats = np.where(n > 0, last // np.maximum(n, 1), 0)
    begin = np.where(n > 0, last - repeats * n, 0)
    contacts = _contacts(run, whole_periods[begin], whole_periods[-1], len(n))
    values: dict[str, Any] = {
        "contacts_per_response": np.where(n > 0, contacts / np.maximum(repeats, 1), np.nan)
    }
    peaks, rms = {}, {}
    for name, of in samples.items():
        parts = [_from_each_period(of[some], whole_periods) for some in _parts(of)]
        largest, squares = (np.concatenate(column) for column in zip(*parts, strict=True))
        peaks[name] = largest[each, begin]
        rms[name] = np.sqrt(squares[each, begin] / (whole_periods[-1] - whole_periods[begin]))
    return values | {"<state>_peak": peaks, "<state>_rms": rms}


def _from_each_period(
    samples: np.ndarray, whole_periods: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Largest magnitude and sum of squares from each whole period to the last, two arrays
    float64[trajectory, period].
    """
    looked_at, begins = (
        samples[:, whole_periods[0] : whole_periods[-1]],
        whole_periods[:-1] - whole_periods[0],
    )
    largest = np.maximum.reduceat(np.abs(looked_at), begins, axis=1)
    squares = np.add.reduceat(looked_at**2, begins, axis=1)
    return (
        np.maximum.accumulate(largest[:, ::-1], axis=1)[:, ::-1],
        np.add.accumulate(squares[:, ::-1], axis=1)[:, ::-1],
    )


def _contacts(run: xr.Dataset, first: np.ndarray, final: int, count: int) -> np.ndarray:
    """Crossings and impacts of each trajectory from sample ``first`` of it to sample ``final``, the
    later end included.
    """
    time = np.broadcast_to(np.atleast_2d(run["time"].values), (count, run["time"].shape[-1]))
    contact = run["contact_time"].values
    row, known = np.zeros(contact.size, np.int64), np.ones(contact.size, bool)
    if "trajectory" in run.coords:  # of the chosen trajectories, in their order
        numbers, who = np.atleast_1d(run["trajectory"].values), run["contact_trajectory"].values
        order = np.argsort(numbers)
        row = order[np.searchsorted(numbers, who, sorter=order) % count]
        known = numbers[row] == who
    begin, end = time[np.arange(count), first], time[:, final]
    counts = (
        known
        & (contact > begin[row])
        & (contact <= end[row])
        & np.isin(run["contact_kind"].values, ("crossing", "impact"))
    )
    return np.bincount(row[counts], minlength=count)


def _dataset(run: xr.Dataset, values: Mapping[str, Any], longest: int) -> xr.Dataset:
    batch, attrs = "trajectory" in run.dims, inherited(run) | {"longest_period": longest}
    trajectory = {"trajectory": run["trajectory"].values} if batch else {}
    return build(SETTLED, subject_of(run, outputs_in(run), attrs, batch), {**values, **trajectory})
