"""Motions as the modal flow moves them: between two contacts every quantity is a sum of waves,
whose mean, mean square, largest value and turning points are exact.

On a leg, q(t) = Re(sum_e r_e a_e e^{mu_e t}): the waves are the modes of the contact state, a
constant (mu = 0) and the drives (mu = i rate). Largest values and turning points are found by
halving: an interval is left out once bounds of the waves show that it can't hold one. A wave that
is slow in an interval is bounded by its slope and curvature there, a fast one by its size. Where
these bounds show that a quantity turns at most once, Newton's method finds the place.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

#: Largest error of a largest value, relative to the size of its waves.
TOLERANCE = 1e-14
#: A step of Newton's method that is rounding, relative to the time.
SETTLED = 4e-16
#: One that is the last, relative to an interval in which a quantity turns once.
LAST = 1e-8
#: Most halvings of a leg.
DEEPEST = 60
#: Numbers that an evaluation holds at a time: some 60 MB.
HELD = 2**22
#: The product of two waves that goes less far than this in a leg of mean length [rad] is integrated
#: leg by leg: the difference of its values at both ends has lost digits.
SLOW = 1.0
#: Share of all quantities in all intervals, and number of them, below which those that may hold
#: what is looked for are looked at one by one.
FEW_SHARE, FEW = 0.03, 1024
#: Legs int64[m], quantities int64[m], middles float64[m] and half lengths float64[m] [s].
Intervals = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
#: True where quantities int64[m] whose values are float64[m], or differ by float64[m] at most, are
#: looked for, bool[m].
Wanted = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


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

    def waves(self, leg: np.ndarray, time: np.ndarray) -> np.ndarray:
        """The waves on legs int64[m] at times float64[m] since their beginnings: complex128[m,
        E].
        """
        found: np.ndarray = self.amplitudes[leg] * np.exp(self.rates * time[:, None])
        return found

    def values(self, leg: np.ndarray, time: np.ndarray) -> np.ndarray:
        """All quantities on legs int64[m] at times float64[m] since their beginnings,
        float64[m, R].
        """
        return _real_product(self.waves(leg, time), self.rows.T)

    def sizes(self, leg: np.ndarray, middle: np.ndarray, half: np.ndarray) -> np.ndarray:
        """Largest size of each wave in intervals, float64[m, E]."""
        rates = self.rates.real
        found: np.ndarray = np.abs(self.amplitudes)[leg] * np.exp(
            rates * middle[:, None] + np.abs(rates) * half[:, None]
        )
        return found

    def integrals(self, rates: np.ndarray) -> np.ndarray:
        """The integral of e^{rate t} over each leg, rates complex128[..]; complex128[p, ..]."""
        at = rates * self.length.reshape(-1, *(1,) * rates.ndim)
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = np.where(at == 0.0, 1.0, np.expm1(at) / at)
        result: np.ndarray = mean * self.length.reshape(-1, *(1,) * rates.ndim)
        return result


def _real_product(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The real part of a product of complex matrices."""
    product: np.ndarray = np.hstack([left.real, left.imag]) @ np.vstack([right.real, -right.imag])
    return product


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
        rows = one.rows.copy()
        rows[:, at] -= mean
        end = one.waves(np.arange(len(one.length)), one.length)
        for other in (np.asarray, np.conj):
            product = _products(one, end, other)
            total += 0.5 * ((rows @ product) * other(rows)).sum(axis=1).real
    return np.asarray(np.sqrt(np.maximum(total, 0.0) / _duration(parts)))


