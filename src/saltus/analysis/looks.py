"""What steady motions look like: peak, rms, contacts and the margin to the next graze, of many motions at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.flow.engine import Schedule
from saltus.flow.family import Family
from saltus.kernels import status as st
from saltus.system.evaluate import evaluate
from saltus.system.system import System

#: Samples of a state held at a time: 200 MB.
HELD = 25_000_000


@dataclass(frozen=True)
class Looks:
    """What m motions look like.

    Attributes
    ----------
    peak, rms : float64[m]
        Largest magnitude and root mean square of the first state [its unit].
    contacts : float64[m]
        Crossings of guards per forcing period; NaN where the method doesn't locate them.
    margin : float64[m]
        Smallest size of a gap where it turns [unit of the gap]; inf where none does.
    """

    peak: np.ndarray
    rms: np.ndarray
    contacts: np.ndarray
    margin: np.ndarray


def looks(family: Family, start: np.ndarray, periods: np.ndarray, samples: int) -> Looks:
    """What the motions from states float64[m, D] look like over so many periods each, int64[m]; whole responses, if they are periodic."""
    result = Looks(*(np.full(len(start), np.nan) for _ in range(4)))
    for n in np.unique(periods):
        rows = np.flatnonzero(periods == n)
        size = max(1, HELD // int(n * samples))
        for first in range(0, len(rows), size):
            _look(family, start, rows[first : first + size], int(n), samples, result)
    return result


def _look(family: Family, start: np.ndarray, rows: np.ndarray, n: int, samples: int, result: Looks) -> None:
    """Fill in some rows, all of n periods."""
    here, index = family.rows(rows), np.arange(n * samples)
    outcome = here.run(start[rows], n, Schedule(index // samples, (index % samples) / samples))
    motion = np.moveaxis(outcome.samples, 2, 0)
    time = here.period[:, None] * np.arange(n * samples) / samples
    values = {name: column[:, None] for name, column in here.values.items()}
    result.peak[rows] = largest(motion[0])
    result.rms[rows] = np.sqrt(np.mean(motion[0] ** 2, axis=1))
    result.margin[rows] = margin(family.system, time, motion, values)
    if family.method.records_contacts:
        result.contacts[rows] = outcome.counters[:, st.EVENTS] / n


def at_rest(family: Family, place: np.ndarray, rows: np.ndarray, result: Looks) -> None:
    """Fill in the rows of equilibria: their size, no contacts, and the distance to the nearest boundary."""
    result.peak[rows] = result.rms[rows] = np.abs(place[:, 0])
    if family.method.records_contacts:
        result.contacts[rows] = 0.0
    states, values = dict(zip(family.system.states, place.T, strict=True)), family.values
    nearest = np.full(len(rows), np.inf)
    bits: list[np.ndarray] = []
    for guard in family.system.guards:
        (gap,) = evaluate([guard.gap], states=states, values=values, bits=bits)
        bits.append(np.broadcast_to(gap, len(rows)) > 0)
        nearest = np.minimum(nearest, np.abs(gap))
    result.margin[rows] = nearest


def margin(system: System, time: np.ndarray, motion: np.ndarray, values: Mapping[str, Any]) -> np.ndarray:
    """Smallest size of a gap where it turns, on either side of the boundary: how far a motion is from a graze.

    Parameters
    ----------
    system : System
        Its guards.
    time : float64[..., M]
        Times of the samples [s]; the motion repeats after them.
    motion : float64[D, ..., M]
        The states at the samples.
    values : mapping of str to float or array
        Parameters [SI], such as float64[..., 1].

    Returns
    -------
    float64[...]
        inf where no gap turns.
    """
    states = dict(zip(system.states, motion, strict=True))
    result = np.full(time.shape[:-1], np.inf)
    bits: list[np.ndarray] = []
    for guard in system.guards:
        (gap,) = evaluate([guard.gap], t=time, states=states, values=values, bits=bits)
        gap = np.broadcast_to(gap, time.shape)
        bits.append(gap > 0)
        sizes = np.abs(extremes(gap))
        result = np.minimum(result, np.where(np.isnan(sizes), np.inf, sizes).min(axis=-1))
    return result


def largest(values: np.ndarray) -> np.ndarray:
    """Largest magnitude of periodic signals float64[..., M], between the samples too."""
    sizes = np.abs(extremes(values))
    return np.maximum(np.abs(values).max(axis=-1), np.where(np.isnan(sizes), 0.0, sizes).max(axis=-1))


def extremes(values: np.ndarray) -> np.ndarray:
    """Values at the local extremes of periodic signals float64[..., M], each from the parabola through three samples; elsewhere NaN."""
    before, after = np.roll(values, 1, axis=-1), np.roll(values, -1, axis=-1)
    turning = (values - before) * (after - values) <= 0
    bend = before - 2 * values + after
    shift = np.where(turning & (bend != 0), 0.5 * (before - after) / np.where(bend == 0, 1.0, bend), 0.0)
    return np.where(turning, values - 0.25 * (before - after) * shift, np.nan)
