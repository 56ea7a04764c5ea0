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
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

#: Largest error of a largest value, relative to the size of its waves.
TOLERANCE = 1e-14
#: A step of Newton's method that is rounding, relative to the time.
SETTLED = 4e-16
#: One that is the last, relative to an interval in which a quantity turns once.
LAST = 1e-8
#: Most halvings of a leg, and of one whose quantities are looked at together: turns are told from
#: small values by their slopes, which only those that are looked at one by one have.
DEEPEST, TOGETHER = 60, 6
#: Numbers that an evaluation holds at a time: some 60 MB.
HELD = 2**22
#: The product of two waves that goes less far than this in a leg of mean length [rad] is integrated
#: leg by leg: the difference of its values at both ends has lost digits.
SLOW = 0.1
#: Magnitudes of turning points that are looked for one after the other, before all others.
WIDER = (1.0, 30.0)
#: Rate of a wave of which nothing is seen.
UNSEEN = -1.0
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
    """p legs of M motions through S contact states, with R quantities of E waves. What is found of
    a motion doesn't depend on the others, to the bit.

    Attributes
    ----------
    rates : complex128[S, E]
        mu [1/s].
    rows : complex128[S, R, E]
        What each wave adds to each quantity [its unit].
    motion : int64[S]
        Motion of each contact state, ascending from 0.
    state : int64[p]
        Contact state of each leg, ascending from 0.
    amplitudes : complex128[p, E]
        Of the waves at the beginning of a leg.
    begin, length : float64[p]
        Since the start of the motion [s]; duration [s].
    """

    rates: np.ndarray
    rows: np.ndarray
    motion: np.ndarray
    state: np.ndarray
    amplitudes: np.ndarray
    begin: np.ndarray
    length: np.ndarray

    @classmethod
    def joined(cls, each: Sequence[WaveLegs]) -> WaveLegs:
        """All motions of several, one after the other."""
        widest = max(one.rates.shape[1] for one in each)
        states = np.cumsum([0, *(len(one.rates) for one in each)])
        motions = np.cumsum([0, *(one.motions for one in each)])

        def put(name: str, number: float = 0.0) -> np.ndarray:
            return np.concatenate([padded(getattr(one, name), widest, number) for one in each])

        return cls(
            put("rates", UNSEEN), put("rows"),
            np.concatenate([one.motion + n for one, n in zip(each, motions, strict=False)]),
            np.concatenate([one.state + n for one, n in zip(each, states, strict=False)]),
            put("amplitudes"),
            np.concatenate([one.begin for one in each]),
            np.concatenate([one.length for one in each]),
        )  # fmt: skip

    @property
    def motions(self) -> int:
        """M."""
        return int(self.motion[-1]) + 1

    @functools.cached_property
    def owner(self) -> np.ndarray:
        """Motion of each leg, int64[p]."""
        return np.asarray(self.motion[self.state])

    @functools.cached_property
    def duration(self) -> np.ndarray:
        """Of each motion, float64[M, 1] [s]."""
        return np.add.reduceat(self.length, _begins(self.owner))[:, None]

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
        for mine in np.split(order, _begins(states)[1:]):
            if len(mine):
                yield int(self.state[leg[mine[0]]]), mine

    def parts(self) -> Iterator[np.ndarray]:
        """Legs to be looked at together, int64[m]: of each motion so many as an evaluation of all
        quantities holds.
        """
        most = max(1, HELD // (64 * self.rows.shape[1]))
        part = _ranks(self.owner) // most
        for number in range(int(part.max()) + 1):
            yield np.flatnonzero(part == number)

    def integrals(self, rates: np.ndarray) -> np.ndarray:
        """The integral of e^{rate t} over each leg, rates complex128[p, n]; complex128[p, n]."""
        return _integrals(rates, self.length[:, None])


def padded(waves: np.ndarray, width: int, number: float = 0.0) -> np.ndarray:
    """Waves with others before them, of which nothing is seen, [.., width]."""
    more = np.full((*waves.shape[:-1], width - waves.shape[-1]), number, complex)
    return np.concatenate([more, waves], axis=-1)


def _integrals(rates: np.ndarray, length: np.ndarray) -> np.ndarray:
    """The integral of e^{rate t} over lengths of time."""
    at = rates * length
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(at == 0.0, 1.0, np.expm1(at) / at)
    result: np.ndarray = mean * length
    return result


def _begins(groups: np.ndarray) -> np.ndarray:
    """First place of each group in int64[m], whose numbers stand together."""
    return np.flatnonzero(np.diff(groups, prepend=-1))


def _ranks(groups: np.ndarray) -> np.ndarray:
    """Place of each in its group, int64[m]: 0, 1, .. in each of int64[m], ascending."""
    begins = _begins(groups)
    first = np.repeat(begins, np.diff(begins, append=len(groups)))
    return np.asarray(np.arange(len(groups)) - first)


def _real_product(waves: np.ndarray, turned: np.ndarray) -> np.ndarray:
    """The real part of waves complex128[m, E] times rows whose conjugates are complex128[R, E],
    float64[m, R]: real and imaginary parts stand side by side.
    """
    product: np.ndarray = waves.view(float) @ turned.view(float).T
    return product


# -- means -----------------------------------------------------------------------------------------
def means(one: WaveLegs) -> np.ndarray:
    """Mean of each quantity, float64[M, R]."""
    total = _summed(one, one.amplitudes * one.integrals(one.rates[one.state]), one.rows)
    return np.asarray(total.real / one.duration)


def _summed(one: WaveLegs, waves: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The sum over all legs of waves complex128[p, E] times the rows complex128[S, R, E] of their
    contact states, complex128[M, R].
    """
    sums = np.add.reduceat(waves, _begins(one.state), axis=0)
    return np.add.reduceat(np.einsum("sre,se->sr", rows, sums), _begins(one.motion), axis=0)


def deviations(one: WaveLegs, mean: np.ndarray) -> np.ndarray:
    """Root mean square of each quantity about its mean float64[M, R], float64[M, R]."""
    every = np.arange(len(one.rates))
    rows, constant = one.rows.copy(), np.argmax(one.rates == 0.0, axis=1)
    rows[every, :, constant] -= mean[one.motion]  # of amplitude 1
    ends, total = one.waves(np.arange(len(one.length)), one.length), np.zeros(rows.shape[:2])
    for other in (np.asarray, np.conj):
        product = _products(one, ends, other)
        total += 0.5 * ((rows @ product) * other(rows)).sum(axis=2).real
    square = np.add.reduceat(total, _begins(one.motion), axis=0)
    return np.asarray(np.sqrt(np.maximum(square, 0.0) / one.duration))


def _products(
    one: WaveLegs, ends: np.ndarray, other: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """Integrals of the product of each wave with each one, or with its conjugate, over all legs of
    a contact state, complex128[S, E, E]: the difference of the products at the ends complex128[p,
    E] and at the beginnings, divided by their rates.
    """
    rates = one.rates[:, :, None] + other(one.rates)[:, None, :]
    begins, result = _begins(one.state), np.empty(rates.shape, complex)
    count = np.diff(begins, append=len(one.state))
    for number, (place, legs) in enumerate(zip(begins, count, strict=True)):
        begin, end = one.amplitudes[place : place + legs], ends[place : place + legs]
        result[number] = end.T @ other(end) - begin.T @ other(begin)
    mean = np.add.reduceat(one.length, begins) / count
    slow = np.abs(rates) * mean[:, None, None] < SLOW
    result /= np.where(slow, 1.0, rates)
    state, first, second = np.nonzero(np.triu(slow))  # the others are the same, or conjugates
    sums = np.empty(len(state), np.complex128)
    for part in _split(count[state], HELD // 16):
        own = state[part]
        pair = np.repeat(np.arange(len(own)), count[own])
        leg = begins[own][pair] + _ranks(pair)
        both = one.amplitudes[leg, first[part][pair]]
        both = both * other(one.amplitudes[leg, second[part][pair]])
        rate = rates[own, first[part], second[part]][pair]
        sums[part] = np.add.reduceat(both * _integrals(rate, one.length[leg]), _begins(pair))
    result[state, first, second] = sums
    result[state, second, first] = other(sums)
    return result


def _split(sizes: np.ndarray, held: int) -> Iterator[slice]:
    """Parts of int64[n] that add up to a number each, or are one alone."""
    first, total = 0, np.cumsum(sizes)
    while first < len(sizes):
        before = total[first] - sizes[first]
        last = max(first + 1, int(np.searchsorted(total, before + held, side="right")))
        yield slice(first, last)
        first = last


def harmonics(one: WaveLegs, rate: np.ndarray) -> np.ndarray:
    """Complex amplitude A e^{i phi} of A cos(rate t + phi) in each quantity, complex128[M, R], at
    rates float64[M] [rad/s].
    """
    turning = 1j * rate[one.owner]
    back, rates = np.exp(-turning * one.begin)[:, None], one.rates[one.state]
    ahead = back * one.amplitudes * one.integrals(rates - turning[:, None])
    mirrored = back * one.amplitudes.conj() * one.integrals(rates.conj() - turning[:, None])
    total = _summed(one, ahead, one.rows) + _summed(one, mirrored, one.rows.conj())
    return np.asarray(total / one.duration)


# -- largest and smallest values -------------------------------------------------------------------
def extremes(one: WaveLegs) -> np.ndarray:
    """Smallest and largest value of each quantity, float64[2, M, R]."""
    found = np.full((one.motions, one.rows.shape[1], 2), [np.inf, -np.inf]).transpose(2, 0, 1)
    legs = np.arange(len(one.length))
    for time in (0.0 * one.length, 0.5 * one.length, one.length):
        _see_all(found, one.owner, one.values(legs, time))
    sizes = one.sizes(legs, 0.5 * one.length, 0.5 * one.length)
    tolerance = np.zeros(one.rows.shape[:2])
    for state, mine in one.by_state(legs):
        tolerance[state] = TOLERANCE * (sizes[mine] @ one.row_sizes[state].T).max(axis=0)

    def beyond(leg: np.ndarray, row: np.ndarray, value: np.ndarray, room: np.ndarray) -> np.ndarray:
        least, (low, high) = tolerance[one.state[leg], row], found[:, one.owner[leg], row]
        new: np.ndarray = (value - room < low - least) | (value + room > high + least)
        return new

    for part in one.parts():
        open_ = _open(one, part, found, beyond)
        leg, row, time = _turns(one, open_, beyond)
        value = _derivatives(one, leg, row, time)[0]
        np.minimum.at(found[0], (one.owner[leg], row), value)
        np.maximum.at(found[1], (one.owner[leg], row), value)
    return found


def _see_all(found: np.ndarray, motion: np.ndarray, value: np.ndarray) -> None:
    """Put values float64[m, R] of motions int64[m] into the extremes float64[2, M, R]; NaN are left
    out.
    """
    order = np.argsort(motion, kind="stable")
    begins = _begins(motion[order])
    who = motion[order][begins]
    found[0, who] = np.fmin(found[0, who], np.fmin.reduceat(value[order], begins, axis=0))
    found[1, who] = np.fmax(found[1, who], np.fmax.reduceat(value[order], begins, axis=0))


def _open(one: WaveLegs, leg: np.ndarray, found: np.ndarray, wanted: Wanted) -> Intervals:
    """Intervals of legs in which quantities may be wanted, after some halvings: all quantities of a
    motion are looked at together while they are many. What is seen on the way is put into
    ``found``.
    """
    middle, half = 0.5 * one.length[leg], 0.5 * one.length[leg]
    open_ = np.ones((len(leg), one.rows.shape[1]), bool)
    every, few = np.arange(one.rows.shape[1]), list[Intervals]()
    for halvings in range(TOGETHER + 1):
        owner = one.owner[leg]
        legs, left = np.bincount(owner), np.bincount(owner, open_.sum(axis=1))
        shared = max(FEW_SHARE * len(every), FEW_OF_EACH) * legs
        many = (left > np.maximum(shared, FEW))[owner] & (halvings < TOGETHER)
        at, row = np.nonzero(open_ & ~many[:, None])
        few.append((leg[at], row, middle[at], half[at]))
        leg, middle, half, open_ = leg[many], middle[many], half[many], open_[many]
        if not len(leg):
            break
        waves, reach = one.waves(leg, middle), _reach(one, leg, half)
        slow = np.where(reach < 1.0, waves, 0.0)
        slopes, rest = slow * one.rates[one.state[leg]], one.sizes(leg, middle, half)
        rest *= _remainder(reach)
        value, room, seen = np.full((3, len(leg), len(every)), np.nan)
        for state, mine in one.by_state(leg):
            row = np.flatnonzero(open_[mine].any(axis=0))
            rows, at_all = one.turned[state, row], (mine[:, None], row)
            value[at_all] = _real_product(slow[mine], rows)
            slope = np.abs(_real_product(slopes[mine], rows)) * half[mine, None]
            room[at_all] = slope + rest[mine] @ one.row_sizes[state, row].T
            seen[at_all] = _real_product(waves[mine], rows)
        _see_all(found, one.owner[leg], seen)
        open_ &= wanted(leg[:, None], every, value, room)
        on = open_.any(axis=1)
        leg, _, middle, half = _halves(leg[on], leg[on], middle[on], half[on])
        open_ = np.tile(open_[on], (2, 1))
    leg, row, middle, half = (np.concatenate(part) for part in zip(*few, strict=True))
    return leg, row, middle, half


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
    """Smallest magnitude of quantities int64[r] where they turn, float64[M, r], inf of those that
    never do. Magnitudes up to ``near`` float64[M, r] are looked for first.
    """
    if not near.size:  # a structure without contacts
        return near
    asked, unseen = replace(one, rows=one.rows[:, rows]), np.zeros((2, *near.shape))
    least, open_ = np.full(near.shape, np.inf), np.ones(near.shape, bool)
    for wide in WIDER:
        below = np.where(open_, np.minimum(wide * near, least), -np.inf)

        def low(
            leg: np.ndarray, row: np.ndarray, value: np.ndarray, room: np.ndarray
        ) -> np.ndarray:
            return np.asarray(np.abs(value) - room <= below[one.owner[leg], row])  # noqa: B023

        for part in asked.parts():
            leg, row, time = _turns(asked, _open(asked, part, unseen, low), low)
            size = np.abs(_derivatives(asked, leg, row, time)[0])
            np.minimum.at(least, (one.owner[leg], row), size)
        open_ &= least > wide * near
        if not open_.any():
            return least
    leg, row = np.nonzero(open_[one.owner])
    below = least
    leg, row, time = _turns(asked, (leg, row, 0.5 * one.length[leg], 0.5 * one.length[leg]), low)
    np.minimum.at(least, (one.owner[leg], row), np.abs(_derivatives(asked, leg, row, time)[0]))
    return least


def turns(one: WaveLegs, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Legs int64[t], quantities int64[t] among ``rows`` int64[r], and times float64[t] since the
    beginnings of the legs at which they turn, between the ends of the legs.
    """
    leg, row = np.repeat(np.arange(len(one.length)), len(rows)), np.tile(rows, len(one.length))
    return _turns(one, (leg, row, 0.5 * one.length[leg], 0.5 * one.length[leg]), None)


def _turns(
    one: WaveLegs, at: Intervals, wanted: Wanted | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As :func:`turns`, in some intervals; those that aren't ``wanted`` may be left out."""
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
