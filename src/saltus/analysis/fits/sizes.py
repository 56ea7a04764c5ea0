"""Derivatives of the sizes of periodic orbits, with the jumps at their contacts.

A mean of q over an orbit that jumps at instants t_c has the derivative of a mean of dq/dp, and a
part (q(t_c-) - q(t_c+)) dt_c/dp for each jump (Leibniz's rule). Between contacts outputs and their
derivatives are polynomials through nodes of Gauss's rule.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from saltus.flow import polynomials

Size = Literal["amplitude", "rms", "peak"]
#: Nodes on each part of an orbit, and the longest part [forcing periods]: of a motion of ten
#: harmonics a mean errs by 1e-13.
NODES, LONGEST = 10, 1 / 24


@dataclass(frozen=True)
class OrbitParts:
    """An orbit in q parts, cut at its contacts.

    Attributes
    ----------
    begin, length : float64[q]
        [s]
    late, later : float64[q, p]
        Derivatives of the times of their beginnings and ends; 0 where there is no contact.
    """

    begin: np.ndarray
    length: np.ndarray
    late: np.ndarray
    later: np.ndarray

    @classmethod
    def of(cls, contacts: np.ndarray, moved: np.ndarray, end: float, longest: float) -> OrbitParts:
        """Of contacts at times float64[c] whose derivatives are float64[c, p]."""
        joints, first = np.unique(np.concatenate([[0.0, end], contacts]), return_index=True)
        known = np.concatenate([np.zeros((2, moved.shape[1])), np.nan_to_num(moved)])[first]
        count = np.ceil(np.diff(joints) / longest).astype(int)
        leg = np.repeat(np.arange(len(count)), count)
        place = np.arange(len(leg)) - (np.cumsum(count) - count)[leg]
        length = (np.diff(joints) / count)[leg]
        late = np.where((place == 0)[:, None], known[leg], 0.0)
        later = np.where((place == count[leg] - 1)[:, None], known[leg + 1], 0.0)
        return cls(joints[leg] + place * length, length, late, later)

    @property
    def times(self) -> np.ndarray:
        """Times of all nodes, float64[q * NODES] [s]."""
        places, _ = polynomials.gauss(NODES)
        return np.ravel(self.begin[:, None] + places * self.length[:, None])

    def slopes(self, size: Size, y: np.ndarray, by: np.ndarray, rate: float) -> np.ndarray:
        """Derivatives of the size of outputs, float64[K, p], from their values at the nodes
        float64[q * NODES, K] and derivatives there float64[q * NODES, K, p]; ``rate`` is that of
        the forcing [rad/s].
        """
        y = y.reshape(len(self.begin), NODES, -1)
        by = by.reshape(*y.shape, -1)
        if size == "peak":
            return self._peak(y, by)
        _, weights = polynomials.gauss(NODES)
        share = weights * (self.length / self.length.sum())[:, None]
        # the jumps at the ends of parts [q, 2, K], and how their instants move [q, 2, p]
        ends = np.stack([_at(y, 0.0), _at(y, 1.0)], axis=1)
        moved = np.stack([-self.late, self.later], axis=1) / self.length.sum()
        if size == "rms":
            rms = np.sqrt(np.einsum("qn,qnk->k", share, y**2))
            half = np.einsum("qn,qnk,qnkp->kp", share, y, by)
            half += 0.5 * np.einsum("qek,qep->kp", ends**2, moved)
            return _quotients(half, rms)
        turn = 2.0 * np.exp(-1j * rate * self.times).reshape(share.shape)
        whole = np.einsum("qn,qnk->k", share * turn, y)
        change = np.einsum("qn,qnkp->kp", share * turn, by)
        instants = np.stack([self.begin, self.begin + self.length], axis=1)
        jumps = 2.0 * np.exp(-1j * rate * instants)[..., None] * ends
        change += np.einsum("qek,qep->kp", jumps, moved)
        return _quotients((np.conj(whole)[:, None] * change).real, np.abs(whole))

    def _peak(self, y: np.ndarray, by: np.ndarray) -> np.ndarray:
        """Those of the largest magnitude, where the output turns or jumps."""
        terms, slopes = _terms(y), _terms(by)
        change = np.zeros((y.shape[2], by.shape[3]))
        every, ends = np.arange(len(y)), np.repeat([0.0, 1.0], len(y))
        for k in range(y.shape[2]):
            rates = polynomials.derivative(terms[..., k])
            part, place = polynomials.sign_changes(rates)
            part, place = np.concatenate([every, every, part]), np.concatenate([ends, place])
            values = polynomials.value(terms[:, part, k], place)
            best = int(np.abs(values).argmax())
            one, at = part[best], place[best]
            late = self.later[one] * (at == 1.0) + self.late[one] * (at == 0.0)
            rate = polynomials.value(rates[:, [one]], np.array([at])) / self.length[one]
            own = polynomials.value(slopes[:, one, k], np.full(by.shape[3], at))
            change[k] = np.sign(values[best]) * (own + rate * late)
        return change


def _quotients(changes: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Slopes float64[K, p] of sizes float64[K]. That of an output which stays zero, as the force at
    a stop that isn't met, is zero: the mean of both sides.
    """
    slopes = np.zeros(changes.shape)
    np.divide(changes, sizes[:, None], out=slopes, where=sizes[:, None] > 0)
    return slopes


def _at(y: np.ndarray, place: float) -> np.ndarray:
    """Values at a place in [0, 1] of all parts of what is known at nodes, [q, NODES, ...]."""
    return np.asarray(_terms(y)[0] if place == 0.0 else _terms(y).sum(axis=0))


def _terms(y: np.ndarray) -> np.ndarray:
    """Terms of the polynomials through nodes [q, NODES, ...]: [NODES, q, ...]."""
    places, weights = polynomials.gauss(NODES)
    orders = np.arange(NODES)
    waves = np.polynomial.legendre.legvander(2.0 * places - 1.0, NODES - 1)
    sums = np.einsum("nm,qn...->mq...", (weights[:, None] * (2 * orders + 1)) * waves, y)
    # Legendre's shifted polynomials have whole coefficients: these sums lose no figures, as the
    # inverse of Vandermonde's matrix would
    whole = [
        [(-1) ** (m + k) * math.comb(m, k) * math.comb(m + k, k) for m in range(NODES)]
        for k in range(NODES)
    ]
    return np.asarray(np.einsum("km,mq...->kq...", np.array(whole, float), sums))
