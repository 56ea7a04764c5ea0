"""Warnings of measurements whose unit was forgotten, before a search lasts."""

from __future__ import annotations

import warnings

import numpy as np

from saltus.analysis.fits.measurement import Measurement
from saltus.analysis.fits.search import MisfitSearch
from saltus.errors import SaltusWarning
from saltus.system import System

#: Forcing periods between two samples from which on times may be in another unit: a motion is
#: seldom looked at less than once a period.
FAR = 2.0
#: Times that a measurement is as large as the motion that fits it best, from which on its unit may
#: be another: prefixes differ by a thousand.
LARGER = 30.0


def doubt_times(system: System, data: Measurement) -> None:
    """Warn of samples that lie several forcing periods apart."""
    if system.forced_at is None or len(data.at) < 2:
        return
    period = float(np.ravel(system.period(system.values))[0])
    apart = float(np.median(np.diff(data.at))) / period
    if apart > FAR:
        _warn(
            f"the samples of the measurement are {apart:.3g} forcing periods apart, and it lasts "
            f"{data.at[-1] / period:.3g} of them. Times without a unit are in seconds: of "
            'milliseconds write {"t": (times, "ms")}.'
        )


def doubt_sizes(data: Measurement, search: MisfitSearch) -> None:
    """Warn of an output that was measured far larger than the motion that fits best, or far
    smaller.
    """
    if search.best is None:
        return
    sizes = [np.sqrt(np.nanmean(one**2, axis=0)) for one in (data.values, search.best.fitted)]
    for name, unit, measured, fitted in zip(data.outputs, data.units, *sizes, strict=True):
        if fitted > 0 and max(measured, fitted) > LARGER * min(measured, fitted):
            _warn(
                f"the measured {name} is {measured / fitted:.1g} times as large as the motion that "
                f"fits it best. Numbers without a unit are in {unit or 'SI'}: of others write "
                f'{{"{name}": (numbers, "UNIT")}}.'
            )


def _warn(words: str) -> None:
    warnings.warn(words, SaltusWarning, stacklevel=5)
