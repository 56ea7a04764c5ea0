"""Motions as the modal flow moves them: between two contacts every quantity is a sum of waves,
whose mean, mean square, largest value and turning points are exact.

On a leg, q(t) = Re(sum_e r_e a_e e^{mu_e t}): the waves are the modes of the contact state, a
constant (mu = 0) and the drives (mu = i rate). Largest values and turning points are found by
halving: an interval is left out once bounds of the waves show that it can't hold one. A wave that
is slow in an interval is bounded by its slope and curvature there, a fast one by its size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

#: Largest error of a largest value, relative to the size of its waves.
TOLERANCE = 1e-14
#: A step of Newton's method that is rounding, relative to the time.
SETTLED = 4e-16
#: Most halvings of a leg.
DEEPEST = 60
#: Numbers that an evaluation holds at a time: some 60 MB.
HELD = 2**22


@dataclass(frozen=True)
class WaveLegs:
    """p legs of one motion in one contact state, with R quantities of E waves.

    Attributes
    ----------
    rates : complex128[E]
        mu [1/s].
    rows : complex128[R, E]
        What each wave adds to each quantity [its unit].
    amplitudes : complex128[p, E]
        Of the waves at the beginning of a leg.
    begin, length : float64[p]
        Since the start of the motion [s]; duration [s].
    """

    rates: np.ndarray
    rows: np.ndarray
    amplitudes: np.ndarray
    begin: np.ndarray
    length: np.ndarray

    def values(
        self, leg: np.ndarray, time: np.ndarray, row: np.ndarray | None = None
    ) -> np.ndarray:
        """Waves of some quantities int64[m] (default: of all, added up) on legs int64[m] at times
        float64[m] since their beginnings: complex128[m, E]; float64[m, R].
        """
        waves = self.amplitudes[leg] * np.exp(self.rates * time[:, None])
        found: np.ndarray = (waves @ self.rows.T).real if row is None else waves * self.rows[row]
        return found

    def integrals(self, rates: np.ndarray) -> np.ndarray:
        """The integral of e^{rate t} over each leg, rates complex128[..]; complex128[p, ..]."""
        at = rates * self.length.reshape(-1, *(1,) * rates.ndim)
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = np.where(at == 0.0, 1.0, np.expm1(at) / at)
        result: np.ndarray = mean * self.length.reshape(-1, *(1,) * rates.ndim)
        return result


# -- means -----------------------------------------------------------------------------------------
def means(parts: Sequence[WaveLegs]) -> np.ndarray:
    """Mean of each quantity, float64[R]."""
    total = sum(
        ((one.amplitudes * one.integrals(one.rates)).sum(axis=0) @ one.rows.T).real for one in parts
    )
    return np.asarray(total / _duration(parts))


def deviations(parts: Sequence[WaveLegs], mean: np.ndarray) -> np.ndarray:
    """Root mean square of each quantity about its mean, float64[R]."""
    total = np.zeros(len(mean))
    for one in parts:
        at = np.flatnonzero(one.rates == 0.0)[0]  # the constant, of amplitude 1
        rows, size = one.rows.copy(), len(one.rates)
        rows[:, at] -= mean
        products = np.zeros((2, size, size), complex)
        step = max(1, HELD // size**2)
        for first in range(0, len(one.length), step):
            some = replace(
                one,
                amplitudes=one.amplitudes[first : first + step],
                length=one.length[first : first + step],
            )
            a = some.amplitudes
            for k, (other, rates) in enumerate(((a, one.rates), (a.conj(), one.rates.conj()))):
                integrals = some.integrals(one.rates[:, None] + rates)
                products[k] += np.einsum("pj,pk,pjk->jk", a, other, integrals, optimize=True)
        for product, other in zip(products, (rows, rows.conj()), strict=True):
            total += 0.5 * ((rows @ product) * other).sum(axis=1).real
    return np.asarray(np.sqrt(np.maximum(total, 0.0) / _duration(parts)))


def harmonics(parts: Sequence[WaveLegs], rate: float) -> np.ndarray:
    """Complex amplitude A e^{i phi} of A cos(rate t + phi) in each quantity, complex128[R]."""
    total: np.ndarray = np.zeros(1, complex)
    for one in parts:
        back = np.exp(-1j * rate * one.begin)[:, None]
        ahead = (back * one.amplitudes * one.integrals(one.rates - 1j * rate)).sum(axis=0)
        mirrored = (back * one.amplitudes.conj() * one.integrals(one.rates.conj() - 1j * rate)).sum(
            axis=0
        )
        total = total + ahead @ one.rows.T + mirrored @ one.rows.conj().T
    return total / _duration(parts)


def _duration(parts: Sequence[WaveLegs]) -> float:
    return float(sum(one.length.sum() for one in parts))


# -- largest values --------------------------------------------------------------------------------
def largest(parts: Sequence[WaveLegs]) -> np.ndarray:
    """Largest value of each quantity, float64[R]."""
    best = np.full(len(parts[0].rows), -np.inf)
    for one in parts:
        legs = np.arange(len(one.length))
        for time in (0.0 * one.length, 0.5 * one.length, one.length):
            best = np.maximum(best, one.values(legs, time).max(axis=0, initial=-np.inf))
    for one in parts:
        _raise(one, best)
    return best


def _raise(one: WaveLegs, best: np.ndarray) -> None:
    """Raise ``best`` to the largest values on some legs."""
    still, size = one.rates == 0.0, np.abs(one.amplitudes) * _growth(one.rates, one.length)
    most = (one.amplitudes[:, still] @ one.rows[:, still].T).real
    swing = size[:, ~still] @ np.abs(one.rows[:, ~still]).T
    tolerance = TOLERANCE * (swing.max(axis=0) + np.abs(most).max(axis=0))
    leg, row = np.nonzero(most + swing > best + tolerance)
    waiting, block = [(leg, row, 0.5 * one.length[leg], 0.5 * one.length[leg])], _block(one)
    for _ in range(DEEPEST):
        ahead = []
        for leg, row, middle, half in waiting:
            for first in range(0, len(leg), block):
                part = slice(first, first + block)
                at = leg[part], row[part], middle[part], half[part]
                value, room = _bounds(one, *at)
                np.maximum.at(best, at[1], value)
                on = value + room > best[at[1]] + tolerance[at[1]]
                if on.any():
                    ahead.append(_halves(*(each[on] for each in at)))
        waiting = ahead
        if not waiting:
            return


def _bounds(
    one: WaveLegs, leg: np.ndarray, row: np.ndarray, middle: np.ndarray, half: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Quantities int64[m] on legs int64[m] at times float64[m], and :func:`_room` there: what the
    quantities share is computed once.
    """
    _, first, same = np.unique(leg + 1j * middle, return_index=True, return_inverse=True)
    waves = one.amplitudes[leg[first]] * np.exp(one.rates * middle[first, None])
    parts = _parts_of_room(np.abs(waves), one.rates, half[first])
    rows, sizes = one.rows[row], np.abs(one.rows)[row]
    slopes = np.where(parts[0], one.rates * waves, 0.0)
    value, slope = (np.einsum("me,me->m", rows, each[same]).real for each in (waves, slopes))
    return value, np.abs(slope) * half + np.einsum("me,me->m", sizes, parts[1][same])


