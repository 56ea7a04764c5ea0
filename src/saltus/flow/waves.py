"""Motions as the modal flow moves them: between two contacts every quantity is a sum of waves,
whose mean, mean square, largest value and turning points are exact.

On a leg, q(t) = Re(sum_e r_e a_e e^{mu_e t}): the waves are the modes of the contact state, a
constant (mu = 0) and the drives (mu = i rate). The legs of all contact states go through each
computation together. Largest values and turning points are found by halving: an interval is left
out once bounds of the waves show that it can't hold one. A wave that is slow in an interval is
bounded by its slope and curvature there, a fast one by its size. Where these bounds show that a
quantity turns at most once, Newton's method finds the place.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
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
#: Quantities in an interval, in the mean over those that may hold something, of which it is quicker
#: to look at each by itself: at an impact the least gap, zero, is never decided by halving.
FEW_OF_EACH = 4
#: Legs int64[m], quantities int64[m], middles float64[m] and half lengths float64[m] [s].
Intervals = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
#: True where quantities int64[m] on legs int64[m], whose values are float64[m] or differ by
#: float64[m] at most, are looked for, bool[m]; all quantities of legs int64[m] with [m, R].
Wanted = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class WaveLegs:
    """p legs of one motion through S contact states, with R quantities of E waves.

    Attributes
    ----------
    rates : complex128[S, E]
        mu [1/s].
    rows : complex128[S, R, E]
        What each wave adds to each quantity [its unit].
    state : int64[p]
        Contact state of each leg, ascending.
    amplitudes : complex128[p, E]
        Of the waves at the beginning of a leg.
    begin, length : float64[p]
        Since the start of the motion [s]; duration [s].
    """

    rates: np.ndarray
    rows: np.ndarray
    state: np.ndarray
    amplitudes: np.ndarray
    begin: np.ndarray
    length: np.ndarray

    def waves(self, leg: np.ndarray, time: np.ndarray) -> np.ndarray:
        """The waves on legs int64[m] at times float64[m] since their beginnings: complex128[m,
        E].
        """
        _, first, again = np.unique(leg + 1j * time, return_index=True, return_inverse=True)
        leg, time = leg[first], time[first]
        found = self.amplitudes[leg] * np.exp(self.rates[self.state[leg]] * time[:, None])
        return np.asarray(found[again])

    def values(self, leg: np.ndarray, time: np.ndarray) -> np.ndarray:
        """All quantities on legs int64[m] at times float64[m] since their beginnings,
        float64[m, R].
        """
        waves, found = self.waves(leg, time), np.empty((len(leg), self.rows.shape[1]))
        for state, mine in self.by_state(leg):
            found[mine] = _real_product(waves[mine], self.turned[state])
        return found

    def sizes(self, leg: np.ndarray, middle: np.ndarray, half: np.ndarray) -> np.ndarray:
        """Largest size of each wave in intervals, float64[m, E]."""
        rates = self.rates.real[self.state[leg]]
        found: np.ndarray = np.abs(self.amplitudes)[leg] * np.exp(
            rates * middle[:, None] + np.abs(rates) * half[:, None]
        )
        return found

    @functools.cached_property
    def turned(self) -> np.ndarray:
        """The conjugates of the rows, complex128[S, R, E]."""
        return np.asarray(self.rows.conj(), order="C")

    @functools.cached_property
    def row_sizes(self) -> np.ndarray:
        """Sizes of the rows: the most that a wave of size 1 adds, float64[S, R, E]."""
        return np.asarray(np.abs(self.rows))

    def by_state(self, leg: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
        """Contact states, and which of legs int64[m] are in them, int64[..] each."""
        order = np.argsort(self.state[leg], kind="stable")
        states = self.state[leg][order]
        for mine in np.split(order, np.flatnonzero(np.diff(states)) + 1 if len(order) else []):
            if len(mine):
                yield int(self.state[leg[mine[0]]]), mine

    def integrals(self, rates: np.ndarray) -> np.ndarray:
        """The integral of e^{rate t} over each leg, rates complex128[p or 1, n]; complex128[p,
        n].
        """
        at = rates * self.length[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = np.where(at == 0.0, 1.0, np.expm1(at) / at)
        result: np.ndarray = mean * self.length[:, None]
        return result

    def of_state(self, mine: np.ndarray) -> WaveLegs:
        """Some legs of one contact state."""
        return replace(
            self, state=self.state[mine], amplitudes=self.amplitudes[mine],
            begin=self.begin[mine], length=self.length[mine],
        )  # fmt: skip


def _real_product(waves: np.ndarray, turned: np.ndarray) -> np.ndarray:
    """The real part of waves complex128[m, E] times rows whose conjugates are complex128[R, E],
    float64[m, R]: real and imaginary parts stand side by side.
    """
    product: np.ndarray = waves.view(float) @ turned.view(float).T
    return product


# -- means -----------------------------------------------------------------------------------------
def means(one: WaveLegs) -> np.ndarray:
    """Mean of each quantity, float64[R]."""
    total = _summed(one, one.amplitudes * one.integrals(one.rates[one.state]), one.rows)
    return np.asarray(total.real / one.length.sum())


def _summed(one: WaveLegs, waves: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The sum over all legs of waves complex128[p, E] times the rows complex128[S, R, E] of their
    contact states, complex128[R].
    """
    sums = np.zeros((len(rows), waves.shape[1]), complex)
    np.add.at(sums, one.state, waves)
    return np.asarray(np.einsum("sre,se->r", rows, sums))


