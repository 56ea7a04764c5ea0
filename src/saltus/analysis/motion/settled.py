"""What a motion has settled to, so far as the kept periods can tell.

The stroboscope (states at whole forcing periods) is searched for the smallest n after which it
repeats. That is an observation, not a proof: a slow transient may pass for settled, and a response
of more than half of the kept periods for aperiodic. Nothing here says whether an orbit is stable;
Newton and Floquet multipliers do that.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.verb import verb
from saltus.errors import ParameterError
from saltus.flow.counts import whole as whole_number
from saltus.results import Subject, build, inherited
from saltus.results.dataset.reader import reader
from saltus.results.dataset.schema import SETTLED, TRAJECTORY, check, kind_of, states_of

#: Largest mismatch that counts as a repeat: far above rounding, far below what tells 24T from its
#: neighbour 12T on the rig (1e-2).
TOLERANCE = 1e-6
#: A transient of an nT response may repeat to the tolerance after 3n periods a little before it
#: does after n. Where a part of the period repeats to this multiple of the tolerance, nothing is
#: decided yet.
UNDECIDED = 10
#: Periods looked at, by default: enough for two repeats of a 48T response.
LAST = 96


@verb
@reader
def settled(
    run: xr.Dataset, *, tolerance: float = TOLERANCE, last: int | None = None
) -> xr.Dataset:
    """Period, contacts, peak and rms of a forced motion, from its last periods.

    Parameters
    ----------
    run : Dataset
        What ``simulate`` returned for a forced system with samples at whole periods, or what
        ``stroboscope`` returned.
    tolerance : float
        Largest difference of states n periods apart that counts as a repeat, relative to the range
        of each state in the samples looked at (from a stroboscope, to its largest magnitude).
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
        samples [unit of the state].

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
    phases = _phases(run)
    whole = np.flatnonzero(phases == np.round(phases))
    kept = max(whole.size - 1, 0)
    last = min(LAST, kept) if last is None else whole_number(last, "last")
    if not 2 <= last <= kept:
        raise ParameterError(
            f"settled compares 2 whole forcing periods or more: last = {last}, and {kept} were "
            f"kept. Give keep={max(last, LAST)}."
        )
    whole = whole[-last - 1 :]
    batch = "trajectory" in run.dims
    each = (
        [(run.isel(trajectory=i), i) for i in range(run.sizes["trajectory"])]
        if batch
        else [(run, None)]
    )
    return _dataset(
        run, [_one(one, number, whole, tolerance) for one, number in each], batch, last // 2
    )


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


def _one(
    run: xr.Dataset, number: int | None, whole: np.ndarray, tolerance: float
) -> dict[str, float]:
    """The row of one trajectory; ``number`` is its place in a batch, whose contacts share one
    table.
    """
    names = states_of(run)
    window = run[list(names)].isel({run[names[0]].dims[0]: slice(whole[0], whole[-1] + 1)})
    strobe = np.stack([run[name].values[whole] for name in names])
    sampled = kind_of(run) == TRAJECTORY
    scale = np.array(
        [
            np.ptp(window[name].values) if sampled else np.abs(window[name].values).max()
            for name in names
        ]
    )
    row: dict[str, float] = {}
    n, row["mismatch"] = _smallest_repeat(strobe, scale, tolerance)
    row["response_period"] = n if str(run["status"].item()) in ("ok", "graze_unresolved") else 0
    if not sampled:
        return row
    repeats = (whole.size - 1) // n if n else 0
    first = whole[-1 - repeats * n] if n else whole[0]
    row["contacts_per_response"] = (
        _contacts(run, number, first, whole[-1]) / repeats if row["response_period"] else np.nan
    )
    for name in states_of(run):
        samples = run[name].values[first : whole[-1]]
        row[f"{name}_peak"] = np.abs(samples).max()
        row[f"{name}_rms"] = np.sqrt(np.mean(samples**2))
    return row


def _smallest_repeat(strobe: np.ndarray, scale: np.ndarray, tolerance: float) -> tuple[int, float]:
    """Smallest n with states n columns apart equal, and how equal; 0 and the smallest mismatch if
    none is decided.

    ``strobe`` has shape (state, period), ``scale`` (state,); n runs up to half of the periods.
    """
    if not np.isfinite(strobe).all():
        return 0, np.nan
    rounding = 64 * np.finfo(float).eps * np.abs(strobe).max(axis=1)
    scale = np.maximum(np.maximum(scale, rounding / tolerance), np.finfo(float).tiny)[:, None]
    mismatches = [
        float((np.abs(strobe[:, n:] - strobe[:, :-n]) / scale).max())
        for n in range(1, (strobe.shape[1] - 1) // 2 + 1)
    ]
    for n, mismatch in enumerate(mismatches, start=1):
        if mismatch <= tolerance and all(
            mismatches[part - 1] > UNDECIDED * tolerance for part in range(1, n) if n % part == 0
        ):
            return n, mismatch
    return 0, min(mismatches)


def _contacts(run: xr.Dataset, number: int | None, first: int, final: int) -> int:
    """Crossings and impacts between two samples, the later end included."""
    time, contact = run["time"].values, run["contact_time"].values
    inside = (
        (contact > time[first])
        & (contact <= time[final])
        & np.isin(run["contact_kind"].values, ("crossing", "impact"))
    )
    if number is not None:
        inside &= run["contact_trajectory"].values == number
    return int(inside.sum())


def _dataset(
    run: xr.Dataset, rows: list[dict[str, float]], batch: bool, longest: int
) -> xr.Dataset:
    states = states_of(run)
    values: dict[str, Any] = {
        name: np.array([row[name] for row in rows])
        for name in ("mismatch", "response_period", "contacts_per_response")
        if name in rows[0]
    }
    for measure in ("peak", "rms") if kind_of(run) == TRAJECTORY else ():
        values[f"<state>_{measure}"] = {
            name: np.array([row[f"{name}_{measure}"] for row in rows]) for name in states
        }
    if batch:
        values["trajectory"] = run["trajectory"].values
    units = {name: run[name].attrs.get("units", "") for name in states}
    attrs = inherited(run) | {"longest_period": longest}
    return build(SETTLED, Subject(states, units, attrs, batch=batch), values)