def _growth(rates: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Largest factor by which waves grow on the way, float64[.., E]."""
    return np.asarray(np.exp(np.maximum(rates.real * time[:, None], 0.0)))


def _room(waves: np.ndarray, rates: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Most by which the sum of waves complex128[m, E] changes within a time float64[m] before or
    after.
    """
    slow, rest = _parts_of_room(np.abs(waves), rates, half)
    slope = np.abs(np.where(slow, rates * waves, 0.0).real.sum(axis=1)) * half
    return np.asarray(slope + rest.sum(axis=1))


def _parts_of_room(
    size: np.ndarray, rates: np.ndarray, half: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Waves that are bounded by their slopes, bool[m, E], and what waves of sizes float64[m, E] add
    besides: the slow ones by their curvature, the others by what they are.
    """
    reach = np.abs(rates) * half[:, None]
    grown, slow = size * np.exp(np.abs(rates.real) * half[:, None]), reach < 1.0
    return slow, np.where(slow, 0.5 * grown * reach**2, grown + size)


def _halves(
    leg: np.ndarray, row: np.ndarray, middle: np.ndarray, half: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    quarter = 0.5 * half
    return (
        np.tile(leg, 2), np.tile(row, 2),
        np.concatenate([middle - quarter, middle + quarter]), np.tile(quarter, 2),
    )  # fmt: skip


def _block(one: WaveLegs) -> int:
    return max(1, HELD // (4 * len(one.rates)))


# -- turning points --------------------------------------------------------------------------------
def least_turn(parts: Sequence[WaveLegs], row: int, near: float) -> float:
    """Smallest magnitude of a quantity where it turns, inf if it never does. Those up to ``near``
    are looked for first.
    """
    for below in (near, np.inf):
        found = [one.values(*turns(one, row, below))[:, row] for one in parts]
        least = np.abs(np.concatenate(found)).min(initial=np.inf)
        if least <= below:
            break
    return float(least)


def turns(one: WaveLegs, row: int, below: float = np.inf) -> tuple[np.ndarray, np.ndarray]:
    """Legs int64[r] and times float64[r] since their beginnings at which a quantity turns, between
    their ends; those where its magnitude is more than ``below`` may be left out.
    """
    legs, found = np.arange(len(one.length)), []
    at = legs, np.full(len(legs), row), 0.5 * one.length, 0.5 * one.length
    for _ in range(DEEPEST):
        waves = one.values(at[0], at[2], at[1])
        if below < np.inf:
            near = np.abs(waves.real.sum(axis=1)) <= below + _room(waves, one.rates, at[3])
            at, waves = tuple(each[near] for each in at), waves[near]
        rates = waves * one.rates
        bends = rates * one.rates
        slope, bend = rates.real.sum(axis=1), bends.real.sum(axis=1)
        may = np.abs(slope) <= _room(rates, one.rates, at[3])
        once = may & (np.abs(bend) > _room(bends, one.rates, at[3]))
        found.append([each[once] for each in at])
        on = may & ~once & (at[3] > TOLERANCE * one.length[at[0]])
        if not on.any():
            break
        at = _halves(*(each[on] for each in at))
    leg, rows, middle, half = (np.concatenate(each) for each in zip(*found, strict=True))
    return _zeros(one, leg, rows, middle - half, middle + half)


def _zeros(
    one: WaveLegs, leg: np.ndarray, row: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Legs and times of the turning points in intervals that hold one or none, by Newton's method
    inside a shrinking bracket.
    """

    def slopes(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rates = one.values(leg, time, row) * one.rates
        return rates.real.sum(axis=1), (rates * one.rates).real.sum(axis=1)

    first, _ = slopes(low)
    turned = first * slopes(high)[0] < 0.0
    leg, row, low, high, first = (each[turned] for each in (leg, row, low, high, first))
    time = 0.5 * (low + high)
    for _ in range(DEEPEST):
        slope, bend = slopes(time)
        before = slope * first > 0.0
        low, high = np.where(before, time, low), np.where(before, high, time)
        with np.errstate(divide="ignore", invalid="ignore"):
            new = time - slope / bend
        new = np.where((new > low) & (new < high), new, 0.5 * (low + high))
        settled = np.abs(new - time) <= SETTLED * (np.abs(time) + high - low)
        time = np.where(slope == 0.0, time, new)
        if settled.all():
            break
    return leg, time