def deviations(one: WaveLegs, mean: np.ndarray) -> np.ndarray:
    """Root mean square of each quantity about its mean, float64[R]."""
    total, every = np.zeros(len(mean)), np.arange(len(one.length))
    ends = one.waves(every, one.length)
    for state, mine in one.by_state(every):
        rates, rows = one.rates[state], one.rows[state].copy()
        rows[:, np.flatnonzero(rates == 0.0)[0]] -= mean  # the constant, of amplitude 1
        part = one.of_state(mine)
        for other in (np.asarray, np.conj):
            product = _products(part, rates, ends[mine], other)
            total += 0.5 * ((rows @ product) * other(rows)).sum(axis=1).real
    return np.asarray(np.sqrt(np.maximum(total, 0.0) / one.length.sum()))


def _products(
    one: WaveLegs, single: np.ndarray, end: np.ndarray, other: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """Integrals of the product of each wave with each one, or with its conjugate, over all legs of
    a contact state with rates complex128[E], complex128[E, E]: the difference of the products at
    the ends complex128[p, E] and at the beginnings, divided by their rates.
    """
    begin, rates = one.amplitudes, single[:, None] + other(single)
    slow = np.abs(rates) * one.length.mean() < SLOW
    difference = end.T @ other(end) - begin.T @ other(begin)
    result: np.ndarray = np.where(slow, 0.0, difference / np.where(slow, 1.0, rates))
    first, second = np.nonzero(np.triu(slow))  # the others are the same, or conjugates
    slow_rates = rates[first, second][None]
    step = max(1, HELD // (4 * len(first)))
    for leg in range(0, len(begin), step):
        some = one.of_state(np.arange(leg, min(leg + step, len(begin))))
        both = some.amplitudes[:, first] * other(some.amplitudes[:, second])
        result[first, second] += (both * some.integrals(slow_rates)).sum(axis=0)
    result[second, first] = other(result[first, second])
    return result


def harmonics(one: WaveLegs, rate: float) -> np.ndarray:
    """Complex amplitude A e^{i phi} of A cos(rate t + phi) in each quantity, complex128[R]."""
    back, rates = np.exp(-1j * rate * one.begin)[:, None], one.rates[one.state]
    ahead = back * one.amplitudes * one.integrals(rates - 1j * rate)
    mirrored = back * one.amplitudes.conj() * one.integrals(rates.conj() - 1j * rate)
    total = _summed(one, ahead, one.rows) + _summed(one, mirrored, one.rows.conj())
    return np.asarray(total / one.length.sum())


# -- largest and smallest values -------------------------------------------------------------------
def extremes(one: WaveLegs) -> np.ndarray:
    """Smallest and largest value of each quantity, float64[2, R]."""
    found = np.full((one.rows.shape[1], 2), [np.inf, -np.inf]).T
    every, legs = np.arange(found.shape[1]), np.arange(len(one.length))
    for time in (0.0 * one.length, 0.5 * one.length, one.length):
        _see_all(found, every, one.values(legs, time))
    sizes = one.sizes(legs, 0.5 * one.length, 0.5 * one.length)
    tolerance = np.zeros((len(one.rows), len(every)))
    for state, mine in one.by_state(legs):
        tolerance[state] = TOLERANCE * (sizes[mine] @ one.row_sizes[state].T).max(axis=0)

    def beyond(leg: np.ndarray, row: np.ndarray, value: np.ndarray, room: np.ndarray) -> np.ndarray:
        state = one.state[leg]
        least = tolerance[state[:, None] if value.ndim == 2 else state, row]
        low, high = found[:, row]
        new: np.ndarray = (value - room < low - least) | (value + room > high + least)
        return new

    block = max(1, HELD // (64 * len(every)))
    for first in range(0, len(legs), block):
        open_ = _open(one, legs[first : first + block], found, beyond)
        leg, row, time = _turns(one, open_, beyond)
        _see(found, row, _derivatives(one, leg, row, time)[0])
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
    open_ = np.ones((len(leg), one.rows.shape[1]), bool)
    while open_.sum() > max(FEW_SHARE * open_.size, FEW, FEW_OF_EACH * len(leg)):
        row = np.flatnonzero(open_.any(axis=0))
        waves, reach = one.waves(leg, middle), _reach(one, leg, half)
        slow = np.where(reach < 1.0, waves, 0.0)
        slopes, rest = slow * one.rates[one.state[leg]], one.sizes(leg, middle, half)
        rest *= _remainder(reach)
        value, room = np.empty((2, len(leg), len(row)))
        for state, mine in one.by_state(leg):
            rows = one.turned[state, row]
            value[mine] = _real_product(slow[mine], rows)
            slope = np.abs(_real_product(slopes[mine], rows)) * half[mine, None]
            room[mine] = slope + rest[mine] @ one.row_sizes[state, row].T
            _see_all(found, row, _real_product(waves[mine], rows))
        open_[:, row] &= wanted(leg, row, value, room)
        on = open_.any(axis=1)
        leg, _, middle, half = _halves(leg[on], leg[on], middle[on], half[on])
        open_ = np.tile(open_[on], (2, 1))
    at, row = np.nonzero(open_)
    return leg[at], row, middle[at], half[at]


def _reach(one: WaveLegs, leg: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Angles that the waves of legs go in half lengths float64[m], float64[m, E] [rad]."""
    return np.asarray(np.abs(one.rates)[one.state[leg]] * half[:, None])


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
def least_turns(one: WaveLegs, rows: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Smallest magnitude of quantities int64[r] where they turn, float64[r], inf of those that
    never do. Magnitudes up to ``near`` float64[r] are looked for first.
    """
    least, open_ = np.array(near), np.ones(len(rows), bool)
    for last in (False, True):
        below, found = np.full((2, one.rows.shape[1]), np.inf)
        below[rows] = least

        def low(
            leg: np.ndarray,  # noqa: ARG001
            row: np.ndarray,
            value: np.ndarray,
            room: np.ndarray,
        ) -> np.ndarray:
            return np.asarray(np.abs(value) - room <= below[row])  # noqa: B023

        leg, row, time = turns(one, rows[open_], low)
        np.minimum.at(found, row, np.abs(_derivatives(one, leg, row, time)[0]))
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
    block = max(1, HELD // (8 * one.rates.shape[1]))
    for _ in range(DEEPEST):
        ahead = []
        for first in range(0, len(at[0]), block):
            part = tuple(each[first : first + block] for each in at)
            value, room = _bounds(one, *part)
            may = np.abs(value[1]) <= room[1]
            if wanted is not None:
                may &= wanted(part[0], part[1], value[0], room[0])
            single = may & (np.abs(value[2]) > room[2])
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
    there, and how far from it they are in the intervals at most; both float64[3, m].
    """
    state, reach = one.state[leg], _reach(one, leg, half)
    rates = one.rates[state]
    slow = np.where(reach < 1.0, one.waves(leg, middle) * one.rows[state, row], 0.0)
    rest = one.sizes(leg, middle, half) * one.row_sizes[state, row] * _remainder(reach)
    value = _rates_of(slow, rates, 4)
    room = np.abs(value[1:]) * half + _rates_of(rest, np.abs(rates), 3)
    return value[:3], room


def _rates_of(waves: np.ndarray, rates: np.ndarray, number: int) -> np.ndarray:
    """The real part of sums of waves [m, E], and of their derivatives by rates [m, E],
    float64[number, m].
    """
    found = np.empty((number, len(waves)))
    for order in range(number):
        waves = waves * rates if order else waves
        found[order] = waves.real.sum(axis=1)
    return found


def _derivatives(one: WaveLegs, leg: np.ndarray, row: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Quantities, their slopes and bends at times, float64[3, m]."""
    state = one.state[leg]
    return _rates_of(one.waves(leg, time) * one.rows[state, row], one.rates[state], 3)


def _zeros(
    one: WaveLegs, leg: np.ndarray, row: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Legs, quantities and times of the turning points in intervals that hold one or none, by
    Newton's method inside a shrinking bracket.
    """
    first, last = (_derivatives(one, leg, row, end)[1] for end in (low, high))
    turned = first * last < 0.0
    leg, row, low, high, first = (each[turned] for each in (leg, row, low, high, first))
    time, near, going = 0.5 * (low + high), LAST * (high - low), np.arange(len(leg))
    for _ in range(DEEPEST):
        if not len(going):
            break
        now = time[going]
        _, slope, bend = _derivatives(one, leg[going], row[going], now)
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
