"""Motions as the modal flow moves them: between two contacts every quantity is a sum of waves,
whose mean and mean square are exact, and whose largest values and turning points are found in
flow/wave_turns.py.

On a leg, q(t) = Re(sum_e r_e a_e e^{mu_e t}): the waves are the modes of the contact state, a
constant (mu = 0) and the drives (mu = i rate). The legs of all contact states go through each
computation together.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

#: Numbers that an evaluation holds at a time: some 60 MB.
HELD = 2**22
#: The product of two waves that goes less far than this in a leg of mean length [rad] is integrated
#: leg by leg: the difference of its values at both ends has lost digits.
SLOW = 0.1
#: Rate of a wave of which nothing is seen.
UNSEEN = -1.0


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

    @functools.cached_property
    def turned(self) -> np.ndarray:
        """The conjugates of the rows, complex128[S, R, E]."""
        return np.asarray(self.rows.conj(), order="C")

    def by_state(self, leg: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
        """Contact states, and which of legs int64[m] are in them, int64[..] each."""
        order = np.argsort(self.state[leg], kind="stable")
        states = self.state[leg][order]
        for mine in np.split(order, _begins(states)[1:]):
            if len(mine):
                yield int(self.state[leg[mine[0]]]), mine

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