def _products(
    one: WaveLegs, end: np.ndarray, other: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """Integrals of the product of each wave with each one, or with its conjugate, over all legs,
    complex128[E, E]: the difference of the products at the ends complex128[p, E] and at the
    beginnings, divided by their rates.
    """
    begin, rates = one.amplitudes, one.rates[:, None] + other(one.rates)
    slow = np.abs(rates) * one.length.mean() < SLOW
    difference = end.T @ other(end) - begin.T @ other(begin)
    result: np.ndarray = np.where(slow, 0.0, difference / np.where(slow, 1.0, rates))
    first, second = np.nonzero(slow)
    step = max(1, HELD // (4 * len(first)))
    for leg in range(0, len(begin), step):
        some = replace(one, amplitudes=begin[leg : leg + step], length=one.length[leg : leg + step])
        both = some.amplitudes[:, first] * other(some.amplitudes[:, second])
        result[first, second] += (both * some.integrals(rates[slow])).sum(axis=0)
    return result


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


# -- largest and smallest values -------------------------------------------------------------------
def extremes(parts: Sequence[WaveLegs]) -> np.ndarray:
    """Smallest and largest value of each quantity, float64[2, R]."""
    found = np.full((len(parts[0].rows), 2), [np.inf, -np.inf]).T
    every = np.arange(found.shape[1])
    for one in parts:
        legs = np.arange(len(one.length))
        for time in (0.0 * one.length, 0.5 * one.length, one.length):
            _see_all(found, every, one.values(legs, time))
    for one in parts:
        legs = np.arange(len(one.length))
        sizes = one.sizes(legs, 0.5 * one.length, 0.5 * one.length)
        tolerance = TOLERANCE * (sizes @ np.abs(one.rows).T).max(axis=0, initial=0.0)

        def beyond(row: np.ndarray, value: np.ndarray, room: np.ndarray) -> np.ndarray:
            low, high = found[0] - tolerance, found[1] + tolerance  # noqa: B023
            new: np.ndarray = (value - room < low[row]) | (value + room > high[row])
            return new

        block = max(1, HELD // (64 * len(every)))
        for first in range(0, len(legs), block):
            open_ = _open(one, legs[first : first + block], found, beyond)
            leg, row, time = _turns(one, open_, beyond)
            _see(found, row, _derivatives(one, leg, row, time)[:, 0])
    return found


def _see(found: np.ndarray, row: np.ndarray, value: np.ndarray) -> None:
    """Put values float64[m] of quantities int64[m] into the extremes float64[2, R]."""
    np.minimum.at(found[0], row, value)
    np.maximum.at(found[1], row, value)


def _see_all(found: np.ndarray, row: np.ndarray, value: np.ndarray) -> None:
    """Put values float64[m, r] of quantities int64[r] into the extremes float64[2, R]."""
    found[0, row] = np.minimum(found[0, row], value.min(axis=0, initial=np.inf))
    found[1, row] = np.maximum(found[1, row], value.max(axis=0, initial=-np.inf))


def _open(one: WaveLegs, leg: np.ndarray, found: np.ndarray, wanted: Wanted) -> Intervals:
    """Intervals of legs in which quantities may be wanted, after some halvings: all quantities are
    looked at together while they are many. What is seen on the way is put into ``found``.
    """
    middle, half = 0.5 * one.length[leg], 0.5 * one.length[leg]
    open_ = np.ones((len(leg), len(one.rows)), bool)
    while open_.sum() > max(FEW_SHARE * open_.size, FEW):
        row = np.flatnonzero(open_.any(axis=0))
        rows, waves, reach = one.rows[row].T, one.waves(leg, middle), _reach(one, half)
        slow = np.where(reach < 1.0, waves, 0.0)
        value, slope = (_real_product(each, rows) for each in (slow, slow * one.rates))
        rest = one.sizes(leg, middle, half) * _remainder(reach)
        room = np.abs(slope) * half[:, None] + rest @ np.abs(rows)
        _see_all(found, row, _real_product(waves, rows))
        open_[:, row] &= wanted(row, value, room)
        on = open_.any(axis=1)
        leg, _, middle, half = _halves(leg[on], leg[on], middle[on], half[on])
        open_ = np.tile(open_[on], (2, 1))
    at, row = np.nonzero(open_)
    return leg[at], row, middle[at], half[at]


def _reach(one: WaveLegs, half: np.ndarray) -> np.ndarray:
    """Angles that waves go in half lengths float64[m], float64[m, E] [rad]."""
    return np.asarray(np.abs(one.rates) * half[:, None])


def _remainder(reach: np.ndarray) -> np.ndarray:
    """Remainder of waves of unit size that are followed by their slope, or not at all."""
    return np.where(reach < 1.0, 0.5 * reach**2, 1.0)


def _halves(leg: np.ndarray, row: np.ndarray, middle: np.ndarray, half: np.ndarray) -> Intervals:
    quarter = 0.5 * half
    return (
        np.tile(leg, 2), np.tile(row, 2),
        np.concatenate([middle - quarter, middle + quarter]), np.tile(quarter, 2),
    )  # fmt: skip


# -- turning points --------------------------------------------------------------------------------
def least_turns(parts: Sequence[WaveLegs], rows: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Smallest magnitude of quantities int64[r] where they turn, float64[r], inf of those that
    never do. Magnitudes up to ``near`` float64[r] are looked for first.
    """
    least, open_ = np.array(near), np.ones(len(rows), bool)
    for last in (False, True):
        below, found = np.full((2, len(parts[0].rows)), np.inf)
        below[rows] = least

        def low(row: np.ndarray, value: np.ndarray, room: np.ndarray) -> np.ndarray:
            return np.asarray(np.abs(value) - room <= below[row])  # noqa: B023

        for one in parts:
            leg, row, time = turns(one, rows[open_], low)
            np.minimum.at(found, row, np.abs(_derivatives(one, leg, row, time)[:, 0]))
        least[open_] = found[rows[open_]]
        open_ &= least > near
        if last or not open_.any():
            break
    return least


def turns(
    one: WaveLegs, rows: np.ndarray, wanted: Wanted | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Legs int64[t], quantities int64[t] among ``rows`` int64[r], and times float64[t] since the
    beginnings of the legs at which they turn, between the ends of the legs; those that aren't
    ``wanted`` may be left out.
    """
    leg, row = np.repeat(np.arange(len(one.length)), len(rows)), np.tile(rows, len(one.length))
    return _turns(one, (leg, row, 0.5 * one.length[leg], 0.5 * one.length[leg]), wanted)


def _turns(
    one: WaveLegs, at: Intervals, wanted: Wanted | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As :func:`turns`, in some intervals."""
    once: list[tuple[np.ndarray, ...]] = [tuple(each[:0] for each in at)]
    block = max(1, HELD // (8 * len(one.rates)))
    for _ in range(DEEPEST):
        ahead = []
        for first in range(0, len(at[0]), block):
            part = tuple(each[first : first + block] for each in at)
            value, room = _bounds(one, *part)
            may = np.abs(value[:, 1]) <= room[:, 1]
            if wanted is not None:
                may &= wanted(part[1], value[:, 0], room[:, 0])
            single = may & (np.abs(value[:, 2]) > room[:, 2])
            once.append(tuple(each[single] for each in part))
            on = may & ~single & (part[3] > TOLERANCE * one.length[part[0]])
            ahead.append(_halves(*(each[on] for each in part)))
        if not any(len(part[0]) for part in ahead):
            break
        leg, row, middle, half = (np.concatenate(each) for each in zip(*ahead, strict=True))
        at = leg, row, middle, half
    leg, row, middle, half = (np.concatenate(each) for each in zip(*once, strict=True))
    return _zeros(one, leg, row, middle - half, middle + half)


def _bounds(
    one: WaveLegs, leg: np.ndarray, row: np.ndarray, middle: np.ndarray, half: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Quantities, their slopes and bends at the middles of intervals, by the waves that are slow
    there, and how far from it they are in the intervals at most; both float64[m, 3].
    """
    reach, powers = _reach(one, half), np.vander(one.rates, 4, increasing=True)
    slow = np.where(reach < 1.0, one.waves(leg, middle) * one.rows[row], 0.0)
    rest = one.sizes(leg, middle, half) * np.abs(one.rows)[row] * _remainder(reach)
    value = _real_product(slow, powers)
    room = np.abs(value[:, 1:]) * half[:, None] + rest @ np.abs(powers[:, :3])
    return value[:, :3], room


def _derivatives(one: WaveLegs, leg: np.ndarray, row: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Quantities, their slopes and bends at times, float64[m, 3]."""
    powers = np.vander(one.rates, 3, increasing=True)
    return _real_product(one.waves(leg, time) * one.rows[row], powers)


def _zeros(
    one: WaveLegs, leg: np.ndarray, row: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Legs, quantities and times of the turning points in intervals that hold one or none, by
    Newton's method inside a shrinking bracket.
    """
    first, last = (_derivatives(one, leg, row, end)[:, 1] for end in (low, high))
    turned = first * last < 0.0
    leg, row, low, high, first = (each[turned] for each in (leg, row, low, high, first))
    time, near, going = 0.5 * (low + high), LAST * (high - low), np.arange(len(leg))
    for _ in range(DEEPEST):
        if not len(going):
            break
        now = time[going]
        _, slope, bend = _derivatives(one, leg[going], row[going], now).T
        before = slope * first[going] > 0.0
        low[going], high[going] = (
            np.where(before, now, low[going]),
            np.where(before, high[going], now),
        )
        left, right = low[going], high[going]
        with np.errstate(divide="ignore", invalid="ignore"):
            new = now - slope / bend
        inside = (new >= left) & (new <= right)
        new = np.where(inside, new, 0.5 * (left + right))
        time[going] = new = np.where(slope == 0.0, now, new)
        enough = np.where(inside, near[going], 0.0)
        rounding = SETTLED * (np.abs(now) + right - left)
        going = going[np.abs(new - now) > np.maximum(rounding, enough)]
    return leg, row, time
