"""Recorded series from users, checked and converted to numbers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus.analysis.inputs.axes import axes_of
from saltus.analysis.statistics import LEAST
from saltus.errors import ParameterError, must_be, shown
from saltus.flow.counts import whole
from saltus.units import to_si

#: Least number of points for an estimate.
LEAST_POINTS = 200
#: Largest difference of sampling times from evenness, as a share of the interval.
EVEN = 1e-3


def columns_of(series: Any, embed: bool | None) -> np.ndarray:
    """The series float64[n, D], every column divided by its range."""
    try:
        array = np.asarray(series, float)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            "the series must be an array of numbers, (samples,) or (samples, states)."
        ) from None
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2 or not array.shape[1]:
        raise ParameterError(
            f"the series must have shape (samples,) or (samples, states), not {array.shape}."
        )
    if embed and array.shape[1] != 1:
        raise ParameterError(
            f"a delay embedding takes one quantity; this series has {array.shape[1]} columns. "
            f"Choose one, or leave embed= out."
        )
    check_length(len(array), 1, 10)
    bad = ~np.isfinite(array).all(axis=1)
    if bad.any():
        raise ParameterError(
            f"the series isn't finite at {int(bad.sum())} samples (first at {int(bad.argmax())}). "
            f"Cut it there, or fill the gaps."
        )
    wide = np.ptp(array, axis=0)
    if not (wide > 0).all():
        raise ParameterError(
            f"column {int((wide > 0).argmin())} of the series is constant. There "
            f"is no motion to measure: leave it out."
        )
    scaled: np.ndarray = array / wide
    return scaled


def interval_of(given: Any, count: int) -> float:
    """Time between samples [s], from the interval itself or from all times."""
    if isinstance(given, str) or axes_of(given) == 0:
        interval = to_si(given, "s", "sampling_interval")
        if not 0 < interval < math.inf:
            raise must_be("sampling_interval", "a positive time", given)
        return interval
    try:
        times = np.asarray(given, float)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"sampling_interval is one time, or the times of all {count} samples, "
            f"not {shown(given)}."
        ) from None
    if times.shape != (count,):
        raise ParameterError(
            f"sampling_interval is one time, or the times of all {count} samples; "
            f"this has shape {times.shape}."
        )
    steps, interval = np.diff(times), (times[-1] - times[0]) / (count - 1)
    off = np.abs(steps - interval)
    if not off.max() <= EVEN * abs(interval) or not interval > 0:
        raise ParameterError(
            f"the samples aren't evenly spaced: {steps.min():g} s to {steps.max():g} s between "
            f"them. Neighbours must move for the same "
            "time: resample the series to even times."
        )
    return float(interval)


def samples_of(value: Any, interval: float, name: str, least: int = 1) -> int:
    """Samples from a number of them, or a time with its unit; 0 for None."""
    if value is None:
        return 0
    return (
        max(round(to_si(value, "s", name) / interval), least)
        if isinstance(value, str)
        else whole(value, name, least)
    )


def check_length(count: int, evolve: int, exclude: int) -> None:
    """Raise a ParameterError unless the points give enough evolutions, and neighbours besides the
    excluded ones.
    """
    least = max(LEAST_POINTS, 2 * LEAST * evolve, 2 * exclude + LEAST_POINTS)
    if count < least:
        raise ParameterError(
            f"{count} points are too few: {least} are the least here, and some "
            f"thousand are needed for a chaotic motion."
        )
