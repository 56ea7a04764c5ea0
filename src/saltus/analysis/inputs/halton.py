"""Quasi-random points: the sequence of Halton.

scipy.stats has it too, but its import (0.7 s) takes longer than the search for attractors of many a
map.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np


def halton(count: int, dimensions: int) -> np.ndarray:
    """The first points of the sequence, in [0, 1): float64[count, dimensions]; the first is the
    origin.

    Coordinate i of point n is n written backwards behind the point, in base of the i-th prime.

    References
    ----------
    J. H. Halton, Numerische Mathematik 2 (1960) 84-90.
    """
    bases = itertools.islice(_primes(), dimensions)
    return np.stack([_radical_inverse(count, base) for base in bases], axis=1)


def _radical_inverse(count: int, base: int) -> np.ndarray:
    """0, 1, 2, ... written backwards behind the point: float64[count]."""
    left, values, place = np.arange(count), np.zeros(count), 1.0 / base
    while left.any():
        left, digit = np.divmod(left, base)
        values += digit * place
        place /= base
    return values


def _primes() -> Iterator[int]:
    found: list[int] = []
    for number in itertools.count(2):
        if all(number % prime for prime in found):
            found.append(number)
            yield number
